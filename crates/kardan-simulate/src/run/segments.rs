//! Segments of a run, in which no source, sample or fault changes the equations: the actions at the start, at breakpoints of the scenario
//! and at samples.

use super::{Chattering, RunLoop, failed};
use crate::Profile;
use crate::machine::SAME;
use kardan_results::{Event, Outcome, Physical};

impl RunLoop {
    /// Actions at the start.
    pub(super) fn begin(&mut self) -> Result<(), Outcome> {
        self.machine.enter_segment(0.0);
        // For a run that does not continue past this.
        self.initial_energy = self.machine.energy(0.0, &self.state);
        if let Some((direction, beyond)) = self.machine.beyond_stop(self.time, &self.state) {
            let what = format!(
                "`{}` starts {beyond:.6} {} past its rigid stop: choose a start inside the stop",
                self.machine.names[direction],
                self.machine.unit_of_direction(direction),
            );
            return Err(failed(0.0, what));
        }
        self.announce(0.0);
        self.machine.tick(0.0, &self.state);
        let blows = self.machine.select_modes(0.0, &mut self.state, &[], true);
        if self.machine.unilaterals.struck {
            self.events.extend(blows.into_iter().map(|what| Event { time: 0.0, description: what }));
        }
        self.contradict()?;
        self.machine.stay_on_rows(0.0, &mut self.state);
        if self.machine.watches_rows() {
            self.machine.inspect_rows(0.0, &self.state);
        }
        self.note_shared_friction();
        self.note_blows();
        // The energy that an impact dissipated there was present, except for the energy that came in with it.
        let [work, lost] = [2, 1].map(|back| self.state[self.state.len() - back]);
        self.initial_energy = self.machine.energy(0.0, &self.state) + (lost - work);
        self.open_segment();
        Ok(())
    }

    /// Actions at a breakpoint of the scenario or at a sample.
    pub(super) fn cross(&mut self) -> Result<(), Outcome> {
        if let Some((low, high)) = self.guard.discontinuity.take()
            && self.time == low
        {
            self.observe_until(high, None);
            self.time = high;
        }
        let time = self.time;
        self.machine.remember_commands(time, &mut self.state);
        if time >= self.breakpoint {
            self.machine.stick_motors(time, &self.state);
            let failing = self.scenario.faults.mechanics_at(time);
            let before = if failing.is_empty() { 0.0 } else { self.machine.energy(time, &self.state) };
            self.machine.enter_segment(time);
            self.announce(time);
            if !failing.is_empty() {
                self.account_for(&failing.join(", "), time, before);
            }
        }
        if self.tick <= time + SAME * time {
            self.machine.tick(time, &self.state);
        }
        self.select_modes(time, &[])?;
        self.open_segment();
        Ok(())
    }

    /// Energy that springs lose or gain when they fail, without a motion: a loss is dissipated, a gain is work of the
    /// fault.
    fn account_for(&mut self, what: &str, time: f64, before: f64) {
        let (size, gained) = (self.machine.size(), self.machine.energy(time, &self.state) - before);
        let what = if gained > 0.0 {
            self.state[size - 2] += gained;
            format!("{what}: the stored spring energy rises by {gained:.6} J")
        } else {
            self.state[size - 1] -= gained;
            format!("{what}: the springs lose {:.6} J", -gained)
        };
        self.events.push(Event { time, description: what });
    }

    /// Actions at a sample at the end of the run: its row is like all others at samples.
    pub(super) fn sample_at_end(&mut self) -> Result<(), Outcome> {
        let time = self.time;
        if self.machine.next_tick() > time + SAME * time {
            return Ok(());
        }
        self.machine.remember_commands(time, &mut self.state);
        self.machine.tick(time, &self.state);
        self.select_modes(time, &[])
    }

    /// Begins to integrate towards the next breakpoint or sample.
    fn open_segment(&mut self) {
        let time = self.time;
        let profiles = self.machine.profiles.iter().flat_map(Profile::breakpoints);
        let faults = self.scenario.faults.times();
        let later = profiles.chain(faults).filter(|at| *at > time).fold(self.scenario.duration, f64::min);
        // Breakpoints that differ only by rounding are one.
        let timed = self.machine.timed.next(time);
        let later = if timed < later * (1.0 - SAME) { timed } else { later };
        self.breakpoint = if later > time { later } else { f64::INFINITY };
        self.tick = self.machine.next_tick();
        // A sample that coincides with a breakpoint except for rounding uses the equations from there on.
        let sooner = self.tick < self.breakpoint - SAME * self.breakpoint || self.breakpoint.is_infinite();
        self.segment_end = if sooner { self.tick } else { self.breakpoint };
        // Behind one at the end of the run there is nothing to integrate.
        let end = self.scenario.duration * (1.0 - SAME);
        let discontinuity = self.machine.next_discontinuity(time, self.segment_end);
        self.guard.discontinuity = discontinuity.filter(|(_, high)| *high < end);
        if let Some((low, _)) = self.guard.discontinuity {
            self.segment_end = low;
        }
        self.chattering = Chattering { since: time, ..Chattering::default() };
        let step = self.solver.next_step();
        self.shake();
        self.restart(time);
        if self.tick.is_finite() {
            // Between two samples the previous step size continues.
            self.solver.set_step(step);
        }
    }

    /// Perturbs coordinates that move by up to two units in their last place, where that is requested and samples end
    /// the steps. Coordinates at rest are not perturbed.
    fn shake(&mut self) {
        let Some(random) = self.shaken.as_mut().filter(|_| self.tick.is_finite()) else { return };
        let (angles, speeds) = self.state.split_at_mut(self.machine.degrees_of_freedom());
        for (angle, _) in angles.iter_mut().zip(speeds).filter(|(_, speed)| **speed != 0.0) {
            *angle += 4.0 * f64::EPSILON * (random.unit() - 0.5) * *angle;
        }
    }

    /// Records the steps and ramps of the scenario that begin at a time, and the faults that begin or end there.
    fn announce(&mut self, time: f64) {
        let events = self.scenario.faults.events().into_iter().filter(|(at, _)| *at == time);
        self.events.extend(events.map(|(time, what)| Event { time, description: what }));
        for event in self.scenario.events.iter().filter(|event| event.at == time) {
            let source = &self.scenario.sources[event.source];
            let value = match source.physical {
                Physical::Angle => format!("{} rad ({:.6} deg)", event.to, event.to.to_degrees()),
                physical => format!("{} {}", event.to, physical.unit()),
            };
            let what = if event.over > 0.0 {
                format!("{} ramps to {value} over {} s", source.name, event.over)
            } else {
                format!("{} steps to {value}", source.name)
            };
            self.events.push(Event { time, description: what });
        }
        for part in self.machine.timed.reported(time) {
            let value = part.pieces.value(time + SAME * time);
            let what = format!("{} steps to {value} {}", part.name, part.dimension.si());
            self.events.push(Event { time, description: what });
        }
    }
}
