//! The result of a structure analysis: chapters 4 and 5 of the source for one model at one operating point.

use schemars::JsonSchema;
use serde::Serialize;

use super::constrained_model::{Basis, Class, ConstraintForces};
use super::distances::{MatrixDistances, Sensitivity};
use super::modes::Mode;
use super::placement::Placement;
use super::structure::Structure;
use super::{
    Definition, DescriptorSystem, DiscreteTime, Mechanism, Parity, Realisations, StabilityVerdict, SystemProperties,
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
