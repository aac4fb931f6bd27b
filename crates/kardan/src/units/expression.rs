//! Values as expressions: `"m_rack * r_pinion^2"`, `"200 N * 7.5 mm"`, `"sqrt(c / J)"`.

use std::cmp::Ordering;
use std::ops::Range;

use dashu_int::IBig;
use dashu_int::ops::{Abs, BitTest};
use dashu_ratio::RBig;

use super::catalogue::{find_unit, unit_help};
use super::quantity::{check_length, check_range};
use super::reader::Reader;
use super::{Dimension, Exact, UnitError, precise};

/// The longest expression, in bytes.
const TEXT_LIMIT: usize = 1024;
/// Parentheses inside each other.
const DEPTH_LIMIT: usize = 64;
/// The largest size of a power of π.
const PI_LIMIT: i64 = 1000;
/// The largest size of a power.
const POWER_LIMIT: i32 = 64;

/// An expression of numbers with units, names and functions, with what each part of it is in the text.
///
/// `+ - * / ^`, parentheses, `pi`, and the functions `sqrt sin cos tan asin acos atan atan2 exp ln abs min max sign` and `if(a < b, x, y)`.
/// A number takes the units behind it, which bind closer than `*` and `/`: `2 pi / 60 s` divides by a minute, `100 N m/rad` is one
/// stiffness. A fraction without spaces is a number: `51/50`, `1/2 s`. What is no number or unit behind one is a name.
///
/// ```
/// use kardan::units::{Dimension, Exact, Expression, parse_quantity};
/// let read = Expression::parse("m_rack * r_pinion^2")?;
/// assert_eq!(read.names(), ["m_rack", "r_pinion"]);
/// let value = read.evaluate(&|name| parse_quantity(if name == "m_rack" { "3 kg" } else { "7 mm" }).ok())?;
/// assert_eq!((value.value, value.dimension, value.exact), (Exact::from_ratio(147, 1_000_000), Dimension::INERTIA, true));
/// # Ok::<(), kardan::units::UnitError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    text: String,
    root: Node,
}

/// What an expression gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// In SI units.
    pub value: Exact,
    /// Its dimension; angles are not counted among the results of functions and powers.
    pub dimension: Dimension,
    /// Whether that is the number itself; else it is the nearest one of floating point.
    pub exact: bool,
}

#[derive(Debug, Clone, PartialEq)]
struct Node {
    span: Range<usize>,
    kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Literal(Exact, Dimension),
    Name(String),
    Negative(Box<Node>),
    Binary(char, Box<[Node; 2]>),
    Call(Function, Vec<Node>),
    /// A comparison, and what holds if it is so or not.
    If(&'static str, Box<[Node; 4]>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Function {
    Sqrt,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Atan2,
    Exp,
    Ln,
    Abs,
    Min,
    Max,
    Sign,
}

const FUNCTIONS: [(&str, Function, Range<usize>); 14] = [
    ("sqrt", Function::Sqrt, 1..2),
    ("sin", Function::Sin, 1..2),
    ("cos", Function::Cos, 1..2),
    ("tan", Function::Tan, 1..2),
    ("asin", Function::Asin, 1..2),
    ("acos", Function::Acos, 1..2),
    ("atan", Function::Atan, 1..2),
    ("atan2", Function::Atan2, 2..3),
    ("exp", Function::Exp, 1..2),
    ("ln", Function::Ln, 1..2),
    ("abs", Function::Abs, 1..2),
    ("min", Function::Min, 2..usize::MAX),
    ("max", Function::Max, 2..usize::MAX),
    ("sign", Function::Sign, 1..2),
];

const COMPARISONS: [&str; 6] = ["<=", ">=", "==", "!=", "<", ">"];

fn syntax(span: Range<usize>, message: impl Into<String>, help: impl Into<String>) -> UnitError {
    UnitError::new("expression::syntax", span, message).help(help)
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// What is no expression, with its place; unknown units and functions; a text longer than 1024 bytes or with more than 64 parentheses inside
    /// each other.
    pub fn parse(text: &str) -> Result<Self, UnitError> {
        check_length(text, TEXT_LIMIT)?;
        let mut parser = Parser { reader: Reader { text, at: 0 }, depth: 0 };
        let root = parser.sum()?;
        parser.reader.spaces();
        if parser.reader.peek().is_some() {
            let (here, found) = (parser.reader.here(), parser.reader.found());
            let help = match parser.at_unit() {
                true => "a unit stands behind a number: write `sin(beta) * 1 N m`",
                false => "write `*` between two factors",
            };
            return Err(syntax(here, format!("unexpected {found} in an expression"), help));
        }
        Ok(Self { text: text.to_string(), root })
    }

    /// As it is written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The names in it, in the order in which they first appear.
    pub fn names(&self) -> Vec<&str> {
        let mut out = Vec::new();
        self.root.names(&mut out);
        out
    }

    /// The value, with names looked up; exact as long as it is a fraction times a power of π, else rounded once.
    ///
    /// # Errors
    /// Names that are unknown, dimensions that do not fit, divisions by zero and functions without a value, with the place.
    pub fn evaluate(&self, lookup: &dyn Fn(&str) -> Option<(Exact, Dimension)>) -> Result<Evaluated, UnitError> {
        let Value { number, dimension } = self.root.value(lookup)?;
        let (value, exact) = match number {
            Number::Exact(value) => (value, true),
            Number::Rounded(value) => {
                let nearest = precise::nearest(&value);
                let exact = RBig::try_from(nearest).ok();
                let zero = nearest == 0.0 && !value.is_zero();
                let Some(exact) = exact.filter(|_| !zero) else {
                    let message = "the value is beyond the numbers of floating point";
                    return Err(
                        UnitError::new("number::range", 0..self.text.len(), message).help("check the exponents")
                    );
                };
                (Exact::new(exact, 0), false)
            }
        };
        check_range(&value, &self.text, 0..self.text.len())?;
        Ok(Evaluated { value, dimension, exact })
    }
}

impl Dimension {
    /// The same but for angles: a ratio of two lengths has none.
    pub fn is_like(&self, other: &Self) -> bool {
        self.exponents == other.exponents
    }

    /// A value of another dimension as one of this: a frequency as the time from one to the next, and the other way round.
    ///
    /// ```
    /// use kardan::units::{Dimension, Exact, parse_quantity};
    /// let (rate, dimension) = parse_quantity("1 kHz")?;
    /// assert_eq!(Dimension::TIME.period(&rate, &dimension), Some(Exact::from_ratio(1, 1000)));
    /// # Ok::<(), kardan::units::UnitError>(())
    /// ```
    pub fn period(&self, value: &Exact, dimension: &Self) -> Option<Exact> {
        const FREQUENCY: Dimension = Dimension::mechanical(0, 0, -1, 0);
        let fits = [(Self::TIME, FREQUENCY), (FREQUENCY, Self::TIME)].contains(&(*self, *dimension));
        if fits { value.recip() } else { None }
    }
}

struct Parser<'t> {
    reader: Reader<'t>,
    depth: usize,
}

impl Parser<'_> {
    fn binary(operator: char, left: Node, right: Node) -> Node {
        Node { span: left.span.start..right.span.end, kind: Kind::Binary(operator, Box::new([left, right])) }
    }

    fn sum(&mut self) -> Result<Node, UnitError> {
        self.depth += 1;
        if self.depth > DEPTH_LIMIT {
            let what = format!("more than {DEPTH_LIMIT} parentheses are inside each other");
            return Err(syntax(self.reader.here(), what, "give a part of it a name under `[parameters]`"));
        }
        let mut left = self.product()?;
        loop {
            self.reader.spaces();
            let operator = match self.reader.peek() {
                Some('+') => '+',
                Some('-' | '−') => '-',
                _ => break,
            };
            self.reader.sign();
            left = Self::binary(operator, left, self.product()?);
        }
        self.depth -= 1;
        Ok(left)
    }

    fn product(&mut self) -> Result<Node, UnitError> {
        let mut left = self.signed()?;
        loop {
            self.reader.spaces();
            let operator = if self.reader.eat_times() {
                '*'
            } else if self.reader.eat('/') {
                '/'
            } else {
                return Ok(left);
            };
            left = Self::binary(operator, left, self.signed()?);
        }
    }

    fn signed(&mut self) -> Result<Node, UnitError> {
        self.reader.spaces();
        let start = self.reader.at;
        if matches!(self.reader.peek(), Some('-' | '−' | '+')) {
            self.depth += 1;
            if self.depth > DEPTH_LIMIT {
                return Err(syntax(start..start + 1, "too many signs", "write one sign"));
            }
            let negative = self.reader.sign();
            let inner = self.signed()?;
            self.depth -= 1;
            let span = start..inner.span.end;
            return Ok(if negative { Node { span, kind: Kind::Negative(Box::new(inner)) } } else { inner });
        }
        let base = self.atom()?;
        self.reader.spaces();
        if self.reader.eat('^') || self.reader.rest().starts_with("**") && self.reader.eat('*') && self.reader.eat('*')
        {
            // From the right: a^b^c is a^(b^c).
            self.depth += 1;
            if self.depth > DEPTH_LIMIT {
                return Err(syntax(self.reader.here(), "too many powers", "write parentheses"));
            }
            let power = self.signed()?;
            self.depth -= 1;
            return Ok(Self::binary('^', base, power));
        }
        Ok(base)
    }

    fn atom(&mut self) -> Result<Node, UnitError> {
        let reader = &mut self.reader;
        let start = reader.at;
        if reader.eat('(') {
            let inner = self.sum()?;
            self.close(start)?;
            return Ok(Node { span: start..self.reader.at, ..inner });
        }
        if let Some(number) = self.number()? {
            let (factor, dimension) = self.units()?;
            let kind = Kind::Literal(&number * &factor, dimension);
            return Ok(Node { span: start..self.reader.at, kind });
        }
        let name = self.reader.run(|c| c.is_ascii_alphanumeric() || c == '_').to_string();
        if name.is_empty() {
            let message = format!("expected a number, a name or `(`, found {}", self.reader.found());
            return Err(syntax(self.reader.here(), message, "write it like `m_rack * r_pinion^2` or `200 N * 7.5 mm`"));
        }
        let span = start..self.reader.at;
        if self.reader.eat('(') {
            return self.call(&name, span);
        }
        Ok(Node { span, kind: Kind::Name(name) })
    }

    /// A decimal, π, or a product or fraction of these without spaces around `/`.
    fn number(&mut self) -> Result<Option<Exact>, UnitError> {
        let Some(mut number) = self.reader.factor_of_number()? else { return Ok(None) };
        loop {
            let start = self.reader.at;
            if self.reader.eat('/') {
                if let Some(divisor) = self.reader.factor_of_number()? {
                    number = number
                        .div(&divisor)
                        .ok_or_else(|| syntax(start..self.reader.at, "division by zero", "divide by another number"))?;
                    continue;
                }
            } else {
                self.reader.spaces();
                if self.reader.eat_pi() {
                    number = &number * &Exact::new(RBig::ONE, 1);
                    continue;
                }
            }
            self.reader.at = start;
            return Ok(Some(number));
        }
    }

    /// Whether a unit is next, and no name or function.
    fn at_unit(&self) -> bool {
        let rest = self.reader.rest();
        let end = rest.find(|c: char| !(c.is_alphabetic() || c == '°' || c == '%')).unwrap_or(rest.len());
        let goes_on = rest[end..].starts_with(|c: char| c == '_' || c == '(' || c.is_ascii_digit());
        !goes_on && find_unit(&rest[..end]).is_some()
    }

    /// Units behind a number: with spaces between, and with `*` and `/` without spaces around.
    fn units(&mut self) -> Result<(Exact, Dimension), UnitError> {
        let start = self.reader.at;
        let mut product = (Exact::one(), Dimension::NONE);
        let (mut divided, mut first) = (false, true);
        loop {
            let before = self.reader.at;
            self.reader.spaces();
            let tight = self.reader.at == before;
            let (divides, times) = match () {
                () if tight && !first && self.reader.eat('/') => (true, false),
                () if tight && !first && self.reader.eat_times() => (false, true),
                () => (false, false),
            };
            let group = divides && self.reader.rest().starts_with('(');
            if !group && !self.at_unit() {
                if first && self.reader.peek().is_some_and(|c| c.is_alphabetic() || c == '°' || c == '%') {
                    let at = self.reader.at;
                    let name = self.reader.run(|c| c.is_alphanumeric() || "°%_".contains(c));
                    return Err(UnitError::new("unit::unknown", at..self.reader.at, format!("unknown unit `{name}`"))
                        .help(format!("{}; or write `*` before the name of a parameter", unit_help(name))));
                }
                self.reader.at = before;
                return Ok(product);
            }
            let at = self.reader.at;
            // A parenthesis may hold something else than units: then it is an operand.
            let read = if group { self.reader.factor().ok() } else { Some(self.unit(at)?) };
            let Some((factor, dimension)) = read else {
                self.reader.at = before;
                return Ok(product);
            };
            if divided && !divides && !times {
                let last = &self.reader.text[at..self.reader.at];
                let message = format!("it is not clear whether `/` also divides by `{last}`");
                return Err(UnitError::new("unit::syntax", at..self.reader.at, message)
                    .help(format!("write `*{last}` without spaces, or parentheses")));
            }
            divided |= divides;
            let size = if divides { factor.pow(-1) } else { Some(factor) };
            let next =
                size.map(|size| &product.0 * &size).zip(product.1.times(&dimension, if divides { -1 } else { 1 }));
            product = next.ok_or_else(|| self.reader.too_high(start))?;
            first = false;
        }
    }

    /// The unit that is next, with its power.
    fn unit(&mut self, at: usize) -> Result<(Exact, Dimension), UnitError> {
        let name = self.reader.run(|c| c.is_alphabetic() || c == '°' || c == '%');
        let Some((factor, dimension)) = find_unit(name) else { return Ok((Exact::one(), Dimension::NONE)) };
        let power = self.reader.power(at)?;
        let whole = factor.pow(power).zip(Dimension::NONE.times(&dimension, power));
        whole.ok_or_else(|| self.reader.too_high(at))
    }

    fn close(&mut self, start: usize) -> Result<(), UnitError> {
        self.reader.spaces();
        if self.reader.eat(')') {
            return Ok(());
        }
        let span = start..self.reader.at;
        let found = self.reader.found();
        Err(syntax(span, format!("a `(` without its `)`: found {found}"), "close it"))
    }

    fn call(&mut self, name: &str, span: Range<usize>) -> Result<Node, UnitError> {
        if name == "if" {
            return self.condition(span);
        }
        let Some((_, function, count)) = FUNCTIONS.iter().find(|(known, ..)| *known == name) else {
            let known: Vec<&str> = FUNCTIONS.iter().map(|(known, ..)| *known).chain(["if"]).collect();
            let help = match crate::names::nearest(name, known.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("there are {}", known.join(", ")),
            };
            return Err(UnitError::new("expression::function", span, format!("unknown function `{name}`")).help(help));
        };
        let mut arguments = vec![self.sum()?];
        loop {
            self.reader.spaces();
            if !self.reader.eat(',') {
                break;
            }
            arguments.push(self.sum()?);
        }
        self.close(span.start)?;
        let span = span.start..self.reader.at;
        if !count.contains(&arguments.len()) {
            let wanted = match (count.start, count.end) {
                (1, _) => "one value".to_string(),
                (least, usize::MAX) => format!("at least {least} values"),
                (exactly, _) => format!("{exactly} values"),
            };
            let message = format!("`{name}` takes {wanted}, not {}", arguments.len());
            return Err(syntax(span, message, "separate values by commas"));
        }
        Ok(Node { span, kind: Kind::Call(*function, arguments) })
    }

    fn condition(&mut self, span: Range<usize>) -> Result<Node, UnitError> {
        const HELP: &str = "write it like `if(a < b, x, y)`";
        let left = self.sum()?;
        self.reader.spaces();
        let Some(comparison) = COMPARISONS.into_iter().find(|sign| self.reader.rest().starts_with(sign)) else {
            let message = format!("expected a comparison, found {}", self.reader.found());
            return Err(syntax(self.reader.here(), message, HELP));
        };
        self.reader.at += comparison.len();
        let right = self.sum()?;
        let mut comma = || {
            self.reader.spaces();
            let found = self.reader.found();
            let here = self.reader.here();
            if self.reader.eat(',') {
                self.sum()
            } else {
                Err(syntax(here, format!("expected `,`, found {found}"), HELP))
            }
        };
        let (yes, no) = (comma()?, comma()?);
        self.close(span.start)?;
        Ok(Node { span: span.start..self.reader.at, kind: Kind::If(comparison, Box::new([left, right, yes, no])) })
    }
}

/// A number on the way to a value.
#[derive(Clone)]
enum Number {
    Exact(Exact),
    /// To 256 binary digits.
    Rounded(RBig),
}

struct Value {
    number: Number,
    dimension: Dimension,
}

impl Number {
    fn digits(&self) -> RBig {
        match self {
            Self::Exact(value) => value.digits(),
            Self::Rounded(value) => value.clone(),
        }
    }

    fn signum(&self) -> i32 {
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
            (Self::Exact(a), Self::Exact(b)) if a.is_zero() || b.is_zero() || a.pi == b.pi => {
                let pi = if a.is_zero() { b.pi } else { a.pi };
                Self::Exact(Exact::new(&a.rational + &b.rational, pi))
            }
            _ => Self::rounded(&(self.digits() + other.digits())),
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
    fn names<'n>(&'n self, out: &mut Vec<&'n str>) {
        match &self.kind {
            Kind::Literal(..) => {}
            Kind::Name(name) if out.contains(&name.as_str()) => {}
            Kind::Name(name) => out.push(name),
            Kind::Negative(inner) => inner.names(out),
            Kind::Binary(_, parts) => parts.iter().for_each(|part| part.names(out)),
            Kind::Call(_, parts) => parts.iter().for_each(|part| part.names(out)),
            Kind::If(_, parts) => parts.iter().for_each(|part| part.names(out)),
        }
    }

    fn error(&self, code: &'static str, message: impl Into<String>, help: impl Into<String>) -> UnitError {
        UnitError::new(code, self.span.clone(), message).help(help)
    }

    fn unlike(&self, expected: &str, found: &Dimension) -> UnitError {
        let message = format!("expected {expected}, found {}", found.noun());
        self.error("unit::dimension", message, "check the units of this part")
    }

    fn value(&self, lookup: Lookup<'_>) -> Result<Value, UnitError> {
        match &self.kind {
            Kind::Literal(value, dimension) => {
                Ok(Value { number: Number::Exact(value.clone()), dimension: *dimension })
            }
            Kind::Name(name) => match lookup(name) {
                Some((value, dimension)) => Ok(Value { number: Number::Exact(value), dimension }),
                None if find_unit(name).is_some() => Err(self.error(
                    "name::unknown",
                    format!("there is no parameter `{name}`, and a unit stands behind a number"),
                    format!("write `1 {name}`, or `/{name}` behind a unit without spaces"),
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
                        parts[1].like(&a, &b)?;
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
            Kind::If(comparison, parts) => {
                let [a, b] = [parts[0].value(lookup)?, parts[1].value(lookup)?];
                parts[1].like(&a, &b)?;
                // Both must fit, as parameters may change.
                let order = a.number.compare(&b.number);
                let holds = match *comparison {
                    "<" => order.is_lt(),
                    "<=" => order.is_le(),
                    ">" => order.is_gt(),
                    ">=" => order.is_ge(),
                    "==" => order.is_eq(),
                    _ => order.is_ne(),
                };
                parts[if holds { 2 } else { 3 }].value(lookup)
            }
        }
    }

    fn too_large(&self) -> UnitError {
        self.error("number::range", "this part is beyond all bounds", "check the exponents")
    }

    /// Whether this part, b, can be added to a or compared with it.
    fn like(&self, a: &Value, b: &Value) -> Result<(), UnitError> {
        if a.dimension.is_like(&b.dimension) { Ok(()) } else { Err(self.unlike(&a.dimension.noun(), &b.dimension)) }
    }

    fn power(&self, parts: &[Node; 2], lookup: Lookup<'_>) -> Result<Value, UnitError> {
        let [base, power] = [parts[0].value(lookup)?, parts[1].value(lookup)?];
        if !power.dimension.is_like(&Dimension::NONE) {
            return Err(parts[1].unlike("a number without a unit", &power.dimension));
        }
        let whole = match &power.number {
            Number::Exact(value) if value.pi == 0 && value.rational.is_int() => {
                i32::try_from(value.rational.numerator().clone()).ok()
            }
            _ => None,
        };
        if let Some(whole) = whole {
            if base.number.signum() == 0 && whole < 0 {
                let help = "divide by what is not zero";
                return Err(parts[0].error("expression::division", "division by zero: this part is 0", help));
            }
            let dimension = Dimension::NONE.times(&base.dimension, whole);
            let number = if whole.abs() <= POWER_LIMIT { base.number.power(whole) } else { None };
            let (number, dimension) = number.zip(dimension).ok_or_else(|| self.too_large())?;
            return Ok(Value { number, dimension });
        }
        if !base.dimension.is_like(&Dimension::NONE) {
            let message = format!(
                "only a number without a unit has a power that is not whole; this is {}",
                base.dimension.noun()
            );
            return Err(parts[0].error("unit::dimension", message, "write `sqrt(...)` for the power 1/2"));
        }
        if base.number.signum() <= 0 {
            let help = "a power that is not whole needs a number above zero";
            return Err(parts[0].error("expression::domain", "this part is not above zero", help));
        }
        let exponent = precise::logarithm(&base.number.digits()) * power.number.digits();
        self.exponential(&exponent)
    }

    fn exponential(&self, exponent: &RBig) -> Result<Value, UnitError> {
        let size = precise::nearest(exponent);
        if !(size.abs() < 1000.0) {
            return Err(self.too_large());
        }
        Ok(Value { number: Number::Rounded(precise::exponential(exponent)), dimension: Dimension::NONE })
    }

    fn call(&self, function: Function, arguments: &[Node], lookup: Lookup<'_>) -> Result<Value, UnitError> {
        use Function::{Abs, Acos, Asin, Atan, Atan2, Cos, Exp, Ln, Max, Min, Sign, Sin, Sqrt, Tan};
        let values = arguments.iter().map(|argument| argument.value(lookup)).collect::<Result<Vec<_>, _>>()?;
        let first = &values[0];
        for (argument, value) in arguments.iter().zip(&values).skip(1) {
            argument.like(first, value)?;
        }
        let without_unit = matches!(function, Sin | Cos | Tan | Asin | Acos | Atan | Exp | Ln);
        if without_unit && !first.dimension.is_like(&Dimension::NONE) {
            let expected = if matches!(function, Sin | Cos | Tan) { "an angle" } else { "a number without a unit" };
            return Err(arguments[0].unlike(expected, &first.dimension));
        }
        let domain = |message: &str| arguments[0].error("expression::domain", message, "check the value of this part");
        if matches!(function, Sin | Cos | Tan) && precise::nearest(&first.number.digits()).abs() > 1e30 {
            return Err(domain("an angle beyond all bounds"));
        }
        let plain = |number: Number| Ok(Value { number, dimension: Dimension::NONE });
        let angle = |number: Number| Ok(Value { number, dimension: Dimension::ANGLE });
        let x = first.number.digits();
        match function {
            Abs => {
                let number = if first.number.signum() < 0 { first.number.negative() } else { first.number.clone() };
                Ok(Value { number, dimension: first.dimension })
            }
            Sign => plain(Number::Exact(Exact::from_integer(first.number.signum().into()))),
            Min | Max => {
                let worse = if function == Min { Ordering::Less } else { Ordering::Greater };
                let best = values.iter().reduce(|best, value| match value.number.compare(&best.number) {
                    order if order == worse => value,
                    _ => best,
                });
                let best = best.unwrap_or(first);
                Ok(Value { number: best.number.clone(), dimension: first.dimension })
            }
            Sqrt => self.square_root(&arguments[0], first),
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
                angle(if function == Asin { arc } else { quarter.plus(&arc.negative()) })
            }
            Atan | Atan2 => {
                let other = if function == Atan { RBig::ONE } else { values[1].number.digits() };
                angle(arc_of_point(&x, &other))
            }
        }
    }

    fn square_root(&self, argument: &Node, of: &Value) -> Result<Value, UnitError> {
        if of.number.signum() < 0 {
            let help = "check the sign of this part";
            return Err(argument.error("expression::domain", "the square root of a negative number", help));
        }
        let mut dimension =
            Dimension { angle: if of.dimension.angle % 2 == 0 { of.dimension.angle / 2 } else { 0 }, ..of.dimension };
        if dimension.exponents.iter().any(|power| power % 2 != 0) {
            let message = format!("{} has no square root", of.dimension.noun());
            return Err(argument.error("unit::dimension", message, "check the units of this part"));
        }
        dimension.exponents.iter_mut().for_each(|power| *power /= 2);
        let number = match &of.number {
            Number::Exact(value) if value.pi % 2 == 0 => match precise::square_root(&value.rational) {
                (root, true) => Number::Exact(Exact::new(root, value.pi / 2)),
                _ => Number::Rounded(precise::square_root(&value.digits()).0),
            },
            other => Number::Rounded(precise::square_root(&precise::short(&other.digits())).0),
        };
        Ok(Value { number, dimension })
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::parse_quantity;
    use super::*;

    /// Parameters of the tests.
    fn parameter(name: &str) -> Option<(Exact, Dimension)> {
        let text = match name {
            "m_rack" => "2 kg",
            "r_pinion" => "7 mm",
            "c" => "200 N m/rad",
            "J" => "0.02 kg m^2",
            "v" => "3 m/s",
            "zero" => "0",
            "beta" => "30 deg",
            // Also a unit.
            "m" => "5",
            _ => return None,
        };
        parse_quantity(text).ok()
    }

    fn evaluate(text: &str) -> Result<Evaluated, UnitError> {
        Expression::parse(text)?.evaluate(&parameter)
    }

    fn like(text: &str, quantity: &str) {
        let found = evaluate(text).unwrap_or_else(|error| panic!("{text}: {error} {:?}", error.help));
        let (value, dimension) = parse_quantity(quantity).unwrap();
        assert!(found.exact, "{text}");
        assert_eq!(found.value, value, "{text}");
        assert!(found.dimension.is_like(&dimension), "{text}: {}", found.dimension.si());
    }

    #[test]
    fn fractions_and_powers_of_pi_stay_exact() {
        for (text, quantity) in [
            ("m_rack * r_pinion^2", "98 kg mm^2"),
            ("200 N * 7.5 mm", "1.5 N m"),
            ("2 pi / 60 s * 3000", "100 pi rad/s"),
            ("m_rack*(r_pinion + 3 mm)**2", "200 kg mm^2"),
            ("-(1/3 + 1/6) * 2 kg", "-1 kg"),
            ("1/2 s + 500 ms", "1 s"),
            ("100 N m/rad + c", "300 N m/rad"),
            ("3 kg m^2/s + 1 N m s", "4 N m s"),
            ("2^3^2", "512"),
            ("2^-1 * 8", "4"),
            ("-2^2", "-4"),
            ("10 N/m*2 m", "20 N"),
            ("10 N/m * m", "50 N/m"),
            ("sqrt(c / J)", "100 rad/s"),
            ("sqrt(9/4) + sin(beta) + cos(60 deg) - tan(45 deg)", "1.5"),
            ("asin(1/2) + acos(1/2) + atan(1)", "135 deg"),
            ("atan2(-1 m, -1 m)", "-135 deg"),
            ("abs(-3 N) - max(1 N, 2 N, -5 N) + min(1 N, 4 N) * sign(-2 kg)", "0 N"),
            ("if(beta < 0.6 rad, 1 kg, 2 kg) + if(2 >= 2, 1 kg, 1/zero * 1 kg)", "2 kg"),
            ("exp(0) + ln(1)", "1"),
            ("1 kHz^-1", "1 ms"),
        ] {
            like(text, quantity);
        }
    }

    /// Rounded once: the nearest number of floating point to what a longer calculation gives.
    #[test]
    fn other_values_are_rounded_once() {
        for (text, value) in [
            ("sqrt(2)", std::f64::consts::SQRT_2),
            ("exp(1)", std::f64::consts::E),
            ("ln(2)", std::f64::consts::LN_2),
            ("1 + pi - 1", std::f64::consts::PI),
            ("4 * atan(1) + 0 * exp(1)", std::f64::consts::PI),
            ("sin(1)", 0.841_470_984_807_896_5),
            ("2^0.5", std::f64::consts::SQRT_2),
            // Cancels to the last digits.
            ("sqrt(2) * sqrt(2) - 2 + 1e-60", 1e-60),
            ("(1 + 1e-40) * exp(1) / exp(1) - 1", 1e-40),
        ] {
            let found = evaluate(text).unwrap();
            assert!(!found.exact && found.value.to_f64() == value, "{text}: {}", found.value);
        }
    }

    #[test]
    fn mistakes_are_told_at_their_place() {
        for (text, message, place) in [
            ("m_rack + r_pinion", "expected a mass, found a length", "r_pinion"),
            ("2 * nothing", "there is no parameter `nothing`", "nothing"),
            ("2 * kg", "there is no parameter `kg`, and a unit stands behind a number", "kg"),
            ("1 kg / (zero * 2)", "division by zero: this part is 0", "(zero * 2)"),
            ("zero^-1", "division by zero: this part is 0", "zero"),
            ("sqrt(-4)", "the square root of a negative number", "-4"),
            ("sqrt(3 kg)", "a mass has no square root", "3 kg"),
            ("ln(zero)", "the logarithm of a number that is not above zero", "zero"),
            ("asin(2)", "the arc of a number outside of -1 to 1", "2"),
            ("tan(90 deg)", "the tangent has no value here", "90 deg"),
            ("sin(3 kg)", "expected an angle, found a mass", "3 kg"),
            ("2^(1 kg)", "expected a number without a unit, found a mass", "(1 kg)"),
            ("exp(1000)", "this part is beyond all bounds", "exp(1000)"),
            ("sine(1)", "unknown function `sine`", "sine"),
            ("2 * (3 + 4", "a `(` without its `)`: found the end of the text", "(3 + 4"),
            ("atan2(1)", "`atan2` takes 2 values, not 1", "atan2(1)"),
            ("if(1, 2, 3)", "expected a comparison, found `,`", ","),
            ("2 kg 3", "unexpected `3` in an expression", "3"),
            ("3 foo * 2", "unknown unit `foo`", "foo"),
            ("2 * ", "expected a number, a name or `(`, found the end of the text", ""),
            ("1 N/m s + v", "it is not clear whether `/` also divides by `s`", "s"),
        ] {
            let error = evaluate(text).expect_err(text);
            assert_eq!((error.message.as_str(), &text[error.span.clone()]), (message, place), "{text}");
            assert!(error.help.is_some(), "{text}");
        }
    }

    #[test]
    fn hostile_expressions_come_to_an_end() {
        for text in [
            "(".repeat(1000),
            "-".repeat(1000),
            "2^".repeat(500) + "2",
            "1+".repeat(511) + "1",
            format!("{}2{}", "(".repeat(60), ")^64".repeat(60)),
            format!("{}sqrt(2){}", "(".repeat(60), ")^64".repeat(60)),
            format!("{}pi{}", "(".repeat(60), ")^64".repeat(60)),
            format!("{}pi{}", "(".repeat(60), ")^-9".repeat(60)),
            "sin(1e300)".into(),
            "exp(".repeat(60) + "1" + &")".repeat(60),
            "if(1<2,".repeat(60),
            "9".repeat(5000),
        ] {
            let _ = evaluate(&text);
        }
    }

    proptest! {
        /// Of whole numbers, against fractions.
        #[test]
        fn sums_products_and_quotients_are_those_of_fractions(a in -50i64..50, b in -50i64..50, c in 1i64..50, d in -50i64..50) {
            let found = evaluate(&format!("({a} - {b}) / {c} + {d} * ({b} + 1/{c})")).unwrap();
            let [a, b, c, d] = [a, b, c, d].map(RBig::from);
            prop_assert_eq!(found.value.rational, (&a - &b) / &c + &d * (&b + RBig::ONE / &c));
        }

        #[test]
        fn any_text_is_read_or_refused(text in any::<String>(), near in "[-+*/^(), <>=0-9eE.a-z_ ]{0,60}") {
            for text in [text, near] {
                if let Err(error) = evaluate(&text) {
                    prop_assert!(error.span.start <= error.span.end && error.span.end <= text.len() + 1, "{}", text);
                }
            }
        }
    }
}
