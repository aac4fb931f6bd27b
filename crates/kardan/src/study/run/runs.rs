//! A study: every variant run through the scenario and judged, with structure and designs.

use std::borrow::Cow;
use std::sync::Arc;

use rayon::prelude::*;

use crate::study::analyze::structure::analyze_variant;
use crate::study::check::extrapolation_warnings::{broken_rules, extrapolation_warnings};
use crate::study::check::multiplier_constraints::frozen_variant;
use crate::study::check::quantisation_ambiguity::UndecidedReadings;
use crate::study::check::redundant_torques::redundancy_notes;
use crate::study::check::vehicle_validity::vehicle_warnings;
use crate::study::design::actuator_usage;
use crate::study::design::designs::designed;
use crate::study::measure::figure::figures_of;
use crate::study::measure::requirement_verdict::{Judged, Ran, in_digits, judge};
use crate::study::measure::selected_variants::selects;
use crate::study::measure::spectrum::spectra;
use crate::study::progress::run_with_progress;
use crate::study::read::variant_diagnostics::without_errors;
use crate::study::run::accuracy;
use crate::study::run::model_summary::summarise;
use crate::study::{
    AnalyzeSettings, DesignSettings, Part, Prepared, PreparedVariant, Progress, Project, Silent, overrule,
};
use kardan_mechanics::equations::Domain;
use kardan_results::signal_name::Quantity;
use kardan_results::{Accuracy, Analysis, Design, Outcome, Plot, PlottedReference, Run, Study, SweepRow};
use kardan_schema::diagnostics::{Diagnostic, nearest};
use kardan_simulate::{
    EncoderReading, Faults, FlippedReading, Method, Ready, RunResult, Scenario, Setup, Tolerance, signal_names,
};

/// Note of a study that ends with its runs.
const MISSING: &str = "structure and designs of the report are missing";

/// Settings of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settings {
    /// Names of the variants to run; empty: all.
    pub variants: Vec<String>,
    /// Names of `[fault.NAME]` that occur in all of them, besides those that occur anyway.
    pub faults: Vec<String>,
    /// Whether controllers run that are unstable at their sample time.
    pub force: bool,
    /// Whether only the runs are requested, without the structure of the model, the designs of its controllers and the estimate of
    /// errors.
    /// For many runs in a row: margins and bounds of a design take longer than a run.
    pub runs_only: bool,
    /// The integration method.
    pub method: Method,
    /// Relative error per step, in place of that of the file.
    pub tolerance: Option<f64>,
}

/// Runs the study of a model file: every variant through the scenario, in parallel.
///
/// ```
/// use kardan::model;
/// use kardan::study;
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
/// All errors of the file, if there are any (warnings alone do not count).
pub fn run(source: &str, settings: &Settings, progress: &dyn Progress) -> Result<Study, Vec<Diagnostic>> {
    Project::open(source).run(settings, progress)
}

impl Project {
    /// Runs every variant through the scenario, in parallel; see [`run`].
    ///
    /// # Errors
    /// All errors, if there are any (warnings alone do not count).
    pub fn run(&self, settings: &Settings, progress: &dyn Progress) -> Result<Study, Vec<Diagnostic>> {
        let (prepared, mut diagnostics) = (self.prepared(), self.diagnostics().to_vec());
        if settings.force {
            overrule(&mut diagnostics);
        }
        check_variants(prepared, &settings.variants, &mut diagnostics);
        let is_chosen = |variant: &&PreparedVariant| selects(&settings.variants, &variant.name);
        let chosen: Vec<&PreparedVariant> = prepared.all().filter(is_chosen).collect();
        // Errors of the requested faults are reported once, though several variants have them.
        diagnostics.extend(chosen.iter().find_map(|variant| variant.failing(&settings.faults).err()));
        without_errors(&diagnostics)?;
        let mut warnings: Vec<String> = diagnostics.iter().map(ToString::to_string).collect();
        let ran = || run_all(prepared, &chosen, settings, &warnings, progress);
        let beside = || {
            if settings.runs_only {
                return (Ok(None), Vec::new());
            }
            rayon::join(
                || chosen.first().map(|variant| structure_of(prepared, variant)).transpose(),
                || designs_of(prepared, &chosen, progress),
            )
        };
        // At a looser tolerance: these estimate the accuracy of the others.
        let seconds = || -> Vec<RunResult> {
            let compared = if settings.runs_only { &chosen[..0] } else { &chosen[..] };
            compared.par_iter().map(|variant| again(variant, &[], (prepared, settings), progress)).collect()
        };
        let (((study, encoder_readings), seconds), (analysis, mut designs)) =
            rayon::join(|| rayon::join(ran, seconds), beside);
        designs.iter_mut().for_each(|design| add_run_usage(design, &chosen, &study.runs));
        if let Some(why) = progress.stop() {
            warnings.push(format!("{why}: results not computed by then are missing"));
        }
        let analysis = analysis.unwrap_or_else(|why| {
            warnings.push(why);
            None
        });
        progress.release();
        let mut study = Study { warnings, analysis, designs, ..Arc::unwrap_or_clone(study) };
        let compared = study.runs.par_iter_mut().zip(&encoder_readings).zip(&seconds).zip(&chosen);
        compared.for_each(|(((run, encoder_readings), second), variant)| {
            run.accuracy = accuracy_of(run, encoder_readings, second, variant, (prepared, settings), progress);
            if progress.stop().is_none() {
                run.warnings.extend(accuracy::accuracy_warnings(run, &second.run));
                judge_between_rows(run, &second.run, variant, prepared);
            }
        });
        Ok(study)
    }
}

/// The errors of names that no variant has.
pub(in crate::study) fn check_variants(prepared: &Prepared, names: &[String], out: &mut Vec<Diagnostic>) {
    let variant_names: Vec<&str> = prepared.all().map(|variant| variant.name.as_str()).collect();
    for name in names.iter().filter(|name| !variant_names.contains(&name.as_str()) && !variant_names.is_empty()) {
        let help = match nearest(name, variant_names.iter().copied()) {
            Some(near) => format!("did you mean `{near}`? There are {}", variant_names.join(", ")),
            None => format!("there are {}", variant_names.join(", ")),
        };
        out.push(Diagnostic::error("variant::unknown", format!("there is no variant `{name}`")).help(help));
    }
}

/// The runs; they remain valid, whatever happens to the rest.
fn run_all(
    prepared: &Prepared,
    chosen: &[&PreparedVariant],
    settings: &Settings,
    warnings: &[String],
    progress: &dyn Progress,
) -> (Arc<Study>, Vec<Vec<EncoderReading>>) {
    let runs = chosen.par_iter().enumerate();
    let noting = !settings.runs_only;
    let runs = runs.map(|(k, variant)| run_variant(k, variant, (prepared, settings), progress, noting));
    let (runs, encoder_readings): (Vec<Run>, Vec<Vec<EncoderReading>>) = runs.unzip();
    let plots = chosen_plots(prepared, &settings.variants);
    let spectra = plots.iter().filter(|plot| plot.spectrum).flat_map(|plot| spectra(plot, &runs)).collect();
    let study = Arc::new(Study {
        model: prepared.variants.first().map(|variant| summarise(prepared, variant)).unwrap_or_default(),
        runs,
        named: prepared.named || chosen.windows(2).any(|pair| acting(pair[0]) != acting(pair[1])),
        plots,
        spectra,
        warnings: if settings.runs_only { warnings.to_vec() } else { [warnings, &[MISSING.into()]].concat() },
        ..Study::default()
    });
    progress.store_partial(&|| Part::Study(Arc::clone(&study)));
    (study, encoder_readings)
}

/// The active controllers and faults of a variant, besides its parameters.
fn acting(variant: &PreparedVariant) -> (Vec<&str>, &Faults) {
    (variant.model.controls.iter().map(|control| control.name.as_str()).collect(), &variant.scenario.faults)
}

/// A variant at a looser tolerance and with other rounding; some readings have other values.
fn again(
    variant: &PreparedVariant,
    flipped: &[FlippedReading],
    (prepared, settings): (&Prepared, &Settings),
    progress: &dyn Progress,
) -> RunResult {
    let tolerance = accuracy::looser(tolerance(prepared, settings, progress));
    let scenario = scenario_of(variant, settings);
    let ready = Ready::new(setup(variant, &scenario), tolerance).turning(flipped).shaken();
    let ready = if flipped.is_empty() && !prepared.requirements.is_empty() { ready.between_rows() } else { ready };
    ready.run(&mut |_| progress.stop())
}

/// The estimated error of a run, from the readings of its sensors, and from a second run.
fn accuracy_of(
    run: &Run,
    encoder_readings: &[EncoderReading],
    second: &RunResult,
    variant: &PreparedVariant,
    (prepared, settings): (&Prepared, &Settings),
    progress: &dyn Progress,
) -> Option<Accuracy> {
    let equations = &variant.reduced.equations;
    let sensors = equations.sensors.iter();
    let readings: Vec<String> = sensors.map(|(name, sensor)| equations.reading(&sensor.measured).of(name)).collect();
    let undecided = UndecidedReadings::new(encoder_readings, &second.encoder_readings);
    let third =
        undecided.needs_third(run.length()).then(|| again(variant, &undecided.flipped, (prepared, settings), progress));
    let tolerance = tolerance(prepared, settings, progress);
    accuracy::estimate(run, (second, third.as_ref()), undecided.first, tolerance, &readings)
}

/// Measures that differ by a smaller part, of themselves or of their bounds, are the same but for errors of integration.
const SAME_MEASURE: f64 = 1e-6;
/// Other extremes are noted from this part on.
const NOTED_EXTREME: f64 = 0.1;

fn in_6_digits(value: f64) -> String {
    in_digits(format!("{value:.5e}").parse().unwrap_or(value))
}

/// Compares the verdicts on a run with those on a second one that has rows between its rows: an extreme that is beyond its bound between rows fails, and
/// other verdicts that differ are reported.
fn judge_between_rows(run: &mut Run, second: &Run, variant: &PreparedVariant, prepared: &Prepared) {
    let is_comparable = |run: &Run| run.outcome == Outcome::Completed;
    if prepared.requirements.is_empty() || variant.swept.is_some() || !is_comparable(run) || !is_comparable(second) {
        return;
    }
    let finer = judged(variant, prepared, second.clone()).requirements;
    let specs = prepared.requirements.iter().filter(|requirement| selects(&requirement.variants, &variant.name));
    for ((own, finer), spec) in run.requirements.iter_mut().zip(finer).zip(specs) {
        let (Some(value), Some(other)) = (own.measured, finer.measured) else { continue };
        let bounds = [spec.below, spec.above].into_iter().flatten();
        let size = bounds.fold(value.abs().max(other.abs()), |size, bound| size.max(bound.abs()));
        let apart = (other - value).abs() / size;
        let shown = |value: f64| own.display.as_ref().map_or(value, |display| display.of(value));
        let unit = own.display.as_ref().map_or(own.unit.as_str(), |display| display.unit.as_str());
        let [rows, between] =
            [value, other].map(|value| format!("{} {unit}", in_6_digits(shown(value))).trim_end().to_string());
        let text = own.text.clone();
        match (own.passed, finer.passed) {
            (true, false) if spec.is_extreme() && apart > SAME_MEASURE => {
                (own.measured, own.passed) = (Some(other), false);
                run.warnings.push(format!(
                    "`{text}` is not met between the rows: they show {rows}, and a second run with more rows {between}. A smaller `output_step` \
                     shows it in the table"
                ));
            }
            (passed, again) if passed != again && apart > SAME_MEASURE => run.warnings.push(format!(
                "`{text}` is not decided: the rows of the run give {rows}, and a second run with more rows {between}. A smaller `output_step` \
                 decides it"
            )),
            _ if spec.is_extreme() && apart > NOTED_EXTREME => {
                run.notes.push(format!("`{text}`: the rows of the run show {rows}, and a second run with more rows {between}."));
            }
            _ => {}
        }
    }
}

/// The scenario of a variant, with the requested faults.
fn scenario_of<'v>(variant: &'v PreparedVariant, settings: &Settings) -> Cow<'v, Scenario> {
    // Their errors have been reported.
    match settings.faults[..] {
        [] => Cow::Borrowed(&variant.scenario),
        _ => variant.failing(&settings.faults).map_or(Cow::Borrowed(&variant.scenario), Cow::Owned),
    }
}

fn setup<'s>(variant: &'s PreparedVariant, scenario: &'s Scenario) -> Setup<'s> {
    Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario }
}

pub(in crate::study) fn tolerance(prepared: &Prepared, settings: &Settings, progress: &dyn Progress) -> Tolerance {
    let base = settings.tolerance.map_or(prepared.tolerance, Tolerance::relative);
    Tolerance { most_steps: progress.most_steps(), method: settings.method, ..base }
}

/// The design of each controller, as in the first variant that uses it. Of a study that ends early the runs are written, and
/// nothing more is designed.
fn designs_of(prepared: &Prepared, chosen: &[&PreparedVariant], progress: &dyn Progress) -> Vec<Design> {
    let mut own: Vec<(&PreparedVariant, usize)> = Vec::new();
    for variant in chosen {
        for (number, control) in variant.model.controls.iter().enumerate() {
            if own.iter().all(|(candidate, k)| candidate.model.controls[*k].name != control.name) {
                own.push((variant, number));
            }
        }
    }
    let design = |(variant, number): &(&PreparedVariant, usize)| {
        let goes_on = progress.stop().is_none();
        goes_on.then(|| designed(&prepared.description, variant, *number, &DesignSettings::default(), &Silent))
    };
    own.par_iter().filter_map(design).collect()
}

/// Records in a design the motor loads of the runs with its controller.
fn add_run_usage(design: &mut Design, chosen: &[&PreparedVariant], runs: &[Run]) {
    for (variant, run) in chosen.iter().zip(runs) {
        if variant.model.controls.iter().any(|control| control.name == design.controller) {
            actuator_usage::add_usage(design, &run.name, run.length(), &run.motor_loads);
        }
    }
    actuator_usage::warn(design);
}

/// Above this number of states a run does not wait for the analysis of its structure.
const MOST_STATES: usize = 24;

/// The structure of a variant next to its run: never stops or delays the run. `Err`: a warning.
fn structure_of(prepared: &Prepared, variant: &PreparedVariant) -> Result<Analysis, String> {
    let states = 2 * variant.reduced.degrees_of_freedom();
    if states > MOST_STATES {
        return Err(format!("the structure of {states} states is not analysed in a run; `kardan analyze` does"));
    }
    let settings = AnalyzeSettings::default();
    let mut found = match variant.reduced.equations.multiplier_constraints.is_empty() {
        true => analyze_variant(prepared, variant, &settings, &Silent),
        false => frozen_variant(variant)
            .map_err(|why| vec![why])
            .and_then(|frozen| analyze_variant(prepared, &frozen, &settings, &Silent)),
    };
    if let (Ok(analysis), false) = (&mut found, variant.model.tolerances.is_empty()) {
        analysis.notes.push("effects of the tolerances, including the nearest loss: see `kardan analyze`".into());
    }
    found.map_err(|why| {
        let why: Vec<String> = why.iter().map(|diagnostic| diagnostic.message.clone()).collect();
        format!("the structure of the model is not analysed: {}", why.join("; "))
    })
}

/// Each output that a controller of the loop controls with its reference, then references of another kind, such as a torque
/// that is requested at an angle.
fn controlled(variant: &PreparedVariant) -> Vec<Plot> {
    let columns = signal_names(&variant.reduced, &variant.scenario);
    let signal = |name: &str| {
        let efforts = [Quantity::Torque, Quantity::Force].map(|quantity| quantity.of(name));
        let named = || columns.iter().find(|(candidate, _)| efforts.contains(candidate));
        columns.iter().find(|(candidate, _)| candidate == name).or_else(named)
    };
    let mut plots: Vec<Plot> = Vec::new();
    let mut output_signals: Vec<String> = Vec::new();
    for control in &variant.model.controls {
        let channels = control.values.tables("channels").unwrap_or_default();
        for channel in channels.iter().chain([&control.values]) {
            let word = |key: &str| channel.word(key).and_then(signal);
            let (Some((output, kind)), reference) = (word("output"), word("reference")) else { continue };
            let same = reference
                .filter(|(_, candidate)| candidate == kind)
                .map(|(name, _)| PlottedReference::from(name.as_str()));
            output_signals.extend(reference.filter(|(_, candidate)| candidate != kind).map(|(name, _)| name.clone()));
            match plots.iter_mut().find(|plot| plot.signals[0] == *output) {
                Some(plot) => plot.references.extend(same.filter(|same| !plot.references.contains(same))),
                None => plots.push(Plot {
                    id: format!("controlled-{output}"),
                    title: format!("Controlled output {output}"),
                    signals: vec![output.clone()],
                    references: same.into_iter().collect(),
                    ..Plot::default()
                }),
            }
        }
    }
    output_signals.dedup();
    if !output_signals.is_empty() {
        let (id, title) = ("references".into(), "Further references".into());
        plots.push(Plot { id, title, signals: output_signals, ..Plot::default() });
    }
    plots
}

/// For a file without a plot: the controlled outputs, with their references; angles and speeds of the coordinates, torques of
/// the motors; of circuits charges, currents and voltages.
fn default_plots(variant: &PreparedVariant) -> Vec<Plot> {
    let names = variant.reduced.coordinate_names();
    let columns = signal_names(&variant.reduced, &variant.scenario);
    let columns: Vec<String> = columns.into_iter().map(|(name, _)| name).collect();
    // Of an angle there is no charge, and the other way round.
    let coordinates = |quantity: Quantity| {
        names.iter().map(|name| quantity.of(name)).filter(|name| columns.contains(name)).collect::<Vec<_>>()
    };
    // A branch has a voltage of the same name.
    let masses = |quantity: Quantity| {
        let equations = &variant.reduced.equations;
        let is_mass = |name: &&String| {
            variant.reduced.coordinate(name).is_some_and(|k| equations.domain(k) == Domain::Translation)
        };
        names.iter().filter(is_mass).map(|name| quantity.of(name)).collect::<Vec<_>>()
    };
    let inputs = |quantity: Quantity| {
        let inputs: Vec<_> = variant.reduced.equations.inputs.iter().map(|input| quantity.of(&input.element)).collect();
        columns.iter().filter(|name| inputs.contains(name)).cloned().collect()
    };
    let plot = |id: &str, title: &str, signals: Vec<String>| Plot {
        id: id.into(),
        title: title.into(),
        signals,
        ..Plot::default()
    };
    let all = [
        plot("angles", "Angles of the coordinates", coordinates(Quantity::Angle)),
        plot("speeds", "Speeds of the coordinates", coordinates(Quantity::Speed)),
        plot("torques", "Motor torques", inputs(Quantity::Torque)),
        plot("positions", "Positions of the coordinates", coordinates(Quantity::Position)),
        plot("velocities", "Velocities of the coordinates", masses(Quantity::Velocity)),
        plot("forces", "Forces of motors", inputs(Quantity::Force)),
        plot("charges", "Charges of the coordinates", coordinates(Quantity::Charge)),
        plot("currents", "Currents of the coordinates", coordinates(Quantity::Current)),
        plot("voltages", "Source voltages", inputs(Quantity::Voltage)),
    ];
    controlled(variant).into_iter().chain(all).filter(|plot| !plot.signals.is_empty()).collect()
}

/// The plots that show one of the chosen variants.
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

/// Runs and judges a variant; with the counts that its sensors read, if they are to be noted.
pub(in crate::study) fn run_variant(
    number: usize,
    variant: &PreparedVariant,
    (prepared, settings): (&Prepared, &Settings),
    progress: &dyn Progress,
    noting: bool,
) -> (Run, Vec<EncoderReading>) {
    let tolerance = tolerance(prepared, settings, progress);
    let scenario = scenario_of(variant, settings);
    let ready = Ready::new(setup(variant, &scenario), tolerance);
    let ready = if noting { ready.noting() } else { ready };
    let RunResult { run, encoder_readings, .. } = run_with_progress(ready, (number, &variant.name), progress);
    (judged(variant, prepared, run), encoder_readings)
}

/// A run with its computed signals, its figures, and its requirements.
pub(in crate::study) fn judged(variant: &PreparedVariant, prepared: &Prepared, mut run: Run) -> Run {
    run.series.signals.extend(variant.computed.signals(&run.series));
    let completed = !matches!(run.outcome, Outcome::Failed { .. });
    let ran = Ran { motor_loads: &run.motor_loads, events: &run.events, completed };
    let run_data = (variant.name.as_str(), &run.series, &ran);
    let (figures, of_figures) = figures_of(&prepared.figures, &variant.computed, run_data);
    let own = prepared.requirements.iter().filter(|requirement| selects(&requirement.variants, &variant.name));
    let judged: Vec<Judged> = own.map(|requirement| judge(requirement, &run.series, &ran, &figures)).collect();
    run.notes.extend(variant.start_notes.iter().cloned());
    run.notes.extend(redundancy_notes(&variant.reduced));
    run.notes.extend(extrapolation_warnings(&variant.reduced, &variant.model.programs, &run.series));
    run.notes.extend(broken_rules(&variant.model.programs, &run.series));
    run.warnings.extend(vehicle_warnings(&variant.model, &run.series));
    run.notes.extend(of_figures);
    for Judged { result, note } in judged {
        run.requirements.push(result);
        run.notes.extend(note);
    }
    if matches!(run.outcome, Outcome::Unbalanced { .. }) && !run.requirements.is_empty() {
        // The time from which its numbers are wrong is unknown.
        run.requirements.iter_mut().for_each(|judged| judged.passed = false);
        run.notes.push("All requirements count as not met: the energy balance of this run does not close, so that its numbers are wrong from some time on.".into());
    }
    let (name, parameters) = (variant.name.clone(), variant.model.parameters.clone());
    run = Run { name, parameters, figures, ..run };
    if let Some(row) = &variant.swept {
        take_row(&mut run, row, prepared);
    }
    run
}

/// Replaces results of a single run by those of a sweep, which differ in the last digits.
fn take_row(run: &mut Run, row: &SweepRow, prepared: &Prepared) {
    let number = |x: f64| Some(x).filter(|x| !x.is_nan());
    let requirements = prepared.requirements.iter().zip(row.measured.iter().zip(&row.passed));
    let requirements = requirements.filter(|(one, _)| selects(&one.variants, &run.name));
    for (found, (_, (measured, passed))) in run.requirements.iter_mut().zip(requirements) {
        (found.measured, found.passed) = (number(*measured), *passed == 1.0);
    }
    let figures = prepared.figures.iter().zip(&row.figures).filter(|(one, _)| selects(&one.variants, &run.name));
    for (found, (_, value)) in run.figures.iter_mut().zip(figures) {
        found.value = number(*value);
    }
    run.notes.push(
        "Figures and verdicts are those of the sweep, which computes its runs in SIMD lanes; curves are those of the \
         single run, which differs in the last digits."
            .into(),
    );
}
