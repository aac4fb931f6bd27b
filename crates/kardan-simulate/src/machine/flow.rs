//! Blocks that compute at every instant, as part of the expressions of the loop.

use std::ops::Range;
use std::sync::Arc;

use crate::compiled_plan::sum;
use crate::sampler::numbers_of;
use crate::scenario::Scenario;
use kardan_expr::expr::{Expr, Symbol};
use kardan_mechanics::equations::Measured;
use kardan_mechanics::program::{Read, Task};
use kardan_mechanics::reduce::{Motion, Reduced};

/// Blocks at every instant, with their indices in a loop.
#[derive(Debug, Clone)]
pub(super) struct Flow {
    pub task: Arc<Task>,
    /// Numbers of the sources that they read, and of those that they output.
    reads: Vec<usize>,
    outputs: Vec<usize>,
    /// Where their states are.
    pub states: Range<usize>,
}

impl Flow {
    /// Those of a scenario; `size` grows by their states.
    pub fn new(scenario: &Scenario, size: &mut usize) -> Option<Self> {
        let task = scenario.flow.clone()?;
        let number = |name: &str| scenario.source(name).expect("blocks read and output sources");
        let reads = task.reads.iter().filter_map(|(_, read)| match read {
            Read::Source(name) => Some(number(name)),
            _ => None,
        });
        let (reads, outputs) = (reads.collect(), task.outputs.iter().map(|output| number(&output.name)).collect());
        let states = *size..*size + task.states.len();
        *size = states.end;
        Some(Self { task, reads, outputs, states })
    }

    /// Written into a loop with these states: their outputs become sources. Returns the rates of the states.
    pub fn write_into(
        &self,
        motion: &mut Motion,
        reduced: &Reduced,
        sources: &mut [Expr],
        states: &[Expr],
    ) -> Vec<Expr> {
        let task = &*self.task;
        let (outputs, rates) = task_outputs(task, &self.reads, motion, reduced, (sources, states));
        let named = task.outputs.iter().zip(&outputs).map(|(output, value)| (output.name.clone(), *value)).collect();
        motion.output(named);
        self.outputs.iter().zip(outputs).for_each(|(&source, output)| sources[source] = output);
        rates
    }
}

/// The outputs of a task at every instant and the rates of its states, among the expressions of a motion; `reads`: the
/// sources that it reads, in their order.
pub(super) fn task_outputs(
    task: &Task,
    reads: &[usize],
    motion: &mut Motion,
    reduced: &Reduced,
    (sources, states): (&[Expr], &[Expr]),
) -> (Vec<Expr>, Vec<Expr>) {
    let mut reads = reads.iter();
    let mut substitutions: Vec<(Symbol, Expr)> = Vec::new();
    let coordinate = |name: &String| reduced.coordinate(name).expect("a task reads coordinates of its model");
    for (symbol, read) in &task.reads {
        let value = match read {
            Read::Position(name) => motion.angles[coordinate(name)],
            Read::Rate(name) => motion.speeds[coordinate(name)],
            Read::Time => motion.time(),
            Read::Source(_) => sources[*reads.next().expect("a number for each")],
            Read::Sensor(name) | Read::AsRead(name) => measured(motion, reduced, name),
        };
        substitutions.push((*symbol, value));
    }
    substitutions.extend(task.states.iter().map(|entry| entry.symbol).zip(states.iter().copied()));
    let mut copied = |value: Expr| {
        let value = motion.graph.copied(&task.graph, value, &substitutions);
        motion.graph.group(value)
    };
    let outputs = task.outputs.iter().map(|output| copied(output.value)).collect();
    let rates = task.states.iter().map(|entry| copied(entry.next)).collect();
    (outputs, rates)
}

/// The reading of an ideal sensor.
///
/// # Panics
/// If it is not one of a motion or of a twist (the model layer checks that).
fn measured(motion: &mut Motion, reduced: &Reduced, name: &str) -> Expr {
    let (_, sensor) = reduced.equations.sensors.iter().find(|(other, _)| other == name).expect("a sensor of the model");
    let coordinate = |name: &String| reduced.coordinate(name).expect("a sensor names a coordinate");
    match &sensor.measured {
        Measured::Angle(body) => motion.angles[coordinate(body)],
        Measured::Speed(body) => motion.speeds[coordinate(body)],
        Measured::SpringTorque(element) => {
            let springs = numbers_of(element, &reduced.equations.springs);
            let torques = springs.into_iter().map(|k| motion.spring_torque(reduced, k)).collect::<Vec<_>>();
            sum(&mut motion.graph, torques)
        }
        other => unreachable!("no block reads {other:?} at every instant"),
    }
}
