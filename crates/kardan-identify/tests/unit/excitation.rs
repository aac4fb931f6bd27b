//! Tests of `src/excitation.rs`.

use kardan_rt::functions::powi;

use super::*;
use kardan_math::num::Random;

fn value(candidates: &[Matrix<f64>], chosen: &[usize]) -> f64 {
    expected_errors(&information(candidates, chosen.iter().copied())).map_or(f64::NEG_INFINITY, |found| found.0)
}

/// Subsets of five of twelve, all 792 of them: the exchanges end in a local optimum within 0.2 of the best, and in most of 40
/// draws in the best itself.
#[test]
fn exchanges_against_all_subsets() {
    let mut best_found = 0;
    for seed in 0..40 {
        let mut random = Random::new(seed);
        let candidates: Vec<Matrix<f64>> =
            (0..12).map(|_| Matrix::from_fn(2, 4, |_, j| random.normal() * powi(10.0, 3 * j as i32))).collect();
        let found = d_optimal(&candidates, 5).unwrap();
        let own = value(&candidates, &found.chosen);
        assert!((own - found.log_det).abs() < 1e-8 * own.abs(), "{own} {}", found.log_det);
        let best = (0u32..1 << 12)
            .filter(|set| set.count_ones() == 5)
            .map(|set| value(&candidates, &(0..12).filter(|k| set >> k & 1 == 1).collect::<Vec<_>>()))
            .fold(f64::NEG_INFINITY, f64::max);
        assert!(found.log_det <= best + 1e-8 * best.abs() && found.log_det > best - 0.2, "{own} against {best}");
        best_found += usize::from(found.log_det > best - 1e-6);
        for out in 0..5 {
            for enter in (0..12).filter(|k| !found.chosen.contains(k)) {
                let mut exchanged = found.chosen.clone();
                exchanged[out] = enter;
                assert!(value(&candidates, &exchanged) <= own + 1e-6, "an exchange improves it");
            }
        }
    }
    assert!(best_found >= 30, "{best_found} of 40");
}

/// Polynomials of degree d on [−1, 1] with d + 1 points: the ends and the zeros of the derivative of the Legendre polynomial
/// (Atkinson, Donev, Tobias 2007, table 11.1): ±1, ±1/√5 for the cubic, to the spacing of the candidates.
#[test]
fn polynomials_as_in_the_textbook() {
    let at = |k: usize| k as f64 / 500.0 - 1.0;
    let rows = |degree: usize| -> Vec<Matrix<f64>> {
        (0..=1000).map(|k| Matrix::from_fn(1, degree + 1, |_, j| powi(at(k), j as i32))).collect()
    };
    for (degree, expected) in
        [(1, vec![-1.0, 1.0]), (2, vec![-1.0, 0.0, 1.0]), (3, vec![-1.0, -0.2f64.sqrt(), 0.2f64.sqrt(), 1.0])]
    {
        let found = d_optimal(&rows(degree), degree + 1).unwrap();
        for (k, expected) in found.chosen.iter().zip(expected) {
            assert!((at(*k) - expected).abs() <= 0.002, "degree {degree}: {} against {expected}", at(*k));
        }
    }
}

#[test]
fn what_cannot_be_determined_is_refused() {
    let same = vec![Matrix::from_fn(1, 2, |_, _| 1.0); 4];
    assert_eq!(d_optimal(&same, 2), None);
    let regressors = vec![Matrix::from_fn(1, 2, |_, j| j as f64); 4];
    assert_eq!(d_optimal(&regressors, 2), None);
    assert_eq!(d_optimal(&same, 5), None);
    assert_eq!(d_optimal(&[], 1), None);
}
