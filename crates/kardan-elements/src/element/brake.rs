//! The element `brake`: friction with a torque from a signal.

use super::clutch::{STATIC_FACTOR, check_static_factor, pressed};
use super::shared::gear_loss::check_loss;
use super::{Element, KeyError};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Values, keys};

keys! {
    /// A friction brake of a shaft or a mass, whose torque follows from a signal.
    element Brake("brake") {
        required {
            shaft: Body, "The shaft or mass that it brakes against the housing.";
            torque: Formula(Dimension::TORQUE),
                "The Coulomb torque while it slips, not negative: an expression of signals `[signal.NAME]`, the time `t`, parameters, angles and \
                 speeds.";
        }
        optional {
            static_factor: Number(Sign::Positive) as STATIC_FACTOR;
        }
    }
}

pub(super) const BRAKE: Element = Element {
    keyword: Brake::KEYWORD,
    summary: "Friction brake: Coulomb friction of a shaft against the housing with a torque that a signal commands.",
    sketch: r"
    shaft ===| |--- housing
             ^ torque(t)",
    signs: "`<name>.tau` acts on the shaft backward; while the brake slips it opposes the speed.",
    symbol: Symbol::Clutch,
    fields: Brake::FIELDS,
    example: "\
[brake.park]
shaft = \"wheel\"
torque = \"80 N m\"
static_factor = 1.2
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    check_static_factor(values).into_iter().chain(check_loss(values, "torque")).collect()
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    pressed(Direction::shaft(values.word_or_default("shaft")), values)
}
