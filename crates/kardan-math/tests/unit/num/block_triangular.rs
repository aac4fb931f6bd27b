//! Tests of `src/num/block_triangular.rs`.

use super::*;
use crate::num::{Polynomial, Random, Rational, characteristic_polynomial, selected};

/// The characteristic polynomial of a sparse matrix, exactly, is that of the others times `s − d` of each isolated one; of the others each
/// acts on another one and is acted on.
#[test]
fn isolated_and_coupled_parts_factor_the_characteristic_polynomial() {
    let mut random = Random::new(5);
    let (mut some, mut all) = (0, 0);
    for n in 1..9 {
        for _ in 0..30 {
            let mut entry = |_: usize, _: usize| {
                if random.unit() < 1.3 / n as f64 { (random.unit() * 9.0).floor() - 4.0 } else { 0.0 }
            };
            let a = Matrix::from_fn(n, n, &mut entry);
            let [isolated, coupled] = isolated(&a);
            let exact = |m: &Matrix<f64>| Matrix::from_fn(m.rows(), m.rows(), |i, j| Rational::from(m[(i, j)] as i64));
            let coupled_part = characteristic_polynomial(&exact(&selected(&a, &coupled, &coupled)));
            let roots: Vec<Rational> = isolated.iter().map(|&k| Rational::from(a[(k, k)] as i64)).collect();
            assert_eq!(
                characteristic_polynomial(&exact(&a)),
                Polynomial::from_roots(&roots).times(&coupled_part),
                "{a:?}"
            );
            for &k in &coupled {
                assert!(coupled.iter().any(|&j| j != k && a[(k, j)] != 0.0), "{a:?}");
                assert!(coupled.iter().any(|&i| i != k && a[(i, k)] != 0.0), "{a:?}");
            }
            some += usize::from(!isolated.is_empty() && !coupled.is_empty());
            all += usize::from(coupled.is_empty());
        }
    }
    assert!(some > 30 && all > 30, "{some} {all}");
}
