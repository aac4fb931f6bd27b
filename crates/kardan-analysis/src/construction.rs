//! Constructs an input that reaches every mode of a system.

use super::images::{Image, Images};
use super::{LinearSystem, spectrum};
use kardan_math::num::modular_polynomial::{divide, gcd, monic, product, square_free};
use kardan_math::num::{ModularMatrix, Polynomial, PrimeField, Residue, reachable};
use kardan_results::signal_name::SignalName;
use kardan_results::{Construction, ConstructionStep};

/// Largest number of states.
pub const MOST_CONSTRUCTED: usize = 64;

/// Most primes for the coefficients of the factors.
const MOST_PRIMES: usize = 700;

/// An input matrix of whole numbers with the least number of columns that makes the model controllable, built eigenvalue
/// by eigenvalue \[diss. Theorem 5.2, (5.9)-(5.11)\], for `degrees_of_freedom` as forces on the coordinates \[diss. Theorem 5.3\].
///
/// As printed the procedure can fail, so it is corrected: (1) instead of a left eigenvector, which may be complex and may
/// have `vᵀv = 0`, a unit vector e is added (one force, one state) that some left eigenvector not reached yet does not
/// annihilate, so the rank of `[λE − A, B]` grows for any multiplier but zero; (2) the multiplier is the first of
/// 1, −1, 2, −2, … that loses no root reached before. Each of those is lost for at most one number, because a minor is
/// affine in it. Roots of one factor are taken together: left vectors w with `w f(E⁻¹A) = 0`, without computing a root.
///
/// Steps are chosen modulo a prime; that the finished matrix makes the model controllable is proven by a minor that does
/// not vanish modulo it. `None` above 64 states, or if E is singular or there are no states. For outputs, construct inputs
/// of the transposed system; for a mechanical model with symmetric matrices, the transpose of the forces found gives
/// sensors of positions \[diss. Theorem 5.8\].
///
/// ```
/// use kardan_analysis::{LinearSystem, construction};
/// use kardan_math::num::{Matrix, Rational};
/// // The printed procedure gives (0, 2, 1) here, which does not reach λ = 3.
/// let rows = [[3, 0, 0], [0, 2, 0], [2, -1, 1]];
/// let a = Matrix::from_fn(3, 3, |i, j| Rational::from(rows[i][j]));
/// let none = Matrix::zeros(3, 0);
/// let found = construction(&LinearSystem::state_space(a, none.clone(), none.transpose())).unwrap();
/// // (1, 1, 0) would lose λ = 1, whose left eigenvector is (−1, 1, 1).
/// assert_eq!(found.input, [["1"], ["-1"], ["0"]]);
/// ```
pub fn construction(system: &LinearSystem) -> Option<Construction> {
    let n = system.states.len();
    if n == 0 || n > MOST_CONSTRUCTED {
        return None;
    }
    let mut images = Images::unforeseen(system);
    let image = images.get(0)?.clone();
    let (least, factors) = factors(&mut images)?;
    let offset = system.degrees_of_freedom.unwrap_or(0);
    let mut plan = Plan { image: &image, offset, input: vec![vec![0; least]; n - offset] };
    let (mut steps, mut reached) = (Vec::new(), Vec::new());
    for factor in &factors {
        let modular = plan.residues(factor)?;
        loop {
            let missed = plan.missed();
            let defect = missed.iter().filter(|part| shared(&image.field, part, &modular) > 0).count();
            if defect == 0 {
                break;
            }
            let (row, column, multiplier) = plan.next(&missed, &modular, &reached)?;
            plan.input[row][column] += multiplier;
            steps.push(ConstructionStep {
                factor: factor.to_string(),
                defect,
                column,
                direction: (0..n - offset).map(|i| usize::from(i == row).to_string()).collect(),
                multiplier: multiplier.to_string(),
            });
        }
        reached.push(modular);
    }
    let proven = plan.rank() == n;
    let rows = system.states[..n - offset].iter();
    proven.then(|| Construction {
        rows: rows
            .map(|name| SignalName::new(name).angle_of().filter(|_| offset > 0).unwrap_or(name).to_string())
            .collect(),
        input: plan.input.iter().map(|row| row.iter().map(i64::to_string).collect()).collect(),
        steps,
    })
}

/// The least number of inputs, and coprime square-free factors of the characteristic polynomial, those with most
/// independent eigenvectors first.
fn factors(images: &mut Images<'_>) -> Option<(usize, Vec<Polynomial>)> {
    let pieces = |image: &Image| {
        let field = &image.field;
        let radicals: Vec<Vec<Residue>> = spectrum::factors(field, &image.g)
            .iter()
            .map(|f| square_free(field, f).iter().fold(vec![field.one()], |all, (part, _)| product(field, &all, part)))
            .collect();
        // What the k-th factor from the end adds to the ones before it is missing in all of those.
        let mut before = vec![field.one()];
        let mut out = Vec::new();
        for radical in radicals {
            out.push(monic(field, &divide(field, &radical, &before).0));
            before = radical;
        }
        out
    };
    let layout: Vec<usize> = pieces(&*images.get(0)?).iter().map(Vec::len).collect();
    let flat = images.reconstruct(MOST_PRIMES, |image| {
        let found = pieces(image);
        let same = found.iter().map(Vec::len).eq(layout.iter().copied());
        let lower = found.iter().flat_map(|p| p[..p.len() - 1].iter().map(|&x| image.field.value(x)));
        same.then(|| lower.collect())
    })?;
    let mut lower = flat.into_iter();
    let mut out = Vec::new();
    for &length in &layout {
        out.extend(spectrum::with_leading_one(lower.by_ref().take(length - 1)).simple_factors());
    }
    Some((layout.len(), out))
}

/// Degree of the greatest common divisor.
fn shared(field: &PrimeField, a: &[Residue], b: &[Residue]) -> usize {
    gcd(field, a, b).len() - 1
}

/// The input matrix so far, modulo a prime.
struct Plan<'a> {
    image: &'a Image,
    /// Number of the state that the first row acts on.
    offset: usize,
    input: Vec<Vec<i64>>,
}

impl Plan<'_> {
    fn residues(&self, p: &Polynomial) -> Option<Vec<Residue>> {
        p.coefficients().iter().map(|c| self.image.field.rational(c)).collect()
    }

    /// E⁻¹B.
    fn columns(&self) -> ModularMatrix {
        let (field, n) = (&self.image.field, self.image.g.rows);
        let raw = ModularMatrix::from_fn(n, self.input[0].len(), |i, j| {
            if i < self.offset { 0 } else { field.integer(self.input[i - self.offset][j]) }
        });
        self.image.inverse_e.multiply(field, &raw)
    }

    fn rank(&self) -> usize {
        reachable(&self.image.field, &self.image.g, &self.columns()).span.dimension()
    }

    /// Invariant factors of the uncontrollable part.
    fn missed(&self) -> Vec<Vec<Residue>> {
        let (field, g) = (&self.image.field, &self.image.g);
        spectrum::quotient_factors(field, g, &reachable(field, g, &self.columns()).span)
    }

    /// The entry to change and by how much: of the rows that help, the one with which most states are reached.
    fn next(&self, missed: &[Vec<Residue>], f: &[Residue], reached: &[Vec<Residue>]) -> Option<(usize, usize, i64)> {
        let field = &self.image.field;
        let size = |missed: &[Vec<Residue>]| missed.iter().map(|part| part.len() - 1).sum::<usize>();
        let open = |missed: &[Vec<Residue>]| missed.iter().map(|part| shared(field, part, f)).sum::<usize>();
        let (before, most) = (open(missed), missed.last().map_or(0, |part| part.len() - 1));
        // One empty column is as good as another.
        let empty = |j: usize| self.input.iter().all(|row| row[j] == 0);
        let first_empty = (0..self.input[0].len()).find(|&j| empty(j));
        let columns: Vec<usize> =
            first_empty.into_iter().chain((0..self.input[0].len()).filter(|&j| !empty(j))).collect();
        let numbers = (1..=self.image.g.rows as i64 + 1).flat_map(|k| [k, -k]);
        let choices: Vec<(usize, i64)> = numbers.flat_map(|c| columns.iter().map(move |&j| (j, c))).collect();
        let mut best: Option<(usize, (usize, usize, i64))> = None;
        for row in self.helpful_rows(f) {
            let found = choices.iter().find_map(|&(column, multiplier)| {
                let mut input = self.input.clone();
                input[row][column] += multiplier;
                let missed = Plan { input, ..*self }.missed();
                let keeps = reached.iter().all(|old| missed.iter().all(|part| shared(field, part, old) == 0));
                (keeps && open(&missed) < before).then(|| (size(&missed), (row, column, multiplier)))
            });
            let Some(found) = found else { continue };
            if best.as_ref().is_none_or(|best| found.0 < best.0) {
                best = Some(found);
            }
            // A vector generates at most the degree of the largest invariant factor.
            if best.as_ref().is_some_and(|best| best.0 + most <= size(missed)) {
                break;
            }
        }
        best.map(|(_, step)| step)
    }

    /// Rows that some left vector w with `w f(E⁻¹A) = 0`, not reached so far, does not annihilate.
    fn helpful_rows(&self, f: &[Residue]) -> Vec<usize> {
        let (field, g) = (&self.image.field, &self.image.g);
        let part = reachable(field, g, &self.columns());
        let unreached = part.span.basis(g.rows).null_space(field);
        let mut value = ModularMatrix::zeros(unreached.rows, g.rows);
        for &c in f.iter().rev() {
            value = value.multiply(field, g).plus(field, c, &unreached);
        }
        let kernel = value.transpose().null_space(field).multiply(field, &unreached);
        let on_rows = self.image.inverse_e.multiply_from_left(field, &kernel);
        let helps = |i: &usize| (0..on_rows.rows).any(|k| on_rows.row(k)[self.offset + i] != 0);
        (0..self.input.len()).filter(helps).collect()
    }
}
