//! A run ends where a formula of a friction, a gear loss or a lock is undefined, or has a driving sign.

use super::{Outcome, RunLoop, failed};
use crate::halving::halved;
use crate::machine::InvalidBound;

/// Torques and losses above minus this value are rounding, N m.
const LEAST: f64 = 1e-9;
/// How far after the last possible step a value is searched, in units in the last place of the time, and at most in
/// parts of it.
const BEYOND: f64 = 16.0 * f64::EPSILON;
const FAR: f64 = 1e-9;
/// The least time that these are parts of, s.
const BEGIN: f64 = 1e-3;

impl RunLoop {
    /// Ends the run at the first time of the last step at which a formula of a friction, a gear loss or a lock is
    /// undefined or negative. Evaluates the end of the step.
    pub(super) fn end_at_failure(&mut self) -> Result<(), Outcome> {
        if !self.machine.has_formulas() {
            return Ok(());
        }
        self.machine.evaluate(self.time, &self.state);
        let Some(mut found) = self.machine.invalid_bound(LEAST) else { return Ok(()) };
        let from = self.solver.previous_time();
        let (low, high) = halved(from, self.time.min(self.solver.time()), 0.0, |middle| {
            self.solver.interpolate(middle, &mut self.trial_state);
            self.machine.evaluate(middle, &self.trial_state);
            let invalid_bound = self.machine.invalid_bound(0.0);
            found = invalid_bound.unwrap_or(found);
            invalid_bound.is_some()
        });
        self.solver.interpolate(high, &mut self.state);
        let cause = self.describe_failure(found, high);
        if low > from {
            // Within a step the states are less accurate than at its end.
            self.shorten(low)?;
        }
        self.observe_until(low, None);
        self.solver.interpolate(low, &mut self.state);
        self.time = high;
        Err(failed(high, cause))
    }

    /// Why the run ends at a time, at the current state.
    fn describe_failure(&mut self, (direction, invalid_bound): (usize, InvalidBound), time: f64) -> String {
        let (name, is_gear_loss) = (self.machine.names[direction].clone(), self.machine.is_gear_loss(direction));
        let unit = if self.machine.unit_of_direction(direction) == "m" { "N" } else { "N m" };
        match invalid_bound {
            InvalidBound::Negative if is_gear_loss => format!(
                "the `loss` of `{name}` becomes negative, and a gear loss cannot drive: limit it to zero or above, such as by max(0 {unit}, ...)"
            ),
            InvalidBound::Negative => format!(
                "the torque of `{name}` becomes negative, and negative friction would drive: limit it to zero or above, such as by max(0 {unit}, ...)"
            ),
            InvalidBound::Undefined => {
                let what = self.machine.not_finite(time, &self.state);
                undefined(&what.unwrap_or_else(|| format!("a formula of `{name}` is not a number")))
            }
        }
    }

    /// The value that is not finite at the current time, or else the one that is undefined just after it, where no step
    /// is possible.
    pub(super) fn nonfinite_signal(&mut self, at: f64) -> Option<String> {
        if let Some(what) = self.machine.not_finite(at, &self.state) {
            return Some(what);
        }
        let whole = at.max(BEGIN);
        let (mut slopes, mut moved) = (self.state.clone(), self.state.clone());
        self.machine.derivative(at, &self.state, &mut slopes);
        let mut later = BEYOND * whole;
        while later <= FAR * whole {
            for ((moved, x), slope) in moved.iter_mut().zip(&self.state).zip(&slopes) {
                *moved = x + later * slope;
            }
            let what = self.machine.not_finite(at + later, &moved);
            if let Some(what) = what.filter(|what| is_undefined(what)) {
                return Some(what);
            }
            later *= 2.0;
        }
        None
    }
}

/// Whether the text names an undefined operation: from finite numbers only an undefined operation makes NaN.
pub(super) fn is_undefined(what: &str) -> bool {
    what.ends_with(" is NaN") && what.contains(", as ")
}

/// The message about an undefined value, with help.
pub(super) fn undefined(what: &str) -> String {
    format!("{what}: it is undefined there. Limit its argument to the domain, such as by `max(0, ...)` or `if(...)`")
}
