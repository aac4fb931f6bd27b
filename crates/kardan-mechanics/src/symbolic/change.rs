//! Rates of sums from the rates of their letters.

use std::collections::BTreeMap;

use super::elimination::Assumed;
use super::{Laurent, Letter, Letters, Symbol};
use kardan_math::num::Rational;

impl Letters {
    /// `Σ ∂value/∂x ẋ` over the letters x that change, by the given rate of each; all others are constant.
    pub(super) fn change(
        &mut self,
        value: &Laurent,
        rates: &BTreeMap<Letter, Laurent>,
        assumed: &mut Assumed,
    ) -> Laurent {
        let mut out = Laurent::default();
        for letter in value.letters() {
            let rate = self.change_of(letter, rates, assumed);
            if !rate.is_zero() {
                out = out.plus(&assumed.product(&value.slope(letter), &rate));
            }
        }
        self.cancelled(&out)
    }

    fn change_of(&mut self, letter: Letter, rates: &BTreeMap<Letter, Laurent>, assumed: &mut Assumed) -> Laurent {
        if let Some(rate) = rates.get(&letter) {
            return rate.clone();
        }
        match self.symbol(letter).clone() {
            Symbol::Sum(sum) => self.change(&sum, rates, assumed),
            Symbol::Curve(element, order, x) => {
                let rate = self.change(&x, rates, assumed);
                let slope = if rate.is_zero() { rate.clone() } else { self.of(Symbol::Curve(element, order + 1, x)) };
                assumed.product(&slope, &rate)
            }
            Symbol::Call(function, parts) => {
                let changes: Vec<Laurent> = parts.iter().map(|part| self.change(part, rates, assumed)).collect();
                if changes.iter().all(Laurent::is_zero) {
                    return Laurent::default();
                }
                self.change_of_call(letter, (function, &parts), &changes, assumed)
            }
            _ => Laurent::default(),
        }
    }

    /// The chain rule for each function that formulas may have.
    fn change_of_call(
        &mut self,
        letter: Letter,
        (function, parts): (&'static str, &[Laurent]),
        changes: &[Laurent],
        assumed: &mut Assumed,
    ) -> Laurent {
        let (one, own) = (Laurent::number(Rational::ONE), Laurent::letter(letter));
        let minus = Rational::from(-1);
        let slope = match (function, parts) {
            ("^", [base, power]) => return self.change_of_power(&own, [base, power], changes, assumed),
            ("atan2", [y, x]) => {
                let above = assumed.product(x, &changes[0]).minus(&assumed.product(y, &changes[1]));
                let below = assumed.product(x, x).plus(&assumed.product(y, y));
                return self.divide(&above, &below);
            }
            ("min" | "max", [a, b]) => {
                let sign = if function == "min" { "<" } else { ">" };
                return self.of(Symbol::Call(sign, [a, b, &changes[0], &changes[1]].map(Clone::clone).into()));
            }
            (_, [a, b, _, _]) => {
                return self.of(Symbol::Call(function, [a, b, &changes[2], &changes[3]].map(Clone::clone).into()));
            }
            ("sqrt", _) => self.divide(&one, &own.scaled(&Rational::from(2))),
            ("sin", [x]) => self.of(Symbol::Call("cos", vec![x.clone()])),
            ("cos", [x]) => self.of(Symbol::Call("sin", vec![x.clone()])).scaled(&minus),
            ("tan", _) => one.plus(&own.times(&own)),
            ("asin" | "acos", [x]) => {
                let under = one.minus(&assumed.product(x, x));
                let root = self.of(Symbol::Call("sqrt", vec![under]));
                let sign = if function == "asin" { Rational::ONE } else { minus };
                self.divide(&one, &root).scaled(&sign)
            }
            ("atan", [x]) => {
                let below = one.plus(&assumed.product(x, x));
                self.divide(&one, &below)
            }
            ("exp", _) => own,
            ("ln", [x]) => self.divide(&one, x),
            ("abs", [x]) => self.of(Symbol::Call("sign", vec![x.clone()])),
            _ => Laurent::default(),
        };
        assumed.product(&slope, &changes[0])
    }

    /// `n xⁿ⁻¹ ẋ + xⁿ ln x ṅ`
    fn change_of_power(
        &mut self,
        own: &Laurent,
        [base, power]: [&Laurent; 2],
        changes: &[Laurent],
        assumed: &mut Assumed,
    ) -> Laurent {
        let less = power.minus(&Laurent::number(Rational::ONE));
        let below = self.of(Symbol::Call("^", vec![base.clone(), less]));
        let slope = assumed.product(power, &below);
        let mut out = assumed.product(&slope, &changes[0]);
        if !changes[1].is_zero() {
            let logarithm = self.of(Symbol::Call("ln", vec![base.clone()]));
            let slope = assumed.product(own, &logarithm);
            out = out.plus(&assumed.product(&slope, &changes[1]));
        }
        out
    }
}

#[cfg(test)]
#[path = "../../tests/unit/symbolic/change.rs"]
mod tests;
