//! Stops at a position: rigid ones that it exceeds, and those that are touched or pressed.

use std::collections::BTreeSet;

use crate::study::read::locations::place_of;
use kardan_mechanics::equations::UnilateralConstraint;
use kardan_mechanics::reduce::{Contact, Reduced, contacts};
use kardan_model::Document;
use kardan_schema::diagnostics::{Diagnostic, quoted};

/// Each rigid stop that a reduced position (rad, m) exceeds: its element, the exceedance, and its unit.
fn beyond<'a>(reduced: &'a Reduced, position: &[f64]) -> Vec<(&'a str, f64, &'static str)> {
    let equations = &reduced.equations;
    let passed = contacts(reduced, position).into_iter().filter(|one| !one.soft && one.is_passed());
    let excess = passed.map(|one| {
        let unilateral = &equations.unilaterals[one.unilateral];
        (unilateral.element.as_str(), -one.gap, equations.domain_of(unilateral).motion()[0].unit())
    });
    excess.collect()
}

/// Treatment of stops at an operating point in an analysis: pressed soft ones act, touched ones are open.
pub(in crate::study) fn describe_contacts(
    reduced: &Reduced,
    position: &[f64],
    stuck: &BTreeSet<String>,
) -> Vec<String> {
    let found = contacts(reduced, position);
    let names = |own: &dyn Fn(&&Contact) -> bool| {
        let unilaterals =
            found.iter().filter(own).map(|one| reduced.equations.unilaterals[one.unilateral].element.as_str());
        unilaterals.filter(|name| !stuck.contains(*name)).collect::<BTreeSet<&str>>()
    };
    let (pressed, touched) = (names(&|one| one.soft && one.is_passed()), names(&|one| !one.soft && one.is_touched()));
    let open: BTreeSet<&str> =
        names(&|_| true).into_iter().filter(|name| !pressed.contains(name) && !touched.contains(name)).collect();
    let closing = closing(&touched);
    let sentences = [
        stated(
            &open,
            "open at the operating point (stops, backlash): the linear model is valid while no contact closes",
        ),
        stated(
            &pressed,
            "pressed at the operating point: stiffness and damping of the contact are part of the model, which is \
             valid while the contact stays closed",
        ),
        stated(&touched, &format!("touched at the operating point and treated as open there: {closing} the contact")),
    ];
    sentences.into_iter().flatten().collect()
}

/// Treatment of clutches, brakes, locks and freewheels in an analysis that are not listed in `stuck`.
pub(in crate::study) fn describe_clutches(reduced: &Reduced, stuck: &BTreeSet<String>) -> Vec<String> {
    let of = |own: &dyn Fn(&UnilateralConstraint) -> bool| {
        let unilaterals = reduced.equations.unilaterals.iter().filter(|unilateral| own(&unilateral.value));
        let names = unilaterals.map(|unilateral| unilateral.element.as_str());
        names.filter(|name| !stuck.contains(*name)).collect::<BTreeSet<&str>>()
    };
    let sliding = of(&|unilateral| matches!(unilateral, UnilateralConstraint::Friction { .. }));
    let open = of(&|unilateral| matches!(unilateral, UnilateralConstraint::Lock { .. } | UnilateralConstraint::OneWay));
    let slides = "treated as open: a clutch or brake that slides, whose torque is constant";
    let sentences = [
        stated(&sliding, &format!("{slides}; {} it", closing(&sliding))),
        stated(&open, &format!("treated as open; {} it", closing(&open))),
    ];
    sentences.into_iter().flatten().collect()
}

/// What elements are, as a sentence; none without elements.
fn stated(names: &BTreeSet<&str>, what: &str) -> Option<String> {
    (!names.is_empty()).then(|| format!("{} {what}", is_or_are(names)))
}

/// Names with their verb: `` `a` is `` or `` `a`, `b` are ``.
pub(in crate::study) fn is_or_are(names: impl IntoIterator<Item: AsRef<str>, IntoIter: ExactSizeIterator>) -> String {
    let names = names.into_iter();
    let verb = if names.len() == 1 { "is" } else { "are" };
    format!("{} {verb}", quoted(names))
}

/// The key that closes contacts and clutches.
fn closing(names: &BTreeSet<&str>) -> String {
    let list = names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
    format!("`stuck = [{list}]` in `[analysis]` closes")
}

/// The error that a run begins beyond a rigid stop.
pub(in crate::study) fn check_stops(
    document: &Document,
    reduced: &Reduced,
    position: &[f64],
    out: &mut Vec<Diagnostic>,
) {
    if let Some((element, by, unit)) = beyond(reduced, position).first() {
        let message = format!("the run begins {by:.6} {unit} beyond the stop of `{element}`, which is rigid");
        out.push(
            Diagnostic::error("scenario::stop", message)
                .at(place_of(document, element), "this stop")
                .at(document.scenario.place_of("initial"), "from here")
                .help("begin within the stop: by `initial` of `[scenario]`, where missing values are zero"),
        );
    }
}

/// The note on an operating point beyond rigid stops, which are open in an analysis.
pub(in crate::study) fn describe_passed_stops(reduced: &Reduced, position: &[f64]) -> Option<String> {
    let listed: Vec<String> = beyond(reduced, position)
        .iter()
        .map(|(element, by, unit)| format!("{by:.6} {unit} beyond the stop of `{element}`"))
        .collect();
    let listed = listed.join(", ");
    (!listed.is_empty()).then(|| {
        format!("the operating point lies {listed}: the model cannot be there; the analysis treats the stop as open")
    })
}
