//! The smallest singular value of `[A − λI, B]` in floating point.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side, c64};

use kardan_math::num::{Matrix, Rational, exponent, power_of_two};

/// The matrices in floating point, and exact.
pub(super) struct ScaledPair {
    pub exact: [Matrix<Rational>; 2],
    pub a: Matrix<f64>,
    pub b: Matrix<f64>,
}

impl ScaledPair {
    /// Matrices divided by the power of two that brings the largest entry near one, and that power.
    pub fn scaled(exact: [Matrix<Rational>; 2]) -> (Self, i64) {
        let entries = exact.iter().flat_map(|matrix| matrix.as_slice()).filter(|x| !x.is_zero());
        let power = entries.map(exponent).max().unwrap_or(0);
        let exact = if power == 0 { exact } else { exact.map(|matrix| matrix.scale(&power_of_two(-power))) };
        let [a, b] = [exact[0].to_f64(), exact[1].to_f64()];
        (Self { exact, a, b }, power)
    }
}

/// The smallest singular value at λ with its left vector.
#[derive(Debug, Clone)]
pub(super) struct Smallest {
    pub at: c64,
    pub value: f64,
    left: Vec<c64>,
}

/// `[A − λI, B]`.
pub(super) fn pencil(pair: &ScaledPair, at: c64) -> Mat<c64> {
    let n = pair.a.rows();
    Mat::from_fn(n, n + pair.b.columns(), |i, j| match j {
        j if j == i => c64::new(pair.a[(i, j)], 0.0) - at,
        j if j < n => c64::new(pair.a[(i, j)], 0.0),
        j => c64::new(pair.b[(i, j - n)], 0.0),
    })
}

/// For more states there is no proof from below, and only the apparently worst eigenvalues are followed.
pub const MOST_FROM_BELOW: usize = 80;
/// Steps of inverse iteration.
const ITERATIONS: usize = 4;

/// `None` if the decomposition fails.
pub(super) fn smallest(pair: &ScaledPair, at: c64) -> Option<Smallest> {
    let n = pair.a.rows();
    if n > MOST_FROM_BELOW {
        return by_iteration(pair, at);
    }
    let svd = pencil(pair, at).thin_svd().ok()?;
    let left: Vec<c64> = (0..n).map(|i| svd.U()[(i, n - 1)]).collect();
    Some(Smallest { at, value: svd.S()[n - 1].re, left: with_real_largest(left)? })
}

/// Not below the smallest singular value, and close to it: inverse iteration with the decomposition of Cholesky of
/// `[A − λI, B] [A − λI, B]ᴴ`.
fn by_iteration(pair: &ScaledPair, at: c64) -> Option<Smallest> {
    let n = pair.a.rows();
    let pencil = pencil(pair, at);
    let mut gram = &pencil * pencil.adjoint();
    let shift = n as f64 * f64::EPSILON * (0..n).map(|i| gram[(i, i)].re).sum::<f64>();
    (0..n).for_each(|i| gram[(i, i)] += c64::new(shift, 0.0));
    let factors = gram.llt(Side::Lower).ok()?;
    let mut left = Mat::from_fn(n, 1, |i, _| c64::new(1.0 / (1.0 + i as f64), 0.0));
    for _ in 0..ITERATIONS {
        factors.solve_in_place(&mut left);
        let size = left.norm_l2();
        left.col_mut(0).iter_mut().for_each(|x| *x /= size);
    }
    let value = (left.adjoint() * &pencil).norm_l2();
    let left = with_real_largest(left.col(0).iter().copied().collect())?;
    value.is_finite().then_some(Smallest { at, value, left })
}

/// The left eigenvectors of A to eigenvalues with imaginary part ≥ 0, with their products with B.
pub(super) fn left_eigenvectors(pair: &ScaledPair) -> Option<Vec<Smallest>> {
    let (n, m) = (pair.a.rows(), pair.b.columns());
    let transposed = Mat::from_fn(n, n, |i, j| pair.a[(j, i)]);
    let eigen = transposed.is_all_finite().then(|| transposed.eigen().ok())??;
    let one = |k: usize| {
        let left: Vec<c64> = (0..n).map(|i| eigen.U()[(i, k)].conj()).collect();
        let size = left.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt();
        let left = with_real_largest(left.into_iter().map(|x| x / size).collect())?;
        let on_b = |j: usize| (0..n).fold(c64::ZERO, |sum, i| sum + left[i].conj() * pair.b[(i, j)]);
        let value = (0..m).map(|j| on_b(j).norm_sqr()).sum::<f64>().sqrt();
        value.is_finite().then_some(Smallest { at: eigen.S()[k], value, left })
    };
    Some((0..n).filter(|&k| eigen.S()[k].im >= 0.0).filter_map(one).collect())
}

/// The phase is free: the largest entry is made real.
fn with_real_largest(left: Vec<c64>) -> Option<Vec<c64>> {
    let largest = left.iter().copied().max_by(|x, y| x.norm().total_cmp(&y.norm()))?;
    let phase = largest.conj() / largest.norm();
    Some(left.into_iter().map(|x| x * phase).collect())
}

impl Smallest {
    /// `uᴴ A u` of the left vector u: the λ at which that vector misses least.
    pub fn rayleigh_quotient(&self, pair: &ScaledPair) -> c64 {
        let n = pair.a.rows();
        let row = |i: usize| (0..n).fold(c64::ZERO, |sum, j| sum + self.left[j] * pair.a[(i, j)]);
        (0..n).fold(c64::ZERO, |sum, i| sum + self.left[i].conj() * row(i))
    }

    /// Real rows that span the left vector: its real part, and for a λ that is not real its imaginary part too.
    pub fn real_rows(&self) -> Vec<Vec<f64>> {
        let real = self.left.iter().map(|x| x.re).collect();
        match self.at.im == 0.0 {
            true => vec![real],
            false => vec![real, self.left.iter().map(|x| x.im).collect()],
        }
    }
}
