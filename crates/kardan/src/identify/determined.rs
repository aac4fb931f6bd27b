use super::Coefficient;
use crate::assemble::CoefficientKind as Kind;
use crate::num::{Matrix, Random, Rational, Scalar, echelon};
use crate::reduce::{Kinematics, Reduced, linearise};

/// What a measurement moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excitation {
    /// Constant speeds: no accelerations, and twists of springs that stay as they are.
    Steady,
    /// Anything.
    Free,
}

/// Positions at which a model with bent transmissions is looked at, and their seed.
const POSITIONS: (usize, u64) = (6, 1);

/// Which combinations of coefficients no measurement of that kind can determine, whatever is measured and however well: a basis,
/// one row for each with an entry for each coefficient; empty if all can be.
///
/// Exact: with the reduced direction `g = Kᵀa` an inertia (damping, stiffness) enters by the matrix `g gᵀ` alone, a Coulomb
/// torque by `g sgn(gᵀq̇)`; what these features do not tell apart, no data do. With bent transmissions the features at several
/// positions together, their slopes rounded once. Inputs in `unmeasured` may have any torque: of every feature only what is across
/// their directions counts.
///
/// ```
/// use kardan::identify::{Excitation, coefficients, undetermined};
/// use kardan::{assemble::assemble, model, num::Rational, reduce::reduce};
/// let text = "[model]\nname = \"m\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
///             [gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 3\n";
/// let (document, _) = model::read(text);
/// let (gears, _) = document.model(&[]);
/// let reduced = reduce(assemble(&gears.shafts, &gears.terms), Some(&["b".to_string()])).unwrap();
/// let all = coefficients(&reduced);
/// // a turns three times as fast as b: nine more of b and one less of a are the same.
/// let left = undetermined(&reduced, &all, &[], Excitation::Free);
/// assert_eq!(left, [[Rational::from(-1), Rational::from(9)]].map(|row| row.map(|x| x / Rational::from(9)).to_vec()));
/// ```
pub fn undetermined(
    reduced: &Reduced,
    wanted: &[Coefficient],
    unmeasured: &[usize],
    excitation: Excitation,
) -> Vec<Vec<Rational>> {
    let (r, equations) = (reduced.freedoms(), &reduced.equations);
    let mut positions = vec![vec![0.0; r]];
    if !Kinematics::new(reduced).is_constant() {
        let mut random = Random::new(POSITIONS.1);
        positions.extend((0..POSITIONS.0).map(|_| (0..r).map(|_| 2.0 * random.unit() - 1.0).collect()));
    }
    let mut features: Vec<Vec<Rational>> = Vec::new();
    for position in positions {
        let basis = linearise(reduced, &position).basis;
        let direction = |row: &[(usize, Rational)]| -> Vec<Rational> {
            let along =
                |j: usize| row.iter().fold(Rational::ZERO, |sum, (shaft, a)| sum.plus(&a.times(&basis[(*shaft, j)])));
            (0..r).map(along).collect()
        };
        let of = |kind: Kind, term: usize| match kind {
            Kind::Inertia => direction(&equations.inertias[term].row),
            Kind::Damping => direction(&equations.dampers[term].row),
            Kind::Stiffness => direction(&equations.springs[term].row),
            Kind::Friction => direction(&equations.frictions[term].row),
        };
        // Speeds that can be: all, or those at which no spring is twisted on.
        let speeds = match excitation {
            Excitation::Free => Matrix::identity(r),
            Excitation::Steady => {
                let springs = equations.springs.iter().filter(|spring| !spring.value.stiffness.is_zero());
                let rows: Vec<Vec<Rational>> = springs.map(|spring| direction(&spring.row)).collect();
                null_space(&Matrix::from_fn(rows.len(), r, |i, j| rows[i][j].clone()))
            }
        };
        let seen = |g: &[Rational]| -> Vec<Rational> {
            let along = |k: usize| (0..r).fold(Rational::ZERO, |sum, j| sum.plus(&g[j].times(&speeds[(j, k)])));
            (0..speeds.columns()).map(along).collect()
        };
        // A basis of what is across the torques that nobody measured.
        let torques: Vec<Vec<Rational>> = unmeasured.iter().map(|&k| direction(&equations.inputs[k].row)).collect();
        let across = null_space(&Matrix::from_fn(torques.len(), r, |i, j| torques[i][j].clone()));
        let rest = |g: &[Rational]| -> Vec<Rational> {
            let along = |k: usize| (0..r).fold(Rational::ZERO, |sum, j| sum.plus(&g[j].times(&across[(j, k)])));
            (0..across.columns()).map(along).collect()
        };
        let rows = across.columns();
        for kind in [Kind::Inertia, Kind::Damping, Kind::Stiffness] {
            if kind == Kind::Inertia && excitation == Excitation::Steady {
                continue;
            }
            let squares: Vec<Option<Vec<Rational>>> = wanted
                .iter()
                .map(|one| {
                    (one.kind == kind).then(|| {
                        let mut sum = vec![Rational::ZERO; rows * r];
                        for &term in &one.terms {
                            let g = of(kind, term);
                            let mut signal = if kind == Kind::Damping { seen(&g) } else { g.clone() };
                            signal.resize(r, Rational::ZERO);
                            let torque = rest(&g);
                            (0..rows * r).for_each(|k| sum[k] = sum[k].plus(&torque[k / r].times(&signal[k % r])));
                        }
                        sum
                    })
                })
                .collect();
            for k in 0..rows * r {
                let entry = |square: &Option<Vec<Rational>>| square.as_ref().map_or(Rational::ZERO, |s| s[k].clone());
                features.push(squares.iter().map(entry).collect());
            }
        }
        // Frictions along one line (g = t ĝ, first entry of ĝ one) share a sign: they add |t| ĝ sgn(ĝᵀq̇).
        let mut lines: Vec<(Vec<Rational>, Vec<Rational>)> = Vec::new();
        for (column, one) in wanted.iter().enumerate().filter(|(_, one)| one.kind == Kind::Friction) {
            for &term in &one.terms {
                let g = of(Kind::Friction, term);
                // Of a friction that rests nobody knows the sign; one along a torque that nobody measured does nothing else.
                if seen(&g).iter().all(Rational::is_zero) || rest(&g).iter().all(Rational::is_zero) {
                    continue;
                }
                let Some(first) = g.iter().find(|x| !x.is_zero()).cloned() else { continue };
                let line: Vec<Rational> = g.iter().map(|x| x.over(&first)).collect();
                let place = lines.iter().position(|(other, _)| *other == line).unwrap_or_else(|| {
                    lines.push((line, vec![Rational::ZERO; wanted.len()]));
                    lines.len() - 1
                });
                let size = if first < Rational::ZERO { Rational::ZERO.minus(&first) } else { first };
                let weights = &mut lines[place].1;
                weights[column] = weights[column].plus(&size);
            }
        }
        features.extend(lines.into_iter().map(|(_, weights)| weights));
    }
    let p = wanted.len();
    let matrix = Matrix::from_fn(features.len(), p, |i, j| features[i][j].clone());
    let found = null_space(&matrix);
    (0..found.columns()).map(|k| (0..p).map(|j| found[(j, k)].clone()).collect()).collect()
}

/// A basis of the null space, a column for each column that is no pivot.
fn null_space(matrix: &Matrix<Rational>) -> Matrix<Rational> {
    echelon(matrix, &(0..matrix.columns()).collect::<Vec<_>>()).kernel()
}
