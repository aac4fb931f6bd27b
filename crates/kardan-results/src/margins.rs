//! What sampling, delay, lag and limits leave of a loop.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Pole, StabilityVerdict};

/// Stability margins of a controller's loop, and its motor loads.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Margins {
    /// Sample time, s; `None`: the controller is designed for continuous time.
    #[serde(rename = "sample_time_s")]
    pub sample_time: Option<f64>,
    /// From the reading of the sensors to the change of the torques, s.
    #[serde(rename = "delay_s")]
    pub delay: f64,
    /// Whether it computes in single precision.
    pub single_precision: bool,
    /// Spectral radius of the exact map of the linear loop over one sample time of this controller (of the shortest one, if it has
    /// none); `None` in continuous time, or if there is no
    /// such map.
    pub spectral_radius: Option<f64>,
    /// Whether the loop with its sample time, delay and lags is stable.
    #[serde(flatten)]
    pub stability: StabilityVerdict,
    /// The same of all motions except the uncontrolled ones (`free`), which are excluded from all limits; `None` if it is not decided, or its
    /// sample times have no short common period, or the eigenvalue iteration failed.
    #[serde(rename = "controlled_modes_stable")]
    pub stable: Option<bool>,
    /// Slowest stable sample rates, for delays of zero, half a and one sample; empty for a law designed for one sample time.
    pub rates: Vec<RateLimit>,
    /// Blocks of the loop without a sample time, which these rates leave in continuous time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub analogue_blocks: Vec<String>,
    /// Longest delay that the sampled loop tolerates, s; `None` in continuous time or if it is unstable without.
    #[serde(rename = "longest_delay_s")]
    pub longest_delay: Option<LoopLimit>,
    /// Longest lag of all its motors that the loop tolerates, s; `None` if it is unstable without.
    #[serde(rename = "longest_lag_s")]
    pub longest_lag: Option<LoopLimit>,
    /// Smallest and largest factor of its torques that the loop tolerates; `None` if it is unstable.
    pub gain_margin: Option<[LoopLimit; 2]>,
    /// Shafts of uncontrolled motions, with poles at zero. They are excluded from all limits.
    pub uncontrolled_modes: Vec<String>,
    /// Number of poles at zero (multipliers at one) of these motions.
    pub uncontrolled_poles: usize,
    /// Evidence that they are at zero.
    pub uncontrolled_poles_method: ZeroPoleEvidence,
    /// Whether these motions are charges that are integrators without effect, exactly.
    pub uncontrolled_are_integrals: bool,
    /// Nonzero poles that 64 bits do not distinguish from zero: of a loop decided over the rationals,
    /// 1/s, to rounding. They are excluded from all limits.
    #[serde(rename = "near_zero_poles_per_s")]
    pub near_zero_poles: Vec<f64>,
    /// Whether its stability was decided over the rationals, or by certified bounds; otherwise from eigenvalues, whose rounding is bounded.
    pub proven: bool,
    /// All poles of the loop, where its stability in continuous time was decided over the rationals.
    #[serde(skip)]
    pub poles: Option<Vec<Pole>>,
    /// Their growth rate at the sample time, 1/s; 0 if they stay constant.
    #[serde(rename = "drift_per_s")]
    pub drift: f64,
    /// Margins of the torque of each motor, and of each reading, alone; empty if the loop is unstable. With several clocks
    /// only those of the motors of a sampled controller.
    pub channels: Vec<ChannelMargin>,
    /// Margins for simultaneous errors of all torques; `None` with one motor.
    pub multiloop: Option<MultiloopMargin>,
    /// Whether it is stable, but an error of 10 % in the torque of a motor is not tolerated, or its disk margin is at most that.
    pub low_margins: bool,
    /// Of a loop with open backlash at its operating point: the same with the flanks in contact.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<ContactMargins>,
    /// Motor loads after a step of each reference.
    pub peaks: Vec<TorquePeak>,
    /// All this in one paragraph.
    pub verdict: String,
}

/// Disk margin of one channel below which small model errors destabilise: a factor of 1.5, 23°.
pub const LOW_DISK: f64 = 0.4;

impl Margins {
    /// The channel with the lowest disk margin, if that is low.
    pub fn low(&self) -> Option<&ChannelMargin> {
        let least = self.channels.iter().min_by(|a, b| a.disk.total_cmp(&b.disk));
        least.filter(|one| self.low_margins || one.disk < LOW_DISK)
    }
}

/// Margins of a loop with backlash in contact.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ContactMargins {
    /// Elements whose backlash is in contact.
    pub closed: Vec<String>,
    /// Those whose backlash is open.
    pub open: Vec<String>,
    /// `either` flank if both give the same loop, else `lower` (the first shaft behind the second) or `upper`.
    pub flank: String,
    /// Whether the loop is stable; `None` if that is not known.
    pub stable: Option<bool>,
    /// Margins of the torque of each motor, and of each reading, alone; empty if the loop is unstable.
    pub channels: Vec<ChannelMargin>,
    /// Margins for simultaneous errors of all torques; `None` with one motor.
    pub multiloop: Option<MultiloopMargin>,
}

/// A loop on the other side of a kink at its operating point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct OppositeSide {
    /// The side of all other results: ``felt` > 0`.
    pub reference_side: String,
    /// This side.
    pub side: String,
    /// Margins with sampling, delay, lag and limits on this side.
    pub margins: Margins,
}

/// Evidence that poles are at zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(into = "EvidenceWord")]
pub enum ZeroPoleEvidence {
    /// Exactly, with the gains of the design, before they are rounded.
    Design,
    /// Exactly, with the gains rounded to doubles, taken as fractions.
    Rounded,
    /// Numbers below this magnitude, 1/s, count as zero.
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
    /// Hz; zero: any up to one sample per second; `None`: even a million samples per second are not enough.
    #[serde(rename = "rate_hz")]
    pub rate: Option<f64>,
    /// The unstable motion at slower rates.
    pub motion: String,
}

/// The stability limit of a loop.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct LoopLimit {
    /// The largest tolerated value; infinite (or 0, downwards) if all evaluated values are tolerated.
    pub value: f64,
    /// The unstable motion beyond it.
    pub motion: String,
}

/// Gain, phase, delay and disk margins of one channel of a loop, the others as designed. Frequencies in rad/s; `None`
/// without a limit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ChannelMargin {
    /// The motor with the torque error, or the reading.
    pub name: String,
    /// Whether it is a reading.
    pub is_sensor: bool,
    /// The nearest destabilising gain factors below and above one; 0 and infinity if there is none.
    pub gain: [f64; 2],
    /// Frequencies of the motions at these limits.
    #[serde(rename = "gain_rad_s")]
    pub gain_frequency: [Option<f64>; 2],
    /// The least destabilising phase change, rad; infinite if there is none.
    #[serde(rename = "phase_rad")]
    pub phase: f64,
    /// Where.
    #[serde(rename = "phase_rad_s")]
    pub phase_frequency: Option<f64>,
    /// The least destabilising additional delay, s; infinite if there is none (of a sampled loop: none up to ten
    /// samples, evaluated every tenth of one). `None` if it is not known: for readings of a sampled controller.
    #[serde(rename = "delay_s")]
    pub delay: Option<f64>,
    /// Where.
    #[serde(rename = "delay_rad_s")]
    pub delay_frequency: Option<f64>,
    /// The balanced disk margin α: errors of gain and phase at once, `(1 + δ/2)/(1 − δ/2)` with |δ| < α.
    pub disk: f64,
    /// The limiting frequency of the disk margin; `None` if that is not known.
    #[serde(rename = "disk_rad_s")]
    pub disk_frequency: Option<f64>,
    /// The gain factors within this disk.
    pub disk_gain: [f64; 2],
    /// The phase changes, either way, within it, rad.
    #[serde(rename = "disk_phase_rad")]
    pub disk_phase: f64,
    /// Whether phase and disk were searched over the common period of several clocks, for errors that are the same at each
    /// sample; otherwise they come from the frequency response.
    pub multirate_search: bool,
    /// The reference of that delay, s: the lag of the motor, or the sample time; `None` if there is none.
    #[serde(skip)]
    pub own_time: Option<f64>,
    /// Whether the controller of that motor is sampled.
    #[serde(skip)]
    pub sampled: bool,
}

/// Margins for simultaneous errors of the torques of all motors, or of all readings.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct MultiloopMargin {
    /// Bounds of the true disk margin: the lower is proven, for the upper a destabilising set of errors is known.
    pub disk: [f64; 2],
    /// Of that set, rad/s.
    #[serde(rename = "rad_s")]
    pub frequency: f64,
    /// That set, which makes the loop unstable.
    pub worst_perturbation: Vec<WrongTorque>,
}

/// The error of the torque of a motor, or of a reading.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct WrongTorque {
    /// The motor, or the reading.
    pub motor: String,
    /// Gain factor.
    pub factor: f64,
    /// Phase change, rad.
    #[serde(rename = "phase_rad")]
    pub phase: f64,
}

/// The load of a motor after a step of a reference.
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
    /// Unit of its effort: `N m`, of a force `N`, of a voltage `V`.
    pub unit: String,
    /// Largest torque command, N m; of a force or a voltage that.
    #[serde(rename = "peak_n_m")]
    pub peak: f64,
    /// Its torque limit, N m.
    #[serde(rename = "limit_n_m")]
    pub limit: Option<f64>,
}

/// Evidence that poles are at zero.
#[derive(Serialize, JsonSchema)]
enum EvidenceWord {
    /// With the gains of the design, before they are rounded.
    #[serde(rename = "exactly, gains of the design")]
    Design,
    /// With the gains rounded to doubles, taken as fractions.
    #[serde(rename = "exactly, gains as rounded")]
    Rounded,
    /// Numbers of the magnitude of rounding count as zero.
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
