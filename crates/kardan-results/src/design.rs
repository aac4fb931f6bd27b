//! The result of a design: chapter 6 of the source for one controller, proven and measured.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::serial::{self, by_name};
use super::{
    Complex, Definition, ElementShare, Exploration, LoopAlongPath, LoopResponses, Margins, Mechanism, MotorLoadView,
    NamedMatrix, OppositeSide, Pole, Robustness, ScenarioMotorLoad, ShapePart, StabilityVerdict,
};
use crate::signal_name::Quantity;

/// A matrix that is known exactly, with the same numbers as `f64`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ExactMatrix {
    /// Short name, a key of the JSON object: `K`, `L`, `Kx`, `observer_gain`.
    #[serde(skip)]
    pub name: String,
    /// Its description: `state gain, u = -K x + L r`.
    pub title: String,
    /// SI unit of the entries, if they share one.
    pub unit: String,
    /// Row names.
    pub rows: Vec<String>,
    /// Column names.
    pub columns: Vec<String>,
    /// Entries as the nearest `f64`, row by row.
    pub values: Vec<Vec<f64>>,
    /// Entries as fractions (`-51/50`), where they are exact; `None` for results of floating point (LQR, Kalman).
    pub exact: Option<Vec<Vec<String>>>,
}

/// All results of `kardan design` for one controller. Parts that do not apply to its law are empty or `None`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Design {
    /// Name of the model.
    pub model: String,
    /// From the file.
    pub description: String,
    /// Parts of the model and their connections.
    #[serde(skip)]
    pub mechanism: Mechanism,
    /// Variant of the design; the model's name if there are none.
    pub variant: String,
    /// Name of the controller in the file; `design` for one from the command line.
    pub controller: String,
    /// Keyword of its law.
    pub law: String,
    /// Names of the other controllers of the file, which are in the loop too.
    pub other_controllers: Vec<String>,
    /// The design model as text: `linear, at the initial position, beta = 0 deg`.
    pub design_model: String,
    /// Constraints whose rows are rounded numbers at the operating point: the proofs are valid for these numbers.
    #[serde(rename = "rounded_constraints")]
    pub rounded: Vec<String>,
    /// States of the design model after the reduction.
    pub states: Vec<String>,
    /// Commanded inputs.
    pub inputs: Vec<String>,
    /// Controlled outputs.
    pub outputs: Vec<String>,
    /// States that stand for combinations of coordinates, such as `wg.phi - 51 rk.phi + 50 fs.phi`; a combination that is short
    /// enough to be a name itself is not listed.
    pub definitions: Vec<Definition>,
    /// Unobservable part of the model: eigenvalues that the reduction removed.
    #[serde(rename = "hidden_poles")]
    pub hidden: Vec<Pole>,
    /// Relative degree of each output: derivatives until an input appears (6.64). `None`: no input affects it.
    pub relative_degrees: Vec<Option<usize>>,
    /// G (6.66): outputs × inputs.
    pub decoupling_matrix: ExactMatrix,
    /// Whether and how the outputs can be decoupled.
    pub decouplability: Decouplability,
    /// The decoupling by this law, which need not be the best possible; `None`: it does not decouple, or there is no statement.
    pub feedback: Option<Feedback>,
    /// The gains by name.
    #[serde(serialize_with = "gains")]
    #[schemars(with = "BTreeMap<String, ExactMatrix>")]
    pub gains: Vec<ExactMatrix>,
    /// The canonically decoupled form (6.73)-(6.81).
    pub canonical: Option<Canonical>,
    /// The behaviour of each channel.
    pub channels: Vec<ChannelResult>,
    /// Poles of the linear loop with all controllers of the file, at the design point, 1/s, by size.
    pub closed_loop_poles: Vec<Pole>,
    /// Whether these are roots of an exact polynomial with proven signs; else they are eigenvalues in floating point.
    #[serde(rename = "closed_loop_poles_exact")]
    pub exact_poles: bool,
    /// Charges that are integrators without effect; no law controls them. Each is a pole exactly at zero that is not
    /// listed.
    pub integrals_without_effect: Vec<String>,
    /// The unobservable part of the decoupled loop.
    #[serde(serialize_with = "zero_dynamics")]
    #[schemars(with = "ZerosView")]
    pub zero_dynamics: ZeroDynamics,
    /// Whether the law inverts the plant, so that its zeros become hidden poles.
    pub cancels_zeros: bool,
    /// The observer.
    pub observer: Option<ObserverResult>,
    /// The transfer matrix of the designed linear loop, exact: one entry per output and reference.
    pub transfer: Vec<TransferEntry>,
    /// Whether every entry of `transfer` that belongs to another channel is exactly zero; `None` if decoupling was not requested.
    pub decoupled: Option<bool>,
    /// Whether every entry between different blocks is exactly zero, for a law that decouples blocks of outputs.
    pub blocks_decoupled: Option<bool>,
    /// Effects of a step of each reference on the outputs of the other channels in the nonlinear simulation.
    pub cross_coupling: Vec<CrossCoupling>,
    /// Margins with sampling, delay, lag and limits; `None` if not requested.
    pub margins: Option<Margins>,
    /// The same on the opposite side of a kink at its operating point; `None` if there is no kink.
    pub opposite_side: Option<OppositeSide>,
    /// Frequency and step responses of the loop; `None` if not requested, or with several sample times.
    pub responses: Option<LoopResponses>,
    /// Motor loads in the scenario of the file, if it was run.
    #[serde(serialize_with = "motor_loads")]
    #[schemars(with = "Vec<ScenarioView>")]
    pub motor_loads: Vec<ScenarioMotorLoad>,
    /// The loop with the parameters of the variant, at its joint positions; `None` if it is the linear loop of the design.
    pub loop_along_path: Option<LoopAlongPath>,
    /// Alternative designs; `None` if not requested.
    pub exploration: Option<Exploration>,
    /// The loop over a box of plants; `None` if not requested.
    pub robustness: Option<Robustness>,
    /// Whether the outputs are flat (Theorem 6.4).
    pub flatness: Option<Flatness>,
    /// The controller data for firmware.
    pub controller_data: ControllerData,
    /// The observer that runs before it.
    pub observer_data: Option<ControllerData>,
    /// Warnings: cancellations of lightly damped or unstable poles, torques beyond limits.
    pub warnings: Vec<String>,
    /// Notes to the reader: choices by default, omitted parts.
    pub notes: Vec<String>,
    /// Of a design that ended early: why, and which parts are missing. Missing parts are empty, without a statement on the loop.
    #[serde(flatten, serialize_with = "serial::ending")]
    #[schemars(with = "serial::Ending")]
    pub incomplete_reason: Option<String>,
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

impl Design {
    /// The law with its numbers, for the summary of a run.
    pub fn summary(&self) -> LawSummary {
        let matrix = |m: &ExactMatrix| NamedMatrix {
            title: m.title.clone(),
            unit: m.unit.clone(),
            rows: m.rows.clone(),
            columns: m.columns.clone(),
            values: m.values.clone(),
        };
        let decoupling = Some(&self.decoupling_matrix).filter(|matrix| !matrix.rows.is_empty());
        LawSummary {
            name: self.controller.clone(),
            law: self.law.clone(),
            gains: self.gains.iter().chain(decoupling).map(matrix).collect(),
            notes: self.notes.clone(),
        }
    }
}

/// How outputs can be decoupled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Feedback {
    /// By static state feedback: every output its own channel.
    #[default]
    Static,
    /// By static state feedback, in blocks of outputs only.
    Block,
    /// By dynamic state feedback: integrators before some inputs.
    Dynamic,
    /// Impossible: the outputs depend on each other, or no input affects one of them.
    Impossible,
}

/// The verdict on decoupling, decided exactly.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Decouplability {
    /// Exact rank of G.
    pub rank: usize,
    /// Exact rank of the transfer matrix over the rational functions.
    pub normal_rank: usize,
    /// The best possible decoupling.
    pub possible: Feedback,
    /// Names of the finest blocks of outputs that static feedback can decouple; empty if there are none.
    pub blocks: Vec<Vec<String>>,
    /// Integrators that a dynamic extension puts before inputs.
    pub integrators: Vec<Integrators>,
    /// The proof of impossibility or the reason why static feedback fails, in terms of shafts; one sentence each.
    pub reasons: Vec<String>,
}

/// Integrators before an input.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Integrators {
    /// The input, or a combination of inputs as text.
    pub input: String,
    /// How many.
    pub count: usize,
}

/// The canonically decoupled form of the integrator-decoupled system \[diss. (6.73)-(6.81)\].
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Canonical {
    /// p_1 … p_m, p_{m+1} (no channel's own), p_{m+2} (not controllable).
    pub sizes: Vec<usize>,
    /// Rank of the controllability matrix L_i of all inputs but the i-th (6.82).
    pub ranks: Vec<usize>,
    /// Q (6.79).
    #[serde(rename = "Q")]
    pub transformation: ExactMatrix,
    /// A in the new coordinates.
    #[serde(rename = "A")]
    pub a: ExactMatrix,
    /// B in the new coordinates.
    #[serde(rename = "B")]
    pub b: ExactMatrix,
    /// C in the new coordinates.
    #[serde(rename = "C")]
    pub c: ExactMatrix,
}

/// One channel of a decoupled loop.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ChannelResult {
    /// The output.
    pub output: String,
    /// Its reference.
    pub reference: String,
    /// `position`, `torque`, …
    pub kind: String,
    /// The transfer function as text: `400/(s^2 + 28 s + 400)`.
    pub transfer: String,
    /// Poles of the channel, 1/s.
    pub poles: Vec<Pole>,
}

/// The zero dynamics of the decoupled loop: the motion while all outputs are zero.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ZeroDynamics {
    /// The exact polynomial: `11 s^2 + 2060 s + 10000000`; `1` if there is none.
    pub polynomial: String,
    /// Its modes, by size.
    pub modes: Vec<ZeroMode>,
    /// Whether they decay (decided exactly).
    pub stability: StabilityVerdict,
}

/// A pole of the zero dynamics: an invariant zero of the plant, which the law cancels.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ZeroMode {
    /// 1/s; the one with imaginary part ≥ 0 of a pair.
    pub pole: Pole,
    /// |λ|, rad/s.
    #[serde(rename = "natural_frequency_rad_per_s")]
    pub natural_frequency: f64,
    /// −Re λ/|λ|; 1 for λ = 0.
    pub damping_ratio: f64,
    /// Its mode shape: `cj 1, wg -51`.
    pub shape: Vec<ShapePart>,
    /// Share of the energy stored during the motion, by element; adds up to one.
    pub stored: Vec<ElementShare>,
    /// Shares of the loss by element.
    pub dissipated: Vec<ElementShare>,
    /// Set if the cancellation is dangerous: unstable, on the axis, or lightly damped.
    pub warning: Option<String>,
}

/// A designed observer.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ObserverResult {
    /// `poles` or `kalman`.
    pub method: String,
    /// Signals that it measures.
    pub sensors: Vec<String>,
    /// Its states: those of the plant, then the disturbance torques.
    pub states: Vec<String>,
    /// Shafts along which it estimates a torque.
    pub disturbances: Vec<String>,
    /// Poles of its error, 1/s.
    pub poles: Vec<Pole>,
    /// Its gain L, states × sensors.
    pub gain: ExactMatrix,
    /// Distinguishable disturbances with these sensors: one sentence each.
    pub distinguishable: Vec<String>,
}

/// One entry of an exact transfer matrix.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct TransferEntry {
    /// The output.
    pub output: String,
    /// The reference.
    pub reference: String,
    /// Coefficients of 1, s, s², …; empty: exactly zero.
    #[serde(flatten, serialize_with = "numerator")]
    #[schemars(with = "Numerator")]
    pub numerator: Vec<String>,
    /// Coefficients of 1, s, s², …
    pub denominator: Vec<String>,
}

/// The numerator of an entry.
#[derive(Serialize, JsonSchema)]
struct Numerator<'a> {
    /// Whether it is exactly zero.
    zero: bool,
    /// Coefficients of 1, s, s², …
    numerator: &'a [String],
}

fn numerator<S: Serializer>(numerator: &[String], to: S) -> Result<S::Ok, S::Error> {
    Numerator { zero: numerator.is_empty(), numerator }.serialize(to)
}

/// The effect of a step of one reference on another output, or on its own.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct CrossCoupling {
    /// The reference that steps.
    pub reference: String,
    /// Size of the step, SI.
    pub step: f64,
    /// Unit of the step.
    pub step_unit: String,
    /// The observed output.
    pub output: String,
    /// Unit of the output.
    pub unit: String,
    /// Whether the output belongs to the same channel.
    pub same_channel: bool,
    /// Largest deviation from the start, SI; `None` if the output has no signal.
    pub peak: Option<f64>,
    /// Root mean square of the deviation over the window, SI; `None` if the output has no signal.
    pub rms: Option<f64>,
    /// Length of the window, s.
    #[serde(rename = "window_s")]
    pub window: f64,
    /// Why there is no number (the run failed), if so.
    pub failure: Option<String>,
}

/// Whether outputs are flat, and how states and inputs follow from them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Flatness {
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Whether all variables are functions of the outputs and finitely many derivatives (no invariant zeros).
    pub flat: bool,
    /// The polynomial of the filter that remains otherwise: `s + 5000`.
    pub remainder: String,
    /// Its roots, 1/s.
    pub poles: Vec<Pole>,
    /// Highest required derivative of each output.
    pub derivatives: Vec<usize>,
    /// One sentence.
    pub statement: String,
}

/// A designed controller as the data of a `kardan-rt` block.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ControllerData {
    /// The block: `StateSpace`, `Noninteracting`, …
    pub block: String,
    /// Its input signals, in order.
    pub reads: Vec<ReadSignal>,
    /// Plant inputs that it commands.
    pub writes: Vec<String>,
    /// Sample time, s; `None`: continuous time.
    #[serde(rename = "sample_time_s")]
    pub sample_time: Option<f64>,
    /// Whether it computes in single precision.
    #[serde(rename = "precision")]
    #[serde(serialize_with = "precision")]
    #[schemars(with = "Precision")]
    pub single: bool,
    /// Its matrices.
    #[serde(serialize_with = "matrices")]
    #[schemars(with = "BTreeMap<String, Vec<Vec<f64>>>")]
    pub matrices: Vec<DataMatrix>,
    /// Its numbers.
    #[serde(serialize_with = "numbers")]
    #[schemars(with = "BTreeMap<String, f64>")]
    pub numbers: Vec<DataNumber>,
}

/// An input signal of a controller.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ReadSignal {
    /// Its name.
    pub signal: String,
    /// SI unit.
    pub unit: String,
}

impl ReadSignal {
    /// This signal of each element.
    pub fn of_each<'a>(quantity: Quantity, elements: impl IntoIterator<Item = &'a String>) -> Vec<Self> {
        elements.into_iter().map(|element| Self::new(quantity.of(element), quantity.unit())).collect()
    }

    /// A signal with its unit.
    pub fn new(signal: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { signal: signal.into(), unit: unit.into() }
    }
}

/// A matrix of a controller.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DataMatrix {
    /// Its name.
    pub name: String,
    /// Its entries, row by row.
    pub values: Vec<Vec<f64>>,
}

impl DataMatrix {
    /// A matrix with its name.
    pub fn new(name: impl Into<String>, values: Vec<Vec<f64>>) -> Self {
        Self { name: name.into(), values }
    }
}

/// A number of a controller or of a plan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DataNumber {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
}

impl DataNumber {
    /// A number with its name.
    pub fn new(name: impl Into<String>, value: f64) -> Self {
        Self { name: name.into(), value }
    }
}

fn gains<S: Serializer>(all: &[ExactMatrix], to: S) -> Result<S::Ok, S::Error> {
    by_name(all.iter().map(|one| (one.name.as_str(), one)), to)
}

fn matrices<S: Serializer>(all: &[DataMatrix], to: S) -> Result<S::Ok, S::Error> {
    by_name(all.iter().map(|one| (one.name.as_str(), &one.values)), to)
}

pub(super) fn numbers<S: Serializer>(all: &[DataNumber], to: S) -> Result<S::Ok, S::Error> {
    by_name(all.iter().map(|one| (one.name.as_str(), one.value)), to)
}

/// Precision of a block.
#[derive(Serialize, JsonSchema)]
enum Precision {
    #[serde(rename = "f64")]
    Double,
    #[serde(rename = "f32")]
    Single,
}

fn precision<S: Serializer>(single: &bool, to: S) -> Result<S::Ok, S::Error> {
    if *single { Precision::Single } else { Precision::Double }.serialize(to)
}

/// The load of a motor in the scenario of a file.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "ScenarioStrain")]
struct ScenarioView<'a> {
    /// Name of the variant.
    variant: &'a str,
    /// Length of its run, s.
    duration_s: f64,
    /// The load.
    motor: MotorLoadView<'a>,
}

fn motor_loads<S: Serializer>(all: &[ScenarioMotorLoad], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(all.iter().map(|one| ScenarioView {
        variant: &one.variant,
        duration_s: one.duration,
        motor: MotorLoadView::of(&one.motor_load, one.duration),
    }))
}

/// Zero dynamics: the motion while all outputs are zero.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "ZeroDynamics")]
struct ZerosView<'a> {
    /// The exact polynomial; `1` if there is none.
    polynomial: &'a str,
    /// Its roots, both of a conjugate pair, 1/s.
    poles: Vec<Complex>,
    /// Whether they decay, decided exactly; not decided if not requested.
    #[serde(flatten)]
    stability: StabilityVerdict,
    /// Its modes, by size; of a pair the upper one.
    modes: &'a [ZeroMode],
}

fn zero_dynamics<S: Serializer>(found: &ZeroDynamics, to: S) -> Result<S::Ok, S::Error> {
    let both = |mode: &ZeroMode| {
        let mirrored = Complex { im: -mode.pole.im, ..mode.pole };
        std::iter::once(mode.pole).chain((mode.pole.im != 0.0).then_some(mirrored))
    };
    let is_analysed = !(found.polynomial.is_empty() && found.modes.is_empty());
    let view = ZerosView {
        polynomial: &found.polynomial,
        poles: found.modes.iter().flat_map(both).collect(),
        stability: if is_analysed {
            found.stability.clone()
        } else {
            StabilityVerdict::undecided("it was not requested")
        },
        modes: &found.modes,
    };
    view.serialize(to)
}
