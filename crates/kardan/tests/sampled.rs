//! Sampled controllers: the exact loop map, its limits against golden data, runs against the map.

mod common;

use common::golden;
use kardan::model::builtin;
use kardan::study::{self, PreparedVariant};
use kardan::synthesis::{Clock, LoopPlant, SampledLoop, SampledPart, Survey, sampled};
use serde_json::Value;

fn steering() -> PreparedVariant {
    study::prepare(builtin("sia-steering").expect("built in").source).0.variants.remove(0)
}

/// The linear design model of the first controller, with its motors.
fn plant(variant: &PreparedVariant) -> LoopPlant {
    let model = &variant.design_models[0];
    LoopPlant::new(&model.linear, &model.lags())
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The steering system's column at that clock, the driver in continuous time.
fn column(variant: &PreparedVariant, clock: Clock) -> SampledLoop {
    let plant = plant(variant);
    let mut laws = variant.design_laws();
    let driver = laws.remove(1);
    let laws = [sampled(laws.remove(0), clock).expect("finite"), driver];
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    SampledLoop::new(&plant, &parts).expect("a loop")
}

/// Golden `discrete.rho`: spectral radii of the sampled loop.
#[test]
fn spectral_radii() {
    let golden = golden();
    let table = golden["discrete"]["rho"].as_object().expect("a table");
    let variant = steering();
    let mut checked = 0;
    for (rate, row) in table {
        let period = 1.0 / rate.parse::<f64>().expect("a rate");
        for (key, delay) in [("no_delay", 0.0), ("half_delay", 0.5), ("one_delay", 1.0)] {
            let found = column(&variant, Clock { period, delay: delay * period, single: false }).spectral_radius();
            let (found, expected) = (found.expect("eigenvalues"), number(&row[key]));
            assert!((found - expected).abs() < 1e-6, "{rate} Hz, {key}: {found} {expected}");
            checked += 1;
        }
    }
    assert!(checked >= 39, "{checked}");
}

/// Golden `discrete.limits`: the longest stable sample times.
#[test]
fn rate_limits() {
    let golden = golden();
    let variant = steering();
    let laws = variant.design_laws();
    let clocks = [None, None];
    let plant = plant(&variant);
    let survey = Survey { plant: &plant, laws: &laws, clocks: &clocks, number: 0 };
    for (key, delay) in [("no_delay", 0.0), ("half", 0.5), ("one_delay", 1.0)] {
        let found = survey.longest_period(delay).expect("stable when fast").value;
        let expected = number(&golden["discrete"]["limits"][key]["T_max"]);
        assert!((found / expected - 1.0).abs() < 1e-6, "{key}: {found} {expected}");
    }
}

/// The steering system without Coulomb friction, its column at a clock, from initial angles.
fn frictionless(clock: &str, motor: &str) -> String {
    let source = builtin("sia-steering").expect("built in").source;
    let lines = source.lines().filter(|line| !line.starts_with("friction ="));
    let text = lines.collect::<Vec<_>>().join("\n");
    let (head, _) = text.split_once("# ---- the run").expect("a scenario");
    let head = head
        .replace("[control.column]\n", &format!("[control.column]\n{clock}\n"))
        .replace("shaft = \"wg\"\n", &format!("shaft = \"wg\"\n{motor}\n"));
    head.replace("[variants]\nbeta = \"[0, 10, 20, 30] deg\"\n", "")
        + "[scenario]\nduration = \"20 ms\"\noutput_step = \"50 us\"\ninitial = { \"rk.phi\" = \"0.1 rad\", \"fs.phi\" = \"-0.2 rad\", \"cj.phi\" = \"0.11 rad\" }\n"
}

/// A run of the linear plant equals the powers of the exact map, at every sample, for any delay and lag.
#[test]
fn runs_equal_the_exact_map() {
    let cases = [
        ("sample_time = \"100 us\"", ""),
        ("sample_time = \"100 us\"\ndelay = \"50 us\"", ""),
        ("sample_time = \"100 us\"\ndelay = \"100 us\"", "lag = \"20 us\""),
        ("sample_time = \"100 us\"\ndelay = \"120 us\"", "lag = \"10 us\""),
        (
            "sample_time = \"100 us\"\ndelay = \"30 us\"\nobserver = { sensors = [\"rk.phi\", \"cs.phi\", \"wg.phi\"], \
             disturbances = [\"rk\", \"fs\"], method = \"kalman\" }",
            "",
        ),
    ];
    for (clock, motor) in cases {
        let source = frictionless(clock, motor);
        let variant = common::first(&source);
        let coordinates = variant.design_models[0].linear.coordinates.clone();
        let plant = plant(&variant);
        let laws = variant.running_laws();
        let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
        let found = SampledLoop::new(&plant, &parts).expect("a loop");
        let run = common::run(&source);
        let mut z = vec![0.0; found.map.rows()];
        let start: Vec<f64> = coordinates.iter().map(|name| common::at(&run, &format!("{name}.phi"), 0.0)).collect();
        z[..3].copy_from_slice(&start);
        // The observer starts at the true angles.
        let first = found.map.rows() - laws[0].states().len();
        for (k, state) in laws[0].states().iter().enumerate() {
            let coordinate = coordinates.iter().position(|name| *state == format!("estimate of {name}.phi"));
            z[first + k] = coordinate.map_or(0.0, |k| start[k]);
        }
        let mut largest: f64 = 0.0;
        for sample in 0..200 {
            let time = f64::from(sample) * 1e-4;
            for (k, name) in coordinates.iter().enumerate() {
                let (angle, speed) =
                    (common::at(&run, &format!("{name}.phi"), time), common::at(&run, &format!("{name}.w"), time));
                assert!((angle - z[k]).abs() < 1e-9, "{clock} {motor}: {name}.phi at {time}: {angle} {}", z[k]);
                assert!((speed - z[3 + k]).abs() < 1e-6, "{clock} {motor}: {name}.w at {time}: {speed} {}", z[3 + k]);
                largest = largest.max(speed.abs());
            }
            z = (0..z.len()).map(|i| (0..z.len()).map(|j| found.map[(i, j)] * z[j]).sum()).collect();
        }
        assert!(largest > 1.0, "something moves");
    }
}
