//! Monitors whose residual never or always exceeds their threshold.

use std::cell::RefCell;
use std::collections::HashMap;

use kardan_rt::Arithmetic;

use super::overlaps::Assumptions;
use kardan_expr::expr::{AtOnce, Expr, Floating, Graph, Interval, Intervals, Symbol, Traced, lower};
use kardan_mechanics::program::read_name;
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::Place;

/// A monitor as written, with its place.
pub(super) struct MonitorExpr {
    pub name: String,
    pub residual: Expr,
    pub threshold: Expr,
    pub place: Place,
    /// Whether it has a debounce time.
    pub waits: bool,
}

/// Standard deviations of the noise of a residual below which false alarms are frequent; the share of samples that exceed it.
const DEVIATIONS: f64 = 2.0;
const BEYOND: &str = "4.5 %";

/// The verdict on a monitor before a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Finding {
    Never,
    Always,
}

/// What bounds of symbols, or comparisons of sums, prove for a residual and a threshold; the compared expressions are added to the graph.
fn finding(
    graph: &mut Graph,
    [residual, threshold]: [Expr; 2],
    (bounds, assumptions): (&HashMap<Symbol, Interval>, &Assumptions),
) -> Option<Finding> {
    let of = |symbol| bounds.get(&symbol).map_or(Interval::ALL, |bound| *bound);
    let whole = RefCell::new(std::mem::take(graph));
    let traced = |expr| Traced::new(&whole, expr);
    let (zero, one) = (Traced::whole(0), Traced::whole(1));
    let (of_residual, limit) = (traced(residual), traced(threshold));
    let size = of_residual.select(zero, -of_residual, of_residual);
    let beyond = limit.select(size, one, zero).expr(&whole);
    let in_limits = limit.select(size, zero, one).expr(&whole);
    *graph = whole.into_inner();
    let [residual, limit] = lower(graph, &[residual, threshold], &mut Intervals, of)[..] else { return None };
    let never = |expr| assumptions.at_once(graph, &[expr]) == AtOnce::Never;
    let [least, most] = match residual {
        Interval { low, high } if low > 0.0 => [low, high],
        Interval { low, high } if high < 0.0 => [-high, -low],
        Interval { low, high } => [0.0, high.max(-low)],
    };
    if most.is_finite() && most <= limit.low || never(beyond) {
        return Some(Finding::Never);
    }
    (least.is_finite() && least > limit.high || never(in_limits)).then_some(Finding::Always)
}

/// Warns of a monitor whose residual never or always exceeds its threshold, with outputs of blocks expanded.
pub(super) fn check(
    what: &str,
    (monitor, compared): (&MonitorExpr, [Expr; 2]),
    graph: &mut Graph,
    assumptions: (&HashMap<Symbol, Interval>, &Assumptions),
    out: &mut Vec<Diagnostic>,
) {
    let (message, word) = match finding(graph, compared, assumptions) {
        Some(Finding::Never) => (
            format!(
                "{what}: `residual` can never exceed `threshold`, so there is no alarm unless `residual` is not a number"
            ),
            "never exceeded",
        ),
        Some(Finding::Always) => {
            (format!("{what}: `residual` always exceeds `threshold`, so there always is an alarm"), "always exceeded")
        }
        None => return,
    };
    let finding = Diagnostic::warning("block::monitor", message).at(&monitor.place, word);
    out.push(finding.help("check `threshold` and the bounds in `residual`, or remove the monitor"));
}

/// Warns of a threshold of zero, and of one without debounce that sensor noise in the residual exceeds often.
pub(super) fn check_noise(
    what: &str,
    (monitor, [residual, threshold]): (&MonitorExpr, [Expr; 2]),
    graph: &mut Graph,
    noises: &HashMap<&str, f64>,
    out: &mut Vec<Diagnostic>,
) {
    let constant = |graph: &Graph, expr: Expr| {
        let assumptions = graph.symbols(&[expr]).is_empty();
        assumptions.then(|| lower(graph, &[expr], &mut Floating::<f64>::default(), |_| f64::NAN)[0])
    };
    let Some(limit) = constant(graph, threshold) else { return };
    let mut warn = |message: String, label: &str, help: &str| {
        out.push(Diagnostic::warning("block::monitor", message).at(&monitor.place, label).help(help));
    };
    let symbols = graph.symbols(&[residual]);
    if limit == 0.0 && !symbols.is_empty() {
        let message = format!("{what}: its `threshold` is zero, so rounding errors of `residual` exceed it");
        warn(message, "zero", "write how far `residual` may be from zero without a fault");
        return;
    }
    let mut variance = 0.0;
    for symbol in symbols {
        let name = SignalName::new(read_name(graph.name(symbol).0)).element.to_string();
        let Some(noise) = noises.get(name.as_str()) else { continue };
        let slope = graph.derivative(residual, symbol);
        let Some(slope) = constant(graph, slope) else { return };
        variance += slope * noise * slope * noise;
    }
    if !monitor.waits && limit < DEVIATIONS * variance.sqrt() {
        let message = format!(
            "{what}: `threshold` is {limit:.4e}, and the noise of the sensors in `residual` has a standard deviation of {:.3e} there (SI): the noise alone exceeds the threshold in more than {BEYOND} of the samples",
            variance.sqrt()
        );
        warn(
            message,
            "within the noise",
            "write a larger one, add a `debounce`, or filter `residual`; `kardan analyze --parity` computes thresholds",
        );
    }
}
