//! One step of the integrator, of an exact solution or of rest, up to the next event or the end of the segment.

use super::invalid_bounds::{is_undefined, undefined};
use super::jamming_gears::UNJAM;
use super::{RunLoop, failed};
use crate::dop853::StepError;
use crate::halving::halved;
use crate::linear::LinearSegment;
use crate::machine::SAME;
use kardan_results::{Outcome, Physical, Signal};

/// Steps between two reports of the progress.
const PROGRESS_STEPS: usize = 64;
/// Part of a step by which a repeated step ends after the event it was shortened for.
const BEYOND: f64 = 1e-3;
/// The energy residual that a segment solved at once may have, in tolerances.
const OUT_OF_BALANCE: f64 = 10.0;
/// The longest step where no event ends the present equations, s.
const LONGEST: f64 = 1e9;
/// A speed that no drivetrain reaches, rad/s.
const DIVERGED: f64 = 1e6;

impl RunLoop {
    /// One step of the integrator towards the end of the segment, or up to the next event in it.
    pub(super) fn step(&mut self, progress: &mut dyn FnMut(f64) -> Option<String>) -> Result<(), Outcome> {
        let most = self.tolerance.most_steps;
        if self.solver.counts().accepted as usize > most {
            return Err(failed(
                self.time,
                format!(
                    "more than {most} steps were needed; the model is too stiff for this mode, or oscillates much faster than the run lasts. kardan keeps the results up to this time; `kardan check` names the fastest motion"
                ),
            ));
        }
        let end = self.segment_end.min(self.time + LONGEST);
        self.segment = None;
        self.complete = false;
        self.resting = self.rests();
        if self.resting {
            self.solver.rest(end);
        }
        if self.resting || self.linear && self.solve_segment(end) {
            self.time = end;
            self.pending.boundary = end >= self.segment_end;
            return self.report_progress(progress);
        }
        self.stepped = true;
        self.machine.begin_notes();
        let mut made = self.solver.step(&mut self.machine, end);
        if made.is_err() && !self.referred && self.change_method() {
            self.solver.start(&mut self.machine, self.time, &self.state);
            made = self.solver.step(&mut self.machine, end);
        }
        if let Err(error) = made {
            let before = self.jammed;
            if let Some(direction) = self.resolve_jamming() {
                self.count_jams(direction, before)?;
                return self.report_progress(progress);
            }
            return Err(self.step_failed(error));
        }
        self.resolve()?;
        let leaves_jump = self.end_at_kink()?;
        let length = self.solver.time() - self.solver.previous_time();
        let mut event = if leaves_jump { self.event_behind_jump(length) } else { self.find_event(length) };
        if let Some(at) = event.filter(|_| self.solver.shortens()) {
            self.shorten_step(at)?;
            event = self.search_event(length, true);
        }
        let cut = self.missed_event(event.unwrap_or(self.solver.time()))?;
        let event = if cut.is_some() { None } else { event };
        self.time = cut.or(event).unwrap_or(self.solver.time());
        if self.time >= self.segment_end * (1.0 - SAME) {
            // Times that differ only by rounding are one time.
            self.time = self.segment_end;
        }
        self.pending.event = event.is_some();
        self.pending.boundary = self.time >= self.segment_end;
        if event.is_some() {
            self.located += 1;
            self.chattering.longest = self.chattering.longest.max(length);
        }
        match cut.or(event) {
            Some(at) => self.solver.interpolate(at, &mut self.state),
            None => self.state.copy_from_slice(self.solver.state()),
        }
        // Its end is searched within the step.
        if self.has_diverged() {
            return Err(self.diverged());
        }
        self.check_gear_ambiguity();
        let moved = self.put_on_rows()?;
        if (moved || cut.is_some()) && !self.pending.boundary {
            self.observe_until(self.time, None);
            let next = if cut.is_some() { 0.0 } else { self.solver.next_step() };
            self.restart(self.time);
            self.solver.set_step(next);
        }
        self.end_at_failure()?;
        self.add_row();
        self.machine.gear_losses.lost = None;
        self.report_progress(progress)
    }

    /// Adds a row at the end of a step that has none, where rows may be added.
    fn add_row(&mut self) {
        let next = self.scenario.times.get(self.next_row);
        if self.added_rows > 0 && next.is_some_and(|next| *next > self.time) {
            self.added_rows -= 1;
            self.scenario.times.insert(self.next_row, self.time);
        }
    }

    /// Solves a linear loop up to the end of the segment; false if its numbers exceed those of a drivetrain; the
    /// integrator then locates that time.
    fn solve_segment(&mut self, end: f64) -> bool {
        let span = (self.time, end);
        let tolerance = self.tolerance.relative;
        let Some(segment) = LinearSegment::new(&mut self.machine, &mut self.outputs, span, &self.state, tolerance)
        else {
            return false;
        };
        segment.finish(&mut self.trial_state);
        let r = self.machine.degrees_of_freedom();
        if self.trial_state[r..2 * r].iter().any(|w| w.abs() > DIVERGED) {
            return false;
        }
        // The energy balance shows errors that the states do not.
        let size = self.trial_state.len();
        let [input, loss] = [size - 2, size - 1].map(|k| self.trial_state[k] - self.state[k]);
        let [before, after] =
            [self.machine.energy(self.time, &self.state), self.machine.energy(end, &self.trial_state)];
        let sizes = input.abs() + loss.abs() + before.abs() + after.abs();
        if (input - loss - (after - before)).abs() > OUT_OF_BALANCE * tolerance * sizes {
            return false;
        }
        self.state.copy_from_slice(&self.trial_state);
        self.segments.steps += 1;
        self.segments.evaluations += segment.evaluations as usize;
        self.segment = Some(segment);
        true
    }

    /// Whether the state stays exactly constant until the segment ends: all coordinates are at rest, and no source
    /// changes.
    fn rests(&mut self) -> bool {
        self.solver.rests() && self.machine.is_steady() && {
            self.trial_state.copy_from_slice(&self.state);
            !self.leaves_equilibrium(self.time)
        }
    }

    /// Reports the progress from time to time; an error if the receiver ends the run.
    fn report_progress(&mut self, progress: &mut dyn FnMut(f64) -> Option<String>) -> Result<(), Outcome> {
        self.steps_since_progress += 1;
        if self.steps_since_progress >= PROGRESS_STEPS {
            self.steps_since_progress = 0;
            if let Some(why) = progress(self.time / self.scenario.duration) {
                self.observe_until(self.time, None);
                return Err(failed(self.time, why));
            }
        }
        Ok(())
    }

    /// Repeats the last step so that it ends just after an event found in it: near the end of a step the dense output
    /// is as accurate as the step, in its middle it is not.
    pub(super) fn shorten_step(&mut self, at: f64) -> Result<(), Outcome> {
        let (from, to) = (self.solver.previous_time(), self.solver.time());
        let end = at + BEYOND * (to - from);
        if end < to { self.shorten(end) } else { Ok(()) }
    }

    /// Ends the last step earlier.
    pub(super) fn shorten(&mut self, end: f64) -> Result<(), Outcome> {
        let shortened = self.solver.shorten(&mut self.machine, end, &mut self.trial_state);
        shortened.map_err(|error| self.step_failed(error))
    }

    /// Changes between the method and the reference; false where there is none beside it.
    pub(super) fn change_method(&mut self) -> bool {
        let Some(reference_solver) = &mut self.reference else { return false };
        std::mem::swap(&mut self.solver, reference_solver);
        self.solver.go_on_counting(reference_solver.counts());
        self.referred = !self.referred;
        true
    }

    pub(super) fn restart(&mut self, time: f64) {
        self.solver.start(&mut self.machine, time, &self.state);
        // Which has evaluated the machine there.
        self.event_samples.take(0, time, &mut self.machine);
    }

    /// Whether a speed exceeds that of any drivetrain.
    fn has_diverged(&self) -> bool {
        let r = self.machine.degrees_of_freedom();
        self.state[r..2 * r].iter().any(|w| w.abs() > DIVERGED)
    }

    /// Ends the run where a speed exceeded that in the last step.
    fn diverged(&mut self) -> Outcome {
        let (low, high) = halved(self.solver.previous_time(), self.time, 0.0, |middle| {
            self.solver.interpolate(middle, &mut self.state);
            self.has_diverged()
        });
        self.observe_until(low, None);
        self.solver.interpolate(high, &mut self.state);
        self.machine.evaluate(high, &self.state);
        self.time = high;
        let what = if self.machine.has_laws() { "the loop diverges" } else { "the motion grows without bound" };
        let mut cause = format!("{what}: {}", self.fastest());
        if self.machine.watches_rows() {
            let rows = self.quoted_constraints();
            cause += &format!("; {rows} may have no solution beyond this position, as where a rod is too short");
        }
        failed(high, cause)
    }

    /// Which coordinate is faster than any drivetrain.
    fn fastest(&self) -> String {
        let speeds = &self.machine.work.kinematics.speeds;
        let fastest = (0..speeds.len()).max_by(|&a, &b| speeds[a].abs().total_cmp(&speeds[b].abs()));
        let is_speed = |s: &&Signal| matches!(s.physical, Physical::Speed | Physical::Velocity | Physical::Current);
        let signal = fastest.and_then(|k| self.outputs.signals.iter().filter(is_speed).nth(k));
        signal.map_or_else(String::new, |s| format!("{} exceeds {DIVERGED:e} {}", s.name, s.physical.unit()))
    }

    pub(super) fn step_failed(&mut self, error: StepError) -> Outcome {
        let at = self.solver.time();
        self.state.copy_from_slice(self.solver.state());
        let [diverges, or_diverges] = if self.machine.has_laws() {
            ["the loop diverges", "or the loop diverges"]
        } else {
            ["a variable grows without bound", "or a variable changes at an infinite rate, such as sqrt(t) at zero"]
        };
        let what = self.nonfinite_signal(at);
        let text = match (error, what) {
            _ if let Some(direction) = self.machine.gear_losses.lost => format!(
                "`{}` jams: its load drives it, and the loss would grow faster than the torque that causes it, so that no acceleration is consistent (Painlevé). {UNJAM}",
                self.machine.names[direction]
            ),
            (_, Some(what)) if is_undefined(&what) => undefined(&what),
            (StepError::StepTooSmall { step, .. }, _) => format!(
                "the step became too small ({step:.3e} s): a time constant is too short for this mode, {or_diverges}"
            ),
            (StepError::NotFinite { .. }, Some(what)) => format!("{what}: {diverges}, or the inertia becomes singular"),
            (StepError::NotFinite { .. }, None) => format!(
                "within the next step, however short, the equations have no finite value: {diverges}, a function is \
                 undefined there, such as a square root of a negative number, or the inertia becomes singular"
            ),
        };
        failed(at, text)
    }
}
