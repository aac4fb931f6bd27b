//! Tests of `src/box_proof.rs`.

use super::scaled_family::Parts;
use super::*;
use kardan_math::num::Random;

/// G of a cell, and the largest `|R L − I|` at its corners relative to it, for each entry.
fn largest_share(parts: &Parts, reversed: bool, at: c64, half: f64, width: f64) -> f64 {
    let scaled = Scaled::new(parts).unwrap();
    let mut cells = Cells::new(&scaled, reversed);
    let (m, n, q) = (cells.m, cells.n, cells.centre.len());
    cells.width.fill(width);
    cells.centre.fill(1.0 - width);
    if matches!(cells.decide(at, half, &vec![1.0; n]), Verdict::Singular) {
        return 0.0;
    }
    let mut worst = 0.0f64;
    for corner in 0..4 << q {
        let side = |k: usize| if corner >> k & 1 == 0 { -1.0 } else { 1.0 };
        let lambda = at + c64::new(half * side(0), half * side(1));
        let mut level = vec![c64::new(0.0, 0.0); m * n];
        for term in &scaled.terms {
            let x = if term.part == 0 { 1.0 } else { 1.0 - width + width * side(term.part + 1) };
            let degree = scaled.row_degrees[term.row] + scaled.column_degrees[term.column] as isize;
            let power = if reversed { (degree - term.power as isize) as usize } else { term.power };
            level[term.column * m + term.row] += lambda.powi(power as i32) * (x * term.value);
        }
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let product: c64 = (0..m).map(|r| cells.inverse[r * n + i] * level[j * m + r]).sum();
            let change = (product - f64::from(u8::from(i == j))).norm();
            worst = worst.max(change / cells.bound[j * n + i]);
        }
    }
    worst
}

#[test]
fn deviations_at_corners_satisfy_the_bound() {
    let mut closest = 0.0f64;
    for seed in 0..500 {
        let random = &mut Random::new(seed);
        let (n, q) = (1 + random.below(3) as usize, random.below(4) as usize);
        let m = n + random.below(3) as usize;
        let part = |density| {
            [0; 3].map(|_| {
                Matrix::from_fn(m, n, |_, _| {
                    let is_nonzero = random.below(100) < density;
                    Rational::from(if is_nonzero { random.below(19) as i64 - 9 } else { 0 })
                })
            })
        };
        let parts: Parts = [80].into_iter().chain((0..q).map(|_| 30)).map(part).collect();
        let random = &mut Random::new(seed + 1000);
        let half = 1.0 / (1u64 << (1 + random.below(6))) as f64;
        let at = c64::new(random.below(100) as f64 / 50.0 - 1.0, random.below(100) as f64 / 100.0);
        let width = 1.0 / (1u64 << random.below(6)) as f64;
        for reversed in [false, true] {
            let share = largest_share(&parts, reversed, at, half, width);
            assert!(share <= 1.0, "{share} for seed {seed}");
            closest = closest.max(share);
        }
    }
    assert!(closest > 0.9, "the bound is never close: {closest}");
}

/// `1 + x (λ² + 10⁻⁹)` reaches its bound in a corner of the cell.
#[test]
fn a_parameter_at_several_powers_is_bounded_closely() {
    let scalar = |x: i64, of: u32| Matrix::from_fn(1, 1, |_, _| Rational::from_parts(x.into(), of.into()));
    let parts =
        vec![[scalar(1, 1), scalar(0, 1), scalar(0, 1)], [scalar(1, 1_000_000_000), scalar(0, 1), scalar(1, 1)]];
    let share = largest_share(&parts, false, c64::new(0.5, 0.5), 0.5, 1.0);
    assert!(share <= 1.0 && share > 0.999, "{share}");
}
