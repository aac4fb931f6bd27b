use faer::c64;
use kardan_rt::functions::{log2, powi};

use super::Matrix;

/// `m(s) = c (sI − A)⁻¹ b` and its derivative at many places s: A is brought to upper Hessenberg form once, O(n³), so that each
/// place costs O(n²).
///
/// Method: Householder reflections, then elimination with partial pivoting below the diagonal (Laub 1981); backward stable.
/// At an eigenvalue of A the values are infinite, no numbers, or as large as rounding lets them be.
///
/// ```
/// use faer::c64;
/// use kardan::num::{Matrix, Transfer};
/// // 1/(s² + 4) at s = j, and its derivative −2s/(s² + 4)².
/// let a = Matrix::from_fn(2, 2, |i, j| [[0.0, 1.0], [-4.0, 0.0]][i][j]);
/// let mut m = Transfer::new(&a, &[0.0, 1.0], &[1.0, 0.0]);
/// let (value, slope) = m.at(c64::new(0.0, 1.0));
/// assert!((value - c64::new(1.0 / 3.0, 0.0)).norm() < 1e-15 && (slope - c64::new(0.0, -2.0 / 9.0)).norm() < 1e-15);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    /// A in Hessenberg form, row by row.
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    /// sI − A, then its upper triangle after elimination.
    shifted: Vec<c64>,
    x: Vec<c64>,
    y: Vec<c64>,
}

impl Transfer {
    /// Of A, n × n, b and c of length n.
    ///
    /// # Panics
    /// If the lengths do not fit.
    pub fn new(a: &Matrix<f64>, b: &[f64], c: &[f64]) -> Self {
        let n = a.rows();
        assert!(a.columns() == n && b.len() == n && c.len() == n, "states of a transfer function");
        let (mut a, mut b, mut c) = (a.as_slice().to_vec(), b.to_vec(), c.to_vec());
        let mut v = vec![0.0; n];
        for k in 0..n.saturating_sub(2) {
            // v reflects column k below the diagonal onto its first entry.
            if (k + 2..n).all(|i| a[i * n + k] == 0.0) {
                continue;
            }
            // By a power of two near one, so that no square vanishes or overflows; the reflection is the same.
            let largest = (k + 1..n).fold(0.0f64, |largest, i| largest.max(a[i * n + k].abs()));
            let scale = powi(2.0, -(log2(largest).floor() as i32).clamp(-1000, 1000));
            (k + 1..n).for_each(|i| v[i] = a[i * n + k] * scale);
            let length = v[k + 1..].iter().map(|x| powi(*x, 2)).sum::<f64>().sqrt();
            v[k + 1] += length.copysign(v[k + 1]);
            let factor = 2.0 / v[k + 1..].iter().map(|x| x * x).sum::<f64>();
            for j in k..n {
                let along = factor * (k + 1..n).map(|i| v[i] * a[i * n + j]).sum::<f64>();
                (k + 1..n).for_each(|i| a[i * n + j] -= along * v[i]);
            }
            for row in a.chunks_exact_mut(n).chain([&mut c[..]]) {
                let along = factor * row[k + 1..].iter().zip(&v[k + 1..]).map(|(x, v)| x * v).sum::<f64>();
                row[k + 1..].iter_mut().zip(&v[k + 1..]).for_each(|(x, v)| *x -= along * v);
            }
            let along = factor * (k + 1..n).map(|i| v[i] * b[i]).sum::<f64>();
            (k + 1..n).for_each(|i| b[i] -= along * v[i]);
            (k + 2..n).for_each(|i| a[i * n + k] = 0.0);
        }
        let zero = c64::new(0.0, 0.0);
        Self { a, b, c, shifted: vec![zero; n * n], x: vec![zero; n], y: vec![zero; n] }
    }

    /// m and dm/ds at a place; nothing is allocated.
    pub fn at(&mut self, s: c64) -> (c64, c64) {
        let zero = c64::new(0.0, 0.0);
        let Self { a, b, c, shifted, x, y } = self;
        let n = b.len();
        for i in 0..n {
            for j in i.saturating_sub(1)..n {
                shifted[i * n + j] = c64::new(-a[i * n + j], 0.0);
            }
            shifted[i * n + i] += s;
            x[i] = c64::new(b[i], 0.0);
        }
        // The factors of the elimination stand where they make zeros, y remembers which rows were exchanged.
        for k in 0..n.saturating_sub(1) {
            let (above, below) = shifted.split_at_mut((k + 1) * n);
            let (row, next) = (&mut above[k * n + k..], &mut below[k..n]);
            let exchanged = next[0].norm_sqr() > row[0].norm_sqr();
            if exchanged {
                row.swap_with_slice(next);
                x.swap(k, k + 1);
            }
            y[k] = c64::new(f64::from(u8::from(exchanged)), 0.0);
            let factor = if next[0] == zero { zero } else { next[0] / row[0] };
            next[1..].iter_mut().zip(&row[1..]).for_each(|(below, above)| *below -= factor * above);
            next[0] = factor;
            let (above, below) = (x[k], &mut x[k + 1]);
            *below -= factor * above;
        }
        back(shifted, x);
        let value = c.iter().zip(&*x).map(|(c, x)| x * *c).sum();
        // −(sI − A)⁻¹ x: dm/ds = −c (sI − A)⁻² b.
        for k in 0..n.saturating_sub(1) {
            if y[k].re != 0.0 {
                x.swap(k, k + 1);
            }
            let above = x[k];
            x[k + 1] -= shifted[(k + 1) * n + k] * above;
        }
        back(shifted, x);
        let slope: c64 = c.iter().zip(&*x).map(|(c, x)| x * *c).sum();
        (value, -slope)
    }
}

/// Solves with the upper triangle of a matrix, in place.
fn back(upper: &[c64], x: &mut [c64]) {
    let n = x.len();
    for k in (0..n).rev() {
        let rest: c64 = (k + 1..n).map(|j| upper[k * n + j] * x[j]).sum();
        x[k] = (x[k] - rest) / upper[k * n + k];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::Random;

    /// Against the definition: `(sI − A) x = b` by elimination of real matrices of twice the size, and its derivative by solving
    /// once more.
    #[test]
    fn it_solves_the_shifted_equations() {
        let mut random = Random::new(11);
        for n in 1..14 {
            let sparse = n % 3 == 0;
            let mut entry = |_: usize, _: usize| {
                let x = random.unit() - 0.5;
                if sparse && random.unit() < 0.6 { 0.0 } else { x }
            };
            let a = Matrix::from_fn(n, n, &mut entry);
            let (b, c) = (Matrix::from_fn(n, 1, &mut entry), Matrix::from_fn(n, 1, &mut entry));
            let mut found = Transfer::new(&a, b.as_slice(), c.as_slice());
            for s in [c64::new(0.0, 2.3), c64::new(0.4, 0.9), c64::new(-1.7, 1e-3)] {
                let whole = Matrix::from_fn(2 * n, 2 * n, |i, j| {
                    let same = f64::from(u8::from(i % n == j % n));
                    match (i < n, j < n) {
                        (true, false) => -s.im * same,
                        (false, true) => s.im * same,
                        _ => s.re * same - a[(i % n, j % n)],
                    }
                });
                let right = Matrix::from_fn(2 * n, 1, |i, _| if i < n { b[(i, 0)] } else { 0.0 });
                let x = whole.solve(&right).expect("no eigenvalue");
                let twice = whole.solve(&x).expect("no eigenvalue");
                let along =
                    |x: &Matrix<f64>| (0..n).map(|k| c64::new(x[(k, 0)], x[(k + n, 0)]) * c[(k, 0)]).sum::<c64>();
                let (value, slope) = found.at(s);
                let size = |x: &Matrix<f64>| x.as_slice().iter().fold(0.0f64, |max, x| max.max(x.abs()));
                assert!((value - along(&x)).norm() <= 1e-11 * size(&x), "{n}: {value:?}");
                assert!((slope + along(&twice)).norm() <= 1e-10 * size(&twice), "{n}: {slope:?}");
            }
        }
    }
}
