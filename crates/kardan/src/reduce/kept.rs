//! Constraints that are not solved for a coordinate, as directions that hold: `G q̈_r + b = 0` with the derivatives of the row in exact terms.

use super::{KeptRate, Motion, Reduced, SparseRow};
use crate::equations::{Formula, Kept};
use crate::expr::{Expr, Symbol};
use crate::num::{Lu, Rational, dot, rational_from_f64};

/// A row over all coordinates as if they were free: coefficients, φ, and what its coefficients change by, `Σ ȧ_i q̇_i`.
struct Free {
    motion: Motion,
    row: Vec<(usize, Expr)>,
    position: Option<Expr>,
}

impl Free {
    /// All coordinates of a model, as if none followed from others.
    pub(super) fn of(reduced: &Reduced) -> Reduced {
        Reduced {
            coordinates: (0..reduced.equations.coordinates.len()).collect(),
            equations: crate::assemble::Equations { kept: Vec::new(), ..reduced.equations.clone() },
            redundant: Vec::new(),
            steps: Vec::new(),
            relaxation: None,
        }
    }

    fn rates(reduced: &Reduced, row: &[(usize, std::sync::Arc<Formula>)]) -> Self {
        let free = Self::of(reduced);
        let mut motion = Motion::free(&free);
        let row = row.iter().map(|(shaft, a)| (*shaft, motion.formula(&free, a))).collect();
        Self { motion, row, position: None }
    }

    fn surface(reduced: &Reduced, formula: &Formula) -> Self {
        let free = Self::of(reduced);
        let mut motion = Motion::free(&free);
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
    /// Kept rows behind the directions of friction.
    pub(super) fn keep_rows(&mut self, reduced: &Reduced) {
        for kept in &reduced.equations.kept {
            let (rate, change) = match &kept.law {
                Kept::Rates(row) => self.take(Free::rates(reduced, row)),
                Kept::Surface(formula) => self.take(Free::surface(reduced, formula)),
                Kept::Position(row, function) => {
                    let (row, speed) = self.constant_row(row);
                    let [place, rate, bend] = [function.as_ref(), &function.rate(), &function.rate().rate()]
                        .map(|function| self.of_time(function));
                    let mut terms = vec![(place, Rational::from(-1))];
                    for (shaft, x) in &row {
                        terms.push((self.graph.multiply(*x, self.angles[*shaft]), Rational::ONE));
                    }
                    let position = Some(self.graph.sum(Rational::ZERO, &terms));
                    let speed = Some(self.graph.subtract(speed, rate));
                    let change = self.graph.negate(bend);
                    (KeptRate { row, position, speed, rate }, change)
                }
                Kept::Speed(row, function) => {
                    let (row, speed) = self.constant_row(row);
                    let [rate, bend] = [function.as_ref(), &function.rate()].map(|function| self.of_time(function));
                    let speed = Some(self.graph.subtract(speed, rate));
                    let change = self.graph.negate(bend);
                    (KeptRate { row, position: None, speed, rate }, change)
                }
                Kept::Acceleration(row, function) => {
                    let (row, rate) = self.constant_row(row);
                    let acceleration = self.of_time(function);
                    let change = self.graph.negate(acceleration);
                    (KeptRate { row, position: None, speed: None, rate }, change)
                }
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
            self.frictions.push(direction);
            self.friction_bias.push(bias);
            self.kept.push(rate);
        }
    }

    /// `Σ a_i x_i` over a kept row.
    pub fn along_kept(&mut self, kept: usize, of: impl Fn(&Self, usize) -> Expr) -> Expr {
        let row = self.kept[kept].row.clone();
        let terms: Vec<_> = row.into_iter().map(|(k, a)| (a, of(self, k))).collect();
        let products: Vec<_> = terms.into_iter().map(|(a, x)| (self.graph.multiply(a, x), Rational::ONE)).collect();
        self.graph.sum(Rational::ZERO, &products)
    }

    fn constant_row(&mut self, row: &[(usize, crate::units::Exact)]) -> (Vec<(usize, Expr)>, Expr) {
        let row: Vec<(usize, Expr)> = row.iter().map(|(shaft, x)| (*shaft, self.exact(x))).collect();
        let mut terms = Vec::new();
        for (shaft, x) in &row {
            terms.push((self.graph.multiply(*x, self.speeds[*shaft]), Rational::ONE));
        }
        let speed = self.graph.sum(Rational::ZERO, &terms);
        (row, speed)
    }

    /// A row over free coordinates, with angles and speeds of this motion in their place; and what its coefficients change by.
    fn take(&mut self, mut free: Free) -> (KeptRate, Expr) {
        let change = free.change();
        let n = self.angles.len();
        let here = self.angles.iter().chain(&self.speeds).copied();
        let places: Vec<(Symbol, Expr)> = free.motion.symbols.iter().copied().take(2 * n).zip(here).collect();
        let mut copy = |expr: Expr| self.graph.copied(&free.motion.graph, expr, &places);
        let change = copy(change);
        let position = free.position.map(&mut copy);
        let row: Vec<(usize, Expr)> = free.row.iter().map(|(shaft, entry)| (*shaft, copy(*entry))).collect();
        let mut terms = Vec::new();
        for (shaft, entry) in &row {
            terms.push((self.graph.multiply(*entry, self.speeds[*shaft]), Rational::ONE));
        }
        let speed = Some(self.graph.sum(Rational::ZERO, &terms));
        let rate = self.graph.integer(0);
        (KeptRate { row, position, speed, rate }, change)
    }
}

/// Angles and speeds to begin with that lie on the kept rows.
#[derive(Debug, Clone, PartialEq)]
pub struct StartOnRows {
    /// Reduced coordinates.
    pub position: Vec<f64>,
    /// Their speeds.
    pub speed: Vec<f64>,
}

/// Why there are none.
#[derive(Debug, Clone, PartialEq)]
pub enum NoStart {
    /// No place on the rows was found from where the search began; numbers of the rows that are not satisfied.
    NotReached(Vec<usize>),
    /// To ten digits, the rows depend on each other there.
    Dependent,
}

/// Steps of the search for a start.
const MOST: usize = 50;
/// Relative to its row, what of a pivot is taken for a dependence.
const DEPENDENT: f64 = 1e-10;
/// What is left of a row where it is satisfied, relative to the largest angle or speed, or to one.
const LEFT: f64 = 1e-12;

/// The start nearest to angles and speeds given, by the least squares of Newton's method; at time zero.
///
/// # Errors
/// [`NoStart`]
pub fn start_on_rows(reduced: &Reduced, position: &[f64], speed: &[f64]) -> Result<StartOnRows, NoStart> {
    start_on_rows_with(reduced, &[], position, speed)
}

/// The same of positions alone where these coordinates stay as they are given.
///
/// # Errors
/// [`NoStart`]
pub fn start_on_rows_with(
    reduced: &Reduced,
    fixed: &[usize],
    position: &[f64],
    speed: &[f64],
) -> Result<StartOnRows, NoStart> {
    let (r, count) = (reduced.degrees_of_freedom(), reduced.equations.kept.len());
    let motion = Motion::new(reduced);
    let first = reduced.equations.set_valued().count();
    let mut outputs = Vec::new();
    let zero = motion.graph.of_symbol(motion.symbols[0]);
    let mut wanted = vec![None; count * (r + 2)];
    for (k, row) in motion.frictions[first..].iter().enumerate() {
        let free = row.iter().filter(|(i, _)| !fixed.contains(i));
        free.for_each(|(i, entry)| wanted[k * r + i] = Some(*entry));
        (wanted[count * r + k], wanted[count * (r + 1) + k]) = (motion.kept[k].position, motion.kept[k].speed);
    }
    for (k, expr) in wanted.iter().enumerate() {
        outputs.extend(expr.or(zero).map(|expr| (k.to_string(), expr)));
    }
    let plan = motion.compile(&outputs);
    let mut memory = plan.memory();
    let mut at = |position: &[f64], speed: &[f64]| -> Vec<f64> {
        let given = position.iter().chain(speed).copied().chain(motion.timed.values(0.0));
        memory.iter_mut().zip(given).for_each(|(place, value)| *place = value);
        let _ = plan.block().evaluate(&mut memory);
        let value = |(k, expr): (usize, &Option<Expr>)| if expr.is_some() { memory[plan.place(k)] } else { 0.0 };
        wanted.iter().enumerate().map(value).collect()
    };
    let mut found = StartOnRows { position: position.to_vec(), speed: speed.to_vec() };
    for (part, of_speeds) in [(count * r, false), (count * (r + 1), true)] {
        // Rows that say nothing of positions, or of speeds, have no part in it.
        let takes_part = |k: &usize| wanted[part + k].is_some() && (fixed.is_empty() || !of_speeds);
        let own: Vec<usize> = (0..count).filter(takes_part).collect();
        for step in 0.. {
            let values = at(&found.position, &found.speed);
            let defects: Vec<f64> = own.iter().map(|k| values[part + k]).collect();
            if defects.iter().all(|defect| *defect == 0.0) {
                break;
            }
            let x = if of_speeds { &mut found.speed } else { &mut found.position };
            let size = x.iter().fold(1.0f64, |size, x| size.max(x.abs()));
            let rows: Vec<f64> = own.iter().flat_map(|k| &values[k * r..(k + 1) * r]).copied().collect();
            // A row in another unit, as an area, is as large as its slope says.
            let slope = |row: &[f64]| dot(row, row).sqrt().max(1.0);
            let allowed: Vec<f64> = (0..own.len()).map(|k| LEFT * size * slope(&rows[k * r..(k + 1) * r])).collect();
            let is_there = defects.iter().zip(&allowed).all(|(defect, allowed)| defect.abs() <= *allowed);
            let change = least_change(&rows, r, &defects);
            if !is_there && step == MOST {
                let open = own
                    .iter()
                    .zip(defects.iter().zip(&allowed))
                    .filter(|(_, (defect, most))| !(defect.abs() <= **most));
                return Err(NoStart::NotReached(open.map(|(k, _)| *k).collect()));
            }
            match change {
                Some(change) => x.iter_mut().zip(change).for_each(|(x, change)| *x -= change),
                None if is_there => break,
                None => return Err(NoStart::Dependent),
            }
            if is_there {
                break;
            }
        }
    }
    // What is fixed may leave a row nothing to move, which says nothing of the row.
    let rows = &at(&found.position, &found.speed)[..count * r];
    match fixed.is_empty() && least_change(rows, r, &vec![0.0; count]).is_none() {
        true => Err(NoStart::Dependent),
        false => Ok(found),
    }
}

/// The smallest change that takes defects away, `Gᵀ (G Gᵀ)⁻¹ d`; none where rows depend on each other.
fn least_change(rows: &[f64], r: usize, defects: &[f64]) -> Option<Vec<f64>> {
    let count = defects.len();
    let row = |k: usize| &rows[k * r..(k + 1) * r];
    // Gram-Schmidt tells what of each row is new.
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for k in 0..count {
        let size = dot(row(k), row(k)).sqrt();
        let mut new: Vec<f64> = row(k).iter().map(|x| x / size).collect();
        for _ in 0..2 {
            for other in &basis {
                let share = dot(&new, other);
                new.iter_mut().zip(other).for_each(|(x, y)| *x -= share * y);
            }
        }
        let left = dot(&new, &new).sqrt();
        if !(left > DEPENDENT) {
            return None;
        }
        basis.push(new.iter().map(|x| x / left).collect());
    }
    let gram: Vec<f64> = (0..count * count).map(|k| dot(row(k / count), row(k % count))).collect();
    let (mut factor, mut share) = (Lu::new(count), defects.to_vec());
    factor.factor(&gram);
    factor.solve(&mut share);
    Some((0..r).map(|i| (0..count).map(|k| row(k)[i] * share[k]).sum()).collect())
}

/// A model whose kept rows are linear ones: their coefficients at a position (of the reduced coordinates, rad), from there on exact. Small
/// motions around a rest on them are the same: where multipliers (N m) carry torques there, rows that turn turn these with them, which adds
/// `−λ ∂a/∂q` to the stiffness. Of a row that is no surface it is not symmetric.
///
/// # Errors
/// As of [`reduce`](super::reduce).
///
/// # Panics
/// If there is not a multiplier for each kept row.
pub fn frozen(reduced: &Reduced, position: &[f64], multipliers: &[f64]) -> Result<Reduced, super::ReduceError> {
    assert_eq!(multipliers.len(), reduced.equations.kept.len(), "a multiplier for each kept row");
    let mut motion = Motion::at_time_zero(reduced);
    let entries: Vec<Expr> = motion.kept.iter().flat_map(|row| &row.row).map(|(_, entry)| *entry).collect();
    let angles = motion.symbols[..reduced.degrees_of_freedom()].to_vec();
    let slopes: Vec<Expr> = angles.iter().flat_map(|angle| motion.graph.derivatives(&entries, *angle)).collect();
    let outputs: Vec<(String, Expr)> =
        entries.iter().chain(&slopes).enumerate().map(|(k, expr)| (k.to_string(), *expr)).collect();
    let plan = motion.compile(&outputs);
    let mut memory = plan.memory();
    memory.iter_mut().zip(position).for_each(|(place, value)| *place = *value);
    let r = reduced.degrees_of_freedom();
    memory[r..2 * r].fill(0.0);
    let _ = plan.block().evaluate(&mut memory);
    let mut numeric = super::Kinematics::new(reduced);
    numeric.update(position, &vec![0.0; r]);
    let mut equations = reduced.equations.clone();
    let mut entry = 0;
    let exact = |output: usize| rational_from_f64(memory[plan.place(output)]).unwrap_or(Rational::ZERO);
    let kept = std::mem::take(&mut equations.kept);
    equations.kept_again.clear();
    for ((kept, rate), multiplier) in kept.into_iter().zip(&motion.kept).zip(multipliers) {
        let carries = rational_from_f64(*multiplier).unwrap_or(Rational::ZERO);
        let (mut row, mut offset) = (Vec::new(), Rational::ZERO);
        for (shaft, _) in &rate.row {
            let value = exact(entry);
            let slope = |j: usize| &carries * exact(entries.len() * (j + 1) + entry);
            let slopes = (0..r).map(|j| (reduced.coordinates[j], slope(j))).filter(|(_, slope)| !slope.is_zero());
            let torque = crate::assemble::RestTorque {
                value: multiplier * memory[plan.place(entry)],
                on_positions: slopes.collect(),
            };
            let bends = !torque.on_positions.is_empty() || !equations.transmissions.is_empty();
            if !carries.is_zero() && bends {
                let row = vec![(*shaft, Rational::ONE)];
                equations.carried.push(crate::assemble::Along { element: kept.element.clone(), row, value: torque });
            }
            let angle = rational_from_f64(numeric.angles[*shaft]).unwrap_or(Rational::ZERO);
            entry += 1;
            if !value.is_zero() {
                offset += &value * angle;
                row.push((*shaft, value));
            }
        }
        row.sort_by_key(|(shaft, _)| *shaft);
        let place = equations.constraints.len() - equations.nodes.len();
        let value = crate::units::Exact::new(offset, 0);
        equations.constraints.insert(place, crate::assemble::Along { element: kept.element, row, value });
    }
    super::reduce(equations, None)
}
