//! Sampling: points of a unit cube that depend only on a seed and the number of a sample.

use crate::study::requests::sample_space::SampleSpace;
use crate::study::requests::sampling_method::SamplingMethod;
use crate::study::requests::varied::Varied;
use kardan_math::num::{Random, is_prime};

/// Step of the sequence of [`Random`], so that the draw of a number needs no earlier ones.
pub(super) const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
/// Rounds of the permutation.
const ROUNDS: u64 = 6;
/// Binary digits of Sobol's directions, which limit the number of points.
const SOBOL_DIGITS: usize = 32;

/// Step of the paths of Morris in probability: not a half or a third, which could be a period.
pub(super) const MORRIS_STEP: f64 = 0.6;

/// Points along one axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Axis {
    Random {
        draws: u64,
    },
    Strips {
        count: u64,
        draws: u64,
        keys: u64,
    },
    Sobol {
        directions: Vec<u64>,
        shift: u64,
    },
    Halton {
        base: u64,
        shift: f64,
    },
    Levels {
        samples_per_level: u64,
        count: u64,
    },
    /// With the same axis of the other sample, and the number of its factor.
    Saltelli {
        own: Box<Axis>,
        resampled: Box<Axis>,
        number: u64,
        group: u64,
    },
    Morris {
        draws: u64,
        group_draws: Vec<u64>,
        number: usize,
    },
}

/// Axes of the varied parameters for the number of points by a method; a grid has one point per combination.
pub(super) fn axes(sampling: SamplingMethod, (seed, points): (u64, u64), space: &SampleSpace) -> Vec<Axis> {
    let varied = &space.varied;
    let mut directions = Vec::new();
    let dimensions = match sampling {
        SamplingMethod::Sobol => varied.len(),
        SamplingMethod::Saltelli => 2 * varied.len(),
        _ => 0,
    };
    if dimensions > 0 {
        let parameters = sobol::params::JoeKuoD6::standard();
        directions = sobol::Sobol::<f64>::init_direction_vals(dimensions, SOBOL_DIGITS, &parameters);
    }
    let draws: Vec<u64> = varied.iter().map(|one| Random::named(seed, &one.name).next_u64()).collect();
    let (factors, group) = (space.factors(), space.group());
    let (mut samples_per_level, mut base) = (1u64, 1u64);
    let axis = |(k, one): (usize, &Varied)| {
        let mut random = Random::named(seed, &one.name);
        match sampling {
            SamplingMethod::Random => Axis::Random { draws: random.next_u64() },
            SamplingMethod::LatinHypercube => {
                Axis::Strips { count: points, draws: random.next_u64(), keys: random.next_u64() }
            }
            SamplingMethod::Sobol => {
                Axis::Sobol { directions: std::mem::take(&mut directions[k]), shift: random.next_u64() }
            }
            SamplingMethod::Halton => {
                base = next_prime(base);
                Axis::Halton { base, shift: random.next_u64() as f64 / u64::MAX as f64 }
            }
            SamplingMethod::Levels(levels) => {
                let count = one.distribution.levels(levels);
                let own = samples_per_level;
                samples_per_level = samples_per_level.saturating_mul(count);
                Axis::Levels { samples_per_level: own, count }
            }
            SamplingMethod::Saltelli => {
                let mut sobol = |k: usize| {
                    Box::new(Axis::Sobol { directions: std::mem::take(&mut directions[k]), shift: random.next_u64() })
                };
                let (own, resampled) = (sobol(k), sobol(k + varied.len()));
                Axis::Saltelli { own, resampled, number: factors[k] as u64, group }
            }
            SamplingMethod::Morris => Axis::Morris { draws: draws[k], group_draws: draws.clone(), number: k },
        }
    };
    varied.iter().enumerate().map(axis).collect()
}

fn next_prime(after: u64) -> u64 {
    (after + 1..).find(|n| is_prime(*n)).unwrap_or(after)
}

impl Axis {
    /// The coordinates of the point of a number, from 0 to 1; at an end only on a grid.
    pub fn at(&self, number: u64) -> f64 {
        // Between 0 and 1, never at an end.
        let unit = |draw: u64| ((draw >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
        let drawn = |draws: u64| unit(Random::new(draws.wrapping_add(number.wrapping_mul(STEP))).next_u64());
        let place = match self {
            Self::Random { draws } => drawn(*draws),
            Self::Strips { count, draws, keys } => {
                (permuted(number % count, *count, *keys) as f64 + drawn(*draws)) / *count as f64
            }
            Self::Sobol { directions, shift } => {
                let gray = number ^ (number >> 1);
                let own = directions.iter().enumerate().filter(|(digit, _)| gray >> digit & 1 == 1);
                unit(own.fold(*shift, |sum, (_, direction)| sum ^ direction))
            }
            Self::Halton { base, shift } => (radical_inverse(number, *base) + shift).fract(),
            Self::Saltelli { own, resampled, number: axis, group } => {
                let member = number % group;
                let from = if member == 1 || member == axis + 2 { resampled } else { own };
                return from.at(number / group);
            }
            Self::Morris { draws, group_draws, number: axis } => {
                let group = group_draws.len() as u64 + 1;
                let (path, step) = (number / group, (number % group) as usize);
                let draw = |draws: u64| Random::new(draws.wrapping_add(path.wrapping_mul(STEP)));
                let key = |one: usize| (draw(group_draws[one]).next_u64(), one);
                let turn = (0..group_draws.len()).filter(|i| key(*i) < key(*axis)).count();
                // One draw: the next one is that of another path.
                let own = draw(draws.wrapping_add(1)).next_u64();
                let (start, up) = (unit(own), own & 1 == 1);
                let high = up == (step > turn);
                (1.0 - MORRIS_STEP) * start + if high { MORRIS_STEP } else { 0.0 }
            }
            // From the one end to the other, exactly.
            Self::Levels { count: 1, .. } => return 0.5,
            Self::Levels { samples_per_level, count } => {
                return (number / samples_per_level % count) as f64 / (count - 1) as f64;
            }
        };
        place.clamp(f64::MIN_POSITIVE, 1.0 - 0.5 * f64::EPSILON)
    }
}

/// The digits of a number to a base, in reverse order after the point.
fn radical_inverse(mut number: u64, base: u64) -> f64 {
    let (mut inverse, mut digit) = (0.0, 1.0 / base as f64);
    while number > 0 {
        inverse += (number % base) as f64 * digit;
        number /= base;
        digit /= base as f64;
    }
    inverse
}

/// A permutation of the numbers below the count: a Feistel network over the next power of four, iterated until the result is below.
fn permuted(number: u64, count: u64, keys: u64) -> u64 {
    let bits = (u64::BITS - (count.max(2) - 1).leading_zeros()).div_ceil(2);
    let mask = (1u64 << bits) - 1;
    let mut number = number;
    loop {
        let (mut left, mut right) = (number >> bits, number & mask);
        for round in 0..ROUNDS {
            let mixed = Random::new(keys.wrapping_add(round.wrapping_mul(STEP)) ^ right).next_u64() & mask;
            (left, right) = (right, left ^ mixed);
        }
        number = left << bits | right;
        if number < count {
            return number;
        }
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/points.rs"]
mod tests;
