//! Simulation in the accurate mode: adaptive high-order integration, located events, set-valued friction.

mod counts;
pub mod dop853;
mod drive;
mod ensemble;
mod failing_sensor;
mod faults;
pub mod friction;
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
pub(crate) use ensemble::{Ensemble, LaneRun};
pub use faults::{
    Failing, Faults, MechanicalFault, MechanicalFaultKind, MotorFault, MotorFaultKind, SensorFault, SensorFaultKind,
    UnitFault, UnitFaultKind,
};
pub use machine::{Machine, Setup};
pub use outputs::signal_names;
pub use run::{Method, Ready, RunResult, Tolerance, UNJAM, simulate, teeth_that_lock};
pub use scenario::{Profile, Recorded, Scenario, SignalEvent, Source, SourceSignal, SourceTarget};
pub use simulation::{InputId, SignalId, Simulation, SimulationError, Snapshot};
