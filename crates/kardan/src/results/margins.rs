//! What sampling, delay, lag and limits leave of a loop.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Pole, StabilityVerdict};

/// How far a controller's loop is from instability, and what it asks of the motors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Margins {
    /// Sample time, s; `None`: the controller is designed for continuous time.
    #[serde(rename = "sample_time_s")]
    pub sample_time: Option<f64>,
    /// From the reading of the sensors to the change of the torques, s.
    #[serde(rename = "delay_s")]
    pub delay: f64,
    /// Whether it computes in single precision.
    pub single: bool,
    /// Spectral radius of the exact map of the linear loop over one sample time of this controller (of the shortest one, if it has
    /// none); `None` in continuous time, or if there is no
    /// such map.
    pub spectral_radius: Option<f64>,
    /// Whether the loop as it is, with its sample time, delay and lags, is stable.
    #[serde(flatten)]
    pub stability: StabilityVerdict,
    /// The same of all motions but those that nobody holds (`free`), which are left out of all limits; `None` if it is not decided, or its
    /// sample times have no short common period, or the eigenvalue iteration failed.
    #[serde(rename = "held_motions_stable")]
    pub stable: Option<bool>,
    /// Slowest stable rates, for delays of no, half a and one sample; empty for a law that is designed for one sample time.
    pub rates: Vec<RateLimit>,
    /// Longest delay that the sampled loop tolerates, s; `None` in continuous time or if it is unstable without.
    #[serde(rename = "longest_delay_s")]
    pub longest_delay: Option<LoopLimit>,
    /// Longest lag of all its motors that the loop tolerates, s; `None` if it is unstable without.
    #[serde(rename = "longest_lag_s")]
    pub longest_lag: Option<LoopLimit>,
    /// Smallest and largest factor of its torques that the loop tolerates; `None` if it is unstable.
    pub gain_margin: Option<[LoopLimit; 2]>,
    /// Shafts that move in motions which nobody holds, which are at zero. They are left out of all limits.
    pub free: Vec<String>,
    /// How many poles at zero (multipliers at one) these motions are.
    pub free_poles: usize,
    /// How it is known that they are at zero.
    pub zero_pole_evidence: ZeroPoleEvidence,
    /// Whether these motions are charges that only count what has flowed, exactly.
    pub only_count: bool,
    /// Poles that are not at zero, and so close to it that 64 bits do not tell: of a loop that is decided over the rationals,
    /// 1/s, as far as rounding shows them. They are left out of all limits.
    #[serde(rename = "next_to_zero_1_s")]
    pub next_to_zero: Vec<f64>,
    /// Whether its stability was decided over the rationals, or by certified bounds; otherwise from eigenvalues, whose rounding is bounded.
    pub proven: bool,
    /// All poles of the loop, where its stability in continuous time was decided over the rationals.
    #[serde(skip)]
    pub poles: Option<Vec<Pole>>,
    /// How fast they grow at the sample time, 1/s; 0 if they stay.
    #[serde(rename = "drift_per_s")]
    pub drift: f64,
    /// How wrong the torque of each motor, and each reading, may be alone; empty where the loop is unstable. With several clocks
    /// only those of the motors of a sampled controller.
    pub channels: Vec<ChannelMargin>,
    /// How wrong all torques may be at once; `None` with one motor.
    pub together: Option<TogetherMargin>,
    /// Whether it is stable, but the torque of a motor may not be wrong by 10 %, or its disk margin is not larger than that.
    pub low_margins: bool,
    /// Of a loop with backlash that is open where it stands: the same with it in contact.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<ContactMargins>,
    /// What a step of each reference asks of each motor.
    pub peaks: Vec<TorquePeak>,
    /// All this in one paragraph.
    pub verdict: String,
}

/// Disk margin of one channel below which small errors of the model are too much: a factor of 1.5, 23°.
pub const LOW_DISK: f64 = 0.4;

impl Margins {
    /// The channel with the lowest disk margin, where that is low.
    pub fn low(&self) -> Option<&ChannelMargin> {
        let least = self.channels.iter().min_by(|a, b| a.disk.total_cmp(&b.disk));
        least.filter(|one| self.low_margins || one.disk < LOW_DISK)
    }
}

/// How far a loop is from instability with backlash in contact.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ContactMargins {
    /// Elements whose backlash is in contact.
    pub closed: Vec<String>,
    /// Those whose backlash is open.
    pub open: Vec<String>,
    /// `either` flank where both make the same loop, else `lower` (the first shaft behind the second) or `upper`.
    pub flank: String,
    /// Whether the loop is stable; `None` where that is not known.
    pub stable: Option<bool>,
    /// How wrong the torque of each motor, and each reading, may be alone; empty where the loop is unstable.
    pub channels: Vec<ChannelMargin>,
    /// How wrong all torques may be at once; `None` with one motor.
    pub together: Option<TogetherMargin>,
}

/// A loop on the other side of where it bends at its operating point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct OppositeSide {
    /// The side of all other results: ``felt` > 0`.
    pub own: String,
    /// This side.
    pub side: String,
    /// What sampling, delay, lag and limits leave of the loop here.
    pub margins: Margins,
}

/// How it is known that poles are at zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(into = "EvidenceWord")]
pub enum ZeroPoleEvidence {
    /// Exactly, with the gains of the design, before they are rounded.
    Design,
    /// Exactly, with gains that are the fractions which their doubles are.
    Rounded,
    /// Numbers below this size, 1/s, counted as zero.
    ToRounding(f64),
}

impl Default for ZeroPoleEvidence {
    fn default() -> Self {
        Self::ToRounding(0.0)
    }
}

/// The slowest rate at which a sampled controller keeps the loop stable.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct RateLimit {
    /// Delay as a part of the sample time.
    #[serde(rename = "delay_samples")]
    pub delay: f64,
    /// Hz; zero: any up to one sample a second; `None`: not even a million samples a second suffice.
    #[serde(rename = "rate_hz")]
    pub rate: Option<f64>,
    /// The motion that grows at slower rates.
    pub motion: String,
}

/// Where a loop becomes unstable.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct LoopLimit {
    /// The value that it just tolerates; infinite (or 0, downwards) if all that was looked at is tolerated.
    pub value: f64,
    /// The motion that grows beyond.
    pub motion: String,
}

/// How wrong one channel of a loop may be before the loop is unstable, the others as designed. Frequencies in rad/s; `None`
/// where nothing limits.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ChannelMargin {
    /// The motor whose torque is wrong, or what is read.
    pub name: String,
    /// Whether it is a reading.
    pub reading: bool,
    /// The nearest factors below and above one that are too much; 0 and infinity if none is.
    pub gain: [f64; 2],
    /// Of the motions that begin there.
    #[serde(rename = "gain_rad_s")]
    pub gain_frequency: [Option<f64>; 2],
    /// The least turn of the phase that is too much, rad; infinite if none is.
    #[serde(rename = "phase_rad")]
    pub phase: f64,
    /// Where.
    #[serde(rename = "phase_rad_s")]
    pub phase_frequency: Option<f64>,
    /// The least delay that is too much, s, beside the one that is there; infinite if none is (of a sampled loop: none up to ten
    /// samples, looked at every tenth of one). `None` where it is not known: of what a sampled controller reads.
    #[serde(rename = "delay_s")]
    pub delay: Option<f64>,
    /// Where.
    #[serde(rename = "delay_rad_s")]
    pub delay_frequency: Option<f64>,
    /// The balanced disk margin α: errors of gain and phase at once, `(1 + δ/2)/(1 − δ/2)` with |δ| < α.
    pub disk: f64,
    /// Where a larger disk is too large; `None` where that is not known.
    #[serde(rename = "disk_rad_s")]
    pub disk_frequency: Option<f64>,
    /// The factors that this disk holds.
    pub disk_gain: [f64; 2],
    /// The turns of the phase, either way, that it holds, rad.
    #[serde(rename = "disk_phase_rad")]
    pub disk_phase: f64,
    /// Whether phase and disk were searched over the common period of several clocks, for errors that are the same at each
    /// sample; otherwise they come from the frequency response.
    pub searched: bool,
    /// What that delay is to be compared with, s: the lag of the motor, or the sample time; `None` if there is none.
    #[serde(skip)]
    pub own_time: Option<f64>,
    /// Whether the controller of that motor is sampled.
    #[serde(skip)]
    pub sampled: bool,
}

/// How wrong the torques of all motors, or all readings, may be at once.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct TogetherMargin {
    /// Disk margins between which the true one lies: the first is proven, with the second a set of errors is known.
    pub disk: [f64; 2],
    /// Of that set, rad/s.
    #[serde(rename = "rad_s")]
    pub frequency: f64,
    /// That set, which makes the loop unstable.
    pub worst: Vec<WrongTorque>,
}

/// How wrong the torque of a motor, or a reading, is.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct WrongTorque {
    /// The motor, or the reading.
    pub motor: String,
    /// Factor of its size.
    pub factor: f64,
    /// Turn of its phase, rad.
    #[serde(rename = "turn_rad")]
    pub turn: f64,
}

/// What a step of a reference asks of a motor.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct TorquePeak {
    /// The reference.
    pub reference: String,
    /// Size of the step, SI.
    pub step: f64,
    /// Its unit.
    pub step_unit: String,
    /// The motor or source.
    pub input: String,
    /// Unit of what it gives: `N m`, of a force `N`, of a voltage `V`.
    pub unit: String,
    /// Largest torque asked of it, N m; of a force or a voltage that.
    #[serde(rename = "peak_n_m")]
    pub peak: f64,
    /// Its torque limit, N m.
    #[serde(rename = "limit_n_m")]
    pub limit: Option<f64>,
}

/// How it is known that poles are at zero.
#[derive(Serialize, JsonSchema)]
enum EvidenceWord {
    /// With the gains of the design, before they are rounded.
    #[serde(rename = "exactly, gains of the design")]
    Design,
    /// With gains that are the fractions which their doubles are.
    #[serde(rename = "exactly, gains as rounded")]
    Rounded,
    /// Numbers of the size of rounding count as zero.
    #[serde(rename = "to rounding")]
    ToRounding,
}

impl From<ZeroPoleEvidence> for EvidenceWord {
    fn from(evidence: ZeroPoleEvidence) -> Self {
        match evidence {
            ZeroPoleEvidence::Design => Self::Design,
            ZeroPoleEvidence::Rounded => Self::Rounded,
            ZeroPoleEvidence::ToRounding(_) => Self::ToRounding,
        }
    }
}
