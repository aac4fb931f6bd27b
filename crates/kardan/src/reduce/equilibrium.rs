//! Positions at which a model rests: found by Newton's method, proven by Krawczyk's test.

use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, linalg::solvers::Qr};
use kardan_rt::Operator;

use super::{Motion, Reduced};
use crate::expr::{Domain, Expr, Floating, Graph, Interval, Intervals, Symbol, lower};
use crate::num::{Random, rational_to_f64};

/// Newton steps that are made at most, and halvings of one.
const STEPS: usize = 200;
const HALVINGS: usize = 40;
/// Starts besides the first one.
const STARTS: usize = 24;
/// Two equilibria are one if they are closer, relative to their size or to a radian (or metre).
const SAME: f64 = 1e-6;
const SEED: u64 = 0x6571_7569_6c69_6272;

/// A position at rest at which no torque is left, without inputs and friction, at time zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// The reduced position, rad or m.
    pub position: Vec<f64>,
    /// The radius around it within which there is exactly one, proven; `None`: found to rounding only.
    pub radius: Option<f64>,
    /// The largest torque that is left, N m.
    pub residual: f64,
}

/// What was found of equilibria.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibria {
    /// The one that the first start led to comes first; the others are from starts within a turn around it.
    pub found: Vec<Equilibrium>,
    /// Coordinates on which no torque depends: they stay where they were.
    pub free: Vec<usize>,
    /// A coordinate along which a torque (N m) acts that is the same everywhere: then there is none.
    pub constant: Option<(usize, f64)>,
    /// The smallest of the largest torques that was come to, with its place, where none was found.
    pub best: Option<(Vec<f64>, f64)>,
}

/// The static torques as expressions of the coordinates.
struct Statics {
    graph: Graph,
    symbols: Vec<Symbol>,
    /// Torques along coordinates, without those that are always zero, with the numbers of their coordinates.
    torques: Vec<(usize, Expr)>,
    /// Coordinates that they depend on.
    active: Vec<usize>,
    /// Derivatives, a row for each torque.
    slopes: Vec<Expr>,
}

impl Statics {
    fn new(reduced: &Reduced) -> Self {
        let (motion, r) = (Motion::at_time_zero(reduced), reduced.degrees_of_freedom());
        let mut graph = Graph::default();
        let mut symbols = Vec::with_capacity(r);
        let mut values = Vec::with_capacity(2 * r);
        for (k, symbol) in motion.symbols.iter().enumerate() {
            let (name, dimension) = motion.graph.name(*symbol);
            let value = if k < r { graph.new_symbol(name.to_string(), dimension) } else { graph.integer(0) };
            symbols.extend(graph.symbol_of(value));
            values.push((*symbol, value));
        }
        let torques: Vec<Expr> =
            motion.passive.iter().map(|force| graph.copied(&motion.graph, *force, &values)).collect();
        let torques: Vec<(usize, Expr)> =
            torques.into_iter().enumerate().filter(|(_, torque)| !graph.is_zero(*torque)).collect();
        let exprs: Vec<Expr> = torques.iter().map(|(_, torque)| *torque).collect();
        let used = graph.symbols(&exprs);
        let active: Vec<usize> = (0..r).filter(|k| used.contains(&symbols[*k])).collect();
        let columns: Vec<Vec<Expr>> = active.iter().map(|k| graph.derivatives(&exprs, symbols[*k])).collect();
        let slopes = (0..exprs.len()).flat_map(|i| columns.iter().map(move |column| column[i])).collect();
        Self { graph, symbols, torques, active, slopes }
    }

    fn at<D: Domain>(&self, domain: &mut D, exprs: &[Expr], place: impl Fn(usize) -> D::Value) -> Vec<D::Value> {
        let number = |symbol: Symbol| self.symbols.iter().position(|own| *own == symbol).unwrap_or_default();
        lower(&self.graph, exprs, domain, |symbol| place(number(symbol)))
    }

    fn residual(&self, position: &[f64]) -> Vec<f64> {
        let exprs: Vec<Expr> = self.torques.iter().map(|(_, torque)| *torque).collect();
        self.at(&mut Floating::<f64>::default(), &exprs, |k| position[k])
    }

    /// Newton's method with least squares; the position it ends at and the largest torque there.
    fn newton(&self, start: &[f64]) -> (Vec<f64>, f64) {
        let size = |list: &[f64]| list.iter().fold(0.0_f64, |most, x| if x.abs() <= most { most } else { x.abs() });
        let (mut position, rows, columns) = (start.to_vec(), self.torques.len(), self.active.len());
        let mut residual = self.residual(&position);
        for _ in 0..STEPS {
            if residual.iter().all(|x| *x == 0.0) {
                break;
            }
            let slopes = self.at(&mut Floating::<f64>::default(), &self.slopes, |k| position[k]);
            // Damped where directions are flat: the damping falls with the torques.
            let (scale, damping) = (size(&slopes), size(&residual).min(1e-6));
            let tall = Mat::from_fn(rows + columns, columns, |i, j| match i {
                i if i < rows => slopes[i * columns + j],
                i if i - rows == j => scale * damping.max(1e-13),
                _ => 0.0,
            });
            let right = Mat::from_fn(rows + columns, 1, |i, _| if i < rows { -residual[i] } else { 0.0 });
            let step = Qr::new(tall.as_ref()).solve_lstsq(&right);
            let (mut part, mut better) = (1.0, false);
            for _ in 0..HALVINGS {
                let mut next = position.clone();
                for (j, k) in self.active.iter().enumerate() {
                    next[*k] += part * step[(j, 0)];
                }
                let there = self.residual(&next);
                if size(&there) < size(&residual) {
                    (position, residual, better) = (next, there, true);
                    break;
                }
                part *= 0.5;
            }
            if !better {
                break;
            }
        }
        (position, size(&residual))
    }

    /// The torque that rounding alone makes at a position, N m.
    fn rounding(&self, position: &[f64]) -> f64 {
        let slopes = self.at(&mut Floating::<f64>::default(), &self.slopes, |k| position[k]);
        let width = self.active.len().max(1);
        let row = |slopes: &[f64]| {
            let moved = self.active.iter().zip(slopes).map(|(k, slope)| (slope * position[*k].abs().max(1.0)).abs());
            moved.sum::<f64>()
        };
        64.0 * f64::EPSILON * slopes.chunks(width).map(row).fold(0.0, f64::max)
    }

    /// The radius of a box around a position in which there is exactly one equilibrium (Krawczyk, Computing 4, 1969): with C near the inverse
    /// of the slopes, `x − C f(x) + (1 − C F′(X)) (X − x)` lies within the box X.
    fn proven(&self, position: &[f64]) -> Option<f64> {
        let n = self.active.len();
        if self.torques.len() != n {
            return None;
        }
        let slopes = self.at(&mut Floating::<f64>::default(), &self.slopes, |k| position[k]);
        let matrix = Mat::from_fn(n, n, |i, j| slopes[i * n + j]);
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
            let around = |k: usize| {
                let half = radius * position[k].abs().max(1.0);
                Interval { low: position[k] - half, high: position[k] + half }
            };
            let wide = self.at(&mut domain, &self.slopes, |k| {
                if self.active.contains(&k) { around(k) } else { Interval::point(position[k]) }
            });
            (0..n).all(|i| {
                let half = radius * position[self.active[i]].abs().max(1.0);
                let mut sum = Interval::point(0.0);
                for k in 0..n {
                    sum = plus(sum, times(Interval::point(-inverse[(i, k)]), here[k]));
                }
                for j in 0..n {
                    let mut entry = Interval::point(f64::from(u8::from(i == j)));
                    for k in 0..n {
                        entry = plus(entry, times(Interval::point(-inverse[(i, k)]), wide[k * n + j]));
                    }
                    let half = radius * position[self.active[j]].abs().max(1.0);
                    sum = plus(sum, times(entry, Interval { low: -half, high: half }));
                }
                -half < sum.low && sum.high < half
            })
        })
    }
}

/// Equilibria near a reduced position (rad or m), and those that starts within a turn around it lead to.
///
/// # Panics
/// If `start` has not one entry per coordinate.
pub fn equilibria(reduced: &Reduced, start: &[f64]) -> Equilibria {
    let (statics, r) = (Statics::new(reduced), reduced.degrees_of_freedom());
    let free: Vec<usize> = (0..r).filter(|k| !statics.active.contains(k)).collect();
    let mut out = Equilibria { found: Vec::new(), free, constant: None, best: None };
    let constant = statics.torques.iter().find_map(|(k, torque)| Some((*k, statics.graph.number_of(*torque)?)));
    if let Some((k, torque)) = constant {
        out.constant = Some((k, rational_to_f64(torque)));
        return out;
    }
    let mut random = Random::new(SEED);
    for attempt in 0..=STARTS {
        let mut from = start.to_vec();
        if attempt > 0 {
            statics.active.iter().for_each(|k| from[*k] += std::f64::consts::TAU * (random.unit() - 0.5));
        }
        let (position, residual) = statics.newton(&from);
        let near = |a: &f64, b: &f64| (a - b).abs() <= SAME * a.abs().max(1.0);
        let known = out.found.iter().any(|other| other.position.iter().zip(&position).all(|(a, b)| near(a, b)));
        if known {
            continue;
        }
        let radius = statics.proven(&position);
        if !(residual <= statics.rounding(&position)) && radius.is_none() {
            if out.best.as_ref().is_none_or(|(_, best)| residual < *best) {
                out.best = Some((position, residual));
            }
            continue;
        }
        // Where they are not isolated, another one is no news, nor where steps of the method led far away.
        let turn = std::f64::consts::TAU;
        let is_near = || position.iter().zip(start).all(|(a, b)| (a - b).abs() <= turn);
        if out.found.is_empty() || (radius.is_some() && is_near()) {
            out.found.push(Equilibrium { position, radius, residual });
        }
        if statics.torques.is_empty() {
            break;
        }
    }
    out
}
