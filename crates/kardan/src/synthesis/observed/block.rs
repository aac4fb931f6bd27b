//! Laws behind observers, as they compute in a loop.

use kardan_rt::Health;

use super::estimated_view::EstimatedView;
use super::model::Model;
use crate::num::{Float, Keeper};
use crate::synthesis::{Block, Seen};

/// A law behind an observer. Of its states those of the observer come first.
pub(super) struct ObserverBlock<T> {
    pub law: Box<dyn Block>,
    pub view: EstimatedView,
    /// Of every instant or of a sample time, as the law is.
    pub model: Model<T>,
}

impl<T: Float> Block for ObserverBlock<T> {
    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        self.view.keep(keeper);
        self.law.keep(keeper);
    }

    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) -> bool {
        self.law.command(self.view.estimate(&seen), out)
    }

    fn states(&mut self, seen: Seen<'_>, torques: &[f64], out: &mut [f64]) -> bool {
        let (own, rest) = out.split_at_mut(self.view.states());
        self.view.read(&seen);
        let found = self.model.states(&seen.states[..own.len()], torques, &self.view, own);
        found && (rest.is_empty() || self.law.states(self.view.estimate(&seen), torques, rest))
    }

    fn health(&self) -> Health {
        let health = self.law.health();
        Health { readings_held: health.readings_held + self.view.held, ..health }
    }
}
