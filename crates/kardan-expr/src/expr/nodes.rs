//! What a graph consists of: symbols, functions, and nodes with their operands.

use kardan_math::num::Rational;

/// A node of a [`Graph`](super::Graph); equal nodes are equal expressions. Nodes that others are made of have smaller numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Expr(pub(super) u32);

/// A named quantity: a coordinate, a speed, a parameter, a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Symbol(pub(super) u32);

/// A function of one argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Function {
    /// √x
    Sqrt,
    /// sin x
    Sin,
    /// cos x
    Cos,
    /// tan x
    Tan,
    /// asin x
    Asin,
    /// acos x
    Acos,
    /// atan x
    Atan,
    /// eˣ
    Exp,
    /// ln x
    Ln,
    /// |x|
    Abs,
}

impl Function {
    /// As it is written.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sqrt => "sqrt",
            Self::Sin => "sin",
            Self::Cos => "cos",
            Self::Tan => "tan",
            Self::Asin => "asin",
            Self::Acos => "acos",
            Self::Atan => "atan",
            Self::Exp => "exp",
            Self::Ln => "ln",
            Self::Abs => "abs",
        }
    }

    /// Whether `f(−x) = −f(x)`.
    pub(super) const fn is_odd(self) -> bool {
        matches!(self, Self::Sin | Self::Tan | Self::Asin | Self::Atan)
    }

    /// Whether `f(−x) = f(x)`.
    pub(super) const fn is_even(self) -> bool {
        matches!(self, Self::Cos | Self::Abs)
    }
}

/// The operation and the operands of a node.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Node {
    Number(Rational),
    Pi,
    Symbol(Symbol),
    /// `constant + Σ factor·term`: terms in order, none of them a sum or a number, no factor zero.
    Sum {
        constant: Rational,
        terms: Vec<(Expr, Rational)>,
    },
    /// `Π factor^power`: factors in order, none of them a product or a number, no power zero.
    Product(Vec<(Expr, i32)>),
    Apply(Function, Expr),
    /// The angle of the point (second, first).
    Atan2(Expr, Expr),
    Min(Expr, Expr),
    Max(Expr, Expr),
    /// The third where the first is less than the second, else the fourth.
    Select([Expr; 4]),
    Table(u32, Expr),
    /// A sum that is formed on its own.
    Group(Expr),
}
