//! Lists whose entries are found by their names in one step, however long they are.

use std::collections::HashMap;
use std::fmt;
use std::ops::{Deref, DerefMut};

/// An entry with a name.
pub trait HasName {
    /// The name.
    fn name(&self) -> &str;
}

impl HasName for String {
    fn name(&self) -> &str {
        self
    }
}

/// Something behind its name.
impl<N: HasName, T> HasName for (N, T) {
    fn name(&self) -> &str {
        self.0.name()
    }
}

/// Entries in their order, which are found by their names. Several may have one name.
///
/// ```
/// use kardan_math::names::{HasName, NamedList};
/// struct Shaft(&'static str);
/// impl HasName for Shaft {
///     fn name(&self) -> &str {
///         self.0
///     }
/// }
/// let list: NamedList<Shaft> = ["wg", "fs"].map(Shaft).into_iter().collect();
/// assert!(list.has("fs") && list.get("rk").is_none() && list.len() == 2);
/// ```
#[derive(Clone, PartialEq)]
pub struct NamedList<T> {
    list: Vec<T>,
    /// The positions of the entries of each name, for a list longer than [`LINEAR_SEARCH_LIMIT`].
    places: HashMap<Box<str>, Vec<usize>>,
}

/// Up to this number a linear search is faster than building a table.
const LINEAR_SEARCH_LIMIT: usize = 8;

impl<T: HasName> NamedList<T> {
    /// The first entry of a name.
    pub fn get(&self, name: &str) -> Option<&T> {
        self.position(name).map(|place| &self.list[place])
    }

    /// The same, to change it; not its name.
    pub fn get_mut(&mut self, name: &str) -> Option<&mut T> {
        self.position(name).map(|place| &mut self.list[place])
    }

    /// The position of the first entry of a name.
    pub fn position(&self, name: &str) -> Option<usize> {
        match self.list.len() {
            0..=LINEAR_SEARCH_LIMIT => self.list.iter().position(|entry| entry.name() == name),
            _ => self.places.get(name).map(|places| places[0]),
        }
    }

    /// Whether there is an entry of a name.
    pub fn has(&self, name: &str) -> bool {
        self.position(name).is_some()
    }

    /// All entries of a name.
    pub fn all(&self, name: &str) -> impl Iterator<Item = &T> {
        let short = if self.list.len() <= LINEAR_SEARCH_LIMIT { &self.list[..] } else { &[] };
        let many = self.places.get(name).map_or(&[][..], Vec::as_slice);
        short.iter().filter(move |entry| entry.name() == name).chain(many.iter().map(|place| &self.list[*place]))
    }

    /// The entries alone.
    pub fn into_vec(self) -> Vec<T> {
        self.list
    }

    /// Adds an entry after the others.
    pub fn push(&mut self, entry: T) {
        self.list.push(entry);
        let first = if self.list.len() == LINEAR_SEARCH_LIMIT + 1 { 0 } else { self.list.len() - 1 };
        self.enter(first);
    }

    /// Retains the entries that satisfy a predicate.
    pub fn retain(&mut self, predicate: impl FnMut(&T) -> bool) {
        self.list.retain(predicate);
        self.places.clear();
        self.enter(0);
    }

    /// Records the positions of the entries from one on.
    fn enter(&mut self, first: usize) {
        if self.list.len() <= LINEAR_SEARCH_LIMIT {
            return;
        }
        for place in first..self.list.len() {
            let name = self.list[place].name();
            match self.places.get_mut(name) {
                Some(places) => places.push(place),
                None => drop(self.places.insert(name.into(), vec![place])),
            }
        }
    }
}

impl<T> Deref for NamedList<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.list
    }
}

/// Entries may change, but for their names.
impl<T> DerefMut for NamedList<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.list
    }
}

impl<T> Default for NamedList<T> {
    fn default() -> Self {
        Self { list: Vec::new(), places: HashMap::new() }
    }
}

impl<T: fmt::Debug> fmt::Debug for NamedList<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.list.fmt(f)
    }
}

impl<T: HasName> Extend<T> for NamedList<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, entries: I) {
        entries.into_iter().for_each(|entry| self.push(entry));
    }
}

impl<T: HasName> FromIterator<T> for NamedList<T> {
    fn from_iter<I: IntoIterator<Item = T>>(entries: I) -> Self {
        let mut list = Self::default();
        list.extend(entries);
        list
    }
}

impl<'a, T> IntoIterator for &'a NamedList<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.list.iter()
    }
}

#[cfg(test)]
#[path = "../../tests/unit/names/list.rs"]
mod tests;
