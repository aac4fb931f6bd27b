//! Tests of `src/num/hessenberg.rs`.

use super::*;
use crate::num::Random;

/// The responses `C Aᵏ B` do not depend on coordinates; below the first subdiagonal there is nothing.
#[test]
fn responses_do_not_change() {
    let mut random = Random::new(7);
    let mut unit = || (random.next_u64() >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
    for n in [0usize, 1, 2, 3, 8, 40] {
        let mut drawn =
            |rows, columns| Matrix::from_fn(rows, columns, |i, j| if (i + 2 * j) % 5 == 4 { 0.0 } else { unit() });
        let [a, b, c] = [drawn(n, n), drawn(n, 2), drawn(3, n)];
        let [h, q, r] = hessenberg([&a, &b, &c]);
        assert!((0..n).all(|i| (0..i.saturating_sub(1)).all(|j| h[(i, j)] == 0.0)));
        let (mut old, mut new) = (b, q);
        for _ in 0..6 {
            let [expected, found] = [c.multiply(&old), r.multiply(&new)];
            let size = expected.as_slice().iter().fold(1.0f64, |size, x| size.max(x.abs()));
            let apart = expected.as_slice().iter().zip(found.as_slice()).map(|(x, y)| (x - y).abs());
            assert!(apart.fold(0.0, f64::max) < 1e-12 * size);
            (old, new) = (a.multiply(&old), h.multiply(&new));
        }
    }
}
