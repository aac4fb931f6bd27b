//! Inertia, damping and friction along a direction.

use super::kind::KeyError;
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, Stribeck, Term};
use kardan_schema::schema::{Field, Kind, Sign, Values};

/// An inertia along a direction, if it is not zero.
pub(in crate::element) fn inertia(direction: &Direction, inertia: Option<&Exact>) -> Option<Term> {
    let inertia = inertia.filter(|x| !x.is_zero())?.clone();
    Some(Term::Inertia { direction: direction.clone(), inertia })
}

/// A damper along a direction, if it is not zero.
pub(in crate::element) fn damper(direction: &Direction, damping: Option<&Exact>) -> Option<Term> {
    let damping = damping.filter(|x| !x.is_zero())?.clone();
    Some(Term::Damper { direction: direction.clone(), damping })
}

/// Damper and friction along a direction, if they are not zero.
pub(in crate::element) fn losses(direction: &Direction, values: &Values) -> Vec<Term> {
    let mut out = Vec::from_iter(damper(direction, values.exact("damping")));
    let torque = values.exact_or_default("friction");
    let stribeck = match (values.exact("breakaway"), values.exact("stribeck_speed")) {
        (Some(breakaway), Some(speed)) => Some(Stribeck { breakaway: breakaway.clone(), speed: speed.clone() }),
        _ => None,
    };
    if !torque.is_zero() || stribeck.as_ref().is_some_and(|stribeck| !stribeck.breakaway.is_zero()) {
        out.push(Term::Friction { direction: direction.clone(), torque, stribeck });
    }
    out
}

pub(in crate::element) const BREAKAWAY: Field = Field::optional(
    "breakaway",
    Kind::Mechanical(Dimension::TORQUE, Sign::NonNegative),
    "Breakaway torque at rest, not below `friction`; in motion the friction falls from it as friction + (breakaway - friction) \
     exp(-(w/stribeck_speed)^2). Only simulations use it; designs neglect friction. Left out: equal to `friction`.",
);
pub(in crate::element) const STRIBECK_SPEED: Field = Field::optional(
    "stribeck_speed",
    Kind::Mechanical(Dimension::ANGULAR_VELOCITY, Sign::Positive),
    "Speed with which the friction falls from `breakaway`; needed with it.",
);

/// Errors of the keys of [`losses`], of a shaft or a mass.
pub(in crate::element) fn check_losses(values: &Values, masses: bool) -> Vec<KeyError> {
    let (effort, unit) = if masses { ("force", "N") } else { ("torque", "N m") };
    let mut out = Vec::new();
    match (values.exact("breakaway"), values.has("stribeck_speed")) {
        (None, false) => return out,
        (Some(_), false) => out.push(KeyError::new(
            "breakaway",
            "a breakaway torque needs the speed with which the friction falls from it",
            "add `stribeck_speed`, such as \"0.1 rad/s\"",
        )),
        (None, true) => out.push(KeyError::new(
            "stribeck_speed",
            "it is the speed scale of the fall from a breakaway torque, and there is none",
            "add `breakaway`, or remove it",
        )),
        (Some(_), true) => {}
    }
    let (friction, breakaway) = (values.exact_or_default("friction"), values.exact("breakaway"));
    if let Some(breakaway) = breakaway.filter(|breakaway| breakaway.to_rational() < friction.to_rational()) {
        let (most, sliding) = (breakaway.to_f64(), friction.to_f64());
        let message = format!("the breakaway {effort} {most} {unit} is below the friction {sliding} {unit}");
        out.push(KeyError::new("breakaway", message, "friction at rest is at least that in motion: raise it"));
    }
    out
}
