//! Frobenius' test, exact: which rows of speeds are derivatives of relations between positions.
//!
//! Rows ω_k = Σ g_ki dq_i + h_k dt span a system of Pfaff; what is integrable in it is its last derived system, I ⊇ I′ ⊇ I″ ⊇ … until nothing
//! falls away (Frobenius, J. reine angew. Math. 82, 1877; Cartan). A row lies in it if and only if it belongs to relations of positions. Its
//! covectors Σ λ_k ω_k are those that go on along a generic motion on the rows by `λ̇_k ω_k + λ_k dω_k(q̇, ·) = 0`: of these equations those
//! across the pivots give λ̇, the others, `λᵀC = 0`, and their derivatives `λᵀ(Ċ − MC) = 0`, … say which λ go on. One derivative for each row
//! is enough: as long as anything falls away, each takes one more. All of it is tried at generic points, along generic motions
//! (`generic_motion`): what falls away there falls away.

use std::collections::BTreeSet;

use super::generic_motion::{Along, Series, SeriesField, Value, value_there};
use crate::equations::Kept;
use crate::expr::{Expr, Symbol, lower};
use crate::num::{ModularMatrix, PrimeField, Random, Rational, Reconstruction, Residue, prime_below};
use crate::reduce::{Motion, Reduced};

/// What the test found of a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Integrable {
    /// It does not vanish at a point: no relation of positions has it as its derivative. The point, in words.
    No(String),
    /// It vanishes at all points tried, exactly; so many.
    AtAllPoints(usize),
    /// Some function in it is not known at rational points.
    NotDecided,
}

/// What was found of all rows together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Integrals {
    /// Of each row.
    pub rows: Vec<Integrable>,
    /// How many independent relations of positions are in them, as far as the points tell.
    pub relations: Option<usize>,
    /// Sums of several rows whose coefficients are constant: factors of the rows, coefficients over the reduced coordinates.
    pub sums: Vec<Sum>,
}

/// Generic points that are tried.
const POINTS: i64 = 3;
/// How often the angles of sines may turn out to need smaller parts.
const MOST_PARTED: usize = 8;

/// The rows of a model as a system of Pfaff.
struct Rows {
    motion: Motion,
    count: usize,
    r: usize,
    /// g over the coordinates, then h, row by row.
    entries: Vec<Expr>,
    /// ∂/∂q_i of `Σ g_kj q̇_j + h_k`, row by row.
    slopes: Vec<Expr>,
    timed: Vec<Symbol>,
}

impl Rows {
    fn of(reduced: &Reduced) -> Self {
        let (first, r) = (reduced.equations.set_valued().count(), reduced.degrees_of_freedom());
        let mut motion = Motion::new(reduced);
        let rows = motion.frictions[first..].to_vec();
        let (zero, count) = (motion.graph.integer(0), rows.len());
        let (mut entries, mut slopes) = (Vec::new(), Vec::new());
        for (k, row) in rows.iter().enumerate() {
            entries.extend((0..r).map(|i| row.get(&i).copied().unwrap_or(zero)));
            let carried = motion.along_kept(k, |motion, shaft| motion.carried[shaft]);
            let by_time = match reduced.equations.kept[k].law {
                // An integral of what is prescribed, with any speed at the start.
                Kept::Acceleration(..) => motion.graph.integer(1),
                _ => motion.graph.subtract(carried, motion.kept[k].rate),
            };
            let mut terms = vec![(by_time, Rational::ONE)];
            for i in 0..r {
                let speed = motion.graph.of_symbol(motion.symbols[r + i]);
                let product = speed.map(|speed| motion.graph.multiply(entries[k * (r + 1) + i], speed));
                terms.extend(product.map(|product| (product, Rational::ONE)));
            }
            entries.push(by_time);
            let all = motion.graph.sum(Rational::ZERO, &terms);
            for i in 0..r {
                slopes.push(motion.graph.derivative(all, motion.symbols[i]));
            }
        }
        let timed = motion.timed.symbols(&motion.graph);
        Self { motion, count, r, entries, slopes, timed }
    }

    /// Expressions along a motion; none where a function is not known there.
    fn at(&self, along: &mut Along, exprs: &[Expr]) -> Option<Vec<Series>> {
        let (graph, time) = (&self.motion.graph, self.motion.timed.time);
        let time = time.and_then(|time| graph.symbol_of(time));
        let known: Vec<Value> = (0..=self.r).map(|k| along.coordinate(k)).collect();
        let (field, terms, point) = (along.field, along.terms(), along.point);
        let symbol = |symbol: Symbol| {
            if let Some(k) = self.motion.symbols.iter().position(|own| *own == symbol) {
                let rate = || field.derivative(&known[k - self.r].series);
                return Some(if k < self.r { known[k].clone() } else { Value::of(rate()) });
            }
            if Some(symbol) == time {
                return Some(known[self.r].clone());
            }
            // A function of time, or what a block answers: any.
            let number = self.timed.iter().position(|own| *own == symbol)? as u64;
            let mut random = Random::named(point as u64, &format!("function {number}"));
            Some(Value::of((0..terms).map(|_| field.0.element(random.next_u64())).collect()))
        };
        lower(graph, exprs, along, symbol).into_iter().map(|value| Some(value?.series)).collect()
    }

    /// Numbers of rows that are independent at a point, and the coordinates that they determine.
    fn independent(&self, along: &mut Along) -> Option<(Vec<usize>, Vec<usize>)> {
        let (r, values) = (self.r, self.at(along, &self.entries)?);
        let field = &along.field.0;
        let at = |k: usize, i: usize| values[k * (r + 1) + i][0];
        let (_, own) = ModularMatrix::from_fn(r, self.count, |i, k| at(k, i)).echelon(field);
        let (_, pivots) = ModularMatrix::from_fn(own.len(), r, |k, i| at(own[k], i)).echelon(field);
        Some((own, pivots))
    }

    /// A generic motion on these rows, for as many coefficients.
    fn follow(&self, along: &mut Along, own: &[usize], pivots: &[usize], terms: usize) -> Option<()> {
        let field = along.field;
        let mut random = Random::named(along.point as u64, "motion");
        for n in 1..terms {
            let values = self.at(along, &self.entries)?;
            let solved = self.solved(field, &values, own, pivots)?;
            for k in (0..=self.r).filter(|k| !pivots.contains(k)) {
                let free = if k == self.r { u64::from(n == 1) } else { random.next_u64() };
                along.motion[k].push(field.0.element(free));
            }
            let over = field.0.inverse(field.0.element(n as u64));
            let rates: Vec<Option<Series>> =
                along.motion.iter().map(|x| (x.len() > n).then(|| field.derivative(x))).collect();
            for (a, pivot) in pivots.iter().enumerate() {
                let mut rate = 0;
                for (i, x) in rates.iter().enumerate() {
                    let Some(x) = x else { continue };
                    rate = field.0.minus(rate, field.product(&solved.form[a][i], x)[n - 1]);
                }
                along.motion[*pivot].push(field.0.times(rate, over));
            }
        }
        Some(())
    }

    /// Independent rows with their pivots alone, and what makes them from the rows.
    fn solved(&self, field: SeriesField, values: &[Series], own: &[usize], pivots: &[usize]) -> Option<Solved> {
        let (width, count) = (self.r + 1, own.len());
        let terms = values[0].len();
        let unit = |k: usize, j: usize| field.number(if k == j { field.0.one() } else { 0 }, terms);
        let mut rows: Vec<Vec<Series>> = Vec::new();
        for (k, row) in own.iter().enumerate() {
            rows.push(
                values[row * width..(row + 1) * width].iter().cloned().chain((0..count).map(|j| unit(k, j))).collect(),
            );
        }
        for (a, pivot) in pivots.iter().enumerate() {
            let next = (a..count).find(|k| rows[*k][*pivot][0] != 0)?;
            rows.swap(a, next);
            let inverse = field.inverse(&rows[a][*pivot])?;
            rows[a].iter_mut().for_each(|x| *x = field.product(x, &inverse));
            let row = rows[a].clone();
            for other in (0..count).filter(|k| *k != a) {
                let factor = rows[other][*pivot].clone();
                for (x, y) in rows[other].iter_mut().zip(&row).filter(|(_, y)| y.iter().any(|y| *y != 0)) {
                    *x = field.difference(x, &field.product(&factor, y));
                }
            }
        }
        let form = rows.iter().map(|row| row[..width].to_vec()).collect();
        let transform = rows.into_iter().map(|row| row[width..].to_vec()).collect();
        Some(Solved { form, transform })
    }

    /// A basis of the λ over the rows whose covectors stay in the system, at one point.
    fn last_derived(&self, along: &mut Along) -> Option<Found> {
        let (own, pivots) = self.independent(along)?;
        let (c, r, width) = (own.len(), self.r, self.r + 1);
        self.follow(along, &own, &pivots, c + 2)?;
        let field = along.field;
        let entries = self.at(along, &self.entries)?;
        let slopes = self.at(along, &self.slopes)?;
        let solved = self.solved(field, &entries, &own, &pivots)?;
        let rest = |k: usize, i: usize| {
            field.difference(&field.derivative(&entries[own[k] * width + i]), &slopes[own[k] * r + i])
        };
        let open: Vec<usize> = (0..r).filter(|i| !pivots.contains(i)).collect();
        // λ̇ᵀ = −λᵀ M, and λᵀ C = 0.
        let across: Vec<Vec<Series>> = (0..c).map(|k| pivots.iter().map(|i| rest(k, *i)).collect()).collect();
        let m = multiply(field, &across, &solved.transform);
        let along_open: Vec<Vec<Series>> =
            solved.form.iter().map(|row| open.iter().map(|i| row[*i].clone()).collect()).collect();
        let mut falls: Vec<Vec<Series>> = (0..c).map(|k| open.iter().map(|i| rest(k, *i)).collect()).collect();
        subtract(field, &mut falls, &multiply(field, &across, &along_open));
        let mut columns: Vec<Vec<Residue>> = Vec::new();
        for _ in 0..c {
            columns.extend((0..open.len()).map(|j| falls.iter().map(|row| row[j][0]).collect()));
            let mut next: Vec<Vec<Series>> =
                falls.iter().map(|row| row.iter().map(|x| field.derivative(x)).collect()).collect();
            subtract(field, &mut next, &multiply(field, &m, &falls));
            falls = next;
        }
        let there = ModularMatrix::from_fn(columns.len(), c, |k, j| columns[k][j]);
        let kernel = if columns.is_empty() { ModularMatrix::identity(&field.0, c) } else { there.null_space(&field.0) };
        Some(Found::new(&field.0, self.count, width, &own, &kernel, &entries))
    }
}

/// What [`Rows::solved`] gives.
struct Solved {
    form: Vec<Vec<Series>>,
    transform: Vec<Vec<Series>>,
}

fn multiply(field: SeriesField, a: &[Vec<Series>], b: &[Vec<Series>]) -> Vec<Vec<Series>> {
    let columns = b.first().map_or(0, Vec::len);
    let entry = |row: &Vec<Series>, j: usize| {
        let products = row.iter().zip(b).map(|(x, other)| field.product(x, &other[j]));
        products.reduce(|sum, product| field.sum(&sum, &product)).unwrap_or_default()
    };
    a.iter().map(|row| (0..columns).map(|j| entry(row, j)).collect()).collect()
}

fn subtract(field: SeriesField, from: &mut [Vec<Series>], other: &[Vec<Series>]) {
    let entries = from.iter_mut().flatten().zip(other.iter().flatten());
    entries.for_each(|(x, y)| *x = field.difference(x, y));
}

/// What is integrable at a point.
struct Found {
    /// A basis of factors of the rows.
    factors: Vec<Vec<Residue>>,
    /// Whether each row is among what it spans.
    holds: Vec<bool>,
}

impl Found {
    fn new(
        field: &PrimeField,
        count: usize,
        width: usize,
        own: &[usize],
        kernel: &ModularMatrix,
        entries: &[Series],
    ) -> Self {
        let rank = kernel.rows;
        let mut factors = vec![vec![0; count]; rank];
        for (k, factors) in factors.iter_mut().enumerate() {
            own.iter().zip(kernel.row(k)).for_each(|(row, factor)| factors[*row] = *factor);
        }
        let row = |k: usize| -> Vec<Residue> { (0..width).map(|i| entries[k * width + i][0]).collect() };
        let mut covectors: Vec<Vec<Residue>> = Vec::new();
        for factors in &factors {
            let mut sum = vec![0; width];
            for (k, factor) in factors.iter().enumerate() {
                sum.iter_mut().zip(row(k)).for_each(|(x, y)| *x = field.plus(*x, field.times(*factor, y)));
            }
            covectors.push(sum);
        }
        let holds = |k: usize| {
            let last = row(k);
            let all = ModularMatrix::from_fn(rank + 1, width, |i, j| if i < rank { covectors[i][j] } else { last[j] });
            all.echelon(field).1.len() == rank
        };
        Self { holds: (0..count).map(holds).collect(), factors }
    }
}

/// The test of the kept rows of a model, all together; the time is one of the variables.
pub(super) fn integrable(reduced: &Reduced) -> Integrals {
    let rows = Rows::of(reduced);
    let prime = prime_below(1 << 61);
    let field = PrimeField::new(prime);
    let mut found = vec![Integrable::AtAllPoints(POINTS as usize); rows.count];
    if rows.count == 0 {
        return Integrals { rows: found, relations: Some(0), sums: Vec::new() };
    }
    let mut bases: Vec<Vec<Vec<Residue>>> = Vec::new();
    for point in 0..POINTS {
        let Some((mut along, there)) = at_point(&rows, field, point) else {
            let rows = vec![Integrable::NotDecided; rows.count];
            return Integrals { rows, relations: None, sums: Vec::new() };
        };
        for (found, _) in found.iter_mut().zip(&there.holds).filter(|(_, holds)| !**holds) {
            if *found == Integrable::AtAllPoints(POINTS as usize) {
                *found = Integrable::No(in_words(&rows, &mut along));
            }
        }
        bases.push(there.factors);
    }
    let relations = bases.iter().map(Vec::len).min();
    let first = bases.first().map_or(&[][..], Vec::as_slice);
    let same = first.iter().filter(|factors| bases.iter().all(|basis| basis.contains(factors)));
    let several = same.filter(|factors| factors.iter().filter(|factor| **factor != 0).count() > 1);
    let sums = several.filter_map(|factors| sum_of_rows(&rows, &field, factors)).collect();
    Integrals { rows: found, relations, sums }
}

/// The test at one point, with the motion that it took.
fn at_point(rows: &Rows, field: PrimeField, point: i64) -> Option<(Along, Found)> {
    let mut along = Along::new(field, point, rows.r);
    for _ in 0..MOST_PARTED {
        let found = rows.last_derived(&mut along);
        if let Some(found) = found {
            return Some((along, found));
        }
        if !along.parted {
            return None;
        }
        along.begin_again();
    }
    None
}

/// A sum of rows, if its coefficients are numbers.
fn sum_of_rows(rows: &Rows, field: &PrimeField, factors: &[Residue]) -> Option<Sum> {
    let mut known = Reconstruction::new();
    known.add(field.prime(), &factors.iter().map(|x| field.value(*x)).collect::<Vec<_>>());
    let factors = known.fractions()?;
    let mut graph = rows.motion.graph.clone();
    let mut out = Vec::new();
    for i in 0..=rows.r {
        let terms: Vec<(Expr, Rational)> = factors
            .iter()
            .enumerate()
            .map(|(k, factor)| (rows.entries[k * (rows.r + 1) + i], factor.clone()))
            .collect();
        let sum = graph.sum(Rational::ZERO, &terms);
        let number = graph.number_of(sum)?.clone();
        match i == rows.r {
            true if !number.is_zero() => return None,
            false if !number.is_zero() => out.push((i, number)),
            _ => {}
        }
    }
    Some((factors, out))
}

/// Factors of the rows, and what they are together: a row over the coordinates.
pub type Sum = (Vec<Rational>, Vec<(usize, Rational)>);

/// A point by the numbers that the rows take there.
fn in_words(rows: &Rows, along: &mut Along) -> String {
    let (graph, point) = (&rows.motion.graph, along.point);
    let all: Vec<Expr> = rows.entries.iter().chain(&rows.slopes).copied().collect();
    let used: BTreeSet<Symbol> = graph.symbols(&all).into_iter().collect();
    let values = rows.at(along, &rows.entries);
    let mut words = Vec::new();
    for i in 0..=rows.r {
        let symbol = if i < rows.r {
            Some(rows.motion.symbols[i])
        } else {
            rows.motion.timed.time.and_then(|time| graph.symbol_of(time))
        };
        let Some(symbol) = symbol.filter(|symbol| used.contains(symbol)) else { continue };
        let name = graph.name(symbol).0.to_string();
        let before = along.motion[i].clone();
        along.motion[i][0] = along.field.0.plus(before[0], along.field.0.one());
        let by_itself = rows.at(along, &rows.entries) != values;
        along.motion[i] = before;
        let own = format!("{name} = {}", value_there(point, i));
        let tangents = along.tangents(i, &name).join(", ");
        words.push(match (by_itself, tangents.is_empty()) {
            (false, _) => tangents,
            (true, true) => own,
            // No relation over the rationals ties an angle to its tangent.
            (true, false) => format!("{own} and, as a number of its own, {tangents}"),
        });
    }
    words.retain(|words| !words.is_empty());
    words.join(", ")
}
