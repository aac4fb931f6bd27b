//! Exact poles and their polynomial.

use kardan_math::num::{Matrix, Polynomial, Rational, Scalar, rational_to_f64};
use kardan_results::Pole;

/// An exact pole (real part, imaginary part), 1/s.
pub type ExactPole = (Rational, Rational);

/// `Π (s − pole)`; the error is a pole without its conjugate, the last one.
pub(crate) fn product(poles: &[ExactPole]) -> Result<Polynomial, ExactPole> {
    let mut out = Polynomial::constant(Rational::ONE);
    let mut open = poles.to_vec();
    while let Some((re, im)) = open.pop() {
        if im.is_zero() {
            out = out.times(&Polynomial::new(vec![Rational::ZERO.minus(&re), Rational::ONE]));
            continue;
        }
        let Some(at) = open.iter().position(|candidate| candidate.0 == re && candidate.1.plus(&im).is_zero()) else {
            return Err((re, im));
        };
        open.remove(at);
        let size = re.times(&re).plus(&im.times(&im));
        out = out.times(&Polynomial::new(vec![size, Rational::from(-2).times(&re), Rational::ONE]));
    }
    Ok(out)
}

/// `p(A) v`.
pub(crate) fn at_matrix(p: &Polynomial, a: &Matrix<Rational>, v: &Matrix<Rational>) -> Matrix<Rational> {
    let mut coefficients = p.coefficients().iter().rev();
    let first = coefficients.next().cloned().unwrap_or(Rational::ZERO);
    coefficients.fold(v.scale(&first), |sum, c| a.multiply(&sum).plus(&v.scale(c)))
}

/// Rounded.
pub(crate) fn floats(poles: &[ExactPole]) -> Vec<Pole> {
    poles.iter().map(|(re, im)| Pole::new(rational_to_f64(re), rational_to_f64(im))).collect()
}
