//! The element `harmonic_drive`: a strain-wave gear with three shafts.

use super::shared::contact::{RESTITUTION, Side, backlash_of, backlash_terms, check_backlash};
use super::shared::gear_loss::{EFFICIENCY, EFFICIENCY_BACK, LOSS, check_gear_loss, gear_loss};
use super::shared::shafts::check_different;
use super::{Element, KeyError};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A strain-wave gear with three rotating shafts, \[diss. (6.1)\].
    element HarmonicDrive("harmonic_drive") {
        required {
            wave_generator: Shaft, "The shaft of the wave generator.";
            circular_spline: Shaft, "The shaft of the circular spline.";
            flexspline: Shaft, "The shaft of the flexspline.";
            ratio: Number(Sign::Positive), "The transmission ratio i of the catalogue.";
        }
        optional {
            offset: Quantity(Dimension::ANGLE, Sign::Any) = "0 deg", "Mounting offset of the angles.";
            stiffness: Quantity(Dimension::STIFFNESS, Sign::Positive),
                "Torsional stiffness at the flexspline with the other two shafts fixed; a spring then replaces the constraint of the gear. Left \
                 out: rigid.";
            damping: Quantity(Dimension::DAMPING, Sign::NonNegative) = "0 N m s/rad",
                "Viscous damping of that twist, at the flexspline; needs `stiffness`.";
            backlash: Quantity(Dimension::ANGLE, Sign::NonNegative),
                "Backlash, as an angle of the flexspline with the other two shafts fixed: within half of it either way no torque is transmitted. \
                 Left out: none.";
            restitution: Number(Sign::NonNegative) as RESTITUTION;
            efficiency: Number(Sign::Positive) as EFFICIENCY;
            efficiency_back: Number(Sign::Any) as EFFICIENCY_BACK;
            loss: Formula(Dimension::TORQUE) as LOSS;
        }
    }
}

pub(super) const HARMONIC_DRIVE: Element = Element {
    keyword: HarmonicDrive::KEYWORD,
    summary: "A harmonic drive in differential mode: wg - (i+1) cs + i fs + offset = 0, none of the shafts fixed.",
    sketch: r"
                 ratio i
    fs ====(  flexspline  )
            |  teeth  |          wg - (i+1) cs + i fs + offset = 0
    cs ====( circular spline )
            |  cam  |
    wg ====( wave generator )",
    signs: "With the circular spline fixed, the flexspline rotates 1/i times as fast as the wave generator, backwards; `<name>.tau` is the \
            constraint torque on the wave generator (with a `stiffness` that of the spring), and -(i+1) and i times it act on cs and fs. The loss \
            torque `<name>.friction` acts on wg, and in reaction on cs, against their rotation.",
    symbol: Symbol::StrainWaveGear,
    fields: HarmonicDrive::FIELDS,
    example: "\
[harmonic_drive.hd]
wave_generator = \"wg\"
circular_spline = \"cs\"
flexspline = \"fs\"
ratio = 50
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = check_different(values, &["wave_generator", "circular_spline", "flexspline"]);
    if values.has("damping") && !values.has("stiffness") {
        let message = "without `stiffness` there is no twist, so this damping has no effect";
        out.push(KeyError::new(
            "damping",
            message,
            "add `stiffness`, or remove `damping`; that of a shaft belongs to the shaft",
        ));
    }
    out.extend([check_backlash(values), check_gear_loss(values)].concat());
    out
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let ratio = values.ratio();
    let circular = -&ratio.plus(&Exact::one());
    let direction = Direction {
        entries: vec![
            (values.word_or_default("wave_generator").into(), Exact::one()),
            (values.word_or_default("circular_spline").into(), circular),
            (values.word_or_default("flexspline").into(), ratio.clone()),
        ],
    };
    let offset = -&values.exact_or_default("offset");
    let [wave_generator, circular] = ["wave_generator", "circular_spline"].map(|key| values.word_or_default(key));
    let loss = gear_loss(Direction::difference(wave_generator, Some(circular)), values);
    let teeth = match (values.exact("stiffness").cloned(), backlash_of(values)) {
        (_, Some(backlash)) => backlash_terms(&direction, &offset, &(&ratio * backlash), &side(values, &ratio)),
        (Some(stiffness), None) => {
            let damping = values.exact_or_default("damping");
            vec![Term::Compliance { direction, offset, scale: ratio, stiffness, damping }]
        }
        (None, None) => vec![Term::Constraint { direction, offset }],
    };
    teeth.into_iter().chain(loss).collect()
}

/// The backlash along the row of the wave generator, where a twist is that of the flexspline times the ratio.
fn side(values: &Values, ratio: &Exact) -> Side {
    let felt = |value: Exact| value.div(&(ratio * ratio)).unwrap_or(value);
    match Side::of(values) {
        Side::Soft { stiffness, damping } => Side::Soft { stiffness: felt(stiffness), damping: felt(damping) },
        rigid @ Side::Rigid { .. } => rigid,
    }
}

#[cfg(test)]
#[path = "../../tests/unit/element/harmonic_drive.rs"]
mod tests;
