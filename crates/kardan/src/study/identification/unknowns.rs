//! Parameters to identify, and the model with a term for each.

use super::extra::{ExtraTerm, Law, kind_of_parameter};
use kardan_identify::Coefficient;
use kardan_math::names::unknown_name;
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::assemble::{CoefficientKind as Kind, Equations};
use kardan_model::{Document, Instance, Setting, TableReader};
use kardan_results::signal_name;
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::schema::{Placed, Scalar, Value};

const KINDS: [Kind; 4] = [Kind::Inertia, Kind::Damping, Kind::Stiffness, Kind::Friction];

fn dimension(kind: Kind, translational: bool) -> Dimension {
    let dimension = match kind {
        Kind::Inertia => Dimension::INERTIA,
        Kind::Damping => Dimension::DAMPING,
        Kind::Stiffness => Dimension::STIFFNESS,
        Kind::Friction => Dimension::TORQUE,
    };
    if translational { dimension.translational() } else { dimension }
}

/// The key of an element that gives a coefficient.
fn key(instance: &Instance, kind: Kind) -> &'static str {
    if instance.kind.keyword == "mass" && kind == Kind::Inertia { "mass" } else { kind.key() }
}

/// The name of a coefficient of an element: `rotor.mass`.
pub(super) fn parameter_name(document: &Document, element: &str, kind: Kind) -> String {
    let own = document.elements.get(element);
    format!("{element}.{}", own.map_or(kind.key(), |instance| key(instance, kind)))
}

/// A requested parameter: a key of an element, or an entry of `[parameters]` for several keys.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct UnknownParameter {
    pub name: String,
    pub keys: Vec<(String, Kind)>,
    /// The value of the file, if any.
    pub before: Option<f64>,
    /// The entry of `[parameters]`, if it is one.
    pub parameter: bool,
}

/// Element and kind of `fs.damping`.
fn split<'a>(document: &Document, name: &'a str) -> Option<(&'a str, Kind)> {
    let (element, word) = signal_name::parameter(name)?;
    let own = document.elements.get(element)?;
    KINDS.into_iter().find(|kind| key(own, *kind) == word).map(|kind| (element, kind))
}

/// The keys of a model that can be requested.
pub(super) fn possible(document: &Document) -> Vec<String> {
    // The keys of a compliant gear are not the coefficients themselves.
    let plain =
        document.elements.iter().filter(|instance| matches!(instance.kind.keyword, "shaft" | "mass" | "spring_damper"));
    let keys = plain.flat_map(|instance| {
        let has = |kind: &Kind| instance.kind.fields.iter().any(|field| field.name == key(instance, *kind));
        KINDS.into_iter().filter(has).map(|kind| format!("{}.{}", instance.name, key(instance, kind)))
    });
    keys.collect()
}

/// The keys of elements that are a parameter's.
fn users(document: &Document, parameter: &str) -> Vec<(String, Kind)> {
    let mut out = Vec::new();
    for instance in &document.elements {
        for kind in KINDS {
            if let Some(Placed { value: Value::Scalar(Scalar::Parameter(name)), .. }) =
                instance.table.values.get(key(instance, kind))
                && name == parameter
            {
                out.push((instance.name.clone(), kind));
            }
        }
    }
    out
}

/// The value that the file gives a key.
fn model_value(document: &Document, settings: &[Setting], element: &str, kind: Kind) -> Option<f64> {
    let instance = document.elements.get(element)?;
    let scalar = instance.table.values.get(key(instance, kind))?.scalar()?;
    let mut silent = Vec::new();
    let read = TableReader::new(document, settings).scalar(&scalar, None, "", &mut silent);
    read.map(|(value, _)| value.to_f64())
}

/// A parameter by its name, checked.
pub(super) fn unknown_parameter(
    document: &Document,
    settings: &[Setting],
    name: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<UnknownParameter> {
    let all = possible(document);
    if let Some((element, kind)) = split(document, name)
        && all.iter().any(|declared| declared == name)
    {
        let before = model_value(document, settings, element, kind);
        return Some(UnknownParameter {
            name: name.into(),
            keys: vec![(element.into(), kind)],
            before,
            parameter: false,
        });
    }
    if let Some(parameter) = document.parameters.get(name) {
        let keys = users(document, name);
        let one_kind = keys.first().is_some_and(|(_, kind)| keys.iter().all(|(_, candidate)| candidate == kind));
        if one_kind {
            let set = settings.iter().find(|set| set.name == name).map_or(&parameter.value, |set| &set.value);
            return Some(UnknownParameter { name: name.into(), keys, before: Some(set.to_f64()), parameter: true });
        }
        let message = format!("the parameter `{name}` is not a single coefficient of the torque balance");
        out.push(Diagnostic::error("identify::parameter", message).help(
            "only inertias, dampings, stiffnesses and Coulomb frictions enter it linearly; ratios and angles do not",
        ));
        return None;
    }
    let declared = signal_name::parameter(name).and_then(|(element, key)| {
        let (kind, of) = kind_of_parameter(key)?;
        Some(format!(
            "declare the term: `[[identification.extra]]` with `kind = \"{kind}\"` and `{of} = \"{element}\"`"
        ))
    });
    let names = all.iter().map(String::as_str).chain(document.parameters.iter().map(|p| p.name.as_str()));
    let help = declared.unwrap_or_else(|| unknown_name(name, names));
    let message = format!("the model has no parameter `{}` to identify", shortened(name));
    out.push(Diagnostic::error("name::unknown", message).help(help));
    None
}

/// A copy of the document with a term for each requested key, where the file has none or zero.
pub(super) fn with_terms(
    document: &Document,
    settings: &[Setting],
    unknowns: &[UnknownParameter],
    extras: &[ExtraTerm],
) -> (Document, Vec<Setting>) {
    let (mut out, mut set) = (document.clone(), settings.to_vec());
    let keys = unknowns.iter().flat_map(|one| one.keys.iter().map(|(element, kind)| (element.clone(), *kind)));
    let directions = extras.iter().filter_map(|extra| match extra.law {
        Law::Offset | Law::Parameter { .. } | Law::Teeth { .. } => None,
        Law::Backlash { .. } => Some((extra.element.clone(), Kind::Stiffness)),
        _ => Some((extra.element.clone(), Kind::Friction)),
    });
    let tiny = Exact::from_ratio(1, 1_000_000_000);
    // A spring whose backlash is a separate term has no backlash itself.
    for extra in extras.iter().filter(|extra| matches!(extra.law, Law::Backlash { .. })) {
        out.elements.get_mut(&extra.element).map(|instance| instance.table.values.remove("backlash"));
    }
    for (element, kind) in keys.chain(directions) {
        let before = model_value(document, settings, &element, kind);
        if before.is_some_and(|value| value != 0.0) {
            continue;
        }
        let Some(instance) = out.elements.get_mut(&element) else { continue };
        let key = key(instance, kind);
        let Some(field) = instance.kind.fields.iter().find(|field| field.name == key) else { continue };
        let literal = Value::Scalar(Scalar::Literal(tiny.clone(), dimension(kind, instance.table.translational)));
        match instance.table.values.get_mut(key) {
            // An implicit parameter, or one of the file, that is zero.
            Some(Placed { value: Value::Scalar(Scalar::Parameter(name)), .. }) => {
                set.retain(|setting| setting.name != *name);
                set.push(Setting { name: name.clone(), value: tiny.clone(), text: String::new() });
            }
            Some(spanned) => spanned.value = literal,
            None => {
                let place = instance.place.clone();
                instance.table.values.insert(field.name, Placed { value: literal, place });
            }
        }
    }
    for extra in extras.iter().filter(|extra| matches!(extra.law, Law::Teeth { .. })) {
        let Some(instance) = out.elements.get_mut(&extra.element) else { continue };
        let place = instance.place.clone();
        // A tiny friction provides the direction.
        let value = Value::Scalar(Scalar::Literal(Exact::one().plus(&-&tiny), Dimension::NONE));
        instance.table.values.entry("efficiency").or_insert(Placed { value, place });
    }
    (out, set)
}

/// The coefficients of the equations that parameters are.
pub(super) fn coefficients(equations: &Equations, unknowns: &[UnknownParameter]) -> Vec<Coefficient> {
    let all = equations.coefficients();
    unknowns
        .iter()
        .map(|one| {
            let own = all.iter().filter(|term| {
                one.keys
                    .iter()
                    .any(|(element, kind)| term.kind == *kind && term.name == format!("{element}.{}", kind.key()))
            });
            let own: Vec<_> = own.collect();
            Coefficient {
                name: one.name.clone(),
                kind: one.keys[0].1,
                terms: own.iter().map(|term| term.term).collect(),
                value: own.first().map_or(0.0, |term| term.value),
            }
        })
        .collect()
}
