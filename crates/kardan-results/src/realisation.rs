//! Structural properties of a linear system, and the same system in other coordinates.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Pole, StabilityVerdict};
use kardan_math::num::{Matrix, Rational};

/// Structural properties; `null` if not decided (many states with long fractions, or no proof of uncontrollability).
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SystemProperties {
    /// Whether all motions decay.
    #[serde(flatten)]
    pub stability: StabilityVerdict,
    /// Whether the uncontrollable part decays, decided exactly.
    pub stabilisable: Option<bool>,
    /// Whether the unobservable part decays, decided exactly.
    pub detectable: Option<bool>,
    /// Number of states of the minimal realisation.
    pub minimal_order: Option<usize>,
    /// Uncontrollable modes.
    pub input_decoupling_zeros: Option<PolynomialRoots>,
    /// Unobservable modes.
    pub output_decoupling_zeros: Option<PolynomialRoots>,
    /// Modes that are neither controllable nor observable.
    pub input_output_decoupling_zeros: Option<PolynomialRoots>,
    /// Zeros of the minimal realisation.
    pub transmission_zeros: Option<PolynomialRoots>,
    /// Controllability indices, one for each input: powers of A that increase the rank.
    pub controllability_indices: Option<Vec<usize>>,
    /// Observability indices, one for each output.
    pub observability_indices: Option<Vec<usize>>,
    /// Orders of the zeros at infinity of the transfer matrix, ascending.
    pub infinite_zeros: Option<Vec<usize>>,
}

/// A polynomial with its roots.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct PolynomialRoots {
    /// Monic, exact; `1` if there are no roots.
    pub polynomial: String,
    /// Its roots with multiplicity; 1/s, in discrete time without unit.
    pub values: Vec<Pole>,
}

/// In discrete time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct DiscreteTime {
    /// The sample time, s; `null` if it is not known.
    #[serde(rename = "sample_time_s")]
    pub sample_time: Option<f64>,
}

/// A system in other coordinates, exact.
#[derive(Debug, Clone, PartialEq)]
pub struct Realisations {
    /// Kalman's decomposition: `x = T z`.
    pub kalman: TransformedSystem,
    /// Its controllable and observable block; of T only the columns of that block.
    pub minimal: TransformedSystem,
    /// The staircase form of the inputs.
    pub staircase: TransformedSystem,
}

/// `ż = A z + B u`, `y = C z + D u` with `x = T z`.
#[derive(Debug, Clone, PartialEq)]
pub struct TransformedSystem {
    /// What the states z are, in order.
    pub blocks: Vec<Block>,
    /// T.
    pub transformation: Matrix<Rational>,
    /// `T⁻¹ A T`.
    pub a: Matrix<Rational>,
    /// `T⁻¹ B`.
    pub b: Matrix<Rational>,
    /// `C T`.
    pub c: Matrix<Rational>,
    /// D.
    pub d: Matrix<Rational>,
}

/// States that belong together.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct Block {
    /// `controllable and observable`
    pub name: String,
    /// How many.
    pub states: usize,
}
