//! A motor in the loop: torque limit, then rate limit, then lag.

use super::faults::{MotorFault, MotorFaultKind};
use kardan_math::num::StateArchive;
use kardan_math::units::Exact;
use kardan_mechanics::equations::{Domain, Motor};
use kardan_results::Span;

/// A command at its controller's torque limit may miss the motor's torque limit by this part of it: the error of a
/// limit stored in single precision.
const AT_LIMIT: f64 = 1e-6;

/// Whether a limit of a motor acts: on its torque, or on the rate of that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Saturation {
    /// The command is within it.
    #[default]
    Free,
    /// The upper limit acts: the torque is at it, or rises at the rate limit.
    High,
    /// The lower one acts.
    Low,
}

impl Saturation {
    /// That of a value with the same limit both ways.
    pub(super) fn of(value: f64, limit: f64) -> Self {
        match value {
            value if value > limit => Self::High,
            value if value < -limit => Self::Low,
            _ => Self::Free,
        }
    }

    /// +1 at the upper limit, −1 at the lower one, 0 within.
    pub(super) fn sign(self) -> f64 {
        match self {
            Self::Free => 0.0,
            Self::High => 1.0,
            Self::Low => -1.0,
        }
    }
}

/// A motor in the loop: limit, then rate limit, then lag.
#[derive(Debug, Clone, Default)]
pub(super) struct Drive {
    pub(super) name: String,
    /// The name of its effort, a torque, a force or a voltage, and the unit.
    pub(super) effort: &'static str,
    pub(super) unit: &'static str,
    pub(super) limit: Option<f64>,
    /// Its torque limit at full supply, and its faults.
    pub(super) full_limit: Option<f64>,
    pub(super) faults: Vec<MotorFault>,
    /// The stuck torque, zero without such a fault.
    pub(super) stuck: f64,
    pub(super) rate: Option<f64>,
    pub(super) lag: Option<f64>,
    /// Amplitude of its ripple, N m, and periods per turn.
    pub(super) ripple: Option<(f64, f64)>,
    pub(super) limit_mode: Saturation,
    pub(super) rate_mode: Saturation,
    /// Index of the rate limiter's output in the state.
    pub(super) rate_state: Option<usize>,
    /// Index of the lagged torque in the state.
    pub(super) lag_state: Option<usize>,
    /// When it was at its torque limit.
    pub(super) at_limit: Spans,
    /// When it moved at its rate limit.
    pub(super) at_rate_limit: Spans,
}

/// Times during which a condition is true: `(from, until)`, s.
#[derive(Debug, Clone, Default)]
pub(super) struct Spans {
    closed: Vec<(f64, f64)>,
    since: Option<f64>,
}

impl Spans {
    /// Sets whether the condition is true from this time on.
    pub(super) fn now(&mut self, time: f64, active: bool) {
        match (self.since, active) {
            (None, true) => self.since = Some(time),
            (Some(from), false) => {
                self.since = None;
                if time > from {
                    self.closed.push((from, time));
                }
            }
            _ => {}
        }
    }

    /// All of them, the last one up to a time.
    pub(super) fn until(&self, time: f64) -> Vec<Span> {
        let open = self.since.filter(|from| *from < time).map(|from| (from, time));
        self.closed.iter().copied().chain(open).map(|(from, until)| Span { start: from, end: until }).collect()
    }

    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.list(&mut self.closed, (0.0, 0.0), |archive, (from, until)| {
            archive.number(from);
            archive.number(until);
        });
        archive.optional(&mut self.since);
    }
}

impl Drive {
    /// A motor whose rate limiter and lag have these indices in the state, if it has them.
    pub(super) fn new(
        name: String,
        motor: &Motor,
        domain: Domain,
        [rate_state, lag_state]: [Option<usize>; 2],
        faults: Vec<MotorFault>,
    ) -> Self {
        let number = |x: &Option<Exact>| x.as_ref().map(Exact::to_f64);
        Self {
            name,
            effort: domain.effort_word(),
            unit: domain.effort().physical().unit(),
            limit: number(&motor.torque_limit),
            full_limit: number(&motor.torque_limit),
            faults,
            rate: number(&motor.rate_limit),
            lag: number(&motor.lag),
            ripple: motor.ripple.as_ref().map(|ripple| (ripple.torque.to_f64(), ripple.order.to_f64())),
            rate_state,
            lag_state,
            ..Self::default()
        }
    }

    /// Resets to the start of a run.
    pub(super) fn begin_anew(&mut self) {
        (self.limit_mode, self.rate_mode, self.at_limit, self.at_rate_limit) = Default::default();
    }

    /// Its modes, and the state of its limits.
    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        for mode in [&mut self.limit_mode, &mut self.rate_mode] {
            let mut number = *mode as usize;
            archive.count(&mut number);
            *mode = [Saturation::Free, Saturation::High, Saturation::Low][number.min(2)];
        }
        if let Some(limit) = &mut self.limit {
            archive.number(limit);
        }
        archive.number(&mut self.stuck);
        self.at_limit.archive_state(archive);
        self.at_rate_limit.archive_state(archive);
    }

    /// Whether it has a stuck-torque fault during the run.
    pub(super) fn sticks(&self) -> bool {
        self.faults.iter().any(|fault| fault.kind == MotorFaultKind::Stuck)
    }

    /// The torque limit that acts, with its sign.
    fn active_limit(&self) -> Option<f64> {
        let limit = self.limit.filter(|_| self.limit_mode != Saturation::Free)?;
        Some(self.limit_mode.sign() * limit)
    }

    pub(super) fn limited(&self, command: f64) -> f64 {
        self.active_limit().unwrap_or(command)
    }

    /// A command under its torque limit: a factor and an addend.
    pub(super) fn leaves(&self) -> [f64; 2] {
        self.active_limit().map_or([1.0, 0.0], |limit| [0.0, limit])
    }

    /// Whether its torque follows the command, 1, or the state of its rate limiter, 0.
    pub(super) fn follows(&self) -> f64 {
        f64::from(u8::from(self.rate_mode == Saturation::Free))
    }

    /// The rate of its rate limiter's state.
    pub(super) fn limiter_rate(&self) -> f64 {
        self.rate_mode.sign() * self.rate.unwrap_or(0.0)
    }

    /// Its rate limit, while no limit acts.
    pub(super) fn free_rate(&self) -> Option<f64> {
        self.rate.filter(|_| [self.limit_mode, self.rate_mode] == [Saturation::Free; 2])
    }

    /// Whether the command no longer fits the limits that act, at this state.
    pub(super) fn switches(&self, command: f64, state: &[f64]) -> bool {
        let (side, way) = (self.limit_mode.sign(), self.rate_mode.sign());
        let leaves_limit = self.limit.is_some_and(|limit| {
            let slack = 1e-13 * limit;
            if side == 0.0 { command.abs() > limit + slack } else { side * command < limit - slack }
        });
        leaves_limit || self.rate_state.is_some_and(|place| way * self.limited(command) < way * state[place])
    }

    /// Records whether it is at its limits from a time on; `constant`: its command is constant until the next decision,
    /// so a controller may have limited it itself.
    pub(super) fn note_limits(&mut self, time: f64, command: f64, constant: bool) {
        let reaches = |limit: f64| constant && command.abs() >= limit * (1.0 - AT_LIMIT);
        let at = self.limit_mode != Saturation::Free || self.limit.is_some_and(reaches);
        self.at_limit.now(time, at);
        self.at_rate_limit.now(time, self.rate_mode != Saturation::Free);
    }

    pub(super) fn limit_mode(&self, command: f64) -> Saturation {
        self.limit.map_or(Saturation::Free, |limit| Saturation::of(command, limit))
    }
}

#[cfg(test)]
#[path = "../tests/unit/drive.rs"]
mod tests;
