//! Expressions made again with other parts: substituted, replaced, or in a graph of their own.

use std::collections::HashMap;

use super::graph::Graph;
use super::nodes::{Expr, Node, Symbol};

impl Graph {
    /// The same node made of other parts.
    pub(super) fn rebuilt(&mut self, expr: Expr, part: impl Fn(Expr) -> Expr) -> Expr {
        self.made_of(expr, self.node(expr).clone(), part)
    }

    /// The node of another graph made of parts of this one; no symbol.
    pub(super) fn remade(&mut self, other: &Self, expr: Expr, part: impl Fn(Expr) -> Expr) -> Expr {
        match other.node(expr) {
            Node::Number(value) => self.number(value.clone()),
            Node::Pi => self.pi(),
            Node::Table(number, x) => self.table(other.tables[*number as usize].clone(), part(*x)),
            node => self.made_of(expr, node.clone(), part),
        }
    }

    /// A node of parts; what has none is given.
    fn made_of(&mut self, without_parts: Expr, node: Node, part: impl Fn(Expr) -> Expr) -> Expr {
        match node {
            Node::Number(_) | Node::Pi | Node::Symbol(_) => without_parts,
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
                let table = self.tables[number as usize].clone();
                self.table(table, part(x))
            }
        }
    }

    /// A graph of what expressions need alone, in the same order, and what each of their nodes is there, in order too.
    pub fn extract(&self, exprs: &[Expr]) -> (Self, Vec<(Expr, Expr)>) {
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
        let made = replacements.iter().copied().collect();
        Substitution { made, ..Substitution::default() }.of(self, exprs)
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
