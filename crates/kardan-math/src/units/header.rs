//! Units in the headers of measured tables.

use kardan_tables::is_minus;

use super::{Dimension, Exact, UnitError, parse_quantity};

/// Words of headers that are no units of models.
const UNIT_ALIASES: [(&[&str], &str); 8] = [
    (&["sec", "secs", "second", "seconds"], "s"),
    (&["msec"], "ms"),
    (&["usec", "\u{b5}sec", "\u{3bc}sec"], "us"),
    (&["r", "tr", "u"], "rev"),
    (&["RPM", "Rpm", "upm", "Upm", "UPM"], "rpm"),
    (&["rps"], "(rev/s)"),
    (&["dps"], "(deg/s)"),
    (&["NM"], "N m"),
];

/// The SI value of a unit, and its dimension; nothing, `-` and `1` are the number 1.
///
/// Besides all units of models it reads brackets around a unit, `r/min`, `RPM` and `Upm`, `sec`, and powers without their sign: `min-1`,
/// `m/s2`.
///
/// # Errors
/// Those of [`parse_quantity`].
///
/// ```
/// use kardan_math::units::{header_unit, parse_quantity};
/// assert_eq!(header_unit("[r/min]")?, parse_quantity("1 rpm")?);
/// assert_eq!(header_unit("N m s2")?, parse_quantity("1 N m s^2")?);
/// # Ok::<(), kardan_math::units::UnitError>(())
/// ```
pub fn header_unit(unit: &str) -> Result<(Exact, Dimension), UnitError> {
    let unit = unit.trim();
    let inside = unit.strip_prefix('[').and_then(|unit| unit.strip_suffix(']'));
    match inside.unwrap_or(unit).trim() {
        "1" => Ok((Exact::one(), Dimension::NONE)),
        unit if unit.chars().all(is_minus) => Ok((Exact::one(), Dimension::NONE)),
        unit => parse_quantity(&format!("1 {}", as_in_models(unit))),
    }
}

/// A unit in the words and with the signs of models.
fn as_in_models(unit: &str) -> String {
    let is_letter = |c: char| c.is_alphabetic() || matches!(c, '\u{b0}' | '%');
    let mut out = String::new();
    let mut rest = unit;
    while let Some(first) = rest.chars().next() {
        let length = rest.find(|c| !is_letter(c)).unwrap_or(rest.len()).max(first.len_utf8());
        let (word, behind) = rest.split_at(length);
        let entry = UNIT_ALIASES.iter().find(|(aliases, _)| aliases.contains(&word));
        out += entry.map_or(word, |(_, unit)| unit);
        rest = behind;
        if !is_letter(first) {
            continue;
        }
        let power = rest.trim_start_matches(is_minus);
        if power.starts_with(|c: char| c.is_ascii_digit()) {
            out.push('^');
        } else if power.len() < rest.len() && power.starts_with(is_letter) {
            // `N-m` is a product.
            (out, rest) = (out + " ", power);
        }
    }
    out
}

#[cfg(test)]
#[path = "../../tests/unit/units/header.rs"]
mod tests;
