//! Kinds of laws, as their registry lists them.

use std::sync::Arc;

use super::{Law, Plant, Reference, SynthesisError, blending_signal};
use kardan_schema::entries::Entries;
use kardan_schema::schema::Field;
use kardan_schema::schema::Values;

/// The description of a kind of law.
#[derive(Debug, Clone, Copy)]
pub struct LawKind {
    /// The word after `law =`, and the name of the file here.
    pub keyword: &'static str,
    /// Summary in one sentence.
    pub summary: &'static str,
    /// Its keys besides `law`.
    pub fields: &'static [Field],
    /// An example, valid TOML.
    pub example: &'static str,
    /// The keys of a table for these inputs and outputs, with defaults for all else; `None` if the law needs more than that.
    pub template: fn(inputs: &[String], outputs: &[String]) -> Option<Entries>,
    /// The inputs that the keys name.
    pub inputs: fn(&Values) -> Vec<String>,
    /// The references and load estimates that the keys introduce.
    pub references: fn(&Values) -> Vec<Reference>,
    /// Whether it is designed for its sample time, with an observer of its own.
    pub samples: bool,
    /// The design.
    pub design: fn(&Request<'_>) -> Result<Arc<dyn Law>, SynthesisError>,
}

impl LawKind {
    /// All references that the keys of a controller introduce: those of the law, and its blending signal.
    pub fn all_references(&self, values: &Values) -> Vec<Reference> {
        (self.references)(values).into_iter().chain(blending_signal(values)).collect()
    }
}

/// The design problem of a law.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// Name of the controller in the model file.
    pub name: &'a str,
    /// Its keys.
    pub values: &'a Values,
    /// The model to design on.
    pub plant: &'a Plant,
    /// Numbers of the shafts on which a disturbance torque is estimated, to be fed forward; empty if no observer estimates.
    pub disturbances: &'a [usize],
}
