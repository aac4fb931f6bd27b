//! The definition of a canonically decoupled system, as a check of what the library finds.

use std::ops::Range;

use kardan::analysis::LinearSystem;
use kardan::num::{Matrix, Rational, Scalar};
use kardan::synthesis::decoupling::{CanonicalForm, observable_quotient};

/// Checks the four conditions of a canonically decoupled system exactly \[diss. (6.73)-(6.78), Table 6.2\]; the error is the
/// number of the first one that fails, and how.
///
/// 1. A, B, C have the partitions (6.73)-(6.75).
/// 2. A_i, b_i, c_i have the form (6.76)-(6.78) with a chain of r_i integrators and γ_i ≠ 0.
/// 3. (A_i, b_i) is controllable.
/// 4. A row η that touches the states shared by several channels responds to at least two of them:
///    `η (sI − A)⁻¹ B` has two nonzero entries. It has at most the i-th if and only if η annihilates what all other inputs
///    reach; so for every i no row of that left null space may touch the shared states: the other inputs reach these.
///
/// `degrees` are the relative degrees r_i. For r_i = 0, which the source does not treat, c_i is zero, A_i and b_i are free,
/// and `D_ii ≠ 0`.
pub fn check_canonical(form: &CanonicalForm, degrees: &[Option<usize>]) -> Result<(), (usize, String)> {
    let m = degrees.len();
    let n: usize = form.sizes.iter().sum();
    assert!(
        form.sizes.len() == m + 2 && form.a.rows() == n && form.b.rows() == n && form.c.rows() == m,
        "the shapes of the form do not fit its sizes"
    );
    let fails = |condition: usize, what: String| Err((condition, what));
    let starts: Vec<usize> = (0..=m + 2).map(|block| form.sizes[..block].iter().sum()).collect();
    let range = |block: usize| starts[block]..starts[block + 1];
    let is_zero = |matrix: &Matrix<Rational>, rows: Range<usize>, columns: Range<usize>| {
        rows.into_iter().all(|i| matrix.row(i)[columns.clone()].iter().all(Scalar::is_zero))
    };
    for block in 0..m + 2 {
        // Block m is driven by all, every block by the last, block m + 1 by itself alone.
        let driver =
            |block_number: usize| block_number == block || block_number == m + 1 || (block == m && block_number <= m);
        if let Some(block_number) = (0..m + 2).find(|&o| !driver(o) && !is_zero(&form.a, range(block), range(o))) {
            return fails(1, format!("part {} of A drives part {}", block_number + 1, block + 1));
        }
        let input = |j: usize| block == j || block == m;
        if let Some(j) = (0..m).find(|&j| !input(j) && !is_zero(&form.b, range(block), j..j + 1)) {
            return fails(1, format!("input {} drives part {}", j + 1, block + 1));
        }
    }
    for (i, degree) in degrees.iter().enumerate() {
        let is_read = |block: usize| block == i || block == m + 1;
        if let Some(block) = (0..=m).find(|&block| !is_read(block) && !is_zero(&form.c, i..i + 1, range(block))) {
            return fails(1, format!("output {} depends on part {}", i + 1, block + 1));
        }
        if let Some(j) = (0..m).find(|&j| form.d[(i, j)].is_zero() != (i != j || *degree != Some(0))) {
            return fails(1, format!("D({}, {}) has a wrong value", i + 1, j + 1));
        }
        let Some(degree) = degree.filter(|r| *r <= form.sizes[i]) else {
            return fails(2, format!("part {} has no room for its chain of integrators", i + 1));
        };
        if let Err(what) = check_chain(form, i, starts[i], degree) {
            return fails(2, format!("part {}: {what}", i + 1));
        }
        let own = Matrix::from_fn(form.sizes[i], form.sizes[i], |k, l| form.a[(starts[i] + k, starts[i] + l)].clone());
        let drive = Matrix::from_fn(form.sizes[i], 1, |k, _| form.b[(starts[i] + k, i)].clone());
        if reached(&own, &drive).rows() < form.sizes[i] {
            return fails(3, format!("part {} is not controllable", i + 1));
        }
        let other_inputs = Matrix::from_fn(n, m - 1, |k, j| form.b[(k, if j < i { j } else { j + 1 })].clone());
        let space = reached(&form.a, &other_inputs);
        let unit = |k: usize| (0..n).map(|j| Rational::from(i64::from(j == k))).collect::<Vec<_>>();
        if range(m).any(|k| !(0..space.rows()).any(|row| space.row(row) == unit(k))) {
            return fails(4, format!("channel {} alone drives a motion of the shared part", i + 1));
        }
    }
    Ok(())
}

/// A basis of the states that inputs reach, one a row, with every unit vector among them: what the outputs `Bᵀ x` of
/// `ẋ = Aᵀ x` show.
fn reached(a: &Matrix<Rational>, b: &Matrix<Rational>) -> Matrix<Rational> {
    let dual = LinearSystem::state_space(a.transpose(), Matrix::zeros(a.rows(), 0), b.transpose());
    observable_quotient(&dual, &[]).projection
}

/// `A_i = [0 I 0; 0 0 0; Υ Φ]`, `b_i = [0; γ; β]`, `c_i = [1 0 … 0]`.
fn check_chain(form: &CanonicalForm, channel: usize, start: usize, degree: usize) -> Result<(), String> {
    let size = form.sizes[channel];
    for k in 0..degree {
        let expected = |l: usize| if l == k + 1 && l < degree { Rational::ONE } else { Rational::ZERO };
        if (0..size).any(|l| form.a[(start + k, start + l)] != expected(l)) {
            return Err(format!("row {} of A_i is not that of an integrator", k + 1));
        }
        if form.b[(start + k, channel)].is_zero() != (k + 1 < degree) {
            return Err(format!("entry {} of b_i has a wrong value", k + 1));
        }
    }
    let first = |l: usize| if l == 0 && degree > 0 { Rational::ONE } else { Rational::ZERO };
    if (0..size).any(|l| form.c[(channel, start + l)] != first(l)) {
        return Err("c_i is not the first unit row".to_string());
    }
    Ok(())
}
