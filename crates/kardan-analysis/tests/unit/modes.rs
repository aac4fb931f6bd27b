//! Tests of `src/modes/mod.rs`.

use super::null_vectors::solve_banded;
use super::*;
use kardan_math::num::Random;

/// The modes other than known roots represent the other roots, with any rounding.
#[test]
fn specified_roots_are_removed() {
    let mode = |re: f64, im: f64| root(c64::new(re, im));
    let values = |modes: Vec<Mode>| modes.iter().map(|mode| mode.eigenvalue).collect::<Vec<_>>();
    // Three zeros as a real root and a pair; a pair far away.
    let spread = vec![mode(1e-5, 0.0), mode(-5e-6, 8.7e-6), mode(-1.0, 2.0)];
    assert_eq!(
        values(remaining_modes(spread.clone(), &[Complex::default(); 3], 5).unwrap()),
        [Complex::new(-1.0, 2.0)]
    );
    // With two zeros known the third stays, real.
    assert_eq!(
        values(remaining_modes(spread.clone(), &[Complex::default(); 2], 5).unwrap()),
        [Complex::new(-5e-6, 0.0), Complex::new(-1.0, 2.0)]
    );
    let pair = [Complex::new(-1.0, 2.0), Complex::new(-1.0, -2.0)];
    assert_eq!(values(remaining_modes(spread.clone(), &pair, 5).unwrap()).len(), 2);
    assert!(remaining_modes(spread, &[], 4).is_none(), "five roots are not four");
}

/// Against the product: `A x = b`, with small pivots on the diagonal so that rows are exchanged.
#[test]
fn banded_systems_are_solved() {
    for (n, band) in [(1, 0), (5, 0), (6, 1), (30, 3), (12, 11)] {
        let mut random = Random::new(n as u64);
        let mut number = || c64::new(2.0 * random.unit() - 1.0, 2.0 * random.unit() - 1.0);
        let a = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => number() * if band > 0 { 1e-3 } else { 1.0 },
            apart if apart <= band => number(),
            _ => c64::ZERO,
        });
        let b: Vec<c64> = (0..n).map(|_| number()).collect();
        let x = solve_banded(n, band, |i, j| a[(i, j)], b.clone());
        for i in 0..n {
            let sum = (0..n).fold(c64::ZERO, |sum, j| sum + a[(i, j)] * x[j]);
            assert!((sum - b[i]).norm() < 1e-9, "n = {n}, band = {band}");
        }
    }
}

/// `(λ² + 3)` of the difference of two equal bodies: the vector is (1, −1), whatever the scale of one coordinate.
#[test]
fn a_null_vector_of_the_quadratic() {
    let unit = [1.0, 1e-4];
    let scaled = |m: [[f64; 2]; 2]| Mat::from_fn(2, 2, |i, j| m[i][j] * unit[i] * unit[j]);
    let (h, d) = (scaled([[1.0, 0.0], [0.0, 1.0]]), scaled([[0.0, 0.0], [0.0, 0.0]]));
    let s = scaled([[2.0, -1.0], [-1.0, 2.0]]);
    let v = &quadratic_null_vectors([&h, &d, &s], 1, c64::new(0.0, 3f64.sqrt()), 1).unwrap()[0];
    assert!((v[0] * 1e4 + v[1]).norm() < 1e-10, "{v:?}");
}
