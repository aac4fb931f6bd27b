//! The exact Jacobian of the rates by the state, in one set of modes.
//!
//! With `H a = f − Gᵀλ` and `G a + b = 0` the derivatives of accelerations and constraint torques by a state x follow
//! from the same factors as the accelerations: `H a′ = ∂(f − H a − Gᵀλ)/∂x − Gᵀλ′` and `G a′ + ∂(b + G a)/∂x = 0`,
//! where a and λ are constant in the derivatives on the right.

use crate::compiled_plan::CompiledPlan;
use kardan_expr::expr::{Expr, Symbol};
use kardan_mechanics::reduce::Motion;

/// Derivatives as a plan.
pub(super) struct Jacobian {
    pub(super) compiled: CompiledPlan<f64>,
    /// Inputs of the plan: those of the rates, accelerations, torques of friction directions.
    pub(super) inputs: usize,
    pub(super) columns: Vec<Column>,
}

/// The dependents of one state: numbers of coordinates, friction directions and states behind the speeds, each with the
/// index of its derivative among the outputs.
pub(super) type Column = [Vec<(usize, usize)>; 3];

impl Jacobian {
    /// Derivatives of the expressions of a loop. The residuals are those of forces, of the directions of friction, and the rates.
    pub(super) fn new(motion: &mut Motion, inputs: &[Symbol], states: &[Symbol], residuals: [Vec<Expr>; 3]) -> Self {
        let mut outputs: Vec<(String, Expr)> = Vec::new();
        let mut columns: Vec<Column> = states.iter().map(|_| Column::default()).collect();
        // For each state its dependents: else the work would grow with the square of the size.
        let mut entries: Vec<Vec<(usize, usize)>> = vec![Vec::new(); states.len()];
        for (kind, exprs) in residuals.iter().enumerate() {
            for (k, expr) in exprs.iter().enumerate() {
                for symbol in motion.graph.symbols(&[*expr]) {
                    if let Some(state) = states.iter().position(|state| *state == symbol) {
                        entries[state].push((kind, k));
                    }
                }
            }
        }
        for ((state, entries), column) in states.iter().zip(entries).zip(&mut columns) {
            let exprs: Vec<Expr> = entries.iter().map(|(kind, k)| residuals[*kind][*k]).collect();
            for ((kind, k), slope) in entries.into_iter().zip(motion.graph.derivatives(&exprs, *state)) {
                if motion.graph.is_zero(slope) {
                    continue;
                }
                column[kind].push((k, outputs.len()));
                let name = ["force", "bias", "rate"][kind];
                outputs.push((format!("{name}.{k}.{}", motion.graph.name(*state).0), slope));
            }
        }
        let compiled = CompiledPlan::new(&motion.graph, inputs, &outputs);
        Self { compiled, inputs: inputs.len(), columns }
    }
}
