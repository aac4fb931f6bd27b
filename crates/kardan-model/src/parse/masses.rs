//! Whether a table is about masses or about shafts.

use super::Node;
use kardan_schema::entries::{Entries, RawValue};
use kardan_schema::schema::{Field, Kind};

/// An unknown key, and the intended key of a body.
pub(super) struct MisnamedBody<'a> {
    pub(super) key: &'a str,
    pub(super) field: &'a Field,
    /// Its name for a body of this kind.
    pub(super) called: String,
    body: &'a str,
}

/// Unknown keys that name a body, such as `mass` or `shaft1`, each with a remaining key of a body: the one with its number, or the first one.
pub(super) fn misnamed_bodies<'a>(fields: &'a [Field], node: &'a Node<'_>) -> Vec<MisnamedBody<'a>> {
    let Some(model) = node.hints.model else { return Vec::new() };
    let is_key = |field: &Field, key: &str| field.name == key || field.alias().is_some_and(|alias| alias == key);
    let is_present = |field: &&Field| node.table.iter().any(|keyed| is_key(field, &keyed.key));
    let mut free_fields: Vec<&Field> = fields
        .iter()
        .filter(|field| field.kind == Kind::Body && field.alias().is_some() && !is_present(field))
        .collect();
    let mut out = Vec::new();
    for keyed in node.table.iter().filter(|keyed| !fields.iter().any(|field| is_key(field, &keyed.key))) {
        let Some(body) = keyed.entry.value.as_text() else { continue };
        let Some(rest) = ["mass", "shaft", "body"].iter().find_map(|word| keyed.key.strip_prefix(word)) else {
            continue;
        };
        let number = rest.trim_start_matches('_');
        let mass = is_in(model, "mass", body);
        if !(mass || is_in(model, "shaft", body)) || !number.chars().all(|c| c.is_ascii_digit()) {
            continue;
        }
        let numbered = free_fields.iter().position(|field| !number.is_empty() && field.name.ends_with(number));
        let place = numbered.unwrap_or(0);
        if place < free_fields.len() {
            let field = free_fields.remove(place);
            let called = field.alias().filter(|_| mass).unwrap_or_else(|| field.name.to_string());
            out.push(MisnamedBody { key: &keyed.key, field, called, body });
        }
    }
    out
}

/// Whether an element acts on masses: the first body that it names is one, or, if it names an element and no shaft, one of that; `None` if it names none.
pub(super) fn names_masses(fields: &[Field], node: &Node<'_>) -> Option<bool> {
    let model = node.hints.model?;
    let word = |field: &Field| {
        let alias = field.alias();
        node.table.get(field.name).or_else(|| node.table.get(alias.as_deref()?))?.as_text()
    };
    let bodies = fields.iter().filter(|field| field.kind == Kind::Body);
    let named = bodies.filter_map(word).find(|name| is_in(model, "mass", name) || is_in(model, "shaft", name));
    let misnamed = misnamed_bodies(fields, node);
    if let Some(name) = named.or_else(|| Some(misnamed.first()?.body)) {
        return Some(is_in(model, "mass", name));
    }
    if fields.iter().any(|field| field.kind == Kind::Shaft && word(field).is_some()) {
        return Some(false);
    }
    let elements = fields.iter().filter_map(|field| match field.kind {
        Kind::Element(kinds) => Some((kinds, word(field)?)),
        _ => None,
    });
    let of_element = |(kinds, name): (&[&str], &str)| {
        let named = kinds.iter().find_map(|kind| model.table(kind)?.get(name));
        let Some(element) = named.and_then(RawValue::as_table) else { return false };
        element.iter().filter_map(|keyed| keyed.entry.value.as_text()).any(|text| is_in(model, "mass", text))
    };
    let mut elements = elements.peekable();
    elements.peek()?;
    Some(elements.any(of_element))
}

fn is_in(model: &Entries, group: &str, name: &str) -> bool {
    model.table(group).is_some_and(|table| table.get(name).is_some())
}
