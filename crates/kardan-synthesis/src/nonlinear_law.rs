//! Laws on the nonlinear model.

use std::sync::Arc;

use kardan_rt::{ComputedTorque, Situation, Task};

use super::sampled::position_loop_in;
use super::{Block, Clock, ExactLoop, Law, LinearLaw, Observation, Reference, Request, SynthesisError, is_single};
use kardan_math::num::Float;
use kardan_mechanics::reduce::MechanismData;
use kardan_results::signal_name::Quantity;
use kardan_results::{ControllerData, DataMatrix, DataNumber, Design, ReadSignal};

/// A law on the nonlinear model, run by the block [`ComputedTorque`]. What is linear about it is that of the law with
/// constant gains at the design point.
pub(super) struct Nonlinear {
    at_design_point: Arc<dyn Law>,
    /// Whether the model is its linear one, without forces at zero.
    like_linear: bool,
    /// Positions and rates of the coordinates.
    motions: Vec<ReadSignal>,
    /// As it is at the start of a run.
    block: ComputedTorqueBlock<f64>,
}

/// The block [`ComputedTorque`] with the memory of one evaluation.
struct ComputedTorqueBlock<T> {
    data: MechanismData<T>,
    tasks: Vec<Task<T>>,
    /// The reference of each task.
    reference_places: Vec<usize>,
    inputs: Vec<usize>,
    friction_width: Option<T>,
    coordinates: Vec<usize>,
    /// The shaft of each disturbance that is cancelled; none for one that is not.
    disturbed: Vec<Option<usize>>,
    memory: Vec<T>,
    position: Vec<T>,
    speed: Vec<T>,
    references: Vec<T>,
    disturbances: Vec<T>,
    torques: Vec<T>,
}

impl<T: Float> ComputedTorqueBlock<T> {
    fn law(&self) -> ComputedTorque<'_, T> {
        ComputedTorque {
            mechanism: self.data.block(),
            tasks: &self.tasks,
            inputs: &self.inputs,
            friction_width: self.friction_width,
        }
    }
}

impl ComputedTorqueBlock<f64> {
    fn cast<T: Float>(&self) -> ComputedTorqueBlock<T> {
        let task = |task: &Task<f64>| match task {
            Task::Position { shaft, position_loop } => {
                Task::Position { shaft: *shaft, position_loop: position_loop_in(position_loop) }
            }
            Task::Torque { shaft } => Task::Torque { shaft: *shaft },
            Task::ConstraintTorque { cut } => Task::ConstraintTorque { cut: *cut },
        };
        ComputedTorqueBlock {
            data: self.data.cast(T::from_f64),
            tasks: self.tasks.iter().map(task).collect(),
            reference_places: self.reference_places.clone(),
            inputs: self.inputs.clone(),
            friction_width: self.friction_width.map(T::from_f64),
            coordinates: self.coordinates.clone(),
            disturbed: self.disturbed.clone(),
            memory: T::list(&self.memory),
            position: T::list(&self.position),
            speed: T::list(&self.speed),
            references: T::list(&self.references),
            disturbances: T::list(&self.disturbances),
            torques: T::list(&self.torques),
        }
    }
}

impl<T: Float> Block for ComputedTorqueBlock<T> {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        for (k, &shaft) in self.coordinates.iter().enumerate() {
            self.position[k] = T::from_f64(observation.angles[shaft]);
            self.speed[k] = T::from_f64(observation.speeds[shaft]);
        }
        for (reference, &reference_places) in self.references.iter_mut().zip(&self.reference_places) {
            *reference = T::from_f64(observation.references[reference_places]);
        }
        self.disturbances.fill(T::ZERO);
        for (shaft, torque) in self.disturbed.iter().zip(observation.disturbances) {
            if let Some(shaft) = shaft {
                self.disturbances[*shaft] = self.disturbances[*shaft] + T::from_f64(*torque);
            }
        }
        let mut memory = std::mem::take(&mut self.memory);
        let mut torques = std::mem::take(&mut self.torques);
        let now = Situation {
            position: &self.position,
            speed: &self.speed,
            references: &self.references,
            disturbances: &self.disturbances,
        };
        // Where the tasks depend on each other there is no result.
        let found = self.law().torques(now, &mut memory, &mut torques);
        T::widen(&torques, out);
        (self.memory, self.torques) = (memory, torques);
        found
    }
}

impl Nonlinear {
    /// Tabulates the model of a request. `cuts`: the element and the shaft of each controlled constraint torque; `reference_places`: the
    /// reference of each task among those of the linear law.
    ///
    /// # Errors
    /// If a transmission has no runtime block, or a coordinate no inertia.
    pub fn new(
        request: &Request<'_>,
        at_design_point: Arc<dyn Law>,
        tasks: Vec<Task<f64>>,
        cuts: &[(&str, &str)],
        reference_places: Vec<usize>,
        friction_width: Option<f64>,
    ) -> Result<Self, SynthesisError> {
        request.plant.check_inertia()?;
        let reduced = &request.plant.reduced;
        let data = MechanismData::with_cuts(reduced, cuts).map_err(|error| {
            let message = format!("the law cannot run on the nonlinear model: {error}");
            SynthesisError::of(message, &[], "this law", "design on the linear model: `plant = \"linear\"`")
        })?;
        let number = |name: &String| request.plant.input(name).expect("a law commands inputs");
        let inputs: Vec<usize> = at_design_point.inputs().iter().map(number).collect();
        let felt = |shaft: &usize| tasks.iter().any(|task| matches!(task, Task::Torque { shaft: s } if s == shaft));
        let r = reduced.coordinates.len();
        let mut block = ComputedTorqueBlock {
            reference_places,
            torques: vec![0.0; inputs.len()],
            inputs,
            friction_width,
            coordinates: reduced.coordinates.clone(),
            disturbed: request.disturbances.iter().map(|shaft| (!felt(shaft)).then_some(*shaft)).collect(),
            memory: Vec::new(),
            position: vec![0.0; r],
            speed: vec![0.0; r],
            references: vec![0.0; tasks.len()],
            disturbances: vec![0.0; data.shafts.len()],
            tasks,
            data,
        };
        block.memory = vec![0.0; block.law().memory()];
        let motions = [0, 1].map(|rate| request.plant.motions(rate)).concat();
        Ok(Self { at_design_point, like_linear: request.plant.is_linear(), motions, block })
    }

    /// The tables of the model as the block reads them.
    fn data(&self) -> ControllerData {
        let ComputedTorqueBlock { data, disturbed, friction_width, .. } = &self.block;
        let mut reads = self.motions.clone();
        let references = self.at_design_point.references();
        let places = self.block.reference_places.iter();
        reads.extend(places.map(|&k| ReadSignal::new(&references[k].name, references[k].physical.unit())));
        reads.extend(ReadSignal::of_each(Quantity::Disturbance, disturbed.iter().flatten().map(|&k| &data.shafts[k])));
        let tables = data.tables(|x| x).into_iter().chain([("tasks".into(), self.tasks())]);
        let mut numbers =
            vec![DataNumber::new("shafts", data.shafts.len() as f64), DataNumber::new("cuts", data.cuts() as f64)];
        numbers.extend(friction_width.map(|width| DataNumber::new("friction_width", width)));
        ControllerData {
            block: "ComputedTorque".into(),
            reads,
            writes: self.at_design_point.inputs().to_vec(),
            matrices: tables.map(|(name, rows)| DataMatrix::new(name, rows)).collect(),
            numbers,
            ..ControllerData::default()
        }
    }

    /// The tasks as rows: 0, shaft, natural frequency, damping ratio for an angle; 1, shaft for a torque on a shaft; 2, cut for
    /// a constraint torque; last the number of the input that goes with it.
    fn tasks(&self) -> Vec<Vec<f64>> {
        let row = |(task, input): (&Task<f64>, &usize)| {
            let mut row = match task {
                Task::Position { shaft, position_loop } => {
                    vec![0.0, *shaft as f64, position_loop.natural_frequency, position_loop.damping_ratio]
                }
                Task::Torque { shaft } => vec![1.0, *shaft as f64, 0.0, 0.0],
                Task::ConstraintTorque { cut } => vec![2.0, *cut as f64, 0.0, 0.0],
            };
            row.push(*input as f64);
            row
        };
        self.block.tasks.iter().zip(&self.block.inputs).map(row).collect()
    }
}

/// Step of central differences, rad, rad/s or N m.
const SLOPE_STEP: f64 = 1e-5;

impl Law for Nonlinear {
    forward! {
        at_design_point;
        fn inputs(&self) -> &[String];
        fn references(&self) -> &[Reference];
        fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw>;
        fn linear(&self) -> LinearLaw;
        fn exact(&self) -> Option<ExactLoop>;
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        Some(if is_single(clock) { Box::new(self.block.cast::<f32>()) } else { Box::new(self.block.cast::<f64>()) })
    }

    fn on_full_model(&self) -> bool {
        true
    }

    fn friction_width(&self) -> Option<f64> {
        self.block.friction_width
    }

    fn is_nonlinear(&self) -> bool {
        self.block.friction_width.is_some() || !self.like_linear
    }

    fn linear_at(&self, position: &[f64], _: Option<Clock>) -> Option<LinearLaw> {
        let mut out = self.linear();
        if !self.is_nonlinear() {
            return Some(out);
        }
        let (shafts, m) = (out.on_angles.columns(), self.block.inputs.len());
        let mut block = self.block.cast::<f64>();
        let (mut memory, rest) = (vec![0.0; block.data.block().memory()], vec![0.0; position.len()]);
        let now = block.data.block().evaluate(position, &rest, &mut memory)?;
        let mut angles: Vec<f64> = now.angles.iter().copied().take(shafts).collect();
        let mut speeds = vec![0.0; shafts];
        let mut disturbances = vec![0.0; out.on_disturbances.columns()];
        let mut references = vec![0.0; self.references().len()];
        for (task, reference_places) in block.tasks.iter().zip(&block.reference_places) {
            if let Task::Position { shaft, .. } = task {
                references[*reference_places] = angles[*shaft];
            }
        }
        let width = self.block.friction_width.map_or(1.0, |width| width.min(1.0));
        let mut ends = |point: [&mut Vec<f64>; 4], which: usize, k: usize, step: f64| -> Option<Vec<f64>> {
            let middle = point[which][k];
            let mut at = |value: f64| {
                point[which][k] = value;
                let [angles, speeds, disturbances, references] = point.each_ref().map(|list| list.as_slice());
                let mut torques = vec![0.0; m];
                let now = Observation { angles, speeds, disturbances, references, ..Observation::default() };
                block.command(now, &mut torques).then_some(torques)
            };
            let (above, below) = (at(middle + step)?, at(middle - step)?);
            point[which][k] = middle;
            let slope: Vec<f64> = above.iter().zip(&below).map(|(x, y)| (x - y) / (2.0 * step)).collect();
            slope.iter().all(|x| x.is_finite()).then_some(slope)
        };
        let parts = [&mut out.on_angles, &mut out.on_speeds, &mut out.on_disturbances, &mut out.on_references];
        for (which, part) in parts.into_iter().enumerate() {
            let step = if which == 1 { SLOPE_STEP * width } else { SLOPE_STEP };
            for k in 0..part.columns() {
                let slope = ends([&mut angles, &mut speeds, &mut disturbances, &mut references], which, k, step)?;
                slope.iter().enumerate().for_each(|(i, x)| part[(i, k)] = *x);
            }
        }
        Some(out)
    }

    fn describe(&self) -> Design {
        let mut design = self.at_design_point.describe();
        let plant_is = "full nonlinear model";
        design.design_model = plant_is.into();
        design.controller_data = self.data();
        design
    }
}
