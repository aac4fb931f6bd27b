use super::wiring::{BlockKind, Wiring};
use crate::element::Mistake;
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

fn write(wiring: &mut Wiring<'_>) -> Result<(), Mistake> {
    let (input, dimension) = wiring.input("input")?;
    let high = wiring.needed("high", dimension)?;
    let low = wiring.of("low", dimension)?.unwrap_or(-high);
    wiring.in_order(["low", "high"], [low, high], dimension)?;
    let answer = wiring.step(|memory| kardan_rt::DeadZone { low, high }.step(input, memory), [Wiring::zero()]);
    wiring.answer(answer, dimension);
    Ok(())
}
