//! The closed loop as a differential equation in one set of modes, and the decisions between modes.

use std::ops::Range;
use std::sync::Arc;

use super::clocked::Clocked;
use super::drive::{Drive, Limit, Rate, Spans};
use super::friction::{BoxProblem, Mode, OUTSIDE, Span};
use super::scenario::{Profile, Scenario, SourceTarget};
use crate::equations::InputKind;
use crate::num::{Cholesky, Keeper, dot};
use crate::reduce::{Dynamics, Kinematics, Reduced, Work};
use crate::results::MotorStrain;
use crate::synthesis::{Continuous, Law, Running, Seen};

/// A law with its wiring.
struct Wired {
    law: Arc<dyn Law>,
    computer: Computer,
    inputs: Vec<usize>,
    /// Torque limits of its inputs, N m.
    limits: Vec<Option<f64>>,
    references: Vec<usize>,
    reference_values: Vec<f64>,
    commands: Vec<f64>,
    /// Torques that its inputs report.
    torques: Vec<f64>,
    /// Where its own states are; nowhere, if it has a clock.
    states: Range<usize>,
}

/// What computes a law in a run.
enum Computer {
    Continuous(Box<dyn Continuous>),
    Clocked(Box<Clocked>),
}

impl Wired {
    fn clocked(&self) -> Option<&Clocked> {
        match &self.computer {
            Computer::Clocked(clocked) => Some(clocked),
            Computer::Continuous(_) => None,
        }
    }
}

/// What a law sees: the true angles and speeds, of disturbances nothing.
fn seen<'a>(kinematics: &'a Kinematics, references: &'a [f64], states: &'a [f64]) -> Seen<'a> {
    let Kinematics { angles, speeds, .. } = kinematics;
    Seen { angles, speeds, disturbances: &[], references, readings: &[], states }
}

/// What a machine is made of.
pub struct Setup<'a> {
    /// The plant.
    pub reduced: &'a Reduced,
    /// The laws, in any order; each input is commanded by one law or by the scenario.
    pub laws: &'a [Arc<dyn Law>],
    /// The scenario.
    pub scenario: &'a Scenario,
}

/// The closed loop: plant, motors, laws and sources, with the current modes.
///
/// State: reduced coordinates, their speeds, states of motors and laws, work of the inputs \[J\], loss \[J\].
pub struct Machine {
    pub(super) dynamics: Dynamics,
    pub(super) work: Work,
    laws: Vec<Wired>,
    drives: Vec<Drive>,
    profiles: Vec<Profile>,
    targets: Vec<SourceTarget>,
    /// `(value, slope, start)` of each source in the current segment.
    lines: Vec<(f64, f64, f64)>,
    pub(super) modes: Vec<Mode>,
    /// Independent directions among those that stick.
    holding: Vec<usize>,
    /// Directions that stick but follow from the holding ones.
    following: Vec<usize>,
    /// Reduced coordinates that stand still exactly.
    still: Vec<usize>,
    /// The step of the integrator that modes are looked at in: its length, s, and the largest size of each reduced speed
    /// at its two ends, rad/s.
    step_length: f64,
    step_speeds: Vec<f64>,
    freedoms: usize,
    size: usize,
    pub(super) sources: Vec<f64>,
    pub(super) commands: Vec<f64>,
    /// Torques that the inputs report.
    pub(super) torques: Vec<f64>,
    /// Torques that they apply: ripple too.
    pub(super) applied: Vec<f64>,
    force: Vec<f64>,
    pub(super) acceleration: Vec<f64>,
    weighted: Vec<f64>,
    hold_matrix: Vec<f64>,
    hold_factor: Cholesky,
    hold_torque: Vec<f64>,
    box_problem: BoxProblem,
    scratch: Vec<f64>,
    pub(super) friction_torques: Vec<f64>,
}

/// Relative size, against the terms that cancel in it, of what rounding leaves of an acceleration that should vanish.
const ROUNDING: f64 = 1e-12;

/// Part of the motion within the step that coming to rest may take away at the instant found; more means that coefficients
/// cancel, and nothing came to rest. The one is some units in the last place of the time over the step, the other about 1.
const TAKEN: f64 = 1e-3;
/// Relative difference of two times within which a located event lies.
const SAME_INSTANT: f64 = 1e-12;
/// Rounding of a speed on the dense output, relative to what cancels in it: units in the last place of 7 nested terms whose
/// weights reach some dozens.
const NOISE: f64 = 64.0 * f64::EPSILON;

impl Machine {
    /// Wires plant, laws and scenario.
    ///
    /// # Panics
    /// If a law names an input or reference that does not exist (the model checks this before).
    pub fn new(setup: Setup<'_>) -> Self {
        let (dynamics, work) = Dynamics::new(setup.reduced);
        let (r, m) = (dynamics.freedoms, dynamics.friction_count());
        let inputs = &setup.reduced.equations.inputs;
        let scenario = setup.scenario;
        let mut size = 2 * r;
        let mut place = |needed: bool| {
            needed.then(|| {
                size += 1;
                size - 1
            })
        };
        let drives: Vec<Drive> = inputs
            .iter()
            .map(|input| {
                let motor = match &input.value {
                    InputKind::Motor(motor) => motor.clone(),
                    InputKind::Disturbance => Default::default(),
                };
                let number = |x: &Option<crate::units::Exact>| x.as_ref().map(|x| x.to_f64());
                Drive {
                    limit: number(&motor.torque_limit),
                    rate: number(&motor.rate_limit),
                    lag: number(&motor.lag),
                    ripple: motor.ripple.as_ref().map(|ripple| (ripple.torque.to_f64(), ripple.order.to_f64())),
                    limit_mode: Limit::Inside,
                    rate_mode: Rate::Follow,
                    rate_state: place(motor.rate_limit.is_some()),
                    lag_state: place(motor.lag.is_some()),
                    at_limit: Spans::default(),
                    at_rate_limit: Spans::default(),
                }
            })
            .collect();
        let laws = setup
            .laws
            .iter()
            .map(|law| {
                let input =
                    |name: &String| inputs.iter().position(|i| i.element == *name).expect("a law commands inputs");
                let wired: Vec<usize> = law.inputs().iter().map(input).collect();
                let source =
                    |name: &str| scenario.sources.iter().position(|s| s.name == name).expect("a reference is a source");
                let references: Vec<usize> = law.references().iter().map(|reference| source(&reference.name)).collect();
                let first = size;
                let computer = match law.run() {
                    Running::Continuous(law_in_time) => {
                        size += law.states().len();
                        Computer::Continuous(law_in_time)
                    }
                    Running::Sampled(clock, block) => {
                        Computer::Clocked(Box::new(Clocked::new(&**law, (clock, block), setup.reduced, scenario)))
                    }
                };
                Wired {
                    computer,
                    reference_values: vec![0.0; references.len()],
                    commands: vec![0.0; wired.len()],
                    torques: vec![0.0; wired.len()],
                    states: first..size,
                    limits: wired.iter().map(|&input| drives[input].limit).collect(),
                    inputs: wired,
                    references,
                    law: Arc::clone(law),
                }
            })
            .collect();
        let profiles = (0..scenario.sources.len())
            .map(|k| Profile::new(scenario.events.iter().filter(|event| event.source == k)))
            .collect::<Vec<_>>();
        Self {
            laws,
            targets: scenario.sources.iter().map(|source| source.target).collect(),
            lines: vec![(0.0, 0.0, 0.0); profiles.len()],
            sources: vec![0.0; profiles.len()],
            profiles,
            modes: vec![Mode::Stick; m],
            holding: Vec::with_capacity(r),
            following: Vec::with_capacity(m),
            still: Vec::with_capacity(r),
            step_length: 0.0,
            step_speeds: vec![0.0; r],
            freedoms: r,
            size: size + 2,
            commands: vec![0.0; inputs.len()],
            torques: vec![0.0; inputs.len()],
            applied: vec![0.0; inputs.len()],
            force: vec![0.0; r],
            acceleration: vec![0.0; r],
            weighted: vec![0.0; m * r],
            hold_matrix: vec![0.0; m * m],
            hold_factor: Cholesky::new(0),
            hold_torque: vec![0.0; m],
            box_problem: BoxProblem::new(m),
            scratch: vec![0.0; r.max(m)],
            friction_torques: vec![0.0; m],
            drives,
            dynamics,
            work,
        }
    }

    /// Everything that the motion to come depends on, besides the state itself.
    pub(super) fn keep(&mut self, keeper: &mut Keeper<'_>) {
        for mode in &mut self.modes {
            let mut number = *mode as usize;
            keeper.count(&mut number);
            *mode = [Mode::Stick, Mode::Forward, Mode::Backward][number.min(2)];
        }
        for list in [&mut self.holding, &mut self.following, &mut self.still] {
            keeper.counts(list);
        }
        self.hold_factor = Cholesky::new(self.holding.len());
        keeper.number(&mut self.step_length);
        for list in [&mut self.step_speeds, &mut self.hold_torque, &mut self.sources, &mut self.commands] {
            keeper.numbers(list);
        }
        for (value, slope, start) in &mut self.lines {
            [value, slope, start].into_iter().for_each(|x| keeper.number(x));
        }
        self.profiles.iter_mut().for_each(|profile| profile.keep(keeper));
        self.drives.iter_mut().for_each(|drive| drive.keep(keeper));
        for wired in &mut self.laws {
            for list in [&mut wired.reference_values, &mut wired.commands, &mut wired.torques] {
                keeper.numbers(list);
            }
            match &mut wired.computer {
                Computer::Continuous(law) => law.keep(keeper),
                Computer::Clocked(clocked) => clocked.keep(keeper),
            }
        }
    }

    /// From a time on a source has one value, whatever the scenario says.
    pub(super) fn take_over(&mut self, source: usize, from: f64, value: f64) {
        self.profiles[source].hold(from, value);
    }

    /// Number of state variables.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Degrees of freedom.
    pub fn freedoms(&self) -> usize {
        self.freedoms
    }

    /// The profile of a source.
    pub(super) fn profile(&self, source: usize) -> &Profile {
        &self.profiles[source]
    }

    /// Sets the states of the laws at the start of a run.
    pub(super) fn start_laws(&mut self, state: &mut [f64]) {
        let r = self.freedoms;
        self.dynamics.update(&state[..r], &state[r..2 * r], &mut self.work);
        let kinematics = &self.work.kinematics;
        for wired in &mut self.laws {
            match &mut wired.computer {
                Computer::Clocked(clocked) => clocked.start(&*wired.law, &kinematics.angles, &kinematics.speeds),
                Computer::Continuous(_) => {
                    wired.law.start(&kinematics.angles, &kinematics.speeds, &mut state[wired.states.clone()])
                }
            }
        }
    }

    /// The next instant at which a sampled law reads, computes or changes its torques, s; infinite if there is none.
    pub(super) fn next_tick(&self) -> f64 {
        let clocks = self.laws.iter().filter_map(Wired::clocked);
        clocks.map(Clocked::next_time).fold(f64::INFINITY, f64::min)
    }

    /// What happened to the sampled laws, in sentences.
    pub(super) fn notes_of_laws(&self) -> Vec<String> {
        let sampled = self.laws.iter().filter_map(|wired| Some((wired, wired.clocked()?)));
        sampled.flat_map(|(wired, clocked)| clocked.notes(&wired.law.describe().controller)).collect()
    }

    /// Lets sampled laws do what is due at a time.
    pub(super) fn tick(&mut self, time: f64, state: &[f64]) {
        let r = self.freedoms;
        self.dynamics.update(&state[..r], &state[r..2 * r], &mut self.work);
        self.set_sources(time);
        for wired in &mut self.laws {
            let Computer::Clocked(clocked) = &mut wired.computer else { continue };
            for (value, &source) in wired.reference_values.iter_mut().zip(&wired.references) {
                *value = self.sources[source];
            }
            let model = (&self.dynamics, &self.work);
            clocked.advance(time, &wired.reference_values, model, &wired.limits);
        }
    }

    fn set_sources(&mut self, time: f64) {
        for (value, (at, slope, start)) in self.sources.iter_mut().zip(&self.lines) {
            *value = at + slope * (time - start);
        }
    }

    /// Takes the lines of all sources that hold from a time on.
    pub fn enter_segment(&mut self, time: f64) {
        for (line, profile) in self.lines.iter_mut().zip(&self.profiles) {
            *line = profile.piece(time);
        }
    }

    /// Kinematics, sources, commands, torques and the force without friction. False if the inertia is singular.
    fn forces(&mut self, time: f64, state: &[f64]) -> bool {
        let r = self.freedoms;
        let regular = self.dynamics.update(&state[..r], &state[r..2 * r], &mut self.work);
        self.set_sources(time);
        self.commands.fill(0.0);
        for (target, value) in self.targets.iter().zip(&self.sources) {
            if let SourceTarget::Input(input) = target {
                self.commands[*input] += value;
            }
        }
        for wired in &mut self.laws {
            let law = match &mut wired.computer {
                Computer::Continuous(law) => law,
                Computer::Clocked(clocked) => {
                    for (&input, command) in wired.inputs.iter().zip(&clocked.held) {
                        self.commands[input] += command;
                    }
                    continue;
                }
            };
            for (value, &source) in wired.reference_values.iter_mut().zip(&wired.references) {
                *value = self.sources[source];
            }
            let seen = seen(&self.work.kinematics, &wired.reference_values, &state[wired.states.clone()]);
            law.command(seen, &mut wired.commands);
            for (&input, command) in wired.inputs.iter().zip(&wired.commands) {
                self.commands[input] += command;
            }
        }
        self.force.copy_from_slice(&self.work.passive);
        for (k, drive) in self.drives.iter().enumerate() {
            let torque = match drive.lag_state {
                Some(place) => state[place],
                None => drive.after_rate(self.commands[k], state),
            };
            self.torques[k] = torque;
            let torque = match drive.ripple {
                Some((size, order)) => torque + size * (order * self.dynamics.input_angle(k, &self.work)).sin(),
                None => torque,
            };
            self.applied[k] = torque;
            for (force, g) in self.force.iter_mut().zip(&self.work.input_rows[k * r..(k + 1) * r]) {
                *force += torque * g;
            }
        }
        regular
    }

    /// Adds the friction of slipping directions to the force.
    fn slip_forces(&mut self) {
        let r = self.freedoms;
        for (k, mode) in self.modes.iter().enumerate() {
            if *mode != Mode::Stick {
                let speed = self.dynamics.friction_speed(k, &self.work);
                let torque = mode.sign() * self.dynamics.sliding_torque(k, speed);
                for (force, g) in self.force.iter_mut().zip(&self.work.friction_rows[k * r..(k + 1) * r]) {
                    *force -= torque * g;
                }
            }
        }
    }

    /// The accelerations in the current modes, from the force with slip friction.
    fn accelerate(&mut self) {
        let r = self.freedoms;
        self.acceleration.copy_from_slice(&self.force);
        self.work.factor.solve(&mut self.acceleration);
        let count = self.holding.len();
        if count == 0 {
            return;
        }
        if count == r {
            // Nothing moves: with all speeds zero, every acceleration bias vanishes too.
            self.acceleration.fill(0.0);
            self.hold_torques_of_force();
            return;
        }
        self.factor_holding();
        for a in 0..count {
            let k = self.holding[a];
            self.hold_torque[a] =
                dot(&self.work.friction_rows[k * r..(k + 1) * r], &self.acceleration) + self.work.friction_bias[k];
        }
        self.hold_factor.solve(&mut self.hold_torque[..count]);
        for a in 0..count {
            for i in 0..r {
                self.acceleration[i] -= self.weighted[a * r + i] * self.hold_torque[a];
            }
        }
        // One refinement keeps the sticking speeds at zero to the last bits.
        for a in 0..count {
            let k = self.holding[a];
            self.scratch[a] =
                dot(&self.work.friction_rows[k * r..(k + 1) * r], &self.acceleration) + self.work.friction_bias[k];
        }
        self.hold_factor.solve(&mut self.scratch[..count]);
        for a in 0..count {
            self.hold_torque[a] += self.scratch[a];
            for i in 0..r {
                self.acceleration[i] -= self.weighted[a * r + i] * self.scratch[a];
            }
        }
        for &i in &self.still {
            self.acceleration[i] = 0.0;
        }
    }

    /// `weighted = H⁻¹ Gᵀ` and the factor of `G H⁻¹ Gᵀ` over the holding directions.
    fn factor_holding(&mut self) {
        let (r, count) = (self.freedoms, self.holding.len());
        for a in 0..count {
            let k = self.holding[a];
            let row = &mut self.weighted[a * r..(a + 1) * r];
            row.copy_from_slice(&self.work.friction_rows[k * r..(k + 1) * r]);
            self.work.factor.solve(row);
        }
        for a in 0..count {
            for b in 0..count {
                let k = self.holding[b];
                self.hold_matrix[a * count + b] =
                    dot(&self.weighted[a * r..(a + 1) * r], &self.work.friction_rows[k * r..(k + 1) * r]);
            }
        }
        self.hold_factor.factor(&self.hold_matrix[..count * count]);
    }

    /// Holding torques when everything stands still: `Gᵀ λ = force`.
    fn hold_torques_of_force(&mut self) {
        let (r, count) = (self.freedoms, self.holding.len());
        self.factor_holding();
        for a in 0..count {
            self.hold_torque[a] = dot(&self.weighted[a * r..(a + 1) * r], &self.force);
        }
        self.hold_factor.solve(&mut self.hold_torque[..count]);
    }

    /// The right-hand side in the current modes.
    pub fn derivative(&mut self, time: f64, state: &[f64], out: &mut [f64]) {
        let r = self.freedoms;
        if !self.forces(time, state) {
            out.fill(f64::NAN);
            return;
        }
        self.slip_forces();
        self.accelerate();
        out[..r].copy_from_slice(&state[r..2 * r]);
        for &i in &self.still {
            out[i] = 0.0;
        }
        out[r..2 * r].copy_from_slice(&self.acceleration);
        let mut input_power = 0.0;
        for (k, drive) in self.drives.iter().enumerate() {
            if let (Some(place), Some(rate)) = (drive.rate_state, drive.rate) {
                out[place] = match drive.rate_mode {
                    Rate::Follow => 0.0,
                    Rate::Rise => rate,
                    Rate::Fall => -rate,
                };
            }
            if let (Some(place), Some(lag)) = (drive.lag_state, drive.lag) {
                out[place] = (drive.after_rate(self.commands[k], state) - state[place]) / lag;
            }
            input_power += self.applied[k] * self.dynamics.input_speed(k, &self.work);
        }
        for wired in self.laws.iter_mut().filter(|wired| !wired.states.is_empty()) {
            for (torque, &input) in wired.torques.iter_mut().zip(&wired.inputs) {
                *torque = self.torques[input];
            }
            let seen = seen(&self.work.kinematics, &wired.reference_values, &state[wired.states.clone()]);
            if let Computer::Continuous(law) = &mut wired.computer {
                law.rates(seen, &wired.torques, &mut out[wired.states.clone()]);
            }
        }
        let mut loss = self.dynamics.damping_power(&self.work);
        for (k, mode) in self.modes.iter().enumerate() {
            let speed = self.dynamics.friction_speed(k, &self.work);
            loss += mode.sign() * self.dynamics.sliding_torque(k, speed) * speed;
        }
        out[self.size - 2] = input_power;
        out[self.size - 1] = loss;
    }

    /// Everything that outputs are read from: accelerations, motor torques, friction torques, at one point.
    pub fn observe(&mut self, time: f64, state: &[f64]) {
        self.forces(time, state);
        self.slip_forces();
        self.accelerate();
        for (k, mode) in self.modes.iter().enumerate() {
            let speed = self.dynamics.friction_speed(k, &self.work);
            self.friction_torques[k] = mode.sign() * self.dynamics.sliding_torque(k, speed);
        }
        for a in 0..self.holding.len() {
            self.friction_torques[self.holding[a]] = self.hold_torque[a];
        }
        if !self.following.is_empty() {
            self.split_friction();
        }
    }

    /// Shares the holding torque among sticking directions that depend on each other: the smallest torques relative to
    /// what each direction can hold at rest, `min Σ (λ/c)²`.
    fn split_friction(&mut self) {
        let (r, count) = (self.freedoms, self.holding.len());
        self.factor_holding();
        let c = self.dynamics.breakaway_torques();
        // Rows of B: each sticking direction as a combination of the holding ones.
        let sticking: Vec<usize> = self.holding.iter().chain(&self.following).copied().collect();
        let mut combination = vec![0.0; sticking.len() * count];
        for (row, &k) in sticking.iter().enumerate() {
            let coefficients = &mut combination[row * count..(row + 1) * count];
            for (a, value) in coefficients.iter_mut().enumerate() {
                *value = dot(&self.weighted[a * r..(a + 1) * r], &self.work.friction_rows[k * r..(k + 1) * r]);
            }
            self.hold_factor.solve(coefficients);
        }
        // (Bᵀ C² B) z = μ, λ = C² B z.
        let mut normal = vec![0.0; count * count];
        for (row, &k) in sticking.iter().enumerate() {
            let b = &combination[row * count..(row + 1) * count];
            for i in 0..count {
                for j in 0..count {
                    normal[i * count + j] += c[k] * c[k] * b[i] * b[j];
                }
            }
        }
        let mut z = self.hold_torque[..count].to_vec();
        let mut factor = Cholesky::new(count);
        if factor.factor(&normal) {
            factor.solve(&mut z);
            let shares: Vec<f64> = sticking
                .iter()
                .enumerate()
                .map(|(row, &k)| c[k] * c[k] * dot(&combination[row * count..(row + 1) * count], &z))
                .collect();
            if shares.iter().zip(&sticking).all(|(share, &k)| share.abs() <= c[k] * (1.0 + 1e-9)) {
                for (share, &k) in shares.iter().zip(&sticking) {
                    self.friction_torques[k] = *share;
                }
                return;
            }
        }
        let (_, torques) = self.solve_box(&sticking);
        for (torque, &k) in torques.iter().zip(&sticking) {
            self.friction_torques[k] = *torque;
        }
    }

    /// What the directions given, all at rest, do next; and the friction torques that hold or oppose them.
    ///
    /// A direction that depends on sticking ones sticks with them, so that modes never contradict the kinematics.
    fn decide(&mut self, resting: &[usize]) -> (Vec<Mode>, Vec<f64>) {
        let (accelerations, torques) = self.solve_box(resting);
        let mut modes: Vec<Mode> = accelerations
            .iter()
            .map(|acceleration| match acceleration {
                a if *a > 0.0 => Mode::Forward,
                a if *a < 0.0 => Mode::Backward,
                _ => Mode::Stick,
            })
            .collect();
        if modes.contains(&Mode::Stick) && modes.iter().any(|mode| *mode != Mode::Stick) {
            let sticking = resting.iter().zip(&modes).filter(|(_, mode)| **mode == Mode::Stick).map(|(&k, _)| k);
            let span = self.span(&sticking.collect::<Vec<_>>());
            for (&k, mode) in resting.iter().zip(&mut modes) {
                if *mode != Mode::Stick && span.left(self.metric_row(k)) <= OUTSIDE {
                    *mode = Mode::Stick;
                }
            }
        }
        (modes, torques)
    }

    /// The convex problem over the directions given, all at rest: accelerations along them and their torques.
    ///
    /// Needs `force` with the friction of all other directions.
    fn solve_box(&mut self, directions: &[usize]) -> (Vec<f64>, Vec<f64>) {
        let (r, m) = (self.freedoms, directions.len());
        let mut free = self.force.clone();
        self.work.factor.solve(&mut free);
        let row = |k: usize| &self.work.friction_rows[k * r..(k + 1) * r];
        let mut weighted = vec![0.0; m * r];
        for (a, &k) in directions.iter().enumerate() {
            weighted[a * r..(a + 1) * r].copy_from_slice(row(k));
            self.work.factor.solve(&mut weighted[a * r..(a + 1) * r]);
        }
        let w: Vec<f64> =
            (0..m * m).map(|i| dot(&weighted[i / m * r..(i / m + 1) * r], row(directions[i % m]))).collect();
        let right: Vec<f64> = directions.iter().map(|&k| dot(row(k), &free) + self.work.friction_bias[k]).collect();
        let cancels = |k: usize| {
            let terms = row(k).iter().zip(&free).map(|(g, x)| (g * x).abs()).sum::<f64>();
            terms + self.work.friction_bias[k].abs()
        };
        let cancels: Vec<f64> = directions.iter().map(|&k| cancels(k)).collect();
        let c: Vec<f64> = directions.iter().map(|&k| self.dynamics.breakaway_torques()[k]).collect();
        let mut torques = vec![0.0; m];
        self.box_problem.solve(&w, &right, &c, &mut torques);
        let accelerations = (0..m)
            .map(|a| {
                let row = &w[a * m..(a + 1) * m];
                let acceleration = right[a] - dot(row, &torques);
                let scale: f64 = cancels[a] + row.iter().zip(&c).map(|(w, c)| (w * c).abs()).sum::<f64>();
                let noise = ROUNDING * scale;
                let at_bound = torques[a] * acceleration.signum() >= c[a] * (1.0 - 1e-9);
                if at_bound && acceleration.abs() > noise { acceleration } else { 0.0 }
            })
            .collect();
        (accelerations, torques)
    }

    /// Whether the sticking directions can no longer hold at this point.
    pub fn breaks_away(&mut self, time: f64, state: &[f64]) -> bool {
        if self.holding.is_empty() {
            return false;
        }
        self.forces(time, state);
        self.slip_forces();
        self.accelerate();
        let c = self.dynamics.breakaway_torques();
        if self.holding.iter().zip(&self.hold_torque).all(|(&k, torque)| torque.abs() < c[k] * (1.0 - 1e-12)) {
            return false;
        }
        let sticking: Vec<usize> = self.holding.iter().chain(&self.following).copied().collect();
        self.decide(&sticking).0.iter().any(|mode| *mode != Mode::Stick)
    }

    /// Takes the step of the integrator that lies between two states as the scale of what happens in it; `length` (s) is that
    /// of the step before it was shortened for an event.
    pub fn measure_step(&mut self, length: f64, from: &[f64], to: &[f64]) {
        let speeds = self.freedoms..2 * self.freedoms;
        self.step_length = length;
        for ((size, a), b) in self.step_speeds.iter_mut().zip(&from[speeds.clone()]).zip(&to[speeds]) {
            *size = a.abs().max(b.abs());
        }
    }

    /// Whether there is friction at all.
    pub fn has_friction(&self) -> bool {
        !self.modes.is_empty()
    }

    /// Evaluates forces and accelerations in the present modes.
    pub fn evaluate(&mut self, time: f64, state: &[f64]) {
        self.forces(time, state);
        self.slip_forces();
        self.accelerate();
    }

    /// How far each direction is from leaving its mode at the point last evaluated: the part of the breakaway torque that holding
    /// directions have left, the speed (rad/s) of slipping ones; infinite for those that follow others.
    pub fn margins_here(&self, out: &mut [f64]) {
        for (k, margin) in out.iter_mut().enumerate() {
            *margin = self.slip_margin(k);
        }
        let c = self.dynamics.breakaway_torques();
        for (&k, torque) in self.holding.iter().zip(&self.hold_torque) {
            out[k] = 1.0 - torque.abs() / c[k];
        }
    }

    /// [`Machine::margins_here`] of one direction.
    pub fn margin_here(&self, direction: usize) -> f64 {
        let held = self.holding.iter().zip(&self.hold_torque).find(|(k, _)| **k == direction);
        held.map_or_else(
            || self.slip_margin(direction),
            |(&k, torque)| 1.0 - torque.abs() / self.dynamics.breakaway_torques()[k],
        )
    }

    fn slip_margin(&self, direction: usize) -> f64 {
        match self.modes[direction] {
            Mode::Stick => f64::INFINITY,
            mode => mode.sign() * self.dynamics.friction_speed(direction, &self.work),
        }
    }

    /// Slipping directions whose speed has the wrong sign at this point of the step, beyond rounding.
    pub fn reversed(&mut self, state: &[f64], out: &mut Vec<usize>) {
        out.clear();
        let r = self.freedoms;
        if !self.modes.iter().any(|mode| *mode != Mode::Stick) {
            return;
        }
        self.work.kinematics.update(&state[..r], &state[r..2 * r]);
        for (k, mode) in self.modes.iter().enumerate().filter(|(_, mode)| **mode != Mode::Stick) {
            let against = -mode.sign() * self.dynamics.friction_speed(k, &self.work);
            if against > 0.0 && against > NOISE * self.dynamics.friction_terms(k, &self.step_speeds, &self.work) {
                out.push(k);
            }
        }
    }

    /// Motors whose limits no longer fit their mode at this point.
    pub fn drives_switch(
        &mut self,
        time: f64,
        state: &[f64],
        derivative: &mut [f64],
        moved: &mut [f64],
        out: &mut Vec<usize>,
    ) {
        out.clear();
        if self.drives.iter().all(|drive| drive.limit.is_none() && drive.rate.is_none()) || self.commands_rest() {
            return;
        }
        self.forces(time, state);
        for k in 0..self.drives.len() {
            let (drive, command) = (&self.drives[k], self.commands[k]);
            let slack = 1e-13 * drive.limit.unwrap_or(0.0);
            let limit_left = match (drive.limit, drive.limit_mode) {
                (None, _) => false,
                (Some(limit), Limit::Inside) => command.abs() > limit + slack,
                (Some(limit), Limit::High) => command < limit - slack,
                (Some(limit), Limit::Low) => command > -limit + slack,
            };
            let rate_left = match (drive.rate_state, drive.rate_mode) {
                (None, _) | (Some(_), Rate::Follow) => false,
                (Some(place), Rate::Rise) => drive.limited(command) < state[place],
                (Some(place), Rate::Fall) => drive.limited(command) > state[place],
            };
            if limit_left || rate_left {
                out.push(k);
            }
        }
        if self.drives.iter().any(|drive| drive.rate.is_some() && drive.rate_mode == Rate::Follow) {
            let rates = self.command_rates(time, state, derivative, moved);
            for (k, drive) in self.drives.iter().enumerate() {
                let fast = drive.rate.is_some_and(|rate| rates[k].abs() > rate * (1.0 + 1e-6));
                if drive.rate_mode == Rate::Follow && drive.limit_mode == Limit::Inside && fast && !out.contains(&k) {
                    out.push(k);
                }
            }
        }
    }

    /// Whether commands and rate limiters stay as they are until the next sample or breakpoint: sampled laws alone command.
    fn commands_rest(&self) -> bool {
        let steady =
            |(target, line): (&SourceTarget, &(f64, f64, f64))| *target == SourceTarget::Reference || line.1 == 0.0;
        self.laws.iter().all(|wired| wired.clocked().is_some())
            && self.drives.iter().all(|drive| drive.rate.is_none())
            && self.targets.iter().zip(&self.lines).all(steady)
    }

    /// Whether the command of one motor stays as it is until the next sample or breakpoint.
    fn command_rests(&self, input: usize) -> bool {
        let steady = |(target, line): (&SourceTarget, &(f64, f64, f64))| match target {
            SourceTarget::Input(other) => *other != input || line.1 == 0.0,
            SourceTarget::Reference => true,
        };
        self.laws.iter().all(|wired| wired.clocked().is_some() || !wired.inputs.contains(&input))
            && self.targets.iter().zip(&self.lines).all(steady)
    }

    /// Rates of all commands along the motion, N m/s, by a difference along the vector field.
    fn command_rates(&mut self, time: f64, state: &[f64], derivative: &mut [f64], moved: &mut [f64]) -> Vec<f64> {
        self.derivative(time, state, derivative);
        let before = self.commands.clone();
        let step = 1e-7;
        for ((value, x), dx) in moved.iter_mut().zip(state).zip(derivative.iter()) {
            *value = x + step * dx;
        }
        self.forces(time + step, moved);
        self.commands.iter().zip(&before).map(|(after, before)| (after - before) / step).collect()
    }

    /// Decides all modes anew at a point, with the sources of the segment that begins there.
    ///
    /// `crossing` are slipping directions that have just come to rest; `everything` asks for all directions at rest to
    /// be found from their speeds (the beginning of a run). Speeds along directions at rest are set to zero by the
    /// smallest change in the metric of the inertia. Returns what happened in words.
    pub fn settle(
        &mut self,
        time: f64,
        state: &mut [f64],
        crossing: &[usize],
        everything: bool,
        names: &[String],
        input_names: &[String],
    ) -> Vec<String> {
        let r = self.freedoms;
        let before = self.modes.clone();
        let mut events = Vec::new();
        self.settle_drives(time, state, everything, input_names, &mut events);
        if !everything && crossing.is_empty() && self.modes.iter().all(|mode| *mode != Mode::Stick) {
            // Nothing is at rest, and nothing comes to rest.
            return events;
        }
        self.forces(time, state);
        self.slip_forces();
        self.accelerate();
        let (passing, crossing): (Vec<usize>, Vec<usize>) = crossing.iter().partition(|&&k| self.passes(k));
        for k in passing {
            let speed = self.dynamics.friction_speed(k, &self.work);
            self.modes[k] = if speed < 0.0 { Mode::Backward } else { Mode::Forward };
        }
        let mut resting: Vec<usize> =
            (0..self.modes.len()).filter(|&k| self.modes[k] == Mode::Stick || crossing.contains(&k)).collect();
        if everything {
            let speeds = &state[r..2 * r];
            let rests = |k: &usize| {
                let speed = self.dynamics.friction_speed(*k, &self.work).abs();
                speed <= NOISE * self.dynamics.friction_terms(*k, speeds, &self.work)
            };
            resting = (0..self.modes.len()).filter(rests).collect();
            for k in 0..self.modes.len() {
                let speed = self.dynamics.friction_speed(k, &self.work);
                self.modes[k] = if speed < 0.0 { Mode::Backward } else { Mode::Forward };
            }
        }
        // Directions that depend on resting ones rest too.
        self.choose_holding(&resting);
        let span = self.span(&resting);
        let dependent: Vec<usize> = (0..self.modes.len())
            .filter(|&k| !resting.contains(&k) && span.left(self.metric_row(k)) <= OUTSIDE)
            .collect();
        resting.extend(dependent);
        resting.sort_unstable();
        // Speeds along them are zero: v −= H⁻¹Gᵀ (G H⁻¹Gᵀ)⁻¹ G v.
        self.factor_holding();
        let count = self.holding.len();
        let mut lambda: Vec<f64> =
            self.holding.iter().map(|&k| dot(&self.work.friction_rows[k * r..(k + 1) * r], &state[r..2 * r])).collect();
        self.hold_factor.solve(&mut lambda);
        if count == r {
            state[r..2 * r].fill(0.0);
        } else {
            for a in 0..count {
                for i in 0..r {
                    state[r + i] -= self.weighted[a * r + i] * lambda[a];
                }
            }
        }
        for &i in &self.still {
            state[r + i] = 0.0;
        }
        self.forces(time, state);
        for &k in &resting {
            self.modes[k] = Mode::Stick;
        }
        self.slip_forces();
        let (modes, _) = self.decide(&resting);
        for (&k, mode) in resting.iter().zip(modes) {
            self.modes[k] = mode;
        }
        let sticking: Vec<usize> = (0..self.modes.len()).filter(|&k| self.modes[k] == Mode::Stick).collect();
        self.choose_holding(&sticking);
        if !everything {
            for (k, (was, is)) in before.iter().zip(&self.modes).enumerate() {
                if was != is {
                    events.push(match is {
                        Mode::Stick => format!("{} sticks", names[k]),
                        Mode::Forward => format!("{} slips forward", names[k]),
                        Mode::Backward => format!("{} slips backward", names[k]),
                    });
                }
            }
        }
        events
    }

    /// Whether a direction reverses because its coefficients cancel at this angle, while the drive moves on: to bring it to
    /// rest would take away motion, not the rounding of an instant. Needs the accelerations of the modes so far.
    fn passes(&self, k: usize) -> bool {
        if !self.dynamics.friction_varies(k) {
            return false;
        }
        let r = self.freedoms;
        let row = &self.work.friction_rows[k * r..(k + 1) * r];
        let mut change = row.to_vec();
        self.work.factor.solve(&mut change);
        let factor = self.dynamics.friction_speed(k, &self.work) / dot(row, &change);
        let (mut taken, mut there) = (0.0, 0.0);
        for ((change, size), acceleration) in change.iter().zip(&self.step_speeds).zip(&self.acceleration) {
            let change = (factor * change).abs();
            taken += change * change;
            there += change * (size + self.step_length * acceleration.abs());
        }
        taken > TAKEN * there || factor.is_nan()
    }

    /// Names of sticking directions whose torques are not unique.
    pub fn shared_friction(&self) -> Vec<usize> {
        if self.following.is_empty() {
            return Vec::new();
        }
        // A following direction shares with the holding ones that it is a combination of; one along which nothing can
        // move shares nothing.
        let (r, count) = (self.freedoms, self.holding.len());
        let mut out = Vec::new();
        for &f in &self.following {
            let row = &self.work.friction_rows[f * r..(f + 1) * r];
            let mut shares: Vec<f64> = (0..count).map(|a| dot(&self.weighted[a * r..(a + 1) * r], row)).collect();
            self.hold_factor.solve(&mut shares);
            let largest = shares.iter().fold(0.0f64, |max, x| max.max(x.abs()));
            if largest > 0.0 {
                out.push(f);
            }
            out.extend((0..count).filter(|&a| shares[a].abs() > 1e-9 * largest).map(|a| self.holding[a]));
        }
        out.sort_unstable();
        out.dedup();
        out
    }

    /// What a run up to a time asked of the motors that have limits; `asked` gives the largest torque asked of one.
    pub(super) fn strains(&self, names: &[String], end: f64, asked: impl Fn(&str) -> f64) -> Vec<MotorStrain> {
        let limited = |(_, drive): &(&String, &Drive)| drive.limit.is_some() || drive.rate.is_some();
        let strain = |(k, (name, drive)): (usize, (&String, &Drive))| {
            let commands = |wired: &&Wired| wired.inputs.contains(&k);
            MotorStrain {
                motor: name.clone(),
                controller: self.laws.iter().find(commands).map(|wired| wired.law.describe().controller),
                torque_limit: drive.limit,
                rate_limit: drive.rate,
                asked: asked(name),
                at_torque_limit: drive.at_limit.until(end),
                at_rate_limit: drive.at_rate_limit.until(end),
            }
        };
        names.iter().zip(&self.drives).enumerate().filter(|(_, both)| limited(both)).map(strain).collect()
    }

    fn settle_drives(
        &mut self,
        time: f64,
        state: &mut [f64],
        everything: bool,
        names: &[String],
        events: &mut Vec<String>,
    ) {
        self.forces(time, state);
        for k in 0..self.drives.len() {
            let command = self.commands[k];
            let drive = &mut self.drives[k];
            let mode = drive.limit_mode(command);
            if mode != drive.limit_mode {
                events.push(match mode {
                    Limit::Inside => format!("{} leaves its torque limit", names[k]),
                    _ => format!("{} reaches its torque limit", names[k]),
                });
                drive.limit_mode = mode;
            }
            let limited = drive.limited(command);
            if let Some(place) = drive.rate_state {
                if everything {
                    state[place] = 0.0;
                }
                let gap = limited - state[place];
                // A gap that the limiter closes within the resolution of the time is none.
                let instant = SAME_INSTANT * time.abs();
                let small = 1e-12 * (limited.abs() + state[place].abs()) + instant * drive.rate.unwrap_or(0.0);
                let mode = if gap > small {
                    Rate::Rise
                } else if gap < -small {
                    Rate::Fall
                } else {
                    Rate::Follow
                };
                drive.rate_mode = mode;
            }
        }
        if self.drives.iter().any(|drive| drive.rate.is_some() && drive.rate_mode == Rate::Follow) {
            let (mut derivative, mut moved) = (vec![0.0; self.size], vec![0.0; self.size]);
            let rates = self.command_rates(time, state, &mut derivative, &mut moved);
            for (k, rate) in rates.iter().enumerate() {
                let drive = &mut self.drives[k];
                let inside = drive.rate_mode == Rate::Follow && drive.limit_mode == Limit::Inside;
                if let Some(limit) = drive.rate
                    && inside
                    && rate.abs() > limit
                {
                    drive.rate_mode = if *rate > 0.0 { Rate::Rise } else { Rate::Fall };
                }
            }
        }
        for k in 0..self.drives.len() {
            let held = self.command_rests(k);
            self.drives[k].note_limits(time, self.commands[k], held);
        }
    }

    /// Before a restart: a rate limiter that followed its command takes its value as state.
    pub fn remember_commands(&mut self, time: f64, state: &mut [f64]) {
        if self.drives.iter().all(|drive| drive.rate_state.is_none()) {
            return;
        }
        self.forces(time, state);
        for (k, drive) in self.drives.iter().enumerate() {
            if let Some(place) = drive.rate_state
                && drive.rate_mode == Rate::Follow
            {
                state[place] = drive.limited(self.commands[k]);
            }
        }
    }

    /// A friction direction in the metric of the inverse inertia.
    fn metric_row(&self, k: usize) -> Vec<f64> {
        let r = self.freedoms;
        let mut row = self.work.friction_rows[k * r..(k + 1) * r].to_vec();
        self.work.factor.half_solve(&mut row);
        row
    }

    /// The span of directions, built from independent ones, the clearest first.
    fn span(&self, directions: &[usize]) -> Span {
        let mut span = Span { members: Vec::new(), basis: Vec::new() };
        let mut rows: Vec<(usize, Vec<f64>)> = directions.iter().map(|&k| (k, self.metric_row(k))).collect();
        while !rows.is_empty() && span.basis.len() < self.freedoms {
            let left: Vec<f64> = rows.iter().map(|(_, row)| span.left(row.clone())).collect();
            let best = (0..rows.len()).max_by(|&a, &b| left[a].total_cmp(&left[b]).then(b.cmp(&a))).unwrap_or(0);
            if left[best] <= OUTSIDE {
                break;
            }
            let (k, row) = rows.remove(best);
            span.add(k, row);
        }
        span
    }

    /// Chooses independent directions among those given and notes which coordinates stand still.
    fn choose_holding(&mut self, sticking: &[usize]) {
        let r = self.freedoms;
        self.holding = self.span(sticking).members;
        self.following = sticking.iter().copied().filter(|k| !self.holding.contains(k)).collect();
        self.hold_factor = Cholesky::new(self.holding.len());
        self.still.clear();
        if self.holding.len() == r {
            self.still.extend(0..r);
        } else {
            // Every sticking direction is at rest, whether it holds or follows.
            for &k in sticking {
                let row = &self.work.friction_rows[k * r..(k + 1) * r];
                let mut entries = row.iter().enumerate().filter(|(_, x)| **x != 0.0);
                if let (Some((i, _)), None) = (entries.next(), entries.next()) {
                    self.still.push(i);
                }
            }
        }
        self.factor_holding();
    }

    /// Kinetic and potential energy at a state, J.
    pub fn energy(&mut self, state: &[f64]) -> f64 {
        let r = self.freedoms;
        self.dynamics.update(&state[..r], &state[r..2 * r], &mut self.work);
        self.dynamics.energy(&self.work)
    }
}
