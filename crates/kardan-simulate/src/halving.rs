//! Bisection.

/// The numbers about the place where a condition begins to hold, from one at which it does not hold and a later one at
/// which it does: no further apart than `least`, or neighbouring.
pub(super) fn halved(mut low: f64, mut high: f64, least: f64, mut holds: impl FnMut(f64) -> bool) -> (f64, f64) {
    loop {
        let middle = 0.5 * (low + high);
        if !(low < middle && middle < high) || high - low <= least {
            return (low, high);
        }
        if holds(middle) { high = middle } else { low = middle }
    }
}
