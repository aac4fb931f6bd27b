//! Functions of time of a scenario that are added to the sources.

use std::collections::HashSet;

use super::events::{not_settable, settable};
use super::locations::places_in_control;
use kardan_elements::manoeuvre::quoted;
use kardan_expr::expr::OfTime;
use kardan_math::units::Expression;
use kardan_model::{ControlSpec, Document, Functions, Model, TableReader};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::schema::Scalar;
use kardan_simulate::{Source, SourceSignal, SourceTarget};

/// The sources that `signals` of `[scenario]` adds, and signals that laws name as references; every signal is checked, also one that nothing names.
pub(in crate::study) fn source_signals(
    reader: &TableReader<'_>,
    (document, model): (&Document, &Model),
    sources: &[Source],
    (duration, seed): (f64, u64),
    out: &mut Vec<Diagnostic>,
) -> Vec<SourceSignal> {
    let explicit = document.scenario.map("signals").unwrap_or_default();
    if explicit.is_empty() && document.signals.is_empty() {
        return Vec::new();
    }
    let mut making = Functions::new(reader, document, (duration, seed));
    for signal in document.signals.iter().filter(|signal| signal.formula.is_none()) {
        making.signal(&signal.name, out);
    }
    let mut found: Vec<SourceSignal> = Vec::new();
    let explicit_names: HashSet<&str> = explicit.iter().map(|(name, _)| name.value.as_str()).collect();
    for (k, source) in sources.iter().enumerate() {
        if source.target == SourceTarget::Reference && !explicit_names.contains(source.name.as_str()) {
            let function = of_reference((document, model), source, &mut making, out);
            found.extend(function.map(|function| SourceSignal { source: k, function }));
        }
    }
    for (name, scalar) in explicit {
        let what = format!("`{}` in `signals` of `[scenario]`", shortened(&name.value));
        let Some(source) = settable(sources, &name.value) else {
            let nouns = ["a function of time", "functions of time"];
            if let Some((message, help)) = not_settable(&name.value, sources, (document, model), nouns) {
                let message = format!("`signals` of `[scenario]`: {message}");
                out.push(Diagnostic::error("name::unknown", message).at(&name.place, "not settable").help(help));
            }
            continue;
        };
        let Scalar::Expression(expression) = &scalar.value else { continue };
        let expected = sources[source].physical.dimension();
        let function = making.function(expression, expected, (&scalar.place, &what), out);
        found.extend(function.map(|function| SourceSignal { source, function }));
    }
    found
}

/// The function of time of a signal that has the name of a reference: the reference follows it. A formula of moving quantities acts
/// like a block, unless it reads sampled signals, which is reported.
fn of_reference(
    (document, model): (&Document, &Model),
    source: &Source,
    making: &mut Functions<'_, '_>,
    out: &mut Vec<Diagnostic>,
) -> Option<OfTime> {
    let signal = document.signals.get(&source.name)?;
    let names = |control: &&ControlSpec| {
        control.law.all_references(&control.values).iter().any(|reference| reference.name == source.name)
    };
    let control = model.controls.iter().chain(&model.idle).find(names)?;
    let places = places_in_control(document, control, &source.name);
    let place = &places[places.len() - 1];
    let shown = shortened(&source.name);
    let what = format!("control `{}`: the signal `{shown}`, which is its reference", control.name);
    if let Some(formula) = &signal.formula {
        let sensor = |name: &&str| {
            let head = SignalName::new(name).element;
            let is_sensor = document.elements.iter().any(|one| one.name == head && one.kind.keyword == "sensor");
            is_sensor && !document.reads_at_every_instant(head)
        };
        let read = formula.value.names().into_iter().find(sensor)?;
        let message = format!("{what}, reads `{read}`, which needs samples: it has no value at every instant");
        let help = format!(
            "write a block in its place, which has a sample time: `[block.{shown}]` with kind = \"hold\" and the expression as `input`"
        );
        out.push(Diagnostic::error("reference::sampled", message).at(place, "this reference").help(help));
        return None;
    }
    let expression = Expression::parse_law(&quoted(&source.name)).ok()?;
    making.function(&expression, source.physical.dimension(), (place, &what), out)
}
