//! The Jacobian of a machine: the residuals that are derived, and accelerations and holding torques from their derivatives.

use super::Machine;
use super::expressions::extend;
use super::jacobian::Jacobian;
use crate::expr::{Expr, Symbol};
use crate::num::Rational;
use crate::reduce::{Motion, Reduced};
use crate::units::Dimension;

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
