//! Which blocks analyses, designs and margins include, and which they do not.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use super::loop_blocks::{are_in_maps, blocks, too_large};
use super::margins::searches;
use crate::study::PreparedVariant;
use crate::study::read::locations::place_in_control;
use kardan_expr::expr::{Expr, Symbol};
use kardan_math::units::{Dimension, Exact, shown_quantity};
use kardan_mechanics::program::{Read, Task, TaskOutput};
use kardan_model::{Document, Model};
use kardan_results::signal_name::SignalName;
use kardan_results::{SignalNode, SignalOutput};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_simulate::{Scenario, SourceTarget};
use kardan_synthesis::{Law, blending_signal};

/// Outputs of blocks that depend on the motion, directly or through other blocks.
fn moving(model: &Model) -> BTreeSet<String> {
    let tasks: Vec<&Arc<Task>> = model.programs.sensors.iter().chain(&model.programs.tasks).collect();
    let of_signal: BTreeSet<&str> = model.programs.sensors.iter().map(|task| task.outputs[0].name.as_str()).collect();
    let mut found: BTreeSet<String> = model.programs.exported.iter().map(|(name, _)| name.clone()).collect();
    // Found names go into a queue; their readers wait for them.
    let mut named_by: HashMap<&str, Vec<(usize, Symbol)>> = HashMap::new();
    let mut open: Vec<(usize, Symbol)> = Vec::new();
    for (number, task) in tasks.iter().enumerate() {
        for (symbol, read) in &task.reads {
            let awaited = match read {
                Read::Time => continue,
                Read::Position(_) | Read::Rate(_) => None,
                Read::Sensor(name) | Read::AsRead(name) if !of_signal.contains(name.as_str()) => None,
                Read::Sensor(name) | Read::AsRead(name) | Read::Source(name) => {
                    Some(name).filter(|name| !found.contains(*name))
                }
            };
            match awaited {
                Some(name) => named_by.entry(name).or_default().push((number, *symbol)),
                None => open.push((number, *symbol)),
            }
        }
    }
    let followers: Vec<Followers> = tasks.iter().map(|task| Followers::of(task)).collect();
    let mut visited = BTreeSet::new();
    while let Some((number, symbol)) = open.pop() {
        if !visited.insert((number, symbol)) {
            continue;
        }
        let Followers { memory, outputs } = &followers[number];
        open.extend(memory.get(&symbol).into_iter().flatten().map(|entry| (number, *entry)));
        for place in outputs.get(&symbol).into_iter().flatten() {
            let name = tasks[number].outputs[*place].name.as_str();
            if found.insert(name.into()) {
                open.extend(named_by.remove(name).into_iter().flatten());
            }
        }
    }
    found
}

/// For each symbol of a task the dependent ones: its states, and its outputs by their numbers.
struct Followers {
    memory: HashMap<Symbol, Vec<Symbol>>,
    outputs: HashMap<Symbol, Vec<usize>>,
}

impl Followers {
    fn of(task: &Task) -> Self {
        let (mut memory, mut outputs): (HashMap<_, Vec<_>>, HashMap<_, Vec<_>>) = Default::default();
        let exprs: Vec<Expr> = task.outputs().into_iter().map(|(_, expr)| expr).collect();
        let symbols = task.graph.symbols_of_each(&exprs);
        let (of_outputs, of_memory) = symbols.split_at(task.outputs.len());
        for (place, symbols) in of_outputs.iter().enumerate() {
            symbols.iter().for_each(|symbol| outputs.entry(*symbol).or_default().push(place));
        }
        for (entry, symbols) in task.states.iter().zip(of_memory) {
            symbols.iter().for_each(|symbol| memory.entry(*symbol).or_default().push(entry.symbol));
        }
        Self { memory, outputs }
    }
}

/// The signals of motion-dependent blocks that a law reads.
fn read_of_blocks<'a>(moving: &BTreeSet<String>, law: &'a dyn Law) -> Vec<&'a str> {
    let names = law.references().iter().map(|reference| reference.name.as_str());
    names.filter(|name| moving.contains(*name)).collect()
}

/// Text for a law that reads blocks which no map includes.
fn assumed_gain_text(read: &[&str]) -> String {
    let names = quoted(read);
    format!(
        "reads {names}, which depends on the motion, at samples: if all controllers are in continuous time, designs \
         and margins treat it as an independent input"
    )
}

/// Text for blocks at a limit or in a dead zone; `None` if there are none.
fn passes_nothing_on(names: &[&str]) -> Option<String> {
    let [verb, again] = if names.len() == 1 { ["has", "it has"] } else { ["have", "they have"] };
    (!names.is_empty()).then(|| {
        format!(
            "{} {verb} zero gain where the loop is linearised (at rest, where the run begins): at a limit, or in a \
             dead zone. Stability and margins are those of the loop opened there; where {again} gain again, the loop \
             differs, which a run shows",
            quoted(names)
        )
    })
}

/// Remarks of the design about the blocks that a law reads: warnings where its margins do not include them or what they engage, or where their gain is
/// zero, notes otherwise.
pub(in crate::study) fn block_remarks(variant: &PreparedVariant, number: usize) -> (Vec<String>, Vec<String>) {
    let law = &*variant.implemented[number];
    let read = read_of_blocks(&moving(&variant.model), law);
    if variant.model.programs.tasks.is_empty() {
        return (Vec::new(), Vec::new());
    }
    if !are_in_maps(variant) {
        let warning = format!("the law {}, so only a run shows whether the loop is stable", assumed_gain_text(&read));
        return (if read.is_empty() { Vec::new() } else { vec![warning] }, Vec::new());
    }
    let found = blocks(variant, &variant.loop_plant());
    let names = found.of_loop.names();
    let linearisation_note = if found.nonlinear { ", linearised at rest" } else { "" };
    let margins = match searches(&found.of_loop, law.clock()) {
        true => "map and margins include the blocks that the loop closes through",
        false => {
            "stability is that of the exact map with the blocks that the loop closes through; margins treat these \
             blocks as independent inputs, as they are many with other sample times"
        }
    };
    let note = format!(
        "the design treats its references as independent inputs; {margins}{linearisation_note}: {}",
        quoted(names)
    );
    let open = format!(
        "stability and margins are those with {} open, which blocks engage at the start of the run",
        quoted(&found.engaged)
    );
    // A signal that a law reads itself leaves it without a loop; a more distant one, such as a function that is off, is worth a note.
    let program = variant.model.controls[number].values.task("commands");
    let reads =
        |name: &&str| read.contains(name) || program.is_some_and(|task| task.names.iter().any(|own| own == name));
    let (own, flat_blocks): (Vec<&str>, Vec<&str>) = found.flat.iter().map(String::as_str).partition(reads);
    let mut warnings = if found.engaged.is_empty() { Vec::new() } else { vec![open] };
    warnings.extend(passes_nothing_on(&own));
    (warnings, [(!names.is_empty()).then_some(note), passes_nothing_on(&flat_blocks)].into_iter().flatten().collect())
}

/// Warns of effects of blocks that only a run includes: blocks at samples that continuous-time laws read, and torques that depend on them.
pub(in crate::study) fn check_blocks(document: &Document, variant: &PreparedVariant, out: &mut Vec<Diagnostic>) {
    let PreparedVariant { model, reduced, implemented: laws, scenario, .. } = variant;
    check_blending_signals(document, model, scenario, out);
    if laws.len() == model.controls.len() {
        check_exported(document, model, laws, out);
    }
    if model.programs.tasks.is_empty() || model.controls.is_empty() {
        return;
    }
    for element in engaged_locks(variant) {
        let message =
            format!("blocks engage `{element}` at the start of the run: stability of the loop is not checked there");
        let help = "designs and margins treat a lock as open; a run simulates it, and other variants show the loop \
                    without it";
        out.push(of_element(document, &element, message, help));
    }
    if are_in_maps(variant) {
        return;
    }
    let moving = moving(model);
    for (control, law) in model.controls.iter().zip(laws) {
        let read = read_of_blocks(&moving, &**law);
        if read.is_empty() {
            continue;
        }
        let message = format!("control `{}` {}", control.name, assumed_gain_text(&read));
        let help = "give the controller a `sample_time`, or remove that of the blocks: the loop then closes through \
                    them; a run includes them in any case";
        out.push(Diagnostic::warning("block::not-in-design", message).at(&control.place, "this controller").help(help));
    }
    for law in &reduced.equations.laws {
        let blocks: Vec<&str> = law.value.blocks().filter(|name| moving.contains(*name)).collect();
        if blocks.is_empty() {
            continue;
        }
        let message = format!(
            "`{}` depends on the block {}: if all controllers are in continuous time, designs and margins treat it \
             as zero",
            law.element,
            quoted(blocks)
        );
        let help = "give a controller a `sample_time`, or remove that of the blocks; a run includes them in any case";
        out.push(of_element(document, &law.element, message, help));
    }
}

/// Locks that blocks engage at the start of the run of a variant: no map includes the loop behind them.
pub(in crate::study) fn engaged_locks(variant: &PreparedVariant) -> Vec<String> {
    if too_large(variant).is_some() {
        return Vec::new();
    }
    blocks(variant, &variant.loop_plant()).engaged
}

/// A warning about an element that depends on blocks.
fn of_element(document: &Document, element: &str, message: String, help: &str) -> Diagnostic {
    let place = document.elements.get(element).map(|own| own.place.clone());
    Diagnostic::warning("block::not-in-design", message).at_each(place, "this element").help(help)
}

/// Rejects controllers whose commands are multiplied by a signal that nothing sets: they would be off.
fn check_blending_signals(document: &Document, model: &Model, scenario: &Scenario, out: &mut Vec<Diagnostic>) {
    for control in &model.controls {
        let Some(signal) = blending_signal(&control.values) else { continue };
        let Some(number) = scenario.sources.iter().position(|source| source.name == signal.name) else { continue };
        let is_set = scenario.sources[number].target == SourceTarget::Block
            || scenario.events.iter().any(|event| event.source == number)
            || scenario.signals.iter().any(|signal| signal.source == number);
        if is_set {
            continue;
        }
        let place = place_in_control(document, control, "blending_signal");
        let message = format!(
            "`blending_signal` of control `{}`: nothing sets `{}`, so that its commands would be 0 all the time",
            control.name, signal.name
        );
        let help = "name a block or a signal, or set it by an event: `signal = \"power\"`, `to = 1`";
        out.push(Diagnostic::error("control::blending-signal", message).at(place, "not set").help(help));
    }
}

/// Rejects signals of a law that blocks read but the law does not output.
fn check_exported(document: &Document, model: &Model, laws: &[Arc<dyn Law>], out: &mut Vec<Diagnostic>) {
    for (name, _) in &model.programs.exported {
        let head = SignalName::new(name).element;
        let own = model.controls.iter().zip(laws).find(|(control, _)| control.name == head);
        let Some((control, law)) = own else {
            let message = format!("`{name}` is 0 all the time where control `{head}` is not in the loop");
            let place = document.controls.get(head).map(|one| one.place.clone());
            let help = "blocks that read it get no torque and no motion there; pass the variant to them by a parameter";
            let warning = Diagnostic::warning("block::unavailable-signal", message);
            out.push(warning.at_each(place, "not in this loop").help(help));
            continue;
        };
        let found: Vec<String> = law.exported().into_iter().map(|(found, _)| format!("{head}.{found}")).collect();
        if found.contains(name) {
            continue;
        }
        let message = format!("control `{head}` does not output `{name}`, which blocks read");
        let help =
            format!("it outputs {}; `disturbances` of its observer lists where unknown torques act", quoted(found));
        let diagnostic = Diagnostic::error("block::unavailable-signal", message);
        let place = document.controls.get(head).map_or(&control.place, |one| &one.place);
        out.push(diagnostic.at(place, "this controller").help(help));
    }
}

/// The blocks of a model, its sensors of signals, its signals that are formulas, and its laws that are programs: in execution order, with their readers.
///
/// ```
/// let project = kardan::project::Project::open(
///     "[shaft.arm]\ninertia = \"1 kg m^2\"\n[block.late]\nkind = \"delay\"\ninput = \"arm.phi\"\nsample_time = \"1 ms\"\n",
/// );
/// let graph = kardan::study::signal_graph(&project.prepared().variants[0].model);
/// assert_eq!((graph[0].name.as_str(), graph[0].sample_time, graph[0].outputs[0].unit.as_str()), ("late", Some(0.001), "rad"));
/// assert_eq!((&graph[0].reads[..], graph[0].direct_feedthrough.len()), (&["arm.phi".to_string()][..], 0));
/// ```
pub fn signal_graph(model: &Model) -> Vec<SignalNode> {
    let output = |output: &TaskOutput| SignalOutput { name: output.name.clone(), unit: output.dimension.si() };
    let sample_time = |task: &Task| task.period.as_ref().map(Exact::to_f64);
    let sensors = model.programs.sensors.iter().enumerate().map(|(k, task)| {
        let signals: Vec<String> =
            task.reads.iter().map(|(symbol, _)| task.graph.name(*symbol).0.to_string()).collect();
        SignalNode {
            name: task.outputs[0].name.clone(),
            kind: "sensor".into(),
            sample_time: sample_time(task),
            order: k + 1,
            outputs: task.outputs.iter().map(output).collect(),
            reads: signals.clone(),
            direct_feedthrough: signals.into_iter().filter(|name| is_output(model, name)).collect(),
        }
    });
    let mut out: Vec<SignalNode> = sensors.collect();
    for task in &model.programs.tasks {
        for (k, step) in task.order.iter().enumerate() {
            let own = |name: &str| SignalName::new(name).element == step.block || name == step.block;
            let inputs: BTreeSet<&String> = step.at_once.iter().filter(|name| !own(name)).collect();
            out.push(SignalNode {
                name: step.block.clone(),
                kind: step.kind.into(),
                sample_time: sample_time(task),
                order: k + 1,
                outputs: task.outputs.iter().filter(|output| own(&output.name)).map(output).collect(),
                reads: step.reads.clone(),
                direct_feedthrough: inputs.into_iter().cloned().collect(),
            });
        }
    }
    for (k, (control, task)) in
        model.controls.iter().filter_map(|control| Some((control, control.values.task("commands")?))).enumerate()
    {
        out.push(SignalNode {
            name: control.name.clone(),
            kind: "program".into(),
            sample_time: sample_time(task),
            order: k + 1,
            outputs: task.outputs.iter().map(output).collect(),
            reads: task.names.clone(),
            direct_feedthrough: task.names.iter().filter(|name| is_output(model, name)).cloned().collect(),
        });
    }
    out
}

fn is_output(model: &Model, name: &str) -> bool {
    model.programs.outputs().any(|output| output.name == name)
}

/// The blocks of a model and their inputs, one line each, in execution order.
///
/// ```
/// let project = kardan::project::Project::open(
///     "[shaft.arm]\ninertia = \"1 kg m^2\"\n[block.late]\nkind = \"delay\"\ninput = \"arm.phi\"\nsample_time = \"1 ms\"\n",
/// );
/// let lines = kardan::study::listed_blocks(&project.prepared().variants[0].model);
/// assert_eq!(lines, ["blocks at 0.001 s, in the order in which they compute:", "  late (delay): reads arm.phi"]);
/// ```
pub fn listed_blocks(model: &Model) -> Vec<String> {
    let mut out = Vec::new();
    let listed = |names: &[String]| if names.is_empty() { "nothing".to_string() } else { names.join(", ") };
    for task in &model.programs.tasks {
        out.push(format!("{}, in the order in which they compute:", task.name));
        for step in &task.order {
            let own = |name: &&String| SignalName::new(name).element != step.block;
            let at_once: BTreeSet<String> = step.at_once.iter().filter(own).cloned().collect();
            let at_once: Vec<String> = at_once.into_iter().collect();
            let at_once = if at_once.is_empty() {
                String::new()
            } else {
                format!("; direct feedthrough from {}", listed(&at_once))
            };
            out.push(format!(
                "  {} ({}): reads {}{at_once}",
                step.block,
                step.kind.replace('_', " "),
                listed(&step.reads)
            ));
        }
    }
    let when = |task: &Task| match &task.period {
        Some(period) => format!("every {}", shown_quantity(period, Dimension::TIME)),
        None => "at every instant".into(),
    };
    for task in &model.programs.sensors {
        let signals = task.reads.iter().map(|(symbol, _)| task.graph.name(*symbol).0);
        out.push(format!("{} reads {} {}", task.name, signals.collect::<Vec<_>>().join(", "), when(task)));
    }
    for control in &model.controls {
        let Some(task) = control.values.task("commands") else { continue };
        let when = when(task);
        let commands: Vec<&str> = task.outputs.iter().map(|output| output.name.as_str()).collect();
        let reads: Vec<String> = task.reads.iter().map(|(symbol, _)| task.graph.name(*symbol).0.to_string()).collect();
        let blocks: Vec<&str> = task.order.iter().map(|step| step.block.as_str()).collect();
        let with = if blocks.is_empty() { String::new() } else { format!(" by {}", blocks.join(", ")) };
        out.push(format!(
            "control {} commands {} {when}, from {}{with}",
            control.name,
            commands.join(", "),
            listed(&reads)
        ));
    }
    out
}
