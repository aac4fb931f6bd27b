//! Stability of a model at its operating point, as far as rounded numbers and the linearisation decide it.

use crate::study::PreparedVariant;
use crate::study::check::massless_elimination::Mechanical;
use crate::study::operating_point::working_point::WorkingPoint;
use kardan_analysis::{ConstrainedSystem, Plane, despite_rounding, stability_of};
use kardan_math::num::LastDigits;
use kardan_mechanics::reduce::laws_are_linear;
use kardan_results::{Analysis, StabilityVerdict};

/// Number of trials with other numbers within the last digits of rounded ones.
const PERTURBATIONS: u64 = 8;
/// Largest number of states for these trials.
const MOST: usize = 24;

/// Withdraws verdicts that depend on the last digits of rounded numbers, or on the exact position of an equilibrium, and those that the linearisation of a
/// nonlinear model does not decide.
pub(in crate::study) fn judge_stability(
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

/// The verdict with other numbers in place of rounded ones, within their last digits, and at another position within its bound.
fn near(variant: &PreparedVariant, at: &WorkingPoint, mut digits: LastDigits) -> Option<StabilityVerdict> {
    let reduced = &variant.reduced;
    let mut point = match variant.unfrozen {
        Some(_) => variant.point.clone(),
        None => variant.unloaded_at(&at.position),
    };
    // Next to a kink the slopes are those of its side, whatever the exact position.
    if at.kinks.guards.is_empty() {
        point.position.iter_mut().for_each(|x| *x += digits.part() * at.off * x.abs().max(1.0));
    }
    let system = ConstrainedSystem::near(reduced, &point, &at.stuck, &at.inputs, &mut digits);
    let (linear, _) = Mechanical::of(&system, &reduced.coordinates, &at.outputs).ok()?.settled().ok()?;
    Some(stability_of(&linear.explicit()?.a, Plane::Continuous))
}
