//! The discrete linear quadratic regulator.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::floating::{from_faer, scaled, symmetric, to_faer};
use super::riccati::balance_with_costate;
use kardan_math::num::{Matrix, eigenvalues};
use kardan_results::{Complex, Pole};

/// Doublings after which an iteration is given up: the closed loop would have an eigenvalue within 2⁻⁴⁰ of the unit circle.
const MOST_DOUBLINGS: usize = 40;

/// The cost `Σ xᵀQx + 2xᵀNu + uᵀRu` of a sampled system `x⁺ = A x + B u`.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledCost {
    /// Q, states × states, symmetric; `[Q N; Nᵀ R]` positive semidefinite.
    pub state: Matrix<f64>,
    /// R, inputs × inputs, symmetric, positive definite.
    pub input: Matrix<f64>,
    /// N, states × inputs.
    pub cross: Matrix<f64>,
}

/// An optimal feedback `u = −K x` of a sampled system.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledRegulator {
    /// K = (R + BᵀXB)⁻¹(BᵀXA + Nᵀ), inputs × states.
    pub gain: Matrix<f64>,
    /// X: `xᵀXx` is the least cost from the state x on.
    pub solution: Matrix<f64>,
    /// Eigenvalues of A − BK, by size, all within the unit circle.
    pub multipliers: Vec<Pole>,
    /// Certificate: norm of `AᵀXA − X + Q − Kᵀ(R + BᵀXB)K` over the sum of the norms of its terms, in balanced coordinates.
    pub residual: f64,
}

/// The feedback with the least cost; `None` if there is no stabilising one that floating point can find, or R is not
/// positive definite.
///
/// Method: structure-preserving doubling (Anderson 1978; Chu, Fan, Lin, Wang 2004) in balanced coordinates, which converges
/// quadratically also where the closed loop has eigenvalues close to the unit circle. Cost: some 20 n³ flops for each of at
/// most 40 doublings.
///
/// ```
/// use kardan_math::num::Matrix;
/// use kardan_synthesis::regulator::{SampledCost, sampled_lqr};
/// // x⁺ = 2x + u, cost x² + u²: X = 4X/(1 + X) + 1, hence X = 2 + √5.
/// let one = |x: f64| Matrix::from_fn(1, 1, |_, _| x);
/// let cost = SampledCost { state: one(1.0), input: one(1.0), cross: one(0.0) };
/// let found = sampled_lqr(&one(2.0), &one(1.0), &cost).unwrap();
/// assert!((found.solution[(0, 0)] - 2.0 - 5f64.sqrt()).abs() < 1e-14);
/// ```
///
/// # Panics
/// If the shapes do not fit.
pub fn sampled_lqr(a: &Matrix<f64>, b: &Matrix<f64>, cost: &SampledCost) -> Option<SampledRegulator> {
    let (n, m) = (a.rows(), b.columns());
    assert!(a.columns() == n && b.rows() == n, "a sampled system whose matrices do not fit");
    assert!(cost.state.rows() == n && cost.input.rows() == m && cost.cross.rows() == n, "a cost that does not fit");
    let [a, b, q, r, cross] = [a, b, &cost.state, &cost.input, &cost.cross].map(to_faer);
    let factor = r.llt(faer::Side::Lower).ok()?.L().to_owned();
    let over = |m: &Mat<f64>| factor.as_ref().partial_piv_lu().solve(m.transpose()).transpose().to_owned();
    let (b, cross) = (over(&b), over(&cross));
    let inner = &a - &b * cross.transpose();
    let reduced_weight = symmetric(&(&q - &cross * cross.transpose()));
    let scales = balance_with_costate(&inner, &(&b * b.transpose()), &reduced_weight);
    let (ones, inverse) = (vec![1.0; m], scales.iter().map(|s| 1.0 / s).collect::<Vec<_>>());
    let inner = scaled(&inner, &scales, &scales);
    let b = scaled(&b, &scales, &ones);
    let reduced_weight = symmetric(&scaled(&reduced_weight, &inverse, &scales));
    let cross = scaled(&cross, &inverse, &ones);
    let x = doubled(&inner, &(&b * b.transpose()), &reduced_weight)?;
    // R = I: K = (I + BᵀXB)⁻¹(BᵀX(A + B Nᵀ) + Nᵀ) with the A of the file, A = inner + B Nᵀ.
    let full = &inner + &b * cross.transpose();
    let weight = Mat::<f64>::identity(m, m) + b.transpose() * &x * &b;
    let gain = weight.partial_piv_lu().solve(b.transpose() * &x * &full + cross.transpose());
    let terms = [
        full.transpose() * &x * &full,
        -&x,
        &reduced_weight + &cross * cross.transpose(),
        -(gain.transpose() * &weight * &gain),
    ];
    let size = terms.iter().map(|term| term.norm_l2()).sum::<f64>();
    let residual = terms.into_iter().fold(Mat::zeros(n, n), |sum, term| sum + term).norm_l2();
    let closed = &full - &b * &gain;
    let mut multipliers = Complex::list(eigenvalues(&from_faer(&closed))?);
    multipliers.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    if multipliers.last().is_some_and(|last| !(last.abs() < 1.0)) {
        return None;
    }
    let gain = factor.transpose().partial_piv_lu().solve(scaled(&gain, &ones, &inverse));
    let x = scaled(&x, &scales, &inverse);
    let residual = if size > 0.0 { residual / size } else { 0.0 };
    let good = gain.is_all_finite() && x.is_all_finite() && residual.is_finite();
    good.then(|| SampledRegulator { gain: from_faer(&gain), solution: from_faer(&x), multipliers, residual })
}

/// X of `X = Aᵀ X (I + G X)⁻¹ A + H` by doubling.
fn doubled(a: &Mat<f64>, g: &Mat<f64>, h: &Mat<f64>) -> Option<Mat<f64>> {
    let n = a.nrows();
    let (mut a, mut g, mut h) = (a.clone(), g.clone(), h.clone());
    for _ in 0..MOST_DOUBLINGS {
        let w = (Mat::<f64>::identity(n, n) + &g * &h).partial_piv_lu();
        let v = w.solve(&a);
        let next_g = symmetric(&(&g + &a * w.solve(&g) * a.transpose()));
        let change = symmetric(&(v.transpose() * &h * &a));
        let next_a = &a * &v;
        h = &h + &change;
        (a, g) = (next_a, next_g);
        if !h.is_all_finite() || !g.is_all_finite() {
            return None;
        }
        if change.norm_l2() <= f64::EPSILON * h.norm_l2() {
            return Some(h);
        }
    }
    None
}

/// X of `X = Fᵀ X S + Q`, summed by doubling: `Σ (Fᵀ)ᵏ Q Sᵏ`; `None` if the sum does not converge.
///
/// With S = F and Q symmetric this is Stein's equation.
///
/// ```
/// use kardan_math::num::Matrix;
/// let one = |x: f64| Matrix::from_fn(1, 1, |_, _| x);
/// let x = kardan_synthesis::regulator::stein(&one(0.5), &one(1.0), &one(3.0)).unwrap();
/// assert!((x[(0, 0)] - 6.0).abs() < 1e-14);
/// ```
///
/// # Panics
/// If the shapes do not fit.
pub fn stein(f: &Matrix<f64>, s: &Matrix<f64>, q: &Matrix<f64>) -> Option<Matrix<f64>> {
    assert!(f.rows() == q.rows() && s.rows() == q.columns(), "Stein's equation with matrices that do not fit");
    let [mut f, mut s, mut x] = [f, s, q].map(to_faer);
    for _ in 0..MOST_DOUBLINGS {
        let change = f.transpose() * &x * &s;
        x = &x + &change;
        (f, s) = (&f * &f, &s * &s);
        if !x.is_all_finite() || !f.is_all_finite() || !s.is_all_finite() {
            return None;
        }
        if change.norm_l2() <= f64::EPSILON * x.norm_l2() {
            return Some(from_faer(&x));
        }
    }
    None
}
