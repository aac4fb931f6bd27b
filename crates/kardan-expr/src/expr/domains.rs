//! Numbers that expressions are evaluated over.

use kardan_rt::{Operator, Real, functions};

use super::piecewise_polynomial::PiecewisePolynomial;
use kardan_math::num::{Rational, rational_to_f64};

/// Numbers, or a representation of them: the operations of a plan on them.
pub trait Domain {
    /// A value.
    type Value: Clone;
    /// An exact constant, rounded once.
    fn constant(&mut self, value: &Rational) -> Self::Value;
    /// The result of an operation; of [`Operator::SineCosine`] the sine, [`Operator::Table`] does not get here.
    fn operation(&mut self, operator: Operator, operands: &[Self::Value]) -> Self::Value;
    /// Sine and cosine.
    fn sine_cosine(&mut self, angle: &Self::Value) -> [Self::Value; 2];
    /// A table at x.
    fn table(&mut self, table: &PiecewisePolynomial, x: &Self::Value) -> Self::Value;
}

/// `f64` or `f32`, as plans compute.
#[derive(Debug, Clone, Copy, Default)]
pub struct Floating<T>(std::marker::PhantomData<T>);

/// The operation on numbers of the target.
fn operation<T: Real>(operator: Operator, x: &[T]) -> T {
    match operator {
        Operator::Add => x[0] + x[1],
        Operator::Subtract => x[0] - x[1],
        Operator::Multiply => x[0] * x[1],
        Operator::Divide => x[0] / x[1],
        Operator::AddProduct => x[2] + x[0] * x[1],
        Operator::SubtractProduct => x[2] - x[0] * x[1],
        Operator::Negate => -x[0],
        Operator::Absolute => x[0].abs(),
        Operator::SquareRoot => x[0].sqrt(),
        Operator::SineCosine => functions::sin_cos(x[0]).0,
        Operator::Tangent => functions::tan(x[0]),
        Operator::ArcSine => functions::asin(x[0]),
        Operator::ArcCosine => functions::acos(x[0]),
        Operator::ArcTangent => functions::atan(x[0]),
        Operator::ArcTangent2 => functions::atan2(x[0], x[1]),
        Operator::Exponential => functions::exp(x[0]),
        Operator::Logarithm => functions::ln(x[0]),
        Operator::Minimum if x[0] < x[1] => x[0],
        Operator::Minimum | Operator::Table => x[1],
        Operator::Maximum if x[0] < x[1] => x[1],
        Operator::Maximum => x[0],
        Operator::Select if x[0] < x[1] => x[2],
        Operator::Select => x[3],
    }
}

macro_rules! floating {
    ($float:ty, $rounded:expr) => {
        impl Domain for Floating<$float> {
            type Value = $float;

            fn constant(&mut self, value: &Rational) -> $float {
                $rounded(value)
            }

            fn operation(&mut self, operator: Operator, operands: &[$float]) -> $float {
                operation(operator, operands)
            }

            fn sine_cosine(&mut self, angle: &$float) -> [$float; 2] {
                functions::sin_cos(*angle).into()
            }

            fn table(&mut self, table: &PiecewisePolynomial, x: &$float) -> $float {
                let knots = table.knots.iter().map($rounded);
                let piece = knots.filter(|knot: &$float| knot <= x).count();
                let (origin, coefficients) = &table.pieces[piece];
                let x = x - $rounded(origin);
                coefficients.iter().rev().fold(0.0, |value, c| value * x + $rounded(c))
            }
        }
    };
}

floating!(f64, |value: &Rational| rational_to_f64(value));
floating!(f32, |value: &Rational| value.to_f32().value());

/// Exact fractions; `None` where a value is no fraction, or is not known to be one (a sine, a root, a quotient by zero). Functions are known where they
/// vanish or are 1: `sin 0`, `atan 0`, `exp 0`, `ln 1`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rationals;

impl Domain for Rationals {
    type Value = Option<Rational>;

    fn constant(&mut self, value: &Rational) -> Option<Rational> {
        Some(value.clone())
    }

    fn operation(&mut self, operator: Operator, operands: &[Option<Rational>]) -> Option<Rational> {
        let x: Vec<&Rational> = operands.iter().map(Option::as_ref).collect::<Option<_>>()?;
        Some(match operator {
            Operator::Add => x[0] + x[1],
            Operator::Subtract => x[0] - x[1],
            Operator::Multiply => x[0] * x[1],
            Operator::Divide if x[1].is_zero() => return None,
            Operator::Divide => x[0] / x[1],
            Operator::AddProduct => x[2] + x[0] * x[1],
            Operator::SubtractProduct => x[2] - x[0] * x[1],
            Operator::Negate => -x[0].clone(),
            Operator::Absolute if *x[0] < Rational::ZERO => -x[0].clone(),
            Operator::Absolute => x[0].clone(),
            Operator::Minimum => x[0].min(x[1]).clone(),
            Operator::Maximum => x[0].max(x[1]).clone(),
            Operator::Select if x[0] < x[1] => x[2].clone(),
            Operator::Select => x[3].clone(),
            // Where they are fractions for certain.
            Operator::Tangent | Operator::ArcSine | Operator::ArcTangent if x[0].is_zero() => Rational::ZERO,
            Operator::SquareRoot if x[0].is_zero() => Rational::ZERO,
            Operator::ArcTangent2 if x[0].is_zero() && *x[1] > Rational::ZERO => Rational::ZERO,
            Operator::Exponential if x[0].is_zero() => Rational::ONE,
            Operator::Logarithm | Operator::ArcCosine if *x[0] == Rational::ONE => Rational::ZERO,
            _ => return None,
        })
    }

    fn sine_cosine(&mut self, angle: &Option<Rational>) -> [Option<Rational>; 2] {
        match angle {
            Some(angle) if angle.is_zero() => [Some(Rational::ZERO), Some(Rational::ONE)],
            _ => [None, None],
        }
    }

    fn table(&mut self, table: &PiecewisePolynomial, x: &Option<Rational>) -> Option<Rational> {
        x.as_ref().map(|x| table.value(x))
    }
}
