//! Quantities and numbers from text.

use std::ops::Range;

use super::reader::Reader;
use super::{Dimension, Exact, UnitError};

/// The longest text of one quantity or number, in bytes.
pub(super) const TEXT_LIMIT: usize = 256;

/// The longest text of a list of quantities, in bytes.
const LIST_TEXT_LIMIT: usize = 16_384;

/// Reads a number with its unit and returns it exactly, in SI units.
///
/// The number is a decimal, a fraction `51/50`, or either with the factor `pi`. The unit is a product of factors:
/// `N m s/rad` (a `/` divides by the one factor after it), `N m/(rad/s)`, `kg·m²`, `rad s^-2`. After a `/` a further
/// factor needs `*`, `/` or parentheses: `N m/rad s` is rejected as ambiguous.
///
/// # Errors
///
/// An unknown unit, a malformed number or unit, a division by zero, `inf` and `nan`, an exponent of ten beyond ±400, a
/// text longer than 256 bytes, or a value that is no finite `f64` (or vanishes as one).
///
/// ```
/// use kardan_math::units::{Dimension, Exact, parse_quantity};
/// assert_eq!(parse_quantity("60 rpm")?, parse_quantity("2 pi rad/s")?);
/// assert_eq!(parse_quantity("130 kg mm^2")?, (Exact::from_ratio(130, 1_000_000), Dimension::INERTIA));
/// # Ok::<(), kardan_math::units::UnitError>(())
/// ```
pub fn parse_quantity(text: &str) -> Result<(Exact, Dimension), UnitError> {
    check_length(text, TEXT_LIMIT)?;
    let (value, _, dimension) = quantity_with_factor(text)?;
    check_fraction(text)?;
    Ok((value, dimension))
}

/// A quantity up to the end of a text: its value, the factor of its unit, its dimension.
pub(super) fn quantity_with_factor(text: &str) -> Result<(Exact, Exact, Dimension), UnitError> {
    let mut reader = Reader { text, at: 0 };
    let number = reader.number()?;
    let (factor, dimension) = reader.unit()?;
    let value = &number * &factor;
    check_range(&value, text, 0..text.len())?;
    Ok((value, factor, dimension))
}

/// The unit of a quantity as it is written, with what one of it is in SI units; `None` if it has none.
///
/// ```
/// use kardan_math::units::{Dimension, Exact, split_unit};
/// let torque = (Exact::from_ratio(1, 1000), Dimension::TORQUE);
/// assert_eq!(split_unit("20 mN m"), Some(("mN m", torque.0, torque.1)));
/// assert_eq!(split_unit("3/2"), None);
/// ```
pub fn split_unit(text: &str) -> Option<(&str, Exact, Dimension)> {
    let mut reader = Reader { text, at: 0 };
    reader.number().ok()?;
    let unit = text.get(reader.at..)?.trim();
    let (size, dimension) = parse_quantity(&format!("1 {unit}")).ok()?;
    (!unit.is_empty()).then_some((unit, size, dimension))
}

/// Reads a number without a unit exactly: `0.05`, `-1e-3`, `51/50`, `pi/4`.
///
/// # Errors
///
/// As [`parse_quantity`], and if anything follows the number.
///
/// ```
/// use kardan_math::units::{Exact, parse_number};
/// assert_eq!(parse_number("51/50")?, Exact::from_ratio(51, 50));
/// assert_eq!(parse_number("1.02")?, Exact::from_ratio(51, 50));
/// # Ok::<(), kardan_math::units::UnitError>(())
/// ```
pub fn parse_number(text: &str) -> Result<Exact, UnitError> {
    check_length(text, TEXT_LIMIT)?;
    let mut reader = Reader { text, at: 0 };
    let number = reader.number()?;
    reader.spaces();
    let end = reader.at;
    if end < text.len() {
        reader.unit()?;
        return Err(UnitError::new(
            "unit::dimension",
            end..text.trim_end().len(),
            "expected a number without a unit, found a unit",
        )
        .help(format!("write \"{}\"", text[..end].trim())));
    }
    check_range(&number, text, 0..text.len())?;
    check_fraction(text)?;
    Ok(number)
}

/// Reads a list of numbers with one unit for all, and gives each with its own text.
///
/// # Errors
///
/// As [`parse_quantity`], and if the brackets are missing or nothing is between them. A text of up to 16384 bytes is
/// read.
///
/// ```
/// use kardan_math::units::parse_quantity_list;
/// let angles = parse_quantity_list("[0, 10, 20, 30] deg")?;
/// assert_eq!(angles.len(), 4);
/// assert_eq!(angles[1].2, "10 deg");
/// # Ok::<(), kardan_math::units::UnitError>(())
/// ```
pub fn parse_quantity_list(text: &str) -> Result<Vec<(Exact, Dimension, String)>, UnitError> {
    check_length(text, LIST_TEXT_LIMIT)?;
    let malformed = |span: Range<usize>, message: &str| {
        UnitError::new("number::syntax", span, message).help("write a list like \"[0, 10, 20] deg\"")
    };
    let mut reader = Reader { text, at: 0 };
    reader.spaces();
    if !reader.eat('[') {
        return Err(malformed(0..text.len(), "expected a list of numbers in brackets"));
    }
    let mut entries = Vec::new();
    loop {
        reader.spaces();
        let start = reader.at;
        if reader.eat(']') {
            break;
        }
        let number = reader.number()?;
        entries.push((number, start..reader.at));
        reader.spaces();
        let next = reader.here();
        if !reader.eat(',') && reader.peek() != Some(']') {
            return Err(malformed(next, "expected `,` or `]` after a number of the list"));
        }
    }
    if entries.is_empty() {
        return Err(malformed(0..text.len(), "the list is empty"));
    }
    let unit_text = text[reader.at..].trim();
    check_length(unit_text, TEXT_LIMIT)?;
    let (factor, dimension) = reader.unit()?;
    entries
        .into_iter()
        .map(|(number, span)| {
            let value = &number * &factor;
            check_range(&value, &text[span.clone()], span.clone())?;
            Ok((value, dimension, format!("{} {unit_text}", &text[span]).trim_end().to_string()))
        })
        .collect()
}

/// Whether a text is short enough.
pub(super) fn check_length(text: &str, limit: usize) -> Result<(), UnitError> {
    if text.len() > limit {
        let message = format!("the text is too long: {} bytes, where at most {limit} are read", text.len());
        return Err(UnitError::new("number::syntax", 0..text.len(), message).help(shorter(text, limit)));
    }
    Ok(())
}

/// The help for shortening a text: by its main content.
fn shorter(text: &str, limit: usize) -> &'static str {
    let digits = text.split(|c: char| !c.is_ascii_digit()).map(str::len).max().unwrap_or_default();
    match () {
        () if 2 * digits > limit => "write fewer digits",
        () if text.trim_start().starts_with('[') => "write fewer entries",
        () => {
            "give parts of it names under `[parameters]`, write a sum of torques as several elements, or long data as a table `[table.NAME]`"
        }
    }
}

/// Whether it is clear what a `/` with spaces around it divides by: in `1 / 60 s` it may be `60` or `60 s`.
fn check_fraction(text: &str) -> Result<(), UnitError> {
    let spaced =
        |at: &usize| text[..*at].ends_with(char::is_whitespace) || text[at + 1..].starts_with(char::is_whitespace);
    let Some(at) = text.match_indices('/').map(|(at, _)| at).find(spaced) else { return Ok(()) };
    let mut reader = Reader { text, at: at + 1 };
    reader.spaces();
    let start = reader.at;
    let divisor = reader.factor_of_number()?;
    let (top, first) = (text[..at].trim(), &text[start..reader.at]);
    let rest = reader.rest().trim();
    if divisor.is_none() || rest.is_empty() {
        return Ok(());
    }
    let message = format!("it is not clear whether `/` also divides by `{rest}`");
    let help = format!("write `{top}/{first} {rest}`, or `{top}/({first} {rest})`");
    Err(UnitError::new("unit::ambiguous", reader.at..text.len(), message).help(help))
}

/// Whether a number is one of floating point.
pub(super) fn check_range(value: &Exact, text: &str, span: Range<usize>) -> Result<(), UnitError> {
    let text = text.trim();
    let size = value.to_f64().abs();
    let problem = if !size.is_finite() {
        "too large: a number must be below 1.8e308 in SI units"
    } else if size == 0.0 && !value.is_zero() {
        "too small: a number other than zero must be above 5e-324 in SI units"
    } else {
        return Ok(());
    };
    Err(UnitError::new("number::range", span, format!("`{text}` is {problem}")).help("check the exponent and the unit"))
}

#[cfg(test)]
#[path = "../../tests/unit/units/quantity.rs"]
mod tests;
