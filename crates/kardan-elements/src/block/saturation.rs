//! The block `saturation`.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A signal between two bounds.
    block Saturation("saturation") {
        required {
            input: Expression, "The input signal.";
        }
        optional {
            low: Expression, "Lower limit of the output; left out: -`high`, if `high` is given.";
            high: Expression, "Upper limit of the output; left out: no limit.";
        }
    }
}

pub(super) const SATURATION: BlockKind = BlockKind {
    keyword: Saturation::KEYWORD,
    summary: "A signal limited to two bounds.",
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

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, dimension) = builder.input("input")?;
    let bounds = builder.bounds(dimension)?;
    if bounds.iter().all(Option::is_none) {
        return Err(KeyError::new("high", "there is no bound", "add `high`, `low` or both"));
    }
    let output = builder.clamped(input, bounds);
    builder.output(output, dimension);
    Ok(())
}
