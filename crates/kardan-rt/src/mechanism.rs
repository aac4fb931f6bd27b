use crate::dense::{add_scaled, all_finite, at, copy, dot, finite, row, sum};
use crate::{Real, UniversalJoint};

/// A sparse row of coefficients over the shafts: a part of [`Mechanism::entries`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Row {
    /// Number of its first entry.
    pub first: usize,
    /// How many entries it has.
    pub count: usize,
}

/// How one shaft follows from shafts that are known already: `q_shaft = argument(q)` or `q_shaft = γ(argument(q))`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Operation<T> {
    /// The shaft found.
    pub shaft: usize,
    /// Coefficients of the argument.
    pub argument: Row,
    /// Constant of the argument, rad.
    pub constant: T,
    /// γ; none for a linear operation.
    pub curve: Option<UniversalJoint<T>>,
    /// Whether the basis row of the shaft depends on the position.
    pub varying: bool,
}

/// A scalar law along a direction over the shafts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Along<T> {
    /// The direction.
    pub row: Row,
    /// Inertia (kg m²), damping (N m s/rad), stiffness (N m/rad) or Coulomb torque (N m).
    pub coefficient: T,
    /// Angle at which a spring is relaxed, rad; 0 for all others.
    pub rest: T,
}

/// A drivetrain in explicit form, as flat tables: `H_r q̈_r = passive + F_r τ` with `q = γ(q_r)`, `q̇ = K q̇_r`,
/// `q̈ = K q̈_r + k`, `[diss. (4.11)-(4.14), (4.23)]`.
///
/// Terms along constant directions are summed into matrices beforehand; only those that pass through a universal joint
/// are added at each evaluation. `kardan::reduce::MechanismData` makes the tables.
///
/// The last [`held`](Self::held) coordinates are *cuts*: the angle by which a shaft runs ahead of its end in an element.
/// They stay zero, and the generalised force that holds them there is the constraint torque on that shaft.
///
/// ```
/// use kardan_rt::{Along, Mechanism, Row};
/// // A body of 2 kg m² with a motor, and a shaft at minus three times its angle.
/// let gear = Mechanism {
///     shafts: 2,
///     held: 0,
///     coordinates: &[0],
///     entries: &[(0, -3.0), (0, 1.0)],
///     operations: &[kardan_rt::Operation {
///         shaft: 1, argument: Row { first: 0, count: 1 }, constant: 0.5, curve: None, varying: false,
///     }],
///     basis: &[1.0, -3.0],
///     inertia: &[2.0], damping: &[0.1], stiffness: &[0.0], force: &[0.0],
///     inertias: &[], dampers: &[], springs: &[], frictions: &[],
///     inputs: &[Row { first: 1, count: 1 }],
/// };
/// let mut memory = [0.0; 11];
/// assert_eq!(memory.len(), gear.memory());
/// let now = gear.evaluate(&[0.25], &[4.0], &mut memory).unwrap();
/// assert_eq!((now.angles, now.speeds, now.inertia, now.passive), (&[0.25, -0.25][..], &[4.0, -12.0][..], &[2.0][..], &[-0.4][..]));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanism<'a, T> {
    /// Number of shafts n.
    pub shafts: usize,
    /// How many of the last coordinates are cuts.
    pub held: usize,
    /// The shaft of each coordinate, r entries.
    pub coordinates: &'a [usize],
    /// Shaft and coefficient; [`Row`]s are parts of this list.
    pub entries: &'a [(usize, T)],
    /// How the other shafts follow, in order of evaluation.
    pub operations: &'a [Operation<T>],
    /// K (n × r), with its constant rows filled in.
    pub basis: &'a [T],
    /// Constant part of H_r (r × r), kg m².
    pub inertia: &'a [T],
    /// Constant part of D_r (r × r), N m s/rad.
    pub damping: &'a [T],
    /// Constant part of S_r (r × r), N m/rad.
    pub stiffness: &'a [T],
    /// Generalised force of the constant springs at q_r = 0 (r entries), N m.
    pub force: &'a [T],
    /// Inertias along directions that vary.
    pub inertias: &'a [Along<T>],
    /// Dampers along directions that vary.
    pub dampers: &'a [Along<T>],
    /// Springs along directions that vary.
    pub springs: &'a [Along<T>],
    /// All Coulomb friction terms.
    pub frictions: &'a [Along<T>],
    /// Directions of all inputs.
    pub inputs: &'a [Row],
}

/// What [`Mechanism::evaluate`] finds, in the memory of the caller.
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
}

/// The first `length` entries of a memory, and the rest.
pub fn take<'m, T>(memory: &mut &'m mut [T], length: usize) -> Option<&'m mut [T]> {
    let (head, tail) = core::mem::take(memory).split_at_mut_checked(length)?;
    *memory = tail;
    Some(head)
}

impl<T: Real> Mechanism<'_, T> {
    /// Entries of memory that an evaluation needs: 3n + nr + r² + 2r.
    pub const fn memory(&self) -> usize {
        let (n, r) = (self.shafts, self.coordinates.len());
        sum(&[n, n, n, n.saturating_mul(r), r.saturating_mul(r), r, r])
    }

    /// Evaluates the mechanism at `position` (rad) and `speed` (rad/s), one entry per coordinate; those left out are 0.
    /// `None` if the memory is too short, or an entry of either or a number found is not finite.
    ///
    /// Costs n r to n r² products and, per universal joint, a sine, a cosine and an arc tangent.
    pub fn evaluate<'m>(&self, position: &[T], speed: &[T], memory: &'m mut [T]) -> Option<Evaluation<'m, T>> {
        let mut rest = memory;
        self.evaluate_within(position, speed, &mut rest)
    }

    /// [`evaluate`](Self::evaluate) in the first part of a memory; the rest is left to the caller.
    pub(crate) fn evaluate_within<'m>(
        &self,
        position: &[T],
        speed: &[T],
        memory: &mut &'m mut [T],
    ) -> Option<Evaluation<'m, T>> {
        let (n, r) = (self.shafts, self.coordinates.len());
        let kinematics = Kinematics {
            angles: take(memory, n)?,
            speeds: take(memory, n)?,
            bias: take(memory, n)?,
            basis: take(memory, n.saturating_mul(r))?,
        };
        let (inertia, passive) = (take(memory, r.saturating_mul(r))?, take(memory, r)?);
        let direction = take(memory, r)?;
        let kinematics = self.kinematics(position, speed, kinematics, direction)?;
        self.dynamics(position, speed, &kinematics, inertia, passive, direction);
        let Kinematics { angles, speeds, bias, basis } = kinematics;
        let found: [&[T]; 8] = [position, speed, angles, speeds, bias, basis, inertia, passive];
        if !found.into_iter().all(all_finite) {
            return None;
        }
        Some(Evaluation { angles, speeds, bias, basis, inertia, passive })
    }

    /// (4.11)-(4.14): for a curve `y = γ(x)`, `K_y = γ′ K_x` and `k_y = γ″ ẋ² + γ′ k_x`.
    fn kinematics<'m>(
        &self,
        position: &[T],
        speed: &[T],
        out: Kinematics<'m, T>,
        direction: &mut [T],
    ) -> Option<Kinematics<'m, T>> {
        let r = self.coordinates.len();
        let Kinematics { angles, speeds, bias, basis } = out;
        for values in [&mut *angles, &mut *speeds, &mut *bias] {
            values.fill(T::ZERO);
        }
        copy(self.basis, basis);
        for (column, shaft) in self.coordinates.iter().enumerate() {
            set(angles, *shaft, at(position, column));
            set(speeds, *shaft, at(speed, column));
        }
        for Operation { shaft, argument, constant, curve, varying } in self.operations {
            let x = *constant + self.sum_along(*argument, angles);
            let x_speed = self.sum_along(*argument, speeds);
            let (value, slope, curvature) = match curve {
                None => (x, T::ONE, T::ZERO),
                Some(curve) => {
                    let point = curve.at(x)?;
                    (point.value, point.slope, point.curvature)
                }
            };
            set(angles, *shaft, value);
            set(speeds, *shaft, slope * x_speed);
            if *varying {
                let x_bias = self.sum_along(*argument, bias);
                set(bias, *shaft, curvature * x_speed * x_speed + slope * x_bias);
                self.sum_of_rows(*argument, basis, direction);
                if let Some(own) = basis.get_mut(shaft.saturating_mul(r)..) {
                    for (entry, combined) in own.iter_mut().zip(&*direction) {
                        *entry = slope * *combined;
                    }
                }
            }
        }
        Some(Kinematics { angles, speeds, bias, basis })
    }

    /// H_r and the passive generalised force `−h_r` of (4.23).
    fn dynamics(
        &self,
        position: &[T],
        speed: &[T],
        kinematics: &Kinematics<'_, T>,
        inertia: &mut [T],
        passive: &mut [T],
        direction: &mut [T],
    ) {
        let r = self.coordinates.len();
        for (i, force) in passive.iter_mut().enumerate() {
            let damped = dot(row(self.damping, i, r), speed);
            let sprung = dot(row(self.stiffness, i, r), position);
            *force = at(self.force, i) - damped - sprung;
        }
        copy(self.inertia, inertia);
        for damper in self.dampers {
            self.sum_of_rows(damper.row, kinematics.basis, direction);
            add_scaled(-(damper.coefficient * self.sum_along(damper.row, kinematics.speeds)), direction, passive);
        }
        for spring in self.springs {
            self.sum_of_rows(spring.row, kinematics.basis, direction);
            let twist = self.sum_along(spring.row, kinematics.angles) - spring.rest;
            add_scaled(-(spring.coefficient * twist), direction, passive);
        }
        for body in self.inertias {
            self.sum_of_rows(body.row, kinematics.basis, direction);
            add_scaled(-(body.coefficient * self.sum_along(body.row, kinematics.bias)), direction, passive);
            for (entries, g) in inertia.chunks_exact_mut(r.max(1)).zip(&*direction) {
                add_scaled(body.coefficient * *g, direction, entries);
            }
        }
    }

    fn terms(&self, row: Row) -> &[(usize, T)] {
        self.entries.get(row.first..).and_then(|rest| rest.get(..row.count)).map_or(&[], |terms| terms)
    }

    /// `aᵀx` for values x of the shafts; `None` where that is no finite number.
    #[inline]
    pub fn along(&self, direction: Row, x: &[T]) -> Option<T> {
        finite(self.sum_along(direction, x))
    }

    #[inline]
    pub(crate) fn sum_along(&self, direction: Row, x: &[T]) -> T {
        self.terms(direction).iter().fold(T::ZERO, |sum, (shaft, c)| sum + *c * at(x, *shaft))
    }

    /// `aᵀK`: a direction over the shafts in reduced coordinates, from the basis of an [`Evaluation`].
    ///
    /// Returns false and leaves `out` as it is if an entry is not finite: the sums are formed twice, which takes no memory.
    #[inline]
    #[must_use = "false tells that nothing was written"]
    pub fn project(&self, direction: Row, basis: &[T], out: &mut [T]) -> bool {
        let columns = self.coordinates.len();
        let entry = |column: usize| {
            let terms = self.terms(direction).iter();
            terms.fold(T::ZERO, |sum, (shaft, c)| sum + *c * at(row(basis, *shaft, columns), column))
        };
        let found = (0..out.len()).all(|column| entry(column).is_finite());
        if found {
            self.sum_of_rows(direction, basis, out);
        }
        found
    }

    #[inline]
    pub(crate) fn sum_of_rows(&self, direction: Row, basis: &[T], out: &mut [T]) {
        out.fill(T::ZERO);
        for (shaft, c) in self.terms(direction) {
            add_scaled(*c, row(basis, *shaft, self.coordinates.len()), out);
        }
    }
}

/// Generalised forces of springs, dampers, inertias and, if there is a width w₀, of the Coulomb friction `c·w/√(w²+w₀²)`, cuts
/// included; `direction` is memory.
pub fn known_forces<T: Real>(
    mechanism: &Mechanism<'_, T>,
    evaluated: &Evaluation<'_, T>,
    friction_width: Option<T>,
    direction: &mut [T],
    out: &mut [T],
) {
    copy(evaluated.passive, out);
    let Some(width) = friction_width else { return };
    for friction in mechanism.frictions {
        let w = mechanism.sum_along(friction.row, evaluated.speeds);
        mechanism.sum_of_rows(friction.row, evaluated.basis, direction);
        let size = (w * w + width * width).sqrt();
        // A speed whose square overflows is far beyond any width.
        let size = if size.is_finite() { size } else { w.abs() };
        if size > T::ZERO {
            add_scaled(-(friction.coefficient * w / size), direction, out);
        }
    }
}

/// Generalised forces that grow with the square of the speeds, `−Σ J (aᵀk) Kᵀa`, added to `out`; `direction` is memory.
pub fn centrifugal<T: Real>(
    mechanism: &Mechanism<'_, T>,
    evaluated: &Evaluation<'_, T>,
    direction: &mut [T],
    out: &mut [T],
) {
    for body in mechanism.inertias {
        mechanism.sum_of_rows(body.row, evaluated.basis, direction);
        add_scaled(-(body.coefficient * mechanism.sum_along(body.row, evaluated.bias)), direction, out);
    }
}

struct Kinematics<'m, T> {
    angles: &'m mut [T],
    speeds: &'m mut [T],
    bias: &'m mut [T],
    basis: &'m mut [T],
}

fn set<T>(values: &mut [T], k: usize, value: T) {
    if let Some(entry) = values.get_mut(k) {
        *entry = value;
    }
}
