//! Common JSON serialisation of results that differs from their fields.

use std::collections::BTreeSet;

use kardan_math::names::unused;
use schemars::JsonSchema;
use serde::{Serialize, Serializer};

/// Writes an object with these names as keys; duplicate names are distinguished (`K`, `K_2`), so that no entry is lost.
pub fn by_name<'a, S: Serializer, V: Serialize>(
    pairs: impl Iterator<Item = (&'a str, V)>,
    to: S,
) -> Result<S::Ok, S::Error> {
    let mut used_keys = BTreeSet::new();
    to.collect_map(pairs.map(|(name, value)| {
        let key = unused(name, 2, |key| used_keys.contains(key));
        used_keys.insert(key.clone());
        (key, value)
    }))
}

/// Whether all parts are complete.
#[derive(Serialize, JsonSchema)]
pub struct Ending<'a> {
    /// Whether all parts are complete.
    complete: bool,
    /// Why it ended early, and which parts are missing: these are empty. `null` if it is complete.
    incomplete_reason: Option<&'a str>,
}

impl<'a> Ending<'a> {
    /// Complete if there is no reason.
    pub fn of(unfinished: &'a Option<String>) -> Self {
        Self { complete: unfinished.is_none(), incomplete_reason: unfinished.as_deref() }
    }
}

pub(super) fn ending<S: Serializer>(unfinished: &Option<String>, to: S) -> Result<S::Ok, S::Error> {
    Ending::of(unfinished).serialize(to)
}
