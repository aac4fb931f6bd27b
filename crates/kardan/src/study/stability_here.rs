//! Whether a model is stable where it is analysed, as far as rounded numbers and the linearisation tell.

use super::PreparedVariant;
use super::massless::Mechanical;
use super::signals::WorkingPoint;
use crate::analysis::{ConstrainedSystem, LinearSystem, Plane, despite_rounding, linear_system, stability_of};
use crate::num::LastDigits;
use crate::reduce::laws_are_linear;
use crate::results::{Analysis, StabilityVerdict};

/// Other numbers within the last digits of rounded ones that are tried.
const PERTURBATIONS: u64 = 8;
/// States up to which that is done.
const MOST: usize = 24;

/// Takes back what hangs on the last digits of rounded numbers, or on where exactly an equilibrium is, and what the linearisation of a
/// nonlinear model does not decide.
pub(super) fn judge_stability(
    variant: &PreparedVariant,
    point: &WorkingPoint,
    states: &[String],
    analysis: &mut Analysis,
) {
    let Some(properties) = &mut analysis.properties else { return };
    let mut found = std::mem::take(&mut properties.stability);
    if point.system.is_rounded() || point.off > 0.0 {
        found = match states.len() <= MOST {
            true => {
                let perturbed = (1..=PERTURBATIONS).filter_map(|seed| near(variant, point, LastDigits::new(seed)));
                despite_rounding(found, perturbed)
            }
            false => StabilityVerdict::undecided("the system has many states and rounded numbers"),
        };
    }
    if !laws_are_linear(&variant.reduced) {
        found = found.of_linearisation();
    }
    properties.stability = found;
}

/// The verdict with other numbers in place of rounded ones, within their last digits, and at another position within what is known of it.
fn near(variant: &PreparedVariant, at: &WorkingPoint, mut digits: LastDigits) -> Option<StabilityVerdict> {
    let reduced = &variant.reduced;
    let mut point = match variant.unfrozen {
        Some(_) => variant.point.clone(),
        None => variant.relaxed_at(&at.position),
    };
    // Beside a kink the slopes of its side are meant, wherever exactly it is.
    if at.kinks.count() == 0 {
        point.position.iter_mut().for_each(|x| *x += digits.part() * at.off * x.abs().max(1.0));
    }
    let system = ConstrainedSystem::near(reduced, &point, &at.stuck, &at.inputs, &mut digits);
    let linear = linear_at(&system, &reduced.coordinates, at)?;
    Some(stability_of(&linear.explicit()?.a, Plane::Continuous))
}

fn linear_at(system: &ConstrainedSystem, preferred: &[usize], at: &WorkingPoint) -> Option<LinearSystem> {
    let (coordinates, basis) = system.explicit_basis(preferred);
    let names = coordinates.iter().map(|&shaft| system.coordinates[shaft].clone()).collect();
    let mechanical = Mechanical::new(linear_system(system, &coordinates, &basis, &at.outputs), names);
    match mechanical.is_regular() {
        true => Some(mechanical.into_pencil()),
        false => Some(mechanical.eliminate().ok()?.system),
    }
}
