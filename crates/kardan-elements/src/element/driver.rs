//! The element `driver`: a driver model that steers a car.

use super::shared::car_checks::least;
use super::shared::composite::{Composite, quoted};
use super::{Element, KeyError};
use kardan_math::units::Dimension;
use kardan_results::Symbol;
use kardan_schema::entries::{Entries, RawValue};
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

/// Wheel angle for each metre of lateral deviation, rad/m.
const TURN: Dimension = Dimension::mechanical(0, -1, 0, 1);
/// Wheel angle over the curvature of the path, rad m.
const ANGLE_PER_CURVATURE: Dimension = Dimension::mechanical(0, 1, 0, 1);
/// Step of the difference quotient for the curvature of a path.
const STEP: &str = "3 m";

keys! {
    /// A driver at a steering wheel.
    element Driver("driver") {
        required {
            wheel: Shaft, "The steering wheel.";
            kind: Choice(&["open_loop", "preview", "two_level", "hands_off"]),
                "What the driver does: `open_loop` turns the wheel to `angle`; `preview` aims at a point of a path ahead; `two_level` steers by the \
                 curvature of the path and corrects the lateral deviation of the car (both add `angle`, if given); `hands_off`: no hand is on the \
                 wheel.";
        }
        optional {
            angle: Formula(Dimension::ANGLE), "Angle to which the hands turn the wheel, a signal or an expression of the time; `open_loop` needs it.";
            path: Text,
                "The path to follow: the name of a `[path.NAME]`, of a `[table.NAME]` that gives y by x, of the signal that a manoeuvre makes, or \
                 an expression of `ahead`, the x of the preview point: `lane(ahead)`. `preview` and `two_level` need it.";
            car: Element(&["vehicle"]), "The car that is driven; they need it too.";
            gain: Formula(TURN), "Angle of the wheel for each metre of predicted lateral deviation from the path (\"20 deg/m\"); they need it too.";
            preview: Quantity(Dimension::TIME, Sign::Positive) = "1 s",
                "Preview time; of `two_level` the time ahead at which car and path are compared, both extended straight.";
            curvature_gain: Formula(ANGLE_PER_CURVATURE),
                "Angle of the wheel for the curvature of the path, the ratio of the steering times l + K u^2 (\"60 rad m\"); `two_level` needs \
                 it.";
            anticipation: Quantity(Dimension::TIME, Sign::NonNegative) = "0.2 s", "Lead time of that curvature steering, of `two_level`.";
            reaction: Quantity(Dimension::TIME, Sign::NonNegative) = "0.15 s", "Delay from observation to motion of the hands.";
            sample_time: Quantity(Dimension::TIME, Sign::Period) = "10 ms", "Sample time of the driver; `reaction` is a multiple of it.";
            lag: Quantity(Dimension::TIME, Sign::Positive) = "0.1 s", "Time constant of nerves and muscles; a steering robot has about \"5 ms\".";
            stiffness: Quantity(Dimension::STIFFNESS, Sign::Positive) = "60 N m/rad", "Stiffness of the arms; a steering robot has about \"5 kN m/rad\".";
            damping: Quantity(Dimension::DAMPING, Sign::NonNegative) = "3 N m s/rad", "Damping of the arms.";
            arm_inertia: Quantity(Dimension::INERTIA, Sign::Positive) = "0.08 kg m^2", "Inertia of the arms about the axis of the wheel.";
            grip_stiffness: Quantity(Dimension::STIFFNESS, Sign::Positive) = "1000 N m/rad", "Stiffness between hands and wheel.";
            grip_damping: Quantity(Dimension::DAMPING, Sign::NonNegative) = "2 N m s/rad", "Damping between hands and wheel.";
            grip: Formula(Dimension::NONE),
                "Grip of the hands, 0 to 1: a parameter, a signal, or an expression of the time; 0 is hands off. Left out: 1.";
        }
    }
}

pub(super) const DRIVER: Element = Element {
    keyword: Driver::KEYWORD,
    summary: "A driver: arms with inertia that turn the steering wheel to an angle, or follow a path with preview, reaction time and muscles.",
    sketch: r"
    angle, path --> [reaction, lag] --> stiffness, damping --> ( arm ) ==/\/\/\== wheel
                                                                     grip",
    signs: "Its parts are elements that others may name: the shaft `<name>_arm`, the torque `<name>_muscles` on it, and the torque `<name>_hands` \
            of the grip: `<name>_hands.tau` is the torque that the hands put on the wheel; blocks `<name>_arm_target` (target angle of the arms), with \
            a path `<name>_preview_x` (x of the preview point), `<name>_target` (y of the path there), `<name>_preview` (wheel angle that corrects \
            the deviation, after the reaction time), and with `two_level` `<name>_curvature` (of the path).",
    symbol: Symbol::Torque,
    fields: Driver::FIELDS,
    example: "\
[driver.hands]
wheel = \"wheel\"
kind = \"open_loop\"
angle = \"20 deg * sin(2 pi t / 5 s)\"
",
    check,
    terms: |_, _| Vec::new(),
};

const PATH: (&str, &str) = ("path", "path = \"lane\"");
const CAR: (&str, &str) = ("car", "car = \"car\"");
const GAIN: (&str, &str) = ("gain", "gain = \"20 deg/m\"");

fn check(values: &Values) -> Vec<KeyError> {
    let kind = values.word("kind").unwrap_or_default();
    let mut out = Vec::new();
    let needed: &[(&'static str, &str)] = match kind {
        "open_loop" => &[("angle", "angle = \"20 deg * sin(2 pi t / 5 s)\"")],
        "preview" => &[PATH, CAR, GAIN],
        "two_level" => &[PATH, CAR, GAIN, ("curvature_gain", "curvature_gain = \"60 rad m\"")],
        _ => &[],
    };
    for (key, example) in needed.iter().filter(|(key, _)| !values.has(key)) {
        let message = format!("a driver of the kind `{kind}` needs `{key}`");
        out.push(KeyError::new("kind", message, format!("add `{example}`")));
    }
    let idle: &[&'static str] = match kind {
        "open_loop" => &["path", "car", "gain", "curvature_gain"],
        "hands_off" => &["angle", "path", "car", "gain", "curvature_gain"],
        "preview" => &["curvature_gain"],
        _ => &[],
    };
    for key in idle.iter().filter(|key| values.has(key)) {
        let message = format!("`{key}` has no effect for the kind `{kind}`");
        out.push(KeyError::new(key, message, "remove it, or choose another kind"));
    }
    if let Some((what, grip)) = values.formula("grip").and_then(|formula| least(formula))
        && !(0.0..=1.0).contains(&grip)
    {
        let message = format!("{what} is {grip}: the grip is between 0 (hands off) and 1 (firm)");
        out.push(KeyError::new("grip", message, "write a number from 0 to 1, or a signal within that range"));
    }
    out
}

/// The tables that a driver expands to; none if a required key is missing.
pub(super) fn parts(name: &str, entries: &Entries) -> Option<Entries> {
    let driver = Composite { name, entries };
    let mut out = Entries::default();
    let (wheel, kind) = (driver.text("wheel")?, driver.text("kind")?);
    let reference = match kind.as_str() {
        "open_loop" => format!("({})", driver.source_text("angle")?),
        "preview" | "two_level" => {
            let preview = driver.preview_signal(&mut out, kind == "two_level")?;
            driver.source_text("angle").map_or(preview.clone(), |angle| format!("({angle}) + {preview}"))
        }
        "hands_off" => return Some(out),
        _ => return None,
    };
    driver.arms(&mut out, &wheel, &reference);
    Some(out)
}

/// An expression with one identifier replaced.
fn with_word(text: &str, word: &str, by: &str) -> String {
    let part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.');
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(word) {
        let (before, behind) = (&rest[..at], &rest[at + word.len()..]);
        let whole = !before.ends_with(part) && !behind.starts_with(part);
        out += before;
        out += if whole { by } else { word };
        rest = behind;
    }
    out + rest
}

impl Composite<'_> {
    fn text(&self, key: &str) -> Option<String> {
        self.entries.text(key).map(str::to_string)
    }

    /// The expression of a key as it is written.
    fn source_text(&self, key: &str) -> Option<String> {
        match self.entries.get(key)? {
            RawValue::Text(text) | RawValue::Number(text) => Some(text.clone()),
            RawValue::Quantity(value, dimension) => Some(kardan_math::units::format_quantity(value, *dimension)),
            _ => None,
        }
    }

    /// The path at an x.
    fn path_at(&self, path: &str, x: &str) -> String {
        let is_name = path.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-'));
        if is_name { format!("{}({x})", quoted(path)) } else { format!("({})", with_word(path, "ahead", x)) }
    }

    /// The wheel angle that the path requests, after the reaction time.
    fn preview_signal(&self, out: &mut Entries, two_level: bool) -> Option<String> {
        let (car, path, gain) = (self.text("car")?, self.text("path")?, self.source_text("gain")?);
        let of = |word: &str| quoted(&format!("{car}.{word}"));
        let [x, y, heading, u, v] = ["x", "y", "heading", "v_x", "v_y"].map(of);
        let (time, ahead) = (self.own("preview"), quoted(&self.part("preview_x")));
        let block = |out: &mut Entries, part: &str, input: String| {
            let keys = [("kind", "gain".to_string()), ("gain", "1".to_string()), ("input", input)];
            self.add(out, "block", part, &[&keys[..], &[("sample_time", self.own("sample_time"))]].concat());
        };
        let look_ahead = if two_level { self.own("anticipation") } else { time.clone() };
        block(out, "preview_x", format!("{x} + {look_ahead} * {u}"));
        let at = |x: &str| self.path_at(&path, x);
        let target = match two_level {
            // The path extended straight from the position of the car.
            true => {
                let slope =
                    format!("({} - {}) / (2 * {STEP})", at(&format!("({x} + {STEP})")), at(&format!("({x} - {STEP})")));
                format!("{} + {time} * {u} * {slope}", at(&x))
            }
            false => at(&ahead),
        };
        block(out, "target", target);
        let preview = format!("{y} + {time} * ({u} * sin({heading}) + {v} * cos({heading}))");
        let beside = format!("({gain}) * ({} - ({preview}))", quoted(&self.part("target")));
        self.react(out, beside);
        let preview = quoted(&self.part("preview"));
        if !two_level {
            return Some(preview);
        }
        let curvature_gain = self.source_text("curvature_gain")?;
        let [before, behind] = ["-", "+"].map(|sign| at(&format!("({ahead} {sign} {STEP})")));
        block(out, "curvature", format!("({behind} - 2 * {} + {before}) / ({STEP})^2", at(&ahead)));
        Some(format!("({curvature_gain}) * {} + {preview}", quoted(&self.part("curvature"))))
    }

    /// An observed quantity after the reaction time.
    fn react(&self, out: &mut Entries, input: String) {
        let at_once = self.source_text("reaction").and_then(|text| kardan_math::units::parse_quantity(&text).ok());
        let kind = match at_once.is_some_and(|(value, _)| value.is_zero()) {
            true => [("kind", "gain".to_string()), ("gain", "1".to_string())],
            false => [("kind", "delay".to_string()), ("time", self.own("reaction"))],
        };
        let rest = [("input", input), ("sample_time", self.own("sample_time"))];
        self.add(out, "block", "preview", &[&kind[..], &rest[..]].concat());
    }

    /// Muscles, arms and hands.
    fn arms(&self, out: &mut Entries, wheel: &str, reference: &str) {
        let (target, lag, arm) = (quoted(&self.part("arm_target")), self.own("lag"), self.part("arm"));
        let [stiffness, damping] = ["stiffness", "damping"].map(|key| self.own(key));
        let target_keys =
            [("kind", "low_pass".to_string()), ("input", reference.to_string()), ("time_constant", lag.clone())];
        self.add(out, "block", "arm_target", &target_keys);
        self.add(out, "shaft", "arm", &[("inertia", self.own("arm_inertia"))]);
        let [phi, w] = ["phi", "w"].map(|word| self.of("arm", word));
        // The muscles damp the deviation from the intended rate.
        let law = format!("{stiffness} * ({target} - {phi}) + {damping} * (({reference} - {target}) / {lag} - {w})");
        self.add(out, "torque", "muscles", &[("shaft", arm.clone()), ("law", law)]);
        let [angle, speed] = ["phi", "w"].map(|word| quoted(&format!("{wheel}.{word}")));
        let [stiffness, damping] = ["grip_stiffness", "grip_damping"].map(|key| self.own(key));
        let force = format!("{stiffness} * ({phi} - {angle}) + {damping} * ({w} - {speed})");
        let law = self.source_text("grip").map_or(force.clone(), |grip| format!("({grip}) * ({force})"));
        let hands = [("shaft", wheel.to_string()), ("reaction", arm), ("law", law)];
        self.add(out, "torque", "hands", &hands);
    }
}

#[cfg(test)]
#[path = "../../tests/unit/element/driver.rs"]
mod tests;
