//! Coordinates that are no angles, the names of their motions, the motors of a model, and terms of sums.

use std::collections::BTreeMap;

use kardan_math::names::SignedTerm;
use kardan_mechanics::assemble::{DirectionalTerm, Equations};
use kardan_mechanics::equations::{Domain, InputKind};
use kardan_mechanics::reduce::Reduced;
use kardan_results::signal_name::{Quantity, SignalName, carrier};

/// Coordinates that are no angles: positions of masses, charges of a circuit.
pub(in crate::study) type NonAngleDomains = BTreeMap<String, Domain>;

/// Those of a model.
pub(in crate::study) fn non_angle_domains(reduced: &Reduced) -> NonAngleDomains {
    let equations = &reduced.equations;
    let domains = equations.coordinates.iter().cloned().zip((0..).map(|k| equations.domain(k)));
    domains.filter(|(_, domain)| *domain != Domain::Rotation).collect()
}

/// Its motors and sources: inputs that are no disturbances.
pub(in crate::study) fn motors(equations: &Equations) -> impl Iterator<Item = &DirectionalTerm<InputKind>> {
    equations.inputs.iter().filter(|input| matches!(input.value, InputKind::Motor(_)))
}

/// `a.w` as it is, `rack.v` in place of `rack.w` for a mass, `L1.i` for a charge.
pub(in crate::study) fn state_name(name: &str, non_angle_domains: &NonAngleDomains) -> String {
    let carrier = carrier(name);
    let Some(domain) = non_angle_domains.get(carrier) else { return name.to_string() };
    match SignalName::new(name).quantity() {
        Some(Quantity::Angle) => domain.motion()[0].of(carrier),
        Some(Quantity::Speed) => domain.motion()[1].of(carrier),
        _ => name.to_string(),
    }
}

/// A name with a factor as a term of a sum.
pub(in crate::study) fn scaled_term(factor: f64, name: &str) -> SignedTerm {
    let size = if factor.abs() == 1.0 { String::new() } else { format!("{} ", factor.abs()) };
    (factor < 0.0, format!("{size}{name}"))
}
