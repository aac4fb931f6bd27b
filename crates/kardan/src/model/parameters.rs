//! `[parameters]`, and keys of elements that are written with a tolerance.

use super::document::{Document, Parameter};
use super::parse::{Node, check_name, value};
use crate::diagnostics::{Diagnostic, shortened};
use crate::entries::{Place, Written};
use crate::schema::{Kind, Scalar, Sign, Table, Value};
use crate::units::{Evaluated, Expression, Tolerated, UnitError, parse_number, written_quantity};

pub(super) fn read_parameters(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    let before = out.len();
    let Some(node) = root.child("parameters", out) else {
        document.doubts.all |= out.len() > before;
        return;
    };
    let mut following = Vec::new();
    for found in node.table.iter() {
        let (name, place, given) = (found.key.as_str(), found.place.clone(), &found.entry);
        // In doubt until it is read: what uses it is not wrong for that.
        document.doubts.names.insert(name.to_string());
        if !check_name(name, place.clone(), "parameter", out) {
            continue;
        }
        let number = parse_number(name);
        if number.is_ok() || number.is_err_and(|error| error.code == "number::not-finite") {
            out.push(
                Diagnostic::error(
                    "name::reserved",
                    format!("`{name}` cannot be the name of a parameter: it means a number"),
                )
                .at(place, "this name")
                .help(format!("choose another name, such as `{name}_1`")),
            );
            continue;
        }
        let what = format!("parameter `{name}`");
        let is_number = matches!(given.value, Written::Number(_));
        let kind = if is_number { Kind::Number(Sign::Any) } else { Kind::AnyQuantity };
        let Some(read) = value(&kind, &what, given, out) else { continue };
        let name = name.to_string();
        match read.value {
            Value::Scalar(Scalar::Literal(value, dimension)) => {
                let text = match &given.value {
                    Written::Text(text) | Written::Number(text) => text.clone(),
                    _ => written_quantity(&value, dimension),
                };
                document.doubts.names.remove(&name);
                let (place, spread, expression) = (read.place, None, None);
                document.parameters.push(Parameter { name, place, value, dimension, text, spread, expression });
            }
            Value::Scalar(Scalar::Expression(expression)) => following.push((name, read.place, *expression)),
            Value::Scalar(Scalar::Tolerated(tolerated)) => {
                document.doubts.names.remove(&name);
                document.parameters.push(parameter(name, read.place, *tolerated));
            }
            _ => out.push(
                Diagnostic::error("parameter::literal", format!("{what} must be a quantity, not a name"))
                    .at(read.place, "not a quantity")
                    .help("write a number with its unit, such as \"30 deg\""),
            ),
        }
    }
    follow(following, document, out);
}

/// Parameters that follow from others, in an order in which each stands behind those that it needs.
fn follow(mut left: Vec<(String, Place, Expression)>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    loop {
        let before = left.len();
        let mut waiting = Vec::new();
        for (name, place, expression) in std::mem::take(&mut left) {
            let known = |name: &str| document.parameters.iter().find(|parameter| parameter.name == name);
            let undefined: Vec<&str> = expression.names().into_iter().filter(|name| known(name).is_none()).collect();
            if undefined.iter().any(|name| document.doubts.has(name)) {
                waiting.push((name, place, expression));
                continue;
            }
            match expression.evaluate(&|name| known(name).map(|found| (found.value.clone(), found.dimension))) {
                Ok(Evaluated { value, dimension, .. }) => {
                    document.doubts.names.remove(&name);
                    let (text, spread, expression) = (expression.text().to_string(), None, Some(expression));
                    document.parameters.push(Parameter { name, place, value, dimension, text, spread, expression });
                }
                Err(error) => out.push(mistake(&format!("parameter `{name}`"), error, &expression, &place)),
            }
        }
        left = waiting;
        if left.len() == before {
            break;
        }
    }
    // What is left waits for a parameter with a mistake, or for itself.
    let waits = |name: &str| left.iter().find(|(other, ..)| other == name);
    for (name, place, own) in &left {
        let mut chain = vec![name.as_str()];
        while let Some((_, _, expression)) = chain.last().and_then(|last| waits(last)) {
            let Some(next) = expression.names().into_iter().find(|name| waits(name).is_some()) else { break };
            if next == name {
                chain.push(next);
                let message = format!("parameter `{name}` follows from itself: {}", chain.join(" from "));
                let at = place.part(own.text(), 0..own.text().len());
                out.push(
                    Diagnostic::error("parameter::circle", message)
                        .at(at, "in a circle")
                        .help("write one of them as a number with its unit"),
                );
                break;
            }
            if chain.contains(&next) {
                break;
            }
            chain.push(next);
        }
    }
}

/// A mistake in an expression, at its place.
pub(super) fn mistake(what: &str, error: UnitError, expression: &Expression, place: &Place) -> Diagnostic {
    let at = place.part(expression.text(), error.span);
    let diagnostic = Diagnostic::error(error.code, format!("{what}: {}", error.message)).at(at, "");
    Diagnostic { help: error.help, ..diagnostic }
}

fn parameter(name: String, place: Place, read: Tolerated) -> Parameter {
    let Tolerated { value, dimension, spread, text } = read;
    Parameter { name, place, value, dimension, text, spread: Some(spread), expression: None }
}

/// Takes the tolerances out of an element's table: each such key becomes a parameter of the name `<element>.<key>`.
pub(super) fn implicit_parameters(element: &str, table: &mut Table) -> Vec<Parameter> {
    let mut out = Vec::new();
    for (key, given) in &mut table.values {
        let name = format!("{element}.{key}");
        if let Value::Scalar(scalar @ Scalar::Tolerated(_)) = &mut given.value
            && let Scalar::Tolerated(read) = std::mem::replace(scalar, Scalar::Parameter(name.clone()))
        {
            out.push(parameter(name, given.place.clone(), *read));
        }
    }
    out
}

pub(super) const REMOVE_TOLERANCE: &str = "remove the tolerance: elements and `[parameters]` can have one";

/// Reports tolerances where a value cannot have one, and goes on with the value itself.
pub(super) fn refuse_tolerances(table: &mut Table, what: &str, help: &str, out: &mut Vec<Diagnostic>) {
    let refuse = |scalar: &mut Scalar, place: &Place, what: String, out: &mut Vec<Diagnostic>| {
        if let Scalar::Tolerated(read) = scalar {
            out.push(
                Diagnostic::error("tolerance::place", format!("{what} cannot have a tolerance"))
                    .at(place.clone(), "with a tolerance")
                    .help(help),
            );
            *scalar = Scalar::Literal(read.value.clone(), read.dimension);
        }
    };
    for (key, given) in &mut table.values {
        match &mut given.value {
            Value::Scalar(scalar) => refuse(scalar, &given.place, format!("`{key}` of {what}"), out),
            Value::Map(entries) => {
                for (name, scalar) in entries {
                    let what = format!("`{}` in `{key}` of {what}", shortened(&name.value));
                    refuse(&mut scalar.value, &scalar.place, what, out);
                }
            }
            Value::Tables(tables) => {
                for (i, table) in tables.iter_mut().enumerate() {
                    refuse_tolerances(table, &format!("entry {} of `{key}` of {what}", i + 1), help, out);
                }
            }
            Value::Word(_) | Value::Words(_) | Value::Poles(_) => {}
        }
    }
}
