//! Tables with resolved names and inserted parameters.

use std::cell::{OnceCell, RefCell};
use std::collections::{BTreeSet, HashMap};
use std::fmt;

use super::document::{Document, Instance, Parameter, Setting};
use super::keys::{GUESSES, expression_diagnostic};
use super::parameters::fitting;
use crate::diagnostics::{Diagnostic, nearest, quoted, shortened};
use crate::element::{Resolved, Values};
use crate::entries::Place;
use crate::equations::{Domain, GROUND};
use crate::names::{Quantity, SignalName, did_you_mean, is_fixed_name};
use crate::schema::{Field, Kind, Placed, SHORTEST_PERIOD, Scalar, Sign, Table, Value};
use crate::units::{Dimension, Exact, Expression, UnitError, shown_quantity};

impl fmt::Display for Rounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, text, value, unit } = self;
        let value = format!("{value} {unit}");
        write!(f, "{what} = {text} was rounded to {}; exact results are exact for that number", value.trim())
    }
}

/// Resolves names and parameters of tables.
pub struct TableReader<'a> {
    document: &'a Document,
    settings: &'a [Setting],
    /// Keywords of the elements of each name (two of one name are reported elsewhere).
    elements: OnceCell<HashMap<&'a str, Vec<&'static str>>>,
    parameters: OnceCell<HashMap<&'a str, Found<'a>>>,
    charges: OnceCell<BTreeSet<String>>,
    rounded: RefCell<Vec<Rounded>>,
}

/// A parameter with its value for the settings, or the error of its expression for them.
struct Found<'a> {
    declared: &'a Parameter,
    value: Result<Exact, UnitError>,
    /// Whether that is the number itself, or one rounded once.
    exact: bool,
}

/// A rounded value: no written number has its digits.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounded {
    /// The parameter, or `<key> of <table>`.
    pub what: String,
    /// As it is written.
    pub text: String,
    /// What it was rounded to, SI.
    pub value: f64,
    /// Its SI unit.
    pub unit: String,
}

/// The suggestion for a name, unless there are very many errors already.
fn guess<'a>(name: &str, names: impl Iterator<Item = &'a str>, out: &[Diagnostic]) -> Option<&'a str> {
    if out.len() < GUESSES { nearest(name, names) } else { None }
}

impl<'a> TableReader<'a> {
    /// Over a document, with settings that replace parameters.
    pub fn new(document: &'a Document, settings: &'a [Setting]) -> Self {
        let (elements, parameters, charges) = Default::default();
        Self { document, settings, elements, parameters, charges, rounded: RefCell::default() }
    }

    /// The keywords of the elements of a name.
    fn kinds(&self, name: &str) -> &[&'static str] {
        let all = self.elements.get_or_init(|| {
            let mut all: HashMap<&str, Vec<&'static str>> = HashMap::new();
            for element in &self.document.elements {
                all.entry(&element.name).or_default().push(element.kind.keyword);
            }
            all
        });
        all.get(name).map_or(&[], Vec::as_slice)
    }

    fn parameter(&self, name: &str) -> Option<&Found<'a>> {
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
    pub(super) fn parameter_value(&self, name: &str) -> Option<f64> {
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
    pub(crate) fn exact_value(&self, name: &str) -> Option<(Exact, Dimension)> {
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
    pub(super) fn rounded(&self) -> Vec<Rounded> {
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
            out.push(Diagnostic::error("unit::dimension", message).at(place.clone(), found.noun()).help(help));
            return None;
        }
        if !required.is_like(&found) {
            let message = format!("{what}: expected {}, but this is {}", required.noun(), found.noun());
            out.push(
                Diagnostic::error("unit::dimension", message)
                    .at(place.clone(), found.noun())
                    .help(format!("the result needs a unit such as {}", required.example())),
            );
            return None;
        }
        if let Some(rule) = broken(sign, &value) {
            let message = format!("{what} must be {rule}, but `{}` is {value} {}", expression.text(), required.si());
            out.push(
                Diagnostic::error("number::sign", message)
                    .at(place.clone(), "this value")
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
            out.push(Diagnostic::error("name::unknown", message).at(place.clone(), "not declared").help(help));
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
                out.push(
                    Diagnostic::error("unit::dimension", message)
                        .at(place.clone(), dimension.noun())
                        .help(format!("give `{name}` a unit such as {}", required.example())),
                );
                return None;
            }
            if let Some(required) = broken(sign, &value) {
                let text = self
                    .settings
                    .iter()
                    .find(|s| s.name == name)
                    .map_or_else(|| Some(declared.text.clone()), |set| Some(set.text.clone()));
                let message = format!("{what} must be {required}, but `{name}` is {}", text.unwrap_or_default());
                out.push(
                    Diagnostic::error("number::sign", message)
                        .at(place.clone(), "through this parameter")
                        .help(format!("change `{name}` under `[parameters]` or `[variants]`")),
                );
                return None;
            }
        }
        Some((value, dimension))
    }

    /// The place of a key's value; of the header if the key is absent.
    pub fn place(table: &Table, key: &str) -> Place {
        table.values.get(key).map_or_else(|| table.place.clone(), |value| value.place.clone())
    }

    /// All values of a table, with names of shafts and elements checked and parameters inserted.
    pub fn values(&self, fields: &[Field], table: &Table, what: &str, out: &mut Vec<Diagnostic>) -> Values {
        let mut values = Values::default();
        values.translational = table.translational;
        for field in fields {
            let word = || field.default_word().map(|word| Resolved::Word(word.into()));
            if let Some(default) = field.default_number().map(Resolved::Exact).or_else(word) {
                values.insert_default(field.name, default);
            }
            let Some(spanned) = table.values.get(field.name) else { continue };
            let label = format!("`{}` of {what}", field.name);
            let resolved = match (&field.kind, &spanned.value) {
                (Kind::Shaft | Kind::Mass | Kind::Body, Value::Word(name)) => {
                    self.check_body(&field.kind, name, &spanned.place, &label, out);
                    Resolved::Word(name.clone())
                }
                (Kind::Element(kinds), Value::Word(name)) => {
                    self.check_element(name, kinds, &spanned.place, &label, out);
                    Resolved::Word(name.clone())
                }
                (_, Value::Word(word)) => Resolved::Word(word.clone()),
                (kind, Value::Names(names)) => {
                    for word in names {
                        match kind {
                            // A list of shafts names coordinates; those of a circuit are charges.
                            Kind::Shafts(_) => self.check_coordinate(&word.value, &word.place, &label, out),
                            Kind::Elements(kinds) => self.check_element(&word.value, kinds, &word.place, &label, out),
                            _ => {}
                        }
                    }
                    Resolved::Names(names.iter().map(|word| word.value.clone()).collect())
                }
                (kind, _) if kind.is_formula() => continue,
                (Kind::OfTime(_), Value::Scalar(scalar)) if self.document.function_of_time(scalar).is_some() => {
                    continue;
                }
                (kind, Value::Scalar(scalar)) => {
                    let expected = expected_of(kind.for_translation(table.translational), field.name);
                    let scalar = Placed { value: scalar.clone(), place: spanned.place.clone() };
                    let read = self.scalar(&scalar, expected, &label, out);
                    // A row has a right-hand side of its own kind.
                    let row = values.measure("coefficients").filter(|_| field.name == "offset");
                    // A number in place of a function of time was read without a check of its dimension.
                    let of_time = expected.filter(|_| matches!(kind, Kind::OfTime(_)));
                    let required = row.map(|domain| domain.dimensions()[0]).or(of_time.map(|one| one.0));
                    match (read, required) {
                        (Some((value, found)), Some(required)) if required != found => {
                            if matches!(scalar.value, Scalar::Literal(..)) || !required.is_like(&found) {
                                out.push(wrong_dimension(&label, required, found, spanned.place.clone()));
                                continue;
                            }
                            Resolved::Exact(value)
                        }
                        (Some((value, _)), _) => Resolved::Exact(value),
                        (None, _) => continue, // Reported, or doubtful.
                    }
                }
                (Kind::Coefficients, Value::Map(entries)) => self.row(entries, &label, out),
                (_, Value::Map(entries)) => {
                    let read = |(name, scalar): &(Placed<String>, Placed<Scalar>)| {
                        let (value, _) = self.scalar(scalar, None, &label, out)?;
                        Some((name.value.clone(), value))
                    };
                    Resolved::Map(entries.iter().filter_map(read).collect())
                }
                (Kind::Table(inner), Value::Tables(tables)) => {
                    Resolved::Tables(tables.iter().map(|table| self.values(inner, table, &label, out)).collect())
                }
                (_, Value::Poles(poles)) => Resolved::Poles(poles.clone()),
                (Kind::Tables(inner), Value::Tables(tables)) => {
                    let entry = |(i, table)| self.values(inner, table, &format!("entry {} of {label}", i + 1), out);
                    Resolved::Tables(tables.iter().enumerate().map(entry).collect())
                }
                (_, Value::Tables(_)) => continue,
            };
            values.insert(field.name, resolved);
        }
        self.check_same_domain(fields, table, what, out);
        values
    }

    /// Reports an element that would join a shaft and a mass as if they were of one kind.
    fn check_same_domain(&self, fields: &[Field], table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
        let named = fields.iter().filter(|field| field.kind == Kind::Body).filter_map(|field| {
            let Placed { value: Value::Word(name), place } = table.values.get(field.name)? else { return None };
            Some((name, place, self.body(name)?))
        });
        let named: Vec<(&String, &Place, Domain)> = named.collect();
        let Some((first, _, kind)) = named.first() else { return };
        if let Some((other, place, own)) = named.iter().find(|(_, _, own)| own != kind) {
            let message = format!("{what}: `{first}` is a {} and `{other}` a {}", kind.carrier(), own.carrier());
            let help = "connect rotation and translation by a `rack_and_pinion`, a `screw` or a `pulley`";
            out.push(Diagnostic::error("element::mixed", message).at((*place).clone(), "of another kind").help(help));
        }
    }

    /// Parameter settings written as a table, checked against `[parameters]`.
    pub fn settings(&self, table: &Table, key: &str, what: &str, out: &mut Vec<Diagnostic>) -> Vec<Setting> {
        let Some(Value::Map(entries)) = table.values.get(key).map(|spanned| &spanned.value) else { return Vec::new() };
        let mut settings = Vec::new();
        for (name, scalar) in entries {
            let label = format!("`{key}` of {what}");
            // A key of an element has its value there.
            let can_be_set = |name: &str| !self.document.keys.has(name);
            let Some(&Found { declared, .. }) = self.parameter(&name.value).filter(|_| can_be_set(&name.value)) else {
                let names = self.document.parameters.iter().map(|p| p.name.as_str());
                let other = || "only names under `[parameters]` can be set here".to_string();
                let help = did_you_mean(guess(&name.value, names, out), other);
                if self.document.suppressed.has(&name.value) {
                    continue;
                }
                let message = format!("{label}: there is no parameter `{}`", shortened(&name.value));
                out.push(Diagnostic::error("name::unknown", message).at(name.place.clone(), "not declared").help(help));
                continue;
            };
            let dimension = declared.dimension;
            if let Some((value, found)) = self.scalar(scalar, None, &label, out) {
                let computed = matches!(scalar.value, Scalar::Expression(_)) || declared.expression.is_some();
                if found != dimension && !(computed && found.is_like(&dimension)) {
                    out.push(wrong_dimension(&label, dimension, found, scalar.place.clone()));
                    continue;
                }
                let text = shown_quantity(&value, dimension);
                settings.push(Setting { name: name.value.clone(), value, text });
            }
        }
        settings
    }

    /// The outputs that a law controls must be shaft angles.
    pub(super) fn check_outputs(&self, fields: &[Field], table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
        for field in fields {
            match (field.kind, table.values.get(field.name)) {
                (Kind::Signal, Some(Placed { value: Value::Word(signal), place })) => {
                    let label = format!("`{}` of {what}", field.name);
                    let name = SignalName::new(signal);
                    let is_angle =
                        self.motion(signal).is_some_and(|(body, number)| number == 0 && self.body(body).is_some());
                    if is_angle || self.document.suppressed.has(name.element) {
                        continue;
                    }
                    let angles: Vec<String> = self.motions().map(|[angle, _]| angle).collect();
                    let all = || angles.iter().map(String::as_str);
                    let message = format!("{label}: `{}` is not the angle of a shaft", shortened(signal));
                    let own = all().find(|angle| SignalName::new(angle).element == name.element);
                    let near = own.or_else(|| nearest(signal, all()));
                    let help = did_you_mean(near, || format!("a law controls one of {}", quoted(all())));
                    out.push(Diagnostic::error("name::unknown", message).at(place.clone(), "not an angle").help(help));
                }
                (Kind::Output, Some(Placed { value: Value::Word(signal), place })) => {
                    self.check_output(signal, place, &format!("`{}` of {what}", field.name), false, out);
                }
                (Kind::Outputs, Some(Placed { value: Value::Names(signals), .. })) => {
                    for Placed { value, place } in signals {
                        self.check_output(value, place, &format!("`{}` of {what}", field.name), true, out);
                    }
                }
                (Kind::Table(inner), Some(Placed { value: Value::Tables(tables), .. })) => {
                    for table in tables {
                        self.check_outputs(inner, table, &format!("`{}` of {what}", field.name), out);
                    }
                }
                (Kind::Tables(inner), Some(Placed { value: Value::Tables(tables), .. })) => {
                    for (i, table) in tables.iter().enumerate() {
                        let what = format!("entry {} of `{}` of {what}", i + 1, field.name);
                        self.check_outputs(inner, table, &what, out);
                    }
                }
                _ => {}
            }
        }
    }

    /// An output must be an angle or a speed of a shaft, or a sensor; a measurement may also be the current of a branch.
    fn check_output(&self, signal: &str, place: &Place, label: &str, measured: bool, out: &mut Vec<Diagnostic>) {
        let name = SignalName::new(signal);
        let (head, quantity, unqualified) = (name.element, name.quantity(), name.on.is_none());
        if let Some((sensor, measured, _)) = self.document.signal_sensor(head) {
            let message = format!(
                "{label}: `{}` measures the signal `{}`, which no equation of the mechanism gives",
                shortened(sensor),
                shortened(measured)
            );
            let help = "name angles and speeds, or sensors of them and of torques; blocks and programs read signals";
            out.push(Diagnostic::error("name::unknown", message).at(place.clone(), "not an output").help(help));
            return;
        }
        let sensors = || self.document.elements.iter().filter(|e| e.kind.keyword == "sensor").map(|e| e.name.as_str());
        let is_motion = name.is_position() || name.is_rate();
        let is_reading =
            name.word.is_none() || is_motion || matches!(quantity, Some(Quantity::Torque | Quantity::Force));
        let of_sensor = unqualified && is_reading && self.kinds(head).contains(&"sensor");
        let is_output =
            |(coordinate, number): (&str, usize)| self.body(coordinate).is_some() || measured && number == 1;
        if self.motion(signal).is_some_and(is_output) || of_sensor || self.document.suppressed.has(head) {
            return;
        }
        let currents = self.charges().iter().filter(|_| measured).map(|branch| Quantity::Current.of(branch));
        let all: Vec<String> = self.motions().flatten().chain(currents).chain(sensors().map(str::to_string)).collect();
        let names = || all.iter().map(String::as_str);
        let help = did_you_mean(nearest(signal, names()), || match quantity {
            Some(Quantity::Torque | Quantity::Force) if unqualified => format!(
                "add a sensor of that torque: `[sensor.NAME]` with `measures = \"torque\"` and `element = \"{}\"`",
                shortened(head)
            ),
            _ => format!("there are {}", quoted(names())),
        });
        let current = if measured { ", no current" } else { "" };
        let message =
            format!("{label}: `{}` is not an angle or speed of a shaft{current}, nor a sensor", shortened(signal));
        out.push(Diagnostic::error("name::unknown", message).at(place.clone(), "not an output").help(help));
    }

    /// Coefficients by shaft or mass: all of one kind of quantity when multiplied with what they belong to.
    fn row(&self, entries: &[(Placed<String>, Placed<Scalar>)], label: &str, out: &mut Vec<Diagnostic>) -> Resolved {
        let (mut map, mut measured): (Vec<(String, Exact)>, Option<Domain>) = (Vec::new(), None);
        for (name, scalar) in entries {
            self.check_body(&Kind::Body, &name.value, &name.place, label, out);
            let label = format!("`{}` in {label}", name.value);
            let Some((value, dimension)) = self.scalar(scalar, None, &label, out) else { continue };
            map.push((name.value.clone(), value));
            let Some(body) = self.body(&name.value) else { continue };
            let own = Dimension { angle: 0, ..dimension };
            let product = match (body, own) {
                (_, Dimension::NONE) => Some(body),
                (Domain::Rotation, Dimension::LENGTH) => Some(Domain::Translation),
                _ => None,
            };
            let expected = match (body, product, measured) {
                (_, Some(product), None) => {
                    measured = Some(product);
                    continue;
                }
                (_, Some(product), Some(measured)) if product == measured => continue,
                (Domain::Rotation, _, Some(Domain::Translation)) => {
                    "the sum is a length: a shaft needs a length for each angle, such as \"7 mm/rad\""
                }
                (Domain::Translation, Some(_), Some(_)) => {
                    "the sum is an angle so far, and a mass has a position: give the shafts lengths for each angle, such as \"7 mm/rad\""
                }
                (Domain::Rotation, ..) => "write a number, or a length for each angle such as \"7 mm/rad\"",
                _ => "write a number without a unit",
            };
            let message = format!("{label}: {} does not fit here", dimension.noun());
            out.push(Diagnostic::error("unit::dimension", message).at(scalar.place.clone(), "").help(expected));
        }
        Resolved::Row(map, measured.unwrap_or_default())
    }

    /// Coordinates with their rates: of shafts, masses and charges.
    pub(super) fn all_motions(&self) -> impl Iterator<Item = [String; 2]> {
        let of_charge = |charge: String| Domain::Charge.motion().map(|quantity| quantity.of(&charge));
        self.motions().chain(self.document.charges().into_iter().map(of_charge))
    }

    /// The coordinate that a name is the position (0) or the rate (1) of.
    pub(super) fn motion<'n>(&self, name: &'n str) -> Option<(&'n str, usize)> {
        let (coordinate, word) = name.rsplit_once('.')?;
        let domain = self.body(coordinate).or_else(|| self.charges().get(coordinate).map(|_| Domain::Charge))?;
        Some((coordinate, domain.motion().iter().position(|quantity| quantity.word() == word)?))
    }

    /// The charges that the elements introduce as coordinates.
    fn charges(&self) -> &BTreeSet<String> {
        self.charges.get_or_init(|| self.document.charges().into_iter().collect())
    }

    /// Whether a name is that of the housing, and of no shaft or mass.
    pub(super) fn is_ground(&self, name: &str) -> bool {
        name == GROUND && self.body(name).is_none()
    }

    /// The dimension of an angle, a speed, a position or a velocity of the housing, which are zero.
    pub(super) fn motion_of_ground(&self, name: &str) -> Option<Dimension> {
        let domains = [Domain::Rotation, Domain::Translation];
        let mut all = domains.into_iter().flat_map(|domain| domain.motion().into_iter().zip(domain.dimensions()));
        let (_, dimension) = all.find(|(quantity, _)| quantity.of(GROUND) == name)?;
        self.is_ground(GROUND).then_some(dimension)
    }

    /// The domain of a coordinate.
    pub(super) fn domain_of(&self, coordinate: &str) -> Domain {
        self.body(coordinate).unwrap_or(Domain::Charge)
    }

    /// Angles and speeds of shafts, positions and velocities of masses.
    fn motions(&self) -> impl Iterator<Item = [String; 2]> {
        let bodies = self.document.elements.iter().filter_map(|instance| Some((instance, instance.body()?)));
        bodies.map(|(instance, domain)| domain.motion().map(|quantity| quantity.of(&instance.name)))
    }

    /// The shafts, the masses, or both.
    fn bodies(&self, kind: &Kind) -> impl Iterator<Item = &str> {
        let kind = *kind;
        let fits = move |instance: &&Instance| instance.body().is_some_and(|domain| is_of(&kind, domain));
        let bodies = self.document.elements.iter().filter(fits);
        bodies.map(|instance| instance.name.as_str())
    }

    /// The kind of a body: a shaft or a mass.
    fn body(&self, name: &str) -> Option<Domain> {
        self.document.elements.all(name).find_map(Instance::body)
    }

    /// A shaft, a mass, or `ground`, which is fixed.
    fn check_body(&self, kind: &Kind, name: &str, place: &Place, label: &str, out: &mut Vec<Diagnostic>) {
        if self.body(name).is_some_and(|domain| is_of(kind, domain))
            || self.document.suppressed.has(name)
            || name == GROUND
        {
            return;
        }
        let what = match kind {
            Kind::Shaft => "shaft",
            Kind::Mass => "mass",
            _ if self.bodies(&Kind::Mass).next().is_some() => "shaft or mass",
            _ => "shaft",
        };
        let (message, help) = match self.body(name) {
            Some(other) => (
                format!("{label}: `{name}` is a {}, not a {what}", other.carrier()),
                "connect rotation and translation by a `rack_and_pinion`, a `screw` or a `pulley`".to_string(),
            ),
            None => {
                let keyword = if *kind == Kind::Mass { "mass" } else { "shaft" };
                let declare = format!("`[{keyword}.{}]`", shortened(name));
                let near = guess(name, self.bodies(kind), out);
                let help = if near.is_none() && is_fixed_name(name) {
                    "the fixed frame is called \"ground\"".to_string()
                } else {
                    did_you_mean(near, || match self.bodies(kind).next() {
                        Some(_) if out.len() < GUESSES => {
                            format!("there are {}; declare another as {declare}", quoted(self.bodies(kind)))
                        }
                        _ => format!("declare it: {declare}"),
                    })
                };
                (format!("{label}: there is no {what} `{}`", shortened(name)), help)
            }
        };
        out.push(Diagnostic::error("name::unknown", message).at(place.clone(), format!("no such {what}")).help(help));
    }

    /// A shaft, a mass or a charge.
    pub(super) fn check_coordinate(&self, name: &str, place: &Place, label: &str, out: &mut Vec<Diagnostic>) {
        let charges = self.charges();
        let is_state = self.body(name) == Some(Domain::Number);
        if is_state || charges.contains(name) {
            return;
        }
        if charges.is_empty() {
            return self.check_body(&Kind::Body, name, place, label, out);
        }
        if self.body(name).is_some() || self.document.suppressed.has(name) {
            return;
        }
        let charges = self.document.charges();
        let fitting = || self.bodies(&Kind::Body).chain(charges.iter().map(String::as_str));
        let help = did_you_mean(guess(name, fitting(), out), || match fitting().next() {
            Some(_) if out.len() < GUESSES => format!("there are {}", quoted(fitting())),
            _ => format!("declare it: `[shaft.{}]`", shortened(name)),
        });
        let message = format!("{label}: there is no shaft or charge `{}`", shortened(name));
        out.push(Diagnostic::error("name::unknown", message).at(place.clone(), "no such shaft or charge").help(help));
    }

    fn check_element(&self, name: &str, kinds: &[&str], place: &Place, label: &str, out: &mut Vec<Diagnostic>) {
        let named = self.kinds(name).first();
        let fits = self.kinds(name).iter().any(|keyword| kinds.contains(keyword));
        if fits || named.is_none() && self.document.suppressed.has(name) {
            return;
        }
        let fitting =
            self.document.elements.iter().filter(|e| kinds.contains(&e.kind.keyword)).map(|e| e.name.as_str());
        let help = did_you_mean(guess(name, fitting.clone(), out), || {
            if out.len() < GUESSES && fitting.clone().next().is_some() {
                return format!("there are {}", quoted(fitting));
            }
            format!("declare one: `[{}.{}]`", kinds.first().unwrap_or(&"motor"), shortened(name))
        });
        let required = match kinds.split_last() {
            Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            _ => kinds.join(" or "),
        };
        let message = match named {
            Some(keyword) => format!("{label}: `{name}` is a {keyword}, not a {required}"),
            None => format!("{label}: there is no {required} `{}`", shortened(name)),
        };
        out.push(Diagnostic::error("name::unknown", message).at(place.clone(), "does not fit").help(help));
    }
}

/// Whether a key may name a body of a domain.
fn is_of(kind: &Kind, domain: Domain) -> bool {
    match kind {
        Kind::Shaft => domain == Domain::Rotation,
        Kind::Mass => domain == Domain::Translation,
        _ => domain != Domain::Number,
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

/// A quantity of another dimension than expected.
pub fn wrong_dimension(label: &str, expected: Dimension, actual: Dimension, place: Place) -> Diagnostic {
    let message = format!("{label}: expected {}, found {}", expected.noun(), actual.noun());
    Diagnostic::error("unit::dimension", message)
        .at(place, actual.noun())
        .help(format!("write a unit such as {}", expected.example()))
}

/// The places of a word in a table and the tables within.
pub fn occurrences(table: &Table, word: &str) -> Vec<Place> {
    let mut places = Vec::new();
    for value in table.values.values() {
        match &value.value {
            Value::Word(other) if other == word => places.push(value.place.clone()),
            Value::Names(list) => {
                places.extend(list.iter().filter(|other| other.value == word).map(|other| other.place.clone()));
            }
            Value::Tables(tables) => places.extend(tables.iter().flat_map(|table| occurrences(table, word))),
            _ => {}
        }
    }
    places.sort_by_key(Place::start);
    places
}

/// The dimension and sign of a scalar, if its kind defines them.
fn expected_of(kind: Kind, key: &str) -> Option<(Dimension, Sign)> {
    match kind {
        Kind::Quantity(dimension, sign) => Some((dimension, sign)),
        // A right-hand side has the quantity of the sum in its row.
        Kind::OfTime(dimension) if key != "offset" => Some((dimension, Sign::Any)),
        Kind::Number(sign) => Some((Dimension::NONE, sign)),
        _ => None,
    }
}
