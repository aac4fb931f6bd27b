//! Expressions as operations, one way for all numbers: so a plan and an evaluation agree to the last bit.

use std::cell::OnceCell;
use std::collections::{HashMap, HashSet};

use kardan_rt::Operator;

use super::graph::raised;
use super::nodes::Node;
use super::{Domain, Expr, Function, Graph, Symbol};
use kardan_math::num::{Rational, Scalar, rational_from_f64};
use kardan_math::units::Exact;

/// Evaluates expressions over the numbers of a domain, given those of their symbols.
///
/// ```
/// use kardan_expr::expr::{Floating, Function, Graph, Rationals, lower};
/// use kardan_math::units::Dimension;
/// let mut graph = Graph::default();
/// let x = graph.symbol("x", Dimension::NONE);
/// let third = graph.scale(kardan_math::num::Rational::from_parts(1.into(), 3u8.into()), x);
/// let exact = lower(&graph, &[third], &mut Rationals, |_| Some(2.into()));
/// assert_eq!(exact[0].as_ref().unwrap().to_string(), "2/3");
/// let sine = graph.apply(Function::Sin, third);
/// assert_eq!(lower(&graph, &[sine], &mut Floating::<f64>::default(), |_| 0.0), [0.0]);
/// ```
pub fn lower<D: Domain>(
    graph: &Graph,
    exprs: &[Expr],
    domain: &mut D,
    mut symbol: impl FnMut(Symbol) -> D::Value,
) -> Vec<D::Value> {
    let mut lowering = Lowering {
        graph,
        domain,
        values: HashMap::new(),
        angles: HashMap::new(),
        divisors: OnceCell::new(),
        reciprocals: HashMap::new(),
    };
    for expr in graph.needed(exprs) {
        if let Some(found) = graph.symbol_of(expr) {
            lowering.values.insert(expr, symbol(found));
        } else if !lowering.is_constant(expr) {
            let value = lowering.value(expr);
            lowering.values.insert(expr, value);
        }
    }
    exprs.iter().map(|expr| lowering.get(*expr)).collect()
}

struct Lowering<'a, D: Domain> {
    graph: &'a Graph,
    domain: &'a mut D,
    /// Not a constant.
    values: HashMap<Expr, D::Value>,
    /// Sine and cosine of an argument.
    angles: HashMap<Expr, [D::Value; 2]>,
    /// Common divisors of several products, and their reciprocals.
    divisors: OnceCell<HashSet<Expr>>,
    reciprocals: HashMap<Expr, D::Value>,
}

impl<D: Domain> Lowering<'_, D> {
    fn is_shared_divisor(&self, expr: &Expr) -> bool {
        self.divisors.get_or_init(|| self.graph.shared_divisors()).contains(expr)
    }

    /// Whether it is a rational times a power of π.
    fn is_constant(&self, expr: Expr) -> bool {
        self.constant(expr).is_some()
    }

    /// The number that a constant is, with each power of π as the double next to it.
    fn constant(&self, expr: Expr) -> Option<Rational> {
        let part = |part: &Expr| match self.graph.node(*part) {
            Node::Number(value) => Some(value.clone()),
            Node::Pi => rational_from_f64(std::f64::consts::PI),
            Node::Product(factors) => match factors.as_slice() {
                [(factor, power)] if *self.graph.node(*factor) == Node::Pi => {
                    Some(Exact::new(Rational::ONE, *power).to_rational())
                }
                _ => None,
            },
            _ => None,
        };
        match self.graph.node(expr) {
            Node::Sum { constant, terms } => {
                terms.iter().try_fold(constant.clone(), |sum, (term, factor)| Some(sum + part(term)? * factor))
            }
            _ => part(&expr),
        }
    }

    fn get(&mut self, expr: Expr) -> D::Value {
        if let Some(cached) = self.values.get(&expr) {
            return cached.clone();
        }
        // Not computed where it is in a product or a sum, whose constants are rounded together.
        let constant = self.constant(expr).unwrap_or(Rational::ZERO);
        self.domain.constant(&constant)
    }

    fn value(&mut self, expr: Expr) -> D::Value {
        match self.graph.node(expr) {
            Node::Number(value) => self.domain.constant(value),
            Node::Pi | Node::Symbol(_) => self.get(expr),
            Node::Group(a) => self.get(*a),
            Node::Sum { constant, terms } => self.sum(constant, terms),
            Node::Product(factors) => {
                let (number, rest) = self.product(factors);
                match (number.is_one(), rest) {
                    (true, Some(rest)) => rest,
                    (_, rest) => {
                        let number = self.domain.constant(&number);
                        match rest {
                            Some(rest) => self.domain.operation(Operator::Multiply, &[number, rest]),
                            None => number,
                        }
                    }
                }
            }
            Node::Apply(function @ (Function::Sin | Function::Cos), a) => {
                let (function, a) = (*function, *a);
                if !self.angles.contains_key(&a) {
                    let angle = self.get(a);
                    let both = self.domain.sine_cosine(&angle);
                    self.angles.insert(a, both);
                }
                self.angles[&a][usize::from(function == Function::Cos)].clone()
            }
            Node::Apply(function, a) => {
                let a = self.get(*a);
                self.domain.operation(operator(*function), &[a])
            }
            Node::Atan2(a, b) => self.both(Operator::ArcTangent2, *a, *b),
            Node::Min(a, b) => self.both(Operator::Minimum, *a, *b),
            Node::Max(a, b) => self.both(Operator::Maximum, *a, *b),
            Node::Select(parts) => {
                let parts = parts.map(|part| self.get(part));
                self.domain.operation(Operator::Select, &parts)
            }
            Node::Table(number, x) => {
                let x = self.get(*x);
                self.domain.table(&self.graph.tables[*number as usize], &x)
            }
        }
    }

    fn both(&mut self, operator: Operator, a: Expr, b: Expr) -> D::Value {
        let operands = [self.get(a), self.get(b)];
        self.domain.operation(operator, &operands)
    }

    /// Terms one after the other in their order, behind the constant; the first is one that is not subtracted, if there is one.
    fn sum(&mut self, constant: &Rational, terms: &[(Expr, Rational)]) -> D::Value {
        let mut constant = constant.clone();
        let mut rest: Vec<(Rational, D::Value)> = Vec::with_capacity(terms.len());
        for (term, factor) in terms {
            match (self.constant(*term), self.graph.node(*term)) {
                (Some(value), _) => constant += value * factor,
                // Of a product the constants are rounded with the factor.
                (None, Node::Product(factors)) if factors.iter().any(|(part, _)| self.is_constant(*part)) => {
                    match self.product(factors) {
                        (number, Some(value)) => rest.push((number * factor, value)),
                        (number, None) => constant += number * factor,
                    }
                }
                (None, _) => {
                    let value = self.get(*term);
                    rest.push((factor.clone(), value));
                }
            }
        }
        let minus = Rational::from(-1);
        let mut sum = if constant.is_zero() && !rest.is_empty() {
            let first = rest.iter().position(|(factor, _)| *factor != minus).unwrap_or(0);
            let (factor, value) = rest.remove(first);
            if factor.is_one() {
                value
            } else if factor == minus {
                self.domain.operation(Operator::Negate, &[value])
            } else {
                let factor = self.domain.constant(&factor);
                self.domain.operation(Operator::Multiply, &[factor, value])
            }
        } else {
            self.domain.constant(&constant)
        };
        for (factor, value) in rest {
            sum = if factor.is_one() {
                self.domain.operation(Operator::Add, &[sum, value])
            } else if factor == minus {
                self.domain.operation(Operator::Subtract, &[sum, value])
            } else {
                let factor = self.domain.constant(&factor);
                let product = self.domain.operation(Operator::Multiply, &[factor, value]);
                self.domain.operation(Operator::Add, &[sum, product])
            };
        }
        sum
    }

    /// The constants of a product, and the rest of it: factors with positive powers over those with negative ones. What several products are
    /// divided by divides once: they are multiplied by one over it.
    fn product(&mut self, factors: &[(Expr, i32)]) -> (Rational, Option<D::Value>) {
        let mut number = Rational::ONE;
        let [mut above, mut below] = [None, None];
        for (factor, power) in factors {
            match self.constant(*factor).filter(|value| !Scalar::is_zero(value)) {
                Some(value) => number *= raised(&value, *power),
                None => {
                    let value = self.get(*factor);
                    let inverted = *power < 0 && self.is_shared_divisor(factor);
                    let value = if inverted { self.reciprocal(*factor, value) } else { value };
                    let side = if *power > 0 || inverted { &mut above } else { &mut below };
                    let raised = self.raised(value, power.unsigned_abs());
                    *side = Some(match side.take() {
                        Some(product) => self.domain.operation(Operator::Multiply, &[product, raised]),
                        None => raised,
                    });
                }
            }
        }
        let value = match (above, below) {
            (above, None) => above,
            (Some(above), Some(below)) => Some(self.domain.operation(Operator::Divide, &[above, below])),
            (None, Some(below)) => {
                let above = self.domain.constant(&std::mem::replace(&mut number, Rational::ONE));
                Some(self.domain.operation(Operator::Divide, &[above, below]))
            }
        };
        (number, value)
    }

    fn reciprocal(&mut self, factor: Expr, value: D::Value) -> D::Value {
        if let Some(cached) = self.reciprocals.get(&factor) {
            return cached.clone();
        }
        let one = self.domain.constant(&Rational::ONE);
        let reciprocal = self.domain.operation(Operator::Divide, &[one, value]);
        self.reciprocals.insert(factor, reciprocal.clone());
        reciprocal
    }

    /// A power by squaring.
    fn raised(&mut self, value: D::Value, power: u32) -> D::Value {
        if power <= 1 {
            return value;
        }
        let half = self.raised(value.clone(), power / 2);
        let square = self.domain.operation(Operator::Multiply, &[half.clone(), half]);
        if power.is_multiple_of(2) { square } else { self.domain.operation(Operator::Multiply, &[square, value]) }
    }
}

fn operator(function: Function) -> Operator {
    match function {
        Function::Sqrt => Operator::SquareRoot,
        Function::Sin | Function::Cos => Operator::SineCosine,
        Function::Tan => Operator::Tangent,
        Function::Asin => Operator::ArcSine,
        Function::Acos => Operator::ArcCosine,
        Function::Atan => Operator::ArcTangent,
        Function::Exp => Operator::Exponential,
        Function::Ln => Operator::Logarithm,
        Function::Abs => Operator::Absolute,
    }
}
