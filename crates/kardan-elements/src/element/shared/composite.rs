//! The generator of a composite element, such as a car or a driver: names of its parts, and their tables.

use kardan_schema::entries::{Entries, RawValue};

/// A composite element: its name and its keys.
pub(in crate::element) struct Composite<'a> {
    pub(in crate::element) name: &'a str,
    pub(in crate::element) entries: &'a Entries,
}

/// A name in the syntax of expressions.
pub fn quoted(name: &str) -> String {
    if name.contains('-') { format!("'{name}'") } else { name.to_string() }
}

impl Composite<'_> {
    pub(in crate::element) fn has(&self, key: &str) -> bool {
        self.entries.keyed(key).is_some()
    }

    /// A number of the element, by its name in expressions.
    pub(in crate::element) fn own(&self, key: &str) -> String {
        quoted(&format!("{}.{key}", self.name))
    }

    /// The name of a part.
    pub(in crate::element) fn part(&self, part: &str) -> String {
        format!("{}_{part}", self.name)
    }

    /// A coordinate of a part, or its rate.
    pub(in crate::element) fn of(&self, part: &str, quantity: &str) -> String {
        quoted(&format!("{}_{part}.{quantity}", self.name))
    }

    /// The expression of a key.
    pub(in crate::element) fn formula(&self, key: &str) -> Option<String> {
        self.entries.get(key)?.factor()
    }

    /// Adds the table of a part.
    pub(in crate::element) fn add(&self, out: &mut Entries, kind: &str, part: &str, keys: &[(&str, String)]) {
        let table = Entries::of_texts(keys.iter().cloned());
        out.table_mut(kind).set(&self.part(part), RawValue::Table(table));
    }

    /// A force along a direction: coefficients of parts.
    pub(in crate::element) fn push(&self, out: &mut Entries, part: &str, direction: &[(&str, String)], law: String) {
        let coefficients = Entries::of_texts(direction.iter().map(|(body, text)| (self.part(body), text)));
        let mut table = Entries::default();
        table.set("coefficients", RawValue::Table(coefficients));
        table.set("law", RawValue::Text(law));
        out.table_mut("torque").set(&self.part(part), RawValue::Table(table));
    }

    /// A shared formula of laws, blocks and programs.
    pub(in crate::element) fn share(&self, out: &mut Entries, name: &str, value: String) {
        let table = Entries::of_texts([("kind", "expression".to_string()), ("value", value)]);
        out.table_mut("signal").set(&format!("{}.{name}", self.name), RawValue::Table(table));
    }
}
