//! Constraints that follow from others: removed as redundant where their offsets agree, exactly.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::{Dependency, ReduceError, Reduced, Redundant};
use crate::assemble::{DependentConstraint, DirectionalTerm, Equations, MultiplierConstraint};
use crate::equations::{Domain, MultiplierLaw};
use kardan_expr::expr::{Expr, Graph};
use kardan_math::num::{Matrix, Rational, Scalar, rational_to_f64, reduced_form, sparse_echelon};
use kardan_math::units::Exact;

/// Removes the constraints that follow from those before them.
///
/// Whether a row follows, and whether its offset is that of the rows that it follows from, is decided over the rationals and the powers of π.
///
/// # Errors
/// [`ReduceError::ConstraintsDependent`] for rows whose offsets contradict each other, and for balances of nodes, whose multipliers are
/// potentials.
pub(super) fn independent_rows(equations: &mut Equations) -> Result<Vec<Redundant>, ReduceError> {
    let rows = equations.constraints.len();
    let columns: Vec<usize> = (0..equations.coordinates.len()).collect();
    let rank = sparse_echelon(equations.constraints.iter().map(|constraint| &constraint.row), &columns).rank();
    if rank == rows {
        return Ok(redundant_rates(equations));
    }
    // Pivots of the transpose are the first independent rows; the other columns are their shares.
    let e = reduced_form(&equations.constraint_matrix().transpose());
    let elements = rows - equations.nodes.len();
    let (mut redundant, mut dependencies) = (Vec::new(), Vec::new());
    for row in e.free() {
        let entries =
            e.pivots.iter().enumerate().map(|(independent, &other)| (independent, other, &e.form[(independent, row)]));
        let entries: Vec<(usize, usize, &Rational)> = entries.filter(|(.., share)| !share.is_zero()).collect();
        let contradiction = !agree(equations, row, &entries);
        let moves = |row: usize| equations.moving.contains_key(&equations.constraints[row].element);
        let moving = moves(row) || entries.iter().any(|(_, other, _)| moves(*other));
        if contradiction || moving || row >= elements || entries.iter().any(|(_, other, _)| *other >= elements) {
            dependencies.push(Dependency { moving, ..dependency(equations, row, &entries, contradiction) });
        }
        redundant.push(Redundant {
            constraint: equations.constraints[row].clone(),
            shares: entries.into_iter().map(|(independent, _, share)| (independent, share.clone())).collect(),
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

/// Removes rows of speeds whose coefficients are numbers, and which follow from constraints at rest, from the
/// multiplier constraints; returns them. Then removes those that are sums of others.
fn redundant_rates(equations: &mut Equations) -> Vec<Redundant> {
    let (n, rows) = (equations.coordinates.len(), equations.constraints.len());
    let elements = rows - equations.nodes.len();
    let mut out = Vec::new();
    let follows = |multiplier_constraint: &MultiplierConstraint| {
        let MultiplierLaw::Rates(row) = &multiplier_constraint.law else { return None };
        let row: Vec<(usize, Rational)> =
            row.iter().map(|(shaft, formula)| Some((*shaft, formula.number()?))).collect::<Option<_>>()?;
        let mut matrix = Matrix::zeros(n, rows + 1);
        for (k, constraint) in equations.constraints.iter().enumerate() {
            constraint.row.iter().for_each(|(shaft, x)| matrix[(*shaft, k)] = x.clone());
        }
        row.iter().for_each(|(shaft, x)| matrix[(*shaft, rows)] = matrix[(*shaft, rows)].plus(x));
        let e = reduced_form(&matrix);
        let shares = e.pivots.iter().enumerate().map(|(k, &other)| (other, e.form[(k, rows)].clone()));
        let shares: Vec<(usize, Rational)> = shares.filter(|(_, share)| !share.is_zero()).collect();
        let moves = |other: usize| equations.moving.contains_key(&equations.constraints[other].element);
        let follows = !e.pivots.contains(&rows) && !shares.is_empty();
        let are_constant = || shares.iter().all(|(other, _)| *other < elements && !moves(*other));
        let constraint = DirectionalTerm {
            element: multiplier_constraint.element.clone(),
            row,
            value: Exact::new(Rational::ZERO, 0),
        };
        // Multipliers in other units than torques and forces are not split with these.
        equations.domain_of_multiplier(multiplier_constraint)?;
        (follows && are_constant()).then_some(Redundant { constraint, shares })
    };
    for multiplier_constraint in &equations.multiplier_constraints {
        out.extend(follows(multiplier_constraint));
    }
    let measured: Vec<(String, Domain)> = (equations.multiplier_constraints.iter())
        .filter(|multiplier_constraint| out.iter().any(|row| row.constraint.element == multiplier_constraint.element))
        .filter_map(|multiplier_constraint| {
            Some((multiplier_constraint.element.clone(), equations.domain_of_multiplier(multiplier_constraint)?))
        })
        .filter(|(_, domain)| *domain == Domain::Translation)
        .collect();
    equations.measures.extend(measured);
    equations
        .multiplier_constraints
        .retain(|multiplier_constraint| out.iter().all(|row| row.constraint.element != multiplier_constraint.element));
    remove_dependent_rates(equations);
    out
}

/// A row of speeds as a sum of different expressions, each the coefficient of one shaft; constant ones have none.
type Parts = BTreeMap<(usize, Option<Expr>), Rational>;

/// Removes rows of speeds that are sums of others of the same unit, times fractions, from the multiplier constraints:
/// as expressions, at every position.
fn remove_dependent_rates(equations: &mut Equations) {
    let is_row = |constraint: &&MultiplierConstraint| matches!(constraint.law, MultiplierLaw::Rates(_));
    if equations.multiplier_constraints.iter().filter(is_row).count() < 2 {
        return;
    }
    let mut graph = Graph::default();
    let mut by_unit: BTreeMap<[i8; 7], Vec<(&MultiplierConstraint, Parts)>> = BTreeMap::new();
    for constraint in &equations.multiplier_constraints {
        if let Some(parts) = parts_of(equations, &mut graph, constraint) {
            by_unit
                .entry(equations.dimension_of_multiplier(constraint).exponents)
                .or_default()
                .push((constraint, parts));
        }
    }
    let found: Vec<DependentConstraint> = by_unit.values().flat_map(|rows| sums(rows)).collect();
    equations.multiplier_constraints.retain(|constraint| found.iter().all(|one| one.row.element != constraint.element));
    equations.dependent_constraints.extend(found);
}

/// The terms of the coefficients of a row of speeds; `None` for another constraint.
fn parts_of(equations: &Equations, graph: &mut Graph, constraint: &MultiplierConstraint) -> Option<Parts> {
    let MultiplierLaw::Rates(entries) = &constraint.law else { return None };
    let dimension = |name: &str| {
        let number = equations.coordinates.iter().position(|own| own == name)?;
        Some(equations.domain(number).dimensions()[0])
    };
    let mut out = Parts::new();
    for (shaft, formula) in entries {
        let value = formula.of_positions(graph, &dimension)?;
        let (constant, terms) = graph.terms(value);
        let terms = terms.into_iter().map(|(part, factor)| (Some(part), factor)).chain([(None, constant)]);
        for (part, factor) in terms.filter(|(_, factor)| !factor.is_zero()) {
            let sum = out.entry((*shaft, part)).or_default();
            *sum = sum.plus(&factor);
        }
    }
    Some(out)
}

/// The rows among these that are sums of those before them.
fn sums(rows: &[(&MultiplierConstraint, Parts)]) -> Vec<DependentConstraint> {
    let columns: BTreeSet<(usize, Option<Expr>)> = rows.iter().flat_map(|(_, parts)| parts.keys().copied()).collect();
    let columns: Vec<(usize, Option<Expr>)> = columns.into_iter().collect();
    let entry = |column: usize, row: usize| rows[row].1.get(&columns[column]).cloned().unwrap_or(Rational::ZERO);
    let matrix = Matrix::from_fn(columns.len(), rows.len(), entry);
    let e = reduced_form(&matrix);
    let again = |row: usize| {
        let shares = e.pivots.iter().enumerate().map(|(k, &other)| (other, e.form[(k, row)].clone()));
        let shares = shares.filter(|(_, share)| !share.is_zero());
        let shares = shares.map(|(other, share)| (rows[other].0.element.clone(), share)).collect();
        DependentConstraint { row: rows[row].0.clone(), shares }
    };
    // A row without content is a separate error.
    e.free().into_iter().map(again).filter(|one| !one.shares.is_empty()).collect()
}

/// Of each multiplier its combination of those that independent rows would carry alone, first of these rows, then of the redundant ones
/// `R = B C`, with the least sum of squares: `λ = (1 + BᵀB)⁻¹ λ_alone`, `μ = B λ`.
fn least_split(redundant: &[Vec<(usize, Rational)>], rows: usize) -> Vec<Vec<(usize, Rational)>> {
    let involved: BTreeSet<usize> = redundant.iter().flatten().map(|(row, _)| *row).collect();
    let involved: Vec<usize> = involved.into_iter().collect();
    let share = |row: usize, column: usize| {
        let own = redundant[row].iter().find(|(row, _)| *row == involved[column]);
        own.map_or(Rational::ZERO, |(_, share)| share.clone())
    };
    let b = Matrix::from_fn(redundant.len(), involved.len(), share);
    let one = Matrix::identity(involved.len());
    let sum = one.plus(&b.transpose().multiply(&b));
    let shared = sum.solve(&one).expect("one plus a Gram matrix is positive definite");
    let combination = |matrix: &Matrix<Rational>, row: usize| -> Vec<(usize, Rational)> {
        let entries = involved.iter().zip(matrix.row(row)).filter(|(_, share)| !share.is_zero());
        entries.map(|(&other, share)| (other, share.clone())).collect()
    };
    let of = |row: usize| match involved.binary_search(&row) {
        Ok(place) => combination(&shared, place),
        Err(_) => vec![(row, Rational::ONE)],
    };
    let carried = b.multiply(&shared);
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
    /// A linear constraint by the number of its multiplier: the independent ones, then, behind the transmissions, the
    /// redundant ones.
    pub fn linear_constraint(&self, multiplier: usize) -> Option<&DirectionalTerm<Exact>> {
        let equations = &self.equations;
        let first = equations.constraints.len() + equations.transmissions.len();
        let redundant = || Some(&self.redundant.get(multiplier.checked_sub(first)?)?.constraint);
        equations.constraints.get(multiplier).or_else(redundant)
    }

    /// Elements of all constraints, in the order of their multipliers `τ_c = Jᵀλ` \[diss. (4.18)\]: linear constraints, transmissions, and
    /// linear constraints that follow from others, each kind sorted by element name. The multiplier of a transmission is the torque on its
    /// driven shaft.
    pub fn constraint_elements(&self) -> Vec<&str> {
        let linear = self.equations.constraints.iter().map(|constraint| &constraint.element);
        let curves = self.equations.transmissions.iter().map(|transmission| &transmission.element);
        let redundant = self.redundant.iter().map(|row| &row.constraint.element);
        linear.chain(curves).chain(redundant).map(String::as_str).collect()
    }

    /// Elements between which the split of the constraint torques is not unique, in groups.
    pub fn redundant_groups(&self) -> Vec<BTreeSet<String>> {
        let linear = self.redundant.iter().map(|Redundant { constraint, shares }| {
            let independent = shares.iter().map(|(candidate, _)| &self.equations.constraints[*candidate].element);
            independent.chain([&constraint.element]).map(String::as_str).collect()
        });
        let rates = self.equations.dependent_constraints.iter().map(|again| {
            again.shares.iter().map(|(name, _)| name).chain([&again.row.element]).map(String::as_str).collect()
        });
        let found: Vec<BTreeSet<&str>> = linear.chain(rates).collect();
        // Each name points to another one of its group, the last one to itself.
        let mut leads: HashMap<&str, &str> = HashMap::new();
        for group in &found {
            let Some(first) = group.first() else { continue };
            let to = last_of(&mut leads, first);
            for name in group {
                let from = last_of(&mut leads, name);
                leads.insert(from, to);
                leads.entry(name).or_insert(to);
            }
        }
        let mut groups: BTreeMap<&str, (usize, BTreeSet<String>)> = BTreeMap::new();
        for (number, group) in found.iter().enumerate() {
            let Some(first) = group.first() else { continue };
            let (latest, names) = groups.entry(last_of(&mut leads, first)).or_default();
            *latest = number;
            names.extend(group.iter().map(ToString::to_string));
        }
        let mut groups: Vec<_> = groups.into_values().collect();
        groups.sort();
        groups.into_iter().map(|(_, names)| names).collect()
    }

    /// Whether the split of constraint torques between an element and others is not unique.
    pub fn shares_torque(&self, element: &str) -> bool {
        self.redundant_groups().iter().any(|group| group.contains(element))
    }

    /// The multipliers of the rows of a system whose first rows are the independent constraints, from those that these
    /// would have alone: those of the same rows, then those of the redundant ones. Of all possible splits it is the one
    /// with the least sum of squares, which rows of the same stiffness would have.
    ///
    /// With redundant rows `R = B C` the independent ones carry `λ + Bᵀμ` in all. Rows that have no part in a redundant
    /// one keep theirs. The result is for each row its combination of those alone, exact.
    pub fn split(&self, rows: usize) -> Vec<Vec<(usize, Rational)>> {
        let shares: Vec<Vec<(usize, Rational)>> = self.redundant.iter().map(|row| row.shares.clone()).collect();
        least_split(&shares, rows)
    }

    /// The same for independent rows, and for those that follow from them.
    pub fn split_multipliers(&self) -> Vec<Vec<(usize, Rational)>> {
        let multiplier_constraints = &self.equations.multiplier_constraints;
        let number = |name: &str| multiplier_constraints.iter().position(|row| row.element == *name);
        let shares = |again: &DependentConstraint| {
            again.shares.iter().filter_map(|(name, share)| Some((number(name)?, share.clone()))).collect()
        };
        least_split(
            &self.equations.dependent_constraints.iter().map(shares).collect::<Vec<_>>(),
            multiplier_constraints.len(),
        )
    }
}

/// The last name that a name leads to; the way there becomes shorter.
fn last_of<'a>(leads: &mut HashMap<&'a str, &'a str>, name: &'a str) -> &'a str {
    let mut at = name;
    while let Some(next) = leads.get(at).copied().filter(|next| *next != at) {
        let behind = leads.get(next).copied().unwrap_or(next);
        leads.insert(at, behind);
        at = behind;
    }
    at
}
