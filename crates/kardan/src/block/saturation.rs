use super::wiring::{BlockKind, Wiring, mistake};
use crate::element::Mistake;
use crate::schema::{BlockKeys, Keys, keys};

keys! {
    /// A signal between two bounds.
    block Saturation("saturation") {
        required {
            input: Expression, "What it reads.";
        }
        optional {
            low: Expression, "The smallest answer; left out: that below zero which `high` is above, if there is one.";
            high: Expression, "The largest answer; left out: no bound.";
        }
    }
}

pub(super) const SATURATION: BlockKind = BlockKind {
    keyword: Saturation::KEYWORD,
    summary: "A signal between two bounds.",
    formula: "min(max(input, low), high)",
    fields: Saturation::FIELDS,
    example: "\
[block.bounded]
kind = \"saturation\"
input = \"3 * torque_sensor.tau\"
high = \"4 N m\"
",
    crosses: false,
    write,
};

fn write(wiring: &mut Wiring<'_>) -> Result<(), Mistake> {
    let (input, dimension) = wiring.input("input")?;
    let bounds = wiring.bounds(dimension)?;
    if bounds.iter().all(Option::is_none) {
        return Err(mistake("high", "there is no bound", "add `high`, `low` or both"));
    }
    let answer = wiring.within(input, bounds);
    wiring.answer(answer, dimension);
    Ok(())
}
