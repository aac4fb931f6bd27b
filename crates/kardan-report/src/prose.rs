//! Parts of a text: names and commands between backticks, and long fractions.

use kardan_rt::functions::powi;

use super::model::FRACTION;
use super::text::figure;

/// A part of a text.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Piece<'a> {
    /// Plain text.
    Plain(&'a str),
    /// Text between backticks.
    Code(&'a str),
    /// A fraction of integers and its truncated decimals.
    Fraction(&'a str, String),
}

/// Digits of a fraction that is too long to be read.
const DIGITS: usize = 6;

/// The parts of a text, in order.
pub(super) fn pieces(text: &str) -> Vec<Piece<'_>> {
    let mut out = Vec::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('`') {
        let Some((code, after)) = after.split_once('`').filter(|(code, _)| !code.trim().is_empty()) else { break };
        fractions(before, &mut out);
        out.push(Piece::Code(code));
        rest = after;
    }
    fractions(rest, &mut out);
    out
}

/// A text whose long fractions are decimals: `s^2 + 811376… s`.
pub(super) fn rounded(text: &str) -> String {
    let mut out = Vec::new();
    fractions(text, &mut out);
    let plain = |piece: &Piece| match piece {
        Piece::Plain(text) | Piece::Code(text) => (*text).to_owned(),
        Piece::Fraction(_, decimals) => decimals.clone(),
    };
    out.iter().map(plain).collect()
}

fn fractions<'a>(text: &'a str, out: &mut Vec<Piece<'a>>) {
    let part = |c: char| c.is_ascii_digit() || c == '/';
    let mut plain_start = 0;
    let mut from = 0;
    while let Some(found) = text[from..].find(|c: char| c.is_ascii_digit()) {
        let begin = from + found;
        let end = text[begin..].find(|c| !part(c)).map_or(text.len(), |length| begin + length);
        // A slash within a name, a decimal or a path is not a fraction.
        let is_boundary = |c: Option<char>| c.is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != '/');
        let point = |c: Option<char>| c == Some('.');
        let before = text[..begin].chars().next_back();
        let after = text[end..].chars().next();
        let decimal = point(before) || point(after) && text[end + 1..].starts_with(|c: char| c.is_ascii_digit());
        if is_boundary(before)
            && is_boundary(after)
            && !decimal
            && let Some(value) = value(&text[begin..end])
        {
            if begin > plain_start {
                out.push(Piece::Plain(&text[plain_start..begin]));
            }
            out.push(Piece::Fraction(&text[begin..end], format!("{}…", figure(value, DIGITS))));
            plain_start = end;
        }
        from = end;
    }
    if plain_start < text.len() {
        out.push(Piece::Plain(&text[plain_start..]));
    }
}

/// The value of a fraction that is too long to be read and whose decimals do not end soon.
fn value(fraction: &str) -> Option<f64> {
    if fraction.len() <= FRACTION {
        return None;
    }
    let (numerator, denominator) = fraction.split_once('/')?;
    let ((above, more), (below, less)) = (leading(numerator)?, leading(denominator)?);
    let value = above / below * powi(10.0, more - less);
    (below > 0.0 && value.is_finite() && value > 0.0).then_some(value)
}

/// The number as its first digits and the power of ten that goes with them: whole numbers may be longer than `f64` reaches.
fn leading(digits: &str) -> Option<(f64, i32)> {
    let read = digits.get(..digits.len().min(20))?;
    Some((read.parse().ok()?, i32::try_from(digits.len() - read.len()).ok()?))
}

#[cfg(test)]
#[path = "../tests/unit/prose.rs"]
mod tests;
