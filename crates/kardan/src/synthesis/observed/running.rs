//! Laws behind observers, as they compute in a loop.

use kardan_rt::Health;

use super::estimated_view::EstimatedView;
use super::model::Model;
use crate::num::{Float, Keeper};
use crate::synthesis::{Block, Continuous, Seen};

/// A law behind an observer, at every instant.
pub(super) struct RunningContinuously {
    pub law: Box<dyn Continuous>,
    pub view: EstimatedView,
    pub model: Model<f64>,
}

impl Continuous for RunningContinuously {
    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        self.view.keep(keeper);
        self.law.keep(keeper);
    }

    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) {
        self.law.command(self.view.estimate(&seen), out);
    }

    fn rates(&mut self, seen: Seen<'_>, torques: &[f64], out: &mut [f64]) {
        let (own, rest) = out.split_at_mut(2 * self.view.coordinates.len() + self.view.disturbances.len());
        self.view.read(&seen);
        if !self.model.rates(&seen.states[..own.len()], torques, &self.view, own) {
            own.fill(f64::NAN);
        }
        if !rest.is_empty() {
            self.law.rates(self.view.estimate(&seen), torques, rest);
        }
    }
}

/// A law behind an observer, at a sample time.
pub(super) struct RunningSampled<T> {
    law: Box<dyn Block>,
    view: EstimatedView,
    /// States of the observer.
    own: usize,
    model: Model<T>,
    /// Whether the estimate was kept as it was at the last sample, because it overflowed.
    kept: bool,
}

impl<T> RunningSampled<T> {
    /// With so many states of the observer.
    pub fn new(law: Box<dyn Block>, view: EstimatedView, own: usize, model: Model<T>) -> Self {
        Self { law, view, own, model, kept: false }
    }
}

impl<T: Float> Block for RunningSampled<T> {
    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        self.view.keep(keeper);
        keeper.flag(&mut self.kept);
        self.law.keep(keeper);
    }

    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) {
        self.law.command(self.view.estimate(&seen), out);
    }

    fn next(&mut self, seen: Seen<'_>, torques: &[f64], out: &mut [f64]) {
        let (own, rest) = out.split_at_mut(self.own);
        self.view.read(&seen);
        self.kept = !self.model.next(&seen.states[..self.own], torques, &self.view, own);
        if self.kept {
            own.copy_from_slice(&seen.states[..self.own]);
        }
        self.law.next(self.view.estimate(&seen), torques, rest);
    }

    fn health(&self) -> Health {
        let Health { readings_held, estimate_kept, .. } = self.law.health();
        Health {
            readings_held: readings_held + self.view.held,
            estimate_kept: estimate_kept || self.kept,
            ..self.law.health()
        }
    }
}
