//! Multiplier constraints along a run: each step is projected onto them, and the run ends where they become dependent.

use super::{RunLoop, failed};
use crate::halving::halved;
use kardan_math::names::quoted;
use kardan_results::Outcome;

/// Relative to the largest speed, or to this many rad/s or m/s where all are slower, the largest change by the
/// projection of a step onto multiplier constraints where it passed no point at which they are dependent.
const THROWN: f64 = 1e-3;

impl RunLoop {
    /// Projects the end of a step onto the multiplier constraints, and returns whether that changed it. A step has an
    /// error within its tolerance; where speeds change by far more, it passed a point at which the rows are dependent,
    /// and took another branch there.
    pub(super) fn put_on_rows(&mut self) -> Result<bool, Outcome> {
        self.pass_rows()?;
        let r = self.machine.degrees_of_freedom();
        self.trial_state.copy_from_slice(&self.state);
        let moved = self.machine.stay_on_rows(self.time, &mut self.state);
        if !moved || !self.machine.watches_rows() {
            return Ok(moved);
        }
        let speeds = self.state[r..2 * r].iter().zip(&self.trial_state[r..2 * r]);
        let (most, largest) = speeds
            .fold((0.0f64, 0.0f64), |(most, size), (now, then)| (most.max((now - then).abs()), size.max(then.abs())));
        if most <= THROWN.max(100.0 * self.tolerance.relative) * largest.max(THROWN) {
            return Ok(moved);
        }
        // The point at which the rows are nearest to dependence.
        let (mut low, mut high) = (self.solver.previous_time(), self.time);
        let least = |run: &mut Self, at: f64| {
            run.solver.interpolate(at, &mut run.trial_state);
            run.machine.least_pivot(at, &run.trial_state)
        };
        for _ in 0..100 {
            let [first, second] = [1.0, 2.0].map(|part| low + (high - low) * part / 3.0);
            if least(self, first) < least(self, second) { high = second } else { low = first }
        }
        self.observe_until(low, None);
        self.time = high;
        self.solver.interpolate(high, &mut self.state);
        Err(failed(high, self.singular()))
    }

    /// Ends the run where multiplier constraints become dependent within the step: their forces are not determined
    /// there, nor is the further motion.
    fn pass_rows(&mut self) -> Result<(), Outcome> {
        if !self.machine.watches_rows() {
            return Ok(());
        }
        if self.machine.rows_changed_sign(self.time, &self.state) {
            let (low, high) = halved(self.solver.previous_time(), self.time, 0.0, |middle| {
                self.solver.interpolate(middle, &mut self.trial_state);
                self.machine.rows_changed_sign(middle, &self.trial_state)
            });
            self.solver.interpolate(high, &mut self.trial_state);
            if self.machine.rows_depend((high, &self.trial_state), (self.time, &self.state)) {
                self.observe_until(low, None);
                self.time = high;
                self.solver.interpolate(high, &mut self.state);
                return Err(failed(high, self.singular()));
            }
        }
        self.machine.inspect_rows(self.time, &self.state);
        Ok(())
    }

    /// Why a run ends where its multiplier constraints depend on each other.
    fn singular(&self) -> String {
        let names = self.quoted_constraints();
        let what = match self.machine.multiplier_constraints.len() {
            1 => format!("{names} constrains no motion in this position"),
            _ => format!("the constraints {names} become dependent in this position, as at a dead centre"),
        };
        format!(
            "{what}: the constraint forces are not determined there, and the motion can continue in more than one way. Choose a start or lengths that avoid this position, or end the run before it"
        )
    }

    pub(super) fn quoted_constraints(&self) -> String {
        quoted(self.machine.names[self.machine.multiplier_constraints.clone()].iter().map(String::as_str))
    }
}
