//! Models without the elements that designs leave out.

use std::collections::BTreeSet;

use crate::study::check::model_checks::signals_of;
use crate::study::operating_point::named_point::NamedPoint;
use crate::study::read::locations::place_in_control;
use kardan_math::names::did_you_mean;
use kardan_model::{ControlSpec, Document, Model};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, nearest, shortened};
use kardan_schema::schema::LawKeys;
use kardan_synthesis::Program;

/// The elements, with their parts, that the design of a controller leaves out; errors are reported.
pub(in crate::study) fn excluded(
    document: &Document,
    control: &ControlSpec,
    out: &mut Vec<Diagnostic>,
) -> Option<BTreeSet<String>> {
    let place = place_in_control(document, control, "excluded_elements");
    let mut found = BTreeSet::new();
    if control.law.keyword == Program::KEYWORD && control.values.has("excluded_elements") {
        let message =
            format!("control `{}`: a program is not designed, so `excluded_elements` has no effect", control.name);
        out.push(Diagnostic::error("control::excluded-elements", message).at(place, "not read").help("take it out"));
        return None;
    }
    for name in control.values.names("excluded_elements").unwrap_or_default() {
        let Some(element) = document.elements.get(name) else {
            let element_names = document.elements.iter().map(|element| element.name.as_str());
            let message =
                format!("`excluded_elements` of control `{}`: there is no element `{}`", control.name, shortened(name));
            let otherwise = || "name elements of the model: a vehicle, a torque, a spring_damper".to_string();
            let help = did_you_mean(nearest(name, element_names), otherwise);
            out.push(Diagnostic::error("name::unknown", message).at(place, "unknown").help(help));
            return None;
        };
        // The span of a part is the header of its element.
        let parts = document.elements.iter().filter(|part| part.place == element.place);
        found.extend(parts.map(|part| part.name.clone()));
    }
    if !found.is_empty() && NamedPoint::is_named(document, control) {
        let message = format!(
            "control `{}`: a design that leaves elements out has no operating point of the whole model",
            control.name
        );
        let help = "take out `at` or `excluded_elements`";
        out.push(Diagnostic::error("control::excluded-elements", message).at(place, "left out here").help(help));
        return None;
    }
    Some(found)
}

/// The error that a controller needs an element that its design leaves out.
pub(in crate::study) fn needed_by(document: &Document, control: &ControlSpec, model: &Model) -> Option<Diagnostic> {
    let inputs = (control.law.inputs)(&control.values);
    let mut signals = signals_of(control.law.fields, &control.values);
    if let Some(observer) = control.values.table("observer") {
        signals.extend(observer.names("sensors").unwrap_or_default().iter().cloned());
        signals.extend(observer.names("disturbances").unwrap_or_default().iter().cloned());
    }
    let is_present = |name: &str| {
        let head = SignalName::new(name).element;
        model.all_coordinates.iter().any(|coordinate| coordinate == head)
            || model.terms.iter().any(|named| named.element == head)
    };
    let missing = inputs.iter().chain(&signals).find(|name| !is_present(name))?;
    let place = place_in_control(document, control, "excluded_elements");
    let message = format!("control `{}`: its design leaves out `{}`, which it needs", control.name, shortened(missing));
    let help = "leave out less: removing a shaft also removes the elements that act on it";
    Some(Diagnostic::error("control::excluded-elements", message).at(place, "left out here").help(help))
}

/// The model without these elements, and without all that act on their coordinates.
pub(in crate::study) fn model_excluding(model: &Model, excluded: &BTreeSet<String>) -> Model {
    let gone = |name: &str| excluded.contains(name);
    let mut out = model.clone();
    out.terms.retain(|named| !gone(&named.element) && !named.term.coordinates().into_iter().any(gone));
    out.all_coordinates.retain(|name| !gone(name));
    out
}
