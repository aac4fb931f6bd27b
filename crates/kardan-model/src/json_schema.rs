//! The JSON schema of model files, from the registries: with it editors complete keys, show units and mark errors during typing.

use serde_json::{Map, Value, json};

use super::manual::{STUDY_TABLES, kind_pages, need, study_table, value_kind};
use super::parse::example;
use kardan_elements::element;
use kardan_schema::schema::{Field, Kind};

/// The form of a quantity: a number with a unit, with or without a tolerance, the name of a parameter, or an expression of these.
/// `kardan check` checks the unit.
const QUANTITY: &str = r"^\s*[-+(]*\s*([A-Za-z_][A-Za-z0-9_-]*|[A-Za-z_].*[-+*/^()].*|[0-9.].*[A-Za-z°%Ωµμ].*)\s*$";
/// A number as a text, with or without a tolerance, the name of a parameter, or an expression of these.
const NUMBER: &str = r"^\s*[-+(]*\s*([A-Za-z_][A-Za-z0-9_-]*|[A-Za-z_].*[-+*/^()].*|[0-9.].*)\s*$";
/// The form of a name.
const NAME: &str = "^[A-Za-z_][A-Za-z0-9_-]{0,99}$";

/// The JSON schema (draft 7, which editors know) of a model file.
///
/// ```
/// let schema = kardan_model::json_schema();
/// assert!(schema.contains("harmonic_drive") && schema.contains("moment of inertia") || schema.contains("kg m^2"));
/// ```
pub fn json_schema() -> String {
    let mut properties = Map::new();
    for (page, fields) in STUDY_TABLES {
        let (header, what) = study_table(page);
        match header.strip_prefix("[[") {
            // With a name it is also a separate table.
            _ if *page == "fault" => drop(properties.insert((*page).into(), named(table(fields, what), what))),
            _ if header.contains("scenario.") => {}
            Some(_) => drop(properties.insert((*page).into(), several(table(fields, what)))),
            None if header.ends_with(".NAME]") => {
                properties.insert((*page).into(), named(table(fields, what), what));
            }
            None => drop(properties.insert((*page).into(), table(fields, what))),
        }
    }
    let values = json!({ "anyOf": [{ "type": "string" }, { "type": "number" }] });
    let what = "Named quantities, with tolerances if you like: beta = \"10 deg ± 1 deg\".";
    properties.insert("parameters".into(), named(values, what));
    let grid = json!({ "anyOf": [{ "type": "string" }, { "type": "array", "items": {} }] });
    properties
        .insert("variants".into(), named(grid, "Lists of parameter values, one run for each: beta = \"[0, 10] deg\"."));
    for kind in element::REGISTRY {
        properties.insert(kind.keyword.into(), named(table(kind.fields, kind.summary), kind.summary));
    }
    let law = of_kinds("law", "law");
    properties.insert("control".into(), named(law, "A control law: the key `law` selects it."));
    let signal = of_kinds("signal", "kind");
    properties.insert("signal".into(), named(signal, "A function of time: the key `kind` selects it."));
    let block = of_kinds("block", "kind");
    properties.insert("block".into(), named(block, "A block of signals: the key `kind` selects it."));
    let schema = json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "$id": "kardan/2/model",
        "title": "kardan/2, a model file",
        "type": "object",
        "additionalProperties": false,
        "properties": properties,
    });
    serde_json::to_string_pretty(&schema).unwrap_or_default()
}

/// Tables of a group, by their names.
fn named(table: Value, what: &str) -> Value {
    json!({ "type": "object", "description": what, "propertyNames": { "pattern": NAME }, "additionalProperties": table })
}

/// A list of tables, or one alone.
fn several(table: Value) -> Value {
    json!({ "anyOf": [{ "type": "array", "items": table.clone() }, table] })
}

/// A table of a group: the keys are those of the kind that a key selects.
fn of_kinds(group: &str, key: &str) -> Value {
    let kinds = kind_pages().into_iter().filter(|kind| kind.group == group).map(|kind| {
        let mut keys = table(&kind.fields, kind.summary);
        keys["properties"][key] = json!({ "const": kind.keyword, "description": kind.summary });
        keys
    });
    json!({ "type": "object", "required": [key], "oneOf": kinds.collect::<Vec<_>>() })
}

fn table(fields: &[Field], what: &str) -> Value {
    let mut properties: Map<String, Value> = fields.iter().map(|field| (field.name.into(), key(field))).collect();
    properties.extend(fields.iter().filter_map(|field| Some((field.alias()?, key(field)))));
    let plain = fields.iter().filter(|field| field.required && field.alias().is_none());
    let required: Vec<&str> = plain.map(|field| field.name).collect();
    let mut table =
        json!({ "type": "object", "description": what, "additionalProperties": false, "properties": properties });
    if !required.is_empty() {
        table["required"] = json!(required);
    }
    let one_of = |field: &Field| {
        let alias = field.alias().filter(|_| field.required)?;
        Some(json!({ "anyOf": [{ "required": [field.name] }, { "required": [alias] }] }))
    };
    let either: Vec<Value> = fields.iter().filter_map(one_of).collect();
    if !either.is_empty() {
        table["allOf"] = json!(either);
    }
    table
}

fn key(field: &Field) -> Value {
    let mut key = value(&field.kind);
    let example = example(&field.kind);
    key["description"] = format!("{} ({}, {}). Example: {example}", field.doc, value_kind(field), need(field)).into();
    if let Some(default) = field.default {
        key["default"] = default.into();
    }
    key
}

fn value(kind: &Kind) -> Value {
    let text = || json!({ "type": "string", "minLength": 1 });
    let scalar = || json!({ "anyOf": [{ "type": "number" }, { "type": "string", "pattern": NUMBER }] });
    let by_name = |value: Value| json!({ "type": "object", "additionalProperties": value });
    match kind {
        Kind::Shaft | Kind::Mass | Kind::Body | Kind::Element(_) | Kind::Signal | Kind::Output | Kind::Text => text(),
        Kind::Name | Kind::Node => json!({ "type": "string", "pattern": NAME }),
        Kind::Choice(choices) => json!({ "enum": choices }),
        Kind::Quantity(..) | Kind::Mechanical(..) => json!({ "type": "string", "pattern": QUANTITY }),
        Kind::Number(_) | Kind::AnyQuantity | Kind::Coefficient => scalar(),
        Kind::Shafts(count) => {
            let mut list = json!({ "type": "array", "items": text(), "uniqueItems": true, "minItems": count.max(&1) });
            if *count > 0 {
                list["maxItems"] = json!(count);
            }
            list
        }
        Kind::Elements(_) => json!({ "type": "array", "items": text(), "uniqueItems": true, "minItems": 1 }),
        Kind::Signals | Kind::Outputs | Kind::Names => json!({ "type": "array", "items": text(), "uniqueItems": true }),
        Kind::Poles => json!({ "type": "array", "minItems": 1, "items": { "type": ["number", "string"] } }),
        Kind::Coefficients => {
            let mut table = by_name(scalar());
            table["minProperties"] = json!(1);
            table
        }
        Kind::Overrides => by_name(scalar()),
        Kind::Point => json!({ "anyOf": [by_name(scalar()), text()] }),
        Kind::Formula(_) | Kind::OfTime(_) | Kind::Surface | Kind::Expression => {
            json!({ "anyOf": [{ "type": "number" }, text()] })
        }
        Kind::Functions => by_name(text()),
        Kind::Formulas | Kind::Expressions => by_name(json!({ "anyOf": [{ "type": "number" }, text()] })),
        Kind::Lists => by_name(json!({ "anyOf": [scalar(), { "type": "array", "items": scalar() }] })),
        Kind::Tables(fields) => several(table(fields, "")),
        Kind::Table(fields) => table(fields, ""),
    }
}
