//! Varied parameters that occur in laws only: these laws are redesigned for each sample.

use crate::study::requests::varied::Varied;
use kardan_schema::diagnostics::quoted;
use kardan_schema::entries::{Entries, RawValue};
use kardan_schema::schema::LawKeys;
use kardan_synthesis::Program;

/// The notes about them.
pub(super) fn designed_anew(spread: &[Varied]) -> impl Iterator<Item = String> {
    spread.iter().filter(|varied| !varied.laws.is_empty()).map(|varied| {
        format!(
            "`{}` occurs in laws only ({}): kardan redesigns them for each sample, with its value and otherwise the values in the file.",
            varied.name,
            quoted(varied.laws.iter().map(String::as_str))
        )
    })
}

/// The laws that name a parameter or one computed from it, if nothing else does.
pub(super) fn laws_of(entries: &Entries, name: &str) -> Option<Vec<String>> {
    let mut names = vec![name.to_string()];
    let parameters = entries.table("parameters")?;
    parameters.get(name)?;
    while let Some(more) = parameters.iter().find(|one| !names.contains(&one.key) && mentions(&one.entry.value, &names))
    {
        names.push(more.key.clone());
    }
    let mut laws = Vec::new();
    for group in entries.iter() {
        match (group.key.as_str(), &group.entry.value) {
            ("model" | "parameters" | "sweep", _) => {}
            ("control", RawValue::Table(controls)) => {
                for control in controls.iter().filter(|control| mentions(&control.entry.value, &names)) {
                    // Programs use the values of each sample.
                    if let RawValue::Table(keys) = &control.entry.value
                        && matches!(keys.get("law"), Some(RawValue::Text(law)) if law == Program::KEYWORD)
                    {
                        return None;
                    }
                    laws.push(format!("control.{}", control.key));
                }
            }
            (_, value) if mentions(value, &names) => return None,
            _ => {}
        }
    }
    (!laws.is_empty()).then_some(laws)
}

/// Whether one of the names occurs in a value as a word; conservative.
fn mentions(value: &RawValue, names: &[String]) -> bool {
    let part = |c: char| c.is_alphanumeric() || c == '_';
    let contains_word = |text: &str, name: &String| {
        text.match_indices(name.as_str()).any(|(at, _)| {
            let (before, behind) = (text[..at].chars().next_back(), text[at + name.len()..].chars().next());
            !before.is_some_and(part) && !behind.is_some_and(part)
        })
    };
    match value {
        RawValue::Text(text) => names.iter().any(|name| contains_word(text, name)),
        RawValue::List(list) => list.iter().any(|entry| mentions(&entry.value, names)),
        RawValue::Table(table) => table.iter().any(|one| mentions(&one.entry.value, names)),
        RawValue::Number(_) | RawValue::Quantity(..) | RawValue::Other(..) | RawValue::Broken => false,
    }
}
