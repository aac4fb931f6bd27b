//! Static feedback that decouples blocks of outputs.

use super::PolynomialMatrix;
use super::silverman::{StructureAlgorithm, structure_of_rows};
use crate::decoupling::add;
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational, characteristic_polynomial, reduced_form};

/// Static feedback `u = −K x + L r` after which every block of outputs responds to its own references only.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockDecoupling {
    /// Numbers of the outputs of each block.
    pub blocks: Vec<Vec<usize>>,
    /// K, inputs × states.
    pub k: Matrix<Rational>,
    /// L, inputs × outputs; references are numbered as the outputs.
    pub l: Matrix<Rational>,
    /// How often the row of each output was differentiated within its block: the degree of its polynomial.
    pub orders: Vec<usize>,
    /// M(s) of each block: `M(s) y_B = N r_B` in closed loop.
    pub operators: Vec<PolynomialMatrix>,
    /// N of each block: M(0), so that y = r at rest, or the identity where M(0) is singular.
    pub reference_gains: Vec<Matrix<Rational>>,
    /// Characteristic polynomial of what the outputs do not show, which no decoupling law can move (unless there are more
    /// inputs than outputs): the characteristic polynomial of A − BK is this times the polynomials of all outputs.
    pub hidden: Polynomial,
}

/// Why blocks cannot be decoupled.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BlockError {
    /// Every output must be in exactly one block.
    #[error("output number {output} is not in exactly one block")]
    NotAPartition {
        /// The output.
        output: usize,
    },
    /// The rows of D̄ of the blocks depend on each other.
    #[error("regular static state feedback cannot decouple these blocks: rank {rank} of {outputs}")]
    NotDecouplable {
        /// Rank of the rows of D̄ together.
        rank: usize,
        /// Number of outputs.
        outputs: usize,
    },
    /// The required polynomial is not monic of the order of its output.
    #[error("the polynomial of output number {output} must be monic of degree {order}")]
    Polynomial {
        /// The output.
        output: usize,
        /// Its order.
        order: usize,
    },
}

/// Decouples blocks of outputs by static state feedback and gives each its dynamics.
///
/// Method: the [structure algorithm](super::structure_algorithm) of a block on its own ends in `P(s) y_B = C̄ x + D̄ u = w_B`.
/// On the way it meets rows `ζ_ik = (operator) y_B = (row) x`, k = 0 … order of i − 1, which are functions of the state and
/// make the block a set of chains of integrators from w_B to y_B, coupled from earlier to later chains only. The feedback
/// `w_i = −Σ_k a_ik ζ_ik + v_i` gives chain i the polynomial `a_i(s) = sᵏ + … + a_i0`, and `M(s) y_B = v_B` with the rows
/// `P_i + Σ_k a_ik (operator of ζ_ik)`, det M = ± Π a_i. With `v_B = M(0) r_B` outputs and references agree at rest. All
/// blocks together determine u where their rows D̄ are independent (Dion 1983); with more inputs than outputs
/// the inputs that are not needed stay zero.
///
/// `dynamics(output, order)` gives the monic polynomial a_i of degree `order`. `system` has E = I.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Polynomial, Rational};
/// use kardan_synthesis::inversion::decouple_blocks;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // Two bodies of 1 kg m², a spring of 3 N m/rad between them.
/// let system = LinearSystem::state_space(
///     matrix(&[&[0, 0, 1, 0], &[0, 0, 0, 1], &[-3, 3, 0, 0], &[3, -3, 0, 0]]),
///     matrix(&[&[0, 0], &[0, 0], &[1, 0], &[0, 1]]),
///     matrix(&[&[1, 0, 0, 0], &[0, 1, 0, 0]]),
/// );
/// let s_plus_2_squared = |_, _| Polynomial::new([4, 4, 1].map(Rational::from).to_vec());
/// let law = decouple_blocks(&system, &[vec![0], vec![1]], &s_plus_2_squared).unwrap();
/// assert_eq!(law.k, matrix(&[&[1, 3, 4, 0], &[3, 1, 0, 4]]));
/// assert_eq!(law.l, matrix(&[&[4, 0], &[0, 4]]));
/// ```
///
/// # Errors
/// See [`BlockError`].
pub fn decouple_blocks(
    system: &LinearSystem,
    blocks: &[Vec<usize>],
    dynamics: &dyn Fn(usize, usize) -> Polynomial,
) -> Result<BlockDecoupling, BlockError> {
    let (n, m, p) = (system.a.rows(), system.c.rows(), system.b.columns());
    check_partition(blocks, m)?;
    let found: Vec<StructureAlgorithm> = blocks.iter().map(|block| structure_of_rows(system, block)).collect();
    let mut on_inputs = Matrix::<Rational>::zeros(m, p);
    for (block, found) in blocks.iter().zip(&found) {
        for (i, &output) in block.iter().enumerate() {
            on_inputs.row_mut(output).clone_from_slice(found.d.row(i));
        }
    }
    let solved = reduced_form(&on_inputs);
    if solved.rank() < m {
        return Err(BlockError::NotDecouplable { rank: solved.rank(), outputs: m });
    }
    // u_pivots = transform · w solves D̄ u = w with the other inputs zero.
    let mut inverse = Matrix::<Rational>::zeros(p, m);
    for (row, &pivot) in solved.pivots.iter().enumerate() {
        inverse.row_mut(pivot).clone_from_slice(solved.transform.row(row));
    }
    let mut state_rows = Matrix::<Rational>::zeros(m, n);
    let mut reference_rows = Matrix::<Rational>::zeros(m, m);
    let mut orders = vec![0; m];
    let (mut operators, mut reference_gains) = (Vec::new(), Vec::new());
    let mut assigned = Polynomial::constant(Rational::ONE);
    for (block, found) in blocks.iter().zip(&found) {
        let mut rows = Vec::new();
        for (i, &output) in block.iter().enumerate() {
            let order = found.orders[i].unwrap_or_default();
            orders[output] = order;
            let desired = dynamics(output, order);
            let monic = desired.coefficients().len() == order + 1 && desired.coefficients()[order] == Rational::ONE;
            if !monic {
                return Err(BlockError::Polynomial { output, order });
            }
            let mut operator = found.operator.row(i).to_vec();
            let target = state_rows.row_mut(output);
            target.clone_from_slice(found.c.row(i));
            for (determined, factor) in found.chain(i).zip(desired.coefficients()) {
                add(target, factor, &determined.row);
                for (p, q) in operator.iter_mut().zip(&determined.operator) {
                    *p = p.plus(&q.scale(factor));
                }
            }
            rows.push(operator);
            assigned = assigned.times(&desired);
        }
        let operator = PolynomialMatrix::from_rows(rows, block.len());
        let at_rest = operator.evaluate(&Rational::ZERO);
        let size = block.len();
        let regular = reduced_form(&at_rest).rank() == size;
        let gain = if regular { at_rest } else { Matrix::identity(size) };
        for (i, &row) in block.iter().enumerate() {
            for (j, &column) in block.iter().enumerate() {
                reference_rows[(row, column)] = gain[(i, j)].clone();
            }
        }
        operators.push(operator);
        reference_gains.push(gain);
    }
    let k = inverse.multiply(&state_rows);
    let closed = system.a.minus(&system.b.multiply(&k));
    Ok(BlockDecoupling {
        blocks: blocks.to_vec(),
        l: inverse.multiply(&reference_rows),
        orders,
        operators,
        reference_gains,
        hidden: characteristic_polynomial(&closed).divide(&assigned).0,
        k,
    })
}

fn check_partition(blocks: &[Vec<usize>], outputs: usize) -> Result<(), BlockError> {
    let mut uses = vec![0; outputs];
    for &output in blocks.iter().flatten() {
        *uses.get_mut(output).ok_or(BlockError::NotAPartition { output })? += 1;
    }
    match uses.iter().position(|&count| count != 1) {
        Some(output) => Err(BlockError::NotAPartition { output }),
        None => Ok(()),
    }
}
