use super::shared::prescribed::right_side;
use super::{Element, Mistake, Values};
use crate::equations::{Direction, Domain, Term};
use crate::results::Symbol;
use crate::schema::{ElementKeys, Keys, keys};
use crate::units::Dimension;

keys! {
    /// Any linear row by hand, \[diss. (4.31)\] with an offset.
    element Constraint("constraint") {
        required {
            coefficients: Coefficients,
                "Coefficients by shaft; one shaft alone is held still by { shaft = 1 }. With masses, or with lengths as coefficients \
                 of shafts, the sum is a length: { rack = 1, pinion = \"-7 mm\" }.";
        }
        optional {
            offset: OfTime(Dimension::ANGLE),
                "The right-hand side, an angle or a length, or a smooth function of the time `t`, parameters, signals `[signal.NAME]` and \
                 tables: its value and its rate must not jump; left out: zero.";
        }
    }
}

/// Any linear row by hand, \[diss. (4.31)\] with an offset.
pub const CONSTRAINT: Element = Element {
    keyword: Constraint::KEYWORD,
    summary: "Any linear relation between angles and positions, by hand: sum of coefficient times angle = offset.",
    sketch: r"
    a1 q1 + a2 q2 + ... = offset(t)",
    signs: "`<name>.tau` is the multiplier of the row as written: the torque on shaft k is a_k times it. Where the sum is a length it is the force `<name>.f`. Where the offset \
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

fn check(values: &Values) -> Vec<Mistake> {
    let all_zero = values.map("coefficients").is_some_and(|map| map.iter().all(|(_, x)| x.is_zero()));
    if !all_zero {
        return Vec::new();
    }
    vec![Mistake::new(
        "coefficients",
        "all coefficients are zero, so nothing is constrained",
        "give at least one coefficient that is not zero",
    )]
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let along = Direction { entries: values.map("coefficients").unwrap_or_default().to_vec() };
    let measure = values.measure("coefficients").filter(|domain| *domain == Domain::Translation).map(Term::Measure);
    let (offset, moving) = right_side(values, "offset");
    measure.into_iter().chain([Term::Constraint { along, offset }]).chain(moving).collect()
}
