//! A sensor in a run that may fail.

use super::sampler::Sampler;
use super::{Scenario, SensorFault, SensorFaultKind};
use kardan_math::num::{Random, StateArchive};

/// Times closer than this are equal, s.
const INSTANT: f64 = 1e-9;

/// A sensor with its faults, and its stuck value: all readers, at whatever times, read the same.
pub(super) struct FailingSensor {
    pub sampler: Sampler,
    faults: Vec<SensorFault>,
    /// The random seed of a fault's noise, together with the time of a reading.
    seed: u64,
    /// Its last output before it was stuck.
    last: f64,
    /// The begin of its stuck fault; none before.
    stuck: f64,
}

impl FailingSensor {
    /// With those faults of a run that concern a signal; their noise depends on the name of the sensor and the seed alone.
    pub fn new(sampler: Sampler, signal: &str, sensor: &str, scenario: &Scenario) -> Self {
        let faults = scenario.faults.sensors.iter().filter(|fault| fault.concerns(signal)).cloned().collect();
        let seed = Random::named(scenario.seed, &format!("fault of {sensor}")).next_u64();
        Self { sampler, faults, seed, last: 0.0, stuck: f64::NEG_INFINITY }
    }

    /// Whether it ever fails.
    pub fn fails(&self) -> bool {
        !self.faults.is_empty()
    }

    /// When it reads next by itself, s: without a sample time where it is stuck next, as it then keeps the output of
    /// that time.
    pub fn next_time(&self) -> Option<f64> {
        // One that begins during another one does not count separately.
        let is_first =
            |at: f64| self.faults.iter().find(|fault| fault.is_active(at)).is_some_and(|fault| fault.at == at);
        let stuck = |fault: &&SensorFault| fault.kind == SensorFaultKind::Stuck && fault.at > self.stuck;
        let all = self.faults.iter().filter(stuck).filter(|fault| is_first(fault.at));
        self.sampler.next_time().or_else(|| all.map(|fault| fault.at).min_by(f64::total_cmp))
    }

    /// Reads if it is time, and returns its output: NaN where it is lost.
    pub fn read(&mut self, time: f64, exact: impl FnOnce() -> f64) -> f64 {
        self.sampler.sample(time, exact);
        let value = self.sampler.zoh_output;
        let Some(fault) = self.faults.iter().find(|fault| fault.is_active(time)) else {
            self.last = value;
            return value;
        };
        match fault.kind {
            SensorFaultKind::Lost => f64::NAN,
            SensorFaultKind::Stuck => {
                // The stuck value is the output at the begin of the fault; later readers receive that value.
                if fault.at > self.stuck && time - fault.at <= INSTANT {
                    self.last = value;
                }
                self.stuck = fault.at;
                self.last
            }
            SensorFaultKind::Offset(more) => value + more,
            SensorFaultKind::Drift(rate) => value + rate * (time - fault.at),
            SensorFaultKind::Noise(size) => {
                // Rounded to a microsecond: readers at one instant may compute it with different last bits.
                let instant = (time * 1e6).round().to_bits();
                value + size * Random::new(Random::fnv(self.seed, &instant.to_le_bytes())).normal()
            }
            SensorFaultKind::Reversed => -value,
        }
    }

    /// The state that its next readings depend on.
    pub fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        self.sampler.archive_state(archive);
        archive.number(&mut self.last);
        archive.number(&mut self.stuck);
    }
}
