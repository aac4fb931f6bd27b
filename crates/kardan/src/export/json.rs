//! The result of a study as one JSON object, or the reason why there is none.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::analysis::Short;
use super::printed::printed;
use kardan_results::serial::by_name;
use kardan_results::{
    Accuracy, Effort, Energy, Event, FigureResult, Mechanism, MotorLoadView, Outcome, ParameterValue, Physical,
    RequirementResult, Run, RunVerdict, Signal, Study, extremes,
};
use kardan_schema::diagnostics::{Diagnostic, Lines, Severity};

/// The written files of a study.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Files {
    /// Paths for each run, in the order of [`Study::runs`]; later runs have none.
    pub runs: Vec<Vec<String>>,
    /// Path of the table of the figures of all runs.
    pub figures: Option<String>,
    /// Path of the report.
    pub report: Option<String>,
    /// Paths of the plots.
    pub plots: Vec<String>,
    /// Files that could not be written, and why.
    pub unwritten: Vec<String>,
}

/// The result of a study.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Study")]
pub(super) struct StudyView<'a> {
    /// Name of the model.
    model: &'a str,
    /// Its parts, and who is joined to whom.
    mechanism: &'a Mechanism,
    /// One run for each variant, in the order of the file.
    variants: Vec<RunView<'a>>,
    /// Path of the table of the figures of all runs; `null` if the model has none.
    figures: Option<&'a str>,
    /// Path of the report; `null` if none was written.
    report: Option<&'a str>,
    /// Paths of the plots.
    plots: &'a [String],
    /// Warnings of the model file.
    warnings: &'a [String],
    /// Key results of the structure of the first variant, under the names of `analyze`; `null` where it was not analysed.
    analysis: Option<Short<'a>>,
    /// Files that could not be written, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<Problem<'a>>,
}

/// The run of one variant.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Run")]
struct RunView<'a> {
    /// The model's name if there are no variants.
    name: &'a str,
    /// Whether it reached its end with usable numbers.
    outcome: OutcomeView<'a>,
    /// The values that make this variant by name, SI.
    #[serde(serialize_with = "values")]
    #[schemars(with = "BTreeMap<String, f64>")]
    parameters: &'a [ParameterValue],
    /// Every signal by name, in a few numbers.
    #[serde(serialize_with = "signals")]
    #[schemars(with = "BTreeMap<String, SignalView>")]
    signals: &'a Run,
    /// The energy balance up to the end (or the failure).
    energy: Energy,
    /// The model file's requirements.
    requirements: &'a [RequirementResult],
    /// Its figures.
    figures: &'a [FigureResult],
    /// Events in order of time.
    events: &'a [Event],
    /// Notes to the reader.
    notes: &'a [String],
    /// Reasons to doubt its numbers.
    warnings: &'a [String],
    /// The load of each motor with limits.
    motors: Vec<MotorLoadView<'a>>,
    /// Statistics of the integrator.
    effort: Effort,
    /// Estimated integration error, from a second run; null with `--runs-only`, and if one of both ended early.
    accuracy: Option<&'a Accuracy>,
    /// Paths of its files.
    files: &'a [String],
}

/// Whether a run reached its end with usable numbers.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Outcome")]
struct OutcomeView<'a> {
    /// Whether it did.
    completed: bool,
    /// The status of the run, including reasons to doubt its numbers.
    verdict: RunVerdict,
    /// Else the time reached, s; the results up to it are valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    /// The error, its reason, and what to try.
    #[serde(skip_serializing_if = "Option::is_none")]
    cause: Option<&'a str>,
}

/// A time series in a few numbers.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Signal")]
struct SignalView {
    /// Least value.
    min: Option<f64>,
    /// Greatest value.
    max: Option<f64>,
    /// Last value.
    #[serde(rename = "final")]
    last: Option<f64>,
    /// First time of `min`, s.
    t_min: Option<f64>,
    /// First time of `max`, s.
    t_max: Option<f64>,
    /// SI unit.
    unit: Physical,
}

/// Why there is no result.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Error")]
pub(super) struct ErrorView<'a> {
    /// The error.
    error: Problem<'a>,
}

/// The error.
#[derive(Serialize, JsonSchema)]
struct Problem<'a> {
    /// In one sentence.
    message: String,
    /// Each error with its position.
    diagnostics: Vec<Place<'a>>,
}

/// An error with its position.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Diagnostic")]
pub(super) struct Place<'a> {
    /// Its severity.
    severity: Word,
    /// Its kind: `unit::unknown`.
    code: &'a str,
    /// The message.
    message: &'a str,
    /// Line, from 1; `null` without a position.
    line: Option<usize>,
    /// Column, from 1; `null` without a position.
    column: Option<usize>,
    /// How to correct it.
    help: Option<&'a str>,
}

/// The severity of an error.
#[derive(Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Severity")]
enum Word {
    Error,
    Warning,
}

/// Gives the study and its files as one JSON object on one line, in SI; a number that is not finite is `null`.
///
/// Its keys are described by [`schema`](super::schema()) of `run`.
pub fn json(study: &Study, files: &Files) -> String {
    let problem = || Problem { message: files.unwritten.join("; "), diagnostics: Vec::new() };
    printed(StudyView {
        model: &study.model.name,
        mechanism: &study.model.mechanism,
        variants: study
            .runs
            .iter()
            .enumerate()
            .map(|(i, run)| variant(run, files.runs.get(i).map_or(&[], Vec::as_slice)))
            .collect(),
        figures: files.figures.as_deref(),
        report: files.report.as_deref(),
        plots: &files.plots,
        warnings: &study.warnings,
        analysis: study.analysis.as_ref().map(Short::of),
        error: (!files.unwritten.is_empty()).then(problem),
    })
}

/// Gives an error as one JSON object on one line, for commands with `--json`.
///
/// Line and column count from 1 in `source` and are `null` for a diagnostic without a position. Its keys are described by
/// [`schema`](super::schema()) of `error`.
pub fn json_error(message: &str, source: &str, diagnostics: &[Diagnostic]) -> String {
    printed(ErrorView { error: Problem { message: message.into(), diagnostics: places(source, diagnostics) } })
}

/// Diagnostics with line and column in their source text.
pub(super) fn places<'a>(source: &str, diagnostics: &'a [Diagnostic]) -> Vec<Place<'a>> {
    let lines = Lines::new(source);
    let places = diagnostics.iter().map(|d| {
        let in_source = d.labels.iter().find(|label| label.place.path().is_none());
        let place = in_source.map(|label| lines.line_column(source, label.place.start()));
        Place {
            severity: match d.severity {
                Severity::Error => Word::Error,
                Severity::Warning => Word::Warning,
            },
            code: d.code,
            message: &d.message,
            line: place.map(|(line, _)| line),
            column: place.map(|(_, column)| column),
            help: d.help.as_deref(),
        }
    });
    places.collect()
}

fn variant<'a>(run: &'a Run, files: &'a [String]) -> RunView<'a> {
    RunView {
        name: &run.name,
        outcome: OutcomeView {
            completed: run.outcome == Outcome::Completed,
            verdict: run.verdict(),
            time: (run.outcome != Outcome::Completed).then(|| run.length()),
            cause: run.outcome.cause(),
        },
        parameters: &run.parameters,
        signals: run,
        energy: run.energy,
        requirements: &run.requirements,
        figures: &run.figures,
        events: &run.events,
        notes: &run.notes,
        warnings: &run.warnings,
        motors: run.motor_loads.iter().map(|motor_load| MotorLoadView::of(motor_load, run.length())).collect(),
        effort: run.effort,
        accuracy: run.accuracy.as_ref(),
        files,
    }
}

fn values<S: Serializer>(all: &&[ParameterValue], to: S) -> Result<S::Ok, S::Error> {
    by_name(all.iter().map(|one| (one.name.as_str(), one.value)), to)
}

fn signals<S: Serializer>(run: &&Run, to: S) -> Result<S::Ok, S::Error> {
    let view = |signal: &Signal| {
        let found = extremes(&run.series.time, &signal.values);
        let (min, max) = (found.min, found.max);
        SignalView {
            min: min.map(|at| at.value),
            max: max.map(|at| at.value),
            last: found.last,
            t_min: min.map(|at| at.time),
            t_max: max.map(|at| at.time),
            unit: signal.physical,
        }
    };
    by_name(run.series.signals.iter().map(|signal| (signal.name.as_str(), view(signal))), to)
}
