//! Outputs and states of a block from its inputs, with their checks.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use crate::document::BlockTable;
use kardan_elements::block::{BlockBuilder, BlockKind, Expressions, Guard, List};
use kardan_elements::element::KeyError;
use kardan_expr::expr::{Expr, Lookup, Traced};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::program::KeyRule;
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::schema::{Kind, Table, Values};

use super::monitors::MonitorExpr;
use super::overlaps::TransitionGuard;
use super::{BlockInputs, BlockStates, Blocks, Made, Outputs, outside_name};

/// The symbols of an output: `.since` of a machine and others whose units are known in advance.
pub(super) fn declared_outputs(kind: &BlockKind, values: &Values, lists: &[List]) -> Vec<(String, Dimension)> {
    match kind.keyword {
        "state_machine" => {
            let states = values.names("states").unwrap_or_default().iter();
            let outputs = lists.iter().filter_map(|list| Some((list.name.clone(), list.values.first()?.1)));
            let own = [(String::new(), Dimension::NONE), ("since".to_string(), Dimension::TIME)];
            own.into_iter().chain(states.map(|name| (name.clone(), Dimension::NONE))).chain(outputs).collect()
        }
        "observer" => {
            let states = lists.iter().filter(|list| list.key == "states");
            states.filter_map(|list| Some((list.name.clone(), list.values.first()?.1))).collect()
        }
        "monitor" => vec![(String::new(), Dimension::NONE)],
        _ => Vec::new(),
    }
}

impl<'a> Blocks<'a, '_, '_> {
    /// Records the comparison of a monitor.
    pub(super) fn watch(&mut self, name: &str, table: &Table, inputs: &BlockInputs) {
        let of = |key: &str| inputs.iter().find(|(candidate, ..)| *candidate == key).map(|(_, _, found)| *found);
        let (Some((residual, _)), Some((threshold, _))) = (of("residual"), of("threshold")) else { return };
        let place = table.place_of("threshold").clone();
        let waits = table.values.contains_key("debounce");
        self.monitors.push(MonitorExpr { name: name.to_string(), residual, threshold, place, waits });
    }

    /// Lets a kind write itself.
    pub(super) fn wire(
        &self,
        kind: &BlockKind,
        (values, sample_time, table, lists): (&Values, Option<Exact>, Option<Arc<Lookup>>, Vec<List>),
        (inputs, guards, own): (BlockInputs, Vec<TransitionGuard>, Vec<[Expr; 2]>),
    ) -> Result<(Outputs, BlockStates, Vec<KeyRule>), KeyError> {
        let graph = &self.graph;
        let traced = |expr: Expr| Traced::new(graph, expr);
        let (mut unnamed, mut named) = (BTreeMap::new(), BTreeMap::<&str, Expressions<'_>>::new());
        for (key, name, (expr, dimension)) in inputs {
            match name {
                None => drop(unnamed.insert(key, (traced(expr), dimension))),
                Some(name) => named.entry(key).or_default().push((name, traced(expr), dimension)),
            }
        }
        let mut builder = BlockBuilder {
            graph,
            inputs: unnamed,
            named,
            own: own.into_iter().map(|both| both.map(traced)).collect(),
            values,
            lists,
            guards: guards
                .iter()
                .map(|guard| Guard { transition: guard.transition, when: traced(guard.when) })
                .collect(),
            table,
            sample_time,
            states: Vec::new(),
            outputs: Vec::new(),
            rules: RefCell::default(),
        };
        (kind.write)(&mut builder)?;
        let rules = builder.rules.take();
        let outputs =
            builder.outputs.iter().map(|output| (output.name.clone(), output.value.expr(graph), output.dimension));
        let states = builder
            .states
            .iter()
            .map(|entry| (entry.symbol.expr(graph), entry.start.expr(graph), entry.next.expr(graph)));
        Ok((outputs.collect(), states.collect(), rules))
    }

    /// Checks the result of a block, and gives its outputs to its users.
    pub(super) fn finished(
        &mut self,
        block: &'a BlockTable,
        mut made: Made,
        unit: Option<Dimension>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Made> {
        let what = format!("block `{}`", shortened(&block.name));
        if let (Some(unit), Some((_, _, found))) = (unit, made.outputs.first())
            && !unit.is_like(found)
        {
            let message = format!("{what} outputs {}, not {}", found.noun(), unit.noun());
            let at = block.table.place_of("unit");
            let diagnostic = Diagnostic::error("unit::dimension", message).at(at, "another unit");
            out.push(diagnostic.help(format!("write a unit such as {}, or leave `unit` out", found.example())));
            return None;
        }
        if let (Some(unit), Some(output)) = (unit, made.outputs.first_mut()) {
            output.2 = unit;
        }
        let varies = |expr: Expr| !self.graph.borrow().symbols(&[expr]).is_empty();
        if made.states.iter().any(|(_, start, _)| varies(*start)) {
            let at = block.table.place_of("initial");
            let diagnostic = Diagnostic::error("block::initial-value", format!("{what}: its initial value may vary"))
                .at(at, "varies");
            out.push(diagnostic.help("write it with numbers and parameters alone"));
            return None;
        }
        for (output, _, dimension) in &made.outputs {
            self.output_symbol(outside_name(&block.name, output), *dimension);
        }
        Some(made)
    }

    /// Lists of quantities by name.
    pub(super) fn lists(&self, table: &Table, out: &mut Vec<Diagnostic>) -> Vec<List> {
        let (mut lists, mut places): (Vec<List>, HashMap<(&str, &str), usize>) = (Vec::new(), HashMap::new());
        for field in table.fields.iter().filter(|field| field.kind == Kind::Lists) {
            for (name, scalar) in table.map(field.name).unwrap_or_default() {
                let label = format!("`{}` in `{}`", name.value, field.name);
                let Some(found) = self.reader.scalar(scalar, None, &label, out) else { continue };
                let place = *places.entry((field.name, &name.value)).or_insert(lists.len());
                match lists.get_mut(place) {
                    Some(list) => list.values.push(found),
                    None => lists.push(List { key: field.name, name: name.value.clone(), values: vec![found] }),
                }
            }
        }
        lists
    }
}

/// Warns of an unstable transfer function.
pub(super) fn warn_of_growth(values: &Values, table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
    let poles = values.poles("poles").unwrap_or_default();
    let Some((real, imaginary)) = poles.iter().find(|(real, _)| real.signum() > 0) else { return };
    let beside = if imaginary.is_zero() { String::new() } else { format!(" ± {}j", imaginary.to_f64().abs()) };
    let message = format!(
        "{what}: its pole at {}{beside} 1/s has a real part above zero: its output grows without bound for any input",
        real.to_f64()
    );
    let diagnostic = Diagnostic::warning("block::unstable", message).at(table.place_of("poles"), "grows");
    out.push(
        diagnostic
            .help("check the sign: a decaying output has negative poles; leave it if a loop around it stabilises it"),
    );
}
