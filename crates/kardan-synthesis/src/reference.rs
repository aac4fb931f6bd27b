//! Signals from the scenario to laws.

use kardan_results::Physical;
use kardan_schema::schema::Values;

/// A signal from the scenario to a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Name.
    pub name: String,
    /// Angle or torque.
    pub physical: Physical,
    /// One sentence.
    pub description: String,
}

impl Reference {
    /// The one that a key names, if it is there.
    pub(super) fn of(values: &Values, key: &str, physical: Physical, description: String) -> Option<Self> {
        Some(Self { name: values.word(key)?.into(), physical, description })
    }
}
