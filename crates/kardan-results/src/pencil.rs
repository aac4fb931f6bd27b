//! Named sparse matrices of a system.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::serial::by_name;

/// An entry of a sparse matrix.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "(usize, usize, String)")]
pub struct Entry {
    /// Its row, from 0.
    pub row: usize,
    /// Its column, from 0.
    pub column: usize,
    /// Its value, a fraction.
    pub value: String,
}

/// A sparse matrix with a name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SparseMatrix {
    /// `E`, `A`, `B`, `C` or `D`.
    pub name: String,
    /// Its entries that are not zero.
    pub entries: Vec<Entry>,
}

impl From<Entry> for (usize, usize, String) {
    fn from(entry: Entry) -> Self {
        (entry.row, entry.column, entry.value)
    }
}

/// As a map from the name to the entries.
pub(super) fn named<S: Serializer>(all: &[SparseMatrix], to: S) -> Result<S::Ok, S::Error> {
    by_name(all.iter().map(|one| (one.name.as_str(), &one.entries)), to)
}
