//! The continuous Kalman filter.

use super::ObserverError;
use super::distinguish::hidden_states;
use super::distinguishable::in_proportion;
use crate::regulator::{RiccatiError, Weights, chains, lqr};
use kardan_analysis::LinearSystem;
use kardan_math::num::Matrix;
use kardan_results::Pole;

/// White noise on states and sensors, uncorrelated.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Intensity of the noise in `ẋ = A x + B u + w` (E = I), one per state, (unit of the state)²/s: of a speed (rad/s)²/s, of
    /// an unknown torque, which it lets wander, (N m)²/s. Zero or above.
    pub process: Vec<f64>,
    /// Intensity of the noise in `y = C x + v`, one per sensor, (unit of the sensor)²·s. Above zero.
    pub measurement: Vec<f64>,
}

/// The stationary Kalman filter `x̂′ = A x̂ + B u + L (y − C x̂ − D u)`, A and B for E = I.
#[derive(Debug, Clone, PartialEq)]
pub struct KalmanGain {
    /// L = P Cᵀ V⁻¹, states × sensors.
    pub gain: Matrix<f64>,
    /// P: covariance of the error of the estimate.
    pub covariance: Matrix<f64>,
    /// Eigenvalues of A − LC, 1/s, by size.
    pub poles: Vec<Pole>,
    /// Certificate: relative residual of `A P + P Aᵀ + W − P Cᵀ V⁻¹ C P`, as of
    /// [`Regulator::residual`](crate::regulator::Regulator::residual).
    pub residual: f64,
}

/// The observer with the least covariance of its error for white noise: dual of [`lqr`].
///
/// For unknown constant torques extend the system ([`extend`](super::extend)) and give each torque a noise intensity; the
/// larger it is, the faster the estimate follows.
///
/// # Errors
/// If motions that do not decay show in no sensor, if no noise acts on something that does not decay by itself (its estimate
/// would never be corrected in the long run), if an intensity is out of range, or E is singular.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::observer::{Noise, kalman};
/// // A body under white torque noise, angle measured: poles of Butterworth, L = [√2 ω, ω²], ω⁴ = w/v.
/// let m = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let body = LinearSystem::state_space(m(&[&[0, 1], &[0, 0]]), m(&[&[0], &[1]]), m(&[&[1, 0]]));
/// let filter = kalman(&body, &Noise { process: vec![0.0, 16.0], measurement: vec![1.0] }).unwrap();
/// assert!((filter.gain[(1, 0)] - 4.0).abs() < 1e-13 && (filter.gain[(0, 0)] - 8f64.sqrt()).abs() < 1e-13);
/// ```
pub fn kalman(system: &LinearSystem, noise: &Noise) -> Result<KalmanGain, ObserverError> {
    check("states", &system.states, &noise.process, false)?;
    check("sensors", &system.outputs, &noise.measurement, true)?;
    let explicit = system.explicit().ok_or(ObserverError::Singular)?;
    let dual = LinearSystem { outputs: Vec::new(), c: Matrix::zeros(0, explicit.states.len()), ..explicit.transpose() };
    let dual = LinearSystem { d: Matrix::zeros(0, dual.inputs.len()), ..dual };
    let found = lqr(&dual, &Weights::diagonal(&noise.process, &noise.measurement)).map_err(|error| match error {
        RiccatiError::NotStabilisable { modes, .. } => {
            let hidden = hidden_states(&chains(&dual.a, &dual.b), explicit.states.len());
            let hidden = hidden.iter().map(|v| in_proportion(&explicit.states, v)).collect();
            ObserverError::NotDetectable { modes, hidden }
        }
        RiccatiError::NotDetectable { motions, .. } => ObserverError::Noiseless { combinations: motions },
        other => ObserverError::Riccati(other),
    })?;
    Ok(KalmanGain {
        gain: found.gain.transpose(),
        covariance: found.solution,
        poles: found.poles,
        residual: found.residual,
    })
}

fn check(of: &'static str, names: &[String], values: &[f64], sensor: bool) -> Result<(), ObserverError> {
    if names.len() != values.len() {
        return Err(ObserverError::Noises { of, actual: values.len(), expected: names.len() });
    }
    let good = |value: f64| value.is_finite() && if sensor { value > 0.0 } else { value >= 0.0 };
    match names.iter().zip(values).find(|(_, value)| !good(**value)) {
        Some((name, value)) => Err(ObserverError::Noise { name: name.clone(), value: *value, sensor }),
        None => Ok(()),
    }
}
