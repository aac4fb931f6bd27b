//! Values as expressions: `"m_rack * r_pinion^2"`, `"200 N * 7.5 mm"`, `"sqrt(c / J)"`.

mod dimensions;
mod evaluate;
mod reading;
#[cfg(test)]
#[path = "../../../tests/unit/units/expression.rs"]
mod tests;
mod tree;
mod truth;

use std::ops::Range;

pub use self::evaluate::{Restriction, Value};
pub use self::tree::{Called, Kind, Node};
use super::quantity::check_range;
use super::{Dimension, Exact, UnitError};

/// An expression of numbers with units, names and functions, with what each part of it is in the text.
///
/// `+ - * / ^`, parentheses, `pi`, and the functions `sqrt sin cos tan asin acos atan atan2 exp ln abs min max sign` and `if(a < b, x, y)`.
/// A condition is 1 where it is true, else 0: comparisons (`< <= > >= == !=`) joined by `and`, `or` and `not`, where any other number stands for
/// whether it is above a half.
/// A number takes the units after it, which bind closer than `*` and `/`: `2 pi / 60 s` divides by a minute, `100 N m/rad` is one
/// stiffness. A fraction without spaces is a number: `51/50`, `1/2 s`; after a `/` it is not, `a/2/3` goes from left to right. A power
/// binds before all of these: `4 pi^2` is 4·π², `3/2^2 m` is 0.75 m, `x^1/2` the half of x; that of a unit is the unit's, `3 kg^2`. Anything but a number
/// or a unit after one is a name: `m_rack`, the key of an element `wheel.inertia`, a signal `arm.phi`; within `'...'` a name may contain other letters.
///
/// ```
/// use kardan_math::units::{Dimension, Exact, Expression, parse_quantity};
/// let read = Expression::parse("m_rack * r_pinion^2")?;
/// assert_eq!(read.names(), ["m_rack", "r_pinion"]);
/// let value = read.evaluate(&|name| parse_quantity(if name == "m_rack" { "3 kg" } else { "7 mm" }).ok())?;
/// assert_eq!((value.value, value.dimension, value.exact), (Exact::from_ratio(147, 1_000_000), Dimension::INERTIA, true));
/// # Ok::<(), kardan_math::units::UnitError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    text: String,
    /// The outermost part.
    pub root: Node,
}

/// The value of an expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// In SI units.
    pub value: Exact,
    /// Its dimension; angles are not counted among the results of functions and powers.
    pub dimension: Dimension,
    /// Whether that is the number itself; else it is the nearest one of floating point.
    pub exact: bool,
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// An invalid expression, with its place; unknown units and functions; a text longer than 1024 bytes (16384 of a law) or with more than 64 parentheses inside
    /// each other.
    pub fn parse(text: &str) -> Result<Self, UnitError> {
        Self::read(text, false)
    }

    /// Reads an expression of time and signals: `t` is the time, and may follow its factor, `2 pi t / 1 s`. A tonne is `1000 kg` there.
    /// A call by a name that is not a function is a table.
    ///
    /// ```
    /// use kardan_math::units::Expression;
    /// let law = Expression::parse_law("10 deg * sin(2 pi t / 1 s) - arm.phi")?;
    /// assert_eq!(law.names(), ["t", "arm.phi"]);
    /// # Ok::<(), kardan_math::units::UnitError>(())
    /// ```
    ///
    /// # Errors
    /// As of [`parse`](Self::parse).
    pub fn parse_law(text: &str) -> Result<Self, UnitError> {
        Self::read(text, true)
    }

    fn read(text: &str, of_time: bool) -> Result<Self, UnitError> {
        let root = reading::read(text, of_time)?;
        Ok(Self { text: text.to_string(), root })
    }

    /// As it is written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The names in it, in the order in which they first appear.
    pub fn names(&self) -> Vec<&str> {
        self.root.names()
    }

    /// The names of the tables in it, in the order in which they first appear.
    pub fn tables(&self) -> Vec<&str> {
        self.root.tables()
    }

    /// Its place in the text, also of a part of an expression.
    pub fn span(&self) -> Range<usize> {
        self.root.span.clone()
    }

    /// The first place of a name.
    pub fn place_of(&self, name: &str) -> Option<Range<usize>> {
        let named = |node: &&Node| matches!(&node.kind, Kind::Name(other) if other == name);
        self.root.nodes(true).find(named).map(|node| node.span.clone())
    }

    /// Whether it gives turns where radians are expected, or the reverse: a frequency for an angular velocity or an angular velocity for a
    /// frequency, of something that is one, without a `pi` for the conversion. `of` gives dimensions of names.
    pub fn mixes_turns(&self, expected: Dimension, found: Dimension, of: &dyn Fn(&str) -> Option<Dimension>) -> bool {
        let pair = [Dimension::ANGULAR_VELOCITY, Dimension::FREQUENCY];
        if expected == found || !pair.contains(&expected) || !pair.contains(&found) {
            return false;
        }
        let is_word = |word: &str| word == "pi" || word == "π";
        let has_pi =
            self.text.split(|c: char| !(c.is_alphabetic() || c == '_')).any(is_word) || self.text.contains('π');
        let leaf = |node: &Node| match &node.kind {
            Kind::Literal(_, dimension) => *dimension == found,
            Kind::Name(name) => of(name) == Some(found),
            _ => false,
        };
        !has_pi && self.root.nodes(true).any(leaf)
    }

    /// The parts that something is divided by; not those within `if(...)`, which may guard against zero.
    pub fn divisors(&self) -> Vec<Self> {
        self.root.divisors().map(|root| self.part(root)).collect()
    }

    /// The parts with a domain condition of a function; not those within `if(...)`, which may guard them.
    pub fn restricted(&self) -> Vec<(Self, Restriction)> {
        self.root.restricted().map(|(root, restriction)| (self.part(root), restriction)).collect()
    }

    /// Where it takes the sign of an expression of one of these names, and of which.
    pub fn signs_of(&self, is: &dyn Fn(&str) -> bool) -> Vec<(Range<usize>, Self)> {
        let mut parts = Vec::new();
        self.root.all(&mut parts);
        let sign = |node: &Node| match &node.kind {
            Kind::Call(Called::Sign, of) => {
                node.names().into_iter().any(is).then(|| (node.span.clone(), self.part(&of[0])))
            }
            _ => None,
        };
        parts.into_iter().filter_map(sign).collect()
    }

    /// Its parts with a kink or a jump, inner ones first, with the message where.
    pub fn kinks(&self) -> Vec<(Self, String)> {
        let mut parts = Vec::new();
        self.root.all(&mut parts);
        let kink = |node: &Node| {
            let reason = match &node.kind {
                Kind::Call(Called::Abs, _) => "`abs` has a kink where this is zero".to_string(),
                Kind::Call(Called::Sign, _) => "`sign` jumps where this is zero".to_string(),
                Kind::Call(Called::Min, _) => "`min` has a kink where both are equal".to_string(),
                Kind::Call(Called::Max, _) => "`max` has a kink where both are equal".to_string(),
                Kind::If(..) => "`if` may have a kink or a jump where the comparison changes".to_string(),
                Kind::Lookup(table, _) => format!("table `{table}` has kinks at its points or at its ends"),
                _ => return None,
            };
            Some((self.part(node), reason))
        };
        parts.into_iter().filter_map(kink).collect()
    }

    fn part(&self, root: &Node) -> Self {
        Self { text: self.text.clone(), root: root.clone() }
    }

    /// Whether a part of it that does not vary, with the names that are numbers, is no fraction times a power of π: `sqrt(2)`.
    pub fn rounds(&self, lookup: &dyn Fn(&str) -> Option<(Exact, Dimension)>) -> bool {
        self.root.rounds(lookup)
    }

    /// Whether it may jump while its names change continuously.
    pub fn jumps(&self) -> bool {
        let jumps =
            |node: &Node| matches!(node.kind, Kind::If(..) | Kind::Call(Called::Sign | Called::Atan2 | Called::Tan, _));
        self.root.nodes(true).any(jumps)
    }

    /// The value, with names looked up; exact as long as it is a fraction times a power of π, else rounded once.
    ///
    /// # Errors
    /// Names that are unknown, dimensions that do not fit, divisions by zero and functions without a value, with the place.
    pub fn evaluate(&self, lookup: &dyn Fn(&str) -> Option<(Exact, Dimension)>) -> Result<Evaluated, UnitError> {
        let Value { number, dimension } = self.root.value(lookup)?;
        let (value, exact) = number.rounded_once().ok_or_else(|| {
            let message = "the value exceeds the floating-point range";
            UnitError::new("number::range", 0..self.text.len(), message).help("check the exponents")
        })?;
        check_range(&value, &self.text, 0..self.text.len())?;
        Ok(Evaluated { value, dimension, exact })
    }
}

impl Dimension {
    /// The same but for angles: a ratio of two lengths has none.
    pub fn is_like(&self, other: &Self) -> bool {
        self.exponents == other.exponents
    }

    /// A value of another dimension as one of this: a frequency as the time from one to the next, and the other way round; volts for each
    /// radian per second as newton metres for each ampere.
    ///
    /// ```
    /// use kardan_math::units::{Dimension, Exact, parse_quantity};
    /// let (rate, dimension) = parse_quantity("1 kHz")?;
    /// assert_eq!(Dimension::TIME.of_other(&rate, &dimension), Some(Exact::from_ratio(1, 1000)));
    /// # Ok::<(), kardan_math::units::UnitError>(())
    /// ```
    pub fn of_other(&self, value: &Exact, dimension: &Self) -> Option<Exact> {
        let fits = [(Self::TIME, Self::FREQUENCY), (Self::FREQUENCY, Self::TIME)].contains(&(*self, *dimension));
        let back_emf = Self::TORQUE_CONSTANT.times(&Self::ANGLE, -1);
        if *self == Self::TORQUE_CONSTANT && Some(*dimension) == back_emf {
            return Some(value.clone());
        }
        if fits { value.recip() } else { None }
    }
}
