//! Placement of motors and sensors.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::family::to_mat;
use super::images::{Image, Images};
use super::parity::{choices, subsets};
use super::{Gramian, LinearSystem, Side, gramian, smallest_eigenvalue, transfer_energy};
use kardan_math::num::{Matrix, ModularMatrix, Rational, rational_to_f64, reachable};
use kardan_results::{Place, PlacedSet, PlacementSearch};

/// A place where a motor may sit (or, for the dual system, a sensor).
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its name.
    pub name: String,
    /// Its cost.
    pub cost: f64,
    /// Its column of B in `E ẋ = A x + B u`; for a sensor, its row of C.
    pub column: Vec<Rational>,
}

/// The measure that ranks the sets.
#[derive(Debug, Clone, PartialEq)]
pub enum Measure {
    /// The smallest eigenvalue of the Gramian over the horizon, states scaled by these factors; larger is better.
    SmallestEigenvalue(Vec<f64>),
    /// The energy ∫uᵀu dt that takes the state from rest to this one within the horizon; smaller is better.
    Energy(Vec<f64>),
}

/// Most sets that are tried one by one.
const MOST_SETS: usize = 20_000;

/// Most sets that are listed.
const MOST_LISTED: usize = 50;

/// All smallest sets of candidates that make `E ẋ = A x` controllable (observable), ranked by a measure, then by cost.
///
/// Whether a set is enough is decided modulo random primes, two where the first one rejects it (a set that is listed is proven
/// to be enough). From the least
/// number upwards all sets of one size are tried; if these are more than 20 000, candidates are added one by one, each the
/// one that reaches most, and superfluous ones taken out again: then `gap` compares its cost with that of the cheapest
/// `least` candidates, which no set can undercut. The Gramian of a set is the sum of those of its members.
///
/// `least` is the least number of inputs of the system. The fields `unit`, `none_because` are left to the caller, who knows
/// the shafts. `None` if E is singular.
///
/// # Panics
/// If a column has not one entry per state.
pub fn place(
    system: &LinearSystem,
    side: Side,
    candidates: &[Candidate],
    least: usize,
    horizon: f64,
    measure: &Measure,
) -> Option<PlacementSearch> {
    let n = system.states.len();
    let all = with_candidates(system, side, candidates);
    let mut images = Images::unforeseen(&all);
    let both = [images.get(0)?, images.get(1)?];
    let rank = |set: &[usize]| {
        let modulo = |image: &Image| {
            let columns = ModularMatrix::from_fn(n, set.len(), |i, j| image.b.row(i)[set[j]]);
            reachable(&image.field, &image.g, &columns).span.dimension()
        };
        let first = modulo(&both[0]);
        if first == n { n } else { first.max(modulo(&both[1])) }
    };
    let everything: Vec<usize> = (0..candidates.len()).collect();
    let mut out = PlacementSearch {
        candidates: candidates.iter().map(|c| Place { place: c.name.clone(), cost: c.cost }).collect(),
        larger_is_better: matches!(measure, Measure::SmallestEigenvalue(_)),
        measure: match measure {
            Measure::SmallestEigenvalue(_) => format!("smallest eigenvalue of the Gramian over {horizon} s"),
            Measure::Energy(_) => format!("energy to reach the motion within {horizon} s"),
        },
        exhaustive: true,
        tried: 1,
        ..PlacementSearch::default()
    };
    if rank(&everything) < n {
        out.method = "all candidates together are not enough".into();
        return Some(out);
    }
    let found = smallest_sets(&everything, n, least, &rank, &mut out);
    let gramians = gramians(system, side, candidates, horizon);
    let score = |set: &[usize]| -> f64 {
        let Some(parts) = gramians.as_ref() else { return f64::NAN };
        let parts: Vec<&Gramian> = set.iter().map(|&k| &parts[k]).collect();
        let Some(sum) = Gramian::sum(&parts) else { return f64::NAN };
        match measure {
            Measure::SmallestEigenvalue(scaling) => smallest_eigenvalue(&sum, scaling).unwrap_or(f64::NAN),
            Measure::Energy(target) => transfer_energy(&sum, target),
        }
    };
    let cost = |set: &[usize]| set.iter().map(|&k| candidates[k].cost).sum::<f64>();
    out.sets = found
        .iter()
        .map(|set| PlacedSet {
            places: set.iter().map(|&k| candidates[k].name.clone()).collect(),
            cost: cost(set),
            score: score(set),
            efficient: false,
        })
        .collect();
    let sign = if out.larger_is_better { -1.0 } else { 1.0 };
    out.sets.sort_by(|a, b| (sign * a.score).total_cmp(&(sign * b.score)).then(a.cost.total_cmp(&b.cost)));
    mark_efficient(&mut out.sets);
    if !out.exhaustive {
        let mut costs: Vec<f64> = candidates.iter().map(|candidate| candidate.cost).collect();
        costs.sort_by(f64::total_cmp);
        let bound: f64 = costs.iter().take(least).sum();
        let reached = cost(&found[0]);
        out.gap = if reached > 0.0 { (reached - bound) / reached } else { 0.0 };
        out.method = format!(
            "bounded search: candidates added one by one ({} sets of {} places would be too many)",
            found[0].len(),
            candidates.len()
        );
    }
    out.sets.truncate(MOST_LISTED);
    Some(out)
}

/// All smallest sets of that rank; one that is small where there are too many to try.
fn smallest_sets(
    places: &[usize],
    n: usize,
    least: usize,
    rank: &impl Fn(&[usize]) -> usize,
    out: &mut PlacementSearch,
) -> Vec<Vec<usize>> {
    for size in least.max(1)..=places.len() {
        let Some(count) = choices(places.len(), size).filter(|count| *count <= MOST_SETS) else {
            out.exhaustive = false;
            return vec![greedy(places, n, rank, &mut out.tried)];
        };
        out.tried += count;
        let found: Vec<Vec<usize>> = subsets(places.len(), size).filter(|set| rank(set) == n).collect();
        if !found.is_empty() {
            out.method = exhausted(found.len(), size, places.len(), count);
            return found;
        }
    }
    Vec::new()
}

/// The result of a search through all sets.
fn exhausted(found: usize, size: usize, places: usize, all: usize) -> String {
    let enough = if found == 1 { "is" } else { "are" };
    match size {
        1 if places == 1 => "the only place is enough".into(),
        1 if found == all => format!("any one of the {places} places is enough (each was tried alone)"),
        1 => format!("one place is enough: {found} of the {places} places {enough}, each tried alone"),
        _ if size == places => format!("all {places} places are needed: no smaller set of them is enough"),
        _ if found == all => {
            format!("{size} of the {places} places are needed: any {size} will do (all {all} sets were tried)")
        }
        _ => format!(
            "{size} of the {places} places are needed: {found} of the {all} possible sets of {size} {enough} enough (all were tried)"
        ),
    }
}

/// Marks the sets that no other set surpasses in score without costing more; the sets are sorted by score, then by cost.
fn mark_efficient(sets: &mut [PlacedSet]) {
    let mut cheapest: Option<(f64, f64)> = None;
    for set in sets.iter_mut().filter(|set| !set.score.is_nan()) {
        set.efficient =
            cheapest.is_none_or(|(cost, score)| set.cost < cost || (set.cost == cost && set.score == score));
        if set.efficient {
            cheapest = Some((set.cost, set.score));
        }
    }
}

/// A system whose inputs are the candidates; for sensors, the dual system.
pub fn with_candidates(system: &LinearSystem, side: Side, candidates: &[Candidate]) -> LinearSystem {
    let n = system.states.len();
    let base = if side == Side::Inputs { system.clone() } else { system.transpose() };
    LinearSystem {
        b: Matrix::from_fn(n, candidates.len(), |i, j| candidates[j].column[i].clone()),
        inputs: candidates.iter().map(|candidate| candidate.name.clone()).collect(),
        c: Matrix::zeros(0, n),
        d: Matrix::zeros(0, candidates.len()),
        outputs: Vec::new(),
        ..base
    }
}

/// The Gramian of every single candidate: of (E⁻¹A, E⁻¹b), for a sensor of its dual ((E⁻¹A)ᵀ, cᵀ).
fn gramians(system: &LinearSystem, side: Side, candidates: &[Candidate], horizon: f64) -> Option<Vec<Gramian>> {
    let e = to_mat(&system.e).full_piv_lu();
    let columns = Mat::from_fn(system.states.len(), candidates.len(), |i, j| rational_to_f64(&candidates[j].column[i]));
    let a = e.solve(to_mat(&system.a));
    let (a, b) = match side {
        Side::Inputs => (a, e.solve(columns)),
        Side::Outputs => (a.transpose().to_owned(), columns),
    };
    (0..candidates.len()).map(|j| gramian(&a, &b.as_ref().subcols(j, 1).to_owned(), horizon)).collect()
}

/// Adds the candidate that reaches most until all is reached, then removes superfluous ones.
fn greedy(all: &[usize], n: usize, rank: &impl Fn(&[usize]) -> usize, tried: &mut usize) -> Vec<usize> {
    let mut set: Vec<usize> = Vec::new();
    while rank(&set) < n {
        let rest = all.iter().copied().filter(|k| !set.contains(k));
        let with = |k: usize| set.iter().copied().chain([k]).collect::<Vec<_>>();
        *tried += all.len() - set.len();
        let Some(best) = rest.max_by_key(|&k| (rank(&with(k)), std::cmp::Reverse(k))) else { break };
        set.push(best);
    }
    for k in set.clone() {
        let reduced_set: Vec<usize> = set.iter().copied().filter(|&candidate| candidate != k).collect();
        *tried += 1;
        if rank(&reduced_set) == n {
            set = reduced_set;
        }
    }
    set.sort_unstable();
    set
}

#[cfg(test)]
#[path = "../tests/unit/placement.rs"]
mod tests;
