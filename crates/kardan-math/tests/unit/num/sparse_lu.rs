//! Tests of `src/num/sparse_lu.rs`.

use super::*;
use crate::num::Lu;

/// Numbers between −1 and 1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A tree of n nodes with constraints between some neighbours: a matrix with zeros on its diagonal.
fn places(n: usize, seed: &mut u64) -> (usize, Vec<(usize, usize)>) {
    let mut out: Vec<(usize, usize)> = (0..n).map(|i| (i, i)).collect();
    let mut size = n;
    for i in 1..n {
        let j = ((random(seed) + 1.0) / 2.0 * i as f64) as usize;
        out.extend([(i, j), (j, i)]);
        if i % 3 == 0 {
            out.extend([(size, i), (i, size), (size, j), (j, size)]);
            size += 1;
        }
    }
    out.push((0, 0));
    (size, out)
}

#[test]
fn factors_solve_what_dense_ones_solve() {
    let mut seed = 7;
    for n in [1, 2, 5, 30, 90] {
        let (size, places) = places(n, &mut seed);
        let order = SparseOrder::new(size, &places).unwrap();
        let shift = |(i, j): (usize, usize)| if i == j { 6.0 } else { 0.0 };
        let numbers: Vec<f64> = places.iter().map(|place| random(&mut seed) + shift(*place)).collect();
        let mut dense = vec![0.0; size * size];
        places.iter().zip(&numbers).for_each(|((i, j), x)| dense[i * size + j] += x);
        let right: Vec<f64> = (0..size).map(|_| random(&mut seed)).collect();
        let (mut lu, mut sparse) = (Lu::new(size), SparseLu::default());
        assert!(lu.factor(&dense) && sparse.factor(&order, &numbers), "{n}");
        let (mut expected, mut found) = (right.clone(), right.clone());
        lu.solve(&mut expected);
        sparse.solve(&order, &mut found);
        for (x, y) in expected.iter().zip(&found) {
            assert!((x - y).abs() < 1e-9 * (1.0 + x.abs()), "{n}: {x} {y}");
        }
        // (M + iM)(x + iy) = (1 + i)(b + ib) has the same solution in both parts.
        let complex: Vec<c64> = numbers.iter().map(|x| c64::new(*x, *x)).collect();
        let mut pair: Vec<c64> = right.iter().map(|b| c64::new(0.0, 2.0 * b)).collect();
        let mut sparse = SparseLu::default();
        assert!(sparse.factor(&order, &complex));
        sparse.solve(&order, &mut pair);
        for (x, z) in expected.iter().zip(&pair) {
            assert!((z - c64::new(*x, *x)).norm() < 1e-9 * (1.0 + x.abs()), "{n}: {x} {z}");
        }
    }
}

#[test]
fn a_chain_has_no_fill_and_singular_matrices_are_reported() {
    let n = 500;
    let chain: Vec<(usize, usize)> = (0..n)
        .flat_map(|i| [Some((i, i)), (i > 0).then(|| (i, i - 1)), (i > 0).then(|| (i - 1, i))])
        .flatten()
        .collect();
    let order = SparseOrder::new(n, &chain).unwrap();
    assert_eq!(order.size(), 3 * n - 2);
    let mut lu = SparseLu::default();
    assert!(!lu.factor(&SparseOrder::new(2, &[(0, 0), (0, 1), (1, 0), (1, 1)]).unwrap(), &[1.0, 3.0, 1.0 / 3.0, 1.0]));
    assert_eq!(SparseOrder::new(2, &[(0, 0)]), None);
    // The first pivot couples the last row with itself only for a symmetric pattern: there is no number, and no pivot, before the second.
    let saddle = [(0, 0), (0, 1), (1, 0), (1, 1), (1, 2), (2, 1), (2, 0)];
    let order = SparseOrder::new(3, &saddle).unwrap();
    assert!(lu.factor(&order, &[1.0, -1.0, 0.5, 2.0, -1.0, 2.0, 3.0]));
    assert_eq!(SparseOrder::new(0, &[]).unwrap().size(), 0);
}
