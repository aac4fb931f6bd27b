//! The variants that a table of a study applies to.

use crate::study::read::locations::unknown_name_or;
use crate::study::read::signal_table::SignalContext;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::{Placed, Table};

/// Whether a list of variants contains one; an empty list stands for all of them.
pub(in crate::study) fn selects(variants: &[String], name: &str) -> bool {
    variants.is_empty() || variants.iter().any(|variant| variant == name)
}

pub(in crate::study) fn selected_variants(
    table: &Table,
    names: &[String],
    context: &SignalContext<'_>,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let chosen = table.names("variants").unwrap_or_default();
    let suppressed = &context.document.suppressed;
    let named = |word: &str| context.document.named_variants.iter().any(|variant| variant.name.value == word);
    let declared = |word: &str| names.iter().any(|name| name == word) || named(word);
    for word in chosen.iter().filter(|word| !declared(&word.value) && !suppressed.variants && !suppressed.all) {
        let declared = names.iter().map(String::as_str).filter(|name| !name.is_empty());
        let help = unknown_name_or(&word.value, declared, "the model has no `[variants]`; leave this key out");
        out.push(Diagnostic::no_such(what, "variant", &word.value, &word.place).help(help));
    }
    // A `[[variant]]` stands for its runs with all values of `[variants]`.
    let runs = |word: &Placed<String>| -> Vec<String> {
        let begins = |name: &str, of: &str| name.strip_prefix(of).is_some_and(|rest| rest.starts_with('_'));
        // `step_wet_v-10mps` is one of `step_wet`, not of `step`.
        let longer = |name: &str| {
            let variant_names = context.document.named_variants.iter().map(|variant| variant.name.value.as_str());
            variant_names
                .into_iter()
                .any(|candidate| begins(candidate, &word.value) && (begins(name, candidate) || name == candidate))
        };
        let own = |name: &&String| begins(name, &word.value) && !longer(name);
        match names.contains(&word.value) || !named(&word.value) {
            true => vec![word.value.clone()],
            false => names.iter().filter(own).cloned().collect(),
        }
    };
    chosen.iter().flat_map(runs).collect()
}
