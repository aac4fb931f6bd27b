//! Tests of `src/inversion/notation.rs`.

use super::*;

#[test]
fn sums_read_well() {
    let p = |c: &[i64]| Polynomial::new(c.iter().map(|&x| Rational::from(x)).collect());
    let names = ["a", "b", "c"].map(String::from);
    assert_eq!(sum(&[p(&[1]), p(&[-51]), p(&[50])], &names), "a - 51 b + 50 c");
    assert_eq!(sum(&[p(&[1, -2, 1]), p(&[]), p(&[0, -1])], &names), "(s^2 - 2 s + 1) a - s c");
    assert_eq!(sum(&[p(&[]), p(&[1, -2]), p(&[0, 1])], &names), "-(2 s - 1) b + s c");
    assert_eq!(sum(&[p(&[]), p(&[]), p(&[])], &names), "0");
}
