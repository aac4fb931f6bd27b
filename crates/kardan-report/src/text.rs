//! Numbers and texts for HTML and JSON.

use std::fmt::Write;

use kardan_results::{DisplayUnit, bidi_escaped};

/// The text with everything that HTML would interpret written as entities; control characters become spaces, those of direction escapes.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in bidi_escaped(text).chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            control if control.is_control() => escaped.push(' '),
            other => escaped.push(other),
        }
    }
    escaped
}

/// A number for the reader of a table: `digits` significant ones, trailing zeros dropped, a typographic minus.
pub(super) fn figure(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let scientific = format!("{:.*e}", digits.max(1) - 1, value);
    let (mantissa, exponent) = scientific.split_once('e').expect("Rust prints an exponent");
    let exponent: i32 = exponent.parse().expect("and it is an integer");
    let text = if value == 0.0 {
        "0".into()
    } else if (-4..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        strip_trailing_zeros(&format!("{value:.decimals$}")).to_owned()
    } else {
        format!("{}e{exponent}", strip_trailing_zeros(mantissa))
    };
    text.replace('-', "−")
}

/// Significant digits of numbers, if there is no reason for others.
pub(super) const DIGITS: usize = 5;

/// A number in the default format.
pub(super) fn number(value: f64) -> String {
    figure(value, DIGITS)
}

/// A number with its unit, if it has one.
pub(super) fn quantity(value: f64, digits: usize, unit: &str) -> String {
    format!("{} {unit}", figure(value, digits)).trim_end().into()
}

/// An SI value in the unit that is shown.
pub(super) fn shown(value: f64, digits: usize, unit: &str, display: Option<&DisplayUnit>) -> String {
    display.map_or_else(|| quantity(value, digits, unit), |display| quantity(display.of(value), digits, &display.unit))
}

/// The unit of time that suits a study: s, ms or µs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clock {
    /// Units per second.
    pub(super) per_second: f64,
    /// Its symbol.
    pub(super) unit: &'static str,
}

impl Clock {
    /// For a study whose longest run ends then, s.
    pub(super) fn until(end: f64) -> Self {
        match end {
            end if end > 0.0 && end < 2e-4 => Self { per_second: 1e6, unit: "µs" },
            end if end > 0.0 && end < 0.2 => Self { per_second: 1e3, unit: "ms" },
            _ => Self { per_second: 1.0, unit: "s" },
        }
    }

    /// A time in s for the reader: `1.0000 s` reads `1 s`; four decimals.
    pub(super) fn time(self, time: f64) -> String {
        if !time.is_finite() {
            return "–".into();
        }
        let number = format!("{:.4}", time * self.per_second);
        format!("{} {}", strip_trailing_zeros(&number).replace('-', "−"), self.unit)
    }
}

/// A unit with its powers written as such: `kg m^2` reads `kg m²`.
pub(super) fn unit(unit: &str) -> String {
    unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴")
}

/// A name with its unit, where there is one: `angle [rad]`.
pub(super) fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.into() } else { format!("{name} [{unit}]") }
}

/// Powers written as such: `s^12 + 3 s` reads `s¹² + 3 s`.
pub(super) fn powers(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut raised = false;
    let mut rest = text.chars().peekable();
    while let Some(character) = rest.next() {
        match character {
            '^' if rest.peek().is_some_and(char::is_ascii_digit) => raised = true,
            digit if raised && digit.is_ascii_digit() => {
                out.push(['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize - '0' as usize]);
            }
            other => {
                raised = false;
                out.push(other);
            }
        }
    }
    out
}

fn strip_trailing_zeros(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

/// A JSON string that is also safe inside a `<script>` element.
pub(super) fn json_string(text: &str) -> String {
    let mut json = String::with_capacity(text.len() + 2);
    json.push('"');
    for character in bidi_escaped(text).chars() {
        match character {
            '"' => json.push_str("\\\""),
            '\\' => json.push_str("\\\\"),
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => json.push_str(&format!("\\u{:04x}", character as u32)),
            control if control.is_control() => json.push_str(&format!("\\u{:04x}", control as u32)),
            other => json.push(other),
        }
    }
    json.push('"');
    json
}

/// A JSON number of nine significant digits in its shortest form; `null` if it is not finite.
pub(super) fn json_number(value: f64) -> String {
    json_numbers([value]).trim_matches(['[', ']']).into()
}

/// A JSON array of such numbers.
pub(super) fn json_numbers(values: impl IntoIterator<Item = f64>) -> String {
    let (mut out, mut digits) = (String::from("["), String::new());
    for value in values {
        if out.len() > 1 {
            out.push(',');
        }
        if !value.is_finite() {
            out.push_str("null");
            continue;
        }
        digits.clear();
        let _ = write!(digits, "{value:.8e}");
        let (mantissa, exponent) = digits.split_once('e').unwrap_or((&digits, "0"));
        let (sign, mantissa) = mantissa.strip_prefix('-').map_or(("", mantissa), |rest| ("-", rest));
        let fraction = mantissa[1..].trim_start_matches('.').trim_end_matches('0');
        let (first, places) = (&mantissa[..1], exponent.parse::<i32>().unwrap_or(0));
        out.push_str(sign);
        // The digits begin before the point, end after it, or are on both sides.
        let (count, shift) = (fraction.len(), places.unsigned_abs() as usize);
        let scientific = 1 + usize::from(count > 0) + count + 1 + exponent.len();
        let plain = match places {
            0 => 1 + usize::from(count > 0) + count,
            1.. => (shift + 1).max(count + 1) + usize::from(count > shift),
            _ => 2 + shift + count,
        };
        let _ = match places {
            _ if plain > scientific && count == 0 => write!(out, "{first}e{exponent}"),
            _ if plain > scientific => write!(out, "{first}.{fraction}e{exponent}"),
            ..0 => write!(out, "0.{:0<1$}{first}{fraction}", "", shift - 1),
            _ if count > shift && shift == 0 => write!(out, "{first}.{fraction}"),
            _ if count > shift => write!(out, "{first}{}.{}", &fraction[..shift], &fraction[shift..]),
            _ => write!(out, "{first}{fraction:0<shift$}"),
        };
    }
    out.push(']');
    out
}

/// A JSON array of items that are JSON already.
pub(super) fn json_array(items: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", items.into_iter().collect::<Vec<_>>().join(","))
}

#[cfg(test)]
#[path = "../tests/unit/text.rs"]
mod tests;
