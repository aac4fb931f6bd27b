//! Eigenvectors of eigenvalues that are known.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatRef, c64};

use super::shape::{largest, normalised, times};
use kardan_math::num::null_vectors;

/// A band counts as narrow where the matrix has more than so many times its rows.
const NARROW: usize = 8;

/// Independent null vectors of a matrix whose defect is known, each with largest entry 1.
pub(super) fn null_space(matrix: &Mat<c64>, count: usize) -> Option<Vec<Vec<c64>>> {
    let vector = |v: &Vec<(f64, f64)>| normalised(&v.iter().map(|(re, im)| c64::new(*re, *im)).collect::<Vec<_>>());
    null_vectors(matrix.as_ref(), count)?.vectors.iter().map(vector).collect()
}

/// The eigenvector to a known eigenvalue: one step of inverse iteration, `(A − λ)x = b`, whose residual is `‖b‖/‖x‖`, within the
/// band where that is narrow; if the residual is not small or x overflows, the singular value decomposition.
pub(super) fn null_vector(a: MatRef<'_, f64>, value: c64, tolerance: f64) -> Option<Vec<c64>> {
    let n = a.nrows();
    let norm = a.norm_l2().max(value.norm());
    // No symmetry of the system is in the way of this right-hand side.
    let right: Vec<c64> = (0..n).map(|i| c64::new(1.0 / (1.0 + i as f64), 0.0)).collect();
    let before = right.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt();
    let band = bandwidth(&[a]);
    if NARROW * band < n && norm > 0.0 {
        let entry = |i: usize, j: usize| (c64::from(a[(i, j)]) - if i == j { value } else { c64::ZERO }) / norm;
        let x = solve_banded(n, band, entry, right.clone());
        let size = largest(&x).norm();
        if size.is_finite() && before * norm <= tolerance * size {
            return normalised(&x);
        }
    }
    let value = value + c64::from(f64::EPSILON * a.norm_l2());
    let shifted = Mat::from_fn(n, n, |i, j| c64::from(a[(i, j)]) - if i == j { value } else { c64::ZERO });
    let right = Mat::from_fn(n, 1, |i, _| right[i]);
    let x: Vec<c64> = PartialPivLu::new(shifted.as_ref()).solve(&right).col(0).iter().copied().collect();
    let size = largest(&x).norm();
    if size.is_finite() && before <= tolerance * size {
        return normalised(&x);
    }
    let null = null_vectors(shifted.as_ref(), 1)?;
    Some(null.vectors[0].iter().map(|(re, im)| c64::new(*re, *im)).collect())
}

/// Largest distance of an entry from the diagonal.
pub(super) fn bandwidth(matrices: &[MatRef<'_, f64>]) -> usize {
    let n = matrices[0].nrows();
    let places = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let occupied = places.filter(|&at| matrices.iter().any(|m| m[at] != 0.0));
    occupied.map(|(i, j)| i.abs_diff(j)).max().unwrap_or(0)
}

/// The null vectors of `λ²H + λD + S` at a known eigenvalue, `count` of them: inverse iteration within the band for a single
/// one, else the singular value decomposition.
pub(super) fn quadratic_null_vectors(
    [h, d, s]: [&Mat<f64>; 3],
    band: usize,
    value: c64,
    count: usize,
) -> Option<Vec<Vec<c64>>> {
    let r = h.nrows();
    let size = value.norm();
    let largest_of = |i: usize| h[(i, i)].abs() * size * size + d[(i, i)].abs() * size + s[(i, i)].abs();
    // Rows and columns of the size of one, as inertias may differ by powers of ten.
    let scales: Vec<f64> = (0..r).map(|i| 1.0 / largest_of(i).max(f64::MIN_POSITIVE).sqrt()).collect();
    let entry =
        |i: usize, j: usize| (value * value * h[(i, j)] + value * d[(i, j)] + s[(i, j)]) * (scales[i] * scales[j]);
    // The eigenvalue is as exact as rounding of the largest ones leaves it.
    let fastest =
        (0..r).map(|i| (s[(i, i)].abs() / h[(i, i)]).sqrt() + d[(i, i)].abs() / h[(i, i)]).fold(size, f64::max);
    let tolerance = 1e-14 * r as f64 * fastest / size.max(f64::MIN_POSITIVE);
    let unscaled = |x: &[c64]| normalised(&times(x, &scales));
    let mut x: Vec<c64> = (0..r).map(|i| c64::new(1.0 / (1.0 + i as f64), 0.0)).collect();
    for _ in 0..if count == 1 { 2 } else { 0 } {
        let before = x.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt();
        x = solve_banded(r, band, entry, x);
        let after = largest(&x).norm();
        if !after.is_finite() || after == 0.0 {
            break;
        }
        if before <= tolerance * after {
            return Some(vec![unscaled(&x)?]);
        }
        x.iter_mut().for_each(|x| *x /= after);
    }
    null_space(&Mat::from_fn(r, r, entry), count)?.iter().map(|x| unscaled(x)).collect()
}

/// Gaussian elimination with row exchanges of a matrix whose entries lie within `band` of the diagonal; a pivot that
/// vanishes is taken as the rounding unit. Cost O(n · band²).
pub(super) fn solve_banded(n: usize, band: usize, entry: impl Fn(usize, usize) -> c64, mut x: Vec<c64>) -> Vec<c64> {
    // Row i contains the columns from i − band to i + 2 band.
    let width = 3 * band + 1;
    let mut rows = vec![c64::ZERO; n * width];
    let at = |i: usize, j: usize| i * width + j + band - i;
    for i in 0..n {
        for j in i.saturating_sub(band)..(i + band + 1).min(n) {
            rows[at(i, j)] = entry(i, j);
        }
    }
    for k in 0..n {
        let below = (k + band + 1).min(n);
        let last = (k + 2 * band + 1).min(n);
        let pivot =
            (k..below).fold(k, |best, i| if rows[at(i, k)].norm() > rows[at(best, k)].norm() { i } else { best });
        if pivot != k {
            (k..last).for_each(|j| rows.swap(at(k, j), at(pivot, j)));
            x.swap(k, pivot);
        }
        if rows[at(k, k)].norm() < f64::EPSILON {
            rows[at(k, k)] = c64::new(f64::EPSILON, 0.0);
        }
        let inverse = rows[at(k, k)].inv();
        for i in k + 1..below {
            let factor = rows[at(i, k)] * inverse;
            if factor == c64::ZERO {
                continue;
            }
            for j in k + 1..last {
                let above = rows[at(k, j)];
                rows[at(i, j)] -= factor * above;
            }
            let above = x[k];
            x[i] -= factor * above;
        }
    }
    for k in (0..n).rev() {
        let sum = (k + 1..(k + 2 * band + 1).min(n)).fold(x[k], |sum, j| sum - rows[at(k, j)] * x[j]);
        x[k] = sum * rows[at(k, k)].inv();
    }
    x
}
