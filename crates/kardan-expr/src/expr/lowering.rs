//! Conversion of expressions from the source text of a model into a graph.

use std::sync::Arc;

use super::{Expr, Function, Graph, Lookup};
use kardan_math::units::{Called, Dimension, Exact, Expression, Kind, Node, UnitError, Value};

/// The meaning of a name in an expression.
#[derive(Debug, Clone, PartialEq)]
pub enum Named {
    /// A value known now.
    Constant(Exact, Dimension),
    /// A varying expression.
    Varying(Expr, Dimension),
    /// A table, which is called.
    Table(Arc<Lookup>),
}

enum Built {
    Constant(Value),
    Varying(Expr, Dimension),
}

impl Built {
    fn dimension(&self) -> Dimension {
        match self {
            Self::Constant(value) => value.dimension,
            Self::Varying(_, dimension) => *dimension,
        }
    }
}

impl Graph {
    /// A fraction times a power of π.
    pub fn exact(&mut self, value: &Exact) -> Expr {
        let pi = self.pi();
        let power = self.power(pi, value.pi);
        self.scale(value.rational.clone(), power)
    }

    /// The value of an expression: what follows from constants alone is computed exactly, or to 256 digits and rounded once; the rest are
    /// nodes.
    ///
    /// ```
    /// use kardan_expr::expr::{Graph, Named, Style, printed};
    /// use kardan_math::units::{Dimension, Expression, parse_quantity};
    /// let mut graph = Graph::default();
    /// let law = Expression::parse_law("2 N m * sin(sqrt(4) * arm.phi)")?;
    /// let mut names = |graph: &mut Graph, name: &str| Some(Named::Varying(graph.symbol(name, Dimension::ANGLE), Dimension::ANGLE));
    /// let (torque, dimension) = graph.lowered(&law, &mut names)?;
    /// assert_eq!(printed(&graph, torque, Style::Text, &|name| name.into()), "2*sin(2*arm.phi)");
    /// assert_eq!(dimension, Dimension::TORQUE);
    /// # Ok::<(), kardan_math::units::UnitError>(())
    /// ```
    ///
    /// # Errors
    /// Names that are unknown, dimensions that do not fit, and constant parts without a value, with the place.
    pub fn lowered(
        &mut self,
        expression: &Expression,
        names: &mut dyn FnMut(&mut Self, &str) -> Option<Named>,
    ) -> Result<(Expr, Dimension), UnitError> {
        let resolved = self.resolved(expression, names);
        let root = &expression.root;
        let built = Writer { graph: self, resolved: &resolved, calls: Vec::new() }.built(root)?;
        self.expr_of(root, built)
    }

    /// The tables that an expression calls, each with its arguments.
    ///
    /// # Errors
    /// As [`lowered`](Self::lowered).
    pub fn calls(
        &mut self,
        expression: &Expression,
        names: &mut dyn FnMut(&mut Self, &str) -> Option<Named>,
    ) -> Result<Vec<(String, Vec<Expr>)>, UnitError> {
        let resolved = self.resolved(expression, names);
        let mut writer = Writer { graph: self, resolved: &resolved, calls: Vec::new() };
        writer.built(&expression.root)?;
        Ok(writer.calls)
    }

    fn resolved(
        &mut self,
        expression: &Expression,
        names: &mut dyn FnMut(&mut Self, &str) -> Option<Named>,
    ) -> Vec<(String, Named)> {
        let all = expression.names().into_iter().chain(expression.tables());
        all.filter_map(|name| Some((name.to_string(), names(self, name)?))).collect()
    }

    fn expr_of(&mut self, node: &Node, built: Built) -> Result<(Expr, Dimension), UnitError> {
        match built {
            Built::Varying(expr, dimension) => Ok((expr, dimension)),
            Built::Constant(value) => {
                let dimension = value.dimension;
                let (value, _) = value.number.rounded_once().ok_or_else(|| node.too_large())?;
                Ok((self.exact(&value), dimension))
            }
        }
    }
}

struct Writer<'a> {
    graph: &'a mut Graph,
    resolved: &'a [(String, Named)],
    /// Tables that were called, with their arguments.
    calls: Vec<(String, Vec<Expr>)>,
}

impl Writer<'_> {
    fn constant(&self, node: &Node) -> Result<Value, UnitError> {
        node.value(&|name| match self.resolved.iter().find(|(resolved, _)| resolved == name) {
            Some((_, Named::Constant(value, dimension))) => Some((value.clone(), *dimension)),
            _ => None,
        })
    }

    fn varies(&self, node: &Node) -> bool {
        let varying = |name: &&str| self.resolved.iter().any(|(k, n)| k == name && matches!(n, Named::Varying(..)));
        !node.tables().is_empty() || node.names().iter().any(varying)
    }

    fn expr(&mut self, node: &Node) -> Result<(Expr, Dimension), UnitError> {
        let built = self.built(node)?;
        self.graph.expr_of(node, built)
    }

    fn built(&mut self, node: &Node) -> Result<Built, UnitError> {
        if !self.varies(node) {
            return self.constant(node).map(Built::Constant);
        }
        let (expr, dimension) = match &node.kind {
            Kind::Name(name) => match self.resolved.iter().find(|(resolved, _)| resolved == name) {
                Some((_, Named::Varying(expr, dimension))) => (*expr, *dimension),
                _ => return self.constant(node).map(Built::Constant),
            },
            Kind::Literal(..) => return self.constant(node).map(Built::Constant),
            Kind::Negative(inner) => {
                let (inner, dimension) = self.expr(inner)?;
                (self.graph.negate(inner), dimension)
            }
            Kind::Binary('^', parts) => self.power(node, parts)?,
            Kind::Binary(operator, parts) => self.binary(node, *operator, parts)?,
            Kind::Call(function, arguments) => {
                let mut values = Vec::new();
                for argument in arguments {
                    values.push(self.expr(argument)?);
                }
                let (exprs, dimensions): (Vec<Expr>, Vec<Dimension>) = values.into_iter().unzip();
                let dimension = Node::call_dimension(*function, arguments, &dimensions)?;
                (called(self.graph, *function, &exprs), dimension)
            }
            Kind::Lookup(name, arguments) => self.lookup(node, name, arguments)?,
            Kind::If(comparison, parts) => {
                let [(a, first), (b, second)] = [self.expr(&parts[0])?, self.expr(&parts[1])?];
                parts[1].like(&first, &second)?;
                let [(yes, dimension), (no, other)] = [self.expr(&parts[2])?, self.expr(&parts[3])?];
                parts[3].like(&dimension, &other)?;
                (chosen(self.graph, comparison, [a, b], [yes, no]), dimension)
            }
        };
        Ok(Built::Varying(expr, dimension))
    }

    fn lookup(&mut self, node: &Node, name: &str, arguments: &[Node]) -> Result<(Expr, Dimension), UnitError> {
        let tables = || self.resolved.iter().filter_map(|(resolved, named)| Some((resolved, table_of(named)?)));
        let Some(table) = tables().find(|(resolved, _)| *resolved == name).map(|(_, table)| Arc::clone(table)) else {
            return Err(node.unknown_table(name, &tables().map(|(resolved, _)| resolved.as_str()).collect::<Vec<_>>()));
        };
        let expected = table.arguments();
        if expected.len() != arguments.len() {
            let message = format!("`{name}` is a table over {}, not {}", counted(expected.len()), arguments.len());
            return Err(node.error("expression::syntax", message, "separate values by commas"));
        }
        let mut at = Vec::new();
        for (argument, expected) in arguments.iter().zip(expected) {
            let (value, found) = self.expr(argument)?;
            argument.like(expected, &found)?;
            at.push(value);
        }
        let value = table.write_into(self.graph, &at);
        self.calls.push((name.to_string(), at));
        Ok((value, table.dimension()))
    }

    fn binary(&mut self, node: &Node, operator: char, parts: &[Node; 2]) -> Result<(Expr, Dimension), UnitError> {
        let [(a, first), (b, second)] = [self.expr(&parts[0])?, self.expr(&parts[1])?];
        match operator {
            '+' | '-' => {
                parts[1].like(&first, &second)?;
                let sum = if operator == '+' { self.graph.add(a, b) } else { self.graph.subtract(a, b) };
                Ok((sum, first))
            }
            '/' if self.graph.is_zero(b) => {
                let help = "divide by what is not zero";
                Err(parts[1].error("expression::division", "division by zero: this part is 0", help))
            }
            _ => {
                let power = if operator == '/' { -1 } else { 1 };
                let dimension = first.times(&second, power).ok_or_else(|| node.too_large())?;
                Ok((self.graph.product(&[(a, 1), (b, power)]), dimension))
            }
        }
    }

    fn power(&mut self, node: &Node, parts: &[Node; 2]) -> Result<(Expr, Dimension), UnitError> {
        let power = self.built(&parts[1])?;
        let whole = if let Built::Constant(value) = &power { value.whole() } else { None };
        let (base, dimension) = self.expr(&parts[0])?;
        let dimension = node.power_dimension(parts, [&dimension, &power.dimension()], whole)?;
        if let Some(whole) = whole {
            if whole.abs() > MOST_POWER {
                return Err(node.too_large());
            }
            return Ok((self.graph.power(base, whole), dimension));
        }
        let (power, _) = self.graph.expr_of(&parts[1], power)?;
        let logarithm = self.graph.apply(Function::Ln, base);
        let exponent = self.graph.multiply(power, logarithm);
        Ok((self.graph.apply(Function::Exp, exponent), dimension))
    }
}

fn table_of(named: &Named) -> Option<&Arc<Lookup>> {
    if let Named::Table(table) = named { Some(table) } else { None }
}

fn counted(count: usize) -> String {
    if count == 1 { "one value".into() } else { format!("{count} values") }
}

/// The largest size of a power.
const MOST_POWER: i32 = 64;

fn called(graph: &mut Graph, function: Called, x: &[Expr]) -> Expr {
    let function = match function {
        Called::Sqrt => Function::Sqrt,
        Called::Sin => Function::Sin,
        Called::Cos => Function::Cos,
        Called::Tan => Function::Tan,
        Called::Asin => Function::Asin,
        Called::Acos => Function::Acos,
        Called::Atan => Function::Atan,
        Called::Exp => Function::Exp,
        Called::Ln => Function::Ln,
        Called::Abs => Function::Abs,
        Called::Atan2 => return graph.atan2(x[0], x[1]),
        Called::Min => return x[1..].iter().fold(x[0], |least, x| graph.min(least, *x)),
        Called::Max => return x[1..].iter().fold(x[0], |most, x| graph.max(most, *x)),
        Called::Sign => {
            let [zero, one, minus] = [0, 1, -1].map(|whole| graph.integer(whole));
            let above = graph.select(zero, x[0], one, zero);
            return graph.select(x[0], zero, minus, above);
        }
    };
    graph.apply(function, x[0])
}

/// One of two values, by a comparison.
fn chosen(graph: &mut Graph, comparison: &str, [a, b]: [Expr; 2], [yes, no]: [Expr; 2]) -> Expr {
    match comparison {
        "<" => graph.select(a, b, yes, no),
        ">" => graph.select(b, a, yes, no),
        "<=" => graph.select(b, a, no, yes),
        ">=" => graph.select(a, b, no, yes),
        equal => {
            let [yes, no] = if equal == "==" { [yes, no] } else { [no, yes] };
            let not_above = graph.select(b, a, no, yes);
            graph.select(a, b, no, not_above)
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/expr/lowering.rs"]
mod tests;
