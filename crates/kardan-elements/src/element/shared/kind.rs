//! The kind of an element: its keys, its checks and its terms.

use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Domain, Term};
use kardan_results::Symbol;
use kardan_results::signal_name::Quantity;
use kardan_schema::schema::{Field, Kind, Values};

/// The description of a kind of element.
#[derive(Debug, Clone, Copy)]
pub struct Element {
    /// The word in the model file, the name of the file here, and of the manual page.
    pub keyword: &'static str,
    /// Summary in one sentence.
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
    /// Checks of several keys together: `(key, message, help)` for each error.
    pub check: fn(&Values) -> Vec<KeyError>,
    /// The terms that it adds to the model.
    pub terms: fn(name: &str, values: &Values) -> Vec<Term>,
}

/// An error found by an element's own check.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyError {
    /// The key to point at; the header if it is absent from the table.
    pub key: &'static str,
    /// The error and its reason.
    pub message: String,
    /// How to correct it.
    pub help: String,
}

impl Element {
    /// The charges that an element of that name introduces as coordinates, for all values of its keys.
    pub fn charges(&self, name: &str) -> Vec<String> {
        let terms = (self.terms)(name, &Values::default());
        let charge = |term| match term {
            Term::Coordinate { name, domain: Domain::Charge } => Some(name),
            _ => None,
        };
        terms.into_iter().filter_map(charge).collect()
    }

    /// The signal that events set if the key `current` is omitted; none for other elements.
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
    /// At a key, with the reason and the remedy.
    pub fn new(key: &'static str, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { key, message: message.into(), help: help.into() }
    }
}
