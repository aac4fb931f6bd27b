//! The meanings of letters, and the conversion of values and expressions into sums of products of them.

use std::collections::{BTreeMap, HashMap};

use super::Laurent;
use super::laurent::{Letter, power_of, product, raised};
use kardan_math::num::Rational;
use kardan_math::units::{Exact, Expression, InNames, Kind, Node};

/// The meaning of a letter.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Symbol {
    /// π
    Pi,
    /// A value of the model: a parameter, or `<element>.<key>`.
    Value(String),
    /// A letter of the formulas of an element.
    Of(&'static str, String),
    /// A function of others, by name.
    Call(&'static str, Vec<Laurent>),
    /// A sum that something is divided by.
    Sum(Laurent),
    /// The curve of an element or its first or second derivative, where it has no formula.
    Curve(String, usize, Laurent),
    /// The angle, position or charge of a coordinate, by number.
    Position(usize),
    /// Its rate.
    Speed(usize),
    /// The rate of that.
    Acceleration(usize),
    /// The sense of a friction, set-valued at rest.
    Sign(Laurent),
    /// The torque of a friction in motion that depends on its speed, by element and number.
    Sliding(String, usize),
    /// An input, by number.
    Input(usize),
    /// The time.
    Time,
    /// What the element prescribes as a function of time, or its first or second rate.
    OfTime(String, usize),
    /// The multiplier of a constraint, by number.
    Multiplier(usize),
    /// The torque of a unilateral or switched law of an element, or (if so) its gear loss.
    Unilateral(String, bool),
}

/// The meaning of the name of a value.
#[derive(Debug, Clone)]
pub enum Meaning {
    /// A value with a letter of its own.
    Value,
    /// A computed value.
    Formula(Expression),
    /// A number that has no letter.
    Number(Exact),
}

/// The letters of the equations of one model.
#[derive(Debug, Clone, Default)]
pub struct Letters {
    symbols: Vec<Symbol>,
    index: HashMap<Symbol, Letter>,
    meanings: BTreeMap<String, Meaning>,
}

impl Letters {
    /// Without any letter yet; `meanings` by the names of values.
    pub fn new(meanings: BTreeMap<String, Meaning>) -> Self {
        Self { meanings, ..Self::default() }
    }

    /// The meaning of a letter.
    pub fn symbol(&self, letter: Letter) -> &Symbol {
        &self.symbols[letter as usize]
    }

    /// The letter of a symbol; a new one if there is none.
    pub fn letter(&mut self, symbol: Symbol) -> Letter {
        if let Some(existing) = self.index.get(&symbol) {
            return *existing;
        }
        let letter = Letter::try_from(self.symbols.len()).expect("fewer than four thousand million letters");
        self.symbols.push(symbol.clone());
        self.index.insert(symbol, letter);
        letter
    }

    /// The letters in sums and in their definitions, each once, in order.
    pub fn used_in<'a>(&'a self, values: impl Iterator<Item = &'a Laurent>) -> Vec<Letter> {
        let mut open: Vec<&Laurent> = values.collect();
        let mut found = std::collections::BTreeSet::new();
        while let Some(value) = open.pop() {
            for letter in value.letters().into_iter().filter(|letter| found.insert(*letter)).collect::<Vec<_>>() {
                match self.symbol(letter) {
                    Symbol::Call(_, parts) => open.extend(parts),
                    Symbol::Sum(sum) | Symbol::Curve(_, _, sum) | Symbol::Sign(sum) => open.push(sum),
                    _ => {}
                }
            }
        }
        found.into_iter().collect()
    }

    /// The letter of a symbol as a sum.
    pub fn of(&mut self, symbol: Symbol) -> Laurent {
        Laurent::letter(self.letter(symbol))
    }

    /// A number as computed from named values.
    pub fn exact(&mut self, value: &Exact) -> Laurent {
        match value.in_names() {
            None => self.number(value),
            Some(InNames::Name(name)) => match self.meanings.get(name).cloned() {
                Some(Meaning::Number(number)) => self.number(&number),
                _ => self.named(name),
            },
            Some(InNames::Number(number)) => self.number(number),
            Some(InNames::Negative(inner)) => self.exact(inner).scaled(&Rational::from(-1)),
            Some(InNames::Reciprocal(inner)) => {
                let inner = self.exact(inner);
                self.divide(&Laurent::number(Rational::ONE), &inner)
            }
            Some(InNames::Sum(a, b)) => self.exact(a).plus(&self.exact(b)),
            Some(InNames::Product(a, b)) => self.exact(a).times(&self.exact(b)),
        }
    }

    fn number(&mut self, value: &Exact) -> Laurent {
        let rational = Laurent::number(value.rational.clone());
        if value.pi == 0 {
            return rational;
        }
        let pi = self.letter(Symbol::Pi);
        rational.times_term(&vec![(pi, value.pi)], &Rational::ONE)
    }

    /// The meaning of a name.
    fn named(&mut self, name: &str) -> Laurent {
        match self.meanings.get(name).cloned() {
            Some(Meaning::Formula(expression)) => self.read(&expression.root, &BTreeMap::new()),
            Some(Meaning::Number(number)) => self.number(&number),
            Some(Meaning::Value) | None => self.of(Symbol::Value(name.to_string())),
        }
    }

    /// A formula of an element: `names` are its named values.
    pub fn formula(&mut self, text: &str, names: &BTreeMap<&str, Laurent>) -> Laurent {
        let read = Expression::parse(text).expect("formulas of elements are expressions");
        self.read(&read.root, names)
    }

    pub(super) fn read(&mut self, node: &Node, names: &BTreeMap<&str, Laurent>) -> Laurent {
        match &node.kind {
            Kind::Literal(value, _) => self.number(value),
            Kind::Name(name) => match names.get(name.as_str()) {
                Some(existing) => existing.clone(),
                None => self.named(name),
            },
            Kind::Negative(inner) => self.read(inner, names).scaled(&Rational::from(-1)),
            Kind::Binary(operator, parts) => {
                let [a, b] = [&parts[0], &parts[1]].map(|part| self.read(part, names));
                match operator {
                    '+' => a.plus(&b),
                    '-' => a.minus(&b),
                    '*' => self.bounded(a, b),
                    '/' => self.divide(&a, &b),
                    _ => self.power(a, b),
                }
            }
            Kind::Call(function, arguments) => {
                let arguments = arguments.iter().map(|argument| self.read(argument, names)).collect();
                self.of(Symbol::Call(function.name(), arguments))
            }
            Kind::Lookup(_, _) => unreachable!("values call no tables: expressions with them are no values"),
            Kind::If(comparison, parts) => {
                let parts = parts.iter().map(|part| self.read(part, names)).collect();
                self.of(Symbol::Call(comparison, parts))
            }
        }
    }

    fn power(&mut self, base: Laurent, exponent: Laurent) -> Laurent {
        let whole =
            exponent.as_number().filter(Rational::is_int).and_then(|n| i32::try_from(n.numerator().clone()).ok());
        let expandable = |n: i32| base.count().saturating_pow(n.unsigned_abs()) <= MOST_MULTIPLIED;
        match whole.filter(|n| n.abs() <= MOST_POWER) {
            Some(n) if !expandable(n) => {
                let letter = self.letter(Symbol::Sum(base));
                Laurent::of([(vec![(letter, n)], Rational::ONE)])
            }
            Some(n) => match base.power(n) {
                Some(power) => power,
                None => {
                    let below = base.power(-n).unwrap_or_default();
                    self.divide(&Laurent::number(Rational::ONE), &below)
                }
            },
            None => self.of(Symbol::Call("^", vec![base, exponent])),
        }
    }

    /// A product; a sum that would make it long remains a letter.
    fn bounded(&mut self, a: Laurent, b: Laurent) -> Laurent {
        if a.count().saturating_mul(b.count()) <= MOST_MULTIPLIED {
            return a.times(&b);
        }
        let (long, short) = if a.count() > b.count() { (a, b) } else { (b, a) };
        let letter = self.of(Symbol::Sum(long));
        match short.count() > MOST_FACTOR {
            true => letter.times(&self.of(Symbol::Sum(short))),
            false => letter.times(&short),
        }
    }

    /// A quotient; an inexact division by a sum becomes a division by a letter for that sum.
    pub fn divide(&mut self, a: &Laurent, b: &Laurent) -> Laurent {
        if let Some((monomial, number)) = b.single() {
            return a.times_term(&raised(monomial, -1), &(Rational::ONE / number));
        }
        if let Some(quotient) = a.divided_by(b) {
            return quotient;
        }
        let common = b.common();
        let first = b.terms().next_back().map_or(Rational::ONE, |(_, number)| number.clone());
        let factor = Rational::ONE / first;
        let sum = b.times_term(&raised(&common, -1), &factor);
        let letter = self.letter(Symbol::Sum(sum));
        a.times_term(&product(&raised(&common, -1), &vec![(letter, -1)]), &factor)
    }

    /// The same with all sums cancelled that divide their numerators.
    pub fn cancelled(&self, value: &Laurent) -> Laurent {
        let mut value = value.clone();
        for letter in value.letters() {
            let Symbol::Sum(sum) = self.symbol(letter) else { continue };
            let of_letter = |power: i32| raised(&vec![(letter, 1)], power);
            loop {
                let lowest = power_of(&value.common(), letter);
                if lowest >= 0 {
                    break;
                }
                // The numerators over the lowest power: other terms get the sum itself as a factor.
                let parts = value.terms().map(|(monomial, number)| {
                    let own = power_of(monomial, letter);
                    let rest = product(monomial, &of_letter(-own));
                    let raised = sum.power(own - lowest).unwrap_or_default();
                    raised.times_term(&rest, number)
                });
                let above = parts.fold(Laurent::default(), |all, part| all.plus(&part));
                let Some(quotient) = above.divided_by(sum) else { break };
                value = quotient.times_term(&of_letter(lowest + 1), &Rational::ONE);
            }
        }
        value
    }
}

/// Sums within formulas whose product has more terms are not multiplied out.
const MOST_MULTIPLIED: usize = 256;
/// Then a factor of more terms remains a sum, too.
const MOST_FACTOR: usize = 64;
/// Higher powers of sums are not multiplied out.
const MOST_POWER: i32 = 8;
