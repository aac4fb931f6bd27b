//! Builds expressions of blocks, formulas and sensors of signals, each once and after its inputs, however long the chain.

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use super::block_outputs::{declared_outputs, warn_of_growth};
use super::overlaps::TransitionGuard;
use super::{BlockInputs, Blocks, FormulaExpr, Made, Outside, Source, errors, outside_name};
use crate::document::BlockTable;
use crate::keys::{GUESSES, key_diagnostic};
use kardan_elements::block::List;
use kardan_expr::expr::{Expr, Graph, Named};
use kardan_math::names::{circle, did_you_mean};
use kardan_math::units::{Dimension, Expression};
use kardan_mechanics::program::{KeyRule, Read};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Kind, Placed, Scalar, Table, Value, Values};

/// Why an expression is not built.
pub(super) enum Stopped<'a> {
    /// It, or an input of it, has a reported error.
    Reported,
    /// It has an input to be built before.
    Needs(Source<'a>),
}

/// An expression to be built, with its place and its name in messages.
struct KeyExpression<'a> {
    key: &'static str,
    /// The name in the key, if expressions are listed by name.
    name: Option<&'a str>,
    read: Cow<'a, Expression>,
    place: &'a Place,
    what: String,
}

/// The entry under construction, and its result so far.
struct Open<'a> {
    source: Source<'a>,
    expressions: Vec<KeyExpression<'a>>,
    lowered: Vec<(Expr, Dimension)>,
    reads: BTreeSet<String>,
    /// Of a block.
    keys: Keys,
}

/// Keys of a block that are not expressions.
#[derive(Default)]
struct Keys {
    values: Values,
    unit: Option<Dimension>,
    lists: Vec<List>,
    /// Symbols of its states, in its keys and in its outputs.
    own: Vec<[Expr; 2]>,
    /// Transitions; `None` for one that names no state, which was reported.
    ways: Vec<Option<kardan_rt::Transition>>,
}

impl<'a> Blocks<'a, '_, '_> {
    /// Builds an entry, after the inputs of its expressions.
    pub(super) fn make(&mut self, source: Source<'a>, out: &mut Vec<Diagnostic>) {
        let mut stack: Vec<Open<'a>> = self.begin(source, out).into_iter().collect();
        while let Some(open) = stack.last_mut() {
            match self.write_on(open, out) {
                Some(Stopped::Needs(source)) => stack.extend(self.begin(source, out)),
                Some(Stopped::Reported) => {
                    let source = open.source;
                    stack.pop();
                    self.close(source, None);
                }
                None => {
                    let Some(open) = stack.pop() else { return };
                    let source = open.source;
                    let made = self.finish(open, out);
                    self.close(source, made);
                }
            }
        }
    }

    /// Starts to build an entry; `None` if it has a reported error, or if it is built already.
    fn begin(&mut self, source: Source<'a>, out: &mut Vec<Diagnostic>) -> Option<Open<'a>> {
        let (_, name) = source.key();
        let is_made = match source {
            Source::Block(_) => self.made.contains_key(name),
            _ => self.formulas.contains_key(&source.key()),
        };
        if is_made {
            return None;
        }
        self.waiting.insert(name);
        self.open.push(name);
        let begun = match source {
            Source::Block(block) => self.keys_of(block, out).map(|keys| (expressions_of(&block.table, block), keys)),
            Source::Formula(signal) => signal.formula.as_ref().map(|formula| {
                let (read, what) = (Cow::Borrowed(&formula.value), format!("signal `{}`", shortened(name)));
                (vec![KeyExpression { key: "value", name: None, read, place: &formula.place, what }], Keys::default())
            }),
            Source::Sensor(name, signal, place) => self.expression_of_sensor((name, signal, place), out).map(|read| {
                let (read, what) = (Cow::Owned(read), format!("`signal` of sensor `{}`", shortened(name)));
                (vec![KeyExpression { key: "signal", name: None, read, place, what }], Keys::default())
            }),
            Source::Reference(_, block) => {
                let mut expressions = expressions_of(&block.table, block);
                expressions.retain(|one| one.key == "measured");
                (!expressions.is_empty()).then(|| (expressions, Keys::default()))
            }
        };
        match begun {
            Some((expressions, keys)) => {
                Some(Open { source, expressions, lowered: Vec::new(), reads: BTreeSet::new(), keys })
            }
            None => {
                self.close(source, None);
                None
            }
        }
    }

    /// Records the result of an entry.
    fn close(&mut self, source: Source<'a>, made: Option<Made>) {
        let (_, name) = source.key();
        self.waiting.remove(name);
        self.open.pop();
        if matches!(source, Source::Block(_)) {
            self.made.insert(name, made);
            return;
        }
        let formula = made.and_then(|Made { outputs, reads, .. }| {
            let (_, value, dimension) = outputs.into_iter().next()?;
            Some(FormulaExpr { value, dimension, reads })
        });
        self.formulas.insert(source.key(), formula);
    }

    /// Builds what can be built; else returns why the next one cannot.
    fn write_on(&mut self, open: &mut Open<'a>, out: &mut Vec<Diagnostic>) -> Option<Stopped<'a>> {
        while let Some(KeyExpression { read, place, what, .. }) = open.expressions.get(open.lowered.len()) {
            match self.expression(read, (place, what), &mut open.reads, out) {
                Ok(found) => open.lowered.push(found),
                Err(stopped) => return Some(stopped),
            }
        }
        None
    }

    /// The result when all expressions are built.
    fn finish(&mut self, open: Open<'a>, out: &mut Vec<Diagnostic>) -> Option<Made> {
        if let Source::Block(block) = open.source {
            return self.lowered(block, open, out);
        }
        let outputs = open.lowered.into_iter().map(|(value, dimension)| (String::new(), value, dimension)).collect();
        Some(Made { period: None, outputs, states: Vec::new(), reads: Arc::new(open.reads) })
    }

    /// The expression of a name that is not a block, a formula or a sensor.
    pub(super) fn resolved(
        &mut self,
        read: &Expression,
        at: (&Place, &str),
        reads: &mut BTreeSet<String>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Expr, Dimension)> {
        loop {
            match self.expression(read, at, reads, out) {
                Ok(found) => return Some(found),
                Err(Stopped::Reported) => return None,
                Err(Stopped::Needs(source)) => self.make(source, out),
            }
        }
    }

    /// An expression in the graph of all blocks.
    fn expression(
        &mut self,
        read: &Expression,
        (place, what): (&Place, &str),
        reads: &mut BTreeSet<String>,
        out: &mut Vec<Diagnostic>,
    ) -> Result<(Expr, Dimension), Stopped<'a>> {
        let mut names: HashMap<&str, Named> = HashMap::new();
        for name in read.names() {
            if let Some(named) = self.named(name, (read, place, what), reads, out)? {
                names.insert(name, named);
            }
        }
        for name in read.tables() {
            if let Some(table) = self.functions.table(name, out) {
                names.insert(name, Named::Table(table.ok_or(Stopped::Reported)?));
            }
        }
        let mut lookup = |_: &mut Graph, name: &str| names.get(name).cloned();
        let lowered = self.graph.borrow_mut().lowered(read, &mut lookup);
        match lowered {
            Ok(found) => {
                let has_calls = !read.tables().is_empty();
                let calls = has_calls.then(|| self.graph.borrow_mut().calls(read, &mut lookup).unwrap_or_default());
                for (name, at) in calls.into_iter().flatten() {
                    let table = match names.get(name.as_str()) {
                        Some(Named::Table(table)) => Some(Arc::clone(table)),
                        _ => None,
                    };
                    self.reads_table(&name, table, at);
                }
                Ok(found)
            }
            Err(error) => {
                out.push(self.diagnostic(error, read.text(), (place, what), out.len() < GUESSES));
                Err(Stopped::Reported)
            }
        }
    }

    /// The meaning of a name; `None` if unknown.
    fn named(
        &mut self,
        name: &str,
        (read, place, what): (&Expression, &Place, &str),
        reads: &mut BTreeSet<String>,
        out: &mut Vec<Diagnostic>,
    ) -> Result<Option<Named>, Stopped<'a>> {
        let document = self.document;
        let varying = |(expr, dimension): (Expr, Dimension)| Ok(Some(Named::Varying(expr, dimension)));
        let head = SignalName::new(name).element;
        if let Some(block) = document.blocks.get(name).or_else(|| document.blocks.get(head)) {
            return self.output_of(block, name, (read, place, what), reads, out);
        }
        if let Some(signal) = document.signals.get(name) {
            if signal.formula.is_some() {
                let found = self.needed(Source::Formula(signal), (read, place, what), out)?;
                reads.extend(found.reads.iter().cloned());
                return varying((found.value, found.dimension));
            }
            reads.insert(name.to_string());
            if let Some(cached) = self.read.get(name) {
                return varying(*cached);
            }
            let function = self.functions.of_time_named(name, out).ok_or(Stopped::Reported)?;
            let dimension = function.dimension();
            self.used_functions.push((name.to_string(), function));
            let read = Read::Source(name.into());
            return varying(self.read_outside(Outside { name: name.into(), read, dimension }));
        }
        if let Some((sensor, signal, at)) = document.signal_sensor(name) {
            reads.insert(name.to_string());
            let source = Source::Sensor(sensor, signal, at);
            let dimension = self.needed(source, (read, place, what), out)?.dimension;
            let read = Read::Sensor(name.into());
            return varying(self.read_outside(Outside { name: name.into(), read, dimension }));
        }
        if let Some(outside) = self.outside.get(name).cloned() {
            reads.insert(name.to_string());
            return varying(self.read_outside(outside));
        }
        if let Some(value) = self.reader.value_of(name, out) {
            let (value, dimension) = value.ok_or(Stopped::Reported)?;
            return Ok(Some(Named::Constant(value, dimension)));
        }
        if let Some((name, block)) = self.introduced.get_key_value(name) {
            reads.insert(name.to_string());
            let dimension = self.needed(Source::Reference(name, block), (read, place, what), out)?.dimension;
            let read = Read::Source(name.to_string());
            return varying(self.read_outside(Outside { name: name.to_string(), read, dimension }));
        }
        // Errors in it, or in the table that introduces it, have been reported.
        let is_doubtful = document.introduces(name) || document.suppressed.has(name) || document.suppressed.has(head);
        if is_doubtful { Err(Stopped::Reported) } else { Ok(None) }
    }

    /// The output of a block with a name.
    fn output_of(
        &self,
        block: &'a BlockTable,
        name: &str,
        (read, place, what): (&Expression, &Place, &str),
        reads: &mut BTreeSet<String>,
        out: &mut Vec<Diagnostic>,
    ) -> Result<Option<Named>, Stopped<'a>> {
        let own = self.states.get(name).filter(|_| self.open.last() == Some(&block.name.as_str()));
        if own.is_none() {
            reads.insert(name.to_string());
        }
        if let Some((expr, dimension)) = own.or_else(|| self.outputs.get(name)) {
            return Ok(Some(Named::Varying(*expr, *dimension)));
        }
        match self.made.get(block.name.as_str()) {
            Some(None) => Err(Stopped::Reported),
            Some(Some(_)) => Ok(None),
            None if !self.waiting.contains(block.name.as_str()) => Err(Stopped::Needs(Source::Block(block))),
            None if block.name == name => {
                let message = format!("{what}: `{name}` depends on itself, so its unit is unknown");
                let diagnostic = Diagnostic::error("block::unit", message).at(place.inside(read.text()), "circular");
                out.push(
                    diagnostic.help(format!("state the unit of its output: `unit = \"rad\"` in `[block.{name}]`")),
                );
                Err(Stopped::Reported)
            }
            // A name that is not an output of a block is unknown, also if the block reads itself.
            None => Ok(None),
        }
    }

    /// The result of a formula or a sensor, which may depend on itself.
    fn needed(
        &self,
        source: Source<'a>,
        (read, place, what): (&Expression, &Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Result<FormulaExpr, Stopped<'a>> {
        let (_, name) = source.key();
        match self.formulas.get(&source.key()) {
            Some(made) => made.clone().ok_or(Stopped::Reported),
            None if !self.waiting.contains(name) => Err(Stopped::Needs(source)),
            None => {
                let first = self.open.iter().position(|open| *open == name).unwrap_or_default();
                let message = format!("{what}: `{name}` depends on itself: {}", circle(&self.open[first..]));
                out.push(
                    Diagnostic::error("signal::cyclic-definition", message)
                        .at(place.inside(read.text()), "circular")
                        .help(super::BREAK_CIRCLE),
                );
                Err(Stopped::Reported)
            }
        }
    }

    /// What a sensor of a signal measures, as an expression.
    fn expression_of_sensor(
        &self,
        (sensor, signal, place): (&str, &str, &Place),
        out: &mut Vec<Diagnostic>,
    ) -> Option<Expression> {
        let what = format!("`signal` of sensor `{}`", shortened(sensor));
        let mut refuse = |message: &str, label: &str, help: &str| {
            let diagnostic = Diagnostic::error("sensor::signal", format!("{what}: {message}"));
            out.push(diagnostic.at(place, label).help(help));
            None
        };
        let quoted = format!("'{}'", signal.trim_matches('\''));
        let read = Expression::parse_law(signal).ok().filter(|read| read.names() == [signal]);
        let Some(read) = read.or_else(|| Expression::parse_law(&quoted).ok().filter(|_| !signal.contains(' '))) else {
            let help =
                "write a formula as a signal of its own, `[signal.NAME]` with kind = \"expression\", and name that";
            return refuse("a sensor measures one signal, by its name", "no name", help);
        };
        if self.document.signal_sensor(signal).is_some() {
            let help = "name what that one measures, or put a block between";
            return refuse("a sensor measures no other sensor", "a sensor", help);
        }
        Some(read)
    }

    /// The keys of a block that are not expressions, with the known facts on its outputs: its inputs may read them.
    fn keys_of(&mut self, block: &'a BlockTable, out: &mut Vec<Diagnostic>) -> Option<Keys> {
        let BlockTable { kind, name, table, .. } = block;
        let what = format!("block `{}`", shortened(name));
        let before = errors(out);
        let values = self.reader.values(table.fields, table, &what, out);
        let unit = super::unit_of(table, &what, out);
        if errors(out) > before {
            return None;
        }
        if kind.keyword == "transfer_function" {
            warn_of_growth(&values, table, &what, out);
        }
        let lists = self.lists(table, out);
        let mut own = Vec::new();
        for (output, dimension) in declared_outputs(kind, &values, &lists) {
            let outside = outside_name(name, &output);
            let (symbol, _) = self.output_symbol(outside.clone(), dimension);
            if kind.keyword == "observer" {
                let moves = self.symbol(&outside, dimension);
                self.states.insert(outside, (moves, dimension));
                own.push([moves, symbol]);
            }
        }
        if let Some(dimension) = unit {
            self.output_symbol(name.clone(), dimension);
        }
        let ways = ways(table, values.names("states").unwrap_or_default(), &what, out);
        Some(Keys { values, unit, lists, own, ways })
    }

    /// A block whose expressions are built; `None` if it has a reported error.
    fn lowered(
        &mut self,
        block: &'a BlockTable,
        Open { expressions, lowered, reads, keys: Keys { values, unit, lists, own, ways }, .. }: Open<'a>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Made> {
        let BlockTable { kind, name, place, table, .. } = block;
        let (mut block_inputs, mut guards) = (BlockInputs::new(), Vec::new());
        for (KeyExpression { key, name, place, what, .. }, found) in expressions.into_iter().zip(lowered) {
            match key {
                WHEN => guards.push((number_of(found, (place, &what), out)?, place)),
                _ => block_inputs.push((key, name.map(String::from), found)),
            }
        }
        let guards = guards
            .into_iter()
            .zip(ways)
            .map(|((when, place), way)| Some(TransitionGuard { transition: way?, when, place: place.clone() }));
        let guards: Vec<TransitionGuard> = guards.collect::<Option<_>>()?;
        if kind.keyword == "monitor" {
            self.take_as_read(&mut block_inputs);
            self.watch(name, table, &block_inputs);
        }
        let table_name = values.word("table").filter(|_| kind.keyword == "table");
        let called = table_name.and_then(|name| self.functions.table(name, out).flatten());
        if let Some(name) = table_name.filter(|_| called.is_some()) {
            let inputs = ["input", "input_2"].into_iter();
            let at = inputs
                .filter_map(|key| block_inputs.iter().find(|(other, ..)| *other == key))
                .map(|(_, _, (at, _))| *at);
            let at = at.collect();
            self.reads_table(name, called.clone(), at);
        }
        let period = values.exact("sample_time").cloned();
        if kind.keyword == "state_machine" {
            self.machines.push((name, values.names("states").unwrap_or_default().to_vec(), guards.clone()));
        }
        match self.wire(kind, (&values, period.clone(), called, lists), (block_inputs, guards, own)) {
            Ok((outputs, block_states, rules)) => {
                self.rules.extend(rules.into_iter().map(|rule| KeyRule { block: block.name.clone(), ..rule }));
                let made = Made { period, outputs, states: block_states, reads: Arc::new(reads) };
                self.finished(block, made, unit, out)
            }
            Err(key_error) => {
                let what = format!("block `{}`", shortened(name));
                out.push(key_diagnostic("block::key", &what, key_error, (table, place)));
                None
            }
        }
    }
}

/// The key of a transition's condition.
const WHEN: &str = "when";

/// The expressions in the keys of a block, the conditions of transitions last.
fn expressions_of<'a>(table: &'a Table, block: &BlockTable) -> Vec<KeyExpression<'a>> {
    let what = format!("block `{}`", shortened(&block.name));
    let mut expressions = Vec::new();
    for field in table.fields {
        match (field.kind, table.values.get(field.name)) {
            (Kind::Expression, Some(Placed { value: Value::Scalar(Scalar::Expression(read)), place })) => {
                let (read, what) = (Cow::Borrowed(&**read), format!("`{}` of {what}", field.name));
                expressions.push(KeyExpression { key: field.name, name: None, read, place, what });
            }
            (Kind::Expressions, Some(Placed { value: Value::Map(entries), .. })) => {
                for (name, scalar) in entries {
                    let Scalar::Expression(read) = &scalar.value else { continue };
                    let what = format!("`{}` in `{}` of {what}", shortened(&name.value), field.name);
                    let (name, read) = (Some(name.value.as_str()), Cow::Borrowed(&**read));
                    expressions.push(KeyExpression { key: field.name, name, read, place: &scalar.place, what });
                }
            }
            _ => {}
        }
    }
    for (k, transition) in table.tables("transitions").iter().enumerate() {
        if let Some(Placed { value: Value::Scalar(Scalar::Expression(read)), place }) = transition.values.get(WHEN) {
            let (read, what) = (Cow::Borrowed(&**read), format!("`when` of transition {} of {what}", k + 1));
            expressions.push(KeyExpression { key: WHEN, name: None, read, place, what });
        }
    }
    expressions
}

/// From where to where the transitions of a machine with a condition lead; `None` for one that names no state, which is reported.
fn ways(table: &Table, states: &[String], what: &str, out: &mut Vec<Diagnostic>) -> Vec<Option<kardan_rt::Transition>> {
    let mut places: HashMap<&str, usize> = HashMap::new();
    for (k, state) in states.iter().enumerate() {
        places.entry(state).or_insert(k);
    }
    let mut found = Vec::new();
    for (k, transition) in table.tables("transitions").iter().enumerate() {
        let mut number = |key: &'static str| {
            let (name, place) = transition.placed_word(key)?;
            let target = places.get(name).copied();
            if target.is_none() {
                let message =
                    format!("`{key}` of transition {} of {what}: there is no state `{}`", k + 1, shortened(name));
                let all = || states.iter().map(String::as_str);
                let help = did_you_mean(nearest(name, all()), || format!("its states are {}", quoted(all())));
                out.push(Diagnostic::error("name::unknown", message).at(place, "unknown state").help(help));
            }
            target
        };
        let ends = (number("from"), number("to"));
        if let Some(Placed { value: Value::Scalar(Scalar::Expression(_)), .. }) = transition.values.get(WHEN) {
            found.push(ends.0.zip(ends.1).map(|(from, to)| kardan_rt::Transition { from, to }));
        }
    }
    found
}

/// A condition, which is a number; `None` if it has a unit, which is reported.
fn number_of(
    (when, dimension): (Expr, Dimension),
    (place, what): (&Place, &str),
    out: &mut Vec<Diagnostic>,
) -> Option<Expr> {
    if dimension == Dimension::NONE {
        return Some(when);
    }
    let message = format!("{what}: expected a number, found {}", dimension.noun());
    let help = format!("compare it with a threshold: `... > 1 {}`", dimension.si());
    out.push(Diagnostic::error("unit::dimension", message).at(place, dimension.noun()).help(help));
    None
}
