//! Solves continuous Riccati equations.

use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use kardan_rt::functions::{exp2, log2};

use super::floating::{scaled, symmetric};
use super::schur::Schur;

/// A stabilising solution of a Riccati equation.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    /// X, symmetric.
    pub x: Mat<f64>,
    /// K = R⁻¹(BᵀX + Nᵀ).
    pub gain: Mat<f64>,
    /// Norm of the residual over the sum of the norms of the terms, in balanced coordinates.
    pub residual: f64,
}

/// The equation `AᵀX + XA + Q − (XB + N)(XB + N)ᵀ = 0`, R = I, in balanced coordinates.
struct Equation {
    a: Mat<f64>,
    b: Mat<f64>,
    q: Mat<f64>,
    n: Mat<f64>,
}

/// The stabilising solution of `AᵀX + XA + Q − (XB + N) R⁻¹ (XB + N)ᵀ = 0`; `None` if the Hamiltonian matrix has eigenvalues
/// on the imaginary axis (to rounding), R has no Cholesky factor, or the result is not finite.
///
/// Method: inputs scaled by the Cholesky factor of R, states and costates balanced together by powers of two; the stable
/// invariant subspace of the Hamiltonian matrix by an ordered Schur form (Laub 1979); then steps of Newton (Kleinman 1968)
/// on the residual while they help.
pub(super) fn riccati(a: &Mat<f64>, b: &Mat<f64>, q: &Mat<f64>, r: &Mat<f64>, n: &Mat<f64>) -> Option<Solution> {
    let size = a.nrows();
    let factor = r.llt(faer::Side::Lower).ok()?.L().to_owned();
    // B L⁻ᵀ and N L⁻ᵀ
    let over = |m: &Mat<f64>| factor.as_ref().partial_piv_lu().solve(m.transpose()).transpose().to_owned();
    let (b, n) = (over(b), over(n));
    let inner = a - &b * n.transpose();
    let cost = q - &n * n.transpose();
    let scales = balance_with_costate(&inner, &(&b * b.transpose()), &cost);
    let (ones, inverse) = (vec![1.0; b.ncols()], scales.iter().map(|s| 1.0 / s).collect::<Vec<_>>());
    let equation = Equation {
        a: scaled(a, &scales, &scales),
        b: scaled(&b, &scales, &ones),
        q: symmetric(&scaled(q, &inverse, &scales)),
        n: scaled(&n, &inverse, &ones),
    };
    let mut x = equation.stable_subspace()?;
    let mut residual = equation.residual(&x);
    for _ in 0..20 {
        let Some(next) = equation.newton(&x) else { break };
        let next_residual = equation.residual(&next);
        if !(next_residual < 0.5 * residual) {
            if next_residual < residual {
                (x, residual) = (next, next_residual);
            }
            break;
        }
        (x, residual) = (next, next_residual);
    }
    let gain = factor.transpose().partial_piv_lu().solve(equation.gain(&x));
    let gain = scaled(&gain, &vec![1.0; gain.nrows()], &inverse);
    let x = scaled(&x, &scales, &inverse);
    let good = x.is_all_finite() && gain.is_all_finite() && (size == 0 || residual.is_finite());
    good.then_some(Solution { x, gain, residual })
}

impl Equation {
    fn gain(&self, x: &Mat<f64>) -> Mat<f64> {
        self.b.transpose() * x + self.n.transpose()
    }

    fn terms(&self, x: &Mat<f64>) -> [Mat<f64>; 4] {
        let gain = self.gain(x);
        let flow = self.a.transpose() * x;
        [flow.clone(), flow.transpose().to_owned(), self.q.clone(), -(gain.transpose() * &gain)]
    }

    fn residual(&self, x: &Mat<f64>) -> f64 {
        let [a, b, c, d] = self.terms(x);
        let size = [&a, &b, &c, &d].into_iter().map(|m| m.norm_l2()).sum::<f64>();
        let norm = (a + b + c + d).norm_l2();
        if size > 0.0 { norm / size } else { 0.0 }
    }

    /// X + Δ with `A_KᵀΔ + ΔA_K + Res(X) = 0`; `None` if X does not stabilise.
    fn newton(&self, x: &Mat<f64>) -> Option<Mat<f64>> {
        let closed = &self.a - &self.b * self.gain(x);
        let [a, b, c, d] = self.terms(x);
        let change = Schur::of(&closed.transpose().to_owned())?.solve_lyapunov(&symmetric(&(a + b + c + d))).ok()?;
        let next = symmetric(&(x + change));
        next.is_all_finite().then_some(next)
    }

    /// X = U₂ U₁⁻¹ from the stable invariant subspace [U₁; U₂] of the Hamiltonian matrix.
    fn stable_subspace(&self) -> Option<Mat<f64>> {
        let n = self.a.nrows();
        let inner = &self.a - &self.b * self.n.transpose();
        let cost = &self.q - &self.n * self.n.transpose();
        let push = &self.b * self.b.transpose();
        let hamiltonian = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, true) => inner[(i, j)],
            (true, false) => -push[(i, j - n)],
            (false, true) => -cost[(i - n, j)],
            (false, false) => -inner[(j - n, i - n)],
        });
        let mut schur = Schur::of(&hamiltonian)?;
        if schur.stable_first() != n {
            return None;
        }
        let first = Mat::from_fn(n, n, |i, j| schur.unitary[(i, j)]);
        let second = Mat::from_fn(n, n, |i, j| schur.unitary[(n + i, j)]);
        let x: Mat<c64> = first.transpose().partial_piv_lu().solve(second.transpose());
        let x = Mat::from_fn(n, n, |i, j| 0.5 * (x[(i, j)].re + x[(j, i)].re));
        x.is_all_finite().then_some(x)
    }
}

/// Scales s of the states, with 1/s of the costates, that balance rows and columns of `[A −G; −Q −Aᵀ]`; powers of
/// two.
pub(super) fn balance_with_costate(a: &Mat<f64>, g: &Mat<f64>, q: &Mat<f64>) -> Vec<f64> {
    let n = a.nrows();
    let mut scales = vec![1.0; n];
    for _ in 0..60 {
        let mut changed = false;
        for k in 0..n {
            let entry = |i: usize, j: usize| (a[(i, j)] * scales[j] / scales[i]).abs();
            let off_diagonal = || (0..n).filter(|&i| i != k);
            let column: f64 = off_diagonal().map(|i| entry(i, k)).sum::<f64>()
                + (0..n).map(|i| (q[(i, k)] * scales[i] * scales[k]).abs()).sum::<f64>();
            let row: f64 = off_diagonal().map(|j| entry(k, j)).sum::<f64>()
                + (0..n).map(|j| (g[(k, j)] / scales[k] / scales[j]).abs()).sum::<f64>();
            if !(column > 0.0 && row > 0.0 && column.is_finite() && row.is_finite()) {
                continue;
            }
            let factor = exp2((0.5 * log2(row / column)).round());
            if column * factor + row / factor < 0.95 * (column + row) {
                changed = true;
                scales[k] *= factor;
            }
        }
        if !changed {
            break;
        }
    }
    scales
}
