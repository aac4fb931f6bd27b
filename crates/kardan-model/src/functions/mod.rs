//! Functions of time by name, `[signal.NAME]`, and expressions of them.

mod events;
mod formulas;
mod lookups;
mod rows;
mod samples;
mod smooth;

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use super::document::{Document, SignalTable};
use super::keys::{GUESSES, key_diagnostic, unknown_in};
use super::table_reader::TableReader;
use kardan_elements::signal::{MOST_BREAKPOINTS, Refused, SignalWriter};
use kardan_expr::expr::{Expr, Graph, Lookup, Named, OfTime, Part};
use kardan_math::names::{circle, did_you_mean};
use kardan_math::units::{Dimension, Expression, UnitError};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Field, Kind, Placed, Scalar, Table, Value};

/// Number of times at which a function is sampled before a run besides its breakpoints, and of breakpoints sampled.
const SCAN_POINTS: u32 = 64;
const MOST_SCAN_POINTS: usize = 1000;

/// The functions of time of a document under construction.
pub struct Functions<'a, 'd> {
    reader: &'a TableReader<'d>,
    pub(crate) document: &'a Document,
    horizon: f64,
    seed: u64,
    graph: Graph,
    time: Expr,
    parts: Vec<(Expr, Arc<Part>)>,
    room: usize,
    /// The functions made; `None` for a signal with an error.
    made: BTreeMap<&'a str, Option<(Expr, Dimension)>>,
    /// Signals that were requested as separate functions.
    functions: HashMap<String, Arc<OfTime>>,
    /// Formulas that depend on unfinished ones.
    open: Vec<&'a str>,
    /// The outputs of blocks and formulas of signals.
    pub(crate) blocks: BTreeMap<String, Dimension>,
    /// Whether there are none because of a reported error in one of them.
    pub(crate) broken_blocks: bool,
    /// The tables made; `None` for one with an error.
    tables: BTreeMap<&'a str, Option<Arc<Lookup>>>,
}

impl<'a, 'd> Functions<'a, 'd> {
    /// Up to a time (s), with the seed of their noise.
    pub fn new(reader: &'a TableReader<'d>, document: &'a Document, (horizon, seed): (f64, u64)) -> Self {
        let mut graph = Graph::default();
        let time = graph.symbol("t", Dimension::TIME);
        Self {
            reader,
            document,
            horizon,
            seed,
            graph,
            time,
            parts: Vec::new(),
            room: MOST_BREAKPOINTS,
            made: BTreeMap::new(),
            functions: HashMap::new(),
            open: Vec::new(),
            blocks: BTreeMap::new(),
            broken_blocks: false,
            tables: BTreeMap::new(),
        }
    }

    /// Over the time of the scenario, with its seed; a second where it has none.
    pub(crate) fn of_scenario(reader: &'a TableReader<'d>, document: &'a Document) -> Self {
        let table = &document.scenario;
        let number = |key: &str| {
            let scalar = table.scalar_or_default(key, &Place::default())?;
            reader.scalar(&scalar, None, key, &mut Vec::new()).map(|(value, _)| value.to_f64())
        };
        let horizon = number("duration").filter(|duration| *duration > 0.0).unwrap_or(1.0);
        Self::new(reader, document, (horizon, number("seed").unwrap_or_default() as u64))
    }

    /// The function of an expression, of a dimension.
    pub fn function(
        &mut self,
        expression: &Expression,
        expected: Dimension,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<OfTime> {
        let names = self.names(expression, (place, what), out)?;
        let mut lookup = |_: &mut Graph, name: &str| named(&names, name);
        let (value, found) = match self.graph.lowered(expression, &mut lookup) {
            Ok(lowered) => lowered,
            Err(error) => {
                out.push(self.diagnostic(error, expression.text(), (place, what), out.len() < GUESSES));
                return None;
            }
        };
        let at = place.inside(expression.text());
        if !expected.is_like(&found) {
            let help = format!("the result needs a unit such as {}", expected.example());
            out.push(Diagnostic::wrong_dimension(what, [expected, found], at).help(help));
            return None;
        }
        let function = self.function_of(value, expected)?;
        if let Some((time, value)) = self.not_finite(&function) {
            let message = format!("{what} is {value} at {time} s");
            let help = "a source needs a finite value at all times: check divisions, roots, logarithms and exponents";
            out.push(Diagnostic::error("signal::not-finite", message).at(at, "no finite number").help(help));
            return None;
        }
        Some(function)
    }

    /// A time at which a function is not finite, and its value there.
    fn not_finite(&self, function: &OfTime) -> Option<(f64, f64)> {
        let evenly = (0..=SCAN_POINTS).map(|k| self.horizon * f64::from(k) / f64::from(SCAN_POINTS));
        let starts = function.parts().flat_map(|part| part.pieces.starts()).copied().take(MOST_SCAN_POINTS);
        let mut all = evenly.chain(starts).map(|time| (time, function.value(time)));
        all.find(|(_, value)| !value.is_finite())
    }

    /// The meanings of the names in an expression; `None` if one of them has a reported error. Unknown ones are omitted.
    fn names(
        &mut self,
        expression: &Expression,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<Vec<(String, Named)>> {
        let mut names = Vec::new();
        for name in expression.names() {
            let named = if name == "t" {
                Named::Varying(self.time, Dimension::TIME)
            } else if self.document.moves(name) {
                let help = "a `reference` of a law, a torque as a law and a `law = \"program\"` use the output of a block by its name";
                out.push(not_of_time("", name, expression, (place, what)).help(help));
                return None;
            } else if self.document.signals.has(name) {
                let (value, dimension) = self.signal(name, out)?;
                Named::Varying(value, dimension)
            } else if let Some(value) = self.reader.value_of(name, out) {
                let (value, dimension) = value?;
                Named::Constant(value, dimension)
            } else if self.document.suppressed.has(name) {
                return None;
            } else {
                continue;
            };
            names.push((name.to_string(), named));
        }
        for name in expression.tables() {
            if let Some(table) = self.table(name, out) {
                names.push((name.to_string(), Named::Table(table?)));
            }
        }
        Some(names)
    }

    /// An error in an expression, at its place, with a suggestion for an unknown name unless there are very many errors already.
    fn diagnostic(&self, error: UnitError, text: &str, at: (&Place, &str), guesses: bool) -> Diagnostic {
        unknown_in(error, text, at, |name| {
            let signals = self.document.signals.iter().map(|signal| signal.name.as_str());
            let readable_names = || {
                let all = signals.clone().chain(self.document.parameters.iter().map(|p| p.name.as_str())).chain(["t"]);
                guesses.then_some(all).into_iter().flatten()
            };
            let help = did_you_mean(nearest(name, readable_names()), || match name.contains('.') {
                true => "a function of time may name the time `t`, parameters and signals, but no coordinates".into(),
                false if !guesses => "declare it by `[signal.NAME]` or under `[parameters]`".into(),
                false => format!(
                    "declare it by `[signal.{}]` or under `[parameters]`; there are {}",
                    shortened(name),
                    quoted(readable_names())
                ),
            });
            (format!("there is no parameter or signal `{}`", shortened(name)), help)
        })
    }

    /// The function of time of a signal of that name, which there is; `None` if it has an error, which was reported.
    pub(crate) fn of_time_named(&mut self, name: &str, out: &mut Vec<Diagnostic>) -> Option<Arc<OfTime>> {
        let (value, dimension) = self.signal(name, out)?;
        if let Some(cached) = self.functions.get(name) {
            return Some(Arc::clone(cached));
        }
        let function = Arc::new(self.function_of(value, dimension)?);
        self.functions.insert(name.to_string(), Arc::clone(&function));
        Some(function)
    }

    /// An expression of the time as a separate function, with only its own dependencies.
    pub(super) fn function_of(&self, value: Expr, dimension: Dimension) -> Option<OfTime> {
        let (graph, new) = self.graph.extract(&[self.time, value]);
        let own = |expr: Expr| new.binary_search_by_key(&expr, |(old, _)| *old).ok().map(|place| new[place].1);
        // Parts are in the order of their symbols.
        let part = |(old, own): &(Expr, Expr)| {
            let place = self.parts.binary_search_by_key(old, |(symbol, _)| *symbol).ok()?;
            Some((*own, Arc::clone(&self.parts[place].1)))
        };
        let parts = new.iter().filter_map(part).collect();
        OfTime::new(graph, own(self.time)?, parts, own(value)?, dimension)
    }

    /// A signal of that name, which there is; `None` if it has an error, which was reported. Those that it names are made before it.
    pub fn signal(&mut self, name: &str, out: &mut Vec<Diagnostic>) -> Option<(Expr, Dimension)> {
        let document = self.document;
        if let Some(made) = self.made.get(name) {
            return *made;
        }
        let mut open = Vec::from_iter(document.signals.get(name).map(|signal| (signal, self.named_by(signal))));
        let mut waiting = HashMap::from([(name, 0)]);
        while let Some((signal, dependencies)) = open.last_mut() {
            let signal = *signal;
            let made = match dependencies.pop() {
                Some(next) if self.made.contains_key(next.name.as_str()) => continue,
                Some(next) => match waiting.get(next.name.as_str()) {
                    None => {
                        waiting.insert(&next.name, open.len());
                        open.push((next, self.named_by(next)));
                        continue;
                    }
                    Some(&first) => {
                        let names: Vec<&str> = open[first..].iter().map(|(signal, _)| signal.name.as_str()).collect();
                        let what = format!("signal `{}`", shortened(&signal.name));
                        let message = format!("{what}: `{}` depends on itself: {}", next.name, circle(&names));
                        let of_text = |(text, place): (&str, &Place)| place.inside(text);
                        let place = signal.table.placed_word("value").map_or(signal.place.clone(), of_text);
                        let diagnostic = Diagnostic::error("signal::cyclic-definition", message).at(place, "circular");
                        out.push(diagnostic.help("define one of them without the others"));
                        None
                    }
                },
                None if self.made.contains_key(signal.name.as_str()) => None,
                None => self.lowered(signal, out),
            };
            self.made.entry(&signal.name).or_insert(made);
            open.pop();
        }
        *self.made.get(name)?
    }

    /// The functions of time that a signal names, the first one last.
    fn named_by(&self, signal: &SignalTable) -> Vec<&'a SignalTable> {
        let document = self.document;
        let Some(text) = signal.table.word("value") else { return Vec::new() };
        let Ok(read) = Expression::parse_law(text) else { return Vec::new() };
        let of_time = |name: &&str| *name != "t" && !document.moves(name);
        read.names().into_iter().filter(of_time).filter_map(|name| document.signals.get(name)).rev().collect()
    }

    fn lowered(&mut self, signal: &'a SignalTable, out: &mut Vec<Diagnostic>) -> Option<(Expr, Dimension)> {
        let SignalTable { kind, name, table, .. } = signal;
        let what = &format!("signal `{}`", shortened(name));
        let before = out.len();
        let values = self.reader.values(table.fields, table, what, out);
        let mut dimension = None;
        self.dimensions(table.fields, table, what, &mut dimension, out);
        if out.len() > before {
            return None;
        }
        for diagnostic in (kind.check)(&values) {
            out.push(key_diagnostic("signal::key", what, diagnostic, (table, &table.place)));
        }
        if out.len() > before {
            return None;
        }
        let (samples, of_samples) = match kind.keyword {
            "table" => samples::samples(self.document, table, &values, what, out)?,
            _ => (None, None),
        };
        let expression =
            table.placed_word("value").and_then(|(text, at)| Some((Expression::parse_law(text).ok()?, at)));
        let names = match expression {
            Some((read, place)) => self.names(&read, (place, what), out)?,
            None => Vec::new(),
        };
        let mut writer = SignalWriter {
            graph: &mut self.graph,
            time: self.time,
            name,
            dimension: of_samples.or(dimension).unwrap_or(Dimension::NONE),
            horizon: self.horizon,
            seed: self.seed,
            room: &mut self.room,
            parts: &mut self.parts,
            names: &names,
            samples: samples.as_ref(),
        };
        match (kind.write)(&values, &mut writer) {
            Ok(value) => Some((value, writer.dimension)),
            Err(Refused::Key(code, diagnostic)) => {
                out.push(key_diagnostic(code, what, diagnostic, (table, &table.place)));
                None
            }
            Err(Refused::Expression(error)) => {
                let place = table.place_of("value");
                out.push(self.diagnostic(error, values.word_or_default("value"), (place, what), out.len() < GUESSES));
                None
            }
        }
    }

    /// The one dimension of all quantities of a signal.
    fn dimensions(
        &self,
        fields: &[Field],
        table: &Table,
        what: &str,
        common: &mut Option<Dimension>,
        out: &mut Vec<Diagnostic>,
    ) {
        for field in fields {
            let Some(entry) = table.values.get(field.name) else { continue };
            let label = format!("`{}` of {what}", field.name);
            match (&field.kind, &entry.value) {
                (Kind::AnyQuantity, Value::Scalar(_)) => {
                    entry.scalar().iter().for_each(|scalar| self.like(scalar, &label, common, out));
                }
                (Kind::Lists, Value::Map(entries)) => {
                    for (name, scalar) in entries {
                        let (label, mut time) = (format!("`{}` in {label}", name.value), Some(Dimension::TIME));
                        match name.value.as_str() {
                            "time" => self.like(scalar, &label, &mut time, out),
                            "value" => self.like(scalar, &label, common, out),
                            _ => out.push(
                                Diagnostic::error("key::unknown", format!("{label} is not known"))
                                    .at(&name.place, "unknown")
                                    .help("points have `time` and `value`, a list each"),
                            ),
                        }
                    }
                }
                (Kind::Tables(inner), Value::Tables(tables)) => {
                    for (k, table) in tables.iter().enumerate() {
                        self.dimensions(inner, table, &format!("entry {} of {label}", k + 1), common, out);
                    }
                }
                _ => {}
            }
        }
    }

    fn like(&self, scalar: &Placed<Scalar>, label: &str, common: &mut Option<Dimension>, out: &mut Vec<Diagnostic>) {
        // Errors in the value itself have been reported.
        let Some((_, found)) = self.reader.scalar(scalar, None, label, &mut Vec::new()) else { return };
        match common {
            None => *common = Some(found),
            Some(common) if common.is_like(&found) => {}
            Some(common) => out.push(unlike(label, scalar, common, &found)),
        }
    }
}

/// A quantity of another dimension than those before it.
fn unlike(label: &str, scalar: &Placed<Scalar>, common: &Dimension, own: &Dimension) -> Diagnostic {
    let message = format!("{label}: expected {}, as before, found {}", common.noun(), own.noun());
    let help = format!("write a unit such as {}", common.example());
    Diagnostic::error("unit::dimension", message).at(&scalar.place, own.noun()).help(help)
}

/// A name that depends on more than the time, after a noun for it.
fn not_of_time(noun: &str, name: &str, expression: &Expression, (place, what): (&Place, &str)) -> Diagnostic {
    let span = expression.place_of(name).unwrap_or(0..expression.text().len());
    let message =
        format!("{what}: {noun}`{name}` depends on coordinates, a sensor or a block, so it is not a function of time");
    Diagnostic::error("signal::not-a-time-function", message)
        .at(place.part(expression.text(), span), "not a function of time")
}

/// The meaning of a name.
fn named(names: &[(String, Named)], name: &str) -> Option<Named> {
    names.iter().find(|(candidate, _)| candidate == name).map(|(_, named)| named.clone())
}
