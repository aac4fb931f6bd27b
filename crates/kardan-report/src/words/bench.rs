//! A study on a virtual bench in sentences.

use crate::text::number;
use kardan::results::{BenchPlan, BenchStudy, ClosedLoop, Found, Interval, Response, TrueValue, Verdict};

/// What came of it in one sentence; `true` if every run went to its end and every interval holds the true value.
pub fn verdict(study: &BenchStudy) -> Verdict {
    let compared = compared(study);
    let held = compared.iter().filter(|(found, truth)| inside(found, truth.value)).count();
    let whole = study.closed_loop.notes.is_empty();
    let ran = if whole { "every run went to its end" } else { "some runs ended early" };
    let text = format!(
        "{held} of {} intervals hold the true value; under `{}` {ran}.",
        compared.len(),
        study.closed_loop.design.controller
    );
    Verdict { sound: whole && held == compared.len(), text }
}

/// Parameters that were found and whose true values are known.
pub fn compared(study: &BenchStudy) -> Vec<(&Found, &TrueValue)> {
    let truth = |found: &Found| study.truth.iter().find(|one| one.name == found.name && found.combination.is_empty());
    study.identification.parameters.iter().filter_map(|found| Some((found, truth(found)?))).collect()
}

/// Whether the interval of a parameter holds a value.
pub fn inside(found: &Found, value: f64) -> bool {
    found.interval.is_some_and(|it| (it.lower..=it.upper).contains(&value))
}

/// A parameter as a row: name, unit, before, true, found, interval, whether that holds the true value.
pub fn parameter(found: &Found, truth: &TrueValue) -> [String; 7] {
    [
        found.name.clone(),
        found.unit.into(),
        found.before.map_or("–".into(), number),
        number(truth.value),
        number(found.value.unwrap_or(f64::NAN)),
        {
            let Interval { lower, upper } = found.interval.unwrap_or(Interval { lower: f64::NAN, upper: f64::NAN });
            format!("{} … {}", number(lower), number(upper))
        },
        if inside(found, truth.value) { "holds it".into() } else { "does not".into() },
    ]
}

/// The plan in sentences.
pub fn plan(plan: &BenchPlan) -> Vec<String> {
    let mut out = vec![
        format!(
            "{}: {} points of {} that keep the limits, {} s in all.",
            plan.kind.replace('_', " "),
            plan.points.len(),
            plan.candidates,
            number(plan.duration)
        ),
        format!(
            "ln det(XᵀX) = {}; as many points of all candidates alike have {}: for the same precision the undesigned plan takes {} \
             times as long.",
            number(plan.log_det),
            number(plan.undesigned_log_det),
            number(plan.gain)
        ),
    ];
    if !plan.known.is_empty() {
        out.push(format!("Taken from the model: {}.", plan.known.join(", ")));
    }
    out
}

/// An output under a step as a row: output, unit, settled in the simulation and on the bench, farthest from the reference in both,
/// largest distance between them and when.
pub fn response(one: &Response) -> [String; 8] {
    [
        one.output.clone(),
        one.physical.unit().into(),
        number(one.settled.simulation),
        number(one.settled.bench),
        number(one.farthest.simulation),
        number(one.farthest.bench),
        number(one.distance),
        number(one.distance_at),
    ]
}

/// Differences that make less than this part of the largest one are not named in a sentence.
const SMALL: f64 = 0.1;
/// Distances below this part of what the output does elsewhere are those of rounding.
const ROUNDING: f64 = 1e-6;

/// What makes the bench differ from the simulation, a sentence for each output that does.
pub fn causes(found: &ClosedLoop) -> Vec<String> {
    let mut out = Vec::new();
    let everywhere = || found.experiments.iter().flat_map(|experiment| &experiment.responses);
    let size = |output: &str| {
        everywhere().filter(|one| one.output == output).map(|one| one.farthest.bench).fold(0.0_f64, f64::max)
    };
    for experiment in &found.experiments {
        let differs = |one: &&Response| one.distance > ROUNDING * size(&one.output);
        for one in experiment.responses.iter().filter(differs) {
            let unit = one.physical.unit();
            let mut by: Vec<_> = one.differences.iter().filter_map(|by| Some((&by.what, by.alone?))).collect();
            by.sort_by(|a, b| b.1.total_cmp(&a.1));
            let least = by.first().map_or(0.0, |first| SMALL * first.1);
            by.retain(|by| by.1 > least);
            let by: Vec<String> = by.iter().map(|(what, alone)| format!("{what} ({})", number(*alone))).collect();
            let by = match by.is_empty() {
                true => "nothing makes any of it alone".to_string(),
                false => format!("alone make {}", by.join("; ")),
            };
            out.push(format!(
                "{}, {}: the bench is up to {} {unit} from the simulation; {by}.",
                experiment.name,
                one.output,
                number(one.distance)
            ));
        }
    }
    out
}
