use dashu_int::IBig;
use dashu_int::ops::BitTest;
use faer::c64;
use kardan_rt::functions::{exp2, powi};

use crate::num::{Matrix, Rational, Scalar, echelon, rational_to_f64};
use crate::results::{Complex, Pole};

/// Matrices `L(λ, x) = Σₖ λᵏ (Lₖ₀ + Σᵢ xᵢ Lₖᵢ)`, `k = 0, 1, 2`, over the box `|xᵢ| ≤ 1` and all complex λ in 1/s.
///
/// A constrained mechanical system loses controllability where `[λ²H + λD + S, Cᵀ; C, 0; Fᵀ, 0]` has dependent columns;
/// toleranced parameters p enter it as `pᵢ = centreᵢ (1 + toleranceᵢ xᵢ)`.
#[derive(Debug, Clone)]
pub struct PencilBox {
    /// `L₀₀, L₁₀, L₂₀`: the coefficients of λ⁰, λ¹, λ² at `x = 0`. At least as many rows as columns.
    pub coefficients: [Matrix<Rational>; 3],
    /// `L₀ᵢ, L₁ᵢ, L₂ᵢ`: their change with each xᵢ.
    pub slopes: Vec<[Matrix<Rational>; 3]>,
}

/// The result of [`prove_box`].
#[derive(Debug, Clone, PartialEq)]
pub enum BoxProof {
    /// The columns are independent for every λ and every x in the box. A proof, rounding included.
    Proven {
        /// Cells that were looked at.
        cells: usize,
    },
    /// No proof: a loss lies in the box, or close to it, or the budget was too small.
    ///
    /// Without any cell and at zero if columns are dependent everywhere, or entries too many orders of magnitude apart.
    Undecided {
        /// Cells that were looked at.
        cells: usize,
        /// Centre of the cell that could not be decided, 1/s, imaginary part not negative.
        at: Pole,
        /// The parameter that the next subdivision would have divided; `None` for λ.
        parameter: Option<usize>,
    },
}

/// Proves that `L(λ, x)` has independent columns for every complex λ and every x of the box.
///
/// Never claims more than it has proven; a box that touches a loss is always [`BoxProof::Undecided`], which is reached
/// once cells become too small, or after `budget` cells. `progress` receives from time to time the share of the
/// cells (by volume) is done, from 0 to 1.
///
/// Method: branch and bound over `|λ| ≤ ω` and, with `μ = 1/λ`, over `|μ| ≤ 1/ω`, each a square of which the half with
/// `Im ≥ 0` suffices, times the box. The reversed polynomial is `diag(μ^aᵣ) L(1/μ, x) diag(μ^bⱼ)` with the degree bⱼ of each
/// column and the least aᵣ without negative powers: for the matrix of a constrained system, `[H, Cᵀ; C, 0; Fᵀ, 0]` at
/// `μ = 0`, so that inertias regular on the kernel of C decide the case at infinity. Rows and columns that do
/// not depend on λ and x are eliminated exactly before. In a cell `λ = c + ε, |ε| ≤ δ, x = y + wξ, |ξᵢ| ≤ 1`, for any R,
/// `R L(λ, x) = I + Δ` with `|Δ| ≤ G = |R L(c, y) − I| + Σₚ δᵖ |R ∂ᵖL(c, y)/p!| + Σᵢ wᵢ Σₚ δᵖ |R ∂ᵖLᵢ(c)/p!|` entry by entry
/// (p ≥ 1 in the first sum, p ≥ 0 in the second): no term is neglected, L is quadratic in λ and affine in x. A positive vector d
/// with `G d < d` proves that the spectral radius of Δ is below one, hence `R L` regular. R is the left inverse of `L(c, y)` that
/// is least sensitive to the uncertainties of the cell (weighted least squares); a cell that fails is divided in the direction that
/// contributes most to the spectral radius of G.
///
/// Cost per cell about `m³ + 4 m²n` complex flops for m × n matrices; the number of cells grows with the closeness of a loss,
/// and exponentially with the number of parameters that matter there.
///
/// ```
/// use kardan::analysis::{BoxProof, PencilBox, prove_box};
/// use kardan::num::{Matrix, Rational};
/// // λ² + 1 + x/2 over [λ + 2]: no common root.
/// let column = |a: i64, b: i64, of: u32| Matrix::from_fn(2, 1, |i, _| Rational::from_parts([a, b][i].into(), of.into()));
/// let family = PencilBox {
///     coefficients: [column(1, 2, 1), column(0, 1, 1), column(1, 0, 1)],
///     slopes: vec![[column(1, 0, 2), column(0, 0, 1), column(0, 0, 1)]],
/// };
/// assert!(matches!(prove_box(&family, 10_000, &mut |_| {}), BoxProof::Proven { .. }));
/// ```
///
/// # Panics
/// If the matrices differ in shape.
pub fn prove_box(family: &PencilBox, budget: usize, progress: &mut dyn FnMut(f64)) -> BoxProof {
    let mut parts = vec![family.coefficients.clone()];
    parts.extend(family.slopes.iter().cloned());
    let shape = (parts[0][0].rows(), parts[0][0].columns());
    for matrix in parts.iter().flatten() {
        assert_eq!((matrix.rows(), matrix.columns()), shape, "matrices of a family differ in shape");
    }
    let dependent = BoxProof::Undecided { cells: 0, at: Complex::default(), parameter: None };
    let parts = without_constant_rows(parts);
    if parts[0][0].columns() == 0 {
        return BoxProof::Proven { cells: 0 };
    }
    let Some(parts) = without_constant_columns(parts) else { return dependent };
    let (m, n) = (parts[0][0].rows(), parts[0][0].columns());
    if n == 0 {
        return BoxProof::Proven { cells: 0 };
    }
    let Some(scaled) = (if m < n { None } else { Scaled::new(&parts) }) else { return dependent };
    let mut search = Search { budget, cells: 0, done: 0.0, progress };
    for reversed in [true, false] {
        let mut cells = Cells::new(&scaled, reversed);
        // The upper half of the square in two cells.
        for re in [-0.5, 0.5] {
            let open = search.descend(&mut cells, c64::new(re, 0.5), 0.5, &vec![1.0; n], 0.25, None);
            if let Err(open) = open {
                let at = if reversed { c64::new(1.0, 0.0) / open.at } else { open.at };
                let unit = scaled.unit;
                return BoxProof::Undecided {
                    cells: search.cells,
                    at: Complex { re: at.re * unit, im: at.im.abs() * unit },
                    parameter: open.parameter,
                };
            }
        }
    }
    (search.progress)(1.0);
    BoxProof::Proven { cells: search.cells }
}

/// Coefficients at the centre of the box, then those of each parameter.
type Parts = Vec<[Matrix<Rational>; 3]>;

/// Whether an entry at some power of λ is not zero in some part.
fn occurs(parts: &Parts, power: usize, row: usize, column: usize) -> bool {
    parts.iter().any(|part| !part[power][(row, column)].is_zero())
}

/// Whether an entry depends on neither λ nor x.
fn is_constant(parts: &Parts, row: usize, column: usize) -> bool {
    let varies = |(part, power): (usize, usize)| !parts[part][power][(row, column)].is_zero();
    (0..parts.len()).all(|part| (0..3).all(|power| (part, power) == (0, 0) || !varies((part, power))))
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

/// Columns that span the kernel of a matrix; entries early in `order` are expressed by later ones where possible.
fn kernel(matrix: &Matrix<Rational>, order: &[usize]) -> (Matrix<Rational>, usize) {
    let e = echelon(matrix, order);
    (e.kernel(), e.rank())
}

/// The family on the kernel of its constant rows: null vectors correspond one to one.
///
/// Columns of low degree are expressed by those of high degree, so that degrees do not grow.
fn without_constant_rows(parts: Parts) -> Parts {
    let (m, n) = (parts[0][0].rows(), parts[0][0].columns());
    let (fixed, retained): (Vec<usize>, Vec<usize>) = (0..m).partition(|&i| (0..n).all(|j| is_constant(&parts, i, j)));
    let degrees = column_degrees(&parts);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|&j| degrees[j]);
    let (basis, _) = kernel(&Matrix::from_fn(fixed.len(), n, |i, j| parts[0][0][(fixed[i], j)].clone()), &order);
    let project = |matrix: &Matrix<Rational>| {
        Matrix::from_fn(retained.len(), n, |i, j| matrix[(retained[i], j)].clone()).multiply(&basis)
    };
    parts.iter().map(|part| part.each_ref().map(project)).collect()
}

/// The rows of `N L` with `N B = 0` for the constant columns B; `None` if B has dependent columns.
///
/// With B of full column rank, `[A, B]` has it if and only if `N A` has it.
fn without_constant_columns(parts: Parts) -> Option<Parts> {
    let (m, n) = (parts[0][0].rows(), parts[0][0].columns());
    let (fixed, retained): (Vec<usize>, Vec<usize>) = (0..n).partition(|&j| (0..m).all(|i| is_constant(&parts, i, j)));
    let degrees = row_degrees(&parts, &column_degrees(&parts));
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by_key(|&i| degrees[i]);
    let (basis, rank) = kernel(&Matrix::from_fn(fixed.len(), m, |j, i| parts[0][0][(i, fixed[j])].clone()), &order);
    if rank < fixed.len() {
        return None;
    }
    let basis = basis.transpose();
    let project = |matrix: &Matrix<Rational>| {
        basis.multiply(&Matrix::from_fn(m, retained.len(), |i, j| matrix[(i, retained[j])].clone()))
    };
    Some(parts.iter().map(|part| part.each_ref().map(project)).collect())
}

/// One entry of one part at one power of λ, scaled and rounded.
#[derive(Debug, Clone, Copy)]
struct Term {
    part: usize,
    power: usize,
    row: usize,
    column: usize,
    value: f64,
}

/// The family with rows, columns and λ in units that are powers of two.
struct Scaled {
    rows: usize,
    columns: usize,
    parts: usize,
    terms: Vec<Term>,
    /// Degree of each column, and of each row relative to them.
    column_degrees: Vec<usize>,
    row_degrees: Vec<isize>,
    /// Unit of λ, 1/s.
    unit: f64,
}

/// Largest modulus of an entry; with [`LARGEST_INVERSE`] all products are far from overflow.
const LARGEST_ENTRY: f64 = 1.0e60;
/// Largest modulus of an entry of R.
const LARGEST_INVERSE: f64 = 1.0e60;
/// More than all that underflows in an entry of G.
const UNDERFLOW: f64 = 1.0e-90;

impl Scaled {
    /// `None` if entries differ by too many orders of magnitude.
    fn new(parts: &Parts) -> Option<Self> {
        let (rows, columns) = (parts[0][0].rows(), parts[0][0].columns());
        // Logarithms of the sizes of entries over the box.
        let size = |x: &Rational| x.numerator().bit_len() as f64 - x.denominator().bit_len() as f64;
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

fn power_of_two(power: i64) -> Rational {
    let whole = Rational::from(IBig::ONE << power.unsigned_abs() as usize);
    if power < 0 { Rational::one().over(&whole) } else { whole }
}

/// The terms of one part in one column.
#[derive(Debug, Clone, Default)]
struct Column {
    column: usize,
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

/// A cell that could not be decided.
struct Open {
    at: c64,
    parameter: Option<usize>,
}

struct Search<'a> {
    budget: usize,
    cells: usize,
    done: f64,
    progress: &'a mut dyn FnMut(f64),
}

/// Half widths below which a cell is not divided; centres then have few enough bits to be exact.
const SMALLEST: f64 = 1.0 / (1u64 << 44) as f64;

impl Search<'_> {
    /// Proves the cell with this centre and half width in λ and the box of `cells`, or divides it.
    ///
    /// `scale`: the sizes of a null vector that would be most dangerous, from the cell above.
    fn descend(
        &mut self,
        cells: &mut Cells,
        at: c64,
        half: f64,
        scale: &[f64],
        share: f64,
        divided: Option<usize>,
    ) -> Result<(), Open> {
        if self.cells >= self.budget {
            return Err(Open { at, parameter: divided });
        }
        self.cells += 1;
        let scale = match cells.decide(at, half, scale) {
            Verdict::Proven => {
                self.done += share;
                if self.cells.is_multiple_of(64) {
                    (self.progress)(self.done);
                }
                return Ok(());
            }
            Verdict::Singular => return Err(Open { at, parameter: divided }),
            Verdict::Open => cells.right.clone(),
        };
        let parameter = cells.direction();
        let Some(i) = parameter else {
            if half <= SMALLEST || cells.hopeless() {
                return Err(Open { at, parameter });
            }
            for (re, im) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                let at = c64::new(at.re + 0.5 * half * re, at.im + 0.5 * half * im);
                self.descend(cells, at, 0.5 * half, &scale, 0.25 * share, parameter)?;
            }
            return Ok(());
        };
        let (centre, width) = (cells.centre[i], cells.width[i]);
        if width <= SMALLEST || cells.hopeless() {
            return Err(Open { at, parameter });
        }
        cells.width[i] = 0.5 * width;
        for side in [-0.5, 0.5] {
            cells.centre[i] = centre + side * width;
            self.descend(cells, at, half, &scale, 0.5 * share, parameter)?;
        }
        (cells.centre[i], cells.width[i]) = (centre, width);
        Ok(())
    }
}

enum Verdict {
    Proven,
    Open,
    /// No left inverse was found.
    Singular,
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
struct Cells {
    m: usize,
    n: usize,
    /// Entries of the centre and their values at x = 0, at the centre of the cell, and summed moduli over the box.
    entries: Vec<Entry>,
    base: Vec<f64>,
    value: Vec<f64>,
    largest: Vec<f64>,
    columns: Vec<Column>,
    /// Entries of all slopes, and columns with the index of their parameter.
    slope_entries: Vec<Entry>,
    slope: Vec<f64>,
    slope_columns: Vec<(usize, Column)>,
    slack: f64,
    /// The box: y and w.
    centre: Vec<f64>,
    width: Vec<f64>,
    /// L(c, y), m × n.
    level: Vec<c64>,
    /// Covariance of the uncertainties of rows, its Cholesky factor, m × m.
    spread: Vec<c64>,
    /// Orthonormal columns, m × n, and the triangle, n × n.
    orthogonal: Vec<c64>,
    triangle: Vec<c64>,
    /// R, n × m.
    inverse: Vec<c64>,
    /// One column of length m; zero between uses where entries are summed up.
    vector: Vec<c64>,
    /// R times one column of each power, 3 × n.
    product: Vec<c64>,
    /// Moduli of R, n × m.
    modulus: Vec<f64>,
    /// Parts of G, n × n: what no division makes smaller, and what λ contributes; then one column for each of `slope_columns`.
    floor: Vec<f64>,
    lambda: Vec<f64>,
    slopes: Vec<f64>,
    /// G, rounding included, n × n.
    bound: Vec<f64>,
    /// I − G during elimination, n × n.
    triangular: Vec<f64>,
    /// Positive vectors: Perron's for G where a cell fails.
    right: Vec<f64>,
    left: Vec<f64>,
    work: Vec<f64>,
    /// Contributions of the parameters and of λ (last) to the spectral radius of G.
    contributions: Vec<f64>,
}

impl Cells {
    fn new(scaled: &Scaled, reversed: bool) -> Self {
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
    fn decide(&mut self, at: c64, half: f64, scale: &[f64]) -> Verdict {
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

    /// Whether a positive vector d with `G d < d` is found: from `(I − G) d = 1`, then checked.
    ///
    /// Without one, leaves Perron's vectors of G (roughly) in `right` and `left`.
    fn is_contraction(&mut self) -> bool {
        let n = self.n;
        if self.positive_solution() {
            let d = &self.right;
            self.work.fill(0.0);
            for j in 0..n {
                for i in 0..n {
                    self.work[i] += self.bound[j * n + i] * d[j];
                }
            }
            let contracts = (0..n).all(|i| d[i] >= 0.5 && d[i] <= 1e15 && self.work[i] * (1.0 + self.slack) < d[i]);
            if contracts {
                return true;
            }
        }
        self.right.fill(1.0);
        self.left.fill(1.0);
        for _ in 0..12 {
            for j in 0..n {
                self.work[j] = 0.0;
                for i in 0..n {
                    self.work[j] += self.left[i] * self.bound[j * n + i];
                }
            }
            normalise(&mut self.left, &self.work);
            self.work.fill(0.0);
            for j in 0..n {
                for i in 0..n {
                    self.work[i] += self.bound[j * n + i] * self.right[j];
                }
            }
            normalise(&mut self.right, &self.work);
        }
        false
    }

    /// Solves `(I − G) d = 1` into `right` without pivoting; whether all pivots are positive, as for a spectral radius below one.
    fn positive_solution(&mut self) -> bool {
        let n = self.n;
        let a = &mut self.triangular;
        for j in 0..n {
            for i in 0..n {
                a[j * n + i] = f64::from(u8::from(i == j)) - self.bound[j * n + i];
            }
        }
        let d = &mut self.right;
        d.fill(1.0);
        for k in 0..n {
            let pivot = a[k * n + k];
            if !(pivot > 1e-14) {
                return false;
            }
            let (before, after) = a.split_at_mut((k + 1) * n);
            let eliminated = &mut before[k * n..];
            for i in k + 1..n {
                eliminated[i] /= pivot;
                d[i] -= eliminated[i] * d[k];
            }
            for column in after.chunks_exact_mut(n) {
                let top = column[k];
                for i in k + 1..n {
                    column[i] -= eliminated[i] * top;
                }
            }
        }
        for k in (0..n).rev() {
            d[k] /= a[k * n + k];
            for i in 0..k {
                d[i] -= a[k * n + i] * d[k];
            }
        }
        true
    }

    /// The direction to divide: the parameter that contributes most to the spectral radius, or λ.
    fn direction(&mut self) -> Option<usize> {
        let n = self.n;
        self.contributions.fill(0.0);
        for (index, (parameter, column)) in self.slope_columns.iter().enumerate() {
            let part = &self.slopes[index * n..(index + 1) * n];
            let sum: f64 = part.iter().zip(&self.left).map(|(x, y)| x * y).sum();
            self.contributions[*parameter] += sum * self.right[column.column];
        }
        let q = self.centre.len();
        self.contributions[q] = LAMBDA_WEIGHT * self.weigh(&self.lambda);
        let mut best = q;
        for i in 0..q {
            if self.contributions[i] > self.contributions[best] {
                best = i;
            }
        }
        (best < q).then_some(best)
    }

    /// Whether what division cannot make smaller is too large.
    fn hopeless(&self) -> bool {
        let size: f64 = self.right.iter().zip(&self.left).map(|(x, y)| x * y).sum();
        !(self.weigh(&self.floor) < 0.5 * size)
    }

    fn weigh(&self, part: &[f64]) -> f64 {
        let rows = part.chunks_exact(self.n).zip(&self.right);
        rows.map(|(column, x)| x * column.iter().zip(&self.left).map(|(g, y)| g * y).sum::<f64>()).sum()
    }
}

/// Division of λ makes four cells, of a parameter two.
const LAMBDA_WEIGHT: f64 = 0.5;

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

/// A positive vector with largest entry one; none is far below.
fn normalise(vector: &mut [f64], raw: &[f64]) {
    let largest = raw.iter().copied().fold(0.0, f64::max);
    for (x, raw) in vector.iter_mut().zip(raw) {
        *x = f64::max(raw / largest, 1e-8);
    }
}

#[cfg(test)]
#[path = "../../tests/unit/analysis/box_proof.rs"]
mod tests;
