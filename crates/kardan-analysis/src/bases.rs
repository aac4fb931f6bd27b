//! Bases of the motions of a system, and their orthogonalisation.

use faer::{Mat, Side};

use super::reduction::columns;
use super::system::minus_loads;
use super::{ConstrainedSystem, reduction, sum_of_terms};
use kardan_math::num::dot;
use kardan_results::{Basis, EigenvalueBounds, NamedMatrix};

/// Why a basis cannot be made orthogonal.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BasisError {
    /// A column follows from those before it.
    #[error("column {column} of the basis follows from those before it")]
    BasisDependent {
        /// Its number.
        column: usize,
        /// Coefficients of all columns, 1 for this one; the combination vanishes but for rounding.
        combination: Vec<f64>,
    },
    /// A possible motion has no kinetic energy.
    #[error("a possible motion has no kinetic energy: bᵀHb = {energy:e} along {direction:?}")]
    InertiaNotDefinite {
        /// The motion b, one entry per shaft.
        direction: Vec<f64>,
        /// bᵀHb; zero (but for rounding) or below.
        energy: f64,
    },
    /// A number is not finite.
    #[error("a number in the {matrix} is not finite")]
    NotFinite {
        /// `inertia`, `damping`, `stiffness` or `basis`.
        matrix: &'static str,
    },
}

/// The columns of a basis made orthogonal in the inner product `⟨x, y⟩_H = xᵀHy` \[diss. Algorithm 1, (4.47)\].
///
/// Returns the orthogonal basis `u` and the orthonormal basis `e`; both span what the first columns span, for every number
/// of columns. Method: modified Gram-Schmidt with two projections of every column, which limits
/// `|⟨eᵢ, eⱼ⟩_H − δᵢⱼ|` within a few dozen ulp times the largest `Σ |eᵢ||H||eⱼ|` also for columns that are nearly
/// dependent. `h`: n × n, symmetric; `basis`: n × r. Cost 2 n² r + 4 n r² flops.
///
/// # Errors
/// [`BasisError`], with its proof.
///
/// # Panics
/// If the shapes do not fit.
pub fn gram_schmidt(h: &Mat<f64>, basis: &Mat<f64>) -> Result<(Mat<f64>, Mat<f64>), BasisError> {
    let (n, r) = (basis.nrows(), basis.ncols());
    assert_eq!((h.nrows(), h.ncols()), (n, n), "inertia and basis of different sizes");
    if !h.is_all_finite() {
        return Err(BasisError::NotFinite { matrix: "inertia" });
    }
    if !basis.is_all_finite() {
        return Err(BasisError::NotFinite { matrix: "basis" });
    }
    let mut orthogonal = Mat::<f64>::zeros(n, r);
    let mut unit: Vec<SparseVector> = Vec::with_capacity(r);
    let mut image: Vec<SparseVector> = Vec::with_capacity(r); // H e
    let mut lengths = Vec::with_capacity(r);
    let mut shares = Mat::<f64>::zeros(r, r); // b_k = u_k + Σ shares[i][k] e_i
    for k in 0..r {
        let mut u: Vec<f64> = (0..n).map(|i| basis[(i, k)]).collect();
        let mut size = dot(&u, &u).sqrt();
        for _pass in 0..2 {
            for i in 0..k {
                let share: f64 = image[i].iter().map(|(j, x)| x * u[*j]).sum();
                if share != 0.0 {
                    shares[(i, k)] += share;
                    unit[i].iter().for_each(|(j, e)| u[*j] -= share * e);
                }
            }
        }
        let parts = (0..k).filter(|&i| shares[(i, k)] != 0.0);
        size += parts.map(|i| shares[(i, k)].abs() * length(&unit[i])).sum::<f64>();
        if !(dot(&u, &u).sqrt() > 1e-13 * size) {
            return Err(BasisError::BasisDependent { column: k, combination: combination(&shares, &lengths, k) });
        }
        let hu = times_symmetric(h, &u);
        let energy = dot(&u, &hu);
        // Rounding of the products of this column, and the remainder of the parts subtracted from it.
        let rounding = 4.0 * f64::EPSILON * n as f64 * absolute_energy(h, &u);
        let removed: f64 = (0..k).map(|i| shares[(i, k)] * shares[(i, k)]).sum();
        if !(energy > rounding.max(1e-26 * removed)) {
            return Err(BasisError::InertiaNotDefinite { direction: u, energy });
        }
        let norm = energy.sqrt();
        for i in 0..n {
            orthogonal[(i, k)] = u[i];
        }
        unit.push(sparse(&u, norm));
        image.push(sparse(&hu, norm));
        lengths.push(norm);
    }
    let mut orthonormal = Mat::zeros(n, r);
    for (k, column) in unit.iter().enumerate() {
        column.iter().for_each(|(i, x)| orthonormal[(*i, k)] = *x);
    }
    Ok((orthogonal, orthonormal))
}

/// Entries other than zero with their places.
type SparseVector = Vec<(usize, f64)>;

/// `x / divisor`.
fn sparse(x: &[f64], divisor: f64) -> SparseVector {
    x.iter().enumerate().filter(|(_, x)| **x != 0.0).map(|(i, x)| (i, x / divisor)).collect()
}

fn length(x: &SparseVector) -> f64 {
    x.iter().map(|(_, x)| x * x).sum::<f64>().sqrt()
}

fn times_symmetric(h: &Mat<f64>, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    for (j, factor) in x.iter().enumerate() {
        if *factor != 0.0 {
            out.iter_mut().zip(h.col(j).iter()).for_each(|(out, h)| *out += factor * h);
        }
    }
    out
}

/// `|x|ᵀ|H||x|`.
fn absolute_energy(h: &Mat<f64>, x: &[f64]) -> f64 {
    let column = |j: usize| h.col(j).iter().zip(x).map(|(h, x)| h.abs() * x.abs()).sum::<f64>();
    (0..x.len()).filter(|&j| x[j] != 0.0).map(|j| x[j].abs() * column(j)).sum()
}

/// `b_k` in terms of the columns before it: `c` with `B c = u_k`, `c_k = 1`.
fn combination(shares: &Mat<f64>, lengths: &[f64], k: usize) -> Vec<f64> {
    let mut out = vec![0.0; shares.ncols()];
    out[k] = 1.0;
    let mut open: Vec<f64> = (0..k).map(|i| -shares[(i, k)]).collect();
    for i in (0..k).rev() {
        // e_i = (b_i − Σ shares[j][i] e_j) / length_i
        out[i] = open[i] / lengths[i];
        for j in 0..i {
            open[j] -= shares[(j, i)] * out[i];
        }
    }
    out
}

/// The system in three bases of `ker C`: chosen coordinates (4.34), elliptical orthogonal and elliptical orthonormal
/// (Algorithm 1) \[diss. Theorems 4.1-4.4\].
///
/// As many of the shafts `preferred` become coordinates as are independent, then others by number. Each basis comes with its
/// reduced matrices (4.38), (4.39), and with Geršgorin's discs of inertia, damping and stiffness, `centre_i = ⟨M bᵢ, bᵢ⟩`,
/// `radius_i = Σ_{j≠i} |⟨M bᵢ, bⱼ⟩|`, with the true eigenvalues; see [`EigenvalueBounds`] for their meaning (the bounds
/// (4.43), (4.45), (4.46) one by one are not valid). Units are those of angles and torques.
///
/// # Errors
/// [`BasisError::InertiaNotDefinite`] if a motion that the constraints allow has no kinetic energy.
///
/// # Panics
/// If `preferred` names a shaft that does not exist, or a duplicate.
pub fn bases(system: &ConstrainedSystem, preferred: &[usize]) -> Result<Vec<Basis>, BasisError> {
    let reduced = reduction(system, preferred);
    let n = system.coordinates.len();
    let chosen = reduced.basis_matrix();
    let inertia = sum_of_terms(&system.inertias, n);
    let damping = minus_loads(sum_of_terms(&system.dampers, n), &system.loads, |slopes| &slopes.on_rates);
    let stiffness = minus_loads(sum_of_terms(&system.springs, n), &system.loads, |slopes| &slopes.on_positions);
    let input = columns(&system.inputs, n);
    let (orthogonal, orthonormal) = gram_schmidt(&inertia, &chosen)?;
    let numbered = |letter: &str| (1..=chosen.ncols()).map(|k| format!("{letter}{k}")).collect::<Vec<_>>();
    let names = [reduced.system.coordinates.clone(), numbered("u"), numbered("e")];
    let inputs: Vec<String> = system.inputs.iter().map(|input| input.element.clone()).collect();
    let congruent = |k: &Mat<f64>| {
        let [h, d, s] = [&inertia, &damping, &stiffness].map(|m| k.transpose() * m * k);
        let [d, s] = if system.loads.is_empty() { [symmetric(&d), symmetric(&s)] } else { [d, s] };
        [symmetric(&h), d, s, k.transpose() * &input]
    };
    let matrices = [
        [reduced.inertia(), reduced.damping(), reduced.stiffness(), reduced.input()],
        congruent(&orthogonal),
        congruent(&orthonormal),
    ];
    let mechanical = ["kg m^2", "N m s/rad", "N m/rad"];
    let units = [mechanical, mechanical, ["1", "1/s", "1/s^2"]];
    let titles = ["chosen coordinates", "elliptical orthogonal", "elliptical orthonormal"];
    let mut out = Vec::new();
    for (k, (basis, [h, d, s, f])) in [chosen, orthogonal, orthonormal].iter().zip(matrices).enumerate() {
        let square = |title: &str, unit: usize, m: &Mat<f64>| named(title, units[k][unit], &names[k], &names[k], m);
        out.push(Basis {
            name: titles[k].to_string(),
            basis: named("basis", "", &system.coordinates, &names[k], basis),
            inertia: square("reduced inertia", 0, &h),
            damping: square("reduced damping", 1, &d),
            stiffness: square("reduced stiffness", 2, &s),
            input: named("reduced input", "", &names[k], &inputs, &f),
            orthogonality: orthogonality(&h),
            bounds: {
                // With loads damping and stiffness are no quadratic forms.
                let all = [("inertia", &h), ("damping", &d), ("stiffness", &s)];
                let forms = if system.loads.is_empty() { 3 } else { 1 };
                let bounds =
                    |(j, (title, m)): (usize, (&'static str, &Mat<f64>))| eigenvalue_bounds(title, units[k][j], m);
                all.into_iter().take(forms).enumerate().map(bounds).collect::<Result<_, _>>()?
            },
        });
    }
    Ok(out)
}

/// The mean of a matrix and its transpose.
fn symmetric(m: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| 0.5 * (m[(i, j)] + m[(j, i)]))
}

/// Largest `|⟨bᵢ, bⱼ⟩_H| / (‖bᵢ‖‖bⱼ‖)`, read from the Gram matrix.
fn orthogonality(gram: &Mat<f64>) -> f64 {
    let mut worst = 0.0f64;
    for j in 0..gram.ncols() {
        for i in 0..j {
            let lengths = (gram[(i, i)] * gram[(j, j)]).sqrt();
            worst = worst.max(gram[(i, j)].abs() / lengths);
        }
    }
    worst
}

/// Geršgorin's discs of a symmetric matrix with its eigenvalues; see [`EigenvalueBounds`].
///
/// Only the lower triangle is read for the eigenvalues.
///
/// # Errors
/// [`BasisError::NotFinite`].
///
/// # Panics
/// If the matrix is not square.
pub fn eigenvalue_bounds(name: &'static str, unit: &str, gram: &Mat<f64>) -> Result<EigenvalueBounds, BasisError> {
    let r = gram.ncols();
    let eigenvalues = match r {
        0 => Some(Vec::new()),
        _ if !gram.is_all_finite() => None,
        _ => gram.self_adjoint_eigenvalues(Side::Lower).ok(),
    };
    let radius = |j: usize| (0..r).filter(|&i| i != j).map(|i| gram[(i, j)].abs()).sum();
    Ok(EigenvalueBounds {
        matrix: name.to_string(),
        unit: unit.to_string(),
        eigenvalues: eigenvalues.ok_or(BasisError::NotFinite { matrix: name })?,
        centres: (0..r).map(|j| gram[(j, j)]).collect(),
        radii: (0..r).map(radius).collect(),
    })
}

/// A matrix with names, for display.
pub(super) fn named(title: &str, unit: &str, rows: &[String], columns: &[String], m: &Mat<f64>) -> NamedMatrix {
    NamedMatrix {
        title: title.to_string(),
        unit: unit.to_string(),
        rows: rows.to_vec(),
        columns: columns.to_vec(),
        values: (0..m.nrows()).map(|i| (0..m.ncols()).map(|j| m[(i, j)]).collect()).collect(),
    }
}
