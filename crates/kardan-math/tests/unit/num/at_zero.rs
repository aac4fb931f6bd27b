//! Tests of `src/num/at_zero.rs`.

use kardan_rt::functions::{hypot, powi};

use super::*;
use crate::num::{Random, eigenvalues};

/// Chains of zeros, hidden by a similarity transform: the count is exact, and the rest keeps its eigenvalues.
#[test]
fn chains_of_zeros_that_are_hidden() {
    let mut random = Random::new(3);
    for chains in [vec![1], vec![2], vec![3], vec![1, 1], vec![2, 3], vec![4, 1], vec![]] {
        let zeros: usize = chains.iter().sum();
        let nonzero = [-0.02, -3.0, -450.0, 7.0];
        let n = zeros + nonzero.len();
        let mut a = Matrix::zeros(n, n);
        let mut first = 0;
        for length in &chains {
            (1..*length).for_each(|k| a[(first + k - 1, first + k)] = 1.0);
            first += length;
        }
        for (k, value) in nonzero.iter().enumerate() {
            a[(zeros + k, zeros + k)] = *value;
            (0..zeros + k).for_each(|i| a[(i, zeros + k)] = random.unit());
        }
        let t = Matrix::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) + 0.4 * (random.unit() - 0.5));
        let units: Vec<f64> = (0..n).map(|k| powi(10.0, (k as i32 * 5) % 7 - 3)).collect();
        let hidden = t.solve(&a.multiply(&t)).expect("regular");
        let hidden = Matrix::from_fn(n, n, |i, j| hidden[(i, j)] * units[i] / units[j]);
        let found = at_zero(&hidden, Rounding::OfLargest).expect("finite");
        assert_eq!(found.motions.columns(), zeros, "{chains:?}");
        for value in nonzero {
            let near = eigenvalues(&found.rest).expect("finite");
            let near = near.iter().map(|(re, im)| hypot(re - value, *im)).fold(f64::MAX, f64::min);
            assert!(near < 1e-10, "{chains:?}: {value} is off by {near}");
        }
    }
}
