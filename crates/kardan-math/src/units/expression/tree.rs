//! The parts of expressions.

use std::ops::Range;

use super::super::{Dimension, Exact};

/// A part of an expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Its place in the text.
    pub(crate) span: Range<usize>,
    /// Its kind.
    pub kind: Kind,
}

/// The kind of a part of an expression.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// A number with its units.
    Literal(Exact, Dimension),
    /// A parameter or signal.
    Name(String),
    /// Its opposite.
    Negative(Box<Node>),
    /// One of `+ - * / ^` between two parts.
    Binary(char, Box<[Node; 2]>),
    /// A function of some parts.
    Call(Called, Vec<Node>),
    /// A table, by its name, at some parts.
    Lookup(String, Vec<Node>),
    /// A comparison, and the values if it is true or not.
    If(&'static str, Box<[Node; 4]>),
}

/// A function of expressions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Called {
    /// √x.
    Sqrt,
    /// sin x.
    Sin,
    /// cos x.
    Cos,
    /// tan x.
    Tan,
    /// arcsin x.
    Asin,
    /// arccos x.
    Acos,
    /// arctan x.
    Atan,
    /// The angle of the point (x, y), from y and x.
    Atan2,
    /// eˣ.
    Exp,
    /// ln x.
    Ln,
    /// abs x.
    Abs,
    /// The smallest of its arguments.
    Min,
    /// The largest of its arguments.
    Max,
    /// −1, 0 or 1.
    Sign,
}
