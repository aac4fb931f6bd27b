//! Functions of time that a motion follows: which of their derivatives must not jump.

use std::ops::Range;

use super::{Functions, MOST_SCAN_POINTS, SCAN_POINTS, named};
use kardan_expr::expr::{Graph, OfTime};
use kardan_math::units::{Dimension, Expression};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::Place;

/// Largest jump that counts as rounding, relative to the largest value.
const ROUNDING: f64 = 1e-9;

/// The first part of an expression with a kink or a jump, inner ones first, and the message where; the whole if no part has one.
pub(super) fn find_kink(
    expression: &Expression,
    mut is_bent: impl FnMut(&Expression) -> bool,
) -> (Range<usize>, String) {
    let found = expression.kinks().into_iter().find(|(part, _)| is_bent(part));
    found.map_or((0..expression.text().len(), "may have a kink".into()), |(part, reason)| (part.span(), reason))
}

impl Functions<'_, '_> {
    /// The function of an expression that a motion follows: an angle without jumps of itself and of its rate, a speed or a
    /// current without jumps, an acceleration; positions of masses likewise.
    pub(crate) fn smooth(
        &mut self,
        expression: &Expression,
        expected: Dimension,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<OfTime> {
        let function = self.function(expression, expected, (place, what), out)?;
        let at = place.inside(expression.text());
        if function.has_kinks() {
            let message = format!("{what}: it may have a kink or a jump between steps, which no motion can follow");
            let (span, reason) = find_kink(expression, |part| self.is_bent(part, (place, what)));
            let at = place.part(expression.text(), span);
            let help = "leave out abs, min, max, if and sign, and tables with kinks; a `[signal.NAME]` declares its breakpoints";
            out.push(Diagnostic::error("motion::not-smooth", message).at(at, reason).help(help));
            return None;
        }
        let derivatives = match expected {
            Dimension::CURRENT if !self.has_inductance() => Vec::new(),
            Dimension::ANGLE | Dimension::LENGTH => vec![function.clone(), function.rate()],
            Dimension::ANGULAR_VELOCITY | Dimension::VELOCITY | Dimension::CURRENT => vec![function.clone()],
            _ => Vec::new(),
        };
        for (order, derivative) in derivatives.iter().enumerate() {
            let Some((time, jump)) = self.jump(derivative) else { continue };
            let whose = if order == 0 { "it" } else { "its rate" };
            let effort = if expected == Dimension::CURRENT { "voltage of an inductance" } else { "torque" };
            let unit = derivative.dimension().si();
            let message =
                format!("{what}: {whose} jumps by {jump} {unit} at {time} s, which needs an infinite {effort}");
            let help = "use a function without that jump: a cubic table, a sine that starts at a turning point, an expression of `t`";
            out.push(Diagnostic::error("motion::discontinuous", message).at(at, "jumps").help(help));
            return None;
        }
        Some(function)
    }

    /// Whether a part of a function of time has kinks between breakpoints.
    fn is_bent(&mut self, part: &Expression, named_in: (&Place, &str)) -> bool {
        let Some(names) = self.names(part, named_in, &mut Vec::new()) else { return false };
        let lowered = self.graph.lowered(part, &mut |_: &mut Graph, name: &str| named(&names, name));
        lowered.is_ok_and(|(value, _)| {
            let kinks = self.graph.kinks(value);
            kinks.into_iter().any(self.graph.varying())
        })
    }

    /// Whether anything in the model has an inductance, which no current may jump through.
    pub(super) fn has_inductance(&self) -> bool {
        self.document.elements.iter().any(|element| element.table.values.keys().any(|key| key.contains("inductance")))
    }

    /// The first time within the run at which a function jumps by more than rounding, and by how much.
    fn jump(&self, function: &OfTime) -> Option<(f64, f64)> {
        let mut starts: Vec<f64> = function.parts().flat_map(|part| part.pieces.starts()).copied().collect();
        starts.retain(|start| *start > 0.0 && *start < self.horizon);
        starts.sort_by(f64::total_cmp);
        starts.dedup();
        let evenly = (0..=SCAN_POINTS).map(|k| self.horizon * f64::from(k) / f64::from(SCAN_POINTS));
        let scan_times = evenly.chain(starts.iter().copied().take(MOST_SCAN_POINTS));
        let largest = scan_times.map(|time| function.value(time).abs()).fold(0.0, f64::max);
        let jump = |time: f64| function.value(time) - function.value_before(time);
        let size = |time: f64| largest.max(function.value_before(time).abs());
        starts
            .into_iter()
            .map(|time| (time, jump(time), size(time)))
            .find(|(_, by, size)| by.abs() > ROUNDING * size)
            .map(|(time, by, _)| (time, by))
    }
}
