use crate::analysis::LinearSystem;
use crate::num::{Matrix, Rational};
use crate::results::ExactMatrix;

/// A designed linear loop, exact: `ẋ = A x + B u`, `y = C x + D u` under `u = −K x + L r`.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactLoop {
    /// The design model with E = I, as far as the outputs show it: its inputs are those that the law commands, its outputs
    /// those that it controls.
    pub plant: LinearSystem,
    /// The same with the integrators that the law puts before inputs; the gains belong to this one.
    pub system: LinearSystem,
    /// K, inputs × states.
    pub state_gain: Matrix<Rational>,
    /// L, inputs × references.
    pub reference_gain: Matrix<Rational>,
    /// Name and unit of each reference.
    pub references: Vec<(String, String)>,
    /// Number of the output that each reference is for.
    pub channels: Vec<usize>,
}

impl ExactLoop {
    /// `A − B K`, `B L`, `C − D K`, `D L`.
    ///
    /// # Panics
    /// If the shapes do not fit each other.
    pub fn closed(&self) -> [Matrix<Rational>; 4] {
        let minus = Rational::from(-1);
        let LinearSystem { a, b, c, d, .. } = &self.system;
        let feedback = self.state_gain.scale(&minus);
        [
            a.plus(&b.multiply(&feedback)),
            b.multiply(&self.reference_gain),
            c.plus(&d.multiply(&feedback)),
            d.multiply(&self.reference_gain),
        ]
    }
}

/// An exact matrix with names, for a reader.
pub fn named(
    (name, title, unit): (&str, &str, &str),
    rows: &[String],
    columns: &[String],
    matrix: &Matrix<Rational>,
) -> ExactMatrix {
    let text = |i: usize| matrix.row(i).iter().map(ToString::to_string).collect();
    ExactMatrix {
        name: name.into(),
        title: title.into(),
        unit: unit.into(),
        rows: rows.to_vec(),
        columns: columns.to_vec(),
        values: matrix.to_rows(),
        exact: Some((0..matrix.rows()).map(text).collect()),
    }
}

/// A matrix of floating point with names, for a reader.
pub fn rounded(
    (name, title, unit): (&str, &str, &str),
    rows: &[String],
    columns: &[String],
    matrix: &Matrix<f64>,
) -> ExactMatrix {
    ExactMatrix {
        name: name.into(),
        title: title.into(),
        unit: unit.into(),
        rows: rows.to_vec(),
        columns: columns.to_vec(),
        values: matrix.to_rows(),
        exact: None,
    }
}
