//! Robust pole placement by a choice of eigenvectors.

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, c64};
use kardan_rt::functions::ln;

use super::pole_list::TargetPole;
use kardan_math::num::Random;

/// A gain with the eigenvectors that it gives.
#[derive(Debug, Clone)]
pub(super) struct Assignment {
    /// K with `A − BK = XΛX⁻¹`.
    pub gain: Mat<f64>,
    /// Condition number of X with columns of unit length.
    pub condition: f64,
}

/// A pole or a pair, the space in which its eigenvector can lie, and the eigenvector.
struct Part {
    target: TargetPole,
    /// Orthonormal columns; real for a real pole.
    space: Mat<c64>,
    vector: Mat<c64>,
    /// First column in X.
    at: usize,
}

/// Rounds through all poles; after a few the determinant grows only a little.
const MOST_ROUNDS: usize = 30;

/// Eigenvectors as independent as they can be made, and the gain that has them.
///
/// The eigenvector of λ can be any vector of the null space of `U₁ᵀ(A − λI)` with U₁ᵀB = 0 (Kautsky, Nichols and Van Dooren
/// 1985). One pole, pair or two real poles at a time get the vectors that maximise `|det X|` while all others stay (Tits and
/// Yang 1996): for a real pole the projection of the vector orthogonal to all others, for a pair the eigenvector of a Hermitian
/// matrix, for two real poles singular vectors. `rank` is that of B. `None` if X is numerically singular.
pub(super) fn assign(a: &Mat<f64>, b: &Mat<f64>, rank: usize, targets: &[TargetPole]) -> Option<Assignment> {
    let n = a.nrows();
    let svd = b.svd().ok()?;
    let normal = svd.U().get(.., rank..n).to_owned();
    let mut random = Random::new(1);
    let mut parts = Vec::new();
    let mut at = 0;
    for &target in targets {
        let space = space_of(a, &normal, target)?;
        let weights = Mat::from_fn(space.ncols(), 1, |_, _| {
            let im = if matches!(target, TargetPole::Pair(..)) { random.unit() - 0.5 } else { 0.0 };
            c64::new(random.unit() - 0.5, im)
        });
        let vector = unit(&(&space * weights));
        parts.push(Part { target, space, vector, at });
        at += if matches!(target, TargetPole::Pair(..)) { 2 } else { 1 };
    }
    let mut x = Mat::zeros(n, n);
    parts.iter().for_each(|part| part.write(&mut x));
    if rank > 1 {
        improve(&mut parts, &mut x)?;
    }
    let singular = x.singular_values().ok()?;
    let condition = singular.first().zip(singular.last()).map_or(1.0, |(high, low)| high / low);
    if !(condition < 1e15) {
        return None;
    }
    // B K = A − XΛX⁻¹
    let mut moved = Mat::zeros(n, n);
    for part in &parts {
        match part.target {
            TargetPole::Real(pole) => (0..n).for_each(|i| moved[(i, part.at)] = pole * x[(i, part.at)]),
            TargetPole::Pair(re, im) => (0..n).for_each(|i| {
                let (u, v) = (x[(i, part.at)], x[(i, part.at + 1)]);
                moved[(i, part.at)] = re * u - im * v;
                moved[(i, part.at + 1)] = im * u + re * v;
            }),
        }
    }
    let closed: Mat<f64> = x.transpose().full_piv_lu().solve(moved.transpose()).transpose().to_owned();
    let change = svd.U().get(.., ..rank).transpose() * (a - closed);
    let strength = Mat::from_fn(rank, n, |i, j| change[(i, j)] / svd.S()[i]);
    let gain = svd.V().get(.., ..rank) * strength;
    gain.is_all_finite().then_some(Assignment { gain, condition })
}

/// Null space of `U₁ᵀ(A − λI)`; its dimension is the rank of B where all modes are reached.
fn space_of(a: &Mat<f64>, normal: &Mat<f64>, target: TargetPole) -> Option<Mat<c64>> {
    let n = a.nrows();
    let dimension = n - normal.ncols();
    let complex = |x: f64| c64::new(x, 0.0);
    if normal.ncols() == 0 {
        return Some(Mat::from_fn(n, n, |i, j| complex(f64::from(u8::from(i == j)))));
    }
    let from = n - dimension;
    let rows = normal.transpose() * a;
    match target {
        TargetPole::Real(pole) => {
            let svd = (rows - faer::Scale(pole) * normal.transpose()).svd().ok()?;
            Some(Mat::from_fn(n, dimension, |i, j| complex(svd.V()[(i, from + j)])))
        }
        TargetPole::Pair(re, im) => {
            let matrix = Mat::from_fn(rows.nrows(), n, |i, j| {
                complex(rows[(i, j)]) - c64::new(re, im) * complex(normal[(j, i)])
            });
            let svd = matrix.svd().ok()?;
            Some(svd.V().get(.., from..).to_owned())
        }
    }
}

fn improve(parts: &mut [Part], x: &mut Mat<f64>) -> Option<()> {
    let singles: Vec<usize> = (0..parts.len()).filter(|&k| matches!(parts[k].target, TargetPole::Real(_))).collect();
    let mut last = f64::NEG_INFINITY;
    for round in 0..MOST_ROUNDS {
        for part in parts.iter_mut() {
            part.improve(x)?;
        }
        for two in singles.windows(2).skip(round % 2).step_by(2) {
            let [first, second] = parts.get_disjoint_mut([two[0], two[1]]).ok()?;
            improve_two(first, second, x)?;
        }
        let volume: f64 = x.singular_values().ok()?.iter().map(|s| ln(*s)).sum();
        if volume - last < 1e-4 {
            break;
        }
        last = volume;
    }
    Some(())
}

impl Part {
    fn width(&self) -> usize {
        if matches!(self.target, TargetPole::Pair(..)) { 2 } else { 1 }
    }

    /// Puts the vector into X: `√2 Re x, √2 Im x` for a pair, with the same condition as `[x, x̄]`.
    fn write(&self, x: &mut Mat<f64>) {
        for i in 0..x.nrows() {
            let entry = self.vector[(i, 0)];
            if self.width() == 2 {
                x[(i, self.at)] = std::f64::consts::SQRT_2 * entry.re;
                x[(i, self.at + 1)] = std::f64::consts::SQRT_2 * entry.im;
            } else {
                x[(i, self.at)] = entry.re;
            }
        }
    }

    fn take(&mut self, weights: &Mat<c64>, x: &mut Mat<f64>) {
        let vector = unit(&(&self.space * weights));
        if vector.is_all_finite() {
            self.vector = vector;
            self.write(x);
        }
    }

    /// The best vector while all others stay.
    fn improve(&mut self, x: &mut Mat<f64>) -> Option<()> {
        if self.width() == 1 {
            let q = orthogonal(x, &[self.at])?;
            let weights = self.space.adjoint() * &q;
            if weights.norm_l2() > 1e-14 {
                self.take(&weights, x);
            }
            return Some(());
        }
        // |det| is 2 |Im(ū v)| with u = q₁ᵀx, v = q₂ᵀx: a Hermitian form in the weights.
        let q = orthogonal(x, &[self.at, self.at + 1])?;
        let [u, v] = [0, 1].map(|k| self.space.adjoint() * q.get(.., k..k + 1));
        let m = self.space.ncols();
        let form = Mat::from_fn(m, m, |i, j| {
            (u[(i, 0)] * v[(j, 0)].conj() - v[(i, 0)] * u[(j, 0)].conj()) * c64::new(0.0, -0.5)
        });
        let eigen = form.self_adjoint_eigen(faer::Side::Lower).ok()?;
        let best = (0..m).max_by(|&i, &j| eigen.S()[i].re.abs().total_cmp(&eigen.S()[j].re.abs()))?;
        if eigen.S()[best].re.abs() > 1e-28 {
            self.take(&eigen.U().get(.., best..best + 1).to_owned(), x);
        }
        Some(())
    }
}

/// The best vectors of two real poles while all others stay: `|q₁ᵀx q₂ᵀy − q₂ᵀx q₁ᵀy|` is a bilinear form in their weights.
fn improve_two(first: &mut Part, second: &mut Part, x: &mut Mat<f64>) -> Option<()> {
    let q = orthogonal(x, &[first.at, second.at])?;
    let on = |part: &Part| {
        Mat::from_fn(part.space.ncols(), 2, |i, k| {
            (0..q.nrows()).map(|r| part.space[(r, i)].re * q[(r, k)].re).sum::<f64>()
        })
    };
    let (u, v) = (on(first), on(second));
    let form = Mat::from_fn(u.nrows(), v.nrows(), |i, j| u[(i, 0)] * v[(j, 1)] - u[(i, 1)] * v[(j, 0)]);
    let svd = form.svd().ok()?;
    if svd.S()[0] > 1e-28 {
        let complex = |m: MatRef<'_, f64>| Mat::from_fn(m.nrows(), 1, |i, _| c64::new(m[(i, 0)], 0.0));
        first.take(&complex(svd.U().get(.., ..1)), x);
        second.take(&complex(svd.V().get(.., ..1)), x);
    }
    Some(())
}

/// Orthonormal vectors orthogonal to all columns of X but those given.
fn orthogonal(x: &Mat<f64>, excluded: &[usize]) -> Option<Mat<c64>> {
    let n = x.nrows();
    let retained: Vec<usize> = (0..n).filter(|j| !excluded.contains(j)).collect();
    if retained.is_empty() {
        return Some(Mat::from_fn(n, n, |i, j| c64::new(f64::from(u8::from(i == j)), 0.0)));
    }
    let retained_vectors = Mat::from_fn(n, retained.len(), |i, j| x[(i, retained[j])]);
    let svd = retained_vectors.svd().ok()?;
    Some(Mat::from_fn(n, excluded.len(), |i, j| c64::new(svd.U()[(i, retained.len() + j)], 0.0)))
}

fn unit(vector: &Mat<c64>) -> Mat<c64> {
    let length = vector.norm_l2();
    Mat::from_fn(vector.nrows(), 1, |i, _| vector[(i, 0)] / length)
}
