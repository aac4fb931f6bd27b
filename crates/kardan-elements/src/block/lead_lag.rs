//! The block `lead_lag`: a lead or lag of first order.

use super::builder::{BlockBuilder, BlockKind};
use super::rational::filtered;
use crate::element::KeyError;
use kardan_math::units::Dimension;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A first-order lead or lag.
    block LeadLag("lead_lag") {
        required {
            input: Expression, "The input signal.";
            lead: Expression, "T1, the time constant of the numerator.";
            lag: Expression, "T2, the time constant of the denominator.";
        }
        optional {
            initial: Expression, "Output at the start, in equilibrium; left out: 0.";
        }
    }
}

pub(super) const LEAD_LAG: BlockKind = BlockKind {
    keyword: LeadLag::KEYWORD,
    summary: "A first-order lead or lag.",
    formula: "(1 + T1 s)/(1 + T2 s). At a sample time h by the bilinear rule, s = (2/h)(z - 1)/(z + 1).",
    fields: LeadLag::FIELDS,
    example: "\
[block.lead]
kind = \"lead_lag\"
input = \"torque_sensor.tau\"
lead = \"20 ms\"
lag = \"4 ms\"
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, dimension) = builder.input("input")?;
    builder.positive("lag", Dimension::TIME, "the output would grow without bound, or be a derivative")?;
    let [lead, lag] = [builder.needed("lead", Dimension::TIME)?, builder.needed("lag", Dimension::TIME)?];
    let start = builder.of("initial", dimension)?.unwrap_or(BlockBuilder::zero());
    let one = BlockBuilder::one();
    let output = filtered(builder, (&[one, lead], &[one, lag]), input, start)?;
    builder.output(output, dimension);
    Ok(())
}
