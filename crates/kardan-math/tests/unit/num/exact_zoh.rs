//! Tests of `src/num/exact_zoh.rs`.

use kardan_rt::functions::{cos, exp, sin};

use super::*;
use crate::num::rational_to_f64;

fn rational(numerator: i64, denominator: u64) -> Rational {
    Rational::from_parts(numerator.into(), denominator.into())
}

/// A decay and a turn have closed forms; both functions as they are, at a long and a short time.
#[test]
fn decays_and_turns_are_their_closed_forms() {
    for time in [rational(1, 1000), rational(3, 2), rational(40, 1)] {
        let t = rational_to_f64(&time);
        let decay = Matrix::from_fn(1, 1, |_, _| rational(-7, 3));
        let [e, integral] = exact_zoh(&decay, &time).unwrap();
        let expected = exp(-7.0 * t / 3.0);
        assert!((rational_to_f64(&e[(0, 0)]) / expected - 1.0).abs() < 1e-13);
        assert!((rational_to_f64(&integral[(0, 0)]) - (1.0 - expected) * 3.0 / 7.0).abs() < 1e-15);
        let turn = Matrix::from_fn(2, 2, |i, j| rational([[0, 2], [-2, 0]][i][j], 1));
        let [e, integral] = exact_zoh(&turn, &time).unwrap();
        let (sine, cosine) = (sin(2.0 * t), cos(2.0 * t));
        assert!((rational_to_f64(&e[(0, 1)]) - sine).abs() < 1e-14 * (1.0 + t));
        assert!((rational_to_f64(&integral[(0, 0)]) - sine / 2.0).abs() < 1e-14 * (1.0 + t));
        assert!((rational_to_f64(&integral[(0, 1)]) - (1.0 - cosine) / 2.0).abs() < 1e-14 * (1.0 + t));
        // cos² + sin² = 1 to far more digits than those of a double.
        let one = e[(0, 0)].times(&e[(0, 0)]).plus(&e[(0, 1)].times(&e[(0, 1)]));
        assert!(rational_to_f64(&one.minus(&Rational::ONE)).abs() < 1e-80);
    }
}

/// A stiff one, and one that overflows.
#[test]
fn fast_decays_vanish_and_overflow_is_reported() {
    let a = |x: i64| Matrix::from_fn(2, 2, |i, j| rational([[x, 1], [0, -1]][i][j], 1));
    let [e, integral] = exact_zoh(&a(-1_000_000), &Rational::ONE).unwrap();
    assert!(rational_to_f64(&e[(0, 0)]).abs() < 1e-60);
    assert!((rational_to_f64(&integral[(0, 0)]) - 1e-6).abs() < 1e-20);
    assert!(exact_zoh(&a(1_000_000), &Rational::ONE).is_none());
    let [e, _] = exact_zoh(&a(3), &Rational::ONE).unwrap();
    // The closed form of a triangle.
    let expected = [exp(3.0), (exp(3.0) - exp(-1.0)) / 4.0, 0.0, exp(-1.0)];
    for (exact, expected) in e.to_f64().as_slice().iter().zip(expected) {
        assert!((exact - expected).abs() <= 1e-15 * expected, "{exact} for {expected}");
    }
}

/// A result with few digits differs from one with many by at most its bound, and not by much less; double the time gives the square.
#[test]
fn errors_satisfy_their_bounds() {
    let mut random = Random::new(4);
    for n in 1..7 {
        for (time, spread) in [(rational(1, 1000), 40), (rational(3, 2), 9), (rational(50, 1), 3)] {
            let a = Matrix::from_fn(n, n, |_, _| rational(random.small(spread), 7));
            let [coarse, many] = [100, 400].map(|digits| ExactZoh::new(&a, &time, digits).unwrap());
            let doubled = ExactZoh::new(&a, &(&time + &time), 400).unwrap();
            let norm = |matrix: &Matrix<Rational>| {
                let row = |i: usize| matrix.row(i).iter().map(|x| rational_to_f64(x).abs()).sum::<f64>();
                log2((0..n).map(row).fold(0.0, f64::max))
            };
            let difference = |a: &Matrix<Rational>, b: &Matrix<Rational>| norm(&a.plus(&b.scale(&-Rational::ONE)));
            let found =
                difference(&coarse.transition, &many.transition).max(difference(&coarse.integral, &many.integral));
            assert!(
                found < coarse.off && coarse.off < 40.0 - 100.0 + 3.0 * norm(&many.transition).max(0.0),
                "{n} {time}: 2^{found} {}",
                coarse.off
            );
            let square = many.transition.multiply(&many.transition);
            assert!(
                difference(&square, &doubled.transition)
                    < doubled.off.max(many.off) + norm(&many.transition).max(0.0) + 3.0
            );
        }
    }
}

/// Nilpotent powers are summed up exactly, for any place of the entries.
#[test]
fn series_that_end_are_exact() {
    // S N S⁻¹ with N³ = 0.
    let shift = Matrix::from_fn(3, 3, |i, j| Rational::from(u8::from(j == i + 1)));
    let change = Matrix::from_fn(3, 3, |i, j| Rational::from([[1, 2, 0], [3, 1, 1], [0, 1, 2]][i][j]));
    let a = change.multiply(&shift).multiply(&change.solve(&Matrix::identity(3)).unwrap());
    let time = rational(1, 3);
    let found = ExactZoh::new(&a, &time, 60).unwrap();
    let one = Matrix::identity(3);
    let squared = a.multiply(&a);
    let expected = one.plus(&a.scale(&time)).plus(&squared.scale(&rational(1, 18)));
    assert_eq!((found.off, &found.transition), (f64::NEG_INFINITY, &expected));
    let expected = one.scale(&time).plus(&a.scale(&rational(1, 18))).plus(&squared.scale(&rational(1, 162)));
    assert_eq!(found.integral, expected);
}
