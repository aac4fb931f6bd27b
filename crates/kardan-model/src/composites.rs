//! Composite elements: their tables become those of their parts before reading.

use std::borrow::Cow;
use std::collections::BTreeSet;

use super::document::{Document, Instance};
use kardan_elements::element;
use kardan_results::{Mechanism, Terminal};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::{Entries, KeyedEntry, Place};

/// The entries with the parts of composite elements added. A part has the place of the header of its element.
pub(super) fn with_parts(entries: &Entries) -> Cow<'_, Entries> {
    let mut out = Cow::Borrowed(entries);
    for kind in element::COMPOSITES {
        for (found, entry) in entries.tables_of(kind.keyword) {
            let is_mass = |name: &str| entries.table("mass").is_some_and(|masses| masses.get(name).is_some());
            let bodies = kind.fields.iter().filter(|field| field.kind == kardan_schema::schema::Kind::Body);
            let by_mass = bodies.filter_map(|field| entry.text(field.name)).any(is_mass);
            let Some(parts) = element::parts(kind.keyword, &found.key, entry, by_mass) else { continue };
            for group in parts.iter() {
                let Some(tables) = group.entry.value.as_table() else { continue };
                let table = out.to_mut().table_mut(&group.key);
                for part in tables.iter() {
                    table.push(KeyedEntry::at(&part.key, &part.entry.value, &found.place));
                }
            }
        }
    }
    out
}

impl Document {
    /// Omits the parts of an element from the drawing, which shows the element, unless others name them.
    pub(super) fn fold_parts(&self, mechanism: &mut Mechanism) {
        let is_composite = |one: &&Instance| element::is_composite(one.kind.keyword);
        let wholes: Vec<&Place> = self.elements.iter().filter(is_composite).map(|whole| &whole.place).collect();
        let is_part = |name: &str| {
            let found = self.elements.all(name).find(|one| !is_composite(one));
            found.is_some_and(|part| wholes.contains(&&part.place))
        };
        let (parts, remaining): (Vec<_>, Vec<_>) =
            std::mem::take(&mut mechanism.parts).into_iter().partition(|part| is_part(&part.name));
        let named = |end: &Terminal| parts.iter().any(|part| part.name == end.name);
        let shown = remaining.iter().flat_map(|part| &part.terminals).any(named);
        mechanism.parts = remaining;
        if shown {
            mechanism.parts.extend(parts);
        }
    }

    /// Removes messages on the parts of an element that has an error itself: it is the same error.
    pub(super) fn leave_parts_out(&self, doubtful: &BTreeSet<String>, out: &mut Vec<Diagnostic>) {
        let is_composite = |one: &&Instance| element::is_composite(one.kind.keyword);
        // If a block of a part has an error, its other blocks are unknown.
        let at = |diagnostic: &Diagnostic| diagnostic.labels.first().map(|label| label.place.clone());
        for whole in self.elements.iter().filter(is_composite) {
            let here = |diagnostic: &Diagnostic| at(diagnostic).as_ref() == Some(&whole.place);
            if out.iter().any(|diagnostic| here(diagnostic) && diagnostic.code != "signal::not-a-time-function") {
                out.retain(|diagnostic| !here(diagnostic) || diagnostic.code != "signal::not-a-time-function");
            }
        }
        let wholes = self.elements.iter().filter(is_composite).filter(|whole| doubtful.contains(&whole.name));
        for Instance { kind, name, place, .. } in wholes {
            let own = format!("{} `{name}`", kind.keyword);
            out.retain(|diagnostic| {
                diagnostic.labels.first().is_none_or(|label| label.place != *place) || diagnostic.message.contains(&own)
            });
        }
    }
}
