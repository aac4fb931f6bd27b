//! The distance of given matrices to the nearest uncontrollable (unobservable) system: bounds from both sides.
//!
//! The distance is `min ‖[ΔA, ΔB]‖` over all changes after which some mode is not reached; it equals the least of
//! `σ_min([A − λI, B])` over all complex λ for complex changes (Eising 1984), and is not smaller for real ones.
//!
//! **From above** a real change is exhibited: with rows `Yᵀ` from singular vectors and any M, the change
//! `Δ = −Y (YᵀY)⁻¹ [YᵀA − M Yᵀ, YᵀB]` makes `Yᵀ (A + ΔA) = M Yᵀ` and `Yᵀ (B + ΔB) = 0` hold exactly, over the rationals.
//! **From below** squares of the complex plane are split until the proofs at their corners cover them, for half of the
//! least value known, then for nine tenths; `lower.rs` has the inequality and counts the rounding. That works up to about 50
//! full states; for more, the work limit may end the search with a tenth or no bound, and above [`MOST_FROM_BELOW`] it is not tried.

//!
//! Both are found for the matrices times a power of two that brings their largest entry near one: `σ_min` and the changes scale with them, and
//! no square overflows floating point.

mod lower;
mod smallest;

use faer::c64;
use kardan_rt::functions::powi;

use super::LinearSystem;
use super::failing::{LEAST_SHARE, relative_shares};
use super::parts::{side_by_side, texts};
use super::system::Side;
use kardan_math::num::{
    Matrix, Rational, Scalar, above, below, eigenvalues, power_of_two, rational_from_f64, rational_to_f64, root_above,
};
use kardan_results::{Complex, Invariant, MatrixDistance};
pub use smallest::MOST_FROM_BELOW;
use smallest::{ScaledPair, Smallest, left_eigenvectors, smallest};

/// Systems with more states are not examined.
pub const MOST_STATES: usize = 200;
/// Local minima that are followed to their end.
const FOLLOWED: usize = 6;
/// Steps towards a local minimum.
const STEPS: usize = 40;
/// Both for a system above [`MOST_FROM_BELOW`].
const FOLLOWED_OF_MANY: usize = 1;
const STEPS_OF_MANY: usize = 3;

/// The distance of a system from the nearest one that is not controllable, or with [`Side::Outputs`] not observable.
///
/// With an E other than the identity it is that of `E⁻¹A` and `E⁻¹B`. `None` without inputs (outputs), for more than
/// [`MOST_STATES`] states, a singular E, or a distance outside the range of floating point. Both bounds scale exactly with powers of two of the matrices.
///
/// ```
/// use kardan_analysis::{LinearSystem, Side, distance_of_matrices};
/// use kardan_math::num::{Matrix, Rational};
/// let q = |x: f64| kardan_math::num::rational_from_f64(x).unwrap();
/// // The input moves the second state by a thousandth.
/// let a = Matrix::from_fn(2, 2, |i, j| if i == j { q(i as f64) } else { Rational::ZERO });
/// let b = Matrix::from_fn(2, 1, |i, _| q([1.0, 1e-3][i]));
/// let system = LinearSystem::state_space(a, b, Matrix::zeros(0, 2));
/// let found = distance_of_matrices(&system, Side::Inputs).unwrap();
/// assert!(found.upper <= 1e-3 && found.lower >= 0.8 * found.upper);
/// assert!((found.eigenvalue.re - 1.0).abs() < 1e-3);
/// ```
pub fn distance_of_matrices(system: &LinearSystem, side: Side) -> Option<MatrixDistance> {
    let n = system.states.len();
    if n > MOST_STATES {
        return None;
    }
    let explicit = system.explicit()?;
    let explicit = if side == Side::Inputs { explicit } else { explicit.transpose() };
    if explicit.inputs.is_empty() {
        return None;
    }
    let (pair, power) = ScaledPair::scaled([explicit.a, explicit.b]);
    let minima = minima(&pair, starts(&pair)?)?;
    let least = minima.iter().map(|one| one.value).fold(f64::INFINITY, f64::min);
    let changes = minima.iter().filter_map(|one| Change::of(&pair, one));
    let best = changes.min_by(|one, other| one.size.cmp(&other.size))?;
    let lower = if n > MOST_FROM_BELOW { 0.0 } else { lower::proven(&pair, least) };
    let lower = rational_from_f64(lower)?.min(best.size.clone());
    Some(best.described(&pair, &explicit.states, lower, power)).filter(|found| found.upper.is_finite())
}

/// Where the search begins: at the eigenvalues, and at the real parts of pairs.
fn starts(pair: &ScaledPair) -> Option<Vec<Smallest>> {
    if pair.a.rows() > MOST_FROM_BELOW {
        return left_eigenvectors(pair);
    }
    let values = eigenvalues(&pair.a)?;
    let upper = values.iter().filter(|(_, im)| *im >= 0.0).map(|(re, im)| c64::new(*re, *im));
    let real = values.iter().filter(|(_, im)| *im > 0.0).map(|(re, _)| c64::new(*re, 0.0));
    Some(upper.chain(real).filter_map(|start| smallest(pair, start)).collect())
}

/// Local minima of σ_min, those of real λ too.
fn minima(pair: &ScaledPair, mut all: Vec<Smallest>) -> Option<Vec<Smallest>> {
    let (followed, steps) = match pair.a.rows() > MOST_FROM_BELOW {
        true => (FOLLOWED_OF_MANY, STEPS_OF_MANY),
        false => (FOLLOWED, STEPS),
    };
    let by_value = |one: &Smallest, other: &Smallest| one.value.total_cmp(&other.value);
    all.sort_by(by_value);
    // An eigenvalue may be a place from which no way leads down, as for a chain of integrators: its neighbours too.
    let beside = |one: &Smallest| {
        let step = one.value / 2.0;
        [(step, 0.0), (0.0 - step, 0.0), (0.0, step)].map(|(x, y)| c64::new(one.at.re + x, one.at.im + y))
    };
    let neighbours: Vec<c64> = all.iter().take(followed).flat_map(beside).collect();
    all.extend(neighbours.into_iter().filter_map(|at| smallest(pair, at)));
    all.sort_by(by_value);
    // Of each kind the best ones.
    let (mut real, mut pairs): (Vec<_>, Vec<_>) = all.into_iter().partition(|one| one.at.im == 0.0);
    real.truncate(followed);
    pairs.truncate(followed);
    let followed: Vec<Smallest> = real.into_iter().chain(pairs).map(|one| follow(pair, one, steps)).collect();
    (!followed.is_empty()).then_some(followed)
}

/// With the left vector fixed, the best λ is its Rayleigh quotient; with λ fixed, the best vector is the singular one. The
/// value falls in every step.
fn follow(pair: &ScaledPair, mut one: Smallest, steps: usize) -> Smallest {
    for _ in 0..steps {
        let quotient = one.rayleigh_quotient(pair);
        let at = if one.at.im == 0.0 { c64::new(quotient.re, 0.0) } else { quotient };
        match smallest(pair, at) {
            Some(next) if next.value < one.value * (1.0 - 1e-6) => one = next,
            _ => break,
        }
    }
    one
}

/// A real change of the matrices after which the rows `Yᵀ` are not reached.
struct Change {
    /// Yᵀ, one or two rows.
    rows: Matrix<Rational>,
    /// M.
    action: Matrix<Rational>,
    /// `[YᵀA − M Yᵀ, YᵀB]`.
    miss: Matrix<Rational>,
    /// `(YᵀY)⁻¹`.
    gram: Matrix<Rational>,
    /// Frobenius norm of the change, rounded up.
    size: Rational,
}

impl Change {
    fn of(pair: &ScaledPair, one: &Smallest) -> Option<Self> {
        let n = pair.a.rows();
        let vectors = one.real_rows();
        let exact: Option<Vec<Vec<Rational>>> =
            vectors.iter().map(|row| row.iter().map(|x| rational_from_f64(*x)).collect()).collect();
        let exact = exact?;
        let rows = Matrix::from_fn(exact.len(), n, |i, j| exact[i][j].clone());
        let squares = rows.multiply(&rows.transpose());
        let gram = squares.solve(&Matrix::identity(exact.len()))?;
        let on_a = rows.multiply(&pair.exact[0]);
        let action = on_a.multiply(&rows.transpose()).multiply(&gram);
        let on_b = rows.multiply(&pair.exact[1]);
        let miss = side_by_side(&[&on_a.minus(&action.multiply(&rows)), &on_b]);
        // ‖Y (YᵀY)⁻¹ R‖² is the trace of Rᵀ (YᵀY)⁻¹ R.
        let scaled = gram.multiply(&miss);
        let products = scaled.as_slice().iter().zip(miss.as_slice()).map(|(x, y)| x.times(y));
        let square = products.fold(Rational::ZERO, |sum, x| sum.plus(&x));
        Some(Self { rows, action, miss, gram, size: root_above(&square) })
    }

    /// Of the matrices as they were before they were scaled by a power of two.
    fn described(self, pair: &ScaledPair, states: &[String], lower: Rational, power: i64) -> MatrixDistance {
        let n = pair.a.rows();
        let back = power_of_two(power);
        let action = self.action.scale(&back);
        let both = self.rows.transpose().multiply(&self.gram.multiply(&self.miss)).scale(&back).to_f64();
        let change = |from: usize, to: usize| -> Vec<Vec<f64>> {
            (0..n).map(|i| (from..to).map(|j| 0.0 - both[(i, j)]).collect()).collect()
        };
        let size = |j: usize| (0..self.rows.rows()).map(|i| powi(rational_to_f64(&self.rows[(i, j)]), 2)).sum::<f64>();
        MatrixDistance {
            lower: below(&(lower * &back)),
            upper: above(&(self.size * &back)),
            eigenvalue: eigenvalue(&self.action, &back),
            states: relative_shares(states.iter().cloned().zip((0..n).map(|j| size(j).sqrt())), LEAST_SHARE),
            change_of_a: change(0, n),
            change_of_b: change(n, n + pair.b.columns()),
            proof: Invariant { rows: texts(&self.rows), action: texts(&action) },
            data_uncertainty: 0.0,
            within_data_uncertainty: false,
        }
    }
}

/// The eigenvalue, with imaginary part ≥ 0, of a matrix of order one or two, times a power of two.
fn eigenvalue(m: &Matrix<Rational>, back: &Rational) -> Complex {
    let m = m.to_f64();
    let times = |x: f64| rational_from_f64(x).map_or(x, |x| rational_to_f64(&(x * back)));
    if m.rows() == 1 {
        return Complex::new(times(m[(0, 0)]), 0.0);
    }
    let (half, apart) = ((m[(0, 0)] + m[(1, 1)]) / 2.0, (m[(0, 0)] - m[(1, 1)]) / 2.0);
    let square = apart * apart + m[(0, 1)] * m[(1, 0)];
    match square < 0.0 {
        true => Complex::new(times(half), times((0.0 - square).sqrt())),
        false => Complex::new(times(half + square.sqrt().copysign(half)), 0.0),
    }
}
