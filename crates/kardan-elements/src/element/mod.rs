//! Elements: named groups of terms, one file each.
//!
//! [`REGISTRY`] is the one list from which the parser, its checks, the manual (`kardan elements`) and the tests are
//! derived. Adding an element is one file here and one line there.

mod brake;
mod capacitor;
mod clutch;
mod constraint;
mod coupled_inductors;
mod current_source;
mod dc_motor;
mod disturbance;
mod driver;
mod end_stop;
mod gear;
mod harmonic_drive;
mod inductor;
mod lock;
mod mass;
mod motor;
mod one_way_clutch;
mod planetary;
mod prescribed_motion;
mod pulley;
mod rack_and_pinion;
mod resistor;
mod screw;
mod sensor;
mod shaft;
mod shared;
mod spring_damper;
mod state;
mod torque;
mod transformer;
mod universal_joint;
mod vehicle;
mod voltage_source;

pub use shared::composite::quoted;
pub use shared::gear_loss::{LOAD, LOSS, SPEED};
pub use shared::kind::{Element, KeyError};

use driver::DRIVER;
use kardan_schema::entries::Entries;
use vehicle::VEHICLE;

registry! {
    /// All kinds of elements.
    Element:
    vehicle::{Vehicle} => VEHICLE,
    driver::{Driver} => DRIVER,
    shaft::{Shaft} => SHAFT,
    mass::{Mass} => MASS,
    harmonic_drive::{HarmonicDrive} => HARMONIC_DRIVE,
    planetary::{Planetary} => PLANETARY,
    gear::{Gear} => GEAR,
    rack_and_pinion::{RackAndPinion} => RACK_AND_PINION,
    screw::{Screw} => SCREW,
    pulley::{Pulley} => PULLEY,
    spring_damper::{SpringDamper} => SPRING_DAMPER,
    universal_joint::{UniversalJoint, UniversalJointCurve} => UNIVERSAL_JOINT,
    constraint::{Constraint} => CONSTRAINT,
    clutch::{Clutch} => CLUTCH,
    brake::{Brake} => BRAKE,
    one_way_clutch::{OneWayClutch} => ONE_WAY_CLUTCH,
    lock::{Lock} => LOCK,
    end_stop::{EndStop} => END_STOP,
    prescribed_motion::{PrescribedMotion} => PRESCRIBED_MOTION,
    motor::{Motor} => MOTOR,
    disturbance::{Disturbance} => DISTURBANCE,
    torque::{Torque} => TORQUE,
    state::{State} => STATE,
    sensor::{Sensor} => SENSOR,
    inductor::{Inductor} => INDUCTOR,
    resistor::{Resistor} => RESISTOR,
    capacitor::{Capacitor} => CAPACITOR,
    transformer::{Transformer} => TRANSFORMER,
    coupled_inductors::{CoupledInductors} => COUPLED_INDUCTORS,
    voltage_source::{VoltageSource} => VOLTAGE_SOURCE,
    current_source::{CurrentSource} => CURRENT_SOURCE,
    dc_motor::{DcMotor} => DC_MOTOR,
}

/// The tables that a composite element expands to: by its keyword, its name, its keys, and whether these name a mass.
pub fn parts(keyword: &str, name: &str, entries: &Entries, translational: bool) -> Option<Entries> {
    match keyword {
        _ if keyword == VEHICLE.keyword => vehicle::parts(name, entries, translational),
        _ if keyword == DRIVER.keyword => driver::parts(name, entries),
        _ => None,
    }
}

/// The composite kinds.
pub const COMPOSITES: [&Element; 2] = [&VEHICLE, &DRIVER];

/// Whether it is the keyword of a composite kind.
pub fn is_composite(keyword: &str) -> bool {
    COMPOSITES.iter().any(|kind| kind.keyword == keyword)
}
