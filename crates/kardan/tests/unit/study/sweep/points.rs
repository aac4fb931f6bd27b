//! Tests of `src/study/sweep/points.rs`.

use kardan_rt::functions::exp;

use super::*;
use crate::study::requests::distribution::Distribution;
use kardan_math::units::Dimension;

const UNIT: Distribution = Distribution::Uniform { from: 0.0, to: 1.0 };

fn axis(sampling: SamplingMethod, seed_and_count: (u64, u64)) -> Axis {
    axes(sampling, seed_and_count, &space(sampling, &[("x", &UNIT)])).remove(0)
}

fn space(sampling: SamplingMethod, all: &[(&str, &Distribution)]) -> SampleSpace {
    let varied = |(name, of): &(&str, &Distribution)| Varied::new(name, Dimension::NONE, (*of).clone());
    SampleSpace { varied: all.iter().map(varied).collect(), correlated: Vec::new(), sampling }
}

/// Sobol's first 2^m points have one in each box of that area of the first two axes, whatever the shift; means over the cube come out far closer than
/// those of draws.
#[test]
fn sequences_fill_the_square_evenly() {
    let cube = [("x", &UNIT), ("y", &UNIT), ("z", &UNIT)];
    let square = |sampling| axes(sampling, (5, 0), &space(sampling, &cube));
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
    let space = space(SamplingMethod::Levels(2), &[("a", &wide), ("b", &listed), ("c", &wide)]);
    assert_eq!(space.combinations(2), 12);
    let axes = axes(SamplingMethod::Levels(2), (0, 12), &space);
    let mut found: Vec<[f64; 3]> =
        (0..12).map(|k| [0, 1, 2].map(|axis| spread[axis].quantile(axes[axis].at(k)))).collect();
    found.sort_by(|a, b| a.partial_cmp(b).unwrap());
    found.dedup();
    assert_eq!(found.len(), 12);
    assert!(found.iter().all(|[a, b, c]| [a, c].iter().all(|x| [0.1, 0.7].contains(x)) && [1.0, 2.0, 5.0].contains(b)));
    let middle = axes_of_three(&wide);
    assert_eq!(middle.map(|x| (x * 1e12).round()), [0.1e12, 0.4e12, 0.7e12]);
}

fn axes_of_three(of: &Distribution) -> [f64; 3] {
    let axis = axes(SamplingMethod::Levels(3), (0, 3), &space(SamplingMethod::Levels(3), &[("a", of)])).remove(0);
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
