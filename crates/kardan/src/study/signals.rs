//! What is analysed: a variant, where it stands, its inputs and outputs.

use std::collections::BTreeSet;

use super::PreparedVariant;
use super::analysis::output;
use super::checks::signals_of;
use super::equilibrium::Rest;
use super::kept::nothing_free;
use super::others::{others, state_name};
use super::stops::{beyond_in_words, contacts_in_words};
use crate::analysis::{ConstrainedSystem, OutputSignal};
use crate::assemble::TransmissionRow;
use crate::diagnostics::{Diagnostic, nearest, quoted, shortened};
use crate::equations::{Domain, InputKind};
use crate::names::{Quantity, SignalName};
use crate::num::{LastDigits, rational_to_f64};
use crate::reduce::{Reduced, Slope, law_slopes, laws_are_linear, slopes};
use crate::simulate::signal_names;

/// What to analyse and how, beyond what the model file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AnalyzeSettings {
    /// Variant to analyse; `None`: the first.
    pub variant: Option<String>,
    /// Inputs; empty: those of `[analysis]`, else all motors.
    pub inputs: Vec<String>,
    /// Outputs (signals such as `rk.phi`, or sensors); empty: those of `[analysis]`, else all sensors, else the outputs
    /// that the laws control, else the angles of all coordinates.
    pub outputs: Vec<String>,
    /// Prove every answer over the rationals, however long it takes.
    pub certify: bool,
    /// Which faults sensors can tell; `None`: not asked.
    pub parity: Option<ParitySettings>,
}

/// What is asked of residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct ParitySettings {
    /// False alarms that one residual may give, per hour.
    pub false_alarms_per_hour: f64,
    /// Samples one after the other beyond the threshold that make an alarm.
    pub debounce: usize,
    /// Time constant of the filter that residuals in time go through, s; `None`: ten samples.
    pub filter: Option<f64>,
}

impl Default for ParitySettings {
    fn default() -> Self {
        Self { false_alarms_per_hour: 1e-3, debounce: 3, filter: None }
    }
}

/// Where a variant is analysed, with its equations there.
pub(super) struct WorkingPoint {
    /// The reduced position, rad.
    pub position: Vec<f64>,
    /// How far it may be from the equilibrium that it stands for, relative to its size or to one.
    pub off: f64,
    /// Elements whose friction holds.
    pub stuck: BTreeSet<String>,
    pub inputs: Vec<String>,
    pub outputs: Vec<OutputSignal>,
    pub system: ConstrainedSystem,
}

impl WorkingPoint {
    /// That of the settings and of `[analysis]`; which defaults were taken goes into the notes.
    pub fn of(
        variant: &PreparedVariant,
        settings: &AnalyzeSettings,
        notes: &mut Vec<String>,
    ) -> Result<Self, Vec<Diagnostic>> {
        let (reduced, spec) = (&variant.reduced, &variant.analysis);
        if let Some(mistake) = nothing_free(reduced) {
            return Err(vec![mistake]);
        }
        let (inputs, outputs) = signals(variant, settings, notes)?;
        let position = spec.position(&reduced.coordinate_names(), &variant.scenario.position);
        let (position, off) = working_position(variant, position, notes)?;
        notes.extend(beyond_in_words(reduced, &position));
        let stuck: BTreeSet<String> = spec.stuck.iter().cloned().collect();
        notes.extend(contacts_in_words(reduced, &position, &stuck));
        let system = match variant.unfrozen {
            Some(_) => ConstrainedSystem::held(reduced, &variant.point, &stuck, &inputs),
            None => ConstrainedSystem::at(reduced, &position, &stuck, &inputs),
        };
        notes.extend(ratios(reduced, &position));
        notes.extend(variant.model.rounded_in_words());
        Ok(Self { position, off, stuck, inputs, outputs, system })
    }
}

/// Where a model with laws of torque is looked at: where it was named, else at an equilibrium; says which, and what of it is proven.
fn working_position(
    variant: &PreparedVariant,
    position: Vec<f64>,
    notes: &mut Vec<String>,
) -> Result<(Vec<f64>, f64), Vec<Diagnostic>> {
    let reduced = &variant.reduced;
    notes.extend(variant.unfrozen.iter().flat_map(|_| variant.start_notes.iter().cloned()));
    if !reduced.equations.moving.is_empty() {
        let moving = quoted(reduced.equations.moving.keys().map(String::as_str));
        notes.push(format!("{moving}: an offset that depends on the time stands still at its value at time zero"));
    }
    let laws = &reduced.equations.laws;
    if laws.is_empty() || (reduced.equations.transmissions.is_empty() && laws_are_linear(reduced)) {
        return Ok((position, 0.0));
    }
    let of_time: Vec<&str> = laws.iter().filter(|law| law.value.is_of_time()).map(|law| law.element.as_str()).collect();
    if !of_time.is_empty() {
        notes.push(format!("{}: a torque that depends on the time is taken as at time zero", quoted(of_time)));
    }
    let (position, off) = if variant.analysis.at.is_empty() && variant.unfrozen.is_none() {
        let rest = Rest::near(reduced, &position).map_err(|message| {
            let help = "name the operating point by `at` of `[analysis]`, or give the model what holds it: a spring, or a friction, stop, clutch or lock in `stuck`";
            vec![Diagnostic::error("analysis::equilibrium", message).help(help)]
        })?;
        notes.push(format!("operating point: {}", rest.found));
        notes.extend(rest.more.into_iter().map(|more| more.replace("CHOICE", "`at` of `[analysis]`")));
        (rest.position, rest.off)
    } else {
        (position, 0.0)
    };
    for slopes in law_slopes(reduced, &position) {
        let name = &slopes.element;
        if !slopes.kinks.is_empty() {
            let message = format!(
                "`{name}` bends or jumps at the operating point, where {}, so the model has no linear one there",
                slopes.kinks.join(" and ")
            );
            let mistake = Diagnostic::error("analysis::kink", message)
                .help("name another operating point by `at` of `[analysis]`, or make the expression smooth there");
            let spec = &variant.analysis;
            let law = spec.laws.get(name).into_iter().map(|law| (law, "it has no derivative there"));
            let places = law.chain(spec.places.get("at").into_iter().map(|at| (at, "at this point")));
            return Err(vec![places.fold(mistake, |mistake, (place, label)| mistake.at(place.clone(), label))]);
        }
        if slopes.rounded {
            notes.push(format!("slopes of `{name}` here are rounded to 16 digits, from there on all is exact"));
        }
    }
    Ok((position, off))
}

/// Where ratios that depend on the position come from, and how exact they are there.
fn ratios(reduced: &Reduced, position: &[f64]) -> Vec<String> {
    let told = |(t, slope): (&TransmissionRow, Slope)| {
        let (joint, ratio) = (&t.element, rational_to_f64(&slope.value));
        let how = match (slope.rounded, LastDigits::is_rounded(&slope.value)) {
            (true, _) => {
                "cosines of its angles and of the position are rounded to 16 digits, from there on all is exact"
            }
            (false, true) => "cosines of its angles are rounded to 16 digits, from there on all is exact",
            (false, false) => "exactly",
        };
        format!("ratio of {joint} here: {ratio:.6}; {how}")
    };
    reduced.equations.transmissions.iter().zip(slopes(reduced, position)).map(told).collect()
}

/// Inputs and outputs: asked for on the command line, in the file, or by default; says which default was taken.
pub(super) fn signals(
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
        let motors = equations.inputs.iter().filter(|input| matches!(input.value, InputKind::Motor(_)));
        let motors: Vec<String> = motors.map(|input| input.element.clone()).collect();
        notes.push(if motors.is_empty() {
            "the model has no motor: nothing is controllable".into()
        } else {
            let circuit = others(&variant.reduced).values().any(|domain| *domain == Domain::Charge);
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
        let names: Vec<String> = if controlled.is_empty() {
            variant
                .reduced
                .coordinate_names()
                .iter()
                .map(|shaft| state_name(&Quantity::Angle.of(shaft), &others(&variant.reduced)))
                .collect()
        } else {
            controlled.into_iter().collect()
        };
        notes.push(format!("outputs: {}", names.join(", ")));
        names
    };
    let known = signal_names(&variant.reduced, &variant.scenario);
    let mut outputs: Vec<OutputSignal> = Vec::new();
    for name in names.iter().map(|name| name.trim()) {
        match output(name, equations, &known, &|_, _| false) {
            _ if name.is_empty() => wrong.push(empty_name("output")),
            Ok(found) if outputs.iter().any(|other| other.name == found.name) => {
                wrong.push(twice("output", &found.name))
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

/// The names asked for that are there; the others are told.
pub(super) fn named(what: &str, asked: &[String], all: &[String], wrong: &mut Vec<Diagnostic>) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for name in asked.iter().map(|name| name.trim()) {
        let names = || all.iter().map(String::as_str);
        if name.is_empty() {
            wrong.push(empty_name(what));
        } else if !all.iter().any(|other| other == name) {
            let help = match nearest(name, names()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if all.is_empty() => format!("there are no {what}s at all"),
                None => format!("there are {}", quoted(names())),
            };
            let message = format!("there is no {what} `{}`", shortened(name));
            wrong.push(Diagnostic::error("name::unknown", message).help(help));
        } else if found.iter().any(|other| other == name) {
            wrong.push(twice(what, name));
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

fn twice(what: &str, name: &str) -> Diagnostic {
    Diagnostic::error("name::duplicate", format!("the {what} `{}` is named twice", shortened(name)))
        .help("name it once")
}
