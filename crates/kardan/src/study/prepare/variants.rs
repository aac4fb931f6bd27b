//! Preparation of one variant: its equations, laws and loop, ready to run, with all errors at once.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use crate::study::PreparedVariant;
use crate::study::check::circuit::check_circuit;
use crate::study::check::effort::check_effort;
use crate::study::check::massless_motions::{check_start, without_massless};
use crate::study::check::model_checks::{check_connected, check_matrices, is_braced, reduce_diagnostics};
use crate::study::check::multiplier_constraints::{begin_on_rows, check_free, check_multipliers, on_rows, with_loop};
use crate::study::check::redundant_torques::check_redundant;
use crate::study::check::stop_checks::check_stops;
use crate::study::loops::blocks::{check_blocks, engaged_locks};
use crate::study::loops::loop_along_path::check_loop_along_path;
use crate::study::loops::loop_blocks::signals_at_begin;
use crate::study::loops::margins::{LoopKinks, UNSTABLE, check_margins, check_sampled, check_size};
use crate::study::measure::computed_signals::Computed;
use crate::study::operating_point::design_in_motion::with_motion;
use crate::study::operating_point::named_point::NamedPoint;
use crate::study::progress::{Progress, Silent};
use crate::study::read::faults::NamedFault;
use crate::study::read::initial_state::start_values;
use crate::study::read::positions::is_finite_at;
use crate::study::read::read_values::key_error;
use crate::study::read::scenario::scenario;
use crate::study::read::signal_table::SignalContext;
use crate::study::requests::analysis_spec::{Point, analysis_spec};
use kardan_mechanics::assemble::assemble;
use kardan_mechanics::reduce::{OperatingPoint, Reduced, reduce};
use kardan_model::{ControlSpec, Document, Model, VariantSettings};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::LawKeys;
use kardan_simulate::{Scenario, signal_names};
use kardan_synthesis::{Law, Plant, Program};

use super::design_models::{design_model, designed_law};
use super::start_at_rest::{references_at_rest, start_at_rest};

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

/// Counts the finished steps of all variants, on any thread.
pub(super) struct Steps<'p> {
    done: AtomicUsize,
    all: usize,
    progress: &'p dyn Progress,
}

impl<'p> Steps<'p> {
    pub(super) fn new(all: usize, progress: &'p dyn Progress) -> Self {
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
    own: &VariantSettings,
) -> Result<PreparedVariant, Vec<Diagnostic>> {
    let (model, mut diagnostics) = document.model_with(&own.settings, own.controls.as_deref());
    if diagnostics.iter().any(Diagnostic::is_error) || model.programs.broken {
        return Err(diagnostics);
    }
    let steps = Steps::new(1, &Silent);
    let purpose = (Purpose::Sample, &steps, designed);
    let found = prepare_variant(purpose, document, name.to_string(), model, own, &mut diagnostics);
    match found {
        Some(variant) if !diagnostics.iter().any(Diagnostic::is_error) => Ok(variant),
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

pub(super) fn prepare_variant(
    (purpose, steps, nominal): (Purpose, &Steps<'_>, Option<&PreparedVariant>),
    document: &Document,
    name: String,
    model: Model,
    own: &VariantSettings,
    out: &mut Vec<Diagnostic>,
) -> Option<PreparedVariant> {
    let settings = &own.settings[..];
    let (reduced, massless) = reduced_model(purpose, document, &model, out)?;
    check_redundant(document, &reduced, out);
    // Laws are designed for the accelerations that torques cause.
    let controls = if massless.is_empty() { &model.controls[..] } else { &[] };
    let (mut scenario, faults) = scenario(document, &model, (&reduced.equations, Some(&reduced)), settings, out);
    add_faults(document, (&mut scenario, &faults), (&name, &own.faults), out);
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
        let message = "at the initial position an angle is too large for a number";
        let help = "check the exponents of the initial angles and of the ratios";
        out.push(key_error("number::range", message, (&document.scenario, "initial", "from these angles"), help));
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
        own: own.clone(),
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
            Some(nominal) => Some([&nominal.designed[number], &nominal.implemented[number]].map(Arc::clone)),
            None => {
                plant.signals = signals_at_begin(scenario);
                plant.elements = model.elements.iter().map(|one| (one.kind.clone(), one.name.clone())).collect();
                designed_law(document, reduced, control, &plant, out)
            }
        };
        let Some([law, as_it_runs]) = law else { continue };
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
                let help = "a part has one fault at a time: let one end before the other begins";
                out.push(Diagnostic::error("fault::overlap", message).at(place, "at the same time").help(help));
            }
        }
    }
}

/// If the loop has a kink at its operating point and is stable on one side: the diagnostics of the opposite one.
fn check_opposite_side(variant: &PreparedVariant, before: usize, out: &mut Vec<Diagnostic>) {
    let is_unstable = |diagnostic: &Diagnostic| diagnostic.code == UNSTABLE;
    let is_sampled = variant.implemented.iter().any(|law| law.clock().is_some());
    if !is_sampled || out[before..].iter().any(is_unstable) {
        return;
    }
    let LoopKinks { kinks, .. } = LoopKinks::of(variant);
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
    if let Some(warning) = check_size(variant.in_loop()) {
        out.push(warning);
        steps.step();
        steps.step();
        check_effort(document, variant, out);
        return;
    }
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
    if !out.iter().any(Diagnostic::is_error) {
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

/// The equations in explicit form, with errors for motions without inertia; none if these, or other errors, prevent it.
fn reduced_model(
    purpose: Purpose,
    document: &Document,
    model: &Model,
    out: &mut Vec<Diagnostic>,
) -> Option<(Reduced, Vec<Diagnostic>)> {
    check_connected(document, model, out);
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
