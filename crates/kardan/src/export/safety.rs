//! The table of faults as JSON and as a table of comma-separated values.

use super::printed::printed;
use kardan_results::{Safety, SafetyRow};
use kardan_tables::write::csv_cell;

/// The table of faults as one JSON object on one line, in SI.
///
/// Its keys are described by [`schema`](super::schema()) of `safety`.
///
/// ```
/// let text = kardan::export::safety_json(&kardan::results::Safety::default());
/// assert!(text.starts_with("{\"schema\":\"kardan/2\"") && text.contains("\"rows\":[]"));
/// ```
pub fn safety_json(table: &Safety) -> String {
    printed(table)
}

/// The same table with a line for each row, in SI.
///
/// ```
/// let text = kardan::export::safety_csv(&kardan::results::Safety::default());
/// assert_eq!(text.lines().next(), Some("faults,variant,begins [s],detected after [s],reaction,worst effect,verdict,note,command"));
/// ```
pub fn safety_csv(table: &Safety) -> String {
    let values = table.rows.first().map(|row| row.values.iter().map(|value| value.name.clone()).collect::<Vec<_>>());
    let values = values.unwrap_or_default();
    let effects = table.effects.iter().map(|effect| format!("{} [{}]", effect.name, effect.unit));
    let strings = |all: &[&str]| all.iter().map(ToString::to_string).collect::<Vec<_>>();
    let mut header = strings(&["faults", "variant"]);
    header.extend(values);
    header.extend(strings(&["begins [s]", "detected after [s]", "reaction"]));
    header.extend(effects);
    header.extend(strings(&["worst effect", "verdict", "note", "command"]));
    let mut out = line(&header);
    table.rows.iter().for_each(|row| out += &line(&cells(table, row)));
    out
}

fn cells(table: &Safety, row: &SafetyRow) -> Vec<String> {
    let number = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    let mut cells = vec![row.faults.join("+"), row.variant.clone()];
    cells.extend(row.values.iter().map(|value| value.value.clone()));
    cells.extend([number(row.fault_time), number(row.detection_time)]);
    let states: Vec<String> = row.reaction.iter().map(|one| format!("{} after {} s", one.state, one.after)).collect();
    cells.push(states.join("; "));
    cells.extend((0..table.effects.len()).map(|k| number(row.effects.get(k).and_then(|effect| effect.measured))));
    cells.push(row.worst.and_then(|k| table.effects.get(k)).map(|effect| effect.name.clone()).unwrap_or_default());
    cells.push(row.verdict.to_string());
    cells.extend([row.note.clone().unwrap_or_default(), row.command.clone()]);
    cells
}

/// A line of a table.
fn line(cells: &[String]) -> String {
    cells.iter().map(|cell| csv_cell(cell)).collect::<Vec<_>>().join(",") + "\n"
}
