//! Decimal numbers from bytes, rounded correctly and quickly.

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Reads a number at the start of some bytes. Returns the value and its number of bytes; `None` if there is no
/// supported number (`inf`, `NaN` and words are not).
///
/// Up to 19 digits stay a whole number. If it has at most 53 bits, one multiplication or division by an exact power of
/// ten rounds once (W. D. Clinger, How to read floating point numbers accurately, 1990); a whole number over a power of
/// ten below 2⁶⁴ is divided as such; `str::parse` does the rest.
#[inline]
pub(super) fn leading(bytes: &[u8], point: u8) -> Option<(f64, usize)> {
    let sign = *bytes.first()?;
    let start = usize::from(matches!(sign, b'-' | b'+'));
    let mut at = start;
    let mut mantissa = 0u64;
    while let Some(digit) = digit(bytes, at) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
        at += 1;
    }
    let mut digits = at - start;
    let mut exponent = 0i64;
    if bytes.get(at) == Some(&point) {
        at += 1;
        let fraction = at;
        while let Some(eight) = bytes.get(at..at + 8).and_then(eight_digits) {
            mantissa = mantissa.wrapping_mul(100_000_000).wrapping_add(eight);
            at += 8;
        }
        while let Some(digit) = digit(bytes, at) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
            at += 1;
        }
        digits += at - fraction;
        exponent = -((at - fraction) as i64);
    }
    if digits == 0 {
        return None;
    }
    if let Some(b'e' | b'E' | b'd' | b'D') = bytes.get(at) {
        let mut end = at + 1;
        let sign = if bytes.get(end) == Some(&b'-') { -1 } else { 1 };
        if let Some(b'-' | b'+') = bytes.get(end) {
            end += 1;
        }
        let first = end;
        let mut power = 0i64;
        while let Some(digit) = digit(bytes, end) {
            power = (power * 10 + digit as i64).min(100_000);
            end += 1;
        }
        if end > first {
            exponent += sign * power;
            at = end;
        }
    }
    // Leading zeros do not count as digits.
    let fits = digits <= 19 || {
        let significant = bytes[start..at].iter().skip_while(|byte| **byte == b'0' || **byte == point);
        significant.take_while(|byte| byte.is_ascii_digit() || **byte == point).filter(|byte| **byte != point).count()
            <= 19
    };
    let value = match (fits, exponent) {
        (true, 0..=22) if mantissa >> 53 == 0 => mantissa as f64 * POWERS[exponent as usize],
        (true, -22..0) if mantissa >> 53 == 0 => mantissa as f64 / POWERS[-exponent as usize],
        (true, -19..0) => quotient(mantissa, 10u64.pow(-exponent as u32)),
        _ => slow(&bytes[start..at], point)?,
    };
    Some((if sign == b'-' { -value } else { value }, at))
}

#[inline]
fn digit(bytes: &[u8], at: usize) -> Option<u64> {
    let digit = bytes.get(at)?.wrapping_sub(b'0');
    (digit < 10).then_some(digit.into())
}

/// Eight digits at once, in the lanes of a word.
#[inline]
fn eight_digits(bytes: &[u8]) -> Option<u64> {
    let word = u64::from_le_bytes(bytes.try_into().ok()?);
    let low = word.wrapping_sub(0x3030_3030_3030_3030);
    if (word.wrapping_add(0x4646_4646_4646_4646) | low) & 0x8080_8080_8080_8080 != 0 {
        return None;
    }
    let pairs = low.wrapping_mul(10).wrapping_add(low >> 8);
    let high = (pairs & 0x0000_00ff_0000_00ff).wrapping_mul(0x000f_4240_0000_0064);
    let low = (pairs >> 16 & 0x0000_00ff_0000_00ff).wrapping_mul(0x0000_2710_0000_0001);
    Some(high.wrapping_add(low) >> 32)
}

/// A quotient of whole numbers above zero, rounded once: at least 64 bits of it and a flag for a remainder decide.
fn quotient(numerator: u64, denominator: u64) -> f64 {
    let shift = numerator.leading_zeros();
    let scale = 64 - denominator.leading_zeros();
    let numerator = u128::from(numerator << shift) << scale;
    let (whole, rest) = (numerator / u128::from(denominator), numerator % u128::from(denominator));
    // `whole` has 64 or 65 bits; its last bit only marks a remainder, far below the 53 significant ones.
    let sticky = whole | u128::from(rest != 0);
    sticky as f64 * f64::from_bits((1023 - u64::from(shift) - u64::from(scale)) << 52)
}

#[cold]
fn slow(bytes: &[u8], point: u8) -> Option<f64> {
    let text: Vec<u8> = bytes
        .iter()
        .map(|byte| match byte {
            b'd' | b'D' => b'e',
            byte if *byte == point => b'.',
            byte => *byte,
        })
        .collect();
    std::str::from_utf8(&text).ok()?.parse().ok()
}

#[cfg(test)]
#[path = "../../tests/unit/read/decimal.rs"]
mod tests;
