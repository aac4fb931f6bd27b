//! A study, and why there is none, as JSON.

use kardan::diagnostics::Diagnostic;
use kardan::export::{Files, json, json_error};
use kardan::results::{
    Energy, Event, FigureResult, Outcome, ParameterValue, Physical, RequirementResult, Run, Series, Signal, Study,
};
use serde_json::{Value, json as object};

fn run(name: &str, time: Vec<f64>, values: Vec<f64>) -> Run {
    let signal = Signal { name: "rk.phi".into(), physical: Physical::Angle, description: "angle of rk".into(), values };
    let text = "max |rk.phi| < 9 rad".into();
    Run {
        name: name.into(),
        parameters: vec![ParameterValue {
            name: "beta".into(),
            value: 0.5,
            unit: "rad".into(),
            text: "0.5 rad".into(),
        }],
        series: Series { time, signals: vec![signal] },
        energy: Energy { input: 3.0, stored: 1.0, dissipated: 2.0, residual: 1e-12, exchanged: 3.0 },
        events: vec![Event { time: 0.5, description: "rk sticks".into() }],
        outcome: Outcome::Completed,
        requirements: vec![RequirementResult {
            text,
            measured: None,
            unit: "rad".into(),
            display: None,
            passed: false,
        }],
        figures: vec![FigureResult {
            name: "peak".into(),
            text: "max rk.phi".into(),
            value: Some(0.25),
            unit: "rad".into(),
            display: None,
        }],
        notes: vec!["the split is not unique".into()],
        warnings: Vec::new(),
        motor_loads: vec![],
        effort: Default::default(),
        accuracy: None,
    }
}

fn study(runs: Vec<Run>) -> Study {
    let mut study = Study { runs, warnings: vec!["look here".into()], ..Study::default() };
    study.model.name = "gear".into();
    study
}

fn read(text: &str) -> Value {
    assert!(!text.contains('\n'));
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_study_has_the_promised_shape() {
    let mut failed = run("beta-1", vec![0.0, 1.0, 2.0], vec![1.0, -2.0, f64::NAN]);
    failed.outcome = Outcome::Failed { time: 2.0, cause: "step too small".into() };
    let files =
        Files { runs: vec![vec!["out/beta-1.csv".into()]], report: Some("out/report.html".into()), ..Files::default() };
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
    let energy = object!({ "input": 3.0, "stored": 1.0, "dissipated": 2.0, "residual": 1e-12, "exchanged": 3.0 });
    assert_eq!(first["energy"], energy);
    assert_eq!(first["files"], object!(["out/beta-1.csv"]));
    assert_eq!(
        first["outcome"],
        object!({ "completed": false, "verdict": "failed", "time": 2.0, "cause": "step too small" })
    );
    assert_eq!(first["requirements"][0]["measured"], Value::Null);
    let figure = object!({ "name": "peak", "text": "max rk.phi", "value": 0.25, "unit": "rad", "display": null });
    assert_eq!(first["figures"][0], figure);
    assert_eq!(all["figures"], Value::Null);
    assert_eq!(first["events"][0], object!({ "time": 0.5, "description": "rk sticks" }));
    assert_eq!(all["variants"][1]["files"], object!([]));
}

/// A row for each figure of each run, an empty cell where a run has none, quotes around what holds a comma.
#[test]
fn figures_are_a_table() {
    let mut other = run("b,c", vec![], vec![]);
    other.figures[0].value = None;
    let study = study(vec![run("a", vec![], vec![]), other]);
    let expected = "variant,figure,value,unit\na,peak,0.25,rad\n\"b,c\",peak,,rad\n";
    assert_eq!(kardan::export::figures_csv(&study).as_deref(), Some(expected));
    assert_eq!(kardan::export::figures_csv(&Study::default()), None);
}

#[test]
fn what_could_not_be_written_is_reported_in_the_study() {
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
    let expected = object!({ "schema": "kardan/2", "error": { "message": "2 mistakes", "diagnostics": [
        { "severity": "error", "code": "unit::unknown", "message": "unknown unit", "line": 2, "column": 4, "help": "use kg" },
        { "severity": "warning", "code": "file::odd", "message": "odd", "line": null, "column": null, "help": null },
    ] } });
    assert_eq!(all, expected);
}
