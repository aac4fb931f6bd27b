//! Characters and cells of text that programs interpret differently.

use std::borrow::Cow;

/// Whether a character is used as the sign of a negative number: the hyphen of a keyboard, the minus U+2212, and the hyphens and
/// dashes that word processors, spreadsheets and keyboards put in its place.
///
/// ```
/// use kardan_tables::is_minus;
/// assert!(['-', '−', '–'].into_iter().all(is_minus) && !is_minus('~'));
/// ```
pub fn is_minus(c: char) -> bool {
    matches!(c, '-' | '\u{2010}'..='\u{2015}' | '\u{2212}' | '\u{fe58}' | '\u{fe63}' | '\u{ff0d}')
}

/// The digits of base64 (RFC 4648).
pub(crate) const BASE64: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Whether spreadsheets interpret a text as a formula, without apostrophes before it; numbers are no formulas.
fn is_formula(text: &str) -> bool {
    let text = text.trim_start_matches('\'');
    text.starts_with(['=', '+', '-', '@', '\t', '\r', '＝', '＋', '－', '＠']) && text.parse::<f64>().is_err()
}

/// A text as a cell of a CSV file (RFC 4180): in quotes if required, and after an apostrophe if a spreadsheet would interpret it as
/// a formula and compute it. [`read`](crate::read) removes the apostrophe from the names of columns.
///
/// ```
/// use kardan_tables::write::csv_cell;
/// assert_eq!(csv_cell("rk.phi"), "rk.phi");
/// assert_eq!(csv_cell("=HYPERLINK(\"x\")"), "\"'=HYPERLINK(\"\"x\"\")\"");
/// ```
pub fn csv_cell(text: &str) -> Cow<'_, str> {
    let guarded = if is_formula(text) { Cow::Owned(format!("'{text}")) } else { Cow::Borrowed(text) };
    if guarded.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", guarded.replace('"', "\"\"")).into();
    }
    guarded
}

/// A text without the apostrophe of [`csv_cell`].
pub(crate) fn strip_guard(text: &str) -> &str {
    text.strip_prefix('\'').filter(|rest| is_formula(rest)).unwrap_or(text)
}

#[cfg(test)]
#[path = "../tests/unit/text.rs"]
mod tests;
