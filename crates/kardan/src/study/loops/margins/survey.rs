//! How far a loop is from instability, in numbers.

use std::collections::HashSet;
use std::sync::Arc;

use kardan_rt::functions::{ln, powf};
use rayon::prelude::*;

use super::channels::errors;
use super::clocks::{clocks, shortest};
use super::stability::{LoopStability, StabilityProblem};
use super::warnings::{LOW_MARGIN, low_margins};
use crate::study::PreparedVariant;
use crate::study::loops::loop_blocks;
use kardan_math::num::{Matrix, Rational};
use kardan_mechanics::reduce::{LinearModel, motions_over_states};
use kardan_results::signal_name::SignalName;
use kardan_results::{ChannelMargin, Design, LoopLimit, Margins, RateLimit, Stability};
use kardan_synthesis::{
    Clock, ExactMotions, GAINS, Law, Limit, LoopBlocks, LoopPlant, Plant, Survey, counting_charges,
};

/// Relative distance of two frequencies that count as one motion.
const SAME_MOTION: f64 = 0.3;
/// Number of block states up to which margins are searched over the common period of several sample times.
const MAX_STATES: usize = 24;
/// Fraction of the largest movement below which a shaft counts as fixed.
const STILL: f64 = 1e-9;
/// Frequencies below this are written with an exponent, rad/s.
const SLOW: f64 = 1e-2;

/// The decay rate of the slowest motion of a sampled loop, 1/s; `None` if it does not decay, or if that is unknown.
pub(in crate::study) fn decay(variant: &PreparedVariant, margins: &Margins) -> Option<f64> {
    let own = margins.sample_time.unwrap_or_else(|| shortest(&clocks(&variant.model.controls)));
    let rate = -ln(margins.spectral_radius?) / own;
    (rate > 0.0).then_some(rate)
}

/// The number of uncontrolled rigid-body modes of the loop of the file's controllers.
pub(in crate::study) fn excluded(variant: &PreparedVariant, number: usize, plant: &LoopPlant) -> usize {
    let (laws, clocks) = (&variant.designed, clocks(&variant.model.controls));
    let blocks = loop_blocks::blocks(variant, plant).of_loop;
    let survey = Survey { plant, laws, clocks: &clocks, number, blocks: &blocks };
    survey.slowest(survey.unchanged()).map_or(0, |found| found.excluded)
}

/// What a loop tolerates beside the gains of its motors, searched with all blocks and with those of a search; a loop that is unstable as it is has no slowest
/// rate and tolerates nothing.
fn tolerated(
    variant: &PreparedVariant,
    [survey, reduced]: [&Survey<'_>; 2],
    stable: Option<bool>,
    design: &Design,
) -> Margins {
    let tolerates = stable != Some(false);
    // With a law that is designed for its sample time, few other clocks have a common period.
    let for_one_time = survey.laws.iter().any(|law| law.clock().is_some());
    let delays: &[f64] = if for_one_time || !tolerates { &[] } else { &[0.0, 0.5, 1.0] };
    let channels = || if stable == Some(true) { errors(variant, reduced) } else { Default::default() };
    let limit = |found: Option<Limit>| found.filter(|_| tolerates).map(|found| loop_limit(found, design));
    let delay = || limit(reduced.longest_delay());
    let lag = || limit(reduced.longest_lag());
    let rate = |delay: &f64| rate_limit(*delay, survey.longest_period(*delay), design);
    let rates = || delays.par_iter().map(rate).collect();
    let ((channels, multiloop), ((longest_delay, longest_lag), rates)) =
        rayon::join(channels, || rayon::join(|| rayon::join(delay, lag), rates));
    Margins { channels, multiloop, longest_delay, longest_lag, rates, ..Margins::default() }
}

fn loop_limit(found: Limit, design: &Design) -> LoopLimit {
    LoopLimit { value: found.value, motion: motion(&found, design) }
}

fn rate_limit(delay: f64, found: Option<Limit>, design: &Design) -> RateLimit {
    let rate = found.map(|limit| 1.0 / limit.value);
    RateLimit { delay, rate, motion: found.map(|limit| motion(&limit, design)).unwrap_or_default() }
}

/// The stability margins of the loop of a controller. The simulation gives the peaks of the torques.
pub(in crate::study) fn survey(variant: &PreparedVariant, number: usize, design: &Design) -> Margins {
    let (laws, plant) = (&variant.designed, variant.loop_plant());
    let clocks = clocks(&variant.model.controls);
    let blocks = loop_blocks::blocks(variant, &plant).of_loop;
    let survey = Survey { plant: &plant, laws, clocks: &clocks, number, blocks: &blocks };
    let own = clocks[number];
    let no_blocks = LoopBlocks::default();
    let reduced_survey = Survey { blocks: if searches(&blocks, own) { &blocks } else { &no_blocks }, ..survey };
    let as_it_is = survey.slowest(survey.unchanged());
    let radius = |growth: f64| own.map_or(growth, |own| powf(growth, own.period / shortest(&clocks)));
    let parts = survey.parts().map_or_else(Vec::new, |(parts, _)| parts);
    let problem = StabilityProblem { variant, plant: &plant, parts: &parts, has_blocks: !blocks.is_empty() };
    let exact = as_it_is.as_ref().and_then(|found| problem.exact(found));
    let decided = as_it_is.as_ref().map(|found| problem.decide(found, exact.as_ref()));
    let stable = decided.as_ref().and_then(LoopStability::controlled_is_stable);
    let decided = decided.unwrap_or_default();
    let tolerated = tolerated(variant, [&survey, &reduced_survey], stable, design);
    let channels = &tolerated.channels;
    let only_motor =
        channels.first().filter(|one| laws[number].inputs().len() == 1 && !one.is_sensor && !one.multirate_search);
    let gain_margin =
        only_motor.map(of_motor).or_else(|| reduced_survey.gain_margin(None).filter(|_| stable != Some(false)));
    let hard = |[low, high]: [f64; 2]| low > 1.0 / LOW_MARGIN || high < LOW_MARGIN;
    let low_margins = channels.iter().any(|one| !one.is_sensor && low_margins(one))
        || gain_margin.is_some_and(|[down, up]| hard([down.value, up.value]));
    let free = match &exact {
        Some(exact) => moving_exactly(&exact.motions, &variant.linear_model(), &variant.reduced.equations.coordinates),
        None => {
            survey.free().map_or_else(Vec::new, |free| moving(&free, &plant, &variant.reduced.equations.coordinates))
        }
    };
    Margins {
        sample_time: own.map(|clock| clock.period),
        delay: own.map_or(0.0, |clock| clock.delay),
        single_precision: own.is_some_and(|clock| clock.single),
        spectral_radius: as_it_is
            .as_ref()
            .filter(|_| clocks.iter().any(Option::is_some))
            .map(|found| radius(found.growth))
            // The motion of a growth below the resolution of floating point would contradict the verdict.
            .filter(|radius| *radius >= 1.0 || decided.verdict.word != Stability::Unstable),
        stable,
        proven: decided.verdict.is_proven(),
        stability: decided.verdict,
        poles: decided.poles,
        gain_margin: gain_margin.map(|both| both.map(|found| loop_limit(found, design))),
        uncontrolled_modes: free,
        uncontrolled_poles: decided.zeros,
        uncontrolled_poles_method: decided.how,
        uncontrolled_are_integrals: exact
            .as_ref()
            .is_some_and(|exact| only_count(exact, &variant.whole_model(number), laws)),
        near_zero_poles: decided.next_to_zero,
        analogue_blocks: if tolerated.rates.is_empty() { Vec::new() } else { analogue_blocks(laws, &blocks) },
        drift: as_it_is.as_ref().map_or(0.0, |found| found.drift),
        low_margins,
        ..tolerated
    }
}

/// The blocks of a loop that stay in continuous time where its laws are sampled: between the laws, and in them.
fn analogue_blocks(laws: &[Arc<dyn Law>], blocks: &LoopBlocks) -> Vec<String> {
    let clock = Clock { period: 1e-3, delay: 0.0, single: false };
    let flows = |law: &&Arc<dyn Law>| law.linear_sampled(clock).is_some_and(|linear| linear.flowing);
    let within = laws.iter().filter(flows).flat_map(|law| law.states());
    let between = blocks.names().iter().filter(|_| blocks.is_continuous()).cloned();
    let mut names: Vec<String> = within.chain(between).map(|name| SignalName::new(&name).element.to_string()).collect();
    let mut known = HashSet::new();
    names.retain(|name| known.insert(name.clone()));
    names
}

/// The factors of all torques that a loop tolerates, if there is one torque: those of its motor.
fn of_motor(motor: &ChannelMargin) -> [Limit; 2] {
    let [low, high] = motor.gain;
    let [at_low, at_high] = motor.gain_frequency.map(|frequency| frequency.unwrap_or(0.0));
    let low = if low < 1.0 / GAINS { 0.0 } else { low };
    let high = if high > GAINS { f64::INFINITY } else { high };
    [Limit { value: low, frequency: at_low }, Limit { value: high, frequency: at_high }]
}

/// Whether margins are searched with blocks in the loop: if many of these have another sample time than the controller, that would take minutes, and
/// they are treated as independent inputs.
pub(in crate::study) fn searches(blocks: &LoopBlocks, own: Option<Clock>) -> bool {
    own.map_or_else(|| blocks.is_continuous(), |own| blocks.has_sample_time(own.period) || blocks.size() <= MAX_STATES)
}

/// Whether all poles at zero are integrators without effect (charges).
fn only_count(exact: &ExactMotions, plant: &Plant, laws: &[Arc<dyn Law>]) -> bool {
    let counters = counting_charges(plant, laws);
    // They are among the poles at zero, so they are all of them if the numbers are equal. If none was found exactly, the poles that rounding takes for zero are
    // other ones.
    exact.motions.columns() > 0 && exact.motions.columns() == counters.measured.len()
}

/// Shafts that move in some of these motions, exactly.
fn moving_exactly(motions: &Matrix<Rational>, model: &LinearModel, shafts: &[String]) -> Vec<String> {
    let motion_rows = motions_over_states(&model.basis, &model.moving());
    let own = Matrix::from_fn(motion_rows[0].columns(), motions.columns(), |i, k| motions[(i, k)].clone());
    let moved = motion_rows.map(|motion_rows| motion_rows.multiply(&own));
    let moves = |shaft: &usize| moved.iter().any(|moved| moved.row(*shaft).iter().any(|x| !x.is_zero()));
    (0..shafts.len()).filter(moves).map(|shaft| shafts[shaft].clone()).collect()
}

/// Shafts that move in some of these motions.
fn moving(motions: &Matrix<f64>, plant: &LoopPlant, shafts: &[String]) -> Vec<String> {
    let motion_rows = motions_over_states(&plant.basis, &plant.moving);
    let of = |shaft: usize, motion: usize, motion_rows: &Matrix<f64>| {
        (0..motion_rows.columns()).map(|j| motion_rows[(shaft, j)] * motions[(j, motion)]).sum::<f64>().abs()
    };
    let moves = |shaft: usize| {
        (0..motions.columns()).any(|k| {
            motion_rows.iter().any(|motion_rows| {
                let largest = (0..shafts.len()).map(|other| of(other, k, motion_rows)).fold(0.0, f64::max);
                let size = (0..motions.rows()).map(|i| motions[(i, k)].abs()).fold(0.0, f64::max);
                largest > STILL * size && of(shaft, k, motion_rows) > STILL * largest
            })
        })
    };
    (0..shafts.len()).filter(|shaft| moves(*shaft)).map(|shaft| shafts[shaft].clone()).collect()
}

/// The motion at a frequency as text; the zero dynamics by that name.
fn motion(limit: &Limit, design: &Design) -> String {
    if !limit.value.is_finite() || limit.value == 0.0 {
        return String::new();
    }
    let near = |frequency: f64| ln(frequency / limit.frequency).abs() < SAME_MOTION;
    let zero = design.zero_dynamics.modes.iter().find(|mode| mode.pole.im != 0.0 && near(mode.natural_frequency));
    match zero {
        Some(mode) if design.cancels_zeros => {
            format!("the zero dynamics ({:.4} rad/s, damping ratio {:.3})", mode.natural_frequency, mode.damping_ratio)
        }
        _ => format_motion(limit.frequency),
    }
}

/// A motion of this frequency, rad/s.
pub(super) fn format_motion(frequency: f64) -> String {
    match frequency {
        0.0 => "a motion without oscillation".into(),
        _ if frequency < SLOW => format!("a motion at {frequency:.4e} rad/s"),
        _ => format!("a motion at {frequency:.4} rad/s"),
    }
}
