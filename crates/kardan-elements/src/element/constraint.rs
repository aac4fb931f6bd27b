//! The element `constraint`: an explicit linear constraint.

use std::sync::Arc;

use super::shared::prescribed::right_side;
use super::{Element, KeyError};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Domain, MultiplierLaw, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Values, keys};

keys! {
    /// Any linear row by hand, \[diss. (4.31)\] with an offset.
    element Constraint("constraint") {
        optional {
            coefficients: Coefficients,
                "Coefficients by shaft; { shaft = 1 } fixes one shaft. With masses, or with lengths as coefficients of shafts, the sum is a length: \
                 { rack = 1, pinion = \"-7 mm\" }.";
            offset: OfTime(Dimension::ANGLE),
                "The right-hand side, an angle or a length, or a smooth function of the time `t`, parameters, signals `[signal.NAME]` and \
                 tables: its value and its rate must not jump; left out: zero.";
            expression: Surface,
                "In place of `coefficients`: an expression of angles and positions (`crank.phi`, `car.s`) that is always zero, in any unit: \
                 `\"x.s^2 + y.s^2 - l^2\"`; smooth.";
            rates: Formulas,
                "In place of `coefficients`: coefficients of speeds by shaft and mass, expressions of angles and positions, whose sum is zero: `{ x \
                 = \"-sin(heading.phi)\", y = \"cos(heading.phi)\" }` is a wheel that rolls along its heading without lateral slip.";
        }
    }
}

pub(super) const CONSTRAINT: Element = Element {
    keyword: Constraint::KEYWORD,
    summary: "Any relation between angles and positions: sum of coefficient times angle = offset, an expression that is zero, or a relation of \
              speeds.",
    sketch: r"
    a1 q1 + a2 q2 + ... = offset(t)
    expression(q) = 0
    a1(q) q1' + a2(q) q2' + ... = 0",
    signs: "`<name>.tau` is the multiplier of the row as written: the torque on shaft k is a_k times it. Where the sum is a length it is the force `<name>.f`; of a \
            relation in another unit `<name>.lambda`, in that of energy over it: N/m where it is an area. Where the offset \
            moves, the multiplier times the rate of the offset is the power that the constraint gives.",
    symbol: Symbol::Relation,
    fields: Constraint::FIELDS,
    example: "\
[constraint.belt]
coefficients = { pulley_1 = 2, pulley_2 = -3 }
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let present: Vec<&'static str> =
        ["coefficients", "expression", "rates"].into_iter().filter(|key| values.has(key)).collect();
    match present[..] {
        [] => {
            let help = "add `coefficients = { ... }`, or an `expression` that is zero, or `rates`";
            return vec![KeyError::new("coefficients", "no key defines what is constrained", help)];
        }
        [_] => {}
        [_, second, ..] => {
            let message = format!("{} are different constraints", present.join(" and "));
            return vec![KeyError::new(second, message, "give each a `[constraint.NAME]` of its own")];
        }
    }
    if present != ["coefficients"] && values.has("offset") {
        let help = "remove it; write an offset into the expression itself";
        return vec![KeyError::new("offset", "it belongs to `coefficients`", help)];
    }
    if values.formulas("rates").is_some_and(|row| row.is_empty()) {
        let help = "give the coefficient of at least one speed, as in { x = 1, roll = \"-r\" }";
        return vec![KeyError::new("rates", "there are no coefficients, so nothing is constrained", help)];
    }
    let all_zero = values.map("coefficients").is_some_and(|map| map.iter().all(|(_, x)| x.is_zero()));
    if !all_zero {
        return Vec::new();
    }
    vec![KeyError::new(
        "coefficients",
        "all coefficients are zero, so nothing is constrained",
        "give at least one coefficient that is not zero",
    )]
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    if let Some(row) = values.formulas("rates").or_else(|| values.formulas("expression")) {
        let law = match row.as_slice() {
            [(name, formula)] if name.is_empty() => MultiplierLaw::Surface(Arc::clone(formula)),
            row => MultiplierLaw::Rates(row.to_vec()),
        };
        return vec![Term::MultiplierLaw(law)];
    }
    if !values.has("coefficients") {
        return Vec::new();
    }
    let direction = Direction { entries: values.map("coefficients").unwrap_or_default().to_vec() };
    let measure = values.measure("coefficients").filter(|domain| *domain == Domain::Translation).map(Term::Measure);
    let (offset, moving) = right_side(values, "offset");
    measure.into_iter().chain([Term::Constraint { direction, offset }]).chain(moving).collect()
}
