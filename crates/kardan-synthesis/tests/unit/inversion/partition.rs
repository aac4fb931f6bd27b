//! Tests of `src/inversion/partition.rs`.

use super::*;

#[test]
fn partitions_are_complete_and_the_finest_come_first() {
    assert_eq!([0, 1, 2, 3, 4, 8].map(|m| partitions(m).len()), [1, 1, 2, 5, 15, 4140]);
    assert_eq!(partitions(3)[0], [[0], [1], [2]]);
    assert_eq!(partitions(3)[4], [[0, 1, 2]]);
}
