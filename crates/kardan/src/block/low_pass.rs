use super::builder::{BlockBuilder, BlockKind};
use super::rational::filtered;
use crate::element::KeyError;
use crate::schema::{BlockKeys, Keys, keys};
use crate::units::Dimension;

keys! {
    /// A low pass of first or second order.
    block LowPass("low_pass") {
        required {
            input: Expression, "What it reads.";
            time_constant: Expression, "T; `\"1 / (2 pi * 20 / 1 s)\"` for a corner at 20 Hz.";
        }
        optional {
            damping_ratio: Expression, "d of one of second order; left out: it is of first order.";
            initial: Expression, "Its answer at the start, where it is at rest; left out: 0.";
        }
    }
}

pub(super) const LOW_PASS: BlockKind = BlockKind {
    keyword: LowPass::KEYWORD,
    summary: "A low pass of first or second order.",
    formula: "1/(1 + T s), or 1/(1 + 2 d T s + T^2 s^2). At a sample time h by the bilinear rule, s = (2/h)(z - 1)/(z + 1).",
    fields: LowPass::FIELDS,
    example: "\
[block.smooth]
kind = \"low_pass\"
input = \"torque_sensor.tau\"
time_constant = \"5 ms\"
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, dimension) = builder.input("input")?;
    let time = builder.needed("time_constant", Dimension::TIME)?;
    builder.positive("time_constant", Dimension::TIME, "what it answers would grow by itself, or be its input")?;
    let one = BlockBuilder::one();
    let denominator = match builder.not_negative("damping_ratio", Dimension::NONE, "it would swing up by itself")? {
        Some(damping) => vec![one, (damping + damping) * time, time * time],
        None => vec![one, time],
    };
    let start = builder.of("initial", dimension)?.unwrap_or(BlockBuilder::zero());
    let answer = filtered(builder, (&[one], &denominator), input, start)?;
    builder.answer(answer, dimension);
    Ok(())
}
