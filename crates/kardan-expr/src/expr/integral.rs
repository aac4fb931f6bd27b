//! Integrals of functions of time that have a closed form.

use std::sync::Arc;

use super::nodes::Node;
use super::{Expr, Function, Graph, OfTime, Part, Pieces, Symbol};
use kardan_math::num::{Rational, rational_from_f64};
use kardan_math::units::Dimension;

impl Part {
    /// Its integral from the first breakpoint on; `None` where that would need more than cubics.
    fn integral(&self) -> Option<Self> {
        if self.pieces.degree() > 2 {
            return None;
        }
        let starts = self.pieces.starts();
        let (mut pieces, mut sum) = (Vec::with_capacity(starts.len()), 0.0);
        for (k, (start, [a, b, c, _])) in starts.iter().zip(&self.pieces.coefficients).enumerate() {
            let own = [sum, *a, b / 2.0, c / 3.0];
            pieces.push((*start, own));
            if let Some(next) = starts.get(k + 1) {
                sum = super::of_time::polynomial(&own, next - start);
            }
        }
        let dimension = self.dimension.times(&Dimension::TIME, 1)?;
        Some(Self { name: format!("{}.integral", self.name), dimension, pieces: Pieces::new(pieces), reported: false })
    }
}

impl OfTime {
    /// The integral from time zero on, where it has a closed form: sums of powers of the time, of sines, cosines and exponentials of straight lines,
    /// and of parts of degree two.
    ///
    /// ```
    /// use kardan_expr::expr::{Function, Graph, OfTime};
    /// use kardan_math::units::Dimension;
    /// let mut graph = Graph::default();
    /// let time = graph.symbol("t", Dimension::TIME);
    /// let wave = graph.apply(Function::Sin, time);
    /// let wave = OfTime::new(graph, time, Vec::new(), wave, Dimension::CURRENT).unwrap();
    /// let charge = wave.integral().unwrap();
    /// assert!((charge.value(2.0) - (1.0 - 2.0f64.cos())).abs() < 1e-15);
    /// assert_eq!((charge.value(0.0), charge.dimension()), (0.0, Dimension::CHARGE));
    /// ```
    pub fn integral(&self) -> Option<Self> {
        let mut out = self.clone();
        out.value = out.antiderivative(self.value)?;
        let begin = rational_from_f64(out.value(0.0))?;
        out.value = out.graph.sum(-begin, &[(out.value, Rational::ONE)]);
        let used = out.graph.symbols(&[out.value]);
        out.parts.retain(|(symbol, _)| used.contains(symbol));
        out.dimension = self.dimension.times(&Dimension::TIME, 1)?;
        Some(out)
    }

    fn antiderivative(&mut self, expr: Expr) -> Option<Expr> {
        let time = self.graph.of_symbol(self.time);
        let time = time.unwrap_or_else(|| self.graph.integer(0));
        if self.graph.symbols(&[expr]).is_empty() {
            return Some(self.graph.multiply(expr, time));
        }
        match self.graph.node(expr).clone() {
            Node::Group(inner) => self.antiderivative(inner),
            Node::Sum { constant, terms } => {
                let mut sum = vec![(time, constant)];
                for (term, factor) in terms {
                    sum.push((self.antiderivative(term)?, factor));
                }
                Some(self.graph.sum(Rational::ZERO, &sum))
            }
            Node::Symbol(symbol) if symbol == self.time => Some(self.power_of_time(time, 1)),
            Node::Symbol(symbol) => self.integral_of_part(symbol),
            Node::Product(factors) => {
                let varies = |graph: &Graph, factor: Expr| !graph.symbols(&[factor]).is_empty();
                let (varying, constant): (Vec<_>, Vec<_>) =
                    factors.into_iter().partition(|(factor, _)| varies(&self.graph, *factor));
                let inner = match varying[..] {
                    [(factor, power)] if factor == time && power > 0 => self.power_of_time(time, power),
                    [(factor, 1)] => self.antiderivative(factor)?,
                    _ => return None,
                };
                let constant = self.graph.product(&constant);
                Some(self.graph.multiply(constant, inner))
            }
            Node::Apply(function, argument) => self.wave(function, argument),
            _ => None,
        }
    }

    fn power_of_time(&mut self, time: Expr, power: i32) -> Expr {
        let next = self.graph.power(time, power + 1);
        self.graph.scale(Rational::ONE / Rational::from(power + 1), next)
    }

    fn integral_of_part(&mut self, symbol: Symbol) -> Option<Expr> {
        let part = self.parts.iter().find(|(own, _)| *own == symbol)?.1.integral()?;
        let sum = self.graph.new_symbol(part.name.clone(), part.dimension);
        self.parts.push((self.graph.symbol_of(sum)?, Arc::new(part)));
        Some(sum)
    }

    /// Of a sine, a cosine or an exponential of a straight line.
    fn wave(&mut self, function: Function, argument: Expr) -> Option<Expr> {
        let slope = self.graph.derivative(argument, self.time);
        if !self.graph.symbols(&[slope]).is_empty() || self.graph.symbols(&[argument]) != [self.time] {
            return None;
        }
        let (integral, sign) = match function {
            Function::Sin => (Function::Cos, -1),
            Function::Cos => (Function::Sin, 1),
            Function::Exp => (Function::Exp, 1),
            _ => return None,
        };
        let wave = self.graph.apply(integral, argument);
        let wave = self.graph.divide(wave, slope);
        Some(self.graph.scale(Rational::from(sign), wave))
    }
}

#[cfg(test)]
#[path = "../../tests/unit/expr/integral.rs"]
mod tests;
