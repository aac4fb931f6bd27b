//! Blocks between the laws of a variant, where its loop stands.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::PreparedVariant;
use crate::reduce::{Kinematics, OperatingPoint, answered_locks, answered_torques};
use crate::simulate::Profile;
use crate::synthesis::{BesideBlocks, Law, LinearTask, LoopBlocks, LoopPlant, SampledPart, Seen, TaskLaw, Told};

/// Samples after which blocks stand as they do at rest; those that never do (integrators) are linear.
const SETTLED: usize = 1000;

/// A task, what it remembers, and what it reads from others.
struct Standing {
    law: TaskLaw,
    memory: Vec<f64>,
    references: Vec<f64>,
}

/// Blocks around where they stand with the plant at rest.
pub(super) struct Blocks {
    /// What the loop closes through.
    pub of_loop: LoopBlocks,
    /// Locks that follow from them and are engaged there.
    pub engaged: Vec<String>,
    /// Whether some of them bend or switch, so that elsewhere they do otherwise.
    pub bend: bool,
}

/// Whether maps have the blocks of a variant: those with a sample time are left out where no law has one.
pub(super) fn are_in_maps(variant: &PreparedVariant) -> bool {
    variant.scenario.tasks.is_empty() || variant.running.iter().any(|law| law.clock().is_some())
}

/// The parts of a loop: laws, and the blocks through which it closes.
pub(super) fn with_blocks(variant: &PreparedVariant, plant: &LoopPlant, laws: Vec<SampledPart>) -> Vec<SampledPart> {
    blocks(variant, plant).of_loop.join(laws)
}

/// The blocks that a variant's loop closes through, linear around where they stand with the plant at rest where its run begins, and signals as they
/// begin there. Blocks with a sample time beside laws in continuous time are taken as given.
pub(super) fn loop_blocks(variant: &PreparedVariant, plant: &LoopPlant) -> LoopBlocks {
    blocks(variant, plant).of_loop
}

/// The same, and whether they bend.
pub(super) fn blocks(variant: &PreparedVariant, plant: &LoopPlant) -> Blocks {
    // What blocks begin with fits there.
    blocks_at(variant, plant, &variant.scenario.position)
}

/// The same with the plant at rest at a reduced position, rad.
pub(super) fn blocks_at(variant: &PreparedVariant, plant: &LoopPlant, position: &[f64]) -> Blocks {
    let PreparedVariant { model, reduced, running: laws, scenario, .. } = variant;
    let seen = are_in_maps(variant);
    let tasks = scenario.flow.iter().chain(scenario.tasks.iter().filter(|_| seen));
    let tasks: Vec<TaskLaw> = tasks.map(|task| TaskLaw::new(task, reduced)).collect();
    if tasks.is_empty() || laws.len() != model.controls.len() {
        return Blocks { of_loop: LoopBlocks::default(), engaged: Vec::new(), bend: false };
    }
    let mut kinematics = Kinematics::new(reduced);
    kinematics.update(position, &variant.point.rates);
    let at_rest = [&kinematics.angles[..], &kinematics.speeds[..]];
    let beside: Vec<BesideBlocks> =
        model.controls.iter().zip(laws).map(|(control, law)| beside(&control.name, law)).collect();
    let mut answers = known(variant, &beside, at_rest);
    let bend = tasks.iter().any(|task| task.bends());
    let tasks = linear_tasks(tasks, &mut answers, at_rest);
    let point = OperatingPoint { position: position.to_vec(), ..variant.point.clone() };
    let answer = |name: &str| answers.get(name).copied().unwrap_or(0.0);
    let torques = if seen { answered_torques(reduced, &point, &answer) } else { Vec::new() };
    let of_loop = LoopBlocks::new(&tasks, &beside, &torques, plant);
    Blocks { of_loop, engaged: answered_locks(reduced, &point, &answer), bend }
}

/// A law as blocks know it.
fn beside(name: &str, law: &Arc<dyn Law>) -> BesideBlocks {
    let linear = law.linear();
    let follows = |k: usize| {
        [&linear.references, &linear.on_references].iter().any(|of| (0..of.rows()).any(|i| of[(i, k)] != 0.0))
    };
    let references = law.references().iter().enumerate();
    let references = references.map(|(k, one)| if follows(k) { one.name.clone() } else { String::new() }).collect();
    let tells = if law.clock().is_some() { law.tells() } else { Vec::new() };
    let tells = tells.into_iter().map(|(told, place)| (format!("{name}.{told}"), place)).collect();
    BesideBlocks { references, tells }
}

/// What signals are at the begin, and what laws tell at rest.
fn known(variant: &PreparedVariant, beside: &[BesideBlocks], [angles, speeds]: [&[f64]; 2]) -> BTreeMap<String, f64> {
    let scenario = &variant.scenario;
    let value = |number: usize| {
        let stepped = Profile::new(scenario.events.iter().filter(|event| event.source == number)).value(0.0);
        let follows = scenario.signals.iter().find(|signal| signal.source == number);
        stepped + follows.map_or(0.0, |signal| signal.function.value(0.0))
    };
    let sources = scenario.sources.iter().enumerate();
    let mut out: BTreeMap<String, f64> = sources.map(|(number, source)| (source.name.clone(), value(number))).collect();
    for (law, own) in variant.running.iter().zip(beside) {
        let mut states = vec![0.0; law.states().len()];
        law.start(angles, speeds, &mut states);
        for (name, told) in &own.tells {
            if let Told::State(k) = told {
                out.insert(name.clone(), states[*k]);
            }
        }
    }
    out
}

/// Tasks around where they stand after some samples at rest.
fn linear_tasks(laws: Vec<TaskLaw>, known: &mut BTreeMap<String, f64>, at_rest: [&[f64]; 2]) -> Vec<LinearTask> {
    let [angles, speeds] = at_rest;
    let standing = |law: TaskLaw| {
        let mut memory = vec![0.0; law.states().len()];
        law.start(angles, speeds, &mut memory);
        Standing { references: vec![0.0; law.references().len()], memory, law }
    };
    let mut all: Vec<Standing> = laws.into_iter().map(standing).collect();
    let mut running: Vec<_> = all.iter().map(|one| one.law.run()).collect();
    for _ in 0..SETTLED {
        let mut changed = false;
        for (one, running) in all.iter_mut().zip(&mut running) {
            for (value, reference) in one.references.iter_mut().zip(one.law.references()) {
                *value = known.get(&reference.name).copied().unwrap_or(0.0);
            }
            let names = one.law.inputs();
            let (mut answers, mut next) = (vec![0.0; names.len()], one.memory.clone());
            let seen = seen(at_rest, &one.references, &one.memory);
            running.command(seen, &mut answers);
            if one.law.clock().is_some() {
                running.next(seen, &answers, &mut next);
                changed |= next != one.memory;
                one.memory = next;
            }
            for (name, answer) in names.iter().zip(answers) {
                changed |= known.insert(name.clone(), answer) != Some(answer);
            }
        }
        if !changed {
            break;
        }
    }
    all.iter().map(|one| one.law.around(&seen(at_rest, &one.references, &one.memory))).collect()
}

fn seen<'a>([angles, speeds]: [&'a [f64]; 2], references: &'a [f64], states: &'a [f64]) -> Seen<'a> {
    Seen { time: 0.0, angles, speeds, disturbances: &[], references, readings: &[], states }
}
