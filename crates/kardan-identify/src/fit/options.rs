//! How samples are fitted.

use kardan_rt::functions::exp;

/// The loss function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Loss {
    /// Squares.
    #[default]
    Squares,
    /// Squares up to 1.345 standard deviations, linear beyond \[Huber 1964\].
    Huber,
    /// Tukey's bisquare: zero weight beyond 4.685 standard deviations; starts from Huber's solution.
    Bisquare,
}

/// The excess friction at low speed, over the ratio x of speed and Stribeck speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shape {
    /// `exp(−x²)`
    #[default]
    Gaussian,
    /// `exp(−x)`
    Exponential,
    /// `e x exp(−x)`: zero at rest, largest at the Stribeck speed.
    Peak,
}

impl Shape {
    /// The shape at x ≥ 0.
    pub fn value(self, x: f64) -> f64 {
        match self {
            Self::Gaussian => exp(-x * x),
            Self::Exponential => exp(-x),
            Self::Peak => x * exp(1.0 - x),
        }
    }

    /// Its slope.
    pub fn slope(self, x: f64) -> f64 {
        match self {
            Self::Gaussian => -2.0 * x * exp(-x * x),
            Self::Exponential => -exp(-x),
            Self::Peak => (1.0 - x) * exp(1.0 - x),
        }
    }
}

/// How samples are fitted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FitOptions {
    /// The loss function.
    pub loss: Loss,
    /// Columns whose values may not be below zero.
    pub nonnegative: Vec<bool>,
    /// Of each extra column the shape over the speed, if it has one, and its Stribeck speed (rad/s), if it is not fitted.
    pub shapes: Vec<Option<(Shape, Option<f64>)>>,
    /// Whether the samples follow each other so closely in time that their residuals may be correlated.
    pub serial: bool,
}
