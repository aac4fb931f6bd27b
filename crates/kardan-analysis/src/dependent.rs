//! Multiplier constraints that follow from other constraints at every position.

use super::integrable::{drawn_field, drawn_values, row_entries};
use kardan_expr::expr::Expr;
use kardan_math::num::{ModularMatrix, PrimeField, Random, Residue};
use kardan_mechanics::equations::MultiplierLaw;
use kardan_mechanics::reduce::{Motion, Reduced};

/// A multiplier constraint that follows from other constraints at every position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dependent {
    /// Its number.
    pub row: usize,
    /// The elements whose rows it is a sum of, with factors that may depend on the position; none where that was not found.
    pub elements: Vec<String>,
}

/// Points that are drawn.
const POINTS: usize = 3;

/// The first multiplier constraint on speeds or positions that is at every position a combination of those before it and of the linear constraints: so it is at
/// random points modulo a random prime, where otherwise only an accident would make it so.
pub fn dependent_row(reduced: &Reduced) -> Option<Dependent> {
    let multiplier_constraints = &reduced.equations.multiplier_constraints;
    let is_of_positions =
        |row: &usize| matches!(multiplier_constraints[*row].law, MultiplierLaw::Rates(_) | MultiplierLaw::Surface(_));
    let mut open: Vec<usize> = (0..multiplier_constraints.len()).filter(is_of_positions).collect();
    let motion = Motion::new(reduced);
    let mut random = Random::unforeseen(multiplier_constraints.len() as u64);
    let field = drawn_field(&mut random);
    let mut elements = Vec::new();
    for _ in 0..POINTS {
        if open.is_empty() {
            return None;
        }
        let (found, at_sample) = at_point(reduced, &motion, field, &mut random)?;
        open.retain(|row| found.contains(row));
        elements = at_sample;
    }
    let row = *open.first()?;
    let of_row = elements.into_iter().find(|(candidate, _)| *candidate == row);
    Some(Dependent { row, elements: of_row.map_or_else(Vec::new, |(_, elements)| elements) })
}

/// Of each row that follows from others, the elements that it follows from.
type Shares = Vec<(usize, Vec<String>)>;

/// Rows that follow from those before them at one point, and from which.
fn at_point(
    reduced: &Reduced,
    motion: &Motion,
    field: PrimeField,
    random: &mut Random,
) -> Option<(Vec<usize>, Shares)> {
    let (r, count, n) =
        (reduced.degrees_of_freedom(), motion.multiplier_constraints.len(), reduced.equations.coordinates.len());
    let mut motion_of = motion.clone();
    let zero = motion_of.graph.integer(0);
    let mut exprs: Vec<Expr> = (0..count).flat_map(|k| row_entries(reduced, &mut motion_of, k)).collect();
    let reduced_count = exprs.len();
    for row in &motion_of.multiplier_constraints {
        exprs.extend((0..n).map(|i| row.row.iter().find(|(shaft, _)| *shaft == i).map_or(zero, |(_, entry)| *entry)));
    }
    let found = drawn_values(&motion_of, r, field, random, &exprs)?;
    let rank = |upto: usize| ModularMatrix::from_fn(upto, r + 1, |k, i| found[k * (r + 1) + i]).echelon(&field).1.len();
    let follows = |k: usize| rank(k + 1) == rank(k);
    let dependent: Vec<usize> = (0..count).filter(|k| follows(*k)).collect();
    let whole = |k: usize| -> Vec<Residue> { (0..n).map(|i| found[reduced_count + k * n + i]).collect() };
    let shares =
        dependent.iter().filter_map(|k| Some((*k, shares(reduced, &field, &dependent, *k, &whole)?))).collect();
    Some((dependent, shares))
}

/// The elements whose rows a multiplier constraint is a combination of, over all coordinates.
fn shares(
    reduced: &Reduced,
    field: &PrimeField,
    dependent: &[usize],
    row: usize,
    whole: &dyn Fn(usize) -> Vec<Residue>,
) -> Option<Vec<String>> {
    let equations = &reduced.equations;
    let n = equations.coordinates.len();
    let (mut names, mut all) = (Vec::new(), Vec::new());
    for constraint in &equations.constraints {
        let mut own = vec![0; n];
        for (shaft, x) in &constraint.row {
            own[*shaft] = field.rational(x)?;
        }
        names.push(constraint.element.clone());
        all.push(own);
    }
    for k in (0..row).filter(|k| !dependent.contains(k)) {
        names.push(equations.multiplier_constraints[k].element.clone());
        all.push(whole(k));
    }
    all.push(whole(row));
    // Factors with which the rows sum up to zero, the last one included.
    let columns = ModularMatrix::from_fn(n, all.len(), |i, k| all[k][i]);
    let kernel = columns.null_space(field);
    let own = (0..kernel.rows).map(|k| kernel.row(k)).find(|factors| factors[all.len() - 1] != 0)?;
    Some(names.into_iter().zip(own).filter(|(_, factor)| **factor != 0).map(|(name, _)| name).collect())
}
