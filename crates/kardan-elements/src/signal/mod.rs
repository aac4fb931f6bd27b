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

pub use chirp::Chirp;
pub use expression::ExpressionSignal;
pub use multisine::{Multisine, MultisineLine};
pub use noise::Noise;
pub use pulses::Pulses;
pub use ramp::Ramp;
pub use sine::Sine;
pub use sine_with_dwell::SineWithDwell;
pub use smooth_step::SmoothStep;
pub use table::TableSignal;
pub use writer::{MOST_BREAKPOINTS, Refused, Samples, SignalKind, SignalWriter};

/// All kinds of signals.
pub const REGISTRY: &[SignalKind] = &[
    sine::SINE,
    chirp::CHIRP,
    pulses::PULSES,
    ramp::RAMP,
    smooth_step::SMOOTH_STEP,
    sine_with_dwell::SINE_WITH_DWELL,
    multisine::MULTISINE,
    noise::NOISE,
    table::TABLE,
    expression::EXPRESSION,
];

/// The kind with that keyword.
pub fn find(keyword: &str) -> Option<&'static SignalKind> {
    REGISTRY.iter().find(|kind| kind.keyword == keyword)
}
