//! Speeds, frictions and loads of a car in expressions.

use super::composite::Composite;
use kardan_math::units::parse_number;

/// Lower limit of a friction that becomes zero or negative in a run.
const LEAST_FRICTION: &str = "0.001";

impl Composite<'_> {
    /// Whether its tyre forces are limited, and its wheel angles exact.
    pub(in crate::element) fn slides(&self) -> bool {
        matches!(self.entries.text("tyre"), Some("magic_formula" | "tmeasy"))
    }

    /// Whether its tyres are those of TMeasy.
    pub(in crate::element) fn tmeasy(&self) -> bool {
        self.entries.text("tyre") == Some("tmeasy")
    }

    pub(in crate::element) fn speed(&self) -> String {
        self.formula("speed").unwrap_or_else(|| "0 m/s".into())
    }

    /// Whether it rolls.
    pub(in crate::element) fn rolls(&self) -> bool {
        self.has("roll_stiffness")
    }

    /// Height of the centre of gravity above the roll axis.
    pub(in crate::element) fn roll_arm(&self) -> String {
        format!("({} - {})", self.own("height"), self.own("roll_height"))
    }

    /// Lateral velocity of the roll axis, under the centre of gravity.
    pub(in crate::element) fn at_axis(&self) -> String {
        let v = self.of("lateral", "v");
        if self.rolls() { format!("({v} + {} * {})", self.roll_arm(), self.of("roll", "w")) } else { v }
    }

    /// The friction of an axle.
    pub(in crate::element) fn friction(&self, axle: &str) -> String {
        if self.has("mu_left") {
            let [left, right] = ["left", "right"].map(|side| self.friction_of(axle, side));
            return format!("(({left} + {right}) / 2)");
        }
        let rear = if axle == "rear" { self.grip("mu_rear") } else { None };
        rear.or_else(|| self.grip("mu")).unwrap_or_else(|| "1".into())
    }

    /// The friction of a key; a run limits it below by `LEAST_FRICTION`.
    fn grip(&self, key: &str) -> Option<String> {
        self.formula(key).map(|text| if self.varies(key) { format!("max({LEAST_FRICTION}, {text})") } else { text })
    }

    /// Whether a numeric key has an expression, which may change in a run.
    fn varies(&self, key: &str) -> bool {
        self.entries.text(key).is_some_and(|text| parse_number(text).is_err())
    }

    /// Signals of the frictions that may change, for blocks and runs.
    pub(in crate::element) fn frictions(&self) -> Vec<(&'static str, String)> {
        let keys = [
            ("mu", "friction"),
            ("mu_rear", "friction_rear"),
            ("mu_left", "friction_left"),
            ("mu_right", "friction_right"),
        ];
        let entries = keys.into_iter().filter(|(key, _)| self.varies(key));
        entries.filter_map(|(key, name)| Some((name, self.formula(key)?))).collect()
    }

    /// The friction of a wheel.
    pub(in crate::element) fn friction_of(&self, axle: &str, side: &str) -> String {
        match self.grip(&format!("mu_{side}")) {
            Some(own) => own,
            None if self.has("mu_left") || self.has("mu_right") => "1".into(),
            None => self.friction(axle),
        }
    }

    /// The load of an axle at rest, N.
    pub(in crate::element) fn load(&self, axle: &str) -> String {
        let [a, b] = [self.own("front_axle"), self.own("rear_axle")];
        let far_axle = if axle == "front" { &b } else { &a };
        format!("({} * 9.80665 m/s^2 * {far_axle} / ({a} + {b}))", self.own("mass"))
    }
}
