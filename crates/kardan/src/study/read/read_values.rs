//! Reading quantities and names from the tables of a study.

use kardan_math::units::{Dimension, Exact};
use kardan_model::TableReader;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::{Placed, Scalar as SchemaScalar, Sign, Table, Value};

pub(in crate::study) fn read_scalar(table: &Table, key: &str) -> Option<Placed<SchemaScalar>> {
    match table.values.get(key) {
        Some(Placed { value: Value::Scalar(scalar), place }) => {
            Some(Placed { value: scalar.clone(), place: place.clone() })
        }
        Some(_) => None,
        None => table.default_scalar(key).map(|value| Placed { value, place: table.place.clone() }),
    }
}

pub(in crate::study) fn read_word<'a>(table: &'a Table, key: &str) -> Option<&'a str> {
    match table.values.get(key) {
        Some(Placed { value: Value::Word(word), .. }) => Some(word.as_str()),
        Some(_) => None,
        None => table.default_word(key),
    }
}

pub(in crate::study) fn read_names<'a>(table: &'a Table, key: &str) -> &'a [Placed<String>] {
    table.values.get(key).map_or(&[], |spanned| match &spanned.value {
        Value::Names(names) => names,
        _ => &[],
    })
}

/// The tables of a key; none if it is absent or unreadable.
pub(in crate::study) fn read_tables<'a>(table: &'a Table, key: &str) -> &'a [Table] {
    match table.values.get(key).map(|found| &found.value) {
        Some(Value::Tables(tables)) => tables,
        _ => &[],
    }
}

/// A name and its value.
pub(in crate::study) type Entry = (Placed<String>, Placed<SchemaScalar>);

/// The entries of a key from names to values; none if it is absent or unreadable.
pub(in crate::study) fn read_map<'a>(table: &'a Table, key: &str) -> &'a [Entry] {
    match table.values.get(key).map(|found| &found.value) {
        Some(Value::Map(entries)) => entries,
        _ => &[],
    }
}

/// Whether the file has a key, even if its value is unreadable.
pub(in crate::study) fn is_given(table: &Table, key: &str) -> bool {
    table.values.contains_key(key) || table.unread.contains(&key)
}

/// An error at the value of a key of a table.
pub(in crate::study) fn key_error(
    code: &'static str,
    message: String,
    (table, key, label): (&Table, &str, &str),
    help: impl Into<String>,
) -> Diagnostic {
    Diagnostic::error(code, message).at(TableReader::place(table, key), label).help(help)
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
    let scalar = read_scalar(table, key)?;
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
    let scalar = read_scalar(table, key)?;
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
        let message = format!("{label}: expected {}, found {}", dimension.noun(), found.noun());
        out.push(
            Diagnostic::error("unit::dimension", message)
                .at(scalar.place.clone(), found.noun())
                .help(format!("write a unit such as {}", dimension.example())),
        );
        return None;
    }
    Some(value)
}
