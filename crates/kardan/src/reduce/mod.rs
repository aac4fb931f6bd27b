//! Constraints out of the equations: reduced coordinates, the explicit form `q = γ(q_r)` and its derivatives.
//!
//! Linear constraints are eliminated exactly over the rationals; nonlinear transmissions follow in an order in which
//! each can be evaluated in closed form. The result is a plan that floating point executes without decisions.

mod dynamics;
mod kinematics;
mod mechanism;
mod multipliers;

pub use dynamics::{Dynamics, Work};
pub use kinematics::{Affine, Kinematics, Step};
pub use mechanism::{MechanismData, MechanismError};
pub use multipliers::Multipliers;

use crate::assemble::{Equations, TransmissionRow};
use crate::num::{Echelon, Matrix, Rational, Scalar, echelon, rational_to_f64};

/// Why constraints cannot be brought to explicit form.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReduceError {
    /// Some constraints follow from others (or contradict them); C has no full row rank.
    #[error("{} linear constraints have only rank {rank}; {}", rank + dependencies.len(), describe_dependencies(dependencies))]
    ConstraintsDependent {
        /// The exact rank of C.
        rank: usize,
        /// One entry for each dependency.
        dependencies: Vec<Dependency>,
    },
    /// The constraints leave no motion.
    #[error("the constraints leave no motion: {shafts} shafts and {constraints} independent constraints")]
    NoMotion {
        /// Number of shafts.
        shafts: usize,
        /// Number of constraints.
        constraints: usize,
    },
    /// Coordinates named by the user are too few or too many.
    #[error("the model has {freedoms} degree{} of freedom, but {} coordinate{} named", plural(*freedoms), named.len(), if named.len() == 1 { " is" } else { "s are" })]
    CoordinateCount {
        /// Degrees of freedom.
        freedoms: usize,
        /// The names given.
        named: Vec<String>,
        /// Coordinates that would do.
        suggestion: Vec<String>,
    },
    /// Coordinates named by the user depend on each other through linear constraints.
    #[error("the coordinates {} are not independent: the constraints tie them together", list(named))]
    CoordinatesDependent {
        /// The names given.
        named: Vec<String>,
        /// Coordinates that would do.
        suggestion: Vec<String>,
    },
    /// The transmissions cannot be evaluated one after another from the coordinates.
    #[error("the transmissions {} close a loop that cannot be evaluated one after another", list(elements))]
    NotExplicit {
        /// Elements of the loop.
        elements: Vec<String>,
        /// Coordinates that would do, if there are any.
        suggestion: Vec<String>,
    },
}

/// Constraint elements whose rows are linearly dependent.
#[derive(Debug, Clone, PartialEq)]
pub struct Dependency {
    /// `(element, its share in the combination that vanishes)`.
    pub elements: Vec<(String, f64)>,
    /// Whether the offsets contradict each other; otherwise one row is superfluous.
    pub contradiction: bool,
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn list(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn describe_dependencies(dependencies: &[Dependency]) -> String {
    let one = |dependency: &Dependency| {
        let sum: Vec<String> = dependency.elements.iter().map(|(name, x)| format!("{x} · `{name}`")).collect();
        let verdict =
            if dependency.contradiction { "and their offsets contradict each other" } else { "so one is superfluous" };
        format!("{} = 0, {verdict}", sum.join(" + "))
    };
    dependencies.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// A model in explicit form: which shafts are coordinates and how all others follow.
#[derive(Debug, Clone)]
pub struct Reduced {
    /// The terms.
    pub equations: Equations,
    /// Numbers of the shafts chosen as reduced coordinates q_r, in the order chosen.
    pub coordinates: Vec<usize>,
    /// How the other shafts follow, in order of evaluation.
    pub steps: Vec<Step>,
}

impl Reduced {
    /// Degrees of freedom.
    pub fn freedoms(&self) -> usize {
        self.coordinates.len()
    }

    /// Names of the reduced coordinates.
    pub fn coordinate_names(&self) -> Vec<String> {
        self.coordinates.iter().map(|&shaft| self.equations.shafts[shaft].clone()).collect()
    }

    /// Number of a shaft.
    pub fn shaft(&self, name: &str) -> Option<usize> {
        self.equations.shafts.iter().position(|shaft| shaft == name)
    }

    /// Shafts that are not coordinates, one for each constraint.
    pub fn dependents(&self) -> Vec<usize> {
        (0..self.equations.shafts.len()).filter(|shaft| !self.coordinates.contains(shaft)).collect()
    }
}

/// Chooses reduced coordinates (or takes the named ones) and brings all constraints to explicit form.
///
/// Left to itself it keeps inertias and drops, in this order of preference, the driven shafts of transmissions,
/// massless shafts, and shafts with large coefficients (so that the basis stays well scaled); ties go by name.
///
/// ```
/// use kardan::{assemble::assemble, model, reduce::reduce};
/// let (document, _) = model::read(model::builtin("harmonic-drive").unwrap().source);
/// let (drive, _) = document.model(&[]);
/// let reduced = reduce(assemble(&drive.shafts, &drive.terms), None).unwrap();
/// // Three shafts, one constraint; the shaft with the largest coefficient follows from the others.
/// assert_eq!(reduced.coordinate_names(), ["fs", "wg"]);
/// ```
///
/// # Errors
/// [`ReduceError`], with the exact reason.
///
/// # Panics
/// If `named` holds a name that is no shaft or holds one twice (the model checks this before).
pub fn reduce(equations: Equations, named: Option<&[String]>) -> Result<Reduced, ReduceError> {
    let number = |name: &String| {
        equations.shafts.iter().position(|shaft| shaft == name).unwrap_or_else(|| panic!("no shaft `{name}`"))
    };
    let constraints = check_independence(&equations)?;
    let explicit = match named {
        None => automatic(&equations),
        Some(names) => {
            let wanted: Vec<usize> = names.iter().map(number).collect();
            let suggestion = || match automatic(&equations) {
                Ok((coordinates, _)) => coordinates.iter().map(|&shaft| equations.shafts[shaft].clone()).collect(),
                Err(_) => Vec::new(),
            };
            let freedoms = equations.shafts.len() - constraints;
            if wanted.len() != freedoms {
                let (named, suggestion) = (names.to_vec(), suggestion());
                return Err(ReduceError::CoordinateCount { freedoms, named, suggestion });
            }
            with_coordinates(&equations, &wanted, suggestion)
        }
    };
    let (coordinates, steps) = explicit?;
    Ok(Reduced { equations, coordinates, steps })
}

/// Reduced coordinates and the steps that follow from them.
type Explicit = (Vec<usize>, Vec<Step>);

/// Checks the linear rows exactly; returns the number of all constraints.
fn check_independence(equations: &Equations) -> Result<usize, ReduceError> {
    let n = equations.shafts.len();
    let e = echelon(&equations.constraint_matrix(), &(0..n).collect::<Vec<_>>());
    if e.rank() < equations.constraints.len() {
        let dependencies = e
            .dependent_rows()
            .iter()
            .enumerate()
            .map(|(k, rows)| {
                let share = |row: usize| &e.transform[(e.rank() + k, row)];
                let sum: f64 =
                    rows.iter().map(|&r| rational_to_f64(share(r)) * equations.constraints[r].value.to_f64()).sum();
                let size: f64 = rows
                    .iter()
                    .map(|&r| (rational_to_f64(share(r)) * equations.constraints[r].value.to_f64()).abs())
                    .sum();
                Dependency {
                    elements: rows
                        .iter()
                        .map(|&r| (equations.constraints[r].element.clone(), rational_to_f64(share(r))))
                        .collect(),
                    contradiction: sum.abs() > 1e-12 * size,
                }
            })
            .collect();
        return Err(ReduceError::ConstraintsDependent { rank: e.rank(), dependencies });
    }
    let constraints = e.rank() + equations.transmissions.len();
    if constraints >= n {
        return Err(ReduceError::NoMotion { shafts: n, constraints });
    }
    Ok(constraints)
}

/// Sets of coordinates that [`automatic`] tries before it gives up.
const MOST_TRIED: usize = 500;

fn automatic(equations: &Equations) -> Result<Explicit, ReduceError> {
    let order = from_dropped_to_kept(equations);
    let e = echelon(&equations.constraint_matrix(), &order);
    let mut free: Vec<usize> = (0..order.len()).filter(|shaft| !e.pivots.contains(shaft)).collect();
    // Each transmission takes one of the free shafts away: its driven one if that is free, else its driving one, else any
    // that its driven shaft depends on.
    for transmission in &equations.transmissions {
        let expression =
            |shaft: usize| affine(equations, &e, shaft).terms.into_iter().map(|(s, _)| s).collect::<Vec<_>>();
        let candidates = [
            vec![transmission.driven, transmission.driving],
            expression(transmission.driven),
            expression(transmission.driving),
        ]
        .concat();
        if let Some(shaft) = candidates.iter().find(|shaft| free.contains(shaft)) {
            free.retain(|s| s != shaft);
        }
    }
    let freedoms = order.len() - e.rank() - equations.transmissions.len();
    let open =
        if free.len() == freedoms { plan(equations, &free) } else { Err(equations.transmissions.iter().collect()) };
    match open {
        Ok(steps) => Ok((free, steps)),
        // Where transmissions and gears mesh, the first choice can need an equation solved that another choice does not.
        Err(open) => {
            let kept: Vec<usize> = order.into_iter().rev().collect();
            search(equations, &kept, freedoms, &mut Vec::new(), &mut 0).ok_or_else(|| not_explicit(&open, Vec::new()))
        }
    }
}

/// Shafts in the order in which they are given up as coordinates: ends of transmissions last, massless ones and those with
/// large coefficients first; ties go by name.
fn from_dropped_to_kept(equations: &Equations) -> Vec<usize> {
    let n = equations.shafts.len();
    let mut massless = vec![true; n];
    for term in &equations.inertias {
        for (shaft, _) in &term.row {
            massless[*shaft] = false;
        }
    }
    let mut largest = vec![0.0f64; n];
    for term in &equations.constraints {
        for (shaft, x) in &term.row {
            largest[*shaft] = largest[*shaft].max(rational_to_f64(x).abs());
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| {
        let end = |shaft: usize| equations.transmissions.iter().any(|t| t.driven == shaft || t.driving == shaft);
        end(a).cmp(&end(b)).then(massless[b].cmp(&massless[a])).then(largest[b].total_cmp(&largest[a])).then(a.cmp(&b))
    });
    order
}

/// The first set of coordinates, in the order given, from which all shafts follow one after another.
fn search(
    equations: &Equations,
    candidates: &[usize],
    freedoms: usize,
    chosen: &mut Vec<usize>,
    tried: &mut usize,
) -> Option<Explicit> {
    if chosen.len() == freedoms {
        *tried += 1;
        let mut coordinates = chosen.clone();
        coordinates.sort_unstable();
        return plan(equations, &coordinates).ok().map(|steps| (coordinates, steps));
    }
    for (k, &candidate) in candidates.iter().enumerate() {
        if *tried >= MOST_TRIED {
            return None;
        }
        chosen.push(candidate);
        let found = search(equations, &candidates[k + 1..], freedoms, chosen, tried);
        if found.is_some() {
            return found;
        }
        chosen.pop();
    }
    None
}

/// The affine expression of a shaft over the free shafts of an echelon form.
fn affine(equations: &Equations, e: &Echelon, shaft: usize) -> Affine {
    match e.pivots.iter().position(|&pivot| pivot == shaft) {
        None => Affine { constant: 0.0, terms: vec![(shaft, Rational::ONE)] },
        Some(row) => {
            let constant = (0..equations.constraints.len())
                .map(|k| rational_to_f64(&e.transform[(row, k)]) * equations.constraints[k].value.to_f64())
                .sum();
            let terms = (0..equations.shafts.len())
                .filter(|&j| j != shaft && !Scalar::is_zero(&e.form[(row, j)]))
                .map(|j| (j, Rational::ZERO.minus(&e.form[(row, j)])))
                .collect();
            Affine { constant, terms }
        }
    }
}

fn with_coordinates(
    equations: &Equations,
    wanted: &[usize],
    suggestion: impl Fn() -> Vec<String>,
) -> Result<Explicit, ReduceError> {
    let e = echelon(&equations.constraint_matrix(), &known_last(equations, wanted));
    if e.pivots.iter().any(|pivot| wanted.contains(pivot)) {
        let named = wanted.iter().map(|&shaft| equations.shafts[shaft].clone()).collect();
        return Err(ReduceError::CoordinatesDependent { named, suggestion: suggestion() });
    }
    let steps = plan(equations, wanted).map_err(|open| not_explicit(&open, suggestion()))?;
    Ok((wanted.to_vec(), steps))
}

fn not_explicit(open: &[&TransmissionRow], suggestion: Vec<String>) -> ReduceError {
    ReduceError::NotExplicit { elements: open.iter().map(|t| t.element.clone()).collect(), suggestion }
}

fn known_last(equations: &Equations, known: &[usize]) -> Vec<usize> {
    let unknown = (0..equations.shafts.len()).filter(|shaft| !known.contains(shaft));
    unknown.chain(known.iter().copied()).collect()
}

/// Steps that find all shafts from the coordinates; the transmissions that stay open if that is not possible.
///
/// Method: a transmission whose one end follows from known shafts through the linear constraints makes its other end
/// known; when none is left, the linear constraints must give the rest.
fn plan<'a>(equations: &'a Equations, coordinates: &[usize]) -> Result<Vec<Step>, Vec<&'a TransmissionRow>> {
    let matrix = equations.constraint_matrix();
    let mut known = coordinates.to_vec();
    let mut steps = Vec::new();
    let mut open: Vec<&TransmissionRow> = equations.transmissions.iter().collect();
    loop {
        let e = echelon(&matrix, &known_last(equations, &known));
        let follows = |shaft: usize| {
            known.contains(&shaft) || {
                let value = affine(equations, &e, shaft);
                e.pivots.contains(&shaft) && value.terms.iter().all(|(s, _)| known.contains(s))
            }
        };
        let next = open.iter().enumerate().find_map(|(k, t)| match (follows(t.driving), follows(t.driven)) {
            (true, false) => Some((k, t.driving, t.driven, std::sync::Arc::clone(&t.curve))),
            (false, true) => Some((k, t.driven, t.driving, t.curve.inverse())),
            _ => None,
        });
        if let Some((k, from, shaft, curve)) = next {
            steps.push(Step::Curve { shaft, curve, argument: affine(equations, &e, from) });
            known.push(shaft);
            open.remove(k);
            continue;
        }
        let unknown: Vec<usize> = (0..equations.shafts.len()).filter(|shaft| !known.contains(shaft)).collect();
        if !open.is_empty() || !unknown.iter().all(|&shaft| follows(shaft)) {
            return Err(open);
        }
        steps.extend(unknown.into_iter().map(|shaft| Step::Linear { shaft, value: affine(equations, &e, shaft) }));
        return Ok(steps);
    }
}

/// The reduced matrices of a linear(ised) model \[diss. Theorem 4.1\], exact for the stored numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearModel {
    /// Names of the reduced coordinates.
    pub coordinates: Vec<String>,
    /// Names of the inputs, in the order of the columns of `input`.
    pub inputs: Vec<String>,
    /// `H_r = KᵀHK`, kg m² (4.39a).
    pub inertia: Matrix<Rational>,
    /// `D_r = KᵀDK`, N m s/rad (4.39b).
    pub damping: Matrix<Rational>,
    /// `S_r = KᵀSK`, N m/rad (4.39c).
    pub stiffness: Matrix<Rational>,
    /// `F_r = KᵀF` (4.38).
    pub input: Matrix<Rational>,
    /// `K = ∂q/∂q_r`, one row per shaft (4.34).
    pub basis: Matrix<Rational>,
}

impl LinearModel {
    /// Row of the basis for a shaft: the direction of its angle in reduced coordinates.
    pub fn direction(&self, shaft: usize) -> Matrix<Rational> {
        Matrix::from_fn(1, self.basis.columns(), |_, j| self.basis[(shaft, j)].clone())
    }
}

/// Linearises a reduced model about rest at the reduced position given (rad), springs taken as relaxed there.
///
/// For constant constraints the basis is exact; a transmission contributes its slope, rounded to `f64` and then exact.
///
/// ```
/// use kardan::{assemble::assemble, model, num::Rational, reduce::{linearise, reduce}};
/// let (document, _) = model::read(model::builtin("harmonic-drive").unwrap().source);
/// let (drive, _) = document.model(&[]);
/// let named = ["wg".to_string(), "cs".to_string()];
/// let reduced = reduce(assemble(&drive.shafts, &drive.terms), Some(&named)).unwrap();
/// let linear = linearise(&reduced, &[0.0, 0.0]);
/// // (6.12b) with Table 6.1: the damping given for the axes is the identified d11 exactly.
/// assert_eq!(linear.damping[(0, 0)], Rational::from_parts(5.into(), 10_000_u32.into()));
/// ```
///
/// # Panics
/// If `position` has not one entry per coordinate or gives a slope that is not finite.
pub fn linearise(reduced: &Reduced, position: &[f64]) -> LinearModel {
    let basis = kinematics::exact_basis(reduced, position);
    let congruent = |m: Matrix<Rational>| basis.transpose().multiply(&m).multiply(&basis);
    let equations = &reduced.equations;
    LinearModel {
        coordinates: reduced.coordinate_names(),
        inputs: equations.inputs.iter().map(|input| input.element.clone()).collect(),
        inertia: congruent(equations.inertia_matrix()),
        damping: congruent(equations.damping_matrix()),
        stiffness: congruent(equations.stiffness_matrix()),
        input: basis.transpose().multiply(&equations.input_matrix()),
        basis,
    }
}
