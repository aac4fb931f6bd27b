//! What sampling, delay, lag and limits leave of a loop.

/// How far a controller's loop is from instability, and what it asks of the motors.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Margins {
    /// Sample time, s; `None`: the controller is designed for continuous time.
    pub sample_time: Option<f64>,
    /// From the reading of the sensors to the change of the torques, s.
    pub delay: f64,
    /// Whether it computes in single precision.
    pub single: bool,
    /// Spectral radius of the exact map of the linear loop over one sample time of this controller (of the shortest one, if it has
    /// none); `None` in continuous time, or if there is no
    /// such map.
    pub spectral_radius: Option<f64>,
    /// Whether the loop as it is, with its sample time, delay and lags, is stable; `None` if its sample times have no short
    /// common period, or the eigenvalue iteration failed.
    pub stable: Option<bool>,
    /// Slowest stable rates, for delays of no, half a and one sample; empty for a law that is designed for one sample time.
    pub rates: Vec<RateLimit>,
    /// Longest delay that the sampled loop tolerates, s; `None` in continuous time or if it is unstable without.
    pub longest_delay: Option<LoopLimit>,
    /// Longest lag of all its motors that the loop tolerates, s; `None` if it is unstable without.
    pub longest_lag: Option<LoopLimit>,
    /// Smallest and largest factor of its torques that the loop tolerates; `None` if it is unstable.
    pub gain_margin: Option<[LoopLimit; 2]>,
    /// What a step of each reference asks of each motor.
    pub peaks: Vec<TorquePeak>,
    /// All this in one paragraph.
    pub verdict: String,
}

/// The slowest rate at which a sampled controller keeps the loop stable.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RateLimit {
    /// Delay as a part of the sample time.
    pub delay: f64,
    /// Hz; zero: any up to one sample a second; `None`: not even a million samples a second suffice.
    pub rate: Option<f64>,
    /// The motion that grows at slower rates.
    pub motion: String,
}

/// Where a loop becomes unstable.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LoopLimit {
    /// The value that it just tolerates; infinite (or 0, downwards) if all that was looked at is tolerated.
    pub value: f64,
    /// The motion that grows beyond.
    pub motion: String,
}

/// What a step of a reference asks of a motor.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TorquePeak {
    /// The reference.
    pub reference: String,
    /// Size of the step, SI.
    pub step: f64,
    /// Its unit.
    pub step_unit: String,
    /// The motor.
    pub input: String,
    /// Largest torque asked of it, N m.
    pub peak: f64,
    /// Its torque limit, N m.
    pub limit: Option<f64>,
}
