//! Tests of `src/num/modular.rs`.

use super::*;
use crate::num::random_prime;

fn field() -> PrimeField {
    PrimeField::new(random_prime(&mut Random::new(1)))
}

/// X of `solve` solves, the determinant is multiplicative, null vectors are null vectors.
#[test]
fn elimination_is_what_it_says() {
    let f = field();
    let mut random = Random::new(3);
    let (a, b) = (ModularMatrix::random(&f, 6, 6, &mut random), ModularMatrix::random(&f, 6, 6, &mut random));
    let (x, determinant) = a.solve(&f, &b).unwrap();
    assert_eq!(a.multiply(&f, &x), b);
    let product = a.multiply(&f, &b).determinant(&f);
    assert_eq!(product, f.times(determinant, b.determinant(&f)));
    let wide = ModularMatrix::from_fn(4, 6, |i, j| a.row(i)[j]);
    let null = wide.clone().null_space(&f);
    assert_eq!(null.rows, 2);
    assert!((0..2).all(|k| wide.apply(&f, null.row(k)).iter().all(|&x| x == 0)));
    assert_eq!(ModularMatrix::zeros(0, 0).characteristic_polynomial(&f), [f.one()]);
    // Dense, and sparse with a pivot that is zero at first.
    let sparse = |i: usize, j: usize| if (i * 5 + 3) % 12 == j || i == j && i % 2 == 1 { f.one() } else { 0 };
    for m in [a.clone(), ModularMatrix::from_fn(12, 12, sparse)] {
        let identity = ModularMatrix::identity(&f, m.rows);
        let (inverse, determinant) = m.clone().inverse(&f).unwrap();
        assert_eq!(m.multiply(&f, &inverse), identity);
        assert_eq!(determinant, m.determinant(&f));
        assert_eq!(m.solve(&f, &identity).unwrap(), (inverse, determinant));
    }
    assert!(ModularMatrix::zeros(2, 2).inverse(&f).is_none());
}
