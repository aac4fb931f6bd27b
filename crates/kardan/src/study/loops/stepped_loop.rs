//! Step responses of the references of a controller: interaction of its channels, with any plant.

use std::sync::Arc;

use kardan_rt::functions::{ln, powf};

use super::loop_blocks::blocks;
use super::margins::{excluded, motor_margins};
use crate::study::PreparedVariant;
use kardan_math::num::{multiply, rational_to_f64};
use kardan_mechanics::assemble::CoefficientKind;
use kardan_mechanics::equations::Measured;
use kardan_mechanics::reduce::motions_over_states;
use kardan_model::ControlSpec;
use kardan_results::signal_name::Quantity;
use kardan_results::{ChannelMargin, Stability};
use kardan_schema::schema::Keys;
use kardan_schema::schema::Values;
use kardan_synthesis::{
    ControlLoop, Law, LoopPlant, SampledLoop, SampledNoninteractingChannel, SampledPart, VariedPlant, effective_inertia,
};

/// Why there is nothing to compute.
pub(in crate::study) const NO_PERIOD_MAP: &str =
    "the sample times of controllers and sensors have no short common period, or a number overflows";
/// Sampling interval of a loop in continuous time, s.
const OBSERVATION_DELAY: f64 = 1e-4;
/// Shortest window, in samples.
const SHORTEST: f64 = 200.0;
/// Time constants of the slowest motion in a window.
const SETTLED: f64 = 10.0;
/// Number of periods at the beginning of a window that are evaluated one by one, and of evaluations of the rest of it.
const CHECK_PERIODS: [usize; 2] = [2000, 1000];

/// The watched quantity of a channel's output.
enum Watch {
    /// The angle of a shaft, rad.
    Angle(usize),
    /// The speed of a shaft, rad/s.
    Speed(usize),
    /// The torque that other laws apply on a shaft, N m: inputs of the plant.
    Felt(Vec<usize>),
    /// Inertia (kg m²) times acceleration of a shaft. The inertia is a sum: of each part the number among the coefficients, if it
    /// is one.
    Acceleration(usize, Vec<(Option<usize>, f64)>),
    /// The torque of springs, N m: of each its number among the coefficients, and its nominal torque over the angles of shafts.
    Springs(Vec<(usize, Vec<(usize, f64)>)>),
}

pub(in crate::study) struct Watched {
    pub name: String,
    pub unit: &'static str,
    pub reference: String,
    /// Its acceptable size.
    pub acceptable: f64,
    watch: Watch,
}

/// A step to try.
pub(in crate::study) struct Step {
    /// The reference.
    pub name: String,
    /// Its number among the law's references.
    pub reference: usize,
    /// SI
    pub size: f64,
    pub unit: &'static str,
}

/// The loop has no map: its sample times have no short common period, or a number overflows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::study) struct NotJudged;

/// The responses for one plant.
#[derive(Debug, Clone)]
pub(in crate::study) struct Shown {
    /// The sample time of the law, s; for one in continuous time the shortest one.
    pub sample_time: f64,
    /// Of such a sample.
    pub radius: f64,
    /// Whether no motion grows, to rounding.
    pub stable: bool,
    /// Whether it is stable except for uncontrolled rigid-body modes; not decided if that is below rounding.
    pub word: Stability,
    /// By step and then by watched quantity.
    pub sizes: Vec<Vec<f64>>,
    /// By step and then by input.
    pub peaks: Vec<Vec<f64>>,
}

/// The loop of a variant, ready to be evaluated with any plant.
pub(in crate::study) struct Subject {
    pub plant: VariedPlant,
    pub parts: Vec<SampledPart>,
    /// Number of the law among the parts.
    number: usize,
    pub watched: Vec<Watched>,
    pub steps: Vec<Step>,
    /// Inputs of the law.
    pub inputs: Vec<usize>,
    /// Evaluated time after a step, s.
    pub window: f64,
    /// Number of uncontrolled rigid-body modes, for all plants.
    free: usize,
}

/// The loop of a controller with these laws, as they run, if it has channels that act on each other.
pub(in crate::study) fn subject(
    variant: &PreparedVariant,
    number: usize,
    laws: &[Arc<dyn Law>],
    plant: VariedPlant,
) -> Result<Subject, String> {
    let subject = any_subject(variant, number, laws, plant);
    if subject.watched.len() < 2 {
        return Err(
            "interaction needs two channels whose outputs are angles or speeds of shafts or torques of springs".into(),
        );
    }
    Ok(subject)
}

/// The loop of a controller with these laws, as they run.
pub(in crate::study) fn any_subject(
    variant: &PreparedVariant,
    number: usize,
    laws: &[Arc<dyn Law>],
    plant: VariedPlant,
) -> Subject {
    let control: &ControlSpec = &variant.model.controls[number];
    let parts = laws.iter().map(|law| SampledPart::of(&**law, plant.nominal())).collect();
    let parts = blocks(variant, plant.nominal()).of_loop.join(parts);
    let channels = control.values.tables("channels").unwrap_or_default().iter();
    let watched: Vec<Watched> =
        channels.filter_map(|channel| watched(variant, number, &parts, &plant, channel)).collect();
    let largest = |name: &str| {
        let source = variant.scenario.sources.iter().position(|source| source.name == name);
        let of = variant.scenario.events.iter().filter(|event| Some(event.source) == source);
        of.map(|event| event.to.abs()).fold(0.0, f64::max)
    };
    let steps = laws[number].references().iter().enumerate().filter_map(|(k, reference)| {
        watched.iter().find(|watched| watched.reference == reference.name)?;
        let size = largest(&reference.name);
        let unit = reference.physical.unit();
        Some(Step { name: reference.name.clone(), reference: k, size: if size > 0.0 { size } else { 1.0 }, unit })
    });
    let steps = steps.collect();
    let inputs = parts[number].inputs.clone();
    let free = excluded(variant, number, plant.nominal());
    Subject { plant, parts, number, watched, steps, inputs, window: 0.0, free }
}

/// The watched quantity of a channel of a controller; none if its output has none.
fn watched(
    variant: &PreparedVariant,
    number: usize,
    parts: &[SampledPart],
    plant: &VariedPlant,
    channel: &Values,
) -> Option<Watched> {
    let (output, reference) = (channel.word("output")?, channel.word("reference")?);
    let signal = variant.design_models[number].output(output).ok()?;
    let torque = channel.word("kind") == Some("torque");
    let key = match signal.measured {
        Measured::Angle(_) if !torque => "acceptable_angle",
        Measured::Speed(_) => "acceptable_speed",
        _ => "acceptable_torque",
    };
    // Laws without such a key are judged alike.
    let acceptable = channel.number(key).unwrap_or_else(|| SampledNoninteractingChannel::default_number(key));
    let (name, unit, watch) = match &signal.measured {
        Measured::Angle(name) => {
            let shaft = variant.reduced.coordinate(name)?;
            if torque {
                let (name, watch) = torque_for_output(variant, number, parts, output, shaft);
                (name, "N m", watch)
            } else {
                (output.to_string(), "rad", Watch::Angle(shaft))
            }
        }
        Measured::Speed(name) => (output.to_string(), "rad/s", Watch::Speed(variant.reduced.coordinate(name)?)),
        Measured::NetTorque(name) => {
            let shaft = variant.reduced.coordinate(name)?;
            // As [`Equations::own_inertia`], part by part.
            let own = plant.coefficients().filter(|(_, one)| one.kind == CoefficientKind::Inertia);
            let own = own.filter_map(|(number, one)| match one.row.as_slice() {
                [(k, x)] if *k == shaft => Some((Some(number), x * x * one.value)),
                _ => None,
            });
            (signal.name.clone(), "N m", Watch::Acceleration(shaft, own.collect()))
        }
        Measured::SpringTorque(element) => {
            let name = format!("{element}.stiffness");
            let rows = plant
                .coefficients()
                .filter(|(_, one)| one.name == name)
                .map(|(number, one)| (number, one.row.iter().map(|(shaft, x)| (*shaft, one.value * x)).collect()));
            (signal.name.clone(), "N m", Watch::Springs(rows.collect()))
        }
        Measured::ConstraintTorque(..) | Measured::ComplianceTorque(..) | Measured::Signal(_) => return None,
    };
    Some(Watched { name, unit, reference: reference.into(), acceptable, watch })
}

/// The watched quantity of a controller that acts on a shaft by a torque: the torques of other laws there, else the required
/// torque.
fn torque_for_output(
    variant: &PreparedVariant,
    number: usize,
    parts: &[SampledPart],
    output: &str,
    shaft: usize,
) -> (String, Watch) {
    let equations = &variant.reduced.equations;
    let felt_inputs: Vec<usize> = (0..parts.len())
        .filter(|&k| k != number)
        .flat_map(|k| parts[k].inputs.iter().copied())
        .filter(|&input| equations.inputs[input].row.iter().any(|(candidate, _)| *candidate == shaft))
        .collect();
    if felt_inputs.is_empty() {
        let model = &variant.design_models[number];
        let own = model.reduced.coordinate(&equations.coordinates[shaft]).unwrap_or(shaft);
        let inertia = rational_to_f64(&effective_inertia(&model.linear, own));
        return (format!("torque on {output}"), Watch::Acceleration(shaft, vec![(None, inertia)]));
    }
    let names: Vec<&str> = felt_inputs.iter().map(|&k| equations.inputs[k].element.as_str()).collect();
    (Quantity::Torque.of(&names.join(" + ")), Watch::Felt(felt_inputs))
}

/// Time until the slowest motion has decayed, or the run of the file ends, s.
pub(in crate::study) fn window(nominal: &Shown, duration: f64) -> f64 {
    let time = nominal.sample_time;
    let settled = if nominal.radius < 1.0 { -SETTLED * time / ln(nominal.radius) } else { f64::INFINITY };
    settled.min(duration).max(SHORTEST * time)
}

impl Subject {
    /// The responses of the loop with these factors of the coefficients. Steps of an unstable loop have no size.
    pub fn evaluate(&self, factors: &[f64]) -> Result<Shown, NotJudged> {
        let plant = self.plant.at(factors);
        let found = SampledLoop::driven(&plant, &self.parts, OBSERVATION_DELAY).map_err(|_| NotJudged)?;
        let slowest = found.slowest_excluding(self.free).ok_or(NotJudged)?;
        let stable = slowest.stable;
        let rows = self.rows(&plant, &found, factors);
        let periods = if stable { (self.window / found.period).ceil() as usize } else { 0 };
        let fine = periods.min(CHECK_PERIODS[0]);
        let periods_per_step = (periods - fine).div_ceil(CHECK_PERIODS[1]);
        let far = (periods_per_step > 0).then(|| found.after(periods_per_step));
        let (mut sizes, mut peaks) = (Vec::new(), Vec::new());
        for Step { reference, size, .. } in &self.steps {
            let mut z = vec![0.0; found.map.rows()];
            z[found.references[self.number] + reference] = *size;
            let mut largest = vec![if stable { 0.0f64 } else { f64::INFINITY }; rows.len()];
            let mut see = |z: &[f64]| {
                for (largest, row) in largest.iter_mut().zip(&rows) {
                    let value: f64 = row.iter().map(|(j, x)| x * z[*j]).sum();
                    *largest = largest.max(value.abs());
                }
            };
            (0..fine).for_each(|_| found.pass(&mut z, &mut see));
            if let Some(far) = &far {
                let mut next = z.clone();
                for _ in 0..(periods - fine).div_ceil(periods_per_step) {
                    multiply(far.as_slice(), &z, &mut next);
                    std::mem::swap(&mut z, &mut next);
                    see(&z);
                }
            }
            let (watched, torques) = largest.split_at(self.watched.len());
            sizes.push(watched.to_vec());
            peaks.push(torques.to_vec());
        }
        let sample_time = self.parts[self.number].clock.map_or(found.sample_time, |clock| clock.period);
        let radius = powf(slowest.growth, sample_time / found.sample_time);
        Ok(Shown { sample_time, radius, stable, word: slowest.word, sizes, peaks })
    }

    /// The margins of each of the law's motors alone with these factors of the coefficients; `None` for a loop that is
    /// not stable, or has several sample times.
    pub fn margins(&self, factors: &[f64], motors: &[String]) -> Option<Vec<ChannelMargin>> {
        let plant = self.plant.at(factors);
        let found = SampledLoop::driven(&plant, &self.parts, OBSERVATION_DELAY).ok()?;
        if !found.slowest_excluding(self.free)?.stable {
            return None;
        }
        motor_margins(&ControlLoop { plant: &plant, parts: &self.parts, number: self.number }, motors)
    }

    /// Root mean square of the effect of errors of the law's readings with these variances on its commands, N m; `None` if the
    /// loop cannot be computed.
    pub fn noise(&self, factors: &[f64], variances: &[f64]) -> Option<Vec<f64>> {
        let plant = self.plant.at(factors);
        let found = SampledLoop::driven(&plant, &self.parts, OBSERVATION_DELAY).ok()?;
        let commands: Vec<Vec<f64>> = self.inputs.iter().map(|&input| found.commands.row(input).to_vec()).collect();
        Some(found.noise(self.number, variances, &commands))
    }

    /// The watched quantities, then the commands of the law's inputs, as sparse rows over z.
    fn rows(&self, plant: &LoopPlant, found: &SampledLoop, factors: &[f64]) -> Vec<Vec<(usize, f64)>> {
        let r = plant.inertia.rows();
        let [angles, speeds] = motions_over_states(&plant.basis, &plant.moving);
        let sparse = |row: &[f64]| row.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect::<Vec<_>>();
        let size = found.map.rows();
        let command = |input: usize| found.commands.row(input).to_vec();
        let watched = self.watched.iter().map(|watched| match &watched.watch {
            Watch::Angle(shaft) => sparse(angles.row(*shaft)),
            Watch::Speed(shaft) => sparse(speeds.row(*shaft)),
            Watch::Felt(inputs) => {
                let mut sum = vec![0.0; size];
                for &input in inputs {
                    sum.iter_mut().zip(command(input)).for_each(|(sum, x)| *sum += x);
                }
                sparse(&sum)
            }
            Watch::Acceleration(shaft, parts) => {
                let factor = |term: &Option<usize>| term.map_or(1.0, |term| factors[term]);
                let inertia: f64 = parts.iter().map(|(term, part)| factor(term) * part).sum();
                let mut sum = vec![0.0; size];
                for (k, &j) in plant.moving.iter().enumerate() {
                    let share = inertia * plant.basis[(*shaft, j)];
                    sum.iter_mut().zip(found.flow.row(r + k)).for_each(|(sum, x)| *sum += share * x);
                }
                sparse(&sum)
            }
            Watch::Springs(springs) => {
                let mut sum = vec![0.0; r];
                for (term, row) in springs {
                    for (shaft, torque) in row {
                        (0..r).for_each(|j| sum[j] += factors[*term] * torque * plant.basis[(*shaft, j)]);
                    }
                }
                sparse(&sum)
            }
        });
        watched.chain(self.inputs.iter().map(|&input| sparse(&command(input)))).collect()
    }
}
