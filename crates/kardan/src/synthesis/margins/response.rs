use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use kardan_rt::functions::{atan, hypot, tan};

use crate::num::{Matrix, Transfer, at_zero, balance, eigenvalues};

/// Roundings within which a level is exceeded.
const LEVEL: f64 = 1e-9;
/// Largest part of an eigenvalue of the level test that may be real, if it is looked at.
const NEAR: f64 = 1e-3;
/// Squarings after which a power shows the largest singular value.
const SQUARINGS: usize = 20;
/// Part of its size by which a pole is beyond the axis, if it is not on it.
const NEXT_TO_AXIS: f64 = 1e-6;
/// Rounds of the level test.
const ROUNDS: usize = 60;

/// The largest singular value of a response over all frequencies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LargestGain {
    /// A value that is taken.
    pub value: f64,
    /// A level test shows that no value is larger (Boyd, Balakrishnan, Kabamba 1989), but for rounding.
    pub bound: f64,
    /// Where, rad/s; infinite where it is approached only.
    pub frequency: f64,
}

/// Why there is no answer at a frequency.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FrequencyError {
    /// It is negative, infinite or no number.
    #[error("{0} rad/s is no frequency: take a finite number from 0 rad/s on")]
    Negative(f64),
    /// The samples do not show it.
    #[error(
        "{0} rad/s is beyond the Nyquist frequency of {1} rad/s (half the sample rate): the samples show it as a slower one"
    )]
    BeyondNyquist(f64, f64),
    /// A sine of this frequency grows without bounds.
    #[error(
        "at {0} rad/s the system has a pole on the axis, so that its answer is infinite: take a frequency beside it"
    )]
    Pole(f64),
}

/// What a linear system makes of sines, `M(s) = C (sI − A)⁻¹ B + D`. Of a loop as errors of its channels see it: square and stable.
///
/// That of a map `z⁺ = Φ z + Γ w` is brought to this form by `s = (z − 1)/(z + 1)`, which keeps every value and turns the unit
/// circle into the imaginary axis: `s = j tan(ωT/2)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    a: Matrix<f64>,
    b: Matrix<f64>,
    c: Matrix<f64>,
    d: Matrix<f64>,
    /// T, s; `None` in continuous time.
    sample_time: Option<f64>,
    /// Eigenvalues of A.
    poles: Vec<(f64, f64)>,
}

impl Response {
    /// Of `ż = A z + B w`, `u = C z + D w`, or of the map `z⁺ = A z + B w` over a sample time in s; `None` if a number is not finite,
    /// or the map turns a state around in each sample (an eigenvalue −1).
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn state_space([a, b, c, d]: [&Matrix<f64>; 4], sample_time: Option<f64>) -> Option<Self> {
        let Some(time) = sample_time else { return Self::of(a.clone(), b.clone(), c.clone(), d.clone(), None) };
        let one = Matrix::<f64>::identity(a.rows());
        let sum = one.plus(a);
        let root = std::f64::consts::SQRT_2;
        let inputs = sum.solve(b)?;
        let outputs = sum.transpose().solve(&c.transpose())?.transpose();
        let through = d.plus(&c.multiply(&inputs).scale(&-1.0));
        let turned = sum.solve(&a.plus(&one.scale(&-1.0)))?;
        Self::of(turned, inputs.scale(&root), outputs.scale(&root), through, Some(time))
    }

    /// The loop of `ż = A z + B w`, `u = C z`; `None` if a number is not finite.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn continuous(a: &Matrix<f64>, b: &Matrix<f64>, c: &Matrix<f64>) -> Option<Self> {
        Self::of(a.clone(), b.clone(), c.clone(), Matrix::zeros(c.rows(), b.columns()), None)
    }

    /// The loop of the map `z⁺ = Φ z + Γ w`, `u = C z` over the sample time T in s; `None` if a number is not finite.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn sampled(map: &Matrix<f64>, b: &Matrix<f64>, c: &Matrix<f64>, sample_time: f64) -> Option<Self> {
        Self::state_space([map, b, c, &Matrix::zeros(c.rows(), b.columns())], Some(sample_time))
    }

    fn of(a: Matrix<f64>, b: Matrix<f64>, c: Matrix<f64>, d: Matrix<f64>, sample_time: Option<f64>) -> Option<Self> {
        let n = a.rows();
        assert!(a.columns() == n && b.rows() == n && c.columns() == n, "states of a loop");
        assert!(d.rows() == c.rows() && d.columns() == b.columns(), "channels of a loop");
        let poles = eigenvalues(&a)?;
        let scales = balance(&Mat::from_fn(n, n, |i, j| a[(i, j)]));
        let out = Self {
            a: Matrix::from_fn(n, n, |i, j| a[(i, j)] * scales[j] / scales[i]),
            b: Matrix::from_fn(n, b.columns(), |i, j| b[(i, j)] / scales[i]),
            c: Matrix::from_fn(c.rows(), n, |i, j| c[(i, j)] * scales[j]),
            d,
            sample_time,
            poles,
        };
        let all = [&out.a, &out.b, &out.c, &out.d];
        all.iter().all(|m| m.as_slice().iter().all(|x| x.is_finite())).then_some(out)
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

    /// π/T, rad/s, beyond which the samples show nothing new; `None` in continuous time.
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
        let held = eigenvalues(&at_zero(&self.a)?.rest)?;
        Some(held.iter().filter(|(re, im)| *re > NEXT_TO_AXIS * hypot(*re, *im)).count())
    }

    /// The other side of the same loop, `−(I + M)⁻¹ M`: of a loop gain L what errors see when it is closed, of that again L. `None`
    /// where one of them is not proper.
    pub fn turned_inside_out(&self) -> Option<Self> {
        let m = self.channels();
        let inverse = Matrix::<f64>::identity(m).plus(&self.d).solve(&Matrix::identity(m))?;
        let b = self.b.multiply(&inverse);
        let c = inverse.multiply(&self.c).scale(&-1.0);
        let d = inverse.multiply(&self.d).scale(&-1.0);
        let a = self.a.plus(&self.b.multiply(&c));
        Self::of(a, b, c, d, self.sample_time)
    }

    /// The sensitivity `S = I + M` of a loop as errors see it.
    pub fn sensitivity(&self) -> Self {
        let m = self.channels();
        Self { d: self.d.plus(&Matrix::identity(m)), ..self.clone() }
    }

    /// The complementary sensitivity `T = −M` of a loop as errors see it.
    pub fn complementary(&self) -> Self {
        Self { c: self.c.scale(&-1.0), d: self.d.scale(&-1.0), ..self.clone() }
    }

    /// All singular values at an angular frequency, rad/s, the largest first; `None` at a pole on the axis.
    pub fn singular_values(&self, frequency: f64) -> Option<Vec<f64>> {
        let found = self.checked(frequency).ok()?.singular_values().ok()?;
        Some(found)
    }

    /// The largest singular value over all frequencies (the H∞ norm); `None` of a system that is not stable, or if an iteration
    /// fails.
    ///
    /// ```
    /// use kardan::num::Matrix;
    /// use kardan::synthesis::margins::Response;
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
        let (value, place) = self.peak()?;
        Some(LargestGain { value, bound: value * (1.0 + LEVEL), frequency: self.frequency(place) })
    }

    /// Whether the loop is sampled.
    pub(super) fn is_sampled(&self) -> bool {
        self.sample_time.is_some()
    }

    /// M at a place on the imaginary axis; infinite: D.
    pub(super) fn at(&self, place: f64) -> Mat<c64> {
        let real = |m: &Matrix<f64>| Mat::from_fn(m.rows(), m.columns(), |i, j| c64::new(m[(i, j)], 0.0));
        let n = self.a.rows();
        if place.is_infinite() || n == 0 {
            return real(&self.d);
        }
        let shifted = Mat::from_fn(n, n, |i, j| c64::new(-self.a[(i, j)], if i == j { place } else { 0.0 }));
        real(&self.c) * shifted.partial_piv_lu().solve(real(&self.b)) + real(&self.d)
    }

    /// Half the difference of sensitivity and complementary sensitivity, M + ½: errors as disks around one.
    pub(super) fn balanced(&self) -> Self {
        let m = self.channels();
        Self { d: self.d.plus(&Matrix::identity(m).scale(&0.5)), ..self.clone() }
    }

    /// `diag(x) M diag(x)⁻¹`
    pub(super) fn scaled(&self, x: &[f64]) -> Self {
        let m = self.channels();
        Self {
            b: Matrix::from_fn(self.b.rows(), m, |i, j| self.b[(i, j)] / x[j]),
            c: Matrix::from_fn(m, self.c.columns(), |i, j| self.c[(i, j)] * x[i]),
            d: Matrix::from_fn(m, m, |i, j| self.d[(i, j)] * x[i] / x[j]),
            ..self.clone()
        }
    }

    /// The largest singular value at a place.
    pub(super) fn size(&self, place: f64) -> f64 {
        largest_singular(&self.at(place))
    }

    /// Places worth a look before anything is known: zero, infinity, next to each pole.
    pub(super) fn first_places(&self) -> Vec<f64> {
        let mut out = vec![0.0, f64::INFINITY];
        out.extend(self.poles.iter().flat_map(|(re, im)| [im.abs(), hypot(*re, *im)]));
        out.sort_by(f64::total_cmp);
        out.dedup();
        out
    }

    /// All places at which a singular value may be this level, ascending; `None` if the iteration fails.
    ///
    /// Imaginary eigenvalues of a Hamiltonian matrix (Boyd, Balakrishnan, Kabamba 1989); those next to the axis are given too.
    pub(super) fn level(&self, level: f64) -> Option<Vec<f64>> {
        let (n, m) = (self.a.rows(), self.channels());
        let r = Matrix::identity(m).scale(&(level * level)).plus(&self.d.transpose().multiply(&self.d).scale(&-1.0));
        let (bt, dt) = (self.b.transpose(), self.d.transpose());
        let per_c = r.solve(&dt.multiply(&self.c))?;
        let per_b = r.solve(&bt)?;
        let a = self.a.plus(&self.b.multiply(&per_c));
        let up = self.b.multiply(&per_b);
        let down = self.c.transpose().multiply(&self.c.plus(&self.d.multiply(&per_c)));
        // In units in which both corners are alike.
        let size = |m: &Matrix<f64>| m.as_slice().iter().fold(0.0f64, |max, x| max.max(x.abs()));
        let ratio = if size(&up) > 0.0 && size(&down) > 0.0 { (size(&down) / size(&up)).sqrt() } else { 1.0 };
        let whole = Matrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, true) => a[(i, j)],
            (true, false) => up[(i, j - n)] * ratio,
            (false, true) => -down[(i - n, j)] / ratio,
            (false, false) => -a[(j - n, i - n)],
        });
        let found = eigenvalues(&whole)?;
        let near = found.iter().filter(|(re, im)| re.abs() <= NEAR * im.abs() || *im == 0.0);
        let mut places: Vec<f64> = near.map(|(_, im)| im.abs()).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        Some(places)
    }

    /// The largest singular value over all frequencies, and its place; `None` if the iteration fails.
    ///
    /// From the largest of some values a level test tells between which places it is exceeded, the middles of these give the
    /// next value, until nothing exceeds it (Bruinsma and Steinbuch 1990): no peak is too narrow.
    pub(super) fn peak(&self) -> Option<(f64, f64)> {
        let mut best = (0.0f64, 0.0f64);
        let look = |place: f64, best: &mut (f64, f64)| {
            let size = self.size(place);
            if size > best.0 {
                *best = (size, place);
            }
            size.is_finite()
        };
        for place in self.first_places() {
            if !look(place, &mut best) {
                return None;
            }
        }
        if best.0 == 0.0 {
            // Nothing goes through.
            return Some(best);
        }
        for _ in 0..ROUNDS {
            let before = best.0;
            let places = self.level(before * (1.0 + LEVEL))?;
            for (k, place) in places.iter().enumerate() {
                look(*place, &mut best);
                match places.get(k + 1) {
                    Some(next) => look(0.5 * (place + next), &mut best),
                    None => look(2.0 * place, &mut best),
                };
            }
            if best.0 <= before * (1.0 + LEVEL) {
                return Some(best);
            }
        }
        Some(best)
    }

    /// Whether one level test shows that the balanced disk of the channels, alike for all of them, is no smaller than α. `false`
    /// says nothing: it may be all the same.
    pub fn holds_disk(&self, alpha: f64) -> bool {
        let (half, level) = (self.balanced(), 1.0 / alpha);
        let below = [0.0, f64::INFINITY].iter().all(|place| half.size(*place) < level);
        below && half.level(level).is_some_and(|places| places.is_empty())
    }

    /// Places at which the only channel's M is real (`real`), or has the real part −½; zero and infinity left out.
    ///
    /// Zeros of `M(s) ∓ M(−s)` from a pencil, shifted three ways, each brought to the axis by Newton steps.
    pub(super) fn crossings(&self, real: bool) -> Vec<f64> {
        let n = self.a.rows();
        let size = 2 * n + 1;
        let sign = if real { 1.0 } else { -1.0 };
        let corner = if real { 0.0 } else { 2.0 * self.d[(0, 0)] + 1.0 };
        let sizes: Vec<f64> = self.poles.iter().map(|(re, im)| hypot(*re, *im)).filter(|x| *x > 0.0).collect();
        let (low, high) = sizes.iter().fold((f64::MAX, 0.0f64), |(low, high), x| (low.min(*x), high.max(*x)));
        let mut out: Vec<f64> = Vec::new();
        if sizes.is_empty() {
            return out;
        }
        let mut starts = Vec::new();
        for shift in [0.737 * low, 1.131 * (low * high).sqrt(), 1.373 * high] {
            let pencil = Matrix::from_fn(size, size, |i, j| {
                let diagonal = if i == j { shift } else { 0.0 };
                match (i / n.max(1), j / n.max(1)) {
                    _ if i == 2 * n && j == 2 * n => corner,
                    _ if i == 2 * n => self.c[(0, j % n)] * if j < n { 1.0 } else { sign },
                    _ if j == 2 * n => self.b[(i % n, 0)],
                    (0, 0) => self.a[(i, j)] - diagonal,
                    (1, 1) => -self.a[(i - n, j - n)] - diagonal,
                    _ => 0.0,
                }
            });
            let unit = Matrix::from_fn(size, size, |i, j| f64::from(u8::from(i == j && i < 2 * n)));
            let Some(found) = pencil.solve(&unit).as_ref().and_then(eigenvalues) else { continue };
            for (re, im) in found {
                let square = re * re + im * im;
                let (x, y) = (shift + re / square, -im / square);
                if y > 0.0 && x.abs() < 0.1 * y && y.is_finite() {
                    starts.push(y);
                }
            }
        }
        starts.extend(self.poles.iter().map(|(_, im)| im.abs()).filter(|im| *im > 0.0));
        // What two shifts agree upon is one start.
        starts.sort_by(f64::total_cmp);
        starts.dedup_by(|next, kept| *next - *kept <= 1e-10 * *kept);
        let column: Vec<f64> = (0..n).map(|i| self.b[(i, 0)]).collect();
        let mut transfer = Transfer::new(&self.a, &column, self.c.row(0));
        let mut value = |place: f64| {
            let (m, by_s) = transfer.at(c64::new(0.0, place));
            let (m, slope) = (m + self.d[(0, 0)], by_s * c64::new(0.0, 1.0));
            if real { (m.im, slope.im) } else { (m.re + 0.5, slope.re) }
        };
        for start in starts {
            let mut place = start;
            let mut done = false;
            for _ in 0..60 {
                let (error, slope) = value(place);
                if error == 0.0 {
                    done = true;
                    break;
                }
                let step = (error / slope).clamp(-0.2 * place, 0.2 * place);
                let next = place - step;
                if !next.is_finite() {
                    break;
                }
                done = (next - place).abs() <= 4.0 * f64::EPSILON * place;
                place = next;
                if done {
                    break;
                }
            }
            // Newton ends at the last bits; what it found is a crossing if M says so there.
            let (error, slope) = value(place);
            let settled = done || (error / slope).abs() <= 1e-9 * place;
            if settled && place > 0.0 && out.iter().all(|other| (other - place).abs() > 1e-9 * place) {
                out.push(place);
            }
        }
        out.sort_by(f64::total_cmp);
        out
    }
}

/// The largest singular value of a small matrix, to about a millionth where two are close, else to rounding.
///
/// Powers of `MᴴM` by squaring, and the Rayleigh quotient of what is left: much faster than a decomposition at this size.
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
