//! An open log, with its mapped channels.

use std::sync::Arc;

use super::channels::{Channel, Described, MappedChannel, channel_names, number, signals, wire_by_name};
use super::clocks::{Clock, clocks};
use super::recordings::table_of;
use super::settings::LogFile;
use crate::study::read::read_values::{quantity, read_word};
use kardan_math::units::Dimension;
use kardan_model::{Document, Model, TableReader};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_schema::schema::{Sign, Table};
use kardan_tables::read::{Bytes, CsvOptions, Log, LogError, open};

/// A log with its mapped channels.
pub(super) struct OpenLog {
    pub name: String,
    pub log: Box<dyn Log>,
    pub mapped: Vec<MappedChannel>,
    /// For each group.
    pub clocks: Vec<Option<Clock>>,
    pub offset: f64,
    pub options: CsvOptions,
    pub file: Arc<dyn Bytes>,
}

/// An error of a log, as a diagnostic.
pub(super) fn log_error(name: &str, error: &LogError) -> Vec<Diagnostic> {
    vec![Diagnostic::error("log::unreadable", format!("`{name}`: {error}"))]
}

/// Opens a log and finds its channels.
pub(super) fn open_log(
    document: &Document,
    model: &Model,
    file: &LogFile,
    out: &mut Vec<Diagnostic>,
) -> Option<OpenLog> {
    let (number, empty) = (table_of(document, &file.name), Table::default());
    let table = number.map_or(&empty, |number| &document.logs[number].1);
    let reader = TableReader::new(document, &[]);
    let options = csv_options(table, &reader, out);
    let log = match open(Arc::clone(&file.bytes), &options) {
        Ok(log) => log,
        Err(error) => {
            out.extend(log_error(&file.name, &error));
            return None;
        }
    };
    let before = out.len();
    let groups = log.groups().to_vec();
    let described = Described { table, file: &file.name, groups: &groups, reader: &reader };
    let mut mapped = Vec::new();
    for (k, table) in table.tables("channel").iter().enumerate() {
        let what = format!("channel {} of log `{}`", k + 1, number.map_or("", |number| &document.logs[number].0));
        mapped.extend(Channel { log: described, table, what: &what }.wire(model, out));
    }
    wire_by_name(described, model, &mut mapped, out);
    let clocks = clocks(described, &mapped, out);
    let offset = quantity(&reader, table, "time_offset", (Dimension::TIME, Sign::Any), "a log", out);
    if mapped.is_empty() && out.len() == before {
        let message = format!("no channel of `{}` matches a signal of the model", file.name);
        let notes = log.notes();
        out.push(Diagnostic::error("log::no-channel", message).help(format!(
            "map them in `[log.NAME]` (`kardan elements log`); the file has {}, the model {}{}{}",
            quoted(channel_names(&groups).into_iter().take(24)),
            quoted(signals(model).iter().map(String::as_str)),
            if notes.is_empty() { "" } else { "; remarks about the log: " },
            notes.join("; ")
        )));
    }
    (out.len() == before).then(|| OpenLog {
        name: file.name.clone(),
        log,
        mapped,
        clocks,
        offset: offset.map_or(0.0, |x| x.to_f64()),
        options,
        file: Arc::clone(&file.bytes),
    })
}

/// Settings to read a text as a table.
fn csv_options(table: &Table, reader: &TableReader<'_>, out: &mut Vec<Diagnostic>) -> CsvOptions {
    let mut row = |key: &str| number(table, key, reader, out).map(|x| x as usize);
    CsvOptions {
        delimiter: read_word(table, "delimiter").map(|text| match text {
            "tab" | "\\t" => b'\t',
            "space" => b' ',
            text => text.bytes().next().unwrap_or(b','),
        }),
        decimal_comma: read_word(table, "decimal").map(|word| word == "comma"),
        names_row: row("names_row"),
        units_row: row("units_row"),
        first_row: row("first_row"),
    }
}
