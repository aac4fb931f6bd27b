//! The matrix exponential.

use faer::Mat;
use kardan_rt::functions::{exp2, log2};

use super::dense::product_of_leading;
use super::{Matrix, balance, scaled, unscaled};

/// Coefficients of the numerator of the diagonal Padé approximant of eˣ of degree 13.
const PADE: [f64; 14] = [
    64_764_752_532_480_000.0,
    32_382_376_266_240_000.0,
    7_771_770_303_897_600.0,
    1_187_353_796_428_800.0,
    129_060_195_264_000.0,
    10_559_470_521_600.0,
    670_442_572_800.0,
    33_522_128_640.0,
    1_323_241_920.0,
    40_840_800.0,
    960_960.0,
    16_380.0,
    182.0,
    1.0,
];

/// Up to this norm the approximant is exact to the rounding unit, in the sense of a backward error.
const LARGEST_NORM: f64 = 5.371_920_351_148_152;

/// Squarings up to which `e^A` itself is squared, beyond `e^A − 1`.
const FEW: f64 = 4.0;

/// The matrix exponential `e^A` of a square matrix.
///
/// Method: balanced coordinates, the diagonal Padé approximant of degree 13 of `A/2ˢ`, s squarings (Higham, SIAM J. Matrix
/// Anal. Appl. 26, 2005, algorithm 2.3 at its last degree), with many of them of `e^A − 1`. Errors are of the size of the rounding unit times `‖A‖` relative
/// to the largest entry of the balanced result; more if the squarings cancel (strongly non-normal A). Cost about
/// (8 + s) · 2n³ flops.
///
/// `None` if an entry is not finite or the result overflows.
///
/// ```
/// use kardan_math::num::{Matrix, exponential};
/// // An undamped oscillator, a quarter of a turn: [cos, sin; −sin, cos].
/// let quarter = std::f64::consts::FRAC_PI_2;
/// let a = Matrix::from_fn(2, 2, |i, j| [[0.0, quarter], [-quarter, 0.0]][i][j]);
/// let turned = exponential(&a).unwrap();
/// assert!((turned[(0, 1)] - 1.0).abs() < 1e-15 && turned[(0, 0)].abs() < 1e-15);
/// ```
///
/// # Panics
/// If the matrix is not square.
pub fn exponential(a: &Matrix<f64>) -> Option<Matrix<f64>> {
    assert_eq!(a.rows(), a.columns(), "exponential of a matrix that is not square");
    let scales = scales(a)?;
    let result = pade(&scaled(a, &scales), a.rows())?;
    finite(unscaled(&result, &scales))
}

/// A sampled system `x(k+1) = A x(k) + B u(k)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Discretised {
    /// `e^{AT}`, states × states.
    pub a: Matrix<f64>,
    /// `∫₀ᵀ e^{At} dt B`, states × inputs.
    pub b: Matrix<f64>,
}

/// The exact sampled form of `ẋ = A x + B u` whose inputs are constant over the sample time T in s (zero-order hold).
///
/// Method: the exponential of `[A B; 0 0] T`, whose first rows are `[e^{AT}, ∫₀ᵀ e^{At} dt B]` (Van Loan 1978); A may be
/// singular. States are balanced and columns of B scaled by powers of two, without rounding. Errors as those of
/// [`exponential`].
///
/// `None` if a number is not finite, T is not above zero, or the result overflows.
///
/// ```
/// use kardan_math::num::{Matrix, discretise};
/// // A double integrator: b = [T²/2; T].
/// let a = Matrix::from_fn(2, 2, |i, j| f64::from(u8::from((i, j) == (0, 1))));
/// let sampled = discretise(&a, &Matrix::from_fn(2, 1, |i, _| i as f64), 0.5).unwrap();
/// assert_eq!((sampled.a[(0, 1)], sampled.b[(0, 0)], sampled.b[(1, 0)]), (0.5, 0.125, 0.5));
/// ```
///
/// # Panics
/// If the shapes do not fit.
pub fn discretise(a: &Matrix<f64>, b: &Matrix<f64>, sample_time: f64) -> Option<Discretised> {
    let (n, m) = (a.rows(), b.columns());
    assert!(a.columns() == n && b.rows() == n, "sampling of matrices that do not fit");
    if !(sample_time > 0.0 && sample_time.is_finite() && b.as_slice().iter().all(|x| x.is_finite())) {
        return None;
    }
    let scales = scales(a)?;
    // Columns of B of the size of one: the result is linear in each of them.
    let column = |j: usize| (0..n).map(|i| (b[(i, j)] * sample_time / scales[i]).abs()).sum::<f64>();
    let sizes: Vec<f64> =
        (0..m).map(column).map(|size| if size > 0.0 { exp2(log2(size).ceil()) } else { 1.0 }).collect();
    let whole = Matrix::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => a[(i, j)] * scales[j] / scales[i] * sample_time,
        (true, false) => b[(i, j - n)] * sample_time / scales[i] / sizes[j - n],
        _ => 0.0,
    });
    let whole = pade(&whole, n)?;
    Some(Discretised {
        a: finite(Matrix::from_fn(n, n, |i, j| whole[(i, j)] * scales[i] / scales[j]))?,
        b: finite(Matrix::from_fn(n, m, |i, j| whole[(i, n + j)] * scales[i] * sizes[j]))?,
    })
}

fn scales(a: &Matrix<f64>) -> Option<Vec<f64>> {
    let finite = a.as_slice().iter().all(|x| x.is_finite());
    finite.then(|| balance(&Mat::from_fn(a.rows(), a.rows(), |i, j| a[(i, j)])))
}

fn finite(matrix: Matrix<f64>) -> Option<Matrix<f64>> {
    matrix.as_slice().iter().all(|x| x.is_finite()).then_some(matrix)
}

/// The exponential without balancing, of a matrix whose rows from this one on are zero.
fn pade(a: &Matrix<f64>, rows: usize) -> Option<Matrix<f64>> {
    let n = a.rows();
    let norm = (0..n).map(|j| (0..n).map(|i| a[(i, j)].abs()).sum::<f64>()).fold(0.0, f64::max);
    if !norm.is_finite() {
        return None;
    }
    let squarings = log2(norm / LARGEST_NORM).ceil().max(0.0);
    let a = a.scale(&exp2(-squarings));
    let product = |factors: [&Matrix<f64>; 2], inner: usize| {
        let mut out = Matrix::zeros(n, n);
        product_of_leading(factors, [rows, inner], &mut out);
        out
    };
    let second = product([&a, &a], rows);
    let fourth = product([&second, &second], rows);
    let sixth = product([&fourth, &second], rows);
    let sum = |c: [f64; 4]| {
        Matrix::from_fn(n, n, |i, j| {
            let one = f64::from(u8::from(i == j));
            sixth[(i, j)] * c[3] + fourth[(i, j)] * c[2] + second[(i, j)] * c[1] + one * c[0]
        })
    };
    let p = PADE;
    let odd = product([&sixth, &sum([0.0, p[9], p[11], p[13]])], n).plus(&sum([p[1], p[3], p[5], p[7]]));
    let odd = product([&a, &odd], n);
    let even = product([&sixth, &sum([0.0, p[8], p[10], p[12]])], n).plus(&sum([p[0], p[2], p[4], p[6]]));
    let left = even.minus(&odd);
    if squarings <= FEW {
        let mut out = left.solve(&even.plus(&odd))?;
        for _ in 0..squarings as usize {
            out = product([&out, &out], n);
            (rows..n).for_each(|k| out[(k, k)] = 1.0);
        }
        return finite(out);
    }
    // Each squaring doubles the rounding of 1 in entries next to 1, which those of slow motions are beside fast ones: e^A − 1 has none.
    let mut out = left.solve(&odd.scale(&2.0))?;
    for _ in 0..squarings as usize {
        out = out.scale(&2.0).plus(&product([&out, &out], rows));
    }
    (0..n).for_each(|k| out[(k, k)] += 1.0);
    finite(out)
}
