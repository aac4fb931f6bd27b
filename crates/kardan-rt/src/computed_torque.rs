//! The computed-torque law on the nonlinear mechanism.

use crate::dense::{add_scaled, all_finite, at, copy, dot, factor, row, solve, solve_factored, sum};
use crate::mechanism::{modelled_forces, take};
use crate::{Channel, Evaluation, Mechanism, PositionLoop, Real};

/// The variable that one channel of a [`ComputedTorque`] law controls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task<T> {
    /// The angle of a shaft follows a reference in rad.
    Position {
        /// The shaft.
        shaft: usize,
        /// The loop around the double integrator.
        position_loop: PositionLoop<T>,
    },
    /// The reference is a torque (N m) that acts on a shaft as if it had its effective inertia `1/(b H⁻¹ bᵀ)` at the
    /// present position alone.
    Torque {
        /// The shaft.
        shaft: usize,
    },
    /// The constraint torque in a cut of the mechanism equals the reference, N m.
    ConstraintTorque {
        /// Number of the cut, that is of its coordinate among the cut coordinates.
        cut: usize,
    },
}

/// Measurements and other inputs of the law. Missing entries at the end of a list count as zero.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a, T> {
    /// Reduced coordinates q_r without the cuts, rad.
    pub position: &'a [T],
    /// Their speeds, rad/s.
    pub speed: &'a [T],
    /// One reference per task: rad or N m.
    pub references: &'a [T],
    /// Estimated external torques on each shaft of the mechanism, N m; the law cancels them. Torques missing here act
    /// on the outputs as on their effective inertia.
    pub disturbances: &'a [T],
}

/// Computed torque on the nonlinear model, with as many tasks as motors, `[diss. (6.17)-(6.27), 6.3.3]`: the torques u for
/// which
/// `b q̈_r + k = v` at each shaft under control (v from its [`PositionLoop`] or torque reference) and
/// `h q̈_r − f u − passive = T` in each cut, where `H_r q̈_r = passive + d̂ + F_r u`.
///
/// With y = H_r⁻¹ bᵀ (or hᵀ) for each task these are as many linear equations as motors; each step sets them up and
/// solves them. Covers full computed torque (6.17), the partial one of the harmonic drive with the constraint torque of
/// the flexspline, (6.20)-(6.27) in the corrected form (`T′ₐ` in (6.22), (6.24) and (6.26)), and noninteracting control
/// (6.124), (6.130) without its assumption of a straight joint.
///
/// ```
/// use kardan_rt::{ComputedTorque, Mechanism, Operator, Plan, PositionLoop, Run, Situation, Task};
/// // A body of 2 kg m² with a damper of 0.5 N m s/rad and a motor: u = 2 v + 0.5 w.
/// let body = Mechanism {
///     shafts: 1, coordinates: 1, cuts: 0, inputs: 1, frictions: &[],
///     plan: Plan {
///         inputs: 2, constants: &[0.0, 1.0, 2.0, -0.5], runs: &[Run { operator: Operator::Multiply, count: 1 }],
///         operands: &[5, 1], outputs: &[0, 1, 2, 3, 4, 6, 2, 3], tables: &[], numbers: &[],
///     },
/// };
/// let position_loop = PositionLoop { natural_frequency: 10.0, damping_ratio: 1.0 };
/// let tasks = [Task::Position { shaft: 0, position_loop }];
/// let law = ComputedTorque { mechanism: body, tasks: &tasks, inputs: &[0], friction_width: None };
/// let mut memory = [0.0; 21];
/// assert_eq!(memory.len(), law.memory());
/// let now = Situation { position: &[0.25], speed: &[3.0], references: &[1.0], disturbances: &[] };
/// let mut torques = [0.0];
/// assert!(law.torques(now, &mut memory, &mut torques));
/// assert_eq!(torques, [2.0 * (100.0 * 0.75 - 20.0 * 3.0) + 0.5 * 3.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ComputedTorque<'a, T> {
    /// The model.
    pub mechanism: Mechanism<'a, T>,
    /// The controlled variables.
    pub tasks: &'a [Task<T>],
    /// Numbers of the commanded inputs, as many as tasks.
    pub inputs: &'a [usize],
    /// Speed w₀ (rad/s) of the friction feed-forward `c·w/√(w²+w₀²)` along each Coulomb direction; none: no feed-forward.
    pub friction_width: Option<T>,
}

impl<T: Real> ComputedTorque<'_, T> {
    /// Entries of memory that a step needs: those of the mechanism, and with r coordinates, p of them cuts, and m tasks
    /// (r−p)² + 2r + m (r + m + 1).
    pub fn memory(&self) -> usize {
        let (r, m) = (self.mechanism.coordinates, self.tasks.len());
        let moving = r.saturating_sub(self.mechanism.cuts);
        let own = [self.mechanism.memory(), moving.saturating_mul(moving), r, r, m.saturating_mul(sum(&[r, m, 1]))];
        sum(&own)
    }

    /// One evaluation; `torques` receives u, N m, one entry per task.
    ///
    /// Returns false and leaves `torques` unchanged if there is no finite result: the tasks depend on each other at
    /// this position (the decoupling matrix is singular to 64 ulps), an input is not finite, or a list or the memory is
    /// too short.
    #[must_use = "false: the torques are those of the last step"]
    pub fn torques(&self, now: Situation<'_, T>, memory: &mut [T], torques: &mut [T]) -> bool {
        self.solution(now, memory, torques).is_some()
    }

    fn solution(&self, now: Situation<'_, T>, mut memory: &mut [T], torques: &mut [T]) -> Option<()> {
        let (mechanism, m) = (&self.mechanism, self.tasks.len());
        let columns = mechanism.coordinates;
        let r = columns.checked_sub(mechanism.cuts)?;
        let (position, speed) = (now.position.get(..r)?, now.speed.get(..r)?);
        let (references, torques) = (now.references.get(..m)?, torques.get_mut(..m)?);
        if self.inputs.len() != m || columns == 0 || !all_finite(references) || !all_finite(now.disturbances) {
            return None;
        }
        let evaluated = mechanism.evaluate_in(position, speed, &mut memory)?;
        let force = take(&mut memory, columns)?;
        let y = take(&mut memory, columns)?;
        let lower = take(&mut memory, r.saturating_mul(r))?;
        let inputs = take(&mut memory, m.saturating_mul(columns))?;
        let width = m.saturating_add(1);
        let equations = take(&mut memory, m.saturating_mul(width))?;

        modelled_forces(mechanism, &evaluated, self.friction_width, force);
        for (torque, basis_row) in now.disturbances.iter().zip(evaluated.basis.chunks_exact(columns)) {
            add_scaled(*torque, basis_row, force);
        }
        for (number, input) in self.inputs.iter().zip(inputs.chunks_exact_mut(columns)) {
            if *number >= mechanism.inputs {
                return None;
            }
            copy(row(evaluated.inputs, *number, columns), input);
        }
        factor(evaluated.inertia, columns, r, lower)?;
        let y = y.get_mut(..r)?;
        for ((task, reference), equation) in self.tasks.iter().zip(references).zip(equations.chunks_exact_mut(width)) {
            // The required left-hand side, and the coordinate of the cut.
            let (target, cut_coordinate) = match *task {
                Task::Position { shaft, position_loop } => {
                    let inverse_inertia = respond(lower, row(evaluated.basis, shaft, columns), y)?;
                    let channel = Channel::Position { position_loop, inverse_inertia };
                    (acceleration(channel, shaft, *reference, &evaluated)?, None)
                }
                Task::Torque { shaft } => {
                    let inverse_inertia = respond(lower, row(evaluated.basis, shaft, columns), y)?;
                    (acceleration(Channel::Torque { inverse_inertia }, shaft, *reference, &evaluated)?, None)
                }
                Task::ConstraintTorque { cut } => {
                    let cut_coordinate = r.checked_add(cut)?;
                    respond(lower, row(evaluated.inertia, cut_coordinate, columns), y)?;
                    (*reference, Some(cut_coordinate))
                }
            };
            // How the left-hand side responds to generalised forces.
            let response = |force: &[T]| dot(y, force) - cut_coordinate.map_or(T::ZERO, |k| at(force, k));
            for (coefficient, input) in equation.iter_mut().zip(inputs.chunks_exact(columns)) {
                *coefficient = response(input);
            }
            *equation.get_mut(m)? = target - response(force);
        }
        solve(equations, m)?;
        let found = || equations.chunks_exact(width).map(|equation| at(equation, m));
        if !found().all(T::is_finite) {
            return None;
        }
        for (torque, value) in torques.iter_mut().zip(found()) {
            *torque = value;
        }
        Some(())
    }
}

/// y = H⁻¹ bᵀ for the leading entries of b; returns b y.
fn respond<T: Real>(lower: &[T], b: &[T], y: &mut [T]) -> Option<T> {
    copy(b.get(..y.len())?, y);
    solve_factored(lower, y.len(), y)?;
    Some(dot(b, y))
}

/// The requested acceleration of a shaft minus its bias, rad/s².
fn acceleration<T: Real>(channel: Channel<T>, shaft: usize, reference: T, evaluated: &Evaluation<'_, T>) -> Option<T> {
    let (angle, speed) = (at(evaluated.angles, shaft), at(evaluated.speeds, shaft));
    Some(channel.acceleration(reference, angle, speed, T::ZERO)? - at(evaluated.bias, shaft))
}
