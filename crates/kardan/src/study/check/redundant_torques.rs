//! Constraints that restrict the same motion: notes on them, and rejection of requests for their torques.

use crate::study::read::locations::{first_places, place_of};
use kardan_math::num::{Rational, rational_to_f64};
use kardan_mechanics::equations::Measured;
use kardan_mechanics::reduce::Reduced;
use kardan_model::Document;
use kardan_results::ConstraintForces;
use kardan_schema::diagnostics::{Diagnostic, quoted};
use std::collections::BTreeSet;

/// One sentence for each group of elements that share torques.
pub(in crate::study) fn redundancy_notes(reduced: &Reduced) -> Vec<String> {
    reduced.redundant_groups().iter().map(|group| format!("{}.", note(group).replacen("the", "The", 1))).collect()
}

fn note(group: &BTreeSet<String>) -> String {
    format!(
        "the constraints {} restrict the same motion: the distribution of their torques is not unique; kardan gives \
         the one with the least sum of squares, as if all were equally stiff",
        quoted(group)
    )
}

/// Warns of torques that are not unique, and rejects sensors of such torques, which analyses, laws and observers read, and losses that depend on them.
pub(in crate::study) fn check_redundant(document: &Document, reduced: &Reduced, out: &mut Vec<Diagnostic>) {
    for group in reduced.redundant_groups() {
        let help = "the motion does not depend on the distribution; remove one of them if its torque matters";
        let warning = Diagnostic::warning("constraint::redundant", note(&group)).help(help);
        out.push(warning.at_each(first_places(document, &group), "shares its torque"));
    }
    let elements = reduced.equations.gear_losses().map(|(unilateral, _)| &unilateral.element);
    for element in elements.filter(|element| reduced.shares_torque(element)) {
        let message = format!("the gear loss of `{element}` depends on a torque that is not unique");
        let help = "remove a constraint that restricts the same motion, put a spring into one of them, or remove \
                     the loss";
        out.push(
            Diagnostic::error("constraint::not-unique", message)
                .at(place_of(document, element), "has an efficiency, or a loss")
                .help(help),
        );
    }
    for (name, sensor) in &reduced.equations.sensors {
        if let Measured::ConstraintTorque(element, _) = &sensor.measured
            && reduced.shares_torque(element)
        {
            let message = format!("sensor `{name}` measures a torque of `{element}` that is not unique");
            out.push(
                Diagnostic::error("sensor::not-unique", message)
                    .at(place_of(document, name), "cannot be read")
                    .help("measure another quantity, or remove a constraint that restricts the same motion"),
            );
        }
    }
}

/// Multipliers per input, including those of redundant constraints: torques of the others are distributed as in a run.
pub(in crate::study) fn split_multipliers(reduced: &Reduced, forces: &mut ConstraintForces) {
    let matrix = &mut forces.input_to_multiplier;
    let (minimal, columns) = (std::mem::take(&mut matrix.values), 0..matrix.columns.len());
    let row = |shares: Vec<(usize, Rational)>| -> Vec<f64> {
        let shares: Vec<(usize, f64)> = shares.iter().map(|(row, share)| (*row, rational_to_f64(share))).collect();
        columns.clone().map(|column| shares.iter().map(|(row, share)| share * minimal[*row][column]).sum()).collect()
    };
    matrix.values = reduced.split(minimal.len()).into_iter().map(row).collect();
    matrix.rows.extend(reduced.redundant.iter().map(|row| row.constraint.element.clone()));
}
