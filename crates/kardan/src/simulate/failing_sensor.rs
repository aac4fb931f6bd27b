//! What becomes of the readings of a sensor while it fails.

use super::{SensorFault, SensorFaultKind};
use crate::num::{Keeper, Random};

/// The faults of a sensor, and what it gave last.
pub(super) struct FailingSensor {
    faults: Vec<SensorFault>,
    /// Where the noise of a fault is drawn from.
    noise: Random,
    last: f64,
}

impl FailingSensor {
    /// Those among the faults of a run that concern a signal, by the name of its sensor; noise depends on that and the seed alone.
    pub fn new(signal: &str, sensor: &str, faults: &[SensorFault], seed: u64) -> Self {
        let faults = faults.iter().filter(|fault| fault.concerns(signal)).cloned().collect();
        Self { faults, noise: Random::named(seed, &format!("fault of {sensor}")), last: 0.0 }
    }

    /// Whether it ever fails.
    pub fn fails(&self) -> bool {
        !self.faults.is_empty()
    }

    /// What it gives where it would read this: no number where it is lost.
    pub fn reading(&mut self, held: f64, time: f64) -> f64 {
        let Some(fault) = self.faults.iter().find(|fault| fault.holds(time)) else {
            self.last = held;
            return held;
        };
        match fault.kind {
            SensorFaultKind::Lost => f64::NAN,
            SensorFaultKind::Stuck => self.last,
            SensorFaultKind::Offset(more) => held + more,
            SensorFaultKind::Drift(rate) => held + rate * (time - fault.at),
            SensorFaultKind::Noise(size) => held + size * self.noise.normal(),
            SensorFaultKind::Reversed => -held,
        }
    }

    /// What its next readings depend on.
    pub fn keep(&mut self, keeper: &mut Keeper<'_>) {
        self.noise.keep(keeper);
        keeper.number(&mut self.last);
    }
}
