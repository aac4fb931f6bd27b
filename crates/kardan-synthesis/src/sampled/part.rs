//! Parts of a sampled loop: a law with its clock, and the delays of its commands.

use std::sync::Arc;

use super::{LoopPlant, SlowSensor};
use crate::{Clock, ExportedSignal, Law, LinearLaw};
use kardan_analysis::OutputSignal;
use kardan_math::num::{LastDigits, Matrix, Rational};
use kardan_results::signal_name::SignalName;

/// An additional delay of the commands of a sampled law to one of its motors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wire {
    /// Which of the law's inputs.
    pub input: usize,
    /// Their delay in addition to that of the law's clock, s.
    pub delay: f64,
}

/// A signal that another part of a loop exports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Teller {
    /// Which part.
    pub part: usize,
    /// Which of its signals.
    pub exported: ExportedSignal,
}

/// A law in a sampled loop, or a task of blocks, whose outputs take the place of commands.
#[derive(Debug, Clone)]
pub struct SampledPart {
    /// Its linear part: between samples if it has a clock.
    pub linear: LinearLaw,
    /// The same before rounding, where that is known.
    pub exact: Option<Arc<LinearLaw<Rational>>>,
    /// By how much rounding may have moved its numbers where that is more than their last digits.
    pub rounding: Option<Arc<LinearLaw>>,
    /// When it runs; `None`: in continuous time.
    pub clock: Option<Clock>,
    /// Numbers of the inputs that it commands, among those of the plant.
    pub inputs: Vec<usize>,
    /// The factor of each of its motors on its command, 1 for the unchanged loop; the law does not know it.
    pub gains: Vec<f64>,
    /// An additional delay of the commands to one of the motors; the law does not know it.
    pub wire: Option<Wire>,
    /// Which of its readings come from sensors with a sample time of their own. All others are new whenever it computes.
    pub slow: Vec<(usize, SlowSensor)>,
    /// Which of its references other parts of the loop export; all others come from the scenario.
    pub reads: Vec<(usize, Teller)>,
}

impl SampledPart {
    /// A law as it runs, in the loop of that plant.
    ///
    /// # Panics
    /// If it names an input that is not there.
    pub fn of(law: &dyn Law, plant: &LoopPlant) -> Self {
        let exact = if law.clock().is_none() { law.linear_exact() } else { None };
        Self { exact, ..Self::with(law, plant, law.clock(), law.linear()) }
    }

    /// The same with its linear part at rest at a reduced position, rad; `None` if a number overflows.
    ///
    /// # Panics
    /// As [`Self::of`].
    pub fn at_position(law: &dyn Law, plant: &LoopPlant, position: &[f64]) -> Option<Self> {
        Some(Self::with(law, plant, law.clock(), law.linear_at(position, law.clock())?))
    }

    /// The same with another clock; `None` if the law cannot have that one.
    ///
    /// # Panics
    /// As [`Self::of`].
    pub fn at(law: &dyn Law, plant: &LoopPlant, clock: Option<Clock>) -> Option<Self> {
        Some(match clock {
            Some(clock) => Self::with(law, plant, Some(clock), law.linear_sampled(clock)?),
            None => Self { exact: law.linear_exact(), ..Self::with(law, plant, None, law.linear()) },
        })
    }

    fn with(law: &dyn Law, plant: &LoopPlant, clock: Option<Clock>, linear: LinearLaw) -> Self {
        let number =
            |name: &String| plant.inputs.iter().position(|input| input == name).expect("a law commands inputs");
        let inputs = law.inputs().iter().map(number).collect();
        let (linear, rounding) = match law.linear_rounding() {
            rounding if is_off(&linear) => (remove_states(&linear), rounding.map(|of| Arc::new(remove_states(&of)))),
            rounding => (linear, rounding),
        };
        Self { rounding, ..Self::reading(law.sensors(), plant, clock, (linear, inputs)) }
    }

    /// A part that reads these sensors.
    pub(super) fn reading(
        sensors: &[OutputSignal],
        plant: &LoopPlant,
        clock: Option<Clock>,
        (linear, inputs): (LinearLaw, Vec<usize>),
    ) -> Self {
        let slow = sensors.iter().enumerate().filter_map(|(k, signal)| {
            let head = SignalName::new(&signal.name).element;
            Some((k, plant.slow_sensors.iter().find(|sensor| sensor.name == head)?.clone()))
        });
        // Readings that nothing depends on are skipped.
        let read =
            |k: usize| [&linear.errors, &linear.on_errors].iter().any(|of| (0..of.rows()).any(|i| of[(i, k)] != 0.0));
        let slow = slow.filter(|(k, _)| *k >= linear.on_errors.columns() || read(*k));
        // In continuous time sensors are ideal.
        let slow = if clock.is_some() { slow.collect() } else { Vec::new() };
        let (exact, rounding, gains) = (None, None, vec![1.0; inputs.len()]);
        Self { linear, exact, rounding, clock, gains, inputs, wire: None, slow, reads: Vec::new() }
    }

    /// Its linear part before rounding, as far as that is known; else the fractions that its numbers are.
    pub fn exactly(&self) -> LinearLaw<Rational> {
        // Of a law that is off the states are left out.
        let exact_design = self.exact.as_ref().filter(|exact| exact.states.rows() == self.linear.states.rows());
        exact_design.map_or_else(|| self.direct().exact(), |exact| (**exact).clone())
    }

    /// Whether a number of it is rounded.
    pub fn is_rounded(&self) -> bool {
        self.rounding.is_some() || self.exactly().is_rounded()
    }

    /// The same with other numbers in place of rounded ones, within their rounding.
    #[must_use]
    pub fn near(&self, digits: &mut LastDigits) -> Self {
        let rounding = self.rounding.as_deref();
        let exact = Some(Arc::new(self.exactly().near(rounding, digits)));
        Self { linear: self.linear.exact().near(rounding, digits).to_f64(), exact, ..self.clone() }
    }

    /// The same law in continuous time, with the same motions along which nothing changes that it reads, commands or stores.
    #[must_use]
    pub fn without_clock(&self) -> Self {
        let all_readings = Self { slow: Vec::new(), wire: None, ..self.clone() };
        let (mut linear, mut exact) = (all_readings.linear.clone(), all_readings.exactly());
        if self.clock.is_some() && !linear.flowing {
            // A state that stays from sample to sample has no rate.
            linear.states = linear.states.minus(&Matrix::identity(linear.states.rows()));
            exact.states = exact.states.minus(&Matrix::identity(exact.states.rows()));
        }
        Self { linear, exact: Some(Arc::new(exact)), clock: None, ..all_readings }
    }

    /// Whether commands follow from each other in a circle at every instant, which only clocks open.
    pub fn are_in_circle(parts: &[Self]) -> bool {
        let read = |k: usize| {
            parts[k].reads.iter().filter(|(_, teller)| matches!(teller.exported, ExportedSignal::Command(_)))
        };
        let mut open: Vec<usize> = (0..parts.len()).collect();
        loop {
            let waits = |k: &usize| read(*k).any(|(_, teller)| open.contains(&teller.part));
            let rest: Vec<usize> = open.iter().copied().filter(waits).collect();
            if rest.len() == open.len() {
                return !open.is_empty();
            }
            open = rest;
        }
    }

    /// Whether it is a task of blocks.
    pub fn is_task(&self) -> bool {
        self.inputs.is_empty()
    }

    /// The number of its commands, or outputs.
    pub(super) fn outputs(&self) -> usize {
        self.linear.on_states.rows()
    }

    /// The linear part without the inputs of slow sensors: these come from their held readings.
    pub(super) fn direct(&self) -> LinearLaw {
        let mut out = self.linear.clone();
        for (reading, sensor) in &self.slow {
            // A speed that is a difference of angles is in the linear part the speed itself.
            let [angles, speeds] = sensor.true_rows();
            for (gain, of, row) in [
                (&self.linear.on_errors, &mut out.on_angles, angles),
                (&self.linear.on_errors, &mut out.on_speeds, speeds),
                (&self.linear.errors, &mut out.angles, angles),
                (&self.linear.errors, &mut out.speeds, speeds),
            ] {
                for i in 0..of.rows() {
                    row.iter().for_each(|(shaft, x)| of[(i, *shaft)] -= gain[(i, *reading)] * x);
                }
            }
        }
        out
    }
}

/// Whether no command of a law depends on any input, such as of a program that a mode switches off at rest.
fn is_off(law: &LinearLaw) -> bool {
    let commands =
        [&law.on_states, &law.on_angles, &law.on_speeds, &law.on_disturbances, &law.on_references, &law.on_errors];
    law.states.rows() > 0 && commands.iter().all(|of| of.as_slice().iter().all(|x| *x == 0.0))
}

/// A law without its states, which act on nothing.
fn remove_states(law: &LinearLaw) -> LinearLaw {
    let [commands, sensors] =
        [law.on_errors.rows(), law.on_errors.columns()].map(|count| (0..count).collect::<Vec<usize>>());
    law.part([&commands, &[], &sensors])
}
