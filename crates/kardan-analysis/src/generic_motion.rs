//! Numbers along a generic motion: power series of its time at a generic point, modulo a prime.
//!
//! A coordinate, its sine and its cosine are three numbers there, of which the two last are (1 − u²)/(1 + u²) and 2u/(1 + u²) with a
//! u of the point, and go on by their differential equations. As the functions q, sin q and cos q satisfy no other algebraic relation, what
//! does not vanish at one such point, modulo one prime, does not vanish identically. The same is true of sin αq and sin q with an α that is
//! no fraction. Of other functions (`generic_functions`) any solution of their differential equation is taken: a zero for any solution is a zero for
//! them, other values decide nothing.

use std::collections::{BTreeMap, BTreeSet};

use kardan_rt::Operator;

use kardan_expr::expr::{Domain, PiecewisePolynomial};
use kardan_math::num::{PrimeField, Random, Rational, Residue, rational_to_f64};

/// Coefficients of 1, t, t², …; as many as are known.
pub(super) type Series = Vec<Residue>;

/// Above this no multiple of an angle is expanded.
pub(super) const MOST_MULTIPLES: i64 = 64;

/// The numbers of series.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeriesField(pub PrimeField);

impl SeriesField {
    pub fn number(&self, value: Residue, terms: usize) -> Series {
        let mut out = vec![0; terms];
        out[0] = value;
        out
    }

    pub fn sum(&self, a: &[Residue], b: &[Residue]) -> Series {
        a.iter().zip(b).map(|(a, b)| self.0.plus(*a, *b)).collect()
    }

    pub fn difference(&self, a: &[Residue], b: &[Residue]) -> Series {
        a.iter().zip(b).map(|(a, b)| self.0.minus(*a, *b)).collect()
    }

    pub fn product(&self, a: &[Residue], b: &[Residue]) -> Series {
        let one = |n: usize| (0..=n).fold(0, |sum, i| self.0.plus(sum, self.0.times(a[i], b[n - i])));
        (0..a.len().min(b.len())).map(one).collect()
    }

    /// None where it vanishes at the point.
    pub fn inverse(&self, a: &[Residue]) -> Option<Series> {
        let first = (a[0] != 0).then(|| self.0.inverse(a[0]))?;
        let mut out = vec![first];
        for n in 1..a.len() {
            let rest = (1..=n).fold(0, |sum, i| self.0.plus(sum, self.0.times(a[i], out[n - i])));
            out.push(self.0.negate(self.0.times(rest, first)));
        }
        Some(out)
    }

    /// One coefficient less is known of it.
    pub fn derivative(&self, a: &[Residue]) -> Series {
        a.iter().enumerate().skip(1).map(|(n, a)| self.0.times(self.0.element(n as u64), *a)).collect()
    }

    pub fn scaled(&self, factor: Residue, a: &[Residue]) -> Series {
        a.iter().map(|a| self.0.times(factor, *a)).collect()
    }
}

/// Sine and cosine of this part of a coordinate are numbers of their own.
#[derive(Debug, Clone, PartialEq)]
struct Base {
    coordinate: usize,
    unit: Rational,
}

/// The initial point of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Point {
    /// At small fractions, which a message can show.
    Display(i64),
    /// At numbers drawn with this seed.
    Drawn(u64),
}

impl Point {
    /// The other random numbers there.
    pub fn random(self, what: &str) -> Random {
        match self {
            Self::Display(number) => Random::named(number.cast_unsigned(), what),
            Self::Drawn(seed) => Random::named(seed, what),
        }
    }
}

/// A generic motion, as far as it is known: its coordinates, the time last.
pub(super) struct GenericTrajectory {
    pub field: SeriesField,
    pub point: Point,
    pub motion: Vec<Series>,
    bases: Vec<Base>,
    /// Bases of which a sine or a cosine was taken.
    pub used_bases: BTreeSet<usize>,
    /// Whether an angle was met that needs smaller parts.
    pub subdivided: bool,
    /// Whether the motion contains a function that any solution of its differential equation replaces, or one of several sides.
    pub loose: bool,
    /// Between how many sides was chosen, by where.
    pub sides: BTreeMap<u64, usize>,
}

/// A series; as an angle a sum of multiples of coordinates, where it is one; and the fraction that it is.
#[derive(Debug, Clone)]
pub(super) struct Value {
    pub series: Series,
    angle: Option<BTreeMap<usize, Rational>>,
    pub fraction: Option<Rational>,
}

impl Value {
    pub fn of(series: Series) -> Self {
        Self { series, angle: None, fraction: None }
    }
}

/// The tangent of half of an angle at a point that a message can show: no two are the same.
fn half_tangent(point: i64, base: usize) -> Rational {
    let k = base as i64;
    Rational::from(2 + 3 * k + 7 * point) / Rational::from(3 + 5 * k + 4 * point)
}

/// A coordinate itself at a point that a message can show, a number independent of its sine and cosine.
pub(super) fn value_at_point(point: i64, coordinate: usize) -> Rational {
    Rational::from(5 + 4 * coordinate as i64 + 3 * point) / Rational::from(7 + 2 * coordinate as i64)
}

impl GenericTrajectory {
    /// A point with this many coordinates, the time behind them.
    pub fn new(field: PrimeField, point: Point, coordinates: usize) -> Self {
        let value = |k: usize| match point {
            Point::Display(number) => field.rational(&value_at_point(number, k)).unwrap_or_default(),
            Point::Drawn(_) => field.element(point.random(&format!("value {k}")).next_u64()),
        };
        let start = |k: usize| vec![value(k)];
        let bases = (0..=coordinates).map(|coordinate| Base { coordinate, unit: Rational::ONE }).collect();
        Self {
            field: SeriesField(field),
            point,
            motion: (0..=coordinates).map(start).collect(),
            bases,
            used_bases: BTreeSet::new(),
            subdivided: false,
            loose: false,
            sides: BTreeMap::new(),
        }
    }

    /// How many coefficients are known.
    pub fn terms(&self) -> usize {
        self.motion[0].len()
    }

    /// The same point with the smaller parts of angles that are known by now, and an unknown motion.
    pub fn begin_again(&mut self) {
        self.motion.iter_mut().for_each(|x| x.truncate(1));
        self.subdivided = false;
    }

    /// The tangents that represent the sines and cosines taken of a coordinate.
    pub fn tangents(&self, coordinate: usize, name: &str) -> Vec<String> {
        let Point::Display(point) = self.point else { return Vec::new() };
        let own = self
            .bases
            .iter()
            .enumerate()
            .filter(|(k, base)| base.coordinate == coordinate && self.used_bases.contains(k));
        own.map(|(k, base)| {
            let unit = match base.unit.is_one() {
                true => name.to_string(),
                false => format!("{:.6} {name}", rational_to_f64(&base.unit)),
            };
            format!("tan(({unit})/2) = {}", half_tangent(point, k)).replace(&format!("({name})"), name)
        })
        .collect()
    }

    pub fn coordinate(&self, k: usize) -> Value {
        Value { series: self.motion[k].clone(), angle: Some([(k, Rational::ONE)].into()), fraction: None }
    }

    /// The base of a multiple of a coordinate, and how many times it is taken.
    fn base(&mut self, coordinate: usize, factor: &Rational) -> Option<(usize, i64)> {
        for (k, base) in self.bases.iter_mut().enumerate().filter(|(_, base)| base.coordinate == coordinate) {
            let ratio = factor / &base.unit;
            let below = i64::try_from(ratio.denominator().clone()).ok();
            let above = i64::try_from(ratio.numerator().clone()).ok();
            let Some((above, below)) = above.zip(below) else { continue };
            if above.abs().max(below) > MOST_MULTIPLES {
                continue;
            }
            if below != 1 {
                base.unit = &base.unit / Rational::from(below);
                self.subdivided = true;
                return None;
            }
            return Some((k, above));
        }
        self.bases.push(Base { coordinate, unit: factor.clone() });
        Some((self.bases.len() - 1, 1))
    }

    /// Sine and cosine of a base along the motion.
    fn turn(&self, base: usize) -> Option<[Series; 2]> {
        let (field, own) = (&self.field.0, &self.bases[base]);
        let rate = self.field.scaled(field.rational(&own.unit)?, &self.field.derivative(&self.motion[own.coordinate]));
        let u = match self.point {
            Point::Display(point) => field.rational(&half_tangent(point, base))?,
            Point::Drawn(_) => field.element(self.point.random(&format!("tangent {base}")).next_u64()),
        };
        self.sine_cosine_of(u, &rate)
    }

    /// Sine and cosine of an angle, half of which has this tangent at the point, from its rate.
    pub fn sine_cosine_of(&self, u: Residue, rate: &[Residue]) -> Option<[Series; 2]> {
        let field = &self.field.0;
        let square = field.times(u, u);
        let below = field.plus(field.one(), square);
        let over = (below != 0).then(|| field.inverse(below))?;
        let mut sine = vec![field.times(field.plus(u, u), over)];
        let mut cosine = vec![field.times(field.minus(field.one(), square), over)];
        for n in 0..rate.len() {
            let step = |of: &[Residue]| {
                let sum = (0..=n).fold(0, |sum, i| field.plus(sum, field.times(of[i], rate[n - i])));
                field.times(sum, field.inverse(field.element(n as u64 + 1)))
            };
            let (s, c) = (step(&cosine), field.negate(step(&sine)));
            sine.push(s);
            cosine.push(c);
        }
        Some([sine, cosine])
    }

    pub fn sum(&self, a: &Value, b: &Value, sign: i64) -> Value {
        let angle = a.angle.clone().zip(b.angle.as_ref()).map(|(mut sum, other)| {
            other.iter().for_each(|(k, n)| *sum.entry(*k).or_insert(Rational::ZERO) += Rational::from(sign) * n);
            sum.retain(|_, n| !n.is_zero());
            sum
        });
        let combine = if sign < 0 { SeriesField::difference } else { SeriesField::sum };
        let fraction = a.fraction.as_ref().zip(b.fraction.as_ref()).map(|(a, b)| a + Rational::from(sign) * b);
        Value { series: combine(&self.field, &a.series, &b.series), angle, fraction }
    }

    fn product(&self, a: &Value, b: &Value) -> Value {
        let scaled = |fraction: &Option<Rational>, angle: &Option<BTreeMap<usize, Rational>>| {
            let (fraction, angle) = (fraction.as_ref()?, angle.as_ref()?);
            Some(angle.iter().map(|(k, n)| (*k, n * fraction)).filter(|(_, n)| !n.is_zero()).collect())
        };
        let angle = scaled(&a.fraction, &b.angle).or_else(|| scaled(&b.fraction, &a.angle));
        let fraction = a.fraction.as_ref().zip(b.fraction.as_ref()).map(|(a, b)| a * b);
        Value { series: self.field.product(&a.series, &b.series), angle, fraction }
    }
}

impl Domain for GenericTrajectory {
    type Value = Option<Value>;

    fn constant(&mut self, value: &Rational) -> Option<Value> {
        let series = self.field.number(self.field.0.rational(value)?, self.terms());
        let angle = value.is_zero().then(BTreeMap::new);
        Some(Value { series, angle, fraction: Some(value.clone()) })
    }

    fn operation(&mut self, operator: Operator, operands: &[Option<Value>]) -> Option<Value> {
        let x: Vec<&Value> = operands.iter().map(Option::as_ref).collect::<Option<_>>()?;
        match operator {
            Operator::Add => Some(self.sum(x[0], x[1], 1)),
            Operator::Subtract => Some(self.sum(x[0], x[1], -1)),
            Operator::Multiply => Some(self.product(x[0], x[1])),
            Operator::AddProduct => Some(self.sum(x[2], &self.product(x[0], x[1]), 1)),
            Operator::SubtractProduct => Some(self.sum(x[2], &self.product(x[0], x[1]), -1)),
            Operator::Negate => {
                let zero = self.constant(&Rational::ZERO)?;
                Some(self.sum(&zero, x[0], -1))
            }
            Operator::Divide => {
                let reciprocal = |own: &Rational| (!own.is_zero()).then(|| Rational::ONE / own);
                let series = self.field.inverse(&x[1].series)?;
                let fraction = x[1].fraction.as_ref().and_then(reciprocal);
                Some(self.product(x[0], &Value { series, angle: None, fraction }))
            }
            Operator::Tangent if x[0].angle.is_some() => {
                let [sine, cosine] = self.sine_cosine(&operands[0]);
                self.operation(Operator::Divide, &[sine, cosine])
            }
            _ => self.function(operator, &x),
        }
    }

    fn sine_cosine(&mut self, angle: &Option<Value>) -> [Option<Value>; 2] {
        let Some(value) = angle else { return [None, None] };
        let Some(angle) = &value.angle else { return self.any_turn(&value.series) };
        let (field, terms) = (self.field, self.terms());
        let mut both = [field.number(0, terms), field.number(field.0.one(), terms)];
        for (k, factor) in angle {
            let Some((base, times)) = self.base(*k, factor) else { return [None, None] };
            self.used_bases.insert(base);
            let Some([mut s, c]) = self.turn(base) else { return [None, None] };
            if times < 0 {
                s = field.difference(&field.number(0, terms), &s);
            }
            for _ in 0..times.unsigned_abs() {
                let [sine, cosine] = &both;
                both = [
                    field.sum(&field.product(sine, &c), &field.product(cosine, &s)),
                    field.difference(&field.product(cosine, &c), &field.product(sine, &s)),
                ];
            }
        }
        both.map(|series| Some(Value::of(series)))
    }

    fn table(&mut self, table: &PiecewisePolynomial, x: &Option<Value>) -> Option<Value> {
        self.piece(table, x.as_ref()?)
    }
}
