//! Sampling of exact systems to many digits, with one rounding in the end.

use dashu_int::ops::BitTest;
use dashu_int::{IBig, UBig};

use kardan_rt::functions::log2;

use super::dyadic::DyadicMatrix;
use super::{Matrix, ModularMatrix, Polynomial, PrimeField, Random, Rational, Scalar, random_prime};

/// Binary digits of the result, in addition to those that halving and squaring cost.
const DIGITS: usize = 320;
/// Binary digits in addition to these, for the truncation of each step.
const GUARD: usize = 24;
/// log₂ of the largest sum of sizes in a row that does not count as overflow.
const LARGEST: f64 = 1000.0;
/// Above this log₂ ‖A T‖ too many digits are lost.
const FASTEST: isize = 128;

/// How many binary digits a number has before the point, negative behind it.
fn size(x: &Rational) -> isize {
    let length = |bits: usize| isize::try_from(bits).unwrap_or(isize::MAX);
    length(x.numerator().bit_len()) - length(x.denominator().bit_len())
}

/// Whether the series may end: the powers of a matrix do where its n-th one is zero, modulo any prime too.
fn may_end(a: &Matrix<Rational>) -> bool {
    let field = PrimeField::new(random_prime(&mut Random::unforeseen(1)));
    let Some(mut power) = ModularMatrix::from_rational(&field, a) else { return true };
    for _ in 0..a.rows().max(1).next_power_of_two().ilog2() {
        power = power.multiply(&field, &power);
    }
    (0..a.rows()).all(|i| power.row(i).iter().all(|x| *x == 0))
}

/// The sums `[Σ A^k T^k/k!, Σ A^k T^(k+1)/(k+1)!]` of a series that ends; `None` if it does not.
fn ending(a: &Matrix<Rational>, time: &Rational) -> Option<[Matrix<Rational>; 2]> {
    let n = a.rows();
    let mut term = Matrix::<Rational>::identity(n);
    let mut sums = [term.clone(), term.scale(time)];
    for k in 1..=n {
        term = a.multiply(&term).scale(&(time / Rational::from(k)));
        sums[0] = sums[0].plus(&term);
        sums[1] = sums[1].plus(&term.scale(&(time / Rational::from(k + 1))));
    }
    term.as_slice().iter().all(Scalar::is_zero).then_some(sums)
}

/// `[e^{AT}, ∫₀ᵀ e^{At} dt]` of an exact square matrix, to far more digits than those of a double; exact where the series ends.
///
/// Method: the series over T/2ˢ, s doublings. `None` if the result overflows.
///
/// ```
/// use kardan::num::{Matrix, Rational, exact_zoh};
/// // A double integrator: the series ends.
/// let a = Matrix::from_fn(2, 2, |i, j| Rational::from(u8::from((i, j) == (0, 1))));
/// let third = Rational::from_parts(1.into(), 3u8.into());
/// let [transition, integral] = exact_zoh(&a, &third).unwrap();
/// assert_eq!((&transition[(0, 1)], &integral[(0, 1)]), (&third, &(&third * &third / Rational::from(2))));
/// ```
///
/// # Panics
/// If the matrix is not square.
pub fn exact_zoh(a: &Matrix<Rational>, time: &Rational) -> Option<[Matrix<Rational>; 2]> {
    let ExactZoh { transition, integral, .. } = ExactZoh::new(a, time, DIGITS)?;
    Some([transition, integral])
}

/// The result of [`exact_zoh`], and how far it may be off.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactZoh {
    /// `e^{AT}`
    pub transition: Matrix<Rational>,
    /// `∫₀ᵀ e^{At} dt`
    pub integral: Matrix<Rational>,
    /// log₂ of a bound on the errors of both, in the largest sum of sizes in a row; −∞ where they are exact.
    pub off: f64,
}

impl ExactZoh {
    /// To so many binary digits in each step; `None` if the result overflows.
    ///
    /// Method: with S = A T/2ˢ, of norm 1/2 at most, `J = Σ Sᵏ/(k+1)!` and `E = S J = e^S − 1`; over double the time they are `(E + 2) J` and
    /// `(E + 2) E`, so that no product with A loses digits.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn new(a: &Matrix<Rational>, time: &Rational, digits: usize) -> Option<Self> {
        let n = a.rows();
        assert_eq!(n, a.columns(), "sampling of a matrix that is not square");
        if let Some([transition, integral]) = may_end(a).then(|| ending(a, time)).flatten() {
            return Some(Self { transition, integral, off: f64::NEG_INFINITY });
        }
        // The largest sum of sizes in a row is below 2^norm.
        let bits = a.as_slice().iter().filter(|x| !x.is_zero()).map(size).max().unwrap_or(-1) + size(time) + 2;
        let norm = bits + isize::try_from(n.max(1).ilog2()).unwrap_or(0) + 1;
        if norm > FASTEST {
            return None;
        }
        let halvings = (norm + 1).max(0).unsigned_abs();
        let step = time / Rational::from(UBig::ONE << halvings);
        let digits = digits + GUARD + 2 * halvings;
        let small = DyadicMatrix::of(&a.scale(&step), digits);
        let mut term = DyadicMatrix::identity(n);
        let mut integral = term.clone();
        let mut terms = 1;
        while !term.values.iter().all(|x| x.is_zero() || *x == IBig::NEG_ONE) {
            terms += 1;
            term = small.times(&term).cut(digits).over(terms);
            integral = integral.plus(&term);
        }
        let mut rise = small.times(&integral).cut(digits);
        // S is off by n units, and each term by 2 n at most: a product cuts off n, a quotient too, and half of what S and the term before are off.
        let unit = log2(n.max(1) as f64) - digits as f64;
        let [mut off, mut off_of_rise] = [unit + log2(2.0 * terms as f64 + 2.0); 2];
        let two = DyadicMatrix::identity(n).plus(&DyadicMatrix::identity(n));
        for _ in 0..halvings {
            let longer = rise.plus(&two);
            let (over, before) = (log2(longer.row_norm()), log2(integral.row_norm().max(rise.row_norm()).max(1.0)));
            (integral, rise) = (longer.times(&integral).cut(digits), longer.times(&rise).cut(digits));
            if before.max(over) > LARGEST {
                return None;
            }
            // ‖E + 2‖ off + ‖J‖ off_E and ‖E + 2‖ off_E + ‖E‖ off_E, what both are off together, and the digits that are cut.
            off = (over + off).max(before + off_of_rise).max(unit) + 2.0;
            off_of_rise = over.max(before) + off_of_rise.max(unit) + 2.0;
        }
        let transition = DyadicMatrix::identity(n).plus(&rise).to_rational();
        let off = (off + size(&step) as f64 + 1.0).max(off_of_rise);
        Some(Self { transition, integral: integral.to_rational().scale(&step), off })
    }
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
            let [e, integral] = exact_zoh(&decay, &time).unwrap();
            let expected = exp(-7.0 * t / 3.0);
            assert!((rational_to_f64(&e[(0, 0)]) / expected - 1.0).abs() < 1e-13);
            assert!((rational_to_f64(&integral[(0, 0)]) - (1.0 - expected) * 3.0 / 7.0).abs() < 1e-15);
            let turn = Matrix::from_fn(2, 2, |i, j| rational([[0, 2], [-2, 0]][i][j], 1));
            let [e, integral] = exact_zoh(&turn, &time).unwrap();
            let (sine, cosine) = (sin(2.0 * t), cos(2.0 * t));
            assert!((rational_to_f64(&e[(0, 1)]) - sine).abs() < 1e-14 * (1.0 + t));
            assert!((rational_to_f64(&integral[(0, 0)]) - sine / 2.0).abs() < 1e-14 * (1.0 + t));
            assert!((rational_to_f64(&integral[(0, 1)]) - (1.0 - cosine) / 2.0).abs() < 1e-14 * (1.0 + t));
            // cos² + sin² = 1 to far more digits than those of a double.
            let one = e[(0, 0)].times(&e[(0, 0)]).plus(&e[(0, 1)].times(&e[(0, 1)]));
            assert!(rational_to_f64(&one.minus(&Rational::ONE)).abs() < 1e-80);
        }
    }

    /// A stiff one, and one that overflows.
    #[test]
    fn fast_decays_vanish_and_growth_beyond_numbers_is_reported() {
        let a = |x: i64| Matrix::from_fn(2, 2, |i, j| rational([[x, 1], [0, -1]][i][j], 1));
        let [e, integral] = exact_zoh(&a(-1_000_000), &Rational::ONE).unwrap();
        assert!(rational_to_f64(&e[(0, 0)]).abs() < 1e-60);
        assert!((rational_to_f64(&integral[(0, 0)]) - 1e-6).abs() < 1e-20);
        assert!(exact_zoh(&a(1_000_000), &Rational::ONE).is_none());
        let [e, _] = exact_zoh(&a(3), &Rational::ONE).unwrap();
        // The closed form of a triangle.
        let expected = [exp(3.0), (exp(3.0) - exp(-1.0)) / 4.0, 0.0, exp(-1.0)];
        for (exact, expected) in e.to_f64().as_slice().iter().zip(expected) {
            assert!((exact - expected).abs() <= 1e-15 * expected, "{exact} for {expected}");
        }
    }

    /// A result with few digits differs from one with many by at most its bound, and not by much less; double the time gives the square.
    #[test]
    fn errors_stay_within_their_bounds() {
        let mut random = Random::new(4);
        for n in 1..7 {
            for (time, spread) in [(rational(1, 1000), 40), (rational(3, 2), 9), (rational(50, 1), 3)] {
                let a = Matrix::from_fn(n, n, |_, _| rational(random.small(spread), 7));
                let [coarse, many] = [100, 400].map(|digits| ExactZoh::new(&a, &time, digits).unwrap());
                let doubled = ExactZoh::new(&a, &(&time + &time), 400).unwrap();
                let norm = |matrix: &Matrix<Rational>| {
                    let row = |i: usize| matrix.row(i).iter().map(|x| rational_to_f64(x).abs()).sum::<f64>();
                    log2((0..n).map(row).fold(0.0, f64::max))
                };
                let difference = |a: &Matrix<Rational>, b: &Matrix<Rational>| norm(&a.plus(&b.scale(&-Rational::ONE)));
                let found =
                    difference(&coarse.transition, &many.transition).max(difference(&coarse.integral, &many.integral));
                assert!(
                    found < coarse.off && coarse.off < 40.0 - 100.0 + 3.0 * norm(&many.transition).max(0.0),
                    "{n} {time}: 2^{found} {}",
                    coarse.off
                );
                let square = many.transition.multiply(&many.transition);
                assert!(
                    difference(&square, &doubled.transition)
                        < doubled.off.max(many.off) + norm(&many.transition).max(0.0) + 3.0
                );
            }
        }
    }

    /// Nilpotent powers are summed up exactly, for any place of the entries.
    #[test]
    fn series_that_end_are_exact() {
        // S N S⁻¹ with N³ = 0.
        let shift = Matrix::from_fn(3, 3, |i, j| Rational::from(u8::from(j == i + 1)));
        let change = Matrix::from_fn(3, 3, |i, j| Rational::from([[1, 2, 0], [3, 1, 1], [0, 1, 2]][i][j]));
        let a = change.multiply(&shift).multiply(&change.solve(&Matrix::identity(3)).unwrap());
        let time = rational(1, 3);
        let found = ExactZoh::new(&a, &time, 60).unwrap();
        let one = Matrix::identity(3);
        let squared = a.multiply(&a);
        let expected = one.plus(&a.scale(&time)).plus(&squared.scale(&rational(1, 18)));
        assert_eq!((found.off, &found.transition), (f64::NEG_INFINITY, &expected));
        let expected = one.scale(&time).plus(&a.scale(&rational(1, 18))).plus(&squared.scale(&rational(1, 162)));
        assert_eq!(found.integral, expected);
    }
}
