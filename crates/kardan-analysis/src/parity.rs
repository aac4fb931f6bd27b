//! Relations between sensor readings that are true for every motion of the model.

use super::LinearSystem;
use super::parts::{reduced_form, side_by_side, stacked, window};
use kardan_math::num::{Matrix, Rational, Scalar, echelon, exact_rank};

/// A signal of a relation: a sensor reading or a command. A fault adds an arbitrary time function to one: to what a sensor reads, to what an
/// input does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ParitySignal {
    /// An output of the system.
    Output(usize),
    /// An input.
    Input(usize),
}

/// `Σ coefficient · d^derivative signal / dt^derivative = 0`, whatever the states and the unknown inputs are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Relation {
    /// Signal, derivative, coefficient; none is zero.
    pub terms: Vec<(ParitySignal, usize, Rational)>,
}

impl Relation {
    /// The highest derivative in it.
    pub fn order(&self) -> usize {
        self.terms.iter().map(|(_, derivative, _)| *derivative).max().unwrap_or(0)
    }

    /// Times a number, so that the first signal has the coefficient one in its highest derivative.
    fn normalised(mut self) -> Self {
        self.terms.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.cmp(&a.1)));
        if let Some((_, _, first)) = self.terms.first().cloned() {
            self.terms.iter_mut().for_each(|(_, _, x)| *x = x.over(&first));
        }
        self
    }
}

/// Static relations of a system.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StaticRelations {
    /// Minimal ones: of the signals in one of them none can be left out, and no part of them has a relation of its own.
    pub relations: Vec<Relation>,
    /// Whether these are all; else they are a basis of all of them, each minimal.
    pub all: bool,
    /// How many of them are independent.
    pub independent: usize,
}

/// Most sets of signals that are tried one by one.
const MOST_SETS: usize = 20_000;

/// All minimal relations between outputs and known inputs at one instant; `commanded` are numbers of inputs, all others are unknown.
///
/// Method: the rows `[C, D]` of outputs and `[0, eᵢ]` of known inputs, modulo the rows `[wᵀA, wᵀB]` with `wᵀE = 0` that are true without a
/// rate. Minimal dependent sets are the circuits of their matroid: of the relations those whose set of signals is least, found by
/// demanding zeros until one is left. Exact.
pub fn static_relations(system: &LinearSystem, commanded: &[usize]) -> StaticRelations {
    let signals: Vec<ParitySignal> = (0..system.outputs.len())
        .map(ParitySignal::Output)
        .chain(commanded.iter().map(|&j| ParitySignal::Input(j)))
        .collect();
    let rows: Vec<Vec<Rational>> = signals.iter().map(|signal| row_of(system, *signal)).collect();
    let found = left_null(&stack(&rows, &rateless(system)));
    let over_signals = window(&found, 0..found.rows(), 0..signals.len());
    let (circuits, all) = circuits(&over_signals);
    let relation = |row: Vec<Rational>| {
        let terms = signals.iter().zip(row).filter(|(_, x)| !x.is_zero()).map(|(signal, x)| (*signal, 0, x));
        Relation { terms: terms.collect() }.normalised()
    };
    let independent = exact_rank(&over_signals);
    StaticRelations { relations: circuits.into_iter().map(relation).collect(), all, independent }
}

/// Whether a static relation is true for a system with the same signals.
pub fn relation_is_satisfied(system: &LinearSystem, relation: &Relation) -> bool {
    let mut sum = vec![Rational::ZERO; system.states.len() + system.inputs.len()];
    for (signal, _, factor) in &relation.terms {
        for (sum, x) in sum.iter_mut().zip(row_of(system, *signal)).filter(|(_, x)| !x.is_zero()) {
            *sum = sum.plus(&factor.times(&x));
        }
    }
    if sum.iter().all(Scalar::is_zero) {
        return true;
    }
    let free = rateless(system);
    exact_rank(&stack(&[sum], &free)) == exact_rank(&free)
}

/// A signal over states and inputs.
fn row_of(system: &LinearSystem, signal: ParitySignal) -> Vec<Rational> {
    let (n, m) = (system.states.len(), system.inputs.len());
    match signal {
        ParitySignal::Output(k) => system.c.row(k).iter().chain(system.d.row(k)).cloned().collect(),
        ParitySignal::Input(k) => (0..n + m).map(|j| if j == n + k { Rational::ONE } else { Rational::ZERO }).collect(),
    }
}

/// The algebraic equations of states and inputs: rows `[wᵀA, wᵀB]` with `wᵀE = 0`.
fn rateless(system: &LinearSystem) -> Matrix<Rational> {
    let free = left_null(&system.e);
    side_by_side(&[&free.multiply(&system.a), &free.multiply(&system.b)])
}

/// Rows, and below them those of a matrix.
fn stack(rows: &[Vec<Rational>], below: &Matrix<Rational>) -> Matrix<Rational> {
    stacked(&[&Matrix::from_fn(rows.len(), below.columns(), |i, j| rows[i][j].clone()), below])
}

/// Independent rows w with `wᵀM = 0` that span all of them.
fn left_null(matrix: &Matrix<Rational>) -> Matrix<Rational> {
    let found = reduced_form(matrix);
    window(&found.transform, found.rank()..matrix.rows(), 0..matrix.rows())
}

/// The rows of least support in the span of the rows, each once up to a factor; whether these are all of them.
fn circuits(span: &Matrix<Rational>) -> (Vec<Vec<Rational>>, bool) {
    let basis = reduced_form(span);
    let d = basis.rank();
    if d == 0 {
        return (Vec::new(), true);
    }
    let row = |i: usize| basis.form.row(i).to_vec();
    let is_taken = |j: &usize| (0..d).any(|i| !basis.form[(i, *j)].is_zero());
    let taking: Vec<usize> = (0..span.columns()).filter(is_taken).collect();
    let independent = window(&basis.form, 0..d, 0..span.columns());
    // In echelon form each row has a pivot that no other has: it is of least support.
    if choices(taking.len(), d - 1).is_none_or(|count| count > MOST_SETS) {
        return ((0..d).map(row).collect(), false);
    }
    let mut found: Vec<Vec<Rational>> = Vec::new();
    for zeros in subsets(taking.len(), d - 1) {
        let at = Matrix::from_fn(zeros.len(), d, |k, i| basis.form[(i, taking[zeros[k]])].clone());
        let solved = reduced_form(&at);
        if solved.rank() < d - 1 {
            continue;
        }
        let circuit = solved.kernel().transpose().multiply(&independent).row(0).to_vec();
        let same = |candidate: &Vec<Rational>| candidate.iter().zip(&circuit).all(|(a, b)| a.is_zero() == b.is_zero());
        if !found.iter().any(same) {
            found.push(circuit);
        }
    }
    found.sort_by_key(|row| row.iter().map(Scalar::is_zero).collect::<Vec<_>>());
    found.sort_by_key(|row| row.iter().filter(|x| !x.is_zero()).count());
    (found, true)
}

/// How many sets of so many there are.
pub(super) fn choices(of: usize, size: usize) -> Option<usize> {
    (0..size).try_fold(1usize, |all, i| Some(all.checked_mul(of.checked_sub(i)?)? / (i + 1)))
}

/// All sets of so many numbers, in lexical order.
pub(super) fn subsets(of: usize, size: usize) -> impl Iterator<Item = Vec<usize>> {
    let first = (size <= of).then(|| (0..size).collect::<Vec<usize>>());
    std::iter::successors(first, move |set| {
        let i = (0..size).rev().find(|&i| set[i] < of - size + i)?;
        let mut next = set.clone();
        next[i] += 1;
        (i + 1..size).for_each(|j| next[j] = next[j - 1] + 1);
        Some(next)
    })
}

/// A relation that a fault breaks.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Broken {
    /// The relation.
    pub relation: Relation,
    /// Inputs that are neither known nor unknown, taken as zero, that move it.
    pub moved_by: Vec<usize>,
}

/// Most rows of the equations that are eliminated for a relation.
const MOST_ROWS: usize = 160;

/// For each fault a relation of the least order that it breaks, where there is one with few enough derivatives, and which inputs move it
/// in addition to those that are known. The inputs in `unknown` have no part in it.
///
/// Method: outputs and equations of motion with their derivatives up to the order; of the rows that cancel all states, rates and unknown
/// inputs one with few terms that the fault does not leave alone. Exact.
pub fn relations(
    system: &LinearSystem,
    faults: &[ParitySignal],
    commanded: &[usize],
    unknown: &[usize],
) -> Vec<Option<Broken>> {
    let (n, p) = (system.states.len(), system.outputs.len());
    let mut out: Vec<Option<Broken>> = vec![None; faults.len()];
    let open_inputs: Vec<usize> =
        (0..system.inputs.len()).filter(|j| !commanded.contains(j) && !unknown.contains(j)).collect();
    for order in 0..=n {
        let stacked = Stacked { system, order };
        if (order + 1) * (n + p) > MOST_ROWS || out.iter().all(Option::is_some) {
            break;
        }
        let rows = stacked.reduced(commanded, unknown);
        for (fault, found) in faults.iter().zip(&mut out).filter(|(_, found)| found.is_none()) {
            let seeing = rows.iter().filter(|row| stacked.sees(row, *fault));
            let seeing = seeing.map(|row| (stacked.relation(row, commanded), row));
            *found = seeing.min_by_key(|(relation, _)| relation.terms.len()).map(|(relation, row)| {
                let moved_by = open_inputs.iter().copied().filter(|&j| stacked.sees(row, ParitySignal::Input(j)));
                Broken { relation, moved_by: moved_by.collect() }
            });
        }
    }
    out
}

/// Outputs and equations of motion with their derivatives: rows `−y + C x + D u = 0`, then `−E ẋ + A x + B u = 0`, of order 0, 1, …
struct Stacked<'a> {
    system: &'a LinearSystem,
    order: usize,
}

impl Stacked<'_> {
    fn outputs(&self) -> usize {
        (self.order + 1) * self.system.outputs.len()
    }

    fn rows(&self) -> usize {
        (self.order + 1) * (self.system.outputs.len() + self.system.states.len())
    }

    /// The column of an input in its derivative.
    fn input(&self, input: usize, derivative: usize) -> Vec<Rational> {
        let (n, p) = (self.system.states.len(), self.system.outputs.len());
        let mut column = vec![Rational::ZERO; self.rows()];
        (0..p).for_each(|i| column[derivative * p + i] = self.system.d[(i, input)].clone());
        (0..n).for_each(|i| column[self.outputs() + derivative * n + i] = self.system.b[(i, input)].clone());
        column
    }

    /// Rows that cancel states and unknown inputs, as simple as elimination makes them.
    fn reduced(&self, commanded: &[usize], unknown: &[usize]) -> Vec<Vec<Rational>> {
        let (n, p, levels) = (self.system.states.len(), self.system.outputs.len(), self.order + 1);
        let hidden: Vec<Vec<Rational>> =
            unknown.iter().flat_map(|&d| (0..levels).map(move |k| self.input(d, k))).collect();
        let states = (levels + 1) * n;
        let matrix = Matrix::from_fn(self.rows(), states + hidden.len(), |i, j| {
            if j >= states {
                return hidden[j - states][i].clone();
            }
            let (level, state) = (j / n, j % n);
            if i < self.outputs() {
                return if i / p == level { self.system.c[(i % p, state)].clone() } else { Rational::ZERO };
            }
            let (own, row) = ((i - self.outputs()) / n, (i - self.outputs()) % n);
            match level {
                _ if level == own => self.system.a[(row, state)].clone(),
                _ if level == own + 1 => Rational::ZERO.minus(&self.system.e[(row, state)]),
                _ => Rational::ZERO,
            }
        });
        let null = left_null(&matrix);
        // Over the known signals, high derivatives first, so that few have them.
        let driven: Vec<Vec<Rational>> =
            (0..levels).rev().flat_map(|k| commanded.iter().map(move |&u| self.input(u, k))).collect();
        let width = self.outputs() + driven.len();
        let signal_rows = Matrix::from_fn(null.rows(), width + null.columns(), |i, j| match j.checked_sub(width) {
            Some(j) => null[(i, j)].clone(),
            None if j < self.outputs() => null[(i, self.outputs() - 1 - j)].clone(),
            None => dot(null.row(i), &driven[j - self.outputs()]),
        });
        let simple = echelon(&signal_rows, &(0..width).collect::<Vec<_>>());
        (0..simple.rank()).map(|i| simple.form.row(i)[width..].to_vec()).collect()
    }

    fn sees(&self, row: &[Rational], fault: ParitySignal) -> bool {
        let p = self.system.outputs.len();
        match fault {
            ParitySignal::Output(k) => (0..=self.order).any(|level| !row[level * p + k].is_zero()),
            ParitySignal::Input(j) => (0..=self.order).any(|level| !dot(row, &self.input(j, level)).is_zero()),
        }
    }

    fn relation(&self, row: &[Rational], commanded: &[usize]) -> Relation {
        let p = self.system.outputs.len();
        let read = (0..self.outputs()).map(|i| (ParitySignal::Output(i % p), i / p, row[i].clone()));
        let driven = commanded.iter().flat_map(|&j| (0..=self.order).map(move |level| (j, level)));
        let driven = driven
            .map(|(j, level)| (ParitySignal::Input(j), level, Rational::ZERO.minus(&dot(row, &self.input(j, level)))));
        Relation { terms: read.chain(driven).filter(|(_, _, x)| !x.is_zero()).collect() }.normalised()
    }
}

fn dot(row: &[Rational], column: &[Rational]) -> Rational {
    let products = row.iter().zip(column).filter(|(w, x)| !w.is_zero() && !x.is_zero());
    products.fold(Rational::ZERO, |sum, (w, x)| sum.plus(&w.times(x)))
}

#[cfg(test)]
#[path = "../tests/unit/parity.rs"]
mod tests;
