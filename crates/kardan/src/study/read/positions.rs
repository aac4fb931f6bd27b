//! Positions of a model at which it is tested.

use kardan_mechanics::reduce::{Kinematics, Reduced};

/// Whether all angles and their derivatives with respect to the coordinates are finite at a position.
pub(in crate::study) fn is_finite_at(reduced: &Reduced, position: &[f64]) -> bool {
    let kinematics = Kinematics::at_rest(reduced, position);
    kinematics.angles.iter().chain(&kinematics.basis).all(|x| x.is_finite())
}

/// Generic positions, rad.
pub(in crate::study) fn generic_positions(coordinates: usize) -> Vec<Vec<f64>> {
    let from = |first: f64| (0..coordinates).map(|k| first + 0.11 * k as f64).collect();
    [0.3, 0.7, 1.9].map(from).to_vec()
}
