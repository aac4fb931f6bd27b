//! Routh's table of a polynomial, exact.

use super::{Polynomial, Rational, Scalar};

/// The first column of Routh's table of a polynomial, times a factor that makes its leading coefficient positive, down to the first number that is
/// not above zero.
///
/// All roots lie in the open left half-plane if and only if there are n + 1 numbers above zero (Routh, Stability of a given state of motion,
/// 1877; Gantmacher, Theory of matrices II, ch. XV). Cost: O(n²) operations.
///
/// ```
/// use kardan_math::num::{Polynomial, Rational, routh_column};
/// let column = |list: &[i64]| routh_column(&Polynomial::new(list.iter().map(|&x| Rational::from(x)).collect()));
/// let numbers = |list: &[i64]| list.iter().map(|&x| Rational::from(x)).collect::<Vec<_>>();
/// // s² + 3 s + 2, s² + 1, −s² + s − 1 (the same as s² − s + 1).
/// assert_eq!(column(&[2, 3, 1]), numbers(&[1, 3, 2]));
/// assert_eq!(column(&[1, 0, 1]), numbers(&[1, 0]));
/// assert_eq!(column(&[-1, 1, -1]), numbers(&[1, -1]));
/// ```
pub fn routh_column(polynomial: &Polynomial) -> Vec<Rational> {
    let negated = polynomial.coefficients().last().is_some_and(|leading| *leading < Rational::ZERO);
    let coefficients: Vec<Rational> =
        polynomial.coefficients().iter().rev().map(|x| if negated { -x.clone() } else { x.clone() }).collect();
    // Coefficients of every other power, highest first.
    let row = |offset: usize| coefficients.iter().skip(offset).step_by(2).cloned().collect::<Vec<_>>();
    let (mut upper, mut lower) = (row(0), row(1));
    let mut column: Vec<Rational> = upper.first().cloned().into_iter().collect();
    for _ in 0..polynomial.degree() {
        let lead = lower.first().cloned().unwrap_or(Rational::ZERO);
        column.push(lead.clone());
        if lead <= Rational::ZERO {
            break;
        }
        let factor = upper[0].over(&lead);
        let next = |k: usize| upper[k].minus(&factor.times(lower.get(k).unwrap_or(&Rational::ZERO)));
        let next = (1..upper.len()).map(next).collect();
        upper = std::mem::replace(&mut lower, next);
    }
    column
}

#[cfg(test)]
#[path = "../../tests/unit/num/routh.rs"]
mod tests;
