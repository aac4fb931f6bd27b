//! The Jacobian of a machine: the differentiated residuals, and accelerations and constraint torques from their
//! derivatives.

use super::Machine;
use super::expressions::{Parts, extend};
use super::jacobian::Jacobian;
use crate::compiled_plan::symbols;
use crate::radau::Descriptor;
use kardan_expr::expr::{Expr, Symbol};
use kardan_math::num::Rational;
use kardan_mechanics::reduce::{Motion, Reduced};

impl Machine {
    /// Prepares derivatives of the rates; false where a law computes by itself at every instant.
    pub fn prepare_jacobian(&mut self, reduced: &Reduced) -> bool {
        if self.own_laws || !self.gear_losses.is_empty() {
            return false;
        }
        let (r, states) = (self.degrees_of_freedom, self.size - 2);
        let mut motion = Motion::new(reduced);
        let Self { drives, laws, targets, signals, flow, .. } = self;
        let parts = Parts { drives, laws, targets, signals, flow: flow.as_ref() };
        let (extension, places, ..) = extend(&mut motion, reduced, parts, 2 * r..states);
        let mut inputs: Vec<Symbol> = motion.symbols.iter().chain(&extension.inputs).copied().collect();
        let more = places.states.clone().map(|state| extension.inputs[state]);
        let by: Vec<Symbol> = motion.symbols.iter().copied().chain(more).collect();
        let accelerations = symbols(&mut motion.graph, "acceleration", r);
        let torques = symbols(&mut motion.graph, "holding", self.multiplier_constraints.end);
        let more = accelerations.iter().chain(&torques);
        inputs.extend(more.filter_map(|symbol| motion.graph.symbol_of(*symbol)));
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
        self.jacobian = Some(Box::new(Jacobian::new(&mut motion, &inputs, &by, residuals)));
        true
    }

    /// The derivatives of all rates but those of the energies by all states but these, row by row.
    pub fn find_jacobian(&mut self, time: f64, state: &[f64], out: &mut [f64]) {
        let mut equations = Descriptor::default();
        self.find_descriptor(time, state, &mut equations);
        equations.solve(self.size - 2, out);
    }

    /// The same as linear equations of states and constraint torques: `H v̇ + Gᵀλ = ∂(f − H a − Gᵀλ₀)/∂x x`,
    /// `G v̇ = −∂(b + G a)/∂x x`, in whose derivatives accelerations a and torques λ₀ are constant.
    pub(crate) fn find_descriptor(&mut self, time: f64, state: &[f64], out: &mut Descriptor) {
        let Some(mut jacobian) = self.jacobian.take() else { return out.clear(0) };
        let (r, states) = (self.degrees_of_freedom, self.size - 2);
        self.forces(time, state);
        self.accelerate();
        let Jacobian { compiled, inputs, columns } = &mut *jacobian;
        let (memory, motion) = (&mut compiled.memory, *inputs - r - self.multiplier_constraints.end);
        memory[..motion].copy_from_slice(&self.work.values()[..motion]);
        memory[motion..motion + r].copy_from_slice(&self.acceleration);
        let torques = &mut memory[motion + r..*inputs];
        torques.fill(0.0);
        self.holding.iter().zip(&self.active_torque).for_each(|(direction, torque)| torques[*direction] = *torque);
        compiled.evaluate();
        let nonzero = |row: &[f64]| row.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect::<Vec<_>>();
        let active_rows: Vec<Vec<(usize, f64)>> =
            self.holding.iter().map(|k| nonzero(&self.work.friction_rows[k * r..(k + 1) * r])).collect();
        out.clear(states + active_rows.len());
        for i in (0..r).chain(2 * r..states) {
            out.mass(i, i, 1.0);
        }
        for i in 0..r {
            nonzero(&self.work.inertia[i * r..(i + 1) * r]).into_iter().for_each(|(j, x)| out.mass(r + i, r + j, x));
        }
        for (a, active_row) in active_rows.iter().enumerate() {
            active_row.iter().for_each(|(i, x)| out.mass(states + a, r + i, *x));
        }
        for (a, active_row) in active_rows.iter().enumerate() {
            active_row.iter().for_each(|(i, x)| out.rate(r + i, states + a, -x));
        }
        (0..r).for_each(|i| out.rate(i, r + i, 1.0));
        for &i in &self.still {
            [i, r + i].into_iter().for_each(|state| out.still(state));
        }
        let mut place = vec![None; self.multiplier_constraints.end];
        self.holding.iter().enumerate().for_each(|(a, direction)| place[*direction] = Some(a));
        for (k, [forces, bias, rates]) in columns.iter().enumerate() {
            rates.iter().for_each(|(row, output)| out.rate(2 * r + row, k, *compiled.output(*output)));
            forces.iter().for_each(|(row, output)| out.rate(r + row, k, *compiled.output(*output)));
            for (direction, output) in bias {
                if let Some(a) = place[*direction] {
                    out.rate(states + a, k, -compiled.output(*output));
                }
            }
        }
        self.jacobian = Some(jacobian);
    }
}
