//! Blocks between the laws of a loop: those that are in the loop.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::{LoopPlant, SampledPart, Teller};
use crate::{Clock, ExportedSignal, Kinks, LinearLaw};
use kardan_analysis::OutputSignal;
use kardan_math::num::{Matrix, Rational};
use kardan_mechanics::reduce::BlockTorque;

/// A task of blocks in a loop, around a place.
#[derive(Debug, Clone)]
pub struct LinearTask {
    /// Its slopes; its outputs take the place of commands.
    pub linear: LinearLaw,
    /// The same before rounding, where it computes at every instant and that is known.
    pub exact: Option<Arc<LinearLaw<Rational>>>,
    /// By how much rounding may have moved its slopes where that is more than their last digits.
    pub rounding: Option<Arc<LinearLaw>>,
    /// Kinks and jumps of each of its outputs, then of its states, there.
    pub kinks: Kinks,
    /// When it computes; `None`: at every instant.
    pub clock: Option<Clock>,
    /// The names of its outputs.
    pub outputs: Vec<String>,
    /// The names of its references.
    pub references: Vec<String>,
    /// Its sensors.
    pub sensors: Vec<OutputSignal>,
}

/// A law next to blocks: the names of its references, and its exported signals.
#[derive(Debug, Clone, Default)]
pub struct BesideBlocks {
    /// Its references; those that its commands do not follow from are empty.
    pub references: Vec<String>,
    /// Its exported signals, by names that are unique in the loop.
    pub exported: Vec<(String, ExportedSignal)>,
}

/// Blocks between the laws of a loop, as its parts: those that depend on moving signals of the loop and act on a law.
#[derive(Debug, Clone, Default)]
pub struct LoopBlocks {
    parts: Vec<SampledPart>,
    /// The signals that each law reads of them.
    reads: Vec<Vec<(usize, Teller)>>,
    /// Names of the outputs that are in the loop.
    names: Vec<String>,
    /// Their kinks and their jumps, in this order.
    kinks: Kinks,
}

/// A value that blocks compute: a task, and which of its outputs or states.
type Node = (usize, ExportedSignal);

/// Who follows from whom, by entries that are not zero.
struct Net<'a> {
    tasks: &'a [LinearTask],
    laws: &'a [BesideBlocks],
    torques: &'a [BlockTorque],
    /// Outputs of tasks and signals of laws by their names, the first of each.
    outputs: HashMap<&'a str, Node>,
    exported: HashMap<&'a str, (usize, ExportedSignal)>,
}

impl<'a> Net<'a> {
    fn new(tasks: &'a [LinearTask], laws: &'a [BesideBlocks], torques: &'a [BlockTorque]) -> Self {
        let (mut outputs, mut exported) = (HashMap::new(), HashMap::new());
        for (number, task) in tasks.iter().enumerate() {
            for (k, name) in task.outputs.iter().enumerate() {
                outputs.entry(name.as_str()).or_insert((number, ExportedSignal::Command(k)));
            }
        }
        for (number, law) in laws.iter().enumerate() {
            for (name, signal) in &law.exported {
                exported.entry(name.as_str()).or_insert((number, *signal));
            }
        }
        Self { tasks, laws, torques, outputs, exported }
    }

    fn nodes(&self) -> Vec<Node> {
        let of = |(number, task): (usize, &LinearTask)| {
            let outputs = (0..task.outputs.len()).map(move |k| (number, ExportedSignal::Command(k)));
            outputs
                .chain((0..task.linear.states.rows()).map(move |k| (number, ExportedSignal::State(k))))
                .collect::<Vec<_>>()
        };
        self.tasks.iter().enumerate().flat_map(of).collect()
    }

    /// The task with that output.
    fn output_node(&self, name: &str) -> Option<Node> {
        self.outputs.get(name).copied()
    }

    /// The law that exports the signal.
    fn exported(&self, name: &str) -> Option<(usize, ExportedSignal)> {
        self.exported.get(name).copied()
    }

    /// Rows of a node: over references, over all that moves, over the states of its task.
    fn rows(&self, (task, exported): Node) -> [Vec<f64>; 3] {
        let linear = &self.tasks[task].linear;
        let (row, [references, angles, speeds, errors, states]) = match exported {
            ExportedSignal::Command(k) => {
                (k, [&linear.on_references, &linear.on_angles, &linear.on_speeds, &linear.on_errors, &linear.on_states])
            }
            ExportedSignal::State(k) => {
                (k, [&linear.references, &linear.angles, &linear.speeds, &linear.errors, &linear.states])
            }
        };
        [
            references.row(row).to_vec(),
            [angles, speeds, errors].iter().flat_map(|of| of.row(row)).copied().collect(),
            states.row(row).to_vec(),
        ]
    }

    /// Other nodes that a node follows from.
    fn before(&self, node: Node) -> Vec<Node> {
        let [references, _, states] = self.rows(node);
        let names = references.iter().zip(&self.tasks[node.0].references).filter(|(x, _)| **x != 0.0);
        let mut out: Vec<Node> = names.filter_map(|(_, name)| self.output_node(name)).collect();
        out.extend((0..states.len()).filter(|k| states[*k] != 0.0).map(|k| (node.0, ExportedSignal::State(k))));
        out
    }

    /// Whether what moves acts on a node, not by way of others.
    fn moves(&self, node: Node) -> bool {
        let [references, moving, _] = self.rows(node);
        let exported = |(x, name): (&f64, &String)| *x != 0.0 && self.exported(name).is_some();
        moving.iter().any(|x| *x != 0.0) || references.iter().zip(&self.tasks[node.0].references).any(exported)
    }

    /// Nodes that what moves acts on, and that laws or torques follow from.
    fn closed(&self) -> Vec<Node> {
        let all = self.nodes();
        let before: HashMap<Node, Vec<Node>> = all.iter().map(|node| (*node, self.before(*node))).collect();
        let mut behind: HashMap<Node, Vec<Node>> = HashMap::new();
        for (node, from) in &before {
            from.iter().for_each(|one| behind.entry(*one).or_default().push(*node));
        }
        let acted = reached(all.iter().copied().filter(|node| self.moves(*node)), &behind);
        let read = self.laws.iter().flat_map(|law| &law.references);
        let act = self.torques.iter().flat_map(|torque| &torque.on_outputs).filter(|(_, slope)| *slope != 0.0);
        let read = read.chain(act.map(|(name, _)| name));
        let felt = reached(read.filter_map(|name| self.output_node(name)), &before);
        all.into_iter().filter(|node| acted.contains(node) && felt.contains(node)).collect()
    }
}

/// Some nodes, and all that follow from them.
fn reached(from: impl Iterator<Item = Node>, next: &HashMap<Node, Vec<Node>>) -> HashSet<Node> {
    let (mut open, mut out): (Vec<Node>, HashSet<Node>) = (from.collect(), HashSet::new());
    while let Some(node) = open.pop() {
        if out.insert(node) {
            open.extend(next.get(&node).into_iter().flatten());
        }
    }
    out
}

impl LoopBlocks {
    /// Blocks in the loop of a plant, in the order in which they compute, between laws, with the torques that follow from them. Blocks without moving
    /// inputs are left out, and blocks that no law or torque depends on: a timer, a counter, a display. None of them changes whether the loop is stable.
    ///
    /// # Panics
    /// If the plant has no input for a torque.
    pub fn new(tasks: &[LinearTask], laws: &[BesideBlocks], torques: &[BlockTorque], plant: &LoopPlant) -> Self {
        let net = Net::new(tasks, laws, torques);
        let closed = net.closed();
        let own = |task: usize, select: fn(&ExportedSignal) -> Option<usize>| -> Vec<usize> {
            closed.iter().filter(|(of, _)| *of == task).filter_map(|(_, exported)| select(exported)).collect()
        };
        let output_node: fn(&ExportedSignal) -> Option<usize> =
            |exported| if let ExportedSignal::Command(k) = exported { Some(*k) } else { None };
        let state: fn(&ExportedSignal) -> Option<usize> =
            |exported| if let ExportedSignal::State(k) = exported { Some(*k) } else { None };
        let retained: Vec<[Vec<usize>; 2]> =
            (0..tasks.len()).map(|task| [own(task, output_node), own(task, state)]).collect();
        // Tasks without remaining blocks are no parts.
        let mut numbers = vec![None; tasks.len()];
        let mut count = 0;
        for (number, retained) in numbers.iter_mut().zip(&retained) {
            if retained.iter().any(|retained| !retained.is_empty()) {
                *number = Some(laws.len() + count);
                count += 1;
            }
        }
        let teller = |name: &str| -> Option<Teller> {
            if let Some((part, exported)) = net.exported(name) {
                return Some(Teller { part, exported });
            }
            let (task, ExportedSignal::Command(output_node)) = net.output_node(name)? else { return None };
            let output_node = retained[task][0].iter().position(|own| *own == output_node)?;
            Some(Teller { part: numbers[task]?, exported: ExportedSignal::Command(output_node) })
        };
        let reads = |names: &[String]| -> Vec<(usize, Teller)> {
            names.iter().enumerate().filter_map(|(k, name)| Some((k, teller(name)?))).collect()
        };
        let parts = (0..tasks.len()).filter(|task| numbers[*task].is_some()).map(|task| {
            let LinearTask { linear, exact, rounding, clock, references, sensors, .. } = &tasks[task];
            let used = |k: &usize| {
                [&linear.errors, &linear.on_errors].iter().any(|of| (0..of.rows()).any(|i| of[(i, *k)] != 0.0))
            };
            let read: Vec<usize> = (0..sensors.len()).filter(used).collect();
            let sensors: Vec<OutputSignal> = read.iter().map(|k| sensors[*k].clone()).collect();
            let own: [&[usize]; 3] = [&retained[task][0], &retained[task][1], &read];
            let part = SampledPart::reading(&sensors, plant, *clock, (linear.part(own), Vec::new()));
            let exact = exact.as_ref().map(|exact| Arc::new(exact.part(own)));
            let rounding = rounding.as_ref().map(|rounding| Arc::new(rounding.part(own)));
            SampledPart { reads: reads(references), exact, rounding, ..part }
        });
        let mut parts: Vec<SampledPart> = parts.collect();
        parts.extend(torques.iter().filter_map(|torque| acting(torque, &teller, plant)));
        let reads = laws.iter().map(|law| reads(&law.references)).collect();
        let names = closed
            .iter()
            .filter_map(|(task, exported)| Some(tasks[*task].outputs[output_node(exported)?].clone()))
            .collect();
        let place = |task: usize, exported: &ExportedSignal| match exported {
            ExportedSignal::Command(k) => *k,
            ExportedSignal::State(k) => tasks[task].outputs.len() + k,
        };
        let kinks =
            closed.iter().filter_map(|(task, exported)| tasks[*task].kinks.get(place(*task, exported)).cloned());
        let kinks = kinks.chain(torques.iter().map(|torque| torque.kinks.clone()));
        Self { parts, reads, names, kinks: kinks.collect() }
    }

    /// Kinks and jumps of those that are in the loop, in this order.
    pub fn kinks(&self) -> &Kinks {
        &self.kinks
    }

    /// Whether no loop closes through blocks.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty() && self.reads.iter().all(Vec::is_empty)
    }

    /// Names of the outputs that are in the loop.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether all of them compute at every instant.
    pub fn is_continuous(&self) -> bool {
        self.parts.iter().all(|part| part.clock.is_none())
    }

    /// How many entries they add to the state of a loop.
    pub fn size(&self) -> usize {
        self.parts.iter().map(|part| part.linear.states.rows() + part.outputs() + part.slow.len()).sum()
    }

    /// Whether all of them compute, and what they read is read, at this sample time or at every instant.
    pub fn has_sample_time(&self, period: f64) -> bool {
        let slow = self.parts.iter().flat_map(|part| part.slow.iter().map(|(_, sensor)| sensor.period));
        let mut all = self.parts.iter().filter_map(|part| Some(part.clock?.period)).chain(slow);
        all.all(|candidate| (candidate / period - 1.0).abs() < 1e-9)
    }

    /// The parts of a loop with them: laws first, in their order.
    pub fn join(&self, mut parts: Vec<SampledPart>) -> Vec<SampledPart> {
        for (part, reads) in parts.iter_mut().zip(&self.reads) {
            part.reads.clone_from(reads);
        }
        parts.extend(self.parts.iter().cloned());
        parts
    }
}

/// A torque that follows from blocks, as a part that acts at every instant; `None` if it does not act on the plant.
fn acting(torque: &BlockTorque, teller: &dyn Fn(&str) -> Option<Teller>, plant: &LoopPlant) -> Option<SampledPart> {
    let slopes: Vec<(Teller, f64)> =
        torque.on_outputs.iter().filter_map(|(name, slope)| Some((teller(name)?, *slope))).collect();
    if slopes.is_empty() && torque.on_positions.is_empty() && torque.on_rates.is_empty() {
        return None;
    }
    let input = plant.inputs.iter().position(|name| *name == torque.element).expect("an input for each torque");
    let shafts = plant.basis.rows();
    let over = |entries: &[(usize, f64)]| {
        let mut out = Matrix::zeros(1, shafts);
        entries.iter().for_each(|(shaft, x)| out[(0, *shaft)] += x);
        out
    };
    let on_references = Matrix::from_fn(1, slopes.len(), |_, k| slopes[k].1);
    let linear = LinearLaw::gains(over(&torque.on_positions), over(&torque.on_rates), on_references);
    let part = SampledPart::reading(&[], plant, None, (linear, vec![input]));
    Some(SampledPart { reads: slopes.into_iter().map(|(teller, _)| teller).enumerate().collect(), ..part })
}
