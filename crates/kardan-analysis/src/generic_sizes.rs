//! Sizes of rational functions: they bound the probability that a nonzero one vanishes at a random point modulo a prime.

use kardan_rt::Operator;

use super::generic_motion::MOST_MULTIPLES;
use super::parts::bits_of;
use kardan_expr::expr::{Domain, PiecewisePolynomial};
use kardan_math::num::Rational;

/// Bounds of a fraction of polynomials with whole coefficients: its degrees, and log₂ of the sums of the sizes of the coefficients, above and
/// below together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Size {
    pub above: f64,
    pub below: f64,
    pub bits: f64,
}

impl Size {
    /// A coordinate, or a number that is drawn.
    pub const DRAWN: Self = Self { above: 1.0, below: 0.0, bits: 1.0 };

    fn product(self, other: Self) -> Self {
        Self { above: self.above + other.above, below: self.below + other.below, bits: self.bits + other.bits }
    }

    fn sum(self, other: Self) -> Self {
        let above = (self.above + other.below).max(other.above + self.below);
        Self { above, ..self.product(other) }.with_bit()
    }

    fn with_bit(self) -> Self {
        Self { bits: self.bits + 1.0, ..self }
    }

    fn larger(self, other: Self) -> Self {
        Self { above: self.above.max(other.above), below: self.below.max(other.below), bits: self.bits.max(other.bits) }
    }

    /// Numerator and denominator together.
    pub fn degree(self) -> f64 {
        self.above + self.below
    }
}

/// The sizes of expressions in coordinates, halves of tangents and what is drawn.
#[derive(Debug, Clone, Default)]
pub(super) struct Sizes {
    /// Coordinates, the time among them.
    pub coordinates: usize,
    /// The most that a derivative may add to a degree.
    pub grows: f64,
    /// Roots: each doubles the number of zeros.
    pub roots: i32,
}

impl Domain for Sizes {
    type Value = Size;

    fn constant(&mut self, value: &Rational) -> Size {
        Size { bits: bits_of(value) as f64, ..Size::default() }
    }

    fn operation(&mut self, operator: Operator, x: &[Size]) -> Size {
        match operator {
            Operator::Add | Operator::Subtract => x[0].sum(x[1]),
            Operator::Multiply => x[0].product(x[1]),
            Operator::AddProduct | Operator::SubtractProduct => x[2].sum(x[0].product(x[1])),
            Operator::Negate | Operator::Absolute => x[0],
            Operator::Divide => x[0].product(Size { above: x[1].below, below: x[1].above, ..x[1] }),
            Operator::Minimum | Operator::Maximum => x[0].larger(x[1]),
            Operator::Select => x[2].larger(x[3]),
            _ => {
                self.roots +=
                    i32::from(matches!(operator, Operator::SquareRoot | Operator::ArcSine | Operator::ArcCosine));
                self.grows += x.iter().map(|x| 4.0 * x.degree() + 4.0).sum::<f64>();
                Size::DRAWN
            }
        }
    }

    fn sine_cosine(&mut self, angle: &Size) -> [Size; 2] {
        // Of multiples of halves of angles, one for each coordinate; or of any argument.
        self.grows += 4.0 * angle.degree() + 4.0;
        let degree = 2.0 * MOST_MULTIPLES as f64 * self.coordinates as f64;
        [Size { above: degree, below: degree, bits: 2.0 * degree }; 2]
    }

    fn table(&mut self, table: &PiecewisePolynomial, x: &Size) -> Size {
        let piece = |(origin, coefficients): &(Rational, Vec<Rational>)| {
            let origin = self.constant(origin);
            let own: Vec<Size> = coefficients.iter().map(|c| self.constant(c)).collect();
            let step = x.sum(origin);
            own.iter().rev().fold(Size::default(), |sum, c| sum.product(step).sum(*c))
        };
        table.pieces.iter().map(piece).fold(Size::default(), Size::larger)
    }
}
