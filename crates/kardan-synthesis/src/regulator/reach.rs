//! Controllability chains of a system.

use kardan_analysis::{LinearSystem, controllable_rank};
use kardan_math::num::{Matrix, Polynomial, Rational, Scalar, characteristic_polynomial, reduced_form};
use kardan_results::Pole;

use crate::decoupling::RowSpan;
use crate::notation::linear_combination;

/// Independent columns of the controllability matrix in the order `b₁ … b_m, A b₁ …`: each that does not depend on those
/// before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Chains {
    /// `A^k b_i` as (input i, power k, vector), in that order.
    pub vectors: Vec<(usize, usize, Vec<Rational>)>,
    /// How many vectors begin with each input: the controllability index κ_i in the order of the inputs; their sum is the
    /// rank.
    pub indices: Vec<usize>,
}

/// The chains `b_i, A b_i, …` of a pair (A, B), exact; those of (Aᵀ, Cᵀ) give the observability indices of the sensors.
///
/// A vector that depends on those before it ends its chain: all later ones of the chain do so too (Luenberger 1967). Method:
/// elimination over the rationals as the vectors come, O(n³) operations.
///
/// # Panics
/// If the shapes do not fit.
pub fn chains(a: &Matrix<Rational>, b: &Matrix<Rational>) -> Chains {
    let (n, m) = (a.rows(), b.columns());
    assert!(a.columns() == n && b.rows() == n, "chains of matrices that do not fit");
    let mut span = RowSpan::default();
    let mut out = Chains { vectors: Vec::new(), indices: vec![0; m] };
    let mut open: Vec<(usize, Vec<Rational>)> =
        (0..m).map(|j| (j, (0..n).map(|i| b[(i, j)].clone()).collect())).collect();
    let mut power = 0;
    while !open.is_empty() && out.vectors.len() < n {
        let mut next = Vec::new();
        for (input, vector) in open {
            if span.insert(&vector).is_none() {
                continue;
            }
            let column = Matrix::from_fn(n, 1, |i, _| vector[i].clone());
            next.push((input, a.multiply(&column).as_slice().to_vec()));
            out.vectors.push((input, power, vector));
            out.indices[input] += 1;
        }
        open = next;
        power += 1;
    }
    out
}

/// The uncontrollable part of a system.
#[derive(Debug, Clone, PartialEq)]
pub struct Unreached {
    /// Characteristic polynomial of the part that no input reaches.
    pub polynomial: Polynomial,
    /// Its roots with their multiplicities: the fixed modes, 1/s.
    pub modes: Vec<Pole>,
    /// Combinations of states that no input reaches, as text, one for each mode.
    pub combinations: Vec<String>,
    /// States that represent the reached part, by number: it is x of these once `x_rest = rest · x_reached` is taken out.
    pub reached: Vec<usize>,
    /// A on the reached part.
    pub a: Matrix<Rational>,
    /// B on the reached part.
    pub b: Matrix<Rational>,
}

/// The part of an explicit system (E = I) that no input reaches; `None` if there is none. Exact.
///
/// With a basis V of the reached space that is the identity on chosen states, `A V = V A₁₁`, `B = V B₁`; the combinations
/// `x_c − V_c x_p` obey an equation of their own without input. Whether there is such a part is decided modulo a prime where
/// that proves it.
///
/// # Panics
/// If E is not the identity.
pub fn unreached(system: &LinearSystem) -> Option<Unreached> {
    let n = system.states.len();
    assert_eq!(system.e, Matrix::identity(n), "the system is not explicit");
    if n == 0 || system.b.columns() > 0 && controllable_rank(system) == Some(n) {
        return None;
    }
    let found = chains(&system.a, &system.b).vectors;
    if found.len() == n {
        return None;
    }
    let rows = Matrix::from_fn(found.len(), n, |i, j| found[i].2[j].clone());
    let basis = reduced_form(&rows);
    let (pivots, form) = (basis.pivots, basis.form);
    let rest: Vec<usize> = (0..n).filter(|i| !pivots.contains(i)).collect();
    let r = pivots.len();
    let times_basis = system.a.multiply(&form.transpose());
    let a = Matrix::from_fn(r, r, |i, j| times_basis[(pivots[i], j)].clone());
    let b = Matrix::from_fn(r, system.b.columns(), |i, j| system.b[(pivots[i], j)].clone());
    // A_cc − V_c A_pc
    let hidden = Matrix::from_fn(n - r, n - r, |i, j| {
        let through =
            (0..r).fold(Rational::ZERO, |sum, k| sum.plus(&form[(k, rest[i])].times(&system.a[(pivots[k], rest[j])])));
        system.a[(rest[i], rest[j])].minus(&through)
    });
    let polynomial = characteristic_polynomial(&hidden);
    let combinations = rest
        .iter()
        .map(|&c| {
            let mut factors = vec![Rational::ZERO; n];
            factors[c] = Rational::ONE;
            pivots.iter().enumerate().for_each(|(k, &p)| factors[p] = Rational::ZERO.minus(&form[(k, c)]));
            linear_combination(&system.states, &factors)
        })
        .collect();
    let modes = Pole::list(polynomial.roots());
    Some(Unreached { polynomial, modes, combinations, reached: pivots, a, b })
}
