//! The run: steps between events, events located on the dense output, mode selection after events, outputs on the grid.

mod event_samples;
mod missed_event_guard;
mod undefined_value;
mod unfit;

use kardan_rt::functions::powi;

use super::counts::{EncoderReading, FlippedReading};
use super::dop853::StepError;
use super::integrator::Integrator;
use super::linear::{self, BLOCK, LinearSegment};
use super::machine::Prospect;
use super::outputs::Outputs;
use super::stiffness::is_stiff;
use super::{Machine, Scenario, Setup};
use crate::equations::Domain;
use crate::names::quoted;
use crate::num::{Random, StateArchive};
use crate::reduce::Reduced;
use crate::results::{Effort, Energy, Event, MotorLoad, Outcome, Physical, Series};
use event_samples::Guard;
use undefined_value::{is_undefined, undefined};

/// How accurately a run is integrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Relative error allowed per step.
    pub relative: f64,
    /// Absolute error allowed per step, rad and rad/s.
    pub absolute: f64,
    /// Steps after which a run ends.
    pub most_steps: usize,
    /// How it is integrated.
    pub method: Method,
}

/// How a run is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Always the Runge-Kutta method of order 8 of Dormand and Prince: the reference.
    Dop853,
    /// Taylor series of the loop's expressions, with the order that the tolerance needs. Loops in which a law computes
    /// at every instant, or gears have losses, use the reference.
    #[default]
    Taylor,
    /// Radau IIA of order 5, 9 or 13 with an exact Jacobian, for stiff loops: its steps do not depend on how fast motions decay. Loops in
    /// which a law computes by itself at every instant, by the reference.
    Radau,
    /// Loops that are linear between the breakpoints of the scenario by matrix exponentials, where the end of the run is known
    /// ([`Simulation`](super::Simulation) goes step by step). Others by Radau IIA where the rates at the start show that this takes less
    /// time, else by Taylor series.
    Automatic,
    /// The same without exponentials: every run goes step by step.
    Stepping,
}

impl Tolerance {
    /// A relative error allowed per step, and a hundredth of it in rad and rad/s.
    ///
    /// ```
    /// use kardan::simulate::Tolerance;
    /// assert_eq!(Tolerance::relative(1e-10), Tolerance::default());
    /// ```
    pub fn relative(relative: f64) -> Self {
        Self { relative, absolute: 1e-2 * relative, most_steps: MOST_STEPS, method: Method::default() }
    }
}

impl Default for Tolerance {
    fn default() -> Self {
        Self::relative(1e-10)
    }
}

/// A finished (or failed) run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunResult {
    /// All signals.
    pub series: Series,
    /// The energy balance up to the end.
    pub energy: Energy,
    /// Events with their times.
    pub events: Vec<Event>,
    /// Whether the run reached its end.
    pub outcome: Outcome,
    /// Notes for the reader.
    pub notes: Vec<String>,
    /// Reasons to doubt its numbers.
    pub warnings: Vec<String>,
    /// The load of each motor that has limits.
    pub motor_loads: Vec<MotorLoad>,
    /// The cost of the integration.
    pub effort: Effort,
    /// The readings of counting sensors, where recording was requested ([`Ready::noting`]).
    pub encoder_readings: Vec<EncoderReading>,
    /// Whether samples of laws ended its steps.
    pub sampled: bool,
}

/// Samples inside a step at which events are searched; between two of them a direction may reverse at most once.
const EVENT_SCAN_POINTS: usize = 6;
/// The least number in a shortened step.
const LEAST_SCAN_POINTS: usize = 2;
/// Help for jamming gears.
pub const UNJAM: &str = "Give it less loss (a larger `efficiency_back`), more inertia before it or less behind it, or let a spring carry the load";
/// Part of a step to which an event is located that the step is to be shortened for.
const ROUGHLY: f64 = 1e-6;
/// Part of a series step before which an event is searched once more, in a step that is this many times as long as the
/// time until it.
const EARLY: f64 = 1e-3;
const CLOSER: f64 = 4.0;
/// Steps of regula falsi towards an event.
const FALSE_POSITIONS: usize = 30;
/// Widenings of the interval about a zero until the modes agree that the event lies in it.
const CONFIRMATIONS: usize = 6;
/// Golden-section steps between two samples for the least margin: 1e-8 of the interval, where a parabola is flat to
/// rounding.
const SECTIONS: usize = 40;
const GOLDEN: f64 = 0.618_033_988_749_894_8;
/// Part of a step by which a repeated step ends after the event it was shortened for.
const BEYOND: f64 = 1e-3;
/// Located events within one step of the integrator that count as chatter: a smooth motion has a few for each direction.
const MOST_CHATTERING: usize = 2000;
/// Close events after which a run ends: a bouncing contact has fewer.
const MOST_ZENO_EVENTS: usize = 200_000;
/// The largest distance of close events, as a part of the duration or of a second.
const CLOSE: f64 = 1e-7;
/// Jams after which a run ends, if each is this close to the one before, as a part of the duration or of a second: no
/// chart resolves them.
const JAMS: usize = 200;
const JAMS_APART: f64 = 1e-3;
/// Successive events without time between them after which restitution is off until time passes.
const KNOCKS: usize = 100;
/// Events closer than this, relative to the time, have no time between them.
const AT_ONCE: f64 = 64.0 * f64::EPSILON;
/// Steps after which a run ends, unless fewer are requested.
const MOST_STEPS: usize = 100_000_000;
/// Steps between two reports of the progress.
const PROGRESS_STEPS: usize = 64;
/// Absolute error allowed per step in the work of the inputs and in the loss, J per unit of the relative tolerance; it
/// limits steps whose other error estimates are small by accident.
const ENERGY: f64 = 10.0;
/// The part of the energy exchanged from which on kardan reports a residual: it shows in charts and changes the third
/// digit of values read from them. The tolerances of steps allow far less.
const SHOWS: f64 = 1e-3;
/// A charge of a circuit (C), its current (A) and its energy (J) against an angle (rad) and an energy of a drivetrain: the
/// absolute tolerances are smaller by this factor.
const SMALL: f64 = 1e-6;
/// Relative difference below which two times are equal.
const SAME: f64 = 1e-14;
/// The energy residual that a segment solved at once may have, in tolerances.
const OUT_OF_BALANCE: f64 = 10.0;
/// The longest step where no event ends the present equations, s.
const LONGEST: f64 = 1e9;
/// The accuracy of the time at which rates become undefined, relative to the time.
const STUCK: f64 = 256.0 * f64::EPSILON;
/// Relative to the largest speed, or to this many rad/s or m/s where all are slower, the largest change by the
/// projection of a step onto multiplier constraints where it passed no point at which they are dependent.
const THROWN: f64 = 1e-3;
/// A speed that no drivetrain reaches, rad/s.
const DIVERGED: f64 = 1e6;

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
    tolerance: f64,
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
    names: Vec<String>,
    /// Elements of the multiplier constraints.
    multiplier_names: Vec<String>,
    /// Constraints whose right sides vary with time.
    prescribing: Vec<String>,
    input_names: Vec<String>,
    input_units: Vec<&'static str>,
    shafts: Vec<String>,
    /// Names of reduced coordinates and of their speeds, and the reference of a tolerance where they are zero.
    state_names: Vec<(String, f64)>,
    time_grid: Vec<f64>,
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
    looked: Vec<f64>,
    /// Memory for states at the begin, in the middle and at the end of a part of a step.
    between: [Vec<f64>; 3],
    derivative: Vec<f64>,
    moved: Vec<f64>,
    reversed: Vec<usize>,
    switching: Vec<usize>,
    event_samples: EventSamples,
    initial_energy: f64,
    /// The work of the inputs when it was last evaluated, and the sum of the sizes of its changes until then, J.
    work: f64,
    exchanged: f64,
    /// The error that a step may have in it, for any size, J.
    least_energy: f64,
    /// The gear whose motion was not unique at the last step.
    doubted: Option<usize>,
    /// When gears have jammed, s, and how often in close succession.
    jammed: Option<f64>,
    jams: usize,
    located: usize,
    most_steps: usize,
    /// Steps since the last progress report.
    steps_since_progress: usize,
    /// The random source of perturbed rounding, if that is requested.
    shaken: Option<Random>,
}

/// The margins of all directions (columns) at the samples of the last step (rows), allocated once.
struct EventSamples {
    times: [f64; EVENT_SCAN_POINTS + 1],
    count: usize,
    margins: Vec<f64>,
    directions: usize,
    curvatures: Vec<f64>,
}

impl EventSamples {
    fn new(directions: usize) -> Self {
        let margins = vec![0.0; (EVENT_SCAN_POINTS + 1) * directions];
        Self {
            times: [f64::NAN; EVENT_SCAN_POINTS + 1],
            count: 0,
            margins,
            directions,
            curvatures: vec![0.0; directions],
        }
    }

    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.numbers(&mut self.times);
        archive.count(&mut self.count);
        archive.numbers(&mut self.margins);
    }

    /// Takes the margins at the point that the machine has evaluated last.
    fn take(&mut self, row: usize, time: f64, machine: &mut Machine) {
        self.times[row] = time;
        self.count = row + 1;
        machine.margins_here(&mut self.margins[row * self.directions..][..self.directions]);
    }

    /// Begins with the last or first sample at this time; false: there is none.
    fn begin(&mut self, time: f64) -> bool {
        if self.count > 0 && self.times[self.count - 1] == time {
            let last = (self.count - 1) * self.directions;
            self.margins.copy_within(last..last + self.directions, 0);
            self.times[0] = time;
        }
        let is_same_time = self.count > 0 && self.times[0] == time;
        self.count = usize::from(is_same_time);
        is_same_time
    }

    fn at(&self, row: usize, watch: usize) -> f64 {
        self.margins[row * self.directions + watch]
    }

    /// The curvature of each margin over three samples.
    fn measure_curvatures(&mut self) {
        for watch in 0..self.directions {
            let curvatures = event_samples::curvatures(self.count, |row| (self.times[row], self.at(row, watch)));
            self.curvatures[watch] = curvatures.fold(0.0, f64::max);
        }
    }

    /// Whether the samples are too far apart to show a margin between them; `noise` is the rounding error of each.
    fn are_coarse(&self, noise: impl Fn(usize) -> f64) -> bool {
        let look = |watch| move |row| (self.times[row], self.at(row, watch));
        (0..self.directions).any(|watch| event_samples::is_coarse(self.count, noise(watch), look(watch)))
    }
}

/// Runs a closed loop through its scenario.
///
/// Between events the modes are fixed and the equations smooth: they are integrated by the [`Method`] and with the tolerance given. Steps and
/// ramps of the scenario end steps exactly. Reversals of slipping directions, breakaway of sticking ones and limits of motors are
/// located on the dense output to the last bits of the time.
///
/// `progress` receives the completed fraction, and returns a reason if the run is to end there. Never fails as a whole:
/// a run that cannot continue ends with [`Outcome::Failed`] and all results so far.
pub fn simulate(setup: Setup<'_>, tolerance: Tolerance, progress: &mut dyn FnMut(f64) -> Option<String>) -> RunResult {
    Ready::new(setup, tolerance).run(progress)
}

/// Elements with gears that the inertia of their load would lock at the start (Painlevé).
pub fn teeth_that_lock(setup: Setup<'_>) -> Vec<String> {
    let (reduced, scenario) = (setup.reduced, setup.scenario);
    let mut machine = Machine::new(setup);
    let mut state = vec![0.0; machine.size()];
    let start = reduced.state(&scenario.position, &scenario.speed);
    state[..start.len()].copy_from_slice(&start);
    machine.start_laws(&mut state);
    machine.enter_segment(0.0);
    let directions: Vec<&str> = reduced.equations.set_valued().map(|(element, _)| element).collect();
    machine.self_locking_gears(&state).into_iter().map(|direction| directions[direction].to_string()).collect()
}

/// A run that is compiled and has not started.
pub struct Ready(RunLoop);

impl Ready {
    /// Compiles the expressions of a loop.
    pub fn new(setup: Setup<'_>, tolerance: Tolerance) -> Self {
        Self(RunLoop::new(setup, tolerance))
    }

    /// Records the readings of counting sensors for sampled laws.
    pub fn noting(self) -> Self {
        self.turning(&[])
    }

    /// The same, with some readings flipped; the readings of a sensor in their order.
    pub fn turning(mut self, flipped: &[FlippedReading]) -> Self {
        self.0.machine.note_counts(flipped);
        self
    }

    /// Perturbs rounding: where sampled laws end the steps, moving coordinates are changed by up to two units in their
    /// last place. So its rounding errors differ from those of the run that it is compared with.
    pub fn shaken(mut self) -> Self {
        self.0.shaken = Some(Random::new(0));
        self
    }

    /// Runs it; see [`simulate`].
    pub fn run(self, progress: &mut dyn FnMut(f64) -> Option<String>) -> RunResult {
        let mut run_loop = self.0;
        let duration = run_loop.scenario.duration;
        let outcome = match run_loop.proceed(duration, progress).and_then(|()| run_loop.sample_at_end()) {
            Ok(()) => {
                // The last row, at the end itself.
                run_loop.observe_until(f64::INFINITY, Some(duration));
                Outcome::Completed
            }
            Err(outcome) => outcome,
        };
        run_loop.finish(outcome)
    }
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
        Self::of(Setup { reduced: weakened.as_ref().unwrap_or(setup.reduced), ..setup }, tolerance)
    }

    /// The same with equations that include all faults.
    fn of(setup: Setup<'_>, tolerance: Tolerance) -> Self {
        let (reduced, scenario) = (setup.reduced, setup.scenario);
        let names: Vec<String> = reduced.equations.set_valued().map(|(element, _)| element.to_string()).collect();
        let input_names = reduced.equations.inputs.iter().map(|i| i.element.clone()).collect();
        let multipliers = reduced.equations.multiplier_constraints.iter();
        let multiplier_names = multipliers.map(|constraint| constraint.element.clone()).collect();
        let mut outputs = Outputs::new(reduced, scenario);
        let mut machine = Machine::with(setup, |motion, found| outputs.compile(motion, reduced, found));
        let (r, size) = (machine.degrees_of_freedom(), machine.size());
        let absolute = absolute_tolerances(reduced, tolerance, size);
        let mut state = vec![0.0; size];
        state[..2 * r].copy_from_slice(&reduced.state(&scenario.position, &scenario.speed));
        machine.start_laws(&mut state);
        let method = match tolerance.method {
            Method::Automatic | Method::Stepping if is_stiff(&mut machine, scenario, &state) => Method::Radau,
            chosen => chosen,
        };
        let least_energy = absolute[size - 2];
        let solver = solver_of(method, (tolerance.relative, &absolute), (&mut machine, reduced), &mut outputs);
        let reference = || Integrator::dop853(tolerance.relative, &absolute);
        RunLoop {
            reference: solver.is_some().then(reference),
            referred: false,
            solver: solver.unwrap_or_else(reference),
            segment: None,
            linear: tolerance.method == Method::Automatic
                && scenario.duration.is_finite()
                && size - 2 <= linear::MOST_STATES
                && machine.is_linear(),
            tolerance: tolerance.relative,
            segments: Effort::default(),
            stepped: false,
            complete: false,
            resting: false,
            guard: Guard::new(machine.is_blind(), machine.kinks()),
            machine,
            outputs,
            event_samples: EventSamples::new(names.len()),
            names,
            multiplier_names,
            prescribing: reduced.equations.moving.keys().cloned().collect(),
            input_names,
            input_units: input_units(reduced),
            shafts: reduced.equations.coordinates.clone(),
            state_names: state_names(reduced).zip(absolute.iter().map(|x| x / tolerance.relative)).collect(),
            absolute,
            between: std::array::from_fn(|_| vec![0.0; size]),
            time_grid: Vec::with_capacity(scenario.times.len()),
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
            looked: vec![0.0; size],
            derivative: vec![0.0; size],
            moved: vec![0.0; size],
            reversed: Vec::new(),
            switching: Vec::new(),
            state,
            initial_energy: 0.0,
            work: 0.0,
            exchanged: 0.0,
            least_energy,
            doubted: None,
            jammed: None,
            jams: 0,
            located: 0,
            most_steps: tolerance.most_steps,
            steps_since_progress: 0,
            shaken: None,
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
    pub(super) fn look(&mut self, at: f64) {
        if at < self.time {
            self.solver.interpolate(at, &mut self.looked);
        } else {
            self.looked.copy_from_slice(&self.state);
        }
        self.outputs.observe(&mut self.machine, at, &self.looked);
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

    /// Actions at the start.
    fn begin(&mut self) -> Result<(), Outcome> {
        self.machine.enter_segment(0.0);
        // For a run that does not continue past this.
        self.initial_energy = self.machine.energy(0.0, &self.state);
        if let Some((direction, beyond)) = self.machine.beyond_stops(self.time, &self.state).first() {
            let what = format!(
                "`{}` starts {beyond:.6} {} past its rigid stop: choose a start inside the stop",
                self.names[*direction],
                self.machine.unit_of_direction(*direction),
            );
            return Err(failed(0.0, what));
        }
        self.announce(0.0);
        self.machine.tick(0.0, &self.state);
        let blows = self.machine.settle(0.0, &mut self.state, &[], true, &self.names, &self.input_names);
        if self.machine.was_struck() {
            self.events.extend(blows.into_iter().map(|what| Event { time: 0.0, description: what }));
        }
        self.contradict()?;
        self.machine.stay_on_rows(0.0, &mut self.state);
        if self.machine.watches_rows() {
            self.machine.look_at_rows(0.0, &self.state);
        }
        self.note_shared_friction();
        self.note_blows();
        // The energy that an impact dissipated there was present, except for the energy that came in with it.
        let [work, lost] = [2, 1].map(|back| self.state[self.state.len() - back]);
        self.initial_energy = self.machine.energy(0.0, &self.state) + (lost - work);
        self.open_segment();
        Ok(())
    }

    /// Actions at a breakpoint of the scenario or at a sample.
    fn cross(&mut self) -> Result<(), Outcome> {
        if let Some((low, high)) = self.guard.discontinuity.take()
            && self.time == low
        {
            self.observe_until(high, None);
            self.time = high;
        }
        let time = self.time;
        self.machine.remember_commands(time, &mut self.state);
        if time >= self.breakpoint {
            self.machine.stick_motors(time, &self.state);
            let failing = self.scenario.faults.mechanics_at(time);
            let before = if failing.is_empty() { 0.0 } else { self.machine.energy(time, &self.state) };
            self.machine.enter_segment(time);
            self.announce(time);
            if !failing.is_empty() {
                self.account_for(&failing.join(", "), time, before);
            }
        }
        if self.tick <= time + SAME * time {
            self.machine.tick(time, &self.state);
        }
        self.settle(time, &[])?;
        self.open_segment();
        Ok(())
    }

    /// Energy that springs lose or gain when they fail, without a motion: a loss is dissipated, a gain is work of the
    /// fault.
    fn account_for(&mut self, what: &str, time: f64, before: f64) {
        let (size, gained) = (self.machine.size(), self.machine.energy(time, &self.state) - before);
        let what = if gained > 0.0 {
            self.state[size - 2] += gained;
            format!("{what}: the stored spring energy rises by {gained:.6} J")
        } else {
            self.state[size - 1] -= gained;
            format!("{what}: the springs lose {:.6} J", -gained)
        };
        self.events.push(Event { time, description: what });
    }

    /// Actions at a sample at the end of the run: its row is like all others at samples.
    fn sample_at_end(&mut self) -> Result<(), Outcome> {
        let time = self.time;
        if self.machine.next_tick() > time + SAME * time {
            return Ok(());
        }
        self.machine.remember_commands(time, &mut self.state);
        self.machine.tick(time, &self.state);
        self.settle(time, &[])
    }

    /// Begins to integrate towards the next breakpoint or sample.
    fn open_segment(&mut self) {
        let time = self.time;
        let profiles = (0..self.scenario.sources.len()).flat_map(|k| self.machine.profile(k).breakpoints());
        let faults = self.scenario.faults.times();
        let later = profiles.chain(faults).filter(|at| *at > time).fold(self.scenario.duration, f64::min);
        // Breakpoints that differ only by rounding are one.
        let timed = self.machine.next_timed(time);
        let later = if timed < later * (1.0 - SAME) { timed } else { later };
        self.breakpoint = if later > time { later } else { f64::INFINITY };
        self.tick = self.machine.next_tick();
        // A sample that coincides with a breakpoint except for rounding uses the equations from there on.
        let sooner = self.tick < self.breakpoint - SAME * self.breakpoint || self.breakpoint.is_infinite();
        self.segment_end = if sooner { self.tick } else { self.breakpoint };
        self.guard.discontinuity = self.machine.next_discontinuity(time, self.segment_end);
        if let Some((low, _)) = self.guard.discontinuity {
            self.segment_end = low;
        }
        self.chattering = Chattering { since: time, ..Chattering::default() };
        let step = self.solver.next_step();
        self.shake();
        self.restart(time);
        if self.tick.is_finite() {
            // Between two samples the previous step size continues.
            self.solver.set_step(step);
        }
    }

    /// Perturbs coordinates that move by up to two units in their last place, where that is requested and samples end
    /// the steps. Coordinates at rest are not perturbed.
    fn shake(&mut self) {
        let Some(random) = self.shaken.as_mut().filter(|_| self.tick.is_finite()) else { return };
        let (angles, speeds) = self.state.split_at_mut(self.machine.degrees_of_freedom());
        for (angle, _) in angles.iter_mut().zip(speeds).filter(|(_, speed)| **speed != 0.0) {
            *angle += 4.0 * f64::EPSILON * (random.unit() - 0.5) * *angle;
        }
    }

    /// One step of the integrator towards the end of the segment, or up to the next event in it.
    fn step(&mut self, progress: &mut dyn FnMut(f64) -> Option<String>) -> Result<(), Outcome> {
        let most = self.most_steps;
        if self.solver.counts().accepted as usize > most {
            return Err(failed(
                self.time,
                format!(
                    "more than {most} steps were needed; the model is too stiff for this mode, or oscillates much faster than the run lasts. kardan keeps the results up to this time; `kardan check` names the fastest motion"
                ),
            ));
        }
        let end = self.segment_end.min(self.time + LONGEST);
        self.segment = None;
        self.complete = false;
        self.resting = self.rests();
        if !self.resting && self.linear && self.solve_segment(end) {
            return self.report_progress(progress);
        }
        if self.resting {
            self.solver.rest(end);
            self.time = end;
            self.pending.boundary = end >= self.segment_end;
            return self.report_progress(progress);
        }
        self.stepped = true;
        self.machine.begin_notes();
        let mut made = self.solver.step(&mut self.machine, end);
        if made.is_err() && !self.referred && self.change_method() {
            self.solver.start(&mut self.machine, self.time, &self.state);
            made = self.solver.step(&mut self.machine, end);
        }
        if let Err(error) = made {
            let before = self.jammed;
            if let Some(direction) = self.resolve_jamming() {
                self.count_jams(direction, before)?;
                return self.report_progress(progress);
            }
            return Err(self.step_failed(error));
        }
        self.resolve()?;
        self.end_at_kink()?;
        let length = self.solver.time() - self.solver.previous_time();
        let mut event = self.find_event(length);
        if let Some(at) = event.filter(|_| self.solver.shortens()) {
            self.shorten_step(at)?;
            event = self.look_for_event(length, true);
        }
        let cut = self.missed_event(event.unwrap_or(self.solver.time()))?;
        let event = if cut.is_some() { None } else { event };
        self.time = cut.or(event).unwrap_or(self.solver.time());
        if self.time >= self.segment_end * (1.0 - SAME) {
            // Times that differ only by rounding are one time.
            self.time = self.segment_end;
        }
        self.pending.event = event.is_some();
        self.pending.boundary = self.time >= self.segment_end;
        if event.is_some() {
            self.located += 1;
            self.chattering.longest = self.chattering.longest.max(length);
        }
        match cut.or(event) {
            Some(at) => self.solver.interpolate(at, &mut self.state),
            None => self.state.copy_from_slice(self.solver.state()),
        }
        // Its end is searched within the step.
        if self.has_diverged() {
            return Err(self.diverged());
        }
        self.check_gear_ambiguity();
        let moved = self.put_on_rows()?;
        if (moved || cut.is_some()) && !self.pending.boundary {
            self.observe_until(self.time, None);
            let next = if cut.is_some() { 0.0 } else { self.solver.next_step() };
            self.restart(self.time);
            self.solver.set_step(next);
        }
        self.end_where_unfit()?;
        self.machine.clear_jammed_gear();
        self.report_progress(progress)
    }

    /// Ends the run where multiplier constraints become dependent within the step: their forces are not determined
    /// there, nor is the further motion.
    fn pass_rows(&mut self) -> Result<(), Outcome> {
        if !self.machine.watches_rows() {
            return Ok(());
        }
        if self.machine.rows_changed_sign(self.time, &self.state) {
            let (mut low, mut high) = (self.solver.previous_time(), self.time);
            while low < 0.5 * (low + high) && 0.5 * (low + high) < high {
                let middle = 0.5 * (low + high);
                self.solver.interpolate(middle, &mut self.looked);
                if self.machine.rows_changed_sign(middle, &self.looked) { high = middle } else { low = middle }
            }
            self.solver.interpolate(high, &mut self.looked);
            if self.machine.rows_depend((high, &self.looked), (self.time, &self.state)) {
                self.observe_until(low, None);
                self.time = high;
                self.state.copy_from_slice(&self.looked);
                return Err(failed(high, self.singular()));
            }
        }
        self.machine.look_at_rows(self.time, &self.state);
        Ok(())
    }

    /// Projects the end of a step onto the multiplier constraints, and returns whether that changed it. A step has an
    /// error within its tolerance; where speeds change by far more, it passed a point at which the rows are dependent,
    /// and took another branch there.
    fn put_on_rows(&mut self) -> Result<bool, Outcome> {
        self.pass_rows()?;
        let r = self.machine.degrees_of_freedom();
        self.looked.copy_from_slice(&self.state);
        let moved = self.machine.stay_on_rows(self.time, &mut self.state);
        if !moved || !self.machine.watches_rows() {
            return Ok(moved);
        }
        let speeds = self.state[r..2 * r].iter().zip(&self.looked[r..2 * r]);
        let (most, largest) = speeds
            .fold((0.0f64, 0.0f64), |(most, size), (now, then)| (most.max((now - then).abs()), size.max(then.abs())));
        if most <= THROWN.max(100.0 * self.tolerance) * largest.max(THROWN) {
            return Ok(moved);
        }
        // The point at which the rows are nearest to dependence.
        let (mut low, mut high) = (self.solver.previous_time(), self.time);
        let least = |run: &mut Self, at: f64| {
            run.solver.interpolate(at, &mut run.looked);
            run.machine.least_pivot(at, &run.looked)
        };
        for _ in 0..100 {
            let [first, second] = [1.0, 2.0].map(|part| low + (high - low) * part / 3.0);
            if least(self, first) < least(self, second) { high = second } else { low = first }
        }
        self.observe_until(low, None);
        self.time = high;
        self.solver.interpolate(high, &mut self.state);
        Err(failed(high, self.singular()))
    }

    fn quoted_constraints(&self) -> String {
        quoted(self.multiplier_names.iter().map(String::as_str))
    }

    /// Why a run ends where its multiplier constraints depend on each other.
    fn singular(&self) -> String {
        let names = self.quoted_constraints();
        let what = match self.multiplier_names.len() {
            1 => format!("{names} constrains no motion in this position"),
            _ => format!("the constraints {names} become dependent in this position, as at a dead centre"),
        };
        format!(
            "{what}: the constraint forces are not determined there, and the motion can continue in more than one way. Choose a start or lengths that avoid this position, or end the run before it"
        )
    }

    /// Ends the run where a gear jams repeatedly.
    fn count_jams(&mut self, direction: usize, before: Option<f64>) -> Result<(), Outcome> {
        let apart = JAMS_APART * self.scenario.duration.min(1.0);
        self.jams = if before.is_some_and(|at| self.time - at <= apart) { self.jams + 1 } else { 0 };
        if self.jams <= JAMS {
            return Ok(());
        }
        let cause = format!(
            "`{}` jams more than {JAMS} times, each within {apart:.0e} s of the time before: whenever its load drives it, it self-locks against the inertia of \
             that load (Painlevé), and then starts again. {UNJAM}",
            self.names[direction]
        );
        Err(failed(self.time, cause))
    }

    /// A gear without a consistent acceleration stops at once, by an impulse that grows with the load that it causes;
    /// returns its direction if there is such a gear at the current time.
    fn resolve_jamming(&mut self) -> Option<usize> {
        let direction = self.machine.jammed_gear()?;
        if self.jammed == Some(self.time) {
            return None;
        }
        self.jammed = Some(self.time);
        // Just after the integrator's time.
        let time = (self.time * (1.0 + STUCK)).min(self.segment_end);
        self.observe_until(time, Some(time));
        let (moved, size) = (self.state.clone(), self.machine.size());
        let before = self.machine.energy(time, &self.state);
        let happened = self.machine.settle(time, &mut self.state, &[direction], false, &self.names, &self.input_names);
        let work = self.state[size - 2] - moved[size - 2];
        let lost = before + work - self.machine.energy(time, &self.state);
        if !(lost >= 0.0) {
            self.state = moved;
            return None;
        }
        if lost == 0.0 {
            // No motion was left to stop; if it jams again here, the run cannot continue.
            self.jammed = Some(time);
        }
        if let Some(loss) = self.state.last_mut() {
            *loss += lost;
        }
        let what = format!(
            "{} jams: its load drives it, and its locking torque would exceed the driving torque (Painlevé); the impact dissipates {lost:.6} J",
            self.names[direction]
        );
        self.events.extend([what].into_iter().chain(happened).map(|what| Event { time, description: what }));
        self.note_shared_friction();
        self.machine.clear_jammed_gear();
        self.time = time;
        self.restart(time);
        Some(direction)
    }

    /// Reports from when on the motion of a gear is not unique, if it is not at the end of the last step and was at
    /// that of the step before.
    fn check_gear_ambiguity(&mut self) {
        if !self.machine.has_gear_losses() {
            return;
        }
        self.machine.evaluate(self.time, &self.state);
        let doubted = self.machine.ambiguous_gear();
        if let Some(direction) = doubted.filter(|_| doubted != self.doubted) {
            let (mut low, mut time) = (self.solver.previous_time(), self.time);
            let mut doubtful = |at: f64| {
                self.solver.interpolate(at, &mut self.looked);
                self.machine.evaluate(at, &self.looked);
                self.machine.ambiguous_gear() == doubted
            };
            if doubtful(low) {
                time = low;
            }
            while low < 0.5 * (low + time) && 0.5 * (low + time) < time {
                let middle = 0.5 * (low + time);
                if doubtful(middle) { time = middle } else { low = middle }
            }
            let what = format!(
                "{}: it self-locks against the inertia of its load, so two motions are possible from here (Painlevé): kardan takes the one in which the first \
                 shaft drives; the other one jams",
                self.names[direction]
            );
            self.events.push(Event { time, description: what });
        }
        self.doubted = doubted;
    }

    /// Whether a speed exceeds that of any drivetrain.
    fn has_diverged(&self) -> bool {
        let r = self.machine.degrees_of_freedom();
        self.state[r..2 * r].iter().any(|w| w.abs() > DIVERGED)
    }

    /// Ends the run where a speed exceeded that in the last step.
    fn diverged(&mut self) -> Outcome {
        let (mut low, mut high) = (self.solver.previous_time(), self.time);
        while low < 0.5 * (low + high) && 0.5 * (low + high) < high {
            let middle = 0.5 * (low + high);
            self.solver.interpolate(middle, &mut self.state);
            if self.has_diverged() { high = middle } else { low = middle }
        }
        self.observe_until(low, None);
        self.solver.interpolate(high, &mut self.state);
        self.machine.evaluate(high, &self.state);
        self.time = high;
        let what = if self.machine.has_laws() { "the loop diverges" } else { "the motion grows without bound" };
        let rows = match self.machine.watches_rows() {
            true => {
                format!(
                    "; {} may have no solution beyond this position, as where a rod is too short",
                    self.quoted_constraints()
                )
            }
            false => String::new(),
        };
        failed(high, format!("{what}: {}{rows}", self.fastest()))
    }

    /// Solves a linear loop up to the end of the segment; false if its numbers exceed those of a drivetrain; the
    /// integrator then locates that time.
    fn solve_segment(&mut self, end: f64) -> bool {
        let span = (self.time, end);
        let Some(segment) = LinearSegment::new(&mut self.machine, &mut self.outputs, span, &self.state, self.tolerance)
        else {
            return false;
        };
        segment.finish(&mut self.looked);
        let r = self.machine.degrees_of_freedom();
        if self.looked[r..2 * r].iter().any(|w| w.abs() > DIVERGED) {
            return false;
        }
        // The energy balance shows errors that the states do not.
        let size = self.looked.len();
        let [input, loss] = [size - 2, size - 1].map(|k| self.looked[k] - self.state[k]);
        let [before, after] = [self.machine.energy(self.time, &self.state), self.machine.energy(end, &self.looked)];
        let sizes = input.abs() + loss.abs() + before.abs() + after.abs();
        if (input - loss - (after - before)).abs() > OUT_OF_BALANCE * self.tolerance * sizes {
            return false;
        }
        self.state.copy_from_slice(&self.looked);
        self.segments.steps += 1;
        self.segments.evaluations += segment.evaluations as usize;
        self.segment = Some(segment);
        self.time = end;
        self.pending.boundary = end >= self.segment_end;
        true
    }

    /// Whether the state stays exactly constant until the segment ends: all coordinates are at rest, and no source
    /// changes.
    fn rests(&mut self) -> bool {
        self.solver.rests() && self.machine.is_steady() && {
            self.looked.copy_from_slice(&self.state);
            !self.leaves_equilibrium(self.time)
        }
    }

    /// Reports the progress from time to time; an error if the receiver ends the run.
    fn report_progress(&mut self, progress: &mut dyn FnMut(f64) -> Option<String>) -> Result<(), Outcome> {
        self.steps_since_progress += 1;
        if self.steps_since_progress >= PROGRESS_STEPS {
            self.steps_since_progress = 0;
            if let Some(why) = progress(self.time / self.scenario.duration) {
                self.observe_until(self.time, None);
                return Err(failed(self.time, why));
            }
        }
        Ok(())
    }

    /// Handles the event that the last step ended at.
    fn happen(&mut self) -> Result<(), Outcome> {
        let at = self.time;
        let at_once = at - self.chattering.last <= AT_ONCE * at;
        self.zeno_events =
            if at - self.chattering.last <= CLOSE * self.scenario.duration.min(1.0) { self.zeno_events + 1 } else { 0 };
        // A contact with repeated impacts (Zeno behaviour) is kept closed.
        self.chattering.at_once = if at_once { self.chattering.at_once + 1 } else { 0 };
        self.machine.let_rebound(self.chattering.at_once < KNOCKS);
        let crossing = std::mem::take(&mut self.reversed);
        self.machine.remember_commands(at, &mut self.state);
        let settled = self.settle(at, &crossing);
        settled?;
        if self.machine.was_struck() && !at_once {
            // Rebounds become smaller, and end; repeated impacts take no time.
            self.chattering = Chattering { since: at, ..Chattering::default() };
        }
        let Chattering { since, events, longest, last, .. } = &mut self.chattering;
        *last = at;
        *events += 1;
        if at - *since > *longest {
            (*since, *events, *longest) = (at, 0, 0.0);
        }
        let (since, events) = (*since, *events);
        if events > MOST_CHATTERING {
            let apart = at - since;
            let cause = format!(
                "more than {MOST_CHATTERING} events within {apart:.1e} s, less than a step of the smooth motion"
            );
            return Err(failed(at, format!("{cause}: {}", self.last_events(since, &crossing))));
        }
        if self.zeno_events > MOST_ZENO_EVENTS {
            let cause = format!("more than {MOST_ZENO_EVENTS} events follow each other closely (Zeno behaviour)");
            return Err(failed(at, format!("{cause}: {}", self.last_events(since, &crossing))));
        }
        self.reversed = crossing;
        if !self.pending.boundary {
            self.restart(at);
        }
        Ok(())
    }

    /// The last events since a time, as text; where there are none, the directions that left their mode and returned to
    /// it.
    fn last_events(&self, since: f64, crossing: &[usize]) -> String {
        let own = self.events.iter().rev().take_while(|event| event.time >= since);
        let what: Vec<&str> = own.take(6).map(|event| event.description.as_str()).collect();
        if !what.is_empty() {
            return format!("the last events: {}", what.join("; "));
        }
        let involved = if crossing.is_empty() { self.machine.holding() } else { crossing };
        let mut names: Vec<&str> = involved.iter().filter_map(|k| self.names.get(*k)).map(String::as_str).collect();
        names.sort_unstable();
        names.dedup();
        match names.is_empty() {
            true => "a motor or a sticking contact repeatedly reaches its limit and leaves it".into(),
            false => {
                format!("the contact state of {} switches repeatedly at its limit, to the last digits", quoted(names))
            }
        }
    }

    /// Repeats the last step so that it ends just after an event found in it: near the end of a step the dense output
    /// is as accurate as the step, in its middle it is not.
    fn shorten_step(&mut self, at: f64) -> Result<(), Outcome> {
        let (from, to) = (self.solver.previous_time(), self.solver.time());
        let end = at + BEYOND * (to - from);
        if end >= to {
            return Ok(());
        }
        let shortened = self.solver.shorten(&mut self.machine, end, &mut self.looked);
        shortened.map_err(|error| self.step_failed(error))
    }

    /// Changes between the method and the reference; false where there is none beside it.
    fn change_method(&mut self) -> bool {
        let Some(reference_solver) = &mut self.reference else { return false };
        std::mem::swap(&mut self.solver, reference_solver);
        self.solver.go_on_counting(reference_solver.counts());
        self.referred = !self.referred;
        true
    }

    fn restart(&mut self, time: f64) {
        self.solver.start(&mut self.machine, time, &self.state);
        // Which has evaluated the machine there.
        self.event_samples.take(0, time, &mut self.machine);
    }

    fn settle(&mut self, time: f64, crossing: &[usize]) -> Result<(), Outcome> {
        let happened = self.machine.settle(time, &mut self.state, crossing, false, &self.names, &self.input_names);
        self.events.extend(happened.into_iter().map(|what| Event { time, description: what }));
        self.note_shared_friction();
        self.note_blows();
        self.contradict()
    }

    /// Ends the run where rigid constraints require two different values of one motion.
    fn contradict(&self) -> Result<(), Outcome> {
        let mut names: Vec<&str> = Vec::new();
        for &direction in self.machine.contradiction() {
            let name_of_constraint = || &self.multiplier_names[direction - self.names.len()];
            let name = self.names.get(direction).unwrap_or_else(name_of_constraint);
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        if names.is_empty() {
            return Ok(());
        }
        names.sort_unstable();
        let what = match (&names[..], self.prescribing.is_empty()) {
            ([one], false) => format!(
                "`{one}` constrains a motion that {} prescribes, and contradicts it",
                quoted(self.prescribing.iter().map(String::as_str))
            ),
            ([one], true) => format!("`{one}` constrains a motion that constraints fix already, and contradicts them"),
            _ => format!("{} constrain one motion rigidly, and contradict each other", quoted(names)),
        };
        let cause =
            format!("{what}: give a stop `stiffness`, replace a lock by a clutch, or release one of them before");
        Err(failed(self.time, cause))
    }

    /// Notes which gears passed an impact, which contacts shared one, and which did not rebound.
    fn note_blows(&mut self) {
        let [shared, dulled] = self.machine.take_shared().map(|list| {
            let mut names: Vec<&str> = list.iter().map(|k| self.names[*k].as_str()).collect();
            names.dedup();
            (list.len(), quoted(names))
        });
        let mut notes = Vec::new();
        if shared.0 > 0 {
            notes.push(format!(
                "At an impact the rigid contacts {} act together: each returns its `restitution` of its compression impulse (Poisson's law). Rigid bodies do \
                 not determine how contacts share an impulse; where that matters, give them `stiffness`.",
                shared.1
            ));
        }
        if dulled.0 > 0 {
            notes.push(format!(
                "Impacts of {} accumulate at one instant (Zeno behaviour): kardan computed the last ones without restitution, which dissipates their remaining energy. \
                 Give one of the contacts `stiffness`, or separate them by a gap.",
                dulled.1
            ));
        }
        notes.retain(|note| !self.notes.contains(note));
        self.notes.extend(notes);
        for direction in self.machine.take_passed() {
            let note = format!(
                "A rigid impact passed through the gear `{}` without gear loss; kardan applies no loss to impacts even where the gear is self-locking. Where that matters, \
                 let a spring take the impact (`stiffness` of a stop, a spring_damper beside a lock or clutch): the gear then carries it as a load.",
                self.names[direction]
            );
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
    }

    fn note_shared_friction(&mut self) {
        let shared = self.machine.shared_friction();
        if !shared.is_empty() {
            let names: Vec<String> = shared.iter().map(|&k| format!("`{}`", self.names[k])).collect();
            let rubs = shared.iter().all(|&k| self.machine.is_friction(k));
            let [together, what] = if rubs { ["stick", "friction torque"] } else { ["act", "torque"] };
            let shown = match (self.machine.has_gear_losses() || !self.machine.shares_by_size(), rubs) {
                (true, _) => "one that satisfies all limits",
                (false, true) => "the one with the smallest torques relative to each Coulomb torque",
                (false, false) => "the one with the smallest torques relative to each torque limit",
            };
            let note = format!(
                "While {} {together} together, the split of the {what} between them is not unique (nor are constraint torques between \
                 them); shown is {shown}.",
                names.join(", "),
            );
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
    }

    /// Whether a mode is left at this time within the last step; fills the lists of directions that leave theirs.
    fn leaves(&mut self, time: f64) -> bool {
        self.solver.interpolate(time, &mut self.looked);
        self.leaves_equilibrium(time)
    }

    /// The same for the last evaluated state.
    fn leaves_equilibrium(&mut self, time: f64) -> bool {
        self.machine.reversed(time, &self.looked, &mut self.reversed);
        self.machine.drives_switch(time, &self.looked, &mut self.derivative, &mut self.moved, &mut self.switching);
        !self.reversed.is_empty() || !self.switching.is_empty() || self.machine.breaks_away(time, &self.looked)
    }

    /// The first event within the last step, where the series locate it and the modes confirm it, or where sampling
    /// finds it; approximate where the step is then repeated. `length` is that of the step, s.
    fn find_event(&mut self, length: f64) -> Option<f64> {
        self.guard.coarse = false;
        if self.guard.blind {
            self.check_against_series();
        }
        let length = length.min(self.solver.time() - self.solver.previous_time());
        let (found, first) = self.find_event_within(length)?;
        Some(self.find_closer(found, first))
    }

    /// Searches an event in a series step once more in a shorter one: near the start of a step the rounding error of a
    /// speed is estimated from the speeds of the step, and those at its end may be far larger; and an event that
    /// sampling found, not known to be the `first`, may have hidden an earlier one. Where there is none, the found
    /// event stays.
    fn find_closer(&mut self, mut found: f64, first: bool) -> f64 {
        let mut hides = !first;
        while let Integrator::Taylor(solver) = &mut self.solver {
            let (from, to) = (solver.previous_time(), solver.time());
            let early = found - from < EARLY * (to - from);
            let end = if early { from + CLOSER * (found - from) } else { found };
            if !(from < found && found <= end && end < to) || !(early || hides) {
                break;
            }
            hides = false;
            solver.end_at(end);
            let Some((at, _)) = self.find_event_within(end - from) else {
                if let Integrator::Taylor(solver) = &mut self.solver {
                    solver.end_at(to);
                }
                self.machine.measure_step(to - from, self.solver.previous_state(), self.solver.state());
                self.leaves(found);
                break;
            };
            found = at;
        }
        found
    }

    /// [`find_event`](Self::find_event) in the step as it is, and whether it is certainly the first one.
    fn find_event_within(&mut self, length: f64) -> Option<(f64, bool)> {
        match self.solver.prospect(&mut self.machine) {
            Prospect::Stays => return None,
            Prospect::Leaves(part) => {
                self.machine.measure_step(length, self.solver.previous_state(), self.solver.state());
                let zero = self.solver.previous_time() + part * length;
                if let Some((low, high)) = self.confirm(zero) {
                    let high = self.halve(low, high, 0.0);
                    self.leaves(high);
                    return Some((high, true));
                }
            }
            Prospect::Unknown => {}
        }
        self.look_for_event(length, !self.solver.shortens()).map(|found| (found, false))
    }

    /// Two times about one at which a mode is left by its series: at the first none is, at the second one is.
    fn confirm(&mut self, zero: f64) -> Option<(f64, f64)> {
        let (from, to) = (self.solver.previous_time(), self.solver.time());
        let (mut low, mut high) = (None, None);
        let mut apart = 4.0 * f64::EPSILON * zero.abs();
        for _ in 0..CONFIRMATIONS {
            let (before, after) = ((zero - apart).max(from), (zero + apart).min(to));
            if high.is_none() && self.leaves(after) {
                high = Some(after);
            }
            if low.is_none() && before < after && !self.leaves(before) {
                low = Some(before);
            }
            if let (Some(low), Some(high)) = (low, high) {
                return Some((low, high));
            }
            apart *= 32.0;
        }
        None
    }

    /// The first event within the last step: `exactly`, to the last bits of the time, or to a [`ROUGHLY`] of the step.
    ///
    /// `length` is that of the step before it was shortened, s.
    fn look_for_event(&mut self, length: f64, exactly: bool) -> Option<f64> {
        self.machine.measure_step(length, self.solver.previous_state(), self.solver.state());
        let (from, to) = (self.solver.previous_time(), self.solver.time());
        let friction = self.machine.has_friction();
        if friction && !self.event_samples.begin(from) {
            self.solver.interpolate(from, &mut self.looked);
            self.machine.evaluate(from, &self.looked);
            self.event_samples.take(0, from, &mut self.machine);
        }
        // A shortened step needs fewer samples: as many as its part of a whole one.
        let whole = length.max(self.solver.next_step());
        let event_samples = ((EVENT_SCAN_POINTS as f64 * (to - from) / whole).ceil() as usize)
            .clamp(LEAST_SCAN_POINTS, EVENT_SCAN_POINTS);
        let event_samples = if self.guard.blind { EVENT_SCAN_POINTS } else { event_samples };
        let part = |k: usize| {
            if self.guard.blind { event_samples::EVENT_SCAN_POINTS[k - 1] } else { k as f64 / event_samples as f64 }
        };
        let places: [f64; EVENT_SCAN_POINTS] =
            std::array::from_fn(|k| if k < event_samples { part(k + 1) } else { 1.0 });
        let (mut before, mut mode_change) = (from, None);
        for k in 1..=event_samples {
            let at = if k == event_samples { to } else { from + (to - from) * places[k - 1] };
            if at <= before {
                continue;
            }
            let leaves = self.leaves(at);
            mode_change = if leaves { Some(at) } else { self.touched(before, at) };
            if mode_change.is_some() {
                break;
            }
            before = at;
            if friction {
                self.event_samples.take(self.event_samples.count, at, &mut self.machine);
            }
        }
        let dip = if friction { self.dip() } else { None };
        let Some((low, high)) = dip.or(mode_change.map(|at| (before, at))) else {
            self.guard.coarse = self.guard.blind && friction && {
                let machine = &self.machine;
                self.event_samples.are_coarse(|watch| machine.room_noise(watch))
            };
            return None;
        };
        let least = if exactly { 0.0 } else { ROUGHLY * (to - from) };
        let high = self.locate(low, high, least);
        self.leaves(high);
        let Some(earlier) = self.touched(low, high) else { return Some(high) };
        self.leaves(earlier);
        Some(earlier)
    }

    /// The first contact between two samples that is penetrated at the later one without being detected there, as it
    /// opens again already: just after it touches. Needs the directions that leave their mode at the later one.
    fn touched(&mut self, before: f64, at: f64) -> Option<f64> {
        let mut touched = None;
        for watch in 0..self.event_samples.directions {
            if !self.machine.is_apart(watch) || touched.is_none() && self.reversed.contains(&watch) {
                continue;
            }
            // A contact that opened just now is penetrated by rounding.
            let least = self.event_samples.at(0, watch).min(0.0);
            let (mut low, mut high) = (before, touched.unwrap_or(at));
            if self.margin(high, watch) >= least {
                continue;
            }
            while low < 0.5 * (low + high) && 0.5 * (low + high) < high {
                let middle = 0.5 * (low + high);
                if self.margin(middle, watch) < least { high = middle } else { low = middle }
            }
            if self.leaves(high) {
                touched = Some(high);
            }
        }
        touched
    }

    /// The first time at which a mode is left, between one at which none is and one at which one is: the later end of an interval that
    /// is no longer than `least`, or of two neighbouring numbers.
    ///
    /// A mode that is left gives a number that changes its sign: its zero by regula falsi (Illinois: Dowell and
    /// Jarratt, BIT 11, 1971, 168). The modes themselves decide on both sides of it, and bisection reduces the rest.
    fn locate(&mut self, mut low: f64, mut high: f64, least: f64) -> f64 {
        if let Some(zero) = self.leaving_zero(low, high, least) {
            let mut apart = (4.0 * f64::EPSILON * zero.abs()).max(0.25 * least);
            for _ in 0..CONFIRMATIONS {
                let (before, after) = (zero - apart, zero + apart);
                if low < before && before < high {
                    if self.leaves(before) { high = before } else { low = before }
                }
                if low < after && after < high {
                    if self.leaves(after) { high = after } else { low = after }
                }
                if before <= low && high <= after {
                    break;
                }
                apart *= 32.0;
            }
        }
        self.halve(low, high, least)
    }

    /// The end of the bisection between a time at which no mode is left and a later one at which one is.
    fn halve(&mut self, mut low: f64, mut high: f64, least: f64) -> f64 {
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high || high - low <= least {
                return high;
            }
            if self.leaves(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
    }

    /// When the direction that leaves its mode at the later of two times reaches its limit; `None` if it is not within
    /// its limit at the first.
    fn leaving_zero(&mut self, low: f64, high: f64, least: f64) -> Option<f64> {
        self.leaves(high);
        let what = match (self.reversed.first(), self.switching.is_empty()) {
            (Some(&direction), _) => Some(direction),
            (None, true) => None,
            (None, false) => return None,
        };
        let (mut a, mut b) = ((low, self.room(low, what)), (high, self.room(high, what)));
        if !(a.1 > 0.0 && b.1 <= 0.0) {
            return None;
        }
        let close = least.max(f64::EPSILON * high.abs());
        let mut zero = high;
        // The end that the last step kept: its value then counts half.
        let mut retained_end = 0;
        for _ in 0..FALSE_POSITIONS {
            let next = b.0 - b.1 * (b.0 - a.0) / (b.1 - a.1);
            if !(a.0 < next && next < b.0) {
                break;
            }
            let value = self.room(next, what);
            let moved = (next - zero).abs();
            zero = next;
            if moved <= close || value == 0.0 || b.0 - a.0 <= close {
                break;
            }
            if value > 0.0 {
                a = (next, value);
                b.1 *= if retained_end == 1 { 0.5 } else { 1.0 };
                retained_end = 1;
            } else {
                b = (next, value);
                a.1 *= if retained_end == -1 { 0.5 } else { 1.0 };
                retained_end = -1;
            }
        }
        Some(zero)
    }

    /// The distance of a slipping direction from rest at a time within the last step (rad/s), or, without a direction,
    /// of the sticking ones from their limit (as a part of it).
    fn room(&mut self, time: f64, direction: Option<usize>) -> f64 {
        self.solver.interpolate(time, &mut self.looked);
        match direction {
            Some(direction) => self.machine.slip_room(time, &self.looked, direction),
            None => self.machine.active_reserve(time, &self.looked),
        }
    }

    /// A violation that appears and disappears between two samples: a margin that has its minimum there and may fall
    /// below zero. Returns the sample before and a time at which a mode is left.
    fn dip(&mut self) -> Option<(f64, f64)> {
        self.event_samples.measure_curvatures();
        let noise: Vec<f64> = (0..self.event_samples.directions).map(|watch| self.machine.room_noise(watch)).collect();
        for row in 1..self.event_samples.count {
            for watch in 0..self.event_samples.directions {
                let curvature = self.event_samples.curvatures[watch];
                if curvature <= noise[watch] {
                    continue;
                }
                let (left, right) = (self.event_samples.at(row - 1, watch), self.event_samples.at(row, watch));
                // The slope changes by the curvature in a gap, so a margin that falls by more has no minimum in it; and
                // one with a higher value does not reach zero.
                let turns = (right - left).abs() <= curvature && left.min(right) <= curvature;
                if !turns {
                    continue;
                }
                let (begin, end) = (self.event_samples.times[row - 1], self.event_samples.times[row]);
                let (mut low, mut high) = (begin, end);
                let (mut first, mut second) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
                let (mut a, mut b) = (self.margin(first, watch), self.margin(second, watch));
                for _ in 0..SECTIONS {
                    if !(low < first && first < second && second < high) {
                        break;
                    }
                    let (time, least) = if a <= b { (first, a) } else { (second, b) };
                    if least < 0.0 && self.leaves(time) {
                        return Some((begin, time));
                    }
                    // The largest fall that the curvature allows.
                    if !(least <= curvature * powi((high - low) / (end - begin), 2)) {
                        break;
                    }
                    // One of the two points serves again.
                    if a <= b {
                        (high, second, b) = (second, first, a);
                        first = high - GOLDEN * (high - low);
                        a = self.margin(first, watch);
                    } else {
                        (low, first, a) = (first, second, b);
                        second = low + GOLDEN * (high - low);
                        b = self.margin(second, watch);
                    }
                }
            }
        }
        None
    }

    /// The distance of a direction from leaving its mode at a time within the last step.
    fn margin(&mut self, time: f64, direction: usize) -> f64 {
        self.solver.interpolate(time, &mut self.looked);
        self.machine.evaluate(time, &self.looked);
        self.machine.margin_here(direction)
    }

    /// Records all rows and sensor readings before a time; with `last`, those at the end from the final state.
    fn observe_until(&mut self, time: f64, last: Option<f64>) {
        let mut is_observed = false;
        loop {
            let row = self.scenario.times.get(self.next_row).copied().unwrap_or(f64::INFINITY);
            let sample = self.outputs.next_sample();
            let at = row.min(sample);
            let pending = match last {
                Some(end) => at <= end,
                None => at < time,
            };
            if !pending {
                return;
            }
            if last.is_none() && self.record_series(row) {
                continue;
            }
            if let Some(segment) = self.segment.as_mut().filter(|segment| segment.covers(at)) {
                let rows = &self.scenario.times[self.next_row..];
                if segment.read_block(rows, time, |signal, values| self.outputs.extend(signal, values)) {
                    self.time_grid.extend_from_slice(&rows[..BLOCK]);
                    self.next_row += BLOCK;
                    continue;
                }
                segment.advance(at);
                if segment.read(|signal, value| self.outputs.push(signal, value)) {
                    self.time_grid.push(row);
                    self.next_row += 1;
                    continue;
                }
                segment.write(&mut self.looked);
            } else if last.is_some() {
                self.looked.copy_from_slice(&self.state);
            } else if !is_observed {
                self.solver.interpolate(at, &mut self.looked);
            }
            if last.is_none() && is_observed && !self.outputs.samples() {
                let rows = &self.scenario.times[self.next_row..];
                let count = rows.iter().take_while(|row| **row < time).count();
                self.outputs.record_again(count);
                self.time_grid.extend_from_slice(&rows[..count]);
                self.next_row += count;
                continue;
            }
            if last.is_some() || !is_observed {
                self.outputs.observe(&mut self.machine, at, &self.looked);
            }
            // While the state is constant, all rows are the same.
            is_observed = self.resting;
            self.outputs.sample(at);
            if row <= at {
                self.outputs.record();
                self.time_grid.push(row);
                self.next_row += 1;
            }
        }
    }

    /// Records a row from the series of the last step, if there are such; false if it must be evaluated.
    fn record_series(&mut self, row: f64) -> bool {
        if self.resting || self.segment.is_some() || !self.outputs.has_series() {
            return false;
        }
        let Some((order, begin)) = self.solver.series(&mut self.machine, !self.complete) else { return false };
        self.complete = true;
        self.outputs.record_series(&self.machine, order, row - begin);
        self.time_grid.push(row);
        self.next_row += 1;
        true
    }

    /// Records the steps and ramps of the scenario that begin at a time, and the faults that begin or end there.
    fn announce(&mut self, time: f64) {
        let events = self.scenario.faults.events().into_iter().filter(|(at, _)| *at == time);
        self.events.extend(events.map(|(time, what)| Event { time, description: what }));
        for event in self.scenario.events.iter().filter(|event| event.at == time) {
            let source = &self.scenario.sources[event.source];
            let value = match source.physical {
                Physical::Angle => format!("{} rad ({:.6} deg)", event.to, event.to.to_degrees()),
                physical => format!("{} {}", event.to, physical.unit()),
            };
            let what = if event.over > 0.0 {
                format!("{} ramps to {value} over {} s", source.name, event.over)
            } else {
                format!("{} steps to {value}", source.name)
            };
            self.events.push(Event { time, description: what });
        }
        for part in self.machine.reported_at(time) {
            let value = part.pieces.value(time + SAME * time);
            let what = format!("{} steps to {value} {}", part.name, part.dimension.si());
            self.events.push(Event { time, description: what });
        }
    }

    /// Which coordinate is faster than any drivetrain.
    fn fastest(&self) -> String {
        let speeds = &self.machine.work.kinematics.speeds;
        let fastest = (0..speeds.len()).max_by(|&a, &b| speeds[a].abs().total_cmp(&speeds[b].abs()));
        fastest.map_or_else(String::new, |k| {
            self.outputs
                .signals
                .iter()
                .filter(|s| matches!(s.physical, Physical::Speed | Physical::Velocity | Physical::Current))
                .nth(k)
                .map_or_else(String::new, |s| format!("{} exceeds {DIVERGED:e} {}", s.name, s.physical.unit()))
        })
    }

    fn step_failed(&mut self, error: StepError) -> Outcome {
        let at = self.solver.time();
        self.state.copy_from_slice(self.solver.state());
        let [diverges, or_diverges] = match self.machine.has_laws() {
            true => ["the loop diverges", "or the loop diverges"],
            false => {
                ["a variable grows without bound", "or a variable changes at an infinite rate, such as sqrt(t) at zero"]
            }
        };
        let what = self.nonfinite_signal(at);
        let text = match (error, what) {
            _ if let Some(direction) = self.machine.jammed_gear() => format!(
                "`{}` jams: its load drives it, and the loss would grow faster than the torque that causes it, so that no acceleration is consistent (Painlevé). {UNJAM}",
                self.names[direction]
            ),
            (_, Some(what)) if is_undefined(&what) => undefined(&what),
            (StepError::StepTooSmall { step, .. }, _) => format!(
                "the step became too small ({step:.3e} s): a time constant is too short for this mode, {or_diverges}"
            ),
            (StepError::NotFinite { .. }, Some(what)) => format!("{what}: {diverges}, or the inertia becomes singular"),
            (StepError::NotFinite { .. }, None) => format!(
                "within the next step, however short, the equations have no finite value: {diverges}, a function is \
                 undefined there, such as a square root of a negative number, or the inertia becomes singular"
            ),
        };
        failed(at, text)
    }

    /// The note where the tolerance, relative to the largest value of a coordinate or a speed, is below its rounding
    /// error in a step.
    fn rounding_limit(&self, series: &Series) -> Option<String> {
        let errors = self.state_names.iter().zip(self.solver.rounding().0);
        let relative = errors.filter_map(|((name, least), error)| {
            let signal = series.signal(name)?;
            let largest = signal.values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            Some((name, signal.physical.unit(), *error, error / (largest + least)))
        });
        let (name, unit, error, ratio) = relative.max_by(|a, b| a.3.total_cmp(&b.3))?;
        let tolerance = self.tolerance;
        (ratio > tolerance).then(|| {
            format!(
                "A tolerance of {tolerance:e} is below double precision: rounding alone causes errors of up to {error:.1e} {unit} in \
                 {name} per step, as large as a tolerance of {ratio:.1e} allows. kardan shortens no step below that limit."
            )
        })
    }

    /// The energy balance up to the current time.
    fn energy(&mut self) -> Energy {
        self.count_work();
        let size = self.machine.size();
        let stored = self.machine.energy(self.time, &self.state) - self.initial_energy;
        let (input, dissipated) = (self.state[size - 2], self.state[size - 1]);
        let exchanged = self.initial_energy + self.exchanged;
        Energy { input, stored, dissipated, residual: input - stored - dissipated, exchanged }
    }

    /// The message where the energy residual exceeds what the tolerances of the steps allow and what is negligible.
    fn unbalanced(&self, energy: &Energy, steps: usize) -> Option<String> {
        let Energy { residual, exchanged, .. } = *energy;
        let allowed = self.least_energy * steps as f64;
        // A residual that is not a number is an error.
        (!(residual.abs() <= SHOWS * exchanged + allowed)).then(|| {
            format!(
                "the energy balance does not close: the residual is {residual:.3e} J, of {exchanged:.3e} J exchanged. The results are \
                 wrong from some time on, though every step met its tolerance: search for a speed that jumps or a torque peak, where the \
                 equations are singular (a dead centre, a joint near 90°), and avoid that position; elsewhere a smaller `--tolerance` helps"
            )
        })
    }

    fn finish(mut self, outcome: Outcome) -> RunResult {
        let energy = self.energy();
        let counts = self.solver.counts();
        let steps = counts.accepted as usize + self.segments.steps;
        let (outcome, warnings) = match (outcome, self.unbalanced(&energy, steps)) {
            (Outcome::Completed, Some(cause)) => (Outcome::Unbalanced { cause }, Vec::new()),
            // The cause that stopped it takes precedence.
            (outcome, open) => (outcome, open.into_iter().collect()),
        };
        self.notes.extend(self.machine.notes_of_laws());
        let end = match outcome {
            Outcome::Failed { time, .. } => time,
            Outcome::Completed | Outcome::Unbalanced { .. } => self.scenario.duration,
        };
        let encoder_readings = self.machine.encoder_readings();
        let series =
            Series { time: std::mem::take(&mut self.time_grid), signals: std::mem::take(&mut self.outputs.signals) };
        let rounding = self.rounding_limit(&series);
        self.notes.extend(rounding);
        let motor_loads = self.machine.motor_loads((&self.input_names, &self.input_units), end, |motor| {
            series.largest_torque_demand(motor).unwrap_or_default() // every input has a signal
        });
        self.notes.extend(motor_loads.iter().filter_map(|motor_load| {
            let control = motor_load.controller.as_ref();
            let meanwhile = control.map_or(String::new(), |control| {
                format!(" Meanwhile control `{control}` does not behave as designed.")
            });
            Some(format!("{}.{meanwhile}", motor_load.describe(end)?))
        }));
        RunResult {
            series,
            motor_loads,
            energy,
            events: self.events,
            outcome,
            notes: self.notes,
            warnings,
            encoder_readings,
            sampled: self.machine.next_tick().is_finite(),
            effort: Effort {
                steps,
                rejected: counts.rejected as usize,
                evaluations: counts.evaluations as usize + self.segments.evaluations,
                events: self.located,
                rounding: self.solver.rounding().1,
                method: self.solver.method(self.segments.steps > 0 && !self.stepped),
            },
        }
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
    let solver = match method {
        Method::Dop853 => None,
        Method::Taylor | Method::Automatic | Method::Stepping => {
            Integrator::taylor(relative, absolute, machine, &outputs.shafts().unwrap_or_default())
        }
        Method::Radau => Integrator::radau(relative, absolute, machine, reduced),
    };
    if matches!(solver, Some(Integrator::Taylor(_))) {
        outputs.prepare_series(machine);
    }
    solver
}

/// Names of reduced coordinates, then of their speeds.
fn state_names(reduced: &Reduced) -> impl Iterator<Item = String> {
    let equations = &reduced.equations;
    let named = |rate: usize| {
        reduced.coordinates.iter().map(move |&k| equations.domain(k).motion()[rate].of(&equations.coordinates[k]))
    };
    named(0).chain(named(1))
}

/// Units of the inputs.
fn input_units(reduced: &Reduced) -> Vec<&'static str> {
    let unit = |input| reduced.equations.domain_of(input).effort().physical().unit();
    reduced.equations.inputs.iter().map(unit).collect()
}

/// The absolute error allowed in each state.
pub(super) fn absolute_tolerances(reduced: &Reduced, tolerance: Tolerance, size: usize) -> Vec<f64> {
    let r = reduced.degrees_of_freedom();
    let mut absolute = vec![tolerance.absolute; size];
    absolute[size - 2..].fill(ENERGY * tolerance.relative);
    for (k, &coordinate) in reduced.coordinates.iter().enumerate() {
        if reduced.equations.domain(coordinate) == Domain::Charge {
            absolute[k] *= SMALL;
            absolute[r + k] *= SMALL;
        }
    }
    if reduced.equations.domains.iter().all(|domain| *domain == Domain::Charge) {
        absolute[size - 2..].fill(SMALL * ENERGY * tolerance.relative);
    }
    absolute
}

fn failed(time: f64, cause: String) -> Outcome {
    Outcome::Failed { time, cause: format!("at t = {time:.9} s: {cause}") }
}
