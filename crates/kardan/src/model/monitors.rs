//! Monitors whose residual is never or always beyond their threshold.

use std::cell::RefCell;

use kardan_rt::Arithmetic;

use super::overlaps::Known;
use crate::diagnostics::Diagnostic;
use crate::entries::Place;
use crate::expr::{AtOnce, Expr, Graph, Interval, Intervals, Symbol, Traced, at_once, lower};

/// A monitor as it is written, and where that stands.
pub(super) struct WrittenMonitor {
    pub name: String,
    pub residual: Expr,
    pub threshold: Expr,
    pub place: Place,
}

/// What is known of a monitor before any run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Told {
    Never,
    Always,
}

/// What bounds of symbols, or comparisons of sums, prove of a residual and a threshold; the graph takes what is compared.
fn told(
    graph: Graph,
    [residual, threshold]: [Expr; 2],
    (bounds, known): (&[(Symbol, Interval)], &Known),
) -> Option<Told> {
    let of = |symbol| bounds.iter().find(|(other, _)| *other == symbol).map_or(Interval::ALL, |(_, bound)| *bound);
    let graph = RefCell::new(graph);
    let traced = |expr| Traced::new(&graph, expr);
    let (zero, one) = (Traced::whole(0), Traced::whole(1));
    let (of_residual, limit) = (traced(residual), traced(threshold));
    let size = of_residual.select(zero, -of_residual, of_residual);
    let beyond = limit.select(size, one, zero).expr(&graph);
    let within = limit.select(size, zero, one).expr(&graph);
    let graph = graph.into_inner();
    let [residual, limit] = lower(&graph, &[residual, threshold], &mut Intervals, of)[..] else { return None };
    let never = |expr| at_once(&graph, &[expr], &known.not_negative, &known.together) == AtOnce::Never;
    let [least, most] = match residual {
        Interval { low, high } if low > 0.0 => [low, high],
        Interval { low, high } if high < 0.0 => [-high, -low],
        Interval { low, high } => [0.0, high.max(-low)],
    };
    if most.is_finite() && most <= limit.low || never(beyond) {
        return Some(Told::Never);
    }
    (least.is_finite() && least > limit.high || never(within)).then_some(Told::Always)
}

/// Warns of a monitor whose residual can never be beyond the threshold, or always is: what it compares with answers of blocks written out.
pub(super) fn check(
    what: &str,
    (monitor, compared): (&WrittenMonitor, [Expr; 2]),
    graph: Graph,
    known: (&[(Symbol, Interval)], &Known),
    out: &mut Vec<Diagnostic>,
) {
    let (message, word) = match told(graph, compared, known) {
        Some(Told::Never) => (
            format!(
                "{what}: `residual` can never be beyond `threshold`, so there is no alarm but where it is no number"
            ),
            "never beyond",
        ),
        Some(Told::Always) => {
            (format!("{what}: `residual` is always beyond `threshold`, so there always is an alarm"), "always beyond")
        }
        None => return,
    };
    let told = Diagnostic::warning("block::monitor", message).at(monitor.place.clone(), word);
    out.push(told.help("check `threshold` and the bounds in `residual`, or take the monitor out"));
}
