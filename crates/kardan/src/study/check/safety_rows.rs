//! Checks that the time windows of `[safety]` contain rows of the results.

use crate::study::measure::selected_variants::selects;
use crate::study::read::read_values::read_word;
use crate::study::requests::safety_spec::{Effect, SAFETY};
use crate::study::{NamedFault, Prepared, PreparedVariant};
use kardan_model::Document;
use kardan_schema::diagnostics::Diagnostic;

/// Rejects times shorter than the row interval of the results after the start of a fault: they would contain no row.
pub(in crate::study) fn check_rows(document: &Document, prepared: &Prepared, out: &mut Vec<Diagnostic>) {
    let (Some(spec), table) = (&prepared.safety, &document.safety) else { return };
    let effects = table.tables("effect");
    let window = |effect: &Effect| {
        let place = effects.iter().find(|table| read_word(table, "name") == Some(&effect.definition.name));
        let place = place.map(|table| table.place_of("window").clone()).unwrap_or_default();
        (format!("effect `{}`: its window", effect.definition.name), effect.window, place)
    };
    let detection_time = spec.detection_time_limit.map(|time| {
        (format!("`detection_time_limit` of {SAFETY}"), time, table.place_of("detection_time_limit").clone())
    });
    let tried = |variant: &&PreparedVariant| selects(&spec.variants, &variant.name);
    for (what, length, place) in spec.effects.iter().map(window).chain(detection_time) {
        let next = |variant: &PreparedVariant, fault: &NamedFault| {
            let (begins, times) = (fault.begins(), &variant.scenario.times);
            let next = times.get(times.partition_point(|time| *time <= begins * (1.0 + 1e-12)))?;
            (begins + length * (1.0 + 1e-9) < *next).then(|| (fault.name.clone(), begins, next - begins))
        };
        let own = |fault: &&NamedFault| spec.faults.contains(&fault.name);
        let found = prepared
            .all()
            .filter(tried)
            .find_map(|variant| variant.faults.iter().filter(own).find_map(|fault| next(variant, fault)));
        let Some((fault, begins, step)) = found else { continue };
        let message = format!(
            "{what} of {length} s after the start of `{fault}` at {begins} s ends before the next row of the results, {step:.3e} s later: it \
             contains no row"
        );
        let help = format!("write at least {step:.3e} s, or a smaller `output_step` under `[scenario]`");
        out.push(Diagnostic::error("safety::window", message).at(place, "shorter than a row").help(help));
    }
}
