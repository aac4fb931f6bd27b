//! Which channel of which log is which signal of the model.

use std::sync::Arc;

use super::LogFile;
use crate::diagnostics::{Diagnostic, nearest, quoted, shortened};
use crate::equations::{Measured, Term};
use crate::model::{Document, Model, TableReader};
use crate::schema::{Sign, Table, Value};
use crate::study::read::{quantity, read_scalar, read_word};
use crate::units::{Dimension, parse_quantity};
use kardan_tables::read::{CsvOptions, Group, Log, LogError, open};

/// A measured quantity.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Of a shaft.
    Angle(String),
    /// Of a shaft.
    Speed(String),
    /// Of an input.
    Torque(String),
}

impl Quantity {
    pub fn dimension(&self) -> Dimension {
        match self {
            Self::Angle(_) => Dimension::ANGLE,
            Self::Speed(_) => Dimension::ANGULAR_VELOCITY,
            Self::Torque(_) => Dimension::TORQUE,
        }
    }

    pub fn unit(&self) -> &'static str {
        match self {
            Self::Angle(_) => "rad",
            Self::Speed(_) => "rad/s",
            Self::Torque(_) => "N m",
        }
    }

    pub fn signal(&self) -> String {
        match self {
            Self::Angle(shaft) => format!("{shaft}.phi"),
            Self::Speed(shaft) => format!("{shaft}.w"),
            Self::Torque(input) => format!("{input}.tau"),
        }
    }
}

/// A channel that is read.
#[derive(Debug, Clone)]
pub(super) struct Wired {
    pub group: usize,
    pub channel: usize,
    pub quantity: Quantity,
    /// Of a reading to SI.
    pub factor: f64,
    /// First samples whose mean is subtracted.
    pub zero_samples: usize,
    /// Stated standard deviation of a sample, SI.
    pub noise: Option<f64>,
}

/// How the time of a group is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Clock {
    /// A channel, by a factor to s.
    Channel(usize, f64),
    /// Time between rows, s.
    Step(f64),
}

/// A log with what is read of it.
pub(super) struct OpenLog {
    pub name: String,
    pub log: Box<dyn Log>,
    pub wired: Vec<Wired>,
    /// For each group.
    pub clocks: Vec<Option<Clock>>,
    pub offset: f64,
    pub options: CsvOptions,
    pub file: Arc<dyn kardan_tables::read::Bytes>,
}

/// The quantity that a signal means, and the step of its sensor (rad), if it has one.
pub(super) fn quantity_of(signal: &str, model: &Model) -> Option<(Quantity, Option<f64>)> {
    let (head, tail) = signal.split_once('.').unwrap_or((signal, ""));
    if model.shafts.iter().any(|shaft| shaft == head) {
        let shaft = head.to_string();
        match tail {
            "phi" => return Some((Quantity::Angle(shaft), None)),
            "w" => return Some((Quantity::Speed(shaft), None)),
            _ => {}
        }
    }
    model.terms.iter().filter(|named| named.element == head).find_map(|named| match &named.term {
        Term::Input { .. } if tail == "tau" => Some((Quantity::Torque(head.to_string()), None)),
        Term::Output(sensor) => match &sensor.measured {
            Measured::Angle(shaft) if matches!(tail, "" | "phi") => {
                Some((Quantity::Angle(shaft.clone()), sensor.resolution))
            }
            Measured::Speed(shaft) if matches!(tail, "" | "w") => Some((Quantity::Speed(shaft.clone()), None)),
            _ => None,
        },
        _ => None,
    })
}

/// All signals that a channel may be.
pub(super) fn signals(model: &Model) -> Vec<String> {
    let shafts = model.shafts.iter().flat_map(|shaft| [format!("{shaft}.phi"), format!("{shaft}.w")]);
    let inputs = model.terms.iter().filter_map(|named| match named.term {
        Term::Input { .. } => Some(format!("{}.tau", named.element)),
        _ => None,
    });
    shafts.chain(inputs).collect()
}

/// Whether a file name fits a pattern with `*` and `?`.
pub(super) fn fits(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    // reach[k]: the pattern so far fits the first k characters.
    let mut reach = vec![false; name.len() + 1];
    reach[0] = true;
    for &p in &pattern {
        if p == '*' {
            for k in 1..reach.len() {
                reach[k] |= reach[k - 1];
            }
        } else {
            for k in (1..reach.len()).rev() {
                reach[k] = reach[k - 1] && (p == '?' || p == name[k - 1]);
            }
            reach[0] = false;
        }
    }
    reach[name.len()]
}

fn base(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

/// The table that describes a file: the first that fits.
fn table_of<'a>(document: &'a Document, name: &str) -> Option<(usize, &'a Table)> {
    document.logs.iter().enumerate().map(|(k, (_, table))| (k, table)).find(|(_, table)| {
        read_word(table, "file").is_none_or(|pattern| fits(pattern, base(name)) || fits(pattern, name))
    })
}

/// What went wrong with a log, as a diagnostic.
pub(super) fn log_error(name: &str, error: &LogError) -> Diagnostic {
    Diagnostic::error("log::unreadable", format!("`{name}`: {error}"))
}

/// The files in groups that were recorded together: one of each `[log.NAME]` table, in the order given.
pub(super) fn recordings(document: &Document, files: Vec<LogFile>) -> Result<Vec<Vec<LogFile>>, Vec<Diagnostic>> {
    let tables = document.logs.len();
    if tables < 2 {
        return Ok(files.into_iter().map(|file| vec![file]).collect());
    }
    let mut of_table: Vec<Vec<LogFile>> = (0..tables).map(|_| Vec::new()).collect();
    let mut out = Vec::new();
    for file in files {
        match table_of(document, &file.name) {
            Some((k, _)) => of_table[k].push(file),
            None => {
                let patterns = document.logs.iter().filter_map(|(_, table)| read_word(table, "file"));
                out.push(
                    Diagnostic::error("log::no-table", format!("no `[log.NAME]` describes `{}`", file.name))
                        .help(format!("their files are {}", quoted(patterns))),
                );
            }
        }
    }
    let used: Vec<usize> = (0..tables).filter(|&k| !of_table[k].is_empty()).collect();
    let count = used.first().map_or(0, |&k| of_table[k].len());
    if used.iter().any(|&k| of_table[k].len() != count) {
        let each: Vec<String> =
            used.iter().map(|&k| format!("{} of `{}`", of_table[k].len(), document.logs[k].0)).collect();
        let message = format!("files of several `[log.NAME]` are joined by time, but there are {}", each.join(", "));
        out.push(Diagnostic::error("log::unpaired", message).help("give as many of each, in the same order"));
    }
    if !out.is_empty() {
        return Err(out);
    }
    let mut rows: Vec<Vec<LogFile>> = (0..count).map(|_| Vec::new()).collect();
    for list in of_table {
        for (row, file) in rows.iter_mut().zip(list) {
            row.push(file);
        }
    }
    Ok(rows)
}

fn number(table: &Table, key: &str, reader: &TableReader<'_>, out: &mut Vec<Diagnostic>) -> Option<f64> {
    quantity(reader, table, key, (Dimension::NONE, Sign::Any), "a log", out).map(|x| x.to_f64())
}

/// Opens a log and finds its channels.
pub(super) fn open_log(
    document: &Document,
    model: &Model,
    file: &LogFile,
    out: &mut Vec<Diagnostic>,
) -> Option<OpenLog> {
    let found = table_of(document, &file.name);
    let empty = Table::default();
    let table = found.map_or(&empty, |(_, table)| table);
    let reader = TableReader::new(document, &[]);
    let row = |key: &str, out: &mut Vec<Diagnostic>| number(table, key, &reader, out).map(|x| x as usize);
    let delimiter = read_word(table, "delimiter").map(|text| match text {
        "tab" | "\\t" => b'\t',
        "space" => b' ',
        text => text.bytes().next().unwrap_or(b','),
    });
    let options = CsvOptions {
        delimiter,
        decimal_comma: read_word(table, "decimal").map(|word| word == "comma"),
        names_row: row("names_row", out),
        units_row: row("units_row", out),
        first_row: row("first_row", out),
    };
    let log = match open(Arc::clone(&file.bytes), &options) {
        Ok(log) => log,
        Err(error) => {
            out.push(log_error(&file.name, &error));
            return None;
        }
    };
    let before = out.len();
    let groups = log.groups().to_vec();
    let mut wired = Vec::new();
    if let Some(Value::Tables(channels)) = table.values.get("channel").map(|given| &given.value) {
        for (k, channel) in channels.iter().enumerate() {
            let what = format!("channel {} of log `{}`", k + 1, document.logs[found.map_or(0, |(k, _)| k)].0);
            wired.extend(wire(document, model, &groups, &file.name, channel, &what, out));
        }
    }
    // Columns that are called like a signal.
    for (group, own) in groups.iter().enumerate() {
        for (channel, named) in own.channels.iter().enumerate() {
            // In MAT files names cannot have points: wg_motor_tau.
            let pointed = named.name.rsplit_once('_').map(|(head, tail)| format!("{head}.{tail}"));
            let known = quantity_of(&named.name, model).or_else(|| quantity_of(&pointed?, model));
            let Some((quantity, _)) = known else { continue };
            if wired.iter().any(|other: &Wired| other.quantity == quantity) {
                continue;
            }
            match unit_factor(&named.unit, &quantity) {
                Ok(factor) => {
                    wired.push(Wired { group, channel, quantity, factor, zero_samples: 0, noise: None });
                }
                Err(why) => out.push(
                    Diagnostic::error(
                        "unit::dimension",
                        format!("`{}`, channel `{}`: {why}", file.name, shortened(&named.name)),
                    )
                    .help("say what it is in `[[log.NAME.channel]]` with `signal`, `column` and `unit`"),
                ),
            }
        }
    }
    let clocks = clocks(table, &groups, &wired, &file.name, &reader, out);
    let offset = quantity(&reader, table, "time_offset", (Dimension::TIME, Sign::Any), "a log", out);
    if wired.is_empty() && out.len() == before {
        let names = groups.iter().flat_map(|group| group.channels.iter().map(|channel| channel.name.as_str()));
        let names: Vec<&str> = names.take(24).collect();
        let message = format!("no channel of `{}` is known to the model", file.name);
        let notes = log.notes();
        out.push(Diagnostic::error("log::no-channel", message).help(format!(
            "say which is which in `[log.NAME]` (`kardan elements log`); the file has {}, the model {}{}{}",
            quoted(names.into_iter()),
            quoted(signals(model).iter().map(String::as_str)),
            if notes.is_empty() { "" } else { "; and see what the log says: " },
            notes.join("; ")
        )));
    }
    (out.len() == before).then(|| OpenLog {
        name: file.name.clone(),
        log,
        wired,
        clocks,
        offset: offset.map_or(0.0, |x| x.to_f64()),
        options,
        file: Arc::clone(&file.bytes),
    })
}

/// Of a reading in a unit to SI.
fn unit_factor(unit: &str, quantity: &Quantity) -> Result<f64, String> {
    let unit = unit.trim();
    if matches!(unit, "" | "-" | "1") {
        return Ok(1.0);
    }
    match parse_quantity(&format!("1 {unit}")) {
        Ok((factor, dimension)) if dimension == quantity.dimension() => Ok(factor.to_f64()),
        Ok((_, dimension)) => Err(format!(
            "`{}` is {}, but the unit `{unit}` is that of {}",
            quantity.signal(),
            quantity.dimension().noun(),
            dimension.noun()
        )),
        Err(_) => Err(format!("the unit `{}` is not known", shortened(unit))),
    }
}

/// The channel of a file that a name or number means.
fn find(groups: &[Group], name: Option<&str>, number: Option<usize>) -> Option<(usize, usize)> {
    if let Some(number) = number {
        let mut before = 0;
        for (group, own) in groups.iter().enumerate() {
            if number <= before + own.channels.len() {
                return number.checked_sub(before + 1).map(|channel| (group, channel));
            }
            before += own.channels.len();
        }
        return None;
    }
    let name = name?;
    let place = |same: &dyn Fn(&str) -> bool| {
        groups.iter().enumerate().find_map(|(group, own)| {
            own.channels.iter().position(|channel| same(&channel.name)).map(|channel| (group, channel))
        })
    };
    let known = groups.iter().enumerate().find_map(|(group, own)| own.channel(name).map(|channel| (group, channel)));
    known.or_else(|| place(&|other| other.trim().eq_ignore_ascii_case(name.trim())))
}

fn wire(
    document: &Document,
    model: &Model,
    groups: &[Group],
    file: &str,
    table: &Table,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Wired> {
    let reader = TableReader::new(document, &[]);
    let place = |key: &str| TableReader::place(table, key);
    let signal = read_word(table, "signal")?;
    let Some((quantity, _)) = quantity_of(signal, model) else {
        let all = signals(model);
        let help = match nearest(signal, all.iter().map(String::as_str)) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("there are {}", quoted(all.iter().map(String::as_str))),
        };
        let message = format!("{what}: `{}` is no measured angle, speed or torque of an input", shortened(signal));
        out.push(Diagnostic::error("name::unknown", message).at(place("signal"), "no such signal").help(help));
        return None;
    };
    let name = read_word(table, "column");
    let number = number(table, "number", &reader, out).map(|x| x as usize);
    if name.is_none() && number.is_none() {
        let message = format!("{what} says neither `column` nor `number`");
        out.push(
            Diagnostic::error("key::missing", message)
                .at(table.place.clone(), "which column?")
                .help("add `column = \"...\"` with its name in the file, or `number = 2`"),
        );
        return None;
    }
    let Some((group, channel)) = find(groups, name, number) else {
        let all: Vec<&str> =
            groups.iter().flat_map(|group| group.channels.iter().map(|channel| channel.name.as_str())).collect();
        let help = match name.and_then(|name| nearest(name, all.iter().copied())) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("the file has {} columns: {}", all.len(), quoted(all.iter().copied().take(24))),
        };
        let asked = name.map_or_else(|| format!("number {}", number.unwrap_or(0)), |name| format!("`{name}`"));
        let key = if name.is_some() { "column" } else { "number" };
        let message = format!("{what}: `{file}` has no column {asked}");
        out.push(Diagnostic::error("log::no-column", message).at(place(key), "not in the file").help(help));
        return None;
    };
    let in_file = groups[group].channels[channel].unit.clone();
    let quantity_in = |key: &str, out: &mut Vec<Diagnostic>| -> Option<f64> {
        let scalar = read_scalar(table, key)?;
        let (value, dimension) = reader.scalar(&scalar, None, &format!("`{key}` of {what}"), out)?;
        if dimension != quantity.dimension() {
            let message =
                format!("`{key}` of {what}: expected {}, found {}", quantity.dimension().noun(), dimension.noun());
            out.push(
                Diagnostic::error("unit::dimension", message)
                    .at(place(key), dimension.noun())
                    .help(format!("write a unit such as {}", quantity.dimension().example())),
            );
            return None;
        }
        Some(value.to_f64())
    };
    let scale = quantity_in("scale", out);
    let noise = quantity_in("noise", out);
    let unit = read_word(table, "unit").map(str::to_string);
    let by_unit = match (&scale, &unit) {
        (Some(scale), _) => *scale,
        (None, unit) => match unit_factor(unit.as_deref().unwrap_or(&in_file), &quantity) {
            Ok(factor) => factor,
            Err(why) => {
                let key = if unit.is_some() { "unit" } else { "signal" };
                out.push(
                    Diagnostic::error("unit::dimension", format!("{what}: {why}")).at(place(key), "this unit").help(
                        "say it with `unit = \"...\"`, or what one unit of a reading is with `scale = \"200 N m\"`",
                    ),
                );
                return None;
            }
        },
    };
    let factor = self::number(table, "factor", &reader, out).unwrap_or(1.0) * by_unit;
    let zero_samples = self::number(table, "zero_samples", &reader, out).unwrap_or(0.0) as usize;
    Some(Wired { group, channel, quantity, factor, zero_samples, noise })
}

/// How the time of each group that is read is known.
fn clocks(
    table: &Table,
    groups: &[Group],
    wired: &[Wired],
    file: &str,
    reader: &TableReader<'_>,
    out: &mut Vec<Diagnostic>,
) -> Vec<Option<Clock>> {
    let step = quantity(reader, table, "sample_time", (Dimension::TIME, Sign::Positive), "a log", out);
    let step = step.map(|x| Clock::Step(x.to_f64()));
    let named = read_word(table, "time");
    if let Some(name) = named.filter(|name| find(groups, Some(name), None).is_none()) {
        let all: Vec<&str> = groups.iter().flat_map(|g| g.channels.iter().map(|c| c.name.as_str())).collect();
        let help = match nearest(name, all.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("the file has {}", quoted(all.into_iter().take(24))),
        };
        out.push(
            Diagnostic::error("log::no-column", format!("`time` of a log: `{file}` has no column `{name}`"))
                .at(TableReader::place(table, "time"), "not in the file")
                .help(help),
        );
        return Vec::new();
    }
    let mut wrong = Vec::new();
    let clocks = groups
        .iter()
        .enumerate()
        .map(|(number, group)| {
            if !wired.iter().any(|one| one.group == number) {
                return None;
            }
            let usual = |channel: &kardan_tables::read::Channel| {
                matches!(
                    channel.name.trim().to_lowercase().as_str(),
                    "time" | "t" | "timestamp" | "time [s]" | "time (s)"
                )
            };
            let own = named.and_then(|name| find(std::slice::from_ref(group), Some(name), None)).map(|found| found.1);
            let found = own.or(group.time);
            let found = found.or_else(|| group.channels.iter().position(usual));
            let Some(channel) = found else {
                if step.is_none() {
                    wrong.push(number);
                }
                return step;
            };
            let written = group.channels[channel].unit.trim();
            let unit = match (written, kardan_tables::read::unit_in_name(&group.channels[channel].name)) {
                ("", Some(unit)) => unit,
                (unit, _) => unit,
            };
            let unit = read_word(table, "time_unit").unwrap_or(unit).trim().to_string();
            let factor = match unit.as_str() {
                "" | "-" | "1" => Some(1.0),
                unit => match parse_quantity(&format!("1 {unit}")) {
                    Ok((factor, Dimension::TIME)) => Some(factor.to_f64()),
                    _ => None,
                },
            };
            if factor.is_none() {
                let message = format!("`{file}`: the unit `{}` of its time is none of a time", shortened(&unit));
                let place = TableReader::place(table, "time_unit");
                out.push(
                    Diagnostic::error("unit::dimension", message)
                        .at(place, "this log")
                        .help("say it in `[log.NAME]` with `time_unit = \"ms\"`"),
                );
            }
            Some(Clock::Channel(channel, factor.unwrap_or(1.0)))
        })
        .collect();
    for number in wrong {
        let group = &groups[number];
        let names = group.channels.iter().map(|channel| channel.name.as_str()).take(24);
        out.push(Diagnostic::error("log::no-time", format!("`{file}`: nobody knows which column is the time")).help(
            format!("name it in `[log.NAME]` with `time = \"...\"`, one of {}, or give `sample_time`", quoted(names)),
        ));
    }
    clocks
}

#[cfg(test)]
mod tests {
    use super::fits;

    #[test]
    fn patterns_of_files() {
        for (pattern, name) in [("*.csv", "a.csv"), ("*", ""), ("a?c*", "abcd"), ("*MR.csv", "a3MR.csv"), ("", "")] {
            assert!(fits(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [("*.csv", "a.csv2"), ("?", ""), ("a", "b"), ("*a", "ab")] {
            assert!(!fits(pattern, name), "{pattern} {name}");
        }
    }
}
