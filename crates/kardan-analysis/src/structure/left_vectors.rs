//! Proofs that a rank is not larger: left vectors that no input reaches.

use std::cmp::Ordering;

use super::limits::Limits;
use crate::images::{Image, Images, values};
use crate::parts::texts;
use kardan_math::num::{Matrix, ModularMatrix, Rational, Scalar, reachable};
use kardan_results::Invariant;

/// Independent rows Y with `Y A = M Y E` and `Y B = 0`, exact.
pub(super) struct InvariantRows {
    /// Y.
    pub rows: Matrix<Rational>,
    /// M.
    pub action: Matrix<Rational>,
}

impl InvariantRows {
    /// For the certificate.
    pub fn into_fractions(self) -> Invariant {
        Invariant { rows: texts(&self.rows), action: texts(&self.action) }
    }
}

/// A result modulo primes is wrong over the rationals.
pub(super) struct ModularMismatch;

/// Y and M, found modulo primes, checked exactly; `None` if the fractions are too large.
///
/// # Errors
/// If some prime shows fewer such rows, or what several of them agree on is wrong.
pub(super) fn invariant_rows(
    images: &mut Images<'_>,
    count: usize,
    limits: &Limits,
) -> Result<Option<InvariantRows>, ModularMismatch> {
    let n = images.system().states.len();
    if count * (n + count) > limits.numbers {
        return Ok(None);
    }
    let system = images.system();
    let larger = std::cell::Cell::new(false);
    let modular = |image: &Image| {
        let field = &image.field;
        let part = reachable(field, &image.g, &image.b);
        let unreached = part.span.basis(n).null_space(field);
        image.inverse_e.multiply_from_left(field, &unreached).echelon(field).0
    };
    let all = |image: &Image, rows: ModularMatrix| {
        let field = &image.field;
        let on_e = rows.multiply(field, &ModularMatrix::from_rational(field, &system.e)?);
        let on_a = on_e.multiply(field, &image.g);
        let pivots = on_e.clone().echelon(field).1;
        let pick = |m: &ModularMatrix| ModularMatrix::from_fn(count, count, |i, j| m.row(j)[pivots[i]]);
        let action = pick(&on_e).solve(field, &pick(&on_a))?.0.transpose();
        Some([values(field, &rows), values(field, &action)].concat())
    };
    let flat = images.reconstruct_if(limits.primes, |image| {
        let rows = modular(image);
        match rows.rows.cmp(&count) {
            Ordering::Less => {
                larger.set(true);
                None
            }
            Ordering::Equal => Some(all(image, rows)),
            Ordering::Greater => Some(None),
        }
    });
    if larger.get() {
        return Err(ModularMismatch);
    }
    let Some(flat) = flat else { return Ok(None) };
    let rows = Matrix::from_fn(count, n, |i, j| flat[i * n + j].clone());
    let action = Matrix::from_fn(count, count, |i, j| flat[count * n + i * count + j].clone());
    let (on_e, on_a) = (rows.multiply(&system.e), rows.multiply(&system.a));
    // The rows are in echelon form, hence independent.
    let leads = (0..count).map(|i| rows.row(i).iter().position(|x| !x.is_zero())).collect::<Option<Vec<_>>>();
    let independent = leads.is_some_and(|leads| leads.is_sorted_by(|a, b| a < b));
    let unreached = rows.multiply(&system.b).as_slice().iter().all(Scalar::is_zero);
    let proven = independent && unreached && action.multiply(&on_e) == on_a;
    if proven { Ok(Some(InvariantRows { rows, action })) } else { Err(ModularMismatch) }
}
