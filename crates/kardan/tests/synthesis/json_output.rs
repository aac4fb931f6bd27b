//! A design, and the controller that came of it, as JSON.

use kardan::export::{controller_json, design_json, schema};
use kardan::model::builtin;
use kardan::results::{
    Complex, ControllerData, DataMatrix, DataNumber, Design, ExactMatrix, ReadSignal, ZeroDynamics, ZeroMode,
};
use kardan::study::{DesignSettings, Silent, design};
use serde_json::{Value, json};

const KEYS: &str = "schema model description variant controller law other_controllers design_model rounded_constraints states inputs outputs \
                    definitions hidden_poles relative_degrees decoupling_matrix decouplability feedback gains canonical \
                    channels closed_loop_poles closed_loop_poles_exact integrals_without_effect zero_dynamics cancels_zeros observer transfer \
                    decoupled blocks_decoupled cross_coupling margins opposite_side responses motor_loads loop_along_path exploration robustness flatness \
                    controller_data observer_data warnings notes complete incomplete_reason";

fn steering() -> Design {
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    design(builtin("sia-steering").unwrap().source, &settings, &Silent).unwrap()
}

fn as_json(design: &Design) -> Value {
    let text = design_json(design);
    assert!(!text.contains('\n') && !text.contains("NaN") && !text.contains("inf,"), "{text}");
    let all: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(all.as_object().unwrap().keys().collect::<Vec<_>>(), KEYS.split_whitespace().collect::<Vec<_>>());
    all
}

#[test]
fn every_key_is_documented() {
    let schema: Value = serde_json::from_str(&schema("design").unwrap()).unwrap();
    for key in KEYS.split_whitespace() {
        assert!(schema["properties"][key]["description"].is_string(), "{key} is not documented");
    }
}

#[test]
fn fractions_are_exact_and_poles_come_in_pairs() {
    let all = as_json(&steering());
    assert_eq!(all["law"], "noninteracting");
    assert_eq!(all["relative_degrees"], json!([2, 2]));
    assert_eq!(all["decoupling_matrix"]["exact"], json!([["20", "0"], ["0", "-22000/26087"]]));
    assert_eq!(all["decoupling_matrix"]["values"][0][0], 20.0);
    let gain = &all["gains"]["Kx"];
    assert_eq!(gain["columns"][5], "cj.w");
    assert!(gain["exact"][0].as_array().unwrap().iter().any(|entry| entry.as_str().unwrap().contains('/')));
    let zeros = &all["zero_dynamics"];
    assert_eq!(zeros["stable"], true);
    assert_eq!(zeros["poles"].as_array().unwrap().len(), 2);
    assert_eq!(zeros["poles"][1][1].as_f64(), zeros["poles"][0][1].as_f64().map(|im| -im));
    assert!(zeros["modes"][0]["stored"].as_array().unwrap().iter().any(|one| one["element"] == "torsion_bar"));
    assert_eq!([&all["transfer"][0]["zero"], &all["transfer"][1]["zero"]], [false, true]);
    assert_eq!(all["transfer"][0]["denominator"], json!(["400", "28", "1"]));
    assert_eq!([&all["decoupled"], &all["decouplability"]["possible"]], [&json!(true), &json!("static")]);
}

#[test]
fn what_does_not_apply_is_null_and_names_are_distinguished() {
    let empty = as_json(&Design::default());
    for key in ["canonical", "observer", "decoupled", "flatness"] {
        assert_eq!(empty[key], Value::Null, "{key}");
    }
    assert_eq!(empty["zero_dynamics"]["stable"], Value::Null);
    let gain = |name: &str| {
        let values = vec![vec![f64::NAN], vec![f64::INFINITY, 1.0, f64::NEG_INFINITY]];
        ExactMatrix { name: name.into(), values, ..ExactMatrix::default() }
    };
    let modes = [0.0, 420.0].map(|re| ZeroMode { pole: Complex::new(re, 0.0), ..ZeroMode::default() });
    let odd = as_json(&Design {
        relative_degrees: vec![Some(2), None],
        gains: vec![gain("x"), gain("x"), gain("")],
        closed_loop_poles: vec![Complex::new(f64::NAN, f64::NEG_INFINITY)],
        zero_dynamics: ZeroDynamics { modes: modes.to_vec(), ..ZeroDynamics::default() },
        ..Design::default()
    });
    assert_eq!(odd["relative_degrees"], json!([2, null]));
    assert_eq!(odd["gains"].as_object().unwrap().keys().collect::<Vec<_>>(), ["x", "x_2", ""]);
    assert_eq!(odd["gains"]["x"]["values"], json!([[null], [null, 1.0, null]]));
    assert_eq!(odd["gains"]["x"]["exact"], Value::Null);
    assert_eq!(odd["closed_loop_poles"][0], json!([null, null]));
    assert_eq!(odd["zero_dynamics"]["poles"], json!([[0.0, 0.0], [420.0, 0.0]]));
}

#[test]
fn a_controller_reads_back_bit_for_bit() {
    let (matrix, limits) = (vec![vec![0.1 + 0.2, -1.0 / 3.0], vec![5e-324, -0.0]], [1e23, f64::MAX]);
    let controller_data = ControllerData {
        block: "Noninteracting".into(),
        reads: vec![ReadSignal::new("rack.phi", "rad")],
        writes: vec!["motor".into()],
        sample_time: Some(1e-3),
        single: false,
        matrices: vec![DataMatrix::new("A", matrix.clone())],
        numbers: vec![DataNumber::new("limit", limits[0]), DataNumber::new("gain", limits[1])],
    };
    let text = controller_json(&Design { controller_data, ..Design::default() });
    let all: Value = serde_json::from_str(&text).unwrap();
    let keys = "format version description model variant controller law inputs outputs block reads writes sample_time_s \
                precision matrices numbers observer";
    assert_eq!(all.as_object().unwrap().keys().collect::<Vec<_>>(), keys.split_whitespace().collect::<Vec<_>>());
    assert_eq!((&all["version"], &all["sample_time_s"]), (&json!(1), &json!(1e-3)));
    assert!(all["description"].as_str().unwrap().contains("kardan_rt::Noninteracting"));
    // Not what serde makes of the text, but what the text says.
    let numbers = |key: &str| -> Vec<u64> {
        let line = text.lines().find_map(|line| line.trim().strip_prefix(&format!("\"{key}\": "))).unwrap();
        let parts = line.split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
        parts.filter_map(|part| part.parse::<f64>().ok()).map(f64::to_bits).collect()
    };
    assert_eq!(numbers("matrices"), matrix.concat().iter().map(|value| value.to_bits()).collect::<Vec<_>>());
    assert_eq!(numbers("numbers"), limits.map(f64::to_bits));
    for design in [Design::default(), steering()] {
        let _: Value = serde_json::from_str(&controller_json(&design)).unwrap();
    }
}
