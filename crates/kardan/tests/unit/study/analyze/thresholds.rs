//! Tests of `src/study/analyze/thresholds.rs`.

use super::*;
use kardan_math::num::Random;

#[test]
fn the_least_of_each_is_the_least() {
    let mut random = Random::new(3);
    for length in 1..20 {
        let numbers: Vec<f64> = (0..length).map(|_| (8.0 * random.unit()).floor()).collect();
        for count in 1..25 {
            let found = least_of_each(&numbers, count);
            for k in 0..length {
                let own = numbers[k..(k + count).min(length)].iter().copied().fold(f64::INFINITY, f64::min);
                assert_eq!(found[k], own, "{numbers:?} {count} {k}");
            }
        }
    }
}
