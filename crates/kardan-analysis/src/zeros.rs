//! Invariant zeros of a system.

use super::images::Image;
use kardan_math::num::{ModularMatrix, Polynomial, PrimeField, Random, Residue, invariant_factors};
use kardan_results::{Complex, Zeros};

/// The finite structure of the system matrix `S(s) = [sE − A, −B; C, D]` modulo a prime.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ZeroStructure {
    /// Rank of S over the rational functions.
    pub rank: usize,
    /// Non-trivial invariant polynomials of S, each dividing the next.
    pub factors: Vec<Vec<Residue>>,
}

impl ZeroStructure {
    /// Deterministic but for the time it takes, O(n³).
    ///
    /// Method: states that outputs without direct feedthrough force to vanish are eliminated, which turns their equations
    /// into outputs, until the feedthrough has full row rank; the same for the transposed system makes it square and
    /// regular (Emami-Naeini and Van Dooren 1982). Every step multiplies S by unimodular matrices and drops rows and
    /// columns of zeros or with a constant pivot. The rest, `[sI − A, −B; C, D]` with a regular D, has the invariant
    /// polynomials of `sI − A + BD⁻¹C`.
    pub fn of(image: &Image) -> Self {
        let field = &image.field;
        let mut quad = Quad::new(image);
        let first = quad.reduce(field);
        quad = quad.transpose();
        let second = quad.reduce(field);
        let (n, m) = (quad.states.len(), quad.outputs.len());
        assert_eq!(m, quad.inputs, "the feedthrough is square in the end");
        let rank = first + second + n + m;
        // B D⁻¹ C by way of D X = C.
        let at = |row: &[Residue], j: usize| row[quad.states[j]];
        let total = quad.total;
        let d = ModularMatrix::from_fn(m, m, |i, j| quad.outputs[i][total + j]);
        let c = ModularMatrix::from_fn(m, n, |i, j| at(&quad.outputs[i], j));
        let b = ModularMatrix::from_fn(n, m, |i, j| quad.equations[quad.states[i]][total + j]);
        let a = ModularMatrix::from_fn(n, n, |i, j| at(&quad.equations[quad.states[i]], j));
        let (x, _) = d.solve(field, &c).expect("the feedthrough is regular in the end");
        let z = a.plus(field, field.negate(field.one()), &b.multiply(field, &x));
        let factors = invariant_factors(field, &z, &mut Random::new(field.prime() ^ 0x5a));
        Self { rank, factors }
    }

    /// Sum of the degrees: the number of zeros.
    pub fn degree(&self) -> usize {
        self.factors.iter().map(|f| f.len() - 1).sum()
    }
}

/// `ẋ = A x + B u`, `y = C x + D u` while states are eliminated; rows contain the states (all of them, those that are eliminated
/// with zeros), then the inputs.
struct Quad {
    total: usize,
    inputs: usize,
    /// States that are left.
    states: Vec<usize>,
    equations: Vec<Vec<Residue>>,
    outputs: Vec<Vec<Residue>>,
}

impl Quad {
    fn new(image: &Image) -> Self {
        let join = |left: &[Residue], right: &[Residue]| [left, right].concat();
        let total = image.g.rows;
        Self {
            total,
            inputs: image.b.columns,
            states: (0..total).collect(),
            equations: (0..total).map(|i| join(image.g.row(i), image.b.row(i))).collect(),
            outputs: (0..image.c.rows).map(|i| join(image.c.row(i), image.d.row(i))).collect(),
        }
    }

    fn transpose(self) -> Self {
        let (n, outputs) = (self.states.len(), self.outputs.len());
        let transposed = |column: usize| {
            let of_states = self.states.iter().map(|&i| self.equations[i][column]);
            of_states.chain(self.outputs.iter().map(|row| row[column])).collect()
        };
        Self {
            total: n,
            inputs: outputs,
            states: (0..n).collect(),
            equations: self.states.iter().map(|&column| transposed(column)).collect(),
            outputs: (self.total..self.total + self.inputs).map(transposed).collect(),
        }
    }

    /// Eliminates states until D has full row rank; the number of states that went.
    fn reduce(&mut self, field: &PrimeField) -> usize {
        let mut eliminated = 0;
        loop {
            let inputs: Vec<usize> = (self.total..self.total + self.inputs).collect();
            let pivots = eliminate(field, &mut self.outputs, &inputs);
            // Outputs without feedthrough.
            let mut silent = self.outputs.split_off(pivots.len());
            let pivots = eliminate(field, &mut silent, &self.states);
            silent.truncate(pivots.len());
            if pivots.is_empty() {
                return eliminated;
            }
            eliminated += pivots.len();
            self.states.retain(|state| !pivots.contains(state));
            for &state in &self.states {
                substitute(field, &mut self.equations[state], &silent, &pivots);
            }
            for row in &mut self.outputs {
                substitute(field, row, &silent, &pivots);
            }
            // The equation of `w = x_pivot + (row) x = 0`: its rate vanishes too.
            for (row, &pivot) in silent.iter().zip(&pivots) {
                let mut rate = std::mem::take(&mut self.equations[pivot]);
                substitute(field, &mut rate, &silent, &pivots);
                for &state in self.states.iter().filter(|&&state| row[state] != 0) {
                    subtract(field, &mut rate, field.negate(row[state]), &self.equations[state]);
                }
                self.outputs.push(rate);
            }
        }
    }
}

/// `target −= factor · row`, where most of the row is zero.
fn subtract(field: &PrimeField, target: &mut [Residue], factor: Residue, row: &[Residue]) {
    for (x, &y) in target.iter_mut().zip(row).filter(|(_, y)| **y != 0) {
        *x = field.minus(*x, field.times(factor, y));
    }
}

/// Replaces the pivot states of `row` by their values from the other rows, which are zero.
fn substitute(field: &PrimeField, row: &mut [Residue], zero: &[Vec<Residue>], pivots: &[usize]) {
    for (pivot_row, &pivot) in zero.iter().zip(pivots) {
        let factor = row[pivot];
        if factor != 0 {
            subtract(field, row, factor, pivot_row);
        }
    }
}

/// Reduced row echelon form with respect to some columns; gives the pivots, whose rows come first.
fn eliminate(field: &PrimeField, rows: &mut [Vec<Residue>], columns: &[usize]) -> Vec<usize> {
    let mut pivots = Vec::new();
    for &column in columns {
        let rank = pivots.len();
        if rank == rows.len() {
            break;
        }
        let Some(pivot) = (rank..rows.len()).find(|&i| rows[i][column] != 0) else { continue };
        rows.swap(rank, pivot);
        let inverse = field.inverse(rows[rank][column]);
        rows[rank].iter_mut().filter(|x| **x != 0).for_each(|x| *x = field.times(*x, inverse));
        let row = std::mem::take(&mut rows[rank]);
        for target in rows.iter_mut() {
            if target.get(column).is_some_and(|&x| x != 0) {
                let factor = target[column];
                subtract(field, target, factor, &row);
            }
        }
        rows[rank] = row;
        pivots.push(column);
    }
    pivots
}

/// Zeros as text and numbers; `polynomial` is their monic polynomial or `None` if it is not written out.
pub(super) fn described(rank: usize, n: usize, degree: usize, polynomial: Option<&Polynomial>) -> Zeros {
    let normal_rank = rank - n;
    let Some(polynomial) = polynomial else {
        let polynomial = format!("(degree {degree}, not written out)");
        return Zeros { polynomial, values: Vec::new(), growing: None, normal_rank };
    };
    // Proven roots are on the right side of the axis, and on it only if they are so exactly.
    let proven = polynomial.proven_roots();
    let growing = proven.as_ref().map(|roots| roots.iter().filter(|root| root.0 > 0.0).count());
    let values = proven.unwrap_or_else(|| polynomial.roots());
    let values = Complex::list(values);
    Zeros { polynomial: polynomial.to_string(), values, growing, normal_rank }
}
