//! What a loop answers to sines and to steps.

use schemars::JsonSchema;
use serde::Serialize;

use super::{ChannelMargin, TogetherMargin};

/// How a note of a design begins that tells why it has no [`LoopResponses`].
pub const NO_RESPONSES: &str = "no frequency responses are shown: ";

/// Frequency responses of the linear loop of a controller, as it runs: with lags, sampling and delay. Of a sampled loop what is seen
/// at its sample instants.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct LoopResponses {
    /// Where they were looked at, rad/s, ascending; closer where they bend.
    #[serde(rename = "frequencies_rad_s")]
    pub frequencies: Vec<f64>,
    /// Half the sample rate, rad/s; `None` in continuous time.
    #[serde(rename = "nyquist_rad_s")]
    pub nyquist: Option<f64>,
    /// The loop gain L where the loop is broken at one motor or one reading, all others closed.
    pub loops: Vec<LoopGain>,
    /// S, T and KS with all motors, or all readings, at once; empty for a loop that is not stable.
    pub sensitivities: Vec<SingularValues>,
    /// How wrong all readings may be at once; `None` of a loop that is not stable, of one reading, or of many.
    pub sensors_multiloop: Option<TogetherMargin>,
    /// From each reference to each output.
    pub references: Vec<ReferenceResponse>,
    /// What follows a step of each reference; empty for a loop that is not stable.
    pub steps: Vec<StepResponse>,
    /// Margins where the joints stand; `None` without joints that turn.
    pub margins_over_position: Option<MarginsOverPositions>,
}

/// Margins of the motors along the motions of the joints that stretch no spring, half a turn each.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct MarginsOverPositions {
    /// The coordinates that turn.
    pub rotated_coordinates: String,
    /// What was found at each position.
    pub positions: Vec<PositionMargins>,
}

impl MarginsOverPositions {
    /// The motor with the least disk margin, and the angle at which it has it, rad.
    pub fn worst(&self) -> Option<(&ChannelMargin, f64)> {
        let all = self.positions.iter().flat_map(|one| one.motors.iter().map(|motor| (motor, one.angle)));
        all.min_by(|a, b| a.0.disk.total_cmp(&b.0.disk))
    }
}

/// Margins of the motors where the joints stand.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct PositionMargins {
    /// Angle of the first coordinate that turns, rad.
    #[serde(rename = "angle_rad")]
    pub angle: f64,
    /// How wrong the torque of each motor may be alone; empty where the loop is not stable.
    pub motors: Vec<ChannelMargin>,
}

/// The loop gain L, broken at one place: the loop is at the limit of stability where it is −1.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct LoopGain {
    /// The motor whose torque, or what of the readings, is disconnected.
    pub name: String,
    /// Whether it is a reading.
    pub is_sensor: bool,
    /// Whether nothing comes back: no loop goes through this place.
    pub open: bool,
    /// Poles of the loop broken here that grow, from eigenvalues in floating point; as often L goes around −1, counterclockwise,
    /// from −∞ to ∞ rad/s, where the closed loop is stable (Nyquist). Poles on the axis do not count. `None` if that could not be
    /// computed.
    pub unstable_poles: Option<usize>,
    /// Re L at each frequency.
    #[serde(rename = "re")]
    pub real: Vec<f64>,
    /// Im L at each frequency.
    #[serde(rename = "im")]
    pub imaginary: Vec<f64>,
}

/// Which function of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub enum LoopFunction {
    /// `S = (I + L)⁻¹`: how much of an error is left.
    #[default]
    S,
    /// `T = L (I + L)⁻¹`: how much of the noise goes through.
    T,
    /// `K S`: which torques errors of the readings ask for.
    #[serde(rename = "KS")]
    Ks,
}

/// Singular values of a function of the loop, for errors of all channels at once.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SingularValues {
    /// Which.
    pub function: LoopFunction,
    /// Whether the errors are those of the readings; otherwise those of the motors' torques.
    pub at_sensors: bool,
    /// Unit; empty for a number without one.
    pub unit: String,
    /// Whether the channels have different units: then the values are those of numbers in SI units.
    pub mixed: bool,
    /// The largest of all frequencies; `None` if the iteration failed.
    pub largest: Option<LargestSingularValue>,
    /// At each frequency, the largest first.
    pub values: Vec<Vec<f64>>,
}

/// The largest singular value over all frequencies.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct LargestSingularValue {
    /// The largest that was found: of one channel none is larger, but for rounding; of several beside every pole and in between.
    pub value: f64,
    /// Where, rad/s; `None` where it is approached without end.
    #[serde(rename = "frequency_rad_s")]
    pub frequency: Option<f64>,
}

/// What an output makes of sines of a reference.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ReferenceResponse {
    /// The reference.
    pub reference: String,
    /// The output.
    pub output: String,
    /// Unit of their quotient; empty for a number without one.
    pub unit: String,
    /// Whether the output belongs to the reference's channel.
    pub same_channel: bool,
    /// Real part at each frequency.
    #[serde(rename = "re")]
    pub real: Vec<f64>,
    /// Imaginary part at each frequency.
    #[serde(rename = "im")]
    pub imaginary: Vec<f64>,
}

/// What follows a step of a reference in the linear loop from rest, without limits and friction.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct StepResponse {
    /// The reference.
    pub reference: String,
    /// Size of the step, SI.
    pub size: f64,
    /// Its unit.
    pub unit: String,
    /// Times, s.
    #[serde(rename = "time_s")]
    pub time: Vec<f64>,
    /// The outputs, then the torques that the motors are told.
    pub signals: Vec<StepSignal>,
}

/// A signal after a step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct StepSignal {
    /// The output or motor.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Whether it is what a motor is told.
    pub motor: bool,
    /// Its value at each time, SI.
    pub values: Vec<f64>,
}
