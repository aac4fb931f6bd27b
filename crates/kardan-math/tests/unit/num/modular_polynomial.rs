//! Tests of `src/num/modular_polynomial.rs`.

use super::*;

#[test]
fn yun_finds_the_exponents() {
    let f = PrimeField::new(1_000_003);
    let root = |x: i64| vec![f.integer(-x), f.one()];
    let power = |p: &[Residue], e: usize| (0..e).fold(vec![f.one()], |all, _| product(&f, &all, p));
    let p = [power(&root(2), 3), root(5), power(&root(-1), 3), root(7)];
    let p = p.iter().fold(vec![f.one()], |all, next| product(&f, &all, next));
    let expected = vec![(product(&f, &root(5), &root(7)), 1), (product(&f, &root(2), &root(-1)), 3)];
    assert_eq!(square_free(&f, &p), expected);
    // p(s + 2) has the roots moved down by two.
    assert_eq!(shifted(&f, &product(&f, &root(5), &root(7)), f.element(2)), product(&f, &root(3), &root(5)));
}
