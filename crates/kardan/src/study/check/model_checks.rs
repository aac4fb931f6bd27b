//! Checks of a model: connected, reducible, with inertia, passive; with the messages if a check fails.

use crate::study::check::circuit::massless_loop;
use crate::study::read::locations::{
    MOST_LABELS, all_places, first_places, in_file_order, place_of, place_of_value, places_in_control,
};
use crate::study::read::positions::{generic_positions, is_finite_at};
use kardan_analysis::{combination, massless_direction};
use kardan_math::names::signed_sum;
use kardan_math::num::{Definiteness, Rational, Scalar, SparseRow, definiteness_of_rows, dense_rows, rational_to_f64};
use kardan_mechanics::assemble::MultiplierConstraint;
use kardan_mechanics::equations::{GROUND, MultiplierLaw, Term};
use kardan_mechanics::reduce::{
    Dependency, Kinematics, ReduceError, Reduced, SparseModel, inertia_with_rows, sparse_model,
};
use kardan_model::{ControlSpec, Document, Model};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_schema::entries::Place;
use kardan_schema::schema::Values;
use kardan_schema::schema::{Field, Kind};
use kardan_synthesis::{Advice, SynthesisError};
use std::collections::{BTreeMap, HashMap, HashSet};

/// The signals that the keys of a law name.
pub(in crate::study) fn signals_of(fields: &[Field], values: &Values) -> Vec<String> {
    let mut out = Vec::new();
    for field in fields {
        match field.kind {
            Kind::Signal | Kind::Output => out.extend(values.word(field.name).map(str::to_string)),
            Kind::Outputs => out.extend(values.names(field.name).unwrap_or_default().iter().cloned()),
            Kind::Tables(inner) | Kind::Table(inner) => {
                out.extend(
                    values.tables(field.name).unwrap_or_default().iter().flat_map(|values| signals_of(inner, values)),
                );
            }
            _ => {}
        }
    }
    out
}

pub(in crate::study) fn design_diagnostic(
    document: &Document,
    control: &ControlSpec,
    error: &SynthesisError,
) -> Diagnostic {
    let Advice { named, label, help } = error.advice.clone();
    let out = Diagnostic::error("control::design", format!("control `{}`: {error}", control.name)).help(help);
    let mut places: Vec<Place> =
        named.iter().flat_map(|word| places_in_control(document, control, word)).take(MOST_LABELS).collect();
    if places.is_empty() {
        places.push(control.place.clone());
    }
    out.at_each(in_file_order(places), label)
}

/// Whether the matrices of a model are representable, and its inertias are not lost in rounding.
pub(in crate::study) fn is_representable(model: &SparseModel) -> bool {
    let SparseModel { inertia, damping, stiffness, input, basis, .. } = model;
    let mut entries = [inertia, damping, stiffness, input, basis].into_iter().flatten().flatten();
    let mut diagonal = inertia.iter().enumerate().flat_map(|(k, row)| row.iter().filter(move |(j, _)| *j == k));
    let lost = |x: f64| !(x.is_normal() && (1.0 / x).is_finite());
    entries.all(|(_, x)| rational_to_f64(x).is_finite()) && !diagonal.any(|(_, x)| lost(rational_to_f64(x)))
}

/// Union-find of numbers: each points to another member of its part; the root points to itself.
struct Parts {
    above: Vec<usize>,
}

impl Parts {
    /// The root of a part.
    fn of(&mut self, mut number: usize) -> usize {
        while self.above[number] != number {
            self.above[number] = self.above[self.above[number]];
            number = self.above[number];
        }
        number
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.of(one), self.of(other));
        self.above[other] = one;
    }
}

/// Reports parts of the drivetrain that no element, circuit or law connects; circuits may be separate from it.
pub(in crate::study) fn check_connected(document: &Document, model: &Model, out: &mut Vec<Diagnostic>) {
    let charges: HashSet<String> = document.charges().into_iter().collect();
    let all = &model.all_coordinates;
    let mut parts = Parts { above: (0..all.len()).collect() };
    let number = |name: &&str| all.binary_search_by(|shaft| shaft.as_str().cmp(name)).ok();
    let mut join = |names: Vec<&str>| {
        let numbers: Vec<usize> = names.iter().filter_map(number).collect();
        numbers.windows(2).for_each(|pair| parts.join(pair[0], pair[1]));
    };
    let mut shafts_of_input: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    let mut branch_at: BTreeMap<&str, &str> = BTreeMap::new();
    for named in &model.terms {
        let shafts: Vec<&str> = match &named.term {
            Term::Output(_) => continue,
            Term::Balance { node, .. } if node == GROUND => continue,
            Term::Balance { node, .. } => {
                let own = named.term.coordinates();
                let joined: Vec<&str> = branch_at.get(node.as_str()).copied().into_iter().chain(own).collect();
                branch_at.extend(joined.first().map(|first| (node.as_str(), *first)));
                joined
            }
            // Its formula connects nothing.
            Term::UnilateralConstraint { direction, .. } => {
                direction.entries.iter().map(|(name, _)| name.as_str()).collect()
            }
            term => term.coordinates(),
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
    let (mut listed, mut places): (Vec<Vec<&str>>, HashMap<usize, usize>) = (Vec::new(), HashMap::new());
    for (number, name) in all.iter().enumerate().filter(|(_, name)| !charges.contains(*name)) {
        let place = *places.entry(parts.of(number)).or_insert(listed.len());
        match listed.get_mut(place) {
            Some(names) => names.push(name),
            None => listed.push(vec![name]),
        }
    }
    let Some(away) = listed.get(1) else { return };
    let shown: Vec<String> = listed.iter().take(MOST_LABELS).map(quoted).collect();
    let more = if listed.len() > shown.len() { "; and others" } else { "" };
    let message =
        format!("the model consists of {} parts that nothing connects: {}{more}", listed.len(), shown.join("; "));
    let help = "each part moves on its own; connect them by a gear or a spring_damper if that is not intended";
    out.push(
        Diagnostic::warning("model::disconnected", message).at(place_of(document, away[0]), "not connected").help(help),
    );
}

pub(in crate::study) fn reduce_diagnostics(document: &Document, model: &Model, error: &ReduceError) -> Vec<Diagnostic> {
    let suggest = |names: &[String]| {
        if names.is_empty() {
            "leave `coordinates` out to have them chosen".to_string()
        } else {
            let names: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
            format!("coordinates = [{}] would do", names.join(", "))
        }
    };
    let one = match error {
        ReduceError::ConstraintsDependent { rows, rank, dependencies } => {
            return dependencies.iter().map(|one| dependent_rows(document, one, *rank, *rows)).collect();
        }
        ReduceError::NoMotion { .. } if model.all_coordinates.len() == document.charges().len() => {
            Diagnostic::error("constraint::no-motion", "no current can flow: the circuit has no loop")
                .at_each(all_places(document, &model.all_coordinates), "carries no current")
                .help("close a loop: from a voltage_source through an inductor and back to `ground`")
        }
        ReduceError::NoMotion { .. } => {
            let rows = model.terms.iter().filter(|t| {
                matches!(t.term, Term::Constraint { .. } | Term::Transmission { .. } | Term::MultiplierLaw(_))
            });
            let mut places: Vec<Place> = rows.map(|named| place_of(document, &named.element)).collect();
            places.sort_by_key(Place::start);
            no_motion(error.to_string()).at_each(places.into_iter().take(MOST_LABELS), "a constraint")
        }
        ReduceError::CoordinateCount { suggestion, .. } | ReduceError::CoordinatesDependent { suggestion, .. } => {
            Diagnostic::error("coordinates::choice", error.to_string())
                .at(document.model.place_of("coordinates"), "these coordinates")
                .help(suggest(suggestion))
        }
        ReduceError::TooDeep { shaft, .. } => Diagnostic::error("constraint::depth", error.to_string())
            .at(place_of(document, shaft), "follows from all of them")
            .help("put a spring between some of them, or use one shaft where joints only transmit a motion"),
        ReduceError::NotExplicit { elements, suggestion, .. } => {
            let help = if model.coordinates.is_some() {
                suggest(suggestion)
            } else if model.terms.iter().any(|named| matches!(named.term, Term::Moving(_))) {
                "prescribe the driving end, or give `speed` in place of a position: kardan evaluates a curve only from \
                 its driving end"
                    .into()
            } else {
                "break the loop: two transmissions between the same shafts leave no motion".into()
            };
            Diagnostic::error("constraint::not-explicit", error.to_string())
                .at_each(first_places(document, elements), "part of the loop")
                .help(help)
        }
    };
    vec![one]
}

/// The error that no motion remains.
pub(in crate::study) fn no_motion(message: String) -> Diagnostic {
    Diagnostic::error("constraint::no-motion", message)
        .help("remove a constraint, or add a shaft: a model needs at least one degree of freedom")
}

/// Constraints of which one follows from the others, or contradicts them.
fn dependent_rows(document: &Document, dependency: &Dependency, rank: usize, rows: usize) -> Diagnostic {
    let Dependency { elements, contradiction, moving } = dependency;
    let names = quoted(elements.iter().map(|(name, _)| name));
    let (verdict, help) = match (contradiction, moving) {
        (true, _) => ("their offsets contradict each other", "remove one of them, or correct a ratio or an offset"),
        (_, true) => (
            "one of their offsets is a function of time, so they can agree at all times only by chance",
            "remove one of them",
        ),
        _ => ("one of them is redundant", "remove one of them, or correct a ratio"),
    };
    // Coefficients scaled so that the first is one.
    let unit = elements.first().map_or(1.0, |(_, x)| *x);
    let sum = signed_sum(elements.iter().map(|(name, x)| {
        let share = x / unit;
        let size = if share.abs() == 1.0 { String::new() } else { format!("{}·", share.abs()) };
        (share < 0.0, format!("{size}{name}"))
    }));
    let message = format!(
        "the constraints {names} are linearly dependent ({sum} = 0), and {verdict}; {rows} rows have the rank {rank}"
    );
    let mut out = Diagnostic::error("constraint::dependent", message);
    for (name, x) in elements.iter().take(MOST_LABELS) {
        out = out.at(place_of(document, name), format!("this row, times {}", x / unit));
    }
    out.help(help)
}

/// Inertia must be positive definite and damping positive semidefinite in every position; both are decided exactly at
/// the tested positions.
///
/// Motions without inertia go into `massless`: not every request needs their accelerations.
pub(in crate::study) fn check_matrices(
    document: &Document,
    reduced: &Reduced,
    out: &mut Vec<Diagnostic>,
    massless: &mut Vec<Diagnostic>,
) -> bool {
    let r = reduced.degrees_of_freedom();
    let positions: Vec<Vec<f64>> = if Kinematics::new(reduced).is_constant() {
        vec![vec![0.0; r]]
    } else {
        (0..8).map(|k| vec![f64::from(k) * std::f64::consts::PI / 8.0; r]).collect()
    };
    let dampers = reduced.equations.dampers.iter().filter(|damper| damper.value.signum() < 0);
    let negative: Vec<&str> = dampers.map(|damper| damper.element.as_str()).collect();
    let mut passive = true;
    for position in &positions {
        let model = match model_at(document, reduced, position) {
            Ok(model) => model,
            Err(diagnostic) => {
                out.push(diagnostic);
                return false;
            }
        };
        match definiteness_of_rows(&model.inertia) {
            Definiteness::Positive => {}
            Definiteness::PositiveSemi { .. } if reduced.equations.braced => {}
            Definiteness::PositiveSemi { .. } if massless.is_empty() => {
                massless.push(massless_motion(document, reduced, &model));
            }
            Definiteness::PositiveSemi { .. } => {}
            Definiteness::Indefinite { witness } => {
                out.push(negative_energy(document, &moving(reduced, &model.basis, &witness)));
                return false;
            }
        }
        if !is_representable(&model) {
            let message = "the numbers of the model differ too much in size: a reduced inertia, damping, stiffness \
                           or ratio is too large or too small for a number";
            let places = first_places(document, reduced.coordinate_names());
            let help = "check the exponents of inertias, dampings, stiffnesses and ratios";
            out.push(Diagnostic::error("number::range", message).at_each(places, "moves with it").help(help));
            return false;
        }
        if passive
            && !negative.is_empty()
            && let Definiteness::Indefinite { witness } = definiteness_of_rows(&model.damping)
        {
            passive = false;
            out.push(not_passive(document, &negative, &moving(reduced, &model.basis, &witness)));
        }
    }
    for name in negative.into_iter().filter(|_| passive) {
        let message = format!(
            "`{name}` has a negative damping; the model as a whole is passive (its reduced damping matrix is positive \
             semidefinite)"
        );
        out.push(
            Diagnostic::warning("damping::negative", message)
                .at(place_of_value(document, name, "damping"), "negative damping")
                .help("fine for an equivalent damping identified on a gear; otherwise correct its sign"),
        );
    }
    true
}

/// Whether multiplier constraints leave inertia in all remaining motions, though not all coordinates have one: decided at a generic position, with the
/// rounded rows there.
pub(in crate::study) fn is_braced(reduced: &Reduced) -> bool {
    let r = reduced.degrees_of_freedom();
    let is_definite = |rows: &[SparseRow]| matches!(definiteness_of_rows(rows), Definiteness::Positive);
    // A prescribed motion may have jumps in its acceleration; `without_massless` reports where kardan cannot simulate the result.
    let by_positions = |constraint: &MultiplierConstraint| {
        matches!(constraint.law, MultiplierLaw::Rates(_) | MultiplierLaw::Surface(_))
    };
    let multiplier_constraints = &reduced.equations.multiplier_constraints;
    if multiplier_constraints.is_empty()
        || !multiplier_constraints.iter().all(by_positions)
        || !is_finite_at(reduced, &vec![0.0; r])
    {
        return false;
    }
    let body_inertia = sparse_model(reduced, &vec![0.0; r]).inertia;
    let with_rows = |position: &Vec<f64>| inertia_with_rows(reduced, position).is_some_and(|rows| is_definite(&rows));
    !is_definite(&body_inertia) && generic_positions(r).iter().any(with_rows)
}

/// The linear model at a position.
fn model_at(document: &Document, reduced: &Reduced, position: &[f64]) -> Result<SparseModel, Diagnostic> {
    if is_finite_at(reduced, position) {
        return Ok(sparse_model(reduced, position));
    }
    let ratios = reduced.equations.constraints.iter().map(|row| row.element.as_str());
    let ratios = ratios.chain(reduced.equations.transmissions.iter().map(|row| row.element.as_str()));
    Err(Diagnostic::error("number::range", "an angle of the model is too large for a number")
        .at_each(first_places(document, ratios), "through this constraint")
        .help("check the exponents of ratios, coefficients and offsets"))
}

/// A motion of shafts with a negative kinetic energy.
fn negative_energy(document: &Document, shafts: &[(String, Rational)]) -> Diagnostic {
    let names = || shafts.iter().map(|(name, _)| name);
    let message = format!("a motion of {} has a negative kinetic energy", quoted(names()));
    Diagnostic::error("model::massless", message)
        .at_each(first_places(document, names()), "moves with it")
        .help("correct the sign of an inertia")
}

/// A motion of shafts that gains energy from dampers with a negative value.
fn not_passive(document: &Document, dampers: &[&str], shafts: &[(String, Rational)]) -> Diagnostic {
    let names = quoted(shafts.iter().map(|(name, _)| name));
    let message = format!(
        "the damping is not passive: a motion of {names} gains energy from it (the reduced damping matrix is not \
         positive semidefinite)"
    );
    let places = dampers.iter().take(MOST_LABELS).map(|name| place_of_value(document, name, "damping"));
    Diagnostic::error("damping::not-passive", message)
        .at_each(places, "negative damping")
        .help("make this damping less negative, or add damping to the shafts named")
}

/// A motion that no mass resists: the shafts that move, and in which proportion.
fn massless_motion(document: &Document, reduced: &Reduced, model: &SparseModel) -> Diagnostic {
    let names = reduced.coordinate_names();
    let direction = massless_direction(&names, &dense_rows(&model.inertia, names.len())).unwrap_or_default();
    let factor = |name: &String| direction.iter().find(|(candidate, _)| candidate == name).map(|(_, x)| x.clone());
    let direction: Vec<Rational> = names.iter().map(|name| factor(name).unwrap_or(Rational::ZERO)).collect();
    let moves = moving(reduced, &model.basis, &direction);
    let charges = document.charges();
    if moves.first().is_some_and(|(name, _)| charges.contains(name)) {
        let branches: Vec<&String> = moves.iter().map(|(name, _)| name).filter(|name| charges.contains(name)).collect();
        return massless_loop(document, &branches);
    }
    let names = quoted(moves.iter().map(|(name, _)| name));
    let proportion = match &moves[..] {
        [] | [_] => String::new(),
        [first, ..] => {
            let parts: Vec<(String, Rational)> =
                moves.iter().take(MOST_LABELS).map(|(name, share)| (name.clone(), share.over(&first.1))).collect();
            let more = if moves.len() > parts.len() { " + …" } else { "" };
            format!(", in the direction {}{more}", combination(&parts))
        }
    };
    let knows = |constraint: &MultiplierConstraint| {
        let constrained = reduced.equations.coordinates_of_multiplier(&constraint.law);
        moves.iter().any(|(name, _)| reduced.coordinate(name).is_some_and(|shaft| constrained.contains(&shaft)))
    };
    let constraints = reduced.equations.multiplier_constraints.iter();
    let tied: Vec<&String> =
        constraints.filter(|constraint| knows(constraint)).map(|constraint| &constraint.element).collect();
    let message = match &tied[..] {
        [] => format!("a motion without inertia is possible: {names} can move while no mass moves{proportion}"),
        tied => {
            format!("{names} can move without a mass, and with {} enforced a motion without mass remains", quoted(tied))
        }
    };
    Diagnostic::error("model::massless", message)
        .at_each(first_places(document, moves.iter().map(|(name, _)| name)), "moves without inertia")
        .help("give one of these shafts an inertia, or tie it to another shaft by a gear")
}

/// Shafts that take part in a reduced motion with their shares, the largest first.
fn moving(reduced: &Reduced, basis: &[SparseRow], direction: &[Rational]) -> Vec<(String, Rational)> {
    let share =
        |shaft: usize| basis[shaft].iter().fold(Rational::ZERO, |sum, (j, x)| sum.plus(&x.times(&direction[*j])));
    let mut shares: Vec<(f64, String, Rational)> = reduced
        .equations
        .coordinates
        .iter()
        .enumerate()
        .map(|(shaft, name)| (rational_to_f64(&share(shaft)).abs(), name.clone(), share(shaft)))
        .filter(|(size, _, _)| *size > 0.0)
        .collect();
    shares.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    shares.into_iter().map(|(_, name, share)| (name, share)).collect()
}
