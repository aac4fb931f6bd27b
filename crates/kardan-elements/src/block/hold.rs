//! The block `hold`: a zero-order hold that converts sample times.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A sample-time converter.
    block Hold("hold") {
        required {
            input: Expression, "The input signal, of any sample times.";
        }
    }
}

pub(super) const HOLD: BlockKind = BlockKind {
    keyword: Hold::KEYWORD,
    summary: "A sample-time converter: a signal as it is at a sample.",
    formula: "The input, read at its samples. Blocks of shorter sample times compute first: a faster signal is read at its current value, a slower\n\
              one at its value before this instant.",
    fields: Hold::FIELDS,
    example: "\
[block.slow]
kind = \"low_pass\"
input = \"encoder.phi\"
time_constant = \"50 ms\"
sample_time = \"10 ms\"

[block.slow_at_1_ms]
kind = \"hold\"
input = \"slow\"
sample_time = \"1 ms\"
",
    crosses: true,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, dimension) = builder.input("input")?;
    builder.period("it reads at samples")?;
    builder.output(input, dimension);
    Ok(())
}
