//! The few numbers that stand for a time series.

/// Where a signal goes: its least and its greatest value, when, and where it ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Least finite value; NaN if there is none.
    pub min: f64,
    /// Greatest finite value; NaN if there is none.
    pub max: f64,
    /// Last value, finite or not; NaN if there is none.
    pub last: f64,
    /// First time of `min`, s.
    pub t_min: f64,
    /// First time of `max`, s.
    pub t_max: f64,
}

/// Gives the extremes of `values` (SI) over `time` (s), both of the same length; values that are not finite do not
/// count as extremes.
///
/// ```
/// let e = kardan::export::extremes(&[0.0, 1.0, 2.0], &[0.0, -3.0, 1.0]);
/// assert_eq!((e.min, e.t_min, e.max, e.t_max, e.last), (-3.0, 1.0, 1.0, 2.0, 1.0));
/// ```
pub fn extremes(time: &[f64], values: &[f64]) -> Extremes {
    let last = values.last().copied().unwrap_or(f64::NAN);
    let mut found = Extremes { min: f64::NAN, max: f64::NAN, last, t_min: f64::NAN, t_max: f64::NAN };
    for (&t, &value) in time.iter().zip(values).filter(|(_, value)| value.is_finite()) {
        if found.min.is_nan() || value < found.min {
            (found.min, found.t_min) = (value, t);
        }
        if found.max.is_nan() || value > found.max {
            (found.max, found.t_max) = (value, t);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn infinities_and_gaps_are_no_extremes() {
        let e = extremes(&[0.0, 1.0, 2.0, 3.0], &[f64::INFINITY, 2.0, 2.0, f64::NAN]);
        assert_eq!((e.min, e.t_min, e.max, e.t_max), (2.0, 1.0, 2.0, 1.0));
        assert!(e.last.is_nan());
        assert!(extremes(&[], &[]).min.is_nan());
    }
}
