//! Sampling of exact systems to many digits: what is rounded once in the end.

use dashu_int::ops::BitTest;
use dashu_int::{IBig, UBig};

use kardan_rt::functions::log2;

use super::{Matrix, Polynomial, Rational, Scalar};

/// Binary digits that are kept, beyond those that halving and squaring cost.
const DIGITS: isize = 320;
/// Numbers with more binary digits before the point are taken as beyond all numbers.
const LARGEST: isize = 4096;
/// Beyond this ‖A T‖ too many digits are lost.
const FASTEST: isize = 128;
/// Terms of the series: ‖A t‖ is at most 1/2, so the rest is below 2⁻¹⁴⁰⁰.
const TERMS: i64 = 200;
/// Terms that are always added up: the rest is below 2⁻⁴⁰⁰.
const FEWEST: i64 = 79;

/// How many binary digits a number has before the point, negative behind it.
fn size(x: &Rational) -> isize {
    let length = |bits: usize| isize::try_from(bits).unwrap_or(isize::MAX);
    length(x.numerator().bit_len()) - length(x.denominator().bit_len())
}

/// The number with its leading digits; itself if it has no more.
fn leading(x: &Rational, digits: isize) -> Rational {
    if x.is_zero() || x.numerator().bit_len().max(x.denominator().bit_len()) <= digits.unsigned_abs() {
        return x.clone();
    }
    let shift = digits - size(x);
    let (up, down) = (UBig::ONE << shift.max(0).unsigned_abs(), UBig::ONE << (-shift).max(0).unsigned_abs());
    let whole = x.numerator() * IBig::from(up.clone()) / IBig::from(x.denominator() * &down);
    Rational::from_parts(whole * IBig::from(down), up)
}

fn shortened(matrix: &Matrix<Rational>, digits: isize) -> Matrix<Rational> {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| leading(&matrix[(i, j)], digits))
}

/// `[e^{AT}, ∫₀ᵀ e^{At} dt]` of an exact square matrix, to far more digits than those of a double; exact where the series ends and its
/// fractions are short.
///
/// Method: the series of the integral over T/2ˢ, `e^{AT} = 1 + A ∫`, s doublings. `None` if the result is beyond all numbers.
///
/// ```
/// use kardan::num::{Matrix, Rational, held};
/// // A double integrator: the series ends.
/// let a = Matrix::from_fn(2, 2, |i, j| Rational::from(u8::from((i, j) == (0, 1))));
/// let third = Rational::from_parts(1.into(), 3u8.into());
/// let [transition, integral] = held(&a, &third).unwrap();
/// assert_eq!((&transition[(0, 1)], &integral[(0, 1)]), (&third, &(&third * &third / Rational::from(2))));
/// ```
///
/// # Panics
/// If the matrix is not square.
pub fn held(a: &Matrix<Rational>, time: &Rational) -> Option<[Matrix<Rational>; 2]> {
    let HeldTo { transition, integral, .. } = HeldTo::new(a, time, DIGITS)?;
    Some([transition, integral])
}

/// The result of [`held`], and how far it may be off.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldTo {
    /// `e^{AT}`
    pub transition: Matrix<Rational>,
    /// `∫₀ᵀ e^{At} dt`
    pub integral: Matrix<Rational>,
    /// log₂ of a bound on the error of the integral, in the largest sum of sizes in a row; −∞ where it is exact. That of the transition is ‖A‖
    /// times as large.
    pub off: f64,
}

impl HeldTo {
    /// To so many binary digits in each step; `None` if the result is beyond all numbers.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn new(a: &Matrix<Rational>, time: &Rational, digits: isize) -> Option<Self> {
        let n = a.rows();
        assert_eq!(n, a.columns(), "sampling of a matrix that is not square");
        let one = Matrix::<Rational>::identity(n);
        let all = a.scale(time);
        // The largest sum of sizes in a row is below 2^norm.
        let bits = all.as_slice().iter().filter(|x| !x.is_zero()).map(size).max().unwrap_or(-1) + 2;
        let norm = bits + isize::try_from(n.max(1).ilog2()).unwrap_or(0) + 1;
        let halvings = (norm + 1).max(0).unsigned_abs();
        if norm > FASTEST {
            return None;
        }
        let step = time / Rational::from(UBig::ONE << halvings);
        let small = a.scale(&step);
        let mut term = one.scale(&step);
        let (mut integral, mut exact) = (term.clone(), false);
        let mut whole = true;
        for k in 2..TERMS {
            let next = small.multiply(&term).scale(&Rational::from_parts(IBig::ONE, UBig::from(k.unsigned_abs())));
            term = shortened(&next, digits);
            whole &= term == next;
            integral = integral.plus(&term);
            if term.as_slice().iter().all(Scalar::is_zero) {
                exact = whole;
                break;
            }
            let is_small = |x: &Rational| x.is_zero() || size(x) < size(&step) - digits - 8;
            if k >= FEWEST && term.as_slice().iter().all(is_small) {
                break;
            }
        }
        let digit = |digits: isize| 2.0 - digits as f64;
        let mut off = if exact { f64::NEG_INFINITY } else { size(&step) as f64 + 8.0 + digit(digits) };
        let size_of_a = log_norm(a)?;
        let transition = |integral: &Matrix<Rational>| one.plus(&a.multiply(integral));
        for _ in 0..halvings {
            // ∫ over twice the time: what comes first goes on for the time.
            let longer = transition(&integral).plus(&one);
            let next = longer.multiply(&integral);
            let (before, over) = (log_norm(&integral)?, log_norm(&longer)?);
            integral = shortened(&next, digits);
            if integral.as_slice().iter().any(|x| !x.is_zero() && size(x) > LARGEST) {
                return None;
            }
            // (‖T + 1‖ + ‖A‖ off) off + ‖A‖ off ‖∫‖, each below the largest, and the digits that are cut.
            off = over.max(size_of_a + off).max(size_of_a + before) + off + 2.0;
            if integral != next {
                off = off.max(log_norm(&next)? + digit(digits)) + 1.0;
            }
        }
        Some(Self { transition: transition(&integral), integral, off })
    }
}

/// log₂ of the largest sum of sizes in a row, rounded up; `None` if that is beyond doubles.
fn log_norm(matrix: &Matrix<Rational>) -> Option<f64> {
    let row = |i: usize| matrix.row(i).iter().map(|x| super::rational_to_f64(x).abs()).sum::<f64>();
    let largest = (0..matrix.rows()).map(row).fold(0.0, f64::max);
    largest.is_finite().then(|| log2(largest * (1.0 + 1e-9)))
}

/// The characteristic polynomial `det(s − A)`, exact.
///
/// Method: Faddeev and Leverrier, n products of matrices.
///
/// ```
/// use kardan::num::{Matrix, Rational, characteristic};
/// let a = Matrix::from_fn(2, 2, |i, j| Rational::from([[1, 2], [3, 4]][i][j]));
/// assert_eq!(characteristic(&a).coefficients(), [-2, -5, 1].map(Rational::from));
/// ```
///
/// # Panics
/// If the matrix is not square.
pub fn characteristic(a: &Matrix<Rational>) -> Polynomial {
    let n = a.rows();
    let mut coefficients = vec![Rational::ONE];
    let mut product = Matrix::<Rational>::zeros(n, n);
    for k in 1..=n {
        let last = coefficients[k - 1].clone();
        product = a.multiply(&product.plus(&Matrix::identity(n).scale(&last)));
        let trace = (0..n).fold(Rational::ZERO, |sum, i| sum.plus(&product[(i, i)]));
        coefficients.push(Rational::ZERO.minus(&trace) / Rational::from(k));
    }
    coefficients.reverse();
    Polynomial::new(coefficients)
}

#[cfg(test)]
mod tests {
    use kardan_rt::functions::{cos, exp, sin};

    use super::*;
    use crate::num::rational_to_f64;

    fn rational(numerator: i64, denominator: u64) -> Rational {
        Rational::from_parts(numerator.into(), denominator.into())
    }

    /// A decay and a turn have closed forms; both functions as they are, at a long and a short time.
    #[test]
    fn decays_and_turns_are_their_closed_forms() {
        for time in [rational(1, 1000), rational(3, 2), rational(40, 1)] {
            let t = rational_to_f64(&time);
            let decay = Matrix::from_fn(1, 1, |_, _| rational(-7, 3));
            let [e, integral] = held(&decay, &time).unwrap();
            let expected = exp(-7.0 * t / 3.0);
            assert!((rational_to_f64(&e[(0, 0)]) / expected - 1.0).abs() < 1e-13);
            assert!((rational_to_f64(&integral[(0, 0)]) - (1.0 - expected) * 3.0 / 7.0).abs() < 1e-15);
            let turn = Matrix::from_fn(2, 2, |i, j| rational([[0, 2], [-2, 0]][i][j], 1));
            let [e, integral] = held(&turn, &time).unwrap();
            let (sine, cosine) = (sin(2.0 * t), cos(2.0 * t));
            assert!((rational_to_f64(&e[(0, 1)]) - sine).abs() < 1e-14 * (1.0 + t));
            assert!((rational_to_f64(&integral[(0, 0)]) - sine / 2.0).abs() < 1e-14 * (1.0 + t));
            assert!((rational_to_f64(&integral[(0, 1)]) - (1.0 - cosine) / 2.0).abs() < 1e-14 * (1.0 + t));
            // cos² + sin² = 1 to far more digits than those of a double.
            let one = e[(0, 0)].times(&e[(0, 0)]).plus(&e[(0, 1)].times(&e[(0, 1)]));
            assert!(rational_to_f64(&one.minus(&Rational::ONE)).abs() < 1e-80);
        }
    }

    /// A stiff one, and one that grows beyond all numbers.
    #[test]
    fn fast_decays_vanish_and_growth_beyond_numbers_is_told() {
        let a = |x: i64| Matrix::from_fn(2, 2, |i, j| rational([[x, 1], [0, -1]][i][j], 1));
        let [e, integral] = held(&a(-1_000_000), &Rational::ONE).unwrap();
        assert!(rational_to_f64(&e[(0, 0)]).abs() < 1e-60);
        assert!((rational_to_f64(&integral[(0, 0)]) - 1e-6).abs() < 1e-20);
        assert!(held(&a(1_000_000), &Rational::ONE).is_none());
        let [e, _] = held(&a(3), &Rational::ONE).unwrap();
        // The closed form of a triangle.
        let expected = [exp(3.0), (exp(3.0) - exp(-1.0)) / 4.0, 0.0, exp(-1.0)];
        for (exact, expected) in e.to_f64().as_slice().iter().zip(expected) {
            assert!((exact - expected).abs() <= 1e-15 * expected, "{exact} for {expected}");
        }
    }
}
