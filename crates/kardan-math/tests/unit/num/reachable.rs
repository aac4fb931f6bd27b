//! Tests of `src/num/reachable.rs`.

use super::*;
use crate::num::{Random, random_prime};

fn field() -> PrimeField {
    PrimeField::new(random_prime(&mut Random::new(1)))
}

/// The reachable part of a double chain with one input, and its quotient.
#[test]
fn the_quotient_is_what_is_not_reached() {
    let f = field();
    // Diagonal 1, 2, 3; the input reaches the first two.
    let g = ModularMatrix::from_fn(3, 3, |i, j| if i == j { f.element(i as u64 + 1) } else { 0 });
    let b = ModularMatrix::from_fn(3, 1, |i, _| if i < 2 { f.one() } else { 0 });
    let part = reachable(&f, &g, &b);
    assert_eq!(part.columns, [(0, 0), (0, 1)]);
    let quotient = quotient_action(&f, &g, &part.span);
    assert_eq!((quotient.rows, quotient.row(0)[0]), (1, f.element(3)));
}
