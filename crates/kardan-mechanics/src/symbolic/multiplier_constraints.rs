//! Constraints enforced by multipliers, in letters: `A q̇_r = b`, `A q̈_r = c`, and their torques, `Aᵀλ`.

use std::collections::BTreeMap;

use super::derivation::{Derivation, SymbolicMultiplier};
use super::terms::{Row, SymbolicMultiplierLaw};
use super::{Laurent, Letter, Symbol};
use kardan_math::num::Rational;

impl Derivation<'_> {
    /// All multiplier constraints, and the torques of their multipliers.
    pub(super) fn add_multipliers(&mut self) {
        for k in 0..self.reduced.equations.multiplier_constraints.len() {
            let element = self.reduced.equations.multiplier_constraints[k].element.clone();
            let law = self
                .terms
                .multiplier_constraints
                .iter()
                .find(|(candidate, _)| *candidate == element)
                .map(|(_, law)| law.clone());
            let Some(law) = law else { continue };
            let (row, found) = self.multiplier_row(&element, law);
            let multiplier = self.letters.of(Symbol::Multiplier(k));
            for (column, entry) in &found.row {
                let share = entry.times(&multiplier);
                self.out.multiplier_forces[*column] = self.out.multiplier_forces[*column].plus(&share);
            }
            self.multiplier_rows.push(row);
            self.out.multiplier_constraints.push(found);
        }
    }

    /// The row over all coordinates, and the constraint.
    fn multiplier_row(&mut self, element: &str, law: SymbolicMultiplierLaw) -> (Row, SymbolicMultiplier) {
        let n = self.resolved.len();
        let mut out = SymbolicMultiplier::default();
        let (row, rate, prescribed) = match law {
            SymbolicMultiplierLaw::Rates(row) => (row, Some(Laurent::default()), Laurent::default()),
            SymbolicMultiplierLaw::Surface(surface) => {
                let row = self.slopes_of(&surface, n);
                out.position = Some(surface);
                (row, Some(Laurent::default()), Laurent::default())
            }
            SymbolicMultiplierLaw::Prescribed(row, 1) => {
                (row, Some(self.prescribed(element, 0)), self.prescribed(element, 1))
            }
            SymbolicMultiplierLaw::Prescribed(row, _) => (row, None, self.prescribed(element, 0)),
        };
        let (mut rate, mut acceleration) = (rate, prescribed);
        let moving = self.speeds_by_letter(n);
        for (coordinate, entry) in &row {
            let entry_rate = self.letters.change(entry, &moving, &mut self.assumed);
            let speed = self.letters.of(Symbol::Speed(*coordinate));
            acceleration = acceleration.minus(&self.assumed.product(&entry_rate, &speed));
            let resolved = self.resolved[*coordinate].clone();
            acceleration = acceleration.minus(&self.assumed.product(entry, &resolved.bias));
            if let Some(rate) = &mut rate {
                *rate = rate.minus(&self.assumed.product(entry, &resolved.drift));
            }
            for (column, basis) in &resolved.basis {
                let share = self.assumed.product(entry, basis);
                let sum = out.row.entry(*column).or_default();
                *sum = sum.plus(&share);
            }
        }
        out.row.values_mut().for_each(|entry| *entry = self.letters.cancelled(entry));
        out.row.retain(|_, entry| !entry.is_zero());
        for (left, of) in out.left.iter_mut().zip([Symbol::Speed as fn(usize) -> Symbol, Symbol::Acceleration]) {
            for (column, entry) in &out.row {
                let motion = self.letters.of(of(self.reduced.coordinates[*column]));
                left.push(entry.times(&motion));
            }
        }
        out.rate = rate.map(|rate| self.letters.cancelled(&rate));
        out.acceleration = self.letters.cancelled(&acceleration);
        (row, out)
    }

    /// The derivatives of a relation by the coordinates.
    fn slopes_of(&mut self, surface: &Laurent, n: usize) -> Row {
        let mut row = Row::new();
        for coordinate in 0..n {
            let letter = self.letters.letter(Symbol::Position(coordinate));
            let one = BTreeMap::from([(letter, Laurent::number(Rational::ONE))]);
            let slope = self.letters.change(surface, &one, &mut self.assumed);
            if !slope.is_zero() {
                row.push((coordinate, slope));
            }
        }
        row
    }

    fn speeds_by_letter(&mut self, n: usize) -> BTreeMap<Letter, Laurent> {
        let letters = &mut self.letters;
        (0..n).map(|k| (letters.letter(Symbol::Position(k)), letters.of(Symbol::Speed(k)))).collect()
    }
}
