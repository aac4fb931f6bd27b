//! The integrator of a run: one of the methods, on the machine.

use super::dop853::{Counts, Dop853, StepError};
use super::machine::{Machine, Prospect};
use super::radau::{Descriptor, Equations, Radau};
use super::rounding::Rounding;
use super::taylor::Taylor;
use kardan_math::num::StateArchive;
use kardan_results::IntegrationMethod;

/// A method with its memory.
pub(super) enum Integrator {
    Dop853(Box<Dop853>),
    Taylor(Box<Taylor>),
    Radau(Box<Radau>),
}

impl Equations for Machine {
    fn rates(&mut self, time: f64, state: &[f64], out: &mut [f64]) {
        self.derivative(time, state, out);
    }

    fn linearise(&mut self, time: f64, state: &[f64], out: &mut Descriptor) {
        self.find_descriptor(time, state, out);
    }
}

/// The same expression of each method's solver.
macro_rules! each {
    ($self:ident, $solver:ident => $expression:expr) => {
        match $self {
            Self::Dop853($solver) => $expression,
            Self::Taylor($solver) => $expression,
            Self::Radau($solver) => $expression,
        }
    };
}

impl Integrator {
    /// Its method; `exact` where it was not needed.
    pub(super) fn method(&self, exact: bool) -> IntegrationMethod {
        match self {
            _ if exact => IntegrationMethod::Exponential,
            Self::Dop853(_) => IntegrationMethod::Dop853,
            Self::Taylor(_) => IntegrationMethod::Taylor,
            Self::Radau(_) => IntegrationMethod::Radau,
        }
    }

    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        each!(self, solver => solver.archive_state(archive))
    }

    /// Starts at a state, which the machine has then evaluated.
    pub(super) fn start(&mut self, machine: &mut Machine, time: f64, state: &[f64]) {
        match self {
            Self::Dop853(solver) => {
                solver.start(time, state, &mut |t, x: &[f64], dx: &mut [f64]| machine.derivative(t, x, dx))
            }
            Self::Taylor(solver) => solver.start(time, state, |k, x| machine.expand(time, k, x)),
            Self::Radau(solver) => solver.start(time, state, machine),
        }
    }

    /// One step, at most to a time; the states within it are available then.
    pub(super) fn step(&mut self, machine: &mut Machine, until: f64) -> Result<(), StepError> {
        match self {
            Self::Dop853(solver) => {
                let mut rates = |t: f64, x: &[f64], dx: &mut [f64]| machine.derivative(t, x, dx);
                solver.step(until, &mut rates)?;
                solver.prepare_dense(&mut rates);
                Ok(())
            }
            Self::Taylor(solver) => {
                let time = solver.time;
                solver.step(until, machine.evaluated, |k, x| machine.expand(time, k, x))?;
                solver.sample_interior(|t, x, dx| machine.derivative(t, x, dx))?;
                solver.check_rounding(|t, x, dx| machine.derivative(t, x, dx));
                Ok(())
            }
            Self::Radau(solver) => solver.step(until, machine),
        }
    }

    /// Ends the last step earlier: a series is evaluated there, others, whose states within a step are less accurate than
    /// at its end, repeat it. `scratch` is memory for a state.
    pub(super) fn shorten(&mut self, machine: &mut Machine, end: f64, scratch: &mut [f64]) -> Result<(), StepError> {
        if let Self::Taylor(solver) = self {
            solver.end_at(end);
            return Ok(());
        }
        let (from, next) = (self.previous_time(), self.next_step());
        scratch.copy_from_slice(self.previous_state());
        self.start(machine, from, scratch);
        self.set_step(end - from);
        self.step(machine, end)?;
        self.set_step(next);
        Ok(())
    }

    /// The known validity of the machine's modes within the last step.
    pub(super) fn prospect(&self, machine: &mut Machine) -> Prospect {
        match self {
            Self::Dop853(_) | Self::Radau(_) => Prospect::Unknown,
            Self::Taylor(solver) => machine.prospect(solver.time - solver.previous_time, solver.order),
        }
    }

    /// Order and begin of the series of the last step; where `complete`, of all values.
    pub(super) fn series(&self, machine: &mut Machine, complete: bool) -> Option<(usize, f64)> {
        let Self::Taylor(solver) = self else { return None };
        if complete {
            machine.complete_series(solver.order, &solver.coefficients);
        }
        Some((solver.order, solver.previous_time))
    }

    /// Whether a step is repeated up to an event in it.
    pub(super) fn shortens(&self) -> bool {
        matches!(self, Self::Dop853(_))
    }

    /// The state at a time within the last step.
    pub(super) fn interpolate(&self, time: f64, out: &mut [f64]) {
        each!(self, solver => solver.interpolate(time, out))
    }

    pub(super) fn rests(&self) -> bool {
        each!(self, solver => solver.rests())
    }

    pub(super) fn rest(&mut self, until: f64) {
        each!(self, solver => solver.rest(until))
    }

    /// The length that the next step is to have, where the method does not choose it by itself.
    pub(super) fn set_step(&mut self, step: f64) {
        match self {
            Self::Dop853(solver) => solver.next = step,
            Self::Radau(solver) => solver.next = step,
            Self::Taylor(_) => {}
        }
    }

    pub(super) fn next_step(&self) -> f64 {
        each!(self, solver => solver.next)
    }

    pub(super) fn previous_time(&self) -> f64 {
        each!(self, solver => solver.previous_time)
    }

    pub(super) fn time(&self) -> f64 {
        each!(self, solver => solver.time)
    }

    pub(super) fn previous_state(&self) -> &[f64] {
        each!(self, solver => &solver.previous)
    }

    pub(super) fn state(&self) -> &[f64] {
        each!(self, solver => &solver.state)
    }

    /// Continues the counts of another one.
    pub(super) fn go_on_counting(&mut self, counts: Counts) {
        each!(self, solver => solver.counts = counts)
    }

    pub(super) fn counts(&self) -> Counts {
        each!(self, solver => solver.counts)
    }

    /// The rounding errors of steps, as far as they were measured.
    pub(super) fn rounding(&self) -> &Rounding {
        each!(self, solver => &solver.rounding)
    }
}
