//! Tests of `src/num/fourier.rs`.

use super::*;

/// Against the sum that defines it, of numbers of samples with and without factors.
#[test]
fn it_is_the_sum_that_defines_it() {
    for n in [1, 2, 3, 8, 12, 31, 100] {
        let samples: Vec<f64> = (0..n).map(|k| ((k * k * 7 + 3 * k) % 11) as f64 - 5.0).collect();
        for (k, found) in fourier(&samples).iter().enumerate() {
            let mut sum = [0.0; 2];
            for (j, x) in samples.iter().enumerate() {
                let [cosine, sine] = rotation(-2.0 * PI * ((j * k) % n) as f64 / n as f64);
                sum = [sum[0] + x * cosine, sum[1] + x * sine];
            }
            assert!((found[0] - sum[0]).abs() + (found[1] - sum[1]).abs() < 1e-12, "{n} {k}: {found:?} {sum:?}");
        }
    }
}
