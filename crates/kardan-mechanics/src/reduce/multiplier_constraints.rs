//! Constraints that are not solved for a coordinate, enforced by multipliers: `G q̈_r + b = 0` with the derivatives of
//! the row in exact terms.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Kinematics, Motion, MultiplierTerms, Reduced, SparseRow};
use crate::assemble::{DirectionalTerm, RestTorque};
use crate::equations::{Formula, MultiplierLaw};
use kardan_expr::expr::{Expr, OfTime, Rationals, Symbol, lower};
use kardan_math::num::{Rational, SparseRow as SparseNumbers, dot, rational_from_f64};
use kardan_math::units::Exact;

/// A row over all coordinates as if they were free: coefficients, φ, and the rate of its coefficients, `Σ ȧ_i q̇_i`.
struct Free {
    motion: Motion,
    row: Vec<(usize, Expr)>,
    position: Option<Expr>,
}

impl Free {
    fn rates(reduced: &Reduced, row: &[(usize, Arc<Formula>)]) -> Self {
        let (free, mut motion) = Motion::free(&reduced.equations, true);
        let row = row.iter().map(|(shaft, a)| (*shaft, motion.formula(&free, a))).collect();
        Self { motion, row, position: None }
    }

    fn surface(reduced: &Reduced, formula: &Formula) -> Self {
        let (free, mut motion) = Motion::free(&reduced.equations, true);
        let position = motion.formula(&free, formula);
        let n = free.coordinates.len();
        let mut row = Vec::new();
        for shaft in 0..n {
            let slope = motion.graph.derivative(position, motion.symbols[shaft]);
            if !motion.graph.is_zero(slope) {
                row.push((shaft, slope));
            }
        }
        Self { motion, row, position: Some(position) }
    }

    /// `Σ ∂a_i/∂q_j q̇_j q̇_i`
    fn change(&mut self) -> Expr {
        let n = self.motion.angles.len();
        let mut terms = Vec::new();
        for (i, entry) in self.row.clone() {
            for j in 0..n {
                let (symbol, graph) = (self.motion.symbols[j], &mut self.motion.graph);
                let slope = graph.derivative(entry, symbol);
                let product = graph.product(&[(slope, 1), (self.motion.speeds[i], 1), (self.motion.speeds[j], 1)]);
                terms.push((product, Rational::ONE));
            }
        }
        self.motion.graph.sum(Rational::ZERO, &terms)
    }
}

impl Motion {
    /// Adds multiplier constraints behind the directions of friction.
    pub(super) fn add_multiplier_rows(&mut self, reduced: &Reduced) {
        for constraint in &reduced.equations.multiplier_constraints {
            let (rate, change) = match &constraint.law {
                MultiplierLaw::Rates(row) => self.take(Free::rates(reduced, row)),
                MultiplierLaw::Surface(formula) => self.take(Free::surface(reduced, formula)),
                MultiplierLaw::Prescribed { row, order, function } => self.prescribed_sum(row, function, *order),
            };
            let mut direction = SparseRow::new();
            let mut bias = vec![(change, Rational::ONE)];
            for (shaft, entry) in &rate.row {
                for (column, basis) in self.basis[*shaft].clone() {
                    let product = self.graph.multiply(*entry, basis);
                    let before = direction.get(&column).copied().unwrap_or_else(|| self.graph.integer(0));
                    direction.insert(column, self.graph.add(before, product));
                }
                bias.push((self.graph.multiply(*entry, self.bias[*shaft]), Rational::ONE));
            }
            direction.retain(|_, entry| !self.graph.is_zero(*entry));
            let bias = self.graph.sum(Rational::ZERO, &bias);
            if reduced.equations.braced {
                self.brace(reduced, &direction, bias);
            }
            self.frictions.push(direction);
            self.friction_bias.push(bias);
            self.multiplier_constraints.push(rate);
        }
    }

    /// An inertia μ in the direction of a multiplier constraint, which changes no motion: as `G q̈ + b` vanishes, so
    /// does its force `μ Gᵀ(G q̈ + b)`, and its energy with the speed in that direction. With it the inertia is
    /// definite where it is definite on the motions that the rows leave free.
    fn brace(&mut self, reduced: &Reduced, row: &SparseRow, bias: Expr) {
        let inertias = reduced.equations.inertias.iter().map(|inertia| &inertia.value);
        let Some(largest) = inertias.max_by(|a, b| a.to_f64().total_cmp(&b.to_f64())) else { return };
        let (value, zero) = (self.exact(largest), self.graph.integer(0));
        for (i, first) in row {
            for (j, second) in row.range(..=i) {
                let product = self.graph.product(&[(value, 1), (*first, 1), (*second, 1)]);
                let before = self.inertia.get(&(*i, *j)).copied().unwrap_or(zero);
                let sum = self.graph.add(before, product);
                self.inertia.insert((*i, *j), sum);
            }
        }
        self.inertia.retain(|_, entry| *entry != zero);
        let force = self.graph.multiply(value, bias);
        self.passive_terms.add(&mut self.graph, row, force, &Rational::from(-1));
        self.passive = self.passive_terms.sums(&mut self.graph);
    }

    /// `Σ a_i x_i` over a multiplier constraint.
    pub fn sum_over_multiplier(&mut self, constraint: usize, of: impl Fn(&Self, usize) -> Expr) -> Expr {
        let row = self.multiplier_constraints[constraint].row.clone();
        let terms = self.products(&row, of);
        self.graph.sum(Rational::ZERO, &terms)
    }

    /// `a_i x_i` over a row.
    pub(super) fn products(
        &mut self,
        row: &[(usize, Expr)],
        of: impl Fn(&Self, usize) -> Expr,
    ) -> Vec<(Expr, Rational)> {
        let mut terms = Vec::with_capacity(row.len());
        for (shaft, entry) in row {
            let value = of(self, *shaft);
            terms.push((self.graph.multiply(*entry, value), Rational::ONE));
        }
        terms
    }

    /// A sum of positions (order 0), speeds (1) or accelerations (2) that a function of time prescribes; and the negative acceleration that
    /// it prescribes.
    fn prescribed_sum(&mut self, row: &[(usize, Exact)], function: &OfTime, order: usize) -> (MultiplierTerms, Expr) {
        let row: Vec<(usize, Expr)> = row.iter().map(|(shaft, x)| (*shaft, self.exact(x))).collect();
        let terms = self.products(&row, |motion, shaft| motion.speeds[shaft]);
        let sum = self.graph.sum(Rational::ZERO, &terms);
        // The function, and its rates up to the acceleration.
        let mut derivatives = vec![function.clone()];
        for k in 0..2 - order {
            derivatives.push(derivatives[k].rate());
        }
        let values: Vec<Expr> = derivatives.iter().map(|function| self.of_time(function)).collect();
        let position = (order == 0).then(|| {
            let mut terms = vec![(values[0], Rational::from(-1))];
            terms.extend(self.products(&row, |motion, shaft| motion.angles[shaft]));
            self.graph.sum(Rational::ZERO, &terms)
        });
        let prescribed_rate = 1usize.checked_sub(order).map(|place| values[place]);
        let speed = prescribed_rate.map(|rate| self.graph.subtract(sum, rate));
        let change = self.graph.negate(values[2 - order]);
        (MultiplierTerms { row, position, speed, rate: prescribed_rate.unwrap_or(sum) }, change)
    }

    /// A row over free coordinates, with angles and speeds of this motion substituted; and the rate of its
    /// coefficients.
    fn take(&mut self, mut free: Free) -> (MultiplierTerms, Expr) {
        let change = free.change();
        let n = self.angles.len();
        let here = self.angles.iter().chain(&self.speeds).copied();
        let places: Vec<(Symbol, Expr)> = free.motion.symbols.iter().copied().take(2 * n).zip(here).collect();
        let mut copy = |expr: Expr| self.graph.copied(&free.motion.graph, expr, &places);
        let change = copy(change);
        let position = free.position.map(&mut copy);
        let row: Vec<(usize, Expr)> = free.row.iter().map(|(shaft, entry)| (*shaft, copy(*entry))).collect();
        let terms = self.products(&row, |motion, shaft| motion.speeds[shaft]);
        let speed = Some(self.graph.sum(Rational::ZERO, &terms));
        let rate = self.graph.integer(0);
        (MultiplierTerms { row, position, speed, rate }, change)
    }
}

/// Start angles and speeds that satisfy the multiplier constraints.
#[derive(Debug, Clone, PartialEq)]
pub struct StartOnRows {
    /// Reduced coordinates.
    pub position: Vec<f64>,
    /// Their speeds.
    pub speed: Vec<f64>,
}

/// The angles and speeds that are given at the start and stay: numbers of shafts, and values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StartValues {
    /// Of angles (rad), and of speeds.
    pub values: [Vec<(usize, f64)>; 2],
}

/// Why there are none.
#[derive(Debug, Clone, PartialEq)]
pub enum NoStart {
    /// The search found no solution of the rows from its start; numbers of the rows that are not satisfied.
    NotReached(Vec<usize>),
    /// These rows are not numbers at the start of the search.
    NotFinite(Vec<usize>),
    /// These rows have no slopes there: they do not constrain any motion.
    Flat(Vec<usize>),
    /// To ten digits, the rows depend on each other there.
    Dependent,
    /// The given values leave a row no solution: the row, and which of the given angles (rate 0) or speeds (1).
    Contradiction {
        /// Its number.
        row: usize,
        /// Whether of angles or of speeds.
        rate: usize,
        /// Numbers of the given values of that rate.
        prescribed: Vec<usize>,
    },
}

/// Steps of the search for a start.
const MOST: usize = 50;
/// A pivot below this, relative to its row, counts as a dependence.
const DEPENDENT: f64 = 1e-10;
/// Residual of a satisfied row, relative to the largest angle or speed, or to one.
const TOLERANCE: f64 = 1e-12;
/// The same for a row that the given values determine alone.
const CONTRADICTION: f64 = 1e-9;
/// Distance from zero at which free values are searched where their slopes vanish there.
const BESIDE: [f64; 4] = [0.01, -0.01, 1.0, -1.0];

/// A start with these angles and speeds that satisfies the rows, at time zero: given values stay, free ones change by
/// the least squares of Newton's method.
///
/// # Errors
/// [`NoStart`]
pub fn start_on_rows(
    reduced: &Reduced,
    prescribed: &StartValues,
    position: &[f64],
    speed: &[f64],
) -> Result<StartOnRows, NoStart> {
    let mut search = Search::new(reduced, prescribed);
    let begin = StartOnRows { position: position.to_vec(), speed: speed.to_vec() };
    let mut found = begin.clone();
    let at_once = search.solve(0, &mut found);
    if let Err(error) = at_once {
        let open = |k: &usize| !prescribed.values[0].iter().any(|(shaft, _)| *shaft == reduced.coordinates[*k]);
        let open: Vec<usize> = (0..position.len()).filter(open).collect();
        found = search.beside(&begin, &open).ok_or(error)?;
    }
    search.solve(1, &mut found)?;
    let values = search.at(&found);
    let rows: Vec<Row> = (0..search.count).map(|k| search.row(&values, k, 0.0)).collect();
    let flat: Vec<usize> = (0..search.count).filter(|k| rows[*k].entries.iter().all(|x| *x == 0.0)).collect();
    match least_change(&rows, 0.0) {
        _ if !flat.is_empty() => Err(NoStart::Flat(flat)),
        Ok(Least { follow, .. }) if follow.is_empty() => Ok(found),
        _ => Err(NoStart::Dependent),
    }
}

/// One linear equation of a step.
struct Row {
    entries: Vec<f64>,
    defect: f64,
}

impl Row {
    fn size(&self) -> f64 {
        dot(&self.entries, &self.entries).sqrt()
    }
}

/// The rows and the given values, as numbers.
struct Search<'a> {
    prescribed: &'a StartValues,
    plan: kardan_expr::plan::Plan,
    memory: Vec<f64>,
    expressions: Vec<Option<Expr>>,
    timed: Vec<f64>,
    count: usize,
    r: usize,
}

impl<'a> Search<'a> {
    /// Evaluates the multiplier constraints, the rows of given values, and the residuals of both: of angles, then of
    /// speeds.
    fn new(reduced: &Reduced, prescribed: &'a StartValues) -> Self {
        let (r, count) = (reduced.degrees_of_freedom(), reduced.equations.multiplier_constraints.len());
        let motion = Motion::new(reduced);
        let first = reduced.equations.set_valued().count();
        let shafts = || prescribed.values.iter().flatten().map(|(shaft, _)| *shaft);
        let entry = |row: &SparseRow, i: usize| row.get(&i).copied();
        let multiplier_constraints = motion.frictions[first..].iter();
        let rows = multiplier_constraints.chain(shafts().map(|shaft| &motion.basis[shaft]));
        let mut expressions: Vec<Option<Expr>> = rows.flat_map(|row| (0..r).map(|i| entry(row, i))).collect();
        expressions.extend(motion.multiplier_constraints.iter().map(|row| row.position));
        expressions.extend(motion.multiplier_constraints.iter().map(|row| row.speed));
        for (rate, prescribed) in prescribed.values.iter().enumerate() {
            let of = if rate == 0 { &motion.angles } else { &motion.speeds };
            expressions.extend(prescribed.iter().map(|(shaft, _)| Some(of[*shaft])));
        }
        let outputs = expressions.iter().enumerate().filter_map(|(k, expr)| Some((k.to_string(), (*expr)?)));
        // A plan without outputs is none.
        let one = motion.graph.of_symbol(motion.symbols[0]).map(|expr| ("one".to_string(), expr));
        let outputs: Vec<(String, Expr)> = outputs.chain(one).collect();
        let plan = motion.compile(&outputs);
        let timed = motion.timed.values(0.0).collect();
        Self { prescribed, memory: plan.memory(), plan, expressions, timed, count, r }
    }

    fn at(&mut self, found: &StartOnRows) -> Vec<f64> {
        let prescribed = found.position.iter().chain(&found.speed).chain(&self.timed);
        self.memory.iter_mut().zip(prescribed).for_each(|(place, value)| *place = *value);
        let _ = self.plan.block().evaluate(&mut self.memory);
        let mut output = 0;
        let mut value = |expr: &Option<Expr>| match expr {
            Some(_) => {
                output += 1;
                self.memory[self.plan.place(output - 1)]
            }
            None => 0.0,
        };
        self.expressions.iter().map(&mut value).collect()
    }

    /// A row by its number: a multiplier constraint, or behind these a row of a given value.
    fn row(&self, values: &[f64], number: usize, defect: f64) -> Row {
        Row { entries: values[number * self.r..(number + 1) * self.r].to_vec(), defect }
    }

    /// Numbers of the multiplier constraints that constrain angles, or speeds.
    fn own(&self, rate: usize) -> Vec<usize> {
        let defects = (self.count + self.prescribed.values.iter().map(Vec::len).sum::<usize>()) * self.r;
        (0..self.count).filter(|k| self.expressions[defects + rate * self.count + k].is_some()).collect()
    }

    /// The given values of a rate, then the multiplier constraints, each with its residual.
    fn rows(&self, values: &[f64], rate: usize, own: &[usize]) -> Vec<Row> {
        let before = if rate == 0 { 0 } else { self.prescribed.values[0].len() };
        let defects = (self.count + self.prescribed.values.iter().map(Vec::len).sum::<usize>()) * self.r;
        let prescribed = self.prescribed.values[rate].iter().enumerate().map(|(k, (_, value))| {
            let now = values[defects + 2 * self.count + before + k];
            self.row(values, self.count + before + k, now - value)
        });
        let multiplier_constraints = own.iter().map(|k| self.row(values, *k, values[defects + rate * self.count + k]));
        prescribed.chain(multiplier_constraints).collect()
    }

    /// Newton's method for angles (rate 0), or speeds.
    fn solve(&mut self, rate: usize, found: &mut StartOnRows) -> Result<(), NoStart> {
        let (own, prescribed) = (self.own(rate), self.prescribed.values[rate].len());
        for step in 0.. {
            let values = self.at(found);
            let rows = self.rows(&values, rate, &own);
            if rows[prescribed..].iter().all(|row| row.defect == 0.0) {
                break;
            }
            let not_finite = |k: &usize| {
                let Row { entries, defect } = &rows[prescribed + k];
                !defect.is_finite() || !entries.iter().all(|x| x.is_finite())
            };
            let broken: Vec<usize> = (0..own.len()).filter(not_finite).map(|k| own[k]).collect();
            if !broken.is_empty() {
                return Err(if step == 0 { NoStart::NotFinite(broken) } else { NoStart::NotReached(broken) });
            }
            let x = if rate == 0 { &mut found.position } else { &mut found.speed };
            let size = x.iter().fold(1.0f64, |size, x| size.max(x.abs()));
            // A row in another unit, such as an area, scales with its slope.
            let is_unsatisfied = |k: usize| !(rows[k].defect.abs() <= TOLERANCE * size * rows[k].size().max(1.0));
            let Least { change, follow } = match least_change(&rows, CONTRADICTION * size) {
                Ok(least) => least,
                Err(_) if !(prescribed..rows.len()).any(is_unsatisfied) => break,
                Err(Conflict { row, conflicting }) => {
                    let conflicting: Vec<usize> = conflicting.into_iter().filter(|k| *k < prescribed).collect();
                    return Err(match row.checked_sub(prescribed) {
                        Some(row) if !conflicting.is_empty() => {
                            NoStart::Contradiction { row: own[row], rate, prescribed: conflicting }
                        }
                        Some(row) if rows[prescribed + row].entries.iter().all(|x| *x == 0.0) => {
                            NoStart::Flat(vec![own[row]])
                        }
                        _ => NoStart::Dependent,
                    });
                }
            };
            let unsatisfied: Vec<usize> =
                (prescribed..rows.len()).filter(|k| !follow.contains(k) && is_unsatisfied(*k)).collect();
            if !unsatisfied.is_empty() && step == MOST {
                return Err(NoStart::NotReached(unsatisfied.into_iter().map(|k| own[k - prescribed]).collect()));
            }
            x.iter_mut().zip(change).for_each(|(x, change)| *x -= change);
            if unsatisfied.is_empty() {
                break;
            }
        }
        Ok(())
    }

    /// The nearest of the solutions that are found from beside the point where the slopes of free values vanish; only
    /// where some value is given.
    fn beside(&mut self, begin: &StartOnRows, open: &[usize]) -> Option<StartOnRows> {
        if self.prescribed.values[0].is_empty() {
            return None;
        }
        let mut nearest: Option<(f64, StartOnRows)> = None;
        for moved in open.iter().map(std::slice::from_ref).chain([open]) {
            for shift in BESIDE {
                let mut found = begin.clone();
                moved.iter().for_each(|k| found.position[*k] += shift);
                if self.solve(0, &mut found).is_err() {
                    continue;
                }
                let far: f64 =
                    found.position.iter().zip(&begin.position).map(|(now, then)| (now - then) * (now - then)).sum();
                // Of two equally distant ones the first one counts.
                if nearest.as_ref().is_none_or(|(least, _)| far < least * (1.0 - CONTRADICTION)) {
                    nearest = Some((far, found));
                }
            }
        }
        nearest.map(|(_, found)| found)
    }
}

/// The smallest change that removes defects, and numbers of rows that follow from those before them.
struct Least {
    change: Vec<f64>,
    follow: Vec<usize>,
}

/// A row that contradicts those before it, and which of them.
struct Conflict {
    row: usize,
    conflicting: Vec<usize>,
}

/// `Gᵀ (G Gᵀ)⁻¹ d`, by Gram-Schmidt, which finds the new part of each row. A row that follows from others is satisfied
/// if its residual is at most `left`.
fn least_change(rows: &[Row], tolerance: f64) -> Result<Least, Conflict> {
    let r = rows.first().map_or(0, |row| row.entries.len());
    let mut out = Least { change: vec![0.0; r], follow: Vec::new() };
    // Directions, with their coefficients over the rows.
    let mut basis: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    for (k, row) in rows.iter().enumerate() {
        let size = dot(&row.entries, &row.entries).sqrt();
        let scale = if size > 0.0 { 1.0 / size } else { 1.0 };
        let mut new: Vec<f64> = row.entries.iter().map(|x| x * scale).collect();
        let mut from = vec![0.0; rows.len()];
        from[k] = scale;
        for _ in 0..2 {
            for (other, made) in &basis {
                let share = dot(&new, other);
                new.iter_mut().zip(other).for_each(|(x, y)| *x -= share * y);
                from.iter_mut().zip(made).for_each(|(x, y)| *x -= share * y);
            }
        }
        // The remaining defect after the change so far.
        let rest = row.defect - dot(&row.entries, &out.change);
        let length = dot(&new, &new).sqrt();
        if length > DEPENDENT {
            let factor = rest * scale / length;
            new.iter_mut().for_each(|x| *x /= length);
            from.iter_mut().for_each(|x| *x /= length);
            out.change.iter_mut().zip(&new).for_each(|(change, x)| *change += factor * x);
            basis.push((new, from));
        } else if rest.abs() <= tolerance * size.max(1.0) {
            out.follow.push(k);
        } else {
            let conflicting = (0..k).filter(|other| {
                (from[*other] * dot(&rows[*other].entries, &rows[*other].entries).sqrt()).abs() > DEPENDENT
            });
            return Err(Conflict { row: k, conflicting: conflicting.collect() });
        }
    }
    Ok(out)
}

/// The first multiplier constraint that depends on those before it at all of these positions, to ten digits; none where
/// one of them is not a number.
pub fn follows_everywhere(reduced: &Reduced, positions: &[Vec<f64>]) -> Option<usize> {
    let prescribed = StartValues::default();
    let mut search = Search::new(reduced, &prescribed);
    let speed = vec![0.0; search.r];
    let mut at = |position: &Vec<f64>| -> Vec<usize> {
        let values = search.at(&StartOnRows { position: position.clone(), speed: speed.clone() });
        let rows: Vec<Row> = (0..search.count).map(|k| search.row(&values, k, 0.0)).collect();
        match rows.iter().flat_map(|row| &row.entries).all(|x| x.is_finite()) {
            true => least_change(&rows, 0.0).map_or_else(|_| Vec::new(), |least| least.follow),
            false => Vec::new(),
        }
    };
    let found: Vec<Vec<usize>> = positions.iter().map(&mut at).collect();
    found.first()?.iter().copied().find(|row| found.iter().all(|own| own.contains(row)))
}

/// The inertia matrix with the squares of the multiplier constraints at a position: definite if and only if all motions
/// that these leave free there have inertia. `None` where an entry is not a number.
pub fn inertia_with_rows(reduced: &Reduced, position: &[f64]) -> Option<Vec<SparseNumbers>> {
    let motion = Motion::at_time_zero(reduced);
    let rows = &motion.frictions[motion.frictions.len() - motion.multiplier_constraints.len()..];
    let entries: Vec<Expr> = rows.iter().flat_map(|row| row.values().copied()).collect();
    let mut values = motion.values_at(&entries, position, &[]).into_iter();
    let mut numbers = Vec::with_capacity(rows.len());
    for row in rows {
        let entries = row.keys().zip(values.by_ref()).map(|(i, value)| Some((*i, rational_from_f64(value)?)));
        numbers.push(entries.collect::<Option<SparseNumbers>>()?);
    }
    if !Kinematics::at_rest(reduced, position).basis.iter().all(|x| x.is_finite()) {
        return None;
    }
    let inertia = super::sparse_model(reduced, position).inertia;
    let mut sum: Vec<BTreeMap<usize, Rational>> = inertia.into_iter().map(|row| row.into_iter().collect()).collect();
    for row in &numbers {
        for (i, x) in row {
            for (j, y) in row {
                *sum[*i].entry(*j).or_insert(Rational::ZERO) += x * y;
            }
        }
    }
    Some(sum.into_iter().map(|row| row.into_iter().filter(|(_, x)| !x.is_zero()).collect()).collect())
}

/// A model whose multiplier constraints are linear ones: their coefficients at a position (of the reduced coordinates,
/// rad), exact where they are certainly fractions (times powers of π), else rounded, and from there on exact. Small
/// motions around a rest on them are the same: where multipliers (N m) carry torques there, rows that rotate also
/// rotate these, which adds `−λ ∂a/∂q` to the stiffness. For a row that is not a surface it is not symmetric.
///
/// # Errors
/// As of [`reduce`](super::reduce).
///
/// # Panics
/// If there is not a multiplier for each constraint row.
pub fn frozen(reduced: &Reduced, position: &[f64], multipliers: &[f64]) -> Result<Reduced, super::ReduceError> {
    assert_eq!(
        multipliers.len(),
        reduced.equations.multiplier_constraints.len(),
        "a multiplier for each constraint row"
    );
    let mut motion = Motion::at_time_zero(reduced);
    let entries: Vec<Expr> =
        motion.multiplier_constraints.iter().flat_map(|row| &row.row).map(|(_, entry)| *entry).collect();
    let angles = motion.symbols[..reduced.degrees_of_freedom()].to_vec();
    let slopes: Vec<Expr> = angles.iter().flat_map(|angle| motion.graph.derivatives(&entries, *angle)).collect();
    let values = motion.values_at(&[entries.as_slice(), &slopes].concat(), position, &[]);
    let r = reduced.degrees_of_freedom();
    let numeric = Kinematics::at_rest(reduced, position);
    let mut equations = reduced.equations.clone();
    let mut entry = 0;
    // A coordinate that is zero is so exactly; of another one the value is rounded.
    let at_zero = |symbol: Symbol| {
        let k = angles.iter().position(|angle| *angle == symbol)?;
        (position[k] == 0.0).then_some(Rational::ZERO)
    };
    let exact_values = lower(&motion.graph, &entries, &mut Rationals, at_zero);
    let exact = |output: usize| rational_from_f64(values[output]).unwrap_or(Rational::ZERO);
    let multiplier_constraints = std::mem::take(&mut equations.multiplier_constraints);
    equations.dependent_constraints.clear();
    for ((constraint, rate), multiplier) in
        multiplier_constraints.into_iter().zip(&motion.multiplier_constraints).zip(multipliers)
    {
        let carries = rational_from_f64(*multiplier).unwrap_or(Rational::ZERO);
        let (mut row, mut offset) = (Vec::new(), Rational::ZERO);
        let mut is_rounded = *multiplier != 0.0;
        for (shaft, _) in &rate.row {
            let value = exact_values[entry].clone().unwrap_or_else(|| exact(entry));
            is_rounded |= exact_values[entry].is_none();
            let slope = |j: usize| &carries * exact(entries.len() * (j + 1) + entry);
            let slopes = (0..r).map(|j| (reduced.coordinates[j], slope(j))).filter(|(_, slope)| !slope.is_zero());
            let torque = RestTorque { value: multiplier * values[entry], on_positions: slopes.collect() };
            let position_dependent = !torque.on_positions.is_empty() || !equations.transmissions.is_empty();
            if !carries.is_zero() && position_dependent {
                let (element, row) = (constraint.element.clone(), vec![(*shaft, Rational::ONE)]);
                equations.carried.push(DirectionalTerm { element, row, value: torque });
            }
            let angle = rational_from_f64(numeric.angles[*shaft]).unwrap_or(Rational::ZERO);
            entry += 1;
            if !value.is_zero() {
                offset += &value * angle;
                row.push((*shaft, value));
            }
        }
        if is_rounded {
            equations.rounded.push(constraint.element.clone());
        }
        row.sort_by_key(|(shaft, _)| *shaft);
        equations.add_constraint(DirectionalTerm { element: constraint.element, row, value: Exact::new(offset, 0) });
    }
    super::reduce(equations, None)
}
