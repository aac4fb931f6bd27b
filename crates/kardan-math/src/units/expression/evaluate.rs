//! The values of expressions.

use std::cmp::Ordering;

use dashu_int::IBig;
use dashu_int::ops::{Abs, BitTest};
use dashu_ratio::RBig;

use super::super::catalogue::{find_unit, unit_help};
use super::super::{Dimension, Exact, UnitError, precise};
use super::reading::unknown_function;
use super::tree::{Called, Kind, Node};
use crate::num::{rational_from_f64, rational_to_f64};

/// The largest size of a power of π.
const PI_LIMIT: i64 = 1000;
/// The largest size of a power.
const POWER_LIMIT: i32 = 64;

/// The domain condition of a function's argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Restriction {
    /// A square root.
    NotNegative,
    /// A logarithm.
    Positive,
    /// An arc sine or cosine.
    UnitInterval,
}

/// An intermediate number.
#[derive(Clone)]
pub enum Number {
    /// A fraction times a power of π.
    Exact(Exact),
    /// To 256 binary digits.
    Rounded(RBig),
}

/// The value of a part of an expression.
pub struct Value {
    /// SI.
    pub number: Number,
    /// Its dimension.
    pub dimension: Dimension,
}

impl Value {
    /// The whole number that it is.
    pub fn whole(&self) -> Option<i32> {
        match &self.number {
            Number::Exact(value) if value.pi == 0 && value.rational.is_int() => {
                i32::try_from(value.rational.numerator().clone()).ok()
            }
            _ => None,
        }
    }
}

impl Number {
    pub(crate) fn digits(&self) -> RBig {
        match self {
            Self::Exact(value) => value.digits(),
            Self::Rounded(value) => value.clone(),
        }
    }

    /// The number, or the nearest one of floating point, and whether it is the number itself; none beyond these.
    pub fn rounded_once(self) -> Option<(Exact, bool)> {
        match self {
            Self::Exact(value) => Some((value, true)),
            Self::Rounded(value) => {
                let nearest = rational_to_f64(&value);
                let zero = nearest == 0.0 && !value.is_zero();
                rational_from_f64(nearest).filter(|_| !zero).map(|exact| (Exact::new(exact, 0).rounded(), false))
            }
        }
    }

    pub(super) fn signum(&self) -> i32 {
        match self {
            Self::Exact(value) => value.signum(),
            Self::Rounded(value) => Exact::new(value.clone(), 0).signum(),
        }
    }

    fn rounded(value: &RBig) -> Self {
        Self::Rounded(precise::short(value))
    }

    fn plus(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Exact(a), Self::Exact(b)) if a.is_zero() || b.is_zero() || a.pi == b.pi => Self::Exact(a.plus(b)),
            _ => Self::difference(&self.digits(), &-other.digits()),
        }
    }

    /// Two numbers of 256 digits that agree in all but the last digits cancel: `sqrt(2)^2 - 2` is zero.
    fn difference(a: &RBig, b: &RBig) -> Self {
        let difference = a - b;
        let is_noise = !difference.is_zero() && precise::is_noise_of(&difference, a);
        if is_noise { Self::Rounded(RBig::ZERO) } else { Self::rounded(&difference) }
    }

    /// Whether it is not a fraction times a power of π, or is computed from a number that approximates one.
    fn is_rounded(&self) -> bool {
        match self {
            Self::Exact(value) => value.is_rounded(),
            Self::Rounded(_) => true,
        }
    }

    fn times(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Exact(a), Self::Exact(b)) => Self::Exact(a * b),
            _ => Self::rounded(&(self.digits() * other.digits())),
        }
    }

    fn negative(&self) -> Self {
        match self {
            Self::Exact(value) => Self::Exact(-value),
            Self::Rounded(value) => Self::Rounded(-value.clone()),
        }
    }

    /// Exactly: two different numbers of this form differ in their first digits.
    fn compare(&self, other: &Self) -> Ordering {
        self.plus(&other.negative()).signum().cmp(&0)
    }

    fn power(&self, power: i32) -> Option<Self> {
        if power == 0 {
            return Some(Self::Exact(Exact::one()));
        }
        match self {
            Self::Exact(value) if value.is_zero() => (power > 0).then(|| self.clone()),
            Self::Exact(value) if (i64::from(value.pi) * i64::from(power)).abs() > PI_LIMIT => None,
            Self::Exact(value) => value.pow(power).map(Self::Exact),
            Self::Rounded(value) if value.is_zero() => (power > 0).then(|| self.clone()),
            Self::Rounded(value) => {
                let size = value.numerator().bit_len() + value.denominator().bit_len();
                (size < 16_384).then(|| Self::rounded(&value.pow(power as isize)))
            }
        }
    }
}

type Lookup<'a> = &'a dyn Fn(&str) -> Option<(Exact, Dimension)>;

impl Node {
    /// The names in it, in the order in which they first appear.
    pub fn names(&self) -> Vec<&str> {
        self.different(|kind| if let Kind::Name(name) = kind { Some(name.as_str()) } else { None })
    }

    /// The tables in it, in the order in which they first appear.
    pub fn tables(&self) -> Vec<&str> {
        self.different(|kind| if let Kind::Lookup(name, _) = kind { Some(name.as_str()) } else { None })
    }

    fn different(&self, text: impl Fn(&Kind) -> Option<&str>) -> Vec<&str> {
        let mut out = Vec::new();
        for found in self.nodes(true).filter_map(|part| text(&part.kind)) {
            if !out.contains(&found) {
                out.push(found);
            }
        }
        out
    }

    /// An unknown table, with the known ones.
    pub fn unknown_table(&self, name: &str, tables: &[&str]) -> UnitError {
        unknown_function(name, self.span.start..self.span.start + name.len(), tables)
    }

    fn parts(&self) -> &[Self] {
        match &self.kind {
            Kind::Literal(..) | Kind::Name(_) => &[],
            Kind::Negative(inner) => std::slice::from_ref(inner),
            Kind::Binary(_, parts) => &parts[..],
            Kind::Call(_, parts) | Kind::Lookup(_, parts) => parts,
            Kind::If(_, parts) => &parts[..],
        }
    }

    /// Whether parts are nested deeper than this.
    pub(super) fn is_deeper_than(&self, most: usize) -> bool {
        let mut open = vec![(self, 1)];
        while let Some((part, depth)) = open.pop() {
            if depth > most {
                return true;
            }
            open.extend(part.parts().iter().map(|part| (part, depth + 1)));
        }
        false
    }

    /// All parts, inner ones first, itself last.
    pub(super) fn all<'n>(&'n self, out: &mut Vec<&'n Self>) {
        self.parts().iter().for_each(|part| part.all(out));
        out.push(self);
    }

    /// Itself and all its parts, each before its own ones; `into_if`: also those of `if(...)`.
    pub(super) fn nodes(&self, into_if: bool) -> impl Iterator<Item = &Self> {
        let mut open = vec![self];
        std::iter::from_fn(move || {
            let next = open.pop()?;
            if into_if || !matches!(next.kind, Kind::If(..)) {
                open.extend(next.parts().iter().rev());
            }
            Some(next)
        })
    }

    /// Parts with a domain condition of a function; not those within `if(...)`.
    pub(super) fn restricted(&self) -> impl Iterator<Item = (&Self, Restriction)> {
        self.nodes(false).filter_map(|part| {
            let Kind::Call(function, parts) = &part.kind else { return None };
            let restriction = match function {
                Called::Sqrt => Restriction::NotNegative,
                Called::Ln => Restriction::Positive,
                Called::Asin | Called::Acos => Restriction::UnitInterval,
                _ => return None,
            };
            Some((&parts[0], restriction))
        })
    }

    /// The parts that something is divided by; not those within `if(...)`.
    pub(super) fn divisors(&self) -> impl Iterator<Item = &Self> {
        self.nodes(false).filter_map(|part| {
            let Kind::Binary(operator, parts) = &part.kind else { return None };
            let negative = || parts[1].value(&|_| None).is_ok_and(|power| power.number.signum() < 0);
            match operator {
                '/' => Some(&parts[1]),
                '^' if negative() => Some(&parts[0]),
                _ => None,
            }
        })
    }

    /// Whether a part of it that does not vary is rounded.
    pub(super) fn rounds(&self, lookup: Lookup<'_>) -> bool {
        match self.value(lookup) {
            Ok(value) => value.number.is_rounded(),
            Err(_) => self.parts().iter().any(|part| part.rounds(lookup)),
        }
    }

    /// The value of this part; `lookup` returns the values of names.
    pub fn value(&self, lookup: Lookup<'_>) -> Result<Value, UnitError> {
        match &self.kind {
            Kind::Literal(value, dimension) => {
                Ok(Value { number: Number::Exact(value.clone()), dimension: *dimension })
            }
            Kind::Name(name) => match lookup(name) {
                Some((value, dimension)) => Ok(Value { number: Number::Exact(value), dimension }),
                None if find_unit(name).is_some() => Err(self.error(
                    "name::unknown",
                    format!("there is no parameter `{name}`, and a unit must follow a number"),
                    format!(
                        "write `1 {name}`, also below a line: `3 / 1 {name}`; or `/{name}` after a unit without spaces"
                    ),
                )),
                None => match unit_help(name) {
                    help if help.starts_with("did you mean") => {
                        Err(self.error("unit::unknown", format!("there is no parameter and no unit `{name}`"), help))
                    }
                    _ => Err(self.error(
                        "name::unknown",
                        format!("there is no parameter `{name}`"),
                        format!("declare `{name}` under `[parameters]`"),
                    )),
                },
            },
            Kind::Negative(inner) => {
                let Value { number, dimension } = inner.value(lookup)?;
                Ok(Value { number: number.negative(), dimension })
            }
            Kind::Binary('^', parts) => self.power(parts, lookup),
            Kind::Binary(operator, parts) => {
                let [a, b] = [parts[0].value(lookup)?, parts[1].value(lookup)?];
                match operator {
                    '+' | '-' => {
                        parts[1].like(&a.dimension, &b.dimension)?;
                        let other = if *operator == '-' { b.number.negative() } else { b.number };
                        Ok(Value { number: a.number.plus(&other), dimension: a.dimension })
                    }
                    '/' if b.number.signum() == 0 => {
                        let help = "divide by what is not zero, or choose with `if(x == 0, ..., ...)`";
                        Err(parts[1].error("expression::division", "division by zero: this part is 0", help))
                    }
                    _ => {
                        let power = if *operator == '/' { -1 } else { 1 };
                        let other = b.number.power(power);
                        let both = other.zip(a.dimension.times(&b.dimension, power));
                        let (other, dimension) = both.ok_or_else(|| self.too_large())?;
                        Ok(Value { number: a.number.times(&other), dimension })
                    }
                }
            }
            Kind::Call(function, arguments) => self.call(*function, arguments, lookup),
            Kind::Lookup(name, _) => Err(self.unknown_table(name, &[])),
            Kind::If(comparison, parts) => {
                let [a, b] = [parts[0].value(lookup)?, parts[1].value(lookup)?];
                parts[1].like(&a.dimension, &b.dimension)?;
                // Both must fit, as parameters may change.
                let order = a.number.compare(&b.number);
                let satisfied = match *comparison {
                    "<" => order.is_lt(),
                    "<=" => order.is_le(),
                    ">" => order.is_gt(),
                    ">=" => order.is_ge(),
                    "==" => order.is_eq(),
                    _ => order.is_ne(),
                };
                parts[if satisfied { 2 } else { 3 }].value(lookup)
            }
        }
    }

    fn power(&self, parts: &[Node; 2], lookup: Lookup<'_>) -> Result<Value, UnitError> {
        let [base, power] = [parts[0].value(lookup)?, parts[1].value(lookup)?];
        let whole = power.whole();
        let dimension = self.power_dimension(parts, [&base.dimension, &power.dimension], whole)?;
        if let Some(whole) = whole {
            if base.number.signum() == 0 && whole < 0 {
                let help = "divide by what is not zero";
                return Err(parts[0].error("expression::division", "division by zero: this part is 0", help));
            }
            let number = if whole.abs() <= POWER_LIMIT { base.number.power(whole) } else { None };
            return Ok(Value { number: number.ok_or_else(|| self.too_large())?, dimension });
        }
        if base.number.signum() <= 0 {
            let help = "a power that is not whole needs a number above zero";
            return Err(parts[0].error("expression::domain", "this part is not above zero", help));
        }
        let exponent = precise::logarithm(&base.number.digits()) * power.number.digits();
        self.exponential(&exponent)
    }

    fn exponential(&self, exponent: &RBig) -> Result<Value, UnitError> {
        let size = rational_to_f64(exponent);
        if !(size.abs() < 1000.0) {
            return Err(self.too_large());
        }
        Ok(Value { number: Number::Rounded(precise::exponential(exponent)), dimension: Dimension::NONE })
    }

    fn call(&self, function: Called, arguments: &[Node], lookup: Lookup<'_>) -> Result<Value, UnitError> {
        use Called::{Abs, Acos, Asin, Atan, Atan2, Cos, Exp, Ln, Max, Min, Sign, Sin, Sqrt, Tan};
        let values = arguments.iter().map(|argument| argument.value(lookup)).collect::<Result<Vec<_>, _>>()?;
        let first = &values[0];
        let dimensions: Vec<Dimension> = values.iter().map(|value| value.dimension).collect();
        let dimension = Self::call_dimension(function, arguments, &dimensions)?;
        let domain = |message: &str| arguments[0].error("expression::domain", message, "check the value of this part");
        if matches!(function, Sin | Cos | Tan) && rational_to_f64(&first.number.digits()).abs() > 1e30 {
            return Err(domain("an angle that is too large"));
        }
        let plain = |number: Number| Ok(Value { number, dimension });
        let x = first.number.digits();
        match function {
            Abs => {
                let number = if first.number.signum() < 0 { first.number.negative() } else { first.number.clone() };
                plain(number)
            }
            Sign => plain(Number::Exact(Exact::from_integer(first.number.signum().into()))),
            Min | Max => {
                let worse = if function == Min { Ordering::Less } else { Ordering::Greater };
                let best = values.iter().reduce(|best, value| match value.number.compare(&best.number) {
                    order if order == worse => value,
                    _ => best,
                });
                let best = best.unwrap_or(first);
                plain(best.number.clone())
            }
            Sqrt if first.number.signum() < 0 => Err(domain("the square root of a negative number")),
            Sqrt => plain(square_root(&first.number)),
            Exp => match first.number.signum() {
                0 => plain(Number::Exact(Exact::one())),
                _ => self.exponential(&x),
            },
            Ln if first.number.signum() <= 0 => Err(domain("the logarithm of a number that is not above zero")),
            Ln if x == RBig::ONE => plain(Number::Exact(Exact::zero())),
            Ln => plain(Number::Rounded(precise::logarithm(&x))),
            Sin => plain(sine(&first.number, 0)),
            Cos => plain(sine(&first.number, 1)),
            Tan => {
                let [sine, cosine] = [sine(&first.number, 0), sine(&first.number, 1)];
                if cosine.signum() == 0 {
                    return Err(domain("the tangent has no value here"));
                }
                plain(tangent(&first.number).unwrap_or_else(|| Number::rounded(&(sine.digits() / cosine.digits()))))
            }
            Asin | Acos => {
                let cosine = RBig::ONE - &x * &x;
                if cosine < RBig::ZERO {
                    return Err(domain("the arc of a number outside of -1 to 1"));
                }
                let sixths = arc_in_sixths(&first.number);
                let arc = match sixths {
                    Some(sixths) => Number::Exact(Exact::new(RBig::from_parts(sixths.into(), 6u8.into()), 1)),
                    None => Number::Rounded(precise::angle(&x, &precise::square_root(&cosine).0)),
                };
                let quarter = Number::Exact(Exact::new(RBig::from_parts(1.into(), 2u8.into()), 1));
                plain(if function == Asin { arc } else { quarter.plus(&arc.negative()) })
            }
            Atan | Atan2 => {
                let abscissa = if function == Atan { RBig::ONE } else { values[1].number.digits() };
                plain(arc_of_point(&x, &abscissa))
            }
        }
    }
}

fn square_root(of: &Number) -> Number {
    match of {
        Number::Exact(value) if value.pi % 2 == 0 => match precise::square_root(&value.rational) {
            (root, true) => Number::Exact(Exact::new(root, value.pi / 2)),
            _ => Number::Rounded(precise::square_root(&value.digits()).0),
        },
        other => Number::Rounded(precise::square_root(&precise::short(&other.digits())).0),
    }
}

/// How many twelfths of a half turn an angle is, if a whole number, modulo a turn.
fn twelfths(angle: &Exact) -> Option<i64> {
    if angle.is_zero() {
        return Some(0);
    }
    let count = &angle.rational * RBig::from(12);
    (angle.pi == 1 && count.is_int())
        .then(|| count.numerator() % IBig::from(24))
        .and_then(|count| i64::try_from(count).ok())
}

/// The sine of an angle and so many quarter turns; exact where it is a fraction (Niven).
fn sine(angle: &Number, quarters: i64) -> Number {
    if let Number::Exact(angle) = angle
        && let Some(count) = twelfths(angle)
    {
        let halves = match (count + 6 * quarters).rem_euclid(24) {
            0 | 12 => Some(0),
            2 | 10 => Some(1),
            6 => Some(2),
            14 | 22 => Some(-1),
            18 => Some(-2),
            _ => None,
        };
        if let Some(halves) = halves {
            return Number::Exact(Exact::from_ratio(halves, 2));
        }
    }
    let both = precise::sine_cosine(&angle.digits());
    Number::Rounded(both[usize::from(quarters == 1)].clone())
}

/// The tangent where it is whole.
fn tangent(angle: &Number) -> Option<Number> {
    let Number::Exact(angle) = angle else { return None };
    let value = match twelfths(angle)?.rem_euclid(12) {
        0 => 0,
        3 => 1,
        9 => -1,
        _ => return None,
    };
    Some(Number::Exact(Exact::from_integer(value)))
}

/// How many sixths of a half turn the arc sine is, if a whole number.
fn arc_in_sixths(sine: &Number) -> Option<i64> {
    let Number::Exact(sine) = sine else { return None };
    let halves = &sine.rational * RBig::from(2);
    if sine.pi != 0 || !halves.is_int() {
        return None;
    }
    match i64::try_from(halves.numerator().clone()).ok()? {
        0 => Some(0),
        1 => Some(1),
        2 => Some(3),
        -1 => Some(-1),
        -2 => Some(-3),
        _ => None,
    }
}

/// The angle of a point; exact where it is a multiple of an eighth of a turn.
fn arc_of_point(y: &RBig, x: &RBig) -> Number {
    let (ay, ax) = (y.clone().abs(), x.clone().abs());
    if !(y.is_zero() || x.is_zero() || ay == ax) {
        return Number::Rounded(precise::angle(y, x));
    }
    let quarters = match () {
        () if y.is_zero() => 0,
        () if x.is_zero() => 2,
        () => 1,
    };
    let quarters = if *x < RBig::ZERO { 4 - quarters } else { quarters };
    let quarters = if *y < RBig::ZERO { -quarters } else { quarters };
    Number::Exact(Exact::new(RBig::from_parts(quarters.into(), 4u8.into()), 1))
}
