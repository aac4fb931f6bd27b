//! The block `delay` by whole samples.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_math::units::Dimension;
use kardan_schema::schema::{BlockKeys, Keys, Sign, keys};

keys! {
    /// A delay by whole samples.
    block Delay("delay") {
        required {
            input: Expression, "The input signal.";
        }
        optional {
            time: Quantity(Dimension::TIME, Sign::Positive), "The delay: a whole multiple of the sample time; left out: one sample.";
            initial: Expression, "Output until then; left out: 0.";
        }
    }
}

pub(super) const DELAY: BlockKind = BlockKind {
    keyword: Delay::KEYWORD,
    summary: "A delay by whole samples; it needs a sample time. It has no direct feedthrough, so it may close a loop.",
    formula: "The input `time` ago, in whole samples.",
    fields: Delay::FIELDS,
    example: "\
[block.late]
kind = \"delay\"
input = \"encoder.phi\"
time = \"3 ms\"
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, dimension) = builder.input("input")?;
    builder.period("it counts in samples")?;
    let start = builder.of("initial", dimension)?.unwrap_or(BlockBuilder::zero());
    let count = match (builder.values.exact("time"), &builder.sample_time) {
        (Some(time), Some(period)) => builder.samples("time", time, period)?,
        _ => 1,
    };
    if count == 0 {
        return Err(KeyError::new(
            "time",
            "`time` is shorter than a sample",
            "make it one sample, or remove the block",
        ));
    }
    let output = builder.step(|memory| kardan_rt::Delay.step(input, memory), vec![start; count + 1]);
    builder.output(output, dimension);
    Ok(())
}
