//! Expressions whose zeros are points where a loop has a jump or kink.

use kardan_rt::Operator;

use super::expressions::Places;
use crate::compiled_plan::CompiledPlan;
use kardan_expr::expr::{Domain, Expr, Floating, Graph, Interval, Intervals, Symbol, lower};
use kardan_mechanics::reduce::{Extension, Motion};

/// Expressions whose zeros are points where the loop has a jump or kink.
#[derive(Debug, Default)]
pub(crate) struct Kinks {
    /// Those of the time alone, in a graph of their own, with the numbers of its symbols: those of sources, then of the
    /// other time-dependent inputs.
    graph: Graph,
    pub of_time: Vec<Expr>,
    time_inputs: Vec<(Symbol, usize)>,
    /// The number of the others; a separate plan evaluates them faster than the whole loop.
    pub of_state: usize,
    compiled: Option<CompiledPlan<f64>>,
}

impl Kinks {
    /// From expressions of the time alone of a motion, and a loop that was written into it.
    pub(super) fn new(motion: &Motion, of_time: &[Expr], (extension, places): (&Extension, &Places)) -> Self {
        let (graph, inputs) = (&motion.graph, &extension.inputs);
        let mut own = Graph::default();
        let (mut time_inputs, mut pairs) = (Vec::new(), Vec::new());
        for symbol in graph.symbols(of_time) {
            let Some(place) = inputs.iter().position(|input| *input == symbol) else { continue };
            let number = match places.sources.contains(&place) {
                true => place - places.sources.start,
                false => places.sources.len() + place - places.timed.start,
            };
            let (name, dimension) = graph.name(symbol);
            let copy = own.new_symbol(name.to_string(), dimension);
            pairs.push((symbol, copy));
            time_inputs.extend(own.symbol_of(copy).map(|symbol| (symbol, number)));
        }
        let of_time = of_time.iter().map(|kink| own.copied(graph, *kink, &pairs)).collect();
        let all: Vec<Symbol> = motion.symbols.iter().chain(inputs).copied().collect();
        let outputs = &extension.outputs[places.kinks.clone()];
        let compiled = (!outputs.is_empty()).then(|| CompiledPlan::new(graph, &all, outputs));
        Self { graph: own, of_time, time_inputs, of_state: outputs.len(), compiled }
    }

    /// The numbers that depend on states, for the given motion and inputs.
    pub fn find(&mut self, motion: &[f64], time_inputs: &[f64], out: &mut [f64]) {
        let Some(compiled) = &mut self.compiled else { return };
        let later = motion.len()..compiled.plan.inputs.len();
        compiled.memory[..later.start].copy_from_slice(motion);
        compiled.memory[later.clone()].copy_from_slice(&time_inputs[..later.len()]);
        // A value that is not a number is on no side.
        compiled.evaluate();
        out.iter_mut().enumerate().for_each(|(k, out)| *out = *compiled.output(k));
    }

    fn number_of(&self, symbol: Symbol) -> usize {
        self.time_inputs.iter().find(|(own, _)| *own == symbol).map_or(0, |(_, number)| *number)
    }

    /// The number whose zero is such a point, for values of sources and time-dependent inputs.
    pub fn at(&self, kink: Expr, values: &[f64]) -> f64 {
        let symbol = |symbol: Symbol| values[self.number_of(symbol)];
        lower(&self.graph, &[kink], &mut Floating::<f64>::default(), symbol)[0]
    }

    /// Its values over ranges of these.
    pub fn between(&self, kink: Expr, ranges: &[Interval]) -> Interval {
        let symbol = |symbol: Symbol| ranges[self.number_of(symbol)];
        lower(&self.graph, &[kink], &mut Intervals, symbol)[0]
    }
}

/// The values of a line over an interval of time.
pub(super) fn line_range((value, slope, start): (f64, f64, f64), span: Interval) -> Interval {
    if slope == 0.0 {
        return Interval::point(value);
    }
    let later = Intervals.operation(Operator::Subtract, &[span, Interval::point(start)]);
    Intervals.operation(Operator::AddProduct, &[Interval::point(slope), later, Interval::point(value)])
}
