//! Contacts on both sides of a direction.

use super::kind::KeyError;
use kardan_math::num::Rational;
use kardan_math::units::Exact;
use kardan_mechanics::equations::{Direction, Term, UnilateralConstraint};
use kardan_schema::schema::{Field, Kind, Sign, Values};

/// The material of a contact: soft or rigid.
#[derive(Debug, Clone)]
pub(in crate::element) enum Side {
    Rigid { restitution: Exact },
    Soft { stiffness: Exact, damping: Exact },
}

impl Side {
    /// Soft if there is a `stiffness`, else rigid.
    pub(in crate::element) fn of(values: &Values) -> Self {
        match values.exact("stiffness") {
            Some(stiffness) => Self::Soft { stiffness: stiffness.clone(), damping: values.exact_or_default("damping") },
            None => Self::Rigid { restitution: values.exact_or_default("restitution") },
        }
    }

    fn unilateral(&self, upper: bool, offset: Exact) -> UnilateralConstraint {
        match self.clone() {
            Self::Rigid { restitution } => UnilateralConstraint::Stop { upper, offset, restitution },
            Self::Soft { stiffness, damping } => UnilateralConstraint::Cushion { upper, offset, stiffness, damping },
        }
    }
}

/// A direction between a lower and an upper stop.
pub(in crate::element) fn contact(direction: &Direction, [lower, upper]: [Option<Exact>; 2], side: &Side) -> Vec<Term> {
    let lower = lower.map(|offset| Term::UnilateralConstraint {
        direction: direction.clone(),
        unilateral: side.unilateral(false, offset),
    });
    let upper = upper.map(|offset| Term::UnilateralConstraint {
        direction: opposite(direction),
        unilateral: side.unilateral(true, -&offset),
    });
    lower.into_iter().chain(upper).collect()
}

/// The opposite direction.
fn opposite(direction: &Direction) -> Direction {
    Direction { entries: direction.entries.iter().map(|(name, x)| (name.clone(), -x)).collect() }
}

/// Errors of the keys of [`contact`]; `sides` is the key with the positions of the stops.
pub(in crate::element) fn check_contact(values: &Values, sides: &'static str) -> Vec<KeyError> {
    let mut out = check_restitution(values);
    if !values.has("stiffness") && values.exact("damping").is_some_and(|d| !d.is_zero()) {
        let message = format!("it is for soft contact at `{sides}`, and without `stiffness` it is rigid");
        out.push(KeyError::new("damping", message, "add `stiffness`, or give `restitution` in place of it"));
    }
    out
}

fn check_restitution(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::new();
    if values.exact("restitution").is_some_and(|e| e.to_f64() > 1.0) {
        out.push(KeyError::new(
            "restitution",
            "above 1 each impact would add energy",
            "give a number from 0 (perfectly inelastic) to 1 (no energy loss)",
        ));
    }
    if values.has("stiffness") && values.exact("restitution").is_some_and(|e| !e.is_zero()) {
        out.push(KeyError::new(
            "restitution",
            "it is for rigid contact, and `stiffness` makes it soft",
            "remove one of the two; soft contact loses energy by its `damping`",
        ));
    }
    out
}

/// The coefficient of restitution of backlash flanks.
pub(in crate::element) const RESTITUTION: Field = Field::with_default(
    "restitution",
    Kind::Number(Sign::NonNegative),
    "0",
    "With `backlash`: coefficient of restitution of the impacts of its flanks, the part of the relative speed with which they separate, 0 to 1.",
);

/// The width of the backlash of an element, if it has any.
pub(in crate::element) fn backlash_of(values: &Values) -> Option<&Exact> {
    values.exact("backlash").filter(|backlash| !backlash.is_zero())
}

/// A constraint `aᵀq = offset` with backlash of a width along a: at half of it either way its flanks are in contact. The torque along a is what the
/// multiplier of the constraint would be.
pub(in crate::element) fn backlash_terms(
    direction: &Direction,
    offset: &Exact,
    width: &Exact,
    side: &Side,
) -> Vec<Term> {
    contact(&opposite(direction), centred_limits(&-offset, width), side)
}

/// The ends of a width around its middle.
pub(in crate::element) fn centred_limits(middle: &Exact, width: &Exact) -> [Option<Exact>; 2] {
    let half = width * &Exact::new(Rational::from_parts(1.into(), 2u8.into()), 0);
    [middle.plus(&-&half), middle.plus(&half)].map(Some)
}

/// Errors of `restitution` with `backlash`.
pub(in crate::element) fn check_backlash(values: &Values) -> Vec<KeyError> {
    let mut out = check_restitution(values);
    if backlash_of(values).is_none() && values.exact("restitution").is_some_and(|e| !e.is_zero()) {
        out.push(KeyError::new(
            "restitution",
            "without `backlash` nothing separates, so there is no impact",
            "add `backlash`, or remove it",
        ));
    }
    out
}
