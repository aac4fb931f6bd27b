//! The text of a model file to entries.

use std::ops::Range;

use toml::Spanned as Toml;
use toml::de::{DeTable, DeValue};

use crate::diagnostics::{Diagnostic, shortened};
use crate::entries::{Entries, Entry, KeyedEntry, RawValue};
use kardan_math::units::parse_quantity;

/// Reads the text of a model file as TOML; broken parts are reported, the rest is returned.
///
/// # Errors
///
/// One diagnostic `toml::syntax` for each line that is not TOML. A value without quotes is read as if it had them.
///
/// ```
/// use kardan_schema::file::syntax;
/// let (entries, diagnostics) = syntax("inertia = 130 kg mm^2\n");
/// assert!(entries.get("inertia").is_some());
/// assert_eq!(diagnostics[0].help.as_deref(), Some("write \"130 kg mm^2\""));
/// assert_eq!(syntax("mu = 0,8\n").1[0].help.as_deref(), Some("write \"0.8\", with a decimal point"));
/// ```
pub fn syntax(source: &str) -> (Entries, Vec<Diagnostic>) {
    let (document, errors) = DeTable::parse_recoverable(source);
    let mut errors: Vec<(Range<usize>, &str)> =
        errors.iter().map(|error| (error.span().unwrap_or(0..0), error.message())).collect();
    errors.sort_by_key(|(span, _)| (span.start, span.end));
    // Later errors of a line are mostly consequences of its first.
    let line =
        |span: &Range<usize>| source.as_bytes()[..span.start.min(source.len())].iter().filter(|b| **b == b'\n').count();
    errors.dedup_by_key(|(span, _)| line(span));
    let diagnostics = errors.into_iter().map(|(span, message)| {
        let text = source.get(span.clone()).unwrap_or("").trim();
        let start = source[..span.start.min(source.len())].rfind('\n').map_or(0, |at| at + 1);
        let line = source[start..].lines().next().unwrap_or("").split('#').next().unwrap_or("").trim();
        let (message, help) = if message.starts_with("string values must be quoted") {
            match text {
                "" => {
                    ("a key without a value".to_string(), "write a value after the `=`, or remove the key".to_string())
                }
                _ => {
                    ("text without quotes".to_string(), with_point(line).unwrap_or_else(|| format!("write \"{text}\"")))
                }
            }
        } else if message.starts_with("duplicate key") {
            ("a duplicate key".to_string(), "remove one of the two".to_string())
        } else {
            let help = match message {
                m if m.starts_with("unclosed table") => format!("write `{}]`", shortened(line)),
                m if m.starts_with("unclosed array table") => {
                    format!("write `{}]]`", shortened(line).trim_end_matches(']'))
                }
                m if m.contains("string, expected") => "end the text with the quote it begins with".to_string(),
                m if m.starts_with("key with no value") => "write it as `key = value`".to_string(),
                m if m.contains("recurse") => "model files do not nest that deeply".to_string(),
                _ => with_point(line)
                    .unwrap_or_else(|| "see https://toml.io for how a file of keys and values is written".to_string()),
            };
            (message.to_string(), help)
        };
        Diagnostic::error("toml::syntax", format!("this is not TOML: {message}")).at(span, "").help(help)
    });
    let diagnostics = diagnostics.collect();
    (table(document.get_ref()), diagnostics)
}

/// The suggested value of a line, if it is a number with a decimal comma.
fn with_point(line: &str) -> Option<String> {
    let diagnostic = parse_quantity(line.split_once('=')?.1.trim()).err()?;
    diagnostic.help.filter(|_| diagnostic.message.starts_with("unexpected `,`"))
}

/// A table of the reader as entries, in the order of the file.
fn table(read: &DeTable<'_>) -> Entries {
    let mut list: Vec<KeyedEntry> = read
        .iter()
        .map(|(key, value)| KeyedEntry {
            key: key.get_ref().to_string(),
            place: key.span().into(),
            entry: entry(value),
        })
        .collect();
    list.sort_by_key(|entry| entry.place.span().start);
    list.into_iter().collect()
}

fn entry(read: &Toml<DeValue<'_>>) -> Entry {
    let value = match read.get_ref() {
        // The reader's substitute for a broken value.
        _ if read.span().is_empty() => RawValue::Broken,
        DeValue::String(text) => RawValue::Text(text.to_string()),
        DeValue::Integer(number) if number.radix() == 10 => RawValue::Number(number.as_str().into()),
        DeValue::Float(number) => RawValue::Number(number.as_str().into()),
        DeValue::Integer(number) => RawValue::Other("a number", number.to_string()),
        DeValue::Boolean(flag) => RawValue::Other("a boolean", flag.to_string()),
        DeValue::Datetime(time) => RawValue::Other("a date or time", time.to_string()),
        DeValue::Array(list) => RawValue::List(list.iter().map(entry).collect()),
        DeValue::Table(inner) => RawValue::Table(table(inner)),
    };
    Entry { value, place: read.span().into() }
}
