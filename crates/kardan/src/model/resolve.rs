//! A document and parameter values to a model: names looked up, parameters put in, terms made.

use std::ops::Range;

use super::document::{Document, Instance};
use crate::diagnostics::{Diagnostic, nearest};
use crate::element::{Resolved, Values};
use crate::equations::NamedTerm;
use crate::results::ParameterValue;
use crate::schema::{Field, Kind, Scalar, Sign, Spanned, Table, Value};
use crate::synthesis::LawKind;
use crate::units::{Dimension, Exact};

/// A parameter value that replaces the file's.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Parameter.
    pub name: String,
    /// SI value.
    pub value: Exact,
    /// As written.
    pub text: String,
}

/// A controller with its keys.
#[derive(Debug, Clone)]
pub struct ControlSpec {
    /// Name.
    pub name: String,
    /// Place of its header.
    pub span: Range<usize>,
    /// Law.
    pub law: &'static LawKind,
    /// Keys.
    pub values: Values,
    /// Parameter values of the design model.
    pub design: Vec<Setting>,
}

/// A model: elements as terms, controllers as specifications, for one set of parameter values.
#[derive(Debug, Clone)]
pub struct Model {
    /// Name.
    pub name: String,
    /// A sentence.
    pub description: String,
    /// Shaft names, sorted.
    pub shafts: Vec<String>,
    /// All terms.
    pub terms: Vec<NamedTerm>,
    /// `(kind, name, values)` of each element, for display.
    pub elements: Vec<(String, String, String)>,
    /// Reduced coordinates, if the file names them.
    pub coordinates: Option<Vec<String>>,
    /// Controllers.
    pub controls: Vec<ControlSpec>,
    /// Parameter values.
    pub parameters: Vec<ParameterValue>,
}

/// Looks up names and parameters of tables.
pub struct TableReader<'a> {
    document: &'a Document,
    settings: &'a [Setting],
}

impl<'a> TableReader<'a> {
    /// Over a document, with settings that replace parameters.
    pub fn new(document: &'a Document, settings: &'a [Setting]) -> Self {
        Self { document, settings }
    }

    fn parameter(&self, name: &str) -> Option<(&Exact, Dimension)> {
        let declared = self.document.parameters.iter().find(|p| p.name == name)?;
        let value = self.settings.iter().find(|s| s.name == name).map_or(&declared.value, |s| &s.value);
        Some((value, declared.dimension))
    }

    /// A scalar with its parameter put in; the dimension and sign are checked where they are known.
    pub fn scalar(
        &self,
        scalar: &Spanned<Scalar>,
        expected: Option<(Dimension, Sign)>,
        what: &str,
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Exact, Dimension)> {
        match &scalar.value {
            Scalar::Literal(value, dimension) => Some((value.clone(), *dimension)),
            Scalar::Parameter(name) => {
                let Some((value, dimension)) = self.parameter(name) else {
                    let names = self.document.parameters.iter().map(|p| p.name.as_str());
                    let help = match nearest(name, names) {
                        Some(near) => format!("did you mean the parameter `{near}`?"),
                        None => format!("write a number with its unit, or declare `{name}` under `[parameters]`"),
                    };
                    let message = format!("{what}: there is no parameter `{name}`");
                    out.push(Diagnostic::error("name::unknown", message).at(scalar.span.clone(), "not declared").help(help));
                    return None;
                };
                if let Some((wanted, sign)) = expected {
                    if wanted != dimension {
                        let message = format!("{what}: expected {}, but `{name}` is {}", wanted.noun(), dimension.noun());
                        out.push(
                            Diagnostic::error("unit::dimension", message)
                                .at(scalar.span.clone(), dimension.noun())
                                .help(format!("give `{name}` a unit such as {}", wanted.example())),
                        );
                        return None;
                    }
                    let fits = match sign {
                        Sign::Any => true,
                        Sign::NonNegative => value.signum() >= 0,
                        Sign::Positive => value.signum() > 0,
                        Sign::NonZero => value.signum() != 0,
                    };
                    if !fits {
                        let wanted = match sign {
                            Sign::NonNegative => "zero or more",
                            Sign::NonZero => "anything but zero",
                            _ => "more than zero",
                        };
                        let message = format!("{what} must be {wanted}, but `{name}` is {}", value.to_f64());
                        out.push(
                            Diagnostic::error("number::sign", message)
                                .at(scalar.span.clone(), "through this parameter")
                                .help(format!("change `{name}` under `[parameters]` or `[variants]`")),
                        );
                        return None;
                    }
                }
                Some((value.clone(), dimension))
            }
        }
    }

    /// The span of a key's value; of the header if the key is absent.
    pub fn span(table: &Table, key: &str) -> Range<usize> {
        table.values.get(key).map_or_else(|| table.span.clone(), |value| value.span.clone())
    }

    /// All values of a table, with names of shafts and elements checked and parameters put in.
    pub fn values(&self, fields: &[Field], table: &Table, what: &str, out: &mut Vec<Diagnostic>) -> Values {
        let mut values = Values::default();
        for field in fields {
            let Some(spanned) = table.values.get(field.name) else { continue };
            let label = format!("`{}` of {what}", field.name);
            let resolved = match (&field.kind, &spanned.value) {
                (Kind::Shaft, Value::Word(name)) => {
                    self.check_shaft(name, &spanned.span, &label, out);
                    Resolved::Word(name.clone())
                }
                (Kind::Element(kinds), Value::Word(name)) => {
                    self.check_element(name, kinds, &spanned.span, &label, out);
                    Resolved::Word(name.clone())
                }
                (_, Value::Word(word)) => Resolved::Word(word.clone()),
                (kind, Value::Words(words)) => {
                    for word in words {
                        if matches!(kind, Kind::Shafts(_)) {
                            self.check_shaft(&word.value, &word.span, &label, out);
                        }
                    }
                    Resolved::Words(words.iter().map(|word| word.value.clone()).collect())
                }
                (kind, Value::Scalar(scalar)) => {
                    let expected = match kind {
                        Kind::Quantity(dimension, sign) => Some((*dimension, *sign)),
                        Kind::Number(sign) => Some((Dimension::NONE, *sign)),
                        _ => None,
                    };
                    let scalar = Spanned { value: scalar.clone(), span: spanned.span.clone() };
                    match self.scalar(&scalar, expected, &label, out) {
                        Some((value, _)) => Resolved::Exact(value),
                        None => continue,
                    }
                }
                (kind, Value::Map(entries)) => {
                    let mut map = Vec::new();
                    for (name, scalar) in entries {
                        let expected = if *kind == Kind::Coefficients {
                            self.check_shaft(&name.value, &name.span, &label, out);
                            Some((Dimension::NONE, Sign::Any))
                        } else {
                            None
                        };
                        if let Some((value, _)) = self.scalar(scalar, expected, &label, out) {
                            map.push((name.value.clone(), value));
                        }
                    }
                    Resolved::Map(map)
                }
                (Kind::Tables(inner), Value::Tables(tables)) => {
                    Resolved::Tables(tables.iter().map(|table| self.values(inner, table, &label, out)).collect())
                }
                (_, Value::Tables(_)) => continue,
            };
            values.insert(field.name, resolved);
        }
        values
    }

    /// Parameter settings written as a table, checked against `[parameters]`.
    pub fn settings(&self, table: &Table, key: &str, what: &str, out: &mut Vec<Diagnostic>) -> Vec<Setting> {
        let Some(Value::Map(entries)) = table.values.get(key).map(|spanned| &spanned.value) else { return Vec::new() };
        let mut settings = Vec::new();
        for (name, scalar) in entries {
            let label = format!("`{key}` of {what}");
            let Some((_, dimension)) = self.parameter(&name.value) else {
                let names = self.document.parameters.iter().map(|p| p.name.as_str());
                let help = match nearest(&name.value, names) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => "only names under `[parameters]` can be set here".to_string(),
                };
                let message = format!("{label}: there is no parameter `{}`", name.value);
                out.push(Diagnostic::error("name::unknown", message).at(name.span.clone(), "not declared").help(help));
                continue;
            };
            if let Some((value, found)) = self.scalar(scalar, None, &label, out) {
                if found != dimension {
                    let message = format!("{label}: expected {}, found {}", dimension.noun(), found.noun());
                    out.push(
                        Diagnostic::error("unit::dimension", message)
                            .at(scalar.span.clone(), found.noun())
                            .help(format!("write a unit such as {}", dimension.example())),
                    );
                    continue;
                }
                let text = format!("{} {}", value.to_f64(), dimension.si());
                settings.push(Setting { name: name.value.clone(), value, text });
            }
        }
        settings
    }

    fn shafts(&self) -> impl Iterator<Item = &str> {
        self.document.elements.iter().filter(|e| e.kind.keyword == "shaft").map(|e| e.name.as_str())
    }

    fn check_shaft(&self, name: &str, span: &Range<usize>, label: &str, out: &mut Vec<Diagnostic>) {
        if self.shafts().any(|shaft| shaft == name) {
            return;
        }
        let help = match nearest(name, self.shafts()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("declare it: `[shaft.{name}]`"),
        };
        let message = format!("{label}: there is no shaft `{name}`");
        out.push(Diagnostic::error("name::unknown", message).at(span.clone(), "no such shaft").help(help));
    }

    fn check_element(&self, name: &str, kinds: &[&str], span: &Range<usize>, label: &str, out: &mut Vec<Diagnostic>) {
        let named = self.document.elements.iter().find(|e| e.name == name);
        if named.is_some_and(|e| kinds.contains(&e.kind.keyword)) {
            return;
        }
        let fitting = self.document.elements.iter().filter(|e| kinds.contains(&e.kind.keyword)).map(|e| e.name.as_str());
        let help = match nearest(name, fitting.clone()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => {
                let names: Vec<String> = fitting.map(|name| format!("`{name}`")).collect();
                if names.is_empty() {
                    format!("declare one: `[{}.{name}]`", kinds.first().unwrap_or(&"motor"))
                } else {
                    format!("there are {}", names.join(", "))
                }
            }
        };
        let message = match named {
            Some(e) => format!("{label}: `{name}` is a {}, not a {}", e.kind.keyword, kinds.join(" or ")),
            None => format!("{label}: there is no {} `{name}`", kinds.join(" or ")),
        };
        out.push(Diagnostic::error("name::unknown", message).at(span.clone(), "does not fit").help(help));
    }
}

impl Document {
    /// The model for the file's parameters with some replaced. Reports what does not fit; the model is complete only
    /// if there is no error among the diagnostics.
    pub fn model(&self, settings: &[Setting]) -> (Model, Vec<Diagnostic>) {
        let mut out = Vec::new();
        let reader = TableReader::new(self, settings);
        let header = reader.values(super::document::MODEL, &self.model, "`[model]`", &mut out);
        let mut terms = Vec::new();
        let mut elements = Vec::new();
        for instance in &self.elements {
            let what = format!("{} `{}`", instance.kind.keyword, instance.name);
            let before = out.len();
            let values = reader.values(instance.kind.fields, &instance.table, &what, &mut out);
            if out.len() == before {
                for mistake in (instance.kind.check)(&values) {
                    let span = instance
                        .table
                        .values
                        .get(mistake.key)
                        .map_or_else(|| instance.span.clone(), |value| value.span.clone());
                    out.push(
                        Diagnostic::error("element::check", format!("{what}: {}", mistake.message))
                            .at(span, "here")
                            .help(mistake.help),
                    );
                }
            }
            for term in (instance.kind.terms)(&instance.name, &values) {
                terms.push(NamedTerm { element: instance.name.clone(), term });
            }
            elements.push((instance.kind.keyword.to_string(), instance.name.clone(), describe(instance, &values)));
        }
        let mut controls: Vec<ControlSpec> = Vec::new();
        for control in &self.controls {
            let what = format!("control `{}`", control.name);
            let values = reader.values(control.law.fields, &control.table, &what, &mut out);
            let design = reader.settings(&control.table, "design", &what, &mut out);
            for input in (control.law.inputs)(&values) {
                let taken = controls.iter().find(|other| (other.law.inputs)(&other.values).contains(&input));
                if let Some(other) = taken {
                    let message = format!("{what} and control `{}` both command the motor `{input}`", other.name);
                    out.push(
                        Diagnostic::error("control::input", message)
                            .at(control.span.clone(), "this controller")
                            .at(other.span.clone(), "and this one")
                            .help("let each motor be commanded by one controller"),
                    );
                }
            }
            controls.push(ControlSpec {
                name: control.name.clone(),
                span: control.span.clone(),
                law: control.law,
                values,
                design,
            });
        }
        let mut shafts: Vec<String> =
            self.elements.iter().filter(|e| e.kind.keyword == "shaft").map(|e| e.name.clone()).collect();
        shafts.sort();
        shafts.dedup();
        controls.sort_by(|a, b| a.name.cmp(&b.name));
        elements.sort();
        let model = Model {
            name: header.word("name").unwrap_or("model").to_string(),
            description: header.word("description").unwrap_or_default().to_string(),
            shafts,
            terms,
            elements,
            coordinates: header.words("coordinates").map(<[String]>::to_vec),
            controls,
            parameters: self.parameter_values(settings),
        };
        (model, out)
    }

    /// All parameters with their values.
    pub fn parameter_values(&self, settings: &[Setting]) -> Vec<ParameterValue> {
        self.parameters
            .iter()
            .map(|parameter| {
                let set = settings.iter().find(|s| s.name == parameter.name);
                ParameterValue {
                    name: parameter.name.clone(),
                    value: set.map_or(&parameter.value, |s| &s.value).to_f64(),
                    unit: parameter.dimension.si(),
                    text: set.map_or_else(|| parameter.text.clone(), |s| s.text.clone()),
                }
            })
            .collect()
    }

    /// One list of settings per variant with its name: all combinations, the last parameter fastest.
    pub fn variant_settings(&self) -> Vec<(String, Vec<Setting>)> {
        let mut out = vec![(String::new(), Vec::new())];
        for variants in &self.variants {
            let name = &variants.parameter.value;
            out = out
                .into_iter()
                .flat_map(|(label, settings)| {
                    variants.values.iter().map(move |(value, text)| {
                        let part = format!("{name}-{}", file_name(text));
                        let label = if label.is_empty() { part } else { format!("{label}_{part}") };
                        let setting = Setting { name: name.clone(), value: value.clone(), text: text.clone() };
                        (label, [settings.clone(), vec![setting]].concat())
                    })
                })
                .collect();
        }
        out
    }
}

/// A quantity as part of a file name: `10 deg` becomes `10deg`.
fn file_name(text: &str) -> String {
    text.chars()
        .filter(|c| !c.is_whitespace())
        .map(|c| match c {
            c if c.is_alphanumeric() || matches!(c, '.' | '-' | '+') => c,
            '/' => 'p',
            _ => '_',
        })
        .collect()
}

fn describe(instance: &Instance, values: &Values) -> String {
    let mut parts = Vec::new();
    for field in instance.kind.fields {
        let text = match (&field.kind, values.exact(field.name), values.word(field.name), values.map(field.name)) {
            (Kind::Quantity(dimension, _), Some(value), _, _) if *dimension == Dimension::ANGLE => {
                format!("{} deg", tidy(value.to_f64().to_degrees()))
            }
            (Kind::Quantity(dimension, _), Some(value), _, _) => format!("{} {}", tidy(value.to_f64()), dimension.si()),
            (_, Some(value), _, _) => tidy(value.to_f64()),
            (_, _, Some(word), _) => word.to_string(),
            (_, _, _, Some(map)) => {
                let entries: Vec<String> = map.iter().map(|(name, x)| format!("{name}: {}", tidy(x.to_f64()))).collect();
                entries.join(", ")
            }
            _ => continue,
        };
        parts.push(format!("{} = {text}", field.name.replace('_', " ")));
    }
    parts.join(", ")
}

/// A number with at most twelve significant digits.
fn tidy(value: f64) -> String {
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    rounded.to_string()
}
