//! Exact quantities as text that reads back as the same number.

use dashu_int::UBig;
use dashu_ratio::RBig;

use super::{Dimension, Exact};

/// Fractions whose decimal form has more digits stay fractions.
const DIGITS: usize = 17;

/// A quantity in SI units as a model file writes it: [`parse_quantity`](super::parse_quantity) gives the same number back.
///
/// ```
/// use kardan_math::units::{Dimension, Exact, parse_quantity, format_quantity};
/// assert_eq!(format_quantity(&Exact::from_ratio(13, 10), Dimension::TORQUE), "1.3 N m");
/// assert_eq!(format_quantity(&Exact::from_ratio(1, 3), Dimension::NONE), "1/3");
/// let (angle, dimension) = parse_quantity("30 deg")?;
/// assert_eq!(format_quantity(&angle, dimension), "1/6 pi rad");
/// assert_eq!(parse_quantity("1/6 pi rad")?, (angle, dimension));
/// # Ok::<(), kardan_math::units::UnitError>(())
/// ```
pub fn format_quantity(value: &Exact, dimension: Dimension) -> String {
    let mut text = decimal(value).unwrap_or_else(|| value.rational.to_string());
    for _ in 0..value.pi.unsigned_abs() {
        text.push_str(if value.pi > 0 { " pi" } else { "/pi" });
    }
    if dimension != Dimension::NONE {
        text.push(' ');
        text.push_str(&dimension.si());
    }
    text
}

/// A quantity for a person to read: an angle in degrees where these are a short decimal number, else in SI units.
///
/// ```
/// use kardan_math::units::{Dimension, Exact, parse_quantity, shown_quantity};
/// let (angle, dimension) = parse_quantity("25 deg")?;
/// assert_eq!(shown_quantity(&angle, dimension), "25 deg");
/// assert_eq!(shown_quantity(&Exact::from_ratio(3, 4), Dimension::NONE), "0.75");
/// assert_eq!(shown_quantity(&Exact::from_ratio(1, 3), Dimension::TORQUE), "0.3333333333333333 N m");
/// # Ok::<(), kardan_math::units::UnitError>(())
/// ```
pub fn shown_quantity(value: &Exact, dimension: Dimension) -> String {
    let degree = Exact::new(RBig::from_parts(1.into(), 180u8.into()), 1);
    let degrees = value.div(&degree).filter(|degrees| degrees.pi == 0 && dimension == Dimension::ANGLE);
    match degrees.as_ref().and_then(decimal) {
        Some(degrees) => format!("{degrees} deg"),
        None => format!("{} {}", value.to_f64(), dimension.si()).trim().to_string(),
    }
}

/// The rational factor as a short decimal number, if it is one.
fn decimal(value: &Exact) -> Option<String> {
    let ten = UBig::from(10u8);
    let places = (0..=DIGITS).find(|places| (ten.pow(*places) % value.rational.denominator()) == UBig::ZERO)?;
    let scaled = value.rational.numerator() * (ten.pow(places) / value.rational.denominator());
    let digits = scaled.to_string();
    let (sign, digits) = digits.strip_prefix('-').map_or(("", digits.as_str()), |digits| ("-", digits));
    if places == 0 {
        return Some(format!("{sign}{digits}"));
    }
    let digits = format!("{digits:0>width$}", width = places + 1);
    let (whole, part) = digits.split_at(digits.len() - places);
    (digits.len() <= 2 * DIGITS).then(|| format!("{sign}{whole}.{part}"))
}
