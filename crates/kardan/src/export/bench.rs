//! A virtual bench as JSON.

use serde_json::{Value, json as object};

use super::identification::value as identified;
use crate::results::{BenchPlan, BenchStudy, Compared, Difference, Outcome, Response, TrueValue};

/// A log as it is told in JSON: its name, how it ended, its files.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenLog {
    /// Name.
    pub name: String,
    /// How it ended.
    pub outcome: Outcome,
    /// Paths of its files.
    pub files: Vec<String>,
}

/// Gives the plan, the true values and the files of the logs as one JSON object on one line, in SI.
///
/// Keys: `model`, `plan` (`kind`, `parameters`, `known`, `points`, `candidates`, `log_det`, `undesigned_log_det`, `gain`,
/// `duration`; `null` where the file's controllers ran), `truth` (`name`, `value`, `unit`, `nominal`), `logs` (`name`, `outcome`,
/// `files`), `notes`.
///
/// ```
/// use kardan::export::bench_json;
/// let text = bench_json("drive", None, &[], &[], &["a note".to_string()]);
/// assert!(text.contains("\"plan\":null") && text.contains("a note"));
/// ```
pub fn bench_json(
    model: &str,
    plan: Option<&BenchPlan>,
    truth: &[TrueValue],
    logs: &[WrittenLog],
    notes: &[String],
) -> String {
    let (truth, logs) = (true_values(truth), written(logs));
    object!({ "model": model, "plan": plan.map(planned), "truth": truth, "logs": logs, "notes": notes }).to_string()
}

/// Gives a study on the bench as one JSON object on one line, in SI.
///
/// Keys: those of [`bench_json`], `files`, `identification` (as [`identification_json`](super::identification_json)), `controller`,
/// and `experiments` (`name`, `outcomes`, `responses`: `output`, `signal`, `reference`, `unit`, and for simulation and bench
/// `settled`, `farthest`; `distance`, `at_s`, `differences`: `what`, `alone`, `without`), `transient_s`.
pub fn bench_study_json(study: &BenchStudy, logs: &[WrittenLog], files: &[String]) -> String {
    let both = |of: Compared| object!({ "simulation": of.simulation, "bench": of.bench });
    let response = |one: &Response| {
        let difference = |one: &Difference| object!({ "what": one.what, "alone": one.alone, "without": one.without });
        object!({
            "output": one.output,
            "signal": one.signal,
            "reference": one.reference,
            "unit": one.physical.unit(),
            "settled": both(one.settled),
            "farthest": both(one.farthest),
            "distance": one.distance,
            "at_s": one.distance_at,
            "differences": one.differences.iter().map(difference).collect::<Vec<_>>(),
        })
    };
    let experiments: Vec<Value> = study
        .closed_loop
        .experiments
        .iter()
        .map(|one| {
            object!({
                "name": one.name,
                "outcomes": { "simulation": outcome(&one.simulated.outcome), "bench": outcome(&one.measured.outcome) },
                "responses": one.responses.iter().map(response).collect::<Vec<_>>(),
            })
        })
        .collect();
    let notes: Vec<&String> = study.notes.iter().chain(&study.closed_loop.notes).collect();
    object!({
        "model": study.model,
        "plan": planned(&study.plan),
        "truth": true_values(&study.truth),
        "logs": written(logs),
        "files": files,
        "identification": identified(&study.identification),
        "controller": study.closed_loop.design.controller,
        "transient_s": study.closed_loop.transient,
        "experiments": experiments,
        "notes": notes,
    })
    .to_string()
}

fn true_values(truth: &[TrueValue]) -> Vec<Value> {
    truth
        .iter()
        .map(|one| object!({ "name": one.name, "value": one.value, "unit": one.unit, "nominal": one.nominal }))
        .collect()
}

fn outcome(outcome: &Outcome) -> Value {
    match outcome {
        Outcome::Completed => object!("completed"),
        Outcome::Failed { time, cause } => object!({ "failed_at": time, "cause": cause }),
    }
}

fn written(logs: &[WrittenLog]) -> Vec<Value> {
    logs.iter().map(|log| object!({ "name": log.name, "outcome": outcome(&log.outcome), "files": log.files })).collect()
}

fn planned(plan: &BenchPlan) -> Value {
    let parameters: Vec<Value> = plan
        .parameters
        .iter()
        .map(|one| {
            object!({
                "name": one.name,
                "nominal": one.nominal,
                "unit": one.unit,
                "standard_error": one.standard_error,
            })
        })
        .collect();
    let named = |names: &[String], values: &[f64]| -> Value {
        names.iter().cloned().zip(values.iter().map(|x| object!(x))).collect::<serde_json::Map<_, _>>().into()
    };
    let points: Vec<Value> = plan
        .points
        .iter()
        .map(|point| {
            object!({
                "from": point.from,
                "until": point.until,
                "speeds": named(&plan.shafts, &point.speeds),
                "torques": named(&plan.motors, &point.torques),
            })
        })
        .collect();
    object!({
        "kind": plan.kind,
        "parameters": parameters,
        "known": plan.known,
        "points": points,
        "candidates": plan.candidates,
        "log_det": plan.log_det,
        "undesigned_log_det": plan.undesigned_log_det,
        "gain": plan.gain,
        "duration": plan.duration,
    })
}
