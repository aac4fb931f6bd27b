//! What all pages of equations share: their form, and the kinds of coordinates that they name.

use crate::study::PreparedVariant;
use kardan_mechanics::equations::Domain;

/// How equations are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EquationsForm {
    /// Lines for a terminal.
    Text,
    /// For a document.
    Latex,
    /// The list of operations that evaluates them ([`kardan_expr::plan`]).
    Plan,
}

/// The kind of the coordinates of a model.
pub(in crate::study) struct CoordinateKind {
    pub(in crate::study) plural: &'static str,
    pub(in crate::study) count: usize,
    pub(in crate::study) units: &'static str,
}

/// The kinds of coordinates in the model, in a fixed order.
pub(in crate::study) fn kinds(variant: &PreparedVariant) -> Vec<CoordinateKind> {
    let domains = &variant.reduced.equations.domains;
    let kinds = [
        (Domain::Rotation, "shafts", "angles in rad, torques in N m"),
        (Domain::Translation, "masses", "positions in m, forces in N"),
        (Domain::Charge, "charges", "charges in C, voltages in V"),
        (Domain::Number, "states of first order", "their integrals in s"),
    ];
    let kind = |(domain, plural, units)| {
        let count = domains.iter().filter(|candidate| **candidate == domain).count();
        CoordinateKind { plural, count, units }
    };
    kinds.into_iter().map(kind).filter(|kind| kind.count > 0).collect()
}
