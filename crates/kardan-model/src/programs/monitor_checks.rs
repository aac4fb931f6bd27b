//! Checks of monitors, and of the transitions of state machines.

use std::collections::{BTreeMap, HashMap};

use crate::document::Instance;
use kardan_expr::expr::{Graph, Interval, Substitution, Symbol};
use kardan_math::num::Rational;
use kardan_schema::diagnostics::{Diagnostic, shortened};

use super::overlaps::Assumptions;
use super::{Blocks, Ordered, monitors, outside_name, overlaps};

impl Blocks<'_, '_, '_> {
    /// Known bounds of the outputs of monitors and machines.
    fn assumptions(&self, graph: &Graph) -> Assumptions {
        let symbol = |name: &str| self.outputs.get(name).and_then(|(expr, _)| graph.symbol_of(*expr));
        let mut assumptions = Assumptions::default();
        let mut one_of = |names: Vec<String>| {
            let symbols: Vec<Symbol> = names.iter().filter_map(|name| symbol(name)).collect();
            assumptions.not_negative(symbols.iter().copied());
            assumptions.bounded(&symbols, Rational::ONE);
        };
        for block in self.document.blocks.iter().filter(|block| block.kind.keyword == "monitor") {
            one_of(vec![block.name.clone()]);
        }
        for (name, states, _) in &self.machines {
            one_of(states.iter().map(|state| outside_name(name, state)).collect());
        }
        let counts = self.machines.iter().flat_map(|(name, ..)| [outside_name(name, "since"), outside_name(name, "")]);
        assumptions.not_negative(counts.filter_map(|name| symbol(&name)));
        assumptions
    }

    /// Warns of transitions that overlap, and of those that are never taken.
    pub(super) fn check_transitions(&self, out: &mut Vec<Diagnostic>) {
        let graph = self.graph.borrow();
        let assumptions = self.assumptions(&graph);
        for (name, states, guards) in &self.machines {
            overlaps::check(&format!("block `{}`", shortened(name)), (states, guards), (&graph, &assumptions), out);
        }
    }
}

impl<'a> Blocks<'a, '_, '_> {
    /// Bounds of outputs by kind: alarms and states from 0 to 1, counts from 0 on.
    fn symbol_bounds(&self) -> BTreeMap<String, Interval> {
        let mut out = BTreeMap::new();
        let to = |high: f64| Interval { low: 0.0, high };
        out.extend(self.monitors.iter().map(|monitor| (monitor.name.clone(), to(1.0))));
        for (name, states, _) in &self.machines {
            out.extend(states.iter().map(|state| (outside_name(name, state), to(1.0))));
            out.insert(outside_name(name, ""), to(states.len() as f64 - 1.0));
            out.insert(outside_name(name, "since"), to(f64::INFINITY));
        }
        out
    }

    /// Warns of monitors that never or always give an alarm, with the outputs of blocks expanded.
    pub(super) fn check_monitors(&self, order: &[Ordered<'a>], out: &mut Vec<Diagnostic>) {
        if self.monitors.is_empty() {
            return;
        }
        let mut graph = self.graph.borrow().clone();
        let own = self.symbol_bounds();
        let symbol = |name: &str| self.outputs.get(name).and_then(|(expr, _)| self.graph.borrow().symbol_of(*expr));
        let bounds: HashMap<Symbol, Interval> =
            own.iter().filter_map(|(name, bound)| Some((symbol(name)?, *bound))).collect();
        let mut values = Substitution::default();
        for Ordered { name, value, .. } in order.iter().filter(|output| !own.contains_key(&output.name)) {
            if let Some(symbol) = symbol(name) {
                let value = values.of(&mut graph, &[*value])[0];
                values.set(symbol, value);
            }
        }
        let (assumptions, noises) = (self.assumptions(&graph), self.noises());
        for monitor in &self.monitors {
            let what = format!("block `{}`", shortened(&monitor.name));
            let compared = values.of(&mut graph, &[monitor.residual, monitor.threshold]);
            let [residual, threshold] = compared[..] else { continue };
            let before = out.len();
            monitors::check(&what, (monitor, [residual, threshold]), &mut graph, (&bounds, &assumptions), out);
            if out.len() == before {
                monitors::check_noise(&what, (monitor, [residual, threshold]), &mut graph, &noises, out);
            }
        }
    }

    /// The noise of each sensor that has some.
    fn noises(&self) -> HashMap<&'a str, f64> {
        let sensors = self.document.elements.iter().filter(|element| element.kind.keyword == "sensor");
        let noise = |sensor: &'a Instance| {
            let values = self.reader.values(sensor.kind.fields, &sensor.table, &sensor.name, &mut Vec::new());
            Some((sensor.name.as_str(), values.number("noise")?))
        };
        sensors.filter_map(noise).collect()
    }
}
