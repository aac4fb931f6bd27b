//! The subject of an analysis: a variant, its operating point, its inputs and outputs.

use std::collections::BTreeSet;

use super::point_in_motion::{PointRequest, balancing, point_in_motion};
use crate::study::PreparedVariant;
use crate::study::check::equilibrium::Rest;
use crate::study::check::kinks::Kinks;
use crate::study::check::model_checks::signals_of;
use crate::study::check::multiplier_constraints::free_motion;
use crate::study::check::stop_checks::{describe_clutches, describe_contacts, describe_passed_stops};
use crate::study::read::locations::no_such_name;
use crate::study::read::state_names::{motors, non_angle_domains, state_name};
use crate::study::requests::analysis_spec::{OperatingConditions, output};
use kardan_analysis::{ConstrainedSystem, OutputSignal};
use kardan_math::num::{LastDigits, rational_to_f64};
use kardan_mechanics::assemble::TransmissionRow;
use kardan_mechanics::equations::Domain;
use kardan_mechanics::reduce::{LawSlopes, OperatingPoint, Reduced, Slope, law_slopes_at, laws_are_linear, slopes};
use kardan_results::OperatingSignal;
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_schema::diagnostics::{Diagnostic, quoted, shortened};
use kardan_simulate::signal_names;

/// Subject and options of the analysis, in addition to the model file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AnalyzeSettings {
    /// Variant to analyse; `None`: the first.
    pub variant: Option<String>,
    /// Operating point in place of `at` of `[analysis]`: signals with their values in the syntax of that key (`car.v`, `20 km/h`; `t`, `3.2 s`).
    pub at: Vec<(String, String)>,
    /// Inputs; empty: those of `[analysis]`, else all motors.
    pub inputs: Vec<String>,
    /// Outputs (signals such as `rk.phi`, or sensors); empty: those of `[analysis]`, else all sensors, else the outputs
    /// that the laws control, else the angles of all coordinates.
    pub outputs: Vec<String>,
    /// Prove every answer over the rationals, however long it takes.
    pub certify: bool,
    /// Analysis of detectable faults; `None`: not requested.
    pub parity: Option<ParitySettings>,
}

/// Options of residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct ParitySettings {
    /// Allowed false alarms of one residual per hour.
    pub false_alarms_per_hour: f64,
    /// Number of consecutive samples above the threshold that cause an alarm.
    pub debounce: usize,
    /// Time constant of the filter of residuals in time, s; `None`: ten samples.
    pub filter: Option<f64>,
}

impl Default for ParitySettings {
    fn default() -> Self {
        Self { false_alarms_per_hour: 1e-3, debounce: 3, filter: None }
    }
}

/// The operating point of the analysis of a variant, with its equations there.
pub(in crate::study) struct WorkingPoint {
    /// The reduced position, rad.
    pub position: Vec<f64>,
    /// In motion the speeds of the coordinates and the nonzero torques of inputs, in the syntax of the file: its model is not that of the variant
    /// with other values. Empty at rest.
    pub motion: Vec<OperatingSignal>,
    /// Bound on the distance to the true equilibrium, relative to its size or to one.
    pub off: f64,
    /// Elements whose friction sticks.
    pub stuck: BTreeSet<String>,
    /// The kinks of its laws of torque there; the equations are those of the analysed side of the variant.
    pub kinks: Kinks,
    pub inputs: Vec<String>,
    pub outputs: Vec<OutputSignal>,
    pub system: ConstrainedSystem,
}

impl WorkingPoint {
    /// The operating point of the settings and of `[analysis]`; notes list the defaults that were used.
    pub fn of(
        variant: &PreparedVariant,
        settings: &AnalyzeSettings,
        notes: &mut Vec<String>,
    ) -> Result<Self, Vec<Diagnostic>> {
        let (reduced, spec) = (&variant.reduced, &variant.analysis);
        free_motion(reduced)?;
        let (inputs, outputs) = signals(variant, settings, notes)?;
        let stuck: BTreeSet<String> = spec.stuck.iter().cloned().collect();
        let position = spec.position(&reduced.coordinate_names(), &variant.scenario.position);
        let request = PointRequest {
            at: &spec.at,
            conditions: &spec.conditions,
            inputs: &balancing(variant, &inputs),
            stuck: &stuck,
            start: &position,
        };
        if spec.conditions.moves() {
            return Self::in_motion(variant, &request, (inputs, outputs), notes);
        }
        let mut own = notes.clone();
        let (position, off, kinks) = match working_position(variant, position.clone(), &mut own) {
            Ok(found) => found,
            Err(diagnostics) if diagnostics.iter().all(|one| one.code == "analysis::equilibrium") => {
                return at_initial_speeds(variant, &request, (inputs, outputs), notes).ok_or(diagnostics);
            }
            Err(diagnostics) => return Err(diagnostics),
        };
        *notes = own;
        notes.extend(describe_passed_stops(reduced, &position));
        notes.extend(describe_contacts(reduced, &position, &stuck));
        notes.extend(describe_clutches(reduced, &stuck));
        let system = match variant.unfrozen {
            Some(_) => ConstrainedSystem::at_point(reduced, &variant.point, &stuck, &inputs),
            None => ConstrainedSystem::at_point(reduced, &variant.unloaded_at(&position), &stuck, &inputs),
        };
        notes.extend(ratios(reduced, &position));
        notes.extend(variant.model.rounding_messages());
        Ok(Self { position, motion: Vec::new(), off, stuck, kinks, inputs, outputs, system })
    }

    /// In steady motion, or at the state of a run at a time.
    fn in_motion(
        variant: &PreparedVariant,
        request: &PointRequest<'_>,
        (inputs, outputs): (Vec<String>, Vec<OutputSignal>),
        notes: &mut Vec<String>,
    ) -> Result<Self, Vec<Diagnostic>> {
        let (spec, reduced) = (&variant.analysis, &variant.reduced);
        let found = point_in_motion(variant, request)
            .map_err(|diagnostic| diagnostic.at_each(spec.places.get("at").cloned(), "at this point"))?;
        let [position, speeds] = found.motion.clone();
        notes.extend(found.notes.iter().cloned());
        let point = OperatingPoint { side: variant.point.side.clone(), ..found.point.clone() };
        let kinks = check_slopes(variant, law_slopes_at(&found.model, &point), notes)?;
        notes.extend(describe_passed_stops(reduced, &position));
        notes.extend(describe_contacts(&found.model, &found.point.position, request.stuck));
        notes.extend(ratios(reduced, &position));
        notes.extend(variant.model.rounding_messages());
        let equations = &reduced.equations;
        let speeds = reduced.coordinates.iter().zip(&speeds).map(|(shaft, speed)| {
            let [_, rate] = equations.domain(*shaft).motion();
            (rate, &equations.coordinates[*shaft], speed)
        });
        let torques = equations.inputs.iter().zip(found.point.torques.iter().flatten());
        let torques = torques.filter(|(_, torque)| **torque != 0.0);
        let torques = torques.map(|(input, torque)| (equations.domain_of(input).effort(), &input.element, torque));
        let signal = |(quantity, of, value): (Quantity, &String, &f64)| OperatingSignal {
            name: quantity.of(of),
            unit: quantity.unit().into(),
            value: *value,
        };
        Ok(Self {
            position,
            motion: speeds.chain(torques).map(signal).collect(),
            off: 0.0,
            stuck: found.closed,
            kinks,
            system: ConstrainedSystem::at_point(&found.model, &point, &BTreeSet::new(), &inputs),
            inputs,
            outputs,
        })
    }
}

/// If a model has no equilibrium and its run begins in motion: the steady motion at these speeds, if there is one.
fn at_initial_speeds(
    variant: &PreparedVariant,
    request: &PointRequest<'_>,
    signals: (Vec<String>, Vec<OutputSignal>),
    notes: &mut Vec<String>,
) -> Option<WorkingPoint> {
    let (reduced, scenario) = (&variant.reduced, &variant.scenario);
    let names = reduced.coordinate_names().into_iter().zip(&scenario.speed);
    let speeds: Vec<(String, f64)> =
        names.filter(|(_, speed)| **speed != 0.0).map(|(name, speed)| (name, *speed)).collect();
    if speeds.is_empty() || !request.at.is_empty() {
        return None;
    }
    let conditions = OperatingConditions { speeds, ..OperatingConditions::default() };
    let mut own = notes.clone();
    own.push(
        "there is no equilibrium at rest: the analysis uses steady motion at the speeds of `initial`; `at` of \
         `[analysis]` selects others"
            .into(),
    );
    let request = PointRequest { conditions: &conditions, ..*request };
    let found = WorkingPoint::in_motion(variant, &request, signals, &mut own).ok()?;
    *notes = own;
    Some(found)
}

/// The operating point of a model with laws of torque: the named one, else an equilibrium; notes which one, and which properties are proven.
fn working_position(
    variant: &PreparedVariant,
    position: Vec<f64>,
    notes: &mut Vec<String>,
) -> Result<(Vec<f64>, f64, Kinks), Vec<Diagnostic>> {
    let reduced = &variant.reduced;
    notes.extend(variant.unfrozen.iter().flat_map(|_| variant.start_notes.iter().cloned()));
    if !reduced.equations.moving.is_empty() {
        let moving = quoted(reduced.equations.moving.keys());
        notes.push(format!("{moving}: an offset that depends on the time keeps its value at time zero"));
    }
    let laws = &reduced.equations.laws;
    if laws.is_empty() || (reduced.equations.transmissions.is_empty() && laws_are_linear(reduced)) {
        return Ok((position, 0.0, Kinks::default()));
    }
    let of_time: Vec<&str> = laws.iter().filter(|law| law.value.is_of_time()).map(|law| law.element.as_str()).collect();
    if !of_time.is_empty() {
        notes.push(format!("{}: a torque that depends on the time has its value at time zero", quoted(of_time)));
    }
    let (position, off) = if variant.analysis.at.is_empty() && variant.unfrozen.is_none() {
        let rest = Rest::near(reduced, &position).map_err(|message| {
            let help = "name the operating point by `at` of `[analysis]`, or add an element that supports the model: a \
                        spring, or a friction, stop, clutch or lock in `stuck`";
            Diagnostic::error("analysis::equilibrium", message).help(help)
        })?;
        notes.push(format!("operating point: {}", rest.found));
        notes.extend(rest.more.into_iter().map(|more| more.replace("CHOICE", "`at` of `[analysis]`")));
        (rest.equilibrium.position, rest.off)
    } else {
        (position, 0.0)
    };
    let kinks = check_slopes(variant, law_slopes_at(reduced, &variant.unloaded_at(&position)), notes)?;
    Ok((position, off, kinks))
}

/// Laws of torque must have a slope at the operating point; notes which were rounded. If slopes differ on two sides: the kinks.
fn check_slopes(
    variant: &PreparedVariant,
    all: Vec<LawSlopes>,
    notes: &mut Vec<String>,
) -> Result<Kinks, Vec<Diagnostic>> {
    let kinks = Kinks { guards: all.iter().flat_map(|one| one.kinks.iter().cloned()).collect() };
    for slopes in all {
        let name = &slopes.element;
        if !slopes.undefined.is_empty() {
            let spec = &variant.analysis;
            let help = "name another operating point by `at` of `[analysis]`, or make the expression smooth there";
            return Err(Diagnostic::error("analysis::not-differentiable", no_slope(&slopes))
                .at_each(spec.laws.get(name).cloned(), "it has no derivative there")
                .at_each(spec.places.get("at").cloned(), "at this point")
                .help(help)
                .into());
        }
        if slopes.rounded {
            notes.push(format!("slopes of `{name}` here are rounded to 16 digits, all later steps are exact"));
        }
    }
    notes.extend(kinks.opposite().map(|_| kinks.explained("the model", "all results")));
    Ok(kinks)
}

/// That a law of torque has no slope at the operating point.
pub(super) fn no_slope(slopes: &LawSlopes) -> String {
    let (element, undefined) = (&slopes.element, slopes.undefined.join(" and "));
    format!("`{element}` has no slope at the operating point, so the model has no linearisation there: {undefined}")
}

/// The source of ratios that depend on the position, and their accuracy there.
fn ratios(reduced: &Reduced, position: &[f64]) -> Vec<String> {
    let ratio = |(t, slope): (&TransmissionRow, Slope)| {
        let (joint, ratio) = (&t.element, rational_to_f64(&slope.value));
        let how = match (slope.rounded, LastDigits::is_rounded(&slope.value)) {
            (true, _) => {
                "cosines of its angles and of the position are rounded to 16 digits, all later steps are exact"
            }
            (false, true) => "cosines of its angles are rounded to 16 digits, all later steps are exact",
            (false, false) => "exactly",
        };
        format!("ratio of {joint} here: {ratio:.6}; {how}")
    };
    reduced.equations.transmissions.iter().zip(slopes(reduced, position)).map(ratio).collect()
}

/// Inputs and outputs: from the command line, the file, or by default; notes which default was used.
pub(in crate::study) fn signals(
    variant: &PreparedVariant,
    settings: &AnalyzeSettings,
    notes: &mut Vec<String>,
) -> Result<(Vec<String>, Vec<OutputSignal>), Vec<Diagnostic>> {
    let equations = &variant.reduced.equations;
    let spec = &variant.analysis;
    let mut wrong = Vec::new();
    let all_inputs: Vec<String> = equations.inputs.iter().map(|input| input.element.clone()).collect();
    let inputs = if !settings.inputs.is_empty() {
        settings.inputs.clone()
    } else if let Some(named) = &spec.inputs {
        named.clone()
    } else {
        let motors: Vec<String> = motors(equations).map(|input| input.element.clone()).collect();
        notes.push(if motors.is_empty() {
            "the model has no motor: no state is controllable".into()
        } else {
            let circuit = non_angle_domains(&variant.reduced).values().any(|domain| *domain == Domain::Charge);
            let what = if !circuit { "motors" } else { "motors and sources" };
            format!("inputs: all {what} ({})", motors.join(", "))
        });
        motors
    };
    let inputs = named("input", &inputs, &all_inputs, &mut wrong);
    let names = if !settings.outputs.is_empty() {
        settings.outputs.clone()
    } else if let Some(named) = &spec.outputs {
        named.clone()
    } else if !equations.sensors.is_empty() {
        let names: Vec<String> = equations.sensors.iter().map(|(name, _)| name.clone()).collect();
        notes.push(format!("outputs: all sensors ({})", names.join(", ")));
        names
    } else {
        let controlled: BTreeSet<String> = variant
            .model
            .controls
            .iter()
            .flat_map(|control| signals_of(control.law.fields, &control.values))
            .filter(|signal| SignalName::new(signal).angle_of().is_some())
            .collect();
        let domains = non_angle_domains(&variant.reduced);
        let angle = |shaft: &String| state_name(&Quantity::Angle.of(shaft), &domains);
        let names: Vec<String> = match controlled.is_empty() {
            true => variant.reduced.coordinate_names().iter().map(angle).collect(),
            false => controlled.into_iter().collect(),
        };
        notes.push(format!("outputs: {}", names.join(", ")));
        names
    };
    let declared_signals = signal_names(&variant.reduced, &variant.scenario);
    let mut outputs: Vec<OutputSignal> = Vec::new();
    for name in names.iter().map(|name| name.trim()) {
        match output(name, equations, &declared_signals, &|_, _| false) {
            _ if name.is_empty() => wrong.push(empty_name("output")),
            Ok(found) if outputs.iter().any(|candidate| candidate.name == found.name) => {
                wrong.push(duplicate("output", &found.name))
            }
            Ok(found) => outputs.push(found),
            Err(why) => {
                let (message, help) = why.unwrap_or_default();
                wrong.push(Diagnostic::error("name::unknown", message).help(help));
            }
        }
    }
    if wrong.is_empty() { Ok((inputs, outputs)) } else { Err(wrong) }
}

/// The requested names that exist; the others are reported.
pub(in crate::study) fn named(
    what: &str,
    chosen: &[String],
    all: &[String],
    wrong: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for name in chosen.iter().map(|name| name.trim()) {
        if name.is_empty() {
            wrong.push(empty_name(what));
        } else if !all.iter().any(|candidate| candidate == name) {
            let names = all.iter().map(String::as_str);
            let none = format!("there are no {what}s at all");
            wrong.push(no_such_name(("name::unknown", what), name, names, &none));
        } else if found.iter().any(|candidate| candidate == name) {
            wrong.push(duplicate(what, name));
        } else {
            found.push(name.to_string());
        }
    }
    found
}

fn empty_name(what: &str) -> Diagnostic {
    Diagnostic::error("name::empty", format!("the name of an {what} is empty"))
        .help(format!("separate the names by single commas, or leave `--{what}s` out to have them chosen"))
}

fn duplicate(what: &str, name: &str) -> Diagnostic {
    Diagnostic::error("name::duplicate", format!("the {what} `{}` is named twice", shortened(name)))
        .help("name it once")
}
