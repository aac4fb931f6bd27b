use super::wiring::{BlockKind, Wiring, mistake};
use crate::element::Mistake;
use crate::expr::Traced;
use crate::schema::{BlockKeys, Keys, keys};

keys! {
    /// A table over one signal or two.
    block TableBlock("table") {
        required {
            input: Expression, "What it is looked up at.";
            table: Text, "Name of the `[table.NAME]`.";
        }
        optional {
            input_2: Expression, "What a table over two quantities is looked up at besides.";
        }
    }
}

pub(super) const TABLE: BlockKind = BlockKind {
    keyword: TableBlock::KEYWORD,
    summary: "A table over one signal or two; the same as calling it in an expression.",
    formula: "table(input) or table(input, input_2); `kardan elements table` shows tables.",
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

fn write(wiring: &mut Wiring<'_>) -> Result<(), Mistake> {
    let Some(table) = wiring.table.clone() else {
        let name = wiring.values.word_or_default("table");
        let help = "declare it by its points, or by a file";
        return Err(mistake("table", format!("there is no table `{name}`"), help));
    };
    let wanted = table.arguments().to_vec();
    if wanted.len() == 1 && wiring.given.contains_key("input_2") {
        return Err(mistake("input_2", "the table is over one quantity", "take out `input_2`"));
    }
    let mut at = Vec::new();
    for (key, wanted) in ["input", "input_2"].into_iter().zip(wanted) {
        at.push(wiring.needed(key, wanted)?.expr(wiring.graph));
    }
    let value = table.write_into(&mut wiring.graph.borrow_mut(), &at);
    wiring.answer(Traced::new(wiring.graph, value), table.dimension());
    Ok(())
}
