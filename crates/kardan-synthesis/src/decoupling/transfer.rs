//! Exact rational transfer functions.

use std::fmt;

use super::relative_degree::assert_explicit;
use kardan_analysis::LinearSystem;
use kardan_math::num::{Polynomial, Rational, Scalar, resolvent};

/// A quotient of polynomials in lowest terms; the denominator is monic, and 1 for the zero function.
#[derive(Debug, Clone, PartialEq)]
pub struct RationalFunction {
    /// Numerator.
    pub numerator: Polynomial,
    /// Monic denominator, without a common factor with the numerator.
    pub denominator: Polynomial,
}

impl RationalFunction {
    /// In lowest terms.
    ///
    /// # Panics
    /// If the denominator is zero.
    pub fn new(numerator: &Polynomial, denominator: &Polynomial) -> Self {
        assert!(!denominator.is_zero(), "a quotient with the denominator zero");
        let common = numerator.gcd(denominator);
        let (numerator, denominator) = (numerator.divide(&common).0, denominator.divide(&common).0);
        let leading = denominator.coefficient(denominator.degree());
        Self { numerator: numerator.scale(&Rational::ONE.over(&leading)), denominator: denominator.monic() }
    }

    /// Whether it vanishes everywhere.
    pub fn is_zero(&self) -> bool {
        self.numerator.is_zero()
    }

    /// The value at a number; `None` at a pole.
    pub fn evaluate(&self, s: &Rational) -> Option<Rational> {
        let denominator = self.denominator.evaluate(s);
        (!denominator.is_zero()).then(|| self.numerator.evaluate(s).over(&denominator))
    }
}

impl fmt::Display for RationalFunction {
    /// `400/(s^2 + 28 s + 400)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bracketed = |p: &Polynomial| {
            let terms = p.coefficients().iter().filter(|c| !Scalar::is_zero(*c)).count();
            let text = p.to_string();
            if terms > 1 || text.contains('/') { format!("({text})") } else { text }
        };
        if self.denominator.degree() == 0 {
            return write!(f, "{}", self.numerator);
        }
        write!(f, "{}/{}", bracketed(&self.numerator), bracketed(&self.denominator))
    }
}

/// The transfer matrix `C (sI − A)⁻¹ B + D`, outputs × inputs, exact, every entry in lowest terms \[diss. (6.69)\].
///
/// Cost: some n³ operations modulo each of as many primes as the size of the coefficients requires, then one greatest common
/// divisor per entry (a drivetrain of 40 states: hundredths of a second; fractions without common denominators are slower).
/// To see which entries vanish, [`coupled_entries`](super::coupled_entries) is quicker.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::decoupling::transfer_matrix;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let a = matrix(&[&[0, 1], &[-400, -28]]);
/// let system = LinearSystem::state_space(a, matrix(&[&[0], &[400]]), matrix(&[&[1, 0]]));
/// assert_eq!(transfer_matrix(&system)[0][0].to_string(), "400/(s^2 + 28 s + 400)");
/// ```
///
/// # Panics
/// If E is not the identity.
pub fn transfer_matrix(system: &LinearSystem) -> Vec<Vec<RationalFunction>> {
    assert_explicit(system);
    let parts = resolvent(&system.a, &system.b, &system.c, &system.d);
    let entry = |numerator: &Polynomial| RationalFunction::new(numerator, &parts.characteristic);
    parts.numerators.iter().map(|row| row.iter().map(entry).collect()).collect()
}
