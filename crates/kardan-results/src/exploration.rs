//! The trade-off of a design: interaction against torque, rate, bandwidth and sensors.

use schemars::JsonSchema;
use serde::Serialize;

/// Alternatives to the design of the file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Exploration {
    /// The ordinate of the diagram: `driver.tau after a step of ref_rk by 0.4 rad`.
    pub interaction: String,
    /// Its unit.
    pub unit: String,
    /// Whether torques and noise are parts of the motors' limits; false: N m, because no motor has one.
    pub relative_to_limits: bool,
    /// Combinations for which there is no stable design.
    pub failed: usize,
    /// Combinations without a verdict: their sample times have no short common period.
    pub not_evaluated: usize,
    /// All designs that were found; that of the file first.
    pub designs: Vec<Alternative>,
    /// Gain by additional sensors, the best first.
    pub sensors: Vec<WithSensor>,
    /// Conclusions, one sentence each.
    pub advice: Vec<String>,
}

impl Exploration {
    /// A torque or noise of a design as text, with a number of decimals: `52 %`, of no limit `0.52 N m`.
    ///
    /// ```
    /// use kardan_results::Exploration;
    /// let mut found = Exploration { relative_to_limits: true, ..Exploration::default() };
    /// assert_eq!(found.amount(0.523, 1), "52.3 %");
    /// found.relative_to_limits = false;
    /// assert_eq!(found.amount(0.523, 1), "5.23e-1 N m");
    /// ```
    pub fn amount(&self, torque: f64, decimals: usize) -> String {
        if self.relative_to_limits { format!("{:.decimals$} %", 100.0 * torque) } else { format!("{torque:.2e} N m") }
    }
}

/// A design with one more sensor.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct WithSensor {
    /// The sensor.
    pub name: String,
    /// The design.
    pub design: Alternative,
}

/// One design.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Alternative {
    /// s
    #[serde(rename = "sample_time_s")]
    pub sample_time: f64,
    /// s
    #[serde(rename = "delay_s")]
    pub delay: f64,
    /// Factor of the bandwidths of the file.
    pub bandwidth: f64,
    /// Factor of acceptable rates of torques.
    pub effort: f64,
    /// Measured signals: `wg_encoder.phi, bar.tau`; `all angles and speeds` without an observer.
    pub sensors: String,
    /// Largest magnitude of the interaction of [`Exploration::interaction`] in the linear loop.
    pub interaction: f64,
    /// Largest torque command of a motor after steps, over its limit, or N m: [`Exploration::relative_to_limits`].
    pub torque: f64,
    /// Largest root mean square torque from the rounding of the sensors, over the limits, or N m.
    pub noise: f64,
    /// Spectral radius per sample time.
    pub spectral_radius: f64,
    /// Whether no other design with the same sensors, at no higher rate and no smaller bandwidth, is better in both interaction
    /// and torque.
    pub best: bool,
}
