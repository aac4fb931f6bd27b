//! The block `table`: a lookup table over one or two signals.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_expr::expr::Traced;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A lookup table over one or two signals.
    block TableBlock("table") {
        required {
            input: Expression, "The first input signal.";
            table: Text, "Name of the `[table.NAME]`.";
        }
        optional {
            input_2: Expression, "The second input signal, of a table over two quantities.";
        }
    }
}

pub(super) const TABLE: BlockKind = BlockKind {
    keyword: TableBlock::KEYWORD,
    summary: "A lookup table over one or two signals; the same as calling it in an expression.",
    formula: "table(input) or table(input, input_2); `kardan elements table` describes tables.",
    fields: TableBlock::FIELDS,
    example: "\
[table.boost_curve]
points = { x = [\"0 N m\", \"5 N m\"], value = [\"0 N m\", \"40 N m\"] }

[block.boost]
kind = \"table\"
table = \"boost_curve\"
input = \"torque_sensor.tau\"
",
    crosses: false,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let Some(table) = builder.table.clone() else {
        let name = builder.values.word_or_default("table");
        let help = "declare it by its points, or by a file";
        return Err(KeyError::new("table", format!("there is no table `{name}`"), help));
    };
    let expected = table.arguments().to_vec();
    if expected.len() == 1 && builder.inputs.contains_key("input_2") {
        return Err(KeyError::new("input_2", "the table is over one quantity", "remove `input_2`"));
    }
    let mut at = Vec::new();
    for (key, expected) in ["input", "input_2"].into_iter().zip(expected) {
        at.push(builder.needed(key, expected)?.expr(builder.graph));
    }
    let value = table.write_into(&mut builder.graph.borrow_mut(), &at);
    builder.output(Traced::new(builder.graph, value), table.dimension());
    Ok(())
}
