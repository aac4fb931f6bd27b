//! Leverage of single samples in a fit.

use kardan_math::num::{Cholesky, Matrix, dot};

/// Fraction of the errors below which their residual after a fit is rounding.
const ROUNDING: f64 = 1e-9;

/// Leverage of samples in a fit: residuals are smaller than errors where a sample has high leverage.
///
/// With `B = (XᵀX)⁻¹` the residuals of a sample with rows Xₛ have the covariance `I − XₛBXₛᵀ = LLᵀ` for errors of size one; `L⁻¹e` has
/// the size of the errors. A variance summed from these has the certainty of one of `(tr K)²/tr K²` samples, where
/// `K = δ_st ‖v_s‖² − u_sᵀBu_t`, `v_s = L⁻ᵀXₛB_j`, `u_s = Xₛᵀv_s` for the value j \[Bell, McCaffrey 2002\].
pub(super) struct Leverage<'a> {
    bread: &'a Matrix<f64>,
    factor: Cholesky,
    /// XₛB, r × p
    shares: Vec<f64>,
    matrix: Vec<f64>,
    v: Vec<f64>,
    u: Vec<f64>,
    /// For each value: Σ K_ss, Σ K_ss² − (uᵀBu)², and Σ u uᵀ.
    sums: Vec<(f64, f64, Matrix<f64>)>,
    /// For each value: Σ ‖v_s‖², of which Σ K_ss is the residual part after the fit.
    sizes: Vec<f64>,
    samples: usize,
}

impl<'a> Leverage<'a> {
    /// For samples with this number of rows.
    pub fn new(rows: usize, bread: &'a Matrix<f64>) -> Self {
        let p = bread.rows();
        Self {
            bread,
            factor: Cholesky::new(rows),
            shares: vec![0.0; rows * p],
            matrix: vec![0.0; rows * rows],
            v: vec![0.0; rows],
            u: vec![0.0; p],
            sums: vec![(0.0, 0.0, Matrix::zeros(p, p)); p],
            sizes: vec![0.0; p],
            samples: 0,
        }
    }

    /// Takes the rows of a sample; its residuals become of the size of the errors, unless the fit depends on this sample only.
    pub fn add(&mut self, x: &[f64], residual: &mut [f64]) {
        let (r, p) = (residual.len(), self.bread.rows());
        for i in 0..r {
            for j in 0..p {
                self.shares[i * p + j] = (0..p).map(|k| x[i * p + k] * self.bread[(k, j)]).sum();
            }
        }
        for i in 0..r {
            for j in 0..r {
                let share = dot(&self.shares[i * p..(i + 1) * p], &x[j * p..(j + 1) * p]);
                self.matrix[i * r + j] = f64::from(u8::from(i == j)) - share;
            }
        }
        let spread = (0..r).all(|i| self.matrix[i * r + i] > 1e-6) && self.factor.factor(&self.matrix);
        if spread {
            self.factor.half_solve(residual);
        }
        self.samples += 1;
        for (j, (diagonal, square, all)) in self.sums.iter_mut().enumerate() {
            (0..r).for_each(|i| self.v[i] = self.shares[i * p + j]);
            if spread {
                self.factor.other_half_solve(&mut self.v);
            }
            for (k, u) in self.u.iter_mut().enumerate() {
                *u = (0..r).map(|i| x[i * p + k] * self.v[i]).sum();
            }
            let (u, bread) = (&self.u, self.bread);
            let form: f64 = (0..p).map(|k| u[k] * (0..p).map(|l| bread[(k, l)] * u[l]).sum::<f64>()).sum();
            let size = dot(&self.v, &self.v);
            let own = size - form;
            self.sizes[j] += size;
            *diagonal += own;
            *square += own * own - form * form;
            all.add_outer(&1.0, u);
        }
    }

    /// Degrees of freedom of each value; NaN if the residuals are only rounding.
    ///
    /// K is symmetric of the order of the samples, so `(tr K)²` is at most their number times `tr K²`: a larger value is rounding too.
    pub fn degrees_of_freedom(&self) -> Vec<f64> {
        let p = self.bread.rows();
        let of = |((diagonal, square, all), size): (&(f64, f64, Matrix<f64>), &f64)| {
            if !(*diagonal > ROUNDING * size) {
                return f64::NAN;
            }
            let product = Matrix::from_fn(p, p, |i, j| (0..p).map(|k| self.bread[(i, k)] * all[(k, j)]).sum::<f64>());
            let both: f64 = (0..p).map(|i| (0..p).map(|k| product[(i, k)] * product[(k, i)]).sum::<f64>()).sum();
            let least = diagonal * diagonal / self.samples as f64;
            diagonal * diagonal / (square + both).max(least)
        };
        self.sums.iter().zip(&self.sizes).map(of).collect()
    }
}
