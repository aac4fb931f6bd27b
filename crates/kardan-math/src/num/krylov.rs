//! Matrices over a prime field as operators, and the recurrences of their Krylov sequences.

use super::{ModularMatrix, PrimeField, Residue};

/// A square matrix over a prime field for many products with vectors: rows with few entries are stored without their zeros.
#[derive(Debug, Clone)]
pub struct Operator {
    rows: Vec<OperatorRow>,
}

#[derive(Debug, Clone)]
enum OperatorRow {
    Dense(Vec<Residue>),
    Sparse(Vec<usize>, Vec<Residue>),
}

impl Operator {
    /// From a matrix.
    pub fn new(matrix: &ModularMatrix) -> Self {
        let row = |i: usize| {
            let row = matrix.row(i);
            let places: Vec<usize> = (0..row.len()).filter(|&j| row[j] != 0).collect();
            if 2 * places.len() > row.len() {
                return OperatorRow::Dense(row.to_vec());
            }
            let values = places.iter().map(|&j| row[j]).collect();
            OperatorRow::Sparse(places, values)
        };
        Self { rows: (0..matrix.rows).map(row).collect() }
    }

    /// The product with a vector.
    pub fn apply(&self, field: &PrimeField, x: &[Residue]) -> Vec<Residue> {
        let mut gathered = Vec::new();
        let product = |row: &OperatorRow| match row {
            OperatorRow::Dense(values) => field.dot(values, x),
            OperatorRow::Sparse(places, values) => {
                gathered.clear();
                gathered.extend(places.iter().map(|&j| x[j]));
                field.dot(values, &gathered)
            }
        };
        self.rows.iter().map(product).collect()
    }

    /// The product with a matrix of few columns.
    pub fn multiply(&self, field: &PrimeField, right: &ModularMatrix) -> ModularMatrix {
        let columns: Vec<Vec<Residue>> = (0..right.columns).map(|j| self.apply(field, &right.column(j))).collect();
        ModularMatrix::from_fn(self.rows.len(), right.columns, |i, j| columns[j][i])
    }

    /// The product of a matrix with this one, which is square.
    pub fn multiply_from_left(&self, field: &PrimeField, left: &ModularMatrix) -> ModularMatrix {
        let mut out = ModularMatrix::zeros(left.rows, self.rows.len());
        for i in 0..left.rows {
            for (row, &x) in self.rows.iter().zip(left.row(i)).filter(|(_, x)| **x != 0) {
                let target = out.row_mut(i);
                match row {
                    OperatorRow::Dense(values) => field.subtract(target, field.negate(x), values),
                    OperatorRow::Sparse(places, values) => {
                        for (&j, &y) in places.iter().zip(values) {
                            target[j] = field.plus(target[j], field.times(x, y));
                        }
                    }
                }
            }
        }
        out
    }
}

/// The monic polynomial of least degree whose recurrence the sequence obeys, coefficients of 1, s, s², …
///
/// It is determined by the sequence if that has at least two times as many terms as the degree (Berlekamp and Massey). Cost:
/// length² / 2.
pub fn recurrence(field: &PrimeField, sequence: &[Residue]) -> Vec<Residue> {
    let count = sequence.len();
    let reversed: Vec<Residue> = sequence.iter().rev().copied().collect();
    // c_0 s_i + c_1 s_{i−1} + … = 0 for all i so far.
    let mut current = vec![field.one()];
    let mut previous = current.clone();
    let (mut degree, mut gap, mut last) = (0, 1, field.one());
    for i in 0..count {
        let used = current.len().min(degree + 1);
        let discrepancy = field.dot(&current[..used], &reversed[count - 1 - i..count - 1 - i + used]);
        if discrepancy == 0 {
            gap += 1;
            continue;
        }
        let factor = field.times(discrepancy, field.inverse(last));
        let before = (2 * degree <= i).then(|| current.clone());
        current.resize(current.len().max(previous.len() + gap), 0);
        field.subtract(&mut current[gap..], factor, &previous);
        match before {
            Some(before) => {
                degree = i + 1 - degree;
                previous = before;
                last = discrepancy;
                gap = 1;
            }
            None => gap += 1,
        }
    }
    current.resize(degree + 1, 0);
    current.reverse();
    current
}

#[cfg(test)]
#[path = "../../tests/unit/num/krylov.rs"]
mod tests;
