//! A plan with its machine code and its memory.

use kardan_native::{Aligned, Native, Value};

use kardan_expr::expr::{Expr, Graph, Symbol};
use kardan_expr::plan::{Plan, compile};
use kardan_math::num::{Rational, rational_from_f64};
use kardan_math::units::Dimension;

/// A plan with its machine code, where the processor has any for it, and its memory.
#[derive(Debug)]
pub(super) struct CompiledPlan<N> {
    pub plan: Plan,
    native: Option<Native<N>>,
    /// The inputs, then the values that follow from them.
    pub memory: Aligned<N>,
}

impl<N: Value> CompiledPlan<N> {
    /// # Panics
    /// If an output depends on a symbol that is no input.
    pub fn new(graph: &Graph, inputs: &[Symbol], outputs: &[(String, Expr)]) -> Self {
        let plan = compile(graph, inputs, outputs).expect("all symbols of the outputs are inputs");
        let mut memory = Aligned::new(plan.block().memory());
        plan.block().begin(&mut memory);
        Self { native: Native::new(&plan.block()), plan, memory }
    }

    /// Computes all values from the inputs.
    pub fn evaluate(&mut self) {
        evaluate(self.native.as_ref(), &self.plan, &mut self.memory);
    }

    /// An output, as it was computed last.
    pub fn output(&self, number: usize) -> &N {
        &self.memory[self.plan.place(number)]
    }
}

/// Evaluates a plan in its memory, with its machine code if there is any. A value that is not a number is detected
/// where it is used.
pub(super) fn evaluate<N: Value>(native: Option<&Native<N>>, plan: &Plan, memory: &mut [N]) {
    match native {
        Some(native) => native.find(memory),
        None => {
            let _ = plan.block().evaluate(memory);
        }
    }
}

/// The sum of some terms.
pub(super) fn sum(graph: &mut Graph, terms: impl IntoIterator<Item = Expr>) -> Expr {
    let terms: Vec<(Expr, Rational)> = terms.into_iter().map(|term| (term, Rational::ONE)).collect();
    graph.sum(Rational::ZERO, &terms)
}

/// The number nearest to a floating-point number, which is exact; zero if that is not finite.
pub(super) fn exact(value: f64) -> Rational {
    rational_from_f64(value).unwrap_or(Rational::ZERO)
}

/// New symbols without a dimension, numbered.
pub(super) fn symbols(graph: &mut Graph, name: &str, count: usize) -> Vec<Expr> {
    (0..count).map(|k| graph.new_symbol(format!("{name}.{k}"), Dimension::NONE)).collect()
}
