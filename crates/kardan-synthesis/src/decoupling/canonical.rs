//! The canonical form of a decoupled system.

use super::annihilator::annihilator;
use super::relative_degree::{chain, relative_degrees};
use super::rows::{RowSpan, primitive, row_times, stack, unit, unit_place};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational};

/// A canonically decoupled system and the way to it, \[diss. (6.73)-(6.83)\].
#[derive(Debug, Clone, PartialEq)]
pub struct CanonicalForm {
    /// p_1 … p_m: states of each channel; p_{m+1}: states that several channels drive; p_{m+2}: states that none drives.
    pub sizes: Vec<usize>,
    /// Rank of L_i, the controllability matrix of all inputs but the i-th (6.82).
    pub ranks: Vec<usize>,
    /// Q (6.79): `x_cd = Q x`.
    pub q: Matrix<Rational>,
    /// Q⁻¹.
    pub q_inverse: Matrix<Rational>,
    /// Q A Q⁻¹ (6.73).
    pub a: Matrix<Rational>,
    /// Q B (6.74).
    pub b: Matrix<Rational>,
    /// C Q⁻¹ (6.75).
    pub c: Matrix<Rational>,
    /// D: one on the diagonal for outputs of degree 0, else zero.
    pub d: Matrix<Rational>,
}

/// A system whose transfer matrix is not diagonal with entries `γ_i/s^r_i`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{output}` is not a chain of integrators with its own input; the system is not integrator decoupled")]
pub struct NotIntegratorDecoupled {
    /// Name of the first output that does not fit.
    pub output: String,
}

/// The canonically decoupled form `(Q A Q⁻¹, Q B, C Q⁻¹)` of an integrator-decoupled system
/// \[diss. (6.79)-(6.83), (6.80) with the right exponent\].
///
/// Q_i begins with `C_i, C_i A, …, C_i A^(r_i−1)` and is completed to a basis of `M_i = {η : η Aʲ B_k = 0, k ≠ i}`, the
/// left null space of L_i, by unit rows where it has any; `p_i = n − rank L_i − p_{m+2}`. Q_{m+1} completes the rows of
/// all channels by unit rows. The first transformation of the source, which sets the p_{m+2} modes apart that no input
/// reaches, is part of Q: its last rows are a basis of `{η : η Aʲ B = 0}`, which lies in every M_i.
///
/// An output of degree 0 is its input (its rows of C are zero); its M_i is then a block without a chain of integrators.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::decoupling::{canonical_form, integrator_decoupled};
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let a = matrix(&[&[-1, 2, 0], &[0, -3, 0], &[3, 0, -5]]);
/// let system = LinearSystem::state_space(a, matrix(&[&[1, 0], &[0, 1], &[1, 1]]), matrix(&[&[1, 0, 0], &[0, 1, 0]]));
/// let form = canonical_form(&integrator_decoupled(&system).unwrap()).unwrap();
/// // The third state is driven by both channels and seen by no output.
/// assert_eq!(form.sizes, [1, 1, 1, 0]);
/// ```
///
/// # Errors
/// [`NotIntegratorDecoupled`]; [`integrator_decoupled`](super::integrator_decoupled) makes a system so.
///
/// # Panics
/// If E is not the identity.
pub fn canonical_form(system: &LinearSystem) -> Result<CanonicalForm, NotIntegratorDecoupled> {
    let (n, m) = (system.states.len(), system.outputs.len());
    let degrees = relative_degrees(system);
    let mut unreached = RowSpan::default();
    let last = readable(&annihilator(&system.a, &system.b));
    last.iter().for_each(|row| assert!(unreached.insert(row).is_some(), "rows of a basis are independent"));
    let mut rows: Vec<Vec<Rational>> = Vec::with_capacity(n);
    let (mut sizes, mut ranks) = (Vec::new(), Vec::new());
    let mut all = unreached.clone();
    for i in 0..m {
        let wrong = || NotIntegratorDecoupled { output: system.outputs[i].clone() };
        let only_own = (0..system.inputs.len()).all(|j| degrees.matrix[(i, j)].is_zero() == (i != j));
        let Some(degree) = degrees.degrees[i].filter(|_| only_own && system.inputs.len() == m) else {
            return Err(wrong());
        };
        if !unreached.contains(degrees.free.row(i)) {
            return Err(wrong());
        }
        let other_inputs = Matrix::from_fn(n, m - 1, |k, j| system.b[(k, if j < i { j } else { j + 1 })].clone());
        let own = annihilator(&system.a, &other_inputs);
        ranks.push(n - own.rows());
        let mut span = unreached.clone();
        let mut candidates = chain(system, i, degree);
        candidates.extend(readable(&own));
        candidates.retain(|row| span.insert(row).is_some());
        candidates.iter().for_each(|row| assert!(all.insert(row).is_some(), "the spaces M_i are disjoint"));
        sizes.push(candidates.len());
        rows.extend(candidates);
    }
    let shared: Vec<Vec<Rational>> = (0..n).map(|k| unit(k, n)).filter(|row| all.insert(row).is_some()).collect();
    sizes.extend([shared.len(), last.len()]);
    rows.extend(shared);
    rows.extend(last);
    let q = stack(&rows, n);
    let q_inverse = q.solve(&Matrix::identity(n)).expect("the rows of Q are independent");
    Ok(CanonicalForm {
        sizes,
        ranks,
        a: q.multiply(&system.a).multiply(&q_inverse),
        b: q.multiply(&system.b),
        c: stack(&(0..m).map(|i| row_times(system.c.row(i), &q_inverse)).collect::<Vec<_>>(), n),
        d: system.d.clone(),
        q,
        q_inverse,
    })
}

/// The rows of a basis in whole numbers, unit rows first.
fn readable(basis: &Matrix<Rational>) -> Vec<Vec<Rational>> {
    let mut rows: Vec<Vec<Rational>> = (0..basis.rows()).map(|i| primitive(basis.row(i))).collect();
    rows.sort_by_key(|row| unit_place(row).is_none());
    rows
}
