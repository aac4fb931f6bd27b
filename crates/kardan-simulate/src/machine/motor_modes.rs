//! Which motors are at a limit.

use super::Machine;
use super::connected_law::ConnectedLaw;
use crate::drive::{Drive, Saturation};
use crate::faults::{MotorFault, MotorFaultKind};
use crate::scenario::SourceTarget;
use kardan_results::MotorLoad;

/// Relative difference of two times within which a located event lies.
const SAME_INSTANT: f64 = 1e-12;

impl Machine {
    /// Motors with a stuck torque from this time on keep the torque that they have reached; the lines and functions of
    /// time are still those before it.
    pub fn stick_motors(&mut self, time: f64, state: &[f64]) {
        let sticks =
            |fault: &MotorFault| fault.kind == MotorFaultKind::Stuck && fault.is_active(time) && fault.at == time;
        let begins = |drive: &Drive| drive.faults.iter().any(sticks);
        if !self.drives.iter().any(begins) {
            return;
        }
        self.forces(time, state);
        for (drive, torque) in self.drives.iter_mut().zip(&self.torques).filter(|(drive, _)| begins(drive)) {
            drive.stuck = *torque;
        }
    }

    /// Torque limits of motors whose supply is low from a time on.
    pub(super) fn enter_faults(&mut self, time: f64) {
        for drive in self.drives.iter_mut().filter(|drive| !drive.faults.is_empty()) {
            let low = drive.faults.iter().find(|fault| fault.is_active(time)).map(|fault| fault.kind);
            let voltage_share = if let Some(MotorFaultKind::Undervoltage(part)) = low { part } else { 1.0 };
            drive.limit = drive.full_limit.map(|limit| voltage_share * limit);
            if low != Some(MotorFaultKind::Stuck) {
                drive.stuck = 0.0;
            }
        }
    }

    /// Whether limits of a motor no longer fit their mode at this point.
    pub fn drives_switch(&mut self, time: f64, state: &[f64]) -> bool {
        if self.timed.limits_rest {
            return false;
        }
        self.forces(time, state);
        let switches = self.drives.iter().zip(&self.commands).any(|(drive, command)| drive.switches(*command, state));
        let rates = self.command_rates(time, state);
        let too_fast =
            |(drive, rate): (&Drive, &f64)| drive.free_rate().is_some_and(|limit| rate.abs() > limit * (1.0 + 1e-6));
        switches || self.drives.iter().zip(&rates).any(too_fast)
    }

    /// Whether no motor reaches or leaves its limit until the next sample or breakpoint: commands of those with a limit
    /// are constant.
    pub(super) fn no_limit_moves(&self) -> bool {
        let rests = |(input, drive): (usize, &Drive)| {
            drive.rate.is_none() && (drive.limit.is_none() || self.command_rests(input))
        };
        self.drives.iter().enumerate().all(rests)
    }

    /// Whether commands of motors with a torque limit only have steps, throughout the run.
    pub(super) fn limits_meet_steps(&self) -> bool {
        let is_level = |source: usize| self.profiles[source].is_level();
        let mut drives = self.drives.iter().enumerate();
        drives.all(|(input, drive)| drive.limit.is_none() || self.commands_are(input, is_level))
    }

    /// Whether the command of one motor is constant until the next sample or breakpoint.
    pub(super) fn command_rests(&self, input: usize) -> bool {
        self.commands_are(input, |source| self.lines[source].1 == 0.0)
    }

    /// Whether only laws with a clock, and sources of a kind that follow no function of time, command a motor.
    fn commands_are(&self, input: usize, kind: impl Fn(usize) -> bool) -> bool {
        let is_sampled = |connected: &ConnectedLaw| connected.sampled_runtime().is_some();
        let mut targets = self.targets.iter().enumerate();
        self.laws.iter().all(|connected| is_sampled(connected) || !connected.inputs.contains(&input))
            && targets.all(|(source, target)| {
                *target != SourceTarget::Input(input) || kind(source) && !self.timed.follows(source)
            })
    }

    /// Rates of all commands during the motion, N m/s, by a difference in the direction of the vector field; none where
    /// no motor with a rate limit follows its command.
    fn command_rates(&mut self, time: f64, state: &[f64]) -> Vec<f64> {
        if !self.drives.iter().any(|drive| drive.rate.is_some() && drive.rate_mode == Saturation::Free) {
            return Vec::new();
        }
        let [mut slope, mut moved] = std::mem::take(&mut self.ahead);
        self.derivative(time, state, &mut slope);
        let before = self.commands.clone();
        let step = 1e-7;
        for ((value, x), dx) in moved.iter_mut().zip(state).zip(&slope) {
            *value = x + step * dx;
        }
        self.forces(time + step, &moved);
        self.ahead = [slope, moved];
        self.commands.iter().zip(&before).map(|(after, before)| (after - before) / step).collect()
    }

    /// The load of motors with limits in a run up to a time; `demand` returns the largest torque requested of one.
    pub(crate) fn motor_loads(&self, end: f64, demand: impl Fn(&str) -> f64) -> Vec<MotorLoad> {
        let limited = |(_, drive): &(usize, &Drive)| drive.limit.is_some() || drive.rate.is_some();
        let motor_load = |(k, drive): (usize, &Drive)| {
            let commands = |connected: &&ConnectedLaw| connected.inputs.contains(&k);
            MotorLoad {
                motor: drive.name.clone(),
                unit: drive.unit,
                controller: self.laws.iter().find(commands).map(|connected| connected.law.describe().controller),
                torque_limit: drive.limit,
                rate_limit: drive.rate,
                demand: demand(&drive.name),
                at_torque_limit: drive.at_limit.until(end),
                at_rate_limit: drive.at_rate_limit.until(end),
            }
        };
        self.drives.iter().enumerate().filter(limited).map(motor_load).collect()
    }

    pub(super) fn settle_drives(&mut self, time: f64, state: &mut [f64], everything: bool) {
        self.forces(time, state);
        for k in 0..self.drives.len() {
            let command = self.commands[k];
            let drive = &mut self.drives[k];
            let mode = drive.limit_mode(command);
            if mode != drive.limit_mode {
                let what = if mode == Saturation::Free { "leaves" } else { "reaches" };
                self.happened.push(format!("{} {what} its {} limit", drive.name, drive.effort));
                drive.limit_mode = mode;
            }
            let limited = drive.limited(command);
            if let Some(place) = drive.rate_state {
                if everything {
                    state[place] = 0.0;
                }
                let gap = limited - state[place];
                // A gap that the limiter closes within the resolution of the time counts as zero.
                let instant = SAME_INSTANT * time.abs();
                let small = 1e-12 * (limited.abs() + state[place].abs()) + instant * drive.rate.unwrap_or(0.0);
                drive.rate_mode = Saturation::of(gap, small);
            }
        }
        let rates = self.command_rates(time, state);
        for (drive, rate) in self.drives.iter_mut().zip(&rates) {
            if let Some(limit) = drive.free_rate() {
                drive.rate_mode = Saturation::of(*rate, limit);
            }
        }
        for k in 0..self.drives.len() {
            let resting = self.command_rests(k);
            self.drives[k].note_limits(time, self.commands[k], resting);
        }
    }

    /// Before a restart: a rate limiter that followed its command takes its value as state.
    pub fn remember_commands(&mut self, time: f64, state: &mut [f64]) {
        if self.drives.iter().all(|drive| drive.rate_state.is_none()) {
            return;
        }
        self.forces(time, state);
        for (k, drive) in self.drives.iter().enumerate() {
            if let Some(place) = drive.rate_state
                && drive.rate_mode == Saturation::Free
            {
                state[place] = drive.limited(self.commands[k]);
            }
        }
    }
}
