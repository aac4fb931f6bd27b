//! Which disturbances the sensors distinguish.

use super::distinguishable::{in_proportion, sentences};
use super::{Distinguishable, ObserverError, extend};
use crate::decoupling::null_rows;
use crate::notation::linear_combination;
use crate::regulator::{Chains, chains};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational, Scalar, reduced_form};

/// Largest number of sets that are tried as [`Distinguishable::resolving`].
pub const MOST_SETS: usize = 1000;

/// Which of the unknown constant torques `W d` of `E ẋ = A x + B u + W d`, `y = C x + D u` the sensors y can distinguish, exact.
///
/// Torques d show in no sensor if and only if, with some state x, (x, d) is in the null space of the observability matrix of
/// the extended system ([`extend`]); what vanishes on all of them can be estimated. `disturbance`: W, states × torques. For a
/// harmonic drive with two encoders these are (6.42) of the source, and by (6.43) measuring one torque gives the
/// others. Method: elimination over the rationals, O(n³).
///
/// # Errors
/// [`ObserverError::Singular`] if E is singular.
///
/// # Panics
/// If W has not one row per state and one column per name.
pub fn distinguishable(
    system: &LinearSystem,
    disturbance: &Matrix<Rational>,
    names: &[String],
) -> Result<Distinguishable, ObserverError> {
    let n = system.states.len();
    let extended = extend(system, disturbance, names).explicit().ok_or(ObserverError::Singular)?;
    let found = chains(&extended.a.transpose(), &extended.c.transpose());
    let all = hidden_states(&found, extended.states.len());
    let columns: Vec<usize> = (n..n + names.len()).collect();
    let hidden = independent(&all, &columns);
    let combinations = null_rows(&hidden);
    let unit = |row: &[Rational]| {
        let mut entries = (0..row.len()).filter(|&j| !row[j].is_zero());
        entries.next().filter(|_| entries.next().is_none())
    };
    let plain = system.explicit().ok_or(ObserverError::Singular)?;
    let motions = hidden_states(&chains(&plain.a.transpose(), &plain.c.transpose()), n);
    let mut out = Distinguishable {
        sensors: system.outputs.clone(),
        disturbances: names.to_vec(),
        rank: found.vectors.len(),
        states: extended.states.len(),
        independent: combinations.rows(),
        individual: (0..combinations.rows()).filter_map(|i| unit(combinations.row(i))).collect(),
        resolving: resolving(&hidden),
        hidden_motions: motions.iter().map(|v| in_proportion(&system.states, v)).collect(),
        combinations,
        hidden,
        sentences: Vec::new(),
    };
    out.sentences = sentences(&out);
    Ok(out)
}

/// A basis of the states that show in no sensor; the first entry of each that is not zero is one.
pub(super) fn hidden_states(found: &Chains, n: usize) -> Vec<Vec<Rational>> {
    let rows = Matrix::from_fn(found.vectors.len(), n, |i, j| found.vectors[i].2[j].clone());
    let null = null_rows(&rows);
    (0..null.rows()).map(|i| null.row(i).to_vec()).collect()
}

/// Independent rows, in reduced echelon form, that span these vectors restricted to some columns.
fn independent(vectors: &[Vec<Rational>], columns: &[usize]) -> Matrix<Rational> {
    let rows = Matrix::from_fn(vectors.len(), columns.len(), |i, j| vectors[i][columns[j]].clone());
    let e = reduced_form(&rows);
    Matrix::from_fn(e.rank(), columns.len(), |i, j| e.form[(i, j)].clone())
}

/// Sets of as many columns as there are rows with a regular minor.
fn resolving(hidden: &Matrix<Rational>) -> Vec<Vec<usize>> {
    let (k, n) = (hidden.rows(), hidden.columns());
    let mut out = Vec::new();
    let mut set: Vec<usize> = (0..k).collect();
    for _ in 0..MOST_SETS {
        if k == 0 || k > n {
            break;
        }
        let minor = Matrix::from_fn(k, k, |i, j| hidden[(i, set[j])].clone());
        if reduced_form(&minor).rank() == k {
            out.push(set.clone());
        }
        // The next set in lexicographic order.
        let Some(at) = (0..k).rev().find(|&i| set[i] + k - i < n) else { break };
        set[at] += 1;
        (at + 1..k).for_each(|i| set[i] = set[i - 1] + 1);
    }
    out
}

/// Combinations of the constant states (rows of A and B are zero) that vanish on all hidden ones, as text; empty if none of
/// them is hidden.
pub(super) fn observable_constants(explicit: &LinearSystem, hidden: &[Vec<Rational>]) -> Vec<String> {
    let zero = |m: &Matrix<Rational>, i: usize| m.row(i).iter().all(Scalar::is_zero);
    let constants: Vec<usize> =
        (0..explicit.states.len()).filter(|&i| zero(&explicit.a, i) && zero(&explicit.b, i)).collect();
    let unobservable = independent(hidden, &constants);
    if unobservable.rows() == 0 {
        return Vec::new();
    }
    let names: Vec<&String> = constants.iter().map(|&i| &explicit.states[i]).collect();
    let observable = null_rows(&unobservable);
    (0..observable.rows()).map(|i| linear_combination(&names, observable.row(i))).collect()
}
