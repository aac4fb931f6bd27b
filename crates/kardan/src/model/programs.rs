//! Blocks and what they read, put together to tasks: names looked up, units checked, in the order in which they compute.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use super::document::{BlockTable, Document, Instance, SignalTable};
use super::functions::Functions;
use super::monitors::{self, WrittenMonitor};
use super::overlaps::{self, Known, WrittenGuard};
use super::table_reader::TableReader;
use crate::block::{BlockKind, Expressions, Guard, List, Rule, Wiring};
use crate::diagnostics::{Diagnostic, Severity, nearest, quoted, shortened};
use crate::element::{Mistake, Values};
use crate::entries::Place;
use crate::expr::{Expr, Floating, Graph, Interval, Lookup, Named, OfTime, Symbol, Traced, lower};
use crate::names::SignalName;
use crate::num::Rational;
use crate::program::{AS_READ, Entry, KeyRule, Lists, Looked, Read, Step, TableCall, Task, TaskAnswer};
use crate::schema::{Kind, Placed, Scalar, Table, Value};
use crate::units::{Dimension, Exact, Expression, UnitError, shown_quantity};

/// The blocks of a model as tasks, with what comes from outside.
#[derive(Debug, Clone, Default)]
pub struct Programs {
    /// One task for each sample time, the shortest first.
    pub tasks: Vec<Arc<Task>>,
    /// Sensors of signals, each as a task that answers its signal, by the name of the sensor.
    pub sensors: Vec<Arc<Task>>,
    /// Functions of time that tasks read, by name.
    pub functions: Vec<(String, Arc<OfTime>)>,
    /// What sampled laws tell that tasks read, by name: `column.rk.disturbance`.
    pub told: Vec<(String, Dimension)>,
    /// What is looked at in the rows of a run.
    pub looked: Looked,
    /// One has a mistake, or names what has one, which was told: what they compute is not known.
    pub broken: bool,
}

impl Programs {
    /// All answers.
    pub fn answers(&self) -> impl Iterator<Item = &TaskAnswer> {
        self.tasks.iter().flat_map(|task| &task.answers)
    }
}

/// Something outside of the blocks that they may read by its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Outside {
    /// The name.
    pub name: String,
    /// What it is.
    pub read: Read,
    /// What it is of.
    pub dimension: Dimension,
}

/// A law that is a program: its name, its sample time, what it commands as it is written.
pub(crate) struct Commands<'a> {
    pub control: String,
    pub period: Option<Exact>,
    pub written: &'a [(Placed<String>, Placed<Scalar>)],
}

/// What a law tells one input.
struct Command {
    name: String,
    value: Expr,
    dimension: Dimension,
    reads: BTreeSet<String>,
    place: Place,
}

/// Answers of a block: names behind its own, values and dimensions.
type Answers = Vec<(String, Expr, Dimension)>;
/// What a block remembers: symbol, start, next.
type Memory = Vec<(Expr, Expr, Expr)>;
/// Keys that are expressions, with the name in the key where they stand by name.
type Given = Vec<(&'static str, Option<String>, (Expr, Dimension))>;

/// A block that was written.
#[derive(Debug, Clone)]
struct Made {
    period: Option<Exact>,
    answers: Answers,
    memory: Memory,
    /// Names in its expressions, signals written out.
    reads: BTreeSet<String>,
}

/// The blocks of a document in the making.
pub(crate) struct Blocks<'a, 'd, 'f> {
    reader: &'a TableReader<'d>,
    document: &'a Document,
    functions: &'f mut Functions<'a, 'd>,
    graph: RefCell<Graph>,
    outside: Vec<Outside>,
    /// What was read of it, with what stands for it.
    read: BTreeMap<String, (Expr, Dimension)>,
    /// What stands for the answers of blocks.
    answers: BTreeMap<String, (Expr, Dimension)>,
    /// States of observers as their own keys name them, by name: they move, where what is answered stands still from one sample to the next.
    states: BTreeMap<String, (Expr, Dimension)>,
    made: BTreeMap<&'a str, Option<Made>>,
    /// Blocks and signals that wait for others.
    open: Vec<&'a str>,
    used_functions: Vec<(String, Arc<OfTime>)>,
    /// Machines, with their states and transitions.
    machines: Vec<(&'a str, Vec<String>, Vec<WrittenGuard>)>,
    monitors: Vec<WrittenMonitor>,
    calls: Vec<TableCall>,
    rules: Vec<KeyRule>,
}

fn errors(out: &[Diagnostic]) -> usize {
    out.iter().filter(|diagnostic| diagnostic.severity == Severity::Error).count()
}

/// The name of an answer outside.
fn outside_name(block: &str, answer: &str) -> String {
    if answer.is_empty() { block.to_string() } else { format!("{block}.{answer}") }
}

/// The symbols of an answer: `.since` of a machine and others whose units are known before anything is written.
fn foretold(kind: &BlockKind, values: &Values, lists: &[List]) -> Vec<(String, Dimension)> {
    match kind.keyword {
        "state_machine" => {
            let states = values.words("states").unwrap_or_default().iter();
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
        Self {
            reader,
            document,
            functions,
            graph: RefCell::default(),
            outside,
            read: BTreeMap::new(),
            answers: BTreeMap::new(),
            states: BTreeMap::new(),
            made: BTreeMap::new(),
            open: Vec::new(),
            used_functions: Vec::new(),
            machines: Vec::new(),
            monitors: Vec::new(),
            calls: Vec::new(),
            rules: Vec::new(),
        }
    }

    /// All blocks as tasks, and what the laws that are programs command, by their names; what is wrong is told.
    pub(crate) fn tasks(
        mut self,
        laws: &[Commands<'a>],
        out: &mut Vec<Diagnostic>,
    ) -> (Programs, Vec<(String, Arc<Task>)>) {
        let before = errors(out);
        for block in &self.document.blocks {
            self.block(block, out);
        }
        for signal in &self.document.signals {
            self.column(signal, out);
        }
        let sensors: Vec<Arc<Task>> =
            self.document.signal_sensors().filter_map(|sensor| self.sensor(sensor, out)).map(Arc::new).collect();
        let commands: Vec<Vec<Command>> = laws.iter().map(|law| self.commands(law, out)).collect();
        let nothing = (Programs { broken: true, ..Programs::default() }, Vec::new());
        // What names something in doubt is left out without a word.
        let is_missing = |made: &Option<Made>| made.is_none();
        let is_short = |(law, commands): (&Commands<'_>, &Vec<Command>)| law.written.len() > commands.len();
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
        (Programs { tasks, sensors, functions, told: self.told(), looked, broken: false }, of_laws)
    }

    /// What was read of sampled laws, sorted.
    fn told(&self) -> Vec<(String, Dimension)> {
        let of_law = |name: &String| self.document.controls.iter().any(|law| law.name == SignalName::new(name).element);
        self.read.iter().filter(|(name, _)| of_law(name)).map(|(name, (_, of))| (name.clone(), *of)).collect()
    }

    /// What a law commands; what is wrong is told.
    fn commands(&mut self, law: &Commands<'a>, out: &mut Vec<Diagnostic>) -> Vec<Command> {
        let mut found = Vec::new();
        for (name, scalar) in law.written {
            let label = format!("`{}` in `commands` of control `{}`", shortened(&name.value), law.control);
            let motor = self.document.elements.iter().find(|one| one.name == name.value);
            let wanted = match motor {
                Some(one) if one.kind.keyword == "voltage_source" => Dimension::VOLTAGE,
                Some(one) if one.kind.keyword == "motor" && one.table.along_masses => Dimension::FORCE,
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
            let Some((value, dimension)) = self.expression(read, (&scalar.place, &label), &mut reads, out) else {
                continue;
            };
            if !wanted.is_like(&dimension) {
                let message = format!("{label}: expected {}, found {}", wanted.noun(), dimension.noun());
                let help = format!("it should come out in a unit such as {}", wanted.example());
                out.push(
                    Diagnostic::error("unit::dimension", message).at(scalar.place.clone(), dimension.noun()).help(help),
                );
                continue;
            }
            found.push(Command {
                name: name.value.clone(),
                value,
                dimension: wanted,
                reads,
                place: scalar.place.clone(),
            });
        }
        found
    }

    fn symbol(&self, name: &str, dimension: Dimension) -> Expr {
        self.graph.borrow_mut().new_symbol(name.to_string(), dimension)
    }

    /// What stands for an answer, of a dimension.
    fn answer_symbol(&mut self, name: String, dimension: Dimension) -> (Expr, Dimension) {
        if let Some(known) = self.answers.get(&name) {
            return *known;
        }
        let found = (self.symbol(&name, dimension), dimension);
        self.answers.insert(name, found);
        found
    }

    /// Writes a block; nothing if it has a mistake, which was told.
    fn block(&mut self, block: &'a BlockTable, out: &mut Vec<Diagnostic>) -> Option<Made> {
        if let Some(made) = self.made.get(block.name.as_str()) {
            return made.clone();
        }
        self.open.push(&block.name);
        let made = self.written(block, out);
        self.open.pop();
        self.made.insert(&block.name, made.clone());
        made
    }

    fn written(&mut self, block: &'a BlockTable, out: &mut Vec<Diagnostic>) -> Option<Made> {
        let BlockTable { kind, name, place, table } = block;
        let what = format!("block `{}`", shortened(name));
        let before = errors(out);
        let values = self.reader.values(table.fields, table, &what, out);
        let unit = self.unit(table, &what, out);
        if errors(out) > before {
            return None;
        }
        if kind.keyword == "transfer_function" {
            warn_of_growth(&values, table, &what, out);
        }
        let lists = self.lists(table, out);
        // What is known of it already may be read by what it reads.
        let mut own = Vec::new();
        for (answer, dimension) in foretold(kind, &values, &lists) {
            let outside = outside_name(name, &answer);
            let (answered, _) = self.answer_symbol(outside.clone(), dimension);
            if kind.keyword == "observer" {
                let moves = self.symbol(&outside, dimension);
                self.states.insert(outside, (moves, dimension));
                own.push([moves, answered]);
            }
        }
        if let Some(dimension) = unit {
            self.answer_symbol(name.clone(), dimension);
        }
        let mut reads = BTreeSet::new();
        let mut given = self.given(table, &what, &mut reads, out)?;
        if kind.keyword == "monitor" {
            self.take_as_read(&mut given);
        }
        let guards = self.guards(table, &values, &what, &mut reads, out)?;
        if kind.keyword == "monitor" {
            self.watch(name, table, &given);
        }
        let called = match values.word("table").filter(|_| kind.keyword == "table") {
            Some(name) => self.functions.table_of(name, out),
            None => None,
        };
        if let Some(name) = values.word("table").filter(|_| called.is_some()) {
            let inputs = ["input", "input_2"].into_iter();
            let at = inputs.filter_map(|key| given.iter().find(|(other, ..)| *other == key)).map(|(_, _, (at, _))| *at);
            let at = at.collect();
            self.reads_table(name, called.clone(), at);
        }
        let period = values.exact("sample_time").cloned();
        if kind.keyword == "state_machine" {
            self.machines.push((name, values.words("states").unwrap_or_default().to_vec(), guards.clone()));
        }
        let found = self.wire(kind, (&values, period.clone(), called, lists), (given, guards, own));
        match found {
            Ok((answers, memory, rules)) => {
                self.rules.extend(rules.into_iter().map(|rule| KeyRule { block: block.name.clone(), ..rule }));
                self.finished(block, (answers, memory, period, reads), unit, out)
            }
            Err(mistake) => {
                let at = table.values.get(mistake.key).map_or(place, |value| &value.place);
                let told = Diagnostic::error("block::key", format!("{what}: {}", mistake.message));
                out.push(told.at(at.clone(), "").help(mistake.help));
                None
            }
        }
    }

    /// Takes down what a monitor compares.
    fn watch(&mut self, name: &str, table: &Table, given: &Given) {
        let of = |key: &str| given.iter().find(|(other, ..)| *other == key).map(|(_, _, found)| *found);
        let (Some((residual, _)), Some((threshold, _))) = (of("residual"), of("threshold")) else { return };
        let place = TableReader::place(table, "threshold");
        let waits = table.values.contains_key("debounce");
        self.monitors.push(WrittenMonitor { name: name.to_string(), residual, threshold, place, waits });
    }

    /// The keys of a block that are expressions; nothing if one has a mistake, which was told.
    fn given(
        &mut self,
        table: &Table,
        what: &str,
        reads: &mut BTreeSet<String>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Given> {
        let mut given = Vec::new();
        for field in table.fields {
            match (field.kind, table.values.get(field.name)) {
                (Kind::Expression, Some(Placed { value: Value::Scalar(Scalar::Expression(read)), place })) => {
                    let label = format!("`{}` of {what}", field.name);
                    given.push((field.name, None, self.expression(read, (place, &label), reads, out)?));
                }
                (Kind::Expressions, Some(Placed { value: Value::Map(entries), .. })) => {
                    for (name, scalar) in entries {
                        let Scalar::Expression(read) = &scalar.value else { continue };
                        let label = format!("`{}` in `{}` of {what}", shortened(&name.value), field.name);
                        let found = self.expression(read, (&scalar.place, &label), reads, out)?;
                        given.push((field.name, Some(name.value.clone()), found));
                    }
                }
                _ => {}
            }
        }
        Some(given)
    }

    /// Lets a kind write itself.
    fn wire(
        &self,
        kind: &BlockKind,
        (values, sample_time, table, lists): (&Values, Option<Exact>, Option<Arc<Lookup>>, Vec<List>),
        (given, guards, own): (Given, Vec<WrittenGuard>, Vec<[Expr; 2]>),
    ) -> Result<(Answers, Memory, Vec<KeyRule>), Mistake> {
        let graph = &self.graph;
        let traced = |expr: Expr| Traced::new(graph, expr);
        let (mut alone, mut named) = (BTreeMap::new(), BTreeMap::<&str, Expressions<'_>>::new());
        for (key, name, (expr, dimension)) in given {
            match name {
                None => drop(alone.insert(key, (traced(expr), dimension))),
                Some(name) => named.entry(key).or_default().push((name, traced(expr), dimension)),
            }
        }
        let mut wiring = Wiring {
            graph,
            given: alone,
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
            answers: Vec::new(),
            rules: RefCell::default(),
        };
        (kind.write)(&mut wiring)?;
        let rule = |Rule { what, value, above, dimension }: Rule<'_>| {
            let block = String::new();
            KeyRule { block, what, value: value.expr(graph), above, dimension }
        };
        let rules = wiring.rules.take().into_iter().map(rule).collect();
        let answers =
            wiring.answers.iter().map(|answer| (answer.name.clone(), answer.value.expr(graph), answer.dimension));
        let memory = wiring
            .memory
            .iter()
            .map(|entry| (entry.symbol.expr(graph), entry.start.expr(graph), entry.next.expr(graph)));
        Ok((answers.collect(), memory.collect(), rules))
    }

    /// Checks what a block came out as, and gives its answers to who reads it.
    fn finished(
        &mut self,
        block: &'a BlockTable,
        (mut answers, memory, period, reads): (Answers, Memory, Option<Exact>, BTreeSet<String>),
        unit: Option<Dimension>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Made> {
        let what = format!("block `{}`", shortened(&block.name));
        if let (Some(unit), Some((_, _, found))) = (unit, answers.first())
            && !unit.is_like(found)
        {
            let message = format!("{what} answers {}, not {}", found.noun(), unit.noun());
            let at = TableReader::place(&block.table, "unit");
            let mistake = Diagnostic::error("unit::dimension", message).at(at, "another unit");
            out.push(mistake.help(format!("write a unit such as {}, or leave `unit` out", found.example())));
            return None;
        }
        if let (Some(unit), Some(answer)) = (unit, answers.first_mut()) {
            answer.2 = unit;
        }
        let varies = |expr: Expr| !self.graph.borrow().symbols(&[expr]).is_empty();
        if memory.iter().any(|(_, start, _)| varies(*start)) {
            let at = TableReader::place(&block.table, "initial");
            let mistake =
                Diagnostic::error("block::start", format!("{what}: what it starts with may vary")).at(at, "varies");
            out.push(mistake.help("write it with numbers and parameters alone"));
            return None;
        }
        for (answer, _, dimension) in &answers {
            self.answer_symbol(outside_name(&block.name, answer), *dimension);
        }
        Some(Made { period, answers, memory, reads })
    }

    /// The unit that is stated for an answer.
    fn unit(&self, table: &Table, what: &str, out: &mut Vec<Diagnostic>) -> Option<Dimension> {
        let Some(Placed { value: Value::Word(text), place }) = table.values.get("unit") else { return None };
        match crate::units::parse_quantity(&format!("1 {text}")) {
            Ok((_, dimension)) => Some(dimension),
            Err(error) => {
                let message = format!("`unit` of {what}: {}", error.message);
                let mistake = Diagnostic::error(error.code, message).at(place.clone(), "no unit");
                out.push(mistake.help("write a unit such as \"N m\""));
                None
            }
        }
    }

    /// Lists of quantities by name.
    fn lists(&self, table: &Table, out: &mut Vec<Diagnostic>) -> Vec<List> {
        let mut lists: Vec<List> = Vec::new();
        for field in table.fields.iter().filter(|field| field.kind == Kind::Lists) {
            let Some(Placed { value: Value::Map(entries), .. }) = table.values.get(field.name) else { continue };
            for (name, scalar) in entries {
                let label = format!("`{}` in `{}`", name.value, field.name);
                let Some(found) = self.reader.scalar(scalar, None, &label, out) else { continue };
                match lists.iter_mut().find(|list| list.key == field.name && list.name == name.value) {
                    Some(list) => list.values.push(found),
                    None => lists.push(List { key: field.name, name: name.value.clone(), values: vec![found] }),
                }
            }
        }
        lists
    }

    /// The transitions of a machine; none of a kind that has none. Nothing if one of them has a mistake, which was told.
    fn guards(
        &mut self,
        table: &Table,
        values: &Values,
        what: &str,
        reads: &mut BTreeSet<String>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Vec<WrittenGuard>> {
        let Some(Placed { value: Value::Tables(tables), .. }) = table.values.get("transitions") else {
            return Some(Vec::new());
        };
        let states = values.words("states").unwrap_or_default();
        let mut found = Vec::new();
        for (k, transition) in tables.iter().enumerate() {
            let label = format!("`when` of transition {} of {what}", k + 1);
            let number = |key: &'static str, out: &mut Vec<Diagnostic>| {
                let Some(Placed { value: Value::Word(name), place }) = transition.values.get(key) else { return None };
                let place_of = states.iter().position(|state| state == name);
                if place_of.is_none() {
                    let message =
                        format!("`{key}` of transition {} of {what}: there is no state `{}`", k + 1, shortened(name));
                    let help = match nearest(name, states.iter().map(String::as_str)) {
                        Some(near) => format!("did you mean `{near}`?"),
                        None => format!("its states are {}", quoted(states.iter().map(String::as_str))),
                    };
                    out.push(Diagnostic::error("name::unknown", message).at(place.clone(), "unknown state").help(help));
                }
                place_of
            };
            let ends = [number("from", out), number("to", out)];
            let Some(Placed { value: Value::Scalar(Scalar::Expression(read)), place }) = transition.values.get("when")
            else {
                continue;
            };
            let (when, dimension) = self.expression(read, (place, &label), reads, out)?;
            if dimension != Dimension::NONE {
                let message = format!("{label}: expected a number, found {}", dimension.noun());
                let help = format!("compare it with a threshold: `... > 1 {}`", dimension.si());
                out.push(Diagnostic::error("unit::dimension", message).at(place.clone(), dimension.noun()).help(help));
                return None;
            }
            let [Some(from), Some(to)] = ends else { return None };
            found.push(WrittenGuard { transition: kardan_rt::Transition { from, to }, when, place: place.clone() });
        }
        Some(found)
    }

    /// An expression in the graph of all blocks; nothing if it has a mistake, which was told.
    fn expression(
        &mut self,
        read: &Expression,
        (place, what): (&Place, &str),
        reads: &mut BTreeSet<String>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Expr, Dimension)> {
        let mut names: Vec<(String, Named)> = Vec::new();
        for name in read.names() {
            if let Some(named) = self.named(name, (read, place, what), reads, out)? {
                names.push((name.to_string(), named));
            }
        }
        for name in read.tables() {
            if self.document.tables.iter().any(|(other, _)| other == name) {
                names.push((name.to_string(), Named::Table(self.functions.table_of(name, out)?)));
            }
        }
        let mut known = |_: &mut Graph, name: &str| {
            let found = names.iter().find(|(other, _)| other == name);
            found.map(|(_, named)| named.clone())
        };
        let written = self.graph.borrow_mut().written(read, &mut known);
        match written {
            Ok(found) => {
                let calls = self.graph.borrow_mut().calls(read, &mut known).unwrap_or_default();
                for (name, at) in calls {
                    let table = names.iter().find_map(|(other, named)| match named {
                        Named::Table(table) if *other == name => Some(Arc::clone(table)),
                        _ => None,
                    });
                    self.reads_table(&name, table, at);
                }
                Some(found)
            }
            Err(error) => {
                out.push(self.mistake(error, read.text(), (place, what)));
                None
            }
        }
    }

    /// Takes down where a table is read; those of lanes are left beside the road.
    fn reads_table(&mut self, name: &str, table: Option<Arc<Lookup>>, at: Vec<Expr>) {
        let Some(table) = table.filter(|_| !self.document.lanes.contains(name)) else { return };
        let reader = self.open.last().map_or("commands", |open| open).to_string();
        let known = |call: &TableCall| call.reader == reader && call.name == name && call.at == at;
        if !self.calls.iter().any(known) {
            self.calls.push(TableCall { reader, name: name.to_string(), table, at });
        }
    }

    /// What a name stands for; nothing in the first place if it has a mistake, which was told, and in the second if it is not known.
    fn named(
        &mut self,
        name: &str,
        (read, place, what): (&Expression, &Place, &str),
        reads: &mut BTreeSet<String>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Option<Named>> {
        let document = self.document;
        let varying = |(expr, dimension): (Expr, Dimension)| Some(Some(Named::Varying(expr, dimension)));
        let head = SignalName::new(name).element;
        if let Some(block) = document.blocks.iter().find(|block| block.name == name || block.name == head) {
            if let Some(state) = self.states.get(name).filter(|_| self.open.last() == Some(&block.name.as_str())) {
                return varying(*state);
            }
            reads.insert(name.to_string());
            if let Some(known) = self.answers.get(name) {
                return varying(*known);
            }
            if self.open.contains(&block.name.as_str()) && block.name == name {
                let message = format!("{what}: `{name}` follows from itself, so its unit is not known");
                let at = place.part(read.text(), 0..read.text().len());
                let mistake = Diagnostic::error("block::unit", message).at(at, "in a circle");
                out.push(mistake.help(format!("state the unit of its answer: `unit = \"rad\"` in `[block.{name}]`")));
                return None;
            }
            // What a block does not answer is not known, also where it reads itself.
            if self.open.contains(&block.name.as_str()) {
                return Some(None);
            }
            self.block(block, out)?;
            return match self.answers.get(name) {
                Some(known) => varying(*known),
                None => Some(None),
            };
        }
        if let Some(signal) = document.signals.iter().find(|signal| signal.name == name) {
            if let Some(written) = document.program_of(signal) {
                return self.signal(&signal.name, (written, read, place, what), reads, out);
            }
            reads.insert(name.to_string());
            if let Some(known) = self.read.get(name) {
                return varying(*known);
            }
            let function = Arc::new(self.functions.of_time_named(name, out)?);
            let dimension = function.dimension();
            self.used_functions.push((name.to_string(), function));
            return varying(self.read_outside(Outside {
                name: name.into(),
                read: Read::Source(name.into()),
                dimension,
            }));
        }
        if let Some(sensor) = document.signal_sensors().find(|(sensor, ..)| *sensor == name) {
            reads.insert(name.to_string());
            let dimension = match self.read.get(name) {
                Some((_, dimension)) => *dimension,
                None => self.measured(sensor, out)?.1,
            };
            return varying(self.read_outside(Outside {
                name: name.into(),
                read: Read::Sensor(name.into()),
                dimension,
            }));
        }
        if let Some(outside) = self.outside.iter().find(|outside| outside.name == name).cloned() {
            reads.insert(name.to_string());
            return varying(self.read_outside(outside));
        }
        if let Some(value) = self.reader.value_of(name, out) {
            let (value, dimension) = value?;
            return Some(Some(Named::Constant(value, dimension)));
        }
        if document.doubts.has(name) || document.doubts.has(head) { None } else { Some(None) }
    }

    /// Lets the residual of a monitor see sensors as they read, no number where one gives none: nothing else has a use for that.
    fn take_as_read(&mut self, given: &mut Given) {
        let sensors = self.outside.iter().filter_map(|outside| match &outside.read {
            Read::Sensor(sensor) => Some((self.read.get(&outside.name)?.0, outside.clone(), sensor.clone())),
            _ => None,
        });
        for (expr, outside, sensor) in sensors.collect::<Vec<_>>() {
            let Some(symbol) = self.graph.borrow().symbol_of(expr) else { continue };
            let name = format!("{}{AS_READ}", outside.name);
            let (as_read, _) = self.read_outside(Outside { name, read: Read::AsRead(sensor), ..outside });
            let mut graph = self.graph.borrow_mut();
            for (_, _, (value, _)) in given.iter_mut().filter(|(key, ..)| *key == "residual") {
                *value = graph.substitute(&[*value], &[(symbol, as_read)])[0];
            }
        }
    }

    fn read_outside(&mut self, outside: Outside) -> (Expr, Dimension) {
        if let Some(known) = self.read.get(&outside.name) {
            return *known;
        }
        let found = (self.symbol(&outside.name, outside.dimension), outside.dimension);
        self.read.insert(outside.name.clone(), found);
        if !self.outside.contains(&outside) {
            self.outside.push(outside);
        }
        found
    }

    /// A signal that names what moves, written out.
    fn signal(
        &mut self,
        name: &'a str,
        (written, read, place, what): (Placed<Expression>, &Expression, &Place, &str),
        reads: &mut BTreeSet<String>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Option<Named>> {
        if let Some(first) = self.open.iter().position(|open| *open == name) {
            let circle: Vec<&str> = self.open[first..].iter().copied().chain([name]).collect();
            let message = format!("{what}: `{name}` follows from itself: {}", circle.join(" from "));
            let at = place.part(read.text(), 0..read.text().len());
            out.push(Diagnostic::error("signal::circle", message).at(at, "in a circle").help(BREAK_CIRCLE));
            return None;
        }
        self.open.push(name);
        let label = format!("signal `{}`", shortened(name));
        let found = self.expression(&written.value, (&written.place, &label), reads, out);
        self.open.pop();
        let (expr, dimension) = found?;
        Some(Some(Named::Varying(expr, dimension)))
    }

    /// What a sensor of a signal measures: what stands for the signal, and what that is of.
    fn measured(
        &mut self,
        (sensor, signal, place): (&'a str, &'a str, &Place),
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Expr, Dimension)> {
        let what = format!("`signal` of sensor `{}`", shortened(sensor));
        let mut refuse = |message: &str, label: &str, help: &str| {
            let told = Diagnostic::error("sensor::signal", format!("{what}: {message}"));
            out.push(told.at(place.clone(), label).help(help));
            None
        };
        let quoted = format!("'{}'", signal.trim_matches('\''));
        let read = Expression::parse_law(signal).ok().filter(|read| read.names() == [signal]);
        let Some(read) = read.or_else(|| Expression::parse_law(&quoted).ok().filter(|_| !signal.contains(' '))) else {
            let help =
                "write a formula as a signal of its own, `[signal.NAME]` with kind = \"expression\", and name that";
            return refuse("a sensor measures one signal, by its name", "no name", help);
        };
        if self.document.signal_sensors().any(|(other, ..)| other == signal) {
            let help = "name what that one measures, or put a block between";
            return refuse("a sensor measures no other sensor", "a sensor", help);
        }
        self.expression(&read, (place, &what), &mut BTreeSet::new(), out)
    }

    /// A sensor of a signal as a task that answers its signal; nothing if it has a mistake, which was told.
    fn sensor(&mut self, sensor: (&'a str, &'a str, &Place), out: &mut Vec<Diagnostic>) -> Option<Task> {
        let (_, dimension) = self.measured(sensor, out)?;
        let (name, signal, place) = sensor;
        let answered = self.answers.contains_key(signal) || self.made.get(signal).is_some_and(Option::is_some);
        let of_time = self.used_functions.iter().any(|(other, _)| other == signal);
        let outside = self.outside.iter().find(|outside| outside.name == signal).map(|outside| &outside.read);
        let block = self.of_name(signal).and_then(|block| self.made.get(block)?.as_ref());
        let of_law = self.document.controls.iter().any(|law| law.name == SignalName::new(signal).element);
        if block.is_some_and(|made| made.period.is_some()) || of_law {
            let message = format!(
                "`signal` of sensor `{}`: `{}` is a number of a control unit, which no sensor measures",
                shortened(name),
                shortened(signal)
            );
            let help = "let blocks read it by its name; what is computed at every instant can be measured";
            out.push(Diagnostic::error("sensor::signal", message).at(place.clone(), "has a sample time").help(help));
            return None;
        }
        if !answered && !of_time && !matches!(outside, Some(Read::Source(_))) {
            let (message, help) = match outside {
                Some(_) => (
                    "it is no signal, but what moves or is measured",
                    "write `measures = \"angle\"`, \"speed\" or \"torque\", with its `shaft` or `element`",
                ),
                None => (
                    "it is no signal that a run has at every instant",
                    "name what a vehicle tells such as `car.a_y`, a block without a sample time, a reference or a disturbance, or a signal of the file that reads no sensor",
                ),
            };
            let message = format!("`signal` of sensor `{}`: `{}`: {message}", shortened(name), shortened(signal));
            out.push(Diagnostic::error("sensor::signal", message).at(place.clone(), "not measured so").help(help));
            return None;
        }
        let mut graph = Graph::default();
        let value = graph.new_symbol(signal.to_string(), dimension);
        let symbol = graph.symbol_of(value)?;
        let element = self.document.elements.iter().find(|element| element.name == name)?;
        // What is wrong with its other keys is told where the element is read.
        let values = self.reader.values(element.kind.fields, &element.table, name, &mut Vec::new());
        Some(Task {
            name: format!("sensor {name}"),
            period: values.exact("sample_time").cloned(),
            graph,
            reads: vec![(symbol, Read::Source(signal.to_string()))],
            memory: Vec::new(),
            answers: vec![TaskAnswer {
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

    /// A signal that names what moves, as something that is answered at every instant: so results have it. Not where it reads a sensor that
    /// needs samples.
    fn column(&mut self, signal: &'a SignalTable, out: &mut Vec<Diagnostic>) {
        let Some(written) = self.document.program_of(signal) else { return };
        let (mut reads, name, place) = (BTreeSet::new(), signal.name.as_str(), &written.place);
        let label = format!("signal `{}`", shortened(name));
        let found = self.signal(name, (written.clone(), &written.value, place, &label), &mut reads, out);
        let Some(Some(Named::Varying(value, dimension))) = found else { return };
        let needs_samples = |name: &String| {
            let outside = self.outside.iter().find(|outside| outside.name == *name);
            matches!(outside, Some(Outside { read: Read::Sensor(sensor), .. }) if !self.document.reads_at_every_instant(sensor))
        };
        if reads.iter().any(needs_samples) {
            return;
        }
        let answers = vec![(String::new(), value, dimension)];
        self.made.insert(name, Some(Made { period: None, answers, memory: Vec::new(), reads }));
    }

    fn mistake(&self, mut error: UnitError, text: &str, (place, what): (&Place, &str)) -> Diagnostic {
        let at = place.part(text, error.span.clone());
        let name = text.get(error.span.clone()).unwrap_or_default().trim_matches('\'').to_string();
        if error.message.starts_with("there is no parameter") && !error.message.contains("behind a number") {
            error.code = "name::unknown";
            error.message = format!("there is no `{}` that a block can read", shortened(&name));
            let document = self.document;
            let known = || {
                let signals = document.signals.iter().map(|signal| signal.name.as_str());
                let blocks = document.blocks.iter().map(|block| block.name.as_str());
                let parameters = document.parameters.iter().map(|parameter| parameter.name.as_str());
                let answers = self.answers.keys().map(String::as_str);
                let outside = self.outside.iter().map(|outside| outside.name.as_str());
                let sensors = document.signal_sensors().map(|(sensor, ..)| sensor);
                outside.chain(sensors).chain(signals).chain(blocks).chain(answers).chain(parameters)
            };
            let known_whole = known().find(|other| other.contains('-') && text.contains(*other));
            error.help = Some(match nearest(&name, known()) {
                _ if known_whole.is_some() => {
                    let whole = known_whole.unwrap_or_default();
                    format!("in an expression `-` is minus: write the name in quotes, `'{whole}'`")
                }
                Some(near) => format!("did you mean `{near}`?"),
                None => "a block reads angles and speeds (`rack.s`, `column.w`), sensors, references, signals, other blocks, parameters \
                         and the time `t`"
                    .into(),
            });
        }
        let diagnostic = Diagnostic::error(error.code, format!("{what}: {}", error.message)).at(at, "");
        Diagnostic { help: error.help, ..diagnostic }
    }
}

impl Blocks<'_, '_, '_> {
    /// What is known of the answers of monitors and machines.
    fn known(&self, graph: &Graph) -> Known {
        let symbol = |name: &str| self.answers.get(name).and_then(|(expr, _)| graph.symbol_of(*expr));
        let mut known = Known::default();
        let mut one_of = |names: Vec<String>| {
            let symbols: Vec<Symbol> = names.iter().filter_map(|name| symbol(name)).collect();
            known.not_negative.extend(&symbols);
            known.together.push((symbols, Rational::ONE));
        };
        for block in self.document.blocks.iter().filter(|block| block.kind.keyword == "monitor") {
            one_of(vec![block.name.clone()]);
        }
        for (name, states, _) in &self.machines {
            one_of(states.iter().map(|state| outside_name(name, state)).collect());
        }
        let counts = self.machines.iter().flat_map(|(name, ..)| [outside_name(name, "since"), outside_name(name, "")]);
        known.not_negative.extend(counts.filter_map(|name| symbol(&name)));
        known
    }

    /// Warns of transitions that overlap, and of those that are never taken.
    fn check_transitions(&self, out: &mut Vec<Diagnostic>) {
        let graph = self.graph.borrow();
        let known = self.known(&graph);
        for (name, states, guards) in &self.machines {
            overlaps::check(&format!("block `{}`", shortened(name)), (states, guards), (&graph, &known), out);
        }
    }
}

impl<'a> Blocks<'a, '_, '_> {
    /// What is known of answers by what they are: alarms and states from 0 to 1, counts from 0 on.
    fn known_bounds(&self) -> BTreeMap<String, Interval> {
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

    /// Warns of monitors that never or always tell of something, with the answers of blocks written out.
    fn check_monitors(&self, order: &[(&'a str, String)], out: &mut Vec<Diagnostic>) {
        let mut graph = self.graph.borrow().clone();
        let own = self.known_bounds();
        let symbol = |name: &str| self.answers.get(name).and_then(|(expr, _)| self.graph.borrow().symbol_of(*expr));
        let bounds: Vec<(Symbol, Interval)> =
            own.iter().filter_map(|(name, bound)| Some((symbol(name)?, *bound))).collect();
        let mut values: Vec<(Symbol, Expr)> = Vec::new();
        for (block, outside) in order.iter().filter(|(_, outside)| !own.contains_key(outside)) {
            let answers = self.made.get(block).and_then(Option::as_ref).map_or(&[][..], |made| &made.answers);
            let answer = answers.iter().find(|(name, ..)| outside_name(block, name) == *outside);
            let (Some((_, value, _)), Some(symbol)) = (answer, symbol(outside)) else { continue };
            let value = graph.substitute(&[*value], &values)[0];
            values.push((symbol, value));
        }
        let (known, noises) = (self.known(&graph), self.noises());
        for monitor in &self.monitors {
            let what = format!("block `{}`", shortened(&monitor.name));
            let compared = graph.substitute(&[monitor.residual, monitor.threshold], &values);
            let [residual, threshold] = compared[..] else { continue };
            let before = out.len();
            monitors::check(&what, (monitor, [residual, threshold]), graph.clone(), (&bounds, &known), out);
            if out.len() == before {
                monitors::check_noise(&what, (monitor, [residual, threshold]), graph.clone(), &noises, out);
            }
        }
    }

    /// The noise of each sensor that has some.
    fn noises(&self) -> Vec<(String, f64)> {
        let sensors = self.document.elements.iter().filter(|element| element.kind.keyword == "sensor");
        let noise = |sensor: &Instance| {
            let values = self.reader.values(sensor.kind.fields, &sensor.table, &sensor.name, &mut Vec::new());
            Some((sensor.name.clone(), values.number("noise")?))
        };
        sensors.filter_map(noise).collect()
    }
}

/// Warns of a transfer function whose answer grows without end.
fn warn_of_growth(values: &Values, table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
    let poles = values.poles("poles").unwrap_or_default();
    let Some((real, imaginary)) = poles.iter().find(|(real, _)| real.signum() > 0) else { return };
    let beside = if imaginary.is_zero() { String::new() } else { format!(" ± {}j", imaginary.to_f64().abs()) };
    let message = format!(
        "{what}: its pole at {}{beside} 1/s has a real part above zero: what it answers grows without end, whatever it reads",
        real.to_f64()
    );
    let told = Diagnostic::warning("block::unstable", message).at(TableReader::place(table, "poles"), "grows");
    out.push(told.help("check the sign: what decays has negative poles; leave it where a loop around it holds it"));
}

/// The names in all expressions of a value.
fn names_in(value: &Value, out: &mut BTreeSet<String>) {
    let mut read = |scalar: &Scalar| {
        if let Scalar::Expression(read) = scalar {
            out.extend(read.names().into_iter().map(String::from));
        }
    };
    match value {
        Value::Scalar(scalar) => read(scalar),
        Value::Map(entries) => entries.iter().for_each(|(_, scalar)| read(&scalar.value)),
        Value::Tables(tables) => {
            tables.iter().flat_map(|table| table.values.values()).for_each(|found| names_in(&found.value, out));
        }
        _ => {}
    }
}

/// What breaks a circle.
const BREAK_CIRCLE: &str =
    "put a `delay` or a forward `integrator` into it: what they answer does not follow from their input at once";

impl<'a> Blocks<'a, '_, '_> {
    /// The block that a name is an answer of.
    fn of_name(&self, name: &str) -> Option<&str> {
        let head = SignalName::new(name).element;
        self.document.blocks.iter().map(|block| block.name.as_str()).find(|block| *block == name || *block == head)
    }

    /// Refuses blocks that read those of another sample time without saying so.
    fn check_rates(&self, out: &mut Vec<Diagnostic>) {
        for block in self.document.blocks.iter().filter(|block| !block.kind.crosses) {
            let Some(Some(made)) = self.made.get(block.name.as_str()) else { continue };
            let what = format!("block `{}`", shortened(&block.name));
            self.check_reads(&what, &block.place, (&made.period, &made.reads), out);
        }
    }

    /// The same of whatever computes with a sample time.
    fn check_reads(
        &self,
        what: &str,
        place: &Place,
        (own, reads): (&Option<Exact>, &BTreeSet<String>),
        out: &mut Vec<Diagnostic>,
    ) {
        let shown = |period: &Exact| shown_quantity(period, Dimension::TIME);
        let Some(own) = own else { return };
        for name in reads {
            let other = self.of_name(name).and_then(|block| self.made.get(block)?.as_ref());
            let Some(period) = other.and_then(|other| other.period.as_ref()).filter(|period| *period != own) else {
                continue;
            };
            let message =
                format!("{what} computes every {} and reads `{name}`, which does every {}", shown(own), shown(period));
            let head = SignalName::new(name).element;
            let help = format!(
                "say how it is read: `[block.{head}_held]` with kind = \"hold\", input = \"{name}\" and sample_time = \"{}\"",
                shown(own)
            );
            out.push(Diagnostic::error("block::rate", message).at(place.clone(), "another sample time").help(help));
        }
    }

    /// Answers of other blocks, or others of the same, that an answer follows from at the same sample.
    fn at_once(&self, expr: Expr) -> Vec<String> {
        let graph = self.graph.borrow();
        let symbols = graph.symbols(&[expr]);
        let needed = |(_, (expr, _)): &(&String, &(Expr, Dimension))| {
            graph.symbol_of(*expr).is_some_and(|symbol| symbols.contains(&symbol))
        };
        self.answers.iter().filter(needed).map(|(name, _)| name.clone()).collect()
    }

    /// All answers with their blocks, each behind those that it follows from at once. Circles are told.
    fn order(&self, out: &mut Vec<Diagnostic>) -> Option<Vec<(&'a str, String)>> {
        let mut all: Vec<(&'a str, String, Vec<String>)> = Vec::new();
        for (block, made) in self.made.iter().filter_map(|(block, made)| Some((*block, made.as_ref()?))) {
            for (answer, value, _) in &made.answers {
                let mut needs = self.at_once(*value);
                // What another task answers stands still.
                needs.retain(|other| {
                    let other = self.of_name(other).and_then(|other| self.made.get(other)?.as_ref());
                    other.is_some_and(|other| other.period == made.period)
                });
                all.push((block, outside_name(block, answer), needs));
            }
        }
        let mut order: Vec<usize> = Vec::new();
        let mut open: Vec<(usize, Vec<String>)> = Vec::new();
        for k in 0..all.len() {
            open.push((k, all[k].2.clone()));
            while let Some((k, rest)) = open.last_mut() {
                let Some(next) = rest.pop() else {
                    if !order.contains(k) {
                        order.push(*k);
                    }
                    open.pop();
                    continue;
                };
                let Some(next) = all.iter().position(|(_, name, _)| *name == next) else { continue };
                if let Some(first) = open.iter().position(|(k, _)| *k == next) {
                    let circle = open[first..].iter().map(|(k, _)| (all[*k].0, all[*k].1.as_str()));
                    out.push(self.circle(&circle.collect::<Vec<_>>()));
                    return None;
                }
                if !order.contains(&next) {
                    open.push((next, all[next].2.clone()));
                }
            }
        }
        Some(order.into_iter().map(|k| (all[k].0, all[k].1.clone())).collect())
    }

    /// What is wrong with answers of blocks that follow from each other at once, with the signals between them.
    fn circle(&self, answers: &[(&str, &str)]) -> Diagnostic {
        let mut names: Vec<&str> = Vec::new();
        for (k, (block, answer)) in answers.iter().enumerate() {
            names.push(answer);
            names.extend(self.signals_between(block, answers[(k + 1) % answers.len()].1));
        }
        names.extend(answers.first().map(|(_, answer)| *answer));
        let message = format!("blocks follow from each other at the same sample: {}", names.join(" from "));
        let found =
            self.document.blocks.iter().find(|block| answers.first().is_some_and(|(own, _)| block.name == *own));
        let mistake = Diagnostic::error("block::circle", message);
        let mistake = found.into_iter().fold(mistake, |told, block| told.at(block.place.clone(), "in a circle"));
        mistake.help(BREAK_CIRCLE)
    }

    /// The signals by way of which a block reads an answer, by the shortest way; none where it names it itself.
    fn signals_between(&self, block: &str, answer: &str) -> Vec<&'a str> {
        let Some(block) = self.document.blocks.iter().find(|other| other.name == block) else { return Vec::new() };
        let mut ways: VecDeque<(Vec<&'a str>, BTreeSet<String>)> = VecDeque::new();
        let mut first = BTreeSet::new();
        block.table.values.values().for_each(|found| names_in(&found.value, &mut first));
        ways.push_back((Vec::new(), first));
        let mut seen: BTreeSet<&'a str> = BTreeSet::new();
        while let Some((way, names)) = ways.pop_front() {
            if names.contains(answer) {
                return way;
            }
            for signal in self.document.signals.iter().filter(|signal| names.contains(&signal.name)) {
                let Some(written) = self.document.program_of(signal).filter(|_| seen.insert(&signal.name)) else {
                    continue;
                };
                let own = written.value.names().into_iter().map(String::from).collect();
                ways.push_back((way.iter().copied().chain([signal.name.as_str()]).collect(), own));
            }
        }
        Vec::new()
    }

    /// The blocks of one sample time, those in order, with what they read of others as from outside.
    fn task(&self, period: Option<Exact>, order: &[(&'a str, String)], stands: impl Fn(&str) -> bool) -> Task {
        let mut graph = self.graph.borrow().clone();
        let mut values: Vec<(Symbol, Expr)> = Vec::new();
        let (mut answers, mut steps): (Vec<TaskAnswer>, Vec<Step>) = (Vec::new(), Vec::new());
        let of_period = |block: &str| self.made.get(block)?.as_ref().filter(|made| made.period == period);
        for (block, outside) in order {
            let Some(made) = of_period(block) else { continue };
            let Some((answer, value, dimension)) =
                made.answers.iter().find(|(name, ..)| outside_name(block, name) == *outside)
            else {
                continue;
            };
            let of_block = self.document.blocks.iter().find(|other| other.name == *block);
            let kind = of_block.map_or("expression", |block| block.kind.keyword);
            let at_once = self.at_once(*value);
            let value = graph.substitute(&[*value], &values)[0];
            let symbol = self.answers.get(outside).and_then(|(expr, _)| graph.symbol_of(*expr));
            values.extend(symbol.filter(|_| !stands(block)).map(|symbol| (symbol, value)));
            let whose = kind.replace('_', " ");
            let description = if of_block.is_none() {
                "a formula of what moves".into()
            } else if answer.is_empty() {
                format!("what the {whose} answers")
            } else {
                format!("{answer} of the {whose} {block}")
            };
            answers.push(TaskAnswer { name: outside.clone(), dimension: *dimension, description, value });
            match steps.iter_mut().find(|step| step.block == *block) {
                Some(step) => step.at_once.extend(at_once),
                None => steps.push(Step {
                    block: (*block).into(),
                    kind,
                    reads: made.reads.iter().cloned().collect(),
                    at_once,
                }),
            }
        }
        let mut memory = Vec::new();
        for Step { block, .. } in &steps {
            for (symbol, start, next) in of_period(block).into_iter().flat_map(|made| &made.memory) {
                let next = graph.substitute(&[*next], &values)[0];
                let start = lower(&graph, &[*start], &mut Floating::<f64>::default(), |_| f64::NAN)[0];
                let symbol = graph.symbol_of(*symbol).expect("an entry of a memory is a symbol");
                memory.push(Entry { name: block.clone(), symbol, start, next });
            }
        }
        let exprs: Vec<Expr> =
            answers.iter().map(|answer| answer.value).chain(memory.iter().map(|entry| entry.next)).collect();
        let reads = self.reads_of(&graph, &exprs);
        let name = match &period {
            Some(period) => format!("blocks at {}", shown_quantity(period, Dimension::TIME)),
            None => "blocks at every instant".into(),
        };
        let moving = self.moving(&reads, &memory);
        let (names, lists) = (Vec::new(), Lists::default());
        Task { name, period, graph, reads, memory, answers, moving, names, order: steps, lists }
    }

    /// What a law commands, with the blocks of its sample time that it needs.
    fn command_task(
        &self,
        (name, period): (&str, Option<Exact>),
        order: &[(&'a str, String)],
        commands: Vec<Command>,
    ) -> Task {
        // What reads another sample time is read as the blocks have it: they computed before.
        let crosses = |name: &str| self.document.blocks.iter().any(|block| block.name == name && block.kind.crosses);
        let mut task = self.task(period, order, crosses);
        let symbol = |graph: &Graph, name: &str| self.answers.get(name).and_then(|(expr, _)| graph.symbol_of(*expr));
        let inside = task.answers.iter().filter(|answer| !crosses(&answer.name));
        let known: Vec<(Symbol, Expr)> =
            inside.filter_map(|answer| Some((symbol(&task.graph, &answer.name)?, answer.value))).collect();
        task.answers = Vec::new();
        let names: BTreeSet<String> = commands.iter().flat_map(|command| command.reads.iter().cloned()).collect();
        task.names = names.into_iter().collect();
        for Command { name, value, dimension, .. } in commands {
            let value = task.graph.substitute(&[value], &known)[0];
            task.answers.push(TaskAnswer { description: format!("command of {name}"), name, dimension, value });
        }
        // What is remembered and needed, until nothing new is.
        let mut exprs: Vec<Expr> = task.answers.iter().map(|answer| answer.value).collect();
        let mut needed: Vec<Entry> = Vec::new();
        loop {
            let used = task.graph.symbols(&exprs);
            let (more, rest): (Vec<Entry>, Vec<Entry>) =
                std::mem::take(&mut task.memory).into_iter().partition(|entry| used.contains(&entry.symbol));
            task.memory = rest;
            if more.is_empty() {
                break;
            }
            exprs.extend(more.iter().map(|entry| entry.next));
            needed.extend(more);
        }
        task.order.retain(|step| needed.iter().any(|entry| entry.name == step.block));
        task.memory = needed;
        task.reads = self.reads_of(&task.graph, &exprs);
        task.moving = self.moving(&task.reads, &task.memory);
        task.name = name.to_string();
        task
    }

    /// What of this moves with what is controlled.
    fn moving(&self, reads: &[(Symbol, Read)], memory: &[Entry]) -> Vec<Symbol> {
        let all = reads.iter().map(|(symbol, _)| *symbol).chain(memory.iter().map(|entry| entry.symbol));
        all.filter(|symbol| self.moves(*symbol, &mut BTreeSet::new())).collect()
    }

    /// Whether a symbol follows from what moves by its value, and not only by what switches it.
    fn moves(&self, symbol: Symbol, seen: &mut BTreeSet<Symbol>) -> bool {
        if !seen.insert(symbol) {
            return false;
        }
        let graph = self.graph.borrow();
        let is_own = |expr: &Expr| graph.symbol_of(*expr) == Some(symbol);
        let outside =
            self.outside.iter().find(|outside| self.read.get(&outside.name).is_some_and(|(expr, _)| is_own(expr)));
        if let Some(outside) = outside {
            let of_law =
                |name: &str| self.document.controls.iter().any(|law| law.name == SignalName::new(name).element);
            return match &outside.read {
                Read::Time => false,
                Read::Source(name) => of_law(name),
                _ => true,
            };
        }
        let made = || self.made.iter().filter_map(|(block, made)| Some((*block, made.as_ref()?)));
        let entry = made().flat_map(|(_, made)| &made.memory).find(|(own, ..)| is_own(own)).map(|(.., next)| *next);
        let name = self.answers.iter().find(|(_, (expr, _))| is_own(expr)).map(|(name, _)| name);
        let answer = || {
            let of = |(block, made): (&str, &'_ Made)| {
                let own = made.answers.iter().find(|(answer, ..)| Some(&outside_name(block, answer)) == name);
                own.map(|(_, value, _)| *value)
            };
            made().find_map(of)
        };
        let Some(value) = entry.or_else(answer) else { return false };
        let carried = graph.carried(&[value]);
        drop(graph);
        carried.into_iter().any(|symbol| self.moves(symbol, seen))
    }

    /// What expressions read from outside of their task, sorted.
    fn reads_of(&self, graph: &Graph, exprs: &[Expr]) -> Vec<(Symbol, Read)> {
        let used = graph.symbols(exprs);
        let outside = self.outside.iter().filter_map(|outside| {
            let symbol = graph.symbol_of(self.read.get(&outside.name)?.0)?;
            Some((symbol, outside.read.clone()))
        });
        let others = self.answers.iter().filter_map(|(name, (expr, _))| {
            let symbol = graph.symbol_of(*expr)?;
            Some((symbol, Read::Source(name.clone())))
        });
        let mut reads: Vec<_> = outside.chain(others).filter(|(symbol, _)| used.contains(symbol)).collect();
        reads.sort_by(|a, b| a.1.cmp(&b.1));
        reads
    }
}
