//! The element `dc_motor`: a machine between a circuit and a shaft.

use super::shared::branch::{FROM, TO, branch, check_branch};
use super::shared::losses::{damper, inertia};
use super::shared::straight::{check_moves, check_reaction};
use super::{Element, KeyError};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, Domain, Formula, Meaning, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A machine between a circuit and a shaft: a gyrator with winding resistance, inductance and rotor inertia.
    element DcMotor("dc_motor") {
        required {
            from: Node as FROM;
            to: Node as TO;
            shaft: Body, "The shaft that the torque acts on, or the mass that the force acts on.";
            torque_constant: Mechanical(Dimension::TORQUE_CONSTANT, Sign::NonZero),
                "k, the torque for each ampere, and by the same number the voltage for each radian per second (\"0.05 N m/A\" or \"0.05 V s/rad\"); \
                 of a voice coil the force for each ampere. Negative if a positive current drives the shaft backwards.";
        }
        optional {
            reaction: Body, "The shaft or mass that carries the stator; left out: the housing.";
            resistance: Quantity(Dimension::RESISTANCE, Sign::NonNegative) = "0 Ohm", "Resistance R of the winding.";
            inductance: Quantity(Dimension::INDUCTANCE, Sign::NonNegative) = "0 H",
                "Inductance L of the winding; without it the current follows algebraically, and no law can read it.";
            rotor_inertia: Mechanical(Dimension::INERTIA, Sign::NonNegative),
                "Inertia of the rotor on `shaft`, of a voice coil the moving mass; left out: none.";
        }
    }
}

pub(super) const DC_MOTOR: Element = Element {
    keyword: DcMotor::KEYWORD,
    summary: "A permanent-magnet motor or generator between two nodes of a circuit and a shaft: tau = k i and e = k w with one k, so that the \
              conversion is lossless; with masses a voice coil.",
    sketch: r"
           i >0   R     L     e = k w
    from --->---[   ]--UUUU--( M )--- to
           +          v       |      -
                              '=====  shaft, tau = k i  (opposite on reaction)",
    signs: "`<name>.q` and `<name>.i` count positive from `from` to `to`; `<name>.v` is the potential of `from` less that of `to`, v = R i + L \
            di/dt + e. `<name>.emf.v` is the back-emf e = k w, with w the speed of `shaft` against `reaction`; `<name>.tau` (on a mass the force \
            `<name>.f`) is the torque k i on the shaft. With a positive k a positive current drives it forward.",
    symbol: Symbol::Machine,
    fields: DcMotor::FIELDS,
    example: "\
[dc_motor.fan]
from = \"in\"
to = \"ground\"
shaft = \"rotor\"
torque_constant = \"50 mN m/A\"
resistance = \"0.8 Ohm\"
inductance = \"0.6 mH\"
rotor_inertia = \"40 g cm^2\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let own = [check_branch(values), check_moves(values, &["shaft"])].concat();
    own.into_iter().chain(check_reaction(values)).collect()
}

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let mut out = branch(name, values, ["from", "to"]);
    let current = Direction::shaft(name);
    out.extend(damper(&current, values.exact("resistance")));
    out.extend(inertia(&current, values.exact("inductance")));
    let (Some(shaft), Some(constant)) = (values.word("shaft"), values.exact("torque_constant")) else { return out };
    out.extend(inertia(&Direction::shaft(shaft), values.exact("rotor_inertia")));
    out.extend(gyrator(name, values, shaft, constant));
    out
}

/// `tau = k i` along the shaft and `−k w` along the charge: the powers `k i w` and `−k w i` sum to zero.
fn gyrator(name: &str, values: &Values, shaft: &str, constant: &Exact) -> Vec<Term> {
    let (domain, dimension, effort) = match values.translational {
        true => (Domain::Translation, Dimension::FORCE_CONSTANT, Dimension::FORCE),
        false => (Domain::Rotation, Dimension::TORQUE_CONSTANT, Dimension::TORQUE),
    };
    let rate = |body: &str| (domain.motion()[1].of(body), Meaning::Rate(body.to_string()));
    let constant = (format!("{name}.torque_constant"), Meaning::Constant(constant.clone(), dimension));
    let current = (Domain::Charge.motion()[1].of(name), Meaning::Rate(name.to_string()));
    let torque = Formula::of("@ * @", vec![constant.clone(), current], effort);
    let (mut speeds, stator) = (vec![constant, rate(shaft)], values.word("reaction"));
    let relative = if stator.is_some() { "@ * (@ - @)" } else { "@ * @" };
    if let Some(stator) = stator {
        let (speed, moves) = rate(stator);
        // The meaning of the name if it is the housing.
        let still = Meaning::Constant(Exact::zero(), domain.dimensions()[1]);
        speeds.extend([(speed.clone(), moves), (speed, still)]);
    }
    let emf = Formula::of(relative, speeds, Dimension::VOLTAGE);
    let against = Direction { entries: vec![(name.to_string(), Exact::from_integer(-1))] };
    vec![
        Term::Torque { direction: Direction::difference(shaft, stator), law: torque },
        Term::Torque { direction: against, law: emf },
    ]
}
