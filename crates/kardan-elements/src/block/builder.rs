//! The description of a kind of block, and the builder that it fills.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

use kardan_rt::Arithmetic;

use crate::element::KeyError;
use kardan_expr::expr::{Function, Graph, Lookup, Symbol, Traced};
use kardan_math::num::Rational;
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::program::KeyRule;
use kardan_schema::schema::{Field, Values};

/// The description of a kind of block.
#[derive(Debug, Clone, Copy)]
pub struct BlockKind {
    /// The word after `kind =`, and the name of the file here.
    pub keyword: &'static str,
    /// Summary in one sentence.
    pub summary: &'static str,
    /// Its formula.
    pub formula: &'static str,
    /// Its keys besides `kind`, `sample_time` and `unit`.
    pub fields: &'static [Field],
    /// An example, valid TOML.
    pub example: &'static str,
    /// Whether it reads blocks of another sample time without conversion.
    pub crosses: bool,
    /// Its outputs and states.
    pub write: fn(&mut BlockBuilder<'_>) -> Result<(), KeyError>,
}

/// A state of a block.
#[derive(Debug, Clone, Copy)]
pub struct BlockState<'g> {
    /// Its symbol.
    pub symbol: Traced<'g>,
    /// Its initial value, an expression of parameters only.
    pub start: Traced<'g>,
    /// With a sample time its value at the next sample, else its rate, 1/s.
    pub next: Traced<'g>,
}

/// An output of a block.
#[derive(Debug, Clone)]
pub struct BlockOutput<'g> {
    /// The part of its name after that of the block and a point; empty: the name of the block.
    pub name: String,
    /// The output.
    pub value: Traced<'g>,
    /// Its dimension.
    pub dimension: Dimension,
}

/// A transition of a machine: numbers of states, and its guard.
#[derive(Debug, Clone, Copy)]
pub struct Guard<'g> {
    /// The states.
    pub transition: kardan_rt::Transition,
    /// The guard, above 0.5 if the transition is enabled.
    pub when: Traced<'g>,
}

/// A named list of quantities.
#[derive(Debug, Clone)]
pub struct List {
    /// The key that contains it.
    pub key: &'static str,
    /// Its name there.
    pub name: String,
    /// The quantities.
    pub values: Vec<(Exact, Dimension)>,
}

/// Expressions by name.
pub type Expressions<'g> = Vec<(String, Traced<'g>, Dimension)>;

/// The builder of a block: its keys as expressions, its outputs and its states.
pub struct BlockBuilder<'g> {
    /// The graph.
    pub graph: &'g RefCell<Graph>,
    /// Keys that are expressions.
    pub inputs: BTreeMap<&'static str, (Traced<'g>, Dimension)>,
    /// Keys that are expressions by name.
    pub named: BTreeMap<&'static str, Expressions<'g>>,
    /// Its declared states in their order: the symbol of each in its keys, and in its outputs.
    pub own: Vec<[Traced<'g>; 2]>,
    /// All other keys.
    pub values: &'g Values,
    /// Lists by name.
    pub lists: Vec<List>,
    /// Transitions.
    pub guards: Vec<Guard<'g>>,
    /// The table of the key `table`.
    pub table: Option<Arc<Lookup>>,
    /// Its sample time, s; `None`: continuous time.
    pub sample_time: Option<Exact>,
    /// Its states.
    pub states: Vec<BlockState<'g>>,
    /// Its outputs.
    pub outputs: Vec<BlockOutput<'g>>,
    /// Sign conditions on keys that vary, without the name of the block.
    pub rules: RefCell<Vec<KeyRule>>,
}

impl<'g> BlockBuilder<'g> {
    /// The expression of a required key.
    pub fn input(&self, key: &'static str) -> Result<(Traced<'g>, Dimension), KeyError> {
        let missing =
            || KeyError::new(key, format!("`{key}` is missing"), "write an expression, or the name of a signal");
        self.inputs.get(key).copied().ok_or_else(missing)
    }

    /// The expression of a key, of a dimension; `None` if it is omitted.
    pub fn of(&self, key: &'static str, expected: Dimension) -> Result<Option<Traced<'g>>, KeyError> {
        let Some((value, found)) = self.inputs.get(key).copied() else { return Ok(None) };
        if expected.is_like(&found) {
            return Ok(Some(value));
        }
        let message = format!("`{key}`: expected {}, found {}", expected.noun(), found.noun());
        Err(KeyError::new(key, message, format!("write it in a unit such as {}", expected.example())))
    }

    /// The same of a required key.
    pub fn needed(&self, key: &'static str, expected: Dimension) -> Result<Traced<'g>, KeyError> {
        self.input(key)?;
        Ok(self.of(key, expected)?.unwrap_or(Self::zero()))
    }

    /// The expressions of a key, in the order of the file; empty if it is omitted.
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
                Err(KeyError::new("kind", format!("it needs a `sample_time`: {why}"), "write `sample_time = \"1 ms\"`"))
            }
        }
    }

    /// e^x
    pub fn exp(&self, x: Traced<'g>) -> Traced<'g> {
        let x = x.expr(self.graph);
        let expr = self.graph.borrow_mut().apply(Function::Exp, x);
        Traced::new(self.graph, expr)
    }

    /// The value of a constant, SI; `None` if the expression varies.
    pub fn constant(&self, value: Traced<'g>) -> Option<f64> {
        let expr = value.expr(self.graph);
        let graph = self.graph.borrow();
        let is_constant = graph.symbols(&[expr]).is_empty();
        is_constant.then(|| {
            kardan_expr::expr::lower(&graph, &[expr], &mut kardan_expr::expr::Floating::<f64>::default(), |_| f64::NAN)
                [0]
        })
    }

    /// A new state with its initial value; its next value must be set.
    pub fn new_state(&mut self, start: Traced<'g>) -> Traced<'g> {
        let expr = self.graph.borrow_mut().new_symbol(format!("memory.{}", self.states.len()), Dimension::NONE);
        let symbol = Traced::new(self.graph, expr);
        self.states.push(BlockState { symbol, start, next: symbol });
        symbol
    }

    /// The next values of the states that were made last.
    pub fn next(&mut self, values: &[Traced<'g>]) {
        let first = self.states.len() - values.len();
        self.states[first..].iter_mut().zip(values).for_each(|(state, next)| state.next = *next);
    }

    /// Its outputs.
    pub fn output(&mut self, value: Traced<'g>, dimension: Dimension) {
        self.output_as("", value, dimension);
    }

    /// An additional output.
    pub fn output_as(&mut self, name: &str, value: Traced<'g>, dimension: Dimension) {
        self.outputs.push(BlockOutput { name: name.into(), value, dimension });
    }

    /// The block of `kardan-rt`: its memory, with its start values, is the output and the states behind it.
    pub fn step<M: AsMut<[Traced<'g>]>>(&mut self, step: impl FnOnce(&mut M) -> bool, mut memory: M) -> Traced<'g> {
        // The output is a state only if a number is lost (NaN); no finite value depends on it.
        for place in memory.as_mut().iter_mut().skip(1) {
            *place = self.new_state(*place);
        }
        step(&mut memory);
        self.next(&memory.as_mut()[1..]);
        memory.as_mut()[0]
    }

    /// The same of a block that continues from its own output, with the initial values of all states.
    pub fn go_on<const N: usize>(
        &mut self,
        step: impl FnOnce(&mut [Traced<'g>; N]) -> bool,
        starts: [Traced<'g>; N],
    ) -> [Traced<'g>; N] {
        let mut state = starts.map(|start| self.new_state(start));
        step(&mut state);
        self.next(&state);
        state
    }

    /// The quotient of two dimensions.
    pub fn over(&self, key: &'static str, a: Dimension, b: Dimension, power: i32) -> Result<Dimension, KeyError> {
        a.times(&b, power).ok_or_else(|| {
            KeyError::new(key, format!("`{key}`: the exponents in its unit are too large"), "check the units")
        })
    }

    /// A time as a whole number of samples, with a lower bound.
    pub fn samples(&self, key: &'static str, time: &Exact, period: &Exact) -> Result<usize, KeyError> {
        let ratio = time.to_rational() / period.to_rational();
        let whole: Option<usize> =
            ratio.denominator().is_one().then(|| ratio.numerator().clone().try_into().ok()).flatten();
        match whole {
            Some(count) if count <= MOST_SAMPLES => Ok(count),
            Some(count) => Err(KeyError::new(
                key,
                format!("`{key}` has {count} samples, more than {MOST_SAMPLES}"),
                "make it shorter, or the sample time longer",
            )),
            None => {
                let nearest = kardan_math::num::rational_to_f64(&ratio).round() * period.to_f64();
                Err(KeyError::new(
                    key,
                    format!("`{key}` is not a multiple of the sample time"),
                    format!("the nearest one is {nearest} s"),
                ))
            }
        }
    }
}

/// Largest number of samples in the state of a block.
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

    /// The bounds `low` and `high`, if there are any: an omitted `low` is -`high`.
    pub fn bounds(&self, dimension: Dimension) -> Result<[Option<Traced<'g>>; 2], KeyError> {
        let high = self.of("high", dimension)?;
        let low = self.of("low", dimension)?.or(high.map(|high| -high));
        if let [Some(low), Some(high)] = [low, high] {
            self.in_order(["low", "high"], [low, high], dimension)?;
        }
        Ok([low, high])
    }

    /// The expression of a key that must not be negative, checked if it is constant.
    pub fn not_negative(
        &self,
        key: &'static str,
        expected: Dimension,
        why: &str,
    ) -> Result<Option<Traced<'g>>, KeyError> {
        self.signed(key, expected, why, false)
    }

    /// The expression of a key that must be above zero, checked if it is constant.
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
                Err(KeyError::new(key, message, help))
            }
            Some(_) => Ok(value),
            None => {
                let what = format!("`{key}` is {}", if above { "zero or less" } else { "below zero" });
                if let Some(value) = value {
                    self.rule(what, value, above, expected);
                }
                Ok(value)
            }
        }
    }

    /// Has a run check a condition: an expression must not be negative, or must be above zero.
    fn rule(&self, what: String, value: Traced<'g>, above: bool, dimension: Dimension) {
        let value = value.expr(self.graph);
        self.rules.borrow_mut().push(KeyRule { block: String::new(), what, value, above, dimension });
    }

    /// Rejects a key without effect.
    pub fn idle(&self, key: &'static str, why: &str, help: &str) -> Result<(), KeyError> {
        match self.inputs.contains_key(key) || self.values.has(key) {
            true => Err(KeyError::new(key, format!("`{key}` has no effect: {why}"), help)),
            false => Ok(()),
        }
    }

    /// Rejects two constants in the wrong order.
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
                    return Err(KeyError::new(upper, message, format!("write both, `{lower}` below `{upper}`")));
                }
                let message = format!("`{lower}` is above `{upper}`: {a} and {b} in SI units");
                Err(KeyError::new(lower, message, "swap them, or check the signs"))
            }
            [Some(_), Some(_)] => Ok(()),
            _ => {
                let what = match self.inputs.contains_key(keys[0]) {
                    true => format!("`{}` is above `{}`", keys[0], keys[1]),
                    false => format!("`{}` is below zero, and `{}` its opposite", keys[1], keys[0]),
                };
                self.rule(what, high - low, false, dimension);
                Ok(())
            }
        }
    }

    /// A signal within bounds.
    pub fn clamped(&self, x: Traced<'g>, [low, high]: [Option<Traced<'g>>; 2]) -> Traced<'g> {
        let mut output = [Self::zero()];
        let _ = kardan_rt::Saturation { low, high }.step(x, &mut output);
        output[0]
    }

    /// A rate, zero if it would move a number that is beyond a bound further out.
    pub fn away_from(&self, x: Traced<'g>, [low, high]: [Option<Traced<'g>>; 2], rate: Traced<'g>) -> Traced<'g> {
        let zero = Self::zero();
        let rising = |rate: Traced<'g>| zero.select(rate, rate, zero);
        let falling = |rate: Traced<'g>| rate.select(zero, rate, zero);
        let rate = low.map_or(rate, |low| low.select(x, rate, rising(rate)));
        high.map_or(rate, |high| x.select(high, rate, falling(rate)))
    }
}
