//! Laws with observers, as they compute in a loop.

use kardan_rt::Health;

use super::estimated_view::EstimatedView;
use super::model::Model;
use crate::{Block, Observation};
use kardan_math::num::{Float, StateArchive};

/// A law with an observer. The states of the observer come first.
pub(super) struct ObserverBlock<T> {
    pub law: Box<dyn Block>,
    pub view: EstimatedView,
    /// Continuous or with a sample time, as the law is.
    pub model: Model<T>,
}

impl<T: Float> Block for ObserverBlock<T> {
    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        self.view.archive_state(archive);
        self.law.archive_state(archive);
    }

    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        self.law.command(self.view.estimate(&observation), out)
    }

    fn states(&mut self, observation: Observation<'_>, torques: &[f64], out: &mut [f64]) -> bool {
        let (own, rest) = out.split_at_mut(self.view.states());
        self.view.read(&observation);
        let found = self.model.states(&observation.states[..own.len()], torques, &self.view, own);
        found && (rest.is_empty() || self.law.states(self.view.estimate(&observation), torques, rest))
    }

    fn health(&self) -> Health {
        let health = self.law.health();
        Health { invalid_readings: health.invalid_readings + self.view.invalid_readings, ..health }
    }
}
