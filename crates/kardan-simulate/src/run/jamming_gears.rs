//! Gears that self-lock against the inertia of their load (Painlevé): they jam at once, or their motion is not unique.

use super::{RunLoop, failed};
use crate::halving::halved;
use kardan_results::{Event, Outcome};

/// Help for jamming gears.
pub const UNJAM: &str = "Give it less loss (a larger `efficiency_back`), more inertia before it or less behind it, or let a spring carry the load";
/// Jams after which a run ends, if each is this close to the one before, as a part of the duration or of a second: no
/// chart resolves them.
const JAMS: usize = 200;
const JAMS_APART: f64 = 1e-3;
/// The accuracy of the time at which rates become undefined, relative to the time.
const STUCK: f64 = 256.0 * f64::EPSILON;

impl RunLoop {
    /// Ends the run where a gear jams repeatedly.
    pub(super) fn count_jams(&mut self, direction: usize, before: Option<f64>) -> Result<(), Outcome> {
        let apart = JAMS_APART * self.scenario.duration.min(1.0);
        self.jams = if before.is_some_and(|at| self.time - at <= apart) { self.jams + 1 } else { 0 };
        if self.jams <= JAMS {
            return Ok(());
        }
        let cause = format!(
            "`{}` jams more than {JAMS} times, each within {apart:.0e} s of the time before: whenever its load drives it, it self-locks against the inertia of \
             that load (Painlevé), and then starts again. {UNJAM}",
            self.machine.names[direction]
        );
        Err(failed(self.time, cause))
    }

    /// A gear without a consistent acceleration stops at once, by an impulse that grows with the load that it causes;
    /// returns its direction if there is such a gear at the current time.
    pub(super) fn resolve_jamming(&mut self) -> Option<usize> {
        let direction = self.machine.gear_losses.lost?;
        if self.jammed == Some(self.time) {
            return None;
        }
        self.jammed = Some(self.time);
        // Just after the integrator's time.
        let time = (self.time * (1.0 + STUCK)).min(self.segment_end);
        self.observe_until(time, Some(time));
        let (moved, size) = (self.state.clone(), self.machine.size());
        let before = self.machine.energy(time, &self.state);
        let happened = self.machine.select_modes(time, &mut self.state, &[direction], false);
        let work = self.state[size - 2] - moved[size - 2];
        let lost = before + work - self.machine.energy(time, &self.state);
        if !(lost >= 0.0) {
            self.state = moved;
            return None;
        }
        if lost == 0.0 {
            // No motion was left to stop; if it jams again here, the run cannot continue.
            self.jammed = Some(time);
        }
        if let Some(loss) = self.state.last_mut() {
            *loss += lost;
        }
        let what = format!(
            "{} jams: its load drives it, and its locking torque would exceed the driving torque (Painlevé); the impact dissipates {lost:.6} J",
            self.machine.names[direction]
        );
        self.events.extend([what].into_iter().chain(happened).map(|what| Event { time, description: what }));
        self.note_shared_friction();
        self.machine.gear_losses.lost = None;
        self.time = time;
        self.restart(time);
        Some(direction)
    }

    /// Reports from when on the motion of a gear is not unique, if it is not at the end of the last step and was at
    /// that of the step before.
    pub(super) fn check_gear_ambiguity(&mut self) {
        if self.machine.gear_losses.is_empty() {
            return;
        }
        self.machine.evaluate(self.time, &self.state);
        let doubted = self.machine.gear_losses.ambiguous;
        if let Some(direction) = doubted.filter(|_| doubted != self.doubted) {
            let (low, end) = (self.solver.previous_time(), self.time);
            let mut doubtful = |at: f64| {
                self.solver.interpolate(at, &mut self.trial_state);
                self.machine.evaluate(at, &self.trial_state);
                self.machine.gear_losses.ambiguous == doubted
            };
            let time = if doubtful(low) { low } else { halved(low, end, 0.0, doubtful).1 };
            let what = format!(
                "{}: it self-locks against the inertia of its load, so two motions are possible from here (Painlevé): kardan takes the one in which the first \
                 shaft drives; the other one jams",
                self.machine.names[direction]
            );
            self.events.push(Event { time, description: what });
        }
        self.doubted = doubted;
    }
}
