//! Steady motion: constant speeds without acceleration, and the torques of inputs that this requires.

use std::collections::{BTreeMap, BTreeSet};

use super::equilibrium::{Moves, Sought, Statics};
use super::{Kinematics, Motion, OperatingPoint, Reduced, kinematics, slip_speeds, with_enforced, with_sliding};
use crate::equations::{Meaning, UnilateralConstraint};
use kardan_expr::expr::{Expr, Side};
use kardan_math::num::{
    Matrix, Rational, Scalar, SparseRow, dense_rows, echelon, kernel, rational_from_f64, rational_to_f64, reduced_form,
    sparse_rows,
};

/// Relative difference from which two speeds contradict each other.
const CONTRADICTS: f64 = 1e-9;
/// Independent part of a column of slopes beside others, below which it depends on them.
const INDEPENDENT: f64 = 1e-9;
/// Speeds that a search starts with where it fails from rest, rad/s.
const SPEEDS: [f64; 8] = [1.0, -1.0, 10.0, -10.0, 100.0, -100.0, 1000.0, -1000.0];
/// Most iterations over the signs of sliding frictions.
const SLIDINGS: usize = 8;

/// The given values of a motion, and the inputs that may balance it. Coordinates are numbered among all of the
/// equations.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MotionSpec {
    /// Positions of coordinates of the reduced model, rad.
    pub positions: Vec<(usize, f64)>,
    /// Speeds of any coordinates, rad/s.
    pub speeds: Vec<(usize, f64)>,
    /// Inputs whose torques are to be found.
    pub inputs: Vec<usize>,
    /// Torques of inputs that are given, N m.
    pub torques: Vec<(usize, f64)>,
    /// Active set-valued directions: frictions that stick, locks that are engaged.
    pub enforced: BTreeSet<usize>,
}

/// A steady motion, or the instant of another one where all of it is given.
#[derive(Debug, Clone)]
pub struct SteadyMotion {
    /// The model there: sticking or engaged elements are constraints, sliding frictions are torques. It may have fewer
    /// coordinates.
    pub model: Reduced,
    /// Its position and motion, with the torque of each input.
    pub point: OperatingPoint,
    /// Where the coordinates of the whole model are, rad, and their speeds.
    pub motion: [Vec<f64>; 2],
    /// Of each set-valued direction of the whole model the sign with which it slides.
    pub sliding: Vec<f64>,
    /// Inputs that need no torque.
    pub idle: Vec<usize>,
    /// Coordinates of `model` whose speeds no torque determines: they are at rest unless other coordinates move them.
    pub open: Vec<usize>,
    /// Whether all positions and speeds were given: it may be an instant of another motion.
    pub whole: bool,
    /// Whether the residual torques are at the level of rounding.
    pub balanced: bool,
    /// The radius within which there is exactly one such motion, proven; `None`: accurate to rounding only.
    pub radius: Option<f64>,
    /// The residual accelerations of the coordinates of `model`, rad/s².
    pub accelerations: Vec<f64>,
}

/// Why there is no steady motion.
#[derive(Debug, Clone, PartialEq)]
pub enum NoSteadyMotion {
    /// A given speed (its number) cannot be constant, as torques depend on the angle that it changes.
    Turns(usize),
    /// Speeds that are given (their numbers) contradict each other.
    Contradiction(Vec<usize>),
    /// More inputs could balance it than are needed.
    Undetermined(Vec<usize>),
    /// No torques of the inputs balance it: the coordinate with the largest residual at best, by name, its value (N m),
    /// and the position.
    Unbalanced(String, f64, Vec<f64>),
    /// Frictions whose direction of sliding is not decided.
    Slides(Vec<String>),
}

/// The steady motion with the given values, near a reduced position (rad). The model must not depend on the time.
///
/// # Errors
/// [`NoSteadyMotion`]
///
/// # Panics
/// If the position has not one entry per coordinate, or there is no such input.
pub fn steady_motion(base: &Reduced, start: &[f64], spec: &MotionSpec) -> Result<SteadyMotion, NoSteadyMotion> {
    let names: Vec<String> = base.equations.coordinates.clone();
    let mut from = start.to_vec();
    for (shaft, angle) in &spec.positions {
        base.coordinates.iter().position(|own| own == shaft).into_iter().for_each(|k| from[k] = *angle);
    }
    let named: Vec<String> = spec.positions.iter().map(|(shaft, _)| names[*shaft].clone()).collect();
    let mut sliding = vec![0.0; base.equations.set_valued().count()];
    for _ in 0..SLIDINGS {
        let slid = Reduced { equations: with_sliding(&base.equations, &sliding), ..base.clone() };
        let model = with_enforced(&slid, &spec.enforced, &from, &named);
        let found = Search::new(base, &model, &from, spec)?.find(spec)?;
        let now: Vec<f64> = slip_speeds(base, &found.motion[0], &found.motion[1])
            .iter()
            .enumerate()
            .map(|(k, speed)| if spec.enforced.contains(&k) || *speed == 0.0 { 0.0 } else { speed.signum() })
            .collect();
        if now == sliding {
            return Ok(SteadyMotion { sliding, ..found });
        }
        sliding = now;
    }
    let elements = base.equations.set_valued().map(|(element, _)| element.to_string());
    Err(NoSteadyMotion::Slides(elements.zip(&sliding).filter(|(_, sign)| **sign != 0.0).map(|(own, _)| own).collect()))
}

/// A model with the given values in its coordinates.
struct Search<'a> {
    base: &'a Reduced,
    model: &'a Reduced,
    start: Vec<f64>,
    fixed: Vec<usize>,
    moves: Moves,
    /// Whether all positions and speeds are given.
    whole: bool,
}

impl<'a> Search<'a> {
    fn new(base: &'a Reduced, model: &'a Reduced, from: &[f64], spec: &MotionSpec) -> Result<Self, NoSteadyMotion> {
        let numeric = Kinematics::at_rest(base, from);
        let start: Vec<f64> = model.coordinates.iter().map(|shaft| numeric.angles[*shaft]).collect();
        let place = |shaft: &usize| model.coordinates.iter().position(|own| own == shaft);
        let fixed: Vec<usize> = spec.positions.iter().filter_map(|(shaft, _)| place(shaft)).collect();
        let r = model.degrees_of_freedom();
        let basis = kinematics::exact_basis(model, &start);
        let rows: Vec<&SparseRow> = spec.speeds.iter().map(|(shaft, _)| &basis[*shaft]).collect();
        let values: Vec<f64> = spec.speeds.iter().map(|(_, speed)| *speed).collect();
        let matrix = dense_rows(&rows, r);
        let whole = fixed.len() == r && reduced_form(&matrix).rank() == r;
        let directions = if whole { Matrix::identity(r) } else { steady_directions(&remove_laws_at(model, spec)) };
        let moves = moves(&directions, &matrix, &values)?;
        Ok(Self { base, model, start, fixed, moves, whole })
    }

    fn statics(&self, inputs: &[usize], torques: &[(usize, f64)]) -> (Statics, Vec<f64>) {
        let sought = Sought { inputs, fixed: &self.fixed, stops: &[], moves: Some(&self.moves), torques };
        let statics = Statics::new(self.model, &sought, &self.start);
        let free = self.start.len()..self.start.len() + self.moves.directions.len();
        let from = |speed: f64| {
            let mut from = statics.start(&self.start);
            from[free.clone()].fill(speed);
            statics.newton(&from).0
        };
        let at_rest = from(0.0);
        if free.is_empty() || statics.is_settled(&at_rest) {
            return (statics, at_rest);
        }
        // At rest a drag that grows with the square of the speed has no slope.
        let moving = SPEEDS.into_iter().map(from).find(|found| statics.is_settled(found));
        let found = moving.unwrap_or(at_rest);
        (statics, found)
    }

    fn find(&self, spec: &MotionSpec) -> Result<SteadyMotion, NoSteadyMotion> {
        let (statics, found) = self.statics(&spec.inputs, &spec.torques);
        let determined = statics.determination(&found, spec.inputs.len());
        let of = |numbers: &[usize]| -> Vec<usize> { numbers.iter().map(|k| spec.inputs[*k]).collect() };
        if !determined.ambiguous.is_empty() {
            return Err(NoSteadyMotion::Undetermined(of(&determined.ambiguous)));
        }
        let idle = of(&determined.idle);
        let needed: Vec<usize> = spec.inputs.iter().copied().filter(|input| !idle.contains(input)).collect();
        let (statics, found) = if idle.is_empty() { (statics, found) } else { self.statics(&needed, &spec.torques) };
        let r = self.model.degrees_of_freedom();
        let radius = if statics.is_exact(&found) { Some(0.0) } else { statics.proven(&found) };
        let balanced = radius.is_some() || statics.is_settled(&found);
        if !balanced && !self.whole {
            let residual_torque =
                statics.residual_torque(&found).into_iter().max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
            let (k, torque) = residual_torque.unwrap_or_default();
            let name = self.model.coordinate_names()[k].clone();
            return Err(NoSteadyMotion::Unbalanced(name, torque, found[..r].to_vec()));
        }
        let (position, rest) = found.split_at(r);
        let (free, rest) = rest.split_at(self.moves.directions.len());
        let mut rates: Vec<f64> = self.moves.base.iter().map(rational_to_f64).collect();
        for (direction, speed) in self.moves.directions.iter().zip(free) {
            direction.iter().for_each(|(k, share)| rates[*k] += rational_to_f64(share) * speed);
        }
        let mut torques = vec![0.0; self.model.equations.inputs.len()];
        spec.torques.iter().for_each(|(input, torque)| torques[*input] = *torque);
        needed.iter().zip(rest).for_each(|(input, torque)| torques[*input] = *torque);
        let mut open: Vec<usize> =
            determined.open.iter().flat_map(|k| &self.moves.directions[*k]).map(|(k, _)| *k).collect();
        open.sort_unstable();
        open.dedup();
        let point =
            OperatingPoint { position: position.to_vec(), rates, torques: Some(torques), side: Side::default() };
        Ok(SteadyMotion {
            accelerations: if balanced { vec![0.0; r] } else { accelerations(self.model, &point) },
            motion: motion_of(self.base, self.model, &point),
            model: self.model.clone(),
            point,
            sliding: Vec::new(),
            idle,
            open,
            whole: self.whole,
            balanced,
            radius,
        })
    }
}

/// Positions and speeds of the coordinates of a model at a point of one with the same shafts and other coordinates.
pub fn motion_of(base: &Reduced, model: &Reduced, point: &OperatingPoint) -> [Vec<f64>; 2] {
    let numeric = Kinematics::at(model, &point.position, &point.rates);
    [&numeric.angles, &numeric.speeds].map(|of| base.coordinates.iter().map(|shaft| of[*shaft]).collect())
}

/// The accelerations of reduced coordinates at a point, rad/s²; friction that is no torque of the model is left out.
///
/// # Panics
/// If the point has not one entry per coordinate.
pub fn accelerations(model: &Reduced, point: &OperatingPoint) -> Vec<f64> {
    let reduced = &*model.unrelaxed();
    let motion = Motion::at_time_zero(reduced);
    let r = reduced.degrees_of_freedom();
    let inertia: Vec<((usize, usize), Expr)> = motion.inertia.iter().map(|(place, entry)| (*place, *entry)).collect();
    let columns: Vec<(usize, usize, Expr)> = (motion.inputs.iter().enumerate())
        .flat_map(|(input, column)| column.iter().map(move |(k, entry)| (input, *k, *entry)))
        .collect();
    let exprs: Vec<Expr> = (motion.passive.iter().copied())
        .chain(inertia.iter().map(|(_, entry)| *entry))
        .chain(columns.iter().map(|(_, _, entry)| *entry))
        .collect();
    let values = motion.values_at(&exprs, &point.position, &point.rates);
    let mut forces = Matrix::from_fn(r, 1, |i, _| values[i]);
    let mut matrix = Matrix::<f64>::zeros(r, r);
    for ((i, j), value) in inertia.iter().map(|(place, _)| *place).zip(&values[r..]) {
        (matrix[(i, j)], matrix[(j, i)]) = (*value, *value);
    }
    for ((input, k, _), value) in columns.iter().zip(&values[r + inertia.len()..]) {
        forces[(*k, 0)] += value * point.torques.as_ref().map_or(0.0, |torques| torques[*input]);
    }
    matrix.solve(&forces).map_or_else(|| vec![f64::NAN; r], |found| found.as_slice().to_vec())
}

/// A model without the laws that are taken at an angle that is given together with its speed.
fn remove_laws_at(model: &Reduced, spec: &MotionSpec) -> Reduced {
    let equations = &model.equations;
    let both = spec.positions.iter().filter(|(shaft, _)| spec.speeds.iter().any(|(candidate, _)| candidate == shaft));
    let bodies: Vec<&str> = both.map(|(shaft, _)| equations.coordinates[*shaft].as_str()).collect();
    let mut out = model.clone();
    out.equations.laws.retain(|law| {
        let angle = |(_, meaning): &(&str, &Meaning)| matches!(meaning, Meaning::Position(name) if bodies.contains(&name.as_str()));
        !law.value.all_names().iter().any(angle)
    });
    out
}

/// Directions in which a model may move at constant speeds: in them no torque and no direction of an input changes, and
/// no gap of a stop; columns over the coordinates. Exact where slopes are sums of the same terms, as those of a spring
/// are.
fn steady_directions(model: &Reduced) -> Matrix<Rational> {
    let reduced = &*model.unrelaxed();
    let mut motion = Motion::at_time_zero(reduced);
    let r = reduced.degrees_of_freedom();
    let inputs = motion.inputs.iter().flat_map(|column| column.values().copied());
    let exprs: Vec<Expr> = motion.passive.iter().copied().chain(inputs).collect();
    let mut rows: BTreeMap<(usize, Option<Expr>), Vec<Rational>> = BTreeMap::new();
    let mut add = |motion: &Motion, number: usize, k: usize, slope: Expr| {
        let (constant, terms) = motion.graph.terms(slope);
        let parts = terms.into_iter().map(|(part, factor)| (Some(part), factor)).chain([(None, constant)]);
        for (part, factor) in parts.filter(|(_, factor)| !factor.is_zero()) {
            rows.entry((number, part)).or_insert_with(|| vec![Rational::ZERO; r])[k] += factor;
        }
    };
    for k in 0..r {
        let symbol = motion.symbols[k];
        let slopes = motion.graph.derivatives(&exprs, symbol);
        slopes.into_iter().enumerate().for_each(|(i, slope)| add(&motion, i, k, slope));
    }
    let first = reduced.equations.frictions.len();
    for (k, unilateral) in reduced.equations.unilaterals.iter().enumerate() {
        if matches!(unilateral.value, UnilateralConstraint::Stop { .. } | UnilateralConstraint::Cushion { .. }) {
            let row: Vec<(usize, Expr)> = motion.frictions[first + k].iter().map(|(j, x)| (*j, *x)).collect();
            row.into_iter().for_each(|(j, entry)| add(&motion, exprs.len() + k, j, entry));
        }
    }
    let rows: Vec<Vec<Rational>> = rows.into_values().collect();
    let matrix = Matrix::from_fn(rows.len(), r, |i, j| rows[i][j].clone());
    kernel(&matrix)
}

/// The motions in directions (columns) that have these speeds: rows over the coordinates with their values, rad/s.
fn moves(directions: &Matrix<Rational>, rows: &Matrix<Rational>, values: &[f64]) -> Result<Moves, NoSteadyMotion> {
    let (products, count) = (rows.multiply(directions), directions.columns());
    let order: Vec<usize> = (0..count).collect();
    let exact = |value: f64| rational_from_f64(value).unwrap_or_default();
    let with_values = Matrix::from_fn(values.len(), count + 1, |i, j| match j < count {
        true => products[(i, j)].clone(),
        false => exact(values[i]),
    });
    let found = echelon(&with_values, &order);
    let most = values.iter().fold(0.0, |most, value| f64::max(most, value.abs()));
    for i in found.rank()..values.len() {
        if rational_to_f64(&found.form[(i, count)]).abs() > CONTRADICTS * most {
            let part = |j: &usize| !Scalar::is_zero(&found.transform[(i, *j)]);
            let own: Vec<usize> = (0..values.len()).filter(part).collect();
            return Err(if let [one] = own[..] {
                NoSteadyMotion::Turns(one)
            } else {
                NoSteadyMotion::Contradiction(own)
            });
        }
    }
    let mut base = vec![Rational::ZERO; directions.rows()];
    for (row, pivot) in found.pivots.iter().enumerate() {
        let share = &found.form[(row, count)];
        (0..directions.rows()).for_each(|k| base[k] += share * &directions[(k, *pivot)]);
    }
    let free = directions.multiply(&echelon(&products, &order).kernel());
    Ok(Moves { base, directions: sparse_rows(&free.transpose()) })
}

/// Which of the unknowns the torques determine.
#[derive(Debug, Default)]
pub(super) struct Determination {
    /// Speeds in directions that they do not determine.
    pub open: Vec<usize>,
    /// Inputs without an effect of their own beyond positions and speeds.
    pub idle: Vec<usize>,
    /// Inputs of which one could replace others.
    pub ambiguous: Vec<usize>,
}

/// Whether a column is none of a sum of others, which it joins then.
fn joins(mut column: Vec<f64>, basis: &mut Vec<Vec<f64>>) -> bool {
    let size = |list: &[f64]| list.iter().map(|x| x * x).sum::<f64>().sqrt();
    let whole = size(&column);
    // Two passes are enough (Parlett, The Symmetric Eigenvalue Problem, 1980, section 6-9).
    for _ in 0..2 {
        for other in basis.iter() {
            let share: f64 = column.iter().zip(other).map(|(x, y)| x * y).sum();
            column.iter_mut().zip(other).for_each(|(x, y)| *x -= share * y);
        }
    }
    let rest = size(&column);
    let is_new = rest > INDEPENDENT * whole;
    if is_new {
        column.iter_mut().for_each(|x| *x /= rest);
        basis.push(column);
    }
    is_new
}

impl Statics {
    /// Which of its unknowns (speeds in directions, torques of the inputs) are determined at a position: columns of
    /// slopes, each row scaled.
    pub(super) fn determination(&self, found: &[f64], inputs: usize) -> Determination {
        let columns = self.columns(found);
        let (r, moving) = (self.degrees_of_freedom(), self.counters.len());
        let of = |unknown: usize| columns.get(&unknown).cloned().unwrap_or_default();
        let mut basis = Vec::new();
        (0..r).for_each(|k| {
            joins(of(k), &mut basis);
        });
        let open = (0..moving).filter(|k| !joins(of(r + k), &mut basis)).collect();
        let span = basis.clone();
        let idle: Vec<usize> = (0..inputs).filter(|k| !joins(of(r + moving + k), &mut span.clone())).collect();
        let needed: Vec<usize> = (0..inputs).filter(|k| !idle.contains(k)).collect();
        let more = needed.iter().filter(|k| !joins(of(r + moving + **k), &mut basis)).count();
        Determination { open, idle, ambiguous: if more > 0 { needed } else { Vec::new() } }
    }
}
