//! Samples to values and derivatives in the middle of windows that do not overlap.

use kardan_rt::functions::powi;

use crate::num::Cholesky;

/// Reading of one channel in one window: the channel and its derivatives in the middle, filtered by one kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// `∫k y`
    pub value: f64,
    /// `∫k ẏ`, 1/s
    pub first: f64,
    /// `∫k ÿ`, 1/s²
    pub second: f64,
    /// Standard deviation of a sample about the smooth curve.
    pub noise: f64,
    /// Samples.
    pub samples: usize,
}

impl Reading {
    /// A missing reading.
    pub const MISSING: Self = Self { value: f64::NAN, first: f64::NAN, second: f64::NAN, noise: f64::NAN, samples: 0 };
    /// Variance of the value over that of a sample, times the samples: `∫k² / (∫k)² · 2`.
    pub const VALUE_GAIN: f64 = 1.6317;
    /// The same of the first derivative, times the square of the window: `2 · 4 ∫k'² / (∫k)²`.
    pub const FIRST_GAIN: f64 = 25.454;
    /// The same of the second derivative, times its fourth power: `2 · 16 ∫k''² / (∫k)²`.
    pub const SECOND_GAIN: f64 = 1120.0;
}

/// Fewest samples of a channel in a window.
const FEWEST: usize = 6;
/// A gap of this fraction of the window makes it unusable.
const HOLE: f64 = 0.25;
/// Sum over the orthonormal polynomials up to the third of `⟨u p, p⟩`, u = 1 − x²: degrees of freedom used by the fit for the noise.
const WINDOW_PARAMETERS: f64 = 80.0 / 33.0;
/// Sums of a channel: weights u³ with 1, x, x²; u² with 1 … x⁴; u with 1 … x⁶; then the same times y (2, 3, 4); u y².
const SUMS: usize = 3 + 5 + 7;
const MOMENTS: usize = 2 + 3 + 4 + 1;

/// Windows of one raster: channels that are sampled together.
///
/// A window of the width T has the kernel `k(x) = (1 − x²)³`, x from −1 to 1 over it. Values are the constant term of a line fitted
/// with the weight k, first derivatives the slope of a parabola fitted with `(1 − x²)²`, second ones that of a cubic with `1 − x²`:
/// with many samples exactly `∫k y`, `−∫k'y`, `∫k''y` over ∫k (the weights are those of the Gegenbauer polynomials that k', k'' are),
/// so that all channels and derivatives pass the same filter and a linear equation between them remains valid \[Mboup, Join,
/// Fliess 2009\]; and exact on polynomials also where samples are few or not evenly spaced.
///
/// Needs memory for one window only; no channel need be resampled.
#[derive(Debug, Clone)]
pub struct Windows {
    width: f64,
    origin: f64,
    index: i64,
    channels: Vec<Channel>,
    readings: Vec<Reading>,
    last: f64,
    started: bool,
    x: Vec<f64>,
    weights: [Vec<f64>; 3],
    /// Of the systems for a line, a parabola and a cubic.
    factors: [Cholesky; 3],
}

#[derive(Debug, Clone)]
struct Channel {
    reference: f64,
    sums: [f64; SUMS],
    moments: [f64; MOMENTS],
    samples: usize,
    last: f64,
    hole: f64,
}

impl Channel {
    const EMPTY: Self =
        Self { reference: 0.0, sums: [0.0; SUMS], moments: [0.0; MOMENTS], samples: 0, last: -1.0, hole: 0.0 };
}

impl Windows {
    /// Windows of a width (s) for this number of channels; window number k begins at `origin + k width`.
    ///
    /// # Panics
    /// If the width is not positive.
    pub fn new(width: f64, origin: f64, channels: usize) -> Self {
        assert!(width > 0.0, "a window has a width");
        Self {
            width,
            origin,
            index: 0,
            channels: vec![Channel::EMPTY; channels],
            readings: vec![Reading::MISSING; channels],
            last: f64::NEG_INFINITY,
            started: false,
            x: Vec::new(),
            weights: [const { Vec::new() }; 3],
            factors: [2, 3, 4].map(Cholesky::new),
        }
    }

    /// Adds samples: times in s that increase, a column for each channel, NaN where a channel has no sample. Calls `done` with the
    /// number and the readings of each window that is complete. Allocates nothing after the largest block.
    ///
    /// # Panics
    /// If a column has another length.
    pub fn add(&mut self, times: &[f64], columns: &[&[f64]], done: &mut dyn FnMut(i64, &[Reading])) {
        assert!(columns.len() == self.channels.len() && columns.iter().all(|c| c.len() == times.len()), "lengths");
        let mut from = 0;
        while from < times.len() {
            let index = ((times[from] - self.origin) / self.width).floor();
            let number = index as i64;
            if self.started && number != self.index {
                self.finish(done);
            }
            self.started = true;
            self.index = number;
            let begin = self.origin + index * self.width;
            let end = begin + self.width;
            let count = times[from..].iter().take_while(|&&t| t < end).count().max(1);
            self.run(&times[from..from + count], begin, columns, from);
            self.last = times[from + count - 1];
            from += count;
        }
    }

    /// The window that is open, at the end of the samples.
    pub fn finish(&mut self, done: &mut dyn FnMut(i64, &[Reading])) {
        if !self.started {
            return;
        }
        for (channel, reading) in self.channels.iter_mut().zip(&mut self.readings) {
            *reading = channel.reading(self.width, &mut self.factors);
            *channel = Channel::EMPTY;
        }
        self.started = false;
        done(self.index, &self.readings);
    }

    /// Samples of one window.
    fn run(&mut self, times: &[f64], begin: f64, columns: &[&[f64]], from: usize) {
        let (n, scale) = (times.len(), 2.0 / self.width);
        self.x.clear();
        self.x.extend(times.iter().map(|t| ((t - begin) * scale - 1.0).clamp(-1.0, 1.0)));
        for (power, weight) in self.weights.iter_mut().enumerate() {
            weight.clear();
            weight.extend(self.x.iter().map(|x| {
                let u = 1.0 - x * x;
                [u * u * u, u * u, u][power]
            }));
        }
        let mut shared = [0.0; SUMS];
        sums(&self.x, &self.weights, &mut shared);
        let mut hole: f64 = 0.0;
        self.x.windows(2).for_each(|pair| hole = hole.max(pair[1] - pair[0]));
        for (channel, column) in self.channels.iter_mut().zip(columns) {
            let y = &column[from..from + n];
            if y.iter().sum::<f64>().is_finite() {
                if channel.samples == 0 {
                    channel.reference = y[0];
                }
                channel.sums.iter_mut().zip(&shared).for_each(|(sum, more)| *sum += more);
                moments(&self.x, &self.weights, y, channel.reference, &mut channel.moments);
                channel.hole = channel.hole.max(hole).max(self.x[0] - channel.last);
                channel.samples += n;
                channel.last = self.x[n - 1];
                continue;
            }
            for k in (0..n).filter(|&k| y[k].is_finite()) {
                if channel.samples == 0 {
                    channel.reference = y[k];
                }
                let weights = [0, 1, 2].map(|power| [self.weights[power][k]]);
                add_sums(self.x[k], weights.map(|w| w[0]), &mut channel.sums);
                add_moments(self.x[k], weights.map(|w| w[0]), y[k] - channel.reference, &mut channel.moments);
                channel.hole = channel.hole.max(self.x[k] - channel.last);
                channel.samples += 1;
                channel.last = self.x[k];
            }
        }
    }
}

fn add_sums(x: f64, [c, b, a]: [f64; 3], sums: &mut [f64; SUMS]) {
    let x2 = x * x;
    let (x3, x4) = (x2 * x, x2 * x2);
    let all =
        [c, c * x, c * x2, b, b * x, b * x2, b * x3, b * x4, a, a * x, a * x2, a * x3, a * x4, a * x4 * x, a * x3 * x3];
    sums.iter_mut().zip(all).for_each(|(sum, more)| *sum += more);
}

fn add_moments(x: f64, [c, b, a]: [f64; 3], y: f64, moments: &mut [f64; MOMENTS]) {
    let (cy, by, ay) = (c * y, b * y, a * y);
    let x2 = x * x;
    let all = [cy, cy * x, by, by * x, by * x2, ay, ay * x, ay * x2, ay * x2 * x, ay * y];
    moments.iter_mut().zip(all).for_each(|(sum, more)| *sum += more);
}

/// Lanes in which sums run side by side.
const LANES: usize = 4;

fn sums(x: &[f64], weights: &[Vec<f64>; 3], out: &mut [f64; SUMS]) {
    for k in 0..x.len() {
        add_sums(x[k], [weights[0][k], weights[1][k], weights[2][k]], out);
    }
}

/// [`add_moments`] of a whole run, in lanes.
fn moments(x: &[f64], weights: &[Vec<f64>; 3], y: &[f64], reference: f64, out: &mut [f64; MOMENTS]) {
    let mut lanes = [[0.0; LANES]; MOMENTS];
    let whole = x.len() / LANES * LANES;
    let [c, b, a] = [&weights[0][..x.len()], &weights[1][..x.len()], &weights[2][..x.len()]];
    for k in (0..whole).step_by(LANES) {
        let (x, y): (&[f64; LANES], &[f64; LANES]) =
            (x[k..k + LANES].try_into().expect("lanes"), y[k..k + LANES].try_into().expect("lanes"));
        let [c, b, a]: [&[f64; LANES]; 3] = [c, b, a].map(|w| w[k..k + LANES].try_into().expect("lanes"));
        for l in 0..LANES {
            let y = y[l] - reference;
            let (cy, by, ay) = (c[l] * y, b[l] * y, a[l] * y);
            let (bx, ax) = (by * x[l], ay * x[l]);
            let ax2 = ax * x[l];
            lanes[0][l] += cy;
            lanes[1][l] += cy * x[l];
            lanes[2][l] += by;
            lanes[3][l] += bx;
            lanes[4][l] += bx * x[l];
            lanes[5][l] += ay;
            lanes[6][l] += ax;
            lanes[7][l] += ax2;
            lanes[8][l] += ax2 * x[l];
            lanes[9][l] += ay * y;
        }
    }
    for (sum, lanes) in out.iter_mut().zip(&lanes) {
        *sum += lanes.iter().sum::<f64>();
    }
    for k in whole..x.len() {
        add_moments(x[k], [c[k], b[k], a[k]], y[k] - reference, out);
    }
}

impl Channel {
    fn reading(&self, width: f64, factors: &mut [Cholesky; 3]) -> Reading {
        let hole = self.hole.max(1.0 - self.last);
        if self.samples < FEWEST || hole > 2.0 * HOLE {
            return Reading::MISSING;
        }
        let (s, m) = (&self.sums, &self.moments);
        let a = &s[8..15];
        let (mut line, mut parabola, mut cubic) = ([m[0], m[1]], [m[2], m[3], m[4]], [m[5], m[6], m[7], m[8]]);
        let gram = |sums: &[f64], size: usize, out: &mut [f64; 16]| {
            (0..size * size).for_each(|k| out[k] = sums[k / size + k % size]);
        };
        let mut matrix = [0.0; 16];
        let systems: [(&[f64], &mut [f64]); 3] = [(&s[0..3], &mut line), (&s[3..8], &mut parabola), (a, &mut cubic)];
        for ((sums, right), factor) in systems.into_iter().zip(factors) {
            gram(sums, right.len(), &mut matrix);
            if !factor.factor(&matrix) {
                return Reading::MISSING;
            }
            factor.solve(right);
        }
        let residual = m[9] - (0..4).map(|i| cubic[i] * m[5 + i]).sum::<f64>();
        // Below the resolution of sums of squares.
        let residual = if residual > 1e-13 * m[9] { residual } else { 0.0 };
        Reading {
            value: self.reference + line[0],
            first: parabola[1] * 2.0 / width,
            second: 2.0 * cubic[2] * powi(2.0 / width, 2),
            noise: (residual / (a[0] - WINDOW_PARAMETERS).max(0.1 * a[0])).sqrt(),
            samples: self.samples,
        }
    }
}

#[cfg(test)]
mod tests {
    use kardan_rt::functions::{sin, sin_cos};

    use super::*;

    fn readings(width: f64, times: &[f64], of: impl Fn(f64) -> f64) -> Vec<Reading> {
        let values: Vec<f64> = times.iter().map(|&t| of(t)).collect();
        let mut windows = Windows::new(width, 0.0, 1);
        let mut out = Vec::new();
        windows.add(times, &[&values], &mut |_, readings| out.push(readings[0]));
        windows.finish(&mut |_, readings| out.push(readings[0]));
        out
    }

    /// A polynomial at times that are not evenly spaced: exact.
    #[test]
    fn polynomials_are_exact() {
        let times: Vec<f64> = (0..100).map(|k| 0.001 * (f64::from(k) + 0.3 * sin(f64::from(k)) + 0.5)).collect();
        for found in readings(0.05, &times, |t| 3.0 + 2.0 * t) {
            assert!((found.first - 2.0).abs() < 1e-9 && found.second.abs() < 1e-6);
        }
        let quadratic = readings(0.05, &times, |t| 1.0 - t + 4.0 * t * t);
        assert_eq!(quadratic.len(), 2);
        for (k, found) in quadratic.iter().enumerate() {
            let t = 0.05 * (k as f64 + 0.5);
            assert!((found.first - (-1.0 + 8.0 * t)).abs() < 1e-9, "{found:?}");
            assert!((found.second - 8.0).abs() < 1e-6 && found.noise < 1e-9, "{found:?}");
        }
    }

    /// One kernel: of a sine, value, first and second derivative are damped by the same factor.
    #[test]
    fn all_derivatives_pass_one_filter() {
        let (width, frequency) = (0.1, 40.0);
        let times: Vec<f64> = (0..1000).map(|k| 1e-4 * (f64::from(k) + 0.5)).collect();
        let found = readings(width, &times, |t| sin(frequency * t))[0];
        let (sine, cosine) = sin_cos(frequency * width / 2.0);
        // Damping: the transform of (1 − x²)³ over its integral, from its series in (frequency T/2)².
        let z = powi(frequency * width / 2.0_f64, 2);
        let mut damping = 0.0;
        let mut term = 1.0;
        for k in 0..20 {
            damping += term;
            term *= -z / ((2.0 * f64::from(k) + 2.0) * (2.0 * f64::from(k) + 9.0));
        }
        assert!((found.value - damping * sine).abs() < 1e-5, "{found:?}");
        assert!((found.first - damping * frequency * cosine).abs() < 1e-5 * frequency, "{found:?}");
        assert!((found.second + damping * frequency * frequency * sine).abs() < 1e-4 * powi(frequency, 2), "{found:?}");
    }

    /// The stated gains: variances over many windows of white noise, and the noise told by each.
    #[test]
    fn noise_is_reported_and_passed_on_as_stated() {
        let mut random = crate::num::Random::new(7);
        let (n, count, width) = (50, 4000, 0.05);
        let times: Vec<f64> = (0..n * count).map(|k| 0.001 * (f64::from(k) + 0.5)).collect();
        let noise: Vec<f64> = times.iter().map(|_| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0).collect();
        let mut windows = Windows::new(width, 0.0, 1);
        let mut found = Vec::new();
        windows.add(&times, &[&noise], &mut |_, readings| found.push(readings[0]));
        let mean = |of: &dyn Fn(&Reading) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
        let n = f64::from(n);
        // Standard error of a variance from 4000 draws: 2.2 %.
        assert!((mean(&|r| powi(r.value, 2)) * n / Reading::VALUE_GAIN - 1.0).abs() < 0.08);
        assert!((mean(&|r| powi(r.first, 2)) * n * powi(width, 2) / Reading::FIRST_GAIN - 1.0).abs() < 0.08);
        assert!((mean(&|r| powi(r.second, 2)) * n * powi(width, 4) / Reading::SECOND_GAIN - 1.0).abs() < 0.08);
        assert!((mean(&|r| powi(r.noise, 2)) - 1.0).abs() < 0.02, "{}", mean(&|r| powi(r.noise, 2)));
    }

    #[test]
    fn a_slow_channel_beside_a_fast_one_and_holes() {
        let times: Vec<f64> = (0..200).map(|k| 0.001 * f64::from(k)).collect();
        let fast: Vec<f64> = times.iter().map(|t| 5.0 * t).collect();
        let slow: Vec<f64> = (0..200).map(|k| if k % 10 == 0 { 5.0 * times[k] } else { f64::NAN }).collect();
        let broken: Vec<f64> = (0..200).map(|k| if (30..60).contains(&k) { f64::NAN } else { 1.0 }).collect();
        let mut windows = Windows::new(0.1, 0.0, 3);
        let mut found = Vec::new();
        // In blocks that do not end with windows.
        for from in (0..200).step_by(37) {
            let to = (from + 37).min(200);
            let columns = [&fast[from..to], &slow[from..to], &broken[from..to]];
            windows.add(&times[from..to], &columns, &mut |k, r| found.push((k, r.to_vec())));
        }
        windows.finish(&mut |k, r| found.push((k, r.to_vec())));
        assert_eq!(found.len(), 2);
        for (k, readings) in &found {
            let middle = 0.1 * (*k as f64 + 0.5);
            for reading in &readings[..2] {
                assert!((reading.value - 5.0 * middle).abs() < 1e-9 && (reading.first - 5.0).abs() < 1e-9);
            }
        }
        assert_eq!((found[0].1[1].samples, found[0].1[2].samples), (10, 0));
        assert_eq!(found[1].1[2].samples, 100);
    }
}
