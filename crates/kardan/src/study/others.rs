//! Coordinates that are no angles, and the names of their motions.

use std::collections::BTreeMap;

use crate::equations::Domain;
use crate::names::{Quantity, SignalName, carrier};
use crate::reduce::Reduced;

/// Coordinates that are no angles: positions of masses, charges of a circuit.
pub(super) type Others = BTreeMap<String, Domain>;

/// Those of a model.
pub(super) fn others(reduced: &Reduced) -> Others {
    let equations = &reduced.equations;
    let domains = equations.coordinates.iter().cloned().zip((0..).map(|k| equations.domain(k)));
    domains.filter(|(_, domain)| *domain != Domain::Rotation).collect()
}

/// `a.w` as it is, `rack.v` in place of `rack.w` for a mass, `L1.i` for a charge.
pub(super) fn state_name(name: &str, others: &Others) -> String {
    let carrier = carrier(name);
    let Some(domain) = others.get(carrier) else { return name.to_string() };
    match SignalName::new(name).quantity() {
        Some(Quantity::Angle) => domain.motion()[0].of(carrier),
        Some(Quantity::Speed) => domain.motion()[1].of(carrier),
        _ => name.to_string(),
    }
}
