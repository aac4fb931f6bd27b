//! Expressions to first order on the sides of a place at which they bend or jump.

use std::collections::BTreeMap;

use super::sides::GuardNames;
use super::{Direction, Expr, Floating, Graph, Interval, Intervals, Place, Side, Sided, Symbol, lower, sides};
use crate::num::{Rational, Scalar, rational_to_f64};

/// A number at a place.
#[derive(Debug, Clone)]
pub struct Number {
    /// Exact, where it is known.
    pub exact: Option<Rational>,
    /// Rounded.
    pub value: f64,
    around: Interval,
}

impl Number {
    /// Whether it is a number at all.
    pub fn is_number(&self) -> bool {
        self.exact.is_some() || self.value.is_finite()
    }

    /// By how much rounding may move it.
    pub fn rounding(&self) -> f64 {
        let width = if self.exact.is_none() { self.around.high - self.around.low } else { 0.0 };
        if width.is_finite() { width } else { 0.0 }
    }

    /// Whether two are the same, as far as rounding tells.
    fn is_same(&self, other: &Self, exactly: bool) -> bool {
        let finite = |one: &Self| one.around.low.is_finite() && one.around.high.is_finite();
        match (&self.exact, &other.exact) {
            (Some(one), Some(other)) if exactly || one == other => one == other,
            _ if finite(self) && finite(other) => {
                self.around.low <= other.around.high && other.around.low <= self.around.high
            }
            _ => self.value == other.value || self.value.is_nan() && other.value.is_nan(),
        }
    }
}

/// Expressions on one side of a place, to first order.
#[derive(Debug, Clone)]
pub struct Linear {
    /// The guards that vanish there, and whether they are above zero here.
    pub guards: Vec<(String, bool)>,
    /// Whether they vanish exactly.
    exactly: bool,
    /// Of each expression its value.
    pub values: Vec<Number>,
    /// Of each its derivatives, by the places of symbols.
    pub slopes: Vec<Vec<(usize, Number)>>,
}

impl Linear {
    /// Whether it is, of these, part of a side.
    pub fn is_on(&self, side: &Side) -> bool {
        self.guards.iter().all(|(guard, above)| *above != side.below.contains(guard))
    }

    /// The side that it is.
    pub fn side(&self) -> Side {
        let below = self.guards.iter().filter(|(_, above)| !above);
        Side { below: below.map(|(guard, _)| guard.clone()).collect() }
    }

    /// Some of the expressions alone.
    #[must_use]
    pub fn of(&self, exprs: &[usize]) -> Self {
        Self {
            guards: self.guards.clone(),
            exactly: self.exactly,
            values: exprs.iter().map(|expr| self.values[*expr].clone()).collect(),
            slopes: exprs.iter().map(|expr| self.slopes[*expr].clone()).collect(),
        }
    }

    /// Whether all expressions have the values of another side.
    pub fn same_values(&self, other: &Self) -> bool {
        self.values.iter().zip(&other.values).all(|(one, other)| one.is_same(other, self.exactly))
    }

    /// Whether all expressions have the derivatives of another side.
    pub fn same_slopes(&self, other: &Self) -> bool {
        let zero = || Number { exact: Some(Rational::ZERO), value: 0.0, around: Interval::point(0.0) };
        let of = |slopes: &[(usize, Number)], place: usize| {
            slopes.iter().find(|(own, _)| *own == place).map_or_else(zero, |(_, slope)| slope.clone())
        };
        self.slopes.iter().zip(&other.slopes).all(|(one, other)| {
            let mut places = one.iter().chain(other).map(|(place, _)| *place);
            places.all(|place| of(one, place).is_same(&of(other, place), self.exactly))
        })
    }
}

/// Expressions that have the same guards at a place, on its sides.
#[derive(Debug, Clone)]
pub struct SidesOf {
    /// Which of the expressions these are.
    pub exprs: Vec<usize>,
    /// Some of their guards that vanish there, by name.
    pub guards: Vec<String>,
    /// The sides, to first order: all, the highest guards first, or the one that a direction leads to.
    pub sides: Vec<Linear>,
    /// Whether these are all.
    pub all: bool,
}

/// Guards of one expression beyond which its sides are too many to be looked at one by one.
const MOST_GUARDS: usize = 8;
/// Guards that are named of more.
const NAMED: usize = 3;

/// Those of some expressions for which guards vanish at a place, on its sides: those with the same guards together, as guards of others do not matter
/// to them. Where there are too many, on the side that the direction leads to.
///
/// A guard is named with its first term not subtracted, so that all that are linear can be above zero at once, and below: what is chosen so for one
/// expression is the side of all.
pub fn kinked(graph: &mut Graph, exprs: &[Expr], place: &dyn Place, direction: Direction<'_>) -> Vec<SidesOf> {
    let mut groups: BTreeMap<Vec<Expr>, Vec<usize>> = BTreeMap::new();
    for (number, guards) in graph.guards_at(exprs, place).into_iter().enumerate() {
        if !guards.is_empty() {
            groups.entry(guards).or_default().push(number);
        }
    }
    let of = |members: &[usize]| -> Vec<Expr> { members.iter().map(|number| exprs[*number]).collect() };
    let (mut out, mut rest, mut names) = (Vec::new(), Vec::new(), GuardNames::new());
    for (mut guards, members) in groups {
        let is_few = guards.len() <= MOST_GUARDS;
        let all = if is_few { graph.sides(&of(&members), place) } else { None };
        // The simplest are named.
        guards.sort_by_key(|guard| graph.needed(&[*guard]).len());
        let guards = guards.iter().take(NAMED).map(|guard| names.of(graph, *guard)).collect();
        match all {
            Some(sides) => {
                let sides = linear(graph, sides, place, &mut names);
                out.push(SidesOf { guards, sides, all: true, exprs: members });
            }
            None => rest.push((guards, members)),
        }
    }
    // All of these at once, as they share most of their parts.
    let members: Vec<usize> = rest.iter().flat_map(|(_, members)| members.clone()).collect();
    if !members.is_empty() {
        let exprs = graph.side_along(&of(&members), place, direction).exprs;
        let side = Sided { guards: Vec::new(), exprs };
        let side = linear(graph, vec![side], place, &mut names).swap_remove(0);
        for (guards, exprs) in rest {
            let place = |number: &usize| members.iter().position(|own| own == number).expect("one of all");
            let own = side.of(&exprs.iter().map(place).collect::<Vec<_>>());
            out.push(SidesOf { guards, sides: vec![own], all: false, exprs });
        }
    }
    out
}

/// Expressions on the sides of a place, to first order; `None`: these are too many.
pub fn linear_sides(graph: &mut Graph, exprs: &[Expr], place: &dyn Place) -> Option<Vec<Linear>> {
    let sides = graph.sides(exprs, place)?;
    Some(linear(graph, sides, place, &mut GuardNames::new()))
}

/// What expressions are on some sides, to first order.
fn linear(graph: &mut Graph, own: Vec<Sided>, place: &dyn Place, names: &mut GuardNames) -> Vec<Linear> {
    let guards: Vec<Expr> = own.iter().flat_map(|side| side.guards.iter().map(|(guard, _)| *guard)).collect();
    let exactly = sides::exactly(graph, &guards, place);
    let exactly = exactly.iter().all(|guard| guard.as_ref().is_some_and(Scalar::is_zero));
    let numbers = |graph: &Graph, exprs: &[Expr]| -> Vec<Number> {
        let exact = sides::exactly(graph, exprs, place);
        // Nothing is compared within rounding then.
        if exactly && exact.iter().all(Option::is_some) {
            let number = |exact: Rational| {
                let value = rational_to_f64(&exact);
                Number { exact: Some(exact), value, around: Interval::point(value) }
            };
            return exact.into_iter().flatten().map(number).collect();
        }
        let around = lower(graph, exprs, &mut Intervals, |symbol| place.around(symbol));
        let value = lower(graph, exprs, &mut Floating::<f64>::default(), |symbol| place.value(symbol));
        let of = |((exact, around), value)| Number { exact, value, around };
        exact.into_iter().zip(around).zip(value).map(of).collect()
    };
    let linear = |side: Sided| {
        let slopes = slopes(graph, &side.exprs, place);
        // All in one pass, as they share most of their parts.
        let all: Vec<Expr> = slopes.iter().flatten().map(|(_, slope)| *slope).collect();
        let mut found = numbers(graph, &all).into_iter();
        let own = |own: Vec<(usize, Expr)>| own.into_iter().map(|(place, _)| place).zip(&mut found).collect();
        Linear {
            guards: side.named(graph, names),
            exactly,
            values: numbers(graph, &side.exprs),
            slopes: slopes.into_iter().map(own).collect(),
        }
    };
    own.into_iter().map(linear).collect()
}

/// Of each expression its derivatives, by the places of symbols.
fn slopes(graph: &mut Graph, exprs: &[Expr], place: &dyn Place) -> Vec<Vec<(usize, Expr)>> {
    let mut with: BTreeMap<usize, (Symbol, Vec<usize>)> = BTreeMap::new();
    for (number, expr) in exprs.iter().enumerate() {
        for symbol in graph.symbols(&[*expr]) {
            if let Some(place) = place.place(symbol) {
                with.entry(place).or_insert_with(|| (symbol, Vec::new())).1.push(number);
            }
        }
    }
    let mut out = vec![Vec::new(); exprs.len()];
    for (place, (symbol, members)) in with {
        let own: Vec<Expr> = members.iter().map(|number| exprs[*number]).collect();
        let slopes = graph.derivatives(&own, symbol);
        members.into_iter().zip(slopes).for_each(|(number, slope)| out[number].push((place, slope)));
    }
    out
}

/// The guards whose sides differ, each by itself; where none does by itself, all.
pub fn bending(sides: &[Linear], same: &dyn Fn(&Linear, &Linear) -> bool) -> Vec<String> {
    if sides.iter().all(|side| same(side, &sides[0])) {
        return Vec::new();
    }
    let apart = |one: &Linear, other: &Linear| -> Vec<String> {
        let differs = |(guard, above): &&(String, bool)| {
            other.guards.iter().find(|(own, _)| own == guard).is_none_or(|(_, own)| own != above)
        };
        one.guards.iter().filter(differs).map(|(guard, _)| guard.clone()).collect()
    };
    let (mut alone, mut all) = (Vec::new(), Vec::new());
    for one in sides {
        for (guard, _) in &one.guards {
            if !all.contains(guard) {
                all.push(guard.clone());
            }
        }
        for other in sides.iter().filter(|other| !same(one, other)) {
            let guards = apart(one, other);
            if guards.len() == 1 && !alone.contains(&guards[0]) {
                alone.extend(guards);
            }
        }
    }
    let mut named = if alone.is_empty() { all } else { alone };
    named.sort();
    named
}
