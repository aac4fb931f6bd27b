//! The family of a box without rows and columns that do not depend on λ and x, with rows, columns and λ in units in which no entry is too
//! large.

use kardan_rt::functions::exp2;

use crate::parts::{columns_of, rows_of};
use kardan_math::num::{Matrix, Rational, Scalar, echelon, exponent, power_of_two, rational_to_f64};

/// Coefficients at the centre of the box, then those of each parameter.
pub(super) type Parts = Vec<[Matrix<Rational>; 3]>;

/// Whether an entry at some power of λ is not zero in some part.
fn occurs(parts: &Parts, power: usize, row: usize, column: usize) -> bool {
    parts.iter().any(|part| !part[power][(row, column)].is_zero())
}

/// Whether an entry depends on neither λ nor x.
fn is_constant(parts: &Parts, row: usize, column: usize) -> bool {
    parts.iter().flatten().skip(1).all(|coefficient| coefficient[(row, column)].is_zero())
}

/// The degree of each column in λ.
fn column_degrees(parts: &Parts) -> Vec<usize> {
    let (m, n) = (parts[0][0].rows(), parts[0][0].columns());
    (0..n).map(|j| (0..3).rev().find(|&k| (0..m).any(|i| occurs(parts, k, i, j))).unwrap_or(0)).collect()
}

/// For each row the largest power of λ less the degree of its column, at most zero; −2 for a row of zeros.
fn row_degrees(parts: &Parts, columns: &[usize]) -> Vec<isize> {
    let terms = |i: usize| (0..3).flat_map(move |k| (0..columns.len()).map(move |j| (k, i, j)));
    (0..parts[0][0].rows())
        .map(|i| {
            let degrees = terms(i).filter(|&(k, i, j)| occurs(parts, k, i, j));
            degrees.map(|(k, _, j)| k as isize - columns[j] as isize).max().unwrap_or(-2)
        })
        .collect()
}

/// The family on the kernel of its constant rows: null vectors correspond one to one.
///
/// Columns of low degree are expressed by those of high degree, so that degrees do not grow.
pub(super) fn without_constant_rows(parts: Parts) -> Parts {
    let (m, n) = (parts[0][0].rows(), parts[0][0].columns());
    let (fixed, retained): (Vec<usize>, Vec<usize>) = (0..m).partition(|&i| (0..n).all(|j| is_constant(&parts, i, j)));
    let degrees = column_degrees(&parts);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|&j| degrees[j]);
    let basis = echelon(&rows_of(&parts[0][0], &fixed), &order).kernel();
    let project = |matrix: &Matrix<Rational>| rows_of(matrix, &retained).multiply(&basis);
    parts.iter().map(|part| part.each_ref().map(project)).collect()
}

/// The rows of `N L` with `N B = 0` for the constant columns B; `None` if B has dependent columns.
///
/// With B of full column rank, `[A, B]` has it if and only if `N A` has it.
pub(super) fn without_constant_columns(parts: Parts) -> Option<Parts> {
    let (m, n) = (parts[0][0].rows(), parts[0][0].columns());
    let (fixed, retained): (Vec<usize>, Vec<usize>) = (0..n).partition(|&j| (0..m).all(|i| is_constant(&parts, i, j)));
    let degrees = row_degrees(&parts, &column_degrees(&parts));
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by_key(|&i| degrees[i]);
    let found = echelon(&columns_of(&parts[0][0], &fixed).transpose(), &order);
    if found.rank() < fixed.len() {
        return None;
    }
    let basis = found.kernel().transpose();
    let project = |matrix: &Matrix<Rational>| basis.multiply(&columns_of(matrix, &retained));
    Some(parts.iter().map(|part| part.each_ref().map(project)).collect())
}

/// One entry of one part at one power of λ, scaled and rounded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Term {
    pub(super) part: usize,
    pub(super) power: usize,
    pub(super) row: usize,
    pub(super) column: usize,
    pub(super) value: f64,
}

/// The family with rows, columns and λ in units that are powers of two.
pub(super) struct Scaled {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) parts: usize,
    pub(super) terms: Vec<Term>,
    /// Degree of each column, and of each row relative to them.
    pub(super) column_degrees: Vec<usize>,
    pub(super) row_degrees: Vec<isize>,
    /// Unit of λ, 1/s.
    pub(super) unit: f64,
}

/// Largest modulus of an entry; with [`LARGEST_INVERSE`] all products are far from overflow.
const LARGEST_ENTRY: f64 = 1.0e60;
/// Largest modulus of an entry of R.
pub(super) const LARGEST_INVERSE: f64 = 1.0e60;

impl Scaled {
    /// `None` if entries differ by too many orders of magnitude.
    pub(super) fn new(parts: &Parts) -> Option<Self> {
        let (rows, columns) = (parts[0][0].rows(), parts[0][0].columns());
        // Logarithms of the sizes of entries over the box.
        let size = |x: &Rational| exponent(x) as f64;
        let mut sizes = Vec::new();
        for (k, i, j) in (0..3).flat_map(|k| (0..rows).flat_map(move |i| (0..columns).map(move |j| (k, i, j)))) {
            let entries = parts.iter().map(|part| &part[k][(i, j)]).filter(|x| !x.is_zero());
            if let Some(largest) = entries.map(size).reduce(f64::max) {
                sizes.push((k, i, j, largest));
            }
        }
        // Least squares for the logarithms of all scaled entries, one unknown at a time.
        let (mut row, mut column, mut unit) = (vec![0.0; rows], vec![0.0; columns], 0.0);
        let (mut sum_row, mut sum_column) = (vec![(0.0, 0.0); rows], vec![(0.0, 0.0); columns]);
        for _ in 0..100 {
            sum_row.fill((0.0, 0.0));
            for &(k, i, j, size) in &sizes {
                sum_row[i] = (sum_row[i].0 + size + column[j] + unit * k as f64, sum_row[i].1 + 1.0);
            }
            row.iter_mut().zip(&sum_row).for_each(|(x, (sum, count))| *x = -sum / f64::max(*count, 1.0));
            sum_column.fill((0.0, 0.0));
            for &(k, i, j, size) in &sizes {
                sum_column[j] = (sum_column[j].0 + size + row[i] + unit * k as f64, sum_column[j].1 + 1.0);
            }
            column.iter_mut().zip(&sum_column).for_each(|(x, (sum, count))| *x = -sum / f64::max(*count, 1.0));
            let (mut sum, mut count) = (0.0, 0.0);
            for &(k, i, j, size) in &sizes {
                sum += k as f64 * (size + row[i] + column[j]);
                count += (k * k) as f64;
            }
            unit = -sum / f64::max(count, 1.0);
        }
        let mut terms = Vec::new();
        for (index, part) in parts.iter().enumerate() {
            for &(k, i, j, _) in &sizes {
                let x = &part[k][(i, j)];
                if !x.is_zero() {
                    let power = row[i].round() + column[j].round() + unit.round() * k as f64;
                    let value = rational_to_f64(&x.times(&power_of_two(power as i64)));
                    if !(value.abs() <= LARGEST_ENTRY) {
                        return None;
                    }
                    terms.push(Term { part: index, power: k, row: i, column: j, value });
                }
            }
        }
        let column_degrees = column_degrees(parts);
        let row_degrees = row_degrees(parts, &column_degrees);
        let unit = exp2(unit.round());
        Some(Self { rows, columns, parts: parts.len(), terms, column_degrees, row_degrees, unit })
    }
}
