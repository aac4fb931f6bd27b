//! Plans as readable text, and back.

use std::collections::HashMap;
use std::fmt;

use kardan_rt::{Operator, Run, Table};

use super::Plan;
use super::operators::{OPERATORS, word};

/// Why a text is no plan.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct PlanTextError {
    /// From 1.
    pub line: usize,
    /// The error.
    pub what: String,
}

/// One operation a line: its values, its operator, its operands; inputs by name, constants in full, values as `v1`, `v2`, …
impl fmt::Display for Plan {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for input in &self.inputs {
            writeln!(out, "input {input}")?;
        }
        for table in &self.tables {
            let numbers = |list: &[f64]| list.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ");
            let own = &self.numbers[table.first..][..table.count()];
            let (knots, own) = own.split_at(table.pieces - 1);
            let (origins, coefficients) = own.split_at(table.pieces);
            let terms = table.terms;
            writeln!(out, "table {terms} | {} | {} | {}", numbers(knots), numbers(origins), numbers(coefficients))?;
        }
        let (inputs, constants) = (self.inputs.len(), self.constants.len());
        let name = |place: usize| {
            if place < inputs {
                self.inputs[place].clone()
            } else if place < inputs + constants {
                format!("{:?}", self.constants[place - inputs])
            } else {
                format!("v{}", place - inputs - constants + 1)
            }
        };
        for operation in self.each_operation() {
            let operator = operation.operator;
            for place in &operation.out[..operator.values()] {
                write!(out, "{} ", name(*place))?;
            }
            write!(out, "= {}", word(operator))?;
            if operator == Operator::Table {
                write!(out, " {}", operation.operands[0])?;
            }
            for operand in operation.values() {
                write!(out, " {}", name(*operand))?;
            }
            writeln!(out)?;
        }
        for (output, place) in self.outputs.iter().zip(&self.places) {
            writeln!(out, "output {output} = {}", name(*place as usize))?;
        }
        Ok(())
    }
}

/// The plan of a text; lines that begin with `#` are remarks.
///
/// # Errors
/// The first line that does not fit, and why.
pub fn parse(text: &str) -> Result<Plan, PlanTextError> {
    let mut reader = Reader::default();
    for (k, line) in text.lines().enumerate() {
        reader.line(line).map_err(|what| PlanTextError { line: k + 1, what })?;
    }
    reader.finish().map_err(|what| PlanTextError { line: text.lines().count(), what })
}

/// An operand as it is written.
#[derive(Debug, Clone)]
enum Operand {
    /// An index as it is: of an input, or the number of a table.
    Place(u32),
    Constant(f64),
    Value(u32),
}

#[derive(Default)]
struct Reader {
    plan: Plan,
    inputs: HashMap<String, u32>,
    operands: Vec<Operand>,
    outputs: Vec<Operand>,
    /// The values as they are named, one after the other.
    values: Vec<u32>,
    /// Where the last run began, in operands that name values.
    run_first: u32,
    done: u32,
}

impl Reader {
    fn operand(&self, word: &str) -> Result<Operand, String> {
        if let Some(place) = self.inputs.get(word) {
            return Ok(Operand::Place(*place));
        }
        if let Some(number) = word.strip_prefix('v').and_then(|rest| rest.parse::<u32>().ok()).filter(|n| *n > 0) {
            return Ok(Operand::Value(number - 1));
        }
        word.parse().map(Operand::Constant).map_err(|_| format!("`{word}` is not an input, a value or a number"))
    }

    fn line(&mut self, line: &str) -> Result<(), String> {
        let tokens: Vec<&str> = line.split_whitespace().collect();
        match tokens.as_slice() {
            [] => Ok(()),
            [first, ..] if first.starts_with('#') => Ok(()),
            ["input", name] => {
                self.inputs.insert((*name).to_owned(), self.plan.inputs.len() as u32);
                self.plan.inputs.push((*name).to_owned());
                Ok(())
            }
            ["table", ..] => self.table(line),
            ["output", name, "=", value] => {
                let value = self.operand(value)?;
                self.plan.outputs.push((*name).to_owned());
                self.outputs.push(value);
                Ok(())
            }
            [value, "=", operator, operands @ ..] => self.operation(&[value], operator, operands),
            [sine, cosine, "=", operator, operands @ ..] => self.operation(&[sine, cosine], operator, operands),
            _ => Err("this is not a line of a plan".into()),
        }
    }

    fn table(&mut self, line: &str) -> Result<(), String> {
        let parts: Vec<&str> = line.trim_start_matches("table").split('|').collect();
        let [terms, knots, origins, coefficients] = parts.as_slice() else {
            return Err("a table has four parts".into());
        };
        let numbers = |text: &str| {
            let number = |word: &str| word.parse::<f64>().map_err(|_| format!("`{word}` is not a number"));
            text.split_whitespace().map(number).collect::<Result<Vec<f64>, String>>()
        };
        let terms: usize = terms
            .trim()
            .parse()
            .map_err(|_| "the number of terms of the table is missing or not an integer".to_owned())?;
        let (knots, origins, coefficients) = (numbers(knots)?, numbers(origins)?, numbers(coefficients)?);
        if origins.len() != knots.len() + 1 || Some(coefficients.len()) != origins.len().checked_mul(terms) {
            return Err("knots, origins and coefficients of the table have inconsistent counts".into());
        }
        self.plan.tables.push(Table { first: self.plan.numbers.len(), pieces: origins.len(), terms });
        self.plan.numbers.extend([knots, origins, coefficients].concat());
        Ok(())
    }

    fn operation(&mut self, results: &[&str], operator: &str, operands: &[&str]) -> Result<(), String> {
        let found = OPERATORS.iter().find(|(_, word)| *word == operator);
        let operator = found.ok_or_else(|| format!("there is no operation `{operator}`"))?.0;
        if results.len() != operator.values() || operands.len() != operator.operands() {
            return Err(format!(
                "`{}` takes {} operands and returns {}",
                word(operator),
                operator.operands(),
                operator.values()
            ));
        }
        let number = |word: &&str| match self.operand(word)? {
            Operand::Value(number) => Ok(number),
            _ => Err(format!("`{word}` is not a value")),
        };
        let results: Vec<u32> = results.iter().map(number).collect::<Result<_, String>>()?;
        let mut own = Vec::new();
        for (k, word) in operands.iter().enumerate() {
            own.push(match (operator, k) {
                (Operator::Table, 0) => Operand::Place(word.parse().map_err(|_| format!("`{word}` is not a table"))?),
                _ => self.operand(word)?,
            });
        }
        let inside = own.iter().any(|operand| matches!(operand, Operand::Value(number) if *number >= self.run_first));
        match self.plan.runs.last_mut() {
            Some(run) if run.operator == operator && !inside => run.count += 1,
            _ => {
                self.run_first = self.done;
                if own.iter().any(|operand| matches!(operand, Operand::Value(number) if *number >= self.done)) {
                    return Err("an operand is defined later".into());
                }
                self.plan.runs.push(Run { operator, count: 1 });
            }
        }
        self.done += operator.values() as u32;
        self.values.extend(results);
        self.operands.extend(own);
        Ok(())
    }

    fn finish(mut self) -> Result<Plan, String> {
        let mut names = self.values.clone();
        names.sort_unstable();
        if names.iter().enumerate().any(|(k, name)| *name as usize != k) {
            return Err("the values v1, v2, … must each be defined once".into());
        }
        let inputs = self.plan.inputs.len() as u32;
        let mut index: HashMap<u64, u32> = HashMap::new();
        // Constants are in the order of the plan: that of their first use, values apart.
        let constants: Vec<f64> = self
            .operands
            .iter()
            .chain(&self.outputs)
            .filter_map(|operand| match operand {
                Operand::Constant(value) => Some(*value),
                _ => None,
            })
            .collect();
        for value in constants {
            let next = self.plan.constants.len() as u32;
            if *index.entry(value.to_bits()).or_insert(next) == next {
                self.plan.constants.push(value);
            }
        }
        let count = self.plan.constants.len() as u32;
        let place = |operand: &Operand| match operand {
            Operand::Place(place) => *place,
            Operand::Constant(value) => inputs + index[&value.to_bits()],
            Operand::Value(number) => inputs + count + number,
        };
        self.plan.operands = self.operands.iter().map(place).collect();
        self.plan.places = self.outputs.iter().map(place).collect();
        Ok(self.plan)
    }
}
