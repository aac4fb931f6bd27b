//! Tests of `src/indices.rs`.

use super::*;
use kardan_math::num::{Matrix, Random};

/// Systems put together from chains of known lengths, transformed by a matrix of whole numbers: the indices are the lengths, exact and modulo primes.
#[test]
fn the_lengths_of_chains_come_out() {
    let mut random = Random::new(4);
    for lengths in [vec![3, 1, 2], vec![1, 1], vec![4], vec![2, 2, 2]] {
        let n: usize = lengths.iter().sum();
        let starts: Vec<usize> = lengths.iter().scan(0, |at, l| Some(std::mem::replace(at, *at + l))).collect();
        let mut a = Matrix::<Rational>::zeros(n, n);
        let mut b = Matrix::<Rational>::zeros(n, lengths.len());
        for (input, (start, length)) in starts.iter().zip(&lengths).enumerate() {
            (0..length - 1).for_each(|k| a[(start + k + 1, start + k)] = Rational::ONE);
            b[(*start, input)] = Rational::ONE;
        }
        let turn = Matrix::from_fn(n, n, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Equal => Rational::ONE,
            std::cmp::Ordering::Less => Rational::from(random.small(5)),
            std::cmp::Ordering::Greater => Rational::ZERO,
        });
        let a = turn.multiply(&a).multiply(&turn.solve(&Matrix::identity(n)).unwrap());
        let system = LinearSystem::state_space(a, turn.multiply(&b), Matrix::zeros(0, n));
        assert_eq!(exact(&system).unwrap(), lengths);
        assert_eq!(modular(&system).unwrap(), lengths);
    }
}
