//! Frequencies at which responses are evaluated, dense where they curve.

use faer::c64;
use kardan_rt::functions::{log10, powf};
use rayon::prelude::*;

use super::Response;

/// Frequencies in a decade, before any are added.
const PER_DECADE: f64 = 24.0;
/// Most frequencies that are evaluated.
const MOST: usize = 500;
/// Parts of the larger of two neighbours by which a curve may move between them.
const MOVES: f64 = 0.22;
/// Rounds in which frequencies are added.
const ROUNDS: usize = 12;
/// The factor by which the range exceeds the slowest and the fastest pole.
const BEYOND: f64 = 5.0;
/// Widest range, as a factor.
const WIDEST: f64 = 1e8;
/// Poles below this part of the fastest one are at zero.
const AT_ZERO: f64 = 1e-9;

/// The relevant frequency range of a response, rad/s: whole decades around its poles, up to the Nyquist frequency.
pub fn frequency_range(response: &Response) -> [f64; 2] {
    let nyquist = response.nyquist();
    let all = response.pole_frequencies();
    let fastest = all.iter().copied().filter(|pole| pole.is_finite()).fold(0.0, f64::max);
    let moving = all.into_iter().filter(|pole| pole.is_finite() && *pole > AT_ZERO * fastest);
    let slowest = moving.fold(f64::INFINITY, f64::min);
    let (slowest, fastest) = match nyquist {
        _ if slowest.is_finite() => (slowest, fastest),
        Some(nyquist) => (0.01 * nyquist, nyquist),
        None => (1.0, 1.0),
    };
    let up = powf(10.0, log10(fastest * BEYOND).ceil());
    let high = nyquist.unwrap_or(up);
    let low = powf(10.0, log10(slowest / BEYOND).floor()).max(high / WIDEST).min(0.01 * high);
    [low, high]
}

/// Frequencies within a range, ascending, with the value of `evaluate` there: evenly spaced, at the given frequencies, and between two
/// neighbours another one until none of the `curves` moves much from one to the next.
pub fn refined<T: Send>(
    [low, high]: [f64; 2],
    places: &[f64],
    evaluate: &(dyn Fn(f64) -> T + Sync),
    curves: &dyn Fn(&T) -> Vec<c64>,
) -> Vec<(f64, T)> {
    let count = (log10(high / low) * PER_DECADE).ceil().max(1.0) as usize;
    let even = (0..=count).map(|k| if k == count { high } else { low * powf(high / low, k as f64 / count as f64) });
    let mut next: Vec<f64> = even.chain(places.iter().copied().filter(|place| *place > low && *place < high)).collect();
    next.sort_by(f64::total_cmp);
    next.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-9);
    let mut points: Vec<(f64, T, Vec<c64>)> = Vec::new();
    for _ in 0..=ROUNDS {
        let sampled: Vec<(f64, T)> = next.into_par_iter().map(|frequency| (frequency, evaluate(frequency))).collect();
        points.extend(sampled.into_iter().map(|(frequency, sampled)| {
            let curves = curves(&sampled);
            (frequency, sampled, curves)
        }));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut wide: Vec<(f64, f64)> = points
            .windows(2)
            .map(|pair| (movement(&pair[0].2, &pair[1].2), (pair[0].0 * pair[1].0).sqrt()))
            .filter(|(movement, _)| *movement > MOVES)
            .collect();
        wide.sort_by(|a, b| b.0.total_cmp(&a.0));
        wide.truncate(MOST.saturating_sub(points.len()));
        next = wide.into_iter().map(|(_, frequency)| frequency).collect();
        if next.is_empty() {
            break;
        }
    }
    points.into_iter().map(|(frequency, sampled, _)| (frequency, sampled)).collect()
}

/// The largest part of itself by which a curve moves between two neighbours.
fn movement(one: &[c64], other: &[c64]) -> f64 {
    let part = |(a, b): (&c64, &c64)| {
        let size = a.norm_sqr().max(b.norm_sqr()).sqrt();
        if size > 0.0 && size.is_finite() { (*b - *a).norm_sqr().sqrt() / size } else { 0.0 }
    };
    one.iter().zip(other).map(part).fold(0.0, f64::max)
}
