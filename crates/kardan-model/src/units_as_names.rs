//! Names that are also symbols of units: behind a quantity, as in `3 N m/s*h`, they are units.

use std::ops::Range;

use super::document::Document;
use kardan_math::units::{Dimension, parse_quantity};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::{Entries, Place, RawValue};

/// Warns where a name of the model is read as a unit of the same dimension: units of others change the dimension of the whole, which is reported.
pub(super) fn warn_of_units(entries: &Entries, document: &Document, out: &mut Vec<Diagnostic>) {
    let parameters = document.parameters.iter();
    let parameters = parameters.map(|one| (one.name.as_str(), "parameter", Some(one.dimension)));
    let signals = document.signals.iter().map(|signal| (signal.name.as_str(), "signal", None));
    let blocks = document.blocks.iter().map(|block| (block.name.as_str(), "block", None));
    let is_unit = |(name, _, own): &(&str, &str, Option<Dimension>)| {
        let unit = parse_quantity(&format!("1 {name}")).ok();
        unit.is_some_and(|(_, dimension)| own.is_none_or(|own| own == dimension))
    };
    let units: Vec<_> = parameters.chain(signals).chain(blocks).filter(is_unit).collect();
    if units.is_empty() {
        return;
    }
    let mut check = |text: &str, place: &Place| {
        for (name, kind, _) in &units {
            let Some(part) = unit_behind_quantity(text, name) else { continue };
            let message = format!("`{name}` is a unit behind a quantity, and the model has a {kind} `{name}`");
            let help = format!(
                "write it with spaces around the sign, `* {name}`, or before the quantity; or rename the {kind}"
            );
            let diagnostic = Diagnostic::warning("unit::name", message).at(place.part(text, part), "read as a unit");
            out.push(diagnostic.help(help));
        }
    };
    for found in entries.iter() {
        each_placed_text(&found.entry.value, &found.entry.place, &mut check);
    }
}

/// Calls a function with each text within a value, and its place.
fn each_placed_text(value: &RawValue, place: &Place, visit: &mut impl FnMut(&str, &Place)) {
    match value {
        RawValue::Text(text) => visit(text, place),
        RawValue::Table(table) => {
            table.iter().for_each(|found| each_placed_text(&found.entry.value, &found.entry.place, visit));
        }
        RawValue::List(list) => list.iter().for_each(|entry| each_placed_text(&entry.value, &entry.place, visit)),
        _ => {}
    }
}

/// The first place where a name follows a quantity and its unit with a sign without spaces.
fn unit_behind_quantity(text: &str, name: &str) -> Option<Range<usize>> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(name).map(|(at, _)| at..at + name.len()).find(|part| {
        let goes_on = text[part.end..].starts_with(|c: char| is_part(c) || c == '(' || c == '.');
        let Some(front) = text[..part.start].strip_suffix(['*', '/']).filter(|_| !goes_on) else { return false };
        let starts = front.char_indices().filter(|(at, c)| c.is_ascii_digit() && !front[..*at].ends_with(is_part));
        let mut quantities = starts.map(|(at, _)| &front[at..]);
        let has_unit = |quantity: &str| quantity.contains(char::is_alphabetic) && quantity.parse::<f64>().is_err();
        quantities.any(|quantity| has_unit(quantity) && parse_quantity(quantity).is_ok())
    })
}
