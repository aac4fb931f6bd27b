//! A motor in the loop: torque limit, then rate limit, then lag.

/// What a motor without lag in its limits does: follow its command, or move at its rate limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rate {
    Follow,
    Rise,
    Fall,
}

/// Where the command stands against the torque limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Limit {
    Inside,
    High,
    Low,
}

/// A motor in the loop: limit, then rate limit, then lag.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    pub(super) limit: Option<f64>,
    pub(super) rate: Option<f64>,
    pub(super) lag: Option<f64>,
    /// Amplitude of its ripple, N m, and periods per turn.
    pub(super) ripple: Option<(f64, f64)>,
    pub(super) limit_mode: Limit,
    pub(super) rate_mode: Rate,
    /// Place of the rate limiter's output in the state.
    pub(super) rate_state: Option<usize>,
    /// Place of the lagged torque in the state.
    pub(super) lag_state: Option<usize>,
}

impl Drive {
    pub(super) fn limited(&self, command: f64) -> f64 {
        match (self.limit, self.limit_mode) {
            (Some(limit), Limit::High) => limit,
            (Some(limit), Limit::Low) => -limit,
            _ => command,
        }
    }

    /// What the rate limiter gives for a command, from its state.
    pub(super) fn after_rate(&self, command: f64, state: &[f64]) -> f64 {
        match (self.rate_mode, self.rate_state) {
            (Rate::Rise | Rate::Fall, Some(place)) => state[place],
            _ => self.limited(command),
        }
    }

    pub(super) fn limit_mode(&self, command: f64) -> Limit {
        match self.limit {
            Some(limit) if command > limit => Limit::High,
            Some(limit) if command < -limit => Limit::Low,
            _ => Limit::Inside,
        }
    }
}
