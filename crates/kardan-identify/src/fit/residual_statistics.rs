//! Tests of the residuals.

use kardan_rt::functions::{powf, powi};

use super::Fit;
use super::serial::{serial_test, series};
use super::whitened::Whitened;
use crate::Samples;
use crate::distribution::{chi_squared_tail, fisher_tail, student_tails};

/// A test of the residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// The tested property.
    pub what: TestKind,
    /// Probability of this deviation, or a larger one, if the model is correct.
    pub probability: f64,
}

/// Tested properties of residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestKind {
    /// Their mean is zero (row of the balance).
    Mean(usize),
    /// They are independent of each other in time.
    Serial,
    /// They are normal.
    Normal,
    /// They do not depend on the speed of a reduced coordinate.
    Speed(usize),
}

/// Bins of the test for dependence on a speed.
const BINS: usize = 10;

/// Tests of the residuals of a fit on its own samples.
pub fn residual_statistics(samples: &Samples, fit: &Fit) -> Vec<Test> {
    let all: Vec<usize> = (0..samples.len()).collect();
    let corrected = fit.corrected(samples);
    let mut data = Whitened::new(corrected.as_ref().unwrap_or(samples), &all, fit.shapes.clone());
    data.weights.clone_from(&fit.weights);
    fit.row_factors.iter().for_each(|lower| data.divide(lower));
    let series = series(&data, &fit.values[..fit.columns]);
    let mut out = Vec::new();
    let retained: Vec<usize> = (0..data.len()).filter(|&sample| fit.weights[sample] > 0.0).collect();
    let n = retained.len() as f64;
    for (row, x) in series.iter().enumerate() {
        let mean = x.iter().sum::<f64>() / n;
        let spread = (x.iter().map(|x| powi(x - mean, 2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        let probability = student_tails(n - 1.0, mean / spread).filter(|_| spread > 0.0);
        out.extend(probability.map(|probability| Test { what: TestKind::Mean(row), probability }));
    }
    out.extend(serial_test(&series).map(|probability| Test { what: TestKind::Serial, probability }));
    let all: Vec<f64> = series.concat();
    let count = all.len() as f64;
    let mean = all.iter().sum::<f64>() / count;
    let moment = |power: i32| all.iter().map(|x| powi(x - mean, power)).sum::<f64>() / count;
    let square = moment(2);
    if square > 0.0 && count > 7.0 {
        let (skew, excess) = (moment(3) / powf(square, 1.5), moment(4) / (square * square) - 3.0);
        let sum = count / 6.0 * (skew * skew + excess * excess / 4.0);
        out.extend(chi_squared_tail(2.0, sum).map(|probability| Test { what: TestKind::Normal, probability }));
    }
    for coordinate in 0..samples.degrees_of_freedom {
        let mut order: Vec<usize> = (0..retained.len()).collect();
        let speed = |k: usize| samples.motion(retained[k], 1)[coordinate];
        order.sort_by(|&a, &b| speed(a).total_cmp(&speed(b)));
        let bins = BINS.min(retained.len() / 5);
        if bins < 3 {
            continue;
        }
        let (mut between, mut inside_bins) = (0.0, 0.0);
        for x in &series {
            let all = x.iter().sum::<f64>() / n;
            for bin in 0..bins {
                let own = &order[bin * order.len() / bins..(bin + 1) * order.len() / bins];
                let mean = own.iter().map(|&k| x[k]).sum::<f64>() / own.len() as f64;
                between += own.len() as f64 * powi(mean - all, 2);
                inside_bins += own.iter().map(|&k| powi(x[k] - mean, 2)).sum::<f64>();
            }
        }
        let rows = series.len() as f64;
        let (a, b) = (rows * (bins as f64 - 1.0), rows * (n - bins as f64));
        let probability = fisher_tail((a, b), between / a / (inside_bins / b)).filter(|_| inside_bins > 0.0);
        out.extend(probability.map(|probability| Test { what: TestKind::Speed(coordinate), probability }));
    }
    out
}
