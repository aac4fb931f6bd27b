//! A designed linear loop over the rationals.

use super::Reference;
use super::decoupling::{RelativeDegrees, closed};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational};
use kardan_results::ExactMatrix;

/// A designed linear loop, exact.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactLoop {
    /// The design model with E = I, as far as the outputs show it: its inputs are those that the law commands, its outputs
    /// those that it controls.
    pub plant: LinearSystem,
    /// The same with the integrators that the law puts before inputs.
    pub system: LinearSystem,
    /// From the references to the outputs.
    pub closed: LinearSystem,
    /// Unit of each reference.
    pub units: Vec<String>,
    /// Number of the output that each reference is for.
    pub channels: Vec<usize>,
    /// The polynomial of the motion that no output shows, where the law alone knows it (blocks).
    pub behind: Option<Polynomial>,
    /// Whether the law inverts the plant, so that it cancels zeros.
    pub inverts: bool,
    /// The exact law, before its gains are rounded; `None` if it is not known as a whole.
    pub law: Option<ExactLaw>,
}

/// A law `ξ̇ = A ξ + B x`, `u = C ξ + D x` over the state x of the design model, its reduced coordinates (rad) and their
/// speeds (rad/s); references are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactLaw {
    /// A, states × states.
    pub a: Matrix<Rational>,
    /// B, states × twice the coordinates.
    pub b: Matrix<Rational>,
    /// C, inputs × states.
    pub c: Matrix<Rational>,
    /// D, inputs × twice the coordinates.
    pub d: Matrix<Rational>,
}

impl ExactLaw {
    /// `u = D x`
    pub fn gain(d: Matrix<Rational>) -> Self {
        Self { a: Matrix::zeros(0, 0), b: Matrix::zeros(0, d.columns()), c: Matrix::zeros(d.rows(), 0), d }
    }
}

impl ExactLoop {
    /// The loop of `ẋ = A x + B u`, `y = C x + D u` (the system) under `u = −K x + L r`, one reference for each output. Its law
    /// is known if the system is the design model as a whole.
    ///
    /// # Panics
    /// If the shapes do not fit each other.
    pub fn feedback(
        plant: LinearSystem,
        system: LinearSystem,
        [k, l]: [&Matrix<Rational>; 2],
        references: &[Reference],
    ) -> Self {
        let closed = closed(&system, k, l, references.iter().map(|r| r.name.clone()).collect());
        let (units, channels) =
            (references.iter().map(|r| r.physical.unit().to_string()).collect(), (0..references.len()).collect());
        // With integrators, or of a part of the state, the caller knows it.
        let law = (plant.states == system.states).then(|| ExactLaw::gain(k.scale(&Rational::NEG_ONE)));
        Self { plant, system, closed, units, channels, behind: None, inverts: true, law }
    }
}

/// The gains of `u = −K x + L r − M d` for reports, M where there are disturbances; columns: states, references, disturbances.
pub(super) fn gain_matrices(
    inputs: &[String],
    [states, references, disturbed]: [&[String]; 3],
    [k, l, m]: [&Matrix<Rational>; 3],
) -> Vec<ExactMatrix> {
    let mut out = vec![
        named(("K", "state gain K of u = -K x + L r", ""), inputs, states, k),
        named(("L", "reference gain L", ""), inputs, references, l),
    ];
    if !disturbed.is_empty() {
        out.push(named(("M", "disturbance gain M of u = -K x + L r - M d", ""), inputs, disturbed, m));
    }
    out
}

/// The decoupling matrix for reports: rows such as `rk.phi''` for an output of relative degree 2.
pub(super) fn decoupling_matrix(outputs: &[String], inputs: &[String], found: &RelativeDegrees) -> ExactMatrix {
    let derivative = |(output, degree): (&String, &Option<usize>)| output.clone() + &"'".repeat(degree.unwrap_or(0));
    let rows: Vec<String> = outputs.iter().zip(&found.degrees).map(derivative).collect();
    named(("decoupling_matrix", "decoupling matrix G", ""), &rows, inputs, &found.matrix)
}

/// An exact matrix with names, for reports.
pub fn named(
    (name, title, unit): (&str, &str, &str),
    rows: &[String],
    columns: &[String],
    matrix: &Matrix<Rational>,
) -> ExactMatrix {
    let text = |i: usize| matrix.row(i).iter().map(ToString::to_string).collect();
    let exact = Some((0..matrix.rows()).map(text).collect());
    ExactMatrix { exact, ..rounded((name, title, unit), rows, columns, &matrix.to_f64()) }
}

/// A matrix of floating point with names, for reports.
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
