//! The sensors of a scenario that fail.

use super::events::check_late;
use super::read::{quantity, read_word};
use crate::diagnostics::{Diagnostic, nearest, quoted, shortened};
use crate::model::{Document, Model, TableReader};
use crate::names::SignalName;
use crate::program::Read;
use crate::schema::{Sign, Table, Value};
use crate::simulate::{FaultKind, SensorFault};
use crate::units::{Dimension, Exact};

/// `[[scenario.fault]]` of a document, with the mistakes in it.
pub(super) fn faults(
    reader: &TableReader<'_>,
    document: &Document,
    model: &Model,
    duration: Option<&Exact>,
    out: &mut Vec<Diagnostic>,
) -> Vec<SensorFault> {
    let mut faults: Vec<SensorFault> = Vec::new();
    let Some(Value::Tables(tables)) = document.scenario.values.get("fault").map(|spanned| &spanned.value) else {
        return faults;
    };
    let readings = readings(model);
    for (i, table) in tables.iter().enumerate() {
        let what = &format!("entry {} of `fault` of `[scenario]`", i + 1);
        let Some(fault) = read(reader, table, duration, what, out) else { continue };
        let concerned: Vec<&Reading<'_>> =
            readings.iter().filter(|one| fault.concerns(one.sensor) || *one.sensor == fault.sensor).collect();
        if concerned.is_empty() && document.doubts.has(&fault.sensor) {
            continue;
        }
        if let Some((message, help)) = cannot_fail(&fault.sensor, &concerned, &readings) {
            out.push(
                Diagnostic::error("name::unknown", format!("{what}: {message}"))
                    .at(TableReader::place(table, "sensor"), "cannot fail")
                    .help(help),
            );
            continue;
        }
        // In a loop in which nobody reads it, nothing happens.
        if !concerned.iter().any(|one| one.in_loop) {
            continue;
        }
        let same = |other: &&SensorFault| other.concerns(&fault.sensor) || fault.concerns(&other.sensor);
        let both = |other: &&SensorFault| other.at < fault.until && fault.at < other.until;
        if let Some(other) = faults.iter().filter(same).find(both) {
            let end = if other.until.is_finite() { format!(" to {} s", other.until) } else { " on".into() };
            let shown = shortened(&fault.sensor);
            let message = format!("{what}: `{shown}` has another fault then, from {} s{end}", other.at);
            out.push(
                Diagnostic::error("fault::window", message)
                    .at(TableReader::place(table, "at"), "at the same time")
                    .help("let one fault end before the other begins"),
            );
            continue;
        }
        faults.push(fault);
    }
    faults
}

/// A sensor that the observer of a controller reads, a program, or a block.
struct Reading<'m> {
    sensor: &'m String,
    control: &'m str,
    /// At a sample time, so that a reading is an event at all.
    sampled: bool,
    in_loop: bool,
}

fn readings(model: &Model) -> Vec<Reading<'_>> {
    let tasks = model.programs.tasks.iter().map(|task| ("blocks", task));
    let of_laws =
        model.controls.iter().filter_map(|control| Some((control.name.as_str(), control.values.task("commands")?)));
    let of_blocks = tasks.chain(of_laws).flat_map(|(control, task)| {
        let sampled = task.period.is_some();
        task.reads.iter().filter_map(move |(_, read)| match read {
            Read::Sensor(sensor) => Some(Reading { sensor, control, sampled, in_loop: true }),
            _ => None,
        })
    });
    let all = model.controls.iter().map(|control| (control, true));
    all.chain(model.idle.iter().map(|control| (control, false)))
        .flat_map(|(control, in_loop)| {
            let sensors = control.values.table("observer").and_then(|observer| observer.words("sensors"));
            let sampled = control.values.has("sample_time");
            let reading = move |sensor| Reading { sensor, control: control.name.as_str(), sampled, in_loop };
            sensors.unwrap_or_default().iter().map(reading)
        })
        .chain(of_blocks)
        .collect()
}

/// One table by itself.
fn read(
    reader: &TableReader<'_>,
    table: &Table,
    duration: Option<&Exact>,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<SensorFault> {
    let mut time = |key: &str| {
        let expected = (Dimension::TIME, Sign::Positive);
        table.values.contains_key(key).then(|| quantity(reader, table, key, expected, what, out))
    };
    let (at, until) = (time("at"), time("until"));
    let sensor = read_word(table, "sensor")?;
    let kind = if read_word(table, "kind") == Some("stuck") { FaultKind::Stuck } else { FaultKind::Lost };
    let at = at??;
    let until = match until {
        None => f64::INFINITY,
        Some(until) => until?.to_f64(),
    };
    check_late(table, "fault", Some(&at), duration, out);
    let at = at.to_f64();
    if until <= at {
        let message = format!("{what}: it would end at {until} s, before it begins at {at} s");
        let help = "choose `until` after `at`, or leave it out for a fault that stays";
        let place = TableReader::place(table, "until");
        out.push(Diagnostic::error("fault::window", message).at(place, "not after the begin").help(help));
        return None;
    }
    Some(SensorFault { sensor: sensor.into(), kind, at, until })
}

/// Why a sensor with these readings cannot fail, and what to do.
fn cannot_fail(sensor: &str, concerned: &[&Reading<'_>], all: &[Reading<'_>]) -> Option<(String, String)> {
    let shown = shortened(sensor);
    let Some(first) = concerned.first() else {
        let mut names: Vec<&str> = all.iter().filter(|one| one.sampled).map(|one| one.sensor.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        let heads = names.iter().map(|name| SignalName::new(name).element);
        let help = match nearest(sensor, names.iter().copied().chain(heads)) {
            Some(near) => format!("did you mean `{near}`?"),
            None if names.is_empty() => {
                "sensors are read by observers, programs and blocks with a `sample_time`".to_string()
            }
            None => format!("controllers read {}", quoted(names.iter().copied())),
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
