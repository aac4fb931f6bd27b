//! Tests of `src/num/polynomial.rs`.

use super::*;

fn polynomial(coefficients: &[i64]) -> Polynomial {
    Polynomial::new(coefficients.iter().map(|&c| Rational::from(c)).collect())
}

#[test]
fn display_is_readable() {
    assert_eq!(polynomial(&[-4, 0, 1, -3]).to_string(), "-3 s^3 + s^2 - 4");
    assert_eq!(polynomial(&[0, 1]).to_string(), "s");
    assert_eq!(polynomial(&[]).to_string(), "0");
    let half = Polynomial::new(vec![Rational::from_parts(1.into(), 2u8.into()), Rational::ONE]);
    assert_eq!(half.to_string(), "s + 1/2");
}

/// Wilkinson's polynomial: roots 1 to 20, hopeless in plain floating point.
#[test]
fn roots_are_exact_to_the_last_digits() {
    let mut p = polynomial(&[1]);
    for k in 1..=20 {
        let mut next = vec![Rational::ZERO; p.coefficients.len() + 1];
        for (i, c) in p.coefficients.iter().enumerate() {
            next[i] = next[i].minus(&c.times(&Rational::from(k)));
            next[i + 1] = next[i + 1].plus(c);
        }
        p = Polynomial::new(next);
    }
    for (k, (re, im)) in p.roots().into_iter().enumerate() {
        assert!((re - (k + 1) as f64).abs() < 1e-13 && im == 0.0, "root {k}: {re} {im}");
    }
    assert_eq!(p.simple_factors().len(), 20);
}

/// (s² + 3)² (s − 1/2)³ (s + 7) comes apart, also times a constant that a prime divides.
#[test]
fn square_free_parts_are_exact() {
    let half = Polynomial::new(vec![Rational::from_parts((-1).into(), 2u8.into()), Rational::ONE]);
    let parts = [(polynomial(&[7, 1]), 1), (polynomial(&[3, 0, 1]), 2), (half, 3)];
    let whole = parts.iter().fold(vec![IBig::from((1u64 << 61) - 1)], |all, (g, e)| {
        (0..*e).fold(all, |all, _| multiply_whole(&all, &g.whole_coefficients()))
    });
    let whole = Polynomial::new(whole.into_iter().map(Rational::from).collect());
    assert_eq!(whole.square_free(), parts);
    assert_eq!(polynomial(&[2, 0, 2]).square_free(), [(polynomial(&[1, 0, 1]), 1)]);
    assert_eq!(polynomial(&[5]).square_free(), []);
}

/// Common factors are recovered for any sizes of the coefficients; also where a leading coefficient is the first prime.
#[test]
fn greatest_common_divisors_are_exact() {
    let half = Rational::from_parts(1.into(), 2u8.into());
    let common = polynomial(&[9_007_199_254_740_993, 3, 7]).times(&Polynomial::from_roots(&[half.clone(), half]));
    let first = i64::try_from(prime_below(1 << 61)).unwrap();
    let (p, q) = (common.times(&polynomial(&[-4, 1, first])), common.times(&polynomial(&[5, 1])));
    assert_eq!(p.gcd(&q), common.monic());
    assert_eq!(p.gcd(&polynomial(&[1, 1])), polynomial(&[1]));
    assert_eq!(p.gcd(&Polynomial::default()), p.monic());
    assert!(Polynomial::default().gcd(&Polynomial::default()).is_zero());
    assert_eq!(polynomial(&[6, 0, -4]).primitive(), polynomial(&[-3, 0, 2]));
    assert_eq!(polynomial(&[1, 2, 3]).evaluate(&Rational::from(2)), Rational::from(17));
    assert_eq!(polynomial(&[1, 2]).plus(&polynomial(&[1, -2])), polynomial(&[2]));
}

#[test]
fn widely_spread_and_complex_roots_are_found() {
    // s (s + 10000) (s^2 + 2 s + 10^8): roots 0, -10000, -1 ± 9999.99995 j.
    let p = polynomial(&[0, 1_000_000_000_000, 100_020_000, 10_002, 1]);
    let roots = p.roots();
    assert_eq!(roots[0], (0.0, 0.0));
    let pair: Vec<_> = roots.iter().filter(|root| root.1 != 0.0).collect();
    assert_eq!(pair.len(), 2);
    assert!((pair[0].0 + 1.0).abs() < 1e-12 && (pair[1].1 - 9_999.999_95).abs() < 1e-8, "{roots:?}");
    let factors: Vec<String> = p.simple_factors().iter().map(ToString::to_string).collect();
    assert_eq!(factors, ["s", "s + 10000", "s^2 + 2 s + 100000000"]);
}
