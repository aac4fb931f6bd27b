//! Stops and soft stops at a position: open, touching or compressed.

use super::{Kinematics, Reduced};
use crate::assemble::DirectionalTerm;
use crate::equations::UnilateralConstraint;

/// Penetration of a stop that counts as touching, relative to the terms whose difference is the gap.
const TOUCHED: f64 = 1e-9;

/// A stop or a soft stop at a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Its number among the unilateral constraints.
    pub unilateral: usize,
    /// `aᵀq − offset`, rad or m; negative where the stop is penetrated.
    pub gap: f64,
    /// The rounding error of the gap.
    pub rounding: f64,
    /// Whether it is a soft one.
    pub soft: bool,
}

impl Contact {
    /// Whether the position penetrates it, by more than rounding: a soft stop is compressed.
    pub fn is_passed(&self) -> bool {
        self.gap < -self.rounding
    }

    /// Whether its gap is zero, except for rounding.
    pub fn is_touched(&self) -> bool {
        self.gap.abs() <= self.rounding
    }
}

/// All stops and soft stops at a reduced position (rad, m).
///
/// # Panics
/// If `position` has not one entry per coordinate.
pub fn contacts(reduced: &Reduced, position: &[f64]) -> Vec<Contact> {
    let unilaterals = reduced.equations.unilaterals.iter().enumerate();
    let stops = unilaterals.filter_map(|(number, unilateral)| match &unilateral.value {
        UnilateralConstraint::Stop { offset, .. } => Some((number, unilateral, offset.to_f64(), false)),
        UnilateralConstraint::Cushion { offset, .. } => Some((number, unilateral, offset.to_f64(), true)),
        _ => None,
    });
    let stops: Vec<_> = stops.collect();
    if stops.is_empty() {
        return Vec::new();
    }
    let kinematics = Kinematics::at_rest(reduced, position);
    let contact = |(number, unilateral, offset, soft): (usize, &DirectionalTerm<UnilateralConstraint>, f64, bool)| {
        let parts = unilateral.row_f64().into_iter().map(|(k, a)| a * kinematics.angles[k]);
        let (sum, size) = parts.fold((0.0, 0.0), |(sum, size), part| (sum + part, size + part.abs()));
        Contact { unilateral: number, gap: sum - offset, rounding: TOUCHED * (size + offset.abs()), soft }
    };
    stops.into_iter().map(contact).collect()
}

/// The soft stops that are compressed at a reduced position.
///
/// # Panics
/// As [`contacts`].
pub fn pressed_cushions(reduced: &Reduced, position: &[f64]) -> Vec<Contact> {
    contacts(reduced, position).into_iter().filter(|one| one.soft && one.is_passed()).collect()
}
