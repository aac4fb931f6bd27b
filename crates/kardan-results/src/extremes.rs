//! A time series in a few numbers.

/// The least and the greatest value of a signal with their times, and its last value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Least finite value, and when first.
    pub min: Option<Extreme>,
    /// Greatest finite value, and when first.
    pub max: Option<Extreme>,
    /// Last value, finite or not.
    pub last: Option<f64>,
}

/// A value of a signal and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extreme {
    /// The value, SI.
    pub value: f64,
    /// When, s.
    pub time: f64,
}

/// Gives the extremes of `values` (SI) over `time` (s), both of the same length; values that are not finite do not
/// count as extremes.
///
/// ```
/// let found = kardan_results::extremes(&[0.0, 1.0, 2.0], &[0.0, -3.0, 1.0]);
/// assert_eq!(found.min.map(|at| (at.value, at.time)), Some((-3.0, 1.0)));
/// assert_eq!(found.max.map(|at| (at.value, at.time)), Some((1.0, 2.0)));
/// assert_eq!(found.last, Some(1.0));
/// ```
pub fn extremes(time: &[f64], values: &[f64]) -> Extremes {
    let mut found = Extremes { min: None, max: None, last: values.last().copied() };
    for (&time, &value) in time.iter().zip(values).filter(|(_, value)| value.is_finite()) {
        let now = Some(Extreme { value, time });
        if found.min.is_none_or(|least| value < least.value) {
            found.min = now;
        }
        if found.max.is_none_or(|greatest| value > greatest.value) {
            found.max = now;
        }
    }
    found
}

#[cfg(test)]
#[path = "../tests/unit/extremes.rs"]
mod tests;
