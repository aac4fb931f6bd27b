//! A designed loop over a box of plants: seeded samples, and a search for the worst corners.

use std::sync::Arc;

use rayon::prelude::*;

use super::margins::left_out;
use super::{PreparedVariant, Progress};
use crate::assemble::CoefficientKind;
use crate::equations::Measured;
use crate::model::ControlSpec;
use crate::num::{Random, multiply, rational_to_f64};
use crate::reduce::linearise;
use crate::results::{Interaction, Interval, Robustness, Spread, VariedParameter};
use crate::schema::Keys;
use crate::synthesis::{
    Law, LoopPlant, Plant, SampledLoop, SampledNoninteractingChannel, SampledPart, VariedPlant, effective_inertia,
};

/// Which box of plants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ToleranceBox {
    /// The tolerances that the file gives.
    File,
    /// Every inertia, damping and stiffness within this part of its value, either way.
    Part(f64),
}

/// Why there is nothing to look at.
pub(super) const WITHOUT_MAP: &str =
    "the sample times of controllers and sensors have no short common period, or a number overflows";
/// Samples.
const SAMPLES: usize = 1000;
/// Their seed.
const SEED: u64 = 1;
/// Time between two looks at a loop in continuous time, s.
const LOOK: f64 = 1e-4;
/// Shortest window, in samples.
const SHORTEST: f64 = 200.0;
/// Time constants of the slowest motion in a window.
const SETTLED: f64 = 10.0;
/// Periods at the beginning of a window that are looked at one by one, and looks at the rest of it.
const LOOKS: [usize; 2] = [2000, 1000];
/// Random points from which the search begins, besides the corner that the slopes point to.
const STARTS: usize = 4;
/// Sweeps over all coefficients after which a search ends.
const SWEEPS: usize = 6;

/// What a channel's output is watched by.
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

pub(super) struct Watched {
    pub name: String,
    pub unit: &'static str,
    pub reference: String,
    /// What is acceptable of it.
    pub acceptable: f64,
    watch: Watch,
}

/// A step that is tried.
pub(super) struct Step {
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
pub(super) struct NotJudged;

/// What one plant shows.
#[derive(Debug, Clone)]
pub(super) struct Shown {
    /// That of the law, s; of one in continuous time the shortest one.
    pub sample_time: f64,
    /// Of such a sample.
    pub radius: f64,
    pub stable: bool,
    /// By step and then by what is watched.
    pub sizes: Vec<Vec<f64>>,
    /// By step and then by input.
    pub peaks: Vec<Vec<f64>>,
}

/// The loop of a variant, ready to be looked at with any plant.
pub(super) struct Subject {
    pub plant: VariedPlant,
    pub parts: Vec<SampledPart>,
    /// Number of the law among the parts.
    number: usize,
    pub watched: Vec<Watched>,
    pub steps: Vec<Step>,
    /// Inputs of the law.
    pub inputs: Vec<usize>,
    /// Time after a step that is looked at, s.
    pub window: f64,
    /// How many motions nobody holds, whatever the plant.
    free: usize,
}

/// The design of a controller over a box of plants; the reason if there is nothing to vary or nothing to watch.
pub(super) fn robustness(
    variant: &PreparedVariant,
    number: usize,
    laws: &[Arc<dyn Law>],
    range: ToleranceBox,
    progress: &dyn Progress,
) -> Result<Robustness, String> {
    let model = linearise(&variant.reduced, &vec![0.0; variant.reduced.degrees_of_freedom()]);
    let lags = variant.design_models.first().map(Plant::lags).unwrap_or_default();
    let plant = VariedPlant::new(&variant.reduced, &model, &lags);
    let names = plant.names();
    let (parameters, left) = limits(variant, &names, range);
    if parameters.iter().all(|one| one.factors.lower == one.factors.upper) {
        return Err(format!(
            "no inertia, damping or stiffness has a tolerance{}: write `inertia = \"1 kg m^2 ± 10 %\"`, or vary all of them \
             with `--tolerance 20%`",
            if left.is_empty() { String::new() } else { format!(" (only {})", left.join(", ")) }
        ));
    }
    let mut subject = subject(variant, number, laws, plant)?;
    let nominal = subject.look(&vec![1.0; names.len()]).map_err(|_| WITHOUT_MAP)?;
    subject.window = window(&nominal, variant.scenario.duration);
    let nominal = subject.look(&vec![1.0; names.len()]).map_err(|_| WITHOUT_MAP)?;
    let mut random = Random::new(SEED);
    let points: Vec<Vec<f64>> = (0..SAMPLES)
        .map(|_| {
            parameters
                .iter()
                .map(|one| one.factors.lower + (one.factors.upper - one.factors.lower) * random.unit())
                .collect()
        })
        .collect();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let look = |point: &Vec<f64>| {
        if progress.stop().is_some() {
            return None;
        }
        let shown = subject.look(point).ok();
        let count = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        if count.is_multiple_of(16) {
            progress.advance(0, "plants", count as f64 / SAMPLES as f64);
        }
        shown
    };
    let shown: Vec<Option<Shown>> = points.par_iter().map(look).collect();
    progress.advance(0, "plants", 1.0);
    if let Some(why) = progress.stop() {
        return Err(why);
    }
    let good = |shown: &Option<Shown>| shown.as_ref().is_some_and(|shown| shown.stable);
    let spread = |of: &(dyn Fn(Option<&Shown>) -> f64 + Sync)| -> Spread {
        let mut all: Vec<(f64, usize)> = shown.iter().enumerate().map(|(k, shown)| (of(shown.as_ref()), k)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let quantile = |part: f64| all[((part * all.len() as f64).ceil() as usize).clamp(1, all.len()) - 1].0;
        let starts: Vec<&Vec<f64>> = all.iter().rev().take(STARTS).map(|(_, k)| &points[*k]).collect();
        let (worst, at) = worst_corner(&parameters, &starts, &|point| of(subject.look(point).ok().as_ref()));
        let (sampled, place) = all[all.len() - 1];
        Spread {
            nominal: of(Some(&nominal)),
            median: quantile(0.5),
            q90: quantile(0.9),
            q99: quantile(0.99),
            sampled,
            worst: worst.max(sampled),
            at: if worst >= sampled { at } else { points[place].clone() },
        }
    };
    // What an unstable loop does has no size.
    let size = |shown: Option<&Shown>, value: &dyn Fn(&Shown) -> f64| match shown {
        Some(shown) if shown.stable => value(shown),
        _ => f64::INFINITY,
    };
    let mut interactions = Vec::new();
    let mut peaks = Vec::new();
    for (i, step) in subject.steps.iter().enumerate() {
        let about = |signal: &str, signal_unit: &str, size_over_box: Spread| Interaction {
            reference: step.name.clone(),
            step: step.size,
            step_unit: step.unit.into(),
            signal: signal.into(),
            unit: signal_unit.into(),
            size: size_over_box,
        };
        for (j, watched) in subject.watched.iter().enumerate().filter(|(_, watched)| watched.reference != step.name) {
            interactions.push(about(
                &watched.name,
                watched.unit,
                spread(&|shown| size(shown, &|shown| shown.sizes[i][j])),
            ));
        }
        for (j, &input) in subject.inputs.iter().enumerate() {
            let name = &subject.plant.nominal().inputs[input];
            peaks.push(about(name, "N m", spread(&|shown| size(shown, &|shown| shown.peaks[i][j]))));
        }
    }
    // Of unstable loops the radius counts too.
    let radius = spread(&|shown| shown.map_or(f64::INFINITY, |shown| shown.radius));
    let range = match range {
        ToleranceBox::Part(part) => format!("{} % of every inertia, damping and stiffness", 100.0 * part),
        ToleranceBox::File => {
            let left = if left.is_empty() { String::new() } else { format!("; not varied: {}", left.join(", ")) };
            format!("the tolerances of the file{left}")
        }
    };
    let worst_stable = radius.worst.is_finite() && subject.look(&radius.at).is_ok_and(|shown| shown.stable);
    Ok(Robustness {
        range,
        parameters,
        samples: SAMPLES,
        seed: SEED,
        stable: shown.iter().filter(|shown| good(shown)).count(),
        worst_stable,
        spectral_radius: radius,
        interactions,
        peaks,
    })
}

/// What of it must not be overlooked.
pub(super) fn warnings(found: &Robustness) -> Vec<String> {
    let mut out = Vec::new();
    if found.stable < found.samples {
        out.push(format!(
            "{} of {} plants within {} are unstable",
            found.samples - found.stable,
            found.samples,
            found.range
        ));
    } else if !found.worst_stable {
        out.push(format!(
            "a corner of the box ({}) is unstable, though all {} sampled plants are stable",
            found.range, found.samples
        ));
    }
    out
}

/// Time until the slowest motion has died out, or the run of the file ends, s.
pub(super) fn window(nominal: &Shown, duration: f64) -> f64 {
    let time = nominal.sample_time;
    let settled = if nominal.radius < 1.0 { -SETTLED * time / nominal.radius.ln() } else { f64::INFINITY };
    settled.min(duration).max(SHORTEST * time)
}

/// Smallest and largest factor of each coefficient, and tolerances of the file that are not those of coefficients.
fn limits(variant: &PreparedVariant, names: &[String], range: ToleranceBox) -> (Vec<VariedParameter>, Vec<String>) {
    let within = |name: &String, lower: f64, upper: f64| VariedParameter {
        name: name.clone(),
        factors: Interval { lower, upper },
    };
    match range {
        ToleranceBox::Part(part) => {
            (names.iter().map(|name| within(name, 1.0 - part, 1.0 + part)).collect(), Vec::new())
        }
        ToleranceBox::File => {
            let tolerances = &variant.model.tolerances;
            let of = |name: &String| match tolerances.iter().find(|one| one.parameter == *name) {
                Some(one) => {
                    let part = |x: &crate::units::Exact| x.to_f64() / one.nominal.to_f64();
                    within(name, part(&one.lower), part(&one.upper))
                }
                None => within(name, 1.0, 1.0),
            };
            let left = tolerances.iter().filter(|one| !names.contains(&one.parameter));
            (names.iter().map(of).collect(), left.map(|one| format!("`{}`", one.parameter)).collect())
        }
    }
}

/// The loop of a controller with these laws, as they run, if it has channels that act on each other.
pub(super) fn subject(
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
pub(super) fn any_subject(
    variant: &PreparedVariant,
    number: usize,
    laws: &[Arc<dyn Law>],
    plant: VariedPlant,
) -> Subject {
    let control: &ControlSpec = &variant.model.controls[number];
    let model = &variant.design_models[number];
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, plant.nominal())).collect();
    let equations = &variant.reduced.equations;
    let mut watched = Vec::new();
    for channel in control.values.tables("channels").unwrap_or_default() {
        let (Some(output), Some(reference)) = (channel.word("output"), channel.word("reference")) else { continue };
        let Ok(signal) = model.output(output) else { continue };
        let torque = channel.word("kind") == Some("torque");
        let key = match signal.measured {
            Measured::Angle(_) if !torque => "acceptable_angle",
            Measured::Speed(_) => "acceptable_speed",
            _ => "acceptable_torque",
        };
        // Laws without such a key are judged alike.
        let acceptable = channel.number(key).unwrap_or_else(|| SampledNoninteractingChannel::default_number(key));
        let (name, unit, watch) = match &signal.measured {
            Measured::Angle(name) if torque => {
                let Some(shaft) = variant.reduced.shaft(name) else { continue };
                let others: Vec<usize> = (0..laws.len())
                    .filter(|&k| k != number)
                    .flat_map(|k| parts[k].inputs.iter().copied())
                    .filter(|&input| equations.inputs[input].row.iter().any(|(other, _)| *other == shaft))
                    .collect();
                if others.is_empty() {
                    let inertia = rational_to_f64(&effective_inertia(&model.linear, shaft));
                    (format!("torque along {output}"), "N m", Watch::Acceleration(shaft, vec![(None, inertia)]))
                } else {
                    let names: Vec<&str> = others.iter().map(|&k| equations.inputs[k].element.as_str()).collect();
                    (format!("{}.tau", names.join(" + ")), "N m", Watch::Felt(others))
                }
            }
            Measured::Angle(name) => {
                let Some(shaft) = variant.reduced.shaft(name) else { continue };
                (output.to_string(), "rad", Watch::Angle(shaft))
            }
            Measured::Speed(name) => {
                let Some(shaft) = variant.reduced.shaft(name) else { continue };
                (output.to_string(), "rad/s", Watch::Speed(shaft))
            }
            Measured::NetTorque(name) => {
                let Some(shaft) = variant.reduced.shaft(name) else { continue };
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
            Measured::ConstraintTorque(..) | Measured::ComplianceTorque(..) => continue,
        };
        watched.push(Watched { name, unit, reference: reference.into(), acceptable, watch });
    }
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
    let free = left_out(variant, number, plant.nominal());
    Subject { plant, parts, number, watched, steps, inputs, window: 0.0, free }
}

impl Subject {
    /// What the loop shows with these factors of the coefficients. Steps of an unstable loop have no size.
    pub fn look(&self, factors: &[f64]) -> Result<Shown, NotJudged> {
        let plant = self.plant.at(factors);
        let found = SampledLoop::driven(&plant, &self.parts, LOOK).map_err(|_| NotJudged)?;
        let slowest = found.slowest_without(self.free).ok_or(NotJudged)?;
        let stable = slowest.stable;
        let rows = self.rows(&plant, &found, factors);
        let periods = if stable { (self.window / found.period).ceil() as usize } else { 0 };
        let fine = periods.min(LOOKS[0]);
        let stride = (periods - fine).div_ceil(LOOKS[1]);
        let far = (stride > 0).then(|| found.after(stride));
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
                for _ in 0..(periods - fine).div_ceil(stride) {
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
        let radius = slowest.growth.powf(sample_time / found.sample_time);
        Ok(Shown { sample_time, radius, stable, sizes, peaks })
    }

    /// Root mean square of what errors of the law's readings with these variances make of its commands, N m; `None` if the
    /// loop cannot be computed.
    pub fn noise(&self, factors: &[f64], variances: &[f64]) -> Option<Vec<f64>> {
        let plant = self.plant.at(factors);
        let found = SampledLoop::driven(&plant, &self.parts, LOOK).ok()?;
        let commands: Vec<Vec<f64>> = self.inputs.iter().map(|&input| found.commands.row(input).to_vec()).collect();
        Some(found.noise(self.number, variances, &commands))
    }

    /// What is watched, then the commands of the law's inputs, as sparse rows over z.
    fn rows(&self, plant: &LoopPlant, found: &SampledLoop, factors: &[f64]) -> Vec<Vec<(usize, f64)>> {
        let r = plant.inertia.rows();
        let sparse = |row: &[f64]| row.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect::<Vec<_>>();
        let size = found.map.rows();
        let command = |input: usize| found.commands.row(input).to_vec();
        let watched = self.watched.iter().map(|watched| match &watched.watch {
            Watch::Angle(shaft) => sparse(plant.basis.row(*shaft)),
            Watch::Speed(shaft) => sparse(plant.basis.row(*shaft)).into_iter().map(|(j, x)| (r + j, x)).collect(),
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
                for j in 0..r {
                    let share = inertia * plant.basis[(*shaft, j)];
                    sum.iter_mut().zip(found.flow.row(r + j)).for_each(|(sum, x)| *sum += share * x);
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

/// The largest value over the corners of the box that a search finds: coefficient by coefficient to its better end, until
/// nothing gets larger, from the corner to which the slopes at the centre point and from the corners next to given points.
fn worst_corner(
    parameters: &[VariedParameter],
    starts: &[&Vec<f64>],
    value: &(dyn Fn(&Vec<f64>) -> f64 + Sync),
) -> (f64, Vec<f64>) {
    let ends = |k: usize| [parameters[k].factors.lower, parameters[k].factors.upper];
    let nearest = |point: &Vec<f64>| -> Vec<f64> {
        point
            .iter()
            .enumerate()
            .map(|(k, x)| {
                let [low, high] = ends(k);
                if x - low < high - x { low } else { high }
            })
            .collect()
    };
    let centre: Vec<f64> = parameters.iter().map(|one| 0.5 * (one.factors.lower + one.factors.upper)).collect();
    let sloped: Vec<f64> = (0..parameters.len())
        .map(|k| {
            let at = |x: f64| {
                let mut point = centre.clone();
                point[k] = x;
                value(&point)
            };
            let [low, high] = ends(k);
            if at(high) >= at(low) { high } else { low }
        })
        .collect();
    let climb = |start: Vec<f64>| -> (f64, Vec<f64>) {
        let (mut best, mut point) = (value(&start), start);
        for _ in 0..SWEEPS {
            let before = best;
            for k in 0..point.len() {
                let old = point[k];
                for end in ends(k).into_iter().filter(|end| *end != old) {
                    point[k] = end;
                    let found = value(&point);
                    if found > best {
                        best = found;
                        break;
                    }
                    point[k] = old;
                }
            }
            if !(best > before) || best.is_infinite() {
                break;
            }
        }
        (best, point)
    };
    let all: Vec<Vec<f64>> = std::iter::once(sloped).chain(starts.iter().map(|point| nearest(point))).collect();
    let found: Vec<(f64, Vec<f64>)> = all.into_par_iter().map(climb).collect();
    found.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, centre))
}
