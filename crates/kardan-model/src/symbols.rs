//! The terms of a model with the names of their values.

use std::collections::BTreeMap;

use super::document::{Document, Instance, Setting};
use super::functions::Functions;
use super::resolve::element_values;
use super::table_reader::TableReader;
use kardan_math::units::{Dimension, Exact, Expression};
use kardan_mechanics::equations::{self, Domain, InputKind, NamedTerm, Term};
use kardan_mechanics::symbolic::{FunctionSource, Meaning, TimeFunction};
use kardan_schema::schema::{Kind, Scalar, Value, Values};

/// A value that equations in symbols may name.
#[derive(Debug, Clone)]
pub struct SymbolValue {
    /// Its value, SI.
    pub value: Exact,
    /// Its dimension.
    pub dimension: Dimension,
    /// How it is computed from other parameters, if it is.
    pub follows: Option<String>,
}

/// Terms whose values have names: parameters, and `<element>.<key>`.
#[derive(Debug, Clone, Default)]
pub struct NamedTerms {
    /// The terms.
    pub terms: Vec<NamedTerm>,
    /// The meanings of the names of element values; parameters mean themselves.
    pub meanings: BTreeMap<String, Meaning>,
    /// All values by name.
    pub values: BTreeMap<String, SymbolValue>,
    /// Torques given by expressions, by element: they are inputs among the terms.
    pub laws: Vec<(String, String)>,
    /// Prescribed functions of constraints, by element; and their source text.
    pub functions: BTreeMap<String, TimeFunction>,
    /// Numbers that laws of torque name, as they are written.
    pub named_in_laws: Vec<(String, Exact, Dimension)>,
    /// Parameters that the elements use.
    pub used: Vec<String>,
}

/// The symbol of a function without an expression.
const EVENTS: &str = "as the events of the run set it";

impl Document {
    /// The terms of the model for the settings with the names of their values; of a model without errors.
    pub fn named_terms(&self, settings: &[Setting]) -> NamedTerms {
        let (reader, mut out) = (TableReader::new(self, settings), NamedTerms::default());
        let mut functions = Functions::of_scenario(&reader, self);
        for instance in &self.elements {
            let (mut values, _) = element_values(instance, (&reader, &mut functions), &mut Vec::new());
            out.read(instance, &reader);
            for field in instance.kind.fields {
                let dimension = match field.kind.for_translation(instance.table.translational) {
                    Kind::Quantity(dimension, _) => dimension,
                    _ => Dimension::NONE,
                };
                if let Some(value) = values.exact(field.name).cloned() {
                    let symbol_value = SymbolValue { value, dimension, follows: None };
                    out.values.insert(format!("{}.{}", instance.name, field.name), symbol_value);
                }
            }
            values.name(&instance.name);
            let own = self.terms_of(instance, &values);
            if own.iter().any(|term| matches!(term, Term::Moving(_) | Term::MultiplierLaw(_))) {
                out.prescribed(instance, self, &values, &own);
            }
            for term in own {
                let element = instance.name.clone();
                // A law has a separate line; in the equations it is an input.
                let named = match term {
                    Term::Torque { direction, law } => {
                        let of_charge = instance.kind.node_keys().next().is_some();
                        let own = direction.entries.first().is_some_and(|(coordinate, _)| *coordinate == element);
                        let element = match (of_charge, own) {
                            (true, true) => format!("{element}_emf"),
                            (true, false) => format!("{element}_torque"),
                            (false, true) if instance.body() == Some(Domain::Number) => format!("{element}_rate"),
                            _ => element,
                        };
                        out.named_in_laws.extend(constants(&law));
                        for (name, shared) in law.shared() {
                            if out.laws.iter().all(|(candidate, _)| candidate != name) {
                                out.laws.push((name.to_string(), shared.expression.text().to_string()));
                            }
                        }
                        out.laws.push((element.clone(), law.expression.text().to_string()));
                        NamedTerm { element, term: Term::Input { direction, kind: InputKind::Disturbance } }
                    }
                    term => NamedTerm { element, term },
                };
                out.terms.push(named);
            }
        }
        for parameter in &self.parameters {
            let Some((value, dimension)) = reader.exact_value(&parameter.name) else { continue };
            let set = settings.iter().any(|setting| setting.name == parameter.name);
            let follows = parameter.expression.as_ref().filter(|_| !set).map(|one| one.text().to_string());
            out.values.insert(parameter.name.clone(), SymbolValue { value, dimension, follows });
        }
        out
    }
}

/// The numbers that a formula names.
pub fn constants(formula: &equations::Formula) -> impl Iterator<Item = (String, Exact, Dimension)> {
    formula.all_names().into_iter().filter_map(|(name, meaning)| match meaning {
        equations::Meaning::Constant(value, dimension) => Some((name.to_string(), value.clone(), *dimension)),
        _ => None,
    })
}

impl NamedTerms {
    /// The prescribed function of a constraint, with names; and the names in formulas of multiplier constraints.
    fn prescribed(&mut self, instance: &Instance, document: &Document, values: &Values, terms: &[Term]) {
        let formulas = terms.iter().filter_map(|term| match term {
            Term::MultiplierLaw(law) => Some(law.formulas()),
            _ => None,
        });
        let names = formulas.flatten().flat_map(|formula| &formula.names);
        let parameters = names.filter(|(_, meaning)| matches!(meaning, equations::Meaning::Constant(..)));
        self.used.extend(parameters.map(|(name, _)| name.clone()));
        let moving = terms.iter().any(|term| matches!(term, Term::Moving(_)));
        for field in instance.kind.fields {
            let Kind::OfTime(dimension) = field.kind.for_translation(instance.table.translational) else { continue };
            let read = instance.table.values.get(field.name).and_then(|source| match &source.value {
                Value::Scalar(scalar) => document.function_of_time(scalar),
                _ => None,
            });
            let closed = |read: &Expression| {
                let is_signal = |name: &str| document.signals.has(name);
                read.tables().is_empty() && !read.names().into_iter().any(is_signal)
            };
            let source = match (values.of_time(field.name), read) {
                (Some(_), Some(read)) if closed(&read) => FunctionSource::Formula(read),
                (Some(_), Some(read)) => {
                    let text = read.text();
                    let unquoted = text.strip_prefix('\'').and_then(|rest| rest.strip_suffix('\''));
                    FunctionSource::Text(unquoted.filter(|name| !name.contains('\'')).unwrap_or(text).to_string())
                }
                (Some(_), None) => FunctionSource::Text(EVENTS.to_string()),
                (None, _) => match values.exact(field.name) {
                    Some(value) => FunctionSource::Exact(value.clone()),
                    None => continue,
                },
            };
            if let FunctionSource::Formula(read) = &source {
                self.used.extend(read.names().into_iter().filter(|name| *name != "t").map(str::to_string));
            }
            let rate = dimension == Dimension::CURRENT && moving;
            self.functions.insert(instance.name.clone(), TimeFunction { source, rate });
        }
    }

    /// The values of an element.
    fn read(&mut self, instance: &Instance, reader: &TableReader<'_>) {
        for (key, entry) in &instance.table.values {
            let name = format!("{}.{key}", instance.name);
            match &entry.value {
                Value::Scalar(scalar) => self.mean(name, scalar, false, reader),
                Value::Map(entries) => {
                    for (entry, scalar) in entries {
                        self.mean(format!("{name}.{}", entry.value), &scalar.value, true, reader);
                    }
                }
                _ => {}
            }
        }
    }

    /// An explicit number in a row of coefficients, and zero, remain numbers.
    fn mean(&mut self, name: String, scalar: &Scalar, in_row: bool, reader: &TableReader<'_>) {
        let number =
            |value: &Exact| if in_row || value.is_zero() { Meaning::Number(value.clone()) } else { Meaning::Value };
        let meaning = match scalar {
            Scalar::Literal(value, _) => number(value),
            Scalar::Tolerated(read) => number(&read.value),
            Scalar::Parameter(other) if *other == name => {
                let zero = reader.exact_value(other).is_some_and(|(value, _)| value.is_zero());
                if zero { Meaning::Number(Exact::zero()) } else { Meaning::Value }
            }
            Scalar::Parameter(other) => match Expression::parse(&format!("'{other}'")) {
                Ok(read) => {
                    self.used.push(other.clone());
                    Meaning::Formula(read)
                }
                Err(_) => Meaning::Value,
            },
            Scalar::Expression(expression) => {
                self.used.extend(expression.names().into_iter().map(str::to_string));
                Meaning::Formula((**expression).clone())
            }
        };
        self.meanings.insert(name, meaning);
    }
}
