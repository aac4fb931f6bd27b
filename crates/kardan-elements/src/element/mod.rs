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

pub use brake::Brake;
pub use capacitor::Capacitor;
pub use clutch::Clutch;
pub use constraint::Constraint;
pub use coupled_inductors::CoupledInductors;
pub use current_source::CurrentSource;
pub use dc_motor::DcMotor;
pub use disturbance::Disturbance;
pub use driver::Driver;
pub use end_stop::EndStop;
pub use gear::Gear;
pub use harmonic_drive::HarmonicDrive;
pub use inductor::Inductor;
pub use lock::Lock;
pub use mass::Mass;
pub use motor::Motor;
pub use one_way_clutch::OneWayClutch;
pub use planetary::Planetary;
pub use prescribed_motion::PrescribedMotion;
pub use pulley::Pulley;
pub use rack_and_pinion::RackAndPinion;
pub use resistor::Resistor;
pub use screw::Screw;
pub use sensor::Sensor;
pub use shaft::Shaft;
pub use shared::composite::quoted;
pub use shared::gear_loss::{LOAD, LOSS, SPEED};
pub use shared::kind::{Element, KeyError};
pub use spring_damper::SpringDamper;
pub use state::State;
pub use torque::Torque;
pub use transformer::Transformer;
pub use universal_joint::{UniversalJoint, UniversalJointCurve};
pub use vehicle::Vehicle;
pub use voltage_source::VoltageSource;

use driver::DRIVER;
use kardan_schema::entries::Entries;
use vehicle::VEHICLE;

/// All kinds of elements.
pub const REGISTRY: &[Element] = &[
    VEHICLE,
    DRIVER,
    shaft::SHAFT,
    mass::MASS,
    harmonic_drive::HARMONIC_DRIVE,
    planetary::PLANETARY,
    gear::GEAR,
    rack_and_pinion::RACK_AND_PINION,
    screw::SCREW,
    pulley::PULLEY,
    spring_damper::SPRING_DAMPER,
    universal_joint::UNIVERSAL_JOINT,
    constraint::CONSTRAINT,
    clutch::CLUTCH,
    brake::BRAKE,
    one_way_clutch::ONE_WAY_CLUTCH,
    lock::LOCK,
    end_stop::END_STOP,
    prescribed_motion::PRESCRIBED_MOTION,
    motor::MOTOR,
    disturbance::DISTURBANCE,
    torque::TORQUE,
    state::STATE,
    sensor::SENSOR,
    inductor::INDUCTOR,
    resistor::RESISTOR,
    capacitor::CAPACITOR,
    transformer::TRANSFORMER,
    coupled_inductors::COUPLED_INDUCTORS,
    voltage_source::VOLTAGE_SOURCE,
    current_source::CURRENT_SOURCE,
    dc_motor::DC_MOTOR,
];

/// The kind with that keyword.
pub fn find(keyword: &str) -> Option<&'static Element> {
    REGISTRY.iter().find(|element| element.keyword == keyword)
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
