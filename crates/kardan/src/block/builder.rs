//! What a kind of block is, and what it writes itself into.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

use kardan_rt::Arithmetic;

use crate::element::{KeyError, Values};
use crate::expr::{Function, Graph, Lookup, Symbol, Traced};
use crate::num::Rational;
use crate::schema::Field;
use crate::units::{Dimension, Exact};

/// The description of a kind of block.
#[derive(Debug, Clone, Copy)]
pub struct BlockKind {
    /// The word after `kind =`, and the name of the file here.
    pub keyword: &'static str,
    /// What it is, in one sentence.
    pub summary: &'static str,
    /// Its formula.
    pub formula: &'static str,
    /// Its keys besides `kind`, `sample_time` and `unit`.
    pub fields: &'static [Field],
    /// An example, valid TOML.
    pub example: &'static str,
    /// Whether it reads blocks of another sample time as they stand.
    pub crosses: bool,
    /// What it answers and remembers.
    pub write: fn(&mut BlockBuilder<'_>) -> Result<(), KeyError>,
}

/// What a block remembers.
#[derive(Debug, Clone, Copy)]
pub struct Remembered<'g> {
    /// What stands for it.
    pub symbol: Traced<'g>,
    /// What it is at the start: no more than parameters stand in it.
    pub start: Traced<'g>,
    /// With a sample time what it is at the next sample, else its rate, 1/s.
    pub next: Traced<'g>,
}

/// What a block answers.
#[derive(Debug, Clone)]
pub struct Answer<'g> {
    /// What stands behind the name of the block and a point; empty: the name alone.
    pub name: String,
    /// The answer.
    pub value: Traced<'g>,
    /// What it is of.
    pub dimension: Dimension,
}

/// A transition of a machine: numbers of states, and what it depends on.
#[derive(Debug, Clone, Copy)]
pub struct Guard<'g> {
    /// The states.
    pub transition: kardan_rt::Transition,
    /// Above a half where it may be taken.
    pub when: Traced<'g>,
}

/// A list of quantities that has a name.
#[derive(Debug, Clone)]
pub struct List {
    /// The key that it stands in.
    pub key: &'static str,
    /// Its name there.
    pub name: String,
    /// The quantities.
    pub values: Vec<(Exact, Dimension)>,
}

/// Expressions by name.
pub type Expressions<'g> = Vec<(String, Traced<'g>, Dimension)>;

/// What a block is written into: its keys as expressions, and what it answers and remembers.
pub struct BlockBuilder<'g> {
    /// The graph.
    pub graph: &'g RefCell<Graph>,
    /// Keys that are expressions.
    pub inputs: BTreeMap<&'static str, (Traced<'g>, Dimension)>,
    /// Keys that are expressions by name.
    pub named: BTreeMap<&'static str, Expressions<'g>>,
    /// Its states where it has some, in their order: what stands for each in its keys, and for what it answers of it.
    pub own: Vec<[Traced<'g>; 2]>,
    /// All other keys.
    pub values: &'g Values,
    /// Lists by name.
    pub lists: Vec<List>,
    /// Transitions.
    pub guards: Vec<Guard<'g>>,
    /// The table that it names.
    pub table: Option<Arc<Lookup>>,
    /// Its sample time, s; none: it runs at every instant.
    pub sample_time: Option<Exact>,
    /// What it remembers.
    pub memory: Vec<Remembered<'g>>,
    /// What it answers.
    pub outputs: Vec<Answer<'g>>,
    /// What of its keys that vary must not be negative, or above zero.
    pub rules: RefCell<Vec<Rule<'g>>>,
}

/// What a run is to keep, of keys that vary.
#[derive(Debug, Clone)]
pub struct Rule<'g> {
    /// What it is, in words: `low` above `high`.
    pub what: String,
    /// What must not be negative.
    pub value: Traced<'g>,
    /// Whether it must be above zero.
    pub above: bool,
    /// What it is of.
    pub dimension: Dimension,
}

pub(super) fn key_error(key: &'static str, message: impl Into<String>, help: impl Into<String>) -> KeyError {
    KeyError { key, message: message.into(), help: help.into() }
}

impl<'g> BlockBuilder<'g> {
    /// An expression of a key that must be there.
    pub fn input(&self, key: &'static str) -> Result<(Traced<'g>, Dimension), KeyError> {
        let missing = || key_error(key, format!("`{key}` is missing"), "write an expression, or the name of a signal");
        self.inputs.get(key).copied().ok_or_else(missing)
    }

    /// The expression of a key, of a dimension; none if it is left out.
    pub fn of(&self, key: &'static str, expected: Dimension) -> Result<Option<Traced<'g>>, KeyError> {
        let Some((value, found)) = self.inputs.get(key).copied() else { return Ok(None) };
        if expected.is_like(&found) {
            return Ok(Some(value));
        }
        let message = format!("`{key}`: expected {}, found {}", expected.noun(), found.noun());
        Err(key_error(key, message, format!("write it in a unit such as {}", expected.example())))
    }

    /// The same of a key that must be there.
    pub fn needed(&self, key: &'static str, expected: Dimension) -> Result<Traced<'g>, KeyError> {
        self.input(key)?;
        Ok(self.of(key, expected)?.unwrap_or(Self::zero()))
    }

    /// The expressions of a key, in the order of the file; none if it is left out.
    pub fn expressions(&self, key: &'static str) -> &[(String, Traced<'g>, Dimension)] {
        self.named.get(key).map_or(&[], Vec::as_slice)
    }

    /// The lists of a key, in the order of the file.
    pub fn lists_of(&self, key: &'static str) -> impl Iterator<Item = &List> {
        self.lists.iter().filter(move |list| list.key == key)
    }

    /// The symbol that an expression is.
    pub fn symbol_of(&self, value: Traced<'g>) -> Option<Symbol> {
        let expr = value.expr(self.graph);
        self.graph.borrow().symbol_of(expr)
    }

    /// Whether an expression depends on a symbol.
    pub fn depends(&self, value: Traced<'g>, symbol: Traced<'g>) -> bool {
        let expr = value.expr(self.graph);
        self.symbol_of(symbol).is_some_and(|symbol| self.graph.borrow().symbols(&[expr]).contains(&symbol))
    }

    /// 0.
    pub fn zero() -> Traced<'g> {
        Traced::whole(0)
    }

    /// 1.
    pub fn one() -> Traced<'g> {
        Traced::whole(1)
    }

    /// An exact number.
    pub fn exact(&self, value: &Exact) -> Traced<'g> {
        let expr = self.graph.borrow_mut().exact(value);
        Traced::new(self.graph, expr)
    }

    /// The sample time, s, of a kind that needs one.
    pub fn period(&self, why: &str) -> Result<Traced<'g>, KeyError> {
        match &self.sample_time {
            Some(time) => Ok(self.exact(time)),
            None => {
                Err(key_error("kind", format!("it needs a `sample_time`: {why}"), "write `sample_time = \"1 ms\"`"))
            }
        }
    }

    /// e^x
    pub fn exp(&self, x: Traced<'g>) -> Traced<'g> {
        let x = x.expr(self.graph);
        let expr = self.graph.borrow_mut().apply(Function::Exp, x);
        Traced::new(self.graph, expr)
    }

    /// The value of a constant, SI; none if something varies in it.
    pub fn constant(&self, value: Traced<'g>) -> Option<f64> {
        let expr = value.expr(self.graph);
        let graph = self.graph.borrow();
        let is_constant = graph.symbols(&[expr]).is_empty();
        is_constant
            .then(|| crate::expr::lower(&graph, &[expr], &mut crate::expr::Floating::<f64>::default(), |_| f64::NAN)[0])
    }

    /// A new entry of the memory, with what it is at the start; its next value is to be set.
    pub fn remember(&mut self, start: Traced<'g>) -> Traced<'g> {
        let expr = self.graph.borrow_mut().new_symbol(format!("memory.{}", self.memory.len()), Dimension::NONE);
        let symbol = Traced::new(self.graph, expr);
        self.memory.push(Remembered { symbol, start, next: symbol });
        symbol
    }

    /// So many entries that start at zero.
    pub fn zeros<const N: usize>(&mut self) -> [Traced<'g>; N] {
        [(); N].map(|()| self.remember(Self::zero()))
    }

    /// What the entries are next, from one on.
    pub fn next(&mut self, first: usize, values: &[Traced<'g>]) {
        for (entry, next) in self.memory.iter_mut().skip(first).zip(values) {
            entry.next = *next;
        }
    }

    /// What it answers.
    pub fn answer(&mut self, value: Traced<'g>, dimension: Dimension) {
        self.answer_as("", value, dimension);
    }

    /// What it answers besides.
    pub fn answer_as(&mut self, name: &str, value: Traced<'g>, dimension: Dimension) {
        self.outputs.push(Answer { name: name.into(), value, dimension });
    }

    /// The block of `kardan-rt`: its memory is the answer and the entries that were made before.
    pub fn step<const N: usize>(
        &mut self,
        step: impl FnOnce(&mut [Traced<'g>; N]) -> bool,
        starts: [Traced<'g>; N],
    ) -> Traced<'g> {
        let first = self.memory.len();
        let mut memory = starts;
        // The answer is no memory but where a number is lost; nothing that is finite depends on it.
        for (place, start) in memory.iter_mut().zip(starts).skip(1) {
            *place = self.remember(start);
        }
        step(&mut memory);
        self.next(first, &memory[1..]);
        memory[0]
    }

    /// The same of a block that goes on from its own answer, with what all entries are at the start.
    pub fn go_on<const N: usize>(
        &mut self,
        step: impl FnOnce(&mut [Traced<'g>; N]) -> bool,
        starts: [Traced<'g>; N],
    ) -> [Traced<'g>; N] {
        let first = self.memory.len();
        let mut memory = starts.map(|start| self.remember(start));
        step(&mut memory);
        self.next(first, &memory);
        memory
    }

    /// A dimension by another one.
    pub fn over(&self, key: &'static str, a: Dimension, b: Dimension, power: i32) -> Result<Dimension, KeyError> {
        a.times(&b, power).ok_or_else(|| {
            key_error(key, format!("`{key}`: the exponents in its unit are too large"), "check the units")
        })
    }

    /// A whole number of samples that a time is, at least so many.
    pub fn samples(&self, key: &'static str, time: &Exact, period: &Exact) -> Result<usize, KeyError> {
        let ratio = time.to_rational() / period.to_rational();
        let whole: Option<usize> =
            ratio.denominator().is_one().then(|| ratio.numerator().clone().try_into().ok()).flatten();
        match whole {
            Some(count) if count <= MOST_SAMPLES => Ok(count),
            Some(count) => Err(key_error(
                key,
                format!("`{key}` has {count} samples, more than {MOST_SAMPLES}"),
                "make it shorter, or the sample time longer",
            )),
            None => {
                let nearest = crate::num::rational_to_f64(&ratio).round() * period.to_f64();
                Err(key_error(
                    key,
                    format!("`{key}` is not a multiple of the sample time"),
                    format!("the nearest one is {nearest} s"),
                ))
            }
        }
    }
}

/// Samples that a block may remember.
pub const MOST_SAMPLES: usize = 200;

/// A rational as an expression.
pub(super) fn rational<'g>(graph: &'g RefCell<Graph>, value: Rational) -> Traced<'g> {
    let expr = graph.borrow_mut().number(value);
    Traced::new(graph, expr)
}

impl<'g> BlockBuilder<'g> {
    /// Whether an expression is exactly zero.
    pub fn is_zero(&self, value: Traced<'g>) -> bool {
        let expr = value.expr(self.graph);
        self.graph.borrow().is_zero(expr)
    }

    /// The bounds `low` and `high`, as far as there are any: one that is left out is as far on the other side.
    pub fn bounds(&self, dimension: Dimension) -> Result<[Option<Traced<'g>>; 2], KeyError> {
        let high = self.of("high", dimension)?;
        let low = self.of("low", dimension)?.or(high.map(|high| -high));
        if let [Some(low), Some(high)] = [low, high] {
            self.in_order(["low", "high"], [low, high], dimension)?;
        }
        Ok([low, high])
    }

    /// The expression of a key that must not be negative where it is known.
    pub fn not_negative(
        &self,
        key: &'static str,
        expected: Dimension,
        why: &str,
    ) -> Result<Option<Traced<'g>>, KeyError> {
        self.signed(key, expected, why, false)
    }

    /// The expression of a key that must be above zero where it is known.
    pub fn positive(&self, key: &'static str, expected: Dimension, why: &str) -> Result<Option<Traced<'g>>, KeyError> {
        self.signed(key, expected, why, true)
    }

    fn signed(
        &self,
        key: &'static str,
        expected: Dimension,
        why: &str,
        above: bool,
    ) -> Result<Option<Traced<'g>>, KeyError> {
        let value = self.of(key, expected)?;
        match value.and_then(|value| self.constant(value)) {
            Some(found) if found < 0.0 || above && found == 0.0 => {
                let message = format!("`{key}` is {}: {why}", if found < 0.0 { "below zero" } else { "zero" });
                let help = match above {
                    true => "write a value above zero, or remove the block",
                    false => "check the sign",
                };
                Err(key_error(key, message, help))
            }
            Some(_) => Ok(value),
            None => {
                let what = format!("`{key}` is {}", if above { "zero or less" } else { "below zero" });
                let rule = |value| Rule { what, value, above, dimension: expected };
                self.rules.borrow_mut().extend(value.map(rule));
                Ok(value)
            }
        }
    }

    /// Refuses a key that does nothing as it stands.
    pub fn idle(&self, key: &'static str, why: &str, help: &str) -> Result<(), KeyError> {
        match self.inputs.contains_key(key) || self.values.has(key) {
            true => Err(key_error(key, format!("`{key}` has no effect: {why}"), help)),
            false => Ok(()),
        }
    }

    /// Refuses two constants that are not in the order that they should be in.
    pub fn in_order(
        &self,
        keys: [&'static str; 2],
        [low, high]: [Traced<'g>; 2],
        dimension: Dimension,
    ) -> Result<(), KeyError> {
        match [self.constant(low), self.constant(high)] {
            [Some(a), Some(b)] if a > b => {
                let [lower, upper] = keys;
                if !self.inputs.contains_key(lower) {
                    let message = format!("`{upper}` is below zero, and `{lower}`, which is left out, is its opposite");
                    return Err(key_error(upper, message, format!("write both, `{lower}` below `{upper}`")));
                }
                let message = format!("`{lower}` is above `{upper}`: {a} and {b} in SI units");
                Err(key_error(lower, message, "swap them, or check the signs"))
            }
            [Some(_), Some(_)] => Ok(()),
            _ => {
                let what = match self.inputs.contains_key(keys[0]) {
                    true => format!("`{}` is above `{}`", keys[0], keys[1]),
                    false => format!("`{}` is below zero, and `{}` its opposite", keys[1], keys[0]),
                };
                self.rules.borrow_mut().push(Rule { what, value: high - low, above: false, dimension });
                Ok(())
            }
        }
    }

    /// A signal within bounds.
    pub fn clamped(&self, x: Traced<'g>, [low, high]: [Option<Traced<'g>>; 2]) -> Traced<'g> {
        let mut answer = [Self::zero()];
        let _ = kardan_rt::Saturation { low, high }.step(x, &mut answer);
        answer[0]
    }

    /// A rate, zero where it would lead a number that is beyond a bound further away.
    pub fn away_from(&self, x: Traced<'g>, [low, high]: [Option<Traced<'g>>; 2], rate: Traced<'g>) -> Traced<'g> {
        let zero = Self::zero();
        let rising = |rate: Traced<'g>| zero.select(rate, rate, zero);
        let falling = |rate: Traced<'g>| rate.select(zero, rate, zero);
        let rate = low.map_or(rate, |low| low.select(x, rate, rising(rate)));
        high.map_or(rate, |high| x.select(high, rate, falling(rate)))
    }
}
