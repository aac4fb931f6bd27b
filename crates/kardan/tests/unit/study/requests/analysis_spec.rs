//! Tests of `src/study/requests/analysis_spec.rs`.

use super::*;
use crate::study::prepare;
use kardan_schema::diagnostics::{Severity, plain};

const MODEL: &str = r#"
[model]
coordinates = ["b", "c"]

[parameters]
angle = "10 deg"
n = 50

[variants]
angle = "[10, 20] deg"

[shaft.a]

[shaft.b]
inertia = "1 kg m^2"
friction = "1 N m"

[shaft.c]
inertia = "1 kg m^2"

[gear.g]
shaft_1 = "a"
shaft_2 = "b"
ratio = 2

[spring_damper.bar]
shaft_1 = "a"
shaft_2 = "c"
stiffness = "1 N m/rad"

[sensor.twist]
measures = "torque"
element = "bar"

[sensor.encoder]
measures = "angle"
shaft = "a"

[motor.m]
shaft = "b"

[disturbance.load]
shaft = "c"

[scenario]
initial = { "c.phi" = "1 rad" }
"#;

fn specs(analysis: &str) -> Vec<AnalysisSpec> {
    let source = format!("{MODEL}{analysis}");
    let (prepared, diagnostics) = prepare(&source);
    assert!(
        diagnostics.iter().all(|diagnostic| diagnostic.code.ends_with("::unused")),
        "{}",
        plain(&source, &diagnostics)
    );
    prepared.variants.into_iter().map(|variant| variant.analysis.clone()).collect()
}

/// What a file without keys in `[analysis]` means.
fn without_keys() -> AnalysisSpec {
    AnalysisSpec {
        inputs: None,
        outputs: None,
        at: Vec::new(),
        conditions: OperatingConditions::default(),
        stuck: Vec::new(),
        horizon: Exact::one(),
        motion: Vec::new(),
        threshold: None,
        samples: None,
        actuators: Vec::new(),
        sensors: Vec::new(),
        places: BTreeMap::new(),
        laws: BTreeMap::new(),
    }
}

#[test]
fn every_key_is_optional() {
    for analysis in ["", "[analysis]\n"] {
        assert_eq!(specs(analysis), [without_keys(), without_keys()]);
    }
}

#[test]
fn every_key_is_read_for_each_variant() {
    let specs = specs(
        r#"
[analysis]
inputs = ["load", "m"]
outputs = ["a.phi", "c.w", "twist", "encoder.phi"]
at = { "b.phi" = "angle" }
stuck = ["b"]
horizon = "20 ms"
motion = { "c.phi" = "180 deg", "b.w" = "60 rpm" }
threshold = 1e-6
samples = "n"

[[analysis.actuator]]
shaft = "b"
cost = "5/2"

[[analysis.actuator]]
shaft = "a"

[[analysis.sensor]]
shaft = "c"
measures = "speed"
cost = 0

[[analysis.sensor]]
shaft = "c"
"#,
    );
    let names = |list: &[&str]| list.iter().map(|name| name.to_string()).collect::<Vec<_>>();
    assert_eq!(specs.len(), 2);
    for (spec, degrees) in specs.iter().zip([10.0f64, 20.0]) {
        assert_eq!(spec.inputs, Some(names(&["load", "m"])));
        // The reading of a sensor is the sensor itself.
        assert_eq!(spec.outputs, Some(names(&["a.phi", "c.w", "twist", "encoder"])));
        assert_eq!(spec.at, [("b".to_string(), degrees.to_radians())]);
        assert_eq!(spec.position(&names(&["b", "c"]), &[5.0, 1.0]), [degrees.to_radians(), 1.0]);
        assert_eq!(spec.stuck, ["b"]);
        assert_eq!(spec.horizon, Exact::from_ratio(1, 50));
        let pi = std::f64::consts::PI;
        assert_eq!(spec.motion, [("c.phi".to_string(), pi), ("b.w".to_string(), 2.0 * pi)]);
        assert_eq!((spec.threshold, spec.samples), (Some(1e-6), Some(50)));
        let places = |places: &[Site]| -> Vec<(String, String, f64)> {
            places.iter().map(|place| (place.shaft.clone(), place.signal.clone(), place.cost)).collect()
        };
        let place = |shaft: &str, signal: &str, cost| (shaft.to_string(), signal.to_string(), cost);
        assert_eq!(places(&spec.actuators), [place("b", "", 2.5), place("a", "", 1.0)]);
        assert_eq!(places(&spec.sensors), [place("c", "c.w", 0.0), place("c", "c.phi", 1.0)]);
        assert_eq!(spec.places.len(), 10);
    }
}

#[test]
fn an_operating_point_that_overflows_is_refused() {
    let source = format!("{MODEL}[analysis]\nat = {{ \"b.phi\" = \"1e308 rad\" }}\n");
    let (_, diagnostics) = prepare(&source);
    let errors = diagnostics.iter().filter(|diagnostic| diagnostic.severity == Severity::Error);
    assert_eq!(errors.map(|diagnostic| diagnostic.code).collect::<Vec<_>>(), ["number::range"]);
}
