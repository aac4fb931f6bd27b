//! What sampling, delay, lag and limits leave of a controller's loop, and whether that is still a design.

use std::sync::Arc;

use super::PreparedVariant;
use crate::analysis::OutputSignal;
use crate::diagnostics::{Diagnostic, Severity};
use crate::model::ControlSpec;
use crate::num::{Matrix, Rational, eigenvalues, multiply, split_off};
use crate::reduce::{LinearModel, linearise};
use crate::results::{ChannelMargin, Design, FreeKnown, LoopLimit, Margins, RateLimit, TogetherMargin, WrongTorque};
use crate::simulate::Profile;
use crate::synthesis::margins::{ChannelMargins, Response, channel_margins, together as all_at_once};
use crate::synthesis::{
    Clock, ExactMotions, Law, Limit, LoopPlant, Plant, SampledLoop, SampledPart, Slowest, Stability, Survey, clock,
    exact_motions,
};

/// Relative distance of two frequencies that belong to one motion.
const SAME_MOTION: f64 = 0.3;
/// Factor of a torque within which a loop must be stable, or is hardly so.
const HARDLY: f64 = 1.1;
/// Disk margin of one channel below which a loop deserves a warning: a factor of 1.5, 23°.
const DISK: f64 = 0.4;
/// The same for all motors at once: a factor of 1.22, 11°.
const DISK_TOGETHER: f64 = 0.2;
/// Turn of the phase of one channel, rad, below which a loop deserves a warning: 15°.
const PHASE: f64 = std::f64::consts::PI / 12.0;
/// Disk margin of a loop that is not hardly stable: it holds the factor 1.1, and 5.5°.
const CLOSE: f64 = 2.0 * (HARDLY - 1.0) / (HARDLY + 1.0);
/// Part of its lag, or of one sample, by which a motor must be allowed to be late.
const LATE: f64 = 0.25;
/// How much smaller the disk of all motors at once must be than that of each channel, if others have been warned of.
const WORSE: f64 = 0.75;
/// Part of the largest movement below which a shaft stands still.
const STILL: f64 = 1e-9;

pub(super) fn clocks(controls: &[ControlSpec]) -> Vec<Option<Clock>> {
    controls.iter().map(|control| clock(&control.values).ok().flatten()).collect()
}

/// The shortest sample time, s.
fn shortest(clocks: &[Option<Clock>]) -> f64 {
    clocks.iter().flatten().map(|clock| clock.period).fold(f64::INFINITY, f64::min)
}

/// The linear plant of a variant at zero angles, with its motors.
fn linear(variant: &PreparedVariant) -> LoopPlant {
    let model = model_of(variant);
    let lags = variant.design_models.first().map(Plant::lags).unwrap_or_default();
    LoopPlant::new(&model, &lags).with_sensors(&variant.reduced)
}

/// Sampled controllers and slow sensors of a loop with their times, in words.
fn together(variant: &PreparedVariant, parts: &[SampledPart]) -> Vec<String> {
    let controls = variant.model.controls.iter().zip(parts);
    let sampled = controls.filter_map(|(control, part)| Some((control, part.clock?.period)));
    let mut out: Vec<String> =
        sampled.map(|(control, period)| format!("control `{}` ({period} s)", control.name)).collect();
    let mut slow: Vec<_> = parts.iter().flat_map(|part| &part.slow).map(|(_, sensor)| sensor).collect();
    slow.sort_by(|a, b| a.name.cmp(&b.name));
    slow.dedup_by(|a, b| a.name == b.name);
    out.extend(slow.iter().map(|sensor| format!("sensor `{}` ({} s)", sensor.name, sensor.period)));
    out
}

/// The mistakes of sampled controllers whose loop is unstable, with the spectral radius of the exact sampled loop.
pub(super) fn check_sampled(variant: &PreparedVariant, out: &mut Vec<Diagnostic>) {
    let clocks = clocks(&variant.model.controls);
    let period = |place: &usize| clocks[*place].map_or(0.0, |clock| clock.period);
    // Of several the slowest one, as it has the most to gain.
    let places = (0..clocks.len()).rev().filter(|place| clocks[*place].is_some());
    let Some(place) = places.max_by(|a, b| period(a).total_cmp(&period(b))) else { return };
    let control = &variant.model.controls[place];
    let (laws, plant) = (&variant.running, linear(variant));
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    let all = together(variant, &parts);
    let free = left_out(variant, place, &plant);
    let judged = SampledLoop::new(&plant, &parts).map_err(|why| why.to_string());
    let judged = judged.and_then(|found| {
        let slowest = found.slowest_without(free).ok_or("the eigenvalue iteration failed")?;
        Ok((slowest, found.sample_time))
    });
    let (slowest, sample_time) = match judged {
        Ok(judged) => judged,
        Err(why) => {
            let message = format!("whether the sampled loop is stable is not known: {why} ({})", all.join(", "));
            let help = "choose times with a common period that holds few of the shortest; the run shows what happens";
            let told = Diagnostic::warning("control::no-map", message).at(control.place.clone(), "this controller");
            out.push(told.help(help));
            return;
        }
    };
    if slowest.stable {
        check_limits(variant, &plant, &parts, laws, out);
        return;
    }
    let who = match all.as_slice() {
        [_] => format!("control `{}`: at this sample time the loop is unstable", control.name),
        all => format!("at these sample times the loop is unstable: {} together", all.join(", ")),
    };
    let message = format!(
        "{who}: a motion at {:.4} rad/s grows by the factor {:.6} in each of the {:.0} samples a second (exact map of the linear \
         loop, delay and lag included)",
        slowest.frequency,
        slowest.growth,
        1.0 / sample_time
    );
    let help = match all.as_slice() {
        [_] if control.law.samples => {
            "choose a shorter `sample_time` or `delay`, or less `effort`; `--force` runs it as it is"
        }
        [_] => {
            "choose a shorter `sample_time` or `delay`, or `law = \"sampled_noninteracting\"`, which is designed for them; \
             `kardan design` without `sample_time` tells the slowest stable rate, `--force` runs it as it is"
        }
        _ => "choose shorter times, the longest one first; `--force` runs it as it is",
    };
    out.push(Diagnostic::error(UNSTABLE, message).at(control.place.clone(), "unstable at this sample time").help(help));
}

/// How many motions of the loop of the file's controllers nobody holds.
pub(super) fn left_out(variant: &PreparedVariant, number: usize, plant: &LoopPlant) -> usize {
    let (laws, clocks) = (&variant.designed, clocks(&variant.model.controls));
    let survey = Survey { plant, laws, clocks: &clocks, number };
    survey.slowest(survey.unchanged()).map_or(0, |found| found.left_out)
}

/// Codes of mistakes that `--force` overrules.
const FORCED: [&str; 2] = [UNSTABLE, LIMIT];

/// What stands in the way of a run only for its user's good becomes a warning.
pub fn overrule(diagnostics: &mut [Diagnostic]) {
    for diagnostic in diagnostics.iter_mut().filter(|diagnostic| FORCED.contains(&diagnostic.code)) {
        diagnostic.severity = Severity::Warning;
    }
}

/// An unstable loop.
const UNSTABLE: &str = "control::unstable";
/// A reference that no motor can hold.
const LIMIT: &str = "control::limit";
/// Largest relative change of a torque at the instants at which it is looked at, if it has settled.
const SETTLED: f64 = 0.01;
/// Parts of the time from the last change of a reference to the end of the run.
const LOOKS: [f64; 5] = [0.6, 0.7, 0.8, 0.9, 1.0];
/// Periods of the map in that time, at least.
const FEWEST: f64 = 50.0;

/// The mistakes of references that ask for more torque than a motor has: at their values at the end of the run, once the linear
/// loop has settled.
fn check_limits(
    variant: &PreparedVariant,
    plant: &LoopPlant,
    parts: &[SampledPart],
    laws: &[Arc<dyn Law>],
    out: &mut Vec<Diagnostic>,
) {
    let Ok(found) = SampledLoop::driven(plant, parts, 1.0) else { return };
    let scenario = &variant.scenario;
    let changed = scenario.events.iter().map(|event| event.at + event.over).filter(|end| *end < scenario.duration);
    let periods = (scenario.duration - changed.fold(0.0, f64::max)) / found.period;
    if periods < FEWEST {
        return;
    }
    let maps = LOOKS.map(|part| found.after((part * periods) as usize));
    let end = |name: &str| {
        let source = scenario.sources.iter().position(|source| source.name == name)?;
        Some(Profile::new(scenario.events.iter().filter(|event| event.source == source)).value(scenario.duration))
    };
    let mut z = vec![0.0; found.map.rows()];
    let mut asked = Vec::new();
    for (law, first) in laws.iter().zip(&found.references) {
        for (k, reference) in law.references().iter().enumerate() {
            let value = end(&reference.name).unwrap_or(0.0);
            z[first + k] = value;
            if value != 0.0 {
                asked.push(format!("`{}` = {value} {}", reference.name, reference.physical.unit()));
            }
        }
    }
    let ends = maps.map(|map| {
        let mut end = vec![0.0; z.len()];
        multiply(map.as_slice(), &z, &mut end);
        end
    });
    for (number, (law, part)) in laws.iter().zip(parts).enumerate().filter(|(_, (law, _))| law.clock().is_some()) {
        for (&input, name) in part.inputs.iter().zip(law.inputs()) {
            let command = |z: &Vec<f64>| -> f64 { found.commands.row(input).iter().zip(z).map(|(a, b)| a * b).sum() };
            let needed = command(&ends[LOOKS.len() - 1]);
            let limit = variant.design_models[number].torque_limit(input);
            let Some(limit) = limit.filter(|limit| needed.abs() > limit * (1.0 + 1e-6)) else { continue };
            if ends.iter().any(|z| (command(z) - needed).abs() > SETTLED * needed.abs()) {
                continue;
            }
            let control = &variant.model.controls[number];
            let message = format!(
                "control `{}`: with {} the motor `{name}` would have to give {:.4} N m in the end, and its limit is {limit} N m: \
                 this can never be reached",
                control.name,
                asked.join(" and "),
                needed.abs()
            );
            let help = format!(
                "ask for at most {:.3} times as much, or choose a stronger motor; `--force` runs it",
                limit / needed.abs()
            );
            out.push(Diagnostic::error(LIMIT, message).at(control.place.clone(), "this controller").help(help));
        }
    }
}

/// How fast the slowest motion of a sampled loop decays, 1/s; `None` if it does not, or is not known.
pub(super) fn decay(variant: &PreparedVariant, margins: &Margins) -> Option<f64> {
    let own = margins.sample_time.unwrap_or_else(|| shortest(&clocks(&variant.model.controls)));
    let rate = -margins.spectral_radius?.ln() / own;
    (rate > 0.0).then_some(rate)
}

/// How far the loop of a controller is from instability. Peaks of the torques are left to the simulation.
pub(super) fn survey(variant: &PreparedVariant, number: usize, laws: &[Arc<dyn Law>], design: &Design) -> Margins {
    let plant = linear(variant);
    let clocks = clocks(&variant.model.controls);
    let survey = Survey { plant: &plant, laws, clocks: &clocks, number };
    let own = clocks[number];
    let as_it_is = survey.slowest(survey.unchanged());
    let motion = |limit: &Limit| motion(limit, design);
    let limit = |found: Limit| LoopLimit { value: found.value, motion: motion(&found) };
    let rates = |delay: f64| {
        let found = survey.longest_period(delay);
        RateLimit {
            delay,
            rate: found.map(|limit| 1.0 / limit.value),
            motion: found.map(|limit| motion(&limit)).unwrap_or_default(),
        }
    };
    // Beside a law that is designed for its sample time, hardly any other one has a common period with it.
    let for_one_time = laws.iter().any(|law| law.clock().is_some());
    let radius = |growth: f64| own.map_or(growth, |own| growth.powf(own.period / shortest(&clocks)));
    let exact = exact_motions(&model_of(variant), &plant.lags, laws);
    let continuous = clocks.iter().all(Option::is_none) && !for_one_time;
    let known = as_it_is.as_ref().map(|found| Known::of(found, exact.as_ref(), &plant, laws, continuous));
    let stable = known.as_ref().map(|known| known.stable);
    let tolerated = stable != Some(false);
    let gain_margin = survey.gain_margin().filter(|_| tolerated);
    let (channels, together) = if stable == Some(true) { errors(variant, number, &survey) } else { Default::default() };
    let hard = |[low, high]: [f64; 2]| low > 1.0 / HARDLY || high < HARDLY;
    let hardly = channels.iter().any(|one| !one.reading && hardly(one))
        || gain_margin.is_some_and(|[down, up]| hard([down.value, up.value]));
    let free = match &exact {
        Some(exact) => moving_exactly(&exact.motions, &model_of(variant), &variant.reduced.equations.shafts),
        None => as_it_is
            .as_ref()
            .map_or_else(Vec::new, |found| moving(&found.free, &plant, &variant.reduced.equations.shafts)),
    };
    Margins {
        sample_time: own.map(|clock| clock.period),
        delay: own.map_or(0.0, |clock| clock.delay),
        single: own.is_some_and(|clock| clock.single),
        spectral_radius: as_it_is
            .as_ref()
            .filter(|_| clocks.iter().any(Option::is_some))
            .map(|found| radius(found.growth)),
        stable,
        proven: known.as_ref().is_some_and(|known| known.proven),
        rates: if for_one_time { Vec::new() } else { [0.0, 0.5, 1.0].map(rates).to_vec() },
        longest_delay: survey.longest_delay().filter(|_| tolerated).map(limit),
        longest_lag: survey.longest_lag().filter(|_| tolerated).map(limit),
        gain_margin: gain_margin.map(|both| both.map(limit)),
        free,
        free_poles: known.as_ref().map_or(0, |known| known.zeros),
        free_known: known.as_ref().map(|known| known.how).unwrap_or_default(),
        next_to_zero: known.map(|known| known.next_to_zero).unwrap_or_default(),
        drift: as_it_is.as_ref().map_or(0.0, |found| found.drift),
        channels,
        together,
        hardly,
        peaks: Vec::new(),
        verdict: String::new(),
    }
}

/// What is decided about the loop as it is, exactly where it can be.
struct Known {
    stable: bool,
    proven: bool,
    zeros: usize,
    how: FreeKnown,
    next_to_zero: Vec<f64>,
}

impl Known {
    fn of(
        found: &Slowest,
        exact: Option<&ExactMotions>,
        plant: &LoopPlant,
        laws: &[Arc<dyn Law>],
        continuous: bool,
    ) -> Self {
        let rounded = Self {
            stable: found.stable,
            proven: false,
            zeros: found.left_out,
            how: FreeKnown::Within(found.rounding),
            next_to_zero: Vec::new(),
        };
        let Some(exact) = exact else { return rounded };
        let how = if exact.designed { FreeKnown::Design } else { FreeKnown::Rounded };
        if !continuous {
            // Of a map only what goes on whatever the clocks is known exactly.
            return if exact.sampled == found.left_out { Self { how, ..rounded } } else { rounded };
        }
        if exact.zeros() != found.left_out && !exact.designed {
            // Rounding of the gains moves what the design leaves at zero.
            return rounded;
        }
        let rest = exact.rest();
        let held = matches!(rest, Some(Stability::Stable | Stability::Marginal));
        let next_to_zero = match found.left_out.checked_sub(exact.zeros()) {
            Some(more) if more > 0 => beside_zero(exact, plant, laws, more),
            _ => Vec::new(),
        };
        let decided = rest.is_some() && (held || exact.designed);
        Self {
            stable: if decided { held } else { found.stable },
            proven: decided,
            zeros: exact.zeros(),
            how,
            next_to_zero,
        }
    }
}

/// Real parts of the eigenvalues closest to zero, so many, without those that are exactly there.
fn beside_zero(exact: &ExactMotions, plant: &LoopPlant, laws: &[Arc<dyn Law>], count: usize) -> Vec<f64> {
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, plant)).collect();
    let split = split_off(&SampledLoop::flow_of(plant, &parts), &exact.motions.to_f64());
    let poles = split.and_then(|split| eigenvalues(&split.rest)).unwrap_or_default();
    poles.iter().take(count).map(|(re, _)| *re).collect()
}

/// The linear model of a variant at zero angles.
fn model_of(variant: &PreparedVariant) -> LinearModel {
    linearise(&variant.reduced, &vec![0.0; variant.reduced.degrees_of_freedom()])
}

/// Shafts that move in some of these motions, exactly.
fn moving_exactly(motions: &Matrix<Rational>, model: &LinearModel, shafts: &[String]) -> Vec<String> {
    let r = model.basis.columns();
    let part = |first: usize| Matrix::from_fn(r, motions.columns(), |i, k| motions[(first + i, k)].clone());
    let moved = [0, r].map(|first| model.basis.multiply(&part(first)));
    let moves = |shaft: &usize| moved.iter().any(|moved| moved.row(*shaft).iter().any(|x| !x.is_zero()));
    (0..shafts.len()).filter(moves).map(|shaft| shafts[shaft].clone()).collect()
}

/// Shafts that move in some of these motions.
fn moving(motions: &Matrix<f64>, plant: &LoopPlant, shafts: &[String]) -> Vec<String> {
    let r = plant.basis.columns();
    let of = |shaft: usize, motion: usize, first: usize| {
        (0..r).map(|j| plant.basis[(shaft, j)] * motions[(first + j, motion)]).sum::<f64>().abs()
    };
    let moves = |shaft: usize| {
        (0..motions.columns()).any(|k| {
            [0, r].into_iter().any(|first| {
                let largest = (0..shafts.len()).map(|other| of(other, k, first)).fold(0.0, f64::max);
                let size = (0..motions.rows()).map(|i| motions[(i, k)].abs()).fold(0.0, f64::max);
                largest > STILL * size && of(shaft, k, first) > STILL * largest
            })
        })
    };
    (0..shafts.len()).filter(|shaft| moves(*shaft)).map(|shaft| shafts[shaft].clone()).collect()
}

/// A channel's margins with its name.
fn named(name: &str, reading: bool, found: &ChannelMargins) -> ChannelMargin {
    ChannelMargin {
        name: name.into(),
        reading,
        gain: found.gain,
        gain_frequency: found.gain_frequency,
        phase: found.phase,
        phase_frequency: found.phase_frequency,
        delay: found.delay,
        delay_frequency: found.delay_frequency,
        disk: found.disk,
        disk_frequency: Some(found.disk_frequency),
        own_time: None,
        sampled: false,
        searched: false,
        disk_gain: found.disk_gain(),
        disk_phase: found.disk_phase(),
    }
}

/// How wrong the torque of each motor may be alone; with `late` the delay that a sampled loop tolerates is searched too.
fn of_motors(survey: &Survey<'_>, response: Option<&Response>, late: bool) -> Vec<ChannelMargin> {
    let clock = survey.clocks[survey.number];
    let law = &survey.laws[survey.number];
    let lag = |name: &String| {
        let input = survey.plant.inputs.iter().position(|input| input == name)?;
        Some(survey.plant.lags[input]).filter(|lag| *lag > 0.0)
    };
    let one = |(motor, name): (usize, &String)| {
        let mut out = match response {
            Some(response) => named(name, false, &channel_margins(&response.channel(motor))?),
            None => searched(survey, motor, name)?,
        };
        out.sampled = clock.is_some();
        out.own_time = clock.map_or_else(|| lag(name), |clock| Some(clock.period));
        if clock.is_some() && late {
            let limit = survey.motor_delay(motor);
            out.delay = limit.map(|limit| limit.value);
            out.delay_frequency = limit.filter(|limit| limit.value.is_finite()).map(|limit| limit.frequency);
        }
        Some(out)
    };
    law.inputs().iter().enumerate().filter_map(one).collect()
}

/// The margins of a motor of a sampled controller in a loop with several clocks, searched on the map over their common period.
fn searched(survey: &Survey<'_>, motor: usize, name: &str) -> Option<ChannelMargin> {
    let lifted = survey.lifted(motor)?;
    let [down, up] = survey.motor_gain(motor)?;
    let limited = |limit: &Limit| (limit.value > 0.0 && limit.value.is_finite()).then_some(limit.frequency);
    let found = ChannelMargins {
        gain: [down.value, up.value],
        gain_frequency: [limited(&down), limited(&up)],
        phase: lifted.phase(),
        disk: lifted.disk(),
        ..ChannelMargins::default()
    };
    Some(ChannelMargin { searched: true, disk_frequency: None, ..named(name, false, &found) })
}

/// How wrong each channel may be alone, and all motors at once.
fn errors(
    variant: &PreparedVariant,
    number: usize,
    survey: &Survey<'_>,
) -> (Vec<ChannelMargin>, Option<TogetherMargin>) {
    let law = &survey.laws[number];
    let motors = survey.motors();
    let mut out = of_motors(survey, motors.as_ref(), true);
    let model = &variant.design_models[number];
    let rows = |signal: &OutputSignal| {
        let found = model.system(law.inputs(), std::slice::from_ref(signal));
        (signal.name.clone(), found.c.to_f64().row(0).to_vec())
    };
    let sensors: Vec<(String, Vec<f64>)> = law.sensors().iter().map(rows).collect();
    if let Some((names, readings)) = survey.readings(&sensors, model.shafts()) {
        let found = names.iter().enumerate().map(|(k, name)| (name, channel_margins(&readings.channel(k))));
        out.extend(found.filter_map(|(name, found)| Some(named(name, true, &found?))));
    }
    let together = motors.filter(|motors| motors.channels() > 1).and_then(|motors| {
        let found = all_at_once(&motors)?;
        let worst = law.inputs().iter().zip(&found.worst);
        Some(TogetherMargin {
            disk: found.disk,
            frequency: found.frequency,
            worst: worst
                .map(|(name, (re, im))| WrongTorque { motor: name.clone(), factor: re.hypot(*im), turn: im.atan2(*re) })
                .collect(),
        })
    });
    (out, together)
}

/// What of the margins must not be overlooked.
pub(super) fn warnings(found: &Margins) -> Vec<String> {
    let mut out: Vec<String> = found.channels.iter().filter_map(close).collect();
    let wrong = |one: &&ChannelMargin| close(one).is_none() && one.disk < DISK;
    out.extend(found.channels.iter().filter(wrong).map(|one| {
        format!(
            "{} may be wrong by no more than factors from {:.3} to {:.3} with up to {:.1}° of phase: the disk margin is {:.3}{}, and \
             below {DISK} (a factor of 1.5, 23°) small errors of the model are too much",
            of(one),
            one.disk_gain[0],
            one.disk_gain[1],
            one.disk_phase.to_degrees(),
            one.disk,
            at(one.disk_frequency)
        )
    }));
    out.extend(found.channels.iter().filter_map(late));
    let common = found.gain_margin.as_ref().filter(|_| out.is_empty());
    if let Some([down, up]) = common.filter(|[down, up]| down.value > 1.0 / HARDLY || up.value < HARDLY) {
        let motion = if up.value < HARDLY { &up.motion } else { &down.motion };
        out.push(format!(
            "stable, but hardly: its torques may be wrong by factors from {:.4} to {:.4} only{}",
            down.value,
            up.value,
            because(motion)
        ));
    }
    // All at once are never better than each alone: said where they are much worse.
    let alone = found.channels.iter().map(|one| one.disk).fold(f64::INFINITY, f64::min);
    let worse = |all: &&TogetherMargin| all.disk[1] < DISK_TOGETHER && (out.is_empty() || all.disk[1] < WORSE * alone);
    if let Some(all) = found.together.as_ref().filter(worse) {
        out.push(format!(
            "{}; below {DISK_TOGETHER} (a factor of 1.22, 11°) small errors of the model are too much",
            at_once(all)
        ));
    }
    out
}

/// Of which channel something is said.
fn of(one: &ChannelMargin) -> String {
    if one.reading { format!("the reading `{}`", one.name) } else { format!("the torque of `{}`", one.name) }
}

/// Whether factors within 10 %, together with the turn of the phase that goes with them (5.5°), are more than a channel bears.
fn hardly(one: &ChannelMargin) -> bool {
    [one.gain, one.disk_gain].iter().any(|[low, high]| *low > 1.0 / HARDLY || *high < HARDLY)
}

/// A channel that a small factor, or a small turn of the phase, makes unstable.
fn close(one: &ChannelMargin) -> Option<String> {
    let ([low, high], what) = (one.gain, of(one));
    let (factor, frequency) =
        if high.ln() < -low.ln() { (high, one.gain_frequency[1]) } else { (low, one.gain_frequency[0]) };
    let prefix = if hardly(one) { "stable, but hardly: " } else { "" };
    if low > 1.0 / HARDLY || high < HARDLY {
        Some(format!("{prefix}{what} times {factor:.4} makes the loop unstable{}", at(frequency)))
    } else if one.phase < PHASE {
        Some(format!(
            "{prefix}{:.1}° of phase in {what} make the loop unstable{}",
            one.phase.to_degrees(),
            at(one.phase_frequency)
        ))
    } else {
        hardly(one).then(|| {
            format!(
                "{prefix}{what} may be wrong by no more than factors from {:.4} to {:.4} with up to {:.1}° of phase{}",
                one.disk_gain[0],
                one.disk_gain[1],
                one.disk_phase.to_degrees(),
                at(one.disk_frequency)
            )
        })
    }
}

/// A motor that may be late by a small part of its own time only.
fn late(one: &ChannelMargin) -> Option<String> {
    let (delay, own) = (one.delay?, one.own_time?);
    (delay < LATE * own).then(|| {
        format!(
            "{} may come {} later, no more{}: that is {:.1} % of {}",
            of(one),
            time(delay),
            at(one.delay_frequency),
            100.0 * delay / own,
            if one.sampled {
                format!("one sample, {}", time(own))
            } else {
                format!("the lag of its motor, {}", time(own))
            },
        )
    })
}

/// Warnings of `check` and of every run: loops that a small error of one motor makes unstable, and loops in continuous time that
/// are not stable.
pub(super) fn check_margins(variant: &PreparedVariant, out: &mut Vec<Diagnostic>) {
    if variant.model.controls.is_empty() {
        return;
    }
    let (laws, clocks, plant) = (&variant.designed, clocks(&variant.model.controls), linear(variant));
    let continuous = clocks.iter().all(Option::is_none) && laws.iter().all(|law| law.clock().is_none());
    for (number, control) in variant.model.controls.iter().enumerate() {
        let survey = Survey { plant: &plant, laws, clocks: &clocks, number };
        let Some(found) = survey.slowest(survey.unchanged()) else { continue };
        let stable = if continuous {
            // Only what floating point takes for zero needs more.
            let exact = (found.left_out > 0).then(|| exact_motions(&model_of(variant), &plant.lags, laws)).flatten();
            Known::of(&found, exact.as_ref(), &plant, laws, true).stable
        } else {
            found.stable
        };
        if !stable {
            if continuous && number == 0 {
                let message = format!(
                    "in continuous time the loop is unstable: a motion at {:.4} rad/s grows (linear loop, lag of the motors included)",
                    found.frequency
                );
                let told = Diagnostic::warning("control::grows", message).at(control.place.clone(), "in this loop");
                out.push(told.help("`kardan design` lists the poles and what the loop tolerates"));
            }
            continue;
        }
        let Some(response) = survey.motors() else { continue };
        if (0..response.channels()).all(|motor| response.channel(motor).holds_disk(CLOSE)) {
            continue;
        }
        for message in of_motors(&survey, Some(&response), false).iter().filter(|one| hardly(one)).filter_map(close) {
            let message = format!("control `{}`: {message}", control.name);
            let told = Diagnostic::warning("control::hardly", message).at(control.place.clone(), "this controller");
            out.push(told.help(
                "ask for less bandwidth, or a shorter lag, delay or sample time; `kardan design` shows all margins",
            ));
        }
    }
}

fn at(frequency: Option<f64>) -> String {
    match frequency {
        None => String::new(),
        Some(0.0) => ", at rest".into(),
        Some(frequency) if frequency.is_finite() => format!(", at {frequency:.4} rad/s"),
        Some(_) => ", at infinite frequency".into(),
    }
}

/// A time in words.
fn time(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{:.1} us", 1e6 * s),
        s if s < 1.0 => format!("{:.3} ms", 1e3 * s),
        s => format!("{s:.3} s"),
    }
}

/// The margin of all motors at once in words.
fn at_once(found: &TogetherMargin) -> String {
    let worst: Vec<String> = found
        .worst
        .iter()
        .map(|one| format!("`{}` × {:.3} ∠ {:.1}°", one.motor, one.factor, one.turn.to_degrees()))
        .collect();
    format!(
        "with errors of all its motors at once the disk margin is between {:.4} and {:.4}: {} make the loop unstable{}",
        found.disk[0],
        found.disk[1],
        worst.join(", "),
        at(Some(found.frequency))
    )
}

/// The motion at a frequency in words; that of the zero dynamics by this name.
fn motion(limit: &Limit, design: &Design) -> String {
    if !limit.value.is_finite() || limit.value == 0.0 {
        return String::new();
    }
    if limit.frequency == 0.0 {
        return "a motion without oscillation".into();
    }
    let near = |frequency: f64| (frequency / limit.frequency).ln().abs() < SAME_MOTION;
    let zero = design.zero_dynamics.modes.iter().find(|mode| mode.pole.im != 0.0 && near(mode.natural_frequency));
    match zero {
        Some(mode) if design.cancels_zeros => {
            format!("the zero dynamics ({:.4} rad/s, damping ratio {:.3})", mode.natural_frequency, mode.damping_ratio)
        }
        _ => format!("a motion at {:.4} rad/s", limit.frequency),
    }
}

/// The paragraph: what sampling leaves of this design.
pub(super) fn verdict(margins: &Margins) -> String {
    let mut out = Vec::new();
    let hertz = |rate: f64| {
        if rate >= 1000.0 { format!("{:.2} kHz", rate / 1000.0) } else { format!("{rate:.3} Hz") }
    };
    match (margins.sample_time, margins.stable) {
        (Some(period), stable) => out.push(format!(
            "Sampled every {} with a delay of {} the loop is {}{}.",
            time(period),
            time(margins.delay),
            match stable {
                Some(true) => "stable",
                Some(false) => "UNSTABLE",
                None =>
                    "not judged: the sample times of all controllers and sensors have no short common period, \
                         simulate it",
            },
            margins.spectral_radius.map_or(String::new(), |rho| format!(" (spectral radius {rho:.5})"))
        )),
        (None, stable) => out.push(format!(
            "In continuous time the loop is {}{}.",
            match stable {
                Some(true) => "stable",
                Some(false) => "UNSTABLE",
                None => "not judged: its eigenvalues could not be computed, simulate it",
            },
            match stable {
                None => "",
                _ if margins.proven => " (decided exactly)",
                _ => " (eigenvalues in floating point, their rounding bounded)",
            }
        )),
    }
    if margins.free_poles > 0 {
        let poles = if margins.free_poles == 1 { "pole".to_string() } else { "poles".into() };
        let of = if margins.free.is_empty() { "its own states".into() } else { list(&margins.free) };
        let how = match margins.free_known {
            FreeKnown::Design => "exactly (over the rationals, with the gains before they are rounded)".to_string(),
            FreeKnown::Rounded => "exactly (over the rationals, with the gains as they are rounded)".into(),
            FreeKnown::Within(size) => format!("to the rounding of the loop (below {size:.0e} 1/s)"),
        };
        out.push(format!(
            "Nobody holds a motion of {of}: {} {poles} at zero, {how}, left out of all that is said here.",
            margins.free_poles
        ));
        if margins.drift > 0.0 {
            out.push(format!(
                "At this sample time it does not stay quite free: left alone it grows with {:.2e} 1/s.",
                margins.drift
            ));
        }
    }
    if !margins.next_to_zero.is_empty() {
        let all: Vec<String> = margins.next_to_zero.iter().map(|re| format!("{re:.2e}")).collect();
        out.push(format!(
            "Not at zero, but too close to it for floating point, which would take it for zero: {} 1/s; this was decided exactly, and \
             limits are told without it.",
            all.join(", ")
        ));
    }
    let rate = |delay: f64| margins.rates.iter().find(|rate| rate.delay == delay);
    if let (Some(without), Some(with)) = (rate(0.0), rate(1.0)) {
        let said = |limit: &RateLimit| match limit.rate {
            Some(0.0) => "any rate".to_string(),
            Some(rate) => hertz(rate),
            None => "more than 1 MHz".into(),
        };
        out.push(format!(
            "It needs {} without delay (or with a predictor for it) and {} with one sample of delay{}.",
            said(without),
            said(with),
            because(&with.motion)
        ));
    }
    if let Some(delay) = &margins.longest_delay {
        out.push(match delay.value {
            value if value.is_finite() => {
                format!("At this sample time it tolerates a delay of {}{}.", time(value), because(&delay.motion))
            }
            _ => "No delay of up to ten samples makes it unstable.".into(),
        });
    }
    if let Some(lag) = &margins.longest_lag {
        out.push(match lag.value {
            value if value.is_finite() => {
                format!("A lag of {} of its motors is just tolerated{}.", time(value), because(&lag.motion))
            }
            _ => "A lag of its motors does not make it unstable.".into(),
        });
    }
    if let Some([down, up]) = &margins.gain_margin {
        let up_to = if up.value.is_finite() { format!("{:.3}", up.value) } else { "100 and more".into() };
        let motion = if up.motion.is_empty() { &down.motion } else { &up.motion };
        out.push(format!("Its torques may be wrong by factors from {:.3} to {up_to}{}.", down.value, because(motion)));
    }
    let motors = margins.channels.iter().filter(|one| !one.reading);
    if let Some(worst) = motors.min_by(|a, b| a.disk.total_cmp(&b.disk)) {
        out.push(format!(
            "The least disk margin of a motor is {:.3} (`{}`{}): factors from {:.3} to {:.3} with {:.1}° of phase.",
            worst.disk,
            worst.name,
            at(worst.disk_frequency),
            worst.disk_gain[0],
            worst.disk_gain[1],
            worst.disk_phase.to_degrees()
        ));
        if worst.searched {
            out.push(
                "With several clocks these margins of its motors are searched on the exact map over the common period, each for an \
                 error that is the same at each sample: factor and delay in steps, phase every 5°, the disk in 25 directions. Those \
                 of readings, and of all motors at once, are not known."
                    .into(),
            );
        }
    } else if margins.stable == Some(true) {
        out.push(
            "Margins of single motors and readings are not known: of a loop with several clocks those of sampled controllers are, if \
             the clocks have a short common period."
                .into(),
        );
    }
    if let Some(all) = &margins.together {
        let said = at_once(all);
        out.push(format!("W{}.", &said[1..]));
    }
    for peak in margins.peaks.iter().filter(|peak| peak.limit.is_some_and(|limit| peak.peak > limit * (1.0 + 1e-9))) {
        let limit = peak.limit.unwrap_or_default();
        out.push(format!(
            "A step of {} by {} {} asks {:.3} N m of {}, which has {limit} N m: filter the reference, or ask for {:.3} {}.",
            peak.reference,
            peak.step,
            peak.step_unit,
            peak.peak,
            peak.input,
            peak.step * limit / peak.peak,
            peak.step_unit
        ));
    }
    out.join(" ")
}

/// `a, b and c`
fn list(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => format!("`{one}`"),
        [first @ .., last] => {
            let first: Vec<String> = first.iter().map(|name| format!("`{name}`")).collect();
            format!("{} and `{last}`", first.join(", "))
        }
    }
}

fn because(motion: &str) -> String {
    if motion.is_empty() { String::new() } else { format!(", because of {motion}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel that bears everything.
    fn good(name: &str) -> ChannelMargin {
        ChannelMargin {
            name: name.into(),
            gain: [0.2, 5.0],
            phase: 1.0,
            delay: Some(0.1),
            disk: 1.0,
            disk_gain: [1.0 / 3.0, 3.0],
            disk_phase: 0.9,
            own_time: Some(0.01),
            ..ChannelMargin::default()
        }
    }

    /// Motors that each alone bear everything, and at once nothing, are warned of; also beside a channel with a warning of its own.
    #[test]
    fn all_at_once_are_not_overlooked() {
        let together = TogetherMargin {
            disk: [0.05, 0.0501],
            frequency: 3.0,
            worst: vec![WrongTorque { motor: "a".into(), factor: 1.05, turn: 0.0 }],
        };
        let found =
            Margins { channels: vec![good("a"), good("b")], together: Some(together.clone()), ..Margins::default() };
        let said = warnings(&found);
        assert!(
            matches!(&said[..], [one] if one.contains("errors of all its motors at once") && one.contains("3.0000 rad/s"))
        );
        let beside = Margins {
            channels: vec![ChannelMargin { disk: 0.3, ..good("a") }, good("b")],
            together: Some(together.clone()),
            ..Margins::default()
        };
        assert_eq!(warnings(&beside).len(), 2);
        // What follows from one channel alone is not said twice.
        let same = Margins {
            channels: vec![ChannelMargin { disk: 0.055, ..good("a") }, good("b")],
            together: Some(together),
            ..Margins::default()
        };
        assert_eq!(warnings(&same).len(), 1);
        assert!(warnings(&Margins { channels: vec![good("a")], ..Margins::default() }).is_empty());
    }
}
