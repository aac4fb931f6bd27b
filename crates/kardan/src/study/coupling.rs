//! Cross coupling as the nonlinear simulation shows it: what a step of each reference does to the other outputs.

use rayon::prelude::*;

use super::{PreparedVariant, Progress};
use crate::results::{CrossCoupling, Design, Outcome, Physical, Series};
use crate::simulate::{Scenario, Setup, SignalEvent, Tolerance, simulate};
use crate::synthesis::Reference;

/// Rows of a window.
const ROWS: usize = 2000;
/// Windows, s.
const SHORTEST: f64 = 0.2;
/// See [`SHORTEST`].
const LONGEST: f64 = 10.0;
/// Part of the run before the step.
const BEFORE: f64 = 0.02;

/// Steps every reference of a channel by one unit, from rest, with all controllers of the variant in the loop.
pub(super) fn cross_coupling(
    variant: &PreparedVariant,
    references: &[Reference],
    design: &Design,
    progress: &dyn Progress,
) -> Vec<CrossCoupling> {
    let slowest =
        design.closed_loop_poles.iter().map(|(re, _)| -re).filter(|rate| *rate > 1e-3).fold(f64::MAX, f64::min);
    let window = (8.0 / slowest).clamp(SHORTEST, LONGEST);
    let stepped: Vec<(&Reference, &str)> = design
        .channels
        .iter()
        .filter_map(|channel| Some((references.iter().find(|r| r.name == channel.reference)?, channel.output.as_str())))
        .collect();
    let results = stepped.par_iter().enumerate().map(|(number, (reference, own))| {
        let name = format!("step of {}", reference.name);
        progress.advance(number, &name, 0.0);
        let scenario = step(&variant.scenario, &reference.name, window);
        let setup = Setup { reduced: &variant.reduced, laws: variant.design_laws(), scenario: &scenario };
        let run = simulate(setup, Tolerance::default(), &mut |part| progress.advance(number, &name, part));
        progress.advance(number, &name, 1.0);
        let failure = match &run.outcome {
            Outcome::Completed => None,
            Outcome::Failed { cause, .. } => Some(cause.clone()),
        };
        let watched = |output: &String| {
            let (unit, peak, rms) = deviation(&run.series, output, scenario.events[0].at);
            CrossCoupling {
                reference: reference.name.clone(),
                step: 1.0,
                step_unit: reference.physical.unit().into(),
                output: output.clone(),
                unit: unit.into(),
                own: output == own,
                peak,
                rms,
                window,
                failure: failure.clone(),
            }
        };
        design.outputs.iter().map(watched).collect::<Vec<_>>()
    });
    results.flatten_iter().collect()
}

/// A run from rest at zero angles in which one reference steps by one.
fn step(scenario: &Scenario, reference: &str, window: f64) -> Scenario {
    let at = BEFORE * window;
    let duration = at + window;
    let fine = window / (20 * ROWS) as f64;
    let mut times: Vec<f64> = (0..=20).map(|k| at * f64::from(k) / 20.0).collect();
    times.extend((1..400).map(|k| at + fine * f64::from(k)));
    times.extend((20..=ROWS).map(|k| at + window * k as f64 / ROWS as f64));
    if let Some(last) = times.last_mut() {
        *last = duration;
    }
    let source = scenario.sources.iter().position(|source| source.name == reference).unwrap_or(0);
    Scenario {
        duration,
        times,
        sources: scenario.sources.clone(),
        events: vec![SignalEvent { source, at, to: 1.0, over: 0.0 }],
        position: vec![0.0; scenario.position.len()],
        speed: vec![0.0; scenario.speed.len()],
    }
}

/// Unit, largest and root mean square deviation from the last value before the step.
fn deviation(series: &Series, output: &str, at: f64) -> (&'static str, f64, f64) {
    let Some(signal) = series.signal(output) else { return (Physical::Torque.unit(), f64::NAN, f64::NAN) };
    let first = series.time.partition_point(|time| *time < at);
    let start = first.checked_sub(1).map_or(0.0, |k| signal.values[k]);
    let (times, values) = (&series.time[first..], &signal.values[first..]);
    let peak = values.iter().map(|x| (x - start).abs()).fold(0.0, f64::max);
    let squares: f64 = (1..values.len())
        .map(|k| 0.5 * ((values[k] - start).powi(2) + (values[k - 1] - start).powi(2)) * (times[k] - times[k - 1]))
        .sum();
    let length = times.last().copied().unwrap_or(at) - at;
    (signal.physical.unit(), peak, if length > 0.0 { (squares / length).sqrt() } else { 0.0 })
}
