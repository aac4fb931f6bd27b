//! The element `lock`: a form-fit lock that a signal engages.

use super::Element;
use super::shared::shafts::{ENDS, check_ends};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Term, UnilateralConstraint};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Values, keys};

keys! {
    /// A form-fit lock that a signal engages and releases.
    element Lock("lock") {
        required {
            shaft_1: Body, "The first shaft or mass.";
            engaged: Formula(Dimension::NONE),
                "Engaged while this is above 0.5: an expression of signals `[signal.NAME]`, the time `t`, parameters, angles and speeds.";
        }
        optional {
            shaft_2: Body, "The second; left out: the housing.";
        }
    }
}

pub(super) const LOCK: Element = Element {
    keyword: Lock::KEYWORD,
    summary: "Form-fit lock (dog clutch, parking pawl): while it is engaged both shafts have the same speed, at any torque.",
    sketch: r"
    shaft_1 ===[#]=== shaft_2     w1 = w2 while engaged",
    signs: "`<name>.tau` acts on shaft_2 forward and on shaft_1 backward. Engaging at a speed difference is an impact: it conserves momentum, and \
            the run reports the energy that it dissipates.",
    symbol: Symbol::Clutch,
    fields: Lock::FIELDS,
    example: "\
[lock.dog]
shaft_1 = \"input\"
shaft_2 = \"output\"
engaged = \"t/(1 s)\"
",
    check: |values| check_ends(values, ENDS),
    terms,
};

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let Some(engaged) = values.formula("engaged") else { return Vec::new() };
    let direction = Direction::difference(values.word_or_default("shaft_1"), values.word("shaft_2"));
    vec![Term::UnilateralConstraint { direction, unilateral: UnilateralConstraint::Lock { engaged: engaged.clone() } }]
}
