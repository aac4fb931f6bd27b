//! The description of a kind of manoeuvre, and the tables that it expands to.

use crate::element::quoted;
use kardan_math::units::Dimension;
use kardan_schema::entries::Entries;
use kardan_schema::schema::{Sign, keys};

keys! {
    /// `[manoeuvre.<name>]`.
    table Manoeuvre {
        required {
            kind: Choice(KINDS), "The kind of manoeuvre; its list shows its other keys and their defaults.";
        }
        optional {
            steering_signal: Name,
                "The signal that it generates for a driver: the angle of the wheel, left out: `steer`; of a double lane change the path, left out: \
                 `lane`. Manoeuvres may share one: each variant uses that of its own manoeuvre.";
            car: Element(&["vehicle"]), "The car; left out: the one of the model.";
            wheel: Shaft, "The steering wheel, whose angle is measured; left out: that of the driver.";
            torque: Signal, "The steering torque that is measured, a signal or an expression; left out: that of the driver's hands.";
            set: Overrides, "Parameter values of the variants that drive it, such as the speed: { pace = \"80 km/h\" }.";
            duration: Quantity(Dimension::TIME, Sign::Positive), "Length of the run.";
            evaluate: Choice(&["yes", "no"]) = "yes", "Whether its figures and criteria are used.";
            amplitude: Quantity(Dimension::ANGLE, Sign::NonZero), "Angle of the steering wheel, to the left where positive.";
            start: AnyQuantity, "When it begins (of a double lane change: x where the first lane begins).";
            frequency: Quantity(Dimension::FREQUENCY, Sign::Positive), "Frequency.";
            rate: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive), "Rate of the steering wheel angle.";
            over: Quantity(Dimension::TIME, Sign::Positive), "Time until the wheel reaches its angle.";
            dwell: Quantity(Dimension::TIME, Sign::NonNegative), "How long the wheel stays at its second peak.";
            periods: Number(Sign::Positive), "Whole periods that are evaluated, the last ones.";
            width: Quantity(Dimension::LENGTH, Sign::Positive), "Width of the car, which defines the lane widths.";
            offset: Quantity(Dimension::LENGTH, Sign::Positive), "Lateral offset of the second lane.";
            side: Choice(&["left", "right"]), "The side of that lane.";
            speed: Quantity(Dimension::VELOCITY, Sign::Positive), "Initial speed of the braking, which must be that of the car.";
            deceleration: Quantity(Dimension::ACCELERATION, Sign::Positive), "Deceleration.";
            braking_signal: Name, "The signal of the braking force that it generates, for `braking` of the car; left out: `braking`.";
            speed_reduction_signal: Name, "The signal of the speed reduction, for `speed` of the car; left out: `slowed`.";
            closed_loop: Choice(&["yes", "no"]),
                "Whether a driver with a path steers the car straight ahead, along the signal of `steering_signal` (left out: `lane`); else the wheel stays \
                 straight.";
            steering_angle: Text, "The angle of the wheel as an expression of the time and signals.";
        }
    }
}

/// The keywords of the registry; a test keeps them equal.
const KINDS: &[&str] = &[
    "steady_circle",
    "step_steer",
    "sine_steer",
    "weave",
    "double_lane_change",
    "obstacle_avoidance",
    "sine_with_dwell",
    "split_braking",
    "parking",
    "free",
];

/// The description of a kind of manoeuvre.
#[derive(Debug, Clone, Copy)]
pub struct ManoeuvreKind {
    /// The word after `kind =`, and the name of the file here.
    pub keyword: &'static str,
    /// Summary in one sentence.
    pub summary: &'static str,
    /// Text on its figures and criteria.
    pub measures: &'static str,
    /// Its keys besides the common ones.
    pub keys: &'static [(&'static str, Need)],
    /// Writes its tables.
    pub write: fn(&ManoeuvreSpec<'_>, &mut Made),
}

/// Whether a key is needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// Required.
    Required,
    /// Optional.
    Optional,
    /// Optional, with this default.
    Default(&'static str),
}

/// Keys of all kinds.
pub const COMMON: [&str; 7] = ["kind", "steering_signal", "car", "wheel", "torque", "set", "evaluate"];

/// The input of a manoeuvre.
pub struct ManoeuvreSpec<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its kind.
    pub kind: &'static ManoeuvreKind,
    /// Its keys.
    pub keys: &'a Entries,
    /// The car.
    pub car: Option<String>,
    /// The steering wheel.
    pub wheel: Option<String>,
    /// The steering torque.
    pub torque: Option<String>,
}

/// Cones that the car must have passed before a figure is valid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cones {
    /// The manoeuvre.
    pub manoeuvre: String,
    /// The figure.
    pub figure: String,
    /// Position of the car, an expression of its signals: x of its rear axle.
    pub reached: String,
    /// Position of the last cones, an expression of parameters.
    pub end: String,
}

/// The expansion of a manoeuvre.
#[derive(Debug, Clone, Default)]
pub struct Made {
    /// Tables by their groups and names.
    pub tables: Vec<(&'static str, String, Entries)>,
    /// The angle of the wheel, an expression.
    pub angle: Option<String>,
    /// The path, an expression of `ahead`.
    pub path: Option<String>,
    /// Its effects on the car: signals that manoeuvres share, by their names, with the name of its own part.
    pub shared: Vec<(String, String)>,
    /// Figures.
    pub figures: Vec<Entries>,
    /// Criteria.
    pub requirements: Vec<Entries>,
    /// The length of its run, an expression.
    pub duration: Option<String>,
    /// Its cones.
    pub cones: Option<Cones>,
}

impl ManoeuvreSpec<'_> {
    /// A value as an expression: the given one, or its default.
    pub fn value(&self, key: &str) -> Option<String> {
        match self.keys.get(key) {
            Some(value) => value.factor(),
            None => self.kind.keys.iter().find(|(name, _)| *name == key).and_then(|(_, need)| match need {
                Need::Default(text) => Some(format!("({text})")),
                _ => None,
            }),
        }
    }

    /// The same; empty if there is none, which the reader of the keys reports.
    pub fn text(&self, key: &str) -> String {
        self.value(key).unwrap_or_default()
    }

    /// The word of a key.
    pub fn word(&self, key: &str) -> Option<&str> {
        self.keys.text(key)
    }

    /// The name of one of its parts.
    pub fn own(&self, part: &str) -> String {
        format!("{}_{part}", self.name)
    }

    /// A signal of the car.
    pub fn of_car(&self, word: &str) -> String {
        quoted(&format!("{}.{word}", self.car.as_deref().unwrap_or("car")))
    }
}

impl Made {
    /// Adds a figure: the name after that of the manoeuvre, and its keys.
    pub fn figure(&mut self, spec: &ManoeuvreSpec<'_>, name: &str, keys: &[(&str, &str)]) {
        let own = spec.own(name);
        self.figures.push(Entries::of_texts([&[("name", own.as_str())][..], keys].concat()));
    }

    /// Adds a criterion: a figure of the manoeuvre with a bound.
    pub fn criterion(&mut self, spec: &ManoeuvreSpec<'_>, figure: &str, bound: (&str, &str)) {
        let own = spec.own(figure);
        self.requirements.push(Entries::of_texts([("figure", own.as_str()), bound]));
    }

    /// Adds a signal that manoeuvres share, by the key that names it and its default name, with its own part.
    pub fn share(&mut self, spec: &ManoeuvreSpec<'_>, (key, usual): (&str, &str), keys: &[(&str, &str)]) {
        let name = spec.own(usual);
        self.tables.push(("signal", name.clone(), Entries::of_texts(keys.iter().copied())));
        self.shared.push((spec.word(key).unwrap_or(usual).to_string(), quoted(&name)));
    }

    /// Adds the angle of the wheel as a signal, with these keys and those that it has in common with the manoeuvre.
    pub fn steer(&mut self, spec: &ManoeuvreSpec<'_>, keys: &[(&str, &str)], common: &[&str]) {
        let name = spec.own("steer");
        let common = common.iter().map(|key| (*key, spec.text(key)));
        let keys = keys.iter().map(|(key, text)| (*key, (*text).to_string())).chain(common);
        self.tables.push(("signal", name.clone(), Entries::of_texts(keys)));
        self.angle = Some(quoted(&name));
    }
}
