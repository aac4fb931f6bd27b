//! Tests of `src/stability.rs`.

use super::*;
use kardan_math::num::Rational;

/// Four roots in a square around the origin have no common factor with a real quadratic on the axis.
#[test]
fn symmetric_roots() {
    let p = |c: &[i64]| Polynomial::new(c.iter().map(|&c| Rational::from(c)).collect());
    for (coefficients, expected) in [
        (&[4, 0, 0, 0, 1], Stability::Unstable),
        (&[4, 0, 5, 0, 1], Stability::Marginal),
        (&[-4, 0, 3, 0, 1], Stability::Unstable),
        // A repeated root: a polynomial does not determine how many motions it has.
        (&[1, 0, 2, 0, 1], Stability::Undecided),
    ] {
        assert_eq!(stability(&p(coefficients)), expected, "{coefficients:?}");
    }
}
