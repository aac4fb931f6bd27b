//! A virtual bench as JSON.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::identification::IdentificationView;
use super::printed::printed;
use kardan_results::{BenchPlan, BenchStudy, Experiment, Outcome, Response, TrueValue};

/// A log: its name, how it ended, its files.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LogFiles {
    /// Its name.
    pub name: String,
    /// How it ended.
    #[serde(serialize_with = "ending")]
    #[schemars(with = "OutcomeView")]
    pub outcome: Outcome,
    /// Paths of its files.
    pub files: Vec<String>,
}

/// The result of a virtual bench: the excitation, the true values, the logs.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Bench")]
pub(super) struct BenchView<'a> {
    /// Name of the model.
    model: &'a str,
    /// The excitation; `null` if the controllers and the scenario of the file ran.
    plan: Option<&'a BenchPlan>,
    /// True values of the plant that the model does not contain.
    truth: &'a [TrueValue],
    /// One log for each repetition.
    logs: &'a [LogFiles],
    /// Notes to the reader.
    notes: &'a [String],
}

/// The whole procedure on a virtual bench: excitation, logging, identification, design, control.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "BenchStudy")]
pub(super) struct StudyView<'a> {
    /// Name of the model.
    model: &'a str,
    /// The excitation.
    plan: &'a BenchPlan,
    /// True values of the plant that the model does not contain.
    truth: &'a [TrueValue],
    /// One log for each repetition.
    logs: &'a [LogFiles],
    /// Paths of the written files.
    files: &'a [String],
    /// The identification from its logs.
    identification: IdentificationView<'a>,
    /// The controller designed with the identified values.
    controller: &'a str,
    /// Duration of a transient after an event, s.
    transient_s: f64,
    /// Each variant with this controller.
    experiments: Vec<ExperimentView<'a>>,
    /// Notes to the reader.
    notes: Vec<&'a str>,
}

/// How a run ended.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Outcome")]
#[serde(untagged)]
enum OutcomeView<'a> {
    /// At its end.
    Completed(Completed),
    /// At its end, with an energy balance that does not close.
    Unbalanced {
        /// The unexplained energy, and what to try.
        unbalanced: &'a str,
    },
    /// Before.
    Failed {
        /// Time reached, s.
        failed_at: f64,
        /// The error, its reason, and what to try.
        cause: &'a str,
    },
}

/// It reached its end.
#[derive(Serialize, JsonSchema)]
enum Completed {
    /// It did.
    #[serde(rename = "completed")]
    Yes,
}

/// A scenario under a controller.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Experiment")]
struct ExperimentView<'a> {
    /// Name of the variant.
    name: &'a str,
    /// How its runs ended.
    outcomes: Outcomes<'a>,
    /// Each output of the controller.
    responses: &'a [Response],
}

/// How a scenario ended.
#[derive(Serialize, JsonSchema)]
struct Outcomes<'a> {
    /// In the simulation.
    simulation: OutcomeView<'a>,
    /// On the bench.
    bench: OutcomeView<'a>,
}

/// Gives the plan, the true values and the files of the logs as one JSON object on one line, in SI.
///
/// Its keys are described by [`schema`](super::schema()) of `bench`.
///
/// ```
/// use kardan::export::bench_json;
/// let text = bench_json("drive", None, &[], &[], &["a note".to_string()]);
/// assert!(text.contains("\"plan\":null") && text.contains("a note"));
/// ```
pub fn bench_json(
    model: &str,
    plan: Option<&BenchPlan>,
    truth: &[TrueValue],
    logs: &[LogFiles],
    notes: &[String],
) -> String {
    printed(BenchView { model, plan, truth, logs, notes })
}

/// Gives a study on the bench as one JSON object on one line, in SI.
///
/// Its keys are described by [`schema`](super::schema()) of `bench-study`.
pub fn bench_study_json(study: &BenchStudy, logs: &[LogFiles], files: &[String]) -> String {
    let found = &study.closed_loop;
    printed(StudyView {
        model: &study.model,
        plan: &study.plan,
        truth: &study.truth,
        logs,
        files,
        identification: IdentificationView::of(&study.identification),
        controller: &found.design.controller,
        transient_s: found.transient,
        experiments: found.experiments.iter().map(experiment).collect(),
        notes: study.notes.iter().chain(&found.notes).map(String::as_str).collect(),
    })
}

fn experiment(one: &Experiment) -> ExperimentView<'_> {
    ExperimentView {
        name: &one.name,
        outcomes: Outcomes { simulation: outcome(&one.simulated.outcome), bench: outcome(&one.measured.outcome) },
        responses: &one.responses,
    }
}

fn outcome(outcome: &Outcome) -> OutcomeView<'_> {
    match outcome {
        Outcome::Completed => OutcomeView::Completed(Completed::Yes),
        Outcome::Unbalanced { cause } => OutcomeView::Unbalanced { unbalanced: cause },
        Outcome::Failed { time, cause } => OutcomeView::Failed { failed_at: *time, cause },
    }
}

fn ending<S: Serializer>(ended: &Outcome, to: S) -> Result<S::Ok, S::Error> {
    outcome(ended).serialize(to)
}
