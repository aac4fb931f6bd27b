//! How a machine is put together.

use std::ops::Range;
use std::sync::Arc;

use super::Machine;
use super::bends::Bends;
use super::expressions::{Found, Parts, Places, extend};
use super::flow::Flow;
use super::hold_kinds::Holds;
use super::meshes::Meshes;
use super::response::Response;
use super::sharing::Sharing;
use super::slider_springs::Sliders;
use super::timed::Timed;
use super::watched::WatchedRows;
use super::wired::{Computer, Setup, Wired};
use crate::assemble::{Along, Equations};
use crate::equations::InputKind;
use crate::equations::Measured;
use crate::expr::Expr;
use crate::names::SignalName;
use crate::num::{Cholesky, Matrix};
use crate::program::Task;
use crate::reduce::{Dynamics, Motion, Reduced, Work};
use crate::simulate::clocked::Clocked;
use crate::simulate::drive::Drive;
use crate::simulate::friction::{BoxProblem, Mode};
use crate::simulate::scenario::{Profile, Scenario, Source, SourceTarget};
use crate::synthesis::{Law, LinearLaw, Running, Seen, TaskLaw, Told};

/// What drives the inputs; `size` grows by their states.
fn drives(equations: &Equations, scenario: &Scenario, size: &mut usize) -> Vec<Drive> {
    let mut place = |needed: bool| {
        needed.then(|| {
            *size += 1;
            *size - 1
        })
    };
    let drive = |input: &Along<InputKind>| {
        let motor = match &input.value {
            InputKind::Motor(motor) => motor.clone(),
            InputKind::Disturbance => Default::default(),
        };
        let states = [place(motor.rate_limit.is_some()), place(motor.lag.is_some())];
        let own = scenario.faults.motors.iter().filter(|fault| fault.name == input.element);
        Drive::new(&motor, equations.domain_of(input), states, own.cloned().collect())
    };
    equations.inputs.iter().map(drive).collect()
}

/// Difference of a law from its linear part, relative to what cancels, that rounding may make.
const ROUNDING: f64 = 1e-9;

/// Whether what runs of a law is its linear part, tried at one point: a law may be another one than it says.
fn is_linear(law: &mut Running, part: &LinearLaw, references: usize) -> bool {
    let numbers = |count: usize, turn: usize| -> Vec<f64> {
        (0..count).map(|k| 0.1 * ((k * 7 + turn * 5) % 11) as f64 - 0.45).collect()
    };
    let (shafts, states) = (part.on_angles.columns(), part.states.columns());
    let (angles, speeds) = (numbers(shafts, 1), numbers(shafts, 2));
    let (references, own, torques) = (numbers(references, 3), numbers(states, 4), numbers(part.torques.columns(), 5));
    let seen = Seen {
        time: 0.0,
        angles: &angles,
        speeds: &speeds,
        disturbances: &[],
        references: &references,
        readings: &[],
        states: &own,
    };
    let agrees = |parts: &[(&Matrix<f64>, &[f64])], found: &[f64]| {
        found.iter().enumerate().all(|(i, found)| {
            let terms = || parts.iter().flat_map(|(matrix, x)| matrix.row(i).iter().zip(*x).map(|(m, x)| m * x));
            let size: f64 = terms().map(f64::abs).sum();
            (terms().sum::<f64>() - found).abs() <= ROUNDING * size
        })
    };
    let (mut commands, mut rates) = (vec![0.0; part.on_angles.rows()], vec![0.0; states]);
    law.command(seen, &mut commands);
    law.rates(seen, &torques, &mut rates);
    let on_commands = [
        (&part.on_states, &own),
        (&part.on_angles, &angles),
        (&part.on_speeds, &speeds),
        (&part.on_references, &references),
    ];
    let on_rates = [
        (&part.states, &own),
        (&part.angles, &angles),
        (&part.speeds, &speeds),
        (&part.torques, &torques),
        (&part.references, &references),
    ];
    agrees(&on_commands.map(|(matrix, x)| (matrix, x.as_slice())), &commands)
        && agrees(&on_rates.map(|(matrix, x)| (matrix, x.as_slice())), &rates)
}

/// The number of the source that a law reads or answers by that name; that of its signal for a sensor of one.
fn source_of(name: &str, setup: &Setup<'_>) -> usize {
    let equations = &setup.reduced.equations;
    let sensor = equations.signal_sensors.iter().find(|(sensor, _)| sensor == name);
    let signal = match sensor.map(|(_, sensor)| &sensor.measured) {
        Some(Measured::Signal(signal)) => signal,
        _ => name,
    };
    let found = setup.scenario.sources.iter().position(|source| source.name == signal);
    found.unwrap_or_else(|| panic!("`{signal}`, which is read or answered, is a source"))
}

/// A law among the inputs and sources of a run; `size` grows by its states.
fn wired(law: &Arc<dyn Law>, setup: &Setup<'_>, drives: &[Drive], size: &mut usize) -> Wired {
    let (inputs, scenario) = (&setup.reduced.equations.inputs, setup.scenario);
    let input = |name: &String| inputs.iter().position(|i| i.element == *name).expect("a law commands inputs");
    let inputs: Vec<usize> = law.inputs().iter().map(input).collect();
    let references: Vec<usize> = law.references().iter().map(|reference| source_of(&reference.name, setup)).collect();
    let first = *size;
    let limits: Vec<Option<f64>> = inputs.iter().map(|&input| drives[input].limit).collect();
    // A law with states may keep them from winding up at the limits.
    let winds_up = !law.states().is_empty() && limits.iter().any(Option::is_some);
    let computer = match law.clock() {
        Some(clock) => Computer::Clocked(Box::new(Clocked::new(&**law, clock, setup.reduced, scenario))),
        None => {
            *size += law.states().len();
            let linear = !law.bends() && law.friction_width().is_none() && !winds_up;
            let (mut running, part) = (law.run(), linear.then(|| law.linear()));
            match (part.filter(|part| is_linear(&mut running, part, references.len())), law.task()) {
                (Some(part), _) => Computer::Linear(Box::new(part)),
                (None, Some(task)) => Computer::Written(Arc::clone(task)),
                (None, None) => Computer::Continuous(running),
            }
        }
    };
    Wired {
        computer,
        reference_values: vec![0.0; references.len()],
        commands: vec![0.0; inputs.len()],
        torques: vec![0.0; inputs.len()],
        states: first..*size,
        limits,
        inputs,
        answers: Vec::new(),
        told: told(&**law, scenario),
        references,
        law: Arc::clone(law),
    }
}

/// The sources that are what a law tells blocks.
fn told(law: &dyn Law, scenario: &Scenario) -> Vec<(usize, Told)> {
    let dotted =
        |source: &Source| source.target == SourceTarget::Block && SignalName::new(&source.name).alone().is_none();
    if law.clock().is_none() || !scenario.sources.iter().any(dotted) {
        return Vec::new();
    }
    let controller = law.describe().controller;
    let numbered = |(name, told): (String, Told)| {
        let name = format!("{controller}.{name}");
        Some((scenario.sources.iter().position(|source| source.name == name)?, told))
    };
    law.tells().into_iter().filter_map(numbered).collect()
}

/// A task of blocks: its answers are sources.
fn task(task: &Arc<Task>, setup: &Setup<'_>) -> Wired {
    let law: Arc<dyn Law> = Arc::new(TaskLaw::new(task, setup.reduced));
    let source = |name: &str| source_of(name, setup);
    let clock = law.clock().expect("a task has a clock");
    let answers: Vec<usize> = law.inputs().iter().map(|name| source(name)).collect();
    let references: Vec<usize> = law.references().iter().map(|reference| source(&reference.name)).collect();
    Wired {
        computer: Computer::Clocked(Box::new(Clocked::new(&*law, clock, setup.reduced, setup.scenario))),
        reference_values: vec![0.0; references.len()],
        commands: vec![0.0; answers.len()],
        torques: Vec::new(),
        states: 0..0,
        limits: vec![None; answers.len()],
        inputs: Vec::new(),
        answers,
        told: Vec::new(),
        references,
        law,
    }
}

/// Blocks, which compute before what reads them, then the laws; `size` grows by their states.
fn all_wired(setup: &Setup<'_>, drives: &[Drive], size: &mut usize) -> Vec<Wired> {
    let mut all: Vec<Wired> = setup.scenario.tasks.iter().map(|one| task(one, setup)).collect();
    all.extend(setup.laws.iter().map(|law| wired(law, setup, drives, size)));
    all
}

/// The steps and ramps of each source.
fn profiles(scenario: &Scenario) -> Vec<Profile> {
    let profile = |k| Profile::new(scenario.events.iter().filter(|event| event.source == k));
    (0..scenario.sources.len()).map(profile).collect()
}

/// The expressions of a loop, compiled, and where what is given and found stands among them.
struct Compiled {
    dynamics: Dynamics,
    work: Work,
    places: Places,
    timed: Timed,
    bends: Bends,
    meshes: Meshes,
    moving: Vec<bool>,
}

impl Compiled {
    fn new(
        reduced: &Reduced,
        scenario: &Scenario,
        (parts, states): (Parts<'_>, Range<usize>),
        also: impl FnOnce(&mut Motion, &Found) -> Vec<Expr>,
    ) -> Self {
        let (mut places, mut timed, mut bends, mut meshes) = Default::default();
        let mut moving = vec![false; reduced.equations.set_valued().count() + reduced.equations.kept.len()];
        let (dynamics, work) = Dynamics::extended(reduced, |motion| {
            let (mut extension, mut found, sources, leaps) = extend(motion, reduced, parts, states);
            bends = Bends::new(motion, &leaps, (&extension, &found));
            timed = Timed::new(motion, scenario, (&extension, &found), &sources);
            meshes = Meshes::new(motion, reduced, &extension.inputs);
            if reduced.equations.prescribes() {
                moving = motion.prescribed_directions(reduced);
            }
            let more = also(motion, &Found::new(&extension, &found, sources));
            found.also = extension.outputs.len()..extension.outputs.len() + more.len();
            extension.outputs.extend(more.into_iter().enumerate().map(|(k, expr)| (format!("also.{k}"), expr)));
            places = found;
            extension
        });
        Self { dynamics, work, places, timed, bends, meshes, moving }
    }
}

impl Machine {
    /// Wires plant, laws and scenario.
    ///
    /// # Panics
    /// If a law names an input or reference that does not exist (the model checks this before).
    pub fn new(setup: Setup<'_>) -> Self {
        Self::with(setup, |_, _| ())
    }

    /// The same, with something made of the same expressions.
    pub(in crate::simulate) fn with(setup: Setup<'_>, also: impl FnOnce(&mut Motion, &Found)) -> Self {
        Self::finding(setup, |motion, found| {
            also(motion, found);
            Vec::new()
        })
    }

    /// The same, with what else of them is to be found at each evaluation.
    pub(in crate::simulate) fn finding(setup: Setup<'_>, also: impl FnOnce(&mut Motion, &Found) -> Vec<Expr>) -> Self {
        let (reduced, scenario) = (setup.reduced, setup.scenario);
        let (r, m) = (reduced.degrees_of_freedom(), reduced.equations.set_valued().count());
        let kept = m..m + reduced.equations.kept.len();
        let (inputs, mut size) = (reduced.equations.inputs.len(), 2 * r);
        let drives = drives(&reduced.equations, scenario, &mut size);
        let laws = all_wired(&setup, &drives, &mut size);
        let flow = Flow::new(scenario, &mut size);
        let targets: Vec<_> = scenario.sources.iter().map(|source| source.target).collect();
        let parts =
            Parts { drives: &drives, laws: &laws, targets: &targets, signals: &scenario.signals, flow: flow.as_ref() };
        let Compiled { dynamics, work, places, timed, bends, meshes, moving } =
            Compiled::new(reduced, scenario, (parts, 2 * r..size), also);
        let (sliders, holds) = (Sliders::new(reduced), Holds::new(&reduced.equations));
        let bounds = holds.bounds(dynamics.breakaway_torques(), kept.len());
        let mut out = Self {
            relaxes: reduced.relaxation.is_some(),
            directions: (0..m).filter(|k| !sliders.directions.contains(k) && !holds.only_presses(*k)).collect(),
            sliders,
            holds,
            meshes,
            bounds,
            own_laws: laws.iter().any(Wired::is_own),
            held: vec![0.0; inputs],
            places,
            laws,
            targets,
            lines: vec![(0.0, 0.0, 0.0); scenario.sources.len()],
            sources: vec![0.0; scenario.sources.len()],
            profiles: profiles(scenario),
            signals: scenario.signals.clone(),
            flow,
            timed,
            bends,
            modes: vec![Mode::Stick; m],
            holding: if kept.is_empty() { Vec::with_capacity(r) } else { kept.clone().collect() },
            following: Vec::with_capacity(m),
            turning: Vec::new(),
            moves: moving.contains(&true),
            moving,
            still: Vec::with_capacity(r),
            stands: false,
            step_length: 0.0,
            step_speeds: vec![0.0; r],
            degrees_of_freedom: r,
            size: size + 2,
            commands: vec![0.0; inputs],
            torques: vec![0.0; inputs],
            applied: vec![0.0; inputs],
            force: vec![0.0; r],
            acceleration: vec![0.0; r],
            weighted: vec![0.0; kept.end * r],
            weighted_parts: vec![0..r; kept.end],
            hold_matrix: vec![0.0; kept.end * kept.end],
            hold_factor: Cholesky::new(0),
            hold_torque: vec![0.0; kept.end],
            hold_constant: false,
            hold_known: false,
            sharing_known: false,
            sharing: Sharing::new(kept.end, r),
            box_problem: BoxProblem::new(m),
            contradiction: Vec::new(),
            response: Response::new(r),
            expansion: None,
            resolved: None,
            jacobian: None,
            evaluated: 0,
            scratch: vec![0.0; r.max(kept.end)],
            friction_torques: vec![0.0; kept.end],
            watched: WatchedRows::new(kept.len(), r),
            kept: kept.clone(),
            drives,
            dynamics,
            work,
        };
        if !kept.is_empty() {
            out.prepare_holding();
        }
        out
    }
}
