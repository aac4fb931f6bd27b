//! Positive real roots alone, which are found much faster than all roots.

use dashu_int::IBig;
use dashu_int::ops::BitTest;

use super::wide::nearest;
use super::{Polynomial, Scalar};

/// Binary digits to which a root is found within an interval that is no wider than what lies below it.
const DIGITS: usize = 60;
/// Binary digits of places within such an interval.
const PLACES: usize = 64;
/// Where the second evaluation is, in halvings of the interval.
const BEHIND: usize = 10;

/// A polynomial on an interval, `p(2^exponent (at + x))` with x from 0 to 1, times a power of two.
struct Piece {
    coefficients: Vec<IBig>,
    at: IBig,
    exponent: i64,
}

/// The open intervals.
enum Open {
    Interval(Piece),
    Root(f64),
}

impl Polynomial {
    /// The different positive real roots, ascending, each off by some units in the last place; roots that are closer to each other come as one.
    ///
    /// Method: intervals are halved until the signs of the coefficients of `(1 + x)ⁿ p(1/(1 + x))` change at most once (Descartes' rule, Vincent's theorem):
    /// then there is no root or one, which the rule of false position finds. All of it is exact. An interval that is not decided within 60 digits contains roots
    /// next to each other, or two that just miss the axis.
    ///
    /// ```
    /// use kardan_math::num::{Polynomial, Rational};
    /// let p = Polynomial::from_roots(&[-1, 0, 2, 2, 5].map(Rational::from));
    /// assert_eq!(p.positive_roots(), [2.0, 5.0]);
    /// ```
    ///
    /// # Panics
    /// If the polynomial is zero.
    pub fn positive_roots(&self) -> Vec<f64> {
        assert!(!self.is_zero(), "the zero polynomial has every number as a root");
        let zeros = self.coefficients().iter().take_while(|c| Scalar::is_zero(*c)).count();
        let whole = Self::new(self.coefficients()[zeros..].to_vec()).whole_coefficients();
        // All of them are below 2 max |c_k/c_n|^(1/(n − k)) (Fujiwara 1916).
        let n = whole.len() - 1;
        let last = whole[n].bit_len() as i64 - 1;
        let parts = (0..n).filter(|k| !whole[*k].is_zero());
        let bound = parts.map(|k| (whole[k].bit_len() as i64 - last).div_euclid((n - k) as i64) + 1).max();
        let exponent = bound.unwrap_or(0) + 1;
        let shift = |k: usize| exponent.unsigned_abs() as usize * if exponent < 0 { n - k } else { k };
        let coefficients = whole.iter().enumerate().map(|(k, c)| c << shift(k)).collect();
        let mut open = vec![Open::Interval(Piece { coefficients, at: IBig::ZERO, exponent })];
        let mut out = Vec::new();
        while let Some(next) = open.pop() {
            let piece = match next {
                Open::Interval(piece) => piece,
                Open::Root(root) => {
                    out.push(root);
                    continue;
                }
            };
            match piece.changes() {
                0 => {}
                1 if !piece.at.is_zero() => out.push(piece.root()),
                count if count > 1 && piece.at.bit_len() > DIGITS => {
                    out.push(nearest(&((piece.at << 1) + IBig::ONE), piece.exponent - 1));
                }
                _ => {
                    let [lower, upper] = piece.halves();
                    let middle = upper.coefficients[0].is_zero().then(|| nearest(&upper.at, upper.exponent));
                    open.push(Open::Interval(upper));
                    open.extend(middle.map(Open::Root));
                    open.push(Open::Interval(lower));
                }
            }
        }
        out
    }
}

impl Piece {
    /// No fewer than the roots within, and as many or an even number more.
    fn changes(&self) -> usize {
        let mut reversed: Vec<IBig> = self.coefficients.iter().rev().cloned().collect();
        shift_by_one(&mut reversed);
        let mut signs = reversed.iter().filter(|c| !c.is_zero()).map(|c| *c > IBig::ZERO);
        let Some(mut before) = signs.next() else { return 0 };
        signs.filter(|sign| std::mem::replace(&mut before, *sign) != *sign).count()
    }

    fn halves(&self) -> [Self; 2] {
        let n = self.coefficients.len() - 1;
        let mut lower: Vec<IBig> = self.coefficients.iter().enumerate().map(|(k, c)| c << (n - k)).collect();
        let common = lower.iter().filter_map(IBig::trailing_zeros).min().unwrap_or(0);
        lower.iter_mut().for_each(|c| *c >>= common);
        let mut upper = lower.clone();
        shift_by_one(&mut upper);
        let at = &self.at << 1;
        let exponent = self.exponent - 1;
        [
            Self { coefficients: lower, at: at.clone(), exponent },
            Self { coefficients: upper, at: at + IBig::ONE, exponent },
        ]
    }

    /// The value at m/2^64, times a power of two that is always the same.
    fn value(&self, m: u128) -> IBig {
        let m = IBig::from(m);
        let mut coefficients = self.coefficients.iter().rev();
        let last = coefficients.next().cloned().unwrap_or(IBig::ZERO);
        coefficients.zip(1..).fold(last, |sum, (c, k)| sum * &m + (c << (PLACES * k)))
    }

    /// The only root in an interval, by the rule of false position with a second evaluation just behind each point, and by occasional halving.
    fn root(&self) -> f64 {
        let [mut low, mut high] = [0, 1u128 << PLACES];
        let [mut at_low, mut at_high] = [low, high].map(|m| self.value(m));
        let sign = self.coefficients.iter().find(|c| !c.is_zero()).is_some_and(|c| *c > IBig::ZERO);
        let mut narrow = |m: u128, [low, high]: [&mut u128; 2]| {
            let value = self.value(m);
            let before = !value.is_zero() && (value > IBig::ZERO) == sign;
            if before {
                (*low, at_low) = (m, value)
            } else {
                (*high, at_high) = (m, value)
            }
            (before, part(&at_low, &at_high))
        };
        let mut share = 0.5;
        for round in 1.. {
            let width = high - low;
            if width <= 1 << (PLACES - DIGITS) {
                break;
            }
            let guess = low + ((share * width as f64) as u128).clamp(1, width - 1);
            let (before, next) = narrow(guess, [&mut low, &mut high]);
            let step = (width >> BEHIND).max(1);
            let other = if before { guess + step } else { guess.saturating_sub(step) };
            share = next;
            if low < other && other < high {
                share = narrow(other, [&mut low, &mut high]).1;
            }
            if round % 3 == 0 {
                share = 0.5;
            }
        }
        nearest(&((&self.at << PLACES) + IBig::from(low + (high - low) / 2)), self.exponent - PLACES as i64)
    }
}

/// Where a straight line between two values of different signs is zero, from the first one on; half where one of them is zero.
fn part(first: &IBig, last: &IBig) -> f64 {
    if first.is_zero() || last.is_zero() {
        return 0.5;
    }
    let shift = first.bit_len().max(last.bit_len()).saturating_sub(DIGITS);
    let [first, last] = [first, last].map(|x| nearest(&(x >> shift), 0).abs());
    first / (first + last)
}

/// `p(x + 1)` from `p(x)`.
fn shift_by_one(coefficients: &mut [IBig]) {
    let n = coefficients.len();
    for i in 0..n {
        for j in (i..n - 1).rev() {
            let (low, high) = coefficients.split_at_mut(j + 1);
            low[j] += &high[0];
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/num/positive_roots.rs"]
mod tests;
