//! Samples to values and derivatives in the middle of windows that do not overlap.

use kardan_rt::functions::powi;

use kardan_math::num::Cholesky;

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
        let weights_of = |k: usize| [self.weights[0][k], self.weights[1][k], self.weights[2][k]];
        let mut shared = [0.0; SUMS];
        (0..n).for_each(|k| add_sums(self.x[k], weights_of(k), &mut shared));
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
                add_sums(self.x[k], weights_of(k), &mut channel.sums);
                add_moments(self.x[k], weights_of(k), y[k] - channel.reference, &mut channel.moments);
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
        let mut matrix = [0.0; 16];
        let systems: [(&[f64], &mut [f64]); 3] = [(&s[0..3], &mut line), (&s[3..8], &mut parabola), (a, &mut cubic)];
        for ((sums, right), factor) in systems.into_iter().zip(factors) {
            let size = right.len();
            (0..size * size).for_each(|k| matrix[k] = sums[k / size + k % size]);
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
#[path = "../tests/unit/window.rs"]
mod tests;
