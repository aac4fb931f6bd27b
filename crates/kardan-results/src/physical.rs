//! Physical kinds of numbers with their SI units, and display units.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use schemars::JsonSchema;
use serde::Serialize;

use kardan_math::units::{Dimension, parse_quantity};

/// The physical kind of a signal; fixes its SI unit and the unit a plot prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, JsonSchema)]
pub enum Physical {
    /// Angle, rad.
    #[serde(rename = "rad")]
    Angle,
    /// Angular velocity, rad/s.
    #[serde(rename = "rad/s")]
    Speed,
    /// Torque, N m.
    #[serde(rename = "N m")]
    Torque,
    /// Energy, J.
    #[serde(rename = "J")]
    Energy,
    /// Position of a mass, m.
    #[serde(rename = "m")]
    Position,
    /// Velocity of a mass, m/s.
    #[serde(rename = "m/s")]
    Velocity,
    /// Force, N.
    #[serde(rename = "N")]
    Force,
    /// Electric charge, C.
    #[serde(rename = "C")]
    Charge,
    /// Electric current, A.
    #[serde(rename = "A")]
    Current,
    /// Voltage, or potential against ground, V.
    #[serde(rename = "V")]
    Voltage,
    /// The result of an expression of signals: its SI unit, empty for a number without a unit.
    #[serde(untagged)]
    Other(&'static str),
}

/// The units of [`Physical::Other`], each once.
static UNITS: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

impl Physical {
    /// The SI unit of the stored numbers.
    pub fn unit(self) -> &'static str {
        match self {
            Physical::Angle => "rad",
            Physical::Speed => "rad/s",
            Physical::Torque => "N m",
            Physical::Energy => "J",
            Physical::Position => "m",
            Physical::Velocity => "m/s",
            Physical::Force => "N",
            Physical::Charge => "C",
            Physical::Current => "A",
            Physical::Voltage => "V",
            Physical::Other(unit) => unit,
        }
    }

    /// The dimension of its values.
    pub fn dimension(self) -> Dimension {
        match self {
            Physical::Angle => Dimension::ANGLE,
            Physical::Speed => Dimension::ANGULAR_VELOCITY,
            Physical::Torque | Physical::Energy => Dimension::TORQUE,
            Physical::Position => Dimension::LENGTH,
            Physical::Velocity => Dimension::VELOCITY,
            Physical::Force => Dimension::FORCE,
            Physical::Charge => Dimension::CHARGE,
            Physical::Current => Dimension::CURRENT,
            Physical::Voltage => Dimension::VOLTAGE,
            Physical::Other(unit) => {
                parse_quantity(&format!("1 {unit}")).map_or(Dimension::NONE, |(_, dimension)| dimension)
            }
        }
    }

    /// The kind of a value of a dimension.
    pub fn of(dimension: Dimension) -> Self {
        use Physical::{Angle, Charge, Current, Force, Position, Speed, Torque, Velocity, Voltage};
        let kinds = [Angle, Speed, Torque, Position, Velocity, Force, Charge, Current, Voltage];
        let found = kinds.into_iter().find(|physical| physical.dimension() == dimension);
        found.unwrap_or_else(|| Physical::of_unit(&dimension.si()))
    }

    /// The kind of a value with another unit, as of `motor.tau * shaft.w`. Each unit is kept through the life of the process.
    pub fn of_unit(unit: &str) -> Self {
        let mut units = UNITS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(interned) = units.get(unit) {
            return Self::Other(interned);
        }
        let leaked: &'static str = String::from(unit).leak();
        units.insert(leaked);
        Self::Other(leaked)
    }

    /// The word for an axis label.
    pub fn word(self) -> &'static str {
        match self {
            Physical::Angle => "angle",
            Physical::Speed => "angular velocity",
            Physical::Torque => "torque",
            Physical::Energy => "energy",
            Physical::Position => "position",
            Physical::Velocity => "velocity",
            Physical::Force => "force",
            Physical::Charge => "charge",
            Physical::Current => "current",
            Physical::Voltage => "voltage",
            Physical::Other("") => "number",
            Physical::Other("W") => "power",
            Physical::Other(_) => "quantity",
        }
    }
}

/// A display unit other than the SI unit.
///
/// ```
/// use kardan_results::DisplayUnit;
/// let degrees = DisplayUnit { unit: "deg".into(), size: std::f64::consts::PI / 180.0 };
/// assert!((degrees.of(std::f64::consts::PI) - 180.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DisplayUnit {
    /// Its text in the model file: `deg`.
    pub unit: String,
    /// Its size in the SI unit.
    pub size: f64,
}

impl DisplayUnit {
    /// An SI value in this unit.
    pub fn of(&self, value: f64) -> f64 {
        value / self.size
    }
}
