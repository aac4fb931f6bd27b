//! Which coefficients a kind of measurement determines.

use super::Coefficient;
use kardan_math::num::{Matrix, Random, Rational, Scalar, kernel};
use kardan_mechanics::assemble::{CoefficientKind as Kind, Equations};
use kardan_mechanics::reduce::{Kinematics, Reduced, linearise};

/// The motion of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excitation {
    /// Constant speeds: no accelerations, and twists of springs that stay as they are.
    Steady,
    /// Any motion.
    Free,
}

/// Positions at which a model with nonlinear transmissions is evaluated, and their seed.
const POSITIONS: (usize, u64) = (6, 1);

/// Which combinations of coefficients no measurement of that kind can determine, whatever is measured and however well: a basis,
/// one row for each with an entry for each coefficient; empty if all can be.
///
/// Exact: with the reduced direction `g = Kᵀa` an inertia (damping, stiffness) enters only by the matrix `g gᵀ`, a Coulomb
/// torque by `g sgn(gᵀq̇)`; no data distinguish what these features do not. With nonlinear transmissions the features at several
/// positions together, their slopes rounded once. Inputs in `unmeasured` may have any torque: of every feature only the part orthogonal to
/// their directions counts.
///
/// ```
/// use kardan_identify::{Excitation, coefficients, undetermined};
/// use kardan_mechanics::assemble::assemble;
/// use kardan_math::num::Rational;
/// use kardan_mechanics::reduce::reduce;
/// let text = "[model]\nname = \"m\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
///             [gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 3\n";
/// let (document, _) = kardan_model::read(text);
/// let (gears, _) = document.model(&[]);
/// let reduced = reduce(assemble(&gears.all_coordinates, &gears.terms), Some(&["b".to_string()])).unwrap();
/// let all = coefficients(&reduced);
/// // a turns three times as fast as b: nine more of b and one less of a are the same.
/// let left = undetermined(&reduced, &all, &[], Excitation::Free);
/// assert_eq!(left, [[Rational::from(-1), Rational::from(9)]].map(|row| row.map(|x| x / Rational::from(9)).to_vec()));
/// ```
pub fn undetermined(
    reduced: &Reduced,
    coefficients: &[Coefficient],
    unmeasured: &[usize],
    excitation: Excitation,
) -> Vec<Vec<Rational>> {
    let r = reduced.degrees_of_freedom();
    let mut positions = vec![vec![0.0; r]];
    if !Kinematics::new(reduced).is_constant() {
        let mut random = Random::new(POSITIONS.1);
        positions.extend((0..POSITIONS.0).map(|_| (0..r).map(|_| 2.0 * random.unit() - 1.0).collect()));
    }
    let features: Vec<Vec<Rational>> = positions
        .iter()
        .flat_map(|position| {
            let sample_position = Position::new(reduced, position, unmeasured, excitation);
            let mut features = sample_position.of_squares(coefficients);
            features.extend(sample_position.of_frictions(coefficients));
            features
        })
        .collect();
    let p = coefficients.len();
    let matrix = Matrix::from_fn(features.len(), p, |i, j| features[i][j].clone());
    let found = kernel(&matrix);
    (0..found.columns()).map(|k| (0..p).map(|j| found[(j, k)].clone()).collect()).collect()
}

/// Features of the coefficients at one reduced position.
struct Position<'a> {
    equations: &'a Equations,
    basis: Matrix<Rational>,
    excitation: Excitation,
    /// A basis of the possible speeds: all, or those at which no spring twist changes.
    speeds: Matrix<Rational>,
    /// A basis of the orthogonal complement of the unmeasured torques.
    across: Matrix<Rational>,
}

/// The component of a direction along the columns of a basis.
fn projection(g: &[Rational], basis: &Matrix<Rational>) -> Vec<Rational> {
    let projection = |k: usize| (0..g.len()).fold(Rational::ZERO, |sum, j| sum.plus(&g[j].times(&basis[(j, k)])));
    (0..basis.columns()).map(projection).collect()
}

impl<'a> Position<'a> {
    fn new(reduced: &'a Reduced, position: &[f64], unmeasured: &[usize], excitation: Excitation) -> Self {
        let (r, equations) = (reduced.degrees_of_freedom(), &reduced.equations);
        let basis = linearise(reduced, position).basis;
        let free = Matrix::identity(r);
        let mut out = Self { equations, basis, excitation, speeds: free.clone(), across: free };
        if excitation == Excitation::Steady {
            let springs = equations.springs.iter().filter(|spring| !spring.value.stiffness.is_zero());
            let rows: Vec<Vec<Rational>> = springs.map(|spring| out.direction(&spring.row)).collect();
            out.speeds = kernel(&Matrix::from_fn(rows.len(), r, |i, j| rows[i][j].clone()));
        }
        let torques: Vec<Vec<Rational>> = unmeasured.iter().map(|&k| out.direction(&equations.inputs[k].row)).collect();
        out.across = kernel(&Matrix::from_fn(torques.len(), r, |i, j| torques[i][j].clone()));
        out
    }

    /// A row over the reduced coordinates.
    fn direction(&self, row: &[(usize, Rational)]) -> Vec<Rational> {
        let component =
            |j: usize| row.iter().fold(Rational::ZERO, |sum, (shaft, a)| sum.plus(&a.times(&self.basis[(*shaft, j)])));
        (0..self.basis.columns()).map(component).collect()
    }

    /// The direction of a term.
    fn of_term(&self, kind: Kind, term: usize) -> Vec<Rational> {
        self.direction(self.equations.coefficient_row((kind, term)))
    }

    /// Contribution of inertias, dampings and stiffnesses to the torques: their directions squared.
    fn of_squares(&self, coefficients: &[Coefficient]) -> Vec<Vec<Rational>> {
        let (r, rows) = (self.basis.columns(), self.across.columns());
        let mut features = Vec::new();
        for kind in [Kind::Inertia, Kind::Damping, Kind::Stiffness] {
            if kind == Kind::Inertia && self.excitation == Excitation::Steady {
                continue;
            }
            let square = |one: &Coefficient| {
                (one.kind == kind).then(|| {
                    let mut sum = vec![Rational::ZERO; rows * r];
                    for &term in &one.terms {
                        let g = self.of_term(kind, term);
                        let mut signal = if kind == Kind::Damping { projection(&g, &self.speeds) } else { g.clone() };
                        signal.resize(r, Rational::ZERO);
                        let torque = projection(&g, &self.across);
                        (0..rows * r).for_each(|k| sum[k] = sum[k].plus(&torque[k / r].times(&signal[k % r])));
                    }
                    sum
                })
            };
            let squares: Vec<Option<Vec<Rational>>> = coefficients.iter().map(square).collect();
            for k in 0..rows * r {
                let entry = |square: &Option<Vec<Rational>>| square.as_ref().map_or(Rational::ZERO, |s| s[k].clone());
                features.push(squares.iter().map(entry).collect());
            }
        }
        features
    }

    /// Frictions along one line (g = t ĝ, first entry of ĝ one) share a sign: they add |t| ĝ sgn(ĝᵀq̇).
    fn of_frictions(&self, coefficients: &[Coefficient]) -> Vec<Vec<Rational>> {
        let mut lines: Vec<(Vec<Rational>, Vec<Rational>)> = Vec::new();
        for (column, one) in coefficients.iter().enumerate().filter(|(_, one)| one.kind == Kind::Friction) {
            for &term in &one.terms {
                let g = self.of_term(Kind::Friction, term);
                // The sign of a sticking friction is unknown; a friction along an unmeasured torque has no other effect.
                if [&self.speeds, &self.across].iter().any(|basis| projection(&g, basis).iter().all(Rational::is_zero))
                {
                    continue;
                }
                let Some(first) = g.iter().find(|x| !x.is_zero()).cloned() else { continue };
                let line: Vec<Rational> = g.iter().map(|x| x.over(&first)).collect();
                let place = lines.iter().position(|(candidate, _)| *candidate == line).unwrap_or_else(|| {
                    lines.push((line, vec![Rational::ZERO; coefficients.len()]));
                    lines.len() - 1
                });
                let size = if first < Rational::ZERO { Rational::ZERO.minus(&first) } else { first };
                let weights = &mut lines[place].1;
                weights[column] = weights[column].plus(&size);
            }
        }
        lines.into_iter().map(|(_, weights)| weights).collect()
    }
}
