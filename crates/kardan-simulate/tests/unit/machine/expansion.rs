//! Tests of `src/machine/expansion.rs`.

use super::{Prospect, first_zero};

fn is_positive(c: &[f64]) -> bool {
    first_zero(c, 0.0, false) == Prospect::Stays
}

#[test]
fn only_positive_polynomials_are_reported() {
    // (1 − s)² + 1/10, s(1 − s/2), 1: positive; each with a truncated term that is almost zero.
    for c in [vec![1.1, -2.0, 1.0, 0.0], vec![0.0, 1.0, -0.5, 0.0], vec![1.0, 0.0]] {
        assert!(is_positive(&c), "{c:?}");
    }
    // A zero inside, at the end, a negative begin, NaN, and a double zero just above the axis that the last term
    // may hide.
    for c in [
        vec![1.0, -3.0, 1.0, 0.0],
        vec![1.0, -1.0, 0.0],
        vec![-1e-30, 1.0, 0.0],
        vec![f64::NAN, 1.0, 0.0],
        vec![1.0, f64::NAN, 0.0],
        vec![0.25, -1.0, 1.0, 1e-3],
    ] {
        assert!(!is_positive(&c), "{c:?}");
    }
    // Random ones against a fine grid: the result is correct.
    let mut seed = 1u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let mut counts = [0; 3];
    for _ in 0..20_000 {
        let c: Vec<f64> = (0..7).map(|k| random() + if k == 0 { 0.5 } else { 0.0 }).collect();
        let at = |s: f64| c.iter().rev().fold(0.0, |sum, c| sum * s + c);
        let least = |to: f64| (0..=200).map(|k| at(to * f64::from(k) / 200.0)).fold(f64::INFINITY, f64::min);
        match first_zero(&c, 0.0, false) {
            Prospect::Stays => {
                counts[0] += 1;
                assert!(least(1.0) > 0.0, "{c:?}");
            }
            // Positive before the zero, not after it.
            Prospect::Leaves(s) => {
                counts[1] += 1;
                assert!(least(s * (1.0 - 1e-9)) > 0.0 && at(s) <= 1e-15 && at(s + 1e-9) < 0.0, "{s}: {c:?}");
            }
            Prospect::Unknown => {
                counts[2] += 1;
                assert!(c[0] < 0.0 || least(1.0) <= c[6].abs() + 1e-3, "{c:?}");
            }
        }
    }
    assert!(counts[0] > 4000 && counts[1] > 4000, "{counts:?}");
}
