//! Frequency and step responses of the loop of a controller, and its largest singular values.

use faer::{Mat, c64};
use kardan_rt::functions::ln;

use super::channels::{named_multiloop, row_of, sensor_rows};
use super::survey::searches;
use crate::study::PreparedVariant;
use crate::study::loops::loop_blocks;
use kardan_math::num::{multiply, rational_to_f64};
use kardan_results::signal_name::SignalName;
use kardan_results::{
    Design, LargestSingularValue, LoopFunction, LoopGain, LoopResponses, ReferenceResponse, SingularValues,
    StepResponse, StepSignal,
};
use kardan_synthesis::margins::{Response, frequency_range, refined};
use kardan_synthesis::{ControlLoop, Law, Plant, Readings, SampledLoop, SampledPart};

/// Loop gains below this count as zero.
const NOTHING: f64 = 1e-12;
/// Largest number of readings whose simultaneous errors are analysed; more take long.
const MOST_MULTILOOP: usize = 4;
/// Number of times of a step response.
const TIMES: usize = 400;
/// Length of a step response at first, in time constants of the slowest motion.
const FOLLOWED: f64 = 8.0;
/// Fraction of its range within which a signal counts as settled.
const AT_REST: f64 = 0.005;
/// Least fraction of the plotted time by which all signals have settled.
const SETTLED: f64 = 0.4;
/// Factor of the settling time that is plotted, if all signals settle earlier.
const SHOWN: f64 = 2.2;
/// Number of trials with a shorter time.
const TRIES: usize = 8;

/// The inputs and outputs of a loop for its responses.
struct Views {
    motors: Response,
    readings: Option<Readings>,
    /// From the references to the outputs that are signals.
    references: Option<Response>,
}

/// The outputs of a law that are signals of the linear model, with their rows over `[q_r; q̇_r]`.
struct Outputs {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Outputs {
    fn of(model: &Plant, law: &dyn Law, design: &Design) -> Self {
        let is_output = |name: &String| {
            let head = SignalName::new(name).element;
            let shaft = model.coordinates().iter().any(|one| one == head);
            shaft || model.reduced.equations.sensors.iter().any(|(sensor, _)| sensor == head)
        };
        let signals = design.outputs.iter().filter(|name| is_output(name)).filter_map(|name| model.output(name).ok());
        let (names, rows) = signals
            .map(|signal| {
                let row = row_of(model, law, &signal).iter().map(rational_to_f64).collect();
                (signal.name.clone(), row)
            })
            .unzip();
        Self { names, rows }
    }
}

/// The responses of a controller's loop; the reason if there are none.
pub(in crate::study) fn responses(
    variant: &PreparedVariant,
    number: usize,
    design: &Design,
) -> Result<LoopResponses, String> {
    let laws = &variant.implemented;
    let plant = variant.loop_plant();
    let parts = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    let blocks = loop_blocks::blocks(variant, &plant).of_loop;
    let parts = if searches(&blocks, laws[number].clock()) { blocks.join(parts) } else { parts };
    let (law, model) = (&*laws[number], &*variant.whole_model(number));
    let view = ControlLoop { plant: &plant, parts: &parts, number };
    let motors = view.motors().ok_or(
        "controllers and sensors have several sample times (or none in common with this one), or a number overflows; \
         the margins of its motors are searched over the common period of all clocks",
    )?;
    let outputs = Outputs::of(model, law, design);
    let views = Views {
        readings: view
            .readings(&sensor_rows(model, law), &model.motion_names())
            .filter(|found| !found.names.is_empty()),
        references: view.references(&outputs.rows).filter(|_| !outputs.rows.is_empty() && !law.references().is_empty()),
        motors,
    };
    let stable = design.margins.as_ref().and_then(|margins| margins.stable) == Some(true);
    let points = views.points();
    let steps = if stable { steps(&view, law, &outputs, variant.scenario.duration) } else { Vec::new() };
    let is_small = |found: &&Readings| stable && found.names.len() <= MOST_MULTILOOP;
    let readings = views.readings.as_ref().filter(is_small);
    Ok(LoopResponses {
        sensors_multiloop: readings.and_then(|found| named_multiloop(&found.loops, &found.names)),
        frequencies: points.iter().map(|(frequency, _)| *frequency).collect(),
        nyquist: views.motors.nyquist(),
        loops: views.loops(law, &points),
        sensitivities: if stable { views.sensitivities(&points) } else { Vec::new() },
        references: from_references(law, &outputs.names, design, &points),
        steps,
        margins_over_position: None,
    })
}

/// All responses at one frequency.
struct FrequencyPoint {
    motors: Mat<c64>,
    readings: Option<Mat<c64>>,
    commands: Option<Mat<c64>>,
    references: Option<Mat<c64>>,
}

impl FrequencyPoint {
    /// Curves to draw, and the distance of the loops from −1.
    fn curves(&self) -> Vec<c64> {
        let mut curves = Vec::new();
        for m in std::iter::once(&self.motors).chain(&self.readings) {
            (0..m.nrows()).for_each(|k| curves.extend([gain(m[(k, k)]), 1.0 + m[(k, k)]]));
        }
        if let Some(m) = &self.references {
            curves.extend((0..m.nrows()).flat_map(|i| (0..m.ncols()).map(move |j| m[(i, j)])));
        }
        curves
    }
}

impl Views {
    /// All responses at frequencies that resolve them well.
    fn points(&self) -> Vec<(f64, FrequencyPoint)> {
        let poles = self.motors.pole_frequencies();
        // Next to a lightly damped pole as well.
        let places: Vec<f64> =
            poles.iter().flat_map(|pole| [0.9, 0.98, 1.0, 1.02, 1.1].map(|factor| factor * pole)).collect();
        let evaluate = |frequency: f64| FrequencyPoint {
            motors: self.motors.at_frequency(frequency),
            readings: self.readings.as_ref().map(|found| found.loops.at_frequency(frequency)),
            commands: self.readings.as_ref().map(|found| found.commands.at_frequency(frequency)),
            references: self.references.as_ref().map(|found| found.at_frequency(frequency)),
        };
        refined(frequency_range(&self.motors), &places, &evaluate, &FrequencyPoint::curves)
    }

    /// The loop gains, broken at each motor and at each reading.
    fn loops(&self, law: &dyn Law, points: &[(f64, FrequencyPoint)]) -> Vec<LoopGain> {
        let motors: Vec<&Mat<c64>> = points.iter().map(|(_, point)| &point.motors).collect();
        let mut out = broken(&self.motors, law.inputs(), false, &motors);
        if let Some(found) = &self.readings {
            let readings: Vec<&Mat<c64>> = points.iter().filter_map(|(_, point)| point.readings.as_ref()).collect();
            out.extend(broken(&found.loops, &found.names, true, &readings));
        }
        out
    }

    /// S and T at the motors and at the readings, and K S between them.
    fn sensitivities(&self, points: &[(f64, FrequencyPoint)]) -> Vec<SingularValues> {
        let motors = |one: &FrequencyPoint| Some(one.motors.clone());
        let about = |function, readings| SingularValues { function, at_sensors: readings, ..SingularValues::default() };
        let mut out = vec![
            singular(&self.motors.sensitivity(), about(LoopFunction::S, false), points, &|one| {
                motors(one).map(sensitivity)
            }),
            singular(&self.motors.complementary(), about(LoopFunction::T, false), points, &motors),
        ];
        if let Some(found) = &self.readings {
            let units: Vec<&str> = found.names.iter().map(|name| SignalName::new(name).unit()).collect();
            let mixed = units.iter().any(|unit| *unit != units[0]);
            let unit = if mixed { String::new() } else { quotient("N m", units[0]) };
            let about = |function| SingularValues { mixed, ..about(function, true) };
            let (loops, commands) = (&found.loops, SingularValues { unit, ..about(LoopFunction::Ks) });
            let readings = |one: &FrequencyPoint| one.readings.clone();
            out.extend([
                singular(&loops.sensitivity(), about(LoopFunction::S), points, &|one| readings(one).map(sensitivity)),
                singular(&loops.complementary(), about(LoopFunction::T), points, &readings),
                singular(&found.commands, commands, points, &|one| one.commands.clone()),
            ]);
        }
        out
    }
}

/// I + M.
fn sensitivity(mut m: Mat<c64>) -> Mat<c64> {
    (0..m.nrows()).for_each(|k| m[(k, k)] += 1.0);
    m
}

/// The singular values of a response, and the largest of all frequencies.
fn singular(
    response: &Response,
    about: SingularValues,
    points: &[(f64, FrequencyPoint)],
    of: &dyn Fn(&FrequencyPoint) -> Option<Mat<c64>>,
) -> SingularValues {
    let largest = response.largest_gain().map(|found| LargestSingularValue {
        value: found.value,
        frequency: Some(found.frequency).filter(|frequency| frequency.is_finite()),
    });
    let values = points.iter().map(|(_, point)| of(point).and_then(|m| m.singular_values().ok()).unwrap_or_default());
    SingularValues { largest, values: values.collect(), ..about }
}

/// From each reference to each output.
fn from_references(
    law: &dyn Law,
    outputs: &[String],
    design: &Design,
    points: &[(f64, FrequencyPoint)],
) -> Vec<ReferenceResponse> {
    let all: Vec<&Mat<c64>> = points.iter().filter_map(|(_, point)| point.references.as_ref()).collect();
    let mut out = Vec::new();
    for (j, reference) in law.references().iter().enumerate().filter(|_| !all.is_empty()) {
        for (i, output) in outputs.iter().enumerate() {
            let channel = design.channels.iter().find(|channel| channel.reference == reference.name);
            out.push(ReferenceResponse {
                reference: reference.name.clone(),
                output: output.clone(),
                unit: quotient(SignalName::new(output).unit(), reference.physical.unit()),
                same_channel: channel.is_some_and(|channel| channel.output == *output),
                real: all.iter().map(|m| m[(i, j)].re).collect(),
                imaginary: all.iter().map(|m| m[(i, j)].im).collect(),
            });
        }
    }
    out
}

/// The loop gains of a response, broken at each of its channels alone, from the matrix at each frequency.
fn broken(response: &Response, names: &[String], reading: bool, all: &[&Mat<c64>]) -> Vec<LoopGain> {
    let one = |(k, name): (usize, &String)| {
        let gains: Vec<c64> = all.iter().map(|m| gain(m[(k, k)])).collect();
        LoopGain {
            name: name.clone(),
            is_sensor: reading,
            open: all.iter().all(|m| m[(k, k)].norm_sqr() < NOTHING * NOTHING),
            unstable_poles: response.channel(k).feedback_transform().and_then(|broken| broken.unstable_poles()),
            real: gains.iter().map(|gain| gain.re).collect(),
            imaginary: gains.iter().map(|gain| gain.im).collect(),
        }
    };
    names.iter().enumerate().map(one).collect()
}

/// L of one channel, from the closed-loop response to errors.
fn gain(m: c64) -> c64 {
    -m / (1.0 + m)
}

/// The unit of a quotient; empty if both are equal.
fn quotient(above: &str, below: &str) -> String {
    match (above, below) {
        (above, below) if above == below => String::new(),
        (above, below) if below.contains([' ', '/']) => format!("{above}/({below})"),
        (above, below) => format!("{above}/{below}"),
    }
}

/// The responses to a step of each reference by one unit.
fn steps(view: &ControlLoop<'_>, law: &dyn Law, outputs: &Outputs, duration: f64) -> Vec<StepResponse> {
    let references = law.references().iter().enumerate();
    references
        .filter_map(|(k, reference)| {
            let mut window = first_window(view, duration)?;
            let mut found = follow(view, (k, law, outputs), window)?;
            for _ in 0..TRIES {
                let end = found.0.last().copied().unwrap_or(0.0);
                let rest =
                    found.1.iter().take(outputs.names.len()).map(|values| rest(&found.0, values)).fold(0.0, f64::max);
                if rest <= 0.0 || rest >= SETTLED * end || found.0.len() < TIMES / 2 {
                    break;
                }
                window = SHOWN * rest;
                found = follow(view, (k, law, outputs), window)?;
            }
            let (time, values) = found;
            let names = outputs.names.iter().map(|name| (name.clone(), SignalName::new(name).unit(), false));
            let names = names.chain(law.inputs().iter().map(|name| (name.clone(), "N m", true)));
            let signals = names.zip(values).map(|((name, unit, motor), values)| StepSignal {
                name,
                unit: unit.into(),
                motor,
                values,
            });
            Some(StepResponse {
                reference: reference.name.clone(),
                size: 1.0,
                unit: reference.physical.unit().into(),
                time,
                signals: signals.collect(),
            })
        })
        .collect()
}

/// Some time constants of the slowest motion; an uncontrolled rigid-body mode is followed for the duration of the file's run, s.
fn first_window(view: &ControlLoop<'_>, duration: f64) -> Option<f64> {
    let (found, per) = match SampledLoop::new(view.plant, view.parts) {
        Ok(found) => (found.slowest()?, found.sample_time),
        Err(_) => (SampledLoop::driven(view.plant, view.parts, 1e-3).ok()?.slowest()?, 1e-3),
    };
    let rate = -ln(found.growth) / per;
    let window = if rate > 0.0 { FOLLOWED / rate } else { f64::INFINITY };
    let window = if found.excluded > 0 { window.min(duration) } else { window };
    Some(if window.is_finite() { window } else { duration })
}

/// Times, and at each the outputs and the motor commands, after a step of a reference by one.
fn follow(
    view: &ControlLoop<'_>,
    (reference, law, outputs): (usize, &dyn Law, &Outputs),
    window: f64,
) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let found = SampledLoop::driven(view.plant, view.parts, window / TIMES as f64).ok()?;
    let periods_per_step = ((window / found.period / TIMES as f64).round() as usize).max(1);
    let count = ((window / found.period) as usize / periods_per_step).clamp(1, 2 * TIMES);
    let map = found.after(periods_per_step);
    let inputs = &view.parts[view.number].inputs;
    let states = map.rows();
    let mut rows: Vec<Vec<f64>> = outputs.rows.clone();
    rows.iter_mut().for_each(|row| row.resize(states, 0.0));
    rows.extend((0..law.inputs().len()).map(|motor| found.commands.row(inputs[motor]).to_vec()));
    let mut z = vec![0.0; states];
    *z.get_mut(found.references[view.number] + reference)? = 1.0;
    let (mut time, mut values) = (Vec::new(), vec![Vec::new(); rows.len()]);
    let mut next = z.clone();
    for k in 0..=count {
        time.push(found.period * (k * periods_per_step) as f64);
        for (row, values) in rows.iter().zip(&mut values) {
            values.push(row.iter().zip(&z).map(|(a, b)| a * b).sum::<f64>());
        }
        multiply(map.as_slice(), &z, &mut next);
        std::mem::swap(&mut z, &mut next);
    }
    let finite = values.iter().flatten().all(|value: &f64| value.is_finite());
    finite.then_some((time, values))
}

/// The time after which a signal stays at its final value, s; zero for one that does not move noticeably.
fn rest(time: &[f64], values: &[f64]) -> f64 {
    let (low, high) = values.iter().fold((0.0f64, 0.0f64), |(low, high), x| (low.min(*x), high.max(*x)));
    let last = values.last().copied().unwrap_or(0.0);
    let moving = values.iter().rposition(|x| (x - last).abs() > AT_REST * (high - low));
    moving.map_or(0.0, |place| time[place])
}
