//! Distances of parameters and of plain matrices to a loss of controllability or observability.

use schemars::JsonSchema;
use serde::Serialize;

use super::certificate::Invariant;
use super::modes::NamedShare;
use super::{Interval, Pole};

/// Distance to the next change of structure.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Sensitivity {
    /// The box of parameters.
    pub parameters: Vec<ParameterRange>,
    /// Of controllability.
    pub controllability: Option<DistanceToUncontrollability>,
    /// Of observability.
    pub observability: Option<DistanceToUncontrollability>,
}

/// A parameter with its tolerance.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ParameterRange {
    /// The parameter.
    pub name: String,
    /// Its nominal value, SI.
    pub nominal: f64,
    /// Lower end, SI.
    pub lower: f64,
    /// Upper end, SI.
    pub upper: f64,
    /// SI unit.
    pub unit: String,
}

/// Distance of the parameters to values at which controllability, or observability, is lost.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct DistanceToUncontrollability {
    /// The nearest loss found; `None` if there was none within ten tolerances, or there was no search (`method` is empty).
    pub nearest: Option<UncontrollablePoint>,
    /// Number of points that the search for it started from; 0 if there was no search.
    pub starts: usize,
    /// Number of tolerances within which it is proven that there is no loss; 0 if nothing is proven.
    #[serde(rename = "proven_distance_tolerances")]
    pub proven_distance: f64,
    /// Verdict over the whole box of parameters.
    #[serde(rename = "box")]
    pub box_verdict: BoxVerdict,
    /// The method of the verdict; empty: there was no search.
    pub method: String,
    /// Sampling of the box.
    pub sampling: Option<Sampling>,
}

/// Parameters at which controllability or observability is lost.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct UncontrollablePoint {
    /// Largest deviation in units of each parameter's tolerance; below one it is inside the box.
    #[serde(rename = "distance_tolerances")]
    pub distance: f64,
    /// The parameters that differ from their nominal values; at distance 0 all of them.
    pub at: Vec<ParameterPoint>,
    /// Eigenvalue that is lost there, 1/s.
    #[serde(rename = "eigenvalue_per_s")]
    pub eigenvalue: Pole,
    /// Residual of the defining equations there, relative; 0 if the loss was decided exactly.
    pub residual: f64,
    /// Shafts that move in the lost mode.
    pub shafts: Vec<NamedShare>,
}

/// Distance of plain matrices to a loss of controllability or observability.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct MatrixDistances {
    /// To the nearest system that is not controllable; `null` if it is one, without inputs, or for more than 200 states.
    pub controllability: Option<MatrixDistance>,
    /// To the nearest system that is not observable, from the transposed matrices: its `change_of_B` is that of C, transposed.
    pub observability: Option<MatrixDistance>,
}

/// The Frobenius norm of the least change of `[A, B]` after which some mode is uncontrollable, between two bounds. It depends on
/// the units of the states.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct MatrixDistance {
    /// No smaller change does, rounding included; 0 if floating point cannot prove any.
    pub lower: f64,
    /// This change does, checked exactly.
    pub upper: f64,
    /// The eigenvalue that is lost by it; of a pair the one with imaginary part ≥ 0.
    pub eigenvalue: Pole,
    /// States that take part in the lost mode; shares relative to the largest.
    pub states: Vec<NamedShare>,
    /// What is added to A, rounded.
    #[serde(rename = "change_of_A")]
    pub change_of_a: Vec<Vec<f64>>,
    /// What is added to B, rounded.
    #[serde(rename = "change_of_B")]
    pub change_of_b: Vec<Vec<f64>>,
    /// Rows Y and M: the change is exactly `−Yᵀ (Y Yᵀ)⁻¹ [Y A − M Y, Y B]`, and after it `Y A = M Y`, `Y B = 0`.
    pub proof: Invariant,
    /// Possible rounding of the numbers of the file: half a unit of the last digit of decimals, or 2⁻⁵³ of each
    /// binary number times the number of states; Frobenius norm.
    pub data_uncertainty: f64,
    /// Whether `upper` is below `last_digit`: the data do not distinguish such a system from one that has lost the mode.
    pub within_data_uncertainty: bool,
}

/// A value of a parameter.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ParameterPoint {
    /// The parameter.
    pub parameter: String,
    /// Its value, SI.
    pub value: f64,
    /// SI unit.
    pub unit: String,
}

/// The verdict over a whole box of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BoxVerdict {
    /// No loss anywhere in the box, proven.
    Certified,
    /// A loss was found in the box.
    Lost,
    /// Neither.
    #[default]
    #[serde(rename = "not certified")]
    NotCertified,
}

/// Sampling of a box of parameters.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Sampling {
    /// Number of samples.
    pub samples: usize,
    /// Seed.
    pub seed: u64,
    /// Threshold of the smallest Gramian eigenvalue.
    pub threshold: f64,
    /// Unit of the threshold.
    pub unit: String,
    /// Fraction of samples below the threshold.
    pub probability: f64,
    /// 95 % confidence interval of that probability (Wilson).
    #[serde(rename = "interval_95")]
    pub interval: Interval,
    /// Smallest measure found.
    pub smallest: f64,
    /// Median of the measures.
    pub median: f64,
    /// Largest measure found.
    pub largest: f64,
}
