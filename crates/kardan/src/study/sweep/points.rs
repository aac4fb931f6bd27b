//! Sampling: points of a unit cube that depend only on a seed and the number of a sample, and the distributions to which they
//! are mapped.

use kardan_identify::normal_quantile;
use kardan_math::num::Random;

/// Step of the sequence of [`Random`], so that the draw of a number needs no earlier ones.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
/// Rounds of the permutation.
const ROUNDS: u64 = 6;
/// Binary digits of Sobol's directions, which limit the number of points.
const SOBOL_DIGITS: usize = 32;
/// Number of axes with directions.
pub(super) const SOBOL_AXES: usize = 1000;

/// The sampling method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SamplingMethod {
    /// Independent draws.
    Random,
    /// Latin hypercube: each axis is divided into as many strips as points, with one point in each (McKay, Beckman, Conover, Technometrics 21, 1979, 239).
    LatinHypercube,
    /// Sobol's sequence with the directions of Joe and Kuo (SIAM J. Sci. Comput. 30, 2008, 2635), shifted by the seed in its binary digits.
    Sobol,
    /// Halton's sequence (Numer. Math. 2, 1960, 84), shifted by the seed (Cranley and Patterson).
    Halton,
    /// Every combination of this many values of each axis, from end to end.
    Levels(u64),
    /// Two samples A and B of Sobol's sequence, then A with one axis after another taken from B (Saltelli and others, Comput. Phys. Commun. 181, 2010, 259).
    Saltelli,
    /// Paths on which one axis after another moves by a fraction of its probability, in random order (Morris, Technometrics 33, 1991, 161); they start anywhere
    /// within the possible range, so that no grid hides periodic effects.
    Morris,
}

/// Step of the paths of Morris in probability: not a half or a third, which could be a period.
pub(super) const MORRIS_STEP: f64 = 0.6;

impl SamplingMethod {
    /// Whether points are draws of the distributions.
    pub fn draws(self) -> bool {
        matches!(self, Self::Random | Self::LatinHypercube | Self::Sobol | Self::Halton)
    }

    /// The names in files, in order.
    pub fn named(word: &str, levels: u64) -> Self {
        match word {
            "random" => Self::Random,
            "sobol" => Self::Sobol,
            "halton" => Self::Halton,
            "corners" => Self::Levels(2),
            "grid" => Self::Levels(levels),
            "saltelli" => Self::Saltelli,
            "morris" => Self::Morris,
            _ => Self::LatinHypercube,
        }
    }

    pub fn word(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::LatinHypercube => "latin_hypercube",
            Self::Sobol => "sobol",
            Self::Halton => "halton",
            Self::Levels(2) => "corners",
            Self::Levels(_) => "grid",
            Self::Saltelli => "saltelli",
            Self::Morris => "morris",
        }
    }

    /// Samples of one group, for a number of axes, or of factors that move together.
    pub fn group(self, axes: usize) -> u64 {
        match self {
            Self::Saltelli => axes as u64 + 2,
            Self::Morris => axes as u64 + 1,
            _ => 1,
        }
    }
}

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

/// Axes of these distributions, each with its name, for the number of points; a grid has one point per combination. `factors`
/// gives the factor of each axis, by number; empty: each axis separately.
pub(super) fn axes<'d>(
    sampling: SamplingMethod,
    (seed, points): (u64, u64),
    spread: impl Iterator<Item = (&'d str, &'d Distribution)>,
    factors: &[usize],
) -> Vec<Axis> {
    let spread: Vec<_> = spread.collect();
    let mut directions = Vec::new();
    let dimensions = match sampling {
        SamplingMethod::Sobol => spread.len(),
        SamplingMethod::Saltelli => 2 * spread.len(),
        _ => 0,
    };
    if dimensions > 0 {
        let parameters = sobol::params::JoeKuoD6::standard();
        directions = sobol::Sobol::<f64>::init_direction_vals(dimensions, SOBOL_DIGITS, &parameters);
    }
    let draws: Vec<u64> = spread.iter().map(|(name, _)| Random::named(seed, name).next_u64()).collect();
    let default_factors: Vec<usize> = (0..spread.len()).collect();
    let factors = if factors.is_empty() { &default_factors } else { factors };
    let group = sampling.group(moved(factors));
    let (mut samples_per_level, mut base) = (1u64, 1u64);
    let axis = |(k, (name, distribution)): (usize, &(&str, &Distribution))| {
        let mut random = Random::named(seed, name);
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
                let count = distribution.levels(levels);
                let own = samples_per_level;
                samples_per_level = samples_per_level.saturating_mul(count);
                Axis::Levels { samples_per_level: own, count }
            }
            SamplingMethod::Saltelli => {
                let mut sobol = |k: usize| {
                    Box::new(Axis::Sobol { directions: std::mem::take(&mut directions[k]), shift: random.next_u64() })
                };
                let (own, resampled) = (sobol(k), sobol(k + spread.len()));
                Axis::Saltelli { own, resampled, number: factors[k] as u64, group }
            }
            SamplingMethod::Morris => Axis::Morris { draws: draws[k], group_draws: draws.clone(), number: k },
        }
    };
    spread.iter().enumerate().map(axis).collect()
}

/// The number of independent factors.
pub(super) fn moved(factors: &[usize]) -> usize {
    factors.iter().max().map_or(0, |last| last + 1)
}

/// The number of combinations of a grid.
pub(super) fn combinations<'d>(levels: u64, spread: impl Iterator<Item = &'d Distribution>) -> u64 {
    spread.map(|distribution| distribution.levels(levels)).fold(1, u64::saturating_mul)
}

fn next_prime(after: u64) -> u64 {
    let is_prime = |n: &u64| (2..*n).take_while(|k| k * k <= *n).all(|k| !n.is_multiple_of(k));
    (after + 1..).find(is_prime).unwrap_or(after)
}

impl Axis {
    /// The coordinates of the point of a number, from 0 to 1; at an end only on a grid.
    pub fn at(&self, number: u64) -> f64 {
        let drawn = |draws: u64| {
            let draw = Random::new(draws.wrapping_add(number.wrapping_mul(STEP))).next_u64() >> 11;
            (draw as f64 + 0.5) / (1u64 << 53) as f64
        };
        let place = match self {
            Self::Random { draws } => drawn(*draws),
            Self::Strips { count, draws, keys } => {
                (permuted(number % count, *count, *keys) as f64 + drawn(*draws)) / *count as f64
            }
            Self::Sobol { directions, shift } => {
                let gray = number ^ (number >> 1);
                let own = directions.iter().enumerate().filter(|(digit, _)| gray >> digit & 1 == 1);
                let digits = own.fold(*shift, |sum, (_, direction)| sum ^ direction);
                ((digits >> 11) as f64 + 0.5) / (1u64 << 53) as f64
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
                let (start, up) = (((own >> 11) as f64 + 0.5) / (1u64 << 53) as f64, own & 1 == 1);
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

/// The distribution of a value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Distribution {
    /// Uniform between two values.
    Uniform { from: f64, to: f64 },
    /// Normal, cut off at two ends, which may be infinite.
    Normal { mean: f64, deviation: f64, from: f64, to: f64 },
    /// Two normal halves that meet at the peak, cut off at two ends (Fechner's two-piece normal): with equal probability below a quantile of the one and above that of
    /// the other, both by their own deviations.
    Halves { peak: f64, below: f64, above: f64, from: f64, to: f64 },
    /// Triangular: rising from one end to the peak and falling to the other.
    Triangular { from: f64, peak: f64, to: f64 },
    /// Only these values, with equal probability.
    Listed(Vec<f64>),
}

impl Distribution {
    /// The number of its values on a grid.
    fn levels(&self, levels: u64) -> u64 {
        if let Self::Listed(values) = self { values.len() as u64 } else { levels }
    }

    /// Whether it has a minimum and a maximum.
    pub fn has_ends(&self) -> bool {
        !self.is_open().contains(&true)
    }

    /// Whether it is unbounded below, and above.
    pub fn is_open(&self) -> [bool; 2] {
        match self {
            Self::Normal { from, to, .. } | Self::Halves { from, to, .. } => [from.is_infinite(), to.is_infinite()],
            _ => [false; 2],
        }
    }

    /// The quantile of this probability.
    pub fn quantile(&self, part: f64) -> f64 {
        match self {
            Self::Uniform { from, to } => (from + (to - from) * part).clamp(*from, *to),
            Self::Normal { mean, deviation, from, to } => {
                let [low, high] = [from, to].map(|end| normal_below((end - mean) / deviation));
                let part = low + (high - low) * part;
                (mean - deviation * normal_quantile(part)).clamp(*from, *to)
            }
            Self::Halves { peak, below, above, from, to } => {
                // The probability below the peak, and below a value.
                let left = below / (below + above);
                let part_below = |value: f64| match value < *peak {
                    true => 2.0 * left * normal_below((value - peak) / below),
                    false => 1.0 - 2.0 * (1.0 - left) * normal_below((peak - value) / above),
                };
                let [low, high] = [*from, *to].map(part_below);
                let part = low + (high - low) * part;
                let value = match part < left {
                    true => peak - below * normal_quantile(0.5 * part / left),
                    false => peak + above * normal_quantile(0.5 * (1.0 - part) / (1.0 - left)),
                };
                value.clamp(*from, *to)
            }
            Self::Triangular { from, peak, to } => {
                let (width, rise) = (to - from, peak - from);
                let value = match part * width < rise {
                    true => from + (part * width * rise).sqrt(),
                    false => to - ((1.0 - part) * width * (to - peak)).sqrt(),
                };
                value.clamp(*from, *to)
            }
            Self::Listed(values) => values[((part * values.len() as f64) as usize).min(values.len() - 1)],
        }
    }
}

impl Distribution {
    /// The quantile at the probability of a standard normal score.
    pub fn of_score(&self, score: f64) -> f64 {
        match self {
            Self::Normal { mean, deviation, from, to } if from.is_infinite() && to.is_infinite() => {
                mean + deviation * score
            }
            _ => self.quantile(normal_below(score)),
        }
    }
}

/// The quantile of the standard normal distribution.
pub(super) fn score(part: f64) -> f64 {
    -normal_quantile(part)
}

/// The distribution function of the standard normal distribution.
pub(super) fn normal_below(z: f64) -> f64 {
    if z.is_infinite() {
        if z > 0.0 { 1.0 } else { 0.0 }
    } else {
        0.5 * statrs::function::erf::erfc(-z / std::f64::consts::SQRT_2)
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/points.rs"]
mod tests;
