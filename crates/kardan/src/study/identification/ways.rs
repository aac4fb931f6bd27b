//! Power-flow directions of gears in the logs.

use super::extra::{ExtraTerm, Law};
use super::plant::{Plant, columns};
use super::request::FitRequest;
use super::rows::{Material, rows};
use kardan_identify::Excitation;

/// Omits gear-loss terms of directions that no log contains, with a note.
pub(super) fn drop_unused_directions(request: &mut FitRequest, plant: &Plant, material: &Material<'_>) -> Vec<String> {
    let of_teeth = |extra: &ExtraTerm| matches!(extra.law, Law::Teeth { .. });
    if !request.extras.iter().any(of_teeth) {
        return Vec::new();
    }
    let samples = rows(plant, request, &columns(plant, request, Excitation::Free), material).samples;
    let (p, w) = (samples.columns, samples.columns - samples.extras);
    let silent = |k: usize| samples.x.chunks_exact(p).all(|row| row[w + k] == 0.0);
    let mut notes = Vec::new();
    let mut number = 0..;
    request.extras.retain(|extra| {
        let idle = number.next().is_some_and(silent) && of_teeth(extra);
        if let (true, Law::Teeth { back }) = (idle, &extra.law) {
            let way = if *back { "driven by the load" } else { "driving" };
            notes.push(format!(
                "kardan omits {}: in these logs the first body of {} is never {way}",
                extra.name, extra.element
            ));
        }
        !idle
    });
    notes
}
