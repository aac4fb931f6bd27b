//! The search for the nearest uncontrollable values of the parameters.

use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use kardan_rt::functions::{exp2, hypot, log2};
use rayon::prelude::*;

use super::Family;
use super::failing::relative_shares;
use kardan_math::num::{Random, Rational, rational_to_f64};
use kardan_results::{Complex, ParameterPoint, Pole, UncontrollablePoint};

/// The range of the search, in tolerances.
pub const FARTHEST: f64 = 10.0;

/// Iterations from one start.
const MOST_STEPS: usize = 50;

/// Rounding error of an equation, relative to its terms.
const NOISE: f64 = 1e-14;

/// Tolerances by which rounding errors may shift a loss for it to count as one.
const ROUNDING_SHIFT: f64 = 1e-3;

/// Residual below which the equations count as solved, relative.
const SOLVED: f64 = 1e-13;

/// The loss of controllability (observability) nearest to the nominal parameters: the least, over all parameters and
/// eigenvalues λ at which the pencil of the family has a null vector, of the largest deviation measured in tolerances.
///
/// Solves `min γ(y)` subject to `L(λ, y) v = 0`, `v ≠ 0` by sequential linear programming from many starts: v and λ are
/// eliminated from the linearised equations (left null space of `[L, L'v; vᴴ, 0]`), what remains are m real equations (2m
/// for complex λ) for the parameters, whose solution with the least gauge γ is found. γ is the largest `yᵢ` over the
/// tolerance on its side; where there is none, the parameter does not move. The search makes no assumption on how a loss comes
/// about. Starts: the eigenvalues given, and real numbers of their sizes, at the nominal parameters and at random ones up
/// to `FARTHEST` tolerances away.
///
/// A point counts only if rounding errors cannot have made it: shifted by them, it must stay within 1/1000 tolerance. Losses
/// where a parameter vanishes are often degenerate in this sense and better tested exactly.
///
/// `shafts` are the names of the leading columns. Parameters do not pass through zero. `None` if no start led to a loss
/// within `FARTHEST` tolerances; a search from points is no proof, see [`prove_box`](super::prove_box) for that.
pub fn distance_to_uncontrollability(
    family: &Family<'_>,
    shafts: &[String],
    eigenvalues: &[Pole],
    starts: usize,
) -> Option<UncontrollablePoint> {
    let limits = Limits::of(family);
    let k = family.parameters().len();
    if k == 0 {
        return None;
    }
    let from = |number: usize, bound: f64| {
        let mut random = Random::new(11 + number as u64);
        let reach = match number / 8 % 4 {
            _ if number < starts / 4 => 0.0,
            0 => 1.0,
            1 => 3.0,
            _ => FARTHEST,
        };
        let y: Vec<f64> = (0..k)
            .map(|i| {
                let side = 2.0 * random.unit() - 1.0;
                limits.clamp(i, reach * side * if side < 0.0 { limits.lower[i] } else { limits.upper[i] })
            })
            .collect();
        descend(family, &limits, start(eigenvalues, number, &mut random), y, bound)
    };
    // Each batch is bounded by the one before it, whatever the order of its members.
    let mut best: Option<Candidate> = None;
    for batch in [0..starts / 4, starts / 4..starts] {
        let bound = best.as_ref().map_or(FARTHEST, |found| found.gauge);
        let found: Vec<Candidate> = batch.into_par_iter().filter_map(|number| from(number, bound)).collect();
        best = best.into_iter().chain(found).min_by(|a, b| a.gauge.total_cmp(&b.gauge));
    }
    let found = tidied(family, &limits, best?);
    let at = family.parameters().iter().zip(&found.y).enumerate().map(|(i, (p, &y))| {
        let value = rational_to_f64(&p.nominal) + y * limits.half[i];
        // What the last rounding leaves of a zero is none.
        let value = if y == limits.zero[i] { 0.0 } else { value };
        ParameterPoint { parameter: p.name.clone(), value, unit: p.unit.clone() }
    });
    Some(UncontrollablePoint {
        distance: found.gauge,
        at: at.collect(),
        eigenvalue: Complex {
            re: found.lambda.re,
            im: if found.lambda.im.abs() < 1e-12 * found.lambda.re.abs() { 0.0 } else { found.lambda.im.abs() },
        },
        // Zero is reserved for what is decided exactly.
        residual: found.residual.max(f64::EPSILON),
        shafts: relative_shares(shafts.iter().cloned().zip(found.v.iter().map(|x| x.norm())), 1e-6),
    })
}

/// Parameters that do not matter, back at their nominal values.
fn tidied(family: &Family<'_>, limits: &Limits, mut found: Candidate) -> Candidate {
    for i in 0..found.y.len() {
        let mut y = found.y.clone();
        y[i] = 0.0;
        // What sets the distance matters, however little.
        if found.y[i] == 0.0 || limits.gauge(&y) < found.gauge * (1.0 - 1e-6) {
            continue;
        }
        let Some((rows, columns)) = equilibrium(family, &y, found.lambda) else { continue };
        let Some(parts) = family.at(&y) else { continue };
        let powers = [c64::new(1.0, 0.0), found.lambda, found.lambda * found.lambda];
        let entry = |i: usize, j: usize| (0..3).fold(c64::new(0.0, 0.0), |sum, k| sum + powers[k] * parts[k][(i, j)]);
        let l = Mat::from_fn(rows.len(), columns.len(), |i, j| entry(i, j) * (rows[i] * columns[j]));
        if !l.is_all_finite() {
            continue;
        }
        // All entries are of the size of one.
        let Some(v) = smallest_vector(&l) else { continue };
        let residual = max_norm(&(&l * &v));
        if residual < 10.0 * SOLVED {
            let v = (0..columns.len()).map(|j| v[(j, 0)] * columns[j]).collect();
            found = Candidate { gauge: limits.gauge(&y), y, v, residual, ..found };
        }
    }
    found
}

/// A point with a null vector.
struct Candidate {
    gauge: f64,
    y: Vec<f64>,
    lambda: c64,
    v: Vec<c64>,
    residual: f64,
}

/// Tolerances on either side in half widths, and where a parameter is zero.
struct Limits {
    lower: Vec<f64>,
    upper: Vec<f64>,
    half: Vec<f64>,
    /// y at which the parameter is zero; infinite if it may pass.
    zero: Vec<f64>,
}

impl Limits {
    fn of(family: &Family<'_>) -> Self {
        let mut out = Self { lower: Vec::new(), upper: Vec::new(), half: Vec::new(), zero: Vec::new() };
        for p in family.parameters() {
            let (nominal, low, high) =
                (rational_to_f64(&p.nominal), rational_to_f64(&p.lower), rational_to_f64(&p.upper));
            let half = 0.5 * (high - low);
            // From exact differences: a side without tolerance has exactly none.
            let side = |width: Rational| rational_to_f64(&width) / half;
            out.lower.push(side(&p.nominal - &p.lower));
            out.upper.push(side(&p.upper - &p.nominal));
            out.half.push(half);
            // A value whose interval has one sign has that sign.
            let signed = nominal != 0.0 && low * high >= 0.0;
            out.zero.push(if signed { -nominal / half } else { f64::INFINITY });
        }
        out
    }

    fn clamp(&self, i: usize, y: f64) -> f64 {
        let y = if self.forbids(i, y) { 0.0 } else { y };
        match self.zero[i] {
            zero if zero.is_infinite() => y,
            zero if zero < 0.0 => y.max(zero),
            zero => y.min(zero),
        }
    }

    /// Whether there is no tolerance on this side.
    fn forbids(&self, i: usize, y: f64) -> bool {
        y < 0.0 && self.lower[i] == 0.0 || y > 0.0 && self.upper[i] == 0.0
    }

    fn gauge(&self, y: &[f64]) -> f64 {
        let of = |(i, &y): (usize, &f64)| if y < 0.0 { -y / self.lower[i] } else { y / self.upper[i] };
        y.iter().enumerate().map(of).fold(0.0, f64::max)
    }
}

/// Eigenvalues to start from: those of the model, then real ones of the same sizes.
fn start(eigenvalues: &[Pole], number: usize, random: &mut Random) -> c64 {
    let count = eigenvalues.len().max(1);
    let Complex { re, im } = eigenvalues.get(number % count).copied().unwrap_or(Complex::default());
    let size = hypot(re, im);
    match number / count % 3 {
        0 => c64::new(re, im),
        1 => c64::new(-size * exp2(2.0 * random.unit() - 1.0), 0.0),
        _ if im == 0.0 => c64::new(0.0, 0.0),
        _ => c64::new(re, im) * exp2(random.unit() - 0.5),
    }
}

/// From one start to the locus of losses and along it; `Some` only if the result is below `bound`.
fn descend(family: &Family<'_>, limits: &Limits, lambda: c64, mut y: Vec<f64>, bound: f64) -> Option<Candidate> {
    let real = lambda.im == 0.0;
    let mut lambda = lambda;
    let mut best: Option<Candidate> = None;
    let (rows, columns) = equilibrium(family, &y, lambda)?;
    let (m, n) = (rows.len(), columns.len());
    let scaled = |p: &Mat<f64>| Mat::from_fn(m, n, |i, j| p[(i, j)] * rows[i] * columns[j]);
    let number = |x: f64| c64::new(x, 0.0);
    let mut v = Mat::<c64>::zeros(n, 1);
    let mut last_gauge = f64::INFINITY;
    for step in 0..MOST_STEPS {
        let parts = family.at(&y)?.map(|p| scaled(&p));
        let value = |k: [c64; 3]| {
            Mat::from_fn(m, n, |i, j| k[0] * parts[0][(i, j)] + k[1] * parts[1][(i, j)] + k[2] * parts[2][(i, j)])
        };
        let l = value([number(1.0), lambda, lambda * lambda]);
        if !l.is_all_finite() {
            return best;
        }
        if step == 0 {
            v = smallest_vector(&l)?;
        }
        let residual = &l * &v;
        // Terms may cancel within an entry.
        let far = lambda.norm();
        let size = |i: usize, j: usize| {
            let terms = parts[0][(i, j)].abs() + far * parts[1][(i, j)].abs() + far * far * parts[2][(i, j)].abs();
            terms * v[(j, 0)].norm()
        };
        let size = (0..m).map(|i| (0..n).map(|j| size(i, j)).sum::<f64>()).fold(0.0, f64::max);
        let relative = max_norm(&residual) / size.max(f64::MIN_POSITIVE);
        let gauge = limits.gauge(&y);
        let better =
            |b: &Candidate| gauge < b.gauge * (1.0 - 1e-9) || gauge <= b.gauge * (1.0 + 1e-9) && relative < b.residual;
        let candidate = relative < SOLVED && gauge < bound && best.as_ref().is_none_or(better);
        let settled = if gauge < bound { 1e-12 } else { 1e-3 };
        let done = relative < SOLVED && (last_gauge - gauge).abs() <= settled * gauge;
        last_gauge = if relative < SOLVED { gauge } else { f64::INFINITY };
        // [L, L'v; vᴴ, 0] [δv; δλ] = −[L v + Σ ∂ᵢL v δyᵢ; 0]
        let slope = value([number(0.0), number(1.0), lambda * 2.0]) * &v;
        let bordered = Mat::from_fn(m + 1, n + 1, |i, j| match (i < m, j < n) {
            (true, true) => l[(i, j)],
            (true, false) => slope[(i, 0)],
            (false, true) => v[(j, 0)].conj(),
            (false, false) => number(0.0),
        });
        let derivatives = family.derivatives(&y)?;
        let columns_by_parameter: Vec<Mat<c64>> = derivatives
            .iter()
            .map(|d| {
                let at = Mat::from_fn(m, n, |i, j| {
                    let x = number(d[0][(i, j)]) + lambda * d[1][(i, j)] + lambda * lambda * d[2][(i, j)];
                    x * (rows[i] * columns[j])
                });
                at * &v
            })
            .collect();
        let svd = bordered.svd().ok()?;
        let singular = |j: usize| svd.S()[j].re;
        let rank = (0..=n).take_while(|&j| singular(j) > 1e-11 * singular(0)).count();
        let project = |x: &Mat<c64>| -> Vec<c64> {
            (rank..=m).map(|k| (0..m).fold(number(0.0), |sum, i| sum + svd.U()[(i, k)].conj() * x[(i, 0)])).collect()
        };
        let (of_residual, of_slopes) =
            (project(&residual), columns_by_parameter.iter().map(project).collect::<Vec<_>>());
        let equations = of_residual.len();
        let g = Mat::from_fn(2 * equations, y.len(), |q, i| {
            let x = of_slopes[i][q / 2];
            if q % 2 == 0 { x.re } else { x.im }
        });
        let right: Vec<f64> = (0..2 * equations)
            .map(|q| {
                let part = |x: c64| if q % 2 == 0 { x.re } else { x.im };
                (0..y.len()).fold(-part(of_residual[q / 2]), |sum, i| sum + g[(q, i)] * y[i])
            })
            .collect();
        let (target, steepness) = least_gauge(g, &right, limits)?;
        // Rounding must not be able to make or unmake the loss: where the equations depend only weakly on the parameters, it could.
        if candidate && size * NOISE < ROUNDING_SHIFT * steepness {
            let unscaled = (0..n).map(|j| v[(j, 0)] * columns[j]).collect();
            best = Some(Candidate { gauge, y: y.clone(), lambda, v: unscaled, residual: relative });
        }
        if done {
            break;
        }
        let change: Vec<f64> = target.iter().zip(&y).map(|(t, y)| t - y).collect();
        let widest = |i: usize| limits.lower[i].max(limits.upper[i]);
        let stretch = change.iter().enumerate().map(|(i, x)| x.abs() / widest(i)).fold(0.0, f64::max);
        let most = 0.5 + 0.3 * gauge;
        let factor = if stretch > most { most / stretch } else { 1.0 };
        let before = y.clone();
        for (i, y) in y.iter_mut().enumerate() {
            *y = limits.clamp(i, *y + factor * change[i]);
        }
        if limits.gauge(&y) > 3.0 * FARTHEST {
            return best;
        }
        // The corresponding least change of v and λ.
        let mut right = residual.clone();
        for (i, column) in columns_by_parameter.iter().enumerate() {
            right += faer::Scale(number(y[i] - before[i])) * column;
        }
        let mut change = vec![number(0.0); n + 1];
        for k in 0..rank {
            let onto = (0..m).fold(number(0.0), |sum, i| sum + svd.U()[(i, k)].conj() * right[(i, 0)]);
            for (j, x) in change.iter_mut().enumerate() {
                *x -= svd.V()[(j, k)] * (onto / singular(k));
            }
        }
        let far = change[n].norm() / (lambda.norm() + 1.0);
        let brake = if far > 0.5 { 0.5 / far } else { 1.0 };
        lambda += change[n] * brake;
        for j in 0..n {
            v[(j, 0)] += change[j] * brake;
        }
        if real {
            lambda.im = 0.0;
            (0..n).for_each(|j| v[(j, 0)].im = 0.0);
        }
        let norm = v.norm_l2();
        if !(norm > 0.0 && norm.is_finite() && lambda.norm().is_finite()) {
            return best;
        }
        v = faer::Scale(number(norm.recip())) * &v;
    }
    best
}

/// Powers of two that bring rows and columns of the pencil to the size of one.
fn equilibrium(family: &Family<'_>, y: &[f64], lambda: c64) -> Option<(Vec<f64>, Vec<f64>)> {
    let parts = family.at(y)?;
    let (m, n) = (parts[0].nrows(), parts[0].ncols());
    let size = lambda.norm().max(1e-3);
    let entries = Mat::from_fn(m, n, |i, j| {
        parts[0][(i, j)].abs() + size * parts[1][(i, j)].abs() + size * size * parts[2][(i, j)].abs()
    });
    let (mut rows, mut columns) = (vec![1.0; m], vec![1.0; n]);
    let power = |x: f64| if x > 0.0 && x.is_finite() { exp2(-log2(x).round()) } else { 1.0 };
    for _ in 0..4 {
        for i in 0..m {
            rows[i] = power((0..n).map(|j| entries[(i, j)] * columns[j]).fold(0.0, f64::max));
        }
        for j in 0..n {
            columns[j] = power((0..m).map(|i| entries[(i, j)] * rows[i]).fold(0.0, f64::max));
        }
    }
    Some((rows, columns))
}

fn smallest_vector(l: &Mat<c64>) -> Option<Mat<c64>> {
    let svd = l.svd().ok()?;
    let n = l.ncols();
    Some(Mat::from_fn(n, 1, |i, _| svd.V()[(i, n - 1)]))
}

fn max_norm(m: &Mat<c64>) -> f64 {
    (0..m.nrows()).map(|i| m[(i, 0)].norm()).fold(0.0, f64::max)
}

/// `min γ(y)` subject to `G y = b` (in the least-squares sense where it cannot be met), and the smallest singular value of G
/// that counts. Parameters that would move to a side without tolerance stay where they are.
fn least_gauge(mut g: Mat<f64>, b: &[f64], limits: &Limits) -> Option<(Vec<f64>, f64)> {
    loop {
        let (y, steepness) = least_two_sided(&g, b, limits)?;
        let wrong: Vec<usize> = (0..y.len()).filter(|&i| limits.forbids(i, y[i])).collect();
        if wrong.is_empty() {
            return Some((y, steepness));
        }
        wrong.into_iter().for_each(|i| g.col_mut(i).fill(0.0));
    }
}

/// The same; a side without tolerance is left by rounding errors at most, as long as the equations allow it.
///
/// With `h, k` half the sum and half the difference of the tolerances above and below, the dual is to minimise
/// `Σ hᵢ |aᵢ| + kᵢ aᵢ` with `a = V x, cᵀx = 1`, done by reweighted least squares with a vanishing floor:
/// `y = (Ω a + k)/τ` with `Ωᵢ = hᵢ/|aᵢ|`, where τ is such that `Vᵀy = c`. Parameters without influence stay at zero.
fn least_two_sided(g: &Mat<f64>, b: &[f64], limits: &Limits) -> Option<(Vec<f64>, f64)> {
    let k = g.ncols();
    let svd = g.thin_svd().ok()?;
    let largest = svd.S()[0];
    let rank = (0..svd.S().dim()).take_while(|&j| svd.S()[j] > 1e-8 * largest && svd.S()[j] > 0.0).count();
    if rank == 0 {
        return Some((vec![0.0; k], 0.0));
    }
    let steepness = svd.S()[rank - 1];
    // Orthonormal equations Vᵀ y = c.
    let c: Vec<f64> =
        (0..rank).map(|q| (0..b.len()).map(|i| svd.U()[(i, q)] * b[i]).sum::<f64>() / svd.S()[q]).collect();
    let idle: Vec<bool> = (0..k).map(|i| g.col(i).norm_max() == 0.0).collect();
    let v = Mat::from_fn(k, rank, |i, q| if idle[i] { 0.0 } else { svd.V()[(i, q)] });
    let mut y: Vec<f64> = (0..k).map(|i| (0..rank).map(|q| v[(i, q)] * c[q]).sum()).collect();
    let half: Vec<f64> = (0..k).map(|i| 0.5 * (limits.upper[i] + limits.lower[i])).collect();
    let shift: Vec<f64> =
        (0..k).map(|i| if idle[i] { 0.0 } else { 0.5 * (limits.upper[i] - limits.lower[i]) }).collect();
    let mut weights = half.clone();
    let mut floor = 0.1;
    for step in 0..60 {
        let normal =
            Mat::from_fn(rank, rank, |p, q| (0..k).map(|i| v[(i, p)] * v[(i, q)] * half[i] * weights[i]).sum::<f64>());
        // Without the shift first: the size of the weights is not known yet.
        let shift = |i: usize| if step == 0 { 0.0 } else { shift[i] };
        let right = Mat::from_fn(rank, 2, |q, side| match side {
            0 => c[q],
            _ => (0..k).map(|i| v[(i, q)] * shift(i)).sum(),
        });
        let x = normal.full_piv_lu().solve(&right);
        let onto = |side: usize| (0..rank).map(|q| c[q] * x[(q, side)]).sum::<f64>();
        let tau = (1.0 + onto(1)) / onto(0);
        let dual: Vec<f64> =
            (0..k).map(|i| (0..rank).map(|q| v[(i, q)] * (tau * x[(q, 0)] - x[(q, 1)])).sum()).collect();
        let largest = (0..k).fold(0.0, |most: f64, i| most.max(half[i] * dual[i].abs()));
        if !(tau > 0.0 && tau.is_finite() && largest > 0.0 && largest.is_finite()) {
            break;
        }
        for i in 0..k {
            y[i] = (half[i] * weights[i] * dual[i] + shift(i)) / tau;
            weights[i] = half[i] / (half[i] * dual[i].abs()).max(floor * largest);
        }
        floor = (floor * 0.7).max(1e-9);
    }
    y.iter().all(|x| x.is_finite()).then_some((y, steepness))
}
