//! The transfer matrix of a system over one denominator.

use dashu_int::ops::BitTest;
use dashu_int::{IBig, UBig};

use super::{
    Matrix, ModularMatrix, Polynomial, PrimeField, Rational, Reconstruction, Residue, common_denominator, prime_fields,
    whole_multiple,
};

/// `C (sI − A)⁻¹ B + D` over one denominator.
pub struct Resolvent {
    /// `det(sI − A)`.
    pub characteristic: Polynomial,
    /// Numerators, outputs × inputs.
    pub numerators: Vec<Vec<Polynomial>>,
}

/// The transfer matrix over the characteristic polynomial.
///
/// Method: with rows scaled to whole numbers, `det(sI − A)` and the bordered determinants `[sI − A, −B_j; C_i, D_ij]` have
/// whole coefficients, bounded by the products of the absolute sums of their rows. They are computed modulo enough primes:
/// the numerators are the polynomial part of `det(sI − A) Σ C Aᵏ B s^(−k−1)`.
///
/// # Panics
/// If A is not square or the shapes do not fit.
pub fn resolvent(a: &Matrix<Rational>, b: &Matrix<Rational>, c: &Matrix<Rational>, d: &Matrix<Rational>) -> Resolvent {
    let n = a.rows();
    assert!(
        a.columns() == n && b.rows() == n && c.columns() == n && (d.rows(), d.columns()) == (c.rows(), b.columns()),
        "matrices of different shapes"
    );
    let states = WholeRows::new(a, b);
    let outputs = WholeRows::new(c, d);
    let state_bits: usize = (0..n).map(|i| (states.size(i) + &states.scales[i]).bit_len()).sum();
    let output_bits = (0..c.rows()).map(|i| outputs.size(i).bit_len()).max().unwrap_or(0);
    let needed = state_bits + output_bits + 2;
    let (m, mut bits) = (b.columns(), 0);
    let mut reconstruction = Reconstruction::new();
    for field in prime_fields() {
        let Some((image_a, image_b, scale)) = states.image(&field, n, m) else { continue };
        let Some((image_c, image_d, _)) = outputs.image(&field, n, m) else { continue };
        let characteristic = image_a.characteristic_polynomial(&field);
        let scaled = |x: Residue, factor: Residue| field.value(field.times(x, factor));
        let mut values: Vec<u64> = characteristic.iter().map(|&x| scaled(x, scale)).collect();
        let transposed = image_a.transpose();
        for i in 0..c.rows() {
            let factor = field.times(scale, field.whole(&IBig::from(outputs.scales[i].clone())));
            let markov = markov(&field, image_c.row(i), &transposed, &image_b);
            for j in 0..m {
                let through = image_d.row(i)[j];
                values.extend((0..=n).map(|k| {
                    // Σ_{l>k} χ_l h_{l−1−k} + D χ_k
                    let direct = field.times(through, characteristic[k]);
                    scaled(field.plus(direct, field.dot(&characteristic[k + 1..], &markov[j][..n - k])), factor)
                }));
            }
        }
        reconstruction.add(field.prime(), &values);
        bits += 60;
        if bits >= needed {
            break;
        }
    }
    let scale = states.scales.iter().fold(UBig::ONE, |all, x| all * x);
    let coefficients = reconstruction.integers();
    let mut parts = coefficients.chunks(n + 1);
    let mut next = |scale: &UBig| {
        let part = parts.next().unwrap_or_default();
        Polynomial::new(part.iter().map(|x| Rational::from_parts(x.clone(), scale.clone())).collect())
    };
    let characteristic = next(&scale);
    let row = |i: usize| (0..m).map(|_| next(&(&scale * &outputs.scales[i]))).collect();
    Resolvent { characteristic, numerators: (0..c.rows()).map(row).collect() }
}

/// `c Aᵏ B_j` for k < n: one list for each column j.
fn markov(field: &PrimeField, c: &[Residue], transposed: &ModularMatrix, b: &ModularMatrix) -> Vec<Vec<Residue>> {
    let columns: Vec<Vec<Residue>> = (0..b.columns).map(|j| b.column(j)).collect();
    let mut out = vec![Vec::with_capacity(transposed.rows); b.columns];
    if columns.is_empty() {
        return out;
    }
    let mut row = c.to_vec();
    for _ in 0..transposed.rows {
        out.iter_mut().zip(&columns).for_each(|(list, column)| list.push(field.dot(&row, column)));
        row = transposed.apply(field, &row);
    }
    out
}

/// `[left right]` with every row multiplied by its common denominator.
struct WholeRows {
    left: Vec<Vec<IBig>>,
    right: Vec<Vec<IBig>>,
    scales: Vec<UBig>,
}

impl WholeRows {
    fn new(left: &Matrix<Rational>, right: &Matrix<Rational>) -> Self {
        let scales: Vec<UBig> =
            (0..left.rows()).map(|i| common_denominator(left.row(i).iter().chain(right.row(i)))).collect();
        let row = |m: &Matrix<Rational>, i: usize| m.row(i).iter().map(|x| whole_multiple(x, &scales[i])).collect();
        let rows = |m: &Matrix<Rational>| (0..scales.len()).map(|i| row(m, i)).collect();
        Self { left: rows(left), right: rows(right), scales }
    }

    /// The sum of the absolute entries of a row.
    fn size(&self, i: usize) -> UBig {
        self.left[i].iter().chain(&self.right[i]).fold(UBig::ZERO, |sum, x| sum + x.clone().into_parts().1)
    }

    /// The rational matrices modulo a prime, and the product of the scales; `None` if the prime divides a scale.
    fn image(
        &self,
        field: &PrimeField,
        columns: usize,
        right_columns: usize,
    ) -> Option<(ModularMatrix, ModularMatrix, Residue)> {
        let scales: Vec<Residue> = self.scales.iter().map(|x| field.whole(&IBig::from(x.clone()))).collect();
        if scales.contains(&0) {
            return None;
        }
        let inverses: Vec<Residue> = scales.iter().map(|&x| field.inverse(x)).collect();
        let image = |rows: &[Vec<IBig>], columns: usize| {
            ModularMatrix::from_fn(rows.len(), columns, |i, j| {
                let entry = &rows[i][j];
                if *entry == IBig::ZERO { 0 } else { field.times(field.whole(entry), inverses[i]) }
            })
        };
        let product = scales.iter().fold(field.one(), |all, &x| field.times(all, x));
        Some((image(&self.left, columns), image(&self.right, right_columns), product))
    }
}
