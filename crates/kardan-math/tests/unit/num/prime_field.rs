//! Tests of `src/num/prime_field.rs`.

use super::*;
use proptest::prelude::*;

proptest! {
    /// The arithmetic is that of `u128` modulo p.
    #[test]
    fn arithmetic_is_modular(a in 0u64..u64::MAX, b in 0u64..u64::MAX, seed in 0u64..u64::MAX) {
        let p = random_prime(&mut Random::new(seed));
        let f = PrimeField::new(p);
        let (x, y) = (f.element(a), f.element(b));
        let (a, b, wide) = (u128::from(a % p), u128::from(b % p), u128::from(p));
        prop_assert_eq!(u128::from(f.value(f.times(x, y))), a * b % wide);
        prop_assert_eq!(u128::from(f.value(f.plus(x, y))), (a + b) % wide);
        prop_assert_eq!(u128::from(f.value(f.minus(x, y))), (a + wide - b) % wide);
        if x != 0 {
            prop_assert_eq!(f.times(x, f.inverse(x)), f.one());
        }
        let (long, mut sum) = (vec![f.negate(f.one()); 1000], 0);
        for z in &long {
            sum = f.plus(sum, f.times(*z, x));
        }
        prop_assert_eq!(f.dot(&long, &vec![x; 1000]), sum);
    }
}

/// A repeated prime is skipped: the remainders modulo equal primes give no new information.
#[test]
fn primes_are_distinct() {
    let first: Vec<u64> = Primes::new(3).take(4).collect();
    let again = [first[2], first[2], first[0]];
    let all: Vec<u64> = Primes::new(3).after(&again).take(6).collect();
    assert_eq!(all[..4], [first[2], first[0], first[1], first[3]]);
    assert!(!first.contains(&all[4]) && all[4] != all[5]);
}

#[test]
fn primes_come_in_descending_order() {
    assert_eq!(prime_below(1 << 61), (1 << 61) - 1);
    assert_eq!([prime_below(30), prime_below(29), prime_below(24), prime_below(4)], [29, 23, 23, 3]);
}

#[test]
fn fractions_become_quotients() {
    let f = PrimeField::new(101);
    let third = f.rational(&Rational::from_parts((-1).into(), 3u32.into())).unwrap();
    assert_eq!(f.plus(f.times(third, f.element(3)), f.one()), 0);
    assert_eq!(f.rational(&Rational::from_parts(1.into(), 202u32.into())), None);
}
