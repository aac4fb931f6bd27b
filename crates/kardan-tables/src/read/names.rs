//! Names of channels: made unique; names of the time.

use std::collections::{HashMap, HashSet};

use super::Channel;

/// Makes names unique: `x`, `x (2)`, `x (3)`.
pub(super) fn make_unique(channels: &mut [Channel]) {
    let (mut used, mut counts) = (HashSet::new(), HashMap::new());
    for channel in channels {
        let name = channel.name.clone();
        while !used.insert(channel.name.clone()) {
            let count = counts.entry(name.clone()).or_insert(1usize);
            *count += 1;
            channel.name = format!("{name} ({count})");
        }
    }
}

/// Names of the time, without what follows them: numbers, underscores, and units in brackets.
const TIME_NAMES: &[&str] = &[
    "time",
    "t",
    "tout",
    "timestamp",
    "timestamps",
    "time stamp",
    "times",
    "zeit",
    "datetime",
    "date time",
    "date_time",
];

/// Whether a channel has a name of the time.
pub(super) fn named_time(name: &str) -> bool {
    let name = name.rsplit(['.', '/', '\\']).next().unwrap_or(name).trim().to_lowercase();
    let name =
        name.split(['[', '(']).next().unwrap_or("").trim().trim_end_matches(|c: char| c.is_ascii_digit() || c == '_');
    let with_unit = || {
        unit_in_name(name)
            .and(name.rsplit_once('_'))
            .is_some_and(|(name, _)| matches!(name, "time" | "timestamp" | "t"))
    };
    TIME_NAMES.contains(&name) || with_unit()
}

/// The unit that the name of a time ends with: `ms` of `time_ms`.
pub fn unit_in_name(name: &str) -> Option<&'static str> {
    let end = name.trim().rsplit_once('_')?.1.to_ascii_lowercase();
    ["s", "ms", "us", "ns"].into_iter().find(|unit| *unit == end)
}

/// The first channel with a name of the time.
pub(super) fn find_time(channels: &[Channel]) -> Option<usize> {
    channels.iter().position(|channel| named_time(&channel.name))
}
