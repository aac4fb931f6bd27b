//! Elements: named handfuls of terms, one file each.
//!
//! [`REGISTRY`] is the one list from which the parser, its checks, the manual (`kardan elements`) and the tests are
//! derived. Adding an element is one file here and one line there.

mod constraint;
mod disturbance;
mod gear;
mod harmonic_drive;
mod motor;
mod planetary;
mod sensor;
mod shaft;
mod spring_damper;
mod universal_joint;

use std::collections::BTreeMap;

pub use universal_joint::UniversalJointCurve;

use crate::equations::{Direction, Term};
use crate::schema::Field;
use crate::units::Exact;

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
];

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
}

/// The values of an element's keys, with parameters put in.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Values {
    map: BTreeMap<&'static str, Resolved>,
}

impl Values {
    /// Sets a key.
    pub fn insert(&mut self, key: &'static str, value: Resolved) {
        self.map.insert(key, value);
    }

    /// Whether the key is there.
    pub fn has(&self, key: &str) -> bool {
        self.map.contains_key(key)
    }

    /// A word.
    pub fn word(&self, key: &str) -> Option<&str> {
        match self.map.get(key) {
            Some(Resolved::Word(word)) => Some(word),
            _ => None,
        }
    }

    /// A list of words.
    pub fn words(&self, key: &str) -> Option<&[String]> {
        match self.map.get(key) {
            Some(Resolved::Words(words)) => Some(words),
            _ => None,
        }
    }

    /// A number.
    pub fn exact(&self, key: &str) -> Option<&Exact> {
        match self.map.get(key) {
            Some(Resolved::Exact(value)) => Some(value),
            _ => None,
        }
    }

    /// A number, or zero.
    pub fn exact_or_zero(&self, key: &str) -> Exact {
        self.exact(key).cloned().unwrap_or_else(Exact::zero)
    }

    /// A number as `f64`.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.exact(key).map(Exact::to_f64)
    }

    /// Coefficients by shaft.
    pub fn map(&self, key: &str) -> Option<&[(String, Exact)]> {
        match self.map.get(key) {
            Some(Resolved::Map(map)) => Some(map),
            _ => None,
        }
    }

    /// A list of tables.
    pub fn tables(&self, key: &str) -> Option<&[Values]> {
        match self.map.get(key) {
            Some(Resolved::Tables(tables)) => Some(tables),
            _ => None,
        }
    }

    /// A required word. The parser has seen to it that it is there.
    fn required(&self, key: &str) -> &str {
        self.word(key).unwrap_or_default()
    }
}

fn no_check(_: &Values) -> Vec<Mistake> {
    Vec::new()
}

/// Damper and friction along a direction, if they are given and not zero.
fn losses(along: &Direction, values: &Values) -> Vec<Term> {
    let mut out = Vec::new();
    if let Some(damping) = values.exact("damping").filter(|x| !x.is_zero()) {
        out.push(Term::Damper { along: along.clone(), damping: damping.clone() });
    }
    if let Some(torque) = values.exact("friction").filter(|x| !x.is_zero()) {
        out.push(Term::Friction { along: along.clone(), torque: torque.clone() });
    }
    out
}
