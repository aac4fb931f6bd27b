//! Controller blocks for firmware and for the simulation: the same code in both.
//!
//! `no_std`, no heap, no panic: a block reads slices, writes slices, and stops at the shorter one. Gains are data that
//! the `kardan` library designs; a firmware project stores them as constants. Memory belongs to the caller. Where a
//! result cannot be computed (a reading is NaN or infinite, a sum overflows, a matrix is singular), the block reports
//! it by the return value (`false`, `None` or a [`Health`]) and leaves its last output unchanged. No block ever writes
//! a number that is not finite. README.md shows a controller in firmware and its cost.
//!
//! | block | what it does |
//! |---|---|
//! | [`Noninteracting`] | decoupling by constant gains on the linear model |
//! | [`ComputedTorque`] | decoupling on the nonlinear model, constraint torques as outputs |
//! | [`StateSpace`] | dynamic controllers, trajectory planners, observers |
//! | [`ModelObserver`] | observer on the nonlinear model |
//! | [`Regulator`] | control designed for a sample time: observer, reference model, feedback, bounds, [`Governor`] |
//! | [`ScheduledRegulator`] | the same for a nonlinear plant: gains scheduled by an angle with a [`Schedule`] |
//! | [`hold`] | replaces invalid readings by the last valid ones |
//! | [`Pid`], [`TransferFunction`], [`Integrator`], [`Delay`] | a program of signals: controllers, filters, memories |
//! | [`Saturation`], [`DeadZone`], [`RateLimit`], [`Hysteresis`] | its limits and switches |
//! | [`Observer`] | estimates the states of a linear plant from measurements |
//! | [`Monitor`], [`StateMachine`] | detect faults, and switch the mode of operation |
//! | [`Mechanism`] | the nonlinear model itself: angles, inertia, forces |
//! | [`Plan`] | a model as a list of operations, for one evaluation or several side by side ([`Lanes`]) |
//! | [`functions`] | sines, roots and logarithms with the same bits everywhere |
//! | [`PositionLoop`], [`Channel`], [`Bounds`], [`Gain`] | the parts of these blocks |
//!
//! ```
//! use kardan_rt::PositionLoop;
//! let rack = PositionLoop { natural_frequency: 20.0, damping_ratio: 0.7 };
//! // At the reference and at rest, the only request is the compensation of the load.
//! assert_eq!(rack.acceleration(1.0, 1.0, 0.0, 0.5), Some(-0.5));
//! ```
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![deny(clippy::as_conversions, clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::integer_division)]
#![deny(clippy::disallowed_methods)]

#[cfg(feature = "std")]
extern crate std;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod bounds;
mod channel;
mod computed_torque;
mod dense;
mod feedback;
mod format;
pub mod functions;
mod governor;
mod mechanism;
mod model_observer;
mod noninteracting;
mod number;
mod plan;
mod position_loop;
mod real;
mod regulator;
mod schedule;
mod scheduled_regulator;
mod signals;
mod state_space;

pub use bounds::Bounds;
pub use channel::Channel;
pub use computed_torque::{ComputedTorque, Situation, Task};
pub use feedback::Gain;
pub use governor::Governor;
pub use mechanism::{Evaluation, Mechanism};
pub use model_observer::{ModelObserver, Row, Sensor};
pub use noninteracting::{Measurement, Noninteracting};
pub use number::{Arithmetic, Lanes, Number};
pub use plan::{Operator, Plan, Run, Table};
pub use position_loop::PositionLoop;
pub use real::Real;
pub use regulator::{Health, Regulator, RegulatorState, hold};
pub use schedule::Schedule;
pub use scheduled_regulator::ScheduledRegulator;
pub use signals::{DeadZone, Delay, Hysteresis, Integrator, Manual, Monitor, Observer, Pid, RateLimit};
pub use signals::{Saturation, StateMachine, TransferFunction, Transition};
pub use state_space::StateSpace;
