//! Numbers in lanes, and plans that are evaluated for all lanes at once.

use kardan_native::Value;
use kardan_rt::Lanes;

use crate::compiled_plan::CompiledPlan;
use kardan_expr::expr::{Expr, Graph, Symbol};
use kardan_math::units::Dimension;

/// The number type of lanes.
pub trait Lane: Value + Send {
    /// How many there are.
    const COUNT: usize;

    /// Their numbers.
    fn lanes(&self) -> &[f64];

    /// The same, to be changed.
    fn lanes_mut(&mut self) -> &mut [f64];
}

impl Lane for f64 {
    const COUNT: usize = 1;

    fn lanes(&self) -> &[f64] {
        std::slice::from_ref(self)
    }

    fn lanes_mut(&mut self) -> &mut [f64] {
        std::slice::from_mut(self)
    }
}

macro_rules! lane {
    ($count:literal) => {
        impl Lane for Lanes<f64, $count> {
            const COUNT: usize = $count;

            #[inline(always)]
            fn lanes(&self) -> &[f64] {
                &self.0
            }

            #[inline(always)]
            fn lanes_mut(&mut self) -> &mut [f64] {
                &mut self.0
            }
        }
    };
}

lane!(4);
lane!(8);

/// The plan of outputs without names.
pub(super) fn compiled<N: Lane>(graph: &Graph, inputs: &[Expr], outputs: Vec<Expr>) -> CompiledPlan<N> {
    let inputs: Vec<Symbol> = inputs.iter().filter_map(|input| graph.symbol_of(*input)).collect();
    let outputs: Vec<(String, Expr)> = outputs.into_iter().map(|expr| (String::new(), expr)).collect();
    CompiledPlan::new(graph, &inputs, &outputs)
}

/// Symbols of a graph, one after the other.
pub(super) fn symbols(graph: &mut Graph, count: usize) -> Vec<Expr> {
    (0..count).map(|k| graph.new_symbol(k.to_string(), Dimension::NONE)).collect()
}
