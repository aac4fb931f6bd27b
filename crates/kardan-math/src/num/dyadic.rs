//! Matrices of numbers with a finite count of binary digits, for bounds that whole numbers prove.

use dashu_int::ops::BitTest;
use dashu_int::{IBig, UBig};
use faer::Mat;
use kardan_rt::functions::exp2;

use super::{Matrix, Rational, rational_from_f64};

/// A matrix of whole multiples of 2^−digits; sums and products are exact.
#[derive(Clone)]
pub(super) struct DyadicMatrix {
    pub rows: usize,
    pub columns: usize,
    pub digits: usize,
    pub values: Vec<IBig>,
}

impl DyadicMatrix {
    /// An exact matrix, truncated to so many digits.
    pub fn of(matrix: &Matrix<Rational>, digits: usize) -> Self {
        let value = |x: &Rational| (x.numerator() << digits) / IBig::from(x.denominator().clone());
        let values = matrix.as_slice().iter().map(value).collect();
        Self { rows: matrix.rows(), columns: matrix.columns(), digits, values }
    }

    /// The floating-point result, truncated to so many digits; `None` if a number is not finite.
    pub fn of_f64(matrix: &Mat<f64>, digits: usize) -> Option<Self> {
        let exact = |i: usize, j: usize| rational_from_f64(matrix[(i, j)]).unwrap_or(Rational::ZERO);
        let of = || Self::of(&Matrix::from_fn(matrix.nrows(), matrix.ncols(), exact), digits);
        matrix.is_all_finite().then(of)
    }

    pub fn identity(n: usize) -> Self {
        let entry = |place: usize| IBig::from(u8::from(place.is_multiple_of(n + 1)));
        Self { rows: n, columns: n, digits: 0, values: (0..n * n).map(entry).collect() }
    }

    pub fn times(&self, other: &Self) -> Self {
        let mut values = Vec::with_capacity(self.rows * other.columns);
        for row in self.values.chunks(self.columns.max(1)) {
            for j in 0..other.columns {
                let column = other.values[j..].iter().step_by(other.columns);
                let terms = row.iter().zip(column).filter(|(a, b)| !a.is_zero() && !b.is_zero());
                values.push(terms.fold(IBig::ZERO, |sum, (a, b)| sum + a * b));
            }
        }
        Self { rows: self.rows, columns: other.columns, digits: self.digits + other.digits, values }
    }

    fn aligned(&self, other: &Self, of: impl Fn(IBig, IBig) -> IBig) -> Self {
        let digits = self.digits.max(other.digits);
        let [a, b] = [self, other].map(|one| one.values.iter().map(move |x| x << (digits - one.digits)));
        Self { digits, values: a.zip(b).map(|(a, b)| of(a, b)).collect(), ..*self }
    }

    pub fn plus(&self, other: &Self) -> Self {
        self.aligned(other, |a, b| a + b)
    }

    pub fn minus(&self, other: &Self) -> Self {
        self.aligned(other, |a, b| a - b)
    }

    /// A part of it, truncated.
    pub fn over(&self, number: usize) -> Self {
        let number = IBig::from(number);
        Self { values: self.values.iter().map(|value| value / &number).collect(), ..*self }
    }

    pub fn transposed(&self) -> Self {
        let values = (0..self.columns).flat_map(|j| self.values[j..].iter().step_by(self.columns).cloned());
        Self { rows: self.columns, columns: self.rows, digits: self.digits, values: values.collect() }
    }

    pub fn block(&self, [top, bottom]: [usize; 2], [from, to]: [usize; 2]) -> Self {
        let rows = self.values.chunks(self.columns.max(1)).take(bottom).skip(top);
        let values = rows.flat_map(|row| row[from..to].iter().cloned()).collect();
        Self { rows: bottom - top, columns: to - from, digits: self.digits, values }
    }

    /// With fewer digits; each entry changes by less than 2^−digits.
    pub fn cut(self, digits: usize) -> Self {
        let less = self.digits.saturating_sub(digits);
        Self { digits: self.digits - less, values: self.values.into_iter().map(|x| x >> less).collect(), ..self }
    }

    pub fn to_f64(&self) -> Mat<f64> {
        Mat::from_fn(self.rows, self.columns, |i, j| floating(&self.values[i * self.columns + j], self.digits))
    }

    pub fn to_rational(&self) -> Matrix<Rational> {
        let value = |x: &IBig| Rational::from_parts(x.clone(), UBig::ONE << self.digits);
        Matrix::from_fn(self.rows, self.columns, |i, j| value(&self.values[i * self.columns + j]))
    }

    /// The largest sum of sizes in a row, rounded up.
    pub fn row_norm(&self) -> f64 {
        let shift = self.digits.saturating_sub(64);
        let unit = exp2(shift as f64 - self.digits as f64);
        let row = |row: &[IBig]| row.iter().map(|x| ((x >> shift).to_f64().value().abs() + 1.0) * unit).sum::<f64>();
        self.values.chunks(self.columns.max(1)).map(row).fold(0.0, f64::max) * (1.0 + 1e-9)
    }

    /// Frobenius' norm, rounded up.
    pub fn norm(&self) -> f64 {
        let sum = self.values.iter().map(|x| floating(x, self.digits)).map(|x| x * x).sum::<f64>();
        sum.sqrt() * (1.0 + 1e-9) + 1e-150
    }
}

/// x 2^−digits, to rounding.
fn floating(x: &IBig, digits: usize) -> f64 {
    let cut = x.bit_len().saturating_sub(64);
    (x >> cut).to_f64().value() * exp2(cut as f64 - digits as f64)
}
