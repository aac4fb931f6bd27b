//! Kalman's decomposition, the minimal realisation and the staircase form, exact.

use super::LinearSystem;
use super::parts::{bits_of, columns_of, kernel, reduced_form, side_by_side, window};
use kardan_math::num::{Matrix, Rational};
use kardan_results::{Block, Certificate, Invariant, MinorColumn, Realisations, TransformedSystem};

/// More states are not transformed.
pub const MOST_TRANSFORMED: usize = 64;
/// Bits of the longest number times states⁵: fractions grow with the square of the order, and there are n³ of them to take.
const MOST_WORK: usize = 30_000_000;

/// Kalman's decomposition, the minimal realisation and the staircase form of a system whose certificate is that of
/// [`structure`](super::structure()).
///
/// What no input reaches and no output shows is known from the exact rows Y of the certificate: with `Y A = M Y E`,
/// `Y B = 0` the reachable subspace is the kernel of `Y E`; the rows for the transposed pencil span what outputs do not show.
/// The columns of the staircase are those of its minor, power by power. `None` for more than [`MOST_TRANSFORMED`] states, or
/// where such rows are not known, or the fractions would grow too long (numbers of floating point: from 13 states).
///
/// ```
/// use kardan_analysis::{LinearSystem, realisations, structure};
/// use kardan_math::num::{Matrix, Rational};
/// let q = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let system = LinearSystem::state_space(q(&[&[1, 0], &[1, 2]]), q(&[&[0], &[1]]), q(&[&[0, 1]]));
/// let found = realisations(&system, &structure(&system).unwrap().certificate).unwrap();
/// assert_eq!(found.minimal.a, q(&[&[2]]));
/// ```
pub fn realisations(system: &LinearSystem, certificate: &Certificate) -> Option<Realisations> {
    let n = system.states.len();
    if n > MOST_TRANSFORMED || n.pow(5) * longest(system) > MOST_WORK {
        return None;
    }
    let explicit = system.explicit()?;
    let (reached, observable) =
        (certificate.controllability_minor.as_ref()?, certificate.observability_minor.as_ref()?);
    let (rank, observable_rank) = (reached.columns.len(), observable.columns.len());
    let unreached = rows(certificate.uncontrollable_invariant.as_ref(), n - rank, n)?.multiply(&system.e);
    let reachable = kernel(&unreached);
    let hidden = rows(certificate.unobservable_invariant.as_ref(), n - observable_rank, n)?.transpose();
    let parts = kalman_basis(&reachable, &hidden);
    let names = [
        "controllable, not observable",
        "controllable and observable",
        "neither controllable nor observable",
        "observable, not controllable",
    ];
    let kalman = transformed(&explicit, &parts, names.map(String::from).into())?;
    let first = parts[0].columns();
    let minimal = minimal(&kalman, first, parts[1].columns());
    let staircase = staircase(&explicit, reached.columns.clone())?;
    Some(Realisations { kalman, minimal, staircase })
}

/// Bits of the longest fraction.
fn longest(system: &LinearSystem) -> usize {
    let all = [&system.e, &system.a, &system.b, &system.c].into_iter().flat_map(Matrix::as_slice);
    all.map(bits_of).max().unwrap_or(0)
}

/// Y from a certificate; without one there are none.
fn rows(invariant: Option<&Invariant>, count: usize, n: usize) -> Option<Matrix<Rational>> {
    let Some(invariant) = invariant else { return (count == 0).then(|| Matrix::zeros(0, n)) };
    let values: Option<Vec<Vec<Rational>>> =
        invariant.rows.iter().map(|row| row.iter().map(|x| x.parse().ok()).collect()).collect();
    let values = values.filter(|rows| rows.len() == count)?;
    Some(Matrix::from_fn(count, n, |i, j| values[i][j].clone()))
}

/// Matrices beside each other.
fn all_beside(parts: &[Matrix<Rational>], n: usize) -> Matrix<Rational> {
    parts.iter().fold(Matrix::zeros(n, 0), |all, part| side_by_side(&[&all, part]))
}

/// The columns of `more` that do not depend on those of `basis` and on each other.
fn completing(basis: &Matrix<Rational>, more: &Matrix<Rational>) -> Matrix<Rational> {
    let first = basis.columns();
    let both = side_by_side(&[basis, more]);
    let new: Vec<usize> = reduced_form(&both).pivots.into_iter().filter(|&j| j >= first).collect();
    columns_of(&both, &new)
}

/// Bases of: R ∩ N, the rest of R, the rest of N, the rest.
fn kalman_basis(reachable: &Matrix<Rational>, hidden: &Matrix<Rational>) -> [Matrix<Rational>; 4] {
    let (n, r) = (reachable.rows(), reachable.columns());
    // R x + N y = 0: the vectors R x lie in both.
    let both = kernel(&side_by_side(&[reachable, hidden]));
    let common = reachable.multiply(&window(&both, 0..r, 0..both.columns()));
    let common = completing(&Matrix::zeros(n, 0), &common);
    let observable = completing(&common, reachable);
    let neither = completing(&common, hidden);
    let rest = completing(&side_by_side(&[&common, &observable, &neither]), &Matrix::identity(n));
    [common, observable, neither, rest]
}

/// The system in the coordinates z of `x = T z`.
fn transformed(system: &LinearSystem, parts: &[Matrix<Rational>], names: Vec<String>) -> Option<TransformedSystem> {
    let t = all_beside(parts, system.states.len());
    let blocks = names.into_iter().zip(parts).map(|(name, part)| Block { name, states: part.columns() });
    Some(TransformedSystem {
        blocks: blocks.collect(),
        a: t.solve(&system.a.multiply(&t))?,
        b: t.solve(&system.b)?,
        c: system.c.multiply(&t),
        d: system.d.clone(),
        transformation: t,
    })
}

/// The controllable and observable block.
fn minimal(kalman: &TransformedSystem, first: usize, count: usize) -> TransformedSystem {
    let cut = |m: &Matrix<Rational>, rows: bool, columns: bool| {
        let of = |own: bool, all: usize| if own { first..first + count } else { 0..all };
        window(m, of(rows, m.rows()), of(columns, m.columns()))
    };
    TransformedSystem {
        blocks: vec![Block { name: "controllable and observable".into(), states: count }],
        transformation: cut(&kalman.transformation, false, true),
        a: cut(&kalman.a, true, true),
        b: cut(&kalman.b, true, false),
        c: cut(&kalman.c, false, true),
        d: kalman.d.clone(),
    }
}

/// The columns `Aᵏ b`, power by power: A takes each block into the next one, so it is block Hessenberg, and B is in the first.
fn staircase(system: &LinearSystem, mut columns: Vec<MinorColumn>) -> Option<TransformedSystem> {
    let n = system.states.len();
    let mut blocks: Vec<Matrix<Rational>> = Vec::new();
    let mut power_of_b = system.b.clone();
    columns.sort_by_key(|column| column.power);
    for power in 0.. {
        let chosen: Vec<usize> =
            columns.iter().filter(|column| column.power == power).map(|column| column.input).collect();
        if chosen.is_empty() {
            break;
        }
        blocks.push(columns_of(&power_of_b, &chosen));
        power_of_b = system.a.multiply(&power_of_b);
    }
    let reached = all_beside(&blocks, n);
    let mut names: Vec<String> = (0..blocks.len()).map(|k| format!("reached after {} integrations", k + 1)).collect();
    blocks.push(completing(&reached, &Matrix::identity(n)));
    names.push("not reached".into());
    transformed(system, &blocks, names)
}

/// The part of A whose rows and columns are the states of a block.
pub(super) fn diagonal_block(system: &TransformedSystem, number: usize) -> Matrix<Rational> {
    let first: usize = system.blocks[..number].iter().map(|block| block.states).sum();
    let own = first..first + system.blocks[number].states;
    window(&system.a, own.clone(), own)
}
