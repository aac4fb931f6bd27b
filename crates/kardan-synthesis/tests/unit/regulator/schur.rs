//! Tests of `src/regulator/schur.rs`.

use kardan_rt::functions::exp2;

use super::*;
use kardan_math::num::Random;

fn residual(a: &Mat<f64>, schur: &Schur) -> f64 {
    let n = a.nrows();
    let whole = Mat::from_fn(n, n, |i, j| c64::new(a[(i, j)], 0.0));
    let back = &schur.unitary * &schur.triangular * schur.unitary.adjoint();
    let unit = schur.unitary.adjoint() * &schur.unitary - Mat::<c64>::identity(n, n);
    (whole - back).norm_l2() / a.norm_l2().max(1e-300) + unit.norm_l2()
}

/// A = U T Uᴴ with T triangular, before and after the eigenvalues are sorted; also for defective and companion matrices.
#[test]
fn the_schur_form_multiplies_back() {
    let mut random = Random::new(7);
    for n in 1..25 {
        for kind in 0..4 {
            let a = Mat::from_fn(n, n, |i, j| match kind {
                0 => 2.0 * random.unit() - 1.0,
                1 => f64::from(u8::from(j == i + 1)) + if (i, j) == (n - 1, 0) { 1.0 } else { 0.0 },
                2 => f64::from(u8::from(j == i + 1)) - 3.0 * f64::from(u8::from(i == j)),
                _ => (2.0 * random.unit() - 1.0) * exp2(f64::from(i as i32 - j as i32)),
            });
            let mut schur = Schur::of(&a).unwrap();
            assert!(residual(&a, &schur) < 3e-14 * n as f64, "{n} {kind}: {:e}", residual(&a, &schur));
            let stable = schur.stable_first();
            assert!(residual(&a, &schur) < 5e-14 * n as f64, "{n} {kind}: {:e}", residual(&a, &schur));
            assert!((0..n).all(|k| (schur.triangular[(k, k)].re < 0.0) == (k < stable)));
            assert!((0..n).all(|i| (0..i).all(|j| schur.triangular[(i, j)].norm() < 1e-14 * a.norm_l2())));
        }
    }
}
