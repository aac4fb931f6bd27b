//! The floating-point numbers of controllers.

use kardan_rt::Real;

/// A floating-point number in which a controller computes, `f32` or `f64`, with its way from and to `f64`.
pub trait Float: Real + Default + Send + std::fmt::Debug + 'static {
    /// The nearest number; infinite if it is too large.
    fn from_f64(x: f64) -> Self;
    /// The same number.
    fn to_f64(self) -> f64;

    /// The nearest numbers.
    ///
    /// ```
    /// use kardan_math::num::Float;
    /// assert_eq!(f32::list(&[0.5, 0.1]), [0.5, 0.1]);
    /// ```
    fn list(values: &[f64]) -> Vec<Self> {
        values.iter().map(|x| Self::from_f64(*x)).collect()
    }

    /// Writes the nearest numbers, as far as both reach.
    fn narrow(from: &[f64], to: &mut [Self]) {
        to.iter_mut().zip(from).for_each(|(to, from)| *to = Self::from_f64(*from));
    }

    /// Writes the same numbers, as far as both reach.
    fn widen(from: &[Self], to: &mut [f64]) {
        to.iter_mut().zip(from).for_each(|(to, from)| *to = from.to_f64());
    }
}

impl Float for f64 {
    fn from_f64(x: f64) -> Self {
        x
    }

    fn to_f64(self) -> f64 {
        self
    }
}

impl Float for f32 {
    fn from_f64(x: f64) -> Self {
        x as f32
    }

    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

/// The larger of two numbers; NaN counts as larger than any, so that a maximum over numbers with NaN is NaN.
///
/// ```
/// use kardan_math::num::max_or_nan;
/// let most = |numbers: [f64; 3]| numbers.into_iter().fold(0.0, max_or_nan);
/// assert_eq!(most([1.0, 3.0, 2.0]), 3.0);
/// assert!(most([1.0, f64::NAN, 2.0]).is_nan());
/// ```
pub fn max_or_nan(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}
