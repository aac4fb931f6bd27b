//! The graph, and the exact identities by which its nodes are built.

use std::collections::HashMap;
use std::fmt;

use dashu_int::ops::BitTest;
use indexmap::IndexSet;
use kardan_math::num::Rational;
use kardan_math::units::Dimension;

use super::nodes::{Expr, Function, Node, Symbol};
use super::piecewise_polynomial::PiecewisePolynomial;

/// Largest power of a factor, and most binary digits of a number, that a product takes from its factors: beyond them it leaves the factor as it is, so that
/// repeated squares neither fill the memory nor leave the range of doubles where their values do not.
const MOST_POWER: i32 = 1 << 20;
const MOST_BITS: usize = 1000;
/// The most terms of a sum that is not large.
const MOST_TERMS: usize = 32;

/// Entries each once, in their order, with their numbers.
pub(crate) type Distinct<T> = IndexSet<T, foldhash::fast::RandomState>;

/// Expressions that share what they have in common.
///
/// ```
/// use kardan_expr::expr::Graph;
/// use kardan_math::units::Dimension;
/// let mut graph = Graph::default();
/// let x = graph.symbol("x", Dimension::NONE);
/// let square = graph.multiply(x, x);
/// // (x + 1)² − 2x − 1 is not expanded, x·x − x² is nothing.
/// let power = graph.power(x, 2);
/// assert_eq!(graph.subtract(square, power), graph.integer(0));
/// let slope = graph.derivative(square, graph.symbol_of(x).unwrap());
/// let twice = graph.scale(2.into(), x);
/// assert_eq!(slope, twice);
/// ```
#[derive(Clone, Default)]
pub struct Graph {
    pub(super) nodes: Distinct<Node>,
    /// The first symbol of each name.
    names: HashMap<String, Symbol>,
    pub(super) symbols: Vec<(String, Dimension)>,
    pub(super) tables: Distinct<PiecewisePolynomial>,
}

/// Equal graphs have equal texts: the index has no order, and follows from the nodes.
impl fmt::Debug for Graph {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { nodes, symbols, tables, .. } = self;
        f.debug_struct("Graph")
            .field("nodes", nodes)
            .field("symbols", symbols)
            .field("tables", tables)
            .finish_non_exhaustive()
    }
}

impl Graph {
    pub(super) fn node(&self, expr: Expr) -> &Node {
        &self.nodes[expr.0 as usize]
    }

    fn put(&mut self, node: Node) -> Expr {
        let (number, _) = self.nodes.insert_full(node);
        Expr(u32::try_from(number).expect("below four thousand million nodes"))
    }

    /// Whether it is the same, node by node.
    pub fn has_nodes_of(&self, other: &Self) -> bool {
        (self.nodes.as_slice(), &self.symbols) == (other.nodes.as_slice(), &other.symbols)
            && self.tables.as_slice() == other.tables.as_slice()
    }

    /// An exact number.
    pub fn number(&mut self, value: Rational) -> Expr {
        self.put(Node::Number(value))
    }

    /// A whole number.
    pub fn integer(&mut self, value: i64) -> Expr {
        self.number(value.into())
    }

    /// An expression that never has a value.
    pub fn without_value(&mut self) -> Expr {
        let below = self.integer(-1);
        self.apply(Function::Ln, below)
    }

    /// π
    pub fn pi(&mut self) -> Expr {
        self.put(Node::Pi)
    }

    /// The symbol of a name; a new one if there is none.
    pub fn symbol(&mut self, name: &str, dimension: Dimension) -> Expr {
        match self.names.get(name) {
            Some(existing) => self.put(Node::Symbol(*existing)),
            None => self.new_symbol(name.to_owned(), dimension),
        }
    }

    /// A new symbol, also where there is one of its name.
    pub fn new_symbol(&mut self, name: String, dimension: Dimension) -> Expr {
        let symbol = Symbol(self.symbols.len() as u32);
        self.names.entry(name.clone()).or_insert(symbol);
        self.symbols.push((name, dimension));
        self.put(Node::Symbol(symbol))
    }

    /// The symbol that an expression is.
    pub fn symbol_of(&self, expr: Expr) -> Option<Symbol> {
        match self.node(expr) {
            Node::Symbol(symbol) => Some(*symbol),
            _ => None,
        }
    }

    /// The expression that a symbol is; `None` if it is of another graph.
    pub fn of_symbol(&self, symbol: Symbol) -> Option<Expr> {
        self.nodes.get_index_of(&Node::Symbol(symbol)).map(|number| Expr(number as u32))
    }

    /// Name and dimension of a symbol.
    pub fn name(&self, symbol: Symbol) -> (&str, Dimension) {
        let (name, dimension) = &self.symbols[symbol.0 as usize];
        (name, *dimension)
    }

    /// The exact number that an expression is.
    pub fn number_of(&self, expr: Expr) -> Option<&Rational> {
        match self.node(expr) {
            Node::Number(value) => Some(value),
            _ => None,
        }
    }

    /// Whether it is exactly zero.
    pub fn is_zero(&self, expr: Expr) -> bool {
        self.number_of(expr).is_some_and(Rational::is_zero)
    }

    /// `constant + Σ factor·term`.
    pub fn sum(&mut self, constant: Rational, terms: &[(Expr, Rational)]) -> Expr {
        let mut all = constant;
        let mut flat: Vec<(Expr, Rational)> = Vec::with_capacity(terms.len());
        for (term, factor) in terms {
            match self.node(*term) {
                Node::Number(value) => all += value * factor,
                Node::Sum { constant, terms } => {
                    all += constant * factor;
                    flat.extend(terms.iter().map(|(term, inner)| (*term, inner * factor)));
                }
                _ => flat.push((*term, factor.clone())),
            }
        }
        let mut terms = merged(flat, |a, b| Some(a + b));
        terms.retain(|(_, factor)| !factor.is_zero());
        match (all.is_zero(), terms.as_slice()) {
            (_, []) => self.number(all),
            (true, [(term, factor)]) if factor.is_one() => *term,
            _ => self.put(Node::Sum { constant: all, terms }),
        }
    }

    /// A sum that stays separate inside another sum: a small difference of large numbers, taken before it is multiplied.
    pub fn group(&mut self, expr: Expr) -> Expr {
        match self.node(expr) {
            Node::Sum { constant, terms } if !constant.is_zero() || terms.len() > 1 || has_long(terms) => {
                self.put(Node::Group(expr))
            }
            _ => expr,
        }
    }

    /// Whether it is a sum of many terms, or of long numbers: sums of sums of these, in a chain, would have as many terms as the chain, and longer numbers.
    pub fn is_large(&self, expr: Expr) -> bool {
        matches!(self.node(expr), Node::Sum { terms, .. } if terms.len() > MOST_TERMS || has_long(terms))
    }

    /// a + b
    pub fn add(&mut self, a: Expr, b: Expr) -> Expr {
        self.sum(Rational::ZERO, &[(a, Rational::ONE), (b, Rational::ONE)])
    }

    /// a − b
    pub fn subtract(&mut self, a: Expr, b: Expr) -> Expr {
        self.sum(Rational::ZERO, &[(a, Rational::ONE), (b, Rational::from(-1))])
    }

    /// factor·a
    pub fn scale(&mut self, factor: Rational, a: Expr) -> Expr {
        self.sum(Rational::ZERO, &[(a, factor)])
    }

    /// −a
    pub fn negate(&mut self, a: Expr) -> Expr {
        self.scale(Rational::from(-1), a)
    }

    /// The rational factor of a single term, and the rest.
    fn split(&self, expr: Expr) -> (Rational, Option<Expr>) {
        match self.node(expr) {
            Node::Number(value) => (value.clone(), None),
            Node::Sum { constant, terms } if constant.is_zero() && terms.len() == 1 => {
                (terms[0].1.clone(), Some(terms[0].0))
            }
            _ => (Rational::ONE, Some(expr)),
        }
    }

    /// `Π factor^power`; a factor that vanishes identically with a negative power stays as it is.
    pub fn product(&mut self, factors: &[(Expr, i32)]) -> Expr {
        let mut number = Rational::ONE;
        let mut flat: Vec<(Expr, i32)> = Vec::with_capacity(factors.len());
        for (factor, power) in factors {
            if *power == 0 {
                continue;
            }
            let (own, rest) = self.split(*factor);
            let raised_bits = bits(&own).saturating_mul(power.unsigned_abs() as usize);
            if own.is_zero() && *power < 0 || raised_bits > 0 && bits(&number) + raised_bits > MOST_BITS {
                flat.push((*factor, *power));
                continue;
            }
            number *= raised(&own, *power);
            match rest.map(|rest| (rest, self.node(rest))) {
                None => {}
                Some((_, Node::Product(inner))) if inner.iter().all(|(_, p)| fits(*p, *power)) => {
                    flat.extend(inner.iter().map(|(f, p)| (*f, p * power)));
                }
                Some((rest, _)) => flat.push((rest, *power)),
            }
        }
        if number.is_zero() {
            return self.integer(0);
        }
        let mut factors = merged(flat, |a, b| a.checked_add(*b));
        factors.retain(|(_, power)| *power != 0);
        let rest = match factors.as_slice() {
            [] => return self.number(number),
            [(factor, 1)] => *factor,
            _ => self.put(Node::Product(factors)),
        };
        self.scale(number, rest)
    }

    /// a·b
    pub fn multiply(&mut self, a: Expr, b: Expr) -> Expr {
        self.product(&[(a, 1), (b, 1)])
    }

    /// a/b
    pub fn divide(&mut self, a: Expr, b: Expr) -> Expr {
        self.product(&[(a, 1), (b, -1)])
    }

    /// aⁿ
    pub fn power(&mut self, a: Expr, n: i32) -> Expr {
        self.product(&[(a, n)])
    }

    /// f(a)
    pub fn apply(&mut self, function: Function, a: Expr) -> Expr {
        use Function::*;
        if let Some(value) = self.number_of(a).cloned() {
            let exact = match function {
                Sqrt => exact_root(&value),
                Sin | Tan | Asin | Atan if value.is_zero() => Some(Rational::ZERO),
                Cos | Exp if value.is_zero() => Some(Rational::ONE),
                Ln if value.is_one() => Some(Rational::ZERO),
                Abs => Some(if value < Rational::ZERO { -value } else { value }),
                _ => None,
            };
            if let Some(exact) = exact {
                return self.number(exact);
            }
        }
        if let Some(root) = (function == Sqrt).then(|| self.root_of_squares(a)).flatten() {
            return root;
        }
        let negative = match self.node(a) {
            Node::Number(value) => *value < Rational::ZERO,
            Node::Sum { terms, .. } => terms.first().is_some_and(|(_, factor)| *factor < Rational::ZERO),
            _ => false,
        };
        if negative && (function.is_odd() || function.is_even()) {
            let negated = self.negate(a);
            let value = self.put(Node::Apply(function, negated));
            return if function.is_odd() { self.negate(value) } else { value };
        }
        self.put(Node::Apply(function, a))
    }

    /// The root of a product of even powers, times the square of a fraction: a product of absolute values, whose kinks are known.
    fn root_of_squares(&mut self, a: Expr) -> Option<Expr> {
        let (product, factor) = match self.node(a) {
            Node::Sum { constant, terms } if constant.is_zero() && terms.len() == 1 => terms[0].clone(),
            Node::Product(_) => (a, Rational::ONE),
            _ => return None,
        };
        let Node::Product(factors) = self.node(product).clone() else { return None };
        if factors.iter().any(|(_, power)| power % 2 != 0) {
            return None;
        }
        let mut out = self.number(exact_root(&factor)?);
        for (factor, power) in factors {
            let size = self.apply(Function::Abs, factor);
            let part = self.power(size, power / 2);
            out = self.multiply(out, part);
        }
        Some(out)
    }

    /// The angle of the point (x, y).
    pub fn atan2(&mut self, y: Expr, x: Expr) -> Expr {
        self.put(Node::Atan2(y, x))
    }

    /// The smaller one.
    pub fn min(&mut self, a: Expr, b: Expr) -> Expr {
        if a == b { a } else { self.put(Node::Min(a, b)) }
    }

    /// The larger one.
    pub fn max(&mut self, a: Expr, b: Expr) -> Expr {
        if a == b { a } else { self.put(Node::Max(a, b)) }
    }

    /// `then` where `a < b`, else `otherwise`.
    pub fn select(&mut self, a: Expr, b: Expr, then: Expr, otherwise: Expr) -> Expr {
        if then == otherwise {
            return then;
        }
        match (self.number_of(a), self.number_of(b)) {
            (Some(a), Some(b)) if a < b => then,
            (Some(_), Some(_)) => otherwise,
            _ => self.put(Node::Select([a, b, then, otherwise])),
        }
    }

    /// A table at x.
    pub fn table(&mut self, table: PiecewisePolynomial, x: Expr) -> Expr {
        if table.pieces.iter().all(|(_, coefficients)| coefficients.iter().all(Rational::is_zero)) {
            return self.integer(0);
        }
        let (number, _) = self.tables.insert_full(table);
        self.put(Node::Table(number as u32, x))
    }
}

/// Whether a factor of these has more digits than numbers in products.
fn has_long(terms: &[(Expr, Rational)]) -> bool {
    terms.iter().any(|(_, factor)| bits(factor) > MOST_BITS)
}

/// Parts in order, each once: the numbers of equal ones are added, if `add` can do so.
fn merged<N>(mut parts: Vec<(Expr, N)>, add: impl Fn(&N, &N) -> Option<N>) -> Vec<(Expr, N)> {
    parts.sort_by_key(|(part, _)| *part);
    let mut out: Vec<(Expr, N)> = Vec::with_capacity(parts.len());
    for (part, number) in parts {
        match out.last_mut().filter(|(last, _)| *last == part).map(|(_, own)| (add(own, &number), own)) {
            Some((Some(sum), own)) => *own = sum,
            _ => out.push((part, number)),
        }
    }
    out
}

/// Whether the power of a power is one that a product takes apart.
fn fits(inner: i32, outer: i32) -> bool {
    inner.checked_mul(outer).is_some_and(|power| power.abs() <= MOST_POWER)
}

/// Binary digits of a fraction that is not 0, 1 or −1.
fn bits(value: &Rational) -> usize {
    match value.numerator().bit_len().max(value.denominator().bit_len()) {
        0 | 1 => 0,
        bits => bits,
    }
}

/// A power of a number that is not zero if the power is negative.
pub fn raised(value: &Rational, power: i32) -> Rational {
    let whole = value.pow(power.unsigned_abs() as isize);
    if power < 0 { Rational::ONE / whole } else { whole }
}

/// The root of a number that is the square of a fraction.
fn exact_root(value: &Rational) -> Option<Rational> {
    if *value < Rational::ZERO {
        return None;
    }
    let root = |whole: &dashu_int::UBig| {
        let root = whole.nth_root(2);
        (&root * &root == *whole).then_some(root)
    };
    let numerator = dashu_int::UBig::try_from(value.numerator().clone()).ok()?;
    Some(Rational::from_parts(root(&numerator)?.into(), root(value.denominator())?))
}
