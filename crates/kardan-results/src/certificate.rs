//! Data with which an independent check confirms an analysis.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::{Entry, SparseMatrix};

/// Data with which a short independent check confirms the results.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Certificate {
    /// Every result is proven over the rationals; otherwise see `failure_probability`.
    pub proven: bool,
    /// Bound on the probability that a modular result is wrong (0 if proven).
    pub failure_probability: f64,
    /// The primes of the proofs. Decisions without proof use new primes in each run, which are not listed.
    pub primes: Vec<u64>,
    /// The proven statements and methods, one sentence each.
    pub statements: Vec<String>,
    /// The pencil `E x' = A x + B u`, `y = C x + D u`.
    #[serde(serialize_with = "super::pencil::named")]
    #[schemars(with = "BTreeMap<String, Vec<Entry>>")]
    pub pencil: Vec<SparseMatrix>,
    /// Proof of `min_inputs`.
    pub inputs: Option<Count>,
    /// Proof of `min_outputs`, for the transposed pencil.
    pub outputs: Option<Count>,
    /// Proof that the rank of the controllability matrix is not larger: left vectors that no input affects.
    pub uncontrollable_invariant: Option<Invariant>,
    /// The same for the transposed pencil.
    pub unobservable_invariant: Option<Invariant>,
    /// Proof that the rank of the controllability matrix is not smaller.
    pub controllability_minor: Option<Minor>,
    /// The same for the transposed pencil.
    pub observability_minor: Option<Minor>,
    /// Proofs of the verdicts on stability, stabilisability and detectability; omitted if a verdict is not decided.
    pub stability: StabilityProofs,
}

/// Proofs of the verdicts of these names.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct StabilityProofs {
    /// Of all motions: the polynomial is det(sE - A) over det E.
    pub stable: Option<StabilityProof>,
    /// Of the uncontrollable part: that of the action of `unreached`, 1 if there is none.
    pub stabilisable: Option<StabilityProof>,
    /// Of the unobservable part: that of the action of `unobservable`.
    pub detectable: Option<StabilityProof>,
}

/// Whether all roots of a polynomial are stable, by Routh's table.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct StabilityProof {
    /// Monic, exact.
    pub polynomial: String,
    /// The first column of Routh's table of the polynomial, in discrete time of `(1 - w)^n p((1 + w)/(1 - w))`, both with a leading coefficient above
    /// zero, down to the first number that is not above zero: stable if and only if all n + 1 of them are there and above zero.
    pub routh: Vec<String>,
}

/// Proof of a least number of inputs.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Count {
    /// The number m.
    pub number: usize,
    /// Enough: a witness input matrix (whole numbers; one row per state, m columns) ...
    pub witness: Vec<Vec<i64>>,
    /// ... whose controllability matrix has this non-vanishing minor.
    pub minor: Minor,
    /// Fewer is impossible: the common invariant factor q, monic, coefficients of 1, s, s², ... as fractions ...
    pub common_factor: Vec<String>,
    /// ... and m blocks of deg q independent rows Y with `Y A = (I ⊗ companion(q)) Y E`.
    pub rows: Vec<Vec<String>>,
}

/// Columns of `[B, (E⁻¹A)B, (E⁻¹A)²B, …]` (after E⁻¹) that are independent modulo a prime, hence independent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Minor {
    /// The prime.
    pub prime: u64,
    /// Its columns.
    pub columns: Vec<MinorColumn>,
    /// Rows of the minor.
    pub rows: Vec<usize>,
    /// The minor modulo the prime; not zero.
    pub value: u64,
}

/// The column `(E⁻¹A)^power b` of an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(into = "[usize; 2]")]
pub struct MinorColumn {
    /// The input, from 0.
    pub input: usize,
    /// The power.
    pub power: usize,
}

/// Independent rows Y with `Y A = M Y E` and `Y B = 0`: the uncontrollable part.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Invariant {
    /// Y, fractions.
    pub rows: Vec<Vec<String>>,
    /// M, fractions.
    pub action: Vec<Vec<String>>,
}

impl From<MinorColumn> for [usize; 2] {
    fn from(column: MinorColumn) -> Self {
        [column.input, column.power]
    }
}
