//! Motions without inertia beside constraints that prescribe motions as functions of time.

use super::places::place_of;
use crate::diagnostics::Diagnostic;
use crate::equations::Domain;
use crate::model::Document;
use crate::reduce::Reduced;

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
