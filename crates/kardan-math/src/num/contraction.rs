//! A proof that a map contracts: floating point finds a norm, whole numbers show that the map shrinks it.

use dashu_int::IBig;
use faer::{Mat, Side};
use kardan_rt::functions::{exp2, log2};

use super::dyadic::DyadicMatrix;
use super::{Matrix, Rational, Rounding, at_zero, balance};

/// Binary digits after the point to which the floating-point result is truncated.
const DIGITS: usize = 100;
/// Doublings of the series of Stein's equation: motions that decay by less over 2⁴⁰ periods are left undecided.
const DOUBLINGS: usize = 40;

/// Whether all eigenvalues of a map lie inside the unit circle, but for those that are known to be exactly at one. `false` where that
/// is not shown, such as for slow decays next to large numbers.
///
/// The true map differs from `map` by less than 2^`off` in the largest sum of sizes in a row. Method: Stein's inequality. With P from the
/// sum of `(Φᵀ)ᵏ Φᵏ` in floating point and `M = P − ΦᵀPΦ` in whole numbers, `‖M − 1‖ < 1/2` shows that Φ contracts the norm of P. The part at
/// one is split off before; the remaining coupling bounds how far the others may move (Rouché for determinants).
///
/// # Panics
/// If the matrix is not square.
pub fn contracts(map: &Matrix<Rational>, off: f64, at_one: usize) -> bool {
    assert_eq!(map.rows(), map.columns(), "eigenvalues of a matrix that is not square");
    if at_one >= map.rows() {
        return at_one == map.rows();
    }
    let (map, off) = balanced(map, off);
    match at_one {
        0 => contraction(&map, off).is_some(),
        _ => Split::of(&map, off, at_one).is_some_and(|split| split.keeps_apart()),
    }
}

/// The map in balanced coordinates, and a bound on how far it is off, in Frobenius' norm.
fn balanced(map: &Matrix<Rational>, off: f64) -> (DyadicMatrix, f64) {
    let n = map.rows();
    let floating = map.to_f64();
    let scales = balance(&Mat::from_fn(n, n, |i, j| floating[(i, j)]));
    let power = |scale: f64| log2(scale).round() as isize;
    // As many digits as are known, and enough that truncation is negligible.
    let digits = 2 * DIGITS + (-off).clamp(0.0, 1e4) as usize;
    let value = |i: usize, j: usize| {
        let x = &map[(i, j)];
        let shift = digits as isize + power(scales[j]) - power(scales[i]);
        let scaled =
            if shift >= 0 { x.numerator() << shift.unsigned_abs() } else { x.numerator() >> shift.unsigned_abs() };
        scaled / IBig::from(x.denominator().clone())
    };
    let values = (0..n * n).map(|place| value(place / n, place % n)).collect();
    let extremes = scales.iter().fold([f64::INFINITY, 0.0_f64], |[low, high], s| [low.min(*s), high.max(*s)]);
    let off = exp2(off + log2(extremes[1] / extremes[0])) + exp2(1.0 - digits as f64) * n as f64;
    (DyadicMatrix { rows: n, columns: n, digits, values }, off * (n as f64).sqrt())
}

/// A norm that a map contracts.
struct Norm {
    /// A bound on the sizes of P.
    size: f64,
    /// A bound on the map in this norm, below one.
    contraction: f64,
}

/// A norm that every map contracts that is off by no more than this in Frobenius' norm; `None` where none was found.
fn contraction(map: &DyadicMatrix, off: f64) -> Option<Norm> {
    let n = map.rows;
    let floating = map.to_f64();
    let sum = sum_of_powers(&floating)?;
    let factor = sum.llt(Side::Lower).ok()?;
    let factor = DyadicMatrix::of_f64(&factor.L().transpose().to_owned(), DIGITS)?;
    // P = RᵀR has no negative side, whatever R is.
    let after = factor.times(map);
    let sum = factor.transposed().times(&factor);
    let left = sum.minus(&after.transposed().times(&after)).minus(&DyadicMatrix::identity(n));
    let size = sum.norm();
    let residual_norm = left.norm() + size * off * (2.0 * map.norm() + off);
    // M ≥ 1/2, so that xᵀΦᵀPΦx ≤ xᵀPx − xᵀx/2.
    (residual_norm < 0.5).then(|| Norm { size, contraction: (1.0 - 0.49 / size).max(0.0).sqrt() })
}

/// `Σ (Φᵀ)ᵏ Φᵏ`, to rounding; `None` if it does not end.
fn sum_of_powers(map: &Mat<f64>) -> Option<Mat<f64>> {
    let n = map.nrows();
    let (mut sum, mut power) = (Mat::<f64>::identity(n, n), map.clone());
    for _ in 0..DOUBLINGS {
        sum = &sum + power.transpose() * &sum * &power;
        power = &power * &power;
        let size = power.norm_l2();
        if !size.is_finite() || !sum.norm_l2().is_finite() {
            return None;
        }
        if size < 1e-20 {
            return Some(sum);
        }
    }
    None
}

/// A map in coordinates in which the eigenvalues at one come first: `[[J, A], [B, rest]]`, with negligible couplings A and B.
struct Split {
    /// J − 1
    chains: DyadicMatrix,
    rest: DyadicMatrix,
    /// Bounds on A and B, and how far each block may be off.
    coupling: [f64; 2],
    off: f64,
}

impl Split {
    fn of(map: &DyadicMatrix, off: f64, at_one: usize) -> Option<Self> {
        let n = map.rows;
        let floating = map.to_f64();
        let change = Matrix::from_fn(n, n, |i, j| floating[(i, j)] - f64::from(u8::from(i == j)));
        let [right, left] = [&change, &change.transpose()].map(|change| at_zero(change, Rounding::OfOne));
        let (right, left) = (right?, left?);
        if right.motions.columns() != at_one || left.motions.columns() != at_one {
            return None;
        }
        let remaining = left.right;
        let basis =
            Mat::from_fn(n, n, |i, j| if j < at_one { right.motions[(i, j)] } else { remaining[(i, j - at_one)] });
        let inverse = faer::linalg::solvers::DenseSolveCore::inverse(&basis.partial_piv_lu());
        let (basis, mut inverse) = (DyadicMatrix::of_f64(&basis, DIGITS)?, DyadicMatrix::of_f64(&inverse, DIGITS)?);
        // Newton: each step doubles the digits.
        let two = DyadicMatrix::identity(n).plus(&DyadicMatrix::identity(n));
        for _ in 0..2 {
            inverse = inverse.times(&two.minus(&basis.times(&inverse))).cut(3 * DIGITS);
        }
        let residual = inverse.times(&basis).minus(&DyadicMatrix::identity(n)).norm();
        let transformed = inverse.times(map).times(&basis).cut(map.digits + DIGITS);
        // V⁻¹ = (WV)⁻¹ W, and the map itself is off.
        let off = (residual * transformed.norm() + inverse.norm() * basis.norm() * off) / (1.0 - residual)
            + exp2(-(map.digits as f64)) * n as f64;
        if !(residual < 0.5 && off.is_finite()) {
            return None;
        }
        let block = |rows: [usize; 2], columns: [usize; 2]| transformed.block(rows, columns);
        let (first, second) = ([0, at_one], [at_one, n]);
        Some(Self {
            chains: block(first, first).minus(&DyadicMatrix::identity(at_one)),
            rest: block(second, second),
            coupling: [block(first, second), block(second, first)].map(|coupling| coupling.norm() + off),
            off,
        })
    }

    /// Whether a circle inside the unit circle separates the eigenvalues at one from the rest.
    ///
    /// On it, of radius r, `z − J` and `z − rest` are regular, and so are both together while the product of their inverses with the couplings is
    /// below one. So as many eigenvalues lie inside as the rest has.
    fn keeps_apart(&self) -> bool {
        let Some(norm) = contraction(&self.rest, self.off) else { return false };
        let gap = (1.0 - norm.contraction) / 2.0 * (1.0 - 1e-9);
        // M ≥ 1/2 bounds P from below.
        let of_rest = (2.0 * norm.size).sqrt() / gap;
        // 1/(z − 1 − N) = Σ Nᵏ/(z − 1)ᵏ⁺¹, of chains that are off.
        let (mut of_chains, mut power) = (0.0, DyadicMatrix::identity(self.chains.rows));
        let (mut bound, size) = (1.0, self.chains.norm() + self.off);
        for k in 0..self.chains.rows {
            of_chains += bound / exp2((k + 1) as f64 * log2(gap));
            power = power.times(&self.chains);
            // (N + E)ᵏ⁺¹ differs by less than (k + 1) ‖E‖ ‖N‖ᵏ.
            let differs = (k + 1) as f64 * self.off * exp2(k as f64 * log2(size.max(1e-300)));
            bound = power.norm() + differs;
        }
        let left = bound / exp2(self.chains.rows as f64 * log2(gap));
        left < 0.5 && of_rest * (2.0 * of_chains) * self.coupling[0] * self.coupling[1] < 0.5
    }
}
