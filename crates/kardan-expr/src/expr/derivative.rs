//! Exact derivatives, and where they do not exist.

use std::collections::HashMap;

use super::nodes::Node;
use super::{Expr, Function, Graph, Symbol};
use kardan_math::num::Rational;

/// Slopes of expressions, as far as they are not zero.
struct Found {
    zero: Expr,
    slopes: HashMap<Expr, Expr>,
}

impl Found {
    fn of(&self, expr: &Expr) -> Expr {
        self.slopes.get(expr).copied().unwrap_or(self.zero)
    }
}

impl Graph {
    /// The derivative of an expression by a symbol; at kinks ([`kinks`](Self::kinks)) that of one side, the same for all its parts: where every guard
    /// that the symbol moves, written such that its first term is not subtracted, is above zero.
    pub fn derivative(&mut self, expr: Expr, by: Symbol) -> Expr {
        self.derivatives(&[expr], by)[0]
    }

    /// The derivatives of several expressions by one symbol.
    pub fn derivatives(&mut self, exprs: &[Expr], by: Symbol) -> Vec<Expr> {
        let mut found = Found { zero: self.integer(0), slopes: HashMap::new() };
        let exprs = &self.above(exprs, by)[..];
        for expr in self.moved(exprs, by) {
            let mut is_constant = true;
            self.each_part(expr, |part| is_constant &= found.of(&part) == found.zero);
            let slope = match self.symbol_of(expr) {
                Some(_) => self.integer(1),
                None if is_constant => continue,
                None => self.slope(expr, &found),
            };
            found.slopes.insert(expr, slope);
        }
        exprs.iter().map(|expr| found.of(expr)).collect()
    }

    /// The derivative of a node from those of its parts.
    fn slope(&mut self, expr: Expr, found: &Found) -> Expr {
        let of = |part: &Expr| found.of(part);
        match self.node(expr).clone() {
            Node::Number(_) | Node::Pi | Node::Symbol(_) => self.integer(0),
            Node::Sum { terms, .. } => {
                let terms: Vec<_> = terms.iter().map(|(term, factor)| (of(term), factor.clone())).collect();
                self.sum(Rational::ZERO, &terms)
            }
            Node::Product(factors) => {
                let mut terms = Vec::new();
                for (k, (factor, power)) in factors.iter().enumerate() {
                    if self.is_zero(of(factor)) {
                        continue;
                    }
                    if let (true, Some(relative)) = (*power < 0, self.relative_slope(*factor, found)) {
                        terms.push((self.multiply(expr, relative), Rational::from(*power)));
                        continue;
                    }
                    let mut cofactors = factors.clone();
                    cofactors[k].1 -= 1;
                    cofactors.push((of(factor), 1));
                    terms.push((self.product(&cofactors), Rational::from(*power)));
                }
                self.sum(Rational::ZERO, &terms)
            }
            Node::Apply(function, a) => {
                let outer = self.slope_of_function(function, a, expr);
                self.multiply(outer, of(&a))
            }
            Node::Atan2(y, x) => {
                // (x y′ − y x′)/(x² + y²)
                let (first, second) = (self.multiply(x, of(&y)), self.multiply(y, of(&x)));
                let (squares, difference) = (self.sum_of_squares(x, y), self.subtract(first, second));
                self.divide(difference, squares)
            }
            Node::Group(a) => of(&a),
            Node::Min(a, b) => self.select_above(a, b, of(&a), of(&b)),
            Node::Max(a, b) => self.select_above(a, b, of(&b), of(&a)),
            Node::Select([a, b, then, otherwise]) => self.select_above(a, b, of(&then), of(&otherwise)),
            Node::Table(number, x) => {
                let slope = self.tables[number as usize].derivative();
                let outer = self.table_above(slope, x);
                self.multiply(outer, of(&x))
            }
        }
    }

    /// f′/f of a sum with exponentials, where f may overflow and this does not: `exp(u) u′/f = u′/(f exp(−u))`, of which each term is formed by itself.
    fn relative_slope(&mut self, expr: Expr, found: &Found) -> Option<Expr> {
        let Node::Sum { constant, terms } = self.node(expr).clone() else { return None };
        let exponents: Vec<Option<(Expr, Expr)>> =
            terms.iter().map(|(term, _)| self.exponential(*term, found)).collect();
        if exponents.iter().all(Option::is_none) {
            return None;
        }
        let mut slopes = Vec::new();
        for ((term, factor), exponent) in terms.iter().zip(&exponents) {
            if self.is_zero(found.of(term)) {
                continue;
            }
            let Some((rest, u)) = exponent else {
                slopes.push((self.divide(found.of(term), expr), factor.clone()));
                continue;
            };
            let negative = self.negate(*u);
            let inverse = self.apply(Function::Exp, negative);
            let mut parts = vec![(inverse, constant.clone())];
            for ((other, factor), exponent) in terms.iter().zip(&exponents) {
                let part = match exponent {
                    None => self.multiply(*other, inverse),
                    Some((rest, own)) => {
                        let difference = self.subtract(*own, *u);
                        let ratio = self.apply(Function::Exp, difference);
                        self.multiply(*rest, ratio)
                    }
                };
                parts.push((part, factor.clone()));
            }
            let all = self.sum(Rational::ZERO, &parts);
            slopes.push((self.product(&[(*rest, 1), (found.of(u), 1), (all, -1)]), factor.clone()));
        }
        Some(self.sum(Rational::ZERO, &slopes))
    }

    /// A and u of a term `A exp(u)` whose A does not change.
    fn exponential(&mut self, term: Expr, found: &Found) -> Option<(Expr, Expr)> {
        match self.node(term).clone() {
            Node::Apply(Function::Exp, u) => Some((self.integer(1), u)),
            Node::Product(mut factors) => {
                let exponent = |(factor, power): &(Expr, i32)| match *self.node(*factor) {
                    Node::Apply(Function::Exp, u) if *power == 1 => Some(u),
                    _ => None,
                };
                let (at, u) = factors.iter().enumerate().find_map(|(at, factor)| Some((at, exponent(factor)?)))?;
                factors.remove(at);
                let constant = factors.iter().all(|(factor, _)| self.is_zero(found.of(factor)));
                constant.then(|| (self.product(&factors), u))
            }
            _ => None,
        }
    }

    fn sum_of_squares(&mut self, x: Expr, y: Expr) -> Expr {
        let (x, y) = (self.power(x, 2), self.power(y, 2));
        self.add(x, y)
    }

    /// f′(a) with `whole = f(a)`.
    fn slope_of_function(&mut self, function: Function, a: Expr, whole: Expr) -> Expr {
        let square = |graph: &mut Self, of: Expr| graph.power(of, 2);
        match function {
            Function::Sqrt => {
                let half = Rational::ONE / Rational::from(2);
                let inverse = self.power(whole, -1);
                self.scale(half, inverse)
            }
            Function::Sin => self.apply(Function::Cos, a),
            Function::Cos => {
                let sine = self.apply(Function::Sin, a);
                self.negate(sine)
            }
            Function::Tan => {
                let square = square(self, whole);
                self.sum(Rational::ONE, &[(square, Rational::ONE)])
            }
            Function::Asin | Function::Acos => {
                let square = square(self, a);
                let rest = self.sum(Rational::ONE, &[(square, Rational::from(-1))]);
                let root = self.apply(Function::Sqrt, rest);
                let slope = self.power(root, -1);
                if function == Function::Asin { slope } else { self.negate(slope) }
            }
            Function::Atan => {
                let square = square(self, a);
                let sum = self.sum(Rational::ONE, &[(square, Rational::ONE)]);
                self.power(sum, -1)
            }
            Function::Exp => whole,
            Function::Ln => self.power(a, -1),
            Function::Abs => {
                let [zero, plus, minus] = [0, 1, -1].map(|value| self.integer(value));
                self.select_above(a, zero, minus, plus)
            }
        }
    }

    /// Sines and cosines of one symbol: each with whether it is a sine, the symbol, and n and c of the argument `n x + c`.
    pub fn waves(&self, exprs: &[Expr]) -> Vec<(Expr, bool, Symbol, [Rational; 2])> {
        let of = |expr: Expr| {
            let (sine, a) = match *self.node(expr) {
                Node::Apply(Function::Sin, a) => (true, a),
                Node::Apply(Function::Cos, a) => (false, a),
                _ => return None,
            };
            let a = if let Node::Group(inner) = *self.node(a) { inner } else { a };
            let (shift, terms) = self.terms(a);
            let [(part, factor)] = terms.as_slice() else { return None };
            Some((expr, sine, self.symbol_of(*part)?, [factor.clone(), shift]))
        };
        self.needed(exprs).into_iter().filter_map(of).collect()
    }

    /// Expressions whose zeros are places where an expression may jump.
    pub fn jumps(&mut self, expr: Expr) -> Vec<Expr> {
        self.piece_borders(expr, |node| matches!(node, Node::Select(_)))
    }

    /// Expressions whose zeros are places where an expression may have a jump or a kink: there its derivative is that of one side.
    pub fn kinks(&mut self, expr: Expr) -> Vec<Expr> {
        self.piece_borders(expr, |_| true)
    }

    /// Expressions whose zeros separate the pieces of some nodes, each once.
    fn piece_borders(&mut self, expr: Expr, which: impl Fn(&Node) -> bool) -> Vec<Expr> {
        let mut found = Vec::new();
        for part in self.needed(&[expr]) {
            match self.node(part).clone() {
                node if !which(&node) => {}
                Node::Apply(Function::Abs, a) => found.push(a),
                Node::Min(a, b) | Node::Max(a, b) | Node::Select([a, b, ..]) => found.push(self.subtract(a, b)),
                Node::Table(number, x) => {
                    for knot in self.tables[number as usize].kinks() {
                        found.push(self.sum(-knot, &[(x, Rational::ONE)]));
                    }
                }
                _ => {}
            }
        }
        found.sort();
        found.dedup();
        found
    }
}
