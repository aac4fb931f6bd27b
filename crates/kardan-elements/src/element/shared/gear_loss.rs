//! Load-dependent gear friction of a constraint.

use super::kind::KeyError;
use kardan_math::num::Rational;
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, GearLoss, Term, UnilateralConstraint};
use kardan_schema::schema::{Field, Kind, Sign, Values};

pub(in crate::element) const EFFICIENCY: Field = Field::optional(
    "efficiency",
    Kind::Number(Sign::Positive),
    "Efficiency while the first shaft drives, above 0 and up to 1. Left out: no loss.",
);

pub(in crate::element) const EFFICIENCY_BACK: Field = Field::optional(
    "efficiency_back",
    Kind::Number(Sign::Any),
    "The same while the first shaft is driven, up to 1; zero or less is self-locking: then the load cannot move it, except by a rigid impact, which \
     passes through the gear without loss. A worm with friction angle rho and lead angle g has tan(g - rho)/tan(g). Left out: `efficiency`.",
);

/// Key of a measured loss torque.
pub const LOSS: Field = Field::optional(
    "loss",
    Kind::Formula(Dimension::TORQUE),
    "Loss torque on the first shaft, added to that of `efficiency`: an expression of `load`, the magnitude of the gear torque on that shaft, of \
     `speed`, the magnitude of its speed, of parameters and tables, such as \"loss_map(speed, load)\". Never negative.",
);

/// The names that a [`LOSS`] may use besides those of all expressions.
pub const LOAD: &str = "load";
/// The other name.
pub const SPEED: &str = "speed";

/// The loss opposite to the motion along a direction, on whose first body the constraint of the element acts; none without such keys.
pub(in crate::element) fn gear_loss(direction: Direction, values: &Values) -> Option<Term> {
    let loss = values.formula("loss").cloned();
    let one = Exact::one();
    let efficiency = values.exact("efficiency").filter(|x| x.signum() > 0);
    let back = values.exact("efficiency_back").or(efficiency).unwrap_or(&one);
    let forth = efficiency.and_then(|efficiency| one.div(efficiency)).unwrap_or_else(Exact::one);
    let [forth, back] = [forth.plus(&-&one), one.plus(&-back)];
    if loss.is_none() && forth.is_zero() && back.is_zero() {
        return None;
    }
    Some(Term::UnilateralConstraint {
        direction,
        unilateral: UnilateralConstraint::GearLoss(GearLoss { forth, back, loss }),
    })
}

/// A negative friction, which would drive.
pub(in crate::element) fn check_loss(values: &Values, key: &'static str) -> Option<KeyError> {
    let number = values.formula(key)?.number()?;
    let message = "it is negative, so friction would drive";
    (number < Rational::ZERO).then(|| KeyError::new(key, message, "give zero or more"))
}

/// Errors of these keys.
pub(in crate::element) fn check_gear_loss(values: &Values) -> Vec<KeyError> {
    let mut out: Vec<KeyError> = check_loss(values, "loss").into_iter().collect();
    for key in ["efficiency", "efficiency_back"] {
        let Some(efficiency) = values.number(key) else { continue };
        if efficiency > 1.0 {
            let message = "above 1 the gear would add power";
            out.push(KeyError::new(key, message, "give an efficiency, such as 0.9"));
        }
    }
    if values.has("efficiency_back") && !values.has("efficiency") {
        let message =
            "without `efficiency` the other direction has no loss, which contradicts the loss in this direction";
        out.push(KeyError::new("efficiency_back", message, "add `efficiency`, that while the first shaft drives"));
    }
    out
}
