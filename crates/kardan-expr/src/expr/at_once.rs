//! Whether conditions can be true simultaneously, decided exactly where they compare sums of symbols times constants.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use kardan_rt::Operator;

use super::piecewise_polynomial::PiecewisePolynomial;
use super::{Domain, Expr, Floating, Graph, Symbol, lower};
use kardan_math::num::{Rational, SparseRow, rational_to_f64};

/// Whether numbers can be above a half at once.
#[derive(Debug, Clone, PartialEq)]
pub enum AtOnce {
    /// No values of the symbols make them so: proven.
    Never,
    /// These values do.
    At(Vec<(Symbol, Rational)>),
    /// Not decided.
    Unknown,
}

/// Symbols whose sum is not above a bound.
pub type JointBound = (Vec<Symbol>, Rational);

/// Whether expressions can be above a half at once, where some symbols are not negative and some sums of these are bounded.
///
/// Comparisons of sums of symbols times constants, also within `min`, `max`, `abs` and `if`, are decided exactly, over the rationals, each part
/// that is none as if it could be anything: so "never" is proven, and "at" was tried.
///
/// ```
/// use kardan_expr::expr::{AtOnce, Graph, Named, at_once};
/// use kardan_math::units::{Dimension, Expression};
/// let mut graph = Graph::default();
/// let mut written = |text: &str| {
///     let mut names = |graph: &mut Graph, name: &str| Some(Named::Varying(graph.symbol(name, Dimension::NONE), Dimension::NONE));
///     graph.lowered(&Expression::parse_law(text).unwrap(), &mut names).unwrap().0
/// };
/// let [a, b, c] = ["x + y > 3", "2*x + 2*y < 6 and z > 0", "abs(x) < 1"].map(&mut written);
/// assert_eq!(at_once(&graph, &[a, b], &[], &[]), AtOnce::Never);
/// assert!(matches!(at_once(&graph, &[a, c], &[], &[]), AtOnce::At(_)));
/// ```
pub fn at_once(graph: &Graph, exprs: &[Expr], not_negative: &[Symbol], joint: &[JointBound]) -> AtOnce {
    let symbols = graph.symbols(exprs);
    let mut cases = Cases { variables: symbols.len() };
    let number = |symbol: &Symbol| symbols.iter().position(|candidate| candidate == symbol);
    let values = lower(graph, exprs, &mut cases, |symbol| Cases::variable(number(&symbol).unwrap_or_default()));
    let mut conditions: Vec<Above> = Vec::new();
    for symbol in not_negative.iter().filter_map(number) {
        conditions.push(Above { sum: Affine::variable(symbol), strict: false });
    }
    for (all, bound) in joint {
        let terms = all.iter().filter_map(number).map(|symbol| (symbol, Rational::from(-1))).collect();
        conditions.push(Above { sum: Affine { constant: bound.clone(), terms }, strict: false });
    }
    let half = Affine::constant(Rational::ONE / Rational::from(2));
    let mut all = vec![Case { conditions, value: Affine::default() }];
    for value in &values {
        let above_half =
            |_: &Affine, own: &Affine| Some((Some(Above::of(&own.minus(&half), true)?), Affine::default()));
        let Some(next) = product(&all, value, above_half) else { return AtOnce::Unknown };
        all = next;
    }
    let mut found = AtOnce::Never;
    for case in &all {
        match point(&case.conditions, MOST) {
            Point::None => {}
            Point::TooMany => found = AtOnce::Unknown,
            Point::At(at) => {
                let of = |k: usize| at.get(&k).cloned().unwrap_or(Rational::ZERO);
                let place: Vec<(Symbol, Rational)> =
                    symbols.iter().enumerate().map(|(k, symbol)| (*symbol, of(k))).collect();
                let of_symbol = |symbol| number(&symbol).map_or(0.0, |k| rational_to_f64(&of(k)));
                let tried = lower(graph, exprs, &mut Floating::<f64>::default(), of_symbol);
                if tried.iter().all(|value| *value > 0.5) {
                    return AtOnce::At(place);
                }
                found = AtOnce::Unknown;
            }
        }
    }
    found
}

/// A sum of variables times constants, and a constant.
#[derive(Debug, Clone, PartialEq, Default)]
struct Affine {
    constant: Rational,
    terms: BTreeMap<usize, Rational>,
}

impl Affine {
    fn constant(constant: Rational) -> Self {
        Self { constant, terms: BTreeMap::new() }
    }

    fn variable(number: usize) -> Self {
        Self { constant: Rational::ZERO, terms: BTreeMap::from([(number, Rational::ONE)]) }
    }

    fn times(&self, factor: &Rational) -> Self {
        let mut out = self.clone();
        out.constant = &out.constant * factor;
        out.terms.values_mut().for_each(|value| *value = &*value * factor);
        out.terms.retain(|_, value| !value.is_zero());
        out
    }

    fn plus(&self, other: &Self) -> Self {
        let mut out = self.clone();
        out.constant += &other.constant;
        for (variable, factor) in &other.terms {
            *out.terms.entry(*variable).or_insert(Rational::ZERO) += factor;
        }
        out.terms.retain(|_, value| !value.is_zero());
        out
    }

    fn minus(&self, other: &Self) -> Self {
        self.plus(&other.times(&Rational::from(-1)))
    }
}

/// A sum is above zero, or not below it.
#[derive(Debug, Clone, PartialEq)]
struct Above {
    sum: Affine,
    strict: bool,
}

impl Above {
    /// None if it cannot be.
    fn of(sum: &Affine, strict: bool) -> Option<Self> {
        let possible = !sum.terms.is_empty()
            || if strict { sum.constant > Rational::ZERO } else { sum.constant >= Rational::ZERO };
        possible.then(|| Self { sum: sum.clone(), strict })
    }
}

/// The value of a number where some sums are above zero.
#[derive(Debug, Clone, PartialEq)]
struct Case {
    conditions: Vec<Above>,
    value: Affine,
}

/// Numbers as cases of sums; variables after those of the symbols represent what is no such sum.
struct Cases {
    variables: usize,
}

/// The most cases of a number, and the most sums that are compared at once.
const MOST: usize = 256;

/// The cases of two numbers together, each with a further condition and its value; none if there are too many.
fn product(
    a: &[Case],
    b: &[Case],
    both: impl Fn(&Affine, &Affine) -> Option<(Option<Above>, Affine)>,
) -> Option<Vec<Case>> {
    if a.len() * b.len() > MOST {
        return None;
    }
    let mut out = Vec::new();
    for (a, b) in a.iter().flat_map(|a| b.iter().map(move |b| (a, b))) {
        let Some((above, value)) = both(&a.value, &b.value) else { continue };
        let mut conditions: Vec<Above> = a.conditions.clone();
        let new = b.conditions.iter().cloned().chain(above).filter(|above| !above.sum.terms.is_empty());
        for above in new {
            if !conditions.contains(&above) {
                conditions.push(above);
            }
        }
        out.push(Case { conditions, value });
    }
    Some(out)
}

impl Cases {
    fn variable(number: usize) -> Rc<Vec<Case>> {
        Rc::new(vec![Case { conditions: Vec::new(), value: Affine::variable(number) }])
    }

    /// Something that may be anything.
    fn anything(&mut self) -> Rc<Vec<Case>> {
        self.variables += 1;
        Self::variable(self.variables - 1)
    }

    fn sum(&mut self, a: &[Case], b: &[Case], factor: i32) -> Rc<Vec<Case>> {
        let found = product(a, b, |a, b| Some((None, a.plus(&b.times(&Rational::from(factor))))));
        found.map_or_else(|| self.anything(), Rc::new)
    }

    /// Products and quotients by constants.
    fn scaled(&mut self, a: &[Case], b: &[Case], divides: bool) -> Rc<Vec<Case>> {
        let constant = |x: &Affine| x.terms.is_empty();
        let is_constant = |cases: &[Case]| cases.iter().all(|case| constant(&case.value));
        let zero = b.iter().any(|case| constant(&case.value) && case.value.constant.is_zero());
        if !(is_constant(b) && !(divides && zero) || is_constant(a) && !divides) {
            return self.anything();
        }
        let found = product(a, b, |a, b| {
            let value = match (constant(b), divides) {
                (true, true) => a.times(&(Rational::ONE / &b.constant)),
                (true, false) => a.times(&b.constant),
                _ => b.times(&a.constant),
            };
            Some((None, value))
        });
        found.map_or_else(|| self.anything(), Rc::new)
    }

    /// `c` where a < b, else `d`.
    fn select(&mut self, [a, b, c, d]: [&[Case]; 4]) -> Rc<Vec<Case>> {
        let below = product(a, b, |a, b| Some((Some(Above::of(&b.minus(a), true)?), Affine::default())));
        let rest = product(a, b, |a, b| Some((Some(Above::of(&a.minus(b), false)?), Affine::default())));
        let value = |conditions: Option<Vec<Case>>, value: &[Case]| {
            product(&conditions?, value, |_, value| Some((None, value.clone())))
        };
        match (value(below, c), value(rest, d)) {
            (Some(then), Some(otherwise)) if then.len() + otherwise.len() <= MOST => {
                Rc::new(then.into_iter().chain(otherwise).collect())
            }
            _ => self.anything(),
        }
    }
}

impl Domain for Cases {
    type Value = Rc<Vec<Case>>;

    fn constant(&mut self, value: &Rational) -> Self::Value {
        Rc::new(vec![Case { conditions: Vec::new(), value: Affine::constant(value.clone()) }])
    }

    fn operation(&mut self, operator: Operator, x: &[Self::Value]) -> Self::Value {
        match operator {
            Operator::Add => self.sum(&x[0], &x[1], 1),
            Operator::Subtract => self.sum(&x[0], &x[1], -1),
            Operator::Multiply => self.scaled(&x[0], &x[1], false),
            Operator::Divide => self.scaled(&x[0], &x[1], true),
            Operator::Negate => {
                let zero = self.constant(&Rational::ZERO);
                self.sum(&zero, &x[0], -1)
            }
            Operator::Absolute => {
                let zero = self.constant(&Rational::ZERO);
                let opposite = self.sum(&zero, &x[0], -1);
                self.select([&x[0], &zero, &opposite, &x[0]])
            }
            Operator::Minimum => self.select([&x[0], &x[1], &x[0], &x[1]]),
            Operator::Maximum => self.select([&x[0], &x[1], &x[1], &x[0]]),
            Operator::Select => self.select([&x[0], &x[1], &x[2], &x[3]]),
            _ => self.anything(),
        }
    }

    fn sine_cosine(&mut self, _: &Self::Value) -> [Self::Value; 2] {
        [self.anything(), self.anything()]
    }

    fn table(&mut self, _: &PiecewisePolynomial, _: &Self::Value) -> Self::Value {
        self.anything()
    }
}

/// A point at which sums are above zero.
enum Point {
    None,
    At(BTreeMap<usize, Rational>),
    TooMany,
}

/// Whether there is a direction in which all rows are above zero, exactly.
pub(super) fn is_open(rows: Vec<SparseRow>) -> bool {
    let above = |row: SparseRow| Above {
        sum: Affine { constant: Rational::ZERO, terms: row.into_iter().collect() },
        strict: true,
    };
    let conditions: Vec<Above> = rows.into_iter().map(above).collect();
    !matches!(point(&conditions, usize::MAX), Point::None)
}

/// By elimination of one variable after the other (Fourier and Motzkin), as long as there are no more than `most` sums.
fn point(conditions: &[Above], most: usize) -> Point {
    let mut remaining: Vec<Above> = conditions.to_vec();
    let variables: BTreeSet<usize> = conditions.iter().flat_map(|above| above.sum.terms.keys().copied()).collect();
    let mut steps: Vec<(usize, Vec<Above>)> = Vec::new();
    for variable in variables {
        let (with, mut rest): (Vec<Above>, Vec<Above>) =
            remaining.into_iter().partition(|above| above.sum.terms.contains_key(&variable));
        let (lower, upper): (Vec<&Above>, Vec<&Above>) =
            with.iter().partition(|above| above.sum.terms[&variable] > Rational::ZERO);
        for (a, b) in lower.iter().flat_map(|a| upper.iter().map(move |b| (a, b))) {
            let [x, y] = [&a.sum.terms[&variable], &-&b.sum.terms[&variable]];
            let mut sum = a.sum.times(y).plus(&b.sum.times(x));
            sum.terms.remove(&variable);
            match Above::of(&sum, a.strict || b.strict) {
                None => return Point::None,
                Some(above) if above.sum.terms.is_empty() || rest.contains(&above) => {}
                Some(above) => rest.push(above),
            }
        }
        if rest.len() > most {
            return Point::TooMany;
        }
        steps.push((variable, with));
        remaining = rest;
    }
    if remaining.iter().any(|above| Above::of(&above.sum, above.strict).is_none()) {
        return Point::None;
    }
    let mut at: BTreeMap<usize, Rational> = BTreeMap::new();
    for (variable, with) in steps.into_iter().rev() {
        let [mut low, mut high]: [Option<(Rational, bool)>; 2] = [None, None];
        for above in &with {
            let factor = &above.sum.terms[&variable];
            let remaining_terms = above.sum.terms.iter().filter(|(other, _)| **other != variable);
            let rest =
                remaining_terms.fold(above.sum.constant.clone(), |sum, (other, factor)| sum + factor * &at[other]);
            let bound = -rest / factor;
            let side = if *factor > Rational::ZERO { &mut low } else { &mut high };
            let tighter = side.as_ref().is_none_or(|(so_far, strict)| {
                let further = if *factor > Rational::ZERO { bound > *so_far } else { bound < *so_far };
                further || bound == *so_far && above.strict && !strict
            });
            if tighter {
                *side = Some((bound, above.strict));
            }
        }
        at.insert(variable, between(&low, &high));
    }
    Point::At(at)
}

/// A number between two bounds that a person would choose.
fn between(low: &Option<(Rational, bool)>, high: &Option<(Rational, bool)>) -> Rational {
    let inside = |x: &Rational| {
        let above = low.as_ref().is_none_or(|(low, strict)| x > low || !strict && x == low);
        let below = high.as_ref().is_none_or(|(high, strict)| x < high || !strict && x == high);
        above && below
    };
    let two = Rational::from(2);
    let simple = [0, 1, -1].map(Rational::from).into_iter().find(inside);
    simple.unwrap_or_else(|| match (low, high) {
        (Some((low, _)), Some((high, _))) => (low + high) / two,
        (Some((low, _)), None) => low.clone().max(Rational::ZERO) * two,
        (None, Some((high, _))) => high * two,
        (None, None) => Rational::ZERO,
    })
}
