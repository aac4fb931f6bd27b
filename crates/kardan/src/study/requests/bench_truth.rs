//! The plant on the bench: the model's tables with values unknown to the model.

use crate::study::read::read_values::{Entry, of_dimension};
use kardan_math::names::{did_you_mean, unknown_name};
use kardan_math::num::{Random, rational_from_f64};
use kardan_math::units::{Dimension, Exact};
use kardan_model::{Document, Setting, TableReader};
use kardan_results::TrueValue;
use kardan_results::signal_name;
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::schema::{Field, Kind, Placed, SHORTEST_PERIOD, Scalar, Sign, Value};

/// The tables of the plant, and their differences.
pub(in crate::study) struct Truth {
    pub document: Document,
    pub values: Vec<TrueValue>,
    /// Names with the values of the model.
    removed: Vec<String>,
}

impl Truth {
    /// The plant equals the model except for later changes; some names remain unchanged.
    pub fn new(document: &Document, removed: &[String]) -> Self {
        Self { document: document.clone(), values: Vec::new(), removed: removed.to_vec() }
    }

    /// The explicit values.
    pub fn with_values(
        mut self,
        document: &Document,
        settings: &[Setting],
        entries: &[Entry],
        out: &mut Vec<Diagnostic>,
    ) -> Self {
        for (name, scalar) in entries {
            let label = format!("`{}` in `truth` of `[bench]`", shortened(&name.value));
            if let Some(place) = find(document, name, &label, out)
                && let Some(value) = read(document, settings, &place, scalar, &label, out)
            {
                self.set(settings, &name.value, &place, value);
            }
        }
        self
    }

    /// Every inertia, damping and friction of the file within a fraction of its value. The draw for a key depends only on its name and
    /// the seed; a breakaway torque has the same ratio to the friction as before.
    pub fn drawn(mut self, document: &Document, settings: &[Setting], spread: f64, seed: u64) -> Self {
        let reader = TableReader::new(document, settings);
        for (number, element) in document.elements.iter().enumerate() {
            for field in element.kind.fields {
                let Kind::Quantity(dimension, sign) = field.kind.for_translation(element.table.translational) else {
                    continue;
                };
                let source = if field.name == "breakaway" { "friction" } else { field.name };
                if !["inertia", "damping", "friction"].contains(&source) {
                    continue;
                }
                let Some(scalar) = element.table.values.get(field.name).and_then(Placed::scalar) else { continue };
                let Some((value, _)) = reader.scalar(&scalar, None, "", &mut Vec::new()) else { continue };
                let name = format!("{}.{}", element.name, field.name);
                let draw = 2.0 * Random::named(seed, &format!("{}.{source}", element.name)).unit() - 1.0;
                let Some(factor) = rational_from_f64(1.0 + spread * draw) else { continue };
                if value.is_zero() {
                    continue;
                }
                let place = Target::Key { element: number, field, dimension, sign };
                self.set(settings, &name, &place, Exact::new(value.to_rational() * factor, 0));
            }
        }
        self
    }

    fn set(&mut self, settings: &[Setting], name: &str, place: &Target, value: Exact) {
        if self.removed.iter().any(|candidate| candidate == name) {
            return;
        }
        let reader = TableReader::new(&self.document, settings);
        let (nominal, dimension) = match place {
            Target::Parameter(number) => {
                let parameter = &self.document.parameters[*number];
                let set = settings.iter().find(|setting| setting.name == parameter.name);
                (Some(set.map_or(&parameter.value, |set| &set.value).to_f64()), parameter.dimension)
            }
            Target::Key { element, field, dimension, .. } => {
                let entry = self.document.elements[*element].table.values.get(field.name);
                let nominal =
                    entry.and_then(Placed::scalar).and_then(|scalar| reader.scalar(&scalar, None, "", &mut Vec::new()));
                (nominal.map(|(value, _)| value.to_f64()), *dimension)
            }
        };
        let unit = if dimension == Dimension::NONE { String::new() } else { dimension.si() };
        self.values.push(TrueValue { name: name.into(), value: value.to_f64(), unit, nominal });
        match place {
            Target::Parameter(number) => {
                let parameter = &mut self.document.parameters[*number];
                parameter.spread = None;
                parameter.expression = None;
                parameter.value = value;
            }
            Target::Key { element, field, dimension, .. } => {
                let Document { implicit, keys, .. } = &mut self.document;
                for looked_up in implicit.iter_mut().chain(keys.iter_mut()).filter(|key| key.name == name) {
                    (looked_up.expression, looked_up.value) = (None, value.clone());
                }
                let table = &mut self.document.elements[*element].table;
                let place = table.place_of(field.name).clone();
                let value = Value::Scalar(Scalar::Literal(value, *dimension));
                table.values.insert(field.name, Placed { value, place });
            }
        }
    }

    /// Settings of the variant that the truth does not change.
    pub fn settings(&self, settings: &[Setting]) -> Vec<Setting> {
        let own = |setting: &&Setting| self.values.iter().all(|value| value.name != setting.name);
        settings.iter().filter(own).cloned().collect()
    }
}

/// The meaning of a name.
enum Target {
    Parameter(usize),
    Key { element: usize, field: &'static Field, dimension: Dimension, sign: Sign },
}

/// Dimension and sign of a numeric key.
fn numeric(field: &Field) -> Option<(Dimension, Sign)> {
    match field.kind {
        Kind::Quantity(dimension, sign) | Kind::Mechanical(dimension, sign) => Some((dimension, sign)),
        Kind::Number(sign) => Some((Dimension::NONE, sign)),
        _ => None,
    }
}

fn find(document: &Document, name: &Placed<String>, label: &str, out: &mut Vec<Diagnostic>) -> Option<Target> {
    let mut wrong = |message: String, help: String| {
        let head = SignalName::new(&name.value).element;
        if !document.suppressed.has(head) {
            let message = format!("{label}: {message}");
            out.push(Diagnostic::error("name::unknown", message).at(&name.place, "unknown").help(help));
        }
        None
    };
    let Some((head, key)) = signal_name::parameter(&name.value) else {
        if let Some(number) = document.parameters.iter().position(|parameter| parameter.name == name.value) {
            return Some(Target::Parameter(number));
        }
        let names = document.parameters.iter().map(|parameter| parameter.name.as_str());
        let other = || "name a key of an element, such as `wg.damping`".to_string();
        let help = did_you_mean(nearest(&name.value, names), other);
        return wrong("there is no such parameter".into(), help);
    };
    let Some(number) = document.elements.iter().position(|element| element.name == head) else {
        let names = || document.elements.iter().map(|element| element.name.as_str());
        let help = unknown_name(head, names());
        return wrong(format!("there is no element `{}`", shortened(head)), help);
    };
    let kind = document.elements[number].kind;
    let numbers = || kind.fields.iter().filter(|field| numeric(field).is_some());
    let found = numbers().find(|field| field.name == key).and_then(|field| Some((field, numeric(field)?)));
    let Some((field, (dimension, sign))) = found else {
        let names = || numbers().map(|field| field.name);
        let help = nearest(key, names()).map_or_else(
            || format!("numeric keys of a {}: {}", kind.keyword, quoted(names())),
            |near| format!("did you mean `{head}.{near}`?"),
        );
        return wrong(format!("a {} has no numeric key `{}`", kind.keyword, shortened(key)), help);
    };
    Some(Target::Key { element: number, field, dimension, sign })
}

fn read(
    document: &Document,
    settings: &[Setting],
    place: &Target,
    scalar: &Placed<Scalar>,
    label: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Exact> {
    let reader = TableReader::new(document, settings);
    let (dimension, sign) = match place {
        Target::Parameter(number) => (document.parameters[*number].dimension, Sign::Any),
        Target::Key { dimension, sign, .. } => (*dimension, *sign),
    };
    let value = of_dimension(&reader, scalar, (dimension, sign), label, out)?;
    let (fits, rule) = match sign {
        Sign::Any => (true, ""),
        Sign::NonNegative => (value.signum() >= 0, "zero or more"),
        Sign::Positive => (value.signum() > 0, "more than zero"),
        Sign::NonZero => (value.signum() != 0, "anything but zero"),
        Sign::Period => (value.to_f64() >= SHORTEST_PERIOD, "at least 1 us"),
    };
    if fits {
        return Some(value);
    }
    let message = format!("{label} must be {rule}, found {}", value.to_f64());
    let help = "the plant must be physically possible";
    out.push(Diagnostic::error("number::sign", message).at(&scalar.place, "out of range").help(help));
    None
}
