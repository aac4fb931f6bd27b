//! Expressions of coordinates, rates, parameters, the time and signals.

use std::sync::Arc;

use kardan_expr::expr::{Expr, Graph, Lookup, Named, OfTime};
use kardan_math::num::{Rational, rational_from_f64};
use kardan_math::units::{Dimension, Exact, Expression};

/// The meaning of a name in a [`Formula`].
#[derive(Debug, Clone, PartialEq)]
pub enum Meaning {
    /// A parameter.
    Constant(Exact, Dimension),
    /// A coordinate, by its name.
    Position(String),
    /// Its rate.
    Rate(String),
    /// The time.
    Time,
    /// A function of time.
    Signal(Arc<OfTime>),
    /// The output of a block, by its name: constant between samples.
    Block(String, Dimension),
    /// A table, which is called.
    Table(Arc<Lookup>),
    /// Another formula, shared with others.
    Shared(Arc<Formula>),
    /// Of a gear loss: the magnitude of the transmitted torque.
    Load(Dimension),
    /// Of a gear loss: the magnitude of its speed.
    Slip(Dimension),
}

/// An expression of coordinates, rates, parameters, the time and signals.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    /// As it is written.
    pub expression: Expression,
    /// The meaning of each name in it.
    pub names: Vec<(String, Meaning)>,
    /// Its dimension.
    pub dimension: Dimension,
}

impl Formula {
    /// The law of an element, with its names in order in place of each `@`, quoted by `'...'` where needed. A name that no
    /// expression can contain, as a rejected model may have, is replaced.
    ///
    /// # Panics
    /// If the text is not an expression of that many names.
    pub fn of(text: &str, names: Vec<(String, Meaning)>, dimension: Dimension) -> Arc<Self> {
        let expression_of = |names: &[(String, Meaning)], quote: &str| {
            let mut parts = text.split('@');
            let first = parts.next().unwrap_or_default().to_string();
            let name = |text: String, ((name, _), rest): (&(String, Meaning), &str)| {
                format!("{text}{quote}{name}{quote}{rest}")
            };
            let expression = Expression::parse_law(&names.iter().zip(parts).fold(first, name)).ok()?;
            names.iter().all(|(name, _)| expression.names().contains(&name.as_str())).then_some(expression)
        };
        let (expression, names) = match expression_of(&names, "").or_else(|| expression_of(&names, "'")) {
            Some(expression) => (expression, names),
            None => {
                let other = |(k, (_, meaning)): (usize, (String, Meaning))| (format!("name_{k}"), meaning);
                let names: Vec<(String, Meaning)> = names.into_iter().enumerate().map(other).collect();
                (expression_of(&names, "").expect("an expression of so many names"), names)
            }
        };
        Arc::new(Self { expression, names, dimension })
    }

    /// The meanings of the names in it and in its shared formulas; a formula that two of them share is listed two times.
    pub fn all_names(&self) -> Vec<(&str, &Meaning)> {
        let mut out = Vec::new();
        for (name, meaning) in &self.names {
            match meaning {
                Meaning::Shared(formula) => out.extend(formula.all_names()),
                meaning => out.push((name.as_str(), meaning)),
            }
        }
        out
    }

    /// Its shared formulas by their names, each after those that it uses; one that two of them share is listed two times.
    pub fn shared(&self) -> Vec<(&str, &Self)> {
        let mut out = Vec::new();
        for (name, meaning) in &self.names {
            if let Meaning::Shared(formula) = meaning {
                out.extend(formula.shared());
                out.push((name.as_str(), formula.as_ref()));
            }
        }
        out
    }

    /// The coordinates in it, by name.
    pub fn coordinates(&self) -> impl Iterator<Item = &str> {
        self.all_names().into_iter().filter_map(|(_, meaning)| match meaning {
            Meaning::Position(name) | Meaning::Rate(name) => Some(name.as_str()),
            _ => None,
        })
    }

    /// The blocks whose outputs it reads, by name.
    pub fn blocks(&self) -> impl Iterator<Item = &str> {
        self.all_names().into_iter().filter_map(|(_, meaning)| match meaning {
            Meaning::Block(name, _) => Some(name.as_str()),
            _ => None,
        })
    }

    /// Its value as a fraction, if it is constant.
    pub fn number(&self) -> Option<Rational> {
        let mut graph = Graph::default();
        let value = self.of_positions(&mut graph, &|_| None)?;
        graph.number_of(value).cloned()
    }

    /// Its expression in a graph, if it depends on positions alone; `dimension` of a coordinate, if that is allowed in it.
    pub fn of_positions(&self, graph: &mut Graph, dimension: &dyn Fn(&str) -> Option<Dimension>) -> Option<Expr> {
        self.expressed(graph, &|graph, meaning| match meaning {
            Meaning::Position(body) => dimension(body).map(|own| Named::Varying(graph.symbol(body, own), own)),
            _ => None,
        })
    }

    /// Its value at the start of a run, if only the time varies in it and the value is a fraction.
    pub fn at_begin(&self) -> Option<Rational> {
        let mut graph = Graph::default();
        let value = self.expressed(&mut graph, &|_, meaning| match meaning {
            Meaning::Time => Some(Named::Constant(Exact::from_integer(0), Dimension::TIME)),
            Meaning::Signal(function) => {
                let value = rational_from_f64(function.value(0.0))?;
                Some(Named::Constant(Exact::new(value, 0), function.dimension()))
            }
            _ => None,
        })?;
        graph.number_of(value).cloned()
    }

    /// Its expression in a graph; `varying` gives the expression of every name that is neither a parameter nor a table.
    fn expressed(&self, graph: &mut Graph, varying: &dyn Fn(&mut Graph, &Meaning) -> Option<Named>) -> Option<Expr> {
        let mut named =
            |graph: &mut Graph, name: &str| match self.names.iter().find(|(candidate, _)| candidate == name)? {
                (_, Meaning::Constant(value, dimension)) => Some(Named::Constant(value.clone(), *dimension)),
                (_, Meaning::Table(table)) => Some(Named::Table(Arc::clone(table))),
                (_, Meaning::Shared(formula)) => {
                    formula.expressed(graph, varying).map(|value| Named::Varying(value, formula.dimension))
                }
                (_, meaning) => varying(graph, meaning),
            };
        graph.lowered(&self.expression, &mut named).ok().map(|(value, _)| value)
    }

    /// Whether a number in it, or in a shared formula, is not a fraction times a power of π.
    pub fn is_rounded(&self) -> bool {
        let constant = |name: &str| match self.names.iter().find(|(candidate, _)| candidate == name)? {
            (_, Meaning::Constant(value, dimension)) => Some((value.clone(), *dimension)),
            _ => None,
        };
        self.expression.rounds(&constant) || self.shared().into_iter().any(|(_, formula)| formula.is_rounded())
    }

    /// Whether it depends on the time explicitly.
    pub fn is_of_time(&self) -> bool {
        let varies = |meaning: &Meaning| matches!(meaning, Meaning::Time | Meaning::Signal(_) | Meaning::Block(..));
        self.all_names().into_iter().any(|(_, meaning)| varies(meaning))
    }
}

/// Formulas by their coordinates.
pub type FormulaRow = Vec<(String, Arc<Formula>)>;
