//! Combines blocks and their inputs into tasks: names resolved, units checked, in the order of computation.

mod tasks;
mod writing;

use std::cell::{OnceCell, RefCell};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc;

use super::document::{BlockTable, Document, Instance, SignalTable};
use super::functions::Functions;
use super::monitors::{self, MonitorExpr};
use super::overlaps::{self, Assumptions, TransitionGuard};
use super::table_reader::TableReader;
use crate::block::{BlockBuilder, BlockKind, Expressions, Guard, List, Rule};
use crate::diagnostics::{Diagnostic, Severity, nearest, quoted, shortened};
use crate::element::{KeyError, Values};
use crate::entries::Place;
use crate::expr::{Expr, Graph, Interval, Lookup, OfTime, Substitution, Symbol, Traced};
use crate::names::{HasName, NamedList, SignalName};
use crate::num::Rational;
use crate::program::{AS_READ, KeyRule, Lists, Looked, Read, TableCall, Task, TaskAnswer};
use crate::schema::{Kind, Placed, Scalar, Table, Value};
use crate::units::{Dimension, Exact, UnitError};

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
    pub fn outputs(&self) -> impl Iterator<Item = &TaskAnswer> {
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
type Memory = Vec<(Expr, Expr, Expr)>;
/// Keys that are expressions, with the name in the key if listed by name.
type BlockInputs = Vec<(&'static str, Option<String>, (Expr, Dimension))>;

/// A block that was written.
#[derive(Debug, Clone)]
struct Made {
    period: Option<Exact>,
    outputs: Outputs,
    memory: Memory,
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
    fn name(self) -> &'a str {
        match self {
            Self::Block(block) => &block.name,
            Self::Formula(signal) => &signal.name,
            Self::Sensor(name, ..) | Self::Reference(name, _) => name,
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
    answer: String,
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
    /// Expanded signals that depend on coordinates, and the measurements of sensors of signals.
    formulas: HashMap<&'a str, Option<FormulaExpr>>,
    sensors: HashMap<&'a str, Option<FormulaExpr>>,
    /// References that blocks introduce, with the block, and what their blocks measure.
    introduced: HashMap<&'a str, &'a BlockTable>,
    references: HashMap<&'a str, Option<FormulaExpr>>,
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
    out.iter().filter(|diagnostic| diagnostic.severity == Severity::Error).count()
}

/// The external name of an output.
fn outside_name(block: &str, answer: &str) -> String {
    if answer.is_empty() { block.to_string() } else { format!("{block}.{answer}") }
}

/// The symbols of an output: `.since` of a machine and others whose units are known in advance.
fn declared_outputs(kind: &BlockKind, values: &Values, lists: &[List]) -> Vec<(String, Dimension)> {
    match kind.keyword {
        "state_machine" => {
            let states = values.names("states").unwrap_or_default().iter();
            let outputs = lists.iter().filter_map(|list| Some((list.name.clone(), list.values.first()?.1)));
            let own = [(String::new(), Dimension::NONE), ("since".to_string(), Dimension::TIME)];
            own.into_iter().chain(states.map(|name| (name.clone(), Dimension::NONE))).chain(outputs).collect()
        }
        "observer" => {
            let states = lists.iter().filter(|list| list.key == "states");
            states.filter_map(|list| Some((list.name.clone(), list.values.first()?.1))).collect()
        }
        "monitor" => vec![(String::new(), Dimension::NONE)],
        _ => Vec::new(),
    }
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
            sensors: HashMap::new(),
            introduced,
            references: HashMap::new(),
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
        let reference = |(name, block): (&&str, &&BlockTable)| {
            let made = self.references.get(name)?.as_ref()?;
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
                    let inputs = || {
                        let all = self.document.elements.iter();
                        all.filter(|one| ["motor", "voltage_source"].contains(&one.kind.keyword))
                            .map(|one| one.name.as_str())
                    };
                    let help = match nearest(&name.value, inputs()) {
                        Some(near) => format!("did you mean `{near}`?"),
                        None => format!("there are {}", quoted(inputs())),
                    };
                    let message = format!("{label}: there is no motor and no voltage source of that name");
                    out.push(Diagnostic::error("name::unknown", message).at(name.place.clone(), "unknown").help(help));
                    continue;
                }
            };
            let Scalar::Expression(read) = &scalar.value else { continue };
            let mut reads = BTreeSet::new();
            let Some((value, dimension)) = self.resolved(read, (&scalar.place, &label), &mut reads, out) else {
                continue;
            };
            if !expected.is_like(&dimension) {
                let message = format!("{label}: expected {}, found {}", expected.noun(), dimension.noun());
                let help = format!("the result needs a unit such as {}", expected.example());
                out.push(
                    Diagnostic::error("unit::dimension", message).at(scalar.place.clone(), dimension.noun()).help(help),
                );
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
    fn answer_symbol(&mut self, name: String, dimension: Dimension) -> (Expr, Dimension) {
        if let Some(cached) = self.outputs.get(&name) {
            return *cached;
        }
        let found = (self.symbol(&name, dimension), dimension);
        self.outputs.insert(name, found);
        found
    }

    /// Records the comparison of a monitor.
    fn watch(&mut self, name: &str, table: &Table, inputs: &BlockInputs) {
        let of = |key: &str| inputs.iter().find(|(candidate, ..)| *candidate == key).map(|(_, _, found)| *found);
        let (Some((residual, _)), Some((threshold, _))) = (of("residual"), of("threshold")) else { return };
        let place = TableReader::place(table, "threshold");
        let waits = table.values.contains_key("debounce");
        self.monitors.push(MonitorExpr { name: name.to_string(), residual, threshold, place, waits });
    }

    /// Lets a kind write itself.
    fn wire(
        &self,
        kind: &BlockKind,
        (values, sample_time, table, lists): (&Values, Option<Exact>, Option<Arc<Lookup>>, Vec<List>),
        (inputs, guards, own): (BlockInputs, Vec<TransitionGuard>, Vec<[Expr; 2]>),
    ) -> Result<(Outputs, Memory, Vec<KeyRule>), KeyError> {
        let graph = &self.graph;
        let traced = |expr: Expr| Traced::new(graph, expr);
        let (mut unnamed, mut named) = (BTreeMap::new(), BTreeMap::<&str, Expressions<'_>>::new());
        for (key, name, (expr, dimension)) in inputs {
            match name {
                None => drop(unnamed.insert(key, (traced(expr), dimension))),
                Some(name) => named.entry(key).or_default().push((name, traced(expr), dimension)),
            }
        }
        let mut builder = BlockBuilder {
            graph,
            inputs: unnamed,
            named,
            own: own.into_iter().map(|both| both.map(traced)).collect(),
            values,
            lists,
            guards: guards
                .iter()
                .map(|guard| Guard { transition: guard.transition, when: traced(guard.when) })
                .collect(),
            table,
            sample_time,
            memory: Vec::new(),
            outputs: Vec::new(),
            rules: RefCell::default(),
        };
        (kind.write)(&mut builder)?;
        let rule = |Rule { what, value, above, dimension }: Rule<'_>| {
            let block = String::new();
            KeyRule { block, what, value: value.expr(graph), above, dimension }
        };
        let rules = builder.rules.take().into_iter().map(rule).collect();
        let outputs =
            builder.outputs.iter().map(|answer| (answer.name.clone(), answer.value.expr(graph), answer.dimension));
        let memory = builder
            .memory
            .iter()
            .map(|entry| (entry.symbol.expr(graph), entry.start.expr(graph), entry.next.expr(graph)));
        Ok((outputs.collect(), memory.collect(), rules))
    }

    /// Checks the result of a block, and gives its outputs to its users.
    fn finished(
        &mut self,
        block: &'a BlockTable,
        mut made: Made,
        unit: Option<Dimension>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Made> {
        let what = format!("block `{}`", shortened(&block.name));
        if let (Some(unit), Some((_, _, found))) = (unit, made.outputs.first())
            && !unit.is_like(found)
        {
            let message = format!("{what} outputs {}, not {}", found.noun(), unit.noun());
            let at = TableReader::place(&block.table, "unit");
            let diagnostic = Diagnostic::error("unit::dimension", message).at(at, "another unit");
            out.push(diagnostic.help(format!("write a unit such as {}, or leave `unit` out", found.example())));
            return None;
        }
        if let (Some(unit), Some(answer)) = (unit, made.outputs.first_mut()) {
            answer.2 = unit;
        }
        let varies = |expr: Expr| !self.graph.borrow().symbols(&[expr]).is_empty();
        if made.memory.iter().any(|(_, start, _)| varies(*start)) {
            let at = TableReader::place(&block.table, "initial");
            let diagnostic = Diagnostic::error("block::initial-value", format!("{what}: its initial value may vary"))
                .at(at, "varies");
            out.push(diagnostic.help("write it with numbers and parameters alone"));
            return None;
        }
        for (answer, _, dimension) in &made.outputs {
            self.answer_symbol(outside_name(&block.name, answer), *dimension);
        }
        Some(made)
    }

    /// Lists of quantities by name.
    fn lists(&self, table: &Table, out: &mut Vec<Diagnostic>) -> Vec<List> {
        let (mut lists, mut places): (Vec<List>, HashMap<(&str, &str), usize>) = (Vec::new(), HashMap::new());
        for field in table.fields.iter().filter(|field| field.kind == Kind::Lists) {
            let Some(Placed { value: Value::Map(entries), .. }) = table.values.get(field.name) else { continue };
            for (name, scalar) in entries {
                let label = format!("`{}` in `{}`", name.value, field.name);
                let Some(found) = self.reader.scalar(scalar, None, &label, out) else { continue };
                let place = *places.entry((field.name, &name.value)).or_insert(lists.len());
                match lists.get_mut(place) {
                    Some(list) => list.values.push(found),
                    None => lists.push(List { key: field.name, name: name.value.clone(), values: vec![found] }),
                }
            }
        }
        lists
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

    /// A sensor of a signal as a task that outputs its signal; `None` if it has an error, which was reported.
    fn sensor(&mut self, sensor: (&'a str, &'a str, &'a Place), out: &mut Vec<Diagnostic>) -> Option<Task> {
        let (name, signal, place) = sensor;
        self.make(Source::Sensor(name, signal, place), out);
        let dimension = self.sensors.get(name)?.as_ref()?.dimension;
        let is_output = self.outputs.contains_key(signal) || self.made.get(signal).is_some_and(Option::is_some);
        let of_time = self.document.signals.get(signal).is_some_and(|signal| signal.formula.is_none());
        let outside = self.outside.get(signal).map(|outside| &outside.read);
        let block = self.of_name(signal).and_then(|block| self.made.get(block)?.as_ref());
        let of_law = self.document.controls.has(SignalName::new(signal).element);
        if block.is_some_and(|made| made.period.is_some()) || of_law {
            let message = format!(
                "`signal` of sensor `{}`: `{}` is computed on a control unit, so no sensor can measure it",
                shortened(name),
                shortened(signal)
            );
            let help = "let blocks read it by its name; a sensor can measure what is computed at every instant";
            out.push(Diagnostic::error("sensor::signal", message).at(place.clone(), "has a sample time").help(help));
            return None;
        }
        if !is_output && !of_time && !matches!(outside, Some(Read::Source(_))) {
            let (message, help) = match outside {
                Some(_) => (
                    "it is a coordinate or a measurement, not a signal",
                    "write `measures = \"angle\"`, \"speed\" or \"torque\", with its `shaft` or `element`",
                ),
                None => (
                    "a run does not have this signal at every instant",
                    "name a signal of a vehicle such as `car.a_y`, a block without a sample time, a reference or a disturbance, or a signal of the file that reads no sensor",
                ),
            };
            let message = format!("`signal` of sensor `{}`: `{}`: {message}", shortened(name), shortened(signal));
            out.push(
                Diagnostic::error("sensor::signal", message)
                    .at(place.clone(), "cannot be measured like this")
                    .help(help),
            );
            return None;
        }
        let mut graph = Graph::default();
        let value = graph.new_symbol(signal.to_string(), dimension);
        let symbol = graph.symbol_of(value)?;
        let element = self.document.elements.get(name)?;
        // Errors in its other keys are reported where the element is read.
        let values = self.reader.values(element.kind.fields, &element.table, name, &mut Vec::new());
        Some(Task {
            name: format!("sensor {name}"),
            period: values.exact("sample_time").cloned(),
            graph,
            reads: vec![(symbol, Read::Source(signal.to_string()))],
            memory: Vec::new(),
            outputs: vec![TaskAnswer {
                name: name.to_string(),
                dimension,
                description: format!("reading of sensor {name}"),
                value,
            }],
            moving: vec![symbol],
            names: Vec::new(),
            order: Vec::new(),
            lists: Lists::default(),
        })
    }

    /// A signal that depends on coordinates, as an output at every instant, for the results. Not if it reads a sensor that
    /// needs samples.
    fn column(&mut self, signal: &'a SignalTable, out: &mut Vec<Diagnostic>) {
        if signal.formula.is_none() {
            return;
        }
        self.make(Source::Formula(signal), out);
        let Some(Some(found)) = self.formulas.get(signal.name.as_str()) else { return };
        let needs_samples = |name: &String| {
            let outside = self.outside.get(name);
            matches!(outside, Some(Outside { read: Read::Sensor(sensor), .. }) if !self.document.reads_at_every_instant(sensor))
        };
        if found.reads.iter().any(needs_samples) {
            return;
        }
        let (outputs, reads) = (vec![(String::new(), found.value, found.dimension)], Arc::clone(&found.reads));
        self.made.insert(&signal.name, Some(Made { period: None, outputs, memory: Vec::new(), reads }));
    }

    fn diagnostic(&self, mut error: UnitError, text: &str, (place, what): (&Place, &str)) -> Diagnostic {
        let at = place.part(text, error.span.clone());
        let name = text.get(error.span.clone()).unwrap_or_default().trim_matches('\'').to_string();
        if error.message.starts_with("there is no parameter") && !error.message.contains("follow a number") {
            error.code = "name::unknown";
            error.message = format!("there is no `{}` that a block can read", shortened(&name));
            let document = self.document;
            let readable_names = || {
                let signals = document.signals.iter().map(|signal| signal.name.as_str());
                let blocks = document.blocks.iter().map(|block| block.name.as_str());
                let parameters = document.parameters.iter().map(|parameter| parameter.name.as_str());
                let outputs = self.outputs.keys().map(String::as_str);
                let outside = self.outside.iter().map(|outside| outside.name.as_str());
                let sensors = document.signal_sensors().map(|(sensor, ..)| sensor);
                outside.chain(sensors).chain(signals).chain(blocks).chain(outputs).chain(parameters)
            };
            let declared_whole =
                readable_names().find(|candidate| candidate.contains('-') && text.contains(*candidate));
            error.help = Some(match nearest(&name, readable_names()) {
                _ if declared_whole.is_some() => {
                    let whole = declared_whole.unwrap_or_default();
                    format!("in an expression `-` is minus: write the name in quotes, `'{whole}'`")
                }
                Some(near) => format!("did you mean `{near}`?"),
                None => format!(
                    "a block reads angles and speeds (`rack.s`, `column.w`), sensors, signals, other blocks, parameters, the time `t` and \
                     references: those that laws and blocks give as `reference`, and those of a program, `references = [{{ name = \"{name}\", unit = \"rad\" }}]`"
                ),
            });
        }
        let diagnostic = Diagnostic::error(error.code, format!("{what}: {}", error.message)).at(at, "");
        Diagnostic { help: error.help, ..diagnostic }
    }
}

impl Blocks<'_, '_, '_> {
    /// Known bounds of the outputs of monitors and machines.
    fn assumptions(&self, graph: &Graph) -> Assumptions {
        let symbol = |name: &str| self.outputs.get(name).and_then(|(expr, _)| graph.symbol_of(*expr));
        let mut assumptions = Assumptions::default();
        let mut one_of = |names: Vec<String>| {
            let symbols: Vec<Symbol> = names.iter().filter_map(|name| symbol(name)).collect();
            assumptions.not_negative(symbols.iter().copied());
            assumptions.bounded(&symbols, Rational::ONE);
        };
        for block in self.document.blocks.iter().filter(|block| block.kind.keyword == "monitor") {
            one_of(vec![block.name.clone()]);
        }
        for (name, states, _) in &self.machines {
            one_of(states.iter().map(|state| outside_name(name, state)).collect());
        }
        let counts = self.machines.iter().flat_map(|(name, ..)| [outside_name(name, "since"), outside_name(name, "")]);
        assumptions.not_negative(counts.filter_map(|name| symbol(&name)));
        assumptions
    }

    /// Warns of transitions that overlap, and of those that are never taken.
    fn check_transitions(&self, out: &mut Vec<Diagnostic>) {
        let graph = self.graph.borrow();
        let assumptions = self.assumptions(&graph);
        for (name, states, guards) in &self.machines {
            overlaps::check(&format!("block `{}`", shortened(name)), (states, guards), (&graph, &assumptions), out);
        }
    }
}

impl<'a> Blocks<'a, '_, '_> {
    /// Bounds of outputs by kind: alarms and states from 0 to 1, counts from 0 on.
    fn symbol_bounds(&self) -> BTreeMap<String, Interval> {
        let mut out = BTreeMap::new();
        let to = |high: f64| Interval { low: 0.0, high };
        out.extend(self.monitors.iter().map(|monitor| (monitor.name.clone(), to(1.0))));
        for (name, states, _) in &self.machines {
            out.extend(states.iter().map(|state| (outside_name(name, state), to(1.0))));
            out.insert(outside_name(name, ""), to(states.len() as f64 - 1.0));
            out.insert(outside_name(name, "since"), to(f64::INFINITY));
        }
        out
    }

    /// Warns of monitors that never or always give an alarm, with the outputs of blocks expanded.
    fn check_monitors(&self, order: &[Ordered<'a>], out: &mut Vec<Diagnostic>) {
        if self.monitors.is_empty() {
            return;
        }
        let mut graph = self.graph.borrow().clone();
        let own = self.symbol_bounds();
        let symbol = |name: &str| self.outputs.get(name).and_then(|(expr, _)| self.graph.borrow().symbol_of(*expr));
        let bounds: HashMap<Symbol, Interval> =
            own.iter().filter_map(|(name, bound)| Some((symbol(name)?, *bound))).collect();
        let mut values = Substitution::default();
        for Ordered { name, value, .. } in order.iter().filter(|answer| !own.contains_key(&answer.name)) {
            if let Some(symbol) = symbol(name) {
                let value = values.of(&mut graph, &[*value])[0];
                values.set(symbol, value);
            }
        }
        let (assumptions, noises) = (self.assumptions(&graph), self.noises());
        for monitor in &self.monitors {
            let what = format!("block `{}`", shortened(&monitor.name));
            let compared = values.of(&mut graph, &[monitor.residual, monitor.threshold]);
            let [residual, threshold] = compared[..] else { continue };
            let before = out.len();
            monitors::check(&what, (monitor, [residual, threshold]), &mut graph, (&bounds, &assumptions), out);
            if out.len() == before {
                monitors::check_noise(&what, (monitor, [residual, threshold]), &mut graph, &noises, out);
            }
        }
    }

    /// The noise of each sensor that has some.
    fn noises(&self) -> HashMap<&'a str, f64> {
        let sensors = self.document.elements.iter().filter(|element| element.kind.keyword == "sensor");
        let noise = |sensor: &'a Instance| {
            let values = self.reader.values(sensor.kind.fields, &sensor.table, &sensor.name, &mut Vec::new());
            Some((sensor.name.as_str(), values.number("noise")?))
        };
        sensors.filter_map(noise).collect()
    }
}

/// The unit that a table states.
pub(super) fn unit_of(table: &Table, what: &str, out: &mut Vec<Diagnostic>) -> Option<Dimension> {
    let Some(Placed { value: Value::Word(text), place }) = table.values.get("unit") else { return None };
    match crate::units::parse_quantity(&format!("1 {text}")) {
        Ok((_, dimension)) => Some(dimension),
        Err(error) => {
            let message = format!("`unit` of {what}: {}", error.message);
            let diagnostic = Diagnostic::error(error.code, message).at(place.clone(), "no unit");
            out.push(diagnostic.help("write a unit such as \"N m\""));
            None
        }
    }
}

/// Warns of an unstable transfer function.
fn warn_of_growth(values: &Values, table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
    let poles = values.poles("poles").unwrap_or_default();
    let Some((real, imaginary)) = poles.iter().find(|(real, _)| real.signum() > 0) else { return };
    let beside = if imaginary.is_zero() { String::new() } else { format!(" ± {}j", imaginary.to_f64().abs()) };
    let message = format!(
        "{what}: its pole at {}{beside} 1/s has a real part above zero: its output grows without bound for any input",
        real.to_f64()
    );
    let diagnostic = Diagnostic::warning("block::unstable", message).at(TableReader::place(table, "poles"), "grows");
    out.push(
        diagnostic
            .help("check the sign: a decaying output has negative poles; leave it if a loop around it stabilises it"),
    );
}

/// The help for an algebraic loop.
const BREAK_CIRCLE: &str =
    "put a `delay` or a forward `integrator` into it: their output does not depend on their present input";
