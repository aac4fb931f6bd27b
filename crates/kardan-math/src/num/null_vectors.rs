//! Vectors of the approximate null space of a matrix.

use faer::{MatRef, c64};

/// Vectors that a matrix sends close to zero.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NullVectors {
    /// Orthonormal; `vectors[k][j] = (real, imaginary)`. The one that is sent closest to zero comes first.
    pub vectors: Vec<Vec<(f64, f64)>>,
    /// Norm of the image of each vector: the smallest singular values, ascending.
    pub residuals: Vec<f64>,
    /// Smallest singular value that is left out; far above the residuals if `count` is the true defect. Infinite if there
    /// is none.
    pub next: f64,
}

/// The `count` right singular vectors of the smallest singular values (of columns beyond the number of rows: zero).
///
/// For a defect known exactly they span the null space to floating-point accuracy. Left null vectors are those
/// of the adjoint. Method: singular value decomposition (`faer`), O(n³). `None` if an entry is not finite, the iteration
/// does not converge, or there are fewer than `count` columns.
///
/// ```
/// use faer::{Mat, c64};
/// // [1, j] annihilates (1, j).
/// let row = Mat::from_fn(1, 2, |_, j| [c64::new(1.0, 0.0), c64::new(0.0, 1.0)][j]);
/// let null = kardan_math::num::null_vectors(row.as_ref(), 1).unwrap();
/// let [(a, b), (c, d)] = [null.vectors[0][0], null.vectors[0][1]];
/// assert!((a - d).abs() < 1e-15 && (b + c).abs() < 1e-15);
/// ```
pub fn null_vectors(matrix: MatRef<'_, c64>, count: usize) -> Option<NullVectors> {
    let (rows, columns) = (matrix.nrows(), matrix.ncols());
    if !matrix.is_all_finite() || count > columns {
        return None;
    }
    let svd = matrix.svd().ok()?;
    let singular = |j: usize| if j < rows.min(columns) { svd.S()[j].re } else { 0.0 };
    let v = svd.V();
    let chosen: Vec<usize> = (columns - count..columns).rev().collect();
    Some(NullVectors {
        vectors: chosen.iter().map(|&j| (0..columns).map(|i| (v[(i, j)].re, v[(i, j)].im)).collect()).collect(),
        residuals: chosen.iter().map(|&j| singular(j)).collect(),
        next: if count < columns { singular(columns - count - 1) } else { f64::INFINITY },
    })
}
