//! Samples of a system within the tolerances of its parameters.

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use kardan_rt::functions::{cos, exp, ln};
use rayon::prelude::*;

use super::{Family, Parameter, Side, gramian, smallest_eigenvalue};
use kardan_math::num::{Random, rational_to_f64};
use kardan_results::{Interval, Sampling};

/// How a box of parameters is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SamplingPlan {
    /// Number of samples.
    pub samples: usize,
    /// Seed.
    pub seed: u64,
    /// Time over which the Gramian is taken, s.
    pub horizon: f64,
    /// Smallest eigenvalue below which a sample counts; `None`: a tenth of the nominal one.
    pub threshold: Option<f64>,
}

/// How often the smallest eigenvalue of the finite-horizon Gramian falls below a threshold when the parameters vary.
///
/// Uniform between the ends of a tolerance; an interval with a confidence γ means a normal distribution around the
/// nominal value that lies within it with probability γ (values across zero are drawn again). Angles count in rad, speeds
/// times the horizon (for sensors: over the horizon), so that the measure is that of placement. Parallel; the result
/// depends on the seed alone.
///
/// `family` is a loss pencil of n shafts and its constraints, `coordinates` are the columns of the reduced coordinates. A
/// sample without a Gramian (singular inertia, overflow) counts as zero. `None` if there is none at the nominal
/// values, no sample is requested, or the threshold is left open and the nominal eigenvalue is lost in rounding.
pub fn sample(
    family: &Family<'_>,
    side: Side,
    shafts: usize,
    coordinates: &[usize],
    plan: &SamplingPlan,
    unit: &str,
) -> Option<Sampling> {
    if plan.samples == 0 {
        return None;
    }
    let k = family.parameters().len();
    let measure = |y: &[f64]| smallest(&family.at(y)?, side, shafts, coordinates, plan.horizon);
    let nominal = measure(&vec![0.0; k])?;
    let threshold = plan.threshold.or((nominal > 0.0).then_some(0.1 * nominal))?;
    let mut found: Vec<f64> = (0..plan.samples)
        .into_par_iter()
        .map(|number| {
            let mut random = Random::new(plan.seed.wrapping_add(0x1000_0000 * number as u64));
            let y: Vec<f64> = family.parameters().iter().map(|p| draw(p, &mut random)).collect();
            measure(&y).unwrap_or(0.0)
        })
        .collect();
    found.sort_by(f64::total_cmp);
    let below = found.iter().filter(|x| **x < threshold).count();
    Some(Sampling {
        samples: plan.samples,
        seed: plan.seed,
        threshold,
        unit: unit.into(),
        probability: below as f64 / plan.samples as f64,
        interval: wilson(below, plan.samples),
        smallest: found[0],
        median: found[found.len() / 2],
        largest: found[found.len() - 1],
    })
}

/// A deviation in half widths.
fn draw(parameter: &Parameter, random: &mut Random) -> f64 {
    let [nominal, low, high] = [&parameter.nominal, &parameter.lower, &parameter.upper].map(rational_to_f64);
    let half = 0.5 * (high - low);
    let Some(confidence) = parameter.confidence else {
        return (low + (high - low) * random.unit() - nominal) / half;
    };
    let spread = 1.0 / two_sided_quantile(confidence);
    for _ in 0..1000 {
        // Box and Muller.
        let radius = (-2.0 * ln(1.0 - random.unit())).sqrt();
        let y = spread * radius * cos(std::f64::consts::TAU * random.unit());
        // An interval need not lie around the value in the middle.
        let y = y * if y < 0.0 { (nominal - low) / half } else { (high - nominal) / half };
        if nominal == 0.0 || (nominal + y * half) * nominal > 0.0 {
            return y;
        }
    }
    0.0
}

/// z with `P(|Z| < z) = confidence` for a standard normal Z.
fn two_sided_quantile(confidence: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if central_probability(middle) < confidence { low = middle } else { high = middle }
    }
    high
}

/// `P(|Z| < z)`: the series `√(2/π) e^{−z²/2} (z + z³/3 + z⁵/15 + …)`, all terms positive.
fn central_probability(z: f64) -> f64 {
    let (mut term, mut sum) = (z, z);
    for k in 1..2000 {
        term *= z * z / f64::from(2 * k + 1);
        sum += term;
        if term < 1e-17 * sum {
            break;
        }
    }
    let value = (2.0 / std::f64::consts::PI).sqrt() * exp(-0.5 * z * z) * sum;
    if value.is_finite() { value.min(1.0) } else { 1.0 }
}

/// 95 % interval of a probability for `hits` in `samples` \[Wilson 1927\].
fn wilson(hits: usize, samples: usize) -> Interval {
    const Z: f64 = 1.959_963_984_540_054;
    let (n, p) = (samples as f64, hits as f64 / samples as f64);
    let centre = (p + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    // The ends are exact where no sample, or every sample, was a hit.
    Interval {
        lower: if hits == 0 { 0.0 } else { centre - half },
        upper: if hits == samples { 1.0 } else { centre + half },
    }
}

/// Smallest eigenvalue of the Gramian of a loss pencil.
fn smallest(pencil: &[Mat<f64>; 3], side: Side, n: usize, coordinates: &[usize], horizon: f64) -> Option<f64> {
    let (a, b) = state_space(pencil, side, n, coordinates)?;
    let r = coordinates.len();
    let speed = if side == Side::Inputs { horizon } else { horizon.recip() };
    let scale: Vec<f64> = (0..2 * r).map(|i| if i < r { 1.0 } else { speed }).collect();
    smallest_eigenvalue(&gramian(&a, &b, horizon)?, &scale)
}

/// `A, B` (for outputs `Aᵀ, Cᵀ`) of a loss pencil in these coordinates. `None` if they are none, or H_r is singular.
fn state_space(pencil: &[Mat<f64>; 3], side: Side, n: usize, coordinates: &[usize]) -> Option<(Mat<f64>, Mat<f64>)> {
    let (r, c) = (coordinates.len(), pencil[0].ncols() - n);
    let last = pencil[0].nrows() - n - c;
    let block = |k: usize, row: usize, rows: usize, column: usize, columns: usize| -> MatRef<'_, f64> {
        pencil[k].as_ref().submatrix(row, column, rows, columns)
    };
    // K: identity on the coordinates, −C_d⁻¹ C_r on the others.
    let dependent: Vec<usize> = (0..n).filter(|i| !coordinates.contains(i)).collect();
    let rows = block(0, n, c, 0, n);
    let pick = |columns: &[usize]| Mat::from_fn(c, columns.len(), |i, j| rows[(i, columns[j])]);
    let depending = pick(&dependent).full_piv_lu().solve(pick(coordinates));
    let basis = Mat::from_fn(n, r, |i, j| match coordinates.iter().position(|q| *q == i) {
        Some(q) => f64::from(u8::from(q == j)),
        None => -depending[(dependent.iter().position(|q| *q == i).unwrap_or(0), j)],
    });
    let reduce = |k: usize| basis.transpose() * block(k, 0, n, 0, n) * &basis;
    let inertia = reduce(2);
    let cholesky = inertia.llt(faer::Side::Lower).ok()?;
    let (stiffness, damping) = (cholesky.solve(reduce(0)), cholesky.solve(reduce(1)));
    let a = Mat::from_fn(2 * r, 2 * r, |i, j| match (i < r, j < r) {
        (true, _) => f64::from(u8::from(j == r + i)),
        (false, true) => -stiffness[(i - r, j)],
        (false, false) => -damping[(i - r, j - r)],
    });
    if side == Side::Inputs {
        let force = block(0, n + c, last, 0, n);
        let through = cholesky.solve(basis.transpose() * force.transpose());
        let b = Mat::from_fn(2 * r, last, |i, j| if i < r { 0.0 } else { through[(i - r, j)] });
        return finite(&a, &b).then_some((a, b));
    }
    // Outputs see motion and multipliers μ with Cᵀμ = −(Hq̈ + Dq̇ + Sq), q̈ = K (−M⁻¹(S_r q + D_r q̇)).
    let gram = rows * rows.transpose();
    let torques = |q: MatRef<'_, f64>, k: usize| block(k, 0, n, 0, n) * q;
    let on_position = torques(basis.as_ref(), 0) - torques((&basis * &stiffness).as_ref(), 2);
    let on_speed = torques(basis.as_ref(), 1) - torques((&basis * &damping).as_ref(), 2);
    let multiplier = |load: &Mat<f64>| gram.full_piv_lu().solve(rows * load);
    let (by_position, by_speed) = (multiplier(&on_position), multiplier(&on_speed));
    let (positions, rates, forces) =
        (block(0, n + c, last, 0, n), block(1, n + c, last, 0, n), block(0, n + c, last, n, c));
    let position = positions * &basis - forces * by_position;
    let speed = rates * &basis - forces * by_speed;
    let b = Mat::from_fn(2 * r, last, |i, j| if i < r { position[(j, i)] } else { speed[(j, i - r)] });
    let a = a.transpose().to_owned();
    finite(&a, &b).then_some((a, b))
}

fn finite(a: &Mat<f64>, b: &Mat<f64>) -> bool {
    a.is_all_finite() && b.is_all_finite()
}

#[cfg(test)]
#[path = "../tests/unit/sampling.rs"]
mod tests;
