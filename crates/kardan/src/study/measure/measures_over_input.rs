//! Measures of one signal over another one: slopes, branches, waves.

use std::f64::consts::PI;

use kardan_rt::functions::{atan2, cos, sin};

use crate::study::measure::measures::{Measured, Window};
use kardan_model::tables::Measure;

/// The measure of a signal over another one; `Err` says why there is none.
pub(in crate::study) fn measured_over(
    measure: Measure,
    window: Window<'_>,
    over: &[f64],
    frequency: Option<f64>,
) -> Result<Measured, &'static str> {
    let Window { times, values } = window;
    if values.iter().chain(over).any(|value| !value.is_finite()) {
        return Err("an expression is no number in some rows of its window");
    }
    let of = |window: Window<'_>, over: &[f64]| match measure {
        Measure::Gradient => gradient(window.values, over),
        Measure::Slope => slope(window, over),
        Measure::Hysteresis => hysteresis(window.values, over),
        _ => waves(measure, window, over, frequency.unwrap_or(f64::NAN)),
    };
    let value = of(window, over)?;
    // The measure with every other row; with too few rows the error is unknown.
    let last = times.len().saturating_sub(1);
    let half = |all: &[f64]| -> Vec<f64> {
        all.iter().enumerate().filter(|(k, _)| k % 2 == 0 || *k == last).map(|(_, x)| *x).collect()
    };
    let (times, rows, over_half) = (half(times), half(values), half(over));
    let grid = of(Window { times: &times, values: &rows }, &over_half).map_or(0.0, |coarse| (value - coarse).abs());
    Ok(Measured { value, grid })
}

/// A zero crossing of a signal: the rows before and after it, and its position between them.
struct Crossing {
    before: usize,
    behind: usize,
    part: f64,
}

/// The zero crossings, rising or falling.
fn zero_crossings(over: &[f64], rising: bool) -> Vec<Crossing> {
    let mut out = Vec::new();
    let mut last: Option<usize> = None;
    for (k, y) in over.iter().enumerate().filter(|(_, y)| **y != 0.0) {
        if let Some(before) = last.replace(k)
            && over[before] * y < 0.0
            && (*y > 0.0) == rising
        {
            out.push(Crossing { before, behind: k, part: over[before] / (over[before] - y) });
        }
    }
    out
}

fn mean_of(found: &[f64]) -> f64 {
    found.iter().sum::<f64>() / found.len() as f64
}

/// The slope where the other signal has a rising zero crossing.
fn gradient(values: &[f64], over: &[f64]) -> Result<f64, &'static str> {
    let slope = |p: &Crossing| (values[p.behind] - values[p.before]) / (over[p.behind] - over[p.before]);
    let found: Vec<f64> = zero_crossings(over, true).iter().map(slope).collect();
    if found.is_empty() {
        return Err("the signal `over` never passes zero rising in its window");
    }
    Ok(mean_of(&found))
}

/// The slope of the straight line with the least squares of the distances, over time.
fn slope(window: Window<'_>, over: &[f64]) -> Result<f64, &'static str> {
    let weights = weights(window.times);
    let total: f64 = weights.iter().sum();
    let mean = |all: &[f64]| all.iter().zip(&weights).map(|(x, w)| x * w).sum::<f64>() / total;
    let (x, y) = (mean(window.values), mean(over));
    let moment = |other: &[f64], centre: f64| -> f64 {
        let rows = over.iter().zip(other).zip(&weights);
        rows.map(|((over, other), w)| w * (over - y) * (other - centre)).sum()
    };
    let (both, own) = (moment(window.values, x), moment(over, y));
    if own > 0.0 { Ok(both / own) } else { Err("the signal `over` stays the same in its window") }
}

/// The distance of the branches at the zero crossing of the other signal.
fn hysteresis(values: &[f64], over: &[f64]) -> Result<f64, &'static str> {
    let branch = |rising: bool| -> Vec<f64> {
        let at = |p: &Crossing| values[p.before] + p.part * (values[p.behind] - values[p.before]);
        zero_crossings(over, rising).iter().map(at).collect()
    };
    let (rising, falling) = (branch(true), branch(false));
    if rising.is_empty() || falling.is_empty() {
        return Err("the signal `over` does not pass zero both ways in its window");
    }
    Ok((mean_of(&falling) - mean_of(&rising)).abs())
}

/// The weight of each row in an integral over straight lines between them.
fn weights(times: &[f64]) -> Vec<f64> {
    let gap = |k: usize| if k + 1 < times.len() { times[k + 1] - times[k] } else { 0.0 };
    (0..times.len()).map(|k| 0.5 * (gap(k) + k.checked_sub(1).map_or(0.0, gap))).collect()
}

/// The wave of a frequency in a signal, plus its mean, by least squares: the coefficients of cosine and sine.
fn wave(times: &[f64], values: &[f64], frequency: f64) -> Option<[f64; 2]> {
    let (weights, turn) = (weights(times), 2.0 * PI * frequency);
    let mut rows = [[0.0; 4]; 3];
    for ((time, value), weight) in times.iter().zip(values).zip(weights) {
        let angle = turn * (time - times[0]);
        let basis = [1.0, cos(angle), sin(angle), *value];
        for (row, a) in rows.iter_mut().zip(basis) {
            row.iter_mut().zip(basis).for_each(|(entry, b)| *entry += weight * a * b);
        }
    }
    // The three columns are nearly orthogonal over whole periods: no pivot is needed.
    for pivot in 0..3 {
        let own = rows[pivot];
        if own[pivot] <= 0.0 {
            return None;
        }
        for (_, row) in rows.iter_mut().enumerate().filter(|(k, _)| *k != pivot) {
            let factor = row[pivot] / own[pivot];
            row.iter_mut().zip(own).for_each(|(entry, own)| *entry -= factor * own);
        }
    }
    Some([rows[1][3] / rows[1][1], rows[2][3] / rows[2][2]])
}

/// Ratio and delay of the waves of a frequency.
fn waves(measure: Measure, window: Window<'_>, over: &[f64], frequency: f64) -> Result<f64, &'static str> {
    let (Some(first), Some(last)) = (window.times.first(), window.times.last()) else {
        return Err("no row lies in its window");
    };
    // A window that is shorter than a period only by rounding counts as a period.
    let periods = ((last - first) * frequency + 1e-9).floor();
    if periods < 1.0 {
        return Err("its window is shorter than a period of `frequency`");
    }
    let begin = last - periods / frequency;
    let from = window.times.iter().position(|time| *time >= begin - 1e-9 * (last - first)).unwrap_or(0);
    let times = &window.times[from..];
    if (times.len() as f64) < 8.0 * periods {
        return Err("fewer than eight rows lie in a period of `frequency`: a smaller `output_step` resolves it");
    }
    let of = |values: &[f64]| wave(times, &values[from..], frequency).ok_or("its rows determine no wave");
    let ([a, b], [c, d]) = (of(window.values)?, of(over)?);
    let (size, other) = (a * a + b * b, c * c + d * d);
    if other <= 0.0 {
        return Err("the signal `over` has no wave of `frequency`");
    }
    // The wave of x is Re((a - ib) e^(iwt)): its angle minus that of y.
    let later = -atan2(a * d - b * c, a * c + b * d);
    Ok(match measure {
        Measure::Gain => (size / other).sqrt(),
        Measure::PhaseLag => later,
        _ => later / (2.0 * PI * frequency),
    })
}

#[cfg(test)]
#[path = "../../../tests/unit/study/measure/measures_over_input.rs"]
mod tests;
