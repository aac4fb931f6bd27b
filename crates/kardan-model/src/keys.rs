//! Keys of elements as names in expressions: `2 * wheel.inertia`.

use std::collections::BTreeSet;

use super::document::{Document, Instance, Parameter};
use kardan_elements::element::KeyError;
use kardan_math::names::nearest;
use kardan_math::units::{Dimension, Exact, Expression, UnitError, format_quantity};
use kardan_results::signal_name::parameter;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::{Entries, Place};
use kardan_schema::schema::{Field, Kind, Placed, Scalar, Table, Value};

/// A value computed from others: an entry of `[parameters]`, or the key of an element.
pub(super) struct Following {
    pub(super) name: String,
    pub(super) place: Place,
    pub(super) expression: Expression,
    /// Of a key of an element, which reports its own errors: its dimension.
    pub(super) key: Option<Dimension>,
}

/// Keys of elements that expressions anywhere in a model name: values go into the document, computed ones are returned.
pub(super) fn named_keys(entries: &Entries, document: &mut Document) -> Vec<Following> {
    let mut named = BTreeSet::new();
    entries.iter().for_each(|found| found.entry.value.each_text(&mut |text: &str| names_of(text, &mut named)));
    let (mut following, mut keys, mut suppressed) = (Vec::new(), Vec::new(), Vec::new());
    let implicit: BTreeSet<&str> = document.implicit.iter().map(|parameter| parameter.name.as_str()).collect();
    let mut used: BTreeSet<String> = BTreeSet::new();
    for (element, field, dimension) in numbers(document) {
        let name = format!("{}.{}", element.name, field.name);
        if !named.contains(&name) || implicit.contains(name.as_str()) || !used.insert(name.clone()) {
            continue;
        }
        if element.table.unread.contains(&field.name) {
            suppressed.push(name);
            continue;
        }
        let entry = element.table.values.get(field.name);
        let place = entry.map_or(&element.place, |entry| &entry.place).clone();
        let scalar = entry.map(|entry| &entry.value);
        let expression = match scalar {
            Some(Value::Scalar(Scalar::Expression(expression))) => Some((**expression).clone()),
            Some(Value::Scalar(Scalar::Parameter(other))) => Expression::parse(&format!("'{other}'")).ok(),
            _ => None,
        };
        let literal = match scalar {
            Some(Value::Scalar(Scalar::Literal(value, _))) => Some(value.clone()),
            None => field.default_number(),
            _ => None,
        };
        if let Some(expression) = expression {
            suppressed.push(name.clone());
            following.push(Following { name, place, expression, key: Some(dimension) });
        } else if let Some(value) = literal {
            keys.push(exact_parameter(name, place, value, dimension));
        }
    }
    document.keys.extend(keys);
    document.suppressed.names.extend(suppressed);
    following
}

fn exact_parameter(name: String, place: Place, value: Exact, dimension: Dimension) -> Parameter {
    let text = format_quantity(&value, dimension);
    Parameter { name, place, value, dimension, text, spread: None, expression: None, rank: 0 }
}

/// The keys of elements with a number.
fn numbers(document: &Document) -> impl Iterator<Item = (&Instance, &'static Field, Dimension)> {
    document.elements.iter().flat_map(|element| {
        element.kind.fields.iter().filter_map(move |field| {
            match field.kind.for_translation(element.table.translational) {
                Kind::Quantity(dimension, _) => Some((element, field, dimension)),
                Kind::Number(_) => Some((element, field, Dimension::NONE)),
                _ => None,
            }
        })
    })
}

impl Document {
    /// A value that could have a tolerance but has none, by its name as one that varies (`a.inertia`, `scenario.event.1.at`, `fault.weak.value`): how it
    /// is written, where it is, or else its inputs.
    pub fn untoleranced_value(&self, name: &str) -> Option<Result<String, String>> {
        let of_element = || {
            let named = |(element, field, _): &(&Instance, &Field, Dimension)| {
                name.strip_prefix(element.name.as_str()).and_then(|rest| rest.strip_prefix('.')) == Some(field.name)
            };
            let (element, field, dimension) = numbers(self).find(named)?;
            if element.table.values.contains_key(field.name) {
                return scalar_at(&element.table, field.name);
            }
            let unread = element.table.unread.contains(&field.name);
            let value = field.default_number().filter(|_| !unread)?;
            Some((Scalar::Literal(value.clone(), dimension), format_quantity(&value, dimension)))
        };
        let of_fault = || {
            let rest = name.strip_prefix("fault.")?;
            let own = |(fault, table): &(Placed<String>, Table)| {
                scalar_at(table, rest.strip_prefix(fault.value.as_str())?.strip_prefix('.')?)
            };
            self.faults.iter().find_map(own)
        };
        let of_scenario = || scalar_at(&self.scenario, name.strip_prefix("scenario.")?);
        match of_element().or_else(of_fault).or_else(of_scenario)? {
            (Scalar::Literal(value, dimension), text) if value.is_zero() => {
                Some(Ok(format!("{text} ± {}", format_quantity(&Exact::from_ratio(1, 1), dimension))))
            }
            (Scalar::Literal(..), text) => Some(Ok(format!("{text} ± 10 %"))),
            (Scalar::Parameter(other), _) => Some(Err(other)),
            (Scalar::Expression(read), _) => Some(Err(read.text().into())),
            (Scalar::Tolerated(_), _) => None,
        }
    }
}

/// The number at a path below a table, with how it is written.
fn scalar_at(table: &Table, path: &str) -> Option<(Scalar, String)> {
    let (key, rest) = path.split_once('.').map_or((path, None), |(key, rest)| (key, Some(rest)));
    let literal_text = |scalar: &Scalar| match scalar {
        Scalar::Literal(value, dimension) => format_quantity(value, *dimension),
        _ => String::new(),
    };
    match (&table.values.get(key)?.value, rest) {
        (Value::Scalar(scalar), None) => {
            Some((scalar.clone(), table.source_text.get(key).cloned().unwrap_or_else(|| literal_text(scalar))))
        }
        (Value::Map(entries), Some(name)) => {
            let (_, scalar) = entries.iter().find(|(candidate, _)| candidate.value == name)?;
            Some((scalar.value.clone(), literal_text(&scalar.value)))
        }
        (Value::Tables(tables), Some(rest)) => {
            let (number, rest) = rest.split_once('.')?;
            scalar_at(tables.get(number.parse::<usize>().ok()?.checked_sub(1)?)?, rest)
        }
        _ => None,
    }
}

/// The names with a dot in a text that is an expression.
fn names_of(text: &str, out: &mut BTreeSet<String>) {
    if text.contains('.')
        && let Ok(read) = Expression::parse(text).or_else(|_| Expression::parse_law(text))
    {
        out.extend(read.names().into_iter().filter(|name| name.contains('.')).map(str::to_string));
    }
}

/// The suggestion for an unknown name in an expression; none if a unit is nearer.
fn suggestion(document: &Document, expression: &Expression, unknown: &str, unit: Option<&str>) -> Option<String> {
    let parameters = || document.parameters.iter().map(|parameter| parameter.name.as_str());
    let is_named = |(element, field, _): &(&Instance, &Field, Dimension)| {
        element.table.values.contains_key(field.name) || field.default.is_some()
    };
    let keys: Vec<String> = numbers(document)
        .filter(is_named)
        .map(|(element, field, _)| format!("{}.{}", element.name, field.name))
        .collect();
    let all = || parameters().chain(keys.iter().map(String::as_str));
    let split_name = |name: &&str| name.contains('-') && name.contains(unknown) && expression.text().contains(*name);
    if let Some(name) = all().find(split_name) {
        return Some(format!("quote a name with `-`: `'{name}'`"));
    }
    if let Some((element, key)) = parameter(unknown)
        && let Some(instance) = document.elements.get(element)
    {
        let kind = instance.kind.keyword;
        let own =
            || numbers(document).filter(|(candidate, ..)| candidate.name == element).map(|(_, field, _)| field.name);
        if own().any(|name| name == key) {
            return Some(format!("`{key}` of {kind} `{element}` is not set: give it a value"));
        }
        return Some(match nearest(key, own()) {
            Some(near) => format!("did you mean `{element}.{near}`?"),
            None => format!("{kind} `{element}` has {}", kardan_math::names::quoted(own())),
        });
    }
    let near = nearest(unknown, all().chain(unit)).filter(|near| unit != Some(*near))?;
    let what = if parameters().any(|name| name == near) { "the parameter " } else { "" };
    let quotes = if near.contains('-') { "'" } else { "" };
    Some(format!("did you mean {what}`{quotes}{near}{quotes}`?"))
}

/// Above this number of errors kardan makes no suggestions, which compare each name with all others.
pub(super) const GUESSES: usize = 500;

/// An error that a kind finds in the keys of a table: at the key, or at the header if the key is absent.
pub(super) fn key_diagnostic(
    code: &'static str,
    what: &str,
    error: KeyError,
    (table, header): (&Table, &Place),
) -> Diagnostic {
    let at = table.values.get(error.key).map_or(header, |value| &value.place);
    Diagnostic::error(code, format!("{what}: {}", error.message)).at(at, "").help(error.help)
}

/// An error in an expression: of an unknown name with the message and the remedy of those who may read it, by that name.
pub(super) fn unknown_in(
    mut error: UnitError,
    text: &str,
    (place, what): (&Place, &str),
    words: impl FnOnce(&str) -> (String, String),
) -> Diagnostic {
    if error.message.starts_with("there is no parameter") && !error.message.contains("follow a number") {
        let name = text.get(error.span.clone()).unwrap_or_default().trim_matches('\'');
        let (message, help) = words(name);
        error = UnitError { code: "name::unknown", message, help: Some(help), span: error.span };
    }
    Diagnostic::of_unit_error(what, error, text, place)
}

/// An error in an expression, at its place, with a suggestion for a name.
pub(super) fn expression_diagnostic(
    document: &Document,
    what: &str,
    mut error: UnitError,
    expression: &Expression,
    (place, out): (&Place, &[Diagnostic]),
) -> Diagnostic {
    if matches!(error.code, "name::unknown" | "unit::unknown") && out.len() < GUESSES {
        let part = expression.text().get(error.span.clone()).unwrap_or_default().trim_matches('\'');
        let unit = error.help.as_deref().and_then(|help| help.strip_prefix("did you mean `")?.split('`').next());
        error.help = suggestion(document, expression, part, unit).or(error.help);
    }
    Diagnostic::of_unit_error(what, error, expression.text(), place)
}
