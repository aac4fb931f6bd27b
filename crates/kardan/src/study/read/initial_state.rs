//! Initial values: `initial` of `[scenario]`.

use super::read_values::of_dimension;
use kardan_math::names::unknown_name;
use kardan_mechanics::equations::Domain;
use kardan_mechanics::reduce::{Reduced, StartConflict, StartValue, start_position, start_speed};
use kardan_model::{Document, Instance, Setting, TableReader};
use kardan_results::signal_name::{Quantity, SignalName, carrier};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::Sign;

/// An entry of `initial` of a coordinate, with its rank: 0 for its position, 1 for its rate.
pub(in crate::study) struct Entry {
    pub(in crate::study) name: String,
    pub(in crate::study) place: Place,
    pub(in crate::study) unit: &'static str,
    pub(in crate::study) rate: usize,
    pub(in crate::study) prescribed: StartValue,
}

/// The values of `initial`, of anything that moves; the reader of the scenario reports errors. Angles matter at the start of a run.
pub(in crate::study) fn start_values(document: &Document, settings: &[Setting], reduced: &Reduced) -> Vec<Entry> {
    if reduced.equations.multiplier_constraints.is_empty() {
        return Vec::new();
    }
    let mut found = entries(&TableReader::new(document, settings), document, Some(reduced), &mut Vec::new());
    let elsewhere = document.scenario.values.contains_key("start");
    found.retain(|entry| entry.rate == 1 || !elsewhere);
    found
}

/// Positions and speeds of the reduced coordinates; of none if these are unknown.
pub(in crate::study) fn initial_state(
    reader: &TableReader<'_>,
    document: &Document,
    reduced: Option<&Reduced>,
    out: &mut Vec<Diagnostic>,
) -> (Vec<f64>, Vec<f64>) {
    let entries = entries(reader, document, reduced, out);
    let Some(reduced) = reduced else { return (Vec::new(), Vec::new()) };
    let r = reduced.degrees_of_freedom();
    let mut state = [vec![0.0; r], vec![0.0; r]];
    for rate in [0, 1] {
        let own: Vec<&Entry> = entries.iter().filter(|entry| entry.rate == rate).collect();
        let prescribed: Vec<StartValue> = own.iter().map(|entry| entry.prescribed.clone()).collect();
        let found = match plain(reduced, &prescribed) {
            Some(found) => Ok(found),
            None if rate == 0 => start_position(reduced, &prescribed),
            None => start_speed(reduced, &state[0], &prescribed),
        };
        match found {
            Ok(found) => state[rate] = found,
            Err(conflict) => {
                out.push(contradiction(&own, &conflict));
                break;
            }
        }
    }
    state.into()
}

/// If only reduced coordinates are given, there is nothing to solve.
fn plain(reduced: &Reduced, prescribed: &[StartValue]) -> Option<Vec<f64>> {
    let mut out = vec![0.0; reduced.degrees_of_freedom()];
    for StartValue { coordinate, value } in prescribed {
        out[reduced.coordinates.iter().position(|own| own == coordinate)?] = value.to_f64();
    }
    Some(out)
}

fn contradiction(entries: &[&Entry], conflict: &StartConflict) -> Diagnostic {
    let StartConflict { prescribed, follows, transmission } = conflict;
    let value_text =
        |k: usize| format!("`{}` = {} {}", entries[k].name, entries[k].prescribed.value.to_f64(), entries[k].unit);
    let last = follows.map(|(number, _)| number).or_else(|| prescribed.last().copied()).unwrap_or_default();
    let earlier: Vec<String> = prescribed.iter().filter(|k| **k != last).map(|k| value_text(*k)).collect();
    let own = value_text(last);
    let message = match (follows, transmission) {
        (Some((_, value)), _) if earlier.is_empty() => {
            format!("{own}, but the constraints of the model fix it at {value} {}", entries[last].unit)
        }
        (Some((_, value)), _) => {
            format!("{own} contradicts {}, from which {value} {} follows", earlier.join(", "), entries[last].unit)
        }
        (None, Some(element)) if earlier.is_empty() => format!("{own} is not possible with the ratio of `{element}`"),
        (None, Some(element)) => format!("{own} contradicts {} by the ratio of `{element}`", earlier.join(", ")),
        (None, None) => format!("{own} is not possible"),
    };
    let others = prescribed.iter().filter(|k| **k != last);
    Diagnostic::error("scenario::inconsistent-initial", format!("`initial` of `[scenario]`: {message}"))
        .at_each(entries.get(last).map(|entry| entry.place.clone()), "contradicts")
        .at_each(others.map(|k| entries[*k].place.clone()), "this one")
        .help("take one of them out, or give values that agree")
}

/// The values of `initial`, of anything that moves.
fn entries(
    reader: &TableReader<'_>,
    document: &Document,
    reduced: Option<&Reduced>,
    out: &mut Vec<Diagnostic>,
) -> Vec<Entry> {
    let charges = document.charges();
    let bodies = document.elements.iter().filter(|e| e.body().is_some()).map(|e| e.name.as_str());
    let moving: Vec<&str> = bodies.chain(charges.iter().map(String::as_str)).collect();
    let domain = |name: &str| match document.elements.get(name) {
        _ if charges.iter().any(|charge| charge == name) => Domain::Charge,
        found => found.and_then(Instance::body).unwrap_or_default(),
    };
    let mut found = Vec::new();
    for (name, scalar) in document.scenario.map("initial").unwrap_or_default() {
        let (signal, body) = (SignalName::new(&name.value), carrier(&name.value));
        let quantities = domain(body).motion();
        let rate = quantities.iter().position(|quantity| signal.is(*quantity)).filter(|_| moving.contains(&body));
        let Some(rate) = rate else {
            if reduced.is_some() || !document.suppressed.has(body) {
                let coordinate_names: Vec<String> =
                    moving.iter().flat_map(|n| domain(n).motion().map(|quantity: Quantity| quantity.of(n))).collect();
                let what = if charges.is_empty() { "angle or speed" } else { "angle, speed, charge or current" };
                let message = format!("`initial` of `[scenario]`: `{}` is no {what}", shortened(&name.value));
                let unknown = Diagnostic::error("name::unknown", message).at(&name.place, "nothing of that name");
                out.push(unknown.help(unknown_name(&name.value, coordinate_names.iter().map(String::as_str))));
            }
            continue;
        };
        let label = format!("`{}` in `initial` of `[scenario]`", name.value);
        let value = of_dimension(reader, scalar, (domain(body).dimensions()[rate], Sign::Any), &label, out);
        let coordinate = reduced.and_then(|reduced| reduced.coordinate(body));
        if let (Some(value), Some(coordinate)) = (value, coordinate) {
            let prescribed = StartValue { coordinate, value };
            let unit = quantities[rate].unit();
            found.push(Entry { name: name.value.clone(), place: name.place.clone(), unit, rate, prescribed });
        }
    }
    found
}
