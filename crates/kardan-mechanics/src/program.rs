//! Programs: what blocks compute at the samples of one clock, as expressions of their inputs. Data only.

use std::sync::{Arc, OnceLock};

use kardan_expr::expr::{Expr, Graph, Lookup, Symbol};
use kardan_expr::plan::{Plan, compile};
use kardan_math::units::{Dimension, Exact};

/// The meaning of a symbol of a task.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Read {
    /// A coordinate, by its name.
    Position(String),
    /// Its rate.
    Rate(String),
    /// A sensor, by its name: its reading, not the true value; the last valid reading, where it outputs no number.
    Sensor(String),
    /// The same without replacement, a number or NaN: the input of a monitor.
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
    /// The arguments of the lookup.
    pub at: Vec<Expr>,
}

/// The suffix of a sensor's name in the names of symbols, where it is read at a sample.
pub const AS_READ: &str = " as read";

/// The name that a symbol reads.
pub fn read_name(symbol: &str) -> &str {
    symbol.strip_suffix(AS_READ).unwrap_or(symbol)
}

/// A condition that a run must satisfy, from a key of a block that varies.
#[derive(Debug, Clone)]
pub struct KeyRule {
    /// The block.
    pub block: String,
    /// The error where it is violated: "`low` is above `high`".
    pub what: String,
    /// The value that must not be negative.
    pub value: Expr,
    /// Whether it must be above zero.
    pub above: bool,
    /// Its dimension.
    pub dimension: Dimension,
}

/// The checks of blocks and signals in the rows of a run, with their graph.
#[derive(Debug, Clone, Default)]
pub struct Looked {
    /// The graph: its symbols have the names that are read.
    pub graph: Graph,
    /// The tables that are read.
    pub calls: Vec<TableCall>,
    /// The conditions on keys of blocks.
    pub rules: Vec<KeyRule>,
}

/// A state of a task from one sample to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The name of its block.
    pub name: String,
    /// The symbol that represents it.
    pub symbol: Symbol,
    /// Its initial value.
    pub start: f64,
    /// Its value at the next sample.
    pub next: Expr,
}

/// An output of a task.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskOutput {
    /// Its name outside: that of a block, `block.output`, or of a commanded input.
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
            && (&self.period, &self.reads, &self.states, &self.outputs)
                == (&other.period, &other.reads, &other.states, &other.outputs)
    }
}

impl Task {
    /// Its arguments: the inputs, then the states.
    pub fn inputs(&self) -> Vec<Symbol> {
        self.reads.iter().map(|(symbol, _)| *symbol).chain(self.states.iter().map(|entry| entry.symbol)).collect()
    }

    /// Its outputs, then the next states, with names.
    pub fn outputs(&self) -> Vec<(String, Expr)> {
        let outputs = self.outputs.iter().map(|output| (output.name.clone(), output.value));
        let next = self.states.iter().enumerate().map(|(k, entry)| (format!("next.{k}"), entry.next));
        outputs.chain(next).collect()
    }

    /// Its outputs from its inputs.
    ///
    /// # Panics
    /// If it names an input that it does not read.
    pub fn plan(&self) -> &Arc<Plan> {
        let compiled =
            || compile(&self.graph, &self.inputs(), &self.outputs()).expect("a task declares all its inputs");
        self.lists.values.get_or_init(|| Arc::new(compiled()))
    }
}

/// Expressions that are computed together at the samples of one clock.
#[derive(Debug, Clone)]
pub struct Task {
    /// Its name in messages.
    pub name: String,
    /// Sample time, s; none: at every instant.
    pub period: Option<Exact>,
    /// The graph of its expressions.
    pub graph: Graph,
    /// Its inputs, sorted.
    pub reads: Vec<(Symbol, Read)>,
    /// Its states.
    pub states: Vec<Entry>,
    /// Its outputs.
    pub outputs: Vec<TaskOutput>,
    /// Those of its inputs and states that move with the controlled plant; the rest counts, measures time or switches.
    pub moving: Vec<Symbol>,
    /// The names in its commands as they are written, sorted; empty for blocks.
    pub names: Vec<String>,
    /// The order in which the blocks compute, for a reader: each with the names that it needs at once.
    pub order: Vec<Step>,
    /// Derived data.
    pub lists: Lists,
}

/// A task as lists of operations, each compiled at its first use.
#[derive(Debug, Default)]
pub struct Lists {
    values: OnceLock<Arc<Plan>>,
}

impl Clone for Lists {
    /// Those of a copy, which may become another task, are compiled again.
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// A block with its index among those of a task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// The block.
    pub block: String,
    /// The word of its kind.
    pub kind: &'static str,
    /// Its inputs.
    pub reads: Vec<String>,
    /// Those inputs that its output depends on at the same sample.
    pub at_once: Vec<String>,
}
