//! An analysis as JSON.

use kardan::export::analysis_json;
use kardan::model::builtin;
use kardan::results::{Analysis, Pole};
use kardan::study::{AnalyzeSettings, Silent, analyze};
use serde_json::{Value, json};

const KEYS: &str = "schema name description mechanism model_class coordinates elimination integrals_without_effect modes controllable observable minimal \
                    uncontrollable unobservable controllable_rank observable_rank states state_names inputs outputs \
                    relative_degrees zeros kind min_inputs min_outputs factors invariant_factors construction placements \
                    placement_search sensitivity properties opposite_side discrete descriptor matrix_distance parity bases constraint_forces certificate notes complete incomplete_reason";

fn as_json(analysis: &Analysis) -> Value {
    let text = analysis_json(analysis);
    assert!(!text.contains('\n'));
    let all: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(all.as_object().unwrap().keys().collect::<Vec<_>>(), KEYS.split_whitespace().collect::<Vec<_>>());
    all
}

/// Two bodies with d² = s J, which one motor cannot control.
fn two_bodies() -> Analysis {
    let source = builtin("two-bodies").unwrap().source;
    let source = source.replace("\"2 N m/rad", "\"1 N m/rad").replace("\"0.5 N m s/rad", "\"1 N m s/rad");
    let outputs = vec!["body_2.phi".into()];
    analyze(&source, &AnalyzeSettings { outputs, certify: true, ..AnalyzeSettings::default() }, &Silent).unwrap()
}

#[test]
fn two_bodies_are_typed_as_promised() {
    let all = as_json(&two_bodies());
    assert_eq!([&all["states"], &all["controllable_rank"], &all["observable_rank"]], [4, 3, 3]);
    assert_eq!([&all["min_inputs"], &all["min_outputs"]], [2, 2]);
    assert_eq!([&all["controllable"], &all["observable"], &all["minimal"]], [false, false, false]);
    assert_eq!(all["state_names"][2], "body_1.w");
    assert_eq!(all["uncontrollable"][0]["shafts"], json!([{ "name": "body_2", "share": 1.0 }]));
    assert_eq!(all["uncontrollable"][0]["eigenvalue_per_s"], json!([-1.0, 0.0]));
    let zeros = json!({ "polynomial": "s + 1", "values": [[-1.0, 0.0]], "in_right_half_plane": 0, "normal_rank": 1 });
    assert_eq!(all["zeros"], zeros);
    let degrees = json!({ "outputs": ["body_2.phi"], "inputs": ["motor_1"], "table": [[3]], "per_output": [3] });
    assert_eq!(all["relative_degrees"], degrees);
    assert_eq!(all["model_class"]["assumptions"].as_array().unwrap().len(), 5);
    assert!(all["modes"][1]["stored"].as_array().unwrap().iter().any(|one| one["energy"] == "potential"));
    assert_eq!(all["construction"]["input"], json!([["1", "0"], ["0", "1"]]));
    assert_eq!(all["construction"]["steps"][1]["column"], 1);
    assert_eq!(all["placements"][0]["inputs"], json!(["body_1", "body_2"]));
    assert_eq!(all["placements"][1]["outputs"], json!(["body_1.phi", "body_2.phi"]));
    assert_eq!(all["placements"][0]["unit"], "rad^2/(N^2 m^2 s)");
    assert_eq!(all["sensitivity"]["observability"]["box"], "lost");
    // Whole numbers beyond 2⁵³ are written in full.
    assert!(all["certificate"]["primes"][0].as_u64().unwrap() > 1 << 53);
}

#[test]
fn what_never_arrives_and_what_is_not_finite_is_null() {
    assert_eq!(as_json(&Analysis::default())["model_class"], Value::Null);
    let mut found = two_bodies();
    found.structure.relative_degrees = vec![vec![Some(2), Some(4)], vec![Some(1), None], vec![None; 2]];
    found.modes[1].eigenvalue = Pole::new(f64::NAN, f64::INFINITY);
    found.structure.certificate.failure_probability = f64::NAN;
    found.structure.undecided.observability = true;
    let all = as_json(&found);
    assert_eq!(all["relative_degrees"]["table"], json!([[2, 4], [1, null], [null, null]]));
    assert_eq!(all["relative_degrees"]["per_output"], json!([2, 1, null]));
    assert_eq!(all["modes"][1]["eigenvalue_per_s"], json!([null, null]));
    assert_eq!(all["certificate"]["failure_probability"], Value::Null);
    assert_eq!(
        [&all["observable"], &all["observable_rank"], &all["minimal"]],
        [&Value::Null, &Value::Null, &json!(false)]
    );
    assert_eq!([&all["modes"][0]["observable"], &all["factors"][0]["output_defect"]], [&Value::Null; 2]);
}
