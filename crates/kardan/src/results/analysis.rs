//! What an analysis of structure gives: chapters 4 and 5 of the source for one model at one operating point.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::{
    Complex, Definition, DescriptorSystem, DiscreteTime, Entry, Interval, Mechanism, NamedMatrix, Parity, Pole,
    Realisations, SparseMatrix, StabilityVerdict, SystemProperties,
};

/// Everything that `kardan analyze` finds. Parts that do not apply (a plain state-space input has no elements) are empty
/// or `None`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Analysis {
    /// Name of the model.
    pub name: String,
    /// From the file.
    pub description: String,
    /// Its parts, and who is joined to whom; none of a plain state-space input.
    pub mechanism: Mechanism,
    /// Whether the model is a constant linear constrained mechanical system, and where it was linearised if not.
    pub class: Option<Class>,
    /// Names of the reduced coordinates.
    pub coordinates: Vec<String>,
    /// Reduced matrices for three bases of the constraint kernel.
    pub bases: Vec<Basis>,
    /// The projector of the constraint forces.
    pub constraint_forces: Option<ConstraintForces>,
    /// What was eliminated because no mass moves with it.
    pub elimination: Option<Elimination>,
    /// Charges that only count, where it is they alone that are not reached or not seen.
    pub counting: Option<Counting>,
    /// The modes, by size of their eigenvalue.
    pub modes: Vec<Mode>,
    /// Exact answers on controllability, observability, zeros and the least numbers of inputs and outputs.
    pub structure: Structure,
    /// Where motors and sensors may sit.
    pub placement: Placement,
    /// How far away the next change of structure is.
    pub sensitivity: Option<Sensitivity>,
    /// Stability, decoupling and transmission zeros, indices.
    pub properties: Option<SystemProperties>,
    /// Where a torque has a kink at the operating point: the model on the opposite side of it.
    pub opposite_side: Option<OppositeModel>,
    /// Kalman's decomposition, the minimal realisation and the staircase form.
    pub realisations: Option<Realisations>,
    /// In discrete time: how long a sample takes.
    pub discrete: Option<DiscreteTime>,
    /// Of plain matrices with a singular E: what that means. The rest is about the equivalent state space.
    pub descriptor: Option<DescriptorSystem>,
    /// Of plain matrices: how far they are from losing controllability or observability.
    pub matrix_distance: Option<MatrixDistances>,
    /// Which faults sensors can tell, where it was asked for.
    pub parity: Option<Parity>,
    /// What the reader must know: choices made for him, parts left out.
    pub notes: Vec<String>,
    /// Of an analysis that ended early: why, and which parts are missing. They are empty then, which says nothing of the model.
    pub unfinished: Option<String>,
}

/// The linear model on the opposite side of the kinks at its operating point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct OppositeModel {
    /// The side that everything else is about: ``a.phi` > 0`.
    pub reference_side: String,
    /// This side.
    pub side: String,
    /// Whether every state can be reached here; `None` where that is not decided.
    pub controllable: Option<bool>,
    /// Whether every state can be told from the outputs here; `None` where that is not decided.
    pub observable: Option<bool>,
    /// Whether it is stable here.
    pub stability: StabilityVerdict,
    /// The modes here, by size of their eigenvalue.
    pub modes: Vec<Mode>,
}

/// Motions without inertia, eliminated: the states that remain are those of [`Structure::states`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Elimination {
    /// Number of independent motions without inertia.
    pub motions: usize,
    /// One of them, over the coordinates: `a - 2 b`.
    pub direction: String,
    /// States that are none any more: they follow from the others and the inputs at once.
    pub removed: Vec<String>,
    /// States that are combinations of the original ones.
    pub definitions: Vec<Definition>,
}

/// Charges that act on nothing: they count what has flowed. The rest of the system is told without them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Counting {
    /// Each charge, or sum of charges.
    pub charges: Vec<String>,
    /// Whether all other states are reached.
    pub remaining_controllable: bool,
    /// Whether all other states are seen, where no output shows these charges.
    pub remaining_observable: bool,
}

/// Definition 4.4, judged.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Class {
    /// Whether all five assumptions hold without linearisation.
    pub constant_linear: bool,
    /// The five assumptions, in the order of the source.
    pub assumptions: Vec<Assumption>,
    /// The kind of every constraint.
    pub constraints: Vec<ConstraintClass>,
    /// Where the model was linearised.
    pub operating_point: OperatingPoint,
}

/// One of the five assumptions (4.27)-(4.31).
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Assumption {
    /// `the inertia matrix is constant, symmetric and positive definite (4.27)`.
    pub statement: String,
    /// Whether it holds.
    pub satisfied: bool,
    /// What breaks it.
    pub violations: Vec<Breach>,
}

/// What breaks an assumption.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Breach {
    /// The element.
    pub element: String,
    /// Why.
    pub reason: String,
}

/// One of the eight classes of Tables 4.1 and 4.2, with the constraint that belongs to it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ConstraintClass {
    /// The element.
    pub element: String,
    /// `q1 - i q2 = 0`.
    pub equation: String,
    /// An equality (Table 4.1), or an inequality (Table 4.2).
    pub equality: bool,
    /// On positions alone; `None`: not decided.
    pub holonomic: Option<bool>,
    /// Without time.
    pub scleronomic: bool,
    /// With constant coefficients.
    pub linear: bool,
    /// How that was decided, and what of the source applies, where it is not one of constant coefficients or a transmission.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// Where a model was linearised.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct OperatingPoint {
    /// The angle of every shaft.
    pub angles: Vec<ShaftAngle>,
    /// Every friction direction.
    pub friction: Vec<FrictionState>,
    /// Whether it is one in motion, or balanced by torques.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub in_motion: bool,
    /// Of one in motion the speeds of the coordinates, and the torques of inputs that are not zero.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub motion: Vec<OperatingSignal>,
}

/// A signal at an operating point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct OperatingSignal {
    /// `car.v`
    pub name: String,
    /// Its SI unit.
    pub unit: String,
    /// SI
    pub value: f64,
}

/// Where a shaft is.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ShaftAngle {
    /// The shaft.
    pub shaft: String,
    /// Its angle, rad.
    #[serde(rename = "angle_rad")]
    pub angle: f64,
}

/// What a friction direction does at an operating point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct FrictionState {
    /// The element.
    pub element: String,
    /// Its Coulomb torque, N m.
    #[serde(rename = "coulomb_torque_N_m")]
    pub coulomb_torque: f64,
    /// Whether it is stuck; then it is a constraint.
    pub stuck: bool,
}

/// The model in one basis of the constraint kernel \[diss. Theorems 4.1-4.4\].
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Basis {
    /// `chosen coordinates`, `elliptical orthogonal` or `elliptical orthonormal`.
    pub name: String,
    /// K: one row per shaft, one column per reduced coordinate.
    pub basis: NamedMatrix,
    /// `H_r = KᵀHK`.
    pub inertia: NamedMatrix,
    /// `D_r = KᵀDK`.
    pub damping: NamedMatrix,
    /// `S_r = KᵀSK`.
    pub stiffness: NamedMatrix,
    /// `F_r = KᵀF`.
    pub input: NamedMatrix,
    /// Largest `|⟨bᵢ, bⱼ⟩_H| / (‖bᵢ‖‖bⱼ‖)` of two different columns; near zero certifies an orthogonal basis.
    pub orthogonality: f64,
    /// Bounds (4.43), (4.45), (4.46) beside the true eigenvalues: inertia, damping, stiffness.
    pub bounds: Vec<EigenvalueBounds>,
}

/// Geršgorin's discs of a reduced matrix beside its true eigenvalues.
///
/// Every eigenvalue lies in at least one disc; a disc need not hold an eigenvalue of its own number (erratum to (4.43)).
/// In ascending order `|λ_k − centre_k| ≤ max radius` (Weyl).
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct EigenvalueBounds {
    /// `inertia`, `damping` or `stiffness`.
    pub matrix: String,
    /// SI unit.
    pub unit: String,
    /// True eigenvalues, ascending.
    pub eigenvalues: Vec<f64>,
    /// Centres of the discs, `⟨M bᵢ, bᵢ⟩`, in the order of the columns of the basis.
    pub centres: Vec<f64>,
    /// Radii of the discs, `Σ_{j≠i} |⟨M bᵢ, bⱼ⟩|`.
    pub radii: Vec<f64>,
}

/// Theorem 4.5: `τ_c = −P (Fτ − Dq̇ − Sq)` with `P = Cᵀ(CH⁻¹Cᵀ)⁻¹CH⁻¹`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ConstraintForces {
    /// P, shaft by shaft.
    pub projector: NamedMatrix,
    /// Its rank, exact: the number of independent constraints.
    pub rank: usize,
    /// Largest entry of `P² − P`, evaluated in floating point.
    pub idempotence_residual: f64,
    /// Constraint torque at rest on each shaft for a unit of each input: `−P F`; rows are shafts.
    pub input_to_torque: NamedMatrix,
    /// Multiplier of each constraint for a unit of each input: `λ = −(CH⁻¹Cᵀ)⁻¹CH⁻¹F`; rows are constraints.
    pub input_to_multiplier: NamedMatrix,
}

/// One mode (a conjugate pair counts once).
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Mode {
    /// λ, 1/s; the one with imaginary part ≥ 0.
    #[serde(rename = "eigenvalue_per_s")]
    pub eigenvalue: Pole,
    /// |λ|, rad/s.
    #[serde(flatten, serialize_with = "frequencies")]
    #[schemars(with = "Frequencies")]
    pub natural_frequency: f64,
    /// −Re λ / |λ|; 1 for λ = 0.
    pub damping_ratio: f64,
    /// What moves in it, and how.
    pub shape: Vec<ShapePart>,
    /// Shares of the energy stored during the motion, kinetic and potential, by element.
    pub stored: Vec<StoredShare>,
    /// Shares of the loss by element.
    pub dissipated: Vec<ElementShare>,
    /// The exact factor of the characteristic polynomial that it is a root of: `s + 2`.
    pub factor: String,
    /// Whether the inputs reach it (Hautus).
    #[serde(skip)]
    pub controllable: bool,
    /// Whether the outputs show it (Hautus).
    #[serde(skip)]
    pub observable: bool,
}

/// How fast a mode is.
#[derive(Serialize, JsonSchema)]
struct Frequencies {
    /// |λ|/(2π), Hz.
    #[serde(rename = "frequency_Hz")]
    frequency: f64,
    /// |λ|, rad/s.
    natural_frequency_rad_per_s: f64,
}

fn frequencies<S: Serializer>(natural: &f64, to: S) -> Result<S::Ok, S::Error> {
    Frequencies { frequency: natural / TAU, natural_frequency_rad_per_s: *natural }.serialize(to)
}

/// What moves in a mode.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ShapePart {
    /// The shaft or state.
    pub name: String,
    /// Its motion relative to the largest one.
    pub value: Complex,
}

impl ShapePart {
    /// The same without its imaginary part.
    #[must_use]
    pub fn real(self) -> Self {
        Self { value: Complex { im: 0.0, ..self.value }, ..self }
    }
}

/// What an element has of the energy stored during a motion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct StoredShare {
    /// The element.
    pub element: String,
    /// As what it is stored.
    pub energy: EnergyKind,
    /// The share.
    pub share: f64,
}

/// What an element has of a whole: of the energy stored, of the loss.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ElementShare {
    /// The element.
    pub element: String,
    /// The share.
    pub share: f64,
}

/// What has a part in a mode that fails.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct NamedShare {
    /// The shaft, state or element.
    pub name: String,
    /// The share.
    pub share: f64,
}

/// Where energy is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub enum EnergyKind {
    /// In an inertia.
    #[default]
    #[serde(rename = "kinetic")]
    Kinetic,
    /// In a spring.
    #[serde(rename = "potential")]
    Potential,
}

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
    /// What a proof was asked for and not found.
    pub undecided: Undecided,
    /// Coprime square-free factors of the characteristic polynomial, with what holds for all their roots.
    pub factors: Vec<Factor>,
    /// Modes that the inputs do not reach.
    pub uncontrollable: Vec<FailingMode>,
    /// Modes that the outputs do not show.
    pub unobservable: Vec<FailingMode>,
    /// `relative_degrees[output][input]`; `None`: the input never reaches the output.
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

/// A proof was asked for that a rank is not larger, and not found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Undecided {
    /// Of the controllability matrix.
    pub controllability: bool,
    /// Of the observability matrix.
    pub observability: bool,
}

impl Structure {
    /// Whether every state can be reached; `false` also where that is not decided.
    pub fn controllable(&self) -> bool {
        self.controllable_rank == self.states.len()
    }

    /// Whether every state can be told from the outputs; `false` also where that is not decided.
    pub fn observable(&self) -> bool {
        self.observable_rank == self.states.len()
    }

    /// Whether every state can be reached, if that is decided.
    pub fn controllability(&self) -> Option<bool> {
        (!self.undecided.controllability).then(|| self.controllable())
    }

    /// Whether every state can be told from the outputs, if that is decided.
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
    /// How often each root is an eigenvalue.
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

/// A mode that inputs do not reach or outputs do not show.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct FailingMode {
    /// λ, 1/s, imaginary part ≥ 0.
    #[serde(rename = "eigenvalue_per_s")]
    pub eigenvalue: Pole,
    /// The exact factor that its eigenvalue is a root of.
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
    /// How many of them lie in the open right half-plane, exact; `None`: not decided, for the polynomial is not written out.
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
    /// What was added, in order.
    pub steps: Vec<ConstructionStep>,
}

/// One step: the eigenvalues of one factor are reached by adding a multiple of a direction to a column.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ConstructionStep {
    /// The factor whose roots were not all reached.
    pub factor: String,
    /// Rank defect of `[λI - A, B]` at its roots before the step.
    pub defect: usize,
    /// Column of the input matrix that is changed.
    pub column: usize,
    /// The direction, by row; fractions.
    pub direction: Vec<String>,
    /// What it is multiplied by, chosen so that no eigenvalue reached before is lost.
    pub multiplier: String,
}

/// What a short independent check needs to confirm the answers.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Certificate {
    /// Every answer is proven over the rationals; otherwise see `failure_probability`.
    pub proven: bool,
    /// Bound on the probability that a modular answer is wrong (0 if proven).
    pub failure_probability: f64,
    /// The primes that the proofs are about. Those that decide what is not proven are others each time, and not listed.
    pub primes: Vec<u64>,
    /// What is proven and how, one sentence each.
    pub statements: Vec<String>,
    /// The pencil `E x' = A x + B u`, `y = C x + D u`.
    #[serde(serialize_with = "super::pencil::named")]
    #[schemars(with = "BTreeMap<String, Vec<Entry>>")]
    pub pencil: Vec<SparseMatrix>,
    /// Proof of `min_inputs`.
    pub inputs: Option<Count>,
    /// Proof of `min_outputs`, for the transposed pencil.
    pub outputs: Option<Count>,
    /// Proof that the rank of the controllability matrix is not larger: left vectors that no input reaches.
    pub uncontrollable_invariant: Option<Invariant>,
    /// The same for the transposed pencil.
    pub unobservable_invariant: Option<Invariant>,
    /// Proof that the rank of the controllability matrix is not smaller.
    pub controllability_minor: Option<Minor>,
    /// The same for the transposed pencil.
    pub observability_minor: Option<Minor>,
    /// Proofs of what is called stable, stabilisable and detectable, or not; left out where that is not decided.
    pub stability: StabilityProofs,
}

/// Proofs of the verdicts of these names.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct StabilityProofs {
    /// Of all motions: the polynomial is det(sE - A) over det E.
    pub stable: Option<StabilityProof>,
    /// Of what no input reaches: that of the action of `unreached`, 1 where all is reached.
    pub stabilisable: Option<StabilityProof>,
    /// Of what no output shows: that of the action of `unobservable`.
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

/// Independent rows Y with `Y A = M Y E` and `Y B = 0`: what no input reaches.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Invariant {
    /// Y, fractions.
    pub rows: Vec<Vec<String>>,
    /// M, fractions.
    pub action: Vec<Vec<String>>,
}

/// Where motors and sensors may sit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Placement {
    /// Smallest sets of motors, best first.
    pub inputs: Option<PlacementSearch>,
    /// Smallest sets of sensors, best first.
    pub outputs: Option<PlacementSearch>,
}

/// The outcome of one search.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct PlacementSearch {
    /// `2 of the 5 places are needed: 3 of the 10 possible sets of 2 are enough (all were tried)`, or `bounded search …`.
    pub method: String,
    /// Whether every set was tried.
    pub exhaustive: bool,
    /// Bound on what a better set could gain where the search was not exhaustive: `(cost found − lower bound) / cost`.
    pub gap: f64,
    /// Sets tried.
    pub tried: usize,
    /// The candidates.
    pub candidates: Vec<Place>,
    /// The sets, best first.
    #[serde(skip)]
    pub sets: Vec<PlacedSet>,
    /// What `score` is: `smallest eigenvalue of the Gramian over 1 s`.
    pub measure: String,
    /// Its unit.
    pub unit: String,
    /// Whether a larger score is better.
    pub larger_is_better: bool,
    /// Why there is none, in terms of shafts.
    pub infeasible_reason: Option<String>,
}

/// Where a motor or a sensor may sit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Place {
    /// The place.
    pub place: String,
    /// What it costs, as the user says.
    pub cost: f64,
}

/// A set of places that keeps the model controllable (observable).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlacedSet {
    /// The places.
    pub places: Vec<String>,
    /// Sum of the user's costs.
    pub cost: f64,
    /// The physical measure.
    pub score: f64,
    /// Whether every set with a better score costs more, and every set as good costs no less.
    pub efficient: bool,
}

/// How far away the next change of structure is.
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

/// How far the parameters are from values at which controllability, or observability, is lost.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct DistanceToUncontrollability {
    /// The nearest loss found; `None` if there was none within ten tolerances, or none was looked for (`method` is empty).
    pub nearest: Option<UncontrollablePoint>,
    /// Number of points that the search for it started from; 0 if there was no search.
    pub starts: usize,
    /// Number of tolerances within which it is proven that there is no loss; 0 if nothing is proven.
    #[serde(rename = "proven_distance_tolerances")]
    pub proven_distance: f64,
    /// Verdict over the whole box of parameters.
    #[serde(rename = "box")]
    pub box_verdict: BoxVerdict,
    /// How the verdict was reached; empty: nothing was searched.
    pub method: String,
    /// Sampling of the box.
    pub sampling: Option<Sampling>,
}

/// Parameters at which controllability or observability is lost.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct UncontrollablePoint {
    /// Largest deviation in units of each parameter's tolerance; below one it lies inside the box.
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

/// How far plain matrices are from losing controllability or observability.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct MatrixDistances {
    /// To the nearest system that is not controllable; `null` if it is one, without inputs, or for more than 200 states.
    pub controllability: Option<MatrixDistance>,
    /// To the nearest system that is not observable, from the transposed matrices: its `change_of_B` is that of C, transposed.
    pub observability: Option<MatrixDistance>,
}

/// The Frobenius norm of the least change of `[A, B]` after which some mode is not reached, between two bounds. It depends on
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
    /// How far the numbers of the file may lie from what was meant: half a unit of the last digit of decimals, or 2⁻⁵³ of each
    /// binary number times the number of states; Frobenius norm.
    pub data_uncertainty: f64,
    /// Whether `upper` is below `last_digit`: the data do not tell such a system from one that has lost the mode.
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

/// What is known over a whole box of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub enum BoxVerdict {
    /// No loss anywhere in the box, proven.
    #[serde(rename = "certified")]
    Certified,
    /// A loss was found in the box.
    #[serde(rename = "lost")]
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

impl From<MinorColumn> for [usize; 2] {
    fn from(column: MinorColumn) -> Self {
        [column.input, column.power]
    }
}
