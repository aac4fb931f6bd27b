//! Small dense solvers in memory of the caller. Matrices are stored row by row; no function here panics.

use crate::{Arithmetic, Real};

/// A sum of counts; the largest number where it overflows, which no memory has.
#[inline]
pub const fn sum(counts: &[usize]) -> usize {
    let (mut total, mut rest) = (0usize, counts);
    while let [first, tail @ ..] = rest {
        total = total.saturating_add(*first);
        rest = tail;
    }
    total
}

/// Pivots below this many ulps of their scale count as zero.
fn smallest_pivot<T: Real>() -> T {
    let four = (T::ONE + T::ONE) * (T::ONE + T::ONE);
    four * four * four * T::EPSILON
}

/// The number, if it is one.
#[inline]
pub fn finite<T: Real>(x: T) -> Option<T> {
    x.is_finite().then_some(x)
}

/// Whether no entry is NaN or infinite. Checks all entries without a branch.
#[inline]
pub fn all_finite<T: Real>(x: &[T]) -> bool {
    x.iter().fold(true, |finite, x| finite & x.is_finite())
}

/// Entry of a slice; 0 behind its end.
#[inline]
pub fn at<N: Arithmetic>(x: &[N], k: usize) -> N {
    x.get(k).map_or(N::whole(0), |x| *x)
}

/// Row k of a matrix; empty behind its end.
#[inline]
pub fn row<T>(matrix: &[T], k: usize, columns: usize) -> &[T] {
    matrix.get(k.saturating_mul(columns)..).and_then(|rest| rest.get(..columns)).map_or(&[], |row| row)
}

/// Copies as far as both reach.
#[inline]
pub fn copy<T: Copy>(from: &[T], to: &mut [T]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}

/// Inner product over the shorter of the two.
#[inline]
pub fn dot<N: Arithmetic>(x: &[N], y: &[N]) -> N {
    x.iter().zip(y).fold(N::whole(0), |sum, (x, y)| sum + *x * *y)
}

/// Adds `factor·x` to `out`.
#[inline]
pub fn add_scaled<T: Real>(factor: T, x: &[T], out: &mut [T]) {
    for (value, x) in out.iter_mut().zip(x) {
        *value = *value + factor * *x;
    }
}

/// L and D of the leading n × n block `L D Lᵀ` of a symmetric matrix with `columns` columns, L with a diagonal of ones,
/// where D is stored instead; `None` if the block is not numerically positive definite.
pub fn factor<T: Real>(matrix: &[T], columns: usize, n: usize, lower: &mut [T]) -> Option<()> {
    for j in 0..n {
        let source = row(matrix, j, columns);
        let (above, open) = lower.split_at_mut_checked(j.saturating_mul(n))?;
        let own = open.get_mut(..n)?;
        // The row of L D first, then that of L.
        for k in 0..j {
            let (solved, open) = own.split_at_mut_checked(k)?;
            *open.first_mut()? = at(source, k) - dot(solved, row(above, k, n));
        }
        let mut pivot = at(source, j);
        for k in 0..j {
            let entry = own.get_mut(k)?;
            let scaled = *entry / at(row(above, k, n), k);
            pivot = pivot - *entry * scaled;
            *entry = scaled;
        }
        if !(pivot > smallest_pivot::<T>() * at(source, j).abs()) {
            return None;
        }
        *own.get_mut(j)? = pivot;
    }
    Some(())
}

/// Overwrites `b` (n entries) with `(L D Lᵀ)⁻¹ b`.
pub fn solve_factored<T: Real>(factor: &[T], n: usize, b: &mut [T]) -> Option<()> {
    for i in 0..n {
        let (solved, open) = b.split_at_mut_checked(i)?;
        let value = open.first_mut()?;
        *value = *value - dot(solved, row(factor, i, n));
    }
    for (i, value) in b.iter_mut().enumerate().take(n) {
        *value = *value / at(row(factor, i, n), i);
    }
    for i in (0..n).rev() {
        let (open, solved) = b.split_at_mut_checked(i)?;
        add_scaled(-*solved.first()?, row(factor, i, n), open);
    }
    Some(())
}

/// Solves m equations given as rows of m coefficients and the right-hand side; the last column becomes the solution.
/// `None` if they are numerically dependent.
///
/// Method: rows scaled by their largest coefficient, elimination with partial pivoting.
pub fn solve<T: Real>(equations: &mut [T], m: usize) -> Option<()> {
    let width = m.saturating_add(1);
    for equation in equations.chunks_exact_mut(width).take(m) {
        let largest = equation.iter().take(m).fold(T::ZERO, |max, x| if x.abs() > max { x.abs() } else { max });
        if !(largest > T::ZERO) {
            return None;
        }
        equation.iter_mut().for_each(|x| *x = *x / largest);
    }
    for k in 0..m {
        let open = equations.get_mut(k.saturating_mul(width)..)?;
        let (mut chosen, mut largest) = (0, T::ZERO);
        for (i, equation) in open.chunks_exact(width).take(m.saturating_sub(k)).enumerate() {
            if at(equation, k).abs() > largest {
                (chosen, largest) = (i, at(equation, k).abs());
            }
        }
        if !(largest > smallest_pivot()) {
            return None;
        }
        let (pivot, below) = open.split_at_mut_checked(width)?;
        if let Some(row_below) = chosen.checked_sub(1) {
            pivot
                .iter_mut()
                .zip(below.chunks_exact_mut(width).nth(row_below)?)
                .for_each(|(x, y)| core::mem::swap(x, y));
        }
        for equation in below.chunks_exact_mut(width).take(m.saturating_sub(k).saturating_sub(1)) {
            let share = at(equation, k) / at(pivot, k);
            add_scaled(-share, pivot, equation);
        }
    }
    for k in (0..m).rev() {
        let (above, own) = equations.split_at_mut_checked(k.saturating_mul(width))?;
        let value = at(own, m) / at(own, k);
        *own.get_mut(m)? = value;
        for equation in above.chunks_exact_mut(width) {
            let share = at(equation, k) * value;
            let right = equation.get_mut(m)?;
            *right = *right - share;
        }
    }
    Some(())
}
