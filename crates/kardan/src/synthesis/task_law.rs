//! A task of blocks in the loop of a run: what it answers are commands, or signals for others.

use std::sync::Arc;

use kardan_rt::Health;

use super::{Block, Clock, Law, LinearLaw, Reference, Seen};
use crate::analysis::OutputSignal;
use crate::equations::Measured;
use crate::expr::Symbol;
use crate::num::Keeper;
use crate::plan::{Plan, compile};
use crate::program::{Read, Task};
use crate::reduce::Reduced;
use crate::results::{Design, Physical};

/// Where an input of a task comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
enum From {
    Angle(usize),
    Speed(usize),
    Reading(usize),
    Reference(usize),
    Time,
}

/// A task as a law: its answers stand in the place of commands.
pub struct TaskLaw {
    task: Arc<Task>,
    answers: Vec<String>,
    references: Vec<Reference>,
    sensors: Vec<OutputSignal>,
    from: Vec<From>,
    period: f64,
    /// Answers, then what is remembered next, from what is read, then what is remembered.
    plan: Arc<Plan>,
}

impl TaskLaw {
    /// A task with a clock, in a model.
    ///
    /// # Panics
    /// If it names what the model does not have (the model layer checks that before), or has no clock.
    pub fn new(task: &Arc<Task>, reduced: &Reduced) -> Self {
        let (mut references, mut sensors, mut from): (Vec<Reference>, Vec<OutputSignal>, Vec<From>) =
            Default::default();
        let coordinate = |name: &String| reduced.coordinate(name).expect("a task reads coordinates of its model");
        for (symbol, read) in &task.reads {
            from.push(match read {
                Read::Position(name) => From::Angle(coordinate(name)),
                Read::Rate(name) => From::Speed(coordinate(name)),
                Read::Time => From::Time,
                Read::Source(name) => {
                    let (_, dimension) = task.graph.name(*symbol);
                    let description = format!("read by {}", task.name);
                    references.push(Reference {
                        name: name.clone(),
                        physical: Physical::other(&dimension.si()),
                        description,
                    });
                    From::Reference(references.len() - 1)
                }
                Read::Sensor(name) => {
                    let known = reduced.equations.sensors.iter().find(|(other, _)| other == name);
                    let (_, sensor) = known.expect("a task reads sensors of its model");
                    sensors.push(OutputSignal { name: name.clone(), measured: sensor.measured.clone() });
                    From::Reading(sensors.len() - 1)
                }
            });
        }
        let inputs: Vec<Symbol> =
            task.reads.iter().map(|(symbol, _)| *symbol).chain(task.memory.iter().map(|entry| entry.symbol)).collect();
        let answers = task.answers.iter().map(|answer| (answer.name.clone(), answer.value));
        let next = task.memory.iter().enumerate().map(|(k, entry)| (format!("next.{k}"), entry.next));
        let outputs: Vec<_> = answers.chain(next).collect();
        let plan = compile(&task.graph, &inputs, &outputs).expect("a task names all that it reads");
        Self {
            answers: task.answers.iter().map(|answer| answer.name.clone()).collect(),
            references,
            sensors,
            from,
            period: task.period.as_ref().expect("a task with a clock").to_f64(),
            plan: Arc::new(plan),
            task: Arc::clone(task),
        }
    }

    /// Whether a sensor follows from accelerations, which are not known when a sample is taken.
    pub fn is_readable(measured: &Measured) -> bool {
        !matches!(measured, Measured::ConstraintTorque(..) | Measured::NetTorque(_))
    }
}

/// A task at its samples.
struct TaskBlock {
    plan: Arc<Plan>,
    from: Vec<From>,
    memory: Vec<f64>,
    /// The last good answers, and what is remembered next.
    answers: Vec<f64>,
    next: Vec<f64>,
    /// Answers and entries that were kept at the last sample.
    kept: usize,
    bad_readings: usize,
}

impl Block for TaskBlock {
    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) -> bool {
        for (place, from) in self.memory.iter_mut().zip(&self.from) {
            *place = match *from {
                From::Angle(k) => seen.angles[k],
                From::Speed(k) => seen.speeds[k],
                From::Reading(k) => seen.readings[k],
                From::Reference(k) => seen.references[k],
                From::Time => seen.time,
            };
        }
        self.bad_readings = seen.readings.iter().filter(|reading| !reading.is_finite()).count();
        self.memory[self.from.len()..][..seen.states.len()].copy_from_slice(seen.states);
        // What is no number is kept as it was, each for itself.
        let _ = self.plan.block().evaluate(&mut self.memory);
        self.next.copy_from_slice(seen.states);
        self.kept = 0;
        for (k, old) in self.answers.iter_mut().chain(&mut self.next).enumerate() {
            let new = self.memory[self.plan.place(k)];
            if new.is_finite() {
                *old = new;
            } else {
                self.kept += 1;
            }
        }
        out.copy_from_slice(&self.answers);
        true
    }

    fn states(&mut self, _: Seen<'_>, _: &[f64], out: &mut [f64]) -> bool {
        out.copy_from_slice(&self.next);
        true
    }

    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        keeper.numbers(&mut self.answers);
        keeper.count(&mut self.kept);
        keeper.count(&mut self.bad_readings);
    }

    fn health(&self) -> Health {
        Health { readings_held: self.bad_readings, estimate_kept: self.kept > 0, ..Health::default() }
    }
}

impl Law for TaskLaw {
    fn inputs(&self) -> &[String] {
        &self.answers
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn states(&self) -> Vec<String> {
        self.task.memory.iter().map(|entry| entry.name.clone()).collect()
    }

    fn start(&self, _: &[f64], _: &[f64], out: &mut [f64]) {
        out.iter_mut().zip(&self.task.memory).for_each(|(out, entry)| *out = entry.start);
    }

    fn block(&self, _: Option<Clock>) -> Option<Box<dyn Block>> {
        Some(Box::new(TaskBlock {
            memory: self.plan.memory(),
            plan: Arc::clone(&self.plan),
            from: self.from.clone(),
            answers: vec![0.0; self.answers.len()],
            next: vec![0.0; self.task.memory.len()],
            kept: 0,
            bad_readings: 0,
        }))
    }

    fn bends(&self) -> bool {
        true
    }

    fn linear(&self) -> LinearLaw {
        unreachable!("blocks run beside the laws of a model, and are not designed")
    }

    fn sensors(&self) -> &[OutputSignal] {
        &self.sensors
    }

    fn clock(&self) -> Option<Clock> {
        Some(Clock { period: self.period, delay: 0.0, single: false })
    }

    fn describe(&self) -> Design {
        Design { controller: self.task.name.clone(), law: "blocks".into(), ..Design::default() }
    }
}
