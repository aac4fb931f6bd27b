//! Charges that only count what has flowed.

use super::Plant;
use crate::analysis::LinearSystem;
use crate::equations::Domain;
use crate::num::{Matrix, Rational};

/// Places among the states `[q_r; q̇_r]` of all but the charges on which nothing depends, such as that of a motor's winding: their columns
/// of A and C are zero. They count what has flowed, and no law holds them. Exact.
pub(super) fn without_counters(plant: &Plant, system: &LinearSystem) -> Vec<usize> {
    let is_charge = |k: &usize| {
        let coordinate = plant.reduced.coordinates.get(*k);
        coordinate.is_some_and(|coordinate| plant.reduced.equations.domain(*coordinate) == Domain::Charge)
    };
    let is_zero = |m: &Matrix<Rational>, k: usize| (0..m.rows()).all(|i| m[(i, k)].is_zero());
    let counts = |k: &usize| is_charge(k) && is_zero(&system.a, *k) && is_zero(&system.c, *k);
    (0..2 * plant.reduced.degrees_of_freedom()).filter(|k| !counts(k)).collect()
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
