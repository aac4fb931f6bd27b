//! The Hessenberg form of a square matrix.

use super::{Matrix, dot};

/// Coordinates in which a square matrix is zero below its first subdiagonal: `H = Qᵀ A Q`, `Qᵀ B` and `C Q` with an orthogonal Q.
///
/// A system with `H` in place of `A` is solved in n² instead of n³ operations for each frequency. Method: Householder's reflections,
/// backward stable: `H` belongs to a matrix that differs from A by some roundings of its norm.
///
/// # Panics
/// If the shapes do not fit.
pub fn hessenberg([a, b, c]: [&Matrix<f64>; 3]) -> [Matrix<f64>; 3] {
    let n = a.rows();
    assert!(a.columns() == n && b.rows() == n && c.columns() == n, "states of a system");
    let [mut a, mut b, mut c] = [a.clone(), b.clone(), c.clone()];
    for k in 0..n.saturating_sub(2) {
        let mut mirror: Vec<f64> = (k + 1..n).map(|i| a[(i, k)]).collect();
        let largest = mirror[1..].iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        if largest == 0.0 {
            continue;
        }
        let scale = largest.max(mirror[0].abs());
        mirror.iter_mut().for_each(|x| *x /= scale);
        let length = dot(&mirror, &mirror).sqrt();
        mirror[0] += length.copysign(mirror[0]);
        let factor = 2.0 / dot(&mirror, &mirror);
        reflect_rows(&mut a, &mirror, factor);
        reflect_rows(&mut b, &mirror, factor);
        reflect_columns(&mut a, &mirror, factor);
        reflect_columns(&mut c, &mirror, factor);
        (k + 2..n).for_each(|i| a[(i, k)] = 0.0);
    }
    [a, b, c]
}

/// `(I − factor v vᵀ) M`, with v over the last rows.
fn reflect_rows(matrix: &mut Matrix<f64>, mirror: &[f64], factor: f64) {
    let first = matrix.rows() - mirror.len();
    let mut sums = vec![0.0; matrix.columns()];
    for (i, v) in mirror.iter().enumerate() {
        sums.iter_mut().zip(matrix.row(first + i)).for_each(|(sum, x)| *sum += v * x);
    }
    for (i, v) in mirror.iter().enumerate() {
        matrix.row_mut(first + i).iter_mut().zip(&sums).for_each(|(x, sum)| *x -= factor * v * sum);
    }
}

/// `M (I − factor v vᵀ)`, with v over the last columns.
fn reflect_columns(matrix: &mut Matrix<f64>, mirror: &[f64], factor: f64) {
    let first = matrix.columns() - mirror.len();
    for i in 0..matrix.rows() {
        let row = &mut matrix.row_mut(i)[first..];
        let sum = factor * dot(row, mirror);
        row.iter_mut().zip(mirror).for_each(|(x, v)| *x -= v * sum);
    }
}

#[cfg(test)]
#[path = "../../tests/unit/num/hessenberg.rs"]
mod tests;
