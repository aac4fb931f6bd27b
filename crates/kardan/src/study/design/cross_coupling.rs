//! Cross coupling in the nonlinear simulation: the effect of a step of each reference on the other outputs.

use kardan_rt::functions::powi;
use rayon::prelude::*;

use crate::study::progress::run_with_progress;
use crate::study::{PreparedVariant, Progress};
use kardan_results::{CrossCoupling, Design, Physical, Run, Series, TorquePeak};
use kardan_simulate::{Faults, Ready, Scenario, Setup, SignalEvent, SourceTarget, Tolerance};
use kardan_synthesis::Reference;

/// Rows of a window.
const ROWS: usize = 2000;
/// Windows, s.
const SHORTEST: f64 = 0.2;
/// See [`SHORTEST`].
const LONGEST: f64 = 10.0;
/// Limit of integrator steps of a run; of a sampled loop this many more for each sample.
const MOST_STEPS: usize = 200_000;
/// Samples of all controllers in a window, at most.
const MOST_SAMPLES: f64 = 1e6;
/// See [`MOST_STEPS`].
const STEPS_PER_SAMPLE: f64 = 20.0;
/// Fraction of the run before the step.
const BEFORE: f64 = 0.02;

/// The effect of the steps on the outputs, and the motor loads.
#[derive(Default)]
pub(in crate::study) struct Coupling {
    pub outputs: Vec<CrossCoupling>,
    pub peaks: Vec<TorquePeak>,
    pub warnings: Vec<String>,
}

/// Steps every reference of a channel by one unit, from rest, with all controllers of the variant in the loop. Motion
/// without a step (springs that are not relaxed) is subtracted. `decay` is that of the slowest motion of a sampled loop, 1/s.
pub(in crate::study) fn cross_coupling(
    variant: &PreparedVariant,
    references: &[Reference],
    design: &Design,
    decay: Option<f64>,
    progress: &dyn Progress,
) -> Coupling {
    let poles = design.closed_loop_poles.iter().map(|pole| -pole.re);
    let slowest = poles.chain(decay).filter(|rate| *rate > 1e-3).fold(f64::MAX, f64::min);
    let samples: f64 = variant.implemented.iter().filter_map(|law| law.clock()).map(|clock| 1.0 / clock.period).sum();
    let longest = if samples > 0.0 { LONGEST.min(MOST_SAMPLES / samples) } else { LONGEST };
    let window = (8.0 / slowest).max(SHORTEST).min(longest);
    let stepped: Vec<(&Reference, &str)> = design
        .channels
        .iter()
        .filter_map(|channel| Some((references.iter().find(|r| r.name == channel.reference)?, channel.output.as_str())))
        .collect();
    let steps = MOST_STEPS + (STEPS_PER_SAMPLE * samples * (1.0 + BEFORE) * window) as usize;
    let most_steps = steps.min(progress.most_steps());
    let runs: Vec<Run> = (0..=stepped.len())
        .into_par_iter()
        .map(|k| {
            let reference = stepped.get(k).map(|(reference, _)| reference.name.as_str());
            run(variant, (k, reference), window, most_steps, progress)
        })
        .collect();
    let (still, moved) = runs.split_last().expect("one run without a step");
    let mut out = Coupling::default();
    for ((reference, own), run) in stepped.iter().zip(moved) {
        let failure = [&still.outcome, &run.outcome].into_iter().find_map(|outcome| outcome.cause().map(String::from));
        let (name, unit) = (&reference.name, reference.physical.unit());
        if let Some(cause) = &failure {
            out.warnings.push(format!("the simulated step of {name} fails: {cause}"));
        }
        if let Some(event) = run.events.iter().find(|event| event.description.contains(" limit")) {
            out.warnings.push(format!(
                "the step of {name} by 1 {unit} drives a motor to its limit ({}): the cross coupling then includes \
                 the effect of the limit",
                event.description
            ));
        }
        for input in design.inputs.iter().filter(|_| failure.is_none()) {
            let Some(peak) = run.series.largest_torque_demand(input) else { continue };
            out.peaks.push(TorquePeak {
                reference: name.clone(),
                step: 1.0,
                step_unit: unit.into(),
                input: input.clone(),
                unit: variant.design_models.first().map_or_else(|| "N m".into(), |plant| plant.effort_of(input).unit),
                peak,
                limit: torque_limit(variant, input),
            });
        }
        for output in &design.outputs {
            let (unit_of_output, size) = deviation(&run.series, &still.series, output, BEFORE * window);
            out.outputs.push(CrossCoupling {
                reference: name.clone(),
                step: 1.0,
                step_unit: unit.into(),
                output: output.clone(),
                unit: unit_of_output.into(),
                same_channel: output == *own,
                peak: size.map(|(peak, _)| peak),
                rms: size.map(|(_, rms)| rms),
                window,
                failure: failure.clone(),
            });
        }
    }
    out
}

/// A run in which one reference steps, or none; `number` is that of its progress.
fn run(
    variant: &PreparedVariant,
    (number, reference): (usize, Option<&str>),
    window: f64,
    most_steps: usize,
    progress: &dyn Progress,
) -> Run {
    let name = reference.map_or("without a step".to_string(), |reference| format!("step of {reference}"));
    let scenario = step(variant, reference, window);
    let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &scenario };
    let tolerance = Tolerance { most_steps, ..Tolerance::default() };
    run_with_progress(Ready::new(setup, tolerance), (number, &name), progress).run
}

fn torque_limit(variant: &PreparedVariant, input: &str) -> Option<f64> {
    let number = variant.reduced.equations.inputs.iter().position(|candidate| candidate.element == input)?;
    (!variant.design_models.is_empty()).then(|| variant.whole_model(0).torque_limit(number))?
}

/// A run from rest at the operating point in which one reference steps by one, or none.
fn step(variant: &PreparedVariant, reference: Option<&str>, window: f64) -> Scenario {
    let scenario = &variant.scenario;
    let at = BEFORE * window;
    let duration = at + window;
    let fine = window / (20 * ROWS) as f64;
    let mut times: Vec<f64> = (0..=20).map(|k| at * f64::from(k) / 20.0).collect();
    times.extend((1..400).map(|k| at + fine * f64::from(k)));
    times.extend((20..=ROWS).map(|k| at + window * k as f64 / ROWS as f64));
    if let Some(last) = times.last_mut() {
        *last = duration;
    }
    let mut events = Vec::new();
    for law in &variant.implemented {
        for (own, rest) in law.references().iter().zip(law.references_at_rest()) {
            let Some(source) = scenario.sources.iter().position(|source| source.name == own.name) else { continue };
            if rest != 0.0 {
                events.push(SignalEvent { source, at: 0.0, to: rest, over: 0.0 });
            }
            if reference == Some(own.name.as_str()) {
                events.push(SignalEvent { source, at, to: rest + 1.0, over: 0.0 });
            }
        }
    }
    let of_blocks = scenario.signals.iter().filter(|one| scenario.sources[one.source].target == SourceTarget::Block);
    Scenario {
        recorded: None,
        duration,
        times,
        events,
        signals: of_blocks.cloned().collect(),
        faults: Faults::default(),
        position: variant.point.position.clone(),
        speed: variant.point.rates.clone(),
        ..scenario.clone()
    }
}

/// Unit, largest and root mean square difference of a run with a step from the one without, from the step on.
fn deviation(moved: &Series, still: &Series, output: &str, at: f64) -> (&'static str, Option<(f64, f64)>) {
    let (Some(signal), Some(other)) = (moved.signal(output), still.signal(output)) else {
        return (Physical::Torque.unit(), None);
    };
    let rows = moved.time.len().min(still.time.len());
    let first = moved.time.partition_point(|time| *time < at).min(rows);
    let times = &moved.time[first..rows];
    let values: Vec<f64> = (first..rows).map(|k| signal.values[k] - other.values[k]).collect();
    let peak = values.iter().map(|x| x.abs()).fold(0.0, f64::max);
    let squares: f64 = (1..values.len())
        .map(|k| 0.5 * (powi(values[k], 2) + powi(values[k - 1], 2)) * (times[k] - times[k - 1]))
        .sum();
    let length = times.last().copied().unwrap_or(at) - at;
    (signal.physical.unit(), Some((peak, if length > 0.0 { (squares / length).sqrt() } else { 0.0 })))
}
