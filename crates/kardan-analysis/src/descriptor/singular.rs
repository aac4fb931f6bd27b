//! Why a pencil is singular: dependent equations.

use crate::parts::{left_kernel, pencil_at, rows_of};
use kardan_math::num::{Matrix, Polynomial, Rational, Scalar};

/// Most numbers of an unknown combination in the search.
const MOST_UNKNOWN: usize = 400;

/// A pencil sE − A whose determinant is zero for all s.
#[derive(Debug, Clone, PartialEq)]
pub struct SingularPencil {
    /// Rows of the pencil, from 0, with factors: together they are zero for all s. A factor that is `None` is not known.
    pub equations: Vec<(usize, Option<Polynomial>)>,
}

impl SingularPencil {
    /// At a number s that is no root of a minor the rows that depend on each other are those that do so for all s; among
    /// them the factors are polynomials of least degree.
    pub(super) fn of(e: &Matrix<Rational>, a: &Matrix<Rational>) -> Self {
        let at = Rational::from(1_000_003) / Rational::from(7919);
        let dependent = left_kernel(&pencil_at(e, a, &at));
        let taken = |i: usize| (0..e.rows()).filter(|&j| !dependent[(i, j)].is_zero()).collect::<Vec<usize>>();
        let rows = (0..dependent.rows()).map(taken).min_by_key(Vec::len).unwrap_or_default();
        let (e, a) = (rows_of(e, &rows), rows_of(a, &rows));
        let degrees = (0..rows.len()).take_while(|degree| (degree + 1) * rows.len() <= MOST_UNKNOWN);
        let factors = degrees.into_iter().find_map(|degree| combination(&e, &a, degree));
        let factor_of = |i: usize| factors.as_ref().map(|all| all[i].clone());
        let all = rows.iter().enumerate().map(|(i, &row)| (row, factor_of(i)));
        Self { equations: all.filter(|(_, factor)| factor.as_ref().is_none_or(|one| !one.is_zero())).collect() }
    }
}

/// Polynomials w of this degree with `w(s) (sE − A) = 0`: `w₀A = 0`, `w₀E = w₁A`, …, `w_d E = 0`.
fn combination(e: &Matrix<Rational>, a: &Matrix<Rational>, degree: usize) -> Option<Vec<Polynomial>> {
    let (rows, columns) = (e.rows(), e.columns());
    let minus_a = a.scale(&Rational::NEG_ONE);
    let equations = Matrix::from_fn((degree + 1) * rows, (degree + 2) * columns, |i, j| {
        let (block, power) = (i / rows, j / columns);
        let at = (i % rows, j % columns);
        match power.checked_sub(block) {
            Some(0) => minus_a[at].clone(),
            Some(1) => e[at].clone(),
            _ => Rational::ZERO,
        }
    });
    let found = left_kernel(&equations);
    let first = (found.rows() > 0).then(|| found.row(0))?;
    let factor = |i: usize| Polynomial::new((0..=degree).map(|power| first[power * rows + i].clone()).collect());
    let all: Vec<Polynomial> = (0..rows).map(factor).collect();
    // The first one begins with one.
    let leading = all.iter().find(|one| !one.is_zero()).map(|one| one.coefficient(one.degree()))?;
    let scale = Rational::ONE.over(&leading);
    Some(all.into_iter().map(|one| one.scale(&scale)).collect())
}
