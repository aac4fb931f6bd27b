//! Unilateral and switched constraints in the expressions of the loop.

use kardan_expr::expr::Expr;
use kardan_math::num::Rational;
use kardan_math::units::Exact;
use kardan_mechanics::assemble::DirectionalTerm;
use kardan_mechanics::equations::UnilateralConstraint;
use kardan_mechanics::reduce::{Motion, Reduced};

/// The terms of a unilateral constraint in the loop.
pub(super) struct UnilateralTerms {
    /// Its torque where it does not stick, against the motion in its direction.
    pub torque: Expr,
    /// Its speed.
    pub speed: Expr,
    /// The power that it takes.
    pub loss: Expr,
    /// The inputs of its mode selection: for friction its sliding torque, for a lock its engagement, for stops and soft
    /// stops the gap and, for the latter, the contact torque while it is closed.
    pub mode_inputs: [Expr; 2],
}

impl UnilateralTerms {
    /// The sense where it is an input: for friction and clutches that of the motion, for a soft stop +1 where it is
    /// compressed, −1 where its contact has separated, 0 where it is open.
    pub fn new(
        motion: &mut Motion,
        reduced: &Reduced,
        unilateral: &DirectionalTerm<UnilateralConstraint>,
        sense: Expr,
    ) -> Self {
        let speed = motion.sum(&unilateral.row, |motion, shaft| motion.speeds[shaft]);
        let speed = motion.graph.group(speed);
        let zero = motion.graph.integer(0);
        match &unilateral.value {
            UnilateralConstraint::Friction { torque, .. } => {
                let size = motion.formula(reduced, torque);
                let torque = motion.graph.multiply(sense, size);
                let loss = motion.graph.multiply(torque, speed);
                Self { torque, speed, loss, mode_inputs: [size, zero] }
            }
            UnilateralConstraint::OneWay | UnilateralConstraint::GearLoss(_) => {
                Self { torque: zero, speed, loss: zero, mode_inputs: [zero; 2] }
            }
            UnilateralConstraint::Lock { engaged } => {
                let engaged = motion.formula(reduced, engaged);
                Self { torque: zero, speed, loss: zero, mode_inputs: [engaged, zero] }
            }
            UnilateralConstraint::Stop { offset, .. } => {
                let gap = gap(motion, unilateral, offset);
                Self { torque: zero, speed, loss: zero, mode_inputs: [gap, zero] }
            }
            UnilateralConstraint::Cushion { offset, stiffness, damping, .. } => {
                let gap = gap(motion, unilateral, offset);
                let (stiffness, damping) = (motion.exact(stiffness), motion.exact(damping));
                let graph = &mut motion.graph;
                let (spring, damper) = (graph.multiply(stiffness, gap), graph.multiply(damping, speed));
                let pull = graph.add(spring, damper);
                let pull = graph.group(pull);
                let square = graph.multiply(sense, sense);
                let half = Rational::from_parts(1.into(), 2u8.into());
                let presses = graph.sum(Rational::ZERO, &[(square, half.clone()), (sense, half.clone())]);
                let separated = graph.sum(Rational::ZERO, &[(square, half.clone()), (sense, -half)]);
                let torque = graph.multiply(presses, pull);
                // While it is compressed the damper takes power; after separation the spring relaxes by itself.
                let damped = graph.product(&[(presses, 1), (damper, 1), (speed, 1)]);
                let released = graph.product(&[(separated, 1), (spring, 1), (speed, 1)]);
                let loss = graph.subtract(damped, released);
                let push = graph.negate(pull);
                Self { torque, speed, loss, mode_inputs: [gap, push] }
            }
        }
    }
}

/// `aᵀq − offset`
fn gap(motion: &mut Motion, unilateral: &DirectionalTerm<UnilateralConstraint>, offset: &Exact) -> Expr {
    let angle = motion.sum(&unilateral.row, |motion, shaft| motion.angles[shaft]);
    let offset = motion.exact(offset);
    let gap = motion.graph.subtract(angle, offset);
    motion.graph.group(gap)
}
