//! How sticking directions that depend on each other share the torque that holds them.

use super::expansion::{Prospect, margin};
use crate::num::{Cholesky, dot};

/// The smallest torques relative to what each direction can hold at rest, `min Σ (λ/c)²`; memory of its own.
pub(super) struct Sharing {
    /// Sticking directions: the holding ones, then those that follow.
    pub(super) sticking: Vec<usize>,
    /// Rows of B: each of them as a combination of the holding ones.
    combination: Vec<f64>,
    /// Bᵀ C² B, and its factor.
    normal: Vec<f64>,
    factor: Cholesky,
    regular: bool,
    weights: Vec<f64>,
    /// Torque of each sticking direction, N m.
    pub(super) torques: Vec<f64>,
}

/// The independent ones among the sticking directions: their rows times the inverse inertia, and the factor of their Gram matrix.
pub(super) struct Holding<'a> {
    pub(super) directions: &'a [usize],
    pub(super) weighted: &'a [f64],
    pub(super) factor: &'a Cholesky,
}

impl Sharing {
    /// Memory for m directions over r coordinates.
    pub(super) fn new(m: usize, r: usize) -> Self {
        let least = m.min(r);
        Self {
            sticking: Vec::with_capacity(m),
            combination: vec![0.0; m * least],
            normal: vec![0.0; least * least],
            factor: Cholesky::new(0),
            regular: false,
            weights: vec![0.0; least],
            torques: vec![0.0; m],
        }
    }

    /// The directions that stick from now on.
    pub(super) fn choose(&mut self, holding: &[usize], following: &[usize]) {
        self.sticking.clear();
        self.sticking.extend(holding.iter().chain(following));
        self.factor = Cholesky::new(holding.len());
    }

    /// What depends on the position: B, and the factor of `Bᵀ C² B`. `rows` are all directions, c their largest torques.
    pub(super) fn prepare(&mut self, holding: &Holding<'_>, rows: &[f64], c: &[f64]) {
        let count = holding.directions.len();
        let r = rows.len() / c.len().max(1);
        for (row, &k) in self.sticking.iter().enumerate() {
            let coefficients = &mut self.combination[row * count..(row + 1) * count];
            if row < count {
                coefficients.fill(0.0);
                coefficients[row] = 1.0;
                continue;
            }
            for (a, value) in coefficients.iter_mut().enumerate() {
                *value = dot(&holding.weighted[a * r..(a + 1) * r], &rows[k * r..(k + 1) * r]);
            }
            holding.factor.solve(coefficients);
        }
        let normal = &mut self.normal[..count * count];
        normal.fill(0.0);
        for (row, &k) in self.sticking.iter().enumerate() {
            let b = &self.combination[row * count..(row + 1) * count];
            for (i, x) in b.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                for (entry, y) in normal[i * count..(i + 1) * count].iter_mut().zip(b) {
                    *entry += c[k] * c[k] * x * y;
                }
            }
        }
        self.regular = self.factor.factor(normal);
    }

    /// The torques, from those of the holding directions; false if they are not determined.
    pub(super) fn share(&mut self, hold_torque: &[f64], c: &[f64]) -> bool {
        if !self.regular {
            return false;
        }
        // (Bᵀ C² B) z = μ, λ = C² B z.
        let count = hold_torque.len();
        let z = &mut self.weights[..count];
        z.copy_from_slice(hold_torque);
        self.factor.solve(z);
        for (row, &k) in self.sticking.iter().enumerate() {
            self.torques[row] = c[k] * c[k] * dot(&self.combination[row * count..(row + 1) * count], z);
        }
        true
    }

    /// Whether all torques certainly stay within what each direction can hold at rest, c, for so long; `term` gives the terms of so many orders of the series of
    /// those that hold.
    pub(super) fn stays(
        &mut self,
        holding: usize,
        c: &[f64],
        (length, order): (f64, usize),
        term: impl Fn(usize, usize) -> f64,
    ) -> bool {
        let mut torques = vec![0.0; holding];
        let mut series = vec![0.0; order * self.sticking.len()];
        for k in 0..order {
            torques.iter_mut().enumerate().for_each(|(a, torque)| *torque = term(k, a));
            if !self.share(&torques, c) {
                return false;
            }
            let terms = series.iter_mut().skip(k).step_by(order);
            terms.zip(&self.torques).for_each(|(term, torque)| *term = *torque);
        }
        let mut scratch = vec![0.0; order];
        self.sticking.iter().zip(series.chunks_exact(order.max(1))).all(|(direction, series)| {
            [1.0, -1.0].into_iter().all(|sign| {
                margin(&mut scratch, length, series.iter().copied(), sign, c[*direction]) == Prospect::Stays
            })
        })
    }
}
