//! Tests of `src/expr/surds.rs`.

use kardan_rt::functions::{cos, sin};

use super::*;

fn value(x: &Surd) -> f64 {
    let roots = x.roots.iter().zip(SQUARES).map(|(x, square)| rational_to_f64(x) * (square as f64).sqrt());
    roots.sum::<f64>() + rational_to_f64(&x.pi) * PI
}

/// Sines of all multiples of 15° are those of floating point, `sin² + cos² = 1` and `x · 1/x = 1` are exact, and the rational ones are
/// fractions (Niven: 0, ±1/2 and ±1 alone).
#[test]
fn sines_of_multiples_of_fifteen_degrees() {
    for k in -50i32..50 {
        let angle = f64::from(k) * PI / 12.0;
        let exact = Surd::recognise_double(angle).unwrap();
        let [s, c] = Surds.sine_cosine(&Some(exact)).map(Option::unwrap);
        assert!((value(&s) - sin(angle)).abs() < 1e-14 && (value(&c) - cos(angle)).abs() < 1e-14, "{k}");
        let one = s.times(&s).unwrap().plus(&c.times(&c).unwrap());
        assert_eq!(one.to_rational(), Some(Rational::ONE), "{k}");
        if !s.is_zero() {
            let one = s.times(&s.reciprocal().unwrap()).unwrap();
            assert_eq!(one.to_rational(), Some(Rational::ONE), "{k}");
        }
        assert_eq!(s.to_rational().is_some(), [0, 2, 6, 10].contains(&k.rem_euclid(12)), "{k}");
    }
    // Decimal numbers from a file are no angles.
    assert_eq!(Surd::recognise_double(1.57).unwrap().cosine(), None);
    assert_eq!(Surd::rational(Rational::ONE).cosine(), None);
}
