//! Amplitudes of a signal over the frequency.

use kardan_rt::functions::cos;
use std::f64::consts::PI;

use crate::study::measure::selected_variants::selects;
use kardan_math::num::fourier;
use kardan_results::{Plot, Run, Spectrum};

/// The least number of rows of a spectrum.
pub(in crate::study) const LEAST_ROWS: usize = 16;

/// The spectra of a spectrum plot, for the runs that it draws.
pub(in crate::study) fn spectra(plot: &Plot, runs: &[Run]) -> Vec<Spectrum> {
    let mut out = Vec::new();
    let drawn = |run: &&Run| selects(&plot.variants, &run.name);
    for run in runs.iter().filter(drawn) {
        let names = plot.signals.iter().chain(plot.references.iter().map(|reference| &reference.signal));
        for (name, signal) in names.filter_map(|name| Some((name, run.series.signal(name)?))) {
            let window = plot.window.map_or([f64::NEG_INFINITY, f64::INFINITY], |span| [span.start, span.end]);
            let rows = run.series.time.iter().zip(&signal.values);
            let rows = rows.filter(|(time, _)| (window[0]..=window[1]).contains(*time));
            let (times, values): (Vec<f64>, Vec<f64>) = rows.map(|(time, value)| (*time, *value)).unzip();
            let (frequency, amplitude, missing) = match amplitudes(&times, &values) {
                Ok((frequency, amplitude)) => (frequency, amplitude, None),
                Err(why) => (Vec::new(), Vec::new(), Some(why.to_string())),
            };
            let (plot, run, signal) = (plot.id.clone(), run.name.clone(), name.clone());
            out.push(Spectrum { plot, run, signal, frequency, amplitude, missing });
        }
    }
    out
}

/// Frequencies (Hz) and amplitudes of a signal around its mean: `2/Σw · |Σ w_j (x_j − x̄) exp(−2πi jk/n)|` at the frequencies
/// `k/T` for k from 1 to n/2, with the window of Hann `w_j = (1 − cos(2π j/n))/2` over the time T of n rows. So a sine with a whole number of
/// periods in T shows its amplitude there, and half of it at both neighbours. Values on the even grid are interpolated linearly;
/// rows between are not used.
fn amplitudes(times: &[f64], values: &[f64]) -> Result<(Vec<f64>, Vec<f64>), &'static str> {
    let rows = times.len();
    if rows <= LEAST_ROWS {
        return Err("it takes more than 16 rows");
    }
    if values.iter().any(|value| !value.is_finite()) {
        return Err("some of its values are no numbers");
    }
    let mut distances: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    distances.sort_by(f64::total_cmp);
    let length = times[rows - 1] - times[0];
    // The last row begins the next period.
    let count = (length / distances[distances.len() / 2]).round() as usize;
    let count = count.clamp(LEAST_ROWS, rows - 1);
    let step = length / count as f64;
    let mut next = 1;
    let at = |k: usize| {
        let time = times[0] + k as f64 * step;
        while next + 1 < rows && times[next] < time {
            next += 1;
        }
        let part = ((time - times[next - 1]) / (times[next] - times[next - 1])).clamp(0.0, 1.0);
        values[next - 1] + part * (values[next] - values[next - 1])
    };
    let even: Vec<f64> = (0..count).map(at).collect();
    let mean = even.iter().sum::<f64>() / count as f64;
    let weight = |k: usize| 0.5 - 0.5 * cos(2.0 * PI * k as f64 / count as f64);
    let weighted: Vec<f64> = even.iter().enumerate().map(|(k, value)| weight(k) * (value - mean)).collect();
    let found = fourier(&weighted);
    let bins = 1..=count / 2;
    let amplitude = bins.clone().map(|k| {
        // The highest frequency of an even number of rows has no opposite.
        let both = if 2 * k == count { 2.0 } else { 4.0 };
        both / count as f64 * kardan_rt::functions::hypot(found[k][0], found[k][1])
    });
    Ok((bins.clone().map(|k| k as f64 / length).collect(), amplitude.collect()))
}

#[cfg(test)]
#[path = "../../../tests/unit/study/measure/spectrum.rs"]
mod tests;
