//! The table of faults as a page.

use crate::groups::grouped;
use crate::model::{Body, Cell, Page, row, warnings};
use crate::text::{figure, number};
use kardan_results::{EffectMeasured, MonitorOutcome, Safety, SafetyEffect, SafetyRow, StateEntered, Verdict};

/// Digits of an effect.
const DIGITS: usize = 3;
/// The text for a fault in a run without one.
const NO_FAULT: &str = "none";

/// The page of a table.
pub fn page(table: &Safety) -> Page {
    Page {
        name: format!("Faults: {}", table.model),
        description: table.description.clone(),
        verdict: Some(verdict(table)),
        alerts: warnings(&table.warnings),
        sections: Page::sections([
            ("faults", "Faults and their effects", rows(table)),
            ("effects", "Unwanted effects", effects(table)),
            ("monitors", "Monitors", monitors(table)),
            ("notes", "Notes", Body::default().list(table.notes.iter().cloned())),
            ("again", "Commands that rerun each row", commands(table)),
        ]),
        ..Page::default()
    }
}

fn verdict(table: &Safety) -> Verdict {
    let failing = table.failing().count();
    let all = table.rows.len();
    let early = match table.missing {
        0 => String::new(),
        missing => format!("; {missing} rows were not computed"),
    };
    let text = match failing {
        0 => format!("All {all} fault cases are within limits{early}."),
        one => format!("{one} of {all} rows: {}{early}.", kinds(table)),
    };
    Verdict { sound: table.passes(), text }
}

/// The verdicts that do not pass, with their numbers.
fn kinds(table: &Safety) -> String {
    let found = grouped(table.failing().map(|row| (row.verdict, row)));
    let counts: Vec<String> = found.iter().map(|(verdict, rows)| format!("{} {verdict}", rows.len())).collect();
    counts.join(", ")
}

/// A row for each of these, with its faults, its variant if there are several, and its values before further columns; titles and cells.
fn listed<'a>(
    table: &'a Safety,
    rows: impl Iterator<Item = &'a SafetyRow>,
    further: impl IntoIterator<Item = String>,
    cells: impl Fn(&SafetyRow) -> Vec<Cell>,
) -> (Vec<String>, Vec<Vec<Cell>>) {
    let several = table.rows.iter().any(|row| row.variant != table.rows[0].variant);
    let mut titles = vec!["fault".to_string()];
    titles.extend(several.then(|| "variant".to_string()));
    titles.extend(table.rows.first().into_iter().flat_map(|row| &row.values).map(|value| value.name.clone()));
    titles.extend(further);
    let rows = rows.map(|row| {
        let mut all = row![if row.faults.is_empty() { NO_FAULT.to_string() } else { row.faults.join(" + ") }];
        all.extend(several.then(|| Cell::from(&row.variant)));
        all.extend(row.values.iter().map(|value| Cell::Text(prevent_line_breaks(&value.value))));
        all.extend(cells(row));
        all.resize(titles.len(), Cell::Text(String::new()));
        all
    });
    let rows = rows.collect();
    (titles, rows)
}

fn rows(table: &Safety) -> Body {
    let noted = table.rows.iter().any(|row| row.note.is_some());
    let further = ["#detected after ms", "reaction", "worst effect", "bound", "verdict"].into_iter();
    let further = further.chain(noted.then_some("note")).map(String::from);
    let (columns, rows) = listed(table, table.rows.iter(), further, |one| {
        let after = one.detection_time.filter(|_| !one.faults.is_empty());
        let shown = match (after, one.detection_time) {
            (Some(after), _) => number(1e3 * after),
            (None, Some(at)) => format!("at {} s", number(at)),
            (None, None) => String::new(),
        };
        let entered = |state: &StateEntered| format!("{} {}\u{a0}ms", state.state, number(1e3 * state.after));
        let states: Vec<String> = one.reaction.iter().map(entered).collect();
        let worst = one.worst.and_then(|k| Some((table.effects.get(k)?, one.effects.get(k)?)));
        let (effect, bound) =
            worst.map_or_else(Default::default, |(effect, found)| (shown_of(effect, found), bound(effect)));
        let verdict = Cell::Mark(one.verdict.passes(), one.verdict.to_string());
        let mut cells = row![shown, states.join(", "), effect, bound, verdict];
        cells.extend(noted.then(|| Cell::Text(one.note.clone().unwrap_or_default())));
        cells
    });
    let detected = table.detected.as_ref().map_or_else(String::new, |condition| {
        let limit_text =
            table.detection_time_limit.map_or_else(String::new, |time| format!(", within {} ms", number(1e3 * time)));
        format!("Detected: `{condition}` first becomes true where it is false without the fault{limit_text}.")
    });
    Body::default().table_of(usize::MAX, &columns, rows).hint(detected)
}

/// A measured effect, in the unit of its bounds.
fn shown_of(effect: &SafetyEffect, found: &EffectMeasured) -> String {
    let Some(value) = found.measured else { return format!("{}: none", effect.name) };
    format!("{} {}", effect.name, in_unit(value, effect))
}

fn in_unit(value: f64, effect: &SafetyEffect) -> String {
    let (value, unit) = match &effect.display {
        Some(display) => (display.of(value), &display.unit),
        None => (value, &effect.unit),
    };
    prevent_line_breaks(&format!("{} {unit}", figure(value, DIGITS)))
}

/// Text without line breaks.
fn prevent_line_breaks(text: &str) -> String {
    text.replace(' ', "\u{a0}")
}

fn bound(effect: &SafetyEffect) -> String {
    let below = effect.below.map(|bound| format!("<\u{a0}{}", in_unit(bound, effect)));
    let above = effect.above.map(|bound| format!(">\u{a0}{}", in_unit(bound, effect)));
    above.into_iter().chain(below).collect::<Vec<_>>().join(", ")
}

fn effects(table: &Safety) -> Body {
    let definitions = table.effects.iter().map(|effect| row![&effect.name, &effect.text, bound(effect)]);
    let definitions = Body::default().table_of(usize::MAX, &["effect", "what is measured", "bound"], definitions);
    if table.effects.len() < 2 {
        return definitions;
    }
    let faulty = table.rows.iter().filter(|row| !row.faults.is_empty());
    let names = table.effects.iter().map(|effect| effect.name.clone());
    let (columns, rows) = listed(table, faulty, names, |one| {
        let cell = |(effect, found): (&SafetyEffect, &EffectMeasured)| {
            let shown = found.measured.map_or_else(|| "none".to_string(), |value| in_unit(value, effect));
            match found.within_bounds {
                Some(satisfied) => Cell::Mark(satisfied, shown),
                None => Cell::Text(shown),
            }
        };
        table.effects.iter().zip(&one.effects).map(cell).collect()
    });
    let all = Body::default().table(&columns, rows);
    definitions.fold("All effects of all rows", all)
}

fn monitors(table: &Safety) -> Body {
    let list = |names: &[String], none: &str| if names.is_empty() { none.to_string() } else { names.join(", ") };
    let row =
        |one: &MonitorOutcome| row![&one.name, list(&one.raised_by, "nothing"), list(&one.false_alarms, "nowhere")];
    Body::default().table(&["monitor", "raised by", "raised without a fault in"], table.monitors.iter().map(row))
}

fn commands(table: &Safety) -> Body {
    let command = |one: &SafetyRow| vec![Cell::Verbatim(one.command.clone())];
    let (columns, rows) = listed(table, table.rows.iter(), ["command".to_string()], command);
    let hint = "A simulation of the faults that the file names, as a basis for a failure analysis. Mapping it to the \
                 standards of a project, such as ISO 26262 and ISO 19725, decides its value there.";
    Body::default().table(&columns, rows).hint(hint)
}
