//! Tests of `src/present/mod.rs`.

use super::*;
use crate::model::Block;

#[test]
fn conjugate_poles_share_a_row() {
    let body = poles(&[Complex::new(-3.0, 4.0), Complex::new(-1.0, 0.0), Complex::new(-3.0, -4.0)]);
    let [Block::Table(table)] = &body.0[..] else { panic!("one table: {body:?}") };
    let decays = Cell::Mark(true, "decays".into());
    let expected = [row!["−3 ± 4 j", "5", "0.6", decays.clone()], row!["−1", "1", "1", decays]];
    assert_eq!(table.rows, expected);
}
