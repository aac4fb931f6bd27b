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
/// use kardan::units::{Exact, parse_poles};
/// let pair = parse_poles("-14 ± 0.5j 1/s")?;
/// assert_eq!(pair[1], (Exact::from_integer(-14), Exact::from_ratio(-1, 2)));
/// assert_eq!(parse_poles("-50")?, [(Exact::from_integer(-50), Exact::zero())]);
/// # Ok::<(), kardan::units::UnitError>(())
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
mod tests {
    use super::*;

    #[test]
    fn forms() {
        let q = Exact::from_ratio;
        for (text, expected) in [
            ("−50.1", vec![(q(-501, 10), q(0, 1))]),
            ("−1e−2 − 14.25j", vec![(q(-1, 100), q(-57, 4))]),
            ("-50.1", vec![(q(-501, 10), q(0, 1))]),
            ("-1e2", vec![(q(-100, 1), q(0, 1))]),
            ("-1e-2 + 1.5e+1j", vec![(q(-1, 100), q(15, 1))]),
            ("-14-14.25j", vec![(q(-14, 1), q(-57, 4))]),
            ("±3j", vec![(q(0, 1), q(3, 1)), (q(0, 1), q(-3, 1))]),
            ("-j", vec![(q(0, 1), q(-1, 1))]),
            ("-2 rad/s", vec![(q(-2, 1), q(0, 1))]),
            ("-1/2 ± 1/3i", vec![(q(-1, 2), q(1, 3)), (q(-1, 2), q(-1, 3))]),
        ] {
            assert_eq!(parse_poles(text).as_ref(), Ok(&expected), "{text}");
        }
        for text in ["", "j j", "fast", "-14 ± ", "1 + 2", "--3j", "nan", "inf", "-1 N m"] {
            assert!(parse_poles(text).is_err(), "{text}");
        }
    }
}
