//! Tolerances and confidence intervals after a quantity: `"0.0081 N m s/rad ± 10 %"`, `"2 N m [1.8, 2.5] 95 %"`.

use std::ops::Range;

use super::quantity::{TEXT_LIMIT, check_length, check_range, quantity_with_factor};
use super::reader::Reader;
use super::{Dimension, Exact, UnitError};

/// The tolerance of a quantity, as written.
///
/// ```
/// use kardan_math::units::{Exact, Spread};
/// let tenth = Spread::Relative(Exact::from_ratio(1, 10));
/// assert_eq!(tenth.limits_at(&Exact::from_integer(-2)), (Exact::from_ratio(-11, 5), Exact::from_ratio(-9, 5)));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Spread {
    /// `± 10 %`: this fraction of the nominal value either way.
    Relative(Exact),
    /// `± 0.1 N m`: this much either way, SI.
    Absolute(Exact),
    /// `[0.9, 1.2]`: fixed bounds, SI.
    Interval {
        /// Lower bound.
        lower: Exact,
        /// Upper bound.
        upper: Exact,
        /// The confidence (0.95 for `95 %`), if it is given.
        confidence: Option<Exact>,
    },
}

impl Spread {
    /// Lower and upper end for a nominal value. Fixed bounds do not move.
    pub fn limits_at(&self, nominal: &Exact) -> (Exact, Exact) {
        let width = match self {
            Self::Relative(fraction) if nominal.signum() < 0 => -&(nominal * fraction),
            Self::Relative(fraction) => nominal * fraction,
            Self::Absolute(width) => width.clone(),
            Self::Interval { lower, upper, .. } => return (lower.clone(), upper.clone()),
        };
        (nominal.plus(&-&width), nominal.plus(&width))
    }

    /// The confidence (0.95 for `95 %`), if it is given.
    pub fn confidence(&self) -> Option<&Exact> {
        match self {
            Self::Interval { confidence, .. } => confidence.as_ref(),
            _ => None,
        }
    }
}

impl Exact {
    /// Whether it is less than another number.
    ///
    /// ```
    /// use kardan_math::units::Exact;
    /// assert!(Exact::from_ratio(1, 3).is_below(&Exact::from_ratio(1, 2)));
    /// ```
    pub fn is_below(&self, other: &Self) -> bool {
        other.plus(&-self).signum() > 0
    }
}

/// A quantity with a tolerance or a confidence interval.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tolerated {
    /// The nominal value, SI.
    pub value: Exact,
    /// Its dimension.
    pub dimension: Dimension,
    /// Its tolerance.
    pub spread: Spread,
    /// The nominal value as written: `0.0081 N m s/rad`.
    pub text: String,
}

/// Where the tolerance of a text begins, if it has one: at `±`, `+-`, `+/-`, or at a `[` after other text.
///
/// ```
/// use kardan_math::units::tolerance_mark;
/// assert_eq!(tolerance_mark("2 N m +- 10 %"), Some(6..8));
/// assert_eq!(tolerance_mark("[0, 10] deg"), None);
/// ```
pub fn tolerance_mark(text: &str) -> Option<Range<usize>> {
    let find = |mark: &&str| text.find(mark).map(|at| at..at + mark.len());
    let bracket = || find(&"[").filter(|at| !text[..at.start].trim().is_empty());
    let marks = ["±", "+-", "+−", "+–", "+/-", "+/−", "+/–"];
    marks.iter().filter_map(find).min_by_key(|at| at.start).or_else(bracket)
}

const FORMS: &str = "write \"1 N m ± 10 %\", \"1 N m ± 0.1 N m\" or \"1 N m [0.9, 1.2]\"";

/// Reads a quantity with a tolerance or a confidence interval, exactly, in SI units.
///
/// The forms are `"1 N m ± 10 %"`, `"1 N m ± 0.1 N m"`, `"(1 ± 0.1) N m"` and `"1 N m [0.9, 1.2] 95 %"`: bounds in the unit
/// before the bracket, the confidence optional. For `±` also `+-` or `+/-`. The bounds may lie at different distances, and
/// one of them at the value itself.
///
/// # Errors
///
/// Those of [`super::parse_quantity`]; `tolerance::syntax` if no tolerance follows or something follows it,
/// `unit::dimension` if it has another dimension, `tolerance::bounds` if it is zero or negative, if the lower bound is not
/// below the upper one, or if the value lies outside.
///
/// ```
/// use kardan_math::units::{Exact, parse_tolerated};
/// let stiffness = parse_tolerated("100 N m/rad ± 10 %")?;
/// assert_eq!(stiffness.spread.limits_at(&stiffness.value), (Exact::from_integer(90), Exact::from_integer(110)));
/// assert_eq!(stiffness.text, "100 N m/rad");
/// # Ok::<(), kardan_math::units::UnitError>(())
/// ```
pub fn parse_tolerated(text: &str) -> Result<Tolerated, UnitError> {
    check_length(text, TEXT_LIMIT)?;
    let Some(mark) = tolerance_mark(text) else {
        return Err(UnitError::new("tolerance::syntax", 0..text.len(), "there is no tolerance").help(FORMS));
    };
    if text[..mark.start].trim().is_empty() {
        let message = "there is no value before the tolerance";
        return Err(UnitError::new("tolerance::syntax", mark.start..text.trim_end().len(), message).help(FORMS));
    }
    let read = match &text[mark.clone()] {
        "[" => interval(text, mark.clone()),
        _ if text.trim_start().starts_with('(') => in_parentheses(text, mark.clone()),
        _ => plus_minus(text, mark.clone()),
    }?;
    let (lower, upper) = read.spread.limits_at(&read.value);
    check_range(&lower, text, 0..text.len())?;
    check_range(&upper, text, 0..text.len())?;
    if lower.to_f64() >= upper.to_f64() {
        let relative = matches!(read.spread, Spread::Relative(_)) && read.value.is_zero();
        let (message, help) = match relative {
            true => ("a percentage of zero is zero", "write the tolerance with a unit, such as \"0 rad ± 0.1 rad\""),
            false => ("the tolerance is zero", "leave it out if the value is exact"),
        };
        return Err(UnitError::new("tolerance::bounds", mark.start..text.trim_end().len(), message).help(help));
    }
    Ok(read)
}

/// `1 N m ± 10 %` or `1 N m ± 0.1 N m`.
fn plus_minus(text: &str, mark: Range<usize>) -> Result<Tolerated, UnitError> {
    let nominal = &text[..mark.start];
    let (value, _, dimension) = quantity_with_factor(nominal)?;
    let mut reader = Reader { text, at: mark.end };
    let (size, Range { start, end }, percent) = width(&mut reader)?;
    let spread = if percent {
        expect_end(&mut reader)?;
        Spread::Relative(&size * &Exact::from_ratio(1, 100))
    } else {
        let (factor, found) = reader.unit()?;
        if found != dimension {
            let (left, right) = (nominal.trim(), text[start..].trim());
            let message = format!("the tolerance must be {} as the value, found {}", dimension.noun(), found.noun());
            let unit = left[number_length(left)..].trim();
            let help = if dimension == Dimension::NONE {
                format!("write \"({left} ± {}) {}\"", text[start..end].trim(), text[end..].trim())
            } else if found == Dimension::NONE {
                format!("write \"{left} ± {right} {unit}\", or \"{left} ± {right} %\"")
            } else {
                format!("write the tolerance in `{unit}`")
            };
            return Err(UnitError::new("unit::dimension", start..text.trim_end().len(), message).help(help));
        }
        Spread::Absolute(&size * &factor)
    };
    expect_positive(&size, text, start..text.trim_end().len())?;
    Ok(Tolerated { value, dimension, spread, text: nominal.trim().to_string() })
}

/// `(1 ± 0.1) N m` or `(1 ± 10 %) N m`.
fn in_parentheses(text: &str, mark: Range<usize>) -> Result<Tolerated, UnitError> {
    let malformed = |span: Range<usize>, message: String| {
        UnitError::new("tolerance::syntax", span, message)
            .help("write it like \"(1 ± 0.1) N m\" or \"1 N m ± 0.1 N m\"")
    };
    let mut left = Reader { text: &text[..mark.start], at: 0 };
    left.spaces();
    left.eat('(');
    left.spaces();
    let (value, start) = (left.number()?, left.at);
    let number = text[..start].trim_start().trim_start_matches('(').trim().to_string();
    left.spaces();
    if left.peek().is_some() {
        return Err(malformed(left.here(), format!("expected `±` after the number, found {}", left.found())));
    }
    let mut reader = Reader { text, at: mark.end };
    let (size, span, percent) = width(&mut reader)?;
    reader.spaces();
    let here = reader.here();
    if !reader.eat(')') {
        let message = format!("expected `)` after the tolerance, found {}", reader.found());
        return Err(malformed(if here.is_empty() { mark } else { here }, message));
    }
    let unit = text[reader.at..].trim();
    let (factor, dimension) = reader.unit()?;
    expect_positive(&size, text, span)?;
    let value = &value * &factor;
    check_range(&value, text, 0..text.len())?;
    let spread = match percent {
        true => Spread::Relative(&size * &Exact::from_ratio(1, 100)),
        false => Spread::Absolute(&size * &factor),
    };
    Ok(Tolerated { value, dimension, spread, text: format!("{number} {unit}").trim().to_string() })
}

/// `1 N m [0.9, 1.2] 95 %`.
fn interval(text: &str, mark: Range<usize>) -> Result<Tolerated, UnitError> {
    let nominal = &text[..mark.start];
    let (value, factor, dimension) = quantity_with_factor(nominal)?;
    let mut reader = Reader { text, at: mark.end };
    let mut bounds = Vec::new();
    for close in [',', ']'] {
        bounds.push(&reader.number()? * &factor);
        reader.spaces();
        let here = reader.here();
        if !reader.eat(close) {
            let message = format!("expected `{close}` after a bound, found {}", reader.found());
            let span = if here.is_empty() { mark.start..text.len() } else { here };
            return Err(UnitError::new("tolerance::syntax", span, message)
                .help("write two numbers in the unit before the bracket: \"1 N m [0.9, 1.2]\""));
        }
    }
    let span = mark.start..reader.at;
    reader.spaces();
    let confidence = match reader.peek() {
        None => None,
        Some(_) => {
            let start = reader.at;
            let followed = || {
                UnitError::new("tolerance::syntax", start..text.trim_end().len(), "unexpected text after the interval")
                    .help("write the unit before the bracket, and after it at most the confidence: \"1 N m [0.9, 1.2] 95 %\"")
            };
            let percent = reader.number().map_err(|_| followed())?;
            reader.spaces();
            if !reader.eat('%') {
                return Err(followed());
            }
            expect_end(&mut reader)?;
            if percent.signum() <= 0 || !percent.is_below(&Exact::from_integer(100)) {
                let message = format!("a confidence lies between 0 % and 100 %, found {}", text[start..].trim());
                return Err(UnitError::new("tolerance::bounds", start..text.trim_end().len(), message)
                    .help("write it like `95 %`, or leave it out"));
            }
            Some(&percent * &Exact::from_ratio(1, 100))
        }
    };
    let [lower, upper] = [bounds.remove(0), bounds.remove(0)];
    let shown = &text[span.clone()];
    if upper.is_below(&lower) {
        let message = format!("the lower bound of {shown} lies above the upper one");
        return Err(UnitError::new("tolerance::bounds", span, message).help("write the smaller number first"));
    }
    if value.is_below(&lower) || upper.is_below(&value) {
        let message = format!("the value {} lies outside {shown}", nominal.trim());
        return Err(UnitError::new("tolerance::bounds", span, message)
            .help("write bounds in the unit before the bracket, one on either side of the value"));
    }
    let spread = Spread::Interval { lower, upper, confidence };
    Ok(Tolerated { value, dimension, spread, text: nominal.trim().to_string() })
}

/// The number after `±`, its place, and whether it is a percentage.
fn width(reader: &mut Reader<'_>) -> Result<(Exact, Range<usize>, bool), UnitError> {
    reader.spaces();
    let start = reader.at;
    let size = reader.number()?;
    let span = start..reader.at;
    reader.spaces();
    Ok((size, span, reader.eat('%')))
}

/// The length of the number that a text begins with.
fn number_length(text: &str) -> usize {
    let mut reader = Reader { text, at: 0 };
    reader.number().map_or(0, |_| reader.at)
}

fn expect_end(reader: &mut Reader<'_>) -> Result<(), UnitError> {
    reader.spaces();
    if reader.peek().is_none() {
        return Ok(());
    }
    let span = reader.at..reader.text.trim_end().len();
    Err(UnitError::new("tolerance::syntax", span, "unexpected text after the `%`").help(FORMS))
}

fn expect_positive(size: &Exact, text: &str, span: Range<usize>) -> Result<(), UnitError> {
    if size.signum() >= 0 {
        return Ok(());
    }
    let message = format!("a tolerance must not be negative, found {}", text[span.clone()].trim());
    Err(UnitError::new("tolerance::bounds", span, message).help("write its size: `±` stands for both signs"))
}

#[cfg(test)]
#[path = "../../tests/unit/units/tolerance.rs"]
mod tests;
