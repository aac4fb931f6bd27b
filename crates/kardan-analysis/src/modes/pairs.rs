//! Eigenvalues and eigenvectors in floating point.

use std::collections::BTreeSet;

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatRef, Side, c64};

use super::null_vectors::{bandwidth, quadratic_null_vectors};
use super::rigid::Rigid;
use super::shape::{largest, normalised, times};
use kardan_math::num::{Matrix, balance, rational_to_f64};

/// An eigenvalue with imaginary part ≥ 0 and its eigenvector.
pub(super) struct Pair {
    pub value: c64,
    pub vector: Vec<c64>,
}

/// E⁻¹A.
pub(super) fn state_matrix(e: &Matrix<f64>, a: &Matrix<f64>) -> Mat<f64> {
    let n = e.rows();
    let right = Mat::from_fn(n, n, |i, j| a[(i, j)]);
    if n == 0 {
        return right;
    }
    PartialPivLu::new(Mat::from_fn(n, n, |i, j| e[(i, j)]).as_ref()).solve(right)
}

/// Eigenvalues and vectors of `λ²H + λD + S`, all symmetric, H definite.
pub(super) fn quadratic_pairs(h: &Mat<f64>, d: &Mat<f64>, s: &Mat<f64>, rigid: &Rigid) -> Option<Vec<Pair>> {
    let r = h.nrows();
    let original = [h, d, s];
    let factor = h.llt(Side::Lower).ok()?;
    let l = factor.L();
    let unit_inertia = |m: &Mat<f64>| {
        let mut half = m.clone();
        l.solve_lower_triangular_in_place(&mut half);
        let mut out = half.transpose().to_owned();
        l.solve_lower_triangular_in_place(&mut out);
        out
    };
    let (free, rigid_count) = (rigid.free.len(), rigid.free.len() + rigid.damped.len());
    let (mut d, mut s) = (unit_inertia(d), unit_inertia(s));
    let mut motions = Mat::<f64>::zeros(r, rigid_count);
    for (k, motion) in rigid.free.iter().chain(&rigid.damped).enumerate() {
        for (i, x) in motion {
            motions[(*i, k)] = rational_to_f64(x);
        }
    }
    // Orthonormal axes: first the free rigid motions, then the damped ones, then the others.
    let axes = (rigid_count > 0).then(|| (l.transpose() * &motions).qr().compute_Q());
    if let Some(q) = &axes {
        d = q.transpose() * &d * q;
        s = q.transpose() * &s * q;
    }
    let (values, mut vectors, unsolved) =
        if d.norm_max() == 0.0 { undamped_pairs(&s, rigid_count)? } else { damped_pairs(&d, &s, free, rigid_count)? };
    if let Some(q) = &axes {
        vectors = [q * &vectors[0], q * &vectors[1]];
    }
    for part in &mut vectors {
        l.transpose().solve_upper_triangular_in_place(part);
    }
    let exact = |k: usize| Pair { value: c64::ZERO, vector: (0..r).map(|i| c64::new(motions[(i, k)], 0.0)).collect() };
    let mut out: Vec<Pair> = (0..free).chain(0..rigid_count).map(exact).collect();
    let band = bandwidth(&original.map(|matrix| matrix.as_ref()));
    for (k, value) in values.into_iter().enumerate() {
        let vector: Vec<c64> = if unsolved.contains(&k) {
            quadratic_null_vectors(original, band, value, 1)?.swap_remove(0)
        } else {
            (0..r).map(|i| c64::new(vectors[0][(i, k)], vectors[1][(i, k)])).collect()
        };
        out.push(Pair { value, vector: normalised(&vector)? });
    }
    Some(out)
}

pub(super) type Vectors = [Mat<f64>; 2]; // real and imaginary parts

/// Eigenvalues, their vectors, and the numbers of those without a vector.
pub(super) type ExactPairs = (Vec<c64>, Vectors, BTreeSet<usize>);

/// Without damping: `−λ²` are the eigenvalues of S other than those of the `rigid_count` rigid motions.
pub(super) fn undamped_pairs(s: &Mat<f64>, rigid_count: usize) -> Option<ExactPairs> {
    let (r, flexible) = (s.nrows(), s.nrows() - rigid_count);
    if flexible == 0 {
        return Some((Vec::new(), [Mat::zeros(r, 0), Mat::zeros(r, 0)], BTreeSet::new()));
    }
    let eigen = s.submatrix(rigid_count, rigid_count, flexible, flexible).self_adjoint_eigen(Side::Lower).ok()?;
    let (mut values, mut of) = (Vec::new(), Vec::new());
    for k in 0..flexible {
        let square = eigen.S()[k];
        let root = square.abs().sqrt();
        values.push(if square > 0.0 { c64::new(0.0, root) } else { c64::new(-root, 0.0) });
        of.push(k);
        if square <= 0.0 {
            values.push(c64::new(root, 0.0));
            of.push(k);
        }
    }
    let real =
        Mat::from_fn(r, of.len(), |i, k| if i < rigid_count { 0.0 } else { eigen.U()[(i - rigid_count, of[k])] });
    let imaginary = Mat::zeros(r, of.len());
    Some((values, [real, imaginary], BTreeSet::new()))
}

/// First-order form with the states `ω y` (motions other than the rigid ones) and all speeds but those of free rigid motions,
/// which are constant.
pub(super) fn damped_pairs(d: &Mat<f64>, s: &Mat<f64>, free: usize, rigid_count: usize) -> Option<ExactPairs> {
    let r = s.nrows();
    let angles = r - rigid_count;
    let omega = if s.norm_max() > 0.0 { s.norm_max().sqrt() } else { 1.0 };
    let mut a = Mat::<f64>::zeros(angles + r - free, angles + r - free);
    for i in rigid_count..r {
        a[(i - rigid_count, angles + i - free)] = omega;
        for j in rigid_count..r {
            a[(angles + i - free, j - rigid_count)] = -s[(i, j)] / omega;
        }
    }
    for i in free..r {
        for j in free..r {
            a[(angles + i - free, angles + j - free)] = -d[(i, j)];
        }
    }
    // A vector without entries means none.
    let pairs = state_pairs(&a, |_, _, _| Some(Vec::new()))?;
    let unsolved: BTreeSet<usize> = (0..pairs.len()).filter(|&k| pairs[k].vector.is_empty()).collect();
    // λ times the motion, which needs no division by a small λ.
    let mut vectors = [Mat::zeros(r, pairs.len()), Mat::zeros(r, pairs.len())];
    for (k, pair) in pairs.iter().enumerate().filter(|(k, _)| !unsolved.contains(k)) {
        let moved = |i: usize| pair.value * pair.vector[i - rigid_count] * (1.0 / omega);
        let mut motion: Vec<c64> =
            (free..r).map(|i| if i < rigid_count { pair.vector[angles + i - free] } else { moved(i) }).collect();
        if largest(&motion) == c64::ZERO {
            // λ = 0 that was not split off: the angles are the motion.
            motion =
                (free..r).map(|i| if i < rigid_count { c64::ZERO } else { pair.vector[i - rigid_count] }).collect();
        }
        for (i, x) in normalised(&motion)?.into_iter().enumerate() {
            vectors[0][(free + i, k)] = x.re;
            vectors[1][(free + i, k)] = x.im;
        }
    }
    Some((pairs.into_iter().map(|pair| pair.value).collect(), vectors, unsolved))
}

/// A matrix in balanced coordinates.
pub(super) struct Balanced {
    pub matrix: Mat<f64>,
    /// What the entries of its vectors are multiplied by for those of the original matrix.
    pub scales: Vec<f64>,
    /// Of the residual of an eigenvector with largest entry 1.
    pub tolerance: f64,
}

impl Balanced {
    /// `None` if a number is not finite.
    pub fn of(a: &Mat<f64>) -> Option<Self> {
        let n = a.nrows();
        let scales = a.is_all_finite().then(|| balance(a))?;
        let matrix = Mat::from_fn(n, n, |i, j| a[(i, j)] * scales[j] / scales[i]);
        let tolerance = 1e-14 * n as f64 * matrix.norm_l2();
        Some(Self { matrix, scales, tolerance })
    }
}

/// Eigenvalues with imaginary part ≥ 0 and eigenvectors of a matrix.
///
/// `faer` returns overflowing or wrong vectors for eigenvalues that are nearly defective several times over, so every vector
/// is checked by its residual; `otherwise` finds another one, of the balanced matrix with a residual below the tolerance.
pub(super) fn state_pairs(
    a: &Mat<f64>,
    otherwise: impl Fn(MatRef<'_, f64>, c64, f64) -> Option<Vec<c64>>,
) -> Option<Vec<Pair>> {
    let Balanced { matrix: balanced, scales, tolerance } = Balanced::of(a)?;
    let n = a.nrows();
    if n == 0 {
        return Some(Vec::new());
    }
    let eigen = balanced.eigen().ok()?;
    let retained: Vec<usize> = (0..n).filter(|&k| eigen.S()[k].im >= 0.0).collect();
    let vectors: Vec<Option<Vec<c64>>> =
        retained.iter().map(|&k| normalised(&(0..n).map(|i| eigen.U()[(i, k)]).collect::<Vec<_>>())).collect();
    let part = |of: fn(&c64) -> f64| {
        Mat::from_fn(n, retained.len(), |i, k| vectors[k].as_ref().map_or(0.0, |vector| of(&vector[i])))
    };
    let images = [&balanced * part(|x| x.re), &balanced * part(|x| x.im)];
    let mut out = Vec::new();
    for (k, vector) in vectors.into_iter().enumerate() {
        let value = eigen.S()[retained[k]];
        let solves = |vector: &Vec<c64>| {
            (0..n).all(|i| (c64::new(images[0][(i, k)], images[1][(i, k)]) - value * vector[i]).norm() <= tolerance)
        };
        let vector = vector.filter(solves).or_else(|| otherwise(balanced.as_ref(), value, tolerance))?;
        let vector = times(&vector, &scales);
        out.push(Pair { value, vector: if vector.is_empty() { vector } else { normalised(&vector)? } });
    }
    Some(out)
}
