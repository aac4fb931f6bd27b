//! The result of an identification.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::verdict::{counted, early};
use super::{Interval, Mechanism, Span, Verdict, serial};

/// Parameters identified from measured logs.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Identification {
    /// Name of the model.
    #[serde(skip)]
    pub model: String,
    /// From the file.
    #[serde(skip)]
    pub description: String,
    /// Parts of the model and their connections.
    #[serde(skip)]
    pub mechanism: Mechanism,
    /// `steady` or `dynamic`.
    pub method: String,
    /// Width of the windows, s.
    #[serde(rename = "window_s")]
    pub window: f64,
    /// `squares`, `huber`, `bisquare`.
    pub loss: String,
    /// Confidence of the intervals.
    pub confidence: f64,
    /// Measured coordinates.
    pub coordinates: Vec<String>,
    /// Inputs whose torque was measured.
    pub measured: Vec<String>,
    /// Inputs without measured torque: eliminated.
    pub eliminated: Vec<String>,
    /// The logs that were read.
    pub logs: Vec<LogRead>,
    /// Statistics of the windows.
    pub windows: WindowCount,
    /// Rows of the fit: steady segments or windows.
    pub samples: usize,
    /// Samples that a robust loss removed or weighted by less than a tenth.
    pub outliers: usize,
    /// Rows less parameters.
    pub degrees_of_freedom: usize,
    /// Residual over the noise of the sensors.
    pub scale: f64,
    /// Largest over smallest singular value of the regressor, columns scaled to one.
    pub condition: f64,
    /// Lags over which errors were taken as correlated; 0: none.
    pub lags: usize,
    /// The identified parameters.
    pub parameters: Vec<IdentifiedParameter>,
    /// Combinations of parameters that are not determined.
    pub unidentifiable: NotDetermined,
    /// Correlations of the errors.
    pub correlation: Correlation,
    /// The reduced damping matrix at the identified values; `None` if not requested.
    pub damping: Option<IdentifiedDamping>,
    /// Residual tests.
    pub tests: Vec<ResidualTest>,
    /// Each row of the balance: prediction of segments outside the fit.
    pub validation: Vec<Validation>,
    /// Models compared by cross-validation.
    pub candidates: Vec<Candidate>,
    /// Terms suggested by the residual; `None` if not requested, or if all ended early.
    pub suggestions: Option<Suggestions>,
    /// Friction over speed: measured and of the model.
    #[serde(skip)]
    pub curves: Vec<FrictionCurve>,
    /// Torque over time, for the report.
    #[serde(skip)]
    pub traces: Vec<Trace>,
    /// The part for a model file.
    #[serde(skip)]
    pub for_file: FileContent,
    /// Notes to the reader.
    pub warnings: Vec<String>,
    /// One sentence each.
    pub notes: Vec<String>,
    /// Of an identification that ended early: why, and what is missing.
    #[serde(flatten, serialize_with = "serial::ending")]
    #[schemars(with = "serial::Ending")]
    pub incomplete_reason: Option<String>,
}

/// Combinations of parameters that are not determined, in sentences.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct NotDetermined {
    /// By no test of this kind, for any logged signals.
    pub structurally: Vec<String>,
    /// By these data, or only poorly.
    pub practically: Vec<String>,
}

/// Probability below which a residual test rejects.
const UNLIKELY: f64 = 0.01;
/// The remark on a parameter that the file gives in addition to the identified ones.
pub const FIXED_REMARK: &str = "given";
/// Ratio of residual and sensor noise above which the verdict distinguishes both.
const LOUD: f64 = 10.0;
/// Number of logs named in the verdict.
const NAMED: usize = 3;

impl Identification {
    /// The verdict in one sentence, with all reservations; sound if every parameter has an interval without zero, the logs are
    /// whole and their clocks sound, there is no warning, and nothing ended early.
    ///
    /// ```
    /// use kardan_results::{IdentifiedParameter, Identification, Interval, LogRead};
    /// let interval = Some(Interval { lower: 1.9, upper: 2.1 });
    /// let one = IdentifiedParameter { name: "a.damping".into(), value: Some(2.0), interval, ..IdentifiedParameter::default() };
    /// let mut found = Identification { parameters: vec![one.clone(), one], degrees_of_freedom: 7, ..Identification::default() };
    /// found.logs.push(LogRead { name: "b.csv".into(), damage: Some("kardan uses 900 rows of it".into()), ..LogRead::default() });
    /// let verdict = found.verdict();
    /// assert!(!verdict.sound && verdict.text.starts_with(
    ///     "All 2 parameters are determined, from a log that is damaged (b.csv: kardan uses 900 rows of it)"
    /// ));
    /// ```
    pub fn verdict(&self) -> Verdict {
        let sought = || self.parameters.iter().filter(|one| one.remark != FIXED_REMARK);
        let all = sought().count();
        let determined = sought().filter(|one| one.interval.is_some() && one.combination.is_empty()).count();
        let parameters = match (determined, all) {
            (1, 1) => "The parameter is determined".into(),
            (0, 1) => "The parameter is not determined".into(),
            (determined, all) if determined == all => format!("All {all} parameters are determined"),
            (determined, all) => format!("{determined} of {all} parameters are determined"),
        };
        let may_vanish = |interval: Interval| interval.lower <= 0.0 && interval.upper >= 0.0;
        let zero = match (sought().filter(|one| one.interval.is_some_and(may_vanish)).count(), all) {
            (0, _) => String::new(),
            (_, 1) => ", but not distinguishable from zero".into(),
            (some, all) => format!(", but {some} of {all} are not distinguishable from zero"),
        };
        let reservations = self.reservations();
        let warnings = counted(&self.warnings);
        let sound = determined == all
            && zero.is_empty()
            && self.warnings.is_empty()
            && reservations.is_empty()
            && self.incomplete_reason.is_none();
        let early = early(self.incomplete_reason.as_deref());
        Verdict { sound, text: format!("{early}{parameters}{zero}{reservations}{}{warnings}.", self.tested()) }
    }

    /// `; the residual is like noise`
    fn tested(&self) -> String {
        let failed_tests = self.tests.iter().filter(|test| test.probability < UNLIKELY).count();
        match (failed_tests, self.tests.len()) {
            (_, 0) if self.degrees_of_freedom == 0 => "; too few windows to distinguish errors from parameters".into(),
            (_, 0) => String::new(),
            // Noise much larger than that of the sensors has another cause, even if it appears random.
            (0, _) if self.scale > LOUD => {
                format!("; the residual appears random, but is {:.0} times the noise of the sensors", self.scale)
            }
            (0, _) => "; the residual is like noise".into(),
            (1, _) => "; one residual test rejects the model".into(),
            (many, _) => format!("; {many} residual tests reject the model"),
        }
    }

    /// `, from a log that is damaged (bench.csv: 1234 rows of it are used)`, and doubtful clocks.
    fn reservations(&self) -> String {
        let named = |of: &dyn Fn(&LogRead) -> Option<String>| -> (usize, String) {
            let sentences: Vec<String> = self.logs.iter().filter_map(of).collect();
            let shown = sentences[..sentences.len().min(NAMED)].join("; ");
            let more = sentences.len().saturating_sub(NAMED);
            (sentences.len(), if more > 0 { format!("{shown}; and {more} more") } else { shown })
        };
        let (damaged, places) = named(&|log| log.damage.as_ref().map(|what| format!("{}: {what}", log.name)));
        let (doubted, clocks) = named(&|log| log.clock.as_ref().map(|why| format!("the clock of {} {why}", log.name)));
        let mut out = match (damaged, self.logs.len()) {
            (0, _) => String::new(),
            (_, 1) => format!(", from a log that is damaged ({places})"),
            (1, all) => format!(", from {all} logs of which 1 is damaged ({places})"),
            (many, all) => format!(", from {all} logs of which {many} are damaged ({places})"),
        };
        if doubted > 0 {
            out += &format!("; {clocks}");
        }
        out
    }
}

/// Correlations of the errors of parameters.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Correlation {
    /// The parameters.
    pub names: Vec<String>,
    /// Row by row.
    pub values: Vec<Vec<f64>>,
}

/// The reduced damping matrix at the identified values.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct IdentifiedDamping {
    /// Names of its rows and columns.
    pub coordinates: Vec<String>,
    /// Row by row, N m s/rad.
    pub values: Vec<Vec<f64>>,
    /// That unit, of masses N s/m; with both, that of each row over the speed of the column.
    pub unit: String,
    /// Whether the damping is passive.
    pub passive: bool,
}

/// What an identification writes into a model file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FileContent {
    /// Values of its keys and parameters.
    pub values: Vec<FileValue>,
    /// Terms as laws of torques.
    pub terms: Vec<FileTerm>,
    /// Other added terms, each with the entry that declares it.
    pub entries: Vec<(String, String)>,
    /// What a model file cannot contain, and why.
    pub omissions: Vec<String>,
}

/// A value for a model file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FileValue {
    /// `fs.damping`, or an entry of `[parameters]`.
    pub name: String,
    /// SI.
    pub value: f64,
    /// The confidence interval, if there is one of this value alone.
    pub interval: Option<Interval>,
}

/// An additional term as a law of a torque: the coefficients are those opposite to the motion, as identified.
#[derive(Debug, Clone, PartialEq)]
pub struct FileTerm {
    /// `fs.quadratic_damping`
    pub term: String,
    /// The element along which it acts.
    pub element: String,
    /// What it is.
    pub law: FileLaw,
    /// The SI unit of its coefficients.
    pub unit: String,
    /// Its coefficients; a harmonic has that of the cosine, then that of the sine.
    pub coefficients: Vec<FileValue>,
}

/// What a [`FileTerm`] is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FileLaw {
    /// A constant.
    FrictionAsymmetry,
    /// In proportion to the magnitude of the speed.
    DampingAsymmetry,
    /// In proportion to the speed times its magnitude.
    Quadratic,
    /// A harmonic of the angle, by its periods in a revolution.
    Cogging(f64),
}

/// A log that was read.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct LogRead {
    /// File.
    pub name: String,
    /// Rows read.
    pub rows: u64,
    /// First and last time, s; `None` if it has no row.
    #[serde(flatten, serialize_with = "ends")]
    #[schemars(with = "Ends")]
    pub span: Option<Span>,
    /// Gaps, clock jumps, rows that could not be read, a damaged end.
    pub remarks: Vec<String>,
    /// How much of a damaged log is used: `its first 1234 rows are used`; `None` if it is whole.
    pub damage: Option<String>,
    /// Why its clock is doubtful: `it jumps back 2 times`.
    pub clock: Option<String>,
    /// Channels used.
    pub channels: Vec<ChannelRead>,
}

/// When a log begins and ends.
#[derive(Serialize, JsonSchema)]
struct Ends {
    /// First time, s.
    begin_s: Option<f64>,
    /// Last time, s.
    end_s: Option<f64>,
}

fn ends<S: Serializer>(span: &Option<Span>, to: S) -> Result<S::Ok, S::Error> {
    Ends { begin_s: span.map(|span| span.start), end_s: span.map(|span| span.end) }.serialize(to)
}

/// A channel that was read.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ChannelRead {
    /// Its name in the log.
    pub name: String,
    /// Its unit there.
    pub unit: String,
    /// What it is: `wg.phi`.
    pub signal: String,
    /// SI unit of the signal.
    pub si: &'static str,
    /// Mean time between samples, s.
    #[serde(rename = "sample_time_s")]
    pub sample_time: f64,
    /// Standard deviation of a sample, SI: stated in the model file or estimated from the log.
    pub noise: f64,
    /// Whether the model file states it.
    #[serde(rename = "noise_stated")]
    pub stated: bool,
}

/// Statistics of the windows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct WindowCount {
    /// All in which something was logged.
    pub all: usize,
    /// Without enough samples of every channel.
    pub incomplete: usize,
    /// With a friction that sticks, nearly sticks or breaks away: its sign is not known.
    pub sticking: usize,
    /// Not steady (where only steady ones count).
    pub unsteady: usize,
    /// Used.
    pub used: usize,
}

/// A parameter as the logs determine it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct IdentifiedParameter {
    /// `fs.damping`
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Its value in the model file; none if the file does not give it.
    pub model_value: Option<f64>,
    /// The identified value, or that of the file; `None` if it is not determined and the file does not give it.
    pub value: Option<f64>,
    /// Standard error; infinite if it is not determined, `None` of a parameter at its bound.
    pub standard_error: Option<f64>,
    /// The confidence interval, if there is one.
    pub interval: Option<Interval>,
    /// What else enters the value: `+ 0.96 cs.damping`; only this combination is identifiable.
    pub combination: String,
    /// Why there is no interval: not determined, at its bound; with an interval its meaning.
    pub remark: String,
    /// A value published elsewhere.
    pub published: Option<f64>,
}

/// A residual test.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ResidualTest {
    /// Its hypothesis: `mean zero (row cs)`.
    pub hypothesis: String,
    /// p-value: probability of this or a worse result under the hypothesis.
    pub probability: f64,
    /// The meaning of a rejection.
    pub if_rejected: String,
}

/// Prediction of segments outside the fit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Validation {
    /// Row of the balance: a coordinate, or a combination where torques were eliminated.
    pub row: String,
    /// The SI unit of the row: N m, of a mass N.
    pub unit: String,
    /// Root mean square of the torque that the parameters explain, N m (of a mass N).
    #[serde(rename = "torque_rms_N_m")]
    pub torque: f64,
    /// Root mean square of the residual on the samples of the fit, N m.
    #[serde(rename = "residual_fit_N_m")]
    pub in_sample: f64,
    /// The same on samples left out of the fit, each once; `None` if there are too few.
    #[serde(rename = "residual_validation_N_m")]
    pub cross_validated: Option<f64>,
}

/// A model in a comparison.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Candidate {
    /// Its name.
    pub name: String,
    /// Its parameters.
    pub parameters: Vec<String>,
    /// Its prediction of segments left out of the fit; `None` if it could not be fitted.
    #[serde(flatten, serialize_with = "prediction")]
    #[schemars(with = "Prediction")]
    pub error: Option<PredictionError>,
    /// The simplest within one standard error of the best.
    pub chosen: bool,
    /// Why it could not be fitted.
    pub failure: String,
}

/// Terms suggested by the residual of a fit, tried on segments outside all fits.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Suggestions {
    /// The tried terms, round by round: the best of each goes into the model of the next.
    pub tested_terms: Vec<Suggestion>,
    /// Harmonics of angles tried in the last round that are not distinguishable from zero.
    pub insignificant_harmonics: usize,
    /// Orders of the harmonics that were tried: periods in a turn.
    pub harmonic_orders: Vec<f64>,
    /// Terms that were not tried, and why.
    pub untested_terms: Vec<String>,
    /// The terms to add, in order.
    pub selected_terms: Vec<String>,
    /// Their entries in the model file.
    pub text: String,
    /// The identified parameters with them.
    pub parameters: Vec<IdentifiedParameter>,
    /// Residual with them over the noise of the sensors.
    pub scale: f64,
    /// Residual tests with them.
    pub tests: Vec<ResidualTest>,
    /// Prediction of segments outside the fit with them.
    pub validation: Vec<Validation>,
    /// Prediction of whole logs from the others; empty with few logs, or if terms of single logs were requested.
    pub log_cross_validation: Vec<ValidationLogs>,
    /// The part for a model file with them.
    #[serde(skip)]
    pub for_file: FileContent,
}

impl Suggestions {
    /// Tests that reject the model with the added terms.
    pub fn failed_tests(&self) -> usize {
        self.tests.iter().filter(|test| test.probability < UNLIKELY).count()
    }
}

/// A tried term.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Suggestion {
    /// Round, from 1 on.
    pub round: usize,
    /// The term: `rotor.friction_asymmetry`.
    pub term: String,
    /// How many parameters it has.
    pub parameters: usize,
    /// The test that suggests it.
    pub raised_by: String,
    /// p-value: probability of this or a larger effect without the term; `None` if other terms have the same effect.
    pub probability: Option<f64>,
    /// Part of the mean square error outside the fit that it removes; `None` if it is not distinguishable from zero.
    pub gain: Option<f64>,
    /// Its standard error over the folds.
    pub gain_spread: Option<f64>,
    /// Whether it is added.
    pub selected: bool,
    /// Why, or why not.
    pub verdict: String,
}

/// Prediction of whole logs from the others, without terms of single logs.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ValidationLogs {
    /// Row of the balance.
    pub row: String,
    /// Root mean square of the residual of the model as it is, N m.
    #[serde(rename = "residual_before_N_m")]
    pub before: f64,
    /// The same with the added terms, N m.
    #[serde(rename = "residual_after_N_m")]
    pub after: f64,
}

/// Prediction of segments left out of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PredictionError {
    /// Root mean square of standard residuals.
    pub mean: f64,
    /// Its standard error over the folds.
    pub spread: f64,
}

/// Prediction of segments left out of a fit, if it could be fitted.
#[derive(Serialize, JsonSchema)]
struct Prediction {
    /// Root mean square of standard residuals on segments left out; `null` if it could not be fitted.
    error: Option<f64>,
    /// Its standard error over the folds.
    error_spread: Option<f64>,
}

fn prediction<S: Serializer>(error: &Option<PredictionError>, to: S) -> Result<S::Ok, S::Error> {
    Prediction { error: error.map(|error| error.mean), error_spread: error.map(|error| error.spread) }.serialize(to)
}

/// Friction along one direction over its speed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrictionCurve {
    /// The element.
    pub element: String,
    /// SI units of speed and torque.
    pub units: [&'static str; 2],
    /// The measurement minus all other terms.
    pub points: Vec<FrictionPoint>,
    /// The identified friction: damping, Coulomb, Stribeck.
    pub line: Vec<FrictionPoint>,
}

/// A friction torque at a speed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrictionPoint {
    /// The speed, rad/s.
    pub speed: f64,
    /// The torque, N m.
    pub torque: f64,
}

/// A row of the balance over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// The row.
    pub row: String,
    /// Its SI unit.
    pub unit: String,
    /// Its points, log by log.
    pub points: Vec<TracePoint>,
}

/// A row of the balance at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TracePoint {
    /// The log, from 0.
    pub log: usize,
    /// s
    pub time: f64,
    /// The torque measured, N m.
    pub measured: f64,
    /// The torque predicted from the other segments, N m.
    pub predicted: f64,
}
