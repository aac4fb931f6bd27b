//! Sensors of signals as tasks, and signals that depend on coordinates as outputs at every instant.

use std::sync::Arc;

use crate::document::SignalTable;
use kardan_expr::expr::Graph;
use kardan_mechanics::program::{Lists, Read, Task, TaskOutput};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::Place;

use super::{Blocks, Made, Outside, Source};

impl<'a> Blocks<'a, '_, '_> {
    /// A sensor of a signal as a task that outputs its signal; `None` if it has an error, which was reported.
    pub(super) fn sensor(&mut self, sensor: (&'a str, &'a str, &'a Place), out: &mut Vec<Diagnostic>) -> Option<Task> {
        let (name, signal, place) = sensor;
        let source = Source::Sensor(name, signal, place);
        self.make(source, out);
        let dimension = self.formulas.get(&source.key())?.as_ref()?.dimension;
        let is_output = self.outputs.contains_key(signal) || self.made.get(signal).is_some_and(Option::is_some);
        let of_time = self.document.signals.get(signal).is_some_and(|signal| signal.formula.is_none());
        let outside = self.outside.get(signal).map(|outside| &outside.read);
        let block = self.of_name(signal).and_then(|block| self.made.get(block)?.as_ref());
        let of_law = self.document.controls.has(SignalName::new(signal).element);
        if block.is_some_and(|made| made.period.is_some()) || of_law {
            let message = format!(
                "`signal` of sensor `{}`: `{}` is computed on a control unit, so no sensor can measure it",
                shortened(name),
                shortened(signal)
            );
            let help = "let blocks read it by its name; a sensor can measure what is computed at every instant";
            out.push(Diagnostic::error("sensor::signal", message).at(place, "has a sample time").help(help));
            return None;
        }
        if !is_output && !of_time && !matches!(outside, Some(Read::Source(_))) {
            let (message, help) = match outside {
                Some(_) => (
                    "it is a coordinate or a measurement, not a signal",
                    "write `measures = \"angle\"`, \"speed\" or \"torque\", with its `shaft` or `element`",
                ),
                None => (
                    "a run does not have this signal at every instant",
                    "name a signal of a vehicle such as `car.a_y`, a block without a sample time, a reference or a disturbance, or a signal of the file that reads no sensor",
                ),
            };
            let message = format!("`signal` of sensor `{}`: `{}`: {message}", shortened(name), shortened(signal));
            out.push(Diagnostic::error("sensor::signal", message).at(place, "cannot be measured like this").help(help));
            return None;
        }
        let mut graph = Graph::default();
        let value = graph.new_symbol(signal.to_string(), dimension);
        let symbol = graph.symbol_of(value)?;
        let element = self.document.elements.get(name)?;
        // Errors in its other keys are reported where the element is read.
        let values = self.reader.values(element.kind.fields, &element.table, name, &mut Vec::new());
        Some(Task {
            name: format!("sensor {name}"),
            period: values.exact("sample_time").cloned(),
            graph,
            reads: vec![(symbol, Read::Source(signal.to_string()))],
            states: Vec::new(),
            outputs: vec![TaskOutput {
                name: name.to_string(),
                dimension,
                description: format!("reading of sensor {name}"),
                value,
            }],
            moving: vec![symbol],
            names: Vec::new(),
            order: Vec::new(),
            lists: Lists::default(),
        })
    }

    /// A signal that depends on coordinates, as an output at every instant, for the results. Not if it reads a sensor that
    /// needs samples.
    pub(super) fn column(&mut self, signal: &'a SignalTable, out: &mut Vec<Diagnostic>) {
        if signal.formula.is_none() {
            return;
        }
        let source = Source::Formula(signal);
        self.make(source, out);
        let Some(Some(found)) = self.formulas.get(&source.key()) else { return };
        let needs_samples = |name: &String| {
            let outside = self.outside.get(name);
            matches!(outside, Some(Outside { read: Read::Sensor(sensor), .. }) if !self.document.reads_at_every_instant(sensor))
        };
        if found.reads.iter().any(needs_samples) {
            return;
        }
        let (outputs, reads) = (vec![(String::new(), found.value, found.dimension)], Arc::clone(&found.reads));
        self.made.insert(&signal.name, Some(Made { period: None, outputs, states: Vec::new(), reads }));
    }
}
