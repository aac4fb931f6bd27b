//! The trade-off of a design: interaction against torque, rate, bandwidth and sensors.

/// Designs beside the one of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Exploration {
    /// What the ordinate of the picture is: `driver.tau after a step of ref_rk by 0.4 rad`.
    pub interaction: String,
    /// Its unit.
    pub unit: String,
    /// All designs that were found; that of the file first.
    pub designs: Vec<Alternative>,
    /// Combinations for which there is no stable design.
    pub failed: usize,
    /// What more sensors would bring, the best first: the sensor, and the design with it.
    pub sensors: Vec<(String, Alternative)>,
    /// What to take from it, one sentence each.
    pub advice: Vec<String>,
}

/// One design.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Alternative {
    /// s
    pub sample_time: f64,
    /// s
    pub delay: f64,
    /// Factor of the bandwidths of the file.
    pub bandwidth: f64,
    /// Factor of acceptable rates of torques.
    pub effort: f64,
    /// What is measured: `wg_encoder.phi, bar.tau`; `all angles and speeds` without an observer.
    pub sensors: String,
    /// Largest size of the interaction of [`Exploration::interaction`] in the linear loop.
    pub interaction: f64,
    /// Largest torque that steps ask of a motor, over its limit (or N m, where no motor has one).
    pub torque: f64,
    /// Root mean square of what the sensors' rounding makes of the torques, over the limits (or N m), the largest.
    pub noise: f64,
    /// Spectral radius per sample time.
    pub spectral_radius: f64,
    /// Whether no other design with the same sensors, at no higher rate and no smaller bandwidth, is better in both interaction
    /// and torque.
    pub best: bool,
}
