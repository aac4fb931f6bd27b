//! Kinds of quantities.

/// The kind of quantity of a number: powers of the seven SI base units and, as a tag of its own, of the angle.
///
/// Two dimensions match only if they are equal *including* the angle: `N m` is a torque, `N m/rad` a stiffness.
///
/// ```
/// use kardan_math::units::Dimension;
/// assert_ne!(Dimension::TORQUE, Dimension::STIFFNESS);
/// assert_eq!(Dimension::STIFFNESS.si(), "N m/rad");
/// assert_eq!(Dimension::STIFFNESS.word(), Some("torsional stiffness"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Dimension {
    /// Powers of kg, m, s, A, K, mol, cd.
    pub exponents: [i8; 7],
    /// Power of the angle (rad, deg and rev alike).
    pub angle: i8,
}

/// A dimension that has a name.
pub(super) struct NamedDimension {
    pub dimension: Dimension,
    pub word: &'static str,
    pub si: &'static str,
    pub example: &'static str,
}

/// Dimensions with names: the constant, its powers, the field's word for it, its SI unit, and a quantity as an author writes it.
macro_rules! named_dimensions {
    ($($(#[$doc:meta])* $name:ident = $of:ident($($power:literal),*): $word:literal, $si:literal, $example:literal;)*) => {
        impl Dimension {
            $($(#[$doc])* pub const $name: Self = Self::$of($($power),*);)*
        }

        pub(super) static NAMED_DIMENSIONS: [NamedDimension; 30] =
            [$(NamedDimension { dimension: Dimension::$name, word: $word, si: $si, example: $example }),*];
    };
}

named_dimensions! {
    /// A number without a unit.
    NONE = mechanical(0, 0, 0, 0): "number without a unit", "", "51/50";
    /// An angle \[rad\].
    ANGLE = mechanical(0, 0, 0, 1): "angle", "rad", "30 deg";
    /// An angular velocity [rad/s].
    ANGULAR_VELOCITY = mechanical(0, 0, -1, 1): "angular velocity", "rad/s", "60 rpm";
    /// An angular acceleration [rad/s^2].
    ANGULAR_ACCELERATION = mechanical(0, 0, -2, 1): "angular acceleration", "rad/s^2", "10 rad/s^2";
    /// A torque, or an energy [N m].
    TORQUE = mechanical(1, 2, -2, 0): "torque", "N m", "1.3 N m";
    /// The rate of a torque, or a power [N m/s].
    TORQUE_RATE = mechanical(1, 2, -3, 0): "torque rate", "N m/s", "10 N m/s";
    /// A moment of inertia [kg m^2].
    INERTIA = mechanical(1, 2, 0, 0): "moment of inertia", "kg m^2", "130 kg mm^2";
    /// A torsional stiffness [N m/rad].
    STIFFNESS = mechanical(1, 2, -2, -1): "torsional stiffness", "N m/rad", "100 N m/rad";
    /// A torsional damping [N m s/rad].
    DAMPING = mechanical(1, 2, -1, -1): "torsional damping", "N m s/rad", "0.01 N m s/rad";
    /// A time \[s\].
    TIME = mechanical(0, 0, 1, 0): "time", "s", "2 ms";
    /// A frequency [1/s].
    FREQUENCY = mechanical(0, 0, -1, 0): "frequency", "Hz", "1 kHz";
    /// A mass \[kg\].
    MASS = mechanical(1, 0, 0, 0): "mass", "kg", "2 kg";
    /// A length, or the position of a mass \[m\].
    LENGTH = mechanical(0, 1, 0, 0): "length", "m", "20 mm";
    /// A velocity [m/s].
    VELOCITY = mechanical(0, 1, -1, 0): "velocity", "m/s", "0.1 m/s";
    /// An acceleration [m/s^2].
    ACCELERATION = mechanical(0, 1, -2, 0): "acceleration", "m/s^2", "10 m/s^2";
    /// A force \[N\].
    FORCE = mechanical(1, 1, -2, 0): "force", "N", "10 N";
    /// The rate of a force [N/s].
    FORCE_RATE = mechanical(1, 1, -3, 0): "force rate", "N/s", "100 N/s";
    /// The stiffness of a spring between masses [N/m].
    LINEAR_STIFFNESS = mechanical(1, 0, -2, 0): "translational stiffness", "N/m", "20 N/mm";
    /// The damping between masses [N s/m].
    LINEAR_DAMPING = mechanical(1, 0, -1, 0): "translational damping", "N s/m", "50 N s/m";
    /// A length for each angle: a radius, or the lead of a screw over its turn [m/rad].
    LENGTH_PER_ANGLE = mechanical(0, 1, 0, -1): "length per angle", "m/rad", "50 mm/rev";
    /// An angular momentum [N m s].
    ANGULAR_MOMENTUM = mechanical(1, 2, -1, 0): "angular momentum", "N m s", "2 N m s";
    /// A momentum [N s].
    MOMENTUM = mechanical(1, 1, -1, 0): "momentum", "N s", "2 N s";
    /// An electric charge \[C\].
    CHARGE = electrical(0, 0, 1, 1): "charge", "C", "2 uC";
    /// An electric current \[A\].
    CURRENT = electrical(0, 0, 0, 1): "current", "A", "5 A";
    /// A voltage \[V\].
    VOLTAGE = electrical(1, 2, -3, -1): "voltage", "V", "24 V";
    /// A resistance \[Ohm\].
    RESISTANCE = electrical(1, 2, -3, -2): "resistance", "Ohm", "0.5 Ohm";
    /// An inductance \[H\].
    INDUCTANCE = electrical(1, 2, -2, -2): "inductance", "H", "2 mH";
    /// A capacitance \[F\].
    CAPACITANCE = electrical(-1, -2, 4, 2): "capacitance", "F", "10 uF";
    /// A torque per current [N m/A], which is a voltage per angular velocity [V s/rad] too.
    TORQUE_CONSTANT = electrical(1, 2, -2, -1): "torque constant", "N m/A", "50 mN m/A";
    /// A force per current [N/A], which is a voltage per velocity [V s/m] too.
    FORCE_CONSTANT = electrical(1, 1, -2, -1): "force constant", "N/A", "12 N/A";
}

impl Dimension {
    /// A dimension of mass, length, time and angle.
    ///
    /// ```
    /// use kardan_math::units::Dimension;
    /// const FORCE: Dimension = Dimension::mechanical(1, 1, -2, 0);
    /// assert_eq!(FORCE.si(), "N");
    /// ```
    pub const fn mechanical(kg: i8, m: i8, s: i8, angle: i8) -> Self {
        Self { exponents: [kg, m, s, 0, 0, 0, 0], angle }
    }

    /// The translational counterpart of a rotational quantity: forces for torques, lengths for angles.
    ///
    /// ```
    /// use kardan_math::units::Dimension;
    /// assert_eq!(Dimension::STIFFNESS.translational().si(), "N/m");
    /// assert_eq!(Dimension::TIME.translational(), Dimension::TIME);
    /// ```
    #[must_use]
    pub fn translational(self) -> Self {
        match self {
            Self::ANGLE => Self::LENGTH,
            Self::ANGULAR_VELOCITY => Self::VELOCITY,
            Self::ANGULAR_ACCELERATION => Self::ACCELERATION,
            Self::TORQUE => Self::FORCE,
            Self::TORQUE_RATE => Self::FORCE_RATE,
            Self::INERTIA => Self::MASS,
            Self::STIFFNESS => Self::LINEAR_STIFFNESS,
            Self::DAMPING => Self::LINEAR_DAMPING,
            Self::TORQUE_CONSTANT => Self::FORCE_CONSTANT,
            other => other,
        }
    }

    const fn electrical(kg: i8, m: i8, s: i8, ampere: i8) -> Self {
        Self { exponents: [kg, m, s, ampere, 0, 0, 0], angle: 0 }
    }

    /// `self * other^power`, or `None` if an exponent leaves its range.
    pub fn times(&self, other: &Self, power: i32) -> Option<Self> {
        let add = |a: i8, b: i8| i8::try_from(i32::from(a) + i32::from(b) * power).ok();
        let mut product = Self { exponents: [0; 7], angle: add(self.angle, other.angle)? };
        for i in 0..7 {
            product.exponents[i] = add(self.exponents[i], other.exponents[i])?;
        }
        Some(product)
    }
}
