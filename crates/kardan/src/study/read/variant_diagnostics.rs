//! Diagnostics of several variants without repetition.

use std::collections::HashSet;

use kardan_schema::diagnostics::Diagnostic;

/// All diagnostics of a request, if one of them is an error.
pub(in crate::study) fn without_errors(diagnostics: &[Diagnostic]) -> Result<(), Vec<Diagnostic>> {
    if diagnostics.iter().any(Diagnostic::is_error) { Err(diagnostics.to_vec()) } else { Ok(()) }
}

/// The same error of several variants is reported once; an error that the first variant does not have names its variant.
pub(in crate::study) fn add_new(out: &mut Vec<Diagnostic>, found: Vec<Diagnostic>, later_variant: Option<&String>) {
    // A set instead of a linear search for each: the time of thousands of errors grows linearly.
    let key = |d: &Diagnostic| {
        let places: Vec<_> = d.labels.iter().map(|label| (label.place.clone(), label.text.clone())).collect();
        (d.code, places, later_variant.is_none().then(|| d.message.clone()))
    };
    let mut reported: HashSet<_> = out.iter().map(key).collect();
    for mut diagnostic in found {
        if !reported.insert(key(&diagnostic)) {
            continue;
        }
        if let Some(variant) = later_variant {
            diagnostic.message += &format!(" (variant `{variant}`)");
        }
        out.push(diagnostic);
    }
}
