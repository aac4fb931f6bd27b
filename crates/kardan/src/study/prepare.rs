//! Everything that can be known before a run: all mistakes of a model file at once, and the runs ready to start.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::Requirement;
use crate::assemble::{Equations, assemble};
use crate::diagnostics::{Diagnostic, Severity, nearest, quoted, shortened};
use crate::element::Values;
use crate::equations::{Direction, InputKind, Measured, Term};
use crate::model::{ControlSpec, Document, Model, Setting, TableReader, read, words};
use crate::num::{Definiteness, Rational, Scalar, definiteness, rational_to_f64};
use crate::reduce::{Dependency, Kinematics, LinearModel, ReduceError, Reduced, linearise, reduce};
use crate::results::{Physical, Plot};
use crate::schema::{Field, Kind, Scalar as Written, Sign, Spanned, Table, Value};
use crate::simulate::{Scenario, SignalEvent, Source, SourceTarget, Tolerance, signal_names};
use crate::synthesis::{Law, Request, SynthesisError};
use crate::units::{Dimension, Exact};

/// A study that is ready to run, as far as the file is right.
#[derive(Debug, Default)]
pub struct Prepared {
    /// Name of the model.
    pub name: String,
    /// A sentence.
    pub description: String,
    /// One entry for each run.
    pub variants: Vec<PreparedVariant>,
    /// Bounds on signals.
    pub requirements: Vec<Requirement>,
    /// Plots of the report.
    pub plots: Vec<Plot>,
    /// Accuracy of the runs.
    pub tolerance: Tolerance,
}

/// One run, ready to start.
#[derive(Debug)]
pub struct PreparedVariant {
    /// Its name: `beta-10deg`, or the model's name if there are no variants.
    pub name: String,
    /// The model with its parameter values.
    pub model: Model,
    /// In explicit form.
    pub reduced: Reduced,
    /// The models that the laws are designed on, in the order of `model.controls`.
    pub design_models: Vec<LinearModel>,
    /// What happens.
    pub scenario: Scenario,
}

impl PreparedVariant {
    /// The laws of this variant, designed anew (a law carries memory of its run).
    ///
    /// # Panics
    /// If a design fails; [`prepare`] has tried each before.
    pub fn design_laws(&self) -> Vec<Box<dyn Law>> {
        self.try_laws().into_iter().map(|law| law.expect("prepare has designed this law before")).collect()
    }

    fn try_laws(&self) -> Vec<Result<Box<dyn Law>, SynthesisError>> {
        let design = |(control, model): (&ControlSpec, &LinearModel)| {
            let shafts = &self.reduced.equations.shafts;
            (control.law.design)(&Request { name: &control.name, values: &control.values, model, shafts })
        };
        self.model.controls.iter().zip(&self.design_models).map(design).collect()
    }
}

/// All mistakes and warnings of a model file, in the order of the file.
pub fn check(source: &str) -> Vec<Diagnostic> {
    prepare(source).1
}

/// Rows that one run may have.
const MOST_ROWS: f64 = 5e6;
/// Rows that all runs of a study may have together.
const MOST_ROWS_OF_ALL: f64 = 2e7;
/// Places shown for one mistake.
const MOST_LABELS: usize = 8;

fn is_error(diagnostic: &Diagnostic) -> bool {
    diagnostic.severity == Severity::Error
}

/// Reads, checks and designs a study. The result can be run only if no diagnostic is an error.
///
/// Mistakes in one part do not hide those in others: the equations are reduced if everything that makes them could be
/// read, the study is checked against as much of the model as there is. What depends on something in doubt is passed
/// over in silence.
pub fn prepare(source: &str) -> (Prepared, Vec<Diagnostic>) {
    let (document, mut out) = read(source);
    let mut prepared = Prepared::default();
    if out.iter().any(|d| d.code == "file::empty") {
        return (prepared, out);
    }
    let all_settings = document.variant_settings();
    let mut first = None;
    for (k, (label, settings)) in all_settings.iter().enumerate() {
        let (model, mut mistakes) = document.model(settings);
        prepared.name.clone_from(&model.name);
        prepared.description.clone_from(&model.description);
        if k == 0 {
            first = Some(model.clone());
        }
        if !document.doubts.equations && !mistakes.iter().any(is_error) {
            let name = if label.is_empty() { file_stem(&model.name) } else { label.clone() };
            prepared.variants.extend(prepare_variant(&document, name, model, settings, &mut mistakes));
        }
        add_new(&mut out, mistakes, (k > 0).then_some(label));
    }
    let mut mistakes = Vec::new();
    let known = match (prepared.variants.first(), first) {
        (Some(variant), _) => {
            let signals = signal_names(&variant.reduced, &variant.scenario);
            Known { document: &document, signals, doubtful: BTreeSet::new() }
        }
        (None, Some(mut model)) => {
            let reduced = unreduced(&mut model);
            let settings = &all_settings[0].1;
            let scenario = scenario(&document, &model, &reduced.equations, None, settings, &mut mistakes);
            Known { document: &document, signals: signal_names(&reduced, &scenario), doubtful: model.doubtful }
        }
        (None, None) => Known { document: &document, signals: Vec::new(), doubtful: BTreeSet::new() },
    };
    let names: Vec<String> = all_settings.into_iter().map(|(name, _)| name).collect();
    prepared.requirements = requirements(&known, &names, &mut mistakes);
    prepared.plots = plots(&known, &names, &mut mistakes);
    prepared.tolerance = tolerance(&document, &mut mistakes);
    add_new(&mut out, mistakes, None);
    out.sort_by_key(|d| {
        (d.labels.first().map_or(usize::MAX, |label| label.span.start), d.severity == Severity::Warning)
    });
    (prepared, out)
}

/// The same mistake of several variants is told once; one that the first variant does not have tells where it was found.
fn add_new(out: &mut Vec<Diagnostic>, found: Vec<Diagnostic>, later_variant: Option<&String>) {
    for mut diagnostic in found {
        let told = |d: &Diagnostic| {
            d.code == diagnostic.code
                && d.labels == diagnostic.labels
                && (later_variant.is_some() || d.message == diagnostic.message)
        };
        if out.iter().any(told) {
            continue;
        }
        if let Some(variant) = later_variant {
            diagnostic.message += &format!(" (variant `{variant}`)");
        }
        out.push(diagnostic);
    }
}

/// As much of a model as can be numbered, as if nothing were constrained: enough to know its signals. Elements that name
/// what is not there are left out and put in doubt.
fn unreduced(model: &mut Model) -> Reduced {
    let shafts = model.shafts.clone();
    let known = |name: &String| shafts.contains(name);
    let whole = |along: &Direction| along.entries.iter().all(|(name, _)| known(name));
    let (constraints, others): (Vec<_>, Vec<_>) =
        std::mem::take(&mut model.terms).into_iter().partition(|named| !matches!(named.term, Term::Output(_)));
    let (mut good, mut bad): (Vec<_>, Vec<_>) = constraints.into_iter().partition(|named| match &named.term {
        Term::Inertia { along, .. }
        | Term::Spring { along, .. }
        | Term::Damper { along, .. }
        | Term::Friction { along, .. }
        | Term::Constraint { along, .. }
        | Term::Input { along, .. } => whole(along),
        Term::Transmission { driven, driving, .. } => known(driven) && known(driving),
        Term::Output(_) => true,
    });
    let constrains = |element: &String| {
        let is_row = |term: &Term| matches!(term, Term::Constraint { .. } | Term::Transmission { .. });
        good.iter().any(|named| named.element == *element && is_row(&named.term))
    };
    let (sensors, lost): (Vec<_>, Vec<_>) = others.into_iter().partition(|named| match &named.term {
        Term::Output(sensor) => match &sensor.measured {
            Measured::Angle(shaft) | Measured::Speed(shaft) => known(shaft),
            Measured::ConstraintTorque(element, shaft) => known(shaft) && constrains(element),
            Measured::SpringTorque(_) => true,
        },
        _ => true,
    });
    good.extend(sensors);
    bad.extend(lost);
    model.doubtful.extend(bad.into_iter().map(|named| named.element));
    let equations = assemble(&model.shafts, &good);
    model.terms = good;
    Reduced { coordinates: (0..equations.shafts.len()).collect(), equations, steps: Vec::new() }
}

/// The signals of a study, for what names them.
struct Known<'a> {
    document: &'a Document,
    signals: Vec<(String, Physical)>,
    /// Elements whose signals may be others.
    doubtful: BTreeSet<String>,
}

impl Known<'_> {
    /// Whether a signal that was not found may be there when the mistakes told are put right.
    fn may_have(&self, signal: &str) -> bool {
        let doubts = &self.document.doubts;
        let (head, tail) = signal.split_once('.').map_or((signal, ""), |(head, tail)| (head, tail));
        if tail.is_empty() && doubts.references || doubts.all {
            return true;
        }
        let doubtful = doubts.has(head) || self.doubtful.contains(head);
        let kind = self.document.elements.iter().find(|e| e.name == head).map(|e| e.kind.keyword);
        doubtful
            && match kind {
                Some("shaft") => tail == "friction",
                Some("motor") => tail == "tau" || tail == "command",
                _ => true,
            }
    }
}

fn file_stem(name: &str) -> String {
    let stem: String =
        name.chars().map(|c| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' }).collect();
    if stem.chars().all(|c| c == '.' || c == '-') { "run".into() } else { stem }
}

fn span_of(document: &Document, element: &str) -> Range<usize> {
    document.elements.iter().find(|e| e.name == element).map_or(0..0, |e| e.span.clone())
}

/// The place of a key's value of an element, of its header if the key is absent.
fn span_of_value(document: &Document, element: &str, key: &str) -> Range<usize> {
    let element = document.elements.iter().find(|e| e.name == element);
    element.map_or(0..0, |e| e.table.values.get(key).map_or_else(|| e.span.clone(), |value| value.span.clone()))
}

/// The places of a word in a controller's table, of its header if the word is not there.
fn places_in_control(document: &Document, control: &ControlSpec, word: &str) -> Vec<Range<usize>> {
    let table = document.controls.iter().find(|c| c.span == control.span).map(|c| &c.table);
    let places = table.map(|table| words(table, word)).unwrap_or_default();
    if places.is_empty() { vec![control.span.clone()] } else { places }
}

fn prepare_variant(
    document: &Document,
    name: String,
    model: Model,
    settings: &[Setting],
    out: &mut Vec<Diagnostic>,
) -> Option<PreparedVariant> {
    check_connected(document, &model, out);
    let reduced = match reduce(assemble(&model.shafts, &model.terms), model.coordinates.as_deref()) {
        Ok(reduced) => reduced,
        Err(error) => {
            out.extend(reduce_diagnostics(document, &model, &error));
            return None;
        }
    };
    if !check_matrices(document, &reduced, out) {
        return None;
    }
    let design_models: Vec<Option<LinearModel>> =
        model.controls.iter().map(|control| design_model(document, &reduced, settings, control, out)).collect();
    let scenario = scenario(document, &model, &reduced.equations, Some(&reduced.coordinate_names()), settings, out);
    if !is_finite_at(&reduced, &scenario.position) {
        out.push(
            Diagnostic::error("number::range", "at the initial position an angle is too large for a number")
                .at(TableReader::span(&document.scenario, "initial"), "from these angles")
                .help("check the exponents of the initial angles and of the ratios"),
        );
        return None;
    }
    let mut designed = Vec::new();
    for (control, design) in model.controls.iter().zip(design_models) {
        let Some(design) = design else { continue };
        let before = out.len();
        for signal in signals_of(control.law.fields, &control.values) {
            let shaft = signal.strip_suffix(".phi").and_then(|name| reduced.shaft(name));
            if shaft.is_some_and(|shaft| design.direction(shaft).row(0).iter().all(Scalar::is_zero)) {
                let message =
                    format!("control `{}`: the output `{signal}` cannot move: the constraints hold it", control.name);
                out.push(
                    Diagnostic::error("control::design", message)
                        .at(places_in_control(document, control, &signal)[0].clone(), "held still")
                        .help("choose an output that can move, or remove the constraint"),
                );
            }
        }
        if out.len() > before {
            continue;
        }
        let shafts = &reduced.equations.shafts;
        let request = Request { name: &control.name, values: &control.values, model: &design, shafts };
        match (control.law.design)(&request) {
            Ok(law) => {
                let (on_angles, on_speeds) = law.gains();
                if on_angles.as_slice().iter().chain(on_speeds.as_slice()).all(|gain| gain.is_finite()) {
                    designed.push(design);
                } else {
                    out.push(
                        Diagnostic::error(
                            "number::range",
                            format!("control `{}`: a gain is too large for a number", control.name),
                        )
                        .at(control.span.clone(), "this controller")
                        .help("check the exponents of its frequencies and of the model's numbers"),
                    );
                }
            }
            Err(error) => out.push(design_diagnostic(document, control, &error)),
        }
    }
    (designed.len() == model.controls.len()).then_some(PreparedVariant {
        name,
        model,
        reduced,
        design_models: designed,
        scenario,
    })
}

/// The signals that the keys of a law name.
fn signals_of(fields: &[Field], values: &Values) -> Vec<String> {
    let mut out = Vec::new();
    for field in fields {
        match field.kind {
            Kind::Signal => out.extend(values.word(field.name).map(str::to_string)),
            Kind::Tables(inner) => {
                out.extend(
                    values.tables(field.name).unwrap_or_default().iter().flat_map(|values| signals_of(inner, values)),
                );
            }
            _ => {}
        }
    }
    out
}

fn design_diagnostic(document: &Document, control: &ControlSpec, error: &SynthesisError) -> Diagnostic {
    let (named, label, help) = match error {
        SynthesisError::NotDecouplable { outputs, not_reached, .. } => {
            let named = if not_reached.is_empty() { outputs.clone() } else { not_reached.clone() };
            let label = if not_reached.is_empty() { "not independent" } else { "not reached" };
            (
                named,
                label,
                "choose other outputs or inputs; `kardan equations` shows what each input reaches".to_string(),
            )
        }
        SynthesisError::Twice { name, what } => {
            (vec![name.clone()], "used here", format!("name another {what} in each channel"))
        }
        SynthesisError::NotReached { input, .. } => (
            vec![input.clone()],
            "does not act on the output directly",
            "choose a motor that acts on the output without a spring between, or give `inertia`".to_string(),
        ),
        SynthesisError::NotAnAngle { signal, example } => {
            (vec![signal.clone()], "not an angle", format!("name the angle of a shaft, such as `{example}`"))
        }
    };
    let mut out = Diagnostic::error("control::design", format!("control `{}`: {error}", control.name)).help(help);
    let mut places: Vec<Range<usize>> =
        named.iter().flat_map(|word| places_in_control(document, control, word)).take(MOST_LABELS).collect();
    places.sort_by_key(|place| place.start);
    places.dedup();
    for place in places {
        out = out.at(place, label);
    }
    out
}

/// Whether all angles, and the way they depend on the coordinates, are finite at a position.
fn is_finite_at(reduced: &Reduced, position: &[f64]) -> bool {
    let mut kinematics = Kinematics::new(reduced);
    kinematics.update(position, &vec![0.0; position.len()]);
    kinematics.angles.iter().chain(&kinematics.basis).all(|x| x.is_finite())
}

/// Whether the matrices of a model can be held in numbers, and its inertias are not lost in rounding.
fn is_representable(model: &LinearModel) -> bool {
    let matrices = [&model.inertia, &model.damping, &model.stiffness, &model.input, &model.basis];
    let finite = matrices.iter().all(|matrix| matrix.to_f64().as_slice().iter().all(|x| x.is_finite()));
    let inertia = model.inertia.to_f64();
    finite && (0..inertia.rows()).all(|k| inertia[(k, k)].is_normal() && (1.0 / inertia[(k, k)]).is_finite())
}

/// The linear model that a law is designed on: its own parameter values, no friction.
fn design_model(
    document: &Document,
    reduced: &Reduced,
    settings: &[Setting],
    control: &ControlSpec,
    out: &mut Vec<Diagnostic>,
) -> Option<LinearModel> {
    let zero = vec![0.0; reduced.freedoms()];
    if control.design.is_empty() {
        return Some(linearise(reduced, &zero));
    }
    let kept = settings.iter().filter(|s| control.design.iter().all(|d| d.name != s.name));
    let all: Vec<Setting> = kept.chain(&control.design).cloned().collect();
    let (model, mistakes) = document.model(&all);
    let place = document.controls.iter().find(|c| c.span == control.span);
    let place = place.map_or_else(|| control.span.clone(), |c| TableReader::span(&c.table, "design"));
    let mut wrong = false;
    for mistake in mistakes.into_iter().filter(is_error) {
        wrong = true;
        let Diagnostic { code, message, labels, .. } = mistake;
        let mut mistake =
            Diagnostic::error(code, format!("with the design values of control `{}`: {message}", control.name))
                .at(place.clone(), "with these values")
                .help("choose design values that every element can take");
        mistake.labels.extend(labels);
        add_new(out, vec![mistake], None);
    }
    if wrong {
        return None;
    }
    match reduce(assemble(&model.shafts, &model.terms), Some(&reduced.coordinate_names())) {
        Ok(design) => {
            let finite = is_finite_at(&design, &zero);
            let linear = finite.then(|| linearise(&design, &zero));
            let good = linear.filter(|m| definiteness(&m.inertia) == Definiteness::Positive && is_representable(m));
            if good.is_none() {
                let message =
                    format!("control `{}`: in its design model a motion without inertia is possible", control.name);
                out.push(
                    Diagnostic::error("control::design", message)
                        .at(place, "with these values")
                        .help("choose design values for which every motion has an inertia"),
                );
            }
            good
        }
        Err(error) => {
            let message = format!("control `{}`: its design model cannot be reduced: {error}", control.name);
            out.push(
                Diagnostic::error("control::design", message)
                    .at(place, "with these values")
                    .help("choose design values for which the model keeps its degrees of freedom"),
            );
            None
        }
    }
}

/// Reports parts of the model that neither an element nor a law connects.
fn check_connected(document: &Document, model: &Model, out: &mut Vec<Diagnostic>) {
    let mut part: Vec<usize> = (0..model.shafts.len()).collect();
    let number = |name: &str| model.shafts.iter().position(|shaft| shaft == name);
    let mut join = |names: Vec<&str>| {
        let numbers: Vec<usize> = names.iter().filter_map(|name| number(name)).collect();
        for pair in numbers.windows(2) {
            let (from, to) = (part[pair[1]], part[pair[0]]);
            for p in &mut part {
                if *p == from {
                    *p = to;
                }
            }
        }
    };
    let mut shafts_of_input: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for named in &model.terms {
        let shafts: Vec<&str> = match &named.term {
            Term::Inertia { along, .. }
            | Term::Spring { along, .. }
            | Term::Damper { along, .. }
            | Term::Friction { along, .. }
            | Term::Constraint { along, .. }
            | Term::Input { along, .. } => along.entries.iter().map(|(name, _)| name.as_str()).collect(),
            Term::Transmission { driven, driving, .. } => vec![driven, driving],
            Term::Output(_) => continue,
        };
        if matches!(named.term, Term::Input { .. }) {
            shafts_of_input.insert(&named.element, shafts.clone());
        }
        join(shafts);
    }
    for control in &model.controls {
        let inputs = (control.law.inputs)(&control.values);
        join(inputs.iter().filter_map(|input| shafts_of_input.get(input.as_str())).flatten().copied().collect());
    }
    let first = part.first().copied();
    let away: Vec<&String> =
        model.shafts.iter().zip(&part).filter(|(_, p)| Some(**p) != first).map(|(shaft, _)| shaft).collect();
    if let Some(shaft) = away.first() {
        let names = quoted(away.iter().map(|name| name.as_str()));
        let message = format!("the model falls apart: nothing connects {names} with `{}`", model.shafts[0]);
        out.push(
            Diagnostic::error("model::disconnected", message)
                .at(span_of(document, shaft), "not connected")
                .help("connect the parts by a gear, a spring_damper or a common controller, or make two models"),
        );
    }
}

fn reduce_diagnostics(document: &Document, model: &Model, error: &ReduceError) -> Vec<Diagnostic> {
    let coordinates = TableReader::span(&document.model, "coordinates");
    let suggest = |names: &[String]| {
        if names.is_empty() {
            "leave `coordinates` out to have them chosen".to_string()
        } else {
            let names: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
            format!("coordinates = [{}] would do", names.join(", "))
        }
    };
    match error {
        ReduceError::ConstraintsDependent { rank, dependencies } => dependencies
            .iter()
            .map(|Dependency { elements, contradiction }| {
                let names = quoted(elements.iter().map(|(name, _)| name.as_str()));
                let verdict =
                    if *contradiction { "their offsets contradict each other" } else { "one of them is superfluous" };
                let rows = rank + dependencies.len();
                // Shares so that the first is one.
                let unit = elements.first().map_or(1.0, |(_, x)| *x);
                let mut sum = String::new();
                for (name, x) in elements {
                    let share = x / unit;
                    let sign = match (sum.is_empty(), share < 0.0) {
                        (true, false) => "",
                        (true, true) => "-",
                        (false, false) => " + ",
                        (false, true) => " - ",
                    };
                    let size = if share.abs() == 1.0 { String::new() } else { format!("{}·", share.abs()) };
                    sum += &format!("{sign}{size}{name}");
                }
                let message = format!(
                    "the constraints {names} are linearly dependent ({sum} = 0), and {verdict}; \
                     {rows} rows have the rank {rank}"
                );
                let mut out = Diagnostic::error("constraint::dependent", message);
                for (name, x) in elements.iter().take(MOST_LABELS) {
                    out = out.at(span_of(document, name), format!("this row, times {}", x / unit));
                }
                let help = if *contradiction {
                    "remove one of them, or correct a ratio or an offset"
                } else {
                    "remove one of them, or correct a ratio"
                };
                out.help(help)
            })
            .collect(),
        ReduceError::NoMotion { .. } => {
            let mut out = Diagnostic::error("constraint::no-motion", error.to_string())
                .help("remove a constraint, or add a shaft: a model needs at least one degree of freedom");
            let rows =
                model.terms.iter().filter(|t| matches!(t.term, Term::Constraint { .. } | Term::Transmission { .. }));
            let mut places: Vec<Range<usize>> = rows.map(|named| span_of(document, &named.element)).collect();
            places.sort_by_key(|place| place.start);
            for place in places.into_iter().take(MOST_LABELS) {
                out = out.at(place, "a constraint");
            }
            vec![out]
        }
        ReduceError::CoordinateCount { suggestion, .. } | ReduceError::CoordinatesDependent { suggestion, .. } => vec![
            Diagnostic::error("coordinates::choice", error.to_string())
                .at(coordinates, "these coordinates")
                .help(suggest(suggestion)),
        ],
        ReduceError::NotExplicit { elements, suggestion } => {
            let mut out = Diagnostic::error("constraint::loop", error.to_string());
            for name in elements.iter().take(MOST_LABELS) {
                out = out.at(span_of(document, name), "part of the loop");
            }
            let help = if model.coordinates.is_some() {
                suggest(suggestion)
            } else {
                "break the loop: two transmissions between the same shafts leave no motion".to_string()
            };
            vec![out.help(help)]
        }
    }
}

/// Inertia must be positive definite and damping positive semidefinite in every position; both are decided exactly at
/// the positions tried.
fn check_matrices(document: &Document, reduced: &Reduced, out: &mut Vec<Diagnostic>) -> bool {
    let r = reduced.freedoms();
    let constant = Kinematics::new(reduced).is_constant();
    let positions: Vec<Vec<f64>> = if constant {
        vec![vec![0.0; r]]
    } else {
        (0..8).map(|k| vec![f64::from(k) * std::f64::consts::PI / 8.0; r]).collect()
    };
    let negative: Vec<&str> = reduced
        .equations
        .dampers
        .iter()
        .filter(|damper| damper.value.signum() < 0)
        .map(|damper| damper.element.as_str())
        .collect();
    let mut passive = true;
    for position in &positions {
        let model = is_finite_at(reduced, position).then(|| linearise(reduced, position));
        let Some(model) = model else {
            let ratios = reduced.equations.constraints.iter().map(|row| row.element.as_str());
            let ratios = ratios.chain(reduced.equations.transmissions.iter().map(|row| row.element.as_str()));
            let mut diagnostic = Diagnostic::error("number::range", "an angle of the model is too large for a number");
            for name in ratios.take(MOST_LABELS) {
                diagnostic = diagnostic.at(span_of(document, name), "through this constraint");
            }
            out.push(diagnostic.help("check the exponents of ratios, coefficients and offsets"));
            return false;
        };
        match definiteness(&model.inertia) {
            Definiteness::Positive => {}
            Definiteness::PositiveSemi { direction } | Definiteness::Indefinite { witness: direction } => {
                let shafts = moving(reduced, &model, &direction);
                let names = quoted(shafts.iter().map(String::as_str));
                let message = format!("a motion without inertia is possible: {names} can move while no mass does");
                let mut diagnostic = Diagnostic::error("model::massless", message);
                for name in shafts.iter().take(MOST_LABELS) {
                    diagnostic = diagnostic.at(span_of(document, name), "moves without inertia");
                }
                out.push(diagnostic.help("give one of these shafts an inertia, or tie it to another shaft by a gear"));
                return false;
            }
        }
        if !is_representable(&model) {
            let message = "the numbers of the model lie too far apart: a reduced inertia, damping, stiffness or ratio is too \
                           large or too small for a number";
            let mut diagnostic = Diagnostic::error("number::range", message);
            for name in reduced.coordinate_names().iter().take(MOST_LABELS) {
                diagnostic = diagnostic.at(span_of(document, name), "moves with it");
            }
            out.push(diagnostic.help("check the exponents of inertias, dampings, stiffnesses and ratios"));
            return false;
        }
        if passive
            && !negative.is_empty()
            && let Definiteness::Indefinite { witness } = definiteness(&model.damping)
        {
            passive = false;
            let shafts = moving(reduced, &model, &witness);
            let names = quoted(shafts.iter().map(String::as_str));
            let message = format!(
                "the damping is not passive: a motion of {names} gains energy from it (the reduced damping matrix is not \
                 positive semidefinite)"
            );
            let mut diagnostic = Diagnostic::error("damping::not-passive", message);
            for name in negative.iter().take(MOST_LABELS) {
                diagnostic = diagnostic.at(span_of_value(document, name, "damping"), "negative damping");
            }
            out.push(diagnostic.help("make this damping less negative, or add damping to the shafts named"));
        }
    }
    if passive {
        for name in negative {
            let message = format!(
                "`{name}` has a negative damping; the model as a whole is passive (its reduced damping matrix is positive \
                 semidefinite)"
            );
            out.push(
                Diagnostic::warning("damping::negative", message)
                    .at(span_of_value(document, name, "damping"), "negative damping")
                    .help("fine for an equivalent damping identified on a gear; otherwise correct its sign"),
            );
        }
    }
    true
}

/// Shafts that take part in a reduced motion, the largest share first.
fn moving(reduced: &Reduced, model: &LinearModel, direction: &[Rational]) -> Vec<String> {
    let mut shares: Vec<(f64, &String)> = reduced
        .equations
        .shafts
        .iter()
        .enumerate()
        .map(|(shaft, name)| {
            let sum = direction
                .iter()
                .enumerate()
                .fold(Rational::ZERO, |sum, (j, x)| sum.plus(&model.basis[(shaft, j)].times(x)));
            (rational_to_f64(&sum).abs(), name)
        })
        .filter(|(share, _)| *share > 0.0)
        .collect();
    shares.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(b.1)));
    shares.into_iter().map(|(_, name)| name.clone()).collect()
}

fn physical_dimension(physical: Physical) -> Dimension {
    match physical {
        Physical::Angle => Dimension::ANGLE,
        Physical::Speed => Dimension::ANGULAR_VELOCITY,
        Physical::Torque | Physical::Energy => Dimension::TORQUE,
    }
}

fn read_scalar(table: &Table, key: &str) -> Option<Spanned<Written>> {
    table.values.get(key).and_then(|spanned| match &spanned.value {
        Value::Scalar(scalar) => Some(Spanned { value: scalar.clone(), span: spanned.span.clone() }),
        _ => None,
    })
}

fn read_word<'a>(table: &'a Table, key: &str) -> Option<&'a str> {
    table.values.get(key).and_then(|spanned| match &spanned.value {
        Value::Word(word) => Some(word.as_str()),
        _ => None,
    })
}

fn read_words<'a>(table: &'a Table, key: &str) -> &'a [Spanned<String>] {
    table.values.get(key).map_or(&[], |spanned| match &spanned.value {
        Value::Words(words) => words,
        _ => &[],
    })
}

/// A quantity of a table in SI, checked against a dimension and, through parameters, against a sign.
fn quantity(
    reader: &TableReader<'_>,
    table: &Table,
    key: &str,
    (dimension, sign): (Dimension, Sign),
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Exact> {
    let scalar = read_scalar(table, key)?;
    let label = format!("`{key}` of {what}");
    of_dimension(reader, &scalar, (dimension, sign), &label, out)
}

/// A quantity in SI of one dimension.
fn of_dimension(
    reader: &TableReader<'_>,
    scalar: &Spanned<Written>,
    (dimension, sign): (Dimension, Sign),
    label: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Exact> {
    let (value, found) = reader.scalar(scalar, Some((dimension, sign)), label, out)?;
    if found != dimension {
        let message = format!("{label}: expected {}, found {}", dimension.noun(), found.noun());
        out.push(
            Diagnostic::error("unit::dimension", message)
                .at(scalar.span.clone(), found.noun())
                .help(format!("write a unit such as {}", dimension.example())),
        );
        return None;
    }
    Some(value)
}

/// Signals that events may set: references of laws, disturbances, torques of motors without a law.
fn sources(model: &Model, equations: &Equations, document: &Document, out: &mut Vec<Diagnostic>) -> Vec<Source> {
    let mut sources: Vec<Source> = Vec::new();
    let mut commanded: Vec<String> = Vec::new();
    for control in &model.controls {
        commanded.extend((control.law.inputs)(&control.values));
        for reference in (control.law.references)(&control.values) {
            let element = document.elements.iter().find(|e| e.name == reference.name);
            let other = sources.iter().find(|s| s.name == reference.name);
            let taken = match (element, other) {
                (Some(element), _) => Some(format!("of a {}", element.kind.keyword)),
                (None, Some(other)) if other.physical != reference.physical => {
                    Some(format!("of {} in {}", other.description, other.physical.unit()))
                }
                _ => None,
            };
            if let Some(taken) = taken {
                let message =
                    format!("control `{}`: the name `{}` is already that {taken}", control.name, reference.name);
                let places = places_in_control(document, control, &reference.name);
                out.push(
                    Diagnostic::error("name::duplicate", message)
                        .at(places[places.len() - 1].clone(), "this name")
                        .help("give the reference a name of its own, such as `ref_rack`"),
                );
            } else if other.is_none() {
                sources.push(Source {
                    name: reference.name,
                    physical: reference.physical,
                    description: reference.description,
                    target: SourceTarget::Reference,
                });
            }
        }
    }
    for (k, input) in equations.inputs.iter().enumerate() {
        let (name, description) = match &input.value {
            InputKind::Disturbance => (input.element.clone(), format!("disturbance {}", input.element)),
            InputKind::Motor(_) if commanded.contains(&input.element) => continue,
            InputKind::Motor(_) => (format!("{}.tau", input.element), format!("torque of {}", input.element)),
        };
        sources.push(Source { name, physical: Physical::Torque, description, target: SourceTarget::Input(k) });
    }
    sources.sort_by(|a, b| a.name.cmp(&b.name));
    sources
}

/// Why an event cannot set a signal; nothing if the signal may be there when the mistakes told are put right.
fn not_settable(signal: &str, sources: &[Source], document: &Document, model: &Model) -> Option<(String, String)> {
    let shown = shortened(signal);
    let names = || sources.iter().map(|source| source.name.as_str());
    let all = || match sources {
        [] => "there is nothing to set: add a motor or a disturbance".to_string(),
        _ => format!("events can set {}", quoted(names())),
    };
    let (head, tail) = signal.split_once('.').unwrap_or((signal, ""));
    let is_kind = |keyword: &str| document.elements.iter().any(|e| e.name == head && e.kind.keyword == keyword);
    if tail == "tau" && is_kind("motor") {
        let commands = |control: &&ControlSpec| (control.law.inputs)(&control.values).iter().any(|input| input == head);
        let control = model.controls.iter().find(commands)?;
        let references: Vec<String> = (control.law.references)(&control.values).into_iter().map(|r| r.name).collect();
        let message =
            format!("control `{}` commands the motor `{head}`, so an event cannot set `{shown}`", control.name);
        return Some((message, format!("set {} instead", quoted(references.iter().map(String::as_str)))));
    }
    if is_kind("shaft") && (tail == "phi" || tail == "w") {
        return Some((format!("`{shown}` follows from the equations, so an event cannot set it"), all()));
    }
    let known = Known { document, signals: Vec::new(), doubtful: model.doubtful.clone() };
    if known.may_have(signal) {
        return None;
    }
    let help = nearest(signal, names()).map_or_else(all, |near| format!("did you mean `{near}`?"));
    Some((format!("there is no signal `{shown}` that an event can set"), help))
}

/// The scenario. `coordinates` are the reduced coordinates if they are known.
fn scenario(
    document: &Document,
    model: &Model,
    equations: &Equations,
    coordinates: Option<&[String]>,
    settings: &[Setting],
    out: &mut Vec<Diagnostic>,
) -> Scenario {
    let reader = TableReader::new(document, settings);
    let table = &document.scenario;
    let time = |table: &Table, key: &str, sign: Sign, what: &str, out: &mut Vec<Diagnostic>| {
        quantity(&reader, table, key, (Dimension::TIME, sign), what, out)
    };
    // Left out is not the same as unreadable.
    let mut or_default = |key: &str, default: Exact| {
        let left_out = !table.values.contains_key(key) && !table.unread.contains(&key);
        if left_out { Some(default) } else { time(table, key, Sign::Positive, "`[scenario]`", out) }
    };
    let duration = or_default("duration", Exact::one());
    let step = or_default("output_step", Exact::from_ratio(1, 1000));
    let sources = sources(model, equations, document, out);
    let mut events = Vec::new();
    let mut times = Vec::new();
    let tables = match table.values.get("event").map(|spanned| &spanned.value) {
        Some(Value::Tables(tables)) => tables.as_slice(),
        _ => &[],
    };
    for (i, event) in tables.iter().enumerate() {
        let what = &format!("entry {} of `event` of `[scenario]`", i + 1);
        let at = time(event, "at", Sign::NonNegative, what, out);
        let over = time(event, "over", Sign::NonNegative, what, out);
        if let (Some(at), Some(duration)) = (&at, &duration)
            && at.to_f64() >= duration.to_f64()
        {
            let message =
                format!("this event at {} s never happens: the run ends at {} s", at.to_f64(), duration.to_f64());
            out.push(
                Diagnostic::warning("event::late", message)
                    .at(TableReader::span(event, "at"), "after the end")
                    .help("lengthen `duration` or move the event"),
            );
        }
        let Some(signal) = read_word(event, "signal") else { continue };
        let Some(source) = sources.iter().position(|source| source.name == signal) else {
            if let Some((message, help)) = not_settable(signal, &sources, document, model) {
                out.push(
                    Diagnostic::error("name::unknown", format!("{what}: {message}"))
                        .at(TableReader::span(event, "signal"), "not settable")
                        .help(help),
                );
            }
            continue;
        };
        let dimension = physical_dimension(sources[source].physical);
        let to = quantity(&reader, event, "to", (dimension, Sign::Any), what, out);
        let (Some(at), Some(to)) = (at, to) else { continue };
        times.push(at.clone());
        if let Some(over) = over.as_ref().filter(|over| !over.is_zero()) {
            times.push(Exact::new(at.to_rational() + over.to_rational(), 0));
        }
        events.push(SignalEvent { source, at: at.to_f64(), to: to.to_f64(), over: over.map_or(0.0, |x| x.to_f64()) });
    }
    let times = match (&duration, &step) {
        (Some(duration), Some(step)) if check_rows(document, duration, step, times.len(), out) => {
            output_times(duration, step, &times)
        }
        _ => vec![0.0],
    };
    let (position, speed) = initial_state(&reader, document, coordinates, out);
    let duration = duration.map_or(0.0, |duration| duration.to_f64());
    Scenario { duration, times, sources, events, position, speed }
}

/// Whether the results fit into memory.
fn check_rows(document: &Document, duration: &Exact, step: &Exact, events: usize, out: &mut Vec<Diagnostic>) -> bool {
    let runs: f64 = document.variants.iter().map(|variants| variants.values.len() as f64).product();
    let most = MOST_ROWS.min(MOST_ROWS_OF_ALL / runs);
    let rows = duration.to_f64() / step.to_f64() + 100.0 * events as f64;
    if rows <= most {
        return true;
    }
    let shown = if rows < 1e9 { format!("{rows:.0}") } else { format!("about {rows:.0e}") };
    let shown = if rows.is_finite() { shown } else { "endlessly many".to_string() };
    let each = if runs > 1.0 { format!(" for each of {runs} variants") } else { String::new() };
    let key = if document.scenario.values.contains_key("output_step") { "output_step" } else { "duration" };
    out.push(
        Diagnostic::error("scenario::rows", format!("the results would have {shown} rows{each}, more than {most:.0}"))
            .at(TableReader::span(&document.scenario, key), "too fine for this duration")
            .help(format!("choose an output_step of at least {:.3e} s", duration.to_f64() / (0.9 * most))),
    );
    false
}

/// Multiples of the step, quarters of it for 20 steps after each event, the event times and the end; each is the number
/// nearest to its exact value.
fn output_times(duration: &Exact, step: &Exact, events: &[Exact]) -> Vec<f64> {
    let end = duration.to_f64();
    let ratio = step.to_rational();
    let mut times: Vec<f64> = Vec::new();
    let (numerator, denominator) =
        (rational_to_f64(&Rational::from(ratio.numerator().clone())), ratio.denominator().clone());
    let denominator = rational_to_f64(&Rational::from(denominator));
    // A quotient of two whole numbers below 2^53 is rounded once.
    let multiple = |k: f64| {
        if numerator * k < 9e15 && denominator < 9e15 { numerator * k / denominator } else { step.to_f64() * k }
    };
    let count = (end / step.to_f64()).floor() as usize;
    times.extend((0..=count).map(|k| multiple(k as f64)));
    for event in events {
        let event = event.to_rational();
        let quarter = &ratio / Rational::from(4);
        times.extend((0..=80).map(|k| rational_to_f64(&(&event + &quarter * Rational::from(k)))));
    }
    times.push(end);
    times.retain(|time| (0.0..=end).contains(time));
    times.sort_by(f64::total_cmp);
    times.dedup_by(|b, a| *b - *a <= 1e-12 * end);
    if let Some(last) = times.last_mut() {
        *last = end;
    }
    times
}

/// Positions and speeds of the coordinates; of none if these are not known.
fn initial_state(
    reader: &TableReader<'_>,
    document: &Document,
    coordinates: Option<&[String]>,
    out: &mut Vec<Diagnostic>,
) -> (Vec<f64>, Vec<f64>) {
    let names = coordinates.unwrap_or_default();
    let (mut position, mut speed) = (vec![0.0; names.len()], vec![0.0; names.len()]);
    let Some(Value::Map(entries)) = document.scenario.values.get("initial").map(|spanned| &spanned.value) else {
        return (position, speed);
    };
    let shafts: Vec<&str> =
        document.elements.iter().filter(|e| e.kind.keyword == "shaft").map(|e| e.name.as_str()).collect();
    for (name, scalar) in entries {
        let (shaft, tail) = name.value.rsplit_once('.').unwrap_or((&name.value, ""));
        let coordinate = names.iter().position(|n| n == shaft);
        let is_shaft = shafts.contains(&shaft);
        let target = match (tail, coordinate) {
            ("phi", Some(k)) => Some((Some(&mut position[k]), Dimension::ANGLE)),
            ("w", Some(k)) => Some((Some(&mut speed[k]), Dimension::ANGULAR_VELOCITY)),
            ("phi", None) if coordinates.is_none() && is_shaft => Some((None, Dimension::ANGLE)),
            ("w", None) if coordinates.is_none() && is_shaft => Some((None, Dimension::ANGULAR_VELOCITY)),
            _ => None,
        };
        let Some((target, dimension)) = target else {
            if coordinates.is_none() && document.doubts.has(shaft) {
                continue;
            }
            let usable: Vec<&str> =
                if coordinates.is_some() { names.iter().map(String::as_str).collect() } else { shafts.clone() };
            let known: Vec<String> = usable.iter().flat_map(|n| [format!("{n}.phi"), format!("{n}.w")]).collect();
            let known = || known.iter().map(String::as_str);
            let shown = shortened(&name.value);
            let (message, help) = if is_shaft && matches!(tail, "phi" | "w") {
                let help =
                    format!("the coordinates give {}; `coordinates` of `[model]` chooses others", quoted(known()));
                (format!("`{shaft}` is not a coordinate, its motion follows from them"), help)
            } else {
                let help = nearest(&name.value, known())
                    .map_or_else(|| format!("there are {}", quoted(known())), |near| format!("did you mean `{near}`?"));
                (format!("`{shown}` is not the angle or speed of a coordinate"), help)
            };
            out.push(
                Diagnostic::error("name::unknown", format!("`initial` of `[scenario]`: {message}"))
                    .at(name.span.clone(), "not a coordinate")
                    .help(help),
            );
            continue;
        };
        let label = format!("`{}` in `initial` of `[scenario]`", name.value);
        let value = of_dimension(reader, scalar, (dimension, Sign::Any), &label, out);
        if let (Some(target), Some(value)) = (target, value) {
            *target = value.to_f64();
        }
    }
    (position, speed)
}

/// The physical kind of a signal; an unknown name is reported.
fn known_signal(
    name: &str,
    span: &Range<usize>,
    known: &Known<'_>,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Physical> {
    if let Some((_, physical)) = known.signals.iter().find(|(other, _)| other == name) {
        return Some(*physical);
    }
    if known.may_have(name) {
        return None;
    }
    let names = || known.signals.iter().map(|(name, _)| name.as_str());
    let head = name.split('.').next().unwrap_or_default();
    let of_head = || names().filter(|other| other.split('.').next() == Some(head));
    let help = match nearest(name, of_head()).or_else(|| nearest(name, names())) {
        Some(near) => format!("did you mean `{near}`?"),
        None if of_head().next().is_some() => format!("`{}` has {}", shortened(head), quoted(of_head())),
        None if known.signals.is_empty() => "the model has no signals".to_string(),
        None => format!("there are {}", quoted(names())),
    };
    let message = format!("{what}: there is no signal `{}`", shortened(name));
    out.push(Diagnostic::error("name::unknown", message).at(span.clone(), "no such signal").help(help));
    None
}

fn known_variants(
    table: &Table,
    names: &[String],
    known: &Known<'_>,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let words = read_words(table, "variants");
    let doubts = &known.document.doubts;
    for word in words.iter().filter(|word| !names.contains(&word.value) && !doubts.variants && !doubts.all) {
        let there: Vec<&str> = names.iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
        let help = match nearest(&word.value, there.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None if there.is_empty() => "the model has no `[variants]`; leave this key out".to_string(),
            None => format!("there are {}", quoted(there)),
        };
        let message = format!("{what}: there is no variant `{}`", shortened(&word.value));
        out.push(Diagnostic::error("name::unknown", message).at(word.span.clone(), "no such variant").help(help));
    }
    words.iter().map(|word| word.value.clone()).collect()
}

fn requirements(known: &Known<'_>, variants: &[String], out: &mut Vec<Diagnostic>) -> Vec<Requirement> {
    let document = known.document;
    let reader = TableReader::new(document, &[]);
    let time = (Dimension::TIME, Sign::NonNegative);
    let mut silent = Vec::new();
    let duration =
        match document.scenario.values.contains_key("duration") || document.scenario.unread.contains(&"duration") {
            true => quantity(&reader, &document.scenario, "duration", time, "", &mut silent).map(|x| x.to_f64()),
            false => Some(1.0),
        };
    let mut requirements = Vec::new();
    for table in &document.requirements {
        let what = "`[[requirement]]`";
        let variants = known_variants(table, variants, known, what, out);
        let here = |key: &str| table.values.contains_key(key) || table.unread.contains(&key);
        if !here("below") && !here("above") {
            out.push(
                Diagnostic::error("key::missing", format!("{what}: a bound is missing"))
                    .at(table.span.clone(), "neither `below` nor `above`")
                    .help("add `below = \"...\"`, `above = \"...\"` or both"),
            );
        }
        for key in ["below", "above", "from", "until"] {
            if let Some(Spanned { value: Written::Parameter(name), span }) = read_scalar(table, key)
                && document.variants.iter().any(|variants| variants.parameter.value == name)
            {
                let message = format!("`{key}` of {what}: `{name}` differs between the variants");
                out.push(
                    Diagnostic::error("requirement::varied", message)
                        .at(span, "a varied parameter")
                        .help("write a number, and one requirement for each variant: `variants = [...]`"),
                );
            }
        }
        let signal = read_word(table, "signal");
        let physical =
            signal.and_then(|name| known_signal(name, &TableReader::span(table, "signal"), known, what, out));
        let mut number = |key: &str, expected| quantity(&reader, table, key, expected, what, out).map(|x| x.to_f64());
        let (from, until) = (number("from", time), number("until", time));
        let bounds = physical.map(|physical| {
            let dimension = (physical_dimension(physical), Sign::Any);
            (number("below", dimension), number("above", dimension))
        });
        let end = until.unwrap_or(f64::INFINITY).min(duration.unwrap_or(f64::INFINITY));
        let begin = from.unwrap_or(0.0);
        if begin > end {
            let (key, other) = if until.is_some_and(|until| until <= end) { ("until", end) } else { ("from", end) };
            let message = format!("{what}: the window is empty: it begins at {begin} s and ends at {other} s");
            out.push(
                Diagnostic::error("requirement::window", message)
                    .at(TableReader::span(table, key), "no time is left")
                    .help("let `from` come before `until`, and both before the end of the run (`duration`)"),
            );
        }
        if let Some((Some(below), Some(above))) = bounds
            && above >= below
        {
            let message = format!("{what}: nothing is above {above} and below {below}");
            out.push(
                Diagnostic::error("requirement::bounds", message)
                    .at(TableReader::span(table, "below"), "not above `above`")
                    .help("let `above` be less than `below`, or write two requirements"),
            );
        }
        if let (Some(signal), Some(measure), Some((below, above))) = (signal, read_word(table, "measure"), bounds) {
            requirements.push(Requirement {
                signal: signal.into(),
                measure: measure.into(),
                below,
                above,
                from: begin,
                until: until.unwrap_or(f64::INFINITY),
                variants,
            });
        }
    }
    requirements
}

fn plots(known: &Known<'_>, variants: &[String], out: &mut Vec<Diagnostic>) -> Vec<Plot> {
    let mut plots: Vec<Plot> = Vec::new();
    let mut places: Vec<Range<usize>> = Vec::new();
    for table in &known.document.plots {
        let id = read_word(table, "name").unwrap_or_default().to_string();
        let what = if id.is_empty() { "`[[plot]]`".to_string() } else { format!("plot `{id}`") };
        let place = TableReader::span(table, "name");
        if let Some(other) = plots.iter().position(|plot| plot.id.eq_ignore_ascii_case(&id) && !id.is_empty()) {
            out.push(
                Diagnostic::error("name::duplicate", format!("there are two plots named `{id}`"))
                    .at(place.clone(), "again here")
                    .at(places[other].clone(), "first here")
                    .help("give each plot a name of its own; it becomes a file name"),
            );
        }
        let variants = known_variants(table, variants, known, &what, out);
        let mut signals = |key: &str| {
            let words = read_words(table, key);
            for word in words {
                known_signal(&word.value, &word.span, known, &what, out);
            }
            words.iter().map(|word| word.value.clone()).collect::<Vec<_>>()
        };
        let (drawn, references) = (signals("signals"), signals("references"));
        if drawn.is_empty() && table.values.contains_key("signals") {
            out.push(
                Diagnostic::error("list::length", format!("{what}: there is nothing to draw"))
                    .at(TableReader::span(table, "signals"), "no signal")
                    .help("list one or more signals: `signals = [\"rk.phi\"]`"),
            );
        }
        places.push(place);
        plots.push(Plot {
            id,
            title: read_word(table, "title").unwrap_or_default().into(),
            caption: read_word(table, "caption").unwrap_or_default().into(),
            signals: drawn,
            references,
            variants,
        });
    }
    plots
}

fn tolerance(document: &Document, out: &mut Vec<Diagnostic>) -> Tolerance {
    let reader = TableReader::new(document, &[]);
    let relative = quantity(
        &reader,
        &document.scenario,
        "relative_tolerance",
        (Dimension::NONE, Sign::Positive),
        "`[scenario]`",
        out,
    );
    let Some(relative) = relative.map(|x| x.to_f64()) else { return Tolerance::default() };
    if !(1e-13..=1e-3).contains(&relative) {
        out.push(
            Diagnostic::error("scenario::tolerance", format!("a relative tolerance of {relative:e} is out of range"))
                .at(TableReader::span(&document.scenario, "relative_tolerance"), "from 1e-13 to 1e-3")
                .help("leave it out for 1e-10, which suits almost every study"),
        );
    }
    Tolerance { relative, absolute: 1e-2 * relative }
}
