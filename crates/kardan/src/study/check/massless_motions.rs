//! Motions without inertia in runs: eliminated if only springs act on them, states of first order if dampers do, else rejected by name.

use crate::study::check::circuit::{is_loop, massless_loop};
use crate::study::check::model_checks::check_matrices;
use crate::study::read::locations::{place_of, places_in_control};
use kardan_analysis::combination;
use kardan_math::num::Rational;
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::equations::Domain;
use kardan_mechanics::reduce::{
    NoEquilibrium, NoMasslessDynamics, Reduced, equilibrium_rows, massless_dynamics, reduce, sparse_model,
};
use kardan_model::{ControlSpec, Document, Model};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_synthesis::{Law, Plant};

/// Why a motion without inertia cannot be simulated, and the remedy.
struct Refusal {
    /// The branches of a loop, where it is one of a circuit.
    branches: Vec<String>,
    /// The constraint that it moves.
    constraint: Option<String>,
    why: String,
    help: &'static str,
}

fn refusal(why: String, help: &'static str) -> Refusal {
    Refusal { branches: Vec::new(), constraint: None, why, help }
}

/// Rejection of a massless motion that moves a multiplier constraint.
fn refusal_beside(equations: &Equations, element: String) -> Refusal {
    let constraint = equations.multiplier_constraints.iter().find(|constraint| constraint.element == element);
    let help = match constraint.and_then(|constraint| equations.domain_of_multiplier(constraint)) {
        Some(Domain::Charge) => {
            "put an inductor into this loop, or write the current as a sum whose integral is known: powers of `t`, sines, cosines and \
             exponentials of straight lines, cubic tables without their third power"
        }
        _ if constraint.is_some_and(|constraint| constraint.law.prescribes()) => {
            "give one of these shafts an inertia, or prescribe `angle` or `position` in place of the speed, of which no inertia is needed: `position = \"0.1 m/s * t\"`"
        }
        _ => "give one of these shafts an inertia, or let the constraint act on shafts that have one",
    };
    Refusal {
        constraint: Some(element.clone()),
        ..refusal(format!("such a motion cannot be simulated with `{element}`"), help)
    }
}

const GIVE_INERTIA: &str = "give one of these shafts an inertia";
const GIVE_INDUCTANCE: &str = "put an inductance into this loop: each winding has one, `inductance` of a `dc_motor`, or an inductor (wires have some 1 uH per metre)";

/// The model of a run in which motions without inertia follow from springs, or from first-order dynamics with dampers; `massless` contains the
/// diagnostics for these motions if neither applies.
pub(in crate::study) fn without_massless(
    document: &Document,
    model: &Model,
    reduced: &Reduced,
    massless: &[Diagnostic],
    out: &mut Vec<Diagnostic>,
) -> Option<Reduced> {
    match settled(document, model, reduced).and_then(relaxing).and_then(|found| under_laws(model, found)) {
        Ok(found) => Some(found),
        Err(Refusal { branches, constraint, why, help }) => {
            let diagnostics =
                if branches.is_empty() { massless.to_vec() } else { vec![massless_loop(document, &branches)] };
            out.extend(diagnostics.into_iter().map(|mut diagnostic| {
                diagnostic.message += &format!("; {why}");
                let help = if help == GIVE_INERTIA && is_loop(&diagnostic) { GIVE_INDUCTANCE } else { help };
                let place = constraint.iter().map(|element| place_of(document, element));
                diagnostic.at_each(place, "this constraint").help(help)
            }));
            None
        }
    }
}

/// The model with the equilibrium equations of motions on which only springs act.
fn settled(document: &Document, model: &Model, reduced: &Reduced) -> Result<Reduced, Refusal> {
    let names = |direction: &[(usize, Rational)]| {
        let scale = direction.first().map_or(Rational::ONE, |(_, share)| share.clone());
        let named =
            |(shaft, share): &(usize, Rational)| (reduced.equations.coordinates[*shaft].clone(), share / &scale);
        combination(&direction.iter().map(named).collect::<Vec<_>>())
    };
    let rows = equilibrium_rows(&reduced.equations).map_err(|error| {
        let equations = &reduced.equations;
        let direction = match &error {
            NoEquilibrium::MultiplierConstraint { element, .. } => return refusal_beside(equations, element.clone()),
            NoEquilibrium::Driven { direction, .. } | NoEquilibrium::Free { direction } => direction,
        };
        let is_circuit = direction.iter().all(|(k, _)| equations.domain(*k) == Domain::Charge);
        let branches =
            direction.iter().filter(|_| is_circuit).map(|(k, _)| equations.coordinates[*k].clone()).collect();
        let (springs, it, help) = match (&error, is_circuit) {
            (NoEquilibrium::Free { .. }, _) => {
                ("", "", "give one of these shafts an inertia, or tie it to another one by a gear or a spring")
            }
            (_, true) => ("capacitors", "its charge", "put a resistance or an inductance into this loop"),
            (_, false) => (
                "springs",
                "it",
                "give one of these shafts an inertia or a damping, or let the input act on one that has",
            ),
        };
        let why = match &error {
            NoEquilibrium::Driven { inputs, sprung, direction } => {
                let (moving, inputs) = (names(direction), quoted(inputs));
                match sprung {
                    true => format!("on {moving} only {springs} resist {inputs}, so {it} would jump with them"),
                    false => format!("on {moving} nothing resists {inputs}, so {it} would move infinitely fast"),
                }
            }
            _ => format!("nothing acts on {}", names(direction)),
        };
        Refusal { branches, ..refusal(why, help) }
    })?;
    if rows.is_empty() {
        return Ok(reduced.clone());
    }
    let equations = reduced.equations.clone().with_equilibria(rows);
    let mut settled = reduce(equations, model.coordinates.as_deref()).map_err(|error| {
        let why = format!("with the equilibrium of massless shafts and springs, {error}");
        refusal(why, "give one of these shafts an inertia, or leave `coordinates` out to have them chosen")
    })?;
    settled.redundant.clone_from(&reduced.redundant);
    // Errors of these matrices have been reported.
    match check_matrices(document, &settled, &mut Vec::new(), &mut Vec::new()) {
        true => Ok(settled),
        false => Err(refusal("the springs that act on it do not replace the inertia".into(), GIVE_INERTIA)),
    }
}

const CORRECT_DAMPING: &str = "correct the sign of a damping";

/// The model with states of first order for motions with dampers, or with friction elements in series with springs.
fn relaxing(mut reduced: Reduced) -> Result<Reduced, Refusal> {
    reduced.massless = massless_dynamics(&reduced).map_err(|error| match error {
        NoMasslessDynamics::Laws(elements) => refusal(
            format!("such motions cannot be simulated with torques that are laws ({})", quoted(elements)),
            GIVE_INERTIA,
        ),
        NoMasslessDynamics::Unilaterals(elements) => refusal(
            format!(
                "unilateral or switched constraints act on it or depend on it, or gear losses occur together \
                 with sliding friction: {}",
                quoted(elements)
            ),
            GIVE_INERTIA,
        ),
        NoMasslessDynamics::PositionDependent => refusal(
            "such motions cannot be simulated with transmissions whose ratio changes with the angle".into(),
            GIVE_INERTIA,
        ),
        NoMasslessDynamics::Friction { frictions, dampers } if dampers.is_empty() => refusal(
            format!(
                "the frictions of {} act on it, and a motion without inertia can have only one friction of its \
                 own",
                quoted(frictions)
            ),
            "write frictions between the same shafts as one, or give one of these shafts an inertia",
        ),
        NoMasslessDynamics::Friction { frictions, dampers } => refusal(
            format!(
                "the friction of {} and the damping of {} both act on it: a motion without inertia can have \
                 springs and dampers, or springs and one friction of its own",
                quoted(frictions),
                quoted(dampers)
            ),
            "remove its damping or its friction, or give one of these shafts an inertia",
        ),
        NoMasslessDynamics::Coupled(elements) => refusal(
            format!(
                "springs without inertia between them connect the friction of {} with a damper; kardan simulates \
                 the two only separately",
                quoted(elements)
            ),
            "give one of the shafts between them an inertia",
        ),
        NoMasslessDynamics::Falls(elements) => refusal(
            format!(
                "the friction of {} falls once it slips (`breakaway`), and without inertia or damper the size of \
                 the jump is not determined: with a small inertia it would jump twice as far as with a small \
                 damper",
                quoted(elements)
            ),
            "give the slipping shaft an inertia, or remove `breakaway`",
        ),
        NoMasslessDynamics::Slides(elements) => refusal(
            format!(
                "the frictions of {} can slip against each other without a spring, so which of them slips is not \
                 determined",
                quoted(elements)
            ),
            "put a spring beside one of these frictions, or give one of these shafts an inertia",
        ),
        NoMasslessDynamics::MultiplierConstraint(element) => refusal_beside(&reduced.equations, element),
        NoMasslessDynamics::Driven { frictions, inputs } => refusal(
            format!(
                "the friction of {} and springs resist {}, so it would jump with them",
                quoted(frictions),
                quoted(inputs)
            ),
            "give one of these shafts an inertia, or let the input act on one that has",
        ),
        NoMasslessDynamics::Coordinates => refusal(
            "the chosen coordinates move with it".into(),
            "name coordinates that have an inertia first, or give one of these shafts an inertia",
        ),
        NoMasslessDynamics::Damping => refusal("its damping is not positive definite".into(), CORRECT_DAMPING),
    })?;
    Ok(reduced)
}

/// Rejects controllers if a friction determines a massless motion: their design leaves friction out, so nothing would determine it.
fn under_laws(model: &Model, reduced: Reduced) -> Result<Reduced, Refusal> {
    let slips = reduced.massless.iter().flat_map(|massless| &massless.slips);
    let frictions: Vec<&str> = slips.map(|slip| reduced.equations.frictions[slip.friction].element.as_str()).collect();
    if frictions.is_empty() || model.controls.is_empty() {
        return Ok(reduced);
    }
    let why =
        format!("it depends on the friction of {}, and a controller is designed without friction", quoted(frictions));
    Err(refusal(why, "give one of these shafts an inertia or a damping, or leave the controllers out"))
}

/// Whether a law can be designed on a model with massless motions: dampers act on them, if the run has them too.
pub(in crate::study) fn is_designable(design: &Reduced, run: &Reduced) -> bool {
    let massless_coordinates = |reduced: &Reduced| {
        let inertia = sparse_model(reduced, &vec![0.0; reduced.degrees_of_freedom()]).inertia;
        (0..inertia.len()).filter(|k| inertia[*k].iter().all(|(j, _)| j != k)).collect::<Vec<_>>()
    };
    let relaxes = || match massless_dynamics(design) {
        Ok(found) => found.is_none_or(|found| found.slips.is_empty()),
        Err(_) => false,
    };
    design.coordinates == run.coordinates && massless_coordinates(design) == massless_coordinates(run) && relaxes()
}

/// Rejects laws that read rates of motions without inertia: these follow algebraically from the motors.
///
/// # Errors
/// If a law reads one.
pub(in crate::study) fn check_readings(
    document: &Document,
    (control, plant): (&ControlSpec, &Plant),
    law: &dyn Law,
) -> Result<(), Diagnostic> {
    if plant.linear.moving().len() == plant.linear.coordinates.len() {
        return Ok(());
    }
    let linear = law.linear();
    let read = |shaft: &usize| {
        [&linear.speeds, &linear.on_speeds].iter().any(|rows| (0..rows.rows()).any(|i| rows[(i, *shaft)] != 0.0))
    };
    let names = plant.motion_names();
    let shafts = (0..names.len()).filter(|shaft| !plant.linear.accelerates(*shaft)).filter(read);
    let shafts: Vec<usize> = shafts.collect();
    let Some(first) = shafts.first() else { return Ok(()) };
    let shaft_list = quoted(shafts.iter().map(|shaft| &names[*shaft][1]));
    let message = format!(
        "control `{}` reads {shaft_list}, which has no inertia behind it: it follows algebraically from the commands \
         of the law, which would form an algebraic loop",
        control.name
    );
    let place = places_in_control(document, control, &names[*first][1]).swap_remove(0);
    let is_circuit = shafts.iter().all(|shaft| plant.reduced.equations.domain(*shaft) == Domain::Charge);
    let help = match is_circuit {
        true => {
            "leave this current out, or give the loop an inductance (each winding has one: `inductance` of a `dc_motor`)"
        }
        false => "let it read positions, or speeds of shafts with an inertia",
    };
    Err(Diagnostic::error("control::massless", message).at(place, "this reading").help(help))
}

/// Rejects starts that are impossible for motions without inertia: speeds, which follow from the positions, and springs that make a friction slip at once.
pub(in crate::study) fn check_start(
    document: &Document,
    reduced: &Reduced,
    (position, speed): (&[f64], &[f64]),
    out: &mut Vec<Diagnostic>,
) {
    let Some(massless) = &reduced.massless else { return };
    let names = reduced.coordinate_names();
    let place = document.scenario.place_of("initial");
    for place_of_speed in massless.states().filter(|place| speed[*place] != 0.0) {
        let message = format!(
            "`initial` of `[scenario]`: `{}` has no inertia, so its speed follows from the positions and cannot be given",
            names[place_of_speed]
        );
        let help = "give its position alone, or give it an inertia";
        out.push(
            Diagnostic::error("scenario::massless", message).at(place, "with a speed that is not free").help(help),
        );
    }
    for (friction, torque) in reduced.slipping_friction_torques(position) {
        let friction = &reduced.equations.frictions[friction];
        let most = friction.value.torque.to_f64();
        if torque.abs() > most * (1.0 + 1e-9) {
            let message = format!(
                "at the start springs load the friction of `{}` with {torque:.6}, which sticks up to {most:.6} and \
                 has no inertia: it would jump",
                friction.element
            );
            let help = "start where its springs pull less, or give the slipping shaft an inertia";
            out.push(
                Diagnostic::error("scenario::massless", message).at(place, "starts from these positions").help(help),
            );
        }
    }
}
