//! Gramians over a finite horizon.

use faer::{Mat, MatRef};
use kardan_rt::functions::{exp2, log2, powi};

use kardan_math::num::{balance, length};

/// A finite-horizon Gramian `W(T) = ∫₀ᵀ e^{At} B Bᵀ e^{Aᵀt} dt`, stored as a factor.
#[derive(Debug, Clone)]
pub struct Gramian {
    /// G with `W = G Gᵀ`; states × columns. Small eigenvalues of W survive in it down to the square of the rounding unit.
    pub factor: Mat<f64>,
    /// The horizon T, s.
    pub horizon: f64,
    /// Certificate: Frobenius norm of `A W + W Aᵀ + B Bᵀ − e^{AT} B Bᵀ e^{AᵀT}` over the sum of the norms of its four terms,
    /// in balanced coordinates; of the size of the rounding unit times the condition of the problem.
    pub residual: f64,
}

impl Gramian {
    /// `W = G Gᵀ`, states × states.
    pub fn matrix(&self) -> Mat<f64> {
        &self.factor * self.factor.transpose()
    }

    /// The Gramian of several inputs together: the sum of theirs. The horizon is that of the first, the residual the largest.
    ///
    /// `None` if there is none, or their numbers of states or horizons differ.
    pub fn sum(parts: &[&Gramian]) -> Option<Gramian> {
        let first = parts.first()?;
        if parts.iter().any(|g| g.factor.nrows() != first.factor.nrows() || g.horizon != first.horizon) {
            return None;
        }
        let factors: Vec<MatRef<'_, f64>> = parts.iter().map(|g| g.factor.as_ref()).collect();
        let residual = parts.iter().fold(0.0, |worst: f64, g| worst.max(g.residual));
        Some(Gramian { factor: compressed(beside(&factors)), horizon: first.horizon, residual })
    }
}

/// Points and weights of Gauss-Legendre quadrature on `[0, 1]`, eight points, exact up to degree 15.
const QUADRATURE: [(f64, f64); 8] = [
    (0.019_855_071_751_231_884, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_63, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_64),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_64),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_24),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_13),
];

/// The controllability Gramian of `ẋ = A x + B u` over the horizon T in s; the observability Gramian is that of `Aᵀ`, `Cᵀ`.
///
/// `xᵀW⁻¹x` is the least `∫ uᵀu dt` that brings the state from rest to x in the time T. Method, for any A, stiff or
/// unstable: balanced coordinates; a step h with `‖Ah‖ ≤ ½` by quadrature (error below 2⁻⁵⁴ relative); then doubling,
/// `W(2t) = W(t) + e^{At} W(t) e^{Aᵀt}`, on factors: `G(2t) = [G(t), e^{At} G(t)]`, brought back to a square one by an
/// orthogonal transformation. All sums are of positive semidefinite matrices, so there is no cancellation. `a`: n × n; `b`: n × m.
/// Cost about 8 n³ log₂(2‖A‖T) flops.
///
/// `None` if a number is not finite (also if `e^{AT}` overflows) or `horizon` is not above zero.
///
/// ```
/// use faer::Mat;
/// // A double integrator: W(1) = [1/3, 1/2; 1/2, 1].
/// let a = Mat::from_fn(2, 2, |i, j| if (i, j) == (0, 1) { 1.0 } else { 0.0 });
/// let b = Mat::from_fn(2, 1, |i, _| i as f64);
/// let gramian = kardan_analysis::gramian(&a, &b, 1.0).unwrap();
/// assert!((gramian.matrix()[(0, 0)] - 1.0 / 3.0).abs() < 1e-15);
/// // From rest to the angle 1, at rest again: ∫u² dt = 12.
/// let energy = kardan_analysis::transfer_energy(&gramian, &[1.0, 0.0]);
/// assert!((energy - 12.0).abs() < 1e-12);
/// ```
///
/// # Panics
/// If the shapes do not fit.
pub fn gramian(a: &Mat<f64>, b: &Mat<f64>, horizon: f64) -> Option<Gramian> {
    let n = a.nrows();
    assert_eq!((a.ncols(), b.nrows()), (n, n), "Gramian of matrices that do not fit");
    if !(horizon > 0.0 && horizon.is_finite() && a.is_all_finite() && b.is_all_finite()) {
        return None;
    }
    let scales = balance(a);
    let a = Mat::from_fn(n, n, |i, j| a[(i, j)] * scales[j] / scales[i]);
    // Of inputs near one, so that no product of two vanishes or overflows: W is quadratic in them.
    let power = power_near(b);
    let b = Mat::from_fn(n, b.ncols(), |i, j| b[(i, j)] * powi(2.0, -power) / scales[i]);
    let doublings = log2(2.0 * norm_1(&a) * horizon).ceil().max(0.0);
    let step = horizon / exp2(doublings);
    let mut factor = quadrature(&a, &b, step);
    // e^{At} − I, in which slow motions keep their digits where fast ones dictate a short step.
    let mut change = exponential_minus_one(&a, step);
    for _ in 0..doublings as usize {
        factor = compressed(beside(&[factor.as_ref(), (&factor + &change * &factor).as_ref()]));
        change = faer::Scale(2.0) * &change + &change * &change;
    }
    if !(factor.is_all_finite() && change.is_all_finite()) {
        return None;
    }
    let transition = change + Mat::<f64>::identity(n, n);
    let residual = lyapunov_residual(&a, &b, &factor, &transition);
    let factor = Mat::from_fn(n, factor.ncols(), |i, j| factor[(i, j)] * scales[i] * powi(2.0, power));
    Some(Gramian { factor, horizon, residual })
}

/// Smallest eigenvalue of `diag(scaling) W diag(scaling)`: the worst direction of states measured in units of `1/scaling`.
///
/// With `scaling_i = 1/xᵢ` for a typical size xᵢ of each state it is the reciprocal of the largest energy needed for a state
/// of that size; its unit is then that of `1/∫uᵀu dt`. Accurate to the rounding unit times the largest singular value of
/// the factor; zero if the factor has fewer columns than states. `None` if a number is not finite.
///
/// # Panics
/// If there is not one scale per state.
pub fn smallest_eigenvalue(gramian: &Gramian, scaling: &[f64]) -> Option<f64> {
    let (n, columns) = (gramian.factor.nrows(), gramian.factor.ncols());
    assert_eq!(n, scaling.len(), "one scale per state");
    let scaled = Mat::from_fn(n, columns, |i, j| gramian.factor[(i, j)] * scaling[i]);
    if !scaled.is_all_finite() {
        return None;
    }
    if columns < n {
        return Some(0.0);
    }
    let power = power_near(&scaled);
    let scaled = faer::Scale(powi(2.0, -power)) * scaled;
    let smallest = scaled.singular_values().ok()?.last().copied().unwrap_or(f64::INFINITY);
    // Underflow and overflow must not give zero or infinity.
    let smallest = smallest * powi(2.0, power);
    let square = smallest * smallest;
    Some(if smallest > 0.0 { square.clamp(f64::MIN_POSITIVE, f64::MAX) } else { square })
}

/// Least `∫ uᵀu dt` that brings the state from rest to `target` within the horizon: `xᵀW⁻¹x`.
///
/// Infinite if the target cannot be reached: where W has (numerically) a null space, the part of the target outside the range
/// of W must be below 1e-9 of it, each state measured by `√W_ii`. Method: QR decomposition of the scaled factor with
/// pivoting, rank at `n · 2⁻⁵²`, so that energies up to about 1e28 times the smallest one are distinguished from infinity.
///
/// # Panics
/// If there is not one entry per state.
pub fn transfer_energy(gramian: &Gramian, target: &[f64]) -> f64 {
    let g = &gramian.factor;
    let (n, columns) = (g.nrows(), g.ncols());
    assert_eq!(n, target.len(), "one entry per state");
    let sizes: Vec<f64> = (0..n).map(|i| length(&g.row(i).iter().copied().collect::<Vec<_>>())).collect();
    if (0..n).any(|i| sizes[i] == 0.0 && target[i] != 0.0) {
        return f64::INFINITY;
    }
    let moving: Vec<usize> = (0..n).filter(|&i| sizes[i] > 0.0).collect();
    let x: Vec<f64> = moving.iter().map(|&i| target[i] / sizes[i]).collect();
    let scaled = Mat::from_fn(columns, moving.len(), |j, i| g[(moving[i], j)] / sizes[moving[i]]);
    let qr = scaled.col_piv_qr();
    let (r, (order, _)) = (qr.thin_R(), qr.P().arrays());
    let negligible = f64::EPSILON * n.max(columns) as f64;
    let rank = (0..r.nrows()).take_while(|&k| r[(k, k)].abs() > negligible * r[(0, 0)].abs()).count();
    // Rᵀ y = x in pivoted order; the rows beyond the rank must follow.
    let mut y = vec![0.0; rank];
    let size = x.iter().fold(0.0f64, |max, x| max.max(x.abs()));
    for i in 0..moving.len() {
        let partial: f64 = (0..rank.min(i)).map(|k| r[(k, i)] * y[k]).sum();
        let remainder = x[order[i]] - partial;
        if i < rank {
            y[i] = remainder / r[(i, i)];
        } else if !(remainder.abs() <= 1e-9 * size) {
            return f64::INFINITY;
        }
    }
    // Infinity is reserved for targets that cannot be reached.
    y.iter().map(|y| y * y).sum::<f64>().min(f64::MAX)
}

/// log₂ of the largest size of an entry, rounded down, as far as a power of two of it is a number; 0 where all are zero.
fn power_near(a: &Mat<f64>) -> i32 {
    let entries = (0..a.ncols()).flat_map(|j| (0..a.nrows()).map(move |i| (i, j)));
    let largest = entries.fold(0.0f64, |largest, at| largest.max(a[at].abs()));
    if largest > 0.0 { (log2(largest).floor() as i32).clamp(-1000, 1000) } else { 0 }
}

fn norm_1(a: &Mat<f64>) -> f64 {
    (0..a.ncols()).map(|j| a.col(j).norm_l1()).fold(0.0, f64::max)
}

/// `e^{Ah} X` by its series, for `‖Ah‖ ≤ ½`: the terms beyond the 16th are below 2⁻⁶⁴.
fn exponential_times(a: &Mat<f64>, h: f64, x: &Mat<f64>) -> Mat<f64> {
    let mut sum = x.clone();
    let mut term = x.clone();
    for k in 1..=16 {
        term = faer::Scale(h / k as f64) * (a * &term);
        sum += &term;
    }
    sum
}

/// `e^{Ah} − I` by its series up to the 15th term with six products (Paterson and Stockmeyer), for `‖Ah‖ ≤ ½`.
fn exponential_minus_one(a: &Mat<f64>, h: f64) -> Mat<f64> {
    let one = Mat::<f64>::identity(a.nrows(), a.nrows());
    let first = faer::Scale(h) * a;
    let second = &first * &first;
    let third = &second * &first;
    let fourth = &second * &second;
    let inverse_factorial = |k: usize| (1..=k).fold(1.0, |x, k| x / k as f64);
    let block = |k: usize| {
        let [c0, c1, c2, c3] = [0, 1, 2, 3].map(|j| faer::Scale(inverse_factorial(4 * k + j)));
        let c0 = if k > 0 { c0 } else { faer::Scale(0.0) };
        c0 * &one + c1 * &first + c2 * &second + c3 * &third
    };
    (0..3).rev().fold(block(3), |sum, k| sum * &fourth + block(k))
}

/// A factor of `W(h)`, one block of columns for each point.
fn quadrature(a: &Mat<f64>, b: &Mat<f64>, h: f64) -> Mat<f64> {
    let blocks: Vec<Mat<f64>> = QUADRATURE
        .iter()
        .map(|(point, weight)| faer::Scale((weight * h).sqrt()) * exponential_times(a, point * h, b))
        .collect();
    beside(&blocks.iter().map(|block| block.as_ref()).collect::<Vec<_>>())
}

fn beside(blocks: &[MatRef<'_, f64>]) -> Mat<f64> {
    let rows = blocks.first().map_or(0, |block| block.nrows());
    let mut out = Mat::zeros(rows, blocks.iter().map(|block| block.ncols()).sum());
    let mut at = 0;
    for block in blocks {
        out.submatrix_mut(0, at, rows, block.ncols()).copy_from(block);
        at += block.ncols();
    }
    out
}

/// A factor with at most as many columns as rows and the same `G Gᵀ`.
///
/// The error of each row is relative to that row.
fn compressed(factor: Mat<f64>) -> Mat<f64> {
    if factor.ncols() <= factor.nrows() || !factor.is_all_finite() {
        return factor;
    }
    factor.transpose().qr().thin_R().transpose().to_owned()
}

fn lyapunov_residual(a: &Mat<f64>, b: &Mat<f64>, factor: &Mat<f64>, transition: &Mat<f64>) -> f64 {
    let half = (a * factor) * factor.transpose();
    let end = transition * b;
    let (start, end) = (b * b.transpose(), &end * end.transpose());
    let size = 2.0 * half.norm_l2() + start.norm_l2() + end.norm_l2();
    let residual = &half + half.transpose() + start - end;
    if size > 0.0 { residual.norm_l2() / size } else { 0.0 }
}
