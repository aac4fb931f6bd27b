//! The smallest singular value of `[A − λI, B]` in floating point.

use faer::{Mat, c64};

use crate::num::{Matrix, Rational};

/// The matrices in floating point, and exact.
pub(super) struct Given {
    pub exact: [Matrix<Rational>; 2],
    pub a: Matrix<f64>,
    pub b: Matrix<f64>,
}

/// The smallest singular value at λ with its left vector.
#[derive(Debug, Clone)]
pub(super) struct Smallest {
    pub at: c64,
    pub value: f64,
    left: Vec<c64>,
}

/// `[A − λI, B]`.
pub(super) fn pencil(given: &Given, at: c64) -> Mat<c64> {
    let n = given.a.rows();
    Mat::from_fn(n, n + given.b.columns(), |i, j| match j {
        j if j == i => c64::new(given.a[(i, j)], 0.0) - at,
        j if j < n => c64::new(given.a[(i, j)], 0.0),
        j => c64::new(given.b[(i, j - n)], 0.0),
    })
}

/// `None` if the decomposition fails.
pub(super) fn smallest(given: &Given, at: c64) -> Option<Smallest> {
    let n = given.a.rows();
    let svd = pencil(given, at).thin_svd().ok()?;
    let left: Vec<c64> = (0..n).map(|i| svd.U()[(i, n - 1)]).collect();
    // The phase is free: the largest entry is made real.
    let largest = left.iter().copied().max_by(|x, y| x.norm().total_cmp(&y.norm()))?;
    let phase = largest.conj() / largest.norm();
    Some(Smallest { at, value: svd.S()[n - 1].re, left: left.into_iter().map(|x| x * phase).collect() })
}

impl Smallest {
    /// `uᴴ A u` of the left vector u: the λ at which that vector misses least.
    pub fn rayleigh_quotient(&self, given: &Given) -> c64 {
        let n = given.a.rows();
        let row = |i: usize| (0..n).fold(c64::ZERO, |sum, j| sum + self.left[j] * given.a[(i, j)]);
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
