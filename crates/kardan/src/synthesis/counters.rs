//! Charges that only count what has flowed.

use std::sync::Arc;

use super::{Law, Plant};
use crate::analysis::LinearSystem;
use crate::equations::Domain;
use crate::num::{Matrix, Rational};

/// Places among the states of a plant's system of all but the charges on which nothing depends, such as that of a motor's winding: their columns
/// of A and C are zero. They count what has flowed, and no law holds them. Exact.
pub(super) fn without_counters(plant: &Plant, system: &LinearSystem) -> Vec<usize> {
    let counts = |k: &usize| is_charge(plant, *k) && is_zero(&system.a, *k) && is_zero(&system.c, *k);
    (0..system.states.len()).filter(|k| !counts(k)).collect()
}

/// Reduced coordinates that are charges on which neither the plant nor laws depend: each is a pole of their loop exactly at zero. None where
/// a law is made for a sample time.
pub fn counting_charges(plant: &Plant, laws: &[Arc<dyn Law>]) -> Vec<usize> {
    if laws.iter().any(|law| law.clock().is_some()) {
        return Vec::new();
    }
    let basis = plant.linear.basis.to_f64();
    let acting: Vec<Vec<bool>> = laws.iter().map(|law| acts_by(&**law, &basis)).collect();
    let free = |k: &usize| acting.iter().all(|acts| !acts[*k]);
    let counts = |k: &usize| is_charge(plant, *k) && is_zero(&plant.linear.stiffness, *k) && free(k);
    (0..plant.reduced.degrees_of_freedom()).filter(counts).collect()
}

/// For each reduced coordinate whether a law acts by it.
pub(super) fn acts_by(law: &dyn Law, basis: &Matrix<f64>) -> Vec<bool> {
    let linear = law.linear();
    let parts = [linear.on_angles.multiply(basis), linear.angles.multiply(basis)];
    let acts = |k: usize| parts.iter().any(|part| (0..part.rows()).any(|i| part[(i, k)] != 0.0));
    (0..basis.columns()).map(acts).collect()
}

/// Whether a state is a charge.
fn is_charge(plant: &Plant, state: usize) -> bool {
    let coordinate = plant.reduced.coordinates.get(state);
    coordinate.is_some_and(|coordinate| plant.reduced.equations.domain(*coordinate) == Domain::Charge)
}

fn is_zero(matrix: &Matrix<Rational>, column: usize) -> bool {
    (0..matrix.rows()).all(|i| matrix[(i, column)].is_zero())
}

/// A system over some of its states, on which the others have no effect. E is the identity.
pub(super) fn over_states(system: &LinearSystem, kept: &[usize]) -> LinearSystem {
    let LinearSystem { states, inputs, outputs, a, c, d, degrees_of_freedom, .. } = system;
    let on_rows = |m: &Matrix<Rational>| Matrix::from_fn(m.rows(), kept.len(), |i, j| m[(i, kept[j])].clone());
    LinearSystem {
        states: kept.iter().map(|k| states[*k].clone()).collect(),
        inputs: inputs.clone(),
        outputs: outputs.clone(),
        e: Matrix::identity(kept.len()),
        a: on_rows(&rows_of(a, kept)),
        b: rows_of(&system.b, kept),
        c: on_rows(c),
        d: d.clone(),
        degrees_of_freedom: degrees_of_freedom.filter(|_| kept.len() == states.len()),
    }
}

/// Some rows of a matrix.
pub(super) fn rows_of(matrix: &Matrix<Rational>, kept: &[usize]) -> Matrix<Rational> {
    Matrix::from_fn(kept.len(), matrix.columns(), |i, j| matrix[(kept[i], j)].clone())
}
