//! The design of a channel that leaves the least interaction with the others.

use super::hold::{ZohPlant, plant_flow};
use crate::Clock;
use crate::matrix_parts::{column_range, is_finite, selected, side_by_side, stacked};
use crate::regulator::{SampledCost, SampledRegulator, sampled_lqr, stein};
use kardan_math::num::{Matrix, discretise};

/// What one channel should do: its error `c z + g τ + f d − ξ` vanishes in the ideal decoupled loop, in which the output of a
/// reference model of second order, ξ, is the only one that the channel uses.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Target {
    /// c, over the states of the plant.
    pub on_state: Vec<f64>,
    /// g, over the torques of the motors, N m.
    pub on_torque: Vec<f64>,
    /// f, over the disturbances, N m.
    pub on_disturbance: Vec<f64>,
    /// Error that is acceptable, rad or N m.
    pub acceptable: f64,
    /// Corner of the critically damped reference model, rad/s.
    pub bandwidth: f64,
}

/// A plant `ż = A z + B τ + W d` with motors, and what its channels should do.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Problem {
    pub a: Matrix<f64>,
    pub b: Matrix<f64>,
    pub w: Matrix<f64>,
    /// Time constants of the motors, s; zero for none.
    pub lags: Vec<f64>,
    pub targets: Vec<Target>,
    /// Acceptable change of each command from one sample to the next, N m.
    pub changes: Vec<f64>,
    pub clock: Clock,
}

/// The feedback `u = −K [z; τ of motors with a lag; past commands; d; ξ; r]`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solution {
    pub on_state: Matrix<f64>,
    pub on_lagged: Matrix<f64>,
    pub on_past: Matrix<f64>,
    pub on_disturbance: Matrix<f64>,
    pub on_model: Matrix<f64>,
    pub on_reference: Matrix<f64>,
    /// The Riccati equation of what feedback can change.
    pub regulator: SampledRegulator,
}

/// Where the parts of `s = [z; lagged torques; d; ξ; r]` begin.
struct Places {
    lagged: usize,
    disturbances: usize,
    model: usize,
    size: usize,
}

impl Problem {
    /// The feedback that minimises, per sample, the mean square of the errors over the acceptable ones plus the square of the
    /// changes of the commands over the acceptable ones. The errors are integrated exactly, between samples too.
    ///
    /// Disturbances are constant for the design, references too; both are known to the law.
    ///
    /// `None` if a number overflows or the Riccati equation has no stabilising solution.
    pub fn solve(&self) -> Option<Solution> {
        let (n, m, c) = (self.a.rows(), self.b.columns(), self.targets.len());
        let lagged: Vec<usize> = (0..m).filter(|&k| self.lags[k] > 0.0).collect();
        let places = {
            let disturbances = n + lagged.len();
            let model = disturbances + self.w.columns();
            Places { lagged: n, disturbances, model, size: model + 3 * c }
        };
        let (flow, input) = self.flow();
        let discrete = ZohPlant::new(&flow, &input, &self.cost(&places, &lagged), self.clock)?;
        // Regulated: z, lagged torques, past commands. Exogenous: d, ξ, r.
        let all = places.size + (discrete.past + 1) * m;
        let command = |j: usize| places.size + j;
        let regulated: Vec<usize> = (0..places.disturbances).chain((0..discrete.past * m).map(command)).collect();
        let exogenous: Vec<usize> = (places.disturbances..places.size).collect();
        let now: Vec<usize> = (discrete.past * m..(discrete.past + 1) * m).map(command).collect();
        let mut next = Matrix::zeros(all - m, all);
        for i in 0..places.size {
            (0..all).for_each(|j| next[(i, j)] = discrete.state[(i, j)]);
        }
        for i in 0..discrete.past * m {
            let from = if i < m { now[i] } else { places.size + i - m };
            next[(places.size + i, from)] = 1.0;
        }
        let mut cost = discrete.cost.scale(&(1.0 / self.clock.period));
        for (k, change) in self.changes.iter().enumerate() {
            let weight = 1.0 / (change * change);
            let (u, before) = (now[k], command(k));
            for (i, j, sign) in [(u, u, 1.0), (before, before, 1.0), (u, before, -1.0), (before, u, -1.0)] {
                cost[(i, j)] += sign * weight;
            }
        }
        let (a, b) = (selected(&next, &regulated, &regulated), selected(&next, &regulated, &now));
        let sampled = SampledCost {
            state: selected(&cost, &regulated, &regulated),
            input: selected(&cost, &now, &now),
            cross: selected(&cost, &regulated, &now),
        };
        let regulator = sampled_lqr(&a, &b, &sampled)?;
        // X₁₂ = A_clᵀ (X A₁₂ + X₁₂ A₂₂) + Q₁₂ − Kᵀ N₂ᵀ
        let (a12, a22) = (selected(&next, &regulated, &exogenous), selected(&next, &exogenous, &exogenous));
        let closed = a.minus(&b.multiply(&regulator.gain));
        let crossed = selected(&cost, &now, &exogenous);
        let x = &regulator.solution;
        let right = closed
            .transpose()
            .multiply(&x.multiply(&a12))
            .plus(&selected(&cost, &regulated, &exogenous))
            .minus(&regulator.gain.transpose().multiply(&crossed));
        let x12 = stein(&closed, &a22, &right)?;
        let weight = sampled.input.plus(&b.transpose().multiply(x).multiply(&b));
        let ahead = b.transpose().multiply(&x.multiply(&a12).plus(&x12.multiply(&a22))).plus(&crossed);
        let solved = weight.solve(&ahead)?;
        let columns = |matrix: &Matrix<f64>, first: usize, count: usize| column_range(matrix, first..first + count);
        let d = self.w.columns();
        let solution = Solution {
            on_state: columns(&regulator.gain, 0, n),
            on_lagged: columns(&regulator.gain, n, lagged.len()),
            on_past: columns(&regulator.gain, n + lagged.len(), discrete.past * m),
            on_disturbance: columns(&solved, 0, d),
            on_model: columns(&solved, d, 2 * c),
            on_reference: columns(&solved, d + 2 * c, c),
            regulator,
        };
        (is_finite(&solved) && is_finite(&solution.regulator.gain)).then_some(solution)
    }

    /// Aξ and Bξ of the sampled reference models, `ξ⁺ = Aξ ξ + Bξ r`; `None` if a number overflows.
    pub fn models(&self) -> Option<(Matrix<f64>, Matrix<f64>)> {
        let [flow, input] = self.model_flow();
        let found = discretise(&flow, &input, self.clock.period)?;
        Some((found.a, found.b))
    }

    /// The same in continuous time.
    fn model_flow(&self) -> [Matrix<f64>; 2] {
        let c = self.targets.len();
        let (mut flow, mut input) = (Matrix::zeros(2 * c, 2 * c), Matrix::zeros(2 * c, c));
        for (k, target) in self.targets.iter().enumerate() {
            let w = target.bandwidth;
            flow[(2 * k, 2 * k + 1)] = 1.0;
            flow[(2 * k + 1, 2 * k)] = -w * w;
            flow[(2 * k + 1, 2 * k + 1)] = -2.0 * w;
            input[(2 * k + 1, k)] = w * w;
        }
        [flow, input]
    }

    /// `ṡ = F s + G u`.
    fn flow(&self) -> (Matrix<f64>, Matrix<f64>) {
        let (plant, input) = plant_flow(&self.a, &self.b, &self.w, &self.lags);
        let [models, on_references] = self.model_flow();
        let (own, behind, references) = (plant.rows(), models.rows(), on_references.columns());
        let rest = behind + references;
        let moving = side_by_side(&[&plant, &Matrix::zeros(own, rest)]);
        let following = side_by_side(&[&Matrix::zeros(behind, own), &models, &on_references]);
        // References stay as they are.
        let flow = stacked(&[&moving, &following, &Matrix::zeros(references, own + rest)]);
        (flow, stacked(&[&input, &Matrix::zeros(rest, input.columns())]))
    }

    /// `Σ (error/acceptable)²` over `[s; u in force]`.
    fn cost(&self, places: &Places, lagged: &[usize]) -> Matrix<f64> {
        let size = places.size + self.b.columns();
        let mut out = Matrix::zeros(size, size);
        for (number, target) in self.targets.iter().enumerate() {
            let mut row = vec![0.0; size];
            row[..target.on_state.len()].copy_from_slice(&target.on_state);
            for (k, share) in target.on_torque.iter().enumerate() {
                match lagged.iter().position(|candidate| *candidate == k) {
                    Some(place) => row[places.lagged + place] += share,
                    None => row[places.size + k] += share,
                }
            }
            for (k, share) in target.on_disturbance.iter().enumerate() {
                row[places.disturbances + k] += share;
            }
            row[places.model + 2 * number] -= 1.0;
            row.iter_mut().for_each(|x| *x /= target.acceptable);
            for i in 0..size {
                (0..size).for_each(|j| out[(i, j)] += row[i] * row[j]);
            }
        }
        out
    }
}

#[cfg(test)]
#[path = "../../tests/unit/sampled/interaction.rs"]
mod tests;
