//! Many runs of one loop with different coefficients, in SIMD lanes.
//!
//! Lanes share the plan and its Taylor series. Each has steps, modes, events and samples of its own, decided by a
//! machine of its own, and takes the next run as soon as its own has ended: no lane waits for another one. The results
//! of a lane do not depend on the other lanes, so a run has the same bits in any of them, for any number of lanes.

use kardan_native::lanes;
use kardan_rt::Lanes;

use super::machine::{Lane, Machine, Prospect, SAME, Setup, SimdTaylor};
use super::outputs::{Outputs, SplitSignals};
use super::readings::Readings;
use super::run::absolute_tolerances;
use super::{Profile, Scenario, Tolerance, taylor};
use kardan_math::num::bracket;
use kardan_mechanics::assemble::CoefficientKind;
use kardan_results::Series;

/// Additional orders relative to a single run: a step costs more than its series, so fewer steps are faster; and the
/// most.
const MORE: usize = 5;
const MOST_ORDER: usize = 24;
/// Steps after which the reference takes over a run.
const MOST_STEPS: usize = 1_000_000;
/// A speed that no drivetrain reaches, rad/s.
const DIVERGED: f64 = 1e6;
/// Widenings of the interval around a zero of a series until a mode is left there; the first is this many units in the
/// last place.
const CONFIRMATIONS: usize = 3;
const FIRST: f64 = 4.0 * f64::EPSILON;
const LEAST: f64 = 1e-9;
const WIDER: f64 = 32.0;
/// Samples in a step at which modes are checked if series do not decide.
const EVENT_SCAN_POINTS: usize = 12;
/// Rows that are computed at a time.
const SIDE: usize = 8;
/// Events in close succession after which the reference takes over a run.
const MOST_ZENO_EVENTS: usize = 200;

/// Receives the signals of a run that ends, by its number; `None` where the reference must take over.
pub type TakeRun<'t> = dyn FnMut(usize, Option<&mut Series>) + 't;

/// The differences of a run from others: the values of the varying coefficients, and the seed of the sensor noise.
#[derive(Debug, Clone, PartialEq)]
pub struct LaneRun {
    /// The values.
    pub values: Vec<f64>,
    /// The seed.
    pub seed: u64,
}

/// The data that all lanes share.
struct Common {
    coefficients: Vec<(CoefficientKind, usize)>,
    scenario: Scenario,
    start: Vec<f64>,
    /// Errors allowed of the states in a step: relative, absolute.
    tolerances: (f64, Vec<f64>),
    /// Times at which lines of sources change, and the end, s.
    breakpoints: Vec<f64>,
    /// The states of laws with a clock before a run.
    sampled_laws: Vec<u64>,
}

/// A lane: its run, and its current state.
struct Own {
    /// Its number.
    lane: usize,
    machine: Machine,
    run: Option<usize>,
    /// The number of signals that have series, then those that are read at each row.
    series: Series,
    direct_count: usize,
    machine_readings: Option<Readings>,
    between: Vec<f64>,
    /// Memory for states at the begin, in the middle and at the end of a part of a step.
    parts: [Vec<f64>; 3],
    steps: usize,
    time: f64,
    /// The end of its present equations: the next breakpoint, or the next sample.
    end: f64,
    breakpoint: f64,
    tick: f64,
    /// Whether its rates are computed at the current state.
    rates_valid: bool,
    state: Vec<f64>,
    trial_state: Vec<f64>,
    rates: Vec<f64>,
    reversed: Vec<usize>,
    next_row: usize,
    /// Events in close succession, and the last one.
    zeno_events: usize,
    last: f64,
    coefficients: Vec<f64>,
}

/// Lanes for runs of one loop.
pub struct Ensemble(Kind);

enum Kind {
    One(Group<f64>),
    Four(Group<Lanes<f64, 4>>),
    Eight(Group<Lanes<f64, 8>>),
}

impl Ensemble {
    /// Lanes for a loop whose equations have the varying coefficients as
    /// [inputs](kardan_mechanics::assemble::Equations::run_parameters), in the same order; as many as machine code supports where
    /// `count` requests no other number: 1, 4 or 8.
    ///
    /// # Errors
    /// Why lanes do not support the loop.
    pub fn new(
        setup: Setup<'_>,
        varying: &[(CoefficientKind, usize)],
        tolerance: Tolerance,
        count: Option<usize>,
    ) -> Result<Self, &'static str> {
        Ok(Self(match count.unwrap_or_else(lanes) {
            8 => Kind::Eight(Group::new(setup, varying, tolerance)?),
            4 => Kind::Four(Group::new(setup, varying, tolerance)?),
            _ => Kind::One(Group::new(setup, varying, tolerance)?),
        }))
    }

    /// Runs one after the other, as many at a time as there are lanes. They end in any order.
    pub fn run(&mut self, runs: &[LaneRun], take: &mut TakeRun<'_>) {
        match &mut self.0 {
            Kind::One(group) => group.run(runs, take),
            Kind::Four(group) => group.run(runs, take),
            Kind::Eight(group) => group.run(runs, take),
        }
    }
}

struct Group<N> {
    simd_taylor: SimdTaylor<N>,
    common: Common,
    own: Vec<Own>,
    times: N,
    rooms: N,
    nexts: N,
}

impl<N: Lane> Group<N> {
    fn new(setup: Setup<'_>, varying: &[(CoefficientKind, usize)], tolerance: Tolerance) -> Result<Self, &'static str> {
        let (reduced, scenario) = (setup.reduced, setup.scenario);
        let reasons = [
            (!scenario.faults.is_empty(), "there are faults"),
            (!scenario.tasks.is_empty(), "there are programs or blocks with a sample time"),
            (scenario.flow.is_some(), "there are blocks"),
        ];
        if let Some((_, why)) = reasons.into_iter().find(|(is_so, _)| *is_so) {
            return Err(why);
        }
        let machine = || {
            let mut split_signals = None;
            let mut machine = Machine::with(setup, |motion, found| {
                split_signals = Outputs::new(reduced, scenario).split_signals(motion, reduced, found);
                split_signals.as_mut().map_or_else(Vec::new, |signals| std::mem::take(&mut signals.direct))
            });
            // Texts of events, which name the directions, are not used.
            machine.names.clear();
            let signals =
                split_signals.ok_or("a figure or a requirement reads a signal that SIMD lanes do not compute");
            signals.map(|signals| (machine, signals))
        };
        let (mut first, split_signals) = machine()?;
        let absolute = absolute_tolerances(reduced, tolerance, first.size());
        let order = (taylor::order(tolerance.relative) + MORE).min(MOST_ORDER);
        let simd_taylor = SimdTaylor::new(&first, (tolerance.relative, &absolute), order)?;
        let mut breakpoints: Vec<f64> = first.profiles.iter().flat_map(Profile::breakpoints).collect();
        breakpoints.push(scenario.duration);
        breakpoints.sort_by(f64::total_cmp);
        let common = Common {
            coefficients: varying.to_vec(),
            scenario: scenario.clone(),
            start: reduced.state(&scenario.position, &scenario.speed),
            tolerances: (tolerance.relative, absolute),
            breakpoints,
            sampled_laws: first.sampled_laws(),
        };
        let also = simd_taylor.also_places();
        let own = |lane: usize, (mut machine, split_signals): (Machine, _)| {
            machine.prepare_resolution(also);
            Own::new(lane, machine, split_signals, scenario, also.len())
        };
        let mut all = vec![own(0, (first, split_signals))];
        for lane in 1..N::COUNT {
            all.push(own(lane, machine()?));
        }
        Ok(Self { simd_taylor, common, own: all, times: N::all(0.0), rooms: N::all(1.0), nexts: N::all(0.0) })
    }

    fn run(&mut self, runs: &[LaneRun], take: &mut TakeRun<'_>) {
        let mut waiting = runs.iter().enumerate();
        self.own.iter_mut().for_each(|own| own.run = None);
        loop {
            let mut busy = false;
            for lane in 0..N::COUNT {
                while self.own[lane].run.is_none() {
                    let Some((number, run)) = waiting.next() else { break };
                    self.own[lane].begin(number, run, &self.common);
                    self.nexts.lanes_mut()[lane] = 0.0;
                    self.proceed(lane, take);
                }
                busy |= self.own[lane].run.is_some();
            }
            if !busy {
                return;
            }
            self.step(take);
        }
    }

    /// Where the equations of a lane change: it restarts, waits as long as no coordinate moves, and ends.
    fn proceed(&mut self, lane: usize, take: &mut TakeRun<'_>) {
        let Self { own, simd_taylor, common, times, rooms, .. } = self;
        let own = &mut own[lane];
        while let Some(number) = own.run {
            if own.time >= common.scenario.duration {
                if own.sample() {
                    own.select_modes(&[]);
                }
                own.repeat(common.scenario.times.len() - own.next_row, simd_taylor.also_places());
                own.run = None;
                take(number, Some(&mut own.series));
                return;
            }
            if own.time >= own.end {
                own.cross(common);
            }
            if !own.rates_valid {
                own.evaluate_rates();
            }
            own.rates_valid = false;
            if !own.is_fit() {
                own.run = None;
                take(number, None);
                return;
            }
            if !own.rests() {
                own.observe_here();
                simd_taylor.load(lane, &own.machine, &own.state);
                times.lanes_mut()[lane] = own.time;
                rooms.lanes_mut()[lane] = own.end - own.time;
                return;
            }
            own.wait(simd_taylor.also_places(), common);
        }
    }

    /// One step of every lane.
    fn step(&mut self, take: &mut TakeRun<'_>) {
        self.simd_taylor.expand(&self.times, &self.rooms, &self.nexts);
        for lane in 0..N::COUNT {
            let Self { own, simd_taylor, common, times, rooms, nexts } = self;
            let own = &mut own[lane];
            let Some(number) = own.run else { continue };
            let length = simd_taylor.length(lane);
            if !(length > FIRST * own.time && own.steps < MOST_STEPS) {
                own.run = None;
                take(number, None);
                continue;
            }
            own.steps += 1;
            let cut = own.resolve(length, simd_taylor, common);
            let length = cut.unwrap_or(length);
            let whole = cut.is_none() && length < rooms.lanes()[lane];
            if whole {
                nexts.lanes_mut()[lane] = length;
            }
            match cut {
                Some(length) => simd_taylor.state(lane, length, &mut own.trial_state),
                None => simd_taylor.end(lane, &mut own.trial_state),
            }
            let event = if simd_taylor.stays(lane) { None } else { own.event(length, simd_taylor) };
            let end = match event {
                Some(later) => (own.time + later).min(own.end),
                None if whole || cut.is_some() => own.time + length,
                None => own.end,
            };
            let r = own.machine.degrees_of_freedom();
            let mut fits = own.trial_state.iter().all(|x| x.is_finite())
                && own.trial_state[r..2 * r].iter().all(|w| w.abs() < DIVERGED);
            if !whole && event.is_none() && cut.is_none() && own.tick > own.end {
                fits &= own.belongs(length, simd_taylor, common);
            }
            if !fits {
                own.run = None;
                take(number, None);
                continue;
            }
            own.observe(end, simd_taylor);
            own.arrive(end);
            if event.is_some() {
                own.happen(common);
            }
            if event.is_some() || cut.is_some() || own.time >= own.end {
                self.proceed(lane, take);
            } else {
                simd_taylor.go_on(lane);
                times.lanes_mut()[lane] = end;
                rooms.lanes_mut()[lane] = own.end - end;
            }
        }
    }
}

impl Own {
    fn new(lane: usize, machine: Machine, signals: SplitSignals, scenario: &Scenario, direct_count: usize) -> Self {
        let size = machine.size();
        Self {
            lane,
            machine,
            run: None,
            series: Series { time: scenario.times.clone(), signals: signals.signals },
            direct_count,
            machine_readings: signals.machine_readings,
            between: vec![0.0; size],
            parts: std::array::from_fn(|_| vec![0.0; size]),
            steps: 0,
            time: 0.0,
            end: 0.0,
            breakpoint: 0.0,
            tick: 0.0,
            rates_valid: false,
            state: vec![0.0; size],
            trial_state: vec![0.0; size],
            rates: vec![0.0; size],
            reversed: Vec::new(),
            next_row: 0,
            zeno_events: 0,
            last: 0.0,
            coefficients: Vec::new(),
        }
    }

    /// Begins a run.
    fn begin(&mut self, number: usize, run: &LaneRun, common: &Common) {
        (self.run, self.rates_valid) = (Some(number), false);
        self.machine.begin_anew(&common.coefficients, &run.values, (&common.sampled_laws, run.seed));
        self.machine.start(&common.start, &mut self.state);
        self.series.signals.iter_mut().for_each(|signal| signal.values.clear());
        (self.time, self.next_row, self.steps, self.zeno_events, self.last) = (0.0, 0, 0, 0, 0.0);
        self.machine.enter_segment(0.0);
        if self.machine.next_tick() <= 0.0 {
            self.machine.tick(0.0, &self.state);
        }
        self.machine.select_modes(0.0, &mut self.state, &[], true);
        self.open(common);
    }

    /// Finds where the equations that are valid from here on end.
    fn open(&mut self, common: &Common) {
        let duration = common.scenario.duration;
        let later = common.breakpoints.iter().copied().find(|at| *at > self.time).unwrap_or(duration);
        self.breakpoint = later.min(duration).min(self.machine.timed.next(self.time));
        self.tick = self.machine.next_tick();
        // A sample that coincides with a breakpoint except for rounding uses the equations from there on.
        let sooner = self.tick < self.breakpoint * (1.0 - SAME);
        self.end = if sooner { self.tick } else { self.breakpoint };
    }

    /// A breakpoint, or a sample.
    fn cross(&mut self, common: &Common) {
        if self.time >= self.breakpoint {
            self.machine.enter_segment(self.time);
        }
        self.sample();
        self.evaluate_rates();
        self.rates_valid = self.machine.keeps_modes();
        if !self.rates_valid {
            self.select_modes(&[]);
        }
        self.open(common);
    }

    /// Executes laws whose sample is due.
    fn sample(&mut self) -> bool {
        let at_sample = self.tick <= self.time * (1.0 + SAME);
        if at_sample {
            self.machine.tick(self.time, &self.state);
        }
        at_sample
    }

    fn select_modes(&mut self, crossing: &[usize]) {
        self.machine.select_modes(self.time, &mut self.state, crossing, false);
    }

    /// Evaluates the rates at the current state.
    fn evaluate_rates(&mut self) {
        self.machine.derivative(self.time, &self.state, &mut self.rates);
    }

    fn is_fit(&self) -> bool {
        self.machine.contradiction.is_empty()
            && self.zeno_events < MOST_ZENO_EVENTS
            && self.rates.iter().all(|rate| rate.is_finite())
    }

    /// Whether the state stays constant until the equations change.
    fn rests(&mut self) -> bool {
        self.rates.iter().all(|rate| *rate == 0.0) && self.machine.is_steady() && {
            self.trial_state.copy_from_slice(&self.state);
            !self.leaves(self.time)
        }
    }

    /// The length of a step without unresolved operations, where it must be shorter.
    fn resolve<N: Lane>(&mut self, length: f64, simd_taylor: &SimdTaylor<N>, common: &Common) -> Option<f64> {
        let lane = self.lane;
        if simd_taylor.resolves(lane, length, &self.machine) {
            return None;
        }
        let (from, (relative, absolute)) = (self.time, &common.tolerances);
        let state = |at: f64, out: &mut [f64]| simd_taylor.state(lane, at - from, out);
        let until = self.machine.resolved_until((from, from + length), &mut self.parts, state, (*relative, absolute));
        (until < from + length).then_some(until - from)
    }

    /// Whether a step up to the end of the equations, which no terms have limited, follows the motion.
    fn belongs<N: Lane>(&mut self, length: f64, simd_taylor: &SimdTaylor<N>, common: &Common) -> bool {
        let (relative, absolute) = &common.tolerances;
        let mut slope = vec![0.0; self.between.len() - 2];
        taylor::INSIDE.iter().all(|part| {
            simd_taylor.state(self.lane, part * length, &mut self.between);
            self.machine.derivative(self.time + part * length, &self.between, &mut self.rates);
            simd_taylor.slope(self.lane, part * length, &mut slope);
            slope.iter().enumerate().all(|(k, slope)| {
                let size = self.state[k].abs().max(self.trial_state[k].abs()).max((slope * length).abs());
                (slope - self.rates[k]).abs() * length <= taylor::SLOPE_DEFECT * (absolute[k] + relative * size)
            })
        })
    }

    /// Records the values of a row at the current time that need more than the state: it is evaluated there.
    fn observe_here(&mut self) {
        if let Some(machine_readings) = self.machine_readings.as_mut()
            && self.series.time.get(self.next_row) == Some(&self.time)
        {
            machine_readings.observe_here(&mut self.machine);
            for (number, signal) in self.series.signals[self.direct_count..].iter_mut().enumerate() {
                signal.values.truncate(self.next_row);
                signal.values.push(machine_readings.value(number));
            }
        }
    }

    /// Keeps the state constant until the equations change.
    fn wait(&mut self, places: &[usize], common: &Common) {
        let rows = &common.scenario.times[self.next_row..];
        self.repeat(rows.iter().take_while(|row| **row < self.end).count(), places);
        self.time = self.end;
    }

    /// Records all rows before a time within the step.
    fn observe<N: Lane>(&mut self, end: f64, simd_taylor: &SimdTaylor<N>) {
        let rows = &self.series.time[self.next_row..];
        let count = rows.iter().take_while(|row| **row < end).count();
        let rows = &rows[..count];
        if rows.is_empty() {
            return;
        }
        for (number, signal) in self.series.signals[..self.direct_count].iter_mut().enumerate() {
            simd_taylor.also(self.lane, number, &mut self.coefficients);
            for rows in rows.chunks(SIDE) {
                let (mut later, mut sums) = ([0.0; SIDE], [0.0; SIDE]);
                later.iter_mut().zip(rows).for_each(|(later, row)| *later = row - self.time);
                for coefficient in self.coefficients.iter().rev() {
                    sums.iter_mut().zip(&later).for_each(|(sum, later)| *sum = *sum * later + coefficient);
                }
                signal.values.extend_from_slice(&sums[..rows.len()]);
            }
        }
        if let Some(machine_readings) = &mut self.machine_readings {
            let recorded = self.series.signals[self.direct_count].values.len() - self.next_row;
            for row in &rows[recorded..] {
                simd_taylor.state(self.lane, row - self.time, &mut self.between);
                machine_readings.observe(&mut self.machine, *row, &self.between);
                let signals = self.series.signals[self.direct_count..].iter_mut().enumerate();
                signals.for_each(|(number, signal)| signal.values.push(machine_readings.value(number)));
            }
        }
        self.next_row += count;
    }

    /// Moves to the last evaluated state.
    fn arrive(&mut self, end: f64) {
        std::mem::swap(&mut self.state, &mut self.trial_state);
        // Times that differ only by rounding are one time.
        self.time = if end >= self.end * (1.0 - SAME) { self.end } else { end };
    }

    /// Whether a mode is left at the last evaluated state.
    fn leaves(&mut self, time: f64) -> bool {
        self.machine.reversed(time, &self.trial_state, &mut self.reversed);
        !self.reversed.is_empty() || self.machine.breaks_away(time, &self.trial_state)
    }

    /// When a mode is left within a step, after the current time; [`Self::trial_state`] is the state at its end.
    fn event<N: Lane>(&mut self, length: f64, simd_taylor: &SimdTaylor<N>) -> Option<f64> {
        let prospect = simd_taylor.prospect(self.lane, length, &mut self.machine);
        if prospect == Prospect::Stays {
            return None;
        }
        self.machine.measure_step(length, &self.state, &self.trial_state);
        let found = match prospect {
            Prospect::Leaves(part) => self.confirm(part, length, simd_taylor),
            _ => None,
        };
        let found = found.or_else(|| self.scan_for_event(length, simd_taylor));
        if found.is_none() {
            simd_taylor.state(self.lane, length, &mut self.trial_state);
        }
        found
    }

    fn leaves_after<N: Lane>(&mut self, later: f64, simd_taylor: &SimdTaylor<N>) -> bool {
        simd_taylor.state(self.lane, later, &mut self.trial_state);
        self.leaves(self.time + later)
    }

    /// Just after the zero of a series, where a mode is left.
    fn confirm<N: Lane>(&mut self, part: f64, length: f64, simd_taylor: &SimdTaylor<N>) -> Option<f64> {
        let mut apart = (FIRST * (self.time + length)).max(LEAST * length);
        for _ in 0..CONFIRMATIONS {
            let later = (part * length + apart).min(length);
            if self.leaves_after(later, simd_taylor) {
                return Some(later);
            }
            apart *= WIDER;
        }
        None
    }

    /// The first sample at which a mode is left.
    fn scan_for_event<N: Lane>(&mut self, length: f64, simd_taylor: &SimdTaylor<N>) -> Option<f64> {
        let mut low = 0.0;
        for point in 1..EVENT_SCAN_POINTS + 1 {
            let mut high = length * point as f64 / EVENT_SCAN_POINTS as f64;
            if !self.leaves_after(high, simd_taylor) {
                low = high;
                continue;
            }
            let what = self.reversed.first().copied();
            let ends = [(high, self.beyond(true, what)), (low, f64::INFINITY)];
            let tolerance = 0.5 * FIRST * (self.time + length);
            [high, _] = bracket(ends, tolerance, |later| {
                let leaves = self.leaves_after(later, simd_taylor);
                self.beyond(leaves, what)
            });
            self.leaves_after(high, simd_taylor);
            return Some(high);
        }
        None
    }

    /// The distance of the last evaluated state from leaving a mode, negative beyond: by the speed of a direction that
    /// reverses, else by the torques of sticking directions.
    fn beyond(&mut self, leaves: bool, what: Option<usize>) -> f64 {
        let size = match what {
            Some(direction) => self.machine.slip_margin(direction).abs(),
            None if self.reversed.is_empty() => self.machine.active_reserve().abs(),
            None => f64::INFINITY,
        };
        if leaves { -size.max(f64::MIN_POSITIVE) } else { size }
    }

    /// Handles an event where a mode is left.
    fn happen(&mut self, common: &Common) {
        let close = 1e-7 * common.scenario.duration.min(1.0);
        self.zeno_events = if self.time - self.last <= close { self.zeno_events + 1 } else { 0 };
        self.last = self.time;
        let crossing = std::mem::take(&mut self.reversed);
        self.select_modes(&crossing);
        self.reversed = crossing;
    }

    /// Records `count` rows with the current values.
    fn repeat(&mut self, count: usize, places: &[usize]) {
        self.machine.evaluate(self.time, &self.state);
        for (signal, place) in self.series.signals.iter_mut().zip(places) {
            signal.values.extend(std::iter::repeat_n(self.machine.work.values()[*place], count));
        }
        if let Some(machine_readings) = self.machine_readings.as_mut().filter(|_| count > 0) {
            machine_readings.observe(&mut self.machine, self.time, &self.state);
            for (number, signal) in self.series.signals[self.direct_count..].iter_mut().enumerate() {
                signal.values.truncate(self.next_row);
                signal.values.extend(std::iter::repeat_n(machine_readings.value(number), count));
            }
        }
        self.next_row += count;
    }
}
