//! The structure of a linear system: controllable and observable part, eigenvalues and zeros with their multiplicities.

mod error;
mod least_number;
mod left_vectors;
mod limits;
mod modulo_primes;
mod ranks;
mod relative_degrees;
mod statements;

use std::sync::OnceLock;

pub use error::StructureError;
pub(super) use relative_degrees::relative_degrees;

use super::images::{Images, fingerprint};
use super::spectrum::MOST_EXPANDED;
use super::{LinearSystem, certified};
use kardan_math::num::{Primes, reachable};
use kardan_results::{Certificate, Count, Entry, SparseMatrix, StabilityProofs, Structure, Undecided};
use least_number::count;
use left_vectors::InvariantRows;
use limits::{Limits, RANK_TRIALS};
use modulo_primes::{spectrum, zeros};
use ranks::Ranks;
use relative_degrees::vanish_exactly;
use statements::Statements;

/// The structure of a linear system: ranks, factors, relative degrees, zeros, least numbers of inputs and outputs, exact
/// for the stored numbers, with a certificate.
///
/// Ranks are found modulo random primes near 2⁶⁰. That they are not smaller is proven by a minor that does not vanish
/// modulo the prime; that they are not larger by left vectors that no input reaches, found modulo several primes, brought
/// back to fractions and checked exactly. Polynomials are brought back in the same way and confirmed modulo a further
/// prime; `certificate.statements` lists what is proven and `certificate.failure_probability` bounds the rest.
/// [`certified_structure`] leaves no rest.
///
/// The bound is valid for every system, also for an adversarial one: its primes are others each
/// time ([`Primes::unforeseen`]), and appear nowhere in the result. The primes in the certificate, whose minors are proofs
/// with any prime, follow from the numbers of the system.
///
/// The least number of inputs is the number of non-trivial invariant factors of `sI − E⁻¹A` \[diss. Theorems 5.2, 5.3\];
/// no eigenvalue is computed for any decision. The fields `uncontrollable` and `unobservable` are left to
/// [`failing_modes`](super::failing_modes). Cost O(n³) per prime.
///
/// ```
/// use kardan_analysis::{LinearSystem, structure};
/// use kardan_math::num::{Matrix, Rational};
/// let integers = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // Two equal oscillators; the input acts on the first.
/// let system = LinearSystem::state_space(
///     integers(&[&[0, 1, 0, 0], &[-4, 0, 0, 0], &[0, 0, 0, 1], &[0, 0, -4, 0]]),
///     integers(&[&[0], &[1], &[0], &[0]]),
///     integers(&[&[1, 0, 0, 0]]),
/// );
/// let structure = structure(&system).unwrap();
/// assert_eq!((structure.controllable_rank, structure.min_inputs), (2, 2));
/// assert_eq!(structure.invariant_factors, ["s^2 + 4", "s^2 + 4"]);
/// ```
///
/// # Errors
/// [`StructureError`].
///
/// # Panics
/// If the shapes of the matrices do not fit each other.
pub fn structure(system: &LinearSystem) -> Result<Structure, StructureError> {
    decide(system, None)
}

/// The same as [`structure`], every result proven over the rationals: `certificate.proven` is true and the probability of
/// failure zero.
///
/// The polynomials, multiplicities, defects, zeros and relative degrees follow from the same computation modulo so many
/// primes that numbers below a bound of Hadamard's kind are determined; `analysis/certified.rs` has the
/// argument. For n states with numbers of b bits that takes about `n (b + 1) / 60` primes for systems without a double
/// eigenvalue; for eigenvalues with several eigenvectors, roots of a factor of degree d, about d times as many. `progress`
/// receives the fraction done. If the number of primes needed is too large, `certificate.proven` is false and a
/// statement names what is open and why.
///
/// ```
/// use kardan_analysis::{LinearSystem, certified_structure};
/// use kardan_math::num::{Matrix, Rational};
/// let integers = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let system = LinearSystem::state_space(
///     integers(&[&[0, 1], &[-2, -3]]),
///     integers(&[&[0], &[1]]),
///     integers(&[&[1, 0]]),
/// );
/// let structure = certified_structure(&system, &|_| ()).unwrap();
/// assert!(structure.certificate.proven && structure.controllable());
/// assert_eq!(structure.invariant_factors, ["s^2 + 3 s + 2"]);
/// ```
///
/// # Errors
/// [`StructureError`].
///
/// # Panics
/// If the shapes of the matrices do not fit each other.
pub fn certified_structure(system: &LinearSystem, progress: &dyn Fn(f64)) -> Result<Structure, StructureError> {
    decide(system, Some(progress))
}

/// With `certify` all is proven, and the function receives the fraction done.
fn decide(system: &LinearSystem, certify: Option<&dyn Fn(f64)>) -> Result<Structure, StructureError> {
    let seed = fingerprint(system);
    let limits = Limits::new(system.states.len(), certify.is_some());
    decide_modulo(system, certify, [Primes::unforeseen(seed), Primes::new(seed)], &limits)
}

/// `drawn` are the primes that decide unproven results; with `own`, which follow from the system, all is proven that the
/// certificate shows.
fn decide_modulo(
    system: &LinearSystem,
    certify: Option<&dyn Fn(f64)>,
    [drawn, mut own]: [Primes; 2],
    limits: &Limits,
) -> Result<Structure, StructureError> {
    let n = system.states.len();
    if n == 0 {
        return Err(StructureError::NoStates);
    }
    // Both skip the same primes.
    let mut images = Images::new(system, drawn.clone());
    let dual = OnceLock::new();
    let mut dual_images = Images::of_dual(system, &dual, drawn);
    let ranks = Ranks::decide(system, [&mut images, &mut dual_images], &mut own, limits)?;
    let [reached, observable] = &ranks.found;
    let first = &reached.image;
    let mut statements = Statements::new(system);
    let undecided = ranks.proven().map(|proven| certify.is_some() && !proven);
    describe_ranks(&ranks, undecided, limits, &mut statements);
    let facts = certify.and_then(|progress| prove_all(system, &ranks, &mut own, progress, &mut statements));

    // Unproven results come from random primes.
    let from_facts = facts.as_ref().and_then(certified::Facts::spectrum);
    let proven = from_facts.is_some();
    let spectrum = from_facts.unwrap_or_else(|| spectrum(&mut images, &ranks.found, limits));
    let from_facts = facts.as_ref().and_then(certified::Facts::zeros);
    let zeros_proven = from_facts.is_some();
    let zeros = from_facts.unwrap_or_else(|| zeros(&mut images, first, limits));
    let table = facts.as_ref().map_or_else(|| relative_degrees(first), |facts| facts.relative_degrees.clone());
    let m = spectrum.invariant_factors.len();
    let common = spectrum.common.as_ref();
    let [on_forces, on_positions] = [true, false].map(|forces| system.degrees_of_freedom.map(|r| (r, forces)));
    let (inputs, outputs) = rayon::join(
        || count(&mut images, first, (&ranks.stated[0].image, &own), m, common, on_forces, proven),
        || count(&mut dual_images, &observable.image, (&ranks.stated[1].image, &own), m, common, on_positions, proven),
    );
    if let Some(facts) = &facts {
        statements.list.extend(facts.statements.iter().cloned());
        let open = facts.open_spectrum.iter().chain(&facts.open_zeros);
        statements.list.extend(open.map(|why| format!("no proof: {why}")));
    }
    if !proven {
        statements.modular("multiplicities and invariant factors");
    }
    statements.count("inputs", m, inputs.as_ref(), proven);
    statements.count("outputs", m, outputs.as_ref(), proven);
    if !zeros_proven {
        statements.modular("invariant zeros");
    }
    if facts.is_none() {
        if n <= MOST_EXPANDED && vanish_exactly(system, &table) {
            statements.list.push("relative degrees: the leading Markov parameters vanish exactly; proven".into());
        } else {
            statements.modular("relative degrees");
        }
    }
    let (controllable_rank, observable_rank) = (reached.rank, observable.rank);
    let primes = facts.map_or_else(Vec::new, |facts| facts.primes);
    Ok(Structure {
        states: system.states.clone(),
        inputs: system.inputs.clone(),
        outputs: system.outputs.clone(),
        controllable_rank,
        observable_rank,
        undecided: Undecided { controllability: undecided[0], observability: undecided[1] },
        factors: spectrum.factors,
        uncontrollable: Vec::new(),
        unobservable: Vec::new(),
        relative_degrees: table,
        zeros,
        invariant_factors: spectrum.invariant_factors,
        min_inputs: m,
        min_outputs: m,
        kind: kind(system).into(),
        construction: None,
        certificate: certificate(system, statements, undecided, primes, [inputs, outputs], ranks),
    })
}

fn describe_ranks(ranks: &Ranks, undecided: [bool; 2], limits: &Limits, statements: &mut Statements) {
    for (k, what) in ["controllability", "observability"].into_iter().enumerate() {
        let (rank, n) = (ranks.found[k].rank, ranks.found[k].image.g.rows);
        if undecided[k] {
            statements.undecided(what, rank, n, limits.primes);
        } else {
            statements.rank(what, rank, n, ranks.proven()[k]);
        }
    }
}

/// Proves what ranks leave open; if that cannot be done, a statement gives the reason.
fn prove_all(
    system: &LinearSystem,
    ranks: &Ranks,
    own: &mut Primes,
    progress: &dyn Fn(f64),
    statements: &mut Statements,
) -> Option<certified::Facts> {
    if ranks.proven() != [true; 2] {
        statements.list.push("no proof of the rest: it needs the exact left vectors".into());
        return None;
    }
    let actions = ranks.rows.each_ref().map(|rows| rows.as_ref().map(|rows| &rows.action));
    let facts = certified::prove(system, actions, &mut || own.next().expect("primes are many"), progress);
    facts.map_err(|why| statements.list.push(format!("no proof of the rest: {why}"))).ok()
}

/// Adds to a certificate what else is only so modulo primes that were drawn, with its probability.
pub fn state_modular(system: &LinearSystem, certificate: &mut Certificate, whats: &[&str]) {
    let mut statements = Statements::new(system);
    whats.iter().for_each(|what| statements.modular(what));
    certificate.failure_probability = (certificate.failure_probability + statements.failure_probability()).min(1.0);
    certificate.statements.extend(statements.list);
}

/// The proofs and their methods; `primes` are those of the proofs of [`certified`].
fn certificate(
    system: &LinearSystem,
    statements: Statements,
    undecided: [bool; 2],
    mut primes: Vec<u64>,
    [inputs, outputs]: [Option<Count>; 2],
    ranks: Ranks,
) -> Certificate {
    let [reached, observable] = ranks.stated.map(|reach| reach.minor);
    let [uncontrollable_invariant, unobservable_invariant] =
        ranks.rows.map(|rows| rows.map(InvariantRows::into_fractions));
    let minors = inputs.iter().chain(&outputs).map(|count| &count.minor).chain([&reached, &observable]);
    primes.extend(minors.map(|minor| minor.prime));
    primes.sort_unstable();
    primes.dedup();
    Certificate {
        proven: statements.open == 0 && undecided == [false; 2],
        failure_probability: statements.failure_probability(),
        primes,
        statements: statements.list,
        pencil: pencil(system),
        inputs,
        outputs,
        uncontrollable_invariant,
        unobservable_invariant,
        controllability_minor: Some(reached),
        observability_minor: Some(observable),
        stability: StabilityProofs::default(),
    }
}

/// The rank of the controllability matrix of `E ẋ = A x + B u`, the largest one modulo a few random primes: never above the
/// true rank, and n only if it is n.
///
/// `None` if E is singular.
pub fn controllable_rank(system: &LinearSystem) -> Option<usize> {
    let mut images = Images::unforeseen(system);
    let mut best = 0;
    for number in 0..RANK_TRIALS {
        let image = images.get(number)?;
        best = best.max(reachable(&image.field, &image.g, &image.b).span.dimension());
        if best == image.g.rows {
            break;
        }
    }
    Some(best)
}

/// Which theorem of chapter 5 applies.
fn kind(system: &LinearSystem) -> &'static str {
    let Some(r) = system.degrees_of_freedom else { return "state space" };
    let vanishes = |column: usize| (0..r).all(|i| (0..r).all(|j| system.a[(r + i, column + j)].is_zero()));
    match (vanishes(0), vanishes(r)) {
        (true, _) => "pure damping",
        (false, true) => "no damping",
        (false, false) => "general",
    }
}

/// The matrices as sparse fractions.
pub(super) fn pencil(system: &LinearSystem) -> Vec<SparseMatrix> {
    [("E", &system.e), ("A", &system.a), ("B", &system.b), ("C", &system.c), ("D", &system.d)]
        .into_iter()
        .map(|(name, matrix)| {
            let entries = (0..matrix.rows())
                .flat_map(|i| (0..matrix.columns()).map(move |j| (i, j)))
                .filter(|&at| !matrix[at].is_zero())
                .map(|(row, column)| Entry { row, column, value: matrix[(row, column)].to_string() })
                .collect();
            SparseMatrix { name: name.to_string(), entries }
        })
        .collect()
}

#[cfg(test)]
#[path = "../../tests/unit/structure.rs"]
mod tests;
