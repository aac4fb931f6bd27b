//! Tables with resolved names and inserted parameters.

mod named_parts;
mod parameter_values;

use std::cell::{OnceCell, RefCell};
use std::collections::{BTreeSet, HashMap};
use std::fmt;

use kardan_math::names::did_you_mean;
use kardan_math::units::{Dimension, Exact, UnitError, shown_quantity};
use kardan_mechanics::equations::Domain;
use kardan_schema::diagnostics::{Diagnostic, nearest, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Field, Kind, Placed, Resolved, Scalar, Sign, Table, Value, Values};

use super::document::{Document, Parameter, Setting};
use super::keys::GUESSES;

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

    /// The place of a key's value; of the header if the key is absent.
    pub fn place(table: &Table, key: &str) -> Place {
        table.place_of(key).clone()
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
                                out.push(Diagnostic::wrong_dimension(&label, [required, found], &spanned.place));
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
            let (name, place) = table.placed_word(field.name)?;
            Some((name, place, self.body(name)?))
        });
        let named: Vec<(&str, &Place, Domain)> = named.collect();
        let Some((first, _, kind)) = named.first() else { return };
        if let Some((other, place, own)) = named.iter().find(|(_, _, own)| own != kind) {
            let message = format!("{what}: `{first}` is a {} and `{other}` a {}", kind.carrier(), own.carrier());
            let help = "connect rotation and translation by a `rack_and_pinion`, a `screw` or a `pulley`";
            out.push(Diagnostic::error("element::mixed", message).at((*place).clone(), "of another kind").help(help));
        }
    }

    /// Parameter settings written as a table, checked against `[parameters]`.
    pub fn settings(&self, table: &Table, key: &str, what: &str, out: &mut Vec<Diagnostic>) -> Vec<Setting> {
        let mut settings = Vec::new();
        for (name, scalar) in table.map(key).unwrap_or_default() {
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
                out.push(Diagnostic::error("name::unknown", message).at(&name.place, "not declared").help(help));
                continue;
            };
            let dimension = declared.dimension;
            if let Some((value, found)) = self.scalar(scalar, None, &label, out) {
                let computed = matches!(scalar.value, Scalar::Expression(_)) || declared.expression.is_some();
                if found != dimension && !(computed && found.is_like(&dimension)) {
                    out.push(Diagnostic::wrong_dimension(&label, [dimension, found], &scalar.place));
                    continue;
                }
                let text = shown_quantity(&value, dimension);
                settings.push(Setting { name: name.value.clone(), value, text });
            }
        }
        settings
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
            out.push(Diagnostic::error("unit::dimension", message).at(&scalar.place, "").help(expected));
        }
        Resolved::Row(map, measured.unwrap_or_default())
    }
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
