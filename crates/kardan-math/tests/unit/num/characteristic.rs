//! Tests of `src/num/characteristic.rs`.

use super::*;
use crate::num::Scalar;
use dashu_int::UBig;

fn polynomial(coefficients: &[i64]) -> Polynomial {
    Polynomial::new(coefficients.iter().map(|&c| Rational::from(c)).collect())
}

#[test]
fn characteristic_polynomials() {
    let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows.len(), |i, j| Rational::from(rows[i][j]));
    assert_eq!(characteristic_polynomial(&matrix(&[])), polynomial(&[1]));
    // (s − 1)(s − 2)(s² + 3), hidden by a similarity; a zero subdiagonal entry on the way.
    let m = matrix(&[&[0, 0, 1, 0], &[0, 1, 0, 5], &[-3, 0, 0, 7], &[0, 0, 0, 2]]);
    assert_eq!(characteristic_polynomial(&m), polynomial(&[6, -9, 5, -3, 1]));
    let t = matrix(&[&[1, 2, 0, 1], &[0, 1, -1, 3], &[1, 2, 1, 1], &[0, 0, 0, 1]]);
    let similar = t.solve(&m.multiply(&t)).unwrap();
    assert_eq!(characteristic_polynomial(&similar), polynomial(&[6, -9, 5, -3, 1]));
    // (s − 10⁴⁰)(s + 1/3)
    let big = Rational::from(UBig::from(10u8).pow(40));
    let third = Rational::from_parts(1.into(), 3u8.into());
    let diagonal = [big.clone(), Rational::ZERO.minus(&third)];
    let m = Matrix::from_fn(2, 2, |i, j| if i == j { diagonal[i].clone() } else { Rational::ZERO });
    let expected = vec![Rational::ZERO.minus(&big.times(&third)), third.minus(&big), Rational::ONE];
    assert_eq!(characteristic_polynomial(&m), Polynomial::new(expected));
}

#[test]
fn hurwitz_is_decided_at_the_border() {
    for (p, stable) in [
        (&[1][..], true),
        (&[], false),
        (&[5000, 1], true),
        (&[0, 1], false),
        (&[1, 0, 1], false),
        (&[-6, -11, -6, -1], true),
        (&[1, 1, 1, 1], false),
        (&[1, 1, 2, 1], true),
        (&[2, 1, 1, 1], false),
        (&[1, 4, 6, 4, 1], true),
    ] {
        assert_eq!(is_hurwitz(&polynomial(p)), stable, "{p:?}");
    }
}
