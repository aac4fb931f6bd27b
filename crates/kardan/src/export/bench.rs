//! A virtual bench as JSON.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::identification::IdentificationView;
use super::printed::printed;
use kardan_results::serial::by_name;
use kardan_results::{BenchPlan, BenchStudy, Experiment, Outcome, PlannedParameter, Response, TrueValue};

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
    plan: Option<PlanView<'a>>,
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
    plan: PlanView<'a>,
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

/// An excitation designed to identify parameters.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "BenchPlan")]
struct PlanView<'a> {
    /// `constant_speeds`, `multisine` or `random_steps`.
    kind: &'a str,
    /// The parameters to identify.
    parameters: &'a [PlannedParameter],
    /// Coefficients that this kind of motion, or the selection of the file, does not identify.
    fixed_coefficients: &'a [String],
    /// The selected parts, in the order of the log.
    points: Vec<PointView<'a>>,
    /// Candidates within the limits.
    candidates: usize,
    /// `ln det(XᵀX)` of the selected parts.
    log_det: f64,
    /// The same of all candidates, for the number of selected parts.
    baseline_log_det: f64,
    /// Number of parts of the plan with as much information as one of the undesigned plan.
    gain: f64,
    /// Length, s.
    duration: f64,
}

/// A part of a plan.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "BenchPoint")]
struct PointView<'a> {
    /// When its measurement begins, s.
    from: f64,
    /// When it ends, s.
    until: f64,
    /// Speed of each shaft by its name, rad/s; the largest magnitudes in a section of sines or steps.
    #[schemars(with = "BTreeMap<String, f64>")]
    speeds: ByName<'a>,
    /// Torque of each motor by its name that the model predicts, N m; the largest magnitudes in a section.
    #[schemars(with = "BTreeMap<String, f64>")]
    torques: ByName<'a>,
}

/// Numbers by name.
struct ByName<'a> {
    names: &'a [String],
    values: &'a [f64],
}

impl Serialize for ByName<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        by_name(self.names.iter().map(String::as_str).zip(self.values), to)
    }
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
    printed(BenchView { model, plan: plan.map(planned), truth, logs, notes })
}

/// Gives a study on the bench as one JSON object on one line, in SI.
///
/// Its keys are described by [`schema`](super::schema()) of `bench-study`.
pub fn bench_study_json(study: &BenchStudy, logs: &[LogFiles], files: &[String]) -> String {
    let found = &study.closed_loop;
    printed(StudyView {
        model: &study.model,
        plan: planned(&study.plan),
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

fn planned(plan: &BenchPlan) -> PlanView<'_> {
    let points = plan.points.iter().map(|point| PointView {
        from: point.from,
        until: point.until,
        speeds: ByName { names: &plan.shafts, values: &point.speeds },
        torques: ByName { names: &plan.motors, values: &point.torques },
    });
    PlanView {
        kind: &plan.kind,
        parameters: &plan.parameters,
        fixed_coefficients: &plan.fixed,
        points: points.collect(),
        candidates: plan.candidates,
        log_det: plan.log_det,
        baseline_log_det: plan.undesigned_log_det,
        gain: plan.gain,
        duration: plan.duration,
    }
}
