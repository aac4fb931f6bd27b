//! Tests of `src/inversion/row_span.rs`.

use super::*;

#[test]
fn a_dependent_row_is_a_combination_of_independent_rows() {
    let row = |entries: [i64; 3]| entries.map(Rational::from).to_vec();
    let mut span = RowSpan::default();
    assert!(span.insert(&row([0, 2, 1])).is_none() && span.insert(&row([1, 1, 1])).is_none());
    assert_eq!(span.insert(&row([3, -1, 1])), Some(vec![Rational::from(-2), Rational::from(3)]));
    assert_eq!(span.rows.len(), 2);
}
