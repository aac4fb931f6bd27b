//! Reads poles from text.

use super::{Exact, UnitError, parse_number};
use kardan_tables::is_minus;

/// Reads a pole in 1/s, exactly: `-50`, `-14 + 14.3j`; `-14 ± 14.3j` gives a pair, the one with positive imaginary part
/// first. The unit `1/s` or `rad/s` may follow.
///
/// # Errors
///
/// As [`parse_number`], for the real and the imaginary part.
///
/// ```
/// use kardan_math::units::{Exact, parse_poles};
/// let pair = parse_poles("-14 ± 0.5j 1/s")?;
/// assert_eq!(pair[1], (Exact::from_integer(-14), Exact::from_ratio(-1, 2)));
/// assert_eq!(parse_poles("-50")?, [(Exact::from_integer(-50), Exact::zero())]);
/// # Ok::<(), kardan_math::units::UnitError>(())
/// ```
pub fn parse_poles(text: &str) -> Result<Vec<(Exact, Exact)>, UnitError> {
    let trimmed = text.trim();
    let number = ["1/s", "rad/s"].iter().find_map(|unit| trimmed.strip_suffix(unit)).unwrap_or(trimmed).trim_end();
    let Some(complex) = number.strip_suffix(['j', 'i']) else {
        return Ok(vec![(parse_number(number)?, Exact::zero())]);
    };
    // The sign between the parts: the last one that is no exponent's.
    let mut before = ' ';
    let mut split = None;
    for (at, c) in complex.char_indices() {
        if (matches!(c, '+' | '±') || is_minus(c)) && !matches!(before, 'e' | 'E') {
            split = Some((at, c));
        }
        before = c;
    }
    let (real, sign, imaginary) = match split {
        Some((at, c)) => (complex[..at].trim(), c, complex[at + c.len_utf8()..].trim()),
        None => ("", '+', complex.trim()),
    };
    let real = if real.is_empty() { Exact::zero() } else { parse_number(real)? };
    let imaginary = if imaginary.is_empty() { Exact::one() } else { parse_number(imaginary)? };
    Ok(match sign {
        '±' => vec![(real.clone(), imaginary.clone()), (real, -&imaginary)],
        sign if is_minus(sign) => vec![(real, -&imaginary)],
        _ => vec![(real, imaginary)],
    })
}

#[cfg(test)]
#[path = "../../tests/unit/units/poles.rs"]
mod tests;
