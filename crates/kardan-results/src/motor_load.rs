//! The load of motors with limits in a run.

use schemars::JsonSchema;
use serde::Serialize;

use super::numbers::Span;

/// The load of a motor with limits in a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotorLoad {
    /// Name of the motor.
    pub motor: String,
    /// Unit of its torque: `N m`, of a force `N`, of a voltage `V`.
    pub unit: &'static str,
    /// The controller that commands it, if one does.
    pub controller: Option<String>,
    /// Its torque limit, N m; of a force or a voltage that limit.
    pub torque_limit: Option<f64>,
    /// Its rate limit, N m/s.
    pub rate_limit: Option<f64>,
    /// Largest torque command in the rows of the run, N m.
    pub demand: f64,
    /// When it was at its torque limit, s, in order.
    pub at_torque_limit: Vec<Span>,
    /// When it moved at its rate limit, s, in order.
    pub at_rate_limit: Vec<Span>,
}

impl MotorLoad {
    /// How long it was at its torque limit within a window, s.
    ///
    /// ```
    /// use kardan_results::{MotorLoad, Span};
    /// let spans = vec![Span { start: 1.0, end: 1.5 }, Span { start: 3.0, end: 4.0 }];
    /// let motor_load = MotorLoad { at_torque_limit: spans, ..MotorLoad::default() };
    /// assert_eq!(motor_load.seconds_at_limit(0.0, f64::INFINITY), 1.5);
    /// assert_eq!(motor_load.seconds_at_limit(1.25, 3.25), 0.5);
    /// ```
    pub fn seconds_at_limit(&self, from: f64, until: f64) -> f64 {
        length(&self.at_torque_limit, from, until)
    }

    /// How long it moved at its rate limit within a window, s.
    pub fn seconds_at_rate_limit(&self, from: f64, until: f64) -> f64 {
        length(&self.at_rate_limit, from, until)
    }

    /// Its effort as a word: a torque, a force or a voltage.
    pub fn effort(&self) -> &'static str {
        match self.unit {
            "N" => "force",
            "V" => "voltage",
            _ => "torque",
        }
    }

    /// Whether it reached one of its limits.
    pub fn at_limit(&self) -> bool {
        !self.at_torque_limit.is_empty() || !self.at_rate_limit.is_empty()
    }

    /// The message on a motor at its limits, in a run of this length (s): `wg_motor is at its torque limit of 1.3 N m
    /// for 0.42 s of 9 s, first at 1.002 s; its command reaches 23.7 N m`. `None` if it reaches no limit.
    ///
    /// ```
    /// use kardan_results::MotorLoad;
    /// assert_eq!(MotorLoad::default().describe(9.0), None);
    /// ```
    pub fn describe(&self, duration: f64) -> Option<String> {
        let (unit, what) = (self.unit, self.effort());
        let total = |spans: &[Span]| length(spans, 0.0, f64::INFINITY);
        let of = |spans: &[Span]| {
            let first = spans.first().map_or(0.0, |span| span.start);
            format!("for {} s of {duration} s, first at {} s", rounded(total(spans)), rounded(first))
        };
        let torque = self.torque_limit.filter(|_| !self.at_torque_limit.is_empty()).map(|limit| {
            let demand = if self.demand > limit * (1.0 + 1e-3) {
                format!("; its command reaches {} {unit}", rounded(self.demand))
            } else {
                String::new()
            };
            format!("is at its {what} limit of {limit} {unit} {}{demand}", of(&self.at_torque_limit))
        });
        let rate = self
            .rate_limit
            .filter(|_| !self.at_rate_limit.is_empty())
            .map(|limit| format!("moves at its rate limit of {limit} {unit}/s {}", of(&self.at_rate_limit)));
        let parts: Vec<String> = torque.into_iter().chain(rate).collect();
        (!parts.is_empty()).then(|| format!("{} {}", self.motor, parts.join("; it ")))
    }
}

/// The load of a motor of a controller in the scenario of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScenarioMotorLoad {
    /// Name of the variant.
    pub variant: String,
    /// Length of its run, s.
    pub duration: f64,
    /// The load.
    pub motor_load: MotorLoad,
}

/// To four decimals, without zeros at the end.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

fn length(spans: &[Span], from: f64, until: f64) -> f64 {
    spans.iter().map(|span| (span.end.min(until) - span.start.max(from)).max(0.0)).sum()
}

/// The load of a motor with limits.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "MotorStrain")]
pub struct MotorLoadView<'a> {
    /// Name of the motor.
    name: &'a str,
    /// The controller that commands it, if one does.
    controller: Option<&'a str>,
    /// Its torque limit, N m.
    torque_limit_n_m: Option<f64>,
    /// Its rate limit, N m/s.
    rate_limit_n_m_per_s: Option<f64>,
    /// Largest torque command, N m.
    max_requested_torque_n_m: f64,
    /// How long it was at its torque limit, s.
    time_at_torque_limit_s: f64,
    /// How long it moved at its rate limit, s.
    time_at_rate_limit_s: f64,
    /// When it was at its torque limit first, s.
    first_at_torque_limit_s: Option<f64>,
}

impl<'a> MotorLoadView<'a> {
    /// In a run of this length, s.
    pub fn of(motor_load: &'a MotorLoad, length: f64) -> Self {
        Self {
            name: &motor_load.motor,
            controller: motor_load.controller.as_deref(),
            torque_limit_n_m: motor_load.torque_limit,
            rate_limit_n_m_per_s: motor_load.rate_limit,
            max_requested_torque_n_m: motor_load.demand,
            time_at_torque_limit_s: motor_load.seconds_at_limit(0.0, length),
            time_at_rate_limit_s: motor_load.seconds_at_rate_limit(0.0, length),
            first_at_torque_limit_s: motor_load.at_torque_limit.first().map(|span| span.start),
        }
    }
}
