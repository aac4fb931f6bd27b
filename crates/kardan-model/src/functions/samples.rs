//! Points of a table: listed, or from a file.

use std::sync::Arc;

use crate::document::Document;
use crate::keys::key_diagnostic;
use kardan_elements::element::KeyError;
use kardan_elements::signal::{MOST_BREAKPOINTS, Samples};
use kardan_math::names::did_you_mean;
use kardan_math::units::{Dimension, Exact, header_unit};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::schema::{Table, Values};
use kardan_tables::read::{Block, CsvOptions, Group, Log, LogError, in_memory, open, unit_in_name};

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
    let bytes = file_of(document, table, file, what, out)?;
    match of_file(bytes, table, values) {
        Ok((samples, dimension)) => Some((Some(samples), Some(dimension))),
        Err(error) => {
            out.push(key_diagnostic("signal::file", what, in_file(file, error), (table, &table.place)));
            None
        }
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
    let error = match document.files.get(file) {
        Some(Ok(bytes)) => return Some(Arc::clone(bytes)),
        Some(Err(why)) => KeyError::new("file", why, "check its name: its path is relative to the folder of the model"),
        None => {
            let message = format!("the file `{}` was not provided", shortened(file));
            KeyError::new("file", message, "a program provides it by `Project::with_files`")
        }
    };
    out.push(key_diagnostic("signal::file", what, error, (table, &table.place)));
    None
}

/// An error in the content of a file.
pub(super) fn in_file(file: &str, error: KeyError) -> KeyError {
    KeyError { message: format!("`{}`: {}", shortened(file), error.message), ..error }
}

/// The error of a file that cannot be read as a log.
pub(super) fn unreadable(error: LogError) -> KeyError {
    KeyError::new("file", error.to_string(), "is it a table with a column of times and one of values?")
}

/// Hands the rows of chosen columns on, block by block; every row must be readable.
pub(super) fn read_rows(
    log: &mut dyn Log,
    chosen: &[(usize, usize)],
    remedy: &str,
    mut take: impl FnMut(&Block) -> Result<(), KeyError>,
) -> Result<(), KeyError> {
    log.choose(chosen).map_err(unreadable)?;
    let mut block = Block::default();
    while log.next(&mut block).map_err(unreadable)? {
        take(&block)?;
    }
    if !log.damage().is_empty() {
        let message = format!("not every row could be read: {}", log.notes().join("; "));
        return Err(KeyError::new("file", message, remedy));
    }
    Ok(())
}

/// The points in the chosen columns of a file, and the dimension of their values.
fn of_file(bytes: Arc<[u8]>, table: &Table, values: &Values) -> Result<(Samples, Dimension), KeyError> {
    let mut log = open(in_memory(bytes), &CsvOptions::default()).map_err(unreadable)?;
    let groups = log.groups().to_vec();
    let (group, column) = column(&groups, values.word("column"))?;
    let own = &groups[group];
    let time = match values.word("time") {
        Some(name) => own.channel(name).ok_or_else(|| unknown("time", name, own))?,
        None => own.time.ok_or_else(|| {
            let names = quoted(own.channels.iter().map(|channel| channel.name.as_str()).take(24));
            KeyError::new("file", "no column is named like a time", format!("name it by `time`; there are {names}"))
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
        return Err(KeyError::new("time_unit", message, "write a unit such as `time_unit = \"ms\"`"));
    }
    let unit = values.word("unit").unwrap_or(&own.channels[column].unit);
    let (of_value, dimension) = factor(unit, if table.values.contains_key("unit") { "unit" } else { "file" })?;
    let mut samples = Samples::default();
    let remedy = "every point needs a time and a value: correct or remove the row";
    read_rows(&mut *log, &[(group, time), (group, column)], remedy, |block| {
        let [times, values] = &block.columns[..] else { return Ok(()) };
        samples.times.extend(times.iter().map(|time| time * of_time.0));
        samples.values.extend(values.iter().map(|value| value * of_value));
        if samples.times.len() > MOST_BREAKPOINTS {
            let message = format!("more than {MOST_BREAKPOINTS} rows, each of which ends a step of the integrator");
            return Err(KeyError::new("file", message, "reduce the number of rows"));
        }
        Ok(())
    })?;
    Ok((samples, dimension))
}

/// Group and column of the values.
fn column(groups: &[Group], name: Option<&str>) -> Result<(usize, usize), KeyError> {
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
    Err(KeyError::new("file", format!("{} columns may be the values", candidates.len()), help))
}

pub(super) fn unknown(key: &'static str, name: &str, group: &Group) -> KeyError {
    let names = || group.channels.iter().map(|channel| channel.name.as_str());
    let help = did_you_mean(nearest(name, names()), || format!("there are {}", quoted(names().take(24))));
    KeyError::new(key, format!("there is no column `{}`", shortened(name)), help)
}

/// Of a reading in a unit to SI, and its dimension.
pub(super) fn factor(unit: &str, key: &'static str) -> Result<(f64, Dimension), KeyError> {
    match header_unit(unit) {
        Ok((factor, dimension)) => Ok((factor.to_f64(), dimension)),
        Err(_) => {
            let message = format!("the unit `{}` is not known", shortened(unit));
            let help = match key {
                "units" => "write a unit such as \"N m\" for each column, and \"1\" for a number without",
                _ => "give it by `unit = \"N m\"`, or `time_unit = \"ms\"` for the time",
            };
            Err(KeyError::new(key, message, help))
        }
    }
}
