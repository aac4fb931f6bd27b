//! Preparation of a run: all errors of a model file at once, and the runs ready to start.

use crate::assemble::assemble;
use crate::diagnostics::{Diagnostic, Severity, quoted};
use crate::entries::Place;
use crate::equations::{Direction, Measured, NamedTerm, Term};
use crate::model::{ControlSpec, Document, Model, Setting, TableReader, VariantSettings};
use crate::names::SignalName;
use crate::num::{Definiteness, Scalar, definiteness_of_rows};
use crate::reduce::{OperatingPoint, Reduced, equilibrium_rows, reduce, sparse_model};
use crate::schema::{LawKeys, Value};
use crate::simulate::{Scenario, SignalEvent, signal_names};
use crate::study::analyze::analysis_spec::{Point, analysis_spec};
use crate::study::analyze::locations::places_in_control;
use crate::study::check::debounce::late_monitors;
use crate::study::check::effort::check_effort;
use crate::study::check::massless_motions::{check_readings, check_start, is_designable, without_massless};
use crate::study::check::model_checks::{
    check_connected, check_matrices, design_diagnostic, is_braced, is_finite_at, is_representable, reduce_diagnostics,
    signals_of,
};
use crate::study::check::multiplier_constraints::{
    begin_on_rows, check_free, check_multipliers, moves_by_itself, not_on_rows, on_frozen_rows, on_rows,
    prescribed_note, rows_refused, with_loop,
};
use crate::study::check::redundant_torques::check_redundant;
use crate::study::check::stop_checks::check_stops;
use crate::study::design::design_in_motion::with_motion;
use crate::study::design::loop_along_path::check_loop_along_path;
use crate::study::design::margins::{LoopKinks, UNSTABLE, check_margins, check_sampled};
use crate::study::measure::computed_signals::Computed;
use crate::study::measure::requirements::{figures_and_requirements, plots, tolerance};
use crate::study::prepare::blocks::{check_blocks, engaged_locks};
use crate::study::prepare::circuit::check_circuit;
use crate::study::prepare::equilibrium::{Rest, format_position};
use crate::study::prepare::faults::NamedFault;
use crate::study::prepare::initial_state::start_values;
use crate::study::prepare::loop_blocks::signals_at_begin;
use crate::study::prepare::operating_point::{NamedPoint, check_smooth, no_equilibrium};
use crate::study::prepare::reduced_design_model::{excluded, model_excluding, needed_by};
use crate::study::prepare::scenario::scenario;
use crate::study::prepare::signal_table::SignalContext;
use crate::study::run::progress::{Progress, Silent};
use crate::study::safety::{check_rows, safety_spec};
use crate::study::sweep::sweep_spec;
use crate::study::{Prepared, PreparedVariant};
use crate::synthesis::{Law, Plant, Program, design_law, implemented, submodel_law};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

/// The purpose of the preparation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::study) enum Purpose {
    /// For a run: all motion must follow from differential equations.
    Run,
    /// For an analysis: motions without inertia may be eliminated.
    Analysis,
    /// For writing equations: as for a run, where its controllers have their operating points and no designs.
    Equations,
    /// For one run among many: errors of the file are not searched again.
    Sample,
}

pub(in crate::study) fn is_error(diagnostic: &Diagnostic) -> bool {
    diagnostic.severity == Severity::Error
}

/// The runs of a document, ready to start; errors are added to the diagnostics.
pub(in crate::study) fn prepare_document(
    purpose: Purpose,
    document: &Document,
    progress: &dyn Progress,
    out: &mut Vec<Diagnostic>,
) -> Prepared {
    let mut prepared = Prepared { named: !document.named_variants.is_empty(), ..Prepared::default() };
    let unread = out.iter().any(is_error);
    let all_settings = document.variant_settings();
    let mut first = None;
    let steps = Steps::new(all_settings.iter().map(|variant| steps_of(document, variant)).sum(), progress);
    // The preparation of one variant does not depend on the others; its diagnostics do.
    let one = |variant: &VariantSettings| {
        let VariantSettings { name: label, settings, controls, faults } = variant;
        let (model, mut reported) = document.model_with(settings, controls.as_deref());
        let is_complete = !document.suppressed.equations && !model.programs.broken && !reported.iter().any(is_error);
        let ready = is_complete.then(|| {
            let name = if label.is_empty() { file_stem(&model.name) } else { label.clone() };
            prepare_variant((purpose, &steps, None), document, name, model.clone(), (settings, faults), &mut reported)
        });
        document.check_tolerances(settings, &mut reported);
        (model, ready.flatten(), reported)
    };
    let all: Vec<_> = all_settings.par_iter().map(one).collect();
    progress.preparing(1.0);
    for (k, (model, variant, diagnostics)) in all.into_iter().enumerate() {
        prepared.variants.extend(variant.map(Arc::new));
        add_new(out, diagnostics, (k > 0).then_some(&all_settings[k].name));
        prepared.name.clone_from(&model.name);
        prepared.description.clone_from(&model.description);
        if k == 0 {
            first = Some(model);
        }
    }
    let mut diagnostics = Vec::new();
    let all_settings_of_first = all_settings.first().map(|first| first.settings.clone()).unwrap_or_default();
    let context = match (prepared.variants.first(), first) {
        (Some(variant), _) => {
            let signals = signal_names(&variant.reduced, &variant.scenario);
            SignalContext { document, signals, doubtful: BTreeSet::new() }
        }
        (None, Some(mut model)) => {
            let reduced = unreduced(&mut model);
            let settings = &all_settings[0].settings;
            let (scenario, _) = scenario(document, &model, (&reduced.equations, None), settings, &mut diagnostics);
            let signals = signal_names(&reduced, &scenario);
            let context = SignalContext { document, signals, doubtful: model.doubtful };
            analysis_spec(&context, &reduced.equations, None, settings, &mut diagnostics);
            context
        }
        (None, None) => SignalContext { document, signals: Vec::new(), doubtful: BTreeSet::new() },
    };
    (prepared.figures, prepared.requirements) = figures_and_requirements(&context, &all_settings, &mut diagnostics);
    let names: Vec<String> = all_settings.into_iter().map(|variant| variant.name).collect();
    prepared.plots = plots(&context, &names, &mut diagnostics);
    let faults = prepared.variants.first().map(|variant| variant.faults.clone()).unwrap_or_default();
    let ends: Vec<(String, f64)> =
        prepared.all().map(|variant| (variant.name.clone(), variant.scenario.duration)).collect();
    late_monitors(document, &ends, &mut diagnostics);
    prepared.safety = safety_spec(&context, &names, (&faults, &ends), &mut diagnostics);
    check_rows(document, &prepared, &mut diagnostics);
    prepared.sweep = Some(sweep_spec(&context, &names, &mut diagnostics));
    prepared.tolerance = tolerance(document, &mut diagnostics);
    if !document.suppressed.equations {
        crate::study::bench::check(document, &all_settings_of_first, &mut diagnostics);
    }
    add_new(out, diagnostics, None);
    // Unreadable parts may be what connects them.
    if unread {
        out.retain(|diagnostic| diagnostic.code != "model::disconnected");
    }
    out.sort_by_key(|d| {
        (d.labels.first().map_or(usize::MAX, |label| label.place.start()), d.severity == Severity::Warning)
    });
    prepared
}

/// The same error of several variants is reported once; an error that the first variant does not have names its variant.
fn add_new(out: &mut Vec<Diagnostic>, found: Vec<Diagnostic>, later_variant: Option<&String>) {
    // A set instead of a linear search for each: the time of thousands of errors grows linearly.
    let key = |d: &Diagnostic| {
        let places: Vec<_> = d.labels.iter().map(|label| (label.place.clone(), label.text.clone())).collect();
        (d.code, places, later_variant.is_none().then(|| d.message.clone()))
    };
    let mut reported: HashSet<_> = out.iter().map(key).collect();
    for mut diagnostic in found {
        if !reported.insert(key(&diagnostic)) {
            continue;
        }
        if let Some(variant) = later_variant {
            diagnostic.message += &format!(" (variant `{variant}`)");
        }
        out.push(diagnostic);
    }
}

/// The part of a model that can be numbered, as if there were no constraints: enough to determine its signals. Elements that name
/// missing parts are left out and marked as doubtful.
fn unreduced(model: &mut Model) -> Reduced {
    let shafts = model.all_coordinates.clone();
    // Only the element that introduces a charge knows it.
    let charges: Vec<(String, String)> = model.terms.iter().filter_map(charge_of).collect();
    let has_coordinate = |name: &String| shafts.contains(name) && charges.iter().all(|(charge, _)| charge != name);
    let of_element = |named: &NamedTerm, direction: &Direction| {
        let own = |name: &String| charges.iter().any(|(charge, element)| charge == name && *element == named.element);
        direction.entries.iter().all(|(name, _)| has_coordinate(name) || own(name))
    };
    let (constraints, free_terms): (Vec<_>, Vec<_>) =
        std::mem::take(&mut model.terms).into_iter().partition(|named| !matches!(named.term, Term::Output(_)));
    let (mut good, mut bad): (Vec<_>, Vec<_>) = constraints.into_iter().partition(|named| match &named.term {
        Term::Inertia { direction, .. }
        | Term::Spring { direction, .. }
        | Term::Damper { direction, .. }
        | Term::Friction { direction, .. }
        | Term::Constraint { direction, .. }
        | Term::Compliance { direction, .. }
        | Term::Balance { direction, .. }
        | Term::Input { direction, .. } => of_element(named, direction),
        Term::UnilateralConstraint { direction, unilateral } => {
            let named_by_it = unilateral.formula().into_iter().flat_map(|formula| formula.coordinates());
            of_element(named, direction) && named_by_it.map(String::from).all(|name| has_coordinate(&name))
        }
        Term::Torque { direction, law } => {
            of_element(named, direction) && law.coordinates().all(|name| has_coordinate(&name.into()))
        }
        Term::Transmission { driven, driving, .. } => has_coordinate(driven) && has_coordinate(driving),
        Term::MultiplierLaw(row) => row.coordinates().into_iter().all(|name| has_coordinate(&name.into())),
        Term::Output(_) | Term::Charge { .. } | Term::Angle { .. } => true,
        Term::Position { .. } | Term::State { .. } | Term::Measure(_) | Term::Moving(_) => true,
    });
    let constrains = |element: &String| {
        let is_row =
            |term: &Term| matches!(term, Term::Constraint { .. } | Term::Compliance { .. } | Term::Transmission { .. });
        good.iter().any(|named| named.element == *element && is_row(&named.term))
    };
    let (sensors, lost): (Vec<_>, Vec<_>) = free_terms.into_iter().partition(|named| match &named.term {
        Term::Output(sensor) => match &sensor.measured {
            Measured::Angle(shaft) | Measured::Speed(shaft) | Measured::NetTorque(shaft) => has_coordinate(shaft),
            Measured::ConstraintTorque(element, shaft) | Measured::ComplianceTorque(element, shaft) => {
                has_coordinate(shaft) && constrains(element)
            }
            Measured::SpringTorque(_) | Measured::Signal(_) => true,
        },
        _ => true,
    });
    good.extend(sensors);
    bad.extend(lost);
    model.doubtful.extend(bad.into_iter().map(|named| named.element));
    let equations = assemble(&model.all_coordinates, &good);
    model.terms = good;
    let coordinates = (0..equations.coordinates.len()).collect();
    Reduced { coordinates, equations, redundant: Vec::new(), steps: Vec::new(), relaxation: None }
}

/// A charge and the element that introduces it.
fn charge_of(named: &NamedTerm) -> Option<(String, String)> {
    match &named.term {
        Term::Charge { name } => Some((name.clone(), named.element.clone())),
        _ => None,
    }
}

pub(in crate::study) fn file_stem(name: &str) -> String {
    let stem: String =
        name.chars().map(|c| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' }).collect();
    if stem.chars().all(|c| c == '.' || c == '-') { "run".into() } else { stem }
}

/// Steps of the preparation of a variant: its equations, each law in its loop, the sampled loop, its margins.
fn steps_of(document: &Document, variant: &VariantSettings) -> usize {
    variant.controls.as_ref().map_or(document.controls.len(), Vec::len) + 3
}

/// Counts the finished steps of all variants, on any thread.
struct Steps<'p> {
    done: AtomicUsize,
    all: usize,
    progress: &'p dyn Progress,
}

impl<'p> Steps<'p> {
    fn new(all: usize, progress: &'p dyn Progress) -> Self {
        progress.preparing(0.0);
        Self { done: AtomicUsize::new(0), all, progress }
    }

    fn step(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.progress.preparing((done as f64 / self.all as f64).min(1.0));
    }
}

/// A variant with other values, ready to run: its designs stay, if they are given, and programs use the new values.
///
/// # Errors
/// The errors of these values.
pub(in crate::study) fn prepare_sample(
    document: &Document,
    (name, designed): (&str, Option<&PreparedVariant>),
    (settings, controls, faults): (&[Setting], Option<&[String]>, &[String]),
) -> Result<PreparedVariant, Vec<Diagnostic>> {
    let (model, mut diagnostics) = document.model_with(settings, controls);
    if diagnostics.iter().any(is_error) || model.programs.broken {
        return Err(diagnostics);
    }
    let steps = Steps::new(1, &Silent);
    let purpose = (Purpose::Sample, &steps, designed);
    let found = prepare_variant(purpose, document, name.to_string(), model, (settings, faults), &mut diagnostics);
    match found {
        Some(variant) if !diagnostics.iter().any(is_error) => Ok(variant),
        _ => Err(diagnostics),
    }
}

/// Whether the designs of a variant fit another one: the same coordinates, inputs and sensors.
fn is_compatible(one: &Reduced, other: &Reduced) -> bool {
    let inputs = |of: &Reduced| of.equations.inputs.iter().map(|input| input.element.clone()).collect::<Vec<_>>();
    let sensors = |of: &Reduced| of.equations.sensors.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    one.coordinates == other.coordinates
        && one.equations.coordinates == other.equations.coordinates
        && inputs(one) == inputs(other)
        && sensors(one) == sensors(other)
}

fn prepare_variant(
    (purpose, steps, nominal): (Purpose, &Steps<'_>, Option<&PreparedVariant>),
    document: &Document,
    name: String,
    model: Model,
    (settings, own_faults): (&[Setting], &[String]),
    out: &mut Vec<Diagnostic>,
) -> Option<PreparedVariant> {
    check_connected(document, &model, out);
    let (reduced, massless) = reduced_model(purpose, document, &model, out)?;
    check_redundant(document, &reduced, out);
    // Laws are designed for the accelerations that torques cause.
    let controls = if massless.is_empty() { &model.controls[..] } else { &[] };
    let (mut scenario, faults) = scenario(document, &model, (&reduced.equations, Some(&reduced)), settings, out);
    add_faults(document, (&mut scenario, &faults), (&name, own_faults), out);
    let prescribed = start_values(document, settings, &reduced);
    let start = on_rows(&reduced, &prescribed, &scenario);
    let named_point = NamedPoint::of(document, (&reduced, &start), controls, settings, out);
    let as_it_is = reduced.unrelaxed();
    let (point, multipliers) = loop_rest_point(document, &reduced, controls, named_point.as_ref(), out);
    let designing = if purpose == Purpose::Equations { &[] } else { controls };
    let nominal = nominal.filter(|nominal| is_compatible(&nominal.reduced, &reduced));
    let plants: Vec<Option<Plant>> = match nominal {
        Some(nominal) => nominal.design_models.iter().cloned().map(Some).collect(),
        None => {
            let plant = |control| design_model(document, &as_it_is, (settings, named_point.as_ref()?), control, out);
            designing.iter().map(plant).collect()
        }
    };
    let trim_point = (!controls.is_empty()).then_some(&point);
    let mut start_notes = start_at_rest(document, (&reduced, trim_point), &mut scenario, out);
    start_notes.extend(begin_on_rows(document, &reduced, &prescribed, &mut scenario, out));
    if !is_finite_at(&reduced, &scenario.position) {
        out.push(
            Diagnostic::error("number::range", "at the initial position an angle is too large for a number")
                .at(TableReader::place(&document.scenario, "initial"), "from these angles")
                .help("check the exponents of the initial angles and of the ratios"),
        );
        return None;
    }
    let context = SignalContext { document, signals: signal_names(&reduced, &scenario), doubtful: BTreeSet::new() };
    check_start(document, &reduced, (&scenario.position, &scenario.speed), out);
    check_stops(document, &reduced, &scenario.position, out);
    let start = Point { reduced: &reduced, initial: &scenario.position };
    let analysis = analysis_spec(&context, &reduced.equations, Some(start), settings, out);
    steps.step();
    let Laws { design_models, designed, implemented } =
        laws_of((document, steps), (&reduced, &model, &scenario), (designing, plants, nominal), out);
    start_notes.extend(references_at_rest(document, &implemented, &mut scenario));
    let complete = designed.len() == designing.len();
    let variant = PreparedVariant {
        name,
        model,
        reduced,
        design_models,
        designed,
        implemented,
        scenario,
        faults,
        has_faults: !own_faults.is_empty(),
        computed: Computed::of(document, settings, &context.signals),
        analysis,
        point,
        massless,
        unfrozen: None,
        looped: None,
        start_notes,
        swept: None,
        settled: OnceLock::new(),
    };
    if purpose == Purpose::Sample {
        return complete.then_some(variant);
    }
    let variant = with_motion(with_loop(variant, &multipliers), named_point.and_then(|point| point.motion), out);
    check_blocks(document, &variant, out);
    if complete && purpose == Purpose::Run {
        check_loop(document, &variant, steps, out);
    }
    complete.then_some(variant)
}

/// The laws of a variant, as far as they can be designed.
#[derive(Default)]
struct Laws {
    design_models: Vec<Plant>,
    designed: Vec<Arc<dyn Law>>,
    implemented: Vec<Arc<dyn Law>>,
}

/// Designs the laws of a variant; those of an equal variant are reused, except programs.
fn laws_of(
    (document, steps): (&Document, &Steps<'_>),
    (reduced, model, scenario): (&Reduced, &Model, &Scenario),
    (controls, plants, nominal): (&[ControlSpec], Vec<Option<Plant>>, Option<&PreparedVariant>),
    out: &mut Vec<Diagnostic>,
) -> Laws {
    let mut found = Laws::default();
    for (number, (control, plant)) in controls.iter().zip(plants).enumerate() {
        let Some(mut plant) = plant else { continue };
        let law = match nominal.filter(|_| control.law.keyword != Program::KEYWORD) {
            Some(nominal) => Some((Arc::clone(&nominal.designed[number]), Arc::clone(&nominal.implemented[number]))),
            None => {
                plant.signals = signals_at_begin(scenario);
                plant.elements = model.elements.iter().map(|one| (one.kind.clone(), one.name.clone())).collect();
                designed_law(document, reduced, control, &plant, out)
            }
        };
        let Some((law, as_it_runs)) = law else { continue };
        steps.step();
        found.design_models.push(plant);
        found.designed.push(law);
        found.implemented.push(as_it_runs);
    }
    found
}

/// Adds the faults that a variant names.
fn add_faults(
    document: &Document,
    (scenario, named): (&mut Scenario, &[NamedFault]),
    (variant, own): (&str, &[String]),
    out: &mut Vec<Diagnostic>,
) {
    for fault in own.iter().filter_map(|name| named.iter().find(|fault| fault.name == *name)) {
        match scenario.faults.with(&fault.faults) {
            Ok(all) => scenario.faults = all,
            Err(part) => {
                let message =
                    format!("variant `{variant}`: its fault `{}` overlaps another fault of `{part}`", fault.name);
                let place = document.faults.iter().find(|(name, _)| name.value == fault.name);
                let place = place.map_or_else(|| document.scenario.place.clone(), |(name, _)| name.place.clone());
                out.push(
                    Diagnostic::error("fault::overlap", message)
                        .at(place, "at the same time")
                        .help("a part has one fault at a time: let one end before the other begins"),
                );
            }
        }
    }
}

/// If the loop has a kink at its operating point and is stable on one side: the diagnostics of the opposite one.
fn check_opposite_side(variant: &PreparedVariant, before: usize, out: &mut Vec<Diagnostic>) {
    let is_unstable = |diagnostic: &Diagnostic| diagnostic.code == UNSTABLE;
    if out[before..].iter().any(is_unstable) {
        return;
    }
    let kinks = LoopKinks::of(variant);
    let Some(side) = kinks.opposite() else { return };
    let mut found = Vec::new();
    check_sampled(&variant.on_side(&side), &mut found);
    out.extend(found.into_iter().filter(is_unstable).map(|diagnostic| {
        let message = format!("on the side where {} {}", kinks.description(&side), diagnostic.message);
        Diagnostic { message, ..diagnostic }
    }));
}

/// The errors of the loop of a variant that could run.
fn check_loop(document: &Document, variant: &PreparedVariant, steps: &Steps<'_>, out: &mut Vec<Diagnostic>) {
    // No map includes the loop behind a lock, which has been reported.
    if !variant.model.controls.is_empty() && !engaged_locks(variant).is_empty() {
        steps.step();
        steps.step();
        check_effort(document, variant, out);
        return;
    }
    let before = out.len();
    check_sampled(variant.in_loop(), out);
    check_opposite_side(variant.in_loop(), before, out);
    let reported = out[before..].iter().any(|reported| reported.code == UNSTABLE);
    steps.step();
    if !out.iter().any(is_error) {
        check_margins(variant.in_loop(), out);
        check_effort(document, variant, out);
    }
    steps.step();
    // An unstable loop at the operating point has been reported.
    if !reported {
        check_loop_along_path(variant.in_loop(), out);
    }
}

/// The operating point of the loop of a variant, with its own parameters, and the multipliers of its multiplier constraints there.
fn loop_rest_point(
    document: &Document,
    reduced: &Reduced,
    controls: &[ControlSpec],
    named_point: Option<&NamedPoint>,
    out: &mut Vec<Diagnostic>,
) -> (OperatingPoint, Vec<f64>) {
    let zero = (OperatingPoint::zero(reduced), vec![0.0; reduced.equations.multiplier_constraints.len()]);
    let (Some(named_point), false) = (named_point, controls.is_empty()) else { return zero };
    match named_point.find(reduced) {
        Ok(found) => (found.point, found.multipliers),
        Err(why) => {
            out.push(named_point.refusal(document, controls, &why));
            zero
        }
    }
}

/// Equilibrium currents flow from the first instant on if no inductance of their own limits them; other speeds are those of `initial`.
fn begin_currents(reduced: &Reduced, scenario: &mut Scenario, rates: &[f64]) {
    let follows = |k: usize| reduced.relaxation.iter().any(|relaxation| relaxation.states().any(|state| state == k));
    let flowing = scenario.speed.iter_mut().zip(rates).enumerate();
    let flowing = flowing.filter(|(k, (_, rate))| **rate != 0.0 && !follows(*k));
    flowing.for_each(|(_, (speed, rate))| *speed = *rate);
}

/// Starts a run at an equilibrium on request; notes which one.
fn start_at_rest(
    document: &Document,
    (reduced, point): (&Reduced, Option<&OperatingPoint>),
    scenario: &mut Scenario,
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let start_value = document.scenario.values.get("start");
    if start_value.is_some_and(|found| found.value == Value::Word("operating_point".into())) {
        let Some(point) = point else {
            return vec!["without controllers there is no operating point: the run begins at `initial`".into()];
        };
        let has_angles = scenario.position.iter().any(|angle| *angle != 0.0);
        let instead = if has_angles { ", in place of the angles of `initial`" } else { "" };
        scenario.position.clone_from(&point.position);
        begin_currents(reduced, scenario, &point.rates);
        return vec![format!(
            "the run begins at the operating point of its controllers{instead}: {}",
            format_position(reduced, &point.position)
        )];
    }
    if !start_value.is_some_and(|found| found.value == Value::Word("equilibrium".into())) {
        return Vec::new();
    }
    let slips = reduced.relaxation.iter().any(|relaxation| !relaxation.slips.is_empty());
    let rest = match slips {
        true => {
            Err("friction balances motions without inertia, and kardan searches no equilibrium without friction".into())
        }
        false => Rest::near(reduced, &scenario.position),
    };
    match rest {
        Ok(Rest { position, rates, found, more, .. }) => {
            scenario.position = position;
            begin_currents(reduced, scenario, &rates);
            let more = more.into_iter().map(|more| more.replace("CHOICE", "`initial` of `[scenario]`"));
            std::iter::once(format!("the run begins at {found}")).chain(more).chain(prescribed_note(reduced)).collect()
        }
        Err(message) => {
            out.push(
                Diagnostic::error("scenario::equilibrium", format!("`start` of `[scenario]`: {message}"))
                    .at(TableReader::place(&document.scenario, "start"), "no equilibrium")
                    .help("give the initial angles by `initial`, or add an element that supports the model"),
            );
            Vec::new()
        }
    }
}

/// In a run that begins at the operating point, references begin at their equilibrium values, unless the scenario sets them then; notes which ones.
fn references_at_rest(document: &Document, implemented: &[Arc<dyn Law>], scenario: &mut Scenario) -> Option<String> {
    document.scenario.values.get("start").filter(|found| found.value == Value::Word("operating_point".into()))?;
    let mut begin = Vec::new();
    for law in implemented {
        for (reference, rest) in law.references().iter().zip(law.references_at_rest()) {
            let Some(source) = scenario.sources.iter().position(|source| source.name == reference.name) else {
                continue;
            };
            let is_set = scenario.events.iter().any(|event| event.source == source && event.at <= 0.0)
                || scenario.signals.iter().any(|signal| signal.source == source);
            if rest != 0.0 && !is_set {
                scenario.events.insert(0, SignalEvent { source, at: 0.0, to: rest, over: 0.0 });
                begin.push(format!("`{}` at {rest:.6} {}", reference.name, reference.physical.unit()));
            }
        }
    }
    (!begin.is_empty()).then(|| format!("references begin at their equilibrium values: {}", begin.join(", ")))
}

/// The equations in explicit form, with errors for motions without inertia; none if these, or other errors, prevent it.
fn reduced_model(
    purpose: Purpose,
    document: &Document,
    model: &Model,
    out: &mut Vec<Diagnostic>,
) -> Option<(Reduced, Vec<Diagnostic>)> {
    let mut massless = Vec::new();
    if !check_circuit(document, model, out, &mut massless) {
        out.append(&mut massless);
        return None;
    }
    let reduced = match reduce(assemble(&model.all_coordinates, &model.terms), model.coordinates.as_deref()) {
        Ok(mut reduced) => {
            reduced.equations.braced = is_braced(&reduced);
            reduced
        }
        Err(_) if purpose != Purpose::Analysis && !massless.is_empty() => {
            out.append(&mut massless);
            return None;
        }
        Err(error) => {
            out.extend(reduce_diagnostics(document, model, &error));
            return None;
        }
    };
    let follows = check_multipliers(document, &reduced, out) & check_free(document, &reduced, out);
    if !check_matrices(document, &reduced, out, &mut massless) || !follows {
        return None;
    }
    if purpose != Purpose::Analysis && !massless.is_empty() {
        return without_massless(document, model, &reduced, &massless, out).map(|reduced| (reduced, Vec::new()));
    }
    Some((reduced, massless))
}

/// The law of a controller as designed, and as it runs.
fn designed_law(
    document: &Document,
    reduced: &Reduced,
    control: &ControlSpec,
    plant: &Plant,
    out: &mut Vec<Diagnostic>,
) -> Option<(Arc<dyn Law>, Arc<dyn Law>)> {
    let before = out.len();
    for signal in signals_of(control.law.fields, &control.values) {
        let shaft = SignalName::new(&signal).angle_of().and_then(|name| plant.reduced.coordinate(name));
        if shaft.is_some_and(|shaft| plant.linear.direction(shaft).row(0).iter().all(Scalar::is_zero)) {
            let message =
                format!("control `{}`: the output `{signal}` cannot move: the constraints fix it", control.name);
            out.push(
                Diagnostic::error("control::design", message)
                    .at(places_in_control(document, control, &signal)[0].clone(), "fixed by constraints")
                    .help("choose an output that can move, or remove the constraint"),
            );
        }
    }
    if out.len() > before {
        return None;
    }
    let law = design_law(control.law, &control.name, &control.values, plant);
    let excluded = control.values.names("excluded_elements").filter(|names| !names.is_empty());
    let whole = |law: Arc<dyn Law>| match excluded {
        Some(names) => submodel_law(law, &plant.reduced, reduced, &quoted(names.iter().map(String::as_str))),
        None => law,
    };
    if law.as_ref().is_ok_and(|law| law.on_full_model()) && NamedPoint::is_named(document, control) {
        let message = format!("control `{}`: a law on the full nonlinear model has no operating point", control.name);
        out.push(
            Diagnostic::error("control::operating-point", message)
                .at(control.place.clone(), "this controller")
                .help("leave out `at`: it evaluates the model at its current position"),
        );
        return None;
    }
    if law.as_ref().is_ok_and(|law| law.on_full_model()) && !reduced.equations.multiplier_constraints.is_empty() {
        out.push(not_on_rows(control, reduced));
        return None;
    }
    match law.and_then(|law| Ok((Arc::clone(&law), implemented(law, &control.values)?))) {
        Ok((law, implemented)) if implemented.linear().fits_single() => {
            if !check_readings(document, (control, plant), &*implemented, out) {
                return None;
            }
            let why = plant.no_equilibrium.as_ref().filter(|_| !law.on_full_model());
            out.extend(why.map(|why| no_equilibrium(control, plant.default_point(), why)));
            Some((whole(law), whole(implemented)))
        }
        Ok(_) => {
            let message =
                format!("control `{}`: a gain is too large for single precision, in which firmware runs", control.name);
            out.push(
                Diagnostic::error("number::range", message)
                    .at(control.place.clone(), "this controller")
                    .help("check the exponents of its frequencies and of the model's numbers"),
            );
            None
        }
        Err(error) => {
            out.push(design_diagnostic(document, control, &error));
            None
        }
    }
}

/// The plant of a controller at its operating point, unless it has no linearisation there.
fn plant_at(
    document: &Document,
    control: &ControlSpec,
    reduced: Reduced,
    named_point: &NamedPoint,
    out: &mut Vec<Diagnostic>,
) -> Option<Plant> {
    match named_point.find(&reduced) {
        Ok(found) => {
            if !check_smooth(document, control, (&reduced, &found.point), out) {
                return None;
            }
            let mut plant = match reduced.equations.multiplier_constraints.is_empty() {
                true => Plant::at(reduced, found.point),
                false => match on_frozen_rows(&reduced, &found.point, &found.multipliers) {
                    Ok(plant) => plant,
                    Err(error) => {
                        out.push(rows_refused(control, &reduced, &error));
                        return None;
                    }
                },
            };
            (plant.point_note, plant.no_equilibrium) = (found.point_note, found.no_equilibrium);
            Some(plant)
        }
        // The variant has reported it; with the design values it is another error.
        Err(why) => {
            add_new(out, vec![named_point.refusal(document, std::slice::from_ref(control), &why)], None);
            None
        }
    }
}

/// The model for the design of a law: its own parameter values, no friction.
fn design_model(
    document: &Document,
    reduced: &Reduced,
    (settings, named_point): (&[Setting], &NamedPoint),
    control: &ControlSpec,
    out: &mut Vec<Diagnostic>,
) -> Option<Plant> {
    let moving: Vec<&str> = moves_by_itself(reduced).collect();
    if !moving.is_empty() {
        let message = format!(
            "the design of control `{}` treats the prescribed motion of {} as constant",
            control.name,
            quoted(moving)
        );
        out.push(
            Diagnostic::warning("control::time-varying", message)
                .at(control.place.clone(), "this controller")
                .help("its design uses the initial value, at rest, and the motion disturbs the loop"),
        );
    }
    let excluded = excluded(document, control, out)?;
    let laws = reduced.equations.laws.iter().filter(|law| law.value.is_of_time() && !excluded.contains(&law.element));
    let of_time: Vec<&str> = laws.map(|law| law.element.as_str()).collect();
    // A program uses no torques.
    if !of_time.is_empty() && control.law.keyword != Program::KEYWORD {
        let message =
            format!("the design of control `{}` uses the torque of {} at time zero", control.name, quoted(of_time));
        out.push(
            Diagnostic::warning("control::time-varying", message)
                .at(control.place.clone(), "this controller")
                .help("write a torque that is unknown to it as a `disturbance` with a function of time"),
        );
    }
    if control.design.is_empty() && excluded.is_empty() {
        return plant_at(document, control, reduced.clone(), named_point, out);
    }
    let retained = settings.iter().filter(|s| control.design.iter().all(|d| d.name != s.name));
    let all: Vec<Setting> = retained.chain(&control.design).cloned().collect();
    // The plant does not depend on which controllers are in the loop.
    let (model, diagnostics) = document.model_with(&all, Some(&[]));
    let place = document.controls.iter().find(|c| c.place == control.place);
    let place = place.map_or_else(|| control.place.clone(), |c| TableReader::place(&c.table, "design"));
    let mut wrong = false;
    for diagnostic in diagnostics.into_iter().filter(is_error) {
        wrong = true;
        let Diagnostic { code, message, labels, .. } = diagnostic;
        let mut diagnostic =
            Diagnostic::error(code, format!("with the design values of control `{}`: {message}", control.name))
                .at(place.clone(), "with these values")
                .help("choose design values that every element can take");
        diagnostic.labels.extend(labels);
        add_new(out, vec![diagnostic], None);
    }
    if wrong {
        return None;
    }
    if excluded.is_empty() {
        let names = reduced.coordinate_names();
        let design = reduced_design((control, place), (&model, &names), reduced, out)?;
        return plant_at(document, control, design, named_point, out);
    }
    let model = model_excluding(&model, &excluded);
    if let Some(diagnostic) = needed_by(document, control, &model) {
        out.push(diagnostic);
        return None;
    }
    let names: Vec<String> = reduced.coordinate_names().into_iter().filter(|name| !excluded.contains(name)).collect();
    let design = reduced_design((control, place), (&model, &names), reduced, out)?;
    let named_point = NamedPoint::anywhere(&design, control);
    plant_at(document, control, design, &named_point, out)
}

/// The model with the design values of a controller in explicit form, in the coordinates of the model itself.
fn reduced_design(
    (control, place): (&ControlSpec, Place),
    (model, names): (&Model, &[String]),
    reduced: &Reduced,
    out: &mut Vec<Diagnostic>,
) -> Option<Reduced> {
    let zero = vec![0.0; names.len()];
    let equations = assemble(&model.all_coordinates, &model.terms);
    // If this fails, elements other than springs act on such a motion, or none.
    let rows = equilibrium_rows(&equations).unwrap_or_default();
    match reduce(equations.with_equilibria(rows), Some(names)) {
        Ok(design) => {
            let able = is_finite_at(&design, &zero) && {
                let linear = sparse_model(&design, &zero);
                let indefinite = matches!(definiteness_of_rows(&linear.inertia), Definiteness::Indefinite { .. });
                let whole = names.len() == reduced.degrees_of_freedom();
                !indefinite && is_representable(&linear) && (!whole || is_designable(&design, reduced))
            };
            if !able {
                let message = format!(
                    "control `{}`: its design model and the model have different motions without inertia",
                    control.name
                );
                out.push(
                    Diagnostic::error("control::design", message)
                        .at(place, "with these values")
                        .help("choose design values for which the same motions have an inertia"),
                );
                return None;
            }
            Some(design)
        }
        Err(error) => {
            let message = format!("control `{}`: its design model cannot be reduced: {error}", control.name);
            out.push(
                Diagnostic::error("control::design", message)
                    .at(place, "with these values")
                    .help("choose design values for which the model keeps its degrees of freedom"),
            );
            None
        }
    }
}
