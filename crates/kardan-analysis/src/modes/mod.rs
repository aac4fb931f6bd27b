//! Modes: eigenvalues, motions and energies.

mod energies;
mod null_vectors;
mod pairs;
mod rigid;
mod shape;

use faer::{Mat, c64};
use kardan_rt::functions::hypot;

use super::spectrum::MOST_EXPANDED;
use super::{ConstrainedSystem, LinearSystem, Reduction};
use energies::Elements;
use kardan_math::num::{Matrix, SparseRow, rational_to_f64};
use kardan_results::{Complex, Factor, Mode, Pole};
use null_vectors::{bandwidth, null_space, null_vector, quadratic_null_vectors};
use pairs::{Balanced, Pair, quadratic_pairs, state_matrix, state_pairs};
use rigid::{Rigid, dense, rigid_motions};
use shape::{largest, normalised, root, row_dot, shape, sorted, times};

/// All modes of `λ²H_r + λD_r + S_r`, by size of λ, conjugate pairs once.
///
/// Every eigenvalue is listed as often as it is a root, so that the modes represent 2 · degrees_of_freedom roots, pairs represent two. The
/// shape runs over all shafts, `K v`, with largest entry 1. Shares of stored energy: kinetic `½ J |λ aᵀv|²` and potential
/// `½ s |aᵀv|²`, for λ = 0 the kinetic energy of a motion with the speeds v; they sum to one, terms of one element
/// together. Shares of the loss: `d |λ aᵀv|²`, none for λ = 0 or without damping. Where negative coefficients make a total
/// vanish (a body that falls from a negative spring has the constant energy zero) there are no shares.
///
/// Method: coordinates in which the inertia is the identity; rigid motions (`S_r v = 0`, exact if no stiffness is negative)
/// are split off, each with a root λ = 0 and, where they meet no damping (`D_r v = 0`, exact), with a second one, so that
/// double roots do not spread as rounding would have them; then QR iteration of the balanced first-order form, or
/// the symmetric eigenvalue problem without damping (`faer`). Backward stable: the relative residual of each mode is a
/// few hundred ulp. Cost: that of the eigenvalue problem of order 2 · degrees_of_freedom with vectors.
///
/// `None` if `H_r` is not positive definite, a number is not finite or the iteration fails. The fields `factor`,
/// `controllable` and `observable` stay empty.
///
/// # Panics
/// If the reduction is not one of the system.
pub fn modes(system: &ConstrainedSystem, reduction: &Reduction) -> Option<Vec<Mode>> {
    let r = reduction.degrees_of_freedom();
    if r == 0 {
        return Some(Vec::new());
    }
    let (h, d, s) = (reduction.inertia(), reduction.damping(), reduction.stiffness());
    if !(h.is_all_finite() && d.is_all_finite() && s.is_all_finite()) {
        return None;
    }
    let rigid = rigid_motions(&reduction.system);
    let pairs = quadratic_pairs(&h, &d, &s, &rigid)?;
    let mode = mode_of_vector(system, reduction);
    Some(sorted(pairs.iter().map(|pair| mode(pair.value, &pair.vector)).collect()))
}

/// The modes of a mechanical system with the eigenvalues of its exact factors, each as often as it is one: 2 · degrees_of_freedom roots
/// altogether, even if rounding splits multiple ones.
///
/// Shapes and energies are those of [`modes`]: of the null vectors of `λ²H_r + λD_r + S_r`, as many independent ones as the factor has,
/// repeated where an eigenvalue has fewer of them than its multiplicity. `factor`, `controllable` and
/// `observable` are those of the factor. Roots of factors that are not written out come from [`modes`], which `floating` gives. `None` if
/// these are needed and there are none.
///
/// # Panics
/// If the reduction is not one of the system.
pub fn exact_modes_beside(
    system: &ConstrainedSystem,
    reduction: &Reduction,
    factors: &[Factor],
    floating: impl FnOnce() -> Option<Vec<Mode>>,
) -> Option<Vec<Mode>> {
    let r = reduction.degrees_of_freedom();
    let matrices = [reduction.inertia(), reduction.damping(), reduction.stiffness()];
    if !matrices.iter().all(Mat::is_all_finite) {
        return None;
    }
    let original = matrices.each_ref();
    let band = bandwidth(&original.map(|matrix| matrix.as_ref()));
    let Rigid { free, damped } = rigid_motions(&reduction.system);
    let rigid: Vec<Vec<c64>> = free.iter().chain(&damped).map(|motion| dense(motion, r)).collect();
    let mode = mode_of_vector(system, reduction);
    let at = |pole: Pole, count: usize| {
        let value = c64::new(pole.re, pole.im);
        let vectors = match pole == Complex::default() && rigid.len() == count {
            true => Some(rigid.clone()),
            false => quadratic_null_vectors(original, band, value, count),
        };
        vectors.unwrap_or_default().iter().map(|vector| mode(value, vector)).collect()
    };
    with_exact_values(2 * r, factors, at, floating)
}

/// Whether [`exact_modes_beside`] most likely needs those of [`modes`]: some factor is too long to be written out.
pub fn needs_modes(reduction: &Reduction) -> bool {
    2 * reduction.degrees_of_freedom() > MOST_EXPANDED
}

/// The mode of an eigenvalue and its vector over the reduced coordinates.
fn mode_of_vector(system: &ConstrainedSystem, reduction: &Reduction) -> impl Fn(c64, &[c64]) -> Mode {
    let basis: Vec<Vec<(usize, f64)>> = reduction.basis.iter().map(floats).collect();
    let elements = Elements::new(&reduction.system);
    move |value: c64, vector: &[c64]| {
        let all: Vec<c64> = basis.iter().map(|row| row_dot(row, vector)).collect();
        let scale = largest(&all);
        let vector: Vec<c64> = vector.iter().map(|x| x / scale).collect();
        let shape = shape(&system.coordinates, all.iter().map(|x| x / scale));
        elements.mode(value, &vector, shape)
    }
}

/// The modes of `E ẋ = A x` with the eigenvalues of the exact factors, each as often as it is one: n roots altogether.
///
/// Shapes are those of [`modes_of_pencil`], as many independent ones as the factor has. Roots of factors that are not
/// written out come from there. `None` if these are needed and there are none.
///
/// ```
/// use kardan_analysis::{LinearSystem, exact_modes_of_pencil, structure};
/// use kardan_math::num::{Matrix, Rational};
/// // A² = 0: rounding would make ± 1e-8 of the double zero.
/// let a = Matrix::from_fn(2, 2, |_, j| Rational::from(1 - 2 * j as i64));
/// let system = LinearSystem::state_space(a, Matrix::zeros(2, 0), Matrix::zeros(0, 2));
/// let modes = exact_modes_of_pencil(&system, &structure(&system).unwrap().factors).unwrap();
/// assert_eq!(modes.iter().map(|mode| mode.eigenvalue).collect::<Vec<_>>(), [kardan_results::Complex::default(); 2]);
/// ```
pub fn exact_modes_of_pencil(system: &LinearSystem, factors: &[Factor]) -> Option<Vec<Mode>> {
    let (e, a) = (system.e.to_f64(), system.a.to_f64());
    let n = system.states.len();
    let balanced = Balanced::of(&state_matrix(&e, &a));
    let at = |pole: Pole, count: usize| {
        let Some(Balanced { matrix, scales, tolerance }) = &balanced else { return Vec::new() };
        let value = c64::new(pole.re, pole.im);
        let vectors = match count {
            1 => null_vector(matrix.as_ref(), value, *tolerance).map(|vector| vec![vector]),
            _ => null_space(
                &Mat::from_fn(n, n, |i, j| c64::new(matrix[(i, j)], 0.0) - if i == j { value } else { c64::ZERO }),
                count,
            ),
        };
        let original = |vector: &Vec<c64>| {
            let shape = shape(&system.states, normalised(&times(vector, scales))?.into_iter());
            Some(Mode { shape, ..root(value) })
        };
        vectors.unwrap_or_default().iter().filter_map(original).collect()
    };
    with_exact_values(n, factors, at, || modes_of_pencil(&system.states, &e, &a))
}

/// Modes with the roots of the factors as eigenvalues, `count` roots altogether; `at` gives modes of independent vectors to
/// an eigenvalue, as many as requested or none, and `floating` all modes as floating point has them.
fn with_exact_values(
    count: usize,
    factors: &[Factor],
    at: impl Fn(Pole, usize) -> Vec<Mode>,
    floating: impl FnOnce() -> Option<Vec<Mode>>,
) -> Option<Vec<Mode>> {
    let mut out = Vec::new();
    // Every root, those of pairs both.
    let mut exact_poles: Vec<Pole> = Vec::new();
    for factor in factors {
        for &pole in &factor.roots {
            exact_poles.extend(std::iter::repeat_n(pole, factor.algebraic));
            if pole.im < 0.0 {
                continue;
            }
            let found = at(pole, factor.geometric);
            let mode = |k: usize| Mode {
                factor: factor.polynomial.clone(),
                controllable: factor.input_defect == 0,
                observable: factor.output_defect == 0,
                // Without a vector only the eigenvalue is given.
                ..found.get(k % found.len().max(1)).cloned().unwrap_or_else(|| root(c64::new(pole.re, pole.im)))
            };
            out.extend((0..factor.algebraic).map(mode));
        }
    }
    if exact_poles.len() < count {
        // The remaining ones belong to the factors that are not written out.
        let open: Vec<&Factor> = factors.iter().filter(|factor| factor.roots.is_empty()).collect();
        let of_open = |mode: Mode| Mode {
            factor: match open[..] {
                [one] => one.polynomial.clone(),
                _ => "(not written out)".into(),
            },
            controllable: open.iter().all(|factor| factor.input_defect == 0),
            observable: open.iter().all(|factor| factor.output_defect == 0),
            ..mode
        };
        out.extend(remaining_modes(floating()?, &exact_poles, count)?.into_iter().map(of_open));
    }
    Some(sorted(out))
}

/// The remaining modes when for each known root the nearest one is removed from `count` roots; `None` if the modes do not
/// represent that many.
///
/// If one root of a pair is removed, rounding has merged two real roots into the pair.
fn remaining_modes(modes: Vec<Mode>, exact_poles: &[Pole], count: usize) -> Option<Vec<Mode>> {
    let both = |(k, mode): (usize, &Mode)| {
        let Complex { re, im } = mode.eigenvalue;
        let roots = if im == 0.0 { vec![mode.eigenvalue] } else { vec![mode.eigenvalue, Complex { re, im: -im }] };
        roots.into_iter().map(move |root| (k, root))
    };
    let mut unmatched: Vec<(usize, Pole)> = modes.iter().enumerate().flat_map(both).collect();
    if unmatched.len() != count {
        return None;
    }
    for root in exact_poles {
        let distance = |(_, candidate): &(usize, Pole)| hypot(candidate.re - root.re, candidate.im - root.im);
        let nearest =
            (0..unmatched.len()).min_by(|&i, &j| distance(&unmatched[i]).total_cmp(&distance(&unmatched[j])))?;
        unmatched.swap_remove(nearest);
    }
    let of_mode = |(k, mode): (usize, Mode)| {
        let roots = unmatched.iter().filter(|(candidate, _)| *candidate == k).count();
        match (roots, mode.eigenvalue) {
            (0, _) => None,
            (1, Complex { re, im }) if im != 0.0 => {
                let shape = mode.shape.into_iter().map(|part| part.real()).collect();
                let Mode { natural_frequency, damping_ratio, .. } = root(c64::new(re, 0.0));
                Some(Mode { eigenvalue: Complex { re, im: 0.0 }, natural_frequency, damping_ratio, shape, ..mode })
            }
            _ => Some(mode),
        }
    };
    Some(modes.into_iter().enumerate().filter_map(of_mode).collect())
}

/// The mode of a motion that is known: all shafts move as `v e^{λt}`, with `motion` = v (real and imaginary part for each
/// shaft) and the shares of the energies as in [`modes`].
///
/// Of a zero motion (`v = 0`) only the eigenvalue is given.
///
/// # Panics
/// If there is not one entry for each shaft.
pub fn mode_of_motion(system: &ConstrainedSystem, eigenvalue: Pole, motion: &[(f64, f64)]) -> Mode {
    assert_eq!(motion.len(), system.coordinates.len(), "one entry for each shaft");
    let vector: Vec<c64> = motion.iter().map(|(re, im)| c64::new(*re, *im)).collect();
    let value = c64::new(eigenvalue.re, eigenvalue.im);
    match normalised(&vector) {
        Some(vector) => {
            let shape = shape(&system.coordinates, vector.iter().copied());
            Elements::new(system).mode(value, &vector, shape)
        }
        None => root(value),
    }
}

/// The modes of `E ẋ = A x`: roots of `det(λE − A)`, by size, conjugate pairs once; the shape is over the states.
///
/// States have no common unit, so the largest entry, which becomes 1, depends on the units; there are no energies. Method:
/// `E⁻¹A`, balanced, then QR iteration (`faer`). `None` if E is singular, a number is not finite or the iteration fails.
///
/// # Panics
/// If E and A are not square of the number of states.
pub fn modes_of_pencil(states: &[String], e: &Matrix<f64>, a: &Matrix<f64>) -> Option<Vec<Mode>> {
    let n = states.len();
    assert!([e.rows(), e.columns(), a.rows(), a.columns()] == [n; 4], "pencil and states of different sizes");
    if n == 0 {
        return Some(Vec::new());
    }
    let pairs: Vec<Pair> = state_pairs(&state_matrix(e, a), null_vector)?;
    let mode = |pair: &Pair| Mode { shape: shape(states, pair.vector.iter().copied()), ..root(pair.value) };
    Some(sorted(pairs.iter().map(mode).collect()))
}

fn floats(row: &SparseRow) -> Vec<(usize, f64)> {
    row.iter().map(|(j, x)| (*j, rational_to_f64(x))).collect()
}

#[cfg(test)]
#[path = "../../tests/unit/modes.rs"]
mod tests;
