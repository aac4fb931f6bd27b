//! Observers that estimate states and unknown constant torques \[diss. (6.41)-(6.46)\], for any model and sensor set.
//!
//! [`distinguishable`] determines which torques the sensors can distinguish, [`extend`] adds them to the states, [`luenberger`] gives
//! an exact gain with chosen poles, [`kalman`] one for given noise.

mod distinguish;
mod distinguishable;
mod error;
mod extend;
mod kalman;
mod luenberger;

pub use distinguish::{MOST_SETS, distinguishable};
pub use distinguishable::Distinguishable;
pub use error::ObserverError;
pub use extend::extend;
pub use kalman::{KalmanGain, Noise, kalman};
pub use luenberger::{ObserverGain, luenberger};
