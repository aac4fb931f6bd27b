//! What an identification asks for: parameters, extra terms, candidates; and the model that has a term for each.

use super::IdentifySettings;
use crate::assemble::{CoefficientKind as Kind, Equations};
use crate::diagnostics::{Diagnostic, nearest, quoted, shortened};
use crate::equations::Term;
use crate::identify::{Coefficient, Extra, Loss, Shape, Steadiness};
use crate::model::{Document, Model, Setting, TableReader};
use crate::schema::{Placed, Scalar, Sign, Table, Value};
use crate::study::read::{quantity, read_word, read_words};
use crate::units::{Dimension, Exact};

const KINDS: [Kind; 4] = [Kind::Inertia, Kind::Damping, Kind::Stiffness, Kind::Friction];

fn dimension(kind: Kind) -> Dimension {
    match kind {
        Kind::Inertia => Dimension::INERTIA,
        Kind::Damping => Dimension::DAMPING,
        Kind::Stiffness => Dimension::STIFFNESS,
        Kind::Friction => Dimension::TORQUE,
    }
}

/// A term beyond those of the model.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ExtraTerm {
    /// `fs.stribeck`, `wg.load_loss`
    pub name: String,
    pub element: String,
    pub shape: Option<Shape>,
    /// The Stribeck speed, where it is known.
    pub speed: Option<f64>,
    /// The input that loads the gear.
    pub torque: Option<String>,
}

/// A parameter asked for: a key of an element, or an entry of `[parameters]` that stands for several.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Wanted {
    pub name: String,
    pub keys: Vec<(String, Kind)>,
    /// What the file gives; none if it gives nothing.
    pub before: Option<f64>,
    /// The entry of `[parameters]`, if it is one.
    pub parameter: bool,
}

/// A model to compare.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CandidateSpec {
    pub name: String,
    pub parameters: Vec<String>,
    pub extras: Vec<String>,
}

/// All that is asked for.
#[derive(Debug, Clone)]
pub(super) struct Asked {
    pub wanted: Vec<Wanted>,
    /// Extra terms that are fitted.
    pub extras: Vec<ExtraTerm>,
    /// All that the file declares; candidates may have others.
    pub declared: Vec<ExtraTerm>,
    pub candidates: Vec<CandidateSpec>,
    pub method: Option<String>,
    pub window: Option<f64>,
    pub rest_speed: Option<f64>,
    pub steadiness: Steadiness,
    pub shortest: Option<f64>,
    pub absent: Vec<String>,
    pub nonnegative: Vec<String>,
    pub loss: Loss,
    pub confidence: f64,
    pub published: Vec<(String, f64)>,
    pub source: String,
}

/// Element and kind of `fs.damping`.
fn split(name: &str) -> Option<(&str, Kind)> {
    let (element, key) = name.rsplit_once('.')?;
    KINDS.into_iter().find(|kind| kind.key() == key).map(|kind| (element, kind))
}

/// The keys that could be asked for of a model.
fn possible(document: &Document) -> Vec<String> {
    // The keys of a compliant gear are not the coefficients themselves.
    let plain = document.elements.iter().filter(|instance| matches!(instance.kind.keyword, "shaft" | "spring_damper"));
    let keys = plain.flat_map(|instance| {
        let has = |kind: &Kind| instance.kind.fields.iter().any(|field| field.name == kind.key());
        KINDS.into_iter().filter(has).map(|kind| format!("{}.{}", instance.name, kind.key()))
    });
    keys.collect()
}

/// The keys of elements that are a parameter's.
fn users(document: &Document, parameter: &str) -> Vec<(String, Kind)> {
    let mut out = Vec::new();
    for instance in &document.elements {
        for kind in KINDS {
            if let Some(Placed { value: Value::Scalar(Scalar::Parameter(name)), .. }) =
                instance.table.values.get(kind.key())
                && name == parameter
            {
                out.push((instance.name.clone(), kind));
            }
        }
    }
    out
}

/// The value that the file gives a key.
fn given(document: &Document, settings: &[Setting], element: &str, kind: Kind) -> Option<f64> {
    let instance = document.elements.iter().find(|instance| instance.name == element)?;
    let value = instance.table.values.get(kind.key())?;
    let Value::Scalar(scalar) = &value.value else { return None };
    let scalar = Placed { value: scalar.clone(), place: value.place.clone() };
    let mut silent = Vec::new();
    let read = TableReader::new(document, settings).scalar(&scalar, None, "", &mut silent);
    read.map(|(value, _)| value.to_f64())
}

/// A parameter by its name, checked.
fn wanted(document: &Document, settings: &[Setting], name: &str, out: &mut Vec<Diagnostic>) -> Option<Wanted> {
    let all = possible(document);
    if let Some((element, kind)) = split(name)
        && all.iter().any(|known| known == name)
    {
        let before = given(document, settings, element, kind);
        return Some(Wanted { name: name.into(), keys: vec![(element.into(), kind)], before, parameter: false });
    }
    if let Some(parameter) = document.parameters.iter().find(|parameter| parameter.name == name) {
        let keys = users(document, name);
        let one_kind = keys.first().is_some_and(|(_, kind)| keys.iter().all(|(_, other)| other == kind));
        if one_kind {
            let set = settings.iter().find(|set| set.name == name).map_or(&parameter.value, |set| &set.value);
            return Some(Wanted { name: name.into(), keys, before: Some(set.to_f64()), parameter: true });
        }
        let message = format!("the parameter `{name}` stands for no single coefficient of the torque balance");
        out.push(Diagnostic::error("identify::parameter", message).help(
            "only inertias, dampings, stiffnesses and Coulomb frictions enter it linearly; ratios and angles do not",
        ));
        return None;
    }
    let names = || all.iter().map(String::as_str).chain(document.parameters.iter().map(|p| p.name.as_str()));
    let help = match nearest(name, names()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are {}", quoted(names())),
    };
    let help = match name.rsplit_once('.') {
        Some((element, key @ ("stribeck" | "stribeck_speed" | "load_loss"))) => format!(
            "declare the term: `[[identification.extra]]` with `kind = \"{}\"` and `friction = \"{element}\"`",
            if key == "load_loss" { "load" } else { "stribeck" }
        ),
        _ => help,
    };
    out.push(
        Diagnostic::error("name::unknown", format!("there is no parameter `{}` to be found", shortened(name)))
            .help(help),
    );
    None
}

fn words(table: &Table, key: &str) -> Vec<String> {
    read_words(table, key).iter().map(|word| word.value.clone()).collect()
}

fn number(document: &Document, key: &str, dimension: Dimension, out: &mut Vec<Diagnostic>) -> Option<f64> {
    let reader = TableReader::new(document, &[]);
    quantity(&reader, &document.identification, key, (dimension, Sign::Positive), "`[identification]`", out)
        .map(|x| x.to_f64())
}

/// Reads what is asked for.
pub(super) fn asked(
    document: &Document,
    model: &Model,
    settings: &[Setting],
    given: &IdentifySettings,
    out: &mut Vec<Diagnostic>,
) -> Asked {
    let table = &document.identification;
    let trimmed = || given.parameters.iter().map(|name| name.trim().to_string()).collect();
    let mut names: Vec<String> = if given.parameters.is_empty() { words(table, "parameters") } else { trimmed() };
    let all = names.is_empty();
    if all {
        let inertial = given.method.as_deref().or(read_word(table, "method")) == Some("dynamic");
        let mut found: Vec<(usize, String)> = Vec::new();
        for named in &model.terms {
            let (order, kind) = match &named.term {
                Term::Inertia { .. } if inertial => (0, Kind::Inertia),
                Term::Damper { .. } => (1, Kind::Damping),
                Term::Spring { .. } if inertial => (2, Kind::Stiffness),
                Term::Friction { .. } => (3, Kind::Friction),
                _ => continue,
            };
            let name = format!("{}.{}", named.element, kind.key());
            if possible(document).contains(&name) && found.iter().all(|(_, other)| *other != name) {
                found.push((order, name));
            }
        }
        found.sort();
        names = found.into_iter().map(|(_, name)| name).collect();
    }
    let declared = extras(document, model, out);
    // Parameters of extra terms are named among the others, or all are meant.
    let named = |extra: &ExtraTerm, name: &String| {
        *name == extra.name || (extra.shape.is_some() && *name == format!("{}.stribeck_speed", extra.element))
    };
    let fitted = |extra: &&ExtraTerm| all || names.iter().any(|name| named(extra, name));
    let extras: Vec<ExtraTerm> = declared.iter().filter(fitted).cloned().collect();
    names.retain(|name| !extras.iter().any(|extra| named(extra, name)));
    let mut seen: Vec<Wanted> = Vec::new();
    for name in names.iter().filter(|name| !name.is_empty()) {
        let Some(one) = wanted(document, settings, name, out) else { continue };
        if let Some(other) = seen.iter().find(|other| other.keys.iter().any(|key| one.keys.contains(key))) {
            let message = format!("`{}` and `{}` are the same coefficient", other.name, one.name);
            out.push(Diagnostic::error("name::duplicate", message).help("name it once"));
            continue;
        }
        seen.push(one);
    }
    if seen.is_empty() && extras.is_empty() && out.is_empty() {
        out.push(
            Diagnostic::error("identify::nothing", "nothing is to be found: the model has no damping and no friction")
                .help("name what is to be found with `--parameters shaft.damping,shaft.friction`"),
        );
    }
    let word = |given: &Option<String>, key: &str| given.clone().or_else(|| read_word(table, key).map(str::to_string));
    let method = word(&given.method, "method");
    let loss = match word(&given.loss, "loss").as_deref() {
        Some("huber") => Loss::Huber,
        Some("bisquare") => Loss::Bisquare,
        _ => Loss::Squares,
    };
    let confidence = given.confidence.or(number(document, "confidence", Dimension::NONE, out)).unwrap_or(0.95);
    if !(confidence > 0.0 && confidence < 1.0) {
        out.push(
            Diagnostic::error("identify::confidence", format!("a confidence of {confidence} is not between 0 and 1"))
                .at(TableReader::place(table, "confidence"), "this confidence")
                .help("write 0.95 for 95 %"),
        );
    }
    if names.iter().any(|name| name.is_empty()) {
        out.push(
            Diagnostic::error("identify::parameters", "one of the parameters asked for has no name")
                .help("write them with commas and nothing empty between: `--parameters wg.damping,wg.friction`"),
        );
    }
    let steadiness = Steadiness {
        tolerance: number(document, "steady_tolerance", Dimension::NONE, out).unwrap_or(0.02),
        ..Steadiness::default()
    };
    let published = match table.values.get("published").map(|given| &given.value) {
        Some(Value::Map(entries)) => {
            let reader = TableReader::new(document, settings);
            entries
                .iter()
                .filter_map(|(name, scalar)| {
                    let (value, _) = reader.scalar(scalar, None, "`published`", out)?;
                    Some((name.value.clone(), value.to_f64()))
                })
                .collect()
        }
        _ => Vec::new(),
    };
    let candidates = match table.values.get("candidate").map(|given| &given.value) {
        Some(Value::Tables(tables)) => tables
            .iter()
            .filter_map(|own| {
                let parameters = words(own, "parameters");
                Some(CandidateSpec {
                    name: read_word(own, "name")?.to_string(),
                    parameters: if parameters.is_empty() { names.clone() } else { parameters },
                    extras: words(own, "extras"),
                })
            })
            .collect(),
        _ => Vec::new(),
    };
    let mut asked = Asked {
        wanted: seen,
        candidates,
        method,
        window: given.window.or(number(document, "window", Dimension::TIME, out)),
        rest_speed: number(document, "rest_speed", Dimension::ANGULAR_VELOCITY, out),
        steadiness,
        shortest: number(document, "shortest_segment", Dimension::TIME, out),
        absent: words(table, "absent"),
        nonnegative: words(table, "nonnegative"),
        loss,
        confidence,
        published,
        source: read_word(table, "source").unwrap_or_default().to_string(),
        extras,
        declared,
    };
    if let Some(window) = asked.window.filter(|window| !(*window > 0.0 && window.is_finite())) {
        out.push(
            Diagnostic::error("identify::window", format!("a window of {window} s has no width"))
                .help("write one of some 50 samples: `--window \"50 ms\"`"),
        );
    }
    let sought = |name: &String| {
        asked.wanted.iter().any(|one| one.name == *name) || asked.extras.iter().any(|extra| extra.name == *name)
    };
    // What the file bounds need not be what is asked for this time.
    let possible = possible(document);
    let known = |name: &String| {
        let parameter = document.parameters.iter().any(|one| one.name == *name);
        sought(name) || parameter || possible.contains(name) || asked.declared.iter().any(|extra| extra.name == *name)
    };
    for name in asked.nonnegative.iter().filter(|name| !known(name)) {
        let names = asked.wanted.iter().map(|one| one.name.as_str());
        out.push(
            Diagnostic::error("name::unknown", format!("`nonnegative`: `{}` is not to be found", shortened(name)))
                .at(TableReader::place(table, "nonnegative"), "not a parameter of this identification")
                .help(format!("there are {}", quoted(names))),
        );
    }
    let bounded: Vec<String> = asked.nonnegative.iter().filter(|name| sought(name)).cloned().collect();
    asked.nonnegative = bounded;
    asked
}

fn extras(document: &Document, model: &Model, out: &mut Vec<Diagnostic>) -> Vec<ExtraTerm> {
    let Some(Value::Tables(tables)) = document.identification.values.get("extra").map(|given| &given.value) else {
        return Vec::new();
    };
    let reader = TableReader::new(document, &[]);
    let mut found: Vec<ExtraTerm> = Vec::new();
    for (k, table) in tables.iter().enumerate() {
        let what = format!("entry {} of `[[identification.extra]]`", k + 1);
        let (Some(kind), Some(element)) = (read_word(table, "kind"), read_word(table, "friction")) else { continue };
        let (element, load) = (element.to_string(), kind == "load");
        if !document.elements.iter().any(|e| e.name == element && matches!(e.kind.keyword, "shaft" | "spring_damper")) {
            let message = format!("{what}: there is no shaft or spring_damper `{}`", shortened(&element));
            let names = document.elements.iter().map(|e| e.name.as_str());
            let help = nearest(&element, names)
                .map_or("name one of the model".into(), |near| format!("did you mean `{near}`?"));
            out.push(
                Diagnostic::error("name::unknown", message)
                    .at(TableReader::place(table, "friction"), "no such element")
                    .help(help),
            );
            continue;
        }
        let torque = read_word(table, "torque").map(str::to_string);
        if load && torque.is_none() {
            out.push(
                Diagnostic::error("key::missing", format!("{what}: a loss in proportion to a torque needs `torque`"))
                    .at(table.place.clone(), "of which torque?")
                    .help("name the motor or disturbance whose torque goes through the gear"),
            );
            continue;
        }
        let is_input = |name: &String| {
            model.terms.iter().any(|named| named.element == *name && matches!(named.term, Term::Input { .. }))
        };
        if let Some(name) = torque.as_ref().filter(|name| !is_input(name)) {
            let message = format!("{what}: there is no motor or disturbance `{}`", shortened(name));
            out.push(
                Diagnostic::error("name::unknown", message)
                    .at(TableReader::place(table, "torque"), "no such input")
                    .help("name an input of the model"),
            );
            continue;
        }
        let shape = match read_word(table, "shape") {
            _ if load => None,
            Some("exponential") => Some(Shape::Exponential),
            Some("peak") => Some(Shape::Peak),
            _ => Some(Shape::Gaussian),
        };
        let speed = (Dimension::ANGULAR_VELOCITY, Sign::Positive);
        let speed = quantity(&reader, table, "speed", speed, &what, out).map(|x| x.to_f64());
        let name = format!("{element}.{}", if load { "load_loss" } else { "stribeck" });
        if found.iter().any(|other| other.name == name) {
            out.push(
                Diagnostic::error("name::duplicate", format!("{what}: there are two terms `{name}`"))
                    .at(table.place.clone(), "again here")
                    .help("keep one"),
            );
            continue;
        }
        found.push(ExtraTerm { name, element, shape, speed, torque: if load { torque } else { None } });
    }
    found
}

/// A copy of the document with a term for each key that is asked for, where the file gives none or zero.
pub(super) fn with_terms(
    document: &Document,
    settings: &[Setting],
    wanted: &[Wanted],
    extras: &[ExtraTerm],
) -> (Document, Vec<Setting>) {
    let (mut out, mut set) = (document.clone(), settings.to_vec());
    let keys = wanted.iter().flat_map(|one| one.keys.iter().map(|(element, kind)| (element.clone(), *kind)));
    let frictions = extras.iter().map(|extra| (extra.element.clone(), Kind::Friction));
    let tiny = Exact::from_ratio(1, 1_000_000_000);
    for (element, kind) in keys.chain(frictions) {
        let before = given(document, settings, &element, kind);
        if before.is_some_and(|value| value != 0.0) {
            continue;
        }
        let Some(instance) = out.elements.iter_mut().find(|instance| instance.name == element) else { continue };
        let Some(field) = instance.kind.fields.iter().find(|field| field.name == kind.key()) else { continue };
        let literal = Value::Scalar(Scalar::Literal(tiny.clone(), dimension(kind)));
        match instance.table.values.get_mut(kind.key()) {
            // An implicit parameter, or one of the file, that is zero.
            Some(Placed { value: Value::Scalar(Scalar::Parameter(name)), .. }) => {
                set.retain(|setting| setting.name != *name);
                set.push(Setting { name: name.clone(), value: tiny.clone(), text: String::new() });
            }
            Some(spanned) => spanned.value = literal,
            None => {
                let place = instance.place.clone();
                instance.table.values.insert(field.name, Placed { value: literal, place });
            }
        }
    }
    (out, set)
}

/// The coefficients of the equations that parameters are.
pub(super) fn coefficients(equations: &Equations, wanted: &[Wanted]) -> Vec<Coefficient> {
    let all = equations.coefficients();
    wanted
        .iter()
        .map(|one| {
            let own = all.iter().filter(|term| {
                one.keys
                    .iter()
                    .any(|(element, kind)| term.kind == *kind && term.name == format!("{element}.{}", kind.key()))
            });
            let own: Vec<_> = own.collect();
            Coefficient {
                name: one.name.clone(),
                kind: one.keys[0].1,
                terms: own.iter().map(|term| term.term).collect(),
                value: own.first().map_or(0.0, |term| term.value),
            }
        })
        .collect()
}

/// The extra columns of the equations.
pub(super) fn extra_columns(equations: &Equations, extras: &[ExtraTerm]) -> Vec<Extra> {
    extras
        .iter()
        .map(|extra| {
            let friction = equations.frictions.iter().position(|term| term.element == extra.element);
            let friction = friction.expect("every extra term has a friction");
            match &extra.torque {
                Some(name) => {
                    let input = equations.inputs.iter().position(|input| input.element == *name);
                    Extra::Load { friction, input: input.expect("an input of the model") }
                }
                None => Extra::Stribeck { friction },
            }
        })
        .collect()
}
