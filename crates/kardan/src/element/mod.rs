//! Elements: named handfuls of terms, one file each.
//!
//! [`REGISTRY`] is the one list from which the parser, its checks, the manual (`kardan elements`) and the tests are
//! derived. Adding an element is one file here and one line there.

mod capacitor;
mod constraint;
mod disturbance;
mod gear;
mod harmonic_drive;
mod inductor;
mod motor;
mod planetary;
mod resistor;
mod sensor;
mod shaft;
mod spring_damper;
mod transformer;
mod universal_joint;
mod voltage_source;

use std::collections::BTreeMap;

pub use capacitor::Capacitor;
pub use constraint::Constraint;
pub use disturbance::Disturbance;
pub use gear::Gear;
pub use harmonic_drive::HarmonicDrive;
pub use inductor::Inductor;
pub use motor::Motor;
pub use planetary::Planetary;
pub use resistor::Resistor;
pub use sensor::Sensor;
pub use shaft::Shaft;
pub use spring_damper::SpringDamper;
pub use transformer::Transformer;
pub use universal_joint::{UniversalJoint, UniversalJointCurve};
pub use voltage_source::VoltageSource;

use crate::equations::{Direction, Stribeck, Term};
use crate::schema::{ExactPole, Field, Kind, Sign};
use crate::units::{Dimension, Exact};

/// The description of a kind of element.
#[derive(Debug, Clone, Copy)]
pub struct Element {
    /// The word in the model file, the name of the file here, and of the manual page.
    pub keyword: &'static str,
    /// What it is, in one sentence.
    pub summary: &'static str,
    /// Sketch with positive directions.
    pub sketch: &'static str,
    /// The sign convention in one sentence.
    pub signs: &'static str,
    /// Its keys.
    pub fields: &'static [Field],
    /// An example, valid TOML.
    pub example: &'static str,
    /// Checks that concern several keys at once: `(key, message, help)` for each mistake.
    pub check: fn(&Values) -> Vec<Mistake>,
    /// The terms it stands for.
    pub terms: fn(name: &str, values: &Values) -> Vec<Term>,
}

/// A mistake found by an element's own check.
#[derive(Debug, Clone, PartialEq)]
pub struct Mistake {
    /// The key to point at; the header if it is absent from the table.
    pub key: &'static str,
    /// What is wrong and why.
    pub message: String,
    /// What to do.
    pub help: String,
}

impl Mistake {
    fn new(key: &'static str, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { key, message: message.into(), help: help.into() }
    }
}

/// All kinds of elements.
pub const REGISTRY: &[Element] = &[
    shaft::SHAFT,
    harmonic_drive::HARMONIC_DRIVE,
    planetary::PLANETARY,
    gear::GEAR,
    spring_damper::SPRING_DAMPER,
    universal_joint::UNIVERSAL_JOINT,
    constraint::CONSTRAINT,
    motor::MOTOR,
    disturbance::DISTURBANCE,
    sensor::SENSOR,
    inductor::INDUCTOR,
    resistor::RESISTOR,
    capacitor::CAPACITOR,
    transformer::TRANSFORMER,
    voltage_source::VOLTAGE_SOURCE,
];

impl Element {
    /// The charges that an element of that name introduces as coordinates, whatever its values.
    pub fn charges(&self, name: &str) -> Vec<String> {
        let terms = (self.terms)(name, &Values::default());
        let charge = |term| if let Term::Charge { name } = term { Some(name) } else { None };
        terms.into_iter().filter_map(charge).collect()
    }

    /// Its keys that name nodes.
    pub fn node_keys(&self) -> impl Iterator<Item = &'static str> {
        self.fields.iter().filter(|field| field.kind == Kind::Node).map(|field| field.name)
    }
}

/// The kind with that keyword.
pub fn find(keyword: &str) -> Option<&'static Element> {
    REGISTRY.iter().find(|element| element.keyword == keyword)
}

/// A value of an element's key with parameters put in.
#[derive(Debug, Clone, PartialEq)]
pub enum Resolved {
    /// A name or a choice.
    Word(String),
    /// Names.
    Words(Vec<String>),
    /// A quantity or number, SI.
    Exact(Exact),
    /// Coefficients by shaft, or values by parameter.
    Map(Vec<(String, Exact)>),
    /// Tables.
    Tables(Vec<Values>),
    /// Poles, 1/s.
    Poles(Vec<ExactPole>),
}

/// The values of an element's keys, with parameters put in.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Values {
    map: BTreeMap<&'static str, Resolved>,
    /// What holds for keys that are left out.
    defaults: BTreeMap<&'static str, Resolved>,
}

impl Values {
    /// Sets a key.
    pub fn insert(&mut self, key: &'static str, value: Resolved) {
        self.map.insert(key, value);
    }

    /// What holds for a key if it is left out.
    pub fn insert_default(&mut self, key: &'static str, value: Resolved) {
        self.defaults.insert(key, value);
    }

    /// What is given for a key, or its default.
    fn get(&self, key: &str) -> Option<&Resolved> {
        self.map.get(key).or_else(|| self.defaults.get(key))
    }

    /// Takes a key away.
    pub fn remove(&mut self, key: &str) {
        self.map.remove(key);
    }

    /// Whether the key is there, and not its default.
    pub fn has(&self, key: &str) -> bool {
        self.map.contains_key(key)
    }

    /// A word.
    pub fn word(&self, key: &str) -> Option<&str> {
        match self.get(key) {
            Some(Resolved::Word(word)) => Some(word),
            _ => None,
        }
    }

    /// A list of words.
    pub fn words(&self, key: &str) -> Option<&[String]> {
        match self.get(key) {
            Some(Resolved::Words(words)) => Some(words),
            _ => None,
        }
    }

    /// A number.
    pub fn exact(&self, key: &str) -> Option<&Exact> {
        match self.get(key) {
            Some(Resolved::Exact(value)) => Some(value),
            _ => None,
        }
    }

    /// A number, or its default; zero where it has none.
    pub fn exact_or_default(&self, key: &str) -> Exact {
        self.exact(key).cloned().unwrap_or_else(Exact::zero)
    }

    /// A number as `f64`.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.exact(key).map(Exact::to_f64)
    }

    /// The same as `f64`.
    pub fn number_or_default(&self, key: &str) -> f64 {
        self.number(key).unwrap_or_default()
    }

    /// Coefficients by shaft.
    pub fn map(&self, key: &str) -> Option<&[(String, Exact)]> {
        match self.get(key) {
            Some(Resolved::Map(map)) => Some(map),
            _ => None,
        }
    }

    /// A list of tables.
    pub fn tables(&self, key: &str) -> Option<&[Values]> {
        match self.get(key) {
            Some(Resolved::Tables(tables)) => Some(tables),
            _ => None,
        }
    }

    /// A single table.
    pub fn table(&self, key: &str) -> Option<&Values> {
        self.tables(key)?.first()
    }

    /// Poles, 1/s.
    pub fn poles(&self, key: &str) -> Option<&[ExactPole]> {
        match self.get(key) {
            Some(Resolved::Poles(poles)) => Some(poles),
            _ => None,
        }
    }

    /// A word that is required, or has a default.
    pub fn word_or_default(&self, key: &str) -> &str {
        self.word(key).unwrap_or_default()
    }
}

/// The ratio of a gear; one where it is missing, which was told: the rest is looked at all the same, and nothing is divided by zero.
fn ratio(values: &Values) -> Exact {
    values.exact("ratio").cloned().unwrap_or_else(Exact::one)
}

fn no_check(_: &Values) -> Vec<Mistake> {
    Vec::new()
}

const FROM: Field = Field::required("from", Kind::Node, "The node that a positive current leaves.");
const TO: Field = Field::required("to", Kind::Node, "The node that a positive current enters; `ground` is at 0 V.");

/// A branch of a circuit: its charge, and the charge's share in the balances of the nodes at both ends.
fn branch(charge: &str, values: &Values, [from, to]: [&str; 2]) -> Vec<Term> {
    let share = |key: &str, sign: i64| {
        let along = Direction { entries: vec![(charge.to_string(), Exact::from_integer(sign))] };
        values.word(key).map(|node| Term::Balance { node: node.into(), along })
    };
    let declared = Term::Charge { name: charge.to_string() };
    std::iter::once(declared).chain(share(from, 1)).chain(share(to, -1)).collect()
}

/// The ends of a branch must be two nodes.
fn check_branch(values: &Values) -> Vec<Mistake> {
    check_ends(values, ["from", "to"])
}

fn check_ends(values: &Values, [from, to]: [&'static str; 2]) -> Vec<Mistake> {
    if values.word(from).is_none() || values.word(from) != values.word(to) {
        return Vec::new();
    }
    let message =
        format!("both ends are the node `{}`, so it has no part in the circuit", values.word_or_default(from));
    vec![Mistake::new(to, message, "name two different nodes")]
}

/// Damper and friction along a direction, if they are given and not zero.
fn losses(along: &Direction, values: &Values) -> Vec<Term> {
    let mut out = Vec::new();
    if let Some(damping) = values.exact("damping").filter(|x| !x.is_zero()) {
        out.push(Term::Damper { along: along.clone(), damping: damping.clone() });
    }
    let torque = values.exact_or_default("friction");
    let stribeck = match (values.exact("breakaway"), values.exact("stribeck_speed")) {
        (Some(breakaway), Some(speed)) => Some(Stribeck { breakaway: breakaway.clone(), speed: speed.clone() }),
        _ => None,
    };
    if !torque.is_zero() || stribeck.as_ref().is_some_and(|stribeck| !stribeck.breakaway.is_zero()) {
        out.push(Term::Friction { along: along.clone(), torque, stribeck });
    }
    out
}

const BREAKAWAY: Field = Field::optional(
    "breakaway",
    Kind::Quantity(Dimension::TORQUE, Sign::NonNegative),
    "Torque at which it breaks away from rest, not below `friction`; in motion the friction falls from it as \
     friction + (breakaway - friction) exp(-(w/stribeck_speed)^2). Only runs know it, designs leave friction out. Left out: \
     equal to `friction`.",
);
const STRIBECK_SPEED: Field = Field::optional(
    "stribeck_speed",
    Kind::Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive),
    "Speed with which the friction falls from `breakaway`; needed with it.",
);

/// What is wrong with the keys of [`losses`].
fn check_losses(values: &Values) -> Vec<Mistake> {
    let mut out = Vec::new();
    match (values.exact("breakaway"), values.has("stribeck_speed")) {
        (None, false) => return out,
        (Some(_), false) => out.push(Mistake::new(
            "breakaway",
            "a breakaway torque needs the speed with which the friction falls from it",
            "add `stribeck_speed`, such as \"0.1 rad/s\"",
        )),
        (None, true) => out.push(Mistake::new(
            "stribeck_speed",
            "it says how fast the friction falls from a breakaway torque, and there is none",
            "add `breakaway`, or remove it",
        )),
        (Some(_), true) => {}
    }
    let (friction, breakaway) = (values.exact_or_default("friction"), values.exact("breakaway"));
    if let Some(breakaway) = breakaway.filter(|breakaway| breakaway.to_rational() < friction.to_rational()) {
        let message =
            format!("the breakaway torque {} N m is below the friction {} N m", breakaway.to_f64(), friction.to_f64());
        out.push(Mistake::new(
            "breakaway",
            message,
            "friction holds at rest at least what it does in motion: raise it",
        ));
    }
    out
}
