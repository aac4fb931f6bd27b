//! A task of blocks in a loop: its outputs are commands of motors, or signals for others.

mod sides;
mod slopes;
mod task_block;
mod task_inputs;

use std::sync::{Arc, OnceLock};

use kardan_analysis::OutputSignal;
use kardan_expr::expr::{Side, SidesOf};
use kardan_expr::plan::Plan;
use kardan_math::num::{Float, Rational};
use kardan_mechanics::equations::Measured;
use kardan_mechanics::program::{Read, Task};
use kardan_mechanics::reduce::Reduced;
use kardan_results::{ControllerData, DataMatrix, Design, Physical, ReadSignal};

use super::{Block, Clock, Frozen, Kinks, Law, LinearLaw, Reference};

use task_block::TaskBlock;
use task_inputs::{Comes, Ideal};

/// The name of the law where a task only has outputs.
const BLOCKS: &str = "blocks";

/// A task as a law: its outputs take the place of commands.
#[derive(Clone)]
pub struct TaskLaw {
    task: Arc<Task>,
    law: &'static str,
    outputs: Vec<String>,
    references: Vec<Reference>,
    sensors: Vec<OutputSignal>,
    ideal: Vec<Ideal>,
    comes: Vec<Comes>,
    shafts: usize,
    clock: Option<Clock>,
    affine: bool,
    /// Outputs, then next states, from inputs, then states.
    plan: Arc<Plan>,
    /// The inputs, then the states, of its linearisation; `None`: zero inputs, and the states after the first samples there.
    point: Option<Vec<f64>>,
    /// A note on that point.
    point_note: Option<String>,
    /// The side of a kink on which it is linearised.
    side: Side,
    /// Slopes of some rows alone; `None`: of all.
    slopes_of_rows: Option<Vec<usize>>,
    sides_at_design_point: OnceLock<Vec<SidesOf>>,
    /// The linear part at the design point.
    at_design_point: OnceLock<LinearLaw>,
    exact_at_design_point: OnceLock<Option<Arc<LinearLaw<Rational>>>>,
    rounding_at_design_point: OnceLock<Option<Arc<LinearLaw>>>,
}

impl TaskLaw {
    /// A task at its samples, in a model.
    ///
    /// # Panics
    /// If it names what the model does not have (the model layer checks that before).
    pub fn new(task: &Arc<Task>, reduced: &Reduced) -> Self {
        let clock = task.period.as_ref().map(|period| Clock { period: period.to_f64(), delay: 0.0, single: false });
        Self::with(task, reduced, (BLOCKS, clock))
    }

    /// The same as a law of a keyword, with its clock.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn with(task: &Arc<Task>, reduced: &Reduced, (law, clock): (&'static str, Option<Clock>)) -> Self {
        let (mut references, mut sensors, mut comes): (Vec<Reference>, Vec<OutputSignal>, Vec<Comes>) =
            Default::default();
        let mut ideal = Vec::new();
        let coordinate = |name: &String| reduced.coordinate(name).expect("a task reads coordinates of its model");
        for (symbol, read) in &task.reads {
            let reference = |name: &String| {
                let (_, dimension) = task.graph.name(*symbol);
                let description = format!("read by {}", task.name);
                Reference { name: name.clone(), physical: Physical::of_unit(&dimension.si()), description }
            };
            comes.push(match read {
                Read::Position(name) => Comes::Angle(coordinate(name)),
                Read::Rate(name) => Comes::Speed(coordinate(name)),
                Read::Time => Comes::Time,
                Read::Source(name) => {
                    references.push(reference(name));
                    Comes::Reference(references.len() - 1)
                }
                Read::Sensor(name) | Read::AsRead(name) => {
                    let number = sensors.iter().position(|sensor| sensor.name == *name).unwrap_or_else(|| {
                        let measured =
                            &reduced.equations.sensor(name).expect("a task reads sensors of its model").measured;
                        let mut of = Ideal::new(measured, reduced);
                        if matches!(measured, Measured::Signal(_)) {
                            of.reference = Some(references.len());
                            references.push(reference(name));
                        }
                        sensors.push(OutputSignal { name: name.clone(), measured: measured.clone() });
                        ideal.push(of);
                        sensors.len() - 1
                    });
                    if matches!(read, Read::Sensor(_)) { Comes::Reading(number) } else { Comes::AsRead(number) }
                }
            });
        }
        let affine = task.graph.affine();
        Self {
            law,
            outputs: task.outputs.iter().map(|output| output.name.clone()).collect(),
            references,
            sensors,
            ideal,
            comes,
            shafts: reduced.equations.coordinates.len(),
            clock,
            affine: task.outputs().iter().all(|(_, expr)| affine(*expr)),
            plan: Arc::clone(task.plan()),
            task: Arc::clone(task),
            point: None,
            point_note: None,
            side: Side::default(),
            sides_at_design_point: OnceLock::new(),
            at_design_point: OnceLock::new(),
            exact_at_design_point: OnceLock::new(),
            rounding_at_design_point: OnceLock::new(),
            slopes_of_rows: None,
        }
    }

    /// The same, linearised on one side of its kinks.
    #[must_use]
    pub fn on(self, side: &Side) -> Self {
        Self {
            side: side.clone(),
            sides_at_design_point: OnceLock::new(),
            at_design_point: OnceLock::new(),
            exact_at_design_point: OnceLock::new(),
            rounding_at_design_point: OnceLock::new(),
            ..self
        }
    }

    /// The same with slopes of some rows only, outputs, then states; others are taken as zero.
    #[must_use]
    pub fn with_slopes_among(self, rows: &[usize]) -> Self {
        Self { slopes_of_rows: Some(rows.to_vec()), ..self }
    }

    fn all_rows(&self) -> Vec<usize> {
        (0..self.outputs.len() + self.task.states.len()).collect()
    }

    fn block_of<T: Float>(&self) -> TaskBlock<T> {
        let mut memory = vec![T::ZERO; self.plan.block().memory()];
        let (constants, numbers) = (T::list(self.plan.constants()), T::list(self.plan.numbers()));
        self.plan.block_of(&constants, &numbers).begin(&mut memory);
        TaskBlock {
            memory,
            constants,
            numbers,
            plan: Arc::clone(&self.plan),
            comes: self.comes.clone(),
            ideal: self.ideal.clone(),
            outputs: vec![0.0; self.outputs.len()],
            next: vec![0.0; self.task.states.len()],
            good: vec![f64::NAN; self.sensors.len()],
            sampled: self.clock.is_some(),
            frozen: 0,
            bad_readings: 0,
        }
    }
}

impl Law for TaskLaw {
    fn inputs(&self) -> &[String] {
        &self.outputs
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn states(&self) -> Vec<String> {
        self.task.states.iter().map(|entry| entry.name.clone()).collect()
    }

    fn start(&self, _: &[f64], _: &[f64], out: &mut [f64]) {
        out.iter_mut().zip(&self.task.states).for_each(|(out, entry)| *out = entry.start);
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        let own = self.clock.map(|clock| clock.period);
        if clock.is_some_and(|clock| own.is_some_and(|own| own != clock.period)) {
            return None;
        }
        match clock {
            Some(clock) if clock.single => Some(Box::new(self.block_of::<f32>())),
            _ => Some(Box::new(self.block_of::<f64>())),
        }
    }

    fn is_nonlinear(&self) -> bool {
        !self.affine
    }

    /// Slopes at its operating point; without one at zero inputs and the states after the first samples there.
    fn linear(&self) -> LinearLaw {
        let linear = || {
            let inputs = self.design_point();
            self.slopes_among(&inputs, self.sides())
        };
        self.at_design_point.get_or_init(linear).clone()
    }

    fn linear_exact(&self) -> Option<Arc<LinearLaw<Rational>>> {
        let exact = || {
            let inputs = self.design_point();
            self.exact_slopes_of(&self.all_rows(), &inputs, self.sides())
        };
        self.exact_at_design_point.get_or_init(exact).clone()
    }

    fn linear_rounding(&self) -> Option<Arc<LinearLaw>> {
        let rounding = || {
            let exact = self.linear_exact();
            let bound = || self.slope_rounding(&self.all_rows(), &self.design_point(), self.sides(), &self.linear());
            if exact.is_none() { bound() } else { None }
        };
        self.rounding_at_design_point.get_or_init(rounding).clone()
    }

    fn kinks(&self) -> Kinks {
        let inputs = self.design_point();
        self.kinks_among(&inputs, self.sides())
    }

    fn on_side(&self, side: &Side) -> Option<Arc<dyn Law>> {
        Some(Arc::new(self.clone().on(side)))
    }

    /// At its own samples; without any, commands are sampled alone: its blocks have no sample time and go on at every instant.
    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        match self.clock {
            Some(own) => (own.period == clock.period).then(|| self.linear()),
            None => Some(LinearLaw { flowing: true, ..self.linear() }),
        }
    }

    fn sensors(&self) -> &[OutputSignal] {
        &self.sensors
    }

    fn task(&self) -> Option<&Arc<Task>> {
        use Measured::{Angle, Speed, SpringTorque};
        let of_motion = |sensor: &OutputSignal| matches!(sensor.measured, Angle(_) | Speed(_) | SpringTorque(_));
        let is_inline = self.clock.is_none() && self.task.states.is_empty() && self.sensors.iter().all(of_motion);
        is_inline.then_some(&self.task)
    }

    fn clock(&self) -> Option<Clock> {
        self.clock
    }

    fn keeps(&self) -> Frozen {
        if self.law == BLOCKS { Frozen::Outputs } else { Frozen::Command }
    }

    fn describe(&self) -> Design {
        let task = &self.task;
        let reads = task.reads.iter().map(|(symbol, _)| {
            let (name, dimension) = task.graph.name(*symbol);
            ReadSignal::new(name, dimension.si())
        });
        let blocks: Vec<String> =
            task.order.iter().map(|step| format!("{} ({})", step.block, step.kind.replace('_', " "))).collect();
        let initial_state = ("initial_state", task.states.iter().map(|entry| vec![entry.start]).collect());
        let mut notes = Vec::new();
        if !blocks.is_empty() {
            notes.push(format!("Its blocks compute in this order: {}.", blocks.join(", ")));
        }
        notes.push(format!(
            "One sample takes {} operations on {} state variables.",
            self.plan.operations(),
            task.states.len()
        ));
        if !self.affine {
            let place = match self.point {
                Some(_) => "at the operating point, with signals at their initial values",
                None => "where all its inputs are zero",
            };
            notes.push(format!("Nonlinear law: the statements about its loop are those of its linearisation {place}."));
        }
        notes.extend(self.point_note.clone());
        Design {
            controller: task.name.clone(),
            law: self.law.into(),
            inputs: self.outputs.clone(),
            controller_data: ControllerData {
                block: "Plan".into(),
                reads: reads.collect(),
                writes: self.outputs.clone(),
                sample_time: self.clock.map(|clock| clock.period),
                single: self.clock.is_some_and(|clock| clock.single),
                matrices: self
                    .plan
                    .rows(self.plan.constants(), self.plan.numbers())
                    .into_iter()
                    .chain([initial_state])
                    .map(|(name, rows)| DataMatrix::new(name, rows))
                    .collect(),
                numbers: Vec::new(),
            },
            notes,
            ..Design::default()
        }
    }
}
