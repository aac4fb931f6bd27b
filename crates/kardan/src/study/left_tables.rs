//! Tables whose points a run has left.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::equations::{Formula, Hold, Meaning, Mesh};
use crate::expr::{Beyond, Expr, Graph, Named, OfTime};
use crate::plan::compile;
use crate::reduce::Reduced;
use crate::results::Series;
use crate::units::Dimension;

/// Part of the range of a table by which rounding alone may leave it.
const ROUNDING: f64 = 1e-9;

/// Where a run was farthest beyond the points of a table along one of its arguments.
struct Left {
    /// Of a surface: along what.
    along: &'static str,
    beyond: Beyond,
    /// How far, as a part of its range, and in the unit of the argument.
    part: f64,
    by: f64,
    unit: String,
    above: bool,
    end: f64,
    time: f64,
    /// When it was left first.
    first: f64,
    element: String,
}

/// Sentences about tables that torques of elements took values of beyond their points, one for each table and argument. Looked at in the rows of the run.
pub(super) fn left_tables(reduced: &Reduced, series: &Series) -> Vec<String> {
    let equations = &reduced.equations;
    let holds = equations.holds.iter().filter_map(|hold| match &hold.value {
        Hold::Friction { torque, .. } => Some((&hold.element, torque)),
        _ => None,
    });
    let laws = equations.laws.iter().map(|law| (&law.element, &law.value));
    let mut left: BTreeMap<(String, &str), Left> = BTreeMap::new();
    for (element, formula) in laws.chain(holds) {
        look(reduced, (element, &[]), formula, series, &mut left);
    }
    for hold in &equations.holds {
        if let Hold::Mesh(Mesh { loss: Some(formula), .. }) = &hold.value {
            look(reduced, (&hold.element, &hold.row_f64()), formula, series, &mut left);
        }
    }
    let told = |((name, _), left): ((String, &str), Left)| {
        let Left { along, beyond, by, unit, above, end, time, first, element, .. } = left;
        let (side, which) = if above { ("above", "last") } else { ("below", "first") };
        let goes_on = match beyond {
            Beyond::Level => "the value of that point holds",
            Beyond::Straight => "it goes on straight",
        };
        let in_unit = |value: f64| format!("{value:.6} {unit}").trim_end().to_string();
        format!(
            "table `{name}` was left{along} in `{element}`, from {first:.6} s on: at {time:.6} s it was asked {} {side} its {which} point at \
             {}, where {goes_on} (largest of all rows)",
            in_unit(by),
            in_unit(end)
        )
    };
    left.into_iter().map(told).collect()
}

/// What a table is asked, with its range and unit.
struct Argument {
    table: String,
    along: &'static str,
    beyond: Beyond,
    at: Expr,
    range: (f64, f64),
    unit: String,
}

/// Values of a column, if the run has it, and a factor.
type Part<'a> = (Option<&'a [f64]>, f64);

/// What a name in a formula stands for in the rows of a run.
enum Given<'a> {
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
    /// Names, those of columns among them, with what they are.
    inputs: Vec<(String, Given<'a>)>,
    asked: Vec<Argument>,
}

impl<'a> Calls<'a> {
    /// Those of a formula of an element, of losses along a direction.
    fn of(reduced: &Reduced, (element, row): (&str, &[(usize, f64)]), formula: &'a Formula) -> Option<Self> {
        let equations = &reduced.equations;
        let (mut graph, mut inputs) = (Graph::default(), Vec::<(String, Given<'a>)>::new());
        let calls = graph.calls(&formula.expression, &mut |graph, name| {
            let (_, meaning) = formula.names.iter().find(|(other, _)| other == name)?;
            let motion = |body: &str, rate: usize| {
                let domain = equations.domain(reduced.coordinate(body)?);
                Some((domain.motion()[rate].of(body), domain.dimensions()[rate], Given::Column))
            };
            let (signal, dimension, given) = match meaning {
                Meaning::Constant(value, dimension) => return Some(Named::Constant(value.clone(), *dimension)),
                Meaning::Table(table) => return Some(Named::Table(Arc::clone(table))),
                Meaning::Position(body) => motion(body, 0)?,
                Meaning::Rate(body) => motion(body, 1)?,
                Meaning::Time => ("t".to_string(), Dimension::TIME, Given::Time),
                Meaning::Signal(function) => (name.to_string(), function.dimension(), Given::Signal(function)),
                Meaning::Block(_, dimension) => (name.to_string(), *dimension, Given::Column),
                Meaning::Shared(shared) => (name.to_string(), shared.dimension, Given::Column),
                // The teeth put it on the first body of the direction.
                Meaning::Load(dimension) => {
                    let (first, _) = row.iter().find(|(_, x)| *x > 0.0)?;
                    let body = &equations.coordinates[*first];
                    let torque = equations.domain(*first).effort().of(&format!("{element}.{body}"));
                    (name.to_string(), *dimension, Given::Size(vec![(torque, 1.0)]))
                }
                Meaning::Slip(dimension) => {
                    let speed =
                        |(k, x): &(usize, f64)| (equations.domain(*k).motion()[1].of(&equations.coordinates[*k]), *x);
                    (name.to_string(), *dimension, Given::Size(row.iter().map(speed).collect()))
                }
            };
            let symbol = graph.symbol(&signal, dimension);
            if inputs.iter().all(|(other, _)| *other != signal) {
                inputs.push((signal, given));
            }
            Some(Named::Varying(symbol, dimension))
        });
        let mut asked = Vec::new();
        for (name, at) in calls.ok()? {
            let found = formula.names.iter().find_map(|(own, meaning)| match meaning {
                Meaning::Table(table) if *own == name => Some(table),
                _ => None,
            });
            let Some(table) = found else { continue };
            let names = if at.len() > 1 { [" along x", " along y"] } else { [""; 2] };
            let ranges = table.ranges().into_iter().zip(table.arguments());
            for ((at, (range, dimension)), along) in at.into_iter().zip(ranges).zip(names) {
                let (table, beyond, unit) = (name.clone(), table.beyond(), dimension.si());
                asked.push(Argument { table, along, beyond, at, range, unit });
            }
        }
        (!asked.is_empty()).then_some(Self { graph, inputs, asked })
    }
}

/// Looks at the tables of one formula.
fn look(
    reduced: &Reduced,
    (element, row): (&str, &[(usize, f64)]),
    formula: &Formula,
    series: &Series,
    left: &mut BTreeMap<(String, &'static str), Left>,
) {
    let Some(Calls { mut graph, inputs, asked }) = Calls::of(reduced, (element, row), formula) else { return };
    let symbols: Vec<Expr> = inputs.iter().map(|(name, _)| graph.symbol(name, Dimension::NONE)).collect();
    let symbols: Vec<_> = symbols.into_iter().filter_map(|symbol| graph.symbol_of(symbol)).collect();
    let wanted: Vec<_> = asked.iter().enumerate().map(|(k, one)| (format!("argument.{k}"), one.at)).collect();
    let Ok(plan) = compile(&graph, &symbols, &wanted) else { return };
    let column = |name: &str| series.signal(name).map(|signal| signal.values.as_slice());
    let parts = |(name, given): &(String, Given<'_>)| match given {
        Given::Size(sum) => sum.iter().map(|(name, factor)| (column(name), *factor)).collect(),
        _ => vec![(column(name), 1.0)],
    };
    let columns: Vec<Vec<Part<'_>>> = inputs.iter().map(parts).collect();
    let (block, mut memory) = (plan.block(), plan.memory());
    for (row, &time) in series.time.iter().enumerate() {
        for ((place, (_, given)), parts) in memory.iter_mut().zip(&inputs).zip(&columns) {
            let sum = || -> f64 {
                let value = |(column, factor): &Part<'_>| {
                    factor * column.and_then(|values| values.get(row)).copied().unwrap_or(f64::NAN)
                };
                parts.iter().map(value).sum()
            };
            *place = match given {
                Given::Time => time,
                Given::Signal(function) => function.value(time),
                Given::Column => sum(),
                Given::Size(_) => sum().abs(),
            };
        }
        // What is no number is not beyond anything.
        let _ = block.evaluate(&mut memory);
        for (k, one) in asked.iter().enumerate() {
            if let Some(value) = block.output(k, &memory) {
                one.compare((value, time), element, left);
            }
        }
    }
}

impl Argument {
    /// Takes down where a value is farther beyond the range than those before.
    fn compare(&self, (value, time): (f64, f64), element: &str, left: &mut BTreeMap<(String, &'static str), Left>) {
        let (low, high) = self.range;
        let (above, end) = if value > high { (true, high) } else { (false, low) };
        let by = if above { value - high } else { low - value };
        let part = by / (high - low).abs().max(f64::MIN_POSITIVE);
        if part.is_nan() || part <= ROUNDING {
            return;
        }
        let (along, beyond) = (self.along, self.beyond);
        let new = |first: f64| Left {
            along,
            beyond,
            part,
            by,
            unit: self.unit.clone(),
            above,
            end,
            time,
            first,
            element: element.into(),
        };
        match left.get_mut(&(self.table.clone(), along)) {
            Some(before) => {
                before.first = before.first.min(time);
                if part > before.part {
                    *before = new(before.first);
                }
            }
            None => {
                left.insert((self.table.clone(), along), new(time));
            }
        }
    }
}
