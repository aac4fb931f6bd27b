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

/// Each kind with its SI unit, its dimension, and the word for an axis label.
static KINDS: [(Physical, &str, Dimension, &str); 10] = [
    (Physical::Angle, "rad", Dimension::ANGLE, "angle"),
    (Physical::Speed, "rad/s", Dimension::ANGULAR_VELOCITY, "angular velocity"),
    (Physical::Torque, "N m", Dimension::TORQUE, "torque"),
    // Of a value with this dimension the first one is its kind.
    (Physical::Energy, "J", Dimension::TORQUE, "energy"),
    (Physical::Position, "m", Dimension::LENGTH, "position"),
    (Physical::Velocity, "m/s", Dimension::VELOCITY, "velocity"),
    (Physical::Force, "N", Dimension::FORCE, "force"),
    (Physical::Charge, "C", Dimension::CHARGE, "charge"),
    (Physical::Current, "A", Dimension::CURRENT, "current"),
    (Physical::Voltage, "V", Dimension::VOLTAGE, "voltage"),
];

impl Physical {
    fn row(self) -> &'static (Physical, &'static str, Dimension, &'static str) {
        KINDS.iter().find(|(kind, ..)| *kind == self).unwrap_or(&KINDS[0])
    }

    /// The SI unit of the stored numbers.
    pub fn unit(self) -> &'static str {
        match self {
            Physical::Other(unit) => unit,
            _ => self.row().1,
        }
    }

    /// The dimension of its values.
    pub fn dimension(self) -> Dimension {
        match self {
            Physical::Other(unit) => {
                parse_quantity(&format!("1 {unit}")).map_or(Dimension::NONE, |(_, dimension)| dimension)
            }
            _ => self.row().2,
        }
    }

    /// The kind of a value of a dimension.
    pub fn of(dimension: Dimension) -> Self {
        let found = KINDS.iter().find(|(_, _, own, _)| *own == dimension);
        found.map_or_else(|| Physical::of_unit(&dimension.si()), |(physical, ..)| *physical)
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
            Physical::Other("") => "number",
            Physical::Other("W") => "power",
            Physical::Other(_) => "quantity",
            _ => self.row().3,
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
