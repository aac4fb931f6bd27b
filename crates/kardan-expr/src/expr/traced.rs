//! Expressions as numbers: a block of `kardan-rt` that computes with them gives its formula.

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use kardan_rt::Arithmetic;

use super::{Expr, Graph};
use kardan_math::num::Rational;

/// An expression of a graph that is in the making, or a small fraction.
#[derive(Debug, Clone, Copy)]
pub enum Traced<'g> {
    /// Numerator and denominator: a constant of a block.
    Fraction(i64, i64),
    /// An expression.
    Of(&'g RefCell<Graph>, Expr),
}

impl<'g> Traced<'g> {
    /// An expression of a graph.
    pub fn new(graph: &'g RefCell<Graph>, expr: Expr) -> Self {
        Self::Of(graph, expr)
    }

    /// Its expression in a graph.
    pub fn expr(self, graph: &'g RefCell<Graph>) -> Expr {
        match self {
            Self::Of(_, expr) => expr,
            Self::Fraction(numerator, denominator) => {
                graph.borrow_mut().number(Rational::from(numerator) / Rational::from(denominator))
            }
        }
    }

    /// The operation on expressions, in the graph of one of them; `None` if both are fractions.
    fn recorded<const N: usize>(
        parts: [Self; N],
        operation: impl FnOnce(&mut Graph, [Expr; N]) -> Expr,
    ) -> Option<Self> {
        let graph = parts.iter().find_map(|part| match part {
            Self::Of(graph, _) => Some(*graph),
            Self::Fraction(..) => None,
        })?;
        let exprs = parts.map(|part| part.expr(graph));
        let expr = operation(&mut graph.borrow_mut(), exprs);
        Some(Self::Of(graph, expr))
    }

    fn fraction(self) -> (i64, i64) {
        match self {
            Self::Fraction(numerator, denominator) => (numerator, denominator),
            Self::Of(..) => unreachable!("used with fractions only"),
        }
    }
}

/// An operator of two numbers: a node of expressions, or a fraction of the numerators and denominators.
macro_rules! operator {
    ($trait:ident, $method:ident, $node:ident, [$a:ident, $b:ident, $c:ident, $d:ident] => $fraction:expr) => {
        impl $trait for Traced<'_> {
            type Output = Self;

            fn $method(self, other: Self) -> Self {
                Self::recorded([self, other], |graph, [a, b]| graph.$node(a, b)).unwrap_or_else(|| {
                    let (($a, $b), ($c, $d)) = (self.fraction(), other.fraction());
                    let (numerator, denominator) = $fraction;
                    Self::Fraction(numerator, denominator)
                })
            }
        }
    };
}

operator!(Add, add, add, [a, b, c, d] => (a * d + c * b, b * d));
operator!(Mul, mul, multiply, [a, b, c, d] => (a * c, b * d));
operator!(Div, div, divide, [a, b, c, d] => (a * d, b * c));

impl Sub for Traced<'_> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Traced<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        Self::recorded([self], |graph, [a]| graph.negate(a)).unwrap_or_else(|| {
            let (a, b) = self.fraction();
            Self::Fraction(-a, b)
        })
    }
}

/// Expressions are taken as finite: whether they are is known where they are evaluated.
impl Arithmetic for Traced<'_> {
    fn whole(count: usize) -> Self {
        Self::Fraction(i64::try_from(count).unwrap_or(i64::MAX), 1)
    }

    fn select(self, than: Self, then: Self, otherwise: Self) -> Self {
        if let (Self::Fraction(a, b), Self::Fraction(c, d)) = (self, than) {
            return if (a * d < c * b) == (b * d > 0) { then } else { otherwise };
        }
        let recorded = Self::recorded([self, than, then, otherwise], |graph, [a, b, c, d]| graph.select(a, b, c, d));
        recorded.unwrap_or(otherwise)
    }

    fn finite_or(self, _: Self) -> Self {
        self
    }

    /// No comparison with a value that is not a number is true.
    fn is_number(self) -> Self {
        match self {
            Self::Fraction(..) => Self::Fraction(1, 1),
            Self::Of(..) => (self - Self::Fraction(1, 1)).select(self, Self::Fraction(1, 1), Self::Fraction(0, 1)),
        }
    }

    fn all_finite(self) -> bool {
        true
    }
}

#[cfg(test)]
#[path = "../../tests/unit/expr/traced.rs"]
mod tests;
