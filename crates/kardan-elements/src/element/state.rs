//! The element `state`: a state of first order.

use super::Element;
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, Domain, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Values, keys};

keys! {
    /// A state of first order.
    element State("state") {
        required {
            rate: Formula(Dimension::FREQUENCY),
                "Its rate of change, an expression of states (`slip.z`), angles and speeds, the time `t`, parameters, signals and tables, in 1/s.";
        }
    }
}

pub(super) const STATE: Element = Element {
    keyword: State::KEYWORD,
    summary: "A first-order state, a number whose rate an expression gives: tyre relaxation, bristle deflection, a temperature. Torque laws read it \
              as `slip.z`.",
    sketch: r"
    rate = law(z, phi, w, t)  -->[ integral ]-->  z",
    signs: "`<name>.z` is the state, `<name>.rate` its rate, `<name>.sum` its integral over time, on which nothing depends. It starts at zero, or as \
            `initial` of the scenario says.",
    symbol: Symbol::Relation,
    fields: State::FIELDS,
    example: "\
[state.slip]
rate = \"(1 m/s - 20 m/s * slip.z) / 0.6 m\"
",
    check: |_| Vec::new(),
    terms,
};

/// The state is the rate of a coordinate with inertia one, driven by a law along that coordinate.
fn terms(name: &str, values: &Values) -> Vec<Term> {
    let direction = || Direction::shaft(name);
    let one = Exact::one();
    let state = Term::Coordinate { name: name.to_string(), domain: Domain::Number };
    let own = [state, Term::Inertia { direction: direction(), inertia: one }];
    let law = values.formula("rate").map(|law| Term::Torque { direction: direction(), law: law.clone() });
    own.into_iter().chain(law).collect()
}
