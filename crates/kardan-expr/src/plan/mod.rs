//! Plans: expressions compiled to straight-line lists of operations, which `kardan_rt::Plan` runs.
//!
//! Equal operations are computed once, operations that no output needs are removed, constants are folded exactly and
//! rounded once. The same expressions give the same plan, byte for byte.

mod compile;
mod explain;
mod operators;
mod pieces;
mod resolution;
mod series;
mod text;

pub use compile::compile;
pub use operators::word;
pub use resolution::{Over, Resolution};
pub use series::{PiecedSeries, Series};
pub use text::{PlanTextError, parse};

use kardan_rt::{Operator, Run, Table};

/// A compiled plan with its names.
///
/// ```
/// use kardan_expr::expr::{Function, Graph};
/// use kardan_expr::plan::{compile, parse};
/// use kardan_math::units::Dimension;
/// let mut graph = Graph::default();
/// let x = graph.symbol("x", Dimension::ANGLE);
/// let sine = graph.apply(Function::Sin, x);
/// let wanted = graph.sum(1.into(), &[(sine, 3.into())]);
/// let plan = compile(&graph, &[graph.symbol_of(x).unwrap()], &[("y".into(), wanted)]).unwrap();
/// let mut memory = plan.memory();
/// memory[0] = 0.5;
/// assert!(plan.block().evaluate(&mut memory));
/// assert_eq!(plan.block().output(0, &memory), Some(1.0 + 3.0 * kardan_rt::functions::sin(0.5)));
/// assert_eq!(parse(&plan.to_string()).unwrap(), plan);
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    pub(super) constants: Vec<f64>,
    pub(super) runs: Vec<Run>,
    pub(super) operands: Vec<u32>,
    pub(super) places: Vec<u32>,
    pub(super) tables: Vec<Table>,
    pub(super) numbers: Vec<f64>,
}

/// An operation of a plan.
#[derive(Debug, Clone, Copy)]
struct Operation {
    operator: Operator,
    /// Indices of its operands, then zeros; of [`Operator::Table`] the first is the table's number.
    operands: [usize; 4],
    /// Where its value is, and of [`Operator::SineCosine`] the cosine.
    out: [usize; 2],
}

impl Operation {
    /// The operands that are values.
    fn values(&self) -> &[usize] {
        &self.operands[usize::from(self.operator == Operator::Table)..self.operator.operands()]
    }
}

impl Plan {
    /// The operations in their order.
    fn each_operation(&self) -> impl Iterator<Item = Operation> {
        let (mut first, mut operands) = (self.inputs.len() + self.constants.len(), self.operands.as_slice());
        self.runs.iter().flat_map(move |&Run { operator, count }| {
            let width = operator.operands();
            let (own, later) = operands.split_at(count * width);
            let place = first;
            (first, operands) = (first + count * operator.values(), later);
            own.chunks_exact(width).enumerate().map(move |(k, own)| {
                let operands = std::array::from_fn(|j| own.get(j).map_or(0, |place| *place as usize));
                let cosine = if operator == Operator::SineCosine { place + count + k } else { place + k };
                Operation { operator, operands, out: [place + k, cosine] }
            })
        })
    }

    /// Which values of the memory some of them need.
    fn needed(&self, outputs: &[usize]) -> Vec<bool> {
        let mut needed = vec![false; self.block().memory()];
        outputs.iter().for_each(|place| needed[*place] = true);
        let operations: Vec<Operation> = self.each_operation().collect();
        for operation in operations.iter().rev() {
            if operation.out.iter().any(|place| needed[*place]) {
                operation.values().iter().for_each(|place| needed[*place] = true);
            }
        }
        needed
    }

    /// The operations that some values of the memory need and that vary, and which values do not change; `steady`
    /// returns which inputs do not.
    fn varying(&self, outputs: &[usize], steady: impl Fn(usize) -> bool) -> (Vec<Operation>, Vec<bool>) {
        let (inputs, constants, needed) = (self.inputs.len(), self.constants.len(), self.needed(outputs));
        let begin = |k: usize| if k < inputs { steady(k) } else { k < inputs + constants };
        let mut is_steady: Vec<bool> = (0..needed.len()).map(begin).collect();
        let mut operations = Vec::new();
        for operation in self.each_operation() {
            let rests = operation.values().iter().all(|place| is_steady[*place]);
            operation.out.iter().for_each(|place| is_steady[*place] = rests);
            if !rests && operation.out.iter().any(|place| needed[*place]) {
                operations.push(operation);
            }
        }
        (operations, is_steady)
    }

    /// The executable plan.
    pub fn block(&self) -> kardan_rt::Plan<'_, f64> {
        self.block_of(&self.constants, &self.numbers)
    }

    /// The same with constants and numbers of its tables in another precision.
    pub fn block_of<'a, T>(&'a self, constants: &'a [T], numbers: &'a [T]) -> kardan_rt::Plan<'a, T> {
        let Self { runs, operands, places, tables, .. } = self;
        kardan_rt::Plan { inputs: self.inputs.len(), constants, runs, operands, outputs: places, tables, numbers }
    }

    /// The data of it that a program stores, as rows by name, with constants and numbers of its tables in a given
    /// precision: `plan_constants`, `plan_runs` (number of the operator in the order of [`kardan_rt::Operator`],
    /// operations), `plan_operands` (indices into the memory), `plan_outputs`, `plan_tables` (first number, pieces,
    /// terms), `plan_numbers`.
    pub fn rows(&self, constants: &[f64], numbers: &[f64]) -> [(&'static str, Vec<Vec<f64>>); 6] {
        let places = |list: &[u32]| list.iter().map(|place| vec![f64::from(*place)]).collect();
        let list = |list: &[f64]| list.iter().map(|x| vec![*x]).collect();
        let run = |run: &Run| vec![f64::from(run.operator as u8), run.count as f64];
        let table = |table: &Table| vec![table.first as f64, table.pieces as f64, table.terms as f64];
        [
            ("plan_constants", list(constants)),
            ("plan_runs", self.runs.iter().map(run).collect()),
            ("plan_operands", places(&self.operands)),
            ("plan_outputs", places(&self.places)),
            ("plan_tables", self.tables.iter().map(table).collect()),
            ("plan_numbers", list(numbers)),
        ]
    }

    /// Its constants.
    pub fn constants(&self) -> &[f64] {
        &self.constants
    }

    /// The numbers of its tables.
    pub fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    /// Memory for its evaluations, with its constants.
    pub fn memory(&self) -> Vec<f64> {
        let mut memory = vec![0.0; self.block().memory()];
        self.block().begin(&mut memory);
        memory
    }

    /// Where an output is in the memory.
    #[inline]
    pub fn place(&self, output: usize) -> usize {
        self.places[output] as usize
    }

    /// The number of operations of each kind, a fused product and sum counted as one.
    pub fn counts(&self) -> Vec<(Operator, usize)> {
        let mut counts: Vec<(Operator, usize)> = Vec::new();
        for run in &self.runs {
            match counts.iter_mut().find(|(operator, _)| *operator == run.operator) {
                Some((_, count)) => *count += run.count,
                None => counts.push((run.operator, run.count)),
            }
        }
        counts.sort();
        counts
    }

    /// The number of operations.
    pub fn operations(&self) -> usize {
        self.runs.iter().map(|run| run.count).sum()
    }

    /// Floating-point operations: a fused product and sum are two, sine with cosine too.
    pub fn flops(&self) -> usize {
        let weight = |operator: Operator| match operator {
            Operator::AddProduct | Operator::SubtractProduct | Operator::SineCosine => 2,
            _ => 1,
        };
        self.runs.iter().map(|run| run.count * weight(run.operator)).sum()
    }
}
