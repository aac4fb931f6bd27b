//! Points of a table: listed, or from a file.

use std::sync::Arc;

use crate::document::Document;
use crate::table_reader::TableReader;
use kardan_elements::signal::{MOST_BREAKPOINTS, Samples};
use kardan_math::names::did_you_mean;
use kardan_math::units::{Dimension, Exact, header_unit};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::schema::{Table, Values};
use kardan_tables::read::{Block, CsvOptions, Group, LogError, in_memory, open, unit_in_name};

/// The points of a table, and the dimensions of those of a file; `None` after a reported error.
pub(super) fn samples(
    document: &Document,
    table: &Table,
    values: &Values,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<(Option<Samples>, Option<Dimension>)> {
    let Some(file) = values.word("file") else {
        let points = values.map("points").unwrap_or_default();
        let of = |name: &str| {
            points.iter().filter(|(candidate, _)| candidate == name).map(|(_, x)| Exact::to_f64(x)).collect()
        };
        return Some((Some(Samples { times: of("time"), values: of("value") }), None));
    };
    let shown = shortened(file);
    let bytes = file_of(document, table, file, what, out)?;
    match of_file(bytes, table, values) {
        Ok((samples, dimension)) => Some((Some(samples), Some(dimension))),
        Err(Refusal { key, message, help }) => report(table, key, format!("{what}: `{shown}`: {message}"), &help, out),
    }
}

/// The content of the file named by the key `file` of a table; `None` if it is unavailable, which is reported.
pub(super) fn file_of(
    document: &Document,
    table: &Table,
    file: &str,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Arc<[u8]>> {
    let help = "check its name: its path is relative to the folder of the model";
    match document.files.get(file) {
        Some(Ok(bytes)) => Some(Arc::clone(bytes)),
        Some(Err(why)) => report(table, "file", format!("{what}: {why}"), help, out),
        None => {
            let message = format!("{what}: the file `{}` was not provided", shortened(file));
            report(table, "file", message, "a program provides it by `Project::with_files`", out)
        }
    }
}

fn report<T>(table: &Table, key: &str, message: String, help: &str, out: &mut Vec<Diagnostic>) -> Option<T> {
    out.push(Diagnostic::error("signal::file", message).at(TableReader::place(table, key), "").help(help));
    None
}

pub(super) struct Refusal {
    pub(super) key: &'static str,
    pub(super) message: String,
    pub(super) help: String,
}

pub(super) fn refusal(key: &'static str, message: impl Into<String>, help: impl Into<String>) -> Refusal {
    Refusal { key, message: message.into(), help: help.into() }
}

impl From<LogError> for Refusal {
    fn from(error: LogError) -> Self {
        refusal("file", error.to_string(), "is it a table with a column of times and one of values?")
    }
}

/// The points in the chosen columns of a file, and the dimension of their values.
fn of_file(bytes: Arc<[u8]>, table: &Table, values: &Values) -> Result<(Samples, Dimension), Refusal> {
    let mut log = open(in_memory(bytes), &CsvOptions::default())?;
    let groups = log.groups().to_vec();
    let (group, column) = column(&groups, values.word("column"))?;
    let own = &groups[group];
    let time = match values.word("time") {
        Some(name) => own.channel(name).ok_or_else(|| unknown("time", name, own))?,
        None => own.time.ok_or_else(|| {
            let names = quoted(own.channels.iter().map(|channel| channel.name.as_str()).take(24));
            refusal("file", "no column is named like a time", format!("name it by `time`; there are {names}"))
        })?,
    };
    let channel = &own.channels[time];
    let unit = match values.word("time_unit") {
        Some(unit) => unit,
        None if channel.unit.trim().is_empty() => unit_in_name(&channel.name).unwrap_or("s"),
        None => &channel.unit,
    };
    let of_time = factor(unit, "time_unit")?;
    if of_time.1 != Dimension::TIME {
        let message = format!("the unit `{}` is that of {}, not of a time", shortened(unit), of_time.1.noun());
        return Err(refusal("time_unit", message, "write a unit such as `time_unit = \"ms\"`"));
    }
    let unit = values.word("unit").unwrap_or(&own.channels[column].unit);
    let (of_value, dimension) = factor(unit, if table.values.contains_key("unit") { "unit" } else { "file" })?;
    log.choose(&[(group, time), (group, column)])?;
    let (mut block, mut samples) = (Block::default(), Samples::default());
    while log.next(&mut block)? {
        let [times, values] = &block.columns[..] else { continue };
        samples.times.extend(times.iter().map(|time| time * of_time.0));
        samples.values.extend(values.iter().map(|value| value * of_value));
        if samples.times.len() > MOST_BREAKPOINTS {
            let message = format!("more than {MOST_BREAKPOINTS} rows, each of which ends a step of the integrator");
            return Err(refusal("file", message, "reduce the number of rows"));
        }
    }
    if !log.damage().is_empty() {
        let message = format!("not every row could be read: {}", log.notes().join("; "));
        return Err(refusal("file", message, "every point needs a time and a value: correct or remove the row"));
    }
    Ok((samples, dimension))
}

/// Group and column of the values.
fn column(groups: &[Group], name: Option<&str>) -> Result<(usize, usize), Refusal> {
    if let Some(name) = name {
        let found = groups.iter().enumerate().find_map(|(k, group)| Some((k, group.channel(name)?)));
        return found.ok_or_else(|| {
            let all = Group {
                channels: groups.iter().flat_map(|group| group.channels.clone()).collect(),
                ..Group::default()
            };
            unknown("column", name, &all)
        });
    }
    let candidates = groups.iter().enumerate().flat_map(|(k, group)| {
        (0..group.channels.len()).filter(|column| group.time != Some(*column)).map(move |column| (k, column))
    });
    let candidates: Vec<(usize, usize)> = candidates.collect();
    if let [only] = candidates[..] {
        return Ok(only);
    }
    let names = candidates.iter().map(|(group, column)| groups[*group].channels[*column].name.as_str());
    let help = format!("name one by `column`; there are {}", quoted(names.take(24)));
    Err(refusal("file", format!("{} columns may be the values", candidates.len()), help))
}

pub(super) fn unknown(key: &'static str, name: &str, group: &Group) -> Refusal {
    let names = || group.channels.iter().map(|channel| channel.name.as_str());
    let help = did_you_mean(nearest(name, names()), || format!("there are {}", quoted(names().take(24))));
    refusal(key, format!("there is no column `{}`", shortened(name)), help)
}

/// Of a reading in a unit to SI, and its dimension.
pub(super) fn factor(unit: &str, key: &'static str) -> Result<(f64, Dimension), Refusal> {
    match header_unit(unit) {
        Ok((factor, dimension)) => Ok((factor.to_f64(), dimension)),
        Err(_) => {
            let message = format!("the unit `{}` is not known", shortened(unit));
            let help = match key {
                "units" => "write a unit such as \"N m\" for each column, and \"1\" for a number without",
                _ => "give it by `unit = \"N m\"`, or `time_unit = \"ms\"` for the time",
            };
            Err(refusal(key, message, help))
        }
    }
}
