//! The scenario of a run: output times, initial state.

use std::collections::HashMap;

use super::events::{EventSpec, events, sources};
use super::faults::{NamedFault, faults};
use super::initial_state::initial_state;
use super::read_values::{key_error, quantity, quantity_like, read_word};
use super::source_signals::source_signals;
use kardan_math::num::{Rational, rational_to_f64};
use kardan_math::units::{Dimension, Exact, shown_quantity};
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::reduce::Reduced;
use kardan_model::parse::broken;
use kardan_model::{Document, Model, Setting, TableReader};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::{Sign, Table};
use kardan_simulate::{Scenario, SourceSignal};

/// Largest number of rows of one run.
const MOST_ROWS: f64 = 5e6;
/// Largest number of rows of all runs of a study together.
const MOST_ROWS_OF_ALL: f64 = 2e7;

/// The scenario, and its named faults; with the start, if the reduced model is known.
pub(in crate::study) fn scenario(
    document: &Document,
    model: &Model,
    (equations, reduced): (&Equations, Option<&Reduced>),
    settings: &[Setting],
    out: &mut Vec<Diagnostic>,
) -> (Scenario, Vec<NamedFault>) {
    let reader = TableReader::new(document, settings);
    let table = &document.scenario;
    let mut time = |key: &str| quantity(&reader, table, key, (Dimension::TIME, Sign::Positive), "`[scenario]`", out);
    let (duration, step) = (time("duration"), time("output_step"));
    let sources = sources(model, equations, document, out);
    let event_specs = events(&reader, document, model, &sources, duration.as_ref(), out);
    let context = (document, model, equations, reduced.is_some_and(Reduced::is_settled));
    let (faults, named) = faults(&reader, context, duration.as_ref(), out);
    let mut ends = event_specs.iter().flat_map(EventSpec::times).collect::<Vec<_>>();
    ends.extend(begins(&reader, document));
    let times = match (&duration, &step) {
        (Some(duration), Some(step)) if check_rows(document, duration, step, &ends, out) => {
            output_times(duration, step, &ends)
        }
        _ => vec![0.0],
    };
    let (position, speed) = initial_state(&reader, document, reduced, out);
    let duration = duration.map_or(0.0, |duration| duration.to_f64());
    check_readings(&reader, (document, model), out);
    let seed = whole(&reader, table, "seed", "`[scenario]`", out).unwrap_or_default();
    let events = event_specs.iter().filter_map(|event| event.event(sources.len())).collect();
    let mut signals = source_signals(&reader, (document, model), &sources, (duration, seed), out);
    signals.extend(model.programs.functions.iter().filter_map(|(name, function)| {
        let source = sources.partition_point(|source| source.name < *name);
        sources.get(source).filter(|source| source.name == *name)?;
        Some(SourceSignal { source, function: (**function).clone() })
    }));
    signals.sort_by_key(|signal| signal.source);
    let (flow, tasks): (Vec<_>, Vec<_>) = model.programs.tasks.iter().cloned().partition(|task| task.period.is_none());
    let flow = flow.into_iter().next();
    let (recorded, sensors) = (None, model.programs.sensors.clone());
    #[rustfmt::skip]
    let scenario = Scenario {
        duration, times, sources, events, signals, tasks, flow, sensors, faults, seed, recorded, position, speed,
    };
    (scenario, named)
}

/// Begins of named faults: rows are dense after them, whether the faults occur or not, so that runs with and without them have the
/// same rows.
fn begins(reader: &TableReader<'_>, document: &Document) -> Vec<Exact> {
    let at = |table: &Table| {
        let positive = (Dimension::TIME, Sign::Positive);
        quantity(reader, table, "at", positive, "a fault", &mut Vec::new())
    };
    let mut all: Vec<Exact> = document.faults.iter().filter_map(|(_, table)| at(table)).collect();
    all.sort_by_key(Exact::to_rational);
    all.dedup();
    all
}

/// A whole number of a table; `None` if it is missing or wrong, which is reported.
pub(in crate::study) fn whole(
    reader: &TableReader<'_>,
    table: &Table,
    key: &str,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<u64> {
    let number = quantity(reader, table, key, (Dimension::NONE, Sign::NonNegative), what, out)?.to_f64();
    // Above 2^53 neighbours are indistinguishable.
    if number.fract() == 0.0 && number <= 9e15 {
        return Some(number as u64);
    }
    let message = format!("`{key}` of {what}: expected a whole number, found {number}");
    let help = "write a whole number, such as 1";
    out.push(key_error("number::whole", message, (table, key, "not a whole number"), help));
    None
}

/// Noise and resolution of a sensor have the kind that it measures and counts.
fn check_readings(reader: &TableReader<'_>, (document, model): (&Document, &Model), out: &mut Vec<Diagnostic>) {
    let of_signals = model.programs.sensors.iter().flat_map(|task| &task.outputs);
    let of_signals: HashMap<&str, Dimension> =
        of_signals.map(|output| (output.name.as_str(), output.dimension)).collect();
    for sensor in document.elements.iter().filter(|element| element.kind.keyword == "sensor") {
        let in_domain =
            |dimension: Dimension| if sensor.table.translational { dimension.translational() } else { dimension };
        let [measured, counted] = match read_word(&sensor.table, "measures") {
            Some("angle") => [Dimension::ANGLE, Dimension::ANGLE].map(in_domain),
            Some("speed") => [Dimension::ANGULAR_VELOCITY, Dimension::ANGLE].map(in_domain),
            Some("torque" | "net_torque") => [Dimension::TORQUE, Dimension::ANGLE].map(in_domain),
            // An erroneous one has been reported.
            Some("signal") => match of_signals.get(sensor.name.as_str()) {
                Some(dimension) => [*dimension; 2],
                None => continue,
            },
            _ => continue,
        };
        let of_signal = read_word(&sensor.table, "measures") == Some("signal");
        let read = if of_signal { quantity_like } else { quantity };
        let what = format!("sensor `{}`", sensor.name);
        let expected = [("noise", measured, Sign::NonNegative), ("resolution", counted, Sign::Positive)];
        for (key, dimension, sign) in expected {
            let found = read(reader, &sensor.table, key, (dimension, sign), &what, out);
            let Some((found, (rule, help))) = found.and_then(|found| Some((found.clone(), broken(sign, &found)?)))
            else {
                continue;
            };
            let message = format!("`{key}` of {what} {rule}, found {}", shown_quantity(&found, dimension));
            out.push(key_error("number::sign", message, (&sensor.table, key, rule), help));
        }
    }
}

/// Whether the results fit into memory.
fn check_rows(
    document: &Document,
    duration: &Exact,
    step: &Exact,
    events: &[Exact],
    out: &mut Vec<Diagnostic>,
) -> bool {
    let runs: f64 = document.runs() as f64;
    let most = MOST_ROWS.min(MOST_ROWS_OF_ALL / runs);
    let mut events: Vec<f64> = events.iter().map(Exact::to_f64).collect();
    events.sort_by(f64::total_cmp);
    let rows = most_rows(duration.to_f64(), step.to_f64(), &events);
    if rows <= most {
        return true;
    }
    let shown = if rows < 1e9 { format!("{rows:.0}") } else { format!("about {rows:.0e}") };
    let shown = if rows.is_finite() { shown } else { "endlessly many".to_string() };
    let each = if runs > 1.0 { format!(" for each of {runs} variants") } else { String::new() };
    let key = if document.scenario.values.contains_key("output_step") { "output_step" } else { "duration" };
    // Fine rows after the events are added for every step, until they overlap: the hint is a sufficient step, rounded as it is
    // printed.
    let mut coarser = step.to_f64().max(duration.to_f64() / (0.9 * most));
    while most_rows(duration.to_f64(), coarser, &events) > 0.99 * most && coarser < duration.to_f64() {
        coarser *= 1.1;
    }
    let help = if coarser < duration.to_f64() {
        format!("choose an output_step of at least {coarser:.3e} s")
    } else {
        format!("no output_step suffices for {} steps and ends of ramps: remove some of them", events.len())
    };
    let message = format!("the results would have {shown} rows{each}, more than {most:.0}");
    out.push(key_error("scenario::rows", message, (&document.scenario, key, "too fine for this duration"), help));
    false
}

/// Number of fine rows in a step.
const FINE: u32 = 20;
/// Number of steps after an event with fine rows.
const FINE_STEPS: u32 = 20;

/// A bound on the rows of [`output_times`], which counts a time twice only where a fine row falls on a multiple of the step or on
/// an event. Events in order of time.
fn most_rows(duration: f64, step: f64, events: &[f64]) -> f64 {
    let fine = step / f64::from(FINE);
    let mut rows = (duration / step).floor() + 2.0;
    // The end of the last window.
    let mut end = f64::NEG_INFINITY;
    for event in events.iter().take_while(|event| **event <= duration) {
        let next = (event + f64::from(FINE_STEPS) * step).min(duration);
        let more = if *event > end { next - event } else { next - end };
        rows += if *event > end { 1.0 } else { 0.0 } + more.max(0.0) / fine + 1.0;
        end = end.max(next);
    }
    rows
}

/// Multiples of the step, twentieths of it for 20 steps after each event, the event times and the end; each is the number
/// nearest to its exact value. Where these windows overlap, the twentieths continue from the first event of them.
pub(in crate::study) fn output_times(duration: &Exact, step: &Exact, events: &[Exact]) -> Vec<f64> {
    let end = duration.to_f64();
    let ratio = step.to_rational();
    let mut times: Vec<f64> = Vec::new();
    let count = (end / step.to_f64()).floor() as usize;
    add_multiples(&mut times, &Rational::ZERO, &ratio, count);
    let twentieth = &ratio / Rational::from(FINE);
    let window = &ratio * Rational::from(FINE_STEPS);
    let last = duration.to_rational();
    let mut events: Vec<Rational> = events.iter().map(Exact::to_rational).filter(|event| *event <= last).collect();
    events.sort();
    let mut k = 0;
    while k < events.len() {
        let first = events[k].clone();
        let mut until = &first + &window;
        while let Some(event) = events.get(k).filter(|event| **event <= until) {
            times.push(rational_to_f64(event));
            until = event + &window;
            k += 1;
        }
        let until = until.min(last.clone());
        let fine = rational_to_f64(&Rational::from(((until - &first) / &twentieth).floor()));
        add_multiples(&mut times, &first, &twentieth, fine as usize);
    }
    times.push(end);
    times.retain(|time| (0.0..=end).contains(time));
    times.sort_by(f64::total_cmp);
    times.dedup_by(|b, a| *b - *a <= 1e-12 * end);
    if let Some(last) = times.last_mut() {
        *last = end;
    }
    times
}

/// Adds `first + k step` for k from 0 to a count, each rounded once where these are fractions of numbers that are not too long.
fn add_multiples(times: &mut Vec<f64>, first: &Rational, step: &Rational, count: usize) {
    let below = Rational::from(first.denominator().clone()) * Rational::from(step.denominator().clone());
    let [own, each, below] = [first * &below, step * &below, below].map(|number| rational_to_f64(&number));
    let [begin, length] = [first, step].map(rational_to_f64);
    // A quotient of two whole numbers below 2^53 is rounded once.
    let small = own + each * (count as f64 + 1.0) < 9e15 && below < 9e15;
    times.extend((0..=count).map(|k| match small {
        true => (own + each * k as f64) / below,
        false => begin + length * k as f64,
    }));
}

#[cfg(test)]
#[path = "../../../tests/unit/study/read/scenario.rs"]
mod tests;
