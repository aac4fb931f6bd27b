//! A task as a block of a run: its outputs and next states from what it reads.

use std::sync::Arc;

use kardan_rt::Health;

use crate::{Block, Observation};
use kardan_expr::plan::Plan;
use kardan_math::num::{Float, StateArchive};

use super::task_inputs::{Comes, Ideal};

/// A task at its samples, or at every instant.
pub(super) struct TaskBlock<T> {
    pub(super) plan: Arc<Plan>,
    pub(super) constants: Vec<T>,
    pub(super) numbers: Vec<T>,
    pub(super) comes: Vec<Comes>,
    pub(super) ideal: Vec<Ideal>,
    pub(super) memory: Vec<T>,
    /// The last valid outputs, and the next states.
    pub(super) outputs: Vec<f64>,
    pub(super) next: Vec<f64>,
    /// The last good readings; no numbers before the first.
    pub(super) good: Vec<f64>,
    pub(super) sampled: bool,
    /// Outputs and states of the last sample.
    pub(super) frozen: usize,
    pub(super) bad_readings: usize,
}

impl<T: Float> TaskBlock<T> {
    fn evaluate(&mut self, observation: Observation<'_>) {
        let good = self.good.iter_mut().zip(observation.readings).filter(|(_, reading)| reading.is_finite());
        good.for_each(|(good, reading)| *good = *reading);
        for (place, comes) in self.memory.iter_mut().zip(&self.comes) {
            *place = T::from_f64(match *comes {
                Comes::Angle(k) => observation.angles[k],
                Comes::Speed(k) => observation.speeds[k],
                // At every instant sensors are ideal.
                Comes::Reading(k) | Comes::AsRead(k) if observation.readings.is_empty() => {
                    self.ideal[k].read(&observation)
                }
                Comes::Reading(k) => self.good[k],
                Comes::AsRead(k) => observation.readings[k],
                Comes::Reference(k) => observation.references[k],
                Comes::Time => observation.time,
            });
        }
        let first = self.comes.len();
        T::narrow(observation.states, &mut self.memory[first..]);
        // A value that is not a number is detected where it is used.
        let _ = self.plan.block_of(&self.constants, &self.numbers).evaluate(&mut self.memory);
    }

    fn found(&self, output: usize) -> f64 {
        self.memory[self.plan.place(output)].to_f64()
    }
}

impl<T: Float> Block for TaskBlock<T> {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        self.evaluate(observation);
        if !self.sampled {
            out.iter_mut().enumerate().for_each(|(k, out)| *out = self.found(k));
            return out.iter().all(|x| x.is_finite());
        }
        self.bad_readings = observation.readings.iter().filter(|reading| !reading.is_finite()).count();
        // A state that is not a number keeps its last value, each for itself.
        self.next.copy_from_slice(observation.states);
        self.frozen = 0;
        for k in 0..self.outputs.len() + self.next.len() {
            let new = self.found(k);
            let old = match k.checked_sub(self.outputs.len()) {
                Some(entry) => &mut self.next[entry],
                None => &mut self.outputs[k],
            };
            if new.is_finite() {
                *old = new;
            } else {
                self.frozen += 1;
            }
        }
        out.copy_from_slice(&self.outputs);
        true
    }

    fn states(&mut self, observation: Observation<'_>, _: &[f64], out: &mut [f64]) -> bool {
        if self.sampled {
            out.copy_from_slice(&self.next);
            return true;
        }
        self.evaluate(observation);
        let first = self.outputs.len();
        out.iter_mut().enumerate().for_each(|(k, out)| *out = self.found(first + k));
        out.iter().all(|x| x.is_finite())
    }

    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.numbers(&mut self.outputs);
        archive.numbers(&mut self.good);
        archive.count(&mut self.frozen);
        archive.count(&mut self.bad_readings);
    }

    fn health(&self) -> Health {
        Health { invalid_readings: self.bad_readings, estimate_frozen: self.frozen > 0, ..Health::default() }
    }
}
