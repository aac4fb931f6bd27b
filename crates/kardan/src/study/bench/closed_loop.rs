//! A controller designed on the model, in the simulation and on the bench, and the causes of the differences.

use rayon::prelude::*;

use super::{BenchRun, BenchSettings, prepare_bench, prepare_excluding};
use crate::study::design::designs::DesignSettings;
use crate::study::{PreparedVariant, Progress, Project, Silent};
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::equations::Measured;
use kardan_results::signal_name;
use kardan_results::signal_name::SignalName;
use kardan_results::{ClosedLoop, Compared, Difference, Experiment, Outcome, Physical, Response, Run, TrueValue};
use kardan_schema::diagnostics::Diagnostic;

/// The last fraction of a run, which counts as settled.
const LAST: f64 = 0.1;
/// Duration of a transient in time constants of the slowest pole.
const CONSTANTS: f64 = 10.0;

/// A difference between bench and simulation.
#[derive(Default)]
struct Kind {
    what: String,
    /// True values that belong to it.
    names: Vec<String>,
    /// The controller runs at its sample time.
    sampling: bool,
    /// There is Coulomb friction.
    friction: bool,
}

/// A planned run.
struct Job {
    variant: String,
    /// Its name in the progress display.
    label: String,
    /// Names with the values of the model.
    removed: Vec<String>,
    sampling: bool,
    friction: bool,
    /// Whether the study can omit it.
    optional: bool,
}

/// Runs a controller of a model file in every variant that has it: in continuous time on the model that it is designed on, which has no
/// Coulomb friction, and at its sample time on the plant of the bench; then for each difference between the two once with this one
/// only, and once with all except this one.
///
/// The controller is the one that [`BenchSettings::run`] names, else the first of the file; [`BenchSettings::truth`] should contain the
/// true values, because drawn ones lie around the values of this file. Excitation and repetitions have no effect here.
///
/// ```
/// use kardan::model;
/// use kardan::study;
/// let source = model::builtin("harmonic-drive-bench").unwrap().source.replace("duration = \"5 s\"", "duration = \"1.2 s\"");
/// let found = study::closed_loop(&study::Project::open(source), &study::BenchSettings::default(), &study::Silent).unwrap();
/// // The angle follows on the bench as in the simulation; the torque does not.
/// let [angle, torque] = &found.experiments[0].responses[..] else { panic!("two outputs") };
/// assert!(angle.max_difference < 0.05 && torque.max_deviation.bench > 1.5 * torque.max_deviation.simulation);
/// ```
///
/// # Errors
/// All errors of the file and of the truth; a file without a controller.
pub fn closed_loop(
    project: &Project,
    settings: &BenchSettings,
    progress: &dyn Progress,
) -> Result<ClosedLoop, Vec<Diagnostic>> {
    let control_name = match &settings.run {
        BenchRun::Control(name) => Some(name.as_str()),
        BenchRun::Excitation => None,
    };
    let control = bench_controller(project, control_name, settings.variant.as_deref())?;
    let prepared = project.prepared();
    let settings = BenchSettings { run: BenchRun::Control(control.clone()), ..settings.clone() };
    let first = prepare_bench(project, &settings)?;
    let is_chosen = |variant: &&PreparedVariant| match &settings.variant {
        Some(name) => variant.name == *name,
        None => variant.model.controls.iter().any(|one| one.name == control),
    };
    let variants: Vec<&PreparedVariant> = prepared.all().filter(is_chosen).collect();
    let kinds = kinds(first.truth(), !first.plant().equations.frictions.is_empty());
    let jobs: Vec<Job> = variants.iter().flat_map(|variant| jobs(&variant.name, first.truth(), &kinds)).collect();
    let runs = jobs.par_iter().enumerate().map(|(number, job)| run(project, &settings, number, job, progress));
    let mut runs = runs.collect::<Result<Vec<Option<Run>>, _>>()?.into_iter();
    let design_settings =
        DesignSettings { control: Some(control.clone()), variant: settings.variant.clone(), ..Default::default() };
    let design = project.design(&design_settings, &Silent)?;
    // Motions not visible in the outputs may be slower.
    let poles = design.channels.iter().flat_map(|channel| &channel.poles);
    let slowest = poles.map(|pole| -pole.re).filter(|x| *x > 0.0).fold(f64::INFINITY, f64::min);
    let longest = variants.iter().map(|variant| variant.scenario.duration).fold(0.0, f64::max);
    let transient = if slowest.is_finite() { (CONSTANTS / slowest).min(longest) } else { longest };
    let equations = &first.model().equations;
    let mut experiments = Vec::new();
    for variant in variants {
        let (simulated, measured) = (runs.next().flatten(), runs.next().flatten());
        let variations: Vec<Option<Run>> = runs.by_ref().take(2 * kinds.len()).collect();
        let (Some(simulated), Some(measured)) = (simulated, measured) else { continue };
        let events = &variant.scenario.events;
        let always = !variant.scenario.signals.is_empty();
        let moving =
            |t: f64| always || events.iter().any(|event| (event.at..=event.at + event.over + transient).contains(&t));
        let pair = Pair { equations, simulated: &simulated, measured: &measured, moving: &moving };
        let responses =
            design.channels.iter().filter_map(|one| pair.response(&one.output, &one.reference, &kinds, &variations));
        let responses = responses.collect();
        experiments.push(Experiment { name: variant.name.clone(), responses, simulated, measured });
    }
    let failed = experiments.iter().flat_map(|one| [(&one.simulated, "simulation"), (&one.measured, "bench")]);
    let notes = failed
        .filter_map(|(run, of)| match &run.outcome {
            Outcome::Completed => None,
            Outcome::Unbalanced { cause } => Some(format!("`{}`, {of}: {cause}", run.name)),
            Outcome::Failed { time, cause } => {
                Some(format!("`{}`, {of}: it ends after {time:.3} s, {cause}", run.name))
            }
        })
        .collect();
    Ok(ClosedLoop { design, transient, experiments, notes })
}

/// The controller of a model file (of one of its variants) for its bench: the requested one, otherwise the first.
///
/// ```
/// use kardan::model;
/// use kardan::study;
/// let source = model::builtin("harmonic-drive-bench").unwrap().source;
/// assert_eq!(study::bench_controller(&study::Project::open(source), None, None).unwrap(), "drive");
/// ```
///
/// # Errors
/// Errors of the file; no controller, or none of this name; no such variant.
pub fn bench_controller(
    project: &Project,
    name: Option<&str>,
    variant: Option<&str>,
) -> Result<String, Vec<Diagnostic>> {
    if project.diagnostics().iter().any(Diagnostic::is_error) {
        return Err(project.diagnostics().to_vec());
    }
    let prepared = project.prepared();
    let own = variant.map(|_| prepared.variant(variant)).transpose()?;
    let variants = || prepared.variants.iter().filter(move |one| own.is_none_or(|own| one.name == own.name));
    let first = variants().find_map(|variant| variant.model.controls.first());
    match (name, first) {
        (Some(name), _) => super::with_control(variants(), name).map(|_| name.into()),
        (None, Some(first)) => Ok(first.name.clone()),
        (None, None) => Err(vec![
            Diagnostic::error("control::unknown", "the model has no controller to test on the bench")
                .help("add one, such as `[control.drive]` with `law = \"decoupling\"`"),
        ]),
    }
}

/// The differences of a plant and its controller from the simulation: compliance first, then the effects of the controller, both together.
fn kinds(truth: &[TrueValue], friction: bool) -> Vec<Kind> {
    let mut soft: Vec<Kind> = Vec::new();
    let mut rest: Vec<Kind> = Vec::new();
    if friction {
        rest.push(Kind { what: FRICTION.into(), friction: true, ..Kind::default() });
    }
    for value in truth {
        let (what, compliant) = difference(value);
        let list = if compliant { &mut soft } else { &mut rest };
        match list.iter_mut().find(|group| group.what == what) {
            Some(group) => group.names.push(value.name.clone()),
            None => list.push(Kind { what, names: vec![value.name.clone()], ..Kind::default() }),
        }
    }
    let (lags, rest): (Vec<Kind>, Vec<Kind>) = rest.into_iter().partition(|kind| kind.what == DELAY);
    let lags: Vec<String> = lags.into_iter().flat_map(|kind| kind.names).collect();
    let mut names: Vec<String> = soft.iter().flat_map(|kind| kind.names.clone()).collect();
    let mut out = soft;
    out.push(Kind { what: DELAY.into(), names: lags.clone(), sampling: true, ..Kind::default() });
    if !names.is_empty() {
        names.extend(lags);
        out.push(Kind { what: format!("compliance and {DELAY}"), names, sampling: true, ..Kind::default() });
    }
    out.extend(rest);
    out
}

const FRICTION: &str = "Coulomb friction and stiction";
const DELAY: &str = "delay (sampling, computation, motors, sensors)";

/// The kind of difference of a plant value, and whether that is compliance.
fn difference(value: &TrueValue) -> (String, bool) {
    let (element, key) = signal_name::parameter(&value.name).unwrap_or((&value.name, ""));
    match key {
        "stiffness" | "damping" if value.nominal.is_none() => (format!("compliance of {element}"), true),
        "friction" | "breakaway" | "stribeck_speed" => (FRICTION.into(), false),
        "lag" => (DELAY.into(), false),
        "ripple" | "ripple_order" => ("torque ripple".into(), false),
        _ if value.nominal.is_some() => ("errors of the values in the model".into(), false),
        _ => (value.name.clone(), false),
    }
}

/// The simulation, the bench, then for each difference the simulation with only this one and the bench without it.
fn jobs(variant: &str, truth: &[TrueValue], kinds: &[Kind]) -> Vec<Job> {
    let all: Vec<String> = truth.iter().map(|value| value.name.clone()).collect();
    let job = |label: String, removed: Vec<String>, sampling, friction, optional| Job {
        variant: variant.into(),
        label,
        removed,
        sampling,
        friction,
        optional,
    };
    let mut out = vec![
        job(format!("{variant}, simulation"), all.clone(), false, false, false),
        job(format!("{variant}, bench"), Vec::new(), true, true, false),
    ];
    for Kind { what, names, sampling, friction } in kinds {
        let excluded_values = all.iter().filter(|name| !names.contains(name)).cloned().collect();
        out.push(job(format!("{variant}, {what} alone"), excluded_values, *sampling, *friction, true));
        out.push(job(format!("{variant}, without {what}"), names.clone(), !*sampling, !*friction, true));
    }
    out
}

fn run(
    project: &Project,
    settings: &BenchSettings,
    number: usize,
    job: &Job,
    progress: &dyn Progress,
) -> Result<Option<Run>, Vec<Diagnostic>> {
    let settings = BenchSettings { variant: Some(job.variant.clone()), ..settings.clone() };
    let mut bench = match prepare_excluding(project, &settings, &job.removed) {
        Ok(bench) => bench,
        // Some values may not form a valid plant without others.
        Err(_) if job.optional => return Ok(None),
        Err(diagnostics) => return Err(diagnostics),
    };
    bench.continuous = !job.sampling;
    if !job.friction {
        bench.plant.equations.frictions.clear();
    }
    let mut run = bench.shown_log(0, number, &job.label, progress);
    run.name.clone_from(&job.variant);
    Ok(Some(run))
}

/// The signal that shows an output without the noise of a sensor.
fn shown(equations: &Equations, output: &str) -> String {
    let sensor = equations.sensors.iter().find(|(name, _)| name == SignalName::new(output).element);
    match sensor.map(|(name, sensor)| (name, &sensor.measured)) {
        None | Some((_, Measured::Signal(_))) => output.into(),
        Some((_, measured @ (Measured::Angle(of) | Measured::Speed(of) | Measured::SpringTorque(of)))) => {
            equations.reading(measured).of(of)
        }
        Some((_, Measured::ConstraintTorque(element, shaft) | Measured::ComplianceTorque(element, shaft))) => {
            format!("{element}.{}", equations.reading(&Measured::NetTorque(shaft.clone())).of(shaft))
        }
        Some((name, measured @ Measured::NetTorque(_))) => equations.reading(measured).of(name),
    }
}

/// Two runs of one scenario, and the times at which something moves in it.
struct Pair<'a> {
    equations: &'a Equations,
    simulated: &'a Run,
    measured: &'a Run,
    moving: &'a dyn Fn(f64) -> bool,
}

impl Pair<'_> {
    /// Largest distance of a signal of two runs in the transient, and when, s.
    fn apart(&self, one: &[f64], two: &[f64]) -> (f64, f64) {
        let both = one.iter().zip(two).zip(&self.simulated.series.time).filter(|(_, t)| (self.moving)(**t));
        let distances = both.map(|((a, b), t)| ((a - b).abs(), *t));
        distances.fold((0.0, 0.0), |most: (f64, f64), now| if now.0 > most.0 { now } else { most })
    }

    fn response(&self, output: &str, reference: &str, kinds: &[Kind], variations: &[Option<Run>]) -> Option<Response> {
        let signal = shown(self.equations, output);
        let of = |run: &Run| run.series.signal(&signal).map(|found| found.values.clone());
        let (one, two) = (of(self.simulated)?, of(self.measured)?);
        let desired = self.simulated.series.signal(reference).map(|found| found.values.clone()).unwrap_or_default();
        let settled = |values: &[f64], run: &Run| {
            let time = &run.series.time;
            let begin = (1.0 - LAST) * time.last().copied().unwrap_or(0.0);
            let late = time.iter().zip(values).filter(|(t, _)| **t >= begin).map(|(_, x)| *x);
            let (sum, count) = late.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
            sum / count
        };
        let left = |run: &Option<Run>| -> Option<f64> {
            let whole = run.as_ref().filter(|run| run.outcome == Outcome::Completed);
            whole.and_then(of).map(|values| self.apart(&one, &values).0)
        };
        let differences = kinds.iter().zip(variations.chunks_exact(2)).map(|(kind, runs)| Difference {
            source: kind.what.clone(),
            added_to_simulation: left(&runs[0]),
            removed_from_bench: left(&runs[1]),
        });
        let (distance, distance_at) = self.apart(&one, &two);
        Some(Response {
            output: output.into(),
            reference: reference.into(),
            physical: self.simulated.series.signal(&signal).map_or(Physical::Angle, |found| found.physical),
            steady_state: Compared { simulation: settled(&one, self.simulated), bench: settled(&two, self.measured) },
            max_deviation: Compared { simulation: self.apart(&one, &desired).0, bench: self.apart(&two, &desired).0 },
            max_difference: distance,
            distance_at,
            differences: differences.collect(),
            signal,
        })
    }
}
