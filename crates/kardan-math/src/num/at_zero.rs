//! Separates the eigenvalues of a matrix at zero from the others, in floating point.

use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;

use super::{Matrix, balance};

/// The accuracy of a matrix, in roundings of the largest entries.
const ROUNDINGS: f64 = 16.0;
/// Of how many such limits a number is not zero, however it was computed: an inverse then has a digit at least.
const CLEAR: f64 = 8.0;

/// The eigenvalues of a square matrix at zero, and the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct AtZero {
    /// Vectors that span what powers of the matrix send to zero, n × k; k is the number of eigenvalues at zero.
    pub motions: Matrix<f64>,
    /// The matrix on the rest, (n − k) × (n − k): `left · A · right`.
    pub rest: Matrix<f64>,
    /// To the coordinates of the rest, (n − k) × n; zero on the motions.
    pub left: Matrix<f64>,
    /// From them, n × (n − k); `left · right` is the identity.
    pub right: Matrix<f64>,
    /// The size below which numbers counted as zero, in balanced coordinates and the unit of the matrix; 0 if the test decided nothing.
    pub rounding: f64,
}

/// To which rounding a matrix is known.
#[derive(Debug, Clone, Copy)]
pub enum Rounding<'a> {
    /// Each entry to that of the largest one.
    OfLargest,
    /// Of a change `Φ − 1` of a map: to that of one, however little changes.
    OfOne,
    /// Each entry to that of its own size: that of its terms before cancellation.
    OfEach(&'a Matrix<f64>),
}

/// Splits off all eigenvalues of a matrix that are at zero to the rounding of its entries, however long their chains.
///
/// A chain of k rounded zeros otherwise spreads over a circle with the radius of the k-th root of the rounding unit. Method:
/// null space by singular values in balanced coordinates, the same for the rest, and so on (Kublanovskaya's
/// staircase): the result is exact for a matrix that differs by rounding, 16 n ε ‖A‖ in balanced coordinates. A matrix that no errors of the
/// size of single entries make singular has no eigenvalue at zero, however small it is against the largest entries: a slow motion beside
/// a spring of 1e12 N m/rad is not free. `None` if an entry is not finite or the iteration fails. Cost O(n³) for each step of the longest chain.
///
/// ```
/// use kardan_math::num::{Matrix, Rounding, at_zero};
/// // A free body with angle and speed, beside a decay with 3 1/s that it drives.
/// let rows = [[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, -3.0]];
/// let found = at_zero(&Matrix::from_fn(3, 3, |i, j| rows[i][j]), Rounding::OfLargest).unwrap();
/// assert_eq!(found.motions.columns(), 2);
/// assert!((found.rest[(0, 0)] + 3.0).abs() < 1e-15);
///
/// // Beside a decay with 1e16 1/s two slow ones are next to nothing.
/// let rows = [[-1e16, 0.0, 0.0], [1.0, -1.0, 0.5], [1.0, 0.5, -1.0]];
/// let a = Matrix::from_fn(3, 3, |i, j| rows[i][j]);
/// assert_eq!(at_zero(&a, Rounding::OfLargest).unwrap().motions.columns(), 2);
/// assert_eq!(at_zero(&a, Rounding::OfEach(&a)).unwrap().motions.columns(), 0);
/// ```
///
/// # Panics
/// If the matrix is not square, or if there is not one size for each entry.
pub fn at_zero(matrix: &Matrix<f64>, rounding: Rounding<'_>) -> Option<AtZero> {
    let n = matrix.rows();
    assert_eq!(n, matrix.columns(), "eigenvalues of a matrix that is not square");
    if matrix.as_slice().iter().any(|x| !x.is_finite()) {
        return None;
    }
    let a = Mat::from_fn(n, n, |i, j| matrix[(i, j)]);
    let scales = balance(&a);
    let a = Mat::from_fn(n, n, |i, j| a[(i, j)] * scales[j] / scales[i]);
    let largest = a.norm_l2().max(if matches!(rounding, Rounding::OfOne) { 1.0 } else { 0.0 });
    let least = ROUNDINGS * n as f64 * f64::EPSILON * largest;
    let sizes = match rounding {
        Rounding::OfEach(sizes) => Some(Mat::from_fn(n, n, |i, j| sizes[(i, j)].abs() * scales[j] / scales[i])),
        _ => None,
    };
    let (mut motions, mut remaining) = (Mat::<f64>::zeros(n, 0), Mat::<f64>::identity(n, n));
    let mut rest = a.clone();
    while rest.nrows() > 0 {
        // The smallest singular value is no less than one over the norm of the inverse, which is a tenth of the work.
        let inverse = rest.partial_piv_lu().inverse();
        // Vectors that were split off are less accurate than entries: only for the original matrix can these decide regularity.
        let whole = sizes.as_ref().filter(|_| motions.ncols() == 0);
        if 1.0 / inverse.norm_l2() > CLEAR * least || whole.is_some_and(|sizes| regular(sizes, &inverse)) {
            break;
        }
        let svd = rest.svd().ok()?;
        let p = rest.nrows();
        let rank = (0..p).filter(|&j| svd.S()[j] > least).count();
        if rank == p {
            break;
        }
        let v = svd.V();
        let more = &remaining * v.subcols(rank, p - rank);
        let before = motions.ncols();
        motions =
            Mat::from_fn(n, before + p - rank, |i, j| if j < before { motions[(i, j)] } else { more[(i, j - before)] });
        remaining = &remaining * v.subcols(0, rank);
        rest = remaining.transpose() * &a * &remaining;
    }
    let out = |m: &Mat<f64>| Matrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)]);
    Some(AtZero {
        motions: Matrix::from_fn(n, motions.ncols(), |i, j| motions[(i, j)] * scales[i]),
        rest: out(&rest),
        left: Matrix::from_fn(remaining.ncols(), n, |i, j| remaining[(j, i)] / scales[j]),
        right: Matrix::from_fn(n, remaining.ncols(), |i, j| remaining[(i, j)] * scales[i]),
        rounding: least,
    })
}

/// Whether a matrix, whose inverse is given, is regular for all errors of some roundings of these sizes: det changes by no more than the part
/// `ε Σ |δA_ij| |A⁻¹_ji|` of itself.
fn regular(sizes: &Mat<f64>, inverse: &Mat<f64>) -> bool {
    let n = inverse.nrows();
    let row = |i: usize| (0..n).map(|j| sizes[(i, j)] * inverse[(j, i)].abs()).sum::<f64>();
    ROUNDINGS * n as f64 * f64::EPSILON * (0..n).map(row).sum::<f64>() < 1.0 / CLEAR
}

#[cfg(test)]
#[path = "../../tests/unit/num/at_zero.rs"]
mod tests;
