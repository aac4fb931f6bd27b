//! Operating points in motion: the steady motion at given speeds, and the state of a run at a time.

use std::collections::BTreeSet;

use crate::study::PreparedVariant;
use crate::study::check::equilibrium::format_position;
use crate::study::check::multiplier_constraints::{moves_by_itself, multiplier_elements};
use crate::study::read::state_names::motors;
use crate::study::requests::analysis_spec::OperatingConditions;
use kardan_expr::expr::Side;
use kardan_mechanics::equations::{InputKind, Meaning, UnilateralConstraint};
use kardan_mechanics::reduce::{
    Instant, MotionSpec, NoSteadyMotion, OperatingPoint, Reduced, SteadyMotion, accelerations, engaged_locks,
    motion_of, reads_blocks, steady_motion, with_enforced, with_sliding,
};
use kardan_results::signal_name::Quantity;
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_simulate::{Setup, Simulation, Tolerance};

/// An acceleration below this fraction of the largest counts as zero, relative to the tolerance of a run.
const NONE: f64 = 1e-9;

/// The operating point in motion of a variant.
pub(in crate::study) struct MovingPoint {
    /// The model there: sticking or engaged elements are constraints, sliding ones are torques, functions of time are numbers.
    pub model: Reduced,
    /// Its position, its motion, and the torques of its inputs.
    pub point: OperatingPoint,
    /// Positions and speeds of the coordinates of the variant.
    pub motion: [Vec<f64>; 2],
    /// Elements that stick or are engaged there.
    pub closed: BTreeSet<String>,
    /// Notes on it.
    pub notes: Vec<String>,
}

/// The given values of an operating point, and the inputs that may balance it.
pub(in crate::study) struct PointRequest<'a> {
    /// Positions of coordinates.
    pub at: &'a [(String, f64)],
    /// Speeds, torques, the time.
    pub conditions: &'a OperatingConditions,
    /// Names of the inputs that may balance it.
    pub inputs: &'a [String],
    /// Elements that stick or are engaged.
    pub stuck: &'a BTreeSet<String>,
    /// The initial position of the search.
    pub start: &'a [f64],
}

fn refused(message: String, help: &str) -> Diagnostic {
    Diagnostic::error("analysis::operating-point", message).help(help)
}

/// Elements that exclude an operating point in motion.
fn check_rows(variant: &PreparedVariant) -> Result<(), Diagnostic> {
    let rows = variant.unfrozen.as_deref().unwrap_or(&variant.reduced);
    let names: Vec<&str> = multiplier_elements(rows).chain(moves_by_itself(rows)).collect();
    if names.is_empty() {
        return Ok(());
    }
    let message = format!(
        "kardan finds no operating point in motion with constraints that are enforced by multipliers or prescribe a \
         motion: {}",
        quoted(names)
    );
    Err(refused(message, "give only positions in `at`: the model is then linear at rest there"))
}

/// Functions of time are known for the duration of the run.
fn check_time(variant: &PreparedVariant, time: f64) -> Result<(), Diagnostic> {
    let end = variant.scenario.duration;
    if time > end {
        return Err(refused(
            format!("`t` = {time} s is after the end of the run, {end} s"),
            "name an earlier time, or run for longer: `duration` of `[scenario]`",
        ));
    }
    Ok(())
}

/// The operating point in motion of a variant: the state of its run if only a time is given, else the steady motion with the given
/// values.
///
/// # Errors
/// Why there is none.
pub(in crate::study) fn point_in_motion(
    variant: &PreparedVariant,
    request: &PointRequest<'_>,
) -> Result<MovingPoint, Diagnostic> {
    let OperatingConditions { speeds, torques, time } = request.conditions;
    match time {
        Some(time) if request.at.is_empty() && speeds.is_empty() && torques.is_empty() => point_of_run(variant, *time),
        _ => steady_point(variant, request),
    }
}

/// The steady motion of a variant with the given values.
fn steady_point(variant: &PreparedVariant, request: &PointRequest<'_>) -> Result<MovingPoint, Diagnostic> {
    check_rows(variant)?;
    let own = &variant.reduced;
    let time = request.conditions.time.unwrap_or(0.0);
    check_time(variant, time)?;
    let instant = Instant { time, ..Instant::default() };
    let base = Reduced { equations: instant.equations(&own.equations), ..own.clone() };
    let number = |name: &String| own.equations.coordinates.iter().position(|candidate| candidate == name);
    let by_number = |list: &[(String, f64)]| -> Vec<(usize, f64)> {
        list.iter().filter_map(|(name, value)| Some((number(name)?, *value))).collect()
    };
    let (positions, speeds) = (by_number(request.at), by_number(&request.conditions.speeds));
    let rates: Vec<f64> = (own.coordinates.iter())
        .map(|shaft| speeds.iter().find(|(candidate, _)| candidate == shaft).map_or(0.0, |(_, speed)| *speed))
        .collect();
    let mut start = request.start.to_vec();
    for (shaft, angle) in &positions {
        own.coordinates.iter().position(|candidate| candidate == shaft).into_iter().for_each(|k| start[k] = *angle);
    }
    let mut enforced = engaged_locks(&base, &start, &rates);
    enforced.extend(
        own.equations.set_valued().enumerate().filter(|(_, (name, _))| request.stuck.contains(*name)).map(|(k, _)| k),
    );
    let input = |name: &String| own.equations.inputs.iter().position(|candidate| candidate.element == *name);
    let torques: Vec<(usize, f64)> =
        request.conditions.torques.iter().filter_map(|(name, torque)| Some((input(name)?, *torque))).collect();
    let is_fixed = |k: &usize| torques.iter().any(|(candidate, _)| candidate == k);
    let inputs = request.inputs.iter().filter_map(input).filter(|k| !is_fixed(k)).collect();
    let motion_spec = MotionSpec { positions, speeds, inputs, torques, enforced };
    let found = steady_motion(&base, &start, &motion_spec)
        .map_err(|why| no_steady_motion(&base, request, &motion_spec, why))?;
    let mut notes = vec![format!("operating point: {}", describe_steady_motion(&base, &found))];
    notes.extend(describe_undetermined(&base, &found));
    notes.extend(describe_nonsmooth_elements(own, &base, (&motion_spec.enforced, &found.sliding), (time, false)));
    let SteadyMotion { model, point, motion, .. } = found;
    Ok(MovingPoint { model, point, motion, closed: elements_of(own, &motion_spec.enforced), notes })
}

/// A speed as text: `car.v = 5.555556 m/s`, of a shaft also in turns.
fn format_speed(reduced: &Reduced, coordinate: usize, speed: f64) -> String {
    let [_, quantity] = reduced.equations.domain(coordinate).motion();
    format!("{} = {speed:.6} {}", quantity.of(&reduced.equations.coordinates[coordinate]), quantity.unit())
}

fn format_torques(reduced: &Reduced, point: &OperatingPoint) -> Vec<String> {
    let torques = reduced.equations.inputs.iter().zip(point.torques.iter().flatten());
    let one = |(input, torque): (&kardan_mechanics::assemble::DirectionalTerm<InputKind>, &f64)| {
        let effort = reduced.equations.domain_of(input).effort();
        format!("{} = {torque:.6} {}", effort.of(&input.element), effort.unit())
    };
    torques.filter(|(_, torque)| **torque != 0.0).map(one).collect()
}

/// Positions of coordinates at rest, as text.
fn describe_rest(base: &Reduced, [position, speeds]: &[Vec<f64>; 2]) -> Option<String> {
    let names = base.coordinate_names();
    let all = format_position(base, position);
    let still: Vec<&str> =
        all.split(", ").zip(speeds).filter(|(_, speed)| **speed == 0.0).map(|(own, _)| own).collect();
    (still.len() < names.len() && !still.is_empty()).then(|| still.join(", "))
}

fn format_motion(base: &Reduced, [position, speeds]: &[Vec<f64>; 2]) -> String {
    let moving = base.coordinates.iter().zip(speeds).filter(|(_, speed)| **speed != 0.0);
    let moving: Vec<String> = moving.map(|(shaft, speed)| format_speed(base, *shaft, *speed)).collect();
    match moving.is_empty() {
        true => format_position(base, position),
        false => moving.join(", "),
    }
}

/// A steady motion, the torques that balance it, and which properties are proven, as text.
fn describe_steady_motion(base: &Reduced, found: &SteadyMotion) -> String {
    let torques = format_torques(base, &found.point);
    let by = match torques.is_empty() {
        true => "without torques of inputs".to_string(),
        false => format!("balanced by {}", torques.join(", ")),
    };
    let at_rest_text = describe_rest(base, &found.motion).map_or(String::new(), |text| format!("; {text}"));
    let proven = match found.radius {
        _ if !found.balanced => {
            let off = describe_accelerations(&found.model, &found.accelerations);
            return format!("{}, {by}{at_rest_text}; {off}", format_motion(base, &found.motion));
        }
        _ if found.whole => "nothing accelerates".to_string(),
        Some(0.0) => "proven: nothing accelerates, exactly".to_string(),
        Some(radius) => format!("proven: there is exactly one within {radius:e} of it, relative to its size or to one"),
        None => "to rounding, not proven".to_string(),
    };
    let what = if found.whole { "the instant with" } else { "steady at" };
    format!("{what} {}, {by}{at_rest_text}; {proven}", format_motion(base, &found.motion))
}

/// Note that it is no equilibrium, with the accelerations.
fn describe_accelerations(model: &Reduced, accelerations: &[f64]) -> String {
    let one = |(shaft, acceleration): (&usize, &f64)| {
        let [_, quantity] = model.equations.domain(*shaft).motion();
        let name = quantity.of(&model.equations.coordinates[*shaft]);
        format!("{name} changes by {acceleration:.6} {}/s", quantity.unit())
    };
    let nonzero: Vec<String> =
        model.coordinates.iter().zip(accelerations).filter(|(_, x)| **x != 0.0).map(one).collect();
    format!("not an equilibrium, small motions are relative to its own motion: {}", nonzero.join(", "))
}

/// Coordinates that rotate without a torque that depends on their angle, and undetermined coordinates.
fn describe_undetermined(base: &Reduced, found: &SteadyMotion) -> Vec<String> {
    let mut out = Vec::new();
    let names =
        |list: &[usize], of: &dyn Fn(usize) -> String| list.iter().map(|k| of(*k)).collect::<Vec<_>>().join(", ");
    if !found.open.is_empty() {
        let model = &found.model;
        let name = |k: usize| {
            let shaft = model.coordinates[k];
            model.equations.domain(shaft).motion()[1].of(&model.equations.coordinates[shaft])
        };
        out.push(format!(
            "no torque determines {}: taken as the smallest that fits; `at` gives another",
            names(&found.open, &name)
        ));
    }
    if !found.idle.is_empty() {
        let name = |k: usize| base.equations.inputs[k].element.clone();
        out.push(format!("inputs without effect on the balance are zero there: {}", names(&found.idle, &name)));
    }
    out
}

/// The states of locks, frictions, clutches and functions of time at a point.
fn describe_nonsmooth_elements(
    own: &Reduced,
    base: &Reduced,
    (enforced, sliding): (&BTreeSet<usize>, &[f64]),
    (time, of_run): (f64, bool),
) -> Vec<String> {
    let equations = &base.equations;
    let elements: Vec<&str> = equations.set_valued().map(|(element, _)| element).collect();
    let of = |choose: &dyn Fn(usize) -> bool| {
        let names: BTreeSet<&str> = (0..elements.len()).filter(|k| choose(*k)).map(|k| elements[k]).collect();
        (!names.is_empty()).then(|| quoted(names))
    };
    let kind =
        |k: usize| k.checked_sub(equations.frictions.len()).map(|unilateral| &equations.unilaterals[unilateral].value);
    let is_friction = |k: usize| matches!(kind(k), None | Some(UnilateralConstraint::Friction { .. }));
    let is_lock = |k: usize| matches!(kind(k), Some(UnilateralConstraint::Lock { .. } | UnilateralConstraint::OneWay));
    let closed = |k: usize| enforced.contains(&k);
    let slides = |k: usize| sliding[k] != 0.0 && is_friction(k);
    let rests = |k: usize| sliding[k] == 0.0 && is_friction(k) && !closed(k);
    let open = |k: usize| is_lock(k) && !closed(k);
    let is_gear_loss = |k: usize| matches!(kind(k), Some(UnilateralConstraint::GearLoss(_)));
    type State<'s> = (&'s dyn Fn(usize) -> bool, &'s str, &'s str);
    let states: [State<'_>; 5] = [
        (&closed, "closed at the operating point (locked or sticking)", ""),
        (&slides, "sliding at the operating point, its friction is part of the balance", ""),
        (
            &rests,
            "without relative motion at the operating point and treated as sliding without friction",
            "; `stuck` of `[analysis]` lets it stick",
        ),
        (&open, "open at the operating point", ""),
        (&is_gear_loss, "load-dependent losses are left out at the operating point", ""),
    ];
    let mut out = Vec::new();
    for (is_so, what, more) in states {
        out.extend(of(is_so).map(|names| format!("{what}: {names}{more}")));
    }
    let (mut laws, unilaterals) = (own.equations.laws.iter(), own.equations.unilaterals.iter());
    let blocks = laws.clone().any(|law| reads_blocks(&law.value));
    let mut formulas = unilaterals.filter_map(|unilateral| unilateral.value.formula());
    if laws.any(|law| law.value.is_of_time()) || formulas.any(|formula| formula.is_of_time()) {
        let outputs_text =
            if blocks && !of_run { "; outputs of blocks are those before their first sample, zero" } else { "" };
        out.push(format!("functions of time are evaluated at {time} s{outputs_text}"));
    }
    out
}

/// The error that there is no steady motion.
fn no_steady_motion(
    base: &Reduced,
    request: &PointRequest<'_>,
    motion_spec: &MotionSpec,
    why: NoSteadyMotion,
) -> Diagnostic {
    let equations = &base.equations;
    let signal = |k: usize| {
        let (shaft, speed) = motion_spec.speeds[k];
        format!("`{}`", format_speed(base, shaft, speed))
    };
    let inputs = |list: &[usize]| quoted(list.iter().map(|k| &equations.inputs[*k].element));
    match why {
        NoSteadyMotion::Turns(k) => {
            let shaft = motion_spec.speeds[k].0;
            let name = &equations.coordinates[shaft];
            let [angle, _] = equations.domain(shaft).motion();
            let depends = depending(base, shaft);
            let what = if depends.is_empty() { "what it moves".into() } else { quoted(depends) };
            refused(
                format!("{} is not steady: {what} depends on `{}`, which changes", signal(k), angle.of(name)),
                &format!(
                    "give all positions and speeds too (`\"{}\" = \"0 {}\"`): the linear model is then that of this instant; or name a time of a run: `at = \"t = 1 s\"`",
                    angle.of(name),
                    if angle == Quantity::Angle { "deg" } else { angle.unit() }
                ),
            )
        }
        NoSteadyMotion::Contradiction(list) => refused(
            format!(
                "the speeds {} contradict each other",
                list.iter().map(|k| signal(*k)).collect::<Vec<_>>().join(", ")
            ),
            "remove one of them: values that are not given follow",
        ),
        NoSteadyMotion::Undetermined(list) => {
            let last = &equations.inputs[list[list.len() - 1]];
            let effort = equations.domain_of(last).effort();
            let example = format!("`\"{}\" = \"0 {}\"`", effort.of(&last.element), effort.unit());
            refused(
                format!("more than one choice of the torques of {} balances it", inputs(&list)),
                &format!("give all torques except the unknown ones in `at`: {example}"),
            )
        }
        NoSteadyMotion::Unbalanced(name, torque, _) => {
            let domain = base.coordinate(&name).map(|shaft| equations.domain(shaft)).unwrap_or_default();
            let by = match (motion_spec.inputs.as_slice(), request.conditions.torques.is_empty()) {
                ([], true) => "there is no motor that could balance it".to_string(),
                ([], false) => "with the given torques no input remains to balance it".to_string(),
                (some, _) => format!("{} cannot balance it", inputs(some)),
            };
            refused(
                format!(
                    "no steady motion was found: {by}; the smallest residual is {torque:.6} {} on `{name}`",
                    domain.effort().unit()
                ),
                "give one speed less or another one, or close the element that carries the torque: an engaged lock, \
                 a clutch or friction in `stuck`",
            )
        }
        NoSteadyMotion::Slides(list) => refused(
            format!(
                "no steady motion was found: the sliding direction of the frictions of {} is not decided",
                quoted(list)
            ),
            "list the sticking ones in `stuck` of `[analysis]`, or give their sliding speeds",
        ),
    }
}

/// Elements whose torque depends on the position of a shaft that moves with a coordinate.
fn depending(base: &Reduced, shaft: usize) -> BTreeSet<String> {
    let equations = &base.equations;
    let name = &equations.coordinates[shaft];
    let of_law = equations.laws.iter().filter(|law| {
        law.value.all_names().iter().any(|(_, meaning)| matches!(meaning, Meaning::Position(body) if body == name))
    });
    let only_of_shaft = |row: &[(usize, kardan_math::num::Rational)]| matches!(row, [(k, _)] if *k == shaft);
    let of_springs = equations.springs.iter().filter(|spring| only_of_shaft(&spring.row)).map(|spring| &spring.element);
    let of_stops = equations.unilaterals.iter().filter(|unilateral| {
        matches!(unilateral.value, UnilateralConstraint::Stop { .. } | UnilateralConstraint::Cushion { .. })
            && only_of_shaft(&unilateral.row)
    });
    let of_joints = equations.transmissions.iter().filter(|one| one.driven == shaft || one.driving == shaft);
    (of_law.map(|law| &law.element))
        .chain(of_springs)
        .chain(of_stops.map(|unilateral| &unilateral.element))
        .chain(of_joints.map(|one| &one.element))
        .cloned()
        .collect()
}

/// The state of the run of a variant at a time.
fn point_of_run(variant: &PreparedVariant, time: f64) -> Result<MovingPoint, Diagnostic> {
    check_rows(variant)?;
    check_time(variant, time)?;
    if !variant.massless.is_empty() || variant.implemented.len() != variant.model.controls.len() {
        return Err(refused(
            "with motions without inertia kardan cannot use the state of a run".into(),
            "give the moving parts an inertia, or give positions and speeds in `at`",
        ));
    }
    let own = &variant.reduced;
    let setup = Setup { reduced: own, laws: &variant.implemented, scenario: &variant.scenario };
    let mut run = Simulation::new(setup, Tolerance::default());
    run.advance(time).map_err(|why| {
        refused(format!("the run does not reach {time} s: {why}"), "`kardan run` shows how far it comes")
    })?;
    let mut value = |name: &str| run.signal(name).ok().map(|signal| run.get(signal));
    let names = own.coordinate_names();
    let motion = [0, 1].map(|rate| -> Vec<f64> {
        let signals = own
            .coordinates
            .iter()
            .zip(&names)
            .map(|(shaft, name)| own.equations.domain(*shaft).motion()[rate].of(name));
        signals.map(|signal| value(&signal).unwrap_or(0.0)).collect()
    });
    let torques: Vec<f64> = (own.equations.inputs.iter())
        .map(|input| value(&own.equations.domain_of(input).effort().of(&input.element)).unwrap_or(0.0))
        .collect();
    let outputs = blocks_of(own).into_iter().filter_map(|name| Some((name.to_string(), value(name)?))).collect();
    let instant = Instant { time, outputs };
    let (enforced, sliding) = modes(own, &run.modes());
    let base = Reduced { equations: instant.equations(&own.equations), ..own.clone() };
    let slid = Reduced { equations: with_sliding(&base.equations, &sliding), ..base.clone() };
    let model = with_enforced(&slid, &enforced, &motion[0], &names);
    let place = |shaft: &usize| own.coordinates.iter().position(|candidate| candidate == shaft);
    let of = |list: &[f64]| model.coordinates.iter().map(|shaft| place(shaft).map_or(0.0, |k| list[k])).collect();
    let point = OperatingPoint {
        position: of(&motion[0]),
        rates: of(&motion[1]),
        torques: Some(torques),
        side: Side::default(),
    };
    let residual = accelerations(&model, &point);
    let moving = own.coordinates.iter().zip(&motion[1]).filter(|(_, speed)| **speed != 0.0);
    let all: Vec<String> = std::iter::once(format_position(&base, &motion[0]))
        .chain(moving.map(|(shaft, speed)| format_speed(&base, *shaft, *speed)))
        .collect();
    let mut text = format!("operating point: the run at {time} s: {}", all.join(", "));
    let torques = format_torques(&base, &point);
    if !torques.is_empty() {
        text += &format!(", under {}", torques.join(", "));
    }
    let most = residual.iter().fold(0.0, |most, x| f64::max(most, x.abs()));
    let residual: Vec<f64> = residual.iter().map(|x| if x.abs() <= NONE * most.max(1.0) { 0.0 } else { *x }).collect();
    if residual.iter().any(|x| *x != 0.0) {
        text += &format!("; {}", describe_accelerations(&model, &residual));
    }
    let mut notes = vec![text];
    notes.extend(describe_nonsmooth_elements(own, &base, (&enforced, &sliding), (time, true)));
    let closed = elements_of(own, &enforced);
    Ok(MovingPoint { motion: motion_of(&base, &model, &point), model, point, closed, notes })
}

/// Elements of set-valued directions.
fn elements_of(reduced: &Reduced, directions: &BTreeSet<usize>) -> BTreeSet<String> {
    let all = reduced.equations.set_valued().enumerate();
    all.filter(|(k, _)| directions.contains(k)).map(|(_, (element, _))| element.to_string()).collect()
}

/// Names of the blocks that torques, clutches and locks of a model read.
fn blocks_of(reduced: &Reduced) -> BTreeSet<&str> {
    let laws = reduced.equations.laws.iter().map(|law| &law.value);
    let unilaterals = reduced.equations.unilaterals.iter().filter_map(|unilateral| unilateral.value.formula());
    laws.chain(unilaterals).flat_map(|formula| formula.blocks()).collect()
}

/// The signs of set-valued directions in a run (0: at rest): which of them are enforced, and with which signs frictions slide.
fn modes(reduced: &Reduced, signs: &[Option<f64>]) -> (BTreeSet<usize>, Vec<f64>) {
    let equations = &reduced.equations;
    let kind =
        |k: usize| k.checked_sub(equations.frictions.len()).map(|unilateral| &equations.unilaterals[unilateral].value);
    let sticks = |k: &usize| {
        signs[*k] == Some(0.0)
            && !matches!(kind(*k), Some(UnilateralConstraint::Cushion { .. } | UnilateralConstraint::GearLoss(_)))
    };
    let slides = |k: usize| matches!(kind(k), None | Some(UnilateralConstraint::Friction { .. }));
    let all = 0..equations.set_valued().count();
    let sliding = all.clone().map(|k| if slides(k) { signs[k].unwrap_or(0.0) } else { 0.0 }).collect();
    (all.filter(sticks).collect(), sliding)
}

/// The inputs that may balance a steady motion: the motors among these, or all motors.
pub(in crate::study) fn balancing(variant: &PreparedVariant, inputs: &[String]) -> Vec<String> {
    let motors: Vec<String> = motors(&variant.reduced.equations).map(|input| input.element.clone()).collect();
    let own: Vec<String> = inputs.iter().filter(|name| motors.contains(name)).cloned().collect();
    if own.is_empty() { motors } else { own }
}
