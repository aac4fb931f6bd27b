//! Signals: functions of time by name, one file for each kind.
//!
//! [`REGISTRY`] is the one list from which the parser, its checks, the manual and the tests are derived. Smooth kinds are expressions of
//! the time; kinds with jumps or kinks consist of pieces between exact breakpoints, at which steps of the integrator end.

mod chirp;
mod expression;
mod multisine;
mod noise;
mod pulses;
mod ramp;
mod sine;
mod sine_with_dwell;
mod smooth_step;
mod table;
mod writer;

pub use writer::{MOST_BREAKPOINTS, Refused, Samples, SignalKind, SignalWriter};

registry! {
    /// All kinds of signals.
    SignalKind:
    sine::{Sine} => SINE,
    chirp::{Chirp} => CHIRP,
    pulses::{Pulses} => PULSES,
    ramp::{Ramp} => RAMP,
    smooth_step::{SmoothStep} => SMOOTH_STEP,
    sine_with_dwell::{SineWithDwell} => SINE_WITH_DWELL,
    multisine::{Multisine, MultisineLine} => MULTISINE,
    noise::{Noise} => NOISE,
    table::{TableSignal} => TABLE,
    expression::{ExpressionSignal} => EXPRESSION,
}
