//! A designed law, and what of it computes in a loop.

use kardan_rt::Health;

use super::{ExactLoop, LinearLaw};
use crate::analysis::OutputSignal;
use crate::num::Keeper;
use crate::results::{Design, Physical};

/// A designed law. Measures angles and speeds of shafts, commands inputs; it holds nothing of any run.
pub trait Law: Send + Sync {
    /// Names of the inputs that it commands, in the order of `out` of [`Continuous::command`].
    fn inputs(&self) -> &[String];
    /// The signals that the scenario sets for it.
    fn references(&self) -> &[Reference];
    /// Names of its own states: estimates of an observer, integrators, filters.
    fn states(&self) -> Vec<String> {
        Vec::new()
    }
    /// Its own states at the start, from the angles (rad) and speeds (rad/s) of all shafts there.
    fn start(&self, _angles: &[f64], _speeds: &[f64], out: &mut [f64]) {
        out.fill(0.0);
    }
    /// What runs in a loop.
    fn run(&self) -> Running;
    /// Whether it cancels all forces of the full model, which the linear one does not know.
    fn on_full_model(&self) -> bool {
        false
    }
    /// The speed (rad/s) over which the Coulomb friction that it feeds forward is smoothed, if it does.
    fn friction_width(&self) -> Option<f64> {
        None
    }
    /// The linear part: of a law that bends that at the design point.
    fn linear(&self) -> LinearLaw;
    /// Whether its linear part is another one at another position.
    fn bends(&self) -> bool {
        false
    }
    /// The linear part at rest at a reduced position (rad), each position reference being where its output is; with a clock that
    /// of [`Firmware`], in double precision. `None` if a number overflows.
    fn linear_at(&self, _position: &[f64], clock: Option<Clock>) -> Option<LinearLaw> {
        match clock {
            Some(clock) => Some(self.firmware(clock)?.linear),
            None => Some(self.linear()),
        }
    }
    /// The signals that it measures, if it does not see the true angles and speeds.
    fn sensors(&self) -> &[OutputSignal] {
        &[]
    }
    /// When it runs; `None`: at every instant. Of a law with a clock [`linear`](Self::linear) is that of [`Firmware`].
    fn clock(&self) -> Option<Clock> {
        None
    }
    /// What runs at a sample time; `None` if a number overflows there, or the law is for another sample time.
    fn firmware(&self, _clock: Clock) -> Option<Firmware> {
        None
    }
    /// The designed linear loop, where the design is exact.
    fn exact(&self) -> Option<ExactLoop> {
        None
    }
    /// What was designed, for a reader: everything that is known without the other controllers and without a run.
    fn describe(&self) -> Design;
}

impl std::fmt::Debug for dyn Law {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the law of {}", self.describe().controller)
    }
}

/// A signal from the scenario to a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Name.
    pub name: String,
    /// Angle or torque.
    pub physical: Physical,
    /// One sentence.
    pub description: String,
}

/// A designed law in the loop of a run: it has memory, and belongs to that run.
pub enum Running {
    /// At every instant.
    Continuous(Box<dyn Continuous>),
    /// Once every sample time.
    Sampled(Clock, Box<dyn Block>),
}

/// A law that runs at every instant. Where it has no finite answer it gives what is no number: the step of the run shrinks, or the
/// run ends.
pub trait Continuous: Send {
    /// Commands in N m.
    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]);
    /// Rates of its own states, 1/s, while its inputs apply these torques (N m).
    fn rates(&mut self, _seen: Seen<'_>, _torques: &[f64], _out: &mut [f64]) {}
    /// What it remembers besides its states, such as the last answer.
    fn keep(&mut self, keeper: &mut Keeper<'_>);
}

/// When and in which arithmetic a controller runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Sample time T, s.
    pub period: f64,
    /// From the reading of the sensors to the change of the commands, s; held from there on until the next change.
    pub delay: f64,
    /// Whether the controller computes in `f32`.
    pub single: bool,
}

/// The block of a law at a sample time: the code of `kardan-rt` with its memory.
pub trait Block: Send {
    /// Commands in N m.
    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]);
    /// Its own states at the next sample, if its inputs apply these torques (N m) in between.
    fn next(&mut self, _seen: Seen<'_>, _torques: &[f64], _out: &mut [f64]) {}
    /// What it remembers besides its states, such as the last answer.
    fn keep(&mut self, keeper: &mut Keeper<'_>);
    /// What went wrong at the last sample, and was dealt with.
    fn health(&self) -> Health {
        Health::default()
    }
}

/// A law at a sample time.
pub struct Firmware {
    /// What runs.
    pub block: Box<dyn Block>,
    /// Its linear part, `ξ⁺ = A ξ + Bφ φ + Bω ω + Bδ δ + Bτ τ`, `u = C ξ + …`, with the torques τ commanded, within the
    /// motors' torque limits, on average until the next sample; lag and rate limit are not in them.
    pub linear: LinearLaw,
}

/// What a law sees at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// Angles of all shafts, sorted by name, rad.
    pub angles: &'a [f64],
    /// Their speeds, rad/s.
    pub speeds: &'a [f64],
    /// Disturbance torques on the shafts of [`Request::disturbances`](super::Request::disturbances), N m.
    pub disturbances: &'a [f64],
    /// What the scenario tells it, in the order of [`Law::references`].
    pub references: &'a [f64],
    /// What its sensors read, in the order of [`Law::sensors`]; in continuous time nothing, and sensors are ideal.
    pub readings: &'a [f64],
    /// Its own states.
    pub states: &'a [f64],
}
