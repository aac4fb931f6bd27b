//! The parts of a model with their ends, from the keys that each kind of element declares.

use super::document::Instance;
use kardan_mechanics::equations::{GROUND, Measured, Term, UnilateralConstraint};
use kardan_results::{JoinKind, MechanismPart, Symbol, Terminal};
use kardan_schema::schema::{Field, Kind, Values};

/// An element with its ends; `values` is the line that describes it.
pub(super) fn part(instance: &Instance, values: &Values, terms: &[Term], described: &str) -> MechanismPart {
    let kind = instance.kind;
    let mut laws: Vec<String> = Vec::new();
    let backlash = kind.symbol != Symbol::Stop && terms.iter().any(is_side);
    for law in terms.iter().flat_map(laws_of).chain(backlash.then_some("backlash")) {
        let law = if values.translational { translational(law) } else { law };
        if !laws.iter().any(|listed| listed == law) {
            laws.push(law.into());
        }
    }
    MechanismPart {
        kind: kind.keyword.into(),
        name: instance.name.clone(),
        symbol: kind.symbol,
        values: described.into(),
        laws,
        ratio: values.number("ratio"),
        terminals: terminals(instance, values, terms),
    }
}

/// The ends of an element: those that its keys declare, and the coordinates of a relation in an expression.
fn terminals(instance: &Instance, values: &Values, terms: &[Term]) -> Vec<Terminal> {
    let kind = instance.kind;
    let mut out: Vec<Terminal> = kind.fields.iter().flat_map(|field| ends(field, values, kind.symbol)).collect();
    if kind.symbol == Symbol::Relation {
        let row_laws = terms
            .iter()
            .filter_map(|term| if let Term::MultiplierLaw(row) = term { Some(row.coordinates()) } else { None });
        for name in row_laws.flatten() {
            if out.iter().all(|end| end.name != name) {
                let key = "expression".to_string();
                out.push(Terminal { key, kind: JoinKind::Shaft, name: name.into(), coefficient: None });
            }
        }
    }
    out
}

/// The ends that a key declares. An omitted optional shaft is the housing, except for a sensor, and for a planetary gear that is
/// given by coefficients.
fn ends(field: &Field, values: &Values, symbol: Symbol) -> Vec<Terminal> {
    let key = field.alias().filter(|_| values.translational).unwrap_or_else(|| field.name.into());
    let end = |kind, name: &str| vec![Terminal { key: key.clone(), kind, name: name.into(), coefficient: None }];
    match (field.kind, values.word(field.name)) {
        (Kind::Shaft | Kind::Mass | Kind::Body, Some(GROUND)) => end(JoinKind::Housing, ""),
        (Kind::Shaft | Kind::Mass | Kind::Body, Some(name)) => end(JoinKind::Shaft, name),
        (Kind::Shaft | Kind::Body, None)
            if !field.required && !matches!(symbol, Symbol::Sensor | Symbol::PlanetaryGear) =>
        {
            end(JoinKind::Housing, "")
        }
        (Kind::Node, Some(GROUND)) => end(JoinKind::Ground, GROUND),
        (Kind::Node, Some(name)) => end(JoinKind::Node, name),
        (Kind::Element(_), Some(name)) => end(JoinKind::Element, name),
        (Kind::Coefficients, _) => {
            let shaft = |(name, x): &(String, kardan_math::units::Exact)| Terminal {
                key: field.name.into(),
                kind: JoinKind::Shaft,
                name: name.clone(),
                coefficient: Some(x.to_f64()),
            };
            values.map(field.name).unwrap_or_default().iter().map(shaft).collect()
        }
        _ => Vec::new(),
    }
}

/// Whether it is one side of a travel with backlash between the sides.
fn is_side(term: &Term) -> bool {
    matches!(
        term,
        Term::UnilateralConstraint {
            unilateral: UnilateralConstraint::Stop { .. } | UnilateralConstraint::Cushion { .. },
            ..
        }
    )
}

/// The noun for a measurement of a mass.
fn translational(law: &'static str) -> &'static str {
    match law {
        "angle" => "position",
        "speed" => "velocity",
        "torque" => "force",
        "net_torque" => "net_force",
        other => other,
    }
}

/// The effect of a term, in the words of its keys.
fn laws_of(term: &Term) -> Vec<&'static str> {
    match term {
        Term::Inertia { .. } => vec!["inertia"],
        Term::Spring { .. } => vec!["stiffness"],
        Term::Damper { .. } => vec!["damping"],
        Term::Friction { .. } => vec!["friction"],
        Term::Compliance { damping, .. } if damping.is_zero() => vec!["stiffness"],
        Term::Compliance { .. } => vec!["stiffness", "damping"],
        Term::Output(sensor) => vec![match &sensor.measured {
            Measured::NetTorque(_) => "net_torque",
            Measured::Angle(_) => "angle",
            Measured::Speed(_) => "speed",
            _ => "torque",
        }],
        Term::Torque { .. } => vec!["torque"],
        Term::UnilateralConstraint { .. }
        | Term::Constraint { .. }
        | Term::Transmission { .. }
        | Term::Input { .. }
        | Term::Coordinate { .. }
        | Term::Measure(_)
        | Term::Moving(_)
        | Term::MultiplierLaw(_)
        | Term::Balance { .. } => Vec::new(),
    }
}
