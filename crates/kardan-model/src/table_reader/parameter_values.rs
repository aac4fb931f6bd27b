//! Values of scalars: literals, parameters and expressions of them, with dimension and sign.

use std::collections::HashMap;

use crate::document::{Parameter, Setting};
use crate::keys::expression_diagnostic;
use crate::parameters::fitting;
use kardan_math::units::{Dimension, Exact, Expression, UnitError};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Placed, SHORTEST_PERIOD, Scalar, Sign};

use super::{Found, Rounded, TableReader, guess};

impl<'a> TableReader<'a> {
    pub(super) fn parameter(&self, name: &str) -> Option<&Found<'a>> {
        let all = self.parameters.get_or_init(|| {
            let mut all: HashMap<&str, Found<'a>> = HashMap::new();
            let mut settings: HashMap<&str, &Setting> = HashMap::new();
            for setting in self.settings {
                settings.entry(&setting.name).or_insert(setting);
            }
            // Each follows its dependencies.
            for declared in self.document.in_order() {
                let name = declared.name.as_str();
                let set = settings.get(name);
                let mut exact = true;
                let value = match (set, &declared.expression) {
                    (Some(set), _) => Ok(set.value.clone()),
                    (None, Some(expression)) => {
                        let exact_of = |name: &str| exact_of(all.get(name)?);
                        expression.evaluate(&exact_of).map(|found| {
                            exact = found.exact;
                            fitting(&found, declared.dimension).map_or(found.value, |(value, _)| value)
                        })
                    }
                    _ => Ok(declared.value.clone()),
                };
                all.entry(name).or_insert(Found { declared, value, exact });
            }
            all
        });
        all.get(name)
    }

    /// The value of a parameter for the settings, in SI units; `None` if it has none.
    pub(crate) fn parameter_value(&self, name: &str) -> Option<f64> {
        self.parameter(name)?.value.as_ref().ok().map(Exact::to_f64)
    }

    /// The value of a parameter for the settings, and its dimension; `None`: there is no such parameter. An error in its own expression
    /// is reported, and it has no value.
    pub(crate) fn value_of(&self, name: &str, out: &mut Vec<Diagnostic>) -> Option<Option<(Exact, Dimension)>> {
        let found = self.parameter(name)?;
        if let Err(error) = &found.value {
            self.not_computed(found.declared, error, out);
        }
        Some(exact_of(found))
    }

    /// The value of a name in an expression, for the settings.
    pub fn exact_value(&self, name: &str) -> Option<(Exact, Dimension)> {
        exact_of(self.parameter(name)?)
    }

    /// The value of an expression at a place.
    fn evaluate(
        &self,
        expression: &Expression,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Exact, Dimension)> {
        let names = expression.names();
        for name in &names {
            match self.parameter(name) {
                Some(Found { declared, value: Err(error), .. }) => {
                    self.not_computed(declared, error, out);
                    return None;
                }
                None if self.document.suppressed.has_key(name) => return None,
                _ => {}
            }
        }
        match expression.evaluate(&|name| exact_of(self.parameter(name)?)) {
            Ok(found) => {
                if !found.exact {
                    let (text, unit) = (expression.text().to_string(), found.dimension.si());
                    let one = Rounded { what: what.to_string(), text, value: found.value.to_f64(), unit };
                    self.rounded.borrow_mut().push(one);
                }
                Some((found.value, found.dimension))
            }
            Err(error) => {
                out.push(expression_diagnostic(self.document, what, error, expression, (place, out)));
                None
            }
        }
    }

    /// Values rounded during reading: parameters, then others in the order of reading, each once.
    pub(crate) fn rounded(&self) -> Vec<Rounded> {
        let parameters = self.document.in_order().into_iter().filter_map(|declared| {
            let found = self.parameter(&declared.name).filter(|found| !found.exact)?;
            // Keys of elements are reported where they are read.
            let own = self.document.parameters.has(&declared.name);
            let (value, expression) = (found.value.as_ref().ok()?, declared.expression.as_ref()?);
            let (text, unit) = (expression.text().to_string(), declared.dimension.si());
            own.then(|| Rounded { what: format!("`{}`", declared.name), text, value: value.to_f64(), unit })
        });
        let mut out: Vec<Rounded> = parameters.collect();
        for one in self.rounded.borrow().iter() {
            if !out.contains(one) {
                out.push(one.clone());
            }
        }
        out
    }

    /// Reports a parameter that has no value for the settings.
    fn not_computed(&self, declared: &Parameter, error: &UnitError, out: &mut Vec<Diagnostic>) {
        let Some(expression) = &declared.expression else { return };
        let what = format!("parameter `{}`", declared.name);
        out.push(expression_diagnostic(self.document, &what, error.clone(), expression, (&declared.place, out)));
    }

    /// A scalar with its parameter inserted; the dimension and sign are checked where they are known.
    pub fn scalar(
        &self,
        scalar: &Placed<Scalar>,
        expected: Option<(Dimension, Sign)>,
        what: &str,
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Exact, Dimension)> {
        match &scalar.value {
            Scalar::Literal(value, dimension) => Some((value.clone(), *dimension)),
            Scalar::Tolerated(read) => Some((read.value.clone(), read.dimension)),
            Scalar::Expression(expression) => self.computed(expression, expected, (&scalar.place, what), out),
            Scalar::Parameter(name) => self.named(name, expected, (&scalar.place, what), out),
        }
    }

    /// The value of an expression.
    fn computed(
        &self,
        expression: &Expression,
        expected: Option<(Dimension, Sign)>,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Exact, Dimension)> {
        let (mut value, mut found) = self.evaluate(expression, (place, what), out)?;
        let Some((required, sign)) = expected else { return Some((value, found)) };
        if let Some(period) = required.of_other(&value, &found) {
            (value, found) = (period, required);
        }
        let of = |name: &str| self.parameter(name).map(|found| found.declared.dimension);
        if expression.mixes_turns(required, found, &of) {
            let message = format!("{what}: expected {}, but this is {}", required.noun(), found.noun());
            let conversion = if found == Dimension::FREQUENCY { "times `2 pi`" } else { "divided by `2 pi`" };
            let help = format!("a turn is 2 pi rad: write it {conversion}");
            out.push(Diagnostic::error("unit::dimension", message).at(place, found.noun()).help(help));
            return None;
        }
        if !required.is_like(&found) {
            let message = format!("{what}: expected {}, but this is {}", required.noun(), found.noun());
            let help = format!("the result needs a unit such as {}", required.example());
            out.push(Diagnostic::error("unit::dimension", message).at(place, found.noun()).help(help));
            return None;
        }
        if let Some(rule) = broken(sign, &value) {
            let message = format!("{what} must be {rule}, but `{}` is {value} {}", expression.text(), required.si());
            out.push(
                Diagnostic::error("number::sign", message)
                    .at(place, "this value")
                    .help("change the parameters in it under `[parameters]` or `[variants]`"),
            );
            return None;
        }
        Some((value, required))
    }

    /// The value of a parameter.
    fn named(
        &self,
        name: &str,
        expected: Option<(Dimension, Sign)>,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Exact, Dimension)> {
        let Some(Found { declared, value, .. }) = self.parameter(name) else {
            if self.document.suppressed.has(name) {
                return None;
            }
            let names = self.document.parameters.iter().map(|p| p.name.as_str());
            let help = match guess(name, names, out) {
                Some(near) => format!("did you mean the parameter `{near}`?"),
                None => format!("write a number with its unit, or declare `{name}` under `[parameters]`"),
            };
            let message = format!("{what}: there is no parameter `{}`", shortened(name));
            out.push(Diagnostic::error("name::unknown", message).at(place, "not declared").help(help));
            return None;
        };
        let (mut value, mut dimension) = match value {
            Ok(value) => (value.clone(), declared.dimension),
            Err(error) => {
                self.not_computed(declared, error, out);
                return None;
            }
        };
        if let Some((required, sign)) = expected {
            if let Some(period) = required.of_other(&value, &dimension) {
                (value, dimension) = (period, required);
            }
            // Angles are ignored in computed dimensions.
            if declared.expression.is_some() && required.is_like(&dimension) {
                dimension = required;
            }
            if required != dimension {
                let message = format!("{what}: expected {}, but `{name}` is {}", required.noun(), dimension.noun());
                let help = format!("give `{name}` a unit such as {}", required.example());
                out.push(Diagnostic::error("unit::dimension", message).at(place, dimension.noun()).help(help));
                return None;
            }
            if let Some(required) = broken(sign, &value) {
                let set = self.settings.iter().find(|set| set.name == name);
                let text = set.map_or(&declared.text, |set| &set.text);
                let message = format!("{what} must be {required}, but `{name}` is {text}");
                out.push(
                    Diagnostic::error("number::sign", message)
                        .at(place, "through this parameter")
                        .help(format!("change `{name}` under `[parameters]` or `[variants]`")),
                );
                return None;
            }
        }
        Some((value, dimension))
    }
}

/// The rule that a value violates.
fn broken(sign: Sign, value: &Exact) -> Option<&'static str> {
    match (sign, value.signum()) {
        (Sign::NonNegative, -1) => Some("zero or more"),
        (Sign::NonZero, 0) => Some("anything but zero"),
        (Sign::Positive | Sign::Period, -1 | 0) => Some("more than zero"),
        (Sign::Period, _) if value.to_f64() < SHORTEST_PERIOD => {
            Some("at least 1 us (a run computes every sample: a million per second)")
        }
        _ => None,
    }
}

/// The value of a name in an expression.
fn exact_of(found: &Found<'_>) -> Option<(Exact, Dimension)> {
    Some((found.value.clone().ok()?, found.declared.dimension))
}
