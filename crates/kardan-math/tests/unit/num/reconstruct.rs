//! Tests of `src/num/reconstruct.rs`.

use super::*;
use crate::num::{PrimeField, Random, random_prime};
use proptest::prelude::*;

proptest! {
    /// A fraction is reconstructed from its images.
    #[test]
    fn fractions_come_back(n in any::<i128>(), d in 1u128..u128::MAX, seed in any::<u64>()) {
        let value = Rational::from_parts(IBig::from(n), UBig::from(d));
        let mut random = Random::new(seed);
        let mut all = Reconstruction::new();
        for _ in 0..5 {
            let p = random_prime(&mut random);
            let f = PrimeField::new(p);
            all.add(p, &[f.value(f.rational(&value).unwrap())]);
        }
        prop_assert_eq!(all.fractions(), Some(vec![value]));
    }
}

#[test]
fn whole_numbers_come_back_with_their_sign() {
    let mut all = Reconstruction::new();
    let values = [0i64, 1, -1, 123_456_789_012, -987_654_321_098];
    for p in [(1u64 << 61) - 1, 1_000_003] {
        let f = PrimeField::new(p);
        all.add(p, &values.map(|x| f.value(f.integer(x))));
    }
    assert_eq!(all.integers(), values.map(IBig::from));
}

/// One wrong image does not prevent finding a small fraction; it is distinguished from the right ones.
#[test]
fn wrong_images_are_distinguished() {
    let value = Rational::from_parts(5.into(), 7u32.into());
    let (good, bad) = ([(1u64 << 61) - 1, 1_000_000_007, 998_244_353], 1_000_003);
    let mut all = Reconstruction::new();
    for p in good {
        let f = PrimeField::new(p);
        all.add(p, &[f.value(f.rational(&value).unwrap())]);
    }
    all.add(bad, &[1]);
    assert_eq!(all.fractions(), Some(vec![value.clone()]));
    assert!(good.iter().all(|&p| all.agrees(p, std::slice::from_ref(&value))));
    assert!(!all.agrees(bad, &[value]));
}

#[test]
fn simple_fractions_are_guessed() {
    let third = Rational::from_parts((-1).into(), 3u32.into());
    assert_eq!(nearby_fraction(-1.0 / 3.0, 1e-12), Some(third));
    assert_eq!(nearby_fraction(0.0, 1e-12), Some(Rational::ZERO));
    assert_eq!(nearby_fraction(f64::NAN, 1e-12), None);
}
