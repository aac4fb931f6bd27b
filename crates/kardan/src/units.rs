//! Quantities with units, kept exactly: `"130 kg mm^2"`, `"2 N m/deg"`, `"30 deg"`.
//!
//! A decimal is a ratio of two integers and a turn is a multiple of π, so what the author of a model wrote reaches the
//! equations without rounding: [`Exact`] is that number, [`Dimension`] says what kind of quantity it is, and
//! [`parse_quantity`] reads both. The angle is a dimension of its own here, hence a stiffness in `N m` and a speed in
//! `Hz` are mistakes and not silent factors of 2π.

mod poles;
mod tolerance;
mod written;

use std::fmt;
use std::ops::{Mul, Neg, Range};

use dashu_int::ops::BitTest;
use dashu_int::{IBig, Sign, UBig};
use dashu_ratio::RBig;

pub use poles::parse_poles;
pub use tolerance::{Spread, Tolerated, parse_tolerated, tolerance_mark};
pub use written::written_quantity;

use crate::diagnostics::nearest;

/// The longest text of one quantity or number, in bytes.
const TEXT_LIMIT: usize = 256;
/// The longest text of a list of quantities, in bytes.
const LIST_TEXT_LIMIT: usize = 16_384;
/// The largest exponent of ten.
const EXPONENT_LIMIT: i64 = 400;
/// The largest power of a unit.
const POWER_LIMIT: i32 = 9;
/// The largest conversion factor while a unit is read, in bits.
const FACTOR_BITS_LIMIT: usize = 16_384;

/// What kind of quantity a number is: powers of the seven SI base units and, as a tag of its own, of the angle.
///
/// Two dimensions match only if they are equal *including* the angle: `N m` is a torque, `N m/rad` a stiffness.
///
/// ```
/// use kardan::units::Dimension;
/// assert_ne!(Dimension::TORQUE, Dimension::STIFFNESS);
/// assert_eq!(Dimension::STIFFNESS.si(), "N m/rad");
/// assert_eq!(Dimension::STIFFNESS.word(), Some("torsional stiffness"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Dimension {
    /// Powers of kg, m, s, A, K, mol, cd.
    pub exponents: [i8; 7],
    /// Power of the angle (rad, deg and rev alike).
    pub angle: i8,
}

impl Dimension {
    /// A number without a unit.
    pub const NONE: Self = Self::mechanical(0, 0, 0, 0);
    /// An angle \[rad\].
    pub const ANGLE: Self = Self::mechanical(0, 0, 0, 1);
    /// An angular velocity [rad/s].
    pub const ANGULAR_VELOCITY: Self = Self::mechanical(0, 0, -1, 1);
    /// An angular acceleration [rad/s^2].
    pub const ANGULAR_ACCELERATION: Self = Self::mechanical(0, 0, -2, 1);
    /// A torque, or an energy [N m].
    pub const TORQUE: Self = Self::mechanical(1, 2, -2, 0);
    /// The rate of a torque, or a power [N m/s].
    pub const TORQUE_RATE: Self = Self::mechanical(1, 2, -3, 0);
    /// A moment of inertia [kg m^2].
    pub const INERTIA: Self = Self::mechanical(1, 2, 0, 0);
    /// A torsional stiffness [N m/rad].
    pub const STIFFNESS: Self = Self::mechanical(1, 2, -2, -1);
    /// A torsional damping [N m s/rad].
    pub const DAMPING: Self = Self::mechanical(1, 2, -1, -1);
    /// A time \[s\].
    pub const TIME: Self = Self::mechanical(0, 0, 1, 0);
    /// An electric charge \[C\].
    pub const CHARGE: Self = Self::electrical(0, 0, 1, 1);
    /// An electric current \[A\].
    pub const CURRENT: Self = Self::electrical(0, 0, 0, 1);
    /// A voltage \[V\].
    pub const VOLTAGE: Self = Self::electrical(1, 2, -3, -1);
    /// A resistance \[Ohm\].
    pub const RESISTANCE: Self = Self::electrical(1, 2, -3, -2);
    /// An inductance \[H\].
    pub const INDUCTANCE: Self = Self::electrical(1, 2, -2, -2);
    /// A capacitance \[F\].
    pub const CAPACITANCE: Self = Self::electrical(-1, -2, 4, 2);

    /// A dimension of mass, length, time and angle.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// const FORCE: Dimension = Dimension::mechanical(1, 1, -2, 0);
    /// assert_eq!(FORCE.si(), "N");
    /// ```
    pub const fn mechanical(kg: i8, m: i8, s: i8, angle: i8) -> Self {
        Self { exponents: [kg, m, s, 0, 0, 0, 0], angle }
    }

    const fn electrical(kg: i8, m: i8, s: i8, ampere: i8) -> Self {
        Self { exponents: [kg, m, s, ampere, 0, 0, 0], angle: 0 }
    }

    fn known(&self) -> Option<&'static Known> {
        KNOWN.iter().find(|known| known.dimension == *self)
    }

    /// The field's word for it (`torsional stiffness`), if it has one.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::DAMPING.word(), Some("torsional damping"));
    /// assert_eq!(Dimension::mechanical(3, 0, 0, 0).word(), None);
    /// ```
    pub fn word(&self) -> Option<&'static str> {
        self.known().map(|known| known.word)
    }

    /// Its SI unit, written so that [`parse_quantity`] reads it; empty for a number without a unit.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::INERTIA.si(), "kg m^2");
    /// assert_eq!(Dimension::mechanical(1, 0, -2, 1).si(), "kg rad/s^2");
    /// ```
    pub fn si(&self) -> String {
        if let Some(known) = self.known() {
            return known.si.to_string();
        }
        let names = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
        let powers = self.exponents.iter().chain([&self.angle]);
        let (mut above, mut below) = (Vec::new(), String::new());
        for (name, &power) in names.iter().zip(powers) {
            let factor = match power.unsigned_abs() {
                1 => name.to_string(),
                size => format!("{name}^{size}"),
            };
            match power.signum() {
                1 => above.push(factor),
                -1 => below = below + "/" + &factor,
                _ => (),
            }
        }
        if above.is_empty() {
            above.push("1".to_string());
        }
        above.join(" ") + &below
    }

    /// A quantity of this dimension as an author writes it, in quotes.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::STIFFNESS.example(), "\"100 N m/rad\"");
    /// ```
    pub fn example(&self) -> String {
        match self.known() {
            Some(known) => format!("\"{}\"", known.example),
            None => format!("\"1 {}\"", self.si()),
        }
    }

    /// The dimension with an article, for a sentence: `an angle`, `a quantity in kg rad/s^2`.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::INERTIA.noun(), "a moment of inertia");
    /// assert_eq!(Dimension::NONE.noun(), "a number without a unit");
    /// ```
    pub fn noun(&self) -> String {
        match self.word() {
            Some(word) if word.starts_with(['a', 'e', 'i', 'o', 'u']) => format!("an {word}"),
            Some(word) => format!("a {word}"),
            None => format!("a quantity in {}", self.si()),
        }
    }

    /// What to do about a text that was read with another dimension than this one.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::STIFFNESS.hint("100 N m"), "did you mean \"100 N m/rad\"?");
    /// assert_eq!(Dimension::STIFFNESS.hint("3 kg"), "write it like \"100 N m/rad\"");
    /// ```
    pub fn hint(&self, text: &str) -> String {
        let text = text.trim();
        if *self == Self::NONE {
            return "write the number without a unit".to_string();
        }
        let bare = matches!(parse_quantity(text), Ok((_, Self::NONE)));
        let candidates = if !bare {
            vec![format!("{text}/rad")]
        } else if *self == Self::ANGLE {
            vec![format!("{text} deg"), format!("{text} rad")]
        } else {
            vec![format!("{text} {}", self.si())]
        };
        let meant: Vec<String> = candidates
            .into_iter()
            .filter(|candidate| matches!(parse_quantity(candidate), Ok((_, found)) if found == *self))
            .map(|candidate| format!("\"{candidate}\""))
            .collect();
        match (meant.is_empty(), bare) {
            (true, _) => format!("write it like {}", self.example()),
            (false, true) => format!("write the unit too: {}", meant.join(" or ")),
            (false, false) => format!("did you mean {}?", meant.join(" or ")),
        }
    }

    /// `self * other^power`, or nothing if an exponent leaves its range.
    fn times(&self, other: &Self, power: i32) -> Option<Self> {
        let add = |a: i8, b: i8| i8::try_from(i32::from(a) + i32::from(b) * power).ok();
        let mut product = Self { exponents: [0; 7], angle: add(self.angle, other.angle)? };
        for i in 0..7 {
            product.exponents[i] = add(self.exponents[i], other.exponents[i])?;
        }
        Some(product)
    }
}

/// A dimension that has a name.
struct Known {
    dimension: Dimension,
    word: &'static str,
    si: &'static str,
    example: &'static str,
}

const fn known(dimension: Dimension, word: &'static str, si: &'static str, example: &'static str) -> Known {
    Known { dimension, word, si, example }
}

static KNOWN: [Known; 22] = [
    known(Dimension::NONE, "number without a unit", "", "51/50"),
    known(Dimension::ANGLE, "angle", "rad", "30 deg"),
    known(Dimension::ANGULAR_VELOCITY, "angular velocity", "rad/s", "60 rpm"),
    known(Dimension::ANGULAR_ACCELERATION, "angular acceleration", "rad/s^2", "10 rad/s^2"),
    known(Dimension::TORQUE, "torque", "N m", "1.3 N m"),
    known(Dimension::TORQUE_RATE, "torque rate", "N m/s", "10 N m/s"),
    known(Dimension::INERTIA, "moment of inertia", "kg m^2", "130 kg mm^2"),
    known(Dimension::STIFFNESS, "torsional stiffness", "N m/rad", "100 N m/rad"),
    known(Dimension::DAMPING, "torsional damping", "N m s/rad", "0.01 N m s/rad"),
    known(Dimension::TIME, "time", "s", "2 ms"),
    known(Dimension::mechanical(0, 0, -1, 0), "frequency", "Hz", "1 kHz"),
    known(Dimension::mechanical(1, 0, 0, 0), "mass", "kg", "2 kg"),
    known(Dimension::mechanical(0, 1, 0, 0), "length", "m", "20 mm"),
    known(Dimension::mechanical(0, 1, -1, 0), "velocity", "m/s", "0.1 m/s"),
    known(Dimension::mechanical(1, 1, -2, 0), "force", "N", "10 N"),
    known(Dimension::mechanical(0, 1, 0, -1), "length per angle", "m/rad", "50 mm/rev"),
    known(Dimension::CHARGE, "charge", "C", "2 uC"),
    known(Dimension::CURRENT, "current", "A", "5 A"),
    known(Dimension::VOLTAGE, "voltage", "V", "24 V"),
    known(Dimension::RESISTANCE, "resistance", "Ohm", "0.5 Ohm"),
    known(Dimension::INDUCTANCE, "inductance", "H", "2 mH"),
    known(Dimension::CAPACITANCE, "capacitance", "F", "10 uF"),
];

/// The exact number `rational · π^pi`: `"30 deg"` is 1/6 π, `"2 N m/deg"` is 360 π⁻¹, in SI units.
///
/// Zero always has `pi == 0`, so two equal numbers of this form compare equal.
///
/// ```
/// use kardan::units::Exact;
/// let sixth = Exact::from_ratio(1, 6);
/// assert_eq!(&sixth * &Exact::from_integer(6), Exact::one());
/// assert_eq!((-&sixth).to_f64(), -1.0 / 6.0);
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Exact {
    /// The rational factor.
    pub rational: RBig,
    /// The power of π.
    pub pi: i32,
}

impl Exact {
    /// The number `rational · π^pi`.
    ///
    /// ```
    /// use kardan::units::Exact;
    /// assert_eq!(Exact::new(2.into(), 1).to_f64(), std::f64::consts::TAU);
    /// ```
    pub fn new(rational: RBig, pi: i32) -> Self {
        let pi = if rational.is_zero() { 0 } else { pi };
        Self { rational, pi }
    }

    /// Zero.
    pub fn zero() -> Self {
        Self { rational: RBig::ZERO, pi: 0 }
    }

    /// One.
    pub fn one() -> Self {
        Self { rational: RBig::ONE, pi: 0 }
    }

    /// An integer.
    pub fn from_integer(value: i64) -> Self {
        Self { rational: value.into(), pi: 0 }
    }

    /// A ratio of two integers.
    ///
    /// # Panics
    ///
    /// If the denominator is zero.
    ///
    /// ```
    /// use kardan::units::Exact;
    /// assert_eq!(Exact::from_ratio(51, -50), -&Exact::from_ratio(102, 100));
    /// ```
    pub fn from_ratio(numerator: i64, denominator: i64) -> Self {
        assert!(denominator != 0, "the denominator of {numerator}/{denominator} must not be zero");
        Self { rational: RBig::from_parts_signed(numerator.into(), denominator.into()), pi: 0 }
    }

    /// The nearest `f64`, through π to 120 digits; infinite if the number is too large, zero if it is too small.
    ///
    /// ```
    /// use kardan::units::parse_quantity;
    /// let (half_turn, _) = parse_quantity("180 deg")?;
    /// assert_eq!(half_turn.to_f64(), std::f64::consts::PI);
    /// # Ok::<(), kardan::units::UnitError>(())
    /// ```
    pub fn to_f64(&self) -> f64 {
        if self.pi == 0 {
            return self.rational.to_f64().value();
        }
        // π = numerator / 10^120: a rounding error far below that of the result, so the result is the nearest f64.
        let (words, ten) = (PI_DIGITS, UBig::from(10u8));
        let numerator = words.iter().fold(UBig::ZERO, |sum, word| sum * ten.pow(20) + UBig::from(*word));
        let pi = RBig::from_parts(numerator.into(), ten.pow(20 * (words.len() - 1)));
        (&self.rational * pi.pow(self.pi as isize)).to_f64().value()
    }

    /// Whether it is zero.
    pub fn is_zero(&self) -> bool {
        self.rational.is_zero()
    }

    /// Its sign: -1, 0 or 1.
    ///
    /// ```
    /// use kardan::units::Exact;
    /// assert_eq!(Exact::from_ratio(-1, 3).signum(), -1);
    /// ```
    pub fn signum(&self) -> i32 {
        match self.rational.sign() {
            _ if self.is_zero() => 0,
            Sign::Positive => 1,
            Sign::Negative => -1,
        }
    }

    /// The quotient, or nothing for a division by zero.
    ///
    /// ```
    /// use kardan::units::Exact;
    /// assert_eq!(Exact::from_integer(51).div(&Exact::from_integer(50)), Some(Exact::from_ratio(51, 50)));
    /// assert_eq!(Exact::one().div(&Exact::zero()), None);
    /// ```
    pub fn div(&self, divisor: &Self) -> Option<Self> {
        divisor.recip().map(|recip| self * &recip)
    }

    /// The reciprocal, or nothing for zero.
    ///
    /// ```
    /// use kardan::units::Exact;
    /// assert_eq!(Exact::from_ratio(-2, 3).recip(), Some(Exact::from_ratio(-3, 2)));
    /// ```
    pub fn recip(&self) -> Option<Self> {
        if self.is_zero() {
            return None;
        }
        let (numerator, denominator) = self.rational.clone().into_parts();
        Some(Self { rational: RBig::from_parts_signed(denominator.into(), numerator), pi: -self.pi })
    }

    /// As a rational number: exact if no π is in it, else the rational value of [`Exact::to_f64`] (zero if that is not
    /// finite).
    ///
    /// ```
    /// use kardan::units::Exact;
    /// use dashu_ratio::RBig;
    /// assert_eq!(Exact::from_ratio(1, 3).to_rational() * RBig::from(3), RBig::ONE);
    /// ```
    pub fn to_rational(&self) -> RBig {
        if self.pi == 0 { self.rational.clone() } else { RBig::try_from(self.to_f64()).unwrap_or(RBig::ZERO) }
    }

    /// `self^power` for a number other than zero, or nothing if it grows out of bounds.
    fn pow(&self, power: i32) -> Option<Self> {
        let bits = self.rational.numerator().bit_len() + self.rational.denominator().bit_len();
        if bits.saturating_mul(power.unsigned_abs() as usize) > FACTOR_BITS_LIMIT {
            return None;
        }
        Some(Self { rational: self.rational.pow(power as isize), pi: self.pi.checked_mul(power)? })
    }
}

/// π · 10^120 in groups of twenty digits.
const PI_DIGITS: [u128; 7] = [
    3,
    14159265358979323846,
    26433832795028841971,
    69399375105820974944,
    59230781640628620899,
    86280348253421170679,
    82148086513282306647,
];

impl Mul for &Exact {
    type Output = Exact;

    fn mul(self, other: &Exact) -> Exact {
        Exact::new(&self.rational * &other.rational, self.pi + other.pi)
    }
}

impl Neg for &Exact {
    type Output = Exact;

    fn neg(self) -> Exact {
        Exact { rational: -&self.rational, pi: self.pi }
    }
}

/// The shortest decimal that names the nearest `f64`.
impl fmt::Display for Exact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.to_f64();
        match value.abs() {
            size if size != 0.0 && !(1e-5..1e16).contains(&size) => write!(f, "{value:e}"),
            _ => write!(f, "{value}"),
        }
    }
}

/// What is wrong with the text of a quantity.
///
/// ```
/// use kardan::units::parse_quantity;
/// let mistake = parse_quantity("130 kq mm^2").unwrap_err();
/// assert_eq!(mistake.to_string(), "unknown unit `kq`");
/// assert_eq!((mistake.code, mistake.span), ("unit::unknown", 4..6));
/// assert_eq!(mistake.help.as_deref(), Some("did you mean `kg`?"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct UnitError {
    /// `unit::unknown`, `unit::syntax`, `number::syntax`, `number::not-finite` or `number::range`; of a tolerance also
    /// `unit::dimension`, `tolerance::syntax` or `tolerance::bounds`.
    pub code: &'static str,
    /// Byte range within the text.
    pub span: Range<usize>,
    /// What is wrong and why.
    pub message: String,
    /// What to do.
    pub help: Option<String>,
}

impl UnitError {
    fn new(code: &'static str, span: Range<usize>, message: impl Into<String>) -> Self {
        Self { code, span, message: message.into(), help: None }
    }

    fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Reads a number with its unit and gives it exactly, in SI units.
///
/// The number is a decimal, a fraction `51/50`, or either with the factor `pi`. The unit is a product of factors:
/// `N m s/rad` (a `/` divides by the one factor behind it), `N m/(rad/s)`, `kg·m²`, `rad s^-2`. After a `/` a further
/// factor needs `*`, `/` or parentheses: `N m/rad s` is refused, for it could mean either of two things.
///
/// # Errors
///
/// An unknown unit, a malformed number or unit, a division by zero, `inf` and `nan`, an exponent of ten beyond ±400, a
/// text longer than 256 bytes, or a value that is no finite `f64` (or vanishes as one).
///
/// ```
/// use kardan::units::{Dimension, Exact, parse_quantity};
/// assert_eq!(parse_quantity("60 rpm")?, parse_quantity("2 pi rad/s")?);
/// assert_eq!(parse_quantity("130 kg mm^2")?, (Exact::from_ratio(130, 1_000_000), Dimension::INERTIA));
/// # Ok::<(), kardan::units::UnitError>(())
/// ```
pub fn parse_quantity(text: &str) -> Result<(Exact, Dimension), UnitError> {
    check_length(text, TEXT_LIMIT)?;
    let mut reader = Reader { text, at: 0 };
    let number = reader.number()?;
    let (factor, dimension) = reader.unit()?;
    let value = &number * &factor;
    check_range(&value, text, 0..text.len())?;
    Ok((value, dimension))
}

/// Reads a number without a unit exactly: `0.05`, `-1e-3`, `51/50`, `pi/4`.
///
/// # Errors
///
/// As [`parse_quantity`], and if anything follows the number.
///
/// ```
/// use kardan::units::{Exact, parse_number};
/// assert_eq!(parse_number("51/50")?, Exact::from_ratio(51, 50));
/// assert_eq!(parse_number("1.02")?, Exact::from_ratio(51, 50));
/// # Ok::<(), kardan::units::UnitError>(())
/// ```
pub fn parse_number(text: &str) -> Result<Exact, UnitError> {
    check_length(text, TEXT_LIMIT)?;
    let mut reader = Reader { text, at: 0 };
    let number = reader.number()?;
    reader.spaces();
    let end = reader.at;
    if end < text.len() {
        reader.unit()?;
        return Err(UnitError::new(
            "unit::dimension",
            end..text.trim_end().len(),
            "expected a number without a unit, found a unit",
        )
        .help(format!("write \"{}\"", text[..end].trim())));
    }
    check_range(&number, text, 0..text.len())?;
    Ok(number)
}

/// Reads a list of numbers with one unit for all, and gives each with its own text.
///
/// # Errors
///
/// As [`parse_quantity`], and if the brackets are missing or nothing is between them. A text of up to 16384 bytes is
/// read.
///
/// ```
/// use kardan::units::parse_quantity_list;
/// let angles = parse_quantity_list("[0, 10, 20, 30] deg")?;
/// assert_eq!(angles.len(), 4);
/// assert_eq!(angles[1].2, "10 deg");
/// # Ok::<(), kardan::units::UnitError>(())
/// ```
pub fn parse_quantity_list(text: &str) -> Result<Vec<(Exact, Dimension, String)>, UnitError> {
    check_length(text, LIST_TEXT_LIMIT)?;
    let malformed = |span: Range<usize>, message: &str| {
        UnitError::new("number::syntax", span, message).help("write a list like \"[0, 10, 20] deg\"")
    };
    let mut reader = Reader { text, at: 0 };
    reader.spaces();
    if !reader.eat('[') {
        return Err(malformed(0..text.len(), "expected a list of numbers in brackets"));
    }
    let mut entries = Vec::new();
    loop {
        reader.spaces();
        let start = reader.at;
        if reader.eat(']') {
            break;
        }
        let number = reader.number()?;
        entries.push((number, start..reader.at));
        reader.spaces();
        let next = reader.here();
        if !reader.eat(',') && reader.peek() != Some(']') {
            return Err(malformed(next, "expected `,` or `]` after a number of the list"));
        }
    }
    if entries.is_empty() {
        return Err(malformed(0..text.len(), "the list is empty"));
    }
    let unit_text = text[reader.at..].trim();
    check_length(unit_text, TEXT_LIMIT)?;
    let (factor, dimension) = reader.unit()?;
    entries
        .into_iter()
        .map(|(number, span)| {
            let value = &number * &factor;
            check_range(&value, &text[span.clone()], span.clone())?;
            Ok((value, dimension, format!("{} {unit_text}", &text[span]).trim_end().to_string()))
        })
        .collect()
}

fn check_length(text: &str, limit: usize) -> Result<(), UnitError> {
    if text.len() > limit {
        let message = format!("the text is too long: {} bytes, where at most {limit} are read", text.len());
        return Err(UnitError::new("number::syntax", 0..text.len(), message).help("write fewer digits"));
    }
    Ok(())
}

fn check_range(value: &Exact, text: &str, span: Range<usize>) -> Result<(), UnitError> {
    let text = text.trim();
    let size = value.to_f64().abs();
    let problem = if !size.is_finite() {
        "too large: a number must be below 1.8e308 in SI units"
    } else if size == 0.0 && !value.is_zero() {
        "too small: a number other than zero must be above 5e-324 in SI units"
    } else {
        return Ok(());
    };
    Err(UnitError::new("number::range", span, format!("`{text}` is {problem}")).help("check the exponent and the unit"))
}

/// A unit of the table: `factor.0 / factor.1 · π^factor.2` SI units.
struct Unit {
    name: &'static str,
    factor: (i64, i64, i32),
    dimension: Dimension,
    prefixes: bool,
}

const fn unit(name: &'static str, factor: (i64, i64, i32), dimension: Dimension) -> Unit {
    Unit { name, factor, dimension, prefixes: false }
}

const fn with_prefixes(name: &'static str, factor: (i64, i64, i32), dimension: Dimension) -> Unit {
    Unit { name, factor, dimension, prefixes: true }
}

static UNITS: [Unit; 41] = [
    with_prefixes("g", (1, 1000, 0), Dimension::mechanical(1, 0, 0, 0)),
    unit("t", (1000, 1, 0), Dimension::mechanical(1, 0, 0, 0)),
    with_prefixes("m", (1, 1, 0), Dimension::mechanical(0, 1, 0, 0)),
    unit("in", (254, 10_000, 0), Dimension::mechanical(0, 1, 0, 0)),
    unit("inch", (254, 10_000, 0), Dimension::mechanical(0, 1, 0, 0)),
    unit("ft", (3048, 10_000, 0), Dimension::mechanical(0, 1, 0, 0)),
    with_prefixes("s", (1, 1, 0), Dimension::TIME),
    unit("min", (60, 1, 0), Dimension::TIME),
    unit("h", (3600, 1, 0), Dimension::TIME),
    with_prefixes("Hz", (1, 1, 0), Dimension::mechanical(0, 0, -1, 0)),
    with_prefixes("N", (1, 1, 0), Dimension::mechanical(1, 1, -2, 0)),
    unit("lbf", (44_482_216_152_605, 10_000_000_000_000, 0), Dimension::mechanical(1, 1, -2, 0)),
    with_prefixes("Nm", (1, 1, 0), Dimension::TORQUE),
    with_prefixes("Nms", (1, 1, 0), Dimension::mechanical(1, 2, -1, 0)),
    with_prefixes("J", (1, 1, 0), Dimension::TORQUE),
    with_prefixes("W", (1, 1, 0), Dimension::TORQUE_RATE),
    with_prefixes("rad", (1, 1, 0), Dimension::ANGLE),
    unit("deg", (1, 180, 1), Dimension::ANGLE),
    unit("°", (1, 180, 1), Dimension::ANGLE),
    unit("arcmin", (1, 10_800, 1), Dimension::ANGLE),
    unit("arcsec", (1, 648_000, 1), Dimension::ANGLE),
    unit("rev", (2, 1, 1), Dimension::ANGLE),
    unit("turn", (2, 1, 1), Dimension::ANGLE),
    unit("turns", (2, 1, 1), Dimension::ANGLE),
    unit("rpm", (2, 60, 1), Dimension::ANGULAR_VELOCITY),
    with_prefixes("C", (1, 1, 0), Dimension::CHARGE),
    with_prefixes("A", (1, 1, 0), Dimension::CURRENT),
    with_prefixes("V", (1, 1, 0), Dimension::VOLTAGE),
    with_prefixes("Ohm", (1, 1, 0), Dimension::RESISTANCE),
    with_prefixes("ohm", (1, 1, 0), Dimension::RESISTANCE),
    with_prefixes("\u{3a9}", (1, 1, 0), Dimension::RESISTANCE),
    with_prefixes("\u{2126}", (1, 1, 0), Dimension::RESISTANCE),
    with_prefixes("H", (1, 1, 0), Dimension::INDUCTANCE),
    with_prefixes("F", (1, 1, 0), Dimension::CAPACITANCE),
    with_prefixes("K", (1, 1, 0), Dimension { exponents: [0, 0, 0, 0, 1, 0, 0], angle: 0 }),
    unit("mol", (1, 1, 0), Dimension { exponents: [0, 0, 0, 0, 0, 1, 0], angle: 0 }),
    unit("cd", (1, 1, 0), Dimension { exponents: [0, 0, 0, 0, 0, 0, 1], angle: 0 }),
    // Written out.
    unit("degree", (1, 180, 1), Dimension::ANGLE),
    unit("degrees", (1, 180, 1), Dimension::ANGLE),
    unit("radian", (1, 1, 0), Dimension::ANGLE),
    unit("radians", (1, 1, 0), Dimension::ANGLE),
];

/// SI prefixes and their powers of ten.
const PREFIXES: [(char, i32); 12] = [
    ('p', -12),
    ('n', -9),
    ('u', -6),
    ('\u{b5}', -6),
    ('\u{3bc}', -6),
    ('m', -3),
    ('c', -2),
    ('d', -1),
    ('h', 2),
    ('k', 3),
    ('M', 6),
    ('G', 9),
];

/// The unit of this name, with or without a prefix.
fn find_unit(name: &str) -> Option<(Exact, Dimension)> {
    let plain = |name: &str, prefixed: bool| UNITS.iter().find(|u| u.name == name && (u.prefixes || !prefixed));
    let exact = |u: &Unit| Exact::new(Exact::from_ratio(u.factor.0, u.factor.1).rational, u.factor.2);
    if let Some(unit) = plain(name, false) {
        return Some((exact(unit), unit.dimension));
    }
    let mut letters = name.chars();
    let first = letters.next()?;
    let power = PREFIXES.iter().find(|(letter, _)| *letter == first)?.1;
    let unit = plain(letters.as_str(), true)?;
    // No one means 10^9 rad: "30 Grad" is German for 30 deg.
    if unit.name == "rad" && power > 0 {
        return None;
    }
    Some((&exact(unit) * &Exact::from_integer(10).pow(power)?, unit.dimension))
}

/// What an unknown unit may have been meant to be.
fn unit_help(name: &str) -> String {
    if let Some(one) =
        name.strip_suffix('s').filter(|one| one.to_lowercase().ends_with("ohm") && find_unit(one).is_some())
    {
        return format!("did you mean `{one}`?");
    }
    let prefixed =
        ["kg", "mm", "cm", "km", "ms", "kN", "mNm", "kNm", "mrad", "kHz", "mA", "mH", "kW", "mV", "uF", "nF", "uH"];
    let known = || UNITS.iter().map(|unit| unit.name).chain(prefixed);
    if let Some(unit) = known().find(|unit| unit.eq_ignore_ascii_case(name)) {
        return format!("did you mean `{unit}`?");
    }
    for (at, _) in name.char_indices().skip(1) {
        let (left, right) = name.split_at(at);
        if find_unit(left).is_some() && find_unit(right).is_some() {
            return format!("put a space between two units: `{left} {right}`");
        }
    }
    if name.eq_ignore_ascii_case("grad") {
        return "did you mean `deg` or `rad`?".to_string();
    }
    if name == "%" {
        return "write a percentage as a decimal: \"0.05\" for 5 %".to_string();
    }
    let length = name.chars().count();
    match nearest(name, known().filter(|unit| unit.chars().count() == length)).or_else(|| nearest(name, known())) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => "known units are kg g t m in ft s min h N lbf Nm J W Hz rpm rad deg rev V A C Ohm H F K, with prefixes"
            .into(),
    }
}

/// Reads a text from left to right.
struct Reader<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Reader<'t> {
    fn rest(&self) -> &'t str {
        &self.text[self.at..]
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    /// The span of the next character; empty at the end.
    fn here(&self) -> Range<usize> {
        self.at..self.at + self.peek().map_or(0, char::len_utf8)
    }

    /// The next character for a message.
    fn found(&self) -> String {
        self.peek().map_or("the end of the text".to_string(), |c| format!("`{c}`"))
    }

    fn eat(&mut self, expected: char) -> bool {
        let there = self.rest().starts_with(expected);
        if there {
            self.at += expected.len_utf8();
        }
        there
    }

    /// `*` (unless it starts `**`) or a raised dot.
    fn eat_times(&mut self) -> bool {
        (!self.rest().starts_with("**") && self.eat('*')) || self.eat('·') || self.eat('⋅')
    }

    fn spaces(&mut self) {
        self.at = self.text.len() - self.rest().trim_start().len();
    }

    /// Takes the longest run of characters of a kind.
    fn run(&mut self, kind: impl Fn(char) -> bool) -> &'t str {
        let rest = self.rest();
        let run = &rest[..rest.find(|c| !kind(c)).unwrap_or(rest.len())];
        self.at += run.len();
        run
    }

    /// Takes a sign; whether it is a minus.
    fn sign(&mut self) -> bool {
        let negative = self.eat('-') || self.eat('−');
        if !negative {
            self.eat('+');
        }
        negative
    }

    /// `sign? (decimal | pi) ('*'? pi | '/' decimal | '/' pi)*`
    fn number(&mut self) -> Result<Exact, UnitError> {
        self.spaces();
        let negative = self.sign();
        self.spaces();
        let mut number = match self.factor_of_number()? {
            Some(number) => number,
            None => return Err(self.no_number()),
        };
        loop {
            let start = self.at;
            self.spaces();
            if self.eat('/') {
                self.spaces();
                if let Some(divisor) = self.factor_of_number()? {
                    number = number.div(&divisor).ok_or_else(|| {
                        UnitError::new("number::syntax", start..self.at, "division by zero")
                            .help("write a fraction with a denominator other than zero")
                    })?;
                    continue;
                }
            } else {
                if self.eat_times() {
                    self.spaces();
                }
                if self.eat_pi() {
                    number = &number * &Exact::new(RBig::ONE, 1);
                    continue;
                }
            }
            self.at = start;
            return Ok(if negative { -&number } else { number });
        }
    }

    fn no_number(&mut self) -> UnitError {
        let start = self.at;
        let word = self.run(char::is_alphanumeric);
        if ["inf", "infinity", "nan"].contains(&word.to_lowercase().as_str()) {
            return UnitError::new("number::not-finite", start..self.at, format!("`{word}` is not a finite number"))
                .help("write a decimal number");
        }
        self.at = start;
        let message = format!("expected a number, found {}", self.found());
        UnitError::new("number::syntax", start..self.text.len().max(start), message)
            .help("start with a number: \"0.05\", \"-1e-3\", \"51/50\" or \"pi/4\"")
    }

    fn factor_of_number(&mut self) -> Result<Option<Exact>, UnitError> {
        if self.eat_pi() {
            return Ok(Some(Exact::new(RBig::ONE, 1)));
        }
        Ok(self.decimal()?.map(|rational| Exact { rational, pi: 0 }))
    }

    fn eat_pi(&mut self) -> bool {
        let Some(after) = self.rest().strip_prefix("pi").or_else(|| self.rest().strip_prefix('π')) else {
            return false;
        };
        let whole = !after.starts_with(|c: char| c.is_alphanumeric() || c == '_');
        if whole {
            self.at = self.text.len() - after.len();
        }
        whole
    }

    /// `digits ('.' digits)? ([eE] sign? digits)?`, or nothing if no digit is there.
    fn decimal(&mut self) -> Result<Option<RBig>, UnitError> {
        let start = self.at;
        let digit = |c: char| c.is_ascii_digit() || c == '_';
        let mut digits = if self.rest().starts_with('_') { "" } else { self.run(digit) }.to_string();
        let mut decimals = 0;
        if self.eat('.') {
            let fraction = if self.rest().starts_with('_') { "" } else { self.run(digit) };
            digits.push_str(fraction);
            decimals = fraction.chars().filter(|c| *c != '_').count() as i64;
        }
        digits.retain(|c| c != '_');
        if digits.is_empty() {
            self.at = start;
            return Ok(None);
        }
        let exponent = self.exponent()? - decimals;
        // Only digits are left, so this never fails.
        let integer = UBig::from_str_radix(&digits, 10).map_err(|error| {
            UnitError::new("number::syntax", start..self.at, format!("`{digits}` is not a number: {error}"))
        })?;
        let scale = UBig::from(10u8).pow(exponent.unsigned_abs() as usize);
        let (numerator, denominator) = if exponent < 0 { (integer, scale) } else { (integer * scale, UBig::ONE) };
        Ok(Some(RBig::from_parts(IBig::from(numerator), denominator)))
    }

    /// The exponent of ten behind `e`, or zero if none is there.
    fn exponent(&mut self) -> Result<i64, UnitError> {
        let start = self.at;
        if !(self.eat('e') || self.eat('E')) {
            return Ok(0);
        }
        let negative = self.sign();
        let digits = self.run(|c| c.is_ascii_digit());
        if digits.is_empty() {
            self.at = start;
            return Ok(0);
        }
        match digits.parse::<i64>() {
            Ok(exponent) if exponent <= EXPONENT_LIMIT => Ok(if negative { -exponent } else { exponent }),
            _ => {
                let message = format!("the exponent `{}` is out of range", &self.text[start..self.at]);
                Err(UnitError::new("number::range", start..self.at, message)
                    .help(format!("exponents of ten go from -{EXPONENT_LIMIT} to {EXPONENT_LIMIT}")))
            }
        }
    }

    /// The unit behind a number, to the end of the text; nothing there is the unit 1.
    fn unit(&mut self) -> Result<(Exact, Dimension), UnitError> {
        self.spaces();
        if self.rest().is_empty() {
            return Ok((Exact::one(), Dimension::NONE));
        }
        if self.eat_times() {
            self.spaces();
        }
        let unit = self.product()?;
        match self.peek() {
            None => Ok(unit),
            Some(_) => Err(UnitError::new("unit::syntax", self.here(), "a `)` without its `(`").help("remove it")),
        }
    }

    /// `'/'? factor (('*' | '/' | space) factor)*` up to the end or a closing parenthesis.
    fn product(&mut self) -> Result<(Exact, Dimension), UnitError> {
        let start = self.at;
        let mut product = (Exact::one(), Dimension::NONE);
        let mut divided = false;
        for first in std::iter::once(true).chain(std::iter::repeat(false)) {
            self.spaces();
            if !first && matches!(self.peek(), None | Some(')')) {
                break;
            }
            let divides = self.eat('/');
            let times = !first && !divides && self.eat_times();
            self.spaces();
            let factor_start = self.at;
            let (factor, dimension) = self.factor()?;
            if divided && !divides && !times {
                let (before, last) = (self.text[start..factor_start].trim(), &self.text[factor_start..self.at]);
                let bottom = before.rsplit('/').next().unwrap_or(before).trim();
                let top = before[..before.len() - bottom.len()].trim_end().trim_end_matches('/').trim_end();
                return Err(UnitError::new(
                    "unit::syntax",
                    factor_start..self.at,
                    format!("it is not clear whether `/` also divides by `{last}`"),
                )
                .help(format!("write `{before} * {last}` or `{top}/({bottom} {last})`")));
            }
            divided |= divides;
            let power = if divides { -1 } else { 1 };
            product = power_of(&factor, power)
                .map(|factor| &product.0 * &factor)
                .zip(product.1.times(&dimension, power))
                .ok_or_else(|| self.too_high(start))?;
        }
        Ok(product)
    }

    /// A unit, `1` or a product in parentheses, with a power.
    fn factor(&mut self) -> Result<(Exact, Dimension), UnitError> {
        let start = self.at;
        let (factor, dimension) = if self.eat('(') {
            let inner = self.product()?;
            if !self.eat(')') {
                return Err(UnitError::new("unit::syntax", start..self.at, "a `(` without its `)`").help("close it"));
            }
            inner
        } else if self.rest().starts_with(|c: char| c.is_ascii_digit()) {
            let digits = self.run(|c| c.is_ascii_digit() || c == '.');
            if digits != "1" {
                return Err(UnitError::new(
                    "unit::syntax",
                    start..self.at,
                    format!("unexpected number `{digits}` in a unit"),
                )
                .help("write digits without spaces, and powers with `^`: \"1000 kg m^2\""));
            }
            (Exact::one(), Dimension::NONE)
        } else {
            let name = self.run(|c| c.is_alphabetic() || c == '°' || c == '%' || c == '_');
            if self.rest().starts_with([',', '.']) {
                let message = format!("unexpected {} in a number", self.found());
                return Err(UnitError::new("number::syntax", self.here(), message)
                    .help("write one decimal point and no separators: \"1234.5\""));
            }
            if name.is_empty() {
                let message = format!("expected a unit, found {}", self.found());
                return Err(UnitError::new("unit::syntax", self.here(), message)
                    .help("write units like `N m s/rad`, `kg m^2` or `rad/s`"));
            }
            find_unit(name).ok_or_else(|| {
                UnitError::new("unit::unknown", start..self.at, format!("unknown unit `{name}`")).help(unit_help(name))
            })?
        };
        let power = self.power(start)?;
        power_of(&factor, power).zip(Dimension::NONE.times(&dimension, power)).ok_or_else(|| self.too_high(start))
    }

    /// `^2`, `**-1`, `²`, `⁻¹`, or nothing.
    fn power(&mut self, start: usize) -> Result<i32, UnitError> {
        const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
        let power_start = self.at;
        let raised = self.run(|c| RAISED.contains(&c) || c == '⁻' || c == '⁺');
        let digits: String = if !raised.is_empty() {
            let plain = |c| match RAISED.iter().position(|r| *r == c) {
                Some(digit) => char::from(b'0' + digit as u8),
                None if c == '⁻' => '-',
                None => '+',
            };
            raised.chars().map(plain).collect()
        } else if self.eat('^') || (self.rest().starts_with("**") && self.eat('*') && self.eat('*')) {
            self.run(|c| c.is_ascii_digit() || c == '-' || c == '+').to_string()
        } else {
            let name = &self.text[start..self.at];
            let digits = self.run(|c| c.is_ascii_digit());
            if !digits.is_empty() && name != "1" {
                return Err(UnitError::new("unit::syntax", start..self.at, format!("unexpected `{digits}` in a unit"))
                    .help(format!("write a power as `{name}^{digits}`")));
            }
            return Ok(1);
        };
        match digits.parse::<i32>() {
            Ok(power) if power.abs() <= POWER_LIMIT => Ok(power),
            _ => Err(UnitError::new(
                "unit::syntax",
                power_start..self.at.max(self.here().end),
                format!("expected a power between -{POWER_LIMIT} and {POWER_LIMIT}"),
            )
            .help("write powers like `m^2`, `m**2`, `m²` or `s^-1`")),
        }
    }

    fn too_high(&self, start: usize) -> UnitError {
        UnitError::new("unit::syntax", start..self.at, "the powers of the unit are too high")
            .help("check the exponents")
    }
}

fn power_of(factor: &Exact, power: i32) -> Option<Exact> {
    if power == 1 { Some(factor.clone()) } else { factor.pow(power) }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use proptest::prelude::*;

    use super::*;

    fn quantity(text: &str) -> (Exact, Dimension) {
        parse_quantity(text).unwrap_or_else(|e| panic!("{text}: {e} {:?}", e.help))
    }

    fn value(text: &str) -> f64 {
        quantity(text).0.to_f64()
    }

    /// The message, the text it points at, and the help.
    fn mistake(text: &str) -> String {
        let e = parse_quantity(text).expect_err(text);
        format!("{} @ `{}` ({})", e.message, &text[e.span], e.help.unwrap_or_default())
    }

    #[test]
    fn units_convert_exactly() {
        let ratio = |a, b, pi| Exact::new(Exact::from_ratio(a, b).rational, pi);
        for (text, number, dimension) in [
            ("130 kg mm^2", ratio(130, 1_000_000, 0), Dimension::INERTIA),
            ("130 kg*mm**2", ratio(130, 1_000_000, 0), Dimension::INERTIA),
            ("1.3e2kg·mm²", ratio(130, 1_000_000, 0), Dimension::INERTIA),
            ("2 N m/deg", ratio(360, 1, -1), Dimension::STIFFNESS),
            ("30 deg", ratio(1, 6, 1), Dimension::ANGLE),
            ("30°", ratio(1, 6, 1), Dimension::ANGLE),
            ("180/pi deg", ratio(1, 1, 0), Dimension::ANGLE),
            ("-pi rad", ratio(-1, 1, 1), Dimension::ANGLE),
            ("2pi/3 rad", ratio(2, 3, 1), Dimension::ANGLE),
            ("3 arcmin", ratio(3, 60 * 180, 1), Dimension::ANGLE),
            ("3 deg/s", ratio(1, 60, 1), Dimension::ANGULAR_VELOCITY),
            ("60 rpm", ratio(2, 1, 1), Dimension::ANGULAR_VELOCITY),
            ("1 rev/min", ratio(1, 30, 1), Dimension::ANGULAR_VELOCITY),
            ("5 rad s^-2", ratio(5, 1, 0), Dimension::ANGULAR_ACCELERATION),
            ("5 rad s⁻²", ratio(5, 1, 0), Dimension::ANGULAR_ACCELERATION),
            ("1.5 mNm", ratio(15, 10_000, 0), Dimension::TORQUE),
            ("1.5 kJ", ratio(1500, 1, 0), Dimension::TORQUE),
            ("100 W", ratio(100, 1, 0), Dimension::TORQUE_RATE),
            ("0.0081 N m s/rad", ratio(81, 10_000, 0), Dimension::DAMPING),
            ("0.0081 N m/(rad/s)", ratio(81, 10_000, 0), Dimension::DAMPING),
            ("0.0081 Nms/rad", ratio(81, 10_000, 0), Dimension::DAMPING),
            ("5 N m/rad/s", ratio(5, 1, 0), Dimension::mechanical(1, 2, -3, -1)),
            ("2 min", ratio(120, 1, 0), Dimension::TIME),
            ("2 µs", ratio(2, 1_000_000, 0), Dimension::TIME),
            ("1/2 s", ratio(1, 2, 0), Dimension::TIME),
            ("5 1/s", ratio(5, 1, 0), Dimension::mechanical(0, 0, -1, 0)),
            ("5/s", ratio(5, 1, 0), Dimension::mechanical(0, 0, -1, 0)),
            ("1 in", ratio(254, 10_000, 0), Dimension::mechanical(0, 1, 0, 0)),
            ("10 lbf", ratio(44_482_216_152_605, 1_000_000_000_000, 0), Dimension::mechanical(1, 1, -2, 0)),
            ("2 t", ratio(2000, 1, 0), Dimension::mechanical(1, 0, 0, 0)),
            ("3 mΩ", ratio(3, 1000, 0), quantity("1 V/A").1),
            ("4.7 kohm", ratio(4700, 1, 0), quantity("1 H/s").1),
            ("2 mH", ratio(2, 1000, 0), Dimension::INDUCTANCE),
            ("3 V s/A", ratio(3, 1, 0), Dimension::INDUCTANCE),
            ("22 µF", ratio(22, 1_000_000, 0), Dimension::CAPACITANCE),
            ("3 pF", ratio(3, 1_000_000_000_000, 0), quantity("1 C/V").1),
            ("5 mA s", ratio(5, 1000, 0), Dimension::CHARGE),
            ("6 nC", ratio(6, 1_000_000_000, 0), Dimension::CHARGE),
            ("20 mV", ratio(20, 1000, 0), quantity("1 W/A").1),
            ("2 C V", ratio(2, 1, 0), quantity("1 J").1),
            ("1_000", ratio(1000, 1, 0), Dimension::NONE),
            ("−51/50", ratio(-51, 50, 0), Dimension::NONE),
            ("0 deg", Exact::zero(), Dimension::ANGLE),
        ] {
            assert_eq!(quantity(text), (number, dimension), "{text}");
        }
    }

    #[test]
    fn the_nearest_double_is_found() {
        assert_eq!(value("180 deg"), PI);
        assert_eq!(value("60 rpm"), TAU);
        assert_eq!(value("0.1"), 0.1);
        assert_eq!(value("1e-3 s"), 0.001);
        assert_eq!(value("1.7976931348623157e308"), f64::MAX);
        assert_eq!(value("5e-324"), 5e-324);
        assert_eq!(value("2.2250738585072011e-308"), 2.225_073_858_507_201e-308);
        assert_eq!(value("30 deg"), std::f64::consts::FRAC_PI_6);
        assert_eq!(value("1 rad") / value("1 deg"), 180.0 / PI);
        assert_eq!(Exact::new(RBig::ONE, -2).to_f64(), 0.101_321_183_642_337_78);
        assert_eq!(quantity("30 deg").0.to_string(), "0.5235987755982989");
        assert_eq!(quantity("1e300").0.to_string(), "1e300");
        assert_eq!(quantity("0").0.to_string(), "0");
        assert_eq!(quantity("-2.50").0.to_string(), "-2.5");
    }

    #[test]
    fn a_rational_stands_for_the_nearest_double_of_a_multiple_of_pi() {
        let half_turn = quantity("pi rad").0.to_rational();
        assert_eq!(half_turn.to_f64().value(), PI);
        assert_eq!(quantity("1/3").0.to_rational() * RBig::from(3), RBig::ONE);
    }

    #[test]
    fn mistakes_say_where_and_what_to_do() {
        for (text, expected) in [
            ("130 kq mm^2", "unknown unit `kq` @ `kq` (did you mean `kg`?)"),
            ("5 Nmm", "unknown unit `Nmm` @ `Nmm` (put a space between two units: `N mm`)"),
            ("5 Grad", "unknown unit `Grad` @ `Grad` (did you mean `deg` or `rad`?)"),
            ("5 kOhms", "unknown unit `kOhms` @ `kOhms` (did you mean `kOhm`?)"),
            ("5 uf", "unknown unit `uf` @ `uf` (did you mean `uF`?)"),
            ("5 mh", "unknown unit `mh` @ `mh` (did you mean `mH`?)"),
            ("5 RPM", "unknown unit `RPM` @ `RPM` (did you mean `rpm`?)"),
            ("5 %", "unknown unit `%` @ `%` (write a percentage as a decimal: \"0.05\" for 5 %)"),
            ("5 kg m2", "unexpected `2` in a unit @ `m2` (write a power as `m^2`)"),
            ("0,05 kg", "unexpected `,` in a number @ `,` (write one decimal point and no separators: \"1234.5\")"),
            (
                "1 000 s",
                "unexpected number `000` in a unit @ `000` (write digits without spaces, and powers with `^`: \"1000 kg m^2\")",
            ),
            ("1/0 s", "division by zero @ `/0` (write a fraction with a denominator other than zero)"),
            ("-inf s", "`inf` is not a finite number @ `inf` (write a decimal number)"),
            ("NaN", "`NaN` is not a finite number @ `NaN` (write a decimal number)"),
            (
                "1e999999999999999999999",
                "the exponent `e999999999999999999999` is out of range @ `e999999999999999999999` (exponents of ten go from -400 to 400)",
            ),
            (
                "1e400",
                "`1e400` is too large: a number must be below 1.8e308 in SI units @ `1e400` (check the exponent and the unit)",
            ),
            (
                "1e-330 m",
                "`1e-330 m` is too small: a number other than zero must be above 5e-324 in SI units @ `1e-330 m` (check the exponent and the unit)",
            ),
            (
                "5 N m/rad s",
                "it is not clear whether `/` also divides by `s` @ `s` (write `N m/rad * s` or `N m/(rad s)`)",
            ),
            ("5 N m/(rad", "a `(` without its `)` @ `(rad` (close it)"),
            ("5 N m)", "a `)` without its `(` @ `)` (remove it)"),
            (
                "5 N m/",
                "expected a unit, found the end of the text @ `` (write units like `N m s/rad`, `kg m^2` or `rad/s`)",
            ),
            ("5 m^", "expected a power between -9 and 9 @ `^` (write powers like `m^2`, `m**2`, `m²` or `s^-1`)"),
            ("5 m^10", "expected a power between -9 and 9 @ `^10` (write powers like `m^2`, `m**2`, `m²` or `s^-1`)"),
            (
                "",
                "expected a number, found the end of the text @ `` (start with a number: \"0.05\", \"-1e-3\", \"51/50\" or \"pi/4\")",
            ),
            (
                "_1",
                "expected a number, found `_` @ `_1` (start with a number: \"0.05\", \"-1e-3\", \"51/50\" or \"pi/4\")",
            ),
        ] {
            assert_eq!(mistake(text), expected, "{text}");
        }
        let unit_on_a_number = parse_number("5 kg").unwrap_err();
        assert_eq!((unit_on_a_number.code, unit_on_a_number.span), ("unit::dimension", 2..4));
        assert_eq!(unit_on_a_number.help.as_deref(), Some("write \"5\""));
    }

    #[test]
    fn a_wrong_dimension_gets_the_nearest_right_text() {
        for (dimension, text, expected) in [
            (Dimension::STIFFNESS, "100 N m", "did you mean \"100 N m/rad\"?"),
            (Dimension::DAMPING, "0.0081 N m s", "did you mean \"0.0081 N m s/rad\"?"),
            (Dimension::INERTIA, "0.05", "write the unit too: \"0.05 kg m^2\""),
            (Dimension::ANGLE, "30", "write the unit too: \"30 deg\" or \"30 rad\""),
            (Dimension::ANGULAR_VELOCITY, "5 Hz", "write it like \"60 rpm\""),
            (Dimension::TORQUE, "5 kg", "write it like \"1.3 N m\""),
            (Dimension::NONE, "5 kg", "write the number without a unit"),
        ] {
            assert_eq!(dimension.hint(text), expected, "{text}");
        }
    }

    #[test]
    fn known_dimensions_read_their_own_si_unit_and_example() {
        for known in &KNOWN {
            assert_eq!(quantity(&format!("1 {}", known.si)), (Exact::one(), known.dimension), "{}", known.word);
            assert_eq!(quantity(known.example).1, known.dimension, "{}", known.word);
        }
    }

    #[test]
    fn lists_share_their_unit() {
        let list = parse_quantity_list("[0, 10, -20.5, 1/3,] deg").unwrap();
        let texts: Vec<_> = list.iter().map(|entry| entry.2.as_str()).collect();
        assert_eq!(texts, ["0 deg", "10 deg", "-20.5 deg", "1/3 deg"]);
        for (number, dimension, text) in &list {
            assert_eq!((number.clone(), *dimension), quantity(text));
        }
        assert_eq!(parse_quantity_list("[1, 2]").unwrap()[1].2, "2");
        for (text, message) in [
            ("10 deg", "expected a list of numbers in brackets"),
            ("[] deg", "the list is empty"),
            ("[1 2] deg", "expected `,` or `]` after a number of the list"),
            ("[1, 2 deg", "expected `,` or `]` after a number of the list"),
            ("[1, 2", "expected `,` or `]` after a number of the list"),
            ("[1, 2,", "expected a number, found the end of the text"),
            ("[1, 2] dog", "unknown unit `dog`"),
        ] {
            assert_eq!(parse_quantity_list(text).unwrap_err().message, message, "{text}");
        }
    }

    #[test]
    fn hostile_texts_are_refused_quickly() {
        let start = std::time::Instant::now();
        for text in [
            "9".repeat(1_000_000),
            "(".repeat(256),
            "1 ".to_string() + &"(".repeat(250),
            "1 ".to_string() + &"(".repeat(60) + "mm/m" + &")^9".repeat(60),
            "1 ".to_string() + &"Gs ".repeat(80),
            "1 ".to_string() + &"Gm/m/".repeat(50) + "m",
            "1e400/1e-400/1e-400/1e-400/1e-400/1e-400/1e-400 m".to_string(),
            "1".to_string() + &"/pi".repeat(84),
        ] {
            let _ = parse_quantity(&text);
            let _ = parse_number(&text);
        }
        let _ = parse_quantity_list(&format!("[{}] rpm", "9,".repeat(8000)));
        // A hundred times what it takes without optimisation.
        assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
    }

    proptest! {
        #[test]
        fn a_decimal_is_an_integer_over_a_power_of_ten(integer in any::<i64>(), places in 0_usize..30) {
            let digits = format!("{:0>width$}", integer.unsigned_abs(), width = places + 1);
            let (whole, fraction) = digits.split_at(digits.len() - places);
            let text = format!("{}{whole}.{fraction}", if integer < 0 { "-" } else { "" });
            let expected = RBig::from_parts(integer.into(), UBig::from(10u8).pow(places));
            prop_assert_eq!(parse_number(&text).unwrap(), Exact::new(expected, 0));
            prop_assert_eq!(parse_number(&text).unwrap().to_f64(), text.parse::<f64>().unwrap());
        }

        #[test]
        fn every_double_is_read_back(bits in any::<u64>()) {
            let number = f64::from_bits(bits);
            prop_assume!(number.is_finite());
            prop_assert_eq!(parse_number(&format!("{number:e}")).unwrap().to_f64(), number);
        }

        #[test]
        fn the_si_unit_of_any_dimension_is_read_back(exponents in proptest::array::uniform7(-9_i8..=9), angle in -9_i8..=9) {
            let dimension = Dimension { exponents, angle };
            prop_assert_eq!(quantity(&format!("1 {}", dimension.si())), (Exact::one(), dimension));
            prop_assert_eq!(quantity(dimension.example().trim_matches('"')).1, dimension);
        }

        #[test]
        fn units_multiply_and_divide(a in 0_usize..UNITS.len(), b in 0_usize..UNITS.len()) {
            let (a, b) = (UNITS[a].name, UNITS[b].name);
            let (one, two) = (quantity(&format!("3 {a}")), quantity(&format!("7 {b}")));
            let product = (&one.0 * &two.0, one.1.times(&two.1, 1).unwrap());
            let quotient = (one.0.div(&two.0).unwrap(), one.1.times(&two.1, -1).unwrap());
            prop_assert_eq!(quantity(&format!("21 {a} {b}")), product);
            prop_assert_eq!(quantity(&format!("3/7 {a}/{b}")), quotient.clone());
            prop_assert_eq!(quantity(&format!("3/7 {a} ({b})^-1")), quotient);
        }

        #[test]
        fn any_text_is_read_or_refused(text in any::<String>(), near in "[-+0-9eE./pi *^()\\[\\],²°NmsradkgHz%_]{0,40}") {
            for text in [text, near] {
                for error in [
                    parse_quantity(&text).err(),
                    parse_number(&text).err(),
                    parse_quantity_list(&text).err(),
                    parse_quantity_list(&format!("[{text}")).err(),
                ] {
                    prop_assert!(error.is_none_or(|e| e.span.start <= e.span.end && e.span.end <= text.len() + 1));
                }
                for dimension in [Dimension::STIFFNESS, Dimension::ANGLE, Dimension::NONE] {
                    prop_assert!(!dimension.hint(&text).is_empty());
                }
            }
        }
    }
}
