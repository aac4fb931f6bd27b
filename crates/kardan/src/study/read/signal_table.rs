//! The signals of a study, and errors of unknown signal names.

use std::collections::BTreeSet;

use kardan_model::Document;
use kardan_results::Physical;
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::entries::Place;

/// The signals of a study, for checks of names.
pub(in crate::study) struct SignalContext<'a> {
    pub(in crate::study) document: &'a Document,
    pub(in crate::study) signals: Vec<(String, Physical)>,
    /// Elements whose signals may be incomplete.
    pub(in crate::study) doubtful: BTreeSet<String>,
}

impl SignalContext<'_> {
    /// Whether an unknown signal may exist once the reported errors are corrected.
    pub(in crate::study) fn may_have(&self, signal: &str) -> bool {
        let suppressed = &self.document.suppressed;
        let name = SignalName::new(signal);
        let (head, quantity) = (name.element, name.quantity().filter(|_| name.on.is_none()));
        if name.word.is_none() && (suppressed.references || self.document.introduces(signal)) || suppressed.all {
            return true;
        }
        // The outputs of a block are unknown while another one has an error.
        if self.document.moves(signal) || self.document.moves(head) {
            return true;
        }
        let doubted = |name: &str| suppressed.has(name) || self.doubtful.contains(name);
        let doubtful = doubted(head);
        // A doubtful branch may name any node.
        let mut branches = self.document.elements.iter().filter(|e| e.kind.node_keys().next().is_some());
        if name.is(Quantity::Voltage) && name.on.is_none() && branches.any(|e| doubted(&e.name)) {
            return true;
        }
        let kind = self.document.elements.get(head).map(|e| e.kind.keyword);
        doubtful
            && match kind {
                Some("shaft" | "mass") => quantity == Some(Quantity::Friction),
                Some("motor") => matches!(quantity, Some(Quantity::Torque | Quantity::Force | Quantity::Command)),
                _ => true,
            }
    }
}

/// The physical kind of a signal; an unknown name is reported.
pub(in crate::study) fn signal_kind(
    name: &str,
    place: &Place,
    context: &SignalContext<'_>,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<Physical> {
    if let Some((_, physical)) = context.signals.iter().find(|(candidate, _)| candidate == name) {
        return Some(*physical);
    }
    if context.may_have(name) {
        return None;
    }
    let names = || context.signals.iter().map(|(name, _)| name.as_str());
    let head = SignalName::new(name).element;
    let of_head = || names().filter(|candidate| SignalName::new(candidate).element == head);
    let help = match nearest(name, of_head()).or_else(|| nearest(name, names())) {
        Some(near) => format!("did you mean `{near}`?"),
        None if of_head().next().is_some() => format!("`{}` has {}", shortened(head), quoted(of_head())),
        None if context.signals.is_empty() => "the model has no signals".to_string(),
        None => format!("there are {}", quoted(names())),
    };
    out.push(Diagnostic::no_such(what, "signal", name, place).help(help));
    None
}
