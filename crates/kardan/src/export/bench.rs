//! A virtual bench as JSON.

use serde_json::{Value, json as object};

use crate::results::{BenchPlan, Outcome, TrueValue};

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
    let truth: Vec<Value> = truth
        .iter()
        .map(|one| object!({ "name": one.name, "value": one.value, "unit": one.unit, "nominal": one.nominal }))
        .collect();
    let logs: Vec<Value> = logs
        .iter()
        .map(|log| {
            let outcome = match &log.outcome {
                Outcome::Completed => object!("completed"),
                Outcome::Failed { time, cause } => object!({ "failed_at": time, "cause": cause }),
            };
            object!({ "name": log.name, "outcome": outcome, "files": log.files })
        })
        .collect();
    object!({ "model": model, "plan": plan.map(planned), "truth": truth, "logs": logs, "notes": notes }).to_string()
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
