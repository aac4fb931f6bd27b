//! Rotating and translating bodies.

use super::contact::{Side, backlash_of, backlash_terms};
use super::kind::KeyError;
use super::shafts::shared_name;
use kardan_math::units::Exact;
use kardan_mechanics::equations::{Direction, Domain, Term};
use kardan_schema::schema::Values;

/// `s − lead·φ = offset`, with the backlash of the element: a row over a mass and a shaft, which is a length.
pub(in crate::element) fn straight([shaft, mass]: [&str; 2], lead: &Exact, values: &Values) -> Vec<Term> {
    let direction = Direction { entries: vec![(mass.to_string(), Exact::one()), (shaft.to_string(), -lead)] };
    let offset = values.exact_or_default("offset");
    let moves = match backlash_of(values) {
        Some(backlash) => backlash_terms(&direction, &offset, backlash, &Side::of(values)),
        None => vec![Term::Constraint { direction, offset }],
    };
    std::iter::once(Term::Measure(Domain::Translation)).chain(moves).collect()
}

/// A torque on the body of `shaft` must not react on that body.
pub(in crate::element) fn check_reaction(values: &Values) -> Option<KeyError> {
    let shaft = shared_name(values, ["shaft", "reaction"])?;
    let message = format!("it reacts on `{shaft}` itself, so it has no effect");
    Some(KeyError::new("reaction", message, "name another shaft, or remove `reaction` for the housing"))
}

/// Keys that must name a moving body.
pub(in crate::element) fn check_moves(values: &Values, keys: &[&'static str]) -> Vec<KeyError> {
    let still = keys.iter().filter(|key| values.word(key) == Some(kardan_mechanics::equations::GROUND));
    still.map(|key| KeyError::new(key, "the ground does not move", "name a shaft or mass that moves")).collect()
}
