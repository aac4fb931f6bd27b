//! Frobenius' test, exact: which rows of speeds are derivatives of relations between positions.
//!
//! Rows ω_k = Σ g_ki dq_i + h_k dt span a system of Pfaff; its integrable part is its last derived system, I ⊇ I′ ⊇ I″ ⊇ … until no row
//! is removed (Frobenius, J. reine angew. Math. 82, 1877; Cartan). A row lies in it if and only if it belongs to relations of positions. Its covectors Σ
//! λ_k ω_k are those that continue along a generic motion on the rows by `λ̇_k ω_k + λ_k dω_k(q̇, ·) = 0`: of these equations those
//! across the pivots give λ̇, the others, `λᵀC = 0`, and their derivatives `λᵀ(Ċ − MC) = 0`, … determine which λ continue. One derivative for each row
//! is enough: as long as a row is removed, each takes one more. The test runs along generic motions (`generic_motion`) from points that are
//! drawn, each modulo a prime that is drawn: so no model can be written to vanish there and not elsewhere.
//!
//! **A row that is removed there is removed everywhere**, where all functions are algebraic in coordinates, sines and cosines, and all numbers exact. **A row that stays there
//! stays everywhere**, but for an accident whose probability is bounded. A row with exact derivatives `∂g_i/∂q_j = ∂g_j/∂q_i` is that of a relation
//! whatever its functions are. Else it is not decided.

use std::collections::BTreeSet;

use kardan_rt::functions::powi;

use super::generic_motion::{GenericTrajectory, Point, Series, SeriesField, Value, value_at_point};
use super::generic_sizes::{Size, Sizes};
use kardan_expr::expr::{Expr, Symbol, lower};
use kardan_math::num::{ModularMatrix, PrimeField, Random, Rational, Reconstruction, Residue, random_prime};
use kardan_mechanics::equations::MultiplierLaw;
use kardan_mechanics::reduce::{Motion, Reduced};

/// The result of the test for a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Integrable {
    /// It does not vanish at a point: no relation between positions has it as its derivative. The point, as text.
    No(String),
    /// Its cross derivatives are equal, exactly: it is the derivative of a function of positions.
    Closed,
    /// It vanishes at all points drawn; how many, and a bound of the probability that it does not vanish everywhere.
    AtAllPoints(usize, f64),
    /// Why it is not decided.
    NotDecided(&'static str),
}

/// The result for all rows together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Integrals {
    /// Of each row.
    pub rows: Vec<Integrable>,
    /// How many independent relations between positions are in them, by the points.
    pub relations: Option<usize>,
    /// Sums of several rows whose coefficients are constant: factors of the rows, coefficients over the reduced coordinates.
    pub sums: Vec<Sum>,
}

/// Points that are drawn, at least.
const POINTS: usize = 3;
/// Points that are drawn for each of several sides of functions, and for all at most.
const POINTS_OF_SIDES: usize = 40;
const MOST_POINTS: usize = 640;
/// Points that a message can show; the search is for one at which a row does not vanish.
const DISPLAY_POINTS: i64 = 3;
/// How often the angles of sines may turn out to need smaller parts.
const MOST_SUBDIVISIONS: usize = 8;
/// How often a point without a root may be drawn.
const MOST_DRAWN: u64 = 80;
/// A probability of an accident above this is none to rely on.
const MOST_ACCIDENTAL: f64 = 1e-9;

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
    /// Whether a number in it is rounded.
    rounded: bool,
}

impl Rows {
    fn of(reduced: &Reduced) -> Self {
        let (first, r) = (reduced.equations.set_valued().count(), reduced.degrees_of_freedom());
        let mut motion = Motion::new(reduced);
        let count = motion.frictions.len() - first;
        let (mut entries, mut slopes) = (Vec::new(), Vec::new());
        for k in 0..count {
            let row = row_entries(reduced, &mut motion, k);
            let mut terms = vec![(row[r], Rational::ONE)];
            for i in 0..r {
                let speed = motion.graph.of_symbol(motion.symbols[r + i]);
                let product = speed.map(|speed| motion.graph.multiply(row[i], speed));
                terms.extend(product.map(|product| (product, Rational::ONE)));
            }
            entries.extend(row);
            let all = motion.graph.sum(Rational::ZERO, &terms);
            for i in 0..r {
                slopes.push(motion.graph.derivative(all, motion.symbols[i]));
            }
        }
        let timed = motion.timed.symbols(&motion.graph);
        let rounded = reduced.equations.multiplier_constraints.iter().any(|constraint| constraint.law.is_rounded());
        Self { motion, count, r, entries, slopes, timed, rounded }
    }

    /// Whether `∂g_i/∂q_j = ∂g_j/∂q_i` of a row, the time among the coordinates, for the expressions in their given form.
    fn is_closed(&mut self, row: usize) -> bool {
        let entries = self.entries[row * (self.r + 1)..(row + 1) * (self.r + 1)].to_vec();
        let graph = &mut self.motion.graph;
        let time = self.motion.timed.time.and_then(|time| graph.symbol_of(time));
        if graph.symbols(&entries).iter().any(|symbol| self.timed.contains(symbol) && Some(*symbol) != time) {
            return false;
        }
        let zero = graph.integer(0);
        let mut slope = |of: usize, by: usize| match if by < self.r { Some(self.motion.symbols[by]) } else { time } {
            Some(symbol) => graph.derivative(entries[of], symbol),
            None => zero,
        };
        let pairs = (0..=self.r).flat_map(|i| (0..i).map(move |j| (i, j)));
        let crosswise: Vec<[Expr; 2]> = pairs.map(|(i, j)| [slope(i, j), slope(j, i)]).collect();
        crosswise.into_iter().all(|[one, other]| {
            let difference = graph.subtract(one, other);
            graph.is_zero(difference)
        })
    }

    /// A bound of the probability that a nonzero test value vanishes at so many points.
    ///
    /// c rows times their common denominators are polynomials of degree d at most, with sums of sizes below 2^h; a derivative adds e at most to
    /// a degree. Pivots are minors of degree c d, so the speeds along the motion have degree c d + 1, what is removed at once
    /// (2c + 1) d + e + 1, after k derivatives no more than (k + 1)(3c + 2)(d + e + 2), and minors of c of them c times that, all over powers of
    /// the pivots, which are not zero there. A polynomial of degree N vanishes at a point drawn modulo p with a probability of N / p (Schwartz,
    /// J. ACM 27, 1980); modulo a prime all its coefficients vanish only if the prime divides one of them, which is so of few.
    fn accident(&self, points: usize, sides: f64) -> f64 {
        let mut sizes = Sizes { coordinates: self.r + 1, ..Sizes::default() };
        let all: Vec<Expr> = self.entries.iter().chain(&self.slopes).copied().collect();
        let found = lower(&self.motion.graph, &all, &mut sizes, |_| Size::DRAWN);
        let of_rows = found.chunks(self.r.max(1));
        let degree = of_rows.clone().map(|row| row.iter().map(|size| size.degree()).sum::<f64>()).fold(1.0, f64::max);
        let bits = of_rows.map(|row| row.iter().map(|size| size.bits).sum::<f64>()).fold(1.0, f64::max);
        let c = self.count as f64;
        let grows = 2.0 + sizes.grows;
        let steps = c * (c + 1.0) * (3.0 * c + 2.0);
        let doubled = powi(2.0, sizes.roots);
        let degree = doubled * steps * (degree + grows + 2.0);
        let bits = doubled * steps * (bits + 64.0) + 64.0 * degree;
        let each = degree / powi(2.0, 60) + bits / 60.0 / PrimeField::CHOICES;
        // Each point has a prime of its own; each side of a function occurs but for an accident.
        let missed = if sides > 1.0 { sides * powi(1.0 - 1.0 / sides, points as i32) } else { 0.0 };
        (powi(each.min(1.0), points as i32) + missed).min(1.0)
    }

    /// Expressions along a motion; none where a function is not known there.
    fn at(&self, trajectory: &mut GenericTrajectory, exprs: &[Expr]) -> Option<Vec<Series>> {
        values(&self.motion, trajectory, exprs)
    }

    /// Numbers of rows that are independent at a point, and the coordinates that they determine.
    fn independent(&self, trajectory: &mut GenericTrajectory) -> Option<(Vec<usize>, Vec<usize>)> {
        let (r, values) = (self.r, self.at(trajectory, &self.entries)?);
        let field = &trajectory.field.0;
        let at = |k: usize, i: usize| values[k * (r + 1) + i][0];
        let (_, own) = ModularMatrix::from_fn(r, self.count, |i, k| at(k, i)).echelon(field);
        let (_, pivots) = ModularMatrix::from_fn(own.len(), r, |k, i| at(own[k], i)).echelon(field);
        Some((own, pivots))
    }

    /// A generic motion on these rows, for as many coefficients.
    fn follow(&self, trajectory: &mut GenericTrajectory, own: &[usize], pivots: &[usize], terms: usize) -> Option<()> {
        let field = trajectory.field;
        let mut random = trajectory.point.random("motion");
        for n in 1..terms {
            let values = self.at(trajectory, &self.entries)?;
            let [form, _] = self.solved(field, &values, own, pivots)?;
            for k in (0..=self.r).filter(|k| !pivots.contains(k)) {
                let free = if k == self.r { u64::from(n == 1) } else { random.next_u64() };
                trajectory.motion[k].push(field.0.element(free));
            }
            let over = field.0.inverse(field.0.element(n as u64));
            let rates: Vec<Option<Series>> =
                trajectory.motion.iter().map(|x| (x.len() > n).then(|| field.derivative(x))).collect();
            for (a, pivot) in pivots.iter().enumerate() {
                let mut rate = 0;
                for (i, x) in rates.iter().enumerate() {
                    let Some(x) = x else { continue };
                    rate = field.0.minus(rate, field.product(&form[a][i], x)[n - 1]);
                }
                trajectory.motion[*pivot].push(field.0.times(rate, over));
            }
        }
        Some(())
    }

    /// Independent rows with their pivots alone, and what makes them from the rows.
    fn solved(
        &self,
        field: SeriesField,
        values: &[Series],
        own: &[usize],
        pivots: &[usize],
    ) -> Option<[Vec<Vec<Series>>; 2]> {
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
            for target in (0..count).filter(|k| *k != a) {
                let factor = rows[target][*pivot].clone();
                for (x, y) in rows[target].iter_mut().zip(&row).filter(|(_, y)| y.iter().any(|y| *y != 0)) {
                    *x = field.difference(x, &field.product(&factor, y));
                }
            }
        }
        let form = rows.iter().map(|row| row[..width].to_vec()).collect();
        let transform = rows.into_iter().map(|row| row[width..].to_vec()).collect();
        Some([form, transform])
    }

    /// A basis of the λ over the rows whose covectors stay in the system, at one point.
    fn last_derived(&self, trajectory: &mut GenericTrajectory) -> Option<Found> {
        let (own, pivots) = self.independent(trajectory)?;
        let (c, r, width) = (own.len(), self.r, self.r + 1);
        self.follow(trajectory, &own, &pivots, c + 2)?;
        let field = trajectory.field;
        let entries = self.at(trajectory, &self.entries)?;
        let slopes = self.at(trajectory, &self.slopes)?;
        let [form, transform] = self.solved(field, &entries, &own, &pivots)?;
        let rest = |k: usize, i: usize| {
            field.difference(&field.derivative(&entries[own[k] * width + i]), &slopes[own[k] * r + i])
        };
        let open: Vec<usize> = (0..r).filter(|i| !pivots.contains(i)).collect();
        // λ̇ᵀ = −λᵀ M, and λᵀ C = 0.
        let across: Vec<Vec<Series>> = (0..c).map(|k| pivots.iter().map(|i| rest(k, *i)).collect()).collect();
        let m = multiply(field, &across, &transform);
        let open_form: Vec<Vec<Series>> =
            form.iter().map(|row| open.iter().map(|i| row[*i].clone()).collect()).collect();
        let mut falls: Vec<Vec<Series>> = (0..c).map(|k| open.iter().map(|i| rest(k, *i)).collect()).collect();
        subtract(field, &mut falls, &multiply(field, &across, &open_form));
        let mut columns: Vec<Vec<Residue>> = Vec::new();
        for _ in 0..c {
            columns.extend((0..open.len()).map(|j| falls.iter().map(|row| row[j][0]).collect()));
            let mut next: Vec<Vec<Series>> =
                falls.iter().map(|row| row.iter().map(|x| field.derivative(x)).collect()).collect();
            subtract(field, &mut next, &multiply(field, &m, &falls));
            falls = next;
        }
        let tangent = ModularMatrix::from_fn(columns.len(), c, |k, j| columns[k][j]);
        let kernel =
            if columns.is_empty() { ModularMatrix::identity(&field.0, c) } else { tangent.null_space(&field.0) };
        Some(Found::new(&field.0, self.count, width, &own, &kernel, &entries))
    }
}

/// A row of a multiplier constraint: g over the reduced coordinates, then h.
pub(super) fn row_entries(reduced: &Reduced, motion: &mut Motion, k: usize) -> Vec<Expr> {
    let zero = motion.graph.integer(0);
    let own = &motion.frictions[motion.frictions.len() - motion.multiplier_constraints.len() + k];
    let on_coordinates = (0..reduced.degrees_of_freedom()).map(|i| own.get(&i).copied().unwrap_or(zero));
    let mut row: Vec<Expr> = on_coordinates.collect();
    let carried = motion.sum_over_multiplier(k, |motion, shaft| motion.carried[shaft]);
    row.push(match reduced.equations.multiplier_constraints[k].law {
        // An integral of the prescribed function, with any speed at the start.
        MultiplierLaw::Prescribed { order: 2, .. } => motion.graph.integer(1),
        _ => motion.graph.subtract(carried, motion.multiplier_constraints[k].rate),
    });
    row
}

/// Expressions of a model along a motion; none where a function is not known there.
fn values(motion: &Motion, trajectory: &mut GenericTrajectory, exprs: &[Expr]) -> Option<Vec<Series>> {
    let (graph, r) = (&motion.graph, trajectory.motion.len() - 1);
    let time = motion.timed.time.and_then(|time| graph.symbol_of(time));
    let timed = motion.timed.symbols(graph);
    let derivatives: Vec<Value> = (0..=r).map(|k| trajectory.coordinate(k)).collect();
    let (field, terms, point) = (trajectory.field, trajectory.terms(), trajectory.point);
    let used_rate = std::cell::Cell::new(false);
    let symbol = |symbol: Symbol| {
        if let Some(k) = motion.symbols.iter().position(|own| *own == symbol) {
            let rate = || field.derivative(&derivatives[k - r].series);
            return Some(if k < r { derivatives[k].clone() } else { Value::of(rate()) });
        }
        if Some(symbol) == time {
            return Some(derivatives[r].clone());
        }
        // A function of time, or the output of a block: any.
        let number = timed.iter().position(|own| *own == symbol)? as u64;
        let mut random = point.random(&format!("function {number}"));
        used_rate.set(true);
        Some(Value::of((0..terms).map(|_| field.0.element(random.next_u64())).collect()))
    };
    let found = lower(graph, exprs, trajectory, symbol);
    trajectory.loose |= used_rate.get();
    found.into_iter().map(|value| Some(value?.series)).collect()
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

/// The integrable part at a point.
struct Found {
    /// A basis of factors of the rows.
    factors: Vec<Vec<Residue>>,
    /// Whether each row is in its span.
    satisfied: Vec<bool>,
    /// How many rows are independent there.
    rank: usize,
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
        let spanned = kernel.rows;
        let mut factors = vec![vec![0; count]; spanned];
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
        let satisfied = |k: usize| {
            let last = row(k);
            let all =
                ModularMatrix::from_fn(spanned + 1, width, |i, j| if i < spanned { covectors[i][j] } else { last[j] });
            all.echelon(field).1.len() == spanned
        };
        Self { satisfied: (0..count).map(satisfied).collect(), factors, rank: own.len() }
    }

    /// The factors that are small fractions.
    fn fractions(&self, field: &PrimeField) -> Vec<Vec<Rational>> {
        let of = |factors: &Vec<Residue>| {
            let mut reconstruction = Reconstruction::new();
            reconstruction.add(field.prime(), &factors.iter().map(|x| field.value(*x)).collect::<Vec<_>>());
            reconstruction.fractions()
        };
        self.factors.iter().filter_map(of).collect()
    }
}

/// A field of a prime that is drawn, with roots by a power.
pub(super) fn drawn_field(random: &mut Random) -> PrimeField {
    let mut primes = std::iter::repeat_with(|| random_prime(random));
    PrimeField::new(primes.find(|prime| prime % 4 == 3).unwrap_or(3))
}

/// The test of the multiplier constraints of a model, all together; the time is one of the variables.
pub(super) fn integrable(reduced: &Reduced) -> Integrals {
    let mut rows = Rows::of(reduced);
    if rows.count == 0 {
        return Integrals { rows: Vec::new(), relations: Some(0), sums: Vec::new() };
    }
    let closed: Vec<bool> = (0..rows.count).map(|row| rows.is_closed(row)).collect();
    let mut random = Random::unforeseen(rows.entries.len() as u64);
    let (mut points, mut needed, mut sides) = (Vec::new(), POINTS, 1);
    while points.len() < needed {
        let field = drawn_field(&mut random);
        let found = (0..MOST_DRAWN).find_map(|_| at_point(&rows, field, Point::Drawn(random.next_u64())));
        let Some((trajectory, point)) = found else { break };
        sides = sides.max(trajectory.sides.values().product());
        needed = needed.max(if sides > 1 { sides.saturating_mul(POINTS_OF_SIDES) } else { POINTS });
        points.push((trajectory, point));
        if needed > MOST_POINTS {
            break;
        }
    }
    let complete = points.len() >= needed;
    // Where fewer rows are independent than elsewhere the test is not decided.
    let rank = points.iter().map(|(_, point)| point.rank).max().unwrap_or(0);
    points.retain(|(_, point)| point.rank == rank);
    let accident = if complete { rows.accident(points.len(), sides as f64) } else { 1.0 };
    let display_field = drawn_field(&mut random);
    let mut display_points = None;
    let mut of_row = |row: usize| -> Integrable {
        if closed[row] {
            return Integrable::Closed;
        }
        match points.iter().find(|(_, point)| !point.satisfied[row]) {
            None if accident < MOST_ACCIDENTAL => Integrable::AtAllPoints(points.len(), accident),
            None => Integrable::NotDecided("a function in it has no value at the random points, or too many branches"),
            Some((trajectory, _)) if trajectory.loose => {
                Integrable::NotDecided("a function in it is not algebraic in coordinates, sines and cosines")
            }
            Some(_) if rows.rounded => Integrable::NotDecided("a number in it is rounded to 16 digits"),
            Some(_) => {
                let at = |number| at_point(&rows, display_field, Point::Display(number));
                let points =
                    display_points.get_or_insert_with(|| (0..DISPLAY_POINTS).filter_map(at).collect::<Vec<_>>());
                let found = points.iter_mut().find(|(_, point)| point.rank == rank && !point.satisfied[row]);
                let text = found.map(|(trajectory, _)| describe(&rows, trajectory));
                Integrable::No(text.unwrap_or_else(|| "drawn modulo a prime".into()))
            }
        }
    };
    let found: Vec<Integrable> = (0..rows.count).map(&mut of_row).collect();
    let is_decided = accident < MOST_ACCIDENTAL && !found.iter().any(|one| matches!(one, Integrable::NotDecided(_)));
    let relations = points.iter().map(|(_, point)| point.factors.len()).min().filter(|_| is_decided);
    let mut bases = points.iter().map(|(trajectory, point)| point.fractions(&trajectory.field.0));
    let first = bases.next().unwrap_or_default();
    let further_bases: Vec<Vec<Vec<Rational>>> = bases.collect();
    let same = first.iter().filter(|factors| further_bases.iter().all(|basis| basis.contains(factors)));
    let several = same.filter(|factors| factors.iter().filter(|factor| !factor.is_zero()).count() > 1);
    let sums = several.filter_map(|factors| sum_of_rows(&rows, factors)).collect();
    Integrals { rows: found, relations, sums }
}

/// Expressions of a model at a point that is drawn.
pub(super) fn drawn_values(
    motion: &Motion,
    r: usize,
    field: PrimeField,
    random: &mut Random,
    exprs: &[Expr],
) -> Option<Vec<Residue>> {
    let at_one = |_| {
        let point = Point::Drawn(random.next_u64());
        let (_, found) = at_subdivided(field, point, r, |trajectory| values(motion, trajectory, exprs))?;
        found.into_iter().map(|series| series.first().copied()).collect()
    };
    (0..MOST_DRAWN).find_map(at_one)
}

/// The test at one point, with the motion that it took.
fn at_point(rows: &Rows, field: PrimeField, point: Point) -> Option<(GenericTrajectory, Found)> {
    at_subdivided(field, point, rows.r, |trajectory| rows.last_derived(trajectory))
}

/// What is found along a motion from a point, whose angles are divided as often as it needs smaller parts of them.
fn at_subdivided<T>(
    field: PrimeField,
    point: Point,
    r: usize,
    find: impl Fn(&mut GenericTrajectory) -> Option<T>,
) -> Option<(GenericTrajectory, T)> {
    let mut trajectory = GenericTrajectory::new(field, point, r);
    for _ in 0..MOST_SUBDIVISIONS {
        if let Some(found) = find(&mut trajectory) {
            return Some((trajectory, found));
        }
        if !trajectory.subdivided {
            return None;
        }
        trajectory.begin_again();
    }
    None
}

/// A sum of rows, if its coefficients are numbers.
fn sum_of_rows(rows: &Rows, factors: &[Rational]) -> Option<Sum> {
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
    Some((factors.to_vec(), out))
}

/// Factors of the rows, and what they are together: a row over the coordinates.
pub type Sum = (Vec<Rational>, Vec<(usize, Rational)>);

/// A point by the numbers that the rows take there.
fn describe(rows: &Rows, trajectory: &mut GenericTrajectory) -> String {
    let (graph, point) = (&rows.motion.graph, trajectory.point);
    let all: Vec<Expr> = rows.entries.iter().chain(&rows.slopes).copied().collect();
    let used: BTreeSet<Symbol> = graph.symbols(&all).into_iter().collect();
    let values = rows.at(trajectory, &rows.entries);
    let mut conditions = Vec::new();
    for i in 0..=rows.r {
        let symbol = if i < rows.r {
            Some(rows.motion.symbols[i])
        } else {
            rows.motion.timed.time.and_then(|time| graph.symbol_of(time))
        };
        let Some(symbol) = symbol.filter(|symbol| used.contains(symbol)) else { continue };
        let name = graph.name(symbol).0.to_string();
        let before = trajectory.motion[i].clone();
        trajectory.motion[i][0] = trajectory.field.0.plus(before[0], trajectory.field.0.one());
        let by_itself = rows.at(trajectory, &rows.entries) != values;
        trajectory.motion[i] = before;
        let Point::Display(number) = point else { continue };
        let own = format!("{name} = {}", value_at_point(number, i));
        let tangents = trajectory.tangents(i, &name).join(", ");
        conditions.push(match (by_itself, tangents.is_empty()) {
            (false, _) => tangents,
            (true, true) => own,
            // No relation over the rationals ties an angle to its tangent.
            (true, false) => format!("{own} and, as a number of its own, {tangents}"),
        });
    }
    conditions.retain(|conditions| !conditions.is_empty());
    conditions.join(", ")
}
