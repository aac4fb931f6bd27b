//! The choice of motions that excite coefficients most (D-optimal design).

use kardan_rt::functions::ln;

use kardan_math::num::{Cholesky, Matrix};

/// Change of log det below which an exchange counts as none.
const IMPROVEMENT: f64 = 1e-9;
/// Exchanges after which the best set so far is taken: rounding could make a round of them.
const MOST_EXCHANGES: usize = 10_000;
/// Initial regularising information, relative to that of all candidates together.
const BEGINNING: f64 = 1e-6;

/// Experiments chosen among candidates.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Numbers of the candidates, ascending.
    pub chosen: Vec<usize>,
    /// `ln det(XᵀX)` over the rows of those chosen.
    pub log_det: f64,
}

/// Chooses `count` of the candidates so that `det(XᵀX)` over all their rows together is large: the volume of the confidence region
/// of θ in `Xθ = y` is small (D-optimality; Atkinson, Donev, Tobias, *Optimum Experimental Designs, with SAS*, 2007, 11 and 12).
///
/// Each candidate is a block of rows (rows × p) that one experiment gives, in units of the error of its measurement. `None` if no
/// choice determines all p unknowns, or there are fewer candidates than requested.
///
/// Method: greedy start, then Fedorov's exchanges (the best of all pairs of one in and one out) until none is better. The result is
/// a local optimum: no single exchange improves it. Cost `count · candidates · p³` for each exchange.
///
/// ```
/// use kardan_identify::d_optimal;
/// use kardan_math::num::Matrix;
/// // A parabola on [−1, 1] with three measurements: −1, 0 and 1.
/// let at = |k: i32| 0.1 * f64::from(k - 10);
/// let rows: Vec<Matrix<f64>> = (0..=20).map(|k| Matrix::from_fn(1, 3, |_, j| at(k).powi(j as i32))).collect();
/// assert_eq!(d_optimal(&rows, 3).unwrap().chosen, [0, 10, 20]);
/// ```
///
/// # Panics
/// If candidates differ in their numbers of columns.
pub fn d_optimal(candidates: &[Matrix<f64>], count: usize) -> Option<Selection> {
    let p = candidates.first()?.columns();
    assert!(candidates.iter().all(|rows| rows.columns() == p), "the same unknowns");
    if count > candidates.len() || count == 0 {
        return None;
    }
    // Columns of length one, so that the unknowns may have any units.
    let all = information(candidates, 0..candidates.len());
    let scales: Vec<f64> = (0..p).map(|j| all[(j, j)].sqrt()).collect();
    if scales.iter().any(|scale| !(*scale > 0.0 && scale.is_finite())) {
        return None;
    }
    let scaled = |rows: &Matrix<f64>| Matrix::from_fn(rows.rows(), p, |i, j| rows[(i, j)] / scales[j]);
    let squares: Vec<Vec<f64>> =
        candidates.iter().map(|rows| information(&[scaled(rows)], 0..1).as_slice().to_vec()).collect();
    let mut sum = vec![0.0; p * p];
    (0..p).for_each(|j| sum[j * p + j] = BEGINNING);
    let (mut tried, mut factor) = (vec![0.0; p * p], Cholesky::new(p));
    let mut with = |sum: &[f64], out: Option<&[f64]>, square: &[f64]| {
        for (k, x) in tried.iter_mut().enumerate() {
            *x = sum[k] + square[k] - out.map_or(0.0, |out| out[k]);
        }
        log_det(&mut factor, &tried)
    };
    let mut selected = vec![false; candidates.len()];
    for _ in 0..count {
        let free = (0..candidates.len()).filter(|&k| !selected[k]);
        let rated = free.map(|k| (k, with(&sum, None, &squares[k])));
        let best = rated.fold(None, |best: Option<(usize, f64)>, one| match best {
            Some(best) if one.1 <= best.1 + IMPROVEMENT => Some(best),
            _ => Some(one),
        });
        let (k, _) = best?;
        selected[k] = true;
        add(&mut sum, &squares[k]);
    }
    let mut exchanges = 0;
    let total = |selected: &[bool]| {
        let mut sum = vec![0.0; p * p];
        (0..selected.len()).filter(|&k| selected[k]).for_each(|k| add(&mut sum, &squares[k]));
        sum
    };
    loop {
        // Summed again, so that rounding errors do not accumulate.
        let sum = total(&selected);
        let now = log_det(&mut Cholesky::new(p), &sum);
        let mut best: Option<(usize, usize, f64)> = None;
        for out in (0..selected.len()).filter(|&k| selected[k]) {
            for enter in (0..selected.len()).filter(|&k| !selected[k]) {
                let value = with(&sum, Some(&squares[out]), &squares[enter]);
                if value > best.map_or(now, |best| best.2) + IMPROVEMENT {
                    best = Some((out, enter, value));
                }
            }
        }
        let Some((out, enter, _)) = best.filter(|_| exchanges < MOST_EXCHANGES) else {
            let scale: f64 = scales.iter().map(|scale| 2.0 * ln(*scale)).sum();
            let chosen: Vec<usize> = (0..selected.len()).filter(|&k| selected[k]).collect();
            return now.is_finite().then_some(Selection { chosen, log_det: now + scale });
        };
        (selected[out], selected[enter]) = (false, true);
        exchanges += 1;
    }
}

/// The information `XᵀX` (p × p) of some of the candidates together.
///
/// ```
/// use kardan_identify::information;
/// use kardan_math::num::Matrix;
/// let row = |x: f64| Matrix::from_fn(1, 2, |_, j| if j == 0 { 1.0 } else { x });
/// let both = information(&[row(1.0), row(3.0)], 0..2);
/// assert_eq!(both.to_rows(), [[2.0, 4.0], [4.0, 10.0]]);
/// ```
pub fn information(candidates: &[Matrix<f64>], chosen: impl IntoIterator<Item = usize>) -> Matrix<f64> {
    let p = candidates.first().map_or(0, Matrix::columns);
    let mut out = Matrix::<f64>::zeros(p, p);
    for k in chosen {
        for row in candidates[k].as_slice().chunks_exact(p) {
            out.add_outer(&1.0, row);
        }
    }
    out
}

/// `ln det` and the standard errors `√(M⁻¹)ᵢᵢ` expected from an information matrix, for an error of one in each row; `None` if
/// it does not determine all unknowns.
///
/// ```
/// use kardan_identify::expected_errors;
/// use kardan_math::num::Matrix;
/// let (log_det, errors) = expected_errors(&Matrix::from_fn(2, 2, |i, j| if i == j { 4.0 } else { 0.0 })).unwrap();
/// assert!((log_det - 16f64.ln()).abs() < 1e-15 && errors == [0.5, 0.5]);
/// ```
pub fn expected_errors(information: &Matrix<f64>) -> Option<(f64, Vec<f64>)> {
    let p = information.rows();
    let scales: Vec<f64> = (0..p).map(|j| information[(j, j)].sqrt()).collect();
    let scaled: Vec<f64> = (0..p * p).map(|k| information[(k / p, k % p)] / (scales[k / p] * scales[k % p])).collect();
    let mut factor = Cholesky::new(p);
    let log_det = log_det(&mut factor, &scaled) + scales.iter().map(|scale| 2.0 * ln(*scale)).sum::<f64>();
    let error = |j: usize| {
        let mut unit = vec![0.0; p];
        unit[j] = 1.0;
        factor.half_solve(&mut unit);
        unit.iter().map(|x| x * x).sum::<f64>().sqrt() / scales[j]
    };
    log_det.is_finite().then(|| (log_det, (0..p).map(error).collect()))
}

fn add(sum: &mut [f64], square: &[f64]) {
    sum.iter_mut().zip(square).for_each(|(sum, x)| *sum += x);
}

/// −∞ for a matrix that is not positive definite.
fn log_det(factor: &mut Cholesky, matrix: &[f64]) -> f64 {
    if factor.factor(matrix) { factor.log_det() } else { f64::NEG_INFINITY }
}

#[cfg(test)]
#[path = "../tests/unit/excitation.rs"]
mod tests;
