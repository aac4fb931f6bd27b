//! The sensors of a scenario that fail.

use super::read::{quantity, read_word};
use crate::diagnostics::{Diagnostic, nearest, quoted, shortened};
use crate::model::{Document, Model, TableReader};
use crate::schema::{Sign, Value};
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
    // What controllers read, and whether they are sampled, so that a reading is an event at all.
    let all = model.controls.iter().map(|control| (control, true));
    let all = all.chain(model.idle.iter().map(|control| (control, false)));
    let read: Vec<(&String, bool, &str, bool)> = all
        .flat_map(|(control, in_loop)| {
            let sensors = control.values.table("observer").and_then(|observer| observer.words("sensors"));
            let sampled = control.values.has("sample_time");
            sensors.unwrap_or_default().iter().map(move |sensor| (sensor, sampled, control.name.as_str(), in_loop))
        })
        .collect();
    for (i, fault) in tables.iter().enumerate() {
        let what = &format!("entry {} of `fault` of `[scenario]`", i + 1);
        let mut time = |key: &str, sign: Sign| {
            fault.values.contains_key(key).then(|| quantity(reader, fault, key, (Dimension::TIME, sign), what, out))
        };
        let (at, until) = (time("at", Sign::Positive), time("until", Sign::Positive));
        let Some(sensor) = read_word(fault, "sensor") else { continue };
        let kind = if read_word(fault, "kind") == Some("stuck") { FaultKind::Stuck } else { FaultKind::Lost };
        let (at, until) = match (at, until) {
            (Some(Some(at)), None) => (at.to_f64(), f64::INFINITY),
            (Some(Some(at)), Some(Some(until))) => (at.to_f64(), until.to_f64()),
            _ => continue,
        };
        if let Some(duration) = duration.map(Exact::to_f64).filter(|duration| at >= *duration) {
            out.push(
                Diagnostic::warning(
                    "event::late",
                    format!("this fault at {at} s never happens: the run ends at {duration} s"),
                )
                .at(TableReader::place(fault, "at"), "after the end")
                .help("lengthen `duration` or move the fault"),
            );
        }
        if until <= at {
            let message = format!("{what}: it would end at {until} s, before it begins at {at} s");
            let help = "choose `until` after `at`, or leave it out for a fault that stays";
            let place = TableReader::place(fault, "until");
            out.push(Diagnostic::error("fault::window", message).at(place, "not after the begin").help(help));
            continue;
        }
        let fault_found = SensorFault { sensor: sensor.into(), kind, at, until };
        let same = |name: &str| fault_found.concerns(name) || name == sensor;
        let readers: Vec<_> = read.iter().filter(|(name, ..)| same(name)).collect();
        let shown = shortened(sensor);
        let mistake = match readers.first() {
            None if document.doubts.has(sensor) => continue,
            None => {
                let mut names: Vec<&str> =
                    read.iter().filter(|(_, sampled, ..)| *sampled).map(|(n, ..)| n.as_str()).collect();
                names.sort_unstable();
                names.dedup();
                let heads = names.iter().map(|name| name.rsplit_once('.').map_or(*name, |(head, _)| head));
                let help = match nearest(sensor, names.iter().copied().chain(heads)) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None if names.is_empty() => {
                        "sensors are read by the observer of a controller with a `sample_time`".to_string()
                    }
                    None => format!("controllers read {}", quoted(names.iter().copied())),
                };
                Some((format!("no controller reads a sensor `{shown}`"), help))
            }
            Some((_, _, control, _)) if readers.iter().all(|(_, sampled, ..)| !sampled) => Some((
                format!("control `{control}` reads `{shown}` in continuous time, where sensors are ideal"),
                format!("give it a sample time: `sample_time = \"1 ms\"` under `[control.{control}]`"),
            )),
            Some(_) => None,
        };
        if let Some((message, help)) = mistake {
            out.push(
                Diagnostic::error("name::unknown", format!("{what}: {message}"))
                    .at(TableReader::place(fault, "sensor"), "cannot fail")
                    .help(help),
            );
            continue;
        }
        // In a loop in which nobody reads it, nothing happens.
        if !readers.iter().any(|(.., in_loop)| *in_loop) {
            continue;
        }
        let same = |other: &&SensorFault| other.concerns(sensor) || fault_found.concerns(&other.sensor);
        let both = |other: &&SensorFault| other.at < until && at < other.until;
        if let Some(other) = faults.iter().filter(same).find(both) {
            let message = format!(
                "{what}: `{shown}` has another fault then, from {} s{}",
                other.at,
                if other.until.is_finite() { format!(" to {} s", other.until) } else { " on".into() }
            );
            let help = "let one fault end before the other begins";
            out.push(
                Diagnostic::error("fault::window", message)
                    .at(TableReader::place(fault, "at"), "at the same time")
                    .help(help),
            );
            continue;
        }
        faults.push(fault_found);
    }
    faults
}
