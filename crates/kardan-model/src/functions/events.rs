//! Functions of time defined by events of the scenario.

use std::sync::Arc;

use super::Functions;
use kardan_expr::expr::{Graph, OfTime, Part, Pieces};
use kardan_math::units::Dimension;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::{Sign, Table};
use kardan_simulate::{Profile, SignalEvent};

impl Functions<'_, '_> {
    /// The function that events set, which must not jump after the start of the run; zero without events. Errors in an event itself are reported
    /// with the scenario.
    pub(crate) fn of_events(
        &mut self,
        signal: &str,
        dimension: Dimension,
        out: &mut Vec<Diagnostic>,
    ) -> Option<OfTime> {
        let tables = self.document.scenario.tables("event");
        let own = |table: &&Table| table.word("signal") == Some(signal);
        let found: Vec<(&Table, SignalEvent)> =
            tables.iter().filter(own).filter_map(|table| Some((table, self.event(table, dimension)?))).collect();
        let profile = Profile::new(found.iter().map(|(_, event)| event));
        let mut times: Vec<f64> = profile.breakpoints().collect();
        times.sort_by(f64::total_cmp);
        let piece = |time: f64| (time, [profile.value(time), profile.piece(time).1, 0.0, 0.0]);
        let pieces = Pieces::new(times.into_iter().map(piece));
        let inductance = dimension != Dimension::CURRENT || self.has_inductance();
        let jumps = |at: f64| inductance && at > 0.0 && pieces.value(at) != pieces.value_before(at);
        for (table, event) in found.iter().filter(|(_, event)| event.over == 0.0 && jumps(event.at)) {
            let message = format!(
                "`{signal}` would jump from {} to {} {} at {} s: a prescribed signal must not jump, as an inductance would need an infinite voltage",
                pieces.value_before(event.at),
                event.to,
                dimension.si(),
                event.at
            );
            let diagnostic = Diagnostic::error("motion::discontinuous", message).at(table.place_of("to"), "jumps");
            out.push(diagnostic.help("give the change a duration: `over = \"1 ms\"`; a step is allowed only at 0 s"));
        }
        let mut graph = Graph::default();
        let time = graph.new_symbol("t".into(), Dimension::TIME);
        let symbol = graph.new_symbol(signal.to_string(), dimension);
        let part = Arc::new(Part { name: signal.to_string(), dimension, pieces, reported: false });
        OfTime::new(graph, time, vec![(symbol, part)], symbol, dimension)
    }

    /// An event without errors.
    fn event(&self, table: &Table, dimension: Dimension) -> Option<SignalEvent> {
        let number = |key: &str, expected: (Dimension, Sign)| {
            let scalar = table.scalar_or_default(key, &table.place)?;
            let (value, found) = self.reader.scalar(&scalar, Some(expected), key, &mut Vec::new())?;
            (found == expected.0).then(|| value.to_f64())
        };
        let time = |key: &str| number(key, (Dimension::TIME, Sign::NonNegative));
        let (at, to) = (time("at")?, number("to", (dimension, Sign::Any))?);
        Some(SignalEvent { source: 0, at, to, over: time("over").unwrap_or(0.0) })
    }
}
