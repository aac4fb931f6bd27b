//! Terms beyond those of the model: `[[identification.extra]]`.

use crate::assemble::Equations;
use crate::diagnostics::{Diagnostic, nearest, shortened};
use crate::equations::Term;
use crate::identify::{Extra, Shape};
use crate::model::{Document, Model, TableReader};
use crate::names::did_you_mean;
use crate::schema::{Sign, Table, Value};
use crate::study::read::{quantity, read_word};
use crate::units::Dimension;

/// A term beyond those of the model.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ExtraTerm {
    /// `fs.stribeck`, `wg.load_loss`
    pub name: String,
    pub element: String,
    pub shape: Option<Shape>,
    /// The Stribeck speed, where it is known.
    pub speed: Option<f64>,
    /// The input that loads the gear.
    pub torque: Option<String>,
}

/// The terms that the file declares.
pub(super) fn declared_terms(document: &Document, model: &Model, out: &mut Vec<Diagnostic>) -> Vec<ExtraTerm> {
    let Some(Value::Tables(tables)) = document.identification.values.get("extra").map(|given| &given.value) else {
        return Vec::new();
    };
    let mut terms: Vec<ExtraTerm> = Vec::new();
    for (k, table) in tables.iter().enumerate() {
        let what = format!("entry {} of `[[identification.extra]]`", k + 1);
        let Some(term) = declared_term(document, model, table, &what, out) else { continue };
        if terms.iter().any(|other| other.name == term.name) {
            out.push(
                Diagnostic::error("name::duplicate", format!("{what}: there are two terms `{}`", term.name))
                    .at(table.place.clone(), "again here")
                    .help("keep one"),
            );
            continue;
        }
        terms.push(term);
    }
    terms
}

/// One of them, if nothing is wrong with it.
fn declared_term(
    document: &Document,
    model: &Model,
    table: &Table,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<ExtraTerm> {
    let (load, element) = (read_word(table, "kind")? == "load", read_word(table, "friction")?.to_string());
    if !document
        .elements
        .iter()
        .any(|e| e.name == element && matches!(e.kind.keyword, "shaft" | "mass" | "spring_damper"))
    {
        let message = format!("{what}: there is no shaft or spring_damper `{}`", shortened(&element));
        let names = document.elements.iter().map(|e| e.name.as_str());
        let help = did_you_mean(nearest(&element, names), || "name one of the model".into());
        out.push(
            Diagnostic::error("name::unknown", message)
                .at(TableReader::place(table, "friction"), "no such element")
                .help(help),
        );
        return None;
    }
    let torque = read_word(table, "torque").map(str::to_string);
    if load && torque.is_none() {
        out.push(
            Diagnostic::error("key::missing", format!("{what}: a loss in proportion to a torque needs `torque`"))
                .at(table.place.clone(), "of which torque?")
                .help("name the motor or disturbance whose torque goes through the gear"),
        );
        return None;
    }
    let is_input = |name: &String| {
        model.terms.iter().any(|named| named.element == *name && matches!(named.term, Term::Input { .. }))
    };
    if let Some(name) = torque.as_ref().filter(|name| !is_input(name)) {
        let message = format!("{what}: there is no motor or disturbance `{}`", shortened(name));
        out.push(
            Diagnostic::error("name::unknown", message)
                .at(TableReader::place(table, "torque"), "no such input")
                .help("name an input of the model"),
        );
        return None;
    }
    let shape = match read_word(table, "shape") {
        _ if load => None,
        Some("exponential") => Some(Shape::Exponential),
        Some("peak") => Some(Shape::Peak),
        _ => Some(Shape::Gaussian),
    };
    let speed = (Dimension::ANGULAR_VELOCITY, Sign::Positive);
    let speed = quantity(&TableReader::new(document, &[]), table, "speed", speed, what, out).map(|x| x.to_f64());
    let name = format!("{element}.{}", if load { "load_loss" } else { "stribeck" });
    Some(ExtraTerm { name, element, shape, speed, torque: torque.filter(|_| load) })
}

/// The extra columns of the equations.
pub(super) fn extra_columns(equations: &Equations, extras: &[ExtraTerm]) -> Vec<Extra> {
    extras
        .iter()
        .map(|extra| {
            let friction = equations.frictions.iter().position(|term| term.element == extra.element);
            let friction = friction.expect("every extra term has a friction");
            match &extra.torque {
                Some(name) => {
                    let input = equations.inputs.iter().position(|input| input.element == *name);
                    Extra::Load { friction, input: input.expect("an input of the model") }
                }
                None => Extra::Stribeck { friction },
            }
        })
        .collect()
}
