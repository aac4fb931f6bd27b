//! A struct of keys: the list of [`Field`]s that parser, checks and manual read, and the table that it writes.

use crate::entries::Entries;
use crate::schema::field::Field;

/// The keys of a table.
pub trait Keys: Clone + PartialEq + std::fmt::Debug {
    /// Their description for the parser, the checks and the manual.
    const FIELDS: &'static [Field];
    /// The default number of a key, SI; zero for a key without one.
    fn default_number(key: &str) -> f64 {
        let field = Self::FIELDS.iter().find(|field| field.name == key);
        field.and_then(Field::default_number).map_or(0.0, |value| value.to_f64())
    }
    /// The table as it is written.
    fn entries(&self) -> Entries;
    /// The table as it was written; `None` if a key is of another kind, or a required one is missing.
    fn read_entries(entries: &Entries) -> Option<Self>;
}

/// An element: `[keyword.NAME]`.
pub trait ElementKeys: Keys {
    /// The word in the file.
    const KEYWORD: &'static str;
}

/// A signal: `[signal.NAME]` with `kind = "keyword"`.
pub trait SignalKeys: Keys {
    /// The word in the file.
    const KEYWORD: &'static str;
}

/// A block: `[block.NAME]` with `kind = "keyword"`.
pub trait BlockKeys: Keys {
    /// The word in the file.
    const KEYWORD: &'static str;
}

/// A control law: `[control.NAME]` with `law = "keyword"`.
pub trait LawKeys: Keys {
    /// The word in the file.
    const KEYWORD: &'static str;
}
