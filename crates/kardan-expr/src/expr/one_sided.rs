//! Expressions to first order on the sides of a kink or a jump.

use std::collections::BTreeMap;

use super::sides::GuardNames;
use super::{Direction, Expr, Floating, Graph, Interval, Intervals, Place, Side, Sided, Surds, forward, lower, sides};
use kardan_math::num::{Rational, Scalar, rational_to_f64};

/// A number at a place.
#[derive(Debug, Clone)]
pub struct Number {
    /// Exact, where it is known.
    pub exact: Option<Rational>,
    /// Rounded.
    pub value: f64,
    enclosure: Interval,
}

impl Number {
    /// Whether it is a number at all.
    pub fn is_number(&self) -> bool {
        self.exact.is_some() || self.value.is_finite()
    }

    /// By how much rounding may move it.
    pub fn rounding(&self) -> f64 {
        let width = if self.exact.is_none() { self.enclosure.high - self.enclosure.low } else { 0.0 };
        if width.is_finite() { width } else { 0.0 }
    }

    /// Whether two are the same, to rounding.
    fn is_same(&self, other: &Self, exactly: bool) -> bool {
        let finite = |one: &Self| one.enclosure.low.is_finite() && one.enclosure.high.is_finite();
        match (&self.exact, &other.exact) {
            (Some(one), Some(other)) if exactly || one == other => one == other,
            _ if finite(self) && finite(other) => {
                self.enclosure.low <= other.enclosure.high && other.enclosure.low <= self.enclosure.high
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
        let zero = || Number { exact: Some(Rational::ZERO), value: 0.0, enclosure: Interval::point(0.0) };
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

/// Most guards of one expression whose sides are enumerated one by one.
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
        let is_small = guards.len() <= MOST_GUARDS;
        let all = if is_small { graph.sides(&of(&members), place) } else { None };
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
        let exprs = graph.one_sided_slope(&of(&members), place, direction).exprs;
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

/// The expressions on some sides, to first order.
fn linear(graph: &mut Graph, own: Vec<Sided>, place: &dyn Place, names: &mut GuardNames) -> Vec<Linear> {
    let guards: Vec<Expr> = own.iter().flat_map(|side| side.guards.iter().map(|(guard, _)| *guard)).collect();
    let exactly = sides::exactly(graph, &guards, place);
    let exactly = exactly.iter().all(|guard| guard.as_ref().is_some_and(Scalar::is_zero));
    let linear = |side: Sided| {
        let (values, slopes) = to_first_order(graph, &side.exprs, place, exactly);
        Linear { guards: side.named(graph, names), exactly, values, slopes }
    };
    own.into_iter().map(linear).collect()
}

/// Expressions at a place: values, and slopes by the places of symbols. Where `exactly` is set and all is exact, no comparison allows for rounding, and
/// rounding is not estimated.
fn to_first_order(
    graph: &mut Graph,
    exprs: &[Expr],
    place: &dyn Place,
    exactly: bool,
) -> (Vec<Number>, Vec<Vec<(usize, Number)>>) {
    let exact = forward(graph, exprs, Surds, |symbol| (place.exact(symbol), place.place(symbol)));
    let exact: Vec<_> = exact.into_iter().map(|one| one.map(|x| x?.to_rational())).collect();
    if exactly && exact.iter().all(|one| one.all().all(Option::is_some)) {
        let number = |exact: Option<Rational>| {
            let value = exact.as_ref().map_or(f64::NAN, rational_to_f64);
            Number { exact, value, enclosure: Interval::point(value) }
        };
        return exact.into_iter().map(|one| one.map(number).split()).unzip();
    }
    let enclosure = forward(graph, exprs, Intervals, |symbol| (place.enclosure(symbol), place.place(symbol)));
    let rounded =
        forward(graph, exprs, Floating::<f64>::default(), |symbol| (place.value(symbol), place.place(symbol)));
    let mut found = Vec::new();
    for (((exact, enclosure), rounded), expr) in exact.into_iter().zip(enclosure).zip(rounded).zip(exprs) {
        let own = |((exact, enclosure), value)| Number { exact, value, enclosure };
        let (value, mut slopes) = exact.zip(enclosure).zip(rounded).map(own).split();
        // A slope may be finite as an expression where its evaluation overflows.
        for (own, slope) in slopes.iter_mut().filter(|(_, slope)| !slope.is_number()) {
            let symbol = graph.symbols(&[*expr]).into_iter().find(|symbol| place.place(*symbol) == Some(*own));
            let derivative = symbol.map(|symbol| graph.derivative(*expr, symbol));
            *slope = derivative.map_or(slope.clone(), |derivative| number(graph, derivative, place));
        }
        found.push((value, slopes));
    }
    found.into_iter().unzip()
}

/// An expression at a place.
fn number(graph: &Graph, expr: Expr, place: &dyn Place) -> Number {
    Number {
        exact: sides::exactly(graph, &[expr], place).swap_remove(0),
        value: lower(graph, &[expr], &mut Floating::<f64>::default(), |symbol| place.value(symbol))[0],
        enclosure: lower(graph, &[expr], &mut Intervals, |symbol| place.enclosure(symbol))[0],
    }
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
    let (mut single, mut all) = (Vec::new(), Vec::new());
    for one in sides {
        for (guard, _) in &one.guards {
            if !all.contains(guard) {
                all.push(guard.clone());
            }
        }
        for other in sides.iter().filter(|other| !same(one, other)) {
            let guards = apart(one, other);
            if guards.len() == 1 && !single.contains(&guards[0]) {
                single.extend(guards);
            }
        }
    }
    let mut named = if single.is_empty() { all } else { single };
    named.sort();
    named
}
