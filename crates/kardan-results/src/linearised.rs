//! The linear model of a variant at its operating point, exact.

use kardan_math::num::{Matrix, Rational};

/// `E ẋ = A x + B u`, `y = C x + D u` with names and units; deviations from the operating point, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearised {
    /// Name of the model.
    pub name: String,
    /// The variant.
    pub variant: String,
    /// The states x.
    pub states: Vec<NamedUnit>,
    /// The inputs u.
    pub inputs: Vec<NamedUnit>,
    /// The outputs y.
    pub outputs: Vec<NamedUnit>,
    /// E; `None`: the identity.
    pub e: Option<Matrix<Rational>>,
    /// A.
    pub a: Matrix<Rational>,
    /// B, a column for each input.
    pub b: Matrix<Rational>,
    /// C, a row for each output.
    pub c: Matrix<Rational>,
    /// D, outputs × inputs.
    pub d: Matrix<Rational>,
    /// The coordinates: angles in rad, charges in C. Of an operating point in motion then their speeds, and the torques of inputs that balance it;
    /// else all speeds are zero.
    pub operating_point: Vec<(NamedUnit, f64)>,
    /// If a torque has a kink at the operating point: the side of this model, ``a.phi` > 0`.
    pub side: Option<String>,
    /// The same on the opposite side of the kink.
    pub opposite_side: Option<Box<Linearised>>,
    /// Notes to the reader.
    pub notes: Vec<String>,
}

/// A signal with its SI unit, which is empty where it has none of its own.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NamedUnit {
    /// `rk.phi`
    pub name: String,
    /// `rad`
    pub unit: String,
}

impl Linearised {
    /// The matrices by name, E only where it is not the identity.
    pub fn matrices(&self) -> Vec<(&'static str, &Matrix<Rational>)> {
        let rest = [("A", &self.a), ("B", &self.b), ("C", &self.c), ("D", &self.d)];
        self.e.iter().map(|e| ("E", e)).chain(rest).collect()
    }
}
