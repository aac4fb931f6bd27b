//! Tests of `src/num/positive_roots.rs`.

use super::*;
use crate::num::{Random, Rational};

/// The same result as from all roots, for roots of every size, next to each other, at ends of intervals, and pairs next to the axis.
#[test]
fn they_are_those_among_all_roots() {
    let mut random = Random::new(3);
    let mut found = 0;
    for _ in 0..300 {
        let mut whole = Polynomial::constant(Rational::ONE);
        for _ in 0..1 + (random.unit() * 6.0) as usize {
            let size = Rational::from(1 + (random.unit() * 999.0) as i64);
            let ten = (0..(random.unit() * 24.0) as usize).fold(Rational::ONE, |all, _| all * Rational::from(10));
            let root = size * ten / Rational::from(1_000_000_000_000i64);
            let factor = match (random.unit() * 5.0) as usize {
                0 => vec![root, Rational::ONE],
                1 => vec![-root, Rational::ONE],
                // A power of two is an end.
                2 => vec![-Rational::from(1i64 << (random.unit() * 40.0) as usize), Rational::ONE],
                // Next to the axis, on either side.
                3 => vec![
                    &root * &root * Rational::from_parts(1_000_001.into(), 1_000_000u32.into()),
                    -(root * Rational::from(2)),
                    Rational::ONE,
                ],
                _ => vec![
                    &root * &root * Rational::from_parts(999_999.into(), 1_000_000u32.into()),
                    -(root * Rational::from(2)),
                    Rational::ONE,
                ],
            };
            whole = whole.times(&Polynomial::new(factor));
        }
        let mut expected: Vec<f64> =
            whole.roots().into_iter().filter(|(re, im)| *im == 0.0 && *re > 0.0).map(|(re, _)| re).collect();
        expected.sort_by(f64::total_cmp);
        expected.dedup();
        let roots = whole.positive_roots();
        found += roots.len();
        let close = |(a, b): (&f64, &f64)| (a / b - 1.0).abs() < 1e-15;
        assert!(roots.len() == expected.len() && roots.iter().zip(&expected).all(close), "{roots:?} {expected:?}");
    }
    assert!(found > 500, "{found}");
    assert!(Polynomial::from_roots(&[Rational::ZERO]).positive_roots().is_empty());
    assert!(Polynomial::constant(Rational::from(3)).positive_roots().is_empty());
}
