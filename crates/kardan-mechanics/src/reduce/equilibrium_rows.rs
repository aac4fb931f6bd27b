//! Motions without inertia on which springs alone act: equations of equilibrium, which are constraints.

use crate::assemble::{DirectionalTerm, Equations, MultiplierConstraint};
use kardan_math::num::{Matrix, Rational, Scalar, dense_rows, reduced_form, sparse_rows};
use kardan_math::units::Exact;

/// The prefix of the name of a row without inertia; the name of the shaft that it determines follows.
const EQUILIBRIUM: &str = "equilibrium of ";

/// Why springs do not determine a motion without inertia.
#[derive(Debug, Clone, PartialEq)]
pub enum NoEquilibrium {
    /// Inputs or torques of laws act on it: it would follow their torques at once.
    Driven {
        /// Their elements.
        inputs: Vec<String>,
        /// Whether springs act on it too.
        sprung: bool,
        /// The shafts that move, with their shares.
        direction: Vec<(usize, Rational)>,
    },
    /// A constraint enforced by a multiplier depends on it.
    MultiplierConstraint {
        /// Its element.
        element: String,
        /// The shafts that move, with their shares.
        direction: Vec<(usize, Rational)>,
    },
    /// No torque at all acts on it.
    Free {
        /// The shafts that move, with their shares.
        direction: Vec<(usize, Rational)>,
    },
}

type Row = Vec<(usize, Rational)>;

/// `aᵀv` of a row and a column of a matrix.
pub(super) fn row_dot(row: &[(usize, Rational)], directions: &Matrix<Rational>, column: usize) -> Rational {
    row.iter().fold(Rational::ZERO, |sum, (k, x)| sum.plus(&x.times(&directions[(*k, column)])))
}

/// The equations of equilibrium `vᵀ(S q − s₀) = 0` of the motions v without inertia on which neither dampers nor
/// frictions act, one row for each.
///
/// Where H v = 0, D v = 0 and no torque acts in the direction v, `vᵀ(H q̈ + D q̇ + S q − s₀) = 0` is a linear
/// constraint that is satisfied by itself: its multiplier is zero, and eliminating it is exact. Motions through a
/// transmission whose ratio changes are not considered.
///
/// # Errors
/// [`NoEquilibrium`] where inputs or multiplier constraints act on such a motion or no torque does.
pub fn equilibrium_rows(equations: &Equations) -> Result<Vec<DirectionalTerm<Exact>>, NoEquilibrium> {
    let n = equations.coordinates.len();
    let ends: Vec<Row> = equations
        .transmissions
        .iter()
        .flat_map(|t| [t.driven, t.driving])
        .map(|shaft| vec![(shaft, Rational::ONE)])
        .collect();
    let terms = equations.constraints.iter().map(|term| &term.row);
    let terms = terms.chain(equations.inertias.iter().map(|term| &term.row)).chain(&ends);
    let terms = terms.chain(equations.dampers.iter().map(|term| &term.row));
    let terms = terms.chain(equations.frictions.iter().map(|term| &term.row));
    let terms: Vec<&Row> = terms.chain(equations.unilaterals.iter().map(|term| &term.row)).collect();
    let e = reduced_form(&dense_rows(&terms, n));
    // One column for each direction, and the shaft that it is named after.
    let (directions, named) = (e.kernel(), e.free());
    let mut rows = Vec::new();
    for ((column, &shaft), direction) in named.iter().enumerate().zip(sparse_rows(&directions.transpose())) {
        let moves = |shaft: usize| !directions[(shaft, column)].is_zero();
        let is_moved = |constraint: &&MultiplierConstraint| {
            equations.coordinates_of_multiplier(&constraint.law).into_iter().any(moves)
        };
        if let Some(constraint) = equations.multiplier_constraints.iter().find(is_moved) {
            return Err(NoEquilibrium::MultiplierConstraint { element: constraint.element.clone(), direction });
        }
        let acts = |row: &Row| !row_dot(row, &directions, column).is_zero();
        let inputs = equations.inputs.iter().filter(|input| acts(&input.row)).map(|input| input.element.clone());
        let laws = equations.laws.iter().filter(|law| acts(&law.row)).map(|law| law.element.clone());
        let inputs: Vec<String> = inputs.chain(laws).collect();
        if !inputs.is_empty() {
            let sprung = equations.springs.iter().any(|spring| acts(&spring.row));
            return Err(NoEquilibrium::Driven { inputs, sprung, direction });
        }
        let (mut torque, mut offset) = (vec![Rational::ZERO; n], Rational::ZERO);
        for spring in &equations.springs {
            let share = row_dot(&spring.row, &directions, column).times(&spring.value.stiffness.to_rational());
            spring.row.iter().for_each(|(k, x)| torque[*k] = torque[*k].plus(&share.times(x)));
            offset = offset.plus(&share.times(&spring.value.rest.to_rational()));
        }
        let size = |x: &Rational| if *x < Rational::ZERO { Rational::ZERO.minus(x) } else { x.clone() };
        let Some(largest) = torque.iter().map(size).max().filter(|x| !x.is_zero()) else {
            return Err(NoEquilibrium::Free { direction });
        };
        let row = torque.iter().enumerate().filter(|(_, x)| !x.is_zero());
        rows.push(DirectionalTerm {
            element: format!("{EQUILIBRIUM}{}", equations.coordinates[shaft]),
            row: row.map(|(k, x)| (k, x.over(&largest))).collect(),
            value: Exact::new(offset.over(&largest), 0),
        });
    }
    // Springs may leave a combination of them free.
    let stiffness = Matrix::from_fn(rows.len(), named.len(), |i, j| row_dot(&rows[i].row, &directions, j));
    let e = reduced_form(&stiffness);
    if e.rank() < named.len() {
        let free = directions.multiply(&e.kernel()).transpose();
        return Err(NoEquilibrium::Free { direction: sparse_rows(&free).swap_remove(0) });
    }
    Ok(rows)
}

impl Equations {
    /// Takes equations of equilibrium among the constraints, before the balances of nodes.
    pub fn with_equilibria(mut self, rows: Vec<DirectionalTerm<Exact>>) -> Self {
        rows.into_iter().for_each(|row| self.add_constraint(row));
        self
    }

    /// Whether a constraint is an equation of equilibrium: no force acts through it, its multiplier is zero.
    pub fn is_equilibrium(&self, constraint: usize) -> bool {
        self.constraints.get(constraint).is_some_and(|row| row.element.starts_with(EQUILIBRIUM))
    }
}
