//! Signals that are computed from those of a run, row by row: `cj.phi - cs.phi`.

use std::collections::BTreeSet;

use crate::study::read::read_values::read_word;
use crate::study::read::signal_table::{SignalContext, signal_kind};
use kardan_elements::manoeuvre::Cones;
use kardan_expr::expr::{Expr, Graph, Named};
use kardan_expr::plan::{Plan, compile};
use kardan_math::names::quoted;
use kardan_math::units::{Dimension, Exact, Expression, UnitError};
use kardan_model::{Document, Setting, TableReader};
use kardan_results::signal_name::SignalName;
use kardan_results::{Physical, PlottedReference, Series, Signal};
use kardan_schema::diagnostics::{Diagnostic, nearest, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::Table;

/// The dimension of a power.
pub(in crate::study) const POWER: Dimension = Dimension::mechanical(1, 2, -3, 0);

/// The time in an expression of signals.
const TIME: &str = "t";

/// A requested signal: its name, its dimension and its axis label.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) struct ResolvedSignal {
    pub(in crate::study) name: String,
    pub(in crate::study) physical: Physical,
    pub(in crate::study) dimension: Dimension,
}

/// The kind of a signal with this dimension. An angle is no unit of its own in computed signals, except for kinds that are named after it.
pub(in crate::study) fn kind_of(dimension: Dimension) -> (Physical, Dimension) {
    use Physical::{Angle, Charge, Current, Force, Position, Speed, Torque, Velocity, Voltage};
    // The unit of a power does not show an angle in it.
    if dimension.is_like(&POWER) {
        return (Physical::of_unit("W"), POWER);
    }
    let dimension = if dimension.word().is_some() { dimension } else { Dimension { angle: 0, ..dimension } };
    let all = [Angle, Speed, Torque, Position, Velocity, Force, Charge, Current, Voltage];
    let physical = all.into_iter().find(|physical| physical.dimension() == dimension);
    (physical.unwrap_or_else(|| Physical::of_unit(&dimension.si())), dimension)
}

/// An expression of names that vary, by their dimensions, and of constants.
pub(super) fn lowered(
    graph: &mut Graph,
    law: &Expression,
    varying: &dyn Fn(&str) -> Option<Dimension>,
    constant: &dyn Fn(&str) -> Option<(Exact, Dimension)>,
) -> Result<(Expr, Dimension), UnitError> {
    let mut names = |graph: &mut Graph, name: &str| match varying(name) {
        Some(dimension) => Some(Named::Varying(graph.symbol(name, dimension), dimension)),
        None => constant(name).map(|(value, dimension)| Named::Constant(value, dimension)),
    };
    graph.lowered(law, &mut names)
}

/// The dimension of a signal; `t` is the time.
fn signal_dimension(signals: &[(String, Physical)], name: &str) -> Option<Dimension> {
    let signal = signals.iter().find(|(candidate, _)| candidate == name).map(|(_, physical)| physical.dimension());
    signal.or_else(|| (name == TIME).then_some(Dimension::TIME))
}

/// A signal by its name, or an expression of signals, parameters and the time; errors are reported.
pub(in crate::study) fn resolve_signal(
    text: &str,
    place: &Place,
    context: &SignalContext<'_>,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<ResolvedSignal> {
    let plain = |name: &str, out: &mut Vec<Diagnostic>| {
        let physical = signal_kind(name, place, context, what, out)?;
        Some(ResolvedSignal { name: name.to_string(), physical, dimension: physical.dimension() })
    };
    if context.signals.iter().any(|(name, _)| name == text) {
        return plain(text, out);
    }
    let diagnostic = |error: UnitError| Diagnostic::of_unit_error(what, error, text, place);
    let law = match Expression::parse_law(text) {
        Ok(law) if law.names() == [text.trim()] && text.trim() != TIME => return plain(text, out),
        Ok(law) => law,
        // A name that is neither a signal nor an expression.
        Err(_) if !text.contains(['+', '*', '/', '(', '^']) && !text.contains(" - ") => return plain(text, out),
        Err(error) => {
            out.push(diagnostic(error));
            return None;
        }
    };
    let reader = TableReader::new(context.document, &[]);
    let value = |name: &str| reader.exact_value(name);
    let varying = |name: &str| signal_dimension(&context.signals, name);
    let is_signal = |name: &&str| varying(name).is_some();
    if let Some(name) = law.names().into_iter().find(|name| !is_signal(name) && value(name).is_none()) {
        if !context.may_have(name) && !context.document.suppressed.has_key(name) {
            out.push(unknown(name, &law, context, (what, place)));
        }
        return None;
    }
    if !law.names().iter().any(is_signal) {
        let message = format!("{what}: `{}` contains no signal, so it is constant", shortened(text));
        let help = "name a signal in it, such as `rk.phi`, or `t` for the time";
        out.push(Diagnostic::error("signal::missing", message).at(place, "no signal in it").help(help));
        return None;
    }
    match lowered(&mut Graph::default(), &law, &varying, &value) {
        Ok((_, dimension)) => {
            let (physical, dimension) = kind_of(dimension);
            Some(ResolvedSignal { name: text.to_string(), physical, dimension })
        }
        Err(error) => {
            out.push(diagnostic(error));
            None
        }
    }
}

/// A name in an expression that is neither a signal nor a parameter.
fn unknown(name: &str, law: &Expression, context: &SignalContext<'_>, (what, place): (&str, &Place)) -> Diagnostic {
    let text = law.text();
    let span = law.place_of(name).unwrap_or(0..text.len());
    let names = || context.signals.iter().map(|(name, _)| name.as_str());
    let parameters = || context.document.parameters.iter().map(|parameter| parameter.name.as_str());
    let head = SignalName::new(name).element;
    let of_head = || names().filter(|candidate| SignalName::new(candidate).element == head);
    let split_name =
        |candidate: &&str| candidate.contains('-') && candidate.contains(name) && text.contains(*candidate);
    let help = if let Some(whole) = names().chain(parameters()).find(split_name) {
        format!("a name with `-` needs quotes: `'{whole}'`")
    } else {
        match nearest(name, of_head()).or_else(|| nearest(name, names().chain(parameters()))) {
            Some(near) if near.contains('-') => format!("did you mean `'{near}'`?"),
            Some(near) => format!("did you mean `{near}`?"),
            None if of_head().next().is_some() => format!("`{}` has {}", shortened(head), quoted(of_head())),
            None => "name signals of the model, parameters, or `t` for the time".to_string(),
        }
    };
    let message = format!("{what}: there is no signal or parameter `{}`", shortened(name));
    Diagnostic::error("name::unknown", message).at(place.part(text, span), "no such signal").help(help)
}

/// A reference of a plot: the opposite of a signal, a signal, or an expression, whose minus is its own.
pub(in crate::study) fn reference(text: &str, context: &SignalContext<'_>) -> PlottedReference {
    let opposite = PlottedReference::from(text);
    let own = context.signals.iter().any(|(name, _)| *name == opposite.signal);
    let is_name =
        own || Expression::parse_law(&opposite.signal).is_ok_and(|law| law.names() == [opposite.signal.as_str()]);
    if is_name { opposite } else { PlottedReference { signal: text.into(), opposite: false } }
}

/// Cones that the car must have passed before a figure has a value.
#[derive(Debug, Clone)]
pub(in crate::study) struct Track {
    pub(in crate::study) cones: Cones,
    /// Position of the last cones, m.
    pub(in crate::study) end: f64,
}

/// The signals that a study computes from those of a run.
#[derive(Debug, Clone, Default)]
pub struct Computed {
    columns: Vec<(String, Physical)>,
    plan: Plan,
    /// Parameter values of the figures.
    pub(in crate::study) parameters: Vec<(String, Exact, Dimension)>,
    /// The tracks of its figures.
    pub(in crate::study) tracks: Vec<Track>,
}

impl Computed {
    /// All expressions in requirements, figures and plots, in one plan; those with an error are left out.
    pub(in crate::study) fn of(document: &Document, settings: &[Setting], signals: &[(String, Physical)]) -> Self {
        let is_declared = |text: &str| signals.iter().any(|(name, _)| name == text);
        let names_in = |table: &Table| -> Vec<String> {
            // The opposite of a signal is a reference of its own.
            let opposite = |text: &str| text.strip_prefix('-').is_some_and(is_declared);
            let references = table.names("references").unwrap_or_default().iter().filter(|word| !opposite(&word.value));
            let lists = table.names("signals").unwrap_or_default().iter().chain(references);
            let single =
                ["signal", "over", "detected"].into_iter().filter_map(|key| read_word(table, key)).map(str::to_string);
            lists.map(|word| word.value.clone()).chain(single).collect()
        };
        let tables = document
            .requirements
            .iter()
            .chain(&document.figures)
            .chain(&document.plots)
            .chain([&document.safety])
            .chain(document.safety.tables("effect"));
        let reached = document.cones.iter().map(|cones| cones.reached.clone());
        let texts: BTreeSet<String> =
            tables.flat_map(names_in).chain(reached).filter(|text| !is_declared(text)).collect();
        let reader = TableReader::new(document, settings);
        let value = |name: &str| reader.exact_value(name);
        let varying = |name: &str| signal_dimension(signals, name);
        let (mut graph, mut columns, mut expressions, mut symbols) =
            (Graph::default(), Vec::new(), Vec::new(), Vec::new());
        for text in texts {
            let Ok(law) = Expression::parse_law(&text) else { continue };
            let Ok((expr, dimension)) = lowered(&mut graph, &law, &varying, &value) else { continue };
            for (name, dimension) in law.names().into_iter().filter_map(|name| Some((name, varying(name)?))) {
                let symbol = graph.symbol(name, dimension);
                symbols.extend(graph.symbol_of(symbol).filter(|symbol| !symbols.contains(symbol)));
            }
            columns.push((text.clone(), kind_of(dimension).0));
            expressions.push((text, expr));
        }
        let values = document.figures.iter().filter_map(|table| Expression::parse_law(read_word(table, "value")?).ok());
        let mut named: BTreeSet<String> = BTreeSet::new();
        values.for_each(|law| named.extend(law.names().into_iter().map(str::to_string)));
        let constant = |name: String| value(&name).map(|(value, dimension)| (name, value, dimension));
        let parameters = named.into_iter().filter_map(constant).collect();
        let track = |cones: &Cones| {
            let end = Expression::parse(&cones.end).ok()?.evaluate(&value).ok()?.value;
            Some(Track { cones: cones.clone(), end: end.to_f64() })
        };
        let tracks = document.cones.iter().filter_map(track).collect();
        match compile(&graph, &symbols, &expressions) {
            Ok(plan) => Self { columns, plan, parameters, tracks },
            Err(_) => Self { parameters, ..Self::default() },
        }
    }

    /// The columns for the rows of a run.
    pub(in crate::study) fn signals(&self, series: &Series) -> Vec<Signal> {
        let inputs: Vec<Option<&[f64]>> = self
            .plan
            .inputs
            .iter()
            .map(|name| match series.signal(name) {
                Some(signal) => Some(signal.values.as_slice()),
                None => (name == TIME).then_some(series.time.as_slice()),
            })
            .collect();
        let column = |(name, physical): &(String, Physical)| {
            let (name, values) = (name.clone(), Vec::with_capacity(series.time.len()));
            Signal { name, physical: *physical, description: "computed from other signals".into(), values }
        };
        let mut out: Vec<Signal> = self.columns.iter().map(column).collect();
        let (block, mut memory) = (self.plan.block(), self.plan.memory());
        for row in 0..series.time.len() {
            for (place, input) in memory.iter_mut().zip(&inputs) {
                *place = input.and_then(|values| values.get(row)).copied().unwrap_or(f64::NAN);
            }
            // A value that is not a number is a gap in its column.
            let _ = block.evaluate(&mut memory);
            for (number, signal) in out.iter_mut().enumerate() {
                let value = block.output(number, &memory).unwrap_or(f64::NAN);
                signal.values.push(if value.is_finite() { value } else { f64::NAN });
            }
        }
        out
    }
}
