use super::{Element, Mistake, Values};
use crate::entries::{Entries, Written};
use crate::results::Symbol;
use crate::schema::{ElementKeys, Keys, Sign, keys};
use crate::units::Dimension;

/// Of a wheel for each metre beside the path, rad/m.
const TURN: Dimension = Dimension::mechanical(0, -1, 0, 1);

keys! {
    /// A driver at a steering wheel.
    element Driver("driver") {
        required {
            wheel: Shaft, "The steering wheel.";
            kind: Choice(&["open_loop", "preview", "hands_off"]),
                "What the hands do: `open_loop` turns the wheel to `angle`, `preview` follows a path (and adds `angle`, if there is one), `hands_off` \
                 nothing: no hand is on the wheel.";
        }
        optional {
            angle: Formula(Dimension::ANGLE), "Angle to which the hands turn the wheel, a signal or an expression of the time; `open_loop` needs it.";
            path: Text,
                "The path to follow: the name of a `[path.NAME]`, of a `[table.NAME]` that gives y by x, of what a manoeuvre steers, or an expression of \
                 `ahead`, the x of the point in view: `lane(ahead)`. `preview` needs it.";
            car: Element(&["vehicle"]), "The car that is driven, which `preview` needs.";
            gain: Formula(TURN), "Angle of the wheel for each metre that the car would be beside the path at the point in view (\"40 deg/m\"); \
                                  `preview` needs it.";
            preview: Quantity(Dimension::TIME, Sign::Positive) = "1 s", "How far ahead the driver looks.";
            reaction: Quantity(Dimension::TIME, Sign::NonNegative) = "0.15 s", "Time until what is seen moves the hands.";
            sample_time: Quantity(Dimension::TIME, Sign::Positive) = "10 ms", "How often the driver looks; `reaction` is a multiple of it.";
            lag: Quantity(Dimension::TIME, Sign::Positive) = "0.1 s", "Time constant of nerves and muscles; a steering robot has about \"5 ms\".";
            stiffness: Quantity(Dimension::STIFFNESS, Sign::Positive) = "60 N m/rad", "Stiffness of the arms; a steering robot has about \"5 kN m/rad\".";
            damping: Quantity(Dimension::DAMPING, Sign::NonNegative) = "3 N m s/rad", "Damping of the arms.";
            arm_inertia: Quantity(Dimension::INERTIA, Sign::Positive) = "0.08 kg m^2", "Inertia of the arms about the axis of the wheel.";
            grip_stiffness: Quantity(Dimension::STIFFNESS, Sign::Positive) = "1000 N m/rad", "Stiffness between hands and wheel.";
            grip_damping: Quantity(Dimension::DAMPING, Sign::NonNegative) = "2 N m s/rad", "Damping between hands and wheel.";
            hold: Number(Sign::NonNegative) = "1", "How firmly the hands hold: 1, and 0 for hands off in a variant.";
        }
    }
}

/// A driver at a steering wheel.
pub const DRIVER: Element = Element {
    keyword: Driver::KEYWORD,
    summary: "A driver: arms with inertia that hold the steering wheel at an angle, or follow a path with preview, reaction time and muscles.",
    sketch: r"
    angle, path --> [reaction, lag] --> stiffness, damping --> ( arm ) ==/\/\/\== wheel
                                                                     grip",
    signs: "Its parts are elements that others may name: the shaft `<name>_arm`, the torque `<name>_muscles` on it, and the spring `<name>_hands`, whose \
            `<name>_hands.tau` is the torque that the hands put on the wheel; blocks `<name>_will` (the angle that the arms are to have), with `preview` \
            `<name>_ahead` (x of the point in view), `<name>_target` (y of the path there) and `<name>_seen`.",
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

fn check(values: &Values) -> Vec<Mistake> {
    let kind = values.word("kind").unwrap_or_default();
    let mut out = Vec::new();
    let needed: &[(&'static str, &str)] = match kind {
        "open_loop" => &[("angle", "angle = \"20 deg * sin(2 pi t / 5 s)\"")],
        "preview" => &[("path", "path = \"lane\""), ("car", "car = \"car\""), ("gain", "gain = \"40 deg/m\"")],
        _ => &[],
    };
    for (key, example) in needed.iter().filter(|(key, _)| !values.has(key)) {
        let message = format!("a driver of the kind `{kind}` needs `{key}`");
        out.push(Mistake::new("kind", message, format!("add `{example}`")));
    }
    let idle: &[&'static str] = match kind {
        "open_loop" => &["path", "car", "gain"],
        "hands_off" => &["angle", "path", "car", "gain"],
        _ => &[],
    };
    for key in idle.iter().filter(|key| values.has(key)) {
        let message = format!("`{key}` says nothing for the kind `{kind}`");
        out.push(Mistake::new(key, message, "remove it, or choose another kind"));
    }
    out
}

/// A driver in the making: its name and what is given.
struct Person<'a> {
    name: &'a str,
    given: &'a Entries,
}

/// The tables that a driver is put together of; nothing while it lacks a key that it needs.
pub(super) fn parts(name: &str, given: &Entries) -> Option<Entries> {
    let driver = Person { name, given };
    let mut out = Entries::default();
    let (wheel, kind) = (driver.text("wheel")?, driver.text("kind")?);
    let reference = match kind.as_str() {
        "open_loop" => format!("({})", driver.formula("angle")?),
        "preview" => {
            driver.look(&mut out)?;
            let seen = quoted(driver.part("seen"));
            driver.formula("angle").map_or(seen.clone(), |angle| format!("({angle}) + {seen}"))
        }
        "hands_off" => return Some(out),
        _ => return None,
    };
    driver.arms(&mut out, &wheel, &reference);
    Some(out)
}

/// A name as expressions have it.
fn quoted(name: String) -> String {
    if name.contains('-') { format!("'{name}'") } else { name }
}

/// An expression with a word of it in other words.
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

impl Person<'_> {
    fn text(&self, key: &str) -> Option<String> {
        if let Some(Written::Text(text)) = self.given.get(key) { Some(text.clone()) } else { None }
    }

    /// An expression that is given.
    fn formula(&self, key: &str) -> Option<String> {
        match self.given.get(key)? {
            Written::Text(text) | Written::Number(text) => Some(text.clone()),
            Written::Quantity(value, dimension) => Some(crate::units::written_quantity(value, *dimension)),
            _ => None,
        }
    }

    /// A number of the driver, as others name it.
    fn own(&self, key: &str) -> String {
        quoted(format!("{}.{key}", self.name))
    }

    /// The name of a part.
    fn part(&self, part: &str) -> String {
        format!("{}_{part}", self.name)
    }

    fn add(&self, out: &mut Entries, group: &str, part: &str, keys: &[(&str, String)]) {
        let mut table = Entries::default();
        keys.iter().for_each(|(key, text)| table.set(key, Written::Text(text.clone())));
        out.table_mut(group).set(&self.part(part), Written::Table(table));
    }

    /// What is seen of the path, when it has got to the muscles.
    fn look(&self, out: &mut Entries) -> Option<()> {
        let (car, path, gain) = (self.text("car")?, self.text("path")?, self.formula("gain")?);
        let of = |word: &str| quoted(format!("{car}.{word}"));
        let [x, y, heading, u, v] = ["x", "y", "heading", "v_x", "v_y"].map(of);
        let (time, ahead) = (self.own("preview"), quoted(self.part("ahead")));
        let is_name = path.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-'));
        let wanted = if is_name { format!("{}({ahead})", quoted(path)) } else { with_word(&path, "ahead", &ahead) };
        let period = ("sample_time", self.own("sample_time"));
        let one = ("gain", "1".to_string());
        let kind = |kind: &str| ("kind", kind.to_string());
        let input = |text: String| ("input", text);
        self.add(
            out,
            "block",
            "ahead",
            &[kind("gain"), one.clone(), input(format!("{x} + {time} * {u}")), period.clone()],
        );
        self.add(out, "block", "target", &[kind("gain"), one.clone(), input(wanted), period.clone()]);
        let there = format!("{y} + {time} * ({u} * sin({heading}) + {v} * cos({heading}))");
        let beside = format!("({gain}) * ({} - ({there}))", quoted(self.part("target")));
        let at_once = self
            .formula("reaction")
            .is_some_and(|text| crate::units::parse_quantity(&text).is_ok_and(|(value, _)| value.is_zero()));
        let keys = match at_once {
            true => vec![kind("gain"), one, input(beside), period],
            false => vec![kind("delay"), ("time", self.own("reaction")), input(beside), period],
        };
        self.add(out, "block", "seen", &keys);
        Some(())
    }

    /// Muscles, arms and hands.
    fn arms(&self, out: &mut Entries, wheel: &str, reference: &str) {
        let (will, lag, arm) = (quoted(self.part("will")), self.own("lag"), self.part("arm"));
        let [stiffness, damping] = ["stiffness", "damping"].map(|key| self.own(key));
        let will_keys =
            [("kind", "low_pass".to_string()), ("input", reference.to_string()), ("time_constant", lag.clone())];
        self.add(out, "block", "will", &will_keys);
        self.add(out, "shaft", "arm", &[("inertia", self.own("arm_inertia"))]);
        let [phi, w] = ["phi", "w"].map(|word| quoted(format!("{arm}.{word}")));
        // The muscles damp what differs from the turning that is meant.
        let law = format!("{stiffness} * ({will} - {phi}) + {damping} * (({reference} - {will}) / {lag} - {w})");
        self.add(out, "torque", "muscles", &[("shaft", arm.clone()), ("law", law)]);
        let held = |key: &str| format!("{} * {}", self.own("hold"), self.own(key));
        let hands = [
            ("shaft_1", arm),
            ("shaft_2", wheel.to_string()),
            ("stiffness", held("grip_stiffness")),
            ("damping", held("grip_damping")),
        ];
        self.add(out, "spring_damper", "hands", &hands);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_replaced_whole() {
        assert_eq!(
            with_word("a * lane(ahead) + ahead.x - aheads", "ahead", "d_ahead"),
            "a * lane(d_ahead) + ahead.x - aheads"
        );
    }
}
