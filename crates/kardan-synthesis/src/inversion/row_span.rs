//! The span of exact rows, built one row at a time.

use crate::decoupling::{add, subtract};
use kardan_math::num::{Rational, Scalar};

/// Independent rows, one added after the other, and how any row in their span is made of them. Exact.
#[derive(Debug, Clone, Default)]
pub(super) struct RowSpan {
    /// Pivot, the row reduced by those before it with 1 at the pivot, and its weights on the rows as they were added.
    rows: Vec<(usize, Vec<Rational>, Vec<Rational>)>,
}

impl RowSpan {
    /// Adds a row. If it is a combination of those that are there, it is not added and its weights are the result.
    pub(super) fn insert(&mut self, row: &[Rational]) -> Option<Vec<Rational>> {
        let count = self.rows.len();
        let mut rest = row.to_vec();
        let mut weights = vec![Rational::ZERO; count];
        for (pivot, spanning, made_of) in &self.rows {
            let factor = rest[*pivot].clone();
            if !factor.is_zero() {
                subtract(&mut rest, &factor, spanning);
                add(&mut weights, &factor, made_of);
            }
        }
        let Some(pivot) = rest.iter().position(|x| !Scalar::is_zero(x)) else { return Some(weights) };
        let lead = rest[pivot].clone();
        rest.iter_mut().filter(|x| !Scalar::is_zero(*x)).for_each(|x| *x = x.over(&lead));
        let mut made_of: Vec<Rational> = weights.iter().map(|w| Rational::ZERO.minus(w).over(&lead)).collect();
        made_of.push(Rational::ONE.over(&lead));
        self.rows.push((pivot, rest, made_of));
        None
    }
}

#[cfg(test)]
#[path = "../../tests/unit/inversion/row_span.rs"]
mod tests;
