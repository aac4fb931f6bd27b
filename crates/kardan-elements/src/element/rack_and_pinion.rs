//! The element `rack_and_pinion`: a pinion that moves a rack.

use std::sync::Arc;

use super::shared::contact::{RESTITUTION, Side, backlash_of, backlash_terms, check_backlash};
use super::shared::gear_loss::{EFFICIENCY, EFFICIENCY_BACK, LOSS, check_gear_loss, gear_loss};
use super::shared::spline::{Spline, check_points};
use super::shared::straight::{check_moves, straight};
use super::{Element, KeyError};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, Domain, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A pinion that moves a rack.
    element RackAndPinion("rack_and_pinion") {
        required {
            pinion: Shaft, "The shaft of the pinion.";
            rack: Mass, "The rack.";
        }
        optional {
            radius: Quantity(Dimension::LENGTH, Sign::NonZero), "Pitch radius of the pinion; needed, or `travel`, or `curve`.";
            travel: Quantity(Dimension::LENGTH_PER_ANGLE, Sign::NonZero),
                "Travel of the rack for a turn of the pinion, in place of `radius`: \"44 mm/rev\".";
            curve: Tables(RackPoint),
                "Positions of the rack by angles of the pinion, in place of `radius`, for a ratio that varies: a smooth curve through them (a \
                 natural cubic spline), extrapolated linearly outside the first and the last. The pinion, or a shaft coupled to it, must be a \
                 coordinate.";
            offset: Quantity(Dimension::LENGTH, Sign::Any) = "0 mm", "Position of the rack at pinion angle zero; not with `curve`.";
            backlash: Quantity(Dimension::LENGTH, Sign::NonNegative),
                "Backlash of the rack, a distance: within half of it either way no force is transmitted. Left out: none.";
            restitution: Number(Sign::NonNegative) as RESTITUTION;
            efficiency: Number(Sign::Positive) as EFFICIENCY;
            efficiency_back: Number(Sign::Any) as EFFICIENCY_BACK;
            loss: Formula(Dimension::TORQUE) as LOSS;
        }
    }
}

keys! {
    /// A point of the curve of a rack.
    table RackPoint {
        required {
            angle: Quantity(Dimension::ANGLE, Sign::Any), "Angle of the pinion.";
            position: Quantity(Dimension::LENGTH, Sign::Any), "Position of the rack there.";
        }
    }
}

pub(super) const RACK_AND_PINION: Element = Element {
    keyword: RackAndPinion::KEYWORD,
    summary: "A pinion that moves a rack: s - r phi = offset, or s = curve(phi) where the ratio varies.",
    sketch: r"
            ( o )  pinion, phi >0
      ======/\/\/\======>  rack, s >0     s - r phi = offset",
    signs: "With a positive radius the rack moves forward as the pinion rotates forward. `<name>.f` is the force of the teeth on the rack; on the \
            pinion acts -r times it, `<name>.<pinion>.tau`. The loss torque `<name>.friction` acts on the pinion against its rotation.",
    symbol: Symbol::Gear,
    fields: RackAndPinion::FIELDS,
    example: "\
[rack_and_pinion.teeth]
pinion = \"pinion\"
rack = \"rack\"
radius = \"7 mm\"
",
    check,
    terms,
};

/// The points of the key `curve`.
pub(super) fn points(values: &Values) -> Option<Vec<(f64, f64)>> {
    let point = |point: &Values| Some((point.number("angle")?, point.number("position")?));
    values.tables("curve")?.iter().map(point).collect()
}

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = check_moves(values, &["pinion", "rack"]);
    let ways: Vec<&'static str> = ["radius", "travel", "curve"].into_iter().filter(|key| values.has(key)).collect();
    match ways[..] {
        [first, second, ..] => {
            out.push(KeyError::new(second, format!("both `{first}` and `{second}` are given"), "keep one of them"));
        }
        [] => out.push(KeyError::new(
            "radius",
            "it needs the radius of the pinion, or the travel of the rack for a turn",
            "add `radius = \"7 mm\"` or `travel = \"44 mm/rev\"`, or points of a `curve`",
        )),
        _ => {}
    }
    if let Some(points) = points(values) {
        out.extend(check_points("curve", &points));
        if values.has("offset") {
            out.push(KeyError::new("offset", "a curve gives positions itself", "add it to the positions of the curve"));
        }
    }
    out.extend([check_backlash(values), check_gear_loss(values)].concat());
    out
}

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let ends = ["pinion", "rack"].map(|key| values.word_or_default(key));
    let loss = gear_loss(Direction::shaft(ends[0]), values);
    let curve = points(values).filter(|points| check_points("curve", points).is_empty());
    if let Some(spline) = curve.and_then(|points| Spline::new(&points)) {
        return bent(name, ends, spline, values).into_iter().chain(loss).collect();
    }
    let lead = values.exact("travel").or(values.exact("radius")).cloned().unwrap_or_else(Exact::one);
    straight(ends, &lead, values).into_iter().chain(loss).collect()
}

/// A rack whose position is a curve over the angle of the pinion.
fn bent(name: &str, [driving, rack]: [&str; 2], spline: Spline, values: &Values) -> Vec<Term> {
    let moves = |driven: &str| {
        let (driven, driving) = (driven.to_string(), driving.to_string());
        [Term::Measure(Domain::Translation), Term::Transmission { driven, driving, curve: Arc::new(spline) }]
    };
    let Some(backlash) = backlash_of(values) else { return moves(rack).into() };
    // The position that the rack would have without backlash follows from the pinion; the backlash is between these two.
    let direction = Direction::difference(rack, Some(name));
    let behind = [Term::Coordinate { name: name.into(), domain: Domain::Translation }].into_iter().chain(moves(name));
    behind.chain(backlash_terms(&direction, &Exact::zero(), backlash, &Side::of(values))).collect()
}
