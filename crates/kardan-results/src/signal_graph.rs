//! Blocks, formulas of signals and laws that are programs as a graph of their inputs and outputs.

use schemars::JsonSchema;
use serde::Serialize;

/// A block, a signal that is a formula, or a law that is a program.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SignalNode {
    /// Its name.
    pub name: String,
    /// The kind of block; `expression` of a signal, `program` of a law.
    pub kind: String,
    /// Sample time, s; null: continuous time.
    pub sample_time: Option<f64>,
    /// Its position among those that compute at the same samples, from 1; laws compute after blocks.
    pub order: usize,
    /// Its outputs or commands.
    pub outputs: Vec<SignalOutput>,
    /// Its inputs: outputs of others, sensors, coordinates, references, functions of time.
    pub reads: Vec<String>,
    /// Outputs of others with direct feedthrough to its own at the same sample.
    pub direct_feedthrough: Vec<String>,
}

/// An output.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SignalOutput {
    /// Its name, by which others read it.
    pub name: String,
    /// Its unit, empty for a number.
    pub unit: String,
}
