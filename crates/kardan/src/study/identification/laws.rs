//! Parameters of torques given by expressions.

use super::channels::{Harmonic, Quantity};
use super::extra::{ExtraTerm, Law, law_parameters};
use kardan_identify::OpenLaws;
use kardan_math::units::{Exact, Expression};
use kardan_mechanics::assemble::{Equations, assemble};
use kardan_mechanics::equations::{Formula, Meaning, Term};
use kardan_mechanics::reduce::{LawTorques, NotLinear, Reduced, Wave, law_waves};
use kardan_model::{Document, Model, Setting};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_schema::schema::{Scalar, Table, Value};

/// Removes from the names the parameters that occur in laws of torques, and turns them into terms.
pub(super) fn law_terms(
    document: &Document,
    model: &Model,
    settings: &[Setting],
    names: &mut Vec<String>,
    out: &mut Vec<Diagnostic>,
) -> Vec<ExtraTerm> {
    let mut terms: Vec<ExtraTerm> = Vec::new();
    names.retain(|name| {
        let Some(parameter) = document.parameters.get(name) else { return true };
        let mut laws = model.terms.iter().filter_map(|named| match &named.term {
            Term::Torque { law, .. } if constant(law, name).is_some() => Some((&named.element, law)),
            _ => None,
        });
        let Some((element, first)) = laws.next() else { return true };
        let over_angle = |law: &Formula| law.names.iter().any(|(_, meaning)| matches!(meaning, Meaning::Position(_)));
        let set = settings.iter().find(|set| set.name == *name).map_or(&parameter.value, |set| &set.value);
        let law = Law::Parameter {
            unit: parameter.dimension.si(),
            before: set.to_f64(),
            over_angle: over_angle(first) || laws.any(|(_, law)| over_angle(law)),
        };
        let further_uses = further_uses_of(document, name);
        if further_uses.is_empty() {
            if terms.iter().all(|candidate| candidate.name != *name) {
                let (element, remark) = (element.clone(), String::new());
                terms.push(ExtraTerm { name: name.clone(), term: name.clone(), element, law, remark });
            }
            return false;
        }
        let message = format!("the parameter `{name}` occurs in the law of `{element}` and also in {}", quoted(further_uses.iter().map(String::as_str)));
        out.push(Diagnostic::error("identify::parameter", message).help(
            "an identified parameter of a law may occur in laws of torques only: give the law its own parameter, or remove this one from \
             `parameters`",
        ));
        false
    });
    terms
}

/// The value of a parameter in a formula, if it occurs there.
fn constant<'a>(formula: &'a Formula, name: &str) -> Option<&'a Exact> {
    formula.names.iter().find_map(|(candidate, meaning)| match meaning {
        Meaning::Constant(value, _) if candidate == name => Some(value),
        _ => None,
    })
}

/// Where a parameter occurs besides laws of torques.
fn further_uses_of(document: &Document, name: &str) -> Vec<String> {
    let in_expression = |expression: &Expression| expression.names().contains(&name);
    let in_scalar = |scalar: &Scalar| match scalar {
        Scalar::Parameter(other) => other == name,
        Scalar::Expression(expression) => in_expression(expression),
        _ => false,
    };
    let in_value = |value: &Value| match value {
        Value::Scalar(scalar) => in_scalar(scalar),
        Value::Map(entries) => entries.iter().any(|(_, scalar)| in_scalar(&scalar.value)),
        _ => false,
    };
    let uses = |owner: &str, table: &Table| -> Vec<String> {
        let used = table.values.iter().filter(|(_, entry)| in_value(&entry.value));
        used.map(|(key, _)| format!("{owner}.{key}")).collect()
    };
    let mut out: Vec<String> = Vec::new();
    for instance in &document.elements {
        let law = |found: &String| instance.kind.keyword == "torque" && found.ends_with(".law");
        out.extend(uses(&instance.name, &instance.table).into_iter().filter(|found| !law(found)));
    }
    for signal in &document.signals {
        out.extend(uses(&signal.name, &signal.table));
    }
    for (own, table) in &document.tables {
        out.extend(uses(own, table));
    }
    let parameters = document.parameters.iter().filter(|one| one.expression.as_ref().is_some_and(in_expression));
    out.extend(parameters.map(|one| one.name.clone()));
    out
}

/// The harmonics of measured angles on which laws depend, besides the measured quantities.
pub(super) fn with_harmonics_of_laws(slots: Vec<Quantity>, model: &Model) -> Vec<Quantity> {
    let mut out = slots;
    let equations = assemble(&model.all_coordinates, &model.terms);
    for wave in law_waves(&equations) {
        let shaft = equations.coordinates[wave.shaft].clone();
        let slot = Quantity::Harmonic(Harmonic { shaft: shaft.clone(), order: wave.order, sine: wave.sine });
        if out.iter().any(|slot| slot.is_angle_of(&shaft)) && !out.contains(&slot) {
            out.push(slot);
        }
    }
    out
}

/// The torques of the laws with these terms open, their values in the file, and the numbers of the harmonics that they use.
pub(super) fn law_torques(
    reduced: &Reduced,
    extras: &[ExtraTerm],
    harmonics: &[(Harmonic, usize)],
) -> Result<OpenLaws, Vec<Diagnostic>> {
    let (mut waves, mut numbers) = (Vec::new(), Vec::new());
    for (number, (harmonic, _)) in harmonics.iter().enumerate().filter(|_| !reduced.equations.laws.is_empty()) {
        let shaft = reduced.coordinate(&harmonic.shaft).expect("a harmonic is one of a shaft");
        waves.push(Wave { shaft, order: harmonic.order, sine: harmonic.sine });
        numbers.push(number);
    }
    let formulas: Vec<&Formula> = reduced.equations.laws.iter().map(|law| law.value.as_ref()).collect();
    let names = law_parameters(extras);
    let values = extras.iter().filter_map(|extra| match extra.law {
        Law::Parameter { before, .. } => Some(before),
        _ => None,
    });
    let torques =
        LawTorques::new(reduced, &formulas, &names, &waves).map_err(|wrong| vec![not_linear(reduced, &wrong)])?;
    Ok(OpenLaws { torques, values: values.collect(), harmonics: numbers })
}

fn not_linear(reduced: &Reduced, wrong: &NotLinear) -> Diagnostic {
    let NotLinear { parameter, formula, kink } = wrong;
    let law = &reduced.equations.laws[*formula];
    let text = law.value.expression.text();
    let why = match kink {
        true => "the place of its kink or jump depends on it",
        false => "its derivative with respect to it depends on unknown parameters",
    };
    let message = format!("the law of `{}` is not linear in `{parameter}`: {why}: `{text}`", law.element);
    Diagnostic::error("identify::not-linear", message).help(format!(
        "give the term its own factor, as in `-k * sin(arm.phi)`, and identify that; or remove `{parameter}` from `parameters`: kardan takes \
         other parameters as known"
    ))
}

/// Sets a parameter of laws to zero.
pub(super) fn silence_law(equations: &mut Equations, name: &str) {
    for law in &mut equations.laws {
        if constant(&law.value, name).is_some() {
            let mut formula = law.value.as_ref().clone();
            for (other, meaning) in &mut formula.names {
                if let (true, Meaning::Constant(value, _)) = (other == name, meaning) {
                    *value = Exact::zero();
                }
            }
            law.value = std::sync::Arc::new(formula);
        }
    }
}
