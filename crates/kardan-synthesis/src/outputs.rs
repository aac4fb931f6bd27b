//! The common parts of laws with inputs and output channels: reading their keys, the model they are for, disturbances, data.

use super::channels::{check_dynamics, compensation, once, reference};
use super::counters::{ReducedStates, counters_beside};
use super::decoupling::Compensation;
use super::matrix_parts::{exactly, is_finite, joined, stacked, window};
use super::{Plant, Reference, Request, SynthesisError};
use kardan_analysis::{LinearSystem, OutputSignal};
use kardan_math::num::{Matrix, Rational, rational_to_f64};
use kardan_math::units::Exact;
use kardan_results::Pole;
use kardan_results::signal_name::SignalName;
use kardan_schema::schema::Values;
use kardan_schema::schema::{Field, Kind};

/// The command of a law: the torque of a motor, the voltage of a source.
pub(super) const ACTUATORS: &[&str] = &["motor", "voltage_source"];

/// The motors of a law.
pub(super) const INPUTS: Field =
    Field::required("inputs", Kind::Elements(ACTUATORS), "The motors or voltage sources, at least as many as outputs.");

/// The motors of a law that takes as many as outputs.
pub(super) const AS_MANY_INPUTS: Field = Field::required(
    "inputs",
    Kind::Elements(ACTUATORS),
    "The motors or voltage sources, as many as outputs (or no outputs at all).",
);

/// The output of a channel.
pub(super) const OUTPUT: Field = Field::required(
    "output",
    Kind::Output,
    "The output: an angle `<shaft>.phi`, a speed `<shaft>.w`, or a sensor of a torque.",
);

/// The reference of a channel.
pub(super) const REFERENCE: Field =
    Field::required("reference", Kind::Name, "Name of the reference signal, set by the scenario.");

pub(super) fn inputs(values: &Values) -> Vec<String> {
    values.names("inputs").map(<[String]>::to_vec).unwrap_or_default()
}

pub(super) fn channels(values: &Values) -> impl Iterator<Item = &Values> {
    values.tables("channels").unwrap_or_default().iter()
}

pub(super) fn references(values: &Values) -> Vec<Reference> {
    channels(values).filter_map(reference).collect()
}

/// A name for the reference of an output: `ref_rk`, and `ref_rk_phi` where `rk` alone would be ambiguous.
pub(super) fn reference_name(output: &str, outputs: &[String]) -> String {
    let element = SignalName::new(output).element;
    let is_only = outputs.iter().filter(|candidate| SignalName::new(candidate).element == element).count() == 1;
    format!("ref_{}", if is_only { element.to_string() } else { output.replace('.', "_") })
}

/// The motors of channels that have one each.
pub(super) fn paired_inputs(values: &Values) -> Vec<String> {
    channels(values).map(|channel| channel.word_or_default("input").to_string()).collect()
}

/// A channel for each output with an input of its own; `None` if there are not as many of both.
pub(super) fn paired_channels<C>(
    inputs: &[String],
    outputs: &[String],
    channel: impl Fn(&str, &str, String) -> C,
) -> Option<Vec<C>> {
    let one = |(input, output): (&String, &String)| channel(output, input, reference_name(output, outputs));
    (inputs.len() == outputs.len()).then(|| inputs.iter().zip(outputs).map(one).collect())
}

/// A channel for each output.
pub(super) fn channels_for<C>(outputs: &[String], channel: impl Fn(&str, String) -> C) -> Vec<C> {
    outputs.iter().map(|output| channel(output, reference_name(output, outputs))).collect()
}

/// A law's keys, read, with its linear model.
pub(super) struct Task {
    pub inputs: Vec<String>,
    pub references: Vec<Reference>,
    pub outputs: Vec<OutputSignal>,
    /// Names of the outputs.
    pub names: Vec<String>,
    pub dynamics: Vec<Compensation>,
    /// `ẋ = A x + B u + W d`, `y = C x + D u + F d` over `[q_r; q̇_r]`.
    pub system: LinearSystem,
    /// W, F
    pub disturbance: [Matrix<Rational>; 2],
    /// Shafts of the disturbances.
    pub disturbed: Vec<String>,
    /// The states of `system` over `[q_r; q̇_r]`.
    pub projection: Matrix<Rational>,
}

impl Task {
    /// # Errors
    /// If an output or a reference is a duplicate, or two keys contradict each other.
    pub fn new(request: &Request<'_>) -> Result<Self, SynthesisError> {
        let (plant, values) = (request.plant, request.values);
        let (inputs, references) = (inputs(values), references(values));
        let outputs: Vec<OutputSignal> = channels(values)
            .map(|channel| plant.output(channel.word_or_default("output")))
            .collect::<Result<_, _>>()?;
        let names: Vec<String> = outputs.iter().map(|output| output.name.clone()).collect();
        once(names.iter().map(String::as_str), "output")?;
        once(references.iter().map(|r| r.name.as_str()), "reference")?;
        for (channel, output) in channels(values).zip(&names) {
            check_dynamics(channel, output)?;
        }
        Ok(Self {
            dynamics: channels(values).map(compensation).collect(),
            system: plant.system(&inputs, &outputs),
            disturbance: plant.torques(request.disturbances, &outputs).into(),
            disturbed: request.disturbances.iter().map(|&k| plant.coordinates()[k].clone()).collect(),
            projection: plant.over_motions(&Matrix::identity(plant.state_places().len())),
            inputs,
            references,
            outputs,
            names,
        })
    }

    /// Leaves out charges on which nothing depends, such as that through a source: they are integrators without effect, and no law controls them. Exact.
    pub fn leave_counters(&mut self, plant: &Plant) {
        let reduction = ReducedStates::of(&counters_beside(plant, &self.system, &[]), self.system.states.len());
        self.disturbance[0] = reduction.columns(&self.disturbance[0]);
        self.system = reduction.system(&self.system);
        self.projection = reduction.columns(&self.projection);
    }

    /// A gain over the remaining states, over `[q_r; q̇_r]`. Along the states that are left out it is exactly zero, which rounding does not change: sums of a
    /// few entries with the same last bit are exact.
    pub fn over_motions(&self, k: &Matrix<f64>) -> Matrix<f64> {
        let of_unit = |place: usize| self.projection.row(place).iter().filter(|x| !x.is_zero()).count() == 1;
        let combined: Vec<usize> = (0..k.columns()).filter(|place| !of_unit(*place)).collect();
        let largest = |i: usize| combined.iter().map(|j| k[(i, *j)].abs()).fold(0.0, f64::max);
        let rounded = Matrix::from_fn(k.rows(), k.columns(), |i, j| match combined.contains(&j) {
            true => to_last_bit(k[(i, j)], largest(i)),
            false => k[(i, j)],
        });
        rounded.multiply(&self.projection.to_f64())
    }

    /// Names of the references.
    pub fn reference_names(&self) -> Vec<String> {
        self.references.iter().map(|r| r.name.clone()).collect()
    }

    /// M of `u = … − M d` with which constant disturbances leave the outputs alone at rest under the gain K:
    /// `[A B; C D] [X; U] = −[W; F]`, `M = −(U + K X)`. `None` if there is no such rest.
    pub fn cancelling(&self, k: &Matrix<f64>) -> Option<Matrix<f64>> {
        let LinearSystem { a, b, c, d, .. } = &self.system;
        let (n, m, p) = (a.rows(), b.columns(), c.rows());
        if m != p {
            return None;
        }
        let all = joined([a, b], [c, d]);
        let [w, f] = &self.disturbance;
        let rest = all.solve(&stacked(&[w, f]))?.to_f64();
        let (x, u) = (window(&rest, 0..n, 0..w.columns()), window(&rest, n..n + m, 0..w.columns()));
        Some(u.plus(&k.multiply(&x)))
    }
}

/// A number to bits of which 48 make the largest one.
fn to_last_bit(x: f64, largest: f64) -> f64 {
    // Adding and subtracting twice the large number rounds off all that is below its last bit.
    let far = largest * 32.0;
    (x + far) - far
}

/// The poles that a law's keys ask for, all of which must decay.
pub(super) fn decaying_poles(values: &Values) -> Result<Vec<Pole>, SynthesisError> {
    let number = |x: &Exact| rational_to_f64(&x.to_rational());
    let poles = values.poles("poles").unwrap_or_default().iter();
    let poles: Vec<Pole> = poles.map(|(re, im)| Pole::new(number(re), number(im))).collect();
    match poles.iter().find(|pole| pole.re >= 0.0) {
        Some(pole) => {
            let message = format!("a pole with the real part {} does not decay", pole.re);
            Err(SynthesisError::whole(message, "choose poles with a negative real part"))
        }
        None => Ok(poles),
    }
}

/// The exact value of each entry.
pub(super) fn exact(matrix: &Matrix<f64>) -> Option<Matrix<Rational>> {
    is_finite(matrix).then(|| exactly(matrix))
}
