//! Constraints that prescribe motions as functions of time: what they do not go with.

use super::places::{place_of, place_of_value};
use crate::diagnostics::{Diagnostic, quoted};
use crate::equations::Domain;
use crate::model::Document;
use crate::reduce::{Motion, Reduced};

/// Frictions along which a constraint prescribes a speed.
pub(super) fn check_prescribed(document: &Document, reduced: &Reduced, out: &mut Vec<Diagnostic>) -> bool {
    if reduced.equations.moving.is_empty() {
        return true;
    }
    let before = out.len();
    let mut motion = Motion::new(reduced);
    for (name, row) in reduced.equations.set_valued() {
        let speed = motion.sum(row, |motion, shaft| motion.carried[shaft]);
        if motion.graph.is_zero(speed) {
            continue;
        }
        let message = format!(
            "the speed along the friction of `{name}` is prescribed in part by {}, which runs do not follow",
            quoted(reduced.equations.moving.keys().map(String::as_str))
        );
        out.push(
            Diagnostic::error("friction::prescribed", message)
                .at(place_of_value(document, name, "friction"), "this friction")
                .help("take the friction out, use `damping`, or put a stiff spring_damper between it and the prescribed motion"),
        );
    }
    out.len() == before
}

/// Motions without inertia beside rows that are kept, which runs do not follow.
pub(super) fn refuse_massless(document: &Document, reduced: &Reduced, massless: &mut [Diagnostic]) -> bool {
    let Some(kept) = reduced.equations.kept.first() else { return false };
    let (first, is_current) = (&kept.element, reduced.equations.domain_of_kept(kept) == Domain::Charge);
    for mistake in massless.iter_mut() {
        let told = std::mem::replace(mistake, Diagnostic::error("model::massless", ""));
        let message = format!("{}; beside `{first}` it is not followed", told.message);
        let told = Diagnostic { message, ..told }.at(place_of(document, first), "this constraint");
        *mistake = match is_current {
            true => told.help(
                "put an inductor into this loop, or write the current as a sum whose integral is known: powers of `t`, sines, cosines and \
                 exponentials of straight lines, cubic tables without their third power",
            ),
            false => told,
        };
    }
    true
}
