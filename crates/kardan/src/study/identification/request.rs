//! The request of an identification: parameters, extra terms, candidates.

use super::extra::{ExtraTerm, declared_terms};
use super::laws::law_terms;
use super::settings::IdentifySettings;
use super::unknowns::{UnknownParameter, parameter_name, possible, unknown_parameter};
use crate::study::read::read_values::{key_error, quantity, read_word};
use kardan_identify::{Excitation, Loss, Steadiness};
use kardan_math::units::Dimension;
use kardan_mechanics::assemble::CoefficientKind as Kind;
use kardan_mechanics::equations::{Domain, Term};
use kardan_model::{Document, Model, Setting, TableReader};
use kardan_schema::diagnostics::{Diagnostic, quoted, shortened};
use kardan_schema::schema::{Sign, Table};

/// A model to compare.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CandidateSpec {
    pub name: String,
    pub parameters: Vec<String>,
    pub extras: Vec<String>,
}

/// The whole request.
#[derive(Debug, Clone)]
pub(super) struct FitRequest {
    pub unknowns: Vec<UnknownParameter>,
    /// Extra terms that are fitted.
    pub extras: Vec<ExtraTerm>,
    /// Elements whose backlash is requested; `None`: all.
    pub backlashes: Option<Vec<String>>,
    /// Whether windows without information about all extra terms count.
    pub lenient: bool,
    /// All terms that the file declares; candidates may have others.
    pub declared: Vec<ExtraTerm>,
    pub candidates: Vec<CandidateSpec>,
    /// Whether steady segments or all windows are fitted; `None`: chosen from the logs.
    pub method: Option<Excitation>,
    pub window: Option<f64>,
    /// With the domain of the speed.
    pub rest_speed: Option<(f64, Domain)>,
    pub steadiness: Steadiness,
    pub shortest: Option<f64>,
    pub inactive_inputs: Vec<String>,
    pub nonnegative: Vec<String>,
    pub loss: Loss,
    pub confidence: f64,
    pub published: Vec<(String, f64)>,
    pub source: String,
}

/// Reads the request.
pub(super) fn request(
    document: &Document,
    model: &Model,
    settings: &[Setting],
    options: &IdentifySettings,
    out: &mut Vec<Diagnostic>,
) -> FitRequest {
    let table = &document.identification;
    let word = |option: &Option<String>, key| option.clone().or_else(|| read_word(table, key).map(str::to_string));
    let method = word(&options.method, "method");
    let method = method.map(|word| if word == "steady" { Excitation::Steady } else { Excitation::Free });
    let mut names: Vec<String> = match options.parameters.as_slice() {
        [] => table.plain_names("parameters"),
        options => options.iter().map(|name| name.trim().to_string()).collect(),
    };
    let all = names.is_empty();
    if all {
        names = all_parameters(document, model, method == Some(Excitation::Free));
    }
    let declared = declared_terms(document, model, out);
    // Parameters of extra terms are named among the others, or all are requested.
    let fitted = |extra: &&ExtraTerm| all || names.iter().any(|name| extra.is(name));
    let extras: Vec<ExtraTerm> = declared.iter().filter(fitted).cloned().collect();
    names.retain(|name| !extras.iter().any(|extra| extra.is(name)));
    let candidates = candidates(table, &names);
    let backlashes = requested_plays(document, &mut names, out);
    let laws = law_terms(document, model, settings, &mut names, out);
    let extras: Vec<ExtraTerm> = extras.into_iter().chain(laws).collect();
    let unknowns = unique_unknowns(document, settings, &names, out);
    if unknowns.is_empty() && extras.is_empty() && out.is_empty() {
        let (message, help) = match backlashes.first() {
            Some(gear) => (
                format!("`{gear}.backlash` alone gives no torque balance to fit"),
                "the contact side follows from that balance: add a damping or a friction of the model",
            ),
            None => (
                "no parameters to identify: the model has no damping and no friction".into(),
                "name the parameters with `--parameters shaft.damping,shaft.friction`",
            ),
        };
        out.push(Diagnostic::error("identify::no-parameters", message).help(help));
    }
    let confidence = confidence(document, options, out);
    if names.iter().any(String::is_empty) {
        let unnamed = Diagnostic::error("identify::parameters", "one of the requested parameters has no name");
        out.push(unnamed.help("separate them with single commas: `--parameters wg.damping,wg.friction`"));
    }
    let tolerance = number(document, "steady_tolerance", Dimension::NONE, out).unwrap_or_default();
    let mut request = FitRequest {
        published: published(document, settings, out),
        unknowns,
        candidates,
        method,
        window: options.window.or(number(document, "window", Dimension::TIME, out)),
        rest_speed: rest_speed(document, out),
        steadiness: Steadiness { tolerance, ..Steadiness::default() },
        shortest: number(document, "shortest_segment", Dimension::TIME, out),
        inactive_inputs: table.plain_names("inactive_inputs"),
        nonnegative: table.plain_names("nonnegative"),
        loss: match word(&options.loss, "loss").as_deref() {
            Some("huber") => Loss::Huber,
            Some("bisquare") => Loss::Bisquare,
            _ => Loss::Squares,
        },
        confidence,
        source: read_word(table, "source").unwrap_or_default().to_string(),
        extras,
        lenient: false,
        backlashes: (!all).then_some(backlashes),
        declared,
    };
    if let Some(window) = request.window.filter(|window| !(*window > 0.0 && window.is_finite())) {
        let help = "use a window of about 50 samples: `--window \"50 ms\"`";
        out.push(Diagnostic::error("identify::window", format!("a window of {window} s is empty")).help(help));
    }
    request.retain_sought_bounds(document, out);
    request
}

/// The dampings and frictions of a model; in a dynamic test its inertias and stiffnesses too.
fn all_parameters(document: &Document, model: &Model, inertial: bool) -> Vec<String> {
    let possible = possible(document);
    let mut names: Vec<(usize, String)> = Vec::new();
    for named in &model.terms {
        let (order, kind) = match &named.term {
            Term::Inertia { .. } if inertial => (0, Kind::Inertia),
            Term::Damper { .. } => (1, Kind::Damping),
            Term::Spring { .. } if inertial => (2, Kind::Stiffness),
            Term::Friction { .. } => (3, Kind::Friction),
            _ => continue,
        };
        let name = parameter_name(document, &named.element, kind);
        if possible.contains(&name) && names.iter().all(|(_, candidate)| *candidate != name) {
            names.push((order, name));
        }
    }
    names.sort();
    names.into_iter().map(|(_, name)| name).collect()
}

/// The parameters of these names, each coefficient once.
fn unique_unknowns(
    document: &Document,
    settings: &[Setting],
    names: &[String],
    out: &mut Vec<Diagnostic>,
) -> Vec<UnknownParameter> {
    let mut unique: Vec<UnknownParameter> = Vec::new();
    for name in names.iter().filter(|name| !name.is_empty()) {
        let Some(one) = unknown_parameter(document, settings, name, out) else { continue };
        if let Some(other) = unique.iter().find(|other| other.keys.iter().any(|key| one.keys.contains(key))) {
            let message = format!("`{}` and `{}` are the same coefficient", other.name, one.name);
            out.push(Diagnostic::error("name::duplicate", message).help("remove one of them"));
            continue;
        }
        unique.push(one);
    }
    unique
}

/// Removes the widths of backlashes from the names.
fn requested_plays(document: &Document, names: &mut Vec<String>, out: &mut Vec<Diagnostic>) -> Vec<String> {
    let mut found = Vec::new();
    names.retain(|name| {
        let gear = |element: &str| {
            document.elements.iter().find(|instance| instance.name == element && instance.kind.keyword == "gear")
        };
        let Some(instance) = name.strip_suffix(".backlash").and_then(gear) else { return true };
        if !instance.table.values.contains_key("backlash") {
            let message = format!("`{}` has no backlash to identify", instance.name);
            out.push(Diagnostic::error("identify::no-backlash", message).at(&instance.place, "no `backlash`").help(
                "give it an initial `backlash`, so that its two sides have separate angles: `backlash = \"1 mrad\"`",
            ));
        }
        found.push(instance.name.clone());
        false
    });
    found
}

fn confidence(document: &Document, options: &IdentifySettings, out: &mut Vec<Diagnostic>) -> f64 {
    let confidence = options.confidence.or(number(document, "confidence", Dimension::NONE, out)).unwrap_or(0.95);
    if !(confidence > 0.0 && confidence < 1.0) {
        let message = format!("a confidence of {confidence} is not between 0 and 1");
        let at = (&document.identification, "confidence", "this confidence");
        out.push(key_error("identify::confidence", message, at, "write 0.95 for 95 %"));
    }
    confidence
}

fn published(document: &Document, settings: &[Setting], out: &mut Vec<Diagnostic>) -> Vec<(String, f64)> {
    let reader = TableReader::new(document, settings);
    let value = |scalar, out: &mut _| Some(reader.scalar(scalar, None, "`published`", out)?.0.to_f64());
    let entries = document.identification.map("published").unwrap_or_default().iter();
    entries.filter_map(|(name, scalar)| Some((name.value.clone(), value(scalar, out)?))).collect()
}

/// The models to compare; those that name no parameters have all.
fn candidates(table: &Table, names: &[String]) -> Vec<CandidateSpec> {
    let candidate = |own: &Table| {
        let parameters = own.plain_names("parameters");
        Some(CandidateSpec {
            name: read_word(own, "name")?.to_string(),
            parameters: if parameters.is_empty() { names.to_vec() } else { parameters },
            extras: own.plain_names("extras"),
        })
    };
    table.tables("candidate").iter().filter_map(candidate).collect()
}

fn number(document: &Document, key: &str, dimension: Dimension, out: &mut Vec<Diagnostic>) -> Option<f64> {
    let reader = TableReader::new(document, &[]);
    quantity(&reader, &document.identification, key, (dimension, Sign::Positive), "`[identification]`", out)
        .map(|x| x.to_f64())
}

/// A speed of shafts, or one of masses.
fn rest_speed(document: &Document, out: &mut Vec<Diagnostic>) -> Option<(f64, Domain)> {
    let (table, reader) = (&document.identification, TableReader::new(document, &[]));
    let scalar = table.scalar_or_default("rest_speed", &table.place)?;
    let (value, dimension) = reader.scalar(&scalar, None, "`rest_speed` of `[identification]`", out)?;
    let domain = match dimension {
        Dimension::VELOCITY => Domain::Translation,
        _ => Domain::Rotation,
    };
    let what = (domain.dimensions()[1], Sign::Positive);
    quantity(&reader, table, "rest_speed", what, "`[identification]`", out).map(|_| (value.to_f64(), domain))
}

impl FitRequest {
    /// Reduces `nonnegative` to the requested parameters. The file may bound parameters that are not requested, but the model must have them.
    fn retain_sought_bounds(&mut self, document: &Document, out: &mut Vec<Diagnostic>) {
        let sought = |name: &String| {
            self.unknowns.iter().any(|one| one.name == *name)
                || self.extras.iter().any(|extra| extra.name == *name || extra.term == *name)
        };
        let possible = possible(document);
        let is_sought = |name: &String| {
            let parameter = document.parameters.has(name);
            sought(name)
                || parameter
                || possible.contains(name)
                || self.declared.iter().any(|extra| extra.name == *name || extra.term == *name)
        };
        for name in self.nonnegative.iter().filter(|name| !is_sought(name)) {
            let names = self.unknowns.iter().map(|one| one.name.as_str());
            let message = format!("`nonnegative`: `{}` is not identified", shortened(name));
            let at = (&document.identification, "nonnegative", "not a parameter of this identification");
            out.push(key_error("name::unknown", message, at, format!("there are {}", quoted(names))));
        }
        self.nonnegative = self.nonnegative.iter().filter(|name| sought(name)).cloned().collect();
    }
}
