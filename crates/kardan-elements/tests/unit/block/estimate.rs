//! Tests of `src/block/estimate.rs`.

use kardan_rt::functions::{cos, exp};

use super::*;
use kardan_math::units::Exact;

fn matrix<const N: usize, const M: usize>(rows: [[i64; M]; N]) -> Matrix<Rational> {
    Matrix::from_fn(N, M, |i, j| Rational::from(rows[i][j]))
}

/// The error has the requested poles: its characteristic polynomial is theirs, exactly.
#[test]
fn the_error_has_the_requested_poles() {
    let plant = Plant { a: matrix([[0, 1, 0], [-5, -2, 1], [0, 0, 0]]), c: matrix([[3, 0, 0]]) };
    let whole = |re: i64, im: i64| (Exact::from_ratio(re, 1), Exact::from_ratio(im, 1));
    let polynomial = of_poles(&[whole(-4, 3), whole(-2, 0), whole(-4, -3)], None).unwrap();
    // (s + 2)(s² + 8 s + 25)
    assert_eq!(polynomial.coefficients(), [50, 41, 10, 1].map(Rational::from));
    let gain = plant.gain(&polynomial).unwrap();
    assert_eq!(characteristic_polynomial(&plant.error(&gain)), polynomial);
    assert!(staying(&plant.error(&gain), false).is_empty());
    assert!(of_poles(&[whole(-4, 3), whole(-4, 3)], None).is_none());
}

/// Sampled poles are e^{p T}: (z − e^{−1})² + 0 for a double one, z² − 2 e^{a} cos b z + e^{2a} for a pair.
#[test]
fn sampled_poles_are_exponentials() {
    let half = Rational::from_parts(1.into(), 2u8.into());
    let pair =
        [(Exact::from_ratio(-2, 1), Exact::from_ratio(3, 1)), (Exact::from_ratio(-2, 1), Exact::from_ratio(-3, 1))];
    let polynomial = of_poles(&pair, Some(&half)).unwrap();
    let found: Vec<f64> = polynomial.coefficients().iter().map(Scalar::to_f64).collect();
    let expected = [exp(-2.0), -2.0 * exp(-1.0) * cos(1.5), 1.0];
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?} for {expected:?}");
}

/// A state without effect is unobservable; so are two states if only their sum is measured.
#[test]
fn unobservable_states_are_a_direction() {
    let unobservable = |a, c| Plant { a, c }.unobservable().to_f64().to_rows();
    assert_eq!(unobservable(matrix([[-1, 0], [1, 0]]), matrix([[1, 0]])), [[0.0], [1.0]]);
    assert_eq!(unobservable(matrix([[0, 0], [0, 0]]), matrix([[2, 1]])), [[-0.5], [1.0]]);
    assert!(unobservable(matrix([[0, 1], [0, 0]]), matrix([[1, 0]])).iter().all(Vec::is_empty));
}

/// On the stability boundary an error persists; inside it decays.
#[test]
fn the_border_is_decided_exactly() {
    let stays = |rows: [[i64; 2]; 2], denominator: u64, sampled| {
        let part = Rational::from_parts(1.into(), denominator.into());
        staying(&matrix(rows).scale(&part), sampled).len()
    };
    assert_eq!(stays([[0, 1], [-1, 0]], 1, false), 2);
    assert_eq!(stays([[-1, 1], [0, 0]], 1, false), 1);
    assert_eq!(stays([[-1, 1], [0, -1]], 1, false), 0);
    // (3 ± 4j)/5 lie on the circle, and −1, and 1.
    assert_eq!(stays([[3, 4], [-4, 3]], 5, true), 2);
    assert_eq!(stays([[-1, 0], [0, 1]], 1, true), 2);
    assert_eq!(stays([[3, 4], [-4, 2]], 5, true), 0);
    assert_eq!(stays([[5, 0], [0, 11]], 10, true), 1);
}
