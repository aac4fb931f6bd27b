//! Writes combinations of signals and their derivatives as text.

use kardan_math::names::signed_sum;
use kardan_math::num::{Polynomial, Rational, Scalar, rational_to_f64};

/// `wg_motor - 50 rk_motor`; `0` if all weights vanish.
pub(super) fn combination(weights: &[Rational], names: &[String]) -> String {
    let polynomials: Vec<Polynomial> = weights.iter().map(|w| Polynomial::constant(w.clone())).collect();
    sum(&polynomials, names)
}

/// `(s^2 + 2 s) rk.phi - 50 fs.phi`; `0` if all factors vanish.
pub(super) fn sum(factors: &[Polynomial], names: &[String]) -> String {
    signed_sum(factors.iter().zip(names).filter(|(f, _)| !f.is_zero()).map(|(factor, name)| {
        let terms = factor.coefficients().iter().filter(|c| !Scalar::is_zero(*c)).count();
        // A sign comes first.
        let negative = factor.coefficients().last().is_some_and(|c| *c < Rational::ZERO);
        let positive = if negative { factor.scale(&Rational::NEG_ONE) } else { factor.clone() };
        let text = positive.text(number);
        let size = if terms > 1 { format!("({text})") } else { text };
        (negative, if size == "1" { name.clone() } else { format!("{size} {name}") })
    }))
}

/// `50`, `2/3`; what needs more than twelve digits is rounded: `1.234568e15`.
fn number(x: &Rational) -> String {
    let exact = x.to_string();
    if exact.len() <= 12 {
        return exact;
    }
    let rounded = rational_to_f64(x);
    if (1e-3..1e6).contains(&rounded.abs()) { format!("{rounded:.6}") } else { format!("{rounded:.6e}") }
}

#[cfg(test)]
#[path = "../../tests/unit/inversion/notation.rs"]
mod tests;
