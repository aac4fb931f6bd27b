//! What `kardan analyze` asks for.

use std::collections::BTreeSet;

use super::checks::signals_of;
use super::{AnalysisSpec, PreparedVariant, Progress, prepare};
use crate::analysis::{
    BasisError, Candidate, ConstrainedSystem, LinearSystem, Measure, Mechanics, OutputSignal, Side, bases,
    certified_structure, class, constraint_forces, failing_modes, linear_system, modes, modes_of_pencil, place,
    reduction, structure, with_candidates,
};
use crate::diagnostics::{Diagnostic, Severity, nearest, quoted};
use crate::equations::{InputKind, Measured};
use crate::model::read_state_space;
use crate::num::{Definiteness, Matrix, Rational, definiteness};
use crate::results::{Analysis, Placement, Structure};

/// What to analyse and how, beyond what the model file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AnalyzeSettings {
    /// Variant to analyse; `None`: the first.
    pub variant: Option<String>,
    /// Inputs; empty: those of `[analysis]`, else all motors.
    pub inputs: Vec<String>,
    /// Outputs (signals such as `rk.phi`, or sensors); empty: those of `[analysis]`, else all sensors, else the outputs
    /// that the laws control, else the angles of all coordinates.
    pub outputs: Vec<String>,
    /// Prove every answer over the rationals, however long it takes.
    pub certify: bool,
    /// Eliminate motions without inertia instead of refusing them.
    pub eliminate_massless: bool,
}

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
    let (prepared, diagnostics) = prepare(source);
    if diagnostics.iter().any(|d| d.severity == Severity::Error) {
        return Err(diagnostics);
    }
    let variant = choose(&prepared.variants, settings.variant.as_deref()).map_err(|problem| vec![problem])?;
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
    let linear = linear_system(&system, &coordinates, &basis, &outputs);
    let mut modes = modes(&system, &reduction(&system, &reduced.coordinates)).unwrap_or_else(|| {
        notes.push("the eigenvalue iteration failed: no modes are listed, the structure is exact all the same".into());
        Vec::new()
    });
    let mut structure = decided(&linear, settings.certify, progress, &variant.name)?;
    failing_modes(&mut structure, &mut modes, &linear, Some(Mechanics { system: &system, basis: &basis }));
    let refused = |error: BasisError| vec![Diagnostic::error("analysis::basis", error.to_string())];
    let (bases, constraint_forces) = if definiteness(&system.inertia_matrix()) == Definiteness::Positive {
        let forces =
            (!system.constraints.is_empty()).then(|| constraint_forces(&system)).transpose().map_err(refused)?;
        (bases(&system, &reduced.coordinates).map_err(refused)?, forces)
    } else {
        notes.push("some shafts have no inertia of their own: orthogonal bases and the projector are left out".into());
        (Vec::new(), None)
    };
    let placement = placement(spec, &system, &basis, &linear, &structure);
    notes.extend(diagnostics.into_iter().map(|warning| warning.message));
    Ok(Analysis {
        name: prepared.name.clone(),
        description: prepared.description.clone(),
        class: Some(class(reduced, &position, &stuck)),
        coordinates: coordinates.iter().map(|&shaft| system.shafts[shaft].clone()).collect(),
        bases,
        constraint_forces,
        modes,
        structure,
        placement,
        notes,
        ..Analysis::default()
    })
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
        let found = asked.iter().map(|name| (name, all.iter().position(|other| other == name)));
        let (known, unknown): (Vec<_>, Vec<_>) = found.partition(|(_, at)| at.is_some());
        for (name, _) in unknown {
            let there = quoted(all.iter().map(String::as_str));
            let help = if there.is_empty() { format!("the file has no {what}") } else { format!("there are {there}") };
            wrong.push(Diagnostic::error("name::unknown", format!("there is no {what} `{name}`")).help(help));
        }
        known.into_iter().filter_map(|(_, at)| at).collect()
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
    let mut structure = decided(&system, settings.certify, progress, "state space")?;
    let mut notes = Vec::new();
    let mut modes = modes_of_pencil(&system.states, &system.e.to_f64(), &system.a.to_f64()).unwrap_or_else(|| {
        notes.push("the eigenvalue iteration failed: no modes are listed, the structure is exact all the same".into());
        Vec::new()
    });
    failing_modes(&mut structure, &mut modes, &system, None);
    Ok(Analysis { name: "state space".into(), modes, structure, notes, ..Analysis::default() })
}

/// The exact structure; with `certify` every answer proven, which may take long and reports how far it is.
fn decided(
    system: &LinearSystem,
    certify: bool,
    progress: &dyn Progress,
    name: &str,
) -> Result<Structure, Vec<Diagnostic>> {
    let report = |fraction: f64| progress.advance(0, name, fraction);
    let found = if certify { certified_structure(system, &report) } else { structure(system) };
    found.map_err(|error| vec![Diagnostic::error("analysis::structure", error.to_string())])
}

/// Ranks the places of `[analysis]` for motors and sensors.
fn placement(
    spec: &AnalysisSpec,
    system: &ConstrainedSystem,
    basis: &Matrix<Rational>,
    linear: &LinearSystem,
    structure: &Structure,
) -> Placement {
    let r = basis.columns();
    let horizon = spec.horizon.to_f64();
    let shaft = |name: &str| system.shafts.iter().position(|shaft| shaft == name).expect("the place was checked");
    let column = |name: &str, begin: usize| {
        let row = shaft(name);
        (0..2 * r)
            .map(|j| if (begin..begin + r).contains(&j) { basis[(row, j - begin)].clone() } else { Rational::ZERO })
            .collect()
    };
    let search = |side: Side, places: Vec<Candidate>, measure: &Measure, unit: &str| {
        let least = if side == Side::Inputs { structure.min_inputs } else { structure.min_outputs };
        let mut found = place(linear, side, &places, least, horizon, measure)?;
        found.unit = unit.into();
        if found.sets.is_empty() {
            found.none_because = Some(why_not(linear, side, &places));
        }
        Some(found)
    };
    // Speeds times the horizon are angles too.
    let scale = |angle: f64, speed: f64| (0..2 * r).map(|k| if k < r { angle } else { speed }).collect::<Vec<_>>();
    let motors: Vec<Candidate> = spec
        .actuators
        .iter()
        .map(|place| Candidate { name: place.shaft.clone(), cost: place.cost, column: column(&place.shaft, r) })
        .collect();
    let (measure, unit) = if spec.motion.is_empty() {
        (Measure::SmallestEigenvalue(scale(1.0, horizon)), "rad^2/(N^2 m^2 s)")
    } else {
        let value = |state: &String| spec.motion.iter().find(|(signal, _)| signal == state).map_or(0.0, |(_, x)| *x);
        (Measure::Energy(linear.states.iter().map(value).collect()), "N^2 m^2 s")
    };
    let inputs = (!motors.is_empty()).then(|| search(Side::Inputs, motors, &measure, unit));
    let sensors: Vec<Candidate> = spec
        .sensors
        .iter()
        .map(|place| {
            let begin = if place.signal.ends_with(".w") { r } else { 0 };
            Candidate { name: place.signal.clone(), cost: place.cost, column: column(&place.shaft, begin) }
        })
        .collect();
    let measure = Measure::SmallestEigenvalue(scale(1.0, horizon.recip()));
    let unit = if spec.sensors.iter().all(|place| place.signal.ends_with(".phi")) { "s" } else { "SI" };
    let outputs = (!sensors.is_empty()).then(|| search(Side::Outputs, sensors, &measure, unit));
    Placement { inputs: inputs.flatten(), outputs: outputs.flatten() }
}

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

fn choose<'a>(variants: &'a [PreparedVariant], name: Option<&str>) -> Result<&'a PreparedVariant, Diagnostic> {
    let Some(name) = name else {
        return variants
            .first()
            .ok_or_else(|| Diagnostic::error("variant::none", "the model has no variant to analyse"));
    };
    variants.iter().find(|variant| variant.name == name).ok_or_else(|| {
        let names: Vec<&str> = variants.iter().map(|variant| variant.name.as_str()).collect();
        let help = match nearest(name, names.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("there are {}", quoted(names.into_iter())),
        };
        Diagnostic::error("variant::unknown", format!("there is no variant `{name}`")).help(help)
    })
}

/// Inputs and outputs: asked for on the command line, in the file, or by default; says which default was taken.
fn signals(
    variant: &PreparedVariant,
    settings: &AnalyzeSettings,
    notes: &mut Vec<String>,
) -> Result<(Vec<String>, Vec<OutputSignal>), Vec<Diagnostic>> {
    let equations = &variant.reduced.equations;
    let spec = &variant.analysis;
    let mut wrong = Vec::new();
    let unknown = |what: &str, name: &str, all: &[String], wrong: &mut Vec<Diagnostic>| {
        let names = || all.iter().map(String::as_str);
        let help = match nearest(name, names()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("there are {}", quoted(names())),
        };
        wrong.push(Diagnostic::error("name::unknown", format!("there is no {what} `{name}`")).help(help));
    };
    let all_inputs: Vec<String> = equations.inputs.iter().map(|input| input.element.clone()).collect();
    let inputs = if !settings.inputs.is_empty() {
        settings.inputs.clone()
    } else if let Some(named) = &spec.inputs {
        named.clone()
    } else {
        let motors = equations.inputs.iter().filter(|input| matches!(input.value, InputKind::Motor(_)));
        let motors: Vec<String> = motors.map(|input| input.element.clone()).collect();
        notes.push(if motors.is_empty() {
            "the model has no motor: nothing is controllable".into()
        } else {
            format!("inputs: all motors ({})", motors.join(", "))
        });
        motors
    };
    for (k, input) in inputs.iter().enumerate() {
        if !all_inputs.contains(input) {
            unknown("motor or disturbance", input, &all_inputs, &mut wrong);
        } else if inputs[..k].contains(input) {
            wrong.push(Diagnostic::error("name::twice", format!("the input `{input}` is named twice")));
        }
    }
    let names = if !settings.outputs.is_empty() {
        settings.outputs.clone()
    } else if let Some(named) = &spec.outputs {
        named.clone()
    } else if !equations.sensors.is_empty() {
        let names: Vec<String> = equations.sensors.iter().map(|(name, _)| name.clone()).collect();
        notes.push(format!("outputs: all sensors ({})", names.join(", ")));
        names
    } else {
        let controlled: BTreeSet<String> = variant
            .model
            .controls
            .iter()
            .flat_map(|control| signals_of(control.law.fields, &control.values))
            .filter(|signal| signal.ends_with(".phi"))
            .collect();
        let names: Vec<String> = if controlled.is_empty() {
            variant.reduced.coordinate_names().iter().map(|shaft| format!("{shaft}.phi")).collect()
        } else {
            controlled.into_iter().collect()
        };
        notes.push(format!("outputs: {}", names.join(", ")));
        names
    };
    let mut outputs = Vec::new();
    for (k, name) in names.iter().enumerate() {
        let shaft =
            |suffix: &str| name.strip_suffix(suffix).filter(|shaft| equations.shafts.iter().any(|s| s == shaft));
        let sensor = equations.sensors.iter().find(|(sensor, _)| sensor == name).map(|(_, s)| s.measured.clone());
        let angle = shaft(".phi").map(|shaft| Measured::Angle(shaft.into()));
        let measured = sensor.or(angle).or(shaft(".w").map(|shaft| Measured::Speed(shaft.into())));
        match measured {
            None => {
                let angles = equations.shafts.iter().map(|shaft| format!("{shaft}.phi"));
                let all: Vec<String> =
                    angles.chain(equations.sensors.iter().map(|(sensor, _)| sensor.clone())).collect();
                unknown("angle, speed or sensor", name, &all, &mut wrong);
            }
            Some(_) if names[..k].contains(name) => {
                wrong.push(Diagnostic::error("name::twice", format!("the output `{name}` is named twice")));
            }
            Some(measured) => outputs.push(OutputSignal { name: name.clone(), measured }),
        }
    }
    if wrong.is_empty() { Ok((inputs, outputs)) } else { Err(wrong) }
}
