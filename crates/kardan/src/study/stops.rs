//! Stops at a position: rigid ones that it lies beyond, and those that are touched or pressed.

use std::collections::BTreeSet;

use super::places::place_of;
use crate::diagnostics::{Diagnostic, quoted};
use crate::model::{Document, TableReader};
use crate::reduce::{Contact, Reduced, contacts};

/// Each rigid stop that a reduced position (rad, m) lies beyond: its element, by how much, and the unit of that.
fn beyond<'a>(reduced: &'a Reduced, position: &[f64]) -> Vec<(&'a str, f64, &'static str)> {
    let equations = &reduced.equations;
    let passed = contacts(reduced, position).into_iter().filter(|one| !one.soft && one.is_passed());
    let told = passed.map(|one| {
        let hold = &equations.holds[one.hold];
        (hold.element.as_str(), -one.gap, equations.domain_of(hold).motion()[0].unit())
    });
    told.collect()
}

/// What an analysis makes of stops at an operating point: soft ones that are pressed act, those that are just touched are open.
pub(super) fn contacts_in_words(reduced: &Reduced, position: &[f64], stuck: &BTreeSet<String>) -> Vec<String> {
    let found = contacts(reduced, position);
    let names = |own: &dyn Fn(&&Contact) -> bool| {
        let holds = found.iter().filter(own).map(|one| reduced.equations.holds[one.hold].element.as_str());
        holds.filter(|name| !stuck.contains(*name)).collect::<BTreeSet<&str>>()
    };
    let (pressed, touched) = (names(&|one| one.soft && one.is_passed()), names(&|one| !one.soft && one.is_touched()));
    let mut out = Vec::new();
    if !pressed.is_empty() {
        out.push(format!(
            "{} pressed at the operating point: stiffness and damping of the contact are part of the model, which holds as long as it is not left",
            is_or_are(&pressed)
        ));
    }
    if !touched.is_empty() {
        let list = touched.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
        out.push(format!(
            "{} touched at the operating point and looked at as if open there: with `stuck = [{list}]` in `[analysis]` the contact holds",
            is_or_are(&touched)
        ));
    }
    out
}

fn is_or_are(names: &BTreeSet<&str>) -> String {
    format!("{} {}", quoted(names.iter().copied()), if names.len() == 1 { "is" } else { "are" })
}

/// The mistake that a run begins beyond a rigid stop.
pub(super) fn check_stops(document: &Document, reduced: &Reduced, position: &[f64], out: &mut Vec<Diagnostic>) {
    if let Some((element, by, unit)) = beyond(reduced, position).first() {
        let message = format!("the run begins {by:.6} {unit} beyond the stop of `{element}`, which nothing can pass");
        out.push(
            Diagnostic::error("scenario::stop", message)
                .at(place_of(document, element), "this stop")
                .at(TableReader::place(&document.scenario, "initial"), "from here")
                .help("begin within the stop: by `initial` of `[scenario]`, where what is left out begins at zero"),
        );
    }
}

/// What is told of an operating point beyond rigid stops, which are open in an analysis.
pub(super) fn beyond_in_words(reduced: &Reduced, position: &[f64]) -> Option<String> {
    let told: Vec<String> = beyond(reduced, position)
        .iter()
        .map(|(element, by, unit)| format!("{by:.6} {unit} beyond the stop of `{element}`"))
        .collect();
    let told = told.join(", ");
    (!told.is_empty()).then(|| {
        format!("the operating point lies {told}: the model cannot be there, it is looked at as if that were open")
    })
}
