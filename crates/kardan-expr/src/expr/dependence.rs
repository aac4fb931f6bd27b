//! What expressions are made of and which symbols they depend on.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use kardan_math::num::Rational;

use super::graph::Graph;
use super::nodes::{Expr, Node, Symbol};

impl Graph {
    /// The nodes that an expression is made of directly.
    pub(super) fn parts(&self, expr: Expr) -> Vec<Expr> {
        let mut out = Vec::new();
        self.each_part(expr, |part| out.push(part));
        out
    }

    /// The same one by one.
    pub(super) fn each_part(&self, expr: Expr, mut visit: impl FnMut(Expr)) {
        match self.node(expr) {
            Node::Number(_) | Node::Pi | Node::Symbol(_) => {}
            Node::Sum { terms, .. } => terms.iter().for_each(|(term, _)| visit(*term)),
            Node::Product(factors) => factors.iter().for_each(|(factor, _)| visit(*factor)),
            Node::Apply(_, a) | Node::Table(_, a) | Node::Group(a) => visit(*a),
            Node::Atan2(a, b) | Node::Min(a, b) | Node::Max(a, b) => [a, b].into_iter().for_each(|part| visit(*part)),
            Node::Select(parts) => parts.iter().for_each(|part| visit(*part)),
        }
    }

    /// All subexpressions of expressions, themselves included, parts before the whole.
    pub(super) fn needed(&self, exprs: &[Expr]) -> Vec<Expr> {
        self.needed_besides(exprs, |_| false)
    }

    /// The same without the given ones and their subexpressions.
    pub(super) fn needed_besides(&self, exprs: &[Expr], excluded: impl Fn(Expr) -> bool) -> Vec<Expr> {
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
}
