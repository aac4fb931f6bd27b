//! The required dynamics of decoupled channels, and their feedback.

use crate::exact_poles::{ExactPole, product};
use kardan_math::num::{Polynomial, Rational, Scalar};

/// The required dynamics of a channel: its output follows the reference with the poles of a polynomial p_i,
/// `p_i(d/dt) y_i = p_i(0) r_i` \[diss. (6.91), (6.94)\].
#[derive(Debug, Clone, PartialEq)]
pub enum Compensation {
    /// Natural frequency ω (rad/s) and damping ratio ξ: `s² + 2ξω s + ω²` for degree 2, times `(s + ω)^(r−2)` beyond, `s + ω`
    /// for degree 1.
    SecondOrder {
        /// ω > 0, rad/s.
        natural_frequency: Rational,
        /// ξ > 0.
        damping_ratio: Rational,
    },
    /// Crossover frequency ω (rad/s): `(s + ω)^r`.
    FirstOrder {
        /// ω > 0, rad/s.
        frequency: Rational,
    },
    /// Poles as (real part, imaginary part), 1/s, both of a pair.
    Poles(Vec<ExactPole>),
}

/// Why there is no such polynomial.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompensationError {
    /// A frequency or damping ratio is zero or negative.
    #[error("the {what} must be positive, it is {value}")]
    NotPositive {
        /// `natural frequency`, `damping ratio`, `frequency`.
        what: &'static str,
        /// Its value.
        value: Rational,
    },
    /// Another number of poles than the relative degree.
    #[error("the channel has relative degree {degree} and needs as many poles, there are {poles}")]
    Count {
        /// Relative degree.
        degree: usize,
        /// Number of poles given.
        poles: usize,
    },
    /// A complex pole without its conjugate (as often as the pole itself).
    #[error("the conjugate of the pole {real} + {imaginary} j is missing")]
    NoConjugate {
        /// Real part.
        real: Rational,
        /// Imaginary part.
        imaginary: Rational,
    },
    /// A pole that does not decay.
    #[error("the pole with real part {real} is not stable; the real part must be negative")]
    NotStable {
        /// Real part.
        real: Rational,
    },
}

impl Compensation {
    /// The monic polynomial of a channel with that relative degree; 1 for degree 0, where the output is the reference.
    ///
    /// ```
    /// use kardan_math::num::Rational;
    /// use kardan_synthesis::decoupling::Compensation;
    /// let damping_ratio = Rational::from_parts(7.into(), 10u8.into());
    /// let asked = Compensation::SecondOrder { natural_frequency: Rational::from(20), damping_ratio };
    /// assert_eq!(asked.polynomial(2).unwrap().to_string(), "s^2 + 28 s + 400");
    /// assert_eq!(asked.polynomial(1).unwrap().to_string(), "s + 20");
    /// let pair = [(-3, 4), (-3, -4)].map(|(re, im)| (Rational::from(re), Rational::from(im)));
    /// assert_eq!(Compensation::Poles(pair.to_vec()).polynomial(2).unwrap().to_string(), "s^2 + 6 s + 25");
    /// ```
    ///
    /// # Errors
    /// [`CompensationError`].
    pub fn polynomial(&self, degree: usize) -> Result<Polynomial, CompensationError> {
        match self {
            Self::SecondOrder { natural_frequency, damping_ratio } => {
                positive("natural frequency", natural_frequency)?;
                positive("damping ratio", damping_ratio)?;
                if degree < 2 {
                    return Ok(binomial(natural_frequency, degree));
                }
                let doubled = Rational::from(2).times(damping_ratio).times(natural_frequency);
                let square = natural_frequency.times(natural_frequency);
                let pair = Polynomial::new(vec![square, doubled, Rational::ONE]);
                Ok(pair.times(&binomial(natural_frequency, degree - 2)))
            }
            Self::FirstOrder { frequency } => {
                positive("frequency", frequency)?;
                Ok(binomial(frequency, degree))
            }
            Self::Poles(poles) => from_poles(poles, degree),
        }
    }
}

fn positive(what: &'static str, value: &Rational) -> Result<(), CompensationError> {
    if *value > Rational::ZERO { Ok(()) } else { Err(CompensationError::NotPositive { what, value: value.clone() }) }
}

/// `(s + ω)^count`.
fn binomial(frequency: &Rational, count: usize) -> Polynomial {
    Polynomial::from_roots(&vec![Rational::ZERO.minus(frequency); count])
}

fn from_poles(poles: &[ExactPole], degree: usize) -> Result<Polynomial, CompensationError> {
    if poles.len() != degree {
        return Err(CompensationError::Count { degree, poles: poles.len() });
    }
    if let Some((real, _)) = poles.iter().find(|(real, _)| *real >= Rational::ZERO) {
        return Err(CompensationError::NotStable { real: real.clone() });
    }
    product(poles).map_err(|(real, imaginary)| CompensationError::NoConjugate { real, imaginary })
}
