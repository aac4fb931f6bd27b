//! The law `position_loop` on one input.

use std::sync::Arc;

use crate::channels::{effort_of, inertia_unit, position_of};
use crate::sampled::position_loop_in;
use crate::{
    Block, Clock, Law, LawKind, LinearLaw, Observation, Reference, Request, SynthesisError, input_inertia, is_single,
    output_shaft,
};
use kardan_math::num::{Float, Matrix, rational_to_f64};
use kardan_math::units::Dimension;
use kardan_results::signal_name::SignalName;
use kardan_results::{ControllerData, DataNumber, Design, ReadSignal};
use kardan_schema::schema::Values;
use kardan_schema::schema::{Keys, LawKeys, Sign};

law_keys! {
    /// A position loop on one input, the driver model of \[diss. (6.138)\].
    law PositionLoop("position_loop") {
        required {
            output: Signal, "The shaft angle to control: `<shaft>.phi`.";
            input: Element(&["motor"]), "The input that acts on it.";
            reference: Name, "Name of the reference angle, set by the scenario.";
        }
        optional {
            natural_frequency: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) = "20 rad/s", "Natural frequency.";
            damping_ratio: Number(Sign::Positive) = "0.7", "Damping ratio.";
            inertia: Quantity(Dimension::INERTIA, Sign::Positive),
                "Input torque per acceleration of the output; left out: that of the design model, so that all inertia \
                 is moved.";
            load: Name, "Name of a load-torque estimate to feed forward, set by the scenario; left out: none.";
        }
    }
}

/// A position loop on one input, the driver model of \[diss. (6.138)\].
pub const POSITION_LOOP: LawKind = LawKind {
    keyword: PositionLoop::KEYWORD,
    summary: "A position loop on a single input: torque = inertia (w^2 (reference - angle) - 2 xi w speed) - load; \
              the driver model of the source.",
    fields: PositionLoop::FIELDS,
    example: "\
[control.driver_model]
law = \"position_loop\"
output = \"fs.phi\"
input = \"driver\"
natural_frequency = \"20 rad/s\"
damping_ratio = 0.7
reference = \"ref_fs\"
",
    template: |_, _| None,
    inputs: |values| values.word("input").map(str::to_string).into_iter().collect(),
    references,
    samples: false,
    design,
};

fn references(values: &Values) -> Vec<Reference> {
    let output = values.word_or_default("output");
    let (position, load) = (format!("position reference of {output}"), format!("load estimate along {output}"));
    let reference = Reference::of(values, "reference", position_of(output), position);
    let load = Reference::of(values, "load", effort_of(output), load);
    reference.into_iter().chain(load).collect()
}

struct Designed {
    name: String,
    inputs: Vec<String>,
    output: String,
    references: Vec<Reference>,
    shafts: usize,
    block: PositionLoopBlock<f64>,
}

/// The block [`kardan_rt::PositionLoop`], its acceleration times the inertia.
struct PositionLoopBlock<T> {
    shaft: usize,
    inertia: T,
    position_loop: kardan_rt::PositionLoop<T>,
}

impl PositionLoopBlock<f64> {
    fn cast<T: Float>(&self) -> PositionLoopBlock<T> {
        PositionLoopBlock {
            shaft: self.shaft,
            inertia: T::from_f64(self.inertia),
            position_loop: position_loop_in(&self.position_loop),
        }
    }
}

impl<T: Float> Block for PositionLoopBlock<T> {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        let Observation { angles, speeds, references, .. } = observation;
        let [load, reference, angle, speed] =
            [references.get(1).copied().unwrap_or(0.0), references[0], angles[self.shaft], speeds[self.shaft]]
                .map(T::from_f64);
        let acceleration = self.position_loop.acceleration(reference, angle, speed, load / self.inertia);
        out[0] = acceleration.map_or(f64::NAN, |acceleration| (self.inertia * acceleration).to_f64());
        out[0].is_finite()
    }
}

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let values = request.values;
    let output = values.word_or_default("output").to_string();
    let shaft = output_shaft(&output, request.plant.coordinates())?;
    request.plant.check_accelerates(shaft, &output)?;
    let inputs = (POSITION_LOOP.inputs)(values);
    let input = inputs.first().cloned().unwrap_or_default();
    let number =
        request.plant.linear.inputs.iter().position(|name| *name == input).expect("the model file names an input");
    let inertia = match (values.number("inertia"), input_inertia(&request.plant.linear, shaft, number)) {
        (Some(value), _) => value,
        (None, Some(found)) => rational_to_f64(&found),
        (None, None) => {
            return Err(SynthesisError::at(
                format!(
                    "the motor `{input}` does not act on the acceleration of `{output}` (relative degree above two)"
                ),
                &input,
                "does not act on the output directly",
                "choose a motor that acts on the output without a spring in between, or give `inertia`; behind a \
                 spring use `decoupling`, `pole_placement` or `lqr`",
            ));
        }
    };
    Ok(Arc::new(Designed {
        name: request.name.to_string(),
        inputs,
        output,
        references: references(values),
        shafts: request.plant.coordinates().len(),
        block: PositionLoopBlock {
            shaft,
            inertia,
            position_loop: kardan_rt::PositionLoop {
                natural_frequency: values.number_or_default("natural_frequency"),
                damping_ratio: values.number_or_default("damping_ratio"),
            },
        },
    }))
}

impl Designed {
    /// The data of the block [`kardan_rt::PositionLoop`]: its acceleration times the inertia is the torque.
    fn data(&self) -> ControllerData {
        let output = SignalName::new(&self.output);
        let speed = output.rate();
        let unit = SignalName::new(&speed).unit();
        let mut reads = vec![ReadSignal::new(&self.output, output.unit()), ReadSignal::new(&speed, unit)];
        reads.extend(self.references.iter().map(|r| ReadSignal::new(&r.name, r.physical.unit())));
        ControllerData {
            block: "PositionLoop".into(),
            reads,
            writes: self.inputs.clone(),
            numbers: vec![
                DataNumber::new("natural_frequency", self.block.position_loop.natural_frequency),
                DataNumber::new("damping_ratio", self.block.position_loop.damping_ratio),
                DataNumber::new("inertia", self.block.inertia),
            ],
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
        Some(if is_single(clock) { Box::new(self.block.cast::<f32>()) } else { Box::new(self.block.cast::<f64>()) })
    }

    /// Gains without states.
    fn linear_sampled(&self, _: Clock) -> Option<LinearLaw> {
        Some(self.linear())
    }

    fn linear(&self) -> LinearLaw {
        let omega = self.block.position_loop.natural_frequency;
        let row = |gain: f64| Matrix::from_fn(1, self.shafts, |_, j| if j == self.block.shaft { gain } else { 0.0 });
        // The reference, and the load if there is one.
        let stiffness = self.block.inertia * omega * omega;
        let on_references = Matrix::from_fn(1, self.references.len(), |_, j| if j == 0 { stiffness } else { -1.0 });
        LinearLaw::gains(
            row(-self.block.inertia * omega * omega),
            row(-self.block.inertia * 2.0 * self.block.position_loop.damping_ratio * omega),
            on_references,
        )
    }

    fn describe(&self) -> Design {
        let kardan_rt::PositionLoop { natural_frequency, damping_ratio } = self.block.position_loop;
        Design {
            controller: self.name.clone(),
            law: POSITION_LOOP.keyword.into(),
            inputs: self.inputs.clone(),
            outputs: vec![self.output.clone()],
            controller_data: self.data(),
            notes: vec![format!(
                "{} follows its reference with natural frequency {natural_frequency} rad/s and damping ratio \
                 {damping_ratio}, for an inertia of {:.9} {}.",
                self.output,
                self.block.inertia,
                inertia_unit(&self.output)
            )],
            ..Design::default()
        }
    }
}
