//! Resolves a document and parameter values to a model: inserts parameters, creates terms.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use super::document::{Control, Document, Instance, Setting, Tolerance, keys_of};
use super::functions::Functions;
use super::keys::key_diagnostic;
use super::mechanism::part;
use super::programs::Programs;
use super::table_reader::{Rounded, TableReader, occurrences};
use super::tables::Header;
use kardan_elements::element::{LOAD, LOSS, SPEED};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Domain, GROUND, Meaning, Measured, NamedTerm, Term};
use kardan_results::{ElementSummary, Mechanism, ParameterValue};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Field, Keys, Kind, Placed, Resolved, Scalar, Sign, Value, Values};
use kardan_synthesis::LawKind;

/// A controller with its keys.
#[derive(Debug, Clone)]
pub struct ControlSpec {
    /// Name.
    pub name: String,
    /// Place of its header.
    pub place: Place,
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
    /// Names of shafts and of charges, sorted: the coordinates.
    pub all_coordinates: Vec<String>,
    /// All terms.
    pub terms: Vec<NamedTerm>,
    /// Each element, for display.
    pub elements: Vec<ElementSummary>,
    /// Each element with its ends, sorted by kind and name.
    pub mechanism: Mechanism,
    /// Reduced coordinates, if the file names them.
    pub coordinates: Option<Vec<String>>,
    /// Controllers in the loop.
    pub controls: Vec<ControlSpec>,
    /// Controllers of the file that this variant does not use; their references are still signals.
    pub idle: Vec<ControlSpec>,
    /// Parameter values.
    pub parameters: Vec<ParameterValue>,
    /// How far parameters may be from their values, by name.
    pub tolerances: Vec<Tolerance>,
    /// Elements with an error: their terms differ from the file.
    pub doubtful: BTreeSet<String>,
    /// The outputs of blocks.
    pub programs: Programs,
    /// Rounded values: exact results are exact for these numbers.
    pub rounded: Vec<Rounded>,
}

impl Document {
    /// The model for the file's parameters with some replaced. Reports errors; the model is complete only
    /// if there is no error among the diagnostics.
    pub fn model(&self, settings: &[Setting]) -> (Model, Vec<Diagnostic>) {
        self.model_with(settings, None)
    }

    /// The same with some controllers only; `None`: all.
    pub fn model_with(&self, settings: &[Setting], active: Option<&[String]>) -> (Model, Vec<Diagnostic>) {
        let mut out = Vec::new();
        let reader = TableReader::new(self, settings);
        let header = reader.values(Header::FIELDS, &self.model, "`[model]`", &mut out);
        let (mut terms, mut elements, mut doubtful) = (Vec::new(), Vec::new(), BTreeSet::new());
        let mut mechanism = Mechanism::default();
        let mut functions = Functions::of_scenario(&reader, self);
        let (active, idle): (Vec<&Control>, Vec<&Control>) =
            self.controls.iter().partition(|control| active.is_none_or(|a| a.contains(&control.name)));
        let mut controls = self.active_controls(&active, &reader, &mut out);
        // Errors in an idle controller are reported where it is active.
        let idle: Vec<ControlSpec> =
            idle.into_iter().map(|control| ControlSpec::read(control, &reader, &mut Vec::new())).collect();
        let programs = self.programs(&reader, &mut functions, (&mut controls, &idle), &mut out);
        self.check_commanded(&controls, &mut out);
        for instance in &self.elements {
            let (values, sound) = element_values(instance, (&reader, &mut functions), &mut out);
            if !sound {
                doubtful.insert(instance.name.clone());
            }
            if sound {
                self.check_moves(instance, &values, &reader, &mut out);
            }
            let own = self.terms_of(instance, &values);
            let described = describe(instance, &values, &reader);
            // A sensor of a signal is one of the blocks.
            if values.word("measures") != Some("signal") {
                mechanism.parts.push(part(instance, &values, &own, &described));
            }
            terms.extend(own.into_iter().map(|term| NamedTerm { element: instance.name.clone(), term }));
            elements.push(ElementSummary {
                kind: instance.kind.keyword.to_string(),
                name: instance.name.clone(),
                values: described,
            });
        }
        self.leave_parts_out(&doubtful, &mut out);
        functions.check_tables(&mut out);
        elements.sort_by(|a, b| (&a.kind, &a.name).cmp(&(&b.kind, &b.name)));
        self.fold_parts(&mut mechanism);
        mechanism.parts.sort_by(|a, b| (&a.kind, &a.name).cmp(&(&b.kind, &b.name)));
        self.check_sensors(&terms, &mut doubtful, &mut out);
        self.check_readings(&terms, &programs, &controls, &mut out);
        let mut all_coordinates: Vec<String> =
            self.elements.iter().filter(|e| e.body().is_some()).map(|e| e.name.clone()).collect();
        all_coordinates.extend(self.charges());
        let declared = |named: &NamedTerm| match &named.term {
            Term::Coordinate { name, domain: Domain::Rotation | Domain::Translation } => Some(name.clone()),
            _ => None,
        };
        all_coordinates.extend(terms.iter().filter_map(declared));
        all_coordinates.sort();
        all_coordinates.dedup();
        let model = Model {
            name: header.word_or_default("name").to_string(),
            description: header.word("description").unwrap_or_default().to_string(),
            all_coordinates,
            terms,
            elements,
            mechanism,
            coordinates: header.names("coordinates").map(<[String]>::to_vec),
            controls,
            idle,
            programs,
            parameters: self.parameter_values(settings),
            tolerances: self.tolerances_of_model(settings),
            doubtful,
            rounded: Vec::new(),
        };
        (Model { rounded: reader.rounded(), ..model }, out)
    }

    /// The terms of an element; the ground does not move and is left out, unless a body has its name.
    pub(super) fn terms_of(&self, instance: &Instance, values: &Values) -> Vec<Term> {
        let mut terms = (instance.kind.terms)(&instance.name, values);
        if !self.elements.all(GROUND).any(|candidate| candidate.body().is_some()) {
            terms.iter_mut().for_each(Term::leave_ground);
        }
        terms
    }

    /// The controllers in the loop, by name.
    fn active_controls(
        &self,
        active: &[&Control],
        reader: &TableReader<'_>,
        out: &mut Vec<Diagnostic>,
    ) -> Vec<ControlSpec> {
        let mut controls: Vec<ControlSpec> = Vec::new();
        for control in active {
            let what = format!("control `{}`", control.name);
            let mut spec = ControlSpec::read(control, reader, out);
            reader.check_outputs(&keys_of(control.kind), &control.table, &what, out);
            spec.design = reader.settings(&control.table, "design", &what, out);
            controls.push(spec);
        }
        controls.sort_by(|a, b| a.name.cmp(&b.name));
        controls
    }

    /// Rejects motors that two controllers command.
    fn check_commanded(&self, controls: &[ControlSpec], out: &mut Vec<Diagnostic>) {
        let mut commanded: HashMap<String, usize> = HashMap::new();
        for (k, control) in controls.iter().enumerate() {
            for input in (control.law.inputs)(&control.values) {
                let first = *commanded.entry(input.clone()).or_insert(k);
                let Some(other) = controls[..k].get(first) else { continue };
                let message =
                    format!("control `{}` and control `{}` both command the motor `{input}`", control.name, other.name);
                let place = |name: &str| {
                    let control = self.controls.get(name)?;
                    occurrences(&control.table, &input).into_iter().next()
                };
                let [again, first] = [control, other].map(|one| place(&one.name).unwrap_or_else(|| one.place.clone()));
                let diagnostic = Diagnostic::duplicate("control::input", message, again, first);
                out.push(diagnostic.help("let each motor be commanded by one controller"));
            }
        }
    }

    /// The error that an element names only fixed bodies; a branch of a circuit is valid anyway.
    fn check_moves(&self, instance: &Instance, values: &Values, reader: &TableReader<'_>, out: &mut Vec<Diagnostic>) {
        let is_body = |field: &&Field| matches!(field.kind, Kind::Shaft | Kind::Mass | Kind::Body);
        let keys = instance.kind.fields.iter().filter(is_body);
        let bodies: Vec<(&str, &str)> = keys.filter_map(|field| Some((field.name, values.word(field.name)?))).collect();
        let Some((key, _)) = bodies.first() else { return };
        if instance.kind.node_keys().next().is_none() && bodies.iter().all(|(_, body)| reader.is_ground(body)) {
            let message =
                format!("{} `{}` acts on the ground alone, which does not move", instance.kind.keyword, instance.name);
            out.push(
                Diagnostic::error("name::ground", message)
                    .at(instance.table.place_of(key), "fixed")
                    .help("name a shaft or mass that moves"),
            );
        }
    }

    /// Torque sensors: whether the element named has such a torque.
    fn check_sensors(&self, terms: &[NamedTerm], doubtful: &mut BTreeSet<String>, out: &mut Vec<Diagnostic>) {
        let mut by_element: HashMap<&str, Vec<&Term>> = HashMap::new();
        terms.iter().for_each(|named| by_element.entry(&named.element).or_default().push(&named.term));
        for named in terms {
            let Term::Output(sensor) = &named.term else { continue };
            let (element, shaft) = match &sensor.measured {
                Measured::SpringTorque(element) => (element, None),
                Measured::ConstraintTorque(element, shaft) | Measured::ComplianceTorque(element, shaft) => {
                    (element, Some(shaft))
                }
                Measured::Angle(_) | Measured::Speed(_) | Measured::NetTorque(_) | Measured::Signal(_) => continue,
            };
            let declared = self.elements.has(element);
            if !declared
                || doubtful.contains(&named.element)
                || doubtful.contains(element)
                || self.suppressed.has(element)
            {
                doubtful.insert(named.element.clone());
                continue;
            }
            let of_element = || by_element.get(element.as_str()).into_iter().flatten().copied();
            let has_spring = of_element().any(|term| matches!(term, Term::Spring { .. }));
            // The shafts that a constraint acts on.
            let shafts: Vec<&str> = of_element()
                .flat_map(|term| match term {
                    Term::Constraint { direction, .. } | Term::Compliance { direction, .. } => {
                        direction.entries.iter().filter(|(_, x)| !x.is_zero()).map(|(name, _)| name.as_str()).collect()
                    }
                    Term::Transmission { driven, driving, .. } => vec![driven.as_str(), driving],
                    _ => Vec::new(),
                })
                .collect();
            let by_multiplier = of_element().any(|term| matches!(term, Term::MultiplierLaw(_)));
            let (key, message, help) = match shaft {
                _ if by_multiplier => (
                    "element",
                    format!("no sensor can read the multiplier of `{element}`, which is not solved for a coordinate"),
                    format!("its multiplier is a column of a run: `{element}.tau` or `{element}.f`"),
                ),
                None if has_spring => continue,
                None if shafts.is_empty() => (
                    "element",
                    format!("`{element}` has no spring, so its torque does not follow from a twist"),
                    format!("give `{element}` a stiffness, or measure another element"),
                ),
                None => (
                    "element",
                    format!("the torque of `{element}` differs from shaft to shaft"),
                    format!("add `shaft = \"...\"`: one of {}", quoted(shafts)),
                ),
                Some(shaft) if shafts.contains(&shaft.as_str()) => continue,
                Some(_) if shafts.is_empty() => (
                    "shaft",
                    format!("`{element}` is a spring_damper, whose torque is the same on both its shafts"),
                    "remove `shaft`: the torque is read from the twist".to_string(),
                ),
                Some(shaft) => (
                    "shaft",
                    format!("`{element}` does not act on the shaft `{shaft}`"),
                    format!("it acts on {}", quoted(shafts)),
                ),
            };
            doubtful.insert(named.element.clone());
            let table = self.elements.all(&named.element).find(|e| e.kind.keyword == "sensor").map(|e| &e.table);
            out.push(
                Diagnostic::error("element::invalid", format!("sensor `{}`: {message}", named.element))
                    .at(table.map_or_else(Place::default, |table| table.place_of(key).clone()), "")
                    .help(help),
            );
        }
    }

    /// All parameters with their values.
    pub fn parameter_values(&self, settings: &[Setting]) -> Vec<ParameterValue> {
        let reader = TableReader::new(self, settings);
        let texts: HashMap<&str, &Setting> = settings.iter().rev().map(|set| (set.name.as_str(), set)).collect();
        self.parameters
            .iter()
            .map(|parameter| {
                let set = texts.get(parameter.name.as_str());
                ParameterValue {
                    name: parameter.name.clone(),
                    value: reader.parameter_value(&parameter.name).unwrap_or(f64::NAN),
                    unit: parameter.dimension.si(),
                    text: set.map_or_else(|| parameter.text.clone(), |s| s.text.clone()),
                }
            })
            .collect()
    }
}

/// Rounded values that are reported one by one.
const MOST_ROUNDED: usize = 8;

impl Model {
    /// One sentence for each value that was rounded; of very many the first ones, and how many there are.
    pub fn rounding_messages(&self) -> Vec<String> {
        let mut listed: Vec<String> = self.rounded.iter().take(MOST_ROUNDED).map(ToString::to_string).collect();
        if self.rounded.len() > MOST_ROUNDED {
            listed.push(format!("{} more values were rounded", self.rounded.len() - MOST_ROUNDED));
        }
        listed
    }
}

impl ControlSpec {
    /// A controller with its keys, without the parameter values of its design model.
    fn read(control: &Control, reader: &TableReader<'_>, out: &mut Vec<Diagnostic>) -> Self {
        let what = format!("control `{}`", control.name);
        Self {
            name: control.name.clone(),
            place: control.place.clone(),
            law: control.kind,
            values: reader.values(&keys_of(control.kind), &control.table, &what, out),
            design: Vec::new(),
        }
    }
}

/// The values of an element, checked; and whether they have no errors.
pub(super) fn element_values(
    instance: &Instance,
    (reader, functions): (&TableReader<'_>, &mut Functions<'_, '_>),
    out: &mut Vec<Diagnostic>,
) -> (Values, bool) {
    let Instance { kind, name, place, table } = instance;
    let what = format!("{} `{name}`", kind.keyword);
    let before = out.len();
    let mut values = reader.values(kind.fields, table, &what, out);
    for field in kind.fields {
        let Some(entry) = table.values.get(field.name) else { continue };
        let masses = table.translational || values.measure("coefficients") == Some(Domain::Translation);
        let label = format!("`{}` of {what}", field.name);
        let resolved = match (field.kind.for_translation(masses), &entry.value) {
            (Kind::OfTime(dimension), Value::Scalar(scalar)) => {
                functions.document.function_of_time(scalar).and_then(|expression| {
                    let function = functions.smooth(&expression, dimension, (&entry.place, &label), out);
                    function.map(|found| Resolved::OfTime(Arc::new(found)))
                })
            }
            (Kind::Formulas, Value::Map(entries)) => functions.row(entries, &label, out).map(Resolved::Formulas),
            (Kind::Surface, Value::Scalar(Scalar::Expression(expression))) => {
                let formula = functions.surface(expression, (&entry.place, &label), out);
                formula.map(|formula| Resolved::Formulas(vec![(String::new(), formula)]))
            }
            (Kind::Formula(expected), Value::Scalar(Scalar::Expression(expression))) => {
                let own = if field.name == LOSS.name { gear_loss_symbols(expected) } else { Vec::new() };
                let formula = functions.formula(expression, expected, own, (&entry.place, &label), out);
                formula.map(|formula| Resolved::Formula(Arc::new(formula)))
            }
            _ => None,
        };
        resolved.into_iter().for_each(|resolved| values.insert(field.name, resolved));
    }
    if let Some(signal) = kind.signal_of_events(name).filter(|_| !table.values.contains_key("current")) {
        let function = functions.of_events(&signal, Dimension::CURRENT, out);
        function.into_iter().for_each(|found| values.insert("current", Resolved::OfTime(Arc::new(found))));
    }
    // A check over several keys is skipped if one of them could not be read.
    let complete = table.values.keys().all(|key| values.has(key)) && table.unread.is_empty();
    if complete && out.len() == before {
        let errors = (kind.check)(&values).into_iter();
        out.extend(errors.map(|error| key_diagnostic("element::invalid", &what, error, (table, place))));
    }
    (values, complete && out.len() == before)
}

/// Names allowed in a gear loss.
fn gear_loss_symbols(torque: Dimension) -> Vec<(String, Meaning)> {
    let speed = if torque == Dimension::FORCE { Dimension::VELOCITY } else { Dimension::ANGULAR_VELOCITY };
    vec![(LOAD.into(), Meaning::Load(torque)), (SPEED.into(), Meaning::Slip(speed))]
}

fn describe(instance: &Instance, values: &Values, reader: &TableReader<'_>) -> String {
    let mut parts = Vec::new();
    for field in instance.kind.fields {
        let mut kind = field.kind.for_translation(instance.table.translational);
        if kind == Kind::AnyQuantity
            && let Some(scalar) = instance.table.values.get(field.name).and_then(Placed::scalar)
        {
            let read = reader.scalar(&scalar, None, "", &mut Vec::new());
            kind = read.map_or(kind, |(_, dimension)| Kind::Quantity(dimension, Sign::Any));
        }
        let text = match (kind, values.exact(field.name), values.word(field.name), values.map(field.name)) {
            (Kind::Quantity(dimension, _), Some(value), _, _) if dimension == Dimension::ANGLE => {
                format!("{} deg", tidy(value.to_f64().to_degrees()))
            }
            (Kind::Quantity(dimension, _), Some(value), _, _) => format!("{} {}", tidy(value.to_f64()), dimension.si()),
            (_, Some(value), _, _) => tidy(value.to_f64()),
            (_, _, Some(word), _) => word.to_string(),
            (_, _, _, map) => match (values.formula(field.name), map) {
                (Some(formula), _) => formula.expression.text().to_string(),
                (None, Some(map)) => {
                    let entries = map.iter().map(|(name, x)| format!("{name}: {}", tidy(x.to_f64())));
                    entries.collect::<Vec<_>>().join(", ")
                }
                (None, None) => continue,
            },
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
