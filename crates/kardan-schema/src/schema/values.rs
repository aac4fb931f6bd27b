//! The values of an element's keys.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::schema::ExactPole;
use kardan_expr::expr::OfTime;
use kardan_math::units::Exact;
use kardan_mechanics::equations::{Domain, Formula, FormulaRow};
use kardan_mechanics::program::Task;

/// A value of an element's key with parameters put in.
#[derive(Debug, Clone, PartialEq)]
pub enum Resolved {
    /// A name or a choice.
    Word(String),
    /// Names.
    Names(Vec<String>),
    /// A quantity or number, SI.
    Exact(Exact),
    /// Values by name.
    Map(Vec<(String, Exact)>),
    /// Coefficients by shaft or mass, and the dimension of their sum.
    Row(Vec<(String, Exact)>, Domain),
    /// Tables.
    Tables(Vec<Values>),
    /// Poles, 1/s.
    Poles(Vec<ExactPole>),
    /// An expression of coordinates and rates.
    Formula(Arc<Formula>),
    /// A function of time.
    OfTime(Arc<OfTime>),
    /// An expression of signals and blocks.
    Task(Arc<Task>),
    /// Expressions by shaft or mass, and the dimension of their sum with the rates.
    Formulas(FormulaRow),
}

/// The values of an element's keys, with parameters put in.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Values {
    map: BTreeMap<&'static str, Resolved>,
    /// Whether the element acts along masses.
    pub translational: bool,
    /// Defaults of omitted keys.
    defaults: BTreeMap<&'static str, Resolved>,
}

impl Values {
    /// Sets a key.
    pub fn insert(&mut self, key: &'static str, value: Resolved) {
        self.map.insert(key, value);
    }

    /// The default of a key.
    pub fn insert_default(&mut self, key: &'static str, value: Resolved) {
        self.defaults.insert(key, value);
    }

    /// The value of a key, or its default.
    fn get(&self, key: &str) -> Option<&Resolved> {
        self.map.get(key).or_else(|| self.defaults.get(key))
    }

    /// Gives each explicit number (not a default) the name `<element>.<key>`, or `<element>.<key>.<entry>`.
    pub fn name(&mut self, element: &str) {
        for (key, value) in &mut self.map {
            let name = |value: &mut Exact, name: String| *value = value.clone().named(name);
            match value {
                Resolved::Exact(value) => name(value, format!("{element}.{key}")),
                Resolved::Map(map) | Resolved::Row(map, _) => {
                    map.iter_mut().for_each(|(entry, value)| name(value, format!("{element}.{key}.{entry}")));
                }
                _ => {}
            }
        }
    }

    /// Removes a key.
    pub fn remove(&mut self, key: &str) {
        self.map.remove(key);
    }

    /// Whether the key has an explicit value.
    pub fn has(&self, key: &str) -> bool {
        self.map.contains_key(key)
    }

    /// A word.
    pub fn word(&self, key: &str) -> Option<&str> {
        if let Some(Resolved::Word(word)) = self.get(key) { Some(word) } else { None }
    }

    /// A list of words.
    pub fn names(&self, key: &str) -> Option<&[String]> {
        if let Some(Resolved::Names(names)) = self.get(key) { Some(names) } else { None }
    }

    /// A number.
    pub fn exact(&self, key: &str) -> Option<&Exact> {
        if let Some(Resolved::Exact(value)) = self.get(key) { Some(value) } else { None }
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
        if let Some(Resolved::Map(map) | Resolved::Row(map, _)) = self.get(key) { Some(map) } else { None }
    }

    /// The dimension of the sum of a coefficient row: an angle or a length.
    pub fn measure(&self, key: &str) -> Option<Domain> {
        if let Some(Resolved::Row(_, domain)) = self.get(key) { Some(*domain) } else { None }
    }

    /// An expression of coordinates and rates.
    pub fn formula(&self, key: &str) -> Option<&Arc<Formula>> {
        if let Some(Resolved::Formula(formula)) = self.get(key) { Some(formula) } else { None }
    }

    /// A function of time.
    pub fn of_time(&self, key: &str) -> Option<&Arc<OfTime>> {
        if let Some(Resolved::OfTime(function)) = self.get(key) { Some(function) } else { None }
    }

    /// An expression of signals and blocks.
    pub fn task(&self, key: &str) -> Option<&Arc<Task>> {
        if let Some(Resolved::Task(task)) = self.get(key) { Some(task) } else { None }
    }

    /// Expressions by shaft or mass, and the dimension of their sum with the rates.
    pub fn formulas(&self, key: &str) -> Option<&FormulaRow> {
        if let Some(Resolved::Formulas(row)) = self.get(key) { Some(row) } else { None }
    }

    /// A list of tables.
    pub fn tables(&self, key: &str) -> Option<&[Values]> {
        if let Some(Resolved::Tables(tables)) = self.get(key) { Some(tables) } else { None }
    }

    /// A single table.
    pub fn table(&self, key: &str) -> Option<&Values> {
        self.tables(key)?.first()
    }

    /// Poles, 1/s.
    pub fn poles(&self, key: &str) -> Option<&[ExactPole]> {
        if let Some(Resolved::Poles(poles)) = self.get(key) { Some(poles) } else { None }
    }

    /// A word that is required, or has a default.
    pub fn word_or_default(&self, key: &str) -> &str {
        self.word(key).unwrap_or_default()
    }

    /// The ratio of a gear; one if it is missing, which kardan has reported: the other checks still run, without a division
    /// by zero.
    pub fn ratio(&self) -> Exact {
        self.exact("ratio").cloned().unwrap_or_else(Exact::one)
    }
}
