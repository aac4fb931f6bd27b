//! Everything that can be known before a run: all mistakes of a model file at once, and the runs ready to start.

use std::collections::BTreeMap;
use std::ops::Range;

use super::Requirement;
use crate::assemble::assemble;
use crate::diagnostics::{Diagnostic, Severity, nearest};
use crate::equations::{InputKind, Term};
use crate::model::{Document, Model, Setting, TableReader, read};
use crate::num::{Definiteness, Rational, Scalar, definiteness, rational_to_f64};
use crate::reduce::{Dependency, Kinematics, LinearModel, ReduceError, Reduced, linearise, reduce};
use crate::results::{Physical, Plot};
use crate::schema::{Scalar as Written, Spanned, Table, Value};
use crate::simulate::{Scenario, SignalEvent, Source, SourceTarget, Tolerance, signal_names};
use crate::synthesis::{Law, Request};
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

    fn try_laws(&self) -> Vec<Result<Box<dyn Law>, crate::synthesis::SynthesisError>> {
        let design = |(control, model): (&crate::model::ControlSpec, &LinearModel)| {
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

/// Reads, checks and designs a study. The result can be run only if no diagnostic is an error.
pub fn prepare(source: &str) -> (Prepared, Vec<Diagnostic>) {
    let (document, mut out) = read(source);
    let mut prepared = Prepared::default();
    if out.iter().any(|d| d.code == "file::empty") {
        return (prepared, out);
    }
    let broken = out.iter().any(|d| d.severity == Severity::Error);
    for (label, settings) in document.variant_settings() {
        let (model, mistakes) = document.model(&settings);
        let wrong = mistakes.iter().any(|d| d.severity == Severity::Error);
        add_new(&mut out, mistakes);
        prepared.name.clone_from(&model.name);
        prepared.description.clone_from(&model.description);
        if wrong || broken {
            continue;
        }
        let name = if label.is_empty() { file_stem(&model.name) } else { label };
        let mut mistakes = Vec::new();
        let variant = prepare_variant(&document, name, model, &settings, &mut mistakes);
        add_new(&mut out, mistakes);
        prepared.variants.extend(variant);
    }
    let mut mistakes = Vec::new();
    let first = prepared.variants.first().map(|v| signal_names(&v.reduced, &v.scenario));
    let names: Vec<String> = document.variant_settings().into_iter().map(|(name, _)| name).collect();
    prepared.requirements = requirements(&document, first.as_deref(), &names, &mut mistakes);
    prepared.plots = plots(&document, first.as_deref(), &names, &mut mistakes);
    prepared.tolerance = tolerance(&document, &mut mistakes);
    add_new(&mut out, mistakes);
    out.sort_by_key(|d| (d.labels.first().map_or(usize::MAX, |label| label.span.start), d.severity == Severity::Warning));
    (prepared, out)
}

/// The same mistake of several variants is told once.
fn add_new(out: &mut Vec<Diagnostic>, found: Vec<Diagnostic>) {
    for diagnostic in found {
        let told = |d: &Diagnostic| d.code == diagnostic.code && d.labels == diagnostic.labels && d.message == diagnostic.message;
        if !out.iter().any(told) {
            out.push(diagnostic);
        }
    }
}

fn file_stem(name: &str) -> String {
    let stem: String = name.chars().map(|c| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' }).collect();
    if stem.chars().all(|c| c == '.' || c == '-') { "run".into() } else { stem }
}

fn span_of(document: &Document, element: &str) -> Range<usize> {
    document.elements.iter().find(|e| e.name == element).map_or(0..0, |e| e.span.clone())
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
    let mut design_models = Vec::new();
    for control in &model.controls {
        design_models.push(design_model(document, &reduced, settings, control, out)?);
    }
    let scenario = scenario(document, &model, &reduced, settings, out);
    let variant = PreparedVariant { name, model, reduced, design_models, scenario };
    for (law, control) in variant.try_laws().into_iter().zip(&variant.model.controls) {
        if let Err(error) = law {
            out.push(
                Diagnostic::error("control::design", format!("control `{}`: {error}", control.name))
                    .at(control.span.clone(), "this controller")
                    .help("choose other outputs or inputs; `kardan equations` shows what each input reaches"),
            );
        }
    }
    Some(variant)
}

/// The linear model that a law is designed on: its own parameter values, no friction.
fn design_model(
    document: &Document,
    reduced: &Reduced,
    settings: &[Setting],
    control: &crate::model::ControlSpec,
    out: &mut Vec<Diagnostic>,
) -> Option<LinearModel> {
    let zero = vec![0.0; reduced.freedoms()];
    if control.design.is_empty() {
        return Some(linearise(reduced, &zero));
    }
    let kept = settings.iter().filter(|s| control.design.iter().all(|d| d.name != s.name));
    let all: Vec<Setting> = kept.chain(&control.design).cloned().collect();
    let (model, mistakes) = document.model(&all);
    let wrong = mistakes.iter().any(|d| d.severity == Severity::Error);
    add_new(out, mistakes);
    if wrong {
        return None;
    }
    match reduce(assemble(&model.shafts, &model.terms), Some(&reduced.coordinate_names())) {
        Ok(design) => Some(linearise(&design, &zero)),
        Err(error) => {
            let message = format!("control `{}`: its design model cannot be reduced: {error}", control.name);
            out.push(
                Diagnostic::error("control::design", message)
                    .at(control.span.clone(), "this controller")
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
        let names: Vec<String> = away.iter().map(|name| format!("`{name}`")).collect();
        let message = format!("the model falls apart: nothing connects {} with `{}`", names.join(", "), model.shafts[0]);
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
                let names: Vec<String> = elements.iter().map(|(name, _)| format!("`{name}`")).collect();
                let sum: Vec<String> = elements.iter().map(|(name, x)| format!("({x})·{name}")).collect();
                let verdict = if *contradiction { "their offsets contradict each other" } else { "one of them is superfluous" };
                let message = format!(
                    "the constraints {} are linearly dependent (rank {rank}): {} = 0, and {verdict}",
                    names.join(", "),
                    sum.join(" + ")
                );
                let mut out = Diagnostic::error("constraint::dependent", message);
                for (name, x) in elements {
                    out = out.at(span_of(document, name), format!("taken {x} times"));
                }
                out.help("remove one of them, or correct a ratio")
            })
            .collect(),
        ReduceError::NoMotion { .. } => vec![
            Diagnostic::error("constraint::no-motion", error.to_string())
                .help("remove a constraint, or add a shaft: a model needs at least one degree of freedom"),
        ],
        ReduceError::CoordinateCount { suggestion, .. } | ReduceError::CoordinatesDependent { suggestion, .. } => vec![
            Diagnostic::error("coordinates::choice", error.to_string())
                .at(coordinates, "these coordinates")
                .help(suggest(suggestion)),
        ],
        ReduceError::NotExplicit { elements, suggestion } => {
            let mut out = Diagnostic::error("constraint::loop", error.to_string());
            for name in elements {
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
    let positions: Vec<Vec<f64>> =
        if constant { vec![vec![0.0; r]] } else { (0..8).map(|k| vec![f64::from(k) * std::f64::consts::PI / 8.0; r]).collect() };
    let negative: Vec<&str> = reduced
        .equations
        .dampers
        .iter()
        .filter(|damper| damper.value.signum() < 0)
        .map(|damper| damper.element.as_str())
        .collect();
    let mut passive = true;
    for position in &positions {
        let model = linearise(reduced, position);
        match definiteness(&model.inertia) {
            Definiteness::Positive => {}
            Definiteness::PositiveSemi { direction } | Definiteness::Indefinite { witness: direction } => {
                let shafts = moving(reduced, &model, &direction);
                let names: Vec<String> = shafts.iter().map(|name| format!("`{name}`")).collect();
                let message = format!("a motion without inertia is possible: {} can move while no mass does", names.join(", "));
                let mut diagnostic = Diagnostic::error("model::massless", message);
                for name in &shafts {
                    diagnostic = diagnostic.at(span_of(document, name), "moves without inertia");
                }
                out.push(diagnostic.help("give one of these shafts an inertia, or tie it to another shaft by a gear"));
                return false;
            }
        }
        if passive
            && !negative.is_empty()
            && let Definiteness::Indefinite { witness } = definiteness(&model.damping)
        {
            passive = false;
            let shafts = moving(reduced, &model, &witness);
            let names: Vec<String> = shafts.iter().map(|name| format!("`{name}`")).collect();
            let message = format!(
                "the damping is not passive: a motion of {} gains energy from it (the reduced damping matrix is not \
                 positive semidefinite)",
                names.join(", ")
            );
            let mut diagnostic = Diagnostic::error("damping::not-passive", message);
            for name in &negative {
                diagnostic = diagnostic.at(span_of(document, name), "negative damping");
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
                    .at(span_of(document, name), "negative damping")
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

/// A quantity of a table in SI, checked against a dimension.
fn quantity(
    reader: &TableReader<'_>,
    table: &Table,
    key: &str,
    dimension: Dimension,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Exact> {
    let scalar = read_scalar(table, key)?;
    let label = format!("`{key}` of {what}");
    let (value, found) = reader.scalar(&scalar, None, &label, out)?;
    if found != dimension {
        let message = format!("{label}: expected {}, found {}", dimension.noun(), found.noun());
        out.push(
            Diagnostic::error("unit::dimension", message)
                .at(scalar.span, found.noun())
                .help(format!("write a unit such as {}", dimension.example())),
        );
        return None;
    }
    Some(value)
}

/// Signals that events may set: references of laws, disturbances, torques of motors without a law.
fn sources(model: &Model, reduced: &Reduced, document: &Document, out: &mut Vec<Diagnostic>) -> Vec<Source> {
    let mut sources: Vec<Source> = Vec::new();
    let mut commanded: Vec<String> = Vec::new();
    for control in &model.controls {
        commanded.extend((control.law.inputs)(&control.values));
        for reference in (control.law.references)(&control.values) {
            let clash = document.elements.iter().any(|e| e.name == reference.name)
                || sources.iter().any(|s| s.name == reference.name && s.physical != reference.physical);
            if clash {
                let message = format!("control `{}`: the name `{}` is already taken", control.name, reference.name);
                out.push(
                    Diagnostic::error("name::duplicate", message)
                        .at(control.span.clone(), "this controller")
                        .help("give the reference a name of its own, such as `ref_rack`"),
                );
            } else if !sources.iter().any(|s| s.name == reference.name) {
                sources.push(Source {
                    name: reference.name,
                    physical: reference.physical,
                    description: reference.description,
                    target: SourceTarget::Reference,
                });
            }
        }
    }
    for (k, input) in reduced.equations.inputs.iter().enumerate() {
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

fn scenario(
    document: &Document,
    model: &Model,
    reduced: &Reduced,
    settings: &[Setting],
    out: &mut Vec<Diagnostic>,
) -> Scenario {
    let reader = TableReader::new(document, settings);
    let table = &document.scenario;
    let time = |table: &Table, key: &str, what: &str, out: &mut Vec<Diagnostic>| {
        quantity(&reader, table, key, Dimension::TIME, what, out)
    };
    let duration = time(table, "duration", "`[scenario]`", out).unwrap_or_else(Exact::one);
    let step = time(table, "output_step", "`[scenario]`", out).unwrap_or_else(|| Exact::from_ratio(1, 1000));
    let sources = sources(model, reduced, document, out);
    let mut events = Vec::new();
    let mut times = Vec::new();
    let tables = match table.values.get("event").map(|spanned| &spanned.value) {
        Some(Value::Tables(tables)) => tables.as_slice(),
        _ => &[],
    };
    for event in tables {
        let what = "`[[scenario.event]]`";
        let at = time(event, "at", what, out);
        let over = time(event, "over", what, out);
        let Some(signal) = read_word(event, "signal") else { continue };
        let Some(source) = sources.iter().position(|source| source.name == signal) else {
            let names = sources.iter().map(|source| source.name.as_str());
            let help = match nearest(signal, names.clone()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => {
                    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
                    format!("events can set {}", if names.is_empty() { "nothing here: there is no input".into() } else { names.join(", ") })
                }
            };
            let message = format!("{what}: there is no signal `{signal}` that an event can set");
            out.push(
                Diagnostic::error("name::unknown", message).at(TableReader::span(event, "signal"), "not settable").help(help),
            );
            continue;
        };
        let dimension = physical_dimension(sources[source].physical);
        let (Some(at), Some(to)) = (at, quantity(&reader, event, "to", dimension, what, out)) else { continue };
        if at.to_f64() >= duration.to_f64() {
            let message = format!("this event at {} s never happens: the run ends at {} s", at.to_f64(), duration.to_f64());
            out.push(
                Diagnostic::warning("event::late", message)
                    .at(TableReader::span(event, "at"), "after the end")
                    .help("lengthen `duration` or move the event"),
            );
        }
        times.push(at.clone());
        if let Some(over) = over.as_ref().filter(|over| !over.is_zero()) {
            times.push(Exact::new(at.to_rational() + over.to_rational(), 0));
        }
        events.push(SignalEvent { source, at: at.to_f64(), to: to.to_f64(), over: over.map_or(0.0, |x| x.to_f64()) });
    }
    let rows = duration.to_f64() / step.to_f64() + 100.0 * times.len() as f64;
    let times = if rows > MOST_ROWS {
        let message = format!("the results would have {rows:.0} rows, more than {MOST_ROWS:.0}");
        out.push(
            Diagnostic::error("scenario::rows", message)
                .at(TableReader::span(table, "output_step"), "too fine for this duration")
                .help(format!("choose an output_step of at least {:.3e} s", duration.to_f64() / (0.9 * MOST_ROWS))),
        );
        vec![0.0, duration.to_f64()]
    } else {
        output_times(&duration, &step, &times)
    };
    let (position, speed) = initial_state(&reader, table, reduced, out);
    Scenario { duration: duration.to_f64(), times, sources, events, position, speed }
}

/// Multiples of the step, quarters of it for 20 steps after each event, the event times and the end; each is the number
/// nearest to its exact value.
fn output_times(duration: &Exact, step: &Exact, events: &[Exact]) -> Vec<f64> {
    let end = duration.to_f64();
    let ratio = step.to_rational();
    let mut times: Vec<f64> = Vec::new();
    let (numerator, denominator) = (rational_to_f64(&Rational::from(ratio.numerator().clone())), ratio.denominator().clone());
    let denominator = rational_to_f64(&Rational::from(denominator));
    // A quotient of two whole numbers below 2^53 is rounded once.
    let multiple = |k: f64| if numerator * k < 9e15 && denominator < 9e15 { numerator * k / denominator } else { step.to_f64() * k };
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

fn initial_state(
    reader: &TableReader<'_>,
    table: &Table,
    reduced: &Reduced,
    out: &mut Vec<Diagnostic>,
) -> (Vec<f64>, Vec<f64>) {
    let names = reduced.coordinate_names();
    let (mut position, mut speed) = (vec![0.0; names.len()], vec![0.0; names.len()]);
    let Some(Value::Map(entries)) = table.values.get("initial").map(|spanned| &spanned.value) else {
        return (position, speed);
    };
    for (name, scalar) in entries {
        let coordinate = |suffix: &str| {
            name.value.strip_suffix(suffix).and_then(|shaft| names.iter().position(|n| n == shaft))
        };
        let target = match (coordinate(".phi"), coordinate(".w")) {
            (Some(k), _) => Some((&mut position[k], Dimension::ANGLE)),
            (None, Some(k)) => Some((&mut speed[k], Dimension::ANGULAR_VELOCITY)),
            _ => None,
        };
        let Some((target, dimension)) = target else {
            let known: Vec<String> = names.iter().map(|n| format!("`{n}.phi`, `{n}.w`")).collect();
            let message = format!("`initial` of `[scenario]`: `{}` is not the angle or speed of a coordinate", name.value);
            out.push(
                Diagnostic::error("name::unknown", message)
                    .at(name.span.clone(), "not a coordinate")
                    .help(format!("the coordinates give {}; all other shafts follow", known.join(", "))),
            );
            continue;
        };
        let label = format!("`{}` in `initial` of `[scenario]`", name.value);
        if let Some((value, found)) = reader.scalar(scalar, None, &label, out) {
            if found == dimension {
                *target = value.to_f64();
            } else {
                let message = format!("{label}: expected {}, found {}", dimension.noun(), found.noun());
                out.push(
                    Diagnostic::error("unit::dimension", message)
                        .at(scalar.span.clone(), found.noun())
                        .help(format!("write a unit such as {}", dimension.example())),
                );
            }
        }
    }
    (position, speed)
}

/// The physical kind of a signal; an unknown name is reported.
fn known_signal(
    name: &str,
    span: &Range<usize>,
    known: Option<&[(String, Physical)]>,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Physical> {
    let known = known?;
    if let Some((_, physical)) = known.iter().find(|(other, _)| other == name) {
        return Some(*physical);
    }
    let names = known.iter().map(|(name, _)| name.as_str());
    let help = match nearest(name, names.clone()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are {}", names.map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")),
    };
    let message = format!("{what}: there is no signal `{name}`");
    out.push(Diagnostic::error("name::unknown", message).at(span.clone(), "no such signal").help(help));
    None
}

fn known_variants(table: &Table, names: &[String], what: &str, out: &mut Vec<Diagnostic>) -> Vec<String> {
    let words = read_words(table, "variants");
    for word in words {
        if !names.contains(&word.value) {
            let help = match nearest(&word.value, names.iter().map(String::as_str)) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("there are {}", names.join(", ")),
            };
            let message = format!("{what}: there is no variant `{}`", word.value);
            out.push(Diagnostic::error("name::unknown", message).at(word.span.clone(), "no such variant").help(help));
        }
    }
    words.iter().map(|word| word.value.clone()).collect()
}

fn requirements(
    document: &Document,
    known: Option<&[(String, Physical)]>,
    variants: &[String],
    out: &mut Vec<Diagnostic>,
) -> Vec<Requirement> {
    let reader = TableReader::new(document, &[]);
    let mut requirements = Vec::new();
    for table in &document.requirements {
        let what = "`[[requirement]]`";
        let variants = known_variants(table, variants, what, out);
        let (Some(signal), Some(measure)) = (read_word(table, "signal"), read_word(table, "measure")) else { continue };
        if !table.values.contains_key("below") && !table.values.contains_key("above") {
            out.push(
                Diagnostic::error("key::missing", format!("{what}: a bound is missing"))
                    .at(table.span.clone(), "neither `below` nor `above`")
                    .help("add `below = \"...\"`, `above = \"...\"` or both"),
            );
        }
        let Some(physical) = known_signal(signal, &TableReader::span(table, "signal"), known, what, out) else { continue };
        let dimension = physical_dimension(physical);
        let mut number = |key: &str, dimension| quantity(&reader, table, key, dimension, what, out).map(|x| x.to_f64());
        requirements.push(Requirement {
            signal: signal.into(),
            measure: measure.into(),
            below: number("below", dimension),
            above: number("above", dimension),
            from: number("from", Dimension::TIME).unwrap_or(0.0),
            until: number("until", Dimension::TIME).unwrap_or(f64::INFINITY),
            variants,
        });
    }
    requirements
}

fn plots(
    document: &Document,
    known: Option<&[(String, Physical)]>,
    variants: &[String],
    out: &mut Vec<Diagnostic>,
) -> Vec<Plot> {
    let mut plots: Vec<Plot> = Vec::new();
    for table in &document.plots {
        let what = "`[[plot]]`";
        let variants = known_variants(table, variants, what, out);
        let mut signals = |key: &str| {
            let words = read_words(table, key);
            for word in words {
                known_signal(&word.value, &word.span, known, what, out);
            }
            words.iter().map(|word| word.value.clone()).collect::<Vec<_>>()
        };
        let (drawn, references) = (signals("signals"), signals("references"));
        let id = read_word(table, "name").unwrap_or_default().to_string();
        if !id.is_empty() && plots.iter().any(|plot| plot.id == id) {
            out.push(
                Diagnostic::error("name::duplicate", format!("{what}: there are two plots named `{id}`"))
                    .at(TableReader::span(table, "name"), "again here")
                    .help("give each plot a name of its own; it becomes a file name"),
            );
        }
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
    let relative = quantity(&reader, &document.scenario, "relative_tolerance", Dimension::NONE, "`[scenario]`", out);
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
