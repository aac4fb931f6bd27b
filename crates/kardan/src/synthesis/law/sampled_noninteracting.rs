use std::sync::Arc;

use kardan_rt::Bounds;
use kardan_rt::functions::{atan2, ln, powf, powi};

use crate::analysis::OutputSignal;
use crate::element::Values;
use crate::equations::{InputKind, Measured, Motor};
use crate::names::{Quantity, SignalName};
use crate::num::{Matrix, rational_to_f64};
use crate::reduce::{Kinematics, MechanismData};
use crate::results::{
    ChannelResult, Complex, ControllerData, DataMatrix, DataNumber, Definition, Design, ObserverResult, Physical, Pole,
    ReadSignal,
};
use crate::schema::{Keys, LawKeys, Sign, keys};
use crate::synthesis::channels::{once, reference};
use crate::synthesis::counters::ReducedStates;
use crate::synthesis::decoupling::observable_quotient;
use crate::synthesis::observed::{Reading, distinguishable_torques, reading, rows, sensor_table, sensors};
use crate::synthesis::observer::{Noise, extend, kalman};
use crate::synthesis::outputs::{channels, paired_channels, paired_inputs};
use crate::synthesis::sampled::{
    GovernorData, PERIOD, Problem, RegulatorBlock, RegulatorData, ScheduleData, Solution, Target, filter, on_their_way,
    turning, zoh_plant,
};
use crate::synthesis::{
    Block, Clock, Law, LawKind, LinearLaw, Plant, Reference, Request, SynthesisError, clock, effective_inertia,
    reading_variance, rounded,
};
use crate::units::Dimension;

keys! {
    /// A channel of the law `sampled_noninteracting`.
    table SampledNoninteractingChannel {
        required {
            output: Output,
                "The output: the angle of a shaft, `<shaft>.phi`, its speed, `<shaft>.w`, or a sensor of a torque.";
            input: Element(&["motor"]), "The motor of this channel; any pairing gives the same law.";
            reference: Name, "Name of the reference signal, set by the scenario.";
        }
        optional {
            kind: Choice(&["position", "torque"]) = "position",
                "Of an angle: `position`: it follows a reference; `torque`: the reference is a torque that acts along \
                 it, in addition to external torques there, as if the shaft carried only its effective inertia. A speed, \
                 and a sensor of a torque, follow a reference.";
            bandwidth: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) = "30 rad/s",
                "Corner of the reference model, critically damped of second order.";
            acceptable_angle: Quantity(Dimension::ANGLE, Sign::Positive) = "0.01 rad",
                "Acceptable error of an angle; changes of torques are weighed against it.";
            acceptable_speed: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) = "0.3 rad/s",
                "Acceptable error of a speed.";
            acceptable_torque: Quantity(Dimension::TORQUE, Sign::Positive) = "0.02 N m",
                "Acceptable error of a torque.";
            torque_rate: Quantity(Dimension::TORQUE_RATE, Sign::Positive),
                "Acceptable rate of the motor's torque; left out: 80 times its torque limit in a second, 100 \
                 N m/s for a motor without a limit.";
            coasting_time: Quantity(Dimension::TIME, Sign::Positive) = "1 s",
                "Time constant with which a shaft under a torque channel comes to rest if nothing drives it. Its own \
                 damping is compensated up to that; errors of the model must not overcompensate it.";
        }
    }
}

law_keys! {
    /// Noninteracting control that is designed for its sample time, the delay and the motors: what is left of a decoupling is
    /// minimised, instead of the plant inverted.
    law SampledNoninteracting("sampled_noninteracting") {
        required {
            channels: Tables(SampledNoninteractingChannel), "One table for each output and its motor.";
        }
        optional {
            effort: Number(Sign::Positive) = "1",
                "Factor of all acceptable rates of torques: a larger one reduces the interaction and demands more of \
                 motors and model.";
            governor: Choice(&["on", "off"]),
                "Whether the law limits references that would drive a motor over its torque limit; left out: on.";
            schedule: Number(Sign::Positive),
                "Number of positions over half a turn of the joints at which the law is designed, from 1 to 256; it \
                 follows their position. 1: it is designed straight ahead only. Left out: 16 where a joint is bent, if \
                 its joints turn with one coordinate and no spring acts through them.";
        }
    }
}

/// Noninteracting control that is designed for its sample time, the delay and the motors: what is left of a decoupling is
/// minimised, instead of the plant inverted.
pub const SAMPLED_NONINTERACTING: LawKind = LawKind {
    keyword: SampledNoninteracting::KEYWORD,
    summary: "Noninteracting control designed for its sample time: the exactly sampled plant with delay and lag of the \
              motors, reference models, and a quadratic cost on the interaction itself, the residual between each \
              output and the ideal decoupled loop. Observer, torque limits and a reference governor are part of the law.",
    fields: SampledNoninteracting::FIELDS,
    example: "\
[control.column]
law = \"sampled_noninteracting\"
sample_time = \"1 ms\"
delay = \"1 ms\"

[[control.column.channels]]
output = \"rk.phi\"
input = \"rk_motor\"
kind = \"position\"
bandwidth = \"31 rad/s\"
reference = \"ref_rk\"

[[control.column.channels]]
output = \"fs.phi\"
input = \"wg_motor\"
kind = \"torque\"
bandwidth = \"31 rad/s\"
reference = \"u2\"

[control.column.observer]
sensors = [\"wg.phi\", \"cs.phi\", \"rk.phi\"]
disturbances = [\"rk\", \"fs\"]
",
    template: |inputs, outputs| {
        let channel =
            |output: &str, input: &str, reference| SampledNoninteractingChannel::new(output, input, reference);
        let channels = paired_channels(inputs, outputs, channel)?;
        Some(SampledNoninteracting::new(channels).sample_time("1 ms").delay("1 ms").entries())
    },
    inputs: paired_inputs,
    references,
    samples: true,
    design,
};

/// Acceptable rate of a torque over its limit, 1/s.
const RATE_OVER_LIMIT: f64 = 80.0;
/// Acceptable rate of a torque without a limit, N m/s.
const RATE: f64 = 100.0;
/// Share of a torque limit that the governor uses; the rest is a reserve for unpredicted torques.
const GOVERNED: f64 = 0.9;
/// Instants at which the governor predicts, and how far ahead, in time constants of the slowest reference model.
const INSTANTS: usize = 24;
/// Positions over half a turn of the joints at which the law is designed.
const POINTS: f64 = 16.0;
/// Relative difference of ratios that are the same but for rounding.
const SAME_RATIO: f64 = 1e-13;
/// The most of them.
const MOST_POINTS: f64 = 256.0;
/// See [`INSTANTS`].
const HORIZON: f64 = 4.0;

/// The controlled quantity of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Task {
    Position,
    Speed,
    /// A torque along a shaft, in addition to external torques there.
    Torque(usize),
    /// The net torque on a shaft's own inertia.
    NetTorque(usize),
    /// The reading of a torque sensor.
    Sensor,
}

/// The references: of an angle under a torque channel it is a torque.
fn references(values: &Values) -> Vec<Reference> {
    let torque = |channel: &Values| {
        let (name, output) = (channel.word("reference")?, channel.word("output")?);
        let description = format!("torque reference along {output}");
        Some(Reference { name: name.into(), physical: Physical::Torque, description })
    };
    let one = |channel: &Values| {
        let own = reference(channel)?;
        let is_torque = own.physical == Physical::Torque || channel.word("kind") == Some("torque");
        if is_torque { torque(channel) } else { Some(own) }
    };
    channels(values).filter_map(one).collect()
}

fn motor<'a>(plant: &'a Plant, name: &str) -> Option<&'a Motor> {
    let input = plant.reduced.equations.inputs.iter().find(|input| input.element == name)?;
    match &input.value {
        InputKind::Motor(motor) => Some(motor),
        InputKind::Disturbance => None,
    }
}

struct Sampled {
    name: String,
    clock: Clock,
    inputs: Vec<String>,
    references: Vec<Reference>,
    sensors: Vec<OutputSignal>,
    readings: Vec<Reading>,
    offsets: Vec<f64>,
    coordinates: Vec<usize>,
    shafts: usize,
    states: Vec<String>,
    /// Straight ahead.
    data: RegulatorData,
    schedule: Option<ScheduleData>,
    /// The shaft of each channel of a position.
    positions: Vec<Option<usize>>,
    kinematics: Kinematics,
    design: Design,
}

/// The specification of the law, at any position of the joints.
struct DesignSpec<'a> {
    inputs: &'a [String],
    tasks: &'a [Task],
    outputs: &'a [OutputSignal],
    lags: &'a [f64],
    changes: &'a [f64],
    bounds: &'a [Bounds<f64>],
    clock: Clock,
}

/// The design at one position.
struct Designed {
    problem: Problem,
    solution: Solution,
    observed: Observer,
    data: RegulatorData,
    definitions: Vec<Definition>,
}

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let (plant, values) = (request.plant, request.values);
    let Some(clock) = clock(values)? else {
        return Err(SynthesisError::SampledOnly { law: SAMPLED_NONINTERACTING.keyword });
    };
    let inputs = paired_inputs(values);
    let references = references(values);
    let (tasks, outputs) = tasks(plant, values)?;
    let names: Vec<String> = outputs.iter().map(|output| output.name.clone()).collect();
    once(names.iter().map(String::as_str), "output")?;
    once(inputs.iter().map(String::as_str), "input")?;
    once(references.iter().map(|r| r.name.as_str()), "reference")?;
    let limit = |input: &String| motor(plant, input)?.torque_limit.as_ref().map(|limit| limit.to_f64());
    let rate = |input: &String| motor(plant, input)?.rate_limit.as_ref().map(|rate| rate.to_f64());
    let lag = |input: &String| motor(plant, input).and_then(|motor| motor.lag.as_ref()).map_or(0.0, |lag| lag.to_f64());
    let lags: Vec<f64> = inputs.iter().map(lag).collect();
    let effort = values.number_or_default("effort");
    let changes: Vec<f64> = channels(values)
        .zip(&inputs)
        .map(|(channel, input)| {
            let otherwise = limit(input).map_or(RATE, |limit| RATE_OVER_LIMIT * limit);
            effort * channel.number("torque_rate").unwrap_or(otherwise) * clock.period
        })
        .collect();
    let torque_reserve = |input: &String| limit(input).map(|limit| limit - plant.trim_torque(input).abs());
    let bounds: Vec<Bounds<f64>> = inputs
        .iter()
        .map(|input| Bounds { torque: torque_reserve(input), change: rate(input).map(|rate| rate * clock.period) })
        .collect();
    let spec = DesignSpec {
        inputs: &inputs,
        tasks: &tasks,
        outputs: &outputs,
        lags: &lags,
        changes: &changes,
        bounds: &bounds,
        clock,
    };
    let follows = follows(request)?;
    let straight = designed(request, &spec, matches!(follows, Follows::Turns { .. }))?;
    let mut kinematics = Kinematics::new(&plant.reduced);
    let zero = vec![0.0; plant.reduced.degrees_of_freedom()];
    kinematics.update(&zero, &zero);
    let read = |one: &Reading| one.read(&kinematics.angles, &kinematics.speeds);
    let offsets: Vec<f64> = straight.observed.readings.iter().map(read).collect();
    let schedule = match &follows {
        Follows::Turns { coordinate, count } => {
            Some(schedule(request, &spec, &straight, *coordinate, *count, &offsets)?)
        }
        _ => None,
    };
    let mut design = describe(request, &straight, schedule.as_ref(), &inputs, &names, &references);
    if let Follows::Cannot(reason) = &follows {
        design.notes.push(format!(
            "the law is designed straight ahead and does not follow the position of its joints: {reason}"
        ));
    }
    let Designed { observed, data, .. } = straight;
    let zeros =
        observed.sensors.iter().zip(&offsets).map(|(sensor, x)| DataNumber::new(format!("{} offset", sensor.name), *x));
    design.controller_data.numbers.extend(zeros.chain([DataNumber::new("delay", clock.delay)]));
    let states = state_names(&observed, &spec, &references);
    Ok(Arc::new(Sampled {
        name: request.name.to_string(),
        clock,
        inputs,
        references,
        positions: tasks.iter().zip(&outputs).map(|(task, output)| position(task, output, plant)).collect(),
        kinematics,
        schedule,
        sensors: if observed.full { Vec::new() } else { observed.sensors },
        readings: observed.readings,
        offsets,
        coordinates: plant.reduced.coordinates.clone(),
        shafts: plant.coordinates().len(),
        states,
        data,
        design,
    }))
}

/// Names of the states: estimates, delayed commands, reference models, and values of the last sample.
fn state_names(observed: &Observer, spec: &DesignSpec<'_>, references: &[Reference]) -> Vec<String> {
    let DesignSpec { inputs, lags, clock, .. } = spec;
    let mut states: Vec<String> = observed.states.iter().map(|state| format!("estimate of {state}")).collect();
    states.extend(inputs.iter().zip(*lags).filter(|(_, lag)| **lag > 0.0).map(|(i, _)| format!("estimate of {i}.tau")));
    states.extend(observed.disturbances.iter().map(|shaft| format!("estimate of {shaft}.disturbance")));
    let past = on_their_way(*clock).max(1);
    states.extend((1..=past).flat_map(|k| inputs.iter().map(move |input| format!("{input} {k} samples before"))));
    states.extend(
        references.iter().flat_map(|r| [format!("model of {}", r.name), format!("rate of the model of {}", r.name)]),
    );
    states.extend(observed.sensors.iter().map(|sensor| format!("last {}", sensor.name)));
    states.extend(references.iter().map(|r| format!("governed {}", r.name)));
    states.extend(inputs.iter().map(|input| format!("command of {input}")));
    states
}

/// The shaft whose angle follows a reference.
fn position(task: &Task, output: &OutputSignal, plant: &Plant) -> Option<usize> {
    match (task, &output.measured) {
        (Task::Position, Measured::Angle(shaft)) => plant.reduced.coordinate(shaft),
        _ => None,
    }
}

/// Whether the law follows the position of its joints.
enum Follows {
    /// The law has no joint to follow, or the model file switches it off.
    Nothing,
    /// A joint is bent, but cannot be followed, for this reason.
    Cannot(String),
    /// This coordinate, at so many points.
    Turns { coordinate: usize, count: usize },
}

fn follows(request: &Request<'_>) -> Result<Follows, SynthesisError> {
    let setting = request.values.number("schedule");
    if let Some(points) = setting.filter(|points| points.fract() != 0.0 || !(1.0..=MOST_POINTS).contains(points)) {
        return Err(SynthesisError::SchedulePoints { points });
    }
    if request.plant.is_moved() {
        return match setting {
            Some(points) if points != 1.0 => {
                Err(SynthesisError::NoSchedule { reason: "it is designed at one operating point".into() })
            }
            _ => Ok(Follows::Nothing),
        };
    }
    let count = setting.unwrap_or(POINTS);
    if count == 1.0 || request.plant.is_constant() {
        return Ok(Follows::Nothing);
    }
    match turning(&request.plant.reduced) {
        Ok(coordinate) => Ok(Follows::Turns { coordinate, count: count as usize }),
        Err(reason) if setting.is_some() => Err(SynthesisError::NoSchedule { reason }),
        Err(reason) => Ok(Follows::Cannot(reason)),
    }
}

/// The same design at positions over half a turn. Where the joints have the ratios of a point before, its numbers are taken.
fn schedule(
    request: &Request<'_>,
    spec: &DesignSpec<'_>,
    straight: &Designed,
    coordinate: usize,
    count: usize,
    offsets: &[f64],
) -> Result<ScheduleData, SynthesisError> {
    let reduced = &request.plant.reduced;
    let (mut sensors, entries) = sensors(&straight.observed.readings);
    sensors.iter_mut().zip(offsets).for_each(|(sensor, offset)| sensor.rest += offset);
    let mechanism = MechanismData::new(reduced);
    let all = |points| ScheduleData { coordinate, points, mechanism, sensors, entries };
    if let Some(points) = request.plant.schedule_cache.of(request.values, request.disturbances) {
        return Ok(all(points));
    }
    let mut points = vec![straight.data.clone()];
    let mut ratios = vec![request.plant.linear.basis.to_f64()];
    for k in 1..count {
        let mut position = vec![0.0; reduced.degrees_of_freedom()];
        position[coordinate] = PERIOD * k as f64 / count as f64;
        let plant = Plant { elements: request.plant.elements.clone(), ..Plant::new(reduced.clone(), position) };
        let basis = plant.linear.basis.to_f64();
        let before = ratios.iter().position(|candidate| {
            candidate.as_slice().iter().zip(basis.as_slice()).all(|(x, y)| (x - y).abs() <= SAME_RATIO * y.abs())
        });
        points.push(match before {
            Some(before) => points[before].clone(),
            None => designed(&Request { plant: &plant, ..*request }, spec, true)?.data,
        });
        ratios.push(basis);
    }
    request.plant.schedule_cache.store(request.values, request.disturbances, &points);
    Ok(all(points))
}

/// The design at the position of the plant. `forces`: including the response of the law to forces on the coordinates that it gets as inputs.
fn designed(request: &Request<'_>, spec: &DesignSpec<'_>, forces: bool) -> Result<Designed, SynthesisError> {
    let (plant, values) = (request.plant, request.values);
    let DesignSpec { inputs, tasks, outputs, lags, clock, .. } = *spec;
    // What the channels do not see of the plant (the angle of a free wheel) is left out of the design.
    let shown = plant.system(inputs, outputs);
    let quotient = observable_quotient(&shown, &plant.twists());
    let external: &[usize] = if forces { &plant.reduced.coordinates } else { &[] };
    let disturbed = [request.disturbances, external].concat();
    let (torques, direct) = plant.torques(&disturbed, outputs);
    let (a, b, w) = (quotient.system.a.to_f64(), quotient.system.b.to_f64(), quotient.project(&torques).to_f64());
    let (c, d, f) = (quotient.system.c.to_f64(), quotient.system.d.to_f64(), direct.to_f64());
    let mut targets = Vec::new();
    for (k, (channel, task)) in channels(values).zip(tasks).enumerate() {
        let bandwidth = channel.number_or_default("bandwidth");
        let acceptable = match task {
            Task::Position => channel.number_or_default("acceptable_angle"),
            Task::Speed => channel.number_or_default("acceptable_speed"),
            _ => channel.number_or_default("acceptable_torque"),
        };
        let (mut on_state, mut on_torque, mut on_disturbance) =
            (c.row(k).to_vec(), d.row(k).to_vec(), f.row(k).to_vec());
        if let Task::Torque(shaft) | Task::NetTorque(shaft) = task {
            // J ÿ + J ẏ/T, less what acts on the shaft from outside, for the speed ẏ = c z.
            let inertia = rational_to_f64(&match task {
                Task::NetTorque(_) => plant.reduced.equations.own_inertia(*shaft),
                _ => effective_inertia(&plant.linear, *shaft),
            });
            let row = Matrix::from_fn(1, c.columns(), |_, j| c[(k, j)]);
            let coasting = channel.number_or_default("coasting_time");
            let acceleration = row.multiply(&a).plus(&row.scale(&(1.0 / coasting)));
            on_state = acceleration.scale(&inertia).row(0).to_vec();
            on_torque = row.multiply(&b).scale(&inertia).row(0).to_vec();
            on_disturbance = row.multiply(&w).scale(&inertia).row(0).to_vec();
            let outside = matches!(task, Task::Torque(_));
            for (share, disturbed) in on_disturbance.iter_mut().zip(request.disturbances) {
                *share -= f64::from(u8::from(outside && disturbed == shaft));
            }
        }
        if on_state.iter().chain(&on_torque).all(|x| *x == 0.0) {
            return Err(SynthesisError::Unreached { output: outputs[k].name.clone() });
        }
        targets.push(Target { on_state, on_torque, on_disturbance, acceptable, bandwidth });
    }
    let problem = Problem { a, b, w, lags: lags.to_vec(), targets, changes: spec.changes.to_vec(), clock };
    let solution = problem.solve().ok_or(SynthesisError::SampledRiccati { of: "feedback" })?;
    let lift = quotient.projection.to_f64();
    let observed = observer(request, inputs, lags, clock)?;
    let compensation = values.table("observer").and_then(|observer| observer.number("compensation")).unwrap_or(1.0);
    let force_input = pushed(request, external, inputs, lags, clock)?;
    let mut data = assemble(&problem, &solution, &lift, &observed, compensation, &force_input, spec.bounds)
        .ok_or(SynthesisError::TooLarge)?;
    if values.word("governor") != Some("off") {
        let responses = unit_torque_responses(request, tasks, inputs, lags, clock)?;
        data.governor = governor(&data, &problem, &responses);
    }
    Ok(Designed { problem, solution, observed, data, definitions: quotient.definitions })
}

/// The effect of a torque of 1 N m along each of these shafts, constant over a sample, on the plant's states, those of lagging motors
/// included.
fn pushed(
    request: &Request<'_>,
    shafts: &[usize],
    inputs: &[String],
    lags: &[f64],
    clock: Clock,
) -> Result<Matrix<f64>, SynthesisError> {
    let system = request.plant.system(inputs, &[]);
    let (torques, _) = request.plant.torques(shafts, &[]);
    let discrete = zoh_plant(&system.a.to_f64(), &system.b.to_f64(), &torques.to_f64(), lags, clock)
        .ok_or(SynthesisError::SampledOverflow { time: clock.period })?;
    let own = discrete.flow.rows() - shafts.len();
    Ok(Matrix::from_fn(own, shafts.len(), |i, j| discrete.state[(i, own + j)]))
}

/// The controlled quantity of each channel, with the output that shows it: for a torque along a shaft its speed.
fn tasks(plant: &Plant, values: &Values) -> Result<(Vec<Task>, Vec<OutputSignal>), SynthesisError> {
    let (mut tasks, mut outputs) = (Vec::new(), Vec::new());
    for channel in channels(values) {
        let output = plant.output(channel.word_or_default("output"))?;
        let torque = channel.word("kind") == Some("torque");
        let (task, output) = match &output.measured {
            Measured::Angle(shaft) if torque => {
                let number = plant.reduced.coordinate(shaft).expect("an output names a shaft");
                plant.check_accelerates(number, &output.name)?;
                (Task::Torque(number), OutputSignal { measured: Measured::Speed(shaft.clone()), ..output })
            }
            Measured::Angle(_) => (Task::Position, output),
            Measured::Speed(_) => (Task::Speed, output),
            Measured::NetTorque(shaft) => {
                let number = plant.reduced.coordinate(shaft).expect("a sensor names a shaft");
                (Task::NetTorque(number), OutputSignal { measured: Measured::Speed(shaft.clone()), ..output })
            }
            _ => (Task::Sensor, output),
        };
        let (idle, kind): (&[&'static str], _) = match task {
            Task::Position => (&["acceptable_speed", "acceptable_torque", "coasting_time"], "an angle"),
            Task::Speed => (&["acceptable_angle", "acceptable_torque", "coasting_time", "kind"], "a speed"),
            Task::Torque(_) => (&["acceptable_angle", "acceptable_speed"], "a torque"),
            Task::NetTorque(_) => (&["acceptable_angle", "acceptable_speed", "kind"], "a net torque"),
            Task::Sensor => {
                (&["acceptable_angle", "acceptable_speed", "coasting_time", "kind"], "the torque of a sensor")
            }
        };
        if let Some(key) = idle.iter().copied().find(|key| channel.has(key)) {
            return Err(SynthesisError::IdleChannelKey { output: output.name, kind, key });
        }
        tasks.push(task);
        outputs.push(output);
    }
    Ok((tasks, outputs))
}

/// The sampled plant that the observer follows, and how it corrects it.
struct Observer {
    /// Whether all angles and speeds are measured, without error.
    full: bool,
    /// Names of the plant's states.
    states: Vec<String>,
    disturbances: Vec<String>,
    sensors: Vec<OutputSignal>,
    readings: Vec<Reading>,
    /// `[x; τ of motors with a lag; d]⁺` over `[x; τ; d; past commands; command]`.
    prediction: Matrix<f64>,
    /// C over `[x; τ; d]`.
    output: Matrix<f64>,
    /// M
    correction: Matrix<f64>,
    result: Option<ObserverResult>,
}

/// The noise of states and sensors from the keys of an observer.
fn noise(keys: &Values, states: &[String], sensors: usize) -> Noise {
    let number = |key: &str, otherwise: f64| powi(keys.number(key).unwrap_or(otherwise), 2);
    let intensity = |name: &String| match SignalName::new(name) {
        name if name.is_position() => 0.0,
        name if name.is_rate() => number("speed_noise", 10.0),
        _ => number("disturbance_rate", 10.0),
    };
    Noise { process: states.iter().map(intensity).collect(), measurement: vec![number("sensor_noise", 1e-5); sensors] }
}

fn observer(request: &Request<'_>, inputs: &[String], lags: &[f64], clock: Clock) -> Result<Observer, SynthesisError> {
    let (plant, states) = (request.plant, request.plant.state_names());
    let disturbances: Vec<String> = request.disturbances.iter().map(|&k| plant.coordinates()[k].clone()).collect();
    let keys = request.values.table("observer");
    if let Some(share) = keys.and_then(|keys| keys.number("compensation")).filter(|share| *share > 1.0) {
        return Err(SynthesisError::NotAShare { share });
    }
    if keys.is_some_and(|keys| keys.has("poles") || keys.word("method") == Some("poles")) {
        return Err(SynthesisError::IdleKey { key: "poles", method: "kalman".into() });
    }
    let sensors: Vec<OutputSignal> = match keys.and_then(|keys| keys.names("sensors")) {
        Some(names) => names.iter().map(|name| plant.output(name)).collect::<Result<_, _>>()?,
        None => states.iter().map(|name| plant.output(name)).collect::<Result<_, _>>()?,
    };
    let readings: Vec<Reading> = sensors.iter().map(|sensor| reading(sensor, plant)).collect::<Result<_, _>>()?;
    let system = plant.system(inputs, &sensors);
    let (torques, _) = plant.torques(request.disturbances, &[]);
    let discrete = zoh_plant(&system.a.to_f64(), &system.b.to_f64(), &torques.to_f64(), lags, clock)
        .ok_or(SynthesisError::SampledOverflow { time: clock.period })?;
    let size = discrete.flow.rows();
    let c = system.c.to_f64();
    let output = Matrix::from_fn(c.rows(), size, |i, j| if j < c.columns() { c[(i, j)] } else { 0.0 });
    let out = Observer {
        full: true,
        disturbances,
        sensors,
        readings,
        correction: Matrix::from_fn(size, states.len(), |i, j| f64::from(u8::from(i == j))),
        states,
        prediction: discrete.state,
        output,
        result: None,
    };
    let Some(keys) = keys else { return Ok(out) };
    let names: Vec<String> = out.disturbances.iter().map(|name| Quantity::Disturbance.of(name)).collect();
    let extended = extend(&system, &torques, &names);
    // What the sensors show at all is decided exactly, straight ahead; elsewhere the Riccati equation of the filter must do.
    let noise = noise(keys, &extended.states, out.sensors.len());
    let failed = |error| SynthesisError::Observer { sensors: extended.outputs.clone(), error: Box::new(error) };
    let straight = plant.is_moved() || plant.point.position.iter().all(|angle| *angle == 0.0);
    if straight {
        kalman(&extended, &noise).map_err(failed)?;
    }
    let intensities: Vec<f64> = {
        let lagged = size - out.states.len() - names.len();
        let (plant, rest) = noise.process.split_at(out.states.len());
        plant.iter().copied().chain(std::iter::repeat_n(0.0, lagged)).chain(rest.iter().copied()).collect()
    };
    let variances: Vec<f64> = out
        .sensors
        .iter()
        .map(|sensor| reading_variance(plant, keys.number("sensor_noise"), sensor, clock.period))
        .collect();
    let found = filter(&discrete.flow, &out.output, &intensities, &variances, clock.period)
        .ok_or(SynthesisError::SampledRiccati { of: "observer" })?;
    let out = Observer { full: false, correction: found.gain, ..out };
    if !straight {
        return Ok(out);
    }
    let lagged = inputs.iter().zip(lags).filter(|(_, lag)| **lag > 0.0).map(|(input, _)| plant.effort_of(input).signal);
    let all: Vec<String> = out.states.iter().cloned().chain(lagged).chain(names).collect();
    let mut sentences = distinguishable_torques(plant, &system, &ReducedStates::all(system.states.len()))?;
    sentences.push(format!("the relative residual of the Riccati equation of the filter is {:.1e}", found.residual));
    let title = ("observer_gain", "observer gain M of x <- x + M (y - C x)", "");
    let result = ObserverResult {
        sensors: extended.outputs.clone(),
        disturbances: out.disturbances.clone(),
        poles: found.multipliers.iter().map(|z| as_pole(*z, clock.period)).collect(),
        method: "kalman".into(),
        gain: rounded(title, &all, &extended.outputs, &out.correction),
        states: all,
        distinguishable: sentences,
    };
    Ok(Observer { result: Some(result), ..out })
}

/// The pole in continuous time of a multiplier per sample, 1/s.
fn as_pole(multiplier: Complex, period: f64) -> Pole {
    Pole::new(ln(multiplier.abs()) / period, atan2(multiplier.im, multiplier.re) / period)
}

/// The block's matrices from feedback, observer and reference models.
fn assemble(
    problem: &Problem,
    solution: &Solution,
    lift: &Matrix<f64>,
    observed: &Observer,
    compensation: f64,
    pushed: &Matrix<f64>,
    bounds: &[Bounds<f64>],
) -> Option<RegulatorData> {
    let (m, c) = (problem.b.columns(), problem.targets.len());
    let states = lift.columns();
    let lagged = solution.on_lagged.columns();
    let disturbances = observed.disturbances.len();
    let own = states + lagged + disturbances;
    let past = solution.on_past.columns();
    let n = own + past;
    let on_state = solution.on_state.multiply(lift);
    let mut prediction = Matrix::zeros(n, n);
    let mut input = Matrix::zeros(n, m);
    for i in 0..own {
        (0..n).for_each(|j| prediction[(i, j)] = observed.prediction[(i, j)]);
        (0..m).for_each(|j| input[(i, j)] = observed.prediction[(i, n + j)]);
    }
    for i in 0..past {
        if i < m {
            input[(own + i, i)] = 1.0;
        } else {
            prediction[(own + i, own + i - m)] = 1.0;
        }
    }
    let p = observed.output.rows();
    let output = Matrix::from_fn(p, n, |i, j| if j < own { observed.output[(i, j)] } else { 0.0 });
    let correction = Matrix::from_fn(n, p, |i, j| if i < own { observed.correction[(i, j)] } else { 0.0 });
    let (model, model_input) = problem.models()?;
    let feedback = Matrix::from_fn(m, n + 3 * c, |i, j| match j {
        j if j < states => on_state[(i, j)],
        j if j < states + lagged => solution.on_lagged[(i, j - states)],
        j if j < own => compensation * solution.on_disturbance[(i, j - states - lagged)],
        j if j < n => solution.on_past[(i, j - own)],
        j if j < n + 2 * c => solution.on_model[(i, j - n)],
        j => solution.on_reference[(i, j - n - 2 * c)],
    });
    let forces = pushed.columns();
    Some(RegulatorData {
        prediction,
        input,
        output,
        correction,
        model,
        model_input,
        feedback,
        bounds: bounds.to_vec(),
        governor: None,
        on_forces: Matrix::from_fn(m, forces, |i, j| solution.on_disturbance[(i, disturbances + j)]),
        force_input: Matrix::from_fn(n, forces, |i, j| if i < pushed.rows() { pushed[(i, j)] } else { 0.0 }),
    })
}

/// Channels of torques whose shaft carries no estimated disturbance, each with the effect of a torque of 1 N m along it on the
/// plant's states in one sample.
fn unit_torque_responses(
    request: &Request<'_>,
    tasks: &[Task],
    inputs: &[String],
    lags: &[f64],
    clock: Clock,
) -> Result<Vec<(usize, Vec<f64>)>, SynthesisError> {
    let column =
        |shaft: usize| Ok::<_, SynthesisError>(pushed(request, &[shaft], inputs, lags, clock)?.as_slice().to_vec());
    let unknown = tasks.iter().enumerate().filter_map(|(k, task)| match task {
        Task::Torque(shaft) if !request.disturbances.contains(shaft) => Some((k, *shaft)),
        _ => None,
    });
    unknown.map(|(k, shaft)| Ok((k, column(shaft)?))).collect()
}

/// Predicted commands for constant references, at instants that lie the closer the sooner; `None` without limits.
///
/// An external torque (the driver's hands) balances a shaft under a torque channel: where the law has no estimate of it, its torque
/// on the shaft is taken as balanced. A freely accelerating shaft would seem to need ever more torque.
fn governor(data: &RegulatorData, problem: &Problem, responses: &[(usize, Vec<f64>)]) -> Option<GovernorData> {
    let [n, k, r, _, m] = data.sizes();
    let limited: Vec<(usize, f64)> =
        data.bounds.iter().enumerate().filter_map(|(i, bounds)| Some((i, bounds.torque?))).collect();
    if limited.is_empty() {
        return None;
    }
    let size = n + k + r;
    let slowest = problem.targets.iter().map(|target| target.bandwidth).fold(f64::INFINITY, f64::min);
    let horizon = (HORIZON / (slowest * problem.clock.period)).ceil().max(1.0);
    let mut instants: Vec<usize> =
        (0..INSTANTS).map(|i| (powf(horizon, i as f64 / (INSTANTS - 1) as f64)).round() as usize - 1).collect();
    instants.dedup();
    // [x̂; ξ; r]⁺ with u = −K [x̂; ξ; r].
    let mut closed = Matrix::zeros(size, size);
    for i in 0..n {
        for j in 0..size {
            let fed: f64 = (0..m).map(|l| data.input[(i, l)] * data.feedback[(l, j)]).sum();
            closed[(i, j)] = if j < n { data.prediction[(i, j)] - fed } else { -fed };
        }
    }
    for i in 0..k {
        (0..k).for_each(|j| closed[(n + i, n + j)] = data.model[(i, j)]);
        (0..r).for_each(|j| closed[(n + i, n + k + j)] = data.model_input[(i, j)]);
    }
    (0..r).for_each(|i| closed[(n + k + i, n + k + i)] = 1.0);
    for (channel, torque) in responses {
        torque.iter().enumerate().for_each(|(i, x)| closed[(i, n + 2 * channel)] -= x);
    }
    // Squares of it, as far as they are needed: a slow reference model takes millions of samples.
    let mut squares = vec![closed];
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut bounds = Vec::new();
    let mut now = data.feedback.scale(&-1.0);
    let mut instant = 0;
    for &at in &instants {
        let samples = at - instant;
        for bit in (0..usize::BITS as usize).take_while(|bit| samples >> bit > 0) {
            if bit == squares.len() {
                squares.push(squares[bit - 1].multiply(&squares[bit - 1]));
            }
            if samples >> bit & 1 == 1 {
                now = now.multiply(&squares[bit]);
            }
        }
        instant = at;
        for &(motor, limit) in &limited {
            rows.push(now.row(motor).to_vec());
            bounds.push(GOVERNED * limit);
        }
    }
    Some(GovernorData { prediction: Matrix::from_fn(rows.len(), size, |i, j| rows[i][j]), bounds })
}

/// The numbers of the block for a file.
fn controller_data(
    straight: &Designed,
    schedule: Option<&ScheduleData>,
    inputs: &[String],
    references: &[Reference],
) -> ControllerData {
    let Designed { problem, observed, data, .. } = straight;
    let clock = problem.clock;
    let sensors =
        observed.sensors.iter().map(|sensor| ReadSignal::new(&sensor.name, SignalName::new(&sensor.name).unit()));
    let reads = sensors.chain(references.iter().map(|r| ReadSignal::new(&r.name, r.physical.unit())));
    let named = |(name, matrix): (&str, &Matrix<f64>)| (name.to_string(), matrix.to_rows());
    let models = [("model", &data.model), ("model_input", &data.model_input)];
    let mut matrices: Vec<(String, Vec<Vec<f64>>)> = match schedule {
        Some(schedule) => {
            let shape = |(name, rows, columns): (&str, usize, usize)| {
                (format!("shape of {name}"), vec![vec![rows as f64, columns as f64]])
            };
            let entries = schedule.entries.iter().map(|(shaft, x)| vec![*shaft as f64, *x]).collect();
            let own = [
                ("schedule".to_string(), schedule.rows()),
                ("sensors".into(), sensor_table(&schedule.sensors)),
                ("sensor_entries".into(), entries),
            ];
            let of_points = own.into_iter().chain(schedule.layout().into_iter().map(shape));
            models.map(named).into_iter().chain(of_points).chain(schedule.mechanism.tables(|x| x)).collect()
        }
        None => {
            let [model, model_input] = models;
            let [prediction, input, output] =
                [("prediction", &data.prediction), ("input", &data.input), ("output", &data.output)];
            let (correction, feedback) = (("correction", &data.correction), ("feedback", &data.feedback));
            [prediction, input, output, correction, model, model_input, feedback].map(named).to_vec()
        }
    };
    if let Some(governor) = &data.governor {
        if schedule.is_none() {
            matrices.push(("governor".into(), governor.prediction.to_rows()));
        }
        matrices.push(("governor_bounds".into(), governor.bounds.iter().map(|x| vec![*x]).collect()));
    }
    let mut numbers = Vec::new();
    for (input, bounds) in inputs.iter().zip(&data.bounds) {
        numbers.extend(bounds.torque.map(|torque| DataNumber::new(format!("{input} torque_limit"), torque)));
        numbers.extend(bounds.change.map(|change| DataNumber::new(format!("{input} change_limit"), change)));
    }
    if let Some(schedule) = schedule {
        numbers.push(DataNumber::new("shafts", schedule.mechanism.shafts.len() as f64));
        numbers.push(DataNumber::new("schedule_coordinate", schedule.coordinate as f64));
        numbers.push(DataNumber::new("schedule_period", PERIOD));
    }
    ControllerData {
        block: if schedule.is_some() { "ScheduledRegulator" } else { "Regulator" }.into(),
        reads: reads.collect(),
        writes: inputs.to_vec(),
        sample_time: Some(clock.period),
        single: clock.single,
        matrices: matrices.into_iter().map(|(name, rows)| DataMatrix::new(name, rows)).collect(),
        numbers,
    }
}

/// Notes on the design.
fn notes(
    request: &Request<'_>,
    straight: &Designed,
    schedule: Option<&ScheduleData>,
    outputs: &[String],
) -> Vec<String> {
    let Designed { problem, solution, observed, .. } = straight;
    let clock = problem.clock;
    let mut notes = vec![format!(
        "designed for a sample time of {} s and a delay of {} s; the relative residual of the \
         Riccati equation of the feedback is {:.1e}",
        clock.period, clock.delay, solution.regulator.residual
    )];
    for (output, target) in outputs.iter().zip(&problem.targets) {
        notes.push(format!("reference model of {output}: critically damped, {} rad/s", target.bandwidth));
    }
    if let Some(schedule) = schedule {
        let coordinate = &request.plant.linear.coordinates[schedule.coordinate];
        notes.push(format!(
            "its numbers follow the estimated {coordinate}.phi through {} positions over half a turn, linear between \
             them (the feedback then differs from a design there by about {:.1e} of the motor's largest gain); \
             readings and velocity-dependent forces are those at the actual joint position",
            schedule.points.len(),
            schedule.interpolation_error()
        ));
        notes.push(format!(
            "the listed gains, observer, sampled loop, margins and tolerances are those at {coordinate}.phi = 0; \
             kardan evaluates the loop at other positions one by one, each at rest there, which is no proof for a \
             rotating column"
        ));
    }
    if observed.result.is_none() {
        notes.push(
            "without an observer all angles and speeds are taken as measured, and no disturbance is known".into(),
        );
    }
    notes
}

fn describe(
    request: &Request<'_>,
    straight: &Designed,
    schedule: Option<&ScheduleData>,
    inputs: &[String],
    outputs: &[String],
    references: &[Reference],
) -> Design {
    let Designed { problem, observed, data, definitions, .. } = straight;
    let clock = problem.clock;
    let past: Vec<String> = (1..=on_their_way(clock).max(1))
        .flat_map(|k| inputs.iter().map(move |input| format!("{input} {k} before")))
        .collect();
    let lagged: Vec<String> = inputs
        .iter()
        .zip(&problem.lags)
        .filter(|(_, lag)| **lag > 0.0)
        .map(|(i, _)| request.plant.effort_of(i).signal)
        .collect();
    let disturbed: Vec<String> = observed.disturbances.iter().map(|shaft| Quantity::Disturbance.of(shaft)).collect();
    let reference_names: Vec<String> = references.iter().map(|r| r.name.clone()).collect();
    let models: Vec<String> =
        reference_names.iter().flat_map(|name| [format!("{name} model"), format!("{name} model rate")]).collect();
    let columns: Vec<String> =
        [observed.states.clone(), lagged, disturbed, past, models, reference_names.clone()].concat();
    let controller_data = controller_data(straight, schedule, inputs, references);
    let notes = notes(request, straight, schedule, outputs);
    let channel = |(k, (output, target)): (usize, (&String, &Target))| {
        let w = target.bandwidth;
        ChannelResult {
            output: output.clone(),
            reference: reference_names[k].clone(),
            kind: match references[k].physical {
                Physical::Angle | Physical::Position => "position",
                Physical::Speed | Physical::Velocity => "speed",
                Physical::Force => "force",
                _ => "torque",
            }
            .into(),
            transfer: format!("ideally {}/(s^2 + {} s + {})", w * w, 2.0 * w, w * w),
            poles: vec![Pole::new(-w, 0.0); 2],
        }
    };
    Design {
        controller: request.name.into(),
        channels: outputs.iter().zip(&problem.targets).enumerate().map(channel).collect(),
        law: SAMPLED_NONINTERACTING.keyword.into(),
        design_model: match schedule {
            Some(schedule) => format!(
                "linear, at {} positions of {}.phi, sampled at {} s",
                schedule.points.len(),
                request.plant.linear.coordinates[schedule.coordinate],
                clock.period
            ),
            None => format!("{}, sampled at {} s", request.plant.linear_where(), clock.period),
        },
        states: observed.states.clone(),
        inputs: inputs.to_vec(),
        outputs: outputs.to_vec(),
        definitions: definitions.clone(),
        gains: vec![rounded(
            ("K", "gain K of u = -K [estimate; reference model; references]", ""),
            inputs,
            &columns,
            &data.feedback,
        )],
        observer: observed.result.clone(),
        controller_data,
        notes,
        ..Design::default()
    }
}

impl Sampled {
    /// x̂, ξ, last readings, governed references, commands: where each begins.
    fn places(&self) -> [usize; 5] {
        let [n, k, r, p, _] = self.data.sizes();
        [0, n, n + k, n + k + p, n + k + p + r]
    }

    /// The linear part with these numbers.
    fn linear_of(&self, data: &RegulatorData) -> LinearLaw {
        let RegulatorData { prediction, input, output, correction, model, model_input, feedback, .. } = data;
        let [n, k, r, p, m] = self.data.sizes();
        let size = self.states.len();
        let [_, models, readings, governed, _] = self.places();
        let [angles, speeds] = rows(&self.readings, self.shafts);
        // x̂ after the correction: (I − M C) x̂ + M y.
        let uncorrected = Matrix::identity(n).plus(&correction.multiply(output).scale(&-1.0));
        let on_estimate = Matrix::from_fn(m, n, |i, j| -feedback[(i, j)]);
        let on_states = on_estimate.multiply(&uncorrected);
        let on_readings = on_estimate.multiply(correction);
        let command = Matrix::from_fn(m, size, |i, j| match j {
            j if j < n => on_states[(i, j)],
            j if (models..models + k).contains(&j) => -feedback[(i, n + j - models)],
            _ => 0.0,
        });
        let next_of = |corrected: &Matrix<f64>, commanded: &Matrix<f64>| {
            prediction.multiply(corrected).plus(&input.multiply(commanded))
        };
        let corrected = Matrix::from_fn(n, size, |i, j| if j < n { uncorrected[(i, j)] } else { 0.0 });
        let (next_estimate, next_from_readings) = (next_of(&corrected, &command), next_of(correction, &on_readings));
        let last_command = self.places()[4];
        let states = Matrix::from_fn(size, size, |i, j| match i {
            i if i < n => next_estimate[(i, j)],
            i if (models..models + k).contains(&i) && (models..models + k).contains(&j) => {
                model[(i - models, j - models)]
            }
            i if i >= last_command => command[(i - last_command, j)],
            _ => 0.0,
        });
        let from_readings = Matrix::from_fn(size, p, |i, j| match i {
            i if i < n => next_from_readings[(i, j)],
            i if (readings..readings + p).contains(&i) => f64::from(u8::from(i - readings == j)),
            i if i >= last_command => on_readings[(i - last_command, j)],
            _ => 0.0,
        });
        LinearLaw {
            states,
            angles: from_readings.multiply(&angles),
            speeds: from_readings.multiply(&speeds),
            disturbances: Matrix::zeros(size, 0),
            torques: Matrix::zeros(size, m),
            on_states: command,
            on_angles: on_readings.multiply(&angles),
            on_speeds: on_readings.multiply(&speeds),
            on_disturbances: Matrix::zeros(m, 0),
            references: Matrix::from_fn(size, r, |i, j| match i {
                i if i < n => (0..m).map(|l| -input[(i, l)] * feedback[(l, n + k + j)]).sum(),
                i if (models..models + k).contains(&i) => model_input[(i - models, j)],
                i if (governed..governed + r).contains(&i) => f64::from(u8::from(i - governed == j)),
                i if i >= last_command => -feedback[(i - last_command, n + k + j)],
                _ => 0.0,
            }),
            on_references: Matrix::from_fn(m, r, |i, j| -feedback[(i, n + k + j)]),
            // Without sensors of its own the law reads true angles and speeds.
            errors: if self.sensors.is_empty() { Matrix::zeros(size, 0) } else { from_readings.clone() },
            on_errors: if self.sensors.is_empty() { Matrix::zeros(m, 0) } else { on_readings.clone() },
            flowing: false,
        }
    }
}

impl Law for Sampled {
    fn inputs(&self) -> &[String] {
        &self.inputs
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn sensors(&self) -> &[OutputSignal] {
        &self.sensors
    }

    fn clock(&self) -> Option<Clock> {
        Some(self.clock)
    }

    fn states(&self) -> Vec<String> {
        self.states.clone()
    }

    fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (state, &shaft) in out.iter_mut().zip(&self.coordinates) {
            *state = angles[shaft];
        }
        let [_, models, readings, governed, _] = self.places();
        // Reference models begin at the values of their outputs.
        for (k, shaft) in self.positions.iter().enumerate() {
            if let Some(shaft) = *shaft {
                (out[models + 2 * k], out[models + 2 * k + 1]) = (angles[shaft], speeds[shaft]);
                out[governed + k] = angles[shaft];
            }
        }
        for (k, reading) in self.readings.iter().enumerate() {
            out[readings + k] = reading.read(angles, speeds) - self.offsets[k];
        }
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        let clock = clock.filter(|clock| clock.period == self.clock.period)?;
        let (data, schedule) = (&self.data, self.schedule.as_ref());
        Some(match clock.single {
            true => Box::new(RegulatorBlock::<f32>::new(data, schedule, &self.readings, &self.offsets)),
            false => Box::new(RegulatorBlock::<f64>::new(data, schedule, &self.readings, &self.offsets)),
        })
    }

    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        (clock.period == self.clock.period).then(|| self.linear())
    }

    fn linear(&self) -> LinearLaw {
        self.linear_of(&self.data)
    }

    fn is_nonlinear(&self) -> bool {
        self.schedule.is_some()
    }

    fn linear_at(&self, position: &[f64], _: Option<Clock>) -> Option<LinearLaw> {
        let Some(schedule) = &self.schedule else { return Some(self.linear()) };
        let mut data = schedule.at(position[schedule.coordinate])?;
        // What the block expects of the readings is exact between the points too.
        let (mut kinematics, r) = (self.kinematics.clone(), self.coordinates.len());
        kinematics.update(position, &vec![0.0; r]);
        let basis = Matrix::from_fn(self.shafts, r, |i, j| kinematics.basis[i * r + j]);
        let [angles, speeds] = rows(&self.readings, self.shafts).map(|of| of.multiply(&basis));
        data.output = Matrix::from_fn(data.output.rows(), data.output.columns(), |i, j| match j {
            j if j < r => angles[(i, j)],
            j if j < 2 * r => speeds[(i, j - r)],
            _ => 0.0,
        });
        Some(self.linear_of(&data))
    }

    fn describe(&self) -> Design {
        Design { controller: self.name.clone(), ..self.design.clone() }
    }
}
