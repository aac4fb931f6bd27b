//! Programs: outputs of blocks at the samples of one clock, as expressions of their inputs. Data only.

use std::sync::{Arc, OnceLock};

use crate::expr::{Expr, Graph, Lookup, Symbol};
use crate::plan::{Plan, compile};
use crate::units::{Dimension, Exact};

/// The meaning of a symbol of a task.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Read {
    /// A coordinate, by its name.
    Position(String),
    /// Its rate.
    Rate(String),
    /// A sensor reading, by its name, not the true value; the last good reading if it gives no number.
    Sensor(String),
    /// The raw reading, a number or none: the input of a monitor.
    AsRead(String),
    /// An external input of the task, by its name: a signal of the scenario, an output of another task.
    Source(String),
    /// The time, s.
    Time,
}

impl Read {
    /// The sensor that is read.
    pub fn sensor(&self) -> Option<&str> {
        match self {
            Self::Sensor(name) | Self::AsRead(name) => Some(name),
            _ => None,
        }
    }
}

/// A table that a block or a signal reads.
#[derive(Debug, Clone)]
pub struct TableCall {
    /// The block or the signal.
    pub reader: String,
    /// The name of the table.
    pub name: String,
    /// The table.
    pub table: Arc<Lookup>,
    /// Where it is looked up.
    pub at: Vec<Expr>,
}

/// The suffix of a sampled sensor in the names of symbols.
pub(crate) const AS_READ: &str = " as read";

/// The name of the input of a symbol.
pub(crate) fn read_name(symbol: &str) -> &str {
    symbol.strip_suffix(AS_READ).unwrap_or(symbol)
}

/// A condition on a varying key of a block that a run checks.
#[derive(Debug, Clone)]
pub struct KeyRule {
    /// The block.
    pub block: String,
    /// The message where it is violated: "`low` is above `high`".
    pub what: String,
    /// The expression that must not be negative.
    pub value: Expr,
    /// Whether it must be above zero.
    pub above: bool,
    /// Its dimension.
    pub dimension: Dimension,
}

/// Values of blocks and signals that are checked in the rows of a run, with their graph.
#[derive(Debug, Clone, Default)]
pub struct Looked {
    /// The graph: its symbols have the names of the inputs.
    pub graph: Graph,
    /// The tables that are read.
    pub calls: Vec<TableCall>,
    /// Conditions on keys of blocks.
    pub rules: Vec<KeyRule>,
}

/// A discrete state of a task.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Its name: that of its block.
    pub name: String,
    /// Its symbol.
    pub symbol: Symbol,
    /// Its initial value.
    pub start: f64,
    /// Its value at the next sample.
    pub next: Expr,
}

/// An output of a task.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskAnswer {
    /// Its name outside: that of a block, `block.answer`, or of a commanded input.
    pub name: String,
    /// Its dimension.
    pub dimension: Dimension,
    /// One sentence.
    pub description: String,
    /// The value.
    pub value: Expr,
}

impl PartialEq for Task {
    fn eq(&self, other: &Self) -> bool {
        self.graph.has_nodes_of(&other.graph)
            && (&self.period, &self.reads, &self.memory, &self.outputs)
                == (&other.period, &other.reads, &other.memory, &other.outputs)
    }
}

impl Task {
    /// Its arguments: its inputs, then its states.
    pub fn inputs(&self) -> Vec<Symbol> {
        self.reads.iter().map(|(symbol, _)| *symbol).chain(self.memory.iter().map(|entry| entry.symbol)).collect()
    }

    /// Its outputs, then its next states, with names.
    pub fn outputs(&self) -> Vec<(String, Expr)> {
        let outputs = self.outputs.iter().map(|answer| (answer.name.clone(), answer.value));
        let next = self.memory.iter().enumerate().map(|(k, entry)| (format!("next.{k}"), entry.next));
        outputs.chain(next).collect()
    }

    /// Its outputs from its inputs.
    ///
    /// # Panics
    /// If it names an unknown input.
    pub fn plan(&self) -> &Arc<Plan> {
        let compiled =
            || compile(&self.graph, &self.inputs(), &self.outputs()).expect("a task names all that it reads");
        self.lists.values.get_or_init(|| Arc::new(compiled()))
    }
}

/// The outputs computed at the samples of one clock.
#[derive(Debug, Clone)]
pub struct Task {
    /// Its name in sentences.
    pub name: String,
    /// Sample time, s; none: at every instant.
    pub period: Option<Exact>,
    /// The graph of its expressions.
    pub graph: Graph,
    /// Its inputs, sorted.
    pub reads: Vec<(Symbol, Read)>,
    /// Its states.
    pub memory: Vec<Entry>,
    /// Its outputs.
    pub outputs: Vec<TaskAnswer>,
    /// The inputs and states that depend on the plant; the others count, measure time or switch.
    pub moving: Vec<Symbol>,
    /// The names in its commands as written, sorted; empty for blocks.
    pub names: Vec<String>,
    /// The order in which the blocks compute, for a reader: each with the names that it needs at once.
    pub order: Vec<Step>,
    /// Derived values.
    pub lists: Lists,
}

/// A task as lists of operations, each built on first use.
#[derive(Debug, Default)]
pub struct Lists {
    values: OnceLock<Arc<Plan>>,
}

impl Clone for Lists {
    /// A copy, which may become another task, builds its own.
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// A block in its place among those of a task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// The block.
    pub block: String,
    /// The word of its kind.
    pub kind: &'static str,
    /// Its inputs.
    pub reads: Vec<String>,
    /// Those with direct feedthrough to its output.
    pub at_once: Vec<String>,
}
