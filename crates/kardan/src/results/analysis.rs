//! The result of a structure analysis: chapters 4 and 5 of the source for one model at one operating point.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::{
    Complex, Definition, DescriptorSystem, DiscreteTime, Entry, Interval, Mechanism, NamedMatrix, Parity, Pole,
    Realisations, SparseMatrix, StabilityVerdict, SystemProperties,
};

/// All results of `kardan analyze`. Parts that do not apply (a plain state-space input has no elements) are empty
/// or `None`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Analysis {
    /// Name of the model.
    pub name: String,
    /// From the file.
    pub description: String,
    /// Its parts and their connections; none of a plain state-space input.
    pub mechanism: Mechanism,
    /// Whether the model is a constant linear constrained mechanical system, and where it was linearised if not.
    pub class: Option<Class>,
    /// Names of the reduced coordinates.
    pub coordinates: Vec<String>,
    /// Reduced matrices for three bases of the constraint kernel.
    pub bases: Vec<Basis>,
    /// The projector of the constraint forces.
    pub constraint_forces: Option<ConstraintForces>,
    /// Eliminated motions without inertia.
    pub elimination: Option<Elimination>,
    /// Charges that are integrators without effect, if only they are uncontrollable or unobservable.
    pub counting: Option<Counting>,
    /// The modes, by size of their eigenvalue.
    pub modes: Vec<Mode>,
    /// Exact answers on controllability, observability, zeros and the least numbers of inputs and outputs.
    pub structure: Structure,
    /// Possible locations of motors and sensors.
    pub placement: Placement,
    /// Distance to the next change of structure.
    pub sensitivity: Option<Sensitivity>,
    /// Stability, decoupling and transmission zeros, indices.
    pub properties: Option<SystemProperties>,
    /// If a torque has a kink at the operating point: the model on the opposite side of it.
    pub opposite_side: Option<OppositeModel>,
    /// Kalman's decomposition, the minimal realisation and the staircase form.
    pub realisations: Option<Realisations>,
    /// In discrete time: the sample time.
    pub discrete: Option<DiscreteTime>,
    /// Of plain matrices with a singular E: what that means. The rest is about the equivalent state space.
    pub descriptor: Option<DescriptorSystem>,
    /// Of plain matrices: distance to a loss of controllability or observability.
    pub matrix_distance: Option<MatrixDistances>,
    /// Detectable and isolable sensor faults, if requested.
    pub parity: Option<Parity>,
    /// Notes to the reader: choices by default, omitted parts.
    pub notes: Vec<String>,
    /// Of an analysis that ended early: why, and which parts are missing. Missing parts are empty, without a statement on the model.
    pub unfinished: Option<String>,
}

/// The linear model on the opposite side of the kinks at its operating point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct OppositeModel {
    /// The side of all other results: ``a.phi` > 0`.
    pub reference_side: String,
    /// This side.
    pub side: String,
    /// Whether the system is controllable here; `None` if that is not decided.
    pub controllable: Option<bool>,
    /// Whether the system is observable here; `None` if that is not decided.
    pub observable: Option<bool>,
    /// Whether it is stable here.
    pub stability: StabilityVerdict,
    /// The modes here, by size of their eigenvalue.
    pub modes: Vec<Mode>,
}

/// Eliminated motions without inertia: the remaining states are those of [`Structure::states`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Elimination {
    /// Number of independent motions without inertia.
    pub motions: usize,
    /// One of them, over the coordinates: `a - 2 b`.
    pub direction: String,
    /// Former states: they follow algebraically from the others and the inputs.
    pub removed: Vec<String>,
    /// States that are combinations of the original ones.
    pub definitions: Vec<Definition>,
}

/// Charges without effect: integrals of a current. The other results exclude them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Counting {
    /// Each charge, or sum of charges.
    pub charges: Vec<String>,
    /// Whether all other states are controllable.
    pub remaining_controllable: bool,
    /// Whether all other states are observable, if no output depends on these charges.
    pub remaining_observable: bool,
}

/// The verdict on Definition 4.4.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Class {
    /// Whether all five assumptions are true without linearisation.
    pub constant_linear: bool,
    /// The five assumptions, in the order of the source.
    pub assumptions: Vec<Assumption>,
    /// The kind of every constraint.
    pub constraints: Vec<ConstraintClass>,
    /// The operating point of the linearisation.
    pub operating_point: OperatingPoint,
}

/// One of the five assumptions (4.27)-(4.31).
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Assumption {
    /// `the inertia matrix is constant, symmetric and positive definite (4.27)`.
    pub statement: String,
    /// Whether it is satisfied.
    pub satisfied: bool,
    /// What violates it.
    pub violations: Vec<Breach>,
}

/// A violation of an assumption.
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
    /// Holonomic (on positions alone); `None`: not decided.
    pub holonomic: Option<bool>,
    /// Without time.
    pub scleronomic: bool,
    /// With constant coefficients.
    pub linear: bool,
    /// How that was decided, and what of the source applies, if it has no constant coefficients and is no transmission.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// The operating point of a linearisation.
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

/// The angle of a shaft.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ShaftAngle {
    /// The shaft.
    pub shaft: String,
    /// Its angle, rad.
    #[serde(rename = "angle_rad")]
    pub angle: f64,
}

/// The state of a friction direction at an operating point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct FrictionState {
    /// The element.
    pub element: String,
    /// Its Coulomb torque, N m.
    #[serde(rename = "coulomb_torque_N_m")]
    pub coulomb_torque: f64,
    /// Whether it sticks; then it is a constraint.
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
    /// Bounds (4.43), (4.45), (4.46) with the true eigenvalues: inertia, damping, stiffness.
    pub bounds: Vec<EigenvalueBounds>,
}

/// Geršgorin's discs of a reduced matrix with its true eigenvalues.
///
/// Every eigenvalue lies in at least one disc; a disc need not contain the eigenvalue of its own number (erratum to (4.43)).
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
    /// Its mode shape.
    pub shape: Vec<ShapePart>,
    /// Shares of the energy stored during the motion, kinetic and potential, by element.
    pub stored: Vec<StoredShare>,
    /// Shares of the loss by element.
    pub dissipated: Vec<ElementShare>,
    /// The exact factor of the characteristic polynomial with this root: `s + 2`.
    pub factor: String,
    /// Whether it is controllable (Hautus).
    #[serde(skip)]
    pub controllable: bool,
    /// Whether it is observable (Hautus).
    #[serde(skip)]
    pub observable: bool,
}

/// The frequency of a mode.
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

/// A component of a mode shape.
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

/// The share of an element in the energy stored during a motion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct StoredShare {
    /// The element.
    pub element: String,
    /// The form of the energy.
    pub energy: EnergyKind,
    /// The share.
    pub share: f64,
}

/// The share of an element in a total: stored energy or loss.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ElementShare {
    /// The element.
    pub element: String,
    /// The share.
    pub share: f64,
}

/// A component of a failing mode.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct NamedShare {
    /// The shaft, state or element.
    pub name: String,
    /// The share.
    pub share: f64,
}

/// The form of stored energy.
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

/// Possible locations of motors and sensors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Placement {
    /// Smallest sets of motors, best first.
    pub inputs: Option<PlacementSearch>,
    /// Smallest sets of sensors, best first.
    pub outputs: Option<PlacementSearch>,
}

/// The result of one search.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct PlacementSearch {
    /// `2 of the 5 places are needed: 3 of the 10 possible sets of 2 are enough (all were tried)`, or `bounded search …`.
    pub method: String,
    /// Whether every set was tried.
    pub exhaustive: bool,
    /// Bound on the gain of a better set if the search was not exhaustive: `(cost found − lower bound) / cost`.
    pub gap: f64,
    /// Sets tried.
    pub tried: usize,
    /// The candidates.
    pub candidates: Vec<Place>,
    /// The sets, best first.
    #[serde(skip)]
    pub sets: Vec<PlacedSet>,
    /// The meaning of `score`: `smallest eigenvalue of the Gramian over 1 s`.
    pub measure: String,
    /// Its unit.
    pub unit: String,
    /// Whether a larger score is better.
    pub larger_is_better: bool,
    /// Why there is none, in terms of shafts.
    pub infeasible_reason: Option<String>,
}

/// A possible location of a motor or a sensor.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Place {
    /// The location.
    pub place: String,
    /// The cost given by the user.
    pub cost: f64,
}

/// A set of locations with which the model is controllable (observable).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlacedSet {
    /// The locations.
    pub places: Vec<String>,
    /// Sum of the user's costs.
    pub cost: f64,
    /// The physical measure.
    pub score: f64,
    /// Whether every set with a better score costs more, and every set as good costs no less.
    pub efficient: bool,
}

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
