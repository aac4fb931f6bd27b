//! Runs of a closed loop: adaptive integration of high order, located events, set-valued friction, faults, and sampled controllers.
//!
//! It knows no files, no elements and no analysis. Begin with [`Simulation`] (a loop stepped from outside), [`Scenario`] and [`Setup`].
//!
//! ```
//! use kardan::{model, study};
//! use kardan_simulate::{Setup, Simulation, Tolerance};
//!
//! let (prepared, _) = study::prepare(model::builtin("two-bodies").unwrap().source);
//! let variant = &prepared.variants[0];
//! let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
//! let mut bodies = Simulation::new(setup, Tolerance::default());
//! bodies.advance(0.5)?;
//! assert_eq!(bodies.time(), 0.5);
//! # Ok::<(), kardan_simulate::SimulationError>(())
//! ```
#![deny(clippy::disallowed_methods)]

mod compiled_plan;
mod counts;
mod dop853;
mod drive;
mod ensemble;
mod failing_sensor;
mod faults;
pub mod friction;
mod halving;
mod impact;
mod integrator;
mod linear;
mod machine;
mod outputs;
mod radau;
mod readings;
mod recurrence;
mod rounding;
mod run;
mod sampled_runtime;
mod sampler;
mod scenario;
mod simulation;
mod stiffness;
mod taylor;

pub use counts::{EncoderReading, FlippedReading};
pub use ensemble::{Ensemble, LaneRun};
pub use faults::{
    Failing, Faults, MechanicalFault, MechanicalFaultKind, MotorFault, MotorFaultKind, SensorFault, SensorFaultKind,
    UnitFault, UnitFaultKind,
};
pub use machine::{Machine, Setup};
pub use outputs::signal_names;
pub use run::{Method, Ready, RunResult, Tolerance, UNJAM, locking_gears, simulate};
pub use scenario::{Profile, Recorded, Scenario, SignalEvent, Source, SourceSignal, SourceTarget};
pub use simulation::{InputId, SignalId, Simulation, SimulationError, Snapshot};
