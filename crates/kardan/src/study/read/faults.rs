//! Faults of a scenario: sensors, motors, control units, springs and gears.

use super::events::check_late;
use super::locations::unknown_name_or;
use super::read_values::{has_key, key_error, quantity, quantity_like, read_word};
use super::state_names::motors;
use kardan_math::units::{Dimension, Exact, shown_quantity};
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::equations::{Domain, InputKind, Measured};
use kardan_model::parse::broken;
use kardan_model::{ControlSpec, Document, Model, TableReader};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::schema::{Sign, Table};
use kardan_simulate::{Failing, Faults, MechanicalFaultKind, MotorFaultKind, SensorFaultKind, UnitFaultKind};

/// Parts that may fail, with their kinds of fault; the first kind is the default.
const PARTS: [(&str, &[&str]); 4] = [
    ("sensor", &["lost", "stuck", "offset", "drift", "noise", "reversed"]),
    ("motor", &["dead", "reduced", "reversed", "stuck", "braking", "undervoltage"]),
    ("control", &["reset", "missed", "stale", "jitter"]),
    ("element", &["broken", "jump"]),
];

/// `[[scenario.fault]]` and `[fault.NAME]` of a document; errors are reported.
pub(in crate::study) fn faults(
    reader: &TableReader<'_>,
    (document, model, equations, settled): (&Document, &Model, &Equations, bool),
    duration: Option<&Exact>,
    out: &mut Vec<Diagnostic>,
) -> (Faults, Vec<NamedFault>) {
    let readings = &readings(model);
    let mut add = |table: &Table, what: &str, faults: &mut Faults| {
        Reader { reader, table, what, document, model, equations, readings, settled }.add(duration, faults, out);
    };
    let mut faults = Faults::default();
    for (i, table) in document.scenario.tables("fault").iter().enumerate() {
        add(table, &format!("entry {} of `fault` of `[scenario]`", i + 1), &mut faults);
    }
    let mut named = Vec::new();
    for (name, table) in &document.faults {
        let (name, mut faults) = (name.value.clone(), Faults::default());
        add(table, &format!("fault `{}`", shortened(&name)), &mut faults);
        named.push(NamedFault { name, faults });
    }
    (faults, named)
}

/// A named fault: it is active where a variant or command requests it.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedFault {
    /// Its name.
    pub name: String,
    /// Its effect; none if no part of the loop of this variant reads it.
    pub faults: Faults,
}

impl NamedFault {
    /// Its begin, s; infinite if it has no effect.
    pub fn begins(&self) -> f64 {
        self.faults.times().fold(f64::INFINITY, f64::min)
    }
}

/// A sensor that the observer of a controller, a program, or a block reads.
struct Reading<'m> {
    sensor: &'m str,
    control: &'m str,
    /// At a sample time, so that a reading is an event.
    sampled: bool,
    in_loop: bool,
}

fn readings(model: &Model) -> Vec<Reading<'_>> {
    let tasks = model.programs.tasks.iter().map(|task| ("blocks", task));
    let of_laws =
        model.controls.iter().filter_map(|control| Some((control.name.as_str(), control.values.task("commands")?)));
    let of_blocks = tasks.chain(of_laws).flat_map(|(control, task)| {
        let sampled = task.period.is_some();
        let sensors = task.reads.iter().filter_map(|(_, read)| read.sensor());
        sensors.map(move |sensor| Reading { sensor, control, sampled, in_loop: true })
    });
    let all = model.controls.iter().map(|control| (control, true));
    all.chain(model.idle.iter().map(|control| (control, false)))
        .flat_map(|(control, in_loop)| {
            let sensors = control.values.table("observer").and_then(|observer| observer.names("sensors"));
            let sampled = control.values.has("sample_time");
            let reading = move |sensor| Reading { sensor, control: control.name.as_str(), sampled, in_loop };
            sensors.unwrap_or_default().iter().map(String::as_str).map(reading)
        })
        .chain(of_blocks)
        .collect()
}

/// One table, with the names it may use.
struct Reader<'a, 'r> {
    reader: &'a TableReader<'r>,
    table: &'a Table,
    what: &'a str,
    document: &'a Document,
    model: &'a Model,
    equations: &'a Equations,
    readings: &'a [Reading<'a>],
    /// Whether motions without inertia were solved for by springs and dampers.
    settled: bool,
}

impl<'a> Reader<'a, '_> {
    fn diagnostic(&self, code: &'static str, message: &str, (key, label): (&str, &str), help: String) -> Diagnostic {
        key_error(code, format!("{}: {message}", self.what), (self.table, key, label), help)
    }

    /// Reads it.
    fn add(&self, duration: Option<&Exact>, faults: &mut Faults, out: &mut Vec<Diagnostic>) {
        let Some((part, name)) = self.part(out) else { return };
        let window = self.window(duration, out);
        let Some(kind) = self.kind(part, out) else { return };
        let Some((at, until)) = window else { return };
        let fault = Failing { name: name.to_string(), kind: (), at, until };
        match part {
            "sensor" => self.sensor(fault, kind, faults, out),
            "motor" => self.motor(fault, kind, faults, out),
            "element" => self.element(fault, kind, faults, out),
            _ => self.unit(fault, kind, faults, out),
        }
    }

    /// The failing part and its name.
    fn part(&self, out: &mut Vec<Diagnostic>) -> Option<(&'static str, &'a str)> {
        let parts = PARTS.iter().map(|(part, _)| *part);
        let named: Vec<&'static str> = parts.filter(|part| has_key(self.table, part)).collect();
        match named[..] {
            [part] => Some((part, read_word(self.table, part)?)),
            [] => {
                let message = format!("{}: it names no failing part", self.what);
                let help = "add `sensor = \"...\"`, `motor = \"...\"`, `control = \"...\"` or `element = \"...\"`";
                out.push(Diagnostic::error("key::missing", message).at(&self.table.place, "no part").help(help));
                None
            }
            [_, second, ..] => {
                let message = format!("it names {}, but a fault concerns one part", quoted(&named));
                let help = "write one fault for each; they may be at the same time".to_string();
                out.push(self.diagnostic("fault::component", &message, (second, "a second part"), help));
                None
            }
        }
    }

    /// Begin and end, s.
    fn window(&self, duration: Option<&Exact>, out: &mut Vec<Diagnostic>) -> Option<(f64, f64)> {
        let mut time = |key: &str| {
            let expected = (Dimension::TIME, Sign::Positive);
            let is_set = self.table.values.contains_key(key);
            is_set.then(|| quantity(self.reader, self.table, key, expected, self.what, out))
        };
        let (at, until) = (time("at")??, time("until"));
        let until = match until {
            None => f64::INFINITY,
            Some(until) => until?.to_f64(),
        };
        check_late(self.table, "fault", Some(&at), duration, out);
        let at = at.to_f64();
        if until <= at {
            let message = format!("it would end at {until} s, before it begins at {at} s");
            let help = "choose `until` after `at`, or leave it out for a fault that stays".to_string();
            out.push(self.diagnostic("fault::overlap", &message, ("until", "not after the start"), help));
            return None;
        }
        Some((at, until))
    }

    /// The kind of fault of a part.
    fn kind(&self, part: &str, out: &mut Vec<Diagnostic>) -> Option<&'static str> {
        let kinds = PARTS.iter().find(|(candidate, _)| *candidate == part).map_or(&[][..], |(_, kinds)| kinds);
        if !self.table.values.contains_key("kind") {
            // The reader reports a value that is no word.
            return if self.table.unread.contains(&"kind") { None } else { kinds.first().copied() };
        }
        let word = read_word(self.table, "kind")?;
        let found = kinds.iter().copied().find(|kind| *kind == word);
        if found.is_none() {
            let article = if part == "element" { "an" } else { "a" };
            let message = format!("{article} {part} cannot be `{word}`");
            let help = format!("choose one of {}", quoted(kinds));
            out.push(self.diagnostic("fault::kind", &message, ("kind", "not of this part"), help));
        }
        found
    }

    /// The amount: present if and only if the kind needs it.
    fn amount(&self, kind: &str, expected: (Dimension, Sign), out: &mut Vec<Diagnostic>) -> Option<f64> {
        if !has_key(self.table, "value") {
            let message = format!("{}: `{kind}` needs the key `value`", self.what);
            let help = format!("write how much: `value = {}`", expected.0.example());
            out.push(key_error("key::missing", message, (self.table, "kind", "`value` is missing"), help));
            return None;
        }
        let of_signal = self.of_signal(read_word(self.table, "sensor").unwrap_or_default()).is_some();
        let read = if of_signal { quantity_like } else { quantity };
        let found = read(self.reader, self.table, "value", expected, self.what, out)?;
        // `value` accepts quantities of any sign: the kind determines the required sign.
        if let Some((rule, help)) = broken(expected.1, &found) {
            let shown = shown_quantity(&found, expected.0);
            let message = format!("`value` of `{kind}` {rule}, found {shown}");
            out.push(self.diagnostic("number::sign", &message, ("value", rule), help.into()));
            return None;
        }
        Some(found.to_f64())
    }

    /// The quantity that a sensor of a signal measures.
    fn of_signal(&self, sensor: &str) -> Option<Dimension> {
        let mut outputs = self.model.programs.sensors.iter().flat_map(|task| &task.outputs);
        outputs.find(|output| output.name == sensor).map(|output| output.dimension)
    }

    /// A kind of fault without an amount; one that is given is reported.
    fn plain<K>(&self, kind: &str, found: K, out: &mut Vec<Diagnostic>) -> Option<K> {
        if self.table.values.contains_key("value") {
            let message = format!("`value` has no meaning for `{kind}`");
            out.push(self.diagnostic("fault::kind", &message, ("value", "not used"), "remove it".into()));
        }
        Some(found)
    }

    /// A fraction, from zero to below one.
    fn share(&self, kind: &str, out: &mut Vec<Diagnostic>) -> Option<f64> {
        let share = self.amount(kind, (Dimension::NONE, Sign::NonNegative), out)?;
        if share >= 1.0 {
            let message = format!("`value` is the remaining part, and {share} leaves all of it");
            let help = "write a number below one: `value = 0.5`".to_string();
            out.push(self.diagnostic("number::range", &message, ("value", "not below one"), help));
            return None;
        }
        Some(share)
    }

    /// Whether another fault of the same part is active at the same time, which is reported.
    fn is_free<A, B>(&self, fault: &Failing<A>, same_target: &[&Failing<B>], out: &mut Vec<Diagnostic>) -> bool {
        let Some(overlapping) = same_target.iter().find(|overlapping| fault.overlaps(overlapping)) else { return true };
        let end = if overlapping.until.is_finite() { format!(" to {} s", overlapping.until) } else { " on".into() };
        let shown = shortened(&fault.name);
        let message = format!("`{shown}` has another fault then, from {} s{end}", overlapping.at);
        let help = "let one fault end before the other begins".to_string();
        out.push(self.diagnostic("fault::overlap", &message, ("at", "at the same time"), help));
        false
    }

    /// Adds a fault of a part to those of its kind, unless another one is active then; whether it did.
    fn admit<K>(
        &self,
        fault: Failing<()>,
        kind: Option<K>,
        faults: &mut Vec<Failing<K>>,
        out: &mut Vec<Diagnostic>,
    ) -> bool {
        let same_target: Vec<_> = faults.iter().filter(|declared| declared.name == fault.name).collect();
        let Some(kind) = kind.filter(|_| self.is_free(&fault, &same_target, out)) else { return false };
        let Failing { name, at, until, .. } = fault;
        faults.push(Failing { name, kind, at, until });
        true
    }

    fn sensor(&self, fault: Failing<()>, kind: &str, faults: &mut Faults, out: &mut Vec<Diagnostic>) {
        let Failing { name, at, until, .. } = fault;
        let lost = Failing { name, kind: SensorFaultKind::Lost, at, until };
        let concerned: Vec<&Reading<'_>> =
            self.readings.iter().filter(|one| lost.concerns(one.sensor) || *one.sensor == lost.name).collect();
        // The readers are unknown if a block has an error, which has been reported.
        if concerned.is_empty() && (self.model.programs.broken || self.document.suppressed.has(&lost.name)) {
            return;
        }
        if let Some((message, help)) = cannot_fail(&lost.name, &concerned, self.readings) {
            out.push(self.diagnostic("name::unknown", &message, ("sensor", "cannot fail"), help));
            return;
        }
        let of_signal = self.of_signal(&lost.name);
        if of_signal.is_none() && self.document.signal_sensors().any(|(sensor, ..)| sensor == lost.name) {
            // The measured signal has an error, which has been reported.
            return;
        }
        let read = of_signal.or_else(|| reads(&lost.name, self.equations)).unwrap_or(Dimension::NONE);
        let per_time = read.times(&Dimension::TIME, -1).unwrap_or(read);
        let found = match kind {
            "offset" => self.amount(kind, (read, Sign::Any), out).map(SensorFaultKind::Offset),
            "drift" => self.amount(kind, (per_time, Sign::Any), out).map(SensorFaultKind::Drift),
            "noise" => self.amount(kind, (read, Sign::Positive), out).map(SensorFaultKind::Noise),
            "stuck" => self.plain(kind, SensorFaultKind::Stuck, out),
            "reversed" => self.plain(kind, SensorFaultKind::Reversed, out),
            _ => self.plain(kind, SensorFaultKind::Lost, out),
        };
        let Some(kind) = found else { return };
        let same_target =
            faults.sensors.iter().filter(|declared| declared.concerns(&lost.name) || lost.concerns(&declared.name));
        // In a loop without a reader the fault has no effect.
        if concerned.iter().any(|one| one.in_loop) && self.is_free(&lost, &same_target.collect::<Vec<_>>(), out) {
            faults.sensors.push(Failing { kind, ..lost });
        }
    }

    fn motor(&self, fault: Failing<()>, kind: &str, faults: &mut Faults, out: &mut Vec<Diagnostic>) {
        let Some(input) = motors(self.equations).find(|input| input.element == fault.name) else {
            if self.document.suppressed.has(&fault.name) {
                return;
            }
            let names: Vec<&str> = motors(self.equations).map(|input| input.element.as_str()).collect();
            let help = unknown_name_or(&fault.name, names, "the model has no motor");
            out.push(Diagnostic::no_such(self.what, "motor", &fault.name, self.table.place_of("motor")).help(help));
            return;
        };
        let domain = input.row.first().map_or(Domain::Rotation, |(k, _)| self.equations.domain(*k));
        let damping = match domain {
            Domain::Rotation | Domain::Number => Dimension::DAMPING,
            Domain::Translation => Dimension::LINEAR_DAMPING,
            Domain::Charge => Dimension::RESISTANCE,
        };
        let found = match kind {
            "reduced" => self.share(kind, out).map(MotorFaultKind::Scaled),
            "braking" => self.amount(kind, (damping, Sign::Positive), out).map(MotorFaultKind::Braking),
            "undervoltage" => {
                if !matches!(&input.value, InputKind::Motor(motor) if motor.torque_limit.is_some()) {
                    let message = format!("`{}` has no limit that a low supply could lower", shortened(&fault.name));
                    let help = format!("give it one: `torque_limit` under `[motor.{}]`", shortened(&fault.name));
                    out.push(self.diagnostic("fault::kind", &message, ("kind", "no limit"), help));
                    return;
                }
                self.share(kind, out).map(MotorFaultKind::Undervoltage)
            }
            "stuck" => self.plain(kind, MotorFaultKind::Stuck, out),
            "reversed" => self.plain(kind, MotorFaultKind::Scaled(-1.0), out),
            _ => self.plain(kind, MotorFaultKind::Scaled(0.0), out),
        };
        self.admit(fault, found, &mut faults.motors, out);
    }

    fn unit(&self, fault: Failing<()>, kind: &str, faults: &mut Faults, out: &mut Vec<Diagnostic>) {
        let all = || self.model.controls.iter().chain(&self.model.idle);
        let shown = shortened(&fault.name);
        let Some(control) = all().find(|control| control.name == fault.name) else {
            if self.document.suppressed.has(&fault.name) {
                return;
            }
            let names = all().map(|control| control.name.as_str());
            let help = unknown_name_or(&fault.name, names, "the model has no controller");
            let place = self.table.place_of("control");
            out.push(Diagnostic::no_such(self.what, "controller", &fault.name, place).help(help));
            return;
        };
        let Some(period) = control.values.exact("sample_time").map(Exact::to_f64) else {
            let message = format!("`{shown}` computes in continuous time, which no control unit can do");
            let help = format!("give it a sample time: `sample_time = \"1 ms\"` under `[control.{shown}]`");
            out.push(self.diagnostic("fault::component", &message, ("control", "no unit"), help));
            return;
        };
        let found = match kind {
            "jitter" => {
                let most = self.amount(kind, (Dimension::TIME, Sign::Positive), out);
                if most.is_some_and(|most| most >= period) {
                    let message = format!(
                        "commands that are late by more than the sample time of {period} s overtake each other"
                    );
                    let help = "choose `value` below the sample time, or the fault `missed`".to_string();
                    out.push(self.diagnostic("number::range", &message, ("value", "not below the sample time"), help));
                    return;
                }
                most.map(UnitFaultKind::Jitter)
            }
            "missed" => self.plain(kind, UnitFaultKind::Missed, out),
            "stale" => self.plain(kind, UnitFaultKind::Stale, out),
            _ => self.plain(kind, UnitFaultKind::Reset, out),
        };
        let in_loop = self.model.controls.iter().any(|declared| declared.name == fault.name);
        let Some(kind) = found.filter(|_| in_loop) else { return };
        let Failing { at, until, .. } = fault;
        if self.admit(fault, Some(kind), &mut faults.units, out) {
            // Its own blocks fail with it; only its commands are late.
            let own = self.own_blocks(control).filter(|_| !matches!(kind, UnitFaultKind::Jitter(_)));
            faults.units.extend(own.map(|name| Failing { name, kind, at, until }));
        }
    }

    /// The task of the blocks that a program computes: those of its sample time, where no other controller in the loop has that.
    fn own_blocks(&self, control: &ControlSpec) -> Option<String> {
        let period = |control: &ControlSpec| control.values.exact("sample_time").map(Exact::to_rational);
        let own = period(control).filter(|_| control.values.task("commands").is_some())?;
        let mut other_controls = self.model.controls.iter().filter(|candidate| candidate.name != control.name);
        let shared = other_controls.any(|candidate| period(candidate).as_ref() == Some(&own));
        let tasks = || self.model.programs.tasks.iter();
        let task = tasks().find(|task| task.period.as_ref().map(Exact::to_rational).as_ref() == Some(&own));
        task.filter(|_| !shared).map(|task| task.name.clone())
    }

    /// A spring, a damper, or a gear with elasticity.
    fn element(&self, fault: Failing<()>, kind: &str, faults: &mut Faults, out: &mut Vec<Diagnostic>) {
        let shown = shortened(&fault.name);
        let springs = || self.equations.springs.iter().filter(|spring| spring.element == fault.name);
        if let Some((message, help)) = self.cannot_break(&fault.name, kind) {
            if !self.document.suppressed.has(&fault.name) {
                out.push(self.diagnostic("fault::component", &message, ("element", "cannot fail in this way"), help));
            }
            return;
        }
        if fault.until.is_finite() {
            let message =
                format!("`{shown}` stays {}", if kind == "jump" { "where it has jumped to" } else { "broken" });
            out.push(self.diagnostic("fault::overlap", &message, ("until", "for good"), "remove `until`".into()));
            return;
        }
        let found = match kind {
            "jump" => {
                let row = springs().next().map(|spring| self.equations.domain_of(spring)).unwrap_or_default();
                let domain = self.equations.measures.get(&fault.name).copied().unwrap_or(row);
                self.amount(kind, (domain.dimensions()[0], Sign::NonZero), out).map(MechanicalFaultKind::Jump)
            }
            _ => self.plain(kind, MechanicalFaultKind::Broken, out),
        };
        self.admit(fault, found, &mut faults.mechanics, out);
    }

    /// Why an element cannot break or jump, and the remedy.
    fn cannot_break(&self, element: &str, kind: &str) -> Option<(String, String)> {
        let equations = self.equations;
        let shown = shortened(element);
        let has = |name: &str| equations.springs.iter().any(|spring| spring.element == name);
        let damps = equations.dampers.iter().any(|damper| damper.element == element);
        let Some(found) = self.document.elements.get(element) else {
            let names = equations.springs.iter().map(|spring| spring.element.as_str());
            let help = unknown_name_or(element, names, "the model has no spring that could break");
            return Some((format!("there is no element `{shown}`"), help));
        };
        let keyword = found.kind.keyword;
        if equations.unilaterals.iter().any(|unilateral| unilateral.element == element) {
            let why = format!("`{shown}` has backlash or gear losses, and such elements cannot be `{kind}`");
            return Some((why, "take its `backlash` and losses out, or fail another part".into()));
        }
        let springs = keyword == "spring_damper" || equations.compliances.iter().any(|one| one.element == element);
        if !springs || !has(element) && (kind == "jump" || !damps) {
            let why = format!("the {} `{shown}` has no spring that could be `{kind}`", keyword.replace('_', " "));
            return Some((
                why,
                "only a spring_damper, or the gear of a harmonic_drive with a `stiffness`, can fail in this way: put \
                 a `spring_damper` with a short shaft there"
                    .into(),
            ));
        }
        if kind == "broken" && equations.frictions.iter().any(|friction| friction.element == element) {
            let why = format!("`{shown}` has Coulomb friction, which would still act across the broken element");
            return Some((why, "put the friction into a `spring_damper` of its own".into()));
        }
        let solved = self.settled || (0..equations.constraints.len()).any(|row| equations.is_equilibrium(row));
        solved.then(|| {
            let why = format!("with `{shown}` the equations of motions without inertia would change in the run");
            (why, "give all shafts an inertia".into())
        })
    }
}

/// The quantity of a sensor, or of a signal of a shaft.
fn reads(name: &str, equations: &Equations) -> Option<Dimension> {
    let signal = SignalName::new(name);
    let Some((_, sensor)) = equations.sensors.iter().find(|(sensor, _)| sensor == signal.element) else {
        let carrier = equations.coordinates.iter().position(|candidate| candidate == signal.element)?;
        let [position, rate] = equations.domain(carrier).dimensions();
        return Some(if signal.is_rate() { rate } else { position });
    };
    match &sensor.measured {
        Measured::Signal(_) => None,
        Measured::SpringTorque(element) if equations.springs.iter().all(|spring| spring.element != *element) => None,
        measured => Some(equations.reading(measured).physical().dimension()),
    }
}

/// Why a sensor with these readings cannot fail, and the remedy.
fn cannot_fail(sensor: &str, concerned: &[&Reading<'_>], all: &[Reading<'_>]) -> Option<(String, String)> {
    let shown = shortened(sensor);
    let Some(first) = concerned.first() else {
        let mut names: Vec<&str> = all.iter().filter(|one| one.sampled).map(|one| one.sensor).collect();
        names.sort_unstable();
        names.dedup();
        let heads = names.iter().map(|name| SignalName::new(name).element);
        let help = match nearest(sensor, names.iter().copied().chain(heads)) {
            Some(near) => format!("did you mean `{near}`?"),
            None if names.is_empty() => {
                "sensors are read by observers, programs and blocks with a `sample_time`".to_string()
            }
            None => format!("controllers read {}", quoted(names)),
        };
        return Some((format!("no controller reads a sensor `{shown}`"), help));
    };
    let control = first.control;
    concerned.iter().all(|one| !one.sampled).then(|| {
        (
            format!("control `{control}` reads `{shown}` in continuous time, where sensors are ideal"),
            format!("give it a sample time: `sample_time = \"1 ms\"` under `[control.{control}]`"),
        )
    })
}
