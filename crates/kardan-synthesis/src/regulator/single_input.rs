//! Pole placement for a single input (Ackermann).

use crate::exact_poles::{at_matrix, product};
use kardan_math::num::{Matrix, Rational, Scalar, rational_from_f64, rational_to_f64};
use kardan_results::{Complex, Pole};

/// The gain of a single input, `K = eₙᵀ [b, Ab, …]⁻¹ p(A)` (Ackermann), exact for the floats of the poles and rounded once.
///
/// With several dependent inputs `b_j = g_j b` the command is shared so that `Σ u_j²` is least. `None` if the pair is not
/// controllable or the poles are not self-conjugate.
pub(super) fn single_input(a: &Matrix<Rational>, b: &Matrix<Rational>, poles: &[Pole]) -> Option<Matrix<f64>> {
    let (n, m) = (a.rows(), b.columns());
    let exact: Option<Vec<(Rational, Rational)>> =
        poles.iter().map(|Complex { re, im }| rational_from_f64(*re).zip(rational_from_f64(*im))).collect();
    let polynomial = product(&exact?).ok()?;
    let (row, first) = (0..n).flat_map(|i| (0..m).map(move |j| (i, j))).find(|&(i, j)| !b[(i, j)].is_zero())?;
    let mut rows = Matrix::<Rational>::zeros(n, n);
    let mut column = Matrix::from_fn(n, 1, |i, _| b[(i, first)].clone());
    for k in 0..n {
        (0..n).for_each(|i| rows[(k, i)] = column[(i, 0)].clone());
        column = a.multiply(&column);
    }
    let last = Matrix::from_fn(n, 1, |i, _| if i + 1 == n { Rational::ONE } else { Rational::ZERO });
    let q = rows.solve(&last)?;
    let k = at_matrix(&polynomial, &a.transpose(), &q);
    let shares: Vec<Rational> = (0..m).map(|j| b[(row, j)].over(&b[(row, first)])).collect();
    let size = shares.iter().fold(Rational::ZERO, |sum, g| sum.plus(&g.times(g)));
    Some(Matrix::from_fn(m, n, |j, i| rational_to_f64(&shares[j].times(&k[(i, 0)]).over(&size))))
}
