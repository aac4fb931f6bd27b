//! Time source of each group of a log.

use super::channels::{Described, MappedChannel, channel_names, find};
use crate::study::read::read_values::{key_error, quantity, read_word};
use kardan_math::names::did_you_mean;
use kardan_math::units::{Dimension, Exact, header_unit};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::schema::Sign;
use kardan_tables::read::{Group, unit_in_name};

/// Time source of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Clock {
    /// A channel, by a factor to s.
    Channel(usize, f64),
    /// Time between rows, s.
    Step(f64),
}

/// Usual names of a time column.
const USUAL: [&str; 5] = ["time", "t", "timestamp", "time [s]", "time (s)"];

/// The clock of each group read.
pub(super) fn clocks(
    log: Described<'_, '_>,
    mapped: &[MappedChannel],
    out: &mut Vec<Diagnostic>,
) -> Vec<Option<Clock>> {
    let Described { table, file, groups, reader } = log;
    let step = quantity(reader, table, "sample_time", (Dimension::TIME, Sign::Positive), "a log", out);
    let step = step.map(|x| Clock::Step(x.to_f64()));
    let named = read_word(table, "time");
    if let Some(name) = named.filter(|name| find(groups, Some(name), None).is_none()) {
        let all = channel_names(groups);
        let columns = || format!("the file has {}", quoted(all.iter().copied().take(24)));
        let help = did_you_mean(nearest(name, all.iter().copied()), columns);
        let message = format!("`time` of a log: `{file}` has no column `{name}`");
        out.push(key_error("log::no-column", message, (table, "time", "not in the file"), help));
        return Vec::new();
    }
    let mut timeless = Vec::new();
    let clock = |(number, group): (usize, &Group)| {
        if !mapped.iter().any(|one| one.group == number) {
            return None;
        }
        let clock = time_channel(group, named)
            .map(|channel| Clock::Channel(channel, time_factor(log, &group.channels[channel], out)))
            .or(step);
        if clock.is_none() {
            timeless.push(number);
        }
        clock
    };
    let clocks = groups.iter().enumerate().map(clock).collect();
    out.extend(timeless.into_iter().map(|number| no_time(log, number, named)));
    clocks
}

/// The message for a group without time: if another group has a time, that their channels differ in length.
fn no_time(Described { file, groups, .. }: Described<'_, '_>, number: usize, named: Option<&str>) -> Diagnostic {
    let own = &groups[number];
    let names = || quoted(own.channels.iter().map(|channel| channel.name.as_str()).take(24));
    let with_time = groups.iter().find_map(|group| Some((group, time_channel(group, named)?, group.rows?)));
    if let (Some((group, time, rows)), Some(own_rows)) =
        (with_time.filter(|(.., rows)| Some(*rows) != own.rows), own.rows)
    {
        let time = &group.channels[time].name;
        let message = format!(
            "`{file}`: the time `{time}` has {rows} rows, but {own_rows} rows have {}, which therefore have no time",
            names()
        );
        return Diagnostic::error("log::no-time", message).help(
            "save channels recorded together with the same number of rows, other channels with a time of their own, or give `sample_time` \
             in `[log.NAME]`",
        );
    }
    Diagnostic::error("log::no-time", format!("`{file}`: kardan cannot find the time column"))
        .help(format!("name it in `[log.NAME]` with `time = \"...\"`, one of {}, or give `sample_time`", names()))
}

/// The time channel: named by the table, by the file, or by a usual name.
fn time_channel(group: &Group, named: Option<&str>) -> Option<usize> {
    let own = named.and_then(|name| find(std::slice::from_ref(group), Some(name), None)).map(|(_, channel)| channel);
    let usual = || group.channels.iter().position(|one| USUAL.contains(&one.name.trim().to_lowercase().as_str()));
    own.or(group.time).or_else(usual)
}

/// Of its readings to s.
fn time_factor(
    Described { table, file, .. }: Described<'_, '_>,
    channel: &kardan_tables::read::Channel,
    out: &mut Vec<Diagnostic>,
) -> f64 {
    let unit = match (channel.unit.trim(), unit_in_name(&channel.name)) {
        ("", Some(unit)) => unit,
        (unit, _) => unit,
    };
    let unit = read_word(table, "time_unit").unwrap_or(unit).trim();
    match header_unit(unit) {
        Ok((factor, Dimension::TIME)) => return factor.to_f64(),
        Ok((factor, Dimension::NONE)) if factor == Exact::one() => return 1.0,
        _ => {}
    }
    let message = format!("`{file}`: the unit `{}` of its time is not a unit of time", shortened(unit));
    let help = "set it in `[log.NAME]` with `time_unit = \"ms\"`";
    out.push(key_error("unit::dimension", message, (table, "time_unit", "this log"), help));
    1.0
}
