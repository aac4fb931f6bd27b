//! The gain of an observer, and which torques its sensors can distinguish.

use kardan_rt::functions::powi;

use crate::counters::ReducedStates;
use crate::observer::{Noise, distinguishable, kalman, luenberger};
use crate::{Plant, SynthesisError, named, rounded};
use kardan_analysis::LinearSystem;
use kardan_math::num::rational_to_f64;
use kardan_mechanics::equations::Domain;
use kardan_results::signal_name::SignalName;
use kardan_results::{ExactMatrix, Pole};
use kardan_schema::schema::Values;

/// The gain L with the poles of the error and what must be known.
pub(super) fn gain(
    values: &Values,
    extended: &LinearSystem,
) -> Result<(ExactMatrix, Vec<Pole>, Vec<String>), SynthesisError> {
    let failed = |error| SynthesisError::observer(&extended.outputs, &error);
    let kalman_keys = ["disturbance_rate", "speed_noise", "sensor_noise"];
    let idle = match values.word("method") {
        Some("kalman") => values.has("poles").then_some("poles"),
        _ => kalman_keys.into_iter().find(|key| values.has(key)),
    };
    if let Some(key) = idle {
        return Err(SynthesisError::idle_key(key, values.word("method").unwrap_or("poles")));
    }
    let title = ("observer_gain", "observer gain L of x' = A x + B u + L (y - C x)", "");
    if values.word("method") == Some("kalman") {
        let noise = noise(values, extended, 0.1);
        let found = kalman(extended, &noise).map_err(failed)?;
        let notes =
            vec![format!("the relative residual of the Riccati equation of the filter is {:.1e}", found.residual)];
        return Ok((rounded(title, &extended.states, &extended.outputs, &found.gain), found.poles, notes));
    }
    let Some(poles) = values.poles("poles") else {
        let help = "add `poles = [-50, -51, -52]`, or `method = \"kalman\"`";
        return Err(SynthesisError::at("the observer needs `poles`", "observer", "this observer", help));
    };
    let poles: Vec<_> = poles.iter().map(|(re, im)| (re.to_rational(), im.to_rational())).collect();
    if let Some((re, _)) = poles.iter().find(|(re, _)| rational_to_f64(re) >= 0.0) {
        let re = rational_to_f64(re);
        let message = format!("a pole of the observer has the real part {re}; its error would not die out");
        return Err(SynthesisError::of(message, &[], "this observer", "choose poles with a negative real part"));
    }
    let found = luenberger(extended, &poles).map_err(failed)?;
    Ok((named(title, &extended.states, &extended.outputs, &found.gain), found.poles, found.notes))
}

/// The noise of states and sensors from the keys of an observer; `speed_noise`: that of accelerations where it is left out.
pub(crate) fn noise(keys: &Values, extended: &LinearSystem, speed_noise: f64) -> Noise {
    let number = |key: &str, otherwise: f64| powi(keys.number(key).unwrap_or(otherwise), 2);
    let intensity = |state: &String| match SignalName::new(state) {
        name if name.is_position() => 0.0,
        name if name.is_rate() => number("speed_noise", speed_noise),
        _ => number("disturbance_rate", 10.0),
    };
    Noise {
        process: extended.states.iter().map(intensity).collect(),
        measurement: vec![number("sensor_noise", 1e-5); extended.outputs.len()],
    }
}

/// Which torques on any shafts, and forces on masses, the sensors could distinguish, \[diss. (6.41)-(6.43)\]; `reduction`: the states that are
/// estimated.
pub(crate) fn distinguishable_torques(
    plant: &Plant,
    system: &LinearSystem,
    reduction: &ReducedStates,
) -> Result<Vec<String>, SynthesisError> {
    let moves = |k: &usize| plant.reduced.equations.domain(*k) != Domain::Charge;
    let bodies: Vec<usize> = (0..plant.coordinates().len()).filter(moves).collect();
    let (torques, _) = plant.torques(&bodies, &[]);
    let names: Vec<String> = bodies.iter().map(|body| format!("T_{}", plant.coordinates()[*body])).collect();
    let found = distinguishable(&reduction.system(system), &reduction.columns(&torques), &names);
    Ok(found.map_err(|error| SynthesisError::observer(&system.outputs, &error))?.sentences)
}
