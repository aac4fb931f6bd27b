//! Functions of time: expressions of the time and of parts that are polynomials between exact breakpoints.

use std::collections::HashMap;
use std::sync::Arc;

use super::{Expr, Floating, Graph, Style, Symbol, lower, printed};
use kardan_math::num::Rational;
use kardan_math::units::{Dimension, Exact};

/// Cubics between breakpoints, with jumps and kinks at them; zero before the first.
///
/// ```
/// use kardan_expr::expr::Pieces;
/// let ramp = Pieces::new([(1.0, [0.0, 2.0, 0.0, 0.0]), (3.0, [4.0, 0.0, 0.0, 0.0])]);
/// assert_eq!([0.5, 2.0, 3.0, 9.0].map(|time| ramp.value(time)), [0.0, 2.0, 4.0, 4.0]);
/// assert_eq!((ramp.next(1.0), ramp.next(3.0)), (Some(3.0), None));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pieces {
    starts: Vec<f64>,
    /// Of each piece, in powers of the time since its start.
    pub(super) coefficients: Vec<[f64; 4]>,
}

impl Pieces {
    /// From starts (s) that rise, and coefficients; of two pieces with one start the later one counts.
    pub fn new(pieces: impl IntoIterator<Item = (f64, [f64; 4])>) -> Self {
        let mut out = Self::default();
        for (start, coefficients) in pieces {
            if out.starts.last() == Some(&start) {
                out.starts.pop();
                out.coefficients.pop();
            }
            out.starts.push(start);
            out.coefficients.push(coefficients);
        }
        out
    }

    /// Start and coefficients of the piece that is valid from a time on.
    pub fn piece(&self, time: f64) -> (f64, [f64; 4]) {
        match self.starts.partition_point(|start| *start <= time).checked_sub(1) {
            Some(k) => (self.starts[k], self.coefficients[k]),
            None => (0.0, [0.0; 4]),
        }
    }

    /// The value at a time; at a jump, the value after it.
    pub fn value(&self, time: f64) -> f64 {
        let (start, coefficients) = self.piece(time);
        polynomial(&coefficients, time - start)
    }

    /// The value that a time is come to with; at a jump, the value before it.
    pub fn value_before(&self, time: f64) -> f64 {
        match self.starts.partition_point(|start| *start < time).checked_sub(1) {
            Some(k) => polynomial(&self.coefficients[k], time - self.starts[k]),
            None => 0.0,
        }
    }

    /// The first breakpoint after a time, s.
    pub fn next(&self, time: f64) -> Option<f64> {
        self.starts.get(self.starts.partition_point(|start| *start <= time)).copied()
    }

    /// Times where another piece begins, s.
    pub fn starts(&self) -> &[f64] {
        &self.starts
    }

    /// The highest power of the time that any piece has.
    pub fn degree(&self) -> usize {
        let degree = |coefficients: &[f64; 4]| coefficients.iter().rposition(|c| *c != 0.0).unwrap_or(0);
        self.coefficients.iter().map(degree).max().unwrap_or(0)
    }
}

/// The value of a cubic.
pub fn polynomial(coefficients: &[f64; 4], x: f64) -> f64 {
    let [a, b, c, d] = *coefficients;
    if c == 0.0 && d == 0.0 {
        return a + b * x;
    }
    a + (b + (c + d * x) * x) * x
}

/// A part of a function of time that is given by pieces.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its name in messages and plans.
    pub name: String,
    /// What it is of.
    pub dimension: Dimension,
    /// Its pieces, SI.
    pub pieces: Pieces,
    /// Whether a run reports each of its breakpoints.
    pub reported: bool,
}

impl Part {
    fn is_zero(&self) -> bool {
        self.pieces.coefficients.iter().flatten().all(|c| *c == 0.0)
    }

    /// Its derivative by the time.
    pub fn rate(&self) -> Self {
        let pieces = self.pieces.starts.iter().zip(&self.pieces.coefficients);
        let pieces = pieces.map(|(start, [_, b, c, d])| (*start, [*b, 2.0 * c, 3.0 * d, 0.0]));
        Self {
            name: format!("{}.rate", self.name),
            dimension: self.dimension.times(&Dimension::TIME, -1).unwrap_or(self.dimension),
            pieces: Pieces::new(pieces),
            reported: false,
        }
    }
}

/// A function of time: an expression of the time and of [`Part`]s, in a graph of its own.
///
/// It is written into another graph, such as that of a motion, by [`write_into`](Self::write_into): once for all that depends on it.
///
/// ```
/// use kardan_expr::expr::{Function, Graph, OfTime};
/// use kardan_math::units::Dimension;
/// let mut graph = Graph::default();
/// let time = graph.symbol("t", Dimension::TIME);
/// let sine = graph.apply(Function::Sin, time);
/// let wave = OfTime::new(graph, time, Vec::new(), sine, Dimension::NONE).unwrap();
/// assert_eq!((wave.value(0.0), wave.is_affine()), (0.0, false));
/// ```
#[derive(Debug, Clone)]
pub struct OfTime {
    pub(super) graph: Graph,
    pub(super) time: Symbol,
    pub(super) parts: Vec<(Symbol, Arc<Part>)>,
    pub(super) value: Expr,
    pub(super) dimension: Dimension,
}

impl PartialEq for OfTime {
    fn eq(&self, other: &Self) -> bool {
        self.graph.nodes.as_slice() == other.graph.nodes.as_slice()
            && self.value == other.value
            && self.parts == other.parts
    }
}

impl OfTime {
    /// From an expression of a graph, the symbol of the time, and those of the parts; `None` if it depends on something else.
    pub fn new(
        graph: Graph,
        time: Expr,
        parts: Vec<(Expr, Arc<Part>)>,
        value: Expr,
        dimension: Dimension,
    ) -> Option<Self> {
        let time = graph.symbol_of(time)?;
        let used = graph.symbols(&[value]);
        let symbol = |(expr, part): (Expr, Arc<Part>)| Some((graph.symbol_of(expr)?, part));
        let parts: Vec<(Symbol, Arc<Part>)> =
            parts.into_iter().filter_map(symbol).filter(|(symbol, _)| used.contains(symbol)).collect();
        let is_bound = |symbol: &Symbol| *symbol == time || parts.iter().any(|(part, _)| part == symbol);
        let complete = used.iter().all(is_bound);
        complete.then_some(Self { graph, time, parts, value, dimension })
    }

    /// A number at all times.
    pub fn constant(value: &Exact, dimension: Dimension) -> Self {
        let mut graph = Graph::default();
        let time = graph.new_symbol("t".into(), Dimension::TIME);
        let value = graph.exact(value);
        let time = graph.symbol_of(time).expect("a symbol was made");
        Self { graph, time, parts: Vec::new(), value, dimension }
    }

    /// What it is of.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Its parts.
    pub fn parts(&self) -> impl ExactSizeIterator<Item = &Arc<Part>> {
        self.parts.iter().map(|(_, part)| part)
    }

    /// Whether it is a straight line between two breakpoints.
    pub fn is_affine(&self) -> bool {
        self.graph.affine()(self.value) && self.parts().all(|part| part.pieces.degree() <= 1)
    }

    /// The value at a time, SI.
    pub fn value(&self, time: f64) -> f64 {
        self.at(time, &|pieces| pieces.value(time))
    }

    /// The value that a time is come to with, SI: where parts jump, that before.
    pub fn value_before(&self, time: f64) -> f64 {
        self.at(time, &|pieces| pieces.value_before(time))
    }

    fn at(&self, time: f64, of_pieces: &dyn Fn(&Pieces) -> f64) -> f64 {
        let symbol = |symbol: Symbol| match self.parts.iter().find(|(part, _)| *part == symbol) {
            Some((_, part)) => of_pieces(&part.pieces),
            None => time,
        };
        lower(&self.graph, &[self.value], &mut Floating::<f64>::default(), symbol)[0]
    }

    /// The derivative by the time, in exact terms; at breakpoints and kinks that of the side behind them.
    ///
    /// ```
    /// use kardan_expr::expr::{Function, Graph, OfTime};
    /// use kardan_math::units::Dimension;
    /// let mut graph = Graph::default();
    /// let time = graph.symbol("t", Dimension::TIME);
    /// let sine = graph.apply(Function::Sin, time);
    /// let wave = OfTime::new(graph, time, Vec::new(), sine, Dimension::NONE).unwrap();
    /// assert_eq!((wave.rate().value(0.0), wave.rate().rate().value(0.0)), (1.0, 0.0));
    /// ```
    #[must_use]
    pub fn rate(&self) -> Self {
        let mut graph = self.graph.clone();
        let slope = graph.derivative(self.value, self.time);
        let (mut terms, mut parts) = (vec![(slope, Rational::ONE)], self.parts.clone());
        for (symbol, part) in &self.parts {
            let (slope, rate) = (graph.derivative(self.value, *symbol), part.rate());
            if graph.is_zero(slope) || rate.is_zero() {
                continue;
            }
            let existing = parts
                .iter()
                .find(|(_, candidate)| **candidate == rate)
                .and_then(|(symbol, _)| graph.of_symbol(*symbol));
            let moved = existing.unwrap_or_else(|| graph.new_symbol(rate.name.clone(), rate.dimension));
            parts.extend(graph.symbol_of(moved).filter(|_| existing.is_none()).map(|symbol| (symbol, Arc::new(rate))));
            terms.push((graph.multiply(slope, moved), Rational::ONE));
        }
        let value = graph.sum(Rational::ZERO, &terms);
        let used = graph.symbols(&[value]);
        parts.retain(|(symbol, _)| used.contains(symbol));
        let dimension = self.dimension.times(&Dimension::TIME, -1).unwrap_or(self.dimension);
        Self { graph, time: self.time, parts, value, dimension }
    }

    /// As in a source text; parts by their names.
    pub fn text(&self) -> String {
        self.formatted(Style::Text, &|name| name.into())
    }

    /// The same in either style; `name` writes the names of parts and of the time.
    pub fn formatted(&self, style: Style, name: &dyn Fn(&str) -> String) -> String {
        printed(&self.graph, self.value, style, name)
    }

    /// Whether it may have a kink or a jump where no part has a breakpoint.
    pub fn has_kinks(&self) -> bool {
        let mut graph = self.graph.clone();
        let kinks = graph.kinks(self.value);
        let varying = graph.varying();
        kinks.into_iter().any(varying)
    }

    /// Its expression in another graph, in which these functions give the time and each part.
    pub fn write_into(
        &self,
        graph: &mut Graph,
        time: &mut dyn FnMut(&mut Graph) -> Expr,
        part: &mut dyn FnMut(&mut Graph, &Arc<Part>) -> Expr,
    ) -> Expr {
        let mut values = Vec::new();
        for symbol in self.graph.symbols(&[self.value]) {
            let value = match self.parts.iter().find(|(candidate, _)| *candidate == symbol) {
                Some((_, own)) => part(graph, own),
                None => time(graph),
            };
            values.push((symbol, value));
        }
        graph.copied(&self.graph, self.value, &values)
    }
}

impl Graph {
    /// An expression of another graph, with expressions of this one in place of its symbols.
    pub fn copied(&mut self, other: &Self, value: Expr, symbols: &[(Symbol, Expr)]) -> Expr {
        let mut new: HashMap<Expr, Expr> = HashMap::new();
        for expr in other.needed(&[value]) {
            let copy = match other.symbol_of(expr) {
                Some(symbol) => symbols.iter().find(|(own, _)| *own == symbol).map_or(expr, |(_, value)| *value),
                None => self.remade(other, expr, |part| new[&part]),
            };
            new.insert(expr, copy);
        }
        new[&value]
    }
}

#[cfg(test)]
#[path = "../../tests/unit/expr/of_time.rs"]
mod tests;
