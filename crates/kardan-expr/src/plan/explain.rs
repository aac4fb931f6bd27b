//! The origin of a value that is not finite.

use std::collections::BTreeMap;

use kardan_rt::Operator;

use super::operators::word;
use super::{Operation, Plan};

/// Nesting depth of operations that are written out; deeper ones are written as their value.
const DEPTH: usize = 3;

impl Plan {
    /// The first operation with finite operands and a result that is not finite, at the values of a memory, as text:
    /// the operation as a formula, and its operands' values. `None` where all results are finite or an input is not.
    ///
    /// ```
    /// use kardan_expr::expr::Graph;
    /// use kardan_expr::plan::compile;
    /// use kardan_math::units::Dimension;
    /// let mut graph = Graph::default();
    /// let [x, y] = ["x", "y"].map(|name| graph.symbol(name, Dimension::NONE));
    /// let difference = graph.subtract(x, y);
    /// let quotient = graph.divide(x, difference);
    /// let symbols = [x, y].map(|expr| graph.symbol_of(expr).unwrap());
    /// let plan = compile(&graph, &symbols, &[("q".into(), quotient)]).unwrap();
    /// let mut memory = plan.memory();
    /// memory[..2].copy_from_slice(&[3.0, 3.0]);
    /// assert!(!plan.block().evaluate(&mut memory));
    /// assert_eq!(plan.not_finite(&memory).unwrap(), "x/(x - y) = 3.0/0.0 is inf");
    /// ```
    pub fn not_finite(&self, memory: &[f64]) -> Option<String> {
        let results = self.results();
        let is_finite = |place: &usize| memory[*place].is_finite();
        let (place, _) =
            results.iter().find(|(place, result)| !is_finite(place) && result.values().iter().all(is_finite))?;
        let writing = Writing { plan: self, memory, results: &results };
        let (named, numbers) = (writing.infix(*place, DEPTH), writing.operation(*place, &results[place], 0));
        let numbers = if named == numbers { String::new() } else { format!(" = {numbers}") };
        Some(format!("{named}{numbers} is {}", memory[*place]))
    }

    /// An output as a formula, a few operations deep; deeper operations are written as their value in a memory.
    pub fn formatted(&self, output: usize, memory: &[f64]) -> String {
        Writing { plan: self, memory, results: &self.results() }.infix(self.place(output), DEPTH)
    }

    /// The operation that computes each index behind inputs and constants.
    fn results(&self) -> BTreeMap<usize, Operation> {
        self.each_operation().flat_map(|operation| operation.out.map(|place| (place, operation))).collect()
    }
}

/// Values as text.
struct Writing<'a> {
    plan: &'a Plan,
    memory: &'a [f64],
    results: &'a BTreeMap<usize, Operation>,
}

impl Writing<'_> {
    /// A value as a formula, `depth` operations deep.
    fn infix(&self, place: usize, depth: usize) -> String {
        match (self.plan.inputs.get(place), self.results.get(&place)) {
            (Some(input), _) if depth > 0 => input.clone(),
            (None, Some(result)) if depth > 0 => self.operation(place, result, depth - 1),
            _ => format!("{:?}", self.memory[place]),
        }
    }

    /// An operation as one of its values, its operands `depth` operations deep.
    fn operation(&self, place: usize, result: &Operation, depth: usize) -> String {
        let operands = result.values();
        let inner = |k: usize| self.infix(operands[k], depth);
        // A term that is not a single word or call is in parentheses.
        let part = |k: usize| {
            let text = inner(k);
            let word = |text: &str| text.chars().all(|c| c.is_alphanumeric() || c == '.' || c == '_');
            let single =
                word(&text) || text.ends_with(')') && text.split('(').next().is_some_and(|f| !f.is_empty() && word(f));
            if single { text } else { format!("({text})") }
        };
        match result.operator {
            Operator::Add => format!("{} + {}", inner(0), inner(1)),
            Operator::Subtract => format!("{} - {}", inner(0), part(1)),
            Operator::Negate => format!("-{}", part(0)),
            Operator::Multiply => format!("{}*{}", part(0), part(1)),
            Operator::Divide => format!("{}/{}", part(0), part(1)),
            Operator::AddProduct => format!("{} + {}*{}", inner(2), part(0), part(1)),
            Operator::SubtractProduct => format!("{} - {}*{}", inner(2), part(0), part(1)),
            Operator::SineCosine if place == result.out[1] => format!("cos({})", inner(0)),
            Operator::SineCosine => format!("sin({})", inner(0)),
            other => {
                let list: Vec<String> = (0..operands.len()).map(inner).collect();
                format!("{}({})", word(other), list.join(", "))
            }
        }
    }
}
