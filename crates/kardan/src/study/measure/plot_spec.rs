//! Plots as a model file writes them: signals, units, time range and spectra.

use std::collections::HashMap;

use crate::study::measure::computed_signals::{reference, resolve_signal};
use crate::study::measure::spectrum::LEAST_ROWS;
use crate::study::read::read_values::{key_error, quantity, read_word};
use crate::study::read::signal_table::SignalContext;
use kardan_math::units::split_unit;
use kardan_model::TableReader;
use kardan_results::{DisplayUnit, Physical, Plot, PlotUnit, PlottedReference, Span};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Placed, Table};

use super::requirement_spec::TIME;
use super::selected_variants::selected_variants;

/// The unit in which signals of a plot are drawn, `None` if it is the SI unit; a text that is no unit of one of them is reported.
fn display(table: &Table, kinds: &[Physical], what: &str, out: &mut Vec<Diagnostic>) -> Option<PlotUnit> {
    let text = read_word(table, "display_unit")?.trim();
    let quantity_text = format!("1 {text}");
    let at = (table, "display_unit", "no unit of a drawn signal");
    let units: Vec<String> = kinds.iter().map(|kind| format!("`{}`", kind.unit())).collect();
    let drawn = units.join(", ");
    let Some((unit, size, dimension)) = split_unit(&quantity_text) else {
        let message = format!("{what}: `{}` is no unit", shortened(text));
        out.push(key_error("unit::unknown", message, at, "write a unit such as `deg`, `rpm` or `mN m`"));
        return None;
    };
    let Some(&physical) = kinds.iter().find(|kind| kind.dimension() == dimension) else {
        // Signals that were not found have been reported.
        if !kinds.is_empty() {
            let message = format!("{what}: `{}` is {}, and no such signal is drawn", shortened(text), dimension.noun());
            let help = format!("the signals drawn are in {drawn}: write a unit of one of these");
            out.push(key_error("unit::dimension", message, at, help));
        }
        return None;
    };
    let size = size.to_f64();
    (size != 1.0).then(|| PlotUnit { physical, unit: DisplayUnit { unit: unit.into(), size } })
}

/// The time range of a plot; an empty one is reported.
fn window(table: &Table, context: &SignalContext<'_>, what: &str, out: &mut Vec<Diagnostic>) -> Option<Span> {
    let reader = &TableReader::new(context.document, &[]);
    let [from, until] = ["from", "until"].map(|key| quantity(reader, table, key, TIME, what, out).map(|x| x.to_f64()));
    let duration = quantity(reader, &context.document.scenario, "duration", TIME, "", &mut Vec::new());
    let end = duration.map_or(f64::INFINITY, |x| x.to_f64());
    let begin = from.unwrap_or_default();
    let last = until.unwrap_or(f64::INFINITY);
    if begin >= last {
        let message = format!("{what}: no time is left to draw: it begins at {begin} s and ends at {last} s");
        let help = "let `from` come before `until`";
        out.push(key_error("plot::window", message, (table, "from", "no time is left"), help));
    } else if begin >= end {
        let message = format!("{what}: no time is left to draw: it begins at {begin} s and the run ends at {end} s");
        let help = "lengthen `duration` or let `from` come before its end";
        out.push(Diagnostic::warning("plot::window", message).at(table.place_of("from"), "after the end").help(help));
    }
    (from.is_some() || until.is_some()).then_some(Span { start: begin, end: until.unwrap_or(f64::INFINITY) })
}

pub(in crate::study) fn plots(
    context: &SignalContext<'_>,
    variants: &[String],
    out: &mut Vec<Diagnostic>,
) -> Vec<Plot> {
    let mut plots: Vec<Plot> = Vec::new();
    let mut places: HashMap<String, &Place> = HashMap::new();
    for table in &context.document.plots {
        let id = read_word(table, "name").unwrap_or_default().to_string();
        let what = if id.is_empty() { "`[[plot]]`".to_string() } else { format!("plot `{id}`") };
        let place = table.place_of("name");
        if let Some(first) = places.get(&id.to_ascii_lowercase()).filter(|_| !id.is_empty()) {
            let message = format!("there are two plots named `{id}`");
            let diagnostic = Diagnostic::duplicate("name::duplicate", message, place, *first);
            out.push(diagnostic.help("give each plot a name of its own; it becomes a file name"));
        }
        let variants = selected_variants(table, variants, context, &what, out);
        let mut kinds = Vec::new();
        let drawn: Vec<String> = table.plain_names("signals");
        for word in table.names("signals").unwrap_or_default() {
            kinds.extend(resolve_signal(&word.value, &word.place, context, &what, out).map(|found| found.physical));
        }
        let mut drawn_beside = |word: &Placed<String>| {
            let reference = reference(&word.value, context);
            resolve_signal(&reference.signal, &word.place, context, &what, out);
            reference
        };
        let references: Vec<PlottedReference> =
            table.names("references").unwrap_or_default().iter().map(&mut drawn_beside).collect();
        let labels: Vec<String> = table.plain_names("labels");
        let curves = drawn.len() + references.len();
        if labels.len() > curves && !table.unread.contains(&"signals") && !table.unread.contains(&"references") {
            let message = format!("{what}: {} labels for {curves} signals and references", labels.len());
            let help = "write one for each of `signals`, then one for each of `references`";
            out.push(key_error("list::length", message, (table, "labels", "too many"), help));
        }
        if drawn.is_empty() && table.values.contains_key("signals") {
            let message = format!("{what}: there is nothing to draw");
            let help = "list one or more signals: `signals = [\"rk.phi\"]`";
            out.push(key_error("list::length", message, (table, "signals", "no signal"), help));
        }
        let over = read_word(table, "over").and_then(|text| {
            let found = resolve_signal(text, table.place_of("over"), context, &what, out)?;
            kinds.push(found.physical);
            Some(found.name)
        });
        let (display, window) = (display(table, &kinds, &what, out), window(table, context, &what, out));
        let spectrum = read_word(table, "kind") == Some("spectrum");
        if spectrum {
            check_spectrum(table, context, (window, &what), out);
        }
        let log = |key: &str| read_word(table, key) == Some("log");
        places.entry(id.to_ascii_lowercase()).or_insert(place);
        plots.push(Plot {
            id,
            title: read_word(table, "title").unwrap_or_default().into(),
            caption: read_word(table, "caption").unwrap_or_default().into(),
            signals: drawn,
            references,
            labels,
            variants,
            display,
            window,
            over,
            log_x: log("x_scale"),
            log_y: log("y_scale"),
            spectrum,
        });
    }
    plots
}

/// Reports a spectrum over a signal other than the frequency, and a spectrum of too few rows.
fn check_spectrum(
    table: &Table,
    context: &SignalContext<'_>,
    (window, what): (Option<Span>, &str),
    out: &mut Vec<Diagnostic>,
) {
    if table.values.contains_key("over") {
        let message = format!("{what}: a spectrum has the frequency on its horizontal axis, not a signal");
        let help = "remove `over`, or draw values: `kind = \"values\"`";
        out.push(key_error("plot::spectrum", message, (table, "over", "not the frequency"), help));
    }
    let reader = &TableReader::new(context.document, &[]);
    let scenario = &context.document.scenario;
    let [duration, step] = ["duration", "output_step"]
        .map(|key| quantity(reader, scenario, key, TIME, "", &mut Vec::new()).map(|value| value.to_f64()));
    let (Some(duration), Some(step)) = (duration, step.filter(|step| *step > 0.0)) else { return };
    let Span { start: from, end: until } = window.unwrap_or(Span { start: 0.0, end: f64::INFINITY });
    let rows = ((until.min(duration) - from) / step).max(0.0).floor();
    if rows < LEAST_ROWS as f64 {
        let message = format!(
            "{what}: a spectrum takes more than {LEAST_ROWS} rows, and {rows} steps of {step} s lie in the time that is drawn"
        );
        let help = "draw a longer time, or shorten `output_step` of `[scenario]`";
        out.push(key_error("plot::spectrum", message, (table, "kind", "too few rows"), help));
    }
}
