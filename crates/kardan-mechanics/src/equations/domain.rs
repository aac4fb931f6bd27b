//! The physical domains of coordinates, with the names, dimensions and units of their quantities.

use kardan_math::units::Dimension;
use kardan_results::signal_name::Quantity;

/// The kind of a coordinate. All laws are the same in both domains, only their units differ \[diss. Table 4.3\]: an inertia is
/// an inductance (H), a damping a resistance (Ohm), a stiffness an elastance (1/F), a torque a voltage (V).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Domain {
    /// The angle of a shaft, rad.
    #[default]
    Rotation,
    /// The position of a mass, m: an inertia is a mass (kg), a torque a force (N).
    Translation,
    /// The charge that has gone through a branch of a circuit, C.
    Charge,
    /// The integral of a number over time, s: the number itself, a state of first order, is its rate. Its inertia is one.
    Number,
}

impl Domain {
    /// The coordinate and its rate.
    pub fn motion(self) -> [Quantity; 2] {
        match self {
            Self::Rotation => [Quantity::Angle, Quantity::Speed],
            Self::Translation => [Quantity::Position, Quantity::Velocity],
            Self::Charge => [Quantity::Charge, Quantity::Current],
            Self::Number => [Quantity::Sum, Quantity::State],
        }
    }

    /// The dimensions of coordinate and rate.
    pub fn dimensions(self) -> [Dimension; 2] {
        match self {
            Self::Rotation => [Dimension::ANGLE, Dimension::ANGULAR_VELOCITY],
            Self::Translation => [Dimension::LENGTH, Dimension::VELOCITY],
            Self::Charge => [Dimension::CHARGE, Dimension::CURRENT],
            Self::Number => [Dimension::TIME, Dimension::NONE],
        }
    }

    /// The effort along it.
    pub fn effort(self) -> Quantity {
        match self {
            Self::Rotation => Quantity::Torque,
            Self::Translation => Quantity::Force,
            Self::Charge => Quantity::Voltage,
            Self::Number => Quantity::Change,
        }
    }

    /// The dimension of the effort.
    pub fn effort_dimension(self) -> Dimension {
        match self {
            Self::Rotation => Dimension::TORQUE,
            Self::Translation => Dimension::FORCE,
            Self::Charge => Dimension::VOLTAGE,
            Self::Number => Dimension::FREQUENCY,
        }
    }

    /// The noun for the effort.
    pub fn effort_word(self) -> &'static str {
        match self {
            Self::Rotation => "torque",
            Self::Translation => "force",
            Self::Charge => "voltage",
            Self::Number => "rate",
        }
    }

    /// SI units of inertia, damping and stiffness.
    pub fn units(self) -> [&'static str; 3] {
        match self {
            Self::Rotation => ["kg m^2", "N m s/rad", "N m/rad"],
            Self::Translation => ["kg", "N s/m", "N/m"],
            Self::Charge => ["H", "Ohm", "1/F"],
            Self::Number => ["1", "1/s", "1/s^2"],
        }
    }

    /// The noun for a body with such a coordinate.
    pub fn carrier(self) -> &'static str {
        match self {
            Self::Rotation => "shaft",
            Self::Translation => "mass",
            Self::Charge => "branch",
            Self::Number => "state",
        }
    }

    /// Whether only its rate matters: its position is a mere integral.
    pub fn counts(self) -> bool {
        matches!(self, Self::Charge | Self::Number)
    }
}
