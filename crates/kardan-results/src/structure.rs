//! The exact structure of a linear system: ranks, factors, modes that fail, zeros and the least numbers of inputs and outputs.

use schemars::JsonSchema;
use serde::Serialize;

use super::Pole;
use super::certificate::Certificate;
use super::modes::NamedShare;

/// Exact structure of a linear system.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Structure {
    /// Names of the states.
    pub states: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Rank of the controllability matrix, exact; if [`Undecided::controllability`], only a lower bound.
    pub controllable_rank: usize,
    /// Rank of the observability matrix, exact; if [`Undecided::observability`], only a lower bound.
    pub observable_rank: usize,
    /// Requested proofs that were not found.
    pub undecided: Undecided,
    /// Coprime square-free factors of the characteristic polynomial, with the properties of all their roots.
    pub factors: Vec<Factor>,
    /// Uncontrollable modes.
    pub uncontrollable: Vec<FailingMode>,
    /// Unobservable modes.
    pub unobservable: Vec<FailingMode>,
    /// `relative_degrees[output][input]`; `None`: the input does not affect the output.
    pub relative_degrees: Vec<Vec<Option<usize>>>,
    /// Invariant zeros.
    pub zeros: Zeros,
    /// Non-trivial invariant factors of `sI − A`, each dividing the next.
    pub invariant_factors: Vec<String>,
    /// Least number of inputs for controllability (Theorems 5.2-5.5).
    pub min_inputs: usize,
    /// Least number of outputs for observability (Theorems 5.7-5.10).
    pub min_outputs: usize,
    /// Which theorem of chapter 5 applies: `general`, `pure damping`, `no damping`, `state space`.
    pub kind: String,
    /// Inputs built eigenvalue by eigenvalue.
    pub construction: Option<Construction>,
    /// The proof of the numbers above.
    pub certificate: Certificate,
}

/// A proof that a rank is not larger was requested and not found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Undecided {
    /// Of the controllability matrix.
    pub controllability: bool,
    /// Of the observability matrix.
    pub observability: bool,
}

impl Structure {
    /// Whether the system is controllable; `false` also if that is not decided.
    pub fn controllable(&self) -> bool {
        self.controllable_rank == self.states.len()
    }

    /// Whether the system is observable; `false` also if that is not decided.
    pub fn observable(&self) -> bool {
        self.observable_rank == self.states.len()
    }

    /// Whether the system is controllable, if that is decided.
    pub fn controllability(&self) -> Option<bool> {
        (!self.undecided.controllability).then(|| self.controllable())
    }

    /// Whether the system is observable, if that is decided.
    pub fn observability(&self) -> Option<bool> {
        (!self.undecided.observability).then(|| self.observable())
    }

    /// Whether it is controllable and observable, if that is decided: one that fails decides it.
    pub fn minimality(&self) -> Option<bool> {
        match (self.controllability(), self.observability()) {
            (Some(false), _) | (_, Some(false)) => Some(false),
            (Some(true), Some(true)) => Some(true),
            _ => None,
        }
    }

    /// Controllable and observable.
    pub fn minimal(&self) -> bool {
        self.controllable() && self.observable()
    }
}

/// A square-free factor of the characteristic polynomial, coprime to the others.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Factor {
    /// `s^2 + 3 s + 2`, coefficients exact.
    pub polynomial: String,
    /// Its roots, 1/s.
    #[serde(rename = "roots_per_s")]
    pub roots: Vec<Pole>,
    /// Algebraic multiplicity of each root as an eigenvalue.
    pub algebraic: usize,
    /// Independent eigenvectors of each root: the rank defect of `λ²H + λD + S`.
    pub geometric: usize,
    /// Rank defect of `[λI − A, B]`.
    #[serde(skip)]
    pub input_defect: usize,
    /// Rank defect of `[λI − A; C]`.
    #[serde(skip)]
    pub output_defect: usize,
}

/// An uncontrollable or unobservable mode.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct FailingMode {
    /// λ, 1/s, imaginary part ≥ 0.
    #[serde(rename = "eigenvalue_per_s")]
    pub eigenvalue: Pole,
    /// The exact factor with its eigenvalue as a root.
    pub factor: String,
    /// Number of independent motions at this eigenvalue that fail.
    pub defect: usize,
    /// Shafts (or states) that move in it, largest first; shares relative to the largest.
    pub shafts: Vec<NamedShare>,
    /// Elements that take part, with their share of the stored energy.
    pub elements: Vec<NamedShare>,
}

/// Invariant zeros of `[sI − A, −B; C, D]`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Zeros {
    /// The zero polynomial, exact; `1` if there are no zeros.
    pub polynomial: String,
    /// Its roots, 1/s, with multiplicity.
    pub values: Vec<Pole>,
    /// Number of them in the open right half-plane, exact; `None`: not decided, because the polynomial is not written out.
    #[serde(rename = "in_right_half_plane")]
    pub growing: Option<usize>,
    /// Normal rank of the transfer matrix; below the smaller of inputs and outputs, some combination of them is empty.
    pub normal_rank: usize,
}

/// An input matrix with the least number of columns, built by the procedure of Theorem 5.2 \[diss. (5.7)\] as corrected.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Construction {
    /// Names of the rows: coordinates (forces act on them), or states of a plain state space.
    pub rows: Vec<String>,
    /// The input matrix, fractions: one row per coordinate or state, `min_inputs` columns.
    pub input: Vec<Vec<String>>,
    /// The steps, in order.
    pub steps: Vec<ConstructionStep>,
}

/// One step: the eigenvalues of one factor are reached by adding a multiple of a direction to a column.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ConstructionStep {
    /// The factor whose roots were not all controllable.
    pub factor: String,
    /// Rank defect of `[λI - A, B]` at its roots before the step.
    pub defect: usize,
    /// Column of the input matrix that is changed.
    pub column: usize,
    /// The direction, by row; fractions.
    pub direction: Vec<String>,
    /// Its factor, chosen so that all eigenvalues controllable before remain so.
    pub multiplier: String,
}
