//! Margins for simultaneous errors in several channels.

use faer::{Mat, c64};
use kardan_rt::functions::{exp, hypot, ln, powi};

use super::Response;
use super::response::largest_singular;
use kardan_math::num::golden;

/// Part of the largest bound that was found by which one between two places may be larger.
const LOOSE: f64 = 1e-3;
/// Places at which the worst errors are searched.
const PLACES: usize = 5;
/// Phases of one channel that are tried, before the best is refined.
const PHASES: usize = 24;

/// Margins of a loop for independent errors of all channels at once.
#[derive(Debug, Clone, PartialEq)]
pub struct MultiloopMargin {
    /// α: no set of errors `(1 + δ/2)/(1 − δ/2)` with |δ| below the first was found to make the loop unstable, at the evaluated frequencies; with
    /// the second one set is known that does. The worst lies between.
    pub disk: [f64; 2],
    /// The frequency of that set, rad/s.
    pub frequency: f64,
    /// That set: for each channel the complex factor, real and imaginary part, with which the loop is just not stable.
    pub worst: Vec<(f64, f64)>,
}

/// The disk margin of all channels at once, from both sides.
///
/// The structured singular value of M + ½ with one complex error for each channel, at frequencies next to every pole and in between. From above: the best scaling
/// `D M D⁻¹` at each frequency. From below: the largest spectral radius of M + ½ with its rows rotated. With up to three channels both agree. `None` if an
/// iteration fails.
pub fn multiloop_margin(response: &Response) -> Option<MultiloopMargin> {
    let half = response.balanced();
    let places = half.places();
    // Balancing rows and columns gives no less than the best scaling: most frequencies need no search.
    let mut rough: Vec<(f64, f64)> = places.iter().map(|place| (osborne_scaling(&half.at(*place)).0, *place)).collect();
    rough.sort_by(|a, b| b.0.total_cmp(&a.0));
    if let Some((_, place)) = rough.first().filter(|(bound, _)| !bound.is_finite()) {
        // An uncontrolled rigid-body mode moves with every error.
        let frequency = response.frequency(*place);
        return Some(MultiloopMargin { disk: [0.0; 2], frequency, worst: vec![(1.0, 0.0); response.channels()] });
    }
    let mut looked: Vec<(f64, f64)> = Vec::new();
    let mut level = 0.0f64;
    for (bound, place) in rough {
        if bound <= level {
            break;
        }
        let size = best_scaling(&half.at(place));
        looked.push((size, place));
        level = level.max(size);
    }
    looked.sort_by(|a, b| b.0.total_cmp(&a.0));
    // Between the neighbours of the worst ones.
    let worst: Vec<f64> = looked.iter().take(PLACES).map(|(_, place)| *place).collect();
    for place in worst {
        let k = places.iter().position(|candidate| *candidate == place)?;
        let near = &places[k.saturating_sub(1)..(k + 2).min(places.len())];
        if near.iter().all(|place| *place > 0.0 && place.is_finite()) {
            let (low, high) = (ln(near[0]), ln(near[near.len() - 1]));
            let found = exp(golden(low, high, &|x| -best_scaling(&half.at(exp(x)))));
            looked.push((best_scaling(&half.at(found)), found));
        }
    }
    looked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let level = looked.first()?.0 * (1.0 + LOOSE);
    let found = looked.iter().take(PLACES).map(|(_, place)| {
        let (size, turns) = worst_turns(&half.at(*place));
        (size, *place, turns)
    });
    let (size, place, turns) = found.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let worst = turns.iter().map(|turn| {
        let delta = *turn / size;
        let factor = (1.0 + 0.5 * delta) / (1.0 - 0.5 * delta);
        (factor.re, factor.im)
    });
    Some(MultiloopMargin {
        disk: [1.0 / level, 1.0 / size],
        frequency: response.frequency(place),
        worst: worst.collect(),
    })
}

/// Bounds of the structured singular value of a square matrix, for one complex error of each channel: below by errors that were
/// found, above by a scaling.
///
/// # Panics
/// If the matrix is not square.
pub fn structured_singular_value(matrix: &Mat<c64>) -> [f64; 2] {
    assert_eq!(matrix.nrows(), matrix.ncols(), "an error for each channel");
    [worst_turns(matrix).0, best_scaling(matrix)]
}

/// The largest singular value of `D M D⁻¹` with rows and columns balanced (Osborne), and log D.
fn osborne_scaling(matrix: &Mat<c64>) -> (f64, Vec<f64>) {
    let m = matrix.nrows();
    let mut d = vec![0.0f64; m];
    let size = |i: usize, j: usize| hypot(matrix[(i, j)].re, matrix[(i, j)].im);
    for _ in 0..20 {
        for k in 0..m {
            let off_diagonal = || (0..m).filter(|i| *i != k);
            let row: f64 = off_diagonal().map(|j| powi(size(k, j) * exp(d[k] - d[j]), 2)).sum();
            let column: f64 = off_diagonal().map(|i| powi(size(i, k) * exp(d[i] - d[k]), 2)).sum();
            if row > 0.0 && column > 0.0 {
                d[k] += 0.25 * ln(column / row);
            }
        }
    }
    (scaled(matrix, &d), d)
}

/// The largest singular value of `D M D⁻¹`, with log D.
fn scaled(matrix: &Mat<c64>, d: &[f64]) -> f64 {
    let m = matrix.nrows();
    largest_singular(&Mat::from_fn(m, m, |i, j| matrix[(i, j)] * c64::new(exp((d[i] - d[j]).clamp(-60.0, 60.0)), 0.0)))
}

/// The largest singular value of `D M D⁻¹` with the best diagonal D.
///
/// From balanced rows and columns by line searches in log D, in which the value is convex.
fn best_scaling(matrix: &Mat<c64>) -> f64 {
    let m = matrix.nrows();
    let (mut best, mut d) = osborne_scaling(matrix);
    let value = |d: &[f64]| scaled(matrix, d);
    // Over single channels, then over sums of them, as kinks stop the former.
    let directions: Vec<Vec<f64>> = (1..1usize << m.saturating_sub(1).min(4))
        .map(|bits| (0..m).map(|k| f64::from(u8::from(bits >> k & 1 == 1))).collect())
        .chain((1..m).flat_map(|k| (k + 1..m).map(move |j| (k, j))).map(|(k, j)| {
            let entry = |i: usize| match i {
                i if i == k => 1.0,
                i if i == j => -1.0,
                _ => 0.0,
            };
            (0..m).map(entry).collect()
        }))
        .collect();
    for round in 0..if m > 1 { 12 } else { 0 } {
        let before = best;
        for direction in &directions {
            let moved_scaling = |t: f64| -> Vec<f64> { d.iter().zip(direction).map(|(d, x)| d + t * x).collect() };
            let reach = if round == 0 { 4.0 } else { 0.5 };
            let t = golden(-reach, reach, &|t| value(&moved_scaling(t)));
            let found = value(&moved_scaling(t));
            if found < best {
                (best, d) = (found, moved_scaling(t));
            }
        }
        if before - best <= 1e-9 * best {
            break;
        }
    }
    best
}

/// Turns of the channels with the largest spectral radius of `diag(turns) M`, such that one eigenvalue is real and positive.
fn worst_turns(matrix: &Mat<c64>) -> (f64, Vec<c64>) {
    let m = matrix.nrows();
    let largest = |angles: &[f64]| {
        let rotated = Mat::from_fn(m, m, |i, j| matrix[(i, j)] * c64::cis(angles[i]));
        let all = rotated.eigenvalues().unwrap_or_default();
        all.into_iter().max_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr())).unwrap_or_default()
    };
    let value = |angles: &[f64]| largest(angles).norm_sqr().sqrt();
    let mut best = (value(&vec![0.0; m]), vec![0.0; m]);
    let step = std::f64::consts::TAU / PHASES as f64;
    for start in 0..4 {
        let mut angles: Vec<f64> = (0..m).map(|k| f64::from(start * (k as i32)) * 1.7).collect();
        let mut now = value(&angles);
        for _ in 0..12 {
            let before = now;
            for k in 1..m {
                let with = |x: f64| {
                    let mut changed_angles = angles.clone();
                    changed_angles[k] = x;
                    changed_angles
                };
                let tried = (0..PHASES).map(|j| angles[k] + step * j as f64);
                let rough = tried.map(|x| (value(&with(x)), x)).max_by(|a, b| a.0.total_cmp(&b.0));
                let rough = rough.map_or(angles[k], |x| x.1);
                let fine = golden(rough - step, rough + step, &|x| -value(&with(x)));
                let found = value(&with(fine));
                if found > now {
                    (now, angles) = (found, with(fine));
                }
            }
            if now - before <= 1e-12 * now {
                break;
            }
        }
        if now > best.0 {
            best = (now, angles);
        }
    }
    let value = largest(&best.1);
    let back = value.conj() / best.0;
    (best.0, best.1.iter().map(|angle| c64::cis(*angle) * back).collect())
}
