//! Numbers of results: intervals, root mean squares, short texts.

use kardan_rt::functions::powi;

use kardan_results::Interval;

/// The interval about a value, if its half-width is finite.
pub(super) fn interval(value: f64, half: f64) -> Option<Interval> {
    half.is_finite().then_some(Interval { lower: value - half, upper: value + half })
}

/// Root mean square of so many numbers.
pub(super) fn rms(count: usize, of: impl Fn(usize) -> f64) -> f64 {
    ((0..count).map(|k| powi(of(k), 2)).sum::<f64>() / count.max(1) as f64).sqrt()
}

/// The mean of numbers, and its standard error.
pub(super) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|x| powi(x - mean, 2)).sum::<f64>();
    (mean, (square / (n - 1.0).max(1.0) / n).sqrt())
}

/// At most six digits.
pub(super) fn short(x: f64) -> String {
    let text = format!("{x:.6}");
    if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e6) {
        return format!("{x:.4e}");
    }
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}
