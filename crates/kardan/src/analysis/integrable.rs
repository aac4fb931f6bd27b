//! Frobenius' test, exact: whether rows of speeds are derivatives of relations between positions.
//!
//! Rows ω_k = Σ g_ki dq_i are integrable together if and only if dω_k vanishes on their common null space, for every k (Frobenius, J. reine
//! angew. Math. 82, 1877). It is tried at generic points, over the rationals: a coordinate, its sine and its cosine are three numbers there, of
//! which the two last are (1 − u²)/(1 + u²) and 2u/(1 + u²) with a rational u. As the functions q, sin q and cos q satisfy no other algebraic
//! relation, what does not vanish at one such point does not vanish identically.

use std::collections::{BTreeMap, BTreeSet};

use kardan_rt::Operator;

use crate::expr::{Domain, Expr, PiecewisePolynomial, Symbol, lower};
use crate::num::{Matrix, Rational, echelon};
use crate::reduce::{Motion, Reduced};

/// What the test found of a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Integrable {
    /// It does not vanish at a point: no relation of positions has it as its derivative. The point, in words.
    No(String),
    /// It vanishes at all points tried, exactly; so many.
    AtAllPoints(usize),
    /// Some function in it is not known at rational points.
    NotDecided,
}

/// Generic points that are tried.
const POINTS: i64 = 3;

/// The test for each kept row of a model, together with the others.
pub(super) fn integrable(reduced: &Reduced) -> Vec<Integrable> {
    let (first, r) = (reduced.equations.set_valued().count(), reduced.degrees_of_freedom());
    let mut motion = Motion::at_time_zero(reduced);
    let rows = motion.frictions[first..].to_vec();
    let symbols = motion.symbols[..r].to_vec();
    let zero = motion.graph.integer(0);
    let count = rows.len();
    let entry = |k: usize, i: usize| rows[k].get(&i).copied().unwrap_or(zero);
    let mut wanted: Vec<Expr> = (0..count * r).map(|place| entry(place / r, place % r)).collect();
    for k in 0..count {
        for i in 0..r {
            for j in 0..i {
                let (ahead, back) = (
                    motion.graph.derivative(entry(k, j), symbols[i]),
                    motion.graph.derivative(entry(k, i), symbols[j]),
                );
                wanted.push(motion.graph.subtract(ahead, back));
            }
        }
    }
    let mut out: Vec<Integrable> = vec![Integrable::AtAllPoints(POINTS as usize); count];
    for point in 0..POINTS {
        let mut turned = Turned { point, turned: BTreeSet::new() };
        let place = |symbol: Symbol| symbols.iter().position(|own| *own == symbol);
        let at = |turned: &mut Turned, moved: Option<usize>| -> Option<Vec<Rational>> {
            let symbol = |symbol: Symbol| {
                let coordinate = place(symbol)?;
                let mut value = turned_symbol(point, coordinate);
                value.value += Rational::from(i64::from(moved == Some(coordinate)));
                Some(value)
            };
            lower(&motion.graph, &wanted, turned, symbol).into_iter().map(|value| Some(value?.value)).collect()
        };
        let Some(values) = at(&mut turned, None) else { return vec![Integrable::NotDecided; count] };
        let null = null_space(&Matrix::from_fn(count, r, |k, i| values[k * r + i].clone()));
        for (k, found) in out.iter_mut().enumerate() {
            let curl = |i: usize, j: usize| -> Rational {
                let at = |i: usize, j: usize| values[count * r + k * (r * (r - 1) / 2) + i * (i - 1) / 2 + j].clone();
                match i.cmp(&j) {
                    std::cmp::Ordering::Greater => at(i, j),
                    std::cmp::Ordering::Less => -at(j, i),
                    std::cmp::Ordering::Equal => Rational::ZERO,
                }
            };
            let form = |x: &[Rational], y: &[Rational]| {
                (0..r * r).fold(Rational::ZERO, |sum, p| sum + &x[p / r] * curl(p / r, p % r) * &y[p % r])
            };
            let pairs = (0..null.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
            if *found == Integrable::AtAllPoints(POINTS as usize)
                && pairs.into_iter().any(|(a, b)| !form(&null[a], &null[b]).is_zero())
            {
                let names = symbols.iter().map(|symbol| motion.graph.name(*symbol).0.to_string());
                let used: Vec<bool> = (0..r).map(|i| uses(&motion, &wanted, symbols[i])).collect();
                let words = names.enumerate().filter(|(i, _)| used[*i]).map(|(i, name)| {
                    let [own, half] = [turned_symbol(point, i).value, half_tangent(point, i)];
                    let by_itself = at(&mut turned, Some(i)).as_ref() != Some(&values);
                    match (by_itself, turned.turned.contains(&i)) {
                        (false, _) => format!("tan({name}/2) = {half}"),
                        (true, false) => format!("{name} = {own}"),
                        // No relation over the rationals ties an angle to its tangent.
                        (true, true) => format!("{name} = {own} and, as a number of its own, tan({name}/2) = {half}"),
                    }
                });
                *found = Integrable::No(words.collect::<Vec<_>>().join(", "));
            }
        }
    }
    out
}

fn uses(motion: &Motion, exprs: &[Expr], symbol: Symbol) -> bool {
    motion.graph.symbols(exprs).contains(&symbol)
}

/// A basis of the null space, exact.
fn null_space(matrix: &Matrix<Rational>) -> Vec<Vec<Rational>> {
    let n = matrix.columns();
    let e = echelon(matrix, &(0..n).collect::<Vec<_>>());
    let free = (0..n).filter(|column| !e.pivots.contains(column));
    let vector = |column: usize| {
        let mut out = vec![Rational::ZERO; n];
        out[column] = Rational::ONE;
        e.pivots.iter().enumerate().for_each(|(row, pivot)| out[*pivot] = -e.form[(row, column)].clone());
        out
    };
    free.map(vector).collect()
}

/// The tangent of half of a coordinate at a point: no two are the same.
fn half_tangent(point: i64, coordinate: usize) -> Rational {
    let k = coordinate as i64;
    Rational::from(2 + 3 * k + 7 * point) / Rational::from(3 + 5 * k + 4 * point)
}

fn turned_symbol(point: i64, coordinate: usize) -> Value {
    // The value beside sine and cosine is a number of its own.
    let value = Rational::from(5 + 4 * coordinate as i64 + 3 * point) / Rational::from(7 + 2 * coordinate as i64);
    Value { value, angle: Some([(coordinate, 1)].into()), whole: None }
}

/// A number at a generic point; as an angle a sum of whole multiples of coordinates, where it is one; and the whole number that it is.
#[derive(Debug, Clone)]
struct Value {
    value: Rational,
    angle: Option<BTreeMap<usize, i64>>,
    whole: Option<i64>,
}

impl Value {
    fn number(value: Rational) -> Self {
        let whole = (-64..=64).find(|k| value == Rational::from(*k));
        Self { angle: (whole == Some(0)).then(BTreeMap::new), whole, value }
    }
}

/// Numbers at a generic point; none where a function is not known there.
struct Turned {
    point: i64,
    /// Coordinates of which a sine or a cosine was taken.
    turned: BTreeSet<usize>,
}

fn sum(a: &Value, b: &Value, sign: i64) -> Value {
    let mut angle = a.angle.clone().zip(b.angle.clone()).map(|(mut sum, other)| {
        other.into_iter().for_each(|(k, n)| *sum.entry(k).or_default() += sign * n);
        sum
    });
    angle.iter_mut().for_each(|angle| angle.retain(|_, n| *n != 0));
    Value { value: &a.value + Rational::from(sign) * &b.value, angle, whole: None }
}

fn product(a: &Value, b: &Value) -> Value {
    let scaled = |whole: Option<i64>, angle: &Option<BTreeMap<usize, i64>>| {
        let (whole, angle) = (whole?, angle.clone()?);
        Some(angle.into_iter().map(|(k, n)| (k, n * whole)).collect())
    };
    let angle = scaled(a.whole, &b.angle).or_else(|| scaled(b.whole, &a.angle));
    Value { value: &a.value * &b.value, angle, whole: None }
}

impl Domain for Turned {
    type Value = Option<Value>;

    fn constant(&mut self, value: &Rational) -> Option<Value> {
        Some(Value::number(value.clone()))
    }

    fn operation(&mut self, operator: Operator, operands: &[Option<Value>]) -> Option<Value> {
        let x: Vec<&Value> = operands.iter().map(Option::as_ref).collect::<Option<_>>()?;
        match operator {
            Operator::Add => Some(sum(x[0], x[1], 1)),
            Operator::Subtract => Some(sum(x[0], x[1], -1)),
            Operator::Multiply => Some(product(x[0], x[1])),
            Operator::AddProduct => Some(sum(x[2], &product(x[0], x[1]), 1)),
            Operator::SubtractProduct => Some(sum(x[2], &product(x[0], x[1]), -1)),
            Operator::Negate => Some(sum(&Value::number(Rational::ZERO), x[0], -1)),
            Operator::Divide if !x[1].value.is_zero() => {
                Some(Value { value: &x[0].value / &x[1].value, angle: None, whole: None })
            }
            _ => None,
        }
    }

    fn sine_cosine(&mut self, angle: &Option<Value>) -> [Option<Value>; 2] {
        let Some(angle) = angle.as_ref().and_then(|value| value.angle.as_ref()) else { return [None, None] };
        let (mut sine, mut cosine) = (Rational::ZERO, Rational::ONE);
        self.turned.extend(angle.keys());
        for (k, n) in angle {
            let u = half_tangent(self.point, *k);
            let square = &u * &u;
            let below = Rational::ONE + &square;
            let (mut s, c) = (Rational::from(2) * u / &below, (Rational::ONE - square) / below);
            if *n < 0 {
                s = -s;
            }
            for _ in 0..n.unsigned_abs() {
                (sine, cosine) = (&sine * &c + &cosine * &s, &cosine * &c - &sine * &s);
            }
        }
        [sine, cosine].map(|value| Some(Value { value, angle: None, whole: None }))
    }

    fn table(&mut self, _: &PiecewisePolynomial, _: &Option<Value>) -> Option<Value> {
        None
    }
}
