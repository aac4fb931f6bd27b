//! Whether a table is about masses or about shafts.

use super::Node;
use crate::entries::{Entries, Written};
use crate::schema::{Field, Kind};

/// Whether an element acts along masses: the first body that it names is one, or, where it names an element and no shaft, one of that.
pub(super) fn moves_along(fields: &[Field], node: &Node<'_>) -> bool {
    let Some(model) = node.known.model else { return false };
    let word = |field: &Field| {
        let alias = field.alias();
        let keyed = node.table.keyed(field.name).or_else(|| node.table.keyed(alias.as_deref()?));
        if let Written::Text(text) = &keyed?.entry.value { Some(text.as_str()) } else { None }
    };
    let bodies = fields.iter().filter(|field| field.kind == Kind::Body);
    let named = bodies.filter_map(word).find(|name| is_in(model, "mass", name) || is_in(model, "shaft", name));
    if let Some(name) = named {
        return is_in(model, "mass", name);
    }
    if fields.iter().any(|field| field.kind == Kind::Shaft && word(field).is_some()) {
        return false;
    }
    let elements = fields.iter().filter_map(|field| match field.kind {
        Kind::Element(kinds) => Some((kinds, word(field)?)),
        _ => None,
    });
    elements.into_iter().any(|(kinds, name)| {
        let named = kinds.iter().find_map(|kind| as_table(model, kind)?.get(name));
        let Some(Written::Table(element)) = named else { return false };
        element.iter().any(|keyed| matches!(&keyed.entry.value, Written::Text(text) if is_in(model, "mass", text)))
    })
}

fn as_table<'t>(model: &'t Entries, group: &str) -> Option<&'t Entries> {
    if let Written::Table(table) = model.get(group)? { Some(table) } else { None }
}

fn is_in(model: &Entries, group: &str, name: &str) -> bool {
    as_table(model, group).is_some_and(|table| table.get(name).is_some())
}
