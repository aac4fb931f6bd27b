//! Axis ranges and tick labels.

use kardan_rt::functions::{log10, powi};

/// A drawn axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    /// Lower end.
    pub(super) low: f64,
    /// Upper end.
    pub(super) high: f64,
    /// Distance of two ticks: 1, 2, 2.5 or 5 times a power of ten.
    pub(super) step: f64,
}

/// An axis with about `ticks` ticks that covers the values, with `margin` of their span left free at both ends.
/// Values that are all equal (or none at all) get a span around them.
pub(super) fn axis(values: impl Iterator<Item = f64>, margin: f64, ticks: usize) -> Axis {
    let (mut low, mut high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        (low, high) = (0.0, 1.0);
    }
    // A span below the resolution of the numbers cannot be labelled.
    let size = low.abs().max(high.abs());
    if high - low <= 1e-9 * size || high == low {
        let half = if size > 0.0 { 0.1 * size } else { 1.0 };
        (low, high) = (low - half, high + half);
    }
    let free = margin * (high - low);
    (low, high) = (low - free, high + free);
    let raw = (high - low) / ticks.max(1) as f64;
    let power = powi(10.0, log10(raw).floor() as i32);
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().map(|nice| nice * power).find(|&step| step >= 0.8 * raw);
    Axis { low, high, step: step.unwrap_or(10.0 * power) }
}

/// An axis of whole decades, of the logarithms of the values that have one.
pub(super) fn decades(values: impl Iterator<Item = f64>) -> Axis {
    let (low, high) = values
        .filter(|value| *value > 0.0 && value.is_finite())
        .map(log10)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return Axis { low: 0.0, high: 1.0, step: 1.0 };
    }
    let (low, high) = (low.floor(), high.ceil());
    let high = if high > low { high } else { low + 1.0 };
    Axis { low, high, step: ((high - low) / 9.0).ceil() }
}

/// The label of a decade: `0.01`, `1e−9`.
pub(super) fn decade(exponent: f64) -> String {
    let whole = exponent.round();
    if (exponent - whole).abs() > 1e-6 {
        return String::new();
    }
    let label = if (-3.0..=4.0).contains(&whole) { powi(10.0, whole as i32).to_string() } else { format!("1e{whole}") };
    label.replace('-', "−")
}

impl Axis {
    /// The label of a tick: as many digits as the step needs, a common exponent for very large and very small axes.
    pub(super) fn label(&self, value: f64) -> String {
        let value = if value.abs() < 1e-6 * self.step { 0.0 } else { value };
        let size = self.low.abs().max(self.high.abs());
        let exponent = if (1e-3..1e6).contains(&size) { 0 } else { log10(size).floor() as i32 };
        let scale = powi(10.0, exponent);
        let step = self.step / scale;
        let decimals = (0..12).find(|&decimals| {
            let shifted = step * powi(10.0, decimals);
            (shifted - shifted.round()).abs() < 1e-6 * shifted
        });
        let number = format!("{:.*}", decimals.unwrap_or(12) as usize, value / scale);
        let number = if exponent == 0 || value == 0.0 { number } else { format!("{number}e{exponent}") };
        number.replace('-', "−")
    }
}

#[cfg(test)]
#[path = "../tests/unit/ticks.rs"]
mod tests;
