//! The observer of the law: the sampled plant that it follows and its stationary Kalman gain.

use kardan_rt::functions::{atan2, ln};

use crate::counters::ReducedStates;
use crate::observed::{Reading, compensation, distinguishable_torques, noise, reading};
use crate::observer::{extend, kalman};
use crate::sampled::{filter, zoh_plant};
use crate::{Request, SynthesisError, reading_variance, rounded};
use kardan_analysis::OutputSignal;
use kardan_math::num::Matrix;
use kardan_results::signal_name::Quantity;
use kardan_results::{Complex, ObserverResult, Pole};

use super::channel_tasks::DesignSpec;

/// The sampled plant that the observer follows, and how it corrects it.
pub(super) struct Observer {
    /// Whether all angles and speeds are measured, without error.
    pub(super) full: bool,
    /// Names of the plant's states.
    pub(super) states: Vec<String>,
    pub(super) disturbances: Vec<String>,
    pub(super) sensors: Vec<OutputSignal>,
    pub(super) readings: Vec<Reading>,
    /// `[x; τ of motors with a lag; d]⁺` over `[x; τ; d; past commands; command]`.
    pub(super) prediction: Matrix<f64>,
    /// C over `[x; τ; d]`.
    pub(super) output: Matrix<f64>,
    /// M
    pub(super) correction: Matrix<f64>,
    pub(super) result: Option<ObserverResult>,
}

pub(super) fn observer(request: &Request<'_>, spec: &DesignSpec<'_>) -> Result<Observer, SynthesisError> {
    let DesignSpec { inputs, lags, clock, .. } = *spec;
    let (plant, states) = (request.plant, request.plant.state_names());
    let disturbances: Vec<String> = request.disturbances.iter().map(|&k| plant.coordinates()[k].clone()).collect();
    let keys = request.values.table("observer");
    keys.map(compensation).transpose()?;
    if keys.is_some_and(|keys| keys.has("poles") || keys.word("method") == Some("poles")) {
        return Err(SynthesisError::idle_key("poles", "kalman"));
    }
    let measured = keys.and_then(|keys| keys.names("sensors")).unwrap_or(&states);
    let sensors: Vec<OutputSignal> = measured.iter().map(|name| plant.output(name)).collect::<Result<_, _>>()?;
    let readings: Vec<Reading> = sensors.iter().map(|sensor| reading(sensor, plant)).collect::<Result<_, _>>()?;
    let system = plant.system(inputs, &sensors);
    let (torques, _) = plant.torques(request.disturbances, &[]);
    let discrete = zoh_plant(&system.a.to_f64(), &system.b.to_f64(), &torques.to_f64(), lags, clock)
        .ok_or_else(|| SynthesisError::sampled_overflow(clock.period))?;
    let size = discrete.flow.rows();
    let c = system.c.to_f64();
    let output = Matrix::from_fn(c.rows(), size, |i, j| if j < c.columns() { c[(i, j)] } else { 0.0 });
    let out = Observer {
        full: true,
        disturbances,
        sensors,
        readings,
        correction: Matrix::from_fn(size, states.len(), |i, j| f64::from(u8::from(i == j))),
        states,
        prediction: discrete.state,
        output,
        result: None,
    };
    let Some(keys) = keys else { return Ok(out) };
    let names: Vec<String> = out.disturbances.iter().map(|name| Quantity::Disturbance.of(name)).collect();
    let extended = extend(&system, &torques, &names);
    // What the sensors show at all is decided exactly, straight ahead; elsewhere the Riccati equation of the filter must do.
    let noise = noise(keys, &extended, 10.0);
    let failed = |error| SynthesisError::observer(&extended.outputs, &error);
    let straight = plant.is_moved() || plant.point.position.iter().all(|angle| *angle == 0.0);
    if straight {
        kalman(&extended, &noise).map_err(failed)?;
    }
    let (of_plant, of_disturbances) = noise.process.split_at(out.states.len());
    let of_lagged = vec![0.0; size - noise.process.len()];
    let intensities = [of_plant, &of_lagged, of_disturbances].concat();
    let variances: Vec<f64> = out
        .sensors
        .iter()
        .map(|sensor| reading_variance(plant, keys.number("sensor_noise"), sensor, clock.period))
        .collect();
    let found = filter(&discrete.flow, &out.output, &intensities, &variances, clock.period).ok_or_else(|| {
        SynthesisError::whole(
            "the Riccati equation of the observer has no stabilising solution in floating point",
            "add a sensor, estimate fewer torques, or choose other noises",
        )
    })?;
    let out = Observer { full: false, correction: found.gain, ..out };
    if !straight {
        return Ok(out);
    }
    let lagged = inputs.iter().zip(lags).filter(|(_, lag)| **lag > 0.0).map(|(input, _)| plant.effort_of(input).signal);
    let all: Vec<String> = out.states.iter().cloned().chain(lagged).chain(names).collect();
    let mut sentences = distinguishable_torques(plant, &system, &ReducedStates::all(system.states.len()))?;
    sentences.push(format!("the relative residual of the Riccati equation of the filter is {:.1e}", found.residual));
    let title = ("observer_gain", "observer gain M of x <- x + M (y - C x)", "");
    let result = ObserverResult {
        sensors: extended.outputs.clone(),
        disturbances: out.disturbances.clone(),
        poles: found.multipliers.iter().map(|z| as_pole(*z, clock.period)).collect(),
        method: "kalman".into(),
        gain: rounded(title, &all, &extended.outputs, &out.correction),
        states: all,
        distinguishable: sentences,
    };
    Ok(Observer { result: Some(result), ..out })
}

/// The pole in continuous time of a multiplier per sample, 1/s.
fn as_pole(multiplier: Complex, period: f64) -> Pole {
    Pole::new(ln(multiplier.abs()) / period, atan2(multiplier.im, multiplier.re) / period)
}
