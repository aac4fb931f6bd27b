//! Controllability chains of a system.

use kardan_analysis::{LinearSystem, controllable_rank};
use kardan_math::num::{Matrix, Polynomial, Rational, characteristic_polynomial, columns_of, reduced_form, rows_of};
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
    let a = rows_of(&system.a.multiply(&basis.form.transpose()), &basis.pivots);
    let b = rows_of(&system.b, &basis.pivots);
    // Rows that vanish on the reached space, `[1, −V_c]`, and A_cc − V_c A_pc.
    let left = basis.kernel().transpose();
    let hidden = columns_of(&left.multiply(&system.a), &basis.free());
    let polynomial = characteristic_polynomial(&hidden);
    let combinations = (0..left.rows()).map(|i| linear_combination(&system.states, left.row(i))).collect();
    let modes = Pole::list(polynomial.roots());
    Some(Unreached { polynomial, modes, combinations, reached: basis.pivots, a, b })
}
