//! Additional torques besides the terms of a model, each linear in one coefficient.

/// An additional torque besides the terms of a model: one more column for each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extra {
    /// Along the direction of a friction.
    Friction {
        /// Number of the friction in the equations.
        friction: usize,
        /// The torque along it.
        law: ExtraFriction,
    },
    /// The offset of a torque sensor: the torque is τ − o.
    Offset {
        /// Number of the input.
        input: usize,
    },
    /// `−p sgn(twist)`: a spring s behind a backlash of the width 2b has the torque `s (twist − b sgn(twist))` in contact, and
    /// p = s b.
    Backlash {
        /// Number of the spring in the equations.
        spring: usize,
        /// Twist from which contact is certain, rad; below it contact is unknown.
        clear: f64,
    },
    /// `κ |T| sgn(v)`: load-dependent gear friction, while the first body drives or (`back`) is driven.
    Teeth {
        /// Their number.
        teeth: usize,
        /// Whether the first body is driven.
        back: bool,
    },
    /// `−p ∂τ/∂p`: torques that expressions give, linear in a parameter p.
    Law {
        /// Number of the parameter.
        parameter: usize,
    },
}

/// An additional torque along the direction of a friction; v is the speed along it, and windows with an unknown sign of v carry no
/// information about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ExtraFriction {
    /// `s sgn(v) shape(|v|)`: the excess friction at low speed; the column is that of the Coulomb torque, and the speed is given for
    /// the shape.
    Stribeck,
    /// `m |τ| sgn(v)`: a loss proportional to the transmitted torque, as in a strain-wave gear; τ is that of the input of this number.
    Load(usize),
    /// `d`: friction that depends on the direction of motion is `c + d` forwards and `c − d` backwards.
    Sense,
    /// `d |v|`: the same of damping.
    SenseDamping,
    /// `k v |v|`, as of air.
    Quadratic,
    /// `c sgn(v)` in one recording and `−c sgn(v)` in another: how friction differs from its mean over recordings.
    Recording {
        /// The recording.
        recording: usize,
        /// The last recording of those whose differences sum to zero.
        last: usize,
    },
    /// `r t sgn(v)`: friction that changes with the time t since the recording began.
    Drift,
    /// `a h` for the harmonic h of this number, `cos nφ` or `sin nφ`: torque that depends on the angle, independent of the speed.
    Cogging(usize),
    /// `a h sgn(v)`: friction that depends on the angle.
    Ripple(usize),
}

impl Extra {
    /// The number of its harmonic, if it depends on one.
    pub(super) fn harmonic(&self) -> Option<usize> {
        match self {
            Self::Friction { law: ExtraFriction::Cogging(harmonic) | ExtraFriction::Ripple(harmonic), .. } => {
                Some(*harmonic)
            }
            _ => None,
        }
    }
}
