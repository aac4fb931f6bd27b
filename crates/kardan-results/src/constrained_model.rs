//! The constrained model of an analysis: its class, its operating point, bases of the constraint kernel and constraint forces.

use schemars::JsonSchema;
use serde::Serialize;

use super::NamedMatrix;

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
