//! What an element is: its keys, its checks and the terms that it stands for.

use super::values::Values;
use crate::equations::Term;
use crate::names::Quantity;
use crate::results::Symbol;
use crate::schema::{Field, Kind};
use crate::units::Dimension;

/// The description of a kind of element.
#[derive(Debug, Clone, Copy)]
pub struct Element {
    /// The word in the model file, the name of the file here, and of the manual page.
    pub keyword: &'static str,
    /// What it is, in one sentence.
    pub summary: &'static str,
    /// Sketch with positive directions.
    pub sketch: &'static str,
    /// The sign convention in one sentence.
    pub signs: &'static str,
    /// How it is drawn.
    pub symbol: Symbol,
    /// Its keys.
    pub fields: &'static [Field],
    /// An example, valid TOML.
    pub example: &'static str,
    /// Checks that concern several keys at once: `(key, message, help)` for each mistake.
    pub check: fn(&Values) -> Vec<KeyError>,
    /// The terms it stands for.
    pub terms: fn(name: &str, values: &Values) -> Vec<Term>,
}

/// A mistake found by an element's own check.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyError {
    /// The key to point at; the header if it is absent from the table.
    pub key: &'static str,
    /// What is wrong and why.
    pub message: String,
    /// What to do.
    pub help: String,
}

impl Element {
    /// The charges that an element of that name introduces as coordinates, whatever its values.
    pub fn charges(&self, name: &str) -> Vec<String> {
        let terms = (self.terms)(name, &Values::default());
        let charge = |term| if let Term::Charge { name } = term { Some(name) } else { None };
        terms.into_iter().filter_map(charge).collect()
    }

    /// The signal that events set where the key `current` is left out; nothing of what has none.
    pub fn signal_of_events(&self, name: &str) -> Option<String> {
        let current = self.fields.iter().find(|field| field.kind == Kind::OfTime(Dimension::CURRENT))?;
        (!current.required).then(|| Quantity::Current.of(name))
    }

    /// Its keys that name nodes.
    pub fn node_keys(&self) -> impl Iterator<Item = &'static str> {
        self.fields.iter().filter(|field| field.kind == Kind::Node).map(|field| field.name)
    }
}

impl KeyError {
    pub(in crate::element) fn new(key: &'static str, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { key, message: message.into(), help: help.into() }
    }
}
