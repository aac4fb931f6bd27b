//! Tests of `src/num/sparse.rs`.

use super::super::echelon;
use super::*;
use proptest::prelude::*;

proptest! {
    /// The reduced echelon form is unique for an order of columns.
    #[test]
    fn sparse_and_dense_echelon_agree(
        values in prop::collection::vec(-2i64..3, 20),
        order in Just([0usize, 1, 2, 3, 4].to_vec()).prop_shuffle(),
    ) {
        let dense = Matrix::from_fn(4, 5, |i, j| Rational::from(values[5 * i + j]));
        let row = |i: usize| -> SparseRow {
            (0..5).filter(|j| values[5 * i + j] != 0).map(|j| (j, Rational::from(values[5 * i + j]))).collect()
        };
        let rows: Vec<SparseRow> = (0..4).map(row).collect();
        let (sparse, dense) = (sparse_echelon(&rows, &order), echelon(&dense, &order));
        prop_assert_eq!(sparse.rank(), dense.rank());
        for (row, pivot) in dense.pivots.iter().enumerate() {
            let expected: SparseRow = (0..5)
                .filter(|j| j != pivot && !dense.form[(row, *j)].is_zero())
                .map(|j| (j, dense.form[(row, j)].clone()))
                .collect();
            prop_assert_eq!(&sparse.rows[pivot], &expected);
        }
        let free: Vec<usize> = (0..5).filter(|j| !sparse.rows.contains_key(j)).collect();
        let kernel = sparse.kernel(5, &free);
        for row in &rows {
            prop_assert_eq!(project(row, &kernel), vec![]);
        }
    }
}
