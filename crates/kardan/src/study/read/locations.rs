//! The spans in a file that a diagnostic points at, and the help for unknown names.

use kardan_math::names::unknown_name;
use kardan_model::{ControlSpec, Document, occurrences};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::Value;

/// Largest number of spans for one diagnostic.
pub(in crate::study) const MOST_LABELS: usize = 8;

/// The span of an element's header; of a charge that of its element, of a node its first mention.
pub(in crate::study) fn place_of(document: &Document, name: &str) -> Place {
    let named = document.elements.get(name);
    match named.or_else(|| document.elements.iter().find(|e| e.kind.charges(&e.name).iter().any(|c| c == name))) {
        Some(element) => element.place.clone(),
        None => place_of_node(document, name),
    }
}

/// The first span where a branch names a node.
pub(in crate::study) fn place_of_node(document: &Document, node: &str) -> Place {
    let keys = document.elements.iter().flat_map(|e| e.kind.node_keys().filter_map(|key| e.table.values.get(key)));
    let named = keys.filter(|value| value.value == Value::Word(node.to_string())).map(|value| value.place.clone());
    named.min_by_key(Place::start).unwrap_or_default()
}

/// The span of a key's value of an element, of its header if the key is absent.
pub(in crate::study) fn place_of_value(document: &Document, element: &str, key: &str) -> Place {
    let element = document.elements.get(element);
    element.map(|e| e.table.values.get(key).map_or(&e.place, |value| &value.place).clone()).unwrap_or_default()
}

/// The spans of a word in a controller's table, of its header if the word is absent; at least one.
pub(in crate::study) fn places_in_control(document: &Document, control: &ControlSpec, word: &str) -> Vec<Place> {
    let table = document.controls.iter().find(|c| c.place == control.place).map(|c| &c.table);
    let places = table.map(|table| occurrences(table, word)).unwrap_or_default();
    if places.is_empty() { vec![control.place.clone()] } else { places }
}

/// The span of a key's value of a controller, of its header if the key is absent.
pub(in crate::study) fn place_in_control(document: &Document, control: &ControlSpec, key: &str) -> Place {
    let own = document.controls.iter().find(|own| own.place == control.place);
    own.map_or(&control.place, |own| own.table.place_of(key)).clone()
}

/// The help for an unknown name: the nearest one, or the existing ones; `none` if none exists.
pub(in crate::study) fn unknown_name_or<'a>(
    name: &str,
    existing: impl IntoIterator<Item = &'a str> + Clone,
    none: &str,
) -> String {
    match existing.clone().into_iter().next() {
        Some(_) => unknown_name(name, existing),
        None => none.to_string(),
    }
}

/// The error of a requested name that nothing has.
pub(in crate::study) fn no_such_name<'a>(
    (code, noun): (&'static str, &str),
    name: &str,
    existing: impl IntoIterator<Item = &'a str> + Clone,
    none: &str,
) -> Diagnostic {
    let message = format!("there is no {noun} `{}`", shortened(name));
    Diagnostic::error(code, message).help(unknown_name_or(name, existing, none))
}

/// The spans of the first of these elements, charges or nodes, in their order.
pub(in crate::study) fn first_places(document: &Document, names: impl IntoIterator<Item: AsRef<str>>) -> Vec<Place> {
    names.into_iter().take(MOST_LABELS).map(|name| place_of(document, name.as_ref())).collect()
}

/// The spans of elements, charges or nodes, each once, in the order of the file.
pub(in crate::study) fn all_places(document: &Document, names: impl IntoIterator<Item: AsRef<str>>) -> Vec<Place> {
    in_file_order(names.into_iter().map(|name| place_of(document, name.as_ref())).collect())
}

/// These spans, each once, in the order of the file.
pub(in crate::study) fn in_file_order(mut places: Vec<Place>) -> Vec<Place> {
    places.sort_by_key(Place::start);
    places.dedup();
    places.truncate(MOST_LABELS);
    places
}
