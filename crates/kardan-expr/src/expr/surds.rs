//! Numbers in which sine and cosine of whole multiples of 15° are exact.

use std::f64::consts::PI;

use kardan_rt::Operator;

use super::{Domain, PiecewisePolynomial};
use kardan_math::num::{LastDigits, Matrix, Rational, Scalar, rational_from_f64, rational_to_f64, shortest_decimal};

/// Parts of half a turn whose sine and cosine are known.
const PARTS: i64 = 12;
/// Units in the last place within which a double is a multiple of such a part.
const NEAR: f64 = 2.0 * f64::EPSILON;
/// Numerators and denominators above this are not those of decimals from a file, but of rounded numbers.
const LARGEST_DECIMAL_PART: f64 = 1e14;
/// The numerator of a decimal that was read; one of a million doubles is so near to such a one by chance.
const LARGEST_READ: f64 = 1e10;
/// The squares of 1, √2, √3 and √6.
const SQUARES: [i64; 4] = [1, 2, 3, 6];

/// `a + b √2 + c √3 + d √6 + e π`, exact.
#[derive(Debug, Clone, PartialEq)]
pub struct Surd {
    /// a, b, c, d.
    roots: [Rational; 4],
    /// e.
    pi: Rational,
}

impl Surd {
    /// A fraction.
    pub fn rational(value: Rational) -> Self {
        let [b, c, d] = [Rational::ZERO, Rational::ZERO, Rational::ZERO];
        Self { roots: [value, b, c, d], pi: Rational::ZERO }
    }

    /// The exact meaning of a number: one that is as near to a multiple of 15° as a double can be is that multiple, all others are themselves.
    pub fn recognise(value: &Rational) -> Self {
        let near = rational_to_f64(value);
        let parts = (near / PI * PARTS as f64).round();
        let multiple = parts * PI / PARTS as f64;
        let long = [value.numerator().to_f64().value(), value.denominator().to_f64().value()];
        let is_long = long.into_iter().any(|part| part.abs() > LARGEST_DECIMAL_PART);
        if parts != 0.0 && parts.abs() < 1e6 && is_long && (near - multiple).abs() <= NEAR * near.abs() {
            let pi = Rational::from(parts as i64) / Rational::from(PARTS);
            return Self { pi, ..Self::rational(Rational::ZERO) };
        }
        Self::rational(value.clone())
    }

    /// What a double stands for: a multiple of 15°, a fraction that it is, or the decimal of few digits that it was read from; `None` for all others, which
    /// are rounded.
    pub fn recognise_double(value: f64) -> Option<Self> {
        let own = rational_from_f64(value)?;
        let found = Self::recognise(&own);
        if !found.pi.is_zero() || !LastDigits::is_rounded(&own) {
            return Some(found);
        }
        let decimal = shortest_decimal(value)?;
        let digits = decimal.numerator().to_f64().value().abs();
        (digits < LARGEST_READ).then(|| Self::rational(decimal))
    }

    /// Itself, if it is a fraction.
    pub fn to_rational(&self) -> Option<Rational> {
        let [a, irrational @ ..] = &self.roots;
        (irrational.iter().chain([&self.pi]).all(Scalar::is_zero)).then(|| a.clone())
    }

    /// Cosine of an angle, if that is known.
    pub fn cosine(&self) -> Option<Self> {
        let parts = Rational::from(PARTS) * &self.pi;
        if !self.roots.iter().all(Scalar::is_zero) || *parts.denominator() != 1u8.into() {
            return None;
        }
        let parts = i64::try_from(parts.numerator() % dashu_int::IBig::from(2 * PARTS)).ok()?.rem_euclid(2 * PARTS);
        // Between 0 and half a turn; above a quarter of a turn the negative of that of the supplement.
        let parts = if parts > PARTS { 2 * PARTS - parts } else { parts };
        let (parts, sign) = if 2 * parts > PARTS { (PARTS - parts, -1) } else { (parts, 1) };
        let quarters: [i64; 4] = match parts {
            0 => [4, 0, 0, 0],
            1 => [0, 1, 0, 1],
            2 => [0, 0, 2, 0],
            3 => [0, 2, 0, 0],
            4 => [2, 0, 0, 0],
            5 => [0, -1, 0, 1],
            _ => [0; 4],
        };
        let roots = quarters.map(|quarter| Rational::from(sign * quarter) / Rational::from(4));
        Some(Self { roots, pi: Rational::ZERO })
    }

    fn sine(&self) -> Option<Self> {
        // sin x = cos(π/2 − x).
        let quarter = Self { pi: Rational::ONE / Rational::from(2), ..Self::rational(Rational::ZERO) };
        quarter.minus(self).cosine()
    }

    /// The sum.
    pub fn plus(&self, other: &Self) -> Self {
        let roots = std::array::from_fn(|k| &self.roots[k] + &other.roots[k]);
        Self { roots, pi: &self.pi + &other.pi }
    }

    fn minus(&self, other: &Self) -> Self {
        self.plus(&other.scale(&Rational::NEG_ONE))
    }

    /// Times a fraction.
    pub fn scale(&self, factor: &Rational) -> Self {
        Self { roots: self.roots.each_ref().map(|x| x * factor), pi: &self.pi * factor }
    }

    fn is_zero(&self) -> bool {
        self.roots.iter().chain([&self.pi]).all(Scalar::is_zero)
    }

    /// The product; `None` where it is none of these numbers.
    fn times(&self, other: &Self) -> Option<Self> {
        for (one, other) in [(self, other), (other, self)] {
            if let Some(factor) = one.to_rational() {
                return Some(other.scale(&factor));
            }
        }
        if !(self.pi.is_zero() && other.pi.is_zero()) {
            return None;
        }
        let mut roots = Self::rational(Rational::ZERO).roots;
        for (i, x) in self.roots.iter().enumerate() {
            for (j, y) in other.roots.iter().enumerate() {
                // √2 · √6 = 2 √3: what both have in common comes out of the root.
                let (place, factor) = root_of(SQUARES[i] * SQUARES[j]);
                roots[place] += x * y * Rational::from(factor);
            }
        }
        Some(Self { roots, pi: Rational::ZERO })
    }

    /// One over it; `None` for zero, and for multiples of π.
    fn reciprocal(&self) -> Option<Self> {
        if !self.pi.is_zero() || self.is_zero() {
            return None;
        }
        let unit = |k: usize| {
            let mut unit = Self::rational(Rational::ZERO);
            unit.roots[k] = Rational::ONE;
            unit
        };
        let products: Vec<Self> = (0..4).map(|k| self.times(&unit(k))).collect::<Option<_>>()?;
        let matrix = Matrix::from_fn(4, 4, |i, j| products[j].roots[i].clone());
        let one = Matrix::from_fn(4, 1, |i, _| Rational::from(u8::from(i == 0)));
        let found = matrix.solve(&one)?;
        Some(Self { roots: std::array::from_fn(|k| found[(k, 0)].clone()), pi: Rational::ZERO })
    }

    /// Which of two numbers is less, if that is certain.
    fn is_less(&self, other: &Self) -> Option<bool> {
        let difference = self.minus(other);
        if let Some(exact) = difference.to_rational() {
            return Some(exact < Rational::ZERO);
        }
        let parts = difference.roots.iter().zip(SQUARES).map(|(x, square)| rational_to_f64(x) * (square as f64).sqrt());
        let parts: Vec<f64> = parts.chain([rational_to_f64(&difference.pi) * PI]).collect();
        let (sum, size) = parts.iter().fold((0.0, 0.0), |(sum, size), x| (sum + x, size + x.abs()));
        (sum.abs() > 1e-12 * size).then_some(sum < 0.0)
    }
}

/// The place of the root of a product of squares, and what comes out of it.
fn root_of(square: i64) -> (usize, i64) {
    let place = |rest: i64| SQUARES.iter().position(|square| *square == rest);
    let factor = [6, 3, 2, 1].into_iter().find(|factor| square % (factor * factor) == 0).unwrap_or(1);
    (place(square / (factor * factor)).unwrap_or(0), factor)
}

/// Exact numbers around fractions, roots of 2, 3 and 6, and multiples of π; `None` where a value is no such number, or is not known to be one.
/// Functions are where they are known: sines of multiples of 15°, `atan 0`, `exp 0`, `ln 1`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Surds;

impl Domain for Surds {
    type Value = Option<Surd>;

    fn constant(&mut self, value: &Rational) -> Option<Surd> {
        Some(Surd::recognise(value))
    }

    fn operation(&mut self, operator: Operator, operands: &[Option<Surd>]) -> Option<Surd> {
        let x: Vec<&Surd> = operands.iter().map(Option::as_ref).collect::<Option<_>>()?;
        let zero = || Surd::rational(Rational::ZERO);
        Some(match operator {
            Operator::Add => x[0].plus(x[1]),
            Operator::Subtract => x[0].minus(x[1]),
            Operator::Multiply => x[0].times(x[1])?,
            Operator::Divide => match (x[0].is_zero(), x[1].is_zero()) {
                (true, false) => zero(),
                _ => x[0].times(&x[1].reciprocal()?)?,
            },
            Operator::AddProduct => x[2].plus(&x[0].times(x[1])?),
            Operator::SubtractProduct => x[2].minus(&x[0].times(x[1])?),
            Operator::Negate => x[0].scale(&Rational::NEG_ONE),
            Operator::Absolute if x[0].is_less(&zero())? => x[0].scale(&Rational::NEG_ONE),
            Operator::Absolute => x[0].clone(),
            Operator::Minimum => if x[1].is_less(x[0])? { x[1] } else { x[0] }.clone(),
            Operator::Maximum => if x[0].is_less(x[1])? { x[1] } else { x[0] }.clone(),
            Operator::Select => if x[0].is_less(x[1])? { x[2] } else { x[3] }.clone(),
            Operator::Tangent => x[0].sine()?.times(&x[0].cosine()?.reciprocal()?)?,
            Operator::ArcSine | Operator::ArcTangent | Operator::SquareRoot if x[0].is_zero() => zero(),
            Operator::ArcTangent2 if x[0].is_zero() && zero().is_less(x[1])? => zero(),
            Operator::Exponential if x[0].is_zero() => Surd::rational(Rational::ONE),
            Operator::Logarithm | Operator::ArcCosine if x[0].to_rational()? == Rational::ONE => zero(),
            Operator::SquareRoot => Surd::rational(square_root(&x[0].to_rational()?)?),
            _ => return None,
        })
    }

    fn sine_cosine(&mut self, angle: &Option<Surd>) -> [Option<Surd>; 2] {
        match angle {
            Some(angle) => [angle.sine(), angle.cosine()],
            None => [None, None],
        }
    }

    fn table(&mut self, table: &PiecewisePolynomial, x: &Option<Surd>) -> Option<Surd> {
        Some(Surd::rational(table.value(&x.as_ref()?.to_rational()?)))
    }
}

/// The root of a fraction, if it is one.
fn square_root(value: &Rational) -> Option<Rational> {
    let near = rational_from_f64(rational_to_f64(value).sqrt())?;
    (&near * &near == *value).then_some(near)
}

#[cfg(test)]
#[path = "../../tests/unit/expr/surds.rs"]
mod tests;
