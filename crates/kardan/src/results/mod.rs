//! Results of a study: plain data with names and units, without computations.

mod accuracy;
mod analysis;
mod bench;
mod descriptor;
mod design;
mod exploration;
mod extremes;
mod identification;
mod linearised;
mod loop_along_path;
mod margins;
mod mechanism;
mod parity;
mod pencil;
mod realisation;
mod reference;
mod responses;
mod robustness;
mod safety;
pub(crate) mod serial;
mod signal_graph;
mod stability;
mod sweep;
mod verdict;

use crate::names::Quantity;
use crate::units::{Dimension, parse_quantity};
use kardan_rt::functions::hypot;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

pub use crate::names::bidi_escaped;
pub use accuracy::*;
pub use analysis::*;
pub use bench::*;
pub use descriptor::*;
pub use design::*;
pub use exploration::*;
pub use extremes::*;
pub use identification::*;
pub use linearised::*;
pub use loop_along_path::*;
pub use margins::*;
pub use mechanism::*;
pub use parity::*;
pub use pencil::*;
pub use realisation::*;
pub use reference::*;
pub use responses::*;
pub use robustness::*;
pub use safety::*;
pub use signal_graph::*;
pub use stability::*;
pub use sweep::*;
pub use verdict::*;

/// The physical kind of a signal; fixes its SI unit and the unit a plot prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, JsonSchema)]
pub enum Physical {
    /// Angle, rad.
    #[serde(rename = "rad")]
    Angle,
    /// Angular velocity, rad/s.
    #[serde(rename = "rad/s")]
    Speed,
    /// Torque, N m.
    #[serde(rename = "N m")]
    Torque,
    /// Energy, J.
    #[serde(rename = "J")]
    Energy,
    /// Position of a mass, m.
    #[serde(rename = "m")]
    Position,
    /// Velocity of a mass, m/s.
    #[serde(rename = "m/s")]
    Velocity,
    /// Force, N.
    #[serde(rename = "N")]
    Force,
    /// Electric charge, C.
    #[serde(rename = "C")]
    Charge,
    /// Electric current, A.
    #[serde(rename = "A")]
    Current,
    /// Voltage, or potential against ground, V.
    #[serde(rename = "V")]
    Voltage,
    /// The result of an expression of signals: its SI unit, empty for a number without a unit.
    #[serde(untagged)]
    Other(&'static str),
}

/// The units of [`Physical::Other`], each once.
static UNITS: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

impl Physical {
    /// The SI unit of the stored numbers.
    pub fn unit(self) -> &'static str {
        match self {
            Physical::Angle => "rad",
            Physical::Speed => "rad/s",
            Physical::Torque => "N m",
            Physical::Energy => "J",
            Physical::Position => "m",
            Physical::Velocity => "m/s",
            Physical::Force => "N",
            Physical::Charge => "C",
            Physical::Current => "A",
            Physical::Voltage => "V",
            Physical::Other(unit) => unit,
        }
    }

    /// The dimension of its values.
    pub fn dimension(self) -> Dimension {
        match self {
            Physical::Angle => Dimension::ANGLE,
            Physical::Speed => Dimension::ANGULAR_VELOCITY,
            Physical::Torque | Physical::Energy => Dimension::TORQUE,
            Physical::Position => Dimension::LENGTH,
            Physical::Velocity => Dimension::VELOCITY,
            Physical::Force => Dimension::FORCE,
            Physical::Charge => Dimension::CHARGE,
            Physical::Current => Dimension::CURRENT,
            Physical::Voltage => Dimension::VOLTAGE,
            Physical::Other(unit) => {
                parse_quantity(&format!("1 {unit}")).map_or(Dimension::NONE, |(_, dimension)| dimension)
            }
        }
    }

    /// The kind of a value of a dimension.
    pub fn of(dimension: Dimension) -> Self {
        use Physical::{Angle, Charge, Current, Force, Position, Speed, Torque, Velocity, Voltage};
        let kinds = [Angle, Speed, Torque, Position, Velocity, Force, Charge, Current, Voltage];
        let found = kinds.into_iter().find(|physical| physical.dimension() == dimension);
        found.unwrap_or_else(|| Physical::of_unit(&dimension.si()))
    }

    /// The kind of a value with another unit, as of `motor.tau * shaft.w`. Each unit is kept through the life of the process.
    pub fn of_unit(unit: &str) -> Self {
        let mut units = UNITS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(interned) = units.get(unit) {
            return Self::Other(interned);
        }
        let leaked: &'static str = String::from(unit).leak();
        units.insert(leaked);
        Self::Other(leaked)
    }

    /// The word for an axis label.
    pub fn word(self) -> &'static str {
        match self {
            Physical::Angle => "angle",
            Physical::Speed => "angular velocity",
            Physical::Torque => "torque",
            Physical::Energy => "energy",
            Physical::Position => "position",
            Physical::Velocity => "velocity",
            Physical::Force => "force",
            Physical::Charge => "charge",
            Physical::Current => "current",
            Physical::Voltage => "voltage",
            Physical::Other("") => "number",
            Physical::Other("W") => "power",
            Physical::Other(_) => "quantity",
        }
    }
}

impl Quantity {
    /// The kind of the numbers.
    pub fn physical(self) -> Physical {
        match self {
            Self::Angle => Physical::Angle,
            Self::Speed => Physical::Speed,
            Self::Position => Physical::Position,
            Self::Velocity => Physical::Velocity,
            Self::Force => Physical::Force,
            Self::Charge => Physical::Charge,
            Self::Current => Physical::Current,
            Self::Voltage => Physical::Voltage,
            Self::Multiplier => Physical::of_unit(""),
            Self::Sum => Physical::of_unit("s"),
            Self::State => Physical::of_unit(""),
            Self::Change => Physical::of_unit("1/s"),
            Self::Torque | Self::Command | Self::Ripple | Self::Friction | Self::Disturbance | Self::Excess => {
                Physical::Torque
            }
        }
    }
}

/// One time series.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    /// Modelica-style name: `rk.phi`, `wg_motor.tau`, `ref_rk`.
    pub name: String,
    /// Angle, speed, torque, charge, current, voltage.
    pub physical: Physical,
    /// One sentence for the reader of a table.
    pub description: String,
    /// One value for each entry of [`Series::time`], SI.
    pub values: Vec<f64>,
}

/// All signals of one run on one time grid. Values at the time of a step are those just after it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Time in s, strictly increasing.
    pub time: Vec<f64>,
    /// The signals.
    pub signals: Vec<Signal>,
}

impl Series {
    /// The signal of that name.
    pub fn signal(&self, name: &str) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.name == name)
    }

    /// Largest torque command of a motor in the rows, before its limits, N m; `None` if there is no such motor.
    pub fn largest_torque_demand(&self, motor: &str) -> Option<f64> {
        let names = [Quantity::Command, Quantity::Torque, Quantity::Force, Quantity::Voltage]
            .map(|quantity| quantity.of(motor));
        let signal = names.iter().find_map(|name| self.signal(name));
        signal.map(|signal| signal.values.iter().fold(0.0, |max: f64, x| max.max(x.abs())))
    }
}

/// The energy balance of a run, J: `input = stored + dissipated + residual`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct Energy {
    /// Work done by all inputs and disturbances.
    pub input: f64,
    /// Change of kinetic and potential energy.
    pub stored: f64,
    /// Loss in dampers and friction.
    pub dissipated: f64,
    /// Error of the balance; its magnitude relative to `exchanged` certifies the run.
    pub residual: f64,
    /// Energy exchanged: the energy stored at the start, plus the magnitudes of the work of inputs in each step.
    pub exchanged: f64,
}

impl Energy {
    /// The residual relative to the energy exchanged; `None` if that is zero.
    pub fn residual_share(&self) -> Option<f64> {
        (self.exchanged > 0.0).then(|| (self.residual / self.exchanged).abs())
    }
}

/// An event at a located instant.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Event {
    /// Time in s.
    pub time: f64,
    /// `fs sticks`, `rk slips backward`, `ref_rk steps to 3.14159 rad`, `wg_motor reaches its torque limit`.
    pub description: String,
}

/// Whether a run reached its end with usable numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It did.
    Completed,
    /// It reached its end, but its energy balance does not close: its numbers are wrong from some time on.
    Unbalanced {
        /// The unexplained energy, and what to try.
        cause: String,
    },
    /// It stopped early; the results up to `time` are valid.
    Failed {
        /// Time reached, s.
        time: f64,
        /// The error, its reason, and what to try.
        cause: String,
    },
}

impl Outcome {
    /// Why its numbers are not those of a whole run; `None` if they are.
    pub fn cause(&self) -> Option<&str> {
        match self {
            Self::Completed => None,
            Self::Unbalanced { cause } | Self::Failed { cause, .. } => Some(cause),
        }
    }
}

/// The status of a run in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunVerdict {
    /// It reached its end without warnings on its numbers.
    Completed,
    /// It reached its end with warnings on its numbers.
    Doubtful,
    /// It reached its end, but its energy balance does not close: its numbers are wrong from some time on.
    Unbalanced,
    /// It stopped early.
    Failed,
}

/// A parameter value of a variant.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterValue {
    /// Name in the model file.
    pub name: String,
    /// Value in SI.
    pub value: f64,
    /// SI unit.
    pub unit: String,
    /// Source text in the file: `10 deg`.
    pub text: String,
}

/// A display unit other than the SI unit.
///
/// ```
/// use kardan::results::DisplayUnit;
/// let degrees = DisplayUnit { unit: "deg".into(), size: std::f64::consts::PI / 180.0 };
/// assert!((degrees.of(std::f64::consts::PI) - 180.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DisplayUnit {
    /// Its text in the model file: `deg`.
    pub unit: String,
    /// Its size in the SI unit.
    pub size: f64,
}

impl DisplayUnit {
    /// An SI value in this unit.
    pub fn of(&self, value: f64) -> f64 {
        value / self.size
    }
}

/// A requirement of the model file with its verdict.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RequirementResult {
    /// As text: `max |driver.tau| from 1 s to 3 s < 0.01 N m`.
    pub text: String,
    /// The measured value, SI; `None` if the run ended before it could be measured.
    pub measured: Option<f64>,
    /// Its SI unit.
    pub unit: String,
    /// The unit of its bounds in the file, if that differs.
    pub display: Option<DisplayUnit>,
    /// Whether it is satisfied.
    pub passed: bool,
}

/// A figure of the model file: a number of a run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FigureResult {
    /// Its name.
    pub name: String,
    /// Its description: `gain car.yaw_rate over wheel.phi at 0.2 Hz`.
    pub text: String,
    /// Its value, SI; `None` if the run has none.
    pub value: Option<f64>,
    /// Its SI unit.
    pub unit: String,
    /// The display unit of the file, if that differs.
    pub display: Option<DisplayUnit>,
}

/// The load of a motor with limits in a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotorLoad {
    /// Name of the motor.
    pub motor: String,
    /// Unit of its torque: `N m`, of a force `N`, of a voltage `V`.
    pub unit: &'static str,
    /// The controller that commands it, if one does.
    pub controller: Option<String>,
    /// Its torque limit, N m; of a force or a voltage that limit.
    pub torque_limit: Option<f64>,
    /// Its rate limit, N m/s.
    pub rate_limit: Option<f64>,
    /// Largest torque command in the rows of the run, N m.
    pub demand: f64,
    /// When it was at its torque limit, s, in order.
    pub at_torque_limit: Vec<Span>,
    /// When it moved at its rate limit, s, in order.
    pub at_rate_limit: Vec<Span>,
}

impl MotorLoad {
    /// How long it was at its torque limit within a window, s.
    ///
    /// ```
    /// use kardan::results::{MotorLoad, Span};
    /// let spans = vec![Span { start: 1.0, end: 1.5 }, Span { start: 3.0, end: 4.0 }];
    /// let motor_load = MotorLoad { at_torque_limit: spans, ..MotorLoad::default() };
    /// assert_eq!(motor_load.seconds_at_limit(0.0, f64::INFINITY), 1.5);
    /// assert_eq!(motor_load.seconds_at_limit(1.25, 3.25), 0.5);
    /// ```
    pub fn seconds_at_limit(&self, from: f64, until: f64) -> f64 {
        length(&self.at_torque_limit, from, until)
    }

    /// How long it moved at its rate limit within a window, s.
    pub fn seconds_at_rate_limit(&self, from: f64, until: f64) -> f64 {
        length(&self.at_rate_limit, from, until)
    }

    /// Its effort as a word: a torque, a force or a voltage.
    pub fn effort(&self) -> &'static str {
        match self.unit {
            "N" => "force",
            "V" => "voltage",
            _ => "torque",
        }
    }

    /// Whether it reached one of its limits.
    pub fn at_limit(&self) -> bool {
        !self.at_torque_limit.is_empty() || !self.at_rate_limit.is_empty()
    }

    /// The message on a motor at its limits, in a run of this length (s): `wg_motor is at its torque limit of 1.3 N m
    /// for 0.42 s of 9 s, first at 1.002 s; its command reaches 23.7 N m`. `None` if it reaches no limit.
    ///
    /// ```
    /// use kardan::results::MotorLoad;
    /// assert_eq!(MotorLoad::default().describe(9.0), None);
    /// ```
    pub fn describe(&self, duration: f64) -> Option<String> {
        let (unit, what) = (self.unit, self.effort());
        let total = |spans: &[Span]| length(spans, 0.0, f64::INFINITY);
        let of = |spans: &[Span]| {
            let first = spans.first().map_or(0.0, |span| span.start);
            format!("for {} s of {duration} s, first at {} s", rounded(total(spans)), rounded(first))
        };
        let torque = self.torque_limit.filter(|_| !self.at_torque_limit.is_empty()).map(|limit| {
            let demand = if self.demand > limit * (1.0 + 1e-3) {
                format!("; its command reaches {} {unit}", rounded(self.demand))
            } else {
                String::new()
            };
            format!("is at its {what} limit of {limit} {unit} {}{demand}", of(&self.at_torque_limit))
        });
        let rate = self
            .rate_limit
            .filter(|_| !self.at_rate_limit.is_empty())
            .map(|limit| format!("moves at its rate limit of {limit} {unit}/s {}", of(&self.at_rate_limit)));
        let parts: Vec<String> = torque.into_iter().chain(rate).collect();
        (!parts.is_empty()).then(|| format!("{} {}", self.motor, parts.join("; it ")))
    }
}

/// The load of a motor of a controller in the scenario of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScenarioMotorLoad {
    /// Name of the variant.
    pub variant: String,
    /// Length of its run, s.
    pub duration: f64,
    /// The load.
    pub motor_load: MotorLoad,
}

/// To four decimals, without zeros at the end.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

fn length(spans: &[Span], from: f64, until: f64) -> f64 {
    spans.iter().map(|span| (span.end.min(until) - span.start.max(from)).max(0.0)).sum()
}

/// Statistics of the integrator.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct Effort {
    /// Accepted steps.
    pub steps: usize,
    /// Rejected steps.
    pub rejected: usize,
    /// Evaluations of the equations of motion.
    pub evaluations: usize,
    /// Located events.
    pub events: usize,
    /// The largest observed rounding error in a step, in tolerances: above 1, it does not shorten steps.
    pub rounding: f64,
    /// The integration method: it differs from the requested one if a loop has no series or derivatives.
    pub method: IntegrationMethod,
}

/// A method of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum IntegrationMethod {
    /// The Runge-Kutta method of order 8 of Dormand and Prince.
    #[default]
    Dop853,
    /// Taylor series.
    Taylor,
    /// Radau IIA, an implicit method.
    Radau,
    /// Matrix exponentials, without an error of integration.
    Exponential,
}

impl IntegrationMethod {
    /// Its word on the command line and in tables.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Dop853 => "dop853",
            Self::Taylor => "taylor",
            Self::Radau => "radau",
            Self::Exponential => "exponential",
        }
    }
}

/// The run of one variant.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// `beta-10deg`; the model's name if there are no variants.
    pub name: String,
    /// The values that make this variant.
    pub parameters: Vec<ParameterValue>,
    /// The signals.
    pub series: Series,
    /// The energy balance up to the end (or the failure).
    pub energy: Energy,
    /// Events in order of time.
    pub events: Vec<Event>,
    /// Whether the run reached its end.
    pub outcome: Outcome,
    /// The model file's requirements.
    pub requirements: Vec<RequirementResult>,
    /// Its figures.
    pub figures: Vec<FigureResult>,
    /// Notes to the reader, such as a split between parallel friction elements that is not unique.
    pub notes: Vec<String>,
    /// Warnings on its numbers, such as an estimated error of a tenth of a signal or more.
    pub warnings: Vec<String>,
    /// The load of each motor with limits.
    pub motor_loads: Vec<MotorLoad>,
    /// Statistics of the integrator.
    pub effort: Effort,
    /// Its estimated error; `None` if not requested.
    pub accuracy: Option<Accuracy>,
}

impl Run {
    /// Its duration, s: to its end, or to the time where it stopped.
    pub fn length(&self) -> f64 {
        match self.outcome {
            Outcome::Failed { time, .. } => time,
            Outcome::Completed | Outcome::Unbalanced { .. } => self.series.time.last().copied().unwrap_or_default(),
        }
    }

    /// Its verdict.
    pub fn verdict(&self) -> RunVerdict {
        match self.outcome {
            Outcome::Failed { .. } => RunVerdict::Failed,
            Outcome::Unbalanced { .. } => RunVerdict::Unbalanced,
            Outcome::Completed if self.warnings.is_empty() => RunVerdict::Completed,
            Outcome::Completed => RunVerdict::Doubtful,
        }
    }
}

/// A matrix with named rows and columns, for display.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct NamedMatrix {
    /// What it is: `reduced inertia`.
    pub title: String,
    /// SI unit of the entries, if they share one.
    pub unit: String,
    /// Row names.
    pub rows: Vec<String>,
    /// Column names.
    pub columns: Vec<String>,
    /// Entries, row by row: `values[row][column]`.
    pub values: Vec<Vec<f64>>,
}

/// A designed control law, for display.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LawSummary {
    /// Name in the model file.
    pub name: String,
    /// The law's keyword.
    pub law: String,
    /// The designed numbers.
    pub gains: Vec<NamedMatrix>,
    /// One sentence each: effective inertia, design model, relative degrees.
    pub notes: Vec<String>,
}

/// A complex number.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "[f64; 2]")]
pub struct Complex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Complex {
    /// `re + i im`.
    pub const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    /// The numbers of pairs `(re, im)`.
    pub fn list(pairs: impl IntoIterator<Item = (f64, f64)>) -> Vec<Self> {
        pairs.into_iter().map(Self::from).collect()
    }

    /// The absolute value.
    pub fn abs(self) -> f64 {
        hypot(self.re, self.im)
    }
}

impl From<(f64, f64)> for Complex {
    fn from((re, im): (f64, f64)) -> Self {
        Self { re, im }
    }
}

/// A pole, a zero or an eigenvalue, 1/s.
pub type Pole = Complex;

/// From one value to another, in order: of a time, of an angle.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "[f64; 2]")]
pub struct Span {
    /// Where it begins.
    pub start: f64,
    /// Where it ends.
    pub end: f64,
}

/// The ends of a range in which a number lies.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "[f64; 2]")]
pub struct Interval {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

/// A state that stands for a combination of others.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Definition {
    /// Its name: `z1`.
    pub state: String,
    /// What it is: `a.w + b.w`.
    pub expression: String,
}

/// An element of a model as text.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ElementSummary {
    /// `harmonic_drive`
    pub kind: String,
    /// Its name.
    pub name: String,
    /// Its values as one line.
    pub values: String,
}

/// What the model is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ModelSummary {
    /// Name.
    pub name: String,
    /// From the file.
    pub description: String,
    /// Every element.
    pub elements: Vec<ElementSummary>,
    /// Their connections.
    pub mechanism: Mechanism,
    /// Blocks with their inputs, in the order in which they compute.
    pub signals: Vec<SignalNode>,
    /// Shafts chosen as reduced coordinates.
    pub coordinates: Vec<String>,
    /// The reduced matrices at the initial position; none of more than 100 coordinates.
    pub matrices: Vec<NamedMatrix>,
    /// The designed laws.
    pub laws: Vec<LawSummary>,
    /// Poles of the linearised loop at the initial position, first variant, without Coulomb friction; none of more than 100 coordinates.
    pub closed_loop_poles: Vec<Pole>,
}

/// A plot of the model file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// File name stem and anchor: `rack-angle`.
    pub id: String,
    /// Title.
    pub title: String,
    /// A sentence beneath it.
    pub caption: String,
    /// Signals, drawn for every variant listed.
    pub signals: Vec<String>,
    /// References, drawn dashed.
    pub references: Vec<PlottedReference>,
    /// Legend texts of the signals, then of the references; by default their names.
    pub labels: Vec<String>,
    /// Names of variants; empty: all.
    pub variants: Vec<String>,
    /// The display unit of signals of one kind; `None`: the SI unit.
    pub display: Option<PlotUnit>,
    /// The drawn time span, s; without an end the whole run.
    pub window: Option<Span>,
    /// The signal on the horizontal axis; `None`: the time.
    pub over: Option<String>,
    /// Whether the horizontal axis is logarithmic.
    pub log_x: bool,
    /// Whether the vertical axis is logarithmic.
    pub log_y: bool,
    /// Whether it shows amplitudes over the frequency: [`Study::spectra`].
    pub spectrum: bool,
}

/// Amplitudes of a signal over the frequency, with a window of Hann and without the mean: a sine shows its amplitude.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spectrum {
    /// The plot that shows it, by its id.
    pub plot: String,
    /// The run.
    pub run: String,
    /// The signal.
    pub signal: String,
    /// Frequencies, Hz.
    pub frequency: Vec<f64>,
    /// As many amplitudes, in the unit of the signal, SI.
    pub amplitude: Vec<f64>,
    /// Why there is none.
    pub missing: Option<String>,
}

/// A reference of a plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlottedReference {
    /// The signal.
    pub signal: String,
    /// Whether it is drawn with the opposite sign.
    pub opposite: bool,
}

impl From<&str> for PlottedReference {
    /// `-u2` is `u2` with the opposite sign.
    fn from(text: &str) -> Self {
        let signal = text.strip_prefix('-').unwrap_or(text);
        Self { signal: signal.into(), opposite: signal.len() < text.len() }
    }
}

/// A unit for all signals of one kind in a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotUnit {
    /// The kind of signals.
    pub physical: Physical,
    /// The unit.
    pub unit: DisplayUnit,
}

/// All results of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Study {
    /// The model.
    pub model: ModelSummary,
    /// One run for each variant, in the order of the file.
    pub runs: Vec<Run>,
    /// Whether variants are labelled by their names: the file defines names, or they differ in controllers or faults too.
    pub named: bool,
    /// The plots to draw.
    pub plots: Vec<Plot>,
    /// The data of spectrum plots.
    pub spectra: Vec<Spectrum>,
    /// Warnings of the model file, in plain text.
    pub warnings: Vec<String>,
    /// Structure analysis of the model, where one was made.
    pub analysis: Option<Analysis>,
    /// The designs of the controllers, each as in the first variant that uses it.
    pub designs: Vec<Design>,
}

impl From<Complex> for [f64; 2] {
    fn from(number: Complex) -> Self {
        [number.re, number.im]
    }
}

impl From<Span> for [f64; 2] {
    fn from(span: Span) -> Self {
        [span.start, span.end]
    }
}

impl From<Interval> for [f64; 2] {
    fn from(interval: Interval) -> Self {
        [interval.lower, interval.upper]
    }
}

/// The load of a motor with limits.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "MotorStrain")]
pub(crate) struct MotorLoadView<'a> {
    /// Name of the motor.
    name: &'a str,
    /// The controller that commands it, if one does.
    controller: Option<&'a str>,
    /// Its torque limit, N m.
    torque_limit_n_m: Option<f64>,
    /// Its rate limit, N m/s.
    rate_limit_n_m_per_s: Option<f64>,
    /// Largest torque command, N m.
    max_requested_torque_n_m: f64,
    /// How long it was at its torque limit, s.
    time_at_torque_limit_s: f64,
    /// How long it moved at its rate limit, s.
    time_at_rate_limit_s: f64,
    /// When it was at its torque limit first, s.
    first_at_torque_limit_s: Option<f64>,
}

impl<'a> MotorLoadView<'a> {
    /// In a run of this length, s.
    pub(crate) fn of(motor_load: &'a MotorLoad, length: f64) -> Self {
        Self {
            name: &motor_load.motor,
            controller: motor_load.controller.as_deref(),
            torque_limit_n_m: motor_load.torque_limit,
            rate_limit_n_m_per_s: motor_load.rate_limit,
            max_requested_torque_n_m: motor_load.demand,
            time_at_torque_limit_s: motor_load.seconds_at_limit(0.0, length),
            time_at_rate_limit_s: motor_load.seconds_at_rate_limit(0.0, length),
            first_at_torque_limit_s: motor_load.at_torque_limit.first().map(|span| span.start),
        }
    }
}
