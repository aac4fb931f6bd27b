//! Tests of `src/decoupling/annihilator.rs`.

use super::*;

fn matrix(rows: &[&[i64]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]))
}

#[test]
fn left_null_space_of_the_controllability_matrix() {
    // x1 and x2 have the same input; x3 is not reached.
    let a = matrix(&[&[2, 0, 1], &[0, 2, 5], &[0, 0, 7]]);
    let rows = annihilator(&a, &matrix(&[&[3], &[6], &[0]]));
    assert_eq!(rows, matrix(&[&[-2, 1, 0], &[0, 0, 1]]));
    // The eigenvalue 2 has two eigenvectors, so one input reaches two states and two inputs all.
    assert_eq!(annihilator(&a, &matrix(&[&[0], &[1], &[1]])).rows(), 1);
    assert_eq!(annihilator(&a, &matrix(&[&[0, 0], &[1, 1], &[1, 0]])).rows(), 0);
    assert_eq!(annihilator(&a, &Matrix::zeros(3, 0)), Matrix::identity(3));
    assert_eq!(annihilator(&Matrix::zeros(0, 0), &Matrix::zeros(0, 2)).rows(), 0);
}
