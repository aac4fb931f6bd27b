//! Combines blocks and their inputs into tasks: names resolved, units checked, in the order of computation.

mod block_outputs;
mod monitor_checks;
mod monitors;
mod outside;
mod overlaps;
mod sensor_signals;
mod tasks;
mod writing;

use std::cell::{OnceCell, RefCell};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc;

use kardan_expr::expr::{Expr, Graph, Lookup, OfTime, Symbol};
use kardan_math::names::{HasName, NamedList, unknown_name};
use kardan_math::units::{Dimension, Exact, UnitError};
use kardan_mechanics::program::{AS_READ, KeyRule, Looked, Read, TableCall, Task, TaskOutput};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, nearest, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Placed, Scalar, Table};

use super::document::{BlockTable, Document, Instance, SignalTable};
use super::functions::Functions;
use super::keys::unknown_in;
use super::table_reader::TableReader;
use monitors::MonitorExpr;
use overlaps::TransitionGuard;

/// The blocks of a model as tasks, with external inputs.
#[derive(Debug, Clone, Default)]
pub struct Programs {
    /// One task for each sample time, the shortest first.
    pub tasks: Vec<Arc<Task>>,
    /// Sensors of signals, each as a task that outputs its signal, by the name of the sensor.
    pub sensors: Vec<Arc<Task>>,
    /// Functions of time that tasks read, by name.
    pub functions: Vec<(String, Arc<OfTime>)>,
    /// Outputs of sampled laws that tasks read, by name: `column.rk.disturbance`.
    pub exported: Vec<(String, Dimension)>,
    /// References that blocks introduce, with their dimension and the block: `reference = "ref_rack"`.
    pub references: Vec<(String, Dimension, String)>,
    /// Values checked in the rows of a run.
    pub looked: Looked,
    /// One has a reported error, or names an entry with one: the outputs are unknown.
    pub broken: bool,
}

impl Programs {
    /// All outputs.
    pub fn outputs(&self) -> impl Iterator<Item = &TaskOutput> {
        self.tasks.iter().flat_map(|task| &task.outputs)
    }
}

/// An external input that blocks may read by name.
#[derive(Debug, Clone, PartialEq)]
pub struct Outside {
    /// The name.
    pub name: String,
    /// Its kind.
    pub read: Read,
    /// Its dimension.
    pub dimension: Dimension,
}

impl HasName for Outside {
    fn name(&self) -> &str {
        &self.name
    }
}

/// A program law: its name, its sample time, its commands as written.
pub(crate) struct Commands<'a> {
    pub control: String,
    pub period: Option<Exact>,
    pub expressions: &'a [(Placed<String>, Placed<Scalar>)],
}

/// The command of a law to one input.
struct Command {
    name: String,
    value: Expr,
    dimension: Dimension,
    reads: BTreeSet<String>,
    place: Place,
}

/// Outputs of a block: names after its own, values and dimensions.
type Outputs = Vec<(String, Expr, Dimension)>;
/// States of a block: symbol, initial value, next value.
type BlockStates = Vec<(Expr, Expr, Expr)>;
/// Keys that are expressions, with the name in the key if listed by name.
type BlockInputs = Vec<(&'static str, Option<String>, (Expr, Dimension))>;

/// A block that was written.
#[derive(Debug, Clone)]
struct Made {
    period: Option<Exact>,
    outputs: Outputs,
    states: BlockStates,
    /// Names in its expressions, with signals expanded.
    reads: Arc<BTreeSet<String>>,
}

/// Entries built from its expressions.
#[derive(Clone, Copy)]
enum Source<'a> {
    Block(&'a BlockTable),
    /// A signal that depends on coordinates.
    Formula(&'a SignalTable),
    /// A sensor of a signal: its name, the signal that it names and where.
    Sensor(&'a str, &'a str, &'a Place),
    /// A reference that a block introduces: its name and the block, whose measurement has the same quantity.
    Reference(&'a str, &'a BlockTable),
}

impl<'a> Source<'a> {
    /// Its kind and its name: a sensor may have the name of a signal.
    fn key(self) -> (&'static str, &'a str) {
        match self {
            Self::Block(block) => ("block", &block.name),
            Self::Formula(signal) => ("signal", &signal.name),
            Self::Sensor(name, ..) => ("sensor", name),
            Self::Reference(name, _) => ("reference", name),
        }
    }
}

/// An expanded formula, with the names in it.
#[derive(Clone)]
struct FormulaExpr {
    value: Expr,
    dimension: Dimension,
    reads: Arc<BTreeSet<String>>,
}

/// An output in its position among those that it depends on.
struct Ordered<'a> {
    /// Its block, or the signal that it is the formula of.
    block: &'a str,
    /// Its name after that of the block.
    output: String,
    /// Its name outside.
    name: String,
    value: Expr,
    dimension: Dimension,
    /// Outputs of other blocks, or others of the same, that it depends on at the same sample.
    at_once: Vec<String>,
}

/// The blocks of a document under construction.
pub(crate) struct Blocks<'a, 'd, 'f> {
    reader: &'a TableReader<'d>,
    document: &'a Document,
    functions: &'f mut Functions<'a, 'd>,
    graph: RefCell<Graph>,
    outside: NamedList<Outside>,
    /// Its inputs, with their symbols.
    read: BTreeMap<String, (Expr, Dimension)>,
    /// Sensors among them that were read since monitors last received raw readings, by position.
    fresh: Vec<usize>,
    /// Symbols for the outputs of blocks.
    outputs: BTreeMap<String, (Expr, Dimension)>,
    /// States of observers as named by their own keys: they vary, while outputs are constant between samples.
    states: BTreeMap<String, (Expr, Dimension)>,
    made: BTreeMap<&'a str, Option<Made>>,
    /// Other sources that were expanded, by their kind and name.
    formulas: HashMap<(&'static str, &'a str), Option<FormulaExpr>>,
    /// References that blocks introduce, with the block.
    introduced: HashMap<&'a str, &'a BlockTable>,
    /// Pending entries, each after those that depend on it.
    open: Vec<&'a str>,
    waiting: HashSet<&'a str>,
    used_functions: Vec<(String, Arc<OfTime>)>,
    /// Machines, with their states and transitions.
    machines: Vec<(&'a str, Vec<String>, Vec<TransitionGuard>)>,
    monitors: Vec<MonitorExpr>,
    calls: Vec<TableCall>,
    /// The same by reader, name and place.
    called: HashSet<(String, String, Vec<Expr>)>,
    rules: Vec<KeyRule>,
    /// All symbols that depend on coordinates.
    moving: OnceCell<HashSet<Symbol>>,
}

fn errors(out: &[Diagnostic]) -> usize {
    out.iter().filter(|diagnostic| diagnostic.is_error()).count()
}

/// The external name of an output.
fn outside_name(block: &str, output: &str) -> String {
    if output.is_empty() { block.to_string() } else { format!("{block}.{output}") }
}

impl<'a, 'd, 'f> Blocks<'a, 'd, 'f> {
    pub(crate) fn new(
        (reader, document): (&'a TableReader<'d>, &'a Document),
        functions: &'f mut Functions<'a, 'd>,
        outside: Vec<Outside>,
    ) -> Self {
        // The first of several users defines its quantity.
        let mut introduced = HashMap::new();
        for (name, block) in document.references_of_blocks() {
            introduced.entry(name).or_insert(block);
        }
        Self {
            reader,
            document,
            functions,
            graph: RefCell::default(),
            outside: outside.into_iter().collect(),
            read: BTreeMap::new(),
            fresh: Vec::new(),
            outputs: BTreeMap::new(),
            states: BTreeMap::new(),
            made: BTreeMap::new(),
            formulas: HashMap::new(),
            introduced,
            open: Vec::new(),
            waiting: HashSet::new(),
            used_functions: Vec::new(),
            machines: Vec::new(),
            monitors: Vec::new(),
            calls: Vec::new(),
            called: HashSet::new(),
            rules: Vec::new(),
            moving: OnceCell::new(),
        }
    }

    /// All blocks as tasks, and the commands of program laws, by name; reports errors.
    pub(crate) fn tasks(
        mut self,
        laws: &[Commands<'a>],
        out: &mut Vec<Diagnostic>,
    ) -> (Programs, Vec<(String, Arc<Task>)>) {
        let before = errors(out);
        for block in &self.document.blocks {
            self.make(Source::Block(block), out);
        }
        for signal in &self.document.signals {
            self.column(signal, out);
        }
        let sensors: Vec<Arc<Task>> =
            self.document.signal_sensors().filter_map(|sensor| self.sensor(sensor, out)).map(Arc::new).collect();
        let commands: Vec<Vec<Command>> = laws.iter().map(|law| self.commands(law, out)).collect();
        let nothing = (Programs { broken: true, ..Programs::default() }, Vec::new());
        // Entries with doubtful names are skipped silently.
        let is_missing = |made: &Option<Made>| made.is_none();
        let is_short = |(law, commands): (&Commands<'_>, &Vec<Command>)| law.expressions.len() > commands.len();
        if errors(out) > before || self.made.values().any(is_missing) || laws.iter().zip(&commands).any(is_short) {
            return nothing;
        }
        self.check_rates(out);
        let Some(order) = self.order(out) else { return nothing };
        for (law, commands) in laws.iter().zip(&commands) {
            let what = format!("control `{}`", law.control);
            commands
                .iter()
                .for_each(|command| self.check_reads(&what, &command.place, (&law.period, &command.reads), out));
        }
        if errors(out) > before {
            return nothing;
        }
        self.check_transitions(out);
        self.check_monitors(&order, out);
        let mut periods: Vec<Option<Exact>> = self.made.values().flatten().map(|made| made.period.clone()).collect();
        periods.sort_by_key(|period| period.as_ref().map(Exact::to_rational));
        periods.dedup();
        let tasks = periods.into_iter().map(|period| Arc::new(self.task(period, &order, |_| false))).collect();
        let of_laws = laws.iter().zip(commands).map(|(law, commands)| {
            let task = self.command_task((&law.control, law.period.clone()), &order, commands);
            (law.control.clone(), Arc::new(task))
        });
        let of_laws = of_laws.collect();
        let functions = std::mem::take(&mut self.used_functions);
        let looked = Looked {
            graph: self.graph.borrow().clone(),
            calls: std::mem::take(&mut self.calls),
            rules: std::mem::take(&mut self.rules),
        };
        let (exported, references) = (self.exported(), self.references());
        (Programs { tasks, sensors, functions, exported, references, looked, broken: false }, of_laws)
    }

    /// The references that blocks introduce, sorted.
    fn references(&self) -> Vec<(String, Dimension, String)> {
        let reference = |(name, block): (&&'a str, &&'a BlockTable)| {
            let made = self.formulas.get(&Source::Reference(name, block).key())?.as_ref()?;
            Some((name.to_string(), made.dimension, block.name.clone()))
        };
        let mut all: Vec<_> = self.introduced.iter().filter_map(reference).collect();
        all.sort_by(|a, b| a.0.cmp(&b.0));
        all
    }

    /// Outputs of sampled laws that were read, sorted.
    fn exported(&self) -> Vec<(String, Dimension)> {
        let of_law = |name: &String| self.document.controls.has(SignalName::new(name).element);
        self.read.iter().filter(|(name, _)| of_law(name)).map(|(name, (_, of))| (name.clone(), *of)).collect()
    }

    /// The commands of a law; reports errors.
    fn commands(&mut self, law: &Commands<'a>, out: &mut Vec<Diagnostic>) -> Vec<Command> {
        let mut found = Vec::new();
        for (name, scalar) in law.expressions {
            let label = format!("`{}` in `commands` of control `{}`", shortened(&name.value), law.control);
            let motor = self.document.elements.get(&name.value);
            let expected = match motor {
                Some(one) if one.kind.keyword == "voltage_source" => Dimension::VOLTAGE,
                Some(one) if one.kind.keyword == "motor" && one.table.translational => Dimension::FORCE,
                Some(one) if one.kind.keyword == "motor" => Dimension::TORQUE,
                _ => {
                    let is_input = |one: &&Instance| ["motor", "voltage_source"].contains(&one.kind.keyword);
                    let inputs = self.document.elements.iter().filter(is_input).map(|one| one.name.as_str());
                    let help = unknown_name(&name.value, inputs);
                    let message = format!("{label}: there is no motor and no voltage source of that name");
                    out.push(Diagnostic::error("name::unknown", message).at(&name.place, "unknown").help(help));
                    continue;
                }
            };
            let Scalar::Expression(read) = &scalar.value else { continue };
            let mut reads = BTreeSet::new();
            let Some((value, dimension)) = self.resolved(read, (&scalar.place, &label), &mut reads, out) else {
                continue;
            };
            if !expected.is_like(&dimension) {
                let help = format!("the result needs a unit such as {}", expected.example());
                out.push(Diagnostic::wrong_dimension(&label, [expected, dimension], &scalar.place).help(help));
                continue;
            }
            found.push(Command {
                name: name.value.clone(),
                value,
                dimension: expected,
                reads,
                place: scalar.place.clone(),
            });
        }
        found
    }

    fn symbol(&self, name: &str, dimension: Dimension) -> Expr {
        self.graph.borrow_mut().new_symbol(name.to_string(), dimension)
    }

    /// The symbol of an output, of a dimension.
    fn output_symbol(&mut self, name: String, dimension: Dimension) -> (Expr, Dimension) {
        if let Some(cached) = self.outputs.get(&name) {
            return *cached;
        }
        let found = (self.symbol(&name, dimension), dimension);
        self.outputs.insert(name, found);
        found
    }

    /// Records where a table is read; those of lanes are left beside the road.
    fn reads_table(&mut self, name: &str, table: Option<Arc<Lookup>>, at: Vec<Expr>) {
        let Some(table) = table.filter(|_| !self.document.lanes.contains(name)) else { return };
        let reader = self.open.last().map_or("commands", |open| open).to_string();
        if self.called.insert((reader.clone(), name.to_string(), at.clone())) {
            self.calls.push(TableCall { reader, name: name.to_string(), table, at });
        }
    }

    /// Gives the residual of a monitor raw sensor readings, which may be not a number: only monitors use them.
    fn take_as_read(&mut self, inputs: &mut BlockInputs) {
        let residual = inputs.iter().filter(|(key, ..)| *key == "residual").map(|(_, _, (value, _))| *value);
        let residual: Vec<Expr> = residual.collect();
        let mut places = std::mem::take(&mut self.fresh);
        let graph = self.graph.borrow();
        let symbols = graph.symbols(&residual);
        places.extend(symbols.iter().filter_map(|symbol| self.outside.position(graph.name(*symbol).0)));
        drop(graph);
        places.sort();
        places.dedup();
        for place in places {
            let Outside { name, read: Read::Sensor(sensor), dimension } = self.outside[place].clone() else { continue };
            let Some((expr, _)) = self.read.get(&name).copied() else { continue };
            let Some(symbol) = self.graph.borrow().symbol_of(expr) else { continue };
            let name = format!("{name}{AS_READ}");
            let (as_read, _) = self.read_outside(Outside { name, read: Read::AsRead(sensor), dimension });
            if symbols.binary_search(&symbol).is_err() {
                continue;
            }
            let mut graph = self.graph.borrow_mut();
            for (_, _, (value, _)) in inputs.iter_mut().filter(|(key, ..)| *key == "residual") {
                *value = graph.substitute(&[*value], &[(symbol, as_read)])[0];
            }
        }
    }

    fn read_outside(&mut self, outside: Outside) -> (Expr, Dimension) {
        if let Some(existing) = self.read.get(&outside.name) {
            return *existing;
        }
        let found = (self.symbol(&outside.name, outside.dimension), outside.dimension);
        self.read.insert(outside.name.clone(), found);
        if !self.outside.all(&outside.name).any(|existing| *existing == outside) {
            self.outside.push(outside.clone());
        }
        if matches!(outside.read, Read::Sensor(_)) {
            self.fresh.extend(self.outside.position(&outside.name));
        }
        found
    }

    /// An error in an expression, at its place, with a suggestion for an unknown name unless there are very many errors already.
    fn diagnostic(&self, error: UnitError, text: &str, at: (&Place, &str), guesses: bool) -> Diagnostic {
        unknown_in(error, text, at, |name| {
            let document = self.document;
            let readable_names = || {
                let signals = document.signals.iter().map(|signal| signal.name.as_str());
                let blocks = document.blocks.iter().map(|block| block.name.as_str());
                let parameters = document.parameters.iter().map(|parameter| parameter.name.as_str());
                let outputs = self.outputs.keys().map(String::as_str);
                let outside = self.outside.iter().map(|outside| outside.name.as_str());
                let sensors = document.signal_sensors().map(|(sensor, ..)| sensor);
                let all = outside.chain(sensors).chain(signals).chain(blocks).chain(outputs).chain(parameters);
                guesses.then_some(all).into_iter().flatten()
            };
            let is_whole = |candidate: &&str| candidate.contains('-') && text.contains(*candidate);
            let help = match nearest(name, readable_names()) {
                _ if let Some(whole) = readable_names().find(is_whole) => {
                    format!("in an expression `-` is minus: write the name in quotes, `'{whole}'`")
                }
                Some(near) => format!("did you mean `{near}`?"),
                None => format!(
                    "a block reads angles and speeds (`rack.s`, `column.w`), sensors, signals, other blocks, parameters, the time `t` and \
                     references: those that laws and blocks give as `reference`, and those of a program, `references = [{{ name = \"{name}\", unit = \"rad\" }}]`"
                ),
            };
            (format!("there is no `{}` that a block can read", shortened(name)), help)
        })
    }
}

/// The unit that a table states.
fn unit_of(table: &Table, what: &str, out: &mut Vec<Diagnostic>) -> Option<Dimension> {
    let (text, place) = table.placed_word("unit")?;
    match kardan_math::units::parse_quantity(&format!("1 {text}")) {
        Ok((_, dimension)) => Some(dimension),
        Err(error) => {
            let message = format!("`unit` of {what}: {}", error.message);
            let diagnostic = Diagnostic::error(error.code, message).at(place, "no unit");
            out.push(diagnostic.help("write a unit such as \"N m\""));
            None
        }
    }
}

/// The help for an algebraic loop.
const BREAK_CIRCLE: &str =
    "put a `delay` or a forward `integrator` into it: their output does not depend on their present input";
