//! `[parameters]`, and keys of elements that are written with a tolerance.

use std::collections::{BTreeSet, HashMap};

use super::document::{Document, Parameter};
use super::in_order::in_order;
use super::keys::{Following, expression_diagnostic};
use super::parse::{Node, check_name, reserved_name, value_near};
use kardan_math::names;
use kardan_math::units::{Dimension, Evaluated, Exact, Expression, Tolerated, format_quantity, parse_number};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::{Place, RawValue};
use kardan_schema::schema::{Kind, Scalar, Sign, Table, Value};

/// Reads `[parameters]`; returns the computed ones.
pub(super) fn read_parameters(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) -> Vec<Following> {
    let before = out.len();
    let mut following = Vec::new();
    let Some(node) = root.child("parameters", out) else {
        document.suppressed.all |= out.len() > before;
        return following;
    };
    for found in node.table.iter() {
        let (name, place, entry) = (found.key.as_str(), found.place.clone(), &found.entry);
        // Doubtful until read: its users are not reported for it.
        document.suppressed.names.insert(name.to_string());
        if !check_name(name, place.clone(), "parameter", out) {
            continue;
        }
        let number = parse_number(name);
        if number.is_ok() || number.is_err_and(|error| error.code == "number::not-finite") {
            out.push(reserved_name(name, &place, "parameter", "it means a number"));
            continue;
        }
        let what = format!("parameter `{name}`");
        let is_number = matches!(entry.value, RawValue::Number(_));
        let kind = if is_number { Kind::Number(Sign::Any) } else { Kind::AnyQuantity };
        let Some(read) = value_near(&kind, &what, entry, node.hints, out) else { continue };
        let name = name.to_string();
        match read.value {
            Value::Scalar(Scalar::Literal(value, dimension)) => {
                let text = match &entry.value {
                    RawValue::Text(text) | RawValue::Number(text) => text.clone(),
                    _ => format_quantity(&value, dimension),
                };
                document.suppressed.names.remove(&name);
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
                document.suppressed.names.remove(&name);
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

/// Computed values in dependency order, otherwise in the order of the file.
pub(super) fn follow(unresolved: Vec<Following>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    let mut values: HashMap<String, (Exact, Dimension)> = HashMap::new();
    for parameter in document.all_parameters().chain(&document.keys) {
        values.entry(parameter.name.clone()).or_insert_with(|| (parameter.value.clone(), parameter.dimension));
    }
    let Waiting { needs, mut missing, named_by } = Waiting::of(&unresolved, &values, document);
    // Computable values, first those that need no further pass over the list.
    let mut ready: BTreeSet<(usize, usize)> =
        (0..unresolved.len()).filter(|k| missing[*k] == 0).map(|k| (0, k)).collect();
    let (mut passes, mut rank) = (vec![0; unresolved.len()], 0);
    while let Some((pass, number)) = ready.pop_first() {
        let Following { name, place, expression, key } = &unresolved[number];
        let (value, dimension) = match expression.evaluate(&|name| values.get(name).cloned()) {
            Ok(found) => match key {
                Some(expected) => match fitting(&found, *expected) {
                    Some(fitting) => fitting,
                    None => continue,
                },
                None => (found.value, found.dimension),
            },
            Err(error) => {
                // For a key it is reported where the element is read.
                if key.is_none() {
                    out.push(expression_diagnostic(
                        document,
                        &format!("parameter `{name}`"),
                        error,
                        expression,
                        (place, out),
                    ));
                }
                continue;
            }
        };
        rank += 1;
        document.suppressed.names.remove(name);
        values.entry(name.clone()).or_insert_with(|| (value.clone(), dimension));
        let list = if key.is_some() { &mut document.keys } else { &mut document.parameters };
        let (text, spread, expression) = (expression.text().to_string(), None, Some(expression.clone()));
        let (name, place) = (name.clone(), place.clone());
        list.push(Parameter { name, place, value, dimension, text, spread, expression, rank });
        for &dependent in &named_by[number] {
            missing[dependent] -= 1;
            passes[dependent] = passes[dependent].max(pass + usize::from(dependent < number));
            if missing[dependent] == 0 {
                ready.insert((passes[dependent], dependent));
            }
        }
    }
    circles(&unresolved, &needs, out);
}

/// The open dependencies of computed values.
struct Waiting {
    /// Those of the list that each needs.
    needs: Vec<Vec<usize>>,
    /// The number of open dependencies of each, including unavailable ones.
    missing: Vec<usize>,
    /// Those of the list that need each.
    named_by: Vec<Vec<usize>>,
}

impl Waiting {
    fn of(unresolved: &[Following], values: &HashMap<String, (Exact, Dimension)>, document: &Document) -> Self {
        let mut places: HashMap<&str, usize> = HashMap::new();
        for (number, one) in unresolved.iter().enumerate() {
            places.entry(&one.name).or_insert(number);
        }
        let (mut needs, mut missing) = (vec![Vec::new(); unresolved.len()], vec![0; unresolved.len()]);
        let mut named_by = needs.clone();
        for (number, one) in unresolved.iter().enumerate() {
            let may_come = |name: &&str| !values.contains_key(*name) && document.suppressed.has_key(name);
            for name in one.expression.names().into_iter().filter(may_come) {
                missing[number] += 1;
                if let Some(&needed) = places.get(name) {
                    needs[number].push(needed);
                    named_by[needed].push(number);
                }
            }
        }
        Self { needs, missing, named_by }
    }
}

/// A value as one of the dimension of a key: angles are not counted, and a frequency may replace a time.
pub(super) fn fitting(found: &Evaluated, expected: Dimension) -> Option<(Exact, Dimension)> {
    match expected.of_other(&found.value, &found.dimension) {
        Some(period) => Some((period, expected)),
        None => expected.is_like(&found.dimension).then(|| (found.value.clone(), expected)),
    }
}

/// Reports values that depend on themselves, each cycle once.
fn circles(unresolved: &[Following], needs: &[Vec<usize>], out: &mut Vec<Diagnostic>) {
    for circle in in_order(needs).1 {
        let names: Vec<&str> = circle.iter().map(|k| unresolved[*k].name.as_str()).collect();
        let Following { name, place, expression, key } = &unresolved[circle[0]];
        let what = if key.is_some() { "" } else { "parameter " };
        let message = format!("{what}`{name}` depends on itself: {}", names::circle(&names));
        let at = place.inside(expression.text());
        out.push(
            Diagnostic::error("parameter::cyclic-definition", message)
                .at(at, "circular")
                .help("write one of them as a number with its unit"),
        );
    }
}

fn parameter(name: String, place: Place, read: Tolerated) -> Parameter {
    let Tolerated { value, dimension, spread, text } = read;
    Parameter { name, place, value, dimension, text, spread: Some(spread), expression: None, rank: 0 }
}

/// Removes the tolerances from an element's table: each such key becomes a parameter of the name `<element>.<key>`.
pub(super) fn implicit_parameters(element: &str, table: &mut Table) -> Vec<Parameter> {
    let mut out = Vec::new();
    for (key, entry) in &mut table.values {
        let name = format!("{element}.{key}");
        if let Value::Scalar(scalar @ Scalar::Tolerated(_)) = &mut entry.value
            && let Scalar::Tolerated(read) = std::mem::replace(scalar, Scalar::Parameter(name.clone()))
        {
            out.push(parameter(name, entry.place.clone(), *read));
        }
    }
    out
}

/// The same for its named values, in lists of tables, and, on request, for its own keys: `scenario.initial.a.phi`, `scenario.event.1.at`.
pub(super) fn implicit_nested(prefix: &str, table: &mut Table, own: bool) -> Vec<Parameter> {
    let mut out = if own { implicit_parameters(prefix, table) } else { Vec::new() };
    for (key, entry) in &mut table.values {
        match &mut entry.value {
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
                    out.extend(implicit_nested(&format!("{prefix}.{key}.{}", k + 1), table, true));
                }
            }
            _ => {}
        }
    }
    out
}

pub(super) const REMOVE_TOLERANCE: &str =
    "remove the tolerance: elements, `[parameters]`, `initial` of `[scenario]`, its events and faults can have one";

/// Reports tolerances where a value cannot have one, and continues with the value itself.
pub(super) fn refuse_tolerances(table: &mut Table, what: &str, help: &str, out: &mut Vec<Diagnostic>) {
    let refuse = |scalar: &mut Scalar, place: &Place, what: String, out: &mut Vec<Diagnostic>| {
        if let Scalar::Tolerated(read) = scalar {
            out.push(
                Diagnostic::error("tolerance::not-allowed", format!("{what} cannot have a tolerance"))
                    .at(place, "with a tolerance")
                    .help(help),
            );
            *scalar = Scalar::Literal(read.value.clone(), read.dimension);
        }
    };
    for (key, entry) in &mut table.values {
        match &mut entry.value {
            Value::Scalar(scalar) => refuse(scalar, &entry.place, format!("`{key}` of {what}"), out),
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
            Value::Word(_) | Value::Names(_) | Value::Poles(_) => {}
        }
    }
}
