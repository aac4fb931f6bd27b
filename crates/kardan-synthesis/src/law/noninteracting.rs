//! The law `noninteracting`: partial feedback linearisation.

use std::sync::Arc;

use kardan_rt::functions::powi;
use kardan_rt::{Channel, Gain, Measurement, PositionLoop, Task};

use super::computed_torque::FRICTION_WIDTH;
use crate::channels::{effort_of, inertia_unit, once, position_of};
use crate::matrix_parts::spread;
use crate::nonlinear_law::Nonlinear;
use crate::outputs::{channels, paired_channels, paired_inputs};
use crate::zeros::check_zeros;
use kardan_results::signal_name::{Quantity, SignalName};

use crate::sampled::{entries, position_loop_in};
use crate::{
    Block, Clock, ExactLoop, Law, LawKind, LinearLaw, Observation, Plant, Reference, Request, SynthesisError,
    angle_output, effective_inertia, is_single, named, output_shaft,
};
use kardan_analysis::OutputSignal;
use kardan_math::names::backquoted;
use kardan_math::num::{Float, Matrix, Rational, Scalar, columns_of, rational_to_f64, reduced_form};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::reduce::LinearModel;
use kardan_results::{ControllerData, DataMatrix, DataNumber, Design, Feedback, ReadSignal};
use kardan_schema::schema::Values;
use kardan_schema::schema::{Keys, LawKeys, Sign, keys};

keys! {
    /// A channel of the law `noninteracting`.
    table NoninteractingChannel {
        required {
            output: Signal, "The shaft angle to control: `<shaft>.phi`.";
            input: Element(&["motor"]), "The motor of this channel; any pairing gives the same law.";
            kind: Choice(&["position", "torque"]),
                "`position`: the output follows an angle; `torque`: the reference is a torque that acts along the \
                 output (force feedback), in addition to external torques there.";
            reference: Name, "Name of the reference signal, set by the scenario.";
        }
        optional {
            natural_frequency: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) = "20 rad/s",
                "Natural frequency of a position channel.";
            damping_ratio: Number(Sign::Positive) = "0.7", "Damping ratio of a position channel.";
            load: Name, "Name of a load-torque estimate to feed forward, set by the scenario; left out: none.";
        }
    }
}

law_keys! {
    /// Partial feedback linearisation of chosen outputs by as many inputs, \[diss. 6.3.3\].
    law Noninteracting("noninteracting") {
        required {
            channels: Tables(NoninteractingChannel), "One table for each output and its input.";
        }
        optional {
            plant: Choice(&["linear", "nonlinear"]) = "linear",
                "`linear`: constant gains for the model at the operating point (`at`, else zero angles; with the values of `design`, or those of the \
                 file); `nonlinear`: the full model is evaluated at every step.";
            friction_width: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) as FRICTION_WIDTH;
        }
    }
}

/// Partial feedback linearisation of chosen outputs by as many inputs, \[diss. 6.3.3\].
pub const NONINTERACTING: LawKind = LawKind {
    keyword: Noninteracting::KEYWORD,
    summary: "Noninteracting control by partial feedback linearisation: every chosen shaft angle becomes a double \
              integrator of its own channel, independent of the other channels and of the load.",
    fields: Noninteracting::FIELDS,
    example: "\
[control.column]
law = \"noninteracting\"
design = { beta = \"0 deg\" }

[[control.column.channels]]
output = \"rk.phi\"
input = \"rk_motor\"
kind = \"position\"
natural_frequency = \"20 rad/s\"
damping_ratio = 0.7
reference = \"ref_rk\"

[[control.column.channels]]
output = \"fs.phi\"
input = \"wg_motor\"
kind = \"torque\"
reference = \"u2\"
",
    template: |inputs, outputs| {
        let channel =
            |output: &str, input: &str, reference| NoninteractingChannel::new(output, input, "position", reference);
        Some(Noninteracting::new(paired_channels(inputs, outputs, channel)?).entries())
    },
    inputs: paired_inputs,
    references,
    samples: false,
    design,
};

fn is_position(channel: &Values) -> bool {
    channel.word("kind") == Some("position")
}

fn references(values: &Values) -> Vec<Reference> {
    let mut out = Vec::new();
    for channel in channels(values) {
        let output = channel.word_or_default("output");
        let (physical, what) = if is_position(channel) {
            (position_of(output), "position reference of")
        } else {
            (effort_of(output), "torque reference along")
        };
        out.extend(Reference::of(channel, "reference", physical, format!("{what} {output}")));
        out.extend(Reference::of(channel, "load", effort_of(output), format!("load estimate along {output}")));
    }
    out
}

/// A channel to design: an output shaft and an input of the linear model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChannelDesign {
    /// Number of the output shaft.
    pub shaft: usize,
    /// Number of the input.
    pub input: usize,
}

/// The exact gains of a noninteracting law.
#[derive(Debug, Clone, PartialEq)]
pub struct NoninteractingDesign {
    /// Kx, one row per channel's input, columns: reduced coordinates, then their speeds.
    pub state_gain: Matrix<Rational>,
    /// Ku = (C H⁻¹ F)⁻¹, columns: required accelerations of the outputs.
    pub acceleration_gain: Matrix<Rational>,
    /// The decoupling matrix C H⁻¹ F.
    pub decoupling_matrix: Matrix<Rational>,
    /// Effective inertia along each output, kg m².
    pub effective_inertia: Vec<Rational>,
}

/// Designs the gains of `u = Kx x + Ku v` for which `ÿ = v + C H⁻¹ F_other τ_other` holds exactly.
///
/// With `H q̈ + D q̇ + S q = F u + …` and `y = C q`: `ÿ = C H⁻¹ (F u − D q̇ − S q) + …`, hence
/// `Ku = (C H⁻¹ F)⁻¹`, `Kx = Ku·C H⁻¹ [S D]`. For the steering system these are (6.124) and the corrected (6.130).
/// All arithmetic is rational; cost O(n³) rational operations.
///
/// ```
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_mechanics::reduce::LinearModel;
/// use kardan_synthesis::{ChannelDesign, design_noninteracting};
/// // One body of 2 kg m² with a damper of 3 N m s/rad: u = 2 v + 3 w.
/// let one = |x: i64| Matrix::from_fn(1, 1, |_, _| Rational::from(x));
/// let model = LinearModel {
///     coordinates: vec!["body".into()], inputs: vec!["motor".into()],
///     inertia: one(2), damping: one(3), stiffness: one(0), input: one(1), basis: one(1), rounded: false,
/// };
/// let channel = ChannelDesign { shaft: 0, input: 0 };
/// let design = design_noninteracting(&model, &[channel], &|_| ("body.phi".into(), "motor".into())).unwrap();
/// assert_eq!(design.acceleration_gain, one(2));
/// assert_eq!(design.state_gain.to_f64().as_slice(), [0.0, 3.0]);
/// ```
///
/// # Errors
/// [`SynthesisError`] with the exact rank if `C H⁻¹ F` is singular.
///
/// # Panics
/// If the inertia matrix is singular.
pub fn design_noninteracting(
    model: &LinearModel,
    channels: &[ChannelDesign],
    names: &dyn Fn(&ChannelDesign) -> (String, String),
) -> Result<NoninteractingDesign, SynthesisError> {
    let (r, m) = (model.inertia.rows(), channels.len());
    let shafts: Vec<usize> = channels.iter().map(|channel| channel.shaft).collect();
    let input = Matrix::from_fn(r, m, |i, j| model.input[(i, channels[j].input)].clone());
    let [on_states, decoupling_matrix] = model.accelerations(&shafts, &input);
    let Some(acceleration_gain) = decoupling_matrix.solve(&Matrix::identity(m)) else {
        let (outputs, inputs): (Vec<String>, Vec<String>) = channels.iter().map(names).unzip();
        return Err(not_decouplable(&decoupling_matrix, &outputs, &inputs));
    };
    let on_states = acceleration_gain.multiply(&on_states).scale(&Rational::NEG_ONE);
    let places: Vec<usize> = (0..r).chain(model.moving().into_iter().map(|k| r + k)).collect();
    let state_gain = spread(&on_states, &places, 2 * r);
    let effective_inertia = channels.iter().map(|channel| effective_inertia(model, channel.shaft)).collect();
    Ok(NoninteractingDesign { state_gain, acceleration_gain, decoupling_matrix, effective_inertia })
}

/// The error of a singular decoupling matrix.
fn not_decouplable(matrix: &Matrix<Rational>, outputs: &[String], inputs: &[String]) -> SynthesisError {
    let rank = reduced_form(matrix).rank();
    // Outputs whose acceleration no chosen input reaches directly: their relative degree is above two.
    let is_reached = |i: usize| !matrix.row(i).iter().all(Scalar::is_zero);
    let not_reached: Vec<String> = (0..outputs.len()).filter(|&i| !is_reached(i)).map(|i| outputs[i].clone()).collect();
    let mut message = format!(
        "the outputs {} cannot be decoupled by static state feedback with the inputs {}: their accelerations depend on \
         the inputs through a matrix of rank {rank} only",
        backquoted(outputs),
        backquoted(inputs)
    );
    let help = "choose other outputs or inputs; `kardan equations` shows what each input reaches";
    if not_reached.is_empty() {
        return SynthesisError::of(message, outputs, "not independent", help);
    }
    message += &format!(" (no chosen input reaches the acceleration of {})", backquoted(&not_reached));
    SynthesisError::of(message, &not_reached, "not reached", help)
}

/// The specification of a channel, exact.
#[derive(Debug, Clone)]
enum ChannelSpec {
    Position { natural_frequency: Rational, damping_ratio: Rational },
    Torque,
}

struct Designed {
    name: String,
    plant: Plant,
    specs: Vec<ChannelSpec>,
    inputs: Vec<String>,
    outputs: Vec<String>,
    references: Vec<Reference>,
    /// Where each channel finds its reference and its load among the references.
    reference_places: Vec<(usize, Option<usize>)>,
    output_shafts: Vec<usize>,
    design: NoninteractingDesign,
    /// Its gains as they run.
    state_gain: Matrix<f64>,
    acceleration_gain: Matrix<f64>,
    /// −M, and the shafts of its columns.
    disturbance_gain: Matrix<f64>,
    disturbed: Vec<String>,
    channels: Vec<Channel<f64>>,
}

/// The block [`kardan_rt::Noninteracting`] with the memory of one evaluation.
struct NoninteractingBlock<T> {
    /// Where each channel finds its reference and its load among the references.
    reference_places: Vec<(usize, Option<usize>)>,
    coordinate_shafts: Vec<usize>,
    output_shafts: Vec<usize>,
    state_gain: Vec<T>,
    acceleration_gain: Vec<T>,
    /// −M, row by row.
    disturbance_gain: Vec<T>,
    channels: Vec<Channel<T>>,
    state: Vec<T>,
    positions: Vec<T>,
    speeds: Vec<T>,
    references: Vec<T>,
    loads: Vec<T>,
    accelerations: Vec<T>,
    disturbances: Vec<T>,
    work: Vec<T>,
}

impl<T: Float> Block for NoninteractingBlock<T> {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        let Observation { angles, speeds, references, .. } = observation;
        let r = self.coordinate_shafts.len();
        for (k, &shaft) in self.coordinate_shafts.iter().enumerate() {
            self.state[k] = T::from_f64(angles[shaft]);
            self.state[r + k] = T::from_f64(speeds[shaft]);
        }
        for (k, &shaft) in self.output_shafts.iter().enumerate() {
            self.positions[k] = T::from_f64(angles[shaft]);
            self.speeds[k] = T::from_f64(speeds[shaft]);
            self.references[k] = T::from_f64(references[self.reference_places[k].0]);
            self.loads[k] = self.reference_places[k].1.map_or(T::ZERO, |load| T::from_f64(references[load]));
        }
        let (Some(state_gain), Some(acceleration_gain)) =
            (Gain::new(&self.state_gain, 2 * r), Gain::new(&self.acceleration_gain, self.channels.len()))
        else {
            unreachable!("gain matrices are made of whole rows by the design");
        };
        let law = kardan_rt::Noninteracting { state_gain, acceleration_gain, channels: &self.channels };
        let measured = Measurement {
            state: &self.state,
            positions: &self.positions,
            speeds: &self.speeds,
            references: &self.references,
            loads: &self.loads,
        };
        let mut found = law.torques(measured, &mut self.accelerations, &mut self.work);
        if let Some(cancel) = Gain::new(&self.disturbance_gain, self.disturbances.len()) {
            T::narrow(observation.disturbances, &mut self.disturbances);
            found = found && cancel.add_to(&self.disturbances, &mut self.work);
        }
        T::widen(&self.work, out);
        found
    }
}

/// Channels, their inputs and their outputs.
type ChosenChannels = (Vec<ChannelDesign>, Vec<String>, Vec<String>);

/// The channels with the names of their inputs and outputs.
fn chosen_channels(request: &Request<'_>) -> Result<ChosenChannels, SynthesisError> {
    let model = &request.plant.linear;
    let mut designs = Vec::new();
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    for channel in channels(request.values) {
        let output = channel.word_or_default("output").to_string();
        let input = channel.word_or_default("input").to_string();
        let shaft = output_shaft(&output, request.plant.coordinates())?;
        request.plant.check_accelerates(shaft, &output)?;
        let number = model.inputs.iter().position(|name| *name == input).expect("the model file names an input");
        for (names, name, what) in [(&inputs, &input, "input"), (&outputs, &output, "output")] {
            if names.contains(name) {
                return Err(SynthesisError::duplicate(name, what));
            }
        }
        inputs.push(input);
        outputs.push(output);
        designs.push(ChannelDesign { shaft, input: number });
    }
    Ok((designs, inputs, outputs))
}

/// The block that computes a channel, and its specification.
fn channel_block(channel: &Values, inverse_inertia: f64) -> (Channel<f64>, ChannelSpec) {
    if !is_position(channel) {
        return (Channel::Torque { inverse_inertia }, ChannelSpec::Torque);
    }
    let exact = |key, otherwise| channel.exact(key).map_or(otherwise, Exact::to_rational);
    let natural_frequency = exact("natural_frequency", Rational::from(20));
    let damping_ratio = exact("damping_ratio", Rational::from_parts(7.into(), 10u8.into()));
    let position_loop = PositionLoop {
        natural_frequency: rational_to_f64(&natural_frequency),
        damping_ratio: rational_to_f64(&damping_ratio),
    };
    let spec = ChannelSpec::Position { natural_frequency, damping_ratio };
    (Channel::Position { position_loop, inverse_inertia }, spec)
}

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let model = &request.plant.linear;
    let (designs, inputs, outputs) = chosen_channels(request)?;
    let names = |channel: &ChannelDesign| {
        let domain = request.plant.reduced.equations.domain(channel.shaft);
        (domain.motion()[0].of(&request.plant.coordinates()[channel.shaft]), model.inputs[channel.input].clone())
    };
    let design = design_noninteracting(model, &designs, &names)?;
    once((NONINTERACTING.references)(request.values).iter().map(|r| r.name.as_str()), "reference")?;
    let signals: Vec<OutputSignal> = outputs.iter().map(|output| angle_output(output)).collect();
    check_zeros(&request.plant.system(&inputs, &signals), &outputs)?;
    let references = references(request.values);
    let find = |name: Option<&str>| name.and_then(|name| references.iter().position(|r| r.name == name));
    let mut reference_places = Vec::new();
    let mut blocks = Vec::new();
    let mut specs = Vec::new();
    for (channel, inertia) in channels(request.values).zip(&design.effective_inertia) {
        let inverse_inertia = 1.0 / rational_to_f64(inertia);
        reference_places.push((find(channel.word("reference")).unwrap_or(0), find(channel.word("load"))));
        let (block, spec) = channel_block(channel, inverse_inertia);
        blocks.push(block);
        specs.push(spec);
    }
    let nonlinear = request.values.word("plant") == Some("nonlinear");
    if request.values.has("friction_width") && !nonlinear {
        return Err(SynthesisError::at(
            "`friction_width` needs the full model: `plant = \"nonlinear\"`",
            "friction_width",
            "this key",
            "add `plant = \"nonlinear\"`, or remove `friction_width`",
        ));
    }
    let disturbance_gain = disturbance_gain(request, &design, &designs, &specs).scale(&Rational::NEG_ONE).to_f64();
    let (shafts, disturbed) = (request.plant.coordinates(), request.disturbances.iter());
    let designed = Designed {
        name: request.name.to_string(),
        plant: request.plant.clone(),
        specs,
        inputs,
        outputs,
        references,
        reference_places,
        output_shafts: designs.iter().map(|channel| channel.shaft).collect(),
        state_gain: design.state_gain.to_f64(),
        acceleration_gain: design.acceleration_gain.to_f64(),
        design,
        disturbance_gain,
        disturbed: disturbed.map(|&k| shafts[k].clone()).collect(),
        channels: blocks,
    };
    if !nonlinear {
        return Ok(Arc::new(designed));
    }
    if designed.reference_places.iter().any(|(_, load)| load.is_some()) {
        return Err(SynthesisError::at(
            "`load` is for constant gains; with `plant = \"nonlinear\"` an observer estimates the loads",
            "load",
            "this key",
            "remove `load`, and add an observer",
        ));
    }
    let tasks = designed.tasks();
    let references_of_channels = designed.reference_places.iter().map(|(reference, _)| *reference).collect();
    let friction_width = request.values.number("friction_width");
    Ok(Arc::new(Nonlinear::new(request, Arc::new(designed), tasks, &[], references_of_channels, friction_width)?))
}

/// M of `u = … − M d`: the compensation of torques on shafts, `Ku C H⁻¹ Kᵀ d`. A torque on the shaft of a torque
/// channel is what the channel is for, and is not cancelled.
fn disturbance_gain(
    request: &Request<'_>,
    design: &NoninteractingDesign,
    channels: &[ChannelDesign],
    specs: &[ChannelSpec],
) -> Matrix<Rational> {
    let model = &request.plant.linear;
    let on_coordinates = Matrix::from_fn(model.inertia.rows(), request.disturbances.len(), |i, j| {
        let shaft = request.disturbances[j];
        let mut all = channels.iter().zip(specs);
        if all.any(|(channel, spec)| channel.shaft == shaft && matches!(spec, ChannelSpec::Torque)) {
            return Rational::ZERO;
        }
        model.basis[(shaft, i)].clone()
    });
    let shafts: Vec<usize> = channels.iter().map(|channel| channel.shaft).collect();
    let [_, accelerations] = model.accelerations(&shafts, &on_coordinates);
    design.acceleration_gain.multiply(&accelerations)
}

impl Designed {
    /// The same as tasks of the full model.
    fn tasks(&self) -> Vec<Task<f64>> {
        let task = |(channel, &shaft): (&Channel<f64>, &usize)| match channel {
            Channel::Position { position_loop, .. } => Task::Position { shaft, position_loop: *position_loop },
            Channel::Torque { .. } => Task::Torque { shaft },
        };
        self.channels.iter().zip(&self.output_shafts).map(task).collect()
    }

    /// The block in a precision.
    fn block_of<T: Float>(&self) -> NoninteractingBlock<T> {
        let (m, r) = (self.inputs.len(), self.plant.reduced.coordinates.len());
        let zeros = |count: usize| vec![T::ZERO; count];
        let channel = |channel: &Channel<f64>| match channel {
            Channel::Position { position_loop, inverse_inertia } => Channel::Position {
                position_loop: position_loop_in(position_loop),
                inverse_inertia: T::from_f64(*inverse_inertia),
            },
            Channel::Torque { inverse_inertia } => Channel::Torque { inverse_inertia: T::from_f64(*inverse_inertia) },
        };
        NoninteractingBlock {
            reference_places: self.reference_places.clone(),
            coordinate_shafts: self.plant.reduced.coordinates.clone(),
            output_shafts: self.output_shafts.clone(),
            state_gain: entries(&self.state_gain),
            acceleration_gain: entries(&self.acceleration_gain),
            disturbance_gain: entries(&self.disturbance_gain),
            channels: self.channels.iter().map(channel).collect(),
            state: zeros(2 * r),
            positions: zeros(m),
            speeds: zeros(m),
            references: zeros(m),
            loads: zeros(m),
            accelerations: zeros(m),
            disturbances: zeros(self.disturbed.len()),
            work: zeros(m),
        }
    }

    /// The data of the block [`kardan_rt::Noninteracting`]; a torque channel has no frequency.
    fn data(&self, state: &[String]) -> ControllerData {
        let read = |name: &String| ReadSignal::new(name, SignalName::new(name).unit());
        let mut reads: Vec<ReadSignal> = state.iter().map(read).collect();
        for output in &self.outputs {
            let speed = SignalName::new(output).rate();
            reads.extend([output, &speed].map(read));
        }
        for (reference, load) in &self.reference_places {
            for number in std::iter::once(reference).chain(load) {
                let reference = &self.references[*number];
                reads.push(ReadSignal::new(&reference.name, reference.physical.unit()));
            }
        }
        reads.extend(ReadSignal::of_each(Quantity::Disturbance, &self.disturbed));
        let mut numbers = Vec::new();
        for (output, channel) in self.outputs.iter().zip(&self.channels) {
            let mut add = |what: &str, value: f64| numbers.push(DataNumber::new(format!("{output} {what}"), value));
            match channel {
                Channel::Position { position_loop, inverse_inertia } => {
                    add("natural_frequency", position_loop.natural_frequency);
                    add("damping_ratio", position_loop.damping_ratio);
                    add("inverse_inertia", *inverse_inertia);
                }
                Channel::Torque { inverse_inertia } => add("inverse_inertia", *inverse_inertia),
            }
        }
        let NoninteractingDesign { state_gain, acceleration_gain, .. } = &self.design;
        ControllerData {
            block: "Noninteracting".into(),
            reads,
            writes: self.inputs.clone(),
            matrices: vec![
                DataMatrix::new("state_gain", state_gain.to_rows()),
                DataMatrix::new("acceleration_gain", acceleration_gain.to_rows()),
                DataMatrix::new("disturbance_gain", self.disturbance_gain.to_rows()),
            ],
            numbers,
            ..ControllerData::default()
        }
    }
}

impl Law for Designed {
    fn inputs(&self) -> &[String] {
        &self.inputs
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        Some(if is_single(clock) { Box::new(self.block_of::<f32>()) } else { Box::new(self.block_of::<f64>()) })
    }

    /// Gains without states.
    fn linear_sampled(&self, _: Clock) -> Option<LinearLaw> {
        Some(self.linear())
    }

    fn linear(&self) -> LinearLaw {
        let (m, shafts) = (self.inputs.len(), self.plant.coordinates().len());
        let coordinates = &self.plant.reduced.coordinates;
        let mut on_angles = Matrix::zeros(m, shafts);
        let mut on_speeds = Matrix::zeros(m, shafts);
        let mut on_references = Matrix::zeros(m, self.references.len());
        for i in 0..m {
            for (k, (channel, (reference, load))) in self.channels.iter().zip(&self.reference_places).enumerate() {
                let gain = self.acceleration_gain[(i, k)];
                let (per_reference, per_load) = match channel {
                    Channel::Position { position_loop, inverse_inertia } => {
                        (powi(position_loop.natural_frequency, 2), *inverse_inertia)
                    }
                    Channel::Torque { inverse_inertia } => (*inverse_inertia, *inverse_inertia),
                };
                on_references[(i, *reference)] += gain * per_reference;
                if let Some(load) = load {
                    on_references[(i, *load)] -= gain * per_load;
                }
            }
            for (k, &shaft) in coordinates.iter().enumerate() {
                on_angles[(i, shaft)] += self.state_gain[(i, k)];
                on_speeds[(i, shaft)] += self.state_gain[(i, coordinates.len() + k)];
            }
            for (k, &shaft) in self.output_shafts.iter().enumerate() {
                if let Channel::Position { position_loop, .. } = &self.channels[k] {
                    let gain = self.acceleration_gain[(i, k)];
                    let omega = position_loop.natural_frequency;
                    on_angles[(i, shaft)] -= gain * omega * omega;
                    on_speeds[(i, shaft)] -= gain * 2.0 * position_loop.damping_ratio * omega;
                }
            }
        }
        let on_disturbances = self.disturbance_gain.clone();
        LinearLaw {
            on_disturbances,
            disturbances: Matrix::zeros(0, self.disturbed.len()),
            ..LinearLaw::gains(on_angles, on_speeds, on_references)
        }
    }

    fn exact(&self) -> Option<ExactLoop> {
        let (m, states) = (self.inputs.len(), 2 * self.plant.linear.coordinates.len());
        let outputs: Vec<OutputSignal> = self.outputs.iter().map(|output| angle_output(output)).collect();
        let system = self.plant.system(&self.inputs, &outputs);
        // v = Lv r − Kv x, channel by channel.
        let mut feedback = Matrix::<Rational>::zeros(m, states);
        let mut reference = Matrix::<Rational>::zeros(m, m);
        for (k, spec) in self.specs.iter().enumerate() {
            match spec {
                ChannelSpec::Position { natural_frequency, damping_ratio } => {
                    let stiffness = natural_frequency.times(natural_frequency);
                    let damping = Rational::from(2).times(damping_ratio).times(natural_frequency);
                    let direction = self.plant.linear.direction(self.output_shafts[k]);
                    for (j, x) in direction.row(0).iter().enumerate() {
                        feedback[(k, j)] = stiffness.times(x);
                        feedback[(k, states / 2 + j)] = damping.times(x);
                    }
                    reference[(k, k)] = stiffness;
                }
                ChannelSpec::Torque => reference[(k, k)] = Rational::ONE.over(&self.design.effective_inertia[k]),
            }
        }
        let NoninteractingDesign { state_gain, acceleration_gain, .. } = &self.design;
        let references: Vec<Reference> =
            self.reference_places.iter().map(|(reference, _)| self.references[*reference].clone()).collect();
        let k = acceleration_gain.multiply(&feedback).minus(state_gain);
        let k = columns_of(&k, &self.plant.state_places());
        let l = acceleration_gain.multiply(&reference);
        Some(ExactLoop::feedback(system.clone(), system, [&k, &l], &references))
    }

    fn describe(&self) -> Design {
        let state = self.plant.states();
        let accelerations: Vec<String> = self.outputs.iter().map(|output| format!("{output}''")).collect();
        let notes = self.outputs.iter().zip(&self.design.effective_inertia).map(|(output, inertia)| {
            format!(
                "Relative degree of {output}: 2; effective inertia along it: {:.9} {}.",
                rational_to_f64(inertia),
                inertia_unit(output)
            )
        });
        let NoninteractingDesign { state_gain, acceleration_gain, decoupling_matrix, .. } = &self.design;
        Design {
            controller: self.name.clone(),
            law: NONINTERACTING.keyword.into(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            relative_degrees: vec![Some(2); self.outputs.len()],
            feedback: Some(Feedback::Static),
            gains: vec![
                named(("Kx", "state gain Kx", "N m/rad, N m s/rad"), &self.inputs, &state, state_gain),
                named(("Ku", "acceleration gain Ku", "N m s^2/rad"), &self.inputs, &accelerations, acceleration_gain),
            ],
            decoupling_matrix: named(
                ("decoupling_matrix", "decoupling matrix", "rad/(N m s^2)"),
                &accelerations,
                &self.inputs,
                decoupling_matrix,
            ),
            controller_data: self.data(&state),
            states: state,
            notes: notes.collect(),
            ..Design::default()
        }
    }
}
