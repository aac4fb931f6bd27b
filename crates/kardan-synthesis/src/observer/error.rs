//! Errors of designing an observer.

use crate::notation::{format_poles, listed};
use crate::regulator::RiccatiError;
use kardan_results::Pole;

/// Why there is no observer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ObserverError {
    /// The sensors do not see all states.
    #[error(
        "with {} only {rank} of {states} states can be observed; no sensor shows {}{}",
        listed(sensors),
        hidden.join("; nor "),
        only(observable)
    )]
    NotObservable {
        /// The sensors.
        sensors: Vec<String>,
        /// Rank of the observability matrix.
        rank: usize,
        /// Number of states.
        states: usize,
        /// States and torques, as text, that show in no sensor: `T_wg : T_cs : T_fs = 1 : -51 : 50`.
        hidden: Vec<String>,
        /// The observable combinations of the constant torques as text, if not all are: `T_wg - 1/50 T_fs`.
        observable: Vec<String>,
    },
    /// Neither as many poles as the longest chain has, nor as many as there are states.
    #[error(
        "{actual} pole{} given; {longest} (the same for every sensor) or {states} (for the sensors one after the other) are \
         needed", if *actual == 1 { " is" } else { "s are" }
    )]
    WrongNumber {
        /// How many are given.
        actual: usize,
        /// Largest observability index.
        longest: usize,
        /// Number of states.
        states: usize,
    },
    /// The poles that fall to a sensor are not self-conjugate.
    #[error("the poles {} for {sensor} are not self-conjugate", format_poles(poles))]
    NotSelfConjugate {
        /// The sensor.
        sensor: String,
        /// Its share, 1/s.
        poles: Vec<Pole>,
    },
    /// E is singular.
    #[error("the matrix E is singular")]
    Singular,
    /// Not one noise intensity per state or sensor.
    #[error("{actual} noise intensities for {expected} {of}")]
    Noises {
        /// `states` or `sensors`.
        of: &'static str,
        /// How many are given.
        actual: usize,
        /// How many are needed.
        expected: usize,
    },
    /// A noise intensity is negative or not finite, or that of a sensor is zero.
    #[error("the noise of {name} is {value}; it must be {}", if *sensor { "above zero" } else { "zero or above" })]
    Noise {
        /// The state or sensor.
        name: String,
        /// Its intensity.
        value: f64,
        /// Whether it is a sensor.
        sensor: bool,
    },
    /// Motions that do not decay show in no sensor.
    #[error("no sensor shows {}, and the modes {} do not decay", hidden.join("; nor "), format_poles(modes))]
    NotDetectable {
        /// The modes, 1/s.
        modes: Vec<Pole>,
        /// As text.
        hidden: Vec<String>,
    },
    /// Combinations of states that no noise moves and that do not decay: the filter would ignore the sensors.
    #[error("no noise acts on {}: the filter would stop correcting it; give it a noise intensity", combinations.join("; "))]
    Noiseless {
        /// As text.
        combinations: Vec<String>,
    },
    /// The Riccati equation has no solution that floating point can find.
    #[error("the Riccati equation of the filter: {0}")]
    Riccati(RiccatiError),
}

fn only(observable: &[String]) -> String {
    if observable.is_empty() {
        String::new()
    } else {
        format!(" (observable constant torques: only {})", listed(observable))
    }
}
