//! Taylor series of one loop in lanes: each lane at a point of its own, in modes of its own, with coefficients of its own.
//!
//! The plan and its series are computed for all lanes at once.

mod lanes;
mod response;
mod step_selection;

use std::sync::Arc;

use kardan_native::{Aligned, Native};

use super::Machine;
use super::connected_law::{Computer, ConnectedLaw};
use super::expansion::{Prospect, margin};
use super::timed::shifted;
use crate::compiled_plan::{CompiledPlan, evaluate};
use crate::drive::Drive;
use crate::friction::{Mode, NOISE};
use kardan_expr::plan::Series;
use kardan_math::num::StateArchive;
use kardan_mechanics::assemble::CoefficientKind;
use kardan_mechanics::reduce::MotionPlan;
pub use lanes::Lane;
use response::{Places, Response};
use step_selection::StepSelection;

/// Most directions and coordinates: matrices of all of them are computed at each point.
const MOST: usize = 12;

/// Series in lanes.
pub(crate) struct SimdTaylor<N> {
    plan: Arc<MotionPlan>,
    native: Option<Native<N>>,
    series: Series<N>,
    places: Places,
    order: usize,
    /// States without the work of the inputs and the loss; degrees of freedom, directions.
    size: usize,
    counts: [usize; 2],
    memory: Aligned<N>,
    response: Response<N>,
    step_selection: StepSelection<N>,
    /// Where the matrices of the response begin among the values of the series, and its accelerations and torques.
    matrices: usize,
    accelerations: usize,
    torques: usize,
    /// Value, slope and start of each source.
    lines: [Vec<N>; 3],
    /// The start and the coefficients of each time-dependent input polynomial.
    timed: [Vec<N>; 5],
    /// The same where the step begins.
    now: [Vec<N>; 4],
    zeros: Vec<N>,
}

/// `x·factor`, lane by lane.
#[inline(always)]
fn scaled<N: Lane>(out: &mut N, x: &N, factor: f64) {
    out.lanes_mut().iter_mut().zip(x.lanes()).for_each(|(out, x)| *out = x * factor);
}

impl<N: Lane> SimdTaylor<N> {
    /// Series of the loop of a machine up to an order.
    ///
    /// # Errors
    /// Why these lanes do not support the machine.
    pub(crate) fn new(machine: &Machine, tolerances: (f64, &[f64]), order: usize) -> Result<Self, &'static str> {
        let (r, m) = (machine.degrees_of_freedom, machine.modes.len());
        if let Some(why) = machine.why_alone() {
            return Err(why);
        }
        let own = &machine.places;
        let plan = Arc::clone(machine.dynamics.shared_plan());
        let MotionPlan { plan: code, inertia, friction_rows, friction_bias, .. } = &*plan;
        let places = Places {
            inputs: code.inputs.len(),
            sources: 2 * r + own.sources.start,
            timed: 2 * r + own.timed.start,
            forces: machine.memory_places(&own.forces),
            rates: machine.memory_places(&own.rates),
            friction_speeds: machine.memory_places(&own.friction_speeds),
            also: machine.memory_places(&own.also),
            by_position: machine.by_position(),
        };
        let steady = |input: usize| machine.is_steady_input(input);
        let of_motion = [inertia, friction_rows, friction_bias].into_iter().flatten();
        let of_motion = of_motion.map(|(_, output)| code.place(*output));
        let lists = [&places.forces, &places.rates, &places.friction_speeds, &places.also];
        let outputs: Vec<usize> = lists.into_iter().flatten().copied().chain(of_motion).collect();
        let response = Response::new(machine, &places);
        let mut matrices = 0;
        let series = Series::<N>::with(code, order, &outputs, steady, |first, steady| {
            matrices = first;
            response.steps(&places, first, steady)
        })
        .ok_or("a function of its loop has no series")?;
        let mut memory = Aligned::<N>::new(code.block().memory());
        code.block().begin(&mut memory);
        let (size, sources, zero) = (machine.size - 2, machine.lines.len(), N::all(0.0));
        let timed = machine.timed.polynomials().count();
        let torques = matrices + response.is_nonzero.len() - m;
        Ok(Self {
            native: Native::new(&code.block()),
            step_selection: StepSelection::new(
                (size, m),
                order,
                tolerances,
                machine.timed.time.then_some(places.also.len()),
            ),
            series,
            order,
            size,
            counts: [r, m],
            memory,
            response,
            matrices,
            accelerations: torques - r,
            torques,
            lines: std::array::from_fn(|_| vec![zero; sources]),
            timed: std::array::from_fn(|_| vec![zero; timed]),
            now: std::array::from_fn(|_| vec![zero; timed]),
            zeros: vec![zero; r + m],
            places,
            plan,
        })
    }

    /// Copies modes, sources and all inputs of a machine at the point that it has evaluated last into a lane, and its
    /// state.
    pub(crate) fn load(&mut self, lane: usize, machine: &Machine, state: &[f64]) {
        let [r, m] = self.counts;
        let put = |list: &mut [N], values: &mut dyn Iterator<Item = f64>| {
            list.iter_mut().zip(values).for_each(|(own, value)| own.lanes_mut()[lane] = value);
        };
        let inputs = self.places.inputs;
        put(&mut self.memory[..inputs], &mut machine.work.values()[..inputs].iter().copied());
        let StepSelection { numbers, senses, sticking, bounds, .. } = &mut self.step_selection;
        let active = |k| f64::from(machine.holding.contains(&k));
        put(&mut numbers.memory[*senses..*senses + m], &mut machine.modes.iter().map(|mode| mode.sign()));
        put(&mut numbers.memory[*sticking..*sticking + m], &mut (0..m).map(active));
        put(&mut numbers.memory[*bounds..*bounds + m], &mut machine.bounds[0].iter().copied());
        let Response { numbers, from, .. } = &mut self.response;
        let masks = &mut numbers.memory[from.len()..];
        put(&mut masks[..m], &mut (0..m).map(active));
        put(&mut masks[m..m + r], &mut (0..r).map(|i| f64::from(!machine.still.contains(&i))));
        for (part, list) in self.lines.iter_mut().enumerate() {
            put(list, &mut machine.lines.iter().map(|(value, slope, start)| [*value, *slope, *start][part]));
        }
        for (part, list) in self.timed.iter_mut().enumerate() {
            let own = machine.timed.polynomials();
            put(list, &mut own.map(|(start, coefficients)| if part == 0 { start } else { coefficients[part - 1] }));
        }
        self.stand(lane, state);
    }

    /// The state at which a lane's next series begins.
    fn stand(&mut self, lane: usize, state: &[f64]) {
        let own = &mut self.step_selection.numbers.memory[..self.size];
        own.iter_mut().zip(state).for_each(|(own, value)| own.lanes_mut()[lane] = *value);
    }

    /// Continues a lane from the end of its last step.
    pub(crate) fn go_on(&mut self, lane: usize) {
        let CompiledPlan { plan, memory, .. } = &mut self.step_selection.numbers;
        let first = 1 + self.counts[1];
        for i in 0..self.size {
            let end = memory[plan.place(first + i)].lanes()[lane];
            memory[i].lanes_mut()[lane] = end;
        }
    }

    /// Computes all series, each lane from a time of its own on, and then each lane's step length, at most as long as
    /// there is room.
    pub(crate) fn expand(&mut self, times: &N, rooms: &N, nexts: &N) {
        self.begin(times);
        let ([r, m], size, order) = (self.counts, self.size, self.order);
        for k in 0..order {
            if k > 0 {
                self.series.set(0, k, &self.step_selection.numbers.memory[k * size..][..size]);
                self.series.set(self.accelerations, k, &self.zeros);
                self.series.advance(k);
            }
            let per = 1.0 / (k + 1) as f64;
            let (computed, next) = self.step_selection.numbers.memory.split_at_mut((k + 1) * size);
            let (now, next) = (&computed[k * size..], &mut next[..size]);
            for i in 0..r {
                scaled(&mut next[i], &now[r + i], per);
                scaled(&mut next[r + i], self.series.at(self.accelerations + i, k), per);
            }
            for (next, place) in next[2 * r..].iter_mut().zip(&self.places.rates) {
                scaled(next, self.series.at(*place, k), per);
            }
            let StepSelection { numbers, speeds, torques, .. } = &mut self.step_selection;
            for d in 0..m {
                numbers.memory[*speeds + k * m + d] = *self.series.at(self.places.friction_speeds[d], k);
                numbers.memory[*torques + k * m + d] = *self.series.at(self.torques + d, k);
            }
        }
        // Values that are read are computed to the same order.
        if !self.places.also.is_empty() {
            self.series.set(0, order, &self.step_selection.numbers.memory[order * size..][..size]);
            self.series.set(self.accelerations, order, &self.zeros);
            self.series.advance(order);
        }
        let StepSelection { numbers, room, time_inputs, .. } = &mut self.step_selection;
        (numbers.memory[*room], numbers.memory[*room + 1]) = (*rooms, *nexts);
        for (i, place) in self.places.also.iter().enumerate().take(time_inputs.1) {
            (0..order + 1)
                .for_each(|k| numbers.memory[time_inputs.0 + k * time_inputs.1 + i] = *self.series.at(*place, k));
        }
        numbers.evaluate();
    }

    /// The values at the points, and the response there.
    fn begin(&mut self, times: &N) {
        let (size, Places { sources, .. }) = (self.size, &self.places);
        self.memory[..size].copy_from_slice(&self.step_selection.numbers.memory[..size]);
        let [values, slopes, starts] = &self.lines;
        for (k, ((value, slope), start)) in values.iter().zip(slopes).zip(starts).enumerate() {
            let lines = value.lanes().iter().zip(slope.lanes()).zip(start.lanes().iter().zip(times.lanes()));
            let own = self.memory[sources + k].lanes_mut().iter_mut().zip(lines);
            own.for_each(|(own, ((value, slope), (start, time)))| *own = value + slope * (time - start));
        }
        let first = self.places.timed;
        for k in 0..self.timed[0].len() {
            for lane in 0..N::COUNT {
                let [start, a, b, c, d] = std::array::from_fn(|part| self.timed[part][k].lanes()[lane]);
                let now = shifted(&[a, b, c, d], times.lanes()[lane] - start);
                self.now.iter_mut().zip(now).for_each(|(own, now)| own[k].lanes_mut()[lane] = now);
            }
        }
        self.memory[first..][..self.now[0].len()].copy_from_slice(&self.now[0]);
        evaluate(self.native.as_ref(), &self.plan.plan, &mut self.memory);
        self.series.begin(&self.memory);
        self.series.set(*sources, 1, slopes);
        (1..).zip(&self.now[1..]).for_each(|(order, own)| self.series.set(first, order, own));
        let Response { numbers, from, is_nonzero, .. } = &mut self.response;
        from.iter().enumerate().for_each(|(k, place)| numbers.memory[k] = self.memory[*place]);
        numbers.evaluate();
        for k in 0..is_nonzero.len() {
            self.series.set(self.matrices + k, 0, std::slice::from_ref(numbers.output(k)));
        }
    }

    /// The step length of each lane.
    pub(crate) fn length(&self, lane: usize) -> f64 {
        self.step_selection.numbers.output(0).lanes()[lane]
    }

    /// Whether the series of a lane resolve a step of that length.
    pub(crate) fn resolves(&self, lane: usize, length: f64, machine: &Machine) -> bool {
        machine.terms_resolve(length, self.order, |place, order| self.series.at(place, order).lanes()[lane])
    }

    /// Whether a lane certainly stays in the mode of a direction within its step.
    fn keeps(&self, lane: usize, direction: usize) -> bool {
        self.step_selection.numbers.output(1 + direction).lanes()[lane] > 0.0
    }

    /// Whether a lane certainly stays in its modes within its step.
    pub(crate) fn stays(&self, lane: usize) -> bool {
        (0..self.counts[1]).all(|direction| self.keeps(lane, direction))
    }

    /// The state of a lane at the end of its step.
    pub(crate) fn end(&self, lane: usize, out: &mut [f64]) {
        let first = 1 + self.counts[1];
        for (i, out) in out[..self.size].iter_mut().enumerate() {
            *out = self.step_selection.numbers.output(first + i).lanes()[lane];
        }
    }

    /// The state of a lane at a time after the point of expansion.
    pub(crate) fn state(&self, lane: usize, later: f64, out: &mut [f64]) {
        out.fill(0.0);
        let all = &self.step_selection.numbers.memory[..self.step_selection.speeds];
        for coefficients in all.chunks_exact(self.size).rev() {
            let pairs = out.iter_mut().zip(coefficients);
            pairs.for_each(|(out, coefficient)| *out = *out * later + coefficient.lanes()[lane]);
        }
    }

    /// The slope of the state of a lane at a time after the point of expansion.
    pub(crate) fn slope(&self, lane: usize, later: f64, out: &mut [f64]) {
        out.fill(0.0);
        let all = self.step_selection.numbers.memory[..self.step_selection.speeds].chunks_exact(self.size);
        for (order, coefficients) in all.enumerate().skip(1).rev() {
            let pairs = out.iter_mut().zip(coefficients);
            pairs.for_each(|(out, coefficient)| *out = *out * later + order as f64 * coefficient.lanes()[lane]);
        }
    }

    /// Coefficients of a value that is read.
    pub(crate) fn also(&self, lane: usize, number: usize, out: &mut Vec<f64>) {
        let place = self.places.also[number];
        out.clear();
        out.extend((0..self.order + 1).map(|k| self.series.at(place, k).lanes()[lane]));
    }

    /// Indices of the values that are read in the memory of the plan.
    pub(crate) fn also_places(&self) -> &[usize] {
        &self.places.also
    }

    /// What the series of a lane prove about its modes within a step of that length; see [`Machine::prospect`].
    pub(crate) fn prospect(&self, lane: usize, length: f64, machine: &mut Machine) -> Prospect {
        let ([r, m], mut scratch) = (self.counts, [0.0; 32]);
        let (scratch, StepSelection { numbers, torques, .. }) = (&mut scratch[..self.order], &self.step_selection);
        // Shared torques stay within all limits, or the result is unknown.
        let shares = !machine.following.is_empty();
        let mut shared = !shares || (0..m).all(|d| !machine.holding.contains(&d) || self.keeps(lane, d));
        if !shared && machine.shares_evenly() {
            let Machine { holding, bounds, torque_distribution, .. } = machine;
            let term = |k: usize, a: usize| numbers.memory[torques + k * m + holding[a]].lanes()[lane];
            let limit = |direction: usize, k: usize| if k == 0 { bounds[0][direction] } else { 0.0 };
            shared = torque_distribution.stays(holding.len(), &bounds[0], (length, self.order), term, limit);
        }
        if !shared {
            return Prospect::Unknown;
        }
        let speeds: Vec<f64> = numbers.memory[r..2 * r].iter().map(|x| x.lanes()[lane]).collect();
        let mut prospect = Prospect::Stays;
        for (d, mode) in machine.modes.iter().enumerate().filter(|(d, _)| !self.keeps(lane, *d)) {
            if *mode != Mode::Stick {
                let own = (0..self.order).map(|k| self.series.at(self.places.friction_speeds[d], k).lanes()[lane]);
                let begin = mode.sign() * own.clone().next().unwrap_or(0.0);
                let noise = || NOISE * machine.dynamics.friction_terms(d, &speeds, &machine.work);
                let rounding = if begin < 0.0 && -begin <= noise() { -begin } else { 0.0 };
                prospect = prospect.and(margin(scratch, length, own, mode.sign(), rounding));
            } else if !shares && machine.holding.contains(&d) {
                let limit = machine.bounds[0][d];
                for sign in [1.0, -1.0] {
                    let own = (0..self.order).map(|k| numbers.memory[torques + k * m + d].lanes()[lane]);
                    prospect = prospect.and(margin(scratch, length, own, sign, limit));
                }
            }
        }
        prospect
    }
}

impl Machine {
    /// Why lanes do not support it: they need a loop that is all in the plan between samples, with frictions as its
    /// only set-valued directions.
    fn why_alone(&self) -> Option<&'static str> {
        let has_outputs = |connected: &ConnectedLaw| !(connected.exported.is_empty() && connected.outputs.is_empty());
        let reasons = [
            (self.degrees_of_freedom.max(self.modes.len()) > MOST, "there are many coordinates or frictions"),
            (self.drives.iter().any(|drive| drive.rate.is_some()), "a motor has a rate limit"),
            (self.drives.iter().any(|drive| !drive.faults.is_empty()), "there are faults"),
            (
                !self.limits_meet_steps(),
                "a torque limit applies to a ramp, a time function or a law without sample time",
            ),
            (!self.multiplier_constraints.is_empty(), "there are loop-closing constraints"),
            (!self.gear_losses.is_empty(), "there are gear losses"),
            (!self.unilaterals.is_empty(), "there are stops, clutches or locks"),
            (!self.jenkins.directions.is_empty() || self.has_massless, "there are massless motions"),
            (self.own_laws, "a law without sample time, a program or blocks compute with their own code"),
            (self.moves, "speeds are prescribed"),
            (self.laws.iter().any(has_outputs), "there are programs or blocks"),
            (
                !(self.timed.is_polynomial() && self.kinks.of_time.is_empty()),
                "a function of time has a kink or jump at times not listed in advance",
            ),
            (self.kinks.of_state > 0, "a law of the file has a kink or jump that depends on the motion"),
        ];
        reasons.into_iter().find(|(is_so, _)| *is_so).map(|(_, why)| why)
    }

    /// The states of laws with a clock before a run.
    pub(crate) fn sampled_laws(&mut self) -> Vec<u64> {
        let mut archive = StateArchive::taking();
        self.sampled_runtimes().for_each(|sampled| sampled.archive_state(&mut archive));
        archive.data()
    }

    /// Takes values of the varying coefficients, laws with a clock, and a seed for the noise of their sensors, and
    /// resets to the start of a run.
    pub(crate) fn begin_anew(
        &mut self,
        coefficients: &[(CoefficientKind, usize)],
        values: &[f64],
        (sampled_laws, seed): (&[u64], u64),
    ) {
        for (coefficient, value) in coefficients.iter().zip(values) {
            self.dynamics.take_coefficient(*coefficient, *value);
            if let (CoefficientKind::Friction, term) = coefficient {
                self.bounds.iter_mut().for_each(|bounds| bounds[*term] = *value);
            }
        }
        self.work.give(&self.dynamics, self.places.run_parameters.start, values.iter().copied());
        self.work.forget_inertia();
        self.modes.fill(Mode::Stick);
        for list in [&mut self.holding, &mut self.following, &mut self.turning, &mut self.still] {
            list.clear();
        }
        self.at_rest = false;
        self.prepare_holding();
        self.step_length = 0.0;
        for list in [&mut self.step_speeds, &mut self.active_torque, &mut self.sources, &mut self.commands] {
            list.fill(0.0);
        }
        self.lines.fill((0.0, 0.0, 0.0));
        self.contradiction.clear();
        self.drives.iter_mut().for_each(Drive::begin_anew);
        let mut archive = StateArchive::putting(sampled_laws);
        for ConnectedLaw { computer, .. } in &mut self.laws {
            if let Computer::SampledRuntime(sampled) = computer {
                sampled.archive_state(&mut archive);
                sampled.take_springs(&self.dynamics);
                sampled.draw_anew(seed);
            }
        }
    }
}
