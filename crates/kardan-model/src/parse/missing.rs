//! The suggestion for a missing key: the value of its example, with names of this model.

use super::node::HintSource;
use super::wording::{example, expected};
use kardan_schema::entries::Entries;
use kardan_schema::schema::{Field, Kind};

/// The suggestion for a missing key. `used` are the shafts already in the table, or proposed for it.
pub(super) fn missing(field: &Field, hints: HintSource<'_>, used: &mut Vec<String>) -> String {
    let value = own(&field.kind, hints, used)
        .or_else(|| with_own_names(example_value(hints.example, field.name)?, hints))
        .unwrap_or_else(|| example(&field.kind));
    let choices = match field.kind {
        Kind::Choice(choices) if choices.len() > 1 => format!(" It is {}.", expected(&field.kind)),
        _ => String::new(),
    };
    format!("add `{} = {value}`: {}{choices}", field.name, field.doc)
}

/// The shafts that a table names.
pub(super) fn own_shafts(table: &Entries) -> Vec<String> {
    table.iter().filter_map(|keyed| keyed.entry.value.as_text()).map(str::to_string).collect()
}

/// Names of the model for a key that takes names.
fn own(kind: &Kind, hints: HintSource<'_>, used: &mut Vec<String>) -> Option<String> {
    let mut shafts = |count: usize| {
        let free = names(hints, "shaft").filter(|shaft| !used.iter().any(|candidate| candidate == shaft));
        let found: Vec<String> = free.take(count).map(str::to_string).collect();
        used.extend(found.iter().cloned());
        (found.len() == count).then_some(found)
    };
    let list = |names: Vec<String>| {
        format!("[{}]", names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", "))
    };
    let element = |kinds: &[&str]| kinds.iter().find_map(|kind| names(hints, kind).next());
    match kind {
        Kind::Shaft | Kind::Body => Some(format!("{:?}", shafts(1)?.first()?)),
        Kind::Shafts(count) => shafts((*count).max(1)).map(list),
        Kind::Element(kinds) => element(kinds).map(|name| format!("{name:?}")),
        Kind::Elements(kinds) => element(kinds).map(|name| format!("[{name:?}]")),
        _ => None,
    }
}

/// The value of a key in an example of its table.
fn example_value(example: &'static str, key: &str) -> Option<&'static str> {
    example.lines().find_map(|line| Some(line.strip_prefix(key)?.trim_start().strip_prefix('=')?.trim()))
}

/// The value of an example with the signals of the model: angles of its first shaft, torques of its first motor. Nothing where the
/// model has no such part.
fn with_own_names(value: &'static str, hints: HintSource<'_>) -> Option<String> {
    if hints.model.is_none() {
        return Some(value.into());
    }
    let mut out = String::new();
    for (k, part) in value.split('"').enumerate() {
        let name = match part.rsplit_once('.') {
            _ if k % 2 == 0 => None,
            Some((_, "tau")) => Some(format!("{}.tau", names(hints, "motor").next()?)),
            Some((_, word @ ("phi" | "w"))) => Some(format!("{}.{word}", names(hints, "shaft").next()?)),
            _ => None,
        };
        out += if k == 0 { "" } else { "\"" };
        out += name.as_deref().unwrap_or(part);
    }
    Some(out)
}

/// The names of the elements of a kind, in the order of the file.
fn names<'t>(hints: HintSource<'t>, kind: &str) -> impl Iterator<Item = &'t str> {
    let table = hints.model.and_then(|model| model.table(kind));
    table.into_iter().flat_map(|table| table.iter().map(|keyed| keyed.key.as_str()))
}
