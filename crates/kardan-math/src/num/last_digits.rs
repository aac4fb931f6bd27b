//! Draws numbers within the last digits of rounded ones.

use dashu_int::{IBig, UBig};

use super::{Random, Rational, rational_from_f64};

/// Binary digits behind the point from which on a fraction has a rounded double in it; decimals as they are written have none.
const DOUBLE: usize = 28;
/// Part of its size within which a rounded number may be off: some units of the last digit of a double.
const OFF: f64 = 8.0 * f64::EPSILON;

/// Draws other numbers within the last digits of rounded ones: a result that is the same for all of them does not depend on rounding.
#[derive(Debug, Clone)]
pub struct LastDigits {
    random: Random,
}

impl LastDigits {
    /// Drawn from a seed.
    pub fn new(seed: u64) -> Self {
        Self { random: Random::new(seed) }
    }

    /// Whether a number has a rounded double in it.
    pub fn is_rounded(value: &Rational) -> bool {
        value.denominator().trailing_zeros().is_some_and(|zeros| zeros >= DOUBLE)
    }

    /// By how much a rounded number of this value may be off, where its terms do not cancel.
    pub fn of(value: f64) -> f64 {
        OFF * value.abs()
    }

    /// A number that is off by some units of the last digit, if it is rounded; else itself.
    pub fn near(&mut self, value: &Rational) -> Rational {
        if !Self::is_rounded(value) {
            return value.clone();
        }
        value + value * self.fraction(OFF)
    }

    /// A number that is off by no more than this.
    pub fn perturbed(&mut self, value: &Rational, off: f64) -> Rational {
        if off > 0.0 { value + self.fraction(off) } else { value.clone() }
    }

    /// A number between −1 and 1.
    pub fn part(&mut self) -> f64 {
        2.0 * self.random.unit() - 1.0
    }

    /// Between −size and size.
    fn fraction(&mut self, size: f64) -> Rational {
        let drawn = Rational::from_parts(IBig::from((self.random.unit() * 2048.0) as i64 - 1024), UBig::from(1024u32));
        rational_from_f64(size).map_or(Rational::ZERO, |size| size * drawn)
    }
}
