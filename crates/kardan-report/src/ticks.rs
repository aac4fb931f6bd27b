//! Axis ranges and tick labels.

use super::text::figure;
use kardan_rt::functions::{log10, powi};

/// A drawn axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    /// Lower end.
    pub(super) low: f64,
    /// Upper end.
    pub(super) high: f64,
    /// Distance of two ticks, as a rule 1, 2, 2.5 or 5 times a power of ten; unused for a logarithmic axis.
    pub(super) step: f64,
    pub(super) logarithmic: bool,
}

/// Least and greatest of these values; the first is the larger one if there are none.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// An axis with about `ticks` ticks that covers the values, with `margin` of their span left free at both ends.
/// Values that are all equal (or none at all) get a span around them.
pub(super) fn axis(values: impl Iterator<Item = f64>, margin: f64, ticks: usize) -> Axis {
    let (mut low, mut high) = extent(values.filter(|value| value.is_finite()));
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
    Axis::linear(low, high, step.unwrap_or(10.0 * power))
}

/// An axis of whole decades, of the logarithms of the values that have one.
pub(super) fn decades(values: impl Iterator<Item = f64>) -> Axis {
    let (low, high) = extent(values.filter(|value| *value > 0.0 && value.is_finite()).map(log10));
    if low > high {
        return Axis::linear(0.0, 1.0, 1.0);
    }
    let (low, high) = (low.floor(), high.ceil());
    let high = if high > low { high } else { low + 1.0 };
    Axis::linear(low, high, ((high - low) / 9.0).ceil())
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
    pub(super) fn linear(low: f64, high: f64, step: f64) -> Self {
        Self { low, high, step, logarithmic: false }
    }

    pub(super) fn logarithmic(low: f64, high: f64) -> Self {
        Self { low, high, step: 0.0, logarithmic: true }
    }

    /// About this number of ticks, at multiples of one of these steps.
    pub(super) fn by(steps: &[f64], low: f64, high: f64, most: f64) -> Self {
        let step = steps.iter().copied().find(|step| (high - low) / step <= most);
        let step = step.unwrap_or_else(|| steps.last().copied().unwrap_or(1.0));
        let (low, high) = ((low / step).floor() * step, (high / step).ceil() * step);
        let high = if high > low { high } else { low + step };
        Self::linear(low, high, step)
    }

    /// Part of the axis, 0 to 1 within it.
    pub(super) fn place(&self, value: f64) -> f64 {
        if self.logarithmic {
            log10(value / self.low) / log10(self.high / self.low)
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Ticks with their labels; those without one are between two others.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        if self.logarithmic {
            let (first, last) = (log10(self.low).floor() as i32, log10(self.high).ceil() as i32);
            let fine = log10(self.high / self.low) <= 4.0;
            let decades = (first..=last).flat_map(|power| (1..10).map(move |step| (power, step)));
            let named = |(power, step): (i32, i32)| {
                let label = if step == 1 { figure(powi(10.0, power), 3) } else { String::new() };
                (f64::from(step) * powi(10.0, power), label)
            };
            let all = decades.filter(|(_, step)| fine || *step == 1).map(named);
            return all.filter(|(at, _)| (self.low * 0.999..=self.high * 1.001).contains(at)).collect();
        }
        let (first, last) =
            ((self.low / self.step - 1e-6).ceil() as i64, (self.high / self.step + 1e-6).floor() as i64);
        (first..=last).map(|k| k as f64 * self.step).map(|at| (at, self.label(at))).collect()
    }

    /// The same at their parts of the axis.
    pub(super) fn placed_ticks(&self) -> impl Iterator<Item = (f64, String)> {
        self.ticks().into_iter().map(|(at, label)| (self.place(at), label))
    }

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
