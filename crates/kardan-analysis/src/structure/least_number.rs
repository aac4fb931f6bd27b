//! The least numbers of inputs and outputs: a witness that they are enough, rows that show that fewer are not.

use std::sync::Arc;

use super::limits::{MOST_NUMBERS, most_primes};
use super::ranks::minor;
use crate::images::{Image, Images, values};
use crate::parts::texts;
use kardan_math::num::{Matrix, ModularMatrix, Polynomial, Primes, Random, Rational, Residue, Scalar, Span, reachable};
use kardan_results::{Count, Minor};

/// The proof that m inputs are enough and, by way of the common factor, that fewer are not.
///
/// With `force = Some((r, true))` the witness acts as forces on r degrees of freedom; with `false` (the dual system) as
/// sensors of their positions.
///
/// `stated` is the image that the minor is about; if the search fails modulo its prime, others of `spare` follow.
pub(super) fn count(
    images: &mut Images<'_>,
    first: &Image,
    (stated, spare): (&Arc<Image>, &Primes),
    m: usize,
    common: Option<&Polynomial>,
    force: Option<(usize, bool)>,
    proven: bool,
) -> Option<Count> {
    let further_images = spare.clone().take(8).filter_map(|prime| images.modulo(prime).map(Arc::new));
    let (witness, minor) =
        std::iter::once(stated.clone()).chain(further_images).find_map(|image| witness(&image, m, force))?;
    if m == 1 {
        return Some(Count { number: 1, witness, minor, ..Count::default() });
    }
    let common = common?;
    let common_factor = common.coefficients().iter().map(ToString::to_string).collect();
    let rows = companion_rows(images, first, m, common);
    (proven || rows.is_some()).then(|| {
        let rows = rows.map_or_else(Vec::new, |rows| texts(&rows));
        Count { number: m, witness, minor, common_factor, rows }
    })
}

/// An input matrix of whole numbers with m columns that reaches all states, and its minor.
fn witness(image: &Image, m: usize, force: Option<(usize, bool)>) -> Option<(Vec<Vec<i64>>, Minor)> {
    let (field, n) = (&image.field, image.g.rows);
    let mut random = Random::new(5);
    (0..30).find_map(|attempt| {
        let (rows, at) = match force {
            Some((r, true)) => (r, r),
            Some((r, false)) => (r, 0),
            None => (n, 0),
        };
        let mut witness = vec![vec![0i64; m]; n];
        for row in &mut witness[at..at + rows] {
            row.iter_mut().for_each(|x| *x = random.small(1 + 3 * attempt));
        }
        let raw = ModularMatrix::from_fn(n, m, |i, j| field.integer(witness[i][j]));
        let part = reachable(field, &image.g, &image.inverse_e.multiply(field, &raw));
        (part.span.dimension() == n).then(|| (witness, minor(field, part.columns, &part.span)))
    })
}

/// Independent rows Y with `Y A = (I ⊗ companion(q)) Y E`, m blocks of them, exact.
fn companion_rows(images: &mut Images<'_>, first: &Image, m: usize, common: &Polynomial) -> Option<Matrix<Rational>> {
    let field = first.field;
    let (n, degree) = (first.g.rows, common.degree());
    if m * degree * n > MOST_NUMBERS {
        return None;
    }
    let combinations = generators(first, m, common)?;
    let flat = images.reconstruct(most_primes(n), |image| {
        let rows = chains(image, common, &combinations)?;
        Some(values(&image.field, &image.inverse_e.multiply_from_left(&image.field, &rows)))
    })?;
    let count = m * degree;
    let system = images.system();
    let y = Matrix::from_fn(count, n, |i, j| flat[i * n + j].clone());
    let (on_e, on_a) = (y.multiply(&system.e), y.multiply(&system.a));
    let acts = (0..count).all(|i| {
        (0..n).all(|j| {
            if (i + 1) % degree != 0 {
                return on_a[(i, j)] == on_e[(i + 1, j)];
            }
            let sum = (0..degree).fold(Rational::ZERO, |sum, k| {
                sum.minus(&common.coefficients()[k].times(&on_e[(i + 1 - degree + k, j)]))
            });
            on_a[(i, j)] == sum
        })
    });
    let independent = ModularMatrix::from_rational(&field, &y)?.echelon(&field).1.len() == count;
    (acts && independent).then_some(y)
}

/// A basis of the left kernel of `q(G)`.
fn left_kernel(image: &Image, q: &Polynomial) -> Option<ModularMatrix> {
    let (field, n) = (&image.field, image.g.rows);
    let mut value = ModularMatrix::zeros(n, n);
    for c in q.coefficients().iter().rev() {
        value = value.multiply(field, &image.g).plus(field, field.rational(c)?, &ModularMatrix::identity(field, n));
    }
    Some(value.transpose().null_space(field))
}

/// Combinations of the left kernel of `q(G)` that generate m independent chains.
fn generators(image: &Image, m: usize, q: &Polynomial) -> Option<Vec<Vec<i64>>> {
    let field = &image.field;
    let kernel = left_kernel(image, q)?;
    let mut random = Random::new(9);
    let mut chosen: Vec<Vec<i64>> = Vec::new();
    let mut span = Span::default();
    for attempt in 0..kernel.rows + 200 {
        let combination: Vec<i64> = (0..kernel.rows)
            .map(|k| if attempt < kernel.rows { i64::from(k == attempt) } else { random.small(4) })
            .collect();
        let mut next = span.clone();
        if chain(image, &kernel, &combination, q.degree()).iter().all(|w| next.insert(field, w).is_none()) {
            span = next;
            chosen.push(combination);
        }
        if chosen.len() == m {
            return Some(chosen);
        }
    }
    None
}

fn chain(image: &Image, kernel: &ModularMatrix, combination: &[i64], degree: usize) -> Vec<Vec<Residue>> {
    let field = &image.field;
    let mut w = vec![0; kernel.columns];
    for (k, &c) in combination.iter().enumerate() {
        field.subtract(&mut w, field.integer(-c), kernel.row(k));
    }
    let transposed = image.g.transpose();
    let mut out = vec![w];
    while out.len() < degree {
        out.push(transposed.apply(field, &out[out.len() - 1]));
    }
    out
}

fn chains(image: &Image, q: &Polynomial, combinations: &[Vec<i64>]) -> Option<ModularMatrix> {
    let kernel = left_kernel(image, q)?;
    let all: Vec<Vec<Residue>> = combinations
        .iter()
        .filter(|combination| combination.len() == kernel.rows)
        .flat_map(|combination| chain(image, &kernel, combination, q.degree()))
        .collect();
    let complete = all.len() == combinations.len() * q.degree();
    complete.then(|| ModularMatrix::from_fn(all.len(), kernel.columns, |i, j| all[i][j]))
}
