//! Expressions to first order on the sides of a place at which they bend or jump.

use std::collections::{BTreeMap, HashMap};

use super::{Expr, Floating, Graph, Interval, Intervals, Place, Side, Sided, Style, Symbol, lower, printed, sides};
use crate::num::{Rational, Scalar};

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

    /// One of the expressions alone.
    #[must_use]
    pub fn of(&self, expr: usize) -> Self {
        let (values, slopes) = (vec![self.values[expr].clone()], vec![self.slopes[expr].clone()]);
        Self { guards: self.guards.clone(), exactly: self.exactly, values, slopes }
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
    /// Each side, to first order, the highest guards first; `None`: there are too many.
    pub sides: Option<Vec<Linear>>,
}

/// Guards of one expression beyond which its sides are too many to be looked at one by one.
const MOST_GUARDS: usize = 8;
/// Guards that are named of more.
const NAMED: usize = 3;

/// Those of some expressions for which guards vanish at a place, on its sides: those with the same guards together, as guards of others do not matter
/// to them.
///
/// A guard is named with its first term not subtracted, so that all that are linear can be above zero at once, and below: what is chosen so for one
/// expression is the side of all.
pub fn kinked(graph: &mut Graph, exprs: &[Expr], place: &dyn Place) -> Vec<SidesOf> {
    let mut groups: BTreeMap<Vec<Expr>, Vec<usize>> = BTreeMap::new();
    for (number, guards) in graph.guards_at(exprs, place).into_iter().enumerate() {
        if !guards.is_empty() {
            groups.entry(guards).or_default().push(number);
        }
    }
    let mut of = |(guards, members): (Vec<Expr>, Vec<usize>)| {
        let own: Vec<Expr> = members.iter().map(|number| exprs[*number]).collect();
        let sides = if guards.len() <= MOST_GUARDS { linear_sides(graph, &own, place) } else { None };
        let name = |guard: &Expr| printed(graph, *guard, Style::Text, &|name| name.into());
        SidesOf { guards: guards.iter().take(NAMED).map(name).collect(), sides, exprs: members }
    };
    groups.into_iter().map(&mut of).collect()
}

/// Expressions on the sides of a place, to first order; `None`: these are too many.
pub fn linear_sides(graph: &mut Graph, exprs: &[Expr], place: &dyn Place) -> Option<Vec<Linear>> {
    let own = graph.sides(exprs, place)?;
    let guards: Vec<Expr> = own.iter().flat_map(|side| side.guards.iter().map(|(guard, _)| *guard)).collect();
    let exactly = sides::exactly(graph, &guards, place);
    let exactly = exactly.iter().all(|guard| guard.as_ref().is_some_and(Scalar::is_zero));
    let numbers = |graph: &Graph, exprs: &[Expr]| -> Vec<Number> {
        let exact = sides::exactly(graph, exprs, place);
        let around = lower(graph, exprs, &mut Intervals, |symbol| place.around(symbol));
        let value = lower(graph, exprs, &mut Floating::<f64>::default(), |symbol| place.value(symbol));
        let of = |((exact, around), value)| Number { exact, value, around };
        exact.into_iter().zip(around).zip(value).map(of).collect()
    };
    let mut names: HashMap<Expr, String> = HashMap::new();
    let linear = |side: Sided| {
        let of = |graph: &mut Graph, expr: Expr| {
            let used: Vec<(usize, Symbol)> =
                graph.symbols(&[expr]).into_iter().filter_map(|symbol| Some((place.place(symbol)?, symbol))).collect();
            let slopes: Vec<Expr> = used.iter().map(|(_, symbol)| graph.derivative(expr, *symbol)).collect();
            let mut slopes: Vec<(usize, Number)> =
                used.iter().map(|(place, _)| *place).zip(numbers(graph, &slopes)).collect();
            slopes.sort_by_key(|(place, _)| *place);
            slopes
        };
        Linear {
            guards: side.named(graph, &mut names),
            exactly,
            values: numbers(graph, &side.exprs),
            slopes: side.exprs.iter().map(|expr| of(graph, *expr)).collect(),
        }
    };
    Some(own.into_iter().map(linear).collect())
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
