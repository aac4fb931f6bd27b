//! Sampled controllers: the exact loop map, its limits against golden data, runs against the map.

mod common;

use common::golden;
use kardan::model::builtin;
use kardan::study::{self, PreparedVariant};
use kardan::synthesis::{Clock, SampledLoop, SampledPart, Survey, sampled};
use serde_json::Value;

fn steering() -> PreparedVariant {
    study::prepare(builtin("sia-steering").expect("built in").source).0.variants.remove(0)
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The steering system's column at that clock, the driver in continuous time.
fn column(variant: &PreparedVariant, clock: Clock) -> SampledLoop {
    let plant = &variant.design_models[0];
    let mut laws = variant.design_laws();
    let driver = laws.remove(1);
    let laws = [sampled(laws.remove(0), clock).expect("finite"), driver];
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant.linear)).collect();
    SampledLoop::new(&plant.linear, &plant.lags(), &parts).expect("a loop")
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
    let (model, lags) = (&variant.design_models[0].linear, variant.design_models[0].lags());
    let survey = Survey { model, lags: &lags, laws: &laws, clocks: &clocks, number: 0 };
    for (key, delay) in [("no_delay", 0.0), ("half", 0.5), ("one_delay", 1.0)] {
        let found = survey.longest_period(delay).expect("stable when fast").value;
        let expected = number(&golden["discrete"]["limits"][key]["T_max"]);
        assert!((found / expected - 1.0).abs() < 1e-6, "{key}: {found} {expected}");
    }
}
