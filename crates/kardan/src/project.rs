//! The entry point: a model, from a file or built by a program, with all operations on it.
//!
//! [`Project`] is a model read once; [`Builder`] writes one with a typed struct for each table of a model file. The keyword in the
//! file, the struct, its module and the page of the manual (`kardan elements`) have one name and come from one registry.

pub use crate::study::Project;
pub use kardan_elements::block::{
    DeadZone, Delay, Gain, Hold, Hysteresis, Integrator, LeadLag, LowPass, Monitor, ObserverBlock, Pid, RateLimit,
    Saturation, StateMachine, StateMachineTransition, TableBlock, TransferFunction,
};
pub use kardan_elements::element::{
    Brake, Capacitor, Clutch, Constraint, Disturbance, Driver, EndStop, Gear, HarmonicDrive, Inductor, Lock, Mass,
    Motor, OneWayClutch, Planetary, PrescribedMotion, Pulley, RackAndPinion, Resistor, Screw, Sensor, Shaft,
    SpringDamper, Torque, Transformer, UniversalJoint, VoltageSource,
};
pub use kardan_elements::manoeuvre::{Manoeuvre, Path};
pub use kardan_elements::signal::{
    Chirp, ExpressionSignal, Multisine, MultisineLine, Noise, Pulses, Ramp, Sine, SineWithDwell, SmoothStep,
    TableSignal,
};
pub use kardan_model::tables::*;
pub use kardan_model::{BUILTIN, Builder, Builtin, builtin};
pub use kardan_schema::entries::{Entries, Place};
pub use kardan_schema::schema::{
    BlockKeys, ElementKeys, EntryValue, Keys, LawKeys, Lists, Named, Names, Quantities, Quantity, SignalKeys,
};
pub use kardan_synthesis::{
    ComputedTorque, ComputedTorqueChannel, Decoupling, DecouplingChannel, Flatness, FlatnessChannel, Lqr, LqrChannel,
    Noninteracting, NoninteractingChannel, Observer, PolePlacement, PolePlacementChannel, PositionLoop, Program,
    ProgramReference, SampledNoninteracting, SampledNoninteractingChannel,
};
