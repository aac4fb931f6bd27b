//! `[parameters]`, and keys of elements that are written with a tolerance.

use std::collections::HashMap;

use super::document::{Document, Parameter};
use super::keys::{Following, mistake};
use super::parse::{Node, check_name, value_near};
use crate::diagnostics::{Diagnostic, shortened};
use crate::entries::{Place, Written};
use crate::schema::{Kind, Scalar, Sign, Table, Value};
use crate::units::{Dimension, Evaluated, Exact, Expression, Tolerated, parse_number, written_quantity};

/// Reads `[parameters]`; gives what follows from other values.
pub(super) fn read_parameters(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) -> Vec<Following> {
    let before = out.len();
    let mut following = Vec::new();
    let Some(node) = root.child("parameters", out) else {
        document.doubts.all |= out.len() > before;
        return following;
    };
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
        let Some(read) = value_near(&kind, &what, given, node.known, out) else { continue };
        let name = name.to_string();
        match read.value {
            Value::Scalar(Scalar::Literal(value, dimension)) => {
                let text = match &given.value {
                    Written::Text(text) | Written::Number(text) => text.clone(),
                    _ => written_quantity(&value, dimension),
                };
                document.doubts.names.remove(&name);
                let (place, spread, expression, rank) = (read.place, None, None, 0);
                document.parameters.push(Parameter { name, place, value, dimension, text, spread, expression, rank });
            }
            Value::Scalar(Scalar::Expression(expression)) => {
                following.push(Following { name, place: read.place, expression: *expression, key: None });
            }
            Value::Scalar(Scalar::Parameter(other)) => {
                let expression = Expression::parse(&format!("'{other}'")).expect("a name in quotes");
                following.push(Following { name, place: read.place, expression, key: None });
            }
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
    following
}

/// What follows from other values, in an order in which each stands behind those that it needs.
pub(super) fn follow(mut left: Vec<Following>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    let mut known: HashMap<String, (Exact, Dimension)> = HashMap::new();
    for parameter in document.all_parameters().chain(&document.keys) {
        known.entry(parameter.name.clone()).or_insert_with(|| (parameter.value.clone(), parameter.dimension));
    }
    let mut rank = 0;
    loop {
        let before = left.len();
        let mut waiting = Vec::new();
        for one in std::mem::take(&mut left) {
            let Following { name, place, expression, key } = &one;
            let may_come = |name: &&str| !known.contains_key(*name) && document.doubts.has_key(name);
            if expression.names().iter().any(may_come) {
                waiting.push(one);
                continue;
            }
            match expression.evaluate(&|name| known.get(name).cloned()) {
                Ok(found) if key.is_some_and(|wanted| fitting(&found, wanted).is_none()) => {}
                Ok(found) => {
                    rank += 1;
                    let (value, dimension) =
                        key.and_then(|wanted| fitting(&found, wanted)).unwrap_or((found.value, found.dimension));
                    document.doubts.names.remove(name);
                    known.entry(name.clone()).or_insert_with(|| (value.clone(), dimension));
                    let list = if key.is_some() { &mut document.keys } else { &mut document.parameters };
                    let (text, spread) = (expression.text().to_string(), None);
                    let Following { name, place, expression, .. } = one;
                    let expression = Some(expression);
                    list.push(Parameter { name, place, value, dimension, text, spread, expression, rank });
                }
                Err(error) if key.is_none() => {
                    out.push(mistake(document, &format!("parameter `{name}`"), error, expression, (place, out)));
                }
                // Told where the element is read.
                Err(_) => {}
            }
        }
        left = waiting;
        if left.len() == before {
            break;
        }
    }
    circles(&left, out);
}

/// A value as one of the dimension of a key: angles are not counted, and a frequency may stand for a time.
pub(super) fn fitting(found: &Evaluated, wanted: Dimension) -> Option<(Exact, Dimension)> {
    match wanted.of_other(&found.value, &found.dimension) {
        Some(period) => Some((period, wanted)),
        None => wanted.is_like(&found.dimension).then(|| (found.value.clone(), wanted)),
    }
}

/// Tells of what is left: it waits for a value with a mistake, or for itself.
fn circles(left: &[Following], out: &mut Vec<Diagnostic>) {
    let waiting: HashMap<&str, &Following> = left.iter().map(|one| (one.name.as_str(), one)).collect();
    for Following { name, place, expression: own, key } in left {
        let mut chain = vec![name.as_str()];
        while let Some(one) = chain.last().and_then(|last| waiting.get(last)) {
            let Some(next) = one.expression.names().into_iter().find(|name| waiting.contains_key(name)) else { break };
            if next == name {
                chain.push(next);
                let what = if key.is_some() { "" } else { "parameter " };
                let shown = if chain.len() > MOST_TOLD {
                    let (first, last) = (&chain[..MOST_TOLD / 2], &chain[chain.len() - MOST_TOLD / 2..]);
                    format!("{} from ... from {}", first.join(" from "), last.join(" from "))
                } else {
                    chain.join(" from ")
                };
                let message = format!("{what}`{name}` follows from itself: {shown}");
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

/// Members of a circle that are told.
const MOST_TOLD: usize = 20;

fn parameter(name: String, place: Place, read: Tolerated) -> Parameter {
    let Tolerated { value, dimension, spread, text } = read;
    Parameter { name, place, value, dimension, text, spread: Some(spread), expression: None, rank: 0 }
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

/// The same of what is given in it by name, in lists of tables, and, if asked for, by its own keys: `scenario.initial.a.phi`, `scenario.event.1.at`.
pub(super) fn implicit_within(prefix: &str, table: &mut Table, own: bool) -> Vec<Parameter> {
    let mut out = if own { implicit_parameters(prefix, table) } else { Vec::new() };
    for (key, given) in &mut table.values {
        match &mut given.value {
            Value::Map(entries) => {
                for (entry, scalar) in entries {
                    let name = format!("{prefix}.{key}.{}", entry.value);
                    if let Scalar::Tolerated(read) = &scalar.value {
                        out.push(parameter(name.clone(), scalar.place.clone(), (**read).clone()));
                        scalar.value = Scalar::Parameter(name);
                    }
                }
            }
            Value::Tables(tables) => {
                for (k, table) in tables.iter_mut().enumerate() {
                    out.extend(implicit_within(&format!("{prefix}.{key}.{}", k + 1), table, true));
                }
            }
            _ => {}
        }
    }
    out
}

pub(super) const REMOVE_TOLERANCE: &str =
    "remove the tolerance: elements, `[parameters]`, `initial` of `[scenario]`, its events and faults can have one";

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
