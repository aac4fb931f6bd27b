//! A proof that a map contracts: floating point finds a norm, whole numbers show that the map shrinks it.

use dashu_int::IBig;
use faer::{Mat, Side};
use kardan_rt::functions::{exp2, log2};

use super::{Matrix, Rational, Rounding, at_zero_rounded, balance, rational_from_f64};

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
fn balanced(map: &Matrix<Rational>, off: f64) -> (Whole, f64) {
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
    (Whole { rows: n, columns: n, digits, values }, off * (n as f64).sqrt())
}

/// A norm that a map contracts.
struct Norm {
    /// A bound on the sizes of P.
    size: f64,
    /// A bound on the map in this norm, below one.
    contraction: f64,
}

/// A norm that every map contracts that is off by no more than this in Frobenius' norm; `None` where none was found.
fn contraction(map: &Whole, off: f64) -> Option<Norm> {
    let n = map.rows;
    let floating = map.to_f64();
    let sum = sum_of_powers(&floating)?;
    let factor = sum.llt(Side::Lower).ok()?;
    let factor = Whole::of(&factor.L().transpose().to_owned(), DIGITS)?;
    // P = RᵀR has no negative side, whatever R is.
    let after = factor.times(map);
    let sum = factor.transposed().times(&factor);
    let left = sum.minus(&after.transposed().times(&after)).minus(&Whole::identity(n));
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
    chains: Whole,
    rest: Whole,
    /// Bounds on A and B, and how far each block may be off.
    coupling: [f64; 2],
    off: f64,
}

impl Split {
    fn of(map: &Whole, off: f64, at_one: usize) -> Option<Self> {
        let n = map.rows;
        let floating = map.to_f64();
        let change = Matrix::from_fn(n, n, |i, j| floating[(i, j)] - f64::from(u8::from(i == j)));
        let [right, left] = [&change, &change.transpose()].map(|change| at_zero_rounded(change, Rounding::OfOne));
        let (right, left) = (right?, left?);
        if right.motions.columns() != at_one || left.motions.columns() != at_one {
            return None;
        }
        let remaining = left.right;
        let basis =
            Mat::from_fn(n, n, |i, j| if j < at_one { right.motions[(i, j)] } else { remaining[(i, j - at_one)] });
        let inverse = faer::linalg::solvers::DenseSolveCore::inverse(&basis.partial_piv_lu());
        let (basis, mut inverse) = (Whole::of(&basis, DIGITS)?, Whole::of(&inverse, DIGITS)?);
        // Newton: each step doubles the digits.
        let two = Whole::identity(n).plus(&Whole::identity(n));
        for _ in 0..2 {
            inverse = inverse.times(&two.minus(&basis.times(&inverse))).cut(3 * DIGITS);
        }
        let residual = inverse.times(&basis).minus(&Whole::identity(n)).norm();
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
            chains: block(first, first).minus(&Whole::identity(at_one)),
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
        let (mut of_chains, mut power) = (0.0, Whole::identity(self.chains.rows));
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

/// A matrix of whole multiples of 2^−digits; sums and products are exact.
#[derive(Clone)]
struct Whole {
    rows: usize,
    columns: usize,
    digits: usize,
    values: Vec<IBig>,
}

impl Whole {
    /// The floating-point result, truncated to so many digits; `None` if a number is not finite.
    fn of(matrix: &Mat<f64>, digits: usize) -> Option<Self> {
        let (rows, columns) = (matrix.nrows(), matrix.ncols());
        let value = |x: f64| {
            let x = rational_from_f64(x)?;
            Some((x.numerator() << digits) / IBig::from(x.denominator().clone()))
        };
        let places = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
        Some(Self { rows, columns, digits, values: places.map(|place| value(matrix[place])).collect::<Option<_>>()? })
    }

    fn identity(n: usize) -> Self {
        let entry = |place: usize| IBig::from(u8::from(place.is_multiple_of(n + 1)));
        Self { rows: n, columns: n, digits: 0, values: (0..n * n).map(entry).collect() }
    }

    fn times(&self, other: &Self) -> Self {
        let mut values = Vec::with_capacity(self.rows * other.columns);
        for row in self.values.chunks(self.columns) {
            for j in 0..other.columns {
                let column = other.values[j..].iter().step_by(other.columns);
                let terms = row.iter().zip(column).filter(|(a, b)| !a.is_zero() && !b.is_zero());
                values.push(terms.fold(IBig::ZERO, |sum, (a, b)| sum + a * b));
            }
        }
        Self { rows: self.rows, columns: other.columns, digits: self.digits + other.digits, values }
    }

    fn together(&self, other: &Self, of: impl Fn(IBig, IBig) -> IBig) -> Self {
        let digits = self.digits.max(other.digits);
        let [a, b] = [self, other].map(|one| one.values.iter().map(move |x| x << (digits - one.digits)));
        Self { digits, values: a.zip(b).map(|(a, b)| of(a, b)).collect(), ..*self }
    }

    fn plus(&self, other: &Self) -> Self {
        self.together(other, |a, b| a + b)
    }

    fn minus(&self, other: &Self) -> Self {
        self.together(other, |a, b| a - b)
    }

    fn transposed(&self) -> Self {
        let values = (0..self.columns).flat_map(|j| self.values[j..].iter().step_by(self.columns).cloned());
        Self { rows: self.columns, columns: self.rows, digits: self.digits, values: values.collect() }
    }

    fn block(&self, [top, bottom]: [usize; 2], [from, to]: [usize; 2]) -> Self {
        let rows = self.values.chunks(self.columns).take(bottom).skip(top);
        let values = rows.flat_map(|row| row[from..to].iter().cloned()).collect();
        Self { rows: bottom - top, columns: to - from, digits: self.digits, values }
    }

    /// With fewer digits; each entry changes by less than 2^−digits.
    fn cut(self, digits: usize) -> Self {
        let less = self.digits.saturating_sub(digits);
        Self { digits: self.digits - less, values: self.values.into_iter().map(|x| x >> less).collect(), ..self }
    }

    fn to_f64(&self) -> Mat<f64> {
        Mat::from_fn(self.rows, self.columns, |i, j| floating(&self.values[i * self.columns + j], self.digits))
    }

    /// Frobenius' norm, rounded up.
    fn norm(&self) -> f64 {
        let sum = self.values.iter().map(|x| floating(x, self.digits)).map(|x| x * x).sum::<f64>();
        sum.sqrt() * (1.0 + 1e-9) + 1e-150
    }
}

/// x 2^−digits, to rounding.
fn floating(x: &IBig, digits: usize) -> f64 {
    use dashu_int::ops::BitTest;
    let cut = x.bit_len().saturating_sub(64);
    (x >> cut).to_f64().value() * exp2(cut as f64 - digits as f64)
}
