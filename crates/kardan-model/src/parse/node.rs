//! The tables of a model, with their names and places.

use super::wording::describe_value;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::{Entries, Entry, KeyedEntry, Place, RawValue};

/// A table of the model with its name and its place.
///
/// ```
/// use kardan_schema::file::syntax;
/// use kardan_model::parse::Node;
/// let (entries, mut diagnostics) = syntax("[[scenario.event]]\ntime = \"1 s\"\n");
/// let scenario = Node::root(&entries).child("scenario", &mut diagnostics).ok_or("no scenario")?;
/// assert!(scenario.list("event", &mut diagnostics)[0].table.get("time").is_some());
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone)]
pub struct Node<'t> {
    /// The key that leads to it; for an entry of a list the key of the list.
    pub name: &'t str,
    /// Place of that key.
    pub name_place: Place,
    /// Place of the header (`[shaft.wg]`), or of the whole of an inline table.
    pub place: Place,
    /// Its keys and values.
    pub table: &'t Entries,
    /// The source of hints.
    pub(crate) hints: HintSource<'t>,
}

/// Sources of suggestions: an example of such a table, and the whole model for its names.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct HintSource<'t> {
    pub example: &'static str,
    pub model: Option<&'t Entries>,
}

impl<'t> Node<'t> {
    /// The model as a whole.
    pub fn root(entries: &'t Entries) -> Self {
        Self {
            name: "",
            name_place: Place::default(),
            place: Place::default(),
            table: entries,
            hints: HintSource { example: "", model: Some(entries) },
        }
    }

    /// The table under a key, if it is there; `type::wrong` is reported if something else is.
    pub fn child(&self, key: &str, out: &mut Vec<Diagnostic>) -> Option<Node<'t>> {
        let keyed = self.table.keyed(key)?;
        self.as_table(keyed, &keyed.entry, out)
    }

    /// All keys as tables, in the order of the file; `type::wrong` is reported for each that is none.
    pub fn children(&self, out: &mut Vec<Diagnostic>) -> Vec<Node<'t>> {
        self.table.iter().filter_map(|keyed| self.as_table(keyed, &keyed.entry, out)).collect()
    }

    /// The tables of the list `[[key]]` (or the single table `[key]`), none if it is not there; `type::wrong` is
    /// reported for each that is no table.
    pub fn list(&self, key: &str, out: &mut Vec<Diagnostic>) -> Vec<Node<'t>> {
        let Some(keyed) = self.table.keyed(key) else { return Vec::new() };
        match &keyed.entry.value {
            RawValue::List(entries) => entries.iter().filter_map(|entry| self.as_table(keyed, entry, out)).collect(),
            _ => self.as_table(keyed, &keyed.entry, out).into_iter().collect(),
        }
    }

    fn as_table(&self, keyed: &'t KeyedEntry, entry: &'t Entry, out: &mut Vec<Diagnostic>) -> Option<Node<'t>> {
        let name = keyed.key.as_str();
        if let RawValue::Table(table) = &entry.value {
            return Some(Node {
                name,
                name_place: keyed.place.clone(),
                place: entry.place.clone(),
                table,
                hints: self.hints,
            });
        }
        let path = if self.name.is_empty() { name.to_string() } else { format!("{}.{name}", self.name) };
        out.push(
            Diagnostic::error(
                "type::wrong",
                format!("`{path}`: expected a table, found {}", describe_value(&entry.value)),
            )
            .at(&entry.place, "not a table")
            .help(format!("write it as `[{path}]` with its keys below")),
        );
        None
    }

    /// With the example of its kind.
    pub(crate) fn like(mut self, example: &'static str) -> Self {
        self.hints.example = example;
        self
    }

    /// A table without a name of its own.
    pub(super) fn unnamed(table: &'t Entries, place: &Place, hints: HintSource<'t>) -> Self {
        Self { name: "", name_place: place.clone(), place: place.clone(), table, hints }
    }
}
