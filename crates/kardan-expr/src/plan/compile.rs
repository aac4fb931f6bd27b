//! From expressions to runs of operations.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use kardan_rt::{Operator, Run, Table};

use super::Plan;
use crate::expr::{Distinct, Domain, Expr, Floating, Graph, PiecewisePolynomial, Symbol, lower};
use kardan_math::num::{Rational, rational_to_f64};

/// A value while a plan is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
enum Value {
    Input(u32),
    Constant(u32),
    /// The result of an operation; the second one for the cosine.
    Result(u32, bool),
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Operation {
    operator: Operator,
    operands: Vec<Value>,
    /// Of a table its number.
    table: u32,
}

/// A list of operations, each once.
#[derive(Default)]
struct Builder {
    constants: Vec<f64>,
    constant_index: HashMap<u64, u32>,
    operations: Vec<Operation>,
    index: HashMap<Operation, u32>,
    tables: Distinct<PiecewisePolynomial>,
}

impl Builder {
    fn float(&mut self, value: f64) -> Value {
        let next = self.constants.len() as u32;
        let number = *self.constant_index.entry(value.to_bits()).or_insert(next);
        if number == next {
            self.constants.push(value);
        }
        Value::Constant(number)
    }

    fn put(&mut self, operation: Operation) -> u32 {
        if let Some(cached) = self.index.get(&operation) {
            return *cached;
        }
        let number = self.operations.len() as u32;
        self.operations.push(operation.clone());
        self.index.insert(operation, number);
        number
    }

    /// The numbers of operands that are all constants.
    fn constant_operands(&self, operands: &[Value]) -> Option<Vec<f64>> {
        let number = |value: &Value| match value {
            Value::Constant(number) => Some(self.constants[*number as usize]),
            _ => None,
        };
        operands.iter().map(number).collect()
    }
}

impl Domain for Builder {
    type Value = Value;

    fn constant(&mut self, value: &Rational) -> Value {
        self.float(rational_to_f64(value))
    }

    fn operation(&mut self, operator: Operator, operands: &[Value]) -> Value {
        if let Some(constant_operands) = self.constant_operands(operands) {
            let value = Floating::<f64>::default().operation(operator, &constant_operands);
            return self.float(value);
        }
        let mut operands = operands.to_vec();
        if matches!(operator, Operator::Add | Operator::Multiply) {
            operands.sort();
        }
        Value::Result(self.put(Operation { operator, operands, table: 0 }), false)
    }

    fn sine_cosine(&mut self, angle: &Value) -> [Value; 2] {
        if let Some(constant_operands) = self.constant_operands(&[*angle]) {
            return Floating::<f64>::default().sine_cosine(&constant_operands[0]).map(|value| self.float(value));
        }
        let operation = Operation { operator: Operator::SineCosine, operands: vec![*angle], table: 0 };
        let number = self.put(operation);
        [Value::Result(number, false), Value::Result(number, true)]
    }

    fn table(&mut self, table: &PiecewisePolynomial, x: &Value) -> Value {
        if let Some(constant_operands) = self.constant_operands(&[*x]) {
            let value = Floating::<f64>::default().table(table, &constant_operands[0]);
            return self.float(value);
        }
        let number = self.tables.get_index_of(table).unwrap_or_else(|| self.tables.insert_full(table.clone()).0);
        let operation = Operation { operator: Operator::Table, operands: vec![*x], table: number as u32 };
        Value::Result(self.put(operation), false)
    }
}

/// Compiles the requested outputs as functions of the inputs, in both orders given.
///
/// # Errors
/// The name of a symbol that an output depends on and that is no input.
pub fn compile(graph: &Graph, inputs: &[Symbol], outputs: &[(String, Expr)]) -> Result<Plan, String> {
    let exprs: Vec<Expr> = outputs.iter().map(|(_, expr)| *expr).collect();
    let places: HashMap<Symbol, u32> = inputs.iter().enumerate().map(|(k, symbol)| (*symbol, k as u32)).collect();
    if let Some(open) = graph.symbols(&exprs).into_iter().find(|symbol| !places.contains_key(symbol)) {
        return Err(graph.name(open).0.to_owned());
    }
    let mut builder = Builder::default();
    let values = lower(graph, &exprs, &mut builder, |symbol| Value::Input(places[&symbol]));
    fuse(&mut builder.operations, &values);
    let mut plan = Plan {
        inputs: inputs.iter().map(|symbol| graph.name(*symbol).0.to_owned()).collect(),
        outputs: outputs.iter().map(|(name, _)| name.clone()).collect(),
        ..Plan::default()
    };
    builder.tables.iter().for_each(|table| put_rounded(table, &mut plan));
    schedule(&builder, &values, &mut plan);
    Ok(plan)
}

/// Adds a table with its numbers.
fn put_rounded(table: &PiecewisePolynomial, plan: &mut Plan) {
    let terms = table.pieces.iter().map(|(_, coefficients)| coefficients.len()).max().unwrap_or(1);
    plan.tables.push(Table { first: plan.numbers.len(), pieces: table.pieces.len(), terms });
    plan.numbers.extend(table.knots.iter().map(rational_to_f64));
    plan.numbers.extend(table.pieces.iter().map(|(origin, _)| rational_to_f64(origin)));
    for (_, coefficients) in &table.pieces {
        let own = coefficients.iter().map(rational_to_f64);
        plan.numbers.extend(own.chain(std::iter::repeat(0.0)).take(terms));
    }
}

/// How often each result is used.
fn uses(operations: &[Operation], outputs: &[Value]) -> Vec<usize> {
    let mut uses = vec![0; operations.len()];
    let operands = operations.iter().flat_map(|operation| &operation.operands);
    for value in operands.chain(outputs) {
        if let Value::Result(number, _) = value {
            uses[*number as usize] += 1;
        }
    }
    uses
}

/// Fuses products that only one sum uses into it; the bits stay, as both are rounded one after the other.
fn fuse(operations: &mut [Operation], outputs: &[Value]) {
    let uses = uses(operations, outputs);
    for k in 0..operations.len() {
        let fused = match operations[k].operator {
            Operator::Add => Operator::AddProduct,
            Operator::Subtract => Operator::SubtractProduct,
            _ => continue,
        };
        let product = |value: &Value| match value {
            Value::Result(number, false) if uses[*number as usize] == 1 => {
                let inner = &operations[*number as usize];
                (inner.operator == Operator::Multiply).then(|| inner.operands.clone())
            }
            _ => None,
        };
        let [a, b] = [operations[k].operands[0], operations[k].operands[1]];
        let found = match (product(&b), fused) {
            (Some(factors), _) => Some((factors, a)),
            (None, Operator::AddProduct) => product(&a).map(|factors| (factors, b)),
            _ => None,
        };
        if let Some((mut operands, rest)) = found {
            operands.push(rest);
            operations[k] = Operation { operator: fused, operands, table: 0 };
        }
    }
}

/// Which operations the outputs need.
fn needed(operations: &[Operation], outputs: &[Value]) -> Vec<bool> {
    let mut needed = vec![false; operations.len()];
    let mark = |needed: &mut Vec<bool>, value: &Value| {
        if let Value::Result(number, _) = value {
            needed[*number as usize] = true;
        }
    };
    outputs.iter().for_each(|value| mark(&mut needed, value));
    for k in (0..operations.len()).rev() {
        if needed[k] {
            operations[k].operands.iter().for_each(|value| mark(&mut needed, value));
        }
    }
    needed
}

/// The operations needed in runs of one kind: always the kind of which most are ready, so that runs are long and few.
fn in_runs(operations: &[Operation], needed: &[bool]) -> (Vec<Run>, Vec<u32>) {
    let mut waiting = vec![0; operations.len()];
    let mut users: Vec<Vec<u32>> = vec![Vec::new(); operations.len()];
    let mut ready: BTreeMap<Operator, BTreeSet<u32>> = BTreeMap::new();
    for (k, operation) in operations.iter().enumerate().filter(|(k, _)| needed[*k]) {
        let result = |value: &Value| match value {
            Value::Result(number, _) => Some(*number),
            _ => None,
        };
        let own: BTreeSet<u32> = operation.operands.iter().filter_map(result).collect();
        waiting[k] = own.len();
        own.iter().for_each(|&number| users[number as usize].push(k as u32));
        if own.is_empty() {
            ready.entry(operation.operator).or_default().insert(k as u32);
        }
    }
    let (mut runs, mut order) = (Vec::new(), Vec::new());
    while let Some((&operator, _)) = ready.iter().rev().max_by_key(|(_, list)| list.len()) {
        let run = ready.remove(&operator).unwrap_or_default();
        runs.push(Run { operator, count: run.len() });
        for &user in run.iter().flat_map(|&number| &users[number as usize]) {
            waiting[user as usize] -= 1;
            if waiting[user as usize] == 0 {
                ready.entry(operations[user as usize].operator).or_default().insert(user);
            }
        }
        order.extend(run);
    }
    (runs, order)
}

/// Orders the operations, and assigns indices to all values: inputs, constants in the order of their use, results.
fn schedule(builder: &Builder, outputs: &[Value], plan: &mut Plan) {
    let (runs, order) = in_runs(&builder.operations, &needed(&builder.operations, outputs));
    let order: Vec<(u32, &Operation)> = order.into_iter().map(|k| (k, &builder.operations[k as usize])).collect();
    let inputs = plan.inputs.len() as u32;
    let mut places: HashMap<Value, u32> = HashMap::new();
    let all = order.iter().flat_map(|(_, operation)| &operation.operands).chain(outputs);
    for value in all.filter(|value| matches!(value, Value::Constant(_))) {
        let next = inputs + plan.constants.len() as u32;
        if let (Value::Constant(number), true) = (value, *places.entry(*value).or_insert(next) == next) {
            plan.constants.push(builder.constants[*number as usize]);
        }
    }
    let mut next = inputs + plan.constants.len() as u32;
    let mut rest = order.as_slice();
    for Run { operator, count } in &runs {
        let (own, later) = rest.split_at(*count);
        rest = later;
        for (k, (number, _)) in own.iter().enumerate() {
            places.insert(Value::Result(*number, false), next + k as u32);
            places.insert(Value::Result(*number, true), next + (count + k) as u32);
        }
        next += (count * operator.values()) as u32;
    }
    let place = |value: &Value| match value {
        Value::Input(number) => *number,
        other => places[other],
    };
    for (_, operation) in &order {
        plan.operands.extend((operation.operator == Operator::Table).then_some(operation.table));
        plan.operands.extend(operation.operands.iter().map(place));
    }
    plan.places = outputs.iter().map(place).collect();
    plan.runs = runs;
}
