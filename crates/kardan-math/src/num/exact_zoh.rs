//! Sampling of exact systems to many digits, with one rounding in the end.

use dashu_int::{IBig, UBig};

use kardan_rt::functions::log2;

use super::dyadic::DyadicMatrix;
use super::{Matrix, ModularMatrix, PrimeField, Random, Rational, Scalar, exponent, random_prime};

/// Binary digits of the result, in addition to those that halving and squaring cost.
const DIGITS: usize = 320;
/// Binary digits in addition to these, for the truncation of each step.
const GUARD: usize = 24;
/// log₂ of the largest sum of sizes in a row that does not count as overflow.
const LARGEST: f64 = 1000.0;
/// Above this log₂ ‖A T‖ too many digits are lost.
const FASTEST: i64 = 128;

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
/// use kardan_math::num::{Matrix, Rational, exact_zoh};
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
        let bits = a.as_slice().iter().filter(|x| !x.is_zero()).map(exponent).max().unwrap_or(-1) + exponent(time) + 2;
        let norm = bits + i64::from(n.max(1).ilog2()) + 1;
        if norm > FASTEST {
            return None;
        }
        let halvings = (norm + 1).max(0) as usize;
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
        let off = (off + exponent(&step) as f64 + 1.0).max(off_of_rise);
        Some(Self { transition, integral: integral.to_rational().scale(&step), off })
    }
}

#[cfg(test)]
#[path = "../../tests/unit/num/exact_zoh.rs"]
mod tests;
