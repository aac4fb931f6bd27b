//! Programs: what blocks compute at the samples of one clock, as expressions of what they read. Data only.

use std::sync::{Arc, OnceLock};

use crate::expr::{Expr, Graph, Lookup, Symbol};
use crate::plan::{Plan, compile};
use crate::units::{Dimension, Exact};

/// What a symbol of a task stands for.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Read {
    /// A coordinate, by its name.
    Position(String),
    /// Its rate.
    Rate(String),
    /// A sensor, by its name: as it reads, not what is true; the last good reading, where it gives no number.
    Sensor(String),
    /// The same as it is, a number or none: what a monitor sees.
    AsRead(String),
    /// What comes from outside of the task, by its name: a signal of the scenario, what another task answers.
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

/// What stands behind the name of a sensor that is read at a sample, in the names of symbols.
pub(crate) const AS_READ: &str = " as read";

/// The name of what a symbol reads.
pub(crate) fn read_name(symbol: &str) -> &str {
    symbol.strip_suffix(AS_READ).unwrap_or(symbol)
}

/// What a run is to keep, of a key of a block that varies.
#[derive(Debug, Clone)]
pub struct KeyRule {
    /// The block.
    pub block: String,
    /// What is wrong where it is not kept: "`low` is above `high`".
    pub what: String,
    /// What must not be negative.
    pub value: Expr,
    /// Whether it must be above zero.
    pub above: bool,
    /// What it is of.
    pub dimension: Dimension,
}

/// What of blocks and signals is looked at in the rows of a run, with what it stands in.
#[derive(Debug, Clone, Default)]
pub struct Looked {
    /// The graph: its symbols have the names of what is read.
    pub graph: Graph,
    /// The tables that are read.
    pub calls: Vec<TableCall>,
    /// What keys of blocks are to keep.
    pub rules: Vec<KeyRule>,
}

/// What a task remembers from one sample to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What it is called: the name of its block.
    pub name: String,
    /// What stands for it.
    pub symbol: Symbol,
    /// What it is at the start.
    pub start: f64,
    /// What it is at the next sample.
    pub next: Expr,
}

/// What a task answers.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskAnswer {
    /// Its name outside: that of a block, `block.answer`, or of an input that is commanded.
    pub name: String,
    /// What it is of.
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
    /// What it is evaluated from: what it reads, then what it remembers.
    pub fn inputs(&self) -> Vec<Symbol> {
        self.reads.iter().map(|(symbol, _)| *symbol).chain(self.memory.iter().map(|entry| entry.symbol)).collect()
    }

    /// Its answers, then what it remembers next, with names.
    pub fn outputs(&self) -> Vec<(String, Expr)> {
        let outputs = self.outputs.iter().map(|answer| (answer.name.clone(), answer.value));
        let next = self.memory.iter().enumerate().map(|(k, entry)| (format!("next.{k}"), entry.next));
        outputs.chain(next).collect()
    }

    /// Its outputs from its inputs.
    ///
    /// # Panics
    /// If it names what it does not read.
    pub fn plan(&self) -> &Arc<Plan> {
        let compiled =
            || compile(&self.graph, &self.inputs(), &self.outputs()).expect("a task declares all its inputs");
        self.lists.values.get_or_init(|| Arc::new(compiled()))
    }
}

/// What is computed together at the samples of one clock.
#[derive(Debug, Clone)]
pub struct Task {
    /// What it is called in sentences.
    pub name: String,
    /// Sample time, s; none: at every instant.
    pub period: Option<Exact>,
    /// What its expressions stand in.
    pub graph: Graph,
    /// What it reads, sorted.
    pub reads: Vec<(Symbol, Read)>,
    /// What it remembers.
    pub memory: Vec<Entry>,
    /// What it answers.
    pub outputs: Vec<TaskAnswer>,
    /// What of all that it reads and remembers moves with what is controlled; the rest counts, tells the time or switches.
    pub moving: Vec<Symbol>,
    /// What its commands name as they are written, sorted; of blocks nothing.
    pub names: Vec<String>,
    /// The order in which the blocks compute, for a reader: each with the names that it needs at once.
    pub order: Vec<Step>,
    /// What follows from the others.
    pub lists: Lists,
}

/// A task as lists of operations, each made where it is asked for first.
#[derive(Debug, Default)]
pub struct Lists {
    values: OnceLock<Arc<Plan>>,
}

impl Clone for Lists {
    /// Those of a copy, which may become another task, are made anew.
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
    /// What it reads.
    pub reads: Vec<String>,
    /// Those of it that its answer follows from at the same sample.
    pub at_once: Vec<String>,
}
