//! Functions of time that constraints prescribe, and their rates.

use std::collections::BTreeMap;

use super::derivation::{Definition, Derivation, Formulas, FunctionSource, TimeFunction};
use super::{Laurent, Letter, Symbol};
use kardan_math::num::Rational;

impl Derivation<'_> {
    /// Formulas of functions of time, if they exist.
    pub(super) fn prescribe(&mut self, functions: &BTreeMap<String, TimeFunction>) {
        let time = self.letters.letter(Symbol::Time);
        let names = BTreeMap::from([("t", Laurent::letter(time))]);
        let rates = BTreeMap::from([(time, Laurent::number(Rational::ONE))]);
        for (element, TimeFunction { source, rate }) in functions {
            let mut formulas = Formulas::default();
            let first = usize::from(*rate);
            formulas[first] = match source {
                FunctionSource::Exact(value) => Some(self.letters.exact(value)),
                FunctionSource::Formula(read) => Some(self.letters.read(&read.root, &names)),
                FunctionSource::Text(_) => None,
            };
            for order in first + 1..formulas.len() {
                let Some(before) = formulas[order - 1].clone() else { break };
                formulas[order] = Some(self.letters.change(&before, &rates, &mut self.assumed));
            }
            self.times.insert(element.clone(), formulas);
        }
    }

    /// A prescribed function: its expression over time, or a letter for its value at one time.
    pub(super) fn prescribed(&mut self, element: &str, order: usize) -> Laurent {
        let formula = self.times.get(element).and_then(|formulas| formulas.get(order).cloned().flatten());
        let time = self.letters.letter(Symbol::Time);
        if let Some(steady) = formula.clone().filter(|value| !self.letters.used_in([value].into_iter()).contains(&time))
        {
            return steady;
        }
        let letter = self.letters.letter(Symbol::OfTime(element.to_string(), order));
        let is_defined = self.out.definitions.iter().any(|one| one.letter == letter);
        if let Some(value) = formula.filter(|_| !is_defined) {
            self.out.definitions.push(Definition { letter, value });
        }
        Laurent::letter(letter)
    }

    /// The rate of a prescribed function.
    pub(super) fn prescribed_rate(&mut self, value: &Laurent) -> Laurent {
        let mut rates: BTreeMap<Letter, Laurent> = BTreeMap::new();
        for letter in self.letters.used_in([value].into_iter()) {
            if let Symbol::OfTime(element, order) = self.letters.symbol(letter).clone() {
                rates.insert(letter, self.prescribed(&element, order + 1));
            }
        }
        if rates.is_empty() {
            return Laurent::default();
        }
        self.letters.change(value, &rates, &mut self.assumed)
    }
}
