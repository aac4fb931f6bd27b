//! The matrix of the zero dynamics.

use super::decouplable::{NotDecouplable, inverse_decoupling_matrix};
use super::relative_degree::{chain, relative_degrees};
use super::rows::stack;
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational, characteristic_polynomial, reduced_form};

/// The dynamics that remain while all outputs are zero (zero dynamics).
#[derive(Debug, Clone, PartialEq)]
pub struct ZeroDynamicsMatrix {
    /// V, states × k: a basis of the states from which the inputs can keep the outputs at zero.
    pub basis: Matrix<Rational>,
    /// Z, k × k: `x = V ξ`, `ξ̇ = Z ξ`.
    pub matrix: Matrix<Rational>,
    /// `det(sI − Z)`: the invariant zeros of a square system, with those that inputs or outputs do not see.
    pub polynomial: Polynomial,
}

/// The zero dynamics `ξ̇ = Z ξ` of a system with decoupling matrix of full row rank \[diss. (6.93), (6.136)\].
///
/// V spans the common kernel of `C_i Aʲ`, j < r_i, the largest controlled invariant subspace in ker C, of dimension
/// n − Σ r_i; Z is A − BG⁻¹A* on it. With more inputs than outputs it depends on the right inverse G⁺ that is taken; for
/// square systems det(sI − Z) is, up to a factor, the determinant of the system matrix `[sI − A, −B; C, D]`.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::decoupling::zero_dynamics;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // (s + 3)/(s² + 2 s + 1)
/// let system = LinearSystem::state_space(matrix(&[&[0, 1], &[-1, -2]]), matrix(&[&[0], &[1]]), matrix(&[&[3, 1]]));
/// assert_eq!(zero_dynamics(&system).unwrap().polynomial.to_string(), "s + 3");
/// ```
///
/// # Errors
/// [`NotDecouplable`] if the decoupling matrix has dependent rows.
///
/// # Panics
/// If E is not the identity.
pub fn zero_dynamics(system: &LinearSystem) -> Result<ZeroDynamicsMatrix, NotDecouplable> {
    let degrees = relative_degrees(system);
    let inverse = inverse_decoupling_matrix(system, &degrees)?;
    let n = system.states.len();
    let lengths = degrees.degrees.iter().map(|degree| degree.unwrap_or(0)).enumerate();
    let rows: Vec<Vec<Rational>> = lengths.flat_map(|(i, length)| chain(system, i, length)).collect();
    // The rows of all chains are independent: with as many as states there is no remainder.
    let (basis, free) = if rows.len() == n {
        (Matrix::zeros(n, 0), Vec::new())
    } else {
        let e = reduced_form(&stack(&rows, n));
        (e.kernel(), e.free())
    };
    let feedback = inverse.multiply(&degrees.free);
    // (A − B F) V
    let image = system.a.multiply(&basis).minus(&system.b.multiply(&feedback.multiply(&basis)));
    let matrix = Matrix::from_fn(free.len(), free.len(), |i, j| image[(free[i], j)].clone());
    let polynomial = characteristic_polynomial(&matrix);
    Ok(ZeroDynamicsMatrix { basis, matrix, polynomial })
}
