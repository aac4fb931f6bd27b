//! Sampling: points of a unit cube that depend only on a seed and the number of a sample, and the distributions to which they
//! are mapped.

use crate::identify::normal_quantile;
use crate::num::Random;

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
        stride: u64,
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
    let (mut stride, mut base) = (1u64, 1u64);
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
                let own = stride;
                stride = stride.saturating_mul(count);
                Axis::Levels { stride: own, count }
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
            Self::Levels { stride, count } => return (number / stride % count) as f64 / (count - 1) as f64,
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
mod tests {
    use kardan_rt::functions::exp;

    use super::*;

    const UNIT: Distribution = Distribution::Uniform { from: 0.0, to: 1.0 };

    fn axis(sampling: SamplingMethod, seed_and_count: (u64, u64)) -> Axis {
        axes(sampling, seed_and_count, [("x", &UNIT)].into_iter(), &[]).remove(0)
    }

    /// Halves of an interval of 95 % hold that much in it and meet where they should; cut off at an end they keep their shape.
    #[test]
    fn halves_contain_what_their_interval_says() {
        let two_sided = 1.959_963_984_540_054;
        let halves = |from: f64| Distribution::Halves {
            peak: 100.0,
            below: 10.0 / two_sided,
            above: 30.0 / two_sided,
            from,
            to: f64::INFINITY,
        };
        let all = halves(f64::NEG_INFINITY);
        // A quarter of all lies below the peak: the tails are 2·1/4·2.5 % and 2·3/4·2.5 %.
        for (part, value) in [(0.0125, 90.0), (0.25, 100.0), (0.9625, 130.0)] {
            assert!((all.quantile(part) - value).abs() < 1e-9, "{part}: {}", all.quantile(part));
        }
        let [just_below, just_above] = [0.25 - 1e-9, 0.25 + 1e-9].map(|part| all.quantile(part));
        assert!(just_below < 100.0 && just_above > 100.0 && just_above - just_below < 1e-6);
        let cut = halves(90.0);
        assert!(cut.quantile(1e-15) >= 90.0 && (cut.quantile((0.25 - 0.0125) / (1.0 - 0.0125)) - 100.0).abs() < 1e-9);
    }

    /// Sobol's first 2^m points have one in each box of that area of the first two axes, whatever the shift; means over the cube come out far closer than
    /// those of draws.
    #[test]
    fn sequences_fill_the_square_evenly() {
        let square = |sampling| axes(sampling, (5, 0), [("x", &UNIT), ("y", &UNIT), ("z", &UNIT)].into_iter(), &[]);
        let sobol = square(SamplingMethod::Sobol);
        for (m, split) in [(6, 0), (6, 1), (6, 3), (6, 5), (10, 4)] {
            let mut boxes = vec![0; 1 << m];
            for k in 0..1u64 << m {
                let [x, y] = [(&sobol[0], split), (&sobol[1], m - split)]
                    .map(|(axis, bits)| (axis.at(k) * f64::from(1u32 << bits)) as usize);
                boxes[x << (m - split) | y] += 1;
            }
            assert!(boxes.iter().all(|count| *count == 1), "{m} {split}");
        }
        for sampling in [SamplingMethod::Sobol, SamplingMethod::Halton] {
            // The mean of x y z over the cube is 1/8; random draws would leave 0.0026.
            let axes = square(sampling);
            let mean = (0..4096).map(|k| axes.iter().map(|axis| axis.at(k)).product::<f64>()).sum::<f64>() / 4096.0;
            assert!((mean - 0.125).abs() < 4e-4, "{sampling:?}: {mean}");
        }
        assert_eq!([0, 1, 2, 3, 4].map(|k| radical_inverse(k, 3)), [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0 / 9.0, 4.0 / 9.0]);
        assert_eq!([1, 2, 3, 5, 7, 11].map(next_prime), [2, 3, 5, 7, 11, 13]);
    }

    /// Every combination once, ends and lists exactly.
    #[test]
    fn grids_have_every_combination() {
        let wide = Distribution::Uniform { from: 0.1, to: 0.7 };
        let listed = Distribution::Listed(vec![1.0, 2.0, 5.0]);
        let spread = [&wide, &listed, &wide];
        assert_eq!(combinations(2, spread.into_iter()), 12);
        let axes =
            axes(SamplingMethod::Levels(2), (0, 12), [("a", &wide), ("b", &listed), ("c", &wide)].into_iter(), &[]);
        let mut found: Vec<[f64; 3]> =
            (0..12).map(|k| [0, 1, 2].map(|axis| spread[axis].quantile(axes[axis].at(k)))).collect();
        found.sort_by(|a, b| a.partial_cmp(b).unwrap());
        found.dedup();
        assert_eq!(found.len(), 12);
        assert!(
            found.iter().all(|[a, b, c]| [a, c].iter().all(|x| [0.1, 0.7].contains(x)) && [1.0, 2.0, 5.0].contains(b))
        );
        let middle = axes_of_three(&wide);
        assert_eq!(middle.map(|x| (x * 1e12).round()), [0.1e12, 0.4e12, 0.7e12]);
    }

    fn axes_of_three(of: &Distribution) -> [f64; 3] {
        let axis = axes(SamplingMethod::Levels(3), (0, 3), [("a", of)].into_iter(), &[]).remove(0);
        [0, 1, 2].map(|k| of.quantile(axis.at(k)))
    }

    /// Each strip has one point, whatever the count.
    #[test]
    fn latin_hypercubes_have_a_point_in_each_strip() {
        for count in [1, 2, 3, 7, 64, 1000] {
            let axis = axis(SamplingMethod::LatinHypercube, (3, count));
            let mut strips: Vec<u64> = (0..count).map(|k| (axis.at(k) * count as f64) as u64).collect();
            strips.sort_unstable();
            assert_eq!(strips, (0..count).collect::<Vec<_>>());
        }
    }

    /// Moments and ends of the distributions, by as many points as make the mean of a Latin hypercube exact to 1/n.
    #[test]
    fn distributions_have_their_moments() {
        let n = 20_000;
        let axis = axis(SamplingMethod::LatinHypercube, (1, n));
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
