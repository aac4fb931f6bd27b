//! The block `hysteresis`: a switch with two thresholds.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_math::units::Dimension;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A switch with two thresholds.
    block Hysteresis("hysteresis") {
        required {
            input: Expression, "The input signal.";
            upper: Expression, "It switches on where its input is at or above this.";
            lower: Expression, "It switches off where its input is at or below this; less than `upper`.";
        }
        optional {
            on: Expression, "Output while it is on; left out: 1.";
            off: Expression, "Output while it is off; left out: 0.";
        }
    }
}

pub(super) const HYSTERESIS: BlockKind = BlockKind {
    keyword: Hysteresis::KEYWORD,
    summary: "A switch with two thresholds (Schmitt trigger); it needs a sample time.",
    formula: "Off at the start; on from the upper threshold, off again from the lower one.",
    fields: Hysteresis::FIELDS,
    example: "\
[block.hands_on]
kind = \"hysteresis\"
input = \"abs(torque_sensor.tau)\"
upper = \"0.5 N m\"
lower = \"0.2 N m\"
sample_time = \"10 ms\"
",
    crosses: false,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, of) = builder.input("input")?;
    builder.period("it switches at samples")?;
    let (upper, lower) = (builder.needed("upper", of)?, builder.needed("lower", of)?);
    builder.in_order(["lower", "upper"], [lower, upper], of)?;
    let (on, dimension) = builder.inputs.get("on").copied().unwrap_or((BlockBuilder::one(), Dimension::NONE));
    let off = builder.of("off", dimension)?.unwrap_or(BlockBuilder::zero());
    let switch = kardan_rt::Hysteresis { upper, lower, levels: [off, on] };
    let output = builder.step(|state| switch.step(input, state), [BlockBuilder::zero(); 2]);
    builder.output(output, dimension);
    Ok(())
}
