//! The request of `[safety]` of a model file, with its errors.

use crate::study::NamedFault;
use crate::study::measure::computed_signals::resolve_signal;
use crate::study::measure::requirement_spec::{MeasureTable, Measuring};
use crate::study::measure::selected_variants::{selected_variants, selects};
use crate::study::read::locations::unknown_name_or;
use crate::study::read::read_values::{has_key, key_error, quantity, read_word, varied_name};
use crate::study::read::signal_table::SignalContext;
use kardan_math::units::Dimension;
use kardan_model::tables::Measure;
use kardan_model::{Document, TableReader, VariantSettings, no_such_fault};
use kardan_results::SafetyEffect;
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::schema::{Placed, Sign, Table, Value};

/// The table in messages.
pub(in crate::study) const SAFETY: &str = "`[safety]`";

/// The cases, and the criteria of the verdict.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SafetySpec {
    /// Names of the faults, in their order.
    pub faults: Vec<String>,
    /// Whether pairs are included.
    pub pairs: bool,
    /// The variants; empty: all without faults of their own.
    pub variants: Vec<String>,
    /// Parameters whose values form the grid.
    pub values: Vec<String>,
    /// The detection condition.
    pub detected: Option<String>,
    /// The longest time to detection, s.
    pub detection_time_limit: Option<f64>,
    /// A state machine, and its states.
    pub reaction: Option<(String, Vec<String>)>,
    /// The effects.
    pub effects: Vec<Effect>,
    /// All monitors of the file.
    pub monitors: Vec<String>,
}

/// An unwanted effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Its name, text, units and bounds.
    pub definition: SafetyEffect,
    /// Signal, or an expression of signals.
    pub signal: String,
    /// Its measure.
    pub measure: Measure,
    /// Duration after the start of the fault, s.
    pub window: f64,
    /// Whether it measures the difference to the run without the fault.
    pub difference: bool,
}

/// Reads it; `None` without a named fault.
pub(in crate::study) fn safety_spec<'a>(
    context: &'a SignalContext<'a>,
    variants: &'a [String],
    (faults, ends): (&[NamedFault], &'a [(String, f64)]),
    out: &mut Vec<Diagnostic>,
) -> Option<SafetySpec> {
    let (document, table) = (context.document, &context.document.safety);
    let is_declared = !table.values.is_empty() || !table.unread.is_empty();
    if document.faults.is_empty() && !is_declared {
        return None;
    }
    let reader = TableReader::new(document, &[]);
    let time = |key: &str, table: &Table, out: &mut Vec<Diagnostic>| {
        let found = quantity(&reader, table, key, (Dimension::TIME, Sign::Positive), SAFETY, out);
        found.map(|x| x.to_f64())
    };
    let chosen = selected_variants(table, variants, context, SAFETY, out);
    let monitors = document.blocks.iter().filter(|block| block.kind.keyword == "monitor");
    let mut spec = SafetySpec {
        faults: fault_names(document, is_declared, out),
        pairs: read_word(table, "pairs") == Some("yes"),
        values: value_names(&reader, document, &chosen, out),
        variants: chosen,
        detected: condition(context, out),
        detection_time_limit: time("detection_time_limit", table, out),
        reaction: reaction(document, out),
        effects: Vec::new(),
        monitors: monitors.map(|block| block.name.clone()).collect(),
    };
    check_missing_keys(document, &spec, out);
    let tried = ends.iter().filter(|(name, _)| selects(&spec.variants, name));
    let duration = tried.map(|(_, end)| *end).fold(f64::INFINITY, f64::min);
    for table in table.tables("effect") {
        let Some(effect) = effect(context, &reader, (table, variants, ends), out) else { continue };
        let late = |fault: &&NamedFault| {
            let (begins, end) = (fault.begins(), fault.begins() + effect.window);
            spec.faults.contains(&fault.name) && begins < duration && end.is_finite() && end > duration * (1.0 + 1e-12)
        };
        if let Some(fault) = faults.iter().find(late) {
            let message = format!(
                "effect `{}`: its window ends {} s after the start of `{}` at {} s, after the end of the run at {duration} s",
                effect.definition.name,
                effect.window,
                fault.name,
                fault.begins()
            );
            let help = "lengthen `duration`, or shorten it";
            out.push(key_error("safety::window", message, (table, "window", "after the end"), help));
        }
        if let Some(other) = spec.effects.iter().find(|other| other.definition.name == effect.definition.name) {
            let message = format!("there are two effects named `{}`", other.definition.name);
            let help = "give each a name of its own";
            out.push(key_error("name::duplicate", message, (table, "name", "again here"), help));
        }
        spec.effects.push(effect);
    }
    Some(spec)
}

/// The faults of the analysis.
fn fault_names(document: &Document, is_declared: bool, out: &mut Vec<Diagnostic>) -> Vec<String> {
    let table = &document.safety;
    let all = || document.faults.iter().map(|(name, _)| name.value.clone()).collect::<Vec<_>>();
    let Some(Placed { value: Value::Names(names), place }) = table.values.get("faults") else {
        if is_declared && document.faults.is_empty() && !document.suppressed.all {
            let message = format!("{SAFETY}: the file has no named fault to analyse");
            let help = "write some: `[fault.encoder_lost]` with `sensor = \"encoder\"` and `at = \"0.5 s\"`";
            out.push(Diagnostic::error("safety::faults", message).at(&table.place, "no faults").help(help));
        }
        return all();
    };
    if names.is_empty() {
        let message = format!("{SAFETY}: `faults` is an empty list: the analysis has no case");
        let help = "name some, or omit it to select all";
        out.push(Diagnostic::error("list::length", message).at(place, "empty").help(help));
    }
    for word in names.iter().filter(|word| !document.suppressed.all && !document.has_fault(&word.value)) {
        out.push(no_such_fault(document, word, SAFETY));
    }
    names.iter().map(|word| word.value.clone()).filter(|name| document.has_fault(name)).collect()
}

/// The parameters of the grid; kardan reports a value of another dimension, and one that a variant of the table sets.
fn value_names(
    reader: &TableReader<'_>,
    document: &Document,
    chosen: &[String],
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    // The variants of the table: those that it names, otherwise those without faults of their own.
    let is_tried = |variant: &&VariantSettings| match chosen {
        [] => variant.faults.is_empty(),
        _ => chosen.contains(&variant.name),
    };
    let all = document.variant_settings();
    let sets = |variant: &VariantSettings, name: &str| variant.settings.iter().any(|one| one.name == name);
    let setter = |name: &str| all.iter().filter(is_tried).find(|variant| sets(variant, name));
    let mut names: Vec<String> = Vec::new();
    for (name, scalar) in document.safety.map("values").unwrap_or_default() {
        let shown = shortened(&name.value);
        let label = format!("`{shown}` of `values` of {SAFETY}");
        let Some(parameter) = document.declared(&name.value) else {
            if !document.suppressed.has(&name.value) {
                let names = document.parameters.iter().map(|parameter| parameter.name.as_str());
                let help = unknown_name_or(&name.value, names, "declare it under `[parameters]`");
                let message = format!("{label}: there is no such parameter");
                out.push(Diagnostic::error("name::unknown", message).at(&name.place, "no such parameter").help(help));
            }
            continue;
        };
        if let Some(variant) = setter(&name.value) {
            let own = shortened(&variant.name);
            let message =
                format!("{label}: the variant `{own}` sets it, so that a value here would change nothing in its runs");
            let help = "remove it here, or list under `variants` those that do not set it";
            out.push(
                Diagnostic::error("safety::set-by-variant", message).at(&name.place, "set by a variant").help(help),
            );
            continue;
        }
        if let Some((_, found)) = reader.scalar(scalar, None, &label, out)
            && !found.is_like(&parameter.dimension)
        {
            out.push(Diagnostic::wrong_dimension(&label, [parameter.dimension, found], &scalar.place));
        }
        if !names.contains(&name.value) {
            names.push(name.value.clone());
        }
    }
    names
}

/// The condition of detection.
fn condition(context: &SignalContext<'_>, out: &mut Vec<Diagnostic>) -> Option<String> {
    let table = &context.document.safety;
    let (text, place) = (read_word(table, "detected")?, table.place_of("detected"));
    let what = format!("`detected` of {SAFETY}");
    let found = resolve_signal(text, place, context, &what, out)?;
    if found.dimension != Dimension::NONE {
        let message = format!("{what}: `{}` is {}, not a condition", shortened(text), found.dimension.noun());
        let help = "compare it: `abs(residual) > 1 deg`, or name a monitor or `MACHINE.STATE`";
        out.push(Diagnostic::error("unit::dimension", message).at(place, "no condition").help(help));
        return None;
    }
    Some(found.name)
}

/// The state machine that reacts, with its states.
fn reaction(document: &Document, out: &mut Vec<Diagnostic>) -> Option<(String, Vec<String>)> {
    let name = read_word(&document.safety, "reaction")?;
    let machines = || document.blocks.iter().filter(|block| block.kind.keyword == "state_machine");
    let Some(block) = machines().find(|block| block.name == name) else {
        if !document.suppressed.has(name) {
            let names = machines().map(|block| block.name.as_str());
            let help = unknown_name_or(name, names, "write one: `[block.mode]` with `kind = \"state_machine\"`");
            let message = format!("`reaction` of {SAFETY}: there is no state machine `{}`", shortened(name));
            out.push(key_error("name::unknown", message, (&document.safety, "reaction", "no state machine"), help));
        }
        return None;
    };
    Some((name.to_string(), block.table.plain_names("states")))
}

/// Reports keys without effect because another one is missing.
fn check_missing_keys(document: &Document, spec: &SafetySpec, out: &mut Vec<Diagnostic>) {
    let table = &document.safety;
    if spec.detection_time_limit.is_some() && !has_key(table, "detected") {
        let message = format!("{SAFETY}: `detection_time_limit` has no effect without `detected`");
        let help = "add the detection condition: `detected = \"MONITOR\"`";
        out.push(key_error("key::missing", message, (table, "detection_time_limit", "no `detected`"), help));
    }
}

fn effect<'a>(
    context: &'a SignalContext<'a>,
    reader: &'a TableReader<'a>,
    (table, variants, ends): (&Table, &'a [String], &'a [(String, f64)]),
    out: &mut Vec<Diagnostic>,
) -> Option<Effect> {
    let name = read_word(table, "name")?.to_string();
    let what = format!("effect `{}`", shortened(&name));
    let signal = read_word(table, "signal")?;
    let found = resolve_signal(signal, table.place_of("signal"), context, &what, out)?;
    let measure = read_word(table, "measure").and_then(Measure::of)?;
    let measuring = &Measuring { context, reader, variants, ends };
    let own = MeasureTable { measuring, table, what: &what };
    let bounds = ["below", "above"].map(|key| {
        check_varied(context.document, table, (key, &what), out);
        own.like(key, found.dimension, out)
    });
    if let [Some(below), Some(above)] = bounds
        && above >= below
    {
        let message = format!("{what}: no value is above {above} and below {below}");
        let help = "make `above` less than `below`";
        out.push(key_error("requirement::bounds", message, (table, "below", "not above `above`"), help));
    }
    let window = quantity(reader, table, "window", (Dimension::TIME, Sign::Positive), &what, out);
    let window = window.map_or(f64::INFINITY, |x| x.to_f64());
    let difference = read_word(table, "baseline") != Some("zero");
    let display = own.unit_of_bounds(found.dimension);
    let window_text = if window.is_finite() { format!(" within {window} s") } else { String::new() };
    let against = if difference { ", against no fault" } else { "" };
    let text = format!("{} {signal}{window_text}{against}", measure.word());
    let (unit, [below, above]) = (found.physical.unit().to_string(), bounds);
    let definition = SafetyEffect { name, text, unit, display, below, above };
    Some(Effect { definition, signal: found.name, measure, window, difference })
}

/// Reports a bound that differs between the variants.
fn check_varied(document: &Document, table: &Table, (key, what): (&str, &str), out: &mut Vec<Diagnostic>) {
    let Some(Placed { value, place }) = table.scalar_or_default(key, &table.place) else { return };
    if let Some(name) = varied_name(document, &value) {
        let message = format!("`{key}` of {what}: `{name}` differs between the variants");
        let help = "write a number";
        out.push(Diagnostic::error("requirement::set-by-variant", message).at(place, "a varied parameter").help(help));
    }
}
