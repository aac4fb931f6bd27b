//! Runs that begin at an equilibrium or at the operating point of their controllers.

use std::sync::Arc;

use crate::study::check::equilibrium::{Rest, format_position};
use crate::study::check::multiplier_constraints::prescribed_note;
use crate::study::read::read_values::{key_error, read_word};
use kardan_mechanics::reduce::{OperatingPoint, Reduced};
use kardan_model::Document;
use kardan_schema::diagnostics::Diagnostic;
use kardan_simulate::{Scenario, SignalEvent};
use kardan_synthesis::Law;

/// Equilibrium currents flow from the first instant on if no inductance of their own limits them; other speeds are those of `initial`.
fn begin_currents(reduced: &Reduced, scenario: &mut Scenario, rates: &[f64]) {
    let follows = |k: usize| reduced.massless.iter().any(|massless| massless.states().any(|state| state == k));
    let flowing = scenario.speed.iter_mut().zip(rates).enumerate();
    let flowing = flowing.filter(|(k, (_, rate))| **rate != 0.0 && !follows(*k));
    flowing.for_each(|(_, (speed, rate))| *speed = *rate);
}

/// Starts a run at an equilibrium on request; notes which one.
pub(super) fn start_at_rest(
    document: &Document,
    (reduced, point): (&Reduced, Option<&OperatingPoint>),
    scenario: &mut Scenario,
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let start = read_word(&document.scenario, "start");
    if start == Some("operating_point") {
        let Some(point) = point else {
            return vec!["without controllers there is no operating point: the run begins at `initial`".into()];
        };
        let has_angles = scenario.position.iter().any(|angle| *angle != 0.0);
        let instead = if has_angles { ", in place of the angles of `initial`" } else { "" };
        scenario.position.clone_from(&point.position);
        begin_currents(reduced, scenario, &point.rates);
        return vec![format!(
            "the run begins at the operating point of its controllers{instead}: {}",
            format_position(reduced, &point.position)
        )];
    }
    if start != Some("equilibrium") {
        return Vec::new();
    }
    let slips = reduced.massless.iter().any(|massless| !massless.slips.is_empty());
    let rest = match slips {
        true => {
            Err("friction balances motions without inertia, and kardan searches no equilibrium without friction".into())
        }
        false => Rest::near(reduced, &scenario.position),
    };
    match rest {
        Ok(Rest { equilibrium, found, more, .. }) => {
            scenario.position = equilibrium.position;
            begin_currents(reduced, scenario, &equilibrium.rates);
            let more = more.into_iter().map(|more| more.replace("CHOICE", "`initial` of `[scenario]`"));
            std::iter::once(format!("the run begins at {found}")).chain(more).chain(prescribed_note(reduced)).collect()
        }
        Err(message) => {
            let message = format!("`start` of `[scenario]`: {message}");
            let help = "give the initial angles by `initial`, or add an element that supports the model";
            let at = (&document.scenario, "start", "no equilibrium");
            out.push(key_error("scenario::equilibrium", message, at, help));
            Vec::new()
        }
    }
}

/// In a run that begins at the operating point, references begin at their equilibrium values, unless the scenario sets them then; notes which ones.
pub(super) fn references_at_rest(
    document: &Document,
    implemented: &[Arc<dyn Law>],
    scenario: &mut Scenario,
) -> Option<String> {
    read_word(&document.scenario, "start").filter(|start| *start == "operating_point")?;
    let mut begin = Vec::new();
    for law in implemented {
        for (reference, rest) in law.references().iter().zip(law.references_at_rest()) {
            let Some(source) = scenario.sources.iter().position(|source| source.name == reference.name) else {
                continue;
            };
            let is_set = scenario.events.iter().any(|event| event.source == source && event.at <= 0.0)
                || scenario.signals.iter().any(|signal| signal.source == source);
            if rest != 0.0 && !is_set {
                scenario.events.insert(0, SignalEvent { source, at: 0.0, to: rest, over: 0.0 });
                begin.push(format!("`{}` at {rest:.6} {}", reference.name, reference.physical.unit()));
            }
        }
    }
    (!begin.is_empty()).then(|| format!("references begin at their equilibrium values: {}", begin.join(", ")))
}
