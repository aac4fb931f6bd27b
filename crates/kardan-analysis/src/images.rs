//! Images of a system modulo primes.

use std::sync::{Arc, OnceLock};

use super::{LinearSystem, Side};
use kardan_math::num::{
    Matrix, ModularMatrix, Operator, PrimeField, Primes, Random, Rational, Reconstruction, Residue,
};

/// A system modulo a prime.
#[derive(Debug, Clone)]
pub(super) struct Image {
    pub field: PrimeField,
    pub c: ModularMatrix,
    pub d: ModularMatrix,
    pub inverse_e: Operator,
    /// det E.
    pub determinant: Residue,
    /// E⁻¹A.
    pub g: ModularMatrix,
    /// E⁻¹B.
    pub b: ModularMatrix,
}

impl Image {
    /// `None` if E is singular modulo the prime, or the prime divides a denominator.
    pub fn new(system: &LinearSystem, prime: u64) -> Option<Self> {
        Self::of(system, Side::Inputs, prime)
    }

    /// The same; with [`Side::Outputs`] of the transposed system. No more matrices are in memory at once than needed: each takes that of
    /// the square of the states.
    pub fn of(system: &LinearSystem, side: Side, prime: u64) -> Option<Self> {
        let field = PrimeField::new(prime);
        let image = |matrix: &Matrix<Rational>| {
            let image = ModularMatrix::from_rational(&field, matrix)?;
            Some(if side == Side::Inputs { image } else { image.transpose() })
        };
        let [b, c] = if side == Side::Inputs { [&system.b, &system.c] } else { [&system.c, &system.b] };
        let (inverse, determinant) = image(&system.e)?.inverse(&field)?;
        let g = inverse.multiply(&field, &image(&system.a)?);
        let b = inverse.multiply(&field, &image(b)?);
        let inverse_e = Operator::new(&inverse);
        Some(Self { c: image(c)?, d: image(&system.d)?, field, inverse_e, determinant, g, b })
    }
}

/// Most numbers stored in images; further ones are computed again each time.
const MOST_STORED: usize = 40_000_000;

/// A system modulo as many primes as requested.
pub(super) struct Images<'a> {
    system: &'a LinearSystem,
    /// Where the images are those of the transposed system: its place, filled at the first request.
    dual: Option<&'a OnceLock<LinearSystem>>,
    primes: Vec<u64>,
    images: Vec<Arc<Image>>,
    source: Primes,
}

/// The values of all entries, row by row: what [`Images::reconstruct`] brings back.
pub(super) fn values(field: &PrimeField, matrix: &ModularMatrix) -> Vec<u64> {
    (0..matrix.rows).flat_map(|i| matrix.row(i).iter().map(|&x| field.value(x))).collect()
}

/// A number that is the same for the same matrices (FNV-1a over their entries).
pub(super) fn fingerprint(system: &LinearSystem) -> u64 {
    let mut hash = Random::FNV;
    let mut add = |bytes: &[u8]| hash = Random::fnv(hash, bytes);
    for matrix in [&system.e, &system.a, &system.b, &system.c, &system.d] {
        add(&[matrix.rows(), matrix.columns()].map(|x| x as u64).map(u64::to_le_bytes).concat());
        for (at, x) in matrix.as_slice().iter().enumerate().filter(|(_, x)| !x.is_zero()) {
            add(&(at as u64).to_le_bytes());
            add(&x.numerator().to_le_bytes());
            add(&x.denominator().to_le_bytes());
        }
    }
    hash
}

impl<'a> Images<'a> {
    /// Modulo these primes, but those that divide det E or a denominator.
    pub fn new(system: &'a LinearSystem, source: Primes) -> Self {
        Self { system, dual: None, primes: Vec::new(), images: Vec::new(), source }
    }

    /// Of the transposed system.
    pub fn of_dual(system: &'a LinearSystem, dual: &'a OnceLock<LinearSystem>, source: Primes) -> Self {
        Self { dual: Some(dual), ..Self::new(system, source) }
    }

    /// The system of the images.
    pub fn system(&self) -> &'a LinearSystem {
        self.dual.map_or(self.system, |dual| dual.get_or_init(|| self.system.transpose()))
    }

    /// The image modulo any prime.
    pub fn modulo(&self, prime: u64) -> Option<Image> {
        Image::of(self.system, if self.dual.is_some() { Side::Outputs } else { Side::Inputs }, prime)
    }

    /// Modulo unpredictable primes.
    pub fn unforeseen(system: &'a LinearSystem) -> Self {
        Self::new(system, Primes::unforeseen(fingerprint(system)))
    }

    /// The image modulo the prime of that number; `None` if E is singular modulo eight primes in a row.
    pub fn get(&mut self, number: usize) -> Option<Arc<Image>> {
        while self.primes.len() <= number {
            let next = (0..8).find_map(|_| self.source.next().and_then(|prime| self.modulo(prime)).map(Arc::new))?;
            self.primes.push(next.field.prime());
            let size = self.system.states.len().pow(2).max(1);
            // The stored ones are the first ones.
            if self.images.len() + 1 == self.primes.len() && self.images.len() < MOST_STORED / (2 * size) {
                self.images.push(next);
            } else if self.primes.len() > number {
                return Some(next);
            }
        }
        match self.images.get(number) {
            Some(image) => Some(image.clone()),
            None => self.modulo(self.primes[number]).map(Arc::new),
        }
    }

    /// Leaves out the first images, which have misled.
    pub fn forget(&mut self, count: usize) {
        self.primes.drain(..count.min(self.primes.len()));
        self.images.drain(..count.min(self.images.len()));
    }

    /// Fractions whose images `compute` gives, confirmed modulo one further prime; primes for which it gives none are left
    /// out. `None` if `limit` primes are not enough.
    pub fn reconstruct(&mut self, limit: usize, compute: impl Fn(&Image) -> Option<Vec<u64>>) -> Option<Vec<Rational>> {
        self.reconstruct_if(limit, |image| Some(compute(image)))
    }

    /// The same; `None` at once where `compute` gives `None`: where an image shows that there are no such numbers.
    pub fn reconstruct_if(
        &mut self,
        limit: usize,
        compute: impl Fn(&Image) -> Option<Option<Vec<u64>>>,
    ) -> Option<Vec<Rational>> {
        let mut all = Reconstruction::new();
        let mut candidate: Option<Vec<Rational>> = None;
        let (mut used, mut next_try) = (0, 1);
        for number in 0..limit {
            let image = self.get(number)?;
            let Some(values) = compute(&image)? else { continue };
            let field = image.field;
            if let Some(found) = &candidate {
                let agrees = |(x, &image): (&Rational, &u64)| field.rational(x).map(|x| field.value(x)) == Some(image);
                if found.len() == values.len() && found.iter().zip(&values).all(agrees) {
                    return candidate;
                }
            }
            all.add(field.prime(), &values);
            used += 1;
            candidate = None;
            if used == next_try {
                candidate = all.fractions();
                next_try = used + 1 + used / 4;
            }
        }
        None
    }
}
