//! Additional torques besides the terms of a model, each linear in one coefficient.

/// An additional torque besides the terms of a model: one more column for each. It acts along the direction of a friction, an input or a spring of the
/// model; v is the speed along that direction, and windows with an unknown sign of v carry no information about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extra {
    /// `s sgn(v) shape(|v|)`: the excess friction at low speed; the column is that of the Coulomb torque, and the speed is given for
    /// the shape.
    Stribeck {
        /// Number of the friction in the equations.
        friction: usize,
    },
    /// `m |τ| sgn(v)`: a loss proportional to the transmitted torque, as in a strain-wave gear.
    Load {
        /// Number of the friction in the equations.
        friction: usize,
        /// Number of the input whose torque it is.
        input: usize,
    },
    /// `d`: friction that depends on the direction of motion is `c + d` forwards and `c − d` backwards.
    Sense {
        /// Number of the friction in the equations.
        friction: usize,
    },
    /// `d |v|`: the same of damping.
    SenseDamping {
        /// Number of the friction in the equations.
        friction: usize,
    },
    /// `k v |v|`, as of air.
    Quadratic {
        /// Number of the friction in the equations.
        friction: usize,
    },
    /// `c sgn(v)` in one recording and `−c sgn(v)` in another: how friction differs from its mean over recordings.
    Recording {
        /// Number of the friction in the equations.
        friction: usize,
        /// The recording.
        recording: usize,
        /// The last recording of those whose differences sum to zero.
        last: usize,
    },
    /// `r t sgn(v)`: friction that changes with the time t since the recording began.
    Drift {
        /// Number of the friction in the equations.
        friction: usize,
    },
    /// `a h` for a harmonic h of an angle, `cos nφ` or `sin nφ`: torque that depends on the angle, independent of the speed.
    Cogging {
        /// Number of the friction in the equations.
        friction: usize,
        /// Number of the harmonic.
        harmonic: usize,
    },
    /// `a h sgn(v)`: friction that depends on the angle.
    Ripple {
        /// Number of the friction in the equations.
        friction: usize,
        /// Number of the harmonic.
        harmonic: usize,
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

impl Extra {
    /// The friction along whose direction it acts, if it does.
    pub(super) fn friction(&self) -> Option<usize> {
        match *self {
            Self::Stribeck { friction }
            | Self::Load { friction, .. }
            | Self::Sense { friction }
            | Self::SenseDamping { friction }
            | Self::Quadratic { friction }
            | Self::Recording { friction, .. }
            | Self::Drift { friction }
            | Self::Cogging { friction, .. }
            | Self::Ripple { friction, .. } => Some(friction),
            Self::Offset { .. } | Self::Backlash { .. } | Self::Teeth { .. } | Self::Law { .. } => None,
        }
    }

    /// The number of its harmonic, if it depends on one.
    pub(super) fn harmonic(&self) -> Option<usize> {
        match self {
            Self::Cogging { harmonic, .. } | Self::Ripple { harmonic, .. } => Some(*harmonic),
            _ => None,
        }
    }
}
