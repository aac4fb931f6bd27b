//! The options of `[analysis]`, checked against the model.

use std::collections::{BTreeMap, BTreeSet};

use crate::study::read::locations::place_of_value;
use crate::study::read::positions::is_finite_at;
use crate::study::read::read_values::{Entry, key_error, of_dimension, read_word};
use crate::study::read::signal_table::SignalContext;
use kardan_analysis::{ConstrainedSystem, OutputSignal};
use kardan_math::names::unknown_name;
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::equations::{Domain, Measured, Sensor, UnilateralConstraint};
use kardan_mechanics::reduce::Reduced;
use kardan_model::{Document, Instance, Setting, TableReader, tables};
use kardan_results::Physical;
use kardan_results::signal_name::{Quantity, SignalName, carrier};
use kardan_schema::diagnostics::{Diagnostic, quoted, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Field, Keys, Kind, Sign, Table};

/// Largest number of samples that a study accepts.
const MOST_SAMPLES: f64 = 1e6;

/// The options of `[analysis]` for one set of parameter values. Keys that the file leaves out are open here.
#[derive(Debug, Clone, PartialEq)]
pub struct AnalysisSpec {
    /// Motors and disturbances; `None`: all motors.
    pub inputs: Option<Vec<String>>,
    /// Angles and speeds of shafts (`rk.phi`, `rk.w`) and names of sensors; `None`: all sensors, else the outputs that
    /// the laws control, else the angles of all coordinates.
    pub outputs: Option<Vec<String>>,
    /// Angles of coordinates at the operating point: shaft, rad. The others are at their initial position.
    pub at: Vec<(String, f64)>,
    /// Other given values of the operating point.
    pub conditions: OperatingConditions,
    /// Elements whose Coulomb friction sticks.
    pub stuck: Vec<String>,
    /// Integration time of the Gramians, s.
    pub horizon: Exact,
    /// Target angles and speeds of coordinates, from rest: signal (`rk.phi`, `rk.w`), SI.
    pub motion: Vec<(String, f64)>,
    /// Gramian eigenvalue below which a sample counts as lost.
    pub threshold: Option<f64>,
    /// Samples within the tolerances.
    pub samples: Option<usize>,
    /// Candidate locations of motors.
    pub actuators: Vec<Site>,
    /// Candidate locations of sensors.
    pub sensors: Vec<Site>,
    /// Spans in the file: of the value of each key that is present.
    pub places: BTreeMap<&'static str, Place>,
    /// Spans in the file: of the expression of each law of torque.
    pub laws: BTreeMap<String, Place>,
}

impl AnalysisSpec {
    /// The reduced position of the operating point, rad: `at`, and `initial` for coordinates that it does not name.
    pub fn position(&self, coordinates: &[String], initial: &[f64]) -> Vec<f64> {
        let angle = |name: &String| self.at.iter().find(|(shaft, _)| shaft == name).map(|(_, angle)| *angle);
        coordinates.iter().zip(initial).map(|(name, initial)| angle(name).unwrap_or(*initial)).collect()
    }
}

/// Values of an operating point other than positions, SI.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OperatingConditions {
    /// Speeds, by the shaft or mass.
    pub speeds: Vec<(String, f64)>,
    /// Torques of inputs.
    pub torques: Vec<(String, f64)>,
    /// The time at which functions of time are evaluated, s; given alone: the operating point is the state of the run at that time.
    pub time: Option<f64>,
}

impl OperatingConditions {
    /// Whether it is one in motion, or balanced by torques: not a position at rest without torques.
    pub fn moves(&self) -> bool {
        *self != Self::default()
    }
}

/// A candidate location of a motor or a sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// The shaft.
    pub shaft: String,
    /// The signal that a sensor would read: `rk.phi` or `rk.w`; empty for a motor.
    pub signal: String,
    /// Its cost.
    pub cost: f64,
    /// Its span in the file.
    pub place: Place,
}

/// A reduced model and its initial position.
pub(in crate::study) struct Point<'a> {
    pub(in crate::study) reduced: &'a Reduced,
    pub(in crate::study) initial: &'a [f64],
}

/// Reads `[analysis]`. Without a reduced model (`point`), keys that depend on the coordinates are skipped.
pub(in crate::study) fn analysis_spec(
    context: &SignalContext<'_>,
    equations: &Equations,
    point: Option<Point<'_>>,
    settings: &[Setting],
    out: &mut Vec<Diagnostic>,
) -> AnalysisSpec {
    let table = &context.document.analysis;
    let reader = TableReader::new(context.document, settings);
    let what = "`[analysis]`";
    // Maps carry dimensions of their own.
    let fields: Vec<Field> = tables::Analysis::FIELDS
        .iter()
        .filter(|field| !matches!(field.kind, Kind::Overrides | Kind::Point))
        .copied()
        .collect();
    let values = reader.values(&fields, table, what, out);
    let outputs = outputs(context, equations, table, out);
    let samples = values.number("samples").and_then(|samples| whole_samples(table, samples, out));
    let coordinates = point.as_ref().map(|point| point.reduced.coordinate_names());
    let targets = coordinates.as_deref();
    let own = (table, what);
    let (at, conditions) = operating_point(own, (context.document, equations), targets, &reader, out);
    let entries = table.map("motion").unwrap_or_default();
    let motion = targets_of((what, "motion"), entries, (context.document, targets), &reader, out);
    let moves = motion.iter().any(|(_, value)| *value != 0.0);
    if table.values.contains_key("motion") && entries.len() == motion.len() && !moves {
        let message = format!("`motion` of {what}: all its values are zero");
        let help = "give an angle or a speed other than zero, or leave it out";
        out.push(key_error("analysis::motion", message, (table, "motion", "no motion"), help));
    }
    let [actuators, sensors] = ["actuator", "sensor"].map(|key| places(table, key, context, &reader, out));
    let laws = equations.laws.iter().map(|law| &law.element);
    let laws = laws.map(|element| (element.clone(), place_of_value(context.document, element, "law")));
    let mut spec = AnalysisSpec {
        inputs: values.names("inputs").map(<[String]>::to_vec),
        outputs,
        at,
        conditions,
        stuck: values.names("stuck").map(<[String]>::to_vec).unwrap_or_default(),
        horizon: values.exact_or_default("horizon"),
        motion,
        threshold: values.number("threshold"),
        samples,
        actuators,
        sensors,
        places: table.values.iter().map(|(key, entry)| (*key, entry.place.clone())).collect(),
        laws: laws.collect(),
    };
    check_stuck(&mut spec, context, equations, out);
    if let Some(point) = point {
        check_point(&spec, table, &point, out);
    }
    spec
}

fn outputs(
    context: &SignalContext<'_>,
    equations: &Equations,
    table: &Table,
    out: &mut Vec<Diagnostic>,
) -> Option<Vec<String>> {
    let names = table.names("outputs").unwrap_or_default();
    table.values.get("outputs")?;
    if names.is_empty() && !table.unread.contains(&"outputs") {
        let message = "`outputs` of `[analysis]`: the list is empty";
        let help = "name one or more signals, such as `[\"rk.phi\"]`, or leave it out";
        out.push(key_error("list::length", message, (table, "outputs", "no output"), help));
    }
    let doubtful = |name: &str, head: &str| {
        context.may_have(name) || context.document.suppressed.has(head) || context.doubtful.contains(head)
    };
    let mut found: Vec<String> = Vec::new();
    for word in names {
        match output(&word.value, equations, &context.signals, &doubtful) {
            Ok(OutputSignal { name, .. }) if found.contains(&name) => out.push(
                Diagnostic::error("name::duplicate", format!("`outputs` of `[analysis]`: `{name}` is listed twice"))
                    .at(&word.place, "again here")
                    .help("remove one of the two"),
            ),
            Ok(OutputSignal { name, .. }) => found.push(name),
            Err(None) => {}
            Err(Some((message, help))) => out.push(
                Diagnostic::error("name::unknown", format!("`outputs` of `[analysis]`: {message}"))
                    .at(&word.place, "not an output")
                    .help(help),
            ),
        }
    }
    Some(found)
}

/// The output of a name: `rk.phi`, `rk.w`, `L1.q`, `L1.i`, or the name of a sensor (its reading). Else message
/// and help, or nothing if it may exist once the reported errors are corrected (`doubtful`).
pub(in crate::study) fn output(
    name: &str,
    equations: &Equations,
    signals: &[(String, Physical)],
    doubtful: &dyn Fn(&str, &str) -> bool,
) -> Result<OutputSignal, Option<(String, String)>> {
    let signal = SignalName::new(name);
    let head = signal.element;
    let has_signal = |name: &str| signals.iter().any(|(candidate, _)| candidate == name);
    let sensor = equations.sensors.iter().find(|(sensor, _)| sensor == head);
    let coordinate = |name: &str| equations.coordinates.iter().position(|shaft| shaft == name);
    let moved = carrier(name);
    let measured = coordinate(moved).filter(|_| moved != name).and_then(|k| {
        let [position, rate] = equations.domain(k).motion();
        let rates = signal.is(rate).then(|| Measured::Speed(moved.into()));
        if signal.is(position) { Some(Measured::Angle(moved.into())) } else { rates }
    });
    if let Some(measured) = measured {
        return Ok(OutputSignal { name: name.into(), measured });
    }
    if let Some((sensor, what)) = sensor.filter(|_| signal.word.is_none() || has_signal(name)) {
        return Ok(OutputSignal { name: sensor.clone(), measured: what.measured.clone() });
    }
    let shown = shortened(name);
    if let Some(k) = coordinate(name) {
        let [first, second] = equations.domain(k).motion().map(|quantity| quantity.of(name));
        let what = equations.domain(k).carrier();
        let help = format!("write `{first}` or `{second}`");
        return Err(Some((format!("`{shown}` is a {what}, not a signal of it"), help)));
    }
    if let Some((_, Sensor { measured: Measured::Signal(signal), .. })) =
        equations.signal_sensors.iter().find(|(sensor, _)| sensor == head)
    {
        let message = format!(
            "`{shown}` is no output: it measures the signal `{signal}`, and an analysis covers only the mechanism"
        );
        return Err(Some((message, "name angles and speeds, or sensors of them and of torques".into())));
    }
    if has_signal(name) {
        let is_input = equations.inputs.iter().any(|input| input.element == head);
        return Err(Some(if (signal.is(Quantity::Torque) || signal.is(Quantity::Force)) && !is_input {
            (
                format!("the torque `{shown}` is no output: only angles and speeds of shafts and sensors are"),
                format!("add a sensor: `[sensor.NAME]` with `measures = \"torque\"` and `element = \"{head}\"`"),
            )
        } else if signal.is(Quantity::Voltage) {
            (
                format!("the voltage `{shown}` is no output: only charges and currents are"),
                "name `<branch>.q` or `<branch>.i`; the charge of a capacitor is its voltage times the capacitance"
                    .into(),
            )
        } else {
            (
                format!("`{shown}` is no output: only angles and speeds of shafts and sensors are"),
                "name `<shaft>.phi`, `<shaft>.w` or a sensor".to_string(),
            )
        }));
    }
    if doubtful(name, head) {
        return Err(None);
    }
    let of = |(k, name): (usize, &String)| equations.domain(k).motion().map(|quantity| quantity.of(name));
    let all: Vec<String> = equations
        .coordinates
        .iter()
        .enumerate()
        .flat_map(of)
        .chain(equations.sensors.iter().map(|(sensor, _)| sensor.clone()))
        .collect();
    let names = || all.iter().map(String::as_str);
    let help = unknown_name(name, names());
    let what = match (0..equations.coordinates.len()).all(|k| equations.domain(k) == Domain::Charge) {
        true => "charge, current or sensor",
        false => "angle, speed or sensor",
    };
    Err(Some((format!("there is no {what} `{shown}`"), help)))
}

fn whole_samples(table: &Table, samples: f64, out: &mut Vec<Diagnostic>) -> Option<usize> {
    if samples.fract() == 0.0 && (1.0..=MOST_SAMPLES).contains(&samples) {
        return Some(samples as usize);
    }
    let message = format!("`samples` of `[analysis]`: expected a whole number from 1 to 1000000, found {samples}");
    let help = "1000 samples estimate a probability to within 0.03";
    out.push(key_error("analysis::samples", message, (table, "samples", "not such a number"), help));
    None
}

/// The values of `at` of a table: positions of coordinates, speeds of anything that moves, torques of inputs, and the time.
pub(in crate::study) fn operating_point(
    (table, what): (&Table, &str),
    (document, equations): (&Document, &Equations),
    coordinates: Option<&[String]>,
    reader: &TableReader<'_>,
    out: &mut Vec<Diagnostic>,
) -> (Vec<(String, f64)>, OperatingConditions) {
    let (mut conditions, mut rest) = (OperatingConditions::default(), Vec::new());
    let body = |name: &str| document.elements.iter().filter(|e| e.name == name).find_map(Instance::body);
    for entry in table.map("at").unwrap_or_default() {
        let (name, scalar) = entry;
        let signal = SignalName::new(&name.value);
        let label = format!("`{}` in `at` of {what}", name.value);
        let mut read =
            |dimension, sign| of_dimension(reader, scalar, (dimension, sign), &label, out).map(|value| value.to_f64());
        let input = equations.inputs.iter().find(|input| input.element == signal.element);
        let input = input.map(|input| equations.domain_of(input)).filter(|domain| signal.is(domain.effort()));
        let moves = body(signal.element).filter(|domain| signal.is(domain.motion()[1]));
        let is_coordinate = coordinates.is_some_and(|all| all.iter().any(|own| own == signal.element));
        match (input, moves) {
            _ if name.value == TIME => conditions.time = read(Dimension::TIME, Sign::NonNegative),
            (Some(domain), _) => {
                let torque = read(domain.effort_dimension(), Sign::Any);
                conditions.torques.extend(torque.map(|torque| (signal.element.to_string(), torque)));
            }
            (None, Some(domain)) if coordinates.is_some() && !is_coordinate => {
                let speed = read(domain.dimensions()[1], Sign::Any);
                conditions.speeds.extend(speed.map(|speed| (signal.element.to_string(), speed)));
            }
            _ => rest.push(entry.clone()),
        }
    }
    if let Some(time) = conditions.time.filter(|time| *time < 0.0) {
        let message =
            format!("`t` in `at` of {what}: expected a time at or after the start of the run, found {time} s");
        out.push(key_error("number::sign", message, (table, "at", "before the start"), "the run begins at `t` = 0 s"));
    }
    let found = targets_of((what, "at"), &rest, (document, coordinates), reader, out);
    let (speeds, positions): (Vec<_>, Vec<_>) =
        found.into_iter().partition(|(signal, _)| SignalName::new(signal).is_rate());
    let by_body = |list: Vec<(String, f64)>| {
        list.into_iter()
            .map(|(signal, value)| (SignalName::new(&signal).element.to_string(), value))
            .collect::<Vec<_>>()
    };
    conditions.speeds.extend(by_body(speeds));
    (by_body(positions), conditions)
}

/// The key of `at` that is the time.
const TIME: &str = "t";

/// Angles (and speeds, if `rates` is 2) of coordinates by name, among the entries of a table.
pub(in crate::study) fn targets_of(
    (what, key): (&str, &str),
    entries: &[Entry],
    (document, coordinates): (&Document, Option<&[String]>),
    reader: &TableReader<'_>,
    out: &mut Vec<Diagnostic>,
) -> Vec<(String, f64)> {
    let mut found = Vec::new();
    for (name, scalar) in entries {
        let signal = SignalName::new(&name.value);
        let shaft = signal.unqualified().unwrap_or(&name.value);
        let body = |name: &str| document.elements.iter().filter(|e| e.name == name).find_map(Instance::body);
        let quantities = |name: &str| body(name).unwrap_or_default().motion().into_iter();
        let is_shaft = body(shaft).is_some();
        let fits = coordinates.map_or(is_shaft, |names| names.iter().any(|n| n == shaft));
        let derivative = quantities(shaft).position(|quantity| signal.is(quantity));
        if let (true, Some(rate)) = (fits, derivative) {
            let dimension = body(shaft).unwrap_or_default().dimensions()[rate];
            let label = format!("`{}` in `{key}` of {what}", name.value);
            let value = of_dimension(reader, scalar, (dimension, Sign::Any), &label, out);
            found.extend(value.map(|value| (name.value.clone(), value.to_f64())));
            continue;
        }
        if coordinates.is_none() && document.suppressed.has(shaft) {
            continue;
        }
        let shafts = document.elements.iter().filter(|e| e.body().is_some()).map(|e| e.name.clone());
        let usable: Vec<String> = coordinates.map_or_else(|| shafts.collect(), <[String]>::to_vec);
        let names: Vec<String> =
            usable.iter().flat_map(|name| quantities(name).map(move |quantity| quantity.of(name))).collect();
        let names = || names.iter().map(String::as_str);
        let shown = shortened(&name.value);
        let (message, help) = if is_shaft && derivative.is_some() {
            let help = format!(
                "the coordinates have the signals {}; `coordinates` of `[model]` chooses others",
                quoted(names())
            );
            (format!("`{shaft}` is not a coordinate; its motion follows from the coordinates"), help)
        } else {
            let help = unknown_name(&name.value, names());
            (format!("`{shown}` is not the angle or speed of a coordinate"), help)
        };
        let message = format!("`{key}` of {what}: {message}");
        out.push(Diagnostic::error("name::unknown", message).at(&name.place, "not a coordinate").help(help));
    }
    found
}

fn places(
    table: &Table,
    key: &str,
    context: &SignalContext<'_>,
    reader: &TableReader<'_>,
    out: &mut Vec<Diagnostic>,
) -> Vec<Site> {
    let tables = table.tables(key);
    if tables.is_empty() && table.values.contains_key(key) && !table.unread.contains(&key) {
        let message = format!("`{key}` of `[analysis]`: the list is empty");
        let help = format!("write each place as `[[analysis.{key}]]`, or leave it out");
        out.push(key_error("list::length", message, (table, key, "no place"), help));
    }
    let mut found: Vec<Site> = Vec::new();
    for (i, table) in tables.iter().enumerate() {
        let Some(shaft) = read_word(table, "shaft") else { continue };
        let body = context.document.elements.iter().filter(|e| e.name == shaft).find_map(Instance::body);
        let [position, rate] = body.unwrap_or_default().motion();
        let signal = match (key, read_word(table, "measures")) {
            ("actuator", _) => String::new(),
            (_, Some("speed")) => rate.of(shaft),
            (_, None) if table.unread.contains(&"measures") => continue,
            _ => position.of(shaft),
        };
        // `TableReader::values` of the whole table has reported unreadable values.
        let label = format!("`cost` of entry {} of `{key}` of `[analysis]`", i + 1);
        let cost = table
            .scalar_or_default("cost", &table.place)
            .map(|scalar| of_dimension(reader, &scalar, (Dimension::NONE, Sign::NonNegative), &label, &mut Vec::new()));
        // If it is unreadable, the location is checked nevertheless.
        let Some(cost) = cost.unwrap_or_else(|| Some(Exact::zero())) else { continue };
        let place = table.place_of("shaft").clone();
        let site = Site { shaft: shaft.to_string(), signal, cost: cost.to_f64(), place };
        match found.iter().find(|other| other.shaft == site.shaft && other.signal == site.signal) {
            Some(other) => {
                let shown = if site.signal.is_empty() { &site.shaft } else { &site.signal };
                let message = format!("`{key}` of `[analysis]`: the place `{shown}` is listed twice");
                let diagnostic = Diagnostic::duplicate("name::duplicate", message, &site.place, &other.place);
                out.push(diagnostic.help("remove one of the two"));
            }
            None => found.push(site),
        }
    }
    let has_shaft = |place: &Site| context.document.elements.has(&place.shaft);
    found.retain(has_shaft);
    found
}

fn check_stuck(spec: &mut AnalysisSpec, context: &SignalContext<'_>, equations: &Equations, out: &mut Vec<Diagnostic>) {
    let stickable = equations.unilaterals.iter().filter(|unilateral| {
        !matches!(unilateral.value, UnilateralConstraint::Cushion { .. } | UnilateralConstraint::GearLoss(_))
    });
    let with: BTreeSet<&str> = equations.frictions.iter().map(|friction| friction.element.as_str()).collect();
    let with: BTreeSet<&str> =
        with.into_iter().chain(stickable.map(|unilateral| unilateral.element.as_str())).collect();
    for word in context.document.analysis.names("stuck").unwrap_or_default() {
        let name = word.value.as_str();
        let element = context.document.elements.get(name);
        let has_friction = element.is_some_and(|e| e.kind.fields.iter().any(|field| field.name == "friction"));
        let has_restitution = element.is_some_and(|e| e.kind.fields.iter().any(|field| field.name == "restitution"));
        if !(has_friction || has_restitution)
            || with.contains(name)
            || context.doubtful.contains(name)
            || context.document.suppressed.has(name)
        {
            continue;
        }
        let help = match with.is_empty() {
            true => "no element has any; leave `stuck` out, or give an element `friction`".to_string(),
            false => format!("{} can be stuck", quoted(with.iter().copied())),
        };
        let what = if has_friction { "no Coulomb friction" } else { "neither a rigid stop nor backlash" };
        let message = format!("`stuck` of `[analysis]`: `{}` has {what} that could lock it", shortened(name));
        out.push(Diagnostic::error("analysis::stuck", message).at(&word.place, "no friction").help(help));
    }
    spec.stuck.retain(|name| with.contains(name.as_str()));
}

/// The operating point must have finite angles and leave at least one motion.
fn check_point(spec: &AnalysisSpec, table: &Table, point: &Point<'_>, out: &mut Vec<Diagnostic>) {
    let position = spec.position(&point.reduced.coordinate_names(), point.initial);
    if !is_finite_at(point.reduced, &position) {
        let message = "at the operating point an angle is too large for a number";
        let help = "check the exponents of the angles and of the ratios";
        out.push(key_error("number::range", message, (table, "at", "from these angles"), help));
        return;
    }
    if spec.stuck.is_empty() {
        return;
    }
    let stuck: BTreeSet<String> = spec.stuck.iter().cloned().collect();
    let system = ConstrainedSystem::at(point.reduced, &position, &stuck, &[]);
    if system.constraints.len() == system.coordinates.len() {
        let names = quoted(spec.stuck.iter().map(String::as_str));
        let message = format!("`stuck` of `[analysis]`: no motion is possible while the friction of {names} sticks");
        out.push(key_error("analysis::stuck", message, (table, "stuck", "no motion is left"), "let one of them slide"));
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/study/requests/analysis_spec.rs"]
mod tests;
