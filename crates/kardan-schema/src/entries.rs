//! The source form of a model: a tree of keys and values, from a file or from a program.
//!
//! [`Entries`] contain the whole model, each value with its [`Place`]. Files become entries in
//! [`file`](crate::file), typed tables of a program in [`schema`](crate::schema); later code does not distinguish the two.

use std::ops::Range;
use std::sync::Arc;

use kardan_math::names::{HasName, NamedList};
use kardan_math::units::{Dimension, Exact, format_quantity};

/// The place of an entry: in a text, or at a path in a model that a program built.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Place {
    /// Byte range in the text of the file.
    Text(Range<usize>),
    /// The keys that lead to it: `control.column.channels[1].output`.
    Path(Arc<str>),
}

impl Default for Place {
    fn default() -> Self {
        Self::Text(0..0)
    }
}

impl From<Range<usize>> for Place {
    fn from(span: Range<usize>) -> Self {
        Self::Text(span)
    }
}

impl From<&Place> for Place {
    fn from(place: &Place) -> Self {
        place.clone()
    }
}

impl Place {
    /// That of an entry of a program before [`Entries::assign_places`].
    pub fn unsettled() -> Self {
        Self::Path(Arc::from(""))
    }

    /// The byte range in the text; empty at the start for an entry without text.
    pub fn span(&self) -> Range<usize> {
        match self {
            Self::Text(span) => span.clone(),
            Self::Path(_) => 0..0,
        }
    }

    /// Where it begins in the text, to report the errors of a file in order.
    pub fn start(&self) -> usize {
        self.span().start
    }

    /// The path of an entry that a program made.
    pub fn path(&self) -> Option<&str> {
        match self {
            Self::Text(_) => None,
            Self::Path(path) => Some(path),
        }
    }

    /// The place of a value without its quotes.
    pub fn inside(&self, value: &str) -> Self {
        self.part(value, 0..value.len())
    }

    /// The place of a part of a value, where the bytes of the value are those of the file, in quotes or not.
    pub fn part(&self, value: &str, part: Range<usize>) -> Self {
        match self {
            Self::Text(span) if !part.is_empty() => match span.len().checked_sub(value.len()) {
                Some(quotes @ (0 | 2)) => {
                    let start = span.start + quotes / 2;
                    Self::Text(start + part.start..start + part.end)
                }
                _ => self.clone(),
            },
            _ => self.clone(),
        }
    }
}

/// A value with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The value.
    pub value: RawValue,
    /// Where: of a table its header, or all of an inline table.
    pub place: Place,
}

/// A value as it is written.
#[derive(Debug, Clone, PartialEq)]
pub enum RawValue {
    /// A text, without its quotes.
    Text(String),
    /// A decimal number, as its digits are written.
    Number(String),
    /// A quantity that a program computed.
    Quantity(Exact, Dimension),
    /// A list.
    List(Vec<Entry>),
    /// A table.
    Table(Entries),
    /// A type that no model uses: its name, and its source text.
    Other(&'static str, String),
    /// An unreadable value; it has been reported.
    Broken,
}

impl RawValue {
    /// The text that it is.
    pub fn as_text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    /// The table that it is.
    pub fn as_table(&self) -> Option<&Entries> {
        if let Self::Table(table) = self { Some(table) } else { None }
    }

    /// The same with all its content at a place.
    #[must_use]
    pub fn placed(&self, place: &Place) -> Self {
        let entry = |entry: &Entry| Entry { value: entry.value.placed(place), place: place.clone() };
        match self {
            Self::Table(table) => {
                Self::Table(table.iter().map(|found| KeyedEntry::at(&found.key, &found.entry.value, place)).collect())
            }
            Self::List(list) => Self::List(list.iter().map(entry).collect()),
            other => other.clone(),
        }
    }

    /// Calls a function with each text within.
    pub fn each_text(&self, visit: &mut impl FnMut(&str)) {
        match self {
            Self::Text(text) => visit(text),
            Self::Table(table) => table.iter().for_each(|found| found.entry.value.each_text(visit)),
            Self::List(list) => list.iter().for_each(|entry| entry.value.each_text(visit)),
            _ => {}
        }
    }

    /// The expression that it is, as a part of others.
    pub fn factor(&self) -> Option<String> {
        match self {
            Self::Text(text) | Self::Number(text) => Some(format!("({text})")),
            Self::Quantity(value, dimension) => Some(format_quantity(value, *dimension)),
            _ => None,
        }
    }
}

/// A key with its value.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyedEntry {
    /// The key.
    pub key: String,
    /// Place of the key.
    pub place: Place,
    /// Its value.
    pub entry: Entry,
}

impl KeyedEntry {
    /// A key and its value, with all its content, at a place.
    pub fn at(key: &str, value: &RawValue, place: &Place) -> Self {
        Self {
            key: key.into(),
            place: place.clone(),
            entry: Entry { value: value.placed(place), place: place.clone() },
        }
    }
}

/// A table: keys with values, in the order in which they were written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Entries {
    list: NamedList<KeyedEntry>,
}

impl HasName for KeyedEntry {
    fn name(&self) -> &str {
        &self.key
    }
}

impl Entries {
    /// The entries in order.
    pub fn iter(&self) -> impl Iterator<Item = &KeyedEntry> {
        self.list.iter()
    }

    /// Whether it is empty.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The entry of a key.
    pub fn keyed(&self, key: &str) -> Option<&KeyedEntry> {
        self.list.get(key)
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&RawValue> {
        self.keyed(key).map(|entry| &entry.entry.value)
    }

    /// The table of a key.
    pub fn table(&self, key: &str) -> Option<&Entries> {
        self.get(key)?.as_table()
    }

    /// The text of a key.
    pub fn text(&self, key: &str) -> Option<&str> {
        self.get(key)?.as_text()
    }

    /// The entries of the table of a key; none if it is no table.
    pub fn entries_of(&self, key: &str) -> impl Iterator<Item = &KeyedEntry> + Clone {
        self.table(key).into_iter().flat_map(|table| table.list.iter())
    }

    /// The tables in the table of a key, each with its entry.
    pub fn tables_of(&self, key: &str) -> impl Iterator<Item = (&KeyedEntry, &Entries)> + Clone {
        self.entries_of(key).filter_map(|found| Some((found, found.entry.value.as_table()?)))
    }

    /// A table of texts, as a program makes it.
    pub fn of_texts<K: AsRef<str>, T: Into<String>>(texts: impl IntoIterator<Item = (K, T)>) -> Self {
        let mut out = Self::default();
        texts.into_iter().for_each(|(key, text)| out.set(key.as_ref(), RawValue::Text(text.into())));
        out
    }

    /// Adds an entry after the others.
    pub fn push(&mut self, entry: KeyedEntry) {
        self.list.push(entry);
    }

    /// Sets a key, in its place if it exists; the entry comes from a program, and [`Entries::assign_places`] sets its place.
    pub fn set(&mut self, key: &str, value: RawValue) {
        let new = KeyedEntry { key: key.into(), place: Place::unsettled(), entry: Entry::from(value) };
        match self.list.get_mut(key) {
            Some(entry) => *entry = new,
            None => self.list.push(new),
        }
    }

    /// The table of a key, created if missing.
    pub fn table_mut(&mut self, key: &str) -> &mut Entries {
        if self.table(key).is_none() {
            self.set(key, RawValue::Table(Entries::default()));
        }
        let found = self.list.get_mut(key).map(|entry| &mut entry.entry.value);
        match found {
            Some(RawValue::Table(table)) => table,
            _ => unreachable!("the table was made above"),
        }
    }

    /// The list of a key, created if missing. A single table is a list of one.
    pub fn list_mut(&mut self, key: &str) -> &mut Vec<Entry> {
        if self.get(key).is_none() {
            self.set(key, RawValue::List(Vec::new()));
        }
        let found = self.list.get_mut(key).map(|entry| &mut entry.entry);
        let Some(entry) = found else { unreachable!("the entry was made above") };
        if !matches!(entry.value, RawValue::List(_)) {
            let value = std::mem::replace(&mut entry.value, RawValue::Broken);
            entry.value = RawValue::List(vec![Entry { value, place: entry.place.clone() }]);
        }
        match &mut entry.value {
            RawValue::List(list) => list,
            _ => unreachable!("the list was made above"),
        }
    }

    /// Removes a key.
    pub fn remove(&mut self, key: &str) {
        self.list.retain(|entry| entry.key != key);
    }

    /// Sets the places of the entries of a program.
    pub fn assign_places(&mut self) {
        assign_table_places(self, "");
    }

    /// Whether both are equal, regardless of places and the order of keys.
    pub fn same_as(&self, other: &Entries) -> bool {
        let same = |a: &KeyedEntry| other.get(&a.key).is_some_and(|b| same_value(&a.entry.value, b));
        self.list.len() == other.list.len() && self.list.iter().all(same)
    }
}

fn same_value(a: &RawValue, b: &RawValue) -> bool {
    match (a, b) {
        (RawValue::List(a), RawValue::List(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same_value(&a.value, &b.value))
        }
        (RawValue::Table(a), RawValue::Table(b)) => a.same_as(b),
        (a, b) => a == b,
    }
}

fn assign_table_places(table: &mut Entries, path: &str) {
    for entry in table.list.iter_mut() {
        let key = if entry.key.contains(['.', '"']) { format!("{:?}", entry.key) } else { entry.key.clone() };
        let path = if path.is_empty() { key } else { format!("{path}.{key}") };
        if entry.place.path() == Some("") {
            entry.place = Place::Path(Arc::from(path.as_str()));
        }
        assign_entry_places(&mut entry.entry, &path);
    }
}

fn assign_entry_places(entry: &mut Entry, path: &str) {
    if entry.place.path() == Some("") {
        entry.place = Place::Path(Arc::from(path));
    }
    match &mut entry.value {
        RawValue::Table(table) => assign_table_places(table, path),
        RawValue::List(list) => {
            for (number, entry) in list.iter_mut().enumerate() {
                assign_entry_places(entry, &format!("{path}[{number}]"));
            }
        }
        _ => {}
    }
}

impl FromIterator<KeyedEntry> for Entries {
    fn from_iter<I: IntoIterator<Item = KeyedEntry>>(entries: I) -> Self {
        Self { list: entries.into_iter().collect() }
    }
}

impl From<RawValue> for Entry {
    /// An entry of a program.
    fn from(value: RawValue) -> Self {
        Self { value, place: Place::unsettled() }
    }
}
