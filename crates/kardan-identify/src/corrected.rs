//! Rows of the balance without a measured torque: they determine ratios of coefficients, never their magnitude.

use super::Samples;
use kardan_math::num::{Cholesky, dot};

/// Smallest fraction of a direction that must remain after orthogonalisation.
const APART: f64 = 1e-6;

/// An orthonormal basis of the orthogonal complement of some directions in a space of this dimension; vector by vector.
fn complement<'a>(directions: impl Iterator<Item = &'a [f64]>, size: usize) -> Vec<f64> {
    let mut basis: Vec<f64> = Vec::new();
    let add = |basis: &mut Vec<f64>, own: &[f64]| {
        let mut remainder = own.to_vec();
        // Two passes suffice against rounding.
        for _ in 0..2 {
            for one in basis.chunks_exact(size) {
                let share = dot(one, &remainder);
                remainder.iter_mut().zip(one).for_each(|(x, b)| *x -= share * b);
            }
        }
        let length = dot(&remainder, &remainder).sqrt();
        if length > APART * dot(own, own).sqrt() {
            basis.extend(remainder.iter().map(|x| x / length));
        }
    };
    directions.for_each(|own| add(&mut basis, own));
    let basis_len = basis.len();
    let mut unit = vec![0.0; size];
    for k in 0..size {
        unit.fill(0.0);
        unit[k] = 1.0;
        add(&mut basis, &unit);
    }
    basis.split_off(basis_len)
}

impl Samples {
    /// The samples, corrected by the errors of the motion that rows without a measured torque yield at some values, so that
    /// `residual` of each sample and row remains; and with the covariances at these values. Unchanged without such rows.
    ///
    /// Such a row is `0 = Xθ + e` with an error that is as large as θ: least squares make θ small, and weights from its own residuals make
    /// it zero. The likelihood of the errors `ε` of the measurements, `e = Gε`, has no such minimum: it is stationary where
    /// `Σ X̂ᵀS⁻¹(y − Xθ) = 0` with X̂ the signals less their most likely errors, `ε = ΛGᵀS⁻¹(y − Xθ)` \[Fuller 1987, 3.1; Britt, Luecke
    /// 1973\]. For a row without known terms X̂θ is zero: every scale of θ fits it equally well.
    pub(super) fn corrected(&self, values: &[f64], residual: &dyn Fn(usize, usize) -> f64) -> Option<Self> {
        let errors = self.errors.as_ref()?;
        let mut out = self.clone();
        let (rows, m, r, p) = (self.rows, self.inputs, self.degrees_of_freedom, self.columns);
        let (size, (slopes, variances)) = (m + 3 * r, self.error_sizes());
        let mut work = Work { g: vec![0.0; rows * size], spread: vec![0.0; rows * size], residual: vec![0.0; rows] };
        for sample in 0..self.len() {
            let slopes = &errors.slopes[sample * slopes..(sample + 1) * slopes];
            let variances = &errors.variances[sample * variances..(sample + 1) * variances];
            let (of_fixed, of_columns) = slopes.split_at(rows * size);
            work.g.copy_from_slice(of_fixed);
            for ((column, part), own) in errors.columns.iter().zip(of_columns.chunks_exact((rows * r).max(1))) {
                for (i, j) in (0..rows).flat_map(|i| (0..r).map(move |j| (i, j))) {
                    work.g[i * size + m + part * r + j] += values[*column] * own[i * r + j];
                }
            }
            (0..rows).for_each(|row| work.residual[row] = residual(sample, row));
            let Some((covariance, likely)) = work.likely(variances, (rows, m, r)) else { continue };
            out.covariance[sample * rows * rows..(sample + 1) * rows * rows].copy_from_slice(&covariance);
            for ((column, part), own) in errors.columns.iter().zip(of_columns.chunks_exact((rows * r).max(1))) {
                let error = &likely[m + part * r..m + (part + 1) * r];
                for i in 0..rows {
                    let change = dot(&own[i * r..(i + 1) * r], error);
                    out.x[(sample * rows + i) * p + column] += change;
                    out.y[sample * rows + i] += values[*column] * change;
                }
            }
        }
        Some(out)
    }
}

/// Work quantities of one sample.
struct Work {
    /// G
    g: Vec<f64>,
    /// GΛ
    spread: Vec<f64>,
    /// y − Xθ
    residual: Vec<f64>,
}

impl Work {
    /// The covariance of the rows, and the most likely errors that the rows without a measured torque yield; `None` if no quantity is uncertain.
    fn likely(&mut self, variances: &[f64], (rows, m, r): (usize, usize, usize)) -> Option<(Vec<f64>, Vec<f64>)> {
        let size = m + 3 * r;
        for i in 0..rows {
            let (g, spread) = (&self.g[i * size..(i + 1) * size], &mut self.spread[i * size..(i + 1) * size]);
            (0..size).for_each(|k| spread[k] = g[k] * variances[k]);
            for j in 0..r {
                let (acceleration, position) = (m + j, m + 2 * r + j);
                spread[acceleration] += g[position] * variances[size + j];
                spread[position] += g[acceleration] * variances[size + j];
            }
        }
        let row = |of: &[f64], i: usize| of[i * size..(i + 1) * size].to_vec();
        let covariance: Vec<f64> =
            (0..rows * rows).map(|k| dot(&row(&self.spread, k / rows), &row(&self.g, k % rows))).collect();
        let acting: Vec<Vec<f64>> = (0..m)
            .filter(|&k| variances[k] > 0.0)
            .map(|k| (0..rows).map(|i| self.g[i * size + k]).collect::<Vec<f64>>())
            .filter(|column| column.iter().any(|x| *x != 0.0))
            .collect();
        let silent = complement(acting.iter().map(Vec::as_slice), rows);
        let count = silent.len() / rows;
        let project = |k: usize, of: &[f64]| dot(&silent[k * rows..(k + 1) * rows], of);
        let mut solved: Vec<f64> = (0..count).map(|k| project(k, &self.residual)).collect();
        let block: Vec<f64> = (0..count * count)
            .map(|at| {
                let column: Vec<f64> =
                    (0..rows).map(|i| project(at % count, &covariance[i * rows..(i + 1) * rows])).collect();
                project(at / count, &column)
            })
            .collect();
        let mut factor = Cholesky::new(count);
        if count == 0 || !factor.factor(&block) {
            return None;
        }
        factor.solve(&mut solved);
        let share = |i: usize| (0..count).map(|k| silent[k * rows + i] * solved[k]).sum::<f64>();
        let likely = (0..size).map(|k| (0..rows).map(|i| self.spread[i * size + k] * share(i)).sum()).collect();
        Some((covariance, likely))
    }
}
