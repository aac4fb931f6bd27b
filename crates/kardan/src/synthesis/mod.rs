//! Control laws: from a model and what is asked of it to gains that a `kardan-rt` block runs.
//!
//! `law/` holds one file for each law and [`REGISTRY`], the one list of them; the parser of `[control.<name>]` tables, the
//! manual and the tests read it. The other folders hold the theory that the laws share.

#[macro_use]
mod keys;

mod channels;
mod closed_loop;
pub mod decoupling;
mod error;
mod exact;
mod exact_motions;
pub mod inversion;
mod law;
mod linear_law;
pub mod margins;
mod nonlinear_law;
mod observed;
pub mod observer;
mod outputs;
pub mod regulator;
mod sampled;
mod stability;
mod state_feedback;
mod words;
mod zeros;

pub use closed_loop::{closed_loop_matrix, closed_loop_poles};
pub use error::{Advice, SynthesisError};
pub use exact::{ExactLaw, ExactLoop, named, rounded};
pub use exact_motions::{ExactMotions, exact_motions};
pub use law::*;
pub use observed::Observer;
pub use sampled::{
    Block, Change, Clock, Firmware, Lifted, Limit, LoopPlant, Reads, SampledLoop, SampledLoopError, SampledPart,
    SlowSensor, Slowest, Survey, VariedPlant, Wire, reading_variance, sampled,
};
pub use stability::{Stability, stability};
pub use words::in_words;
pub use zeros::roots;

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::analysis::{ConstrainedSystem, LinearSystem, OutputSignal, linear_system};
use crate::assemble::Along;
use crate::element::Values;
use crate::entries::Entries;
use crate::equations::{InputKind, Measured};
use crate::num::{Keeper, Matrix, Rational};
use crate::reduce::{Dynamics, Kinematics, LinearModel, Reduced, linearise};
use crate::results::{Design, Physical};
use crate::schema::Field;

/// What a law sees at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// Angles of all shafts, sorted by name, rad.
    pub angles: &'a [f64],
    /// Their speeds, rad/s.
    pub speeds: &'a [f64],
    /// Disturbance torques on the shafts of [`Request::disturbances`], N m.
    pub disturbances: &'a [f64],
    /// What the scenario tells it, in the order of [`Law::references`].
    pub references: &'a [f64],
    /// What its sensors read, in the order of [`Law::sensors`]; in continuous time nothing, and sensors are ideal.
    pub readings: &'a [f64],
    /// Its own states.
    pub states: &'a [f64],
}

/// The linear part of a law, `ξ̇ = A ξ + Bφ φ + Bω ω + Bδ δ + Bτ τ + Bρ ρ`, `u = C ξ + Dφ φ + Dω ω + Dδ δ + Dρ ρ`, over the
/// angles φ and speeds ω of all shafts, the disturbance torques δ, the torques τ of its own inputs and its references ρ.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearLaw {
    /// A, states × states.
    pub states: Matrix<f64>,
    /// Bφ, states × shafts.
    pub angles: Matrix<f64>,
    /// Bω, states × shafts.
    pub speeds: Matrix<f64>,
    /// Bδ, states × disturbances.
    pub disturbances: Matrix<f64>,
    /// Bτ, states × inputs.
    pub torques: Matrix<f64>,
    /// C, inputs × states.
    pub on_states: Matrix<f64>,
    /// Dφ, inputs × shafts.
    pub on_angles: Matrix<f64>,
    /// Dω, inputs × shafts.
    pub on_speeds: Matrix<f64>,
    /// Dδ, inputs × disturbances.
    pub on_disturbances: Matrix<f64>,
    /// Bρ, states × references.
    pub references: Matrix<f64>,
    /// Dρ, inputs × references.
    pub on_references: Matrix<f64>,
    /// How errors of the readings of [`Law::sensors`] act on the states beside what follows from true angles and speeds, states ×
    /// sensors.
    pub errors: Matrix<f64>,
    /// How they act on the commands, inputs × sensors.
    pub on_errors: Matrix<f64>,
}

impl LinearLaw {
    /// A law without states that is told no disturbances.
    pub fn gains(on_angles: Matrix<f64>, on_speeds: Matrix<f64>, on_references: Matrix<f64>) -> Self {
        let (inputs, shafts) = (on_angles.rows(), on_angles.columns());
        Self {
            states: Matrix::zeros(0, 0),
            angles: Matrix::zeros(0, shafts),
            speeds: Matrix::zeros(0, shafts),
            disturbances: Matrix::zeros(0, 0),
            torques: Matrix::zeros(0, inputs),
            on_states: Matrix::zeros(inputs, 0),
            on_angles,
            on_speeds,
            on_disturbances: Matrix::zeros(inputs, 0),
            references: Matrix::zeros(0, on_references.columns()),
            on_references,
            errors: Matrix::zeros(0, 0),
            on_errors: Matrix::zeros(inputs, 0),
        }
    }

    /// Whether all entries are finite in single precision, in which firmware runs.
    pub fn fits_single(&self) -> bool {
        let on_plant = [&self.angles, &self.speeds, &self.disturbances, &self.torques, &self.references];
        let commands = [&self.on_angles, &self.on_speeds, &self.on_disturbances, &self.on_references];
        let mut all = on_plant.into_iter().chain(commands).chain([&self.states, &self.on_states]);
        all.all(|matrix| matrix.as_slice().iter().all(|x| (*x as f32).is_finite()))
    }
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

/// What a law is designed for.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// Name of the controller in the model file.
    pub name: &'a str,
    /// Its keys.
    pub values: &'a Values,
    /// The model to design on.
    pub plant: &'a Plant,
    /// Numbers of the shafts on which a disturbance torque is estimated, to be fed forward; empty if nobody estimates.
    pub disturbances: &'a [usize],
}

/// The model that a law is designed on: the file's, with the design values of the controller, without Coulomb friction.
#[derive(Debug, Clone)]
pub struct Plant {
    /// In explicit form.
    pub reduced: Reduced,
    /// The reduced position of the design, rad.
    pub position: Vec<f64>,
    /// Linear there.
    pub linear: LinearModel,
    /// Kind and name of each element, for messages.
    pub elements: Vec<(String, String)>,
    /// What a law that follows its joints was designed to be at other positions.
    turned: sampled::Turned,
}

/// Shortest sample time of a controller, s.
pub const SHORTEST_SAMPLE_TIME: f64 = 1e-6;

/// Longest sample time of a controller, s.
pub const LONGEST_SAMPLE_TIME: f64 = 1.0;

/// Longest delay of a controller, in sample times.
pub const LONGEST_DELAY: f64 = 10.0;

/// Designs a law with the observer that its keys ask for.
///
/// # Errors
/// Why it cannot be designed.
pub fn design_law(kind: &LawKind, name: &str, values: &Values, plant: &Plant) -> Result<Arc<dyn Law>, SynthesisError> {
    #[cfg(test)]
    count_design(name);
    if clock(values)?.is_none() && kind.samples {
        return Err(SynthesisError::SampledOnly { law: kind.keyword });
    }
    let disturbances = observed::disturbances(values, plant)?;
    let law = (kind.design)(&Request { name, values, plant, disturbances: &disturbances })?;
    match values.table("observer") {
        Some(observer) if kind.samples && observer.has("plant") => {
            Err(SynthesisError::IdleKey { key: "plant", method: kind.keyword.into() })
        }
        Some(_) if kind.samples => Ok(law),
        Some(observer) => Ok(Arc::new(observed::Observed::new(law, observer, plant, &disturbances)?)),
        None => Ok(law),
    }
}

/// Designs made so far, by controller.
#[cfg(test)]
static DESIGNS: std::sync::Mutex<std::collections::BTreeMap<String, usize>> =
    std::sync::Mutex::new(std::collections::BTreeMap::new());

#[cfg(test)]
fn count_design(controller: &str) {
    *DESIGNS.lock().expect("no panic").entry(controller.into()).or_default() += 1;
}

/// How often a controller of that name was designed.
#[cfg(test)]
pub(crate) fn designs_of(controller: &str) -> usize {
    DESIGNS.lock().expect("no panic").get(controller).copied().unwrap_or(0)
}

/// When and in which arithmetic the controller with these keys runs; `None`: in continuous time.
///
/// # Errors
/// If the sample time or the delay is out of range, or other keys of sampling stand without a sample time.
pub fn clock(values: &Values) -> Result<Option<Clock>, SynthesisError> {
    let allowed = SHORTEST_SAMPLE_TIME..=LONGEST_SAMPLE_TIME;
    let Some(period) = values.number("sample_time") else {
        return match ["delay", "precision"].into_iter().find(|key| values.has(key)) {
            Some(key) => Err(SynthesisError::NeedsSampleTime { key }),
            None => Ok(None),
        };
    };
    if !allowed.contains(&period) {
        return Err(SynthesisError::SampleTime { time: period });
    }
    let delay = values.number("delay").unwrap_or(0.0);
    if delay > LONGEST_DELAY * period {
        return Err(SynthesisError::Delay { delay, period });
    }
    Ok(Some(Clock { period, delay, single: values.word("precision") == Some("single") }))
}

/// The law as it runs: at its sample time, if it has one.
///
/// # Errors
/// If its keys are wrong, or its numbers overflow at this sample time.
pub fn running(law: Arc<dyn Law>, values: &Values) -> Result<Arc<dyn Law>, SynthesisError> {
    match clock(values)? {
        Some(clock) => sampled(law, clock).ok_or(SynthesisError::SampledOverflow { time: clock.period }),
        None => Ok(law),
    }
}

impl Plant {
    /// The model at a position.
    ///
    /// # Panics
    /// If `position` has not one entry per coordinate or gives a slope that is not finite.
    pub fn new(reduced: Reduced, position: Vec<f64>) -> Self {
        let linear = linearise(&reduced, &position);
        Self { reduced, position, linear, elements: Vec::new(), turned: sampled::Turned::default() }
    }

    /// An element for a reader: ``the harmonic drive `hd` ``.
    pub fn element(&self, name: &str) -> String {
        match self.elements.iter().find(|(_, other)| other == name) {
            Some((kind, _)) => format!("the {} `{name}`", kind.replace('_', " ")),
            None => format!("`{name}`"),
        }
    }

    /// Names of all shafts, sorted.
    pub fn shafts(&self) -> &[String] {
        &self.reduced.equations.shafts
    }

    /// The time constant of each input's motor, s; zero for an ideal one.
    pub fn lags(&self) -> Vec<f64> {
        let lag = |input: &Along<InputKind>| match &input.value {
            InputKind::Motor(motor) => motor.lag.as_ref().map_or(0.0, |lag| lag.to_f64()),
            InputKind::Disturbance => 0.0,
        };
        self.reduced.equations.inputs.iter().map(lag).collect()
    }

    /// The torque limit of an input's motor, N m; `None` if it has none.
    pub fn torque_limit(&self, input: usize) -> Option<f64> {
        match &self.reduced.equations.inputs[input].value {
            InputKind::Motor(motor) => motor.torque_limit.as_ref().map(|limit| limit.to_f64()),
            InputKind::Disturbance => None,
        }
    }

    /// Whether the equations of motion have constant coefficients.
    pub fn is_constant(&self) -> bool {
        Kinematics::new(&self.reduced).is_constant()
    }

    /// Whether the equations of motion are those of the linear model: constant coefficients, and no force at zero angles.
    pub fn is_linear(&self) -> bool {
        let (dynamics, mut work) = Dynamics::new(&self.reduced);
        let zero = vec![0.0; self.reduced.freedoms()];
        dynamics.update(&zero, &zero, &mut work);
        self.is_constant() && work.passive.iter().all(|force| *force == 0.0)
    }

    /// Names of the states `[q_r; q̇_r]`.
    pub fn states(&self) -> Vec<String> {
        let names = || self.linear.coordinates.iter();
        names().map(|name| format!("{name}.phi")).chain(names().map(|name| format!("{name}.w"))).collect()
    }

    /// The linear model as terms along directions, with these inputs.
    ///
    /// # Panics
    /// If an input is not there.
    pub fn constrained(&self, inputs: &[String]) -> ConstrainedSystem {
        ConstrainedSystem::at(&self.reduced, &self.position, &BTreeSet::new(), inputs)
    }

    /// The linear model as `ẋ = A x + B u`, `y = C x + D u` with `x = [q_r; q̇_r]`, exact.
    ///
    /// # Panics
    /// If an input, or what an output names, is not there, or the inertia is singular (the model checks this before).
    pub fn system(&self, inputs: &[String], outputs: &[OutputSignal]) -> LinearSystem {
        let system = self.constrained(inputs);
        let pencil = linear_system(&system, &self.reduced.coordinates, &self.linear.basis, outputs);
        pencil.explicit().expect("reduced inertia is positive definite")
    }
}

/// The description of a kind of law.
#[derive(Debug, Clone, Copy)]
pub struct LawKind {
    /// The word after `law =`, and the name of the file here.
    pub keyword: &'static str,
    /// What it does, in one sentence.
    pub summary: &'static str,
    /// Its keys besides `law` and `design`.
    pub fields: &'static [Field],
    /// An example, valid TOML.
    pub example: &'static str,
    /// The keys of a table for these inputs and outputs, with defaults for all else; `None` if the law needs more than that.
    pub template: fn(inputs: &[String], outputs: &[String]) -> Option<Entries>,
    /// The inputs that the keys name.
    pub inputs: fn(&Values) -> Vec<String>,
    /// The references and load estimates that the keys introduce.
    pub references: fn(&Values) -> Vec<Reference>,
    /// Whether it is designed for its sample time, with an observer of its own.
    pub samples: bool,
    /// The design.
    pub design: fn(&Request<'_>) -> Result<Arc<dyn Law>, SynthesisError>,
}

impl Plant {
    /// The output of a name: `rk.phi`, `rk.w`, or a sensor with or without the end of its reading.
    ///
    /// # Errors
    /// If a sensor that measures no torque stands without the end of its reading.
    ///
    /// # Panics
    /// If there is no such output (the model checks this before).
    pub fn output(&self, name: &str) -> Result<OutputSignal, SynthesisError> {
        let (head, tail) = name.split_once('.').unwrap_or((name, ""));
        let equations = &self.reduced.equations;
        if self.reduced.shaft(head).is_some() {
            let measured = if tail == "w" { Measured::Speed(head.into()) } else { Measured::Angle(head.into()) };
            return Ok(OutputSignal { name: name.into(), measured });
        }
        let sensor = equations.sensors.iter().find(|(sensor, _)| sensor == head);
        let measured =
            sensor.map(|(_, sensor)| sensor.measured.clone()).unwrap_or_else(|| panic!("no output `{name}`"));
        let full = match measured {
            Measured::Angle(_) => format!("{head}.phi"),
            Measured::Speed(_) => format!("{head}.w"),
            _ => format!("{head}.tau"),
        };
        if name == full || full.ends_with(".tau") && tail.is_empty() {
            return Ok(OutputSignal { name: full, measured });
        }
        Err(SynthesisError::SensorKind { signal: name.into(), full })
    }

    /// How torques on shafts act: `ẋ = … + W τ`, `y = … + F τ`, with W states × shafts and F outputs × shafts.
    ///
    /// # Panics
    /// As [`Self::system`].
    pub fn torques(&self, shafts: &[usize], outputs: &[OutputSignal]) -> (Matrix<Rational>, Matrix<Rational>) {
        let mut system = self.constrained(&[]);
        system.inputs = shafts
            .iter()
            .map(|&shaft| Along { element: self.shafts()[shaft].clone(), row: vec![(shaft, Rational::ONE)], value: () })
            .collect();
        let pencil = linear_system(&system, &self.reduced.coordinates, &self.linear.basis, outputs);
        let explicit = pencil.explicit().expect("reduced inertia is positive definite");
        (explicit.b, explicit.d)
    }

    /// The twists of the springs as rows over `[q_r; q̇_r]`.
    pub fn twists(&self) -> Vec<Vec<Rational>> {
        let basis = &self.linear.basis;
        let r = basis.columns();
        let row = |spring: &Along<_>| -> Vec<Rational> {
            let along = |j: usize| spring.row.iter().fold(Rational::ZERO, |sum, (k, x)| sum + x * &basis[(*k, j)]);
            (0..2 * r).map(|j| if j < r { along(j) } else { Rational::ZERO }).collect()
        };
        self.reduced.equations.springs.iter().map(row).filter(|row| row.iter().any(|x| !x.is_zero())).collect()
    }
}

/// The angle of a shaft as an output of the linear model.
fn angle_output(signal: &str) -> OutputSignal {
    OutputSignal { name: signal.into(), measured: Measured::Angle(signal.trim_end_matches(".phi").into()) }
}

/// The shaft number behind a signal `<shaft>.phi`.
fn output_shaft(signal: &str, shafts: &[String]) -> Result<usize, SynthesisError> {
    signal.strip_suffix(".phi").and_then(|name| shafts.iter().position(|shaft| shaft == name)).ok_or_else(|| {
        SynthesisError::NotAnAngle {
            signal: signal.to_string(),
            example: format!("{}.phi", shafts.first().map_or("shaft", String::as_str)),
        }
    })
}

/// `1/(c H⁻¹ cᵀ)`: the inertia that a torque along the output feels, kg m², exact.
///
/// For the flexspline of the steering system this is J̃_fs \[diss. (6.129)\].
///
/// # Panics
/// If the inertia matrix is singular or the direction has no motion (the model checks the first before).
pub fn effective_inertia(model: &LinearModel, shaft: usize) -> Rational {
    inertia_between(model, shaft, &model.direction(shaft).transpose())
        .expect("a shaft that can move feels its own torque")
}

/// `1/(c H⁻¹ f)`: torque of an input per acceleration of an output, kg m², exact; `None` if the input does not act on it.
///
/// The effective inertia where the input acts on the output's own shaft; through a gear, that over the ratio.
///
/// # Panics
/// If the inertia matrix is singular (the model checks this before).
pub fn input_inertia(model: &LinearModel, shaft: usize, input: usize) -> Option<Rational> {
    let f = Matrix::from_fn(model.inertia.rows(), 1, |i, _| model.input[(i, input)].clone());
    inertia_between(model, shaft, &f)
}

fn inertia_between(model: &LinearModel, shaft: usize, f: &Matrix<Rational>) -> Option<Rational> {
    let x = model.inertia.solve(f).expect("reduced inertia is positive definite");
    let mobility = model.direction(shaft).multiply(&x)[(0, 0)].clone();
    (!mobility.is_zero()).then(|| Rational::ONE / mobility)
}
