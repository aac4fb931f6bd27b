//! Where samples lie: points of a unit cube that follow from a seed and the number of a sample alone, and the distributions that they
//! are taken to.

use crate::identify::normal_quantile;
use crate::num::Random;

/// Step of the sequence of [`Random`], so that the draw of a number follows without those before it.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
/// Rounds of the permutation.
const ROUNDS: u64 = 6;

/// How points fill the cube.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Filling {
    /// Each one drawn by itself.
    Random,
    /// Each axis has one point in each of as many strips as there are points (McKay, Beckman, Conover, Technometrics 21, 1979, 239).
    LatinHypercube,
}

/// Points along one axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    filling: Filling,
    count: u64,
    draws: u64,
    keys: u64,
}

impl Axis {
    /// That of a name among so many points.
    pub fn new(filling: Filling, (seed, name): (u64, &str), count: u64) -> Self {
        let mut random = Random::named(seed, name);
        Self { filling, count, draws: random.next_u64(), keys: random.next_u64() }
    }

    /// Where the point of a number lies, between 0 and 1 and at neither end.
    pub fn at(&self, number: u64) -> f64 {
        let draw = Random::new(self.draws.wrapping_add(number.wrapping_mul(STEP))).next_u64() >> 11;
        let within = (draw as f64 + 0.5) / (1u64 << 53) as f64;
        let place = match self.filling {
            Filling::Random => within,
            Filling::LatinHypercube => (self.permuted(number % self.count) as f64 + within) / self.count as f64,
        };
        place.clamp(f64::MIN_POSITIVE, 1.0 - 0.5 * f64::EPSILON)
    }

    /// Another number below the count, each for one: a Feistel network over the next power of four, walked until it is below.
    fn permuted(&self, number: u64) -> u64 {
        let bits = (u64::BITS - (self.count.max(2) - 1).leading_zeros()).div_ceil(2);
        let mask = (1u64 << bits) - 1;
        let mut number = number;
        loop {
            let (mut left, mut right) = (number >> bits, number & mask);
            for round in 0..ROUNDS {
                let mixed = Random::new(self.keys.wrapping_add(round.wrapping_mul(STEP)) ^ right).next_u64() & mask;
                (left, right) = (right, left ^ mixed);
            }
            number = left << bits | right;
            if number < self.count {
                return number;
            }
        }
    }
}

/// How a value is distributed.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Distribution {
    /// All values between two ones alike.
    Uniform { from: f64, to: f64 },
    /// Normal, cut off at two ends, which may be infinite.
    Normal { mean: f64, deviation: f64, from: f64, to: f64 },
    /// From one end up to the peak and down to the other.
    Triangular { from: f64, peak: f64, to: f64 },
    /// These alone, all alike.
    Listed(Vec<f64>),
}

impl Distribution {
    /// The value below which there is this part of all.
    pub fn quantile(&self, part: f64) -> f64 {
        match self {
            Self::Uniform { from, to } => (from + (to - from) * part).clamp(*from, *to),
            Self::Normal { mean, deviation, from, to } => {
                let [low, high] = [from, to].map(|end| normal_below((end - mean) / deviation));
                let part = low + (high - low) * part;
                (mean - deviation * normal_quantile(part)).clamp(*from, *to)
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

/// Part of a normal distribution that lies below so many deviations.
fn normal_below(z: f64) -> f64 {
    if z.is_infinite() {
        if z > 0.0 { 1.0 } else { 0.0 }
    } else {
        0.5 * statrs::function::erf::erfc(-z / std::f64::consts::SQRT_2)
    }
}

#[cfg(test)]
mod tests {
    use kardan_rt::functions::exp;

    use super::*;

    /// Each strip has one point, whatever the count.
    #[test]
    fn latin_hypercubes_have_a_point_in_each_strip() {
        for count in [1, 2, 3, 7, 64, 1000] {
            let axis = Axis::new(Filling::LatinHypercube, (3, "bar.stiffness"), count);
            let mut strips: Vec<u64> = (0..count).map(|k| (axis.at(k) * count as f64) as u64).collect();
            strips.sort_unstable();
            assert_eq!(strips, (0..count).collect::<Vec<_>>());
        }
    }

    /// Moments and ends of the distributions, by as many points as make the mean of a Latin hypercube exact to 1/n.
    #[test]
    fn distributions_have_their_moments() {
        let n = 20_000;
        let axis = Axis::new(Filling::LatinHypercube, (1, "x"), n);
        let moments = |of: &Distribution| {
            let values: Vec<f64> = (0..n).map(|k| of.quantile(axis.at(k))).collect();
            let mean = values.iter().sum::<f64>() / n as f64;
            (mean, values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n as f64)
        };
        let near = |found: (f64, f64), mean: f64, variance: f64| {
            assert!((found.0 - mean).abs() < 1e-3 && (found.1 - variance).abs() < 3e-3 * variance, "{found:?}");
        };
        near(moments(&Distribution::Uniform { from: 2.0, to: 5.0 }), 3.5, 9.0 / 12.0);
        let open = Distribution::Normal { mean: 1.0, deviation: 0.5, from: f64::NEG_INFINITY, to: f64::INFINITY };
        near(moments(&open), 1.0, 0.25);
        // Cut off at one deviation: the variance is 1 - 2 φ(1)/(2 Φ(1) - 1).
        let cut = Distribution::Normal { mean: 0.0, deviation: 1.0, from: -1.0, to: 1.0 };
        let density = exp(-0.5) / (2.0 * std::f64::consts::PI).sqrt();
        near(moments(&cut), 0.0, 1.0 - 2.0 * density / 0.682_689_492_137_085_9);
        let triangle = Distribution::Triangular { from: 0.0, peak: 1.0, to: 4.0 };
        near(moments(&triangle), 5.0 / 3.0, 13.0 / 18.0);
        assert_eq!(Distribution::Listed(vec![1.0, 2.0, 5.0]).quantile(0.99), 5.0);
    }
}
