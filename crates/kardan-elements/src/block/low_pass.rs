//! The block `low_pass`: a filter of first or second order.

use super::builder::{BlockBuilder, BlockKind};
use super::rational::filtered;
use crate::element::KeyError;
use kardan_math::units::Dimension;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A first- or second-order low pass.
    block LowPass("low_pass") {
        required {
            input: Expression, "The input signal.";
            time_constant: Expression, "T; `\"1 / (2 pi * 20 / 1 s)\"` for a corner at 20 Hz.";
        }
        optional {
            damping_ratio: Expression, "Damping ratio d of a second-order low pass; left out: first order.";
            initial: Expression, "Output at the start, in equilibrium; left out: 0.";
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
    builder.positive("time_constant", Dimension::TIME, "the output would grow without bound, or equal the input")?;
    let one = BlockBuilder::one();
    let denominator =
        match builder.not_negative("damping_ratio", Dimension::NONE, "it would oscillate with growing amplitude")? {
            Some(damping) => vec![one, (damping + damping) * time, time * time],
            None => vec![one, time],
        };
    let start = builder.of("initial", dimension)?.unwrap_or(BlockBuilder::zero());
    let output = filtered(builder, (&[one], &denominator), input, start)?;
    builder.output(output, dimension);
    Ok(())
}
