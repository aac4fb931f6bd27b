//! Constraints that a run enforces with multipliers: unsupported combinations, initial values that satisfy them, and their linearisation for
//! an analysis.

use std::sync::Arc;

use crate::study::check::equilibrium::{Rest, format_position};
use crate::study::check::model_checks::no_motion;
use crate::study::read::initial_state::Entry;
use crate::study::read::locations::{first_places, place_of};
use crate::study::read::positions::generic_positions;
use crate::study::{Prepared, PreparedVariant};
use kardan_analysis::{Dependent, dependent_row};
use kardan_expr::expr::{Expr, Side};
use kardan_math::num::{Matrix, Rational, echelon};
use kardan_mechanics::equations::{InputKind, MultiplierLaw};
use kardan_mechanics::reduce::{
    Equilibrium, Kinematics, Motion, NoStart, OperatingPoint, ReduceError, Reduced, SparseRow, StartOnRows,
    StartValues, follows_everywhere, frozen, start_on_rows, trim,
};
use kardan_model::{ControlSpec, Document};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_schema::entries::Place;
use kardan_simulate::Scenario;
use kardan_synthesis::Plant;

/// The elements of its multiplier constraints.
pub(in crate::study) fn multiplier_elements(reduced: &Reduced) -> impl Iterator<Item = &str> {
    reduced.equations.multiplier_constraints.iter().map(|constraint| constraint.element.as_str())
}

/// Reports features that multiplier constraints do not support; true if the model has none of them.
pub(in crate::study) fn check_multipliers(document: &Document, reduced: &Reduced, out: &mut Vec<Diagnostic>) -> bool {
    let equations = &reduced.equations;
    let Some(first) = equations.multiplier_constraints.first() else { return true };
    let names = quoted(multiplier_elements(reduced));
    let before = out.len();
    let mut refuse = |message: String, place, label: &str, help: &str| {
        let diagnostic = Diagnostic::error("constraint::multiplier", message)
            .at(place_of(document, &first.element), "this constraint");
        out.push(diagnostic.at(place, label).help(help));
    };
    if !document.bench.values.is_empty() || !document.identification.values.is_empty() {
        let place =
            if document.bench.values.is_empty() { &document.identification.place } else { &document.bench.place };
        let message = format!(
            "bench and identification do not support constraints that are not solved for a coordinate: {names}"
        );
        refuse(message, place.clone(), "this table", "take it out");
    }
    let (free, rows) = (reduced.degrees_of_freedom(), equations.multiplier_constraints.len());
    let leaves_none = rows > free || rows == free && !equations.prescribes();
    let follows = || leaves_none.then(|| follows_everywhere(reduced, &generic_positions(free))).flatten();
    if let Some(dependent) = dependent_row(reduced) {
        out.push(dependency_diagnostic(document, reduced, &dependent));
    } else if let Some(row) = superfluous(reduced).or_else(follows) {
        let name = &equations.multiplier_constraints[row].element;
        let message =
            format!("at every position the other constraints already remove the motions that `{name}` removes");
        let help = "remove it, or the equivalent ones: of constraints enforced by multipliers kardan drops only \
                    redundant sums of rows of speeds in the same unit";
        let diagnostic = Diagnostic::error("constraint::dependent", message);
        out.push(diagnostic.at(place_of(document, name), "this constraint").help(help));
    } else if leaves_none {
        let message = format!("the constraints leave no motion: {free} coordinates and {rows} more constraints");
        out.push(no_motion(message).at_each(first_places(document, multiplier_elements(reduced)), "a constraint"));
    }
    out.len() == before
}

/// The error of a redundant multiplier constraint.
fn dependency_diagnostic(document: &Document, reduced: &Reduced, dependent: &Dependent) -> Diagnostic {
    let name = &reduced.equations.multiplier_constraints[dependent.row].element;
    let message = match dependent.elements.as_slice() {
        [] => format!("at every position `{name}` follows from the other constraints: it constrains nothing more"),
        [one] => format!(
            "at every position `{name}` is a multiple of `{one}`, with a factor that may depend on the position: it constrains nothing more"
        ),
        several => format!(
            "at every position `{name}` is a sum of multiples of {}: it constrains nothing more",
            quoted(several)
        ),
    };
    Diagnostic::error("constraint::dependent", message)
        .at(place_of(document, name), "this constraint")
        .at_each(first_places(document, &dependent.elements), "it follows from this one")
        .help("remove it, or correct what should be another constraint")
}

/// A multiplier constraint that follows from those before it, if all their coefficients are numbers.
fn superfluous(reduced: &Reduced) -> Option<usize> {
    let (motion, count) = (Motion::at_time_zero(reduced), reduced.equations.multiplier_constraints.len());
    let rows = &motion.frictions[motion.frictions.len() - count..];
    let number = |entry: &Expr| motion.graph.number_of(*entry).cloned();
    let numbers = |row: &SparseRow| row.iter().map(|(k, entry)| Some((*k, number(entry)?))).collect::<Option<Vec<_>>>();
    let constant_rows: Vec<(usize, Vec<(usize, Rational)>)> =
        rows.iter().enumerate().filter_map(|(row, entries)| Some((row, numbers(entries)?))).collect();
    let mut matrix = Matrix::zeros(reduced.degrees_of_freedom(), constant_rows.len());
    for (column, (_, row)) in constant_rows.iter().enumerate() {
        row.iter().for_each(|(k, x)| matrix[(*k, column)] = x.clone());
    }
    let free = echelon(&matrix, &(0..constant_rows.len()).collect::<Vec<_>>()).free();
    free.first().map(|column| constant_rows[*column].0)
}

/// Initial values of a run: on the multiplier constraints with the values of `initial`; unchanged if there are none, or if there is no such position.
pub(in crate::study) fn on_rows(reduced: &Reduced, prescribed: &[Entry], scenario: &Scenario) -> Vec<f64> {
    let Scenario { position, speed, .. } = scenario;
    let found = (!reduced.equations.multiplier_constraints.is_empty())
        .then(|| start_on_rows(reduced, &rows_of(prescribed), position, speed));
    found.and_then(Result::ok).map_or_else(|| position.clone(), |start| start.position)
}

fn rows_of(prescribed: &[Entry]) -> StartValues {
    let of = |rate: usize| prescribed.iter().filter(move |entry| entry.rate == rate);
    let values = [0, 1]
        .map(|rate| of(rate).map(|entry| (entry.prescribed.coordinate, entry.prescribed.value.to_f64())).collect());
    StartValues { values }
}

/// Whether two values differ by more than rounding.
fn moved(now: f64, then: f64) -> bool {
    (now - then).abs() > 1e-9 * now.abs().max(then.abs()).max(1e-3)
}

/// Projects the start of a run onto the multiplier constraints; notes which values follow that `initial` leaves open.
pub(in crate::study) fn begin_on_rows(
    document: &Document,
    reduced: &Reduced,
    prescribed: &[Entry],
    scenario: &mut Scenario,
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let equations = &reduced.equations;
    // From contradictory values nothing follows.
    if equations.multiplier_constraints.is_empty()
        || out.iter().any(|diagnostic| diagnostic.code == "scenario::inconsistent-initial")
    {
        return Vec::new();
    }
    match start_on_rows(reduced, &rows_of(prescribed), &scenario.position, &scenario.speed) {
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
            let rows = quoted(multiplier_elements(reduced));
            let note =
                format!("values that `initial` does not give follow at the start from {rows}: {}", changed.join(", "));
            if changed.is_empty() { Vec::new() } else { vec![note] }
        }
        Err(error) => {
            out.push(no_start(document, reduced, prescribed, &error));
            Vec::new()
        }
    }
}

/// The prescribed value of a multiplier constraint at the start, if it is a speed, as text.
fn prescribed_speed(reduced: &Reduced, row: usize) -> String {
    let constraint = &reduced.equations.multiplier_constraints[row];
    let MultiplierLaw::Prescribed { order: 1, function, .. } = &constraint.law else { return String::new() };
    let unit = reduced.equations.domain_of_multiplier(constraint).unwrap_or_default().motion()[1].unit();
    format!(", which prescribes {} {unit}", function.value(0.0))
}

/// Why a run has no start on the multiplier constraints.
fn no_start(document: &Document, reduced: &Reduced, prescribed: &[Entry], error: &NoStart) -> Diagnostic {
    let element = |k: usize| reduced.equations.multiplier_constraints[k].element.as_str();
    let names = |rows: &[usize]| quoted(rows.iter().map(|k| element(*k)));
    let all: Vec<usize> = (0..reduced.equations.multiplier_constraints.len()).collect();
    let mut help = "give other angles by `initial` of `[scenario]`, or correct the constraint";
    let mut places = Vec::new();
    let (message, rows) = match error {
        NoStart::NotReached(rows) => {
            let condition = if prescribed.is_empty() { "near `initial`" } else { "with the values of `initial`" };
            (format!("no start was found {condition} that satisfies {}: there may be none", names(rows)), rows)
        }
        NoStart::NotFinite(rows) => {
            let named = reduced.coordinate_names().join(", ");
            (
                format!(
                    "{} has no finite value or slopes at the start; values of {named} that `initial` does not give \
                     are zero there",
                    names(rows)
                ),
                rows,
            )
        }
        NoStart::Flat(rows) => {
            help = "give other angles by `initial` of `[scenario]`, or write the constraint in another form: `a - b` \
                    in place of `(a - b)^2`";
            (format!("all slopes of {} are zero at the start: it constrains nothing there", names(rows)), rows)
        }
        NoStart::Dependent => {
            let message = match &all[..] {
                [_] => format!("at the start {} is redundant to the other constraints, to ten digits", names(&all)),
                _ => format!("at the start the constraints {} depend on each other, to ten digits", names(&all)),
            };
            help = "give other angles by `initial` of `[scenario]`; if they are equivalent everywhere, remove one of \
                    them";
            (message, &all)
        }
        NoStart::Contradiction { row, rate, prescribed: own } => {
            let of_rate: Vec<&Entry> = prescribed.iter().filter(|entry| entry.rate == *rate).collect();
            let own: Vec<&Entry> = own.iter().filter_map(|k| of_rate.get(*k).copied()).collect();
            let values_text = own.iter().map(|e| format!("`{}` = {} {}", e.name, e.prescribed.value.to_f64(), e.unit));
            let values_text = values_text.collect::<Vec<_>>().join(", ");
            places.extend(own.iter().map(|entry| entry.place.clone()));
            help = "remove one of them: values that are not given follow; or give values that agree";
            (
                format!(
                    "`initial` of `[scenario]`: {values_text} contradict{} {}{}",
                    if own.len() == 1 { "s" } else { "" },
                    names(&[*row]),
                    prescribed_speed(reduced, *row)
                ),
                &vec![*row],
            )
        }
    };
    let whole = places.is_empty().then(|| document.scenario.place_of("initial"));
    Diagnostic::error("constraint::initial-position", message)
        .at_each(whole, "from here")
        .at_each(places, "this one")
        .at_each(first_places(document, rows.iter().map(|k| element(*k))), "this constraint")
        .help(help)
}

/// The model for an analysis: multiplier constraints with their coefficients at the start.
pub(in crate::study) fn for_analysis(prepared: &Prepared) -> Result<Prepared, Diagnostic> {
    let one = |variant: &Arc<PreparedVariant>| frozen_variant(variant).map(Arc::new);
    Ok(Prepared {
        name: prepared.name.clone(),
        description: prepared.description.clone(),
        named: prepared.named,
        variants: prepared.variants.iter().map(one).collect::<Result<_, _>>()?,
        tolerance: prepared.tolerance,
        ..Prepared::default()
    })
}

/// The model of a variant with its multiplier constraints frozen at the start of its run, or at an equilibrium near it if there are laws of torque.
///
/// # Errors
/// Why its multiplier constraints have no linearisation.
pub(in crate::study) fn frozen_variant(variant: &PreparedVariant) -> Result<PreparedVariant, Diagnostic> {
    free_motion(&variant.reduced)?;
    let at = if variant.analysis.at.is_empty() { "`initial` of `[scenario]`" } else { "`at` of `[analysis]`" };
    let refused =
        |message: String, help: String| Diagnostic::error("analysis::multiplier-constraint", message).help(help);
    let rest = RestPoint::of(variant).map_err(|message| {
        refused(
            message,
            format!("give other angles by {at}, or add an element that supports the model: a spring, or a motor"),
        )
    })?;
    rest.freeze(variant).map_err(|error| refused(error.to_string(), format!("give other angles by {at}")))
}

/// Elements that prescribe a speed or an acceleration.
fn prescribed(reduced: &Reduced) -> impl Iterator<Item = &str> {
    let constraints = reduced.equations.multiplier_constraints.iter();
    constraints.filter(|constraint| constraint.law.prescribes()).map(|constraint| constraint.element.as_str())
}

/// Elements whose offset, position, speed or acceleration is a function of time.
pub(in crate::study) fn moves_by_itself(reduced: &Reduced) -> impl Iterator<Item = &str> {
    reduced.equations.moving.keys().map(String::as_str).chain(prescribed(reduced))
}

/// Whether a free motion remains, for requests that need one.
///
/// # Errors
/// If all motion is prescribed.
pub(in crate::study) fn free_motion(reduced: &Reduced) -> Result<(), Diagnostic> {
    let names: Vec<&str> = moves_by_itself(reduced).collect();
    if names.is_empty() || reduced.degrees_of_freedom() != reduced.equations.multiplier_constraints.len() {
        return Ok(());
    }
    let s = if names.len() == 1 { "s" } else { "" };
    let message = format!("no free motion remains: {} prescribe{s} all motion", quoted(names));
    let help = "`kardan run` gives the required torques and forces; remove it to analyse the free motion of the model";
    Err(Diagnostic::error("analysis::no-motion", message).help(help))
}

/// Reports requests for free motion if there is none; true if there is no error.
pub(in crate::study) fn check_free(document: &Document, reduced: &Reduced, out: &mut Vec<Diagnostic>) -> bool {
    let tables = [&document.bench, &document.identification].into_iter().filter(|table| !table.values.is_empty());
    let places = document
        .controls
        .iter()
        .map(|control| control.table.place.clone())
        .chain(tables.map(|table| table.place.clone()));
    let asking = places.min_by_key(Place::start);
    let Some((place, diagnostic)) = asking.zip(free_motion(reduced).err()) else { return true };
    out.push(diagnostic.at(place, "needs a free motion"));
    false
}

/// The note on prescribed motions where a model is analysed at rest.
pub(in crate::study) fn prescribed_note(reduced: &Reduced) -> Option<String> {
    let names: Vec<&str> = prescribed(reduced).collect();
    (!names.is_empty())
        .then(|| format!("{}: a prescribed motion is constant there, at its initial value", quoted(names)))
}

/// The equilibrium on the multiplier constraints for an analysis.
struct RestPoint {
    /// With constant torques if they balance it.
    point: OperatingPoint,
    multipliers: Vec<f64>,
    /// Notes on it.
    point_notes: Vec<String>,
}

impl RestPoint {
    /// The operating point of the analysis of a variant.
    fn of(variant: &PreparedVariant) -> Result<Self, String> {
        let (own, spec) = (&variant.reduced, &variant.analysis);
        let names = own.coordinate_names();
        let still = vec![0.0; names.len()];
        let count = own.equations.multiplier_constraints.len();
        let start_position = spec.position(&names, &variant.scenario.position);
        let is_named = |k: &usize| spec.at.iter().any(|(shaft, _)| *shaft == names[*k]);
        let fixed: Vec<(usize, f64)> =
            (0..names.len()).filter(is_named).map(|k| (own.coordinates[k], start_position[k])).collect();
        let prescribed = StartValues { values: [fixed.clone(), Vec::new()] };
        let start = start_on_rows(own, &prescribed, &start_position, &still)
            .map_err(|_| "no position that satisfies the constraints was found near these angles".to_string())?
            .position;
        let mut point_notes = Vec::new();
        if start.iter().zip(&start_position).any(|(now, then)| moved(*now, *then)) || !fixed.is_empty() {
            point_notes.push(format!("operating point: satisfies the constraints, {}", format_position(own, &start)));
        }
        if own.equations.laws.is_empty() {
            return Ok(Self { point: OperatingPoint::unloaded(&start), multipliers: vec![0.0; count], point_notes });
        }
        if spec.at.is_empty() {
            let Rest { equilibrium: Equilibrium { position, rates, multipliers, .. }, found, more, .. } =
                Rest::near(own, &start)?;
            point_notes = vec![format!("operating point: {found}")];
            point_notes.extend(more.into_iter().map(|more| more.replace("CHOICE", "`at` of `[analysis]`")));
            return Ok(Self {
                point: OperatingPoint { position, rates, torques: None, side: Side::default() },
                multipliers,
                point_notes,
            });
        }
        let all: Vec<usize> = (0..names.len()).collect();
        let equations = &own.equations;
        let is_motor = |k: &usize| matches!(equations.inputs[*k].value, InputKind::Motor(_));
        let motors: Vec<usize> = (0..equations.inputs.len()).filter(is_motor).collect();
        for inputs in [&[][..], &motors] {
            let found = trim(own, &start, &all, inputs);
            if !found.at_rest {
                continue;
            }
            let mut torques = vec![0.0; equations.inputs.len()];
            inputs.iter().zip(&found.torques).for_each(|(input, torque)| torques[*input] = *torque);
            let holding = inputs.iter().map(|k| format!("{} = {:.6}", equations.inputs[*k].element, torques[*k]));
            let holding: Vec<String> = holding.collect();
            if !holding.is_empty() {
                point_notes.push(format!("constant torques balance the operating point: {} (SI)", holding.join(", ")));
            }
            let point =
                OperatingPoint { position: start, rates: found.rates, torques: Some(torques), side: Side::default() };
            return Ok(Self { point, multipliers: found.multipliers, point_notes });
        }
        Err(format!("{} is no equilibrium: neither constraints nor motors balance it", format_position(own, &start)))
    }

    /// The variant with its constraints frozen there.
    fn freeze(self, variant: &PreparedVariant) -> Result<PreparedVariant, ReduceError> {
        let Self { point, multipliers, point_notes: mut start_notes } = self;
        if multipliers.iter().any(|torque| *torque != 0.0) {
            let own = &variant.reduced.equations;
            let carried = own.multiplier_constraints.iter().zip(&multipliers).filter(|(_, torque)| **torque != 0.0);
            let carried: Vec<String> =
                carried.map(|(constraint, torque)| format!("{} {torque:.6}", constraint.element)).collect();
            let text = "constraint forces there rotate with the constraint directions and are part of the stiffness; \
                        multipliers (SI, rounded to 16 digits)";
            start_notes.push(format!("{text}: {}", carried.join(", ")));
        }
        start_notes.extend(prescribed_note(&variant.reduced));
        let (reduced, point) = frozen_point(&variant.reduced, &point, &multipliers)?;
        start_notes.extend(rounded_rows(&reduced));
        let unfrozen = Some(Box::new(variant.reduced.clone()));
        Ok(PreparedVariant { unfrozen, start_notes, ..variant.with_model(reduced, point) })
    }
}

/// The note on frozen constraints with coefficients that are no fractions there.
pub(in crate::study) fn rounded_rows(reduced: &Reduced) -> Option<String> {
    let rounded = &reduced.equations.rounded;
    (!rounded.is_empty()).then(|| {
        let names = quoted(rounded);
        format!(
            "the coefficients of {names} are rounded to 16 digits at the operating point: exact verdicts are for the \
             rounded rows"
        )
    })
}

/// A model with its multiplier constraints frozen at an operating point, and that point in its coordinates.
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
    let kinematics = Kinematics::at(reduced, &point.position, &point.rates);
    (kinematics.angles, kinematics.speeds)
}

/// The plant of a law with multiplier constraints: with these frozen at its operating point.
///
/// # Errors
/// Those of [`frozen`].
pub(in crate::study) fn on_frozen_rows(
    own: &Reduced,
    point: &OperatingPoint,
    multipliers: &[f64],
) -> Result<Plant, ReduceError> {
    let (reduced, frozen_position) = frozen_point(own, point, multipliers)?;
    let mut plant = Plant::at(reduced, frozen_position);
    plant.frozen = Some(motion_at(own, point).0);
    Ok(plant)
}

/// A variant for the analysis of its loop with its multiplier constraints frozen at the operating point.
pub(in crate::study) fn with_loop(mut variant: PreparedVariant, multipliers: &[f64]) -> PreparedVariant {
    if !variant.reduced.equations.multiplier_constraints.is_empty() && !variant.designed.is_empty() {
        let (point, multipliers) = (variant.point.clone(), multipliers.to_vec());
        let looped = RestPoint { point, multipliers, point_notes: Vec::new() }.freeze(&variant);
        // Its plants have reported missing ones.
        variant.looped = looped.ok().map(Box::new);
    }
    variant
}

/// The error that a law needs the full model.
pub(in crate::study) fn not_on_rows(control: &ControlSpec, reduced: &Reduced) -> Diagnostic {
    let names = quoted(multiplier_elements(reduced));
    let message = format!(
        "control `{}`: a law on the full nonlinear model does not support constraints that are not solved for a \
         coordinate: {names}",
        control.name
    );
    Diagnostic::error("constraint::multiplier", message)
        .at(&control.place, "this controller")
        .help("take a law that is designed at an operating point: `lqr`, `pole_placement` or `decoupling`")
}

/// The error that constraints have no linearisation.
pub(in crate::study) fn rows_refused(control: &ControlSpec, reduced: &Reduced, error: &ReduceError) -> Diagnostic {
    let names = quoted(multiplier_elements(reduced));
    let message = format!("control `{}`: at its operating point {names} cannot be enforced: {error}", control.name);
    Diagnostic::error("constraint::multiplier", message)
        .at(&control.place, "this controller")
        .help("give other angles by `initial` of `[scenario]`, or by `at` of the controller")
}
