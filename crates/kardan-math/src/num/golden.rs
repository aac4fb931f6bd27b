//! Golden-section search for a minimum.

/// Steps of a line search.
const LINE: usize = 40;

/// Where a function is smallest between two places, if it has one minimum there (golden section).
///
/// ```
/// let found = kardan_math::num::golden(0.0, 3.0, &|x| (x - 2.0).abs());
/// assert!((found - 2.0).abs() < 1e-7);
/// ```
pub fn golden(low: f64, high: f64, value: &dyn Fn(f64) -> f64) -> f64 {
    let part = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (low, high);
    let (mut a, mut b) = (high - part * (high - low), low + part * (high - low));
    let (mut at_a, mut at_b) = (value(a), value(b));
    for _ in 0..LINE {
        if at_a <= at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - part * (high - low);
            at_a = value(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + part * (high - low);
            at_b = value(b);
        }
    }
    0.5 * (low + high)
}
