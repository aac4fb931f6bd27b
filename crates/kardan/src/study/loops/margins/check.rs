//! Errors and warnings of loops before a run.

use super::channels::of_motors;
use super::clocks::clocks;
use super::stability::StabilityProblem;
use super::survey::{excluded, format_motion, searches};
use super::warnings::{CLOSE, close, low_margins};
use crate::study::PreparedVariant;
use crate::study::check::effort::MOST_STATES;
use crate::study::loops::loop_blocks::{self, MOST_CONTROLLERS, TooLarge};
use kardan_math::num::multiply;
use kardan_model::ControlSpec;
use kardan_results::{Stability, StabilityVerdict};
use kardan_schema::diagnostics::{Diagnostic, Severity, quoted};
use kardan_simulate::Profile;
use kardan_synthesis::{LoopBlocks, LoopPlant, SampledLoop, SampledPart, Slowest, Survey};

/// Codes of errors that `--force` overrules.
const FORCED: [&str; 2] = [UNSTABLE, LIMIT];

/// Errors that only protect the user from a bad run become warnings.
pub fn overrule(diagnostics: &mut [Diagnostic]) {
    for diagnostic in diagnostics.iter_mut().filter(|diagnostic| FORCED.contains(&diagnostic.code)) {
        diagnostic.severity = Severity::Warning;
    }
}

/// An unstable loop.
pub(in crate::study) const UNSTABLE: &str = "control::unstable";
/// A reference that no motor can reach.
const LIMIT: &str = "control::limit";
/// Largest relative change of a torque between its samples, if it has settled.
const SETTLED: f64 = 0.01;
/// Fractions of the time from the last change of a reference to the end of the run.
const CHECK_TIMES: [f64; 5] = [0.6, 0.7, 0.8, 0.9, 1.0];
/// Least number of periods of the map in that time.
const FEWEST: f64 = 50.0;

/// The warning of a loop with so many states or controllers that it is not examined before a run.
pub(in crate::study) fn check_size(variant: &PreparedVariant) -> Option<Diagnostic> {
    let control = variant.model.controls.first()?;
    let (size, most) = match loop_blocks::too_large(variant)? {
        TooLarge::Controllers(count) => {
            (format!("the loop has {count} controllers"), format!("{MOST_CONTROLLERS} controllers"))
        }
        TooLarge::States(count) => {
            (format!("the laws and blocks of the loop have {count} states"), format!("{MOST_STATES} states"))
        }
    };
    let message =
        format!("{size}: kardan examines before a run whether a loop of up to {most} is stable, and what it tolerates");
    let warning = Diagnostic::warning("control::large-loop", message).at(&control.place, "in this loop");
    Some(warning.help("a run shows the motion; `kardan design` examines the loop, which takes long"))
}

/// Sampled controllers, slow sensors and blocks of a loop with their times, as text.
fn multiloop(variant: &PreparedVariant, parts: &[SampledPart]) -> Vec<String> {
    let controls = variant.model.controls.iter().zip(parts);
    let sampled = controls.filter_map(|(control, part)| Some((control, part.clock?.period)));
    let mut out: Vec<String> =
        sampled.map(|(control, period)| format!("control `{}` ({period} s)", control.name)).collect();
    let mut slow: Vec<_> = parts.iter().flat_map(|part| &part.slow).map(|(_, sensor)| sensor).collect();
    slow.sort_by(|a, b| a.name.cmp(&b.name));
    slow.dedup_by(|a, b| a.name == b.name);
    out.extend(slow.iter().map(|sensor| format!("sensor `{}` ({} s)", sensor.name, sensor.period)));
    let blocks = parts.iter().skip(variant.model.controls.len());
    let mut periods: Vec<f64> = blocks.filter_map(|part| Some(part.clock?.period)).collect();
    periods.sort_by(f64::total_cmp);
    periods.dedup();
    out.extend(periods.iter().map(|period| format!("blocks ({period} s)")));
    out
}

/// The errors of sampled controllers whose loop is unstable, with the spectral radius of the exact sampled loop.
pub(in crate::study) fn check_sampled(variant: &PreparedVariant, out: &mut Vec<Diagnostic>) {
    let clocks = clocks(&variant.model.controls);
    let period = |place: &usize| clocks[*place].map_or(0.0, |clock| clock.period);
    // Of several the slowest one, as it gains the most.
    let places = (0..clocks.len()).rev().filter(|place| clocks[*place].is_some());
    let Some(place) = places.max_by(|a, b| period(a).total_cmp(&period(b))) else { return };
    let control = &variant.model.controls[place];
    let plant = variant.loop_plant();
    let parts = variant.implemented.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    let between = loop_blocks::blocks(variant, &plant);
    let parts = between.of_loop.join(parts);
    let all = multiloop(variant, &parts);
    let free = excluded(variant, place, &plant);
    let judged = SampledLoop::new(&plant, &parts).map_err(|why| why.to_string());
    let judged = judged.and_then(|found| {
        let slowest = found.slowest_excluding(free).ok_or("the eigenvalue iteration failed")?;
        Ok((slowest, found.sample_time))
    });
    let (slowest, sample_time) = match judged {
        Ok(judged) => judged,
        Err(why) => {
            let message = format!("whether the sampled loop is stable is not decided: {why} ({})", all.join(", "));
            let help = "choose times whose common period is a small multiple of the shortest; a run shows what \
                        happens";
            let warning =
                Diagnostic::warning("control::no-common-period", message).at(&control.place, "this controller");
            out.push(warning.help(help));
            return;
        }
    };
    let has_blocks = !between.of_loop.is_empty();
    // Of a loop that is clearly stable there is nothing to report.
    if slowest.word == Stability::Stable && slowest.excluded == 0 {
        check_limits(variant, &plant, &parts, out);
        return;
    }
    let problem = StabilityProblem { variant, plant: &plant, parts: &parts, has_blocks };
    let decided = problem.decide(&slowest, problem.exact(&slowest).as_ref());
    // Polynomial growth is not exponential, and growth below the resolution of floating point is slow: a run shows both.
    let is_slow = slowest.stable || decided.verdict.border.iter().any(|motion| motion.grows());
    if decided.controlled != Stability::Unstable || is_slow {
        if decided.controlled != Stability::Stable {
            out.push(on_the_border(&control.name, &decided.verdict).at(&control.place, "this controller"));
        }
        check_limits(variant, &plant, &parts, out);
        return;
    }
    let who = match all.as_slice() {
        [_] => format!("control `{}`: at this sample time the loop is unstable", control.name),
        all => format!("at these sample times the loop is unstable: {} together", all.join(", ")),
    };
    let how = describe_growth(&decided.verdict, &slowest, sample_time);
    let message = format!("{who}: {how} (exact map of the linear loop, delay and lag included)");
    let help = match all.as_slice() {
        [_] if control.law.samples => {
            "choose a shorter `sample_time` or `delay`, or less `effort`; `--force` runs it as it is"
        }
        [_] => {
            "choose a shorter `sample_time` or `delay`, or `law = \"sampled_noninteracting\"`, which is designed for \
             them; `kardan design` without `sample_time` reports the slowest stable rate, `--force` runs it as it is"
        }
        _ => "choose shorter times, the longest one first; `--force` runs it as it is",
    };
    let at = |diagnostic: Diagnostic| diagnostic.at(&control.place, "unstable at this sample time");
    // Blocks that saturate or switch act differently once the motion has grown: kardan only warns.
    if between.nonlinear && has_blocks {
        let names = quoted(between.of_loop.names());
        let message = format!("{message}; the loop closes through the blocks {names}, linearised at rest");
        out.push(
            at(Diagnostic::warning(UNSTABLE, message))
                .help("a run shows how the motion develops; `kardan design` shows the loop"),
        );
        return;
    }
    out.push(at(Diagnostic::error(UNSTABLE, message)).help(help));
}

/// Which motion of a sampled loop grows, and how.
fn describe_growth(verdict: &StabilityVerdict, slowest: &Slowest, sample_time: f64) -> String {
    match verdict.border.iter().find(|motion| motion.grows()) {
        Some(motion) => motion.to_string(),
        None => format!(
            "{} grows by the factor {:.6} in each of the {:.0} samples a second",
            format_motion(slowest.frequency),
            slowest.growth,
            1.0 / sample_time
        ),
    }
}

/// The errors of references that demand more torque than a motor has: at their values at the end of the run, once the linear
/// loop has settled.
fn check_limits(variant: &PreparedVariant, plant: &LoopPlant, parts: &[SampledPart], out: &mut Vec<Diagnostic>) {
    let Ok(found) = SampledLoop::driven(plant, parts, 1.0) else { return };
    let (laws, scenario) = (&variant.implemented, &variant.scenario);
    // A source that follows a function of time does not settle.
    if !scenario.signals.is_empty() {
        return;
    }
    let changed = scenario.events.iter().map(|event| event.at + event.over).filter(|end| *end < scenario.duration);
    let periods = (scenario.duration - changed.fold(0.0, f64::max)) / found.period;
    if periods < FEWEST {
        return;
    }
    let maps = CHECK_TIMES.map(|part| found.after((part * periods) as usize));
    let end = |name: &str| {
        let source = scenario.sources.iter().position(|source| source.name == name)?;
        Some(Profile::new(scenario.events.iter().filter(|event| event.source == source)).value(scenario.duration))
    };
    let mut z = vec![0.0; found.map.rows()];
    let mut values = Vec::new();
    for (law, first) in laws.iter().zip(&found.references) {
        for (k, reference) in law.references().iter().enumerate() {
            let value = end(&reference.name).unwrap_or(0.0);
            z[first + k] = value;
            if value != 0.0 {
                values.push(format!("`{}` = {value} {}", reference.name, reference.physical.unit()));
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
            let needed = command(&ends[CHECK_TIMES.len() - 1]);
            let limit = variant.whole_model(number).torque_limit(input);
            let Some(limit) = limit.filter(|limit| needed.abs() > limit * (1.0 + 1e-6)) else { continue };
            if ends.iter().any(|z| (command(z) - needed).abs() > SETTLED * needed.abs()) {
                continue;
            }
            let control = &variant.model.controls[number];
            let message = format!(
                "control `{}`: with {} the motor `{name}` would have to give {:.4} N m in steady state, and its \
                 limit is {limit} N m: the reference can never be reached",
                control.name,
                values.join(" and "),
                needed.abs()
            );
            let help = format!(
                "request at most {:.3} times as much, or choose a stronger motor; `--force` runs it",
                limit / needed.abs()
            );
            out.push(Diagnostic::error(LIMIT, message).at(&control.place, "this controller").help(help));
        }
    }
}

/// The warning that a loop in continuous time is not stable, or not known to be.
fn not_stable(control: &ControlSpec, verdict: &StabilityVerdict, frequency: f64) -> Diagnostic {
    let warning = match verdict.word {
        Stability::Unstable => {
            let how = match verdict.border.iter().find(|motion| motion.grows()) {
                Some(motion) => motion.to_string(),
                None => format!("{} grows", format_motion(frequency)),
            };
            let message =
                format!("in continuous time the loop is unstable: {how} (linear loop, lag of the motors included)");
            Diagnostic::warning("control::unstable-continuous", message)
        }
        _ => on_the_border(&control.name, verdict),
    };
    let warning = warning.at(&control.place, "in this loop");
    warning.help("`kardan design` lists the poles and what the loop tolerates")
}

/// The warning that a loop is marginal, or not known to be stable.
fn on_the_border(control: &str, verdict: &StabilityVerdict) -> Diagnostic {
    let message = format!("control `{control}`: stability of the loop: {verdict}");
    Diagnostic::warning("control::stability-undecided", message)
}

/// Warnings of `check` and of every run: loops that a small error of one motor makes unstable, and loops in continuous time that
/// are not stable.
pub(in crate::study) fn check_margins(variant: &PreparedVariant, out: &mut Vec<Diagnostic>) {
    if variant.model.controls.is_empty() {
        return;
    }
    let (laws, clocks, plant) = (&variant.designed, clocks(&variant.model.controls), variant.loop_plant());
    let continuous = clocks.iter().all(Option::is_none) && laws.iter().all(|law| law.clock().is_none());
    let (blocks, no_blocks) = (loop_blocks::blocks(variant, &plant).of_loop, LoopBlocks::default());
    for (number, control) in variant.model.controls.iter().enumerate() {
        let survey = Survey { plant: &plant, laws, clocks: &clocks, number, blocks: &blocks };
        let Some(found) = survey.slowest(survey.unchanged()) else { continue };
        let parts = survey.parts().map_or_else(Vec::new, |(parts, _)| parts);
        let problem = StabilityProblem { variant, plant: &plant, parts: &parts, has_blocks: !blocks.is_empty() };
        // `check_sampled` reports sampled loops; only verdicts that floating point cannot decide need more.
        let is_sure = found.excluded == 0 && found.word == Stability::Stable;
        let decided = if is_sure { None } else { Some(problem.decide(&found, problem.exact(&found).as_ref())) };
        let controlled = decided.as_ref().map_or(Stability::Stable, |decided| decided.controlled);
        if controlled != Stability::Stable {
            if let (true, Some(decided)) = (continuous && number == 0, decided) {
                out.push(not_stable(control, &decided.verdict, found.frequency));
            }
            continue;
        }
        let survey = Survey { blocks: if searches(&blocks, clocks[number]) { &blocks } else { &no_blocks }, ..survey };
        let Some(response) = survey.motors() else { continue };
        if (0..response.channels()).all(|motor| response.channel(motor).satisfies_disk(CLOSE)) {
            continue;
        }
        for message in
            of_motors(&survey, Some(&response), false).iter().filter(|one| low_margins(one)).filter_map(close)
        {
            let message = format!("control `{}`: {message}", control.name);
            out.push(Diagnostic::warning("control::low-margins", message).at(&control.place, "this controller").help(
                "request less bandwidth, or choose a shorter lag, delay or sample time; `kardan design` shows all \
                 margins",
            ));
        }
    }
}
