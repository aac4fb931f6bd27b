//! Rest positions of a model: computed by Newton's method, proven by Krawczyk's test.

use std::collections::BTreeMap;

use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, linalg::solvers::Qr};
use kardan_rt::Operator;

use super::{Motion, Reduced, SparseRow, contacts};
use crate::equations::{MultiplierLaw, UnilateralConstraint};
use kardan_expr::expr::{Domain, Expr, Floating, Graph, Interval, Intervals, Rationals, Symbol, lower};
use kardan_math::num::{
    Matrix, Random, Rational, Scalar, SparseRow as NumberRow, kernel, rational_from_f64, rational_to_f64, sparse_rows,
};
use kardan_math::units::{Dimension, Exact};

/// Most Newton steps, and halvings of one.
const STEPS: usize = 200;
const HALVINGS: usize = 40;
/// Starts of [`equilibria`] besides the first one.
pub const STARTS: usize = 24;
/// Two equilibria are equal if they are closer than this, relative to their size or to a radian (or metre).
const SAME: f64 = 1e-6;
/// Residual of a multiplier constraint that counts as satisfied, rad or m.
const OFF: f64 = 1e-9;
const SEED: u64 = 0x6571_7569_6c69_6272;

/// A position at rest without a residual torque, without inputs and friction, at time zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// The reduced position, rad or m.
    pub position: Vec<f64>,
    /// Rates of the coordinates: currents that flow.
    pub rates: Vec<f64>,
    /// The multiplier of each multiplier constraint, N m.
    pub multipliers: Vec<f64>,
    /// The radius around it within which there is exactly one, proven; `None`: accurate to rounding only.
    pub radius: Option<f64>,
    /// The largest residual torque, N m.
    pub residual: f64,
}

/// The result of a search for equilibria.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibria {
    /// The result of the first start comes first; the others are from starts within a turn around it.
    pub found: Vec<Equilibrium>,
    /// Coordinates on which no torque depends: they stay at their start.
    pub free: Vec<usize>,
    /// A coordinate on which a torque (N m) acts that is the same everywhere: then there is no equilibrium.
    pub constant: Option<(usize, f64)>,
    /// The smallest of the largest residual torques reached, with its position, where no equilibrium was found.
    pub best: Option<(Vec<f64>, f64)>,
    /// A position beyond a rigid stop, with the number of that unilateral constraint: it is not an equilibrium.
    pub beyond: Option<(Vec<f64>, usize)>,
}

/// A position that inputs keep at rest, as far as they can.
#[derive(Debug, Clone, PartialEq)]
pub struct Trim {
    /// The reduced position, rad or m.
    pub position: Vec<f64>,
    /// Rates of the coordinates: currents that flow.
    pub rates: Vec<f64>,
    /// The torque of each of the inputs that may balance it, N m.
    pub torques: Vec<f64>,
    /// The multiplier of each multiplier constraint, N m.
    pub multipliers: Vec<f64>,
    /// Multiplier constraints that are violated there, with their residuals, rad or m.
    pub unmet: Vec<(usize, f64)>,
    /// Whether the residual is at the level of rounding.
    pub at_rest: bool,
    /// The radius within which there is exactly one such position, proven, zero where this is one exactly; `None`:
    /// accurate to rounding only.
    pub radius: Option<f64>,
    /// The coordinate with the largest residual torque, and its value, N m.
    pub residual_torque: Option<(usize, f64)>,
}

/// The motion of coordinates without acceleration: with the speeds `base`, plus multiples of `directions` that are
/// unknowns.
#[derive(Debug, Clone, Default)]
pub(super) struct Moves {
    /// Of each coordinate, rad/s.
    pub base: Vec<Rational>,
    /// Over the coordinates.
    pub directions: Vec<Vec<(usize, Rational)>>,
}

/// The settings of a search for a rest position or a steady motion.
#[derive(Debug, Clone, Default)]
pub(super) struct Sought<'a> {
    /// Inputs whose torques are unknowns.
    pub inputs: &'a [usize],
    /// Coordinates that are given.
    pub fixed: &'a [usize],
    /// Rigid stops that are touched.
    pub stops: &'a [usize],
    /// Its motion; `None`: it is at rest, except for charges that are integrators without effect.
    pub moves: Option<&'a Moves>,
    /// Torques of inputs that are given, N m.
    pub torques: &'a [(usize, f64)],
}

/// The static torques as expressions of the coordinates, and of the torques of inputs and multipliers that balance
/// them.
pub(super) struct Statics {
    graph: Graph,
    /// The unknowns: coordinates, then currents, torques of inputs, and multipliers of multiplier constraints.
    symbols: Vec<Symbol>,
    /// Currents that may flow at rest, as directions over the coordinates: those whose charges are integrators without
    /// effect.
    pub(super) counters: Vec<Vec<(usize, Rational)>>,
    /// The residuals. First torques on coordinates, without those that are always zero, with the numbers of their
    /// coordinates; then, with larger numbers, the position equations of multiplier constraints.
    torques: Vec<(usize, Expr)>,
    /// The number of coordinates.
    coordinates: usize,
    /// The numbers of the multiplier constraints that constrain positions.
    rows: Vec<usize>,
    /// The unknowns on which they depend.
    active: Vec<usize>,
    /// Which of these are to be computed, as indices into `active`.
    free: Vec<usize>,
    /// Derivatives, a row for each torque.
    slopes: Vec<Expr>,
}

impl Statics {
    /// The torques with the unknowns; prescribed motions stay at their start.
    pub(super) fn new(reduced: &Reduced, sought: &Sought<'_>, start: &[f64]) -> Self {
        let Sought { inputs, fixed, stops, moves, torques: specified_torques } = *sought;
        let reduced = &*reduced.unrelaxed();
        let (mut motion, r) = (Motion::at_time_zero(reduced), reduced.degrees_of_freedom());
        let (numbers, rows): (Vec<usize>, Vec<Expr>) =
            rows_of_positions(reduced, &mut motion, start).into_iter().unzip();
        let counters = moves.map_or_else(|| counters(reduced, &mut motion), |moves| moves.directions.clone());
        let mut graph = Graph::default();
        let mut symbols = Vec::with_capacity(r);
        let mut values = Vec::with_capacity(2 * r);
        for (k, symbol) in motion.symbols.iter().enumerate() {
            let (name, dimension) = motion.graph.name(*symbol);
            let value = match k.checked_sub(r) {
                None => graph.new_symbol(name.to_string(), dimension),
                Some(k) => graph.number(moves.map_or(Rational::ZERO, |moves| moves.base[k].clone())),
            };
            symbols.extend(graph.symbol_of(value));
            values.push((*symbol, value));
        }
        for current in &counters {
            let symbol = graph.new_symbol("current".into(), Dimension::NONE);
            symbols.extend(graph.symbol_of(symbol));
            for (k, share) in current {
                let part = graph.sum(Rational::ZERO, &[(symbol, share.clone())]);
                values[r + k].1 = graph.add(values[r + k].1, part);
            }
        }
        let mut torques: Vec<Expr> =
            motion.passive.iter().map(|force| graph.copied(&motion.graph, *force, &values)).collect();
        let mut writer = Writer { reduced, motion: &mut motion, values: &values };
        let sought = inputs.iter().map(|input| (*input, None));
        for (input, torque) in
            sought.chain(specified_torques.iter().map(|(input, torque)| (*input, rational_from_f64(*torque))))
        {
            let unknown = match torque {
                Some(torque) => graph.number(torque),
                None => graph.new_symbol(reduced.equations.inputs[input].element.clone(), Dimension::TORQUE),
            };
            symbols.extend(graph.symbol_of(unknown));
            writer.push(&writer.motion.inputs[input], unknown, &mut graph, &mut torques);
        }
        let first = writer.motion.frictions.len() - writer.motion.multiplier_constraints.len();
        for (k, constraint) in reduced.equations.multiplier_constraints.iter().enumerate() {
            let unknown = graph.new_symbol(constraint.element.clone(), Dimension::TORQUE);
            symbols.extend(graph.symbol_of(unknown));
            writer.push(&writer.motion.frictions[first + k], unknown, &mut graph, &mut torques);
        }
        torques.extend(rows.iter().map(|row| graph.copied(&writer.motion.graph, *row, &values)));
        writer.press(&mut graph, &mut torques);
        for &stop in stops {
            symbols.extend(writer.touch(stop, &mut graph, &mut torques));
        }
        let torques: Vec<(usize, Expr)> =
            torques.into_iter().enumerate().filter(|(_, torque)| !graph.is_zero(*torque)).collect();
        let exprs: Vec<Expr> = torques.iter().map(|(_, torque)| *torque).collect();
        let used = graph.symbols(&exprs);
        let active: Vec<usize> = (0..symbols.len()).filter(|k| used.contains(&symbols[*k])).collect();
        let free = (0..active.len()).filter(|j| !fixed.contains(&active[*j])).collect();
        let columns: Vec<Vec<Expr>> = active.iter().map(|k| graph.derivatives(&exprs, symbols[*k])).collect();
        let slopes = (0..exprs.len()).flat_map(|i| columns.iter().map(move |column| column[i])).collect();
        Self { graph, symbols, torques, counters, coordinates: r, rows: numbers, active, free, slopes }
    }

    fn at<D: Domain>(&self, domain: &mut D, exprs: &[Expr], place: impl Fn(usize) -> D::Value) -> Vec<D::Value> {
        let number = |symbol: Symbol| self.symbols.iter().position(|own| *own == symbol).unwrap_or_default();
        lower(&self.graph, exprs, domain, |symbol| place(number(symbol)))
    }

    fn residual(&self, position: &[f64]) -> Vec<f64> {
        let exprs: Vec<Expr> = self.torques.iter().map(|(_, torque)| *torque).collect();
        self.at(&mut Floating::<f64>::default(), &exprs, |k| position[k])
    }

    /// The number of coordinates.
    pub(super) fn degrees_of_freedom(&self) -> usize {
        self.coordinates
    }

    /// All unknowns, with the coordinates at a position and the others zero.
    pub(super) fn start(&self, position: &[f64]) -> Vec<f64> {
        let mut from = position.to_vec();
        from.resize(self.symbols.len(), 0.0);
        from
    }

    /// Slopes by each unknown on which a torque depends, each row relative to its largest entry.
    pub(super) fn columns(&self, position: &[f64]) -> BTreeMap<usize, Vec<f64>> {
        let slopes = self.at(&mut Floating::<f64>::default(), &self.slopes, |k| position[k]);
        let width = self.active.len();
        let row = |i: usize| &slopes[i * width..(i + 1) * width];
        let scale = |i: usize| row(i).iter().fold(0.0, |most, x| f64::max(most, x.abs())).max(f64::MIN_POSITIVE);
        let scales: Vec<f64> = (0..self.torques.len()).map(scale).collect();
        let column = |j: &usize| {
            let entries = scales.iter().enumerate().map(|(i, scale)| row(i)[*j] / scale);
            (self.active[*j], entries.collect())
        };
        self.free.iter().map(column).collect()
    }

    /// Rates of all coordinates.
    fn rates(&self, currents: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.coordinates];
        for (direction, current) in self.counters.iter().zip(currents) {
            direction.iter().for_each(|(k, share)| out[*k] += rational_to_f64(share) * current);
        }
        out
    }

    /// The residual torques at a position, on the coordinates.
    pub(super) fn residual_torque(&self, position: &[f64]) -> Vec<(usize, f64)> {
        let all = self.torques.iter().zip(self.residual(position));
        all.map(|((k, _), torque)| (*k, torque)).filter(|(k, _)| *k < self.coordinates).collect()
    }

    /// Newton's method with least squares; the position it ends at and the largest torque there.
    pub(super) fn newton(&self, start: &[f64]) -> (Vec<f64>, f64) {
        let size = |list: &[f64]| list.iter().fold(0.0_f64, |most, x| if x.abs() <= most { most } else { x.abs() });
        let (mut position, rows, columns, width) =
            (start.to_vec(), self.torques.len(), self.free.len(), self.active.len());
        let mut residual = self.residual(&position);
        for _ in 0..STEPS {
            if columns == 0 || residual.iter().all(|x| *x == 0.0) {
                break;
            }
            let slopes = self.at(&mut Floating::<f64>::default(), &self.slopes, |k| position[k]);
            // Damped where directions are flat: the damping decreases with the torques.
            let (scale, damping) = (size(&slopes), size(&residual).min(1e-6));
            let tall = Mat::from_fn(rows + columns, columns, |i, j| match i {
                i if i < rows => slopes[i * width + self.free[j]],
                i if i - rows == j => scale * damping.max(1e-13),
                _ => 0.0,
            });
            let right = Mat::from_fn(rows + columns, 1, |i, _| if i < rows { -residual[i] } else { 0.0 });
            let step = Qr::new(tall.as_ref()).solve_lstsq(&right);
            let (mut part, mut better) = (1.0, false);
            for _ in 0..HALVINGS {
                let mut next = position.clone();
                for (j, place) in self.free.iter().enumerate() {
                    next[self.active[*place]] += part * step[(j, 0)];
                }
                let next_residual = self.residual(&next);
                if size(&next_residual) < size(&residual) {
                    (position, residual, better) = (next, next_residual, true);
                    break;
                }
                part *= 0.5;
            }
            if !better {
                break;
            }
        }
        let residual_torque =
            self.residual_torque(&position).iter().fold(0.0_f64, |most, (_, torque)| most.max(torque.abs()));
        (position, residual_torque)
    }

    /// Whether the residual at a position is at the level of rounding: for torques relative to the largest of them, for
    /// each position equation relative to itself.
    pub(super) fn is_settled(&self, position: &[f64]) -> bool {
        let slopes = self.at(&mut Floating::<f64>::default(), &self.slopes, |k| position[k]);
        let width = self.active.len();
        let row = |row: usize| {
            let slopes = &slopes[row * width..(row + 1) * width];
            let moved = self.active.iter().zip(slopes).map(|(k, slope)| (slope * position[*k].abs().max(1.0)).abs());
            64.0 * f64::EPSILON * moved.sum::<f64>()
        };
        let rounding: Vec<f64> = (0..self.torques.len()).map(row).collect();
        let of_torques = self.torques.iter().zip(&rounding).filter(|((k, _), _)| *k < self.coordinates);
        let most = of_torques.fold(0.0, |most, (_, own)| f64::max(most, *own));
        let mut all = self.torques.iter().zip(self.residual(position)).zip(&rounding);
        rounding.iter().all(|own| own.is_finite())
            && all.all(|(((k, _), residual_torque), own)| {
                residual_torque.abs() <= if *k < self.coordinates { most } else { *own }
            })
    }

    /// A coordinate on which a torque (N m) acts that is the same everywhere and, rounding included, not zero.
    pub(super) fn constant(&self) -> Option<(usize, f64)> {
        let vanishes = |torque| self.at(&mut Intervals, &[torque], |_| Interval::ALL)[0].contains(0.0);
        let mut of_coordinates = self.torques.iter().filter(|(k, _)| *k < self.coordinates);
        let (k, torque) =
            of_coordinates.find(|(_, torque)| self.graph.symbols(&[*torque]).is_empty() && !vanishes(*torque))?;
        Some((*k, self.at(&mut Floating::<f64>::default(), &[*torque], |_| 0.0)[0]))
    }

    /// Multiplier constraints that are violated at a position, with their residuals.
    fn unmet(&self, position: &[f64]) -> Vec<(usize, f64)> {
        let rows = self.torques.iter().zip(self.residual(position)).filter(|((k, _), _)| *k >= self.coordinates);
        let off = rows.map(|((k, _), residual_torque)| (self.rows[*k - self.coordinates], residual_torque));
        off.filter(|(_, residual_torque)| !(residual_torque.abs() <= OFF)).collect()
    }

    /// The unknowns, with multipliers of rounding size set to zero.
    fn zero_negligible_multipliers(&self, mut found: Vec<f64>, inputs: usize) -> Vec<f64> {
        for k in self.coordinates + self.counters.len() + inputs..found.len() {
            let carries = std::mem::take(&mut found[k]);
            if carries != 0.0 && !self.is_settled(&found) {
                found[k] = carries;
            }
        }
        found
    }

    /// Whether the residual torque is exactly zero.
    pub(super) fn is_exact(&self, position: &[f64]) -> bool {
        let exprs: Vec<Expr> = self.torques.iter().map(|(_, torque)| *torque).collect();
        let found = self.at(&mut Rationals, &exprs, |k| rational_from_f64(position[k]));
        found.iter().all(|torque| torque.as_ref().is_some_and(Scalar::is_zero))
    }

    /// As many of the unknowns as there are torques, such that these determine them; the others stay constant.
    fn determined(&self, slopes: &[f64]) -> Option<Vec<usize>> {
        let (n, width) = (self.torques.len(), self.active.len());
        if self.free.len() <= n {
            return (self.free.len() == n).then(|| self.free.clone());
        }
        let mut rows: Vec<Vec<f64>> =
            (0..n).map(|i| self.free.iter().map(|j| slopes[i * width + j]).collect()).collect();
        let mut chosen = Vec::new();
        for i in 0..n {
            let size = |j: &usize| rows[i][*j].abs();
            let pivot = (0..self.free.len()).max_by(|a, b| size(a).total_cmp(&size(b)))?;
            if size(&pivot) == 0.0 {
                return None;
            }
            let own = rows[i].clone();
            for row in &mut rows[i + 1..] {
                let factor = row[pivot] / own[pivot];
                row.iter_mut().zip(&own).for_each(|(x, y)| *x -= factor * y);
                row[pivot] = 0.0;
            }
            chosen.push(self.free[pivot]);
        }
        Some(chosen)
    }

    /// The radius of a box around a position in which there is exactly one equilibrium (Krawczyk, Computing 4, 1969): with C near the inverse
    /// of the slopes, `x − C f(x) + (1 − C F′(X)) (X − x)` lies within the box X.
    pub(super) fn proven(&self, position: &[f64]) -> Option<f64> {
        let (n, width) = (self.torques.len(), self.active.len());
        let slopes = self.at(&mut Floating::<f64>::default(), &self.slopes, |k| position[k]);
        let places = self.determined(&slopes)?;
        let unknowns: Vec<usize> = places.iter().map(|place| self.active[*place]).collect();
        let matrix = Mat::from_fn(n, n, |i, j| slopes[i * width + places[j]]);
        let inverse = Qr::new(matrix.as_ref()).solve_lstsq(&Mat::<f64>::identity(n, n));
        if (0..n).any(|i| (0..n).any(|j| !inverse[(i, j)].is_finite())) {
            return None;
        }
        let exprs: Vec<Expr> = self.torques.iter().map(|(_, torque)| *torque).collect();
        let mut domain = Intervals;
        let here = self.at(&mut domain, &exprs, |k| Interval::point(position[k]));
        let times = |a: Interval, b: Interval| Intervals.operation(Operator::Multiply, &[a, b]);
        let plus = |a: Interval, b: Interval| Intervals.operation(Operator::Add, &[a, b]);
        [1e-12, 1e-10, 1e-8, 1e-6, 1e-4].into_iter().find(|radius| {
            let half = |k: usize| radius * position[k].abs().max(1.0);
            let interval_of = |k: usize| Interval { low: position[k] - half(k), high: position[k] + half(k) };
            let wide = self.at(&mut domain, &self.slopes, |k| {
                if unknowns.contains(&k) { interval_of(k) } else { Interval::point(position[k]) }
            });
            (0..n).all(|i| {
                let own = half(unknowns[i]);
                let mut sum = Interval::point(0.0);
                for k in 0..n {
                    sum = plus(sum, times(Interval::point(-inverse[(i, k)]), here[k]));
                }
                for j in 0..n {
                    let mut entry = Interval::point(f64::from(u8::from(i == j)));
                    for k in 0..n {
                        entry = plus(entry, times(Interval::point(-inverse[(i, k)]), wide[k * width + places[j]]));
                    }
                    let half = half(unknowns[j]);
                    sum = plus(sum, times(entry, Interval { low: -half, high: half }));
                }
                -own < sum.low && sum.high < own
            })
        })
    }
}

/// Directions of charges in which no torque changes, exactly: for a capacitor beside a winding their sum.
fn counters(reduced: &Reduced, motion: &mut Motion) -> Vec<Vec<(usize, Rational)>> {
    let is_charge = |k: &usize| reduced.equations.domain(reduced.coordinates[*k]).counts();
    let charges: Vec<usize> = (0..reduced.degrees_of_freedom()).filter(is_charge).collect();
    let passive = motion.passive.clone();
    let mut rows: Vec<Vec<Rational>> = vec![Vec::new(); passive.len()];
    // A charge on which a torque depends nonlinearly is excluded.
    let mut bent = Vec::new();
    for (place, &k) in charges.iter().enumerate() {
        let slopes = motion.graph.derivatives(&passive, motion.symbols[k]);
        let numbers: Vec<Option<Rational>> =
            slopes.iter().map(|slope| motion.graph.number_of(*slope).cloned()).collect();
        if numbers.iter().any(Option::is_none) {
            bent.push(place);
        }
        rows.iter_mut().zip(numbers).for_each(|(row, slope)| row.push(slope.unwrap_or_default()));
    }
    let unit = |at: usize| (0..charges.len()).map(|k| Rational::from(i64::from(k == at))).collect();
    rows.extend(bent.into_iter().map(unit));
    let matrix = Matrix::from_fn(rows.len(), charges.len(), |i, j| rows[i][j].clone());
    let directions = kernel(&matrix);
    let over_coordinates = |row: NumberRow| row.into_iter().map(|(place, x)| (charges[place], x)).collect();
    sparse_rows(&directions.transpose()).into_iter().map(over_coordinates).collect()
}

/// The position equations of multiplier constraints, as residuals: surfaces, and prescribed motions that stay at their
/// start.
fn rows_of_positions(reduced: &Reduced, motion: &mut Motion, start: &[f64]) -> Vec<(usize, Expr)> {
    let mut out = Vec::new();
    for (number, (constraint, row)) in
        reduced.equations.multiplier_constraints.iter().zip(motion.multiplier_constraints.clone()).enumerate()
    {
        match constraint.law {
            MultiplierLaw::Rates(_) => {}
            MultiplierLaw::Surface(_) => out.extend(row.position.map(|position| (number, position))),
            MultiplierLaw::Prescribed { .. } => {
                let terms = motion.products(&row.row, |motion, shaft| motion.angles[shaft]);
                let here = motion.graph.sum(Rational::ZERO, &terms);
                let begins = motion.values_at(&[here], start, &[]);
                let begins = motion.graph.number(rational_from_f64(begins[0]).unwrap_or(Rational::ZERO));
                out.push((number, motion.graph.subtract(here, begins)));
            }
        }
    }
    out
}

/// The position near `start` (rad or m) at which constant torques of these inputs balance the model; the coordinates in
/// `fixed` stay constant.
///
/// # Panics
/// If `start` has not one entry per coordinate, or there is no such input.
pub fn trim(reduced: &Reduced, start: &[f64], fixed: &[usize], inputs: &[usize]) -> Trim {
    let sought = Sought { inputs, fixed, ..Sought::default() };
    let (statics, r) = (Statics::new(reduced, &sought, start), reduced.degrees_of_freedom());
    let from = statics.start(start);
    let found = statics.zero_negligible_multipliers(statics.newton(&from).0, inputs.len());
    let radius = if statics.is_exact(&found) { Some(0.0) } else { statics.proven(&found) };
    let (position, rest) = found.split_at(r);
    let (currents, rest) = rest.split_at(statics.counters.len());
    let (torques, multipliers) = rest.split_at(inputs.len());
    Trim {
        at_rest: radius.is_some() || statics.is_settled(&found),
        radius,
        unmet: statics.unmet(&found),
        residual_torque: statics
            .residual_torque(&found)
            .into_iter()
            .max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs())),
        position: position.to_vec(),
        rates: statics.rates(currents),
        torques: torques.to_vec(),
        multipliers: multipliers.to_vec(),
    }
}

/// Torques along directions of a motion, written into static torques.
struct Writer<'a> {
    reduced: &'a Reduced,
    motion: &'a mut Motion,
    /// The expressions of the motion's symbols in the graph of the torques.
    values: &'a [(Symbol, Expr)],
}

impl Writer<'_> {
    /// `aᵀq − offset`, in the graph of the motion.
    fn gap(&mut self, unilateral: usize, offset: &Exact) -> Expr {
        let row = &self.reduced.equations.unilaterals[unilateral].row;
        let angle = self.motion.sum(row, |motion, shaft| motion.angles[shaft]);
        let offset = self.motion.exact(offset);
        self.motion.graph.subtract(angle, offset)
    }

    /// The direction of a unilateral constraint.
    fn direction(&self, unilateral: usize) -> &SparseRow {
        &self.motion.frictions[self.reduced.equations.frictions.len() + unilateral]
    }

    /// Adds a torque along a direction.
    fn push(&self, direction: &SparseRow, torque: Expr, graph: &mut Graph, torques: &mut [Expr]) {
        for (k, entry) in direction {
            let coefficient = graph.copied(&self.motion.graph, *entry, self.values);
            let part = graph.multiply(coefficient, torque);
            torques[*k] = graph.add(torques[*k], part);
        }
    }

    /// Soft stops have their stiffness where their gap is negative.
    fn press(&mut self, graph: &mut Graph, torques: &mut [Expr]) {
        for (k, unilateral) in self.reduced.equations.unilaterals.iter().enumerate() {
            let UnilateralConstraint::Cushion { offset, stiffness, .. } = &unilateral.value else { continue };
            let gap = self.gap(k, offset);
            let stiffness = self.motion.exact(stiffness);
            let own = &mut self.motion.graph;
            let zero = own.integer(0);
            let pressed = own.min(gap, zero);
            let push = own.multiply(stiffness, pressed);
            let push = own.negate(push);
            let push = graph.copied(&self.motion.graph, push, self.values);
            self.push(self.direction(k), push, graph, torques);
        }
    }

    /// A closed rigid stop: its gap vanishes, and its torque is an unknown, whose symbol is returned.
    fn touch(&mut self, unilateral: usize, graph: &mut Graph, torques: &mut Vec<Expr>) -> Option<Symbol> {
        let UnilateralConstraint::Stop { offset, .. } = &self.reduced.equations.unilaterals[unilateral].value else {
            return None;
        };
        let gap = self.gap(unilateral, offset);
        let contact_torque =
            graph.new_symbol(self.reduced.equations.unilaterals[unilateral].element.clone(), Dimension::TORQUE);
        self.push(self.direction(unilateral), contact_torque, graph, torques);
        torques.push(graph.copied(&self.motion.graph, gap, self.values));
        graph.symbol_of(contact_torque)
    }
}

/// Most rigid stops of which all combinations are tried.
const STOPS: usize = 4;

/// Equilibria near a reduced position (rad or m), and those reached from starts within a turn around it. Where there is
/// none with all rigid stops open, one with some of them closed.
///
/// # Panics
/// If `start` has not one entry per coordinate.
pub fn equilibria(reduced: &Reduced, start: &[f64]) -> Equilibria {
    let open = with_stops(reduced, start, &[]);
    if !open.found.is_empty() {
        return open;
    }
    let unilaterals = reduced.equations.unilaterals.iter().enumerate();
    let stops: Vec<usize> =
        unilaterals.filter(|(_, h)| matches!(h.value, UnilateralConstraint::Stop { .. })).map(|(k, _)| k).collect();
    let count = stops.len().min(STOPS);
    let choice = |bits: usize| (0..count).filter(|k| bits >> k & 1 == 1).map(|k| stops[k]).collect::<Vec<_>>();
    let resting = (1..1 << count).map(|bits| with_stops(reduced, start, &choice(bits)));
    resting.into_iter().find(|one| !one.found.is_empty()).unwrap_or(open)
}

/// Equilibria with these rigid stops closed and loaded, the others open.
fn with_stops(reduced: &Reduced, start: &[f64], stops: &[usize]) -> Equilibria {
    let sought = Sought { stops, ..Sought::default() };
    let (statics, r) = (Statics::new(reduced, &sought, start), reduced.degrees_of_freedom());
    let free: Vec<usize> = (0..r).filter(|k| !statics.active.contains(k)).collect();
    let mut out = Equilibria { found: Vec::new(), free, constant: None, best: None, beyond: None };
    out.constant = statics.constant();
    if out.constant.is_some() {
        return out;
    }
    let mut random = Random::new(SEED);
    for attempt in 0..=STARTS {
        let mut from = statics.start(start);
        if attempt > 0 {
            statics
                .active
                .iter()
                .filter(|k| **k < r)
                .for_each(|k| from[*k] += std::f64::consts::TAU * (random.unit() - 0.5));
        }
        let (found, residual) = statics.newton(&from);
        let found = statics.zero_negligible_multipliers(found, 0);
        let (position, rest) = (found[..r].to_vec(), &found[r..]);
        let (currents, unknowns) = rest.split_at(statics.counters.len());
        let (multipliers, pushes) = unknowns.split_at(unknowns.len() - stops.len());
        if pushes.iter().any(|push| *push < 0.0) {
            continue;
        }
        // A position beyond a stop is no rest position.
        let passed = contacts(reduced, &position).into_iter().find(|one| !one.soft && one.is_passed());
        if let Some(one) = passed.filter(|one| !stops.contains(&one.unilateral)) {
            if statics.is_settled(&found) && out.beyond.is_none() {
                out.beyond = Some((position, one.unilateral));
            }
            continue;
        }
        let near = |a: &f64, b: &f64| (a - b).abs() <= SAME * a.abs().max(1.0);
        let is_duplicate =
            out.found.iter().any(|candidate| candidate.position.iter().zip(&position).all(|(a, b)| near(a, b)));
        if is_duplicate {
            continue;
        }
        let radius = statics.proven(&found);
        if !statics.is_settled(&found) && radius.is_none() {
            if out.best.as_ref().is_none_or(|(_, best)| residual < *best) {
                out.best = Some((position, residual));
            }
            continue;
        }
        // Where they are not isolated, a further one adds nothing, nor where steps of the method led far away.
        let turn = std::f64::consts::TAU;
        let is_near = || position.iter().zip(start).all(|(a, b)| (a - b).abs() <= turn);
        if out.found.is_empty() || (radius.is_some() && is_near()) {
            let (rates, multipliers) = (statics.rates(currents), multipliers.to_vec());
            out.found.push(Equilibrium { position, rates, multipliers, radius, residual });
        }
        if statics.torques.is_empty() {
            break;
        }
    }
    out
}
