//! Constraints that a run keeps with their multipliers: what they do not go with, where a run begins on them, and what an analysis sees of
//! them.

use std::sync::Arc;

use super::places::{at_each, place_of};
use super::{Prepared, PreparedVariant};
use crate::diagnostics::{Diagnostic, quoted};
use crate::model::{Document, Model, TableReader};
use crate::reduce::{NoStart, OperatingPoint, Reduced, StartOnRows, frozen, start_on_rows};
use crate::schema::Value;
use crate::simulate::Scenario;

/// What does not go with kept rows; true if nothing of it is there.
pub(super) fn check_kept(document: &Document, model: &Model, reduced: &Reduced, out: &mut Vec<Diagnostic>) -> bool {
    let equations = &reduced.equations;
    let Some(first) = equations.kept.first() else { return true };
    let names = quoted(equations.kept.iter().map(|kept| kept.element.as_str()));
    let before = out.len();
    let mut refuse = |message: String, place, label: &str, help: &str| {
        let mistake =
            Diagnostic::error("constraint::kept", message).at(place_of(document, &first.element), "this constraint");
        out.push(mistake.at(place, label).help(help));
    };
    if let Some(control) = model.controls.first() {
        let message = format!("laws are not designed beside a constraint that is not solved for a coordinate: {names}");
        refuse(message, control.place.clone(), "this controller", "write the law as a `torque`, or take it out");
    }
    if !document.bench.values.is_empty() || !document.identification.values.is_empty() {
        let place =
            if document.bench.values.is_empty() { &document.identification.place } else { &document.bench.place };
        let message =
            format!("bench and identification do not know constraints that are not solved for a coordinate: {names}");
        refuse(message, place.clone(), "this table", "take it out");
    }
    if document.scenario.values.get("start").is_some_and(|found| found.value == Value::Word("equilibrium".into())) {
        let message = format!("no equilibrium is looked for on {names}");
        refuse(
            message,
            TableReader::place(&document.scenario, "start"),
            "no equilibrium",
            "give the angles to begin with by `initial`",
        );
    }
    if equations.kept.len() >= reduced.degrees_of_freedom() {
        let message = format!(
            "the constraints leave no motion: {} coordinates and {} more constraints",
            reduced.degrees_of_freedom(),
            equations.kept.len()
        );
        let elements = equations.kept.iter().map(|kept| kept.element.as_str());
        let mistake = Diagnostic::error("constraint::no-motion", message)
            .help("remove a constraint, or add a shaft: a model needs at least one degree of freedom");
        out.push(at_each(document, elements, "a constraint", mistake));
    }
    out.len() == before
}

/// Puts the start of a run on the kept rows; tells what changed.
pub(super) fn begin_on_rows(
    document: &Document,
    reduced: &Reduced,
    scenario: &mut Scenario,
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let equations = &reduced.equations;
    if equations.kept.is_empty() {
        return Vec::new();
    }
    let element = |k: usize| equations.kept[k].element.as_str();
    match start_on_rows(reduced, &scenario.position, &scenario.speed) {
        Ok(StartOnRows { position, speed }) => {
            let mut changed = Vec::new();
            let names = reduced.coordinate_names();
            for (rate, now, then) in [(0, &scenario.position, &position), (1, &scenario.speed, &speed)] {
                for (k, (now, then)) in now.iter().zip(then).enumerate().filter(|(_, (now, then))| now != then) {
                    let quantity = equations.domain(reduced.coordinates[k]).motion()[rate];
                    changed.push(format!(
                        "{} = {then} {} instead of {now}",
                        quantity.of(&names[k]),
                        quantity.physical().unit()
                    ));
                }
            }
            (scenario.position, scenario.speed) = (position, speed);
            let rows = quoted((0..equations.kept.len()).map(element));
            let note = format!("the run begins at the nearest place on {rows}: {}", changed.join(", "));
            if changed.is_empty() { Vec::new() } else { vec![note] }
        }
        Err(error) => {
            let (message, rows): (_, Vec<usize>) = match error {
                NoStart::NotReached(rows) => {
                    let names = quoted(rows.iter().map(|k| element(*k)));
                    (format!("no start was found near `initial` that satisfies {names}"), rows)
                }
                NoStart::Dependent => {
                    let all = 0..equations.kept.len();
                    let message = format!(
                        "at the start the constraints {} depend on each other, to ten digits, or one of them constrains nothing there",
                        quoted(all.clone().map(element))
                    );
                    (message, all.collect())
                }
            };
            let mistake = Diagnostic::error("constraint::start", message)
                .at(TableReader::place(&document.scenario, "initial"), "from here")
                .help("give other angles by `initial` of `[scenario]`, or correct the constraint");
            out.push(at_each(document, rows.into_iter().map(element), "this constraint", mistake));
            Vec::new()
        }
    }
}

/// What an analysis sees: kept rows with their coefficients at the start.
pub(super) fn for_analysis(prepared: &Prepared) -> Result<Prepared, Diagnostic> {
    let one = |variant: &Arc<PreparedVariant>| frozen_variant(variant).map(Arc::new);
    Ok(Prepared {
        name: prepared.name.clone(),
        description: prepared.description.clone(),
        variants: prepared.variants.iter().map(one).collect::<Result<_, _>>()?,
        requirements: Vec::new(),
        plots: Vec::new(),
        tolerance: prepared.tolerance,
    })
}

/// The same of one variant.
///
/// # Errors
/// Why its kept rows have no linear ones in their place.
pub(super) fn frozen_variant(variant: &PreparedVariant) -> Result<PreparedVariant, Diagnostic> {
    let own = &variant.reduced;
    let names = quoted(own.equations.kept.iter().map(|kept| kept.element.as_str()));
    let refused = |message: String, help: &str| Diagnostic::error("analysis::kept", message).help(help);
    if !own.equations.laws.is_empty() {
        let message =
            format!("{names} may carry torques at rest, against torques of laws, and no linear model is made of that");
        return Err(refused(message, "take the laws out, or put springs in their place"));
    }
    if !variant.analysis.at.is_empty() {
        let message = format!("with {names} the operating point is the start of the run");
        return Err(refused(message, "take `at` of `[analysis]` out, and give `initial` of `[scenario]`"));
    }
    let reduced = frozen(own, &variant.scenario.position)
        .map_err(|error| refused(error.to_string(), "give other angles by `initial` of `[scenario]`"))?;
    let start = |shaft: &usize| {
        let place = own.coordinates.iter().position(|other| other == shaft);
        place.map_or(0.0, |place| variant.scenario.position[place])
    };
    let position: Vec<f64> = reduced.coordinates.iter().map(start).collect();
    let speed = vec![0.0; position.len()];
    Ok(PreparedVariant {
        point: OperatingPoint::zero(&reduced),
        name: variant.name.clone(),
        model: variant.model.clone(),
        reduced,
        design_models: Vec::new(),
        designed: Vec::new(),
        running: Vec::new(),
        scenario: Scenario { position, speed, ..variant.scenario.clone() },
        computed: variant.computed.clone(),
        analysis: variant.analysis.clone(),
        massless: Vec::new(),
        unfrozen: Some(Box::new(own.clone())),
        start_notes: Vec::new(),
    })
}
