//! What becomes of the readings of a sensor while it fails.

use super::{SensorFault, SensorFaultKind};
use crate::num::{Random, StateArchive};

/// Two times within this are one, s.
const INSTANT: f64 = 1e-9;

/// The faults of a sensor, and where one that is stuck stands: all who read it, at whatever times, read the same.
pub(super) struct FailingSensor {
    faults: Vec<SensorFault>,
    /// Where the noise of a fault is drawn from, together with the time of a reading.
    seed: u64,
    /// What it gave last, before it was stuck.
    last: f64,
    /// The begin of the fault by which it is stuck; none before.
    stuck: f64,
}

impl FailingSensor {
    /// Those among the faults of a run that concern a signal, by the name of its sensor; noise depends on that and the seed alone.
    pub fn new(signal: &str, sensor: &str, faults: &[SensorFault], seed: u64) -> Self {
        let faults = faults.iter().filter(|fault| fault.concerns(signal)).cloned().collect();
        let seed = Random::named(seed, &format!("fault of {sensor}")).next_u64();
        Self { faults, seed, last: 0.0, stuck: f64::NEG_INFINITY }
    }

    /// Whether it ever fails.
    pub fn fails(&self) -> bool {
        !self.faults.is_empty()
    }

    /// When it is stuck next, s: what it gives then it gives on.
    pub fn next_stuck(&self) -> Option<f64> {
        // One that begins while another one holds is none of its own.
        let is_first =
            |at: f64| self.faults.iter().find(|fault| fault.is_active(at)).is_some_and(|fault| fault.at == at);
        let stuck = |fault: &&SensorFault| fault.kind == SensorFaultKind::Stuck && fault.at > self.stuck;
        let all = self.faults.iter().filter(stuck).filter(|fault| is_first(fault.at));
        all.map(|fault| fault.at).min_by(f64::total_cmp)
    }

    /// What it gives where it would read this: no number where it is lost.
    pub fn reading(&mut self, value: f64, time: f64) -> f64 {
        let Some(fault) = self.faults.iter().find(|fault| fault.is_active(time)) else {
            self.last = value;
            return value;
        };
        match fault.kind {
            SensorFaultKind::Lost => f64::NAN,
            SensorFaultKind::Stuck => {
                // Where it is stuck is what it gives then; who comes later has what was given before.
                if fault.at > self.stuck && time - fault.at <= INSTANT {
                    self.last = value;
                }
                self.stuck = fault.at;
                self.last
            }
            SensorFaultKind::Offset(more) => value + more,
            SensorFaultKind::Drift(rate) => value + rate * (time - fault.at),
            SensorFaultKind::Noise(size) => {
                // To a microsecond: who reads at one instant may know it by other last bits.
                let instant = (time * 1e6).round().to_bits();
                value + size * Random::new(Random::fnv(self.seed, &instant.to_le_bytes())).normal()
            }
            SensorFaultKind::Reversed => -value,
        }
    }

    /// What its next readings depend on.
    pub fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.number(&mut self.last);
        archive.number(&mut self.stuck);
    }
}
