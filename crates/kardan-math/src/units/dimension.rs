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

impl Dimension {
    /// A number without a unit.
    pub const NONE: Self = Self::mechanical(0, 0, 0, 0);
    /// An angle \[rad\].
    pub const ANGLE: Self = Self::mechanical(0, 0, 0, 1);
    /// An angular velocity [rad/s].
    pub const ANGULAR_VELOCITY: Self = Self::mechanical(0, 0, -1, 1);
    /// An angular acceleration [rad/s^2].
    pub const ANGULAR_ACCELERATION: Self = Self::mechanical(0, 0, -2, 1);
    /// A torque, or an energy [N m].
    pub const TORQUE: Self = Self::mechanical(1, 2, -2, 0);
    /// The rate of a torque, or a power [N m/s].
    pub const TORQUE_RATE: Self = Self::mechanical(1, 2, -3, 0);
    /// A moment of inertia [kg m^2].
    pub const INERTIA: Self = Self::mechanical(1, 2, 0, 0);
    /// A torsional stiffness [N m/rad].
    pub const STIFFNESS: Self = Self::mechanical(1, 2, -2, -1);
    /// A torsional damping [N m s/rad].
    pub const DAMPING: Self = Self::mechanical(1, 2, -1, -1);
    /// A length, or the position of a mass \[m\].
    pub const LENGTH: Self = Self::mechanical(0, 1, 0, 0);
    /// A velocity [m/s].
    pub const VELOCITY: Self = Self::mechanical(0, 1, -1, 0);
    /// An acceleration [m/s^2].
    pub const ACCELERATION: Self = Self::mechanical(0, 1, -2, 0);
    /// A force \[N\].
    pub const FORCE: Self = Self::mechanical(1, 1, -2, 0);
    /// The rate of a force [N/s].
    pub const FORCE_RATE: Self = Self::mechanical(1, 1, -3, 0);
    /// A mass \[kg\].
    pub const MASS: Self = Self::mechanical(1, 0, 0, 0);
    /// The stiffness of a spring between masses [N/m].
    pub const LINEAR_STIFFNESS: Self = Self::mechanical(1, 0, -2, 0);
    /// The damping between masses [N s/m].
    pub const LINEAR_DAMPING: Self = Self::mechanical(1, 0, -1, 0);
    /// A length for each angle: a radius, or the lead of a screw over its turn [m/rad].
    pub const LENGTH_PER_ANGLE: Self = Self::mechanical(0, 1, 0, -1);
    /// A time \[s\].
    pub const TIME: Self = Self::mechanical(0, 0, 1, 0);
    /// A frequency [1/s].
    pub const FREQUENCY: Self = Self::mechanical(0, 0, -1, 0);
    /// An electric charge \[C\].
    pub const CHARGE: Self = Self::electrical(0, 0, 1, 1);
    /// An electric current \[A\].
    pub const CURRENT: Self = Self::electrical(0, 0, 0, 1);
    /// A voltage \[V\].
    pub const VOLTAGE: Self = Self::electrical(1, 2, -3, -1);
    /// A resistance \[Ohm\].
    pub const RESISTANCE: Self = Self::electrical(1, 2, -3, -2);
    /// An inductance \[H\].
    pub const INDUCTANCE: Self = Self::electrical(1, 2, -2, -2);
    /// A capacitance \[F\].
    pub const CAPACITANCE: Self = Self::electrical(-1, -2, 4, 2);
    /// A torque per current [N m/A], which is a voltage per angular velocity [V s/rad] too.
    pub const TORQUE_CONSTANT: Self = Self::electrical(1, 2, -2, -1);
    /// A force per current [N/A], which is a voltage per velocity [V s/m] too.
    pub const FORCE_CONSTANT: Self = Self::electrical(1, 1, -2, -1);

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
