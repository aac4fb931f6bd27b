//! Complex numbers, spans, intervals, and matrices with named rows and columns.

use kardan_rt::functions::hypot;
use schemars::JsonSchema;
use serde::Serialize;

/// A matrix with named rows and columns, for display.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct NamedMatrix {
    /// What it is: `reduced inertia`.
    pub title: String,
    /// SI unit of the entries, if they share one.
    pub unit: String,
    /// Row names.
    pub rows: Vec<String>,
    /// Column names.
    pub columns: Vec<String>,
    /// Entries, row by row: `values[row][column]`.
    pub values: Vec<Vec<f64>>,
}

/// A complex number.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "[f64; 2]")]
pub struct Complex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Complex {
    /// `re + i im`.
    pub const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    /// The numbers of pairs `(re, im)`.
    pub fn list(pairs: impl IntoIterator<Item = (f64, f64)>) -> Vec<Self> {
        pairs.into_iter().map(Self::from).collect()
    }

    /// The absolute value.
    pub fn abs(self) -> f64 {
        hypot(self.re, self.im)
    }
}

impl From<(f64, f64)> for Complex {
    fn from((re, im): (f64, f64)) -> Self {
        Self { re, im }
    }
}

/// A pole, a zero or an eigenvalue, 1/s.
pub type Pole = Complex;

/// From one value to another, in order: of a time, of an angle.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "[f64; 2]")]
pub struct Span {
    /// Where it begins.
    pub start: f64,
    /// Where it ends.
    pub end: f64,
}

/// The ends of a range in which a number lies.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "[f64; 2]")]
pub struct Interval {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

/// A state that stands for a combination of others.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Definition {
    /// Its name: `z1`.
    pub state: String,
    /// What it is: `a.w + b.w`.
    pub expression: String,
}

impl From<Complex> for [f64; 2] {
    fn from(number: Complex) -> Self {
        [number.re, number.im]
    }
}

impl From<Span> for [f64; 2] {
    fn from(span: Span) -> Self {
        [span.start, span.end]
    }
}

impl From<Interval> for [f64; 2] {
    fn from(interval: Interval) -> Self {
        [interval.lower, interval.upper]
    }
}
