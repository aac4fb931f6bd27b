//! The element `coupled_inductors` of a circuit.

use super::shared::branch::{branch, check_winding};
use super::{Element, KeyError};
use kardan_math::num::{Rational, Scalar};
use kardan_math::units::{Dimension, Exact, Expression};
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// Two coils that share a part of their flux.
    element CoupledInductors("coupled_inductors") {
        required {
            from_1: Node, "The dotted end of winding 1.";
            to_1: Node, "The other end of winding 1.";
            from_2: Node, "The dotted end of winding 2.";
            to_2: Node, "The other end of winding 2.";
            inductance_1: Quantity(Dimension::INDUCTANCE, Sign::Positive),
                "L1, the inductance of winding 1 while winding 2 is open.";
            inductance_2: Quantity(Dimension::INDUCTANCE, Sign::Positive),
                "L2, the inductance of winding 2 while winding 1 is open.";
        }
        optional {
            mutual_inductance: Quantity(Dimension::INDUCTANCE, Sign::Any),
                "M, with M^2 < L1 L2; negative if one of the windings has the opposite sense.";
            coupling: Number(Sign::Any),
                "In place of `mutual_inductance`: k, between -1 and 1, with M = k sqrt(L1 L2), which is rounded once where the root is irrational.";
        }
    }
}

pub(super) const COUPLED_INDUCTORS: Element = Element {
    keyword: CoupledInductors::KEYWORD,
    summary: "Two coils with a mutual inductance: v1 = L1 di1/dt + M di2/dt, v2 = M di1/dt + L2 di2/dt.",
    sketch: r"
              i1 >0   i2 >0
    from_1 --->---* M *---<--- from_2
           v1  L1 )   ( L2   v2
      to_1 -------)   (------- to_2",
    signs: "Both currents count positive into the dotted ends `from_1` and `from_2`, both voltages from there to `to_1` and `to_2`: `<name>.1.i`, \
            `<name>.1.v` and `<name>.2.i`, `<name>.2.v`. M^2 = L1 L2 is a `transformer` beside an inductor.",
    symbol: Symbol::Transformer,
    fields: CoupledInductors::FIELDS,
    example: "\
[coupled_inductors.charger]
from_1 = \"mains\"
to_1 = \"ground\"
from_2 = \"out\"
to_2 = \"ground\"
inductance_1 = \"240 mH\"
inductance_2 = \"200 mH\"
mutual_inductance = \"60 mH\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = [check_winding(values, ["from_1", "to_1"]), check_winding(values, ["from_2", "to_2"])].concat();
    match (values.has("mutual_inductance"), values.has("coupling")) {
        (false, false) => {
            let help = "add `mutual_inductance` or `coupling`; coils without it are two elements `inductor`";
            out.push(KeyError::new("inductance_1", "no key defines the coupling of the coils", help));
        }
        (true, true) => out.push(KeyError::new(
            "coupling",
            "`mutual_inductance` and `coupling` both define the coupling of the coils",
            "remove one of the two",
        )),
        (has_mutual, _) => {
            out.extend(check_coupling(values, if has_mutual { "mutual_inductance" } else { "coupling" }))
        }
    }
    out
}

/// The energy of the coils must be positive for all currents.
fn check_coupling(values: &Values, key: &'static str) -> Option<KeyError> {
    let ideal = "windings that share all of their flux are a `transformer`, with an `inductor` beside winding 1";
    let one = Rational::ONE;
    if let Some(factor) = values.exact("coupling").map(Exact::to_rational) {
        let square = factor.times(&factor);
        let message = format!("the windings share more than all of their flux: k = {}", values.number_or_default(key));
        return match square.cmp(&one) {
            std::cmp::Ordering::Less => None,
            std::cmp::Ordering::Equal => Some(KeyError::new(
                key,
                "the windings share all of their flux, so a motion of both has no inductance",
                ideal,
            )),
            std::cmp::Ordering::Greater => Some(KeyError::new(key, message, "give a k above -1 and below 1")),
        };
    }
    let (first, second) = (values.exact("inductance_1")?.to_rational(), values.exact("inductance_2")?.to_rational());
    let mutual = values.exact(key)?.to_rational();
    let (square, most) = (mutual.times(&mutual), first.times(&second));
    if square < most {
        return None;
    }
    if square == most {
        return Some(KeyError::new(
            key,
            "the windings share all of their flux (M^2 = L1 L2), so a motion of both has no inductance",
            ideal,
        ));
    }
    let (mutual, first, second) = (
        values.number_or_default(key),
        values.number_or_default("inductance_1"),
        values.number_or_default("inductance_2"),
    );
    let most = (first * second).sqrt();
    let message =
        format!("M = {mutual:?} H is more than sqrt(L1 L2) = {most:?} H, so currents would have a negative energy");
    Some(KeyError::new(key, message, "give M with M^2 < L1 L2"))
}

/// M, exact except for an irrational root.
fn mutual(values: &Values) -> Option<Exact> {
    if let Some(mutual) = values.exact("mutual_inductance") {
        return Some(mutual.clone());
    }
    let lookup = |name: &str| match name {
        "k" => Some((values.exact("coupling")?.clone(), Dimension::NONE)),
        "a" => Some((values.exact("inductance_1")?.clone(), Dimension::INDUCTANCE)),
        _ => Some((values.exact("inductance_2")?.clone(), Dimension::INDUCTANCE)),
    };
    let factor = Expression::parse("k * sqrt(a * b)").ok()?;
    Some(factor.evaluate(&lookup).ok()?.value)
}

/// `½ L1 (i1 + M/L1 i2)² + ½ (L2 − M²/L1) i2²`
fn terms(name: &str, values: &Values) -> Vec<Term> {
    let [one, two] = [format!("{name}.1"), format!("{name}.2")];
    let mut out = branch(&one, values, ["from_1", "to_1"]);
    out.extend(branch(&two, values, ["from_2", "to_2"]));
    let (first, second) = (values.exact("inductance_1"), values.exact("inductance_2"));
    let (Some(first), Some(second), Some(mutual)) = (first, second, mutual(values)) else { return out };
    let Some(share) = first.recip().map(|inverse| &mutual * &inverse) else { return out };
    let leakage = second.plus(&-&(&mutual * &share));
    let shared = Direction { entries: vec![(one, Exact::one()), (two.clone(), share)] };
    out.push(Term::Inertia { direction: shared, inertia: first.clone() });
    out.push(Term::Inertia { direction: Direction::shaft(&two), inertia: leakage });
    out
}
