//! Reading quantities and names from the tables of a study.

use kardan_math::units::{Dimension, Exact};
use kardan_model::{Document, TableReader};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::{Placed, Scalar as SchemaScalar, Sign, Table};

/// The word of a key, or its default if the key is absent.
pub(in crate::study) fn read_word<'a>(table: &'a Table, key: &str) -> Option<&'a str> {
    if table.values.contains_key(key) { table.word(key) } else { table.default_word(key) }
}

/// A name and its value.
pub(in crate::study) type Entry = (Placed<String>, Placed<SchemaScalar>);

/// Whether the file has a key, even if its value is unreadable.
pub(in crate::study) fn has_key(table: &Table, key: &str) -> bool {
    table.values.contains_key(key) || table.unread.contains(&key)
}

/// A parameter of a value that differs between the variants, if there is one.
pub(in crate::study) fn varied_name<'a>(document: &Document, value: &'a SchemaScalar) -> Option<&'a str> {
    let names = match value {
        SchemaScalar::Parameter(name) => vec![name.as_str()],
        SchemaScalar::Expression(read) => read.names(),
        _ => Vec::new(),
    };
    names.into_iter().find(|name| document.is_varied(name))
}

/// An error at the value of a key of a table.
pub(in crate::study) fn key_error(
    code: &'static str,
    message: impl Into<String>,
    (table, key, label): (&Table, &str, &str),
    help: impl Into<String>,
) -> Diagnostic {
    Diagnostic::error(code, message).at(table.place_of(key), label).help(help)
}

/// A quantity of a table in SI, checked against a dimension and, through parameters, against a sign.
pub(in crate::study) fn quantity(
    reader: &TableReader<'_>,
    table: &Table,
    key: &str,
    (dimension, sign): (Dimension, Sign),
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Exact> {
    let scalar = table.scalar_or_default(key, &table.place)?;
    let label = format!("`{key}` of {what}");
    of_dimension(reader, &scalar, (dimension, sign), &label, out)
}

/// The same of a signal: with or without radians in its unit.
pub(in crate::study) fn quantity_like(
    reader: &TableReader<'_>,
    table: &Table,
    key: &str,
    expected: (Dimension, Sign),
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Exact> {
    let scalar = table.scalar_or_default(key, &table.place)?;
    let label = format!("`{key}` of {what}");
    fitting(reader, &scalar, (expected, Dimension::is_like), &label, out)
}

/// A quantity in SI of one dimension.
pub(in crate::study) fn of_dimension(
    reader: &TableReader<'_>,
    scalar: &Placed<SchemaScalar>,
    expected: (Dimension, Sign),
    label: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Exact> {
    fitting(reader, scalar, (expected, Dimension::eq), label, out)
}

/// Whether a dimension is acceptable in place of another one.
type Fits = fn(&Dimension, &Dimension) -> bool;

fn fitting(
    reader: &TableReader<'_>,
    scalar: &Placed<SchemaScalar>,
    ((dimension, sign), fits): ((Dimension, Sign), Fits),
    label: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Exact> {
    let (value, found) = reader.scalar(scalar, Some((dimension, sign)), label, out)?;
    if !fits(&dimension, &found) {
        out.push(Diagnostic::wrong_dimension(label, [dimension, found], &scalar.place));
        return None;
    }
    Some(value)
}
