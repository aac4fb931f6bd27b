//! Tests of `src/rounding.rs`.

use super::*;

/// Rates that are differences of two large numbers, of whatever signs and places.
#[test]
fn cancelling_terms_are_detected_in_every_pair_of_places() {
    for size in 2..20 {
        let mut rounding = Rounding::new(size);
        for (i, j, sign) in (0..size).flat_map(|i| (0..i).flat_map(move |j| [(i, j, 1.0), (i, j, -1.0)])) {
            let mut state = vec![0.0; size];
            (state[i], state[j]) = (1.0, sign);
            // The rate is zero at this point.
            rounding.measure(&state, |x, change| {
                change.fill(0.0);
                change[i] = 1e6 * (x[i] - sign * x[j]);
            });
            assert!((rounding.noise[i] / (1e6 * f64::EPSILON) - 1.0).abs() < 0.5, "{size} {i} {j} {sign}");
            assert!(rounding.noise[j] == 0.0);
        }
    }
}
