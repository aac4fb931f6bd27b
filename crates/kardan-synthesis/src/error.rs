//! Errors of designing a law.

use super::{decoupling, inversion, observer, regulator};
use kardan_results::{Complex, Pole};

/// Why a law cannot be designed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SynthesisError {
    /// An output is not the angle of a shaft.
    #[error("`{signal}` is not the angle of a shaft; a law controls an output such as `{example}`")]
    NotAnAngle {
        /// The signal.
        signal: String,
        /// One that would do.
        example: String,
    },
    /// The decoupling matrix is singular.
    #[error(
        "the outputs {} cannot be decoupled by static state feedback with the inputs {}: their accelerations depend on \
         the inputs through a matrix of rank {rank} only{}",
        list(outputs),
        list(inputs),
        unreached(not_reached)
    )]
    NotDecouplable {
        /// The outputs.
        outputs: Vec<String>,
        /// The inputs.
        inputs: Vec<String>,
        /// Exact rank of C H⁻¹ F.
        rank: usize,
        /// Outputs whose acceleration no chosen input reaches directly (relative degree above two).
        not_reached: Vec<String>,
    },
    /// The input does not act on the acceleration of the output.
    #[error("the motor `{input}` does not act on the acceleration of `{output}` (relative degree above two)")]
    NotReached {
        /// The input.
        input: String,
        /// The output.
        output: String,
    },
    /// An output that moves without inertia, for a law that needs accelerations.
    #[error("`{0}` moves without inertia, so it has no acceleration that a motor acts on")]
    NoAcceleration(String),
    /// The block of the full nonlinear model in a model with these coordinates without inertia.
    #[error(
        "the block of the full nonlinear model uses accelerations only, and there are none for {}",
        list(.0)
    )]
    NoInertia(Vec<String>),
    /// A sensor of an angle or a speed whose name lacks the ending of its reading.
    #[error("`{signal}` measures no torque; write `{full}`")]
    SensorKind {
        /// As written.
        signal: String,
        /// As it should be.
        full: String,
    },
    /// A constraint torque or a net torque where only what follows from angles and speeds can be measured.
    #[error("`{0}` depends directly on the motor torques, so an observer cannot measure it")]
    NotASensor(String),
    /// An output that computed torque does not control.
    #[error("computed torque controls angles of shafts and constraint torques, and `{0}` is neither")]
    NotForComputedTorque(String),
    /// Dynamics for an output that has none.
    #[error("`{output}` follows the motors without delay, so `{key}` has no meaning for its channel")]
    NoDynamics {
        /// The output.
        output: String,
        /// The key.
        key: &'static str,
    },
    /// The motors do not act on the required acceleration or torque.
    #[error(
        "the motors {} do not act on `{output}` directly{}",
        list(inputs),
        degree.map_or(" nor in any other way".into(), |degree| format!(", but only on its derivative of order {degree}"))
    )]
    NoDirectInput {
        /// The output.
        output: String,
        /// The inputs.
        inputs: Vec<String>,
        /// Its relative degree.
        degree: Option<usize>,
    },
    /// A law without a block for the nonlinear model, and why.
    #[error("the law cannot run on the nonlinear model: {0}")]
    NoBlock(String),
    /// A key of the nonlinear plant.
    #[error("`{0}` needs the full model: `plant = \"nonlinear\"`")]
    NeedsNonlinear(&'static str),
    /// A key of the linear plant.
    #[error("`{0}` is for constant gains; with `plant = \"nonlinear\"` an observer estimates the loads")]
    NeedsLinear(&'static str),
    /// A requested pole that does not decay, by its real part, 1/s.
    #[error("a pole with the real part {0} does not decay")]
    UnstablePole(f64),
    /// Poles cannot be placed.
    #[error("{0}")]
    Placement(#[from] regulator::PlacementError),
    /// The Riccati equation cannot be solved.
    #[error("{0}")]
    Riccati(#[from] regulator::RiccatiError),
    /// No values of the outputs can be kept constant.
    #[error("{error}")]
    SteadyState {
        /// The outputs.
        outputs: Vec<String>,
        /// Why.
        error: regulator::SteadyStateError,
    },
    /// Not as many outputs as inputs.
    #[error("{reason}")]
    NotSquare {
        /// As text.
        reason: String,
        /// The outputs.
        outputs: Vec<String>,
    },
    /// No trajectories can be planned.
    #[error("no trajectory can be planned: {error}")]
    Planner {
        /// The outputs.
        outputs: Vec<String>,
        /// Why.
        error: Box<inversion::PlannerError>,
    },
    /// A name in `max_acceptable` that has no weight.
    #[error(
        "`max_acceptable` names `{name}`, which is neither a motor of the law nor an angle or speed of a coordinate"
    )]
    NoWeight {
        /// The name.
        name: String,
        /// The states.
        states: Vec<String>,
        /// The inputs.
        inputs: Vec<String>,
    },
    /// A value in `max_acceptable` that is no size.
    #[error("the largest acceptable value of `{0}` must be more than zero")]
    NotPositive(String),
    /// A gain that is too large for a number.
    #[error("a gain is too large for a number")]
    TooLarge,
    /// A sample time that no controller has, s.
    #[error("a sample time of {} s is {}", .0, if *.0 > 1.0 { "longer than 1 s" } else { "shorter than a microsecond" })]
    SampleTime(f64),
    /// A delay that no controller has.
    #[error("a delay of {delay} s is longer than ten sample times of {period} s")]
    Delay {
        /// s
        delay: f64,
        /// s
        period: f64,
    },
    /// A law that is designed for a sample time, without one.
    #[error("the law `{0}` is designed for a sample time, and none is given")]
    SampledOnly(&'static str),
    /// A law that is designed for a sample time cannot be had: its `feedback` or its `observer`.
    #[error("the Riccati equation of the {0} has no stabilising solution in floating point")]
    SampledRiccati(&'static str),
    /// The motors do not reach the output at all.
    #[error("no motor of the law acts on `{0}`")]
    Unreached(String),
    /// A key that a channel does not use.
    #[error("the channel of `{output}` controls {kind}, so that `{key}` has no meaning for it")]
    IdleChannelKey {
        /// The output.
        output: String,
        /// `an angle` or `a torque`.
        kind: &'static str,
        /// The key.
        key: &'static str,
    },
    /// A key of a sampled controller.
    #[error("`{0}` is for a controller with a `sample_time`; this one runs in continuous time")]
    NeedsSampleTime(&'static str),
    /// Numbers of a sampled controller that are too large at a sample time, s.
    #[error("the controller cannot run at a sample time of {0} s: its numbers overflow within a sample")]
    SampledOverflow(f64),
    /// A name that is no shaft.
    #[error("there is no shaft `{0}` on which a disturbance could act")]
    NoShaft(String),
    /// The observer cannot be designed.
    #[error("the observer: {error}")]
    Observer {
        /// Its sensors.
        sensors: Vec<String>,
        /// Why.
        error: Box<observer::ObserverError>,
    },
    /// No poles for an observer.
    #[error("the observer needs `poles`")]
    ObserverPoles,
    /// Forces that law and observer would both cancel.
    #[error(
        "the law cancels forces that the observer's linear model does not contain (of joints, rest angles or \
         friction); the observer would report them as disturbances, and they would be cancelled twice"
    )]
    DoubleCancellation,
    /// Torques that expressions of these elements give: the gain of the law includes them, the full model of an observer does
    /// not.
    #[error(
        "the gain of the law includes the linearised torques that expressions give ({}), and the full model of the \
         observer does not: it would report them as disturbances, and they would be cancelled twice",
        list(.0)
    )]
    LawDoubleCancellation(Vec<String>),
    /// A key that the method of the observer does not use.
    #[error("the observer's method `{method}` does not use `{key}`")]
    IdleKey {
        /// The key.
        key: &'static str,
        /// The method.
        method: String,
    },
    /// An observer of a law that reads its sensors directly.
    #[error("the law `{0}` reads its sensors as they are, and has no observer")]
    NoObserver(&'static str),
    /// More than all of a disturbance: the given share.
    #[error("`compensation` is {0}: a law cannot cancel more than the whole disturbance")]
    NotAShare(f64),
    /// A number of positions that is none.
    #[error("`schedule` is {0}: it must be a whole number of positions from 1 to 256")]
    SchedulePoints(f64),
    /// An output whose value at the operating point is unknown.
    #[error("`{0}` depends directly on the motor torques, so its value at the operating point is unknown")]
    NotAtRest(String),
    /// A law that cannot follow the position of the joints of its plant, and why, as the end of a sentence.
    #[error("the law cannot follow the position of its joints: {0}")]
    NoSchedule(String),
    /// A pole of an observer that does not decay, by its real part.
    #[error("a pole of the observer has the real part {0}; its error would not die out")]
    ObserverUnstable(f64),
    /// Two keys that set the same value.
    #[error("the channel of `{output}` has both `{}` and `{}`", keys[0], keys[1])]
    Contradiction {
        /// The output.
        output: String,
        /// The keys.
        keys: [&'static str; 2],
    },
    /// The requested dynamics of a channel are impossible.
    #[error("the channel of `{output}`: {error}")]
    Compensation {
        /// The output.
        output: String,
        /// Why.
        error: Box<decoupling::CompensationError>,
    },
    /// Static state feedback cannot decouple the outputs.
    #[error("{error}{}", reasons.iter().map(|reason| format!("; {reason}")).collect::<String>())]
    NotStatic {
        /// The outputs.
        outputs: Vec<String>,
        /// The exact reason.
        error: Box<decoupling::NotDecouplable>,
        /// Alternatives, or why there are none.
        reasons: Vec<String>,
    },
    /// No feedback decouples the outputs.
    #[error("no feedback at all decouples the outputs {}: {}", list(outputs), reasons.join("; "))]
    Impossible {
        /// The outputs.
        outputs: Vec<String>,
        /// Why.
        reasons: Vec<String>,
    },
    /// Blocks that cannot be decoupled.
    #[error("{0}")]
    Blocks(#[from] inversion::BlockError),
    /// The law would hide a motion that grows.
    #[error(
        "the zero dynamics are unstable: while the outputs are held constant, a motion grows with {} 1/s ({polynomial} = 0)",
        poles.iter().map(|pole| pole_text(*pole)).collect::<Vec<_>>().join(", ")
    )]
    UnstableZeros {
        /// The outputs.
        outputs: Vec<String>,
        /// Their polynomial.
        polynomial: String,
        /// The zeros that are not stable.
        poles: Vec<Pole>,
    },
    /// A duplicate input or output.
    #[error("`{name}` is used by two channels; every channel needs its own {what}")]
    Duplicate {
        /// The name.
        name: String,
        /// `input` or `output`.
        what: &'static str,
    },
}

/// A complex number as text: `3`, `3 ± 4 j`.
fn pole_text(Complex { re, im }: Pole) -> String {
    if im == 0.0 { format!("{re:.6}") } else { format!("{re:.6} ± {:.6} j", im.abs()) }
}

fn list(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn unreached(names: &[String]) -> String {
    if names.is_empty() {
        String::new()
    } else {
        format!(" (no chosen input reaches the acceleration of {})", list(names))
    }
}

/// Label and help for a [`SynthesisError`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advice {
    /// Words of the controller's table that are to blame.
    pub named: Vec<String>,
    /// The label there.
    pub label: &'static str,
    /// What to do.
    pub help: String,
}

impl Advice {
    fn of(named: &[String], label: &'static str, help: &str) -> Self {
        Self { named: named.to_vec(), label, help: help.into() }
    }

    /// About one word of the table.
    fn at(named: &str, label: &'static str, help: &str) -> Self {
        Self::of(&[named.into()], label, help)
    }

    /// About the table as a whole.
    fn whole(help: &str) -> Self {
        Self::of(&[], "this controller", help)
    }
}

impl SynthesisError {
    /// What to do about it.
    pub fn advice(&self) -> Advice {
        match self {
            Self::NotDecouplable { outputs, not_reached, .. } => {
                let (named, label) =
                    if not_reached.is_empty() { (outputs, "not independent") } else { (not_reached, "not reached") };
                let help = "choose other outputs or inputs; `kardan equations` shows what each input reaches";
                Advice::of(named, label, help)
            }
            Self::Duplicate { name, what } => {
                Advice::at(name, "used here", &format!("name another {what} in each channel"))
            }
            Self::NotReached { input, .. } => Advice::at(
                input,
                "does not act on the output directly",
                "choose a motor that acts on the output without a spring in between, or give `inertia`; behind a \
                 spring use `decoupling`, `pole_placement` or `lqr`",
            ),
            Self::NotAnAngle { signal, example } => {
                Advice::at(signal, "not an angle", &format!("name the angle of a shaft, such as `{example}`"))
            }
            Self::NoAcceleration(output) => Advice::at(
                output,
                "it has no acceleration",
                "take `lqr`, `pole_placement` or `decoupling`, or give it an inertia",
            ),
            Self::NoInertia(coordinates) => Advice::of(
                coordinates,
                "no inertia",
                "design on the linear model: `plant = \"linear\"`, or give them an inertia",
            ),
            Self::SensorKind { signal, full } => Advice::at(signal, "which reading?", &format!("write `{full}`")),
            Self::NotASensor(signal) => Advice::at(
                signal,
                "not for an observer",
                "let the observer measure angles, speeds and torques of springs",
            ),
            Self::NotForComputedTorque(signal) => Advice::at(
                signal,
                "neither angle nor constraint torque",
                "name `<shaft>.phi` or a sensor of a constraint torque, or use `law = \"decoupling\"`",
            ),
            Self::NoDynamics { output, key } => {
                Advice::at(output, "no dynamics", &format!("remove `{key}`: the torque equals its reference at once"))
            }
            Self::NoDirectInput { output, .. } => Advice::at(
                output,
                "not reached directly",
                "choose motors that act on it without a spring in between, or use `law = \"decoupling\"`",
            ),
            Self::NoBlock(_) => Advice::of(&[], "this law", "design on the linear model: `plant = \"linear\"`"),
            Self::NeedsNonlinear(key) => {
                Advice::at(key, "this key", &format!("add `plant = \"nonlinear\"`, or remove `{key}`"))
            }
            Self::NeedsLinear(key) => Advice::at(key, "this key", &format!("remove `{key}`, and add an observer")),
            Self::UnstablePole(_) => Advice::whole("choose poles with a negative real part"),
            Self::Placement(error) => Advice::whole(match error {
                regulator::PlacementError::NotSelfConjugate { .. } => "write pairs: `\"-14 ± 14.3j\"`",
                regulator::PlacementError::WrongNumber { .. } => {
                    "give as many poles as states: two for each reduced coordinate; one for a charge that acts on nothing, or for a coordinate without inertia; none for one that is both"
                }
                regulator::PlacementError::FixedModes { .. } => "add a motor that reaches them, or name them as poles",
                _ => "spread the poles",
            }),
            Self::Riccati(error) => Advice::whole(match error {
                regulator::RiccatiError::NotStabilisable { .. } => "add a motor that reaches them",
                regulator::RiccatiError::NotDetectable { .. } => "give the motion a weight in `max_acceptable`",
                _ => "choose other weights",
            }),
            Self::SteadyState { outputs, .. } => Advice::of(
                outputs,
                "cannot be held constant",
                "choose as many outputs as motors, and outputs that the motors can hold constant",
            ),
            Self::NotSquare { outputs, .. } => Advice::of(outputs, "these outputs", "name as many outputs as motors"),
            Self::Planner { outputs, .. } => Advice::of(outputs, "not invertible", "choose other outputs"),
            Self::NoWeight { name, states, inputs } => {
                let all = list(&[inputs.as_slice(), states].concat());
                Advice::at(name, "no weight", &format!("there are {all}"))
            }
            Self::NotPositive(name) => Advice::at(name, "not a size", "write a value above zero"),
            Self::TooLarge => Advice::whole("check the exponents of the model's numbers"),
            Self::Unreached(output) => Advice::at(output, "not reached", "choose other motors or another output"),
            Self::IdleChannelKey { output, key, .. } => Advice::at(output, "this channel", &format!("remove `{key}`")),
            Self::Contradiction { output, keys: [one, other] } => {
                Advice::at(output, "conflicting keys", &format!("keep one of `{one}` and `{other}`"))
            }
            Self::Compensation { output, error } => Advice::at(output, "this channel", &compensation_help(error)),
            Self::NotStatic { outputs, .. } => Advice::of(
                outputs,
                "not decoupled",
                "set `feedback` as the message states, or choose other outputs or inputs",
            ),
            Self::Impossible { outputs, .. } => {
                Advice::of(outputs, "not independent", "choose other outputs or inputs; no controller can do this")
            }
            Self::Blocks(_) => Advice::of(&[], "these channels", "choose other outputs or inputs"),
            Self::UnstableZeros { outputs, .. } => Advice::of(
                outputs,
                "unstable zero dynamics",
                "choose other outputs, add damping, or give up decoupling: `law = \"lqr\"`",
            ),
            Self::NotAtRest(_) => {
                Advice::whole("control an angle, a speed or the torque of a torsion bar, or leave out `at`")
            }
            Self::SampleTime(_) => Advice::at("sample_time", "this controller", "write a time such as \"1 ms\""),
            Self::Delay { .. } => {
                Advice::at("delay", "this controller", "write a delay such as \"1 ms\", or a longer `sample_time`")
            }
            Self::SampledOverflow(_) => Advice::at("sample_time", "this controller", "choose a shorter `sample_time`"),
            Self::SampledOnly(_) => Advice::whole("add `sample_time = \"1 ms\"`, and the `delay`"),
            Self::SampledRiccati("observer") => {
                Advice::whole("add a sensor, estimate fewer torques, or choose other noises")
            }
            Self::SampledRiccati(_) => Advice::whole(
                "choose another sample time, a smaller bandwidth, larger acceptable errors, or a shorter `coasting_time`",
            ),
            Self::NeedsSampleTime(key) => {
                Advice::at(key, "this controller", &format!("add `sample_time = \"1 ms\"`, or remove `{key}`"))
            }
            Self::SchedulePoints(_) => Advice::whole("write a whole number, such as 16"),
            Self::NoSchedule(_) => {
                Advice::whole("write `schedule = 1`, or leave it out: the law is then designed straight ahead")
            }
            Self::NoShaft(name) => Advice::at(name, "no such shaft", "name shafts of the model in `disturbances`"),
            Self::Observer { sensors, error } => Advice::of(sensors, "measured here", observer_help(error)),
            Self::ObserverPoles => {
                Advice::at("observer", "this observer", "add `poles = [-50, -51, -52]`, or `method = \"kalman\"`")
            }
            Self::ObserverUnstable(_) => Advice::of(&[], "this observer", "choose poles with a negative real part"),
            Self::DoubleCancellation => Advice::whole(
                "set `plant = \"nonlinear\"`, `disturbances = []` or `compensation = 0` in the observer, or design the law on the linear \
                 model",
            ),
            Self::LawDoubleCancellation(_) => {
                Advice::whole("set `plant = \"linear\"` in the observer, or leave it out")
            }
            Self::IdleKey { key, .. } => Advice::whole(&format!("remove `{key}`, or change `method`")),
            Self::NoObserver(_) => Advice::whole("remove `observer`; a block estimates what is not measured"),
            Self::NotAShare(_) => Advice::whole("write a number from 0 to 1"),
        }
    }
}

fn compensation_help(error: &decoupling::CompensationError) -> String {
    match error {
        decoupling::CompensationError::Count { degree, .. } => {
            format!("give {degree} pole{}, or a frequency", if *degree == 1 { "" } else { "s" })
        }
        decoupling::CompensationError::NoConjugate { .. } => "write pairs: `\"-14 ± 14.3j\"`".into(),
        decoupling::CompensationError::NotStable { .. } => "choose poles with a negative real part".into(),
        decoupling::CompensationError::NotPositive { .. } => "choose a value above zero".into(),
    }
}

fn observer_help(error: &observer::ObserverError) -> &'static str {
    match error {
        observer::ObserverError::NotObservable { .. } | observer::ObserverError::NotDetectable { .. } => {
            "add a sensor, or estimate fewer torques: `disturbances = [...]`"
        }
        observer::ObserverError::WrongNumber { .. } => "give as many poles as the message states",
        observer::ObserverError::NotSelfConjugate { .. } => "write pairs: `\"-50 ± 10j\"`, for each sensor",
        _ => "choose other sensors, poles or noises",
    }
}
