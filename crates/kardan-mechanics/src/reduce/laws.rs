//! Torque expressions in the equations of motion.

use std::sync::Arc;

use super::{Motion, Reduced, SparseRow};
use crate::equations::{Formula, Meaning};
use kardan_expr::expr::{Expr, Named, Symbol};
use kardan_math::num::Rational;
use kardan_math::units::Dimension;

impl Motion {
    /// A formula as an expression of the motion.
    ///
    /// # Panics
    /// If it names a coordinate that the model does not have, or has an error; it was checked when it was read.
    pub fn formula(&mut self, reduced: &Reduced, formula: &Formula) -> Expr {
        let zero = self.graph.integer(0);
        self.formula_with(reduced, formula, [zero; 2], &[])
    }

    /// The same with the sizes of torque and speed of a gear loss, and with parameters that are symbols.
    ///
    /// # Panics
    /// As [`Self::formula`].
    pub fn formula_with(
        &mut self,
        reduced: &Reduced,
        formula: &Formula,
        [load, slip]: [Expr; 2],
        free: &[(String, Expr)],
    ) -> Expr {
        let coordinate = |name: &str| {
            let number = reduced.coordinate(name).expect("a formula names coordinates of its model");
            (number, reduced.equations.domain(number).dimensions())
        };
        let mut bindings: Vec<(&str, Named)> = Vec::with_capacity(formula.names.len());
        for (name, meaning) in &formula.names {
            let own = free.iter().find(|(other, _)| other == name);
            let named = match meaning {
                Meaning::Constant(value, dimension) => match own {
                    Some((_, symbol)) => Named::Varying(*symbol, *dimension),
                    None => Named::Constant(value.clone(), *dimension),
                },
                Meaning::Position(body) => {
                    let (number, [dimension, _]) = coordinate(body);
                    Named::Varying(self.angles[number], dimension)
                }
                Meaning::Rate(body) => {
                    let (number, [_, dimension]) = coordinate(body);
                    Named::Varying(self.speeds[number], dimension)
                }
                Meaning::Time => Named::Varying(self.time(), Dimension::TIME),
                Meaning::Signal(function) => Named::Varying(self.of_time(function), function.dimension()),
                Meaning::Block(name, dimension) => Named::Varying(self.of_block(name, *dimension), *dimension),
                Meaning::Table(table) => Named::Table(Arc::clone(table)),
                Meaning::Shared(shared) => {
                    let value = self.formula_with(reduced, shared, [load, slip], free);
                    Named::Varying(value, shared.dimension)
                }
                Meaning::Load(dimension) => Named::Varying(load, *dimension),
                Meaning::Slip(dimension) => Named::Varying(slip, *dimension),
            };
            bindings.push((name, named));
        }
        let mut named =
            |_: &mut _, name: &str| bindings.iter().find(|(other, _)| *other == name).map(|(_, n)| n.clone());
        // It was checked when it was read: only a division by an expression that is zero at rest can fail. It is
        // undefined there.
        let value = match self.graph.lowered(&formula.expression, &mut named) {
            Ok((value, _)) => value,
            Err(_) => self.graph.without_value(),
        };
        self.graph.group(value)
    }

    /// Adds the torques of expressions to the forces. Beside motions y without inertia they act on x, with y at rest,
    /// and on y with the prescribed part of the speeds; their other effects cancel with dampers or come with ẏ.
    pub(super) fn add_laws(&mut self, reduced: &Reduced) {
        for law in &reduced.equations.laws {
            let (torque, mut row) = (self.formula(reduced, &law.value), self.reduced_row(&law.row));
            if let Some(massless) = &reduced.massless {
                let (first_order, moves): (SparseRow, SparseRow) =
                    row.into_iter().partition(|(place, _)| massless.is_state(*place));
                row = moves;
                if !first_order.is_empty() {
                    let carried = self.of_carried(reduced, &law.value);
                    self.passive_terms.add(&mut self.graph, &first_order, carried, &Rational::ONE);
                }
            }
            self.passive_terms.add(&mut self.graph, &row, torque, &Rational::ONE);
            self.laws.push(torque);
        }
    }

    /// The prescribed part of a law that is linear in speeds.
    fn of_carried(&mut self, reduced: &Reduced, law: &Formula) -> Expr {
        let carried = self.carried.clone();
        let speeds = std::mem::replace(&mut self.speeds, carried);
        let value = self.formula(reduced, law);
        self.speeds = speeds;
        value
    }

    /// The output of a block, as a symbol; at a fixed time there are no blocks, and it is zero.
    fn of_block(&mut self, name: &str, dimension: Dimension) -> Expr {
        let (graph, timed) = (&mut self.graph, &mut self.timed);
        if timed.begin {
            return graph.integer(0);
        }
        let mut bindings = timed.block_outputs.iter().chain(&timed.blocks);
        if let Some((_, bindings)) = bindings.find(|(candidate, _)| candidate == name) {
            return *bindings;
        }
        let symbol = graph.new_symbol(name.to_string(), dimension);
        timed.blocks.push((name.to_string(), symbol));
        symbol
    }

    /// Substitutes the block outputs at every instant for their symbols.
    pub fn output(&mut self, outputs: Vec<(String, Expr)>) {
        let (graph, timed) = (&mut self.graph, &mut self.timed);
        let value = |name: &str| outputs.iter().find(|(candidate, _)| candidate == name).map(|(_, value)| *value);
        let substitutions: Vec<(Symbol, Expr)> =
            timed.blocks.iter().filter_map(|(name, symbol)| Some((graph.symbol_of(*symbol)?, value(name)?))).collect();
        timed.blocks.retain(|(name, _)| value(name).is_none());
        if !substitutions.is_empty() {
            self.passive = graph.substitute(&self.passive, &substitutions);
            self.laws = graph.substitute(&self.laws, &substitutions);
            self.passive_terms.substitute(graph, &substitutions);
        }
        timed.block_outputs = outputs;
    }

    /// The time; a number where it is fixed.
    pub fn time(&mut self) -> Expr {
        let (graph, timed) = (&mut self.graph, &mut self.timed);
        if timed.begin {
            return graph.integer(0);
        }
        *timed.time.get_or_insert_with(|| graph.new_symbol("t".into(), Dimension::TIME))
    }
}
