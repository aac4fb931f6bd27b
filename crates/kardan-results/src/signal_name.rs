//! The names of signals: the only module that builds and parses them.

use std::fmt;

use crate::physical::Physical;

/// The quantity in the last part of a signal's name: `phi` in `rk.phi`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// `phi`: angle, rad.
    Angle,
    /// `w`: angular velocity, rad/s.
    Speed,
    /// `tau`: torque, N m.
    Torque,
    /// `command`: commanded torque of a motor, N m.
    Command,
    /// `ripple`: torque of a motor in addition to its reported torque, N m.
    Ripple,
    /// `friction`: friction torque, N m.
    Friction,
    /// `disturbance`: unreported torque on a shaft, N m.
    Disturbance,
    /// `excess`: limited command less the command, N m.
    Excess,
    /// `s`: position of a mass, m.
    Position,
    /// `v`: velocity of a mass, m/s.
    Velocity,
    /// `f`: force, N.
    Force,
    /// `q`: charge, C.
    Charge,
    /// `i`: current, A.
    Current,
    /// `v`: voltage, or potential against ground, V.
    Voltage,
    /// `lambda`: the multiplier of a relation in another unit than those of angles and lengths; its unit is that of energy over that one.
    Multiplier,
    /// `sum`: integral of a state over time, s.
    Sum,
    /// `z`: a state of first order, a number.
    State,
    /// `rate`: rate of a state, 1/s.
    Change,
}

/// Each quantity with its word and the kind of its numbers.
const QUANTITIES: [(Quantity, &str, Physical); 18] = [
    (Quantity::Angle, "phi", Physical::Angle),
    (Quantity::Speed, "w", Physical::Speed),
    (Quantity::Torque, "tau", Physical::Torque),
    (Quantity::Command, "command", Physical::Torque),
    (Quantity::Ripple, "ripple", Physical::Torque),
    (Quantity::Friction, "friction", Physical::Torque),
    (Quantity::Disturbance, "disturbance", Physical::Torque),
    (Quantity::Excess, "excess", Physical::Torque),
    (Quantity::Position, "s", Physical::Position),
    // For anything but a mass it is a voltage: the caller knows which.
    (Quantity::Velocity, "v", Physical::Velocity),
    (Quantity::Force, "f", Physical::Force),
    (Quantity::Charge, "q", Physical::Charge),
    (Quantity::Current, "i", Physical::Current),
    (Quantity::Voltage, "v", Physical::Voltage),
    (Quantity::Multiplier, "lambda", Physical::Other("")),
    (Quantity::Sum, "sum", Physical::Other("s")),
    (Quantity::State, "z", Physical::Other("")),
    (Quantity::Change, "rate", Physical::Other("1/s")),
];

impl Quantity {
    /// The word in a name: `phi`.
    pub fn word(self) -> &'static str {
        QUANTITIES.iter().find(|(quantity, ..)| *quantity == self).map_or("", |(_, word, _)| word)
    }

    /// The kind of the numbers.
    pub fn physical(self) -> Physical {
        let found = QUANTITIES.iter().find(|(quantity, ..)| *quantity == self);
        found.map_or(Physical::Other(""), |(.., physical)| *physical)
    }

    /// The name of this signal of an element: `rk.phi`.
    pub fn of(self, element: &str) -> String {
        format!("{element}.{}", self.word())
    }

    /// Its rate: the speed of an angle, the velocity of a position; others are unchanged.
    #[must_use]
    pub fn rate(self) -> Self {
        match self {
            Self::Angle => Self::Speed,
            Self::Position => Self::Velocity,
            Self::Charge => Self::Current,
            Self::Sum => Self::State,
            other => other,
        }
    }

    /// The SI unit; none if the signal defines its own.
    pub fn unit(self) -> &'static str {
        match self {
            Self::State => "1",
            other => other.physical().unit(),
        }
    }
}

/// The name of a signal in its parts. A name without a dot is that of a reference or an input.
///
/// ```
/// use kardan_results::signal_name::{Quantity, SignalName};
/// let torque = SignalName::new("gear.rack.tau");
/// assert_eq!((torque.element, torque.on, torque.quantity()), ("gear", Some("rack"), Some(Quantity::Torque)));
/// assert_eq!(SignalName::new("rk.phi").angle_of(), Some("rk"));
/// assert_eq!(SignalName::new("ref_rk").quantity(), None);
/// assert_eq!(Quantity::Speed.of("rk"), "rk.w");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignalName<'a> {
    /// The shaft, element, sensor or reference.
    pub element: &'a str,
    /// The shaft that an element acts on, if it has several.
    pub on: Option<&'a str>,
    /// The last part of the name.
    pub word: Option<&'a str>,
}

impl<'a> SignalName<'a> {
    /// Takes a name apart.
    pub fn new(name: &'a str) -> Self {
        let (element, rest) = name.split_once('.').map_or((name, None), |(element, rest)| (element, Some(rest)));
        match rest.and_then(|rest| rest.rsplit_once('.')) {
            Some((on, word)) => Self { element, on: Some(on), word: Some(word) },
            None => Self { element, on: None, word: rest },
        }
    }

    /// The quantity of its last part, if known; for `v` a velocity.
    pub fn quantity(self) -> Option<Quantity> {
        let word = self.word?;
        QUANTITIES.iter().find(|(_, candidate, _)| *candidate == word).map(|(quantity, ..)| *quantity)
    }

    /// The element, if the signal is that of one element alone.
    pub fn unqualified(self) -> Option<&'a str> {
        self.on.is_none().then_some(self.element)
    }

    /// Whether it is this quantity; `v` is a velocity and a voltage.
    pub fn is(self, quantity: Quantity) -> bool {
        self.word == Some(quantity.word())
    }

    /// Whether it is a position: an angle, a position, a charge.
    pub fn is_position(self) -> bool {
        matches!(self.quantity(), Some(Quantity::Angle | Quantity::Position | Quantity::Charge | Quantity::Sum))
    }

    /// Whether it is a rate, of a coordinate or a sensor of its motion: a speed, a velocity, a current.
    pub fn is_rate(self) -> bool {
        matches!(self.quantity(), Some(Quantity::Speed | Quantity::Velocity | Quantity::Current | Quantity::State))
    }

    /// The SI unit of its quantity; N m where that is not known, as of references without a dot.
    pub fn unit(self) -> &'static str {
        self.quantity().map_or("N m", Quantity::unit)
    }

    /// The name of the rate of an angle or position: `rk.w` of `rk.phi`, `rack.v` of `rack.s`.
    pub fn rate(self) -> String {
        self.quantity().unwrap_or(Quantity::Angle).rate().of(self.element)
    }

    /// The shaft or mass whose angle or position it is.
    pub fn angle_of(self) -> Option<&'a str> {
        self.unqualified().filter(|_| self.is(Quantity::Angle) || self.is(Quantity::Position))
    }
}

/// The body with a position or a rate of this name: the shaft `rk` of `rk.phi`, the winding `tr.2` of `tr.2.i`; a name without a
/// dot itself.
///
/// ```
/// use kardan_results::signal_name::carrier;
/// assert_eq!((carrier("rk.phi"), carrier("tr.2.i"), carrier("ref")), ("rk", "tr.2", "ref"));
/// ```
pub fn carrier(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(carrier, _)| carrier)
}

/// The element and the key of a parameter, `wheel.inertia`; none if it is not such a name.
pub fn parameter(name: &str) -> Option<(&str, &str)> {
    name.rsplit_once('.')
}

impl fmt::Display for SignalName<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [Some(self.element), self.on, self.word];
        f.write_str(&parts.into_iter().flatten().collect::<Vec<_>>().join("."))
    }
}

#[cfg(test)]
#[path = "../tests/unit/signal_name.rs"]
mod tests;
