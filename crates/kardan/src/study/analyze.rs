//! What `kardan analyze` asks for.

use std::collections::BTreeSet;

use super::massless::{Mechanical, not_eliminated, state_name};
use super::prepare::is_error;
use super::sensitivity::sensitivity;
use super::signals::{charges, choose, named, signals};
use super::{AnalysisSpec, AnalyzeSettings, Part, Prepared, PreparedVariant, Progress, Project};
use crate::analysis::{
    BasisError, Candidate, ConstrainedSystem, LinearSystem, Measure, Mechanics, Side, StructureError, bases,
    certified_structure, class, constraint_forces, construction, exact_modes, exact_modes_of_pencil, failing_modes,
    linear_system, place, reduction, structure, with_candidates,
};
use crate::diagnostics::Diagnostic;
use crate::model::read_state_space;
use crate::num::{Definiteness, Matrix, Rational, definiteness, rational_to_f64};
use crate::results::{Analysis, Mode, Placement, Structure};

/// Analyses a model file.
///
/// ```
/// use kardan::{model, study};
/// let source = model::builtin("two-bodies").unwrap().source;
/// let analysis = study::analyze(source, &Default::default(), &study::Silent).unwrap();
/// assert!(analysis.structure.controllable());
/// assert_eq!(analysis.structure.min_inputs, 1);
/// ```
///
/// # Errors
/// All mistakes of the file, or why it cannot be analysed.
pub fn analyze(source: &str, settings: &AnalyzeSettings, progress: &dyn Progress) -> Result<Analysis, Vec<Diagnostic>> {
    Project::open(source).analyze(settings, progress)
}

impl Project {
    /// Analyses one variant; see [`analyze`](super::analyze()).
    ///
    /// # Errors
    /// All mistakes, or why it cannot be analysed.
    pub fn analyze(&self, settings: &AnalyzeSettings, progress: &dyn Progress) -> Result<Analysis, Vec<Diagnostic>> {
        let (prepared, diagnostics) = self.for_analysis();
        if diagnostics.iter().any(is_error) {
            return Err(diagnostics.to_vec());
        }
        let variant = choose(&prepared.variants, settings.variant.as_deref()).map_err(|problem| vec![problem])?;
        let mut analysis = analyze_variant(prepared, variant, settings, progress)?;
        keep(progress, &analysis, "what the tolerances allow");
        sensitivity(self.read().0, prepared, variant, settings, &mut analysis, progress)?;
        analysis.notes.extend(diagnostics.iter().map(|warning| warning.message.clone()));
        progress.release();
        Ok(analysis)
    }
}

/// Keeps what is found of an analysis, without what it has not come to.
fn keep(progress: &dyn Progress, analysis: &Analysis, missing: &str) {
    progress.keep(&|| {
        let unfinished = Some(format!("{missing} are missing"));
        Part::Analysis(Box::new(Analysis { unfinished, ..analysis.clone() }))
    });
}

/// Analyses one variant of a file without mistakes.
pub(super) fn analyze_variant(
    prepared: &Prepared,
    variant: &PreparedVariant,
    settings: &AnalyzeSettings,
    progress: &dyn Progress,
) -> Result<Analysis, Vec<Diagnostic>> {
    let reduced = &variant.reduced;
    let mut notes = Vec::new();
    let (inputs, outputs) = signals(variant, settings, &mut notes)?;
    let spec = &variant.analysis;
    let position = spec.position(&reduced.coordinate_names(), &variant.scenario.position);
    let stuck: BTreeSet<String> = spec.stuck.iter().cloned().collect();
    let system = ConstrainedSystem::at(reduced, &position, &stuck, &inputs);
    let (coordinates, basis) = system.explicit_basis(&reduced.coordinates);
    if coordinates.is_empty() {
        return Err(vec![
            Diagnostic::error("analysis::no-motion", "with this friction stuck nothing can move")
                .help("let some of the elements in `stuck` slide"),
        ]);
    }
    let names: Vec<String> = coordinates.iter().map(|&shaft| system.shafts[shaft].clone()).collect();
    let charges = charges(reduced);
    let pencil = linear_system(&system, &coordinates, &basis, &outputs);
    let mechanical = Mechanical::new(&pencil, names.clone());
    let regular = mechanical.is_regular();
    if !regular && !settings.eliminate_massless {
        return Err(mechanical.refusal(variant));
    }
    let (mut linear, elimination) = if regular {
        (pencil.clone(), None)
    } else {
        let rest = mechanical.eliminate().map_err(|error| not_eliminated(error, &charges, variant))?;
        let told = mechanical.elimination(&rest, &charges);
        (rest.system, Some(told))
    };
    linear.states.iter_mut().for_each(|state| *state = state_name(state, &charges));
    let mut analysis = Analysis {
        name: prepared.name.clone(),
        description: prepared.description.clone(),
        class: Some(class(reduced, &position, &stuck)),
        coordinates: names,
        elimination,
        notes,
        ..Analysis::default()
    };
    let rest = "modes, the construction of inputs, bases and places";
    decide(&mut analysis, &linear, settings.certify, (progress, &variant.name), rest)?;
    let found = if regular {
        exact_modes(&system, &reduction(&system, &reduced.coordinates), &analysis.structure.factors)
    } else {
        let note = "after the elimination the modes are those of the states that remain: without energies";
        analysis.notes.push(note.into());
        exact_modes_of_pencil(&linear, &analysis.structure.factors)
    };
    list(&mut analysis, found);
    let mechanics = regular.then_some(Mechanics { system: &system, basis: &basis });
    failing_modes(&mut analysis.structure, &mut analysis.modes, &linear, mechanics);
    keep(progress, &analysis, "the construction of inputs, bases and places");
    construct(&mut analysis, &linear);
    keep(progress, &analysis, "bases and places");
    let notes = &mut analysis.notes;
    let refused = |error: BasisError| vec![Diagnostic::error("analysis::basis", error.to_string())];
    let (bases, constraint_forces) = if definiteness(&system.inertia_matrix()) == Definiteness::Positive {
        let forces =
            (!system.constraints.is_empty()).then(|| constraint_forces(&system)).transpose().map_err(refused)?;
        (bases(&system, &reduced.coordinates).map_err(refused)?, forces)
    } else {
        notes.push(if charges.is_empty() {
            "some shafts have no inertia of their own: orthogonal bases and the projector are left out".into()
        } else {
            "some charges have no inductance of their own: orthogonal bases and the projector are left out".into()
        });
        (Vec::new(), None)
    };
    let massless = (!regular).then_some(&mechanical);
    (analysis.bases, analysis.constraint_forces) = (bases, constraint_forces);
    keep(progress, &analysis, "places");
    let notes = &mut analysis.notes;
    analysis.placement = placement(spec, &system, &basis, (&linear, massless), &analysis.structure, notes);
    Ok(analysis)
}

/// The modes, or a note that there are none.
fn list(analysis: &mut Analysis, modes: Option<Vec<Mode>>) {
    analysis.modes = modes.unwrap_or_else(|| {
        let note = "the eigenvalue iteration failed: no modes are listed, the structure is exact all the same";
        analysis.notes.push(note.into());
        Vec::new()
    });
}

/// Analyses a plain state space `E ẋ = A x + B u`, `y = C x + D u`; `bytes` is a JSON or MAT file as it is.
///
/// # Errors
/// All mistakes of the file, or why it cannot be analysed.
pub fn analyze_state_space(
    bytes: &[u8],
    settings: &AnalyzeSettings,
    progress: &dyn Progress,
) -> Result<Analysis, Vec<Diagnostic>> {
    let mut system = read_state_space(bytes)?;
    let mut wrong = Vec::new();
    let mut pick = |what: &str, asked: &[String], all: &[String]| -> Vec<usize> {
        if asked.is_empty() {
            return (0..all.len()).collect();
        }
        let found = named(what, asked, all, &mut wrong);
        found.iter().filter_map(|name| all.iter().position(|other| other == name)).collect()
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
    let mut analysis = Analysis { name: "state space".into(), ..Analysis::default() };
    let rest = "modes and the construction of inputs";
    decide(&mut analysis, &system, settings.certify, (progress, "state space"), rest)?;
    let modes = exact_modes_of_pencil(&system, &analysis.structure.factors);
    list(&mut analysis, modes);
    failing_modes(&mut analysis.structure, &mut analysis.modes, &system, None);
    keep(progress, &analysis, "the construction of inputs");
    construct(&mut analysis, &system);
    progress.release();
    Ok(analysis)
}

/// The exact structure; with `certify` every answer proven, which may take long and reports how far it is: what random primes tell
/// comes first then, and is kept.
fn decide(
    analysis: &mut Analysis,
    system: &LinearSystem,
    certify: bool,
    (progress, name): (&dyn Progress, &str),
    rest: &str,
) -> Result<(), Vec<Diagnostic>> {
    let failed = |error: StructureError| vec![Diagnostic::error("analysis::structure", error.to_string())];
    progress.advance(0, name, 0.0);
    if certify {
        analysis.structure = structure(system).map_err(failed)?;
        keep(progress, analysis, &format!("the proofs asked for, {rest}"));
        let report = |fraction: f64| progress.advance(0, name, fraction);
        analysis.structure = certified_structure(system, &report).map_err(failed)?;
    } else {
        analysis.structure = structure(system).map_err(failed)?;
    }
    keep(progress, analysis, rest);
    Ok(())
}

/// Builds the least number of inputs, or says that it is not done.
fn construct(analysis: &mut Analysis, system: &LinearSystem) {
    analysis.structure.construction = construction(system);
    if analysis.structure.construction.is_none() {
        analysis.notes.push("the model is too large to construct the least number of inputs step by step".into());
    }
}

/// Ranks the places of `[analysis]` for motors and sensors; of a system with motions without inertia (`massless`) by what
/// remains of it with the places as inputs (outputs).
fn placement(
    spec: &AnalysisSpec,
    system: &ConstrainedSystem,
    basis: &Matrix<Rational>,
    (linear, massless): (&LinearSystem, Option<&Mechanical<'_>>),
    structure: &Structure,
    notes: &mut Vec<String>,
) -> Placement {
    let r = basis.columns();
    let horizon = spec.horizon.to_f64();
    let shaft = |name: &str| system.shafts.iter().position(|shaft| shaft == name).expect("the place was checked");
    let column = |name: &str, begin: usize| -> Vec<Rational> {
        let row = shaft(name);
        (0..2 * r)
            .map(|j| if (begin..begin + r).contains(&j) { basis[(row, j - begin)].clone() } else { Rational::ZERO })
            .collect()
    };
    // The system with the columns of the places, and what its states are made of.
    let rest = |side: Side, places: &mut [Candidate]| -> Option<(LinearSystem, Vec<Combination>)> {
        let itself = |state: &String| vec![(state.clone(), Rational::ONE)];
        let Some(mechanical) = massless else {
            return Some((linear.clone(), linear.states.iter().map(itself).collect()));
        };
        let columns: Vec<Vec<Rational>> = places.iter().map(|place| place.column.clone()).collect();
        let found = mechanical.eliminate_for(side, &columns).ok()?;
        let n = found.system.states.len();
        for (k, place) in places.iter_mut().enumerate() {
            let entry = |i| if side == Side::Inputs { &found.system.b[(i, k)] } else { &found.system.c[(k, i)] };
            place.column = (0..n).map(|i| entry(i).clone()).collect();
        }
        let made = |state: &String| {
            let definition = found.definitions.iter().find(|(name, _)| name == state);
            definition.map_or_else(|| itself(state), |(_, terms)| terms.clone())
        };
        let made = found.system.states.iter().map(made).collect();
        Some((found.system, made))
    };
    let search = |side: Side, mut places: Vec<Candidate>, measure: &mut Choice<'_>, unit: &str| {
        let least = if side == Side::Inputs { structure.min_inputs } else { structure.min_outputs };
        let (linear, states) = rest(side, &mut places)?;
        let mut found = place(&linear, side, &places, least, horizon, &measure(&states)?)?;
        found.unit = unit.into();
        if found.sets.is_empty() {
            found.none_because = Some(why_not(&linear, side, &places));
        }
        Some(found)
    };
    // Speeds times the horizon are angles too.
    let scale = |states: &[Combination], angle: f64, speed: f64| {
        let is_speed = |terms: &Combination| terms.iter().all(|(name, _)| name.ends_with(".w") || name.ends_with(".i"));
        Measure::SmallestEigenvalue(states.iter().map(|s| if is_speed(s) { speed } else { angle }).collect())
    };
    let motors: Vec<Candidate> = spec
        .actuators
        .iter()
        .map(|place| Candidate { name: place.shaft.clone(), cost: place.cost, column: column(&place.shaft, r) })
        .collect();
    let value = |name: &String| spec.motion.iter().find(|(signal, _)| signal == name).map_or(0.0, |(_, x)| *x);
    let mut target = |states: &[Combination]| {
        if spec.motion.is_empty() {
            return Some(scale(states, 1.0, horizon));
        }
        let moved = spec.motion.iter().filter(|(_, value)| *value != 0.0).map(|(name, _)| name);
        if let Some(name) = moved.into_iter().find(|name| states.iter().flatten().all(|(other, _)| other != *name)) {
            notes.push(format!(
                "motors are not placed: the motion to reach names `{name}`, which is no state after the elimination"
            ));
            return None;
        }
        let sum = |terms: &Combination| terms.iter().map(|(name, x)| rational_to_f64(x) * value(name)).sum();
        Some(Measure::Energy(states.iter().map(sum).collect()))
    };
    let unit = if spec.motion.is_empty() { "rad^2/(N^2 m^2 s)" } else { "N^2 m^2 s" };
    let inputs = (!motors.is_empty()).then(|| search(Side::Inputs, motors, &mut target, unit));
    let sensors: Vec<Candidate> = spec
        .sensors
        .iter()
        .map(|place| {
            let begin = if place.signal.ends_with(".w") { r } else { 0 };
            Candidate { name: place.signal.clone(), cost: place.cost, column: column(&place.shaft, begin) }
        })
        .collect();
    let mut measure = |states: &[Combination]| Some(scale(states, 1.0, horizon.recip()));
    let unit = if spec.sensors.iter().all(|place| place.signal.ends_with(".phi")) { "s" } else { "SI" };
    let outputs = (!sensors.is_empty()).then(|| search(Side::Outputs, sensors, &mut measure, unit));
    Placement { inputs: inputs.flatten(), outputs: outputs.flatten() }
}

/// A state as a combination of angles and speeds.
type Combination = Vec<(String, Rational)>;

/// What ranks the sets of places of a system with these states.
type Choice<'a> = dyn FnMut(&[Combination]) -> Option<Measure> + 'a;

/// Why all places together are not enough: which motions they miss.
fn why_not(system: &LinearSystem, side: Side, places: &[Candidate]) -> String {
    let (what, verb) = if side == Side::Inputs { ("motor", "reach") } else { ("sensor", "show") };
    let missed: Vec<String> = structure(&with_candidates(system, side, places)).map_or_else(
        |_| Vec::new(),
        |found| found.factors.into_iter().filter(|f| f.input_defect > 0).map(|f| f.polynomial).collect(),
    );
    format!(
        "a {what} at every place ({}) does not {verb} the modes that are roots of {}",
        places.iter().map(|place| place.name.as_str()).collect::<Vec<_>>().join(", "),
        missed.join(" and of ")
    )
}
