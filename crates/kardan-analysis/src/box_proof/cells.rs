//! A cell: a left inverse in its middle, and the bound of what is left of the family over it, rounding included.

use faer::c64;
use kardan_rt::functions::powi;

use super::scaled_family::{LARGEST_INVERSE, Scaled, Term};

/// More than all that underflows in an entry of G.
const UNDERFLOW: f64 = 1.0e-90;

pub(super) enum Verdict {
    Proven,
    Open,
    /// No left inverse was found.
    Singular,
}

/// The terms of one part in one column.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    pub(super) column: usize,
    /// Where its terms lie in the list of all terms of the centre or of the slopes.
    terms: std::ops::Range<usize>,
    /// Its rows, each once.
    rows: Vec<usize>,
    /// The power of all its terms, if they have the same.
    single: Option<usize>,
}

/// The term of a polynomial in λ (or μ) in one row of a column.
#[derive(Debug, Clone, Copy)]
struct Entry {
    row: usize,
    power: usize,
    /// For a slope: the entry of the centre that it changes.
    target: usize,
}

/// One polynomial, in λ or in μ, with the memory to decide cells. Matrices are stored column by column.
///
/// # Rounding
///
/// With `u = 2⁻⁵³`. Centres and half widths are dyadic numbers of at most 46 bits and `δ` is `√2` times a power of two, rounded
/// up: cells cover the square and the box without gaps. R is the stored matrix; its origin does not matter.
///
/// Exactly, an entry of G is a sum of moduli of sums of products; by N roundings along any path from a coefficient to
/// the result, the computed value differs from the exact one by at most `γ_N = N u/(1 − N u)` times the same expression
/// with every number replaced by its modulus. Those expressions add up to at most `|R| A + I` with
/// `A = Σₑ (|c| + δ)ᵉ (|Lₑ₀| + Σᵢ |Lₑᵢ|)`, since `|yᵢ| + wᵢ ≤ 1` and `Σₚ δᵖ (e over p) |c|ᵉ⁻ᵖ = (|c| + δ)ᵉ`. N counts: rounding of a
/// coefficient 1, `Lₑ(y)` q + 1, the product with R m + 1 (real times complex, so each part apart), the shift of
/// the polynomial to c four complex operations of at most 3 each, modulus 3, powers and weights 6, the sum over parts q + 3:
/// below `m + 2q + 32`. `slack` is eight times that times u; it multiplies both G and `|R| A + I`, which also covers that these
/// are themselves rounded.
///
/// Entries of L and R are below 1e60, so products and their squares do not overflow; if something does, NaN and infinity
/// fail every comparison. What underflows is below 1e-160 (the square root of the least number), even times R below 1e-100,
/// and far below [`UNDERFLOW`], which is added to every entry.
pub(super) struct Cells {
    pub(super) m: usize,
    pub(super) n: usize,
    /// Entries of the centre and their values at x = 0, at the centre of the cell, and summed moduli over the box.
    entries: Vec<Entry>,
    base: Vec<f64>,
    value: Vec<f64>,
    largest: Vec<f64>,
    columns: Vec<Column>,
    /// Entries of all slopes, and columns with the index of their parameter.
    slope_entries: Vec<Entry>,
    slope: Vec<f64>,
    pub(super) slope_columns: Vec<(usize, Column)>,
    pub(super) slack: f64,
    /// The box: y and w.
    pub(super) centre: Vec<f64>,
    pub(super) width: Vec<f64>,
    /// L(c, y), m × n.
    level: Vec<c64>,
    /// Covariance of the uncertainties of rows, its Cholesky factor, m × m.
    spread: Vec<c64>,
    /// Orthonormal columns, m × n, and the triangle, n × n.
    orthogonal: Vec<c64>,
    triangle: Vec<c64>,
    /// R, n × m.
    pub(super) inverse: Vec<c64>,
    /// One column of length m; zero between uses where entries are summed up.
    vector: Vec<c64>,
    /// R times one column of each power, 3 × n.
    product: Vec<c64>,
    /// Moduli of R, n × m.
    modulus: Vec<f64>,
    /// Parts of G, n × n: what no division makes smaller, and what λ contributes; then one column for each of `slope_columns`.
    pub(super) floor: Vec<f64>,
    pub(super) lambda: Vec<f64>,
    pub(super) slopes: Vec<f64>,
    /// G, rounding included, n × n.
    pub(super) bound: Vec<f64>,
    /// I − G during elimination, n × n.
    pub(super) triangular: Vec<f64>,
    /// Positive vectors: Perron's for G where a cell fails.
    pub(super) right: Vec<f64>,
    pub(super) left: Vec<f64>,
    pub(super) work: Vec<f64>,
    /// Contributions of the parameters and of λ (last) to the spectral radius of G.
    pub(super) contributions: Vec<f64>,
}

impl Cells {
    pub(super) fn new(scaled: &Scaled, reversed: bool) -> Self {
        let (m, n, q) = (scaled.rows, scaled.columns, scaled.parts - 1);
        let mut terms = scaled.terms.clone();
        if reversed {
            for term in &mut terms {
                let degree = scaled.row_degrees[term.row] + scaled.column_degrees[term.column] as isize;
                term.power = (degree - term.power as isize) as usize;
            }
        }
        let place = |t: &Term| (t.column, t.power, t.row);
        let mut places: Vec<_> = terms.iter().map(place).collect();
        places.sort_unstable();
        places.dedup();
        let entries: Vec<Entry> =
            places.iter().enumerate().map(|(target, &(_, power, row))| Entry { row, power, target }).collect();
        let (mut base, mut largest) = (vec![0.0; places.len()], vec![0.0; places.len()]);
        let mut slopes: Vec<(usize, usize, Entry, f64)> = Vec::new();
        for term in &terms {
            let target = places.binary_search(&place(term)).expect("every place is listed");
            largest[target] += term.value.abs();
            if term.part == 0 {
                base[target] = term.value;
            } else {
                let entry = Entry { row: term.row, power: term.power, target };
                slopes.push((term.part - 1, term.column, entry, term.value));
            }
        }
        slopes.sort_by_key(|(parameter, column, entry, _)| (*parameter, *column, entry.power, entry.row));
        let keys: Vec<(usize, usize)> = places.iter().map(|place| (0, place.0)).collect();
        let columns = grouped(&keys, &entries).into_iter().map(|(_, column)| column).collect();
        let keys: Vec<(usize, usize)> = slopes.iter().map(|(parameter, column, _, _)| (*parameter, *column)).collect();
        let slope_entries: Vec<Entry> = slopes.iter().map(|slope| slope.2).collect();
        let slope_columns = grouped(&keys, &slope_entries);
        let zero = c64::new(0.0, 0.0);
        Self {
            m,
            n,
            value: base.clone(),
            base,
            largest,
            columns,
            entries,
            slopes: vec![0.0; n * slope_columns.len()],
            slope_columns,
            slope_entries,
            slope: slopes.iter().map(|slope| slope.3).collect(),
            slack: 8.0 * (m + 2 * q + 32) as f64 * 0.5 * f64::EPSILON,
            centre: vec![0.0; q],
            width: vec![1.0; q],
            level: vec![zero; m * n],
            spread: vec![zero; m * m],
            orthogonal: vec![zero; m * n],
            triangle: vec![zero; n * n],
            inverse: vec![zero; n * m],
            vector: vec![zero; m],
            product: vec![zero; 3 * n],
            floor: vec![0.0; n * n],
            lambda: vec![0.0; n * n],
            bound: vec![0.0; n * n],
            modulus: vec![0.0; n * m],
            triangular: vec![0.0; n * n],
            right: vec![1.0; n],
            left: vec![1.0; n],
            work: vec![0.0; n],
            contributions: vec![0.0; q + 1],
        }
    }

    /// Tries to prove the cell `|Re λ − Re at| ≤ half`, `|Im λ − Im at| ≤ half` times the box.
    pub(super) fn decide(&mut self, at: c64, half: f64, scale: &[f64]) -> Verdict {
        self.value.copy_from_slice(&self.base);
        for (parameter, column) in &self.slope_columns {
            let y = self.centre[*parameter];
            for k in column.terms.clone() {
                self.value[self.slope_entries[k].target] += y * self.slope[k];
            }
        }
        let delta = std::f64::consts::SQRT_2 * half;
        if !self.left_inverse(at, delta, scale) {
            return Verdict::Singular;
        }
        self.bounds(at, delta);
        if self.is_contraction() { Verdict::Proven } else { Verdict::Open }
    }

    /// R: of all left inverses of L(c, y) the one with the least variance of `R (ΔL) scale` if each uncertainty were random.
    fn left_inverse(&mut self, at: c64, delta: f64, scale: &[f64]) -> bool {
        self.fill_level_and_spread(at, delta, scale);
        if !(cholesky(&mut self.spread, self.m) && self.orthogonalise()) {
            return false;
        }
        self.invert();
        self.inverse.iter().all(|x| x.norm_sqr() <= LARGEST_INVERSE * LARGEST_INVERSE)
    }

    /// L in the middle of the cell, and the matrix of how far its columns spread over the cell and the box.
    fn fill_level_and_spread(&mut self, at: c64, delta: f64, scale: &[f64]) {
        let m = self.m;
        let powers = [c64::new(1.0, 0.0), at, at * at];
        let derivatives = [c64::new(0.0, 0.0), c64::new(1.0, 0.0), at + at];
        let zero = c64::new(0.0, 0.0);
        self.level.fill(zero);
        self.spread.fill(zero);
        self.vector.fill(zero);
        let mut add = |vector: &mut [c64], rows: &[usize], weight: f64| {
            for (k, &i) in rows.iter().enumerate() {
                let scaled = vector[i].conj() * weight;
                for &j in &rows[k..] {
                    self.spread[i * m + j] += vector[j] * scaled;
                }
            }
            rows.iter().for_each(|&i| vector[i] = zero);
        };
        for column in &self.columns {
            let j = column.column;
            for k in column.terms.clone() {
                let entry = self.entries[k];
                self.level[j * m + entry.row] += powers[entry.power] * self.value[k];
                self.vector[entry.row] += derivatives[entry.power] * self.value[k];
            }
            add(&mut self.vector, &column.rows, powi(delta * scale[j], 2));
        }
        for (parameter, column) in &self.slope_columns {
            for k in column.terms.clone() {
                let entry = self.slope_entries[k];
                self.vector[entry.row] += powers[entry.power] * self.slope[k];
            }
            add(&mut self.vector, &column.rows, powi(self.width[*parameter] * scale[column.column], 2));
        }
        let most = (0..m).map(|i| self.spread[i * m + i].re).fold(0.0, f64::max);
        let least = if most > 0.0 { 1e-8 * most } else { 1.0 };
        for i in 0..m {
            self.spread[i * m + i] = c64::new(self.spread[i * m + i].re * (1.0 + 1e-4) + least, 0.0);
        }
    }

    /// Q T: the columns Λ⁻¹ L, orthogonalised (modified Gram-Schmidt); false if they depend on each other.
    fn orthogonalise(&mut self) -> bool {
        let (m, n) = (self.m, self.n);
        let zero = c64::new(0.0, 0.0);
        self.orthogonal.copy_from_slice(&self.level);
        for j in 0..n {
            let (before, rest) = self.orthogonal.split_at_mut(j * m);
            let column = &mut rest[..m];
            for k in 0..m {
                let x = column[k] * (1.0 / self.spread[k * m + k].re);
                column[k] = x;
                for i in k + 1..m {
                    column[i] -= self.spread[k * m + i] * x;
                }
            }
            // Two times: otherwise R L − I has the square of the condition.
            self.triangle[j * n..j * n + j].fill(zero);
            for _ in 0..2 {
                for (k, q) in before.chunks_exact(m).enumerate() {
                    let share: c64 = q.iter().zip(&*column).map(|(q, x)| q.conj() * x).sum();
                    self.triangle[j * n + k] += share;
                    column.iter_mut().zip(q).for_each(|(x, q)| *x -= share * q);
                }
            }
            let norm = column.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt();
            if !(norm > 0.0 && norm.is_finite()) {
                return false;
            }
            self.triangle[j * n + j] = c64::new(norm, 0.0);
            column.iter_mut().for_each(|x| *x *= 1.0 / norm);
        }
        true
    }

    /// R = T⁻¹ Qᴴ Λ⁻¹.
    fn invert(&mut self) {
        let (m, n) = (self.m, self.n);
        for i in 0..n {
            self.vector.copy_from_slice(&self.orthogonal[i * m..(i + 1) * m]);
            for k in (0..m).rev() {
                let column = &self.spread[k * m..(k + 1) * m];
                let partial: c64 = (k + 1..m).map(|j| column[j].conj() * self.vector[j]).sum();
                self.vector[k] = (self.vector[k] - partial) * (1.0 / column[k].re);
            }
            for r in 0..m {
                self.inverse[r * n + i] = self.vector[r].conj();
            }
        }
        for row in self.inverse.chunks_exact_mut(n) {
            for k in (0..n).rev() {
                let x = row[k] * (1.0 / self.triangle[k * n + k].re);
                row[k] = x;
                for i in 0..k {
                    row[i] -= self.triangle[k * n + i] * x;
                }
            }
        }
    }

    /// The parts of G and their sum, rounding included.
    fn bounds(&mut self, at: c64, delta: f64) {
        let n = self.n;
        let reach = (at.norm() + delta) * (1.0 + 8.0 * f64::EPSILON);
        let reaches = [1.0, reach, reach * reach];
        self.floor.fill(0.0);
        self.lambda.fill(0.0);
        self.bound.fill(0.0);
        for (x, r) in self.modulus.iter_mut().zip(&self.inverse) {
            *x = modulus(*r);
        }
        for j in 0..n {
            self.floor[j * n + j] = -1.0;
        }
        for column in &self.columns {
            let at_column = column.column * n..(column.column + 1) * n;
            // |R| A, stored in `bound` temporarily.
            let bound = &mut self.bound[at_column.clone()];
            for k in column.terms.clone() {
                let entry = self.entries[k];
                let size = self.largest[k] * reaches[entry.power];
                let row = &self.modulus[entry.row * n..(entry.row + 1) * n];
                bound.iter_mut().zip(row).for_each(|(x, r)| *x += size * r);
            }
            multiply(&mut self.product, &self.inverse, &self.entries, &self.value, column);
            let (floor, lambda) = (&mut self.floor[at_column.clone()], &mut self.lambda[at_column]);
            for i in 0..n {
                let t = [self.product[i], self.product[n + i], self.product[2 * n + i]];
                let level = t[0] + at * (t[1] + at * t[2]);
                floor[i] = modulus(level + floor[i]);
                lambda[i] = delta * (modulus(t[1] + at * t[2] * 2.0) + delta * modulus(t[2]));
            }
        }
        for j in 0..n {
            for i in 0..n {
                let k = j * n + i;
                let one = f64::from(u8::from(i == j));
                self.floor[k] = self.floor[k].abs() + self.slack * (self.bound[k] + one) + UNDERFLOW;
                self.bound[k] = self.floor[k] + self.lambda[k];
            }
        }
        for (index, (parameter, column)) in self.slope_columns.iter().enumerate() {
            let width = self.width[*parameter];
            multiply(&mut self.product, &self.inverse, &self.slope_entries, &self.slope, column);
            let part = &mut self.slopes[index * n..(index + 1) * n];
            if let Some(power) = column.single {
                let weight = width * reaches[power];
                let t = &self.product[power * n..(power + 1) * n];
                part.iter_mut().zip(t).for_each(|(x, t)| *x = weight * modulus(*t));
            } else {
                for i in 0..n {
                    let t = [self.product[i], self.product[n + i], self.product[2 * n + i]];
                    let level = modulus(t[0] + at * (t[1] + at * t[2]));
                    let change = modulus(t[1] + at * t[2] * 2.0) + delta * modulus(t[2]);
                    part[i] = width * (level + delta * change);
                }
            }
            let bound = &mut self.bound[column.column * n..(column.column + 1) * n];
            bound.iter_mut().zip(&*part).for_each(|(x, part)| *x += part);
        }
        for x in &mut self.bound {
            *x *= 1.0 + self.slack;
        }
    }
}

/// Consecutive entries with the same key, as columns.
fn grouped(keys: &[(usize, usize)], entries: &[Entry]) -> Vec<(usize, Column)> {
    let mut out: Vec<(usize, Column)> = Vec::new();
    for (k, &(owner, column)) in keys.iter().enumerate() {
        match out.last_mut() {
            Some((last, c)) if *last == owner && c.column == column => c.terms.end = k + 1,
            _ => out.push((owner, Column { column, terms: k..k + 1, ..Column::default() })),
        }
    }
    for (_, column) in &mut out {
        let own = &entries[column.terms.clone()];
        column.rows = own.iter().map(|entry| entry.row).collect();
        column.rows.sort_unstable();
        column.rows.dedup();
        column.single = own.iter().all(|entry| entry.power == own[0].power).then(|| own[0].power);
    }
    out
}

/// R times the column of each power.
fn multiply(product: &mut [c64], inverse: &[c64], entries: &[Entry], values: &[f64], column: &Column) {
    let n = product.len() / 3;
    product.fill(c64::new(0.0, 0.0));
    for k in column.terms.clone() {
        let (entry, value) = (entries[k], values[k]);
        let row = &inverse[entry.row * n..(entry.row + 1) * n];
        let out = &mut product[entry.power * n..(entry.power + 1) * n];
        out.iter_mut().zip(row).for_each(|(x, r)| *x += r * value);
    }
}

fn modulus(x: c64) -> f64 {
    (x.re * x.re + x.im * x.im).sqrt()
}

/// The lower triangle, column by column, of a Hermitian matrix.
fn cholesky(a: &mut [c64], m: usize) -> bool {
    for k in 0..m {
        let pivot = a[k * m + k].re;
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        let (before, after) = a.split_at_mut((k + 1) * m);
        let column = &mut before[k * m..];
        let root = pivot.sqrt();
        column[k] = c64::new(root, 0.0);
        column[k + 1..].iter_mut().for_each(|x| *x *= 1.0 / root);
        for (j, row_below) in after.chunks_exact_mut(m).enumerate() {
            let j = k + 1 + j;
            let share = column[j].conj();
            for i in j..m {
                row_below[i] -= column[i] * share;
            }
        }
    }
    true
}
