//! Tests of `src/num/krylov.rs`.

use super::*;
use crate::num::Random;

/// A sequence made with a recurrence gives it back.
#[test]
fn recurrences_come_back() {
    let f = PrimeField::new((1 << 61) - 1);
    let mut random = Random::new(3);
    for degree in 0..12 {
        let mut polynomial: Vec<Residue> = (0..degree).map(|_| random.below(f.prime())).collect();
        polynomial.push(f.one());
        let mut sequence: Vec<Residue> = (0..degree).map(|_| random.below(f.prime())).collect();
        while sequence.len() < 2 * degree + 3 {
            let from = sequence.len() - degree;
            sequence.push(f.negate(f.dot(&polynomial[..degree], &sequence[from..])));
        }
        assert_eq!(recurrence(&f, &sequence), polynomial);
    }
}

#[test]
fn sparse_and_dense_rows_agree_with_the_matrix() {
    let f = PrimeField::new(1_000_003);
    let m = ModularMatrix::from_fn(9, 9, |i, j| if j <= i { f.element((i * 9 + j) as u64) } else { 0 });
    let x: Vec<Residue> = (0..9).map(|k| f.element(k * k + 1)).collect();
    assert_eq!(Operator::new(&m).apply(&f, &x), m.apply(&f, &x));
}
