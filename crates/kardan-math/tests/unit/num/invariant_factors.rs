//! Tests of `src/num/invariant_factors.rs`.

use super::super::modular_polynomial::product;
use super::*;
use crate::num::random_prime;

fn field() -> PrimeField {
    PrimeField::new(random_prime(&mut Random::new(1)))
}

fn companion(f: &PrimeField, polynomial: &[Residue]) -> ModularMatrix {
    let d = polynomial.len() - 1;
    ModularMatrix::from_fn(d, d, |i, j| match (i + 1 == j, i + 1 == d) {
        (_, true) => f.negate(polynomial[j]),
        (true, _) => f.one(),
        _ => 0,
    })
}

/// Companion blocks of known invariant factors, hidden by a random similarity, are found again.
#[test]
fn hidden_invariant_factors_are_found() {
    let f = field();
    let mut random = Random::new(7);
    for _ in 0..20 {
        let linear = |x: i64| vec![f.integer(-x), f.one()];
        let (a, b, c) = (random.small(5), random.small(5), random.small(5));
        let first = linear(a);
        let second = product(&f, &first, &linear(b));
        let third = product(&f, &product(&f, &second, &linear(c)), &linear(a));
        let blocks = [companion(&f, &first), companion(&f, &second), companion(&f, &third)];
        let n = 7;
        let mut g = ModularMatrix::zeros(n, n);
        let mut at = 0;
        for block in &blocks {
            for i in 0..block.rows {
                g.row_mut(at + i)[at..at + block.columns].copy_from_slice(block.row(i));
            }
            at += block.rows;
        }
        let t = ModularMatrix::random(&f, n, n, &mut random);
        let hidden = t.multiply(&f, &g);
        let (hidden, _) = t.transpose().solve(&f, &hidden.transpose()).unwrap();
        let hidden = hidden.transpose();
        let found = invariant_factors(&f, &hidden, &mut random);
        assert_eq!(found, [first, second, third.clone()]);
        let all = found.iter().fold(vec![f.one()], |all, next| product(&f, &all, next));
        assert_eq!(hidden.characteristic_polynomial(&f), all);
    }
}

/// The minor that a span stores is the determinant; special chains are not mistaken for the result.
#[test]
fn minors_and_defective_matrices() {
    let f = field();
    let mut random = Random::new(11);
    let m = ModularMatrix::random(&f, 5, 5, &mut random);
    let mut span = Span::default();
    (0..5).for_each(|j| assert!(span.insert(&f, &m.column(j)).is_none()));
    assert_eq!(span.minor(&f), m.determinant(&f));
    // Two Jordan blocks: the first chain starts in a proper part of the space.
    let g = ModularMatrix::from_fn(4, 4, |i, j| if j == i + 1 && i != 2 { f.one() } else { 0 });
    let factors = invariant_factors(&f, &g, &mut random);
    assert_eq!(factors, [vec![0, f.one()], vec![0, 0, 0, f.one()]]);
    let start: Vec<Vec<Residue>> = vec![vec![0, 0, 0, f.one()], vec![0, 0, f.one(), 0]];
    let mut vectors = start.into_iter();
    let special = chain_factors(&f, &Operator::new(&g), 4, || vectors.next().unwrap());
    assert_eq!(special, None);
}
