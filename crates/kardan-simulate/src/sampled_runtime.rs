//! A sampled controller in a run: when it reads, computes and updates its torques.

use std::collections::VecDeque;

use kardan_rt::Health;

use super::counts::{EncoderReading, FlippedReading, Notes};
use super::failing_sensor::FailingSensor;
use super::sampler::{Period, Read, Sampler, stiffness};
use super::{Scenario, UnitFault, UnitFaultKind};
use kardan_math::num::{Random, StateArchive};
use kardan_mechanics::reduce::{Dynamics, Reduced, Work};
use kardan_results::signal_name::SignalName;
use kardan_synthesis::{Clock, ExportedSignal, Frozen, Law, LawRuntime, Observation};

/// Part of a sample time within which two instants are equal.
const SAME: f64 = 1e-9;

/// The clock of a sampled law, its state, and the commands of its motors.
pub(super) struct SampledRuntime {
    clock: Clock,
    runtime: LawRuntime,
    period: Period,
    /// Number of the next sample.
    next: u64,
    /// Commands in force.
    pub zoh_output: Vec<f64>,
    /// Delayed commands, with the time from which on they apply.
    queue: VecDeque<(f64, Vec<f64>)>,
    spare: Vec<Vec<f64>>,
    states: Vec<f64>,
    new_states: Vec<f64>,
    sensors: Vec<Source>,
    /// The faults of its unit, and the random source of times.
    faults: Vec<UnitFault>,
    random: Random,
    /// Whether it must restart.
    down: bool,
    readings: Vec<f64>,
    /// Torques on average until the next sample.
    average: Vec<f64>,
    health_counts: HealthCounts,
}

/// The source of a reading.
struct Source {
    /// Name of the sensor.
    name: String,
    read: Read,
    failing: FailingSensor,
    /// Its output at its last reading, where it has a sample time.
    last_reading: f64,
}

impl Source {
    /// Reads, with the faults that are active.
    fn read(&mut self, now: f64, model: (&Dynamics, &Work), references: &[f64]) {
        let Self { read, failing, last_reading, .. } = self;
        *last_reading = failing.read(now, || read.now(model, references));
    }
}

/// The number of faulty samples of a run, with the time of the first one.
#[derive(Default)]
struct HealthCounts {
    samples: usize,
    /// With an invalid reading, an invalid reference, a bounded command, a governed reference, an unchanged state.
    faulty: [Option<(usize, f64)>; 5],
}

impl HealthCounts {
    fn add(&mut self, time: f64, health: Health) {
        self.samples += 1;
        let invalid = [health.invalid_readings > 0, health.invalid_references > 0, health.commands_bounded > 0];
        let happened = invalid.into_iter().chain([health.governed, health.estimate_frozen]);
        for (so_far, _) in self.faulty.iter_mut().zip(happened).filter(|(_, happened)| *happened) {
            *so_far = Some(so_far.map_or((1, time), |(count, first)| (count + 1, first)));
        }
    }

    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.count(&mut self.samples);
        for counted in &mut self.faulty {
            let (mut count, mut first) = counted.unwrap_or((0, 0.0));
            archive.count(&mut count);
            archive.number(&mut first);
            *counted = (count > 0).then_some((count, first));
        }
    }

    fn notes(&self, who: &str, keeps: &str) -> Vec<String> {
        let [readings, references, bounded, governed, frozen] = self.faulty;
        let all = [
            (readings, "a reading was not a number, and the controller used the last valid one"),
            (references, "a reference was not finite, and the controller used the last valid one"),
            (governed, "the governor limited a reference, because a motor would have reached its limit"),
            (bounded, "the limits of a motor changed its command"),
            (frozen, keeps),
        ];
        let sentence = |(found, what): (Option<(usize, f64)>, &str)| {
            let (count, first) = found?;
            Some(format!("{who}: in {count} of {} samples {what} (first at {first:.6} s).", self.samples))
        };
        all.into_iter().filter_map(sentence).collect()
    }
}

impl SampledRuntime {
    /// A law at its clock.
    ///
    /// # Panics
    /// If a sensor of the law measures a signal that is none of its references (its design rejects that).
    pub fn new(law: &dyn Law, clock: Clock, reduced: &Reduced, scenario: &Scenario) -> Self {
        let named = !scenario.faults.units.is_empty();
        let controller = if named { law.describe().controller } else { String::new() };
        let sensors: Vec<Source> = law
            .sensors()
            .iter()
            .map(|signal| {
                let head = SignalName::new(&signal.name).element;
                let sensor = reduced.equations.sensor(head);
                let differentiates = sensor.is_some_and(Sampler::differentiates);
                let reference = |_: &str| law.references().iter().position(|reference| reference.name == head);
                let read = Read::of(&signal.measured, reduced, differentiates, reference);
                let sampler = sensor.map_or_else(Sampler::ideal, |sensor| {
                    Sampler::new(head, sensor, stiffness(reduced, &signal.measured), scenario.seed)
                });
                Source {
                    name: head.to_string(),
                    read: read.expect("a signal that a law measures is a reference"),
                    failing: FailingSensor::new(sampler, &signal.name, head, scenario),
                    last_reading: 0.0,
                }
            })
            .collect();
        let (inputs, states) = (law.inputs().len(), law.states().len());
        Self {
            period: Period::of(clock.period),
            clock,
            runtime: law.run(),
            next: 0,
            zoh_output: vec![0.0; inputs],
            queue: VecDeque::new(),
            spare: Vec::new(),
            states: vec![0.0; states],
            new_states: vec![0.0; states],
            readings: vec![0.0; sensors.len()],
            sensors,
            faults: scenario.faults.units.iter().filter(|fault| fault.name == controller).cloned().collect(),
            random: Random::named(scenario.seed, &format!("jitter of {controller}")),
            down: false,
            average: vec![0.0; inputs],
            health_counts: HealthCounts::default(),
        }
    }

    /// Reseeds the noise of its sensors.
    pub fn draw_anew(&mut self, seed: u64) {
        self.sensors.iter_mut().for_each(|source| source.failing.sampler.draw_anew(&source.name, seed));
    }

    /// Its clock and its whole state.
    pub fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.word(&mut self.next);
        for list in
            [&mut self.zoh_output, &mut self.states, &mut self.new_states, &mut self.readings, &mut self.average]
        {
            archive.numbers(list);
        }
        let width = self.zoh_output.len();
        let mut waiting: Vec<(f64, Vec<f64>)> = self.queue.drain(..).collect();
        archive.list(&mut waiting, (0.0, vec![0.0; width]), |archive, (time, command)| {
            archive.number(time);
            archive.numbers(command);
        });
        self.queue.extend(waiting);
        for Source { failing, last_reading, .. } in &mut self.sensors {
            failing.archive_state(archive);
            archive.number(last_reading);
        }
        self.random.archive_state(archive);
        archive.flag(&mut self.down);
        self.health_counts.archive_state(archive);
        self.runtime.archive_state(archive);
    }

    /// Records the readings of its counting sensors, of which the first has that number in the whole loop; flips some
    /// readings. Returns the number of the next sensor.
    pub fn note_counts(&mut self, first: usize, flipped: &[FlippedReading]) -> usize {
        let counting = self.sensors.iter_mut().filter(|source| source.failing.sampler.resolution.is_some());
        let own = |number| flipped.iter().filter(move |flipped| flipped.sensor == number).copied().collect();
        counting.fold(first, |number, source| {
            source.failing.sampler.notes = Some(Box::new(Notes::new(source.name.clone(), own(number))));
            number + 1
        })
    }

    /// The readings of its sensors, where recording was requested.
    pub fn encoder_readings(&mut self) -> impl Iterator<Item = EncoderReading> {
        self.sensors.iter_mut().filter_map(|source| Some(source.failing.sampler.notes.take()?.encoder_readings))
    }

    /// Sensors that measure a torque by the twist of springs compute it with the stiffness of these.
    pub fn take_springs(&mut self, dynamics: &Dynamics) {
        for Source { read, failing, .. } in &mut self.sensors {
            if let Read::SpringDamper { springs, .. } = read {
                failing.sampler.stiffness = springs.iter().map(|spring| dynamics.spring_stiffness(*spring)).sum();
            }
        }
    }

    /// The signals of its law for blocks.
    pub fn exported(&self, what: ExportedSignal) -> f64 {
        match what {
            ExportedSignal::State(k) => self.states[k],
            ExportedSignal::Command(k) => self.queue.back().map_or(&self.zoh_output, |(_, command)| command)[k],
        }
    }

    /// Sets the law's states at the start of a run.
    pub fn start(&mut self, law: &dyn Law, angles: &[f64], speeds: &[f64]) {
        law.start(angles, speeds, &mut self.states);
    }

    /// The next instant with an action, s.
    pub fn next_time(&self) -> f64 {
        let sensors = self.sensors.iter().filter_map(|source| source.failing.next_time());
        let applied = self.queue.front().map(|(time, _)| *time);
        sensors.chain(applied).fold(self.period.at(self.next), f64::min)
    }

    /// Executes due actions: sensors read, delayed commands take effect, the law computes.
    pub fn advance(
        &mut self,
        time: f64,
        law: &dyn Law,
        references: &[f64],
        model: (&Dynamics, &Work),
        limits: &[Option<f64>],
    ) {
        let now = time + SAME * self.clock.period;
        for source in &mut self.sensors {
            if source.failing.next_time().is_some_and(|reading_time| reading_time <= now) {
                source.read(now, model, references);
            }
        }
        self.apply(now);
        if self.period.at(self.next) > now {
            return;
        }
        let fault = self.faults.iter().find(|fault| fault.is_active(now)).map(|fault| fault.kind);
        let work = model.1;
        if self.pauses(law, fault, work) {
            return;
        }
        for (reading, source) in self.readings.iter_mut().zip(&mut self.sensors) {
            if fault == Some(UnitFaultKind::Stale) {
                break;
            }
            if source.failing.sampler.next_time().is_none() {
                source.read(now, model, references);
            }
            *reading = source.last_reading;
        }
        let (readings, states) = (std::mem::take(&mut self.readings), std::mem::take(&mut self.states));
        let observation = Observation {
            time,
            angles: &work.kinematics.angles,
            speeds: &work.kinematics.speeds,
            disturbances: &[],
            references,
            readings: &readings,
            states: &states,
        };
        let mut command = self.spare.pop().unwrap_or_else(|| vec![0.0; self.zoh_output.len()]);
        self.runtime.command(observation, &mut command);
        let beyond = |(command, limit): (&f64, &Option<f64>)| limit.is_some_and(|limit| command.abs() > limit);
        let mut health = self.runtime.health();
        health.commands_bounded += command.iter().zip(limits).filter(|both| beyond(*both)).count();
        self.health_counts.add(time, health);
        let late = match fault {
            Some(UnitFaultKind::Jitter(most)) => most * self.random.unit(),
            _ => 0.0,
        };
        self.queue.push_back((self.period.at(self.next) + self.clock.delay + late, command));
        self.apply(now);
        self.next += 1;
        self.average(time, limits);
        self.runtime.next(observation, &self.average, &mut self.new_states);
        (self.readings, self.states) = (readings, states);
        std::mem::swap(&mut self.states, &mut self.new_states);
    }

    /// Whether its unit computes nothing at this sample; after a reset it restarts.
    fn pauses(&mut self, law: &dyn Law, fault: Option<UnitFaultKind>, work: &Work) -> bool {
        match fault {
            Some(UnitFaultKind::Reset) => {
                self.down = true;
                self.zoh_output.fill(0.0);
                self.spare.extend(self.queue.drain(..).map(|(_, command)| command));
            }
            Some(UnitFaultKind::Missed) => {}
            _ => {
                if self.down {
                    self.runtime = law.run();
                    law.start(&work.kinematics.angles, &work.kinematics.speeds, &mut self.states);
                    self.down = false;
                }
                return false;
            }
        }
        self.next += 1;
        true
    }

    /// Notes on its controller, as sentences.
    pub fn notes(&self, law: &dyn Law) -> Vec<String> {
        let (controller, frozen) = (law.describe().controller, law.keeps());
        let kind = if frozen == Frozen::Outputs { "The" } else { "Control" };
        let what = if frozen == Frozen::Estimate {
            "the estimate overflowed and stayed unchanged"
        } else {
            "an output or a state was not a number (a lost reading, a division by zero, an overflow) and stayed unchanged"
        };
        self.health_counts.notes(&format!("{kind} {controller}"), what)
    }

    fn apply(&mut self, now: f64) {
        while self.queue.front().is_some_and(|(time, _)| *time <= now) {
            if let Some((_, mut command)) = self.queue.pop_front() {
                std::mem::swap(&mut self.zoh_output, &mut command);
                self.spare.push(command);
            }
        }
    }

    /// The torques within the limits of the motors, on average from this sample to the next one.
    fn average(&mut self, time: f64, limits: &[Option<f64>]) {
        let end = self.period.at(self.next);
        let length = end - time;
        for (k, limit) in limits.iter().enumerate() {
            let limited = |command: f64| limit.map_or(command, |limit| command.clamp(-limit, limit));
            let (mut from, mut value, mut sum) = (time, self.zoh_output[k], 0.0);
            for (at, command) in self.queue.iter().take_while(|(at, _)| *at < end) {
                sum += limited(value) * (at - from);
                (from, value) = (*at, command[k]);
            }
            self.average[k] = (sum + limited(value) * (end - from)) / length;
        }
    }
}
