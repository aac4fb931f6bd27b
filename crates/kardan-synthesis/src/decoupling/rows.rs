//! Products and matrices of exact rows.

use dashu_int::ops::Gcd;
use dashu_int::{IBig, UBig};

use kardan_math::num::{Matrix, Rational, Scalar, common_denominator, echelon, whole_multiple};

/// `row · matrix`.
pub(crate) fn row_times(row: &[Rational], matrix: &Matrix<Rational>) -> Vec<Rational> {
    let mut out = vec![Rational::ZERO; matrix.columns()];
    for (k, factor) in row.iter().enumerate().filter(|(_, factor)| !Scalar::is_zero(*factor)) {
        add(&mut out, factor, matrix.row(k));
    }
    out
}

/// `target += factor · row`; the row may be shorter.
pub(crate) fn add(target: &mut [Rational], factor: &Rational, row: &[Rational]) {
    for (x, y) in target.iter_mut().zip(row).filter(|(_, y)| !Scalar::is_zero(*y)) {
        *x = x.plus(&factor.times(y));
    }
}

/// `target −= factor · row`.
pub(crate) fn subtract(target: &mut [Rational], factor: &Rational, row: &[Rational]) {
    for (x, y) in target.iter_mut().zip(row).filter(|(_, y)| !Scalar::is_zero(*y)) {
        *x = x.minus(&factor.times(y));
    }
}

/// Rows of that length as a matrix.
pub(super) fn stack(rows: &[Vec<Rational>], columns: usize) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), columns, |i, j| rows[i][j].clone())
}

/// Rows x with `M xᵀ = 0`, in reduced echelon form.
pub(crate) fn null_rows(m: &Matrix<Rational>) -> Matrix<Rational> {
    // Free columns first, so that the result has its leading ones early.
    let descending: Vec<usize> = (0..m.columns()).rev().collect();
    echelon(m, &descending).kernel().transpose()
}

/// The unit row e_k.
pub(super) fn unit(k: usize, length: usize) -> Vec<Rational> {
    (0..length).map(|j| if j == k { Rational::ONE } else { Rational::ZERO }).collect()
}

/// The place of the one of a unit row; `None` for any other row.
pub(super) fn unit_place(row: &[Rational]) -> Option<usize> {
    let place = row.iter().position(|x| !Scalar::is_zero(x))?;
    (row[place] == Rational::ONE && row[place + 1..].iter().all(Scalar::is_zero)).then_some(place)
}

/// The same direction in whole numbers without common divisor, the first one positive; zeros stay.
pub(crate) fn primitive(row: &[Rational]) -> Vec<Rational> {
    let common = common_denominator(row);
    let numbers: Vec<IBig> = row.iter().map(|x| whole_multiple(x, &common)).collect();
    let divisor = numbers.iter().filter(|x| **x != IBig::ZERO).fold(UBig::ZERO, |all, x| {
        let size = x.clone().into_parts().1;
        if all.is_zero() { size } else { Gcd::gcd(&all, &size) }
    });
    if divisor.is_zero() {
        return row.to_vec();
    }
    let negative = numbers.iter().find(|x| **x != IBig::ZERO).is_some_and(|x| *x < IBig::ZERO);
    let divisor = if negative { -IBig::from(divisor) } else { IBig::from(divisor) };
    numbers.into_iter().map(|x| Rational::from(x / &divisor)).collect()
}

/// A growing space of rows with an exact basis in echelon form.
#[derive(Debug, Clone, Default)]
pub(crate) struct RowSpan {
    /// Pivot columns and rows; every row is zero in the pivots of those before it.
    rows: Vec<(usize, Vec<Rational>)>,
}

impl RowSpan {
    /// The remainder of a row modulo the space.
    pub fn reduce(&self, row: &[Rational]) -> Vec<Rational> {
        let mut rest = row.to_vec();
        for (pivot, basis) in &self.rows {
            if Scalar::is_zero(&rest[*pivot]) {
                continue;
            }
            let factor = rest[*pivot].over(&basis[*pivot]);
            subtract(&mut rest, &factor, basis);
        }
        rest
    }

    /// Adds a row; returns its new part, as whole numbers, or `None` if it was in the space already.
    pub fn insert(&mut self, row: &[Rational]) -> Option<&[Rational]> {
        let rest = primitive(&self.reduce(row));
        let pivot = rest.iter().position(|x| !Scalar::is_zero(x))?;
        self.rows.push((pivot, rest));
        self.rows.last().map(|(_, row)| row.as_slice())
    }

    /// Whether a row is in the space.
    pub fn contains(&self, row: &[Rational]) -> bool {
        self.reduce(row).iter().all(Scalar::is_zero)
    }
}

#[cfg(test)]
#[path = "../../tests/unit/decoupling/rows.rs"]
mod tests;
