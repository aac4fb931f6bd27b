//! Warnings about tables read outside their range, and about keys of blocks with forbidden values.

use std::collections::BTreeMap;
use std::sync::Arc;

use kardan_expr::expr::{Expr, Extrapolation, Graph, Lookup, Named, OfTime, Symbol};
use kardan_expr::plan::compile;
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Formula, Meaning, UnilateralConstraint};
use kardan_mechanics::program::{KeyRule, Looked, TableCall, read_name};
use kardan_mechanics::reduce::Reduced;
use kardan_model::programs::Programs;
use kardan_results::Series;
use kardan_results::signal_name::SignalName;

/// Fraction of the range of a table that rounding alone may exceed.
const ROUNDING: f64 = 1e-9;

/// Smaller numbers are written in scientific notation.
const SMALL: f64 = 1e-3;

/// The largest exceedance of the range of a table along one of its arguments in a run.
struct Exceedance {
    argument: Argument,
    /// The exceedance, as a fraction of its range, and in the unit of the argument.
    part: f64,
    by: f64,
    above: bool,
    end: f64,
    time: f64,
    /// The first time of an exceedance.
    first: f64,
}

/// Warnings about tables that elements, blocks and signals read outside their range, one for each table and argument. Evaluated in
/// the rows of the run.
pub(in crate::study) fn extrapolation_warnings(reduced: &Reduced, programs: &Programs, series: &Series) -> Vec<String> {
    let equations = &reduced.equations;
    let laws = equations.laws.iter().map(|law| (&law.element, Vec::new(), &law.value));
    let frictions = equations.unilaterals.iter().filter_map(|unilateral| match &unilateral.value {
        UnilateralConstraint::Friction { torque, .. } => Some((&unilateral.element, Vec::new(), torque)),
        _ => None,
    });
    let losses = equations.gear_losses();
    let losses = losses.filter_map(|(of, gear)| Some((&of.element, of.row_f64(), gear.loss.as_ref()?)));
    let mut exceedances: BTreeMap<(String, &str), Exceedance> = BTreeMap::new();
    let formulas = laws.chain(frictions).chain(losses);
    let calls = formulas.filter_map(|(element, row, formula)| Calls::of(reduced, (element, &row), formula));
    for Calls { graph, inputs, lookups } in calls.chain(Calls::of_programs(programs, series)) {
        let exprs: Vec<Expr> = lookups.iter().map(|one| one.at).collect();
        in_rows((&graph, &inputs), &exprs, series, |k, value, time| {
            lookups[k].compare((value, time), &mut exceedances)
        });
    }
    let note = |((name, _), exceedances): ((String, &str), Exceedance)| {
        let Exceedance { argument, by, above, end, time, first, .. } = exceedances;
        let Argument { axis, beyond, unit, element, .. } = argument;
        let (side, which) = if above { ("above", "last") } else { ("below", "first") };
        let goes_on = match beyond {
            Extrapolation::Level => "the value of that point is used",
            Extrapolation::Straight => "it is extrapolated linearly",
        };
        let in_unit = |value: f64| format!("{value:.6} {unit}").trim_end().to_string();
        format!(
            "`{element}` read table `{name}` outside its range{axis} from {first:.6} s on: at {time:.6} s by {} \
             {side} its {which} point at {}, where {goes_on} (largest of all rows)",
            in_unit(by),
            in_unit(end)
        )
    };
    exceedances.into_iter().map(note).collect()
}

/// An argument of a table, with its range and unit.
#[derive(Clone)]
struct Argument {
    /// The element that reads the table.
    element: String,
    table: String,
    /// For a surface: the axis.
    axis: &'static str,
    beyond: Extrapolation,
    at: Expr,
    range: (f64, f64),
    unit: String,
}

/// Values of a column, if the run has it, and a factor.
type Part<'a> = (Option<&'a [f64]>, f64);

/// The meaning of a name in a formula in the rows of a run.
enum InputSource<'a> {
    Time,
    Signal(&'a OfTime),
    /// A column.
    Column,
    /// The size of a sum of columns with factors.
    Size(Vec<(String, f64)>),
}

/// The tables of a formula as expressions of columns.
struct Calls<'a> {
    graph: Graph,
    /// The names in them, with their meanings.
    inputs: Vec<(Symbol, String, InputSource<'a>)>,
    lookups: Vec<Argument>,
}

impl<'a> Calls<'a> {
    /// Those of a formula of an element, of losses along a direction.
    fn of(reduced: &Reduced, (element, row): (&str, &[(usize, f64)]), formula: &'a Formula) -> Option<Self> {
        let equations = &reduced.equations;
        let (mut graph, mut inputs) = (Graph::default(), Vec::<(Symbol, String, InputSource<'a>)>::new());
        let calls = graph.calls(&formula.expression, &mut |graph, name| {
            let (_, meaning) = formula.names.iter().find(|(candidate, _)| candidate == name)?;
            let motion = |body: &str, rate: usize| {
                let domain = equations.domain(reduced.coordinate(body)?);
                Some((domain.motion()[rate].of(body), domain.dimensions()[rate], InputSource::Column))
            };
            let (signal, dimension, source) = match meaning {
                Meaning::Constant(value, dimension) => return Some(Named::Constant(value.clone(), *dimension)),
                Meaning::Table(table) => return Some(Named::Table(Arc::clone(table))),
                Meaning::Position(body) => motion(body, 0)?,
                Meaning::Rate(body) => motion(body, 1)?,
                Meaning::Time => ("t".to_string(), Dimension::TIME, InputSource::Time),
                Meaning::Signal(function) => (name.to_string(), function.dimension(), InputSource::Signal(function)),
                Meaning::Block(_, dimension) => (name.to_string(), *dimension, InputSource::Column),
                Meaning::Shared(shared) => (name.to_string(), shared.dimension, InputSource::Column),
                // The gear applies it to the first body of the direction.
                Meaning::Load(dimension) => {
                    let (first, _) = row.iter().find(|(_, x)| *x > 0.0)?;
                    let body = &equations.coordinates[*first];
                    let torque = equations.domain(*first).effort().of(&format!("{element}.{body}"));
                    (name.to_string(), *dimension, InputSource::Size(vec![(torque, 1.0)]))
                }
                Meaning::Slip(dimension) => {
                    let speed =
                        |(k, x): &(usize, f64)| (equations.domain(*k).motion()[1].of(&equations.coordinates[*k]), *x);
                    (name.to_string(), *dimension, InputSource::Size(row.iter().map(speed).collect()))
                }
            };
            let symbol = graph.symbol(&signal, dimension);
            if inputs.iter().all(|(_, candidate, _)| *candidate != signal) {
                inputs.push((graph.symbol_of(symbol)?, signal, source));
            }
            Some(Named::Varying(symbol, dimension))
        });
        let mut lookups = Vec::new();
        for (name, at) in calls.ok()? {
            let found = formula.names.iter().find_map(|(own, meaning)| match meaning {
                Meaning::Table(table) if *own == name => Some(table),
                _ => None,
            });
            lookups.extend(found.into_iter().flat_map(|table| arguments(element, (&name, table), &at)));
        }
        (!lookups.is_empty()).then_some(Self { graph, inputs, lookups })
    }

    /// Tables of blocks and signals.
    fn of_programs(programs: &'a Programs, series: &Series) -> Option<Self> {
        let call = |call: &TableCall| arguments(&call.reader, (&call.name, &call.table), &call.at);
        let lookups: Vec<Argument> = programs.looked.calls.iter().flat_map(call).collect();
        let exprs: Vec<Expr> = lookups.iter().map(|one| one.at).collect();
        let inputs = inputs_of(programs, &exprs, series);
        (!lookups.is_empty()).then(|| Self { graph: programs.looked.graph.clone(), inputs, lookups })
    }
}

/// Meanings of names in expressions of blocks and signals in the rows of a run.
fn inputs_of<'a>(programs: &'a Programs, exprs: &[Expr], series: &Series) -> Vec<(Symbol, String, InputSource<'a>)> {
    let Looked { graph, .. } = &programs.looked;
    // The name of a sensor alone refers to its reading too.
    let column = |symbol: &str| {
        let name = read_name(symbol);
        let own = || series.signals.iter().find(|signal| SignalName::new(&signal.name).element == name);
        let found = series.signal(name).or_else(own);
        found.map_or_else(|| name.to_string(), |signal| signal.name.clone())
    };
    let input = |symbol: Symbol| {
        let (name, _) = graph.name(symbol);
        let function = programs.functions.iter().find(|(candidate, _)| candidate == name);
        match function {
            Some((_, function)) => (symbol, name.to_string(), InputSource::Signal(function)),
            None if name == "t" => (symbol, name.to_string(), InputSource::Time),
            None => (symbol, column(name), InputSource::Column),
        }
    };
    graph.symbols(exprs).into_iter().map(input).collect()
}

/// Table reads of an element, one for each argument.
fn arguments(element: &str, (name, table): (&str, &Lookup), at: &[Expr]) -> Vec<Argument> {
    let names = if at.len() > 1 { [" along x", " along y"] } else { [""; 2] };
    let ranges = table.ranges().into_iter().zip(table.arguments());
    at.iter()
        .zip(ranges)
        .zip(names)
        .map(|((at, (range, dimension)), axis)| Argument {
            element: element.into(),
            table: name.into(),
            axis,
            beyond: table.beyond(),
            at: *at,
            range,
            unit: dimension.si(),
        })
        .collect()
}

/// Passes the values of expressions in all rows that are numbers, with the number of the expression and the time.
fn in_rows(
    (graph, inputs): (&Graph, &[(Symbol, String, InputSource<'_>)]),
    exprs: &[Expr],
    series: &Series,
    mut visit: impl FnMut(usize, f64, f64),
) {
    let symbols: Vec<Symbol> = inputs.iter().map(|(symbol, ..)| *symbol).collect();
    let expressions: Vec<_> = exprs.iter().enumerate().map(|(k, expr)| (format!("value.{k}"), *expr)).collect();
    let Ok(plan) = compile(graph, &symbols, &expressions) else { return };
    let column = |name: &str| series.signal(name).map(|signal| signal.values.as_slice());
    let parts = |(_, name, source): &(Symbol, String, InputSource<'_>)| match source {
        InputSource::Size(sum) => sum.iter().map(|(name, factor)| (column(name), *factor)).collect(),
        _ => vec![(column(name), 1.0)],
    };
    let columns: Vec<Vec<Part<'_>>> = inputs.iter().map(parts).collect();
    let (block, mut memory) = (plan.block(), plan.memory());
    for (row, &time) in series.time.iter().enumerate() {
        for ((place, (.., source)), parts) in memory.iter_mut().zip(inputs).zip(&columns) {
            let sum = || -> f64 {
                let value = |(column, factor): &Part<'_>| {
                    factor * column.and_then(|values| values.get(row)).copied().unwrap_or(f64::NAN)
                };
                parts.iter().map(value).sum()
            };
            *place = match source {
                InputSource::Time => time,
                InputSource::Signal(function) => function.value(time),
                InputSource::Column => sum(),
                InputSource::Size(_) => sum().abs(),
            };
        }
        // A value that is not a number exceeds nothing.
        let _ = block.evaluate(&mut memory);
        for k in 0..exprs.len() {
            if let Some(value) = block.output(k, &memory) {
                visit(k, value, time);
            }
        }
    }
}

/// Warnings about keys of blocks that are expressions and take values that kardan rejects for constants. Evaluated in the rows of the run.
pub(in crate::study) fn broken_rules(programs: &Programs, series: &Series) -> Vec<String> {
    let Looked { graph, rules, .. } = &programs.looked;
    if rules.is_empty() {
        return Vec::new();
    }
    let exprs: Vec<Expr> = rules.iter().map(|rule| rule.value).collect();
    let inputs = inputs_of(programs, &exprs, series);
    let mut broken: Vec<Option<(f64, f64)>> = vec![None; rules.len()];
    in_rows((graph, &inputs), &exprs, series, |k, value, time| {
        if value < 0.0 || rules[k].above && value == 0.0 {
            let (_, least) = broken[k].get_or_insert((time, value));
            *least = least.min(value);
        }
    });
    let note = |(KeyRule { block, what, dimension, .. }, found): (&KeyRule, Option<(f64, f64)>)| {
        let (first, least) = found?;
        let by = if -least < SMALL { format!("{:.3e}", -least) } else { format!("{:.6}", -least) };
        let by = format!("{by} {}", dimension.si());
        let by = if least < 0.0 { format!(", by up to {}", by.trim_end()) } else { String::new() };
        Some(format!(
            "{what} in block `{block}` from {first:.6} s on{by}, where kardan rejects a constant: the output of the \
             block is unreliable from there on"
        ))
    };
    rules.iter().zip(broken).filter_map(note).collect()
}

impl Argument {
    /// Records a value that exceeds the range by more than the previous ones.
    fn compare(&self, (value, time): (f64, f64), exceedances: &mut BTreeMap<(String, &'static str), Exceedance>) {
        let (low, high) = self.range;
        let (above, end) = if value > high { (true, high) } else { (false, low) };
        let by = if above { value - high } else { low - value };
        let part = by / (high - low).abs().max(f64::MIN_POSITIVE);
        if part.is_nan() || part <= ROUNDING {
            return;
        }
        let new = |first: f64| Exceedance { argument: self.clone(), part, by, above, end, time, first };
        let before = exceedances.entry((self.table.clone(), self.axis)).or_insert_with(|| new(time));
        before.first = before.first.min(time);
        if part > before.part {
            *before = new(before.first);
        }
    }
}
