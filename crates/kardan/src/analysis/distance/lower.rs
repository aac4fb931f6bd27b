//! A bound of the distance from below, with all rounding.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use faer::{Mat, MatRef, c64};

use super::smallest::{Given, pencil};

/// Decompositions times states³ that are spent.
const MOST_WORK: usize = 60_000_000;
/// Decompositions that are spent at most.
const MOST_CENTRES: usize = 20_000;
/// The search ends where the bound is this share of what is known from above.
const CLOSE: f64 = 0.9;

/// A square of the complex plane with what is proven over it.
struct Square {
    centre: c64,
    /// Half of its side.
    half: f64,
    bound: f64,
}

impl PartialEq for Square {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Square {}

impl PartialOrd for Square {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Square {
    /// The least bound comes first out of a heap.
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound.total_cmp(&self.bound)
    }
}

/// What `σ_min([A − λI, B])` is not below, for all λ; 0 if nothing is proven. `upper` is its least value known.
///
/// Outside the disc of radius `‖A‖ + upper` the value exceeds `upper`. Inside, for Im λ ≥ 0 (the matrices are real), the
/// square with the least bound is split into four until that bound is close to `upper`, the work is spent, or the squares are
/// as small as rounding.
pub(super) fn proven(given: &Given, upper: f64) -> f64 {
    let n = given.a.rows();
    let frobenius = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>().sqrt();
    let radius = (frobenius(given.a.as_slice()) + upper) * (1.0 + 1e-9);
    let mut squares = BinaryHeap::new();
    for x in [-0.5, 0.5] {
        squares.extend(square(given, c64::new(x * radius, 0.5 * radius), 0.5 * radius));
    }
    let budget = (MOST_WORK / n.pow(3).max(1)).min(MOST_CENTRES);
    let mut spent = 2;
    while let Some(worst) = squares.peek() {
        let floor = 1e-15 * (radius + worst.centre.norm());
        if worst.bound >= CLOSE * upper || spent + 4 > budget || worst.half < floor {
            break;
        }
        let Some(Square { centre, half, .. }) = squares.pop() else { break };
        let quarter = half / 2.0;
        for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            squares.extend(square(given, c64::new(centre.re + x * quarter, centre.im + y * quarter), quarter));
        }
        spent += 4;
    }
    squares.peek().map_or(0.0, |worst| worst.bound.clamp(0.0, upper))
}

/// A square with its bound; one about which nothing is known has the bound −∞.
fn square(given: &Given, centre: c64, half: f64) -> Option<Square> {
    // Centres are rounded: the square is a little larger.
    let reach = half * std::f64::consts::SQRT_2 * (1.0 + 1e-9) + 4.0 * f64::EPSILON * centre.norm();
    let bound = at_least(given, centre).map_or(f64::NEG_INFINITY, |value| value - reach);
    Some(Square { centre, half, bound })
}

/// What the smallest singular value of `[A − λI, B]` is not below.
///
/// For computed factors, `σ_min(M) ≥ σ_min(U) σ_min(S) σ_min(V) − ‖M − U S Vᴴ‖` (Weyl); how far U and V are from
/// orthonormal and the products from M is computed, with the rounding of each inner product of length k at most
/// `4 (k + 8) u` times the norms of its vectors.
fn at_least(given: &Given, at: c64) -> Option<f64> {
    let m = pencil(given, at);
    let (n, width) = (m.nrows(), m.ncols());
    let svd = m.thin_svd().ok()?;
    let (u, v) = (svd.U(), svd.V());
    let values: Vec<f64> = (0..n).map(|k| svd.S()[k].re).collect();
    let rounding = 4.0 * (width as f64 + 8.0) * f64::EPSILON;
    let scaled = Mat::from_fn(n, n, |i, k| u[(i, k)] * values[k]);
    let product = scaled.as_ref() * v.adjoint();
    let size = m.norm_l2();
    let (norm_u, norm_v) = (u.norm_l2(), v.norm_l2());
    let miss = (&product - &m).norm_l2() + rounding * (scaled.norm_l2() * norm_v + size);
    let defect = |factor: MatRef<'_, c64>, norm: f64| {
        let gram = factor.adjoint() * factor;
        (gram - Mat::<c64>::identity(n, n)).norm_l2() + rounding * norm * norm
    };
    let (of_u, of_v) = (defect(u, norm_u), defect(v, norm_v));
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    // The numbers given are rounded, and so is the difference with λ.
    let data = 4.0 * f64::EPSILON * (size + at.norm() * (n as f64).sqrt());
    let found = least * (1.0 - of_u) * (1.0 - of_v) * (1.0 - 1e-12) - (miss + data) * (1.0 + 1e-9);
    (found.is_finite() && of_u < 1.0 && of_v < 1.0).then_some(found)
}
