//! Constraints that are not solved for a coordinate, as directions that hold: `G q̈_r + b = 0` with the derivatives of the row in exact terms.

use super::{Motion, Reduced, SparseRow};
use crate::equations::{Formula, Kept};
use crate::expr::{Expr, Symbol};
use crate::num::Rational;

/// What a run needs of a kept row besides its direction and its bias.
#[derive(Debug, Clone)]
pub struct KeptRate {
    /// Its coefficients over the shafts.
    pub row: Vec<(usize, Expr)>,
    /// φ, which vanishes; none for a row that has no integral.
    pub position: Option<Expr>,
    /// What vanishes of the speeds, `Σ a_i q̇_i` less what it is to be; none where accelerations alone are prescribed.
    pub speed: Option<Expr>,
    /// What `Σ a_i q̇_i` is.
    pub rate: Expr,
}

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
        let products: Vec<_> =
            terms.into_iter().map(|(a, x)| (self.graph.multiply(a, x), Rational::ONE)).collect();
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
