//! The complex Schur form of a real matrix.

use faer::{Mat, c64};
use kardan_rt::functions::hypot;

/// The Schur form `A = U T Uᴴ` of a real square matrix: U unitary, T upper triangular with the eigenvalues on its diagonal.
#[derive(Debug, Clone)]
pub(super) struct Schur {
    /// U.
    pub unitary: Mat<c64>,
    /// T.
    pub triangular: Mat<c64>,
}

/// A plane rotation `[c s; −s̄ c]`.
#[derive(Debug, Clone, Copy)]
struct Rotation {
    c: f64,
    s: c64,
}

impl Rotation {
    /// The one that brings (x, y) to (r, 0).
    fn to_first(x: c64, y: c64) -> Self {
        let (size, h) = (x.norm(), hypot(x.norm(), y.norm()));
        match (h > 0.0, size > 0.0) {
            (false, _) => Self { c: 1.0, s: c64::new(0.0, 0.0) },
            (true, false) => Self { c: 0.0, s: c64::new(1.0, 0.0) },
            (true, true) => Self { c: size / h, s: (x / size) * (y.conj() / h) },
        }
    }

    /// G M on two rows, from a column on.
    fn rows(self, m: &mut Mat<c64>, i: usize, k: usize, from: usize) {
        for j in from..m.ncols() {
            let (x, y) = (m[(i, j)], m[(k, j)]);
            m[(i, j)] = x * self.c + self.s * y;
            m[(k, j)] = y * self.c - self.s.conj() * x;
        }
    }

    /// M Gᴴ on two columns, up to a row.
    fn columns(self, m: &mut Mat<c64>, i: usize, k: usize, rows: usize) {
        for j in 0..rows {
            let (x, y) = (m[(j, i)], m[(j, k)]);
            m[(j, i)] = x * self.c + self.s.conj() * y;
            m[(j, k)] = y * self.c - self.s * x;
        }
    }
}

impl Schur {
    /// Method: Hessenberg form by rotations, then QR steps with the shift of Wilkinson; about 60 n³ flops, backward stable.
    ///
    /// `None` if an entry is not finite or the iteration does not converge.
    pub fn of(a: &Mat<f64>) -> Option<Self> {
        let n = a.nrows();
        if !a.is_all_finite() {
            return None;
        }
        let mut t = Mat::from_fn(n, n, |i, j| c64::new(a[(i, j)], 0.0));
        let mut u = Mat::from_fn(n, n, |i, j| c64::new(f64::from(u8::from(i == j)), 0.0));
        for k in 0..n.saturating_sub(2) {
            for i in (k + 2..n).rev() {
                if t[(i, k)] != c64::new(0.0, 0.0) {
                    let rotation = Rotation::to_first(t[(i - 1, k)], t[(i, k)]);
                    rotation.rows(&mut t, i - 1, i, k);
                    t[(i, k)] = c64::new(0.0, 0.0);
                    rotation.columns(&mut t, i - 1, i, n);
                    rotation.columns(&mut u, i - 1, i, n);
                }
            }
        }
        let norm = t.norm_max();
        let mut high = n.saturating_sub(1);
        let mut rounds = 0;
        while high > 0 {
            let small = |k: usize, t: &Mat<c64>| {
                let near = t[(k - 1, k - 1)].norm() + t[(k, k)].norm();
                t[(k, k - 1)].norm() <= f64::EPSILON * if near > 0.0 { near } else { norm }
            };
            let low = (1..=high).rev().find(|&k| small(k, &t)).unwrap_or(0);
            if low > 0 {
                t[(low, low - 1)] = c64::new(0.0, 0.0);
            }
            if low == high {
                high -= 1;
                rounds = 0;
                continue;
            }
            rounds += 1;
            if rounds > 100 {
                return None;
            }
            let shift = if rounds % 10 == 0 {
                t[(high, high)] + c64::new(0.75 * t[(high, high - 1)].norm(), 0.0)
            } else {
                wilkinson(&t, high)
            };
            for k in low..high {
                let (x, y) =
                    if k == low { (t[(k, k)] - shift, t[(k + 1, k)]) } else { (t[(k, k - 1)], t[(k + 1, k - 1)]) };
                let rotation = Rotation::to_first(x, y);
                rotation.rows(&mut t, k, k + 1, k.saturating_sub(1));
                if k > low {
                    t[(k + 1, k - 1)] = c64::new(0.0, 0.0);
                }
                rotation.columns(&mut t, k, k + 1, (k + 3).min(high + 1));
                rotation.columns(&mut u, k, k + 1, n);
            }
        }
        Some(Self { unitary: u, triangular: t })
    }

    /// Brings the eigenvalues with negative real part to the front; gives their number.
    pub fn stable_first(&mut self) -> usize {
        let n = self.triangular.nrows();
        let mut front = 0;
        for k in 0..n {
            if self.triangular[(k, k)].re < 0.0 {
                (front..k).rev().for_each(|i| self.swap(i));
                front += 1;
            }
        }
        front
    }

    /// Exchanges the eigenvalues i and i + 1.
    fn swap(&mut self, i: usize) {
        let t = &mut self.triangular;
        let n = t.nrows();
        let (first, second) = (t[(i, i)], t[(i + 1, i + 1)]);
        let rotation = Rotation::to_first(t[(i, i + 1)], second - first);
        rotation.rows(t, i, i + 1, i);
        rotation.columns(t, i, i + 1, i + 2);
        rotation.columns(&mut self.unitary, i, i + 1, n);
        t[(i + 1, i)] = c64::new(0.0, 0.0);
        t[(i, i)] = second;
        t[(i + 1, i + 1)] = first;
    }
}

/// The eigenvalue of the last 2 × 2 block that is nearer to its last entry.
fn wilkinson(t: &Mat<c64>, high: usize) -> c64 {
    let (a, b) = (t[(high - 1, high - 1)], t[(high - 1, high)]);
    let (c, d) = (t[(high, high - 1)], t[(high, high)]);
    let half = (a - d) * 0.5;
    let root = (half * half + b * c).sqrt();
    let larger = if (half + root).norm() > (half - root).norm() { half + root } else { half - root };
    if larger.norm() > 0.0 { d - b * c / larger } else { d }
}

#[cfg(test)]
#[path = "../../tests/unit/regulator/schur.rs"]
mod tests;
