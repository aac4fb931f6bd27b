//! Sums of products in readable form: common factors first, terms of one value together.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use super::laurent::{power_of, raised};
use super::{Laurent, Letter, Letters, Monomial, Symbol};
use kardan_math::num::{Rational, Scalar};

/// A product: a number, and factors with their powers.
#[derive(Debug, Clone, PartialEq)]
pub struct Collected {
    /// The number.
    pub number: Rational,
    /// Factors, each once, in the order in which they are written.
    pub factors: Vec<(Base, i32)>,
}

/// A factor.
#[derive(Debug, Clone, PartialEq)]
pub enum Base {
    /// A letter.
    Letter(Letter),
    /// A sum of products.
    Sum(Vec<Collected>),
}

/// The position of a factor in a product.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
enum Rank {
    Number,
    Ratio,
    Shape,
    Value,
    Motion,
}

/// The value in factors; equal for all values of the letters.
///
/// ```
/// use kardan_expr::expr::Style;
/// use kardan_mechanics::symbolic::{Laurent, Letters, Symbol, collected, printed};
/// let mut letters = Letters::default();
/// let [i, j] = ["i", "J"].map(|name| letters.of(Symbol::Value(name.into())));
/// let next = i.plus(&Laurent::number(1.into()));
/// let value = next.times(&next).times(&i).times(&j).minus(&j.times(&i));
/// let ratio = |name: &str| name == "i";
/// let text = printed(&collected(&value, &letters, &ratio), Style::Text, &|letter| match letters.symbol(letter) {
///     Symbol::Value(name) => name.clone(),
///     _ => String::new(),
/// });
/// assert_eq!(text, "i^2*(i + 2)*J");
/// ```
pub fn collected(value: &Laurent, letters: &Letters, ratio: &dyn Fn(&str) -> bool) -> Collected {
    Collector { letters, ratio }.product(value)
}

struct Collector<'a> {
    letters: &'a Letters,
    /// Whether a value has no unit.
    ratio: &'a dyn Fn(&str) -> bool,
}

impl Collector<'_> {
    fn rank(&self, letter: Letter) -> Rank {
        match self.letters.symbol(letter) {
            Symbol::Pi => Rank::Number,
            Symbol::Value(name) if (self.ratio)(name) => Rank::Ratio,
            Symbol::Sum(sum) => sum.letters().into_iter().map(|letter| self.rank(letter)).max().unwrap_or(Rank::Ratio),
            Symbol::Of(..) | Symbol::Call(..) | Symbol::Curve(..) => Rank::Shape,
            Symbol::Value(_) | Symbol::Sliding(..) => Rank::Value,
            Symbol::Position(_) | Symbol::Speed(_) | Symbol::Acceleration(_) | Symbol::Sign(_) | Symbol::Input(_) => {
                Rank::Motion
            }
            Symbol::Time | Symbol::OfTime(..) | Symbol::Multiplier(_) | Symbol::Unilateral(..) => Rank::Motion,
        }
    }

    fn part(&self, monomial: &Monomial, ranks: &[Rank]) -> Monomial {
        monomial.iter().filter(|(letter, _)| ranks.contains(&self.rank(*letter))).copied().collect()
    }

    /// A value as one product.
    fn product(&self, value: &Laurent) -> Collected {
        if value.is_zero() {
            return Collected { number: Rational::ZERO, factors: Vec::new() };
        }
        let common = outside(value);
        let rest = value.times_term(&raised(&common, -1), &Rational::ONE);
        let mut out = Collected {
            number: Rational::ONE,
            factors: common.iter().map(|(letter, power)| (Base::Letter(*letter), *power)).collect(),
        };
        if let Some(number) = rest.as_number() {
            out.number = number;
        } else {
            for factor in self.split(&rest) {
                let own = match factor.count() {
                    1 => self.product(&factor),
                    _ => self.sum(&factor),
                };
                out.times(own);
            }
        }
        self.order(&mut out);
        out
    }

    /// Factors with sums of fewer terms, where there are any.
    fn split(&self, value: &Laurent) -> Vec<Laurent> {
        if value.count() < 2 {
            return vec![value.clone()];
        }
        for letter in value.letters() {
            let mut powers: BTreeMap<i32, Laurent> = BTreeMap::new();
            for (monomial, number) in value.terms() {
                let rest: Monomial = monomial.iter().filter(|(other, _)| *other != letter).copied().collect();
                let sum = powers.entry(power_of(monomial, letter)).or_default();
                *sum = sum.plus(&Laurent::of([(rest, number.clone())]));
            }
            let Some(first) = powers.values().next().cloned() else { continue };
            if powers.len() < 2 || first.count() < 2 && first.as_number().is_none() {
                continue;
            }
            let ratio = |other: &Laurent| other.divided_by(&first)?.as_number();
            let Some(numbers) = powers.iter().map(|(p, other)| Some((*p, ratio(other)?))).collect::<Option<Vec<_>>>()
            else {
                continue;
            };
            let of_letter = Laurent::of(numbers.into_iter().map(|(p, number)| (raised(&vec![(letter, 1)], p), number)));
            let mut out = roots(&of_letter, letter);
            match first.as_number() {
                Some(number) => out[0] = out[0].scaled(&number),
                None => out.extend(self.split(&first)),
            }
            return out;
        }
        vec![value.clone()]
    }

    /// A sum without common factors: terms with the same motion, value or form are grouped.
    fn sum(&self, value: &Laurent) -> Collected {
        let all = [Rank::Motion, Rank::Value, Rank::Shape];
        for ranks in [&all[..1], &all[1..2], &all[2..]] {
            let mut groups: BTreeMap<Monomial, Laurent> = BTreeMap::new();
            for (monomial, number) in value.terms() {
                let sum = groups.entry(self.part(monomial, ranks)).or_default();
                *sum = sum.plus(&Laurent::of([(monomial.clone(), number.clone())]));
            }
            if groups.len() > 1 {
                return self.of_groups(
                    groups.into_values().map(|group| self.product(&group)).collect(),
                    ranks[0] == Rank::Value,
                );
            }
        }
        self.of_groups(
            value.terms().map(|(m, number)| self.product(&Laurent::of([(m.clone(), number.clone())]))).collect(),
            false,
        )
    }

    /// The common factors before the sum; members of one form in a separate sum.
    fn of_groups(&self, mut members: Vec<Collected>, shapes: bool) -> Collected {
        let mut out = Collected { number: Rational::ONE, factors: Vec::new() };
        let first = members[0].factors.clone();
        for (base, power) in first {
            let own = |one: &Collected| {
                one.factors.iter().find(|(candidate, _)| *candidate == base).map_or(0, |found| found.1)
            };
            let least = members.iter().map(own).min().unwrap_or(0).min(power);
            if least > 0 && matches!(base, Base::Sum(_)) {
                members.iter_mut().for_each(|one| {
                    one.times(Collected { number: Rational::ONE, factors: vec![(base.clone(), -least)] })
                });
                out.factors.push((base, least));
            }
        }
        if shapes {
            members = self.by_shape(members);
        }
        members.sort_by_cached_key(|one| self.place(one));
        let sign = if members[0].number < Rational::ZERO { Rational::from(-1) } else { Rational::ONE };
        let divisor = content(&members) * sign;
        members.iter_mut().for_each(|one| one.number = &one.number / &divisor);
        out.number = divisor;
        out.factors.push((Base::Sum(members), 1));
        out
    }

    fn by_shape(&self, members: Vec<Collected>) -> Vec<Collected> {
        let shape = |one: &Collected| -> Monomial {
            let letters = one.factors.iter().filter_map(|(base, power)| match base {
                Base::Letter(letter) if self.rank(*letter) == Rank::Shape => Some((*letter, *power)),
                _ => None,
            });
            letters.collect()
        };
        let mut groups: Vec<(Monomial, Vec<Collected>)> = Vec::new();
        for member in members {
            let own = shape(&member);
            match groups.iter_mut().find(|(candidate, _)| *candidate == own) {
                Some((_, group)) => group.push(member),
                None => groups.push((own, vec![member])),
            }
        }
        if groups.len() < 2 {
            return groups.into_iter().flat_map(|(_, group)| group).collect();
        }
        let factored = |(shape, mut group): (Monomial, Vec<Collected>)| {
            if shape.is_empty() || group.len() < 2 {
                return group;
            }
            let before: Vec<(Base, i32)> =
                shape.into_iter().map(|(letter, power)| (Base::Letter(letter), power)).collect();
            for member in &mut group {
                member.factors.retain(|factor| !before.contains(factor));
            }
            let mut out = self.of_groups(group, false);
            out.factors.extend(before);
            self.order(&mut out);
            vec![out]
        };
        groups.into_iter().flat_map(factored).collect()
    }

    /// The order of the members of a sum: numbers last, fewer factors first, high powers first.
    fn place(&self, one: &Collected) -> (bool, bool, usize, Reverse<i32>, Vec<(Rank, Letter)>) {
        let powers = one.factors.iter().map(|(_, power)| *power).max().unwrap_or(0);
        let letters = one.factors.iter().rev().filter_map(|(base, _)| match base {
            Base::Letter(letter) => Some((self.rank(*letter), *letter)),
            Base::Sum(_) => None,
        });
        let (count, negative) = (one.factors.len(), one.number < Rational::ZERO);
        (one.factors.is_empty(), negative, count, Reverse(powers), letters.collect())
    }

    fn order(&self, one: &mut Collected) {
        one.factors.retain(|(_, power)| *power != 0);
        one.factors.sort_by_key(|(base, _)| match base {
            Base::Letter(letter) => (self.rank(*letter), false, *letter),
            Base::Sum(_) => (self.rank_of(base), true, 0),
        });
    }

    fn rank_of(&self, base: &Base) -> Rank {
        match base {
            Base::Letter(letter) => self.rank(*letter),
            Base::Sum(members) => {
                let ranks = members.iter().flat_map(|member| &member.factors).map(|factor| self.rank_of(&factor.0));
                ranks.max().unwrap_or(Rank::Number)
            }
        }
    }
}

impl Collected {
    fn times(&mut self, other: Self) {
        self.number = &self.number * &other.number;
        for (base, power) in other.factors {
            match self.factors.iter_mut().find(|(own, _)| *own == base) {
                Some((_, own)) => *own += power,
                None => self.factors.push((base, power)),
            }
        }
        self.factors.retain(|(_, power)| *power != 0);
    }
}

/// The common factor of all terms: the power of a letter that is in all of them, with one sign, and is nearest to zero.
fn outside(value: &Laurent) -> Monomial {
    let power = |letter: &Letter| {
        let powers = || value.terms().map(|(monomial, _)| power_of(monomial, *letter));
        let [least, most] = [powers().min().unwrap_or(0), powers().max().unwrap_or(0)];
        if least > 0 { least } else { most.min(0) }
    };
    value.letters().iter().map(|letter| (*letter, power(letter))).filter(|(_, power)| *power != 0).collect()
}

/// The greatest common divisor of all members.
fn content(members: &[Collected]) -> Rational {
    let mut all = Rational::ZERO;
    for member in members {
        let [mut a, mut b] = [&all, &member.number].map(|x| if *x < Rational::ZERO { -x } else { x.clone() });
        while !Scalar::is_zero(&b) {
            let whole = (&a / &b).floor();
            let rest = &a - &b * Rational::from(whole);
            (a, b) = (b, rest);
        }
        all = a;
    }
    if Scalar::is_zero(&all) { Rational::ONE } else { all }
}

/// A polynomial in one letter in its factors with small roots.
fn roots(value: &Laurent, letter: Letter) -> Vec<Laurent> {
    let step = value.terms().flat_map(|(monomial, _)| monomial.iter().map(|one| one.1)).fold(0, gcd).max(1);
    let (mut rest, mut out) = (value.clone(), Vec::new());
    for denominator in 1..=MOST_ROOT {
        for numerator in (1..=MOST_ROOT).flat_map(|n| [n, -n]).filter(|n| gcd(*n, denominator) == 1) {
            let monomial = vec![(letter, step)];
            let factor =
                Laurent::of([(monomial, Rational::from(denominator)), (Monomial::new(), Rational::from(numerator))]);
            while rest.count() > 1 && rest != factor {
                let Some(quotient) = rest.divided_by(&factor) else { break };
                if quotient.terms().any(|(monomial, _)| monomial.iter().any(|one| one.1 < 0)) {
                    break;
                }
                out.push(factor.clone());
                rest = quotient;
            }
        }
    }
    out.insert(0, rest);
    out
}

/// Roots with larger numerators or denominators are not searched.
const MOST_ROOT: i32 = 6;

fn gcd(a: i32, b: i32) -> i32 {
    if b == 0 { a.abs() } else { gcd(b, a % b) }
}

#[cfg(test)]
#[path = "../../tests/unit/symbolic/collected.rs"]
mod tests;
