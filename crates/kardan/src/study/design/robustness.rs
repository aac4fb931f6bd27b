//! A designed loop over a box of plants: seeded samples, and a search for the worst corners.

use rayon::prelude::*;

use crate::study::loops::margins_over_positions::margins_over_box;
use crate::study::loops::stepped_loop::{NO_PERIOD_MAP, Shown, Subject, subject, window};
use crate::study::{PreparedVariant, Progress};
use kardan_math::num::Random;
use kardan_math::units::Exact;
use kardan_results::{Interaction, Interval, Robustness, Spread, Stability, VariedParameter};

/// The box of plants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ToleranceBox {
    /// The tolerances of the file.
    File,
    /// Every inertia, damping and stiffness within this fraction of its value, in both directions.
    Part(f64),
}

/// Number of samples.
const SAMPLES: usize = 1000;
/// Their seed.
const SEED: u64 = 1;
/// Number of random start points of the search, besides the corner given by the slopes.
const STARTS: usize = 4;
/// Number of sweeps over all coefficients after which a search ends.
const SWEEPS: usize = 6;

/// The design of a controller over a box of plants; the reason if there is nothing to vary or to watch.
pub(in crate::study) fn robustness(
    variant: &PreparedVariant,
    number: usize,
    range: ToleranceBox,
    progress: &dyn Progress,
) -> Result<Robustness, String> {
    let (laws, plant) = (&variant.implemented, variant.varied_plant(&variant.linear_model()));
    let names = plant.names();
    let (parameters, unvaried) = limits(variant, &names, range);
    if parameters.iter().all(|one| one.factors.lower == one.factors.upper) {
        return Err(format!(
            "no inertia, damping or stiffness has a tolerance{}: write `inertia = \"1 kg m^2 ± 10 %\"`, or vary all of them \
             with `--tolerance 20%`",
            if unvaried.is_empty() { String::new() } else { format!(" (only {})", unvaried.join(", ")) }
        ));
    }
    let mut subject = subject(variant, number, laws, plant)?;
    let nominal = subject.evaluate(&vec![1.0; names.len()]).map_err(|_| NO_PERIOD_MAP)?;
    subject.window = window(&nominal, variant.scenario.duration);
    let nominal = subject.evaluate(&vec![1.0; names.len()]).map_err(|_| NO_PERIOD_MAP)?;
    let mut random = Random::new(SEED);
    let mut factor = |Interval { lower, upper }: &Interval| lower + (upper - lower) * random.unit();
    let mut point = || parameters.iter().map(|one| factor(&one.factors)).collect();
    let points: Vec<Vec<f64>> = (0..SAMPLES).map(|_| point()).collect();
    let shown = evaluate_all(&subject, &points, progress)?;
    let plants = Plants { subject: &subject, parameters: &parameters, nominal, points, shown };
    // For unstable loops the radius counts too.
    let spectral_radius = plants.spread(&|shown| shown.map_or(f64::INFINITY, |shown| shown.radius));
    let worst = &spectral_radius;
    let worst_stable =
        worst.worst.is_finite() && subject.evaluate(&worst.at).is_ok_and(|shown| shown.word == Stability::Stable);
    let (interactions, peaks) = plants.sizes();
    let stable = plants.shown.iter().flatten().filter(|shown| shown.word == Stability::Stable).count();
    let worst = interactions.iter().chain(&peaks).map(|one| one.size.at.clone());
    let corners: Vec<Vec<f64>> = worst.chain([spectral_radius.at.clone()]).collect();
    let margins = margins_over_box(&subject, laws[number].inputs(), &plants.points, &corners);
    let range = match range {
        ToleranceBox::Part(part) => format!("{} % of every inertia, damping and stiffness", 100.0 * part),
        ToleranceBox::File => {
            let unvaried =
                if unvaried.is_empty() { String::new() } else { format!("; not varied: {}", unvaried.join(", ")) };
            format!("the tolerances of the file{unvaried}")
        }
    };
    Ok(Robustness {
        range,
        parameters,
        samples: SAMPLES,
        seed: SEED,
        stable,
        worst_stable,
        spectral_radius,
        interactions,
        peaks,
        margins,
    })
}

/// The responses of the loop for each plant, none if it has no map; the reason if everything must end.
fn evaluate_all(subject: &Subject, points: &[Vec<f64>], progress: &dyn Progress) -> Result<Vec<Option<Shown>>, String> {
    let done = std::sync::atomic::AtomicUsize::new(0);
    let evaluate = |point: &Vec<f64>| {
        if progress.stop().is_some() {
            return None;
        }
        let shown = subject.evaluate(point).ok();
        let count = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        if count.is_multiple_of(16) {
            progress.advance(0, "plants", count as f64 / SAMPLES as f64);
        }
        shown
    };
    let shown = points.par_iter().map(evaluate).collect();
    progress.advance(0, "plants", 1.0);
    progress.stop().map_or(Ok(shown), Err)
}

/// The plants of a box, with their responses.
struct Plants<'a> {
    subject: &'a Subject,
    parameters: &'a [VariedParameter],
    nominal: Shown,
    points: Vec<Vec<f64>>,
    shown: Vec<Option<Shown>>,
}

impl Plants<'_> {
    /// The distribution of a value over the samples, and its largest value over the corners that a search finds.
    fn spread(&self, of: &(dyn Fn(Option<&Shown>) -> f64 + Sync)) -> Spread {
        let mut all: Vec<(f64, usize)> =
            self.shown.iter().enumerate().map(|(k, shown)| (of(shown.as_ref()), k)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let quantile = |part: f64| all[((part * all.len() as f64).ceil() as usize).clamp(1, all.len()) - 1].0;
        let starts: Vec<&Vec<f64>> = all.iter().rev().take(STARTS).map(|(_, k)| &self.points[*k]).collect();
        let (worst, at) =
            worst_corner(self.parameters, &starts, &|point| of(self.subject.evaluate(point).ok().as_ref()));
        let (sampled, place) = all[all.len() - 1];
        Spread {
            nominal: of(Some(&self.nominal)),
            median: quantile(0.5),
            q90: quantile(0.9),
            q99: quantile(0.99),
            sampled,
            worst: worst.max(sampled),
            at: if worst >= sampled { at } else { self.points[place].clone() },
        }
    }

    /// The interactions of the channels, and the motor torques, over the box.
    fn sizes(&self) -> (Vec<Interaction>, Vec<Interaction>) {
        // Responses of an unstable loop have no size.
        let spread = |value: &(dyn Fn(&Shown) -> f64 + Sync)| {
            self.spread(&|shown| shown.filter(|shown| shown.stable).map_or(f64::INFINITY, value))
        };
        let (mut interactions, mut peaks) = (Vec::new(), Vec::new());
        for (i, step) in self.subject.steps.iter().enumerate() {
            let about = |signal: &str, unit: &str, size: Spread| Interaction {
                reference: step.name.clone(),
                step: step.size,
                step_unit: step.unit.into(),
                signal: signal.into(),
                unit: unit.into(),
                size,
            };
            let watched = self.subject.watched.iter().enumerate();
            for (j, watched) in watched.filter(|(_, watched)| watched.reference != step.name) {
                interactions.push(about(&watched.name, watched.unit, spread(&|shown| shown.sizes[i][j])));
            }
            for (j, &input) in self.subject.inputs.iter().enumerate() {
                let name = &self.subject.plant.nominal().inputs[input];
                peaks.push(about(name, "N m", spread(&|shown| shown.peaks[i][j])));
            }
        }
        (interactions, peaks)
    }
}

/// Important warnings.
pub(in crate::study) fn warnings(found: &Robustness) -> Vec<String> {
    let mut out = Vec::new();
    if found.stable < found.samples {
        out.push(format!(
            "{} of {} plants within {} are unstable, or not known to be stable",
            found.samples - found.stable,
            found.samples,
            found.range
        ));
    } else if !found.worst_stable {
        out.push(format!(
            "a corner of the box ({}) is unstable, or not known to be stable, though all {} sampled plants are stable",
            found.range, found.samples
        ));
    }
    out
}

/// Smallest and largest factor of each coefficient, and tolerances of the file that are not those of coefficients.
fn limits(variant: &PreparedVariant, names: &[String], range: ToleranceBox) -> (Vec<VariedParameter>, Vec<String>) {
    let range_of = |name: &String, lower: f64, upper: f64| VariedParameter {
        name: name.clone(),
        factors: Interval { lower, upper },
    };
    match range {
        ToleranceBox::Part(part) => {
            (names.iter().map(|name| range_of(name, 1.0 - part, 1.0 + part)).collect(), Vec::new())
        }
        ToleranceBox::File => {
            let tolerances = &variant.model.tolerances;
            let of = |name: &String| match tolerances.iter().find(|one| one.parameter == *name) {
                Some(one) => {
                    let part = |x: &Exact| x.to_f64() / one.nominal.to_f64();
                    range_of(name, part(&one.lower), part(&one.upper))
                }
                None => range_of(name, 1.0, 1.0),
            };
            let unvaried = tolerances.iter().filter(|one| !names.contains(&one.parameter));
            (names.iter().map(of).collect(), unvaried.map(|one| format!("`{}`", one.parameter)).collect())
        }
    }
}

/// The largest value over the corners of the box that a search finds: coefficient by coefficient to its better end, until
/// no value increases, from the corner given by the slopes at the centre point and from the corners next to given points.
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
