//! Divisors that a tolerance may make zero, and functions that it may leave undefined.

use std::collections::HashMap;

use crate::document::{Document, Setting, Tolerance};
use crate::table_reader::TableReader;
use kardan_expr::expr::{Expr, Graph, Interval, Intervals, Named, lower};
use kardan_math::num::rational_from_f64;
use kardan_math::units::{Dimension, Exact, Expression, Restriction};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::Place;
use kardan_schema::schema::{Scalar, Table, Value};

/// Number of pieces of an interval that are examined.
const PIECES: usize = 512;
/// The smallest piece is the interval halved so often.
const HALVINGS: usize = 12;

/// The property to decide for all values of an interval.
type Test = fn(Interval) -> bool;

/// The verdict on a divisor over an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Zero {
    /// It is zero nowhere.
    Excluded,
    /// It is negative somewhere and positive elsewhere, and continuous.
    Crossed,
    /// Neither is proven.
    Possible,
}

/// Reports divisors that are, or may be, zero somewhere in the interval of a parameter, and functions that have, or may have, no value there.
pub(super) fn check_divisions(
    document: &Document,
    tolerance: &Tolerance,
    settings: &[Setting],
    out: &mut Vec<Diagnostic>,
) {
    let reader = TableReader::new(document, settings);
    let mut graph = Graph::default();
    let symbol = graph.symbol(&tolerance.parameter, tolerance.dimension);
    let varying = HashMap::from([(tolerance.parameter.clone(), (symbol, tolerance.dimension))]);
    let mut search = Search { reader, graph, varying, tolerance };
    for parameter in document.in_order() {
        let Some(expression) = &parameter.expression else { continue };
        if settings.iter().any(|set| set.name == parameter.name) || !search.varies(expression) {
            continue;
        }
        // Keys of elements are reported with their tables.
        if document.parameters.has(&parameter.name) {
            search.check(expression, (&parameter.place, &format!("parameter `{}`", parameter.name)), out);
        }
        if let Some((expr, dimension)) = search.lowered(expression)
            && parameter.dimension.is_like(&dimension)
        {
            search.varying.insert(parameter.name.clone(), (expr, parameter.dimension));
        }
    }
    for (keyword, name, table) in document.model_tables() {
        search.table(table, &format!("{keyword} `{name}`"), out);
    }
}

struct Search<'a> {
    reader: TableReader<'a>,
    graph: Graph,
    /// The values that depend on the parameter.
    varying: HashMap<String, (Expr, Dimension)>,
    tolerance: &'a Tolerance,
}

impl Search<'_> {
    fn varies(&self, expression: &Expression) -> bool {
        expression.names().iter().any(|name| self.varying.contains_key(*name))
    }

    fn lowered(&mut self, expression: &Expression) -> Option<(Expr, Dimension)> {
        let Self { reader, graph, varying, .. } = self;
        let mut names = |_: &mut Graph, name: &str| match varying.get(name) {
            Some((expr, dimension)) => Some(Named::Varying(*expr, *dimension)),
            None => reader.exact_value(name).map(|(value, dimension)| Named::Constant(value, dimension)),
        };
        graph.lowered(expression, &mut names).ok()
    }

    fn table(&mut self, table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
        for (key, entry) in &table.values {
            let label = format!("`{key}` of {what}");
            match &entry.value {
                Value::Scalar(Scalar::Expression(expression)) => self.check(expression, (&entry.place, &label), out),
                Value::Map(entries) => {
                    for (_, scalar) in entries {
                        if let Scalar::Expression(expression) = &scalar.value {
                            self.check(expression, (&scalar.place, &label), out);
                        }
                    }
                }
                Value::Tables(tables) => tables.iter().for_each(|table| self.table(table, &label, out)),
                _ => {}
            }
        }
    }

    fn check(&mut self, expression: &Expression, (place, what): (&Place, &str), out: &mut Vec<Diagnostic>) {
        for divisor in expression.divisors().iter().filter(|divisor| self.varies(divisor)).collect::<Vec<_>>() {
            let Some((expr, _)) = self.lowered(divisor) else { continue };
            let certain = match zero_of(&self.graph, expr, self.tolerance, divisor.jumps()) {
                Zero::Excluded => continue,
                Zero::Crossed => true,
                Zero::Possible => false,
            };
            let finding = Finding { code: "expression::division", certain, use_of: "division by", rule: "zero" };
            let diagnostic = self.report(&finding, [expression, divisor], (place, what), "divided by this");
            out.push(
                diagnostic
                    .help("narrow the tolerance, or choose another value near zero with `if(abs(x) < ..., ..., ...)`"),
            );
        }
        self.check_values(expression, (place, what), out);
    }

    /// Reports functions without a value.
    fn check_values(&mut self, expression: &Expression, (place, what): (&Place, &str), out: &mut Vec<Diagnostic>) {
        for (part, restriction) in
            expression.restricted().iter().filter(|(part, _)| self.varies(part)).collect::<Vec<_>>()
        {
            let Some((expr, _)) = self.lowered(part) else { continue };
            let (never, always): (Test, Test) = match restriction {
                Restriction::NotNegative => (|x| x.high < 0.0, |x| x.low >= 0.0),
                Restriction::Positive => (|x| x.high <= 0.0, |x| x.low > 0.0),
                Restriction::UnitInterval => (|x| x.high < -1.0 || x.low > 1.0, |x| x.low >= -1.0 && x.high <= 1.0),
            };
            let (certain, possible) = outside(&self.graph, expr, self.tolerance, never, always);
            if !(certain || possible) {
                continue;
            }
            let (use_of, rule) = match restriction {
                Restriction::NotNegative => ("the square root of", "negative"),
                Restriction::Positive => ("the logarithm of", "zero or below"),
                Restriction::UnitInterval => ("the arc of", "outside of -1 to 1"),
            };
            let finding = Finding { code: "expression::domain", certain, use_of, rule };
            let label = format!("{} {rule}", finding.verdict());
            let diagnostic = self.report(&finding, [expression, part], (place, what), &label);
            out.push(
                diagnostic.help("narrow the tolerance, or choose another value there with `if(x > ..., ..., ...)`"),
            );
        }
    }

    /// An error where it is certain, else a warning, at a part of an expression and at the tolerance.
    fn report(
        &self,
        finding: &Finding,
        [expression, part]: [&Expression; 2],
        (place, what): (&Place, &str),
        label: &str,
    ) -> Diagnostic {
        let (Finding { code, certain, use_of, rule }, tolerance) = (*finding, self.tolerance);
        let inner = expression.text().get(part.span()).unwrap_or_default();
        let message = format!(
            "{what}: {use_of} `{inner}`, which {} {rule} for a value within the tolerance of `{}`: {}",
            finding.verdict(),
            tolerance.parameter,
            tolerance.shown()
        );
        let diagnostic = if certain { Diagnostic::error(code, message) } else { Diagnostic::warning(code, message) };
        diagnostic.at(place.part(expression.text(), part.span()), label).at(&tolerance.place, "this tolerance")
    }
}

/// A part of an expression that a value within the tolerance makes, or may make, invalid.
#[derive(Clone, Copy)]
struct Finding {
    code: &'static str,
    certain: bool,
    /// What uses the part.
    use_of: &'static str,
    /// What the part is there.
    rule: &'static str,
}

impl Finding {
    fn verdict(&self) -> &'static str {
        if self.certain { "is" } else { "may be" }
    }
}

/// The ends of an interval in floating point, rounded outwards.
fn ends(tolerance: &Tolerance) -> (f64, f64) {
    let exact =
        |value: &Exact, near: f64| rational_from_f64(near).map(|near| Exact::new(near, 0)) == Some(value.clone());
    let (low, high) = (tolerance.lower.to_f64(), tolerance.upper.to_f64());
    (
        if exact(&tolerance.lower, low) { low } else { low.next_down() },
        if exact(&tolerance.upper, high) { high } else { high.next_up() },
    )
}

/// Bisects an interval until a predicate decides on the values of an expression of one symbol over each piece; those over the pieces that
/// it left undecided.
fn undecided(
    graph: &Graph,
    expr: Expr,
    tolerance: &Tolerance,
    mut decides: impl FnMut(Interval) -> bool,
) -> Vec<Interval> {
    let over = |low: f64, high: f64| lower(graph, &[expr], &mut Intervals, |_| Interval { low, high })[0];
    let (low, high) = ends(tolerance);
    let (mut intervals, mut looked_at, mut open) = (vec![(low, high, 0)], 0, Vec::new());
    while let Some((low, high, depth)) = intervals.pop() {
        let found = over(low, high);
        looked_at += 1;
        let middle = 0.5 * low + 0.5 * high;
        if decides(found) {
            continue;
        }
        if depth < HALVINGS && looked_at + intervals.len() < PIECES && low < middle && middle < high {
            intervals.extend([(low, middle, depth + 1), (middle, high, depth + 1)]);
        } else {
            open.push(found);
        }
    }
    open
}

/// Whether an expression of one symbol is, and whether it may be, out of bounds somewhere in an interval. `never` and `always` decide for
/// all values of an interval that they are out of, or within, bounds.
fn outside(graph: &Graph, expr: Expr, tolerance: &Tolerance, never: Test, always: Test) -> (bool, bool) {
    let mut certain = false;
    let open = undecided(graph, expr, tolerance, |found| {
        certain |= never(found);
        certain || always(found)
    });
    (certain, certain || !open.is_empty())
}

/// Whether an expression of one symbol is zero somewhere in an interval.
fn zero_of(graph: &Graph, expr: Expr, tolerance: &Tolerance, jumps: bool) -> Zero {
    let [mut negative, mut positive] = [false; 2];
    let open = undecided(graph, expr, tolerance, |found| {
        negative |= found.high < 0.0;
        positive |= found.low > 0.0;
        found.high < 0.0 || found.low > 0.0
    });
    let finite = open.iter().all(|found| found.low.is_finite() && found.high.is_finite());
    match open.is_empty() {
        true => Zero::Excluded,
        false if negative && positive && finite && !jumps => Zero::Crossed,
        false => Zero::Possible,
    }
}
