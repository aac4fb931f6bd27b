//! Frequency responses of a loop.

use std::sync::Arc;

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, c64};
use kardan_rt::functions::{atan, hypot, powf, tan};

use super::channel_quotient::{LEVEL, OneChannel};
use crate::matrix_parts::{exactly, is_finite};
use kardan_math::num::{
    Matrix, Polynomial, Rational, Rounding, at_zero, balance, characteristic_polynomial, common_denominator,
    eigenvalues, golden, hessenberg, resolvent,
};

/// States up to which poles and single channels are computed from polynomials with exact coefficients.
const MOST: usize = 32;
/// States above which responses are computed in Hessenberg form: below, elimination keeps the digits of slow motions beside fast ones.
const LARGE: usize = 48;
/// Squarings after which a power shows the largest singular value.
const SQUARINGS: usize = 20;
/// Roundings that an eigenvalue may suffer in each row, and the part of its distance from the axis by which they may move it.
const ROUNDINGS: f64 = 10.0;
const CERTAIN: f64 = 1e-4;
/// Relative distance of a pole from the axis above which it is not on the axis.
const NEXT_TO_AXIS: f64 = 1e-6;
/// Evaluated frequencies per decade, and next to a pole, in distances from the axis.
const PER_DECADE: f64 = 25.0;
const BESIDE: [f64; 7] = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Decades that are evaluated below the slowest and above the fastest pole.
const BEYOND: f64 = 100.0;
/// Widest range of places.
const WIDEST: f64 = 1e300;
/// Steps of a search between two places.
const STEPS: usize = 60;

/// The largest singular value of a response over all frequencies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LargestGain {
    /// A value that is reached. For one channel none is larger, but for the rounding of the realisation; for several it is the largest that was found next to
    /// every pole and in between.
    pub value: f64,
    /// Where, rad/s; infinite where it is approached only.
    pub frequency: f64,
}

/// Why there is no response at a frequency.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FrequencyError {
    /// It is negative, infinite or no number.
    #[error("{0} rad/s is not a frequency: give a finite number of at least 0 rad/s")]
    Negative(f64),
    /// The samples do not show it.
    #[error(
        "{0} rad/s is above the Nyquist frequency of {1} rad/s (half the sample rate): the samples show it as a lower frequency"
    )]
    BeyondNyquist(f64, f64),
    /// A sine of this frequency grows without bounds.
    #[error(
        "at {0} rad/s the system has a pole on the axis, so its response is infinite: choose a frequency next to it"
    )]
    Pole(f64),
}

/// The frequency response of a linear system, `M(s) = C (sI − A)⁻¹ B + D`. For a loop it is that to errors of its channels: square and stable.
///
/// Places on the imaginary axis are those of `s = (z − 1)/(z + 1)` of a map `z⁺ = Φ z + Γ w`, which turns the unit circle into that axis:
/// `s = j tan(ωT/2)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// In balanced coordinates, with many states in Hessenberg form; of a map Φ, Γ, C, D.
    a: Matrix<f64>,
    b: Matrix<f64>,
    c: Matrix<f64>,
    d: Matrix<f64>,
    /// T, s; `None` in continuous time.
    sample_time: Option<f64>,
    /// In the plane of places.
    poles: Vec<(f64, f64)>,
    /// A, B, C, D before rounding, in other coordinates, where they are known.
    exact: Option<Arc<[Matrix<Rational>; 4]>>,
}

impl Response {
    /// Of `ż = A z + B w`, `u = C z + D w`, or of the map `z⁺ = A z + B w` over a sample time in s; `None` if a number is not finite.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn state_space([a, b, c, d]: [&Matrix<f64>; 4], sample_time: Option<f64>) -> Option<Self> {
        let n = a.rows();
        assert!(a.columns() == n && b.rows() == n && c.columns() == n, "states of a loop");
        assert!(d.rows() == c.rows() && d.columns() == b.columns(), "channels of a loop");
        if ![a, b, c, d].into_iter().all(is_finite) {
            return None;
        }
        let scales = balance(&Mat::from_fn(n, n, |i, j| a[(i, j)]));
        let a = Matrix::from_fn(n, n, |i, j| a[(i, j)] * scales[j] / scales[i]);
        let b = Matrix::from_fn(n, b.columns(), |i, j| b[(i, j)] / scales[i]);
        let c = Matrix::from_fn(c.rows(), n, |i, j| c[(i, j)] * scales[j]);
        let poles = poles(&a, sample_time.is_some())?;
        let [a, b, c] = if n > LARGE { hessenberg([&a, &b, &c]) } else { [a, b, c] };
        let out = Self { a, b, c, d: d.clone(), sample_time, poles, exact: None };
        let all = [&out.a, &out.b, &out.c, &out.d];
        all.iter().all(|m| is_finite(m)).then_some(out)
    }

    /// The loop of `ż = A z + B w`, `u = C z`; `None` if a number is not finite.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn continuous(a: &Matrix<f64>, b: &Matrix<f64>, c: &Matrix<f64>) -> Option<Self> {
        Self::state_space([a, b, c, &Matrix::zeros(c.rows(), b.columns())], None)
    }

    /// The loop of the map `z⁺ = Φ z + Γ w`, `u = C z` over the sample time T in s; `None` if a number is not finite.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn sampled(map: &Matrix<f64>, b: &Matrix<f64>, c: &Matrix<f64>, sample_time: f64) -> Option<Self> {
        Self::state_space([map, b, c, &Matrix::zeros(c.rows(), b.columns())], Some(sample_time))
    }

    /// The same, with A, B, C and D known before rounding: they give the results for one channel alone.
    #[must_use]
    pub(crate) fn before_rounding(self, exact: [Matrix<Rational>; 4]) -> Self {
        Self { exact: Some(Arc::new(exact)), ..self }
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.b.columns()
    }

    /// One channel alone, the others as designed.
    pub fn channel(&self, k: usize) -> Self {
        Self {
            b: Matrix::from_fn(self.b.rows(), 1, |i, _| self.b[(i, k)]),
            c: Matrix::from_fn(1, self.c.columns(), |_, j| self.c[(k, j)]),
            d: Matrix::from_fn(1, 1, |_, _| self.d[(k, k)]),
            exact: self.exact.as_deref().map(|[a, b, c, d]| {
                let b = Matrix::from_fn(b.rows(), 1, |i, _| b[(i, k)].clone());
                let c = Matrix::from_fn(1, c.columns(), |_, j| c[(k, j)].clone());
                Arc::new([a.clone(), b, c, Matrix::from_fn(1, 1, |_, _| d[(k, k)].clone())])
            }),
            ..self.clone()
        }
    }

    /// The angular frequency, rad/s, of a place on the imaginary axis.
    pub fn frequency(&self, place: f64) -> f64 {
        self.sample_time.map_or(place, |time| 2.0 * atan(place) / time)
    }

    /// The place on the imaginary axis of an angular frequency.
    pub fn place(&self, frequency: f64) -> f64 {
        self.sample_time.map_or(frequency, |time| tan(0.5 * frequency * time))
    }

    /// M at an angular frequency, rad/s.
    pub fn at_frequency(&self, frequency: f64) -> Mat<c64> {
        self.at(self.place(frequency))
    }

    /// M at an angular frequency that a caller gives.
    ///
    /// # Errors
    /// [`FrequencyError`]
    pub fn checked(&self, frequency: f64) -> Result<Mat<c64>, FrequencyError> {
        if !(frequency >= 0.0 && frequency.is_finite()) {
            return Err(FrequencyError::Negative(frequency));
        }
        if let Some(nyquist) = self.nyquist().filter(|nyquist| frequency > nyquist * (1.0 + LEVEL)) {
            return Err(FrequencyError::BeyondNyquist(frequency, nyquist));
        }
        let found = self.at_frequency(frequency);
        let finite = |i: usize, j: usize| found[(i, j)].re.is_finite() && found[(i, j)].im.is_finite();
        let all = (0..found.nrows()).all(|i| (0..found.ncols()).all(|j| finite(i, j)));
        if all { Ok(found) } else { Err(FrequencyError::Pole(frequency)) }
    }

    /// The Nyquist frequency π/T, rad/s; `None` in continuous time.
    pub fn nyquist(&self) -> Option<f64> {
        self.sample_time.map(|time| std::f64::consts::PI / time)
    }

    /// The poles as angular frequencies, rad/s: of each its distance from zero, of a pair once, ascending.
    pub fn pole_frequencies(&self) -> Vec<f64> {
        let mut out: Vec<f64> = self.poles.iter().map(|(re, im)| self.frequency(hypot(*re, *im))).collect();
        out.sort_by(f64::total_cmp);
        out.dedup_by(|a, b| (*a - *b).abs() <= LEVEL * a.abs());
        out
    }

    /// How many poles grow: those at zero do not, and those on the axis but for rounding. `None` if the iteration fails.
    pub fn unstable_poles(&self) -> Option<usize> {
        let rest = match self.sample_time {
            None => at_zero(&self.a, Rounding::OfLargest)?.rest,
            Some(_) => at_zero(&change(&self.a), Rounding::OfOne)?.rest,
        };
        let poles = poles_of_rates(&rest, self.is_sampled())?;
        Some(poles.iter().filter(|(re, im)| *re > NEXT_TO_AXIS * hypot(*re, *im)).count())
    }

    /// The other side of the same loop, `−(I + M)⁻¹ M`: of a loop gain L what errors see when it is closed, of that again L. `None`
    /// where one of them is not proper.
    pub fn feedback_transform(&self) -> Option<Self> {
        let m = self.channels();
        let inverse = Matrix::<f64>::identity(m).plus(&self.d).solve(&Matrix::identity(m))?;
        let b = self.b.multiply(&inverse);
        let c = inverse.multiply(&self.c).scale(&-1.0);
        let d = inverse.multiply(&self.d).scale(&-1.0);
        let a = self.a.plus(&self.b.multiply(&c));
        Self::state_space([&a, &b, &c, &d], self.sample_time)
    }

    /// The sensitivity `S = I + M` of a loop as errors see it.
    pub fn sensitivity(&self) -> Self {
        let m = self.channels();
        Self { d: self.d.plus(&Matrix::identity(m)), exact: None, ..self.clone() }
    }

    /// The complementary sensitivity `T = −M` of a loop as errors see it.
    pub fn complementary(&self) -> Self {
        Self { c: self.c.scale(&-1.0), d: self.d.scale(&-1.0), exact: None, ..self.clone() }
    }

    /// All singular values at an angular frequency, rad/s, the largest first; `None` at a pole on the axis.
    pub fn singular_values(&self, frequency: f64) -> Option<Vec<f64>> {
        self.checked(frequency).ok()?.singular_values().ok()
    }

    /// The largest singular value over all frequencies (the H∞ norm); `None` of a system that is not stable, or if an iteration
    /// fails.
    ///
    /// ```
    /// use kardan_math::num::Matrix;
    /// use kardan_synthesis::margins::Response;
    /// // 1/(s² + 0.2 s + 1): 1/(2 ζ √(1 − ζ²)) at √(1 − 2 ζ²).
    /// let a = Matrix::from_fn(2, 2, |i, j| [[0.0, 1.0], [-1.0, -0.2]][i][j]);
    /// let b = Matrix::from_fn(2, 1, |i, _| i as f64);
    /// let c = Matrix::from_fn(1, 2, |_, j| 1.0 - j as f64);
    /// let found = Response::continuous(&a, &b, &c).unwrap().largest_gain().unwrap();
    /// assert!((found.value - 1.0 / (0.2 * 0.99f64.sqrt())).abs() < 1e-9 && (found.frequency - 0.98f64.sqrt()).abs() < 1e-6);
    /// ```
    pub fn largest_gain(&self) -> Option<LargestGain> {
        if self.poles.iter().any(|(re, _)| *re >= 0.0) {
            return None;
        }
        let (value, place) = self.peak();
        Some(LargestGain { value, frequency: self.frequency(place) })
    }

    /// Whether the loop is sampled.
    pub(super) fn is_sampled(&self) -> bool {
        self.sample_time.is_some()
    }

    /// M at a place on the imaginary axis.
    pub(super) fn at(&self, place: f64) -> Mat<c64> {
        let real = |m: &Matrix<f64>| Mat::from_fn(m.rows(), m.columns(), |i, j| c64::new(m[(i, j)], 0.0));
        let n = self.a.rows();
        // In continuous time (s − A) x = B; of a map (z − 1 − (Φ − 1)) x = Γ with z − 1 = 2s/(1 − s).
        let (s, own) = match (self.sample_time, place.is_infinite()) {
            (None, true) => return real(&self.d),
            (None, false) => (c64::new(0.0, place), 0.0),
            (Some(_), true) => (c64::new(-2.0, 0.0), 1.0),
            (Some(_), false) => (c64::new(0.0, 2.0 * place) / c64::new(1.0, -place), 1.0),
        };
        if n == 0 {
            return real(&self.d);
        }
        let m = self.b.columns();
        let entry = |i: usize, j: usize| match j {
            j if j >= n => c64::new(self.b[(i, j - n)], 0.0),
            j if j == i => s - (self.a[(i, j)] - own),
            j => c64::new(-self.a[(i, j)], 0.0),
        };
        let mut rows: Vec<Vec<c64>> = (0..n).map(|i| (0..n + m).map(|j| entry(i, j)).collect()).collect();
        solve(&mut rows);
        Mat::from_fn(self.c.rows(), m, |i, j| {
            let sum: c64 = self.c.row(i).iter().zip(&rows).map(|(c, x)| x[n + j] * *c).sum();
            sum + self.d[(i, j)]
        })
    }

    /// Half the difference of sensitivity and complementary sensitivity, M + ½: errors as disks around one.
    pub(super) fn balanced(&self) -> Self {
        let m = self.channels();
        Self { d: self.d.plus(&Matrix::identity(m).scale(&0.5)), exact: None, ..self.clone() }
    }

    /// The largest singular value at a place.
    pub(super) fn size(&self, place: f64) -> f64 {
        largest_singular(&self.at(place))
    }

    /// Frequencies that miss only peaks narrower than every pole: evenly spaced, beyond the slowest and the fastest pole, and next to each pole
    /// as far from each other as it is from the axis. Zero comes first, infinity last.
    pub(super) fn places(&self) -> Vec<f64> {
        let moving = self.poles.iter().map(|(re, im)| hypot(*re, *im)).filter(|size| *size > 0.0 && size.is_finite());
        let (low, high) = moving.fold((1.0f64, 1.0f64), |(low, high), size| (low.min(size), high.max(size)));
        let high = (high * BEYOND).min(f64::MAX);
        let low = (low / BEYOND).max(high / WIDEST);
        let count = (kardan_rt::functions::log10(high / low) * PER_DECADE).ceil();
        let even = (0..=count as usize).map(|k| low * powf(high / low, k as f64 / count));
        let beside = self.poles.iter().flat_map(|(re, im)| {
            let nearby = BESIDE.iter().flat_map(move |k| [im.abs() - k * re.abs(), im.abs() + k * re.abs()]);
            nearby.chain([hypot(*re, *im)])
        });
        let mut out: Vec<f64> = even.chain(beside).filter(|place| *place > 0.0 && place.is_finite()).collect();
        out.extend([0.0, f64::INFINITY]);
        out.sort_by(f64::total_cmp);
        out.dedup();
        out
    }

    /// The only channel as a quotient of polynomials; `None` of too many states.
    pub(super) fn channel_quotient(&self) -> Option<OneChannel> {
        if self.channels() != 1 || self.a.rows() > MOST {
            return None;
        }
        let rounded = || [&self.a, &self.b, &self.c, &self.d].map(exactly);
        let [a, b, c, d] = self.exact.as_deref().cloned().unwrap_or_else(rounded);
        let found = resolvent(&a, &b, &c, &d);
        let [numerator, denominator] = [&found.numerators[0][0], &found.characteristic]
            .map(|of| if self.is_sampled() { on_the_axis(of, a.rows()) } else { of.clone() });
        Some(OneChannel::new(&numerator, &denominator))
    }

    /// The largest singular value over all frequencies, and its place; infinite at a pole on the axis.
    pub(super) fn peak(&self) -> (f64, f64) {
        if let Some(one) = self.channel_quotient() {
            return one.peak(&self.first_places(), &|place| self.size(place));
        }
        largest_between(&self.places(), &|place| self.size(place))
    }

    /// The frequencies of the poles as places.
    pub(super) fn first_places(&self) -> Vec<f64> {
        self.poles.iter().map(|(re, im)| if im.abs() > re.abs() { im.abs() } else { hypot(*re, *im) }).collect()
    }

    /// Whether the balanced disk of the only channel is no smaller than α. `false` decides nothing: it may be no smaller all the same.
    ///
    /// Where it is at least twice as large next to every pole and in between, the exact test is skipped.
    pub fn satisfies_disk(&self, alpha: f64) -> bool {
        if self.channels() != 1 {
            return false;
        }
        let balanced = self.balanced();
        if balanced.places().into_iter().all(|place| balanced.size(place) < 0.5 / alpha) {
            return true;
        }
        let Some(one) = self.channel_quotient().map(|one| one.balanced()) else { return false };
        let size = |place: f64| hypot(one.at(place).re, one.at(place).im);
        [0.0, 1.0, f64::INFINITY].iter().all(|place| size(*place) < 1.0 / alpha) && one.level(1.0 / alpha).is_empty()
    }

    /// Places between which a function of the only channel's M changes its sign, each found by halving; zero and infinity left out.
    pub(super) fn changes(&self, of: &dyn Fn(c64) -> f64) -> Vec<f64> {
        let value = |place: f64| of(self.at(place)[(0, 0)]);
        let all: Vec<(f64, f64)> = self
            .places()
            .into_iter()
            .filter(|place| *place > 0.0 && place.is_finite())
            .map(|place| (place, value(place)))
            .collect();
        let changing = all.windows(2).filter(|pair| (pair[0].1 > 0.0) != (pair[1].1 > 0.0));
        changing
            .map(|pair| {
                let (mut low, mut high) = (pair[0].0, pair[1].0);
                for _ in 0..STEPS {
                    let middle = (low * high).sqrt();
                    if (value(middle) > 0.0) == (pair[0].1 > 0.0) { low = middle } else { high = middle }
                }
                low
            })
            .collect()
    }
}

/// The largest value of a function, and its place: at some places, ascending from zero to infinity, and between the neighbours of the largest ones.
pub(super) fn largest_between(places: &[f64], size: &dyn Fn(f64) -> f64) -> (f64, f64) {
    let all: Vec<f64> = places.iter().map(|place| size(*place)).collect();
    let mut peaks: Vec<usize> = (0..all.len())
        .filter(|&k| (k == 0 || all[k] >= all[k - 1]) && (k + 1 == all.len() || all[k] >= all[k + 1]))
        .collect();
    peaks.sort_by(|a, b| all[*b].total_cmp(&all[*a]));
    let best = peaks.iter().take(PEAKS).map(|&k| {
        if !(1..all.len().saturating_sub(2)).contains(&k) || places[k - 1] == 0.0 || !all[k].is_finite() {
            return (all[k], places[k]);
        }
        // In the logarithm, in which peaks have the same shape.
        let at = |x: f64| places[k] * powf(places[k + 1] / places[k - 1], x);
        let ends = [places[k - 1], places[k + 1]].map(|place| {
            kardan_rt::functions::ln(place / places[k]) / kardan_rt::functions::ln(places[k + 1] / places[k - 1])
        });
        let place = at(golden(ends[0], ends[1], &|x| -size(at(x))));
        let found = size(place);
        if found > all[k] { (found, place) } else { (all[k], places[k]) }
    });
    best.fold((0.0, 0.0), |best, found| if found.0 > best.0 { found } else { best })
}

/// Peaks that are refined.
const PEAKS: usize = 3;

/// `[A B]` by rows to `[… A⁻¹ B]`, by elimination with row exchanges; a singular A gives NaN.
fn solve(rows: &mut [Vec<c64>]) {
    let n = rows.len();
    for k in 0..n {
        let largest = (k..n).max_by(|&i, &j| rows[i][k].norm_sqr().total_cmp(&rows[j][k].norm_sqr()));
        rows.swap(k, largest.unwrap_or(k));
        let (above, below) = rows.split_at_mut(k + 1);
        let pivot = &above[k];
        for row in below.iter_mut().filter(|row| row[k] != c64::new(0.0, 0.0)) {
            let factor = row[k] / pivot[k];
            row[k + 1..].iter_mut().zip(&pivot[k + 1..]).for_each(|(x, y)| *x -= factor * y);
        }
    }
    for k in (0..n).rev() {
        let (above, below) = rows.split_at_mut(k + 1);
        let row = &mut above[k];
        let (left, right) = row.split_at_mut(n);
        for (x, other) in left[k + 1..].iter().zip(below.iter()) {
            right.iter_mut().zip(&other[n..]).for_each(|(sum, entry)| *sum -= x * entry);
        }
        right.iter_mut().for_each(|x| *x /= left[k]);
    }
}

/// A polynomial in z with `z = (1 + s)/(1 − s)`, times `(1 − s)ⁿ`.
fn on_the_axis(polynomial: &Polynomial, n: usize) -> Polynomial {
    let one = Rational::ONE;
    let [up, down] = [Rational::ONE, Rational::NEG_ONE].map(|slope| Polynomial::new(vec![one.clone(), slope]));
    let mut powers = vec![Polynomial::constant(one.clone())];
    (0..n).for_each(|k| powers.push(powers[k].times(&down)));
    // In whole numbers, of which sums and products cost least.
    let scale = Rational::from(common_denominator(polynomial.coefficients()));
    let whole = polynomial.scale(&scale);
    // Horner's rule, from the highest coefficient.
    (0..=n)
        .rev()
        .fold(Polynomial::default(), |sum, k| sum.times(&up).plus(&powers[n - k].scale(&whole.coefficient(k))))
        .scale(&(Rational::ONE / scale))
}

/// Φ − 1
fn change(map: &Matrix<f64>) -> Matrix<f64> {
    Matrix::from_fn(map.rows(), map.rows(), |i, j| map[(i, j)] - f64::from(u8::from(i == j)))
}

/// Eigenvalues of a matrix, or of a map, as places in the plane of s; those at infinity left out.
fn poles(a: &Matrix<f64>, sampled: bool) -> Option<Vec<(f64, f64)>> {
    let n = a.rows();
    let rates = || if sampled { change(a) } else { a.clone() };
    if n > MOST {
        return poles_of_rates(&rates(), sampled);
    }
    if let Some(found) = certain_poles(&rates(), sampled) {
        return Some(found);
    }
    let all = characteristic_polynomial(&exactly(a));
    Some(if sampled { on_the_axis(&all, n).roots() } else { all.roots() })
}

/// The same of A, or of Φ − 1, in floating point, where rounding moves each by a small part of its distance from the axis only, to first order.
fn certain_poles(rates: &Matrix<f64>, sampled: bool) -> Option<Vec<(f64, f64)>> {
    let n = rates.rows();
    if n == 0 {
        return Some(Vec::new());
    }
    let eigen = Mat::from_fn(n, n, |i, j| rates[(i, j)]).eigen().ok()?;
    let (values, right) = (eigen.S().column_vector(), eigen.U());
    let left = right.partial_piv_lu().inverse();
    let size = rates.as_slice().iter().map(|x| x * x).sum::<f64>().sqrt() + if sampled { 1.0 } else { 0.0 };
    let one = |k: usize| {
        let length = |of: &dyn Fn(usize) -> c64| (0..n).map(|i| of(i).norm_sqr()).sum::<f64>().sqrt();
        let condition = length(&|i| right[(i, k)]) * length(&|i| left[(k, i)]);
        let error = ROUNDINGS * f64::EPSILON * n as f64 * size * condition;
        // s = μ/(2 + μ) moves by 2/(2 + μ)² of that.
        let two = c64::new(2.0, 0.0);
        let (place, moves) = match sampled {
            true => (values[k] / (two + values[k]), 2.0 / (two + values[k]).norm_sqr()),
            false => (values[k], 1.0),
        };
        (error * moves < CERTAIN * place.re.abs()).then_some((place.re, place.im))
    };
    (0..n).map(one).collect()
}

/// The same of A, or of Φ − 1, in floating point.
fn poles_of_rates(rates: &Matrix<f64>, sampled: bool) -> Option<Vec<(f64, f64)>> {
    let found = eigenvalues(rates)?.into_iter();
    let bilinear = |(re, im): (f64, f64)| {
        let s = c64::new(re, im) / c64::new(2.0 + re, im);
        (s.re, s.im)
    };
    let found = found.map(|rate| if sampled { bilinear(rate) } else { rate });
    Some(found.filter(|(re, im)| re.is_finite() && im.is_finite()).collect())
}

/// The largest singular value of a small matrix, to about a millionth where two are close, else to rounding.
///
/// Powers of `MᴴM` by squaring, and the Rayleigh quotient of the result: much faster than a decomposition at this size.
pub(super) fn largest_singular(matrix: &Mat<c64>) -> f64 {
    let (rows, m) = (matrix.nrows(), matrix.ncols());
    if m == 1 && rows == 1 {
        return hypot(matrix[(0, 0)].re, matrix[(0, 0)].im);
    }
    let square: Vec<c64> =
        (0..m * m).map(|k| (0..rows).map(|i| matrix[(i, k / m)].conj() * matrix[(i, k % m)]).sum()).collect();
    let mut power = square.clone();
    let mut next = power.clone();
    for _ in 0..SQUARINGS {
        let trace: f64 = (0..m).map(|k| power[k * m + k].re).sum();
        if trace == 0.0 {
            return 0.0;
        }
        if !trace.is_finite() {
            return f64::INFINITY;
        }
        power.iter_mut().for_each(|x| *x /= trace);
        for (k, next) in next.iter_mut().enumerate() {
            *next = (0..m).map(|l| power[k / m * m + l] * power[l * m + k % m]).sum();
        }
        std::mem::swap(&mut power, &mut next);
    }
    let column = (0..m).max_by(|&a, &b| power[a * m + a].re.total_cmp(&power[b * m + b].re)).unwrap_or(0);
    let x: Vec<c64> = (0..m).map(|i| power[i * m + column]).collect();
    let image = (0..m).map(|i| x[i].conj() * (0..m).map(|j| square[i * m + j] * x[j]).sum::<c64>()).sum::<c64>().re;
    let length: f64 = x.iter().map(|x| x.norm_sqr()).sum();
    (image / length).max(0.0).sqrt()
}
