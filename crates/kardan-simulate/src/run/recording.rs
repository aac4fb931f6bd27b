//! What a run leaves: rows on the time grid, the energy balance, and the result at its end.

use super::RunLoop;
use crate::counts::EncoderReading;
use crate::linear::BLOCK;
use kardan_results::{Effort, Energy, Outcome, Run, Series};

/// The part of the energy exchanged from which on kardan reports a residual: it shows in charts and changes the third
/// digit of values read from them. The tolerances of steps allow far less.
const SHOWS: f64 = 1e-3;

/// A finished (or failed) run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunResult {
    /// Its results, before anything is measured or judged: without a name, parameters, figures, requirements and accuracy.
    pub run: Run,
    /// The readings of counting sensors, where recording was requested ([`Ready::noting`](super::Ready::noting)).
    pub encoder_readings: Vec<EncoderReading>,
    /// Whether samples of laws ended its steps.
    pub sampled: bool,
}

impl RunLoop {
    /// Records all rows and sensor readings before a time; with `last`, those at the end from the final state.
    pub(super) fn observe_until(&mut self, time: f64, last: Option<f64>) {
        let mut is_observed = false;
        loop {
            let row = self.scenario.times.get(self.next_row).copied().unwrap_or(f64::INFINITY);
            let sample = self.outputs.next_sample();
            let at = row.min(sample);
            let pending = match last {
                Some(end) => at <= end,
                None => at < time,
            };
            if !pending {
                return;
            }
            if last.is_none() && self.record_series(row) {
                continue;
            }
            if let Some(segment) = self.segment.as_mut().filter(|segment| segment.covers(at)) {
                let rows = &self.scenario.times[self.next_row..];
                let signals = &mut self.outputs.signals;
                if segment.read_block(rows, time, |k, values| signals[k].values.extend_from_slice(values)) {
                    self.next_row += BLOCK;
                    continue;
                }
                segment.advance(at);
                if segment.read(|k, value| signals[k].values.push(value)) {
                    self.next_row += 1;
                    continue;
                }
                segment.write(&mut self.trial_state);
            } else if last.is_some() {
                self.trial_state.copy_from_slice(&self.state);
            } else if !is_observed {
                self.solver.interpolate(at, &mut self.trial_state);
            }
            if last.is_none() && is_observed && !self.outputs.samples() {
                let rows = &self.scenario.times[self.next_row..];
                let count = rows.iter().take_while(|row| **row < time).count();
                self.outputs.record_again(count);
                self.next_row += count;
                continue;
            }
            if last.is_some() || !is_observed {
                self.outputs.observe(&mut self.machine, at, &self.trial_state);
            }
            // While the state is constant, all rows are the same.
            is_observed = self.resting;
            self.outputs.sample(at);
            if row <= at {
                self.outputs.record();
                self.next_row += 1;
            }
        }
    }

    /// Records a row from the series of the last step, if there are such; false if it must be evaluated.
    fn record_series(&mut self, row: f64) -> bool {
        if self.resting || self.segment.is_some() || !self.outputs.has_series() {
            return false;
        }
        let Some((order, begin)) = self.solver.series(&mut self.machine, !self.complete) else { return false };
        self.complete = true;
        self.outputs.record_series(&self.machine, order, row - begin);
        self.next_row += 1;
        true
    }

    /// The note where the tolerance, relative to the largest value of a coordinate or a speed, is below its rounding
    /// error in a step.
    fn rounding_limit(&self, series: &Series) -> Option<String> {
        let errors = self.state_names.iter().zip(&self.solver.rounding().largest);
        let relative = errors.filter_map(|((name, least), error)| {
            let signal = series.signal(name)?;
            let largest = signal.values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            Some((name, signal.physical.unit(), *error, error / (largest + least)))
        });
        let (name, unit, error, ratio) = relative.max_by(|a, b| a.3.total_cmp(&b.3))?;
        let tolerance = self.tolerance.relative;
        (ratio > tolerance).then(|| {
            format!(
                "A tolerance of {tolerance:e} is below double precision: rounding alone causes errors of up to {error:.1e} {unit} in \
                 {name} per step, as large as a tolerance of {ratio:.1e} allows. kardan shortens no step below that limit."
            )
        })
    }

    /// The energy balance up to the current time.
    fn energy(&mut self) -> Energy {
        self.count_work();
        let size = self.machine.size();
        let stored = self.machine.energy(self.time, &self.state) - self.initial_energy;
        let (input, dissipated) = (self.state[size - 2], self.state[size - 1]);
        let exchanged = self.initial_energy + self.exchanged;
        Energy { input, stored, dissipated, residual: input - stored - dissipated, exchanged }
    }

    /// The message where the energy residual exceeds what the tolerances of the steps allow and what is negligible.
    fn unbalanced(&self, energy: &Energy, steps: usize) -> Option<String> {
        let Energy { residual, exchanged, .. } = *energy;
        // Errors of the work that the steps may have, for any size of it.
        let allowed = self.absolute[self.absolute.len() - 2] * steps as f64;
        // A residual that is not a number is an error.
        (!(residual.abs() <= SHOWS * exchanged + allowed)).then(|| {
            format!(
                "the energy balance does not close: the residual is {residual:.3e} J, of {exchanged:.3e} J exchanged. The results are \
                 wrong from some time on, though every step met its tolerance: search for a speed that jumps or a torque peak, where the \
                 equations are singular (a dead centre, a joint near 90°), and avoid that position; elsewhere a smaller `--tolerance` helps"
            )
        })
    }

    pub(super) fn finish(mut self, outcome: Outcome) -> RunResult {
        let energy = self.energy();
        let counts = self.solver.counts();
        let steps = counts.accepted as usize + self.segments.steps;
        let (outcome, warnings) = match (outcome, self.unbalanced(&energy, steps)) {
            (Outcome::Completed, Some(cause)) => (Outcome::Unbalanced { cause }, Vec::new()),
            // The cause that stopped it takes precedence.
            (outcome, open) => (outcome, open.into_iter().collect()),
        };
        self.notes.extend(self.machine.notes_of_laws());
        let end = match outcome {
            Outcome::Failed { time, .. } => time,
            Outcome::Completed | Outcome::Unbalanced { .. } => self.scenario.duration,
        };
        let encoder_readings = self.machine.encoder_readings();
        let time = self.scenario.times[..self.next_row].to_vec();
        let series = Series { time, signals: std::mem::take(&mut self.outputs.signals) };
        let rounding = self.rounding_limit(&series);
        self.notes.extend(rounding);
        let motor_loads = self.machine.motor_loads(end, |motor| {
            series.largest_torque_demand(motor).unwrap_or_default() // every input has a signal
        });
        self.notes.extend(motor_loads.iter().filter_map(|motor_load| {
            let control = motor_load.controller.as_ref();
            let meanwhile = control.map_or(String::new(), |control| {
                format!(" Meanwhile control `{control}` does not behave as designed.")
            });
            Some(format!("{}.{meanwhile}", motor_load.describe(end)?))
        }));
        let effort = Effort {
            steps,
            rejected: counts.rejected as usize,
            evaluations: counts.evaluations as usize + self.segments.evaluations,
            events: self.located,
            rounding: self.solver.rounding().tolerances,
            method: self.solver.method(self.segments.steps > 0 && !self.stepped),
        };
        let (events, notes) = (self.events, self.notes);
        let run = Run { series, motor_loads, energy, events, outcome, notes, warnings, effort, ..Run::default() };
        RunResult { run, encoder_readings, sampled: self.machine.next_tick().is_finite() }
    }
}
