//! Controllable and observable modes at infinity.

use super::separation::Separation;
use crate::parts::{kernel, side_by_side};
use crate::system::LinearSystem;
pub(super) use crate::system::Side;
use kardan_math::num::{Matrix, Rational, exact_rank};
use kardan_results::DescriptorVerdicts;

/// `finite`: whether all finite modes are reached. For outputs use the transposed system.
pub(super) fn verdicts(
    system: &LinearSystem,
    apart: &Separation,
    side: Side,
    finite: Option<bool>,
) -> DescriptorVerdicts {
    let [n_matrix, b, c] = &apart.fast;
    let (system, nilpotent, entry) = match side {
        Side::Inputs => (system.clone(), n_matrix.clone(), b.clone()),
        Side::Outputs => (system.transpose(), n_matrix.transpose(), c.transpose()),
    };
    let n = system.states.len();
    let moved = system.a.multiply(&kernel(&system.e));
    let missed_impulses = n - exact_rank(&side_by_side(&[&system.e, &moved, &system.b]));
    let missed_at_infinity = entry.rows() - reached(&nilpotent, &entry, apart.index());
    DescriptorVerdicts {
        finite,
        impulse: missed_impulses == 0,
        complete: finite.map(|finite| finite && missed_at_infinity == 0),
        impulse_defect: missed_impulses,
        infinite_defect: missed_at_infinity,
    }
}

/// The rank of `[B, N B, N² B, …]`.
fn reached(nilpotent: &Matrix<Rational>, b: &Matrix<Rational>, index: usize) -> usize {
    let powers = std::iter::successors(Some(b.clone()), |power| Some(nilpotent.multiply(power)));
    let powers: Vec<Matrix<Rational>> = powers.take(index.max(1)).collect();
    exact_rank(&side_by_side(&powers.iter().collect::<Vec<_>>()))
}
