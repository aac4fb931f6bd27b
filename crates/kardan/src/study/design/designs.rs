//! The design of one controller, as a model file or a caller requests it.

use std::collections::BTreeSet;

use crate::study::check::multiplier_constraints::{free_motion, rounded_rows};
use crate::study::check::stop_checks::{describe_clutches, describe_contacts};
use crate::study::design::actuator_usage::scenario_motor_loads;
use crate::study::design::cross_coupling::cross_coupling;
use crate::study::design::explore::explore;
use crate::study::design::proof::{check_all_laws, check_rounding, exact_poles, judge, prove};
use crate::study::design::robustness::{ToleranceBox, robustness, warnings as robustness_warnings};
use crate::study::loops::blocks::block_remarks;
use crate::study::loops::loop_along_path::{loop_along_path, warnings as path_warnings};
use crate::study::loops::margins::{
    LoopKinks, contact_warnings, contacts_verdict, decay, margins_in_contact, responses, survey, verdict,
    warnings as margin_warnings,
};
use crate::study::loops::margins_over_positions::margins_over_positions;
use crate::study::operating_point::working_point::{AnalyzeSettings, signals};
use crate::study::read::locations::no_such_name;
use crate::study::read::state_names::motors;
use crate::study::{Part, Prepared, PreparedVariant, Progress, Project, overrule};
use kardan_analysis::OutputSignal;
use kardan_math::names::unused;
use kardan_math::num::{Matrix, discretise};
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::equations::Domain;
use kardan_model::ControlSpec;
use kardan_results::signal_name::{SignalName, carrier};
use kardan_results::{ControllerData, DataMatrix, Design, LoopResponses, NO_RESPONSES, OppositeSide, Stability};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_schema::entries::{Entries, RawValue};
use kardan_schema::schema::{Field, Kind};
use kardan_synthesis::{REGISTRY, closed_loop_poles, counting_charges, poles_excluding};

/// Which controller is designed and how.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DesignSettings {
    /// Controller of the model file; `None`: that with the most inputs, the first of those.
    pub control: Option<String>,
    /// Law of a controller that is not in the file; `inputs` and `outputs` belong to it.
    pub law: Option<String>,
    /// Inputs of that controller; empty: those of `[analysis]`, else all motors.
    pub inputs: Vec<String>,
    /// Outputs of that controller; empty: those of `[analysis]`, else all sensors, else the angles of all coordinates.
    pub outputs: Vec<String>,
    /// Operating point of that controller: coordinates with their values in the syntax of the key `at` (`arm.phi`, `60 deg`).
    pub at: Vec<(String, String)>,
    /// `static`, `dynamic` or `block`; `None`: as the controller says.
    pub feedback: Option<String>,
    /// Variant to design for; `None`: the first.
    pub variant: Option<String>,
    /// Whether cross coupling is measured in the nonlinear simulation.
    pub simulate: bool,
    /// Whether a controller that is unstable at its sample time is shown nevertheless.
    pub force: bool,
    /// Whether alternative designs are tried.
    pub explore: bool,
    /// The box of plants for the robustness test, if there is one.
    pub tolerance: Option<ToleranceBox>,
}

/// The name of a controller that is not in the file, if it is free.
const OWN: &str = "design";

/// Designs one controller, proves properties of the linear loop, and measures those of the nonlinear one.
///
/// A file without a controller, or settings with a law, inputs or outputs, get a controller of their own, which
/// replaces those of the file.
///
/// ```
/// use kardan::model;
/// use kardan::study;
/// let source = model::builtin("sia-steering").unwrap().source;
/// let design = study::design(source, &Default::default(), &study::Silent).unwrap();
/// assert_eq!(design.relative_degrees, [Some(2), Some(2)]);
/// assert_eq!(design.decoupled, Some(true));
/// ```
///
/// # Errors
/// All errors of the file and of the settings; why the outputs cannot be decoupled.
pub fn design(source: &str, settings: &DesignSettings, progress: &dyn Progress) -> Result<Design, Vec<Diagnostic>> {
    Project::open(source).design(settings, progress)
}

impl Project {
    /// Designs one controller; see [`design`](crate::study::design()).
    ///
    /// # Errors
    /// All errors of the file and of the settings; why the outputs cannot be decoupled.
    pub fn design(&self, settings: &DesignSettings, progress: &dyn Progress) -> Result<Design, Vec<Diagnostic>> {
        let prepared = checked_project(self, settings)?;
        let variant = variant_of(prepared, settings)?;
        let (model, control_name) = (&variant.model, settings.control.as_deref());
        let has_settings =
            [settings.inputs.is_empty(), settings.outputs.is_empty(), settings.at.is_empty()].contains(&false);
        let own = settings.law.is_some() || has_settings;
        if own || (model.controls.is_empty() && control_name.is_none()) {
            return design_own(self, variant, settings, progress);
        }
        let number = which(&model.controls, control_name)?;
        let Some(feedback) = &settings.feedback else {
            return Ok(tried(prepared, variant, number, settings, progress));
        };
        let name = &model.controls[number].name;
        let changed = with_feedback(self, name, feedback)?;
        let settings = DesignSettings { variant: Some(variant.name.clone()), ..settings.clone() };
        design_named(&changed, name, &settings, progress)
    }
}

/// The prepared model; its errors, if there are any that `force` does not overrule.
fn checked_project<'a>(project: &'a Project, settings: &DesignSettings) -> Result<&'a Prepared, Vec<Diagnostic>> {
    let mut diagnostics = project.diagnostics().to_vec();
    if settings.force {
        overrule(&mut diagnostics);
    }
    if diagnostics.iter().any(Diagnostic::is_error) { Err(diagnostics) } else { Ok(project.prepared()) }
}

/// The variant to design for: a controller that only some variants use is designed for the first of those.
fn variant_of<'a>(prepared: &'a Prepared, settings: &DesignSettings) -> Result<&'a PreparedVariant, Vec<Diagnostic>> {
    let named = |variant: &&PreparedVariant| {
        variant.model.controls.iter().any(|control| Some(&control.name) == settings.control.as_ref())
    };
    let first = prepared.all().find(named).filter(|_| settings.variant.is_none());
    match first {
        Some(variant) => Ok(variant),
        None => prepared.variant(settings.variant.as_deref()),
    }
}

/// Designs a controller that is not in the file, in place of those of the file.
fn design_own(
    project: &Project,
    variant: &PreparedVariant,
    settings: &DesignSettings,
    progress: &dyn Progress,
) -> Result<Design, Vec<Diagnostic>> {
    free_motion(&variant.reduced)?;
    let equations = &variant.reduced.equations;
    // The outputs of laws are of shafts, masses and sensors.
    let moves = (0..equations.coordinates.len()).any(|k| equations.domain(k) != Domain::Charge);
    if !moves || motors(equations).next().is_none() {
        let message = "the model has no motor that a controller could command";
        let help = "add one: `[motor.NAME]` with `shaft = \"...\"`, or a `[voltage_source.NAME]` behind a `dc_motor`";
        return Err(Diagnostic::error("control::no-motor", message).help(help).into());
    }
    let mut notes = Vec::new();
    let names = AnalyzeSettings {
        inputs: settings.inputs.clone(),
        outputs: settings.outputs.clone(),
        ..AnalyzeSettings::default()
    };
    let (inputs, outputs) = signals(variant, &names, &mut notes)?;
    let keyword = settings.law.as_deref().unwrap_or("decoupling");
    let model = &variant.model;
    let reserved: Vec<&str> = model
        .elements
        .iter()
        .map(|one| one.name.as_str())
        .chain(model.controls.iter().chain(&model.idle).map(|control| control.name.as_str()))
        .collect();
    let own = unused(OWN, 1, |name| reserved.contains(&name));
    let mut keys = keys(keyword, &inputs, (&variant.reduced.equations, &outputs), &reserved)?;
    for (signal, value) in &settings.at {
        keys.table_mut("at").set(signal, RawValue::Text(value.clone()));
    }
    let reserved = overridden_signals(variant, &inputs);
    if !reserved.is_empty() {
        let names = quoted(&reserved);
        let own = "`signals` of `[scenario]`";
        notes.push(format!(
            "left out of {own}: {names}; the controller that is designed takes {}",
            if reserved.len() == 1 { "its place" } else { "their place" }
        ));
    }
    let mut changed =
        project.changed(|model| model.control_of(&own, keyword, keys).only_control(&own).remove_signals(&reserved));
    if let Some(feedback) = &settings.feedback {
        changed = with_feedback(&changed, &own, feedback)?;
    }
    let mut design = design_named(&changed, &own, settings, progress)?;
    design.notes.extend(notes);
    Ok(design)
}

/// Signals that `signals` of `[scenario]` may set and a controller in place of those of the file uses: its inputs, and the references of the others.
fn overridden_signals(variant: &PreparedVariant, inputs: &[String]) -> Vec<String> {
    let model = &variant.model;
    let references =
        |control: &ControlSpec| control.law.all_references(&control.values).into_iter().map(|one| one.name);
    let law_references: Vec<String> = model.controls.iter().flat_map(references).collect();
    let set = variant.scenario.signals.iter().map(|signal| variant.scenario.sources[signal.source].name.clone());
    let is_overridden =
        |name: &String| law_references.contains(name) || inputs.iter().any(|input| carrier(name) == input);
    let mut reserved: Vec<String> = set.filter(is_overridden).collect();
    reserved.dedup();
    reserved
}

/// Designs the controller of that name.
fn design_named(
    project: &Project,
    name: &str,
    settings: &DesignSettings,
    progress: &dyn Progress,
) -> Result<Design, Vec<Diagnostic>> {
    let prepared = checked_project(project, settings)?;
    let variant = prepared.variant(settings.variant.as_deref())?;
    let number = which(&variant.model.controls, Some(name))?;
    Ok(tried(prepared, variant, number, settings, progress))
}

/// The design of a controller, and the motor loads in the scenario.
fn tried(
    prepared: &Prepared,
    variant: &PreparedVariant,
    number: usize,
    settings: &DesignSettings,
    progress: &dyn Progress,
) -> Design {
    let mut design = designed(&prepared.description, variant, number, settings, progress);
    let rest = ["frequency and step responses", "the scenario"];
    store_partial(progress, &design, if settings.simulate { &rest } else { &rest[..1] });
    if progress.stop().is_none() {
        let variant = variant.in_loop();
        match responses(variant, number, &design) {
            Ok(found) => {
                design.responses =
                    Some(LoopResponses { margins_over_position: margins_over_positions(variant, number), ..found })
            }
            Err(why) => design.notes.push(format!("{NO_RESPONSES}{why}")),
        }
    }
    if settings.simulate {
        store_partial(progress, &design, &["the scenario"]);
        scenario_motor_loads(prepared, &mut design, progress);
    }
    if progress.stop().is_some() {
        design.incomplete_reason = Some("what was not computed or simulated by then is missing".into());
    }
    progress.release();
    design
}

/// Stores the partial results of a design, with the list of missing ones.
fn store_partial(progress: &dyn Progress, design: &Design, missing: &[&str]) {
    progress.store_partial(&|| {
        let incomplete_reason = Some(format!("not analysed: {}", missing.join(", ")));
        Part::Design(Box::new(Design { incomplete_reason, ..design.clone() }))
    });
}

/// The keys of a controller for these inputs and outputs; its references get unused names.
fn keys(
    keyword: &str,
    inputs: &[String],
    (equations, outputs): (&Equations, &[OutputSignal]),
    reserved: &[&str],
) -> Result<Entries, Vec<Diagnostic>> {
    let Some(law) = REGISTRY.iter().find(|law| law.keyword == keyword) else {
        let names = REGISTRY.iter().map(|law| law.keyword);
        return Err(no_such_name(("name::unknown", "law"), keyword, names, "").into());
    };
    let full = |output: &OutputSignal| match SignalName::new(&output.name).word {
        Some(_) => output.name.clone(),
        None => equations.reading(&output.measured).of(&output.name),
    };
    let outputs: Vec<String> = outputs.iter().map(full).collect();
    let Some(mut keys) = (law.template)(inputs, &outputs) else {
        if inputs.len() != outputs.len() {
            let message = format!(
                "the law `{keyword}` takes as many motors as outputs, and there are {} motors ({}) and {} outputs ({})",
                inputs.len(),
                quoted(inputs),
                outputs.len(),
                quoted(&outputs)
            );
            let help = "name as many with `--inputs` and `--outputs`";
            return Err(Diagnostic::error("control::channel-count", message).help(help).into());
        }
        let message = format!("a controller of the law `{keyword}` needs keys of its own");
        let help = format!("write it into the model file; `kardan elements {keyword}` shows the keys");
        return Err(Diagnostic::error("control::needs-keys", message).help(help).into());
    };
    if keys.get("channels").is_some() {
        for channel in keys.list_mut("channels") {
            let RawValue::Table(channel) = &mut channel.value else { continue };
            if let Some(RawValue::Text(reference)) = channel.get("reference") {
                let name = unused(reference, 1, |name| reserved.contains(&name));
                channel.set("reference", RawValue::Text(name));
            }
        }
    }
    Ok(keys)
}

/// The model with another decoupling feedback of a controller, if its law supports that.
fn with_feedback(project: &Project, name: &str, feedback: &str) -> Result<Project, Vec<Diagnostic>> {
    let law = project.document().controls.get(name).map(|control| control.kind);
    let field = law.and_then(|law| law.fields.iter().find(|field| field.name == "feedback"));
    match field {
        Some(Field { kind: Kind::Choice(choices), .. }) if !choices.contains(&feedback) => {
            Err(no_such_name(("choice::unknown", "feedback"), feedback, choices.iter().copied(), "").into())
        }
        Some(_) => Ok(project.changed(|model| model.set(&["control", name, "feedback"], feedback.to_string()))),
        None => {
            let law = law.map_or("", |law| law.keyword);
            let message = format!("the law `{law}` of control `{name}` has no choice of feedback");
            let help = "leave `--feedback` out, or choose `--law decoupling`";
            Err(Diagnostic::error("control::feedback", message).help(help).into())
        }
    }
}

/// The number of the controller of that name; without a name, of the one with the most inputs.
fn which(controls: &[ControlSpec], name: Option<&str>) -> Result<usize, Vec<Diagnostic>> {
    let Some(name) = name else {
        let inputs = |k: &usize| (controls[*k].law.inputs)(&controls[*k].values).len();
        return Ok((0..controls.len()).rev().max_by_key(inputs).unwrap_or(0));
    };
    controls.iter().position(|control| control.name == name).ok_or_else(|| {
        let names = controls.iter().map(|control| control.name.as_str());
        no_such_name(("name::unknown", "controller"), name, names, "the variant has no controller").into()
    })
}

/// The design of a controller of a variant.
pub(in crate::study) fn designed(
    description: &str,
    variant: &PreparedVariant,
    number: usize,
    settings: &DesignSettings,
    progress: &dyn Progress,
) -> Design {
    let (whole, variant) = (variant, variant.in_loop());
    let mut design = described(description, variant, number);
    add_poles(variant, number, &mut design);
    judge(&mut design);
    let mut rest = vec!["margins", "cross coupling", "the loop with the parameters of the variant"];
    rest.extend(settings.explore.then_some("other designs"));
    rest.extend(settings.tolerance.map(|_| "the box of plants"));
    rest.extend(settings.simulate.then_some("the scenario"));
    store_partial(progress, &design, &rest);
    add_margins((variant, settings.simulate.then_some(whole)), number, &mut design, progress);
    store_partial(progress, &design, &rest[2..]);
    let (warnings, notes) = block_remarks(variant, number);
    design.warnings.extend(warnings);
    design.notes.extend(notes);
    match loop_along_path(variant, number, true) {
        Some(Ok(found)) => {
            design.warnings.extend(path_warnings(&found));
            design.loop_along_path = Some(found);
        }
        Some(Err(why)) => {
            design.notes.push(format!("the loop with the parameters of the variant is not analysed: {why}"));
        }
        None => {}
    }
    store_partial(progress, &design, &rest[3..]);
    if settings.explore {
        match explore(variant, number, progress) {
            Ok(found) => design.exploration = Some(found),
            Err(why) => design.notes.push(format!("no other designs are tried: {why}")),
        }
    }
    if let Some(range) = settings.tolerance {
        store_partial(progress, &design, &rest[3 + usize::from(settings.explore)..]);
        match robustness(variant, number, range, progress) {
            Ok(found) => {
                design.warnings.extend(robustness_warnings(&found));
                design.robustness = Some(found);
            }
            Err(why) => design.notes.push(format!("the box of plants is not analysed: {why}")),
        }
    }
    design
}

/// The description of the law, the model that it is designed on, and its numbers for firmware.
fn described(description: &str, variant: &PreparedVariant, number: usize) -> Design {
    let control = &variant.model.controls[number];
    let (mut design, plant) = (variant.designed[number].describe(), &variant.design_models[number]);
    design.model.clone_from(&variant.model.name);
    design.mechanism.clone_from(&variant.model.mechanism);
    design.description = description.into();
    design.variant.clone_from(&variant.name);
    let other_controllers = variant.model.controls.iter().enumerate().filter(|(k, _)| *k != number);
    design.other_controllers = other_controllers.map(|(_, other)| other.name.clone()).collect();
    if design.design_model.is_empty() {
        design.design_model = plant.linear_where().into();
    }
    design.notes.extend(plant.point_note.iter().map(|point_note| format!("operating point: {point_note}")));
    let none = BTreeSet::new();
    design.notes.extend(describe_contacts(&plant.reduced, &plant.point.position, &none));
    design.notes.extend(describe_clutches(&plant.reduced, &none));
    design.rounded.clone_from(&plant.reduced.equations.rounded);
    design.notes.extend(rounded_rows(&plant.reduced));
    let why = plant
        .no_equilibrium
        .iter()
        .map(|why| format!("operating point: {}, which is no equilibrium of the model: {why}", plant.default_point()));
    design.notes.extend(why);
    if let Some(name) = control.values.word("blending_signal") {
        design.notes.push(format!(
            "its commands are multiplied by `{name}` in runs; this report and the written controller do not include \
             that factor"
        ));
    }
    if let Some(names) = control.values.names("excluded_elements").filter(|names| !names.is_empty()) {
        design.design_model += &format!(", without {}", quoted(names));
    }
    let values: Vec<String> = control.design.iter().map(|set| format!("{} = {}", set.name, set.text)).collect();
    if !values.is_empty() {
        design.design_model += &format!(", {}", values.join(", "));
    }
    if let Some(time) = control.values.number("sample_time") {
        for data in std::iter::once(&mut design.controller_data).chain(&mut design.observer_data) {
            data.single = control.values.word("precision") == Some("single");
            if data.sample_time.is_none() && !sample(data, time) {
                design.notes.push(format!(
                    "the controller cannot be written for a sample time of {time} s: its numbers overflow"
                ));
            }
        }
    }
    design
}

/// Properties that are proven of the linear loop, and its poles.
fn add_poles(variant: &PreparedVariant, number: usize, design: &mut Design) {
    let (laws, plant, whole) = (&variant.designed, &variant.design_models[number], &*variant.whole_model(number));
    let counters = counting_charges(whole, laws);
    design.integrals_without_effect = counters.names(whole);
    if let Some(exact) = laws[number].exact() {
        prove(&exact, plant, design);
        // The proofs are for the loop without the elements that the design leaves out.
        if !variant.leaves_out(number) {
            check_all_laws(&exact, plant, laws, number, design);
        }
        if laws.len() == 1 && !variant.leaves_out(number) {
            // Alone in the loop, whose poles are exact; those of an observer's error are listed too.
            design.closed_loop_poles = exact_poles(&exact, design);
            // The poles of a Kalman filter come from its Riccati equation.
            design.exact_poles = design.observer.as_ref().is_none_or(|observer| observer.method != "kalman");
            check_rounding(&closed_loop_poles(&plant.linear, laws).unwrap_or_default(), design);
        }
    }
    // For a law that is designed for its sample time the sampled loop gives the poles.
    if design.closed_loop_poles.is_empty() && laws.iter().all(|law| law.clock().is_none()) {
        match poles_excluding(&whole.linear, laws, &counters) {
            Some(poles) => design.closed_loop_poles = poles,
            None => design.notes.push("the eigenvalue iteration failed: no poles of the closed loop are listed".into()),
        }
    }
}

/// How far the loop is from instability; with simulation, also the effect of each reference on the other outputs and the motor loads.
fn add_margins(
    (variant, simulated): (&PreparedVariant, Option<&PreparedVariant>),
    number: usize,
    design: &mut Design,
    progress: &dyn Progress,
) {
    let laws = &variant.designed;
    let mut margins = survey(variant, number, design);
    if let Some(whole) = simulated {
        let coupling = cross_coupling(whole, laws[number].references(), design, decay(variant, &margins), progress);
        design.cross_coupling = coupling.outputs;
        margins.peaks = coupling.peaks;
        design.warnings.extend(coupling.warnings);
    }
    margins.verdict = verdict(&margins);
    let (contacts, contact_notes) = margins_in_contact(variant, number);
    margins.contacts = contacts;
    design.notes.extend(contact_notes);
    if let Some(contact_text) = contacts_verdict(&margins) {
        margins.verdict += " ";
        margins.verdict += &contact_text;
    }
    let when = if margins.sample_time.is_some() { "at its sample time" } else { "in continuous time" };
    match (margins.stable, margins.stability.word) {
        (_, Stability::Unstable) => design.warnings.push(format!("{when} the loop is unstable: this is not a design")),
        (Some(false), _) => {
            design.warnings.push(format!("{when} the loop is marginal: this is not a design; {}", margins.stability));
        }
        (None, _) if !margins.stability.why.is_empty() => {
            design.warnings.push(format!("{when} the stability of the loop is {}", margins.stability));
        }
        _ => {}
    }
    if let Some(poles) = margins.poles.take().filter(|_| !design.exact_poles) {
        design.closed_loop_poles = design.without_integrals(poles);
        design.exact_poles = true;
    }
    design.warnings.extend(margin_warnings(&margins));
    design.warnings.extend(contact_warnings(&margins));
    let kinks = LoopKinks::of(variant);
    if let Some(jumps) = kinks.jump_note() {
        margins.verdict = format!("{jumps}. {}", margins.verdict);
        design.warnings.push(jumps);
    }
    design.margins = Some(margins);
    add_opposite_side(variant, number, &kinks, design);
}

/// The margins on the opposite side of the kinks of the loop.
fn add_opposite_side(variant: &PreparedVariant, number: usize, kinks: &LoopKinks, design: &mut Design) {
    let (Some(side), Some(description)) = (kinks.kinks.opposite(), kinks.kink_note()) else { return };
    let opposite = variant.on_side(&side);
    let mut margins = survey(&opposite, number, design);
    margins.verdict = verdict(&margins);
    let [own, side] = kinks.kinks.describe_sides();
    if margins.stable == Some(false) {
        design.warnings.push(format!("on the side where {side} the loop is unstable: this is not a design"));
    }
    design.warnings.extend(margin_warnings(&margins).into_iter().map(|warning| format!("where {side}: {warning}")));
    design.notes.push(description);
    design.opposite_side = Some(OppositeSide { reference_side: own, side, margins });
}

/// A block with states for firmware that runs it at a sample time, with zero-order hold of its signals: `ξ⁺ = e^{AT} ξ + ∫ e^{At} B dt s`.
///
/// False, and the block unchanged, if its numbers overflow.
fn sample(data: &mut ControllerData, time: f64) -> bool {
    let place = |name: &str| data.matrices.iter().position(|matrix| matrix.name == name);
    let (error, a, b) = (place("error"), place("A"), place("B"));
    let matrix = |k: usize| {
        let rows = &data.matrices[k].values;
        Matrix::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |i, j| rows[i][j])
    };
    if let Some(error) = error {
        // Γ of the block `ModelObserver`.
        let error = matrix(error);
        let Some(sampled) = discretise(&error, &Matrix::identity(error.rows()), time) else { return false };
        data.matrices.push(DataMatrix::new("zero_order_hold", sampled.b.to_rows()));
    } else if let (Some(a), Some(b)) = (a, b)
        && !data.matrices[a].values.is_empty()
    {
        let Some(sampled) = discretise(&matrix(a), &matrix(b), time) else { return false };
        data.matrices[a].values = sampled.a.to_rows();
        data.matrices[b].values = sampled.b.to_rows();
    }
    data.sample_time = Some(time);
    true
}
