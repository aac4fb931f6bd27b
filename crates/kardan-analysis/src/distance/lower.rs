//! A bound of the distance from below, with all rounding.

use std::collections::HashMap;

use faer::{Mat, MatRef, Side, c64};
use kardan_rt::functions::{exp2, hypot, log2, powi};

use super::smallest::{ScaledPair, pencil};

/// Decompositions times states³ that are spent for one goal.
const MOST_WORK: usize = 1_600_000_000;
/// Decompositions that are spent for one goal at most.
const MOST_TESTS: usize = 60_000;
/// A singular value decomposition takes as long as so many decompositions of Cholesky.
const OF_SINGULAR_VALUES: usize = 20;
/// The first trial, as a share of the upper bound, ...
const FIRST: f64 = 0.5;
/// ... the second trial if the first succeeds, ...
const CLOSE: f64 = 0.905;
/// ... and if it fails.
const LOW: f64 = 0.1;
/// Squares are split no deeper: their corners are exact.
const DEEPEST: u32 = 50;

/// A lower bound of `σ_min([A − λI, B])` for all λ; 0 if none is proven. `upper` is its least value known.
///
/// Outside the disc of radius `‖A‖ + upper` the value exceeds `upper`. Inside, for Im λ ≥ 0 (the matrices are real), squares are
/// split until each of them is proven, or the work is spent.
pub(super) fn proven(pair: &ScaledPair, upper: f64) -> f64 {
    let mut plane = Plane::new(pair);
    let mut certified = |share: f64| (share > 0.0 && plane.exceeds(share * upper)).then_some(share * upper);
    match certified(FIRST) {
        Some(first) => certified(CLOSE).unwrap_or(first),
        None => certified(LOW).unwrap_or(0.0),
    }
}

/// The results at a corner: proven lower bounds of the square of σ_min, and values that could not be proven.
#[derive(Debug, Clone, Copy)]
struct Corner {
    certified: f64,
    fails: f64,
}

/// A square `[x, x + 1] × [y, y + 1]` in units of `side · 2⁻ᵈᵉᵖᵗʰ`.
#[derive(Debug, Clone, Copy)]
struct Square {
    depth: u32,
    x: i64,
    y: i64,
}

/// The upper half-plane with the results for it.
struct Plane<'a> {
    pair: &'a ScaledPair,
    /// `A Aᵀ + B Bᵀ`.
    gram: Mat<f64>,
    /// Frobenius norms of A and of `[A, B]`, rounded up.
    norms: [f64; 2],
    /// A power of two outside the disc.
    side: f64,
    corners: HashMap<(i64, i64), Corner>,
    spent: usize,
}

impl<'a> Plane<'a> {
    fn new(pair: &'a ScaledPair) -> Self {
        let n = pair.a.rows();
        let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
        let (of_a, of_b) = (square(pair.a.as_slice()), square(pair.b.as_slice()));
        let norms = [of_a.sqrt(), (of_a + of_b).sqrt()].map(|norm| norm * (1.0 + 1e-9));
        let product = |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(x, y)| x * y).sum::<f64>();
        let gram =
            Mat::from_fn(n, n, |i, j| product(pair.a.row(i), pair.a.row(j)) + product(pair.b.row(i), pair.b.row(j)));
        // Double the norm: the least value known is not above the norm of [A, B].
        let side = exp2(log2(2.0 * norms[1]).ceil()).max(f64::MIN_POSITIVE);
        Self { pair, gram, norms, side, corners: HashMap::new(), spent: 0 }
    }

    /// Whether σ_min is proven to be at least `goal` for all λ.
    fn exceeds(&mut self, goal: f64) -> bool {
        let n = self.pair.a.rows();
        let budget = (MOST_WORK / n.pow(3).max(1)).min(MOST_TESTS);
        self.spent = 0;
        let mut open = vec![Square { depth: 0, x: -1, y: 0 }, Square { depth: 0, x: 0, y: 0 }];
        while let Some(square) = open.pop() {
            if self.is_outside(square, goal) || self.certified(square, goal) {
                continue;
            }
            if self.spent > budget || square.depth == DEEPEST {
                return false;
            }
            let (x, y) = (2 * square.x, 2 * square.y);
            open.extend([(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| Square {
                depth: square.depth + 1,
                x: x + i,
                y: y + j,
            }));
        }
        true
    }

    /// Whether `|λ| − ‖A‖`, which σ_min is not below, suffices.
    fn is_outside(&self, square: Square, goal: f64) -> bool {
        let unit = self.unit(square.depth);
        let nearest = |at: i64| if at < 0 { (at + 1).unsigned_abs() } else { at.unsigned_abs() } as f64 * unit;
        hypot(nearest(square.x), nearest(square.y)) * (1.0 - 1e-9) > self.norms[0] + goal
    }

    fn unit(&self, depth: u32) -> f64 {
        self.side * powi(0.5, depth.cast_signed())
    }

    /// For a centre c and `λ = c + δ`, `[A − λI, B] [A − λI, B]ᴴ − |δ|² I` is affine in δ, so its least eigenvalue is concave: over
    /// a square with half its diagonal r, `σ_min² ≥ min σ_min² of the corners − r²`. Where squares are so small that the rounding
    /// of squares counts, σ_min at the centre is taken, which changes no faster than λ.
    fn certified(&mut self, square: Square, goal: f64) -> bool {
        let unit = self.unit(square.depth);
        let farthest = hypot(square.x as f64, square.y as f64) * unit + 2.0 * unit;
        // The numbers given are rounded.
        let goal = (goal + 8.0 * f64::EPSILON * (self.norms[1] + farthest)) * (1.0 + 1e-12);
        let needed = (goal * goal + unit * unit / 2.0) * (1.0 + 1e-12);
        if needed > 8.0 * self.rounding(farthest) {
            let depth = DEEPEST - square.depth;
            return [(0, 0), (1, 1), (0, 1), (1, 0)]
                .into_iter()
                .all(|(i, j)| self.corner(((square.x + i) << depth, (square.y + j) << depth), needed));
        }
        self.spent += OF_SINGULAR_VALUES;
        let half = unit / 2.0;
        let centre = c64::new(square.x as f64 * unit + half, square.y as f64 * unit + half);
        let reach = half * std::f64::consts::SQRT_2 * (1.0 + 1e-9) + 4.0 * f64::EPSILON * centre.norm();
        at_least(self.pair, centre).is_some_and(|value| value - reach >= goal)
    }

    /// Whether the square of σ_min at a corner is at least `needed`.
    fn corner(&mut self, key: (i64, i64), needed: f64) -> bool {
        let corner = self.corners.get(&key).copied().unwrap_or(Corner { certified: 0.0, fails: f64::INFINITY });
        if needed <= corner.certified || needed >= corner.fails {
            return needed <= corner.certified;
        }
        self.spent += 1;
        let unit = self.unit(DEEPEST);
        let found = self.is_definite(c64::new(key.0 as f64 * unit, key.1 as f64 * unit), needed);
        let corner = if found { Corner { certified: needed, ..corner } } else { Corner { fails: needed, ..corner } };
        self.corners.insert(key, corner);
        found
    }

    /// Whether `[A − λI, B] [A − λI, B]ᴴ − level I` is positive definite: so it is where the decomposition of Cholesky exists for
    /// the matrix less its rounding (Rump 2006).
    fn is_definite(&self, at: c64, level: f64) -> bool {
        let n = self.pair.a.rows();
        let shift = level + self.rounding(at.norm()) - at.norm_sqr();
        let matrix = Mat::<c64>::from_fn(n, n, |i, j| {
            let (x, y) = (self.pair.a[(i, j)], self.pair.a[(j, i)]);
            let real = self.gram[(i, j)] - at.re * (x + y) - if i == j { shift } else { 0.0 };
            c64::new(real, at.im * (x - y))
        });
        matrix.llt(Side::Lower).is_ok()
    }

    /// A bound of the rounding of the matrix and of its decomposition: both are sums of products of length k whose rounding is
    /// below `2 (k + 4) u` times the trace.
    fn rounding(&self, radius: f64) -> f64 {
        let (n, width) = (self.pair.a.rows(), self.pair.a.rows() + self.pair.b.columns());
        let size = self.norms[1] + (n as f64).sqrt() * radius;
        8.0 * (width as f64 + 8.0) * f64::EPSILON * size * size
    }
}

/// A lower bound of the smallest singular value of `[A − λI, B]`.
///
/// For computed factors, `σ_min(M) ≥ σ_min(U) σ_min(S) σ_min(V) − ‖M − U S Vᴴ‖` (Weyl); how far U and V are from
/// orthonormal and the products from M is computed, with the rounding of each inner product of length k at most
/// `4 (k + 8) u` times the norms of its vectors.
fn at_least(pair: &ScaledPair, at: c64) -> Option<f64> {
    let m = pencil(pair, at);
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
