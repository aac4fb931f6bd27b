//! Removes the unobservable part of a system.

use std::collections::BTreeSet;

use super::annihilator::annihilator;
use super::relative_degree::assert_explicit;
use super::rows::{RowSpan, null_rows, primitive, row_times, stack, unit, unit_place};
use crate::notation::linear_combination;
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational, Scalar, characteristic_polynomial, columns_of, reduced_form};
use kardan_results::Definition;
use kardan_results::signal_name::SignalName;

/// Longest expression that serves as the name of a state.
const LONGEST_NAME: usize = 40;

/// A system without what its outputs do not show.
#[derive(Debug, Clone, PartialEq)]
pub struct Quotient {
    /// The observable system in the states `z = P x`.
    pub system: LinearSystem,
    /// P, new states × old states, of full row rank: `P A = A_z P`, `B_z = P B`, `C = C_z P`.
    pub projection: Matrix<Rational>,
    /// Name and expression of the new states that are combinations of old ones: `wg.phi - 51 rk.phi + 50 fs.phi`. The name
    /// is the expression itself, or `z1`, `z2`, … if that is longer than 40 characters.
    pub definitions: Vec<Definition>,
    /// Characteristic polynomial of the motion that is removed; 1 if there is none.
    pub hidden: Polynomial,
}

impl Quotient {
    /// `P W`: how columns over the old states (disturbance inputs) act on the new ones.
    ///
    /// # Panics
    /// If W has not one row per old state.
    pub fn project(&self, w: &Matrix<Rational>) -> Matrix<Rational> {
        self.projection.multiply(w)
    }
}

/// The exact quotient of a system by the unobservable subspace of (C, A), in coordinates that a reader knows
/// \[diss. (6.61)\].
///
/// Of the rows that vanish on the unobservable subspace these become coordinates, as far as each is independent of those
/// before it: positions (states ending in `.phi` or `.q`), the rows `preferred` over the states (twists of springs), other
/// states, rows of the reduced echelon form; combinations in smallest whole numbers, the first one positive. If
/// everything is observable, P is the identity. Proven exact; some n³ operations modulo each of a few primes.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::decoupling::observable_quotient;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // Two tanks that empty alike; only the difference of the levels is measured.
/// let tanks = LinearSystem::state_space(matrix(&[&[-3, 1], &[1, -3]]), matrix(&[&[1], &[0]]), matrix(&[&[2, -2]]));
/// let quotient = observable_quotient(&tanks, &[]);
/// assert_eq!(quotient.system.states, ["x1 - x2"]);
/// assert_eq!(quotient.system.a, matrix(&[&[-4]]));
/// assert_eq!(quotient.hidden.to_string(), "s + 2");
/// ```
///
/// # Panics
/// If E is not the identity or a preferred row has not one entry per state.
pub fn observable_quotient(system: &LinearSystem, preferred: &[Vec<Rational>]) -> Quotient {
    assert_explicit(system);
    let n = system.states.len();
    assert!(preferred.iter().all(|row| row.len() == n), "a preferred row has another length than the state");
    // Rows x with C Aᵏ x = 0.
    let unobservable = annihilator(&system.a.transpose(), &system.c.transpose());
    if unobservable.rows() == 0 {
        let (system, hidden) = (system.clone(), Polynomial::constant(Rational::ONE));
        return Quotient { system, projection: Matrix::identity(n), definitions: Vec::new(), hidden };
    }
    let rows = coordinates(&system.states, &unobservable, preferred);
    let projection = stack(&rows, n);
    let pivots = reduced_form(&projection).pivots;
    let square = columns_of(&projection, &pivots).transpose();
    // X P = M for a matrix M whose rows lie in the space of those of P.
    let through = |m: &Matrix<Rational>| {
        let solved = square.solve(&columns_of(m, &pivots).transpose());
        solved.expect("pivot columns of independent rows are independent").transpose()
    };
    let (states, definitions) = names(&rows, &system.states);
    let reduced = LinearSystem {
        states,
        inputs: system.inputs.clone(),
        outputs: system.outputs.clone(),
        e: Matrix::identity(rows.len()),
        a: through(&projection.multiply(&system.a)),
        b: projection.multiply(&system.b),
        c: through(&system.c),
        d: system.d.clone(),
        degrees_of_freedom: None,
    };
    // A x = x M on the unobservable subspace; its basis has the identity in some columns.
    let last_one = |i: usize| unobservable.row(i).iter().rposition(|x| !Scalar::is_zero(x));
    let identity: Vec<usize> = (0..unobservable.rows()).filter_map(last_one).collect();
    let motion = columns_of(&unobservable.multiply(&system.a.transpose()), &identity);
    Quotient { system: reduced, projection, definitions, hidden: characteristic_polynomial(&motion) }
}

/// Independent rows that vanish on the subspace, in the order of preference.
fn coordinates(states: &[String], subspace: &Matrix<Rational>, preferred: &[Vec<Rational>]) -> Vec<Vec<Rational>> {
    let n = states.len();
    let vectors = subspace.transpose();
    let is_position = |k: &usize| SignalName::new(&states[*k]).is_position();
    let units = |selected: &dyn Fn(&usize) -> bool| (0..n).filter(selected).map(|k| unit(k, n)).collect::<Vec<_>>();
    let mut candidates = units(&is_position);
    candidates.extend(preferred.iter().map(|row| primitive(row)));
    candidates.extend(units(&|k| !is_position(k)));
    let vanishing = null_rows(subspace);
    candidates.extend((0..vanishing.rows()).map(|i| primitive(vanishing.row(i))));
    let mut span = RowSpan::default();
    let vanishes = |row: &Vec<Rational>| row_times(row, &vectors).iter().all(Scalar::is_zero);
    candidates.retain(|row| vanishes(row) && span.insert(row).is_some());
    candidates
}

/// Names of the new states and the definitions of those that are combinations.
fn names(rows: &[Vec<Rational>], states: &[String]) -> (Vec<String>, Vec<Definition>) {
    let used_names: BTreeSet<&String> = states.iter().collect();
    let mut fresh = (1..).map(|k| format!("z{k}")).filter(|name| !used_names.contains(name));
    let mut definitions = Vec::new();
    let mut name = |row: &Vec<Rational>| {
        if let Some(k) = unit_place(row) {
            return states[k].clone();
        }
        let expression = linear_combination(states, row);
        let name = if expression.chars().count() > LONGEST_NAME { fresh.next() } else { None };
        let name = name.unwrap_or_else(|| expression.clone());
        definitions.push(Definition { state: name.clone(), expression });
        name
    };
    (rows.iter().map(&mut name).collect(), definitions)
}
