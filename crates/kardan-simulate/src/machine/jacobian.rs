//! The exact Jacobian of the rates by the state, in one set of modes.
//!
//! With `H a = f − Gᵀλ` and `G a + b = 0` the derivatives of accelerations and constraint torques by a state x follow
//! from the same factors as the accelerations: `H a′ = ∂(f − H a − Gᵀλ)/∂x − Gᵀλ′` and `G a′ + ∂(b + G a)/∂x = 0`,
//! where a and λ are constant in the derivatives on the right.

use kardan_native::Native;

use kardan_expr::expr::{Expr, Symbol};
use kardan_expr::plan::{Plan, compile};
use kardan_mechanics::reduce::Motion;

/// Derivatives as a plan.
pub(super) struct Jacobian {
    pub(super) plan: Plan,
    pub(super) native: Option<Native<f64>>,
    pub(super) memory: Vec<f64>,
    /// Inputs of the plan: those of the rates, accelerations, torques of friction directions.
    pub(super) inputs: usize,
    pub(super) columns: Vec<Column>,
}

/// The dependents of one state: numbers of coordinates, friction directions and states behind the speeds, each with the
/// index of its derivative in the memory.
#[derive(Default)]
pub(super) struct Column {
    pub(super) forces: Vec<(usize, usize)>,
    pub(super) bias: Vec<(usize, usize)>,
    pub(super) rates: Vec<(usize, usize)>,
}

impl Jacobian {
    /// Derivatives of the expressions of a loop. The residuals are those of forces, of the directions of friction, and the rates.
    pub(super) fn new(motion: &mut Motion, inputs: &[Symbol], states: &[Symbol], residuals: [Vec<Expr>; 3]) -> Self {
        let mut outputs: Vec<(String, Expr)> = Vec::new();
        let mut columns: Vec<Column> = states.iter().map(|_| Column::default()).collect();
        let [forces, bias, rates] = &residuals;
        let kinds = [("force", forces), ("bias", bias), ("rate", rates)];
        // For each state its dependents: else the work would grow with the square of the size.
        let mut entries: Vec<Vec<(usize, usize)>> = vec![Vec::new(); states.len()];
        for (kind, (_, exprs)) in kinds.iter().enumerate() {
            for (k, expr) in exprs.iter().enumerate() {
                for symbol in motion.graph.symbols(&[*expr]) {
                    if let Some(state) = states.iter().position(|state| *state == symbol) {
                        entries[state].push((kind, k));
                    }
                }
            }
        }
        for ((state, entries), column) in states.iter().zip(entries).zip(&mut columns) {
            let exprs: Vec<Expr> = entries.iter().map(|(kind, k)| kinds[*kind].1[*k]).collect();
            for ((kind, k), slope) in entries.into_iter().zip(motion.graph.derivatives(&exprs, *state)) {
                if motion.graph.is_zero(slope) {
                    continue;
                }
                let lists = [&mut column.forces, &mut column.bias, &mut column.rates];
                lists[kind].push((k, outputs.len()));
                outputs.push((format!("{}.{k}.{}", kinds[kind].0, motion.graph.name(*state).0), slope));
            }
        }
        let plan = compile(&motion.graph, inputs, &outputs).expect("all arguments of the residuals are inputs");
        for column in &mut columns {
            for list in [&mut column.forces, &mut column.bias, &mut column.rates] {
                list.iter_mut().for_each(|(_, output)| *output = plan.place(*output));
            }
        }
        let native = Native::new(&plan.block());
        Self { memory: plan.memory(), native, plan, inputs: inputs.len(), columns }
    }
}
