//! The block `gain`.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A signal times a gain.
    block Gain("gain") {
        required {
            input: Expression, "The input signal.";
            gain: Expression, "The gain, with its unit; it may vary.";
        }
    }
}

pub(super) const GAIN: BlockKind = BlockKind {
    keyword: Gain::KEYWORD,
    summary: "A signal times a gain.",
    formula: "gain * input",
    fields: Gain::FIELDS,
    example: "\
[block.assist]
kind = \"gain\"
input = \"rotor.w\"
gain = \"-0.02 N m s/rad\"
",
    crosses: false,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let ((input, of), (gain, by)) = (builder.input("input")?, builder.input("gain")?);
    let dimension = builder.over("gain", of, by, 1)?;
    builder.output(gain * input, dimension);
    Ok(())
}
