//! A model in explicit form: data only.

use std::borrow::Cow;
use std::sync::Arc;

use crate::assemble::{DirectionalTerm, Equations};
use crate::equations::Curve;
use kardan_math::num::{Matrix, Rational};
use kardan_math::units::Exact;

/// A model in explicit form: which shafts are coordinates and how all others follow.
#[derive(Debug, Clone)]
pub struct Reduced {
    /// The terms; their linear constraints are independent.
    pub equations: Equations,
    /// Linear constraints that follow from these.
    pub redundant: Vec<Redundant>,
    /// Numbers of the shafts chosen as reduced coordinates q_r, in the order chosen.
    pub coordinates: Vec<usize>,
    /// How the other shafts follow, in order of evaluation.
    pub steps: Vec<Step>,
    /// Motions without inertia that are states of first order in a run.
    pub massless: Option<MasslessDynamics>,
}

impl Reduced {
    /// Degrees of freedom.
    pub fn degrees_of_freedom(&self) -> usize {
        self.coordinates.len()
    }

    /// Names of the reduced coordinates.
    pub fn coordinate_names(&self) -> Vec<String> {
        self.coordinates.iter().map(|&shaft| self.equations.coordinates[shaft].clone()).collect()
    }

    /// Number of a shaft.
    pub fn coordinate(&self, name: &str) -> Option<usize> {
        self.equations.coordinates.iter().position(|shaft| shaft == name)
    }

    /// Whether motions without inertia were eliminated for a run: they follow from springs, or are states of first
    /// order.
    pub fn is_settled(&self) -> bool {
        let equations = &self.equations;
        self.massless.is_some() || (0..equations.constraints.len()).any(|row| equations.is_equilibrium(row))
    }

    /// The same model with its coordinates without inertia, where a run has states of first order instead: for statics
    /// and laws.
    pub fn unrelaxed(&self) -> Cow<'_, Self> {
        match &self.massless {
            Some(_) => Cow::Owned(Self { massless: None, ..self.clone() }),
            None => Cow::Borrowed(self),
        }
    }

    /// Shafts that are not coordinates, one for each constraint.
    pub fn dependents(&self) -> Vec<usize> {
        (0..self.equations.coordinates.len()).filter(|shaft| !self.coordinates.contains(shaft)).collect()
    }
}

/// `constant + Σ coefficient · angle` over shafts.
#[derive(Debug, Clone)]
pub struct Affine {
    /// rad; at time zero.
    pub constant: f64,
    /// The contributions of right-hand sides that vary: `(number of the constraint, share)`.
    pub moving: Vec<(usize, Rational)>,
    /// `(shaft number, coefficient)`.
    pub terms: Vec<(usize, Rational)>,
}

/// How one dependent shaft follows from shafts that are known already: `q_shaft = argument(q)`, or `q_shaft = γ(argument(q))`.
#[derive(Debug, Clone)]
pub struct Step {
    /// The shaft found.
    pub shaft: usize,
    /// The argument of γ; without γ the angle itself.
    pub argument: Affine,
    /// γ
    pub curve: Option<Arc<dyn Curve>>,
}

/// A linear constraint that follows from others.
#[derive(Debug, Clone)]
pub struct Redundant {
    /// The constraint.
    pub constraint: DirectionalTerm<Exact>,
    /// The combination it equals: numbers of the independent constraints, with factors.
    pub shares: Vec<(usize, Rational)>,
}

/// Reduced coordinates in which the motions without inertia are separate: `q_r = T [x; y]` with `H T_y = 0`.
///
/// Where dampers act, `T_yᵀ D T_x = 0` (D with the speed slopes of laws) and `D_y ẏ = T_yᵀ(F τ − S q_r)` with
/// `D_y = T_yᵀ D T_y`, so that y has a rate where x has an acceleration. Where frictions alone act beside springs, each
/// y is the slip angle of one of them.
#[derive(Debug, Clone)]
pub struct MasslessDynamics {
    /// Numbers of the reduced coordinates that the damped y replace.
    pub places: Vec<usize>,
    /// Motions that slip.
    pub slips: Vec<Slip>,
    /// `S_y = T_yᵀ S T_y` over these, positive definite.
    pub stiffness: Matrix<Rational>,
    /// T, columns in the order of the reduced coordinates; exact.
    pub transform: Matrix<Rational>,
    /// `T⁻¹`
    pub(super) inverse: Matrix<Rational>,
    /// `D_y⁻¹`
    pub(super) compliance: Matrix<Rational>,
    /// `T_xᵀ D T_y`, a row for each reduced coordinate: zero but where laws of torque make D unsymmetric.
    pub(super) reaction: Matrix<Rational>,
}

/// A motion without inertia on which a friction and springs act.
#[derive(Debug, Clone)]
pub struct Slip {
    /// Number of the reduced coordinate that it replaces.
    pub place: usize,
    /// Number of the friction.
    pub friction: usize,
}
