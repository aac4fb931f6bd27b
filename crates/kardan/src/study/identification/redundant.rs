//! Redundant measurements: by the constraints the motion of some shafts determines that of others, and the logs may contradict this.

use super::channels::Quantity;
use super::fitting::Chosen;
use super::numbers::{rms, short};
use super::plant::{Plant, in_coordinates};
use super::rows::Material;
use kardan_identify::{LeastSquares, Reading};
use kardan_math::num::{Rational, dot};
use kardan_mechanics::reduce::Kinematics;
use kardan_schema::diagnostics::quoted;

/// Multiple of the noise from which a difference is significant.
const LOUD: f64 = 3.0;
/// Largest residual fraction of the deviation with other coefficients, and the fraction by which these must differ.
const RESIDUAL_SHARE: f64 = 0.5;
const APART: f64 = 1e-3;
/// Fraction of the squared deviation explained by the torque from which kardan reports it.
const GOES: f64 = 0.3;
/// Part of the range that counts as its end, and the fraction of the windows at either end from which it is backlash: for a sine 0.41.
const NEAR_END: f64 = 0.1;
const AT_ENDS: f64 = 0.55;
/// Fewest consecutive windows of a log.
const FEWEST: usize = 8;
/// Fraction of the windows omitted at either end of the range of the deviation.
const TAIL: f64 = 0.02;
/// Factors of wrong units on a reading, and the tolerance of the match.
const UNITS: [(f64, &str); 6] = [
    (180.0 / std::f64::consts::PI, "deg for rad"),
    (30.0 / std::f64::consts::PI, "rpm for rad/s"),
    (2.0 * std::f64::consts::PI, "revolutions for rad"),
    (360.0, "revolutions for deg"),
    (1000.0, "a thousandth of the unit for the unit"),
    (60.0, "1/min for 1/s"),
];
const NEAR: f64 = 0.01;

/// A measured motion that other ones determine.
struct Redundant {
    signal: String,
    unit: &'static str,
    /// Elements whose constraints contain it, with their coefficients of it.
    ties: Vec<(String, f64)>,
    /// Signals that determine it.
    of: Vec<String>,
    coefficients: Vec<f64>,
    /// Motions, window by window: those that determine it, without their means over a log, then its own.
    rows: Vec<f64>,
    /// Torques of the measured inputs in the same windows.
    torques: Vec<f64>,
    /// Noise of the difference.
    noise: f64,
    /// Whether it is a rate.
    rate: bool,
}

/// Compares all redundant measurements, and reports contradictions of the constraints as warnings and notes.
pub(super) fn report_contradictions(plant: &Plant, material: &Material<'_>, out: &mut Chosen) {
    let kinematics = Kinematics::new(&plant.reduced);
    let basis = plant.basis();
    for (slot, quantity) in material.slots.iter().enumerate() {
        let (Quantity::Angle(shaft, _) | Quantity::Speed(shaft, _)) = quantity else { continue };
        let Some(number) = plant.reduced.coordinate(shaft).filter(|number| !kinematics.is_varying(*number)) else {
            continue;
        };
        let coefficients = in_coordinates(&[(number, Rational::ONE)], &basis);
        if let Some(found) = Redundant::new(plant, material, slot, (number, coefficients)) {
            found.report(plant, out);
        }
    }
}

impl Redundant {
    /// The motion of a slot, if other ones determine it.
    fn new(
        plant: &Plant,
        material: &Material<'_>,
        slot: usize,
        (shaft, coefficients): (usize, Vec<f64>),
    ) -> Option<Self> {
        let quantity = &material.slots[slot];
        let is_angle = matches!(quantity, Quantity::Angle(..));
        if plant.sensors.iter().any(|(angle, speed)| *angle == Some(slot) || (*speed == Some(slot) && angle.is_none()))
        {
            return None;
        }
        let with: Vec<usize> = (0..coefficients.len()).filter(|&k| coefficients[k] != 0.0).collect();
        let own = plant.sensors.iter().any(|(_, speed)| *speed == Some(slot));
        let rate = !is_angle || with.iter().any(|&k| plant.sensors[k].0.is_none());
        // Of the speed of a coordinate whose angle is measured too, that.
        let source = |k: usize| match plant.sensors[k] {
            (Some(angle), speed) if !rate || own || speed.is_none() => (angle, rate),
            (_, speed) => (speed.unwrap_or(slot), false),
        };
        let sources: Vec<(usize, bool)> = with.iter().map(|&k| source(k)).collect();
        let of = |row: &[Reading], (slot, first): (usize, bool)| if first { row[slot].first } else { row[slot].value };
        let target = (slot, is_angle && rate);
        let mut out = Self {
            signal: quantity.signal(),
            unit: quantity.unit(),
            ties: Vec::new(),
            of: sources.iter().map(|(slot, _)| material.slots[*slot].signal()).collect(),
            coefficients: with.iter().map(|&k| coefficients[k]).collect(),
            rows: Vec::new(),
            torques: Vec::new(),
            noise: 0.0,
            rate,
        };
        let rows = plant.reduced.equations.constraints.iter().filter(|_| !own);
        out.ties = rows
            .filter_map(|row| {
                let (_, x) = row.row.iter().find(|(candidate, _)| *candidate == shaft)?;
                Some((row.element.clone(), kardan_math::num::rational_to_f64(x)))
            })
            .collect();
        let width = with.len() + 1;
        let variance = |row: &[Reading], (slot, first): (usize, bool)| {
            let gain =
                if first { Reading::FIRST_GAIN / (material.window * material.window) } else { Reading::VALUE_GAIN };
            material.noise[slot] * material.noise[slot] * gain / row[slot].samples.max(1) as f64
        };
        let (mut square, mut count) = (0.0, 0.0);
        for recording in material.recorded {
            let sections: std::collections::BTreeSet<usize> =
                recording.windows.keys().map(|(section, _)| *section).collect();
            for section in sections {
                let first = out.rows.len();
                for (_, row) in recording.windows.iter().filter(|((own, _), _)| *own == section) {
                    let all: Vec<f64> = sources.iter().chain([&target]).map(|one| of(row, *one)).collect();
                    if all.iter().any(|x| !x.is_finite()) {
                        continue;
                    }
                    let of_sources = sources.iter().zip(&out.coefficients).map(|(one, k)| k * k * variance(row, *one));
                    square += of_sources.sum::<f64>() + variance(row, target);
                    count += 1.0;
                    out.rows.extend(all);
                    out.torques.extend(plant.torques.iter().map(|slot| slot.map_or(0.0, |slot| row[slot].value)));
                }
                if (out.rows.len() - first) / width < FEWEST {
                    out.rows.truncate(first);
                    out.torques.truncate(first / width * plant.torques.len());
                    continue;
                }
                center(&mut out.rows[first..], width);
            }
        }
        out.noise = (square / f64::max(count, 1.0)).sqrt();
        (!out.rows.is_empty()).then_some(out)
    }

    /// Its deviation from the computed motion, window by window.
    fn apart(&self) -> Vec<f64> {
        let one = |row: &[f64]| row[self.of.len()] - dot(&row[..self.of.len()], &self.coefficients);
        self.rows.chunks_exact(self.of.len() + 1).map(one).collect()
    }

    /// Reports its contradiction, if any.
    fn report(&self, plant: &Plant, out: &mut Chosen) {
        let apart = self.apart();
        let before = rms(apart.len(), |k| apart[k]);
        if before <= LOUD * self.noise {
            return;
        }
        let mut problem = LeastSquares::new(self.of.len());
        for row in self.rows.chunks_exact(self.of.len() + 1) {
            problem.add(&row[..self.of.len()], row[self.of.len()], 1.0);
        }
        if let Some(found) = problem.solve().filter(|found| found.undetermined.is_empty()) {
            let differs = found.values.iter().zip(&self.coefficients).any(|(a, b)| (a - b).abs() > APART * b.abs());
            if differs && found.residual < RESIDUAL_SHARE * before {
                out.warnings.push(self.wrong_ratio(&found.values));
                return;
            }
        }
        if !self.rate && !self.ties.is_empty() {
            self.report_backlash(plant, &apart, out);
        }
    }

    fn wrong_ratio(&self, found: &[f64]) -> String {
        let sum = |of: &[f64]| {
            let part = |(x, name): (&f64, &String)| {
                let inverse =
                    if x.abs() < 1.0 && *x != 0.0 { format!(" (1 to {})", short(1.0 / x)) } else { String::new() };
                format!("{} {name}{inverse}", short(*x))
            };
            of.iter().zip(&self.of).map(part).collect::<Vec<_>>().join(" + ")
        };
        let by = match self.ties.as_slice() {
            [] => "it must be".to_string(),
            ties => format!("by {} it would be", quoted(ties.iter().map(|(name, _)| name.as_str()))),
        };
        let quotients: Vec<f64> = found.iter().zip(&self.coefficients).map(|(a, b)| a / b).collect();
        let all = |near: f64| quotients.iter().all(|q| (q / near - 1.0).abs() < NEAR);
        let unit = |size: f64, word: &str| [size, 1.0 / size].iter().any(|x| all(*x)).then(|| word.to_string());
        let units = UNITS.iter().find_map(|(size, word)| unit(*size, word).or_else(|| unit(-size, word)));
        let hint = match (all(-1.0), units, self.ties.is_empty()) {
            (true, ..) => "a sign is wrong: of the ratio, or of a channel (`factor = -1`)".into(),
            (_, Some(unit), _) => format!("a channel probably has another unit ({unit}): set it with `unit`"),
            (.., true) => "check the unit or the scale of both channels".into(),
            _ => "correct the ratio, or the unit or the scale of a channel".to_string(),
        };
        format!("measured, {} is {}, and {by} {}: {hint}", self.signal, sum(found), sum(&self.coefficients))
    }

    /// Reports backlash or twist, if the deviation stays within bounds.
    fn report_backlash(&self, plant: &Plant, apart: &[f64], out: &mut Chosen) {
        let mut sorted = apart.to_vec();
        sorted.sort_by(f64::total_cmp);
        let tail = (TAIL * sorted.len() as f64) as usize;
        let range = sorted[sorted.len() - 1 - tail] - sorted[tail];
        let inputs = plant.torques.len();
        let column = |k: usize, sign: bool| -> Vec<f64> {
            let torques = self.torques.iter().skip(k).step_by(inputs.max(1));
            torques.map(|x| if sign { x.signum() } else { *x }).collect()
        };
        let measured = (0..inputs).filter(|&k| plant.torques[k].is_some());
        let best = |sign: bool| {
            let rated = measured.clone().map(|k| (k, explained(&column(k, sign), apart)));
            rated.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
        };
        let ((motor, by_sense), (_, by_torque)) = (best(true), best(false));
        let names = quoted(self.ties.iter().map(|(name, _)| name.as_str()));
        let size = format!(
            "{} differs from the value that {names} gives for {} by up to {} {}, {} times the noise",
            self.signal,
            self.of.join(", "),
            short(range / 2.0),
            self.unit,
            short((range / 2.0 / self.noise).round())
        );
        let (element, factor) = &self.ties[0];
        // Backlash stays at either end; a twist passes the middle as often.
        let near_end = |x: &&f64| (**x - sorted[tail]).min(sorted[sorted.len() - 1 - tail] - **x) < NEAR_END * range;
        let at_ends = apart.iter().filter(near_end).count() as f64 > AT_ENDS * apart.len() as f64;
        if by_sense > GOES && (by_sense > by_torque || at_ends) {
            out.warnings.push(format!(
                "{size}; the sign follows that of the torque of {}: backlash; give `{element}` a \
                 `backlash = \"{} {}\"` and identify it with `--parameters {element}.backlash`",
                plant.reduced.equations.inputs[motor].element,
                short(range * factor.abs()),
                self.unit,
            ));
        } else if by_torque > GOES {
            out.notes.push(format!("{size}, proportional to a torque: a part that is rigid in the model twists"));
        } else {
            out.notes.push(format!("{size}: backlash, twist, or readings taken at different times"));
        }
    }
}

/// Subtracts the mean of each column from rows of this width.
fn center(rows: &mut [f64], width: usize) {
    let count = (rows.len() / width) as f64;
    for k in 0..width {
        let mean = rows.iter().skip(k).step_by(width).sum::<f64>() / count;
        rows.iter_mut().skip(k).step_by(width).for_each(|x| *x -= mean);
    }
}

/// The fraction of the square of y that x explains.
fn explained(x: &[f64], y: &[f64]) -> f64 {
    let (x, y) = (&mut x.to_vec(), &mut y.to_vec());
    center(x, 1);
    center(y, 1);
    let both = dot(x, y);
    let size = dot(x, x) * dot(y, y);
    if size > 0.0 { both * both / size } else { 0.0 }
}
