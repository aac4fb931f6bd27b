//! The kinematics of a reduced model in floating point.

use std::sync::Arc;

use super::{Affine, Reduced, Step};
use crate::assemble::{TransmissionRow, row_f64};
use crate::equations::Curve;
use kardan_expr::expr::{Graph, Surd, Surds, lower};
use kardan_math::num::{self, Matrix, Rational, Scalar, dot, rational_from_f64};
use kardan_math::units::Dimension;

/// An [`Affine`] in floating point.
#[derive(Debug, Clone)]
struct AffineF64 {
    constant: f64,
    terms: Vec<(usize, f64)>,
}

impl From<&Affine> for AffineF64 {
    fn from(affine: &Affine) -> Self {
        Self { constant: affine.constant, terms: row_f64(&affine.terms) }
    }
}

impl AffineF64 {
    fn value(&self, q: &[f64]) -> f64 {
        self.constant + self.combine(q)
    }

    fn combine(&self, x: &[f64]) -> f64 {
        self.terms.iter().map(|(shaft, c)| c * x[*shaft]).sum()
    }

    /// Adds the combination of basis rows to `out`.
    fn add_rows(&self, factor: f64, basis: &[f64], out: &mut [f64]) {
        let r = out.len();
        for (shaft, c) in &self.terms {
            for (value, entry) in out.iter_mut().zip(&basis[shaft * r..(shaft + 1) * r]) {
                *value += factor * c * entry;
            }
        }
    }
}

/// A [`Step`] in floating point, and whether its row of the basis depends on the position.
#[derive(Debug, Clone)]
struct Operation {
    shaft: usize,
    argument: AffineF64,
    curve: Option<Arc<dyn Curve>>,
    varying: bool,
}

/// Angles of all shafts, the basis `K = ∂q/∂q_r` and the bias `k = K̇ q̇_r`, at one position and speed.
///
/// Owns the evaluation plan and its memory; an evaluation allocates nothing.
#[derive(Debug, Clone)]
pub struct Kinematics {
    r: usize,
    coordinates: Vec<usize>,
    operations: Vec<Operation>,
    varying: Vec<bool>,
    /// Angles of all shafts, rad, as of the last evaluation.
    pub angles: Vec<f64>,
    /// Speeds of all shafts, rad/s.
    pub speeds: Vec<f64>,
    /// K, row by row, one row per shaft (4.13).
    pub basis: Vec<f64>,
    /// k, rad/s², one entry per shaft (4.14).
    pub bias: Vec<f64>,
    work: Vec<f64>,
}

impl Kinematics {
    /// Compiles the plan of a reduced model.
    pub fn new(reduced: &Reduced) -> Self {
        let (n, r) = (reduced.equations.coordinates.len(), reduced.degrees_of_freedom());
        let mut varying = vec![false; n];
        let mut operations = Vec::new();
        for Step { shaft, argument, curve } in &reduced.steps {
            let argument = AffineF64::from(argument);
            varying[*shaft] = curve.is_some() || argument.terms.iter().any(|(s, _)| varying[*s]);
            operations.push(Operation { shaft: *shaft, argument, curve: curve.clone(), varying: varying[*shaft] });
        }
        let mut out = Self {
            r,
            coordinates: reduced.coordinates.clone(),
            operations,
            varying,
            angles: vec![0.0; n],
            speeds: vec![0.0; n],
            basis: vec![0.0; n * r],
            bias: vec![0.0; n],
            work: vec![0.0; r],
        };
        for (column, &shaft) in out.coordinates.iter().enumerate() {
            out.basis[shaft * r + column] = 1.0;
        }
        // Constant rows are filled once, here.
        for Operation { shaft, argument, .. } in out.operations.iter().filter(|operation| !operation.varying) {
            let mut row = vec![0.0; r];
            argument.add_rows(1.0, &out.basis, &mut row);
            out.basis[shaft * r..(shaft + 1) * r].copy_from_slice(&row);
        }
        out
    }

    /// Evaluated at a reduced position (rad) and speed (rad/s).
    pub fn at(reduced: &Reduced, position: &[f64], speed: &[f64]) -> Self {
        let mut out = Self::new(reduced);
        out.update(position, speed);
        out
    }

    /// Evaluated at a reduced position (rad), at rest.
    pub fn at_rest(reduced: &Reduced, position: &[f64]) -> Self {
        Self::at(reduced, position, &vec![0.0; reduced.degrees_of_freedom()])
    }

    /// Writes the constant basis over other coordinates, `K T`.
    pub(super) fn transform(&mut self, transform: &Matrix<Rational>) {
        let (r, transform) = (self.r, transform.to_f64());
        for row in self.basis.chunks_exact_mut(r.max(1)) {
            self.work.fill(0.0);
            for (x, entries) in row.iter().zip((0..r).map(|k| transform.row(k))) {
                self.work.iter_mut().zip(entries).for_each(|(sum, entry)| *sum += x * entry);
            }
            row.copy_from_slice(&self.work);
        }
    }

    /// Whether the basis row of a shaft depends on the position.
    pub fn is_varying(&self, shaft: usize) -> bool {
        self.varying[shaft]
    }

    /// The number of the reduced coordinate that a shaft's angle is.
    pub fn coordinate(&self, shaft: usize) -> Option<usize> {
        self.coordinates.iter().position(|coordinate| *coordinate == shaft)
    }

    /// The shaft whose angle a reduced coordinate is.
    pub fn coordinate_shaft(&self, coordinate: usize) -> usize {
        self.coordinates[coordinate]
    }

    /// Whether the whole basis is constant.
    pub fn is_constant(&self) -> bool {
        !self.varying.contains(&true)
    }

    /// The basis row of a shaft.
    pub fn row(&self, shaft: usize) -> &[f64] {
        &self.basis[shaft * self.r..(shaft + 1) * self.r]
    }

    /// A direction over the shafts in reduced coordinates, `Kᵀa`.
    pub fn project(&self, direction: &[(usize, f64)], out: &mut [f64]) {
        out.fill(0.0);
        for (shaft, a) in direction {
            out.iter_mut().zip(self.row(*shaft)).for_each(|(sum, k)| *sum += a * k);
        }
    }

    /// Sets angles (rad) and speeds (rad/s) of the reduced coordinates alone.
    pub(super) fn set(&mut self, position: &[f64], speed: &[f64]) {
        for (column, &shaft) in self.coordinates.iter().enumerate() {
            (self.angles[shaft], self.speeds[shaft]) = (position[column], speed[column]);
        }
    }

    /// Evaluates angles, speeds, basis and bias at reduced position (rad) and speed (rad/s).
    ///
    /// For a curve `y = γ(x)`: `K_y = γ′ K_x`, `k_y = γ″ ẋ² + γ′ k_x` \[diss. (4.12)-(4.14)\].
    pub fn update(&mut self, position: &[f64], speed: &[f64]) {
        let r = self.r;
        self.set(position, speed);
        for Operation { shaft, argument, curve, varying } in &self.operations {
            let x = argument.value(&self.angles);
            let Some(curve) = curve else {
                self.angles[*shaft] = x;
                self.speeds[*shaft] = argument.combine(&self.speeds);
                if *varying {
                    self.work.fill(0.0);
                    argument.add_rows(1.0, &self.basis, &mut self.work);
                    self.basis[shaft * r..(shaft + 1) * r].copy_from_slice(&self.work);
                    self.bias[*shaft] = argument.combine(&self.bias);
                }
                continue;
            };
            let (slope, curvature) = curve.derivatives(x);
            self.angles[*shaft] = curve.value(x);
            self.work.fill(0.0);
            argument.add_rows(slope, &self.basis, &mut self.work);
            self.basis[shaft * r..(shaft + 1) * r].copy_from_slice(&self.work);
            self.speeds[*shaft] = dot(&self.work, speed);
            let x_speed = argument.combine(&self.speeds);
            self.bias[*shaft] = curvature * x_speed * x_speed + slope * argument.combine(&self.bias);
        }
    }
}

/// The slope of a curve at x: the derivative of its expression where it is a fraction there, else rounded once. Also
/// returns whether it is exact.
fn exact_slope(curve: &dyn Curve, x: Option<&Surd>, rounded: f64) -> Slope {
    let mut graph = Graph::default();
    let symbol = graph.symbol("x", Dimension::ANGLE);
    let [_, slope, _] = curve.expressions(&mut graph, symbol);
    match lower(&graph, &[slope], &mut Surds, |_| x.cloned()).pop().flatten().and_then(|slope| slope.to_rational()) {
        Some(value) => Slope { value, rounded: false },
        None => {
            let value = rational_from_f64(curve.derivatives(rounded).0).expect("the slope of a transmission is finite");
            Slope { value, rounded: true }
        }
    }
}

/// Slope of a transmission at a position, 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Slope {
    /// The slope, exact from here on.
    pub value: Rational,
    /// Whether it is not known to be a fraction, and was rounded once.
    pub rounded: bool,
}

/// Angles of all shafts at a position, where they are known exactly: doubles next to a multiple of 15° are that multiple.
pub(super) fn exact_angles(reduced: &Reduced, position: &[f64]) -> Vec<Option<Surd>> {
    let mut angles = vec![None; reduced.equations.coordinates.len()];
    for (&shaft, position) in reduced.coordinates.iter().zip(position) {
        angles[shaft] = Surd::recognise_double(*position);
    }
    for Step { shaft, argument, curve } in &reduced.steps {
        let argument = exact_argument(argument, &angles);
        angles[*shaft] = match curve {
            None => argument,
            Some(curve) => {
                let mut graph = Graph::default();
                let symbol = graph.symbol("x", Dimension::ANGLE);
                let [value, ..] = curve.expressions(&mut graph, symbol);
                lower(&graph, &[value], &mut Surds, |_| argument.clone()).pop().flatten()
            }
        };
    }
    angles
}

fn exact_argument(affine: &Affine, angles: &[Option<Surd>]) -> Option<Surd> {
    let term = |(shaft, c): &(usize, Rational)| Some(angles[*shaft].as_ref()?.scale(c));
    let constant = Surd::recognise_double(affine.constant)?;
    affine.terms.iter().try_fold(constant, |sum, entry| Some(sum.plus(&term(entry)?)))
}

/// Slopes of the transmissions at a reduced position (rad), in their order.
///
/// # Panics
/// If `position` has not one entry per coordinate or gives a slope that is not finite.
pub fn slopes(reduced: &Reduced, position: &[f64]) -> Vec<Slope> {
    let numeric = Kinematics::at_rest(reduced, position);
    let angles = exact_angles(reduced, position);
    let of = |t: &TransmissionRow| exact_slope(&*t.curve, angles[t.driving].as_ref(), numeric.angles[t.driving]);
    reduced.equations.transmissions.iter().map(of).collect()
}

/// K at a position, one row for each shaft: exact, but for slopes of curves that are no fractions, which are rounded once.
pub(super) fn exact_basis(reduced: &Reduced, position: &[f64]) -> Vec<num::SparseRow> {
    let numeric = Kinematics::at_rest(reduced, position);
    let angles = exact_angles(reduced, position);
    let mut basis = vec![num::SparseRow::new(); reduced.equations.coordinates.len()];
    for (column, &shaft) in reduced.coordinates.iter().enumerate() {
        basis[shaft].push((column, Rational::ONE));
    }
    for Step { shaft, argument, curve } in &reduced.steps {
        let mut row = num::project(&argument.terms, &basis);
        if let Some(curve) = curve {
            let x = AffineF64::from(argument).value(&numeric.angles);
            let slope = exact_slope(&**curve, exact_argument(argument, &angles).as_ref(), x).value;
            row.iter_mut().for_each(|(_, x)| *x = slope.times(x));
            row.retain(|(_, x)| !x.is_zero());
        }
        basis[*shaft] = row;
    }
    basis
}
