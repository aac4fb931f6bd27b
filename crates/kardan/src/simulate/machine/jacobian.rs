//! The exact Jacobian of the rates by the state, in one set of modes.
//!
//! With `H a = f − Gᵀλ` and `G a + b = 0` the derivatives of accelerations and holding torques by a state x follow from the factors that the
//! accelerations themselves come from: `H a′ = ∂(f − H a − Gᵀλ)/∂x − Gᵀλ′` and `G a′ + ∂(b + G a)/∂x = 0`, where a and λ stand still in
//! the derivatives on the right.

use kardan_native::Native;

use super::Machine;
use super::expressions::extend;
use crate::expr::{Expr, Symbol};
use crate::num::Rational;
use crate::plan::{Plan, compile};
use crate::reduce::{Motion, Reduced};
use crate::units::Dimension;

/// Derivatives as a plan.
pub(super) struct Jacobian {
    plan: Plan,
    native: Option<Native<f64>>,
    memory: Vec<f64>,
    /// Inputs of the plan: those of the rates, accelerations, torques of friction directions.
    given: usize,
    columns: Vec<Column>,
}

/// What depends on one state: numbers of coordinates, friction directions and states behind the speeds, each with the place of its
/// derivative in the memory.
#[derive(Default)]
struct Column {
    forces: Vec<(usize, usize)>,
    bias: Vec<(usize, usize)>,
    rates: Vec<(usize, usize)>,
}

impl Jacobian {
    /// Derivatives of the expressions of a loop. The residuals are those of forces, of the directions of friction, and the rates.
    fn new(motion: &mut Motion, given: &[Symbol], states: &[Symbol], residuals: [Vec<Expr>; 3]) -> Self {
        let mut outputs: Vec<(String, Expr)> = Vec::new();
        let mut columns: Vec<Column> = states.iter().map(|_| Column::default()).collect();
        let [forces, bias, rates] = &residuals;
        let kinds = [("force", forces), ("bias", bias), ("rate", rates)];
        // For each state what depends on it: else the work would grow with the square of the size.
        let mut wanted: Vec<Vec<(usize, usize)>> = vec![Vec::new(); states.len()];
        for (kind, (_, exprs)) in kinds.iter().enumerate() {
            for (k, expr) in exprs.iter().enumerate() {
                for symbol in motion.graph.symbols(&[*expr]) {
                    if let Some(state) = states.iter().position(|state| *state == symbol) {
                        wanted[state].push((kind, k));
                    }
                }
            }
        }
        for ((state, wanted), column) in states.iter().zip(wanted).zip(&mut columns) {
            let exprs: Vec<Expr> = wanted.iter().map(|(kind, k)| kinds[*kind].1[*k]).collect();
            for ((kind, k), slope) in wanted.into_iter().zip(motion.graph.derivatives(&exprs, *state)) {
                if motion.graph.is_zero(slope) {
                    continue;
                }
                let lists = [&mut column.forces, &mut column.bias, &mut column.rates];
                lists[kind].push((k, outputs.len()));
                outputs.push((format!("{}.{k}.{}", kinds[kind].0, motion.graph.name(*state).0), slope));
            }
        }
        let plan = compile(&motion.graph, given, &outputs).expect("all that residuals depend on is given");
        for column in &mut columns {
            for list in [&mut column.forces, &mut column.bias, &mut column.rates] {
                list.iter_mut().for_each(|(_, output)| *output = plan.place(*output));
            }
        }
        let native = Native::new(&plan.block());
        Self { memory: plan.memory(), native, plan, given: given.len(), columns }
    }
}

impl Machine {
    /// Prepares derivatives of the rates; false where a law computes by itself at every instant.
    pub fn prepare_jacobian(&mut self, reduced: &Reduced) -> bool {
        if self.own_laws {
            return false;
        }
        let (r, states) = (self.degrees_of_freedom, self.size - 2);
        let mut motion = Motion::new(reduced);
        let parts = (&self.drives[..], &self.laws[..], &self.targets[..]);
        let (extension, places) = extend(&mut motion, reduced, parts, 2 * r..states);
        let mut given: Vec<Symbol> = motion.symbols.iter().chain(&extension.inputs).copied().collect();
        let more = places.states.clone().map(|state| extension.inputs[state]);
        let by: Vec<Symbol> = motion.symbols.iter().copied().chain(more).collect();
        let mut symbols = |name: &str, count: usize| -> Vec<Expr> {
            let new = |k| motion.graph.new_symbol(format!("{name}.{k}"), Dimension::NONE);
            let new: Vec<Expr> = (0..count).map(new).collect();
            given.extend(new.iter().filter_map(|symbol| motion.graph.symbol_of(*symbol)));
            new
        };
        let (accelerations, torques) = (symbols("acceleration", r), symbols("holding", self.modes.len()));
        let minus = Rational::from(-1);
        let output = |place: usize| (extension.outputs[place].1, Rational::ONE);
        let mut forces: Vec<_> = places.forces.clone().map(|place| vec![output(place)]).collect();
        for (&(i, j), entry) in &motion.inertia.clone() {
            forces[i].push((motion.graph.multiply(*entry, accelerations[j]), minus.clone()));
            if i != j {
                forces[j].push((motion.graph.multiply(*entry, accelerations[i]), minus.clone()));
            }
        }
        let mut bias: Vec<_> = motion.friction_bias.iter().map(|bias| vec![(*bias, Rational::ONE)]).collect();
        for (k, row) in motion.frictions.clone().iter().enumerate() {
            for (i, entry) in row {
                forces[*i].push((motion.graph.multiply(*entry, torques[k]), minus.clone()));
                bias[k].push((motion.graph.multiply(*entry, accelerations[*i]), Rational::ONE));
            }
        }
        let rates = places.rates.clone().map(|place| output(place).0).collect();
        let mut sums = |list: Vec<Vec<(Expr, Rational)>>| -> Vec<Expr> {
            list.iter().map(|terms| motion.graph.sum(Rational::ZERO, terms)).collect()
        };
        let residuals = [sums(forces), sums(bias), rates];
        self.jacobian = Some(Box::new(Jacobian::new(&mut motion, &given, &by, residuals)));
        true
    }

    /// The derivatives of all rates but those of the energies by all states but these, row by row.
    pub fn find_jacobian(&mut self, time: f64, state: &[f64], out: &mut [f64]) {
        let Some(mut jacobian) = self.jacobian.take() else { return out.fill(f64::NAN) };
        let (r, states) = (self.degrees_of_freedom, self.size - 2);
        self.forces(time, state);
        self.accelerate();
        let Jacobian { plan, native, memory, given, columns } = &mut *jacobian;
        let motion = *given - r - self.modes.len();
        memory[..motion].copy_from_slice(&self.work.values()[..motion]);
        memory[motion..motion + r].copy_from_slice(&self.acceleration);
        let torques = &mut memory[motion + r..*given];
        torques.fill(0.0);
        self.holding.iter().zip(&self.hold_torque).for_each(|(direction, torque)| torques[*direction] = *torque);
        // What is no number is seen where it is used.
        let _ = match native {
            Some(native) => native.evaluate(memory),
            None => plan.block().evaluate(memory),
        };
        out.fill(0.0);
        for i in (0..r).filter(|i| !self.still.contains(i)) {
            out[i * states + r + i] = 1.0;
        }
        for (k, column) in columns.iter().enumerate() {
            for (row, place) in &column.rates {
                out[(2 * r + row) * states + k] = memory[*place];
            }
            if column.forces.is_empty() && column.bias.is_empty() {
                continue;
            }
            self.force.fill(0.0);
            column.forces.iter().for_each(|(row, place)| self.force[*row] = memory[*place]);
            self.work.friction_bias.fill(0.0);
            column.bias.iter().for_each(|(direction, place)| self.work.friction_bias[*direction] = memory[*place]);
            self.accelerate_held();
            (0..r).for_each(|i| out[(r + i) * states + k] = self.acceleration[i]);
        }
        self.jacobian = Some(jacobian);
        // As it was found.
        self.forces(time, state);
        self.accelerate();
    }
}
