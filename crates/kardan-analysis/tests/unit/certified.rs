//! Tests of `src/certified.rs`.

use super::evidence::Evidence;
use super::*;
use kardan_math::num::{Random, prime_below};

fn integers(rows: &[&[i64]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows.first().map_or(0, |row| row.len()), |i, j| Rational::from(rows[i][j]))
}

fn with_primes(system: &LinearSystem, mut primes: impl FnMut() -> u64) -> Facts {
    let facts = prove(system, [None, None], &mut primes, &|_| ()).unwrap();
    assert_eq!([&facts.open_spectrum[..], &facts.open_zeros].concat(), [""; 0]);
    facts
}

fn descending() -> impl FnMut() -> u64 {
    let mut last = 1 << 61;
    move || {
        last = prime_below(last);
        last
    }
}

/// All odd primes from 11 on, upwards: many of them are unlucky for matrices with entries of one digit.
fn ascending() -> impl FnMut() -> u64 {
    let mut last = 9;
    move || {
        last += 2;
        while !kardan_math::num::is_prime(last) {
            last += 2;
        }
        last
    }
}

/// With primes so small that eigenvalues meet, minors and det E vanish by chance, the results are the same.
#[test]
fn small_primes_prove_the_same() {
    let mut random = Random::new(8);
    for round in 0..30 {
        let n = 2 + round % 4;
        let mut small = |rows: usize, columns: usize, size: i64| {
            Matrix::from_fn(rows, columns, |_, _| Rational::from(random.below(2 * size as u64 + 1) as i64 - size))
        };
        // Few different entries, so that multiple eigenvalues and zeros occur over the rationals too.
        let size = 1 + (round % 3) as i64;
        let (a, e) = (small(n, n, size), small(n, n, 4));
        let (b, c) = (small(n, 1 + round % 2, 1), small(1 + round % 3, n, 1));
        let system = LinearSystem { e, ..LinearSystem::state_space(a, b, c) };
        if Image::new(&system, prime_below(1 << 61)).is_none() {
            continue;
        }
        let (small, large) = (with_primes(&system, ascending()), with_primes(&system, descending()));
        assert_eq!(small.lists, large.lists);
        assert_eq!(small.pieces, large.pieces);
        assert_eq!((small.rank, &small.zeros), (large.rank, &large.zeros));
        assert_eq!(small.relative_degrees, large.relative_degrees);
    }
}

/// Primes modulo which the matrices fall apart, before the good ones: the true structure is found all the same.
#[test]
fn injected_unlucky_primes_are_outvoted() {
    let bad = [101u64, 103, 107, 109, 113, 127, 131, 137, 139, 149];
    let product = bad.iter().fold(Rational::ONE, |all, &p| all * Rational::from(p));
    let at = |x: i64| if x == 9 { product.clone() } else { Rational::from(x) };
    let rows = [[0, 9, 0], [0, 0, 1], [0, 0, 9]];
    let a = Matrix::from_fn(3, 3, |i, j| at(rows[i][j]));
    let system = LinearSystem::state_space(a, integers(&[&[0], &[0], &[1]]), integers(&[&[1, 0, 0]]));
    let (mut first, mut then) = (bad.into_iter(), descending());
    let facts = with_primes(&system, || first.next().unwrap_or_else(&mut then));
    // s² (s − product): one Jordan block at zero over the rationals; modulo each bad prime A² = 0 and rank A = 1.
    assert_eq!(facts.lists[0].len(), 1);
    assert_eq!(facts.pieces.len(), 2);
    assert_eq!(facts.relative_degrees, [[Some(3)]]);
    assert_eq!((facts.rank, facts.zero_count), (4, 0));
    // Modulo each bad prime alone the system has another structure.
    let image = Evidence::of(&whole(&system), [None, None], 101).unwrap();
    assert_eq!((image.spectrum.lists[0].len(), image.relative_degrees), (2, vec![vec![None]]));
    assert_eq!(image.zeros.rank, 3);
}

/// A proof that takes too long is reported as not attempted; a structure that does not repeat is not claimed.
#[test]
fn impossible_proofs_are_refused() {
    let system = LinearSystem::state_space(integers(&[&[1]]), integers(&[&[1]]), integers(&[&[1]]));
    let mut facts = with_primes(&system, descending());
    let mut source = Source { primes: &mut descending(), progress: &|_| () };
    let refused = facts.repeat(1 << 50, 0, 1000, &mut source, |_| Some(()));
    assert!(refused.unwrap_err().contains("not attempted"));
    let other = facts.repeat(1000, 0, 1, &mut source, |_| None);
    assert!(other.unwrap_err().contains("differs"));
}

/// The bounds bound: det(s − A) of a matrix with the largest possible determinant (Hadamard), and its nullities.
#[test]
fn bounds_are_valid() {
    let a = integers(&[&[1, 1, 1, 1], &[1, -1, 1, -1], &[1, 1, -1, -1], &[1, -1, -1, 1]]);
    let system = LinearSystem::state_space(a, Matrix::zeros(4, 0), Matrix::zeros(0, 4));
    // A² = 4: χ = (s² − 4)², coefficients up to 16.
    assert!(norm_bits(&system) >= 4);
    let facts = with_primes(&system, descending());
    assert_eq!(facts.lists[0].iter().map(ToString::to_string).collect::<Vec<_>>(), ["s^2 - 4", "s^2 - 4"]);
    let q = Polynomial::new([-4, 0, 1].map(Rational::from).to_vec());
    // K has order 8 and nullity 4: minors of order 4, each row at most √5 resp. √(4 + 16).
    assert!(nullity_bits(&system, &q) >= 4);
}
