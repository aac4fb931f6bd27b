use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use crate::schema::{BlockKeys, Keys, keys};

keys! {
    /// A signal less what lies within a zone.
    block DeadZone("dead_zone") {
        required {
            input: Expression, "What it reads.";
            high: Expression, "Where the zone ends.";
        }
        optional {
            low: Expression, "Where it begins; left out: as far below zero as it ends above.";
        }
    }
}

pub(super) const DEAD_ZONE: BlockKind = BlockKind {
    keyword: DeadZone::KEYWORD,
    summary: "A signal less what lies within a zone: zero there, straight outside.",
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
    let answer = builder.step(|memory| kardan_rt::DeadZone { low, high }.step(input, memory), [BlockBuilder::zero()]);
    builder.answer(answer, dimension);
    Ok(())
}
