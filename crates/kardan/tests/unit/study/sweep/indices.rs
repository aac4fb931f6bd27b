//! Tests of `src/study/sweep/indices.rs`.

use kardan_rt::functions::{powi, sin};

use super::super::points::axes;
use super::*;
use crate::study::requests::distribution::Distribution;
use crate::study::requests::sample_space::SampleSpace;
use crate::study::requests::sampling_method::SamplingMethod;
use crate::study::requests::varied::Varied;
use kardan_math::units::Dimension;

/// Places of the samples of a design over so many axes.
fn places(sampling: SamplingMethod, axes_: usize, samples: u64) -> Vec<Vec<f64>> {
    let unit = Distribution::Uniform { from: 0.0, to: 1.0 };
    let varied = (0..axes_).map(|k| Varied::new(&format!("x{k}"), Dimension::NONE, unit.clone()));
    let space = SampleSpace { varied: varied.collect(), correlated: Vec::new(), sampling };
    let made = axes(sampling, (3, samples), &space);
    (0..samples).map(|k| made.iter().map(|axis| axis.at(k)).collect()).collect()
}

fn found(axes: usize, base: usize, of: impl Fn(&[f64]) -> f64) -> Vec<SweptIndex> {
    let group = axes + 2;
    let numbers: Vec<f64> =
        places(SamplingMethod::Saltelli, axes, (base * group) as u64).iter().map(|place| of(place)).collect();
    let groups: Vec<Vec<f64>> = numbers.chunks(group).map(<[f64]>::to_vec).collect();
    let names: Vec<String> = (0..axes).map(|k| format!("x{k}")).collect();
    sobol_indices(&groups, &names, 0)
}

/// Every index lies in its interval, and within so much.
fn near(found: &[SweptIndex], exact: &[[f64; 2]], tolerance: f64) {
    assert_eq!(found.len(), exact.len());
    for one in found {
        let axis: usize = one.parameter[1..].parse().unwrap();
        let [first, total] = exact[axis];
        for (value, interval, exact) in [(one.first, one.first_interval, first), (one.total, one.total_interval, total)]
        {
            assert!((value - exact).abs() < tolerance, "{one:?}: {exact}");
            assert!(interval[0] <= exact && exact <= interval[1], "{one:?}: {exact}");
        }
    }
}

/// In each group two samples that differ in all axes, then one that is the first but for one axis.
#[test]
fn groups_exchange_one_axis() {
    for group in places(SamplingMethod::Saltelli, 4, 60).chunks(6) {
        assert!((0..4).all(|axis| group[0][axis] != group[1][axis]));
        for (one, axis) in (0..4).flat_map(|one| (0..4).map(move |axis| (one, axis))) {
            assert_eq!(group[2 + one][axis], group[usize::from(one == axis)][axis]);
        }
    }
}

/// Ishigami's function (Homma, Saltelli, Reliab. Eng. Syst. Saf. 52, 1996, 1): V = 1/2 + a²/8 + bπ⁴/5 + b²π⁸/18.
#[test]
fn indices_are_those_of_ishigami() {
    let (a, b, pi) = (7.0, 0.1, std::f64::consts::PI);
    let of = |x: &[f64]| {
        let [x, y, z] = [0, 1, 2].map(|k| pi * (2.0 * x[k] - 1.0));
        sin(x) + a * powi(sin(y), 2) + b * powi(z, 4) * sin(x)
    };
    let all = 0.5 + a * a / 8.0 + b * powi(pi, 4) / 5.0 + b * b * powi(pi, 8) / 18.0;
    let single = [0.5 * powi(1.0 + b * powi(pi, 4) / 5.0, 2), a * a / 8.0, 0.0];
    let with = b * b * powi(pi, 8) * (1.0 / 18.0 - 1.0 / 50.0);
    let exact = [[single[0] / all, (single[0] + with) / all], [single[1] / all; 2], [0.0, with / all]];
    near(&found(3, 4096, of), &exact, 0.02);
}

/// Sobol's function of products Π (|4x − 2| + a)/(1 + a): Vᵢ = 1/3(1 + a)².
#[test]
fn indices_are_those_of_products() {
    let weights: [f64; 4] = [0.0, 1.0, 4.5, 9.0];
    let of = |x: &[f64]| x.iter().zip(weights).map(|(x, a)| ((4.0 * x - 2.0).abs() + a) / (1.0 + a)).product();
    let own = weights.map(|a| 1.0 / (3.0 * (1.0 + a) * (1.0 + a)));
    let product = |omitted: usize| (0..4).filter(|k| *k != omitted).map(|k| 1.0 + own[k]).product::<f64>();
    let all = product(4) - 1.0;
    let exact = [0, 1, 2, 3].map(|k| [own[k] / all, own[k] * product(k) / all]);
    near(&found(4, 4096, of), &exact, 0.02);
}

/// Nothing is told of few samples, and of a number that never changes.
#[test]
fn nothing_is_reported_of_constants() {
    assert!(found(2, 64, |_| 3.0).is_empty() && found(2, 7, |x| x[0]).is_empty());
    let free = found(2, 64, |x| x[1]);
    assert_eq!((free[0].parameter.as_str(), free[1].first, free[1].total), ("x1", 0.0, 0.0));
}

/// A straight line has its slopes as effects and no deviation; a square bends, a product acts together.
#[test]
fn effects_are_slopes() {
    let of = |x: &[f64]| 3.0 * x[0] - 2.0 * x[1] + x[2] * x[3] + 0.0 * x[4];
    let places = places(SamplingMethod::Morris, 5, 6 * 200);
    for pair in places.chunks(6).flat_map(|path| path.windows(2)) {
        let moved: Vec<f64> = pair[0].iter().zip(&pair[1]).map(|(a, b)| (a - b).abs()).filter(|x| *x > 0.0).collect();
        assert!(moved.len() == 1 && (moved[0] - MORRIS_STEP).abs() < 1e-15, "{moved:?}");
    }
    assert!(places.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
    let paths: Vec<(u64, Vec<f64>)> =
        places.chunks(6).zip(0..).map(|(path, k)| (6 * k, path.iter().map(|x| of(x)).collect())).collect();
    let names: Vec<String> = (0..5).map(|k| format!("x{k}")).collect();
    let found = effects(&paths, |sample, axis| places[sample as usize][axis], &names);
    let one = |name: &str| found.iter().find(|one| one.parameter == name).unwrap();
    for (name, slope) in [("x0", 3.0), ("x1", -2.0), ("x4", 0.0)] {
        let one = one(name);
        assert!((one.mean - slope).abs() < 1e-12 && (one.size - slope.abs()).abs() < 1e-12, "{one:?}");
        assert!(one.deviation.unwrap() < 1e-12 && one.count == 200);
    }
    // The slope is the other factor, anywhere in [0, 0.4] and [0.6, 1]: mean 1/2, variance 1/12 · 0.16 + 0.09.
    let product = one("x2");
    assert!((product.mean - 0.5).abs() < 4.0 * (0.1033f64 / 200.0).sqrt(), "{product:?}");
    assert!((product.deviation.unwrap() - 0.1033f64.sqrt()).abs() < 0.05, "{product:?}");
    assert_eq!(found[0].parameter, "x0");
}
