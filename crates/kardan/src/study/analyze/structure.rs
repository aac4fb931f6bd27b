//! The computations of `kardan analyze`.

use kardan_rt::functions::{atan2, hypot, ln};

use crate::study::analyze::descriptor::decompose_descriptor;
use crate::study::analyze::parity::parity;
use crate::study::analyze::placement::Places;
use crate::study::analyze::sensitivity::sensitivity;
use crate::study::analyze::stability_at_point::judge_stability;
use crate::study::check::kinks::Kinks;
use crate::study::check::massless_elimination::{Mechanical, not_eliminated};
use crate::study::check::redundant_torques::split_multipliers;
use crate::study::operating_point::working_point::{WorkingPoint, named};
use crate::study::read::state_names::{NonAngleDomains, non_angle_domains, state_name};
use crate::study::{AnalyzeSettings, Part, Prepared, PreparedVariant, Progress, Project, Silent};
use kardan_analysis::{
    BasisError, ConstrainedSystem, DecomposedDescriptor, LinearSystem, MOST_CONSTRUCTED, Mechanics, Reduction, Side,
    StructureError, bases, certified_structure, class, constraint_forces, construction, distance_of_matrices,
    exact_modes_beside, exact_modes_of_pencil, failing_modes, modes, modular_properties, multiplier_constraint_classes,
    needs_modes, properties, realisations, reduction, stability_proofs, state_modular, structure,
};
use kardan_math::num::{Definiteness, Matrix, Rational, definiteness, exact_rank, length, rational_to_f64};
use kardan_mechanics::equations::Domain;
use kardan_mechanics::reduce::Reduced;
use kardan_model::{DataDigits, StateSpace, read_state_space};
use kardan_results::signal_name::{Quantity, SignalName, carrier};
use kardan_results::{
    Analysis, Basis, Breach, Class, ConstraintForces, Counting, DiscreteTime, MatrixDistance, MatrixDistances, Mode,
    OppositeModel, Structure,
};
use kardan_schema::diagnostics::Diagnostic;
use kardan_synthesis::remove_counting_charges;

/// The results that follow after the structure of a model.
const REST: &str = "modes, the construction of inputs, bases and placement";

/// Analyses a model file.
///
/// ```
/// use kardan::model;
/// use kardan::study;
/// let source = model::builtin("two-bodies").unwrap().source;
/// let analysis = study::analyze(source, &Default::default(), &study::Silent).unwrap();
/// assert!(analysis.structure.controllable());
/// assert_eq!(analysis.structure.min_inputs, 1);
/// ```
///
/// # Errors
/// All errors of the file, or the reason why kardan cannot analyse it.
pub fn analyze(source: &str, settings: &AnalyzeSettings, progress: &dyn Progress) -> Result<Analysis, Vec<Diagnostic>> {
    Project::open(source).analyze(settings, progress)
}

impl Project {
    /// Analyses one variant; see [`analyze`](crate::study::analyze()).
    ///
    /// # Errors
    /// All errors, or the reason why kardan cannot analyse it.
    pub fn analyze(&self, settings: &AnalyzeSettings, progress: &dyn Progress) -> Result<Analysis, Vec<Diagnostic>> {
        if !settings.at.is_empty() {
            let here = AnalyzeSettings { at: Vec::new(), ..settings.clone() };
            return self.looked_at(&settings.at).analyze(&here, progress);
        }
        let (prepared, diagnostics) = self.for_analysis()?;
        let variant = prepared.variant(settings.variant.as_deref())?;
        let mut analysis = analyze_variant(prepared, variant, settings, progress)?;
        let in_motion = analysis.class.as_ref().is_some_and(|class| class.operating_point.in_motion);
        if variant.model.tolerances.is_empty() {
            // Nothing varies.
        } else if in_motion {
            let note = "the effect of the tolerances is not analysed: the operating point is one in motion";
            analysis.notes.push(note.into());
        } else if variant.unfrozen.is_some() {
            let note = "the effect of the tolerances is not analysed: a constraint is not solved for a coordinate";
            analysis.notes.push(note.into());
        } else {
            store_partial(progress, &analysis, "the effects of the tolerances");
            sensitivity(self.document(), prepared, variant, settings, &mut analysis, progress)?;
        }
        analysis.parity = parity(self.document(), prepared, variant, settings, &mut analysis.notes)?;
        analysis.notes.extend(diagnostics.iter().map(|warning| warning.message.clone()));
        progress.release();
        Ok(analysis)
    }
}

/// Stores the partial results of an analysis, with the list of missing ones.
fn store_partial(progress: &dyn Progress, analysis: &Analysis, missing: &str) {
    progress.store_partial(&|| {
        let unfinished = Some(format!("{missing} are missing"));
        Part::Analysis(Box::new(Analysis { unfinished, ..analysis.clone() }))
    });
}

/// The class of a model, and its operating point; for constraints enforced by multipliers the class of the original ones, not of their linearisation at the operating point.
fn class_of(variant: &PreparedVariant, point: &WorkingPoint) -> Class {
    let mut found = class(&variant.reduced, &point.position, &point.stuck);
    found.operating_point.in_motion = !point.motion.is_empty();
    found.operating_point.motion.clone_from(&point.motion);
    let Some(unfrozen) = &variant.unfrozen else { return found };
    let classes = multiplier_constraint_classes(unfrozen);
    let is_classified = |element: &str| classes.iter().any(|(class, _)| class.element == element);
    found.constraints.retain(|constraint| !is_classified(&constraint.element));
    if let Some(assumption) = found.assumptions.iter_mut().find(|one| one.statement.starts_with("the constraints are"))
    {
        assumption.violations.retain(|breach| !is_classified(&breach.element));
        let broken = classes
            .iter()
            .filter_map(|(class, why)| Some(Breach { element: class.element.clone(), reason: why.clone()? }));
        assumption.violations.extend(broken);
        assumption.satisfied = assumption.violations.is_empty();
    }
    found.constant_linear = found.assumptions.iter().all(|assumption| assumption.satisfied);
    found.constraints.extend(classes.into_iter().map(|(class, _)| class));
    found
}

/// Analyses one variant of a file without errors.
pub(in crate::study) fn analyze_variant(
    prepared: &Prepared,
    variant: &PreparedVariant,
    settings: &AnalyzeSettings,
    progress: &dyn Progress,
) -> Result<Analysis, Vec<Diagnostic>> {
    let reduced = &variant.reduced;
    let mut notes = Vec::new();
    let point = &WorkingPoint::of(variant, settings, &mut notes)?;
    let WorkingPoint { outputs, system, kinks, .. } = point;
    let mechanical = Mechanical::of(system, &reduced.coordinates, outputs)?;
    let (names, basis) = (mechanical.coordinates.clone(), mechanical.basis.clone());
    let non_angle_domains = non_angle_domains(reduced);
    let (massless, mut linear, elimination) = if mechanical.is_regular() {
        (None, mechanical.into_pencil(), None)
    } else {
        let rest = mechanical.eliminate().map_err(|error| not_eliminated(error, &non_angle_domains, variant))?;
        let elimination = mechanical.elimination(&rest, &non_angle_domains);
        (Some(mechanical), rest.system, Some(elimination))
    };
    linear.states.iter_mut().for_each(|state| *state = state_name(state, &non_angle_domains));
    let mut analysis = Analysis {
        name: prepared.name.clone(),
        description: prepared.description.clone(),
        mechanism: variant.model.mechanism.clone(),
        class: Some(class_of(variant, point)),
        coordinates: names,
        elimination,
        notes,
        ..Analysis::default()
    };
    let (decided, beside) = rayon::join(
        || decide(&mut analysis, &linear, settings.certify, (progress, &variant.name), REST),
        || Beside::of(system, reduced, massless.is_none()),
    );
    decided?;
    analysis.counting = counting(&analysis.structure, &linear, &non_angle_domains);
    let modes = if massless.is_none() {
        exact_modes_beside(system, &beside.reduction, &analysis.structure.factors, || {
            beside.modes.unwrap_or_else(|| modes(system, &beside.reduction))
        })
    } else {
        let note = "after the elimination the modes are those of the states that remain: without energies";
        analysis.notes.push(note.into());
        exact_modes_of_pencil(&linear, &analysis.structure.factors)
    };
    list(&mut analysis, modes);
    let mechanics = massless.is_none().then_some(Mechanics { system, basis: &basis });
    failing_modes(&mut analysis.structure, &mut analysis.modes, &linear, mechanics);
    refine(&mut analysis, &linear);
    judge_stability(variant, point, &linear.states, &mut analysis);
    // A copy of a large analysis takes longer than the remaining work if no placement is requested.
    let spec = &variant.analysis;
    let has_placement = !(spec.actuators.is_empty() && spec.sensors.is_empty());
    if has_placement || linear.states.len() <= MOST_CONSTRUCTED {
        store_partial(progress, &analysis, "the construction of inputs, bases and placement");
    }
    construct(&mut analysis, &linear);
    add_bases(&mut analysis, beside.bases, non_angle_domains.values().any(|domain| *domain == Domain::Charge))?;
    if has_placement {
        store_partial(progress, &analysis, "places");
    }
    let (massless, structure) = (massless.as_ref(), &analysis.structure);
    let places = Places { spec, system, basis: &basis, linear: &linear, massless, structure };
    analysis.placement = places.placement(&mut analysis.notes);
    analysis.opposite_side = opposite_model(prepared, variant, settings, kinks)?;
    Ok(analysis)
}

/// The model on the opposite side of its kinks, if it has kinks.
fn opposite_model(
    prepared: &Prepared,
    variant: &PreparedVariant,
    settings: &AnalyzeSettings,
    kinks: &Kinks,
) -> Result<Option<OppositeModel>, Vec<Diagnostic>> {
    let Some(side) = kinks.opposite().filter(|_| variant.point.side.below.is_empty()) else { return Ok(None) };
    let opposite = analyze_variant(prepared, &variant.on_side(&side), settings, &Silent)?;
    let [own, side] = kinks.describe_sides();
    Ok(Some(OppositeModel {
        reference_side: own,
        side,
        controllable: opposite.structure.controllability(),
        observable: opposite.structure.observability(),
        stability: opposite.properties.map(|found| found.stability).unwrap_or_default(),
        modes: opposite.modes,
    }))
}

/// Integrators without effect (charges), if only they are uncontrollable or unobservable.
fn counting(found: &Structure, linear: &LinearSystem, non_angle_domains: &NonAngleDomains) -> Option<Counting> {
    let is_charge = |state: &String| {
        let name = SignalName::new(state);
        name.is(Quantity::Charge) && non_angle_domains.get(carrier(state)) == Some(&Domain::Charge)
    };
    let charges: Vec<usize> = (0..linear.states.len()).filter(|k| is_charge(&linear.states[*k])).collect();
    if found.minimal() || charges.is_empty() {
        return None;
    }
    let (charges, hidden, rest) = remove_counting_charges(linear, &charges)?;
    let rest = structure(&rest).ok()?;
    let rest_controllable = !found.controllable() && rest.controllable();
    let rest_observable = !found.observable() && hidden && rest.observable();
    (rest_controllable || rest_observable).then_some(Counting {
        charges,
        remaining_controllable: rest_controllable,
        remaining_observable: rest_observable,
    })
}

/// Constraint forces, if there are constraints, and orthogonal bases.
type Orthogonal = (Option<ConstraintForces>, Vec<Basis>);

/// Results that do not depend on the structure.
struct Beside {
    reduction: Reduction,
    /// The modes in floating point, where the user most likely needs them.
    modes: Option<Option<Vec<Mode>>>,
    /// None if some coordinates have no inertia of their own.
    bases: Result<Option<Orthogonal>, BasisError>,
}

impl Beside {
    fn of(system: &ConstrainedSystem, reduced: &Reduced, regular: bool) -> Self {
        let reduction = reduction(system, &reduced.coordinates);
        let modes = (regular && needs_modes(&reduction)).then(|| modes(system, &reduction));
        Self { modes, bases: orthogonal(system, reduced), reduction }
    }
}

fn orthogonal(system: &ConstrainedSystem, reduced: &Reduced) -> Result<Option<Orthogonal>, BasisError> {
    if definiteness(&system.inertia_matrix()) != Definiteness::Positive {
        return Ok(None);
    }
    let constrained = !system.constraints.is_empty();
    let mut forces = constrained.then(|| constraint_forces(system)).transpose()?;
    if let Some(forces) = forces.as_mut().filter(|_| !reduced.redundant.is_empty()) {
        split_multipliers(reduced, forces);
    }
    Ok(Some((forces, bases(system, &reduced.coordinates)?)))
}

/// Orthogonal bases and constraint forces, or a note that they are missing.
fn add_bases(
    analysis: &mut Analysis,
    found: Result<Option<Orthogonal>, BasisError>,
    charges: bool,
) -> Result<(), Vec<Diagnostic>> {
    let refused = |error: BasisError| vec![Diagnostic::error("analysis::basis", error.to_string())];
    if let Some((forces, bases)) = found.map_err(refused)? {
        (analysis.constraint_forces, analysis.bases) = (forces, bases);
    } else {
        let what = if charges { "charges have no inductance" } else { "shafts have no inertia" };
        let note = format!("some {what} of their own: orthogonal bases and the projector are left out");
        analysis.notes.push(note);
    }
    Ok(())
}

/// The modes, or a note that they are missing.
fn list(analysis: &mut Analysis, modes: Option<Vec<Mode>>) {
    analysis.modes = modes.unwrap_or_else(|| {
        let note = "the eigenvalue iteration failed: no modes are listed, the structure is still exact";
        analysis.notes.push(note.into());
        Vec::new()
    });
}

/// Analyses a plain state space `E ẋ = A x + B u`, `y = C x + D u`; `bytes` is the content of a JSON or MAT file.
///
/// # Errors
/// All errors of the file, or the reason why kardan cannot analyse it.
pub fn analyze_state_space(
    bytes: &[u8],
    settings: &AnalyzeSettings,
    progress: &dyn Progress,
) -> Result<Analysis, Vec<Diagnostic>> {
    let StateSpace { mut system, digits, sample_time } = read_state_space(bytes)?;
    let mut wrong = Vec::new();
    let mut pick = |what: &str, chosen: &[String], all: &[String]| -> Vec<usize> {
        if chosen.is_empty() {
            return (0..all.len()).collect();
        }
        let found = named(what, chosen, all, &mut wrong);
        found.iter().filter_map(|name| all.iter().position(|candidate| candidate == name)).collect()
    };
    let inputs = pick("input", &settings.inputs, &system.inputs);
    let outputs = pick("output", &settings.outputs, &system.outputs);
    if !wrong.is_empty() {
        return Err(wrong);
    }
    let n = system.states.len();
    system.b = Matrix::from_fn(n, inputs.len(), |i, j| system.b[(i, inputs[j])].clone());
    system.c = Matrix::from_fn(outputs.len(), n, |i, j| system.c[(outputs[i], j)].clone());
    system.d = Matrix::from_fn(outputs.len(), inputs.len(), |i, j| system.d[(outputs[i], inputs[j])].clone());
    system.inputs = inputs.into_iter().map(|k| system.inputs[k].clone()).collect();
    system.outputs = outputs.into_iter().map(|k| system.outputs[k].clone()).collect();
    let descriptor = (exact_rank(&system.e) < n).then(|| decompose_descriptor(&system)).transpose()?;
    let discrete = sample_time.map(|time| DiscreteTime { sample_time: time.as_ref().map(rational_to_f64) });
    let mut analysis = Analysis { name: "state space".into(), discrete, ..Analysis::default() };
    let is_descriptor = descriptor.is_some();
    if let Some(DecomposedDescriptor { found, equivalent }) = descriptor {
        (analysis.descriptor, system) = (Some(found), equivalent);
    }
    if system.states.is_empty() {
        analysis
            .notes
            .push("no finite eigenvalue: the inputs determine all variables, there are no motions to analyse".into());
        return Ok(analysis);
    }
    let rest = "modes and the construction of inputs";
    decide(&mut analysis, &system, settings.certify, (progress, "state space"), rest)?;
    let modes = exact_modes_of_pencil(&system, &analysis.structure.factors);
    list(&mut analysis, modes);
    if let Some(discrete) = discrete {
        per_sample(&mut analysis, discrete);
    }
    failing_modes(&mut analysis.structure, &mut analysis.modes, &system, None);
    refine(&mut analysis, &system);
    store_partial(progress, &analysis, "the distance to a loss and the construction of inputs");
    if is_descriptor {
        analysis.notes.push("the distance to a loss is not computed where `E` is singular".into());
    } else {
        analysis.matrix_distance = matrix_distances(&analysis, &system, &digits);
    }
    store_partial(progress, &analysis, "the construction of inputs");
    construct(&mut analysis, &system);
    progress.release();
    Ok(analysis)
}

/// Results that follow from the structure, and the canonical forms.
fn refine(analysis: &mut Analysis, system: &LinearSystem) {
    analysis.realisations = realisations(system, &analysis.structure.certificate);
    let (found, discrete) = (analysis.realisations.as_ref(), analysis.discrete.is_some());
    let found_properties = properties(system, &analysis.structure, found, discrete);
    let proofs = stability_proofs(system, &analysis.structure, found, discrete);
    let certificate = &mut analysis.structure.certificate;
    if proofs.stable.is_some() {
        let text = "stable, stabilisable, detectable: Routh's table of exact characteristic polynomials; proven";
        certificate.statements.push(text.into());
    }
    certificate.stability = proofs;
    if !certificate.proven {
        state_modular(system, certificate, &modular_properties(system, &found_properties));
    }
    analysis.properties = Some(found_properties);
}

/// Frequency and damping of modes in discrete time: those of `ln z` over the sample time, per sample if it is unknown.
fn per_sample(analysis: &mut Analysis, discrete: DiscreteTime) {
    for mode in &mut analysis.modes {
        let (size, angle) = (mode.eigenvalue.abs(), atan2(mode.eigenvalue.im, mode.eigenvalue.re));
        let speed = hypot(ln(size), angle);
        mode.natural_frequency = speed / discrete.sample_time.unwrap_or(1.0);
        mode.damping_ratio = if speed == 0.0 || size == 0.0 { 1.0 } else { 0.0 - ln(size) / speed };
    }
    // The half-plane of zeros has no meaning here.
    if !analysis.structure.zeros.values.is_empty() {
        analysis.structure.zeros.growing = None;
    }
    let unit = match discrete.sample_time {
        Some(time) => format!("the sample time is {time} s"),
        None => "the sample time is not known, frequencies are per sample".into(),
    };
    analysis.notes.push(format!(
        "discrete time, {unit}: eigenvalues and zeros are numbers of the z-plane without unit, stable means inside the unit circle"
    ));
}

/// Distance of the matrices to a loss of their properties, compared with the uncertainty of their last digit.
fn matrix_distances(analysis: &Analysis, system: &LinearSystem, digits: &DataDigits) -> Option<MatrixDistances> {
    let n = system.states.len();
    // Computed binary numbers are accurate to about n units of their last digit.
    let computed = if digits.binary { n as f64 } else { 1.0 };
    let identity = Matrix::identity(n);
    let (per_row, size) = match system.e == identity {
        true => (1.0, 0.0),
        false => (
            frobenius(&system.e.solve(&identity)?),
            frobenius(&system.e.solve(&system.a)?) + frobenius(&system.e.solve(&system.b)?),
        ),
    };
    let of = |side: Side, satisfied: bool, data: f64| {
        let found = satisfied.then(|| distance_of_matrices(system, side)).flatten()?;
        let last_digit = per_row * (data + digits.descriptor * size) * computed;
        Some(MatrixDistance {
            data_uncertainty: last_digit,
            within_data_uncertainty: found.upper <= last_digit,
            ..found
        })
    };
    let found = MatrixDistances {
        controllability: of(Side::Inputs, analysis.structure.controllable(), digits.inputs),
        observability: of(Side::Outputs, analysis.structure.observable(), digits.outputs),
    };
    (found != MatrixDistances::default()).then_some(found)
}

fn frobenius(matrix: &Matrix<Rational>) -> f64 {
    length(matrix.to_f64().as_slice())
}

/// The exact structure; with `certify` every answer is proven, which may take long and reports its progress: the answers from random primes
/// come first then and are stored.
fn decide(
    analysis: &mut Analysis,
    system: &LinearSystem,
    certify: bool,
    (progress, name): (&dyn Progress, &str),
    rest: &str,
) -> Result<(), Vec<Diagnostic>> {
    let failed = |error: StructureError| vec![Diagnostic::error("analysis::structure", error.to_string())];
    progress.advance(0, name, 0.0);
    analysis.structure = structure(system).map_err(failed)?;
    if certify {
        store_partial(progress, analysis, &format!("the requested proofs, {rest}"));
        let report = |fraction: f64| progress.advance(0, name, fraction);
        analysis.structure = certified_structure(system, &report).map_err(failed)?;
    }
    store_partial(progress, analysis, rest);
    Ok(())
}

/// Constructs the least number of inputs, or adds a note that it is not done.
fn construct(analysis: &mut Analysis, system: &LinearSystem) {
    analysis.structure.construction = construction(system);
    if analysis.structure.construction.is_none() {
        analysis.notes.push("the model is too large to construct the least number of inputs step by step".into());
    }
}
