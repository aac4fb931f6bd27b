//! The run: the integration of a closed loop, which alternates between actions at events and breakpoints, steps, and recorded rows.

mod dependent_constraints;
mod event_samples;
mod event_search;
mod invalid_bounds;
mod jamming_gears;
mod missed_event_guard;
mod ready;
mod recording;
mod segments;
mod step;
mod switching;
mod tolerance;

use super::dop853::Dop853;
use super::integrator::Integrator;
use super::linear::{self, LinearSegment};
use super::outputs::Outputs;
use super::radau::Radau;
use super::stiffness::is_stiff;
use super::taylor::{self, Taylor};
use super::{Machine, Scenario, Setup};
use event_samples::{EventSamples, Guard};
pub use jamming_gears::UNJAM;
use kardan_math::num::{Random, StateArchive};
use kardan_mechanics::reduce::Reduced;
use kardan_results::{Effort, Event, Outcome};
pub use ready::{Ready, locking_gears, simulate};
pub use recording::RunResult;
pub(super) use tolerance::absolute_tolerances;
pub use tolerance::{Method, Tolerance};

/// The integration of a closed loop: its progress, and pending actions.
pub(super) struct RunLoop {
    pub(super) machine: Machine,
    solver: Integrator,
    /// The reference method beside another one: for points where series or derivatives are undefined, as those of
    /// `sqrt(max(0, x))` and of `t^1.5` at the begin.
    reference: Option<Integrator>,
    /// Whether it has taken over.
    referred: bool,
    /// The segment with an exact solution, if the loop is linear; none otherwise.
    segment: Option<LinearSegment>,
    /// Whether segments may be.
    linear: bool,
    tolerance: Tolerance,
    /// Absolute errors allowed of each state in a step.
    absolute: Vec<f64>,
    /// The number of such segments, and their evaluations.
    segments: Effort,
    /// Whether the integrator took a step.
    stepped: bool,
    /// Whether all coefficients of the series of the last step are known.
    complete: bool,
    /// Whether the last step only waited: the state has not changed in it.
    resting: bool,
    pub(super) outputs: Outputs,
    pub(super) scenario: Scenario,
    /// Constraints whose right sides vary with time.
    prescribing: Vec<String>,
    /// Names of reduced coordinates and of their speeds, and the reference of a tolerance where they are zero.
    state_names: Vec<(String, f64)>,
    next_row: usize,
    pub(super) events: Vec<Event>,
    notes: Vec<String>,
    /// The time of the integration, s.
    pub(super) time: f64,
    pending: Pending,
    /// The end of the present equations, s: a breakpoint of the scenario, or a sample.
    segment_end: f64,
    guard: Guard,
    /// The next breakpoint of the scenario, and the next sample, s.
    breakpoint: f64,
    tick: f64,
    chattering: Chattering,
    /// Events in close succession.
    zeno_events: usize,
    state: Vec<f64>,
    trial_state: Vec<f64>,
    /// Memory for states at the begin, in the middle and at the end of a part of a step.
    between: [Vec<f64>; 3],
    /// Directions that leave their mode at the time examined last, and whether limits of a motor do.
    reversed: Vec<usize>,
    switching: bool,
    event_samples: EventSamples,
    initial_energy: f64,
    /// The work of the inputs when it was last evaluated, and the sum of the sizes of its changes until then, J.
    work: f64,
    exchanged: f64,
    /// The gear whose motion was not unique at the last step.
    doubted: Option<usize>,
    /// When gears have jammed, s, and how often in close succession.
    jammed: Option<f64>,
    jams: usize,
    located: usize,
    /// Steps since the last progress report.
    steps_since_progress: usize,
    /// The random source of perturbed rounding, if that is requested.
    shaken: Option<Random>,
    /// How many rows ends of steps may still add.
    added_rows: usize,
}

/// Pending actions at the current time, before the integration continues.
#[derive(Debug, Clone, Copy, Default)]
struct Pending {
    /// All actions at the start.
    start: bool,
    /// A mode is left: a reversal, a breakaway, a motor at its limit.
    event: bool,
    /// A breakpoint of the scenario, a sample, or a signal set from outside.
    boundary: bool,
}

/// Events that follow each other within the time of a step.
#[derive(Debug, Clone, Copy, Default)]
struct Chattering {
    since: f64,
    events: usize,
    /// The longest step that the equations between them allowed.
    longest: f64,
    /// When the last one was, s.
    last: f64,
    /// How many of the last ones had no time between them.
    at_once: usize,
}

impl RunLoop {
    /// A loop at its start.
    pub(super) fn new(setup: Setup<'_>, tolerance: Tolerance) -> Self {
        // Faults of springs and dampers are in the equations of the run.
        let weakened = setup.scenario.faults.weakened(setup.reduced);
        let setup = Setup { reduced: weakened.as_ref().unwrap_or(setup.reduced), ..setup };
        let (reduced, scenario) = (setup.reduced, setup.scenario);
        let mut outputs = Outputs::new(reduced, scenario);
        let mut machine = Machine::with(setup, |motion, found| {
            outputs.compile(motion, reduced, found);
            Vec::new()
        });
        let size = machine.size();
        let absolute = absolute_tolerances(reduced, tolerance, size);
        let mut state = vec![0.0; size];
        machine.start(&reduced.state(&scenario.position, &scenario.speed), &mut state);
        let method = match tolerance.method {
            Method::Automatic | Method::Stepping if is_stiff(&mut machine, scenario, &state) => Method::Radau,
            chosen => chosen,
        };
        let solver = solver_of(method, (tolerance.relative, &absolute), (&mut machine, reduced), &mut outputs);
        let reference = || Integrator::Dop853(Box::new(Dop853::new(tolerance.relative, &absolute)));
        RunLoop {
            reference: solver.is_some().then(reference),
            referred: false,
            solver: solver.unwrap_or_else(reference),
            segment: None,
            linear: tolerance.method == Method::Automatic
                && scenario.duration.is_finite()
                && size - 2 <= linear::MOST_STATES
                && machine.is_linear(),
            tolerance,
            segments: Effort::default(),
            stepped: false,
            complete: false,
            resting: false,
            guard: Guard::new(machine.is_blind(), machine.kinks.of_state),
            event_samples: EventSamples::new(machine.modes.len()),
            machine,
            outputs,
            prescribing: reduced.equations.moving.keys().cloned().collect(),
            state_names: state_names(reduced).zip(absolute.iter().map(|x| x / tolerance.relative)).collect(),
            absolute,
            between: std::array::from_fn(|_| vec![0.0; size]),
            next_row: 0,
            events: Vec::new(),
            notes: Vec::new(),
            time: 0.0,
            pending: Pending { start: true, ..Pending::default() },
            segment_end: 0.0,
            breakpoint: 0.0,
            tick: 0.0,
            chattering: Chattering::default(),
            zeno_events: 0,
            trial_state: vec![0.0; size],
            reversed: Vec::new(),
            switching: false,
            state,
            initial_energy: 0.0,
            work: 0.0,
            exchanged: 0.0,
            doubted: None,
            jammed: None,
            jams: 0,
            located: 0,
            steps_since_progress: 0,
            shaken: None,
            added_rows: 0,
            scenario: scenario.clone(),
        }
    }

    /// Continues until all results before a time are known; actions due at that time itself are still pending.
    ///
    /// The steps do not depend on the requested times: the integration may be ahead of them.
    pub(super) fn proceed(
        &mut self,
        until: f64,
        progress: &mut dyn FnMut(f64) -> Option<String>,
    ) -> Result<(), Outcome> {
        while self.time < until {
            self.observe_until(self.time, None);
            if self.pending.start {
                self.begin()?;
            }
            if self.pending.event {
                self.happen()?;
            }
            if self.pending.boundary {
                self.cross()?;
            }
            self.pending = Pending::default();
            self.step(progress)?;
            self.count_work();
        }
        self.observe_until(until.min(self.time), None);
        Ok(())
    }

    /// Adds the work of the inputs since the last evaluation.
    fn count_work(&mut self) {
        let work = self.state[self.state.len() - 2];
        self.exchanged += (work - self.work).abs();
        self.work = work;
    }

    /// Moves to a time that is computed already, at most the integration's own, so that signals may change from there
    /// on.
    pub(super) fn stand(&mut self, at: f64) {
        if at < self.time {
            self.solver.interpolate(at, &mut self.state);
            self.time = at;
            self.pending = Pending::default();
        }
        self.pending.boundary = !self.pending.start;
        // The lines of all signals are computed again.
        self.breakpoint = self.breakpoint.min(at);
    }

    /// Evaluates the sources of signals at a time that is computed already.
    pub(super) fn sample(&mut self, at: f64) {
        if at < self.time {
            self.solver.interpolate(at, &mut self.trial_state);
        } else {
            self.trial_state.copy_from_slice(&self.state);
        }
        self.outputs.observe(&mut self.machine, at, &self.trial_state);
        self.outputs.sample(at);
    }

    /// All values that the future depends on.
    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        let mut referred = self.referred;
        archive.flag(&mut referred);
        if referred != self.referred {
            self.change_method();
        }
        self.solver.archive_state(archive);
        self.machine.archive_state(archive);
        self.outputs.archive_state(archive);
        for time in [&mut self.time, &mut self.segment_end, &mut self.breakpoint, &mut self.tick] {
            archive.number(time);
        }
        self.machine.dynamics.enter_faults(self.time);
        for flag in [&mut self.pending.start, &mut self.pending.event, &mut self.pending.boundary, &mut self.resting] {
            archive.flag(flag);
        }
        archive.number(&mut self.chattering.since);
        archive.count(&mut self.chattering.events);
        archive.number(&mut self.chattering.longest);
        archive.number(&mut self.chattering.last);
        archive.count(&mut self.chattering.at_once);
        archive.count(&mut self.zeno_events);
        archive.numbers(&mut self.state);
        archive.number(&mut self.initial_energy);
        archive.counts(&mut self.reversed);
        self.event_samples.archive_state(archive);
        self.guard.archive_state(archive);
        for count in [&mut self.located, &mut self.steps_since_progress, &mut self.jams] {
            archive.count(count);
        }
        archive.optional(&mut self.jammed);
        let mut doubted = self.doubted.map_or(0, |direction| direction + 1);
        archive.count(&mut doubted);
        self.doubted = doubted.checked_sub(1);
    }
}

/// The integrator of a method; none for the reference, and where the machine does not support it.
fn solver_of(
    method: Method,
    (relative, absolute): (f64, &[f64]),
    (machine, reduced): (&mut Machine, &Reduced),
    outputs: &mut Outputs,
) -> Option<Integrator> {
    machine.prepare_resolution(&[]);
    match method {
        Method::Dop853 => None,
        Method::Taylor | Method::Automatic | Method::Stepping => {
            if !machine.prepare_series(taylor::order(relative), &outputs.shafts().unwrap_or_default()) {
                return None;
            }
            outputs.prepare_series(machine);
            // The values that decide pieces have terms where the states have none.
            Some(Integrator::Taylor(Box::new(Taylor::new(relative, absolute, machine.has_kinks()))))
        }
        Method::Radau => {
            let implicit = absolute.len() - 2;
            let able = machine.prepare_jacobian(reduced);
            able.then(|| Integrator::Radau(Box::new(Radau::new(relative, absolute, implicit))))
        }
    }
}

/// Names of reduced coordinates, then of their speeds.
fn state_names(reduced: &Reduced) -> impl Iterator<Item = String> {
    let equations = &reduced.equations;
    let named = |rate: usize| {
        reduced.coordinates.iter().map(move |&k| equations.domain(k).motion()[rate].of(&equations.coordinates[k]))
    };
    named(0).chain(named(1))
}

fn failed(time: f64, cause: String) -> Outcome {
    Outcome::Failed { time, cause: format!("at t = {time:.9} s: {cause}") }
}
