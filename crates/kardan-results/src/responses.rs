//! Frequency and step responses of a loop.

use schemars::JsonSchema;
use serde::Serialize;

use super::{ChannelMargin, MultiloopMargin};

/// Prefix of a note on why a design has no [`LoopResponses`].
pub const NO_RESPONSES: &str = "no frequency responses are shown: ";

/// Frequency responses of the linear loop of a controller, as it runs: with lags, sampling and delay. Of a sampled loop those
/// at its sample instants.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct LoopResponses {
    /// Frequencies, rad/s, ascending; denser where the responses curve.
    #[serde(rename = "frequencies_rad_s")]
    pub frequencies: Vec<f64>,
    /// Half the sample rate, rad/s; `None` in continuous time.
    #[serde(rename = "nyquist_rad_s")]
    pub nyquist: Option<f64>,
    /// The loop gain L where the loop is broken at one motor or one reading, all others closed.
    pub loops: Vec<LoopGain>,
    /// S, T and KS with all motors, or all readings, at once; empty for a loop that is not stable.
    pub sensitivities: Vec<SingularValues>,
    /// Margin for simultaneous errors of all readings; `None` of a loop that is not stable, of one reading, or of many.
    pub sensors_multiloop: Option<MultiloopMargin>,
    /// From each reference to each output.
    pub references: Vec<ReferenceResponse>,
    /// Responses to a step of each reference; empty for a loop that is not stable.
    pub steps: Vec<StepResponse>,
    /// Margins over the joint positions; `None` without rotating joints.
    pub margins_over_position: Option<MarginsOverPositions>,
}

/// Margins of the motors along the motions of the joints that stretch no spring, half a revolution each.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct MarginsOverPositions {
    /// The rotating coordinates.
    pub rotated_coordinates: String,
    /// The margins at each position.
    pub positions: Vec<PositionMargins>,
}

impl MarginsOverPositions {
    /// The motor with the least disk margin, and the angle at which it has it, rad.
    pub fn worst(&self) -> Option<(&ChannelMargin, f64)> {
        let all = self.positions.iter().flat_map(|one| one.motors.iter().map(|motor| (motor, one.angle)));
        all.min_by(|a, b| a.0.disk.total_cmp(&b.0.disk))
    }
}

/// Margins of the motors at a joint position.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct PositionMargins {
    /// Angle of the first rotating coordinate, rad.
    #[serde(rename = "angle_rad")]
    pub angle: f64,
    /// Margins of the torque of each motor alone; empty if the loop is not stable.
    pub motors: Vec<ChannelMargin>,
}

/// The loop gain L, broken at one place: the loop is at the limit of stability where it is −1.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct LoopGain {
    /// The motor whose torque, or the reading, that is disconnected.
    pub name: String,
    /// Whether it is a reading.
    pub is_sensor: bool,
    /// Whether there is no feedback through this point.
    pub open: bool,
    /// Unstable poles of the loop broken here, from eigenvalues in floating point; L encircles −1 that many times counterclockwise,
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

/// A function of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub enum LoopFunction {
    /// `S = (I + L)⁻¹`: the sensitivity.
    #[default]
    S,
    /// `T = L (I + L)⁻¹`: the complementary sensitivity.
    T,
    /// `K S`: the torques that errors of the readings cause.
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
    /// Whether the channels have different units: then the values refer to SI units.
    pub mixed: bool,
    /// The largest of all frequencies; `None` if the iteration failed.
    pub largest: Option<LargestSingularValue>,
    /// At each frequency, the largest first.
    pub values: Vec<Vec<f64>>,
}

/// The largest singular value over all frequencies.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct LargestSingularValue {
    /// The largest value found: for one channel the maximum, to rounding; for several the maximum over samples near every pole and in between.
    pub value: f64,
    /// Its frequency, rad/s; `None` if it is only approached at infinity.
    #[serde(rename = "frequency_rad_s")]
    pub frequency: Option<f64>,
}

/// Frequency response of an output to a reference.
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

/// Step response to a reference in the linear loop from rest, without limits and friction.
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
    /// The outputs, then the torque commands of the motors.
    pub signals: Vec<StepSignal>,
}

/// A signal after a step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct StepSignal {
    /// The output or motor.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Whether it is the command of a motor.
    pub motor: bool,
    /// Its value at each time, SI.
    pub values: Vec<f64>,
}
