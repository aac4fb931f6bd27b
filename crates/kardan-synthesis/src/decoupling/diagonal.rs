//! Which entries of a transfer matrix couple channels.

use super::relative_degree::assert_explicit;
use super::rows::{RowSpan, row_times};
use kardan_analysis::LinearSystem;

/// The entries off the diagonal of the transfer matrix that are not identically zero, as (output, input); empty: the system
/// is decoupled, proven.
///
/// Method: entry (i, j) vanishes if `D_ij = 0` and `η B_j = 0` for a basis η of the rows `C_i, C_i A, C_i A², …`. For a
/// decoupled loop these are r_i rows only, and an entry that does not vanish shows early; cost at most outputs · n³.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::decoupling::coupled_entries;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let identity = Matrix::identity(2);
/// let system = LinearSystem::state_space(matrix(&[&[-1, 0], &[5, -2]]), identity.clone(), identity);
/// assert_eq!(coupled_entries(&system), [(1, 0)]);
/// ```
///
/// # Panics
/// If E is not the identity.
pub fn coupled_entries(system: &LinearSystem) -> Vec<(usize, usize)> {
    assert_explicit(system);
    let inputs = system.inputs.len();
    let mut out = Vec::new();
    for i in 0..system.outputs.len() {
        let mut open: Vec<usize> = (0..inputs).filter(|&j| j != i && system.d[(i, j)].is_zero()).collect();
        let mut span = RowSpan::default();
        let mut row = system.c.row(i).to_vec();
        while !open.is_empty() {
            let Some(new) = span.insert(&row) else { break };
            let reached = row_times(new, &system.b);
            open.retain(|&j| reached[j].is_zero());
            row = row_times(new, &system.a);
        }
        out.extend((0..inputs).filter(|j| *j != i && !open.contains(j)).map(|j| (i, j)));
    }
    out
}
