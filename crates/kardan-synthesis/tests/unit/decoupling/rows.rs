//! Tests of `src/decoupling/rows.rs`.

use super::*;

fn row(entries: &[(i64, u64)]) -> Vec<Rational> {
    entries.iter().map(|&(n, d)| Rational::from_parts(n.into(), d.into())).collect()
}

#[test]
fn smallest_whole_numbers() {
    assert_eq!(primitive(&row(&[(0, 1), (-1, 51), (1, 1), (-50, 51)])), row(&[(0, 1), (1, 1), (-51, 1), (50, 1)]));
    assert_eq!(primitive(&row(&[(0, 1), (0, 1)])), row(&[(0, 1), (0, 1)]));
    assert_eq!(unit_place(&row(&[(0, 1), (1, 1)])), Some(1));
    assert_eq!(unit_place(&row(&[(0, 1), (2, 1)])), None);
    assert_eq!(unit_place(&row(&[(1, 1), (1, 1)])), None);
}

#[test]
fn dependent_rows_are_detected() {
    let mut span = RowSpan::default();
    assert!(span.insert(&row(&[(1, 1), (2, 1), (0, 1)])).is_some());
    assert!(span.insert(&row(&[(1, 1), (0, 1), (3, 1)])).is_some());
    assert!(span.insert(&row(&[(0, 1), (1, 3), (-1, 2)])).is_none());
    assert!(span.contains(&row(&[(2, 1), (2, 1), (3, 1)])) && !span.contains(&row(&[(0, 1), (0, 1), (1, 1)])));
}
