//! Writes identified values into the text of the model file, and terms as laws of torques.

use crate::study::read::read_values::read_word;
use kardan_elements::manoeuvre::quoted;
use kardan_model::{Document, NewValue};
use kardan_results::signal_name;
use kardan_results::{FileContent, FileLaw, FileTerm, FileValue, Identification};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::file::syntax;
use kardan_schema::schema::{Scalar, Table};

use super::entry_removal::remove_entry;
use super::extra::kind_of_parameter;
use super::request::request;
use super::settings::IdentifySettings;

/// The text of the model file with the identified values, and those that it cannot contain, with the reason. Accepted suggested terms are
/// in it too: those that a law of a torque can express as `[torque.NAME]` with parameters of their own, others as `[[identification.extra]]`.
///
/// # Errors
/// Errors of the file, or those that the identified values would cause.
pub fn write_values(source: &str, found: &Identification) -> Result<(String, Vec<String>), Vec<Diagnostic>> {
    let suggested = found.suggestions.as_ref().filter(|suggestions| !suggestions.selected_terms.is_empty());
    let FileContent { values, terms, entries, omissions: not } =
        suggested.map_or(&found.for_file, |suggestions| &suggestions.for_file);
    let mut text = source.to_string();
    let mut new: Vec<FileValue> = values.clone();
    let mut unremoved_entries: Vec<String> = Vec::new();
    for term in terms {
        let (document, _) = kardan_model::read(&text);
        let Some(law) = TermEdit::new(&document, term) else { continue };
        new.extend(law.values.iter().cloned());
        let unremoved;
        (text, unremoved) = law.put(&text, &document, term);
        unremoved_entries.extend(unremoved);
    }
    for (term, entry) in entries {
        let (document, _) = kardan_model::read(&text);
        text = with_names(&text, &document, &[], std::slice::from_ref(term)) + "\n" + entry;
    }
    let values = new.iter().map(|one| NewValue {
        name: one.name.clone(),
        value: one.value,
        interval: one.interval.map(|it| (it.lower, it.upper)),
        confidence: found.confidence,
    });
    let before = diagnostics(source);
    let refused = |new: Vec<Diagnostic>| -> Vec<Diagnostic> {
        let refused = |one: Diagnostic| {
            let message = format!("the identified values would make the file invalid: {}", one.message);
            // Its positions refer to a text that the user does not have.
            Diagnostic { message, labels: Vec::new(), ..one }
        };
        new.into_iter()
            .filter(|one| before.iter().all(|candidate| candidate.message != one.message))
            .map(refused)
            .collect()
    };
    let (text, mut omissions) =
        kardan_model::write_values(&text, &values.collect::<Vec<_>>()).map_err(|diagnostics| {
            let new = refused(diagnostics.clone());
            if new.is_empty() { diagnostics } else { new }
        })?;
    let new = refused(diagnostics(&text));
    if !new.is_empty() {
        return Err(new);
    }
    omissions.extend(unremoved_entries);
    omissions.extend(not.iter().cloned());
    Ok((text, omissions))
}

/// Errors of a file read for an identification: of the model, and of the requested names.
fn diagnostics(text: &str) -> Vec<Diagnostic> {
    let (document, mut out) = kardan_model::read(text);
    out.retain(Diagnostic::is_error);
    if !out.is_empty() {
        return out;
    }
    let set = document.variant_settings().into_iter().next().map(|one| one.settings).unwrap_or_default();
    let (model, diagnostics) = document.model_with(&set, Some(&[]));
    out.extend(diagnostics);
    request(&document, &model, &set, &IdentifySettings::default(), &mut out);
    // A file need not request any parameter.
    out.retain(|one| one.is_error() && one.code != "identify::no-parameters");
    out
}

/// A term as a law of a torque, and the parameters that it has.
struct TermEdit {
    values: Vec<FileValue>,
    parameters: String,
    torque: String,
}

impl TermEdit {
    /// `None` if the element has no direction that a `torque` can have.
    fn new(document: &Document, term: &FileTerm) -> Option<Self> {
        let instance = document.elements.get(&term.element)?;
        let ends: Vec<&str> = match instance.kind.keyword {
            "spring_damper" => {
                ["shaft_1", "shaft_2"].into_iter().filter_map(|key| read_word(&instance.table, key)).collect()
            }
            _ => vec![&instance.name],
        };
        let straight = |name: &str| {
            document.elements.iter().any(|candidate| candidate.name == name && candidate.kind.keyword == "mass")
        };
        let own: Vec<&str> = ends.iter().copied().filter(|name| *name != "ground").collect();
        let motion = |of: &[signal_name::Quantity; 2]| {
            let one = |name: &&str| quoted(&of[usize::from(straight(name))].of(name));
            match own.as_slice() {
                [one_end] => one(one_end),
                [a, b] => format!("({} - {})", one(a), one(b)),
                _ => String::new(),
            }
        };
        let (angle, speed) = (
            motion(&[signal_name::Quantity::Angle, signal_name::Quantity::Position]),
            motion(&[signal_name::Quantity::Speed, signal_name::Quantity::Velocity]),
        );
        let is_used =
            |name: &str| document.parameters.has(name) || document.elements.has(name) || document.signals.has(name);
        let free = |name: &str| {
            let plain = name.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
            let numbered = (2..).map(|k| format!("{plain}_{k}"));
            std::iter::once(plain.clone()).chain(numbered).find(|name| !is_used(name)).expect("numbers do not end")
        };
        let values: Vec<FileValue> =
            term.coefficients.iter().map(|one| FileValue { name: free(&one.name), ..one.clone() }).collect();
        let [a, b] = [0, 1].map(|k| values.get(k).map_or("", |one| one.name.as_str()));
        let law = match &term.law {
            FileLaw::FrictionAsymmetry => format!("-{a}"),
            FileLaw::DampingAsymmetry => format!("-{a} * abs({speed})"),
            FileLaw::Quadratic => format!("-{a} * {speed} * abs({speed})"),
            FileLaw::Cogging(order) => format!("-{a} * cos({order} * {angle}) - {b} * sin({order} * {angle})"),
        };
        let on = match ends.as_slice() {
            // Along the second body only, with the opposite sign.
            ["ground", b] => format!("coefficients = {{ {b} = -1 }}\n"),
            [a] | [a, "ground"] => format!("shaft = \"{a}\"\n"),
            [a, b] => format!("shaft = \"{a}\"\nreaction = \"{b}\"\n"),
            _ => return None,
        };
        let parameters =
            values.iter().map(|one| format!("{} = \"{:?} {}\"\n", one.name, one.value, term.unit)).collect();
        let name = free(&format!("{} law", term.term));
        Some(Self { parameters, torque: format!("[torque.{name}]\n{on}law = \"{law}\"\n"), values })
    }

    /// The text of a model file with it, in place of its term; and a warning if that term remains.
    fn put(&self, text: &str, document: &Document, term: &FileTerm) -> (String, Option<String>) {
        let names: Vec<String> = self.values.iter().map(|one| one.name.clone()).collect();
        let mut own: Vec<String> = vec![term.term.clone()];
        own.extend(term.coefficients.iter().map(|one| one.name.clone()));
        let mut out = with_names(text, document, &own, &names);
        let mut warning = None;
        // Positions in the text after the names have changed.
        let (document, _) = kardan_model::read(&out);
        if let Some(entry) = entry(&document, term) {
            match remove_entry(&out, ["identification", "extra"], entry) {
                Some(text) => out = text,
                None => {
                    warning = Some(format!(
                        "{}: it is now a law of a torque, and kardan cannot separate its entry of `extra` in `[identification]` from the text \
                         around it: remove it before you identify again",
                        term.term
                    ));
                }
            }
        }
        if !out.is_empty() && !out.ends_with('\n') {
            out.push('\n');
        }
        match parameters(&out) {
            Some(place) => out.insert_str(place, &self.parameters),
            None => out += &format!("\n[parameters]\n{}", self.parameters),
        }
        (out + "\n" + &self.torque, warning)
    }
}

/// The start of the line below `[parameters]`.
fn parameters(text: &str) -> Option<usize> {
    let (entries, _) = syntax(text);
    let place = entries.keyed("parameters")?.entry.place.span();
    let header = text[place.clone()].starts_with('[');
    header.then(|| text[place.end..].find('\n').map_or(text.len(), |end| place.end + end + 1))
}

/// Where the header of the entry of a term begins.
fn entry(document: &Document, term: &FileTerm) -> Option<usize> {
    let has_order = |table: &Table| {
        let FileLaw::Cogging(order) = term.law else { return true };
        let scalar = table.scalar_or_default("order", &table.place).map(|scalar| scalar.value);
        matches!(scalar, Some(Scalar::Literal(value, _)) if value.to_f64() == order)
    };
    let (kind, _) = kind_of_parameter(term.term.strip_prefix(&term.element)?.strip_prefix('.')?)?;
    let own = |table: &&Table| {
        read_word(table, "kind") == Some(kind)
            && read_word(table, "friction") == Some(&term.element)
            && has_order(table)
    };
    document.identification.tables("extra").iter().find(own).map(|table| table.place.span().start)
}

/// The text with some requested names replaced by others, where the file lists them; new ones come last.
fn with_names(text: &str, document: &Document, old: &[String], new: &[String]) -> String {
    let table = &document.identification;
    let Some(entry) = table.values.get("parameters") else { return text.to_string() };
    let mut retained: Vec<String> = table.plain_names("parameters");
    let replaces = retained.iter().any(|name| old.contains(name)) || old.is_empty();
    retained.retain(|name| !old.contains(name));
    if replaces {
        retained.extend(new.iter().filter(|name| !retained.contains(name)).cloned().collect::<Vec<_>>());
    }
    let listed: Vec<String> = retained.iter().map(|name| format!("\"{name}\"")).collect();
    let mut out = text.to_string();
    out.replace_range(entry.place.span(), &format!("[{}]", listed.join(", ")));
    out
}

#[cfg(test)]
#[path = "../../../tests/unit/study/identification/write_values.rs"]
mod tests;
