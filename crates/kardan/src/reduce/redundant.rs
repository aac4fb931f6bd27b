//! Constraints that follow from others: kept once where their offsets agree, exactly.

use std::collections::{BTreeMap, BTreeSet};

use super::{Dependency, ReduceError, Reduced, Redundant};
use crate::assemble::{Along, Equations, KeptRow};
use crate::equations::Kept;
use crate::num::{Matrix, Rational, Scalar, echelon, rational_to_f64};
use crate::units::Exact;

/// Takes the constraints that follow from those before them out of the equations.
///
/// Whether a row follows, and whether its offset is that of the rows that it follows from, is decided over the rationals and the powers of π.
///
/// # Errors
/// [`ReduceError::ConstraintsDependent`] for rows whose offsets contradict each other, and for balances of nodes, whose multipliers are
/// potentials.
pub(super) fn keep_independent(equations: &mut Equations) -> Result<Vec<Redundant>, ReduceError> {
    let (n, rows) = (equations.coordinates.len(), equations.constraints.len());
    let matrix = equations.constraint_matrix();
    let rank = echelon(&matrix, &(0..n).collect::<Vec<_>>()).rank();
    if rank == rows {
        return Ok(redundant_rates(equations));
    }
    // Pivots of the transpose are the first independent rows; the other columns are their shares.
    let e = echelon(&matrix.transpose(), &(0..rows).collect::<Vec<_>>());
    let elements = rows - equations.nodes.len();
    let (mut redundant, mut dependencies) = (Vec::new(), Vec::new());
    for row in e.free() {
        let entries = e.pivots.iter().enumerate().map(|(kept, &other)| (kept, other, &e.form[(kept, row)]));
        let entries: Vec<(usize, usize, &Rational)> = entries.filter(|(.., share)| !share.is_zero()).collect();
        let contradiction = !agree(equations, row, &entries);
        let moves = |row: usize| equations.moving.contains_key(&equations.constraints[row].element);
        let moving = moves(row) || entries.iter().any(|(_, other, _)| moves(*other));
        if contradiction || moving || row >= elements || entries.iter().any(|(_, other, _)| *other >= elements) {
            dependencies.push(Dependency { moving, ..dependency(equations, row, &entries, contradiction) });
        }
        redundant.push(Redundant {
            constraint: equations.constraints[row].clone(),
            shares: entries.into_iter().map(|(kept, _, share)| (kept, share.clone())).collect(),
        });
    }
    if !dependencies.is_empty() {
        return Err(ReduceError::ConstraintsDependent { rows, rank, dependencies });
    }
    let mut row = 0..rows;
    equations.constraints.retain(|_| e.pivots.contains(&row.next().expect("a number for each row")));
    redundant.extend(redundant_rates(equations));
    Ok(redundant)
}

/// Takes rows of speeds whose coefficients are numbers, and which follow from constraints that stand still, out of the kept ones.
fn redundant_rates(equations: &mut Equations) -> Vec<Redundant> {
    let (n, rows) = (equations.coordinates.len(), equations.constraints.len());
    let elements = rows - equations.nodes.len();
    let mut out = Vec::new();
    let follows = |kept: &KeptRow| {
        let Kept::Rates(row) = &kept.law else { return None };
        let row: Vec<(usize, Rational)> =
            row.iter().map(|(shaft, formula)| Some((*shaft, formula.number()?))).collect::<Option<_>>()?;
        let mut matrix = Matrix::zeros(n, rows + 1);
        for (k, constraint) in equations.constraints.iter().enumerate() {
            constraint.row.iter().for_each(|(shaft, x)| matrix[(*shaft, k)] = x.clone());
        }
        row.iter().for_each(|(shaft, x)| matrix[(*shaft, rows)] = matrix[(*shaft, rows)].plus(x));
        let e = echelon(&matrix, &(0..=rows).collect::<Vec<_>>());
        let shares = e.pivots.iter().enumerate().map(|(k, &other)| (other, e.form[(k, rows)].clone()));
        let shares: Vec<(usize, Rational)> = shares.filter(|(_, share)| !share.is_zero()).collect();
        let moves = |other: usize| equations.moving.contains_key(&equations.constraints[other].element);
        let follows = !e.pivots.contains(&rows) && !shares.is_empty();
        let stands = || shares.iter().all(|(other, _)| *other < elements && !moves(*other));
        let constraint = Along { element: kept.element.clone(), row, value: Exact::new(Rational::ZERO, 0) };
        (follows && stands()).then_some(Redundant { constraint, shares })
    };
    for kept in &equations.kept {
        out.extend(follows(kept));
    }
    equations.kept.retain(|kept| out.iter().all(|row| row.constraint.element != kept.element));
    out
}

/// Whether the offset of a row is the sum of those that it follows from: powers of π are independent over the rationals.
fn agree(equations: &Equations, row: usize, entries: &[(usize, usize, &Rational)]) -> bool {
    let mut sums: BTreeMap<i32, Rational> = BTreeMap::new();
    let mut add = |row: usize, share: &Rational| {
        let Exact { rational, pi, .. } = &equations.constraints[row].value;
        let sum = sums.entry(*pi).or_default();
        *sum = sum.plus(&share.times(rational));
    };
    add(row, &Rational::from(-1));
    entries.iter().for_each(|(_, other, share)| add(*other, share));
    sums.values().all(Scalar::is_zero)
}

fn dependency(
    equations: &Equations,
    row: usize,
    entries: &[(usize, usize, &Rational)],
    contradiction: bool,
) -> Dependency {
    let mut shares: Vec<(usize, f64)> = entries.iter().map(|(_, other, x)| (*other, -rational_to_f64(x))).collect();
    shares.push((row, 1.0));
    shares.sort_by_key(|(row, _)| *row);
    let named = |(row, share): (usize, f64)| (equations.constraints[row].element.clone(), share);
    Dependency { elements: shares.into_iter().map(named).collect(), contradiction, moving: false }
}

impl Reduced {
    /// A linear constraint by the number of its multiplier: those that are kept, behind the transmissions the redundant ones.
    pub fn linear_constraint(&self, multiplier: usize) -> Option<&Along<Exact>> {
        let equations = &self.equations;
        let first = equations.constraints.len() + equations.transmissions.len();
        let redundant = || Some(&self.redundant.get(multiplier.checked_sub(first)?)?.constraint);
        equations.constraints.get(multiplier).or_else(redundant)
    }

    /// Elements between which the split of the constraint torques is not unique, in groups.
    pub fn sharing(&self) -> Vec<BTreeSet<String>> {
        let mut groups: Vec<BTreeSet<String>> = Vec::new();
        for Redundant { constraint, shares } in &self.redundant {
            let kept = shares.iter().map(|(kept, _)| &self.equations.constraints[*kept].element);
            let mut group: BTreeSet<String> = kept.chain([&constraint.element]).cloned().collect();
            groups.retain(|other| {
                let apart = other.is_disjoint(&group);
                if !apart {
                    group.extend(other.iter().cloned());
                }
                apart
            });
            groups.push(group);
        }
        groups
    }

    /// Whether the split of constraint torques between an element and others is not unique.
    pub fn shares_torque(&self, element: &str) -> bool {
        self.sharing().iter().any(|group| group.contains(element))
    }

    /// The multipliers of the rows of a system whose first rows are the kept constraints, from what these would carry alone: those of the
    /// same rows, then those of the redundant ones. Of all splits that are possible it is the one with the least sum of squares, which
    /// rows of the same stiffness would have.
    ///
    /// With redundant rows `R = B C` the kept ones carry `λ + Bᵀμ` in all, so `λ = (1 + BᵀB)⁻¹ λ_alone`, `μ = B λ`. Rows that have no part
    /// in a redundant one keep theirs. Of each row its combination of those alone is given, exact.
    pub fn split(&self, rows: usize) -> Vec<Vec<(usize, Rational)>> {
        let involved: BTreeSet<usize> =
            self.redundant.iter().flat_map(|row| row.shares.iter().map(|(kept, _)| *kept)).collect();
        let involved: Vec<usize> = involved.into_iter().collect();
        let share = |row: usize, column: usize| {
            let own = self.redundant[row].shares.iter().find(|(kept, _)| *kept == involved[column]);
            own.map_or(Rational::ZERO, |(_, share)| share.clone())
        };
        let b = Matrix::from_fn(self.redundant.len(), involved.len(), share);
        let one = Matrix::identity(involved.len());
        let sum = one.plus(&b.transpose().multiply(&b));
        let kept = sum.solve(&one).expect("one plus a Gram matrix is positive definite");
        let combination = |matrix: &Matrix<Rational>, row: usize| -> Vec<(usize, Rational)> {
            let entries = involved.iter().zip(matrix.row(row)).filter(|(_, share)| !share.is_zero());
            entries.map(|(&other, share)| (other, share.clone())).collect()
        };
        let of = |row: usize| match involved.binary_search(&row) {
            Ok(place) => combination(&kept, place),
            Err(_) => vec![(row, Rational::ONE)],
        };
        let redundant = b.multiply(&kept);
        (0..rows).map(of).chain((0..self.redundant.len()).map(|row| combination(&redundant, row))).collect()
    }
}
