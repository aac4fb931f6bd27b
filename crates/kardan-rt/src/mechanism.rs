//! A mechanism in explicit form, evaluated from a plan.

use crate::dense::{add_scaled, at, copy, row, sum};
use crate::{Plan, Real};

/// A drivetrain in explicit form, as a plan: `H_r q̈_r = passive + F_r τ` with `q = γ(q_r)`, `q̇ = K q̇_r`, `q̈ = K q̈_r + k`,
/// `[diss. (4.11)-(4.14), (4.23)]`.
///
/// `kardan::reduce::MechanismData` makes the plan from the expressions that simulations evaluate too. Its inputs are the coordinates and
/// their speeds, its outputs the lists of an [`Evaluation`] in their order.
///
/// The last [`cuts`](Self::cuts) coordinates are *cuts*: the angle by which a shaft runs ahead of its end in an
/// element. They stay zero, and the generalised force that enforces this is the constraint torque on that shaft.
///
/// ```
/// use kardan_rt::{Mechanism, Operator, Plan, Run};
/// // A body of 2 kg m² with a damper of 0.1 N m s/rad and a motor, and a shaft at minus three times its angle, half a radian ahead.
/// let gear = Mechanism {
///     shafts: 2, coordinates: 1, cuts: 0, inputs: 1, frictions: &[],
///     plan: Plan {
///         inputs: 2,
///         // Places 2 to 7, behind angle and speed.
///         constants: &[0.0, 1.0, 2.0, -3.0, 0.5, -0.1],
///         runs: &[Run { operator: Operator::Multiply, count: 2 }, Run { operator: Operator::AddProduct, count: 1 }],
///         // −3 w, −0.1 w; 0.5 + q·(−3).
///         operands: &[5, 1, 7, 1, 0, 5, 6],
///         // Angles, speeds, bias, basis, inertia, passive and centrifugal force, direction of the input.
///         outputs: &[0, 10, 1, 8, 2, 2, 3, 5, 4, 9, 2, 3],
///         tables: &[], numbers: &[],
///     },
/// };
/// let mut memory = [0.0; 23];
/// assert_eq!(memory.len(), gear.memory());
/// let found = gear.evaluate(&[0.25], &[4.0], &mut memory).map(|now| (now.angles, now.speeds, now.inertia, now.passive));
/// assert_eq!(found, Some((&[0.25, -0.25][..], &[4.0, -12.0][..], &[2.0][..], &[-0.4][..])));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanism<'a, T> {
    /// Number of shafts n.
    pub shafts: usize,
    /// Number of coordinates r, cuts included.
    pub coordinates: usize,
    /// How many of the last coordinates are cuts.
    pub cuts: usize,
    /// Number of inputs.
    pub inputs: usize,
    /// Coulomb torques of the friction directions, N m.
    pub frictions: &'a [T],
    /// The plan to evaluate.
    pub plan: Plan<'a, T>,
}

/// The results of [`Mechanism::evaluate`], in the memory of the caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation<'m, T> {
    /// Angles of all shafts, rad.
    pub angles: &'m [T],
    /// Speeds of all shafts, rad/s.
    pub speeds: &'m [T],
    /// k, rad/s², one entry per shaft.
    pub bias: &'m [T],
    /// K, one row per shaft.
    pub basis: &'m [T],
    /// H_r, row by row, kg m².
    pub inertia: &'m [T],
    /// Generalised force of springs, dampers and inertias, without Coulomb friction, N m.
    pub passive: &'m [T],
    /// The part of it that grows with the square of the speeds, `−Σ J (aᵀk) Kᵀa`, N m.
    pub centrifugal: &'m [T],
    /// Directions of the inputs over the coordinates, row by row.
    pub inputs: &'m [T],
    /// Directions of the frictions, row by row.
    pub frictions: &'m [T],
    /// Speeds along them, rad/s.
    pub friction_speeds: &'m [T],
}

/// The first `length` entries of a memory, and the rest.
pub fn take<'m, T>(memory: &mut &'m mut [T], length: usize) -> Option<&'m mut [T]> {
    let (head, tail) = core::mem::take(memory).split_at_mut_checked(length)?;
    *memory = tail;
    Some(head)
}

impl<T: Real> Mechanism<'_, T> {
    /// Lengths of the lists of an [`Evaluation`].
    const fn lengths(&self) -> [usize; 10] {
        let (n, r, f) = (self.shafts, self.coordinates, self.frictions.len());
        [n, n, n, n.saturating_mul(r), r.saturating_mul(r), r, r, self.inputs.saturating_mul(r), f.saturating_mul(r), f]
    }

    /// Entries of memory that an evaluation needs: those of the plan, and one for each output.
    pub fn memory(&self) -> usize {
        sum(&[self.plan.memory(), sum(&self.lengths())])
    }

    /// Evaluates the mechanism at `position` (rad) and `speed` (rad/s), one entry per coordinate; missing entries are
    /// 0. `None` if the memory is too short, the plan is not one of such a mechanism, or an entry of either or a result
    /// is not finite.
    ///
    /// Costs as much as its [`Plan::evaluate`].
    pub fn evaluate<'m>(&self, position: &[T], speed: &[T], mut memory: &'m mut [T]) -> Option<Evaluation<'m, T>> {
        self.evaluate_in(position, speed, &mut memory)
    }

    /// [`evaluate`](Self::evaluate) in the first part of a memory; the rest is left to the caller.
    pub(crate) fn evaluate_in<'m>(
        &self,
        position: &[T],
        speed: &[T],
        memory: &mut &'m mut [T],
    ) -> Option<Evaluation<'m, T>> {
        let (plan, lengths, r) = (&self.plan, self.lengths(), self.coordinates);
        let (work, found) = (take(memory, plan.memory())?, take(memory, sum(&lengths))?);
        if plan.outputs.len() != found.len() || plan.inputs != r.checked_mul(2)? {
            return None;
        }
        plan.begin(work);
        work.iter_mut().take(plan.inputs).for_each(|input| *input = T::ZERO);
        let (positions, after_angles) = work.split_at_mut_checked(r)?;
        copy(position, positions);
        copy(speed, after_angles.get_mut(..r)?);
        if !plan.evaluate(work) {
            return None;
        }
        for (k, value) in found.iter_mut().enumerate() {
            *value = plan.output(k, work)?;
        }
        let mut rest: &'m [T] = found;
        let [angles, speeds, bias, basis, inertia, passive, centrifugal, inputs, frictions, friction_speeds] = lengths
            .map(|length| -> &'m [T] {
                let Some((head, tail)) = rest.split_at_checked(length) else { return &[] };
                rest = tail;
                head
            });
        Some(Evaluation {
            angles,
            speeds,
            bias,
            basis,
            inertia,
            passive,
            centrifugal,
            inputs,
            frictions,
            friction_speeds,
        })
    }
}

/// Generalised forces of springs, dampers, inertias and, if there is a width w₀, of the Coulomb friction `c·w/√(w²+w₀²)`, cuts
/// included.
pub fn modelled_forces<T: Real>(
    mechanism: &Mechanism<'_, T>,
    evaluated: &Evaluation<'_, T>,
    friction_width: Option<T>,
    out: &mut [T],
) {
    copy(evaluated.passive, out);
    let Some(width) = friction_width else { return };
    for (k, torque) in mechanism.frictions.iter().enumerate() {
        let w = at(evaluated.friction_speeds, k);
        let size = (w * w + width * width).sqrt();
        // A speed whose square overflows is far beyond any width.
        let size = if size.is_finite() { size } else { w.abs() };
        if size > T::ZERO {
            add_scaled(-(*torque * w / size), row(evaluated.frictions, k, mechanism.coordinates), out);
        }
    }
}
