//! Entries to the text of a model file.

use std::fmt::Write;

use toml_writer::TomlWrite;

use crate::entries::{Entries, KeyedEntry, RawValue};
use kardan_math::units::format_quantity;

/// Longer tables of numbers and texts are written below a header of their own, not in one line.
const LINE: usize = 100;

/// Writes entries as the text of a model file; reading it gives the same entries again.
///
/// ```
/// use kardan_schema::file::{syntax, to_toml};
/// let source = "[shaft.wg]\ninertia = \"130 kg mm^2\"\n\n[[scenario.event]]\nat = \"1 s\"\n";
/// assert_eq!(to_toml(&syntax(source).0), source);
/// ```
pub fn to_toml(entries: &Entries) -> String {
    let mut out = String::new();
    table(entries, &[], &mut out);
    out
}

/// A value as in a file.
pub fn value_to_toml(raw: &RawValue) -> String {
    let mut out = String::new();
    value(raw, &mut out);
    out
}

/// Writes the keys of a table, then the tables below it.
fn table(entries: &Entries, path: &[&str], out: &mut String) {
    let (below, keys): (Vec<_>, Vec<_>) = entries.iter().partition(|entry| has_header(entry, entries, path.len()));
    for entry in keys {
        key(&entry.key, out);
        out.push_str(" = ");
        value(&entry.entry.value, out);
        out.push('\n');
    }
    for entry in below {
        let path = [path, &[entry.key.as_str()]].concat();
        match &entry.entry.value {
            RawValue::List(list) => {
                for one in list {
                    header(&path, ["[[", "]]"], out);
                    if let RawValue::Table(inner) = &one.value {
                        table(inner, &path, out);
                    }
                }
            }
            RawValue::Table(inner) => {
                // A table of tables alone needs no header of its own.
                if inner.is_empty() || inner.iter().any(|entry| !has_header(entry, inner, path.len())) {
                    header(&path, ["[", "]"], out);
                }
                table(inner, &path, out);
            }
            _ => {}
        }
    }
}

/// Whether an entry of a table at this depth is written below a header, not in one line.
fn has_header(entry: &KeyedEntry, among: &Entries, depth: usize) -> bool {
    let is_table = |raw: &RawValue| matches!(raw, RawValue::Table(_));
    match &entry.entry.value {
        RawValue::Table(inner) => {
            let named = depth == 1 && among.iter().all(|entry| is_table(&entry.entry.value));
            let nested = |raw: &RawValue| match raw {
                RawValue::List(list) => list.iter().any(|entry| is_table(&entry.value)),
                other => is_table(other),
            };
            depth == 0
                || named
                || inner.iter().any(|entry| nested(&entry.entry.value))
                || length(&entry.entry.value) > LINE
        }
        RawValue::List(list) => !list.is_empty() && list.iter().all(|entry| is_table(&entry.value)),
        _ => false,
    }
}

fn length(raw: &RawValue) -> usize {
    value_to_toml(raw).len()
}

fn header(path: &[&str], [open, close]: [&str; 2], out: &mut String) {
    if !out.is_empty() {
        out.push('\n');
    }
    out.push_str(open);
    for (number, part) in path.iter().enumerate() {
        if number > 0 {
            out.push('.');
        }
        key(part, out);
    }
    out.push_str(close);
    out.push('\n');
}

// Writing into a text cannot fail.
fn key(text: &str, out: &mut String) {
    let _ = out.key(text);
}

fn value(raw: &RawValue, out: &mut String) {
    match raw {
        RawValue::Text(text) => drop(out.value(text.as_str())),
        RawValue::Number(text) | RawValue::Other(_, text) => out.push_str(text),
        RawValue::Quantity(number, dimension) => drop(out.value(format_quantity(number, *dimension).as_str())),
        RawValue::Broken => out.push_str("\"\""),
        RawValue::List(list) => {
            out.push('[');
            for (number, entry) in list.iter().enumerate() {
                if number > 0 {
                    out.push_str(", ");
                }
                value(&entry.value, out);
            }
            out.push(']');
        }
        RawValue::Table(table) => {
            out.push('{');
            for (number, entry) in table.iter().enumerate() {
                out.push_str(if number > 0 { ", " } else { " " });
                key(&entry.key, out);
                let _ = write!(out, " = ");
                value(&entry.entry.value, out);
            }
            out.push_str(if table.is_empty() { "}" } else { " }" });
        }
    }
}
