//! Measures of a signal in a window: on straight lines between the rows, with an estimate of the error of the grid of rows.

use kardan_model::tables::Measure;

/// Rows of a window.
#[derive(Debug, Clone, Copy)]
pub(in crate::study) struct Window<'a> {
    pub(in crate::study) times: &'a [f64],
    pub(in crate::study) values: &'a [f64],
}

/// Tolerance of a signal around its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Band {
    /// In the unit of the signal.
    Size(f64),
    /// As a fraction of the way from the first value to the target.
    Part(f64),
}

/// A measure, and an estimate of the error of the grid of rows: its change if every other row is left out, the height of a parabola
/// through an extreme above it, or the distance of two rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::study) struct Measured {
    pub(in crate::study) value: f64,
    pub(in crate::study) grid: f64,
}

/// The measure of a signal alone; `Err` says why there is none.
pub(in crate::study) fn measured(
    measure: Measure,
    window: Window<'_>,
    target: Option<f64>,
    band: Option<Band>,
) -> Result<Measured, &'static str> {
    let Window { values, .. } = window;
    if values.is_empty() {
        return Err("no row lies in its window");
    }
    if values.iter().any(|value| !value.is_finite()) {
        return Err("the expression is no number in some rows of its window");
    }
    let both = |of: &dyn Fn(Rows<'_>) -> f64| {
        let [value, coarse] = [1, 2].map(|every| of(Rows { window, every }));
        Measured { value, grid: (value - coarse).abs() }
    };
    let extreme = |sign: f64| {
        let found = highest(window, |x| sign * x);
        Measured { value: sign * found.value, ..found }
    };
    Ok(match measure {
        Measure::Max => extreme(1.0),
        Measure::Min => extreme(-1.0),
        Measure::MaxAbs => highest(window, f64::abs),
        Measure::Final => Measured { value: values[values.len() - 1], grid: 0.0 },
        Measure::Rms => both(&|rows| root_mean_square(rows, 0.0)),
        Measure::Ripple => both(&|rows| root_mean_square(rows, rows.mean(|x| x))),
        Measure::Iae => both(&|rows| absolute_error(rows, target.unwrap_or(0.0))),
        Measure::Energy => both(&|rows| rows.integral(|x| x)),
        Measure::Overshoot => return overshoot(window, target),
        Measure::RiseTime => return rise_time(window, target, band),
        Measure::SettlingTime => return settling_time(window, target, band),
        Measure::Mean => both(&|rows| rows.mean(|x| x)),
        Measure::PeakToPeak => {
            let (most, least) = (highest(window, |x| x), highest(window, |x| -x));
            Measured { value: most.value + least.value, grid: most.grid + least.grid }
        }
        Measure::TimeOfMax => time_of(window, 1.0),
        Measure::TimeOfMin => time_of(window, -1.0),
        _ => return Err("it is not a measure of one signal"),
    })
}

/// The time of the largest value of a signal, from the start of the window, and the distance of the rows there.
fn time_of(window: Window<'_>, sign: f64) -> Measured {
    let times = window.times;
    let best = place_of_highest(window, |x| sign * x);
    let gap = |k: usize| times.get(k + 1).map_or(0.0, |next| next - times[k]);
    Measured { value: times[best] - times[0], grid: gap(best).max(best.checked_sub(1).map_or(0.0, gap)) }
}

/// Each row of a window, or every other one and the last.
#[derive(Clone, Copy)]
struct Rows<'a> {
    window: Window<'a>,
    every: usize,
}

impl<'a> Rows<'a> {
    /// The pieces between the rows: length and the values at both ends.
    fn pieces(self) -> impl Iterator<Item = (f64, f64, f64)> + 'a {
        let Self { window: Window { times, values }, every } = self;
        let last = times.len().saturating_sub(1);
        (0..last).step_by(every).map(move |k| {
            let next = (k + every).min(last);
            (times[next] - times[k], values[k], values[next])
        })
    }

    /// The integral over time of a function of values, on straight lines between the rows.
    fn integral(self, of: impl Fn(f64) -> f64) -> f64 {
        self.pieces().map(|(length, from, until)| 0.5 * (of(from) + of(until)) * length).sum()
    }

    /// The mean over time; of one row its value. Rows may be closer to each other at events.
    fn mean(self, of: impl Fn(f64) -> f64) -> f64 {
        let Window { times, values } = self.window;
        let length = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
        if length <= 0.0 {
            return values.iter().map(|x| of(*x)).sum::<f64>() / values.len() as f64;
        }
        self.integral(of) / length
    }
}

/// The row with the largest value of a function; the first of several.
fn place_of_highest(window: Window<'_>, of: impl Fn(f64) -> f64) -> usize {
    let values = window.values;
    (1..values.len()).fold(0, |best, k| if of(values[k]) > of(values[best]) { k } else { best })
}

/// The largest value of a function of the rows, and the height of the parabola through it and its neighbours above it.
fn highest(window: Window<'_>, of: impl Fn(f64) -> f64) -> Measured {
    let Window { times, values } = window;
    let best = place_of_highest(window, &of);
    let value = of(values[best]);
    let inner = best.checked_sub(1).filter(|_| best + 1 < values.len());
    let rise = inner.map_or(0.0, |before| {
        let [left, right] = [times[best] - times[before], times[best + 1] - times[best]];
        let [from, until] = [(value - of(values[before])) / left, (of(values[best + 1]) - value) / right];
        let (slope, curvature) = ((from * right + until * left) / (left + right), (until - from) / (left + right));
        if curvature < 0.0 { -slope * slope / (4.0 * curvature) } else { 0.0 }
    });
    Measured { value, grid: if rise.is_finite() { rise } else { 0.0 } }
}

/// The root of the mean over time of `(x − centre)²`.
fn root_mean_square(rows: Rows<'_>, centre: f64) -> f64 {
    rows.mean(|x| (x - centre) * (x - centre)).sqrt()
}

/// The integral of the distance from a target.
fn absolute_error(rows: Rows<'_>, target: f64) -> f64 {
    let piece = |(length, from, until): (f64, f64, f64)| {
        let (a, b) = (from - target, until - target);
        let mean = if a * b >= 0.0 { 0.5 * (a + b).abs() } else { 0.5 * (a * a + b * b) / (a.abs() + b.abs()) };
        mean * length
    };
    rows.pieces().map(piece).sum()
}

/// The overshoot of a signal over its target, as a fraction of the way to it.
fn overshoot(window: Window<'_>, target: Option<f64>) -> Result<Measured, &'static str> {
    let values = window.values;
    let (first, target) = (values[0], target.unwrap_or(values[values.len() - 1]));
    let way = target - first;
    if way == 0.0 {
        return Err("it begins its window at its target, so overshoot is not defined");
    }
    let most = highest(window, |x| (x - target) / way);
    Ok(Measured { value: most.value.max(0.0), ..most })
}

/// The target and the half width of the band around it.
fn target_band(window: Window<'_>, target: Option<f64>, band: Option<Band>) -> (f64, f64) {
    let values = window.values;
    let target = target.unwrap_or(values[values.len() - 1]);
    let band = match band.unwrap_or(Band::Part(0.02)) {
        Band::Size(size) => size,
        Band::Part(part) => part * (target - values[0]).abs(),
    };
    (target, band)
}

/// The time of the first entry of a signal into the band around its target, from the start of the window.
fn rise_time(window: Window<'_>, target: Option<f64>, band: Option<Band>) -> Result<Measured, &'static str> {
    let (target, band) = target_band(window, target, band);
    let values = window.values;
    // A straight line through the band between two rows counts as inside too.
    let inside = |k: &usize| {
        let from = values[k.saturating_sub(1)] - target;
        (values[*k] - target).abs() <= band || from * (values[*k] - target) < 0.0
    };
    match (0..values.len()).find(inside) {
        None => Err("it does not reach its band in the window"),
        Some(0) => Ok(Measured { value: 0.0, grid: 0.0 }),
        Some(first) => Ok(enters(window, first - 1, target, band)),
    }
}

/// The time of the last entry of a signal into the band around its target, from the start of the window.
fn settling_time(window: Window<'_>, target: Option<f64>, band: Option<Band>) -> Result<Measured, &'static str> {
    let (target, band) = target_band(window, target, band);
    let values = window.values;
    let last = values.len() - 1;
    let outside = |k: &usize| (values[*k] - target).abs() > band;
    let Some(before) = (0..=last).rev().find(outside) else { return Ok(Measured { value: 0.0, grid: 0.0 }) };
    if before == last {
        return Err("it is outside of its band at the end of the window");
    }
    Ok(enters(window, before, target, band))
}

/// The point where the straight line from a row outside of a band to the next row enters it.
fn enters(window: Window<'_>, before: usize, target: f64, band: f64) -> Measured {
    let Window { times, values } = window;
    let [from, until] = [values[before] - target, values[before + 1] - target];
    let length = times[before + 1] - times[before];
    let edge = if from > 0.0 { band } else { -band };
    let part = if until == from { 1.0 } else { (edge - from) / (until - from) };
    Measured { value: times[before] + part.clamp(0.0, 1.0) * length - times[0], grid: length }
}

#[cfg(test)]
#[path = "../../../tests/unit/study/measure/measures.rs"]
mod tests;
