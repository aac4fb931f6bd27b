//! Blocks, formulas of signals and laws that are programs as a graph: who reads whom.

use schemars::JsonSchema;
use serde::Serialize;

/// A block, a signal that is a formula, or a law that is a program.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SignalNode {
    /// Its name.
    pub name: String,
    /// The kind of block; `expression` of a signal, `program` of a law.
    pub kind: String,
    /// Sample time, s; null: at every instant.
    pub sample_time: Option<f64>,
    /// Its place among those that compute at the same samples, from 1; laws compute behind blocks.
    pub order: usize,
    /// What it answers or commands.
    pub outputs: Vec<SignalAnswer>,
    /// What it reads: answers of others, sensors, what moves, references, functions of time.
    pub reads: Vec<String>,
    /// Answers of others that its own follow from at the same sample.
    pub direct_feedthrough: Vec<String>,
}

/// Something that is answered.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SignalAnswer {
    /// Its name, by which others read it.
    pub name: String,
    /// Its unit, empty for a number.
    pub unit: String,
}
