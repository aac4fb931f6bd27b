//! A closed loop that is stepped from outside: firmware tests, co-simulation, bindings, live pages.

use std::hash::{Hash, Hasher};

use thiserror::Error;

use super::run::RunLoop;
use super::{Scenario, Setup, SourceTarget, Tolerance};
use kardan_math::names::unknown_name;
use kardan_math::num::{Random, StateArchive};
use kardan_results::{Event, Outcome, Physical};

/// A closed loop that is stepped from outside, in steps of any size.
///
/// It is the loop that [`simulate`](super::simulate) runs: the same steps of the integrator, the same events. The times
/// at which the caller stops do not change the motion: the integration may be ahead, and its dense output gives the
/// requested values. (A noisy sensor without a sample time reads at every evaluation, so its own readings depend on how
/// often; no controller uses those.) Setting a signal ends the step there.
///
/// Actions due at exactly the time reached (a sample of a controller, a step of the scenario) happen when the loop
/// continues, so a signal set there affects them.
///
/// Cost: [`advance`](Self::advance) that of the steps of the integrator it takes, none where it is ahead already;
/// [`get`](Self::get) one evaluation of the equations for the first signal at a time, nothing for the others;
/// [`set`](Self::set) to another value a restart of the integrator and a new mode selection, to the same value nothing.
/// Between events there is no allocation once the loop has begun to move.
///
/// ```
/// use kardan_simulate::{Setup, Simulation, Tolerance};
/// use kardan::study;
///
/// let (prepared, _) = study::prepare(kardan::model::builtin("two-bodies").unwrap().source);
/// let variant = &prepared.variants[0];
/// let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
/// let mut bodies = Simulation::new(setup, Tolerance::default());
/// let (torque, angle) = (bodies.input("motor_1.tau")?, bodies.signal("body_2.phi")?);
///
/// // A push of one's own for a tenth of a second.
/// bodies.set(torque, 1.0)?;
/// bodies.advance(0.1)?;
/// bodies.set(torque, 0.0)?;
/// bodies.advance(0.5)?;
/// assert!(bodies.get(angle) > 0.0);
/// # Ok::<(), kardan_simulate::SimulationError>(())
/// ```
pub struct Simulation {
    run_loop: RunLoop,
    /// The time reached, s.
    now: f64,
    /// Whether the signals at that time have been evaluated.
    evaluated: bool,
    /// The values that are set from outside.
    own: Vec<Option<f64>>,
    failed: Option<String>,
    /// Identifies the simulated model and controllers.
    fingerprint: u64,
    /// The hash of its parameter values.
    values: u64,
}

/// A signal that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SignalId(usize);

/// A signal that can be set: a reference, a disturbance, the torque of a motor without a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct InputId(usize);

/// An error of a loop that is stepped from outside.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SimulationError {
    /// There is no such signal.
    #[error("there is no signal `{name}` that can be {what}; {help}")]
    Unknown {
        /// The requested name.
        name: String,
        /// `read` or `set`.
        what: &'static str,
        /// The nearest name, or all of them.
        help: String,
    },
    /// A value or a time that is not finite.
    #[error("{what} must be a finite number, found {value}")]
    NotFinite {
        /// The value or time that is not finite.
        what: String,
        /// The given value.
        value: f64,
    },
    /// A time before the one reached.
    #[error("the loop is at {now} s and cannot go back to {until} s; restore a snapshot from that time instead")]
    PastTime {
        /// The time reached, s.
        now: f64,
        /// The requested time, s.
        until: f64,
    },
    /// The integration cannot continue.
    #[error("{0}")]
    Failed(String),
    /// The snapshot is of another model or other controllers, or it is damaged.
    #[error("the snapshot does not fit: {0}")]
    Snapshot(&'static str),
}

/// The state of a loop, bit for bit: time, motion, modes of friction and motors, clocks and states of controllers,
/// noise.
///
/// Values of parameters are not part of it. Restored in a loop of the same model with other values, it is reinterpreted
/// with these: coordinates and their speeds stay, all other angles follow from the present values. That is meant for a
/// mechanism at rest; in motion, energy and torques jump.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Snapshot {
    fingerprint: u64,
    values: u64,
    data: Vec<u64>,
}

/// First word of a snapshot as bytes: its name, and the version of its format.
const MARK: u64 = u64::from_le_bytes(*b"kardan\0\x05");

impl Snapshot {
    /// As bytes, for a file: little endian words, the last one a checksum of the others.
    pub fn to_bytes(&self) -> Vec<u8> {
        let all = [MARK, self.fingerprint, self.values].into_iter().chain(self.data.iter().copied());
        all.chain([sum(&self.data, self.fingerprint ^ self.values)]).flat_map(u64::to_le_bytes).collect()
    }

    /// From bytes. The checksum detects damage, not forgery: deliberately made bytes with a valid checksum are trusted.
    ///
    /// # Errors
    /// [`SimulationError::Snapshot`] if they are not a snapshot, or damaged.
    ///
    /// ```
    /// use kardan_simulate::Snapshot;
    /// assert!(Snapshot::from_bytes(b"something else").is_err());
    /// ```
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SimulationError> {
        let (chunks, rest) = bytes.as_chunks::<8>();
        let data: Vec<u64> = chunks.iter().map(|chunk| u64::from_le_bytes(*chunk)).collect();
        let [MARK, fingerprint, values, data @ .., last] = &data[..] else {
            return Err(SimulationError::Snapshot("these bytes are not a snapshot of this version"));
        };
        if !rest.is_empty() || *last != sum(data, *fingerprint ^ *values) {
            return Err(SimulationError::Snapshot("bytes of it are missing or changed"));
        }
        Ok(Self { fingerprint: *fingerprint, values: *values, data: data.to_vec() })
    }
}

/// FNV-1a over words.
fn sum(data: &[u64], start: u64) -> u64 {
    data.iter().fold(start ^ 0xcbf2_9ce4_8422_2325, |hash, word| (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3))
}

/// FNV-1a over bytes: the same on every machine and in every version.
struct Fnv(u64);

impl Hasher for Fnv {
    fn write(&mut self, bytes: &[u8]) {
        self.0 = Random::fnv(self.0, bytes);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

impl Simulation {
    /// A loop at its start. The scenario continues as in a run, for any time: its duration and rows have no effect
    /// here, and the caller owns a signal from the time at which it sets it.
    ///
    /// # Panics
    /// If a law names an input or reference that does not exist (the model checks this before).
    pub fn new(setup: Setup<'_>, tolerance: Tolerance) -> Self {
        let Setup { reduced, laws, scenario } = setup;
        let endless = Scenario { duration: f64::INFINITY, times: Vec::new(), recorded: None, ..scenario.clone() };
        let run_loop = RunLoop::new(Setup { reduced, laws, scenario: &endless }, tolerance);
        let mut hasher = Fnv(0);
        for signal in &run_loop.outputs.signals {
            signal.name.hash(&mut hasher);
        }
        for law in laws {
            law.states().hash(&mut hasher);
            let clock = |clock: kardan_synthesis::Clock| [clock.period.to_bits(), clock.delay.to_bits()];
            law.clock().map(clock).hash(&mut hasher);
        }
        let fingerprint = hasher.finish();
        format!("{:?}", reduced.equations).hash(&mut hasher);
        Self {
            own: vec![None; scenario.sources.len()],
            run_loop,
            now: 0.0,
            evaluated: false,
            failed: None,
            fingerprint,
            values: hasher.finish(),
        }
    }

    /// The time reached, s.
    pub fn time(&self) -> f64 {
        self.now
    }

    /// All signals that can be read, with their kinds.
    pub fn signals(&self) -> impl Iterator<Item = (SignalId, &str, Physical)> + Clone {
        let all = self.run_loop.outputs.signals.iter().enumerate();
        all.map(|(k, signal)| (SignalId(k), signal.name.as_str(), signal.physical))
    }

    /// All signals that can be set, with their kinds.
    pub fn inputs(&self) -> impl Iterator<Item = (InputId, &str, Physical)> + Clone {
        let all = self.run_loop.scenario.sources.iter().enumerate();
        let all = all.filter(|(_, source)| source.target != SourceTarget::Block);
        all.map(|(k, source)| (InputId(k), source.name.as_str(), source.physical))
    }

    /// The signal of that name: `rk.phi`, `wg_motor.tau`.
    ///
    /// # Errors
    /// [`SimulationError::Unknown`] with the nearest name.
    pub fn signal(&self, name: &str) -> Result<SignalId, SimulationError> {
        find(name, "read", self.signals())
    }

    /// The signal of that name that can be set: `ref_rk`, `driver.tau`.
    ///
    /// # Errors
    /// [`SimulationError::Unknown`] with the nearest name.
    pub fn input(&self, name: &str) -> Result<InputId, SimulationError> {
        find(name, "set", self.inputs())
    }

    /// Sets a signal (SI) from now on.
    ///
    /// # Errors
    /// [`SimulationError::NotFinite`].
    ///
    /// # Panics
    /// If the input belongs to another model.
    pub fn set(&mut self, input: InputId, value: f64) -> Result<(), SimulationError> {
        let InputId(source) = input;
        if !value.is_finite() {
            let what = format!("the value of {}", self.run_loop.scenario.sources[source].name);
            return Err(SimulationError::NotFinite { what, value });
        }
        if self.own[source] == Some(value) {
            return Ok(());
        }
        self.own[source] = Some(value);
        self.run_loop.stand(self.now);
        self.run_loop.machine.take_over(source, self.now, value);
        self.evaluated = false;
        Ok(())
    }

    /// Advances to a time, s.
    ///
    /// # Errors
    /// [`SimulationError::PastTime`], [`SimulationError::NotFinite`]; [`SimulationError::Failed`] if the integration
    /// cannot continue: the loop then is at the time it reached.
    pub fn advance(&mut self, until: f64) -> Result<(), SimulationError> {
        if !until.is_finite() {
            return Err(SimulationError::NotFinite { what: "a time".into(), value: until });
        }
        if until < self.now {
            return Err(SimulationError::PastTime { now: self.now, until });
        }
        if let Some(cause) = &self.failed {
            return Err(SimulationError::Failed(cause.clone()));
        }
        self.evaluated = self.evaluated && until == self.now;
        if let Err(outcome) = self.run_loop.proceed(until, &mut |_| None) {
            let (time, cause) = match outcome {
                Outcome::Failed { time, cause } => (time, cause),
                Outcome::Unbalanced { cause } => (self.run_loop.time, cause),
                Outcome::Completed => (self.run_loop.time, "the run ended".into()),
            };
            self.now = time.clamp(self.now, until);
            self.failed = Some(cause.clone());
            return Err(SimulationError::Failed(cause));
        }
        self.now = until;
        Ok(())
    }

    /// The value of a signal (SI) at the time reached, before the actions due at that time.
    ///
    /// # Panics
    /// If the signal belongs to another model.
    pub fn get(&mut self, signal: SignalId) -> f64 {
        if !self.evaluated {
            self.run_loop.sample(self.now);
            self.evaluated = true;
        }
        self.run_loop.outputs.value(signal.0)
    }

    /// For each set-valued direction of the model (`Equations::set_valued`) the sign of its sliding speed at the time
    /// reached, zero where it sticks; `None` where no torque acts in it.
    pub fn modes(&self) -> Vec<Option<f64>> {
        (0..self.run_loop.machine.modes.len()).map(|k| self.run_loop.machine.sign_of(k)).collect()
    }

    /// The events since the last call, before the time reached.
    pub fn events(&mut self) -> Vec<Event> {
        let until = self.run_loop.events.partition_point(|event| event.time < self.now);
        self.run_loop.events.drain(..until).collect()
    }

    /// The state of the loop. Events that were not requested are not part of it.
    pub fn snapshot(&mut self) -> Snapshot {
        let mut archive = StateArchive::taking();
        self.archive_state(&mut archive);
        Snapshot { fingerprint: self.fingerprint, values: self.values, data: archive.data() }
    }

    /// Restores the state of a loop of the same model and controllers: from there on it gives the same numbers, bit for
    /// bit.
    ///
    /// # Errors
    /// [`SimulationError::Snapshot`] if it is of another model; the loop is then as it was.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SimulationError> {
        if snapshot.fingerprint != self.fingerprint {
            return Err(SimulationError::Snapshot("it is of another model, or of other controllers"));
        }
        let before = self.snapshot();
        let mut archive = StateArchive::putting(&snapshot.data);
        self.archive_state(&mut archive);
        if !archive.fits() {
            self.archive_state(&mut StateArchive::putting(&before.data));
            return Err(SimulationError::Snapshot("its number of values differs from that of the model"));
        }
        if snapshot.values != self.values {
            // Results computed ahead belong to the other values.
            self.run_loop.stand(self.now);
        }
        self.run_loop.events.clear();
        self.evaluated = false;
        self.failed = None;
        Ok(())
    }

    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.number(&mut self.now);
        self.own.iter_mut().for_each(|own| archive.optional(own));
        self.run_loop.archive_state(archive);
    }
}

/// The signal of a name among those that can be read or set.
fn find<'a, Id>(
    name: &str,
    what: &'static str,
    mut all: impl Iterator<Item = (Id, &'a str, Physical)> + Clone,
) -> Result<Id, SimulationError> {
    let names = all.clone().map(|(_, name, _)| name);
    let found = all.find(|(_, candidate, _)| *candidate == name).map(|(id, ..)| id);
    found.ok_or_else(|| SimulationError::Unknown { name: name.into(), what, help: unknown_name(name, names) })
}
