//! Exact poles and their polynomial.

use kardan_math::num::{Polynomial, Rational, Scalar, rational_to_f64};
use kardan_results::Pole;

/// An exact pole (real part, imaginary part), 1/s.
pub type ExactPole = (Rational, Rational);

/// `Π (s − pole)`; `None` if the poles are not self-conjugate.
pub(crate) fn product(poles: &[ExactPole]) -> Option<Polynomial> {
    let mut out = Polynomial::constant(Rational::ONE);
    let mut open: Vec<&ExactPole> = Vec::new();
    for pole in poles {
        let (re, im) = pole;
        if im.is_zero() {
            out = out.times(&Polynomial::new(vec![Rational::ZERO.minus(re), Rational::ONE]));
        } else if let Some(at) = open.iter().position(|candidate| candidate.0 == *re && candidate.1.plus(im).is_zero())
        {
            open.swap_remove(at);
            let size = re.times(re).plus(&im.times(im));
            out = out.times(&Polynomial::new(vec![size, Rational::from(-2).times(re), Rational::ONE]));
        } else {
            open.push(pole);
        }
    }
    open.is_empty().then_some(out)
}

/// Rounded.
pub(crate) fn floats(poles: &[ExactPole]) -> Vec<Pole> {
    poles.iter().map(|(re, im)| Pole::new(rational_to_f64(re), rational_to_f64(im))).collect()
}
