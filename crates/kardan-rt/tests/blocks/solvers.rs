//! The small dense solvers, which are private to the crate.

#[allow(dead_code)] // not all of it is tested here
#[path = "../../src/dense.rs"]
mod dense;

use dense::{at, dot, factor, row, solve, solve_factored};

/// (L D Lᵀ)⁻¹ of the leading block, in both ways, against the right-hand side itself.
#[test]
fn solutions_solve() {
    let matrix = [4.0_f64, 1.0, -2.0, 9.0, 1.0, 3.0, 0.5, 9.0, -2.0, 0.5, 5.0, 9.0];
    let right = [1.0, -2.0, 3.0];
    let (mut lower, mut x) = ([0.0; 9], right);
    factor(&matrix, 4, 3, &mut lower).expect("positive definite");
    solve_factored(&lower, 3, &mut x).expect("memory enough");
    let mut equations = [0.0, 1.0, -2.0, 1.0, 1.0, 0.0, 0.5, -2.0, -2.0, 0.5, 0.0, 3.0];
    let other = equations;
    solve(&mut equations, 3).expect("regular, but only with pivoting");
    for i in 0..3 {
        assert!((dot(row(&matrix, i, 4), &x) - at(&right, i)).abs() < 1e-15 * 16.0);
        let left: f64 = (0..3).map(|j| at(row(&other, i, 4), j) * at(row(&equations, j, 4), 3)).sum();
        assert!((left - at(&right, i)).abs() < 1e-15 * 16.0);
    }
}

#[test]
fn singular_and_nan_are_reported() {
    let mut lower = [0.0; 4];
    assert!(factor(&[1.0, 2.0, 2.0, 4.0], 2, 2, &mut lower).is_none());
    assert!(factor(&[1.0, 2.0, 2.0, f64::NAN], 2, 2, &mut lower).is_none());
    assert!(factor(&[-1.0_f64], 1, 1, &mut lower).is_none());
    assert!(solve(&mut [1.0, 2.0, 5.0, 2.0, 4.0, 5.0], 2).is_none());
    assert!(solve(&mut [1e-20, 2.0, 5.0, 1e-20, 4.0, 5.0], 2).is_none(), "a column far below the other");
    assert!(solve(&mut [f64::NAN, 2.0, 5.0, 2.0, 4.0, 5.0], 2).is_none());
    assert!(factor(&[1.0; 4], 2, 2, &mut lower[..3]).is_none(), "too little memory");
}
