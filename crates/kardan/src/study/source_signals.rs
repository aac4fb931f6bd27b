//! Functions of time of a scenario: what of them is added to sources.

use super::events::not_settable;
use super::read::physical_dimension;
use crate::diagnostics::{Diagnostic, shortened};
use crate::model::{Document, Functions, Model, TableReader};
use crate::schema::{Scalar, Value};
use crate::simulate::{Source, SourceSignal, SourceTarget};

/// What `signals` of `[scenario]` adds to sources; every signal is checked, also one that nothing names.
pub(super) fn source_signals(
    reader: &TableReader<'_>,
    (document, model): (&Document, &Model),
    sources: &[Source],
    (duration, seed): (f64, u64),
    out: &mut Vec<Diagnostic>,
) -> Vec<SourceSignal> {
    let given = match document.scenario.values.get("signals").map(|found| &found.value) {
        Some(Value::Map(given)) => given.as_slice(),
        _ => &[],
    };
    if given.is_empty() && document.signals.is_empty() {
        return Vec::new();
    }
    let mut making = Functions::new(reader, document, (duration, seed));
    for signal in document.signals.iter().filter(|signal| document.program_of(signal).is_none()) {
        making.signal(&signal.name, out);
    }
    let mut found: Vec<SourceSignal> = Vec::new();
    for (name, scalar) in given {
        let what = format!("`{}` in `signals` of `[scenario]`", shortened(&name.value));
        let Some(source) =
            sources.iter().position(|source| source.name == name.value && source.target != SourceTarget::Block)
        else {
            let words = ["a function of time", "functions of time"];
            if let Some((message, help)) = not_settable(&name.value, sources, (document, model), words) {
                let message = format!("`signals` of `[scenario]`: {message}");
                let mistake = Diagnostic::error("name::unknown", message).at(name.place.clone(), "not settable");
                out.push(mistake.help(help));
            }
            continue;
        };
        let Scalar::Expression(expression) = &scalar.value else { continue };
        let wanted = physical_dimension(sources[source].physical);
        let function = making.function(expression, wanted, (&scalar.place, &what), out);
        found.extend(function.map(|function| SourceSignal { source, function }));
    }
    found
}
