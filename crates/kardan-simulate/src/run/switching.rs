//! Switching at an event: the contact states after it, the messages about impacts and shared friction, and the end of a run whose events
//! accumulate or whose constraints contradict each other.

use super::{Chattering, RunLoop, failed};
use kardan_math::names::quoted;
use kardan_results::{Event, Outcome};

/// Located events within one step of the integrator that count as chatter: a smooth motion has a few for each direction.
const MOST_CHATTERING: usize = 2000;
/// Close events after which a run ends: a bouncing contact has fewer.
const MOST_ZENO_EVENTS: usize = 200_000;
/// The largest distance of close events, as a part of the duration or of a second.
const CLOSE: f64 = 1e-7;
/// Successive events without time between them after which restitution is off until time passes.
const KNOCKS: usize = 100;
/// Events closer than this, relative to the time, have no time between them.
const AT_ONCE: f64 = 64.0 * f64::EPSILON;

impl RunLoop {
    /// Handles the event that the last step ended at.
    pub(super) fn happen(&mut self) -> Result<(), Outcome> {
        let at = self.time;
        let at_once = at - self.chattering.last <= AT_ONCE * at;
        self.zeno_events =
            if at - self.chattering.last <= CLOSE * self.scenario.duration.min(1.0) { self.zeno_events + 1 } else { 0 };
        // A contact with repeated impacts (Zeno behaviour) is kept closed.
        self.chattering.at_once = if at_once { self.chattering.at_once + 1 } else { 0 };
        self.machine.unilaterals.rebounds = self.chattering.at_once < KNOCKS;
        let crossing = std::mem::take(&mut self.reversed);
        self.machine.remember_commands(at, &mut self.state);
        self.select_modes(at, &crossing)?;
        if self.machine.unilaterals.struck && !at_once {
            // Rebounds become smaller, and end; repeated impacts take no time.
            self.chattering = Chattering { since: at, ..Chattering::default() };
        }
        let Chattering { since, events, longest, last, .. } = &mut self.chattering;
        *last = at;
        *events += 1;
        if at - *since > *longest {
            (*since, *events, *longest) = (at, 0, 0.0);
        }
        let (since, events) = (*since, *events);
        if events > MOST_CHATTERING {
            let apart = at - since;
            let cause = format!(
                "more than {MOST_CHATTERING} events within {apart:.1e} s, less than a step of the smooth motion"
            );
            return Err(failed(at, format!("{cause}: {}", self.last_events(since, &crossing))));
        }
        if self.zeno_events > MOST_ZENO_EVENTS {
            let cause = format!("more than {MOST_ZENO_EVENTS} events follow each other closely (Zeno behaviour)");
            return Err(failed(at, format!("{cause}: {}", self.last_events(since, &crossing))));
        }
        self.reversed = crossing;
        if !self.pending.boundary {
            self.restart(at);
        }
        Ok(())
    }

    /// The last events since a time, as text; where there are none, the directions that left their mode and returned to
    /// it.
    fn last_events(&self, since: f64, crossing: &[usize]) -> String {
        let own = self.events.iter().rev().take_while(|event| event.time >= since);
        let what: Vec<&str> = own.take(6).map(|event| event.description.as_str()).collect();
        if !what.is_empty() {
            return format!("the last events: {}", what.join("; "));
        }
        let involved = if crossing.is_empty() { &self.machine.holding[..] } else { crossing };
        let set_valued = &self.machine.names[..self.machine.modes.len()];
        let mut names: Vec<&str> = involved.iter().filter_map(|k| set_valued.get(*k)).map(String::as_str).collect();
        names.sort_unstable();
        names.dedup();
        match names.is_empty() {
            true => "a motor or a sticking contact repeatedly reaches its limit and leaves it".into(),
            false => {
                format!("the contact state of {} switches repeatedly at its limit, to the last digits", quoted(names))
            }
        }
    }

    pub(super) fn select_modes(&mut self, time: f64, crossing: &[usize]) -> Result<(), Outcome> {
        let happened = self.machine.select_modes(time, &mut self.state, crossing, false);
        self.events.extend(happened.into_iter().map(|what| Event { time, description: what }));
        self.note_shared_friction();
        self.note_blows();
        self.contradict()
    }

    /// Ends the run where rigid constraints require two different values of one motion.
    pub(super) fn contradict(&self) -> Result<(), Outcome> {
        let mut names: Vec<&str> = Vec::new();
        for &direction in &self.machine.contradiction {
            let name = self.machine.names[direction].as_str();
            if !names.contains(&name) {
                names.push(name);
            }
        }
        if names.is_empty() {
            return Ok(());
        }
        names.sort_unstable();
        let what = match (&names[..], self.prescribing.is_empty()) {
            ([one], false) => format!(
                "`{one}` constrains a motion that {} prescribes, and contradicts it",
                quoted(self.prescribing.iter().map(String::as_str))
            ),
            ([one], true) => format!("`{one}` constrains a motion that constraints fix already, and contradicts them"),
            _ => format!("{} constrain one motion rigidly, and contradict each other", quoted(names)),
        };
        let cause =
            format!("{what}: give a stop `stiffness`, replace a lock by a clutch, or release one of them before");
        Err(failed(self.time, cause))
    }

    /// Notes which gears passed an impact, which contacts shared one, and which did not rebound.
    pub(super) fn note_blows(&mut self) {
        let [shared, dulled] = self.machine.take_shared().map(|list| {
            let mut names: Vec<&str> = list.iter().map(|k| self.machine.names[*k].as_str()).collect();
            names.dedup();
            (list.len(), quoted(names))
        });
        if shared.0 > 0 {
            self.note_once(format!(
                "At an impact the rigid contacts {} act together: each returns its `restitution` of its compression impulse (Poisson's law). Rigid bodies do \
                 not determine how contacts share an impulse; where that matters, give them `stiffness`.",
                shared.1
            ));
        }
        if dulled.0 > 0 {
            self.note_once(format!(
                "Impacts of {} accumulate at one instant (Zeno behaviour): kardan computed the last ones without restitution, which dissipates their remaining energy. \
                 Give one of the contacts `stiffness`, or separate them by a gap.",
                dulled.1
            ));
        }
        for direction in std::mem::take(&mut self.machine.unilaterals.passed) {
            self.note_once(format!(
                "A rigid impact passed through the gear `{}` without gear loss; kardan applies no loss to impacts even where the gear is self-locking. Where that matters, \
                 let a spring take the impact (`stiffness` of a stop, a spring_damper beside a lock or clutch): the gear then carries it as a load.",
                self.machine.names[direction]
            ));
        }
    }

    fn note_once(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    pub(super) fn note_shared_friction(&mut self) {
        let shared = self.machine.shared_friction();
        if !shared.is_empty() {
            let names: Vec<String> = shared.iter().map(|&k| format!("`{}`", self.machine.names[k])).collect();
            let all_friction = shared.iter().all(|&k| self.machine.is_friction(k));
            let [together, what] = if all_friction { ["stick", "friction torque"] } else { ["act", "torque"] };
            let shown = match (!self.machine.gear_losses.is_empty() || !self.machine.shares_by_size(), all_friction) {
                (true, _) => "one that satisfies all limits",
                (false, true) => "the one with the smallest torques relative to each Coulomb torque",
                (false, false) => "the one with the smallest torques relative to each torque limit",
            };
            self.note_once(format!(
                "While {} {together} together, the split of the {what} between them is not unique (nor are constraint torques between \
                 them); shown is {shown}.",
                names.join(", "),
            ));
        }
    }
}
