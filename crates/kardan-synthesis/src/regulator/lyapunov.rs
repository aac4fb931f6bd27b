//! Solves Lyapunov equations.

use faer::{Mat, c64};

use super::floating::{from_faer, scaled, to_faer};
use super::schur::Schur;
use crate::matrix_parts::is_finite;
use crate::notation::format_pole;
use kardan_math::num::{Matrix, balance};
use kardan_results::Pole;

/// A solution of `A X + X Aᵀ + Q = 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct Lyapunov {
    /// X; symmetric if Q is.
    pub solution: Matrix<f64>,
    /// Certificate: norm of `A X + X Aᵀ + Q` over `2‖AX‖ + ‖Q‖`, in balanced coordinates.
    pub residual: f64,
}

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LyapunovError {
    /// The shapes do not fit.
    #[error("a Lyapunov equation needs two square matrices of the same size")]
    Shape,
    /// A number is not finite.
    #[error("a number is not finite")]
    NotFinite,
    /// Two eigenvalues of A add up to zero: there is no solution or there are many.
    #[error("the eigenvalues {} and {} add up to zero", format_pole(.0), format_pole(.1))]
    Singular(Pole, Pole),
    /// The eigenvalue iteration did not converge.
    #[error("the eigenvalue iteration does not converge")]
    Iteration,
}

/// Solves `A X + X Aᵀ + Q = 0`; that of `AᵀX + XA + Q = 0` comes with the transpose of A.
///
/// For a stable A, X is `∫₀^∞ e^{At} Q e^{Aᵀt} dt`. A: n × n, 1/s; Q: n × n. Method: Bartels and Stewart (1972) on the
/// complex Schur form in balanced coordinates, one step of iterative refinement; about 70 n³ flops.
///
/// # Errors
/// If two eigenvalues of A add up to zero (to the rounding unit of the largest), if shapes do not fit, or a number is not
/// finite.
///
/// ```
/// use kardan_math::num::Matrix;
/// use kardan_synthesis::regulator::lyapunov;
/// // −2x + 1 = 0
/// let one = |x| Matrix::from_fn(1, 1, |_, _| x);
/// assert_eq!(lyapunov(&one(-1.0), &one(1.0)).unwrap().solution[(0, 0)], 0.5);
/// ```
pub fn lyapunov(a: &Matrix<f64>, q: &Matrix<f64>) -> Result<Lyapunov, LyapunovError> {
    let n = a.rows();
    if a.columns() != n || q.rows() != n || q.columns() != n {
        return Err(LyapunovError::Shape);
    }
    if !(is_finite(a) && is_finite(q)) {
        return Err(LyapunovError::NotFinite);
    }
    if n == 0 {
        return Ok(Lyapunov { solution: q.clone(), residual: 0.0 });
    }
    let a = to_faer(a);
    let scales = balance(&a);
    let inverse: Vec<f64> = scales.iter().map(|s| 1.0 / s).collect();
    let (a, q) = (scaled(&a, &scales, &scales), scaled(&to_faer(q), &scales, &inverse));
    let schur = Schur::of(&a).ok_or(LyapunovError::Iteration)?;
    let mut x = schur.solve_lyapunov(&q)?;
    let residual = |x: &Mat<f64>| &a * x + x * a.transpose() + &q;
    x += schur.solve_lyapunov(&residual(&x))?;
    let size = 2.0 * (&a * &x).norm_l2() + q.norm_l2();
    let residual = residual(&x).norm_l2();
    let x = from_faer(&scaled(&x, &inverse, &scales));
    if !is_finite(&x) {
        return Err(LyapunovError::NotFinite);
    }
    Ok(Lyapunov { solution: x, residual: if size > 0.0 { residual / size } else { 0.0 } })
}

impl Schur {
    /// X of `A X + X Aᵀ + Q = 0`.
    pub fn solve_lyapunov(&self, q: &Mat<f64>) -> Result<Mat<f64>, LyapunovError> {
        let (u, t) = (&self.unitary, &self.triangular);
        let n = t.nrows();
        let largest = (0..n).map(|k| t[(k, k)].norm()).fold(0.0, f64::max);
        let right = u.adjoint() * Mat::from_fn(n, n, |i, j| c64::new(q[(i, j)], 0.0)) * u;
        // T Y + Y Tᴴ + UᴴQU = 0, from the last entry to the first
        let mut y = Mat::<c64>::zeros(n, n);
        for i in (0..n).rev() {
            for j in (0..n).rev() {
                let divisor = t[(i, i)] + t[(j, j)].conj();
                if !(divisor.norm() > f64::EPSILON * largest) {
                    let pole = |k: usize, sign: f64| Pole::new(t[(k, k)].re, sign * t[(k, k)].im);
                    return Err(LyapunovError::Singular(pole(i, 1.0), pole(j, -1.0)));
                }
                let mut sum = right[(i, j)];
                for k in i + 1..n {
                    sum += t[(i, k)] * y[(k, j)];
                }
                for k in j + 1..n {
                    sum += y[(i, k)] * t[(j, k)].conj();
                }
                y[(i, j)] = -sum / divisor;
            }
        }
        let x = u * y * u.adjoint();
        Ok(Mat::from_fn(n, n, |i, j| x[(i, j)].re))
    }
}
