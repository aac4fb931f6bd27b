//! Tests of `src/num/routh.rs`.

use super::*;

/// Products of known factors: the column has n + 1 numbers above zero if and only if all roots are in the open left half-plane.
#[test]
fn the_column_shows_where_roots_are() {
    let p = |list: &[i64]| Polynomial::new(list.iter().map(|&x| Rational::from(x)).collect());
    let stable = [p(&[1, 1]), p(&[2, 1]), p(&[5, 2, 1]), p(&[100, 1, 1])];
    let unstable = [p(&[0, 1]), p(&[-1, 1]), p(&[4, 0, 1]), p(&[5, -2, 1]), p(&[1, 0, 0, 0, 1]), p(&[-4, 0, 1])];
    let decided = |q: &Polynomial| {
        let column = routh_column(q);
        column.len() == q.degree() + 1 && column.iter().all(|x| *x > Rational::ZERO)
    };
    assert!(decided(&p(&[1])) && decided(&p(&[7])));
    for (i, a) in stable.iter().enumerate() {
        for b in &stable[i..] {
            let both = a.times(b).times(b);
            assert!(decided(&both), "{both}");
            for other in &unstable {
                assert!(!decided(&both.times(other)), "{both} {other}");
            }
        }
    }
}
