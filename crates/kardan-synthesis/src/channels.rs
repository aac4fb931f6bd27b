//! The specification of the channels of a law, from the keys of the model file.

use std::collections::BTreeSet;

use super::decoupling::Compensation;
use super::{Reference, SynthesisError};
use kardan_math::units::{Dimension, Exact};
use kardan_results::Physical;
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_schema::schema::Values;
use kardan_schema::schema::{Field, Kind, Sign};

/// Keys that give a channel its dynamics.
pub(super) const NATURAL_FREQUENCY: Field = Field::with_default(
    "natural_frequency",
    Kind::Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive),
    "20 rad/s",
    "Natural frequency of the channel.",
);
/// See [`NATURAL_FREQUENCY`].
pub(super) const DAMPING_RATIO: Field =
    Field::with_default("damping_ratio", Kind::Number(Sign::Positive), "0.7", "Damping ratio of the channel.");
/// See [`NATURAL_FREQUENCY`].
pub(super) const CROSSOVER: Field = Field::optional(
    "crossover_frequency",
    Kind::Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive),
    "All poles of the channel at minus this frequency, instead of `natural_frequency` and `damping_ratio`.",
);
/// See [`NATURAL_FREQUENCY`].
pub(super) const POLES: Field = Field::optional(
    "poles",
    Kind::Poles,
    "The poles of the channel, as many as its relative degree, instead of frequencies: [\"-14 ± 14.3j\"].",
);

/// The dynamics that a channel's keys ask for.
pub(super) fn compensation(channel: &Values) -> Compensation {
    let exact = |key: &str| channel.exact(key).map(Exact::to_rational);
    if let Some(poles) = channel.poles("poles") {
        return Compensation::Poles(poles.iter().map(|(re, im)| (re.to_rational(), im.to_rational())).collect());
    }
    if let Some(frequency) = exact("crossover_frequency") {
        return Compensation::FirstOrder { frequency };
    }
    Compensation::SecondOrder {
        natural_frequency: channel.exact_or_default("natural_frequency").to_rational(),
        damping_ratio: channel.exact_or_default("damping_ratio").to_rational(),
    }
}

/// Two alternative keys, at most one of which may be used.
pub(super) fn check_dynamics(channel: &Values, output: &str) -> Result<(), SynthesisError> {
    let second = ["natural_frequency", "damping_ratio"].into_iter().find(|key| channel.has(key));
    let present: Vec<&'static str> =
        second.into_iter().chain(["crossover_frequency", "poles"].into_iter().filter(|key| channel.has(key))).collect();
    match present[..] {
        [first, other, ..] => Err(SynthesisError::at(
            format!("the channel of `{output}` has both `{first}` and `{other}`"),
            output,
            "conflicting keys",
            format!("keep one of `{first}` and `{other}`"),
        )),
        _ => Ok(()),
    }
}

/// The reference of a channel. The end of the output's name determines its unit; without one it is a torque.
pub(super) fn reference(channel: &Values) -> Option<Reference> {
    let (output, name) = (channel.word("output")?, channel.word("reference")?);
    let physical = SignalName::new(output).quantity().map_or(Physical::Torque, Quantity::physical);
    Some(Reference { name: name.into(), physical, description: format!("reference of {output}") })
}

/// An angle, or of a mass a position.
pub(super) fn position_of(output: &str) -> Physical {
    if SignalName::new(output).is(Quantity::Position) { Physical::Position } else { Physical::Angle }
}

/// The effort of an output: the torque of an angle, the force of a position.
pub(super) fn effort_of(output: &str) -> Physical {
    if SignalName::new(output).is(Quantity::Position) { Physical::Force } else { Physical::Torque }
}

/// The unit of the effective inertia along an output.
pub(super) fn inertia_unit(output: &str) -> &'static str {
    if SignalName::new(output).is(Quantity::Position) { "kg" } else { "kg m^2" }
}

/// Reports the first duplicate name.
pub(super) fn once<'a>(names: impl Iterator<Item = &'a str>, what: &'static str) -> Result<(), SynthesisError> {
    let mut used = BTreeSet::new();
    for name in names {
        if !used.insert(name) {
            return Err(SynthesisError::duplicate(name, what));
        }
    }
    Ok(())
}
