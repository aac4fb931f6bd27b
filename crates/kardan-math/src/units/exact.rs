//! Numbers as their author wrote them.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::ops::{Mul, Neg};
use std::sync::{Arc, OnceLock};

use dashu_int::ops::BitTest;
use dashu_int::{Sign, UBig};
use dashu_ratio::RBig;

use crate::num::{rational_from_f64, rational_to_f64};

/// The largest conversion factor while a unit is read, in bits.
const FACTOR_BITS_LIMIT: usize = 16_384;

/// The exact number `rational · π^pi`: `"30 deg"` is 1/6 π, `"2 N m/deg"` is 360 π⁻¹, in SI units.
///
/// Zero always has `pi == 0`, so two equal numbers of this form compare equal.
///
/// ```
/// use kardan_math::units::Exact;
/// let sixth = Exact::from_ratio(1, 6);
/// assert_eq!(&sixth * &Exact::from_integer(6), Exact::one());
/// assert_eq!((-&sixth).to_f64(), -1.0 / 6.0);
/// ```
#[derive(Debug, Clone)]
pub struct Exact {
    /// The rational factor.
    pub rational: RBig,
    /// The power of π.
    pub pi: i32,
    /// How it is computed from named numbers, if symbolic equations are requested; not part of the number.
    symbolic: Option<Arc<InNames>>,
    /// Whether it approximates a number of another form, or is computed from one that does; not part of the number.
    rounded: bool,
}

/// How a number is computed from named numbers.
#[derive(Debug, Clone)]
pub enum InNames {
    /// A number with a name.
    Name(String),
    /// One without.
    Number(Exact),
    /// The opposite.
    Negative(Exact),
    /// One over it.
    Reciprocal(Exact),
    /// A sum.
    Sum(Exact, Exact),
    /// A product.
    Product(Exact, Exact),
}

impl PartialEq for Exact {
    fn eq(&self, other: &Self) -> bool {
        self.rational == other.rational && self.pi == other.pi
    }
}

impl Eq for Exact {}

impl Hash for Exact {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.rational.hash(state);
        self.pi.hash(state);
    }
}

impl Exact {
    /// The number `rational · π^pi`.
    ///
    /// ```
    /// use kardan_math::units::Exact;
    /// assert_eq!(Exact::new(2.into(), 1).to_f64(), std::f64::consts::TAU);
    /// ```
    pub fn new(rational: RBig, pi: i32) -> Self {
        let pi = if rational.is_zero() { 0 } else { pi };
        Self { rational, pi, symbolic: None, rounded: false }
    }

    /// Zero.
    pub fn zero() -> Self {
        Self::new(RBig::ZERO, 0)
    }

    /// One.
    pub fn one() -> Self {
        Self::new(RBig::ONE, 0)
    }

    /// An integer.
    pub fn from_integer(value: i64) -> Self {
        Self::new(value.into(), 0)
    }

    /// A ratio of two integers.
    ///
    /// # Panics
    ///
    /// If the denominator is zero.
    ///
    /// ```
    /// use kardan_math::units::Exact;
    /// assert_eq!(Exact::from_ratio(51, -50), -&Exact::from_ratio(102, 100));
    /// ```
    pub fn from_ratio(numerator: i64, denominator: i64) -> Self {
        assert!(denominator != 0, "the denominator of {numerator}/{denominator} must not be zero");
        Self::new(RBig::from_parts_signed(numerator.into(), denominator.into()), 0)
    }

    /// The nearest `f64`, through π to 120 digits; infinite if the number is too large, zero if it is too small.
    ///
    /// ```
    /// use kardan_math::units::parse_quantity;
    /// let (half_turn, _) = parse_quantity("180 deg")?;
    /// assert_eq!(half_turn.to_f64(), std::f64::consts::PI);
    /// # Ok::<(), kardan_math::units::UnitError>(())
    /// ```
    pub fn to_f64(&self) -> f64 {
        if self.pi == 0 {
            return rational_to_f64(&self.rational);
        }
        // A rounding error far below that of the result, so the result is the nearest f64.
        rational_to_f64(&self.digits())
    }

    /// The number to 120 digits.
    pub(super) fn digits(&self) -> RBig {
        if self.pi == 0 { self.rational.clone() } else { &self.rational * Self::pi_digits().pow(self.pi as isize) }
    }

    /// π to 120 digits.
    pub(super) fn pi_digits() -> RBig {
        static PI: OnceLock<RBig> = OnceLock::new();
        let put_together = || {
            let (groups, ten) = (PI_DIGITS, UBig::from(10u8));
            let numerator = groups.iter().fold(UBig::ZERO, |sum, word| sum * ten.pow(20) + UBig::from(*word));
            RBig::from_parts(numerator.into(), ten.pow(20 * (groups.len() - 1)))
        };
        PI.get_or_init(put_together).clone()
    }

    /// Whether it is zero.
    pub fn is_zero(&self) -> bool {
        self.rational.is_zero()
    }

    /// Its sign: -1, 0 or 1.
    ///
    /// ```
    /// use kardan_math::units::Exact;
    /// assert_eq!(Exact::from_ratio(-1, 3).signum(), -1);
    /// ```
    pub fn signum(&self) -> i32 {
        match self.rational.sign() {
            _ if self.is_zero() => 0,
            Sign::Positive => 1,
            Sign::Negative => -1,
        }
    }

    /// The quotient, or `None` for a division by zero.
    ///
    /// ```
    /// use kardan_math::units::Exact;
    /// assert_eq!(Exact::from_integer(51).div(&Exact::from_integer(50)), Some(Exact::from_ratio(51, 50)));
    /// assert_eq!(Exact::one().div(&Exact::zero()), None);
    /// ```
    pub fn div(&self, divisor: &Self) -> Option<Self> {
        divisor.recip().map(|recip| self * &recip)
    }

    /// The reciprocal, or `None` for zero.
    ///
    /// ```
    /// use kardan_math::units::Exact;
    /// assert_eq!(Exact::from_ratio(-2, 3).recip(), Some(Exact::from_ratio(-3, 2)));
    /// ```
    pub fn recip(&self) -> Option<Self> {
        if self.is_zero() {
            return None;
        }
        let (numerator, denominator) = self.rational.clone().into_parts();
        let inverse = Self::new(RBig::from_parts_signed(denominator.into(), numerator), -self.pi);
        Some(inverse.following([self], |_| InNames::Reciprocal(self.clone())))
    }

    /// The sum. Exact if both have the same power of π (or one is zero); else of the nearest `f64` of each.
    ///
    /// ```
    /// use kardan_math::units::Exact;
    /// assert_eq!(Exact::from_ratio(1, 2).plus(&Exact::from_ratio(1, 3)), Exact::from_ratio(5, 6));
    /// ```
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let sum = match (self, other) {
            (zero, sum) | (sum, zero) if zero.is_zero() => sum.clone(),
            (a, b) if a.pi == b.pi => Self::new(&a.rational + &b.rational, a.pi),
            (a, b) => Self::new(a.to_rational() + b.to_rational(), 0).rounded(),
        };
        sum.following([self, other], |[a, b]| InNames::Sum(a.clone(), b.clone()))
    }

    /// The same number with a name: results computed from it record how.
    ///
    /// ```
    /// use kardan_math::units::{Exact, InNames};
    /// let ratio = Exact::from_integer(50).named("hd.ratio");
    /// let other = ratio.plus(&Exact::one());
    /// assert!(other == Exact::from_integer(51) && matches!(other.in_names(), Some(InNames::Sum(..))));
    /// ```
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { symbolic: Some(Arc::new(InNames::Name(name.into()))), ..self }
    }

    /// How it is computed from named numbers, if it uses one.
    pub fn in_names(&self) -> Option<&InNames> {
        self.symbolic.as_deref()
    }

    /// The same number as an approximation of one that is not a fraction times a power of π.
    #[must_use]
    pub(crate) fn rounded(self) -> Self {
        Self { rounded: true, ..self }
    }

    /// Whether it approximates a number that is not a fraction times a power of π (`sqrt(2)`), or is computed from one that does.
    ///
    /// ```
    /// use kardan_math::units::parse_quantity;
    /// assert!(!parse_quantity("2 m")?.0.is_rounded());
    /// # Ok::<(), kardan_math::units::UnitError>(())
    /// ```
    pub fn is_rounded(&self) -> bool {
        self.rounded
    }

    /// The same number as computed from others.
    fn following<const N: usize>(self, from: [&Self; N], how: impl FnOnce([&Self; N]) -> InNames) -> Self {
        let rounded = self.rounded || from.iter().any(|one| one.rounded);
        let is_named = from.iter().any(|one| one.symbolic.is_some());
        let symbolic = if is_named { Some(Arc::new(how(from))) } else { self.symbolic };
        Self { symbolic, rounded, ..self }
    }

    /// As a rational number: exact if no π is in it, else the rational value of [`Exact::to_f64`] (zero if that is not
    /// finite).
    ///
    /// ```
    /// use kardan_math::units::Exact;
    /// use dashu_ratio::RBig;
    /// assert_eq!(Exact::from_ratio(1, 3).to_rational() * RBig::from(3), RBig::ONE);
    /// ```
    pub fn to_rational(&self) -> RBig {
        if self.pi == 0 { self.rational.clone() } else { rational_from_f64(self.to_f64()).unwrap_or(RBig::ZERO) }
    }

    /// `self^power` for a number other than zero, or `None` if it exceeds the bounds.
    pub(super) fn pow(&self, power: i32) -> Option<Self> {
        let bits = self.rational.numerator().bit_len() + self.rational.denominator().bit_len();
        if bits.saturating_mul(power.unsigned_abs() as usize) > FACTOR_BITS_LIMIT {
            return None;
        }
        Some(Self {
            rounded: self.rounded,
            ..Self::new(self.rational.pow(power as isize), self.pi.checked_mul(power)?)
        })
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
        let product = Exact::new(&self.rational * &other.rational, self.pi + other.pi);
        product.following([self, other], |[a, b]| InNames::Product(a.clone(), b.clone()))
    }
}

impl Neg for &Exact {
    type Output = Exact;

    fn neg(self) -> Exact {
        Exact::new(-&self.rational, self.pi).following([self], |_| InNames::Negative(self.clone()))
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
