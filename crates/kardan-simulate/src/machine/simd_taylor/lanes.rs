//! Numbers in lanes, and plans that are evaluated for all lanes at once.

use kardan_native::{Aligned, Native, Value};
use kardan_rt::Lanes;

use kardan_expr::expr::{Expr, Graph, Symbol};
use kardan_expr::plan::{Plan, compile};
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

/// A plan of numbers in lanes, with its memory.
pub(super) struct Numbers<N> {
    pub(super) plan: Plan,
    native: Option<Native<N>>,
    pub(super) memory: Aligned<N>,
}

impl<N: Lane> Numbers<N> {
    pub(super) fn new(graph: &Graph, inputs: &[Expr], outputs: Vec<Expr>) -> Self {
        let inputs: Vec<Symbol> = inputs.iter().filter_map(|input| graph.symbol_of(*input)).collect();
        let outputs: Vec<(String, Expr)> = outputs.into_iter().map(|expr| (String::new(), expr)).collect();
        let plan = compile(graph, &inputs, &outputs).expect("all inputs are given");
        let mut memory = Aligned::new(plan.block().memory());
        plan.block().begin(&mut memory);
        Self { native: Native::new(&plan.block()), plan, memory }
    }

    pub(super) fn evaluate(&mut self) {
        evaluate(self.native.as_ref(), &self.plan, &mut self.memory);
    }

    pub(super) fn output(&self, number: usize) -> &N {
        &self.memory[self.plan.place(number)]
    }
}

/// A value that is not a number is detected where it is used.
pub(super) fn evaluate<N: Lane>(native: Option<&Native<N>>, plan: &Plan, memory: &mut [N]) {
    match native {
        Some(native) => native.find(memory),
        None => {
            let _ = plan.block().evaluate(memory);
        }
    }
}

/// Symbols of a graph, one after the other.
pub(super) fn symbols(graph: &mut Graph, count: usize) -> Vec<Expr> {
    (0..count).map(|k| graph.new_symbol(k.to_string(), Dimension::NONE)).collect()
}
