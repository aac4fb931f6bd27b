//! Tests of `src/linear_law.rs`.

use super::*;

#[test]
fn what_winds_up_decays_with_one_rate() {
    let a = Matrix::from_fn(3, 3, |i, j| [[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [2.0, 0.0, -4.0]][i][j]);
    let c = Matrix::from_fn(2, 3, |i, j| [[1.0, 0.0, 0.5], [0.0, 0.0, 1.0]][i][j]);
    let gain = bass(&a, &c).expect("observable");
    let closed = a.minus(&gain.multiply(&c));
    let poles = eigenvalues(&closed).expect("eigenvalues");
    // Twice the fastest of A, 4 rad/s.
    assert!(poles.iter().all(|(re, _)| (re + 8.0).abs() < 1e-6), "{poles:?}");
    // A state that no command shows.
    assert!(bass(&a, &Matrix::from_fn(1, 3, |_, j| f64::from(u8::from(j == 1)))).is_none());
}
