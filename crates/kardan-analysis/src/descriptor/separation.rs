//! The finite and the infinite part of a regular pencil.

use super::singular::SingularPencil;
use crate::parts::{
    bits_of, column_basis, kernel, left_kernel, pencil_at, reduced_form, side_by_side, stacked, window,
};
use crate::system::LinearSystem;
use kardan_math::num::{Matrix, Rational, exact_rank};

/// Bits of all numbers times bits of a mean row, of the given pencil: above this limit not even one inverse is computed.
const MAX_PENCIL_BITS: usize = 20_000_000_000;
/// Bits of all numbers of `(s₀E − A)⁻¹E` times its order.
const MOST_WORK: usize = 50_000_000;

/// Why a descriptor system is not separated.
#[derive(Debug, Clone, PartialEq)]
pub enum DescriptorError {
    /// det(sE − A) is zero for all s.
    Singular(SingularPencil),
    /// More than [`MOST_VARIABLES`](super::MOST_VARIABLES) variables.
    TooLarge,
    /// Full matrices of long fractions, such as numbers of floating point: exact elimination would take too long.
    TooLong,
}

/// `S E T = diag(I, N)`, `S A T = diag(J, I)` with a nilpotent N.
#[derive(Debug)]
pub(super) struct Separation {
    /// S.
    pub left: Matrix<Rational>,
    /// T.
    pub right: Matrix<Rational>,
    /// The first rows of T⁻¹: `z = L x`.
    pub reading: Matrix<Rational>,
    /// J, B₁, C₁.
    pub slow: [Matrix<Rational>; 3],
    /// N, B₂, C₂.
    pub fast: [Matrix<Rational>; 3],
    /// Orders of the blocks of N, largest first.
    pub blocks: Vec<usize>,
    /// `D − C₂ B₂`, `−C₂ N B₂`, `−C₂ N² B₂`, …: one for each power of s below the index, at least the first.
    pub polynomial: Vec<Matrix<Rational>>,
}

impl Separation {
    /// # Errors
    /// If the pencil is singular, or the fractions are too long.
    pub fn of(system: &LinearSystem) -> Result<Self, DescriptorError> {
        let (e, a) = (&system.e, &system.a);
        let singular = || DescriptorError::Singular(SingularPencil::of(e, a));
        let width = bits(&[e, a]).checked_div(e.rows()).unwrap_or(0);
        if width.saturating_mul(bits(&[e, a])) > MAX_PENCIL_BITS {
            return Err(DescriptorError::TooLong);
        }
        let at = regular_point(e, a).ok_or_else(singular)?;
        let m = pencil_at(e, a, &at).solve(e).ok_or_else(singular)?;
        if bits(&[&m]).saturating_mul(e.rows()) > MOST_WORK {
            return Err(DescriptorError::TooLong);
        }
        Self::by_powers(system, &m).ok_or_else(singular)
    }

    /// By the kernels and images of the powers of `M = (s₀E − A)⁻¹E`.
    fn by_powers(system: &LinearSystem, m: &Matrix<Rational>) -> Option<Self> {
        let n = system.states.len();
        let (e, a) = (&system.e, &system.a);
        let kernels = kernels(m);
        let fast_basis = kernels.last().cloned().unwrap_or_else(|| Matrix::zeros(n, 0));
        let reading = left_kernel(&fast_basis);
        let image = kernels.iter().fold(Matrix::identity(n), |basis, _| column_basis(&m.multiply(&basis)));
        // L V = I.
        let slow_basis = image.multiply(&reading.multiply(&image).solve(&Matrix::identity(image.columns()))?);
        let finite = slow_basis.columns();
        let right = side_by_side(&[&slow_basis, &fast_basis]);
        let left = side_by_side(&[&e.multiply(&slow_basis), &a.multiply(&fast_basis)]).solve(&Matrix::identity(n))?;
        let on = |matrix: &Matrix<Rational>, basis: &Matrix<Rational>| left.multiply(&matrix.multiply(basis));
        let part = |matrix: &Matrix<Rational>, from: usize, to: usize| window(matrix, from..to, 0..matrix.columns());
        let inputs = left.multiply(&system.b);
        let slow = [part(&on(a, &slow_basis), 0, finite), part(&inputs, 0, finite), system.c.multiply(&slow_basis)];
        let fast = [part(&on(e, &fast_basis), finite, n), part(&inputs, finite, n), system.c.multiply(&fast_basis)];
        let dimensions: Vec<usize> = kernels.iter().map(Matrix::columns).collect();
        let polynomial = polynomial(&fast, &system.d, dimensions.len());
        Some(Self { left, right, reading, slow, fast, blocks: blocks(&dimensions), polynomial })
    }

    /// The order of the largest block at infinity.
    pub fn index(&self) -> usize {
        self.blocks.first().copied().unwrap_or(0)
    }
}

/// Bits of all numbers.
fn bits(matrices: &[&Matrix<Rational>]) -> usize {
    let all = matrices.iter().flat_map(|matrix| matrix.as_slice()).filter(|x| !x.is_zero());
    all.map(bits_of).sum()
}

/// A number s₀ with a regular `s₀E − A`: of n + 1 numbers one is, unless all are roots of the determinant, which is zero then.
fn regular_point(e: &Matrix<Rational>, a: &Matrix<Rational>) -> Option<Rational> {
    let n = e.rows();
    let number = |k: usize| Rational::from(if k.is_multiple_of(2) { (k / 2) as i64 } else { -(k.div_ceil(2) as i64) });
    (0..=n).map(number).find(|at| exact_rank(&pencil_at(e, a, at)) == n)
}

/// The kernels of M, M², … as long as they grow.
fn kernels(m: &Matrix<Rational>) -> Vec<Matrix<Rational>> {
    let mut all: Vec<Matrix<Rational>> = Vec::new();
    let mut next = kernel(m);
    while next.columns() > all.last().map_or(0, Matrix::columns) {
        let deeper = kernel(&left_kernel(&next).multiply(m));
        all.push(next);
        next = deeper;
    }
    all
}

/// Orders of the nilpotent blocks, largest first, from the dimensions of the kernels of the powers.
fn blocks(dimensions: &[usize]) -> Vec<usize> {
    let at_least = |order: usize| dimensions[order - 1] - if order > 1 { dimensions[order - 2] } else { 0 };
    let count = dimensions.first().copied().unwrap_or(0);
    (0..count).map(|block| (1..=dimensions.len()).filter(|&order| at_least(order) > block).count()).collect()
}

fn polynomial([nilpotent, b, c]: &[Matrix<Rational>; 3], d: &Matrix<Rational>, index: usize) -> Vec<Matrix<Rational>> {
    let mut reached = b.clone();
    let mut all = Vec::new();
    for power in 0..index.max(1) {
        let term = c.multiply(&reached).scale(&Rational::NEG_ONE);
        all.push(if power == 0 { d.plus(&term) } else { term });
        reached = nilpotent.multiply(&reached);
    }
    all
}

/// With regular P and Q such that `P E Q = diag(I, 0)`: the rank of E, and the state space whose further inputs are the variables
/// that E leaves out and whose further outputs are the equations without derivatives.
pub(super) fn split_by_e(system: &LinearSystem) -> (usize, LinearSystem) {
    let n = system.states.len();
    let form = reduced_form(&system.e);
    let rank = form.rank();
    let kernel = form.kernel();
    let q = Matrix::from_fn(n, n, |i, j| match j < rank {
        true if form.pivots[j] == i => Rational::ONE,
        true => Rational::ZERO,
        false => kernel[(i, j - rank)].clone(),
    });
    let a = form.transform.multiply(&system.a).multiply(&q);
    let b = form.transform.multiply(&system.b);
    let c = system.c.multiply(&q);
    let p = system.outputs.len();
    let of_a = window(&a, 0..rank, 0..rank);
    // Of all equations over the variables that E leaves out and the inputs.
    let inputs = side_by_side(&[&window(&a, 0..n, rank..n), &b]);
    let of_b = window(&inputs, 0..rank, 0..inputs.columns());
    let of_c = stacked(&[&window(&a, rank..n, 0..rank), &window(&c, 0..p, 0..rank)]);
    let through = side_by_side(&[&window(&c, 0..p, rank..n), &system.d]);
    let of_d = stacked(&[&window(&inputs, rank..n, 0..inputs.columns()), &through]);
    (rank, LinearSystem { d: of_d, ..LinearSystem::state_space(of_a, of_b, of_c) })
}
