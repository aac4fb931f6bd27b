//! Entries to the text of a model file.

use std::fmt::Write;

use toml_writer::TomlWrite;

use crate::entries::{Entries, KeyedEntry, Written};
use crate::units::written_quantity;

/// Longer tables of numbers and texts are written below a header of their own, not in one line.
const LINE: usize = 100;

/// Writes entries as the text of a model file; reading it gives the same entries again.
///
/// ```
/// use kardan::file::{syntax, to_toml};
/// let source = "[shaft.wg]\ninertia = \"130 kg mm^2\"\n\n[[scenario.event]]\nat = \"1 s\"\n";
/// assert_eq!(to_toml(&syntax(source).0), source);
/// ```
pub fn to_toml(entries: &Entries) -> String {
    let mut out = String::new();
    table(entries, &[], &mut out);
    out
}

/// A value as it stands in a file.
pub fn value_to_toml(written: &Written) -> String {
    let mut out = String::new();
    value(written, &mut out);
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
            Written::List(list) => {
                for one in list {
                    header(&path, ["[[", "]]"], out);
                    if let Written::Table(inner) = &one.value {
                        table(inner, &path, out);
                    }
                }
            }
            Written::Table(inner) => {
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
    let is_table = |written: &Written| matches!(written, Written::Table(_));
    match &entry.entry.value {
        Written::Table(inner) => {
            let named = depth == 1 && among.iter().all(|entry| is_table(&entry.entry.value));
            let nested = |written: &Written| match written {
                Written::List(list) => list.iter().any(|entry| is_table(&entry.value)),
                other => is_table(other),
            };
            depth == 0
                || named
                || inner.iter().any(|entry| nested(&entry.entry.value))
                || length(&entry.entry.value) > LINE
        }
        Written::List(list) => !list.is_empty() && list.iter().all(|entry| is_table(&entry.value)),
        _ => false,
    }
}

fn length(written: &Written) -> usize {
    value_to_toml(written).len()
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

fn value(written: &Written, out: &mut String) {
    match written {
        Written::Text(text) => drop(out.value(text.as_str())),
        Written::Number(text) | Written::Other(_, text) => out.push_str(text),
        Written::Quantity(number, dimension) => drop(out.value(written_quantity(number, *dimension).as_str())),
        Written::Broken => out.push_str("\"\""),
        Written::List(list) => {
            out.push('[');
            for (number, entry) in list.iter().enumerate() {
                if number > 0 {
                    out.push_str(", ");
                }
                value(&entry.value, out);
            }
            out.push(']');
        }
        Written::Table(table) => {
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
