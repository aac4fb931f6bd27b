//! Constraints that a run keeps with their multipliers: what they do not go with, where a run begins on them, and what an analysis sees of
//! them.

use std::sync::Arc;

use super::checks::generic_positions;
use super::equilibrium::{Rest, in_words};
use super::initial::Entry;
use super::places::{at_each, place_of};
use super::{Prepared, PreparedVariant};
use crate::analysis::{Dependent, dependent_row};
use crate::diagnostics::{Diagnostic, quoted};
use crate::entries::Place;
use crate::equations::{InputKind, Kept};
use crate::expr::{Expr, Side};
use crate::model::{ControlSpec, Document, TableReader};
use crate::num::{Matrix, Rational, echelon};
use crate::reduce::{
    GivenRows, Kinematics, Motion, NoStart, OperatingPoint, ReduceError, Reduced, SparseRow, StartOnRows,
    follows_everywhere, frozen, held, start_on_rows,
};
use crate::simulate::Scenario;
use crate::synthesis::Plant;

/// What does not go with kept rows; true if nothing of it is there.
pub(super) fn check_kept(document: &Document, reduced: &Reduced, out: &mut Vec<Diagnostic>) -> bool {
    let equations = &reduced.equations;
    let Some(first) = equations.kept.first() else { return true };
    let names = quoted(equations.kept.iter().map(|kept| kept.element.as_str()));
    let before = out.len();
    let mut refuse = |message: String, place, label: &str, help: &str| {
        let mistake =
            Diagnostic::error("constraint::kept", message).at(place_of(document, &first.element), "this constraint");
        out.push(mistake.at(place, label).help(help));
    };
    if !document.bench.values.is_empty() || !document.identification.values.is_empty() {
        let place =
            if document.bench.values.is_empty() { &document.identification.place } else { &document.bench.place };
        let message =
            format!("bench and identification do not know constraints that are not solved for a coordinate: {names}");
        refuse(message, place.clone(), "this table", "take it out");
    }
    let (free, kept) = (reduced.degrees_of_freedom(), equations.kept.len());
    let no_motion = kept > free || kept == free && !equations.prescribes();
    let follows = || no_motion.then(|| follows_everywhere(reduced, &generic_positions(free))).flatten();
    if let Some(dependent) = dependent_row(reduced) {
        out.push(told_of(document, reduced, &dependent));
    } else if let Some(row) = superfluous(reduced).or_else(follows) {
        let name = &equations.kept[row].element;
        let message = format!("`{name}` holds no motion that the other constraints leave, at no position");
        let help = "remove it, or those that say the same: of kept rows only a sum of rows of speeds in the same unit is kept once";
        let mistake = Diagnostic::error("constraint::dependent", message);
        out.push(mistake.at(place_of(document, name), "this constraint").help(help));
    } else if no_motion {
        let message = format!(
            "the constraints leave no motion: {} coordinates and {} more constraints",
            reduced.degrees_of_freedom(),
            equations.kept.len()
        );
        let elements = equations.kept.iter().map(|kept| kept.element.as_str());
        let mistake = Diagnostic::error("constraint::no-motion", message)
            .help("remove a constraint, or add a shaft: a model needs at least one degree of freedom");
        out.push(at_each(document, elements, "a constraint", mistake));
    }
    out.len() == before
}

/// What is told of a kept row that other constraints say too.
fn told_of(document: &Document, reduced: &Reduced, dependent: &Dependent) -> Diagnostic {
    let name = &reduced.equations.kept[dependent.row].element;
    let message = match dependent.elements.as_slice() {
        [] => format!("at every position `{name}` follows from the other constraints: it constrains nothing more"),
        [one] => format!(
            "at every position `{name}` is a multiple of `{one}`, with a factor that may depend on the position: it constrains nothing more"
        ),
        several => format!(
            "at every position `{name}` is a sum of multiples of {}: it constrains nothing more",
            quoted(several.iter().map(String::as_str))
        ),
    };
    let others = dependent.elements.iter().map(String::as_str);
    let mistake = Diagnostic::error("constraint::dependent", message)
        .at(place_of(document, name), "this constraint")
        .help("remove it, or correct what should be another constraint");
    at_each(document, others, "it follows from this one", mistake)
}

/// A kept row that follows from those before it, where all their coefficients are numbers.
fn superfluous(reduced: &Reduced) -> Option<usize> {
    let (motion, count) = (Motion::at_time_zero(reduced), reduced.equations.kept.len());
    let rows = &motion.frictions[motion.frictions.len() - count..];
    let number = |entry: &Expr| motion.graph.number_of(*entry).cloned();
    let numbers = |row: &SparseRow| row.iter().map(|(k, entry)| Some((*k, number(entry)?))).collect::<Option<Vec<_>>>();
    let known: Vec<(usize, Vec<(usize, Rational)>)> =
        rows.iter().enumerate().filter_map(|(row, entries)| Some((row, numbers(entries)?))).collect();
    let mut matrix = Matrix::zeros(reduced.degrees_of_freedom(), known.len());
    for (column, (_, row)) in known.iter().enumerate() {
        row.iter().for_each(|(k, x)| matrix[(*k, column)] = x.clone());
    }
    let free = echelon(&matrix, &(0..known.len()).collect::<Vec<_>>()).free();
    free.first().map(|column| known[*column].0)
}

/// Where a run begins: on the kept rows with what `initial` gives; there itself where none are, or there is no such place.
pub(super) fn on_rows(reduced: &Reduced, given: &[Entry], scenario: &Scenario) -> Vec<f64> {
    let Scenario { position, speed, .. } = scenario;
    let found = (!reduced.equations.kept.is_empty()).then(|| start_on_rows(reduced, &rows_of(given), position, speed));
    found.and_then(Result::ok).map_or_else(|| position.clone(), |start| start.position)
}

fn rows_of(given: &[Entry]) -> GivenRows {
    let of = |rate: usize| given.iter().filter(move |entry| entry.rate == rate);
    let values =
        [0, 1].map(|rate| of(rate).map(|entry| (entry.given.coordinate, entry.given.value.to_f64())).collect());
    GivenRows { values }
}

/// Whether two values differ by more than rounding.
fn moved(now: f64, then: f64) -> bool {
    (now - then).abs() > 1e-9 * now.abs().max(then.abs()).max(1e-3)
}

/// Puts the start of a run on the kept rows; tells what follows of what `initial` leaves open.
pub(super) fn begin_on_rows(
    document: &Document,
    reduced: &Reduced,
    given: &[Entry],
    scenario: &mut Scenario,
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let equations = &reduced.equations;
    // Of what contradicts itself nothing follows.
    if equations.kept.is_empty() || out.iter().any(|told| told.code == "scenario::contradiction") {
        return Vec::new();
    }
    match start_on_rows(reduced, &rows_of(given), &scenario.position, &scenario.speed) {
        Ok(StartOnRows { position, speed }) => {
            let mut changed = Vec::new();
            let names = reduced.coordinate_names();
            for (rate, now, then) in [(0, &scenario.position, &position), (1, &scenario.speed, &speed)] {
                for (k, (_, then)) in now.iter().zip(then).enumerate().filter(|(_, (now, then))| moved(**now, **then)) {
                    let quantity = equations.domain(reduced.coordinates[k]).motion()[rate];
                    changed.push(format!("{} = {then} {}", quantity.of(&names[k]), quantity.physical().unit()));
                }
            }
            (scenario.position, scenario.speed) = (position, speed);
            let rows = quoted(equations.kept.iter().map(|kept| kept.element.as_str()));
            let note = format!("what `initial` leaves open follows at the start from {rows}: {}", changed.join(", "));
            if changed.is_empty() { Vec::new() } else { vec![note] }
        }
        Err(error) => {
            out.push(no_start(document, reduced, given, &error));
            Vec::new()
        }
    }
}

/// What a kept row prescribes at the start, if it is a speed, in words.
fn prescribed_speed(reduced: &Reduced, row: usize) -> String {
    let kept = &reduced.equations.kept[row];
    let Kept::Speed(_, function) = &kept.law else { return String::new() };
    let unit = reduced.equations.domain_of_kept(kept).unwrap_or_default().motion()[1].unit();
    format!(", which prescribes {} {unit}", function.value(0.0))
}

/// Why a run has no start on the kept rows.
fn no_start(document: &Document, reduced: &Reduced, given: &[Entry], error: &NoStart) -> Diagnostic {
    let element = |k: usize| reduced.equations.kept[k].element.as_str();
    let names = |rows: &[usize]| quoted(rows.iter().map(|k| element(*k)));
    let all: Vec<usize> = (0..reduced.equations.kept.len()).collect();
    let mut help = "give other angles by `initial` of `[scenario]`, or correct the constraint";
    let mut places = Vec::new();
    let (message, rows) = match error {
        NoStart::NotReached(rows) => {
            let kept = if given.is_empty() { "near `initial`" } else { "with what `initial` gives" };
            (format!("no start was found {kept} that satisfies {}: there may be none", names(rows)), rows)
        }
        NoStart::NotFinite(rows) => {
            let named = reduced.coordinate_names().join(", ");
            (
                format!(
                    "{} has no finite value or slopes at the start; what `initial` does not give of {named} is zero there",
                    names(rows)
                ),
                rows,
            )
        }
        NoStart::Flat(rows) => {
            help = "give other angles by `initial` of `[scenario]`, or write the constraint otherwise: `a - b` in place of `(a - b)^2`";
            (format!("all slopes of {} are zero at the start: it constrains nothing there", names(rows)), rows)
        }
        NoStart::Dependent => {
            let message = match &all[..] {
                [_] => format!(
                    "at the start {} constrains no motion that the other constraints leave, to ten digits",
                    names(&all)
                ),
                _ => format!("at the start the constraints {} depend on each other, to ten digits", names(&all)),
            };
            help = "give other angles by `initial` of `[scenario]`; where they say the same everywhere, remove one of them";
            (message, &all)
        }
        NoStart::Contradiction { row, rate, given: own } => {
            let of_rate: Vec<&Entry> = given.iter().filter(|entry| entry.rate == *rate).collect();
            let own: Vec<&Entry> = own.iter().filter_map(|k| of_rate.get(*k).copied()).collect();
            let written = own.iter().map(|e| format!("`{}` = {} {}", e.name, e.given.value.to_f64(), e.unit));
            let written = written.collect::<Vec<_>>().join(", ");
            places.extend(own.iter().map(|entry| entry.place.clone()));
            help = "take one of them out: what is not given follows; or give values that agree";
            (
                format!(
                    "`initial` of `[scenario]`: {written} contradict{} {}{}",
                    if own.len() == 1 { "s" } else { "" },
                    names(&[*row]),
                    prescribed_speed(reduced, *row)
                ),
                &vec![*row],
            )
        }
    };
    let mut mistake = Diagnostic::error("constraint::start", message);
    if places.is_empty() {
        mistake = mistake.at(TableReader::place(&document.scenario, "initial"), "from here");
    }
    for place in places {
        mistake = mistake.at(place, "this one");
    }
    at_each(document, rows.iter().map(|k| element(*k)), "this constraint", mistake.help(help))
}

/// What an analysis sees: kept rows with their coefficients at the start.
pub(super) fn for_analysis(prepared: &Prepared) -> Result<Prepared, Diagnostic> {
    let one = |variant: &Arc<PreparedVariant>| frozen_variant(variant).map(Arc::new);
    Ok(Prepared {
        name: prepared.name.clone(),
        description: prepared.description.clone(),
        named: prepared.named,
        variants: prepared.variants.iter().map(one).collect::<Result<_, _>>()?,
        requirements: Vec::new(),
        figures: Vec::new(),
        plots: Vec::new(),
        safety: None,
        sweep: None,
        tolerance: prepared.tolerance,
    })
}

/// The model of a variant with its kept rows as they are at the start of its run, or at an equilibrium near it where laws of torque act.
///
/// # Errors
/// Why its kept rows have no linear ones in their place.
pub(super) fn frozen_variant(variant: &PreparedVariant) -> Result<PreparedVariant, Diagnostic> {
    if let Some(mistake) = nothing_free(&variant.reduced) {
        return Err(mistake);
    }
    let at = if variant.analysis.at.is_empty() { "`initial` of `[scenario]`" } else { "`at` of `[analysis]`" };
    let refused = |message: String, help: String| Diagnostic::error("analysis::kept", message).help(help);
    let rest = Standing::of(variant).map_err(|message| {
        refused(message, format!("give other angles by {at}, or the model what holds it: a spring, or a motor"))
    })?;
    let found =
        rest.freeze(variant).map_err(|error| refused(error.to_string(), format!("give other angles by {at}")))?;
    Ok(found)
}

/// Elements that prescribe a speed or an acceleration.
fn prescribed(reduced: &Reduced) -> impl Iterator<Item = &str> {
    reduced.equations.kept.iter().filter(|kept| kept.law.prescribes()).map(|kept| kept.element.as_str())
}

/// Elements whose offset, position, speed or acceleration is a function of time.
pub(super) fn moves_by_itself(reduced: &Reduced) -> impl Iterator<Item = &str> {
    reduced.equations.moving.keys().map(String::as_str).chain(prescribed(reduced))
}

/// What to say where all that moves is prescribed, to who asks for what moves freely.
pub(super) fn nothing_free(reduced: &Reduced) -> Option<Diagnostic> {
    let names: Vec<&str> = moves_by_itself(reduced).collect();
    (!names.is_empty() && reduced.degrees_of_freedom() == reduced.equations.kept.len()).then(|| {
        let message = format!("nothing is free to move: all motion follows from what {} prescribe{}", quoted(names.iter().copied()), if names.len() == 1 { "s" } else { "" });
        Diagnostic::error("analysis::no-motion", message)
            .help("`kardan run` gives the torques and forces that this takes; take it out to ask how the model moves by itself")
    })
}

/// What asks for motion that is free where none is; true if nothing does.
pub(super) fn check_free(document: &Document, reduced: &Reduced, out: &mut Vec<Diagnostic>) -> bool {
    let tables = [&document.bench, &document.identification].into_iter().filter(|table| !table.values.is_empty());
    let places = document
        .controls
        .iter()
        .map(|control| control.table.place.clone())
        .chain(tables.map(|table| table.place.clone()));
    let asking = places.min_by_key(Place::start);
    let Some((place, mistake)) = asking.zip(nothing_free(reduced)) else { return true };
    out.push(mistake.at(place, "needs a motion that is free"));
    false
}

/// What is told of them where a model is looked at at rest.
pub(super) fn stands_still(reduced: &Reduced) -> Option<String> {
    let names: Vec<&str> = prescribed(reduced).collect();
    (!names.is_empty())
        .then(|| format!("{}: a motion that is prescribed stands still there, where it begins", quoted(names)))
}

/// Where rows that turn are looked at: a place at rest on them.
struct Standing {
    /// With constant torques where they hold it.
    point: OperatingPoint,
    multipliers: Vec<f64>,
    /// What there is to tell of it.
    told: Vec<String>,
}

impl Standing {
    /// Where the analysis of a variant stands.
    fn of(variant: &PreparedVariant) -> Result<Self, String> {
        let (own, spec) = (&variant.reduced, &variant.analysis);
        let names = own.coordinate_names();
        let still = vec![0.0; names.len()];
        let count = own.equations.kept.len();
        let asked = spec.position(&names, &variant.scenario.position);
        let is_named = |k: &usize| spec.at.iter().any(|(shaft, _)| *shaft == names[*k]);
        let fixed: Vec<(usize, f64)> =
            (0..names.len()).filter(is_named).map(|k| (own.coordinates[k], asked[k])).collect();
        let given = GivenRows { values: [fixed.clone(), Vec::new()] };
        let start = start_on_rows(own, &given, &asked, &still)
            .map_err(|_| "no place was found on the constraints near these angles".to_string())?
            .position;
        let mut told = Vec::new();
        if start.iter().zip(&asked).any(|(now, then)| moved(*now, *then)) || !fixed.is_empty() {
            told.push(format!("operating point: on the constraints, {}", in_words(own, &start)));
        }
        if own.equations.laws.is_empty() {
            return Ok(Self { point: OperatingPoint::relaxed(&start), multipliers: vec![0.0; count], told });
        }
        if spec.at.is_empty() {
            let Rest { position, rates, multipliers, found, more, .. } = Rest::near(own, &start)?;
            told = vec![format!("operating point: {found}")];
            told.extend(more.into_iter().map(|more| more.replace("CHOICE", "`at` of `[analysis]`")));
            return Ok(Self {
                point: OperatingPoint { position, rates, torques: None, side: Side::default() },
                multipliers,
                told,
            });
        }
        let all: Vec<usize> = (0..names.len()).collect();
        let equations = &own.equations;
        let is_motor = |k: &usize| matches!(equations.inputs[*k].value, InputKind::Motor(_));
        let motors: Vec<usize> = (0..equations.inputs.len()).filter(is_motor).collect();
        for inputs in [&[][..], &motors] {
            let found = held(own, &start, &all, inputs);
            if !found.at_rest {
                continue;
            }
            let mut torques = vec![0.0; equations.inputs.len()];
            inputs.iter().zip(&found.torques).for_each(|(input, torque)| torques[*input] = *torque);
            let holding = inputs.iter().map(|k| format!("{} = {:.6}", equations.inputs[*k].element, torques[*k]));
            let holding: Vec<String> = holding.collect();
            if !holding.is_empty() {
                told.push(format!("the operating point is held by constant torques: {} (SI)", holding.join(", ")));
            }
            let point =
                OperatingPoint { position: start, rates: found.rates, torques: Some(torques), side: Side::default() };
            return Ok(Self { point, multipliers: found.multipliers, told });
        }
        Err(format!("{} is no position at rest: neither constraints nor motors hold it", in_words(own, &start)))
    }

    /// The variant with its rows as they are there.
    fn freeze(self, variant: &PreparedVariant) -> Result<PreparedVariant, ReduceError> {
        let Self { point, multipliers, told: mut start_notes } = self;
        if multipliers.iter().any(|torque| *torque != 0.0) {
            let own = &variant.reduced.equations;
            let carried = own.kept.iter().zip(&multipliers).filter(|(_, torque)| **torque != 0.0);
            let carried: Vec<String> = carried.map(|(kept, torque)| format!("{} {torque:.6}", kept.element)).collect();
            let text = "what the constraints carry there turns with their rows and is part of the stiffness; multipliers (SI, rounded to 16 digits)";
            start_notes.push(format!("{text}: {}", carried.join(", ")));
        }
        start_notes.extend(stands_still(&variant.reduced));
        let (reduced, point) = frozen_point(&variant.reduced, &point, &multipliers)?;
        start_notes.extend(rounded_rows(&reduced));
        let unfrozen = Some(Box::new(variant.reduced.clone()));
        Ok(PreparedVariant { unfrozen, start_notes, ..variant.standing_in(reduced, point) })
    }
}

/// What is told of rows that stand still with coefficients that are no fractions there.
pub(super) fn rounded_rows(reduced: &Reduced) -> Option<String> {
    let rounded = &reduced.equations.rounded;
    (!rounded.is_empty()).then(|| {
        let names = quoted(rounded.iter().map(String::as_str));
        format!("the coefficients of {names} are rounded to 16 digits at the operating point: what is decided exactly is so of the rounded rows")
    })
}

/// A model with its kept rows as they are at an operating point, and that point in its coordinates.
fn frozen_point(
    own: &Reduced,
    point: &OperatingPoint,
    multipliers: &[f64],
) -> Result<(Reduced, OperatingPoint), ReduceError> {
    let reduced = frozen(own, &point.position, multipliers)?;
    let (angles, speeds) = motion_at(own, point);
    let position = reduced.coordinates.iter().map(|shaft| angles[*shaft]).collect();
    let rates = reduced.coordinates.iter().map(|shaft| speeds[*shaft]).collect();
    Ok((reduced, OperatingPoint { position, rates, torques: point.torques.clone(), side: point.side.clone() }))
}

/// The angles of all shafts at an operating point, rad, and their speeds.
fn motion_at(reduced: &Reduced, point: &OperatingPoint) -> (Vec<f64>, Vec<f64>) {
    let mut kinematics = Kinematics::new(reduced);
    kinematics.update(&point.position, &point.rates);
    (kinematics.angles, kinematics.speeds)
}

/// The plant of a law beside kept rows: with these as they are at its operating point.
///
/// # Errors
/// As of [`frozen`].
pub(super) fn on_frozen_rows(own: &Reduced, point: &OperatingPoint, multipliers: &[f64]) -> Result<Plant, ReduceError> {
    let (reduced, there) = frozen_point(own, point, multipliers)?;
    let mut plant = Plant::at(reduced, there);
    plant.frozen = Some(motion_at(own, point).0);
    Ok(plant)
}

/// A variant whose loop is looked at with its kept rows as they are at the operating point.
pub(super) fn with_loop(mut variant: PreparedVariant, multipliers: &[f64]) -> PreparedVariant {
    if !variant.reduced.equations.kept.is_empty() && !variant.designed.is_empty() {
        let (point, multipliers) = (variant.point.clone(), multipliers.to_vec());
        let looped = Standing { point, multipliers, told: Vec::new() }.freeze(&variant);
        // Of what is not there its plants have told.
        variant.looped = looped.ok().map(Box::new);
    }
    variant
}

/// The mistake that a law needs the full model.
pub(super) fn not_on_rows(control: &ControlSpec, reduced: &Reduced) -> Diagnostic {
    let names = quoted(reduced.equations.kept.iter().map(|kept| kept.element.as_str()));
    let message = format!(
        "control `{}`: a law on the full nonlinear model does not know constraints that are not solved for a coordinate: {names}",
        control.name
    );
    Diagnostic::error("constraint::kept", message)
        .at(control.place.clone(), "this controller")
        .help("take a law that is designed at an operating point: `lqr`, `pole_placement` or `decoupling`")
}

/// The mistake that rows have no linear ones in their place.
pub(super) fn rows_refused(control: &ControlSpec, reduced: &Reduced, error: &ReduceError) -> Diagnostic {
    let names = quoted(reduced.equations.kept.iter().map(|kept| kept.element.as_str()));
    let message = format!("control `{}`: at its operating point {names} cannot be kept: {error}", control.name);
    Diagnostic::error("constraint::kept", message)
        .at(control.place.clone(), "this controller")
        .help("give other angles by `initial` of `[scenario]`, or by `at` of the controller")
}
