//! The element `sensor`: a measured angle, speed, torque or signal.

use std::f64::consts::TAU;

use super::shared::straight::check_moves;
use super::{Element, KeyError};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{self, Measured, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A measured angle, speed, torque or signal.
    element Sensor("sensor") {
        required {
            measures: Choice(&["angle", "speed", "torque", "net_torque", "signal"]),
                "What is measured; the net torque on a shaft is its own inertia times its acceleration. Of a mass they are position, velocity and \
                 force. A signal is a signal of a vehicle, a block without a sample time, a reference, a disturbance, a signal of the file.";
        }
        optional {
            signal: Signal, "The signal, for `measures = \"signal\"`: `car.a_y`. Blocks and programs with a sample time read the sensor by its name.";
            shaft: Body, "The shaft or mass, for an angle, a speed, a net torque or a constraint torque.";
            element: Element(&[
                "spring_damper", "harmonic_drive", "planetary", "gear", "universal_joint", "constraint", "rack_and_pinion",
                "screw", "pulley",
            ]),
                "The torsion bar (its spring torque, by its twist) or the gear (its constraint torque on `shaft`).";
            lines: Number(Sign::Positive), "Lines per revolution; every line counts four edges. Left out: no rounding.";
            resolution: AnyQuantity,
                "Smallest step of the angle or twist, instead of `lines`; of a signal in its unit.";
            phase: Number(Sign::NonNegative) = "0",
                "Position within a step at zero angle, from 0 to below 1: the reading is step * floor(angle/step + phase); with 0.5 it rounds to \
                 the nearest step.";
            sample_time: Quantity(Dimension::TIME, Sign::Period),
                "Time between readings, with zero-order hold; a speed is then the difference of two rounded angles. Left out: continuous.";
            noise: AnyQuantity,
                "Standard deviation of the noise in each reading, in the unit of what is measured: Gaussian, white, \
                 added before rounding (to a speed from rounded angles: after), drawn from `seed` of `[scenario]`. \
                 Sampled controllers read it. Needs `sample_time`; left out: none.";
        }
    }
}

pub(super) const SENSOR: Element = Element {
    keyword: Sensor::KEYWORD,
    summary: "A measured angle or speed of a shaft, the torque of a torsion bar by its twist, a constraint torque, the net torque on a \
              shaft, or a signal such as the lateral acceleration of a vehicle.",
    sketch: r"
    quantity --(+ noise)-->[ resolution ]-->[ sample and hold ]--> reading",
    signs: "The reading `<name>.phi`, `<name>.w` or `<name>.tau` (of a mass `<name>.s`, `<name>.v` or `<name>.f`; of a signal `<name>`) has the \
            sign of what it measures.",
    symbol: Symbol::Sensor,
    fields: Sensor::FIELDS,
    example: "\
[sensor.wg_encoder]
measures = \"angle\"
shaft = \"wg\"
lines = 3520
phase = 0.5
sample_time = \"1 ms\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = check_moves(values, &["shaft"]);
    let measures = values.word("measures");
    if measures == Some("signal") {
        check_signal(values, &mut out);
    } else if values.has("signal") {
        let help = "remove `signal`, or set `measures = \"signal\"`";
        out.push(KeyError::new("signal", "the sensor measures a motion or a torque, not a signal", help));
    }
    match measures {
        Some(kind @ ("angle" | "speed" | "net_torque")) => {
            let kind = kind.replace('_', " ");
            if !values.has("shaft") {
                out.push(KeyError::new("shaft", format!("a sensor of {kind} needs a shaft"), "add `shaft = \"...\"`"));
            }
            if values.has("element") {
                out.push(KeyError::new(
                    "element",
                    format!("a sensor of {kind} measures a shaft, not an element"),
                    "remove `element`, or set `measures = \"torque\"`",
                ));
            }
        }
        Some("torque") if !values.has("element") => out.push(KeyError::new(
            "element",
            "a torque sensor needs the element whose torque it measures",
            "add `element = \"...\"`: a spring_damper, or a gear together with `shaft`",
        )),
        _ => {}
    }
    if values.has("noise") && !values.has("sample_time") {
        out.push(KeyError::new(
            "noise",
            "noise is drawn for each reading, and a sensor without a sample time reads at every instant",
            "add `sample_time`, such as \"1 ms\"",
        ));
    }
    if values.has("lines") && values.translational {
        let help = "give the smallest step of the position as `resolution`";
        out.push(KeyError::new("lines", "lines are counted in a turn, and a mass does not turn", help));
    }
    if values.has("lines") && values.has("resolution") {
        out.push(KeyError::new("resolution", "both `lines` and `resolution` are given", "keep one of them"));
    }
    let coarse = values.has("lines") || values.has("resolution");
    if measures == Some("speed") && coarse && !values.has("sample_time") {
        out.push(KeyError::new(
            "sample_time",
            "a speed from an encoder of finite resolution needs a sample time",
            "add `sample_time`: the speed is the difference of two rounded angles over it",
        ));
    }
    if values.has("phase") && !coarse {
        out.push(KeyError::new(
            "phase",
            "a phase within a step needs a step",
            "add `lines` or `resolution`, or remove `phase`",
        ));
    }
    if let Some(phase) = values.number("phase").filter(|phase| *phase >= 1.0) {
        let message = format!("the phase {phase} lies outside the step");
        out.push(KeyError::new("phase", message, "give it as a part of a step, from 0 to below 1"));
    }
    let no_twist = match measures {
        Some("torque") => values.has("shaft").then_some("constraint torque"),
        Some("net_torque") => Some("net torque"),
        _ => None,
    };
    if let (true, Some(what)) = (coarse, no_twist) {
        out.push(KeyError::new(
            if values.has("lines") { "lines" } else { "resolution" },
            format!("a resolution is an angle, and a {what} has no twist to round"),
            "remove it, or measure the torque of a `spring_damper`",
        ));
    }
    out
}

/// The keys of a sensor of a signal.
fn check_signal(values: &Values, out: &mut Vec<KeyError>) {
    if !values.has("signal") {
        let help = "add `signal = \"...\"`: a signal of a vehicle such as `car.a_y`, a block, or a signal of the file";
        out.push(KeyError::new("signal", "a sensor of a signal needs its name", help));
    }
    for key in ["shaft", "element"].into_iter().filter(|key| values.has(key)) {
        let help = format!("remove `{key}`, or set what is measured of it: \"angle\", \"speed\", \"torque\"");
        out.push(KeyError::new(key, "a sensor of a signal measures no shaft and no element", help));
    }
    if values.has("lines") {
        let help = "give the smallest step of the signal as `resolution`";
        out.push(KeyError::new("lines", "lines are counted in a turn, and a signal does not turn", help));
    }
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let shaft = || values.word_or_default("shaft").to_string();
    let measured = match (values.word_or_default("measures"), values.word("element")) {
        ("angle", _) => Measured::Angle(shaft()),
        ("speed", _) => Measured::Speed(shaft()),
        ("net_torque", _) => Measured::NetTorque(shaft()),
        ("signal", _) => Measured::Signal(values.word_or_default("signal").to_string()),
        (_, Some(element)) if values.has("shaft") => Measured::ConstraintTorque(element.into(), shaft()),
        (_, element) => Measured::SpringTorque(element.unwrap_or_default().into()),
    };
    let lines = values.number("lines").map(|lines| TAU / (4.0 * lines));
    vec![Term::Output(equations::Sensor {
        measured,
        resolution: lines.or(values.number("resolution")),
        phase: values.number_or_default("phase"),
        sample_time: values.exact("sample_time").cloned(),
        noise: values.number("noise").filter(|noise| *noise > 0.0),
    })]
}
