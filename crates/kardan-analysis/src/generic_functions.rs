//! Functions along a generic motion that satisfy no algebraic relation, and those with several pieces.
//!
//! A function that is given by a differential equation, such as e^u by `E′ = E u′`, is replaced by any solution: its initial value is random, the same for the
//! same argument. A root is one modulo the prime, of either sign. A table is replaced by one of its pieces, as if u were on it. An expression that vanishes for all of these
//! vanishes for the function itself; the converse is not certain (`GenericTrajectory::loose`). Non-smooth functions are no part of rows.

use kardan_rt::Operator;

use super::generic_motion::{GenericTrajectory, Series, Value};
use kardan_expr::expr::{Domain, PiecewisePolynomial};
use kardan_math::num::{PrimeField, Random, Rational, Residue};

impl GenericTrajectory {
    /// A number drawn for an argument.
    fn drawn(&self, what: &str, argument: u64) -> u64 {
        self.point.random(&format!("{what} of {argument}")).next_u64()
    }

    /// Which of an argument and its opposite counts as the positive one, and whether it is the argument.
    fn size(&self, argument: Residue) -> (u64, bool) {
        let value = self.field.0.value(argument);
        let complement = self.field.0.prime() - value;
        (value.min(complement), value <= complement)
    }

    /// Initial value of a function; of an odd one the opposite for the opposite argument.
    fn begin(&self, what: &str, argument: Residue) -> Residue {
        let (size, positive) = self.size(argument);
        let start = self.field.0.element(self.drawn(what, size));
        if positive { start } else { self.field.0.negate(start) }
    }

    /// The series with these derivatives and this initial value.
    fn integral(&self, start: Residue, rate: &[Residue]) -> Series {
        let field = &self.field.0;
        let over = |n: usize| field.inverse(field.element(n as u64 + 1));
        std::iter::once(start).chain(rate.iter().enumerate().map(|(n, x)| field.times(*x, over(n)))).collect()
    }

    /// The solution of a differential equation with this initial value.
    fn grown(&self, start: Residue, terms: usize, rate: impl Fn(&[Residue]) -> Series) -> Series {
        let mut out = vec![start];
        while out.len() < terms {
            out = self.integral(start, &rate(&out));
        }
        out
    }

    /// Sine and cosine of an argument that is no sum of coordinates.
    pub(super) fn any_turn(&mut self, angle: &[Residue]) -> [Option<Value>; 2] {
        self.loose = true;
        if angle.is_empty() {
            return [None, None];
        }
        let tangent = self.begin("half tangent", angle[0]);
        let both = self.sine_cosine_of(tangent, &self.field.derivative(angle));
        both.map_or([None, None], |both| both.map(|series| Some(Value::of(series))))
    }

    /// A function of one or two numbers.
    pub(super) fn function(&mut self, operator: Operator, x: &[&Value]) -> Option<Value> {
        self.loose = true;
        // Speeds are unknown before the motion is.
        if x.iter().any(|x| x.series.is_empty()) {
            return None;
        }
        let (field, u) = (self.field, &x[0].series);
        let (terms, rate) = (u.len(), field.derivative(u));
        let one = || field.number(field.0.one(), terms);
        let over = |below: &Series| Some(field.product(&rate, &field.inverse(below)?));
        let series = match operator {
            Operator::SquareRoot => self.root(u)?,
            Operator::Exponential => {
                let (size, positive) = self.size(u[0]);
                let start = field.0.element(self.drawn("exponential", size));
                let start = if positive { start } else { field.0.inverse((start != 0).then_some(start)?) };
                self.grown(start, terms, |own| field.product(own, &rate))
            }
            Operator::Logarithm => self.integral(self.begin("logarithm", u[0]), &over(u)?),
            Operator::Tangent => self.grown(self.begin("tangent", u[0]), terms, |own| {
                let one = field.number(field.0.one(), own.len());
                field.product(&field.sum(&one, &field.product(own, own)), &rate)
            }),
            Operator::ArcTangent => {
                let below = field.sum(&one(), &field.product(u, u));
                self.integral(self.begin("arc tangent", u[0]), &over(&below)?)
            }
            Operator::ArcSine | Operator::ArcCosine => {
                let below = self.root(&field.difference(&one(), &field.product(u, u)))?;
                let slope = over(&below)?;
                let rate =
                    if operator == Operator::ArcSine { slope } else { field.difference(&vec![0; slope.len()], &slope) };
                self.integral(self.begin("arc", u[0]), &rate)
            }
            Operator::ArcTangent2 => {
                let other = &x[1].series;
                let below = field.sum(&field.product(u, u), &field.product(other, other));
                let numerator =
                    field.difference(&field.product(&rate, other), &field.product(u, &field.derivative(other)));
                let start = self.begin("arc of a point", field.0.times(u[0], self.begin("point", other[0])));
                self.integral(start, &field.product(&numerator, &field.inverse(&below)?))
            }
            _ => return None,
        };
        Some(Value::of(series))
    }

    /// A root modulo the prime; none where there is none, or the prime leaves one over four.
    fn root(&mut self, of: &[Residue]) -> Option<Series> {
        let field = self.field.0;
        let root = power(&self.field.0, of[0], field.prime().div_ceil(4));
        if root == 0 || field.prime() % 4 != 3 || field.times(root, root) != of[0] {
            return None;
        }
        let value = field.value(of[0]);
        self.sides.insert(value, 2);
        let root = if self.drawn("root", value) & 1 == 1 { root } else { field.negate(root) };
        let over = field.inverse(field.plus(root, root));
        let mut out = vec![root];
        for n in 1..of.len() {
            let convolution = (1..n).fold(0, |sum, i| field.plus(sum, field.times(out[i], out[n - i])));
            out.push(field.times(field.minus(of[n], convolution), over));
        }
        Some(out)
    }

    /// A table, as if its argument were on one of its pieces: on the same one for all tables with the same knots.
    pub(super) fn piece(&mut self, table: &PiecewisePolynomial, x: &Value) -> Option<Value> {
        self.loose = true;
        let (count, first) = (table.pieces.len(), *x.series.first()?);
        let number = match &x.fraction {
            Some(fraction) => table.knots.partition_point(|knot| knot <= fraction),
            None => {
                let knots = Random::fnv(Random::FNV, format!("{:?}", table.knots).as_bytes());
                let at = self.field.0.value(first) ^ knots;
                self.sides.insert(at, count);
                (self.drawn("piece", at) % count as u64) as usize
            }
        };
        let (origin, coefficients) = &table.pieces[number];
        let origin = self.constant(origin)?;
        let step = self.sum(x, &origin, -1);
        let mut sum = self.constant(&Rational::ZERO)?;
        for coefficient in coefficients.iter().rev() {
            let own = self.constant(coefficient);
            sum = self.operation(Operator::AddProduct, &[Some(sum), Some(step.clone()), own])?;
        }
        Some(sum)
    }
}

/// xⁿ modulo the prime.
fn power(field: &PrimeField, x: Residue, n: u64) -> Residue {
    let bits = (0..u64::BITS - n.leading_zeros()).rev();
    bits.fold(field.one(), |all, bit| {
        let square = field.times(all, all);
        if n >> bit & 1 == 1 { field.times(square, x) } else { square }
    })
}
