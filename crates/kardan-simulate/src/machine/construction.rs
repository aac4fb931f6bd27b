//! Construction of a machine.

use std::sync::Arc;

use super::Machine;
use super::connected_law::{Computer, ConnectedLaw, Setup};
use super::expressions::{Found, Parts, Places, extend};
use super::flow::Flow;
use super::gear_losses::GearLosses;
use super::jenkins_springs::JenkinsElements;
use super::kinks::Kinks;
use super::response::Response;
use super::timed::Timed;
use super::torque_distribution::TorqueDistribution;
use super::unilateral_kinds::Unilaterals;
use super::watched::WatchedRows;
use crate::drive::Drive;
use crate::friction::{BoxProblem, Mode};
use crate::sampled_runtime::SampledRuntime;
use crate::scenario::{Profile, Scenario, Source, SourceTarget};
use kardan_expr::expr::Expr;
use kardan_math::num::{Cholesky, Matrix};
use kardan_mechanics::assemble::{DirectionalTerm, Equations};
use kardan_mechanics::equations::InputKind;
use kardan_mechanics::equations::Measured;
use kardan_mechanics::reduce::{Dynamics, Motion, Work};
use kardan_results::signal_name::SignalName;
use kardan_synthesis::{ExportedSignal, Law, LawRuntime, LinearLaw, Observation, TaskLaw};

/// The drives of the inputs; `size` grows by their states.
fn drives(equations: &Equations, scenario: &Scenario, size: &mut usize) -> Vec<Drive> {
    let mut place = |needed: bool| {
        needed.then(|| {
            *size += 1;
            *size - 1
        })
    };
    let drive = |input: &DirectionalTerm<InputKind>| {
        let motor = match &input.value {
            InputKind::Motor(motor) => motor.clone(),
            InputKind::Disturbance => Default::default(),
        };
        let states = [place(motor.rate_limit.is_some()), place(motor.lag.is_some())];
        let own = scenario.faults.motors.iter().filter(|fault| fault.name == input.element);
        Drive::new(input.element.clone(), &motor, equations.domain_of(input), states, own.cloned().collect())
    };
    equations.inputs.iter().map(drive).collect()
}

/// Difference of a law from its linear part, relative to the terms that cancel, that counts as rounding.
const ROUNDING: f64 = 1e-9;

/// Times at which a law is compared with its linear part, s: what grows with the time is not zero at both.
const TIMES: [f64; 2] = [0.0, 0.731];

/// Whether a law equals its linear part in a run, tested at two points: its description may differ from it, and has no time.
fn is_linear(law: &mut LawRuntime, part: &LinearLaw, references: usize) -> bool {
    let numbers = |count: usize, turn: usize| -> Vec<f64> {
        (0..count).map(|k| 0.1 * ((k * 7 + turn * 5) % 11) as f64 - 0.45).collect()
    };
    let (shafts, states) = (part.on_angles.columns(), part.states.columns());
    let (angles, speeds) = (&numbers(shafts, 1)[..], &numbers(shafts, 2)[..]);
    let (references, own) = (&numbers(references, 3)[..], &numbers(states, 4)[..]);
    let torques = &numbers(part.torques.columns(), 5)[..];
    let agrees = |parts: &[(&Matrix<f64>, &[f64])], found: &[f64]| {
        found.iter().enumerate().all(|(i, found)| {
            let terms = || parts.iter().flat_map(|(matrix, x)| matrix.row(i).iter().zip(*x).map(|(m, x)| m * x));
            let size: f64 = terms().map(f64::abs).sum();
            (terms().sum::<f64>() - found).abs() <= ROUNDING * size
        })
    };
    let on_commands = [
        (&part.on_states, own),
        (&part.on_angles, angles),
        (&part.on_speeds, speeds),
        (&part.on_references, references),
    ];
    let on_rates = [
        (&part.states, own),
        (&part.angles, angles),
        (&part.speeds, speeds),
        (&part.torques, torques),
        (&part.references, references),
    ];
    TIMES.into_iter().all(|time| {
        let observation =
            Observation { time, angles, speeds, disturbances: &[], references, readings: &[], states: own };
        let (mut commands, mut rates) = (vec![0.0; part.on_angles.rows()], vec![0.0; states]);
        law.command(observation, &mut commands);
        law.rates(observation, torques, &mut rates);
        agrees(&on_commands, &commands) && agrees(&on_rates, &rates)
    })
}

/// The number of the source that a law reads or outputs by that name; that of its signal for a sensor of one.
fn source_of(name: &str, setup: &Setup<'_>) -> usize {
    let equations = &setup.reduced.equations;
    let sensor = equations.signal_sensors.iter().find(|(sensor, _)| sensor == name);
    let signal = match sensor.map(|(_, sensor)| &sensor.measured) {
        Some(Measured::Signal(signal)) => signal,
        _ => name,
    };
    let found = setup.scenario.source(signal);
    found.unwrap_or_else(|| panic!("`{signal}`, which is read or output, is a source"))
}

/// A law among the inputs and sources of a run; `size` grows by its states. The outputs of a task `of_blocks` are sources,
/// those of other laws commands of inputs.
fn connected_law(
    law: &Arc<dyn Law>,
    of_blocks: bool,
    setup: &Setup<'_>,
    drives: &[Drive],
    size: &mut usize,
) -> ConnectedLaw {
    let (all, scenario) = (&setup.reduced.equations.inputs, setup.scenario);
    let input = |name: &String| all.iter().position(|i| i.element == *name).expect("a law commands inputs");
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    if of_blocks {
        outputs.extend(law.inputs().iter().map(|name| source_of(name, setup)));
    } else {
        inputs.extend(law.inputs().iter().map(input));
    }
    let references: Vec<usize> = law.references().iter().map(|reference| source_of(&reference.name, setup)).collect();
    let first = *size;
    let limits: Vec<Option<f64>> =
        inputs.iter().map(|&input| drives[input].limit).chain(outputs.iter().map(|_| None)).collect();
    // A law with states may have anti-windup at the limits.
    let winds_up = !law.states().is_empty() && limits.iter().any(Option::is_some);
    let computer = match law.clock() {
        Some(clock) => Computer::SampledRuntime(Box::new(SampledRuntime::new(&**law, clock, setup.reduced, scenario))),
        None => {
            *size += law.states().len();
            let linear = !law.is_nonlinear() && law.friction_width().is_none() && !winds_up;
            let (mut runtime, part) = (law.run(), linear.then(|| law.linear()));
            match (part.filter(|part| is_linear(&mut runtime, part, references.len())), law.task()) {
                (Some(part), _) => Computer::Linear(Box::new(part)),
                (None, Some(task)) => Computer::Inlined(Arc::clone(task)),
                (None, None) => Computer::Continuous(runtime),
            }
        }
    };
    ConnectedLaw {
        computer,
        reference_values: vec![0.0; references.len()],
        commands: vec![0.0; limits.len()],
        torques: vec![0.0; inputs.len()],
        states: first..*size,
        limits,
        inputs,
        outputs,
        exported: if of_blocks { Vec::new() } else { exported(&**law, scenario) },
        references,
        law: Arc::clone(law),
    }
}

/// The sources that are a law's signals for blocks.
fn exported(law: &dyn Law, scenario: &Scenario) -> Vec<(usize, ExportedSignal)> {
    let dotted =
        |source: &Source| source.target == SourceTarget::Block && SignalName::new(&source.name).unqualified().is_none();
    if law.clock().is_none() || !scenario.sources.iter().any(dotted) {
        return Vec::new();
    }
    let controller = law.describe().controller;
    let numbered = |(name, exported): (String, ExportedSignal)| {
        let name = format!("{controller}.{name}");
        Some((scenario.source(&name)?, exported))
    };
    law.exported().into_iter().filter_map(numbered).collect()
}

/// Blocks, which compute before their readers, then the laws; `size` grows by their states.
fn connected_laws(setup: &Setup<'_>, drives: &[Drive], size: &mut usize) -> Vec<ConnectedLaw> {
    let tasks = setup.scenario.tasks.iter().map(|task| -> Arc<dyn Law> { Arc::new(TaskLaw::new(task, setup.reduced)) });
    let laws = setup.laws.iter().map(|law| (Arc::clone(law), false));
    let all = tasks.map(|task| (task, true)).chain(laws);
    all.map(|(law, of_blocks)| connected_law(&law, of_blocks, setup, drives, size)).collect()
}

/// The steps and ramps of each source.
fn profiles(scenario: &Scenario) -> Vec<Profile> {
    let profile = |k| Profile::new(scenario.events.iter().filter(|event| event.source == k));
    (0..scenario.sources.len()).map(profile).collect()
}

/// The compiled expressions of a loop, the indices of its inputs and outputs, and what they were written from.
struct Compiled {
    drives: Vec<Drive>,
    laws: Vec<ConnectedLaw>,
    flow: Option<Flow>,
    targets: Vec<SourceTarget>,
    /// The number of states, without work and loss.
    states: usize,
    dynamics: Dynamics,
    work: Work,
    places: Places,
    timed: Timed,
    kinks: Kinks,
    gear_losses: GearLosses,
    moving: Vec<bool>,
}

impl Compiled {
    fn new(setup: Setup<'_>, also: impl FnOnce(&mut Motion, &Found) -> Vec<Expr>) -> Self {
        let (reduced, scenario) = (setup.reduced, setup.scenario);
        let motion_states = 2 * reduced.degrees_of_freedom();
        let mut states = motion_states;
        let drives = drives(&reduced.equations, scenario, &mut states);
        let (laws, flow) = (connected_laws(&setup, &drives, &mut states), Flow::new(scenario, &mut states));
        let targets: Vec<_> = scenario.sources.iter().map(|source| source.target).collect();
        let parts =
            Parts { drives: &drives, laws: &laws, targets: &targets, signals: &scenario.signals, flow: flow.as_ref() };
        let (mut places, mut timed, mut kinks, mut gear_losses) = Default::default();
        let mut moving =
            vec![false; reduced.equations.set_valued().count() + reduced.equations.multiplier_constraints.len()];
        let (dynamics, work) = Dynamics::extended(reduced, |motion| {
            let (mut extension, mut found, sources, discontinuities) =
                extend(motion, reduced, parts, motion_states..states);
            kinks = Kinks::new(motion, &discontinuities, (&extension, &found));
            timed = Timed::new(motion, scenario, (&extension, &found), &sources);
            gear_losses = GearLosses::new(motion, reduced, &extension.inputs);
            if reduced.equations.prescribes() {
                moving = motion.prescribed_directions(reduced);
            }
            let more = also(motion, &Found::new(&extension, &found, sources));
            found.also = extension.outputs.len()..extension.outputs.len() + more.len();
            extension.outputs.extend(more.into_iter().enumerate().map(|(k, expr)| (format!("also.{k}"), expr)));
            places = found;
            extension
        });
        Self { drives, laws, flow, targets, states, dynamics, work, places, timed, kinks, gear_losses, moving }
    }
}

impl Machine {
    /// Connects plant, laws and scenario.
    ///
    /// # Panics
    /// If a law names an input or reference that does not exist (the model checks this before).
    pub fn new(setup: Setup<'_>) -> Self {
        Self::with(setup, |_, _| Vec::new())
    }

    /// The same, with further outputs to compute at each evaluation.
    pub(crate) fn with(setup: Setup<'_>, also: impl FnOnce(&mut Motion, &Found) -> Vec<Expr>) -> Self {
        let (reduced, scenario) = (setup.reduced, setup.scenario);
        let (r, m) = (reduced.degrees_of_freedom(), reduced.equations.set_valued().count());
        let multiplier_constraints = m..m + reduced.equations.multiplier_constraints.len();
        let multipliers = reduced.equations.multiplier_constraints.iter().map(|constraint| constraint.element.clone());
        let set_valued = reduced.equations.set_valued().map(|(element, _)| element.to_string());
        let Compiled { drives, laws, flow, targets, states, dynamics, work, places, timed, kinks, gear_losses, moving } =
            Compiled::new(setup, also);
        let (jenkins, unilaterals) = (JenkinsElements::new(reduced), Unilaterals::new(&reduced.equations));
        let bounds = unilaterals.bounds(dynamics.breakaway_torques(), multiplier_constraints.len());
        let mut out = Self {
            has_massless: reduced.massless.is_some(),
            directions: (0..m).filter(|k| !jenkins.directions.contains(k) && !unilaterals.only_presses(*k)).collect(),
            names: set_valued.chain(multipliers).collect(),
            shaft_names: reduced.equations.coordinates.clone(),
            jenkins,
            unilaterals,
            gear_losses,
            bounds,
            own_laws: laws.iter().any(ConnectedLaw::is_own),
            zoh_output: vec![0.0; drives.len()],
            places,
            laws,
            targets,
            lines: vec![(0.0, 0.0, 0.0); scenario.sources.len()],
            sources: vec![0.0; scenario.sources.len()],
            profiles: profiles(scenario),
            signals: scenario.signals.clone(),
            flow,
            timed,
            kinks,
            modes: vec![Mode::Stick; m],
            holding: Vec::with_capacity(r),
            following: Vec::with_capacity(m),
            turning: Vec::new(),
            moves: moving.contains(&true),
            moving,
            still: Vec::with_capacity(r),
            at_rest: false,
            step_length: 0.0,
            step_speeds: vec![0.0; r],
            degrees_of_freedom: r,
            size: states + 2,
            commands: vec![0.0; drives.len()],
            ahead: std::array::from_fn(|_| vec![0.0; states + 2]),
            torques: vec![0.0; drives.len()],
            applied: vec![0.0; drives.len()],
            force: vec![0.0; r],
            acceleration: vec![0.0; r],
            weighted: vec![0.0; multiplier_constraints.end * r],
            weighted_parts: vec![0..r; multiplier_constraints.end],
            active_matrix: vec![0.0; multiplier_constraints.end * multiplier_constraints.end],
            active_factor: Cholesky::new(0),
            active_torque: vec![0.0; multiplier_constraints.end],
            active_constant: false,
            active_distribution: false,
            torque_distribution_unique: false,
            torque_distribution: TorqueDistribution::new(multiplier_constraints.end, r),
            box_problem: BoxProblem::new(m),
            contradiction: Vec::new(),
            happened: Vec::new(),
            response: Response::new(r),
            expansion: None,
            resolved: None,
            jacobian: None,
            evaluated: 0,
            scratch: vec![0.0; r.max(multiplier_constraints.end)],
            friction_torques: vec![0.0; multiplier_constraints.end],
            watched: WatchedRows::new(multiplier_constraints.len(), r),
            multiplier_constraints: multiplier_constraints.clone(),
            drives,
            dynamics,
            work,
        };
        if !multiplier_constraints.is_empty() {
            out.holding.extend(multiplier_constraints);
            out.prepare_holding();
        }
        out
    }
}
