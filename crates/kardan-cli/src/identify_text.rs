//! An identification as text for the terminal, in 100 columns.

use std::fmt::Write;

use kardan::results::Identification;
use kardan_report::words::identification as said;

use crate::layout::{heading, sentence, table};
use crate::summary::number;

/// More rows of a table are counted, not shown.
const ROWS: usize = 40;
/// More remarks on a log are counted, not shown.
const REMARKS: usize = 8;

/// Gives the parameters with their intervals, what cannot be told, tests, validation, models compared, logs, notes.
pub fn text(found: &Identification, origin: &str) -> String {
    let mut out = String::new();
    let name = if found.model.is_empty() { "identification" } else { &found.model };
    let _ = writeln!(out, "{name} ({origin})");
    sentence(&mut out, &found.verdict().1);
    for warning in &found.warnings {
        sentence(&mut out, &format!("WARNING: {warning}"));
    }
    for line in said::head(found, number) {
        sentence(&mut out, &line);
    }
    heading(&mut out, "Parameters");
    parameters(&mut out, found);
    let cannot: Vec<&String> = found.structural.iter().chain(&found.weak).collect();
    if !cannot.is_empty() {
        heading(&mut out, "What cannot be told");
        cannot.iter().for_each(|text| sentence(&mut out, text));
    }
    if let Some((matrix, passive)) = &found.damping {
        heading(&mut out, &format!("Reduced damping [{}]", matrix.unit));
        let mut headers = vec![""];
        let columns: Vec<String> = matrix.columns.iter().map(|name| format!("#{name}")).collect();
        headers.extend(columns.iter().map(String::as_str));
        let rows: Vec<Vec<String>> = matrix
            .rows
            .iter()
            .zip(&matrix.values)
            .map(|(name, values)| std::iter::once(name.clone()).chain(values.iter().map(|x| number(*x))).collect())
            .collect();
        table(&mut out, &headers, &rows, ROWS);
        sentence(&mut out, if *passive { "Passive as a whole." } else { "Not passive." });
    }
    if !found.tests.is_empty() {
        heading(&mut out, "What is left over");
        let rows: Vec<Vec<String>> = found.tests.iter().map(|test| said::test(test).to_vec()).collect();
        table(&mut out, &["should be", "#probability", "verdict"], &rows, ROWS);
    }
    if !found.validation.is_empty() {
        heading(&mut out, "Validation on segments that the fit has not seen [N m rms]");
        let rows: Vec<Vec<String>> =
            found.validation.iter().map(|one| said::validation(one, number).to_vec()).collect();
        table(&mut out, &["row", "#torque", "#residual, seen", "#unseen", "#fit, unseen"], &rows, ROWS);
    }
    if !found.candidates.is_empty() {
        heading(&mut out, "Models compared, errors on unseen segments in standard deviations of the sensors");
        let rows: Vec<Vec<String>> = found.candidates.iter().map(|one| said::candidate(one, number).to_vec()).collect();
        table(&mut out, &["model", "parameters", "#error", ""], &rows, ROWS);
    }
    heading(&mut out, "Logs");
    for log in found.logs.iter().take(ROWS) {
        sentence(&mut out, &said::log(log, number));
        log.remarks.iter().take(REMARKS).for_each(|remark| sentence(&mut out, &format!("  {remark}")));
        crate::layout::more(&mut out, log.remarks.len(), REMARKS);
    }
    crate::layout::more(&mut out, found.logs.len(), ROWS);
    // Channels of the same kind are told once.
    let mut rows: Vec<Vec<String>> = Vec::new();
    for row in found.logs.iter().flat_map(|log| said::channels(log, number)) {
        if rows.iter().all(|other| other[2] != row[2]) {
            rows.push(row.to_vec());
        }
    }
    if !rows.is_empty() {
        table(&mut out, &["channel", "unit", "signal", "#sample time", "#noise"], &rows, ROWS);
    }
    if !found.notes.is_empty() {
        heading(&mut out, "Notes");
        found.notes.iter().for_each(|text| sentence(&mut out, text));
    }
    out
}

fn parameters(out: &mut String, found: &Identification) {
    let published = found.parameters.iter().any(|one| one.published.is_some());
    let rows: Vec<Vec<String>> = found
        .parameters
        .iter()
        .map(|one| {
            let [name, unit, before, value, error, interval, elsewhere, _] = said::parameter(one, number);
            let mut row = vec![name, unit, before, value, error, interval];
            row.extend(published.then_some(elsewhere));
            row
        })
        .collect();
    let interval = format!("#{} % interval", number(100.0 * found.confidence));
    let mut headers = vec!["parameter", "unit", "#file", "#found", "#std. error", interval.as_str()];
    headers.extend(published.then_some("#published"));
    table(out, &headers, &rows, ROWS);
    for one in found.parameters.iter().filter(|one| !one.remark.is_empty()) {
        sentence(out, &format!("{}: {}", one.name, one.remark));
    }
}
