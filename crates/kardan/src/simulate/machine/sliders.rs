//! Frictions that hold a motion without inertia against springs alone (Jenkins elements): they stick or keep their torque.
//!
//! No acceleration decides: while one sticks its torque is that of the springs, while it slips the springs keep their torque. It begins to slip where
//! that torque reaches the friction and grows, and sticks where the motion that it follows turns round.

use super::Machine;
use crate::simulate::friction::Mode;

impl Machine {
    /// The torque that the springs of a slider ask of it at the point last evaluated, N m.
    pub(super) fn slider_torque(&self, slider: usize) -> f64 {
        self.work.more(&self.dynamics, self.places.slider_torques.start + slider)
    }

    /// Whether a slider that sticks leaves at the point last evaluated, and how.
    fn slider_leaves(&self, slider: usize) -> Option<Mode> {
        let direction = self.sliders[slider];
        let torque = self.slider_torque(slider);
        let speed = self.work.more(&self.dynamics, self.places.slider_speeds.start + slider);
        let leaves = self.modes[direction] == Mode::Stick
            && torque.abs() >= self.dynamics.friction_torques()[direction]
            && torque * speed > 0.0;
        leaves.then_some(if torque > 0.0 { Mode::Forward } else { Mode::Backward })
    }

    /// Whether one of them leaves at the point last evaluated.
    pub(super) fn a_slider_leaves(&self) -> bool {
        (0..self.sliders.len()).any(|slider| self.slider_leaves(slider).is_some())
    }

    /// Decides their modes at the point last evaluated; `crossing` are directions whose motion has just turned round. Tells whether one changes.
    pub(super) fn settle_sliders(&mut self, crossing: &[usize], everything: bool) -> bool {
        let mut changed = false;
        for slider in 0..self.sliders.len() {
            let direction = self.sliders[slider];
            let before = self.modes[direction];
            if everything || crossing.contains(&direction) {
                self.modes[direction] = Mode::Stick;
            }
            if let Some(mode) = self.slider_leaves(slider).filter(|_| !crossing.contains(&direction)) {
                self.modes[direction] = mode;
            }
            changed |= self.modes[direction] != before;
        }
        changed
    }

    /// What the sliders that stick have left of their friction, as a part of it, at the point last evaluated.
    pub(super) fn slider_rooms(&self) -> impl Iterator<Item = (usize, f64)> {
        let sticking = self.sliders.iter().enumerate().filter(|(_, k)| self.modes[**k] == Mode::Stick);
        sticking.map(|(slider, &k)| (k, 1.0 - self.slider_torque(slider).abs() / self.dynamics.friction_torques()[k]))
    }
}
