//! The gain of a Luenberger observer by pole placement.

use super::ObserverError;
use super::distinguish::{hidden_states, observable_constants};
use super::distinguishable::in_proportion;
use crate::exact_poles::{ExactPole, at_matrix, floats, product};
use crate::notation::linear_combination;
use crate::regulator::{Chains, chains};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational};
use kardan_results::Pole;

/// The gain of an observer `x̂′ = A x̂ + B u + L (y − C x̂ − D u)` with exact entries, A and B for E = I.
#[derive(Debug, Clone, PartialEq)]
pub struct ObserverGain {
    /// L, states × sensors.
    pub gain: Matrix<Rational>,
    /// Observability index κ of each sensor, in their order: how many states its chain takes. Zero: the sensor adds no information.
    pub indices: Vec<usize>,
    /// p_i(s) of each sensor, degree κ_i; the characteristic polynomial of A − LC is their product.
    pub polynomials: Vec<Polynomial>,
    /// Combination of sensors whose error obeys p_i alone, as text; the sensor itself where it does.
    pub channels: Vec<String>,
    /// Factors of these combinations, sensors × sensors.
    pub combinations: Matrix<Rational>,
    /// Whether the error of every sensor obeys its own polynomial, whatever the others do.
    pub decoupled: bool,
    /// Poles of the error, 1/s, sensor by sensor.
    pub poles: Vec<Pole>,
    /// Notes: sensors that add no information, errors that are not decoupled. One sentence each.
    pub notes: Vec<String>,
}

/// An observer with chosen poles, exact, in which the error of every sensor obeys a polynomial of its own.
///
/// Of the rows `c₁, …, c_p, c₁A, …` those independent of the ones before are κ_i rows for sensor i (dual of Luenberger 1967).
/// In their coordinates `A − LC` is block diagonal with companion matrices of any p_i of degree κ_i: with `q_i` defined by
/// `c_j A^k q_i = 1` for the last row of chain i and 0 for all other chosen rows,
/// `L = [p₁(A)q₁, …, p_p(A)q_p] Γ⁻ᵀ`, `Γ_ij = c_j A^{κ_i−1} q_i`. If Γ is the identity (as for equal κ_i) the errors of the
/// sensors themselves are decoupled; else those of the combinations `Γ⁻ᵀ y` ([`ObserverGain::channels`]) are. In all cases the
/// characteristic polynomial of A − LC is exactly `Π p_i`.
///
/// `poles` in 1/s: either as many as the longest chain has (each sensor takes its first κ_i of them), or as many as there are
/// states (dealt out in the order of the sensors).
///
/// # Errors
/// If the system is not observable (naming what no sensor shows), the number of poles fits neither way, or the share of a
/// sensor is not self-conjugate.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::observer::luenberger;
/// // The speed of a body from its angle, poles −2 and −3: s² + 5s + 6.
/// let m = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let body = LinearSystem::state_space(m(&[&[0, 1], &[0, 0]]), m(&[&[0], &[1]]), m(&[&[1, 0]]));
/// let pole = |re: i64| (Rational::from(re), Rational::ZERO);
/// assert_eq!(luenberger(&body, &[pole(-2), pole(-3)]).unwrap().gain, m(&[&[5], &[6]]));
/// ```
pub fn luenberger(system: &LinearSystem, poles: &[ExactPole]) -> Result<ObserverGain, ObserverError> {
    let explicit = system.explicit().ok_or(ObserverError::Singular)?;
    let (n, p) = (explicit.states.len(), explicit.outputs.len());
    let found = chains(&explicit.a.transpose(), &explicit.c.transpose());
    if found.vectors.len() < n {
        return Err(not_observable(&explicit, &found));
    }
    let shares = deal(&explicit.outputs, &found.indices, poles)?;
    let polynomials = polynomials(&explicit.outputs, &shares)?;
    let active: Vec<usize> = (0..p).filter(|&i| found.indices[i] > 0).collect();
    // Columns q_i: c_j A^k q_i = 1 at the end of chain i.
    let rows = Matrix::from_fn(n, n, |i, j| found.vectors[i].2[j].clone());
    let ends = Matrix::from_fn(n, active.len(), |i, j| {
        let (sensor, power, _) = found.vectors[i];
        if sensor == active[j] && power + 1 == found.indices[sensor] { Rational::ONE } else { Rational::ZERO }
    });
    let q = rows.solve(&ends).ok_or(ObserverError::Singular)?;
    let mut coupling = Matrix::<Rational>::zeros(active.len(), active.len());
    let mut placed = Matrix::<Rational>::zeros(n, active.len());
    for (i, &sensor) in active.iter().enumerate() {
        let own = Matrix::from_fn(n, 1, |k, _| q[(k, i)].clone());
        let mut last = own.clone();
        (1..found.indices[sensor]).for_each(|_| last = explicit.a.multiply(&last));
        let shown = explicit.c.multiply(&last);
        (0..active.len()).for_each(|j| coupling[(i, j)] = shown[(active[j], 0)].clone());
        let value = at_matrix(&polynomials[sensor], &explicit.a, &own);
        (0..n).for_each(|k| placed[(k, i)] = value[(k, 0)].clone());
    }
    // Lᵀ = Γ⁻¹ [p_i(A) q_i]ᵀ, channels Γ⁻ᵀ y
    let part = coupling.solve(&placed.transpose()).ok_or(ObserverError::Singular)?;
    let free = coupling.transpose().solve(&Matrix::identity(active.len())).ok_or(ObserverError::Singular)?;
    let mut gain = Matrix::zeros(n, p);
    let mut combinations = Matrix::zeros(p, p);
    for (i, &sensor) in active.iter().enumerate() {
        (0..n).for_each(|k| gain[(k, sensor)] = part[(i, k)].clone());
        active.iter().enumerate().for_each(|(j, &other)| combinations[(sensor, other)] = free[(i, j)].clone());
    }
    let channels: Vec<String> = (0..p).map(|i| linear_combination(&explicit.outputs, combinations.row(i))).collect();
    let notes = notes(&explicit.outputs, &found.indices, &channels);
    let decoupled = coupling == Matrix::identity(active.len()) && active.len() == p;
    let poles = shares.iter().flat_map(|share| floats(share)).collect();
    Ok(ObserverGain { gain, indices: found.indices, polynomials, channels, combinations, decoupled, poles, notes })
}

/// The poles of each sensor.
fn deal<'a>(
    sensors: &[String],
    indices: &[usize],
    poles: &'a [ExactPole],
) -> Result<Vec<&'a [ExactPole]>, ObserverError> {
    debug_assert_eq!(sensors.len(), indices.len());
    let (states, longest) = (indices.iter().sum(), indices.iter().copied().max().unwrap_or(0));
    if poles.len() == longest {
        return Ok(indices.iter().map(|&k| &poles[..k]).collect());
    }
    if poles.len() != states {
        return Err(ObserverError::WrongNumber { actual: poles.len(), longest, states });
    }
    let mut rest = poles;
    let mut take = |k: usize| {
        let (share, tail) = rest.split_at(k);
        rest = tail;
        share
    };
    Ok(indices.iter().map(|&k| take(k)).collect())
}

fn polynomials(sensors: &[String], shares: &[&[ExactPole]]) -> Result<Vec<Polynomial>, ObserverError> {
    let polynomial = |(sensor, share): (&String, &&[ExactPole])| {
        product(share).map_err(|_| ObserverError::NotSelfConjugate { sensor: sensor.clone(), poles: floats(share) })
    };
    sensors.iter().zip(shares).map(polynomial).collect()
}

fn notes(sensors: &[String], indices: &[usize], channels: &[String]) -> Vec<String> {
    let mut out = Vec::new();
    for ((sensor, index), channel) in sensors.iter().zip(indices).zip(channels) {
        if *index == 0 {
            out.push(format!("{sensor} adds no information to the sensors before it; its gain is zero."));
        } else if channel != sensor {
            out.push(format!(
                "The error of {sensor} is not decoupled from the others, as its chain is shorter ({index} states); that of \
                 {channel} is."
            ));
        }
    }
    out
}

fn not_observable(explicit: &LinearSystem, found: &Chains) -> ObserverError {
    let hidden = hidden_states(found, explicit.states.len());
    ObserverError::NotObservable {
        sensors: explicit.outputs.clone(),
        rank: found.vectors.len(),
        states: explicit.states.len(),
        hidden: hidden.iter().map(|v| in_proportion(&explicit.states, v)).collect(),
        observable: observable_constants(explicit, &hidden),
    }
}
