//! Cells between two delimiters.

use std::borrow::Cow;

use super::super::decimal;
use crate::is_minus;

/// The meaning of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cell {
    Number(f64),
    Missing,
    /// A time of day or a date with one, in ns.
    Stamp(i64),
    Text,
}

/// Splits a line at its delimiters; quotes are respected, blanks around cells are cut off.
pub(super) fn split<'a>(line: &'a [u8], delimiter: u8, cells: &mut Vec<&'a [u8]>) {
    cells.clear();
    if delimiter == b' ' && !line.contains(&b'"') {
        cells.extend(line.split(|byte| matches!(byte, b' ' | b'\t')).filter(|cell| !cell.is_empty()));
        return;
    }
    let mut at = 0;
    loop {
        while at < line.len() && line[at] == b' ' {
            at += 1;
        }
        let start = at;
        if line.get(at) == Some(&b'"') {
            at += 1;
            while at < line.len() && (line[at] != b'"' || line.get(at + 1) == Some(&b'"')) {
                at += if line[at] == b'"' { 2 } else { 1 };
            }
        }
        let end = line.get(at..).and_then(|rest| rest.iter().position(|byte| *byte == delimiter));
        let end = end.map_or(line.len(), |end| at + end);
        cells.push(line[start..end].trim_ascii());
        if end == line.len() {
            return;
        }
        at = end + 1;
        if delimiter == b' ' && line[at..].iter().all(|byte| *byte == b' ') {
            return;
        }
    }
}

/// A cell without its quotes.
pub(super) fn unquoted(cell: &[u8]) -> &[u8] {
    cell.strip_prefix(b"\"").and_then(|cell| cell.strip_suffix(b"\"")).map_or(cell, <[u8]>::trim_ascii)
}

/// A cell with an ASCII minus in place of every other minus character; in non-UTF-8 bytes of the dashes of Windows.
fn with_minus(cell: &[u8]) -> Cow<'_, [u8]> {
    if cell.is_ascii() {
        return cell.into();
    }
    match std::str::from_utf8(cell) {
        Ok(text) => text.replace(is_minus, "-").into_bytes().into(),
        Err(_) => cell.iter().map(|byte| if matches!(byte, 0x96 | 0x97) { b'-' } else { *byte }).collect(),
    }
}

/// The meaning of a cell.
pub(super) fn read(cell: &[u8], point: u8) -> Cell {
    let cell = &*with_minus(unquoted(cell));
    if let Some((value, consumed)) = decimal::leading(cell, point)
        && consumed == cell.len()
    {
        return Cell::Number(value);
    }
    if cell.len() > 40 {
        return Cell::Text;
    }
    let word = cell.to_ascii_lowercase();
    match &word[..] {
        b"" | b"-" | b"--" | b"nan" | b"-nan" | b"n/a" | b"#n/a" | b"na" | b"<na>" | b"null" | b"none" | b"?"
        | b"nat" | b"1.#qnan" | b"-1.#ind" => Cell::Missing,
        b"inf" | b"+inf" | b"infinity" | b"1.#inf" => Cell::Number(f64::INFINITY),
        b"-inf" | b"-infinity" | b"-1.#inf" => Cell::Number(f64::NEG_INFINITY),
        b"true" => Cell::Number(1.0),
        b"false" => Cell::Number(0.0),
        _ => stamp(&word).map_or(Cell::Text, Cell::Stamp),
    }
}

/// A date with a time of day (ISO 8601, or day.month.year) or a time of day, in ns.
fn stamp(text: &[u8]) -> Option<i64> {
    let text = std::str::from_utf8(text).ok()?;
    let (days, clock) = match text.split_once(['t', ' ']) {
        Some((date, clock)) => (days(date)?, clock.trim()),
        None if text.contains(':') => (0, text),
        None => (days(text)?, "0:0"),
    };
    let (clock, offset) = zone(clock)?;
    let mut parts = clock.split(':');
    let hours: i64 = number(parts.next()?)?;
    let minutes: i64 = number(parts.next()?)?;
    let seconds = parts.next().unwrap_or("0");
    if parts.next().is_some() || hours > 24 || minutes > 59 {
        return None;
    }
    let (whole, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds, "0"));
    let whole: i64 = number(whole)?;
    let digits = fraction.get(..fraction.len().min(9))?;
    let nanoseconds = number(digits)? * 10i64.pow(9 - digits.len() as u32);
    if whole > 60 || !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let seconds = days * 86400 + hours * 3600 + minutes * 60 + whole - offset * 60;
    seconds.checked_mul(1_000_000_000)?.checked_add(nanoseconds)
}

/// The clock without its zone, and its offset from UTC in minutes.
fn zone(clock: &str) -> Option<(&str, i64)> {
    if let Some(clock) = clock.strip_suffix('z') {
        return Some((clock, 0));
    }
    let Some(at) = clock.find(['+', '-']) else { return Some((clock, 0)) };
    let (clock, zone) = clock.split_at(at);
    let digits: String = zone[1..].chars().filter(|c| *c != ':').collect();
    let value = number(&digits)?;
    let minutes = if digits.len() <= 2 { value * 60 } else { value / 100 * 60 + value % 100 };
    Some((clock.trim(), if zone.starts_with('-') { -minutes } else { minutes }))
}

fn number(digits: &str) -> Option<i64> {
    let sound = !digits.is_empty() && digits.len() <= 9 && digits.bytes().all(|byte| byte.is_ascii_digit());
    if sound { digits.parse().ok() } else { None }
}

/// Days since 1970-01-01.
fn days(date: &str) -> Option<i64> {
    let numbers = |separator: char| -> Option<[i64; 3]> {
        date.split(separator).map(number).collect::<Option<Vec<_>>>()?.try_into().ok()
    };
    let dotted = || numbers('.').map(|[day, month, year]| [year, month, day]);
    let slashed = || numbers('/').filter(|[year, ..]| *year > 31);
    let [year, month, day] = numbers('-').or_else(dotted).or_else(slashed)?;
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || !(1000..3000).contains(&year) {
        return None;
    }
    // H. Hinnant, chrono-compatible low-level date algorithms: years that begin in March.
    let year = year - i64::from(month < 3);
    let of_era = year.rem_euclid(400);
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(year.div_euclid(400) * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468)
}

#[cfg(test)]
#[path = "../../../tests/unit/read/csv/cell.rs"]
mod tests;
