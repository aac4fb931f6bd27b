//! The element `torque`: a torque or force from an expression.

use super::shared::straight::check_reaction;
use super::{Element, KeyError};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Domain, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Values, keys};

keys! {
    /// A torque or a force that an expression gives.
    element Torque("torque") {
        required {
            law: Formula(Dimension::TORQUE),
                "The torque, an expression of angles and speeds (`arm.phi`, `arm.w`; of masses `car.s`, `car.v`), the time `t`, parameters, \
                 signals `[signal.NAME]` and tables `[table.NAME]`.";
        }
        optional {
            shaft: Body, "The shaft that the torque acts on, or the mass that the force acts on; left out: `coefficients`.";
            reaction: Body, "The shaft or mass that takes the opposite torque; left out: the housing.";
            coefficients: Coefficients,
                "In place of `shaft`: its direction, coefficients by shaft and mass; on each of them acts its coefficient times the torque.";
        }
    }
}

pub(super) const TORQUE: Element = Element {
    keyword: Torque::KEYWORD,
    summary: "A torque or a force as an expression of angles, speeds, time, parameters, signals and tables: gravity, drag, loads, engine maps.",
    sketch: r"
    tau = law(phi, w, t)  -->  shaft  (opposite on reaction)",
    signs: "`<name>.tau` (on a mass the force `<name>.f`) is the torque on the shaft: positive turns it forward; the opposite acts on `reaction`.",
    symbol: Symbol::Torque,
    fields: Torque::FIELDS,
    example: "\
[torque.gravity]
shaft = \"arm\"
law = \"-2 kg * 9.81 m/s^2 * 0.3 m * sin(arm.phi)\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let (shaft, coefficients) = (values.has("shaft"), values.has("coefficients"));
    if shaft && coefficients {
        return vec![KeyError::new(
            "coefficients",
            "`shaft` and `coefficients` both define where it acts",
            "remove one of the two",
        )];
    }
    if !shaft && !coefficients {
        return vec![KeyError::new(
            "law",
            "no key defines where the torque acts",
            "add `shaft = \"...\"`, or `coefficients = { ... }`",
        )];
    }
    if coefficients && values.has("reaction") {
        return vec![KeyError::new(
            "reaction",
            "`coefficients` define completely where it acts",
            "put the reaction into them: `{ arm = 1, base = -1 }`",
        )];
    }
    if coefficients && values.map("coefficients").is_some_and(|map| map.iter().all(|(_, x)| x.is_zero())) {
        return vec![KeyError::new(
            "coefficients",
            "all coefficients are zero, so it acts on nothing",
            "give at least one that is not zero",
        )];
    }
    check_reaction(values).into_iter().collect()
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let Some(law) = values.formula("law") else { return Vec::new() };
    let direction = match values.map("coefficients") {
        Some(map) => Direction { entries: map.to_vec() },
        None => Direction::difference(values.word_or_default("shaft"), values.word("reaction")),
    };
    let measure = values.measure("coefficients").filter(|domain| *domain == Domain::Translation).map(Term::Measure);
    measure.into_iter().chain([Term::Torque { direction, law: law.clone() }]).collect()
}
