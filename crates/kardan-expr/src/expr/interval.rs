//! Intervals that contain every value, rounded outward.

use kardan_rt::functions::{acos, asin, atan, exp, ln, sin_cos, tan};
use kardan_rt::{Operator, Real};

use super::Domain;
use super::piecewise_polynomial::PiecewisePolynomial;
use kardan_math::num::{Rational, rational_from_f64, rational_to_f64};

/// All numbers from `low` to `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The smallest.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

/// Units in the last place that an elementary function may err by.
const UNITS: usize = 2;

impl Interval {
    /// All numbers.
    pub const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// One number.
    pub const fn point(value: f64) -> Self {
        Self { low: value, high: value }
    }

    /// Whether a number is in it.
    pub fn contains(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    fn enclosing(values: &[f64], units: usize) -> Self {
        if values.iter().any(|value| value.is_nan()) {
            return Self::ALL;
        }
        let (low, high) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
        Self { low: (0..units).fold(low, |x, _| x.next_down()), high: (0..units).fold(high, |x, _| x.next_up()) }
    }

    /// All numbers of both and between them.
    pub fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn clamped(self, low: f64, high: f64) -> Self {
        Self { low: self.low.max(low), high: self.high.min(high) }
    }

    fn plus(self, other: Self) -> Self {
        Self::enclosing(&[self.low + other.low, self.high + other.high], 1)
    }

    fn negative(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }

    fn times(self, other: Self) -> Self {
        // Zero times infinity is zero here: the end represents numbers, however large.
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let ends = [(self.low, other.low), (self.low, other.high), (self.high, other.low), (self.high, other.high)];
        Self::enclosing(&ends.map(|(a, b)| product(a, b)), 1)
    }

    fn inverse(self) -> Self {
        if self.contains(0.0) { Self::ALL } else { Self::enclosing(&[1.0 / self.low, 1.0 / self.high], 1) }
    }

    /// A function that rises.
    fn rising(self, function: impl Fn(f64) -> f64) -> Self {
        Self::enclosing(&[function(self.low), function(self.high)], UNITS)
    }

    /// Sine shifted by quarter turns: extremes where the angle passes them.
    fn sine(self, quarter: f64) -> Self {
        use std::f64::consts::{FRAC_PI_2, TAU};
        if !self.low.is_finite() || !self.high.is_finite() || self.high - self.low >= TAU {
            return Self { low: -1.0, high: 1.0 };
        }
        let value = |x: f64| if quarter == 0.0 { sin_cos(x).0 } else { sin_cos(x).1 };
        let mut found = Self::enclosing(&[value(self.low), value(self.high)], UNITS);
        // Extremes lie at odd quarters of the shifted angle; a little more is passed than there is, never less.
        let slack = 1e-9 + 1e-15 * self.low.abs().max(self.high.abs());
        let count = |x: f64| (x / FRAC_PI_2 + quarter - 1.0) / 2.0;
        let (first, last) = (count(self.low - slack).ceil(), count(self.high + slack).floor());
        if last - first >= 0.0 {
            let even = |k: f64| (k / 2.0).floor() * 2.0 == k;
            let has = |parity: bool| even(first) == parity || last > first;
            if has(true) {
                found.high = 1.0;
            }
            if has(false) {
                found.low = -1.0;
            }
        }
        found.clamped(-1.0, 1.0)
    }
}

/// Interval arithmetic: each result contains every value that the operands allow.
#[derive(Debug, Clone, Copy, Default)]
pub struct Intervals;

impl Domain for Intervals {
    type Value = Interval;

    fn constant(&mut self, value: &Rational) -> Interval {
        let near = rational_to_f64(value);
        if rational_from_f64(near).as_ref() == Some(value) {
            Interval::point(near)
        } else {
            Interval::enclosing(&[near], 1)
        }
    }

    fn operation(&mut self, operator: Operator, x: &[Interval]) -> Interval {
        use std::f64::consts::PI;
        let a = x[0];
        match operator {
            Operator::Add => a.plus(x[1]),
            Operator::Subtract => a.plus(x[1].negative()),
            Operator::Multiply => a.times(x[1]),
            Operator::Divide => a.times(x[1].inverse()),
            Operator::AddProduct => x[2].plus(a.times(x[1])),
            Operator::SubtractProduct => x[2].plus(a.times(x[1]).negative()),
            Operator::Negate => a.negative(),
            Operator::Absolute if a.contains(0.0) => Interval { low: 0.0, high: a.high.max(-a.low) },
            Operator::Absolute if a.low < 0.0 => a.negative(),
            Operator::Absolute => a,
            Operator::SquareRoot => a.clamped(0.0, f64::INFINITY).rising(Real::sqrt).clamped(0.0, f64::INFINITY),
            Operator::SineCosine => a.sine(0.0),
            Operator::Tangent => {
                let cosine = a.sine(1.0);
                if cosine.contains(0.0) { Interval::ALL } else { a.rising(tan) }
            }
            Operator::ArcSine => a.clamped(-1.0, 1.0).rising(asin),
            Operator::ArcCosine => a.clamped(-1.0, 1.0).rising(acos),
            Operator::ArcTangent => a.rising(atan),
            Operator::ArcTangent2 if x[1].low > 0.0 => a.times(x[1].inverse()).rising(atan),
            Operator::ArcTangent2 => Interval::enclosing(&[-PI, PI], 1),
            Operator::Exponential => a.rising(exp).clamped(0.0, f64::INFINITY),
            Operator::Logarithm if a.high < 0.0 => Interval::ALL,
            Operator::Logarithm => a.clamped(0.0, f64::INFINITY).rising(ln),
            Operator::Minimum => Interval { low: a.low.min(x[1].low), high: a.high.min(x[1].high) },
            Operator::Maximum => Interval { low: a.low.max(x[1].low), high: a.high.max(x[1].high) },
            Operator::Select if a.high < x[1].low => x[2],
            Operator::Select if a.low >= x[1].high => x[3],
            Operator::Select => x[2].hull(x[3]),
            Operator::Table => Interval::ALL,
        }
    }

    fn sine_cosine(&mut self, angle: &Interval) -> [Interval; 2] {
        [angle.sine(0.0), angle.sine(1.0)]
    }

    fn table(&mut self, table: &PiecewisePolynomial, x: &Interval) -> Interval {
        let mut found: Option<Interval> = None;
        for (k, (origin, coefficients)) in table.pieces.iter().enumerate() {
            let from = if k == 0 { Interval::point(f64::NEG_INFINITY) } else { self.constant(&table.knots[k - 1]) };
            let until = table.knots.get(k).map_or(Interval::point(f64::INFINITY), |knot| self.constant(knot));
            let part = x.clamped(from.low, until.high);
            if part.low > part.high {
                continue;
            }
            let origin = self.constant(origin).negative();
            let argument = part.plus(origin);
            let value = coefficients.iter().rev().fold(Interval::point(0.0), |value, c| {
                let c = self.constant(c);
                value.times(argument).plus(c)
            });
            found = Some(found.map_or(value, |found| found.hull(value)));
        }
        found.unwrap_or(Interval::ALL)
    }
}
