//! Blocks of signals: filters, limits, controllers and machines that a program of an ECU is made of.
//!
//! Each block is written once over [`Arithmetic`](crate::Arithmetic): the same code runs in `f32` and `f64` and in
//! lanes, and records itself as expressions, by which the library `kardan` linearises it. So blocks select and never
//! branch. The memory of a block belongs to the caller; its first entry is the last output, and all zeros are a valid
//! start.

mod dead_zone;
mod delay;
mod hysteresis;
mod integrator;
mod monitor;
mod observer;
mod pid;
mod rate_limit;
mod saturation;
mod state_machine;
mod transfer_function;

pub use dead_zone::DeadZone;
pub use delay::Delay;
pub use hysteresis::Hysteresis;
pub use integrator::Integrator;
pub use monitor::Monitor;
pub use observer::Observer;
pub use pid::{Manual, Pid};
pub use rate_limit::RateLimit;
pub use saturation::Saturation;
pub use state_machine::{StateMachine, Transition};
pub use transfer_function::TransferFunction;

use crate::Arithmetic;

/// 0.
fn zero<N: Arithmetic>() -> N {
    N::whole(0)
}

/// 1.
fn one<N: Arithmetic>() -> N {
    N::whole(1)
}

/// The smaller one; the second where one is NaN.
fn smaller<N: Arithmetic>(a: N, b: N) -> N {
    a.select(b, a, b)
}

/// The larger one; the first where one is NaN.
fn larger<N: Arithmetic>(a: N, b: N) -> N {
    a.select(b, b, a)
}

/// Between two bounds, where they exist.
fn clamped<N: Arithmetic>(x: N, low: Option<N>, high: Option<N>) -> N {
    let x = low.map_or(x, |low| larger(x, low));
    high.map_or(x, |high| smaller(x, high))
}

/// Whether a switch is on: above a half. 1 or 0.
fn is_on<N: Arithmetic>(switch: N) -> N {
    half::<N>().select(switch, one(), zero())
}

/// 1/2.
fn half<N: Arithmetic>() -> N {
    one::<N>() / N::whole(2)
}

/// 0 where a number is finite, NaN where it is not.
#[allow(clippy::eq_op)] // infinity minus itself is NaN
fn zero_or_nan<N: Arithmetic>(x: N) -> N {
    x - x
}

/// New entries of a memory, for each lane all of them or none: where an input or an entry is not a number, the memory
/// stays unchanged. Returns whether all lanes are new.
fn store<N: Arithmetic, const K: usize>(state: &mut [N; K], new: [N; K], inputs: &[N]) -> bool {
    let nan_sum = inputs.iter().chain(&new).fold(zero(), |sum: N, x| sum + zero_or_nan(*x));
    let stays = nan_sum.finite_or(one());
    for (old, new) in state.iter_mut().zip(new) {
        *old = half::<N>().select(stays, *old, new);
    }
    nan_sum.all_finite()
}
