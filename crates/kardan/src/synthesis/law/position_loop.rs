use std::sync::Arc;

use kardan_rt::Health;

use crate::element::Values;
use crate::num::{Float, Keeper, Matrix, rational_to_f64};
use crate::results::{ControllerData, DataNumber, Design, Physical, ReadSignal};
use crate::schema::{Keys, LawKeys, Sign};
use crate::synthesis::{
    Block, Clock, Continuous, Firmware, Law, LawKind, LinearLaw, Reference, Request, Running, Seen, SynthesisError,
    input_inertia, output_shaft,
};
use crate::units::Dimension;

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
    let reference = values.word("reference").map(|name| Reference {
        name: name.into(),
        physical: Physical::Angle,
        description: format!("position reference of {output}"),
    });
    let load = values.word("load").map(|name| Reference {
        name: name.into(),
        physical: Physical::Torque,
        description: format!("load estimate along {output}"),
    });
    reference.into_iter().chain(load).collect()
}

struct Designed {
    name: String,
    inputs: Vec<String>,
    output: String,
    references: Vec<Reference>,
    shafts: usize,
    running: RunningPositionLoop<f64>,
}

/// The block [`kardan_rt::PositionLoop`], its acceleration times the inertia.
struct RunningPositionLoop<T> {
    shaft: usize,
    inertia: T,
    position_loop: kardan_rt::PositionLoop<T>,
    /// The last torque that was a number.
    torque: T,
    /// Whether it is that of the sample before.
    kept: bool,
}

impl<T: Float> RunningPositionLoop<T> {
    fn cast<U: Float>(&self) -> RunningPositionLoop<U> {
        let to = |x: T| U::from_f64(x.to_f64());
        let kardan_rt::PositionLoop { natural_frequency, damping_ratio } = self.position_loop;
        RunningPositionLoop {
            shaft: self.shaft,
            inertia: to(self.inertia),
            position_loop: kardan_rt::PositionLoop {
                natural_frequency: to(natural_frequency),
                damping_ratio: to(damping_ratio),
            },
            torque: U::ZERO,
            kept: false,
        }
    }
}

impl Continuous for RunningPositionLoop<f64> {
    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        Block::keep(self, keeper);
    }

    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) {
        Block::command(self, seen, out);
        if self.kept {
            out.fill(f64::NAN);
        }
    }
}

impl<T: Float> Block for RunningPositionLoop<T> {
    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        keeper.floats(std::slice::from_mut(&mut self.torque));
        keeper.flag(&mut self.kept);
    }

    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) {
        let Seen { angles, speeds, references, .. } = seen;
        let [load, reference, angle, speed] =
            [references.get(1).copied().unwrap_or(0.0), references[0], angles[self.shaft], speeds[self.shaft]]
                .map(T::from_f64);
        let acceleration = self.position_loop.acceleration(reference, angle, speed, load / self.inertia);
        let torque = acceleration.map(|acceleration| self.inertia * acceleration).filter(|torque| torque.is_finite());
        self.kept = torque.is_none();
        self.torque = torque.unwrap_or(self.torque);
        out[0] = self.torque.to_f64();
    }

    fn health(&self) -> Health {
        Health { commands_bounded: usize::from(self.kept), ..Health::default() }
    }
}

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let values = request.values;
    let output = values.word_or_default("output").to_string();
    let shaft = output_shaft(&output, request.plant.shafts())?;
    let inputs = (POSITION_LOOP.inputs)(values);
    let input = inputs.first().cloned().unwrap_or_default();
    let number =
        request.plant.linear.inputs.iter().position(|name| *name == input).expect("the model file names an input");
    let inertia = match (values.number("inertia"), input_inertia(&request.plant.linear, shaft, number)) {
        (Some(given), _) => given,
        (None, Some(found)) => rational_to_f64(&found),
        (None, None) => return Err(SynthesisError::NotReached { input, output }),
    };
    Ok(Arc::new(Designed {
        name: request.name.to_string(),
        inputs,
        output,
        references: references(values),
        shafts: request.plant.shafts().len(),
        running: RunningPositionLoop {
            shaft,
            inertia,
            position_loop: kardan_rt::PositionLoop {
                natural_frequency: values.number_or_default("natural_frequency"),
                damping_ratio: values.number_or_default("damping_ratio"),
            },
            torque: 0.0,
            kept: false,
        },
    }))
}

impl Designed {
    /// What the block [`kardan_rt::PositionLoop`] runs with: its acceleration times the inertia is the torque.
    fn data(&self) -> ControllerData {
        let speed = self.output.trim_end_matches("phi").to_string() + "w";
        let mut reads = vec![ReadSignal::new(&self.output, "rad"), ReadSignal::new(speed, "rad/s")];
        reads.extend(self.references.iter().map(|r| ReadSignal::new(&r.name, r.physical.unit())));
        ControllerData {
            block: "PositionLoop".into(),
            reads,
            writes: self.inputs.clone(),
            sample_time: None,
            single: false,
            matrices: Vec::new(),
            numbers: vec![
                DataNumber::new("natural_frequency", self.running.position_loop.natural_frequency),
                DataNumber::new("damping_ratio", self.running.position_loop.damping_ratio),
                DataNumber::new("inertia", self.running.inertia),
            ],
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

    fn run(&self) -> Running {
        Running::Continuous(Box::new(self.running.cast::<f64>()))
    }

    fn firmware(&self, clock: Clock) -> Option<Firmware> {
        Some(Firmware {
            linear: self.linear(),
            block: if clock.single {
                Box::new(self.running.cast::<f32>())
            } else {
                Box::new(self.running.cast::<f64>())
            },
        })
    }

    fn linear(&self) -> LinearLaw {
        let omega = self.running.position_loop.natural_frequency;
        let row = |gain: f64| Matrix::from_fn(1, self.shafts, |_, j| if j == self.running.shaft { gain } else { 0.0 });
        // The reference, and the load if there is one.
        let stiffness = self.running.inertia * omega * omega;
        let told = Matrix::from_fn(1, self.references.len(), |_, j| if j == 0 { stiffness } else { -1.0 });
        LinearLaw::gains(
            row(-self.running.inertia * omega * omega),
            row(-self.running.inertia * 2.0 * self.running.position_loop.damping_ratio * omega),
            told,
        )
    }

    fn describe(&self) -> Design {
        let kardan_rt::PositionLoop { natural_frequency, damping_ratio } = self.running.position_loop;
        Design {
            controller: self.name.clone(),
            law: POSITION_LOOP.keyword.into(),
            inputs: self.inputs.clone(),
            outputs: vec![self.output.clone()],
            controller_data: self.data(),
            notes: vec![format!(
                "{} follows its reference with natural frequency {natural_frequency} rad/s and damping ratio \
                 {damping_ratio}, for an inertia of {:.9} kg m^2.",
                self.output, self.running.inertia
            )],
            ..Design::default()
        }
    }
}
