//! The outcome of a study as one JSON object.

use serde_json::{Map, Value, json as object};

use super::analysis::analysis_in_short;
use super::extremes::extremes;
use crate::diagnostics::{Diagnostic, Lines, Severity};
use crate::results::{MotorStrain, Outcome, Run, Study};

/// The files that were written for a study.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Files {
    /// Paths for each run, in the order of [`Study::runs`]; a run beyond the end has none.
    pub runs: Vec<Vec<String>>,
    /// Path of the report.
    pub report: Option<String>,
    /// Paths of the plots.
    pub plots: Vec<String>,
    /// What could not be written, and why.
    pub unwritten: Vec<String>,
}

/// Gives the study and its files as one JSON object on one line, in SI; a number that is not finite is `null`.
///
/// Keys: `model`, `variants` (`name`, `outcome`, `parameters`, `signals`, `energy`, `requirements`, `events`, `notes`, `motors`
/// (those with limits: what was asked, and how long they were at their limits), `effort`, `files`), `report`, `plots`, `warnings`, `analysis`; and `error` as in [`json_error`] if a file could not be
/// written. `analysis` has the key results of the structure of the first variant, under the names of
/// [`analysis_json`](super::analysis_json), or is `null`. `signals` is an object from the signal's name to `min`, `max`, `final`, `t_min`, `t_max`, `unit`.
pub fn json(study: &Study, files: &Files) -> String {
    let none = Vec::new();
    let variants: Vec<Value> =
        study.runs.iter().enumerate().map(|(i, run)| variant(run, files.runs.get(i).unwrap_or(&none))).collect();
    let mut root = object!({
        "model": study.model.name,
        "variants": variants,
        "report": files.report,
        "plots": files.plots,
        "warnings": study.warnings,
        "analysis": study.analysis.as_ref().map(analysis_in_short),
    });
    if !files.unwritten.is_empty() {
        root["error"] = object!({ "message": files.unwritten.join("; "), "diagnostics": [] });
    }
    root.to_string()
}

/// Gives what went wrong as one JSON object on one line, for a reader who asked for JSON:
/// `{"error": {"message", "diagnostics": [{"severity", "code", "message", "line", "column", "help"}]}}`.
///
/// Line and column count from 1 in `source` and are `null` for a diagnostic without a place.
pub fn json_error(message: &str, source: &str, diagnostics: &[Diagnostic]) -> String {
    let lines = Lines::new(source);
    let diagnostics: Vec<Value> = diagnostics
        .iter()
        .map(|d| {
            let place = d.labels.first().map(|label| lines.line_column(source, label.span.start));
            object!({
                "severity": match d.severity { Severity::Error => "error", Severity::Warning => "warning" },
                "code": d.code,
                "message": d.message,
                "line": place.map(|(line, _)| line),
                "column": place.map(|(_, column)| column),
                "help": d.help,
            })
        })
        .collect();
    object!({ "error": { "message": message, "diagnostics": diagnostics } }).to_string()
}

fn variant(run: &Run, files: &[String]) -> Value {
    let signals: Map<String, Value> = run
        .series
        .signals
        .iter()
        .map(|signal| {
            let e = extremes(&run.series.time, &signal.values);
            let unit = signal.physical.unit();
            let numbers = object!({
                "min": e.min, "max": e.max, "final": e.last, "t_min": e.t_min, "t_max": e.t_max, "unit": unit,
            });
            (signal.name.clone(), numbers)
        })
        .collect();
    let requirements: Vec<Value> = run
        .requirements
        .iter()
        .map(|r| object!({ "text": r.text, "measured": r.measured, "unit": r.unit, "passed": r.passed }))
        .collect();
    let events: Vec<Value> =
        run.events.iter().map(|event| object!({ "time": event.time, "what": event.what })).collect();
    let energy = &run.energy;
    object!({
        "name": run.name,
        "outcome": outcome(&run.outcome),
        "parameters": run.parameters.iter().map(|p| (p.name.clone(), object!(p.value))).collect::<Map<_, _>>(),
        "signals": signals,
        "energy": {
            "input": energy.input,
            "stored": energy.stored,
            "dissipated": energy.dissipated,
            "residual": energy.residual,
        },
        "requirements": requirements,
        "events": events,
        "notes": run.notes,
        "motors": run.strains.iter().map(|strain| motor_strain(strain, run.length())).collect::<Vec<_>>(),
        "effort": {
            "steps": run.effort.steps,
            "rejected": run.effort.rejected,
            "evaluations": run.effort.evaluations,
            "events": run.effort.events,
        },
        "files": files,
    })
}

/// What was asked of a motor with limits in a run of this length (s).
pub(super) fn motor_strain(strain: &MotorStrain, length: f64) -> Value {
    object!({
        "name": strain.motor,
        "controller": strain.controller,
        "torque_limit_n_m": strain.torque_limit,
        "rate_limit_n_m_per_s": strain.rate_limit,
        "asked_n_m": strain.asked,
        "time_at_torque_limit_s": strain.seconds_at_limit(0.0, length),
        "time_at_rate_limit_s": strain.seconds_at_rate_limit(0.0, length),
        "first_at_torque_limit_s": strain.at_torque_limit.first().map(|span| span.from),
    })
}

fn outcome(outcome: &Outcome) -> Value {
    match outcome {
        Outcome::Completed => object!({ "completed": true }),
        Outcome::Failed { time, cause } => object!({ "completed": false, "time": time, "cause": cause }),
    }
}

#[cfg(test)]
mod tests {
    use super::super::example::{run, study};
    use super::*;

    fn read(text: &str) -> Value {
        assert!(!text.contains('\n'));
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn a_study_has_the_promised_shape() {
        let mut failed = run("beta-1", vec![0.0, 1.0, 2.0], vec![("rk.phi", vec![1.0, -2.0, f64::NAN])]);
        failed.outcome = Outcome::Failed { time: 2.0, cause: "step too small".into() };
        let files = Files {
            runs: vec![vec!["out/beta-1.csv".into()]],
            report: Some("out/report.html".into()),
            ..Files::default()
        };
        let all = read(&json(&study(vec![failed, run("beta-2", vec![], vec![])]), &files));
        assert_eq!(all["model"], "gear");
        assert_eq!(all["report"], "out/report.html");
        assert_eq!(all["warnings"], object!(["look here"]));
        assert_eq!(all.get("error"), None);
        let first = &all["variants"][0];
        assert_eq!(first["name"], "beta-1");
        assert_eq!(first["parameters"], object!({ "beta": 0.5 }));
        let expected = object!({ "min": -2.0, "max": 1.0, "final": null, "t_min": 1.0, "t_max": 0.0, "unit": "rad" });
        assert_eq!(first["signals"]["rk.phi"], expected);
        let energy = object!({ "input": 3.0, "stored": 1.0, "dissipated": 2.0, "residual": 1e-12 });
        assert_eq!(first["energy"], energy);
        assert_eq!(first["files"], object!(["out/beta-1.csv"]));
        assert_eq!(first["outcome"], object!({ "completed": false, "time": 2.0, "cause": "step too small" }));
        assert_eq!(first["requirements"][0]["measured"], Value::Null);
        assert_eq!(first["events"][0], object!({ "time": 0.5, "what": "rk sticks" }));
        assert_eq!(all["variants"][1]["files"], object!([]));
    }

    #[test]
    fn what_could_not_be_written_is_said_in_the_study() {
        let files = Files { unwritten: vec!["disk full".into()], ..Files::default() };
        let all = read(&json(&study(vec![]), &files));
        assert_eq!(all["report"], Value::Null);
        assert_eq!(all["error"]["message"], "disk full");
    }

    #[test]
    fn an_error_names_the_place_of_every_diagnostic() {
        let list = [
            Diagnostic::error("unit::unknown", "unknown unit").at(9..10, "here").help("use kg"),
            Diagnostic::warning("file::odd", "odd"),
        ];
        let all = read(&json_error("2 mistakes", "a = 1\nb = kq\n", &list));
        let expected = object!({ "error": { "message": "2 mistakes", "diagnostics": [
            { "severity": "error", "code": "unit::unknown", "message": "unknown unit", "line": 2, "column": 4, "help": "use kg" },
            { "severity": "warning", "code": "file::odd", "message": "odd", "line": null, "column": null, "help": null },
        ] } });
        assert_eq!(all, expected);
    }
}
