//! Constraints that are kept with their multipliers, in letters: `A q̇_r = b`, `A q̈_r = c`, and what they do, `Aᵀλ`.

use std::collections::BTreeMap;

use super::terms::{KeptLaw, Row};
use super::walk::{SymbolicKept, Walk};
use super::{Laurent, Letter, Symbol};
use crate::num::Rational;

impl Walk<'_> {
    /// All kept constraints, and what their multipliers do.
    pub(super) fn keep(&mut self) {
        for k in 0..self.reduced.equations.kept.len() {
            let element = self.reduced.equations.kept[k].element.clone();
            let law = self.terms.kept.iter().find(|(other, _)| *other == element).map(|(_, law)| law.clone());
            let Some(law) = law else { continue };
            let (row, found) = self.kept(&element, law);
            let multiplier = self.letters.of(Symbol::Multiplier(k));
            for (column, entry) in &found.row {
                let share = entry.times(&multiplier);
                self.out.kept_forces[*column] = self.out.kept_forces[*column].plus(&share);
            }
            self.kept_rows.push(row);
            self.out.kept.push(found);
        }
    }

    /// The row over all coordinates, and the constraint.
    fn kept(&mut self, element: &str, law: KeptLaw) -> (Row, SymbolicKept) {
        let n = self.known.len();
        let mut out = SymbolicKept::default();
        let (row, rate, prescribed) = match law {
            KeptLaw::Rates(row) => (row, Some(Laurent::default()), Laurent::default()),
            KeptLaw::Surface(surface) => {
                let row = self.slopes_of(&surface, n);
                out.position = Some(surface);
                (row, Some(Laurent::default()), Laurent::default())
            }
            KeptLaw::Speed(row) => (row, Some(self.prescribed(element, 0)), self.prescribed(element, 1)),
            KeptLaw::Acceleration(row) => (row, None, self.prescribed(element, 0)),
        };
        let (mut rate, mut acceleration) = (rate, prescribed);
        let moving = self.speeds_by_letter(n);
        for (coordinate, entry) in &row {
            let turned = self.letters.change(entry, &moving, &mut self.assumed);
            let speed = self.letters.of(Symbol::Speed(*coordinate));
            acceleration = acceleration.minus(&self.assumed.product(&turned, &speed));
            let known = self.known[*coordinate].clone();
            acceleration = acceleration.minus(&self.assumed.product(entry, &known.bias));
            if let Some(rate) = &mut rate {
                *rate = rate.minus(&self.assumed.product(entry, &known.drift));
            }
            for (column, basis) in &known.basis {
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
