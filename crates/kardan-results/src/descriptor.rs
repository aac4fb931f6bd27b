//! Descriptor systems with a singular E: the decomposition of the pencil sE − A.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::{Definition, Entry, PolynomialRoots, SparseMatrix};

/// A descriptor system `E x' = A x + B u`, `y = C x + D u` with a singular E and a regular pencil sE − A, all decided exactly. What is
/// stated on impulses in continuous time applies to noncausal responses in discrete time.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct DescriptorSystem {
    /// Number of the variables x.
    pub variables: usize,
    /// Rank of E.
    pub rank_of_e: usize,
    /// Index of the pencil: order of the largest block at infinity.
    pub index: usize,
    /// Number of finite eigenvalues, with multiplicity: the order of the equivalent state space.
    pub finite_eigenvalues: usize,
    /// Orders of the blocks at infinity, largest first; only those above 1 can respond with impulses.
    pub infinite_blocks: Vec<usize>,
    /// Whether the index is at most 1.
    pub impulse_free: bool,
    /// Controllability.
    pub controllability: DescriptorVerdicts,
    /// Observability.
    pub observability: DescriptorVerdicts,
    /// States of the equivalent state space that are combinations of the variables.
    pub definitions: Vec<Definition>,
    /// Outputs that respond to derivatives of inputs; empty if the transfer matrix is proper.
    pub polynomial_part: Vec<ImproperEntry>,
    /// Outputs with a polynomial part: no state space contains them, and the equivalent one omits them.
    pub improper_outputs: Vec<String>,
    /// Normal rank of the transfer matrix from all inputs to all outputs; `null` if it is not decided.
    pub normal_rank: Option<usize>,
    /// Finite invariant zeros with all outputs; `null` if they are not decided.
    pub zeros: Option<PolynomialRoots>,
    /// Orders of the zeros at infinity of the transfer matrix with all outputs, ascending; negative ones are poles there.
    pub orders_at_infinity: Option<Vec<i64>>,
    /// The proof: `left E right = diag(I, N)`, `left A right = diag(J, I)`.
    pub proof: SeparatedPencil,
}

/// The properties of one side.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct DescriptorVerdicts {
    /// All finite modes: R-controllable (R-observable); `null` if that is not decided.
    pub finite: Option<bool>,
    /// All impulses: impulse controllable (observable), the rank of `[E, A K, B]` is full with K a basis of the kernel of E.
    pub impulse: bool,
    /// All modes, finite or not: completely controllable (observable), C-controllable; also `[E, B]` has full rank.
    pub complete: Option<bool>,
    /// Rank deficiency for impulses.
    pub impulse_defect: usize,
    /// Infinite eigenvalues that are not controllable (observable).
    pub infinite_defect: usize,
}

/// An entry of the transfer matrix with a polynomial part.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ImproperEntry {
    /// The output.
    pub output: String,
    /// The input.
    pub input: String,
    /// Its terms from s upwards: `s^2 - 3/2 s`.
    pub polynomial: String,
}

/// A regular pencil decomposed into its finite and its infinite structure.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SeparatedPencil {
    /// E, A, B, C, D of the input.
    #[serde(serialize_with = "super::pencil::named")]
    #[schemars(with = "BTreeMap<String, Vec<Entry>>")]
    pub pencil: Vec<SparseMatrix>,
    /// Square and regular, its rows.
    pub left: Vec<Vec<String>>,
    /// Square and regular, its rows.
    pub right: Vec<Vec<String>>,
}
