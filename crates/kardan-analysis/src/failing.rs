//! The modes that lose controllability or observability.

use faer::{Mat, c64};
use kardan_rt::functions::hypot;

use super::{ConstrainedSystem, LinearSystem};
use kardan_math::num::{Matrix, Rational, null_vectors, rational_to_f64};
use kardan_results::{Complex, FailingMode, Mode, NamedShare, Pole, Structure, Undecided};

/// A system before reduction, with its basis: the data to name shafts and elements.
#[derive(Debug, Clone, Copy)]
pub struct Mechanics<'a> {
    /// The terms.
    pub system: &'a ConstrainedSystem,
    /// K, one column per reduced coordinate.
    pub basis: &'a Matrix<Rational>,
}

/// Which shafts and elements take part in the modes that inputs do not reach or outputs do not show.
///
/// The exact factors determine which eigenvalues fail and how often; floating point determines the motion only: the null
/// vectors v of `[λ²H + λD + S; Fᵀ]` (of `[…; C]`), since the matrices are symmetric \[diss. (5.15), corrected\]. Shares are
/// relative to the largest, independent of the basis chosen in the null space. Without mechanics the states are named.
/// Also sets `factor`, `controllable` and `observable` of modes that have no `factor` yet. What is not decided is not
/// listed.
pub fn failing_modes(
    structure: &mut Structure,
    modes: &mut [Mode],
    system: &LinearSystem,
    mechanics: Option<Mechanics<'_>>,
) {
    let factors = structure.factors.clone();
    for factor in &factors {
        for &eigenvalue in factor.roots.iter().filter(|root| root.im >= 0.0) {
            let Undecided { controllability, observability } = structure.undecided;
            for (defect, open, inputs) in
                [(factor.input_defect, controllability, true), (factor.output_defect, observability, false)]
            {
                if defect == 0 || open {
                    continue;
                }
                let (shafts, elements) = participants(system, mechanics, eigenvalue, defect, inputs);
                let mode = FailingMode { factor: factor.polynomial.clone(), eigenvalue, defect, shafts, elements };
                if inputs { structure.uncontrollable.push(mode) } else { structure.unobservable.push(mode) }
            }
        }
    }
    let size = |a: Pole, b: Pole| hypot(a.re - b.re, a.im - b.im);
    for mode in modes.iter_mut().filter(|mode| mode.factor.is_empty()) {
        let roots =
            factors.iter().flat_map(|f| f.roots.iter().filter(|root| root.im >= 0.0).map(move |root| (f, *root)));
        let nearest = roots.min_by(|a, b| size(a.1, mode.eigenvalue).total_cmp(&size(b.1, mode.eigenvalue)));
        let Some((factor, root)) = nearest else {
            (mode.controllable, mode.observable) = (structure.controllable(), structure.observable());
            continue;
        };
        // A factor that is not written out has no roots here; its modes are those far from all others, and do not fail.
        let near = size(root, mode.eigenvalue) <= 1e-6 * mode.natural_frequency.max(root.abs()).max(1e-9);
        let complete = factors.iter().all(|f| !f.roots.is_empty());
        if complete || near {
            mode.factor.clone_from(&factor.polynomial);
            mode.controllable = factor.input_defect == 0;
            mode.observable = factor.output_defect == 0;
        } else {
            let open = factors.iter().filter(|f| f.roots.is_empty());
            mode.controllable = open.clone().all(|f| f.input_defect == 0);
            mode.observable = open.clone().all(|f| f.output_defect == 0);
        }
    }
}

/// Smaller shares are left out.
pub(super) const LEAST_SHARE: f64 = 1e-9;

/// Largest first.
type Shares = Vec<NamedShare>;

fn participants(
    system: &LinearSystem,
    mechanics: Option<Mechanics<'_>>,
    eigenvalue: Pole,
    defect: usize,
    inputs: bool,
) -> (Shares, Shares) {
    let lambda = c64::new(eigenvalue.re, eigenvalue.im);
    let number = |x: &Rational| c64::new(rational_to_f64(x), 0.0);
    let n = system.states.len();
    let rows = if inputs { system.inputs.len() } else { system.outputs.len() };
    let (Some(r), Some(mechanics)) = (system.degrees_of_freedom, mechanics) else {
        // Left null vectors of [λE − A, B], right ones of [λE − A; C].
        let observed = if inputs { &system.transpose() } else { system };
        let matrix = Mat::from_fn(n + rows, n, |i, j| match i < n {
            true => lambda * number(&observed.e[(i, j)]) - number(&observed.a[(i, j)]),
            false => number(&observed.c[(i - n, j)]),
        });
        let null = null_space(&matrix, defect);
        let moved = (0..n).map(|i| size_over(&null, |v| v[i]).sqrt());
        return (relative_shares(system.states.iter().cloned().zip(moved), LEAST_SHARE), Vec::new());
    };
    let matrix = Mat::from_fn(r + rows, r, |i, j| {
        if i < r {
            let (h, d, s) = (&system.e[(r + i, r + j)], &system.a[(r + i, r + j)], &system.a[(r + i, j)]);
            return lambda * lambda * number(h) - lambda * number(d) - number(s);
        }
        if inputs {
            number(&system.b[(r + j, i - r)])
        } else {
            number(&system.c[(i - r, j)]) + lambda * number(&system.c[(i - r, r + j)])
        }
    });
    let basis = mechanics.basis.to_f64();
    let component = |v: &[c64], row: &[(usize, Rational)]| {
        row.iter().fold(c64::new(0.0, 0.0), |sum, (shaft, x)| {
            let factor = rational_to_f64(x);
            (0..r).fold(sum, |sum, j| sum + v[j] * (factor * basis[(*shaft, j)]))
        })
    };
    let null = null_space(&matrix, defect);
    let speed = if eigenvalue == Complex::default() { 1.0 } else { eigenvalue.abs() };
    let kinetic = mechanics.system.inertias.iter().map(|term| (term, speed * speed));
    let potential = mechanics.system.springs.iter().map(|term| (term, 1.0));
    let mut elements: Shares = Vec::new();
    for (term, factor) in kinetic.chain(potential) {
        let energy = size_over(&null, |v| component(v, &term.row)) * factor * rational_to_f64(&term.value).abs();
        match elements.iter_mut().find(|one| one.name == term.element) {
            Some(one) => one.share += energy,
            None => elements.push(NamedShare { name: term.element.clone(), share: energy }),
        }
    }
    let total: f64 = elements.iter().map(|one| one.share).sum();
    elements.iter_mut().for_each(|one| one.share /= total);
    let shafts = &mechanics.system.coordinates;
    let moved = (0..shafts.len()).map(|i| size_over(&null, |v| component(v, &[(i, Rational::ONE)])).sqrt());
    (relative_shares(shafts.iter().cloned().zip(moved), LEAST_SHARE), largest_first(elements, LEAST_SHARE))
}

/// `Σ |f(v)|²` over null vectors v.
fn size_over(null: &[Vec<c64>], f: impl Fn(&[c64]) -> c64) -> f64 {
    null.iter().fold(0.0, |sum, v| sum + f(v).norm_sqr())
}

/// Null vectors of a matrix whose rows are brought to one size; none where they are not found.
fn null_space(matrix: &Mat<c64>, defect: usize) -> Vec<Vec<c64>> {
    let size = |i: usize| (0..matrix.ncols()).map(|j| matrix[(i, j)].norm()).fold(0.0, f64::max);
    let sizes: Vec<f64> = (0..matrix.nrows()).map(|i| if size(i) > 0.0 { size(i) } else { 1.0 }).collect();
    let scaled = Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] / sizes[i]);
    let vectors = null_vectors(scaled.as_ref(), defect).map_or_else(Vec::new, |null| null.vectors);
    vectors.into_iter().map(|v| v.into_iter().map(|(re, im)| c64::new(re, im)).collect()).collect()
}

/// Sizes relative to the largest of them, largest first, without those up to `least`.
pub(super) fn relative_shares(all: impl Iterator<Item = (String, f64)>, least: f64) -> Vec<NamedShare> {
    let mut all: Vec<NamedShare> = all.map(|(name, share)| NamedShare { name, share }).collect();
    let largest = all.iter().map(|one| one.share).fold(f64::MIN_POSITIVE, f64::max);
    all.iter_mut().for_each(|one| one.share /= largest);
    largest_first(all, least)
}

/// Shares above `least`, largest first.
fn largest_first(mut all: Vec<NamedShare>, least: f64) -> Vec<NamedShare> {
    all.retain(|one| one.share > least);
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}
