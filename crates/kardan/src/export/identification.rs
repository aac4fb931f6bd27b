//! An identification as one JSON object.

use schemars::JsonSchema;
use serde::Serialize;

use super::printed::printed;
use crate::results::serial::Ending;
use crate::results::{Candidate, ChannelRead, Found, Identification, LogRead, ResidualTest, Validation, WindowCount};

/// Parameters found in measured logs.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Identification")]
pub(super) struct IdentificationView<'a> {
    /// Name of the model.
    model: &'a str,
    /// From the file.
    description: &'a str,
    /// What came of it in one sentence.
    verdict: String,
    /// Whether every parameter is determined from whole logs without a warning.
    sound: bool,
    /// `steady` or `dynamic`.
    method: &'a str,
    /// Width of the windows, s.
    window_s: f64,
    /// `squares`, `huber`, `bisquare`.
    loss: &'a str,
    /// Confidence of the intervals.
    confidence: f64,
    /// Measured coordinates.
    coordinates: &'a [String],
    /// Inputs whose torque was measured.
    measured: &'a [String],
    /// Inputs whose torque nobody measured: eliminated.
    eliminated: &'a [String],
    /// The logs that were read.
    logs: Vec<LogView<'a>>,
    /// What became of the windows.
    windows: &'a WindowCount,
    /// Rows of the fit: steady segments or windows.
    samples: usize,
    /// Samples that a robust loss left out or counted by less than a tenth.
    outliers: usize,
    /// Rows less parameters.
    freedom: usize,
    /// Residual over what the noise of the sensors explains.
    scale: f64,
    /// Largest over smallest singular value of the regressor, columns scaled to one.
    condition: f64,
    /// Lags over which errors were taken as correlated; 0: none.
    lags: usize,
    /// What was found.
    parameters: &'a [Found],
    /// Combinations of parameters that are not determined.
    not_determined: NotDetermined<'a>,
    /// Correlations of the errors.
    correlation: Correlation<'a>,
    /// The reduced damping matrix at what was found; `null` where none was asked for.
    damping: Option<DampingView<'a>>,
    /// Tests of what is left over.
    tests: &'a [ResidualTest],
    /// Each row of the balance: how well segments are predicted that the fit has not seen.
    validation: &'a [Validation],
    /// Models compared by cross-validation.
    candidates: Vec<CandidateView<'a>>,
    /// What the reader must know.
    warnings: &'a [String],
    /// One sentence each.
    notes: &'a [String],
    #[serde(flatten)]
    ending: Ending<'a>,
}

/// A log as it was read.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "LogRead")]
struct LogView<'a> {
    /// File.
    name: &'a str,
    /// Rows read.
    rows: u64,
    /// First time, s.
    begin_s: Option<f64>,
    /// Last time, s.
    end_s: Option<f64>,
    /// Gaps, clock jumps, rows that could not be read, a damaged end.
    remarks: &'a [String],
    /// How much of a damaged log is used; `null` if it is whole.
    damage: Option<&'a str>,
    /// Why its clock is in doubt.
    clock: Option<&'a str>,
    /// Channels used.
    channels: &'a [ChannelRead],
}

/// Combinations of parameters that are not determined, in sentences.
#[derive(Serialize, JsonSchema)]
struct NotDetermined<'a> {
    /// By nothing of this kind, whatever is logged.
    by_structure: &'a [String],
    /// By these data, or hardly.
    by_data: &'a [String],
}

/// Correlations of the errors of parameters.
#[derive(Serialize, JsonSchema)]
struct Correlation<'a> {
    /// The parameters.
    names: &'a [String],
    /// Row by row.
    values: &'a [Vec<f64>],
}

/// A reduced damping matrix.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "FoundDamping")]
struct DampingView<'a> {
    /// Names of its rows and columns.
    coordinates: &'a [String],
    /// Row by row, N m s/rad.
    values: &'a [Vec<f64>],
    /// Whether the damping is passive.
    passive: bool,
}

/// A model compared with others.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Candidate")]
struct CandidateView<'a> {
    /// Its name.
    name: &'a str,
    /// Its parameters.
    parameters: &'a [String],
    /// Root mean square of standard residuals on segments left out; `null` if it could not be fitted.
    error: Option<f64>,
    /// Its standard error over the folds.
    error_spread: Option<f64>,
    /// The simplest within one standard error of the best.
    chosen: bool,
    /// Why it could not be fitted.
    failure: &'a str,
}

/// Gives an identification as one JSON object on one line, in SI; a number that is not finite is `null`.
///
/// What its keys are says [`schema`](super::schema()) of `identify`.
pub fn identification_json(found: &Identification) -> String {
    printed(IdentificationView::of(found))
}

impl<'a> IdentificationView<'a> {
    pub(super) fn of(found: &'a Identification) -> Self {
        let verdict = found.verdict();
        Self {
            model: &found.model,
            description: &found.description,
            verdict: verdict.text,
            sound: verdict.sound,
            method: &found.method,
            window_s: found.window,
            loss: &found.loss,
            confidence: found.confidence,
            coordinates: &found.coordinates,
            measured: &found.measured,
            eliminated: &found.eliminated,
            logs: found.logs.iter().map(log).collect(),
            windows: &found.windows,
            samples: found.samples,
            outliers: found.outliers,
            freedom: found.freedom,
            scale: found.scale,
            condition: found.condition,
            lags: found.lags,
            parameters: &found.parameters,
            not_determined: NotDetermined { by_structure: &found.structural, by_data: &found.weak },
            correlation: Correlation { names: &found.correlation.rows, values: &found.correlation.values },
            damping: found.damping.as_ref().map(|damping| DampingView {
                coordinates: &damping.matrix.rows,
                values: &damping.matrix.values,
                passive: damping.passive,
            }),
            tests: &found.tests,
            validation: &found.validation,
            candidates: found.candidates.iter().map(candidate).collect(),
            warnings: &found.warnings,
            notes: &found.notes,
            ending: Ending::of(&found.unfinished),
        }
    }
}

fn log(log: &LogRead) -> LogView<'_> {
    LogView {
        name: &log.name,
        rows: log.rows,
        begin_s: log.span.map(|span| span.from),
        end_s: log.span.map(|span| span.until),
        remarks: &log.remarks,
        damage: log.damage.as_deref(),
        clock: log.clock.as_deref(),
        channels: &log.channels,
    }
}

fn candidate(one: &Candidate) -> CandidateView<'_> {
    CandidateView {
        name: &one.name,
        parameters: &one.parameters,
        error: one.error.map(|error| error.mean),
        error_spread: one.error.map(|error| error.spread),
        chosen: one.chosen,
        failure: &one.failure,
    }
}
