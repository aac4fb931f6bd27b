//! Excitations: candidates within the limits, the choice among them, and the resulting motion.

use kardan_rt::functions::{exp, ln, powi, sin};

use super::inverse::Inverse;
use crate::study::requests::bench_spec::BenchSpec;
use kardan_identify::{
    Coefficient, Excitation, Motion, Regressor, d_optimal, expected_errors, information, undetermined,
};
use kardan_math::num::{Cholesky, Matrix, Random, Scalar};
use kardan_mechanics::equations::Domain;
use kardan_mechanics::reduce::{Kinematics, Reduced};
use kardan_model::tables::ExcitationPlan;
use kardan_results::signal_name;
use kardan_results::{BenchPlan, BenchPoint, DataNumber, PlannedParameter};

/// Fraction of the torque limits that a plan uses; the rest is for the servo loops.
const TORQUE: f64 = 0.8;
/// Most evaluated combinations of speeds.
const MOST_CANDIDATES: usize = 20_000;
/// Sections of sines or steps drawn for each chosen one.
const DRAWS: usize = 6;
/// Stride of the samples of a section that are evaluated for limits and information.
const SAMPLE_STEP: usize = 5;
/// Parts of a plan, if the file does not specify them.
const POINTS: usize = 16;
/// Least speed of a shaft with friction at a constant speed, as a fraction of its limit, if the file gives none.
const LEAST: f64 = 0.05;
/// Longest extension of a constant speed after its dwell, as a fraction of that.
const BEYOND: f64 = 0.5;
/// Highest frequency of a sum of sines, Hz, and the number of sines for each coordinate.
const SINES: (f64, usize) = (4.0, 5);

/// A motion, sample by sample: reduced coordinates (rad), speeds, accelerations. The speed is linear between two samples.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trajectory {
    degrees_of_freedom: usize,
    positions: Vec<f64>,
    speeds: Vec<f64>,
    accelerations: Vec<f64>,
}

impl Trajectory {
    fn new(degrees_of_freedom: usize, period: f64, speeds: Vec<f64>) -> Self {
        let mut positions = vec![0.0; speeds.len()];
        let mut accelerations = vec![0.0; speeds.len()];
        for k in 0..speeds.len().saturating_sub(degrees_of_freedom) {
            let (now, next) = (speeds[k], speeds[k + degrees_of_freedom]);
            accelerations[k] = (next - now) / period;
            positions[k + degrees_of_freedom] = positions[k] + 0.5 * period * (now + next);
        }
        Self { degrees_of_freedom, positions, speeds, accelerations }
    }

    pub fn samples(&self) -> usize {
        self.speeds.len() / self.degrees_of_freedom
    }

    /// Position, speed and acceleration of a sample; after the end those at the end.
    pub fn at(&self, sample: usize) -> Motion<'_> {
        let k = sample.min(self.samples() - 1) * self.degrees_of_freedom;
        let range = k..k + self.degrees_of_freedom;
        Motion {
            position: &self.positions[range.clone()],
            speed: &self.speeds[range.clone()],
            acceleration: &self.accelerations[range],
        }
    }
}

/// The parts of a plan in the order of execution.
pub(super) struct MotionSequence {
    degrees_of_freedom: usize,
    period: f64,
    legs: Vec<Leg>,
}

/// Speeds of the ramp, sample by sample, then constant speeds for a number of samples; neither repeats the sample before.
struct Leg {
    way: Vec<f64>,
    dwell_samples: usize,
}

impl MotionSequence {
    /// The motion, and for each part its measured range of samples. Constant speeds last longer by a random fraction, so that
    /// effects periodic in a shaft angle are not synchronous from one speed to the next.
    pub fn trajectory(&self, seed: u64) -> (Trajectory, Vec<(usize, usize)>) {
        let r = self.degrees_of_freedom;
        let mut random = Random::named(seed, "holds");
        let mut speeds = vec![0.0; r];
        let mut parts = Vec::new();
        for leg in &self.legs {
            let begin = speeds.len() / r - 1;
            speeds.extend(&leg.way);
            let last = speeds[speeds.len() - r..].to_vec();
            let from = speeds.len() / r - 1;
            let dwell_samples = (leg.dwell_samples as f64 * (1.0 + BEYOND * random.unit())).round() as usize;
            (0..dwell_samples).for_each(|_| speeds.extend(&last));
            parts.push((if leg.dwell_samples > 0 { from } else { begin }, speeds.len() / r - 1));
        }
        // The last ramp ends at rest.
        parts.pop();
        (Trajectory::new(r, self.period, speeds), parts)
    }

    /// The longest duration of a motion, s.
    fn longest(&self) -> f64 {
        let samples =
            |leg: &Leg| (leg.way.len() / self.degrees_of_freedom) as f64 + leg.dwell_samples as f64 * (1.0 + BEYOND);
        self.legs.iter().map(samples).sum::<f64>() * self.period
    }
}

/// A candidate: a constant speed, or a section of speeds that begins and ends at rest.
struct Candidate {
    speeds: Vec<f64>,
    rows: Matrix<f64>,
    torques: Vec<f64>,
}

/// Reasons for a missing plan.
pub(super) enum Refusal {
    /// The motors do not drive a motion.
    NotDriven,
    /// A coordinate has no speed limit.
    NoLimit(String),
    /// There are too many combinations to evaluate.
    TooMany(usize),
    /// Too few candidates satisfy the limits.
    NotEnough { candidates: usize, looked: usize, count: usize },
    /// This motion cannot distinguish the requested parameters.
    Undetermined(Vec<String>),
    /// The choice does not determine everything.
    Singular,
    /// It takes too long.
    TooLong(f64),
}

/// The model with the data of a plan.
pub(super) struct Planner<'a> {
    pub reduced: &'a Reduced,
    pub motors: &'a [usize],
    pub spec: &'a BenchSpec,
    /// Coefficients to identify; empty: all identifiable ones.
    pub coefficients: Vec<Coefficient>,
}

impl Planner<'_> {
    fn has_constant_speeds(&self) -> bool {
        self.spec.plan == ExcitationPlan::ConstantSpeeds
    }

    fn excitation(&self) -> Excitation {
        if self.has_constant_speeds() { Excitation::Steady } else { Excitation::Free }
    }

    /// The coefficients among these that this kind of motion can distinguish from all others.
    pub fn determinable(&self, all: &[Coefficient]) -> Vec<Coefficient> {
        let lost = undetermined(self.reduced, all, &[], self.excitation());
        let determined = |column: usize| lost.iter().all(|row| Scalar::is_zero(&row[column]));
        let selected = all.iter().enumerate().filter(|(column, _)| determined(*column));
        selected.map(|(_, one)| one.clone()).collect()
    }

    fn dwell(&self) -> f64 {
        self.spec.dwell.unwrap_or(if self.has_constant_speeds() { 1.0 } else { 4.0 })
    }

    /// Largest speed of each shaft, rad/s.
    fn limits(&self) -> Vec<f64> {
        let limit = |name: &String| match self.spec.speed_limits.iter().find(|(shaft, _)| shaft == name) {
            Some((_, limit)) => *limit,
            None => {
                // Of a grid its largest speed.
                let listed = self.spec.speeds.iter().filter(|(shaft, _)| shaft == name);
                let largest = listed.map(|(_, speed)| speed.abs()).fold(0.0, f64::max);
                if largest > 0.0 { largest } else { f64::INFINITY }
            }
        };
        self.reduced.equations.coordinates.iter().map(limit).collect()
    }

    /// The domain of a coefficient.
    fn domain(&self, one: &Coefficient) -> Domain {
        let element = signal_name::parameter(&one.name).map_or(one.name.as_str(), |(element, _)| element);
        self.reduced.equations.domain_of_element(element)
    }

    /// Least speed of each shaft at a constant speed, rad/s.
    fn least(&self, limits: &[f64]) -> Vec<f64> {
        let equations = &self.reduced.equations;
        let slides =
            |shaft: usize| equations.frictions.iter().any(|term| matches!(&term.row[..], [(s, _)] if *s == shaft));
        let own = |(shaft, name): (usize, &String)| match self.spec.least_speeds.iter().find(|(other, _)| other == name)
        {
            Some((_, speed)) => *speed,
            None if limits[shaft].is_finite() && slides(shaft) => LEAST * limits[shaft],
            None => 0.0,
        };
        equations.coordinates.iter().enumerate().map(own).collect()
    }

    /// The speeds of a coordinate that a grid lists, or `levels` from limit to limit.
    fn levels(&self, coordinate: usize, limits: &[f64]) -> Vec<f64> {
        let shaft = self.reduced.coordinates[coordinate];
        let name = &self.reduced.equations.coordinates[shaft];
        let listed = self.spec.speeds.iter().filter(|(other, _)| other == name).map(|(_, speed)| *speed);
        let mut listed: Vec<f64> = listed.collect();
        listed.dedup();
        if listed.is_empty() {
            let levels = self.spec.levels;
            listed = (0..levels).map(|k| limits[shaft] * (2.0 * k as f64 / (levels - 1) as f64 - 1.0)).collect();
        }
        listed
    }

    /// The plan and the motion.
    pub fn plan(&self, all: &[Coefficient]) -> Result<(BenchPlan, MotionSequence), Refusal> {
        let period = self.spec.period;
        let coefficients =
            if self.coefficients.is_empty() { self.determinable(all) } else { self.coefficients.clone() };
        let lost = undetermined(self.reduced, &coefficients, &[], self.excitation());
        let mixed = |column: &usize| lost.iter().any(|row| !Scalar::is_zero(&row[*column]));
        let mixed: Vec<String> =
            (0..coefficients.len()).filter(mixed).map(|column| coefficients[column].name.clone()).collect();
        if !mixed.is_empty() || coefficients.is_empty() {
            return Err(Refusal::Undetermined(mixed));
        }
        let mut rating = Rating::new(self, &coefficients)?;
        let limits = self.limits();
        if let Some(&free) = self.reduced.coordinates.iter().find(|&&shaft| limits[shaft].is_infinite()) {
            return Err(Refusal::NoLimit(self.reduced.equations.coordinates[free].clone()));
        }
        let shortest = self.count(0) as f64 * self.dwell();
        if !self.has_constant_speeds() && shortest > self.spec.duration {
            return Err(Refusal::TooLong(shortest));
        }
        let (mut candidates, looked) = match self.has_constant_speeds() {
            true => self.constant(&mut rating, &limits)?,
            false => self.sections(&mut rating, &limits),
        };
        let blocks: Vec<Matrix<f64>> =
            candidates.iter_mut().map(|one| std::mem::replace(&mut one.rows, Matrix::zeros(0, 0))).collect();
        let count = self.count(candidates.len());
        if candidates.len() < count {
            return Err(Refusal::NotEnough { candidates: candidates.len(), looked, count });
        }
        let selection = d_optimal(&blocks, count).ok_or(Refusal::Singular)?;
        let found = information(&blocks, selection.chosen.iter().copied());
        let (log_det, errors) = expected_errors(&found).ok_or(Refusal::Singular)?;
        let whole = information(&blocks, 0..blocks.len());
        let share = count as f64 / blocks.len() as f64;
        let p = coefficients.len() as f64;
        let undesigned = expected_errors(&whole).map_or(f64::NEG_INFINITY, |found| found.0) + p * ln(share);
        let (sequence, mut points) = self.simulate_sequence(&mut rating, &candidates, &selection.chosen, &limits)?;
        if sequence.longest() > self.spec.duration {
            return Err(Refusal::TooLong(sequence.longest()));
        }
        let (trajectory, parts) = sequence.trajectory(self.spec.seed);
        for (point, (from, until)) in points.iter_mut().zip(parts) {
            (point.from, point.until) = (from as f64 * period, until as f64 * period);
        }
        let duration = (trajectory.samples() - 1) as f64 * period;
        let parameter = |(one, error): (&Coefficient, f64)| PlannedParameter {
            name: one.name.clone(),
            nominal: one.value,
            unit: one.kind.unit(self.domain(one)).into(),
            standard_error: (self.spec.torque_noise > 0.0).then_some(error),
        };
        let fixed = all.iter().filter(|one| coefficients.iter().all(|candidate| candidate.name != one.name));
        let plan = BenchPlan {
            kind: self.spec.plan.into(),
            fixed: fixed.map(|one| one.name.clone()).collect(),
            parameters: coefficients.iter().zip(errors).map(parameter).collect(),
            points,
            candidates: candidates.len(),
            log_det,
            undesigned_log_det: undesigned,
            gain: exp((log_det - undesigned) / p),
            duration,
        };
        Ok((plan, sequence))
    }

    /// Number of chosen parts.
    fn count(&self, candidates: usize) -> usize {
        let gridded = self.has_constant_speeds() && !self.spec.speeds.is_empty();
        self.spec.points.unwrap_or(if gridded { candidates.max(1) } else { POINTS })
    }

    /// All combinations of the speeds of the coordinates that satisfy the limits and do not creep.
    fn constant(&self, rating: &mut Rating, limits: &[f64]) -> Result<(Vec<Candidate>, usize), Refusal> {
        let r = self.reduced.degrees_of_freedom();
        let levels: Vec<Vec<f64>> = (0..r).map(|i| self.levels(i, limits)).collect();
        let least = self.least(limits);
        let looked = levels.iter().try_fold(1_usize, |all, own| all.checked_mul(own.len())).unwrap_or(usize::MAX);
        if looked > MOST_CANDIDATES {
            return Err(Refusal::TooMany(looked));
        }
        let weight = (self.dwell() / self.spec.period).floor().max(1.0).sqrt();
        let mut out = Vec::new();
        for number in 0..looked {
            let mut index = number;
            let mut speeds = vec![0.0; r];
            for i in (0..r).rev() {
                speeds[i] = levels[i][index % levels[i].len()];
                index /= levels[i].len();
            }
            let rest = vec![0.0; r];
            let motion = Motion { position: &rest, speed: &speeds, acceleration: &rest };
            let creeps = |rating: &Rating| {
                let shafts = &rating.inverse.work.kinematics.speeds;
                shafts.iter().zip(&least).any(|(w, least)| w.abs() < least * (1.0 - 1e-9))
            };
            if !rating.keeps(motion, limits) || creeps(rating) {
                continue;
            }
            let mut rows = Vec::new();
            if rating.rows(motion, weight, &mut rows) {
                out.push(Candidate { speeds, torques: rating.torques.clone(), rows: block(&rows, rating.columns()) });
            }
        }
        Ok((out, looked))
    }

    /// Sections of sines or steps, drawn from the seed and scaled down until they satisfy the limits.
    fn sections(&self, rating: &mut Rating, limits: &[f64]) -> (Vec<Candidate>, usize) {
        let (r, period) = (self.reduced.degrees_of_freedom(), self.spec.period);
        let samples = ((self.dwell() / period).round() as usize).max(10);
        let ramp = ((self.spec.ramp / period).round() as usize).clamp(1, samples / 3);
        let looked = DRAWS * self.count(0);
        let mut random = Random::named(self.spec.seed, self.spec.plan.word());
        let mut out = Vec::new();
        for _ in 0..looked {
            let mut speeds = vec![0.0; samples * r];
            for i in 0..r {
                let profile = match self.spec.plan {
                    ExcitationPlan::Multisine => sines(samples, period, ramp, &mut random),
                    _ => steps(samples, ramp, &mut random),
                };
                let size = limits[self.reduced.coordinates[i]] * (0.3 + 0.7 * random.unit());
                profile.iter().enumerate().for_each(|(k, x)| speeds[k * r + i] = size * x);
            }
            for _ in 0..40 {
                if let Some(candidate) = self.section(rating, &speeds, limits) {
                    out.push(candidate);
                    break;
                }
                speeds.iter_mut().for_each(|x| *x *= 0.85);
            }
        }
        (out, looked)
    }

    fn section(&self, rating: &mut Rating, speeds: &[f64], limits: &[f64]) -> Option<Candidate> {
        let trajectory = Trajectory::new(self.reduced.degrees_of_freedom(), self.spec.period, speeds.to_vec());
        let mut largest = vec![0.0; self.motors.len()];
        let mut rows = Vec::new();
        for sample in (0..trajectory.samples()).step_by(SAMPLE_STEP) {
            let motion = trajectory.at(sample);
            if !rating.keeps(motion, limits) {
                return None;
            }
            largest.iter_mut().zip(&rating.torques).for_each(|(largest, x)| *largest = x.abs().max(*largest));
            rating.rows(motion, (SAMPLE_STEP as f64).sqrt(), &mut rows);
        }
        let rows = block(&rows, rating.columns());
        Some(Candidate { speeds: speeds.to_vec(), rows, torques: largest })
    }

    /// The motion through the candidates chosen, from rest to rest, and when each is measured.
    fn simulate_sequence(
        &self,
        rating: &mut Rating,
        candidates: &[Candidate],
        chosen: &[usize],
        limits: &[f64],
    ) -> Result<(MotionSequence, Vec<BenchPoint>), Refusal> {
        let (r, period) = (self.reduced.degrees_of_freedom(), self.spec.period);
        let constant = self.has_constant_speeds();
        let dwell = ((self.dwell() / period).round() as usize).max(1);
        let mut unplanned: Vec<usize> = chosen.to_vec();
        let mut sequence = MotionSequence { degrees_of_freedom: r, period, legs: Vec::new() };
        let mut points = Vec::new();
        let mut now = vec![0.0; r];
        while !unplanned.is_empty() {
            // Nearest neighbour next, for short ramps.
            let far = |k: usize| -> f64 {
                let scaled = |i: usize| (candidates[k].speeds[i] - now[i]) / limits[self.reduced.coordinates[i]];
                if constant { (0..r).map(|i| powi(scaled(i), 2)).sum() } else { 0.0 }
            };
            let best =
                (0..unplanned.len()).min_by(|&a, &b| far(unplanned[a]).total_cmp(&far(unplanned[b]))).unwrap_or(0);
            let candidate = &candidates[unplanned.remove(best)];
            if constant {
                let way = self.ramp(rating, &now, &candidate.speeds, limits)?;
                now.clone_from(&candidate.speeds);
                sequence.legs.push(Leg { way, dwell_samples: dwell });
            } else {
                sequence.legs.push(Leg { way: candidate.speeds.clone(), dwell_samples: 0 });
            }
            if sequence.longest() > self.spec.duration {
                return Err(Refusal::TooLong(sequence.longest()));
            }
            let motors = self.motors.iter().map(|&k| &self.reduced.equations.inputs[k].element);
            points.push(BenchPoint {
                from: 0.0,
                until: 0.0,
                speeds: named(&self.reduced.equations.coordinates, &rating.shaft_speeds(&candidate.speeds)),
                torques: named(motors, &candidate.torques),
            });
        }
        sequence.legs.push(Leg { way: self.ramp(rating, &now, &vec![0.0; r], limits)?, dwell_samples: 0 });
        Ok((sequence, points))
    }

    /// A straight ramp of the speeds, as long as the torques need.
    fn ramp(&self, rating: &mut Rating, from: &[f64], to: &[f64], limits: &[f64]) -> Result<Vec<f64>, Refusal> {
        let (r, period) = (from.len(), self.spec.period);
        let mut samples = (self.spec.ramp / period).round().max(1.0) as usize;
        loop {
            let length = samples as f64 * period;
            let acceleration: Vec<f64> = (0..r).map(|i| (to[i] - from[i]) / length).collect();
            let at = |part: f64| -> Vec<f64> { (0..r).map(|i| from[i] + part * (to[i] - from[i])).collect() };
            // Torques are linear in the speed except where a friction changes its sign.
            let fits = |k: i32| {
                let speed = at(f64::from(k) / 20.0);
                rating.keeps(Motion { position: &vec![0.0; r], speed: &speed, acceleration: &acceleration }, limits)
            };
            if (0..=20).all(fits) {
                return Ok((1..=samples).flat_map(|k| at(k as f64 / samples as f64)).collect());
            }
            samples = samples * 3 / 2 + 1;
            if samples as f64 * period > self.spec.duration {
                return Err(Refusal::TooLong(samples as f64 * period));
            }
        }
    }
}

/// Data to rate candidates.
struct Rating {
    inverse: Inverse,
    regressor: Regressor,
    kinematics: Kinematics,
    torques: Vec<f64>,
    inputs: usize,
    x: Vec<f64>,
    y: Vec<f64>,
    /// Rows divided by the error of a measurement.
    whiten: Cholesky,
    sigma: f64,
}

impl Rating {
    fn new(planner: &Planner<'_>, coefficients: &[Coefficient]) -> Result<Self, Refusal> {
        let (reduced, motors) = (planner.reduced, planner.motors);
        let r = reduced.degrees_of_freedom();
        let mut inverse = Inverse::new(reduced, motors);
        let mut torques = vec![0.0; motors.len()];
        let rest = vec![0.0; r];
        if !inverse.torques(Motion { position: &rest, speed: &rest, acceleration: &rest }, &mut torques) {
            return Err(Refusal::NotDriven);
        }
        // The reduced torques Gᵀτ have the covariance σ² GᵀG.
        let mut square = Matrix::<f64>::zeros(r, r);
        for &motor in motors {
            square.add_outer(&1.0, &inverse.work.input_rows[motor * r..(motor + 1) * r]);
        }
        let mut whiten = Cholesky::new(r);
        if !whiten.factor(square.as_slice()) {
            return Err(Refusal::NotDriven);
        }
        let inputs = reduced.equations.inputs.len();
        let regressor = Regressor::new(reduced, coefficients, &[], 1e-9);
        let columns = regressor.columns();
        let noise = planner.spec.torque_noise;
        Ok(Self {
            inverse,
            kinematics: Kinematics::new(reduced),
            torques,
            inputs,
            x: vec![0.0; r * columns],
            y: vec![0.0; r],
            regressor,
            whiten,
            sigma: if noise > 0.0 { noise } else { 1.0 },
        })
    }

    fn columns(&self) -> usize {
        self.regressor.columns()
    }

    /// Whether a motion satisfies the limits of speeds and torques; `torques` receives the torques.
    fn keeps(&mut self, motion: Motion<'_>, limits: &[f64]) -> bool {
        let mut torques = std::mem::take(&mut self.torques);
        let driven = self.inverse.torques(motion, &mut torques);
        let slow = |(w, limit): (&f64, &f64)| w.abs() <= limit * (1.0 + 1e-9);
        let fits = driven
            && self.inverse.meets_limits(&torques, TORQUE)
            && self.inverse.work.kinematics.speeds.iter().zip(limits).all(slow);
        self.torques = torques;
        fits
    }

    /// Adds the rows of a motion, in units of the error of the torques; false, and none, if the sign of a friction is unknown.
    fn rows(&mut self, motion: Motion<'_>, weight: f64, out: &mut Vec<f64>) -> bool {
        let (r, p) = (self.y.len(), self.columns());
        if !self.regressor.fill(motion, &vec![0.0; self.inputs], &mut self.x, &mut self.y) {
            return false;
        }
        let mut columns: Vec<Vec<f64>> = (0..p).map(|j| (0..r).map(|i| self.x[i * p + j]).collect()).collect();
        columns.iter_mut().for_each(|column| self.whiten.half_solve(column));
        for i in 0..r {
            out.extend(columns.iter().map(|column| column[i] * weight / self.sigma));
        }
        true
    }

    fn shaft_speeds(&mut self, speeds: &[f64]) -> Vec<f64> {
        let r = self.y.len();
        let rest = vec![0.0; r];
        let mut out: Vec<f64> = vec![0.0; self.kinematics.angles.len()];
        for speed in speeds.chunks_exact(r) {
            self.kinematics.update(&rest, speed);
            for (largest, w) in out.iter_mut().zip(&self.kinematics.speeds) {
                if w.abs() > largest.abs() {
                    *largest = *w;
                }
            }
        }
        if speeds.len() > r { out.into_iter().map(f64::abs).collect() } else { out }
    }
}

fn named<'a>(names: impl IntoIterator<Item = &'a String>, values: &[f64]) -> Vec<DataNumber> {
    names.into_iter().zip(values).map(|(name, value)| DataNumber::new(name, *value)).collect()
}

fn block(rows: &[f64], columns: usize) -> Matrix<f64> {
    Matrix::from_fn(rows.len() / columns, columns, |i, j| rows[i * columns + j])
}

/// Rises smoothly from 0 at the first sample to 1, and falls to 0 at the last one.
fn window(sample: usize, samples: usize, ramp: usize) -> f64 {
    let edge = sample.min(samples - 1 - sample) as f64 / ramp as f64;
    if edge >= 1.0 { 1.0 } else { edge * edge * (3.0 - 2.0 * edge) }
}

/// A sum of sines of random whole periods and phases, largest value one.
fn sines(samples: usize, period: f64, ramp: usize, random: &mut Random) -> Vec<f64> {
    let length = samples as f64 * period;
    let highest = ((SINES.0 * length) as u64).clamp(1, (samples / 20).max(1) as u64);
    let parts: Vec<(f64, f64)> = (0..SINES.1)
        .map(|_| {
            let periods = (1 + random.below(highest)) as f64;
            (std::f64::consts::TAU * periods / samples as f64, std::f64::consts::TAU * random.unit())
        })
        .collect();
    let value = |k: usize| parts.iter().map(|(w, phase)| sin(w * k as f64 + phase)).sum::<f64>();
    let mut out: Vec<f64> = (0..samples).map(|k| window(k, samples, ramp) * value(k)).collect();
    let largest = out.iter().fold(f64::MIN_POSITIVE, |largest: f64, x| largest.max(x.abs()));
    out.iter_mut().for_each(|x| *x /= largest);
    out
}

/// Random speeds of 0.3 to 1 in either direction for random times, with ramps between them and from and to rest.
fn steps(samples: usize, ramp: usize, random: &mut Random) -> Vec<f64> {
    let mut out = Vec::with_capacity(samples);
    let mut now = 0.0;
    while out.len() + 2 * ramp < samples {
        let size = 0.3 + 0.7 * random.unit();
        let next = if random.below(2) == 0 { size } else { -size };
        let dwell_samples = 1 + random.below(2 * ramp as u64) as usize;
        let dwell_samples = dwell_samples.min(samples - 2 * ramp - out.len());
        out.extend((0..ramp).map(|k| now + (next - now) * k as f64 / ramp as f64));
        out.extend(std::iter::repeat_n(next, dwell_samples));
        now = next;
    }
    out.truncate(samples - ramp);
    let now = out.last().copied().unwrap_or(0.0);
    let rest = samples - out.len();
    out.extend((1..=rest).map(|k| now * (1.0 - k as f64 / rest as f64)));
    out
}

#[cfg(test)]
#[path = "../../../tests/unit/study/bench/plan.rs"]
mod tests;
