use super::wiring::{BlockKind, Wiring};
use crate::element::Mistake;
use crate::schema::{BlockKeys, Keys, keys};

keys! {
    /// A signal times a gain.
    block Gain("gain") {
        required {
            input: Expression, "What it reads.";
            gain: Expression, "The gain, with its unit; it may vary.";
        }
        optional {
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

fn write(wiring: &mut Wiring<'_>) -> Result<(), Mistake> {
    let ((input, of), (gain, by)) = (wiring.input("input")?, wiring.input("gain")?);
    let dimension = wiring.over("gain", of, by, 1)?;
    wiring.answer(gain * input, dimension);
    Ok(())
}
