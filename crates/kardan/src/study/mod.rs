//! What a model file asks for: checked, designed, run for every variant, judged.

mod analysis;
mod analyze;
mod asked;
mod bench;
mod checks;
mod circuit;
mod coupling;
mod design;
mod effort;
mod equations;
mod explore;
mod faults;
mod identification;
mod margins;
mod massless;
mod passage;
mod prepare;
mod project;
mod proof;
mod read;
mod robustness;
mod scenario;
mod sensitivity;
mod strain;

pub use analysis::{AnalysisSpec, Site};
pub use analyze::{AnalyzeSettings, analyze, analyze_state_space};
pub use bench::{
    BenchRun, BenchSettings, PreparedBench, bench, bench_controller, closed_loop, given_truth, prepare_bench,
    read_truth,
};
pub use design::{DesignSettings, design};
pub use effort::{Effort, MANY_STEPS, expected_effort};
pub use equations::{EquationsForm, equations};
pub use identification::{IdentifySettings, LogFile, identify, written};
pub use prepare::{Prepared, PreparedVariant, check, prepare};
pub use project::Project;
pub use robustness::ToleranceBox;

use std::sync::Arc;

use analyze::analyze_variant;
use design::designed;
use rayon::prelude::*;

use crate::diagnostics::{Diagnostic, Severity, nearest};
use crate::equations::Domain;
use crate::model::tables::Measure;
use crate::num::Matrix;
use crate::reduce::{Reduced, linearise};
use crate::results::{
    Analysis, Design, Identification, LawSummary, ModelSummary, MotorStrain, NamedMatrix, Outcome, Plot,
    RequirementResult, Run, Series, Study,
};
use crate::simulate::{Setup, Tolerance, signal_names, simulate};
use crate::synthesis::closed_loop_poles;

/// Hears how far the runs are, and may end them. Called from several threads.
pub trait Progress: Sync {
    /// The fraction done of a variant, from 0 to 1.
    fn advance(&self, variant: usize, name: &str, fraction: f64);

    /// Why everything is to end now; `None`: it goes on. Asked often by all that takes long and keeps what it has: runs end
    /// with [`Outcome::Failed`] and this cause, trials of a design are left out and say so.
    fn stop(&self) -> Option<String> {
        None
    }

    /// Something is finished that is worth to be shown should nothing more come; it takes the place of what was kept before. Told
    /// between parts that cannot be ended in their middle, such as proofs and eigenvalues. `part` makes a copy.
    fn keep(&self, _part: &dyn Fn() -> Part) {}

    /// What was kept is not needed any more: all is done.
    fn release(&self) {}

    /// Steps of the integrator that one run may take.
    fn most_steps(&self) -> usize {
        Tolerance::default().most_steps
    }
}

/// What is finished of a command; what it has not come to is named in it (`unfinished`, of a study in its warnings).
#[derive(Debug, Clone)]
pub enum Part {
    /// Of [`run`]: all runs.
    Study(Arc<Study>),
    /// Of [`analyze`] and [`analyze_state_space`].
    Analysis(Box<Analysis>),
    /// Of [`design()`].
    Design(Box<Design>),
    /// Of [`identify`].
    Identification(Box<Identification>),
}

/// Hears nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn advance(&self, _: usize, _: &str, _: f64) {}
}

/// How a study is run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settings {
    /// Names of the variants to run; empty: all.
    pub variants: Vec<String>,
    /// Whether controllers run that are unstable at their sample time.
    pub force: bool,
}

/// Runs the study of a model file: every variant through the scenario, in parallel.
///
/// ```
/// use kardan::{model, study};
/// let source = model::builtin("two-bodies").unwrap().source;
/// let result = study::run(source, &study::Settings::default(), &study::Silent).unwrap();
/// let run = &result.runs[0];
/// // Work done by the motor is stored or dissipated; what is left over certifies the integration.
/// assert!(run.energy.residual.abs() < 1e-9 * run.energy.input);
/// assert!(run.series.signal("body_2.phi").unwrap().values.last().unwrap() > &3.9);
/// ```
///
/// A run that fails numerically is part of the result ([`Outcome::Failed`]) with everything computed so far.
///
/// # Errors
/// All mistakes of the file, if there are any (warnings alone do not count).
pub fn run(source: &str, settings: &Settings, progress: &dyn Progress) -> Result<Study, Vec<Diagnostic>> {
    Project::open(source).run(settings, progress)
}

/// [`run`] of what is prepared, with what is known of its mistakes.
fn run_prepared(
    prepared: &Prepared,
    mut diagnostics: Vec<Diagnostic>,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Study, Vec<Diagnostic>> {
    if settings.force {
        overrule(&mut diagnostics);
    }
    let known: Vec<&str> = prepared.variants.iter().map(|variant| variant.name.as_str()).collect();
    for name in &settings.variants {
        if !known.contains(&name.as_str()) && !known.is_empty() {
            let help = match nearest(name, known.iter().copied()) {
                Some(near) => format!("did you mean `{near}`? There are {}", known.join(", ")),
                None => format!("there are {}", known.join(", ")),
            };
            diagnostics.push(Diagnostic::error("variant::unknown", format!("there is no variant `{name}`")).help(help));
        }
    }
    if diagnostics.iter().any(|d| d.severity == Severity::Error) {
        return Err(diagnostics);
    }
    let chosen: Vec<&PreparedVariant> = prepared
        .all()
        .filter(|variant| settings.variants.is_empty() || settings.variants.contains(&variant.name))
        .collect();
    let mut warnings: Vec<String> = diagnostics.iter().map(ToString::to_string).collect();
    // From here on the runs are kept, whatever becomes of the rest.
    let ran = || {
        let runs: Vec<Run> =
            chosen.par_iter().enumerate().map(|(k, variant)| run_variant(k, variant, prepared, progress)).collect();
        let study = Arc::new(Study {
            model: prepared.variants.first().map(|variant| summarise(prepared, variant)).unwrap_or_default(),
            runs,
            plots: chosen_plots(prepared, &settings.variants),
            warnings: [&warnings[..], &["structure and designs of the report are missing".into()]].concat(),
            ..Study::default()
        });
        progress.keep(&|| Part::Study(Arc::clone(&study)));
        study
    };
    // Each controller as in the first variant that uses it.
    let mut own: Vec<(&PreparedVariant, usize)> = Vec::new();
    let name = |variant: &PreparedVariant, number: usize| variant.model.controls[number].name.clone();
    for variant in &chosen {
        for number in 0..variant.model.controls.len() {
            if own.iter().all(|(other, k)| name(other, *k) != name(variant, number)) {
                own.push((variant, number));
            }
        }
    }
    // Of a study that ends early the runs are written, nothing more is computed.
    let design = |(variant, number): &(&PreparedVariant, usize)| {
        let goes_on = progress.stop().is_none();
        goes_on.then(|| designed(&prepared.description, variant, *number, &DesignSettings::default(), &Silent))
    };
    let (study, (analysis, designs)) = rayon::join(ran, || {
        rayon::join(
            || chosen.first().map(|variant| structure_of(prepared, variant)).transpose(),
            || own.par_iter().map(design).collect::<Vec<_>>(),
        )
    });
    let runs = &study.runs;
    let mut designs: Vec<Design> = designs.into_iter().flatten().collect();
    for design in &mut designs {
        for (variant, run) in chosen.iter().zip(runs) {
            if variant.model.controls.iter().any(|control| control.name == design.controller) {
                strain::tell(design, &run.name, run.length(), &run.strains);
            }
        }
        strain::warn(design);
    }
    if let Some(why) = progress.stop() {
        warnings.push(format!("{why}: what was not computed by then is left out"));
    }
    let analysis = analysis.unwrap_or_else(|why| {
        warnings.push(why);
        None
    });
    progress.release();
    Ok(Study { warnings, analysis, designs, ..Arc::unwrap_or_clone(study) })
}

/// What stands in the way of a run only for its user's good becomes a warning.
pub fn overrule(diagnostics: &mut [Diagnostic]) {
    for diagnostic in diagnostics.iter_mut().filter(|diagnostic| margins::FORCED.contains(&diagnostic.code)) {
        diagnostic.severity = Severity::Warning;
    }
}

/// Beyond this number of states a run does not wait for the analysis of its structure.
const MOST_STATES: usize = 24;

/// The structure of a variant beside its run: nothing that could stop or delay the run. `Err`: a warning.
fn structure_of(prepared: &Prepared, variant: &PreparedVariant) -> Result<Analysis, String> {
    let states = 2 * variant.reduced.degrees_of_freedom();
    if states > MOST_STATES {
        return Err(format!("the structure of {states} states is not analysed in a run; `kardan analyze` does"));
    }
    let mut found = analyze_variant(prepared, variant, &AnalyzeSettings::default(), &Silent);
    if let (Ok(analysis), false) = (&mut found, variant.model.tolerances.is_empty()) {
        analysis.notes.push("what the tolerances allow, the nearest loss among it: `kardan analyze`".into());
    }
    found.map_err(|why| {
        let why: Vec<String> = why.iter().map(|mistake| mistake.message.clone()).collect();
        format!("the structure of the model is not analysed: {}", why.join("; "))
    })
}

/// For a file that asks for no plot: angles and speeds of the coordinates, torques of the motors; of circuits charges,
/// currents and voltages.
fn default_plots(variant: &PreparedVariant) -> Vec<Plot> {
    let names = variant.reduced.coordinate_names();
    let columns = signal_names(&variant.reduced, &variant.scenario);
    let columns: Vec<String> = columns.into_iter().map(|(name, _)| name).collect();
    // Of an angle there is no charge, and the other way round.
    let coordinates = |suffix: &str| {
        names.iter().map(|name| format!("{name}.{suffix}")).filter(|name| columns.contains(name)).collect::<Vec<_>>()
    };
    let inputs = |suffix: &str| {
        let inputs: Vec<_> =
            variant.reduced.equations.inputs.iter().map(|input| format!("{}.{suffix}", input.element)).collect();
        columns.iter().filter(|name| inputs.contains(name)).cloned().collect()
    };
    let plot = |id: &str, title: &str, signals: Vec<String>| Plot {
        id: id.into(),
        title: title.into(),
        signals,
        ..Plot::default()
    };
    [
        plot("angles", "Angles of the coordinates", coordinates("phi")),
        plot("speeds", "Speeds of the coordinates", coordinates("w")),
        plot("torques", "Motor torques", inputs("tau")),
        plot("charges", "Charges of the coordinates", coordinates("q")),
        plot("currents", "Currents of the coordinates", coordinates("i")),
        plot("voltages", "Source voltages", inputs("v")),
    ]
    .into_iter()
    .filter(|plot| !plot.signals.is_empty())
    .collect()
}

/// The plots that show one of the variants chosen.
fn chosen_plots(prepared: &Prepared, chosen: &[String]) -> Vec<Plot> {
    let mut plots = prepared.plots.clone();
    if let (true, Some(variant)) = (plots.is_empty(), prepared.variants.first()) {
        plots = default_plots(variant);
    }
    if !chosen.is_empty() {
        // An empty list stands for all variants, a list that becomes empty does not.
        plots.retain_mut(|plot| {
            let all = plot.variants.is_empty();
            plot.variants.retain(|name| chosen.contains(name));
            all || !plot.variants.is_empty()
        });
    }
    plots
}

fn run_variant(number: usize, variant: &PreparedVariant, prepared: &Prepared, progress: &dyn Progress) -> Run {
    progress.advance(number, &variant.name, 0.0);
    let setup = Setup { reduced: &variant.reduced, laws: &variant.running, scenario: &variant.scenario };
    let tolerance = Tolerance { most_steps: progress.most_steps(), ..prepared.tolerance };
    let result = simulate(setup, tolerance, &mut |fraction| {
        progress.advance(number, &variant.name, fraction);
        progress.stop()
    });
    progress.advance(number, &variant.name, 1.0);
    let completed = result.outcome == Outcome::Completed;
    let requirements = prepared
        .requirements
        .iter()
        .filter(|requirement| requirement.variants.is_empty() || requirement.variants.contains(&variant.name))
        .map(|requirement| judge(requirement, &result.series, &result.strains, completed))
        .collect();
    Run {
        name: variant.name.clone(),
        parameters: variant.model.parameters.clone(),
        series: result.series,
        energy: result.energy,
        events: result.events,
        outcome: result.outcome,
        requirements,
        notes: result.notes,
        strains: result.strains,
        effort: result.effort,
    }
}

/// A bound on a signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    /// Signal.
    pub signal: String,
    /// What is measured of it.
    pub measure: Measure,
    /// Bound from above, SI.
    pub below: Option<f64>,
    /// Bound from below, SI.
    pub above: Option<f64>,
    /// Window, s.
    pub from: f64,
    /// Window, s.
    pub until: f64,
    /// Variants that it applies to; empty: all.
    pub variants: Vec<String>,
}

fn judge(requirement: &Requirement, series: &Series, strains: &[MotorStrain], completed: bool) -> RequirementResult {
    let Requirement { signal, measure, below, above, from, until, .. } = requirement;
    let found = series.signal(signal);
    let unit = match measure {
        Measure::TimeAtLimit => "s".to_string(),
        _ => found.map_or("", |signal| signal.physical.unit()).to_string(),
    };
    let values = found.map(|signal| signal.values.as_slice()).unwrap_or_default();
    let rows = series.time.iter().zip(values).filter(|(time, _)| (*from..=*until).contains(*time));
    let (times, window): (Vec<f64>, Vec<f64>) = rows.map(|(time, value)| (*time, *value)).unzip();
    let measured = match measure {
        _ if window.is_empty() => None,
        Measure::Max => Some(window.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        Measure::Min => Some(window.iter().copied().fold(f64::INFINITY, f64::min)),
        Measure::MaxAbs => Some(window.iter().fold(0.0, |max: f64, x| max.max(x.abs()))),
        Measure::TimeAtLimit => {
            let strain = strains.iter().find(|strain| motor_of(signal) == Some(strain.motor.as_str()));
            strain.map(|strain| strain.seconds_at_limit(*from, *until))
        }
        Measure::Rms => Some(root_mean_square(&times, &window, 0.0)),
        Measure::Ripple => Some(root_mean_square(&times, &window, mean(&times, &window))),
        Measure::Final => window.last().copied(),
    };
    // A run that ended inside the window cannot pass: nobody knows what would have come.
    let complete = completed || series.time.last().is_some_and(|last| last >= until);
    let passed = complete
        && below.is_none_or(|bound| measured.is_some_and(|measured| measured < bound))
        && above.is_none_or(|bound| measured.is_some_and(|measured| measured > bound));
    let name = match measure {
        Measure::MaxAbs => format!("max |{signal}|"),
        Measure::TimeAtLimit => format!("time of {} at its torque limit", motor_of(signal).unwrap_or(signal)),
        _ => format!("{} {signal}", measure.word()),
    };
    let window = if *from > 0.0 || until.is_finite() {
        let end = if until.is_finite() { format!("{until} s") } else { "the end".to_string() };
        format!(" from {from} s to {end}")
    } else {
        String::new()
    };
    let text = match (above, below) {
        (Some(above), Some(below)) => format!("{above} < {name}{window} < {below} {unit}"),
        (Some(above), None) => format!("{name}{window} > {above} {unit}"),
        (None, Some(below)) => format!("{name}{window} < {below} {unit}"),
        (None, None) => format!("{name}{window}"),
    };
    RequirementResult { text, measured, unit, passed }
}

/// The motor of which a signal is the torque.
fn motor_of(signal: &str) -> Option<&str> {
    signal.strip_suffix(".tau").or_else(|| signal.strip_suffix(".command"))
}

/// The mean over the time of values that lie on straight lines between the rows; of one row its value.
fn mean(times: &[f64], values: &[f64]) -> f64 {
    let length = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
    if length <= 0.0 {
        return values.iter().sum::<f64>() / values.len() as f64;
    }
    let pieces = times.windows(2).zip(values.windows(2));
    pieces.map(|(t, x)| 0.5 * (x[0] + x[1]) * (t[1] - t[0])).sum::<f64>() / length
}

/// The root of the mean over the time of `(x − around)²`; rows may lie closer to each other where something happens.
fn root_mean_square(times: &[f64], values: &[f64], around: f64) -> f64 {
    let squares: Vec<f64> = values.iter().map(|x| (x - around).powi(2)).collect();
    mean(times, &squares).sqrt()
}

/// Name and unit of the reduced inertia, damping and stiffness matrix.
fn matrix_words(reduced: &Reduced) -> [(&'static str, &'static str); 3] {
    let has = |domain| reduced.coordinates.iter().any(|&k| reduced.equations.domain(k) == domain);
    match (has(Domain::Rotation), has(Domain::Charge)) {
        (_, false) => [("inertia", "kg m^2"), ("damping", "N m s/rad"), ("stiffness", "N m/rad")],
        (false, true) => [("inductance", "H"), ("resistance", "Ohm"), ("elastance", "1/F")],
        (true, true) => [
            ("inertia and inductance", "kg m^2, H"),
            ("damping and resistance", "N m s/rad, Ohm"),
            ("stiffness and elastance", "N m/rad, 1/F"),
        ],
    }
}

fn summarise(prepared: &Prepared, variant: &PreparedVariant) -> ModelSummary {
    let linear = linearise(&variant.reduced, &variant.scenario.position);
    let laws = &variant.designed;
    let [inertia, damping, stiffness] = matrix_words(&variant.reduced);
    let matrix = |title: &str, unit: &str, columns: &[String], values: &Matrix<_>| NamedMatrix {
        title: title.into(),
        unit: unit.into(),
        rows: linear.coordinates.clone(),
        columns: columns.to_vec(),
        values: values.to_rows(),
    };
    ModelSummary {
        name: prepared.name.clone(),
        description: prepared.description.clone(),
        elements: variant.model.elements.clone(),
        coordinates: linear.coordinates.clone(),
        matrices: vec![
            matrix(&format!("reduced {}", inertia.0), inertia.1, &linear.coordinates, &linear.inertia),
            matrix(&format!("reduced {}", damping.0), damping.1, &linear.coordinates, &linear.damping),
            matrix(&format!("reduced {}", stiffness.0), stiffness.1, &linear.coordinates, &linear.stiffness),
            matrix("input map", "", &linear.inputs, &linear.input),
        ],
        laws: laws.iter().map(|law| law.describe().summary()).collect::<Vec<LawSummary>>(),
        closed_loop_poles: closed_loop_poles(&linear, laws).unwrap_or_default(),
    }
}
