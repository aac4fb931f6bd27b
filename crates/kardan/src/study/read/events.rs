//! The events of a scenario, and the external signals that they set.

use std::collections::{HashMap, HashSet};

use super::locations::places_in_control;
use super::read_values::{key_error, quantity, read_word};
use super::signal_table::SignalContext;
use kardan_math::names::{NamedList, did_you_mean};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::equations::InputKind;
use kardan_model::{ControlSpec, Document, Instance, Model, TableReader};
use kardan_results::Physical;
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::schema::{Sign, Table};
use kardan_simulate::{SignalEvent, Source, SourceTarget};
use kardan_synthesis::Reference;

/// Signals that events may set: references of laws, disturbances, torques of motors without a law.
pub(in crate::study) fn sources(
    model: &Model,
    equations: &Equations,
    document: &Document,
    out: &mut Vec<Diagnostic>,
) -> Vec<Source> {
    let mut sources: NamedList<Source> = NamedList::default();
    let mut commanded: HashSet<String> = HashSet::new();
    let blocks = of_programs(model, &mut sources);
    let source = |name, physical, description| Source { name, physical, description, target: SourceTarget::Reference };
    for control in &model.controls {
        commanded.extend((control.law.inputs)(&control.values));
        for reference in control.law.all_references(&control.values) {
            let element = document.elements.get(&reference.name);
            if let Some(output) = blocks.get(reference.name.as_str()) {
                of_block(document, control, &reference, output, out);
                continue;
            }
            let declared = sources.get(&reference.name);
            let conflict = match (element, declared) {
                (Some(element), _) => Some(format!("of a {}", element.kind.keyword)),
                (None, Some(declared)) if declared.physical != reference.physical => {
                    Some(format!("of {} in {}", declared.description, declared.physical.unit()))
                }
                _ => None,
            };
            if let Some(conflict) = conflict {
                let message =
                    format!("control `{}`: the name `{}` is already that {conflict}", control.name, reference.name);
                out.push(
                    Diagnostic::error("name::duplicate", message)
                        .at_each(places_in_control(document, control, &reference.name).pop(), "this name")
                        .help("give the reference a name of its own, such as `ref_rack`"),
                );
            } else if declared.is_none() {
                sources.push(source(reference.name, reference.physical, reference.description));
            }
        }
    }
    for reference in model.idle.iter().flat_map(|control| control.law.all_references(&control.values)) {
        if !blocks.contains_key(reference.name.as_str()) && !sources.has(&reference.name) {
            let description = format!("{} (of a controller that is not in the loop)", reference.description);
            sources.push(source(reference.name, reference.physical, description));
        }
    }
    for (name, dimension, block) in &model.programs.references {
        if !sources.has(name) {
            let description = format!("reference of the block {block}");
            sources.push(source(name.clone(), Physical::of(*dimension), description));
        }
    }
    for (k, input) in equations.inputs.iter().enumerate() {
        let (name, description) = match &input.value {
            InputKind::Disturbance => (input.element.clone(), format!("disturbance {}", input.element)),
            InputKind::Motor(_) if commanded.contains(&input.element) => continue,
            InputKind::Motor(_) => {
                let effort = equations.domain_of(input).effort();
                (effort.of(&input.element), format!("{} of {}", effort.physical().word(), input.element))
            }
        };
        let physical = equations.domain_of(input).effort().physical();
        sources.push(Source { name, physical, description, target: SourceTarget::Input(k) });
    }
    let mut sources = sources.into_vec();
    sources.sort_by(|a, b| a.name.cmp(&b.name));
    sources
}

/// The number of the source of a name, among those of [`sources`], that is no output of a block.
pub(in crate::study) fn settable(sources: &[Source], name: &str) -> Option<usize> {
    let first = sources.partition_point(|source| source.name.as_str() < name);
    let own = sources[first..].iter().take_while(|source| source.name == name);
    own.into_iter().position(|source| source.target != SourceTarget::Block).map(|place| first + place)
}

/// Outputs and time functions of blocks, as sources that nothing else sets; returns names and dimensions of the outputs.
fn of_programs<'m>(model: &'m Model, sources: &mut NamedList<Source>) -> HashMap<&'m str, Dimension> {
    let outputs = || model.programs.tasks.iter().flat_map(|task| &task.outputs);
    let source = |name: &str, dimension, description: &str| Source {
        name: name.into(),
        physical: Physical::of(dimension),
        description: description.into(),
        target: SourceTarget::Block,
    };
    sources.extend(outputs().map(|output| source(&output.name, output.dimension, &output.description)));
    let functions = model.programs.functions.iter();
    sources.extend(functions.map(|(name, function)| source(name, function.dimension(), &format!("signal {name}"))));
    let found = |name: &str| format!("output of the control {}", SignalName::new(name).element);
    let exported = model.programs.exported.iter();
    sources.extend(exported.map(|(name, dimension)| source(name, *dimension, &found(name))));
    outputs().map(|output| (output.name.as_str(), output.dimension)).collect()
}

/// Rejects a reference that a block outputs in another unit.
fn of_block(
    document: &Document,
    control: &ControlSpec,
    reference: &Reference,
    output: &Dimension,
    out: &mut Vec<Diagnostic>,
) {
    let expected = reference.physical.dimension();
    if !expected.is_like(output) {
        let name = &reference.name;
        let message = format!(
            "control `{}`: `{name}` should be {}, but the block outputs {}",
            control.name,
            expected.noun(),
            output.noun()
        );
        let diagnostic = Diagnostic::error("unit::dimension", message)
            .at_each(places_in_control(document, control, name).pop(), "this reference");
        out.push(diagnostic.help(format!("choose an output unit of the block such as {}", expected.example())));
    }
}

/// Why an event, or another setter of signals, cannot set one; nothing if the signal may exist once the reported errors are corrected.
pub(in crate::study) fn not_settable(
    signal: &str,
    sources: &[Source],
    (document, model): (&Document, &Model),
    [who, all]: [&str; 2],
) -> Option<(String, String)> {
    let shown = shortened(signal);
    let settable = || sources.iter().filter(|source| source.target != SourceTarget::Block);
    let names = || settable().map(|source| source.name.as_str());
    if let Some(block) = sources.iter().find(|source| source.name == signal && source.target == SourceTarget::Block) {
        let message = format!("`{shown}` is {}, so {who} cannot set it", block.description);
        return Some((message, "set what it follows from, or give it another name".into()));
    }
    let all = || match settable().next() {
        None => "there is nothing to set: add a motor, a disturbance or a voltage_source".to_string(),
        _ => format!("{all} can set {}", quoted(names())),
    };
    let name = SignalName::new(signal);
    let (head, quantity) = (name.unqualified().unwrap_or(signal), name.quantity());
    let is_kind = |keyword: &str| document.elements.iter().any(|e| e.name == head && e.kind.keyword == keyword);
    let commanded = match quantity {
        Some(Quantity::Torque | Quantity::Force) if is_kind("motor") => Some("motor"),
        Some(Quantity::Voltage | Quantity::Velocity) if is_kind("voltage_source") => Some("voltage source"),
        _ => None,
    };
    if let Some(kind) = commanded {
        let commands = |control: &&ControlSpec| (control.law.inputs)(&control.values).iter().any(|input| input == head);
        let control = model.controls.iter().find(commands)?;
        let references: Vec<String> = control.law.all_references(&control.values).into_iter().map(|r| r.name).collect();
        let message = format!("control `{}` commands the {kind} `{head}`, so {who} cannot set `{shown}`", control.name);
        return Some((message, format!("set {} instead", quoted(references))));
    }
    if quantity == Some(Quantity::Current) && is_kind("current_source") {
        let message = format!("the `current` of `{head}` prescribes its current, so {who} cannot set `{shown}`");
        let help = "leave `current` out for events to set it, or write the function of time there";
        return Some((message, help.into()));
    }
    let is_charge = document.charges().iter().any(|charge| charge == head);
    let follows = match quantity {
        Some(Quantity::Angle | Quantity::Speed) => is_kind("shaft"),
        Some(Quantity::Position) => is_kind("mass"),
        Some(Quantity::Velocity) => is_kind("mass") || is_charge,
        Some(Quantity::Charge | Quantity::Current) => is_charge,
        Some(Quantity::Sum | Quantity::State | Quantity::Change) => is_kind("state"),
        _ => false,
    };
    if follows {
        return Some((format!("`{shown}` follows from the equations, so {who} cannot set it"), all()));
    }
    let context = SignalContext { document, signals: Vec::new(), doubtful: model.doubtful.clone() };
    if context.may_have(signal) {
        return None;
    }
    let help = did_you_mean(nearest(signal, names()), all);
    Some((format!("there is no signal `{shown}` that {who} can set"), help))
}

/// An event as in the file.
pub(in crate::study) struct EventSpec {
    /// Number of its entry, starting at one.
    number: usize,
    /// Number of the source; numbers after the sources are those of prescribed motions of the model.
    source: usize,
    at: Exact,
    to: Exact,
    /// Zero for a step.
    over: Exact,
}

impl EventSpec {
    fn ramps(&self) -> bool {
        !self.over.is_zero()
    }

    /// When it begins, and when a ramp ends.
    pub fn times(&self) -> impl Iterator<Item = Exact> {
        let end = self.ramps().then(|| Exact::new(self.at.to_rational() + self.over.to_rational(), 0));
        std::iter::once(self.at.clone()).chain(end)
    }

    /// The event of the scenario, with this number of sources.
    pub fn event(&self, sources: usize) -> Option<SignalEvent> {
        (self.source < sources).then(|| SignalEvent {
            source: self.source,
            at: self.at.to_f64(),
            to: self.to.to_f64(),
            over: self.over.to_f64(),
        })
    }
}

/// `[[scenario.event]]` of a document; errors are reported.
pub(in crate::study) fn events(
    reader: &TableReader<'_>,
    document: &Document,
    model: &Model,
    sources: &[Source],
    duration: Option<&Exact>,
    out: &mut Vec<Diagnostic>,
) -> Vec<EventSpec> {
    let mut accepted: Vec<EventSpec> = Vec::new();
    let mut at_times: HashMap<(usize, u64), Vec<usize>> = HashMap::new();
    let prescribed = prescribed(document);
    for (i, table) in document.scenario.tables("event").iter().enumerate() {
        let what = &format!("entry {} of `event` of `[scenario]`", i + 1);
        let mut time = |key: &str| quantity(reader, table, key, (Dimension::TIME, Sign::NonNegative), what, out);
        let (at, over) = (time("at"), time("over"));
        check_late(table, "event", at.as_ref(), duration, out);
        let Some(signal) = read_word(table, "signal") else { continue };
        let found = settable(sources, signal).map(|k| (k, sources[k].physical)).or_else(|| {
            let own = prescribed.iter().position(|name| name == signal);
            own.map(|k| (sources.len() + k, Physical::Current))
        });
        let Some((source, physical)) = found else {
            if let Some((message, help)) = not_settable(signal, sources, (document, model), ["an event", "events"]) {
                let message = format!("{what}: {message}");
                out.push(key_error("name::unknown", message, (table, "signal", "not settable"), help));
            }
            continue;
        };
        let dimension = physical.dimension();
        let to = quantity(reader, table, "to", (dimension, Sign::Any), what, out);
        let (Some(at), Some(to)) = (at, to) else { continue };
        let event = EventSpec { number: i + 1, source, at, to, over: over.unwrap_or_else(|| Exact::from_ratio(0, 1)) };
        let before = at_times.entry((event.source, event.at.to_f64().to_bits())).or_default();
        check_duplicates(table, signal, &event, (&accepted, before), out);
        before.push(accepted.len());
        accepted.push(event);
    }
    accepted
}

/// Currents that events prescribe: functions of time of the model, numbered after the sources.
fn prescribed(document: &Document) -> Vec<String> {
    let free = |element: &&Instance| !element.table.values.contains_key("current");
    let signal = |element: &Instance| element.kind.signal_of_events(&element.name);
    document.elements.iter().filter(free).filter_map(signal).collect()
}

/// Warns of an event, or a fault, after the end of the run.
pub(in crate::study) fn check_late(
    table: &Table,
    what: &str,
    at: Option<&Exact>,
    duration: Option<&Exact>,
    out: &mut Vec<Diagnostic>,
) {
    let (Some(at), Some(end)) = (at.map(Exact::to_f64), duration.map(Exact::to_f64)) else { return };
    if at >= end {
        let message = format!("this {what} at {at} s never happens: the run ends at {end} s");
        let help = format!("lengthen `duration` or move the {what}");
        out.push(Diagnostic::warning("event::after-end", message).at(table.place_of("at"), "after the end").help(help));
    }
}

/// Entries that a message lists.
const MOST_LISTED: usize = 12;

/// Reports an event that sets a signal to a second value at the same time.
fn check_duplicates(
    table: &Table,
    signal: &str,
    event: &EventSpec,
    (accepted, before): (&[EventSpec], &[usize]),
    out: &mut Vec<Diagnostic>,
) {
    let at = event.at.to_f64();
    match before {
        [] => return,
        // A step and then a ramp: a jump from which the ramp begins.
        [other] if !accepted[*other].ramps() && event.ramps() => return,
        _ => {}
    }
    let shown: Vec<String> = before.iter().take(MOST_LISTED).map(|other| accepted[*other].number.to_string()).collect();
    let entries = if before.len() == 1 { "entry" } else { "entries" };
    let more = before.len() - shown.len();
    let more = if more == 0 { String::new() } else { format!(" and {more} more") };
    let message = format!(
        "entry {} of `event` of `[scenario]`: `{signal}` is set at {at} s already, by {entries} {}{more}: at one time a signal has one \
         value",
        event.number,
        shown.join(", ")
    );
    out.push(Diagnostic::error("event::duplicate", message).at(table.place_of("at"), "the same time").help(
        "keep one of them, or give them different times; only a step and, after it, a ramp from there go together",
    ));
}
