//! The poles of the closed loop.

use std::sync::Arc;

use super::matrix_parts::{is_finite, selected};
use super::{Counters, Law};
use kardan_math::num::{Matrix, eigenvalues, rational_to_f64};
use kardan_mechanics::reduce::{FirstOrder, LinearModel, over_states};
use kardan_results::Pole;

/// Poles of a linear model under the linear parts of its laws, 1/s, sorted by size.
///
/// State `[q_r; q̇_r; ξ]` with the states ξ of all laws (rates of coordinates without inertia are none): `q̈_r = H⁻¹(F u − S q_r − D q̇_r)`,
/// `u = C ξ + Dφ K q_r + Dω K q̇_r`, `ξ̇ = A ξ + Bφ K q_r + Bω K q̇_r + Bτ u`. `None` if a law is sampled, a matrix is
/// not finite, or the eigenvalue iteration fails.
///
/// # Panics
/// If the inertia matrix is singular.
pub fn closed_loop_poles(model: &LinearModel, laws: &[Arc<dyn Law>]) -> Option<Vec<Pole>> {
    eigenvalues(&closed_loop_matrix(model, laws)?).map(Pole::list)
}

/// The same without charges that are integrators without effect ([`counting_charges`](super::counting_charges)): their poles are exactly at zero.
///
/// # Panics
/// As [`closed_loop_poles`].
pub fn poles_excluding(model: &LinearModel, laws: &[Arc<dyn Law>], counters: &Counters) -> Option<Vec<Pole>> {
    let mut all = closed_loop_matrix(model, laws)?;
    for (counter, &measured) in counters.measured.iter().enumerate() {
        for i in (0..counters.directions.rows()).filter(|i| *i != measured) {
            let share = rational_to_f64(&counters.directions[(i, counter)]);
            let shares = (0..all.columns()).map(|j| (j, share * all[(measured, j)]));
            let shares: Vec<(usize, f64)> = shares.filter(|(_, x)| *x != 0.0).collect();
            shares.into_iter().for_each(|(j, x)| all[(i, j)] -= x);
        }
    }
    let retained: Vec<usize> = (0..all.rows()).filter(|k| !counters.measured.contains(k)).collect();
    eigenvalues(&selected(&all, &retained, &retained)).map(Pole::list)
}

/// The state matrix whose eigenvalues are [`closed_loop_poles`].
///
/// # Panics
/// If the inertia matrix is singular.
pub fn closed_loop_matrix(model: &LinearModel, laws: &[Arc<dyn Law>]) -> Option<Matrix<f64>> {
    if laws.iter().any(|law| law.clock().is_some()) {
        return None;
    }
    let basis = model.basis.to_f64();
    let matrices = [&model.inertia, &model.damping, &model.stiffness, &model.input].map(Matrix::to_f64);
    let plant = FirstOrder::new(model.moving(), matrices.each_ref())?;
    let own = plant.a.rows();
    let linear: Vec<_> = laws.iter().map(|law| law.linear()).collect();
    let n = own + linear.iter().map(|law| law.states.rows()).sum::<usize>();
    let mut a = Matrix::<f64>::zeros(n, n);
    for i in 0..own {
        (0..own).for_each(|j| a[(i, j)] = plant.a[(i, j)]);
    }
    let mut first = own;
    for (law, linear) in laws.iter().zip(&linear) {
        let states = linear.states.rows();
        // u over the whole state.
        let on_plant = over_states([&linear.on_angles, &linear.on_speeds], &basis, &plant.moving);
        let command = Matrix::from_fn(law.inputs().len(), n, |i, j| match j {
            j if j < own => on_plant[(i, j)],
            j if (first..first + states).contains(&j) => linear.on_states[(i, j - first)],
            _ => 0.0,
        });
        for (row, name) in law.inputs().iter().enumerate() {
            let column = model.inputs.iter().position(|input| input == name)?;
            for i in 0..own {
                for j in 0..n {
                    a[(i, j)] += plant.b[(i, column)] * command[(row, j)];
                }
            }
        }
        let from_plant = over_states([&linear.angles, &linear.speeds], &basis, &plant.moving);
        let commanded = linear.torques.multiply(&command);
        for i in 0..states {
            for j in 0..n {
                a[(first + i, j)] += commanded[(i, j)];
            }
            for j in 0..own {
                a[(first + i, j)] += from_plant[(i, j)];
            }
            for j in 0..states {
                a[(first + i, first + j)] += linear.states[(i, j)];
            }
        }
        first += states;
    }
    is_finite(&a).then_some(a)
}
