//! Tests of `src/num/root_sides.rs`.

use super::*;
use proptest::prelude::*;

fn quadratic(re: i64, im: i64) -> Polynomial {
    Polynomial::new([re * re + im * im, -2 * re, 1].map(Rational::from).to_vec())
}

proptest! {
    /// Products of known factors: (s − a) and (s − re)² + im², each as often as it comes, also as images of the unit circle.
    #[test]
    fn roots_of_products_of_factors(
        real in proptest::collection::vec(-3i64..=3, 0..5),
        pairs in proptest::collection::vec((-2i64..=2, 1i64..=3), 0..4),
        factor in prop_oneof![Just(-2i64), Just(3)],
    ) {
        let mut p = Polynomial::constant(Rational::from(factor));
        for &a in &real {
            p = p.times(&Polynomial::from_roots(&[Rational::from(a)]));
        }
        for &(re, im) in &pairs {
            p = p.times(&quadratic(re, im));
        }
        let all = || real.iter().copied().chain(pairs.iter().flat_map(|(re, _)| [*re, *re]));
        let count = |side: Ordering| all().filter(|re| re.cmp(&0) == side).count();
        let expected = [count(Ordering::Less), count(Ordering::Equal), count(Ordering::Greater)];
        let found = root_sides(&p);
        prop_assert_eq!([found.left, found.border, found.right], expected);
        if found.right == 0 {
            let product = found.on_border.iter().fold(Polynomial::constant(Rational::ONE), |all, (part, times)| {
                (0..*times).fold(all, |all, _| all.times(part))
            });
            prop_assert_eq!(product.degree(), found.border);
            prop_assert!(p.divide(&product).1.is_zero());
        }
        // The axis is the image of the circle; s = 1 is that of infinity.
        if !real.contains(&1) {
            let z = from_cayley(&p);
            prop_assert_eq!(z.degree(), p.degree());
            prop_assert_eq!(cayley(&z).monic(), p.monic());
        }
    }
}
