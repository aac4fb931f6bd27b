//! The element `motor`: a torque or force that laws and scenarios command.

use super::shared::straight::{check_moves, check_reaction};
use super::{Element, KeyError};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{self, Direction, InputKind, Ripple, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A torque input between the housing and a shaft, or between two shafts; a force along masses.
    element Motor("motor") {
        required {
            shaft: Body, "The shaft that the torque acts on, or the mass that the force acts on.";
        }
        optional {
            reaction: Body, "The shaft or mass that carries the stator; left out: the housing.";
            torque_limit: Mechanical(Dimension::TORQUE, Sign::Positive),
                "Largest torque either way; left out: unlimited.";
            rate_limit: Mechanical(Dimension::TORQUE_RATE, Sign::Positive),
                "Largest change of torque per time; left out: unlimited.";
            lag: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "Time constant of the first-order lag.";
            ripple: Mechanical(Dimension::TORQUE, Sign::NonNegative),
                "Amplitude of a torque ripple (cogging), ripple sin(ripple_order angle), with the angle of the shaft against `reaction`. It acts in \
                 addition to `<name>.tau`, the torque that the drive reports; its signal is `<name>.ripple`; designs neglect it. Left out: none.";
            ripple_order: Number(Sign::Positive),
                "Periods of the ripple in one turn, such as pole pairs times six; needed with `ripple`.";
        }
    }
}

pub(super) const MOTOR: Element = Element {
    keyword: Motor::KEYWORD,
    summary: "A torque input that a control law or the scenario commands; ideal, or with torque limit, rate limit and lag.",
    sketch: r"
    command -->[ limit ]-->[ rate ]-->[ 1/(lag s + 1) ]--> tau (+ ripple) on shaft",
    signs: "`<name>.tau` (on a mass the force `<name>.f`) is the torque on the shaft after limits and lag (the opposite torque acts on `reaction` \
            if it is given); `<name>.command` is the commanded torque.",
    symbol: Symbol::Motor,
    fields: Motor::FIELDS,
    example: "\
[motor.wg_motor]
shaft = \"wg\"
torque_limit = \"1.3 N m\"
lag = \"160 us\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::from_iter(check_reaction(values));
    out.extend(check_moves(values, &["shaft"]));
    match (values.has("ripple"), values.has("ripple_order")) {
        (true, false) => out.push(KeyError::new(
            "ripple",
            "a ripple needs its order",
            "add `ripple_order`, the periods in one turn of the shaft",
        )),
        (false, true) => out.push(KeyError::new(
            "ripple_order",
            "there is a ripple order, but no ripple",
            "add `ripple`, its amplitude, or remove `ripple_order`",
        )),
        (true, true) if values.translational => out.push(KeyError::new(
            "ripple",
            "a ripple has periods per revolution, and a mass does not rotate",
            "remove `ripple` and `ripple_order`",
        )),
        _ => {}
    }
    out
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let ripple = values.exact("ripple").filter(|x| !x.is_zero()).zip(values.exact("ripple_order"));
    vec![Term::Input {
        direction: Direction::difference(values.word_or_default("shaft"), values.word("reaction")),
        kind: InputKind::Motor(equations::Motor {
            torque_limit: values.exact("torque_limit").cloned(),
            rate_limit: values.exact("rate_limit").cloned(),
            lag: values.exact("lag").filter(|x| !x.is_zero()).cloned(),
            ripple: ripple.map(|(torque, order)| Box::new(Ripple { torque: torque.clone(), order: order.clone() })),
        }),
    }]
}
