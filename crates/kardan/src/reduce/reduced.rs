//! A model in explicit form: data only.

use std::sync::Arc;

use super::Redundant;
use crate::assemble::Equations;
use crate::equations::Curve;
use crate::num::Rational;

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

    /// Shafts that are not coordinates, one for each constraint.
    pub fn dependents(&self) -> Vec<usize> {
        (0..self.equations.coordinates.len()).filter(|shaft| !self.coordinates.contains(shaft)).collect()
    }
}

/// `constant + Σ coefficient · angle` over shafts.
#[derive(Debug, Clone)]
pub struct Affine {
    /// rad.
    pub constant: f64,
    /// `(shaft number, coefficient)`.
    pub terms: Vec<(usize, Rational)>,
}

/// How one dependent shaft follows from shafts that are known already.
#[derive(Debug, Clone)]
pub enum Step {
    /// `q_shaft = value(q)`.
    Linear {
        /// The shaft found.
        shaft: usize,
        /// Its expression.
        value: Affine,
    },
    /// `q_shaft = γ(argument(q))`.
    Curve {
        /// The shaft found.
        shaft: usize,
        /// γ
        curve: Arc<dyn Curve>,
        /// Its argument.
        argument: Affine,
    },
}
