//! The structure analysis of a model as one JSON object.

use schemars::JsonSchema;
use serde::Serialize;

use super::printed::printed;
use kardan_results::serial::Ending;
use kardan_results::{
    Analysis, Basis, Certificate, Class, Complex, ConstraintForces, Construction, Counting, DescriptorSystem,
    DiscreteTime, Elimination, Factor, FailingMode, MatrixDistances, Mechanism, Mode, OppositeModel, Parity, Placement,
    Sensitivity, SystemProperties, Zeros,
};

/// The structure of a model: modes, controllability, observability, zeros, least numbers and locations of motors and sensors.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Analysis")]
pub(super) struct AnalysisView<'a> {
    /// Name of the model.
    name: &'a str,
    /// From the file.
    description: &'a str,
    /// Its parts and their connections; none of a plain state-space input.
    mechanism: &'a Mechanism,
    /// Whether the model is a constant linear constrained mechanical system, and where it was linearised if not.
    model_class: Option<&'a Class>,
    /// Names of the reduced coordinates.
    coordinates: &'a [String],
    /// Eliminated motions without inertia; `null` if there was none.
    elimination: Option<&'a Elimination>,
    /// Charges that are integrators without effect, if only they are uncontrollable or unobservable; else `null`.
    integrals_without_effect: Option<&'a Counting>,
    /// The modes, by size of their eigenvalue.
    modes: Vec<ModeView<'a>>,
    /// Whether the system is controllable; `null` if a requested proof was not found.
    controllable: Option<bool>,
    /// Whether the system is observable; `null` if a requested proof was not found.
    observable: Option<bool>,
    /// Both; `null` where that is not decided.
    minimal: Option<bool>,
    /// Uncontrollable modes.
    uncontrollable: &'a [FailingMode],
    /// Unobservable modes.
    unobservable: &'a [FailingMode],
    /// Rank of the controllability matrix.
    controllable_rank: Option<usize>,
    /// Rank of the observability matrix.
    observable_rank: Option<usize>,
    /// Number of the states.
    states: usize,
    /// Names of the states.
    state_names: &'a [String],
    /// Names of the inputs.
    inputs: &'a [String],
    /// Names of the outputs.
    outputs: &'a [String],
    /// Relative degrees.
    relative_degrees: Degrees<'a>,
    /// Invariant zeros.
    zeros: &'a Zeros,
    /// The case of the theorems on least numbers: `general`, `pure damping`, `no damping`, `state space`.
    kind: &'a str,
    /// Least number of inputs for controllability.
    min_inputs: usize,
    /// Least number of outputs for observability.
    min_outputs: usize,
    /// Coprime square-free factors of the characteristic polynomial.
    factors: Vec<FactorView<'a>>,
    /// Non-trivial invariant factors of sI − A, each dividing the next.
    invariant_factors: &'a [String],
    /// Inputs of the least number, built factor by factor.
    construction: Option<&'a Construction>,
    /// Sets of locations, best first, motors before sensors.
    placements: Vec<PlacedView<'a>>,
    /// The search method of the locations.
    placement_search: &'a Placement,
    /// Distance to the next change of structure.
    sensitivity: Option<&'a Sensitivity>,
    /// Stability, decoupling and transmission zeros, indices.
    properties: Option<&'a SystemProperties>,
    /// The model on the opposite side of the kinks at its operating point; `null` where it has none.
    opposite_side: Option<&'a OppositeModel>,
    /// `null` in continuous time.
    discrete: Option<&'a DiscreteTime>,
    /// Of plain matrices with a singular E: what that means; the rest is about the equivalent state space. `null` where E is regular.
    descriptor: Option<&'a DescriptorSystem>,
    /// Of plain matrices: how far they are from losing controllability or observability.
    matrix_distance: Option<&'a MatrixDistances>,
    /// Detectable and isolable sensor faults, with their parity relations; `null` without `--parity`.
    parity: Option<&'a Parity>,
    /// Reduced matrices for three bases of the constraint kernel.
    bases: &'a [Basis],
    /// The projector of the constraint forces.
    constraint_forces: Option<&'a ConstraintForces>,
    /// The proof of the numbers above. Its whole numbers may exceed 2⁵³.
    certificate: &'a Certificate,
    /// Notes to the reader.
    notes: &'a [String],
    #[serde(flatten)]
    ending: Ending<'a>,
}

/// One mode; a conjugate pair counts once.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Mode")]
struct ModeView<'a> {
    #[serde(flatten)]
    mode: &'a Mode,
    /// Whether it is controllable; `null` if that is not decided.
    controllable: Option<bool>,
    /// Whether it is observable; `null` if that is not decided.
    observable: Option<bool>,
}

/// Number of differentiations of an output until an input appears.
#[derive(Serialize, JsonSchema)]
struct Degrees<'a> {
    /// Names of the outputs.
    outputs: &'a [String],
    /// Names of the inputs.
    inputs: &'a [String],
    /// A row for each output; `null` where the input never reaches it.
    table: &'a [Vec<Option<usize>>],
    /// The least of each row.
    per_output: Vec<Option<usize>>,
}

/// A square-free factor of the characteristic polynomial.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Factor")]
struct FactorView<'a> {
    #[serde(flatten)]
    factor: &'a Factor,
    /// Rank defect of `[λI − A, B]`; `null` where that is not decided.
    input_defect: Option<usize>,
    /// Rank defect of `[λI − A; C]`; `null` where that is not decided.
    output_defect: Option<usize>,
}

/// A set of locations with which the model is controllable (observable).
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "PlacedSet")]
struct PlacedView<'a> {
    /// The locations of motors.
    #[serde(skip_serializing_if = "Option::is_none")]
    inputs: Option<&'a [String]>,
    /// The locations of sensors.
    #[serde(skip_serializing_if = "Option::is_none")]
    outputs: Option<&'a [String]>,
    /// The physical measure.
    score: f64,
    /// Its unit.
    unit: &'a str,
    /// Sum of the user's costs.
    cost: f64,
    /// Whether every better set costs more.
    efficient: bool,
}

/// The structure of a model in the result of a run.
#[derive(Serialize, JsonSchema)]
pub(super) struct Short<'a> {
    /// Names of the inputs.
    inputs: &'a [String],
    /// Names of the outputs.
    outputs: &'a [String],
    /// Number of the states.
    states: usize,
    /// Whether the system is controllable.
    controllable: bool,
    /// Whether the system is observable.
    observable: bool,
    /// Rank of the controllability matrix.
    controllable_rank: usize,
    /// Rank of the observability matrix.
    observable_rank: usize,
    /// Least number of inputs for controllability.
    min_inputs: usize,
    /// Least number of outputs for observability.
    min_outputs: usize,
    /// Eigenvalues of the modes, 1/s.
    eigenvalues_per_s: Vec<Complex>,
    /// Invariant zeros, 1/s.
    zeros: &'a [Complex],
    /// Notes to the reader.
    notes: &'a [String],
}

/// Gives an analysis as one JSON object on one line, in SI; a number that is not finite is `null`, a complex number is
/// `[re, im]`, an exact one a text (`"-3/2"`), an index counts from 0, and a part that does not apply is `null` or empty.
///
/// Its keys are described by [`schema`](super::schema()) of `analyze`.
pub fn analysis_json(analysis: &Analysis) -> String {
    printed(AnalysisView::of(analysis))
}

impl<'a> AnalysisView<'a> {
    fn of(analysis: &'a Analysis) -> Self {
        let structure = &analysis.structure;
        let (controllable, observable) = (structure.controllability(), structure.observability());
        let mode = |mode: &'a Mode| ModeView {
            mode,
            controllable: controllable.map(|_| mode.controllable),
            observable: observable.map(|_| mode.observable),
        };
        let factor = |factor: &'a Factor| FactorView {
            factor,
            input_defect: controllable.map(|_| factor.input_defect),
            output_defect: observable.map(|_| factor.output_defect),
        };
        Self {
            name: &analysis.name,
            description: &analysis.description,
            mechanism: &analysis.mechanism,
            model_class: analysis.class.as_ref(),
            coordinates: &analysis.coordinates,
            elimination: analysis.elimination.as_ref(),
            integrals_without_effect: analysis.counting.as_ref(),
            modes: analysis.modes.iter().map(mode).collect(),
            controllable,
            observable,
            minimal: structure.minimality(),
            uncontrollable: &structure.uncontrollable,
            unobservable: &structure.unobservable,
            controllable_rank: controllable.map(|_| structure.controllable_rank),
            observable_rank: observable.map(|_| structure.observable_rank),
            states: structure.states.len(),
            state_names: &structure.states,
            inputs: &structure.inputs,
            outputs: &structure.outputs,
            relative_degrees: Degrees {
                outputs: &structure.outputs,
                inputs: &structure.inputs,
                table: &structure.relative_degrees,
                per_output: structure.relative_degrees.iter().map(|row| row.iter().flatten().min().copied()).collect(),
            },
            zeros: &structure.zeros,
            kind: &structure.kind,
            min_inputs: structure.min_inputs,
            min_outputs: structure.min_outputs,
            factors: structure.factors.iter().map(factor).collect(),
            invariant_factors: &structure.invariant_factors,
            construction: structure.construction.as_ref(),
            placements: placements(&analysis.placement),
            placement_search: &analysis.placement,
            sensitivity: analysis.sensitivity.as_ref(),
            properties: analysis.properties.as_ref(),
            opposite_side: analysis.opposite_side.as_ref(),
            discrete: analysis.discrete.as_ref(),
            descriptor: analysis.descriptor.as_ref(),
            matrix_distance: analysis.matrix_distance.as_ref(),
            parity: analysis.parity.as_ref(),
            bases: &analysis.bases,
            constraint_forces: analysis.constraint_forces.as_ref(),
            certificate: &structure.certificate,
            notes: &analysis.notes,
            ending: Ending::of(&analysis.unfinished),
        }
    }
}

impl<'a> Short<'a> {
    pub(super) fn of(analysis: &'a Analysis) -> Self {
        let structure = &analysis.structure;
        Self {
            inputs: &structure.inputs,
            outputs: &structure.outputs,
            states: structure.states.len(),
            controllable: structure.controllable(),
            observable: structure.observable(),
            controllable_rank: structure.controllable_rank,
            observable_rank: structure.observable_rank,
            min_inputs: structure.min_inputs,
            min_outputs: structure.min_outputs,
            eigenvalues_per_s: analysis.modes.iter().map(|mode| mode.eigenvalue).collect(),
            zeros: &structure.zeros.values,
            notes: &analysis.notes,
        }
    }
}

fn placements(placement: &Placement) -> Vec<PlacedView<'_>> {
    let all = [(&placement.inputs, true), (&placement.outputs, false)];
    let searches = all.into_iter().filter_map(|(search, motors)| Some((search.as_ref()?, motors)));
    let sets = searches.flat_map(|(search, motors)| search.sets.iter().map(move |set| (set, search, motors)));
    sets.map(|(set, search, motors)| PlacedView {
        inputs: motors.then_some(set.places.as_slice()),
        outputs: (!motors).then_some(set.places.as_slice()),
        score: set.score,
        unit: &search.unit,
        cost: set.cost,
        efficient: set.efficient,
    })
    .collect()
}
