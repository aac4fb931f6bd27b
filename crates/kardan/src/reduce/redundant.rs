//! Constraints that follow from others: kept once where their offsets agree, exactly.

use std::collections::{BTreeMap, BTreeSet};

use super::{Dependency, ReduceError, Reduced, Redundant};
use crate::assemble::{Along, Equations, KeptAgain, KeptRow};
use crate::equations::{Domain, Kept};
use crate::expr::{Expr, Graph};
use crate::num::{Matrix, Rational, Scalar, echelon, rational_to_f64};
use crate::units::{Dimension, Exact};

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
        let redundant = redundant_rates(equations);
        keep_rates_once(equations);
        return Ok(redundant);
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
    keep_rates_once(equations);
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
        // Multipliers in other units than torques and forces are not split with these.
        equations.domain_of_kept(kept)?;
        (follows && stands()).then_some(Redundant { constraint, shares })
    };
    for kept in &equations.kept {
        out.extend(follows(kept));
    }
    let measured: Vec<(String, Domain)> = (equations.kept.iter())
        .filter(|kept| out.iter().any(|row| row.constraint.element == kept.element))
        .filter_map(|kept| Some((kept.element.clone(), equations.domain_of_kept(kept)?)))
        .filter(|(_, domain)| *domain == Domain::Translation)
        .collect();
    equations.measures.extend(measured);
    equations.kept.retain(|kept| out.iter().all(|row| row.constraint.element != kept.element));
    out
}

/// Takes rows of speeds that are sums of others of the same unit, times fractions, out of the kept ones: as expressions, at every position.
fn keep_rates_once(equations: &mut Equations) {
    let is_row = |kept: &KeptRow| matches!(kept.law, Kept::Rates(_));
    if equations.kept.iter().filter(|kept| is_row(kept)).count() < 2 {
        return;
    }
    let mut graph = Graph::default();
    let dimension = |name: &str| {
        let number = equations.coordinates.iter().position(|own| own == name)?;
        Some(equations.domain(number).dimensions()[0])
    };
    // Each row by the parts of its coefficients, which are different expressions.
    let mut parts: Vec<(Option<Dimension>, BTreeMap<(usize, Option<Expr>), Rational>)> = Vec::new();
    for kept in &equations.kept {
        let mut row = BTreeMap::new();
        let Kept::Rates(entries) = &kept.law else {
            parts.push((None, row));
            continue;
        };
        let mut known = true;
        for (shaft, formula) in entries {
            let Some(value) = formula.of_positions(&mut graph, &dimension) else {
                known = false;
                continue;
            };
            let (constant, terms) = graph.terms(value);
            let all = terms.into_iter().map(|(part, factor)| (Some(part), factor)).chain([(None, constant)]);
            for (part, factor) in all.filter(|(_, factor)| !factor.is_zero()) {
                let sum: &mut Rational = row.entry((*shaft, part)).or_default();
                *sum = sum.plus(&factor);
            }
        }
        let unit = Dimension { angle: 0, ..equations.dimension_of_kept(kept) };
        parts.push((known.then_some(unit), row));
    }
    let columns: Vec<(usize, Option<Expr>)> =
        parts.iter().flat_map(|(_, row)| row.keys().copied()).collect::<BTreeSet<_>>().into_iter().collect();
    let units: Vec<Dimension> = parts.iter().filter_map(|(unit, _)| *unit).collect();
    let mut again = Vec::new();
    let mut told: Vec<Dimension> = Vec::new();
    for unit in units {
        if told.contains(&unit) {
            continue;
        }
        told.push(unit);
        let rows: Vec<usize> = (0..parts.len()).filter(|k| parts[*k].0 == Some(unit)).collect();
        let entry = |column: usize, k: usize| parts[rows[k]].1.get(&columns[column]).cloned().unwrap_or(Rational::ZERO);
        let matrix = Matrix::from_fn(columns.len(), rows.len(), entry);
        let e = echelon(&matrix, &(0..rows.len()).collect::<Vec<_>>());
        for row in e.free() {
            let shares = e.pivots.iter().enumerate().map(|(k, &other)| (rows[other], e.form[(k, row)].clone()));
            let shares: Vec<(usize, Rational)> = shares.filter(|(_, share)| !share.is_zero()).collect();
            // A row that says nothing is a mistake of its own.
            if !shares.is_empty() {
                again.push((rows[row], shares));
            }
        }
    }
    let name = |k: usize| equations.kept[k].element.clone();
    let found: Vec<KeptAgain> = again
        .into_iter()
        .map(|(row, shares)| KeptAgain {
            row: equations.kept[row].clone(),
            shares: shares.into_iter().map(|(other, share)| (name(other), share)).collect(),
        })
        .collect();
    equations.kept.retain(|kept| found.iter().all(|one| one.row.element != kept.element));
    equations.kept_again.extend(found);
}

/// Of each multiplier its combination of those that independent rows would carry alone, first of these rows, then of the redundant ones
/// `R = B C`, with the least sum of squares: `λ = (1 + BᵀB)⁻¹ λ_alone`, `μ = B λ`.
fn least_split(redundant: &[Vec<(usize, Rational)>], rows: usize) -> Vec<Vec<(usize, Rational)>> {
    let involved: BTreeSet<usize> = redundant.iter().flatten().map(|(kept, _)| *kept).collect();
    let involved: Vec<usize> = involved.into_iter().collect();
    let share = |row: usize, column: usize| {
        let own = redundant[row].iter().find(|(kept, _)| *kept == involved[column]);
        own.map_or(Rational::ZERO, |(_, share)| share.clone())
    };
    let b = Matrix::from_fn(redundant.len(), involved.len(), share);
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
    let carried = b.multiply(&kept);
    (0..rows).map(of).chain((0..redundant.len()).map(|row| combination(&carried, row))).collect()
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
        let linear = self.redundant.iter().map(|Redundant { constraint, shares }| {
            let kept = shares.iter().map(|(kept, _)| &self.equations.constraints[*kept].element);
            kept.chain([&constraint.element]).cloned().collect()
        });
        let rates = self
            .equations
            .kept_again
            .iter()
            .map(|again| again.shares.iter().map(|(kept, _)| kept).chain([&again.row.element]).cloned().collect());
        let found: Vec<BTreeSet<String>> = linear.chain(rates).collect();
        for mut group in found {
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
    /// With redundant rows `R = B C` the kept ones carry `λ + Bᵀμ` in all. Rows that have no part in a redundant one keep theirs. Of each row
    /// its combination of those alone is given, exact.
    pub fn split(&self, rows: usize) -> Vec<Vec<(usize, Rational)>> {
        let shares: Vec<Vec<(usize, Rational)>> = self.redundant.iter().map(|row| row.shares.clone()).collect();
        least_split(&shares, rows)
    }

    /// The same of kept rows, and of those that follow from them.
    pub fn split_of_kept(&self) -> Vec<Vec<(usize, Rational)>> {
        let kept = &self.equations.kept;
        let number = |name: &str| kept.iter().position(|row| row.element == *name);
        let shares = |again: &KeptAgain| {
            again.shares.iter().filter_map(|(name, share)| Some((number(name)?, share.clone()))).collect()
        };
        least_split(&self.equations.kept_again.iter().map(shares).collect::<Vec<_>>(), kept.len())
    }
}
