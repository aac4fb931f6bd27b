//! `[variants]` and `[[variant]]`.

use std::collections::HashMap;

use super::document::{Document, NamedVariant, Parameter, Setting, VariantSettings, Variants};
use super::keys::expression_diagnostic;
use super::parse::Node;
use super::table_reader::TableReader;
use kardan_math::names::{NamedList, did_you_mean, unknown_name};
use kardan_math::units::{
    Dimension, Exact, Expression, UnitError, format_quantity, parse_quantity, parse_quantity_list, tolerance_mark,
};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::entries::{Entry, KeyedEntry, Place, RawValue};
use kardan_schema::schema::{Placed, Table};

/// Most runs that one study may have.
const MOST_VARIANTS: usize = 1000;

const VARIANTS_HELP: &str = "write a list such as \"[0, 10, 20, 30] deg\" or [\"0 deg\", \"10 deg\"]";

/// A value of a list of variants with its place.
type VariantValue = (Exact, Dimension, String, Place);

/// The values in a list of variants; `None` after a reported error.
fn variant_values(
    (name, entry): (&str, &Entry),
    (document, varied): (&Document, &[&str]),
    out: &mut Vec<Diagnostic>,
) -> Option<Vec<VariantValue>> {
    let before = out.len();
    let mut values = Vec::new();
    let unreadable = |error: UnitError, text: &str, place: &Place| {
        Diagnostic::error(error.code, format!("variants of `{name}`: {}", error.message))
            .at(place.part(text, error.span), "")
            .help(error.help.unwrap_or_else(|| VARIANTS_HELP.to_string()))
    };
    let toleranced = |text: &str, place: &Place| {
        tolerance_mark(text)?;
        Some(
            Diagnostic::error("tolerance::not-allowed", format!("variants of `{name}` cannot have a tolerance"))
                .at(place, "with a tolerance")
                .help("write the tolerance after the value under `[parameters]`; `±` moves with the variants"),
        )
    };
    let read = |entry: &Entry, out: &[Diagnostic]| -> Result<VariantValue, Diagnostic> {
        let place = entry.place.clone();
        let text = match &entry.value {
            RawValue::Text(text) | RawValue::Number(text) => text,
            RawValue::Quantity(value, dimension) => {
                return Ok((value.clone(), *dimension, format_quantity(value, *dimension), place));
            }
            _ => {
                let message = format!("variants of `{name}`: expected a quantity");
                return Err(Diagnostic::error("type::wrong", message).at(place, "not a quantity").help(VARIANTS_HELP));
            }
        };
        if let Some(toleranced) = toleranced(text, &place) {
            return Err(toleranced);
        }
        match parse_quantity(text) {
            Ok((value, dimension)) => Ok((value, dimension, text.trim().to_string(), place)),
            Err(error) => match computed(name, text, (&place, document, varied), out) {
                Some(found) => found.map(|(value, dimension, shown)| (value, dimension, shown, place)),
                None => Err(unreadable(error, text, &place)),
            },
        }
    };
    match &entry.value {
        RawValue::Text(text) if toleranced(text, &entry.place).is_some() => out.extend(toleranced(text, &entry.place)),
        RawValue::Text(text) if text.trim_start().starts_with('[') => match parse_quantity_list(text) {
            Ok(list) => {
                let one = |(value, dimension, text)| (value, dimension, text, entry.place.clone());
                values.extend(list.into_iter().map(one));
            }
            Err(error) => out.push(unreadable(error, text, &entry.place)),
        },
        RawValue::List(list) => {
            for entry in list {
                match read(entry, &out[..]) {
                    Ok(value) => values.push(value),
                    Err(diagnostic) => out.push(diagnostic),
                }
            }
        }
        RawValue::Broken => return None,
        _ => {
            let message = format!("variants of `{name}` must be a list of quantities");
            out.push(Diagnostic::error("type::wrong", message).at(&entry.place, "not a list").help(VARIANTS_HELP));
        }
    }
    if values.is_empty() && out.len() == before {
        let message = format!("the list of variants of `{name}` is empty");
        out.push(Diagnostic::error("list::length", message).at(&entry.place, "no entry").help(VARIANTS_HELP));
    }
    (out.len() == before).then_some(values)
}

/// The value of an entry that is an expression of the values of the file, or its error; `None` if it is not one.
fn computed(
    name: &str,
    text: &str,
    (place, document, varied): (&Place, &Document, &[&str]),
    out: &[Diagnostic],
) -> Option<Result<(Exact, Dimension, String), Diagnostic>> {
    // A single word is an invalid quantity.
    let declared = |name: &str| document.parameter(name).is_some();
    let expression =
        Expression::parse(text).ok().filter(|read| read.names() != [text.trim()] || declared(text.trim()))?;
    let what = format!("variants of `{name}`");
    let all = document.in_order();
    // A value that differs between the variants is not a value of the file.
    let mut moving: Vec<&str> = varied.iter().copied().filter(|other| *other != name).collect();
    for declared in &all {
        let follows = |one: &Expression| one.names().iter().any(|name| moving.contains(name));
        if declared.expression.as_ref().is_some_and(follows) {
            moving.push(&declared.name);
        }
    }
    if let Some(other) = expression.names().into_iter().find(|name| moving.contains(name)) {
        let message = format!("{what}: `{other}` differs between the variants too");
        return Some(Err(Diagnostic::error("parameter::set-by-variant", message)
            .at(place, "not one value")
            .help("write the values, or declare a parameter that follows from both and vary what it follows from")));
    }
    if expression.names().iter().any(|name| document.suppressed.has_key(name)) {
        return None;
    }
    let lookup = |name: &str| {
        let found = document.parameter(name)?;
        Some((found.value.clone(), found.dimension))
    };
    Some(match expression.evaluate(&lookup) {
        Ok(found) => {
            let declared = document.parameters.get(name);
            let dimension =
                declared.map(|declared| declared.dimension).filter(|expected| expected.is_like(&found.dimension));
            let dimension = dimension.unwrap_or(found.dimension);
            let shown = format!("{} {}", found.value.to_f64(), dimension.si()).trim().to_string();
            Ok((found.value, dimension, shown))
        }
        Err(error) => Err(expression_diagnostic(document, &what, error, &expression, (place, out))),
    })
}

pub(super) fn read_named_variants(tables: &[Table], document: &mut Document, out: &mut Vec<Diagnostic>) {
    let before = out.len();
    let reader = TableReader::new(document, &[]);
    let (mut read, mut first_places) = (NamedList::<NamedVariant>::default(), HashMap::new());
    for table in tables {
        let Some((name, place)) = table.placed_word("name") else { continue };
        let what = format!("variant `{name}`");
        let first = first_places.entry(name.to_ascii_lowercase()).or_insert(place);
        if *first != place {
            let message = format!("there are two variants named `{name}`");
            let diagnostic = Diagnostic::duplicate("name::duplicate", message, place, *first);
            out.push(diagnostic.help("give each variant a name of its own; it becomes a file name"));
            continue;
        }
        let settings = reader.settings(table, "set", &what, out);
        let name = Placed { value: name.to_string(), place: place.clone() };
        let controls = table.names("controls").map(<[_]>::to_vec);
        let faults = table.names("faults").unwrap_or_default().to_vec();
        read.push(NamedVariant { name, settings, controls, faults });
    }
    document.named_variants = read;
    if document.named_variants.len() > MOST_VARIANTS {
        let message = format!("{} variants are more than one study may have ({MOST_VARIANTS})", tables.len());
        out.push(
            Diagnostic::error("list::length", message)
                .at(&document.named_variants[MOST_VARIANTS].name.place, "one too many")
                .help("split the study into several files"),
        );
        document.named_variants = NamedList::default();
    }
    document.suppressed.variants |= out.len() > before || tables.len() > document.named_variants.len();
}

pub(super) fn read_variants(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    let before = out.len();
    let Some(node) = root.child("variants", out) else {
        document.suppressed.variants |= out.len() > before;
        return;
    };
    let mut count = document.named_variants.len().max(1);
    let varied: Vec<&str> = node.table.iter().map(|found| found.key.as_str()).collect();
    for found in node.table.iter() {
        check_varied(found, document, out);
        let name = found.key.as_str();
        let Some(values) = variant_values((name, &found.entry), (document, &varied), out) else { continue };
        count = count.saturating_mul(values.len());
        let declared = document.parameters.get(name);
        let dimension = declared.map_or(values[0].1, |declared| declared.dimension);
        let wrong = out.len();
        let values = distinct(name, values, (dimension, declared), out);
        if declared.is_some() && out.len() == wrong {
            let parameter = Placed { value: name.to_string(), place: found.place.clone() };
            document.variants.push(Variants { parameter, values, dimension });
        }
    }
    if count > MOST_VARIANTS {
        out.push(
            Diagnostic::error(
                "list::length",
                format!("{count} variants are more than one study may have ({MOST_VARIANTS})"),
            )
            .at(&node.name_place, "all combinations are run")
            .help("vary fewer values at a time"),
        );
        document.variants = NamedList::default();
    }
    document.suppressed.variants |= out.len() > before;
}

/// A varied parameter must be declared, and must not be set by a named variant too.
fn check_varied(found: &KeyedEntry, document: &Document, out: &mut Vec<Diagnostic>) {
    let (name, place) = (found.key.as_str(), &found.place);
    if let Some(other) = document.named_variants.iter().find(|v| v.settings.iter().any(|s| s.name == name)) {
        let message = format!("`{name}` is varied here and set by the variant `{}`", other.name.value);
        out.push(
            Diagnostic::error("name::duplicate", message)
                .at(place, "varied here")
                .at(&other.name.place, "set in this variant")
                .help("vary it here, or set it in each `[[variant]]`"),
        );
    }
    if document.parameters.has(name) || document.suppressed.has(name) {
        return;
    }
    let names = document.parameters.iter().map(|p| p.name.as_str());
    let help = did_you_mean(nearest(name, names.clone()), || match document.parameters[..] {
        [] => format!("declare it first: `[parameters]` with `{name} = ...`"),
        _ => format!("there are {}; declare it under `[parameters]`", quoted(names)),
    });
    let message = format!("there is no parameter `{}` to vary", shortened(name));
    out.push(Diagnostic::error("name::unknown", message).at(place, "not declared").help(help));
}

/// The values of one dimension, each once.
fn distinct(
    name: &str,
    values: Vec<VariantValue>,
    (dimension, declared): (Dimension, Option<&Parameter>),
    out: &mut Vec<Diagnostic>,
) -> Vec<(Exact, String)> {
    let mut good: Vec<(Exact, String)> = Vec::new();
    let before = out.len();
    for (value, found, text, place) in values {
        if found != dimension {
            let (expected, noun) = (dimension.noun(), found.noun());
            let message = match declared {
                Some(_) => format!("variants of `{name}`: expected {expected} as under `[parameters]`, found {noun}"),
                None => format!("variants of `{name}`: the first is {expected}, this one {noun}"),
            };
            let diagnostic = Diagnostic::error("unit::dimension", message)
                .at(place, noun)
                .at_optional(declared.map(|declared| &declared.place), expected)
                .help(dimension.hint(&text));
            // One wrong unit for a whole list is one error.
            if out[before..].iter().all(|d| d.labels[0].place != diagnostic.labels[0].place) {
                out.push(diagnostic);
            }
        } else if good.iter().any(|(candidate, _)| *candidate == value) {
            let message = format!("variants of `{name}`: the value {} is listed twice", shortened(&text));
            out.push(
                Diagnostic::error("name::duplicate", message).at(place, "listed twice").help("remove one of the two"),
            );
        } else {
            good.push((value, text));
        }
    }
    good
}

/// The controllers that variants name must exist, and each controller must be in some variant.
pub(super) fn check_named_controls(document: &Document, out: &mut Vec<Diagnostic>) {
    let variants = &document.named_variants;
    let used = |name: &String| {
        variants
            .iter()
            .any(|v| v.controls.as_ref().is_none_or(|names| names.iter().any(|candidate| candidate.value == *name)))
    };
    for control in document.controls.iter().filter(|control| !variants.is_empty() && !used(&control.name)) {
        out.push(
            Diagnostic::warning("control::unused", format!("no variant uses the controller `{}`", control.name))
                .at(&control.place, "in no loop, hence not checked")
                .help("name it in `controls` of a `[[variant]]`, or remove it"),
        );
    }
    for variant in &document.named_variants {
        for word in variant.controls.iter().flatten() {
            let names = || document.controls.iter().map(|control| control.name.as_str());
            if names().any(|name| name == word.value)
                || document.suppressed.references
                || document.suppressed.has(&word.value)
            {
                continue;
            }
            let help = match &document.controls[..] {
                [] => "the model has no `[control.NAME]`".to_string(),
                controls => unknown_name(&word.value, controls.iter().map(|control| control.name.as_str())),
            };
            let what = format!("variant `{}`", variant.name.value);
            out.push(Diagnostic::no_such(&what, "controller", &word.value, &word.place).help(help));
        }
    }
}

/// Reports missing faults that a variant names.
pub(super) fn check_named_faults(document: &Document, out: &mut Vec<Diagnostic>) {
    for variant in &document.named_variants {
        for word in variant.faults.iter().filter(|word| !document.suppressed.all && !document.has_fault(&word.value)) {
            let what = format!("variant `{}`", variant.name.value);
            out.push(no_such_fault(document, word, &what));
        }
    }
}

/// The error for a missing fault, with the existing ones.
pub fn no_such_fault(document: &Document, Placed { value: name, place }: &Placed<String>, what: &str) -> Diagnostic {
    let names = || document.faults.iter().map(|(name, _)| name.value.as_str());
    let help = match names().next() {
        Some(_) => unknown_name(name, names()),
        None => format!("write it: `[fault.{}]`", shortened(name)),
    };
    Diagnostic::no_such(what, "fault", name, place).help(help)
}

impl Document {
    /// Whether there is a fault of that name.
    pub fn has_fault(&self, name: &str) -> bool {
        self.faults.has(name)
    }

    /// One list of settings per variant with its name: those of `[[variant]]`, each with all combinations of `[variants]`, the last
    /// parameter fastest.
    pub fn variant_settings(&self) -> Vec<VariantSettings> {
        let named = |v: &NamedVariant| VariantSettings {
            name: v.name.value.clone(),
            settings: v.settings.clone(),
            controls: v.controls.as_ref().map(|names| names.iter().map(|name| name.value.clone()).collect()),
            faults: v.faults.iter().map(|name| name.value.clone()).collect(),
        };
        let mut out: Vec<VariantSettings> = self.named_variants.iter().map(named).collect();
        if out.is_empty() {
            out.push(VariantSettings::default());
        }
        for variants in &self.variants {
            let name = &variants.parameter.value;
            out = out
                .into_iter()
                .flat_map(|one| {
                    variants.values.iter().map(move |(value, text)| {
                        let part = format!("{name}-{}", file_name(text));
                        let setting = Setting { name: name.clone(), value: value.clone(), text: text.clone() };
                        VariantSettings {
                            name: if one.name.is_empty() { part } else { format!("{}_{part}", one.name) },
                            settings: [one.settings.clone(), vec![setting]].concat(),
                            controls: one.controls.clone(),
                            faults: one.faults.clone(),
                        }
                    })
                })
                .collect();
        }
        out
    }
}

/// A quantity as part of a file name: `10 deg` becomes `10deg`.
fn file_name(text: &str) -> String {
    text.chars()
        .filter(|c| !c.is_whitespace())
        .map(|c| match c {
            c if c.is_alphanumeric() || matches!(c, '.' | '-' | '+') => c,
            '/' => 'p',
            _ => '_',
        })
        .collect()
}
