//! Nodes, and the exact identities by which they are built.

use std::collections::{HashMap, HashSet};
use std::fmt;
use std::sync::Arc;

use crate::num::Rational;
use crate::units::Dimension;

/// A node of a [`Graph`]; equal nodes are equal expressions. Nodes that others are made of have smaller numbers.
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
    const fn is_odd(self) -> bool {
        matches!(self, Self::Sin | Self::Tan | Self::Asin | Self::Atan)
    }

    /// Whether `f(−x) = f(x)`.
    const fn is_even(self) -> bool {
        matches!(self, Self::Cos | Self::Abs)
    }
}

/// A function given by polynomials between knots; the first and the last continue outside them.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct PiecewisePolynomial {
    /// Where the pieces meet, rising.
    pub knots: Vec<Rational>,
    /// Of each piece: where its argument is zero, and its coefficients, constant first.
    pub pieces: Vec<(Rational, Vec<Rational>)>,
}

impl PiecewisePolynomial {
    /// Straight lines through points, level outside them. None if the points do not rise or there are none.
    pub fn through(points: &[(Rational, Rational)]) -> Option<Self> {
        let (first, last) = (points.first()?, points.last()?);
        if points.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
            return None;
        }
        let level = |(x, y): &(Rational, Rational)| (x.clone(), vec![y.clone()]);
        let line = |pair: &[(Rational, Rational)]| {
            let slope = (&pair[1].1 - &pair[0].1) / (&pair[1].0 - &pair[0].0);
            (pair[0].0.clone(), vec![pair[0].1.clone(), slope])
        };
        let pieces = std::iter::once(level(first)).chain(points.windows(2).map(line)).chain([level(last)]);
        Some(Self { knots: points.iter().map(|(x, _)| x.clone()).collect(), pieces: pieces.collect() })
    }

    /// Cubics through points with a slope at each, continued outside the first and the last by straight lines or level. None if the points
    /// do not rise or there are none. Value and slope are continuous exactly.
    pub fn smooth(points: &[(Rational, Rational)], slopes: &[Rational], straight: bool) -> Option<Self> {
        let line = |(x, y): &(Rational, Rational), slope: &Rational| {
            (x.clone(), if straight { vec![y.clone(), slope.clone()] } else { vec![y.clone()] })
        };
        if points.len() != slopes.len() || points.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
            return None;
        }
        let mut pieces = vec![line(points.first()?, slopes.first()?)];
        for (pair, slope) in points.windows(2).zip(slopes.windows(2)) {
            // y0 + d0 t + a t^2 + b t^3 with both ends and both slopes.
            let [(x0, y0), (x1, y1)] = pair else { return None };
            let [d0, d1] = slope else { return None };
            let h = x1 - x0;
            let chord = (y1 - y0) / &h;
            let a = (&chord * Rational::from(3) - d0 * Rational::from(2) - d1) / &h;
            let b = (d0 + d1 - &chord * Rational::from(2)) / (&h * &h);
            pieces.push((x0.clone(), vec![y0.clone(), d0.clone(), a, b]));
        }
        pieces.push(line(points.last()?, slopes.last()?));
        Some(Self { knots: points.iter().map(|(x, _)| x.clone()).collect(), pieces })
    }

    /// The exact value.
    pub fn value(&self, x: &Rational) -> Rational {
        let (origin, coefficients) = &self.pieces[self.knots.partition_point(|knot| knot <= x)];
        let x = x - origin;
        coefficients.iter().rev().fold(Rational::ZERO, |value, coefficient| &value * &x + coefficient)
    }

    /// The derivative; at a knot that of the piece behind it.
    #[must_use]
    pub fn derivative(&self) -> Self {
        let piece = |(origin, coefficients): &(Rational, Vec<Rational>)| {
            let factors = coefficients.iter().enumerate().skip(1);
            let derived: Vec<Rational> = factors.map(|(power, c)| c * Rational::from(power as u64)).collect();
            (origin.clone(), if derived.is_empty() { vec![Rational::ZERO] } else { derived })
        };
        Self { knots: self.knots.clone(), pieces: self.pieces.iter().map(piece).collect() }
    }

    /// The table of the opposite argument.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let piece = |(origin, coefficients): &(Rational, Vec<Rational>)| {
            let signs = coefficients.iter().enumerate();
            (-origin, signs.map(|(k, c)| if k % 2 == 1 { -c } else { c.clone() }).collect())
        };
        Self {
            knots: self.knots.iter().rev().map(|knot| -knot).collect(),
            pieces: self.pieces.iter().rev().map(piece).collect(),
        }
    }

    /// Knots at which the value has a jump or a kink.
    pub fn kinks(&self) -> Vec<Rational> {
        let slope = self.derivative();
        let ends = |table: &Self, knot: usize| {
            let x = &table.knots[knot];
            let at = |piece: usize| {
                let (origin, coefficients) = &table.pieces[piece];
                let x = x - origin;
                coefficients.iter().rev().fold(Rational::ZERO, |value, c| &value * &x + c)
            };
            at(knot) == at(knot + 1)
        };
        let smooth = |knot: &usize| ends(self, *knot) && ends(&slope, *knot);
        (0..self.knots.len()).filter(|knot| !smooth(knot)).map(|knot| self.knots[knot].clone()).collect()
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

/// Expressions that share what they have in common.
///
/// ```
/// use kardan::expr::Graph;
/// use kardan::units::Dimension;
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
    pub(super) nodes: Vec<Node>,
    index: HashMap<Node, Expr>,
    /// The first symbol of each name.
    names: HashMap<String, Symbol>,
    pub(super) symbols: Vec<(String, Dimension)>,
    pub(super) tables: Vec<PiecewisePolynomial>,
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
        if let Some(existing) = self.index.get(&node) {
            return *existing;
        }
        let expr = Expr(u32::try_from(self.nodes.len()).expect("below four thousand million nodes"));
        self.nodes.push(node.clone());
        self.index.insert(node, expr);
        expr
    }

    /// Whether it is the same, node by node.
    pub(crate) fn has_nodes_of(&self, other: &Self) -> bool {
        (&self.nodes, &self.symbols, &self.tables) == (&other.nodes, &other.symbols, &other.tables)
    }

    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
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
        self.index.get(&Node::Symbol(symbol)).copied()
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
        flat.sort_by_key(|(term, _)| *term);
        let mut terms: Vec<(Expr, Rational)> = Vec::with_capacity(flat.len());
        for (term, factor) in flat {
            match terms.last_mut() {
                Some((last, sum)) if *last == term => *sum += factor,
                _ => terms.push((term, factor)),
            }
        }
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
            Node::Sum { constant, terms } if !constant.is_zero() || terms.len() > 1 => self.put(Node::Group(expr)),
            _ => expr,
        }
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
            if own.is_zero() && *power < 0 {
                flat.push((*factor, *power));
                continue;
            }
            number *= raised(&own, *power);
            match rest.map(|rest| (rest, self.node(rest))) {
                None => {}
                Some((_, Node::Product(inner))) => flat.extend(inner.iter().map(|(f, p)| (*f, p * power))),
                Some((rest, _)) => flat.push((rest, *power)),
            }
        }
        if number.is_zero() {
            return self.integer(0);
        }
        flat.sort_by_key(|(factor, _)| *factor);
        let mut factors: Vec<(Expr, i32)> = Vec::with_capacity(flat.len());
        for (factor, power) in flat {
            match factors.last_mut() {
                Some((last, sum)) if *last == factor => *sum += power,
                _ => factors.push((factor, power)),
            }
        }
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
        let number = self.tables.iter().position(|candidate| *candidate == table).unwrap_or_else(|| {
            self.tables.push(table);
            self.tables.len() - 1
        });
        self.put(Node::Table(number as u32, x))
    }

    /// The nodes that an expression is made of directly.
    pub(super) fn parts(&self, expr: Expr) -> Vec<Expr> {
        let mut out = Vec::new();
        self.each_part(expr, |part| out.push(part));
        out
    }

    /// The same one by one.
    pub(super) fn each_part(&self, expr: Expr, mut look: impl FnMut(Expr)) {
        match self.node(expr) {
            Node::Number(_) | Node::Pi | Node::Symbol(_) => {}
            Node::Sum { terms, .. } => terms.iter().for_each(|(term, _)| look(*term)),
            Node::Product(factors) => factors.iter().for_each(|(factor, _)| look(*factor)),
            Node::Apply(_, a) | Node::Table(_, a) | Node::Group(a) => look(*a),
            Node::Atan2(a, b) | Node::Min(a, b) | Node::Max(a, b) => [a, b].into_iter().for_each(|part| look(*part)),
            Node::Select(parts) => parts.iter().for_each(|part| look(*part)),
        }
    }

    /// All subexpressions of expressions, themselves included, parts before the whole.
    pub(super) fn needed(&self, exprs: &[Expr]) -> Vec<Expr> {
        self.needed_besides(exprs, |_| false)
    }

    /// The same without the given ones and their subexpressions.
    fn needed_besides(&self, exprs: &[Expr], excluded: impl Fn(Expr) -> bool) -> Vec<Expr> {
        // One bit each: most often few of many are needed.
        let mut visited = vec![0u64; self.nodes.len() / 64 + 1];
        let (mut open, mut needed) = (exprs.to_vec(), Vec::new());
        while let Some(expr) = open.pop() {
            let (word, bit) = (&mut visited[expr.0 as usize / 64], 1 << (expr.0 % 64));
            if *word & bit == 0 && !excluded(expr) {
                *word |= bit;
                needed.push(expr);
                self.each_part(expr, |part| open.push(part));
            }
        }
        // A node is made after its parts.
        needed.sort_unstable();
        needed
    }

    /// Those of all that expressions are made of that move with a symbol, parts before the whole.
    pub(super) fn moved(&self, exprs: &[Expr], by: Symbol) -> Vec<Expr> {
        let mut moved = vec![false; self.nodes.len()];
        let mut out = self.needed(exprs);
        out.retain(|expr| {
            let mut moves = self.symbol_of(*expr) == Some(by);
            self.each_part(*expr, |part| moves |= moved[part.0 as usize]);
            moved[expr.0 as usize] = moves;
            moves
        });
        out
    }

    /// Common divisors of several products of the graph.
    pub(super) fn shared_divisors(&self) -> HashSet<Expr> {
        let (mut once, mut shared) = (HashSet::new(), HashSet::new());
        for node in &self.nodes {
            let Node::Product(factors) = node else { continue };
            for (factor, _) in factors.iter().filter(|(_, power)| *power < 0) {
                if !once.insert(*factor) {
                    shared.insert(*factor);
                }
            }
        }
        shared
    }

    /// An expression as a constant and terms with their factors.
    pub fn terms(&self, expr: Expr) -> (Rational, Vec<(Expr, Rational)>) {
        match self.node(expr) {
            Node::Number(value) => (value.clone(), Vec::new()),
            Node::Sum { constant, terms } => (constant.clone(), terms.clone()),
            _ => (Rational::ZERO, vec![(expr, Rational::ONE)]),
        }
    }

    /// The symbols that expressions depend on, in the order in which they were made.
    pub fn symbols(&self, exprs: &[Expr]) -> Vec<Symbol> {
        let mut found: Vec<Symbol> = self.needed(exprs).into_iter().filter_map(|expr| self.symbol_of(expr)).collect();
        found.sort();
        found
    }

    /// The same of each of several expressions, in one pass over all that they are made of.
    pub fn symbols_of_each(&self, exprs: &[Expr]) -> Vec<Arc<[Symbol]>> {
        let none: Arc<[Symbol]> = Arc::from([]);
        let mut found: HashMap<Expr, Arc<[Symbol]>> = HashMap::new();
        for expr in self.needed(exprs) {
            let mut own = self.symbol_of(expr).map_or_else(|| Arc::clone(&none), |symbol| Arc::from([symbol]));
            // Most parts depend on the same ones.
            let mut further_parts: Vec<&Arc<[Symbol]>> = Vec::new();
            self.each_part(expr, |part| {
                let of_part = &found[&part];
                if own.is_empty() {
                    own = Arc::clone(of_part);
                } else if !of_part.is_empty() && **of_part != *own {
                    further_parts.push(of_part);
                }
            });
            if !further_parts.is_empty() {
                let mut all: Vec<Symbol> =
                    own.iter().chain(further_parts.into_iter().flat_map(|other| other.iter())).copied().collect();
                all.sort();
                all.dedup();
                own = all.into();
            }
            found.insert(expr, own);
        }
        exprs.iter().map(|expr| Arc::clone(&found[expr])).collect()
    }

    /// Of each expression, whether it depends on a symbol.
    pub fn varying(&self) -> impl Fn(Expr) -> bool + use<> {
        let mut varying = vec![false; self.nodes.len()];
        for k in 0..self.nodes.len() {
            let expr = Expr(k as u32);
            let own = self.parts(expr).iter().any(|part| varying[part.0 as usize]);
            varying[k] = own || self.symbol_of(expr).is_some();
        }
        move |expr| varying[expr.0 as usize]
    }

    /// Of each expression, whether it is constant or a sum of symbols times constants and a constant.
    pub fn affine(&self) -> impl Fn(Expr) -> bool + use<> {
        // Degree in all symbols together; two means any other expression.
        let mut degrees = vec![0u8; self.nodes.len()];
        for k in 0..self.nodes.len() {
            let expr = Expr(k as u32);
            let degree = |part: &Expr| degrees[part.0 as usize];
            degrees[k] = match self.node(expr) {
                Node::Number(_) | Node::Pi => 0,
                Node::Symbol(_) => 1,
                Node::Sum { terms, .. } => terms.iter().map(|(term, _)| degree(term)).max().unwrap_or(0),
                Node::Group(part) => degree(part),
                Node::Product(factors) => {
                    let of_factor = |(factor, power): &(Expr, i32)| match (degree(factor), *power) {
                        (0, _) => 0,
                        (1, 1) => 1,
                        _ => 2,
                    };
                    factors.iter().map(of_factor).fold(0, |sum: u8, one| sum.saturating_add(one)).min(2)
                }
                _ => 2 * self.parts(expr).iter().map(degree).max().unwrap_or(0).min(1),
            };
        }
        move |expr| degrees[expr.0 as usize] <= 1
    }

    /// The same node made of other parts.
    pub(super) fn rebuilt(&mut self, expr: Expr, part: impl Fn(Expr) -> Expr) -> Expr {
        let table = |graph: &Self, number: u32| graph.tables[number as usize].clone();
        self.made_of(expr, self.node(expr).clone(), table, part)
    }

    /// The node of another graph made of parts of this one; no symbol.
    pub(super) fn remade(&mut self, other: &Self, expr: Expr, part: impl Fn(Expr) -> Expr) -> Expr {
        let node = other.node(expr).clone();
        let constant = match node {
            Node::Number(ref value) => self.number(value.clone()),
            Node::Pi => self.pi(),
            _ => expr,
        };
        self.made_of(constant, node, |_, number| other.tables[number as usize].clone(), part)
    }

    /// A node of parts; what has none is given.
    fn made_of(
        &mut self,
        constant: Expr,
        node: Node,
        table: impl Fn(&Self, u32) -> PiecewisePolynomial,
        part: impl Fn(Expr) -> Expr,
    ) -> Expr {
        match node {
            Node::Number(_) | Node::Pi | Node::Symbol(_) => constant,
            Node::Sum { constant, terms } => {
                let terms: Vec<_> = terms.into_iter().map(|(term, factor)| (part(term), factor)).collect();
                self.sum(constant, &terms)
            }
            Node::Product(factors) => {
                let factors: Vec<_> = factors.into_iter().map(|(factor, power)| (part(factor), power)).collect();
                self.product(&factors)
            }
            Node::Apply(function, a) => self.apply(function, part(a)),
            Node::Group(a) => self.group(part(a)),
            Node::Atan2(y, x) => self.atan2(part(y), part(x)),
            Node::Min(a, b) => self.min(part(a), part(b)),
            Node::Max(a, b) => self.max(part(a), part(b)),
            Node::Select([a, b, c, d]) => self.select(part(a), part(b), part(c), part(d)),
            Node::Table(number, x) => {
                let table = table(self, number);
                self.table(table, part(x))
            }
        }
    }

    /// A graph of what expressions need alone, in the same order, and what each of their nodes is there, in order too.
    pub(crate) fn extract(&self, exprs: &[Expr]) -> (Self, Vec<(Expr, Expr)>) {
        let (mut own, mut new) = (Self::default(), HashMap::new());
        let needed = self.needed(exprs);
        for expr in &needed {
            let copy = match self.symbol_of(*expr).map(|symbol| self.name(symbol)) {
                Some((name, dimension)) => own.new_symbol(name.to_owned(), dimension),
                None => own.remade(self, *expr, |part| new[&part]),
            };
            new.insert(*expr, copy);
        }
        (own, needed.into_iter().map(|expr| (expr, new[&expr])).collect())
    }

    /// Expressions with other expressions in place of symbols.
    pub fn substitute(&mut self, exprs: &[Expr], values: &[(Symbol, Expr)]) -> Vec<Expr> {
        let mut substitution = Substitution::default();
        values.iter().for_each(|(symbol, value)| substitution.set(*symbol, *value));
        substitution.of(self, exprs)
    }

    /// Expressions with others in place of some within them.
    pub fn replace(&mut self, exprs: &[Expr], replacements: &[(Expr, Expr)]) -> Vec<Expr> {
        let mut new: HashMap<Expr, Expr> = HashMap::new();
        for expr in self.needed(exprs) {
            let value = match replacements.iter().find(|(own, _)| *own == expr) {
                Some((_, value)) => *value,
                None => self.rebuilt(expr, |part| new[&part]),
            };
            new.insert(expr, value);
        }
        exprs.iter().map(|expr| new[expr]).collect()
    }

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

/// Expressions in place of symbols, in one expression after the other: what was made for one is not made again for the next.
#[derive(Debug, Clone, Default)]
pub struct Substitution {
    values: HashMap<Symbol, Expr>,
    made: HashMap<Expr, Expr>,
}

impl Substitution {
    /// Puts an expression in place of a symbol, in all expressions that come from here on; the first of a symbol counts.
    pub fn set(&mut self, symbol: Symbol, value: Expr) {
        self.values.entry(symbol).or_insert(value);
    }

    /// Expressions with those of the symbols put in.
    pub fn of(&mut self, graph: &mut Graph, exprs: &[Expr]) -> Vec<Expr> {
        for expr in graph.needed_besides(exprs, |expr| self.made.contains_key(&expr)) {
            let value = match graph.symbol_of(expr) {
                Some(symbol) => self.values.get(&symbol).map_or(expr, |value| *value),
                None => graph.rebuilt(expr, |part| self.made[&part]),
            };
            self.made.insert(expr, value);
        }
        exprs.iter().map(|expr| self.made[expr]).collect()
    }
}

/// A power of a number that is not zero if the power is negative.
pub(super) fn raised(value: &Rational, power: i32) -> Rational {
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
