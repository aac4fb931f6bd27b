use std::sync::Arc;

use super::Law;
use crate::num::{Matrix, eigenvalues};
use crate::reduce::LinearModel;
use crate::results::Pole;

/// Poles of a linear model under the linear parts of its laws, 1/s, sorted by size.
///
/// State `[q_r; q̇_r; ξ]` with the states ξ of all laws: `q̈_r = H⁻¹(F u − S q_r − D q̇_r)`,
/// `u = C ξ + Dφ K q_r + Dω K q̇_r`, `ξ̇ = A ξ + Bφ K q_r + Bω K q̇_r + Bτ u`. `None` if a law is sampled, a matrix is
/// not finite, or the eigenvalue iteration fails.
///
/// # Panics
/// If the inertia matrix is singular.
pub fn closed_loop_poles(model: &LinearModel, laws: &[Arc<dyn Law>]) -> Option<Vec<Pole>> {
    eigenvalues(&closed_loop_matrix(model, laws)?).map(Pole::list)
}

/// The same without coordinates on which nothing depends, such as [`counting_charges`](super::counting_charges): their poles are exactly at
/// zero.
///
/// # Panics
/// As [`closed_loop_poles`].
pub fn poles_without(model: &LinearModel, laws: &[Arc<dyn Law>], coordinates: &[usize]) -> Option<Vec<Pole>> {
    let all = closed_loop_matrix(model, laws)?;
    let kept: Vec<usize> = (0..all.rows()).filter(|k| !coordinates.contains(k)).collect();
    eigenvalues(&Matrix::from_fn(kept.len(), kept.len(), |i, j| all[(kept[i], kept[j])])).map(Pole::list)
}

/// The state matrix whose eigenvalues are [`closed_loop_poles`].
///
/// # Panics
/// If the inertia matrix is singular.
pub fn closed_loop_matrix(model: &LinearModel, laws: &[Arc<dyn Law>]) -> Option<Matrix<f64>> {
    if laws.iter().any(|law| law.clock().is_some()) {
        return None;
    }
    let r = model.inertia.rows();
    let basis = model.basis.to_f64();
    let inertia = model.inertia.to_f64();
    let linear: Vec<_> = laws.iter().map(|law| law.linear()).collect();
    let n = 2 * r + linear.iter().map(|law| law.states.rows()).sum::<usize>();
    let mut a = Matrix::<f64>::zeros(n, n);
    let (stiffness, damping) = (inertia.solve(&model.stiffness.to_f64())?, inertia.solve(&model.damping.to_f64())?);
    let per_torque = inertia.solve(&model.input.to_f64())?;
    for i in 0..r {
        a[(i, r + i)] = 1.0;
        for j in 0..r {
            a[(r + i, j)] = -stiffness[(i, j)];
            a[(r + i, r + j)] = -damping[(i, j)];
        }
    }
    let mut first = 2 * r;
    for (law, linear) in laws.iter().zip(&linear) {
        let states = linear.states.rows();
        // u over the whole state.
        let (on_angles, on_speeds) = (linear.on_angles.multiply(&basis), linear.on_speeds.multiply(&basis));
        let command = Matrix::from_fn(law.inputs().len(), n, |i, j| match j {
            j if j < r => on_angles[(i, j)],
            j if j < 2 * r => on_speeds[(i, j - r)],
            j if (first..first + states).contains(&j) => linear.on_states[(i, j - first)],
            _ => 0.0,
        });
        for (row, name) in law.inputs().iter().enumerate() {
            let column = model.inputs.iter().position(|input| input == name)?;
            for i in 0..r {
                for j in 0..n {
                    a[(r + i, j)] += per_torque[(i, column)] * command[(row, j)];
                }
            }
        }
        let (angles, speeds) = (linear.angles.multiply(&basis), linear.speeds.multiply(&basis));
        let commanded = linear.torques.multiply(&command);
        for i in 0..states {
            for j in 0..n {
                a[(first + i, j)] += commanded[(i, j)];
            }
            for j in 0..r {
                a[(first + i, j)] += angles[(i, j)];
                a[(first + i, r + j)] += speeds[(i, j)];
            }
            for j in 0..states {
                a[(first + i, first + j)] += linear.states[(i, j)];
            }
        }
        first += states;
    }
    a.as_slice().iter().all(|x| x.is_finite()).then_some(a)
}
