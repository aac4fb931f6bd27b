//! Sensitivity indices of a number, from dedicated samples: indices of Sobol, and elementary effects.

use rayon::prelude::*;

use super::points::MORRIS_STEP;
use kardan_math::num::Random;
use kardan_results::{SweptEffect, SweptIndex};

/// Samples of the bootstrap.
const RESAMPLES: u64 = 1000;
/// Quantiles of the bootstrap's numbers that bound the interval.
const ENDS: [f64; 2] = [0.025, 0.975];
/// Fewest base samples.
const LEAST: usize = 8;

/// First-order and total index of an axis: numbers of A, B, and A with that axis of B, at these base samples.
fn index(groups: &[Vec<f64>], axis: usize, chosen: impl Iterator<Item = usize> + Clone) -> [f64; 2] {
    let count = chosen.clone().count() as f64;
    let mean = chosen.clone().map(|k| 0.5 * (groups[k][0] + groups[k][1])).sum::<f64>() / count;
    let (mut first, mut total, mut variance) = (0.0, 0.0, 0.0);
    for k in chosen {
        let [a, b, mixed] = [0, 1, axis + 2].map(|member| groups[k][member] - mean);
        first += b * (mixed - a);
        total += 0.5 * (a - mixed) * (a - mixed);
        variance += 0.5 * (a * a + b * b);
    }
    [first / variance, total / variance]
}

/// Indices of Sobol of groups of numbers, each of A, B and A with one axis after another of B; `None` for few groups, and for a constant number.
pub(super) fn sobol_indices(groups: &[Vec<f64>], names: &[String], seed: u64) -> Vec<SweptIndex> {
    let n = groups.len();
    let changes = groups.iter().flatten().any(|x| *x != groups[0][0]);
    if n < LEAST || !changes {
        return Vec::new();
    }
    let mut found: Vec<SweptIndex> = (0..names.len())
        .into_par_iter()
        .map(|axis| {
            let [first, total] = index(groups, axis, 0..n);
            let one = |resample: u64| {
                let mut random =
                    Random::new(Random::named(seed, "bootstrap").next_u64() ^ resample.wrapping_mul(0x9e37_79b9));
                let mut random = Random::new(random.next_u64());
                let chosen: Vec<usize> = (0..n).map(|_| random.below(n as u64) as usize).collect();
                index(groups, axis, chosen.iter().copied())
            };
            let all: Vec<[f64; 2]> =
                (0..RESAMPLES).map(one).filter(|pair| pair.iter().all(|x| x.is_finite())).collect();
            let interval = |which: usize| {
                let mut own: Vec<f64> = all.iter().map(|pair| pair[which]).collect();
                own.sort_by(f64::total_cmp);
                ENDS.map(|part| {
                    own.get((part * (own.len().max(1) - 1) as f64).round() as usize).copied().unwrap_or(f64::NAN)
                })
            };
            let (first_interval, total_interval) = (interval(0), interval(1));
            let parameter = names[axis].clone();
            SweptIndex { parameter, first, first_interval, total, total_interval, count: n as u64 }
        })
        .collect();
    found.retain(|one| one.first.is_finite() && one.total.is_finite());
    found.sort_by(|a, b| b.total.total_cmp(&a.total));
    found
}

/// Elementary effects of paths, each with the number of its first sample and its numbers, NaN where there is none.
pub(super) fn effects(
    paths: &[(u64, Vec<f64>)],
    places: impl Fn(u64, usize) -> f64,
    names: &[String],
) -> Vec<SweptEffect> {
    let mut all: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    for (first, path) in paths {
        for (sample, pair) in (*first..).zip(path.windows(2)) {
            let moved = (0..names.len()).find(|axis| places(sample, *axis) != places(sample + 1, *axis));
            let Some(axis) = moved else { continue };
            let sign = (places(sample + 1, axis) - places(sample, axis)).signum();
            let effect = sign * (pair[1] - pair[0]) / MORRIS_STEP;
            if effect.is_finite() {
                all[axis].push(effect);
            }
        }
    }
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let deviation = |of: &[f64]| {
        let middle = mean(of);
        let squares = of.iter().map(|x| (x - middle) * (x - middle)).sum::<f64>();
        (of.len() > 1).then(|| (squares / (of.len() - 1) as f64).sqrt())
    };
    let with_indices = names.iter().zip(&all).filter(|(_, own)| !own.is_empty()).map(|(name, own)| {
        let sizes: Vec<f64> = own.iter().map(|x| x.abs()).collect();
        SweptEffect {
            parameter: name.clone(),
            size: mean(&sizes),
            size_error: deviation(&sizes).map(|x| x / (own.len() as f64).sqrt()),
            mean: mean(own),
            deviation: deviation(own),
            count: own.len() as u64,
        }
    });
    let mut found: Vec<SweptEffect> = with_indices.collect();
    found.sort_by(|a, b| b.size.total_cmp(&a.size));
    found
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/indices.rs"]
mod tests;
