//! Serial correlation of residuals.

use super::whitened::Whitened;
use crate::distribution::chi_squared_tail;
use kardan_math::num::{Matrix, dot};

/// Residuals of standard size, a series for each row of a sample; those without weight are omitted.
pub(super) fn series(data: &Whitened, values: &[f64]) -> Vec<Vec<f64>> {
    let mut out = vec![Vec::with_capacity(data.len()); data.rows];
    let mut residual = vec![0.0; data.rows];
    for sample in (0..data.len()).filter(|&sample| data.weights[sample] > 0.0) {
        data.residuals(sample, values, &mut residual);
        out.iter_mut().zip(&residual).for_each(|(series, x)| series.push(*x));
    }
    out
}

/// Lags of the test for serial correlation.
const TEST_LAGS: usize = 10;

/// Probability under independence of this correlation of residuals, or a larger one \[Ljung, Box 1978\].
pub(super) fn serial_test(series: &[Vec<f64>]) -> Option<f64> {
    let mut sum = 0.0;
    let mut freedom = 0;
    for x in series {
        let n = x.len();
        let lags = TEST_LAGS.min(n / 5);
        let square = dot(x, x);
        if lags == 0 || !(square > 0.0) {
            continue;
        }
        for lag in 1..=lags {
            let r = dot(&x[lag..], &x[..n - lag]) / square;
            sum += n as f64 * (n as f64 + 2.0) * r * r / (n - lag) as f64;
        }
        freedom += lags;
    }
    chi_squared_tail(freedom as f64, sum)
}

/// Long-run covariance sums of scores with Bartlett's weights.
pub(super) fn newey_west(scores: &[f64], p: usize, lags: usize) -> Matrix<f64> {
    let n = scores.len() / p.max(1);
    let mut out = Matrix::<f64>::zeros(p, p);
    for lag in 0..=lags.min(n.saturating_sub(1)) {
        let weight = 1.0 - lag as f64 / (lags + 1) as f64;
        for t in lag..n {
            let (now, before) = (&scores[t * p..(t + 1) * p], &scores[(t - lag) * p..(t - lag + 1) * p]);
            for i in 0..p {
                for j in 0..p {
                    let both = now[i] * before[j];
                    out[(i, j)] += weight * both;
                    if lag > 0 {
                        out[(j, i)] += weight * both;
                    }
                }
            }
        }
    }
    out
}
