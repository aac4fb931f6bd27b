//! Blocks between the laws of a variant, at the operating point of its loop.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use crate::study::PreparedVariant;
use crate::study::check::effort::MOST_STATES;
use crate::study::prepared::Settled;
use kardan_expr::expr::{Expr, Symbol};
use kardan_math::num::Matrix;
use kardan_mechanics::program::{Read, Task};
use kardan_mechanics::reduce::{Kinematics, OperatingPoint, block_locks, block_torques};
use kardan_simulate::{Profile, Scenario};
use kardan_synthesis::{BesideBlocks, ExportedSignal, Law, LinearTask, LoopBlocks, LoopPlant, Observation, TaskLaw};

/// Controllers up to which a loop is examined before a run.
pub(in crate::study) const MOST_CONTROLLERS: usize = 20;
/// Samples after which blocks are at their steady state; those that never are (integrators) are linear.
const SETTLED: usize = 1000;

/// A task, its states, and the positions of its inputs and outputs among all values.
struct RestingTask {
    law: TaskLaw,
    memory: Vec<f64>,
    next: Vec<f64>,
    reads: Vec<usize>,
    references: Vec<f64>,
    places: Vec<usize>,
    outputs: Vec<f64>,
}

/// Linearised blocks, with the plant at rest.
pub(in crate::study) struct Blocks {
    /// Blocks and laws that the loop closes through.
    pub of_loop: LoopBlocks,
    /// Locks that depend on them and are engaged there.
    pub engaged: Vec<String>,
    /// Whether some of them are nonlinear or switch, so that they behave differently elsewhere.
    pub nonlinear: bool,
    /// Those with zero gain there, as they are at a limit or in a dead zone.
    pub flat: Vec<String>,
}

/// Whether maps include the blocks of a variant: those with a sample time are left out if no law has one.
pub(in crate::study) fn are_in_maps(variant: &PreparedVariant) -> bool {
    variant.scenario.tasks.is_empty() || variant.implemented.iter().any(|law| law.clock().is_some())
}

/// The blocks that a variant's loop closes through, linearised with the plant at rest at the start of its run, and the initial values of
/// signals. With continuous-time laws, blocks with a sample time are treated as independent inputs.
pub(in crate::study) fn blocks(variant: &PreparedVariant, plant: &LoopPlant) -> Blocks {
    blocks_at(variant, plant, &variant.scenario.position)
}

/// The same with the plant at rest at a reduced position, rad.
pub(in crate::study) fn blocks_at(variant: &PreparedVariant, plant: &LoopPlant, position: &[f64]) -> Blocks {
    let PreparedVariant { model, reduced, implemented: laws, scenario, .. } = variant;
    let in_maps = are_in_maps(variant);
    let none_in_maps = scenario.tasks.is_empty() && scenario.sensors.is_empty() || !in_maps;
    if scenario.flow.is_none() && none_in_maps || laws.len() != model.controls.len() {
        return Blocks { of_loop: LoopBlocks::default(), engaged: Vec::new(), nonlinear: false, flat: Vec::new() };
    }
    let beside = beside_all(variant);
    // The initial values of blocks fit the start of the run, which most requests need.
    let elsewhere;
    let settled = if position == scenario.position {
        variant.settled.get_or_init(|| settled(variant, &beside, position))
    } else {
        elsewhere = settled(variant, &beside, position);
        &elsewhere
    };
    let point = OperatingPoint { position: position.to_vec(), ..variant.point.clone() };
    let output = |name: &str| settled.outputs.get(name).copied().unwrap_or(0.0);
    let torques = if in_maps { block_torques(reduced, &point, &output) } else { Vec::new() };
    let of_loop = LoopBlocks::new(&settled.tasks, &beside, &torques, plant);
    Blocks {
        of_loop,
        engaged: block_locks(reduced, &point, &output),
        nonlinear: settled.nonlinear,
        flat: settled.flat.clone(),
    }
}

/// What makes a loop too large for an examination before a run.
pub(in crate::study) enum TooLarge {
    /// So many controllers.
    Controllers(usize),
    /// So many states of its laws, and of the blocks that it may close through.
    States(usize),
}

/// Whether the loop of a variant is too large for an examination before a run.
pub(in crate::study) fn too_large(variant: &PreparedVariant) -> Option<TooLarge> {
    let laws = &variant.implemented;
    if laws.len() > MOST_CONTROLLERS {
        return Some(TooLarge::Controllers(laws.len()));
    }
    let of_laws: usize = laws.iter().map(|law| law.states().len()).sum();
    let tasks = variant.scenario.flow.iter().chain(&variant.scenario.sensors).chain(&variant.scenario.tasks);
    let most = of_laws + tasks.map(|task| task.states.len()).sum::<usize>();
    if most <= MOST_STATES {
        return None;
    }
    if of_laws > MOST_STATES {
        return Some(TooLarge::States(of_laws));
    }
    let (tasks, rows) = loop_rows(variant, &beside_all(variant));
    let of_one = |(task, rows): (&Arc<Task>, &Vec<usize>)| rows.iter().filter(|k| **k >= task.outputs.len()).count();
    let states = of_laws + tasks.iter().zip(&rows).map(of_one).sum::<usize>();
    (states > MOST_STATES).then_some(TooLarge::States(states))
}

/// The laws of a variant in the terms of blocks.
fn beside_all(variant: &PreparedVariant) -> Vec<BesideBlocks> {
    let controls = variant.model.controls.iter().zip(&variant.implemented);
    controls.map(|(control, law)| beside(&control.name, law)).collect()
}

/// The tasks of a variant, and the rows of each through which its loop may close.
fn loop_rows(variant: &PreparedVariant, beside: &[BesideBlocks]) -> (Vec<Arc<Task>>, Vec<Vec<usize>>) {
    let PreparedVariant { reduced, scenario, .. } = variant;
    let in_maps = are_in_maps(variant);
    let sampled = scenario.sensors.iter().chain(&scenario.tasks).filter(|_| in_maps);
    let tasks: Vec<Arc<Task>> = scenario.flow.iter().chain(sampled).cloned().collect();
    let used = reduced.equations.laws.iter().flat_map(|law| law.value.blocks());
    let used: Vec<&str> = used.chain(beside.iter().flat_map(|law| &law.references).map(String::as_str)).collect();
    let from_law = |name: &str| beside.iter().any(|law| law.exported.iter().any(|(own, _)| own == name));
    let rows = in_loop(&tasks, &from_law, &used);
    (tasks, rows)
}

/// The steady state of the blocks of a variant with the plant at rest at a reduced position, rad.
fn settled(variant: &PreparedVariant, beside: &[BesideBlocks], position: &[f64]) -> Settled {
    let reduced = &variant.reduced;
    let (tasks, rows) = loop_rows(variant, beside);
    let kinematics = Kinematics::at(reduced, position, &variant.point.rates);
    let at_rest = [&kinematics.angles[..], &kinematics.speeds[..]];
    let mut outputs = signals_at_rest(variant, beside, at_rest);
    let law = |(task, rows): (&Arc<Task>, &Vec<usize>)| {
        let mut with_slopes = [&rows[..], &flat_rows(task)].concat();
        with_slopes.sort_unstable();
        with_slopes.dedup();
        TaskLaw::new(task, reduced).on(&variant.point.side).with_slopes_among(&with_slopes)
    };
    let laws: Vec<TaskLaw> = tasks.iter().zip(&rows).map(law).collect();
    let nonlinear = laws.iter().any(|law| law.is_nonlinear());
    // A task through which no loop can close is not part of one, whatever its slopes.
    let closes = |number: usize| !rows[number].is_empty() || !flat_rows(&tasks[number]).is_empty();
    let numbers: Vec<usize> = (0..tasks.len()).filter(|number| closes(*number)).collect();
    let linear = linear_tasks((laws, &rows, &numbers), &mut outputs, at_rest);
    let flat = numbers.iter().zip(&linear).flat_map(|(number, linear)| flat(&tasks[*number], linear)).collect();
    Settled { tasks: linear, outputs, nonlinear, flat }
}

/// For each task the outputs, then the states, through which a loop may close: they may depend on coordinates, sensors or outputs of a law, and the plant
/// or a law may use them, by these names.
fn in_loop(tasks: &[Arc<Task>], from_law: &dyn Fn(&str) -> bool, used: &[&str]) -> Vec<Vec<usize>> {
    type Row = (usize, usize);
    let mut outputs: HashMap<&str, Row> = HashMap::new();
    for (number, task) in tasks.iter().enumerate() {
        for (row, output) in task.outputs.iter().enumerate() {
            outputs.entry(&output.name).or_insert((number, row));
        }
    }
    let output = |name: &str| outputs.get(name).copied();
    // Direct feedthrough to each row: from something that moves, and from which other rows.
    let (mut moving, mut before, mut behind) =
        (Vec::new(), HashMap::<Row, Vec<Row>>::new(), HashMap::<Row, Vec<Row>>::new());
    for (number, task) in tasks.iter().enumerate() {
        let reads: HashMap<Symbol, &Read> = task.reads.iter().map(|(symbol, read)| (*symbol, read)).collect();
        let states: HashMap<Symbol, usize> = task.states.iter().map(|entry| entry.symbol).zip(0..).collect();
        let exprs: Vec<Expr> = task.outputs().into_iter().map(|(_, expr)| expr).collect();
        for (row, symbols) in task.graph.symbols_of_each(&exprs).into_iter().enumerate() {
            let (own, mut from) = ((number, row), Vec::new());
            let mut is_driven = false;
            for symbol in symbols.iter() {
                match reads.get(symbol) {
                    Some(Read::Source(name)) => {
                        is_driven |= from_law(name);
                        from.extend(output(name));
                    }
                    Some(Read::Sensor(name) | Read::AsRead(name)) => {
                        is_driven = true;
                        from.extend(output(name));
                    }
                    Some(Read::Position(_) | Read::Rate(_)) => is_driven = true,
                    Some(Read::Time) => {}
                    None => from.extend(states.get(symbol).map(|k| (number, task.outputs.len() + k))),
                }
            }
            moving.extend(is_driven.then_some(own));
            from.iter().for_each(|one| behind.entry(*one).or_default().push(own));
            before.insert(own, from);
        }
    }
    let mut driven: HashSet<Row> = HashSet::new();
    while let Some(row) = moving.pop() {
        if driven.insert(row) {
            moving.extend(behind.get(&row).into_iter().flatten());
        }
    }
    let mut open: Vec<Row> = used.iter().filter_map(|name| output(name)).collect();
    let mut out = vec![Vec::new(); tasks.len()];
    while let Some(row) = open.pop() {
        if driven.remove(&row) {
            out[row.0].push(row.1);
            open.extend(before.get(&row).into_iter().flatten());
        }
    }
    out.iter_mut().for_each(|rows| rows.sort_unstable());
    out
}

/// Kinds of blocks that have zero gain at a limit or in a dead zone.
const FLAT: [&str; 4] = ["saturation", "dead_zone", "table", "pid"];

/// Rows of the outputs of these blocks.
fn flat_rows(task: &Task) -> Vec<usize> {
    let steps = task.order.iter().filter(|step| FLAT.contains(&step.kind));
    let places: HashMap<&str, usize> = task.outputs.iter().map(|output| output.name.as_str()).zip(0..).collect();
    steps.filter_map(|step| places.get(step.block.as_str()).copied()).collect()
}

/// Those of them whose output has no slope over any of its inputs.
fn flat<'a>(task: &'a Task, linear: &'a LinearTask) -> impl Iterator<Item = String> + 'a {
    let slopes = move |row: usize| {
        let linear = &linear.linear;
        [&linear.on_states, &linear.on_angles, &linear.on_speeds, &linear.on_references, &linear.on_errors]
            .into_iter()
            .any(|over| over.row(row).iter().any(|slope| *slope != 0.0))
    };
    let rows = flat_rows(task).into_iter().filter(move |row| !slopes(*row));
    rows.map(|row| task.outputs[row].name.clone())
}

/// A law in the terms of blocks.
fn beside(name: &str, law: &Arc<dyn Law>) -> BesideBlocks {
    let linear = law.linear();
    // States that affect commands, directly or through others.
    let not_zero = |of: &Matrix<f64>, rows: &[usize], column: usize| rows.iter().any(|row| of[(*row, column)] != 0.0);
    let commands: Vec<usize> = (0..linear.on_states.rows()).collect();
    let all = 0..linear.states.rows();
    let mut open: Vec<usize> = all.clone().filter(|k| not_zero(&linear.on_states, &commands, *k)).collect();
    let mut affects = vec![false; all.len()];
    while let Some(row) = open.pop() {
        if !std::mem::replace(&mut affects[row], true) {
            open.extend(all.clone().filter(|k| !affects[*k] && linear.states[(row, *k)] != 0.0));
        }
    }
    let states: Vec<usize> = all.filter(|k| affects[*k]).collect();
    let follows = |k: usize| not_zero(&linear.on_references, &commands, k) || not_zero(&linear.references, &states, k);
    let references = law.references().iter().enumerate();
    let references = references.map(|(k, one)| if follows(k) { one.name.clone() } else { String::new() }).collect();
    let exported = if law.clock().is_some() { law.exported() } else { Vec::new() };
    let exported = exported.into_iter().map(|(signal, place)| (format!("{name}.{signal}"), place)).collect();
    BesideBlocks { references, exported }
}

/// Values of signals at the start of a run.
pub(in crate::study) fn signals_at_begin(scenario: &Scenario) -> BTreeMap<String, f64> {
    let value = |number: usize| {
        let stepped = Profile::new(scenario.events.iter().filter(|event| event.source == number)).value(0.0);
        let follows = scenario.signals.iter().find(|signal| signal.source == number);
        stepped + follows.map_or(0.0, |signal| signal.function.value(0.0))
    };
    let sources = scenario.sources.iter().enumerate();
    sources.map(|(number, source)| (source.name.clone(), value(number))).collect()
}

/// Values of signals at the start, and outputs of laws at rest.
fn signals_at_rest(
    variant: &PreparedVariant,
    beside: &[BesideBlocks],
    [angles, speeds]: [&[f64]; 2],
) -> BTreeMap<String, f64> {
    let mut out = signals_at_begin(&variant.scenario);
    for (law, own) in variant.implemented.iter().zip(beside) {
        let mut states = vec![0.0; law.states().len()];
        law.start(angles, speeds, &mut states);
        for (name, exported) in &own.exported {
            if let ExportedSignal::State(k) = exported {
                out.insert(name.clone(), states[*k]);
            }
        }
    }
    out
}

/// The values of these numbers after some samples with everything at rest.
fn linear_tasks(
    (laws, rows, numbers): (Vec<TaskLaw>, &[Vec<usize>], &[usize]),
    signals_at_rest: &mut BTreeMap<String, f64>,
    at_rest: [&[f64]; 2],
) -> Vec<LinearTask> {
    let [angles, speeds] = at_rest;
    // Names are looked up once: values are in the order in which their names were added.
    let mut names: Vec<String> = signals_at_rest.keys().cloned().collect();
    let mut values: Vec<Option<f64>> = signals_at_rest.values().copied().map(Some).collect();
    let mut places: BTreeMap<String, usize> = names.iter().cloned().zip(0..).collect();
    let mut place = |name: &String| {
        *places.entry(name.clone()).or_insert_with(|| {
            names.push(name.clone());
            values.push(None);
            values.len() - 1
        })
    };
    let resting_task = |law: TaskLaw| {
        let mut memory = vec![0.0; law.states().len()];
        law.start(angles, speeds, &mut memory);
        let reads: Vec<usize> = law.references().iter().map(|reference| place(&reference.name)).collect();
        let places: Vec<usize> = law.inputs().iter().map(&mut place).collect();
        let (references, outputs) = (vec![0.0; reads.len()], vec![0.0; places.len()]);
        RestingTask { next: memory.clone(), memory, reads, references, places, outputs, law }
    };
    let mut all: Vec<RestingTask> = laws.into_iter().map(resting_task).collect();
    let mut runtimes: Vec<_> = all.iter().map(|one| one.law.run()).collect();
    for _ in 0..SETTLED {
        let mut changed = false;
        for (one, runtime) in all.iter_mut().zip(&mut runtimes) {
            let RestingTask { law, memory, next, reads, references, places, outputs } = one;
            for (value, place) in references.iter_mut().zip(&*reads) {
                *value = values[*place].unwrap_or(0.0);
            }
            let observation = observation(at_rest, references, memory);
            outputs.fill(0.0);
            runtime.command(observation, outputs);
            if law.clock().is_some() {
                next.copy_from_slice(memory);
                runtime.next(observation, outputs, next);
                changed |= next != memory;
                std::mem::swap(memory, next);
            }
            for (place, output) in places.iter().zip(&*outputs) {
                changed |= values[*place].replace(*output) != Some(*output);
            }
        }
        if !changed {
            break;
        }
    }
    signals_at_rest.extend(names.into_iter().zip(values).filter_map(|(name, value)| Some((name, value?))));
    let linearised = |number: &usize| {
        let one = &all[*number];
        one.law.linearised(&observation(at_rest, &one.references, &one.memory), &rows[*number])
    };
    numbers.iter().map(linearised).collect()
}

fn observation<'a>([angles, speeds]: [&'a [f64]; 2], references: &'a [f64], states: &'a [f64]) -> Observation<'a> {
    Observation { time: 0.0, angles, speeds, disturbances: &[], references, readings: &[], states }
}
