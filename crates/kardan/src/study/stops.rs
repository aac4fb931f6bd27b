//! Rigid stops that a position lies beyond.

use super::places::place_of;
use crate::diagnostics::Diagnostic;
use crate::equations::Hold;
use crate::model::{Document, TableReader};
use crate::reduce::{Kinematics, Reduced};

/// By how much a stop may be passed that counts as touched, relative to what its gap is the difference of.
const TOUCHED: f64 = 1e-9;

/// Each rigid stop that a reduced position (rad, m) lies beyond: its element, by how much, and the unit of that.
fn beyond<'a>(reduced: &'a Reduced, position: &[f64]) -> Vec<(&'a str, f64, &'static str)> {
    let equations = &reduced.equations;
    let is_stop = |value: &Hold| matches!(value, Hold::Stop { .. });
    if !equations.holds.iter().any(|hold| is_stop(&hold.value)) {
        return Vec::new();
    }
    let mut kinematics = Kinematics::new(reduced);
    kinematics.update(position, &vec![0.0; position.len()]);
    let passed = equations.holds.iter().filter_map(|hold| {
        let Hold::Stop { offset, .. } = &hold.value else { return None };
        let parts = hold.row_f64().into_iter().map(|(k, a)| a * kinematics.angles[k]);
        let (sum, size) = parts.fold((0.0, 0.0), |(sum, size), part| (sum + part, size + part.abs()));
        let (gap, size) = (sum - offset.to_f64(), size + offset.to_f64().abs());
        let unit = equations.domain_of(hold).motion()[0].unit();
        (gap < -TOUCHED * size).then_some((hold.element.as_str(), -gap, unit))
    });
    passed.collect()
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
