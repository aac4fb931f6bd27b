//! The block `dead_zone`.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A dead zone.
    block DeadZone("dead_zone") {
        required {
            input: Expression, "The input signal.";
            high: Expression, "Upper end of the zone.";
        }
        optional {
            low: Expression, "Lower end of the zone; left out: -`high`.";
        }
    }
}

pub(super) const DEAD_ZONE: BlockKind = BlockKind {
    keyword: DeadZone::KEYWORD,
    summary: "A dead zone: zero within the zone, linear with slope 1 outside.",
    formula: "input - high above the zone, input - low below it, else 0",
    fields: DeadZone::FIELDS,
    example: "\
[block.beyond_friction]
kind = \"dead_zone\"
input = \"torque_sensor.tau\"
high = \"0.3 N m\"
",
    crosses: false,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, dimension) = builder.input("input")?;
    let high = builder.needed("high", dimension)?;
    let low = builder.of("low", dimension)?.unwrap_or(-high);
    builder.in_order(["low", "high"], [low, high], dimension)?;
    let output = builder.step(|state| kardan_rt::DeadZone { low, high }.step(input, state), [BlockBuilder::zero()]);
    builder.output(output, dimension);
    Ok(())
}
