//! What obstructs independent control of outputs.

use super::notation;
use super::polynomial_matrix::derivative;
use super::row_span::RowSpan;
use super::structure_algorithm;
use crate::decoupling::{primitive, row_times};
use crate::regulator::chains;
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational, Scalar};

/// Why outputs cannot be controlled independently of each other: whatever the inputs do, `π(s) y = 0` from rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstruction {
    /// The rank of the transfer matrix over the rational functions.
    pub rank: usize,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Polynomial rows π(s) with `π(s) H(s) = 0`, a minimal basis of all of them: independent for every s, of the smallest
    /// degrees. Whole coprime coefficients; that of the highest power of the first output that takes part is positive.
    pub relations: Vec<Vec<Polynomial>>,
}

impl Obstruction {
    /// A relation as text: `wg.phi - 51 cs.phi + 50 fs.phi = 0`, `(s^2 + 3 s) rk.phi = 3 s cj.phi`.
    pub fn notation(&self, relation: &[Polynomial]) -> String {
        let taking_part: Vec<usize> = (0..relation.len()).filter(|&i| !relation[i].is_zero()).collect();
        if let [first, second] = taking_part[..] {
            let side =
                |i: usize, sign: i64| notation::sum(&[relation[i].scale(&Rational::from(sign))], &self.outputs[i..=i]);
            return format!("{} = {}", side(first, 1), side(second, -1));
        }
        format!("{} = 0", notation::sum(relation, &self.outputs))
    }
}

impl std::fmt::Display for Obstruction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the transfer matrix has rank {}, less than its {} outputs", self.rank, self.outputs.len())?;
        for (k, relation) in self.relations.iter().enumerate() {
            write!(f, "{} {}", if k == 0 { ":" } else { "," }, self.notation(relation))?;
        }
        Ok(())
    }
}

impl std::error::Error for Obstruction {}

/// Why the outputs cannot be controlled independently; `None` if the transfer matrix `H(s) = C(sI − A)⁻¹B + D` has
/// full row rank.
///
/// Method: over reachable states x = R z and inputs, the k-th derivative of output i is the row
/// `[C_i Aᵏ R, C_i Aᵏ⁻¹ B, …, C_i B, D_i]`; a row that depends on earlier ones (lower derivatives first) is a relation, and
/// that output is not examined any further. This is the search for a minimal polynomial basis (Kailath, Linear Systems,
/// 1980; Forney 1975), exact, so that every relation holds identically in s.
///
/// `system` has E = I.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::inversion::obstruction;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // Position and speed of one body.
/// let system = LinearSystem::state_space(
///     matrix(&[&[0, 1], &[0, 0]]), matrix(&[&[0], &[1]]), matrix(&[&[1, 0], &[0, 1]]),
/// );
/// let found = obstruction(&system).unwrap();
/// assert_eq!((found.rank, found.notation(&found.relations[0])), (1, "s y1 = y2".to_string()));
/// ```
pub fn obstruction(system: &LinearSystem) -> Option<Obstruction> {
    let rank = structure_algorithm(system).rank();
    let m = system.c.rows();
    (rank < m).then(|| Obstruction {
        rank,
        inputs: system.inputs.clone(),
        outputs: system.outputs.clone(),
        relations: relations(system, m - rank),
    })
}

/// The first `count` relations, which are all.
fn relations(system: &LinearSystem, count: usize) -> Vec<Vec<Polynomial>> {
    let (n, m) = (system.a.rows(), system.c.rows());
    let basis = reachable_basis(system);
    let mut span = RowSpan::default();
    // (output, derivative) of the rows in the span.
    let mut inserted: Vec<(usize, usize)> = Vec::new();
    let mut open: Vec<usize> = (0..m).collect();
    let mut states: Vec<Vec<Rational>> = (0..m).map(|i| system.c.row(i).to_vec()).collect();
    let mut inputs: Vec<Vec<Rational>> = (0..m).map(|i| system.d.row(i).to_vec()).collect();
    let mut out = Vec::new();
    // A minimal basis has no degree above n.
    for order in 0..=n {
        open.retain(|&i| {
            let on_reachable = basis.as_ref().map_or_else(|| states[i].clone(), |r| row_times(&states[i], r));
            let row = [on_reachable, inputs[i].clone()].concat();
            let Some(weights) = span.insert(&row) else {
                inserted.push((i, order));
                return true;
            };
            let mut relation = vec![Polynomial::default(); m];
            relation[i] = power(order);
            for (weight, &(output, order)) in weights.iter().zip(&inserted) {
                let term = power(order).scale(&Rational::ZERO.minus(weight));
                relation[output] = relation[output].plus(&term);
            }
            out.push(whole(&relation));
            false
        });
        if out.len() >= count {
            break;
        }
        for &i in &open {
            inputs[i] = [row_times(&states[i], &system.b), std::mem::take(&mut inputs[i])].concat();
            states[i] = row_times(&states[i], &system.a);
        }
    }
    out
}

/// sᵏ.
fn power(k: usize) -> Polynomial {
    (0..k).fold(Polynomial::constant(Rational::ONE), |p, _| derivative(&p))
}

/// Columns that span the states that inputs reach; `None` if those are all states.
fn reachable_basis(system: &LinearSystem) -> Option<Matrix<Rational>> {
    let n = system.a.rows();
    let reached = chains(&system.a, &system.b).vectors;
    (reached.len() < n).then(|| Matrix::from_fn(n, reached.len(), |i, j| reached[j].2[i].clone()))
}

/// A multiple with whole coprime coefficients, the leading one of the first polynomial positive.
fn whole(relation: &[Polynomial]) -> Vec<Polynomial> {
    let highest_first = |p: &Polynomial| p.coefficients().iter().rev().cloned().collect::<Vec<_>>();
    let all: Vec<Rational> = relation.iter().flat_map(highest_first).collect();
    let mut rest = primitive(&all).into_iter();
    let mut next = |p: &Polynomial| {
        let mut coefficients: Vec<Rational> = rest.by_ref().take(p.coefficients().len()).collect();
        coefficients.reverse();
        Polynomial::new(coefficients)
    };
    relation.iter().map(&mut next).collect()
}
