//! The dimensions of expressions.

use std::collections::HashMap;

use kardan_math::units::Dimension;

use super::graph::Graph;
use super::nodes::{Expr, Function, Node};

impl Graph {
    /// The dimension of an expression.
    ///
    /// Angles count as numbers where a number is required: the arc length of an angle has no other unit than its radius.
    ///
    /// # Errors
    /// The mismatch, as text.
    pub fn dimension(&self, expr: Expr) -> Result<Dimension, String> {
        let mut found: HashMap<Expr, Dimension> = HashMap::new();
        for part in self.needed(&[expr]) {
            let dimension = self.dimension_of(part, &found)?;
            found.insert(part, dimension);
        }
        Ok(found[&expr])
    }

    fn dimension_of(&self, expr: Expr, found: &HashMap<Expr, Dimension>) -> Result<Dimension, String> {
        let of = |part: &Expr| Dimension { angle: 0, ..found[part] };
        let number = |part: &Expr| match of(part) {
            Dimension::NONE => Ok(Dimension::NONE),
            other => Err(format!("`{}` takes a number, not [{}]", self.word(expr), other.si())),
        };
        let same = |parts: &[Expr]| {
            let first = of(&parts[0]);
            match parts.iter().find(|part| of(part) != first) {
                None => Ok(first),
                Some(other) => Err(format!("`{}` of [{}] and [{}]", self.word(expr), first.si(), of(other).si())),
            }
        };
        match self.node(expr) {
            Node::Number(_) | Node::Pi => Ok(Dimension::NONE),
            Node::Symbol(symbol) => Ok(Dimension { angle: 0, ..self.name(*symbol).1 }),
            Node::Sum { constant, terms } => {
                let terms: Vec<Expr> = terms.iter().map(|(term, _)| *term).collect();
                let dimension = same(&terms)?;
                if !constant.is_zero() && dimension != Dimension::NONE {
                    return Err(format!("a number is added to [{}]", dimension.si()));
                }
                Ok(dimension)
            }
            Node::Product(factors) => factors.iter().try_fold(Dimension::NONE, |all, (factor, power)| {
                all.times(&of(factor), *power).ok_or_else(|| "a power of a unit that is too high".to_owned())
            }),
            Node::Apply(Function::Abs, a) | Node::Group(a) => Ok(of(a)),
            Node::Apply(Function::Sqrt, a) => {
                let inner = of(a);
                let half = Dimension { exponents: inner.exponents.map(|power| power / 2), angle: 0 };
                if half.times(&half, 1) == Some(inner) {
                    Ok(half)
                } else {
                    Err(format!("the root of [{}]", inner.si()))
                }
            }
            Node::Apply(_, a) | Node::Table(_, a) => number(a),
            Node::Atan2(y, x) => same(&[*y, *x]).map(|_| Dimension::NONE),
            Node::Min(a, b) | Node::Max(a, b) => same(&[*a, *b]),
            Node::Select([a, b, c, d]) => same(&[*a, *b]).and_then(|_| same(&[*c, *d])),
        }
    }

    fn word(&self, expr: Expr) -> &'static str {
        match self.node(expr) {
            Node::Number(_) | Node::Pi | Node::Symbol(_) | Node::Group(_) => "value",
            Node::Sum { .. } => "+",
            Node::Product(_) => "*",
            Node::Apply(function, _) => function.name(),
            Node::Atan2(..) => "atan2",
            Node::Min(..) => "min",
            Node::Max(..) => "max",
            Node::Select(_) => "if",
            Node::Table(..) => "table",
        }
    }
}
