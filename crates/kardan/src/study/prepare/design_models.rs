//! The model on which a law is designed, and the law as designed and as it runs.

use std::sync::Arc;

use crate::study::check::massless_motions::{check_readings, is_designable};
use crate::study::check::model_checks::{design_diagnostic, is_representable, signals_of};
use crate::study::check::multiplier_constraints::{moves_by_itself, not_on_rows, on_frozen_rows, rows_refused};
use crate::study::operating_point::named_point::{NamedPoint, check_smooth, no_equilibrium};
use crate::study::prepare::reduced_design_model::{excluded, model_excluding, needed_by};
use crate::study::read::locations::{place_in_control, places_in_control};
use crate::study::read::positions::is_finite_at;
use crate::study::read::variant_diagnostics::add_new;
use kardan_math::num::{Definiteness, Scalar, definiteness_of_rows};
use kardan_mechanics::assemble::assemble;
use kardan_mechanics::reduce::{Reduced, equilibrium_rows, reduce, sparse_model};
use kardan_model::{ControlSpec, Document, Model, Setting};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_schema::entries::Place;
use kardan_schema::schema::LawKeys;
use kardan_synthesis::{Law, Plant, Program, design_law, implemented, submodel_law};

/// The law of a controller as designed, and as it runs.
pub(super) fn designed_law(
    document: &Document,
    reduced: &Reduced,
    control: &ControlSpec,
    plant: &Plant,
    out: &mut Vec<Diagnostic>,
) -> Option<[Arc<dyn Law>; 2]> {
    let before = out.len();
    for signal in signals_of(control.law.fields, &control.values) {
        let shaft = SignalName::new(&signal).angle_of().and_then(|name| plant.reduced.coordinate(name));
        if shaft.is_some_and(|shaft| plant.linear.direction(shaft).row(0).iter().all(Scalar::is_zero)) {
            let message =
                format!("control `{}`: the output `{signal}` cannot move: the constraints fix it", control.name);
            out.push(
                Diagnostic::error("control::design", message)
                    .at(&places_in_control(document, control, &signal)[0], "fixed by constraints")
                    .help("choose an output that can move, or remove the constraint"),
            );
        }
    }
    if out.len() > before {
        return None;
    }
    let found = law_as_it_runs(document, reduced, control, plant);
    let [law, implemented] = found.map_err(|diagnostic| out.push(diagnostic)).ok()?;
    let why = plant.no_equilibrium.as_ref().filter(|_| !law.on_full_model());
    out.extend(why.map(|why| no_equilibrium(control, plant.default_point(), why)));
    let excluded = control.values.names("excluded_elements").filter(|names| !names.is_empty());
    let whole = |law: Arc<dyn Law>| match excluded {
        Some(names) => submodel_law(law, &plant.reduced, reduced, &quoted(names)),
        None => law,
    };
    Some([law, implemented].map(whole))
}

/// The law of a controller as designed on a plant, and as it runs.
///
/// # Errors
/// Why there is none.
fn law_as_it_runs(
    document: &Document,
    reduced: &Reduced,
    control: &ControlSpec,
    plant: &Plant,
) -> Result<[Arc<dyn Law>; 2], Diagnostic> {
    let refused = |error| design_diagnostic(document, control, &error);
    let law = design_law(control.law, &control.name, &control.values, plant).map_err(refused)?;
    if law.on_full_model() && NamedPoint::is_named(document, control) {
        let message = format!("control `{}`: a law on the full nonlinear model has no operating point", control.name);
        return Err(Diagnostic::error("control::operating-point", message)
            .at(&control.place, "this controller")
            .help("leave out `at`: it evaluates the model at its current position"));
    }
    if law.on_full_model() && !reduced.equations.multiplier_constraints.is_empty() {
        return Err(not_on_rows(control, reduced));
    }
    let implemented = implemented(Arc::clone(&law), &control.values).map_err(refused)?;
    if !implemented.linear().fits_single() {
        let message =
            format!("control `{}`: a gain is too large for single precision, in which firmware runs", control.name);
        return Err(Diagnostic::error("number::range", message)
            .at(&control.place, "this controller")
            .help("check the exponents of its frequencies and of the model's numbers"));
    }
    check_readings(document, (control, plant), &*implemented)?;
    Ok([law, implemented])
}

/// The plant of a controller at its operating point, unless it has no linearisation there.
fn plant_at(
    document: &Document,
    control: &ControlSpec,
    reduced: Reduced,
    named_point: &NamedPoint,
    out: &mut Vec<Diagnostic>,
) -> Option<Plant> {
    match named_point.find(&reduced) {
        Ok(found) => {
            if !check_smooth(document, control, (&reduced, &found.point), out) {
                return None;
            }
            let mut plant = match reduced.equations.multiplier_constraints.is_empty() {
                true => Plant::at(reduced, found.point),
                false => match on_frozen_rows(&reduced, &found.point, &found.multipliers) {
                    Ok(plant) => plant,
                    Err(error) => {
                        out.push(rows_refused(control, &reduced, &error));
                        return None;
                    }
                },
            };
            (plant.point_note, plant.no_equilibrium) = (found.point_note, found.no_equilibrium);
            Some(plant)
        }
        // The variant has reported it; with the design values it is another error.
        Err(why) => {
            add_new(out, vec![named_point.refusal(document, std::slice::from_ref(control), &why)], None);
            None
        }
    }
}

/// The model for the design of a law: its own parameter values, no friction.
pub(super) fn design_model(
    document: &Document,
    reduced: &Reduced,
    (settings, named_point): (&[Setting], &NamedPoint),
    control: &ControlSpec,
    out: &mut Vec<Diagnostic>,
) -> Option<Plant> {
    let moving: Vec<&str> = moves_by_itself(reduced).collect();
    if !moving.is_empty() {
        let message = format!(
            "the design of control `{}` treats the prescribed motion of {} as constant",
            control.name,
            quoted(moving)
        );
        let help = "its design uses the initial value, at rest, and the motion disturbs the loop";
        out.push(
            Diagnostic::warning("control::time-varying", message).at(&control.place, "this controller").help(help),
        );
    }
    let excluded = excluded(document, control, out)?;
    let laws = reduced.equations.laws.iter().filter(|law| law.value.is_of_time() && !excluded.contains(&law.element));
    let of_time: Vec<&str> = laws.map(|law| law.element.as_str()).collect();
    // A program uses no torques.
    if !of_time.is_empty() && control.law.keyword != Program::KEYWORD {
        let message =
            format!("the design of control `{}` uses the torque of {} at time zero", control.name, quoted(of_time));
        let help = "write a torque that is unknown to it as a `disturbance` with a function of time";
        out.push(
            Diagnostic::warning("control::time-varying", message).at(&control.place, "this controller").help(help),
        );
    }
    if control.design.is_empty() && excluded.is_empty() {
        return plant_at(document, control, reduced.clone(), named_point, out);
    }
    let retained = settings.iter().filter(|s| control.design.iter().all(|d| d.name != s.name));
    let all: Vec<Setting> = retained.chain(&control.design).cloned().collect();
    // The plant does not depend on which controllers are in the loop.
    let (model, diagnostics) = document.model_with(&all, Some(&[]));
    let place = place_in_control(document, control, "design");
    let mut wrong = false;
    for diagnostic in diagnostics.into_iter().filter(Diagnostic::is_error) {
        wrong = true;
        let Diagnostic { code, message, labels, .. } = diagnostic;
        let mut diagnostic =
            Diagnostic::error(code, format!("with the design values of control `{}`: {message}", control.name))
                .at(&place, "with these values")
                .help("choose design values that every element can take");
        diagnostic.labels.extend(labels);
        add_new(out, vec![diagnostic], None);
    }
    if wrong {
        return None;
    }
    if excluded.is_empty() {
        let names = reduced.coordinate_names();
        let design = reduced_design((control, place), (&model, &names), reduced);
        let design = design.map_err(|diagnostic| out.push(diagnostic)).ok()?;
        return plant_at(document, control, design, named_point, out);
    }
    let model = model_excluding(&model, &excluded);
    if let Some(diagnostic) = needed_by(document, control, &model) {
        out.push(diagnostic);
        return None;
    }
    let names: Vec<String> = reduced.coordinate_names().into_iter().filter(|name| !excluded.contains(name)).collect();
    let design = reduced_design((control, place), (&model, &names), reduced);
    let design = design.map_err(|diagnostic| out.push(diagnostic)).ok()?;
    let named_point = NamedPoint::anywhere(&design, control);
    plant_at(document, control, design, &named_point, out)
}

/// The model with the design values of a controller in explicit form, in the coordinates of the model itself.
///
/// # Errors
/// If it has no such form, or if other motions have no inertia.
fn reduced_design(
    (control, place): (&ControlSpec, Place),
    (model, names): (&Model, &[String]),
    reduced: &Reduced,
) -> Result<Reduced, Diagnostic> {
    let zero = vec![0.0; names.len()];
    let equations = assemble(&model.all_coordinates, &model.terms);
    let refused = |why: String, help: &str| {
        Diagnostic::error("control::design", format!("control `{}`: its design model {why}", control.name))
            .at(&place, "with these values")
            .help(help)
    };
    // If this fails, elements other than springs act on such a motion, or none.
    let rows = equilibrium_rows(&equations).unwrap_or_default();
    let design = reduce(equations.with_equilibria(rows), Some(names)).map_err(|error| {
        let help = "choose design values for which the model keeps its degrees of freedom";
        refused(format!("cannot be reduced: {error}"), help)
    })?;
    let able = is_finite_at(&design, &zero) && {
        let linear = sparse_model(&design, &zero);
        let indefinite = matches!(definiteness_of_rows(&linear.inertia), Definiteness::Indefinite { .. });
        let whole = names.len() == reduced.degrees_of_freedom();
        !indefinite && is_representable(&linear) && (!whole || is_designable(&design, reduced))
    };
    if !able {
        let help = "choose design values for which the same motions have an inertia";
        return Err(refused("and the model have different motions without inertia".into(), help));
    }
    Ok(design)
}
