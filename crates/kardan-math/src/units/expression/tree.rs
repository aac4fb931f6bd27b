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

/// Each function with its name and the number of its arguments.
pub(super) const FUNCTIONS: [(&str, Called, Range<usize>); 14] = [
    ("sqrt", Called::Sqrt, 1..2),
    ("sin", Called::Sin, 1..2),
    ("cos", Called::Cos, 1..2),
    ("tan", Called::Tan, 1..2),
    ("asin", Called::Asin, 1..2),
    ("acos", Called::Acos, 1..2),
    ("atan", Called::Atan, 1..2),
    ("atan2", Called::Atan2, 2..3),
    ("exp", Called::Exp, 1..2),
    ("ln", Called::Ln, 1..2),
    ("abs", Called::Abs, 1..2),
    ("min", Called::Min, 2..usize::MAX),
    ("max", Called::Max, 2..usize::MAX),
    ("sign", Called::Sign, 1..2),
];

impl Called {
    /// As it is written.
    pub fn name(self) -> &'static str {
        FUNCTIONS.iter().find(|(_, function, _)| *function == self).map_or("", |(name, ..)| name)
    }
}
