//! A run with a fault beside the one without it: detection, effects and verdict.

use crate::study::measure::measures::{Window, measured};
use crate::study::requests::safety_spec::{Effect, SafetySpec};
use kardan_results::{EffectMeasured, Outcome, Run, SafetyRow, SafetyVerdict, StateEntered};

/// The evaluated signals of a run.
pub(super) struct Traces {
    pub(super) time: Vec<f64>,
    pub(super) failed: Option<String>,
    detected: Option<Vec<f64>>,
    reaction: Option<Vec<f64>>,
    effects: Vec<Vec<f64>>,
    monitors: Vec<Vec<f64>>,
}

impl Traces {
    pub(super) fn of(run: Run, spec: &SafetySpec) -> Self {
        let failed = match &run.outcome {
            Outcome::Completed => None,
            Outcome::Unbalanced { cause } => Some(cause.clone()),
            Outcome::Failed { time, cause } => Some(format!("the run ended at {time:.6} s: {cause}")),
        };
        let values = |name: &str| run.series.signal(name).map(|signal| signal.values.clone()).unwrap_or_default();
        Self {
            failed,
            detected: spec.detected.as_deref().map(values),
            reaction: spec.reaction.as_ref().map(|(block, _)| values(block)),
            effects: spec.effects.iter().map(|effect| values(&effect.signal)).collect(),
            monitors: spec.monitors.iter().map(|name| values(name)).collect(),
            time: run.series.time,
        }
    }

    /// The first row in which a condition is true.
    pub(super) fn alarm(&self) -> Option<usize> {
        self.detected.as_ref()?.iter().position(|value| is_true(*value))
    }

    /// Numbers of the monitors raised at any time.
    pub(super) fn raised(&self) -> impl Iterator<Item = usize> {
        let raised =
            |(number, values): (usize, &Vec<f64>)| values.iter().any(|value| is_true(*value)).then_some(number);
        self.monitors.iter().enumerate().filter_map(raised)
    }

    /// Monitors raised at times without an alarm in the fault-free run.
    pub(super) fn raised_beside(&self, free: &Self, begins: f64) -> Vec<usize> {
        let first = self.first(begins);
        let differs = |(values, fault_free): (&Vec<f64>, &Vec<f64>)| {
            values.iter().zip(fault_free).skip(first).any(|(value, reference)| is_true(*value) && !is_true(*reference))
        };
        let both = self.monitors.iter().zip(&free.monitors).enumerate();
        both.filter_map(|(number, both)| differs(both).then_some(number)).collect()
    }

    /// The first row at or after a time.
    fn first(&self, time: f64) -> usize {
        self.time.partition_point(|at| *at < time * (1.0 - 1e-12))
    }
}

fn is_true(value: f64) -> bool {
    value > 0.5
}

/// Time since the last fault that started before a row.
fn since([first, last]: [f64; 2], time: f64) -> f64 {
    (time - if time >= last * (1.0 - 1e-12) { last } else { first }).max(0.0)
}

/// The row of a run with a fault, judged; `begins`: when the first and the last fault begin.
pub(super) fn judge(spec: &SafetySpec, run: &Traces, free: &Traces, begins: [f64; 2], row: SafetyRow) -> SafetyRow {
    let first = run.first(begins[0]);
    let at = detection(run, free, first);
    let detected_after = at.map(|row| since(begins, run.time[row]));
    let detection_resolution = at.map(|row| {
        let before = row.checked_sub(1).map_or(0.0, |before| run.time[row] - run.time[before]);
        before.min(since(begins, run.time[row]))
    });
    let one =
        |(k, effect): (usize, &Effect)| measure(effect, (&run.effects[k], &free.effects[k]), run, (first, begins));
    let found: Vec<Result<f64, &str>> = spec.effects.iter().enumerate().map(one).collect();
    let pairs = spec.effects.iter().zip(&found);
    let effects: Vec<EffectMeasured> = pairs.map(|(effect, found)| measured_effect(effect, found.ok())).collect();
    let in_time =
        detected_after.is_some_and(|after| spec.detection_time_limit.is_none_or(|limit| after <= limit * (1.0 + 1e-9)));
    let verdict = match run.failed.as_ref().or(free.failed.as_ref()) {
        Some(_) => SafetyVerdict::Failed,
        None => verdict(&effects, in_time, detected_after.is_some()),
    };
    let mut notes: Vec<String> = run.failed.iter().cloned().collect();
    notes.extend(free.failed.as_ref().map(|why| format!("without the fault {why}")));
    for (effect, found) in spec.effects.iter().zip(&found) {
        notes.extend(found.err().map(|why| format!("{}: {why}", effect.definition.name)));
    }
    if run.failed.is_none() && before(run, free, first) {
        notes.push("the detection condition is true before the fault begins, with and without it".into());
    }
    SafetyRow {
        fault_time: Some(begins[0]),
        detection_time: detected_after,
        detection_resolution,
        reaction: reaction(spec, run, free, (first, begins)),
        worst: worst(spec, &effects),
        effects,
        verdict,
        note: (!notes.is_empty()).then(|| notes.join("; ")),
        ..row
    }
}

fn verdict(effects: &[EffectMeasured], in_time: bool, ever: bool) -> SafetyVerdict {
    let harmful = effects.iter().any(|effect| effect.within_bounds == Some(false));
    let bounded = effects.iter().any(|effect| effect.within_bounds.is_some());
    match (in_time, harmful) {
        (true, false) => SafetyVerdict::Detected,
        (true, true) => SafetyVerdict::DetectedHarmful,
        (false, true) if ever => SafetyVerdict::LateHarmful,
        (false, true) => SafetyVerdict::Harmful,
        (false, false) if bounded && ever => SafetyVerdict::LateHarmless,
        (false, false) if bounded => SafetyVerdict::Harmless,
        (false, false) => SafetyVerdict::NotDetected,
    }
}

/// The first row after the start in which the condition is true, and is not true without the fault.
fn detection(run: &Traces, free: &Traces, first: usize) -> Option<usize> {
    let (found, fault_free) = (run.detected.as_ref()?, free.detected.as_ref()?);
    let in_fault_free = |row: usize| fault_free.get(row).is_some_and(|value| is_true(*value));
    (first..found.len()).find(|row| is_true(found[*row]) && !in_fault_free(*row))
}

/// Whether the condition is true at the last row before the fault.
fn before(run: &Traces, free: &Traces, first: usize) -> bool {
    let row = first.checked_sub(1);
    let at = |traces: &Traces| row.and_then(|row| traces.detected.as_ref()?.get(row).copied()).is_some_and(is_true);
    at(run) && at(free)
}

/// The states entered after the start, but not at that time without the fault.
fn reaction(spec: &SafetySpec, run: &Traces, free: &Traces, (first, begins): (usize, [f64; 2])) -> Vec<StateEntered> {
    let Some(((_, names), (values, fault_free))) =
        spec.reaction.as_ref().zip(run.reaction.as_ref().zip(free.reaction.as_ref()))
    else {
        return Vec::new();
    };
    let mut out = Vec::new();
    for row in first.max(1)..values.len() {
        let (now, before, fault_free_state) = (values[row], values[row - 1], fault_free.get(row));
        if now != before && fault_free_state.is_none_or(|fault_free_state| *fault_free_state != now) {
            let state = names.get(now.round().max(0.0) as usize).cloned().unwrap_or_else(|| format!("{now}"));
            out.push(StateEntered { state, after: since(begins, run.time[row]) });
        }
    }
    out
}

/// An effect from the start of the first fault to the end of its window after the start of the last.
fn measure(
    effect: &Effect,
    (values, fault_free): (&[f64], &[f64]),
    run: &Traces,
    (first, begins): (usize, [f64; 2]),
) -> Result<f64, &'static str> {
    let until = (begins[1] + effect.window) * (1.0 + 1e-12);
    let rows = first..run.time.partition_point(|at| *at <= until).max(first);
    let values = values.get(rows.clone()).ok_or("the run has no such row")?;
    let times = &run.time[rows.clone()];
    let values: Vec<f64> = match effect.difference {
        false => values.to_vec(),
        true => {
            let fault_free = fault_free.get(rows).ok_or("the run without the fault ended earlier")?;
            values.iter().zip(fault_free).map(|(value, reference)| value - reference).collect()
        }
    };
    measured(effect.measure, Window { times, values: &values }, None, None).map(|found| found.value)
}

fn measured_effect(effect: &Effect, measured: Option<f64>) -> EffectMeasured {
    let bounds = [effect.definition.below, effect.definition.above];
    let in_bounds =
        |value: f64| bounds[0].is_none_or(|below| value < below) && bounds[1].is_none_or(|above| value > above);
    let bounded = bounds.iter().any(Option::is_some);
    EffectMeasured { measured, within_bounds: bounded.then(|| measured.is_some_and(in_bounds)) }
}

/// The effect nearest to a bound, or with the largest violation; without bounds the first.
fn worst(spec: &SafetySpec, effects: &[EffectMeasured]) -> Option<usize> {
    let of = |effect: &Effect, value: f64| {
        let size = |bound: f64| if bound == 0.0 { f64::MIN_POSITIVE } else { bound.abs() };
        let below = effect.definition.below.map(|bound| (value - bound) / size(bound));
        let above = effect.definition.above.map(|bound| (bound - value) / size(bound));
        below.into_iter().chain(above).reduce(f64::max)
    };
    let beyond = |number: usize| {
        let effect = &effects[number];
        effect.measured.map_or(Some(f64::INFINITY), |value| of(&spec.effects[number], value))
    };
    let bounded = (0..effects.len()).filter_map(|number| Some((number, beyond(number)?)));
    let found = bounded.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))).map(|(number, _)| number);
    found.or_else(|| (!effects.is_empty()).then_some(0))
}
